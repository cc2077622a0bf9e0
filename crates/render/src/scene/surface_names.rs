//! The names of the objects and the materials that a scene shows, for mattes.

use indexmap::IndexSet;

/// What a matte tells apart.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum MatteKind {
    /// The shapes of the scene.
    Object,
    /// The materials.
    Material,
}

impl MatteKind {
    /// Both kinds, in the order of their lists.
    pub const ALL: [Self; 2] = [Self::Object, Self::Material];
}

/// The names of one kind, and the name of each surface.
#[derive(Clone, Debug, Default)]
struct NamesOfKind {
    /// The different names.
    list: IndexSet<String>,
    /// The number of each surface's name.
    of_surfaces: Vec<u32>,
}

/// The names of the objects and the materials of a scene's surfaces. Surfaces may share a name.
#[derive(Clone, Debug, Default)]
pub struct SurfaceNames {
    kinds: [NamesOfKind; 2],
}

impl SurfaceNames {
    /// Names the surfaces from number `from` to before number `to`, in place of what they were.
    pub(super) fn set(&mut self, (from, to): (usize, usize), object: String, material: String) {
        for (kind, name) in self.kinds.iter_mut().zip([object, material]) {
            let (number, _) = kind.list.insert_full(name);
            kind.of_surfaces.truncate(from);
            kind.of_surfaces.resize(to, number as u32);
        }
    }

    /// The number of the name of a surface.
    pub(crate) fn number(&self, kind: MatteKind, surface: u32) -> u32 {
        self.kinds[kind as usize].of_surfaces[surface as usize]
    }

    /// All names of a kind, by number.
    pub fn all(&self, kind: MatteKind) -> impl ExactSizeIterator<Item = &str> {
        self.kinds[kind as usize].list.iter().map(String::as_str)
    }
}
