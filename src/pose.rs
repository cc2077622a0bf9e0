//! Where a camera stands: a scene's camera node, a `-camread` file's, or a view of everything.
//!
//! A pose is in world space, in meters. The camera looks down its own −z with +y up, as in
//! Inventor. Nothing here knows about lenses.

use glam::{DMat3, DMat4, DQuat, DVec3};

use crate::grammar::value::Rotation;
use crate::grammar::{
    Field, camera, film_camera, orthographic_camera, perspective_camera, viewpoint,
};
use crate::iv::NodeRef;

/// How a pinhole maps directions to the picture.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Projection {
    /// Angle in radians from the bottom to the top of the view.
    Perspective { height_angle: f64 },
    /// Height of the view in meters.
    Orthographic { height: f64 },
}

/// What to do where the picture and the camera have different aspect ratios; `AdjustCamera` is
/// Inventor's default.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum ViewportMapping {
    CropViewportFillFrame,
    CropViewportLineFrame,
    CropViewportNoFrame,
    #[default]
    AdjustCamera,
    LeaveAlone,
}

/// A film behind a lens of solids, in the camera's frame: meters, the front vertex at the origin.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct FilmPlane {
    /// Of a film 24 mm high, by the paper's equation 7, in radians.
    pub height_angle: f64,
    /// The film's z, and that of the disc that its rays aim at.
    pub film_z: f64,
    pub rear_z: f64,
    pub rear_radius: f64,
    /// On the axis from radiance 1, in steradians: what renders as white.
    pub irradiance: f64,
}

#[derive(Clone, Debug, PartialEq)]
pub struct CameraPose {
    pub position: DVec3,
    pub orientation: DQuat,
    pub projection: Projection,
    pub near: f64,
    pub far: f64,
    /// The distance that the scene says is in focus.
    pub focal_distance: f64,
    pub aspect_ratio: f64,
    pub viewport_mapping: ViewportMapping,
    /// Of a `FilmCamera`: the film, behind a lens that stands in the scene.
    pub film: Option<FilmPlane>,
    /// Where the pose is from, for messages: `PerspectiveCamera`, `viewAll`, ….
    pub source: String,
}

impl CameraPose {
    /// The pose of a camera node or a VRML 97 `Viewpoint`; `None` for any other node.
    ///
    /// The world's matrix moves the position and turns the orientation; its scale does not change
    /// the projection (Coin does the same).
    pub fn from_node(node: NodeRef<'_>, world_from_camera: DMat4) -> Option<Self> {
        let class = node.class()?;
        let number = |field: Field<f32>| {
            let value = node.get(field);
            f64::from(if value.is_finite() {
                value
            } else {
                field.default()
            })
        };
        let projection = if class.is_a("PerspectiveCamera") || class.name == "FrustumCamera" {
            Projection::Perspective {
                height_angle: number(perspective_camera::HEIGHT_ANGLE),
            }
        } else if class.is_a("OrthographicCamera") {
            Projection::Orthographic {
                height: number(orthographic_camera::HEIGHT),
            }
        } else if class.name.ends_with("Viewpoint") {
            Projection::Perspective {
                height_angle: number(viewpoint::FIELD_OF_VIEW),
            }
        } else {
            return None;
        };
        let position = world_from_camera.transform_point3(node.get(camera::POSITION).as_dvec3());
        let turn = quat(node.get(camera::ORIENTATION));
        Some(Self {
            position,
            orientation: (rotation_of(world_from_camera) * turn).normalize(),
            projection,
            near: number(camera::NEAR_DISTANCE),
            far: number(camera::FAR_DISTANCE),
            focal_distance: number(camera::FOCAL_DISTANCE),
            aspect_ratio: number(camera::ASPECT_RATIO),
            viewport_mapping: ViewportMapping::of(node.get(camera::VIEWPORT_MAPPING)),
            film: class.is_a("FilmCamera").then(|| FilmPlane {
                height_angle: number(film_camera::HEIGHT_ANGLE),
                film_z: number(film_camera::FILM_DISTANCE),
                rear_z: number(film_camera::REAR_DISTANCE),
                rear_radius: number(film_camera::REAR_RADIUS),
                irradiance: number(film_camera::IRRADIANCE),
            }),
            source: class.name.to_owned(),
        })
    }

    /// The view of everything as Inventor's `viewAll` takes it: down −z, height angle π/4, the
    /// box's circumscribed sphere touching the frustum on the narrower side.
    pub fn view_all(bounds: (DVec3, DVec3), aspect: f64) -> Self {
        let height_angle = std::f64::consts::FRAC_PI_4;
        let radius = 0.5 * (bounds.1 - bounds.0).length();
        let distance = radius / aspect.min(1.0) / libm::tan(0.5 * height_angle);
        Self::in_front_of(bounds, distance, height_angle)
    }

    /// The same through a lens that sees this half angle (radians) on the film's shorter side: the
    /// sphere lies within it.
    pub fn view_all_within(bounds: (DVec3, DVec3), half_angle: f64) -> Self {
        let radius = 0.5 * (bounds.1 - bounds.0).length();
        let distance = radius / libm::sin(half_angle);
        Self {
            source: "viewAll through the lens".into(),
            ..Self::in_front_of(bounds, distance, 2.0 * half_angle)
        }
    }

    /// Looks down −z at the middle of a box from a distance.
    fn in_front_of(bounds: (DVec3, DVec3), distance: f64, height_angle: f64) -> Self {
        let center = 0.5 * (bounds.0 + bounds.1);
        let radius = 0.5 * (bounds.1 - bounds.0).length();
        Self {
            position: center + DVec3::Z * distance,
            orientation: DQuat::IDENTITY,
            projection: Projection::Perspective { height_angle },
            near: distance - radius,
            far: distance + radius,
            focal_distance: distance,
            aspect_ratio: 1.0,
            viewport_mapping: ViewportMapping::AdjustCamera,
            film: None,
            source: "viewAll".into(),
        }
    }

    /// Where the camera looks, of length 1.
    pub fn direction(&self) -> DVec3 {
        self.orientation * DVec3::NEG_Z
    }

    pub fn world_from_camera(&self) -> DMat4 {
        DMat4::from_rotation_translation(self.orientation, self.position)
    }
}

impl ViewportMapping {
    /// From the field's value in files.
    pub fn of(value: i32) -> Self {
        match value {
            camera::VIEWPORT_MAPPING_CROP_VIEWPORT_FILL_FRAME => Self::CropViewportFillFrame,
            camera::VIEWPORT_MAPPING_CROP_VIEWPORT_LINE_FRAME => Self::CropViewportLineFrame,
            camera::VIEWPORT_MAPPING_CROP_VIEWPORT_NO_FRAME => Self::CropViewportNoFrame,
            camera::VIEWPORT_MAPPING_LEAVE_ALONE => Self::LeaveAlone,
            _ => Self::AdjustCamera,
        }
    }
}

/// A rotation at full precision; an axis of no length turns nothing.
pub fn quat(rotation: Rotation) -> DQuat {
    let half = 0.5 * f64::from(rotation.angle);
    match rotation.axis.as_dvec3().try_normalize() {
        Some(axis) if half.is_finite() => {
            let v = axis * libm::sin(half);
            DQuat::from_xyzw(v.x, v.y, v.z, libm::cos(half))
        }
        _ => DQuat::IDENTITY,
    }
}

/// A turn's axis, of length 1, and its angle in radians.
pub fn axis_angle(turn: DQuat) -> (DVec3, f64) {
    let v = DVec3::new(turn.x, turn.y, turn.z);
    let angle = 2.0 * libm::atan2(v.length(), turn.w);
    (v.try_normalize().unwrap_or(DVec3::Z), angle)
}

/// The rotation in a matrix: its orthogonal polar factor, by Higham's iteration, which a shear
/// or a scale does not disturb. A mirror or a flat matrix gives the nearest rotation or none.
pub fn rotation_of(matrix: DMat4) -> DQuat {
    let mut m = DMat3::from_mat4(matrix);
    if m.determinant() == 0.0 || !m.is_finite() {
        return DQuat::IDENTITY;
    }
    for _ in 0..40 {
        let next = (m + m.inverse().transpose()) * 0.5;
        let change = (next - m)
            .to_cols_array()
            .iter()
            .fold(0.0, |a: f64, c| a.max(c.abs()));
        m = next;
        if change < 1e-15 {
            break;
        }
    }
    if m.determinant() < 0.0 {
        m *= -1.0;
    }
    DQuat::from_mat3(&m).normalize()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_view_of_everything_touches_the_sphere_around_the_box() {
        let pose = CameraPose::view_all((DVec3::splat(-1.0), DVec3::splat(1.0)), 1.5);
        let radius = 3f64.sqrt();
        let distance = pose.position.z;
        // A ray at half the height angle passes the center at the sphere's projected radius.
        assert!((distance * (std::f64::consts::PI / 8.0).tan() - radius).abs() < 1e-12);
        assert_eq!(pose.direction(), DVec3::NEG_Z);
    }

    #[test]
    fn a_view_through_a_lens_has_the_sphere_within_its_angle() {
        let pose = CameraPose::view_all_within((DVec3::splat(-1.0), DVec3::splat(1.0)), 0.9);
        assert!((pose.position.z * 0.9f64.sin() - 3f64.sqrt()).abs() < 1e-12);
    }

    #[test]
    fn a_scale_does_not_turn_the_camera() {
        let turn = DQuat::from_axis_angle(DVec3::new(1.0, 2.0, 3.0).normalize(), 0.7);
        let matrix = DMat4::from_quat(turn) * DMat4::from_scale(DVec3::new(2.0, 5.0, 0.1));
        assert!(rotation_of(matrix).dot(turn).abs() > 1.0 - 1e-12);
    }
}
