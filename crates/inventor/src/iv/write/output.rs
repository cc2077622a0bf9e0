//! The bytes of a file on their way to a destination. A large file is never in memory whole.

use std::fmt;
use std::io::{self, BufWriter, Write};

/// The number of bytes that wait before they go to the destination.
const PIECE: usize = 1 << 16;

/// What a writer puts out. Errors of the destination are kept until [`PieceWriter::finish`].
pub(super) struct PieceWriter<'w> {
    to: BufWriter<&'w mut dyn Write>,
    result: io::Result<()>,
}

impl<'w> PieceWriter<'w> {
    pub(super) fn to(to: &'w mut dyn Write) -> Self {
        Self {
            to: BufWriter::with_capacity(PIECE, to),
            result: Ok(()),
        }
    }

    #[inline]
    pub(super) fn push_bytes(&mut self, bytes: &[u8]) {
        if self.result.is_ok() {
            self.result = self.to.write_all(bytes);
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

    /// Writes what waits.
    ///
    /// # Errors
    /// Returns the first error of the destination.
    pub(super) fn finish(mut self) -> io::Result<()> {
        self.result?;
        self.to.flush()
    }
}

impl fmt::Write for PieceWriter<'_> {
    fn write_str(&mut self, text: &str) -> fmt::Result {
        self.push_str(text);
        Ok(())
    }
}
