//! The sentence that says what a render is going to make.

use std::path::Path;

use indexmap::IndexMap;

/// Returns the sentence about a picture of `scene` with these choices, which are those of the
/// picture's metadata.
pub(super) fn announcement(scene: &Path, choices: &IndexMap<String, String>) -> String {
    let choice = |key: &str| choices.get(key).map(String::as_str);
    let through = match (choice("lens"), choice("efl")) {
        (Some(lens), Some(efl)) => {
            let stop = choice("f-number").map(|stop| format!(" at {stop}"));
            let focus = choice("focus").map(|focus| match focus {
                "inf m" => ", focused at infinity".to_owned(),
                _ => format!(", focused at {focus}"),
            });
            let [stop, focus] = [stop, focus].map(Option::unwrap_or_default);
            format!(" through {lens} of {}{stop}{focus}", rounded(efl))
        }
        (Some("none (pinhole)"), _) => " by a pinhole".to_owned(),
        (Some(lens), None) => format!(" through a lens {lens}"),
        (None, _) => String::new(),
    };
    let [size, samples, model] =
        ["size", "samples", "shading"].map(|key| choice(key).unwrap_or("?"));
    let each = if samples == "1" { "sample" } else { "samples" };
    format!(
        "photographing {}{through}: {size} pixels, {samples} {each} each, model {model}",
        scene.display()
    )
}

/// Returns a length in millimeters with as many digits as a photographer would say.
fn rounded(length: &str) -> String {
    let number = length
        .strip_suffix(" mm")
        .and_then(|number| number.parse().ok());
    match number {
        Some(number) if number < 10.0 => format!("{number:.1} mm"),
        Some(number) => format!("{:.0} mm", f64::round(number)),
        None => length.to_owned(),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_sentence_says_what_is_made() {
        let said = |choices: &[(&str, &str)]| {
            let all = [("size", "6x4"), ("shading", "path")];
            let choices = choices.iter().chain(&all);
            let choices = choices.map(|(key, value)| (key.to_string(), value.to_string()));
            announcement(Path::new("a.iv"), &choices.collect())
        };
        let lens = [
            ("lens", "double-gauss"),
            ("efl", "49.996 mm"),
            ("f-number", "f/2.02"),
            ("focus", "0.8 m"),
            ("samples", "up to 64"),
        ];
        assert_eq!(
            said(&lens),
            "photographing a.iv through double-gauss of 50 mm at f/2.02, focused at 0.8 m: \
             6x4 pixels, up to 64 samples each, model path"
        );
        assert_eq!(
            said(&[("lens", "none (pinhole)"), ("samples", "1")]),
            "photographing a.iv by a pinhole: 6x4 pixels, 1 sample each, model path"
        );
    }
}
