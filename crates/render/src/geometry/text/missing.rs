//! Counts the characters of texts that are not drawn as they are written, and reports them.

use ivcam_base::diag::{Diagnostic, ErrorKind, counted};

use super::scripts::{is_complex, script};

/// The characters of texts that no typeface has, and those that are not drawn as their script asks.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub(crate) struct MissingCharacters {
    /// The number of characters without a glyph, by script, in the order of first occurrence.
    missing: Vec<(&'static str, u64)>,
    /// The first character without a glyph.
    first: Option<char>,
    /// The number of characters that should change with their neighbors, by script.
    unshaped: Vec<(&'static str, u64)>,
}

impl MissingCharacters {
    /// Whether every character was drawn as written.
    pub(crate) fn is_empty(&self) -> bool {
        self.missing.is_empty() && self.unshaped.is_empty()
    }

    /// Counts a character that is drawn, or that no typeface has.
    pub(super) fn see(&mut self, character: char, is_drawn: bool) {
        if !is_drawn {
            self.first.get_or_insert(character);
            count(&mut self.missing, script(character), 1);
        } else if is_complex(character) {
            count(&mut self.unshaped, script(character), 1);
        }
    }

    /// Adds the characters of another text.
    pub(crate) fn add(&mut self, other: &Self) {
        self.first = self.first.or(other.first);
        for &(name, number) in &other.missing {
            count(&mut self.missing, name, number);
        }
        for &(name, number) in &other.unshaped {
            count(&mut self.unshaped, name, number);
        }
    }

    /// Returns the warnings about these characters: at most one about missing glyphs, and one about
    /// unsupported scripts.
    pub(crate) fn warnings(&self) -> Vec<Box<Diagnostic>> {
        let mut out = Vec::new();
        if let Some(first) = self.first {
            let number = self.missing.iter().map(|m| m.1).sum::<u64>();
            let characters = counted(number as usize, "character");
            let (are, boxes) = match number {
                1 => ("is in no typeface and is", "a box"),
                _ => ("are in no typeface and are", "boxes"),
            };
            let message = format!(
                "{characters} {are} drawn as {boxes}: {}; the first is `{first}` (U+{:04X})",
                listed(&self.missing),
                u32::from(first)
            );
            let help = "`--fonts FOLDER` with a typeface that has them draws them";
            out.push(unsupported(message, help));
        }
        if !self.unshaped.is_empty() {
            let message = format!(
                "letters that should change with their neighbors are drawn one by one: {}",
                listed(&self.unshaped)
            );
            let help = "of such scripts only Arabic is supported";
            out.push(unsupported(message, help));
        }
        out
    }
}

fn unsupported(message: String, help: &str) -> Box<Diagnostic> {
    let warning = Diagnostic::warning(message);
    warning.of_kind(ErrorKind::Unsupported).with_help(help)
}

/// Adds a number of characters of a script.
fn count(list: &mut Vec<(&'static str, u64)>, name: &'static str, number: u64) {
    match list.iter_mut().find(|(known, _)| *known == name) {
        Some((_, sum)) => *sum += number,
        None => list.push((name, number)),
    }
}

/// Returns the numbers with their scripts, as in `4 Chinese, 2 Thai`.
fn listed(list: &[(&'static str, u64)]) -> String {
    let items = list.iter().map(|(name, number)| format!("{number} {name}"));
    items.collect::<Vec<_>>().join(", ")
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_warning_has_the_numbers_of_all_texts() {
        let seen = |text: &str, is_drawn| {
            let mut out = MissingCharacters::default();
            text.chars().for_each(|c| out.see(c, is_drawn));
            out
        };
        let mut all = seen("abc", true);
        assert!(all.is_empty() && all.warnings().is_empty());
        all.add(&seen("你好", false));
        all.add(&seen("日a", false));
        all.add(&seen("क", true));
        let warnings = all.warnings();
        let messages: Vec<&str> = warnings.iter().map(|w| w.message.as_str()).collect();
        assert_eq!(
            messages,
            [
                "4 characters are in no typeface and are drawn as boxes: 3 Chinese, 1 Latin; \
                 the first is `你` (U+4F60)",
                "letters that should change with their neighbors are drawn one by one: 1 Devanagari",
            ]
        );
        let one = seen("😀", false).warnings();
        assert!(one[0].message.starts_with("1 character is in no typeface"));
    }
}
