//! Describes how two lists of choices differ.

use super::counted;

/// The differences that are listed.
const MOST: usize = 3;
/// The longest value that is quoted. The description of a whole timeline is no use in a message.
const LONGEST: usize = 60;

/// Describes the first differences between two lists of keys and values. `places` says where each
/// list is, such as `there` and `here` for a file and this run.
pub fn differences(
    there: &[(&str, &str)],
    here: &[(&str, &str)],
    places: [&str; 2],
) -> Vec<String> {
    let value = |list: &[(&str, &str)], key: &str| {
        let found = list.iter().find(|(k, _)| *k == key);
        found.map(|(_, value)| (*value).to_owned())
    };
    let mut keys: Vec<&str> = there.iter().chain(here).map(|(k, _)| *k).collect();
    let mut seen = std::collections::HashSet::new();
    keys.retain(|key| seen.insert(*key));
    let mut found = Vec::new();
    for key in keys {
        let (a, b) = (value(there, key), value(here, key));
        if a == b {
            continue;
        }
        let is_short = |v: &Option<String>| v.as_ref().is_none_or(|v| v.len() <= LONGEST);
        let stated = |v: Option<String>| match v {
            None => "not stated".into(),
            Some(v) if v.is_empty() => "given".into(),
            Some(v) => v,
        };
        found.push(match is_short(&a) && is_short(&b) {
            true => {
                let [first, second] = places;
                format!("{key} is {} {first} and {} {second}", stated(a), stated(b))
            }
            false => format!("{key} differs"),
        });
    }
    if found.len() > MOST {
        let more = found.len() - MOST;
        found.truncate(MOST);
        found.push(counted(more, "more difference"));
    }
    found
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_message_lists_the_first_differences() {
        let long = "x".repeat(61);
        let there = [
            ("ivcam", "1"),
            ("samples", "4"),
            ("focus", "1"),
            ("coating", "none"),
        ];
        let here = [
            ("ivcam", "1"),
            ("samples", "8"),
            ("focus", &long),
            ("handles", ""),
        ];
        assert_eq!(
            differences(&there, &here, ["there", "here"]),
            [
                "samples is 4 there and 8 here",
                "focus differs",
                "coating is none there and not stated here",
                "1 more difference"
            ]
        );
        assert_eq!(
            differences(&[], &here[3..], ["there", "here"]),
            ["handles is not stated there and given here"]
        );
    }
}
