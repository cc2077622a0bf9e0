//! The model: a tree of nodes with meshes, materials, pictures, lights and cameras.

use glam::{DAffine3, DVec3};
use ivcam_base::diag::Diagnostic;
use ivcam_inventor::pose::CameraPose;

use super::feature::{NotApplied, Occurrence, Place};
use super::image::Image;
use super::lights::{SceneCamera, SceneLight};
use super::material::Material;
use super::mesh::Mesh;

/// A mesh with a material, as indices of [`Model::meshes`] and [`Model::materials`].
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub struct Part {
    /// The mesh, in the node's space.
    pub mesh: usize,
    /// The material.
    pub material: usize,
}

/// A node of the tree: a group, a shape, or both.
#[derive(Clone, Debug)]
pub struct SceneNode {
    /// The node in the scene: its class, its name, and where it is in the file.
    pub place: Place,
    /// The index of the parent, or `None` for the root.
    pub parent: Option<usize>,
    /// The indices of the children.
    pub children: Vec<usize>,
    /// The matrix from the node's space to its parent's.
    pub local: DAffine3,
    /// The matrix from the node's space to world space.
    pub world: DAffine3,
    /// The meshes of the node's shape.
    pub parts: Vec<Part>,
    /// Whether the file states which sides of the shape are seen.
    pub states_sides: bool,
    /// A number that identifies the node in models of the same document at other times.
    pub(super) key: u64,
    /// The point of the node's space that became its origin when the scene was moved.
    pub(super) center: DVec3,
    /// Whether the matrix was replaced when the scene was moved, so that it does not move.
    pub(super) is_fixed: bool,
}

impl SceneNode {
    /// The name after `DEF`, or else the name of the class.
    pub fn name(&self) -> &str {
        self.place.name.as_deref().unwrap_or(&self.place.class)
    }
}

/// A scene as a tree of groups with triangles. Lengths are in meters.
#[derive(Clone, Debug, Default)]
pub struct Model {
    /// The nodes; a node follows its parent. The first one is the root.
    pub nodes: Vec<SceneNode>,
    /// The meshes. Shapes that are used several times share one.
    pub meshes: Vec<Mesh>,
    /// The materials, each once.
    pub materials: Vec<Material>,
    /// The pictures of textures, each once.
    pub images: Vec<Image>,
    /// The lights that are on.
    pub lights: Vec<SceneLight>,
    /// The cameras and viewpoints.
    pub cameras: Vec<SceneCamera>,
    /// The point of the scene's world space that is the model's origin. It is zero unless the scene
    /// is far from its own origin.
    pub offset: DVec3,
    /// What the scene uses and a format may not hold.
    pub features: Vec<Occurrence>,
    /// What the file states and the program does not apply.
    pub not_applied: Vec<NotApplied>,
    /// What is wrong with the scene.
    pub diagnostics: Vec<Diagnostic>,
    /// The camera for shapes with a size in pixels.
    pub(super) view: Option<CameraPose>,
}

impl Model {
    /// The parts of all nodes in the order of the tree: mesh, material, the matrix to world space
    /// and the node.
    pub fn placed_meshes(&self) -> impl Iterator<Item = (&Mesh, &Material, &DAffine3, &SceneNode)> {
        self.nodes.iter().flat_map(move |node| {
            node.parts.iter().map(move |part| {
                let (mesh, material) = (&self.meshes[part.mesh], &self.materials[part.material]);
                (mesh, material, &node.world, node)
            })
        })
    }

    /// The number of triangles, where a mesh counts once for each of its uses.
    pub fn triangle_count(&self) -> usize {
        let meshes = self.placed_meshes();
        meshes.map(|(mesh, ..)| mesh.triangles().len()).sum()
    }

    /// Sets the matrices relative to the parents from those relative to the world.
    pub(super) fn set_locals(&mut self) {
        for i in 0..self.nodes.len() {
            let above = self.nodes[i].parent.map(|p| self.nodes[p].world);
            let world = self.nodes[i].world;
            self.nodes[i].local = above.map_or(world, |above| above.inverse() * world);
        }
    }

    /// Whether nothing is drawn.
    pub fn is_empty(&self) -> bool {
        self.meshes.is_empty()
    }

    /// The smallest and the largest corner of the bounding box, or `None` if nothing is drawn.
    pub fn bounds(&self) -> Option<(DVec3, DVec3)> {
        let boxes = self.placed_meshes();
        let boxes = boxes.filter_map(|(mesh, _, world, _)| mesh.bounds(world));
        boxes.reduce(|a, b| (a.0.min(b.0), a.1.max(b.1)))
    }
}
