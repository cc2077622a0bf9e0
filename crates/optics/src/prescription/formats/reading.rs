//! What a file of a lens does not state, and its reader must know.

use crate::prescription::glass::catalogue::Catalogue;

/// Options of reading that a file does not state.
#[derive(Clone, Debug, Default)]
pub struct Reading {
    /// The glasses that a file may name beside the built-in ones.
    pub glasses: Catalogue,
    /// In tables of four columns: the meaning of the second. None: the file's evidence decides.
    pub gap: Option<Gap>,
    /// Whether lengths stay as the file has them. Otherwise a lens whose file states a nominal
    /// focal length (`# nominal: 28 mm`) is scaled to it.
    pub as_published: bool,
}

/// The meaning of the column of gaps in a table.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Gap {
    /// The distance to the next vertex (pbrt).
    Next,
    /// The distance from the vertex before (the older files of Kolb and CS348b).
    Previous,
    /// The position of the vertex on the axis.
    Position,
}

impl Gap {
    /// The meanings with the words of the command line.
    pub const ALL: [(&'static str, Self); 3] = [
        ("next", Self::Next),
        ("previous", Self::Previous),
        ("position", Self::Position),
    ];

    /// The word of the command line.
    pub fn name(self) -> &'static str {
        Self::ALL[self as usize].0
    }

    /// The meaning in words.
    pub(crate) fn meaning(self) -> &'static str {
        match self {
            Self::Next => "the distance to the next vertex",
            Self::Previous => "the distance from the vertex before",
            Self::Position => "the position of the vertex on the axis",
        }
    }
}
