//! The point at a hit, with everything that shading needs.

use glam::{Vec2, Vec3, Vec4};
use ivcam_inventor::traversal::state::TextureModel;

use super::looks::{Mapping, Surface, TextureUse, between};
use super::placed::Primitive;
use super::render_scene::RenderScene;
use crate::bvh::{Hit, Ray};
use crate::geometry::{Quadric, Stroke};

/// A point of the scene with everything that shading needs.
#[derive(Clone, Debug)]
pub struct Point<'a> {
    /// The position in meters.
    pub position: Vec3,
    /// The geometric normal, of length 1, on the side that the ray came from.
    pub geometric: Vec3,
    /// The normal for lighting, as in the file. On the back of a two-sided face it is reversed.
    pub normal: Vec3,
    /// Whether the ray hit the front.
    pub front: bool,
    /// The diffuse color. It includes a texture only if that is part of the material.
    pub diffuse: Vec3,
    /// The fraction of light that is transmitted, including the texture's alpha.
    pub transparency: f32,
    /// The texture's color and alpha at the point, unless the diffuse color includes them.
    pub texel: Option<Vec4>,
    /// What the textures of further units do to a color. It is rare, and without it a point is
    /// copied in two vectors.
    pub(crate) overlay: Option<Box<Overlay>>,
    /// The surface of the shape.
    pub surface: &'a Surface,
    /// A bound of the position's rounding error, in meters.
    pub error: f32,
    /// The size of the coordinates of the triangle's corners around the point, in meters; 0 for
    /// other primitives, and for triangles that were placed already.
    pub(crate) extent: f32,
}

/// A point on a triangle, without the texture.
#[derive(Clone, Copy, Debug)]
pub(crate) struct TrianglePoint {
    /// See [`Point::position`].
    pub position: Vec3,
    /// See [`Point::geometric`].
    pub geometric: Vec3,
    /// See [`Point::normal`].
    pub normal: Vec3,
    /// See [`Point::front`].
    pub front: bool,
    /// See [`Point::diffuse`].
    pub diffuse: Vec3,
    /// See [`Point::error`].
    pub error: f32,
    /// Twice the triangle's area, in square meters.
    pub doubled_area: f32,
}

/// What textures do to a color, which is multiplied and added to.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Overlay {
    scale: Vec3,
    offset: Vec3,
}

impl Overlay {
    /// What changes no color.
    const NONE: Self = Self {
        scale: Vec3::ONE,
        offset: Vec3::ZERO,
    };

    /// Adds a texture after the others, by OpenGL's texture environment.
    fn then(self, texture: &TextureUse, texel: Vec4) -> Self {
        let on = |color: Vec3| texture.on(color, texel);
        let offset = on(self.offset);
        Self {
            scale: on(self.offset + self.scale) - offset,
            offset,
        }
    }
}

impl Point<'_> {
    /// Whether the texture determines the diffuse color.
    pub(crate) fn has_color_of_texture(&self) -> bool {
        let texture = self.surface.texture.as_ref();
        texture.is_some_and(|texture| is_part_of_material(texture.model))
    }

    /// Returns a ray from the point in a direction. It starts clear of the surface by the rounding
    /// error.
    pub fn leave(&self, direction: Vec3) -> Ray {
        let side = if direction.dot(self.geometric) < 0.0 {
            -self.geometric
        } else {
            self.geometric
        };
        let origin = [0, 1, 2].map(|i| clear_of(self.position[i], side[i], self.error));
        Ray::new(Vec3::from_array(origin), direction)
    }

    /// Adds the texture at its stored coordinates, where a pixel covers `texels` texels across.
    fn add_texture(&mut self, texture: &TextureUse, ray: &Ray, stored: Vec3, texels: f32) {
        let texel = texture.texel(self, ray, stored, texels);
        self.transparency = texture.transparency(self.transparency, texel);
        self.texel = Some(texel);
    }

    /// Adds the textures of further units. `stored` are the coordinates of the surface.
    #[inline(never)]
    fn add_further_textures(&mut self, scene: &RenderScene, ray: &Ray, hit: &Hit, stored: Vec3) {
        let local = (hit.primitive - self.surface.first) as usize;
        let corners = scene.corners(hit.primitive, hit.place);
        let doubled_area = corners.map(|[a, b, c]| (b - a).cross(c - a).length());
        let mut overlay = Overlay::NONE;
        for further in &self.surface.further_textures {
            let texture = &further.texture;
            let (coordinates, wide) = match (doubled_area, further.coordinates.get(local)) {
                (Some(doubled_area), Some(own)) => {
                    let corners = (texture, Some(own));
                    let wide = scene.texels_on_triangle(self, ray, hit, corners, doubled_area);
                    (between(own, hit.u, hit.v).extend(0.0), wide)
                }
                _ => (stored, scene.texels_across(self, ray, hit, texture)),
            };
            let texel = texture.texel(self, ray, coordinates, wide);
            self.transparency = texture.transparency(self.transparency, texel);
            overlay = overlay.then(texture, texel);
        }
        self.overlay = Some(Box::new(overlay));
    }

    /// Moves a texture that is part of the material to the diffuse color.
    pub(crate) fn mix_texture(&mut self) {
        let Some(texture) = &self.surface.texture else {
            return;
        };
        if is_part_of_material(texture.model)
            && let Some(texel) = self.texel.take()
        {
            let replaces = texture.model == TextureModel::Diffuse && texture.texture.has_color();
            self.diffuse = match replaces {
                true => texel.truncate(),
                false => self.diffuse * texel.truncate(),
            };
        }
    }

    /// Makes the diffuse color that of an OpenGL program: white if a texture of colors replaces it
    /// (VRML 97), and at most 1, because Inventor's libraries keep it in bytes.
    pub(crate) fn prepare_for_opengl(&mut self) {
        self.diffuse = match self.has_white_diffuse() {
            true => Vec3::ONE,
            false => self.diffuse.min(Vec3::ONE),
        };
    }

    /// Whether a texture of colors replaces the diffuse color.
    pub(crate) fn has_white_diffuse(&self) -> bool {
        let texture = self.surface.texture.as_ref();
        texture.is_some_and(|texture| {
            texture.model == TextureModel::Diffuse && texture.texture.has_color()
        })
    }

    /// Applies the texture to a lit color by OpenGL's texture environment.
    #[inline]
    pub(crate) fn textured(&self, color: Vec3) -> Vec3 {
        let color = match (self.texel, &self.surface.texture) {
            (Some(texel), Some(texture)) => texture.on(color, texel),
            _ => color,
        };
        match &self.overlay {
            Some(overlay) => color * overlay.scale + overlay.offset,
            None => color,
        }
    }
}

/// Whether a texture changes the diffuse color before lighting.
fn is_part_of_material(model: TextureModel) -> bool {
    matches!(model, TextureModel::Diffuse | TextureModel::Material)
}

/// Returns a coordinate of the origin of a ray that leaves a point toward a side, clear of the
/// surface by the rounding error of the point's position.
#[inline(always)]
pub(crate) fn clear_of(position: f32, side: f32, error: f32) -> f32 {
    let origin = position + side * error;
    // The sum is rounded too, so the origin moves one step farther.
    let step = (origin.abs() * f32::EPSILON).copysign(side);
    origin + if side == 0.0 { 0.0 } else { step }
}

impl RenderScene {
    /// Returns the point at a hit.
    pub fn point(&self, ray: &Ray, hit: &Hit) -> Point<'_> {
        let mut point = point(self, ray, hit);
        point.mix_texture();
        point
    }

    /// Returns the texture coordinates at a hit: those at which the first texture is looked up, or
    /// those of the shape if it has no texture.
    pub(crate) fn coordinates_at(&self, ray: &Ray, hit: &Hit) -> Vec2 {
        let (point, stored) = untextured(self, ray, hit);
        let texture = point.surface.texture.as_ref();
        let at = texture.map_or(stored, |texture| texture.at(&point, ray, stored));
        at.truncate()
    }

    /// Returns the point at a hit on a triangle that was placed already, with the texture's color
    /// in `texel` whatever its model.
    #[inline(always)]
    pub(crate) fn point_on_triangle(
        &self,
        ray: &Ray,
        hit: &Hit,
        place: &TrianglePoint,
    ) -> Point<'_> {
        let surface = self.surface(hit);
        let local = (hit.primitive - surface.first) as usize;
        let mut out = Point {
            position: place.position,
            geometric: place.geometric,
            normal: place.normal,
            front: place.front,
            diffuse: place.diffuse,
            transparency: surface.transparency_between(local, hit.u, hit.v),
            texel: None,
            overlay: None,
            surface,
            error: place.error,
            extent: 0.0,
        };
        if let Some(texture) = &surface.texture {
            let stored = surface.coordinates_between(local, hit.u, hit.v);
            let corners = (texture, surface.coordinates.get(local));
            let wide = self.texels_on_triangle(&out, ray, hit, corners, place.doubled_area);
            out.add_texture(texture, ray, stored, wide);
        }
        if !surface.further_textures.is_empty() {
            let stored = surface.coordinates_between(local, hit.u, hit.v);
            out.add_further_textures(self, ray, hit, stored);
        }
        out.transparency = surface.alpha.seen_transparency(out.transparency);
        out
    }

    /// Returns the point at a hit as an OpenGL program lights it: every texture is applied after
    /// lighting. The diffuse color under a texture of colors is then white (VRML 97).
    pub(crate) fn point_before_texture(&self, ray: &Ray, hit: &Hit) -> Point<'_> {
        let mut point = point(self, ray, hit);
        point.prepare_for_opengl();
        point
    }

    /// Returns the corners of the triangle that was hit as points without their textures, with
    /// their weights. Returns `None` for other primitives.
    pub(crate) fn corner_points(&self, ray: &Ray, hit: &Hit) -> Option<[(Point<'_>, f32); 3]> {
        if !self.is_triangle(hit) {
            return None;
        }
        let weights = [1.0 - hit.u - hit.v, hit.u, hit.v];
        Some([(0.0, 0.0), (1.0, 0.0), (0.0, 1.0)].map(|(u, v)| {
            let i = if u == 1.0 {
                1
            } else {
                2 * usize::from(v == 1.0)
            };
            let (mut point, _) = untextured(self, ray, &Hit { u, v, ..*hit });
            point.prepare_for_opengl();
            (point, weights[i])
        }))
    }
}

/// Computes the point at a hit, with the texture's color in `texel` whatever its model.
fn point<'a>(scene: &'a RenderScene, ray: &Ray, hit: &Hit) -> Point<'a> {
    let (mut out, coordinates) = untextured(scene, ray, hit);
    if let Some(texture) = &out.surface.texture {
        let wide = scene.texels_across(&out, ray, hit, texture);
        out.add_texture(texture, ray, coordinates, wide);
    }
    if !out.surface.further_textures.is_empty() {
        out.add_further_textures(scene, ray, hit, coordinates);
    }
    out.transparency = out.surface.alpha.seen_transparency(out.transparency);
    out
}

/// Computes the point at a hit without its texture, and its texture coordinates.
#[inline(always)]
fn untextured<'a>(scene: &'a RenderScene, ray: &Ray, hit: &Hit) -> (Point<'a>, Vec3) {
    let surface = scene.surface(hit);
    let outward = scene.geometric_normal(ray, hit);
    let front = scene.is_front_of(ray, hit, surface, outward);
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
        overlay: None,
        surface,
        error: 0.0,
        extent: 0.0,
    };
    let coordinates = match scene.corners(hit.primitive, hit.place) {
        Some(corners) => on_triangle(&mut out, scene, &corners, hit),
        None => on_other(&mut out, scene, ray, hit),
    };
    if surface.two_sided && !front {
        out.normal = -out.normal;
    }
    let limit = Vec3::splat(surface.diffuse_limit());
    out.diffuse = out.diffuse.clamp(Vec3::ZERO, limit);
    (out, coordinates)
}

/// Fills in a point on a primitive that is not a triangle, and returns its texture coordinates.
#[inline(never)]
fn on_other(out: &mut Point<'_>, scene: &RenderScene, ray: &Ray, hit: &Hit) -> Vec3 {
    match scene.primitive(hit) {
        Primitive::Triangle(_) => Vec3::ZERO, // `point` has filled it in
        Primitive::Quadric(quadric) => on_quadric(out, &quadric),
        Primitive::Stroke(stroke) => on_stroke(out, ray, stroke),
    }
}

/// Fills in a point on a round surface, and returns its texture coordinates.
fn on_quadric(out: &mut Point<'_>, quadric: &Quadric) -> Vec3 {
    let surface = out.surface;
    let (on_surface, _) = quadric.project_to_surface(out.position.as_dvec3());
    let position = quadric.scene_from_object.transform_point3(on_surface);
    out.position = position.as_vec3();
    let size = quadric.scene_from_object.matrix3.to_cols_array();
    let reach = size.iter().fold(0.0, |a: f64, v| a.max(v.abs())) * on_surface.abs().max_element();
    out.error = 4.0 * f32::EPSILON * (out.position.abs().max_element() + reach as f32);
    out.diffuse = surface.diffuse_at(quadric.material);
    out.transparency = surface.transparency_at(quadric.material);
    match &surface.texture {
        Some(t) if t.texture.is_deep() => quadric.volume_coordinates(on_surface).as_vec3(),
        _ => quadric
            .texture_coordinates(on_surface)
            .as_vec2()
            .extend(0.0),
    }
}

/// Fills in a point on a line, and returns its texture coordinates.
fn on_stroke(out: &mut Point<'_>, ray: &Ray, stroke: &Stroke) -> Vec3 {
    let surface = out.surface;
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
}

/// Fills in a point on a triangle, and returns its texture coordinates. The position is computed
/// from the corners and not from the distance, so its error is a few ulps of the corners' size
/// whatever the ray's length (Pharr, Jakob and Humphreys, *Physically Based Rendering*, 4th
/// edition, 6.8).
#[inline(always)]
fn on_triangle(out: &mut Point<'_>, scene: &RenderScene, corners: &[Vec3; 3], hit: &Hit) -> Vec3 {
    let weights = [1.0 - hit.u - hit.v, hit.u, hit.v];
    let blend = |v: [Vec3; 3]| v[0] * weights[0] + v[1] * weights[1] + v[2] * weights[2];
    out.position = blend(*corners);
    let sum = blend(corners.map(Vec3::abs));
    out.error = 8.0 * f32::EPSILON * sum.dot(out.geometric.abs());
    out.extent = sum.max_element();
    let surface = out.surface;
    let local = (hit.primitive - surface.first) as usize;
    if let Some(normals) = scene.normals(surface, local, hit.place) {
        // A face without area or normal gives zero, which is unlit as in OpenGL.
        out.normal = blend(normals).normalize_or_zero();
    } else if !surface.counterclockwise {
        out.normal = -out.normal;
    }
    out.diffuse = surface.diffuse_between(local, hit.u, hit.v);
    out.transparency = surface.transparency_between(local, hit.u, hit.v);
    surface.coordinates_between(local, hit.u, hit.v)
}

impl TextureUse {
    /// Returns the color and alpha at a point, where a pixel covers `texels` texels across.
    #[inline(always)]
    fn texel(&self, point: &Point<'_>, ray: &Ray, stored: Vec3, texels: f32) -> Vec4 {
        let at = self.at(point, ray, stored);
        self.texture
            .sample_deep(at, texels, self.filter, self.repeat)
    }

    /// Returns the transparency of a surface with the texture.
    #[inline(always)]
    fn transparency(&self, without: f32, texel: Vec4) -> f32 {
        match self.model {
            TextureModel::Decal => without,
            TextureModel::Diffuse if self.texture.has_alpha() => 1.0 - texel.w,
            _ => 1.0 - (1.0 - without) * texel.w,
        }
    }

    /// Applies a texel to a color by OpenGL's texture environment.
    #[inline(always)]
    fn on(&self, color: Vec3, texel: Vec4) -> Vec3 {
        let rgb = texel.truncate();
        match self.model {
            TextureModel::Modulate | TextureModel::Diffuse | TextureModel::Material => color * rgb,
            TextureModel::Decal => color.lerp(rgb, texel.w),
            TextureModel::Blend => color * (Vec3::ONE - rgb) + self.blend_color * rgb,
            TextureModel::Replace => rgb,
        }
    }

    /// Returns the texture coordinates of a point. `stored` are those of its primitive.
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

/// Returns the coordinates in OpenGL's sphere map. With the reflected direction (x, y, z) in camera
/// space and m = 2√(x² + y² + (z+1)²) they are s = x/m + ½ and t = y/m + ½.
fn sphere_map(normal: Vec3, ray: &Ray, right: Vec3, up: Vec3) -> Vec2 {
    let d = ray.direction.normalize_or(Vec3::NEG_Z);
    let r = d - 2.0 * d.dot(normal) * normal;
    let back = right.cross(up);
    let (x, y, z) = (r.dot(right), r.dot(up), r.dot(back));
    let m = 2.0 * (x * x + y * y + (z + 1.0) * (z + 1.0)).sqrt();
    Vec2::new(x, y) / m.max(1e-20) + 0.5
}
