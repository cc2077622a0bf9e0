//! The text of prescription files: its encoding, its lines, and its words with their places.

use std::sync::Arc;

use ivcam_base::diag::{Diagnostic, Result, Source, Span};
use nom::branch::alt;
use nom::bytes::complete::{tag, take_till, take_till1, take_while};
use nom::character::complete::char;
use nom::combinator::opt;
use nom::multi::many0;
use nom::sequence::{delimited, preceded, terminated};
use nom::{IResult, Offset, Parser};

/// Returns the file in UTF-8. Zemax writes UTF-16 of either byte order, or Windows' Western code
/// page.
///
/// Places in messages count in the decoded text, so that columns are those that an editor shows.
pub(crate) fn decoded(source: &Arc<Source>) -> Arc<Source> {
    let bytes = &source.bytes;
    let text = match bytes[..] {
        [0xff, 0xfe, ..] => utf16(&bytes[2..], u16::from_le_bytes),
        [0xfe, 0xff, ..] => utf16(&bytes[2..], u16::from_be_bytes),
        // UTF-16 without a mark of the byte order begins with an ASCII letter and a zero byte.
        [first, 0, _, 0, ..] if first != 0 => utf16(bytes, u16::from_le_bytes),
        [0, first, 0, _, ..] if first != 0 => utf16(bytes, u16::from_be_bytes),
        [0xef, 0xbb, 0xbf, ..] => String::from_utf8_lossy(&bytes[3..]).into_owned(),
        _ if std::str::from_utf8(bytes).is_ok() => return source.clone(),
        _ => bytes.iter().map(|&b| char::from(b)).collect(),
    };
    Arc::new(Source::new(source.name.clone(), text.into_bytes()))
}

fn utf16(bytes: &[u8], unit: fn([u8; 2]) -> u16) -> String {
    let units = bytes
        .chunks_exact(2)
        .map(|pair| unit(pair.try_into().unwrap_or_default()));
    char::decode_utf16(units)
        .map(|c| c.unwrap_or(char::REPLACEMENT_CHARACTER))
        .collect()
}

/// The text of a decoded source.
pub(crate) fn text(source: &Source) -> &str {
    std::str::from_utf8(&source.bytes).unwrap_or("")
}

/// A word and its place. A word in quotes may contain blanks, and its quotes are not part of it.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Word<'a> {
    pub text: &'a str,
    pub span: Span,
}

/// The words of a line.
pub(crate) type Words<'a> = Vec<Word<'a>>;

impl<'a> Word<'a> {
    /// Makes a word of a piece of text that begins at byte `start` of its file.
    pub(crate) fn at(piece: &'a str, text: &'a str, start: usize) -> Self {
        let begin = start + piece.offset(text);
        let span = Span::new(begin, begin + text.len());
        Self { text, span }
    }

    /// Reads the word as a number.
    ///
    /// # Errors
    /// It is not a finite number.
    pub(crate) fn number(&self, source: &Arc<Source>) -> Result<f64> {
        match self.text.parse::<f64>() {
            Ok(value) if value.is_finite() => Ok(value),
            _ => {
                let message = format!("`{}` is not a number", self.text);
                Err(Diagnostic::error(message).at(source, self.span))
            }
        }
    }

    /// Whether the word is another one, in any case.
    pub(crate) fn is(&self, word: &str) -> bool {
        self.text.eq_ignore_ascii_case(word)
    }
}

/// The error type of the parsers here. It is only ever dropped.
pub(crate) type Failure<'a> = nom::error::Error<&'a str>;

/// Returns the words of a piece of text that begins at byte `start` of its file.
pub(crate) fn words(piece: &str, start: usize) -> Words<'_> {
    let blank = take_while(|c: char| c.is_whitespace() || c.is_control());
    let word = alt((quoted('"'), quoted('\''), take_till1(char::is_whitespace)));
    let located = |text| Word::at(piece, text, start);
    let words: IResult<_, _, Failure<'_>> = many0(preceded(blank, word.map(located))).parse(piece);
    words.map_or(Vec::new(), |(_, words)| words)
}

/// The text in quotes, or after a quote that is not closed.
fn quoted<'a>(quote: char) -> impl Parser<&'a str, Output = &'a str, Error = Failure<'a>> {
    delimited(
        char(quote),
        take_till(move |c| c == quote),
        opt(char(quote)),
    )
}

/// Returns the lines of a text, each with the byte at which it begins. CR, LF and CRLF end a line.
pub(crate) fn lines(text: &str) -> impl Iterator<Item = (usize, &str)> {
    let mut rest = text;
    std::iter::from_fn(move || {
        let begin = text.len() - rest.len();
        let (after, line) = line(rest).ok().filter(|_| !rest.is_empty())?;
        rest = after;
        Some((begin, line))
    })
}

/// A line, without the characters that end it.
fn line(input: &str) -> IResult<&str, &str, Failure<'_>> {
    let end = alt((tag("\r\n"), tag("\r"), tag("\n")));
    terminated(take_till(|c| matches!(c, '\r' | '\n')), opt(end)).parse(input)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_file_reads_the_same_in_every_encoding() {
        let words = "SURF 1\r\nNAME Ø=2\r\n";
        let utf16 = |swap: bool, mark: bool| {
            let mark = mark.then_some(0xfeff_u16);
            let units = mark.into_iter().chain(words.encode_utf16());
            units
                .flat_map(|u| {
                    if swap {
                        u.to_be_bytes()
                    } else {
                        u.to_le_bytes()
                    }
                })
                .collect::<Vec<u8>>()
        };
        let latin: Vec<u8> = words.chars().map(|c| c as u32 as u8).collect();
        let marked = [b"\xef\xbb\xbf", words.as_bytes()].concat();
        for bytes in [
            words.as_bytes().to_vec(),
            utf16(false, true),
            utf16(true, true),
            utf16(false, false),
            utf16(true, false),
            latin,
            marked,
        ] {
            let source = decoded(&Arc::new(Source::new("a", bytes)));
            assert_eq!(text(&source), words);
        }
    }

    #[test]
    fn words_know_their_places_and_quotes_hold_blanks() {
        let found = words("S 'a b' 2", 10);
        assert_eq!(
            found.iter().map(|w| w.text).collect::<Vec<_>>(),
            ["S", "a b", "2"]
        );
        assert_eq!(found[1].span, Span::new(13, 16));
        assert_eq!(words("\"\" \"x", 0).len(), 2);
    }

    #[test]
    fn lines_know_where_they_begin() {
        let found: Vec<_> = lines("a\r\nb\rc\n\nd").collect();
        assert_eq!(found, [(0, "a"), (3, "b"), (5, "c"), (7, ""), (8, "d")]);
    }
}
