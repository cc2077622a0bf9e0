//! The files that say which movie the frames of a folder belong to, so that two do not mix.
//!
//! One has a line for each choice that determines the pictures: a key, a blank and a value. The
//! keys `frames` and `rate` describe the movie to those who have only the folder. The other has the
//! hashes of the files that the first process read: the scene and its parts, pictures, the camera
//! and the lens; and one of what was compiled of the scene, because not everything may fit into the
//! memory.

use std::collections::BTreeSet;
use std::path::Path;

use ivcam_base::diag::{Diagnostic, Result, differences};
use ivcam_base::files::{Inputs, MAX_TEXT, hash_of_file, read_file, write_new};
use ivcam_base::math::simd::arithmetic;

use super::timeline::{RATES, Timeline};
use crate::photo::Plan;

/// The name of the file of the choices.
pub(super) const LABEL: &str = "film.txt";
/// The name of the file of the hashes.
const FILES: &str = "files.txt";
/// What stands among the names of the files for the parts of the scene that were compiled.
pub(super) const PARTS: &str = "the parts of the scene";

/// Returns the label of a movie.
///
/// # Errors
/// Fails if the scene cannot be read.
pub(super) fn label(plan: &Plan, timeline: &Timeline) -> Result<String> {
    let mut choices = plan.with_given(plan.describe());
    let mut say = |key: &str, value: String| choices.insert(key.to_owned(), value);
    say("arithmetic", arithmetic().to_owned());
    if let Some(target) = plan.stop.error {
        say("target", target.to_string());
    }
    if let Some(time) = plan.stop.time {
        say("time", format!("{time:?}"));
    }
    // On another machine the same scene may be in another folder.
    let name = plan.scene.file_name().unwrap_or_default();
    say("scene", name.to_string_lossy().into_owned());
    // A scene from a pipe can be read only once.
    if plan.scene.as_os_str() != "-" && (plan.scene.is_file() || !plan.scene.exists()) {
        let hash = hash_of_file(&plan.scene);
        let hash = hash.map_err(|e| Diagnostic::io(plan.scene.display(), &e))?;
        say("scene-content", format!("{hash:016x}"));
    }
    say("camera", format!("{:?}", plan.camera));
    say("optics", format!("{:?}", plan.optics));
    say("timeline", format!("{timeline:?}"));
    let lines = choices
        .iter()
        .map(|(key, value)| format!("{key} {value}\n"));
    let (version, frames, rate) = (env!("CARGO_PKG_VERSION"), timeline.frames, timeline.rate);
    let first = format!("ivcam {version}\nframes {frames}\nrate {rate}\n");
    Ok(first + &lines.collect::<String>())
}

/// Labels a folder, or checks that its label is the same.
///
/// # Errors
/// Fails if the folder cannot be written, or has the frames of another movie.
pub(super) fn label_folder(folder: &Path, text: &str) -> Result<()> {
    let there = first_text(&folder.join(LABEL), text)?;
    if there == text {
        return Ok(());
    }
    let [there, here] = [&*there, text].map(|text| lines(text).collect::<Vec<_>>());
    another_movie(
        folder,
        &differences(&there, &here, ["there", "here"]).join("; "),
    )
}

/// Records the files of a movie in its folder, or checks that those that are recorded there have
/// the same content. A process may read others, because parts of a scene are there at some times
/// alone.
///
/// # Errors
/// Fails if the folder cannot be written, or a file has changed.
pub(super) fn check_files(folder: &Path, inputs: &Inputs) -> Result<()> {
    let hex = |hashes: &BTreeSet<u64>| -> Vec<String> {
        hashes.iter().map(|hash| format!("{hash:016x}")).collect()
    };
    let line = |(name, hashes): (&String, &BTreeSet<u64>)| {
        let hashes = hex(hashes).join(",");
        format!("{hashes} {name}\n")
    };
    let text: String = inputs.iter().map(line).collect();
    for (hashes, name) in lines(&first_text(&folder.join(FILES), &text)?) {
        let Some(here) = inputs.get(name) else {
            continue;
        };
        let here = hex(here);
        if !hashes.split(',').any(|hash| here.iter().any(|h| h == hash)) {
            let difference = match name {
                PARTS => "other parts of the scene fit into the memory (`--memory`)".to_owned(),
                _ => format!("`{name}` has changed since"),
            };
            return another_movie(folder, &difference);
        }
    }
    Ok(())
}

/// Returns the text of a file that several processes want to write: that of the first one.
fn first_text(path: &Path, text: &str) -> Result<String> {
    if !path.exists() && write_new(path, text.as_bytes())? {
        return Ok(text.to_owned());
    }
    let there = read_file(path, MAX_TEXT)?;
    Ok(String::from_utf8_lossy(&there).into_owned())
}

/// Refuses a folder whose frames are of another movie.
fn another_movie(folder: &Path, difference: &str) -> Result<()> {
    let folder = folder.display();
    let text = format!("the frames in `{folder}` are of another movie: {difference}");
    Err(Diagnostic::error(text).with_help("give another `--folder`, or remove this one"))
}

/// The width and the height of a frame in pixels.
pub(super) type FrameSize = (u32, u32);

/// What a label says of the movie to those who have only the folder.
pub(super) struct MovieFacts {
    /// The number of frames.
    pub frames: u32,
    /// Frames per second.
    pub rate: f64,
    /// The size of the frames, if the label has it.
    pub size: Option<FrameSize>,
}

/// Returns what the label of a folder says of its movie.
///
/// # Errors
/// Fails if the folder has no label, or one that does not say the number of frames and the rate.
pub(super) fn read_label(folder: &Path) -> Result<MovieFacts> {
    let path = folder.join(LABEL);
    let bytes = read_file(&path, MAX_TEXT)
        .map_err(|e| e.with_help("a folder with the frames of a movie has a file `film.txt`"))?;
    let text = String::from_utf8_lossy(&bytes);
    let find = |key: &str| lines(&text).find(|(k, _)| *k == key).map(|(_, v)| v);
    let value = |key: &str| {
        find(key).ok_or_else(|| {
            let text = format!("`{}` does not say the movie's {key}", path.display());
            Diagnostic::error(text).with_help("make the frames with this version of ivcam")
        })
    };
    let wrong = |key: &str| Diagnostic::error(format!("`{}`: invalid {key}", path.display()));
    let frames = value("frames")?.parse().ok();
    let frames = frames.filter(|n| (1..=super::timeline::MOST_FRAMES).contains(n));
    let rate = value("rate")?.parse().ok();
    let rate = rate.filter(|r| RATES.contains(r));
    Ok(MovieFacts {
        frames: frames.ok_or_else(|| wrong("number of frames"))?,
        rate: rate.ok_or_else(|| wrong("rate"))?,
        size: size_of_frames(find("size"), find("region")),
    })
}

/// Returns the size of frames by the values of `--size` and `--region`, which is a part of it.
fn size_of_frames(size: Option<&str>, region: Option<&str>) -> Option<FrameSize> {
    let words = region.and_then(|region| region.splitn(3, ',').nth(2));
    let (width, height) = words.or(size)?.split_once([',', 'x'])?;
    Some((width.trim().parse().ok()?, height.trim().parse().ok()?))
}

/// Returns the keys and values of a label.
fn lines(text: &str) -> impl Iterator<Item = (&str, &str)> {
    text.lines().map(|l| l.split_once(' ').unwrap_or((l, "")))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn frames_have_the_size_of_the_region_if_there_is_one() {
        assert_eq!(size_of_frames(Some("40x30"), None), Some((40, 30)));
        let region = Some("3,4,20,10");
        assert_eq!(size_of_frames(Some("40x30"), region), Some((20, 10)));
        assert_eq!(size_of_frames(None, None), None);
    }

    #[test]
    fn a_file_that_has_changed_makes_another_movie_and_a_further_file_does_not() {
        let folder = std::env::temp_dir().join(format!("ivcam-files-{}", std::process::id()));
        std::fs::create_dir_all(&folder).unwrap();
        let inputs = |files: &[(&str, u64)]| -> Inputs {
            let file = |(name, hash): &(&str, u64)| (name.to_string(), BTreeSet::from([*hash]));
            files.iter().map(file).collect()
        };
        let check = |files: &[(&str, u64)]| check_files(&folder, &inputs(files));
        let results = [
            check(&[("room.iv", 1), ("my lens.dat", 2)]),
            check(&[("room.iv", 1), ("my lens.dat", 2), ("late.png", 3)]),
            check(&[("room.iv", 1), ("my lens.dat", 4)]),
        ];
        std::fs::remove_dir_all(&folder).unwrap();
        let [first, second, third] = results;
        assert!(first.is_ok() && second.is_ok());
        assert!(third.unwrap_err().message.contains("`my lens.dat`"));
    }
}
