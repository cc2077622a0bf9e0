//! The picture that a scene is compiled for, as shapes with a size in pixels know it.

use std::sync::Arc;

use crate::geometry::text::Fonts;
use crate::pose::CameraPose;
use crate::scene::options::CompileOptions;
use crate::scene::pixel_footprint::Screen;

#[derive(Clone, Debug)]
pub(crate) struct PictureView {
    pub camera: Option<CameraPose>,
    /// Its height in pixels, at least 1.
    pub rows: u32,
    /// The user's own typefaces.
    pub fonts: Arc<Fonts>,
}

impl PictureView {
    pub(crate) fn of(options: &CompileOptions) -> Self {
        Self {
            camera: options.camera.clone(),
            rows: options.pixel_rows.max(1),
            fonts: options.fonts.clone(),
        }
    }

    /// The picture with its camera; `None` where nobody looks.
    pub(crate) fn screen(&self) -> Option<Screen<'_>> {
        let rows = f64::from(self.rows);
        let camera = self.camera.as_ref()?;
        Some(Screen { camera, rows })
    }
}
