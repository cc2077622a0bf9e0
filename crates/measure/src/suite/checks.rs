//! Makes a picture of a scene and lists its events, and compares them with what must be there.

use std::path::{Path, PathBuf};
use std::process::Command;

use glam::{DQuat, DVec3};
use image::RgbImage;
use serde_json::Value;

use super::entries::{Check, CheckedView, Range, Setting};

/// The size of the pictures.
const SIZE: [f64; 2] = [480.0, 320.0];
/// The angle of view of the standard's `Viewpoint` over the shorter side, which it rounds to
/// 0.785398.
const ANGLE_OF_VIEW: f64 = std::f64::consts::FRAC_PI_4;

/// What makes and compares pictures.
pub(super) struct Judge<'a> {
    pub(super) program: &'a Path,
    /// The folder that a scene may open files of.
    pub(super) root: &'a Path,
}

impl Judge<'_> {
    /// Returns the checks that a scene fails in one setting, in words.
    ///
    /// # Errors
    /// The program fails, with what it prints.
    pub(super) fn failures(
        &self,
        scene: &Path,
        number: usize,
        setting: &Setting,
        checks: &[Check],
    ) -> Result<Vec<String>, String> {
        let is_event = |c: &Check| matches!(c, Check::Event { .. } | Check::Never { .. });
        let events = match checks.iter().any(is_event) {
            true => self.events(scene, setting)?,
            false => Vec::new(),
        };
        let picture = match checks.iter().all(is_event) {
            true => RgbImage::new(1, 1),
            false => self.picture(scene, number, setting)?,
        };
        let view = &setting.view;
        let failure = |check: &Check| match check {
            Check::See { at, color } => see(&picture, view, *at, color),
            Check::Share {
                corners,
                color,
                least,
                most,
            } => share(&picture, view, corners, color, [*least, *most]),
            Check::Extent {
                corners,
                color,
                pixels,
            } => extent(&picture, view, corners, color, *pixels),
            Check::Event { name, value, time } => sent(&events, name, value, *time),
            Check::Never { name } => not_sent(&events, name),
        };
        Ok(checks.iter().filter_map(failure).collect())
    }

    fn command(&self, verb: &str, scene: &Path, setting: &Setting) -> Command {
        let mut command = Command::new(self.program);
        command.arg(verb).arg(scene).arg("--contain").arg(self.root);
        command.args(["--scene-time", &setting.time.to_string()]);
        command.args(&setting.options);
        command
    }

    fn picture(&self, scene: &Path, number: usize, setting: &Setting) -> Result<RgbImage, String> {
        let file: PathBuf = scene.with_extension(format!("{number}.png"));
        let mut command = self.command("render", scene, setting);
        let size = format!("{}x{}", SIZE[0], SIZE[1]);
        command.args(["--look", "viewer", "-s", "p", "--view", "else:standard"]);
        command.args([
            "--size",
            &size,
            "--samples",
            "4",
            "--threads",
            "1",
            "--quiet",
            "-o",
        ]);
        command.arg(&file);
        if setting.is_chosen {
            command.args(["--camera", &viewpoint(&setting.view)]);
        }
        output(&mut command)?;
        let picture = image::open(&file).map_err(|e| format!("{}: {e}", file.display()))?;
        Ok(picture.to_rgb8())
    }

    fn events(&self, scene: &Path, setting: &Setting) -> Result<Vec<Value>, String> {
        let mut command = self.command("check", scene, setting);
        let text = output(command.args(["--events", "--json"]))?;
        let report: Value = serde_json::from_str(&text).map_err(|e| e.to_string())?;
        Ok(report["events"].as_array().cloned().unwrap_or_default())
    }
}

/// Runs a command and returns its standard output.
fn output(command: &mut Command) -> Result<String, String> {
    let made = command.output().map_err(|e| e.to_string())?;
    match made.status.success() {
        true => Ok(String::from_utf8_lossy(&made.stdout).into_owned()),
        false => Err(String::from_utf8_lossy(&made.stderr).into_owned()),
    }
}

/// Returns a view as a node of VRML97.
fn viewpoint(view: &CheckedView) -> String {
    let ([px, py, pz], [ax, ay, az]) = (view.position.to_array(), view.axis.to_array());
    format!(
        "#VRML V2.0 utf8\nViewpoint {{ position {px} {py} {pz} orientation {ax} {ay} {az} {} }}\n",
        view.angle
    )
}

/// Returns where a point of the world is in the picture, in pixels from the upper left.
fn project(view: &CheckedView, point: DVec3) -> Option<[f64; 2]> {
    let turn = DQuat::from_axis_angle(view.axis, view.angle).inverse();
    let seen = turn * (point - view.position);
    let focal = 0.5 * SIZE[1] / (0.5 * ANGLE_OF_VIEW).tan();
    let place = |along: f64, half: f64| half + focal * along / -seen.z;
    (seen.z < 0.0).then(|| [place(seen.x, 0.5 * SIZE[0]), place(-seen.y, 0.5 * SIZE[1])])
}

/// Returns the rectangle between the projections of two corners, in pixels: left, upper, right and
/// lower.
fn rectangle(view: &CheckedView, corners: &[DVec3; 2]) -> Option<[f64; 4]> {
    let ([x0, y0], [x1, y1]) = (project(view, corners[0])?, project(view, corners[1])?);
    Some([x0.min(x1), y0.min(y1), x0.max(x1), y0.max(y1)])
}

fn is_color(pixel: [u8; 3], color: &[Range; 3]) -> bool {
    let inside = |(level, [least, most]): (&u8, &Range)| (least..=most).contains(&level);
    pixel.iter().zip(color).all(inside)
}

fn words(color: &[Range; 3]) -> String {
    let component = |[least, most]: &Range| format!("{least}-{most}");
    color.iter().map(component).collect::<Vec<_>>().join(" ")
}

fn see(picture: &RgbImage, view: &CheckedView, at: DVec3, color: &[Range; 3]) -> Option<String> {
    let is_in = |[x, y]: &[f64; 2]| *x >= 0.0 && *y >= 0.0 && *x < SIZE[0] && *y < SIZE[1];
    let Some([x, y]) = project(view, at).filter(is_in) else {
        return Some(format!("{at} is outside the picture"));
    };
    let pixel = picture.get_pixel(x as u32, y as u32).0;
    (!is_color(pixel, color)).then(|| {
        format!(
            "{at} at pixel {x:.0},{y:.0} is {pixel:?}, not {}",
            words(color)
        )
    })
}

fn share(
    picture: &RgbImage,
    view: &CheckedView,
    corners: &[DVec3; 2],
    color: &[Range; 3],
    limits: [f64; 2],
) -> Option<String> {
    let Some([left, upper, right, lower]) = rectangle(view, corners) else {
        return Some(format!("{} is behind the viewer", corners[0]));
    };
    let inside = |x: u32, y: u32| {
        let (x, y) = (f64::from(x) + 0.5, f64::from(y) + 0.5);
        x >= left && x < right && y >= upper && y < lower
    };
    let (mut all, mut of_color) = (0.0, 0.0);
    for (.., pixel) in picture
        .enumerate_pixels()
        .filter(|(x, y, _)| inside(*x, *y))
    {
        all += 1.0;
        of_color += f64::from(u8::from(is_color(pixel.0, color)));
    }
    let share = of_color / f64::max(all, 1.0);
    let is_right = all > 0.0 && (limits[0]..=limits[1]).contains(&share);
    (!is_right).then(|| {
        format!(
            "{share:.3} of the pixels {left:.0}..{right:.0}, {upper:.0}..{lower:.0} are {}, not {} \
             to {}",
            words(color),
            limits[0],
            limits[1]
        )
    })
}

fn extent(
    picture: &RgbImage,
    view: &CheckedView,
    corners: &[DVec3; 2],
    color: &[Range; 3],
    pixels: f64,
) -> Option<String> {
    let Some(wanted) = rectangle(view, corners) else {
        return Some(format!("{} is behind the viewer", corners[0]));
    };
    let mut found = [f64::MAX, f64::MAX, f64::MIN, f64::MIN];
    for (x, y, _) in picture
        .enumerate_pixels()
        .filter(|(.., p)| is_color(p.0, color))
    {
        let (x, y) = (f64::from(x), f64::from(y));
        found = [
            found[0].min(x),
            found[1].min(y),
            found[2].max(x + 1.0),
            found[3].max(y + 1.0),
        ];
    }
    let is_near = |(a, b): (&f64, &f64)| (a - b).abs() <= pixels;
    (!found.iter().zip(&wanted).all(is_near))
        .then(|| format!("{} is within {found:.0?}, not {wanted:.0?}", words(color)))
}

/// Returns the events of a name.
fn named<'a>(events: &'a [Value], name: &'a str) -> impl Iterator<Item = &'a Value> {
    events.iter().filter(move |e| {
        let part = |key: &str| e[key].as_str().unwrap_or_default();
        name.rsplit_once('.') == Some((part("node"), part("event")))
    })
}

fn sent(events: &[Value], name: &str, value: &str, time: f64) -> Option<String> {
    let is_it = |e: &&Value| {
        let at = e["time"].as_f64().unwrap_or(f64::NAN);
        (at - time).abs() < 1e-6 && is_value(e["value"].as_str().unwrap_or_default(), value)
    };
    let all: Vec<&Value> = named(events, name).collect();
    (!all.iter().any(is_it)).then(|| {
        let said = |e: &&&Value| format!("{} @ {}", e["value"], e["time"]);
        let near: Vec<String> = all.iter().rev().take(3).map(|e| said(&e)).collect();
        format!(
            "{name} {value} @ {time} is not sent, but {}",
            near.join(", ")
        )
    })
}

fn not_sent(events: &[Value], name: &str) -> Option<String> {
    let first = named(events, name).next()?;
    Some(format!(
        "{name} {} is sent at {}",
        first["value"], first["time"]
    ))
}

/// Returns whether a value is the one that is wanted: the same words, or numbers within 0.001. Any
/// value is, if none is wanted.
fn is_value(value: &str, wanted: &str) -> bool {
    let (values, wanted): (Vec<&str>, Vec<&str>) = (
        value.split_whitespace().collect(),
        wanted.split_whitespace().collect(),
    );
    let is_same = |(a, b): (&&str, &&str)| match (a.parse::<f64>(), b.parse::<f64>()) {
        (Ok(a), Ok(b)) => (a - b).abs() < 1e-3,
        _ => a == b,
    };
    wanted.is_empty() || values.len() == wanted.len() && values.iter().zip(&wanted).all(is_same)
}

#[cfg(test)]
mod tests {
    use super::{CheckedView, is_value, project};
    use glam::DVec3;

    #[test]
    fn the_standard_view_shows_half_its_height_at_half_its_angle() {
        let mut view = CheckedView {
            position: DVec3::new(0.0, 0.0, 10.0),
            axis: DVec3::Y,
            angle: 0.0,
        };
        let upper = DVec3::new(0.0, 10.0 * (0.5 * super::ANGLE_OF_VIEW).tan(), 0.0);
        let [x, y] = project(&view, upper).expect("it is in front");
        assert!((x - 240.0).abs() < 1e-9 && y.abs() < 1e-9);
        (view.position, view.angle) = (DVec3::X * 10.0, std::f64::consts::FRAC_PI_2);
        let [x, _] = project(&view, DVec3::new(0.0, 0.0, -1.0)).expect("it is in front");
        assert!(x > 240.0);
        assert!(project(&view, DVec3::X * 11.0).is_none());
    }

    #[test]
    fn values_are_compared_as_numbers_if_they_are() {
        assert!(is_value("1 0.25000001 0", "1 .25 0") && is_value("TRUE", "TRUE"));
        assert!(!is_value("1 0.26 0", "1 .25 0") && !is_value("1 0", "1 0 0"));
    }
}
