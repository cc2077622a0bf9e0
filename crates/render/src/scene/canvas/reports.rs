//! The diagnostics of drawing.

use std::collections::{HashMap, HashSet};
use std::sync::Arc;

use ivcam_base::diag::{Diagnostic, Severity, Source, Span};
use ivcam_inventor::iv::{NodeId, NodeRef};

use super::mistake::Mistake;
use crate::geometry::text::MissingCharacters;
use crate::scene::unapplied::{Unapplied, unapplied};

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
    /// The classes of nodes, and the fields, that were reported as not applied.
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

    /// Reports what would change the picture and is not applied of a node, once for each class and
    /// field.
    pub(crate) fn not_applied(&mut self, node: NodeRef<'_>) {
        for Unapplied { node, field, lack } in unapplied(node) {
            let class = node.known_class().map_or("", |class| class.name);
            if self.unapplied.insert(field.unwrap_or(class)) {
                let name = field.map_or_else(|| class.to_owned(), |f| format!("{class}.{f}"));
                self.at(node, format!("`{name}` is not applied: {lack}"), None);
            }
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
