//! The error of the parsers of scene files: a location and a problem.

use ivcam_base::diag::ErrorKind;
use nom::Err as NomErr;
use nom::error::{ErrorKind as NomKind, ParseError};
use nom::{IResult, Parser};

use super::enum_names::EnumNames;
use crate::iv::encoding::text;

/// The error of a parser. Creating one allocates no memory, except for an unknown name.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct SyntaxError<'a> {
    /// The suffix of the source that begins at the mistake.
    pub at: &'a [u8],
    /// The mistake.
    pub problem: Problem,
}

/// The mistakes that parsers find.
#[derive(Clone, Debug, PartialEq)]
pub(super) enum Problem {
    /// The source has something else in place of this.
    Expected(&'static str),
    /// The file ends inside a string.
    UnclosedString,
    /// An integer does not fit in 32 bits.
    MoreThan32Bits,
    /// An enumeration or a bit mask does not have this name.
    UnknownName(Box<str>, EnumNames),
    /// The pixels of an image have this many components, which is more than four.
    TooManyComponents(u32),
    /// An image of this width and height is longer than the rest of the file.
    ImageTooLarge(u32, u32),
    /// A binary file ends inside a number.
    CutOff,
    /// A binary file declares `promised` bytes, but only `left` bytes remain.
    MissingBytes { promised: usize, left: usize },
    /// A binary file declares this many values, which is more than the rest of the file can
    /// contain.
    MissingValues(usize),
    /// A parser of the nom library failed, and no parser of this crate replaced its error.
    Other(NomKind),
}

impl SyntaxError<'_> {
    /// Returns the kind of the message. An unknown name in an enumeration does
    /// not mean that the file is damaged.
    pub(super) fn kind(&self) -> ErrorKind {
        match self.problem {
            Problem::UnknownName(..) => ErrorKind::Syntax,
            _ => ErrorKind::Damaged,
        }
    }

    /// Returns the message for the user.
    pub(super) fn message(&self) -> String {
        match &self.problem {
            Problem::Expected(what) => expected(what, self.at),
            Problem::UnclosedString => "this string has no closing quote".into(),
            Problem::MoreThan32Bits => "this number needs more than 32 bits".into(),
            Problem::UnknownName(name, names) => names.unknown(name),
            Problem::TooManyComponents(n) => format!("a pixel has 0 to 4 components, not {n}"),
            Problem::ImageTooLarge(width, height) => format!(
                "an image of {}x{} pixels does not fit in the rest of the file",
                width.cast_signed(),
                height.cast_signed()
            ),
            Problem::CutOff => "the file ends in the middle of a value".into(),
            Problem::MissingBytes { promised, left } => {
                format!("{promised} bytes are declared, but only {left} remain")
            }
            Problem::MissingValues(promised) => {
                format!("{promised} values are declared, which do not fit in the rest of the file")
            }
            Problem::Other(kind) => kind.description().into(),
        }
    }
}

/// Returns the message that `what` was expected and something else was found. The found text is
/// quoted up to the next blank or comma.
pub(super) fn expected(what: &str, at: &[u8]) -> String {
    let end = at.iter().position(|&b| b <= b' ' || b == b',');
    let token = text(&at[..end.unwrap_or(at.len()).min(24)]);
    if token.is_empty() {
        format!("expected {what}, but the file ends")
    } else {
        format!("expected {what}, not `{token}`")
    }
}

impl<'a> ParseError<&'a [u8]> for SyntaxError<'a> {
    fn from_error_kind(at: &'a [u8], kind: NomKind) -> Self {
        let problem = Problem::Other(kind);
        Self { at, problem }
    }

    fn append(_: &'a [u8], _: NomKind, other: Self) -> Self {
        other
    }
}

impl<'a> From<NomErr<SyntaxError<'a>>> for SyntaxError<'a> {
    fn from(error: NomErr<SyntaxError<'a>>) -> Self {
        match error {
            NomErr::Error(error) | NomErr::Failure(error) => error,
            // The `complete` parsers of nom never ask for more input.
            NomErr::Incomplete(_) => Self {
                at: &[],
                problem: Problem::Other(NomKind::Eof),
            },
        }
    }
}

/// The result of a parser: the rest of the source and the value, or a [`SyntaxError`].
pub(super) type Parsed<'a, T> = IResult<&'a [u8], T, SyntaxError<'a>>;

/// Returns the error of a parser at a location.
pub(super) fn fail<'a, T>(at: &'a [u8], problem: Problem) -> Parsed<'a, T> {
    Err(NomErr::Error(SyntaxError { at, problem }))
}

/// Makes a parser that fails with `problem` at the location where it began.
pub(super) fn or<'a, T>(
    problem: Problem,
    mut parser: impl Parser<&'a [u8], Output = T, Error = SyntaxError<'a>>,
) -> impl FnMut(&'a [u8]) -> Parsed<'a, T> {
    move |input| {
        let parsed = parser.parse(input);
        parsed.or_else(|_| fail(input, problem.clone()))
    }
}
