//! Compares the numbers that a Markdown page states with measured ones, and corrects the page.
//!
//! A table is between `<!-- numbers: NAME -->` and `<!-- end -->`. A number in a sentence is found
//! by the words around it.

use std::ops::Range;

/// Measured numbers, with the places where a page states them.
#[derive(Default)]
pub(super) struct PageNumbers {
    /// The names of tables, with their text, which ends with a line break.
    pub tables: Vec<(&'static str, String)>,
    pub phrases: Vec<Phrase>,
}

/// Words of a page with measured values among them.
pub(super) struct Phrase {
    /// The words. Each `{}` is a value without spaces. Line breaks of the page do not matter.
    pub words: &'static str,
    pub values: Vec<String>,
}

/// A place where a page differs from what is measured.
pub(super) struct PageCorrection {
    place: Range<usize>,
    right: String,
    /// What is wrong, for a message.
    pub message: String,
}

impl PageNumbers {
    /// Adds a phrase with its values.
    pub(super) fn phrase<const N: usize>(&mut self, words: &'static str, values: [String; N]) {
        let values = values.into();
        self.phrases.push(Phrase { words, values });
    }

    /// Returns where a page differs from these numbers.
    ///
    /// # Errors
    /// Fails with a message if the page lacks a table or a phrase.
    pub(super) fn corrections(&self, page: &str) -> Result<Vec<PageCorrection>, String> {
        let mut found = Vec::new();
        for (name, table) in &self.tables {
            let place = table_in(page, name).ok_or(format!("there is no table `{name}`"))?;
            let right = table.clone();
            if page[place.clone()] != right {
                let stated = page[place.clone()].lines();
                let message = match stated.zip(right.lines()).find(|(a, b)| a != b) {
                    Some((stated, right)) => format!("{name}: {stated}\n  is    {right}"),
                    None => format!("{name}: the table has another length"),
                };
                found.push(PageCorrection {
                    place,
                    right,
                    message,
                });
            }
        }
        let words = words_of(page);
        for Phrase {
            words: text,
            values,
        } in &self.phrases
        {
            let places = places_of(text, page, &words);
            let places = places
                .first()
                .ok_or(format!("there are no words `{text}`"))?;
            for (place, right) in places.iter().zip(values) {
                let stated = &page[place.clone()];
                if stated != right {
                    found.push(PageCorrection {
                        message: format!("{text}: {stated} is {right}"),
                        place: place.clone(),
                        right: right.clone(),
                    });
                }
            }
        }
        Ok(found)
    }

    /// Returns the words of a page with digits that are neither measured nor input: commands, code,
    /// links, and the words of `given`.
    pub(super) fn unexplained<'p>(&self, page: &'p str, given: &[&str]) -> Vec<&'p str> {
        let words = words_of(page);
        let tables = self.tables.iter().filter_map(|t| table_in(page, t.0));
        let phrases = self.phrases.iter().map(|p| p.words);
        let phrases = phrases.chain(given.iter().copied());
        let stated = phrases.flat_map(|text| spans_of(text, page, &words));
        let explained: Vec<Range<usize>> = tables.chain(stated).collect();
        let is_explained = |w: &Range<usize>| explained.iter().any(|e| e.contains(&w.start));
        let numbers = words.iter().filter(|w| {
            let text = &page[(*w).clone()];
            let has_digit = text.contains(|c: char| c.is_ascii_digit());
            let is_input = text.starts_with('`') || text.contains("](") || is_code(page, w.start);
            has_digit && !is_input && !is_explained(w)
        });
        numbers.map(|w| &page[w.clone()]).collect()
    }
}

/// Returns a page with corrections.
pub(super) fn corrected(page: &str, mut corrections: Vec<PageCorrection>) -> String {
    corrections.sort_by_key(|c| c.place.start);
    let mut text = page.to_owned();
    for PageCorrection { place, right, .. } in corrections.into_iter().rev() {
        text.replace_range(place, &right);
    }
    text
}

/// Returns the place of a table between its marks, without the empty lines beside them.
fn table_in(page: &str, name: &str) -> Option<Range<usize>> {
    let mark = format!("<!-- numbers: {name} -->\n\n");
    let start = page.find(&mark)? + mark.len();
    let end = page[start..].find("\n<!-- end -->")?;
    Some(start..start + end)
}

/// Returns the places of the words of a page.
fn words_of(page: &str) -> Vec<Range<usize>> {
    let start = |word: &str| word.as_ptr() as usize - page.as_ptr() as usize;
    let words = page.split_whitespace();
    words.map(|w| start(w)..start(w) + w.len()).collect()
}

/// Returns for each place where a page has these words the places of the values.
fn places_of(text: &str, page: &str, words: &[Range<usize>]) -> Vec<Vec<Range<usize>>> {
    let wanted: Vec<&str> = text.split_whitespace().collect();
    let matched = |at: &[Range<usize>]| -> Option<Vec<Range<usize>>> {
        let mut values = Vec::new();
        for (word, wanted) in at.iter().zip(&wanted) {
            let stated = &page[word.clone()];
            let Some((before, after)) = wanted.split_once("{}") else {
                if stated != *wanted {
                    return None;
                }
                continue;
            };
            stated.strip_prefix(before)?.strip_suffix(after)?;
            values.push(word.start + before.len()..word.end - after.len());
        }
        Some(values)
    };
    words.windows(wanted.len()).filter_map(matched).collect()
}

/// Returns the places where a page has these words, from the first to the last.
fn spans_of(text: &str, page: &str, words: &[Range<usize>]) -> Vec<Range<usize>> {
    let count = text.split_whitespace().count();
    let spans = words.windows(count);
    let spans = spans.filter(|at| !places_of(text, page, at).is_empty());
    spans.map(|at| at[0].start..at[count - 1].end).collect()
}

/// Returns whether a place of a page is in a command or between backticks.
fn is_code(page: &str, place: usize) -> bool {
    let line = page[..place].rfind('\n').map_or(0, |n| n + 1);
    let before = &page[line..place];
    before.starts_with("    ") || before.matches('`').count() % 2 == 1
}
