//! A document of XML as a tree of elements.

use quick_xml::escape::unescape;
use quick_xml::events::{BytesStart, Event};
use quick_xml::{Reader, XmlVersion};

/// An element with its attributes, children and text.
#[derive(Default)]
pub(super) struct XmlElement {
    pub(super) name: String,
    pub(super) attributes: Vec<(String, String)>,
    pub(super) children: Vec<XmlElement>,
    /// The text directly inside the element, `CDATA` sections included.
    pub(super) text: String,
}

impl XmlElement {
    /// Returns the value of an attribute.
    pub(super) fn get(&self, name: &str) -> Option<&str> {
        let of_name = self.attributes.iter().find(|(n, _)| n == name);
        of_name.map(|(_, value)| value.as_str())
    }

    /// Returns the children of a name.
    pub(super) fn named(&self, name: &'static str) -> impl Iterator<Item = &XmlElement> {
        self.children.iter().filter(move |c| c.name == name)
    }
}

/// Reads a document. The root of the result has no name, and the document's elements as children.
///
/// # Errors
/// The text is not well-formed; the message says where.
pub(super) fn parse(text: &str) -> Result<XmlElement, String> {
    let mut reader = Reader::from_str(text);
    let mut open = vec![XmlElement::default()];
    loop {
        let event = reader.read_event();
        let place = reader.buffer_position();
        let wrong = |what: String| format!("byte {place}: {what}");
        match event.map_err(|e| wrong(e.to_string()))? {
            Event::Start(start) => open.push(element(&start).map_err(wrong)?),
            Event::Empty(start) => {
                let leaf = element(&start).map_err(wrong)?;
                parent(&mut open).children.push(leaf);
            }
            Event::End(_) => {
                let done = open.pop().unwrap_or_default();
                parent(&mut open).children.push(done);
            }
            Event::Text(text) => parent(&mut open).text.push_str(&text),
            Event::CData(text) => parent(&mut open).text.push_str(&text),
            Event::GeneralRef(name) => {
                let name = format!("&{};", &*name);
                let letter = unescape(&name).map_err(|e| wrong(e.to_string()))?;
                parent(&mut open).text.push_str(&letter);
            }
            Event::Eof if open.len() == 1 => return Ok(open.remove(0)),
            Event::Eof => return Err(wrong("an element is not closed".to_string())),
            _ => {}
        }
    }
}

/// Returns the element that is open. The first of the stack is never closed: the reader checks that
/// tags match.
fn parent(open: &mut Vec<XmlElement>) -> &mut XmlElement {
    if open.is_empty() {
        open.push(XmlElement::default());
    }
    let last = open.len() - 1;
    &mut open[last]
}

fn element(start: &BytesStart<'_>) -> Result<XmlElement, String> {
    let mut attributes = Vec::new();
    for attribute in start.attributes() {
        let attribute = attribute.map_err(|e| e.to_string())?;
        let name = attribute.key.as_ref().to_owned();
        let value = attribute
            .normalized_value(XmlVersion::Implicit1_0)
            .map_err(|e| e.to_string())?;
        attributes.push((name, value.into_owned()));
    }
    Ok(XmlElement {
        name: start.name().as_ref().to_owned(),
        attributes,
        ..XmlElement::default()
    })
}

#[cfg(test)]
mod tests {
    use super::parse;

    #[test]
    fn a_document_is_a_tree_with_attributes_and_texts() {
        let text =
            "<?xml version='1.0'?><!DOCTYPE a><a b='1 &lt; 2'><c/>x &amp; <![CDATA[<y>]]></a>";
        let root = parse(text).expect("it is well-formed");
        let a = root.named("a").next().expect("it is there");
        assert_eq!(a.get("b"), Some("1 < 2"));
        assert_eq!(
            (a.children[0].name.as_str(), a.text.as_str()),
            ("c", "x & <y>")
        );
        assert!(parse("<a>").is_err() && parse("<a></b>").is_err());
    }
}
