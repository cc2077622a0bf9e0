//! The diagnostics of drawing.

use std::collections::HashSet;

use ivcam_base::diag::Diagnostic;
use ivcam_inventor::iv::{NodeId, NodeRef};

/// Collects diagnostics about shapes.
#[derive(Debug, Default)]
pub(crate) struct Reports {
    /// The diagnostics so far.
    pub diagnostics: Vec<Diagnostic>,
    /// The shapes whose missing parts were reported.
    reported: HashSet<NodeId>,
}

impl Reports {
    /// Adds a diagnostic.
    pub(crate) fn add(&mut self, diagnostic: Diagnostic) {
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
