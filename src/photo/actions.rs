//! The words of `--event` and `--touch`: what a user does with a scene.

use ivcam_base::diag::{Diagnostic, Result};
use ivcam_inventor::events::{Action, ActionKind};

/// Parses an event: `NODE.EVENT=VALUE`, and `@SECONDS` if it is not sent at the beginning.
///
/// # Errors
/// Returns an error if a part is missing.
pub(super) fn parse_event(word: &str) -> Result<Action> {
    let (word, time) = timed(word);
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
    })
}

/// Parses a touch: the name of a node, and `@SECONDS`.
///
/// # Errors
/// Returns an error if there is no name.
pub(super) fn parse_touch(word: &str) -> Result<Action> {
    let (node, time) = timed(word);
    if node.trim().is_empty() {
        let error = Diagnostic::error(format!("`--touch {word}` names no node"));
        return Err(error.with_help("such as `Switch@3s`"));
    }
    Ok(Action {
        time,
        node: node.trim().into(),
        what: ActionKind::Touch,
    })
}

/// Returns the words that are parsed as an action.
pub(super) fn action_word(action: &Action) -> String {
    let time = match action.time {
        0.0 => String::new(),
        time => format!("@{time}s"),
    };
    match &action.what {
        ActionKind::Send { event, value } => format!("{}.{event}={value}{time}", action.node),
        _ => format!("{}{time}", action.node),
    }
}

/// Splits the time after the last `@` from a word. Without one the time is 0.
fn timed(word: &str) -> (&str, f64) {
    let split = word.rsplit_once('@').and_then(|(rest, time)| {
        let time: f64 = time.trim().trim_end_matches('s').parse().ok()?;
        time.is_finite().then_some((rest, time))
    });
    split.unwrap_or((word, 0.0))
}

#[cfg(test)]
mod tests {
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
        assert_eq!(
            action_word(&parse_touch("Door@3s").expect("a touch")),
            "Door@3s"
        );
    }
}
