//! The numbers of rays that were traced.

/// The numbers of rays that were traced.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub(crate) struct RayCounts {
    /// Rays from the camera, mirrored rays and refracted rays, and the turns of light paths.
    pub scene: u64,
    /// Rays toward a light.
    pub shadow: u64,
}
