//! The lines of a file, divided into its header and its surfaces.

use std::sync::Arc;

use ivcam_base::diag::{Diagnostic, Result, Source, Span};

use crate::prescription::prescription::Column;
use crate::prescription::text::{Word, lines, text, words};

/// A line of the file: its keyword and values.
pub(super) type Line<'a> = Vec<Word<'a>>;

/// Keywords of a surface, which belong to it in files that have lost their indentation too.
const OF_SURFACE: [&str; 17] = [
    "TYPE", "COMM", "CURV", "CONI", "PARM", "XDAT", "DISZ", "GLAS", "DIAM", "MEMA", "STOP", "FLAP",
    "CLAP", "OBSC", "COAT", "HIDE", "POPS",
];

/// The lines of one `SURF`.
pub(super) struct Block<'a> {
    pub(super) number: usize,
    pub(super) heading: Span,
    pub(super) lines: Vec<Line<'a>>,
}

impl<'a> Block<'a> {
    /// The values of the first line with a keyword.
    pub(super) fn line(&self, keyword: &str) -> Option<&[Word<'a>]> {
        self.lines
            .iter()
            .find(|l| l[0].is(keyword))
            .map(|l| &l[1..])
    }

    /// The first value of the first line with a keyword.
    pub(super) fn first(&self, keyword: &str) -> Option<Word<'a>> {
        self.line(keyword)?.first().copied()
    }

    /// `PARM 3 0.5` and `XDAT 3 0.5 …` as (3, 0.5).
    pub(super) fn numbered(&self, keyword: &'a str) -> impl Iterator<Item = (Word<'a>, Word<'a>)> {
        let lines = self.lines.iter().filter(move |l| l[0].is(keyword));
        lines.filter_map(|l| Some((*l.get(1)?, *l.get(2)?)))
    }
}

/// Everything before and behind the surfaces, and the surfaces.
pub(super) fn split(source: &Arc<Source>) -> Result<(Vec<Line<'_>>, Vec<Block<'_>>)> {
    let (mut header, mut blocks) = (Vec::new(), Vec::<Block<'_>>::new());
    for (start, line) in lines(text(source)) {
        let indented = line.starts_with([' ', '\t']);
        let words = words(line, start);
        let Some(first) = words.first() else { continue };
        if first.is("SURF") {
            let number = words.get(1).and_then(|w| w.text.parse().ok());
            let number = number.ok_or_else(|| {
                Diagnostic::error("a `SURF` without a number").at(source, first.span)
            })?;
            let heading = Span {
                end: words[1].span.end,
                ..first.span
            };
            blocks.push(Block {
                number,
                heading,
                lines: Vec::new(),
            });
        } else if (indented || OF_SURFACE.iter().any(|k| first.is(k)))
            && let Some(block) = blocks.last_mut()
        {
            block.lines.push(words);
        } else {
            header.push(words);
        }
    }
    Ok((header, blocks))
}

/// The place of a column of a surface, for messages.
pub(super) fn place(block: Option<&Block<'_>>, column: Column) -> Span {
    let Some(block) = block else {
        return Span::at(0);
    };
    let keyword = match column {
        Column::Radius => "CURV",
        Column::Thickness => "DISZ",
        Column::Index => "GLAS",
        Column::SemiDiameter => "DIAM",
    };
    block.first(keyword).map_or(block.heading, |word| word.span)
}

/// The first two values of a line.
pub(super) fn pair<'a>(line: &Line<'a>) -> Option<(Word<'a>, Word<'a>)> {
    Some((*line.get(1)?, *line.get(2)?))
}
