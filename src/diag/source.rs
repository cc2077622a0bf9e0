//! The bytes of a file, and locations in them.

use std::fmt;
use std::sync::OnceLock;

/// A range of bytes in a [`Source`].
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Hash)]
pub struct Span {
    /// The offset of the first byte.
    pub start: u32,
    /// The offset after the last byte.
    pub end: u32,
}

impl Span {
    /// Creates the range `start..end`. Offsets above 4 GiB saturate.
    pub(crate) fn new(start: usize, end: usize) -> Self {
        let narrow = |n: usize| u32::try_from(n).unwrap_or(u32::MAX);
        Self {
            start: narrow(start),
            end: narrow(end.max(start)),
        }
    }

    /// Creates an empty range before the byte at `offset`.
    pub(crate) fn at(offset: usize) -> Self {
        Self::new(offset, offset)
    }
}

/// The bytes of a file, with its name for messages.
pub struct Source {
    /// The file's path, or what to call it in messages if it has no path.
    pub name: String,
    /// The whole content of the file.
    pub bytes: Vec<u8>,
    /// Whether the content is not text. Messages then give byte offsets and quote no line.
    pub binary: bool,
    line_starts: OnceLock<Vec<u32>>,
}

impl Source {
    /// Creates a text source.
    pub(crate) fn new(name: impl Into<String>, bytes: Vec<u8>) -> Self {
        Self {
            name: name.into(),
            bytes,
            binary: false,
            line_starts: OnceLock::new(),
        }
    }

    /// Marks the bytes as binary, so that messages give offsets instead of lines.
    pub(crate) fn into_binary(mut self) -> Self {
        self.binary = true;
        self
    }

    /// Returns the line and column of a byte offset, both counted from 1. CR, LF and CRLF each end
    /// a line. A binary source is one line whose column is the offset plus one.
    pub fn line_column(&self, offset: u32) -> (u32, u32) {
        if self.binary {
            return (1, offset + 1);
        }
        let starts = self.line_starts();
        let line = starts.partition_point(|&s| s <= offset) - 1;
        (line as u32 + 1, offset - starts[line] + 1)
    }

    /// Returns the offsets of the first bytes of all lines.
    fn line_starts(&self) -> &[u32] {
        self.line_starts.get_or_init(|| {
            let mut starts = vec![0];
            for (i, &b) in self.bytes.iter().enumerate() {
                let ends = b == b'\n' || (b == b'\r' && self.bytes.get(i + 1) != Some(&b'\n'));
                if ends {
                    starts.push(i as u32 + 1);
                }
            }
            starts
        })
    }

    /// Returns the number of bytes of the line that contains an offset, including its line ending.
    pub(super) fn line_length(&self, offset: u32) -> usize {
        let starts = self.line_starts();
        let i = starts.partition_point(|&s| s <= offset) - 1;
        let end = starts.get(i + 1).map_or(self.bytes.len(), |&s| s as usize);
        end - starts[i] as usize
    }

    /// Returns the line that contains an offset, and the offset of its first byte. Bytes that are
    /// not printable ASCII become spaces.
    pub(super) fn line_text(&self, offset: u32) -> (String, u32) {
        let starts = self.line_starts();
        let i = starts.partition_point(|&s| s <= offset) - 1;
        let start = starts[i] as usize;
        let end = starts.get(i + 1).map_or(self.bytes.len(), |&s| s as usize);
        let text = self.bytes[start..end].iter().map(|&b| match b {
            b' '..=b'~' => char::from(b),
            _ => ' ',
        });
        (text.collect::<String>().trim_end().to_owned(), start as u32)
    }
}

impl fmt::Debug for Source {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "Source({:?}, {} bytes)", self.name, self.bytes.len())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn lines_end_at_cr_lf_and_crlf() {
        let source = Source::new("x", b"a\rb\r\nc\nd".to_vec());
        let places: Vec<_> = [0, 2, 5, 7]
            .iter()
            .map(|&o| source.line_column(o))
            .collect();
        assert_eq!(places, [(1, 1), (2, 1), (3, 1), (4, 1)]);
    }
}
