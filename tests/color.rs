//! Dispersion in rendered pictures, against the rays of the same lens.

use glam::DVec3;
use ivcam::film::{FilmFormat, Resolution};
use ivcam::lens::{Lens, LensRay};
use ivcam::math::Meters;
use ivcam::plan::{Era, LensChoice, Optics, Plan, Session};
use ivcam::render::{Exposure, Stop};
use ivcam::shade::Shading;
use ivcam::spectrum::Spectrum;

/// The camera's distance from what it looks at, in meters.
const DISTANCE: f64 = 10.0;
/// A single lens of crown behind its stop, 100 mm: strong color of either kind.
const SINGLET: &str = "# radius thickness n_d aperture V_d\n\
    0 12 0 5\n 103.4 4 1.5168 30 64.2\n -103.4 95 1 30\n";

/// A session of a flat scene in front of a lens given as text.
fn session(name: &str, lens: &str, scene: &str) -> Session {
    let folder = std::env::temp_dir().join(format!("ivcam-color-{}", std::process::id()));
    std::fs::create_dir_all(&folder).expect("a folder for the scene");
    let (scene_file, lens_file) = (
        folder.join(format!("{name}.iv")),
        folder.join(format!("{name}.dat")),
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

/// A strip of film with one column of pixels.
fn strip(session: &mut Session, height: f64, rows: u32, samples: u32) -> Exposure {
    let mut plan = session.plan.clone();
    plan.film = FilmFormat {
        width: 0.01,
        height,
    };
    plan.resolution = Resolution {
        width: 1,
        height: rows,
    };
    plan.sampler.samples = samples;
    plan.stop = Stop::after(samples);
    let pose = session.pose.clone();
    session.change(plan, pose).expect("the strip is film");
    session.expose(&|_| ())
}

/// Mean and variance of where a strip is exposed, for each channel; millimeters from the middle,
/// as on the picture: up is positive.
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
    // A point is spread evenly over its pixel.
    (mean, variance - DVec3::splat(pixel * pixel / 12.0))
}

/// The same by rays from a scene point, forward, at every fifth nanometer: the mean over the
/// stop, weighted by what each channel answers to the wavelength.
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
            let ray = LensRay {
                origin,
                direction: (aim - origin).normalize(),
            };
            let Ok(out) = lens.trace_from_scene(&ray) else {
                continue;
            };
            let t = (film_z - out.origin.z) / out.direction.z;
            let hit = -(out.origin.y + t * out.direction.y);
            (sum, squares, count) = (sum + hit, squares + hit * hit, count + 1.0);
        }
        let answer = spectrum.answer(nm);
        weight += answer;
        first += answer * (sum / count);
        second += answer * (squares / count);
    }
    let mean = first / weight;
    (mean, second / weight - mean * mean)
}

/// A white slit across the view at a height, 4 mm wide.
fn slit(y: f64) -> String {
    format!(
        "BaseColor {{ rgb 1 1 1 }} Translation {{ translation 0 {y} 0 }}\n\
         Cube {{ width 4 height .004 depth .00001 }}\n"
    )
}

/// The variance that the slit's own width has on the film.
fn slit_variance(lens: &Lens, film_z: f64) -> f64 {
    let scale = (film_z - lens.first_order().focal.unwrap().rear_principal_plane)
        / (1000.0 * DISTANCE + lens.first_order().focal.unwrap().front_principal_plane);
    let width = 4.0 * scale;
    width * width / 12.0
}

fn film_z(session: &Session) -> f64 {
    match &session.camera {
        ivcam::camera::Camera::Lens(camera) => camera.focus.film_z,
        ivcam::camera::Camera::Pinhole(_) => f64::NAN,
    }
}

#[test]
fn red_and_blue_images_of_a_point_off_the_axis_lie_where_the_rays_say() {
    let up = 2.0;
    let mut session = session("lateral", SINGLET, &slit(up));
    let height = 44.0;
    let made = strip(&mut session, height, 1760, 512);
    let lens = Lens::open(lens_file(&session)).unwrap();
    let (mean, _) = moments(&made, height);
    let (rays, _) = expected(&lens, film_z(&session), 1000.0 * up);
    let (shift, known) = (mean.x - mean.z, rays.x - rays.z);
    assert!(known.abs() > 0.02, "{known} mm tests nothing");
    assert!(
        (shift / known - 1.0).abs() < 0.03,
        "{shift} mm, by rays {known} mm"
    );
    assert!(
        (mean - rays).abs().max_element() < 2e-3,
        "{mean}, by rays {rays}"
    );
}

#[test]
fn red_and_blue_images_of_a_point_on_the_axis_are_as_wide_as_the_rays_say() {
    let mut session = session("axial", SINGLET, &slit(0.0));
    let height = 1.0;
    let made = strip(&mut session, height, 500, 1024);
    let lens = Lens::open(lens_file(&session)).unwrap();
    let film_z = film_z(&session);
    let (_, variance) = moments(&made, height);
    let (_, rays) = expected(&lens, film_z, 0.0);
    let own = slit_variance(&lens, film_z);
    let measured = variance - DVec3::splat(own);
    assert!(rays.z > 4.0 * rays.y, "blue is not out of focus: {rays}");
    for (channel, (m, r)) in measured.to_array().iter().zip(rays.to_array()).enumerate() {
        assert!(
            (m / r - 1.0).abs() < 0.03,
            "channel {channel}: {m} mm², by rays {r} mm²"
        );
    }
}

fn lens_file(session: &Session) -> String {
    match &session.plan.optics {
        Optics::Lens(choice) => choice.name.clone(),
        Optics::Pinhole => String::new(),
    }
}

/// A wall of colors and an edge of white; with Abbe numbers of 10^9 the wavelengths take the same
/// way to 1e-10, and the picture must be that of one wavelength.
#[test]
fn wavelengths_that_take_the_same_way_give_the_colors_of_one() {
    let scene = "BaseColor { rgb 1 0 0 } Translation { translation -2 0 0 }\n\
        Cube { width 1 height 6 depth .1 }\n\
        BaseColor { rgb 0 1 0 } Translation { translation 1 0 0 } Cube { width 1 height 6 depth .1 }\n\
        BaseColor { rgb 0 0 1 } Translation { translation 1 0 0 } Cube { width 1 height 6 depth .1 }\n\
        BaseColor { rgb .9 .6 .1 } Translation { translation 1 0 0 } Cube { width 1 height 6 depth .1 }\n\
        BaseColor { rgb 1 1 1 } Translation { translation 1 0 0 } Cube { width .7 height 1 depth .1 }\n";
    let one = "# radius thickness n_d aperture V_d\n\
        0 12 0 20\n 103.4 4 1.5168 40 VVV\n -103.4 95 1 40\n";
    let expose = |name: &str, abbe: &str| {
        let mut session = session(name, &one.replace("VVV", abbe), scene);
        let mut plan = session.plan.clone();
        plan.resolution = Resolution {
            width: 60,
            height: 40,
        };
        plan.film = FilmFormat {
            width: 48.0,
            height: 32.0,
        };
        let pose = session.pose.clone();
        session.change(plan, pose).unwrap();
        session.expose(&|_| ())
    };
    let (many, single) = (expose("same", "1e9"), expose("single", "0"));
    assert_eq!(many.counts.film_rays, 4 * single.counts.film_rays);
    let brightest = single.film.pixels.iter().map(|p| p.mean.max_element());
    assert!(brightest.fold(0.0, f64::max) > 0.8);
    // A ray in a million may fall on the other side of an edge.
    let off = many.film.pixels.iter().zip(&single.film.pixels);
    let far = off.filter(|(a, b)| (a.mean - b.mean).abs().max_element() > 1e-6);
    assert!(far.count() <= 2);
}

#[test]
fn a_lens_of_one_index_or_of_1999_traces_one_wavelength() {
    let plain = "# radius thickness n_d aperture\n0 12 0 5\n103.4 4 1.5168 30\n-103.4 95 1 30\n";
    for (name, lens, era, waves) in [
        ("plain", plain, Era::Modern, "off"),
        ("crown", SINGLET, Era::Modern, "on"),
        ("old", SINGLET, Era::Vintage, "off"),
    ] {
        let mut session = session(name, lens, &slit(0.0));
        let mut plan = Plan::of_era(era, session.plan.scene.clone());
        plan.optics = session.plan.optics.clone();
        let pose = session.pose.clone();
        session.change(plan, pose).unwrap();
        assert_eq!(session.described["dispersion"], waves, "{name}");
    }
}
