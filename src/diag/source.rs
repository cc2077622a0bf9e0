//! Files as they were read, and places in them.

use std::fmt;
use std::sync::OnceLock;

/// A range of bytes in a [`Source`].
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Hash)]
pub struct Span {
    pub start: u32,
    pub end: u32,
}

impl Span {
    /// The bytes `start..end`; offsets past 4 GiB saturate.
    pub(crate) fn new(start: usize, end: usize) -> Self {
        let narrow = |n: usize| u32::try_from(n).unwrap_or(u32::MAX);
        Self {
            start: narrow(start),
            end: narrow(end.max(start)),
        }
    }

    /// A span of no length, between two bytes.
    pub(crate) fn at(offset: usize) -> Self {
        Self::new(offset, offset)
    }
}

/// A file as it was read, with a name for messages.
pub struct Source {
    pub name: String,
    pub bytes: Vec<u8>,
    /// Not text: places are byte offsets, and no line is quoted.
    pub binary: bool,
    line_starts: OnceLock<Vec<u32>>,
}

impl Source {
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

    /// Line and column of a byte offset, both counted from 1. CR, LF and CRLF each end a line.
    /// A binary source is one line whose column is the offset plus one.
    pub(crate) fn line_column(&self, offset: u32) -> (u32, u32) {
        if self.binary {
            return (1, offset + 1);
        }
        let starts = self.line_starts();
        let line = starts.partition_point(|&s| s <= offset) - 1;
        (line as u32 + 1, offset - starts[line] + 1)
    }

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

    /// How many bytes the line around an offset has, its end included.
    pub(super) fn line_length(&self, offset: u32) -> usize {
        let starts = self.line_starts();
        let i = starts.partition_point(|&s| s <= offset) - 1;
        let end = starts.get(i + 1).map_or(self.bytes.len(), |&s| s as usize);
        end - starts[i] as usize
    }

    /// The line around an offset, as text that is safe to show, with the offset of its first byte.
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
