//! A photographer's studio around a scene: its place and sizes, in proportion to the scene's box.
//!
//! A sheet of paper lies below the scene and rises behind it in a curve, so that there is no
//! horizon. The large key lamp is to the left of the camera, 45° to the side and 45° up; a weak
//! fill lamp to the right; a small lamp behind the scene draws its rim. Lamps shine on their front
//! only, and their backs are not there for the camera.

use glam::{DVec3, Vec3};

/// What is added to a scene.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Studio {
    /// The box of the scene in meters, in world space.
    pub bounds: (DVec3, DVec3),
    /// The reflectance of the ground, as light; `None` adds no ground.
    pub ground: Option<Vec3>,
    /// Whether the ground rises behind the scene.
    pub has_backdrop: bool,
    /// Whether there are lamps.
    pub has_lamps: bool,
}

/// A flat lamp, in multiples of the scene's radius.
pub(super) struct StudioLamp {
    /// The angle from the camera's side, to the right, in degrees.
    azimuth: f64,
    /// The angle above the ground, in degrees.
    elevation: f64,
    distance: f64,
    /// The side of the square.
    side: f64,
    /// The level that the lamp gives to white that faces it at the scene's middle.
    level: f64,
}

pub(super) const LAMPS: [StudioLamp; 3] = [
    StudioLamp {
        azimuth: -45.0,
        elevation: 45.0,
        distance: 6.0,
        side: 4.0,
        level: 0.75,
    },
    StudioLamp {
        azimuth: 60.0,
        elevation: 25.0,
        distance: 7.0,
        side: 5.0,
        level: 0.12,
    },
    StudioLamp {
        azimuth: 150.0,
        elevation: 50.0,
        distance: 6.0,
        side: 2.0,
        level: 0.5,
    },
];

/// The distance of the paper's curve behind the scene's middle, in radii.
const BEHIND: f64 = 7.0;
/// The radius of the curve, in radii.
const CURVE: f64 = 4.0;
/// The extent of the paper to the sides, to the front and up, in radii.
const PAPER: f64 = 60.0;
/// The extent of a ground without a backdrop, in radii.
const PLAIN: f64 = 500.0;
/// The parts of the curve.
const STEPS: usize = 32;

/// The axes of a studio.
pub(super) struct StudioPlace {
    /// The point of the ground below the scene's middle.
    foot: DVec3,
    middle: DVec3,
    /// The horizontal direction from the camera to the scene.
    ahead: DVec3,
    right: DVec3,
    radius: f64,
}

impl Studio {
    /// Places the studio in front of a camera that looks in a direction. Returns `None` if the
    /// scene has no extent.
    pub(super) fn place(&self, looks: DVec3) -> Option<StudioPlace> {
        let (low, high) = self.bounds;
        let (middle, radius) = (0.5 * (low + high), 0.5 * (high - low).length());
        let flat = DVec3::new(looks.x, 0.0, looks.z);
        let ahead = flat.normalize_or(DVec3::NEG_Z);
        (radius > 0.0 && radius.is_finite()).then_some(StudioPlace {
            foot: DVec3::new(middle.x, low.y, middle.z),
            middle,
            ahead,
            right: ahead.cross(DVec3::Y),
            radius,
        })
    }
}

/// A strip of quadrilaterals: the left and right ends of its lines, with their normals.
pub(super) type Strip = Vec<([DVec3; 2], DVec3)>;

impl StudioPlace {
    /// The paper, or a plain ground.
    pub(super) fn ground(&self, has_backdrop: bool) -> Strip {
        let r = self.radius;
        let line = |along: f64, up: f64, wide: f64, normal: DVec3| {
            let middle = self.foot + r * (along * self.ahead + up * DVec3::Y);
            let side = r * wide * self.right;
            ([middle - side, middle + side], normal)
        };
        if !has_backdrop {
            return [-PLAIN, PLAIN]
                .map(|at| line(at, 0.0, PLAIN, DVec3::Y))
                .into();
        }
        let mut strip = vec![line(-PAPER, 0.0, PAPER, DVec3::Y)];
        for i in 0..=STEPS {
            let turn = std::f64::consts::FRAC_PI_2 * i as f64 / STEPS as f64;
            let (sin, cos) = (libm::sin(turn), libm::cos(turn));
            let (along, up) = (BEHIND + CURVE * sin, CURVE * (1.0 - cos));
            strip.push(line(along, up, PAPER, cos * DVec3::Y - sin * self.ahead));
        }
        strip.push(line(BEHIND + CURVE, PAPER, PAPER, -self.ahead));
        strip
    }

    /// The square of a lamp, and its radiance.
    pub(super) fn lamp(&self, lamp: &StudioLamp) -> (Strip, f32) {
        let (turn, rise) = (lamp.azimuth.to_radians(), lamp.elevation.to_radians());
        let flat = libm::sin(turn) * self.right - libm::cos(turn) * self.ahead;
        let toward = libm::cos(rise) * flat + libm::sin(rise) * DVec3::Y;
        let across = DVec3::Y.cross(toward).normalize_or(self.right);
        let up = toward.cross(across);
        let center = self.middle + self.radius * lamp.distance * toward;
        let half = 0.5 * self.radius * lamp.side;
        // Seen from the scene, counterclockwise.
        let line = |at: f64| {
            let middle = center + at * half * up;
            ([middle + half * across, middle - half * across], -toward)
        };
        // The irradiance that shows a level on white is π times it.
        let seen = lamp.side * lamp.side / (lamp.distance * lamp.distance);
        let radiance = std::f64::consts::PI * lamp.level / seen;
        (vec![line(-1.0), line(1.0)], radiance as f32)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_paper_lies_below_the_box_and_rises_behind_it() {
        let studio = Studio {
            bounds: (DVec3::new(-1.0, 2.0, -1.0), DVec3::new(1.0, 4.0, 1.0)),
            ground: Some(Vec3::ONE),
            has_backdrop: true,
            has_lamps: true,
        };
        let place = studio.place(DVec3::new(0.0, -0.5, -1.0)).unwrap();
        let strip = place.ground(true);
        assert!(strip.iter().all(|(line, _)| line[0].y >= 2.0 - 1e-12));
        let (last, normal) = strip.last().unwrap();
        assert!(last[0].y > 90.0 && last[0].z < -15.0 && *normal == DVec3::Z);
        // A line's right end is to the right, so that the upper side is the front.
        assert!(strip[0].0[1].x > strip[0].0[0].x);
        for lamp in &LAMPS {
            let (square, radiance) = place.lamp(lamp);
            let [[a, b], [c, _]] = [square[0].0, square[1].0];
            let normal = (b - a).cross(c - a).normalize();
            assert!(normal.dot(place.middle - a) > 0.0 && radiance > 0.0);
            assert!((normal - square[0].1).length() < 1e-9);
        }
        assert!(studio.place(DVec3::NEG_Y).is_some());
    }
}
