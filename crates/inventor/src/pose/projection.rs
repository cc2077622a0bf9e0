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

impl Projection {
    /// Returns the projection in a space that is scaled upward and along the view.
    #[must_use]
    pub(super) fn scaled(self, up: f64, back: f64) -> Self {
        let ratio = up / back;
        match self {
            Self::Perspective { height_angle } if (ratio - 1.0).abs() > 1e-5 => {
                let half = ratio * libm::tan(0.5 * height_angle);
                Self::Perspective {
                    height_angle: 2.0 * libm::atan(half),
                }
            }
            Self::Perspective { .. } => self,
            Self::Orthographic { height } => Self::Orthographic {
                height: up * height,
            },
        }
    }
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
    /// The camera's view is extended on two sides to the aspect ratio of the picture. No value of
    /// Inventor's field says so: it is the mapping of X3D's `OrthoViewpoint`.
    ExtendView,
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
