//! Recognizes a picture that is almost entirely black or clipped, and finds the likely cause.
//!
//! The causes come from the counts of the render, from the plan, and from a grid of rays that are
//! traced after the render and only for such a picture. The picture itself does not change.

use glam::Vec3;
use ivcam_base::diag::Diagnostic;
use ivcam_inventor::pose::Projection;
use ivcam_optics::film::Metering;
use ivcam_optics::picture::Picture;
use ivcam_render::render::Counts;
use ivcam_render::shade::{Shading, Work};

use super::plan::Era;
use super::session::{Session, is_left_dark};
use super::view::rays_over;

/// The highest level of a dark pixel, of 255. On most screens such a pixel looks black beside a
/// white window; chosen by eye.
const DARK: f64 = 24.0 / 255.0;
/// The share of pixels that may be brighter in a picture that is almost entirely black. A thin line
/// across the picture of 1999 covers more (one row of 240).
const BRIGHT_SHARE: f64 = 1e-3;
/// The linear exposure from which a pixel counts as clipped. A white background is 1.
const CLIPPED: f32 = 1.1;
/// The share of clipped pixels from which a picture is almost entirely clipped. It decides about a
/// warning only. No search is recorded: a smaller value warns of pictures with a white background,
/// and a larger one is silent if a few details are darker.
const CLIPPED_SHARE: f64 = 0.95;
/// The luminance in cd/m² of a white wall in a lit room (docs/guide/exposure.md).
const LAMPLIT_WHITE: f64 = 100.0;
/// The rays across and down that look for the cause.
const GRID: (u32, u32) = (36, 24);
/// Points of the lens that are tried in turn for a ray that represents a place of the picture.
const PUPIL_POINTS: [[f64; 2]; 3] = [[0.5, 0.5], [0.3, 0.5], [0.7, 0.5]];

/// The help for a camera that sees nothing useful.
const OTHER_CAMERA: &str =
    "`--view SIDE` shows the whole scene from another side, `--camera FILE` takes another camera";
/// The transparency from which a surface leaves no more than a dark pixel's light of its own.
const CLEAR: f32 = 1.0 - DARK as f32;

/// What the grid of rays found.
struct Probe {
    /// Rays that got through the lens.
    rays: usize,
    /// Rays that hit a surface.
    hits: usize,
    /// Rays that hit nothing but back faces that are not drawn.
    culled: usize,
    /// Hits on the back of a surface.
    backs: usize,
    /// Hits on a surface that is nearly or wholly transparent.
    clear: usize,
    /// Hits that are bright in the picture's shading, apart from light that the lens loses.
    bright: usize,
    /// Whether a surface would be bright without shadows.
    bright_without_shadows: bool,
    /// Whether a surface has a color that is not nearly black.
    has_color: bool,
}

impl Session {
    /// Returns a warning if rays were cut, or if the picture is almost entirely black or clipped.
    /// It names the likely cause and what to do next.
    pub fn warn_if_black_or_clipped(
        &self,
        counts: &Counts,
        picture: &Picture,
    ) -> Option<Box<Diagnostic>> {
        if let Some(warning) = self.scene.warn_of_cut_rays() {
            return Some(warning);
        }
        if counts.film_rays > 0 && counts.passed == 0 {
            let none = Diagnostic::warning("no ray reached the scene: the picture is black");
            let help = "the film may be too large for the lens, or the lens closed";
            return Some(none.with_help(help));
        }
        let count = picture.pixels.len().max(1) as f64;
        let clipped = |pixel: &&[f32; 3]| pixel.iter().all(|x| *x > CLIPPED);
        if picture.pixels.iter().filter(clipped).count() as f64 >= CLIPPED_SHARE * count {
            let middle = brightness(picture, 0.5);
            let cause = "the picture is almost entirely clipped: its exposure is too long";
            let change = self.exposed_by(0.5 / f64::from(middle));
            let lamplight = self.lamplight_if_it_shows(f64::from(middle));
            let help = format!("{lamplight}{change} brings the middle of its range to half");
            return Some(Diagnostic::warning(cause).with_help(help));
        }
        let is_bright = |pixel: &&[f32; 3]| {
            let levels = picture.response.levels(pixel.map(f64::from));
            levels.iter().any(|level| *level > DARK)
        };
        // Further bright pixels change nothing.
        let enough = (BRIGHT_SHARE * count) as usize + 1;
        let pixels = picture.pixels.iter();
        let bright = pixels.filter(is_bright).take(enough).count();
        if bright as f64 > BRIGHT_SHARE * count {
            return None;
        }
        let (cause, help) = self.cause_of_darkness(picture)?;
        let black = match bright {
            0 => "black",
            _ => "almost entirely black",
        };
        let message = format!("the picture is {black}: {cause}");
        Some(Diagnostic::warning(message).with_help(help))
    }

    /// Returns a line for the user if half of the picture is dark and the scene has luminous shapes
    /// that light nothing in its shading model.
    pub fn glow_notice(&self, picture: &Picture) -> Option<String> {
        let shading = self.plan.shading;
        let may_shine = shading != Shading::Path && shading.needs().lights;
        let is_dark = || f64::from(brightness(picture, 0.5)) <= DARK;
        (may_shine && self.scene.has_lamps(1.0) && is_dark()).then(|| {
            format!(
                "light: the scene's luminous shapes light nothing by model {}; --shading path lets \
                 them shine",
                shading.name()
            )
        })
    }

    /// Returns the likely cause of a dark picture and what to do next, or `None` if opening the
    /// session already warned about it.
    fn cause_of_darkness(&self, picture: &Picture) -> Option<(String, String)> {
        let because = |cause: &str, help: &str| Some((cause.to_owned(), help.to_owned()));
        let (triangles, quadrics, strokes) = self.scene.primitives();
        if triangles + quadrics + strokes == 0 {
            let help = format!(
                "`ivcam check {}` lists its nodes",
                self.plan.scene.display()
            );
            return because("the scene has nothing to see", &help);
        }
        let brightest = brightness(picture, 1.0 - BRIGHT_SHARE);
        let factor = self.exposure_factor();
        let brighter = self.exposed_by(0.8 / f64::from(brightest));
        let exposure = format!("{brighter} makes its brightest part nearly white");
        if factor < 1.0 && f64::from(brightest) / factor > DARK {
            return because("its exposure is too short", &exposure);
        }
        let probe = self.probe();
        if probe.hits == 0 && probe.culled > 0 {
            let cause = "the camera sees only the backs of solid shapes, which are not drawn";
            return because(cause, OTHER_CAMERA);
        }
        if probe.hits == 0 {
            return because(self.empty_view(), OTHER_CAMERA);
        }
        // A lens loses light where it is focused nearby.
        if 100 * probe.bright > probe.rays && brightest > 0.0 {
            return because("little light comes through the lens", &exposure);
        }
        let headlight = match self.plan.era {
            Era::Vintage => "`-headlight on`",
            Era::Modern => "`--headlight=on`",
        };
        let needs = self.plan.shading.needs();
        if needs.lights && self.headlight.is_none() && !self.scene.has_lights() {
            if self.plan.shading == Shading::Path && brightest > 0.0 {
                return because(
                    "its only light, of shapes or surroundings, is dim",
                    &exposure,
                );
            }
            if is_left_dark(self.headlight_sources, self.headlight_state()) {
                return None;
            }
            let help = format!("{headlight} turns the light on the camera on");
            return because("no light is on", &help);
        }
        if 100 * probe.hits < probe.rays {
            let cause = "less than 1% of it shows the scene";
            let help = "a longer `--efl` or a camera that is nearer shows it larger";
            return because(cause, help);
        }
        if 10 * probe.clear > 9 * probe.hits {
            let cause = "the surfaces in view are transparent, and nothing is behind them";
            let help = "`--background white` puts something there, `-s n` shows their shapes";
            return because(cause, help);
        }
        if 10 * probe.backs > 9 * probe.hits {
            let cause = "the camera sees only the back of surfaces, as from inside a closed shape";
            return because(cause, OTHER_CAMERA);
        }
        if probe.bright_without_shadows {
            let cause = "everything in view is in shadow";
            let help = format!("{headlight} adds a light on the camera, `-s p` draws no shadows");
            return because(cause, &help);
        }
        if needs.lights && self.headlight.is_none() {
            let cause = "the scene's lights do not reach what the camera sees";
            let help = format!("{headlight} adds a light on the camera");
            return because(cause, &help);
        }
        if needs.lights && probe.has_color {
            let cause = "the surfaces in view face away from the light";
            let help = "`-s f` draws their colors without light";
            return because(cause, help);
        }
        let help = match brightest > 0.0 {
            true => format!("{brighter} makes the brightest part nearly white"),
            false => "`-s n` shows their shapes without light and materials".to_owned(),
        };
        because("the surfaces in view are black or nearly so", &help)
    }

    /// Returns the option that multiplies the exposure by a factor, in the terms in which it was
    /// chosen.
    fn exposed_by(&self, factor: f64) -> String {
        let Some(metering) = &self.plan.metering else {
            return format!("`--exposure {}`", rounded(self.stated_exposure() * factor));
        };
        let iso = rounded(metering.iso * factor);
        let seconds = metering.shutter * factor;
        match seconds < 0.5 {
            true => format!("`--shutter 1/{}` or `--iso {iso}`", rounded(1.0 / seconds)),
            false => format!("`--shutter {}s` or `--iso {iso}`", rounded(seconds)),
        }
    }

    /// Returns the part of a help that names the luminance of white in a lit room, if the picture
    /// is exposed for the sun and its middle would be between a tenth of white and white in a room.
    fn lamplight_if_it_shows(&self, middle: f64) -> &'static str {
        let is_sunlit = |metering: &&Metering| metering.white == Metering::SUNLIT_WHITE;
        let Some(metering) = self.plan.metering.as_ref().filter(is_sunlit) else {
            return "";
        };
        match (0.1..=1.0).contains(&(middle * LAMPLIT_WHITE / metering.white)) {
            true => "white is in full sun: `--white 100` exposes for a lit room; or ",
            false => "",
        }
    }

    /// Says why a camera sees nothing of a scene that has shapes.
    fn empty_view(&self) -> &'static str {
        let Some((min, max)) = self.scene.bounds() else {
            return "the camera sees nothing of the scene";
        };
        let eye = (self.pose.position - self.scene.origin).as_vec3();
        let forward = self.pose.direction().as_vec3();
        // The corner of the box that is farthest in the direction of the view.
        let far = Vec3::select(forward.cmpgt(Vec3::ZERO), max, min);
        if (far - eye).dot(forward) < 0.0 {
            "the whole scene is behind the camera"
        } else if is_ahead(eye, forward, [min, max]) && self.is_tiny(eye, [min, max]) {
            "the scene is smaller than a pixel in it"
        } else if is_ahead(eye, forward, [min, max]) {
            "what is in front of the camera is too small or too thin to see, as a plane that is \
             seen edge-on"
        } else if eye.clamp(min, max) == eye {
            "the camera is inside the scene and looks to where nothing is"
        } else {
            "the camera looks past the scene"
        }
    }

    /// Returns whether a box at its distance from the eye is smaller than a pixel.
    fn is_tiny(&self, eye: Vec3, [min, max]: [Vec3; 2]) -> bool {
        let Projection::Perspective { height_angle } = self.projection else {
            return false;
        };
        let pixel = height_angle / f64::from(self.plan.resolution.height);
        let distance = eye.distance(eye.clamp(min, max));
        f64::from((max - min).length()) < pixel * f64::from(distance)
    }

    /// Traces a grid of rays over the picture.
    fn probe(&self) -> Probe {
        let mut probe = Probe {
            rays: 0,
            hits: 0,
            culled: 0,
            backs: 0,
            clear: 0,
            bright: 0,
            bright_without_shadows: false,
            has_color: false,
        };
        let [own, lit, colored] =
            [self.plan.shading, Shading::Phong, Shading::Flat].map(|s| self.shader_of(s));
        let exposure = self.exposure_factor() as f32;
        let mut work = Work::default();
        for ray in rays_over(&self.camera, GRID, &PUPIL_POINTS) {
            probe.rays += 1;
            let Some(hit) = self.scene.hit(&ray) else {
                probe.culled += usize::from(self.scene.hit_any_side(&ray).is_some());
                continue;
            };
            probe.hits += 1;
            let surface = self.scene.surface(&hit);
            probe.backs += usize::from(!self.scene.is_front(&ray, &hit, surface));
            probe.clear += usize::from(surface.transparency.iter().all(|t| *t >= CLEAR));
            let radiance = own.radiance_of(&ray, Some(hit), &mut work).max_element();
            probe.bright += usize::from(f64::from(exposure * radiance) > DARK);
            if self.plan.shading == Shading::Recursive {
                let radiance = lit.radiance_of(&ray, Some(hit), &mut work).max_element();
                probe.bright_without_shadows |= f64::from(exposure * radiance) > DARK;
            }
            if self.plan.shading.needs().materials {
                let color = colored
                    .radiance_of(&ray, Some(hit), &mut work)
                    .max_element();
                probe.has_color |= f64::from(color) > DARK;
            }
        }
        probe
    }
}

/// Returns whether a ray from `eye` meets a box that it starts outside of.
fn is_ahead(eye: Vec3, forward: Vec3, [min, max]: [Vec3; 2]) -> bool {
    let margin = 1e-4 * (max - min).length();
    let (min, max) = (min - margin, max + margin);
    // A component of 0 divides to infinity, or to NaN inside a slab; `min` and `max` skip NaN.
    let (a, b) = ((min - eye) / forward, (max - eye) / forward);
    let (enter, leave) = (a.min(b).max_element(), a.max(b).min_element());
    enter > 0.0 && enter <= leave
}

/// Returns the brightness that a share of the pixels does not exceed: the largest linear exposure
/// of a pixel's channels.
fn brightness(picture: &Picture, share: f64) -> f32 {
    let largest = |pixel: &[f32; 3]| pixel.iter().copied().fold(0.0, f32::max);
    let mut all: Vec<f32> = picture.pixels.iter().map(largest).collect();
    let last = all.len().saturating_sub(1);
    let index = (share * last as f64).round() as usize;
    if index >= all.len() {
        return 0.0;
    }
    *all.select_nth_unstable_by(index, f32::total_cmp).1
}

/// Rounds a factor to two digits.
pub(super) fn rounded(factor: f64) -> f64 {
    format!("{factor:.1e}").parse().unwrap_or(factor)
}
