//! The options of compiling a scene.

use std::path::PathBuf;
use std::sync::Arc;

use glam::{DVec3, Vec3};
use ivcam_base::memory::MemoryLimit;
use ivcam_inventor::iv::Limits;
use ivcam_inventor::pose::CameraPose;
use ivcam_inventor::traversal::WalkOptions;

use super::studio::Studio;
use crate::geometry::text::Fonts;

/// How a texture is filtered, which depends on the `textureQuality` of `Complexity`. The limits are
/// Coin's.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum TextureFilter {
    /// The nearest texel, for a quality below 0.2.
    Nearest,
    /// Bilinear interpolation, for a quality below 0.5.
    Linear,
    /// Trilinear interpolation between smaller versions (mipmaps), if a pixel covers several
    /// texels.
    Smooth,
}

impl TextureFilter {
    /// The filters with their names.
    pub const NAMED: [(&'static str, Self); 3] = [
        ("nearest", Self::Nearest),
        ("linear", Self::Linear),
        ("smooth", Self::Smooth),
    ];

    /// The filter for a texture quality.
    pub(crate) fn of(quality: f32) -> Self {
        match quality {
            q if q < 0.2 => Self::Nearest,
            q if q < 0.5 => Self::Linear,
            _ => Self::Smooth,
        }
    }
}

/// The parts of a scene that a shading model uses. Others are not compiled.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Needs {
    /// Normals of corners.
    pub normals: bool,
    /// Materials.
    pub materials: bool,
    /// Lights.
    pub lights: bool,
    /// Textures.
    pub textures: bool,
    /// What only reflected, refracted and shadow rays hit.
    pub secondary: bool,
    /// Triangles instead of exact round shapes, because the corners are lit.
    pub facets: bool,
}

impl Needs {
    /// All parts, with exact round shapes.
    pub const ALL: Self = Self {
        normals: true,
        materials: true,
        lights: true,
        textures: true,
        secondary: true,
        facets: false,
    };
}

/// When repeated parts of a scene are stored once, as prototypes with instances.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[non_exhaustive]
pub enum Instancing {
    /// If it pays: if the expanded scene is so large that it should not be made, or has long texts.
    WhereItPays,
    /// Always, also small parts. Tests compare such a scene with the expanded one.
    Everywhere,
}

/// What the numbers of a file's colors mean.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Hash)]
#[non_exhaustive]
pub enum ColorCoding {
    /// Numbers that are computed with as they are, as OpenGL does. What a file states as light
    /// becomes levels of a display.
    #[default]
    Levels,
    /// Amounts of light.
    Linear,
    /// Levels of a display, which are decoded by the sRGB curve. Intensities of lights are amounts
    /// of light.
    Display,
}

impl ColorCoding {
    /// The coding of an element's colors. `is_linear` says that the file states them as light, as
    /// glTF and X3D's `PhysicalMaterial` do; the traversal has encoded these for a display.
    pub(in crate::scene) fn for_element(self, is_linear: bool) -> Self {
        match self {
            Self::Linear if is_linear => Self::Display,
            other => other,
        }
    }
}

/// The options of compiling and surveying a scene.
#[derive(Clone, Debug)]
pub struct CompileOptions {
    /// The point of world space that becomes the origin, in meters. For pictures it is the camera.
    /// Default: zero.
    pub origin: DVec3,
    /// The camera that levels of detail, billboards, sizes in pixels and the cuts of NURBS depend
    /// on. Default: none.
    pub camera: Option<CameraPose>,
    /// The parts of the scene to compile. Default: all.
    pub needs: Needs,
    /// The height of the picture in pixels, for lines, points and NURBS. Default: 240.
    pub pixel_rows: u32,
    /// The limits of the scene, of which `visits` and `primitives` bound compiling; what exceeds
    /// them is left out. Default: [`Limits::default`].
    pub limits: Limits,
    /// The memory in bytes that the compiled scene may use; what does not fit is left out. Default:
    /// half of what the machine has.
    pub memory: u64,
    /// When to store repeated parts once. Default: where it pays.
    pub instancing: Instancing,
    /// A color for the background, and whether it replaces the scene's `Background`. Default: none,
    /// a scene without that node is black behind.
    pub background: Option<(Vec3, bool)>,
    /// Whether faces that are culled as seen from a light cast shadows all the same. Default: no, a
    /// light passes what it does not see. The 1999 program: yes (a guess).
    pub culled_faces_cast_shadows: bool,
    /// What the numbers of colors mean: those of materials, lights, fog, textures and backgrounds.
    /// Default: levels, as for all models but `path`.
    pub colors: ColorCoding,
    /// What is added to light and surround the scene. Default: nothing.
    pub studio: Option<Studio>,
    /// Whether to ignore `DrawStyle`, so that hidden shapes and shapes in lines are compiled like
    /// all others. Default: no.
    pub ignore_draw_style: bool,
    /// How textures are filtered. Default: by the `textureQuality` of `Complexity`; a
    /// `PixelTexture` of at most 8×8 texels is not interpolated (decision 31).
    pub texture_filter: Option<TextureFilter>,
    /// Whether shapes without textures have texture coordinates too. Default: no.
    pub coordinates: bool,
    /// Whether lights that light no shape are kept, because they shine on the lens. Default: no.
    pub idle_lights: bool,
    /// Whether surfaces are named, for mattes. Default: no.
    pub names: bool,
    /// The folders besides the scene's own in which textures are searched. Default: none.
    pub texture_folders: Vec<PathBuf>,
    /// The user's fonts, which are searched before the shipped typefaces. Default: none.
    pub fonts: Arc<Fonts>,
}

impl Default for CompileOptions {
    fn default() -> Self {
        Self {
            origin: DVec3::ZERO,
            camera: None,
            needs: Needs::ALL,
            pixel_rows: 240,
            limits: Limits::default(),
            memory: MemoryLimit::default().bytes(),
            instancing: Instancing::WhereItPays,
            background: None,
            culled_faces_cast_shadows: false,
            colors: ColorCoding::default(),
            studio: None,
            ignore_draw_style: false,
            texture_filter: None,
            coordinates: false,
            idle_lights: false,
            names: false,
            texture_folders: Vec::new(),
            fonts: Arc::default(),
        }
    }
}

impl CompileOptions {
    /// Returns the options of a walk within the limits, with the levels of detail that the camera
    /// sees.
    pub(super) fn walk(&self) -> WalkOptions {
        WalkOptions {
            camera: self.camera.clone(),
            ..WalkOptions::within(&self.limits)
        }
    }
}
