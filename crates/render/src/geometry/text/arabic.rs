//! Replaces Arabic letters by their joined forms.
//!
//! A letter looks different alone, and where it joins the letter before or after it. Unicode has a
//! character for each of these forms, which typefaces with Arabic letters usually have too
//! (Arabic Presentation Forms A and B). Letters without such characters stay as they are.

use unicode_normalization::char::canonical_combining_class;

/// On which sides a character joins others.
#[derive(Clone, Copy, PartialEq)]
enum Joins {
    /// On neither side.
    None,
    /// To the letter before it.
    Before,
    /// On both sides.
    Both,
}

/// The letters with their first form. The others follow it: alone, at the end of a word, and for
/// letters that join on both sides at the beginning and in the middle.
const FORMS: [(char, char, Joins); 50] = [
    ('\u{622}', '\u{fe81}', Joins::Before),
    ('\u{623}', '\u{fe83}', Joins::Before),
    ('\u{624}', '\u{fe85}', Joins::Before),
    ('\u{625}', '\u{fe87}', Joins::Before),
    ('\u{626}', '\u{fe89}', Joins::Both),
    ('\u{627}', '\u{fe8d}', Joins::Before),
    ('\u{628}', '\u{fe8f}', Joins::Both),
    ('\u{629}', '\u{fe93}', Joins::Before),
    ('\u{62a}', '\u{fe95}', Joins::Both),
    ('\u{62b}', '\u{fe99}', Joins::Both),
    ('\u{62c}', '\u{fe9d}', Joins::Both),
    ('\u{62d}', '\u{fea1}', Joins::Both),
    ('\u{62e}', '\u{fea5}', Joins::Both),
    ('\u{62f}', '\u{fea9}', Joins::Before),
    ('\u{630}', '\u{feab}', Joins::Before),
    ('\u{631}', '\u{fead}', Joins::Before),
    ('\u{632}', '\u{feaf}', Joins::Before),
    ('\u{633}', '\u{feb1}', Joins::Both),
    ('\u{634}', '\u{feb5}', Joins::Both),
    ('\u{635}', '\u{feb9}', Joins::Both),
    ('\u{636}', '\u{febd}', Joins::Both),
    ('\u{637}', '\u{fec1}', Joins::Both),
    ('\u{638}', '\u{fec5}', Joins::Both),
    ('\u{639}', '\u{fec9}', Joins::Both),
    ('\u{63a}', '\u{fecd}', Joins::Both),
    ('\u{641}', '\u{fed1}', Joins::Both),
    ('\u{642}', '\u{fed5}', Joins::Both),
    ('\u{643}', '\u{fed9}', Joins::Both),
    ('\u{644}', '\u{fedd}', Joins::Both),
    ('\u{645}', '\u{fee1}', Joins::Both),
    ('\u{646}', '\u{fee5}', Joins::Both),
    ('\u{647}', '\u{fee9}', Joins::Both),
    ('\u{648}', '\u{feed}', Joins::Before),
    ('\u{649}', '\u{feef}', Joins::Before),
    ('\u{64a}', '\u{fef1}', Joins::Both),
    ('\u{671}', '\u{fb50}', Joins::Before),
    ('\u{679}', '\u{fb66}', Joins::Both),
    ('\u{67e}', '\u{fb56}', Joins::Both),
    ('\u{686}', '\u{fb7a}', Joins::Both),
    ('\u{688}', '\u{fb88}', Joins::Before),
    ('\u{691}', '\u{fb8c}', Joins::Before),
    ('\u{698}', '\u{fb8a}', Joins::Before),
    ('\u{6a9}', '\u{fb8e}', Joins::Both),
    ('\u{6af}', '\u{fb92}', Joins::Both),
    ('\u{6ba}', '\u{fb9e}', Joins::Before),
    ('\u{6be}', '\u{fbaa}', Joins::Both),
    ('\u{6c0}', '\u{fba4}', Joins::Before),
    ('\u{6c1}', '\u{fba6}', Joins::Both),
    ('\u{6cc}', '\u{fbfc}', Joins::Both),
    ('\u{6d2}', '\u{fbae}', Joins::Before),
];

/// The letters that form a ligature with a lam before them, and the ligature.
const AFTER_LAM: [(char, char); 4] = [
    ('\u{622}', '\u{fef5}'),
    ('\u{623}', '\u{fef7}'),
    ('\u{625}', '\u{fef9}'),
    ('\u{627}', '\u{fefb}'),
];

const LAM: char = '\u{644}';
/// The stroke that lengthens a word. It joins on both sides and has one form.
const TATWEEL: char = '\u{640}';
const JOINER: char = '\u{200d}';

/// Replaces letters by their joined forms, in the order of reading. `has` tells whether a typeface
/// has a character.
pub(super) fn joined(text: &[char], has: &dyn Fn(char) -> bool) -> Vec<char> {
    let mut out = Vec::with_capacity(text.len());
    let mut before = Joins::None;
    let mut at = 0;
    while at < text.len() {
        let letter = text[at];
        if is_transparent(letter) {
            out.push(letter);
            at += 1;
            continue;
        }
        let joins_before = before == Joins::Both;
        if letter == LAM
            && let Some(ligature) = ligature(text.get(at + 1), joins_before)
            && has(ligature)
        {
            out.push(ligature);
            before = Joins::Before;
            at += 2;
            continue;
        }
        let mut after = text[at + 1..].iter().copied();
        let next = after.find(|c| !is_transparent(*c));
        let joins_after = next.is_some_and(|next| joins(next) != Joins::None);
        let form = form(letter, joins_before, joins_after).filter(|form| has(*form));
        out.push(form.unwrap_or(letter));
        before = joins(letter);
        at += 1;
    }
    out
}

/// Whether a character is not noticed between two letters that join. The search for the next letter
/// passes over it.
fn is_transparent(character: char) -> bool {
    character >= '\u{300}' && canonical_combining_class(character) != 0
}

/// Returns on which sides a character joins others.
fn joins(letter: char) -> Joins {
    match letter {
        TATWEEL | JOINER => Joins::Both,
        _ => entry(letter).map_or(Joins::None, |(_, _, joins)| *joins),
    }
}

fn entry(letter: char) -> Option<&'static (char, char, Joins)> {
    let found = FORMS.binary_search_by_key(&letter, |(letter, _, _)| *letter);
    found.ok().map(|i| &FORMS[i])
}

/// Returns the form of a letter that joins the letters before and after it, or not.
fn form(letter: char, before: bool, after: bool) -> Option<char> {
    let (_, first, joins) = entry(letter)?;
    let offset = match (before, after && *joins == Joins::Both) {
        (false, false) => 0,
        (true, false) => 1,
        (false, true) => 2,
        (true, true) => 3,
    };
    char::from_u32(u32::from(*first) + offset)
}

/// Returns the ligature of a lam with the letter after it, if they form one.
fn ligature(next: Option<&char>, joins_before: bool) -> Option<char> {
    let (_, first) = AFTER_LAM.iter().find(|(alef, _)| Some(alef) == next)?;
    char::from_u32(u32::from(*first) + u32::from(joins_before))
}

#[cfg(test)]
mod tests {
    use super::*;
    use unicode_normalization::UnicodeNormalization;

    fn join(word: &str) -> String {
        let letters: Vec<char> = word.chars().collect();
        joined(&letters, &|_| true).into_iter().collect()
    }

    /// Unicode's compatibility decomposition of a form is its letter.
    #[test]
    fn every_form_is_one_of_its_letter() {
        for (letter, first, joins) in FORMS {
            let count = if joins == Joins::Both { 4 } else { 2 };
            for form in (u32::from(first)..).take(count).filter_map(char::from_u32) {
                // Letters with a hamza decompose further.
                let plain: String = form.nfkd().nfc().collect();
                assert_eq!(plain, letter.to_string(), "{form:x?}");
            }
        }
        for (alef, first) in AFTER_LAM {
            for form in (u32::from(first)..).take(2).filter_map(char::from_u32) {
                let plain: String = form.nfkd().nfc().collect();
                assert_eq!(plain, String::from_iter([LAM, alef]));
            }
        }
        assert!(FORMS.is_sorted_by_key(|(letter, _, _)| *letter));
    }

    /// The word for Arabic: the ra does not join the letter after it.
    #[test]
    fn letters_of_a_word_join_their_neighbors() {
        assert_eq!(join("عربى"), "\u{fecb}\u{feae}\u{fe91}\u{fef0}");
        // A vowel sign does not separate letters; a space does.
        assert_eq!(join("ب\u{64e}ب"), "\u{fe91}\u{64e}\u{fe90}");
        assert_eq!(join("ب ب"), "\u{fe8f} \u{fe8f}");
        // Lam and alef are one glyph, joined to the letter before it or not.
        assert_eq!(join("لا بلا"), "\u{fefb} \u{fe91}\u{fefc}");
    }

    #[test]
    fn letters_without_forms_in_the_typeface_stay() {
        let word: Vec<char> = "بلا".chars().collect();
        assert_eq!(joined(&word, &|_| false), word);
        assert_eq!(join("abc"), "abc");
    }

    /// A search for the next letter at each of many marks would take the square of their number.
    #[test]
    fn many_marks_take_no_long_time() {
        let word = "ب".to_owned() + &"\u{64e}".repeat(200_000);
        assert_eq!(join(&word).chars().count(), 200_001);
    }
}
