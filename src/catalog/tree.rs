//! The nodes of a scene and its problems, as the page of the scene shows them.

use std::collections::HashSet;

use ivcam_inventor::iv::{ClassRef, Document, NodeId, NodeRef};
use ivcam_inventor::traversal::each_child;
use serde::{Deserialize, Serialize};

use super::entry::Message;

/// The largest number of nodes and of problems on a page, and the depth of the tree. Browsers limit
/// the depth of elements to 512, and each level takes two.
const MOST_NODES: usize = 2000;
pub(super) const MOST_PROBLEMS: usize = 500;
const DEEPEST: usize = 100;
/// The largest number of characters of a name or of a list of fields.
const LONGEST: usize = 120;

/// What the page of a scene shows and `catalog.json` does not have. It is the content of a file
/// beside the page.
#[derive(Debug, Default, Serialize, Deserialize)]
pub(super) struct SceneDetail {
    /// The addresses of the files that the scene needs, relative to this file. The built page
    /// fetches them.
    pub files: Vec<String>,
    /// The nodes in the order of the file, each before those below it.
    pub nodes: Vec<TreeNode>,
    /// The number of nodes that are left out.
    pub nodes_left_out: usize,
    /// The problems, the most severe first.
    pub problems: Vec<Message>,
}

/// A node of the tree.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub(super) struct TreeNode {
    /// The number of nodes above it.
    pub depth: usize,
    pub class: String,
    /// The name after `DEF`.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub name: Option<String>,
    /// The line in its file, counted from 1, if that is text.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub line: Option<u32>,
    /// The file, if it is not the scene's own.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub file: Option<String>,
    /// The names of the fields that the file states.
    #[serde(default, skip_serializing_if = "String::is_empty")]
    pub fields: String,
    /// Whether the node is above in the tree already, where the nodes below it are.
    #[serde(default, skip_serializing_if = "std::ops::Not::not")]
    pub again: bool,
}

/// Returns the nodes of a document, and the number of those that are left out.
pub(super) fn tree(document: &Document) -> (Vec<TreeNode>, usize) {
    let (mut list, mut seen, mut is_cut) = (Vec::new(), HashSet::new(), false);
    let mut waiting: Vec<(NodeId, usize)> =
        document.roots.iter().rev().map(|&id| (id, 0)).collect();
    while let Some((id, depth)) = waiting.pop() {
        if list.len() == MOST_NODES {
            is_cut = true;
            break;
        }
        let again = !seen.insert(id);
        list.push(TreeNode {
            again,
            ..tree_node(document, id, depth)
        });
        let mut below = Vec::new();
        if !again {
            each_child(document, id, |child| below.push((child, depth + 1)));
        }
        is_cut |= depth == DEEPEST && !below.is_empty();
        if depth < DEEPEST {
            waiting.extend(below.into_iter().rev());
        }
    }
    let reached = || document.descendants().count();
    let left_out = if is_cut {
        reached().saturating_sub(seen.len())
    } else {
        0
    };
    (list, left_out)
}

fn tree_node(document: &Document, id: NodeId, depth: usize) -> TreeNode {
    // Not `document.node`, which returns the first node of a prototype's body.
    let node = NodeRef { document, id };
    let data = node.data();
    let names: Vec<&str> = match data.class {
        ClassRef::Known(class) => {
            let fields = class.get().fields;
            let name = |index: u16| fields.get(usize::from(index)).map(|field| field.name);
            data.fields
                .iter()
                .filter_map(|field| name(field.index))
                .collect()
        }
        ClassRef::Extension(_) => Vec::new(),
    };
    let source = node
        .source()
        .filter(|source| !source.binary && data.span.end > data.span.start);
    TreeNode {
        depth,
        class: shortened(node.class_name()),
        name: data.name.as_deref().map(shortened),
        line: source.map(|source| source.line_column(data.span.start).0),
        file: source.filter(|_| data.source > 0).map(|source| {
            let name = std::path::Path::new(&source.name)
                .file_name()
                .unwrap_or_default();
            shortened(&name.to_string_lossy())
        }),
        fields: shortened(&names.join(", ")),
        again: false,
    }
}

/// Returns a text, cut to [`LONGEST`] characters.
fn shortened(text: &str) -> String {
    match text.char_indices().nth(LONGEST) {
        Some((end, _)) => format!("{}…", &text[..end]),
        None => text.to_owned(),
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use ivcam_inventor::iv::{Limits, NoFiles};
    use std::sync::Arc;

    fn tree_of(text: &str) -> (Vec<TreeNode>, usize) {
        let bytes = text.as_bytes().to_vec();
        let document = Document::read("a", bytes, Arc::new(NoFiles), &Limits::default());
        tree(&document.unwrap())
    }

    #[test]
    fn a_node_that_is_used_again_is_shown_without_what_is_below_it() {
        let (list, left_out) = tree_of(
            "#Inventor V2.1 ascii\nSeparator {\n  DEF A Group { Cube { width 2 } }\n  USE A\n}\n",
        );
        let lines: Vec<_> = list
            .iter()
            .map(|n| (n.depth, &*n.class, n.line, n.again, &*n.fields))
            .collect();
        let expected = [
            (0, "Separator", Some(2), false, ""),
            (1, "Group", Some(3), false, ""),
            (2, "Cube", Some(3), false, "width"),
            (1, "Group", Some(3), true, ""),
        ];
        assert_eq!(lines, expected);
        assert_eq!((list[1].name.as_deref(), left_out), (Some("A"), 0));
    }

    #[test]
    fn a_large_and_a_deep_tree_are_cut_and_say_so() {
        let many = format!("#Inventor V2.1 ascii\n{}", "Cube { }\n".repeat(2500));
        let (list, left_out) = tree_of(&many);
        assert_eq!((list.len(), left_out), (MOST_NODES, 500));
        let deep = format!(
            "#Inventor V2.1 ascii\n{}{}",
            "Group { ".repeat(300),
            "}".repeat(300)
        );
        let (list, left_out) = tree_of(&deep);
        assert_eq!((list.len(), left_out), (DEEPEST + 1, 299 - DEEPEST));
    }
}
