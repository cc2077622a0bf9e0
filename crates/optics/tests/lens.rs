//! Properties of every lens, tested with random lenses of 2 to 40 surfaces and with the shipped
//! ones.

use std::cell::Cell;

use glam::{DVec2, DVec3};
use ivcam_base::math::Meters;
use ivcam_base::math::lanes::Width;
use ivcam_base::work::{Budget, WorkLimit};
use ivcam_optics::film::FilmFormat;
use ivcam_optics::lens::{
    Bundle, ExitPupil, FilmPlace, FocusMethod, Iris, LANES, Lens, LensRay, LensSheet, LossKind,
    Meridian, Movements, Prescription, PupilTarget, PupilWindow, Surface, Toward, shipped_names,
    trace::ray::unit,
};
use ivcam_optics::prescription::Medium;
use proptest::prelude::*;
use proptest::test_runner::{RngSeed, TestRunner};

/// The numbers of a surface: curvature, gap, index.
type Row = (f64, f64, f64);

/// Returns the number of random lenses: PROPTEST_CASES, or a default. About half of them have no
/// usable focus.
fn config(usual: u32) -> ProptestConfig {
    let said = std::env::var("PROPTEST_CASES").ok();
    let cases = said.and_then(|n| n.parse().ok()).unwrap_or(usual);
    ProptestConfig {
        max_global_rejects: 4 * cases,
        ..ProptestConfig::with_cases(cases)
    }
}

fn rows() -> impl Strategy<Value = Vec<Row>> {
    let curvature = prop_oneof![1 => Just(0.0), 6 => -0.02..0.02f64];
    prop::collection::vec((curvature, 0.0..6.0f64, 1.4..1.95f64), 2..40)
}

/// Builds a lens of alternating glass and air, with a stop in the first air gap and air behind.
fn lens_of(rows: &[Row]) -> Lens {
    let mut surfaces = Vec::new();
    for (i, &(c, gap, n)) in rows.iter().enumerate() {
        let is_glass = i % 2 == 0 && i + 1 < rows.len();
        let medium = Medium::constant(if is_glass { n } else { 1.0 });
        let radius = if c == 0.0 { 0.0 } else { 1.0 / c };
        surfaces.push(Surface::sphere(radius, gap, medium, 12.0));
        if i == 1 {
            surfaces.push(Surface::stop(0.5, Medium::air(), 6.0));
        }
    }
    Lens::new(Prescription::new("random", surfaces))
}

fn scene_ray(y: f64, x: f64, u: f64, v: f64) -> LensRay {
    LensRay::new(DVec3::new(x, y, -20.0), DVec3::new(u, v, 1.0))
}

proptest! {
    #![proptest_config(config(400))]

    #[test]
    fn a_ray_traced_back_comes_back(
        rows in rows(), x in -6.0..6.0f64, y in -6.0..6.0f64, u in -0.2..0.2f64, v in -0.2..0.2f64,
    ) {
        let lens = lens_of(&rows);
        let there = lens.trace_path(&scene_ray(x, y, u, v), Toward::Film, false);
        let Ok(out) = there.outcome else { return Ok(()) };
        // The ray starts behind the lens and returns along the same line.
        let back = LensRay { origin: out.origin + 30.0 * out.direction, direction: -out.direction };
        let home = lens.trace_path(&back, Toward::Scene, false);
        prop_assert!(home.outcome.is_ok());
        for (a, b) in there.hits.iter().zip(home.hits.iter().rev()) {
            prop_assert!((*a - *b).length() < 1e-8, "{a} {b}");
        }
        // Steps at grazing incidence lose precision as 1/cos; the generator makes few.
        let d = unit(DVec3::new(u, v, 1.0)).unwrap();
        prop_assert!((home.outcome.unwrap().direction + d).length() < 1e-8);
    }

    /// The results may differ where a ray grazes a surface or touches a rim. Then they also differ
    /// for a ray displaced by a millionth of a millimeter, or rotated by a millionth.
    #[test]
    fn lanes_give_the_rays_of_single_rays(
        rows in rows(), seed in 0u64..1000, spread in 0.0..1.0f64,
    ) {
        let lens = lens_of(&rows);
        let mut bundle = Bundle::default();
        let ray = |lane: usize| {
            let t = lane as f64 + seed as f64;
            let x = 14.0 * (0.618 * t).fract() - 7.0;
            let y = 14.0 * (0.414 * t).fract() - 7.0;
            let d = DVec3::new(spread * (0.732 * t).fract(), 0.0, 1.0);
            LensRay { origin: DVec3::new(x, y, -20.0), direction: unit(d).unwrap() }
        };
        for lane in 0..LANES {
            bundle.set(lane, &ray(lane));
        }
        lens.trace_bundle(&mut bundle, Toward::Film, Width::detect());
        for lane in 0..LANES {
            let ray = ray(lane);
            let neighbors = [DVec3::X, DVec3::Y, -DVec3::X, -DVec3::Y].map(|way| {
                let direction = unit(ray.direction + 1e-6 * way).unwrap();
                let beside = LensRay { origin: ray.origin + 1e-6 * way, direction };
                lens.trace_from_scene(&beside)
            });
            match (lens.trace_from_scene(&ray), bundle.loss(lane)) {
                (Ok(out), None) => {
                    let near = bundle.ray(lane);
                    let apart = (near.origin - out.origin).length()
                        .max((near.direction - out.direction).length());
                    // Rounding propagates like a displacement of the ray, which is 1e-6 here.
                    let steep = neighbors.iter().flatten().map(|n| {
                        (n.origin - out.origin).length()
                            .max((n.direction - out.direction).length())
                    }).fold(1e-6, f64::max) / 1e-6;
                    prop_assert!(apart < 1e-12 * steep, "{apart} {steep}");
                }
                (Err(loss), Some(other)) if loss == other => {}
                (one, _) => prop_assert!(neighbors.iter().any(|n| n.is_ok() != one.is_ok()
                    || n.as_ref().err() != one.as_ref().err())),
            }
        }
    }

    #[test]
    fn scaling_a_lens_scales_all_its_lengths(rows in rows(), k in 0.01..100.0f64) {
        let (lens, scaled) = (lens_of(&rows), lens_of(&rows).scaled(k));
        let (Some(a), Some(b)) = (lens.first_order().focal, scaled.first_order().focal) else {
            return Ok(());
        };
        // The effect of rounding the scaled lengths grows with the ratio of the lens's length to
        // its focal length.
        let slack = 1e-11 * (a.efl.abs() + a.bfl.abs() + 100.0 + a.efl * a.efl / 10.0);
        prop_assert!((b.efl / k - a.efl).abs() < slack);
        prop_assert!((b.bfl / k - a.bfl).abs() < slack);
    }

    #[test]
    fn a_lens_turned_around_has_the_same_focal_length(rows in rows()) {
        let lens = lens_of(&rows);
        let turned = Lens::new(lens.prescription().reversed());
        let (Some(a), Some(b)) = (lens.first_order().focal, turned.first_order().focal) else {
            return Ok(());
        };
        prop_assert!((a.efl / b.efl - 1.0).abs() < 1e-12);
        prop_assert!((a.bfl + b.ffl).abs() < 1e-12 * (a.bfl.abs() + a.efl.abs()));
        let again = Lens::new(turned.prescription().reversed());
        prop_assert_eq!(again.first_order().focal, lens.first_order().focal);
    }

    /// The product n (u₁ y₂ − u₂ y₁) is the same before and behind the lens, so its matrix has the
    /// determinant 1.
    #[test]
    fn the_lagrange_invariant_holds(rows in rows()) {
        let [a, b, c, d] = lens_of(&rows).first_order().matrix;
        prop_assert!((a * d - b * c - 1.0).abs() < 1e-13 * ((a * d).abs() + (b * c).abs()));
    }

    /// Rays near the axis cross it at the paraxial image.
    #[test]
    fn a_ray_near_the_axis_crosses_it_at_the_focused_film(
        rows in rows(), distance in 0.5..50.0f64,
    ) {
        let lens = lens_of(&rows);
        let Ok(focus) = lens.focus(FocusMethod::Film, Meters(distance)) else { return Ok(()) };
        prop_assume!(focus.film_z < 1e4 && lens.first_order().efl().abs() < 1e4);
        let origin = -1000.0 * distance * DVec3::Z;
        let ray = LensRay { origin, direction: DVec3::new(0.0, 1e-3, 0.0) - origin };
        let Ok(out) = lens.trace_path(&ray, Toward::Film, false).outcome else { return Ok(()) };
        let t = (focus.film_z - out.origin.z) / out.direction.z;
        let y = out.origin.y + t * out.direction.y;
        // The error is of third order, (1e-3 mm)³ against lengths of millimeters, plus rounding.
        prop_assert!(y.abs() < 1e-6 * (1.0 + focus.magnification.abs()), "{y}");
    }
}

/// The lenses include some whose beam is folded, so that the pupil has several regions. A region of
/// a hundredth of a millimeter may be missed: of 20,000 lenses with random seeds three lost rays, 6
/// in all ([decision 11](../../../docs/decisions/0011-measuring-a-pupil.md)). Here the seeds
/// are fixed.
#[test]
fn of_the_rays_that_pass_random_lenses_one_in_100_000_may_be_outside_the_pupil() {
    let (passed, lost) = (Cell::new(0), Cell::new(0));
    let count = |rows: Vec<Row>, film_radius: f64, seed: u64| {
        let lens = lens_of(&rows);
        let Some(focal) = lens.first_order().focal else {
            return Ok(());
        };
        prop_assume!(focal.bfl > 1.0 && focal.bfl < 1e3);
        let film_z = focal.rear_focal_point;
        let target = PupilTarget::exit_pupil(&lens, film_z, film_radius);
        let mut dice = Dice(seed);
        for _ in 0..100 {
            let rays: [(DVec2, DVec2); LANES] = std::array::from_fn(|_| {
                let aim = DVec2::new(dice.next(), dice.next()) - 0.5;
                (film_radius * dice.disc(), 26.0 * aim)
            });
            let mut bundle = Bundle::default();
            for (lane, (film, aim)) in rays.iter().enumerate() {
                bundle.set(lane, &film_ray(&lens, *film, film_z, *aim));
            }
            lens.trace_bundle_from_film(&mut bundle);
            for (lane, (film, aim)) in rays.iter().enumerate() {
                if bundle.passed(lane) {
                    let is_outside = !target.window(*film).contains(*aim);
                    passed.set(passed.get() + 1);
                    lost.set(lost.get() + u32::from(is_outside));
                }
            }
        }
        Ok(())
    };
    let mut runner = TestRunner::new(ProptestConfig {
        rng_seed: RngSeed::Fixed(1),
        ..config(400)
    });
    let lenses = (rows(), 1.0..20.0f64, 0u64..1 << 40);
    runner
        .run(&lenses, |(rows, radius, seed)| count(rows, radius, seed))
        .expect("lenses are made");
    let (passed, lost) = (passed.get(), lost.get());
    assert!(
        passed > 100_000 && lost <= passed / 100_000,
        "{lost} of {passed}"
    );
}

proptest! {
    #![proptest_config(config(300))]

    /// Every ray of a scaled lens has the scaled path, beyond first order.
    #[test]
    fn a_scaled_lens_has_scaled_ray_paths(
        rows in rows(), k in 0.01..100.0f64, x in -6.0..6.0f64, y in -6.0..6.0f64,
        u in -0.2..0.2f64, v in -0.2..0.2f64,
    ) {
        let lens = lens_of(&rows);
        let scaled = lens.scaled(k);
        let ray = scene_ray(x, y, u, v);
        let large = LensRay { origin: k * ray.origin, ..ray };
        let trace = |lens: &Lens, ray| lens.trace_path(ray, Toward::Film, false).outcome;
        let (Ok(a), Ok(b)) = (trace(&lens, &ray), trace(&scaled, &large)) else { return Ok(()) };
        prop_assert!((a.direction - b.direction).length() < 1e-9);
        prop_assert!((a.origin - b.origin / k).length() < 1e-9 * (1.0 + a.origin.length()));
    }

    /// A reversed lens sends the mirrored ray back along the mirrored path.
    #[test]
    fn a_reversed_lens_sends_a_mirrored_ray_along_the_mirrored_path(
        rows in rows(), x in -6.0..6.0f64, y in -6.0..6.0f64,
        u in -0.2..0.2f64, v in -0.2..0.2f64,
    ) {
        let lens = lens_of(&rows);
        let turned = Lens::new(lens.prescription().reversed());
        let Ok(out) = lens.trace_path(&scene_ray(x, y, u, v), Toward::Film, false).outcome else {
            return Ok(());
        };
        let length = lens.length();
        let mirror = |p: DVec3| DVec3::new(p.x, p.y, length - p.z);
        let flip = |d: DVec3| DVec3::new(d.x, d.y, -d.z);
        let back = LensRay { origin: mirror(out.origin), direction: -flip(out.direction) };
        let back = LensRay { origin: back.origin - 20.0 * back.direction, ..back };
        let home = turned.trace_path(&back, Toward::Film, false).outcome;
        prop_assert!(home.is_ok(), "{home:?}");
        let d = unit(DVec3::new(u, v, 1.0)).unwrap();
        prop_assert!((home.unwrap().direction + flip(d)).length() < 1e-8);
    }

    /// Each surface of a chain is concentric with the image so far, or aplanatic for it (Abbe).
    /// There is no spherical aberration and no coma, so all rays seem to come from one point, and
    /// sin u / sin u' is the same for all: the product of the ratios of indices.
    #[test]
    fn a_chain_of_aplanatic_surfaces_keeps_the_sine_condition(
        start in 10.0..80.0f64,
        links in prop::collection::vec((0.2..4.0f64, 1.4..1.9f64, any::<bool>()), 1..20),
    ) {
        let mut surfaces = Vec::new();
        let (mut object, mut ratio) = (-start, 1.0);
        let mut z = 0.0;
        for (gap, n, aplanatic) in links {
            // The entry into glass is concentric with the object; the exit is concentric or
            // aplanatic.
            surfaces.push(Surface::sphere(object, gap, Medium::constant(n), f64::INFINITY));
            object -= gap;
            let radius = if aplanatic { object * n / (n + 1.0) } else { object };
            surfaces.push(Surface::sphere(radius, gap, Medium::air(), f64::INFINITY));
            if aplanatic {
                object *= n;
                ratio *= 1.0 / n;
            }
            z += 2.0 * gap;
            object -= gap;
        }
        let lens = Lens::new(Prescription::new("aplanatic", surfaces));
        for sine in [0.05, 0.2, 0.4f64] {
            let direction = DVec3::new(0.0, sine, (1.0 - sine * sine).sqrt());
            let ray = LensRay { origin: -start * DVec3::Z, direction };
            let out = lens.trace_path(&ray, Toward::Film, false).outcome.unwrap();
            prop_assert!((out.direction.y - ratio * sine).abs() < 1e-13);
            let image = out.origin.z - out.origin.y * out.direction.z / out.direction.y;
            // The last gap is not part of the lens.
            prop_assert!((image - (z + object)).abs() < 1e-11 * (1.0 + object.abs()));
        }
    }

    /// The reference intersection is by bisection along the ray, with the surface by its
    /// definition: the profile in y rotated about the line x = 0, z = R. The refraction is Snell's
    /// law with a normal by finite differences.
    #[test]
    fn intersections_with_toroids_and_cylinders_are_those_of_bisection(
        c in -0.03..0.03f64, across in prop_oneof![1 => Just(0.0), 4 => -0.03..0.03f64],
        k in -2.0..1.0f64, quartic in -2e-5..2e-5f64, sixth in -1e-7..1e-7f64,
        x in -6.0..6.0f64, y in -6.0..6.0f64, u in -0.3..0.3f64, v in -0.3..0.3f64,
    ) {
        let mut terms = Box::new([0.0; ivcam_optics::prescription::surface::MAX_POWER + 1]);
        (terms[4], terms[6]) = (quartic, sixth);
        let profile = move |y: f64| {
            let r2 = y * y;
            c * r2 / (1.0 + (1.0 - (1.0 + k) * c * c * r2).sqrt()) + quartic * r2 * r2
                + sixth * r2 * r2 * r2
        };
        let sag = |x: f64, y: f64| {
            let (g, r) = (profile(y), 1.0 / across);
            // This is r − √((r − g)² − x²) without the cancellation.
            let root = ((r - g).powi(2) - x * x).sqrt().copysign(r);
            if across == 0.0 { g } else { ((2.0 * r - g) * g + x * x) / (r + root) }
        };
        let mut surface = Surface::sphere(1.0 / c, 0.0, Medium::constant(1.6), f64::INFINITY);
        surface.shape = ivcam_optics::lens::Shape::Toroid {
            across: ivcam_optics::prescription::Curvature::from_curvature(across), k, terms,
        };
        let lens = Lens::new(Prescription::new("toroid", vec![surface]));
        let ray = scene_ray(x, y, u, v);
        let d = unit(ray.direction).unwrap();
        let above = |t: f64| { let p = ray.origin + t * d; p.z - sag(p.x, p.y) };
        let (mut low, mut high) = (5.0, 40.0);
        prop_assume!(above(low) < 0.0 && above(high) > 0.0);
        for _ in 0..200 {
            let middle = 0.5 * (low + high);
            if above(middle) < 0.0 { low = middle } else { high = middle }
        }
        let hit = ray.origin + low * d;
        let path = lens.trace_path(&ray, Toward::Film, false);
        prop_assert!((path.hits[0] - hit).length() < 1e-11, "{} {hit}", path.hits[0]);
        let h = 1e-4;
        let slope_x = (sag(hit.x + h, hit.y) - sag(hit.x - h, hit.y)) / (2.0 * h);
        let slope_y = (sag(hit.x, hit.y + h) - sag(hit.x, hit.y - h)) / (2.0 * h);
        let normal = DVec3::new(-slope_x, -slope_y, 1.0).normalize();
        let out = path.outcome.unwrap().direction;
        prop_assert!((d.cross(normal) - 1.6 * out.cross(normal)).length() < 1e-8);
    }
}

#[test]
fn every_shipped_lens_opens_and_passes_light() {
    for name in shipped_names() {
        let lens = Lens::named(name).unwrap_or_else(|e| panic!("{}", e.render(false)));
        let beam = lens.axial_beam();
        assert!(beam.height > 0.0, "{name} passes no light along its axis");
        let out = lens.trace_from_scene(&LensRay {
            // A lens with mirrors has a closed middle.
            origin: DVec3::new(0.0, 0.7 * beam.height, -1000.0),
            direction: DVec3::Z,
        });
        assert!(out.is_ok(), "{name}: {out:?}");
    }
}

/// The four lenses of the 1999 command line are about 100 mm, so `-z 0.2` makes 20 mm.
/// Returns a lens of equal biconvex elements with a number of surfaces, which relays its image many
/// times.
fn many_surfaces(count: usize) -> Lens {
    let surface = |i: usize| match i % 2 {
        0 => Surface::sphere(50.0, 0.1, Medium::constant(1.5), 10.0),
        _ => Surface::sphere(-50.0, 0.1, Medium::air(), 10.0),
    };
    Lens::new(Prescription::new("many", (0..count).map(surface).collect()))
}

#[test]
fn a_lens_of_a_thousand_surfaces_has_a_pupil_and_a_data_sheet_within_the_usual_work() {
    let lens = many_surfaces(1000);
    let account = Budget::new(u64::MAX, WorkLimit::default());
    let focus = lens.focus(FocusMethod::Film, Meters(5.0)).unwrap();
    let place = FilmPlace::flat(focus.film_z);
    let pupil = account.during(|| ExitPupil::new(&lens, &place, 2.0));
    assert_eq!(account.cut(), None, "{}", account.used_steps());
    // Openings beside the pupil are not searched, so some rays are aimed anywhere.
    assert!(matches!(
        pupil.window(DVec2::ZERO),
        PupilWindow::Defensive(..)
    ));
    let account = Budget::new(u64::MAX, WorkLimit::default());
    let sheet = account
        .during(|| LensSheet::of(&lens))
        .expect("a data sheet");
    assert_eq!(account.cut(), None, "{}", account.used_steps());
    assert!(sheet.image_height > 0.0);
}

#[test]
fn the_four_vintage_lenses_are_about_100_millimeters() {
    for name in ["wide-angle", "double-gauss", "telephoto", "fisheye"] {
        let efl = Lens::named(name).unwrap().first_order().efl();
        assert!((efl - 100.0).abs() < 1.0, "{name}: {efl}");
    }
}

#[test]
fn an_iris_of_six_blades_passes_the_area_of_its_hexagon() {
    let lens = Lens::named("double-gauss")
        .unwrap()
        .at_f_number(8.0)
        .unwrap();
    let bladed = lens.with_iris(Iris::Blades {
        count: 6,
        rotation: 0.3,
    });
    let film_z = lens.first_order().focal.unwrap().rear_focal_point;
    let target = PupilTarget::exit_pupil(&lens, film_z, 20.0);
    let window = target.window(DVec2::ZERO);
    let (mut round, mut six) = (0, 0);
    for i in 0..200 * 200 {
        let (u, v) = (f64::from(i % 200) / 200.0, f64::from(i / 200) / 200.0);
        let origin = film_z * DVec3::Z;
        let direction = window.point(u, v).extend(lens.length()) - origin;
        let ray = LensRay { origin, direction };
        round += i32::from(lens.trace_from_film(&ray).is_ok());
        six += i32::from(bladed.trace_from_film(&ray).is_ok());
        if let Err(loss) = bladed.trace_from_film(&ray) {
            assert_eq!(loss.kind, LossKind::Blocked);
        }
    }
    // The ratio of a hexagon to its circle is 3√3/2π.
    let share = f64::from(six) / f64::from(round);
    let exact = 3.0 * 3f64.sqrt() / std::f64::consts::TAU;
    assert!((share / exact - 1.0).abs() < 3e-3, "{share} {exact}");
    let light = |lens: &Lens| lens.irradiance(DVec2::ZERO, film_z);
    assert!((light(&bladed) / light(&lens) / exact - 1.0).abs() < 1e-3);
}

/// Rays are aimed at the image of the blades. The circle around it would lose 17% of the rays for
/// six blades and 36% for four. The target is no smaller than the rays that pass, with or without
/// vignetting, and on film that is moved or not.
#[test]
fn the_pupil_of_an_iris_has_the_shape_of_its_blades() {
    let aside = Movements {
        rise: 4.0,
        tilt: 0.05,
        ..Movements::default()
    };
    for (name, f_number, count, rotation, moved) in [
        ("double-gauss", 4.0, 6, 0.0, Movements::default()),
        ("wide-angle", 5.6, 6, 0.2, Movements::default()),
        ("tessar", 16.0, 7, 0.4, Movements::default()),
        ("biogon", 11.0, 5, 0.1, Movements::default()),
        ("canon-300", 11.0, 9, 0.0, Movements::default()),
        ("cooke-triplet", 8.0, 4, 0.3, Movements::default()),
        ("double-gauss", 8.0, 6, 0.3, aside),
    ] {
        let lens = Lens::named(name).unwrap().at_f_number(f_number).unwrap();
        let lens = lens.with_iris(Iris::Blades { count, rotation });
        let focus = lens.focus(FocusMethod::Film, Meters(f64::INFINITY));
        let focus = focus.unwrap();
        let format = FilmFormat::STANDARD;
        let place = FilmPlace::new(&lens, &focus, &moved, format).unwrap();
        let reach = format.half_diagonal();
        let target = PupilTarget::exit_pupil_of(&lens, &place, reach);
        let mut dice = Dice(11);
        let (mut passed, mut aimed, mut open) = (0, 0, 0);
        for _ in 0..4000 {
            let film = reach * dice.disc();
            let window = target.window(film);
            let PupilWindow::Polygon(polygon) = window else {
                continue;
            };
            let through = |aim: DVec2| {
                let origin = place.point(film);
                let direction = aim.extend(lens.length()) - origin;
                lens.trace_from_film(&LensRay { origin, direction }).is_ok()
            };
            let corners = polygon.corners().map(|c| (c - polygon.center()).length());
            let radius = 1.2 * corners.fold(0.0, f64::max);
            for _ in 0..4 {
                let around = polygon.center() + radius * dice.disc();
                if through(around) {
                    open += 1;
                    assert!(
                        window.contains(around),
                        "{name}, {count} blades: {film} {around}"
                    );
                }
                aimed += 1;
                passed += u32::from(through(window.point(dice.next(), dice.next())));
            }
        }
        let share = f64::from(passed) / f64::from(aimed);
        println!("{name} {count} blades: {share} of {aimed}, {open}");
        assert!(open > 3000, "{name}: {open}");
        assert!(share > 0.95, "{name}, {count} blades: {share}");
    }
}

#[test]
fn the_best_focus_is_where_the_axial_spot_is_least() {
    let lens = Lens::named("telephoto").unwrap();
    for distance in [f64::INFINITY, 20_000.0] {
        let best = lens.best_focus(distance).unwrap();
        let paraxial = lens
            .focus(FocusMethod::Film, Meters(distance / 1000.0))
            .unwrap()
            .film_z;
        assert!((best - paraxial).abs() < 1.0, "{best} {paraxial}");
        let focused = lens
            .focus(FocusMethod::Best, Meters(distance / 1000.0))
            .unwrap();
        assert_eq!(focused.film_z, best);
    }
}

/// A thin front group that moves by its own extension focuses like a separate lens.
#[test]
fn a_focusing_group_brings_a_near_object_onto_the_film_of_infinity() {
    let mut prescription = lens_of(&[
        (0.02, 2.0, 1.6),
        (-0.02, 8.0, 1.0),
        (0.01, 2.0, 1.5),
        (0.0, 0.0, 1.0),
    ])
    .prescription()
    .clone();
    prescription.focus_group =
        Some(ivcam_optics::prescription::prescription::FocusGroup { first: 0, last: 1 });
    let lens = Lens::new(prescription);
    let film = lens
        .focus(FocusMethod::Film, Meters(f64::INFINITY))
        .unwrap()
        .film_z;
    let (moved, focus) = lens.focused(FocusMethod::Group, Meters(1.0)).unwrap();
    // The film does not move relative to the rear group, so it moves with the front vertex.
    let shift = moved.length() - lens.length();
    assert!((focus.film_z - film - shift).abs() < 1e-9);
    let at = moved.focus(FocusMethod::Film, Meters(1.0)).unwrap().film_z;
    assert!((at - focus.film_z).abs() < 1e-9, "{at} {}", focus.film_z);
    assert!(lens.focused(FocusMethod::Group, Meters(0.06)).is_err());
}

#[test]
fn a_cylinder_has_power_in_one_plane_only() {
    let mut surface = Surface::sphere(50.0, 0.0, Medium::constant(1.5), 10.0);
    surface.shape = ivcam_optics::lens::Shape::CylinderY;
    let lens = Lens::new(Prescription::new("cylinder", vec![surface]));
    assert!(lens.first_order_in(Meridian::Y).focal.is_none());
    let focal = lens.first_order_in(Meridian::X).focal.unwrap();
    // The focal length in the fluid is n' R / (n' − n).
    assert!((focal.efl - 150.0).abs() < 1e-12);
    let along = LensRay::new(DVec3::new(0.0, 5.0, -9.0), DVec3::Z);
    assert_eq!(lens.trace_from_scene(&along).unwrap().direction, DVec3::Z);
}

/// Each lens is on its own film format, focused nearby. In the phone lens, the image of the blades
/// moves across the rear element by a hundred times its size.
#[test]
fn at_least_95_percent_of_aimed_rays_pass_any_stop_of_any_shipped_lens() {
    let mut all = Vec::new();
    for name in shipped_names() {
        let open = Lens::named(name).unwrap();
        if open.is_obstructed() {
            continue;
        }
        all.push(open.clone());
        all.extend([5.6, 22.0].iter().filter_map(|n| open.at_f_number(*n).ok()));
    }
    let blades = Iris::Blades {
        count: 6,
        rotation: 0.1,
    };
    let phone = Lens::named("phone").unwrap().at_f_number(22.0).unwrap();
    all.push(phone.with_iris(blades));
    for lens in all {
        let efl = lens.first_order().efl().abs();
        let reach = lens.prescription().image_height.unwrap_or(0.43 * efl);
        let focus = lens.focus(FocusMethod::Film, Meters(0.1 * efl)).unwrap();
        let target = PupilTarget::exit_pupil(&lens, focus.film_z, reach);
        let (mut passed, mut aimed) = (0, 0);
        for i in 1..=4000 {
            // The points are evenly distributed in four dimensions (the generalized golden ratios).
            let at = [0.856_674_884, 0.733_891_857, 0.628_706_721, 0.538_597_257];
            let [a, b, c, d] = at.map(|step| (0.5 + step * f64::from(i)).fract());
            let film = reach * a.sqrt() * DVec2::from_angle(std::f64::consts::TAU * b);
            let window = target.window(film);
            if !window.is_closed() {
                let ray = film_ray(&lens, film, focus.film_z, window.point(c, d));
                aimed += 1;
                passed += u32::from(lens.trace_from_film(&ray).is_ok());
            }
        }
        let share = f64::from(passed) / f64::from(aimed);
        let (name, stop) = (lens.name(), lens.first_order().f_number());
        assert!(
            aimed > 1000 && share >= 0.95,
            "{name} {stop:?}: {share} of {aimed}"
        );
    }
}

/// The test traces four lenses at two stops, with 130,000 rays each over more than the pupil.
#[test]
fn no_ray_that_passes_a_vintage_lens_is_outside_its_pupil() {
    for name in ["wide-angle", "double-gauss", "telephoto", "fisheye"] {
        for f_number in [None, Some(16.0)] {
            let open = Lens::named(name).unwrap();
            let lens = f_number.map_or(open.clone(), |n| open.at_f_number(n).unwrap());
            let film_z = lens.first_order().focal.unwrap().rear_focal_point;
            let target = PupilTarget::exit_pupil(&lens, film_z, 30.0);
            let mut dice = Dice(7);
            let mut passed = 0;
            for _ in 0..4096 {
                let film = 30.0 * dice.disc();
                let window = target.window(film);
                for (aim, through) in aimed_about(&window, 1.2, &lens, film, film_z, &mut dice) {
                    passed += usize::from(through);
                    let inside = !through || window.contains(aim);
                    assert!(inside, "{name} {f_number:?}: film {film}, aim {aim}");
                }
            }
            assert!(passed > 30_000, "{name}: {passed}");
        }
    }
}

/// Aims rays from a film point at a disc larger than the pupil by a factor. Returns where each aims
/// and whether it passes, or `None` if the pupil is closed.
fn aimed_about(
    window: &PupilWindow<'_>,
    times: f64,
    lens: &Lens,
    film: DVec2,
    film_z: f64,
    dice: &mut Dice,
) -> Vec<(DVec2, bool)> {
    let PupilWindow::Polygon(polygon) = window else {
        return Vec::new();
    };
    let reach = polygon.corners().map(|c| (c - polygon.center()).length());
    let radius = times * reach.fold(0.0, f64::max);
    let aims: [DVec2; LANES] = std::array::from_fn(|_| polygon.center() + radius * dice.disc());
    let mut bundle = Bundle::default();
    for (lane, aim) in aims.iter().enumerate() {
        bundle.set(lane, &film_ray(lens, film, film_z, *aim));
    }
    lens.trace_bundle_from_film(&mut bundle);
    (0..LANES)
        .map(|lane| (aims[lane], bundle.passed(lane)))
        .collect()
}

/// The pupil of a dispersive lens is measured at its d line and at the ends of the hero
/// wavelengths. The target contains all three pupils and those between.
#[test]
fn no_ray_of_any_wavelength_that_passes_is_outside_the_pupil() {
    for (name, count, radius) in [
        ("tessar", 0, 24.0),
        ("flektogon", 0, 24.0),
        ("nikkor-6", 0, 14.4),
        ("achromat", 0, 24.0),
        ("tessar", 6, 24.0),
        ("flektogon", 7, 24.0),
    ] {
        let lens = Lens::named(name).unwrap();
        let rotation = 0.1;
        let lens = match count {
            0 => lens,
            count => lens.with_iris(Iris::Blades { count, rotation }),
        };
        let lines = ivcam_optics::spectrum::Spectrum::default().hero_sets();
        let lines = lines.iter().flatten().map(|line| line.nm);
        let (low, high) = (
            lines.clone().fold(f64::INFINITY, f64::min),
            lines.clone().fold(0.0, f64::max),
        );
        let film_z = lens.first_order().focal.unwrap().rear_focal_point;
        let pupil = |nm: f64| {
            let place = ivcam_optics::lens::FilmPlace::flat(film_z);
            ivcam_optics::lens::ExitPupil::new(&lens.at_wavelength(nm), &place, radius)
        };
        let [blue, own, red] = [low, lens.wavelength(), high].map(pupil);
        let around = ivcam_optics::lens::ExitPupil::around(&[&blue, &own, &red]);
        let (mut passed, mut tried) = (0, 0);
        for nm in lines.step_by(3) {
            let lens = lens.at_wavelength(nm);
            let mut dice = Dice(3);
            for _ in 0..1500 {
                let film = radius * dice.disc();
                let window = around.window(film);
                for (aim, through) in aimed_about(&window, 1.1, &lens, film, film_z, &mut dice) {
                    tried += 1;
                    passed += u32::from(through);
                    let inside = !through || window.contains(aim);
                    assert!(inside, "{name}, {nm} nm: film {film}, aim {aim}");
                }
            }
        }
        assert!(passed > 100_000, "{name}: {passed} of {tried}");
    }
}

/// Both targets estimate the same irradiance, and so does the integral of the outline. In twelve
/// comparisons at 4.5 standard errors, a correct program fails once in 10,000 runs, and the seed is
/// fixed.
#[test]
fn the_exit_pupil_gives_the_light_of_the_rear_element() {
    for name in ["wide-angle", "double-gauss"] {
        let lens = Lens::named(name).unwrap().at_f_number(4.0).unwrap();
        let film_z = lens.first_order().focal.unwrap().rear_focal_point;
        let z = film_z - lens.length();
        let targets = [
            PupilTarget::exit_pupil(&lens, film_z, 22.0),
            PupilTarget::rear_element(&lens, ivcam_optics::sampling::DiscMap::Concentric),
        ];
        let mut dice = Dice(11);
        for film in [DVec2::ZERO, DVec2::new(9.0, -3.0), DVec2::new(18.0, 12.0)] {
            let exact = lens.irradiance(film, film_z);
            for target in &targets {
                let window = target.window(film);
                let (n, mut sum, mut square) = (20_000, 0.0, 0.0);
                for _ in 0..n {
                    let aim = window.point(dice.next(), dice.next());
                    if lens
                        .trace_from_film(&film_ray(&lens, film, film_z, aim))
                        .is_ok()
                    {
                        let cos2 = z * z / (z * z + (aim - film).length_squared());
                        let light = cos2 * cos2 / (z * z) / window.density(aim);
                        sum += light;
                        square += light * light;
                    }
                }
                let n = f64::from(n);
                let mean = sum / n;
                let error = ((square / n - mean * mean) / n).sqrt();
                // The integral of the outline is accurate to 4e-6.
                let off = (mean - exact).abs() / (error + 4e-6 * exact);
                assert!(off < 4.5, "{name} at {film}: {off} standard errors");
            }
        }
    }
}

/// For random lenses whose pupil has several regions, the window's estimate of the light by a few
/// aims is that of a disc around everything. In four comparisons at 4.5 standard errors, a correct
/// program fails once in 30,000 runs, and the seeds are fixed.
#[test]
fn light_in_several_pieces_is_estimated_without_bias() {
    let mut found = 0;
    for seed in 0.. {
        let mut dice = Dice(seed << 20);
        let rows: Vec<Row> = (0..30 + seed % 10)
            .map(|_| {
                (
                    0.04 * dice.next() - 0.02,
                    6.0 * dice.next(),
                    1.4 + 0.5 * dice.next(),
                )
            })
            .collect();
        let lens = lens_of(&rows);
        let Some(focal) = lens.first_order().focal else {
            continue;
        };
        if !(focal.bfl > 1.0 && focal.bfl < 1e3) {
            continue;
        }
        let film_z = focal.rear_focal_point;
        let target = PupilTarget::exit_pupil(&lens, film_z, 10.0);
        let disc = |_: DVec2| PupilWindow::Disc {
            radius: 18.0,
            map: ivcam_optics::sampling::DiscMap::Concentric,
        };
        let all = light_between(&lens, film_z, &target, &disc, 4_000, &mut dice);
        if all.beside < 8 {
            continue;
        }
        let own = |film| target.window(film);
        let own = light_between(&lens, film_z, &target, &own, 60_000, &mut dice);
        let all = light_between(&lens, film_z, &target, &disc, 60_000, &mut dice);
        let off = (own.mean - all.mean).abs() / (own.variance + all.variance).sqrt();
        assert!(off < 4.5, "{off} standard errors, seed {seed}");
        found += 1;
        if found == 4 {
            return;
        }
    }
}

struct Light {
    mean: f64,
    variance: f64,
    /// The number of rays that pass outside the pupil's polygon.
    beside: u32,
}

/// Estimates the light on film points from 4 to 8 mm from the axis, by random aims through windows.
fn light_between<'a>(
    lens: &Lens,
    film_z: f64,
    target: &PupilTarget,
    window: &dyn Fn(DVec2) -> PupilWindow<'a>,
    count: u32,
    dice: &mut Dice,
) -> Light {
    let z = film_z - lens.length();
    let (mut sum, mut square, mut beside) = (0.0, 0.0, 0);
    for _ in 0..count {
        let film = DVec2::new(4.0 + 4.0 * dice.next(), 0.0);
        let window = window(film);
        let aim = window.point(dice.next(), dice.next());
        if lens
            .trace_from_film(&film_ray(lens, film, film_z, aim))
            .is_ok()
        {
            let polygon = match target.window(film) {
                PupilWindow::Polygon(polygon) | PupilWindow::Defensive(polygon, _) => Some(polygon),
                _ => None,
            };
            beside += u32::from(polygon.is_some_and(|polygon| !polygon.contains(aim)));
            let cos2 = z * z / (z * z + (aim - film).length_squared());
            let light = cos2 * cos2 / (z * z) / window.density(aim);
            sum += light;
            square += light * light;
        }
    }
    let n = f64::from(count);
    let mean = sum / n;
    Light {
        mean,
        variance: (square / n - mean * mean) / n,
        beside,
    }
}

fn film_ray(lens: &Lens, film: DVec2, film_z: f64, aim: DVec2) -> LensRay {
    let origin = film.extend(film_z);
    let direction = unit(aim.extend(lens.length()) - origin).unwrap();
    LensRay { origin, direction }
}

/// Random numbers in [0, 1), from the upper bits of a linear congruential generator.
struct Dice(u64);

impl Dice {
    fn next(&mut self) -> f64 {
        self.0 = self
            .0
            .wrapping_mul(6364136223846793005)
            .wrapping_add(1442695040888963407);
        (self.0 >> 11) as f64 / (1u64 << 53) as f64
    }

    fn disc(&mut self) -> DVec2 {
        let (sin, cos) = libm::sincos(std::f64::consts::TAU * self.next());
        self.next().sqrt() * DVec2::new(cos, sin)
    }
}
