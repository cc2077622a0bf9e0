//! The choices of model `i`, which computes with light, and of what is added to a scene to light
//! it.

use std::path::PathBuf;

use glam::{DVec3, Vec3};
use ivcam_base::math::Meters;
use ivcam_render::scene::{ColorCoding, Studio};
use ivcam_render::shade::ClearSky;

/// The light of the surroundings, in place of the file's ambient light.
#[derive(Clone, Debug, PartialEq)]
pub enum Surroundings {
    /// The file's `Background`.
    Background,
    /// An equirectangular picture.
    Picture(PathBuf),
    /// A clear sky with the sun.
    Sky(ClearSky),
}

/// The paper below and behind a scene.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Backdrop {
    /// No paper.
    None,
    /// Paper of a color, as on a display.
    Color(Vec3),
}

/// The white of paper, as on a display: it reflects 75% of the light.
pub(crate) const WHITE_PAPER: Vec3 = Vec3::splat(0.881);
/// The gray of a photographer's card, which reflects 18%.
pub(crate) const GRAY_PAPER: Vec3 = Vec3::splat(0.461);

/// The choices of model `i`. Other models have none of them.
#[derive(Clone, Debug, PartialEq)]
pub struct LightPlan {
    /// What the numbers of the file's colors mean. Default: levels of a display.
    pub colors: ColorCoding,
    /// A factor of emissive colors. Default: 1.
    pub emission: f32,
    /// The diameter of point and spot lights. Default: 0.
    pub light_size: Meters,
    /// The angle across directional lights, in radians. Default: 0.
    pub sun_size: f64,
    /// The light of the surroundings. Default: the file's ambient light.
    pub surroundings: Option<Surroundings>,
    /// The largest radiance of one path's indirect light. Default: no limit.
    pub clamp: Option<f32>,
    /// Whether lamps are added, and paper unless `backdrop` is another. Default: no.
    pub studio: bool,
    /// Whether a flat ground is added, if there is no paper. Default: no.
    pub ground: bool,
    /// The paper. Default: white with `studio`, or else none.
    pub backdrop: Option<Backdrop>,
}

impl LightPlan {
    /// Returns what is added to a scene in a box; nothing if it has none.
    pub(crate) fn studio(&self, bounds: impl FnOnce() -> Option<(DVec3, DVec3)>) -> Option<Studio> {
        let color = match self.backdrop {
            Some(Backdrop::Color(color)) => Some(color),
            Some(Backdrop::None) => None,
            None => self.studio.then_some(WHITE_PAPER),
        };
        let has_backdrop = color.is_some();
        let color = color.or(self.ground.then_some(WHITE_PAPER));
        if !self.studio && color.is_none() {
            return None;
        }
        Some(Studio {
            bounds: bounds()?,
            ground: color.map(|color| color.map(|level| self.colors.light_of(level))),
            has_backdrop,
            has_lamps: self.studio,
        })
    }

    /// Whether the plan itself lights the scene.
    pub(crate) fn shines(&self) -> bool {
        self.studio || self.surroundings.is_some()
    }
}

impl Default for LightPlan {
    fn default() -> Self {
        Self {
            colors: ColorCoding::Display,
            emission: 1.0,
            light_size: Meters(0.0),
            sun_size: 0.0,
            surroundings: None,
            clamp: None,
            studio: false,
            ground: false,
            backdrop: None,
        }
    }
}
