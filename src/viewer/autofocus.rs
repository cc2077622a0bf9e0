//! Autofocus through the lens: the distance of the visible surface, corrected by contrast.
//!
//! The search starts at the distance of the surface that the middle ray hits. The lens is focused a
//! few pixels of blur nearer and farther, and the contrast of a small patch of the rendered picture
//! determines the best distance. It differs from the first one if the field is curved, or an edge
//! is beside the cursor.

use ivcam_optics::sampling::FilterTable;
use ivcam_render::render::{Render, Stop};
use ivcam_render::shade::Work;
use rayon::prelude::*;

use super::live::Live;
use super::sharpness::Blur;
use crate::photo::{Optics, Session};

/// The side of the patch in pixels.
const PATCH: u32 = 20;
/// Samples per pixel in each of the two independent halves.
const SAMPLES: u32 = 8;
/// The blur of the trials in pixels; negative is in front.
const TRIALS: [f64; 7] = [-4.0, -2.5, -1.2, 0.0, 1.2, 2.5, 4.0];
/// The ratio of contrasts above which the trial replaces the surface's distance. No search is
/// recorded: a smaller value lets the noise of the contrast move the focus, and a larger one keeps
/// the surface's distance where a neighboring one is a little sharper. A wrong trial is at most 4
/// pixels of blur away.
const BETTER: f64 = 1.05;

/// The result of autofocus.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Focused {
    /// The focus distance in meters.
    pub distance: f64,
    /// The distance of the visible surface in meters, before the comparison of contrasts.
    pub plain: f64,
    /// The best contrast over that at the surface's distance; `None` without contrast.
    pub gain: Option<f64>,
}

/// Focuses on a place of the picture (x and y from 0 to 1); returns `None` if there is no surface.
pub(crate) fn focus_at(live: &mut Live, x: f64, y: f64) -> Option<Focused> {
    let plain = live.view().look(x, y)?.distance;
    if !(plain > 0.0) {
        return None;
    }
    let nothing_to_check = Focused {
        distance: plain,
        plain,
        gain: None,
    };
    let Optics::Lens(_) = live.session().plan.optics else {
        return Some(nothing_to_check);
    };
    let Some(blur) = live.with_focus(plain, blur_of).flatten() else {
        return Some(nothing_to_check);
    };
    let plan = &live.session().plan;
    let pitch = plan.film.width / f64::from(plan.resolution.width);
    let mut best = Focused {
        distance: plain,
        plain,
        gain: None,
    };
    let at_plain = live.with_focus(plain, |s| contrast(s, x, y)).unwrap_or(0.0);
    if !(at_plain > 0.0) {
        return Some(best);
    }
    let mut most = BETTER * at_plain;
    for trial in TRIALS.into_iter().filter(|t| *t != 0.0) {
        let distance = blur.beside(plain, trial * pitch);
        let here = live
            .with_focus(distance, |s| contrast(s, x, y))
            .unwrap_or(0.0);
        if here > most {
            (most, best.distance) = (here, distance);
        }
    }
    best.gain = Some(if best.distance == plain {
        1.0
    } else {
        most / at_plain
    });
    Some(best)
}

fn blur_of(session: &Session) -> Option<Blur> {
    match &session.camera {
        ivcam_render::camera::Camera::Lens(camera) => Blur::of(&camera.lens, camera.focus.film_z),
        _ => None,
    }
}

/// Returns the energy of the differences between neighbors around a place. It is a product of two
/// independent halves of the samples, so noise does not bias it.
fn contrast(session: &Session, x: f64, y: f64) -> f64 {
    let size = session.plan.resolution;
    let corner = |t: f64, n: u32| {
        let middle = (t * f64::from(n)) as i64 - i64::from(PATCH / 2);
        middle.clamp(0, i64::from(n.saturating_sub(PATCH))) as u32
    };
    let (x0, y0) = (corner(x, size.width), corner(y, size.height));
    let (columns, rows) = (PATCH.min(size.width), PATCH.min(size.height));
    let render = Render {
        shader: &session.shader(),
        camera: &session.camera,
        sampler: session.plan.pixel_sampler(),
        resolution: size,
        exposure: 1.0,
        stop: Stop::after(2 * SAMPLES),
        filter: &FilterTable::new(session.plan.filter),
        adaptive: false,
        team: None,
        lamps: None,
    };
    let half = |at: (u32, u32), from: u32, work: &mut Work| -> f64 {
        (from..from + SAMPLES)
            .map(|i| render.sample(at, i, work).element_sum())
            .sum()
    };
    let pixel = |i: u32| {
        let (at, mut work) = ((x0 + i % columns, y0 + i / columns), Work::default());
        [half(at, 0, &mut work), half(at, SAMPLES, &mut work)]
    };
    let levels: Vec<[f64; 2]> = (0..columns * rows).into_par_iter().map(pixel).collect();
    let step = |i: usize, j: usize| (levels[i][0] - levels[j][0]) * (levels[i][1] - levels[j][1]);
    let columns = columns as usize;
    (0..levels.len())
        .map(|i| {
            let right = if (i + 1) % columns != 0 {
                step(i, i + 1)
            } else {
                0.0
            };
            let below = if i + columns < levels.len() {
                step(i, i + columns)
            } else {
                0.0
            };
            right + below
        })
        .sum()
}
