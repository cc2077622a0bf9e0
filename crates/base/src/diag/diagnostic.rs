//! One message: its severity, its location, and what the user can do about it.

use std::fmt;
use std::sync::Arc;

use annotate_snippets::{AnnotationKind, Level, Renderer, Snippet};

use super::source::{Source, Span};

/// The result of every fallible function in this crate. The error is one message with its location.
pub type Result<T> = std::result::Result<T, Box<Diagnostic>>;

/// The longest source line that a message quotes, in bytes. A scene file can consist of one line,
/// and quoting it would bury the message. The value was chosen as about five lines of a terminal.
const LONGEST_LINE: usize = 400;

/// How severe a message is.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub enum Severity {
    /// The message only informs; nothing is wrong.
    Note,
    /// Something is wrong, and the program continues with a substitute or without it.
    Warning,
    /// The operation failed.
    Error,
}

impl Severity {
    /// Returns the severity as the word that starts a message.
    pub(crate) fn name(self) -> &'static str {
        match self {
            Self::Note => "note",
            Self::Warning => "warning",
            Self::Error => "error",
        }
    }
}

/// What went wrong, for programs that react to it.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
#[non_exhaustive]
pub enum ErrorKind {
    /// A named thing does not exist: a file, a lens, a film, a glass, a node class.
    NotFound,
    /// The operating system could not read or write.
    Io,
    /// The text or bytes of a file cannot be read, or cannot be used as they are.
    Syntax,
    /// A file is damaged: it is cut off, its first line is wrong, or a part of it cannot be read.
    Damaged,
    /// A scene names a file outside the folders that may be read.
    OutsideFolder,
    /// A limit on size, memory or count was passed.
    Limit,
    /// The input is valid, but this crate does not do what it asks for.
    Unsupported,
    /// An option or an argument is out of range, or contradicts another.
    InvalidArgument,
    /// A lens cannot focus at the distance.
    CannotFocus,
}

/// One message: what is wrong, where, and what the user can do about it.
///
/// `{}` is one line. `{:?}` adds the help, so that `fn main() -> Result<()>` ends with a message
/// for people.
#[derive(Clone)]
#[non_exhaustive]
pub struct Diagnostic {
    /// What went wrong, for programs.
    pub kind: ErrorKind,
    /// How severe the message is.
    pub severity: Severity,
    /// What is wrong, in lower case and without a full stop.
    pub message: String,
    /// What the user can do about it.
    pub help: Option<String>,
    /// The source and the range of bytes in it that the message is about.
    pub place: Option<(Arc<Source>, Span)>,
    /// The name of the file that the message is about, if there is no source to quote.
    pub file: Option<String>,
    /// The number of times that this message was reported. `place` is that of the first report.
    pub count: usize,
    /// The error of the operating system that caused this one.
    pub(super) cause: Option<Arc<std::io::Error>>,
}

impl Diagnostic {
    /// Creates a message without a location.
    pub(super) fn new(severity: Severity, message: impl Into<String>) -> Self {
        Self {
            kind: ErrorKind::InvalidArgument,
            severity,
            message: message.into(),
            help: None,
            place: None,
            file: None,
            count: 1,
            cause: None,
        }
    }

    /// Creates an error without a location.
    pub fn error(message: impl Into<String>) -> Box<Self> {
        Box::new(Self::new(Severity::Error, message))
    }

    /// Creates a note without a location.
    pub fn note(message: impl Into<String>) -> Box<Self> {
        Box::new(Self::new(Severity::Note, message))
    }

    /// Creates a warning without a location.
    pub fn warning(message: impl Into<String>) -> Box<Self> {
        Box::new(Self::new(Severity::Warning, message))
    }

    /// Creates an error of the kind [`ErrorKind::NotFound`].
    pub fn not_found(message: impl Into<String>) -> Box<Self> {
        Self::error(message).of_kind(ErrorKind::NotFound)
    }

    /// Creates an error of the kind [`ErrorKind::Limit`].
    pub fn beyond_limit(message: impl Into<String>) -> Box<Self> {
        Self::error(message).of_kind(ErrorKind::Limit)
    }

    /// Creates an error of the kind [`ErrorKind::Unsupported`].
    pub fn unsupported(message: impl Into<String>) -> Box<Self> {
        Self::error(message).of_kind(ErrorKind::Unsupported)
    }

    /// Returns the word for the class of the message: `error`, `damaged`, `warning` or `note`.
    /// A warning of the kind [`ErrorKind::Damaged`] is `damaged`.
    pub fn class(&self) -> &'static str {
        match (self.severity, self.kind) {
            (Severity::Warning, ErrorKind::Damaged) => "damaged",
            (severity, _) => severity.name(),
        }
    }

    /// Orders messages by severity. Damage lies between a warning and an error.
    pub fn rank(&self) -> (Severity, bool) {
        (self.severity, self.kind == ErrorKind::Damaged)
    }

    /// Creates an error that reports an I/O error on a named file.
    pub fn io(file: impl fmt::Display, error: &std::io::Error) -> Box<Self> {
        let kind = match error.kind() {
            std::io::ErrorKind::NotFound => ErrorKind::NotFound,
            _ => ErrorKind::Io,
        };
        let mut this = Self::error(format!("`{file}`: {}", describe_io(error)))
            .in_file(file.to_string())
            .of_kind(kind);
        this.cause = Some(Arc::new(copy_of(error)));
        this
    }

    /// Sets the kind.
    pub fn of_kind(mut self: Box<Self>, kind: ErrorKind) -> Box<Self> {
        self.kind = kind;
        self
    }

    /// Lowers the severity to `severity`, for an operation that goes on in spite of the message.
    pub fn at_most(mut self: Box<Self>, severity: Severity) -> Box<Self> {
        self.severity = self.severity.min(severity);
        self
    }

    /// Sets the source and the range of bytes that the message is about. The kind becomes
    /// [`ErrorKind::Syntax`], unless it is set.
    pub fn at(mut self: Box<Self>, source: &Arc<Source>, span: Span) -> Box<Self> {
        if self.kind == ErrorKind::InvalidArgument {
            self.kind = ErrorKind::Syntax;
        }
        self.place = Some((source.clone(), span));
        self
    }

    /// Sets the name of the file that the message is about.
    pub fn in_file(mut self: Box<Self>, file: impl Into<String>) -> Box<Self> {
        self.file = Some(file.into());
        self
    }

    /// Sets the text that tells the user what to do.
    pub fn with_help(mut self: Box<Self>, help: impl Into<String>) -> Box<Self> {
        self.help = Some(help.into());
        self
    }

    /// Sets the help of a message that is already in a [`Sink`](super::Sink). A help that the
    /// message already has stays.
    pub fn help(&mut self, help: impl Into<String>) -> &mut Self {
        if self.help.is_none() {
            self.help = Some(help.into());
        }
        self
    }

    /// Returns the file name, and the line and column (counted from 1), as far as they are known.
    /// A place in a file that is not text has a [`byte`](Self::byte) instead.
    pub fn location(&self) -> (Option<&str>, Option<(u32, u32)>) {
        match &self.place {
            Some((source, span)) => (
                Some(&source.name),
                source.is_text().then(|| source.line_column(span.start)),
            ),
            None => (self.file.as_deref(), None),
        }
    }

    /// Returns the offset of the place in a file that is not text, in bytes, as the file is after
    /// unpacking.
    pub fn byte(&self) -> Option<u32> {
        let (source, span) = self.place.as_ref()?;
        (!source.is_text()).then_some(span.start)
    }

    /// Formats the message for a line that begins with the name of `file`, which it does not
    /// repeat.
    pub fn in_line_of(&self, file: &str) -> String {
        let (own, place) = self.location();
        if own.is_some_and(|own| own != file) {
            return self.to_string();
        }
        let named = format!("`{file}`");
        let message = self.message.strip_prefix(&format!("{named}: "));
        let what = message.unwrap_or(&self.message).replace(&named, "this");
        let kind = self.class();
        match (place, self.byte()) {
            (Some((line, column)), _) => format!("line {line}, column {column}: {kind}: {what}"),
            (None, Some(byte)) => format!("byte {byte}: {kind}: {what}"),
            (None, None) => format!("{kind}: {what}"),
        }
    }

    /// Formats the message as a compiler would print it: file, line, column, the source line, and
    /// a caret below the range. `color` adds terminal escape sequences.
    pub fn render(&self, color: bool) -> String {
        let level = match self.severity {
            Severity::Error => Level::ERROR,
            Severity::Warning => Level::WARNING.with_name(self.class()),
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
            if !source.is_text() {
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

impl Diagnostic {
    /// Writes the place in front of a message, as far as it is known.
    fn write_place(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match (self.location(), self.byte()) {
            ((Some(file), Some((line, column))), _) => write!(f, "{file}:{line}:{column}: "),
            ((Some(file), None), Some(byte)) => write!(f, "{file}: byte {byte}: "),
            ((Some(file), None), None) if !self.message.contains(file) => write!(f, "{file}: "),
            _ => Ok(()),
        }
    }
}

impl fmt::Display for Diagnostic {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        self.write_place(f)?;
        write!(f, "{}: {}", self.class(), self.message)
    }
}

impl fmt::Debug for Diagnostic {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        self.write_place(f)?;
        f.write_str(&self.message)?;
        match &self.help {
            Some(help) => write!(f, "\n  help: {help}"),
            None => Ok(()),
        }
    }
}

impl std::error::Error for Diagnostic {
    fn source(&self) -> Option<&(dyn std::error::Error + 'static)> {
        let cause = self.cause.as_deref()?;
        Some(cause)
    }
}

/// Returns an I/O error like another one.
fn copy_of(error: &std::io::Error) -> std::io::Error {
    match error.raw_os_error() {
        Some(code) => std::io::Error::from_raw_os_error(code),
        None => std::io::Error::new(error.kind(), error.to_string()),
    }
}

/// Describes an I/O error without the operating system's error number.
fn describe_io(error: &std::io::Error) -> String {
    use std::io::ErrorKind;
    match error.kind() {
        ErrorKind::NotFound => "no such file or folder".into(),
        ErrorKind::PermissionDenied => "permission denied".into(),
        ErrorKind::IsADirectory => "is a folder, not a file".into(),
        ErrorKind::StorageFull => "no room left on the disk".into(),
        _ => error.to_string(),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

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
    fn a_place_in_a_binary_file_is_a_byte_everywhere() {
        let source = Arc::new(Source::new("a.iv", vec![0; 20]).into_binary());
        let damage = Diagnostic::warning("`a.iv` ends").of_kind(ErrorKind::Damaged);
        let damage = damage.at(&source, Span::at(12));
        assert_eq!(
            (damage.location(), damage.byte()),
            ((Some("a.iv"), None), Some(12))
        );
        assert!(damage.render(false).contains("a.iv: byte 12: `a.iv` ends"));
        assert_eq!(damage.to_string(), "a.iv: byte 12: damaged: `a.iv` ends");
        assert_eq!(damage.in_line_of("a.iv"), "byte 12: damaged: this ends");
        assert_eq!(damage.in_line_of("b.iv"), damage.to_string());
        let denied = Diagnostic::io("a.iv", &std::io::ErrorKind::PermissionDenied.into());
        assert_eq!(denied.in_line_of("a.iv"), "error: permission denied");
    }

    #[test]
    fn an_error_of_the_operating_system_is_the_source_and_debug_output_is_for_people() {
        use std::error::Error;
        let missing = std::fs::read("no/such/file").unwrap_err();
        let error = Diagnostic::io("no/such/file", &missing).with_help("look elsewhere");
        let source = error.source().expect("a source");
        let io = source
            .downcast_ref::<std::io::Error>()
            .expect("an I/O error");
        assert_eq!(io.raw_os_error(), missing.raw_os_error());
        let text = "`no/such/file`: no such file or folder\n  help: look elsewhere";
        assert_eq!(format!("{error:?}"), text);
        assert!(Diagnostic::error("a").source().is_none());
    }
}
