//! Lights as shading needs them, with OpenGL's rules for attenuation and spots.

use glam::{DVec3, Vec3};

use crate::traversal::state::{LightElement, LightKind};

#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Light {
    pub kind: LightKind,
    /// Color times intensity.
    pub color: Vec3,
    /// VRML 97's ambient share of the color.
    pub ambient: Vec3,
    pub position: Vec3,
    /// Where the light goes, of length 1.
    pub direction: Vec3,
    /// Quadratic, linear, constant.
    pub attenuation: Vec3,
    pub radius: f32,
}

/// What of a light reaches a point.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Reaching {
    /// Towards the light, of length 1.
    pub toward: Vec3,
    pub distance: f32,
    pub color: Vec3,
    pub ambient: Vec3,
}

impl Light {
    pub(crate) fn new(element: &LightElement, origin: DVec3) -> Self {
        let color = element.color * element.intensity;
        Self {
            kind: element.kind,
            color,
            ambient: element.color * element.ambient,
            position: (element.position - origin).as_vec3(),
            direction: element.direction.as_vec3(),
            attenuation: element.attenuation,
            radius: element.radius,
        }
    }

    /// A light on the camera, shining along a direction.
    pub(crate) fn headlight(direction: Vec3) -> Self {
        Self {
            kind: LightKind::Directional,
            color: Vec3::ONE,
            ambient: Vec3::ZERO,
            position: Vec3::ZERO,
            direction: direction.normalize_or(Vec3::NEG_Z),
            attenuation: Vec3::Z,
            radius: f32::INFINITY,
        }
    }

    /// The light at a point: direction, distance, and color after attenuation and the spot.
    ///
    /// OpenGL 1.x: attenuation 1/(k_c + k_l d + k_q d²); a spot is max(−L·s, 0)^e inside its
    /// cone, e being Inventor's drop-off rate times 128, and nothing outside.
    pub(crate) fn reach(&self, point: Vec3) -> Reaching {
        if self.kind == LightKind::Directional {
            return Reaching {
                toward: -self.direction,
                distance: f32::INFINITY,
                color: self.color,
                ambient: self.ambient,
            };
        }
        let to = self.position - point;
        let distance = to.length();
        let toward = to / distance.max(f32::MIN_POSITIVE);
        let a = self.attenuation;
        let falloff = a.z + distance * (a.y + distance * a.x);
        let mut factor = if falloff > 0.0 { 1.0 / falloff } else { 1.0 };
        if distance > self.radius {
            factor = 0.0;
        }
        let spot = self.cone(toward);
        Reaching {
            toward,
            distance,
            color: self.color * (factor * spot),
            ambient: self.ambient * (factor * spot),
        }
    }
}

impl Light {
    /// Of a spot: the cosine at its edge, and the power of the cosine inside.
    pub(crate) fn spot(&self) -> Option<(f32, f32)> {
        match self.kind {
            LightKind::Spot { drop_off, cut_off } => Some(spot(drop_off, cut_off)),
            _ => None,
        }
    }

    /// The share of the light that a cone lets out towards a point, given the way back.
    pub(crate) fn cone(&self, toward: Vec3) -> f32 {
        let along = -toward.dot(self.direction);
        match self.kind {
            LightKind::Spot { drop_off, cut_off } => {
                let (least, exponent) = spot(drop_off, cut_off);
                if along < least || along <= 0.0 {
                    return 0.0;
                }
                libm::powf(along, exponent)
            }
            LightKind::Beam {
                beam_width,
                cut_off,
            } => beam(along, beam_width, cut_off),
            _ => 1.0,
        }
    }
}

fn spot(drop_off: f32, cut_off: f32) -> (f32, f32) {
    let limit = cut_off.clamp(0.0, std::f32::consts::FRAC_PI_2);
    (libm::cosf(limit), 128.0 * drop_off.clamp(0.0, 1.0))
}

/// VRML 97, 6.42: full inside the beam, then falling to nothing at the cut-off.
fn beam(along: f32, beam_width: f32, cut_off: f32) -> f32 {
    let angle = libm::acosf(along.clamp(-1.0, 1.0));
    if angle >= cut_off {
        0.0
    } else if beam_width >= cut_off || angle <= beam_width {
        1.0
    } else {
        (cut_off - angle) / (cut_off - beam_width)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn light_falls_with_the_square_of_the_distance_when_told() {
        let light = Light {
            kind: LightKind::Point,
            attenuation: Vec3::X,
            ..Light::headlight(Vec3::NEG_Z)
        };
        let near = light.reach(Vec3::new(0.0, 0.0, 1.0)).color.x;
        let far = light.reach(Vec3::new(0.0, 0.0, 3.0)).color.x;
        assert!((near / far - 9.0).abs() < 1e-5);
    }

    #[test]
    fn a_spot_ends_at_its_cut_off_angle() {
        let angle: f32 = 0.5;
        let light = Light {
            kind: LightKind::Spot {
                drop_off: 0.0,
                cut_off: angle,
            },
            ..Light::headlight(Vec3::NEG_Z)
        };
        let cone = |angle: f32| light.cone(Vec3::new(libm::sinf(angle), 0.0, libm::cosf(angle)));
        let (inside, outside) = (cone(angle - 0.01), cone(angle + 0.01));
        assert_eq!((inside, outside), (1.0, 0.0));
    }
}
