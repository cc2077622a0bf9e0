//! How a camera maps directions to the picture.

use crate::grammar::camera;

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

impl ViewportMapping {
    /// Converts the field's value in files.
    pub(crate) fn of(value: i32) -> Self {
        match value {
            camera::VIEWPORT_MAPPING_CROP_VIEWPORT_FILL_FRAME => Self::CropViewportFillFrame,
            camera::VIEWPORT_MAPPING_CROP_VIEWPORT_LINE_FRAME => Self::CropViewportLineFrame,
            camera::VIEWPORT_MAPPING_CROP_VIEWPORT_NO_FRAME => Self::CropViewportNoFrame,
            camera::VIEWPORT_MAPPING_LEAVE_ALONE => Self::LeaveAlone,
            _ => Self::AdjustCamera,
        }
    }
}
