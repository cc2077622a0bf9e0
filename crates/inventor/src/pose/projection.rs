//! The mapping from directions to the picture.

use crate::grammar::camera;

/// The projection of a pinhole camera.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Projection {
    /// All rays start at the eye.
    Perspective {
        /// The angle from the bottom to the top of the view, in radians.
        height_angle: f64,
    },
    /// All rays are parallel.
    Orthographic {
        /// The height of the view, in meters.
        height: f64,
    },
}

/// What happens if the picture and the camera have different aspect ratios.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum ViewportMapping {
    /// The camera keeps its aspect ratio, and the rest of the picture is filled.
    CropViewportFillFrame,
    /// The camera keeps its aspect ratio, and a line is drawn around its view.
    CropViewportLineFrame,
    /// The camera keeps its aspect ratio, and the rest of the picture is empty.
    CropViewportNoFrame,
    /// The camera takes the aspect ratio of the picture. This is Inventor's default.
    #[default]
    AdjustCamera,
    /// The view is stretched to the picture.
    LeaveAlone,
}

impl ViewportMapping {
    /// Converts the value of the field `viewportMapping`.
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
