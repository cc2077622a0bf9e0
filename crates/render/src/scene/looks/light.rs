//! Lights of a compiled scene, with OpenGL's rules for attenuation and spots.

use glam::{DVec3, Vec3};
use ivcam_base::math::lanes::power;
use ivcam_inventor::iv::display_of_linear;
use ivcam_inventor::traversal::state::{LightElement, LightKind};

use crate::scene::options::ColorCoding;

/// The bits of all values of a light, which are the same for lights that shine alike.
pub(in crate::scene) type LightBits = [u32; 22];

/// A light of a compiled scene.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Light {
    /// The kind of the light, with its cone.
    pub kind: LightKind,
    /// The color times the intensity.
    pub color: Vec3,
    /// The ambient color of a VRML 97 light; zero for Inventor's lights.
    pub ambient: Vec3,
    /// The position in meters; unused for a directional light.
    pub position: Vec3,
    /// The direction of the light or of its axis, of length 1.
    pub direction: Vec3,
    /// The quadratic, linear and constant coefficient of the attenuation.
    pub attenuation: Vec3,
    /// The least divisor of the attenuation.
    pub least_divisor: f32,
    /// The distance at which a VRML 97 light ends, in meters; infinite for Inventor's lights.
    pub radius: f32,
    /// Whether the light fades toward that distance, as glTF's, in place of a sudden end.
    pub fades: bool,
    /// The intensity of a light whose light becomes the level of a screen where it arrives; 0 for
    /// other lights.
    pub encoded: f32,
    /// Whether the light is at the camera, so that nothing that is seen is in its shadow.
    pub at_eye: bool,
}

/// A ray toward a light ends at this share of the distance, so that nothing behind the light casts
/// a shadow.
pub const SHADOW_END: f32 = 1.0 - 1e-5;

/// The light that arrives at a point from one light.
#[derive(Clone, Copy, Debug)]
pub struct IncidentLight {
    /// The direction toward the light, of length 1.
    pub toward: Vec3,
    /// The distance to the light in meters.
    pub distance: f32,
    /// The color after attenuation and the spot's cone.
    pub color: Vec3,
    /// The ambient color after attenuation and the spot's cone.
    pub ambient: Vec3,
}

impl Light {
    /// Converts a light to a scene with an origin. A light of glTF is encoded where light is
    /// computed with the levels of a screen.
    pub(crate) fn new(element: &LightElement, origin: DVec3, colors: ColorCoding) -> Self {
        let own = colors.for_element(element.linear).light(element.color);
        let color = own * element.intensity;
        let is_encoded = element.linear && colors == ColorCoding::Levels;
        Self {
            encoded: if is_encoded { element.intensity } else { 0.0 },
            kind: element.kind,
            color,
            ambient: own * element.ambient,
            position: (element.position - origin).as_vec3(),
            direction: element.direction.as_vec3(),
            attenuation: element.attenuation,
            least_divisor: element.least_divisor,
            radius: element.radius,
            fades: element.linear,
            at_eye: false,
        }
    }

    /// The bits of all values.
    pub(in crate::scene) fn bits(&self) -> LightBits {
        let (kind, [inner, outer]) = match self.kind {
            LightKind::Directional => (0, [0.0; 2]),
            LightKind::Point => (1, [0.0; 2]),
            LightKind::Spot { drop_off, cut_off } => (2, [drop_off, cut_off]),
            LightKind::Beam {
                beam_width,
                cut_off,
            } => (3, [beam_width, cut_off]),
            LightKind::Cone { inner, outer } => (4, [inner, outer]),
        };
        let vectors = [
            self.color,
            self.ambient,
            self.position,
            self.direction,
            self.attenuation,
        ];
        let fades = f32::from(self.fades);
        let scalars = [
            inner,
            outer,
            self.least_divisor,
            self.radius,
            self.encoded,
            fades,
        ];
        let mut bits = [kind; 22];
        let values = vectors.iter().flat_map(Vec3::to_array).chain(scalars);
        for (bits, value) in bits.iter_mut().skip(1).zip(values) {
            *bits = (value + 0.0).to_bits(); // −0 becomes 0
        }
        bits
    }

    /// Returns the light with `at_eye` set if it is not directional and no farther from the camera,
    /// which is the origin, than 1e-5 of the scene's extent. Its shadows are then hidden behind
    /// what casts them, to a hundredth of a pixel.
    pub(super) fn placed_at_eye(self, extent: f32) -> Self {
        let is_near = self.position.length() <= 1e-5 * extent;
        Self {
            at_eye: self.kind != LightKind::Directional && is_near,
            ..self
        }
    }

    /// A directional light on the camera.
    pub fn headlight(direction: Vec3) -> Self {
        Self {
            kind: LightKind::Directional,
            color: Vec3::ONE,
            ambient: Vec3::ZERO,
            position: Vec3::ZERO,
            direction: direction.normalize_or(Vec3::NEG_Z),
            attenuation: Vec3::Z,
            least_divisor: 0.0,
            radius: f32::INFINITY,
            fades: false,
            encoded: 0.0,
            at_eye: true,
        }
    }

    /// Returns the light that arrives at a point.
    ///
    /// As in OpenGL 1.x the attenuation is 1/(k_c + k_l d + k_q d²). VRML 97 takes at least 1 for
    /// the divisor (6.35). A spot's factor is max(−L·s,
    /// 0)^e inside its cone, where e is Inventor's drop-off rate times 128, and 0 outside.
    pub(crate) fn reach(&self, point: Vec3) -> IncidentLight {
        if self.kind == LightKind::Directional {
            return IncidentLight {
                toward: -self.direction,
                distance: f32::INFINITY,
                color: self.color * self.shown(1.0),
                ambient: self.ambient,
            };
        }
        let to = self.position - point;
        let distance = to.length();
        let toward = to / distance.max(f32::MIN_POSITIVE);
        let a = self.attenuation;
        let falloff = (a.z + distance * (a.y + distance * a.x)).max(self.least_divisor);
        let mut factor = if falloff > 0.0 { 1.0 / falloff } else { 1.0 };
        factor *= self.left_at(distance);
        let factor = self.shown(factor * self.cone(toward));
        IncidentLight {
            toward,
            distance,
            color: self.color * factor,
            ambient: self.ambient * factor,
        }
    }
}

impl Light {
    /// Returns the share of the light that the radius leaves at a distance. That of glTF fades by
    /// 1 − (d/r)⁴, as `KHR_lights_punctual` recommends.
    #[inline(always)]
    pub(crate) fn left_at(&self, distance: f32) -> f32 {
        let ratio = if self.fades {
            distance / self.radius
        } else {
            0.0
        };
        let square = ratio * ratio;
        if distance > self.radius {
            0.0
        } else {
            1.0 - square * square
        }
    }

    /// Returns a factor of the light as a factor of the color: that of the screen's level, if the
    /// light is encoded.
    pub(crate) fn shown(&self, factor: f32) -> f32 {
        match self.encoded > 0.0 {
            true => display_of_linear(self.encoded * factor) / self.encoded,
            false => factor,
        }
    }

    /// Returns the cosine at the edge of a spot's cone, and the exponent of the cosine inside.
    /// Returns `None` for other lights.
    pub(crate) fn spot(&self) -> Option<(f32, f32)> {
        match self.kind {
            LightKind::Spot { drop_off, cut_off } => Some(spot(drop_off, cut_off)),
            _ => None,
        }
    }

    /// Returns the factor of a light's cone at a point, given the direction toward the light.
    pub(crate) fn cone(&self, toward: Vec3) -> f32 {
        let along = -toward.dot(self.direction);
        match self.kind {
            LightKind::Spot { drop_off, cut_off } => {
                let (least, exponent) = spot(drop_off, cut_off);
                if along < least || along <= 0.0 {
                    return 0.0;
                }
                power(along.min(1.0), exponent)
            }
            LightKind::Beam {
                beam_width,
                cut_off,
            } => beam(along, beam_width, cut_off),
            LightKind::Cone { inner, outer } => {
                let [full, none] = [inner, outer].map(libm::cosf);
                let part = ((along - none) / (full - none).max(1e-3)).clamp(0.0, 1.0);
                part * part
            }
            _ => 1.0,
        }
    }
}

/// Returns the cosine at the edge of an Inventor spot's cone, and the exponent of the cosine.
fn spot(drop_off: f32, cut_off: f32) -> (f32, f32) {
    let limit = cut_off.clamp(0.0, std::f32::consts::FRAC_PI_2);
    (libm::cosf(limit), 128.0 * drop_off.clamp(0.0, 1.0))
}

/// Returns the factor of a VRML 97 spot (6.42): 1 inside the beam, then falling to 0 at the
/// cut-off.
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
    fn quadratic_attenuation_falls_with_the_square_of_the_distance() {
        let light = Light {
            kind: LightKind::Point,
            attenuation: Vec3::X,
            ..Light::headlight(Vec3::NEG_Z)
        };
        let near = light.reach(Vec3::new(0.0, 0.0, 1.0)).color.x;
        let far = light.reach(Vec3::new(0.0, 0.0, 3.0)).color.x;
        assert!((near / far - 9.0).abs() < 1e-5);
    }

    /// The formulas of `KHR_lights_punctual`.
    #[test]
    fn a_light_of_gltf_fades_toward_its_range_and_the_edge_of_its_cone() {
        let light = Light {
            kind: LightKind::Cone {
                inner: 0.3,
                outer: 0.6,
            },
            attenuation: Vec3::X,
            radius: 2.0,
            fades: true,
            ..Light::headlight(Vec3::NEG_Z)
        };
        for (distance, left) in [(1.0, 15.0 / 16.0), (1.9, 0.185_493_75), (2.1, 0.0)] {
            let shown = light.reach(Vec3::new(0.0, 0.0, -distance)).color.x;
            let expected = left / (distance * distance);
            assert!((shown - expected).abs() < 1e-5, "{distance}: {shown}");
        }
        let [full, none] = [0.3, 0.6].map(libm::cosf);
        for (angle, part) in [(0.2, 1.0), (0.5, 0.1615), (0.7, 0.0)] {
            let cosine = libm::cosf(angle);
            let shown = light.cone(Vec3::new(libm::sinf(angle), 0.0, cosine));
            let linear = ((cosine - none) / (full - none)).clamp(0.0, 1.0);
            assert!((shown - linear * linear).abs() < 1e-5, "{angle}: {shown}");
            assert!((shown - part).abs() < 1e-3, "{angle}: {shown}");
        }
    }

    #[test]
    fn a_light_of_gltf_shows_the_level_of_its_illuminance() {
        let light = Light {
            kind: LightKind::Point,
            color: Vec3::splat(4.0),
            attenuation: Vec3::X,
            encoded: 4.0,
            ..Light::headlight(Vec3::NEG_Z)
        };
        let level = |distance: f32| light.reach(Vec3::new(0.0, 0.0, distance)).color.x;
        // The curve of sRGB gives white for 1 and a level of 0.5 for 0.214.
        assert!((level(2.0) - 1.0).abs() < 1e-5);
        assert!((level(libm::sqrtf(4.0 / 0.214_041_1)) - 0.5).abs() < 1e-5);
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
