//! How a shape looks: one surface a shape, and the point on it that a ray meets.

use std::sync::Arc;

use glam::{Mat4, Vec2, Vec3, Vec4};

use super::RenderScene;
use super::texture::{Filter, Texture};
use crate::bvh::{Hit, Ray};
use crate::traversal::state::{EnvironmentElement, TextureModel};

/// Texture coordinates that depend on where a ray comes from, or on nothing stored.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Mapping {
    /// From the corners, or from the quadric itself.
    Stored,
    /// s and t along two directions of the shape's own space.
    Plane { s: Vec4, t: Vec4 },
    /// A sphere map: the picture of the surroundings in a shiny ball. The rows are the camera's
    /// right and up.
    Environment { right: Vec3, up: Vec3 },
}

#[derive(Clone, Debug)]
pub struct TextureUse {
    pub texture: Arc<Texture>,
    pub model: TextureModel,
    pub blend_color: Vec3,
    pub repeat_s: bool,
    pub repeat_t: bool,
    /// Into the depth, for several pictures behind one another.
    pub repeat_r: bool,
    pub filter: Filter,
    pub matrix: Mat4,
    pub mapping: Mapping,
}

/// Normals of triangles' corners. Corners share them, so each triangle has the numbers of three:
/// a third of the memory, which is what compiling a large scene waits for.
#[derive(Clone, Debug, Default)]
pub struct CornerNormals {
    list: Vec<Vec3>,
    corners: Vec<[u32; 3]>,
}

impl CornerNormals {
    pub fn is_empty(&self) -> bool {
        self.corners.is_empty()
    }

    /// The normals of a triangle; `None` where it has none of its own.
    #[inline]
    pub fn get(&self, triangle: usize) -> Option<[Vec3; 3]> {
        let numbers = self.corners.get(triangle)?;
        Some(numbers.map(|n| self.list[n as usize]))
    }

    pub(super) fn reserve(&mut self, triangles: usize) {
        self.corners.reserve_exact(triangles);
    }

    /// Appends a triangle's.
    pub(super) fn push(&mut self, normals: [Vec3; 3]) {
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
    pub(super) fn append(&mut self, list: Vec<Vec3>) -> u32 {
        let first = self.list.len() as u32;
        if first == 0 {
            self.list = list;
        } else {
            self.list.extend_from_slice(&list);
        }
        first
    }

    /// Which entries the triangles so far have.
    pub(super) fn corners(&mut self) -> &mut Vec<[u32; 3]> {
        &mut self.corners
    }
}

/// What all primitives of a shape share, and what they have each.
#[derive(Clone, Debug)]
pub struct Surface {
    /// Order of traversal, counted over shapes.
    pub shape: u32,
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
    pub fn diffuse_at(&self, index: u32) -> Vec3 {
        let last = self.diffuse.len() - 1;
        self.diffuse[(index as usize).min(last)]
    }

    /// Of the cosine to the half-way vector, for highlights.
    pub fn exponent(&self) -> f32 {
        128.0 * self.shininess.clamp(0.0, 1.0)
    }

    pub fn transparency_at(&self, index: u32) -> f32 {
        let last = self.transparency.len() - 1;
        self.transparency[(index as usize).min(last)]
    }

    /// What the surface gives off by itself and of the ambient light.
    pub fn glow(&self) -> Vec3 {
        self.emissive + self.ambient * self.environment.ambient
    }

    /// The diffuse color of one of the surface's triangles at the weights of a hit.
    #[inline(always)]
    pub fn diffuse_between(&self, triangle: usize, u: f32, v: f32) -> Vec3 {
        let [a, b, c] = self.materials_of(triangle);
        let first = self.diffuse_at(a);
        if a == b && b == c {
            return first;
        }
        first * (1.0 - u - v) + self.diffuse_at(b) * u + self.diffuse_at(c) * v
    }

    /// Whether no light goes through anywhere.
    pub fn is_opaque(&self) -> bool {
        let whole = |t: &TextureUse| t.model == TextureModel::Decal || !t.texture.has_alpha();
        self.transparency.iter().all(|t| *t == 0.0) && self.texture.as_ref().is_none_or(whole)
    }

    pub fn materials_of(&self, triangle: usize) -> [u32; 3] {
        self.materials.get(triangle).copied().unwrap_or([0; 3])
    }
}

/// A point of the scene with all that shading asks for.
#[derive(Clone, Debug)]
pub struct Point<'a> {
    pub position: Vec3,
    /// Of length 1, on the side the ray came from.
    pub geometric: Vec3,
    /// The normal to light with: as the file says, turned over where the back of a two-sided
    /// face is seen.
    pub normal: Vec3,
    /// Whether the ray met the outside.
    pub front: bool,
    pub diffuse: Vec3,
    /// Share of the light that goes through, the texture's alpha included.
    pub transparency: f32,
    /// The texture's color and alpha here.
    pub texel: Option<Vec4>,
    pub surface: &'a Surface,
    /// How far rounding may have moved the position.
    pub error: f32,
}

impl Point<'_> {
    /// Where a ray leaving towards a direction starts, clear of the surface by the error.
    pub fn leave(&self, direction: Vec3) -> Ray {
        let side = if direction.dot(self.geometric) < 0.0 {
            -self.geometric
        } else {
            self.geometric
        };
        let mut origin = self.position + side * self.error;
        for i in 0..3 {
            // The sum above rounds too: one step farther.
            origin[i] = if side[i] > 0.0 {
                origin[i].next_up()
            } else if side[i] < 0.0 {
                origin[i].next_down()
            } else {
                origin[i]
            };
        }
        Ray::new(origin, direction)
    }

    /// A lit color under the texture, by OpenGL's texture environment.
    pub fn textured(&self, color: Vec3) -> Vec3 {
        let (Some(texel), Some(texture)) = (self.texel, &self.surface.texture) else {
            return color;
        };
        let rgb = texel.truncate();
        match texture.model {
            TextureModel::Modulate => color * rgb,
            TextureModel::Decal => color.lerp(rgb, texel.w),
            TextureModel::Blend => color * (Vec3::ONE - rgb) + texture.blend_color * rgb,
            TextureModel::Replace => rgb,
        }
    }
}

/// Works out the point of a hit.
pub(super) fn point<'a>(scene: &'a RenderScene, ray: &Ray, hit: &Hit) -> Point<'a> {
    let surface = scene.surface(hit);
    let index = hit.primitive as usize;
    let outward = scene.geometric_normal(ray, hit);
    let front = (outward.dot(ray.direction) < 0.0) == surface.counterclockwise;
    let mut out = Point {
        position: ray.at(hit.t),
        geometric: if outward.dot(ray.direction) > 0.0 {
            -outward
        } else {
            outward
        },
        normal: outward,
        front,
        diffuse: surface.diffuse[0],
        transparency: surface.transparency[0],
        texel: None,
        surface,
        error: 0.0,
    };
    let coordinates = if let Some(corners) = scene.triangles.get(index) {
        on_triangle(&mut out, corners, index, hit)
    } else if let Some(quadric) = scene.quadrics.get(index - scene.triangles.len()) {
        let (settled, _) = quadric.project_to_surface(out.position.as_dvec3());
        let position = quadric.scene_from_object.transform_point3(settled);
        out.position = position.as_vec3();
        let size = quadric.scene_from_object.matrix3.to_cols_array();
        let reach = size.iter().fold(0.0, |a: f64, v| a.max(v.abs())) * settled.abs().max_element();
        out.error = 4.0 * f32::EPSILON * (out.position.abs().max_element() + reach as f32);
        out.diffuse = surface.diffuse_at(quadric.material);
        out.transparency = surface.transparency_at(quadric.material);
        match &surface.texture {
            Some(t) if t.texture.is_deep() => quadric.volume_coordinates(settled).as_vec3(),
            _ => quadric.texture_coordinates(settled).as_vec2().extend(0.0),
        }
    } else {
        let stroke = &scene.strokes[index - scene.triangles.len() - scene.quadrics.len()];
        out.geometric = -ray.direction.normalize_or(Vec3::Z);
        let share = stroke.share_at(out.position);
        let [a, b] = stroke.materials;
        out.normal = stroke.normal_at(share).unwrap_or(out.geometric);
        out.diffuse = surface.diffuse_at(a).lerp(surface.diffuse_at(b), share);
        let clear = [a, b].map(|m| surface.transparency_at(m));
        out.transparency = clear[0] + (clear[1] - clear[0]) * share;
        out.error = 1e-5 * out.position.abs().max_element();
        stroke.coordinates[0]
            .lerp(stroke.coordinates[1], share)
            .extend(0.0)
    };
    if surface.two_sided && !front {
        out.normal = -out.normal;
    }
    out.diffuse = out.diffuse.clamp(Vec3::ZERO, Vec3::ONE);
    if let Some(texture) = &surface.texture {
        let at = texture.at(&out, ray, coordinates);
        let wide = scene.texels_across(&out, ray, hit, texture);
        let repeat = [texture.repeat_s, texture.repeat_t, texture.repeat_r];
        let texel = texture
            .texture
            .sample_deep(at, wide, texture.filter, repeat);
        if texture.model != TextureModel::Decal {
            out.transparency = 1.0 - (1.0 - out.transparency) * texel.w;
        }
        out.texel = Some(texel);
    }
    out
}

/// Position from the corners, not from the distance: its error is a few ulps of the corners'
/// size, whatever the ray's length (Pharr, Jakob and Humphreys, 6.8).
fn on_triangle(out: &mut Point<'_>, corners: &[Vec3; 3], index: usize, hit: &Hit) -> Vec3 {
    let weights = [1.0 - hit.u - hit.v, hit.u, hit.v];
    let blend = |v: [Vec3; 3]| v[0] * weights[0] + v[1] * weights[1] + v[2] * weights[2];
    out.position = blend(*corners);
    let sum = blend(corners.map(Vec3::abs));
    out.error = 8.0 * f32::EPSILON * sum.dot(out.geometric.abs());
    let surface = out.surface;
    let local = index - surface.first as usize;
    if let Some(normals) = surface.normals.get(local) {
        // A face without area or normal leaves zero: unlit, as in OpenGL.
        out.normal = blend(normals).normalize_or_zero();
    } else if !surface.counterclockwise {
        out.normal = -out.normal;
    }
    let materials = surface.materials_of(local);
    if materials[0] == materials[1] && materials[1] == materials[2] {
        out.diffuse = surface.diffuse_at(materials[0]);
        out.transparency = surface.transparency_at(materials[0]);
    } else {
        out.diffuse = blend(materials.map(|m| surface.diffuse_at(m)));
        let t = materials.map(|m| surface.transparency_at(m));
        out.transparency = t[0] * weights[0] + t[1] * weights[1] + t[2] * weights[2];
    }
    let plain = surface.coordinates.get(local).map_or(Vec2::ZERO, |c| {
        c[0] * weights[0] + c[1] * weights[1] + c[2] * weights[2]
    });
    let third = surface.thirds.get(local).map_or(0.0, |c| {
        c[0] * weights[0] + c[1] * weights[1] + c[2] * weights[2]
    });
    plain.extend(third)
}

impl TextureUse {
    /// Where in the texture a point lies.
    fn at(&self, point: &Point<'_>, ray: &Ray, stored: Vec3) -> Vec3 {
        let plain = match self.mapping {
            Mapping::Stored => stored,
            Mapping::Plane { s, t } => {
                let p = point.position.extend(1.0);
                Vec3::new(s.dot(p), t.dot(p), 0.0)
            }
            Mapping::Environment { right, up } => {
                sphere_map(point.normal, ray, right, up).extend(0.0)
            }
        };
        self.matrix.transform_point3(plain)
    }
}

/// OpenGL's sphere map: with the reflection r in the camera's space, m = 2√(x² + y² + (z+1)²),
/// s = x/m + ½, t = y/m + ½.
fn sphere_map(normal: Vec3, ray: &Ray, right: Vec3, up: Vec3) -> Vec2 {
    let d = ray.direction.normalize_or(Vec3::NEG_Z);
    let r = d - 2.0 * d.dot(normal) * normal;
    let back = right.cross(up);
    let (x, y, z) = (r.dot(right), r.dot(up), r.dot(back));
    let m = 2.0 * (x * x + y * y + (z + 1.0) * (z + 1.0)).sqrt();
    Vec2::new(x, y) / m.max(1e-20) + 0.5
}
