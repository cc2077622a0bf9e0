//! The internal entities that a file's document type declaration declares (XML 1.0, 4.2.1).

use std::borrow::Cow;
use std::collections::HashMap;

use quick_xml::escape::{EscapeError, resolve_predefined_entity, unescape_with};

/// The most bytes that the entities of a file may stand for in all. It ends files whose entities
/// double with each declaration.
const MOST: usize = 1 << 24;

/// The entities by name, with the texts that they stand for.
pub(super) struct Entities {
    texts: HashMap<Box<str>, String>,
    /// The number of bytes that may still be put in place of entities.
    left: usize,
}

impl Default for Entities {
    fn default() -> Self {
        Self {
            texts: HashMap::new(),
            left: MOST,
        }
    }
}

impl Entities {
    /// Reads the declarations. Of several with one name the first counts. Parameter entities and
    /// those of other files are left out.
    pub(super) fn read(doctype: &str) -> Self {
        let mut entities = Self::default();
        let mut rest = doctype;
        while let Some(start) = rest.find('<') {
            rest = &rest[start..];
            if let Some(comment) = rest.strip_prefix("<!--") {
                rest = comment.split_once("-->").map_or("", |(_, after)| after);
            } else if let Some((name, text, after)) = declaration(rest) {
                entities.declare(name, text);
                rest = after;
            } else {
                rest = &rest[1..];
            }
        }
        entities
    }

    /// Declares an entity. Its text may contain entities that are declared before.
    fn declare(&mut self, name: &str, text: &str) {
        let text = self
            .expanded(text)
            .map_or_else(|_| text.into(), Cow::into_owned);
        self.texts.entry(name.into()).or_insert(text);
    }

    /// Returns whether the file declares an entity.
    pub(super) fn declares(&self, name: &str) -> bool {
        self.texts.contains_key(name)
    }

    /// Returns a text with the texts of its entities in place of them.
    ///
    /// # Errors
    /// Returns an error if an entity is not declared, or if the entities stand for too many bytes.
    pub(super) fn expanded<'x>(&mut self, raw: &'x str) -> Result<Cow<'x, str>, EscapeError> {
        let (texts, left) = (&self.texts, &mut self.left);
        unescape_with(raw, |name| {
            let Some(text) = texts.get(name) else {
                return resolve_predefined_entity(name);
            };
            *left = left.checked_sub(text.len())?;
            Some(text.as_str())
        })
    }
}

/// Returns the name and the text of the entity that is declared at the start of a text, and the
/// rest.
fn declaration(text: &str) -> Option<(&str, &str, &str)> {
    let declared = text.strip_prefix("<!ENTITY")?;
    let (name, value) = declared
        .trim_start()
        .split_once(|c: char| c.is_ascii_whitespace())?;
    let value = value.trim_start();
    let quote = value.chars().next().filter(|c| matches!(c, '"' | '\''))?;
    let (text, rest) = value[1..].split_once(quote)?;
    Some((name, text, rest))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn an_entity_stands_for_its_text_and_for_the_entities_in_it() {
        let mut entities = Entities::read(
            "X3D [ <!-- <!ENTITY a 'no'> --> <!ENTITY a \"1 0\"> <!ENTITY b '&a; &#48;'>
             <!ENTITY a 'later'> <!ENTITY % c 'parameter'> <!ENTITY d SYSTEM 'file'> ]",
        );
        assert_eq!(entities.expanded("&b;, &lt;").unwrap(), "1 0 0, <");
        for unknown in ["&c;", "&d;"] {
            assert!(entities.expanded(unknown).is_err(), "{unknown}");
        }
        assert!(entities.declares("b") && !entities.declares("d"));
    }

    #[test]
    fn entities_that_double_end() {
        let mut text = "<!ENTITY e0 'twice'>".to_owned();
        for i in 1..100 {
            let before = i - 1;
            text += &format!("<!ENTITY e{i} '&e{before};&e{before};'>");
        }
        let mut entities = Entities::read(&text);
        assert!(entities.texts.values().map(String::len).sum::<usize>() < 2 * MOST);
        assert!(entities.expanded("&e99;").is_err() || entities.left < MOST);
    }
}
