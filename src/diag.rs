//! Where something is, and what to say about it.
//!
//! A wrong file is a [`Diagnostic`]: what, where, and what to do next. Messages are lower case,
//! without a full stop, names in backticks. Nothing here prints; [`Diagnostic::render`] makes the
//! text and the caller decides where it goes.

use std::collections::HashMap;
use std::fmt;
use std::sync::{Arc, OnceLock};

use annotate_snippets::{AnnotationKind, Level, Renderer, Snippet};

/// The error of every fallible call in this crate: one message with its place.
pub type Result<T> = std::result::Result<T, Box<Diagnostic>>;

/// A range of bytes in a [`Source`].
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Hash)]
pub struct Span {
    pub start: u32,
    pub end: u32,
}

impl Span {
    /// The bytes `start..end`; offsets past 4 GiB saturate.
    pub fn new(start: usize, end: usize) -> Self {
        let narrow = |n: usize| u32::try_from(n).unwrap_or(u32::MAX);
        Self {
            start: narrow(start),
            end: narrow(end.max(start)),
        }
    }

    /// A span of no length, between two bytes.
    pub fn at(offset: usize) -> Self {
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
    pub fn new(name: impl Into<String>, bytes: Vec<u8>) -> Self {
        Self {
            name: name.into(),
            bytes,
            binary: false,
            line_starts: OnceLock::new(),
        }
    }

    /// Marks the bytes as binary, so that messages give offsets instead of lines.
    pub fn into_binary(mut self) -> Self {
        self.binary = true;
        self
    }

    /// Line and column of a byte offset, both counted from 1. CR, LF and CRLF each end a line.
    /// A binary source is one line whose column is the offset plus one.
    pub fn line_column(&self, offset: u32) -> (u32, u32) {
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
    fn line_length(&self, offset: u32) -> usize {
        let starts = self.line_starts();
        let i = starts.partition_point(|&s| s <= offset) - 1;
        let end = starts.get(i + 1).map_or(self.bytes.len(), |&s| s as usize);
        end - starts[i] as usize
    }

    /// The line around an offset, as text that is safe to show, with the offset of its first byte.
    fn line_text(&self, offset: u32) -> (String, u32) {
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

/// Longer lines are not quoted: a whole scene can stand on one.
const LONGEST_LINE: usize = 400;

impl fmt::Debug for Source {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "Source({:?}, {} bytes)", self.name, self.bytes.len())
    }
}

/// How bad it is. An `Error` ends what was asked for; a `Warning` does not.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub enum Severity {
    Note,
    Warning,
    Error,
}

impl Severity {
    pub fn name(self) -> &'static str {
        match self {
            Self::Note => "note",
            Self::Warning => "warning",
            Self::Error => "error",
        }
    }
}

/// One message: what, where, and what to do next.
#[derive(Clone, Debug)]
pub struct Diagnostic {
    pub severity: Severity,
    pub message: String,
    pub help: Option<String>,
    pub place: Option<(Arc<Source>, Span)>,
    /// The file it is about, where there is no source to quote.
    pub file: Option<String>,
    /// How often the same was said; the place is the first.
    pub count: usize,
}

impl Diagnostic {
    fn new(severity: Severity, message: impl Into<String>) -> Self {
        Self {
            severity,
            message: message.into(),
            help: None,
            place: None,
            file: None,
            count: 1,
        }
    }

    pub fn error(message: impl Into<String>) -> Box<Self> {
        Box::new(Self::new(Severity::Error, message))
    }

    pub fn warning(message: impl Into<String>) -> Box<Self> {
        Box::new(Self::new(Severity::Warning, message))
    }

    /// An I/O error on a named file.
    pub fn io(file: impl fmt::Display, error: &std::io::Error) -> Box<Self> {
        Self::error(format!("`{file}`: {}", io_words(error))).in_file(file.to_string())
    }

    pub fn at(mut self: Box<Self>, source: &Arc<Source>, span: Span) -> Box<Self> {
        self.place = Some((source.clone(), span));
        self
    }

    pub fn in_file(mut self: Box<Self>, file: impl Into<String>) -> Box<Self> {
        self.file = Some(file.into());
        self
    }

    pub fn with_help(mut self: Box<Self>, help: impl Into<String>) -> Box<Self> {
        self.help = Some(help.into());
        self
    }

    /// Adds what to do next, on a message just put into a [`Sink`].
    pub fn help(&mut self, help: impl Into<String>) -> &mut Self {
        if self.help.is_none() {
            self.help = Some(help.into());
        }
        self
    }

    /// File, line and column (from 1), as far as they are known.
    pub fn location(&self) -> (Option<&str>, Option<(u32, u32)>) {
        match &self.place {
            Some((source, span)) => (Some(&source.name), Some(source.line_column(span.start))),
            None => (self.file.as_deref(), None),
        }
    }

    /// The message as a compiler would print it: file, line, column, the line itself, a caret.
    pub fn render(&self, color: bool) -> String {
        let level = match self.severity {
            Severity::Error => Level::ERROR,
            Severity::Warning => Level::WARNING,
            Severity::Note => Level::NOTE,
        };
        let mut message = self.message.clone();
        if self.count > 1 {
            message += &format!(" ({} times; the first is shown)", self.count);
        }
        if let (None, Some(file)) = (&self.place, &self.file)
            && !message.contains(file.as_str())
        {
            message = format!("{file}: {message}");
        }
        let mut group = None;
        let line;
        if let Some((source, span)) = &self.place {
            let (row, column) = source.line_column(span.start);
            if source.binary {
                message = format!("{}: byte {}: {message}", source.name, span.start);
            } else if source.line_length(span.start) > LONGEST_LINE {
                message = format!("{}:{row}:{column}: {message}", source.name);
            } else {
                let (text, start) = source.line_text(span.start);
                line = text;
                let from = ((span.start - start) as usize).min(line.len());
                let to = ((span.end.max(span.start + 1) - start) as usize).clamp(from, line.len());
                group = Some(
                    Snippet::source(line.as_str())
                        .path(source.name.as_str())
                        .line_start(row as usize)
                        .annotation(AnnotationKind::Primary.span(from..to)),
                );
            }
        }
        let mut report = level.primary_title(message.as_str()).elements(group);
        if let Some(help) = &self.help {
            report = report.element(Level::HELP.message(help.as_str()));
        }
        let renderer = if color {
            Renderer::styled()
        } else {
            Renderer::plain()
        };
        renderer.render(&[report]).to_string()
    }
}

impl fmt::Display for Diagnostic {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self.location() {
            (Some(file), Some((line, column))) => write!(f, "{file}:{line}:{column}: ")?,
            (Some(file), None) if !self.message.contains(file) => write!(f, "{file}: ")?,
            _ => {}
        }
        write!(f, "{}: {}", self.severity.name(), self.message)
    }
}

impl std::error::Error for Diagnostic {}

/// What an I/O error is, without the operating system's number.
fn io_words(error: &std::io::Error) -> String {
    use std::io::ErrorKind;
    match error.kind() {
        ErrorKind::NotFound => "no such file or folder".into(),
        ErrorKind::PermissionDenied => "permission denied".into(),
        ErrorKind::IsADirectory => "is a folder, not a file".into(),
        ErrorKind::StorageFull => "no room left on the disk".into(),
        _ => error.to_string(),
    }
}

/// Collects diagnostics. The same mistake a thousand times is one message with a count.
#[derive(Clone, Debug, Default)]
pub struct Sink {
    items: Vec<Diagnostic>,
    seen: HashMap<(Severity, String), usize>,
    source: Option<Arc<Source>>,
}

impl Sink {
    pub fn new() -> Self {
        Self::default()
    }

    /// Spans given from now on are in this source. Returns the one before, to be put back.
    pub fn set_source(&mut self, source: Option<Arc<Source>>) -> Option<Arc<Source>> {
        std::mem::replace(&mut self.source, source)
    }

    pub fn warn(&mut self, span: Span, message: impl Into<String>) -> &mut Diagnostic {
        let place = self.source.clone().map(|s| (s, span));
        self.add(Diagnostic {
            place,
            ..Diagnostic::new(Severity::Warning, message)
        })
    }

    pub fn note(&mut self, span: Span, message: impl Into<String>) -> &mut Diagnostic {
        let place = self.source.clone().map(|s| (s, span));
        self.add(Diagnostic {
            place,
            ..Diagnostic::new(Severity::Note, message)
        })
    }

    /// Adds one, or counts it where the same message was said before.
    pub fn add(&mut self, diagnostic: Diagnostic) -> &mut Diagnostic {
        let key = (diagnostic.severity, diagnostic.message.clone());
        let next = self.items.len();
        let index = *self.seen.entry(key).or_insert(next);
        if index == next {
            self.items.push(diagnostic);
        } else {
            self.items[index].count += diagnostic.count;
        }
        &mut self.items[index]
    }

    /// An error made for the current source, to be returned.
    pub fn error(&self, span: Span, message: impl Into<String>) -> Box<Diagnostic> {
        let error = Diagnostic::error(message);
        match &self.source {
            Some(source) => error.at(source, span),
            None => error,
        }
    }

    pub fn items(&self) -> &[Diagnostic] {
        &self.items
    }

    /// Adds everything that another sink has.
    pub fn extend_from(&mut self, other: &Sink) {
        for item in &other.items {
            self.add(item.clone());
        }
    }
}

/// The candidate nearest in spelling, for "did you mean", if any is near enough.
pub fn nearest<'a>(word: &str, candidates: impl IntoIterator<Item = &'a str>) -> Option<&'a str> {
    let limit = 1 + word.len() / 4;
    candidates
        .into_iter()
        .map(|c| (edit_distance(&word.to_lowercase(), &c.to_lowercase()), c))
        .filter(|(d, _)| *d <= limit)
        .min_by_key(|(d, _)| *d)
        .map(|(_, c)| c)
}

/// Levenshtein's distance, by one row.
fn edit_distance(a: &str, b: &str) -> usize {
    let b: Vec<char> = b.chars().collect();
    let mut row: Vec<usize> = (0..=b.len()).collect();
    for (i, x) in a.chars().enumerate() {
        let mut diagonal = row[0];
        row[0] = i + 1;
        for (j, y) in b.iter().enumerate() {
            let cost = diagonal + usize::from(x != *y);
            diagonal = row[j + 1];
            row[j + 1] = cost.min(diagonal + 1).min(row[j] + 1);
        }
    }
    row[b.len()]
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
    fn the_same_message_twice_is_one_with_a_count() {
        let mut sink = Sink::new();
        sink.warn(Span::at(0), "odd");
        sink.warn(Span::at(9), "odd");
        assert_eq!((sink.items().len(), sink.items()[0].count), (1, 2));
    }

    #[test]
    fn a_message_shows_its_line_with_a_caret() {
        let source = Arc::new(Source::new("a.iv", b"Cone {\n  hieght 2\n}\n".to_vec()));
        let text = Diagnostic::error("`Cone` has no field `hieght`")
            .at(&source, Span::new(9, 15))
            .with_help("did you mean `height`?")
            .render(false);
        for part in ["a.iv:2:3", "hieght 2", "^^^^^^", "did you mean"] {
            assert!(text.contains(part), "{part} missing in\n{text}");
        }
    }

    #[test]
    fn the_nearest_word_is_found_and_a_far_one_is_not() {
        assert_eq!(
            nearest("hieght", ["height", "bottomRadius"]),
            Some("height")
        );
        assert_eq!(nearest("colour", ["shininess"]), None);
    }
}
