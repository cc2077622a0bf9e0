//! A walk over all nodes of a document that a scene can reach, each once.

use super::document::{Document, NodeRef};
use crate::grammar::value::{NodeId, Value};

impl Document {
    /// Returns every node below the roots, the roots included, each once and in the order of the
    /// file.
    ///
    /// A node held in a field counts as below the node that has the field: the `Material` of a
    /// VRML97 `Appearance`, the texture of an `AppearanceKit`. So do the nodes of a file that the
    /// scene includes, and the body of a `PROTO` in place of its instance. An instance that is used
    /// several times is returned where it is first met.
    pub fn descendants(&self) -> Descendants<'_> {
        Descendants::below(self, self.roots.iter().rev().copied().collect())
    }
}

impl<'a> NodeRef<'a> {
    /// Returns this node and every node below it, as [`Document::descendants`] does.
    pub fn descendants(self) -> Descendants<'a> {
        Descendants::below(self.document, vec![self.id])
    }
}

/// The iterator of [`Document::descendants`].
#[derive(Clone)]
pub struct Descendants<'a> {
    document: &'a Document,
    /// Nodes still to be returned, the next one last.
    pending: Vec<NodeId>,
    seen: Vec<bool>,
}

impl<'a> Descendants<'a> {
    fn below(document: &'a Document, pending: Vec<NodeId>) -> Self {
        let seen = vec![false; document.nodes.len()];
        Self {
            document,
            pending,
            seen,
        }
    }
}

impl<'a> Iterator for Descendants<'a> {
    type Item = NodeRef<'a>;

    fn next(&mut self) -> Option<NodeRef<'a>> {
        while let Some(id) = self.pending.pop() {
            let node = self.document.node(id);
            let seen = &mut self.seen[node.id.0 as usize];
            if std::mem::replace(seen, true) {
                continue;
            }
            // Pushed in reverse, because the last one pushed is the next one returned.
            let children: Vec<NodeId> = node.children().map(|c| c.id).collect();
            self.pending.extend(children.iter().rev());
            for field in node.data().fields.iter().rev().filter(|f| !f.ignored) {
                match &field.value {
                    Value::Node(Some(id)) => self.pending.push(*id),
                    Value::Nodes(ids) => self.pending.extend(ids.iter().rev()),
                    _ => {}
                }
            }
            return Some(node);
        }
        None
    }
}

#[cfg(test)]
mod tests {
    use std::sync::Arc;

    use super::*;
    use crate::iv::{Limits, NoFiles};

    fn classes(text: &str) -> Vec<String> {
        let bytes = text.as_bytes().to_vec();
        let document = Document::read("a.wrl", bytes, Arc::new(NoFiles), &Limits::default());
        let document = document.unwrap();
        let nodes = document.descendants();
        nodes.map(|n| n.class_name().to_owned()).collect()
    }

    #[test]
    fn nodes_in_fields_are_reached_in_the_order_of_the_file() {
        let text = "#VRML V2.0 utf8\nTransform { children [
            Shape { appearance Appearance { material Material { } } geometry Box { } }
            Shape { geometry Sphere { } } ] }";
        let expected = [
            "Transform",
            "Shape",
            "Appearance",
            "Material",
            "Box",
            "Shape",
            "Sphere",
        ];
        assert_eq!(classes(text), expected);
    }

    #[test]
    fn a_shared_node_is_returned_once() {
        let text = "#Inventor V2.1 ascii\nSeparator { DEF A Cone { } USE A } USE A";
        assert_eq!(classes(text), ["Separator", "Cone"]);
    }

    #[test]
    fn the_body_of_a_proto_represents_its_instance() {
        let text = "#VRML V2.0 utf8\nPROTO Ball [] { Shape { geometry Sphere { } } } Ball { }";
        assert_eq!(classes(text), ["Shape", "Sphere"]);
    }
}
