//! Mistakes in the lists of a shape, which is drawn all the same.

/// A mistake in the lists of a shape.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub(crate) enum Mistake {
    /// An index below −1.
    NegativeIndex,
    /// A number of corners below −1, or a −1 that is not the last.
    NegativeCount,
    /// More corners than there are coordinates.
    FewCoordinates,
    /// Fewer materials than the binding needs.
    FewMaterials,
    /// Fewer normals than the binding needs.
    FewNormals,
    /// A trimming loop whose ends are apart.
    OpenTrim,
}

impl Mistake {
    /// Returns what is wrong, and what becomes of it.
    pub(super) fn text(self) -> &'static str {
        match self {
            Self::NegativeIndex => "has a negative index other than -1, which counts as -1",
            Self::NegativeCount => {
                "has a negative number of corners, which takes all coordinates that are left"
            }
            Self::FewCoordinates => {
                "has more corners than there are coordinates; the rest is not drawn"
            }
            Self::FewMaterials => {
                "has fewer colors than its binding needs; the last one is used for the rest"
            }
            Self::FewNormals => {
                "has fewer normals than its binding needs; the last one is used for the rest"
            }
            Self::OpenTrim => "has an open trimming curve, whose ends are joined by a line",
        }
    }
}
