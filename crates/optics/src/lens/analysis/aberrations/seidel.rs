//! Seidel sums: the third-order aberrations of each surface.
//!
//! The formulas are Welford's (Aberrations of Optical Systems, chapter 8), in millimeters: the
//! wavefront aberrations at the edge of pupil and field are S_I/8 (spherical), S_II/2 (coma),
//! S_III/2 (astigmatism), (S_III + S_IV)/4 (field curvature), S_V/2 (distortion), C_I/2 (axial
//! color from the C to the F line) and C_II (lateral color).

use serde::Serialize;

use crate::lens::lens::Lens;
use crate::prescription::surface::{Meridian, Shape, Surface};

/// The Seidel coefficients of a surface or their sums, in millimeters.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize)]
pub struct Seidel {
    /// Spherical aberration.
    pub s1: f64,
    /// Coma.
    pub s2: f64,
    /// Astigmatism.
    pub s3: f64,
    /// Petzval curvature.
    pub s4: f64,
    /// Distortion.
    pub s5: f64,
    /// Axial color, from the longest to the shortest of the lens's spectral lines.
    pub c1: f64,
    /// Lateral color, likewise.
    pub c2: f64,
}

impl Seidel {
    /// The coefficients in the order S_I to S_V, C_I, C_II.
    pub fn values(&self) -> [f64; 7] {
        let Self {
            s1,
            s2,
            s3,
            s4,
            s5,
            c1,
            c2,
        } = *self;
        [s1, s2, s3, s4, s5, c1, c2]
    }

    fn add(&mut self, other: &Self) {
        self.s1 += other.s1;
        self.s2 += other.s2;
        self.s3 += other.s3;
        self.s4 += other.s4;
        self.s5 += other.s5;
        self.c1 += other.c1;
        self.c2 += other.c2;
    }
}

/// The Seidel coefficients of a lens.
#[derive(Clone, Debug, Serialize)]
pub struct SeidelSums {
    /// The height of the marginal ray at the front vertex, in millimeters: that of the widest real
    /// ray from the axis.
    pub marginal_height: f64,
    /// The height of the paraxial image, in millimeters.
    pub image_height: f64,
    /// The optical invariant n (u ȳ − ū y), in millimeters.
    pub invariant: f64,
    /// The coefficients of each surface.
    pub surfaces: Vec<Seidel>,
    /// Their sums.
    pub sum: Seidel,
}

/// A paraxial ray: the height in millimeters and the slope behind it.
#[derive(Clone, Copy)]
struct ParaxialRay {
    y: f64,
    u: f64,
}

impl SeidelSums {
    /// The coefficients for an object at a distance in front of the first vertex, a marginal ray
    /// of a height at that vertex and a paraxial image height. Lengths are in millimeters. Returns
    /// none for a lens without rotational symmetry, without a stop or without an image, and for
    /// aspheres with terms of the first or third power, which have no Seidel coefficients.
    pub fn of(lens: &Lens, distance: f64, marginal_height: f64, image_height: f64) -> Option<Self> {
        let surfaces = &lens.prescription().surfaces;
        let is_smooth = |s: &Surface| fourth_power(s).is_some();
        if !surfaces.iter().all(is_smooth) || lens.prescription().is_decentered() {
            return None;
        }
        let indices = lens.prescription().indices(lens.wavelength());
        let marginal = ParaxialRay {
            y: marginal_height,
            u: match distance.is_finite() {
                true => marginal_height / distance,
                false => 0.0,
            },
        };
        let pupil = lens.first_order().entrance_pupil?;
        let unit = ParaxialRay {
            y: -pupil.z,
            u: 1.0,
        };
        let chief = scaled_chief(lens, &indices, marginal, unit, image_height)?;
        let [short, _, long] = lens.spectral_lines();
        let shifts = [short, long].map(|nm| lens.prescription().indices(nm));
        let (mut a, mut b) = (marginal, chief);
        let invariant = indices[0] * (a.u * b.y - b.u * a.y);
        let mut all = Vec::with_capacity(surfaces.len());
        for (i, surface) in surfaces.iter().enumerate() {
            let n = [indices[i], indices[i + 1]];
            let spread = [0, 1].map(|k| shifts[0][i + k] - shifts[1][i + k]);
            let (a_out, b_out) = (refracted(a, surface, n), refracted(b, surface, n));
            all.push(contribution(surface, n, spread, (a, a_out.u), b, invariant));
            (a, b) = (
                moved(a_out, surface.thickness),
                moved(b_out, surface.thickness),
            );
        }
        let mut sum = Seidel::default();
        all.iter().for_each(|surface| sum.add(surface));
        Some(Self {
            marginal_height,
            image_height,
            invariant,
            surfaces: all,
            sum,
        })
    }
}

/// The chief ray through the entrance pupil's center whose paraxial image is at a height.
fn scaled_chief(
    lens: &Lens,
    indices: &[f64],
    marginal: ParaxialRay,
    unit: ParaxialRay,
    image_height: f64,
) -> Option<ParaxialRay> {
    let through = |mut ray: ParaxialRay| {
        for (i, surface) in lens.prescription().surfaces.iter().enumerate() {
            ray = refracted(ray, surface, [indices[i], indices[i + 1]]);
            if i + 1 < lens.prescription().surfaces.len() {
                ray = moved(ray, surface.thickness);
            }
        }
        ray
    };
    let (a, b) = (through(marginal), through(unit));
    // The paraxial image is where the marginal ray crosses the axis.
    let image = b.y - a.y / a.u * b.u;
    let scale = image_height / image;
    scale.is_finite().then_some(ParaxialRay {
        y: scale * unit.y,
        u: scale * unit.u,
    })
}

fn refracted(ray: ParaxialRay, surface: &Surface, n: [f64; 2]) -> ParaxialRay {
    let power = surface.power(n, Meridian::Y);
    ParaxialRay {
        y: ray.y,
        u: (n[0] * ray.u - ray.y * power) / n[1],
    }
}

fn moved(ray: ParaxialRay, gap: f64) -> ParaxialRay {
    ParaxialRay {
        y: ray.y + gap * ray.u,
        u: ray.u,
    }
}

/// The coefficients of one surface: `marginal` with its slope behind the surface, and the chief ray
/// in front of it.
fn contribution(
    surface: &Surface,
    n: [f64; 2],
    spread: [f64; 2],
    (marginal, slope): (ParaxialRay, f64),
    chief: ParaxialRay,
    invariant: f64,
) -> Seidel {
    if let Shape::ThinLens { .. } = surface.shape {
        // It images every point sharply, and planes on planes to scale.
        return Seidel::default();
    }
    let c = surface.vertex_curvature(Meridian::Y);
    let ParaxialRay { y, u } = marginal;
    let bar = chief.y;
    let a = n[0] * (u + y * c);
    let a_bar = n[0] * (chief.u + bar * c);
    let step = slope / n[1] - u / n[0];
    // The index behind a mirror is −n. Its sign cancels in all other terms.
    let inverse = match surface.is_mirror {
        true => -2.0 / n[0],
        false => 1.0 / n[1] - 1.0 / n[0],
    };
    let inverse_squares = 1.0 / (n[1] * n[1]) - 1.0 / (n[0] * n[0]);
    let color = spread[1] / n[1] - spread[0] / n[0];
    let bent = 8.0 * surface.index_step(n) * fourth_power(surface).unwrap_or(0.0);
    // This form of S_V has no division by the marginal ray's angle of incidence, which may be 0.
    let distortion = -a_bar * a_bar * a_bar * y * inverse_squares
        + a_bar * bar * (a_bar * y - invariant) * c * inverse;
    Seidel {
        s1: -a * a * y * step + bent * y.powi(4),
        s2: -a * a_bar * y * step + bent * y.powi(3) * bar,
        s3: -a_bar * a_bar * y * step + bent * y * y * bar * bar,
        s4: -invariant * invariant * c * inverse,
        s5: distortion + bent * y * bar.powi(3),
        c1: a * y * color,
        c2: a_bar * y * color,
    }
}

/// The coefficient of r⁴ by which a surface departs from the sphere of its vertex curvature; none
/// if it is not smooth there or not rotational.
fn fourth_power(surface: &Surface) -> Option<f64> {
    let base = surface.curvature.per_mm();
    match &surface.shape {
        Shape::Sphere | Shape::ThinLens { .. } => Some(0.0),
        Shape::Conic { k } => Some(k * base.powi(3) / 8.0),
        Shape::Asphere { k, terms } => {
            let vertex = surface.vertex_curvature(Meridian::Y);
            let own = (1.0 + k) * base.powi(3) / 8.0 + terms[4];
            (terms[1] == 0.0 && terms[3] == 0.0).then(|| own - vertex.powi(3) / 8.0)
        }
        Shape::NormalAsphere { k, terms } => {
            let vertex = surface.vertex_curvature(Meridian::Y);
            // The cosine of the normal's angle is 1 − c² r²/2.
            let departure = terms[4] + 0.5 * terms[2] * base * base;
            Some((1.0 + k) * base.powi(3) / 8.0 + departure - vertex.powi(3) / 8.0)
        }
        _ => None,
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::prescription::{Curvature, Medium, Prescription};

    /// A thin lens with the stop at it (Welford, equations 12.30 to 12.34).
    #[test]
    fn a_thin_lens_has_the_sums_of_the_textbook() {
        let (n, f, y, image): (f64, f64, f64, f64) = (1.5, 100.0, 5.0, 10.0);
        for (c1, c2) in [(0.02, 0.0), (0.01, -0.01), (0.0, -0.02)] {
            let thin = 1e-9;
            let lens = Lens::new(Prescription::new(
                "thin",
                vec![
                    Surface::stop(0.0, Medium::air(), y),
                    Surface::sphere(
                        if c1 == 0.0 { 0.0 } else { 1.0 / c1 },
                        thin,
                        Medium::constant(n),
                        20.0,
                    ),
                    Surface::sphere(
                        if c2 == 0.0 { 0.0 } else { 1.0 / c2 },
                        0.0,
                        Medium::air(),
                        20.0,
                    ),
                ],
            ));
            let sums = SeidelSums::of(&lens, f64::INFINITY, y, image).unwrap();
            let (power, h) = (1.0 / f, y * image / f);
            // The shape factor, and the magnification factor for an object at infinity.
            let (shape, at): (f64, f64) = ((c1 + c2) / (c1 - c2), -1.0);
            let s1 = y.powi(4) * power.powi(3) / 4.0
                * ((n / (n - 1.0)).powi(2)
                    + (n + 2.0) / (n * (n - 1.0).powi(2))
                        * (shape + 2.0 * (n * n - 1.0) / (n + 2.0) * at).powi(2)
                    - n / (n + 2.0) * at * at);
            assert!(
                (sums.sum.s1 / s1 - 1.0).abs() < 1e-6,
                "{} {s1}",
                sums.sum.s1
            );
            assert!(
                (sums.sum.s3 / (h * h * power) - 1.0).abs() < 1e-6,
                "{}",
                sums.sum.s3
            );
            assert!((sums.sum.s4 / (h * h * power / n) - 1.0).abs() < 1e-6);
            assert!(sums.sum.s5.abs() < 1e-6 * sums.sum.s3);
            let s2 = y * y * power * power * h / 2.0
                * ((n + 1.0) / (n * (n - 1.0)) * shape + (2.0 * n + 1.0) / n * at);
            assert!(
                (sums.sum.s2.abs() / s2.abs() - 1.0).abs() < 1e-6,
                "{} {s2}",
                sums.sum.s2
            );
        }
    }

    /// A plane and a hyperboloid image a point at infinity on the axis perfectly (Descartes).
    #[test]
    fn a_hyperboloid_has_no_spherical_aberration() {
        let mut last = Surface::sphere(-25.0, 0.0, Medium::air(), 30.0);
        last.shape = Shape::Conic { k: -2.25 };
        last.curvature = Curvature::from_radius(-25.0);
        let surfaces = vec![
            Surface::stop(1.0, Medium::air(), 5.0),
            Surface::sphere(0.0, 10.0, Medium::constant(1.5), 30.0),
            last,
        ];
        let lens = Lens::new(Prescription::new("perfect", surfaces));
        let sums = SeidelSums::of(&lens, f64::INFINITY, 5.0, 8.0).unwrap();
        let parts = sums.surfaces[2].s1.abs().max(1e-6);
        assert!(sums.sum.s1.abs() < 1e-15 + 1e-12 * parts, "{:?}", sums.sum);
        assert!(sums.sum.s2.abs() > 1e-6);
    }
}
