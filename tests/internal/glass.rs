//! Glass and fluids in rendered pictures: dispersion compared with rays of the same lens, media
//! with Snell's law.

use glam::DVec3;
use ivcam_base::math::Meters;
use ivcam_optics::film::{FilmFormat, Resolution};
use ivcam_optics::lens::{Lens, LensRay};
use ivcam_optics::sampling::DiscMap;
use ivcam_optics::spectrum::Spectrum;
use ivcam_render::camera::Aim;
use ivcam_render::render::{Exposure, Stop};
use ivcam_render::shade::Shading;

use crate::photo::{Era, LensChoice, Optics, Plan, Session};

/// The camera's distance from the scene, in meters.
const DISTANCE: f64 = 10.0;
/// Returns a single lens of crown glass behind its stop, 100 mm, with strong color of both kinds.
fn singlet(stop: f64) -> String {
    format!(
        "# radius thickness n_d aperture V_d\n\
         0 12 0 {stop}\n 103.4 4 1.5168 30 64.2\n -103.4 95 1 30\n"
    )
}

/// Opens a session of a flat scene in front of a lens given as text.
fn session(name: &str, lens: &str, scene: &str) -> Session {
    let folder = std::env::temp_dir().join(format!("ivcam-color-{}", std::process::id()));
    std::fs::create_dir_all(&folder).expect("a folder for the scene");
    let (scene_file, lens_file) = (
        folder.join(format!("{name}.iv")),
        folder.join(format!(
            "{name}.{}",
            if lens.starts_with('{') { "json" } else { "dat" }
        )),
    );
    let text =
        format!("#Inventor V2.1 ascii\nPerspectiveCamera {{ position 0 0 {DISTANCE} }}\n{scene}");
    std::fs::write(&scene_file, text).expect("the scene can be written");
    std::fs::write(&lens_file, lens).expect("the lens can be written");
    let mut plan = Plan::of_era(Era::Modern, scene_file);
    plan.optics = Optics::Lens(LensChoice::named(lens_file.to_string_lossy()));
    plan.shading = Shading::Flat;
    plan.focus = Some(Meters(DISTANCE));
    Session::open(plan).expect("the scene is whole")
}

/// Exposes a strip of film with one column of pixels.
fn strip(session: &mut Session, height: f64, rows: u32, samples: u32, seed: u64) -> Exposure {
    let mut plan = session.plan.clone();
    plan.film = FilmFormat {
        width: 0.01,
        height,
    };
    plan.resolution = Resolution::of(1, rows);
    plan.seed = seed;
    plan.stop = Stop::after(samples);
    let pose = session.pose.clone();
    session.change(plan, pose).expect("the strip is film");
    session.expose(&|_| ())
}

/// The number of exposures of a strip, each with a seed of its own.
const TIMES: u64 = 6;
/// The limit of Student's t with `TIMES` - 1 degrees of freedom, exceeded by chance once in 190
/// tests.
const T: f64 = 4.6;

/// Returns the mean and standard error of a measurement on a strip that is exposed repeatedly.
fn repeated(measure: impl FnMut(u64) -> DVec3) -> (DVec3, DVec3) {
    let values: Vec<DVec3> = (0..TIMES).map(measure).collect();
    let n = TIMES as f64;
    let mean = values.iter().sum::<DVec3>() / n;
    let squares: DVec3 = values.iter().map(|v| (*v - mean) * (*v - mean)).sum();
    let variance = squares / (n - 1.0) / n;
    let error = DVec3::new(variance.x.sqrt(), variance.y.sqrt(), variance.z.sqrt());
    (mean, error)
}

/// Returns the mean and variance of the position of light on a strip for each channel, in
/// millimeters from the middle of the upright picture; up is positive.
fn moments(made: &Exposure, height: f64) -> (DVec3, DVec3) {
    let pixels = &made.film.pixels;
    let pixel = height / pixels.len() as f64;
    let at = |i: usize| 0.5 * height - (i as f64 + 0.5) * pixel;
    let sum = |f: &dyn Fn(f64) -> f64| -> DVec3 {
        let each = pixels.iter().enumerate();
        each.map(|(i, p)| p.mean * f(at(i))).sum()
    };
    let total = sum(&|_| 1.0);
    let mean = sum(&|y| y) / total;
    let variance = sum(&|y| y * y) / total - mean * mean;
    // The light of a point is spread evenly over its pixel.
    (mean, variance - DVec3::splat(pixel * pixel / 12.0))
}

/// Computes the same from rays of a scene point at every fifth nanometer: the mean over the stop,
/// weighted by each channel's response to the wavelength.
fn expected(lens: &Lens, film_z: f64, y: f64) -> (DVec3, DVec3) {
    let spectrum = Spectrum::default();
    let origin = DVec3::new(0.0, y, -1000.0 * DISTANCE);
    let radius = lens.prescription().surfaces[0].semi_diameter;
    let (mut weight, mut first, mut second) = (DVec3::ZERO, DVec3::ZERO, DVec3::ZERO);
    for nm in (390..=750).step_by(5).map(f64::from) {
        let lens = lens.at_wavelength(nm);
        let (mut sum, mut squares, mut count) = (0.0, 0.0, 0.0);
        for i in 0..40 * 40 {
            let place = |k: i32| radius * ((f64::from(k) + 0.5) / 20.0 - 1.0);
            let aim = DVec3::new(place(i % 40), place(i / 40), 0.0);
            let ray = LensRay::new(origin, (aim - origin).normalize());
            let Ok(out) = lens.trace_from_scene(&ray) else {
                continue;
            };
            let t = (film_z - out.origin.z) / out.direction.z;
            let hit = -(out.origin.y + t * out.direction.y);
            (sum, squares, count) = (sum + hit, squares + hit * hit, count + 1.0);
        }
        let answer = spectrum.response(nm);
        weight += answer;
        first += answer * (sum / count);
        second += answer * (squares / count);
    }
    let mean = first / weight;
    (mean, second / weight - mean * mean)
}

/// Returns a white slit across the view at a height, with a width in meters.
fn slit(y: f64, width: f64) -> String {
    format!(
        "BaseColor {{ rgb 1 1 1 }} Translation {{ translation 0 {y} 0 }}\n\
         Cube {{ width 4 height {width} depth .00001 }}\n"
    )
}

/// Returns the variance on the film of the slit's own width, given in meters.
fn slit_variance(lens: &Lens, film_z: f64, width: f64) -> f64 {
    let focal = lens.first_order().focal.unwrap();
    let scale =
        (film_z - focal.rear_principal_plane) / (1000.0 * DISTANCE + focal.front_principal_plane);
    let width = 1000.0 * width * scale;
    width * width / 12.0
}

fn film_z(session: &Session) -> f64 {
    match &session.camera {
        ivcam_render::camera::Camera::Lens(camera) => camera.focus.film_z,
        _ => f64::NAN,
    }
}

#[test]
#[ignore = "a measurement of minutes, listed in docs/performance.md"]
fn red_and_blue_images_of_a_point_off_the_axis_lie_where_the_rays_say() {
    let up = 2.0;
    let mut session = session("lateral", &singlet(5.0), &slit(up, 0.004));
    let height = 44.0;
    let (mean, error) =
        repeated(|seed| moments(&strip(&mut session, height, 1760, 2048, seed), height).0);
    let lens = Lens::open(lens_file(&session)).unwrap();
    let (rays, _) = expected(&lens, film_z(&session), 1000.0 * up);
    let (shift, known) = (mean.x - mean.z, rays.x - rays.z);
    println!("lateral: {shift} mm, by rays {known} mm; {mean} ± {error}, by rays {rays}");
    assert!(
        known > 0.05 && error.max_element() < 0.02 * known,
        "{error}"
    );
    // Thirty-two wavelengths represent the spectrum, to 1% of the shift.
    let allowed = T * error + DVec3::splat(0.01 * known);
    assert!(
        (mean - rays).abs().cmple(allowed).all(),
        "{mean} ± {error}, by rays {rays}"
    );
}

#[test]
#[ignore = "a measurement of minutes, listed in docs/performance.md"]
fn red_and_blue_images_of_a_point_on_the_axis_are_as_wide_as_the_rays_say() {
    let width = 0.001;
    let mut session = session("axial", &singlet(8.0), &slit(0.0, width));
    let height = 0.4;
    let (variance, error) =
        repeated(|seed| moments(&strip(&mut session, height, 200, 4096, seed), height).1);
    let lens = Lens::open(lens_file(&session)).unwrap();
    let film_z = film_z(&session);
    let (_, rays) = expected(&lens, film_z, 0.0);
    let own = slit_variance(&lens, film_z, width);
    let measured = variance - DVec3::splat(own);
    println!("axial: {measured} ± {error} mm², by rays {rays} mm²");
    assert!(rays.z > 4.0 * rays.y, "blue is not out of focus: {rays}");
    assert!(error.max_element() < 0.01 * rays.z, "{error}");
    // The tolerance is 1% of the widest image, because thirty-two wavelengths represent the
    // spectrum. Red's variance is small, and a negative response contributes to it.
    let allowed = T * error + DVec3::splat(0.01 * rays.z);
    assert!(
        (measured - rays).abs().cmple(allowed).all(),
        "{measured} ± {error} mm², by rays {rays} mm²"
    );
}

fn lens_file(session: &Session) -> String {
    match &session.plan.optics {
        Optics::Lens(choice) => choice.name.clone(),
        Optics::Pinhole | Optics::Ideal(_) => String::new(),
    }
}

/// With Abbe numbers of 10^9, the paths of all wavelengths agree to 1e-10, and the picture must be
/// that of one wavelength. Aimed at the rear element it agrees sample by sample. At the exit pupil,
/// where lost rays of one wavelength are resampled, it agrees on average: in three comparisons, a
/// correct program exceeds 4.5 in one of 50,000 runs.
#[test]
fn wavelengths_with_the_same_path_give_the_colors_of_one() {
    let scene = "BaseColor { rgb 1 0 0 } Translation { translation -2 0 0 }\n\
        Cube { width 1 height 6 depth .1 }\n\
        BaseColor { rgb 0 1 0 } Translation { translation 1 0 0 } Cube { width 1 height 6 depth .1 }\n\
        BaseColor { rgb 0 0 1 } Translation { translation 1 0 0 } Cube { width 1 height 6 depth .1 }\n\
        BaseColor { rgb .9 .6 .1 } Translation { translation 1 0 0 } Cube { width 1 height 6 depth .1 }\n\
        BaseColor { rgb 1 1 1 } Translation { translation 1 0 0 } Cube { width .7 height 1 depth .1 }\n";
    let many = "# radius thickness n_d aperture V_d\n\
        0 12 0 20\n 103.4 4 1.5168 40 1e9\n -103.4 95 1 40\n";
    let single = "# radius thickness n_d aperture\n0 12 0 20\n103.4 4 1.5168 40\n-103.4 95 1 40\n";
    let expose = |name: &str, lens: &str, aim: Aim| {
        let mut session = session(name, lens, scene);
        let mut plan = session.plan.clone();
        plan.aim = aim;
        plan.resolution = Resolution::of(60, 40);
        plan.film = FilmFormat {
            width: 48.0,
            height: 32.0,
        };
        let pose = session.pose.clone();
        session.change(plan, pose).unwrap();
        session.expose(&|_| ())
    };
    let both = |aim: Aim| (expose("same", many, aim), expose("single", single, aim));
    let (many, single) = both(Aim::ExitPupil);
    let (mut apart, mut variance) = (DVec3::ZERO, DVec3::ZERO);
    for (a, b) in many.film.pixels.iter().zip(&single.film.pixels) {
        apart += a.mean - b.mean;
        variance += a.variance_of_mean() + b.variance_of_mean();
    }
    assert!(
        apart.abs().cmple(4.5 * variance.map(f64::sqrt)).all(),
        "{apart} {variance}"
    );
    assert!(apart != DVec3::ZERO, "one wavelength in both pictures");
    let (many, single) = both(Aim::RearElement(DiscMap::Concentric));
    assert_eq!(many.counts.film_rays, single.counts.film_rays);
    let brightest = single.film.pixels.iter().map(|p| p.mean.max_element());
    assert!(brightest.fold(0.0, f64::max) > 0.8);
    // One ray in a million may be on the other side of an edge.
    let off = many.film.pixels.iter().zip(&single.film.pixels);
    let far = off.filter(|(a, b)| (a.mean - b.mean).abs().max_element() > 1e-6);
    assert!(far.count() <= 2);
}

/// A white wall behind glass of one index with a magnesium fluoride coating, which is best for
/// green, has the color of the transmitted light at every fifth nanometer.
#[test]
fn a_coating_tints_what_glass_of_one_index_leaves_white() {
    let lens = r#"{"schema": "ivlens-1", "name": "tinted", "units": "mm", "coating": "mgf2", "surfaces": [
        {"kind": "stop", "t": 12, "n_d": 1.0, "semi_diameter": 4},
        {"kind": "sphere", "R": 200, "t": 4, "n_d": 1.9, "semi_diameter": 20},
        {"kind": "sphere", "R": -300, "t": 2, "n_d": 1.0, "semi_diameter": 20},
        {"kind": "sphere", "R": 300, "t": 4, "n_d": 1.9, "semi_diameter": 20},
        {"kind": "sphere", "R": -200, "t": 60, "n_d": 1.0, "semi_diameter": 20}]}"#;
    let wall = "BaseColor { rgb 1 1 1 } Cube { width 9 height 9 depth .1 }";
    let mut session = session("tinted", lens, wall);
    assert!(
        !Lens::open(lens_file(&session))
            .unwrap()
            .prescription()
            .is_dispersive()
    );
    let (mean, error) =
        repeated(|seed| strip(&mut session, 0.01, 1, 256, seed).film.pixels[0].mean);
    let lens = Lens::open(lens_file(&session)).unwrap();
    let spectrum = Spectrum::default();
    let (mut seen, mut white) = (DVec3::ZERO, DVec3::ZERO);
    for nm in (390..=750).step_by(5).map(f64::from) {
        let color = spectrum.color(nm) * DVec3::ONE;
        seen += color * lens.at_wavelength(nm).axial_transmittance().unwrap();
        white += color;
    }
    let tint = seen / white;
    assert!(tint.y - tint.z.max(tint.x) > 0.01, "{tint}");
    // Thirty-two wavelengths represent the spectrum to some thousandths. The film is slightly
    // farther away than for infinity, where white is 1.
    let off = (mean / mean.y - tint / tint.y).abs();
    assert!(
        off.cmplt(T * error + 0.002).all(),
        "{mean} \u{b1} {error}, by rays {tint}"
    );
}

#[test]
fn a_lens_of_one_index_or_of_1999_traces_one_wavelength() {
    let plain = "# radius thickness n_d aperture\n0 12 0 5\n103.4 4 1.5168 30\n-103.4 95 1 30\n";
    for (name, lens, era, waves) in [
        ("plain", plain, Era::Modern, "off"),
        ("crown", &singlet(5.0), Era::Modern, "on"),
        ("old", &singlet(5.0), Era::Vintage, "off"),
    ] {
        let mut session = session(name, lens, &slit(0.0, 0.004));
        let mut plan = Plan::of_era(era, session.plan.scene.clone());
        plan.optics = session.plan.optics.clone();
        let pose = session.pose.clone();
        session.change(plan, pose).unwrap();
        assert_eq!(session.described["dispersion"], waves, "{name}");
    }
}

/// Returns the position of a slit at a height on the picture of a lens, in millimeters above its
/// middle.
fn slit_position(name: &str, lens: &str, up: f64, height: f64) -> (f64, f64) {
    let mut session = session(name, lens, &slit(up, 0.004));
    let made = strip(&mut session, height, 800, 256, 0);
    (moments(&made, height).0.y, film_z(&session))
}

/// Behind a flat window under water, n sin θ in the water is sin θ' in the air. The lens behind its
/// stop is so thin that its image height is z tan θ'.
#[test]
fn a_picture_taken_under_water_is_magnified_by_the_window() {
    let lens = r#"{"schema": "ivlens-1", "name": "window", "n_object": 1.333, "surfaces": [
        {"kind": "sphere", "R": 0, "t": 5, "n_d": 1, "semi_diameter": 60},
        {"kind": "stop", "t": 0, "n_d": 1, "semi_diameter": 0.5},
        {"kind": "sphere", "R": 0, "t": 0.001, "n_d": 1.5, "semi_diameter": 5},
        {"kind": "sphere", "R": -50, "t": 100, "n_d": 1, "semi_diameter": 5}]}"#;
    let up = 1.5;
    let (y, z) = slit_position("water", lens, up, 44.0);
    // The angle in the water is found by bisection.
    let (mut low, mut high) = (0.0, 0.5f64);
    let outside = |angle: f64| libm::tan(libm::asin(1.333 * libm::sin(angle)));
    for _ in 0..60 {
        let middle = 0.5 * (low + high);
        let reached = 1000.0 * DISTANCE * libm::tan(middle) + 5.0 * outside(middle);
        if reached < 1000.0 * up {
            low = middle;
        } else {
            high = middle;
        }
    }
    let known = (z - 5.0) * outside(low);
    assert!(
        (y / known - 1.0).abs() < 1e-3,
        "{y} mm, by Snell {known} mm"
    );
}

/// A stop in water behind a thin lens, in front of a flat window: its image from the film has its
/// own size and is at d/n from the window, which determines the blur of a point out of focus. At
/// f/60 the lens's own aberration widens it by less than the test's 1%.
#[test]
fn a_stop_in_a_fluid_blurs_by_its_image() {
    let lens = r#"{"schema": "ivlens-1", "name": "chamber", "surfaces": [
        {"kind": "sphere", "R": 60, "t": 0.001, "n_d": 1.5, "semi_diameter": 8},
        {"kind": "sphere", "R": 0, "t": 10, "n_d": 1.333, "semi_diameter": 8},
        {"kind": "stop", "t": 20, "n_d": 1.333, "semi_diameter": 1},
        {"kind": "sphere", "R": 0, "t": 90, "n_d": 1, "semi_diameter": 8}]}"#;
    let mut session = session("chamber", lens, &slit(0.0, 0.004));
    let mut plan = session.plan.clone();
    plan.focus = Some(Meters(2.0));
    session.plan = plan;
    let height = 0.5;
    let made = strip(&mut session, height, 100, 16_384, 0);
    let opened = Lens::open(lens_file(&session)).unwrap();
    let z = film_z(&session);
    let image = opened
        .focus(ivcam_optics::lens::FocusMethod::Film, Meters(DISTANCE))
        .unwrap()
        .film_z;
    // The exit pupil is at the apparent depth of 20 mm of water, 20/n.
    let pupil = 30.001 - 20.0 / 1.333;
    let radius = (z - image).abs() / (image - pupil);
    let variance = moments(&made, height).1.y - slit_variance(&opened, z, 0.004);
    let known = 0.25 * radius * radius;
    assert!(
        (variance / known - 1.0).abs() < 0.01,
        "{variance} mm², by hand {known} mm²"
    );
}

/// One surface has its stop in it and the film in the fluid behind: a ray through the vertex keeps
/// n sin θ.
#[test]
fn an_image_in_a_fluid_is_as_large_as_snell_says() {
    let lens = r#"{"schema": "ivlens-1", "name": "reduced-eye", "surfaces": [
        {"kind": "stop", "t": 0, "n_d": 1, "semi_diameter": 0.2},
        {"kind": "sphere", "R": 5.55, "t": 22, "n_d": 1.336, "semi_diameter": 4}]}"#;
    let up = 2.0;
    let (y, z) = slit_position("eye", lens, up, 10.0);
    let sine = libm::sin(libm::atan(up / DISTANCE)) / 1.336;
    let known = z * libm::tan(libm::asin(sine));
    assert!(
        (y / known - 1.0).abs() < 1e-3,
        "{y} mm, by Snell {known} mm"
    );
}
