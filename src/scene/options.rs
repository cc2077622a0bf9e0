//! What a scene is compiled for.

use std::path::PathBuf;
use std::sync::Arc;

use glam::DVec3;

use crate::geometry::text::Fonts;
use crate::iv::Limits;
use crate::pose::CameraPose;

/// What a picture needs of a scene; a lookup from the shading, not a branch.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Needs {
    pub normals: bool,
    pub materials: bool,
    pub lights: bool,
    pub textures: bool,
    pub secondary: bool,
    /// Round shapes are cut into triangles, whose corners can be lit.
    pub facets: bool,
}

impl Needs {
    /// Everything about the exact shapes.
    pub const ALL: Self = Self {
        normals: true,
        materials: true,
        lights: true,
        textures: true,
        secondary: true,
        facets: false,
    };
}

#[derive(Clone, Debug)]
pub struct CompileOptions {
    /// The point of the world that becomes the origin. Default: zero; for pictures the camera.
    pub origin: DVec3,
    /// What levels of detail, billboards and pixel widths go by. Default: none.
    pub camera: Option<CameraPose>,
    /// Default: everything.
    pub(crate) needs: Needs,
    /// Height of the picture in pixels, for lines and points. Default: 240.
    pub pixel_rows: u32,
    /// Primitives kept before the rest is left out. Default: 16 million, below 3 GB.
    pub max_primitives: usize,
    /// Nodes met before the rest is left out. Default: 300,000, or twice the
    /// document's nodes if that is more.
    pub max_visits: u64,
    /// Compiles what `DrawStyle` hides or shows as lines like everything else. Default: no.
    pub ignore_draw_style: bool,
    /// Folders besides the scene's own in which textures are looked for. Default: none.
    pub texture_folders: Vec<PathBuf>,
    /// Typefaces to draw text with before the shipped ones. Default: none.
    pub(crate) fonts: Arc<Fonts>,
}

impl Default for CompileOptions {
    fn default() -> Self {
        Self {
            origin: DVec3::ZERO,
            camera: None,
            needs: Needs::ALL,
            pixel_rows: 240,
            max_primitives: Limits::default().primitives,
            max_visits: Limits::default().visits as u64,
            ignore_draw_style: false,
            texture_folders: Vec::new(),
            fonts: Arc::default(),
        }
    }
}
