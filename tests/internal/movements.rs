//! Tests by rays of tilt, swing, shift and rise of the lens relative to the film, and of film bent
//! to a sphere.

use glam::{DQuat, DVec2, DVec3};
use ivcam_base::math::Meters;
use ivcam_inventor::pose::CameraPose;
use ivcam_optics::film::FilmFormat;
use ivcam_optics::lens::{
    FilmPlace, Focus, FocusMethod, Lens, LensRay, Movements, Prescription, PupilTarget, Surface,
};
use ivcam_optics::prescription::Medium;
use ivcam_render::camera::{Aim, Camera, CameraRay, LensCamera};

const FILM: FilmFormat = FilmFormat::STANDARD;

fn focused(name: &str, f_number: f64, meters: f64) -> (Lens, Focus) {
    let lens = Lens::named(name).unwrap().at_f_number(f_number).unwrap();
    let focus = lens.focus(FocusMethod::Film, Meters(meters)).unwrap();
    (lens, focus)
}

/// Returns a camera at the origin that looks along −z.
fn camera((lens, focus): &(Lens, Focus), moved: Movements) -> Camera {
    let pose = CameraPose {
        position: DVec3::ZERO,
        orientation: DQuat::IDENTITY,
        ..CameraPose::view_all(Default::default(), 1.5)
    };
    let place = FilmPlace::new(lens, focus, &moved, FILM).unwrap();
    let (lens, focus) = (lens.clone(), *focus);
    let camera = LensCamera::with_film(lens, focus, place, FILM, Aim::ExitPupil, &pose);
    Camera::Lens(Box::new(camera))
}

/// Returns rays of one film point, given in millimeters from the middle of the upright picture.
fn rays(camera: &Camera, right: f64, up: f64) -> Vec<CameraRay> {
    let point = camera.at(0.5 + right / FILM.width, 0.5 - up / FILM.height);
    let pupil = |i: u32| [f64::from(i % 8) / 8.0, 0.2 + 0.6 * f64::from(i / 8) / 3.0];
    (0..32).filter_map(|i| point.ray(pupil(i))).collect()
}

/// Returns the point nearest to all lines by least squares, in meters.
fn crossing(rays: &[CameraRay]) -> DVec3 {
    let mut matrix = glam::DMat3::ZERO;
    let mut right = DVec3::ZERO;
    for ray in rays {
        let d = ray.direction;
        let across = glam::DMat3::IDENTITY - glam::DMat3::from_cols(d * d.x, d * d.y, d * d.z);
        matrix += across;
        right += across * ray.origin;
    }
    matrix.inverse() * right
}

/// The sharp plane of a tilted lens contains the line below the lens where the plane through the
/// front principal point parallel to the film is f / sin(tilt) away (the hinge rule), and the point
/// in focus in the middle. With the principal points in place of the lens, this is the exact
/// geometry of the movements.
#[test]
fn by_its_principal_points_a_tilted_lens_is_sharp_on_the_plane_of_the_hinge_rule() {
    let sharp = focused("biogon", 22.0, 4.0);
    let focal = sharp.0.first_order().focal.unwrap();
    for degrees in [2.0, 8.0, -5.0] {
        let moved = Movements {
            tilt: f64::to_radians(degrees),
            ..Movements::default()
        };
        let place = FilmPlace::new(&sharp.0, &sharp.1, &moved, FILM).unwrap();
        let hinge = focal.efl / libm::sin(moved.tilt);
        let hub = place.camera_from_lens * (focal.front_principal_plane * DVec3::Z) + place.offset;
        let depth = 4000.0 + focal.front_principal_plane;
        for up in [-12.0, -5.0, 0.0, 3.0, 11.0] {
            // The ray from a film point continues through the principal points, with u by the lens
            // equation.
            let film = place.point(DVec2::new(0.0, -up)) - focal.rear_principal_plane * DVec3::Z;
            let u = 1.0 / (1.0 / focal.efl - 1.0 / film.z);
            let object = focal.front_principal_plane * DVec3::Z - film * (u / film.z);
            let p = place.camera_from_lens * object + place.offset - hub;
            let on_plane = hinge * (-p.z / depth - 1.0);
            assert!(
                (p.y - on_plane).abs() < 1e-9 * hinge.abs(),
                "{degrees}, {up}: {p}"
            );
        }
    }
}

/// The same test by rays. The difference is the lens's field curvature, which in a tilted lens
/// rotates the sharp plane by f over the field's radius, 5% of its slope for this flat field.
#[test]
fn by_rays_a_tilted_lens_is_sharp_on_the_plane_of_the_hinge_rule() {
    let sharp = focused("biogon", 22.0, 4.0);
    // The position of sharp focus also depends on spherical aberration.
    let flat = camera(&sharp, Movements::default());
    for degrees in [1.0, 3.0, -3.0] {
        let focal = sharp.0.first_order().focal.unwrap();
        let tilt = f64::to_radians(degrees);
        let moved = Movements {
            tilt,
            ..Movements::default()
        };
        let camera = camera(&sharp, moved);
        let [low, middle, high] = [-0.5, 0.0, 0.5].map(|up| crossing(&rays(&camera, 0.0, up)));
        let still = crossing(&rays(&flat, 0.0, 0.0));
        assert!(
            (middle - still).length() < 0.05,
            "{degrees}: {middle} {still}"
        );
        let run = (high - low).z;
        let wanted = (high - low).y * -4.0 / (1e-3 * focal.efl / libm::sin(tilt));
        assert!(
            (run / wanted - 1.0).abs() < 0.08,
            "{degrees}: {run}, not {wanted}"
        );
    }
}

#[test]
fn swing_is_tilt_turned_on_its_side() {
    let sharp = focused("double-gauss", 8.0, 3.0);
    let turn = 0.07;
    let tilted = Movements {
        tilt: turn,
        ..Movements::default()
    };
    let swung = Movements {
        swing: turn,
        ..Movements::default()
    };
    let (tilted, swung) = (camera(&sharp, tilted), camera(&sharp, swung));
    for (a, b) in [(4.0, 0.0), (-6.0, 3.0), (2.0, -9.0)] {
        // The lens is tilted down or swung to the right; the two differ by a quarter turn about the
        // view.
        let p = crossing(&rays(&tilted, a, b));
        let q = crossing(&rays(&swung, -b, a));
        let turned = DVec3::new(-p.y, p.x, p.z);
        assert!((q - turned).length() < 1e-3 * p.length(), "{p} {q}");
    }
}

#[test]
fn a_lens_that_rises_shows_the_picture_of_a_film_that_fell() {
    let sharp = focused("tessar", 8.0, f64::INFINITY);
    let still = camera(&sharp, Movements::default());
    let moved = camera(
        &sharp,
        Movements {
            rise: 5.0,
            shift: -2.0,
            ..Movements::default()
        },
    );
    let chief = |rays: Vec<CameraRay>| {
        let sum: DVec3 = rays.iter().map(|ray| ray.direction).sum();
        sum.normalize()
    };
    let (a, b) = (rays(&moved, 1.0, 2.0), rays(&still, -1.0, 7.0));
    // At infinity, the rays of one point are parallel except for the lens's aberrations.
    assert!((chief(a) - chief(b)).length() < 1e-4);
    let middle = chief(rays(&moved, 0.0, 0.0));
    assert!(middle.y > 0.0 && middle.x < 0.0, "{middle}");
}

/// All rays that pass the lens are inside the target that rays are aimed at, for any position of
/// the film.
#[test]
#[ignore = "a measurement of minutes, listed in docs/performance.md"]
fn the_pupil_of_a_moved_or_bent_film_cuts_no_ray() {
    let moves = [
        Movements {
            tilt: 0.12,
            rise: 6.0,
            ..Movements::default()
        },
        Movements {
            swing: -0.2,
            tilt: 0.05,
            shift: 11.0,
            ..Movements::default()
        },
        Movements {
            film_radius: Some(-60.0),
            ..Movements::default()
        },
        Movements {
            film_radius: Some(90.0),
            tilt: 0.1,
            ..Movements::default()
        },
    ];
    for name in ["double-gauss", "telephoto", "wide-angle", "anamorphic"] {
        for moved in moves {
            let lens = Lens::named(name).unwrap();
            let lens = lens.scaled_to(ivcam_base::math::Mm(80.0)).unwrap();
            let focus = lens.focus(FocusMethod::Film, Meters(2.0)).unwrap();
            let Ok(place) = FilmPlace::new(&lens, &focus, &moved, FILM) else {
                panic!("{name} {moved:?}");
            };
            let target = PupilTarget::exit_pupil_of(&lens, &place, FILM.half_diagonal());
            let reach = lens.prescription().surfaces.last().unwrap().semi_diameter;
            let (mut passed, mut inside) = (0, 0);
            for i in 0..16_000 {
                let at = |step: f64| (step * f64::from(i)).fract() - 0.5;
                let film = DVec2::new(at(0.8566748838545029), at(0.733891856627126));
                let film = film * DVec2::new(FILM.width, FILM.height);
                let aim = DVec2::new(at(0.6287067210378086), at(0.5385972572236011));
                let aim = 2.2 * reach * aim;
                let origin = place.point(film);
                let ray = LensRay::new(origin, aim.extend(lens.length()) - origin);
                let window = target.window(film);
                inside += usize::from(window.contains(aim));
                if lens.trace_from_film(&ray).is_ok() {
                    passed += 1;
                    assert!(window.contains(aim), "{name} {moved:?}: {film} {aim}");
                }
            }
            assert!(passed > 200, "{name} {moved:?}: {passed}");
            let share = passed as f64 / inside as f64;
            // A moved film has no symmetry, so its pupil is sampled on a plain grid.
            let least = if name == "anamorphic" { 0.5 } else { 0.8 };
            assert!(share > least, "{name} {moved:?}: only {share} pass");
        }
    }
}

/// A sphere with its stop in the middle is the same along every beam, so its image is a concentric
/// sphere whose radius is the focal length.
#[test]
fn film_bent_to_the_focal_sphere_of_a_ball_is_sharp_everywhere() {
    let glass = || Medium::constant(1.5);
    let surfaces = vec![
        Surface::sphere(10.0, 10.0, glass(), 9.0),
        Surface::stop(10.0, glass(), 1.0),
        Surface::sphere(-10.0, 0.0, Medium::air(), 9.0),
    ];
    let lens = Lens::new(Prescription::new("ball", surfaces));
    let focus = lens
        .focus(FocusMethod::Film, Meters(f64::INFINITY))
        .unwrap();
    let efl = lens.first_order().efl();
    assert!((efl - 15.0).abs() < 1e-12);
    let film = FilmFormat {
        width: 16.0,
        height: 12.0,
    };
    let spread = |film_radius: Option<f64>, height: f64| {
        let moved = Movements {
            film_radius,
            ..Movements::default()
        };
        let place = FilmPlace::new(&lens, &focus, &moved, film).unwrap();
        let target = PupilTarget::exit_pupil_of(&lens, &place, film.half_diagonal());
        let at = DVec2::new(0.0, height);
        let (window, origin) = (target.window(at), place.point(at));
        let aims = (0..64).map(|i| window.point(f64::from(i) / 64.0, 0.9));
        let out: Vec<DVec3> = aims
            .map(|aim| LensRay::new(origin, aim.extend(lens.length()) - origin))
            .filter_map(|ray| Some(lens.trace_from_film(&ray).ok()?.direction))
            .collect();
        let mean = out.iter().sum::<DVec3>() / out.len() as f64;
        let square: f64 = out.iter().map(|d| (*d - mean).length_squared()).sum();
        (square / out.len() as f64).sqrt()
    };
    let axis = spread(None, 0.0);
    let (bent, flat) = (spread(Some(-efl), 7.5), spread(None, 7.5));
    // At 30 degrees, half of the field, the stop appears slightly narrower.
    assert!(
        bent < 1.05 * axis,
        "{bent} on the sphere, {axis} on the axis"
    );
    assert!(flat > 5.0 * axis, "{flat} on a plane");
}

#[test]
fn impossible_movements_are_reported() {
    let sharp = focused("double-gauss", 8.0, 3.0);
    let fault = |moved| FilmPlace::new(&sharp.0, &sharp.1, &moved, FILM).unwrap_err();
    let bent = Movements {
        film_radius: Some(-20.0),
        ..Movements::default()
    };
    let text = fault(bent).diagnostic("lens").render(false);
    assert!(text.contains("longer radius"), "{text}");
    let tilted = Movements {
        tilt: 1.55,
        ..Movements::default()
    };
    let text = fault(tilted).diagnostic("lens").render(false);
    assert!(text.contains("tilt less"), "{text}");
}
