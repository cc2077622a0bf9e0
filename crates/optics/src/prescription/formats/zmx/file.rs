//! The lines of a file, divided into its header and its surfaces.

use ivcam_base::diag::{Result, Span};

use crate::prescription::formats::reader::{PrescriptionReader, SurfaceSpans};
use crate::prescription::text::{Word, Words, lines, words};

/// Keywords of a surface, which belong to it in files that have lost their indentation too.
const OF_SURFACE: [&str; 18] = [
    "TYPE", "COMM", "CURV", "CONI", "PARM", "XDAT", "DISZ", "GLAS", "DIAM", "MEMA", "STOP", "FLAP",
    "CLAP", "OBSC", "COAT", "HIDE", "POPS", "SCBD",
];

/// The lines of one `SURF`, each with its keyword and values.
pub(super) struct SurfaceBlock<'a> {
    pub(super) number: usize,
    pub(super) heading: Span,
    pub(super) lines: Vec<Words<'a>>,
}

impl<'a> SurfaceBlock<'a> {
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

    /// The places of the numbers of the surface: those of its lines, or of its heading where it has
    /// no such line.
    pub(super) fn places(&self) -> SurfaceSpans {
        ["CURV", "DISZ", "GLAS", "DIAM"]
            .map(|keyword| self.first(keyword).map_or(self.heading, |word| word.span))
    }

    /// `PARM 3 0.5` and `XDAT 3 0.5 …` as (3, 0.5).
    pub(super) fn numbered(
        &self,
        keyword: &'static str,
    ) -> impl Iterator<Item = (Word<'a>, Word<'a>)> {
        let lines = self.lines.iter().filter(move |l| l[0].is(keyword));
        lines.filter_map(|l| Some((*l.get(1)?, *l.get(2)?)))
    }

    /// The first of the values with a keyword and a number: that of `PARM 3 0.5`.
    pub(super) fn number(&self, keyword: &'static str, number: &str) -> Option<Word<'a>> {
        let mut values = self.numbered(keyword);
        values.find_map(|(at, value)| (at.text == number).then_some(value))
    }
}

/// Everything before and behind the surfaces, and the surfaces.
pub(super) fn split(
    file: PrescriptionReader<'_>,
) -> Result<(Vec<Words<'_>>, Vec<SurfaceBlock<'_>>)> {
    let (mut header, mut blocks) = (Vec::new(), Vec::<SurfaceBlock<'_>>::new());
    for (start, line) in lines(file.text()) {
        let indented = line.starts_with([' ', '\t']);
        let words = words(line, start);
        let Some(first) = words.first() else { continue };
        if first.is("SURF") {
            let number = words.get(1).and_then(|w| w.text.parse().ok());
            let error = || file.fail(first.span, "a `SURF` without a number");
            let number = number.ok_or_else(error)?;
            let heading = Span {
                end: words[1].span.end,
                ..first.span
            };
            blocks.push(SurfaceBlock {
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
