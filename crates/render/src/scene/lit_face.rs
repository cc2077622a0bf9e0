//! How much light the luminous primitives of a node bring to a face, about.
//!
//! It is the power over the squared distance of the node's center, times the greatest cosine under
//! which the face sees a point of the sphere around the node (Conty Estevez and Kulla, "Importance
//! sampling of many lights with adaptive tree splitting", 2018). It is 0 only if the face cannot
//! see the sphere. Where the lamps face is not considered.

use glam::Vec3;

use super::emitter_tree::LampNode;

/// A face that is to be lit.
#[derive(Clone, Copy, Debug, Default)]
pub(crate) struct LitFace {
    pub position: Vec3,
    /// The normal, of length 1, on the side that is lit.
    pub normal: Vec3,
}

impl LitFace {
    /// About the light that a node brings, in arbitrary units.
    #[inline]
    pub(crate) fn light_of(&self, node: &LampNode) -> f32 {
        let (center, radius) = node.sphere();
        let to = center - self.position;
        let (square, own) = (to.length_squared(), radius * radius);
        if square <= own {
            return node.power / own.max(f32::MIN_POSITIVE);
        }
        // The cosines of the angle to the center and of half the angle across the sphere.
        let cosine = self.normal.dot(to) / square.sqrt();
        let across = (1.0 - own / square).sqrt();
        let greatest = match cosine < across {
            true => {
                let sines = ((1.0 - cosine * cosine).max(0.0) * (own / square)).sqrt();
                cosine * across + sines
            }
            false => 1.0,
        };
        node.power * greatest.max(0.0) / square
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
}
