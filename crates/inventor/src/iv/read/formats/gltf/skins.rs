//! Meshes with a skin, placed by their joints at rest.

use glam::Mat4;
use ivcam_base::diag::{Result, Span};

use super::meshes::{Joints, Posing};
use super::reader::GltfReader;
use crate::grammar::value::NodeId;

impl GltfReader<'_, '_, '_> {
    /// Returns the shapes of a mesh with a skin, in world space. Its own node does not place it.
    ///
    /// # Errors
    /// Returns an error if a limit is exceeded.
    pub(super) fn skinned_mesh(
        &mut self,
        mesh: usize,
        skin: usize,
        weights: &[f32],
    ) -> Result<Vec<NodeId>> {
        if !self.root.animations.is_empty() {
            let message = "meshes with a skin do not move";
            let help = "they are drawn as their joints are at rest";
            self.builder.warn(Span::at(0), message).help(help);
        }
        let joints = match self.joints(skin) {
            Ok(joints) => joints,
            Err(message) => {
                let help = "its mesh is drawn without the skin";
                self.builder.damage(Span::at(0), message).help(help);
                Vec::new()
            }
        };
        let posing = Posing {
            weights,
            joints: Some(&joints),
            is_mirrored: false,
        };
        self.mesh(mesh, &posing)
    }

    /// Returns the matrix of each joint of a skin, from the mesh to the world.
    fn joints(&self, skin: usize) -> std::result::Result<Joints, String> {
        let missing = || format!("the skin {skin} does not exist");
        let skin = self.root.skins.get(skin).ok_or_else(missing)?;
        let inverse: Vec<Mat4> = match skin.inverse_bind_matrices {
            Some(accessor) => {
                let (list, _) = self.buffers.floats(self.root, accessor, &[16])?;
                list.chunks_exact(16).map(Mat4::from_cols_slice).collect()
            }
            None => Vec::new(),
        };
        let matrix = |(place, joint): (usize, &usize)| {
            let world = self.world.get(*joint).copied().unwrap_or(Mat4::IDENTITY);
            world * inverse.get(place).copied().unwrap_or(Mat4::IDENTITY)
        };
        Ok(skin.joints.iter().enumerate().map(matrix).collect())
    }
}
