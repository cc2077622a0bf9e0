//! Turns a line of text into the characters whose glyphs are drawn, in the order of drawing.
//!
//! Letters and accents are composed (Unicode's normalization form C), Arabic letters get their
//! joined forms, and right-to-left letters are put in visual order (Unicode's bidirectional
//! algorithm). What only controls these steps is dropped.

use unicode_bidi::ParagraphBidiInfo;
use unicode_normalization::UnicodeNormalization;
use unicode_normalization::char::{canonical_combining_class, compose, decompose_canonical};

use super::arabic;

/// The order in which the characters of a line are returned.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum LetterOrder {
    /// From left to right.
    Visual,
    /// As they are read, for text that advances to the left or downward.
    Logical,
}

/// The characters below this one are neither composed nor reordered.
const FIRST_COMPLEX: char = '\u{300}';

/// The largest number of characters of one text. The rest of a longer text is not drawn.
pub(crate) const MAX_GLYPHS: usize = 250_000;
/// The largest number of characters that are read. Two become one glyph at most after they were
/// composed, so that a line with too many glyphs is found to be too long.
const MAX_CHARACTERS: usize = 2 * (MAX_GLYPHS + 1);

/// Returns the characters of a line whose glyphs are drawn, and one more if there are too many, so
/// that the layout finds that the line is too long. `has` tells whether a typeface has a
/// character.
pub(super) fn letters(text: &str, order: LetterOrder, has: &dyn Fn(char) -> bool) -> Vec<char> {
    let shown = text.chars().filter(|c| !is_dropped(*c));
    let shown = shown.map(|c| if c == '\t' { ' ' } else { c });
    if text.chars().all(|c| c < FIRST_COMPLEX) {
        return shown.take(MAX_GLYPHS + 1).collect();
    }
    let mut room = MAX_CHARACTERS;
    let fits = |c: &char| {
        room -= usize::from(!is_format(*c));
        room > 0
    };
    let mut composed = Vec::new();
    for character in shown.nfc().take_while(fits) {
        push_available(character, has, &mut composed);
    }
    let joined = arabic::joined(&composed, has);
    let ordered = match order {
        LetterOrder::Visual => visual(joined),
        LetterOrder::Logical => joined,
    };
    let drawn = ordered.into_iter().filter(|c| !is_format(*c));
    drawn.take(MAX_GLYPHS + 1).collect()
}

/// Whether a character is drawn on the letter before it.
pub(super) fn is_mark(character: char) -> bool {
    character >= FIRST_COMPLEX && canonical_combining_class(character) != 0
}

/// Whether a character ends a line or controls a device.
fn is_dropped(character: char) -> bool {
    let is_separator = matches!(character, '\u{2028}' | '\u{2029}');
    character.is_control() && character != '\t' || is_separator
}

/// Whether a character only controls how others are drawn (Unicode's
/// `Default_Ignorable_Code_Point`, but for the soft hyphen, which old fonts draw).
fn is_format(character: char) -> bool {
    matches!(character,
        '\u{34f}' | '\u{61c}' | '\u{115f}'..='\u{1160}' | '\u{17b4}'..='\u{17b5}'
        | '\u{180b}'..='\u{180f}' | '\u{200b}'..='\u{200f}' | '\u{202a}'..='\u{202e}'
        | '\u{2060}'..='\u{206f}' | '\u{3164}' | '\u{fe00}'..='\u{fe0f}' | '\u{feff}'
        | '\u{ffa0}' | '\u{fff0}'..='\u{fffb}' | '\u{1bca0}'..='\u{1bca3}'
        | '\u{1d173}'..='\u{1d17a}' | '\u{e0000}'..='\u{e0fff}')
}

/// Adds a character, or its letter and marks if only these are in a typeface. The letter takes as
/// many of the marks as it can.
fn push_available(character: char, has: &dyn Fn(char) -> bool, out: &mut Vec<char>) {
    let first = out.len();
    if character >= FIRST_COMPLEX && !is_format(character) && !has(character) {
        decompose_canonical(character, |part| {
            let letter = out[first..].last().copied();
            let composed = letter.and_then(|letter| compose(letter, part));
            if let Some(composed) = composed.filter(|c| has(*c)) {
                out.pop();
                out.push(composed);
            } else {
                out.push(part);
            }
        });
        if out[first..].iter().all(|part| has(*part)) {
            return;
        }
        out.truncate(first);
    }
    out.push(character);
}

/// Returns the characters of a line from left to right.
fn visual(line: Vec<char>) -> Vec<char> {
    let text: String = line.iter().collect();
    let info = ParagraphBidiInfo::new(&text, None);
    if !info.has_rtl() {
        return line;
    }
    let (levels, runs) = info.visual_runs(0..text.len());
    let mut out = Vec::with_capacity(line.len());
    for run in runs {
        if levels[run.start].is_rtl() {
            push_reversed(&text[run], &mut out);
        } else {
            out.extend(text[run].chars());
        }
    }
    out
}

/// Adds characters in reverse. Marks stay after the letter on which they are drawn, and brackets
/// are mirrored.
fn push_reversed(run: &str, out: &mut Vec<char>) {
    let first = out.len();
    let mut marks = Vec::new();
    for character in run.chars().rev() {
        if is_mark(character) {
            marks.push(character);
        } else {
            out.push(mirrored(character));
            out.extend(marks.drain(..).rev());
        }
    }
    // Marks without a letter are at the beginning of the run.
    out.extend(marks.drain(..).rev());
    debug_assert_eq!(out.len() - first, run.chars().count());
}

/// Returns the mirror image of a bracket, and other characters unchanged.
fn mirrored(character: char) -> char {
    const PAIRS: [(char, char); 9] = [
        ('(', ')'),
        ('<', '>'),
        ('[', ']'),
        ('{', '}'),
        ('«', '»'),
        ('‹', '›'),
        ('≤', '≥'),
        ('⟨', '⟩'),
        ('⟦', '⟧'),
    ];
    let of = |&(open, close): &(char, char)| match character {
        c if c == open => Some(close),
        c if c == close => Some(open),
        _ => None,
    };
    PAIRS.iter().find_map(of).unwrap_or(character)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn line(text: &str) -> String {
        letters(text, LetterOrder::Visual, &|_| true)
            .into_iter()
            .collect()
    }

    #[test]
    fn the_first_characters_stay_as_they_are() {
        let all: String = (' '..'\u{300}').filter(|c| !c.is_control()).collect();
        assert_eq!(line(&all), all);
        assert_eq!(line("a\tb\r\n\u{7f}"), "a b");
    }

    #[test]
    fn accents_are_composed_if_a_typeface_has_the_letter_and_else_not() {
        assert_eq!(line("Pr\u{30c}i\u{301}klad"), "Příklad");
        let has_none = |c: char| !('\u{1e00}'..'\u{1f00}').contains(&c);
        let parts = letters("ế", LetterOrder::Visual, &has_none);
        assert_eq!(parts, ['ê', '\u{301}']);
        assert_eq!(letters("ế", LetterOrder::Visual, &|_| false), ['ế']);
    }

    /// A Hebrew word is drawn from right to left, numbers and Latin words inside it from left to
    /// right, and a bracket opens toward its text.
    #[test]
    fn right_to_left_words_are_in_visual_order() {
        assert_eq!(line("שלום"), "םולש");
        assert_eq!(line("abc שלום def"), "abc םולש def");
        assert_eq!(line("שלום 12 (abc)"), "(abc) 12 םולש");
        assert_eq!(line("(שלום)"), "(םולש)");
        // The vowel stays with its letter.
        assert_eq!(line("ש\u{5b8}לום"), "םולש\u{5b8}");
        let read = letters("שלום", LetterOrder::Logical, &|_| true);
        assert_eq!(read.into_iter().collect::<String>(), "שלום");
    }

    #[test]
    fn control_and_format_characters_are_not_drawn() {
        assert_eq!(line("\u{feff}a\u{200d}b\u{2066}c\u{2069}\u{fe0f}"), "abc");
        assert_eq!(line("\u{202e}abc\u{202c}"), "cba");
        assert_eq!(line("a\u{2028}\u{2029}b"), "ab");
    }

    #[test]
    fn hostile_lines_are_bounded() {
        let nested = "\u{202b}(".repeat(300_000);
        assert_eq!(line(&nested).chars().count(), MAX_GLYPHS + 1);
        let marks = "a".to_owned() + &"\u{301}".repeat(600_000);
        assert_eq!(line(&marks).chars().count(), MAX_GLYPHS + 1);
        let hidden = "\u{200d}".repeat(600_000) + "é";
        assert_eq!(line(&hidden), "é");
    }
}
