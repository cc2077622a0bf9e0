//! Finds the photograph in a scan that shows paper, a mat or a scanner's bed around it.
//!
//! The border is what resembles the outermost pixels; its light may change linearly across the
//! scan. The photograph is the rectangle that holds the most pixels unlike the border and the
//! fewest like it, so that captions and stamps beside it, which are mostly paper, are left out. A
//! border within a border, such as paper on a black bed, is found by repeating this.

use glam::DVec2;
use ivcam_base::math::symmetric::solve;
use serde::Serialize;

use crate::plane::{Plane, Plate};
use crate::warp::reduced;

/// The longer side of the reduced scan in which rectangles are searched, in pixels.
const SMALL: f64 = 128.0;
/// The number of borders within each other that are searched for.
const NESTED: usize = 3;
/// The share of the outermost pixels that have to resemble each other for them to be a border: a
/// photograph that touches one side of the scan leaves three quarters.
const ALIKE: f64 = 0.65;
/// The smallest and largest difference of levels that distinguishes a pixel from the border; grain
/// and uneven light decide between them.
const DIFFERENT: [f64; 2] = [0.04, 0.12];
/// The share of a side's pixels that may be border where the photograph begins: a turned
/// photograph has a wedge of paper along each side.
const WEDGE: f64 = 0.05;
/// The largest part of a side that is cut off for such a wedge.
const MOST_CUT: f64 = 0.08;
/// The smallest part of the scan that a photograph may cover.
const LEAST_AREA: f64 = 0.1;
/// The shortest side of a photograph, in pixels.
const LEAST_SIDE: usize = 16;

/// A rectangle of pixels of a picture.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize)]
pub struct PhotographFrame {
    /// Columns to its left.
    pub left: usize,
    /// Rows above it.
    pub top: usize,
    /// Pixels across.
    pub width: usize,
    /// Pixels down.
    pub height: usize,
}

impl PhotographFrame {
    /// Returns the rectangle of a whole picture.
    pub(super) fn whole(picture: &Plate) -> Self {
        Self {
            left: 0,
            top: 0,
            width: picture.width,
            height: picture.height,
        }
    }

    /// Returns the rectangle's pixels.
    pub(super) fn cut(self, plane: &Plane) -> Plane {
        Plane::from_fn(self.width, self.height, |x, y| {
            plane.at(self.left + x, self.top + y)
        })
    }

    /// Returns the rectangle's center, in pixels from the picture's upper left corner.
    pub(super) fn center(self) -> DVec2 {
        let corner = DVec2::new(self.left as f64, self.top as f64);
        corner + 0.5 * DVec2::new(self.width as f64, self.height as f64)
    }
}

/// Returns the whole scan, then what lies within its border, within that one's border, and so on.
pub(super) fn frames(scan: &Plate) -> Vec<PhotographFrame> {
    let mut found = vec![PhotographFrame::whole(scan)];
    let mut inside = scan.clone();
    while found.len() <= NESTED
        && let Some(within) = within_border(&inside)
    {
        let last = found[found.len() - 1];
        inside = inside.map(|p| within.cut(p));
        found.push(PhotographFrame {
            left: last.left + within.left,
            top: last.top + within.top,
            ..within
        });
    }
    found
}

/// Returns the rectangle within the border of a picture; none if it has no border.
fn within_border(picture: &Plate) -> Option<PhotographFrame> {
    let ratio = (picture.channels[0].longer_side() / SMALL).max(1.0);
    let small = picture.map(|p| reduced(p, ratio));
    let (width, height) = (small.width, small.height);
    if width.min(height) < 8 {
        return None;
    }
    let differs = unlike_border(&small)?;
    let is_unlike = |x: usize, y: usize| differs[y * width + x];
    let [left, top, right, bottom] = trimmed(best_rectangle(&differs, width)?, &is_unlike);
    // The outermost pixels of a reduced photograph are mixed with its border.
    let edge = |at: usize, inward: f64| (at as f64 * ratio + inward * (ratio + 1.0)).round();
    let low = |at: usize| if at == 0 { 0.0 } else { edge(at, 1.0) };
    let high = |at: usize, small: usize, all: usize| match at == small {
        true => all as f64,
        false => edge(at, -1.0).min(all as f64),
    };
    let (x, y) = (low(left), low(top));
    let wide = high(right, width, picture.width) - x;
    let tall = high(bottom, height, picture.height) - y;
    let area = picture.width as f64 * picture.height as f64;
    let is_smaller = wide < picture.width as f64 || tall < picture.height as f64;
    let is_enough = wide.min(tall) >= LEAST_SIDE as f64 && wide * tall >= LEAST_AREA * area;
    (is_smaller && is_enough).then_some(PhotographFrame {
        left: x as usize,
        top: y as usize,
        width: wide as usize,
        height: tall as usize,
    })
}

/// Returns for each pixel whether it differs from the border; none if the outermost pixels do not
/// resemble each other.
fn unlike_border(small: &Plate) -> Option<Vec<bool>> {
    let (width, height) = (small.width, small.height);
    let is_outer = |i: usize| {
        let (x, y) = (i % width, i / width);
        x == 0 || y == 0 || x + 1 == width || y + 1 == height
    };
    let ring: Vec<usize> = (0..width * height).filter(|i| is_outer(*i)).collect();
    let papers = [0, 1, 2].map(|c| PaperLight::of(&small.channels[c], &ring));
    let off = |i: usize| -> f64 {
        let offs = [0, 1, 2].map(|c| papers[c].off(&small.channels[c], i));
        offs.into_iter().fold(0.0, f64::max)
    };
    let mut offs: Vec<f64> = ring.iter().map(|i| off(*i)).collect();
    offs.sort_by(f64::total_cmp);
    let [least, most] = DIFFERENT;
    let limit = (6.0 * offs[offs.len() / 2]).clamp(least, most);
    let alike = offs.partition_point(|o| *o <= limit) as f64;
    (alike >= ALIKE * ring.len() as f64)
        .then(|| (0..width * height).map(|i| off(i) > limit).collect())
}

/// The level of the border in one channel: at the center, and its slopes.
struct PaperLight([f64; 3]);

impl PaperLight {
    /// Fits the levels of the outermost pixels, and leaves out those that show something else.
    fn of(plane: &Plane, ring: &[usize]) -> Self {
        let mut levels: Vec<f64> = ring.iter().map(|i| f64::from(plane.values[*i])).collect();
        levels.sort_by(f64::total_cmp);
        let mut light = Self([levels[levels.len() / 2], 0.0, 0.0]);
        let mut limit = DIFFERENT[1];
        for _ in 0..4 {
            let mut matrix = [0.0; 9];
            let mut right = [0.0; 3];
            for &i in ring.iter().filter(|i| light.off(plane, **i) <= limit) {
                let row = Self::row(plane, i);
                for a in 0..3 {
                    for b in 0..3 {
                        matrix[3 * a + b] += row[a] * row[b];
                    }
                    right[a] += row[a] * f64::from(plane.values[i]);
                }
            }
            match solve(&matrix, &right, 0.0) {
                Some(found) => light = Self([found[0], found[1], found[2]]),
                None => break,
            }
            limit = (0.7 * limit).max(DIFFERENT[0]);
        }
        light
    }

    fn row(plane: &Plane, i: usize) -> [f64; 3] {
        let place = |i: usize, n: usize| (i as f64 + 0.5) / n as f64 - 0.5;
        [
            1.0,
            place(i % plane.width, plane.width),
            place(i / plane.width, plane.height),
        ]
    }

    /// Returns how far a pixel is from the border's level.
    fn off(&self, plane: &Plane, i: usize) -> f64 {
        let terms = Self::row(plane, i).into_iter().zip(self.0);
        let level: f64 = terms.map(|(a, b)| a * b).sum();
        (f64::from(plane.values[i]) - level).abs()
    }
}

/// Returns left, top, right and bottom of the rectangle with the largest number of pixels that are
/// unlike the border less those that are like it, from sums of columns (Kadane's algorithm over
/// every pair of rows).
fn best_rectangle(differs: &[bool], width: usize) -> Option<[usize; 4]> {
    let height = differs.len() / width;
    let mut best = (0, None);
    for top in 0..height {
        let mut columns = vec![0_i32; width];
        for bottom in top + 1..=height {
            let row = &differs[(bottom - 1) * width..bottom * width];
            for (sum, unlike) in columns.iter_mut().zip(row) {
                *sum += if *unlike { 1 } else { -1 };
            }
            let (mut sum, mut left) = (0, 0);
            for (x, column) in columns.iter().enumerate() {
                if sum <= 0 {
                    (sum, left) = (0, x);
                }
                sum += column;
                if sum > best.0 {
                    best = (sum, Some([left, top, x + 1, bottom]));
                }
            }
        }
    }
    best.1
}

/// Returns the rectangle with each side moved inward until it has little of the border.
fn trimmed(sides: [usize; 4], is_unlike: &dyn Fn(usize, usize) -> bool) -> [usize; 4] {
    let [mut left, mut top, mut right, mut bottom] = sides;
    let most = |low: usize, high: usize| (MOST_CUT * (high - low) as f64).ceil() as usize;
    let (across, down) = (most(left, right), most(top, bottom));
    let column = |x: usize, top: usize, bottom: usize| {
        let paper = (top..bottom).filter(|y| !is_unlike(x, *y)).count();
        paper as f64 > WEDGE * (bottom - top) as f64
    };
    let row = |y: usize, left: usize, right: usize| {
        let paper = (left..right).filter(|x| !is_unlike(*x, y)).count();
        paper as f64 > WEDGE * (right - left) as f64
    };
    for _ in 0..across {
        left += usize::from(right - left > 2 && column(left, top, bottom));
        right -= usize::from(right - left > 2 && column(right - 1, top, bottom));
    }
    for _ in 0..down {
        top += usize::from(bottom - top > 2 && row(top, left, right));
        bottom -= usize::from(bottom - top > 2 && row(bottom - 1, left, right));
    }
    [left, top, right, bottom]
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Returns a picture of 200×150 pixels: a photograph with detail in a rectangle of paper.
    fn scan(inner: [usize; 4], paper: impl Fn(usize, usize) -> f32 + Sync) -> Plate {
        let [left, top, right, bottom] = inner;
        let plane = Plane::from_fn(200, 150, |x, y| {
            if (left..right).contains(&x) && (top..bottom).contains(&y) {
                0.3 + 0.1 * (((x / 7 + y / 5) % 3) as f32)
            } else {
                paper(x, y)
            }
        });
        Plate::from_planes([plane.clone(), plane.clone(), plane])
    }

    /// Asserts that a rectangle lies within another, by at most six pixels on each side.
    #[track_caller]
    fn assert_within(found: PhotographFrame, [left, top, right, bottom]: [usize; 4]) {
        let far = [
            found.left.wrapping_sub(left),
            found.top.wrapping_sub(top),
            right.wrapping_sub(found.left + found.width),
            bottom.wrapping_sub(found.top + found.height),
        ];
        assert!(far.iter().all(|d| *d <= 6), "{found:?}: {far:?}");
    }

    #[test]
    fn unevenly_lit_paper_with_words_is_left_out() {
        let inner = [20, 12, 170, 110];
        let words = |x: usize, y: usize| (125..130).contains(&y) && x % 11 < 4;
        let paper = |x: usize, y: usize| match words(x, y) {
            true => 0.2,
            false => 0.85 + 0.0005 * x as f32,
        };
        let found = frames(&scan(inner, paper));
        assert_eq!(found.len(), 2, "{found:?}");
        assert_within(found[1], inner);
    }

    #[test]
    fn paper_on_a_black_bed_is_two_borders() {
        let inner = [40, 30, 150, 110];
        let on_paper = |x: usize, y: usize| (25..180).contains(&x) && (15..130).contains(&y);
        let found = frames(&scan(inner, |x, y| if on_paper(x, y) { 0.9 } else { 0.02 }));
        assert_eq!(found.len(), 3, "{found:?}");
        assert_within(found[2], inner);
    }

    #[test]
    fn a_photograph_without_a_border_is_whole() {
        let found = frames(&scan([0, 0, 200, 150], |_, _| 0.0));
        assert_eq!(found.len(), 1, "{found:?}");
    }
}
