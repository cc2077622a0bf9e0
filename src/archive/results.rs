//! The results of earlier runs over a folder: a file in the output folder with a line of JSON for
//! each file that was made.
//!
//! A line is added when a file is made, so a run that was interrupted has those of its files.

use std::collections::BTreeMap;
use std::fs::File;
use std::io::Write;
use std::path::{Path, PathBuf};

use ivcam_base::diag::{Diagnostic, Result};
use ivcam_base::files::{MAX_TEXT, read_file, write_whole};
use serde_json::Value as Json;

/// The results of earlier runs, by the name of the input, which is the key `file` of each.
pub(crate) struct EarlierResults {
    path: PathBuf,
    lines: BTreeMap<String, Json>,
}

/// The file to which the results of a run are added.
pub(crate) struct ResultFile {
    path: PathBuf,
    file: File,
}

impl EarlierResults {
    /// Reads the results of a command, such as `convert`, in its output folder.
    pub(crate) fn open(out: &Path, command: &str) -> Self {
        let path = out.join(format!("ivcam-{command}-results.jsonl"));
        let bytes = read_file(&path, MAX_TEXT).unwrap_or_default();
        // An interrupted run may leave a part of a line, which is not JSON.
        let lines = bytes.split(|byte| *byte == b'\n');
        let lines = lines.filter_map(|line| serde_json::from_slice::<Json>(line).ok());
        let named = lines.filter_map(|line| Some((line["file"].as_str()?.to_owned(), line)));
        Self {
            lines: named.collect(),
            path,
        }
    }

    /// Returns the result of an input.
    pub(crate) fn of(&self, name: &str) -> Option<&Json> {
        self.lines.get(name)
    }

    /// Writes the file again with some of its lines, for those of this run to be added.
    ///
    /// # Errors
    /// Returns an error if the file cannot be written.
    pub(crate) fn keep<'j>(&self, lines: impl Iterator<Item = &'j Json>) -> Result<ResultFile> {
        write_whole(&self.path, |file| {
            for line in lines {
                writeln!(file, "{line}")?;
            }
            Ok(())
        })?;
        let path = self.path.clone();
        match File::options().append(true).open(&path) {
            Ok(file) => Ok(ResultFile { path, file }),
            Err(error) => Err(Diagnostic::io(path.display(), &error)),
        }
    }
}

impl ResultFile {
    /// Adds a result.
    ///
    /// # Errors
    /// Returns an error if the file cannot be written.
    pub(crate) fn add(&mut self, result: &Json) -> Result<()> {
        let line = format!("{result}\n");
        let written = self.file.write_all(line.as_bytes());
        written.map_err(|error| Diagnostic::io(self.path.display(), &error))
    }
}
