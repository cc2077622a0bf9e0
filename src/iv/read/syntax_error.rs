//! What a parser of scene files reports when it fails: a place and a problem.

use nom::Err as NomErr;
use nom::error::{ErrorKind as NomKind, ParseError};
use nom::{IResult, Parser};

use super::enum_names::EnumNames;
use crate::diag::ErrorKind;
use crate::iv::encoding::text;

/// A failed parse. Making one allocates nothing, except for a name that an enumeration lacks.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct SyntaxError<'a> {
    /// The suffix of the source that begins where the mistake is.
    pub at: &'a [u8],
    pub problem: Problem,
}

/// The mistakes that parsers find.
#[derive(Clone, Debug, PartialEq)]
pub(super) enum Problem {
    /// Something else stands where this should be.
    Expected(&'static str),
    /// The file ends inside a string.
    UnclosedString,
    /// A whole number does not fit in 32 bits.
    MoreThan32Bits,
    /// A name that an enumeration or a bit mask does not have.
    UnknownName(Box<str>, EnumNames),
    /// An image whose pixels have this many components, which is more than four.
    TooManyComponents(u32),
    /// An image of this width and height, which is longer than the rest of the file.
    ImageTooLarge(u32, u32),
    /// A binary file ends inside a number.
    CutOff,
    /// A binary file promises this many bytes and has only so many left.
    MissingBytes { promised: usize, left: usize },
    /// A binary file promises more values than the rest of it can hold.
    MissingValues(usize),
    /// A parser of nom's failed whose error no parser of ours replaced.
    Other(NomKind),
}

impl SyntaxError<'_> {
    /// Returns the kind of the message. A name that an enumeration lacks is no damage.
    pub(super) fn kind(&self) -> ErrorKind {
        match self.problem {
            Problem::UnknownName(..) => ErrorKind::Syntax,
            _ => ErrorKind::Damaged,
        }
    }

    /// The text of the message.
    pub(super) fn message(&self) -> String {
        match &self.problem {
            Problem::Expected(what) => expected(what, self.at),
            Problem::UnclosedString => "this string has no closing quote".into(),
            Problem::MoreThan32Bits => "this number needs more than 32 bits".into(),
            Problem::UnknownName(name, names) => names.unknown(name),
            Problem::TooManyComponents(n) => format!("a pixel has 0 to 4 components, not {n}"),
            Problem::ImageTooLarge(width, height) => format!(
                "a picture of {}x{} pixels does not fit in the rest of the file",
                width.cast_signed(),
                height.cast_signed()
            ),
            Problem::CutOff => "the file ends in the middle of a value".into(),
            Problem::MissingBytes { promised, left } => {
                format!("{promised} bytes are promised, and {left} are left")
            }
            Problem::MissingValues(promised) => {
                format!("{promised} values are promised, which do not fit in the rest of the file")
            }
            Problem::Other(kind) => kind.description().into(),
        }
    }
}

/// Says what should stand at a place, and what stands there instead, up to a blank.
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
            // The parsers here are nom's `complete` ones, which never ask for more.
            NomErr::Incomplete(_) => Self {
                at: &[],
                problem: Problem::Other(NomKind::Eof),
            },
        }
    }
}

/// The result of a parser: the rest of the source and what was read, or a [`SyntaxError`].
pub(super) type Parsed<'a, T> = IResult<&'a [u8], T, SyntaxError<'a>>;

/// A failed parse at a place.
pub(super) fn fail<'a, T>(at: &'a [u8], problem: Problem) -> Parsed<'a, T> {
    Err(NomErr::Error(SyntaxError { at, problem }))
}

/// Makes a parser that fails with `problem`, at the place where it began.
pub(super) fn or<'a, T>(
    problem: Problem,
    mut parser: impl Parser<&'a [u8], Output = T, Error = SyntaxError<'a>>,
) -> impl FnMut(&'a [u8]) -> Parsed<'a, T> {
    move |input| {
        let parsed = parser.parse(input);
        parsed.or_else(|_| fail(input, problem.clone()))
    }
}
