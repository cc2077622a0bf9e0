//! How much light the luminous primitives of a node bring to a face, about.
//!
//! It is the power over the squared distance of the node's center, times the greatest cosine under
//! which the face sees a point of the sphere around the node (Conty Estevez and Kulla, "Importance
//! sampling of many lights with adaptive tree splitting", 2018). It is 0 only if the face cannot
//! see the sphere. Where the lamps face is not considered. In place of the cosine a face with
//! highlights has the share of the light that it sends to the viewer.

use std::f32::consts::FRAC_1_PI;

use glam::Vec3;

use super::emitter_tree::LampNode;

/// A face that is to be lit.
#[derive(Clone, Copy, Debug, Default)]
pub(crate) struct LitFace {
    pub position: Vec3,
    /// The normal, of length 1, on the side that is lit.
    pub normal: Vec3,
    /// The face's highlights; `None` if it is matte.
    pub highlight: Option<FacetHighlight>,
}

/// The microfacets of a face, seen from one direction.
///
/// A lamp is bright in them if the normal halfway between it and the viewer is frequent. A wide
/// lamp has many such normals: their distribution is widened by half the angle of its radius.
#[derive(Clone, Copy, Debug)]
pub(crate) struct FacetHighlight {
    /// The direction to the viewer, of length 1.
    pub viewer: Vec3,
    /// The normal that the facets scatter around, of length 1.
    pub normal: Vec3,
    /// The square of the roughness α.
    pub square: f32,
    /// The share of light that the facets send back over four times the cosine of the viewer.
    pub strength: f32,
    /// The share of light that the rest of the surface sends back.
    pub matte: f32,
}

impl FacetHighlight {
    /// About the share of the light from a direction of length 1 that goes to the viewer, for a
    /// lamp with the square `wide` of its radius over its distance, and with its greatest cosine.
    #[inline(always)]
    pub(super) fn share(&self, [x, y, z]: [f32; 3], wide: f32, greatest: f32) -> f32 {
        let (v, n) = (self.viewer, self.normal);
        let (hx, hy, hz) = (v.x + x, v.y + y, v.z + z);
        let along = n.x * hx + n.y * hy + n.z * hz;
        let square = hx * hx + hy * hy + hz * hz;
        let cosine = along * along / if square > 1e-12 { square } else { 1e-12 };
        let rough = self.square + 0.25 * wide;
        let spread = cosine * (rough - 1.0) + 1.0;
        let spread = spread * spread;
        let density = FRAC_1_PI * rough / if spread > 1e-12 { spread } else { 1e-12 };
        self.matte * FRAC_1_PI * greatest + self.strength * density
    }

    /// About the share of a lamp's light that goes to the viewer if the lamp surrounds the face.
    pub(super) fn share_around(&self) -> f32 {
        self.matte + self.strength
    }
}

impl LitFace {
    /// About the light that a node brings, in arbitrary units.
    #[inline]
    pub(crate) fn light_of(&self, node: &LampNode) -> f32 {
        let (center, radius) = node.sphere();
        let to = center - self.position;
        let (square, own) = (to.length_squared(), radius * radius);
        if square <= own {
            let share = self.highlight.map_or(1.0, |h| h.share_around());
            return share * node.power / own.max(f32::MIN_POSITIVE);
        }
        // The cosines of the angle to the center and of half the angle across the sphere.
        let distance = square.sqrt();
        let cosine = self.normal.dot(to) / distance;
        let across = (1.0 - own / square).sqrt();
        let greatest = match cosine < across {
            true => {
                let sines = ((1.0 - cosine * cosine).max(0.0) * (own / square)).sqrt();
                cosine * across + sines
            }
            false => 1.0,
        };
        let share = match &self.highlight {
            Some(highlight) if greatest > 0.0 => {
                let toward = to / distance;
                highlight.share(toward.to_array(), own / square, greatest)
            }
            _ => greatest.max(0.0),
        };
        node.power * share / square
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_node_brings_light_if_the_face_can_see_its_sphere() {
        let face = LitFace {
            position: Vec3::new(1.0, 0.0, 0.0),
            normal: Vec3::Y,
            highlight: None,
        };
        let light = |x: f32, y: f32| {
            let center = Vec3::new(x, y, 0.0);
            face.light_of(&LampNode {
                low: center - 1.0,
                high: center + 1.0,
                area: 1.0,
                power: 8.0,
            })
        };
        // Straight above, at 10 m; beside; a little and far below the horizon; around the face.
        assert!((light(1.0, 10.0) - 0.08).abs() < 1e-6);
        let (sine, square) = (3f32.sqrt() / 10.0, 100.0);
        assert!((light(11.0, 0.0) - 8.0 * sine / square).abs() < 1e-5);
        assert!(light(11.0, -1.7) > 0.0 && light(11.0, -1.8) == 0.0);
        assert!(light(11.0, -10.0) == 0.0);
        assert!((light(1.5, -0.5) - 8.0 / 3.0).abs() < 1e-5);
    }

    /// A lamp in a mirror's direction is the brightest, and one behind the face brings nothing.
    #[test]
    fn a_highlight_is_where_a_mirror_shows_the_lamp() {
        let face = LitFace {
            position: Vec3::ZERO,
            normal: Vec3::Y,
            highlight: Some(FacetHighlight {
                viewer: Vec3::new(0.6, 0.8, 0.0),
                normal: Vec3::Y,
                square: 0.01,
                strength: 0.5 / (4.0 * 0.8),
                matte: 0.5,
            }),
        };
        let light = |degrees: f32| {
            let turn = degrees.to_radians();
            let center = 10.0 * Vec3::new(-libm::sinf(turn), libm::cosf(turn), 0.0);
            let (low, high) = (center - 0.01, center + 0.01);
            let (area, power) = (1.0, 1.0);
            let node = LampNode {
                low,
                high,
                area,
                power,
            };
            face.light_of(&node)
        };
        let (mirror, aside) = (light(36.87), light(60.0));
        assert!(mirror > 10.0 * aside && light(36.0) < mirror && light(38.0) < mirror);
        // Far from the mirror's direction the matte part is left, and 2.7% of it by GGX's tail.
        assert!((light(-40.0) / (0.5 * FRAC_1_PI * 0.766 * 0.01) - 1.027).abs() < 2e-3);
        assert_eq!(light(100.0), 0.0);
    }
}
