//! Camera movements: orbit, pan, dolly, fly, view all, and Inventor's seek to a point.
//!
//! Each makes a pose from a pose. The panels convert pixels to angles and lengths.

use glam::{DQuat, DVec2, DVec3};
use ivcam_inventor::pose::CameraPose;

/// The action of the mouse on the picture.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub(crate) enum Tool {
    /// A click focuses on the visible point.
    #[default]
    Focus,
    Orbit,
    Pan,
    Dolly,
    /// Drags turn the camera; W, A, S, D, Q and E move it.
    Fly,
    /// A click moves half of the distance to the visible point and turns toward it.
    Seek,
}

impl Tool {
    /// The tools with their names and descriptions in the window.
    pub(crate) const ALL: [(Self, &'static str, &'static str); 6] = [
        (Self::Focus, "Focus", "click: focus there (1)"),
        (
            Self::Orbit,
            "Orbit",
            "drag: turn around what is in the middle of the picture (2)",
        ),
        (
            Self::Pan,
            "Pan",
            "drag: move across (3; also the middle button)",
        ),
        (
            Self::Dolly,
            "Dolly",
            "drag up and down: nearer and farther (4; also the wheel)",
        ),
        (Self::Fly, "Fly", "drag: look around; W A S D Q E: go (5)"),
        (
            Self::Seek,
            "Seek",
            "click: move half of the distance and look at the point (6)",
        ),
    ];
}

/// The camera's pose with the scales of its movements.
#[derive(Clone, Debug)]
pub(crate) struct Viewpoint {
    pub pose: CameraPose,
    /// The distance of the pivot in front of the camera, in meters.
    pub distance: f64,
    /// The size of the scene in meters.
    pub extent: f64,
}

impl Viewpoint {
    /// Turns around the pivot by radians to the right and up. The horizon remains level.
    pub(crate) fn orbit(&self, by: DVec2) -> CameraPose {
        let pivot = self.pose.position + self.distance * self.pose.direction();
        let orientation = self.turned(by);
        CameraPose {
            position: pivot - self.distance * (orientation * DVec3::NEG_Z),
            orientation,
            ..self.pose.clone()
        }
    }

    /// Turns the camera in place, by radians to the right and up.
    pub(crate) fn look(&self, by: DVec2) -> CameraPose {
        CameraPose {
            orientation: self.turned(by),
            ..self.pose.clone()
        }
    }

    fn turned(&self, by: DVec2) -> DQuat {
        let turn = DQuat::from_rotation_y(-by.x) * self.pose.orientation;
        let tilted = turn * DQuat::from_rotation_x(by.y);
        // The angle is limited so that the camera does not turn over.
        let up = (tilted * DVec3::Y).y;
        if up > 0.02 || up > (turn * DVec3::Y).y {
            tilted.normalize()
        } else {
            turn.normalize()
        }
    }

    /// Moves across by fractions of the view's height at the pivot.
    pub(crate) fn pan(&self, by: DVec2, height_angle: f64) -> CameraPose {
        let height = 2.0 * self.distance * libm::tan(0.5 * height_angle);
        self.moved(height * DVec3::new(-by.x, by.y, 0.0))
    }

    /// Moves nearer (positive) or farther: each unit leaves 1/e of the distance to the pivot.
    pub(crate) fn dolly(&self, by: f64) -> CameraPose {
        let go = self.distance * (1.0 - libm::exp(-by));
        self.moved(DVec3::new(0.0, 0.0, -go))
    }

    /// Moves right, up and forward, in fractions of the scene's size.
    pub(crate) fn fly(&self, by: DVec3) -> CameraPose {
        self.moved(self.extent * DVec3::new(by.x, by.y, -by.z))
    }

    fn moved(&self, camera: DVec3) -> CameraPose {
        let position = self.pose.position + self.pose.orientation * camera;
        CameraPose {
            position: if position.is_finite() {
                position
            } else {
                self.pose.position
            },
            ..self.pose.clone()
        }
    }
}

/// Returns the distance at which the sphere around a box fills the shorter side of a picture with
/// this height angle (radians) and aspect ratio.
pub(crate) fn viewing_distance(bounds: (DVec3, DVec3), height_angle: f64, aspect: f64) -> f64 {
    let half = libm::tan(0.5 * height_angle) * aspect.min(1.0);
    radius(bounds) / libm::sin(libm::atan(half)).max(1e-3)
}

fn radius(bounds: (DVec3, DVec3)) -> f64 {
    (0.5 * (bounds.1 - bounds.0).length()).max(1e-6)
}

/// Moves to a distance from the middle of a box, seen in the direction of the pose, as Inventor's
/// `viewAll` does.
pub(crate) fn view_all(pose: &CameraPose, bounds: (DVec3, DVec3), distance: f64) -> CameraPose {
    let center = 0.5 * (bounds.0 + bounds.1);
    let radius = radius(bounds);
    CameraPose {
        position: center - distance * pose.direction(),
        near: (distance - radius).max(1e-3 * distance),
        far: distance + radius,
        focal_distance: distance,
        ..pose.clone()
    }
}

/// Returns the end of a seek to a point: half of the distance, looking at it.
pub(crate) fn seek(pose: &CameraPose, point: DVec3) -> CameraPose {
    let path = point - pose.position;
    let Some(toward) = path.try_normalize() else {
        return pose.clone();
    };
    let turn = DQuat::from_rotation_arc(pose.direction(), toward);
    CameraPose {
        position: pose.position + 0.5 * path,
        orientation: leveled((turn * pose.orientation).normalize()),
        focal_distance: 0.5 * path.length(),
        ..pose.clone()
    }
}

/// Levels the horizon, unless the camera looks straight up or down.
fn leveled(orientation: DQuat) -> DQuat {
    let back = orientation * DVec3::Z;
    let Some(right) = DVec3::Y.cross(back).try_normalize() else {
        return orientation;
    };
    if back.y.abs() > 0.999 {
        return orientation;
    }
    DQuat::from_mat3(&glam::DMat3::from_cols(right, back.cross(right), back)).normalize()
}

/// Interpolates between two poses, from 0 to 1, with a slow start and end.
pub(crate) fn between(from: &CameraPose, to: &CameraPose, at: f64) -> CameraPose {
    let t = at.clamp(0.0, 1.0);
    let s = t * t * (3.0 - 2.0 * t);
    CameraPose {
        position: from.position.lerp(to.position, s),
        orientation: from.orientation.slerp(to.orientation, s).normalize(),
        ..to.clone()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn viewpoint() -> Viewpoint {
        let mut pose = CameraPose::view_all((DVec3::splat(-1.0), DVec3::splat(1.0)), 1.5);
        pose.position = DVec3::new(0.5, 1.0, 4.0);
        Viewpoint {
            pose,
            distance: 2.0,
            extent: 10.0,
        }
    }

    #[test]
    fn an_orbit_keeps_the_pivot_and_its_distance() {
        let viewpoint = viewpoint();
        let pivot = |p: &CameraPose| p.position + 2.0 * p.direction();
        let there = viewpoint.orbit(DVec2::new(0.7, 0.3));
        assert!((pivot(&there) - pivot(&viewpoint.pose)).length() < 1e-12);
        assert!((there.position - viewpoint.pose.position).length() > 0.5);
        assert!((there.orientation * DVec3::X).y.abs() < 1e-12, "level");
    }

    #[test]
    fn a_look_straight_up_does_not_turn_over() {
        let mut viewpoint = viewpoint();
        for _ in 0..100 {
            viewpoint.pose = viewpoint.look(DVec2::new(0.0, 0.1));
        }
        assert!((viewpoint.pose.orientation * DVec3::Y).y > 0.0);
    }

    #[test]
    fn a_dolly_never_passes_the_pivot() {
        let mut viewpoint = viewpoint();
        for _ in 0..50 {
            let there = viewpoint.dolly(0.4);
            viewpoint.distance -= (there.position - viewpoint.pose.position).length();
            viewpoint.pose = there;
        }
        assert!(viewpoint.pose.position.z > 2.0 && viewpoint.pose.position.z < 2.001);
    }

    #[test]
    fn a_seek_moves_half_of_the_distance_and_looks_at_the_point() {
        let (viewpoint, point) = (viewpoint(), DVec3::new(-1.0, 0.2, -3.0));
        let there = seek(&viewpoint.pose, point);
        let path = point - there.position;
        assert!(path.normalize().dot(there.direction()) > 1.0 - 1e-12);
        assert!((path.length() - 0.5 * (point - viewpoint.pose.position).length()).abs() < 1e-12);
        assert!((there.orientation * DVec3::X).y.abs() < 1e-12);
    }

    #[test]
    fn a_view_of_all_touches_the_sphere() {
        let bounds = (DVec3::splat(-1.0), DVec3::splat(1.0));
        let distance = viewing_distance(bounds, 0.6, 1.5);
        let pose = view_all(&viewpoint().pose, bounds, distance);
        let distance = pose.position.length();
        assert!((distance * libm::sin(0.3) - 3f64.sqrt()).abs() < 1e-12);
    }
}
