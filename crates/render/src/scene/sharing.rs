//! Counts how large a document is when every use of a shared part is expanded.

use ivcam_inventor::grammar::{ClassId, Role, class, multiple_copy, text3};
use ivcam_inventor::iv::{Document, NodeId, Value};
use ivcam_inventor::traversal::{Grid, each_child, role::role};

/// How often the parts of a document are used, and how large they are expanded.
pub(in crate::scene) struct Sharing {
    /// The number of references to each node; 2 means more than one.
    uses: Vec<u8>,
    /// The size of each node when it is expanded.
    sizes: Vec<Size>,
    /// The size of the whole document.
    whole: Size,
}

/// The size of an expanded part of a document. It is an estimate: all children of a switch count.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
struct Size {
    /// The number of nodes.
    nodes: u64,
    /// The number of primitives.
    primitives: u64,
    /// The number of triangles of texts.
    glyphs: u64,
}

impl Size {
    /// Returns the sum of this size and `times` times the other.
    fn plus(self, other: Self, times: u64) -> Self {
        let add = |a: u64, b: u64| a.saturating_add(b.saturating_mul(times));
        Self {
            nodes: add(self.nodes, other.nodes),
            primitives: add(self.primitives, other.primitives),
            glyphs: add(self.glyphs, other.glyphs),
        }
    }

    fn exceeds(self, nodes: u64, primitives: u64) -> bool {
        self.nodes > nodes || self.primitives > primitives
    }
}

/// Where a node is in the search.
#[derive(Clone, Copy, PartialEq, Eq)]
enum SharingMark {
    New,
    Open,
    Done,
}

/// A part of this size or less is expanded where it is used in a part that is stored once. 4,096
/// primitives take less than 1 MB, and a ray finds the nearest of them faster than by smaller parts
/// inside each other.
const SMALL: u64 = 4096;

/// In a document whose texts have more triangles than this, each glyph is stored once. So many take
/// about 800 MB. Rays through glyphs that are stored once take three times as long.
const LONG_TEXT: u64 = 1 << 22;

/// The number of triangles of an average glyph with sides.
const SOLID_GLYPH: u64 = 340;

/// The number of triangles of an average glyph without sides.
const FLAT_GLYPH: u64 = 40;

impl Sharing {
    /// Counts a document. Returns `None` if nothing is used twice and it has no text.
    pub(in crate::scene) fn of(document: &Document) -> Option<Self> {
        let mut uses = vec![0u8; document.nodes.len()];
        let mut is_shared = false;
        let mut count = |id: NodeId| {
            let uses = &mut uses[id.0 as usize];
            *uses = (*uses + 1).min(2);
            is_shared |= *uses > 1;
        };
        document.roots.iter().for_each(|id| count(*id));
        ids(document).for_each(|id| each_child(document, id, &mut count));
        is_shared |= ids(document).any(|id| copies(document, id) > 1 || has_text(document, id));
        is_shared.then(|| {
            let mut this = Self {
                sizes: vec![Size::default(); document.nodes.len()],
                uses,
                whole: Size::default(),
            };
            this.measure(document);
            this
        })
    }

    /// Computes the sizes, each after those of the node's children. A node inside itself counts
    /// once.
    fn measure(&mut self, document: &Document) {
        let mut marks = vec![SharingMark::New; document.nodes.len()];
        let mut ahead: Vec<NodeId> = document.roots.iter().rev().copied().collect();
        while let Some(&id) = ahead.last() {
            let index = id.0 as usize;
            if marks[index] == SharingMark::New {
                marks[index] = SharingMark::Open;
                each_child(document, id, |child| {
                    if marks[child.0 as usize] == SharingMark::New {
                        ahead.push(child);
                    }
                });
                continue;
            }
            ahead.pop();
            if marks[index] == SharingMark::Open {
                marks[index] = SharingMark::Done;
                let mut inside = Size::default();
                each_child(document, id, |child| {
                    inside = inside.plus(self.sizes[child.0 as usize], 1);
                });
                self.sizes[index] = own_size(document, id).plus(inside, copies(document, id));
            }
        }
        let sizes = document.roots.iter().map(|id| self.sizes[id.0 as usize]);
        self.whole = sizes.fold(Size::default(), |all, size| all.plus(size, 1));
    }

    /// Whether the expanded document has more than a number of nodes or of primitives.
    pub(in crate::scene) fn exceeds(&self, nodes: u64, primitives: u64) -> bool {
        self.whole.exceeds(nodes, primitives)
    }

    /// Whether the expanded document has so much text that each glyph is to be stored once.
    pub(in crate::scene) fn has_long_text(&self) -> bool {
        self.whole.glyphs > LONG_TEXT
    }

    /// Whether a node is used more than once.
    pub(in crate::scene) fn is_shared(&self, id: NodeId) -> bool {
        self.uses[id.0 as usize] > 1
    }

    /// Whether a node is so small that it is best expanded wherever it is used.
    pub(in crate::scene) fn is_small(&self, id: NodeId) -> bool {
        !self.sizes[id.0 as usize].exceeds(SMALL, SMALL)
    }
}

fn ids(document: &Document) -> impl Iterator<Item = NodeId> {
    (0..document.nodes.len() as u32).map(NodeId)
}

/// The number of times that a node draws its children.
fn copies(document: &Document, id: NodeId) -> u64 {
    let node = document.node(id);
    match role(node) {
        Role::Array => Grid::from_node(node).len(),
        Role::MultipleCopy => node.get(multiple_copy::MATRIX).len() as u64,
        _ => 1,
    }
}

/// The size of a node without its children. Most primitives are triangles of indexed shapes; one
/// has at least three entries of an index, and a separator.
fn own_size(document: &Document, id: NodeId) -> Size {
    let node = document.node(id);
    let entries = node.data().fields.iter().map(|field| match &field.value {
        Value::Ints(list) => list.len() as u64,
        _ => 0,
    });
    let most = entries.max().unwrap_or(0);
    let is_shape = matches!(role(node), Role::Shape);
    let glyphs = if has_text(document, id) {
        let strings = node.get(text3::STRING).iter();
        let characters: u64 = strings.map(|line| line.len() as u64).sum();
        let has_sides = node.get(text3::PARTS) & text3::PARTS_SIDES != 0;
        characters.saturating_mul(if has_sides { SOLID_GLYPH } else { FLAT_GLYPH })
    } else {
        0
    };
    Size {
        nodes: 1,
        primitives: if is_shape { (most / 4).max(12) } else { 0 },
        glyphs,
    }
}

/// Whether a node is a text that is drawn as triangles.
fn has_text(document: &Document, id: NodeId) -> bool {
    const CLASSES: [ClassId; 3] = [class::TEXT3, class::ASCII_TEXT, class::TEXT];
    let known = document.node(id).known_class();
    known.is_some_and(|class| CLASSES.contains(&class.id))
}

#[cfg(test)]
mod tests {
    use super::*;

    fn sharing(scene: &str) -> Option<Sharing> {
        let text = format!("#Inventor V2.1 ascii\n{scene}").into_bytes();
        Sharing::of(&Document::read_headerless("s.iv", text).expect("reads"))
    }

    #[test]
    fn an_expanded_document_has_the_nodes_of_all_uses() {
        assert!(sharing("Separator { Cube { } } Cube { }").is_none());
        let shared = sharing("DEF a Separator { Cube { } } USE a").expect("shared");
        assert_eq!((shared.whole.nodes, shared.whole.primitives), (4, 24));
        let array = "Array { numElements1 10 numElements2 -1 Cube { } }";
        assert_eq!(sharing(array).map(|s| s.whole.nodes), None);
        let array = "Array { numElements1 10 numElements2 3 Cube { } }";
        assert_eq!(sharing(array).expect("copies").whole.nodes, 31);
        let matrix = "1 0 0 0 0 1 0 0 0 0 1 0 0 0 0 1 ";
        let copies = format!(
            "MultipleCopy {{ matrix [ {} ] Cube {{ }} }}",
            matrix.repeat(3)
        );
        assert_eq!(sharing(&copies).expect("copies").whole.nodes, 4);
    }

    #[test]
    fn the_glyphs_of_all_uses_of_a_text_are_counted() {
        let long = |text: &str| sharing(text).is_some_and(|s| s.has_long_text());
        let line = "x".repeat((LONG_TEXT / SOLID_GLYPH / 4) as usize);
        let text = |parts: &str| {
            let strings = format!("string [ \"{line}\", \"{line}\" ]");
            format!("DEF t Text3 {{ parts {parts} {strings} }} USE t")
        };
        let more = "AsciiText { string \"a few letters and then some\" }";
        assert!(!long(&text("ALL")));
        assert!(long(&format!("{} {}", text("ALL"), more.repeat(2))));
        assert!(!long(&format!("{} {}", text("FRONT"), more.repeat(2))));
        let pixels = more.replace("AsciiText", "Text2").repeat(2);
        assert!(!long(&format!("{} {pixels}", text("ALL"))));
    }

    #[test]
    fn a_document_beyond_all_numbers_is_counted() {
        let mut scene = "DEF n0 Separator { Cube { } }".to_owned();
        for i in 0..100 {
            scene += &format!("DEF n{} Separator {{ USE n{i} USE n{i} }}", i + 1);
        }
        let all = sharing(&scene).expect("shared");
        assert!(all.exceeds(u64::MAX - 1, 0));
    }
}
