//! Node kits, which arrange their parts in a tree.

use std::sync::OnceLock;

use super::frame::WalkFrame;
use crate::grammar::{self, KitPart, Role};
use crate::iv::{Document, Node, NodeId, NodeRef};

/// Pushes the kit's parts on the stack, with the first part on top.
pub(super) fn plan<'a>(kit: NodeRef<'a>, stack: &mut Vec<WalkFrame<'a>>) {
    let Some(class) = kit.known_class() else {
        return;
    };
    let mut plan = Vec::new();
    for &child in &kit.data().children {
        plan.push(WalkFrame::Visit(child));
    }
    parts_below("this", kit, class.parts, 0, &mut plan);
    stack.extend(plan.into_iter().rev());
}

/// Plans the parts below the part `parent`. Parts are nested at most 16 deep, which bounds a
/// catalogue entry that names itself as its parent; the deepest kit in the catalogue needs fewer.
fn parts_below<'a>(
    parent: &str,
    kit: NodeRef<'a>,
    parts: &'static [KitPart],
    depth: usize,
    plan: &mut Vec<WalkFrame<'a>>,
) {
    if depth > 16 {
        return;
    }
    for part in parts.iter().filter(|p| p.parent == parent) {
        if part.name == "callbackList" {
            continue;
        }
        let stated = kit.nodes_named(part.name);
        if parts.iter().any(|p| p.parent == part.name) {
            inner(part, stated, kit, parts, depth, plan);
        } else if let Some(&id) = stated.first() {
            plan.push(WalkFrame::Visit(id));
        } else if part.made
            && let Some(node) = default_node(part.class)
        {
            plan.push(WalkFrame::VisitDefault(node));
        }
    }
}

/// Plans a part with other parts below it. It is a separator or a group that the kit makes.
fn inner<'a>(
    part: &'static KitPart,
    stated: &'a [NodeId],
    kit: NodeRef<'a>,
    parts: &'static [KitPart],
    depth: usize,
    plan: &mut Vec<WalkFrame<'a>>,
) {
    let class = stated
        .first()
        .and_then(|&id| kit.document.node(id).known_class())
        .or_else(|| grammar::any(part.class));
    let role = class.map_or(Role::Group, |c| c.role);
    if role == Role::Switch {
        return; // this part is visible only during a drag
    }
    let mut scope = Vec::new();
    if let Some(&id) = stated.first() {
        let children = &kit.document.node(id).data().children;
        scope.extend(children.iter().map(|&c| WalkFrame::Visit(c)));
    }
    parts_below(part.name, kit, parts, depth + 1, &mut scope);
    match role {
        Role::Separator | Role::TransformSeparator => plan.push(WalkFrame::Scope {
            inner: scope,
            matrix_only: role == Role::TransformSeparator,
        }),
        _ => plan.extend(scope),
    }
}

/// Returns a node of a class with default values, for a part that the file does not contain.
fn default_node(class: &str) -> Option<NodeRef<'static>> {
    static DEFAULTS: OnceLock<Document> = OnceLock::new();
    let document = DEFAULTS.get_or_init(|| {
        let mut document = Document::default();
        for class in grammar::CLASSES {
            document.add(Node::synthetic(class, Vec::new(), Vec::new()));
        }
        document
    });
    let id = NodeId(u32::from(grammar::any(class)?.id.0));
    Some(document.node(id))
}
