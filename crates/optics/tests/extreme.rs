//! Stiff and extreme cases of the lens, each with an answer known by another method.

use std::sync::Arc;

use glam::{DVec2, DVec3};
use ivcam_base::diag::{Result, Sink, Source};
use ivcam_base::math::{Meters, Mm};
use ivcam_optics::lens::{
    FocusFault, FocusMethod, Lens, LensRay, Loss, LossKind, Prescription, PupilTarget, Shape,
    Surface, Toward,
};
use ivcam_optics::prescription::Medium;
use ivcam_optics::prescription::formats;

fn lens(rows: &[(f64, f64, f64, f64)]) -> Lens {
    let row = |&(r, t, n, a): &(f64, f64, f64, f64)| Surface::sphere(r, t, Medium::constant(n), a);
    Lens::new(Prescription::new("test", rows.iter().map(row).collect()))
}

fn in_medium(n_object: f64, rows: &[(f64, f64, f64, f64)]) -> Lens {
    let mut prescription = lens(rows).prescription().clone();
    prescription.object_medium = Medium::constant(n_object);
    Lens::new(prescription)
}

fn ray(origin: [f64; 3], direction: [f64; 3]) -> LensRay {
    LensRay::new(DVec3::from_array(origin), DVec3::from_array(direction))
}

const OPEN: f64 = f64::INFINITY;

const MISSED_AT_FIRST: Loss = Loss {
    kind: LossKind::Missed,
    surface: 0,
};

mod radii {
    use super::*;

    /// The reference sag is y²/(R + √(R² − y²)), which has no cancellation.
    #[test]
    fn the_sag_is_right_from_a_meter_to_a_plane() {
        for exponent in 3..=18 {
            for sign in [1.0, -1.0] {
                let r = sign * libm::pow(10.0, f64::from(exponent));
                let flat = lens(&[(r, 0.0, 1.5, OPEN)]);
                let path =
                    flat.trace_path(&ray([0.0, 8.0, -5.0], [0.0, 0.0, 1.0]), Toward::Film, true);
                let sag = 64.0 / r / (1.0 + (1.0 - 64.0 / r / r).sqrt());
                assert!(
                    (path.hits[0].z - sag).abs() < 2e-15,
                    "R = {r}: {}",
                    path.hits[0].z
                );
            }
        }
    }

    #[test]
    fn a_plane_is_the_limit_of_large_radii() {
        let oblique = ray([0.0, 10.0, -100.0], [0.0625, -0.03125, 1.0]);
        let plane = lens(&[(0.0, 0.0, 1.5, OPEN)])
            .trace_from_scene(&oblique)
            .unwrap();
        let flat = lens(&[(1e17, 0.0, 1.5, OPEN)])
            .trace_from_scene(&oblique)
            .unwrap();
        assert!((plane.origin - flat.origin).length() < 1e-13);
        assert!((plane.direction - flat.direction).length() < 3e-16);
    }
}

mod rims {
    use super::*;

    const HEMISPHERE: [(f64, f64, f64, f64); 1] = [(10.0, 0.0, 1.5, 10.0)];

    /// At height R − δ, the sag is R − √(2Rδ − δ²).
    #[test]
    fn a_hemisphere_is_hit_up_to_its_rim_and_missed_at_it() {
        let hemisphere = lens(&HEMISPHERE);
        for (bits, tolerance) in [(20, 1e-12), (40, 1e-9), (50, 1e-7)] {
            let y = 10.0 * (1.0 - libm::exp2(-f64::from(bits)));
            let out = hemisphere
                .trace_from_scene(&ray([0.0, y, -5.0], [0.0, 0.0, 1.0]))
                .unwrap();
            let delta = 10.0 - y;
            let sag = 10.0 - (20.0 * delta - delta * delta).sqrt();
            assert!(
                (out.origin.z - sag).abs() < tolerance,
                "{bits}: {}",
                out.origin.z - sag
            );
        }
        for y in [10.0, 10.000000000000009, 11.0] {
            let lost = hemisphere.trace_from_scene(&ray([0.0, y, -5.0], [0.0, 0.0, 1.0]));
            assert_eq!(lost, Err(MISSED_AT_FIRST));
        }
    }

    #[test]
    fn the_far_half_of_a_sphere_is_not_a_surface() {
        let hemisphere = lens(&HEMISPHERE);
        for from in [
            ray([0.0, -3.0, 25.0], [0.0, 0.5, -1.0]),
            ray([0.0, 30.0, 16.0], [0.0, -1.0, -0.1]),
        ] {
            let lost = hemisphere.trace_from_scene(&from).unwrap_err();
            assert_eq!(lost.kind, LossKind::Missed);
        }
    }

    /// A cap of more than 90 degrees, as on the front of a fish-eye lens, accepts a ray that runs
    /// backward.
    #[test]
    fn a_ray_at_100_degrees_enters_a_steep_cap() {
        let angle = 100f64.to_radians();
        let direction = [0.0, -libm::sin(angle), libm::cos(angle)];
        let cap = lens(&[(20.0, 0.0, 1.8, 20.0)]);
        let out = cap
            .trace_from_scene(&ray([0.0, 68.0, 21.8], direction))
            .unwrap();
        // By Snell's law, sines to the normal are inversely proportional to the indices.
        let normal = (out.origin - DVec3::new(0.0, 0.0, 20.0)) / 20.0;
        let before = DVec3::from_array(direction).cross(normal).length();
        assert!((before - 1.8 * out.direction.cross(normal).length()).abs() < 1e-14);
    }

    #[test]
    fn a_ray_at_the_very_edge_of_an_aperture_passes_and_the_next_double_does_not() {
        let mut stop = lens(&[(0.0, 0.0, 1.0, 8.0), (0.0, 1.0, 1.0, OPEN)])
            .prescription()
            .clone();
        stop.surfaces[0].is_stop = true;
        let stop = Lens::new(stop);
        assert!(
            stop.trace_from_scene(&ray([0.0, 8.0, -1.0], [0.0, 0.0, 1.0]))
                .is_ok()
        );
        let lost = stop.trace_from_scene(&ray([0.0, 8.000000000000002, -1.0], [0.0, 0.0, 1.0]));
        assert_eq!(
            lost,
            Err(Loss {
                kind: LossKind::Blocked,
                surface: 0
            })
        );
    }
}

mod bending {
    use super::*;

    /// Grazing light is refracted at the critical angle, sin = 1/n.
    #[test]
    fn grazing_light_enters_glass_at_the_critical_angle() {
        let plane = lens(&[(0.0, 0.0, 1.5, OPEN)]);
        for cos in [1e-6, 1e-9, 1e-12] {
            let out = plane
                .trace_from_scene(&ray([0.0, -1.0, -cos], [0.0, 1.0, cos]))
                .unwrap();
            assert!((out.direction.y - 1.0 / 1.5).abs() < 1e-12, "{cos}");
        }
        // A ray along the plane does not intersect it.
        let along = plane.trace_from_scene(&ray([0.0, -1.0, -1.0], [0.0, 1.0, 0.0]));
        assert_eq!(along, Err(MISSED_AT_FIRST));
    }

    #[test]
    fn total_reflection_begins_at_the_critical_angle() {
        let out_of_glass = in_medium(1.5, &[(0.0, 0.0, 1.0, OPEN)]);
        for (offset, passes) in [(-1e-12f64, true), (1e-12, false)] {
            let sin = (1.0 + offset) / 1.5;
            let d = [0.0, sin, (1.0 - sin * sin).sqrt()];
            let out = out_of_glass.trace_from_scene(&ray([0.0, 0.0, -1.0], d));
            match out {
                // Here cos² = 1 − (1 + offset)² ≈ −2 offset.
                Ok(out) if passes => {
                    let cos = (-2.0 * offset).sqrt();
                    assert!(
                        (out.direction.z / cos - 1.0).abs() < 1e-3,
                        "{}",
                        out.direction.z
                    );
                }
                Err(loss) if !passes => assert_eq!(loss.kind, LossKind::TotalReflection),
                other => panic!("{offset}: {other:?}"),
            }
        }
    }

    /// A step of ε in the index bends a ray by ε tan I.
    #[test]
    fn a_step_of_the_index_of_2_to_the_minus_40_is_resolved() {
        let step = libm::exp2(-40.0);
        let slight = lens(&[(20.0, 0.0, 1.0 + step, OPEN)]);
        let out = slight
            .trace_from_scene(&ray([0.0, 8.0, -30.0], [0.0, 0.0, 1.0]))
            .unwrap();
        let tan = 8.0 / (400.0f64 - 64.0).sqrt();
        assert!(
            (out.direction.y / (-step * tan) - 1.0).abs() < 1e-10,
            "{}",
            out.direction.y
        );
    }

    #[test]
    fn the_same_index_leaves_the_direction_alone_to_the_bit() {
        for n in [1.0, 1.772] {
            let idle = in_medium(n, &[(-51.312, 0.523, n, 20.8)]);
            let d = ivcam_optics::lens::trace::ray::unit(DVec3::new(0.01, 0.2, 0.97)).unwrap();
            let asked = LensRay::new(DVec3::new(0.3, 5.0, -30.0), d);
            assert_eq!(idle.trace_from_scene(&asked).unwrap().direction, d);
        }
    }

    #[test]
    fn a_plate_and_a_net_of_equal_surfaces_do_not_turn_a_ray() {
        let d = DVec3::new(0.0, 1.0, 1.0).normalize();
        for idle in [
            lens(&[(0.0, 10.0, 1.5, OPEN), (0.0, 0.0, 1.0, OPEN)]),
            lens(&[
                (-50.0, 0.0, 1.5, 15.0),
                (-50.0, 0.0, 1.7, 15.0),
                (-50.0, 4.0, 1.0, 15.0),
            ]),
        ] {
            let out = idle.trace_from_scene(&LensRay::new(-20.0 * d, d)).unwrap();
            assert!((out.direction - d).length() < 5e-16);
        }
    }

    #[test]
    fn a_ray_through_a_common_center_goes_straight() {
        let shell = lens(&[(50.0, 10.0, 1.5, 30.0), (40.0, 0.0, 1.0, 30.0)]);
        let center = DVec3::new(0.0, 0.0, 50.0);
        let origin = DVec3::new(-30.0, -40.0, -70.0);
        let d = (center - origin).normalize();
        let out = shell.trace_from_scene(&LensRay::new(origin, d)).unwrap();
        assert!((out.direction - d).length() < 5e-16);
    }
}

mod stigmatic {
    use super::*;

    fn conic(radius: f64, k: f64, rows: &[(f64, f64, f64, f64)], i: usize) -> Lens {
        let mut prescription = lens(rows).prescription().clone();
        prescription.surfaces[i].shape = Shape::Conic { k };
        prescription.surfaces[i].curvature =
            ivcam_optics::prescription::Curvature::from_radius(radius);
        Lens::new(prescription)
    }

    /// A plano-hyperboloid with k = −n² focuses parallel light to one point at R/(n − 1).
    #[test]
    fn a_hyperboloid_has_no_spherical_aberration() {
        let rows = [(0.0, 8.0, 1.5, 30.0), (-50.0, 100.0, 1.0, 30.0)];
        let lens = conic(-50.0, -2.25, &rows, 1);
        for h in [1.0, 10.0, 29.0] {
            let out = lens
                .trace_from_scene(&ray([0.0, h, -20.0], [0.0, 0.0, 1.0]))
                .unwrap();
            let focus = out.origin.z - out.origin.y * out.direction.z / out.direction.y;
            assert!((focus - 108.0).abs() < 1e-11, "h = {h}: {focus}");
        }
    }

    /// A polynomial with the series of the conic must agree with the conic.
    #[test]
    fn newtons_iteration_agrees_with_the_closed_form() {
        let rows = [(0.0, 8.0, 1.5, 30.0), (-50.0, 100.0, 1.0, 30.0)];
        let exact = conic(-50.0, -2.25, &rows, 1);
        let mut near = exact.prescription().clone();
        let mut terms = Box::new([0.0; 21]);
        terms[20] = 1e-60;
        near.surfaces[1].shape = Shape::Asphere { k: -2.25, terms };
        let near = Lens::new(near);
        for h in [0.0, 1.0, 10.0, 29.0] {
            let asked = ray([3.0, h, -20.0], [0.02, -0.05, 1.0]);
            let (a, b) = (
                exact.trace_from_scene(&asked),
                near.trace_from_scene(&asked),
            );
            let (a, b) = (a.unwrap(), b.unwrap());
            assert!((a.origin - b.origin).length() < 1e-13);
            assert!((a.direction - b.direction).length() < 1e-14);
        }
    }

    /// The sag of a paraboloid is y²/2R, also for rays along its axis (x² = 4 f z).
    #[test]
    fn a_paraboloid_is_hit_although_its_quadratic_term_vanishes() {
        let lens = conic(30.0, -1.0, &[(30.0, 0.0, 1.5, OPEN)], 0);
        let out = lens
            .trace_from_scene(&ray([0.0, 12.0, -5.0], [0.0, 0.0, 1.0]))
            .unwrap();
        assert!((out.origin.z - 2.4).abs() < 1e-15);
    }

    /// The image of the point R/n from the center is n R from the center, for every angle (Abbe,
    /// Weierstrass).
    #[test]
    fn the_aplanatic_points_of_a_sphere_image_each_other() {
        let n = 1.5;
        let sphere = in_medium(n, &[(-9.0, 0.0, 1.0, OPEN)]);
        for degrees in [5.0f64, 30.0, 50.0] {
            let (sin, cos) = libm::sincos(degrees.to_radians());
            let out = sphere
                .trace_from_scene(&ray([0.0, 0.0, -15.0], [0.0, sin, cos]))
                .unwrap();
            let image = out.origin.z - out.origin.y * out.direction.z / out.direction.y;
            assert!((image + 22.5).abs() < 1e-13, "{degrees}: {image}");
            // By the sine condition, sin / sin' is n for all.
            assert!((sin / out.direction.y - n).abs() < 1e-14);
        }
    }
}

mod scales {
    use super::*;

    #[test]
    fn a_direction_of_any_length_is_the_same_direction() {
        let lens = Lens::named("double-gauss").unwrap();
        let film = ray([0.0, 20.0, lens.length() + 70.0], [0.0, -8.0, -72.0]);
        let plain = lens.trace_from_film(&film).unwrap();
        for length in [1e-150, 1e-300, 1e150, 1e300] {
            let scaled = LensRay {
                direction: length * film.direction,
                ..film
            };
            let out = lens.trace_from_film(&scaled).unwrap();
            assert!((out.direction - plain.direction).length() < 1e-14);
        }
    }

    #[test]
    fn a_lens_scaled_by_a_power_of_two_gives_the_same_bits() {
        let lens = Lens::named("fisheye").unwrap();
        let film = ray([0.0, 90.0, lens.length() + 230.0], [0.0, -80.0, -210.0]);
        let plain = lens.trace_from_film(&film).unwrap();
        for bits in [-30.0, -10.0, 20.0, 40.0] {
            let k = libm::exp2(bits);
            let scaled = LensRay {
                origin: k * film.origin,
                ..film
            };
            let out = lens.scaled(k).trace_from_film(&scaled).unwrap();
            assert_eq!(
                (out.direction, out.origin),
                (plain.direction, k * plain.origin)
            );
        }
    }

    /// At 1e9 m the ray is known only to 1e-4 mm; it must still arrive where it is aimed.
    #[test]
    fn an_origin_a_million_kilometers_away_costs_only_its_own_rounding() {
        let lens = Lens::named("double-gauss").unwrap();
        let near = ray([0.0, 3.0, -100.0], [0.0, -0.015625, 1.0]);
        let far = LensRay {
            origin: near.origin - 1e12 * near.direction,
            ..near
        };
        let (a, b) = (
            lens.trace_from_scene(&near).unwrap(),
            lens.trace_from_scene(&far).unwrap(),
        );
        assert!(
            (a.origin - b.origin).length() < 5e-4,
            "{}",
            a.origin - b.origin
        );
        assert!((a.direction - b.direction).length() < 1e-5);
    }

    #[test]
    fn surfaces_that_cross_off_the_axis_are_hit_by_a_backward_step() {
        // The second surface is in front of the first everywhere off the axis.
        let crossed = lens(&[(-60.0, 0.0, 1.5, 15.0), (-50.0, 5.0, 1.0, 15.0)]);
        let path = crossed.trace_path(
            &ray([0.0, 10.0, -30.0], [0.0, 0.05, 1.0]),
            Toward::Film,
            true,
        );
        assert!(path.outcome.is_ok());
        assert!(path.hits[1].z < path.hits[0].z);
    }
}

mod focusing {
    use super::*;

    #[test]
    fn a_distance_too_near_to_focus_is_reported_with_the_nearest_one() {
        let lens = Lens::named("double-gauss").unwrap();
        let near = -lens.first_order().focal.unwrap().ffl;
        let at = |mm: f64| lens.focus(FocusMethod::Film, Meters(mm / 1000.0));
        assert!(matches!(
            at(near),
            Err(FocusFault::ObjectAtFocalPoint { .. })
        ));
        for distance in [0.5 * near, 0.999_999_999 * near] {
            let Err(FocusFault::VirtualImage { nearest }) = at(distance) else {
                panic!()
            };
            assert!(at(nearest).is_ok());
        }
        assert!(matches!(at(-1.0), Err(FocusFault::NotADistance)));
        assert!(matches!(at(f64::NAN), Err(FocusFault::NotADistance)));
        let Err(FocusFault::TooNear { nearest }) = lens.focus(FocusMethod::Lens, Meters(0.1))
        else {
            panic!()
        };
        assert!(
            lens.focus(FocusMethod::Lens, Meters(nearest * (1.0 + 1e-12) / 1000.0))
                .is_ok()
        );
    }

    /// The distance in a message, printed with four digits, must work.
    #[test]
    fn the_nearest_distance_that_a_message_names_works_for_every_lens() {
        // By real rays, the paraxial limit that `Best` names need not be sharp.
        let methods = [FocusMethod::Film, FocusMethod::Lens, FocusMethod::Group];
        let mut named = 0;
        for name in ivcam_optics::lens::shipped_names() {
            let lens = Lens::named(name).unwrap();
            for method in methods {
                for distance in [1e-4, 0.01, 0.05, 0.2] {
                    let Err(fault) = lens.focus(method, Meters(distance)) else {
                        continue;
                    };
                    let text = fault.diagnostic(name).render(false);
                    assert!(text.contains(name) && text.contains("help"), "{text}");
                    let mut digits = text.split_whitespace().filter_map(|word| word.parse().ok());
                    let Some(told) = digits.next_back().filter(|_| fault.nearest().is_some())
                    else {
                        continue;
                    };
                    named += 1;
                    let there = lens.focus(method, Meters(told));
                    assert!(there.is_ok(), "{name} {method:?}: {text} {there:?}");
                }
            }
        }
        assert!(named > 100, "{named}");
    }

    #[test]
    fn a_telescope_is_afocal_and_every_use_of_a_focus_reports_it() {
        // Both foci are at 150 mm in glass of 1.5, R n / (n - 1).
        let telescope = lens(&[(50.0, 300.0, 1.5, 10.0), (-50.0, 0.0, 1.0, 10.0)]);
        assert!(telescope.first_order().focal.is_none());
        assert!((telescope.first_order().matrix[3] + 1.0).abs() < 1e-12);
        for method in [FocusMethod::Film, FocusMethod::Lens, FocusMethod::Best] {
            let fault = telescope.focus(method, Meters(f64::INFINITY));
            assert_eq!(fault, Err(FocusFault::Afocal), "{method:?}");
        }
        // An object 100 mm in front of the lens is imaged 100 mm behind it in its own size.
        let near = telescope.focus(FocusMethod::Film, Meters(0.1)).unwrap();
        assert!((near.film_z - 400.0).abs() < 1e-9 && (near.magnification + 1.0).abs() < 1e-12);
        assert!(telescope.scaled_to(Mm(50.0)).is_err() && telescope.at_f_number(8.0).is_err());
        assert!(ivcam_optics::lens::analysis::sheet::LensSheet::of(&telescope).is_none());
        assert!(telescope.breathing(FocusMethod::Film, 10.0).is_empty());
    }

    #[test]
    fn a_sphere_of_index_2_has_its_focus_on_its_surface_and_one_of_4_inside() {
        let ball = |n| lens(&[(5.0, 10.0, n, 5.0), (-5.0, 0.0, 1.0, 5.0)]);
        let at_infinity = |lens: &Lens| lens.focus(FocusMethod::Film, Meters(f64::INFINITY));
        assert!((at_infinity(&ball(2.0)).unwrap().film_z - 10.0).abs() < 1e-14);
        assert!(matches!(
            at_infinity(&ball(4.0)),
            Err(FocusFault::FilmInsideLens { .. })
        ));
    }
}

mod stops {
    use super::*;

    /// With the smallest stop, first-order data does not change, and aimed rays still pass.
    #[test]
    fn at_f_1024_nothing_moves_and_rays_still_pass() {
        for name in ["double-gauss", "fisheye", "telephoto", "wide-angle"] {
            let open = Lens::named(name).unwrap();
            let tiny = open.at_f_number(1024.0).unwrap();
            assert_eq!(tiny.first_order().focal, open.first_order().focal);
            assert!((tiny.real_f_number().unwrap() - 1024.0).abs() < 1e-6);
            let film_z = open.first_order().focal.unwrap().rear_focal_point;
            let target = PupilTarget::exit_pupil(&tiny, film_z, 40.0);
            let (mut aimed, mut passed) = (0, 0);
            for i in 0..400 {
                let share = f64::from(i) / 400.0;
                let film = DVec2::new(36.0 * share, 10.0 * share);
                let window = target.window(film);
                if window.is_closed() {
                    continue; // This is beyond the field of the lens.
                }
                aimed += 1;
                let aim = window.point((13.0 * share).fract(), (7.0 * share).fract());
                let origin = film.extend(film_z);
                let direction = aim.extend(tiny.length()) - origin;
                passed += usize::from(tiny.trace_from_film(&LensRay { origin, direction }).is_ok());
            }
            assert!(aimed >= 150, "{name}: {aimed} aimed");
            assert!(passed > 95 * aimed / 100, "{name}: {passed} of {aimed}");
        }
    }

    #[test]
    fn a_stop_closes_to_a_diameter_and_refuses_nonsense() {
        let lens = Lens::named("telephoto").unwrap();
        assert!(lens.with_stop(Mm(1.0)).is_ok());
        for bad in [0.0, -1.0, f64::NAN, f64::INFINITY] {
            assert!(lens.with_stop(Mm(bad)).is_err());
            assert!(lens.at_f_number(bad).is_err());
        }
        assert!(
            lens.at_f_number(1.0)
                .unwrap_err()
                .help
                .unwrap()
                .contains("widest")
        );
    }
}

mod bad_input {
    use super::*;

    fn read(text: &str) -> (Result<Prescription>, Sink) {
        let mut sink = Sink::new();
        let result = formats::read(&Arc::new(Source::new("bad", text.into())), &mut sink);
        (result, sink)
    }

    #[test]
    fn every_bad_table_is_one_message_with_a_place() {
        for text in [
            "",
            "# only words\nradius thickness index aperture\n",
            "50 3 1.5\n",
            "50 3 0.9 20\n-50 0 1 20\n",
            "50 1.5 -3 20\n",
            "50 3 1.5 0\n",
            "50 3 1.5 -20\n",
            "50 3 NaN 20\n",
            "50 inf 1.5 20\n",
            "0 3 0 20\n",
            "0 3 0 20\n50 3 1.5 20\n0 3 0 20\n",
            "50 -3 1.5 20\n-50 0 1 20\n",
            "50 3 1.5 twenty\n",
            "{",
            "{}",
            "{\"surfaces\": []}",
            "{\"surfaces\": [1]}",
            "{\"surfaces\": [{\"R\": 1e999, \"n\": 1.5}]}",
            "{\"surfaces\": [{\"R\": 50, \"n\": 1.5, \"a\": -1}]}",
            "{\"surfaces\": [{\"R\": 50, \"n\": 1.5, \"a\": \"x\"}]}",
            "{\"surfaces\": [{\"R\": 50, \"n\": -1.5}]}",
            "{\"n_object\": 0, \"surfaces\": [{\"R\": 50, \"n\": 1.5}]}",
        ] {
            let (result, _) = read(text);
            let error = result.expect_err(text);
            assert!(error.location().1.is_some(), "{text}: {error}");
        }
    }

    #[test]
    fn a_fault_that_leaves_a_usable_lens_is_a_warning() {
        for (text, says) in [
            ("50 3 1.5 20\n-50 0 1 20\n", "no stop"),
            (
                "50 3 1.5 120\n0 1 0 5\n-50 0 1 20\n",
                "more than its radius",
            ),
            ("20 1 1.5 30\n-20 1 1 30\n0 1 0 5", "cross"),
            ("50 3 1.5 20\n0 1 0 5\n-50 10 1 20\n", "last thickness"),
            (
                r#"{"surfaces": [{"R": 50, "t": 3, "n_d": 1.5, "nd": 1.5}, {"kind": "stop"}]}"#,
                "no field `nd`",
            ),
        ] {
            let (result, sink) = read(text);
            assert!(result.is_ok(), "{text}");
            let found = sink.items().iter().any(|d| d.message.contains(says));
            assert!(found, "{text}: {:?}", sink.items());
        }
    }

    #[test]
    fn a_ray_without_a_direction_or_from_nowhere_is_lost_at_the_first_surface() {
        let lens = Lens::named("telephoto").unwrap();
        for bad in [
            ray([0.0, 0.0, -1.0], [0.0, 0.0, 0.0]),
            ray([0.0, 0.0, -1.0], [0.0, f64::NAN, 1.0]),
            ray([0.0, f64::INFINITY, -1.0], [0.0, 0.0, 1.0]),
            ray([f64::NAN, 0.0, -1.0], [0.0, 0.0, 1.0]),
        ] {
            let lost = lens.trace_from_scene(&bad);
            assert_eq!(lost, Err(MISSED_AT_FIRST));
        }
    }

    #[test]
    fn a_lens_that_is_not_there_has_a_near_name() {
        let error = Lens::named("wide-angel").unwrap_err();
        assert!(error.help.unwrap().contains("wide-angle"));
        assert!(Lens::open("no/such/lens.dat").is_err());
    }
}
