//! Lenses with mirrors, against figures of other programs and closed forms.

use glam::{DVec2, DVec3};
use ivcam_base::diag::Sink;
use ivcam_base::math::lanes::Width;
use ivcam_optics::lens::analysis::aberrations::seidel::SeidelSums;
use ivcam_optics::lens::{
    Bundle, Coating, GhostPair, Lens, LensRay, Prescription, Shape, Surface, Toward,
};
use ivcam_optics::prescription::formats::write::{OutputFormat, write};
use ivcam_optics::prescription::{Medium, Reading};
use serde_json::Value;

/// The systems of `tests/lenses/reference/mirrors.json`, which
/// `crates/measure/mirrors_reference.py` makes: the name, the lens and the rays.
fn reference() -> Vec<(String, Lens, Vec<Vec<f64>>)> {
    let file = concat!(
        env!("CARGO_MANIFEST_DIR"),
        "/../../tests/lenses/reference/mirrors.json"
    );
    let root: Value = serde_json::from_str(&std::fs::read_to_string(file).unwrap()).unwrap();
    let list = |value: &Value| -> Vec<f64> {
        let all = value.as_array().unwrap().iter();
        all.map(|value| value.as_f64().unwrap_or(0.0)).collect()
    };
    let system = |(name, system): (&String, &Value)| {
        let mut surfaces: Vec<Surface> = Vec::new();
        for row in system["rows"].as_array().unwrap() {
            let numbers = list(row);
            let medium = Medium::constant(numbers[2].max(1.0));
            let surface = Surface::sphere(numbers[0], numbers[1], medium, numbers[3]);
            let mut terms = Box::new([0.0; 21]);
            for (i, term) in list(&row[5]).into_iter().enumerate() {
                terms[4 + 2 * i] = term;
            }
            surfaces.push(Surface {
                shape: match terms.iter().any(|term| *term != 0.0) {
                    true => Shape::Asphere {
                        k: numbers[4],
                        terms,
                    },
                    false => Shape::Conic { k: numbers[4] },
                },
                is_mirror: row[2].is_null(),
                ..surface
            });
        }
        // The rows have the signs of a straight axis.
        let lens = Lens::new(Prescription::new(name, surfaces).folded());
        let rays = system["rays"].as_array().unwrap().iter().map(list);
        (name.clone(), lens, rays.collect())
    };
    let systems = root["systems"].as_object().unwrap();
    systems.iter().map(system).collect()
}

/// The largest differences of hits and directions are printed for docs/accuracy.md.
#[test]
fn rays_are_those_of_rayoptics_and_optiland() {
    for (name, lens, rays) in reference() {
        assert_eq!(rays.len(), 36);
        let (mut off, mut turned) = (0.0f64, 0.0f64);
        for ray in rays {
            let [origin, direction, hit, out] =
                [0, 3, 6, 9].map(|at| DVec3::from_slice(&ray[at..at + 3]));
            let path = lens.trace_path(&LensRay { origin, direction }, Toward::Film, false);
            let found = path.outcome.unwrap().direction;
            // Behind an odd number of mirrors, light travels against the straight axis.
            let found = DVec3::new(found.x, found.y, found.z * out.z.signum());
            off = off.max((*path.hits.last().unwrap() - hit).length());
            turned = turned.max((found - out).length());
        }
        println!("{name}: {off:.1e} mm, {turned:.1e}");
        assert!(off < 1e-11 && turned < 1e-13, "{name}: {off:e} {turned:e}");
    }
}

#[test]
fn bundles_of_rays_and_rays_from_the_film_take_the_same_paths() {
    for (name, lens, rays) in reference() {
        for ray in rays {
            let [origin, direction] = [0, 3].map(|at| DVec3::from_slice(&ray[at..at + 3]));
            let ray = LensRay { origin, direction };
            let Ok(out) = lens.trace_from_scene(&ray) else {
                continue;
            };
            a_bundle_and_the_way_back_agree(&name, &lens, (&ray, &out));
        }
    }
}

/// Checks that a ray in a bundle leaves a lens as it does alone, and that both come back on its
/// path from a point behind the lens.
pub(super) fn a_bundle_and_the_way_back_agree(
    name: &str,
    lens: &Lens,
    (ray, out): (&LensRay, &LensRay),
) {
    let mut bundle = Bundle::default();
    bundle.set(3, ray);
    lens.trace_bundle(&mut bundle, Toward::Film, Width::detect());
    let beside = bundle.ray(3);
    assert!(bundle.passed(3), "{name}");
    assert!((beside.origin - out.origin).length() < 1e-11, "{name}");
    assert!((beside.direction - out.direction).length() < 1e-13);
    let back = LensRay::new(out.origin + 30.0 * out.direction, -out.direction);
    let again = lens.trace_from_film(&back).unwrap();
    assert!((again.direction + ray.direction).length() < 1e-12, "{name}");
    let off = (again.origin - ray.origin).cross(ray.direction).length();
    assert!(off < 1e-10, "{name}: {off}");
    bundle.set(3, &back);
    lens.trace_bundle(&mut bundle, Toward::Scene, Width::detect());
    assert!((bundle.ray(3).origin - again.origin).length() < 1e-11);
    assert!((bundle.ray(3).direction - again.direction).length() < 1e-13);
}

fn mirror(radius: f64, thickness: f64, semi_diameter: f64, k: f64) -> Surface {
    Surface {
        shape: Shape::Conic { k },
        is_mirror: true,
        ..Surface::sphere(radius, thickness, Medium::air(), semi_diameter)
    }
}

/// A classical Cassegrain of f = 600 mm: all rays parallel to the axis meet in one point, at equal
/// optical paths.
#[test]
fn a_cassegrain_has_no_spherical_aberration_and_its_first_order_data() {
    let mut surfaces = vec![
        mirror(-400.0, 140.0, 25.0, -1.0),
        mirror(180.0, 180.0, 9.0, -4.0),
    ];
    surfaces[0].is_stop = true;
    let lens = Lens::new(Prescription::new("cassegrain", surfaces));
    let focal = lens.first_order().focal.unwrap();
    assert!((focal.efl - 600.0).abs() < 1e-9 && (focal.bfl - 180.0).abs() < 1e-9);
    // The second mirror is 140 mm in front of the first one.
    assert!((lens.length() + 140.0).abs() < 1e-12);
    assert!((focal.rear_focal_point - 40.0).abs() < 1e-9);
    for height in [5.0, 12.0, 25.0] {
        let ray = LensRay::new(DVec3::new(height, 0.0, -500.0), DVec3::Z);
        let out = lens.trace_from_scene(&ray).unwrap();
        assert!(out.at_z(focal.rear_focal_point).truncate().length() < 1e-11);
    }
    let sums = SeidelSums::of(&lens, f64::INFINITY, 25.0, 5.0).unwrap();
    assert!(sums.sum.s1.abs() < 1e-15, "{}", sums.sum.s1);
    // The coma of any two-mirror telescope without spherical aberration and with its stop at the
    // primary is that of a paraboloid of its focal length: S_II = n² H y³ / (2 f²) times sign.
    let slope = 5.0 / 600.0;
    let parabola = 25.0f64.powi(3) * slope / (2.0 * 600.0 * 600.0);
    assert!(
        (sums.sum.s2.abs() / parabola - 1.0).abs() < 1e-9,
        "{}",
        sums.sum.s2
    );
    // The Petzval sum of mirrors of radii R: 2/R2 − 2/R1, for a flat image with S_IV of the sign of
    // a lens.
    let petzval = (2.0 / 180.0 - 2.0 / 400.0) * sums.invariant * sums.invariant;
    assert!(
        (sums.sum.s4 / petzval - 1.0).abs() < 1e-9,
        "{} {petzval}",
        sums.sum.s4
    );
}

/// The light on the film is what a grid of rays brings, with the middle closed.
#[test]
fn an_obstruction_takes_its_light_and_leaves_the_f_number() {
    let lens = Lens::named("mirror-500").unwrap();
    let film_z = lens.first_order().focal.unwrap().rear_focal_point;
    let n = lens.real_f_number().unwrap();
    assert!((n / 8.0 - 1.0).abs() < 0.01, "{n}");
    assert!(lens.t_number().unwrap() > 1.1 * n);
    for height in [0.0, 12.0, 20.0] {
        let film = DVec2::new(0.0, height);
        let known = lens.irradiance(film, film_z);
        let origin = film.extend(film_z);
        // The beam is 6 mm wide on the last vertex plane.
        let (mut sum, across) = (0.0, 700);
        let cell = 7.0 / f64::from(across);
        for k in 0..3 * across * across {
            let place = |i: i32| cell * (f64::from(i) + 0.5) - 3.5;
            let aim = DVec2::new(place(k % across), place(k / across));
            let direction = aim.extend(lens.length()) - origin;
            if lens.trace_from_film(&LensRay { origin, direction }).is_ok() {
                let cos2 = direction.z * direction.z / direction.length_squared();
                sum += cell * cell * cos2 * cos2 / (direction.z * direction.z);
            }
        }
        assert!((known / sum - 1.0).abs() < 5e-4, "{height}: {known} {sum}");
    }
}

#[test]
fn mirrors_are_the_same_in_all_formats_that_hold_them() {
    let lens = Lens::named("mirror-500").unwrap();
    for (target, ending) in [
        (OutputFormat::Json, "json"),
        (OutputFormat::Zemax, "zmx"),
        (OutputFormat::CodeV, "seq"),
    ] {
        let (text, _) = write(lens.prescription(), target).unwrap();
        let file =
            std::env::temp_dir().join(format!("ivcam-mirror-{}.{ending}", std::process::id()));
        std::fs::write(&file, text).unwrap();
        let mut sink = Sink::new();
        let again = Lens::open_as(&file, &Reading::default(), &mut sink).unwrap();
        std::fs::remove_file(&file).unwrap();
        assert!(sink.items().is_empty(), "{ending}: {}", sink.items()[0]);
        for (a, b) in lens
            .prescription()
            .surfaces
            .iter()
            .zip(&again.prescription().surfaces)
        {
            let numbers = |s: &Surface| [s.curvature.radius(), s.thickness, s.obstruction];
            for (a, b) in numbers(a).into_iter().zip(numbers(b)) {
                assert!((a - b).abs() <= 1e-12 * a.abs(), "{ending}: {a} {b}");
            }
            assert_eq!(
                (a.is_mirror, a.is_stop),
                (b.is_mirror, b.is_stop),
                "{ending}"
            );
        }
    }
    let refused = write(lens.prescription(), OutputFormat::Columns).unwrap_err();
    assert!(refused.message.contains("in its middle"), "{refused}");
}

/// Traces a ghost to the film and back, and checks that it returns on its way with the same share
/// of light. Returns whether it gets to the film.
pub(crate) fn is_traced_back(lens: &Lens, ray: &LensRay, pair: GhostPair) -> bool {
    let nm = [550.0; 3];
    let Some((out, share)) = lens.trace_ghost(ray, pair, Toward::Film, nm) else {
        return false;
    };
    let back = LensRay::new(out.origin + 10.0 * out.direction, -out.direction);
    let (again, same) = lens.trace_ghost(&back, pair, Toward::Scene, nm).unwrap();
    assert!((again.direction + ray.direction).length() < 1e-11);
    assert!((share - same).length() < 1e-12);
    true
}

/// Light that bounces between the surfaces of the corrector takes the way through both mirrors.
#[test]
fn ghosts_of_a_lens_with_mirrors_are_reversible() {
    let lens = Lens::named("mirror-500")
        .unwrap()
        .with_coating(Coating::Bare);
    let mut traced = 0;
    for pair in lens.ghost_pairs() {
        let mirrors = |i: usize| lens.prescription().surfaces[i].is_mirror;
        assert!(!mirrors(pair.front) && !mirrors(pair.rear));
        let ray = LensRay::new(
            DVec3::new(25.0, 3.0, -50.0),
            DVec3::new(0.001, 0.002, 1.0).normalize(),
        );
        traced += usize::from(is_traced_back(&lens, &ray, pair));
    }
    assert!(traced >= 3, "{traced}");
}

#[test]
fn the_shipped_mirror_lens_has_the_spots_of_its_design() {
    let lens = Lens::named("mirror-500").unwrap();
    let film_z = lens.best_focus(f64::INFINITY).unwrap();
    let spot = lens.spot(DVec2::ZERO, film_z, 40).unwrap();
    assert!(spot.rms < 4e-3, "{}", spot.rms);
    let edge = lens.spot(DVec2::new(0.0, 20.0), film_z, 40).unwrap();
    assert!(edge.rms < 10e-3, "{}", edge.rms);
}
