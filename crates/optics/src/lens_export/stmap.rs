//! ST maps: for every pixel of a picture, where in another picture its light is.
//!
//! A place (s, t) runs from 0 to 1 over the other picture, s from the left and t from the bottom,
//! and pixels are at their centers, as in Nuke. The undistorted picture is that of a pinhole with
//! the scale of the lens near the axis. It has more pixels than the lens's own where distortion
//! would otherwise cut it off.

use glam::DVec2;
use indexmap::IndexMap;
use ivcam_base::diag::{Diagnostic, Result};

use crate::film::Response;
use crate::lens_export::frame::MAX_PIXELS;
use crate::lens_export::odd_curve::OddCurve;
use crate::lens_export::view::View;
use crate::picture::Picture;

/// The number of nodes of the tables, between which the error is below 1e-6 pixels.
const NODES: usize = 512;
/// The greatest width of the undistorted picture over that of the lens's own.
const MAX_OVERSCAN: f64 = 4.0;

/// Two maps with their pictures.
pub struct StMaps {
    /// For every pixel of the undistorted picture, its place in the lens's own.
    pub undistort: Picture,
    /// For every pixel of the lens's own picture, its place in the undistorted one.
    pub distort: Picture,
}

impl StMaps {
    /// The maps of a picture.
    ///
    /// # Errors
    ///
    /// Returns an error if the undistorted picture would be more than four times as wide or high,
    /// or would have more than 64 Mi pixels.
    pub fn of(view: &View<'_>) -> Result<Self> {
        let (undistorted, distorted) = curves(view).ok_or_else(|| too_wide(view))?;
        let plate = view.frame.size();
        let canvas = canvas(plate, &undistorted);
        if !(canvas.max_element().is_finite() && (canvas / plate).max_element() <= MAX_OVERSCAN) {
            return Err(too_wide(view));
        }
        if canvas.x * canvas.y > MAX_PIXELS as f64 {
            return Err(too_many_pixels(view, canvas));
        }
        let conditions = view.conditions().join("; ");
        let map = |what: &str, from: DVec2, to: DVec2, curve: &OddCurve| {
            let mut provenance = IndexMap::new();
            provenance.insert("ivcam:map".to_owned(), what.to_owned());
            provenance.insert("ivcam:conditions".to_owned(), conditions.clone());
            let sizes = [from, to].map(|size| format!("{} x {}", size.x, size.y));
            provenance.insert("ivcam:from".to_owned(), sizes[0].clone());
            provenance.insert("ivcam:to".to_owned(), sizes[1].clone());
            Picture {
                width: from.x as u32,
                height: from.y as u32,
                pixels: places(from, to, curve),
                response: Response::Linear,
                provenance,
            }
        };
        Ok(Self {
            undistort: map("undistort", canvas, plate, &distorted),
            distort: map("distort", plate, canvas, &undistorted),
        })
    }
}

/// The radius in the undistorted picture over that in the lens's own, and the reverse, in pixels;
/// none if a chief ray is 85 degrees or more from the axis.
fn curves(view: &View<'_>) -> Option<(OddCurve, OddCurve)> {
    if view.half_field().to_degrees() >= 85.0 {
        return None;
    }
    let density = view.frame.density();
    let reach = view.rays.reach * density;
    let small = 1e-4 * view.rays.reach;
    let focal = small * density / libm::tan(view.rays.angle(small));
    let ideal = |r: f64| focal * libm::tan(view.rays.angle(r / density));
    let undistorted = OddCurve::of(reach, NODES, |r| Some(ideal(r)))?;
    let inverse = |u: f64| Some(view.rays.radius(libm::atan(u / focal))? * density);
    let distorted = OddCurve::of(ideal(reach), NODES, inverse)?;
    Some((undistorted, distorted))
}

/// The least picture with the pixels of `plate` in its middle that contains its undistorted edges.
fn canvas(plate: DVec2, undistorted: &OddCurve) -> DVec2 {
    const STEPS: u32 = 200;
    let half = 0.5 * plate;
    let mut widest = half;
    for i in 0..=STEPS {
        let share = f64::from(i) / f64::from(STEPS);
        for edge in [
            DVec2::new(half.x, share * half.y),
            DVec2::new(share * half.x, half.y),
        ] {
            let r = edge.length();
            widest = widest.max(edge * (undistorted.beyond(r) / r));
        }
    }
    plate + 2.0 * (widest - half - 1e-6).ceil().max(DVec2::ZERO)
}

/// The places in a picture of size `to` for every pixel of one of size `from`.
fn places(from: DVec2, to: DVec2, curve: &OddCurve) -> Vec<[f32; 3]> {
    let (width, height) = (from.x as usize, from.y as usize);
    let place = |k: usize| {
        let pixel = DVec2::new((k % width) as f64, (k / width) as f64) + 0.5;
        let off = pixel - 0.5 * from;
        let r = off.length();
        let ratio = if r > 0.0 { curve.beyond(r) / r } else { 1.0 };
        let at = (0.5 * to + ratio * off) / to;
        [at.x as f32, (1.0 - at.y) as f32, 0.0]
    };
    (0..width * height).map(place).collect()
}

fn too_wide(view: &View<'_>) -> Box<Diagnostic> {
    Diagnostic::error(format!(
        "the picture of `{}` reaches {:.1} degrees from the axis, and without distortion it would \
         be more than {MAX_OVERSCAN} times as large",
        view.lens.name(),
        view.half_field().to_degrees()
    ))
    .with_help("take a smaller --film, or `--export opencv --model fisheye`")
}

fn too_many_pixels(view: &View<'_>, canvas: DVec2) -> Box<Diagnostic> {
    Diagnostic::error(format!(
        "the undistorted picture of `{}` would have {} x {} pixels",
        view.lens.name(),
        canvas.x,
        canvas.y
    ))
    .with_help(format!(
        "the limit is {} million pixels; take a smaller --size",
        MAX_PIXELS >> 20
    ))
}
