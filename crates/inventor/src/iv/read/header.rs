//! Reads the header of a file, and decompresses files that are packed with gzip.
//!
//! Only the header determines the format; the file name does not.

use std::io::Read;

use ivcam_base::diag::{Diagnostic, ErrorKind, Result};
use nom::Parser;
use nom::branch::alt;
use nom::bytes::complete::{tag, take_till, take_till1, take_while, take_while_m_n, take_while1};
use nom::combinator::{consumed, opt, value, verify};
use nom::sequence::{pair, preceded};

use super::syntax_error::{Parsed, SyntaxError};
use crate::grammar::Dialect;
use crate::iv::limits::Limits;

/// The content of the first line of a file.
#[derive(Clone, Debug, PartialEq, Eq)]
pub(super) struct Header {
    /// The dialect whose classes come first when a name is looked up, as bits of [`Dialect`].
    pub dialect: u8,
    /// The major and minor version of the format.
    pub version: (u8, u8),
    /// Whether the file is binary.
    pub binary: bool,
    /// The format as the header states it, such as `Inventor V2.1 ascii`.
    pub words: String,
    /// The number of bytes up to the end of the line, with the line ending.
    pub length: usize,
}

impl Header {
    /// Returns the header that is assumed for a `.dat` or `.env` file without one.
    pub(super) fn ascii_2_1() -> Self {
        Self {
            dialect: Dialect::IV2 | Dialect::COIN,
            version: (2, 1),
            binary: false,
            words: "Inventor V2.1 ascii".into(),
            length: 0,
        }
    }

    /// Returns the header that is assumed for the text that a script makes nodes from.
    pub(super) fn vrml97() -> Self {
        Self {
            dialect: Dialect::VRML97,
            version: (2, 0),
            binary: false,
            words: "VRML V2.0 utf8".into(),
            length: 0,
        }
    }

    /// Returns whether the file is VRML97.
    pub(super) fn is_vrml97(&self) -> bool {
        self.dialect == Dialect::VRML97
    }

    /// Parses the first line.
    ///
    /// # Errors
    /// Returns an error if the line is not the header of a supported format. The message quotes the
    /// beginning of the file.
    pub(super) fn parse(bytes: &[u8], name: &str) -> Result<Self> {
        let start = before(bytes).map_or(bytes, |(start, _)| start);
        match first_line(start) {
            Ok((rest, ((dialect, version), binary, words))) => Ok(Self {
                dialect,
                version,
                binary,
                words,
                length: bytes.len() - rest.len(),
            }),
            Err(_) => Err(unknown_header(name, start)),
        }
    }
}

/// Skips a byte-order mark and empty lines.
fn before(input: &[u8]) -> Parsed<'_, &[u8]> {
    let order = opt(tag("\u{feff}"));
    preceded(order, take_while(|b: u8| b.is_ascii_whitespace())).parse(input)
}

/// A dialect, as bits of [`Dialect`], and a version.
type HeaderLanguage = (u8, (u8, u8));

/// Parses a header such as `#Inventor V2.1 ascii`; the rest of the line may be anything. Returns
/// the dialect and version, whether the file is binary, and the words of the header.
fn first_line(input: &[u8]) -> Parsed<'_, (HeaderLanguage, bool, String)> {
    let hashes = take_while1(|b| b == b'#');
    let (rest, (words, (language, binary))) =
        preceded(hashes, consumed(pair(language, is_binary))).parse(input)?;
    let line_end = opt(take_while_m_n(1, 1, is_line_end));
    let (rest, _) = pair(take_till(is_line_end), line_end).parse(rest)?;
    let words: Vec<_> = words.split(is_space).filter(|w| !w.is_empty()).collect();
    let words = String::from_utf8_lossy(&words.join(&b' ')).into_owned();
    Ok((rest, (language, binary, words)))
}

/// Parses the first two words, such as `Inventor V2.1`.
fn language(input: &[u8]) -> Parsed<'_, HeaderLanguage> {
    alt((
        value((Dialect::IV1, (1, 0)), pair(name("Inventor"), name("V1.0"))),
        value((Dialect::IV2, (2, 0)), pair(name("Inventor"), name("V2.0"))),
        value((Dialect::IV2, (2, 1)), pair(name("Inventor"), word)),
        value((Dialect::VRML1, (1, 0)), pair(name("VRML"), name("V1.0"))),
        value((Dialect::VRML97, (2, 0)), pair(name("VRML"), name("V2.0"))),
    ))
    .parse(input)
}

/// Parses the encoding, and returns whether it is binary.
fn is_binary(input: &[u8]) -> Parsed<'_, bool> {
    let text = alt((name("ascii"), name("utf8")));
    alt((value(false, text), value(true, name("binary")))).parse(input)
}

/// Makes a parser of one fixed word.
fn name<'a>(
    expected: &'static str,
) -> impl Parser<&'a [u8], Output = &'a [u8], Error = SyntaxError<'a>> {
    verify(word, |word: &[u8]| word == expected.as_bytes())
}

/// Parses a word, which ends at a space or at the end of the line.
fn word(input: &[u8]) -> Parsed<'_, &[u8]> {
    let letters = take_till1(|b| is_space(&b) || is_line_end(b));
    preceded(take_while(|b| is_space(&b)), letters).parse(input)
}

fn is_space(byte: &u8) -> bool {
    matches!(byte, b' ' | b'\t' | 0x0b | 0x0c)
}

fn is_line_end(byte: u8) -> bool {
    matches!(byte, b'\n' | b'\r')
}

/// Returns the error for a file with an unknown header.
fn unknown_header(name: &str, start: &[u8]) -> Box<Diagnostic> {
    let expected =
        "the first line should be `#Inventor V2.1 ascii`, `#VRML V2.0 utf8` or a similar header";
    if start.is_empty() {
        return Diagnostic::error(format!("`{name}` is empty"))
            .in_file(name)
            .of_kind(ErrorKind::Damaged)
            .with_help(expected);
    }
    let line = start.split(|&b| is_line_end(b)).next().unwrap_or_default();
    let text = String::from_utf8_lossy(&line[..line.len().min(200)]);
    let begins: String = text
        .chars()
        .take(40)
        .map(|c| if c.is_control() { '?' } else { c })
        .collect();
    let message =
        format!("`{name}` is neither an Inventor nor a VRML file: it begins with `{begins}`");
    let help = if text.starts_with("#X3D") || text.starts_with("<?xml") {
        "X3D is not supported; most tools that write it can also write VRML97"
    } else {
        expected
    };
    Diagnostic::error(message)
        .in_file(name)
        .of_kind(ErrorKind::Damaged)
        .with_help(help)
}

/// Decompresses a file that is packed with gzip, and returns other files unchanged. For a damaged
/// archive it returns the part that can be decompressed, and a warning.
///
/// # Errors
/// Returns an error if the result is larger than the limit, or if nothing can be decompressed.
pub(super) fn unpack(
    bytes: Vec<u8>,
    name: &str,
    limits: &Limits,
) -> Result<(Vec<u8>, Option<Box<Diagnostic>>)> {
    let too_big = |n: usize| {
        Diagnostic::beyond_limit(format!("`{name}` is larger than {n} bytes"))
            .in_file(name)
            .with_help("`--scene-limit bytes=N` raises this, if the file is meant to be that big")
    };
    if !bytes.starts_with(&[0x1f, 0x8b]) {
        return if bytes.len() > limits.bytes {
            Err(too_big(limits.bytes))
        } else {
            Ok((bytes, None))
        };
    }
    let mut out = Vec::new();
    let read = flate2::read::MultiGzDecoder::new(bytes.as_slice())
        .take(limits.bytes as u64 + 1)
        .read_to_end(&mut out);
    match read {
        Ok(_) if out.len() > limits.bytes => Err(too_big(limits.bytes)),
        Ok(_) => Ok((out, None)),
        // Bytes after a complete archive are ignored, as by `gunzip`.
        Err(error) if !out.is_empty() && error.to_string() == "invalid gzip header" => {
            Ok((out, None))
        }
        Err(error) if !out.is_empty() => {
            let message = format!("the gzip archive is damaged: {error}");
            let help = format!("{} bytes could be unpacked, and are read", out.len());
            let warning = Diagnostic::warning(message).in_file(name);
            let warning = warning.of_kind(ErrorKind::Damaged).with_help(help);
            Ok((out, Some(warning)))
        }
        Err(error) => Err(
            Diagnostic::error(format!("`{name}` cannot be unpacked: {error}"))
                .in_file(name)
                .of_kind(ErrorKind::Damaged),
        ),
    }
}
