//! What a file is: its first line, and the gzip around it.
//!
//! The header decides the format, never the extension.

use std::io::Read;

use nom::Parser;
use nom::branch::alt;
use nom::bytes::complete::{tag, take_till, take_till1, take_while, take_while_m_n, take_while1};
use nom::combinator::{consumed, opt, value, verify};
use nom::sequence::{pair, preceded};

use super::syntax_error::{Parsed, SyntaxError};
use crate::diag::{Diagnostic, ErrorKind, Result};
use crate::grammar::Dialect;
use crate::iv::limits::Limits;

/// The first line of a file, understood.
#[derive(Clone, Debug, PartialEq, Eq)]
pub(super) struct Header {
    /// The classes to look names up in first: bits of [`Dialect`].
    pub dialect: u8,
    pub version: (u8, u8),
    pub binary: bool,
    /// The header's words, such as `Inventor V2.1 ascii`.
    pub words: String,
    /// Bytes up to and with the end of the line.
    pub length: usize,
}

impl Header {
    /// What a `.dat` or `.env` file without a header is taken for.
    pub(super) fn ascii_2_1() -> Self {
        Self {
            dialect: Dialect::IV2 | Dialect::COIN,
            version: (2, 1),
            binary: false,
            words: "Inventor V2.1 ascii".into(),
            length: 0,
        }
    }

    /// Whether the file is VRML97.
    pub(super) fn is_vrml97(&self) -> bool {
        self.dialect == Dialect::VRML97
    }

    /// Reads the first line.
    ///
    /// # Errors
    /// The line names no format that is read. The message says what the file begins with.
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
            Err(_) => Err(wrong(name, start)),
        }
    }
}

/// A mark of the byte order and empty lines, which are passed.
fn before(input: &[u8]) -> Parsed<'_, &[u8]> {
    let order = opt(tag("\u{feff}"));
    preceded(order, take_while(|b: u8| b.is_ascii_whitespace())).parse(input)
}

/// A dialect, as bits of [`Dialect`], and a version.
type Language = (u8, (u8, u8));

/// `#Inventor V2.1 ascii` and its like; the rest of the line may say anything. Reads the dialect
/// and version, whether the file is binary, and the words themselves.
fn first_line(input: &[u8]) -> Parsed<'_, (Language, bool, String)> {
    let hashes = take_while1(|b| b == b'#');
    let (rest, (words, (language, binary))) =
        preceded(hashes, consumed(pair(language, is_binary))).parse(input)?;
    let line_end = opt(take_while_m_n(1, 1, is_line_end));
    let (rest, _) = pair(take_till(is_line_end), line_end).parse(rest)?;
    let words: Vec<_> = words.split(is_space).filter(|w| !w.is_empty()).collect();
    let words = String::from_utf8_lossy(&words.join(&b' ')).into_owned();
    Ok((rest, (language, binary, words)))
}

/// The first two words, such as `Inventor V2.1`.
fn language(input: &[u8]) -> Parsed<'_, Language> {
    alt((
        value((Dialect::IV1, (1, 0)), pair(name("Inventor"), name("V1.0"))),
        value((Dialect::IV2, (2, 0)), pair(name("Inventor"), name("V2.0"))),
        value((Dialect::IV2, (2, 1)), pair(name("Inventor"), word)),
        value((Dialect::VRML1, (1, 0)), pair(name("VRML"), name("V1.0"))),
        value((Dialect::VRML97, (2, 0)), pair(name("VRML"), name("V2.0"))),
    ))
    .parse(input)
}

fn is_binary(input: &[u8]) -> Parsed<'_, bool> {
    let text = alt((name("ascii"), name("utf8")));
    alt((value(false, text), value(true, name("binary")))).parse(input)
}

fn name<'a>(
    expected: &'static str,
) -> impl Parser<&'a [u8], Output = &'a [u8], Error = SyntaxError<'a>> {
    verify(word, |word: &[u8]| word == expected.as_bytes())
}

/// Anything between spaces.
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

/// The error for a file that begins with something else.
fn wrong(name: &str, start: &[u8]) -> Box<Diagnostic> {
    let kin =
        "the first line should be `#Inventor V2.1 ascii`, `#VRML V2.0 utf8` or one of their kin";
    if start.is_empty() {
        return Diagnostic::error(format!("`{name}` is empty"))
            .in_file(name)
            .of_kind(ErrorKind::Damaged)
            .with_help(kin);
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
        "X3D is not read; most tools that write it can write VRML97 too"
    } else {
        kin
    };
    Diagnostic::error(message)
        .in_file(name)
        .of_kind(ErrorKind::Damaged)
        .with_help(help)
}

/// Unpacks gzip, as long as what comes out stays within the limit. Of a damaged archive it returns
/// the part that can be unpacked, and a warning.
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
        // Bytes behind a whole archive are ignored, as `gunzip` ignores them.
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
