//! The choice of layers that are made only if they are asked for.

/// Which layers the file of `--aov` has besides those of every such file.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct FurtherLayers {
    /// Mattes of the objects and the materials, as Cryptomatte.
    pub mattes: bool,
    /// Texture coordinates.
    pub coordinates: bool,
    /// How far what is seen moves in this time, in seconds.
    pub motion: Option<f64>,
}
