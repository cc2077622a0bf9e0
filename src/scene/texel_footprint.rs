//! How many texels of a texture a pixel covers.

use glam::{Vec2, Vec3};

use super::looks::TextureUse;
use super::point::Point;
use super::render_scene::RenderScene;
use crate::bvh::{Hit, Ray};

impl RenderScene {
    /// How many texels a pixel covers where a ray meets a surface: its width there, by the texels a
    /// meter that a triangle's corners or a round shape's mapping give, or a line's ends by pixel.
    /// 1 where nothing says.
    pub(super) fn texels_across(
        &self,
        point: &Point<'_>,
        ray: &Ray,
        hit: &Hit,
        texture: &TextureUse,
    ) -> f32 {
        let index = hit.primitive as usize;
        if texture.texture.is_deep() && index >= self.triangles.len() {
            return 1.0;
        }
        let size = Vec2::new(texture.texture.width as f32, texture.texture.height as f32);
        let texel = |t: Vec2| texture.matrix.transform_point3(t.extend(0.0)).truncate() * size;
        let along = hit.t * ray.direction.length();
        let facing = (point.geometric.dot(ray.direction) / ray.direction.length()).abs();
        let pixel = self.view.fixed + self.view.per_depth * along;
        // The pixel's ellipse on the surface is longer than wide; OpenGL takes the longer side.
        let longer = pixel / facing.max(1e-3);
        let wide = if let Some([a, b, c]) = self.triangles.get(index) {
            let local = index - point.surface.first as usize;
            let Some(uv) = point.surface.coordinates.get(local) else {
                return 1.0;
            };
            let [a_at, b_at, c_at] = uv.map(texel);
            let texels = (b_at - a_at).perp_dot(c_at - a_at).abs();
            longer * (texels / (b - a).cross(c - a).length()).sqrt()
        } else if let Some(quadric) = self.quadrics.get(index - self.triangles.len()) {
            let at = |p: Vec3| {
                quadric
                    .texture_coordinates(quadric.project_to_surface(p.as_dvec3()).0)
                    .as_vec2()
            };
            let (middle, (right, up)) =
                (at(point.position), point.geometric.any_orthonormal_pair());
            // A step across the seam of a round texture is a short one too.
            let step = |way: Vec3| {
                let change = at(point.position + pixel * way) - middle;
                texel(change - change.round()) - texel(Vec2::ZERO)
            };
            longer / pixel * step(right).perp_dot(step(up)).abs().sqrt()
        } else {
            let stroke = &self.strokes[index - self.triangles.len() - self.quadrics.len()];
            let [from, to] = stroke.coordinates.map(texel);
            (to - from).length() / stroke.pixels(&self.view)
        };
        if wide.is_finite() { wide } else { 1.0 }
    }
}
