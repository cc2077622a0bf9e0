//! Lists of frames as the command line and job files write them: `0-99`, `0-198:2`, `3,7,20-29`.

use std::collections::BTreeSet;
use std::fmt::Write as _;

use ivcam_base::diag::{Diagnostic, Result};

use super::timeline::MOST_FRAMES;

/// Parses a list of frames. Returns the numbers in ascending order, each once.
///
/// # Errors
/// Fails if a part is not a number or a range, goes backwards, has a step of 0, or contains a
/// number beyond those of any movie.
pub(crate) fn parse_frames(text: &str) -> Result<Vec<u32>> {
    let mut frames = BTreeSet::new();
    for part in text.split(',') {
        let (first, last, step) = parse_range(part.trim())?;
        frames.extend((first..=last).step_by(step as usize));
    }
    Ok(frames.into_iter().collect())
}

/// Parses `7`, `7-9` or `7-99:2`.
fn parse_range(part: &str) -> Result<(u32, u32, u32)> {
    let wrong = |text: String| {
        Diagnostic::error(text)
            .with_help("write first-last, first-last:step, or several with commas between: 0-9,20")
    };
    let number = |word: &str| match word.trim().parse::<u32>() {
        Ok(n) if n < MOST_FRAMES => Ok(n),
        Ok(n) => Err(wrong(format!(
            "there is no frame {n}: a movie has at most {MOST_FRAMES} frames"
        ))),
        Err(_) if part.is_empty() => Err(wrong("a list of frames has an empty part".into())),
        Err(_) => Err(wrong(format!("`{part}` is not a range of frames"))),
    };
    let (range, step) = match part.split_once(':') {
        None => (part, 1),
        Some((range, step)) => (range, number(step)?),
    };
    let (first, last) = match range.split_once('-') {
        None => (number(range)?, number(range)?),
        Some((first, last)) => (number(first)?, number(last)?),
    };
    if step == 0 {
        return Err(wrong(format!(
            "the range of frames `{part}` has a step of 0"
        )));
    }
    if first > last {
        return Err(wrong(format!(
            "the range of frames `{part}` goes backwards"
        )));
    }
    Ok((first, last, step))
}

/// Returns ascending frames as a list of ranges, such as `0-2,7`.
pub(crate) fn frames_text(frames: &[u32]) -> String {
    let mut text = String::new();
    for run in frames.chunk_by(|a, b| a + 1 == *b) {
        let comma = if text.is_empty() { "" } else { "," };
        let _ = match run {
            [only] => write!(text, "{comma}{only}"),
            [first, .., last] => write!(text, "{comma}{first}-{last}"),
            [] => Ok(()),
        };
    }
    text
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn ranges_steps_and_lists_are_read_and_written() {
        for (text, frames, written) in [
            ("0-3", vec![0, 1, 2, 3], "0-3"),
            ("1-10:4", vec![1, 5, 9], "1,5,9"),
            ("7", vec![7], "7"),
            ("5-5:3", vec![5], "5"),
            ("9, 2-3 ,3-4", vec![2, 3, 4, 9], "2-4,9"),
        ] {
            let read = parse_frames(text).unwrap();
            assert_eq!(read, frames, "{text}");
            assert_eq!(frames_text(&read), written);
            assert_eq!(parse_frames(written).unwrap(), frames);
        }
        assert_eq!(parse_frames("1-199999").unwrap().len(), 199_999);
        assert_eq!(frames_text(&[]), "");
    }

    #[test]
    fn a_wrong_list_is_refused_with_its_reason() {
        for (text, reason) in [
            ("", "empty part"),
            ("3,", "empty part"),
            ("9-3", "`9-3` goes backwards"),
            ("0-9:0", "`0-9:0` has a step of 0"),
            ("0-9:", "`0-9:` is not a range"),
            ("0--9", "`0--9` is not a range"),
            ("-3", "`-3` is not a range"),
            ("a-b", "`a-b` is not a range"),
            ("0-4294967296", "is not a range"),
            ("0-200000", "no frame 200000"),
        ] {
            let error = parse_frames(text).unwrap_err();
            assert!(error.message.contains(reason), "{text}: {}", error.message);
        }
    }
}
