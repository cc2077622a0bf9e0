//! The exports against exact chief rays, with each model's formula written again.

use glam::{DVec2, DVec3};

use crate::lens::{Conjugate, Lens};
use crate::lens_export::fit::{Chosen, Fit, Model};
use crate::lens_export::{Frame, View, opencv, ros};

/// The view of a lens focused at infinity, with a film of 3 to 2 of half this diagonal, 1920 pixels
/// across.
fn view(lens: &Lens, half: f64) -> View<'_> {
    let film_z = lens.first_order().focal.unwrap().rear_focal_point;
    let conjugate = Conjugate {
        distance: f64::INFINITY,
        film_z,
    };
    View::of(lens, conjugate, Frame::of(None, 2.0 * half, None).unwrap()).unwrap()
}

/// The scene's direction, x right, y down and z forward, of the light of a pixel, by a chief ray of
/// its own.
fn direction(view: &View<'_>, pixel: DVec2) -> DVec3 {
    let at = (pixel - view.frame.middle()) / view.frame.density();
    // The film is upside down: its right side shows the left of the scene, and its lower side, at
    // negative y, what is above.
    let film = DVec2::new(-at.x, at.y);
    let chief = view.lens.chief_ray(film, view.conjugate.film_z).unwrap();
    let mut d = chief.direction;
    if view.conjugate.distance.is_finite() {
        let far = (-view.conjugate.distance - chief.origin.z) / d.z;
        d = chief.origin + far * d - view.rays.origin_z * DVec3::Z;
    }
    DVec3::new(d.x, -d.y, -d.z).normalize()
}

/// `cv::projectPoints` without rotation and translation, as OpenCV's documentation states it.
fn opencv_project(fit: &Fit, middle: DVec2, d: DVec3) -> DVec2 {
    let c = fit.coefficients();
    let (x, y) = (d.x / d.z, d.y / d.z);
    let r2 = x * x + y * y;
    if fit.model == Model::Fisheye {
        let r = d.x.hypot(d.y);
        let t = libm::atan2(r, d.z);
        let t2 = t * t;
        let td = t * (1.0 + c[0] * t2 + c[1] * t2 * t2 + c[2] * t2.powi(3) + c[3] * t2.powi(4));
        return middle + fit.focal * td / r * DVec2::new(d.x, d.y);
    }
    let below = match c[..] {
        [_, _, _, _, _, k4, k5, k6] => 1.0 + k4 * r2 + k5 * r2 * r2 + k6 * r2.powi(3),
        _ => 1.0,
    };
    let (k1, k2, p1, p2, k3) = (c[0], c[1], c[2], c[3], c[4]);
    let radial = (1.0 + k1 * r2 + k2 * r2 * r2 + k3 * r2.powi(3)) / below;
    let u = x * radial + 2.0 * p1 * x * y + p2 * (r2 + 2.0 * x * x);
    let v = y * radial + p1 * (r2 + 2.0 * y * y) + 2.0 * p2 * x * y;
    middle + fit.focal * DVec2::new(u, v)
}

/// The greatest distance in pixels from a grid of pixels to where the model shows the scene points
/// whose chief rays arrive there.
fn residual(view: &View<'_>, fit: &Fit) -> f64 {
    let mut max = 0.0f64;
    for j in 0..7 {
        for i in 0..7 {
            let share = DVec2::new(f64::from(i), f64::from(j)) / 6.0;
            let pixel = share * (view.frame.size() - 1.0) + 1e-3;
            if (pixel - view.frame.middle()).length() > view.rays.reach * view.frame.density() {
                continue;
            }
            let shown = opencv_project(fit, view.frame.middle(), direction(view, pixel));
            let off = (shown - pixel).length();
            max = max.max(off);
        }
    }
    max
}

#[test]
fn exported_coefficients_show_scene_points_where_their_chief_rays_arrive() {
    for (name, half, model) in [
        ("double-gauss", 40.0, Model::Brown),
        ("telephoto", 5.0, Model::Brown),
        ("biogon", 100.0, Model::Rational),
        ("fisheye", 130.0, Model::Fisheye),
    ] {
        let lens = Lens::named(name).unwrap();
        let view = view(&lens, half);
        let fit = Chosen::of(&view, Some(model), 0.25).unwrap().fit;
        let max = residual(&view, &fit);
        assert!(
            max <= fit.max * 1.05 + 1e-6,
            "{name}: {max} against {}",
            fit.max
        );
        assert!(max > 0.5 * fit.max, "{name}: {max} against {}", fit.max);
        // The focal length in pixels is that of the lens.
        let efl = lens.first_order().efl() * view.frame.density();
        assert!(
            (fit.focal / efl - 1.0).abs() < 0.01,
            "{name}: {} {efl}",
            fit.focal
        );
    }
}

#[test]
fn a_near_object_is_shown_where_its_chief_rays_arrive() {
    let lens = Lens::named("double-gauss").unwrap();
    let conjugate = Conjugate {
        distance: 800.0,
        film_z: lens.first_order().focal.unwrap().rear_focal_point + 14.0,
    };
    let frame = Frame::of(Some([36.0, 24.0]), 0.0, None).unwrap();
    let view = View::of(&lens, conjugate, frame).unwrap();
    let fit = Chosen::of(&view, None, 0.25).unwrap().fit;
    assert_eq!(fit.model, Model::Brown);
    let max = residual(&view, &fit);
    assert!(max <= fit.max * 1.05 + 1e-6, "{max} against {}", fit.max);
}

#[test]
fn a_fish_eye_is_refused_by_models_of_the_tangent_with_the_reason() {
    let lens = Lens::named("nikkor-16").unwrap();
    let wide = view(&lens, 21.6);
    for model in [Model::Brown, Model::Rational] {
        let error = Chosen::of(&wide, Some(model), 0.25).unwrap_err();
        assert!(error.message.contains("degrees from the axis"), "{error}");
        assert!(error.message.contains(model.name()), "{error}");
    }
    let fit = Chosen::of(&wide, None, 0.25).unwrap().fit;
    assert_eq!(fit.model, Model::Fisheye);
    // Half of its field is 76 degrees, so the tangent is finite, but not like the lens.
    let lens = Lens::named("fisheye").unwrap();
    let error = Chosen::of(&view(&lens, 130.0), Some(Model::Brown), 0.25).unwrap_err();
    assert!(error.message.contains("pixels at most"), "{error}");
    assert!(error.help.unwrap().contains("rational fits"));
}

#[test]
fn a_residual_above_the_tolerance_is_refused_with_the_residual() {
    let lens = Lens::named("wide-angle").unwrap();
    let view = view(&lens, 70.0);
    let error = Chosen::of(&view, Some(Model::Brown), 1e-6).unwrap_err();
    assert!(error.message.contains("pixels at most"), "{error}");
}

#[test]
fn angles_between_the_nodes_are_those_of_chief_rays() {
    for (name, half) in [("double-gauss", 40.0), ("fisheye", 130.0), ("phone", 3.5)] {
        let lens = Lens::named(name).unwrap();
        let view = view(&lens, half);
        for i in 1..=13 {
            let radius = view.rays.reach * f64::from(i) / 13.0;
            let film = DVec2::new(0.6 * radius, 0.8 * radius);
            let d = lens
                .chief_ray(film, view.conjugate.film_z)
                .unwrap()
                .direction;
            let angle = libm::atan2(d.truncate().length(), -d.z);
            let off = view.rays.angle(radius) / angle - 1.0;
            assert!(off.abs() < 1e-8, "{name} at {radius} mm: {off:e}");
        }
    }
}

#[test]
fn cylinders_and_film_of_another_shape_than_the_pixels_are_refused() {
    let lens = Lens::named("anamorphic").unwrap();
    let conjugate = Conjugate {
        distance: f64::INFINITY,
        film_z: lens.first_order().focal.unwrap().rear_focal_point,
    };
    let frame = Frame::of(Some([36.0, 24.0]), 0.0, None).unwrap();
    let error = View::of(&lens, conjugate, frame).unwrap_err();
    assert!(error.message.contains("cylinders"), "{error}");
    let error = Frame::of(Some([36.0, 24.0]), 0.0, Some([1920, 1080])).unwrap_err();
    assert!(
        error.help.iter().any(|h| h.contains("1920x1280")),
        "{error:?}"
    );
    assert!(Frame::of(None, 43.0, Some([100_000, 100_000])).is_err());
}

#[test]
fn files_for_opencv_and_ros_state_matrix_size_and_residual() {
    let lens = Lens::named("double-gauss").unwrap();
    let view = view(&lens, 21.6);
    let chosen = Chosen::of(&view, None, 0.25).unwrap();
    let f = format!("[ {:?}, 0.0, 959.5, 0.0, ", chosen.fit.focal);
    let text = opencv(&view, &chosen);
    assert!(text.starts_with("%YAML:1.0\n---\n"), "{text}");
    for part in [
        "image_width: 1920\n",
        "distortion_model: brown\n",
        &f,
        "residual_max_pixels: ",
    ] {
        assert!(text.contains(part), "{part} in {text}");
    }
    let text = ros(&view, &chosen);
    for part in [
        "camera_name: double_gauss\n",
        "distortion_model: plumb_bob\n",
        "pixels rms",
    ] {
        assert!(text.contains(part), "{part} in {text}");
    }
}
