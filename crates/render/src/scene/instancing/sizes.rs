//! Measures a document as if every instance were expanded, and decides whether instancing pays.

use ivcam_inventor::grammar::{ClassId, Role, class, multiple_copy, text3};
use ivcam_inventor::iv::{Document, Limits, NodeId, Value};
use ivcam_inventor::traversal::{Grid, each_child, role::role};

/// How often the parts of a document are used, and how large they are expanded.
pub(super) struct ExpandedSizes {
    /// The number of references to each node; 2 means more than one.
    uses: Vec<u8>,
    /// The size of each node when it is expanded. All are set once the document is measured.
    sizes: Vec<Option<Size>>,
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
}

/// An expanded scene of this size or less is not instanced: see [`ExpandedSizes::pays`].
const PAYS_ABOVE: Size = Size {
    nodes: 300_000,
    primitives: 16_000_000,
    glyphs: 1 << 22,
};

/// A part of this size or less is expanded inside a prototype. 4,096 primitives take less than 1
/// MB, and a ray finds the nearest of them faster than by smaller parts inside each other.
const SMALL: u64 = 4096;

/// The average triangles of a character of a solid and of a flat text.
const SOLID_GLYPH: u64 = 340;
const FLAT_GLYPH: u64 = 40;

impl ExpandedSizes {
    /// Measures a document. Returns `None` if nothing is used twice and it has no text.
    pub(super) fn new(document: &Document) -> Option<Self> {
        let mut uses = vec![0u8; document.nodes.len()];
        let mut is_repeated = false;
        let mut count = |id: NodeId| {
            let uses = &mut uses[id.0 as usize];
            *uses = (*uses + 1).min(2);
            is_repeated |= *uses > 1;
        };
        document.roots.iter().for_each(|id| count(*id));
        document
            .ids()
            .for_each(|id| each_child(document, id, &mut count));
        is_repeated |= document
            .ids()
            .any(|id| copies(document, id) > 1 || has_text(document, id));
        is_repeated.then(|| {
            let mut this = Self {
                sizes: vec![None; document.nodes.len()],
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
        let roots = document.roots.iter().rev();
        let mut ahead: Vec<(NodeId, bool)> = roots.map(|id| (*id, false)).collect();
        while let Some((id, has_children)) = ahead.pop() {
            if has_children {
                let mut inside = Size::default();
                each_child(document, id, |child| {
                    inside = inside.plus(self.size(child), 1)
                });
                let size = own_size(document, id).plus(inside, copies(document, id));
                self.sizes[id.0 as usize] = Some(size);
            } else if self.sizes[id.0 as usize].is_none() {
                self.sizes[id.0 as usize] = Some(Size::default());
                ahead.push((id, true));
                each_child(document, id, |child| ahead.push((child, false)));
            }
        }
        let sizes = document.roots.iter().map(|id| self.size(*id));
        self.whole = sizes.fold(Size::default(), |all, size| all.plus(size, 1));
    }

    fn size(&self, id: NodeId) -> Size {
        self.sizes[id.0 as usize].unwrap_or_default()
    }

    /// Whether it pays to store the repeated parts of the document once.
    ///
    /// Through instances, rays are traced one by one and enter several trees, and a sample takes 4
    /// µs instead of 0.1 µs. Expanding takes 1.5 s and 220 MB at 92,000 cubes, which is about the
    /// number of nodes in [`PAYS_ABOVE`], so it is faster from 400,000 samples on. What ends it is
    /// memory: 3 GB for that number of primitives, 800 MB for that of glyphs
    /// (docs/decisions/0029-when-instancing-pays.md). A lower limit of the user takes the place of
    /// a number, because prototypes fit where the expanded scene would be cut off; a higher one
    /// changes nothing.
    pub(super) fn pays(&self, limits: &Limits) -> bool {
        let most = |number: u64, limit: usize| number.min(limit as u64);
        // A walk may visit every node twice, whatever the limit.
        let nodes = most(PAYS_ABOVE.nodes, limits.visits).max(2 * self.sizes.len() as u64);
        self.whole.nodes > nodes
            || self.whole.primitives > most(PAYS_ABOVE.primitives, limits.primitives)
            || self.whole.glyphs > PAYS_ABOVE.glyphs
    }

    /// Whether a node is used more than once.
    pub(super) fn is_repeated(&self, id: NodeId) -> bool {
        self.uses[id.0 as usize] > 1
    }

    /// Whether a node is so small that nothing in it is a prototype by itself.
    pub(super) fn is_small(&self, id: NodeId) -> bool {
        let size = self.size(id);
        size.nodes.max(size.primitives) <= SMALL
    }
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

    fn sizes(scene: &str) -> Option<ExpandedSizes> {
        let text = format!("#Inventor V2.1 ascii\n{scene}").into_bytes();
        ExpandedSizes::new(&Document::read_headerless("s.iv", text).expect("reads"))
    }

    #[test]
    fn an_expanded_document_has_the_nodes_of_all_uses() {
        assert!(sizes("Separator { Cube { } } Cube { }").is_none());
        let shared = sizes("DEF a Separator { Cube { } } USE a").expect("shared");
        assert_eq!((shared.whole.nodes, shared.whole.primitives), (4, 24));
        let array = "Array { numElements1 10 numElements2 -1 Cube { } }";
        assert_eq!(sizes(array).map(|s| s.whole.nodes), None);
        let array = "Array { numElements1 10 numElements2 3 Cube { } }";
        assert_eq!(sizes(array).expect("copies").whole.nodes, 31);
        let matrix = "1 0 0 0 0 1 0 0 0 0 1 0 0 0 0 1 ";
        let copies = format!(
            "MultipleCopy {{ matrix [ {} ] Cube {{ }} }}",
            matrix.repeat(3)
        );
        assert_eq!(sizes(&copies).expect("copies").whole.nodes, 4);
    }

    #[test]
    fn the_glyphs_of_all_uses_of_a_text_are_counted() {
        let long = |text: &str| sizes(text).is_some_and(|s| s.pays(&Limits::default()));
        let line = "x".repeat((PAYS_ABOVE.glyphs / SOLID_GLYPH / 4) as usize);
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
        let all = sizes(&scene).expect("shared");
        assert_eq!(all.whole.nodes, u64::MAX);
    }
}
