//! Names of groups and materials in files.

use std::collections::{HashMap, HashSet};

use super::target::Target;

/// The name of a picture beside a file with the given stem, counted from 0. It names the format, so
/// that neither another conversion of the scene nor a photograph of it has the same name.
pub(super) fn picture_name(stem: &str, target: Target, number: usize) -> String {
    format!("{stem}-{}-{}.png", target.endings()[0], number + 1)
}

/// Hands out names that are different from each other.
#[derive(Debug, Default)]
pub(super) struct Names {
    taken: HashSet<String>,
    /// The last number behind each name that was wanted again.
    last: HashMap<String, u64>,
}

impl Names {
    /// Hands out names that are different from some words too.
    pub(super) fn apart_from(words: &[&str]) -> Self {
        Self {
            taken: words.iter().map(|word| (*word).to_owned()).collect(),
            last: HashMap::new(),
        }
    }

    /// Returns a name, with a number behind it if it is taken. Other characters than letters of
    /// ASCII, digits and `_` become `_`, and a digit does not come first.
    pub(super) fn identifier(&mut self, wanted: &str) -> String {
        let plain = |c: char| if c.is_ascii_alphanumeric() { c } else { '_' };
        let mut name: String = wanted.chars().map(plain).collect();
        if !name.starts_with(|c: char| c.is_ascii_alphabetic() || c == '_') {
            name.insert(0, '_');
        }
        self.unused(name)
    }

    /// Returns a name, with a number behind it if it is taken.
    pub(super) fn unused(&mut self, wanted: String) -> String {
        if self.taken.insert(wanted.clone()) {
            return wanted;
        }
        let mut number = self.last.get(&wanted).copied().unwrap_or(1);
        loop {
            number += 1;
            let name = format!("{wanted}_{number}");
            if self.taken.insert(name.clone()) {
                self.last.insert(wanted, number);
                return name;
            }
        }
    }
}

/// Returns the name of a file with its control characters replaced by `_`. A line break would end
/// the line of a text file that contains the name.
pub(super) fn on_one_line(name: &str) -> String {
    let plain = |c: char| if c.is_control() { '_' } else { c };
    name.chars().map(plain).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn names_are_identifiers_and_each_is_given_once() {
        let mut names = Names::default();
        let given = ["a+b", "a b", "1", "", "Grüße"].map(|n| names.identifier(n));
        assert_eq!(given, ["a_b", "a_b_2", "_1", "_", "Gr__e"]);
    }

    /// With a search from 2 for each name this would take five billion steps.
    #[test]
    fn many_equal_names_get_consecutive_numbers() {
        let mut names = Names::default();
        assert_eq!(names.identifier("a_3"), "a_3");
        let given: Vec<String> = (0..100_000).map(|_| names.identifier("a")).collect();
        assert_eq!(given[..4], ["a", "a_2", "a_4", "a_5"]);
        assert_eq!(given[99_999], "a_100001");
    }

    #[test]
    fn names_of_files_stay_on_one_line() {
        assert_eq!(on_one_line("a b\r\n\u{7f}ü"), "a b___ü");
    }
}
