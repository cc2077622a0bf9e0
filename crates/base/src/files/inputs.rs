//! Hashes of the files that this process reads, so that a later run can tell whether they changed.

use std::collections::{BTreeMap, BTreeSet};
use std::path::Path;
use std::sync::{Mutex, PoisonError};

/// The hashes of the contents of files, by the names of the files without their folders.
pub type Inputs = BTreeMap<String, BTreeSet<u64>>;

/// The files that were read; `None` if they are not recorded.
static INPUTS: Mutex<Option<Inputs>> = Mutex::new(None);

/// Records the files that this process reads from now on.
pub fn record_inputs() {
    *INPUTS.lock().unwrap_or_else(PoisonError::into_inner) = Some(Inputs::new());
}

/// Returns the files that were read since [`record_inputs`].
pub fn recorded_inputs() -> Inputs {
    let inputs = INPUTS.lock().unwrap_or_else(PoisonError::into_inner);
    inputs.clone().unwrap_or_default()
}

/// Records a file, if files are recorded.
pub(super) fn record(name: &str, bytes: &[u8]) {
    if let Some(inputs) = &mut *INPUTS.lock().unwrap_or_else(PoisonError::into_inner) {
        let name = Path::new(name)
            .file_name()
            .unwrap_or_default()
            .to_string_lossy();
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
