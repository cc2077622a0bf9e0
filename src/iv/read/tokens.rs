//! The tokens of an ASCII file: white space, comments, names and strings.

use std::borrow::Cow;

use nom::bytes::complete::take_while1;
use nom::error::{ErrorKind, ParseError};
use nom::{Err as NomErr, IResult};

use crate::iv::encoding::text;

/// What was wrong, and the suffix of the source where.
#[derive(Clone, Debug, PartialEq)]
pub struct Bad<'a> {
    pub at: &'a [u8],
    pub what: Cow<'static, str>,
}

impl<'a> ParseError<&'a [u8]> for Bad<'a> {
    fn from_error_kind(at: &'a [u8], kind: ErrorKind) -> Self {
        Self {
            at,
            what: kind.description().to_owned().into(),
        }
    }

    fn append(_: &'a [u8], _: ErrorKind, other: Self) -> Self {
        other
    }
}

pub type Parsed<'a, T> = IResult<&'a [u8], T, Bad<'a>>;

pub fn bad<'a, T>(at: &'a [u8], what: impl Into<Cow<'static, str>>) -> Parsed<'a, T> {
    Err(NomErr::Error(Bad {
        at,
        what: what.into(),
    }))
}

pub const SPACE: u8 = 1;
/// Ends a class's or field's name.
pub const ENDS_WORD: u8 = 2;
/// Ends a `DEF` name, which may hold almost anything.
pub const ENDS_NAME: u8 = 4;

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

pub fn is(byte: u8, kind: u8) -> bool {
    KINDS[usize::from(byte)] & kind != 0
}

/// Skips white space, commas (which separate and mean nothing) and comments.
#[inline]
pub fn skip(mut input: &[u8]) -> &[u8] {
    loop {
        match input.first() {
            Some(&b) if is(b, SPACE) => input = &input[1..],
            Some(b'#') => {
                let end = input.iter().position(|b| matches!(b, b'\n' | b'\r'));
                input = &input[end.unwrap_or(input.len())..];
            }
            _ => return input,
        }
    }
}

/// The name of a class or field, or a keyword.
pub fn word(input: &[u8]) -> Parsed<'_, &[u8]> {
    take_while1(|b| !is(b, ENDS_WORD))(input)
}

/// A name after `DEF` or `USE`: `Text01-TIMER`, `name+0`, `+0`, even `a.b`.
pub fn def_name(input: &[u8]) -> Parsed<'_, &[u8]> {
    take_while1(|b| !is(b, ENDS_NAME))(input)
}

pub fn expected(what: &str, at: &[u8]) -> String {
    let token: Vec<u8> = at
        .iter()
        .copied()
        .take_while(|&b| !is(b, SPACE))
        .take(24)
        .collect();
    if token.is_empty() {
        format!("expected {what}, but the file ends")
    } else {
        format!("expected {what}, not `{}`", text(&token))
    }
}

pub fn wanted<'a>(what: &str, at: &'a [u8]) -> NomErr<Bad<'a>> {
    NomErr::Error(Bad {
        at,
        what: expected(what, at).into(),
    })
}

/// A string in quotes, over as many lines as it takes, or a bare word. Of escapes, `\"` and `\\`
/// mean something; any other backslash is itself, as in the paths that people write.
pub fn string(input: &[u8]) -> Parsed<'_, String> {
    if input.first() != Some(&b'"') {
        let (rest, bare) =
            take_while1(|b| !matches!(b, 0..=b' ' | b'}' | b']' | b'"' | b','))(input)
                .map_err(|_: NomErr<Bad<'_>>| wanted("a string", input))?;
        return Ok((rest, text(bare)));
    }
    let body = &input[1..];
    let (mut i, mut plain) = (0, true);
    loop {
        match body.get(i) {
            Some(b'"') => break,
            Some(b'\\') if matches!(body.get(i + 1), Some(b'"' | b'\\')) => {
                plain = false;
                i += 2;
            }
            Some(_) => i += 1,
            None => return bad(input, "this string has no closing quote"),
        }
    }
    let raw = &body[..i];
    let rest = &body[i + 1..];
    if plain {
        return Ok((rest, text(raw)));
    }
    let mut out = Vec::with_capacity(raw.len());
    let mut bytes = raw.iter().copied().peekable();
    while let Some(b) = bytes.next() {
        match (b, bytes.peek()) {
            (b'\\', Some(&next @ (b'"' | b'\\'))) => {
                out.push(next);
                bytes.next();
            }
            _ => out.push(b),
        }
    }
    Ok((rest, text(&out)))
}

/// Past one token: a string, something in brackets or braces, a word, or a single byte.
pub fn past_token(rest: &[u8]) -> &[u8] {
    match rest.first() {
        None => rest,
        Some(b'"') => string(rest).map_or(&[], |(rest, _)| rest),
        Some(b'{' | b'[' | b'(') => past_braces(&rest[1..]),
        _ => match def_name(rest) {
            Ok((rest, _)) => rest,
            Err(_) => &rest[1..],
        },
    }
}

/// Past the brace or bracket that closes the one already passed. Without recursion.
pub fn past_braces(mut rest: &[u8]) -> &[u8] {
    let mut depth = 1usize;
    loop {
        rest = skip(rest);
        match rest.first() {
            None => return rest,
            Some(b'"') => {
                rest = string(rest).map_or(&[], |(rest, _)| rest);
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
