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
    pub fn new(start: usize, end: usize) -> Self {
        let narrow = |n: usize| u32::try_from(n).unwrap_or(u32::MAX);
        Self {
            start: narrow(start),
            end: narrow(end.max(start)),
        }
    }

    /// Creates an empty range before the byte at `offset`.
    pub fn at(offset: usize) -> Self {
        Self::new(offset, offset)
    }
}

/// The bytes of a file, with its name for messages.
pub struct Source {
    /// The file's path, or what to call it in messages if it has no path.
    pub name: String,
    /// The whole content of the file; empty if it was released.
    pub bytes: Vec<u8>,
    /// Whether the content is not text. Messages then give byte offsets and quote no line.
    pub binary: bool,
    line_starts: OnceLock<Vec<u32>>,
    released: Option<Released>,
}

/// The content of a source that was released.
struct Released {
    /// The number of its bytes.
    len: usize,
    /// The content, after a message has quoted it. It is empty if the file has changed.
    again: OnceLock<Vec<u8>>,
}

impl Source {
    /// Creates a text source.
    pub fn new(name: impl Into<String>, bytes: Vec<u8>) -> Self {
        Self {
            name: name.into(),
            bytes,
            binary: false,
            line_starts: OnceLock::new(),
            released: None,
        }
    }

    /// Returns the source without its bytes, or `None` if they cannot be read again when a message
    /// quotes them: a compressed file, or none at all. Messages do not quote binary sources.
    pub fn released(&self) -> Option<Self> {
        let len = self.bytes.len();
        let file = std::fs::metadata(&self.name).ok();
        let is_on_disk = file.is_some_and(|file| file.is_file() && file.len() == len as u64);
        (self.binary || is_on_disk).then(|| Self {
            binary: self.binary,
            ..Self::on_disk(self.name.clone(), len)
        })
    }

    /// Creates the source of a file of `len` bytes as it is after its release.
    pub fn on_disk(name: impl Into<String>, len: usize) -> Self {
        let again = OnceLock::new();
        Self {
            released: Some(Released { len, again }),
            ..Self::new(name, Vec::new())
        }
    }

    /// Returns the number of bytes of the content.
    pub fn len(&self) -> usize {
        self.released.as_ref().map_or(self.bytes.len(), |r| r.len)
    }

    /// Returns whether the content has no bytes.
    pub fn is_empty(&self) -> bool {
        self.len() == 0
    }

    /// Returns the content, which is read again if it was released. It is empty if the file has
    /// changed since then.
    pub fn text(&self) -> &[u8] {
        let Some(Released { len, again }) = &self.released else {
            return &self.bytes;
        };
        again.get_or_init(|| {
            let bytes = std::fs::read(&self.name).ok();
            bytes.filter(|b| b.len() == *len).unwrap_or_default()
        })
    }

    /// Returns whether messages can quote lines.
    pub(crate) fn is_text(&self) -> bool {
        !self.binary && (self.released.is_none() || !self.text().is_empty())
    }

    /// Marks the bytes as binary, so that messages give offsets instead of lines.
    pub fn into_binary(mut self) -> Self {
        self.binary = true;
        self
    }

    /// Returns the line and column of a byte offset, both counted from 1. CR, LF and CRLF each end
    /// a line. A source that is not text is one line whose column is the offset plus one.
    pub fn line_column(&self, offset: u32) -> (u32, u32) {
        if !self.is_text() {
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
            let bytes = self.text();
            for (i, &b) in bytes.iter().enumerate() {
                let ends = b == b'\n' || (b == b'\r' && bytes.get(i + 1) != Some(&b'\n'));
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
        let end = starts.get(i + 1).map_or(self.text().len(), |&s| s as usize);
        end - starts[i] as usize
    }

    /// Returns the line that contains an offset, and the offset of its first byte. Bytes that are
    /// not printable ASCII become spaces.
    pub(super) fn line_text(&self, offset: u32) -> (String, u32) {
        let starts = self.line_starts();
        let i = starts.partition_point(|&s| s <= offset) - 1;
        let start = starts[i] as usize;
        let end = starts.get(i + 1).map_or(self.text().len(), |&s| s as usize);
        let text = self.text()[start..end].iter().map(|&b| match b {
            b' '..=b'~' => char::from(b),
            _ => ' ',
        });
        (text.collect::<String>().trim_end().to_owned(), start as u32)
    }
}

impl fmt::Debug for Source {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "Source({:?}, {} bytes)", self.name, self.len())
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

    #[test]
    fn a_released_source_is_read_again_unless_its_file_has_changed() {
        let file = std::env::temp_dir().join(format!("ivcam-released-{}.iv", std::process::id()));
        let text = b"Cone {\n  hieght 2\n}\n".to_vec();
        std::fs::write(&file, &text).unwrap();
        let source = Source::new(file.display().to_string(), text);
        let released = || source.released().expect("the file is there");
        let changed = released();
        let quoted = released();
        assert!(quoted.bytes.is_empty());
        assert_eq!(quoted.line_column(9), (2, 3));
        assert_eq!(quoted.line_text(9), source.line_text(9));
        std::fs::write(&file, "Cone { }").unwrap();
        assert!(!changed.is_text());
        assert_eq!(changed.line_column(9), (1, 10));
        assert!(source.released().is_none());
        std::fs::remove_file(&file).unwrap();
        assert!(Source::new("no such file", Vec::new()).released().is_none());
    }
}
