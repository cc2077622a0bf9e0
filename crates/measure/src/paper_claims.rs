//! Measures the claims of the 1999 paper about its pictures by rays through the lenses, and writes
//! the tables of the guide.
//!
//! `cargo run --release -p measure -- paper-claims -- docs/guide/paper.md`;
//! without a file it prints to stdout. A table is between `<!-- numbers: NAME -->` and `<!-- end
//! -->`.

use std::fmt::Write as _;
use std::process::ExitCode;

use glam::{DVec2, DVec3};
use ivcam_base::math::{Meters, Mm};
use ivcam_optics::lens::{Focus, FocusMethod, Lens, LensRay, Plane};

/// A pixel of the paper's 360×240 picture, in millimeters of film.
const PIXEL: f64 = 0.1;
const CORNER: DVec2 = DVec2::new(18.0, 12.0);

/// The lens and the position of a figure; distances are in meters from the front vertex, as in
/// `camera/cam-4.dat` to `cam-6.dat`.
struct Shot {
    figure: &'static str,
    lens: Lens,
    telephone: f64,
    book: f64,
}

fn shots() -> Vec<Shot> {
    let shot = |figure, name, efl, telephone, book| Shot {
        figure,
        lens: scaled(name, efl),
        telephone,
        book,
    };
    vec![
        shot("10: wide-angle, 20 mm", "wide-angle", 20.0, 0.50, 1.29),
        shot("11: double Gauss, 60 mm", "double-gauss", 60.0, 1.50, 2.25),
        shot("12: telephoto, 180 mm", "telephoto", 180.0, 4.50, 5.23),
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

fn perspective() -> String {
    let mut out = String::from(
        "| figure | a 10 cm rod at the telephone | the same at the book | book / telephone |\n|---|---|---|---|\n",
    );
    for s in shots() {
        let film_z = film_at(&s.lens, s.telephone);
        let at = |meters| image_of(&s.lens, film_z, 100.0, meters);
        let (near, far) = (at(s.telephone), at(s.book));
        let _ = writeln!(
            out,
            "| {} | {near:.3} mm | {far:.3} mm | **{:.2}** |",
            s.figure,
            far / near
        );
    }
    out
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
            let n = lens.first_order().f_number().unwrap_or(f64::NAN);
            let film_z = film_at(&lens, s.telephone);
            let _ = writeln!(
                out,
                "| {}, f/{n:.1} | {} | {} | {:.2} mm | {:.2} mm |",
                s.figure,
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

fn figures_1_and_2() -> String {
    let mut out = String::from(
        "| figure | sharp | the same at f/5.6 | distortion at 12 mm | at 18 mm |\n|---|---|---|---|---|\n",
    );
    let lamps = [
        ("1: wide-angle, 20 mm", "wide-angle", 20.0, 11.0, 0.62),
        ("2: telephoto, 180 mm", "telephoto", 180.0, 5.424, 6.38),
    ];
    for (figure, name, efl, stop, meters) in lamps {
        let full = scaled(name, efl);
        let at = |n: f64| full.at_f_number(n).expect("both lenses open that far");
        let film_z = film_at(&full, meters);
        let bend = |height| {
            let d = full.distortion(Plane::Y, height, film_z);
            d.map_or(f64::NAN, |d| 100.0 * d.f_tan)
        };
        // With f of the film at infinity, focusing would count as distortion, so distortion is the
        // change from the middle of the picture.
        let middle = bend(0.1);
        let _ = writeln!(
            out,
            "| {figure}, f/{stop:.1} | {} | {} | {:+.1}% | {:+.1}% |",
            as_range(depth(&at(stop), meters)),
            as_range(depth(&at(5.6), meters)),
            bend(12.0) - middle,
            bend(18.0) - middle,
        );
    }
    out
}

/// Replaces the text between a table's marks.
fn replaced(text: &str, name: &str, table: &str) -> Option<String> {
    let mark = format!("<!-- numbers: {name} -->\n");
    let start = text.find(&mark)? + mark.len();
    let end = start + text[start..].find("<!-- end -->")?;
    Some(format!("{}\n{table}\n{}", &text[..start], &text[end..]))
}

pub(crate) fn run(arguments: Vec<String>) -> ExitCode {
    let tables = [
        ("figures 1 and 2", figures_1_and_2()),
        ("perspective", perspective()),
        ("depth of field", depth_of_field()),
        ("vignetting", vignetting()),
        ("pulling focus", pulling_focus()),
    ];
    let Some(path) = arguments.into_iter().next() else {
        for (name, table) in &tables {
            println!("{name}\n\n{table}");
        }
        return ExitCode::SUCCESS;
    };
    match write(&path, &tables) {
        Ok(()) => ExitCode::SUCCESS,
        Err(error) => {
            eprintln!("{path}: {error}");
            ExitCode::FAILURE
        }
    }
}

/// Writes tables between their marks in a file.
fn write(path: &str, tables: &[(&str, String)]) -> Result<(), Box<dyn std::error::Error>> {
    let mut text = std::fs::read_to_string(path)?;
    for (name, table) in tables {
        text = replaced(&text, name, table).ok_or_else(|| format!("no place for {name}"))?;
    }
    Ok(std::fs::write(path, text)?)
}
