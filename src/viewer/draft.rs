//! The pinhole preview of the 1999 program: a camera with the height angle of the paper's equations
//! 6 and 7.
//!
//! θ = 2 atan(h/z), where z is from the rear principal plane to the film. The angle is correct from
//! the front principal plane, but the 1999 camera was at the front of the lens: "a slight error in
//! the preview, which becomes increasingly noticeable as the camera is moved very close". Both
//! previews are provided for comparison; neither has blur, distortion or vignetting.

use glam::{DVec2, DVec3};
use ivcam_inventor::pose::{CameraPose, Projection, ViewportMapping};
use ivcam_render::camera::{Camera, LensCamera, Pinhole};

/// The camera that the window shows the picture of.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Preview {
    /// The picture itself, through the lens.
    #[default]
    Lens,
    /// A pinhole at the front of the lens, as in 1999.
    Draft1999,
    /// A pinhole at the front principal plane, from where the angle is correct.
    Draft,
}

impl Preview {
    /// The previews with their names and descriptions in the window.
    pub(crate) const ALL: [(Self, &'static str, &'static str); 3] = [
        (Self::Lens, "Lens", "the picture itself, through the lens"),
        (
            Self::Draft1999,
            "Draft 1999",
            "a pinhole with the height angle of equations 6 and 7 at the front of the lens, as in 1999",
        ),
        (
            Self::Draft,
            "Draft",
            "the same pinhole at the front principal plane, where the angle is correct",
        ),
    ];
}

/// Returns the height angle of equation 7 for a focused lens on its film, in radians.
pub(crate) fn height_angle(camera: &LensCamera) -> f64 {
    camera.focus.height_angle(0.5 * camera.format.height)
}

/// Returns the pinhole's pose: the lens camera's, moved to the principal plane for
/// [`Preview::Draft`].
pub(crate) fn pose(camera: &LensCamera, pose: &CameraPose, preview: Preview) -> CameraPose {
    let plane = camera
        .lens
        .first_order()
        .focal
        .map_or(0.0, |f| f.front_principal_plane);
    let back = if preview == Preview::Draft {
        plane / 1000.0
    } else {
        0.0
    };
    CameraPose {
        position: pose.position + back * (pose.orientation * DVec3::Z),
        projection: Projection::Perspective {
            height_angle: height_angle(camera),
        },
        center: DVec2::ZERO,
        aspect_ratio: camera.format.width / camera.format.height,
        viewport_mapping: ViewportMapping::LeaveAlone,
        ..pose.clone()
    }
}

/// Returns the camera of a preview, for a scene compiled around `origin`.
pub(crate) fn camera(
    camera: &Camera,
    stands: &CameraPose,
    origin: DVec3,
    preview: Preview,
) -> Camera {
    match (camera, preview) {
        (Camera::Lens(lens), Preview::Draft1999 | Preview::Draft) => {
            let pose = pose(lens, stands, preview);
            Camera::Pinhole(Pinhole::new(&pose, pose.aspect_ratio)).posed(&pose, origin)
        }
        _ => camera.clone(),
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use ivcam_base::math::meters;
    use ivcam_optics::film::FilmFormat;
    use ivcam_optics::lens::{FocusMethod, Lens};
    use ivcam_render::camera::Aim;

    /// The chief ray of a stopped-down lens crosses the plane in focus at height H = h (Z/z) of
    /// equation 6, measured from the principal plane.
    #[test]
    fn the_corrected_draft_sees_what_the_lens_sees_in_the_plane_of_focus() {
        let near = 0.6;
        let lens = Lens::named("telephoto").unwrap().at_f_number(32.0).unwrap();
        let focus = lens.focus(FocusMethod::Film, meters(near)).unwrap();
        let stands = CameraPose::view_all(Default::default(), 1.5);
        let real = LensCamera::new(lens, focus, FilmFormat::STANDARD, Aim::ExitPupil, &stands);
        let real = Camera::Lens(Box::new(real));
        let height = |camera: &Camera| {
            let ray = camera.at(0.5, 0.25).ray([0.5, 0.5]).unwrap();
            let t = (-near - ray.origin.z) / ray.direction.z;
            (ray.origin + t * ray.direction).y
        };
        let origin = stands.position;
        let draft = |preview| height(&camera(&real, &stands, origin, preview));
        let truth = height(&real);
        let (old, new) = (
            draft(Preview::Draft1999) / truth - 1.0,
            draft(Preview::Draft) / truth - 1.0,
        );
        assert!(new.abs() < 0.01, "{new}");
        assert!(old.abs() > 5.0 * new.abs(), "{old} {new}");
    }
}
