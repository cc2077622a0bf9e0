//! Hashes of the files that a run reads, so that a later run can tell whether they changed.

use std::cell::RefCell;
use std::collections::{BTreeMap, BTreeSet};
use std::fs::File;
use std::io::Read;
use std::path::Path;
use std::sync::{Arc, Mutex, PoisonError};

use xxhash_rust::xxh3::{Xxh3Default, xxh3_64};

/// The hashes of the contents of files, by the names of the files without their folders.
pub type Inputs = BTreeMap<String, BTreeSet<u64>>;

thread_local! {
    /// The record of the files that this thread reads, if they are recorded.
    static CURRENT: RefCell<Option<InputRecord>> = const { RefCell::new(None) };
}

/// A record of the files that some threads read. A thread that works for another one shares its
/// record by [`InputRecord::share`].
#[derive(Clone, Default, Debug)]
pub struct InputRecord(Arc<Mutex<Inputs>>);

impl InputRecord {
    /// Records the files that this thread reads from now on.
    pub fn begin() -> Self {
        let record = Self::default();
        Self::share(Some(record.clone()));
        record
    }

    /// Returns the record of this thread, if its files are recorded.
    pub fn current() -> Option<Self> {
        CURRENT.with_borrow(Clone::clone)
    }

    /// Makes `record` the one of this thread.
    pub fn share(record: Option<Self>) {
        CURRENT.set(record);
    }

    /// Returns the files that were read up to now.
    pub fn inputs(&self) -> Inputs {
        let inputs = self.0.lock().unwrap_or_else(PoisonError::into_inner);
        inputs.clone()
    }
}

/// Records a file, if files are recorded.
pub(super) fn record(name: &str, bytes: &[u8]) {
    if let Some(InputRecord(inputs)) = InputRecord::current() {
        let name = Path::new(name)
            .file_name()
            .unwrap_or_default()
            .to_string_lossy();
        let mut inputs = inputs.lock().unwrap_or_else(PoisonError::into_inner);
        inputs
            .entry(name.into_owned())
            .or_default()
            .insert(xxh3_64(bytes));
    }
}

/// Returns the hash of a file's contents, which are read piece by piece (XXH3, 64 bits).
///
/// # Errors
/// Fails if the file cannot be read.
pub fn hash_of_file(path: &Path) -> std::io::Result<u64> {
    let mut file = File::open(path)?;
    let mut hash = Xxh3Default::new();
    let mut piece = vec![0; 1 << 16];
    loop {
        match file.read(&mut piece)? {
            0 => return Ok(hash.digest()),
            length => hash.update(&piece[..length]),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_file_read_in_pieces_has_the_hash_of_its_bytes() {
        let path = std::env::temp_dir().join(format!("ivcam-hash-{}", std::process::id()));
        let bytes: Vec<u8> = (0..200_000_u32)
            .map(|i| (i.wrapping_mul(i) >> 7) as u8)
            .collect();
        std::fs::write(&path, &bytes).unwrap();
        let read = hash_of_file(&path);
        std::fs::remove_file(&path).unwrap();
        assert_eq!(read.unwrap(), xxh3_64(&bytes));
    }
}
