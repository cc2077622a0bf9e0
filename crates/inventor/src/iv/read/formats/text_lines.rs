//! The lines of a text file as words, with their places.

use std::str::FromStr;

use ivcam_base::diag::Span;

use crate::iv::read::header::without_mark;

/// A line with at least one word.
#[derive(Clone, Copy)]
pub(super) struct TextLine<'t> {
    /// The line without its end. It may continue over a backslash at the end of a line.
    pub text: &'t [u8],
    /// The offset of the line in the file.
    pub start: usize,
}

impl<'t> TextLine<'t> {
    /// The words of the line.
    pub(super) fn words(self) -> impl Iterator<Item = &'t str> + Clone {
        let words = self.text.split(u8::is_ascii_whitespace);
        let words = words.filter(|word| !word.is_empty() && *word != b"\\");
        words.map(|word| std::str::from_utf8(word).unwrap_or("\u{fffd}"))
    }

    /// The text after the first word.
    pub(super) fn after_first(self) -> String {
        let text = self.text.trim_ascii();
        let end = text
            .iter()
            .position(u8::is_ascii_whitespace)
            .unwrap_or(text.len());
        crate::iv::encoding::text(text[end..].trim_ascii())
    }

    /// The numbers after the first word, up to a word that is none.
    pub(super) fn numbers<T: FromStr>(self) -> impl Iterator<Item = T> {
        self.words().skip(1).map_while(|word| word.parse().ok())
    }

    /// The place of the line.
    pub(super) fn span(self) -> Span {
        Span::new(self.start, self.start + self.text.len())
    }
}

/// Returns the lines of a text that have words, after a byte-order mark.
pub(super) fn text_lines(text: &[u8]) -> impl Iterator<Item = TextLine<'_>> {
    let mut at = text.len() - without_mark(text).len();
    std::iter::from_fn(move || {
        loop {
            let rest = text.get(at..).filter(|rest| !rest.is_empty())?;
            let length = line_length(rest);
            let line = TextLine {
                text: &rest[..length],
                start: at,
            };
            at += length + 1;
            if !line.text.trim_ascii().is_empty() {
                return Some(line);
            }
        }
    })
}

/// Returns the length of the first line, with the lines that continue it.
fn line_length(rest: &[u8]) -> usize {
    let mut from = 0;
    loop {
        let end = rest[from..].iter().position(|b| matches!(b, b'\n' | b'\r'));
        let Some(end) = end.map(|end| from + end) else {
            return rest.len();
        };
        if end == 0 || rest[end - 1] != b'\\' {
            return end;
        }
        from = end + 1;
        if rest[end] == b'\r' && rest.get(from) == Some(&b'\n') {
            from += 1;
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn lines_may_continue_and_know_their_places() {
        let text = b"f 1 2 \\\r\n 3\r\n\n  g a b\nend";
        let lines: Vec<_> = text_lines(text).collect();
        let words: Vec<Vec<&str>> = lines.iter().map(|line| line.words().collect()).collect();
        assert_eq!(
            words,
            [vec!["f", "1", "2", "3"], vec!["g", "a", "b"], vec!["end"]]
        );
        assert_eq!(lines[1].after_first(), "a b");
        assert_eq!(lines[2].start, text.len() - 3);
    }
}
