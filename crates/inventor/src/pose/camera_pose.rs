//! A camera's pose: from a camera node, or made to see a whole scene.

use glam::{DMat3, DMat4, DQuat, DVec2, DVec3};

use super::projection::{Projection, ViewportMapping};
use super::rotation::{orientation_in, quat};
use super::view_direction::ViewDirection;
use crate::grammar::{
    Class, Field, camera, class, film_camera, frustum_camera, ortho_viewpoint, orthographic_camera,
    perspective_camera, viewpoint,
};
use crate::iv::NodeRef;

/// A film behind a lens that is part of the scene. Lengths are in meters in the camera's space,
/// with the front vertex at the origin.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct FilmPlane {
    /// The height angle for a film that is 24 mm high, by the paper's equation 7, in radians.
    pub height_angle: f64,
    /// The z of the film.
    pub film_z: f64,
    /// The z of the disc at which rays from the film are aimed.
    pub rear_z: f64,
    /// The radius of that disc.
    pub rear_radius: f64,
    /// The irradiance on the axis from radiance 1, in steradians. It is rendered as white.
    pub irradiance: f64,
}

/// The position and orientation of a camera in the world, with its projection. Lengths are in
/// meters.
#[derive(Clone, Debug, PartialEq)]
pub struct CameraPose {
    /// The position of the eye.
    pub position: DVec3,
    /// The rotation from the camera's space to the world.
    pub orientation: DQuat,
    /// The mapping from directions to the picture.
    pub projection: Projection,
    /// The middle of the view at distance 1. Only that of a `FrustumCamera` may be off the axis.
    pub center: DVec2,
    /// The distance of the near clipping plane.
    pub near: f64,
    /// The distance of the far clipping plane.
    pub far: f64,
    /// Whether the scene or Inventor's `viewAll` states the far plane, so that fog may end there.
    pub has_far: bool,
    /// The focus distance in the scene file.
    pub focal_distance: f64,
    /// The width of the view over its height.
    pub aspect_ratio: f64,
    /// What happens if the picture has another aspect ratio.
    pub viewport_mapping: ViewportMapping,
    /// The film of a `FilmCamera`, behind a lens that is part of the scene.
    pub film: Option<FilmPlane>,
    /// The origin of the pose, for messages: `PerspectiveCamera`, `viewAll`, ….
    pub source: String,
}

impl CameraPose {
    /// Returns the pose of a camera node or a VRML97 `Viewpoint`; `None` for any other node.
    ///
    /// The matrix `world_from_camera` transforms the position and rotates the orientation. Its
    /// scale acts on the distances and the height of the view of Inventor's cameras. If it is not
    /// uniform, the picture is not stretched. A viewpoint of VRML97, X3D or glTF is not scaled. A
    /// reflection acts on the position, the view and its top; the picture is not mirrored.
    pub fn from_node(node: NodeRef<'_>, world_from_camera: DMat4) -> Option<Self> {
        let class = node.class()?;
        let number = |field| finite(node, field);
        let view = StatedView::of(node, class)?;
        let own = node.get(camera::POSITION);
        let own = if own.is_finite() {
            own
        } else {
            camera::POSITION.default()
        };
        let turn = quat(node.get(camera::ORIENTATION));
        let orientation = orientation_in(world_from_camera, turn);
        let position = world_from_camera.transform_point3(own.as_dvec3());
        let is_mirrored = world_from_camera.determinant() < 0.0;
        let sideways = DVec2::new(if is_mirrored { -1.0 } else { 1.0 }, 1.0);
        let position = position + orientation * (view.aside * sideways).extend(0.0);
        let [up, back] = match class.descends_from(class::CAMERA) {
            true => [DVec3::Y, DVec3::Z].map(|axis| scale_along(world_from_camera, turn * axis)),
            false => [1.0; 2],
        };
        Some(Self {
            position: if position.is_finite() {
                position
            } else {
                own.as_dvec3()
            },
            orientation: if orientation.is_finite() {
                orientation
            } else {
                DQuat::IDENTITY
            },
            projection: view.projection.scaled(up, back),
            center: view.center * sideways * (up / back),
            near: back * number(camera::NEAR_DISTANCE),
            far: back * number(camera::FAR_DISTANCE),
            has_far: class.descends_from(class::CAMERA) && node.states(camera::FAR_DISTANCE),
            focal_distance: back * number(camera::FOCAL_DISTANCE),
            aspect_ratio: view.aspect_ratio,
            viewport_mapping: view.mapping,
            film: class.descends_from(class::FILM_CAMERA).then(|| FilmPlane {
                height_angle: number(film_camera::HEIGHT_ANGLE),
                film_z: number(film_camera::FILM_DISTANCE),
                rear_z: number(film_camera::REAR_DISTANCE),
                rear_radius: number(film_camera::REAR_RADIUS),
                irradiance: number(film_camera::IRRADIANCE),
            }),
            source: class.name.to_owned(),
        })
    }

    /// Returns the pose with Inventor's default mapping that shows the same in a picture of an
    /// aspect ratio, if the view is that of an `OrthoViewpoint`.
    #[must_use]
    pub fn fitted(self, aspect: f64) -> Self {
        if self.viewport_mapping != ViewportMapping::ExtendView {
            return self;
        }
        let height = 2.0 * self.view_extent(aspect).half.min_element();
        Self {
            projection: Projection::Orthographic { height },
            viewport_mapping: ViewportMapping::AdjustCamera,
            ..self
        }
    }

    /// Returns the width of the view divided by its height: 1 with Inventor's default mapping,
    /// which shows a square in a picture of any shape, whatever the camera's `aspectRatio`.
    pub fn view_aspect(&self) -> f64 {
        match self.viewport_mapping {
            ViewportMapping::AdjustCamera => 1.0,
            _ if self.aspect_ratio > 0.0 => self.aspect_ratio,
            _ => 1.0,
        }
    }

    /// Returns the view of VRML97's default `Viewpoint`, which a viewer has while none is bound
    /// (ISO 14772-1, 4.6.10).
    pub fn default_viewpoint() -> Self {
        Self {
            position: viewpoint::POSITION.default().as_dvec3(),
            orientation: DQuat::IDENTITY,
            projection: Projection::Perspective {
                height_angle: f64::from(viewpoint::FIELD_OF_VIEW.default()),
            },
            center: DVec2::ZERO,
            near: f64::from(camera::NEAR_DISTANCE.default()),
            far: f64::from(camera::FAR_DISTANCE.default()),
            has_far: false,
            focal_distance: f64::from(camera::FOCAL_DISTANCE.default()),
            aspect_ratio: 1.0,
            viewport_mapping: ViewportMapping::AdjustCamera,
            film: None,
            source: "VRML97's default Viewpoint".into(),
        }
    }

    /// Returns a camera at `eye` that looks at `target`, both in meters, and focuses there. `up`
    /// points to the top of the picture; if it is parallel to the view, any direction does.
    /// `height_angle` is the angle from the bottom to the top of the view, in radians. The eye and
    /// the target may not be the same point.
    pub fn looking_at(eye: DVec3, target: DVec3, up: DVec3, height_angle: f64) -> Self {
        let back = (eye - target).normalize();
        let right = up
            .cross(back)
            .try_normalize()
            .unwrap_or_else(|| back.any_orthonormal_vector());
        let axes = DMat3::from_cols(right, back.cross(right), back);
        Self {
            position: eye,
            orientation: DQuat::from_mat3(&axes).normalize(),
            projection: Projection::Perspective { height_angle },
            focal_distance: eye.distance(target),
            source: "a program".into(),
            ..Self::default_viewpoint()
        }
    }

    /// Returns the view of a box that Inventor's `viewAll` makes: it looks down −z with a height
    /// angle of π/4, and the box's circumscribed sphere touches the frustum on the narrower side.
    pub fn view_all(bounds: (DVec3, DVec3), aspect: f64) -> Self {
        let height_angle = std::f64::consts::FRAC_PI_4;
        let radius = 0.5 * (bounds.1 - bounds.0).length();
        let distance = radius / aspect.min(1.0) / libm::tan(0.5 * height_angle);
        Self::in_front_of(bounds, distance, height_angle)
    }

    /// Returns the view of a box from a side. From the front it is that of
    /// [`CameraPose::view_all`], which may cut corners of a box that is turned; elsewhere the whole
    /// circumscribed sphere is inside the frustum.
    pub fn view_all_from(bounds: (DVec3, DVec3), aspect: f64, side: ViewDirection) -> Self {
        if side == ViewDirection::FRONT {
            return Self::view_all(bounds, aspect);
        }
        let height_angle = std::f64::consts::FRAC_PI_4;
        let radius = 0.5 * (bounds.1 - bounds.0).length();
        let distance = radius / aspect.min(1.0) / libm::sin(0.5 * height_angle);
        let middle = 0.5 * (bounds.0 + bounds.1);
        Self::in_front_of(bounds, distance, height_angle).turned_around(middle, side)
    }

    /// Returns the view of a box through a lens with this half field angle on the film's shorter
    /// side, in radians. The box's circumscribed sphere lies within the field.
    pub fn view_all_within(bounds: (DVec3, DVec3), half_angle: f64) -> Self {
        let radius = 0.5 * (bounds.1 - bounds.0).length();
        let distance = radius / libm::sin(half_angle);
        Self {
            source: "viewAll through the lens".into(),
            ..Self::in_front_of(bounds, distance, 2.0 * half_angle)
        }
    }

    /// Returns a pose that looks down −z at the middle of a box from a distance.
    fn in_front_of(bounds: (DVec3, DVec3), distance: f64, height_angle: f64) -> Self {
        let center = 0.5 * (bounds.0 + bounds.1);
        let radius = 0.5 * (bounds.1 - bounds.0).length();
        Self {
            position: center + DVec3::Z * distance,
            orientation: DQuat::IDENTITY,
            projection: Projection::Perspective { height_angle },
            center: DVec2::ZERO,
            near: distance - radius,
            far: distance + radius,
            has_far: true,
            focal_distance: distance,
            aspect_ratio: 1.0,
            viewport_mapping: ViewportMapping::AdjustCamera,
            film: None,
            source: "viewAll".into(),
        }
    }

    /// Returns the pose turned around a point, from the front of a scene to another side.
    #[must_use]
    pub fn turned_around(mut self, middle: DVec3, side: ViewDirection) -> Self {
        let turn = side.rotation();
        self.position = middle + turn * (self.position - middle);
        self.orientation = (turn * self.orientation).normalize();
        self.source = format!("{}, {} view", self.source, side.name());
        self
    }

    /// Returns the unit vector in which the camera looks.
    pub fn direction(&self) -> DVec3 {
        self.orientation * DVec3::NEG_Z
    }

    /// Returns the matrix from the camera's space to the world.
    pub fn world_from_camera(&self) -> DMat4 {
        DMat4::from_rotation_translation(self.orientation, self.position)
    }
}

/// What a camera node says of its view.
struct StatedView {
    projection: Projection,
    center: DVec2,
    aspect_ratio: f64,
    mapping: ViewportMapping,
    /// The way from the node's position to the eye, to the right and upward.
    aside: DVec2,
}

impl StatedView {
    /// Returns the view of a node, or `None` if its class is no camera.
    fn of(node: NodeRef<'_>, class: &Class) -> Option<Self> {
        let projection = if class.descends_from(class::FRUSTUM_CAMERA) {
            return Some(Self::of_frustum(node));
        } else if class.id == class::ORTHO_VIEWPOINT {
            return Some(Self::of_rectangle(node.get(ortho_viewpoint::FIELD_OF_VIEW)));
        } else if class.descends_from(class::PERSPECTIVE_CAMERA) {
            Projection::Perspective {
                height_angle: finite(node, perspective_camera::HEIGHT_ANGLE),
            }
        } else if class.descends_from(class::ORTHOGRAPHIC_CAMERA) {
            Projection::Orthographic {
                height: finite(node, orthographic_camera::HEIGHT),
            }
        } else if class.id == class::VIEWPOINT {
            Projection::Perspective {
                height_angle: finite(node, viewpoint::FIELD_OF_VIEW),
            }
        } else {
            return None;
        };
        Some(Self {
            projection,
            center: DVec2::ZERO,
            aspect_ratio: finite(node, camera::ASPECT_RATIO),
            mapping: ViewportMapping::of(node.get(camera::VIEWPORT_MAPPING)),
            aside: DVec2::ZERO,
        })
    }

    /// Returns the view of a `FrustumCamera`, whose sides are measured on the near plane.
    fn of_frustum(node: NodeRef<'_>) -> Self {
        let on_near_plane = |field| finite(node, field) / finite(node, camera::NEAR_DISTANCE);
        let low = DVec2::new(
            on_near_plane(frustum_camera::LEFT),
            on_near_plane(frustum_camera::BOTTOM),
        );
        let high = DVec2::new(
            on_near_plane(frustum_camera::RIGHT),
            on_near_plane(frustum_camera::TOP),
        );
        let (center, half) = rectangle(low, high, 0.5);
        Self {
            projection: Projection::Perspective {
                height_angle: 2.0 * libm::atan(half.y),
            },
            center,
            aspect_ratio: half.x / half.y,
            mapping: ViewportMapping::of(node.get(camera::VIEWPORT_MAPPING)),
            aside: DVec2::ZERO,
        }
    }

    /// Returns the view of an `OrthoViewpoint`: its field of view has the least x and y and the
    /// largest x and y, all of which is seen (ISO 19775-1, 23.4.5).
    fn of_rectangle(view: &[f32]) -> Self {
        let [left, bottom, right, top] = match *view {
            [left, bottom, right, top] => [left, bottom, right, top].map(f64::from),
            _ => [-1.0, -1.0, 1.0, 1.0],
        };
        let (aside, half) = rectangle(DVec2::new(left, bottom), DVec2::new(right, top), 1.0);
        Self {
            projection: Projection::Orthographic {
                height: 2.0 * half.y,
            },
            center: DVec2::ZERO,
            aspect_ratio: half.x / half.y,
            mapping: ViewportMapping::ExtendView,
            aside,
        }
    }
}

/// Returns the middle of a rectangle and half of its size. A side without an extent has
/// `usual_half`.
fn rectangle(low: DVec2, high: DVec2, usual_half: f64) -> (DVec2, DVec2) {
    let [middle, half] = [0.5 * (low + high), 0.5 * (high - low)];
    let usable = |half: f64| {
        if half.is_finite() && half > 0.0 {
            half
        } else {
            usual_half
        }
    };
    let middle = if middle.is_finite() {
        middle
    } else {
        DVec2::ZERO
    };
    (middle, DVec2::new(usable(half.x), usable(half.y)))
}

/// Returns the number of a field, or the field's default if it is not finite.
fn finite(node: NodeRef<'_>, field: Field<f32>) -> f64 {
    let value = node.get(field);
    f64::from(if value.is_finite() {
        value
    } else {
        field.default()
    })
}

/// Returns the length in the world of a unit vector of the space around a camera. What differs from
/// 1 by less than 1e-5 is the rounding of a rotation.
fn scale_along(world_from_camera: DMat4, axis: DVec3) -> f64 {
    let length = world_from_camera.transform_vector3(axis).length();
    let is_scaled = (length - 1.0).abs() > 1e-5 && length > 0.0 && length.is_finite();
    if is_scaled { length } else { 1.0 }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::iv::Document;

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
    fn a_view_from_a_side_contains_all_corners_of_the_box() {
        let bounds = (DVec3::new(-3.0, 0.0, 1.0), DVec3::new(1.0, 2.0, 7.0));
        for (_, side) in &ViewDirection::NAMED[1..] {
            let pose = CameraPose::view_all_from(bounds, 1.5, *side);
            let camera_from_world = pose.world_from_camera().inverse();
            for i in 0..8 {
                let pick = |k: usize| {
                    if i >> k & 1 == 0 {
                        bounds.0[k]
                    } else {
                        bounds.1[k]
                    }
                };
                let corner = DVec3::new(pick(0), pick(1), pick(2));
                let seen = camera_from_world.transform_point3(corner);
                let slope = seen.truncate().length() / -seen.z;
                assert!(
                    seen.z < 0.0 && slope <= (std::f64::consts::PI / 8.0).tan(),
                    "{slope}"
                );
            }
        }
    }

    #[test]
    fn a_camera_looks_at_its_target_with_the_top_upward() {
        let (eye, target) = (DVec3::new(1.0, 2.0, 3.0), DVec3::new(-2.0, 0.5, 4.0));
        let pose = CameraPose::looking_at(eye, target, DVec3::Y, 0.6);
        let wanted = (target - eye).normalize();
        assert!((pose.direction() - wanted).length() < 1e-12);
        let right = pose.orientation * DVec3::X;
        assert!(right.y.abs() < 1e-12 && (pose.orientation * DVec3::Y).y > 0.0);
        assert_eq!(pose.focal_distance, eye.distance(target));
        let down = CameraPose::looking_at(DVec3::Y, DVec3::ZERO, DVec3::Y, 0.6);
        assert!((down.direction() - DVec3::NEG_Y).length() < 1e-12);
    }

    #[test]
    fn a_view_through_a_lens_has_the_sphere_within_its_angle() {
        let pose = CameraPose::view_all_within((DVec3::splat(-1.0), DVec3::splat(1.0)), 0.9);
        assert!((pose.position.z * 0.9f64.sin() - 3f64.sqrt()).abs() < 1e-12);
    }

    #[test]
    fn an_ortho_viewpoint_looks_at_the_middle_of_its_rectangle() {
        let text = "#X3D V3.3 utf8\nPROFILE Full\nOrthoViewpoint { position 1 2 3 \
                    orientation 0 0 1 1.5707963 fieldOfView [-1 -1 5 3] }";
        let document = Document::read_headerless("a", text.into()).expect("reads");
        let node = document.node(document.roots[0]);
        let pose = CameraPose::from_node(node, DMat4::IDENTITY).expect("a camera");
        // A quarter turn takes the middle (2, 1) to (−1, 2).
        assert!(pose.position.distance(DVec3::new(0.0, 4.0, 3.0)) < 1e-6);
        assert_eq!(pose.projection, Projection::Orthographic { height: 4.0 });
    }

    /// Returns the pose of the only root of a scene.
    fn pose_of(text: &str, world_from_camera: DMat4) -> CameraPose {
        let document = Document::read_headerless("a", text.into()).expect("reads");
        let node = document.node(document.roots[0]);
        CameraPose::from_node(node, world_from_camera).expect("a camera")
    }

    #[test]
    fn an_ortho_viewpoint_shows_all_of_its_rectangle_in_a_picture_of_any_shape() {
        let text = "#X3D V3.3 utf8\nPROFILE Full\nOrthoViewpoint { fieldOfView [-4 -1 4 1] }";
        let pose = pose_of(text, DMat4::IDENTITY);
        // The width of 8 and the height of 2 are the least that is seen (ISO 19775-1, 23.4.5).
        for (aspect, half) in [(4.0, [4.0, 1.0]), (2.0, [4.0, 2.0]), (8.0, [8.0, 1.0])] {
            let own = pose.view_extent(aspect);
            assert_eq!(own.half.to_array(), half);
            assert_eq!(pose.clone().fitted(aspect).view_extent(aspect), own);
        }
    }

    #[test]
    fn the_view_of_an_inventor_camera_is_scaled_with_the_space_around_it() {
        let twice = DMat4::from_scale(DVec3::splat(2.0));
        let text = "#Inventor V2.1 ascii\nOrthographicCamera { position 0 0 5 height 4 \
                    nearDistance 1 farDistance 20 focalDistance 3 }";
        let pose = pose_of(text, twice);
        assert_eq!(pose.projection, Projection::Orthographic { height: 8.0 });
        let distances = [pose.position.z, pose.near, pose.far, pose.focal_distance];
        assert_eq!(distances, [10.0, 2.0, 40.0, 6.0]);
        let text = "#Inventor V2.1 ascii\nPerspectiveCamera { heightAngle 1 }";
        let usual = Projection::Perspective { height_angle: 1.0 };
        assert_eq!(pose_of(text, twice).projection, usual);
        // At twice the distance a thing of the same height has half the tangent.
        let deep = pose_of(text, DMat4::from_scale(DVec3::new(1.0, 1.0, 2.0)));
        let tangent = 2.0 * deep.view_extent(1.0).half.y;
        assert!((tangent - 0.5f64.tan()).abs() < 1e-12, "{tangent}");
    }

    #[test]
    fn a_reflection_turns_a_camera_and_does_not_mirror_its_picture() {
        let text =
            "#Inventor V2.1 ascii\nPerspectiveCamera { position 0 0 8 orientation 0 1 0 .5 }";
        let usual = pose_of(text, DMat4::IDENTITY);
        for scale in [
            [-1, 1, 1],
            [1, -1, 1],
            [1, 1, -1],
            [-1, -1, -1],
            [-1, -1, 1],
        ] {
            let scale = DVec3::from(scale.map(f64::from));
            let pose = pose_of(text, DMat4::from_scale(scale));
            assert_eq!(pose.position, scale * usual.position);
            assert!(pose.direction().distance(scale * usual.direction()) < 1e-12);
            let top = pose.orientation * DVec3::Y;
            assert!(top.distance(scale * DVec3::Y) < 1e-12, "{scale}: {top}");
        }
    }

    #[test]
    fn a_reflection_moves_the_middle_of_a_frustum_to_the_other_side() {
        let text = "#Inventor V2.1 ascii\nFrustumCamera { left 0 right 1 top 1 bottom 0 }";
        let [usual, mirrored] = [1.0, -1.0].map(|x| {
            let pose = pose_of(text, DMat4::from_scale(DVec3::new(x, 1.0, 1.0)));
            pose.orientation * pose.center.extend(-1.0)
        });
        assert!(usual.x > 0.0);
        assert!(mirrored.distance(usual * DVec3::new(-1.0, 1.0, 1.0)) < 1e-12);
    }

    /// Twice as deep, the near plane is at 2 and its sides are where they were.
    #[test]
    fn the_middle_of_a_frustum_is_scaled_as_its_height_is() {
        let text = "#Inventor V2.1 ascii\nFrustumCamera { nearDistance 1 \
                    left 0 right 1 top .5 bottom -.5 }";
        let deep = pose_of(text, DMat4::from_scale(DVec3::new(1.0, 1.0, 2.0)));
        assert!(deep.center.distance(DVec2::new(0.25, 0.0)) < 1e-12);
        assert!((deep.view_extent(1.0).half.y - 0.25).abs() < 1e-12);
    }

    #[test]
    fn the_corners_of_a_frustum_camera_are_seen_in_the_corners_of_its_picture() {
        let text = "#Inventor V2.1 ascii\nFrustumCamera { position 0 0 5 nearDistance 2 \
                    left -.4 right 1.2 top .6 bottom -.2 viewportMapping LEAVE_ALONE }";
        let pose = pose_of(text, DMat4::IDENTITY);
        for (place, corner) in [
            ([0.0, 0.0], [-0.4, 0.6]),
            ([1.0, 0.0], [1.2, 0.6]),
            ([1.0, 1.0], [1.2, -0.2]),
        ] {
            let [place, corner] = [place, corner].map(DVec2::from_array);
            let ray = pose.ray(place, 3.0);
            let at = ray.at(2.0 / -ray.direction.z);
            assert!(at.distance(corner.extend(3.0)) < 1e-6, "{at}");
            let again = pose.place_of_point(at, 3.0).expect("in front");
            assert!(again.distance(place) < 1e-6, "{again}");
        }
    }
}
