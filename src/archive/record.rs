//! Decides which files of an output folder are up to date.
//!
//! A file is up to date if it is newer than its inputs and newer than the record, a file in the
//! output folder with the options of the command. The record is written again only when the options
//! change, so a run that was interrupted continues where it ended.

use std::path::{Path, PathBuf};
use std::time::SystemTime;

use ivcam_base::diag::Result;
use ivcam_base::files::{MAX_TEXT, read_file, write_whole};
use serde_json::{Value as Json, json};

/// How the record in an output folder relates to the present command.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum RecordState {
    /// There is none: the command has not written to the folder before.
    Absent,
    /// The folder was made with other options or by another version.
    Changed,
    /// The folder was made with the same options.
    Same,
}

/// The options that the files of an output folder were made with.
#[derive(Debug)]
pub(crate) struct Record {
    path: PathBuf,
    content: Json,
    /// How the record in the folder relates to this one.
    pub state: RecordState,
}

impl Record {
    /// Compares the options of a command, such as `render`, with the record in its output folder.
    pub(crate) fn open(out: &Path, command: &str, options: Json) -> Self {
        let path = out.join(format!("ivcam-{command}.json"));
        let content = json!({
            "ivcam": env!("CARGO_PKG_VERSION"), "command": command, "options": options,
        });
        let state = match read_file(&path, MAX_TEXT) {
            Err(_) => RecordState::Absent,
            Ok(bytes) => match serde_json::from_slice::<Json>(&bytes) {
                Ok(old) if old == content => RecordState::Same,
                _ => RecordState::Changed,
            },
        };
        Self {
            path,
            content,
            state,
        }
    }

    /// Writes the record if the one in the folder differs. All files of the folder then are out of
    /// date.
    ///
    /// # Errors
    /// Returns an error if the file cannot be written.
    pub(crate) fn write(&self) -> Result<()> {
        if self.state == RecordState::Same {
            return Ok(());
        }
        write_whole(&self.path, |file| writeln!(file, "{:#}", self.content))
    }

    /// Returns whether a file is newer than its inputs and the record. Files of the same age do not
    /// count as newer: clocks of file systems may be coarse.
    pub(crate) fn is_up_to_date(&self, output: &Path, inputs: &[&Path]) -> bool {
        is_newer(output, inputs) && is_newer(output, &[&self.path])
    }
}

/// Returns whether a file is there and newer than its inputs, which must be there too.
pub(crate) fn is_newer(output: &Path, inputs: &[&Path]) -> bool {
    let Some(made) = modified(output) else {
        return false;
    };
    let is_older = |path: &&Path| modified(path).is_some_and(|time| time < made);
    inputs.iter().all(is_older)
}

/// Returns the time of a file's last modification.
fn modified(path: &Path) -> Option<SystemTime> {
    path.metadata().ok()?.modified().ok()
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::time::Duration;

    /// Sets the age of a file, which is created if it does not exist.
    fn set_age(path: &Path, seconds: u64) {
        let file = std::fs::OpenOptions::new()
            .create(true)
            .append(true)
            .open(path);
        let time = SystemTime::UNIX_EPOCH + Duration::from_secs(1_000_000 - seconds);
        file.unwrap().set_modified(time).unwrap();
    }

    #[test]
    fn a_file_is_up_to_date_if_it_is_newer_than_inputs_and_options() {
        let out = std::env::temp_dir().join(format!("ivcam-record-{}", std::process::id()));
        std::fs::create_dir_all(&out).unwrap();
        let [scene, picture] = ["scene.iv", "scene.png"].map(|name| out.join(name));
        let open = |samples: u32| Record::open(&out, "render", json!({ "samples": samples }));
        assert_eq!(open(4).state, RecordState::Absent);
        open(4).write().unwrap();
        assert_eq!(open(4).state, RecordState::Same);
        assert_eq!(open(8).state, RecordState::Changed);
        let record = open(4);
        let check = |ages: [u64; 3]| {
            let paths = [&record.path, &scene, &picture];
            paths.iter().zip(ages).for_each(|(p, age)| set_age(p, age));
            record.is_up_to_date(&picture, &[&scene])
        };
        assert!(check([90, 80, 70]));
        assert!(!check([90, 70, 80]), "the scene is newer");
        assert!(!check([70, 90, 80]), "the options are newer");
        assert!(!check([90, 80, 80]), "as old as the scene");
        std::fs::remove_file(&picture).unwrap();
        assert!(!record.is_up_to_date(&picture, &[&scene]));
        std::fs::remove_dir_all(&out).unwrap();
    }
}
