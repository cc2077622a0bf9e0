//! The file that says which movie the frames of a folder belong to, so that two do not mix.
//!
//! It has one line for each choice that determines the pictures: a key, a blank and a value. The
//! keys `frames` and `rate` describe the movie to those who have only the folder.

use std::io::Read as _;
use std::path::Path;

use super::timeline::Timeline;
use crate::diag::{Diagnostic, Result};
use crate::files::{MAX_TEXT, read_file, write_new};
use crate::photo::Plan;

/// The name of the file.
pub(super) const LABEL: &str = "film.txt";
/// The differences between two movies that a message lists.
const MOST_DIFFERENCES: usize = 3;

/// Returns the label of a movie.
///
/// # Errors
/// Fails if the scene cannot be read.
pub(super) fn label(plan: &Plan, timeline: &Timeline) -> Result<String> {
    let mut text = format!(
        "ivcam {}\nframes {}\nrate {}\n",
        env!("CARGO_PKG_VERSION"),
        timeline.frames,
        timeline.rate
    );
    for (key, value) in plan.describe() {
        text += &format!("{key} {value}\n");
    }
    if let Some(target) = plan.stop.error {
        text += &format!("target {target}\n");
    }
    if let Some(time) = plan.stop.time {
        text += &format!("time {time:?}\n");
    }
    // On another machine the same scene may be in another folder.
    let name = plan.scene.file_name().unwrap_or_default().to_string_lossy();
    text += &format!("scene {name}\n");
    // A scene from a pipe can be read only once.
    if plan.scene.as_os_str() != "-" && (plan.scene.is_file() || !plan.scene.exists()) {
        let hash = hash_of_file(&plan.scene);
        let hash = hash.map_err(|e| Diagnostic::io(plan.scene.display(), &e))?;
        text += &format!("scene-content {hash:016x}\n");
    }
    Ok(text
        + &format!(
            "camera {:?}\noptics {:?}\ntimeline {timeline:?}\n",
            plan.camera, plan.optics
        ))
}

/// Labels a folder, or checks that its label is the same.
///
/// # Errors
/// Fails if the folder cannot be written, or has the frames of another movie.
pub(super) fn label_folder(folder: &Path, text: &str) -> Result<()> {
    let path = folder.join(LABEL);
    if !path.exists() && write_new(&path, text.as_bytes())? {
        return Ok(());
    }
    let there = read_file(&path, MAX_TEXT)?;
    let there = String::from_utf8_lossy(&there);
    if there == text {
        return Ok(());
    }
    let differences = differences(&there, text);
    let message = format!(
        "the frames in `{}` are of another movie: {}",
        folder.display(),
        differences.join("; ")
    );
    Err(Diagnostic::error(message).with_help("give another `--folder`, or remove this one"))
}

/// Returns the number of frames and the rate of the movie whose frames are in a folder.
///
/// # Errors
/// Fails if the folder has no label, or one that does not say them.
pub(super) fn read_label(folder: &Path) -> Result<(u32, f64)> {
    let path = folder.join(LABEL);
    let bytes = read_file(&path, MAX_TEXT)
        .map_err(|e| e.with_help("a folder with the frames of a movie has a file `film.txt`"))?;
    let text = String::from_utf8_lossy(&bytes);
    let value = |key: &str| {
        let value = lines(&text).find(|(k, _)| *k == key).map(|(_, v)| v);
        value.ok_or_else(|| {
            let text = format!("`{}` does not say the movie's {key}", path.display());
            Diagnostic::error(text).with_help("make the frames with this version of ivcam")
        })
    };
    let wrong = |key: &str| Diagnostic::error(format!("`{}`: invalid {key}", path.display()));
    let frames = value("frames")?.parse().ok();
    let frames = frames.filter(|n| (1..=super::timeline::MOST_FRAMES).contains(n));
    let rate = value("rate")?.parse().ok();
    let rate = rate.filter(|r| (0.001..=1000.0).contains(r));
    Ok((
        frames.ok_or_else(|| wrong("number of frames"))?,
        rate.ok_or_else(|| wrong("rate"))?,
    ))
}

/// Returns the keys and values of a label.
fn lines(text: &str) -> impl Iterator<Item = (&str, &str)> {
    text.lines().map(|l| l.split_once(' ').unwrap_or((l, "")))
}

/// Describes the first differences between the label that is there and the present one.
fn differences(there: &str, here: &str) -> Vec<String> {
    let value = |text: &str, key: &str| {
        let mut of_key = lines(text).filter(|(k, _)| *k == key);
        of_key.next().map(|(_, v)| v.to_owned())
    };
    let mut keys: Vec<&str> = lines(there).chain(lines(here)).map(|(k, _)| k).collect();
    let mut seen = std::collections::HashSet::new();
    keys.retain(|key| seen.insert(*key));
    let mut found = Vec::new();
    for key in keys {
        let (a, b) = (value(there, key), value(here, key));
        if a == b {
            continue;
        }
        // The description of a whole timeline or lens is no use in a message.
        let is_short = |v: &Option<String>| v.as_ref().is_none_or(|v| v.len() <= 60);
        let or_none = |v: Option<String>| v.unwrap_or_else(|| "none".into());
        found.push(match is_short(&a) && is_short(&b) {
            true => format!("{key} is {} there and {} here", or_none(a), or_none(b)),
            false => format!("{key} differs"),
        });
    }
    if found.len() > MOST_DIFFERENCES {
        let more = found.len() - MOST_DIFFERENCES;
        found.truncate(MOST_DIFFERENCES);
        found.push(format!("{more} more differences"));
    }
    found
}

/// Returns the hash of a file's bytes (FNV-1a, 64 bits).
fn hash_of_file(path: &Path) -> std::io::Result<u64> {
    let mut file = std::fs::File::open(path)?;
    let mut hash = 0xcbf2_9ce4_8422_2325_u64;
    let mut block = vec![0; 1 << 16];
    loop {
        let length = file.read(&mut block)?;
        if length == 0 {
            return Ok(hash);
        }
        for byte in &block[..length] {
            hash = (hash ^ u64::from(*byte)).wrapping_mul(0x0100_0000_01b3);
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_message_lists_the_first_differences() {
        let there = "ivcam 1\nsamples 4\nsize 3x2\nfocus 1\ntimeline a\n";
        let here = "ivcam 1\nsamples 8\nsize 3x2\nfocus 2\nseed 3\ntimeline b\n";
        assert_eq!(
            differences(there, here),
            [
                "samples is 4 there and 8 here",
                "focus is 1 there and 2 here",
                "timeline is a there and b here",
                "1 more differences"
            ]
        );
    }
}
