//! Develops exposures for the screen: levels, the histogram, and marks for clipping, focus peaking
//! and the focus plane.

use ivcam_optics::film::Response;
use rayon::prelude::*;

use super::live::LiveFrame;
use super::model::Marks;
use super::view::{DepthMap, FocalSurface};

/// The number of bins of the histogram.
pub(crate) const BINS: usize = 64;

/// The distribution of the levels of a picture.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct Histogram {
    /// Red, green and blue, relative to the fullest bin between the ends.
    pub bins: [[f32; BINS]; 3],
    /// The share of pixels with a channel at its largest level.
    pub clipped: f32,
    /// The share of pixels that are black in all channels.
    pub black: f32,
}

/// Returns a frame's levels, 8 bits of red, green and blue, as in the saved picture.
pub(crate) fn levels(frame: &LiveFrame, exposure: f64, response: &Response) -> Vec<u8> {
    let exposure = exposure * frame.metered;
    let level = |level: f64| (255.0 * level).round() as u8;
    let mut levels = vec![0; 3 * frame.pixels.len()];
    // A thousand pixels at a time are worth a task.
    let tasks = levels
        .par_chunks_mut(3000)
        .zip(frame.pixels.par_chunks(1000));
    tasks.for_each(|(levels, pixels)| {
        for (levels, pixel) in levels.chunks_exact_mut(3).zip(pixels) {
            let exposed = pixel.map(|x| f64::from(x) * exposure);
            levels.copy_from_slice(&response.levels(exposed).map(level));
        }
    });
    levels
}

/// Counts the levels of a picture.
pub(crate) fn histogram(levels: &[u8]) -> Histogram {
    let mut counts = [[0u32; BINS]; 3];
    let (mut clipped, mut black) = (0u32, 0u32);
    let pixels = levels.chunks_exact(3);
    let all = pixels.len().max(1) as f32;
    for pixel in pixels {
        clipped += u32::from(pixel.contains(&255));
        black += u32::from(pixel.iter().all(|l| *l == 0));
        for (channel, level) in counts.iter_mut().zip(pixel) {
            channel[usize::from(*level) * BINS / 256] += 1;
        }
    }
    let inner = counts.iter().flat_map(|c| &c[1..BINS - 1]);
    let most = inner.copied().max().unwrap_or(1).max(1) as f32;
    Histogram {
        bins: counts.map(|c| c.map(|n| (n as f32 / most).min(1.0))),
        clipped: clipped as f32 / all,
        black: black as f32 / all,
    }
}

/// The data that marks need besides the picture.
pub(crate) struct Marking<'a> {
    pub marks: Marks,
    pub depths: Option<&'a DepthMap>,
    pub surface: Option<&'a FocalSurface>,
    /// The focus distance in meters.
    pub focus: f64,
}

const PLANE: [f32; 3] = [70.0, 150.0, 255.0];
const FOCUS: [u8; 3] = [255, 64, 40];

/// Draws the marks into levels. Stripes depend on the position on the picture, not on its
/// resolution.
pub(crate) fn mark(levels: &mut [u8], size: [usize; 2], marking: &Marking<'_>) {
    if marking.marks.peaking {
        peak(levels, size);
    }
    if marking.marks.clipping {
        stripe(levels, size);
    }
    if marking.marks.plane {
        tint(levels, size, marking);
    }
}

/// Tints the pixels behind the focus plane.
fn tint(levels: &mut [u8], [width, height]: [usize; 2], marking: &Marking<'_>) {
    let Some(depths) = marking.depths else { return };
    for (i, pixel) in levels.chunks_exact_mut(3).enumerate() {
        let x = ((i % width) as f64 + 0.5) / width as f64;
        let y = ((i / width) as f64 + 0.5) / height as f64;
        let sharp = match marking.surface.filter(|_| marking.marks.curved) {
            Some(surface) => surface.at(x, y),
            None => marking.focus,
        };
        if depths.at(x, y) > sharp {
            for (level, color) in pixel.iter_mut().zip(PLANE) {
                *level = (0.72 * f32::from(*level) + 0.28 * color) as u8;
            }
        }
    }
}

/// Draws stripes over pixels that are clipped (red on white) or black (blue).
fn stripe(levels: &mut [u8], [width, height]: [usize; 2]) {
    let period = (width.max(height) / 60).max(4);
    for (i, pixel) in levels.chunks_exact_mut(3).enumerate() {
        let on = (i % width + i / width) % period < period / 2;
        if pixel.contains(&255) && on {
            pixel.copy_from_slice(&[255, 0, 60]);
        } else if pixel.iter().all(|l| *l == 0) && on {
            pixel.copy_from_slice(&[0, 40, 160]);
        }
    }
}

/// Marks edges of the greatest possible steepness, like the focus peaking of a camera.
fn peak(levels: &mut [u8], [width, height]: [usize; 2]) {
    let gray: Vec<i32> = levels
        .chunks_exact(3)
        .map(|p| (2 * i32::from(p[0]) + 5 * i32::from(p[1]) + i32::from(p[2])) / 8)
        .collect();
    let at = |x: usize, y: usize| gray[y * width + x];
    for y in 2..height.saturating_sub(2) {
        for x in 2..width.saturating_sub(2) {
            // The second difference over one pixel exceeds that over two only at a sharp edge.
            let fine =
                (4 * at(x, y) - at(x - 1, y) - at(x + 1, y) - at(x, y - 1) - at(x, y + 1)).abs();
            let step = (at(x + 1, y) - at(x - 1, y))
                .abs()
                .max((at(x, y + 1) - at(x, y - 1)).abs());
            if fine > 36 && step > 28 {
                levels[3 * (y * width + x)..][..3].copy_from_slice(&FOCUS);
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_histogram_counts_levels_and_its_ends() {
        let levels = [0, 0, 0, 255, 10, 10, 128, 128, 128, 128, 128, 128];
        let histogram = histogram(&levels);
        assert_eq!(histogram.bins[1][32], 1.0);
        assert_eq!((histogram.clipped, histogram.black), (0.25, 0.25));
    }

    #[test]
    fn only_what_is_behind_the_plane_is_tinted() {
        let depths = DepthMap {
            width: 2,
            height: 1,
            meters: vec![1.0, 3.0],
        };
        let marking = Marking {
            marks: Marks {
                plane: true,
                ..Marks::default()
            },
            depths: Some(&depths),
            surface: None,
            focus: 2.0,
        };
        let mut levels = [100u8; 6];
        mark(&mut levels, [2, 1], &marking);
        assert_eq!(levels[..3], [100; 3]);
        assert!(levels[5] > 100 && levels[3] < 100);
    }

    #[test]
    fn a_sharp_edge_is_marked_and_a_soft_one_is_not() {
        let picture = |soft: usize| -> Vec<u8> {
            (0..16 * 16)
                .flat_map(|i| {
                    let x = (i % 16) as f64;
                    let t = ((x - 7.5) / soft as f64 + 0.5).clamp(0.0, 1.0);
                    [(200.0 * t) as u8; 3]
                })
                .collect()
        };
        let marked = |soft| {
            let mut levels = picture(soft);
            peak(&mut levels, [16, 16]);
            levels.chunks(3).filter(|p| **p == FOCUS).count()
        };
        assert!(marked(1) >= 12);
        assert_eq!(marked(10), 0);
    }
}
