//! The identifier of a class.

/// A class of the catalogue, as its index in [`CLASSES`](super::CLASSES).
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub struct ClassId(pub u16);
