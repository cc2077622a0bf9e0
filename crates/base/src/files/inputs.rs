//! Hashes of the files that a run reads, so that a later run can tell whether they changed.

use std::cell::RefCell;
use std::collections::{BTreeMap, BTreeSet};
use std::path::Path;
use std::sync::{Arc, Mutex, PoisonError};

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
            .insert(hash(HASH_START, bytes));
    }
}

/// The hash of no bytes.
pub const HASH_START: u64 = 0xcbf2_9ce4_8422_2325;

/// Continues a hash with more bytes (FNV-1a, 64 bits).
pub fn hash(start: u64, bytes: &[u8]) -> u64 {
    let add = |hash: u64, byte: &u8| (hash ^ u64::from(*byte)).wrapping_mul(0x0100_0000_01b3);
    bytes.iter().fold(start, add)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_hash_is_that_of_its_authors_and_may_be_continued() {
        // From the test suite of Fowler, Noll and Vo.
        assert_eq!(hash(HASH_START, b"foobar"), 0x8594_4171_f739_67e8);
        assert_eq!(
            hash(hash(HASH_START, b"foo"), b"bar"),
            hash(HASH_START, b"foobar")
        );
    }
}
