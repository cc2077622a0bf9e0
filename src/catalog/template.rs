//! What the templates of pages share: the escaping of texts, the style, and the script that filters
//! and sorts the table of a page.

use std::fmt::{self, Display, Write};

use ivcam_base::memory::size_text;
use minijinja::Environment;

use super::links::joined;
use super::numbers::{date, thousands};

/// The style of a page with a table.
pub(crate) const STYLE: &str = include_str!("page.css");
/// The script of a page with a table. It sorts by the column that `data-sort` of the table names.
pub(crate) const SCRIPT: &str = include_str!("page.js");

/// A text that displays escaped for HTML, between tags and in quoted attributes.
///
/// Control characters are left out, and so are the characters that change the direction of text,
/// with which a name could disguise what follows it.
struct EscapedText<'t>(&'t str);

impl Display for EscapedText<'_> {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        for c in self.0.chars() {
            match c {
                '&' => f.write_str("&amp;")?,
                '<' => f.write_str("&lt;")?,
                '>' => f.write_str("&gt;")?,
                '"' => f.write_str("&quot;")?,
                '\'' => f.write_str("&#39;")?,
                '\u{202a}'..='\u{202e}' | '\u{2066}'..='\u{2069}' | '\u{200e}' | '\u{200f}' => {}
                c if c.is_control() => f.write_char(' ')?,
                c => f.write_char(c)?,
            }
        }
        Ok(())
    }
}

/// Returns the environment of a page's template, which escapes every text that is not marked as
/// safe. The filter `address` encodes a path, `date` shows a time in seconds since the beginning of
/// 1970, `size_text` a number of bytes, and `thousands` groups digits.
pub(crate) fn environment() -> Environment<'static> {
    let mut templates = Environment::new();
    templates.set_formatter(|out, _, value| match value.as_str() {
        Some(text) if !value.is_safe() => Ok(write!(out, "{}", EscapedText(text))?),
        _ => Ok(write!(out, "{value}")?),
    });
    templates.add_filter("address", |path: &str| joined("", path));
    templates.add_filter("date", date);
    templates.add_filter("size_text", size_text);
    templates.add_filter("thousands", thousands);
    templates
}
