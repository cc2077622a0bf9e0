//! Figures of merit beside the data sheet, and the yield beside a closed form.

use std::sync::Arc;

use ivcam_base::diag::{Sink, Source};
use ivcam_base::math::{Meters, Mm};
use ivcam_optics::lens::{
    Aberrations, Distribution, FocusMethod, Lens, LensSheet, Merit, MeritFilm, MeritSetting,
    Requirement, SheetSetting, Tolerance, yield_of,
};
use ivcam_optics::prescription::formats;
use ivcam_optics::prescription::formats::write::{OutputFormat, write};
use ivcam_optics::prescription::{Change, Quantity};

fn setting(heights: &[f64]) -> MeritSetting {
    MeritSetting {
        distance: f64::INFINITY,
        film: MeritFilm::Best,
        image_height: heights.iter().copied().fold(0.0, f64::max),
        heights: heights.to_vec(),
        frequencies: vec![10.0, 30.0],
    }
}

#[test]
fn figures_of_merit_are_those_of_the_data_sheet() {
    for name in ["double-gauss", "tessar", "canon-300", "mirror-500"] {
        let lens = Lens::named(name).unwrap();
        let sheet = LensSheet::of(&lens).unwrap();
        let heights: Vec<f64> = sheet.points.iter().map(|point| point.height).collect();
        let merit = Merit::of(&lens, &setting(&heights)).unwrap();
        assert_eq!(merit.efl, lens.first_order().efl());
        assert!((merit.f_number / lens.real_f_number().unwrap() - 1.0).abs() < 1e-9);
        assert!(
            (merit.film_z - sheet.film_z).abs() < 2e-3 * merit.f_number,
            "{name}"
        );
        for (found, known) in merit.points.iter().zip(&sheet.points) {
            let found = found.as_ref().unwrap();
            assert!((found.angle - known.angle_degrees).abs() < 1e-2, "{name}");
            let light = lens.irradiance(glam::DVec2::new(0.0, found.height), merit.film_z)
                / lens.irradiance(glam::DVec2::ZERO, merit.film_z);
            assert!(
                (found.illumination - light).abs() < 5e-3,
                "{name} {light} {found:?}"
            );
        }
    }
}

/// Near the lens distortion is that of m y, and that of a fish-eye is of f θ.
#[test]
fn distortion_is_that_of_the_data_sheet_near_the_lens_and_of_a_fish_eye() {
    for (name, distance) in [("tessar", Some(Meters(0.5))), ("nikkor-16", None)] {
        let lens = Lens::named(name).unwrap();
        let focus = distance.map(|far| lens.focus(FocusMethod::Film, far).unwrap());
        let conditions = SheetSetting {
            focus: focus.as_ref(),
            ..SheetSetting::default()
        };
        let sheet = LensSheet::at(&lens, &conditions).unwrap();
        let conjugate = conditions.conjugate(&lens).unwrap();
        let setting = MeritSetting {
            distance: conjugate.distance,
            film: MeritFilm::At(conjugate.film_z),
            ..setting(
                &sheet
                    .fields
                    .iter()
                    .map(|row| row.height)
                    .collect::<Vec<f64>>(),
            )
        };
        let merit = Merit::of(&lens, &setting).unwrap();
        let points = merit.points.iter().zip(&sheet.fields);
        let both: Vec<[f64; 2]> = points
            .filter_map(|(point, row)| {
                let share = row.distortion_percent? / 100.0;
                Some([point.as_ref()?.distortion?, share])
            })
            .collect();
        assert!(both.len() > 35, "{name} {}", both.len());
        assert!(
            both.iter().all(|[a, b]| (a - b).abs() < 1e-12),
            "{name} {both:?}"
        );
    }
}

/// Without color the spot has the size of the sheet's.
#[test]
fn a_spot_of_144_rays_has_the_size_of_one_of_4096() {
    let lens = without_color("tessar");
    let conditions = SheetSetting {
        frequencies: vec![10.0, 30.0],
        ..SheetSetting::default()
    };
    let sheet = LensSheet::at(&lens, &conditions).unwrap();
    let heights: Vec<f64> = sheet.points.iter().map(|point| point.height).collect();
    let merit = Merit::of(&lens, &setting(&heights)).unwrap();
    for (found, known) in merit.points.iter().zip(&sheet.points) {
        let found = found.as_ref().unwrap();
        assert!(
            (found.rms / known.rms - 1.0).abs() < 0.1,
            "{} {found:?}",
            known.rms
        );
        for (number, both) in found.modulation.iter().enumerate() {
            let at = [10.0, 30.0][number];
            let near = sheet.frequencies.iter().position(|f| (f - at).abs() < 1e-9);
            let known = near.map(|near| known.geometric.tangential[near]);
            let known = known.expect("a frequency of the sheet");
            // The modulation of a spot that is wider than the lines depends on single rays.
            assert!(
                known < 0.3 || (both[0] - known).abs() < 0.05,
                "{both:?} {known}"
            );
        }
    }
}

/// The lens without color, so that the spot has the colors of the sheet's.
fn without_color(name: &str) -> Lens {
    let mut prescription = Lens::named(name).unwrap().prescription().clone();
    for surface in &mut prescription.surfaces {
        surface.medium = ivcam_optics::prescription::Medium::constant(surface.medium.n_d);
    }
    Lens::new(prescription)
}

#[test]
fn vignetted_points_have_the_figures_of_the_data_sheet() {
    let mut worst = [0.0f64; 2];
    for name in [
        "double-gauss",
        "tessar",
        "takumar-50",
        "wide-angle",
        "sonnar",
        "mirror-500",
        "canon-50",
        "angenieux-50",
    ] {
        let lens = without_color(name);
        let (sheet, found) = Aberrations::with_sheet(&lens, &SheetSetting::default()).unwrap();
        let heights: Vec<f64> = sheet.points.iter().map(|point| point.height).collect();
        let setting = MeritSetting {
            film: MeritFilm::At(sheet.film_z),
            ..setting(&heights)
        };
        let merit = Merit::of(&lens, &setting).unwrap();
        let known = sheet.points.iter().zip(&found.points);
        for (point, (spot, waves)) in merit.points.iter().zip(known) {
            let point = point.as_ref().unwrap();
            let waves = waves.wavefront.as_ref().unwrap().rms;
            let off = [point.rms / spot.rms - 1.0, point.wavefront / waves - 1.0];
            worst = std::array::from_fn(|i| worst[i].max(off[i].abs()));
        }
    }
    assert!(worst[0] < 0.06 && worst[1] < 0.1, "{worst:?}");
}

/// A vignetted point, whose rays do not come and go with the aperture of a surface.
#[test]
fn figures_change_smoothly_with_a_radius() {
    let lens = without_color("double-gauss").scaled_to(Mm(50.0)).unwrap();
    let figures = |step: i32| {
        let change = Change {
            surface: 0,
            quantity: Quantity::Radius,
            value: 29.21 * (1.0 + 1e-4 * f64::from(step)),
        };
        let made = lens.prescription().with_changes(&[change]).unwrap();
        let merit = Merit::of(&Lens::new(made), &setting(&[19.933])).unwrap();
        let point = merit.points[0].clone().unwrap();
        [point.rms, point.wavefront, point.modulation[1][0]]
    };
    let all: Vec<[f64; 3]> = (-20..=20).map(figures).collect();
    for three in all.windows(3) {
        for i in 0..3 {
            let bend = three[0][i] - 2.0 * three[1][i] + three[2][i];
            assert!(bend.abs() < 2e-3 * all[0][i], "{i} {three:?}");
        }
    }
}

#[test]
fn changes_are_those_of_the_numbers_of_a_file() {
    let lens = Lens::named("mirror-500").unwrap();
    let lens = lens.prescription();
    assert_eq!(lens.value_of(2, Quantity::Thickness), Some(-122.0));
    assert_eq!(lens.value_of(3, Quantity::Radius), Some(-277.69));
    let change = |quantity, surface, value| Change {
        surface,
        quantity,
        value,
    };
    let changes = [
        change(Quantity::Thickness, 2, -121.0),
        change(Quantity::Radius, 3, -270.0),
        change(Quantity::Index, 0, 1.52),
    ];
    let other = lens.with_changes(&changes).unwrap();
    for Change {
        surface,
        quantity,
        value,
    } in changes
    {
        assert_eq!(other.value_of(surface, quantity), Some(value));
    }
    assert_eq!(other.surfaces[2].thickness, 121.0);
    let abbe = lens.surfaces[0].medium.abbe().unwrap();
    assert!((other.surfaces[0].medium.abbe().unwrap() - abbe).abs() < 1e-6);
    assert!(
        lens.with_changes(&[change(Quantity::Abbe, 0, -1.0)])
            .is_err()
    );
}

/// A plano-convex lens of germanium at 10 µm: R/(n − 1), where n is that of its Sellmeier formula
/// with n − 1 changed as at 4 µm, the wavelength of its `n_d`.
#[test]
fn a_changed_index_keeps_the_curve_of_the_glass() {
    let text = r#"{"schema": "ivlens-1", "wavelengths_nm": [10000.0], "surfaces": [
        {"stop": true, "R": 200.0, "t": 5.0, "glass": "GERMANIUM", "semi_diameter": 5.0},
        {"R": 0, "t": 60.0, "n_d": 1.0, "semi_diameter": 6.0}]}"#;
    let read = |text: &str| {
        let source = Arc::new(Source::new("ge.json", text.as_bytes().to_vec()));
        formats::read(&source, &mut Sink::new()).unwrap()
    };
    let lens = read(text);
    let glass = &lens.surfaces[0].medium;
    for n_d in [glass.n_d, glass.n_d + 1e-4, 4.0] {
        let change = Change {
            surface: 0,
            quantity: Quantity::Index,
            value: n_d,
        };
        let made = lens.with_changes(&[change]).unwrap();
        let n = 1.0 + (glass.index(10_000.0) - 1.0) * (n_d - 1.0) / (glass.n_d - 1.0);
        let (copy, _) = write(&made, OutputFormat::Json).unwrap();
        for made in [made, read(&copy)] {
            let lens = Lens::new(made).at_primary_wavelength();
            let efl = lens.first_order().efl();
            assert!((efl - 200.0 / (n - 1.0)).abs() < 1e-9, "{n_d}: {efl}");
        }
    }
    let change = Change {
        surface: 0,
        quantity: Quantity::Abbe,
        value: 30.0,
    };
    let error = lens.with_changes(&[change]).unwrap_err();
    assert!(error.message.contains("has no Abbe number"), "{error:?}");
    assert_eq!(lens.value_of(0, Quantity::Abbe), None);
}

/// The focal length of a scaled single radius is linear in it for small tolerances: of a uniform
/// distribution the share within half of the range passes.
#[test]
fn the_yield_is_the_share_of_a_uniform_distribution() {
    let lens = Lens::named("double-gauss").unwrap();
    let tolerance = Tolerance {
        surface: 0,
        quantity: Quantity::Radius,
        amount: 0.02,
        distribution: Distribution::Uniform,
    };
    let efl = |value: f64| {
        let change = Change {
            surface: 0,
            quantity: Quantity::Radius,
            value,
        };
        let made = lens.prescription().with_changes(&[change]).unwrap();
        Lens::new(made).first_order().efl()
    };
    let nominal = lens.prescription().value_of(0, Quantity::Radius).unwrap();
    let (a, b) = (efl(nominal - 0.01), efl(nominal + 0.01));
    let requirement = Requirement::FocalLength(a.min(b), a.max(b));
    let made = |distribution| {
        let tolerance = Tolerance {
            distribution,
            ..tolerance
        };
        yield_of(
            &lens,
            &[tolerance],
            &[requirement],
            &setting(&[0.0]),
            (600, 3),
        )
        .unwrap()
    };
    let uniform = made(Distribution::Uniform);
    let [low, high] = uniform.interval();
    assert!(low < 0.5 && 0.5 < high, "{low} {high}");
    assert!((high - low - 2.0 * 1.96 * (0.25f64 / 600.0).sqrt()).abs() < 1e-3);
    // Within one standard deviation of a normal distribution that ends at two: 0.6827/0.9545.
    let [low, high] = made(Distribution::Normal).interval();
    assert!(low < 0.7152 && 0.7152 < high, "{low} {high}");
    assert_eq!(uniform.outer, [uniform.trials - uniform.passed]);
}

/// Over 200 heights in random distances, the light of a lens has no jump above 5% of the axis's,
/// and is nowhere 0, within 95% of the lit circle. At its edge it falls to 0, in some lenses within
/// a hundredth of the radius.
fn assert_no_holes(name: &str, lens: &Lens) {
    let film_z = lens.first_order().focal.unwrap().rear_focal_point;
    let efl = lens.first_order().efl().abs();
    let lit = lens.lit_height(efl, film_z);
    let mut key = 1;
    let mut heights: Vec<f64> = (0..200)
        .map(|_| {
            key = ivcam_optics::sampling::mix(key);
            0.95 * lit * ivcam_optics::sampling::unit(key)
        })
        .collect();
    heights.sort_by(f64::total_cmp);
    let light = |h: f64| lens.irradiance(glam::DVec2::new(0.0, h), film_z);
    let axis = light(0.0);
    let mut last = (0.0, 1.0);
    for height in heights {
        let share = light(height) / axis;
        let step = (height - last.0) / lit;
        let jump = (share - last.1).abs();
        // Light falls by the width of the field at most ten times over.
        assert!(
            share > 0.0 && jump < 0.05 + 10.0 * (step - 0.005).max(0.0),
            "{name}: {share} at {height}, {} at {}",
            last.1,
            last.0
        );
        last = (height, share);
    }
}

#[test]
fn relative_illumination_has_no_holes_and_no_jumps() {
    for name in ["biogon", "double-gauss", "phone", "tessar"] {
        assert_no_holes(name, &Lens::named(name).unwrap());
    }
}

#[test]
#[ignore = "a measurement of minutes, listed in docs/performance.md"]
fn relative_illumination_of_every_round_lens_has_no_holes_and_no_jumps() {
    for name in ivcam_optics::lens::shipped_names() {
        let lens = Lens::named(name).unwrap();
        if lens.prescription().is_rotational() {
            assert_no_holes(name, &lens);
        }
    }
}
