//! Parses the tokens of an ASCII file: white space, comments, punctuation, names and strings.
//!
//! A parser takes a suffix of the source and returns a shorter one. The offset of a location is
//! `source.len() - rest.len()`, so locations cost nothing until a message needs them.

use nom::Parser;
use nom::branch::alt;
use nom::bytes::complete::{tag, take_till, take_while, take_while1};
use nom::character::complete::{char, one_of};
use nom::combinator::{recognize, value};
use nom::multi::{fold_many0, many0_count};
use nom::sequence::{delimited, pair, preceded};

use super::syntax_error::{Parsed, Problem, SyntaxError, or};
use crate::iv::encoding::{Escapes, text, text_of};

/// The byte is white space or a comma.
const SPACE: u8 = 1;
/// The byte ends the name of a class or a field.
const ENDS_WORD: u8 = 2;
/// The byte ends a `DEF` name, which may contain almost any byte.
const ENDS_NAME: u8 = 4;

/// The properties of each byte, as bits.
static KINDS: [u8; 256] = {
    let mut table = [0; 256];
    let mut i = 0;
    while i <= b' ' as usize {
        table[i] = SPACE | ENDS_WORD | ENDS_NAME;
        i += 1;
    }
    table[b',' as usize] = SPACE | ENDS_WORD | ENDS_NAME;
    let stops = b"{}[]\"#";
    i = 0;
    while i < stops.len() {
        table[stops[i] as usize] = ENDS_WORD | ENDS_NAME;
        i += 1;
    }
    let stops = b"()'=~|.";
    i = 0;
    while i < stops.len() {
        table[stops[i] as usize] = ENDS_WORD;
        i += 1;
    }
    table
};

#[inline]
fn is(byte: u8, kind: u8) -> bool {
    KINDS[usize::from(byte)] & kind != 0
}

/// Parses white space, commas (which have no meaning) and comments. It never fails.
///
/// The loop is written by hand because it runs before every number. With `take_while` reading takes
/// about 10% longer.
#[inline]
pub(super) fn blank(mut input: &[u8]) -> Parsed<'_, ()> {
    while let Some(&b) = input.first()
        && is(b, SPACE)
    {
        input = &input[1..];
    }
    match input.first() {
        Some(b'#') => comments(input),
        _ => Ok((input, ())),
    }
}

/// Parses comments, each up to the end of its line, and the white space after them.
fn comments(input: &[u8]) -> Parsed<'_, ()> {
    let comment = preceded(char('#'), take_till(|b| matches!(b, b'\n' | b'\r')));
    let space = take_while(|b| is(b, SPACE));
    value((), many0_count(pair(comment, space))).parse(input)
}

/// Returns the input after white space and comments.
#[inline]
pub(super) fn skip(input: &[u8]) -> &[u8] {
    blank(input).map_or(input, |(rest, ())| rest)
}

/// Makes a parser that skips white space and comments first.
#[inline]
pub(super) fn token<'a, T>(
    parser: impl Parser<&'a [u8], Output = T, Error = SyntaxError<'a>>,
) -> impl Parser<&'a [u8], Output = T, Error = SyntaxError<'a>> {
    preceded(blank, parser)
}

/// Makes a parser of a punctuation mark.
#[inline]
pub(super) fn mark<'a>(c: char) -> impl Parser<&'a [u8], Output = char, Error = SyntaxError<'a>> {
    char(c)
}

/// Parses the name of a class or field, or a keyword.
pub(super) fn word(input: &[u8]) -> Parsed<'_, &[u8]> {
    take_while1(|b| !is(b, ENDS_WORD))(input)
}

/// Returns whether bytes are the name of a class or field that [`word`] parses.
pub(super) fn is_word(bytes: &[u8]) -> bool {
    !bytes.is_empty() && !bytes.iter().any(|&b| is(b, ENDS_WORD))
}

/// Returns a `DEF` name of a binary file as [`def_name`] parses it: a byte that ends a name in the
/// ASCII format becomes `_`.
pub(super) fn legal_name(bytes: &[u8]) -> Vec<u8> {
    let legal = |&b: &u8| if is(b, ENDS_NAME) { b'_' } else { b };
    bytes.iter().map(legal).collect()
}

/// Parses a name after `DEF` or `USE`: `Text01-TIMER`, `name+0`, `+0`, even `a.b`.
pub(super) fn def_name(input: &[u8]) -> Parsed<'_, &[u8]> {
    take_while1(|b| !is(b, ENDS_NAME))(input)
}

/// Parses a string in quotes, which may have several lines, or a word without quotes.
pub(super) fn string(input: &[u8], escapes: Escapes) -> Parsed<'_, String> {
    if input.first() == Some(&b'"') {
        return quoted(input, escapes);
    }
    let bare = take_while1(|b| !matches!(b, 0..=b' ' | b'}' | b']' | b'"' | b','));
    or(Problem::Expected("a string"), bare)
        .map(text)
        .parse(input)
}

/// Parses a string in quotes.
fn quoted(input: &[u8], escapes: Escapes) -> Parsed<'_, String> {
    let plain = take_while1(|b| !matches!(b, b'"' | b'\\'));
    let escaped = match escapes {
        Escapes::Quote => "\"",
        Escapes::QuoteAndBackslash => "\"\\",
    };
    let escape = preceded(char('\\'), recognize(one_of(escaped)));
    let body = fold_many0(
        alt((plain, escape, tag("\\"))),
        Vec::new,
        |mut out: Vec<u8>, piece: &[u8]| {
            out.extend_from_slice(piece);
            out
        },
    );
    or(
        Problem::UnclosedString,
        delimited(char('"'), body, char('"')),
    )
    .map(text_of)
    .parse(input)
}

/// Returns the input after one token: a string, a group in brackets or braces, a word, or a single
/// byte.
pub(super) fn past_token(rest: &[u8], escapes: Escapes) -> &[u8] {
    match rest.first() {
        None => rest,
        Some(b'"') => string(rest, escapes).map_or(&[], |(rest, _)| rest),
        Some(b'{' | b'[' | b'(') => past_braces(&rest[1..], escapes),
        _ => match def_name(rest) {
            Ok((rest, _)) => rest,
            Err(_) => &rest[1..],
        },
    }
}

/// Returns the input after the brace or bracket that closes the one before the input.
pub(super) fn past_braces(mut rest: &[u8], escapes: Escapes) -> &[u8] {
    let mut depth = 1usize;
    loop {
        rest = skip(rest);
        match rest.first() {
            None => return rest,
            Some(b'"') => {
                rest = string(rest, escapes).map_or(&[], |(rest, _)| rest);
                continue;
            }
            Some(b'{' | b'[' | b'(') => depth += 1,
            Some(b'}' | b']' | b')') => depth -= 1,
            _ => {}
        }
        rest = &rest[1..];
        if depth == 0 {
            return rest;
        }
    }
}

/// Returns the input after the `]` that closes the current list, or the input from a `}` if that
/// comes first.
pub(super) fn past_list(mut rest: &[u8], escapes: Escapes) -> &[u8] {
    loop {
        rest = skip(rest);
        match rest.first() {
            None | Some(b'}') => return rest,
            Some(b']') => return &rest[1..],
            _ => rest = past_token(rest, escapes),
        }
    }
}
