//! The number of texels that a pixel covers.

use glam::{Vec2, Vec3};

use super::looks::TextureUse;
use super::placed::Primitive;
use super::point::Point;
use super::render_scene::RenderScene;
use crate::bvh::{Hit, Ray};

impl RenderScene {
    /// Returns the width of a pixel at a hit in texels. The texels per meter are those between a
    /// triangle's corners or of a round shape's mapping; a line has texels per pixel between its
    /// ends. Without such information the result is 1.
    pub(super) fn texels_across(
        &self,
        point: &Point<'_>,
        ray: &Ray,
        hit: &Hit,
        texture: &TextureUse,
    ) -> f32 {
        if texture.texture.is_deep() && !self.is_triangle(hit) {
            return 1.0;
        }
        let size = Vec2::new(texture.texture.width as f32, texture.texture.height as f32);
        let texel = |t: Vec2| texture.matrix.transform_point3(t.extend(0.0)).truncate() * size;
        let wide = match self.primitive(hit) {
            Primitive::Triangle([a, b, c]) => {
                let doubled_area = (b - a).cross(c - a).length();
                let local = (hit.primitive - point.surface.first) as usize;
                let corners = point.surface.coordinates.get(local);
                return self.texels_on_triangle(point, ray, hit, (texture, corners), doubled_area);
            }
            Primitive::Quadric(quadric) => {
                let at = |p: Vec3| {
                    quadric
                        .texture_coordinates(quadric.project_to_surface(p.as_dvec3()).0)
                        .as_vec2()
                };
                let (pixel, longer) = self.footprint(point, ray, hit);
                let (middle, (right, up)) =
                    (at(point.position), point.geometric.any_orthonormal_pair());
                // `round` makes a step across the seam of a round texture as short as any other.
                let step = |direction: Vec3| {
                    let change = at(point.position + pixel * direction) - middle;
                    texel(change - change.round()) - texel(Vec2::ZERO)
                };
                longer / pixel * step(right).perp_dot(step(up)).abs().sqrt()
            }
            Primitive::Stroke(stroke) => {
                let [from, to] = stroke.coordinates.map(texel);
                (to - from).length() / stroke.pixels(&self.view)
            }
        };
        if wide.is_finite() { wide } else { 1.0 }
    }

    /// Does what [`RenderScene::texels_across`] does at a hit on a triangle whose corners have
    /// texture coordinates.
    #[inline(always)]
    pub(super) fn texels_on_triangle(
        &self,
        point: &Point<'_>,
        ray: &Ray,
        hit: &Hit,
        (texture, corners): (&TextureUse, Option<&[Vec2; 3]>),
        doubled_area: f32,
    ) -> f32 {
        let Some([a, b, c]) = corners else {
            return 1.0;
        };
        let (s, t) = (texture.matrix.x_axis, texture.matrix.y_axis);
        let scale = s.truncate().truncate().perp_dot(t.truncate().truncate());
        let size = texture.texture.width as f32 * texture.texture.height as f32;
        let texels = (size * scale * (*b - *a).perp_dot(*c - *a)).abs();
        let (_, longer) = self.footprint(point, ray, hit);
        let wide = longer * (texels / doubled_area).sqrt();
        if wide.is_finite() { wide } else { 1.0 }
    }

    /// Returns the width of a pixel at a hit in meters, across the ray and along the surface.
    #[inline(always)]
    fn footprint(&self, point: &Point<'_>, ray: &Ray, hit: &Hit) -> (f32, f32) {
        let length = ray.direction.length();
        let facing = (point.geometric.dot(ray.direction) / length).abs();
        let pixel = self.view.fixed + self.view.per_depth * (hit.t * length);
        // The pixel's footprint on the surface is an ellipse. OpenGL uses its longer axis.
        (pixel, pixel / facing.max(1e-3))
    }
}
