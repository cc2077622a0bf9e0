//! The diagnostics of drawing.

use std::collections::{HashMap, HashSet};
use std::sync::Arc;

use ivcam_base::diag::{Diagnostic, Severity, Source, Span};
use ivcam_inventor::grammar::value::Value;
use ivcam_inventor::grammar::{
    Class, appearance, class, vrml97_indexed_face_set as faces97, vrml97_shape,
};
use ivcam_inventor::iv::{NodeId, NodeRef};

use super::mistake::Mistake;
use crate::geometry::text::MissingCharacters;
use crate::scene::unapplied::{unapplied, unapplied_fields};

/// Collects diagnostics about shapes.
#[derive(Debug, Default)]
pub(crate) struct Reports {
    /// The diagnostics so far.
    pub diagnostics: Vec<Diagnostic>,
    /// The shapes whose missing parts were reported.
    reported: HashSet<NodeId>,
    /// The texts whose characters were counted.
    texts: HashSet<NodeId>,
    /// The characters of all texts that are not drawn as written, with warnings at the first text.
    missing: Option<(MissingCharacters, Option<Arc<Source>>, Span)>,
    /// The classes of nodes that were reported as not applied.
    unapplied: HashSet<&'static str>,
    /// The mistakes in the lists of the current shape.
    noted: Vec<Mistake>,
    /// The shapes whose mistakes were reported.
    mistaken: HashSet<NodeId>,
    /// The place among the diagnostics of each mistake of each class.
    mistakes: HashMap<(&'static str, Mistake), usize>,
}

impl Reports {
    /// Adds a diagnostic. Drawing goes on without what it is about, so an error becomes a warning.
    pub(crate) fn add(&mut self, mut diagnostic: Diagnostic) {
        diagnostic.severity = diagnostic.severity.min(Severity::Warning);
        self.diagnostics.push(diagnostic);
    }

    /// Reports that a shape is not drawn, with the reason.
    pub(crate) fn not_drawn(&mut self, node: NodeRef<'_>, what: &str) {
        let class = node.class_name();
        self.at(node, format!("this `{class}` is not drawn: {what}"), None);
    }

    /// Reports that a part of a shape is not drawn, with the reason.
    pub(crate) fn cut(&mut self, node: NodeRef<'_>, what: &str) {
        let class = node.class_name();
        self.at(
            node,
            format!("a part of this `{class}` is not drawn: {what}"),
            None,
        );
    }

    /// Reports that parts of a shape are left out, once for each node.
    pub(crate) fn bad_parts(&mut self, node: NodeRef<'_>) {
        if self.reported.insert(node.id) {
            let class = node.class_name();
            let help = "look for an index without a coordinate, a number that is NaN, infinite or above 1e18, or a scale of 0";
            self.at(
                node,
                format!("parts of this `{class}` are left out"),
                Some(help),
            );
        }
    }

    /// Notes a mistake in the lists of the current shape.
    pub(crate) fn note(&mut self, mistake: Mistake) {
        if !self.noted.contains(&mistake) {
            self.noted.push(mistake);
        }
    }

    /// Reports the mistakes that were noted. Each is reported once for a class, with the number of
    /// its nodes and the place of the first.
    pub(crate) fn mistakes(&mut self, node: NodeRef<'_>) {
        let noted = std::mem::take(&mut self.noted);
        if noted.is_empty() || !self.mistaken.insert(node.id) {
            return;
        }
        let class = node.known_class().map_or("", |class| class.name);
        for mistake in noted {
            match self.mistakes.get(&(class, mistake)) {
                Some(&first) => self.diagnostics[first].count += 1,
                None => {
                    self.mistakes
                        .insert((class, mistake), self.diagnostics.len());
                    self.at(node, format!("this `{class}` {}", mistake.text()), None);
                }
            }
        }
    }

    /// Counts the characters of a text that are not drawn as written, once for each node.
    pub(crate) fn characters(&mut self, node: NodeRef<'_>, missing: &MissingCharacters) {
        if missing.is_empty() || !self.texts.insert(node.id) {
            return;
        }
        let none = || {
            (
                MissingCharacters::default(),
                node.source().cloned(),
                node.span(),
            )
        };
        let (all, ..) = self.missing.get_or_insert_with(none);
        all.add(missing);
    }

    /// Returns the diagnostics, with those about the characters of all texts.
    pub(crate) fn finish(mut self) -> Vec<Diagnostic> {
        if let Some((missing, source, span)) = self.missing {
            for warning in missing.warnings() {
                let warning = match &source {
                    Some(source) => warning.at(source, span),
                    None => warning,
                };
                self.diagnostics.push(*warning);
            }
        }
        self.diagnostics
    }

    /// Reports a node that would change the picture and is not applied, once for each class.
    pub(crate) fn not_applied(&mut self, node: NodeRef<'_>) {
        // The walk does not enter the points of a shape of VRML97.
        let is_vrml97 = node.known_class().is_some_and(Class::is_vrml97);
        if let Some(points) = node.get_node(faces97::COORD).filter(|_| is_vrml97) {
            self.not_applied_itself(points);
        }
        if !is_vrml97 || !node.document.is_x3d() {
            self.not_applied_itself(node);
            return;
        }
        if node.class_id() == Some(class::VRML97_SHAPE) {
            self.appearance_not_applied(node);
        }
        let is_hidden = node.value("visible") == Some(&Value::Bool(false));
        if is_hidden && self.unapplied.insert("visible") {
            let message = "`visible FALSE` is not applied: the node is drawn".to_owned();
            self.at(node, message, None);
        }
        self.not_applied_itself(node);
    }

    /// Reports what the appearance and the geometry of a shape of X3D hold and is not applied. The
    /// walk does not enter them.
    fn appearance_not_applied(&mut self, shape: NodeRef<'_>) {
        let geometry = shape.get_node(vrml97_shape::GEOMETRY);
        if let Some(points) = geometry.and_then(|g| g.get_node(faces97::TEX_COORD)) {
            self.not_applied_itself(points);
        }
        let Some(look) = shape.get_node(vrml97_shape::APPEARANCE) else {
            return;
        };
        let fields = [
            appearance::LINE_PROPERTIES,
            appearance::POINT_PROPERTIES,
            appearance::FILL_PROPERTIES,
        ];
        for held in fields.into_iter().filter_map(|field| look.get_node(field)) {
            self.not_applied_itself(held);
        }
        let material = look.get_node(appearance::MATERIAL);
        for node in [Some(look), material].into_iter().flatten() {
            let class = node.known_class().map_or("", |class| class.name);
            for (field, lack) in unapplied_fields(node) {
                if !self.unapplied.insert(field) {
                    continue;
                }
                self.at(
                    node,
                    format!("`{class}.{field}` is not applied: {lack}"),
                    None,
                );
            }
        }
        let texture = look.get_node(appearance::TEXTURE);
        if let Some(texture) = texture.filter(|t| t.class_id() == Some(class::MULTI_TEXTURE))
            && self.unapplied.insert("MultiTexture")
        {
            let message = "`MultiTexture` is not applied: its first texture is drawn".to_owned();
            self.at(texture, message, None);
        }
    }

    fn not_applied_itself(&mut self, node: NodeRef<'_>) {
        let Some(lack) = unapplied(node) else { return };
        let class = node.known_class().map_or("", |class| class.name);
        if self.unapplied.insert(class) {
            self.at(node, format!("`{class}` is not applied: {lack}"), None);
        }
    }

    /// Adds a warning at the place of a node.
    fn at(&mut self, node: NodeRef<'_>, message: String, help: Option<&str>) {
        let mut warning = Diagnostic::warning(message);
        if let Some(source) = node.source() {
            warning = warning.at(source, node.span());
        }
        if let Some(help) = help {
            warning = warning.with_help(help);
        }
        self.add(*warning);
    }
}
