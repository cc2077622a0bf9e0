//! Checkpoints: files with the state of a render, from which a later run continues.
//!
//! A checkpoint has a label, which says what the picture is, the sums of its samples, and a
//! checksum of both. It is written as a whole under another name and then renamed, so that there is
//! always the last one.

use std::fs::File;
use std::io::{BufReader, ErrorKind, Read, Write};
use std::path::{Path, PathBuf};
use std::sync::atomic::{AtomicUsize, Ordering};
use std::sync::{Arc, Mutex, PoisonError};
use std::time::Duration;

use crc32fast::Hasher;
use indexmap::IndexMap;
use ivcam_base::diag::{self, Diagnostic, Result, differences};
use ivcam_base::files::write_whole;
use ivcam_render::render::{Alarm, Keeper, StateView, Sums};
use serde::{Deserialize, Serialize};

/// The first bytes of a checkpoint.
const MAGIC: [u8; 16] = *b"ivcam checkpoint";
/// The version of the format.
const VERSION: u32 = 1;
/// The length of the checksum.
const SUM: u64 = 4;

/// Names and values that have to be the same where parts of one picture are made.
pub(crate) type Facts = IndexMap<String, String>;

/// What the picture of a checkpoint is.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub(crate) struct Label {
    /// What determines the picture.
    pub facts: Facts,
    /// The choices for the metadata, as in [`Session::described`](super::Session::described).
    pub described: Facts,
    /// The value of `--response`.
    pub response: String,
    /// Whether integer formats have 16 bits.
    pub is_deep: bool,
    /// The options that add light to the film after the render.
    pub additions: Vec<String>,
}

/// A checkpoint that was read.
#[derive(Debug)]
pub struct Checkpoint {
    pub(crate) label: Label,
    pub(crate) sums: Sums,
}

impl Label {
    /// Returns how this label differs from another. `places` says where each of them is.
    pub(crate) fn differences(&self, here: &Self, places: [&str; 2]) -> Vec<String> {
        let [there, here] = [self, here].map(|label| {
            let facts = label.facts.iter();
            facts
                .map(|(k, v)| (k.as_str(), v.as_str()))
                .collect::<Vec<_>>()
        });
        differences(&there, &here, places)
    }
}

impl Checkpoint {
    /// Reads a checkpoint.
    ///
    /// # Errors
    /// Fails if the file cannot be read, is not a checkpoint, or is damaged.
    pub fn read(path: &Path) -> Result<Self> {
        let name = path.display();
        let open = || {
            let file = File::open(path)?;
            let length = file.metadata()?.len();
            Ok((file, length))
        };
        let (file, length) = open().map_err(|e| Diagnostic::io(&name, &e))?;
        let is_other = |text: String, help: &str| {
            Diagnostic::error(text)
                .of_kind(diag::ErrorKind::Syntax)
                .with_help(help)
        };
        let mut from = Summed::new(BufReader::with_capacity(1 << 20, file));
        let (mut magic, mut version) = ([0; MAGIC.len()], [0; 4]);
        let is_checkpoint = from.read_exact(&mut magic).is_ok() && magic == MAGIC;
        if !is_checkpoint {
            let text = format!("`{name}` is not a checkpoint of ivcam");
            let help =
                "`ivcam render --checkpoint FILE` writes one; give it the name of a new file";
            return Err(is_other(text, help));
        }
        let damaged = |e: std::io::Error| {
            let text = match e.kind() {
                ErrorKind::UnexpectedEof => format!("`{name}` is cut short"),
                _ => format!("`{name}` is damaged: {e}"),
            };
            let help = "remove it, and the render begins again";
            Diagnostic::error(text)
                .of_kind(diag::ErrorKind::Damaged)
                .with_help(help)
        };
        from.read_exact(&mut version).map_err(damaged)?;
        let version = u32::from_le_bytes(version);
        if version != VERSION {
            let text = format!(
                "`{name}` has version {version} of the format, and this program reads {VERSION}"
            );
            return Err(is_other(text, "continue it with the program that wrote it"));
        }
        Self::read_content(&mut from, length).map_err(damaged)
    }

    /// Reads what follows the version, of a file of a length.
    fn read_content(from: &mut Summed<impl Read>, length: u64) -> std::io::Result<Self> {
        let mut label_length = [0; 8];
        from.read_exact(&mut label_length)?;
        let label_length = u64::from_le_bytes(label_length);
        let before = MAGIC.len() as u64 + 4 + 8;
        let left = length.checked_sub(before + SUM);
        let left = left.and_then(|left| left.checked_sub(label_length));
        let left = left.ok_or(ErrorKind::UnexpectedEof)?;
        let mut label = vec![0; label_length as usize];
        from.read_exact(&mut label)?;
        let label = postcard::from_bytes(&label);
        let label = label.map_err(|e| std::io::Error::new(ErrorKind::InvalidData, e))?;
        let sums = Sums::read(from, left)?;
        let own = from.hasher.clone().finalize();
        let mut stated = [0; SUM as usize];
        from.read_exact(&mut stated)?;
        match own == u32::from_le_bytes(stated) {
            true => Ok(Self { label, sums }),
            false => Err(std::io::Error::new(
                ErrorKind::InvalidData,
                "its checksum is wrong",
            )),
        }
    }

    /// Writes the checkpoint.
    ///
    /// # Errors
    /// Fails if the file cannot be written.
    pub(crate) fn write(&mut self, path: &Path) -> Result<()> {
        let mut result = Ok(());
        let label = &self.label;
        self.sums
            .show(&mut |snapshot| result = write(path, label, snapshot));
        result
    }
}

/// Writes a checkpoint.
fn write(path: &Path, label: &Label, snapshot: &StateView<'_, '_>) -> Result<()> {
    write_whole(path, |file| {
        let label = postcard::to_allocvec(label).map_err(std::io::Error::other)?;
        let mut to = Summed::new(file);
        to.write_all(&MAGIC)?;
        to.write_all(&VERSION.to_le_bytes())?;
        to.write_all(&(label.len() as u64).to_le_bytes())?;
        to.write_all(&label)?;
        snapshot.write(&mut to)?;
        let sum = to.hasher.clone().finalize();
        to.write_all(&sum.to_le_bytes())
    })
}

/// A stream with the checksum of the bytes that went through it.
struct Summed<S> {
    stream: S,
    hasher: Hasher,
}

impl<S> Summed<S> {
    fn new(stream: S) -> Self {
        Self {
            stream,
            hasher: Hasher::new(),
        }
    }
}

impl<S: Read> Read for Summed<S> {
    fn read(&mut self, bytes: &mut [u8]) -> std::io::Result<usize> {
        let count = self.stream.read(bytes)?;
        self.hasher.update(&bytes[..count]);
        Ok(count)
    }
}

impl<S: Write> Write for Summed<S> {
    fn write(&mut self, bytes: &[u8]) -> std::io::Result<usize> {
        let count = self.stream.write(bytes)?;
        self.hasher.update(&bytes[..count]);
        Ok(count)
    }

    fn flush(&mut self) -> std::io::Result<()> {
        self.stream.flush()
    }
}

/// Writes checkpoints of a render from time to time, and stops it after a signal.
pub(crate) struct Watch {
    /// The file, with its label and the time between two checkpoints; `None` writes none.
    pub file: Option<(PathBuf, Label, Duration)>,
    /// The signal that stops the render; 0 before it.
    pub signal: Arc<AtomicUsize>,
    /// Receives a warning if a checkpoint could not be written.
    pub warn: fn(&Diagnostic),
    alarm: Alarm,
    /// The error of the last checkpoint.
    fault: Mutex<Option<Box<Diagnostic>>>,
}

impl Watch {
    /// Begins the time to the first checkpoint.
    pub(crate) fn new(
        file: Option<(PathBuf, Label, Duration)>,
        signal: Arc<AtomicUsize>,
        warn: fn(&Diagnostic),
    ) -> Self {
        Self {
            alarm: Alarm::new(file.as_ref().map(|(_, _, every)| *every)),
            file,
            signal,
            warn,
            fault: Mutex::new(None),
        }
    }

    /// Returns the exit code of a program that the signal has ended.
    pub(crate) fn exit_code(&self) -> i32 {
        128 + self.signal.load(Ordering::Relaxed) as i32
    }

    /// Returns the error of the last checkpoint.
    ///
    /// # Errors
    /// Fails if it could not be written.
    pub(crate) fn result(self) -> Result<()> {
        let fault = self.fault.into_inner();
        fault
            .unwrap_or_else(PoisonError::into_inner)
            .map_or(Ok(()), Err)
    }
}

impl Keeper for Watch {
    fn is_stopped(&self) -> bool {
        self.signal.load(Ordering::Relaxed) != 0
    }

    fn is_due(&self) -> bool {
        self.alarm.is_due()
    }

    fn keep(&self, snapshot: &StateView<'_, '_>) {
        let Some((path, label, every)) = &self.file else {
            return;
        };
        let error = write(path, label, snapshot).err();
        let mut fault = self.fault.lock().unwrap_or_else(PoisonError::into_inner);
        if let (Some(error), None) = (&error, &*fault) {
            let text = format!("the checkpoint was not written: {}", error.message);
            let help = match path.exists() {
                true => "the render goes on and tries again; the last checkpoint is still there",
                false => "the render goes on and tries again",
            };
            (self.warn)(&Diagnostic::warning(text).with_help(help));
        }
        *fault = error;
        drop(fault);
        // The next one is due a time after this one was written.
        self.alarm.set(*every);
    }
}
