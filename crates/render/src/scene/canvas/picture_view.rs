//! The picture that a scene is compiled for, for shapes with a size in pixels.

use std::sync::Arc;

use ivcam_inventor::pose::CameraPose;

use crate::geometry::text::Fonts;
use crate::scene::options::CompileOptions;
use crate::scene::pixel_footprint::Screen;

/// The camera and the size of the picture, and the fonts for its text.
#[derive(Clone, Debug)]
pub(crate) struct PictureView {
    /// The camera, if there is one.
    pub camera: Option<CameraPose>,
    /// The height of the picture in pixels, at least 1.
    pub rows: u32,
    /// The user's fonts.
    pub fonts: Arc<Fonts>,
}

impl PictureView {
    /// The picture of the compile options.
    pub(crate) fn of(options: &CompileOptions) -> Self {
        Self {
            camera: options.camera.clone(),
            rows: options.pixel_rows.max(1),
            fonts: options.fonts.clone(),
        }
    }

    /// The picture with its camera, or `None` without a camera.
    pub(crate) fn screen(&self) -> Option<Screen<'_>> {
        let rows = f64::from(self.rows);
        let camera = self.camera.as_ref()?;
        Some(Screen { camera, rows })
    }
}
