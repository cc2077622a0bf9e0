//! A picture of a lens: its focus and aperture, its film and its pixels.

use glam::DVec2;
use ivcam_base::diag::Result;

use crate::lens::{Conjugate, Lens};
use crate::lens_export::chief_rays::ChiefRays;
use crate::lens_export::frame::Frame;

/// The steps from the middle of a picture to its edges at which models are compared with rays.
const STEPS: usize = 64;
/// The wavelengths in nanometers that stand for the red, green and blue channel of a camera: about
/// the middles of their sensitivities in daylight.
pub(super) const CHANNELS: [f64; 3] = [610.0, 540.0, 465.0];

/// A lens, focused and stopped down, with the film and the pixels of its picture.
#[derive(Clone, Debug)]
pub struct View<'a> {
    /// The lens.
    pub lens: &'a Lens,
    /// The object plane and the position of the film.
    pub conjugate: Conjugate,
    /// The film and its pixels.
    pub frame: Frame,
    /// The chief rays of its film points.
    pub(crate) rays: ChiefRays,
}

/// A point of the picture: where it is, and the angle from which its light comes.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Sample {
    /// The distance from the picture's middle, in pixels.
    pub radius: f64,
    /// The angle of the chief ray to the axis, in radians.
    pub angle: f64,
}

impl<'a> View<'a> {
    /// Traces the chief rays of a picture.
    ///
    /// # Errors
    ///
    /// Returns the errors of `ChiefRays::of`.
    pub fn of(lens: &'a Lens, conjugate: Conjugate, frame: Frame) -> Result<Self> {
        let rays = ChiefRays::of(lens, conjugate, frame.corner())?;
        Ok(Self {
            lens,
            conjugate,
            frame,
            rays,
        })
    }

    /// Points on a regular grid over a quarter of the picture, without its dark part. The others
    /// follow by symmetry.
    pub(crate) fn samples(&self) -> Vec<Sample> {
        let corner = 0.5 * self.frame.size();
        let mut samples = Vec::new();
        for j in 0..=STEPS {
            for i in 0..=STEPS {
                let share = DVec2::new(i as f64, j as f64) / STEPS as f64;
                let radius = (share * corner).length();
                let on_film = radius / self.frame.density();
                if on_film <= self.rays.reach * (1.0 + 1e-12) {
                    let angle = self.rays.angle(on_film);
                    samples.push(Sample { radius, angle });
                }
            }
        }
        samples
    }

    /// The distance from the picture's middle at which its light ends, in pixels; none if the
    /// corners are lit.
    pub(crate) fn dark_from(&self) -> Option<f64> {
        let is_dark = self.rays.reach < self.frame.corner() * (1.0 - 1e-9);
        is_dark.then(|| self.rays.reach * self.frame.density())
    }

    /// The greatest angle of the picture to the axis, in radians.
    pub(crate) fn half_field(&self) -> f64 {
        self.rays.angle(self.rays.reach)
    }

    /// The conditions in words, for the comments of a file. None contains a line break.
    pub(crate) fn conditions(&self) -> Vec<String> {
        let Self { lens, frame, .. } = self;
        let focus = match self.conjugate.distance.is_finite() {
            true => format!(
                "{} m from the front vertex",
                self.conjugate.distance / 1000.0
            ),
            false => "infinity".to_owned(),
        };
        let aperture = lens
            .real_f_number()
            .map_or("unknown".into(), |n| format!("f/{n:.4}"));
        let mut lines = vec![
            format!("lens {}, aperture {aperture}, focus {focus}", lens.name()),
            format!(
                "film {:.4} x {:.4} mm at {:.6} mm from the front vertex, {} x {} pixels",
                frame.film.x, frame.film.y, self.conjugate.film_z, frame.width, frame.height
            ),
            format!(
                "center of projection: the entrance pupil, {:.6} mm behind the front vertex",
                self.rays.origin_z
            ),
            format!(
                "half field {:.4} degrees, wavelength {} nm",
                self.half_field().to_degrees(),
                lens.wavelength()
            ),
            "scene upright: x right, y down, z forward; (0, 0) is the center of the first pixel"
                .to_owned(),
        ];
        if let Some(radius) = self.dark_from() {
            lines.push(format!(
                "the picture is dark beyond {radius:.1} pixels from its middle"
            ));
        }
        lines.iter().map(|line| on_one_line(line)).collect()
    }
}

/// A name as an identifier: letters, digits and underscores.
pub(super) fn identifier(name: &str) -> String {
    let word = |c: char| if c.is_ascii_alphanumeric() { c } else { '_' };
    name.chars().map(word).collect()
}

/// A text with a space for every control character and line break.
fn on_one_line(text: &str) -> String {
    let is_break = |c: char| c.is_control() || matches!(c, '\u{2028}' | '\u{2029}');
    text.replace(is_break, " ")
}
