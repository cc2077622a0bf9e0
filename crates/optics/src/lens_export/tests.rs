//! The exports against exact chief rays, with each model's formula written again.

use glam::{DVec2, DVec3};

use crate::lens::{Conjugate, Lens};
use crate::lens_export::fit::{CameraModel, Chosen, ModelFit};
use crate::lens_export::{Frame, StMaps, View, lensfun, opencv, opentrackio, osl, ros};
use crate::picture::Picture;

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
fn opencv_project(fit: &ModelFit, middle: DVec2, d: DVec3) -> DVec2 {
    let c = fit.coefficients();
    let (x, y) = (d.x / d.z, d.y / d.z);
    let r2 = x * x + y * y;
    if fit.model == CameraModel::Fisheye {
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
fn residual(view: &View<'_>, fit: &ModelFit) -> f64 {
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
        ("double-gauss", 40.0, CameraModel::Brown),
        ("telephoto", 5.0, CameraModel::Brown),
        ("biogon", 100.0, CameraModel::Rational),
        ("fisheye", 130.0, CameraModel::Fisheye),
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
    assert_eq!(fit.model, CameraModel::Brown);
    let max = residual(&view, &fit);
    assert!(max <= fit.max * 1.05 + 1e-6, "{max} against {}", fit.max);
}

#[test]
fn a_fish_eye_is_refused_by_models_of_the_tangent_with_the_reason() {
    let lens = Lens::named("nikkor-16").unwrap();
    let wide = view(&lens, 21.6);
    for model in [CameraModel::Brown, CameraModel::Rational] {
        let error = Chosen::of(&wide, Some(model), 0.25).unwrap_err();
        assert!(error.message.contains("degrees from the axis"), "{error}");
        assert!(error.message.contains(model.name()), "{error}");
    }
    let fit = Chosen::of(&wide, None, 0.25).unwrap().fit;
    assert_eq!(fit.model, CameraModel::Fisheye);
    // Half of its field is 76 degrees, so the tangent is finite, but not like the lens.
    let lens = Lens::named("fisheye").unwrap();
    let error = Chosen::of(&view(&lens, 130.0), Some(CameraModel::Brown), 0.25).unwrap_err();
    assert!(error.message.contains("pixels at most"), "{error}");
    assert!(error.help.unwrap().contains("rational fits"));
}

#[test]
fn a_residual_above_the_tolerance_is_refused_with_the_residual() {
    let lens = Lens::named("wide-angle").unwrap();
    let view = view(&lens, 70.0);
    let error = Chosen::of(&view, Some(CameraModel::Brown), 1e-6).unwrap_err();
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

/// The angle of the chief ray of a height on the film, in radians.
fn angle(view: &View<'_>, height: f64) -> f64 {
    let film = DVec2::new(0.0, height);
    let d = view
        .lens
        .chief_ray(film, view.conjugate.film_z)
        .unwrap()
        .direction;
    libm::atan2(d.truncate().length(), -d.z)
}

#[test]
fn opentrackio_takes_distorted_points_to_those_of_a_pinhole() {
    for (name, half) in [("double-gauss", 40.0), ("canon-14", 21.6)] {
        let lens = Lens::named(name).unwrap();
        let view = view(&lens, half);
        let sample: serde_json::Value =
            serde_json::from_str(&opentrackio(&view, 0.25).unwrap()).unwrap();
        let block = &sample["lens"];
        let k: Vec<f64> = serde_json::from_value(block["distortion"][0]["radial"].clone()).unwrap();
        let focal = block["pinholeFocalLength"].as_f64().unwrap();
        let max = sample["custom"]["ivcam"]["residualMaxPixels"]
            .as_f64()
            .unwrap();
        assert!(max < 0.25, "{name}: {max}");
        for i in 1..=8 {
            let r = half * f64::from(i) / 8.0;
            let s = r * r;
            // OpenLensIO, equation 17: odd coefficients above, even ones below.
            let above = 1.0 + k[0] * s + k[2] * s * s + k[4] * s * s * s;
            let below = 1.0 + k[1] * s + k[3] * s * s + k[5] * s * s * s;
            let off = r * above / below - focal * libm::tan(angle(&view, r));
            let off = off.abs() * view.frame.density();
            assert!(
                off <= 1.01 * max + 1e-9,
                "{name} at {r} mm: {off} pixels, {max} stated"
            );
        }
        let pupil = lens.first_order().entrance_pupil.unwrap().z;
        let offset = block["entrancePupilOffset"].as_f64().unwrap();
        assert!((1000.0 * offset - (view.conjugate.film_z - pupil)).abs() < 1e-9);
        assert_eq!(block["focusDistance"], serde_json::Value::Null);
    }
    let lens = Lens::named("nikkor-16").unwrap();
    assert!(opentrackio(&view(&lens, 21.6), 0.25).is_err());
}

/// The value of an attribute in the first element of a name.
fn attribute(xml: &str, element: &str, name: &str) -> f64 {
    let rest = &xml[xml.find(&format!("<{element} ")).unwrap()..];
    let rest = &rest[..rest.find("/>").unwrap()];
    let at = rest.find(&format!(" {name}=\"")).unwrap() + name.len() + 3;
    rest[at..].split('"').next().unwrap().parse().unwrap()
}

#[test]
fn lensfun_gets_the_distortion_the_color_and_the_light_of_the_lens() {
    for (name, half, projection) in [
        ("takumar-35", 21.6, "rectilinear"),
        ("angenieux-50", 21.6, "rectilinear"),
        ("nikkor-16", 21.6, "fisheye"),
    ] {
        let lens = Lens::named(name).unwrap();
        let view = view(&lens, half);
        let xml = lensfun(&view, 2.0).unwrap();
        assert!(xml.contains(&format!("<type>{projection}</type>")), "{xml}");
        let unit = 0.5 * view.frame.film.y;
        let of = |element: &str, k: &str| attribute(&xml, element, k);
        let distorted: Box<dyn Fn(f64) -> f64> = if xml.contains("ptlens") {
            let [a, b, c] = ["a", "b", "c"].map(|k| of("distortion", k));
            Box::new(move |u| u * (a * u * u * u + b * u * u + c * u + 1.0 - a - b - c))
        } else {
            let [k1, k2] = ["k1", "k2"].map(|k| of("distortion", k));
            Box::new(move |u| u * (1.0 + k1 * u * u + k2 * u * u * u * u))
        };
        let ideal = |r: f64| match projection {
            "fisheye" => angle(&view, r),
            _ => libm::tan(angle(&view, r)),
        };
        let inverse = |r: f64| {
            let mut u = r;
            for _ in 0..200 {
                u += r - distorted(u);
            }
            u
        };
        // The scale of the undistorted radius is free.
        let shares = [0.3, 0.5, 0.8, 0.95];
        let scales = shares.map(|share| inverse(share * half / unit) / ideal(share * half));
        let scale = scales.iter().sum::<f64>() / 4.0;
        let words: Vec<&str> = xml.split(" pixels rms, ").collect();
        let stated: f64 = words[1].split(' ').next().unwrap().parse().unwrap();
        for share in shares {
            let r = share * half;
            let off = distorted(scale * ideal(r)) * unit - r;
            let pixels = off.abs() * view.frame.density();
            assert!(
                pixels < 2.0 * stated + 1e-3,
                "{name} at {r} mm: {pixels}, {stated} stated"
            );
            let light = |r: f64| lens.irradiance(DVec2::new(0.0, r), view.conjugate.film_z);
            let s = share * share * (half / view.frame.corner()).powi(2);
            let [k1, k2, k3] = ["k1", "k2", "k3"].map(|k| of("vignetting", k));
            let fitted = 1.0 + s * (k1 + s * (k2 + s * k3));
            let off = fitted - light(r) / light(0.0);
            assert!(off.abs() < 0.03, "{name} at {r} mm: light off by {off}");
            if !lens.prescription().is_dispersive() {
                continue;
            }
            // Blue arrives where the chief ray of blue from the same direction does.
            let [green, blue] = [540.0, 465.0].map(|nm| lens.at_wavelength(nm));
            let film_z = view.conjugate.film_z;
            let d = green
                .chief_ray(DVec2::new(0.0, r), film_z)
                .unwrap()
                .direction;
            let angle = libm::atan2(d.truncate().length(), -d.z);
            let exact = blue.image_height(angle, r, film_z).unwrap() / unit;
            let [v, c, b] = ["vb", "cb", "bb"].map(|k| of("tca", k));
            let x = r / unit;
            let off = x * (v + x * (c + x * b)) - exact;
            assert!(
                off.abs() * unit * view.frame.density() < 0.1,
                "{name} at {r} mm: {off}"
            );
        }
    }
}

/// The place that a map has at a place of its own, between four pixels. Both run from 0 to 1, from
/// the left and from the bottom.
fn looked_up(map: &Picture, [s, t]: [f64; 2]) -> [f64; 2] {
    let (width, height) = (map.width as usize, map.height as usize);
    let at = DVec2::new(s * width as f64, (1.0 - t) * height as f64) - 0.5;
    let most = DVec2::new(width as f64 - 2.0, height as f64 - 2.0);
    let low = at.floor().clamp(DVec2::ZERO, most);
    let share = at - low;
    let value = |x: usize, y: usize| {
        let pixel = map.pixels[(low.y as usize + y) * width + low.x as usize + x];
        DVec2::new(f64::from(pixel[0]), f64::from(pixel[1]))
    };
    let row = |y: usize| value(0, y).lerp(value(1, y), share.x);
    row(0).lerp(row(1), share.y).to_array()
}

#[test]
fn st_maps_there_and_back_end_where_they_began() {
    for (name, half) in [
        ("angenieux-28", 21.6),
        ("canon-14", 20.0),
        ("canon-300", 21.6),
    ] {
        let lens = Lens::named(name).unwrap();
        let film_z = lens.first_order().focal.unwrap().rear_focal_point;
        let conjugate = Conjugate {
            distance: f64::INFINITY,
            film_z,
        };
        let frame = Frame::of(None, 2.0 * half, Some([480, 320])).unwrap();
        let view = View::of(&lens, conjugate, frame).unwrap();
        let maps = StMaps::of(&view).unwrap();
        assert_eq!((maps.distort.width, maps.distort.height), (480, 320));
        assert!(maps.undistort.width >= 480 && maps.undistort.width < 4 * 480);
        let focal = view.rays.radius(1e-3).unwrap() / libm::tan(1e-3) * frame.density();
        let canvas = [maps.undistort.width, maps.undistort.height].map(f64::from);
        for y in (0..320).step_by(17) {
            for x in (0..480).step_by(17) {
                let here = [(x as f64 + 0.5) / 480.0, 1.0 - (y as f64 + 0.5) / 320.0];
                let [s, t, _] = maps.distort.pixels[y * 480 + x].map(f64::from);
                let back = looked_up(&maps.undistort, [s, t]);
                let off = DVec2::new(480.0 * (back[0] - here[0]), 320.0 * (back[1] - here[1]));
                assert!(off.length() < 0.01, "{name} at {x}, {y}: {off} pixels");
                // The undistorted place is the tangent of the chief ray's angle.
                let film = DVec2::new(0.5 - here[0], 0.5 - here[1]) * frame.film;
                if x % 51 == 0 && y % 51 == 0 {
                    let d = lens.chief_ray(film, film_z).unwrap().direction;
                    let ideal = focal * DVec2::new(d.x, d.y) / -d.z;
                    let shown = DVec2::new((s - 0.5) * canvas[0], (t - 0.5) * canvas[1]);
                    let off = (shown - ideal).length();
                    assert!(
                        off < 0.01,
                        "{name} at {x}, {y}: {off} pixels from the chief ray"
                    );
                }
            }
        }
    }
    let lens = Lens::named("nikkor-16").unwrap();
    let error = StMaps::of(&view(&lens, 21.6)).err().unwrap();
    assert!(error.message.contains("degrees from the axis"), "{error}");
    // The lens's own picture is just below the limit, and the undistorted one is above.
    let lens = Lens::named("canon-14").unwrap();
    let conjugate = view(&lens, 20.0).conjugate;
    let frame = Frame::of(None, 40.0, Some([9792, 6528])).unwrap();
    let large = View::of(&lens, conjugate, frame).unwrap();
    let error = StMaps::of(&large).err().unwrap();
    assert!(error.message.contains("undistorted"), "{error}");
    assert!(error.help.unwrap().contains("64 million"));
}

/// The numbers of an array of the shader.
fn array(text: &str, name: &str) -> Vec<f64> {
    let at = text.find(&format!("float {name}[")).unwrap();
    let rest = &text[at..];
    let inside = &rest[rest.find('{').unwrap() + 1..rest.find('}').unwrap()];
    inside
        .split(',')
        .map(|w| w.trim().parse().unwrap())
        .collect()
}

/// The shader's tables follow the lens: rays traced with them in its way arrive as the lens's own
/// do, its boxes contain the pupil, and its weights add up to the relative illumination.
#[test]
fn the_camera_shader_traces_the_rays_of_the_lens_with_its_weights() {
    let lens = Lens::named("phone").unwrap();
    let view = view(&lens, 3.0);
    let text = osl(&view).unwrap();
    let [vertex, curvature, conic, term, index] =
        ["vertex", "curvature", "conic", "term", "index"].map(|name| array(&text, name));
    let boxes = ["pupil_low", "pupil_high", "pupil_half"].map(|name| array(&text, name));
    let film_z = view.conjugate.film_z;
    let center = lens.irradiance(DVec2::ZERO, film_z);
    let light = text.split("#define LIGHT ").nth(1).unwrap();
    let light: f64 = light.lines().next().unwrap().parse().unwrap();
    // The view is focused at infinity.
    assert!((light / center - 1.0).abs() < 1e-9, "{light} {center}");
    // Names that the language or its standard header has already.
    for taken in [" u ", " v ", " N ", " P ", " I ", " random ", " time "] {
        assert!(!text.contains(&format!("float{taken}=")), "{taken}");
        assert!(!text.contains(&format!("vector{taken}=")), "{taken}");
    }
    for k in [0, 33, 64] {
        let [low, high, half] = boxes.each_ref().map(|column| column[k]);
        let radius = view.rays.reach * k as f64 / 64.0;
        let (mut light, mut passed) = (0.0, 0);
        let side = 24;
        for j in 0..side * side {
            let share = DVec2::new((j % side) as f64 + 0.5, (j / side) as f64 + 0.5) / 24.0;
            let aim = DVec3::new(
                half * (2.0 * share.x - 1.0),
                low + share.y * (high - low),
                lens.length(),
            );
            let origin = DVec3::new(0.0, radius, film_z);
            let ray = crate::lens::LensRay::new(origin, (aim - origin).normalize());
            let Ok(out) = lens.trace_from_film(&ray) else {
                continue;
            };
            passed += 1;
            let z = film_z - lens.length();
            light += libm::pow(ray.direction.z, 4.0) / (z * z);
            let [p, d] = shader_trace(&ray, &vertex, &curvature, &conic, &term, &index);
            assert!((p - out.origin).length() < 1e-5, "{p} {}", out.origin);
            assert!(
                (d - out.direction.normalize()).length() < 1e-5,
                "{d} {}",
                out.direction
            );
        }
        let area = 2.0 * half * (high - low);
        let weighted = light / (side * side) as f64 * area / center;
        let exact = lens.irradiance(DVec2::new(0.0, radius), film_z) / center;
        assert!(
            (weighted - exact).abs() < 0.02,
            "{k}: {weighted} against {exact}"
        );
        assert!(passed > side * side / 2, "{k}: {passed}");
    }
}

/// The shader's loop over the surfaces with its tables, in double precision.
fn shader_trace(
    ray: &crate::lens::LensRay,
    vertex: &[f64],
    curvature: &[f64],
    conic: &[f64],
    term: &[f64],
    index: &[f64],
) -> [DVec3; 2] {
    let (mut p, mut d) = (ray.origin, ray.direction);
    for i in (0..vertex.len()).rev() {
        let c = curvature[i];
        let mut hit = p - vertex[i] * DVec3::Z;
        hit -= hit.z / d.z * d;
        let mut n = DVec3::Z;
        for _ in 0..30 {
            let r = hit.x.hypot(hit.y);
            let s = (1.0 - (1.0 + conic[i]) * c * c * r * r).max(1e-8).sqrt();
            let count = term.len() / vertex.len();
            let powers = (1..count).map(|j| (j as f64, term[i * count + j]));
            let sag = c * r * r / (1.0 + s);
            let sag: f64 = sag
                + powers
                    .clone()
                    .map(|(j, a)| a * libm::pow(r, j))
                    .sum::<f64>();
            let slope = powers
                .map(|(j, a)| j * a * libm::pow(r, j - 1.0))
                .sum::<f64>()
                + c * r / s;
            n = DVec3::new(
                -slope * hit.x / r.max(1e-300),
                -slope * hit.y / r.max(1e-300),
                1.0,
            );
            hit -= (hit.z - sag) / n.dot(d) * d;
        }
        n = n.normalize();
        let eta = index[i + 1] / index[i];
        let incident = -d.dot(n);
        let square = 1.0 - eta * eta * (1.0 - incident * incident);
        d = (eta * d + (eta * incident - square.sqrt()) * n).normalize();
        p = hit + vertex[i] * DVec3::Z;
    }
    [p, d]
}

#[test]
fn a_name_with_line_breaks_stays_in_the_comments() {
    let mut prescription = Lens::named("double-gauss").unwrap().prescription().clone();
    prescription.name = "a\nb\u{2028}c\u{85}d--->".to_owned();
    for surface in prescription.surfaces.iter_mut().filter(|s| s.is_stop) {
        surface.semi_diameter = f64::INFINITY;
    }
    let lens = Lens::new(prescription);
    let view = view(&lens, 21.6);
    assert!(view.conditions()[0].starts_with("lens a b c d--->, aperture"));
    let chosen = Chosen::of(&view, None, 0.25).unwrap();
    for text in [
        opencv(&view, &chosen),
        ros(&view, &chosen),
        osl(&view).unwrap(),
    ] {
        assert!(!text.lines().any(|line| line.starts_with('b')), "{text}");
    }
    let shader = osl(&view).unwrap();
    assert!(shader.contains("float stop = 1e30 "), "{shader}");
    let xml = lensfun(&view, 2.0).unwrap();
    assert!(!xml.contains("--->") && !xml.contains('\u{85}'), "{xml}");
}
