//! Names of groups and materials in files.

use std::collections::HashSet;

/// Hands out names that are different from each other.
#[derive(Debug, Default)]
pub(super) struct Names {
    taken: HashSet<String>,
}

impl Names {
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
        let mut name = wanted.clone();
        let mut number = 1;
        while !self.taken.insert(name.clone()) {
            number += 1;
            name = format!("{wanted}_{number}");
        }
        name
    }
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
}
