//! One message with its severity, its place, and what to do next.

use std::fmt;
use std::sync::Arc;

use annotate_snippets::{AnnotationKind, Level, Renderer, Snippet};

use super::source::{Source, Span};

/// The error of every fallible call in this crate: one message with its place.
pub type Result<T> = std::result::Result<T, Box<Diagnostic>>;

/// Longer lines are not quoted: a whole scene can stand on one.
const LONGEST_LINE: usize = 400;

/// How bad it is. An `Error` ends what was asked for; a `Warning` does not.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub enum Severity {
    Note,
    Warning,
    Error,
}

impl Severity {
    pub(crate) fn name(self) -> &'static str {
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
    pub(super) fn new(severity: Severity, message: impl Into<String>) -> Self {
        Self {
            severity,
            message: message.into(),
            help: None,
            place: None,
            file: None,
            count: 1,
        }
    }

    pub(crate) fn error(message: impl Into<String>) -> Box<Self> {
        Box::new(Self::new(Severity::Error, message))
    }

    pub(crate) fn warning(message: impl Into<String>) -> Box<Self> {
        Box::new(Self::new(Severity::Warning, message))
    }

    /// An I/O error on a named file.
    pub(crate) fn io(file: impl fmt::Display, error: &std::io::Error) -> Box<Self> {
        Self::error(format!("`{file}`: {}", io_words(error))).in_file(file.to_string())
    }

    pub(crate) fn at(mut self: Box<Self>, source: &Arc<Source>, span: Span) -> Box<Self> {
        self.place = Some((source.clone(), span));
        self
    }

    pub(crate) fn in_file(mut self: Box<Self>, file: impl Into<String>) -> Box<Self> {
        self.file = Some(file.into());
        self
    }

    pub(crate) fn with_help(mut self: Box<Self>, help: impl Into<String>) -> Box<Self> {
        self.help = Some(help.into());
        self
    }

    /// Adds what to do next, on a message just put into a [`Sink`].
    pub(crate) fn help(&mut self, help: impl Into<String>) -> &mut Self {
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
}
