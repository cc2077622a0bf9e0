//! The lines of a table: their cells, with the places of these, and their comments.

use nom::Parser;
use nom::bytes::complete::{take_till, take_till1, take_while};
use nom::character::complete::{char, one_of};
use nom::combinator::{consumed, eof, opt};
use nom::multi::{many_till, many0};
use nom::sequence::{preceded, terminated};

use crate::prescription::text::{Failure, Word};

/// A line of the file.
pub(super) struct Line<'a> {
    /// The text before `#`.
    pub(super) data: &'a str,
    /// The words of that text.
    pub(super) cells: Vec<Cell<'a>>,
    /// The text after `#`.
    pub(super) comment: &'a str,
}

/// A word of a line, and its value if it is a number.
#[derive(Clone, Copy)]
pub(super) struct Cell<'a> {
    pub(super) word: Word<'a>,
    pub(super) number: Option<f64>,
}

/// The lines of a text.
pub(super) fn lines(text: &str) -> Vec<Line<'_>> {
    let lines = many_till(line(text), eof).parse(text);
    lines.map_or(Vec::new(), |(_, (lines, _))| lines)
}

/// A parser of a line: cells between blanks, a comment, and the end of the line, each of which may
/// be missing. `text` is the whole file, in which the cells have their places.
fn line<'a>(text: &'a str) -> impl Parser<&'a str, Output = Line<'a>, Error = Failure<'a>> {
    let blank = || take_while(|c| is_blank(c) && !is_line_end(c));
    let cell = take_till1(|c| is_blank(c) || c == '#').map(|cell: &'a str| Cell {
        word: Word::at(text, cell, 0),
        // Texts of patents have the sign of typography.
        number: cell.replace('\u{2212}', "-").parse().ok(),
    });
    let cells = terminated(many0(preceded(blank(), cell)), blank());
    let comment = preceded(char('#'), take_till(is_line_end));
    let trimmed = |comment: Option<&'a str>| comment.unwrap_or("").trim_matches(is_margin);
    (consumed(cells), opt(comment), opt(one_of("\r\n"))).map(move |((data, cells), comment, _)| {
        Line {
            data,
            cells,
            comment: trimmed(comment),
        }
    })
}

/// What surrounds the text of a comment: blanks, and further `#`.
fn is_margin(c: char) -> bool {
    c.is_whitespace() || c == '#'
}

fn is_blank(c: char) -> bool {
    c.is_whitespace() || c == ','
}

fn is_line_end(c: char) -> bool {
    matches!(c, '\r' | '\n')
}
