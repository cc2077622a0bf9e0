//! Describes how two lists of choices differ.

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
        let or_none = |v: Option<String>| v.unwrap_or_else(|| "none".into());
        found.push(match is_short(&a) && is_short(&b) {
            true => {
                let [first, second] = places;
                format!(
                    "{key} is {} {first} and {} {second}",
                    or_none(a),
                    or_none(b)
                )
            }
            false => format!("{key} differs"),
        });
    }
    if found.len() > MOST {
        let more = found.len() - MOST;
        found.truncate(MOST);
        found.push(format!("{more} more differences"));
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
            ("timeline", "a"),
        ];
        let here = [
            ("ivcam", "1"),
            ("samples", "8"),
            ("focus", &long),
            ("seed", "3"),
        ];
        assert_eq!(
            differences(&there, &here, ["there", "here"]),
            [
                "samples is 4 there and 8 here",
                "focus differs",
                "timeline is a there and none here",
                "1 more differences"
            ]
        );
    }
}
