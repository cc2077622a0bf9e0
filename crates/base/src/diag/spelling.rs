//! Names in messages: the known name that is nearest to a misspelt one, and the beginnings of long
//! ones.

use std::borrow::Cow;

/// Returns the candidate with the smallest edit distance from `word`, for "did you mean".
///
/// Case does not count. Candidates at a distance of more than 1 + length/4 are too different. No
/// search is recorded: a larger bound suggests unrelated words, and a smaller one misses two
/// letters in the wrong order (`the_nearest_word_is_found_and_a_far_one_is_not`).
pub fn nearest<'a>(word: &str, candidates: impl IntoIterator<Item = &'a str>) -> Option<&'a str> {
    let limit = 1 + word.len() / 4;
    candidates
        .into_iter()
        .map(|c| (edit_distance(&word.to_lowercase(), &c.to_lowercase()), c))
        .filter(|(d, _)| *d <= limit)
        .min_by_key(|(d, _)| *d)
        .map(|(_, c)| c)
}

/// Returns the Levenshtein distance between two words. It keeps only one row of the table.
fn edit_distance(a: &str, b: &str) -> usize {
    let b: Vec<char> = b.chars().collect();
    let mut row: Vec<usize> = (0..=b.len()).collect();
    for (i, x) in a.chars().enumerate() {
        let mut diagonal = row[0];
        row[0] = i + 1;
        for (j, y) in b.iter().enumerate() {
            let cost = diagonal + usize::from(x != *y);
            diagonal = row[j + 1];
            row[j + 1] = cost.min(diagonal + 1).min(row[j] + 1);
        }
    }
    row[b.len()]
}

/// The longest name of a file that a message quotes, in characters.
const LONGEST_NAME: usize = 40;
/// The longest path of a file that a message quotes, in characters.
const LONGEST_PATH: usize = 255;

/// Returns a name from a file for a message: its first 40 characters. A damaged file can have
/// kilobytes where a name should be.
pub fn excerpt(name: &str) -> Cow<'_, str> {
    excerpt_to(name, LONGEST_NAME)
}

/// Returns the path or address of a file that another file names, for a message: its first 255
/// characters, as many as a name on most disks can have.
pub fn excerpt_path(path: &str) -> Cow<'_, str> {
    excerpt_to(path, LONGEST_PATH)
}

/// Returns a text with U+FFFD in place of control characters, so that a name is part of one line
/// and cannot command a terminal.
pub fn printable(text: &str) -> String {
    text.replace(char::is_control, "\u{fffd}")
}

/// Returns at most `longest` characters of a text, with `…` in place of the rest, and U+FFFD in
/// place of control characters.
fn excerpt_to(text: &str, longest: usize) -> Cow<'_, str> {
    let end = text.char_indices().nth(longest).map(|(end, _)| end);
    let start = &text[..end.unwrap_or(text.len())];
    if end.is_none() && !start.contains(char::is_control) {
        return Cow::Borrowed(text);
    }
    let more = if end.is_some() { "…" } else { "" };
    Cow::Owned(printable(start) + more)
}

/// Returns a number with a noun: `1 node`, `2 nodes`.
pub fn counted(n: usize, what: &str) -> String {
    format!("{n} {what}{}", if n == 1 { "" } else { "s" })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_nearest_word_is_found_and_a_far_one_is_not() {
        assert_eq!(
            nearest("hieght", ["height", "bottomRadius"]),
            Some("height")
        );
        assert_eq!(nearest("colour", ["shininess"]), None);
    }

    #[test]
    fn a_long_name_is_cut_and_control_characters_are_replaced() {
        assert!(matches!(
            excerpt("bottomRadius"),
            Cow::Borrowed("bottomRadius")
        ));
        let long = "é".repeat(2000);
        assert_eq!(excerpt(&long), format!("{}…", "é".repeat(40)));
        assert_eq!(excerpt("a\u{0}b\n"), "a\u{fffd}b\u{fffd}");
        assert_eq!(excerpt_to("abc", 2), "ab…");
    }
}
