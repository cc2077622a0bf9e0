//! The journal of a movie: which process began and wrote which frame.
//!
//! It is for people who look for the machine that is slow or wrong. Nothing reads it, and a line
//! that cannot be written is left out. Some network file systems lose lines that two machines
//! append in the same instant.

use std::fs::OpenOptions;
use std::io::Write as _;
use std::path::{Path, PathBuf};
use std::time::SystemTime;

use ivcam_base::files::host_name;
use ivcam_base::platform::process_id;

/// The name of the file.
const JOURNAL: &str = "film.log";

/// The journal in the folder of the frames, with the name of this process.
pub(super) struct Journal {
    path: PathBuf,
    process: String,
}

impl Journal {
    pub(super) fn of(folder: &Path) -> Self {
        Self {
            path: folder.join(JOURNAL),
            process: format!("{} process {}", host_name(), process_id()),
        }
    }

    /// Appends a line: the seconds since 1970 by this machine's clock, the process, what it does,
    /// and the frame.
    pub(super) fn write(&self, verb: &str, frame: u32) {
        let since_1970 = SystemTime::now().duration_since(SystemTime::UNIX_EPOCH);
        let seconds = since_1970.unwrap_or_default().as_secs();
        let line = format!("{seconds} {} {verb} frame {frame}\n", self.process);
        let file = OpenOptions::new()
            .append(true)
            .create(true)
            .open(&self.path);
        let _ = file.and_then(|mut file| file.write_all(line.as_bytes()));
    }
}
