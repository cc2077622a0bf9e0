//! What a picture of a scene leaves out, because the scene has nothing that needs it.

use ivcam_inventor::traversal::state::FogKind;

use super::render_scene::RenderScene;

/// The classes that draw text, for which fonts are read.
const TEXTS: [&str; 4] = ["AsciiText", "Text", "Text2", "Text3"];

/// Work that a scene does not need. Doing it does not change the picture.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[non_exhaustive]
pub enum Unneeded {
    /// The search for the other shapes behind the one that stops a shadow ray.
    Transparency,
    /// The test whether each hit is clipped or on a culled face.
    Visibility,
    /// Computing fog, textures and highlights for each point by itself.
    Points,
}

impl RenderScene {
    /// Lists what the rays do not need because of what the scene lacks, and parts of the file that
    /// the picture does not depend on, each with the reason, as in `12 shapes (not reached)`.
    pub fn left_out(&self) -> Vec<String> {
        let mut out = self.census.left_out();
        let mut leave = |is_left: bool, what: &str, why: &str| {
            if is_left {
                out.push(format!("{what} ({why})"));
            }
        };
        let census = &self.census;
        let textures = census.textures + census.textures_left_out;
        leave(textures == 0, "textures", "none");
        leave(!self.has_fog(), "fog", "none");
        let text = TEXTS.iter().any(|class| census.drawn.contains_key(class));
        leave(!text, "fonts", "no text");
        leave(
            !self.special,
            "visibility of hits",
            "nothing clipped or culled",
        );
        let idle = census.lights_seen - census.lights.min(census.lights_seen);
        leave(
            idle > 0 && self.idle_lights.is_none(),
            &format!("{idle} lights"),
            "light no shape",
        );
        let shapes = census.shapes_unreached;
        leave(shapes > 0, &format!("{shapes} shapes"), "not reached");
        out
    }

    /// Returns the largest fraction of light that any surface would reflect as a mirror.
    pub fn largest_mirror(&self) -> f32 {
        let shares = self.surfaces.iter().map(|s| s.mirror().max_element());
        shares.fold(0.0, f32::max)
    }

    /// Whether light passes through any surface.
    pub fn is_transparent(&self) -> bool {
        self.census.transparent
    }

    fn has_fog(&self) -> bool {
        let mut surfaces = self.surfaces.iter();
        surfaces.any(|s| s.environment.fog != FogKind::None)
    }

    /// Makes every ray do work that the scene does not need.
    pub fn force(&mut self, unneeded: Unneeded) {
        match unneeded {
            Unneeded::Transparency => self.solid = false,
            Unneeded::Visibility => self.special = true,
            Unneeded::Points => {
                for surface in &mut self.surfaces {
                    if surface.environment.fog == FogKind::None {
                        surface.environment.fog = FogKind::Haze;
                        surface.environment.visibility = f32::MAX;
                    }
                }
            }
        }
    }
}
