//! Names the script or kind of a character, for messages.

/// A range of characters with a name.
struct Script {
    first: char,
    last: char,
    name: &'static str,
    /// Whether letters change their shapes and places with their neighbors. This is not supported
    /// but for Arabic (`arabic`).
    is_complex: bool,
}

const fn simple(first: char, last: char, name: &'static str) -> Script {
    Script {
        first,
        last,
        name,
        is_complex: false,
    }
}

const fn complex(first: char, last: char, name: &'static str) -> Script {
    Script {
        is_complex: true,
        ..simple(first, last, name)
    }
}

/// The scripts in the order of their characters (Unicode's blocks, neighbors joined).
const SCRIPTS: [Script; 57] = [
    simple('\u{0}', '\u{2ff}', "Latin"),
    simple('\u{300}', '\u{36f}', "accents"),
    simple('\u{370}', '\u{3ff}', "Greek"),
    simple('\u{400}', '\u{52f}', "Cyrillic"),
    simple('\u{530}', '\u{58f}', "Armenian"),
    simple('\u{590}', '\u{5ff}', "Hebrew"),
    simple('\u{600}', '\u{6ff}', "Arabic"),
    complex('\u{700}', '\u{74f}', "Syriac"),
    simple('\u{750}', '\u{77f}', "Arabic"),
    complex('\u{7c0}', '\u{7ff}', "N'Ko"),
    simple('\u{8a0}', '\u{8ff}', "Arabic"),
    complex('\u{900}', '\u{97f}', "Devanagari"),
    complex('\u{980}', '\u{9ff}', "Bengali"),
    complex('\u{a00}', '\u{a7f}', "Gurmukhi"),
    complex('\u{a80}', '\u{aff}', "Gujarati"),
    complex('\u{b00}', '\u{b7f}', "Odia"),
    complex('\u{b80}', '\u{bff}', "Tamil"),
    complex('\u{c00}', '\u{c7f}', "Telugu"),
    complex('\u{c80}', '\u{cff}', "Kannada"),
    complex('\u{d00}', '\u{d7f}', "Malayalam"),
    complex('\u{d80}', '\u{dff}', "Sinhala"),
    simple('\u{e00}', '\u{e7f}', "Thai"),
    simple('\u{e80}', '\u{eff}', "Lao"),
    complex('\u{f00}', '\u{fff}', "Tibetan"),
    complex('\u{1000}', '\u{109f}', "Burmese"),
    simple('\u{10a0}', '\u{10ff}', "Georgian"),
    simple('\u{1100}', '\u{11ff}', "Korean"),
    simple('\u{1200}', '\u{139f}', "Ethiopic"),
    simple('\u{13a0}', '\u{13ff}', "Cherokee"),
    complex('\u{1780}', '\u{17ff}', "Khmer"),
    complex('\u{1800}', '\u{18af}', "Mongolian"),
    simple('\u{1d00}', '\u{1dbf}', "phonetic"),
    simple('\u{1dc0}', '\u{1dff}', "accents"),
    simple('\u{1e00}', '\u{1eff}', "Latin"),
    simple('\u{1f00}', '\u{1fff}', "Greek"),
    simple('\u{2000}', '\u{206f}', "punctuation"),
    simple('\u{2070}', '\u{2bff}', "symbols"),
    simple('\u{2c60}', '\u{2c7f}', "Latin"),
    simple('\u{2de0}', '\u{2dff}', "Cyrillic"),
    simple('\u{2e00}', '\u{2e7f}', "punctuation"),
    simple('\u{2e80}', '\u{303f}', "Chinese"),
    simple('\u{3040}', '\u{30ff}', "Japanese"),
    simple('\u{3100}', '\u{312f}', "Chinese"),
    simple('\u{3130}', '\u{318f}', "Korean"),
    simple('\u{3190}', '\u{9fff}', "Chinese"),
    simple('\u{a000}', '\u{a4cf}', "Yi"),
    simple('\u{a640}', '\u{a69f}', "Cyrillic"),
    simple('\u{a720}', '\u{a7ff}', "Latin"),
    simple('\u{ac00}', '\u{d7ff}', "Korean"),
    simple('\u{e000}', '\u{f8ff}', "private"),
    simple('\u{f900}', '\u{faff}', "Chinese"),
    simple('\u{fb50}', '\u{fdff}', "Arabic"),
    simple('\u{fe70}', '\u{fefe}', "Arabic"),
    simple('\u{ff00}', '\u{ffef}', "full-width"),
    simple('\u{1d400}', '\u{1d7ff}', "mathematical"),
    simple('\u{1f000}', '\u{1faff}', "emoji"),
    simple('\u{20000}', '\u{3ffff}', "Chinese"),
];

fn entry(character: char) -> Option<&'static Script> {
    let after = SCRIPTS.partition_point(|s| s.first <= character);
    let script = &SCRIPTS[after.checked_sub(1)?];
    (character <= script.last).then_some(script)
}

/// Returns the name of a character's script, or `other`.
pub(super) fn script(character: char) -> &'static str {
    entry(character).map_or("other", |script| script.name)
}

/// Whether the letters of a character's script change with their neighbors in ways that are not
/// supported.
pub(super) fn is_complex(character: char) -> bool {
    entry(character).is_some_and(|script| script.is_complex)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_ranges_are_in_order_and_apart() {
        let ordered = SCRIPTS.windows(2).all(|s| s[0].last < s[1].first);
        assert!(ordered && SCRIPTS.iter().all(|s| s.first <= s.last));
    }

    #[test]
    fn characters_have_the_names_of_their_scripts() {
        for (character, name) in [
            ('a', "Latin"),
            ('Ж', "Cyrillic"),
            ('你', "Chinese"),
            ('日', "Chinese"),
            ('ひ', "Japanese"),
            ('한', "Korean"),
            ('ع', "Arabic"),
            ('→', "symbols"),
            ('😀', "emoji"),
            ('\u{10330}', "other"),
        ] {
            assert_eq!(script(character), name, "{character}");
        }
        assert!(is_complex('क') && !is_complex('ع'));
    }
}
