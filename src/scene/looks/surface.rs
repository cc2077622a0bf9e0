//! How a shape looks: one surface a shape, and the point on it that a ray meets.

use std::sync::Arc;

use glam::{Mat4, Vec2, Vec3, Vec4};

use super::texture::{Filter, Repeat, Texture};
use crate::traversal::state::{EnvironmentElement, TextureModel};

/// Texture coordinates that depend on where a ray comes from, or on nothing stored.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) enum Mapping {
    /// From the corners, or from the quadric itself.
    Stored,
    /// s and t along two directions of the shape's own space.
    Plane { s: Vec4, t: Vec4 },
    /// A sphere map: the picture of the surroundings in a shiny ball. The rows are the camera's
    /// right and up.
    Environment { right: Vec3, up: Vec3 },
}

#[derive(Clone, Debug)]
pub(crate) struct TextureUse {
    pub texture: Arc<Texture>,
    pub model: TextureModel,
    pub blend_color: Vec3,
    pub repeat: Repeat,
    pub filter: Filter,
    pub matrix: Mat4,
    pub mapping: Mapping,
}

/// Normals of triangles' corners. Corners share them, so each triangle has the numbers of three:
/// a third of the memory, which is what compiling a large scene waits for.
#[derive(Clone, Debug, Default)]
pub(crate) struct CornerNormals {
    list: Vec<Vec3>,
    corners: Vec<[u32; 3]>,
}

impl CornerNormals {
    pub(crate) fn is_empty(&self) -> bool {
        self.corners.is_empty()
    }

    /// The normals of a triangle; `None` where it has none of its own.
    #[inline]
    pub(crate) fn get(&self, triangle: usize) -> Option<[Vec3; 3]> {
        let numbers = self.corners.get(triangle)?;
        Some(numbers.map(|n| self.list[n as usize]))
    }

    pub(in crate::scene) fn reserve(&mut self, triangles: usize) {
        self.corners.reserve_exact(triangles);
    }

    /// Appends a triangle's.
    pub(in crate::scene) fn push(&mut self, normals: [Vec3; 3]) {
        let numbers = normals.map(|normal| {
            // Neighbors of a flat face are alike.
            if self.list.last() != Some(&normal) {
                self.list.push(normal);
            }
            self.list.len() as u32 - 1
        });
        self.corners.push(numbers);
    }

    /// Appends a list, and gives the number of its first.
    pub(in crate::scene) fn append(&mut self, list: Vec<Vec3>) -> u32 {
        let first = self.list.len() as u32;
        if first == 0 {
            self.list = list;
        } else {
            self.list.extend_from_slice(&list);
        }
        first
    }

    /// Which entries the triangles so far have.
    pub(in crate::scene) fn corners(&mut self) -> &mut Vec<[u32; 3]> {
        &mut self.corners
    }
}

/// What all primitives of a shape share, and what they have each.
#[derive(Clone, Debug)]
pub(crate) struct Surface {
    /// The name of the shape's class.
    #[cfg_attr(not(test), expect(dead_code, reason = "tests ask what a ray has hit"))]
    pub class: &'static str,
    pub ambient: Vec3,
    pub diffuse: Vec<Vec3>,
    pub specular: Vec3,
    pub emissive: Vec3,
    pub shininess: f32,
    pub transparency: Vec<f32>,
    pub refraction: f32,
    /// Unlit: the diffuse color as it is.
    pub base_color: bool,
    /// Lit from both sides.
    pub two_sided: bool,
    /// Seen from outside only.
    pub culls: bool,
    pub counterclockwise: bool,
    /// Who wins in a plane: the higher one, then what is drawn later.
    pub layer: u8,
    pub casts_shadow: bool,
    /// Under an `Annotation`: seen before everything else, however far away.
    pub on_top: bool,
    pub environment: EnvironmentElement,
    pub lights: u32,
    pub texture: Option<TextureUse>,
    /// Kept half spaces: p·normal ≥ distance.
    pub clip: Vec<(Vec3, f32)>,
    /// The first of the surface's triangles.
    pub first: u32,
    /// Normals of each triangle's corners; empty where every face is flat.
    pub normals: CornerNormals,
    /// Materials of each triangle's corners; empty where all are the first.
    pub materials: Vec<[u32; 3]>,
    pub coordinates: Vec<[Vec2; 3]>,
    /// Third texture coordinates; empty but for pictures in depth.
    pub thirds: Vec<[f32; 3]>,
    /// The center of its box, by which blended surfaces are sorted.
    pub center: Vec3,
}

impl Surface {
    pub(crate) fn diffuse_at(&self, index: u32) -> Vec3 {
        let last = self.diffuse.len() - 1;
        self.diffuse[(index as usize).min(last)]
    }

    /// Of the cosine to the half-way vector, for highlights.
    pub(crate) fn exponent(&self) -> f32 {
        128.0 * self.shininess.clamp(0.0, 1.0)
    }

    pub(crate) fn transparency_at(&self, index: u32) -> f32 {
        let last = self.transparency.len() - 1;
        self.transparency[(index as usize).min(last)]
    }

    /// What the surface gives off by itself and of the ambient light.
    pub(crate) fn glow(&self) -> Vec3 {
        self.emissive + self.ambient * self.environment.ambient
    }

    /// The diffuse color of one of the surface's triangles at the weights of a hit.
    #[inline(always)]
    pub(crate) fn diffuse_between(&self, triangle: usize, u: f32, v: f32) -> Vec3 {
        let [a, b, c] = self.materials_of(triangle);
        let first = self.diffuse_at(a);
        if a == b && b == c {
            return first;
        }
        first * (1.0 - u - v) + self.diffuse_at(b) * u + self.diffuse_at(c) * v
    }

    /// Whether no light goes through anywhere.
    pub(crate) fn is_opaque(&self) -> bool {
        let whole = |t: &TextureUse| t.model == TextureModel::Decal || !t.texture.has_alpha();
        self.transparency.iter().all(|t| *t == 0.0) && self.texture.as_ref().is_none_or(whole)
    }

    pub(crate) fn materials_of(&self, triangle: usize) -> [u32; 3] {
        self.materials.get(triangle).copied().unwrap_or([0; 3])
    }
}
