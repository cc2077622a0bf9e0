//! The numbers of docs/guide/paper.md that rays through the lenses and the scenes give in a second:
//! its tables and those in its sentences.
//!
//! `cargo test paper` compares the page with them.

use std::fmt::Write as _;

use glam::{DVec2, DVec3, Vec3};
use ivcam::photo::{CameraChoice, Era, Plan, Session};
use ivcam_base::math::{Meters, Mm};
use ivcam_optics::lens::{Focus, FocusMethod, Lens, LensRay, Meridian};
use ivcam_render::bvh::Ray;

use super::paper_page::PageNumbers;

/// The page of these numbers.
pub(super) const PAGE: &str = "docs/guide/paper.md";

/// Words of the page with numbers that are names or choices, and not measured.
pub(super) const GIVEN: [&str; 16] = [
    "The 1999 paper",
    "differs from 1999",
    "numbers: figures 1 and 2",
    "Figures 1 and 2,",
    "Figures 10, 11 and 12",
    "pictures of Figure 10.",
    "ratio would be 1.",
    "A rod of 10 cm",
    "rows of f/5.6)",
    "(Figures 3 and 13 to 16)",
    "(Figures 4 and 5).",
    "Figure 6, the height angle:",
    "`--max-depth` is 64 for solids and 5 without,",
    "| 180×120 pixels, 32 samples |",
    "there are 64 samples per pixel instead of 16,",
    "seconds of one processor | estimated relative error, 95% interval |",
];

/// The words with the numbers that renders give, which [`quick`] lacks.
pub(super) const RENDERED: [&str; 4] = [
    "The solids take {} times as long,",
    "the exit pupil has {} of the squared error.",
    "the two pictures differ by {} dB,",
    "aiming at the rear element loses {} of the rays of the telephoto;",
];

/// A pixel of the paper's 360×240 picture, in millimeters of film.
const PIXEL: f64 = 0.1;
const CORNER: DVec2 = DVec2::new(18.0, 12.0);

/// The place of the bulb of the desk lamp: z in meters.
const BULB: f64 = 0.0;

/// The lens and the position of a figure; distances are in meters from the front vertex, as in
/// `camera/cam-4.dat` to `cam-6.dat`.
struct Shot {
    figure: &'static str,
    camera: &'static str,
    lens: Lens,
    telephone: f64,
    book: f64,
}

fn shots() -> Vec<Shot> {
    let shot = |figure, camera, name, efl, telephone, book| Shot {
        figure,
        camera,
        lens: scaled(name, efl),
        telephone,
        book,
    };
    vec![
        shot(
            "10: wide-angle, 20 mm",
            "camera/cam-4.dat",
            "wide-angle",
            20.0,
            0.50,
            1.29,
        ),
        shot(
            "11: double Gauss, 60 mm",
            "camera/cam-5.dat",
            "double-gauss",
            60.0,
            1.50,
            2.25,
        ),
        shot(
            "12: telephoto, 180 mm",
            "camera/cam-6.dat",
            "telephoto",
            180.0,
            4.50,
            5.23,
        ),
    ]
}

fn scaled(name: &str, efl: f64) -> Lens {
    let lens = Lens::named(name).and_then(|l| l.scaled_to(Mm(efl)));
    lens.expect("the four lenses of the paper are shipped and have a focal length")
}

/// Focuses a lens at a distance in meters, with the film where the real rays are closest together.
/// The lens equation's film would show spherical aberration as a focus error.
fn focused(lens: &Lens, meters: f64) -> Focus {
    let focus = lens.focus(FocusMethod::Best, Meters(meters));
    focus.expect("the distances of the figures can be in focus")
}

fn film_at(lens: &Lens, meters: f64) -> f64 {
    focused(lens, meters).film_z
}

/// Returns the height at which the chief ray of a film height crosses the plane at a distance in
/// front.
fn height_in_scene(lens: &Lens, film_z: f64, film_y: f64, meters: f64) -> f64 {
    let ray = lens.chief_ray(DVec2::new(0.0, film_y), film_z);
    let ray = ray.expect("every film height has a chief ray here");
    let t = (-1000.0 * meters - ray.origin.z) / ray.direction.z;
    (ray.origin + t * ray.direction).y
}

/// Returns the height on the film of the image of a rod that begins on the axis.
fn image_of(lens: &Lens, film_z: f64, rod_mm: f64, meters: f64) -> f64 {
    let (mut low, mut high) = (0.0, CORNER.y);
    for _ in 0..50 {
        let middle = 0.5 * (low + high);
        if height_in_scene(lens, film_z, middle, meters).abs() < rod_mm {
            low = middle;
        } else {
            high = middle;
        }
    }
    0.5 * (low + high)
}

/// Returns the diameter of the blur of a point on the axis: that of a uniform disc with the rays'
/// root mean square distance, 2 √2 rms.
fn blur(lens: &Lens, film_z: f64, meters: f64) -> f64 {
    const RINGS: u32 = 200;
    let pupil = lens.first_order().entrance_pupil;
    let pupil = pupil.expect("the lenses of the paper have a stop");
    let origin = DVec3::new(0.0, 0.0, -1000.0 * meters);
    let (mut squares, mut passed) = (0.0, 0);
    for ring in 0..RINGS {
        let y = pupil.semi_diameter * ((f64::from(ring) + 0.5) / f64::from(RINGS)).sqrt();
        let direction = DVec3::new(0.0, y, pupil.z) - origin;
        let Ok(out) = lens.trace_from_scene(&LensRay { origin, direction }) else {
            continue;
        };
        let hit = out.origin + (film_z - out.origin.z) / out.direction.z * out.direction;
        squares += hit.y * hit.y;
        passed += 1;
    }
    2.0 * (2.0 * squares / f64::from(passed.max(1))).sqrt()
}

/// Returns the distance, between a sharp one and another, at which the blur is as wide as a pixel.
fn limit(lens: &Lens, film_z: f64, sharp: f64, far: f64) -> f64 {
    let (mut inside, mut outside) = (sharp, far);
    for _ in 0..60 {
        // The bisection is in diopters, because the far end may be a kilometer away.
        let middle = 2.0 / (1.0 / inside + 1.0 / outside);
        if blur(lens, film_z, middle) <= PIXEL {
            inside = middle;
        } else {
            outside = middle;
        }
    }
    inside
}

const FAR: f64 = 1e4;

fn depth(lens: &Lens, meters: f64) -> (f64, f64) {
    let film_z = film_at(lens, meters);
    let near = limit(lens, film_z, meters, 0.05 * meters);
    (near, limit(lens, film_z, meters, FAR))
}

fn as_range((near, far): (f64, f64)) -> String {
    if far > 0.5 * FAR {
        format!("{near:.2} m to infinity")
    } else {
        format!("{near:.2} to {far:.2} m ({:.2} m)", far - near)
    }
}

/// Returns the heights in millimeters of the images of a rod of 10 cm at the telephone and at the
/// book.
fn rods(s: &Shot) -> (f64, f64) {
    let film_z = film_at(&s.lens, s.telephone);
    let at = |meters| image_of(&s.lens, film_z, 100.0, meters);
    (at(s.telephone), at(s.book))
}

fn perspective() -> String {
    let mut out = String::from(
        "| figure | a 10 cm rod at the telephone | the same at the book | book / telephone |\n|---|---|---|---|\n",
    );
    for s in shots() {
        let (near, far) = rods(&s);
        let _ = writeln!(
            out,
            "| {} | {near:.3} mm | {far:.3} mm | **{:.2}** |",
            s.figure,
            far / near
        );
    }
    out
}

/// Returns the f-number of a lens by real rays at full aperture.
fn full_aperture(lens: &Lens) -> f64 {
    let n = lens.real_f_number();
    n.expect("the lenses of the paper are not afocal")
}

fn depth_of_field() -> String {
    const PLACE: f64 = 3.6;
    let mut out = String::from(
        "| lens | sharp from one place, 3.6 m | sharp where the figure stands | blur of the book there | of infinity |\n|---|---|---|---|---|\n",
    );
    for s in shots() {
        for stop in [None, Some(5.6)] {
            let lens = match stop {
                Some(n) => s.lens.at_f_number(n).expect("all three open to f/5.6"),
                None => s.lens.clone(),
            };
            let film_z = film_at(&lens, s.telephone);
            let _ = writeln!(
                out,
                "| {}, f/{} | {} | {} | {:.2} mm | {:.2} mm |",
                s.figure,
                stop.map_or(format!("{:.2}", full_aperture(&lens)), |n| n.to_string()),
                as_range(depth(&lens, PLACE)),
                as_range(depth(&lens, s.telephone)),
                blur(&lens, film_z, s.book),
                blur(&lens, film_z, 1e6),
            );
        }
    }
    out
}

fn vignetting() -> String {
    let mut out = String::from(
        "| figure | middle of a side / middle | end of the long side / middle | corner / middle |\n|---|---|---|---|\n",
    );
    for s in shots() {
        let film_z = film_at(&s.lens, s.telephone);
        let middle = s.lens.irradiance(DVec2::ZERO, film_z);
        let at = |film: DVec2| 100.0 * s.lens.irradiance(film, film_z) / middle;
        let _ = writeln!(
            out,
            "| {} | {:.0}% | {:.0}% | **{:.0}%** |",
            s.figure,
            at(DVec2::new(0.0, 12.0)),
            at(DVec2::new(18.0, 0.0)),
            at(CORNER)
        );
    }
    out
}

fn pulling_focus() -> String {
    let mut out = String::from(
        "| figure | in focus | blur of the telephone | of the book | height of the view at the telephone | height angle by equation 7 |\n|---|---|---|---|---|---|\n",
    );
    for s in shots() {
        for (what, meters) in [("telephone", s.telephone), ("book", s.book)] {
            let focus = focused(&s.lens, meters);
            let view = 2.0 * height_in_scene(&s.lens, focus.film_z, CORNER.y, s.telephone).abs();
            let _ = writeln!(
                out,
                "| {} | {what} | {:.3} mm | {:.3} mm | {view:.1} mm | {:.3}° |",
                s.figure,
                blur(&s.lens, focus.film_z, s.telephone),
                blur(&s.lens, focus.film_z, s.book),
                focus.height_angle(CORNER.y).to_degrees(),
            );
        }
    }
    out
}

/// Returns for Figures 1 and 2 the lens, its f-number if it is stopped down, and the distance of
/// the bulb in meters, as in `camera/cam-9.dat` and `cam-10.dat`.
fn lamps() -> [(&'static str, Lens, Option<f64>, f64); 2] {
    let (wide, long) = (scaled("wide-angle", 20.0), scaled("telephoto", 180.0));
    [
        ("1: wide-angle, 20 mm", wide, Some(11.0), 0.62),
        ("2: telephoto, 180 mm", long, None, 6.38),
    ]
}

fn figures_1_and_2() -> String {
    let mut out = String::from(
        "| figure | sharp | the same at f/5.6 | distortion at 12 mm | at 18 mm |\n|---|---|---|---|---|\n",
    );
    for (figure, full, stop, meters) in lamps() {
        let at = |n: f64| full.at_f_number(n).expect("both lenses open to f/5.6");
        let (n, lens) = match stop {
            Some(n) => (n.to_string(), at(n)),
            None => (format!("{:.2}", full_aperture(&full)), full.clone()),
        };
        let film_z = film_at(&full, meters);
        let bend = |height| {
            let d = full.distortion(Meridian::Y, height, film_z);
            d.map_or(f64::NAN, |d| 100.0 * d.f_tan)
        };
        // With f of the film at infinity, focusing would count as distortion, so distortion is the
        // change from the middle of the picture.
        let middle = bend(0.1);
        let _ = writeln!(
            out,
            "| {figure}, f/{n} | {} | {} | {:+.1}% | {:+.1}% |",
            as_range(depth(&lens, meters)),
            as_range(depth(&at(5.6), meters)),
            bend(12.0) - middle,
            bend(18.0) - middle,
        );
    }
    out
}

/// Opens a scene, seen by a camera file.
fn opened(scene: &str, camera: &str) -> Session {
    let mut plan = Plan::of_era(Era::Modern, scene);
    plan.camera = Some(CameraChoice::File(camera.into()));
    Session::open(plan).expect("the scenes and cameras of the figures can be read")
}

/// Returns where a ray along −z first meets a scene: z in meters.
fn front_of(session: &Session, x: f64, y: f64) -> f64 {
    let origin = DVec3::new(x, y, 2.0) - session.scene.origin;
    let hit = session.scene.hit(&Ray::new(origin.as_vec3(), Vec3::NEG_Z));
    2.0 - f64::from(hit.expect("the scene has a shape there").t)
}

/// Returns for each figure the diameter in millimeters of the blur of a point of the back wall,
/// above the sideboard.
fn blurs_of_the_wall() -> Vec<f64> {
    let blur_in = |s: Shot| {
        let session = opened("scenes/livroom/room.iv", s.camera);
        let (x, y) = (0.1, 1.0);
        let wall = DVec3::new(x, y, front_of(&session, x, y));
        let distance = (wall - session.pose.position).dot(session.pose.direction());
        blur(&s.lens, film_at(&s.lens, s.telephone), distance)
    };
    shots().into_iter().map(blur_in).collect()
}

/// Adds the numbers in the sentences about Figures 1 and 2.
fn add_desk_lamp(numbers: &mut PageNumbers) {
    let [(_, wide, stop, _), (_, long, ..)] = lamps();
    numbers.phrase(
        "| wide-angle, {} mm, f/{} | telephoto, {} mm, f/{} |",
        [
            millimeters(&wide),
            stop.map_or_else(String::new, |n| n.to_string()),
            millimeters(&long),
            format!("{:.2}", full_aperture(&long)),
        ],
    );
    let desk = opened("scenes/desk-lamp/desk-lamp.iv", "camera/cam-9.dat");
    let (elbow, wall) = (front_of(&desk, -0.24, 0.37), front_of(&desk, -1.99, 1.9));
    numbers.phrase("the arm is {} m deep,", [format!("{:.1}", BULB - elbow)]);
    numbers.phrase(
        "the wall, {} m behind the bulb.",
        [format!("{:.1}", BULB - wall)],
    );
}

/// Adds the numbers in the headings and sentences about Figures 10 to 12.
fn add_living_room(numbers: &mut PageNumbers) {
    let headings = [
        "### Figure 10: wide-angle, {} mm, f/{}, from {} m",
        "### Figure 11: double Gauss, {} mm, f/{}, from {} m",
        "### Figure 12: telephoto, {} mm, f/{}, from {} m",
    ];
    let shots = shots();
    for (heading, s) in headings.into_iter().zip(&shots) {
        let aperture = format!("{:.2}", full_aperture(&s.lens));
        let place = s.telephone.to_string();
        numbers.phrase(heading, [millimeters(&s.lens), aperture, place]);
    }
    let [near, middle, far] = [0, 1, 2].map(|i: usize| shots[i].telephone.to_string());
    numbers.phrase("grows ({}, {} and {} m),", [near, middle, far]);
    let ratio = |s: &Shot| {
        let (near, far) = rods(s);
        format!("{:.2}", far / near)
    };
    numbers.phrase(
        "the book is {} times as large as it would be",
        [ratio(&shots[0])],
    );
    numbers.phrase(
        "the book is {} times as large as beside",
        [ratio(&shots[2])],
    );
    let walls = blurs_of_the_wall();
    let times = |i: usize| format!("{:.2}", walls[0] / walls[i]);
    numbers.phrase(
        "blurred {} times as much as in Figure 11 and {} times as much as in Figure 12.",
        [times(1), times(2)],
    );
}

fn millimeters(lens: &Lens) -> String {
    format!("{:.0}", lens.first_order().efl())
}

/// Returns what follows a word in a file of the repository, up to a character.
fn stated_in(file: &str, before: &str, end: char) -> String {
    let text = std::fs::read_to_string(file).expect("the file is in the repository");
    let rest = text.split_once(before).map(|(_, rest)| rest);
    let value = rest.and_then(|rest| rest.split(end).next());
    value.expect("the script states it").to_owned()
}

/// Returns the numbers that take a second.
pub(super) fn quick() -> PageNumbers {
    let mut numbers = PageNumbers {
        tables: vec![
            ("figures 1 and 2", figures_1_and_2()),
            ("perspective", perspective()),
            ("depth of field", depth_of_field()),
            ("vignetting", vignetting()),
            ("pulling focus", pulling_focus()),
        ],
        ..PageNumbers::default()
    };
    numbers.phrase("of the paper's picture, {} mm.", [PIXEL.to_string()]);
    numbers.phrase(
        "Figure 6, the height angle: h is {} mm,",
        [CORNER.y.to_string()],
    );
    add_desk_lamp(&mut numbers);
    add_living_room(&mut numbers);
    let script = "scenes/livroom/pull-focus.sh";
    numbers.phrase(
        "makes the movie: {} frames from the telephone to the book through the double Gauss at {} mm.",
        [
            stated_in(script, "FRAMES:-", '}'),
            stated_in(script, "--efl ", 'm'),
        ],
    );
    let rows = scaled("double-gauss", 60.0).prescription().surfaces.len();
    let glass = rows - 1; // One row is the stop.
    numbers.phrase("its way through {} surfaces of glass.", [glass.to_string()]);
    numbers
}
