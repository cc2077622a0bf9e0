//! Files whose bytes the system shows without a copy.
#![allow(unsafe_code)]

use std::fs::File;
use std::io;
use std::ops::Deref;
use std::ptr::{NonNull, null_mut};

use rustix::mm::{Advice, MapFlags, ProtFlags, madvise, mmap, munmap};

/// The bytes of a file, which the system reads at their first access. If another program shortens
/// the file at the same time, the system ends this one, as with every mapped file.
#[derive(Debug)]
pub struct MappedFile {
    start: NonNull<u8>,
    len: usize,
}

impl MappedFile {
    /// Maps the first `len` bytes of a file, which must be more than none.
    pub(super) fn new(file: &File, len: usize) -> io::Result<Self> {
        // SAFETY: the system chooses a place for the mapping that nothing else uses.
        let start = unsafe { mmap(null_mut(), len, ProtFlags::READ, MapFlags::PRIVATE, file, 0) }?;
        let start = NonNull::new(start.cast()).ok_or(io::ErrorKind::InvalidInput)?;
        Ok(Self { start, len })
    }

    /// Gives the memory of the bytes before an offset back to the system. They stay readable: the
    /// system reads them again.
    pub fn release_before(&self, offset: usize) {
        let (start, len) = (self.start.as_ptr().cast(), offset.min(self.len));
        // SAFETY: the range lies within the mapping, which nothing writes to, so that its bytes are
        // those of the file before and after.
        let _ = unsafe { madvise(start, len, Advice::LinuxDontNeed) };
    }
}

impl Deref for MappedFile {
    type Target = [u8];

    fn deref(&self) -> &[u8] {
        // SAFETY: the mapping has so many bytes, which may be read as long as it exists.
        unsafe { std::slice::from_raw_parts(self.start.as_ptr(), self.len) }
    }
}

impl Drop for MappedFile {
    fn drop(&mut self) {
        // SAFETY: the mapping is this value's own, and no slice of it is left.
        let _ = unsafe { munmap(self.start.as_ptr().cast(), self.len) };
    }
}
