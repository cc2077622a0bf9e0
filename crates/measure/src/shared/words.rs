//! The options of a measuring program's command line.

/// Returns the word behind an option, if the option is given.
pub(crate) fn value_of<'a>(name: &str, words: &'a [String]) -> Option<&'a String> {
    words.iter().skip_while(|word| *word != name).nth(1)
}
