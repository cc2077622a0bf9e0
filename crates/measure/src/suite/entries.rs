//! The table of what must be seen in the scenes of the suite.
//!
//! `entries.txt` has an entry for each scene:
//!
//! ```text
//! scene CATEGORY/NODE/FILE [= OTHER/FILE]  the scene, and its name in a sample of the suite
//!   " WORDS                                what must be seen, and why
//!   against WORDS                          where the suite's sentence contradicts the standard
//!   view PX PY PZ [AX AY AZ ANGLE]         the scene's Viewpoint at this time
//!   camera PX PY PZ [AX AY AZ ANGLE]       another picture, from here
//!   at SECONDS [OPTION...]                 another picture, at this time of the scene
//!   see X Y Z = R G B [TOLERANCE]          the color of the pixel that shows a point of the world
//!   share X0 Y0 X1 Y1 Z = R G B : LO HI    the share of a rectangle's pixels that have a color
//!   extent X0 Y0 X1 Y1 Z = R G B [PIXELS]  the rectangle that bounds all pixels of a color
//!   event NODE.EVENT [VALUE] @ SECONDS     an event that is sent
//!   never NODE.EVENT                       an event that is not sent
//! ```
//!
//! Points are in world space, where the standard's text and the scene give them; they are
//! projected by the view (angle of view 0.785398 over the picture's height). A component of a
//! color is a level from 0 to 255, which the picture may miss by the tolerance (3 unless stated),
//! or a range `LO-HI`. A rectangle has two opposite corners in the plane `Z`, or anywhere: `X0 Y0
//! Z0 X1 Y1 Z1`.

use glam::DVec3;

/// The levels that a component of a color may have.
pub(super) type Range = [u8; 2];

/// A place and a direction from which the world is seen.
#[derive(Clone, Copy)]
pub(super) struct CheckedView {
    pub(super) position: DVec3,
    /// The axis of the rotation from looking along -z.
    pub(super) axis: DVec3,
    /// In radians.
    pub(super) angle: f64,
}

/// Something that must be so in a picture or in the events until its time.
pub(super) enum Check {
    See {
        at: DVec3,
        color: [Range; 3],
    },
    Share {
        corners: [DVec3; 2],
        color: [Range; 3],
        least: f64,
        most: f64,
    },
    Extent {
        corners: [DVec3; 2],
        color: [Range; 3],
        pixels: f64,
    },
    Event {
        name: String,
        value: String,
        time: f64,
    },
    Never {
        name: String,
    },
}

/// A picture of a scene, with its checks.
#[derive(Clone)]
pub(super) struct Setting {
    /// The time of the scene, in seconds.
    pub(super) time: f64,
    pub(super) options: Vec<String>,
    pub(super) view: CheckedView,
    /// Whether the picture is made from `view`. Otherwise the scene is seen from there by itself.
    pub(super) is_chosen: bool,
}

/// What must be seen in a scene.
pub(super) struct SuiteEntry {
    /// The scene's path in the suite, and its path in a sample of it.
    pub(super) names: Vec<String>,
    pub(super) words: String,
    /// Where the suite's sentence contradicts the standard.
    pub(super) against: Option<String>,
    pub(super) pictures: Vec<(Setting, Vec<Check>)>,
}

impl SuiteEntry {
    /// Returns the folder of the suite that the scene is in.
    pub(super) fn category(&self) -> &str {
        self.names[0].split('/').next().unwrap_or_default()
    }
}

/// Returns the entries of a table.
///
/// # Errors
/// A line is not of the form above; the message has its number.
pub(super) fn parse(text: &str) -> Result<Vec<SuiteEntry>, String> {
    let mut entries: Vec<SuiteEntry> = Vec::new();
    for (number, line) in text.lines().enumerate() {
        let line = line.trim();
        if line.is_empty() || line.starts_with('#') {
            continue;
        }
        let wrong = || format!("entries.txt, line {}: {line}", number + 1);
        if let Some(names) = line.strip_prefix("scene ") {
            entries.push(SuiteEntry {
                names: names.split(" = ").map(str::to_string).collect(),
                words: String::new(),
                against: None,
                pictures: vec![(Setting::default(), Vec::new())],
            });
            continue;
        }
        let entry = entries.last_mut().ok_or_else(wrong)?;
        add(entry, line).ok_or_else(wrong)?;
    }
    Ok(entries)
}

impl Default for Setting {
    /// The standard's default `Viewpoint`, at the opening.
    fn default() -> Self {
        Self {
            time: 0.0,
            options: Vec::new(),
            view: CheckedView {
                position: DVec3::new(0.0, 0.0, 10.0),
                axis: DVec3::Z,
                angle: 0.0,
            },
            is_chosen: false,
        }
    }
}

/// Adds a line to an entry. Returns `None` if it is not of the form above.
fn add(entry: &mut SuiteEntry, line: &str) -> Option<()> {
    let (word, rest) = line.split_once(' ')?;
    let (setting, checks) = entry.pictures.last_mut()?;
    match word {
        "\"" => entry.words = [entry.words.as_str(), rest].join(" ").trim().to_string(),
        "against" => entry.against = Some(rest.to_string()),
        "view" => setting.view = view(rest)?,
        "camera" => {
            let setting = Setting {
                view: view(rest)?,
                is_chosen: true,
                ..setting.clone()
            };
            start(entry, setting);
        }
        "at" => {
            let mut words = rest.split_whitespace();
            let time = words.next()?.parse().ok()?;
            let options = words.map(str::to_string).collect();
            let setting = Setting {
                time,
                options,
                ..setting.clone()
            };
            start(entry, setting);
        }
        _ => checks.push(check(word, rest)?),
    }
    Some(())
}

/// Begins another picture, in place of one that has no checks yet.
fn start(entry: &mut SuiteEntry, setting: Setting) {
    entry.pictures.retain(|(_, checks)| !checks.is_empty());
    entry.pictures.push((setting, Vec::new()));
}

fn view(text: &str) -> Option<CheckedView> {
    let n = numbers(text)?;
    let axis = match n.len() {
        3 => [0.0, 0.0, 1.0, 0.0],
        7 => [n[3], n[4], n[5], n[6]],
        _ => return None,
    };
    Some(CheckedView {
        position: DVec3::new(n[0], n[1], n[2]),
        axis: DVec3::new(axis[0], axis[1], axis[2]).normalize(),
        angle: axis[3],
    })
}

fn check(word: &str, rest: &str) -> Option<Check> {
    if matches!(word, "event" | "never") {
        return event(word, rest);
    }
    let (place, rest) = rest.split_once('=')?;
    let place = numbers(place)?;
    let (color, limits) = match rest.split_once(':') {
        Some((color, limits)) => (color, numbers(limits)?),
        None => (rest, Vec::new()),
    };
    let mut parts: Vec<&str> = color.split_whitespace().collect();
    let extra: Option<f64> = match parts.len() {
        4 => Some(parts.pop()?.parse().ok()?),
        _ => None,
    };
    let tolerance = if word == "see" { extra } else { None }.unwrap_or(3.0);
    let color = match parts[..] {
        [r, g, b] => [
            range(r, tolerance)?,
            range(g, tolerance)?,
            range(b, tolerance)?,
        ],
        _ => return None,
    };
    let corners = || match place[..] {
        [x0, y0, x1, y1, z] => Some([DVec3::new(x0, y0, z), DVec3::new(x1, y1, z)]),
        [x0, y0, z0, x1, y1, z1] => Some([DVec3::new(x0, y0, z0), DVec3::new(x1, y1, z1)]),
        _ => None,
    };
    match (word, &place[..], &limits[..]) {
        ("see", &[x, y, z], []) => Some(Check::See {
            at: DVec3::new(x, y, z),
            color,
        }),
        ("share", _, &[least, most]) => Some(Check::Share {
            corners: corners()?,
            color,
            least,
            most,
        }),
        ("extent", _, []) => Some(Check::Extent {
            corners: corners()?,
            color,
            pixels: extra.unwrap_or(2.0),
        }),
        _ => None,
    }
}

fn event(word: &str, rest: &str) -> Option<Check> {
    if word == "never" {
        return Some(Check::Never {
            name: rest.trim().to_string(),
        });
    }
    let (what, time) = rest.rsplit_once('@')?;
    let (name, value) = what.trim().split_once(' ').unwrap_or((what.trim(), ""));
    Some(Check::Event {
        name: name.to_string(),
        value: value.trim().to_string(),
        time: time.trim().parse().ok()?,
    })
}

fn numbers(text: &str) -> Option<Vec<f64>> {
    text.split_whitespace().map(|n| n.parse().ok()).collect()
}

fn range(text: &str, tolerance: f64) -> Option<Range> {
    if let Some((least, most)) = text.split_once('-') {
        return Some([least.parse().ok()?, most.parse().ok()?]);
    }
    let level: f64 = text.parse().ok()?;
    let [least, most] = [level - tolerance, level + tolerance].map(|v| v.clamp(0.0, 255.0));
    Some([least.ceil() as u8, most.floor() as u8])
}

#[cfg(test)]
mod tests {
    use super::{Check, parse};

    #[test]
    fn an_entry_has_a_picture_for_each_time_and_camera() {
        let text = "scene A/B/c.x3d = b/c.x3d\n \" words\n see 0 0 1 = 204 10-20 0 5\n\
                    at 1.5 --touch BALL@1s\n event BALL.translation 3 0 0 @ 1.5\n\
                    camera 5 0 0 0 1 0 1.57\n share -1 -1 1 1 0 = 255 0 0 : .9 1\n";
        let entries = parse(text).expect("it has the form");
        let pictures = &entries[0].pictures;
        assert_eq!((entries[0].category(), pictures.len()), ("A", 3));
        let Check::See { color, .. } = &pictures[0].1[0] else {
            panic!("the first check is of a pixel");
        };
        assert_eq!(*color, [[199, 209], [10, 20], [0, 5]]);
        assert_eq!((pictures[2].0.time, pictures[2].0.is_chosen), (1.5, true));
    }

    #[test]
    fn a_line_of_another_form_is_reported_with_its_number() {
        let wrong = parse("scene A/B/c.x3d\n see 0 0 = 1 2 3\n").err();
        assert_eq!(
            wrong.as_deref(),
            Some("entries.txt, line 2: see 0 0 = 1 2 3")
        );
    }

    #[test]
    fn each_entry_of_the_table_has_words() {
        let entries = parse(include_str!("entries.txt")).expect("all lines have the form");
        let silent = entries.iter().filter(|e| e.words.is_empty()).count();
        assert_eq!(silent, 0);
    }
}
