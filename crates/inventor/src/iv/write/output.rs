//! The bytes of a file on their way to a destination. A large file is never in memory whole.

use std::fmt;
use std::io::{self, Write};

/// The number of bytes that wait before they go to the destination.
const FULL: usize = 1 << 16;

/// What a writer puts out. Errors of the destination are kept until [`PieceWriter::finish`].
pub(super) struct PieceWriter<'w> {
    waiting: Vec<u8>,
    /// The destination, or `None` to discard everything.
    to: Option<&'w mut dyn Write>,
    result: io::Result<()>,
}

impl<'w> PieceWriter<'w> {
    pub(super) fn to(to: &'w mut dyn Write) -> Self {
        Self {
            to: Some(to),
            ..Self::discarded()
        }
    }

    pub(super) fn discarded() -> Self {
        Self {
            waiting: Vec::new(),
            to: None,
            result: Ok(()),
        }
    }

    #[inline]
    pub(super) fn push_bytes(&mut self, bytes: &[u8]) {
        self.waiting.extend_from_slice(bytes);
        if self.waiting.len() >= FULL {
            self.drain();
        }
    }

    #[inline]
    pub(super) fn push_str(&mut self, text: &str) {
        self.push_bytes(text.as_bytes());
    }

    /// Appends `levels` levels of indentation.
    pub(super) fn indent(&mut self, levels: usize) {
        (0..levels).for_each(|_| self.push_str("  "));
    }

    fn drain(&mut self) {
        if let (Some(to), Ok(())) = (&mut self.to, &self.result) {
            self.result = to.write_all(&self.waiting);
        }
        self.waiting.clear();
    }

    /// Writes what waits.
    ///
    /// # Errors
    /// Returns the first error of the destination.
    pub(super) fn finish(mut self) -> io::Result<()> {
        self.drain();
        self.result
    }
}

impl fmt::Write for PieceWriter<'_> {
    fn write_str(&mut self, text: &str) -> fmt::Result {
        self.push_str(text);
        Ok(())
    }
}
