//! What drawing has to report.

use std::collections::HashSet;

use crate::diag::Diagnostic;
use crate::iv::{NodeId, NodeRef};

#[derive(Debug, Default)]
pub(crate) struct Reports {
    pub diagnostics: Vec<Diagnostic>,
    /// Shapes of which was reported that parts are left out.
    reported: HashSet<NodeId>,
}

impl Reports {
    pub(crate) fn add(&mut self, diagnostic: Diagnostic) {
        self.diagnostics.push(diagnostic);
    }

    pub(crate) fn not_drawn(&mut self, node: NodeRef<'_>, what: &str) {
        let class = node.class_name();
        self.at(node, format!("this `{class}` is not drawn: {what}"), None);
    }

    /// Reports that a shape is not drawn whole, once a node.
    pub(crate) fn bad_parts(&mut self, node: NodeRef<'_>) {
        if self.reported.insert(node.id) {
            let class = node.class_name();
            let help = "an index without a coordinate, a number that is none or far too large, or a scale of 0";
            self.at(
                node,
                format!("parts of this `{class}` are left out"),
                Some(help),
            );
        }
    }

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
