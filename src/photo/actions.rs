//! The words of `--event`, `--touch` and `--drag`: what a user does with a scene.

use glam::DVec2;
use ivcam_base::diag::{Diagnostic, Result};
use ivcam_inventor::events::{Action, ActionKind};
use ivcam_inventor::pose::CameraPose;

use super::camera_choice::CameraNode;

/// Parses an event: `NODE.EVENT=VALUE`, and `@SECONDS` if it is not sent at the beginning.
///
/// # Errors
/// Returns an error if a part is missing.
pub(super) fn parse_event(word: &str) -> Result<Action> {
    let (word, time) = timed(word, "event")?;
    let parts = word.split_once('=').and_then(|(end, value)| {
        let (node, event) = end.rsplit_once('.')?;
        let is_whole = ![node, event, value]
            .iter()
            .any(|part| part.trim().is_empty());
        is_whole.then_some((node.trim(), event.trim(), value.trim()))
    });
    let Some((node, event, value)) = parts else {
        let error = Diagnostic::error(format!("`--event {word}` is not an event"));
        return Err(error.with_help(
            "such as `Lamp.on=TRUE@2s`: a node's name, its event, the value and the time",
        ));
    };
    let what = ActionKind::Send {
        event: event.into(),
        value: value.into(),
    };
    Ok(Action {
        time,
        node: node.into(),
        what,
        viewer: None,
    })
}

/// Parses a touch: the name of a node, a place in the picture, or both as `NODE:X,Y`, and
/// `@SECONDS`.
///
/// # Errors
/// Returns an error if there is neither a name nor a place.
pub(super) fn parse_touch(word: &str) -> Result<Action> {
    let (word, viewer) = seen_from(word)?;
    let (target, time) = timed(word, "touch")?;
    let (node, path) = pointed(target);
    let (node, place) = match path.as_deref() {
        Some([place]) => (node, Some(*place)),
        _ => (target.trim(), None),
    };
    if node.is_empty() && place.is_none() {
        let error = Diagnostic::error(format!("`--touch {word}` names no node and no place"));
        return Err(
            error.with_help("such as `Switch@3s`, or `0.5,0.4@3s` for a place in the picture")
        );
    }
    Ok(Action {
        time,
        node: node.into(),
        what: ActionKind::Touch { place },
        viewer,
    })
}

/// Parses a drag: at least two places in the picture with `-` between them, after the name of a
/// node and `:` if it has one, and `@FROM..TO`.
///
/// # Errors
/// Returns an error if a part is missing, or the end is before the beginning.
pub(super) fn parse_drag(word: &str) -> Result<Action> {
    let (word, viewer) = seen_from(word)?;
    let parts = word.rsplit_once('@').and_then(|(target, times)| {
        let (start, end) = times.split_once("..")?;
        let (time, end) = (seconds(start)?, seconds(end)?);
        let (node, path) = pointed(target);
        let path = path.filter(|path| path.len() >= 2 && end >= time)?;
        Some((time, node, ActionKind::Drag { path, end }))
    });
    let Some((time, node, what)) = parts else {
        let error = Diagnostic::error(format!("`--drag {word}` is not a drag"));
        return Err(error.with_help(
            "such as `Slider:0.5,0.5-0.7,0.5@1s..2s`: a node's name, at least two places in the \
             picture, and two times",
        ));
    };
    Ok(Action {
        time,
        node: node.into(),
        what,
        viewer,
    })
}

/// Splits the camera that sees a place from the end of a word: `0.5,0.4@3s from CAMERA`, where the
/// camera is a node.
///
/// # Errors
/// Returns an error if the node is no camera.
fn seen_from(word: &str) -> Result<(&str, Option<CameraPose>)> {
    match word
        .split_once(" from ")
        .filter(|(_, camera)| camera.contains('{'))
    {
        Some((word, camera)) => Ok((word, Some(CameraNode::read(camera)?.pose().clone()))),
        None => Ok((word, None)),
    }
}

/// Splits places in the picture from the end of a word: `NODE:X,Y-X,Y` or `X,Y-X,Y`. The rest is
/// the name of a node. A word without places is all name.
fn pointed(word: &str) -> (&str, Option<Vec<DVec2>>) {
    let (node, places) = word.rsplit_once(':').unwrap_or(("", word));
    match path(places.trim()) {
        Some(path) => (node.trim(), Some(path)),
        None => (word.trim(), None),
    }
}

/// Parses places with `-` between them. Numbers may be negative: a `-` after a digit or a point
/// separates.
fn path(text: &str) -> Option<Vec<DVec2>> {
    let mut places = Vec::new();
    let mut rest = text;
    loop {
        let ends = |(i, c): (usize, char)| {
            c == '-' && rest[..i].ends_with(|c: char| c.is_ascii_digit() || c == '.')
        };
        let end = rest.char_indices().find(|at| ends(*at)).map(|(i, _)| i);
        let (x, y) = rest[..end.unwrap_or(rest.len())].split_once(',')?;
        let number = |text: &str| text.trim().parse().ok().filter(|v: &f64| v.is_finite());
        places.push(DVec2::new(number(x)?, number(y)?));
        match end {
            Some(end) => rest = &rest[end + 1..],
            None => return Some(places),
        }
    }
}

/// Returns the words that are parsed as an action.
pub(super) fn action_word(action: &Action) -> String {
    let time = match action.time {
        0.0 => String::new(),
        time => format!("@{time}s"),
    };
    let target = |path: &[DVec2]| {
        let places = path.iter().map(|place| format!("{},{}", place.x, place.y));
        let places = places.collect::<Vec<_>>().join("-");
        let parts = [action.node.clone(), places];
        let parts: Vec<String> = parts.into_iter().filter(|part| !part.is_empty()).collect();
        parts.join(":")
    };
    let viewer = action.viewer.as_ref().map(CameraNode::from_pose);
    let from = viewer.map_or(String::new(), |camera| format!(" from {}", camera.text()));
    match &action.what {
        ActionKind::Send { event, value } => format!("{}.{event}={value}{time}", action.node),
        ActionKind::Drag { path, end } => {
            format!("{}@{}s..{end}s{from}", target(path), action.time)
        }
        ActionKind::Touch { place } => format!("{}{time}{from}", target(place.as_slice())),
        _ => String::new(),
    }
}

/// Splits the time after the last `@` from the word of an option. Without one the time is 0.
///
/// # Errors
/// Returns an error if a number follows the `@` that is not a time from 0 on in seconds.
fn timed<'a>(word: &'a str, option: &str) -> Result<(&'a str, f64)> {
    let Some((rest, time)) = word.rsplit_once('@') else {
        return Ok((word, 0.0));
    };
    if let Some(seconds) = seconds(time) {
        return Ok((rest, seconds));
    }
    let number = time
        .trim()
        .trim_end_matches(|c: char| c.is_ascii_alphabetic());
    if number.parse::<f64>().is_err() {
        return Ok((word, 0.0)); // The `@` is part of a name or a value.
    }
    let text = format!("`--{option} {word}`: `{time}` is not a time in seconds from 0");
    Err(Diagnostic::error(text).with_help("such as `@2.5s`; the scene is opened at 0"))
}

/// Parses a time in seconds from 0, with or without the unit.
fn seconds(word: &str) -> Option<f64> {
    let time: f64 = word.trim().trim_end_matches('s').parse().ok()?;
    (time.is_finite() && time >= 0.0).then_some(time)
}

#[cfg(test)]
mod tests {
    use glam::DVec3;

    use super::*;

    #[test]
    fn an_event_has_a_node_a_name_a_value_and_a_time() {
        let event = parse_event("A.b.set_on=TRUE@2.5s").expect("an event");
        assert_eq!((event.node.as_str(), event.time), ("A.b", 2.5));
        assert_eq!(action_word(&event), "A.b.set_on=TRUE@2.5s");
        let text = parse_event("T.string=\"a@b = c\"").expect("an event");
        let value = "\"a@b = c\"".into();
        let event = "string".into();
        assert_eq!(text.what, ActionKind::Send { event, value });
        for wrong in ["A", "A=1", "A.=1", ".a=1", "A.a=", "A.a=@2s"] {
            assert!(parse_event(wrong).is_err(), "{wrong}");
        }
        assert!(parse_touch("@2s").is_err());
        for wrong in ["A.a=[1 2]@1500ms", "A.a=1@-1s", "A.a=1@1e999"] {
            let error = parse_event(wrong).expect_err("a wrong time");
            assert!(error.message.contains("is not a time"), "{}", error.message);
        }
        assert_eq!(
            action_word(&parse_touch("Door@3s").expect("a touch")),
            "Door@3s"
        );
    }
    #[test]
    fn a_place_may_be_seen_from_a_camera_of_its_own() {
        let pose = CameraPose::view_all((DVec3::ZERO, DVec3::ONE), 1.5);
        let camera = CameraNode::from_pose(&pose);
        let words = [
            format!("0.25,0.5@3s from {}", camera.text()),
            format!("S:0,0-1,1@1s..2s from {}", camera.text()),
        ];
        let touch = parse_touch(&words[0]).expect("a touch");
        let drag = parse_drag(&words[1]).expect("a drag");
        for (action, word) in [touch, drag].iter().zip(&words) {
            assert_eq!(action.viewer.as_ref(), Some(camera.pose()));
            assert_eq!(action_word(action), *word);
        }
        assert!(parse_touch("0.5,0.5 from Cube { }").is_err());
        assert_eq!(
            parse_touch("here from there").expect("a name").node,
            "here from there"
        );
    }

    #[test]
    fn a_touch_may_have_a_place_and_a_drag_has_two() {
        for word in ["Door", "0.25,0.5@3s", "A:b:0.25,-0.5@3s", "Door:1,0"] {
            let touch = parse_touch(word).expect("a touch");
            assert_eq!(action_word(&touch), word);
        }
        let named = parse_touch("A:b:0.25,-0.5").expect("a touch");
        let place = Some(DVec2::new(0.25, -0.5));
        assert_eq!(
            (named.node.as_str(), named.what),
            ("A:b", ActionKind::Touch { place })
        );
        // What is no place is a name.
        assert_eq!(parse_touch("A:b").expect("a touch").node, "A:b");
        for word in ["S:0.1,0.2-0.3,-0.4@1s..2.5s", "0,0--1,1-2,2@0s..0s"] {
            let drag = parse_drag(word).expect("a drag");
            assert_eq!(action_word(&drag), word);
        }
        for wrong in [
            "S@1s..2s",
            "S:0,0@1s..2s",
            "S:0,0-1,1@2s..1s",
            "S:0,0-1,1",
            "S:0,0-1,1@-1s..2s",
            "S:0,0-1@1..2",
        ] {
            assert!(parse_drag(wrong).is_err(), "{wrong}");
        }
    }
}
