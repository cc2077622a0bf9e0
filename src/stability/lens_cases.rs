//! Extreme lenses and rays.

use glam::DVec3;
use ivcam_base::diag::Result;
use ivcam_base::math::{Double, Meters};
use ivcam_optics::lens::{FocusMethod, Lens, LensRay, Prescription, Surface};
use ivcam_optics::prescription::Medium;

use super::case::Case;
use super::lens_reference::{ReferenceInputs, ReferenceRay, distance};

/// A computation may be as wrong as this many roundings of each number.
const ROUNDINGS: f64 = 4.0;

/// Rows of radius, thickness and index, in millimeters.
fn lens(rows: &[[f64; 3]]) -> Lens {
    let row = |&[r, t, n]: &[f64; 3]| Surface::sphere(r, t, Medium::constant(n), f64::INFINITY);
    Lens::new(Prescription::new("case", rows.iter().map(row).collect()))
}

fn ray(origin: [f64; 3], direction: [f64; 3]) -> LensRay {
    LensRay::new(DVec3::from_array(origin), DVec3::from_array(direction))
}

/// Returns the case of a ray through a lens. The expected number and the one found are the y of the
/// direction behind the lens.
fn traced(name: impl Into<String>, lens: &Lens, ray: &LensRay) -> Case {
    let inputs = ReferenceInputs::of(lens, ray);
    let expected = inputs.trace();
    let got = lens.trace_from_scene(ray).ok();
    let found = got.map(|r| {
        let ([x, y, z], [dx, dy, dz]) = (r.origin.to_array(), r.direction.to_array());
        [x, y, z, dx, dy, dz].map(Double::from)
    });
    let y = |answer: &Option<ReferenceRay>| answer.map_or(f64::NAN, |a| a[4].rounded());
    let (error, bound) = match (&expected, &found) {
        (Some(exact), Some(found)) => (
            distance(exact, found),
            ROUNDINGS * inputs.rounding(exact) + f64::EPSILON,
        ),
        // Both lose the ray, which is the right answer. If only one does, the case fails.
        (None, None) => (0.0, 0.0),
        _ => (f64::NAN, 0.0),
    };
    Case {
        name: name.into(),
        expected: y(&expected),
        got: y(&found),
        error,
        bound,
    }
}

/// Computes the cases of lenses.
///
/// # Errors
/// Returns an error if a lens of the library cannot be read.
pub(crate) fn lens_cases() -> Result<Vec<Case>> {
    let mut cases = Vec::new();
    cases.extend(surfaces());
    cases.extend(bending());
    let gauss = Lens::open("double-gauss")?;
    cases.extend(whole(&gauss));
    cases.extend(focusing(&gauss));
    cases.extend(stopping(&gauss)?);
    Ok(cases)
}

/// Nearly plane surfaces, rims of hemispheres, and rays from far away.
fn surfaces() -> Vec<Case> {
    let mut cases = Vec::new();
    for power in [3, 9, 15, 18] {
        let flat = lens(&[[libm::pow(10.0, f64::from(power)), 0.0, 1.5]]);
        let oblique = ray([0.3, 8.0, -5.0], [0.1, -0.2, 1.0]);
        cases.push(traced(format!("radius 1e{power} mm"), &flat, &oblique));
    }
    let hemisphere = lens(&[[10.0, 0.0, 1.5]]);
    for bits in [10, 20, 40, 50] {
        let y = 10.0 * (1.0 - libm::exp2(-f64::from(bits)));
        let name = format!("hemisphere, 2^-{bits} of its radius inside the rim");
        cases.push(traced(
            name,
            &hemisphere,
            &ray([0.0, y, -5.0], [0.0, 0.0, 1.0]),
        ));
    }
    let outside = ray([0.0, 10.1, -5.0], [0.0, 0.0, 1.0]);
    cases.push(traced("hemisphere, outside the rim", &hemisphere, &outside));
    let singlet = lens(&[[50.0, 5.0, 1.5], [-50.0, 0.0, 1.0]]);
    for power in [3, 6, 9, 12] {
        let far = libm::pow(10.0, f64::from(power));
        let from_far = ray([0.0, 0.01 * far, -far], [0.0, -0.01 * far + 3.0, far]);
        cases.push(traced(
            format!("from 1e{power} mm away"),
            &singlet,
            &from_far,
        ));
    }
    let ball = lens(&[[10.0, 20.0, 1.5], [-10.0, 0.0, 1.0]]);
    for y in [0.0, 1e-9, 5.0, 9.0, 9.999] {
        let parallel = ray([0.0, y, -30.0], [0.0, 0.0, 1.0]);
        cases.push(traced(
            format!("ball lens, f/0.75, height {y} mm"),
            &ball,
            &parallel,
        ));
    }
    cases
}

/// Rays that graze a surface, almost total reflection, and almost equal indices.
fn bending() -> Vec<Case> {
    let mut cases = Vec::new();
    let plane = lens(&[[0.0, 0.0, 1.5]]);
    for cos in [1e-3, 1e-6, 1e-9, 1e-12] {
        let grazing = ray([0.0, 2.0, -cos], [0.0, 1.0, cos]);
        cases.push(traced(format!("grazing, cosine {cos:e}"), &plane, &grazing));
    }
    let mut out_of_glass = plane.prescription().clone();
    out_of_glass.object_medium = Medium::constant(1.5);
    out_of_glass.surfaces[0].medium = Medium::constant(1.0);
    let out_of_glass = Lens::new(out_of_glass);
    for short in [1e-3, 1e-6, 1e-9, 1e-12, -1e-12] {
        let sin: f64 = (1.0 - short) / 1.5;
        let steep = ray([0.0, 0.0, -1.0], [0.0, sin, (1.0 - sin * sin).sqrt()]);
        let name = format!("{short:e} short of total reflection");
        cases.push(traced(name, &out_of_glass, &steep));
    }
    for bits in [10, 20, 40, 50] {
        let slight = lens(&[[20.0, 0.0, 1.0 + libm::exp2(-f64::from(bits))]]);
        let high = ray([0.0, 8.0, -30.0], [0.0, 0.0, 1.0]);
        cases.push(traced(format!("index step 2^-{bits}"), &slight, &high));
    }
    cases
}

/// Whole lenses: tiny, huge, with long gaps, and with many surfaces.
fn whole(gauss: &Lens) -> Vec<Case> {
    let mut cases = Vec::new();
    let focal = gauss.first_order().focal.map_or(50.0, |f| f.efl);
    for power in [-9, -3, 0, 3, 9] {
        let scale = libm::pow(10.0, f64::from(power));
        let lens = gauss.scaled(scale);
        let at = |x: f64| x * scale * focal;
        let name = format!("double Gauss, scale 1e{power}");
        let oblique = ray([at(0.01), at(0.1), at(-2.0)], [0.0, -0.05, 1.0]);
        cases.push(traced(name, &lens, &oblique));
    }
    for gap in [1e3, 1e6, 1e9] {
        let pair = lens(&[
            [50.0, 5.0, 1.5],
            [-50.0, gap, 1.0],
            [0.0, 5.0, 1.5],
            [0.0, 0.0, 1.0],
        ]);
        let near_axis = ray([0.0, 1.0, -10.0], [0.0, 0.0, 1.0]);
        cases.push(traced(format!("a gap of {gap:e} mm"), &pair, &near_axis));
    }
    for count in [10, 100, 900] {
        let rows: Vec<[f64; 3]> = (0..count)
            .map(|i| match i % 2 {
                0 => [400.0, 0.1, 1.5],
                _ => [-400.0, 0.1, 1.0],
            })
            .collect();
        let relay = lens(&rows);
        let name = format!("{count} surfaces");
        cases.push(traced(
            name,
            &relay,
            &ray([0.0, 1.0, -1.0], [0.0, 0.0, 1.0]),
        ));
    }
    cases
}

/// The place of the film for objects from near to the end of the world, by the lens equation.
fn focusing(gauss: &Lens) -> Vec<Case> {
    let axis = ray([0.0; 3], [0.0, 0.0, 1.0]);
    let inputs = ReferenceInputs::of(gauss, &axis);
    let case = |meters: f64| {
        let expected = gauss.length() + inputs.paraxial_image(1e3 * meters);
        let focus = gauss.focus(FocusMethod::Film, Meters(meters));
        let got = focus.map_or(f64::NAN, |focus| focus.film_z);
        let name = format!("film of the double Gauss for {meters:e} m, mm");
        // Each surface adds a few roundings to the film's place.
        let roundings = 8.0 * gauss.prescription().surfaces.len() as f64;
        Case::of(name, expected, got, roundings * f64::EPSILON)
    };
    [0.2, 1.0, 1e3, 1e6, 1e9].map(case).into()
}

/// Stops down to f/50,000, where real rays and paraxial ones have the same f-number. For a lens
/// without coma they differ as a sine and a tangent do, by 1/(8 N²).
fn stopping(gauss: &Lens) -> Result<Vec<Case>> {
    let case = |f_number: f64| {
        let lens = gauss.at_f_number(f_number)?;
        let paraxial = lens.first_order().f_number().unwrap_or(f64::NAN);
        let name = format!("paraxial f-number at f/{f_number}");
        let bound = 0.125 / (f_number * f_number) + 1e-9;
        Ok(Case::of(name, f_number, paraxial, bound))
    };
    [4.0, 50.0, 5e3, 5e4].map(case).into_iter().collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_error_of_every_extreme_lens_is_within_its_bound() {
        for case in lens_cases().expect("the lens is shipped") {
            assert!(case.holds(), "{case:?}");
        }
    }

    /// A bound near 1 would allow any direction.
    #[test]
    fn bounds_are_small_enough_to_fail() {
        for case in lens_cases().expect("the lens is shipped") {
            assert!(case.bound < 1e-2, "{case:?}");
        }
        let plane = lens(&[[0.0, 0.0, 1.5]]);
        let steep = ray([0.0, 0.0, -1.0], [0.0, 0.6, 0.8]);
        let inputs = ReferenceInputs::of(&plane, &steep);
        let mut wrong = inputs.trace().expect("a plane is hit");
        wrong[4] = wrong[4] + Double::from(1e-14);
        let exact = inputs.trace().expect("a plane is hit");
        assert!(distance(&exact, &wrong) > ROUNDINGS * inputs.rounding(&exact) + f64::EPSILON);
    }
}
