//! Lists the fields that a file states, and sets fields by name.

use std::mem::discriminant;

use ivcam_base::diag::{Diagnostic, Result, nearest};

use super::document::{ClassRef, Document, FieldEntry, NodeRef};
use crate::grammar::FieldType;
use crate::grammar::value::{NodeId, Value};

impl<'a> NodeRef<'a> {
    /// Returns the names and values of the fields that the file states, in the order of the file.
    pub fn stated_fields(self) -> impl Iterator<Item = (&'a str, &'a Value)> {
        let fields = self.data().fields.iter();
        fields.filter_map(move |f| Some((self.declared(usize::from(f.index))?.0, &f.value)))
    }

    /// Returns the name and type of a field of the node's class.
    fn declared(self, index: usize) -> Option<(&'a str, FieldType)> {
        match self.data().class {
            ClassRef::Known(id) => id.get().fields.get(index).map(|f| (f.name, f.kind)),
            ClassRef::Extension(i) => {
                let fields = &self.document.extensions[i as usize].fields;
                fields.get(index).map(|(name, kind)| (&**name, *kind))
            }
        }
    }
}

impl Document {
    /// Sets a field of a node. Engines and routes that compute the field still do. The document
    /// is written without it if the node is in another file or in an instance of a proto, as
    /// [`Document::unwritten_edits`] says.
    ///
    /// # Errors
    /// Returns an error if the node's class has no such field, or a field of another type.
    pub fn set(&mut self, node: NodeId, field: &str, value: Value) -> Result<()> {
        let at = self.node(node);
        let declared = (0..).map_while(|i| at.declared(i));
        let fields: Vec<(&str, FieldType)> = declared.collect();
        let Some(index) = fields.iter().position(|(name, _)| *name == field) else {
            let message = format!("`{}` has no field `{field}`", at.class_name());
            let error = Diagnostic::error(message);
            return Err(match nearest(field, fields.iter().map(|f| f.0)) {
                Some(name) => error.with_help(format!("there is `{name}`")),
                None => error,
            });
        };
        let kind = fields[index].1;
        if discriminant(&value) != discriminant(&Value::empty(kind)) {
            let message = format!("`{field}` of `{}` is {}", at.class_name(), kind.name());
            return Err(Diagnostic::error(message));
        }
        let id = at.id;
        self.store(id, index as u16, value);
        self.edited.insert(id);
        Ok(())
    }

    /// Stores the value of a field by its index in the node's class.
    pub(crate) fn store(&mut self, id: NodeId, index: u16, value: Value) {
        let node = &mut self.nodes[id.0 as usize];
        let span = node.span;
        match node.fields.iter_mut().find(|f| f.index == index) {
            Some(entry) => {
                entry.value = value;
                entry.ignored = false;
            }
            None => node.fields.push(FieldEntry::new(index, value, span)),
        }
    }
}

#[cfg(test)]
mod tests {
    use std::sync::Arc;

    use super::*;
    use crate::iv::{Format, Limits, NoFiles};

    fn read(text: &str) -> Document {
        let bytes = format!("#Inventor V2.1 ascii\n{text}").into_bytes();
        Document::read("a.iv", bytes, Arc::new(NoFiles), &Limits::default()).expect("reads")
    }

    #[test]
    fn a_field_that_is_set_is_stated_and_written() {
        let mut document = read("Cone { height 3 }");
        let cone = document.roots[0];
        document
            .set(cone, "bottomRadius", Value::Float(7.0))
            .expect("a field");
        document
            .set(cone, "height", Value::Float(4.0))
            .expect("a field");
        let stated: Vec<&str> = document.node(cone).stated_fields().map(|f| f.0).collect();
        assert_eq!(stated, ["height", "bottomRadius"]);
        let text = String::from_utf8(document.write(Format::Ascii)).expect("text");
        assert!(
            text.contains("height 4") && text.contains("bottomRadius 7"),
            "{text}"
        );
    }

    #[test]
    fn a_field_of_a_protos_instance_is_written_in_binary_alone_and_the_loss_is_reported() {
        let text = b"#VRML V2.0 utf8\nPROTO Ball [ ] { Sphere { } } Shape { geometry Ball { } }";
        let mut document = Document::read(
            "a.wrl",
            text.to_vec(),
            Arc::new(NoFiles),
            &Limits::default(),
        )
        .expect("reads");
        let ball = document.descendants().find(|n| n.class_name() == "Sphere");
        let ball = ball.expect("a ball").id;
        assert!(document.unwritten_edits(Format::Ascii).is_empty());
        document
            .set(ball, "radius", Value::Float(7.0))
            .expect("a field");
        assert_eq!(document.losses(Format::Ascii)[0].node, Some(ball));
        let binary = document.in_inventor(Format::Binary);
        assert!(binary.unwritten_edits(Format::Binary).is_empty());
    }

    #[test]
    fn an_unknown_field_or_another_type_is_refused_and_changes_nothing() {
        let mut document = read("Cone { } Own { fields [ SFFloat size ] size 2 }");
        let (cone, own) = (document.roots[0], document.roots[1]);
        let error = document
            .set(cone, "heigth", Value::Float(1.0))
            .expect_err("unknown");
        assert!(error.message.contains("no field `heigth`"));
        assert_eq!(error.help.as_deref(), Some("there is `height`"));
        let error = document
            .set(cone, "height", Value::Bool(true))
            .expect_err("a flag");
        assert!(error.message.contains("SFFloat"), "{}", error.message);
        assert_eq!(document.node(cone).stated_fields().count(), 0);
        document
            .set(own, "size", Value::Float(5.0))
            .expect("a field of the file's own class");
        assert_eq!(document.node(own).value("size"), Some(&Value::Float(5.0)));
    }
}
