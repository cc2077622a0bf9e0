//! Lines and points with a width in pixels. In meters the width grows with the depth from the
//! camera, which is at the origin.
//!
//! A line is a ribbon. Its width is measured along the picture's rows or columns, whichever the
//! line crosses more steeply, and its ends are not extended. This is OpenGL's rule for lines
//! without antialiasing, so a picture through a pinhole shows the same pixels. A point is a square.

use glam::{DVec3, Vec2, Vec3};

/// An offset in pixels that breaks ties. The edges of a line along an axis through the picture's
/// center run exactly through pixel centers. With the offset the line covers the lower or the left
/// pixels whatever the rounding, and a point between pixels covers the upper and the right ones, as
/// in OpenGL. The offset is far larger than the rounding error of a pixel's position, and too small
/// to be visible.
const TIE_OFFSET: f64 = 1.0 / 256.0;

/// The directions of the picture, of length 1, and the size of its pixels.
#[derive(Clone, Copy, Debug, Default)]
pub(crate) struct StrokeView {
    /// The direction to the right in the picture.
    pub right: Vec3,
    /// The direction upward in the picture.
    pub up: Vec3,
    /// The direction in which the camera looks.
    pub forward: Vec3,
    /// The size of a pixel in meters at depth 0.
    pub fixed: f32,
    /// The growth of a pixel's size in meters for each meter of depth.
    pub per_depth: f32,
}

impl StrokeView {
    fn depth(&self, p: Vec3) -> f32 {
        p.dot(self.forward)
    }

    /// Returns a pixel's size in meters at a point.
    pub(crate) fn pixel(&self, p: Vec3) -> f32 {
        self.fixed + self.per_depth * self.depth(p)
    }

    /// Whether a line in the picture is closer to horizontal than to vertical.
    fn runs_across(&self, a: Vec3, b: Vec3) -> bool {
        let along = b - a;
        let from = if self.depth(a) > self.depth(b) { a } else { b };
        let slope = |axis: Vec3| {
            if self.per_depth > 0.0 {
                along.dot(axis) * self.depth(from) - from.dot(axis) * self.depth(along)
            } else {
                along.dot(axis)
            }
        };
        slope(self.right).abs() >= slope(self.up).abs()
    }
}

/// A ribbon between two points, or a square if the two points are equal.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Stroke {
    /// The first end.
    pub a: Vec3,
    /// The second end.
    pub b: Vec3,
    /// The direction of the width, of length 1.
    across: Vec3,
    /// The direction of the picture along which the line runs, of length 1.
    major: Vec3,
    /// Half the width in pixels.
    half: f32,
    /// The material indices at the ends, which are interpolated along the line.
    pub materials: [u32; 2],
    /// The normals for lighting at the ends. A zero normal faces the camera.
    pub normals: [Vec3; 2],
    /// The texture coordinates at the ends.
    pub coordinates: [Vec2; 2],
    /// The outward normal, of any length, of the face whose edge or vertex this is. It is zero for
    /// a line or a point that belongs to no face.
    pub face: Vec3,
    /// A pattern of 16 dashes and gaps, which begins with the lowest bit.
    pattern: u16,
    /// The length of each dash and gap in pixels.
    scale: f32,
    /// The number of pixels of the pattern that the preceding lines have used.
    start: f32,
    /// The part of the line that this is.
    piece: Piece,
}

/// One of `count` parts of equal length of a line, counted from the first end.
#[derive(Clone, Copy, Debug)]
struct Piece {
    /// The number of the part, from 0.
    index: u32,
    /// The number of parts.
    count: u32,
}

impl Piece {
    /// The whole line.
    const WHOLE: Self = Self { index: 0, count: 1 };

    /// Whether a position along the line, from 0 to 1, is in the piece. It is in one piece only.
    fn contains(self, forth: f64) -> bool {
        self.count == 1
            || (forth * f64::from(self.count)).min(f64::from(self.count - 1)) as u32 == self.index
    }
}

/// The largest number of pieces into which the lines of a scene are divided, unless there are more
/// lines. A piece takes about 250 bytes with its part of the tree.
const MOST_PIECES: usize = 1 << 20;
/// The largest mean number of pieces of a line.
const MEAN_PIECES: usize = 64;

/// Returns the number of pieces into which each line is to be divided.
///
/// The box of a line across a scene is as large as the scene, so a ray would have to test every
/// such line. A ray meets a box with a probability in proportion to its surface, and the surfaces
/// of the boxes of `n` pieces have the sum `A / n` if the line is thin and `A` is that of the whole
/// line. The sum over all lines is smallest for a given number of pieces if `n` is in proportion to
/// √A. The number is such that a ray is expected to meet one box, if the limits allow.
pub(crate) fn piece_counts(
    strokes: &[Stroke],
    view: &StrokeView,
    (min, max): (Vec3, Vec3),
) -> Vec<u32> {
    let half_surface = |size: Vec3| {
        let size = size.as_dvec3();
        size.x * size.y + size.y * size.z + size.z * size.x
    };
    let root = |stroke: &Stroke| half_surface((stroke.b - stroke.a).abs()).sqrt();
    let sum: f64 = strokes.iter().map(root).sum();
    let most = (MEAN_PIECES * strokes.len()).min(MOST_PIECES) as f64;
    let factor = (sum / half_surface(max - min)).min(most / sum);
    let count = |stroke: &Stroke| {
        // Pieces as short as the line is wide gain nothing.
        let width = f64::from(stroke.width(view)).max(f64::MIN_POSITIVE);
        let root = root(stroke);
        ((factor * root).min(root / width) as u32).clamp(1, 1 << 16)
    };
    strokes.iter().map(count).collect()
}

impl Stroke {
    /// Makes a stroke without a pattern. `width` is in pixels.
    pub(crate) fn new(ends: [Vec3; 2], width: f32, view: &StrokeView) -> Self {
        let [a, b] = ends;
        let (across, major) = if view.runs_across(a, b) {
            (view.up, view.right)
        } else {
            (view.right, view.up)
        };
        Self {
            a,
            b,
            across,
            major,
            half: 0.5 * width,
            materials: [0; 2],
            normals: [Vec3::ZERO; 2],
            coordinates: [Vec2::ZERO; 2],
            face: Vec3::ZERO,
            pattern: 0xffff,
            scale: 1.0,
            start: 0.0,
            piece: Piece::WHOLE,
        }
    }

    /// Returns the line's parts of equal length. A ray that hits the line hits one of them, at the
    /// same place.
    pub(crate) fn divided(self, count: u32) -> impl Iterator<Item = Self> {
        (0..count).map(move |index| Self {
            piece: Piece { index, count },
            ..self
        })
    }

    /// Sets the pattern, the number of pixels for each of its bits, and the number of pixels that
    /// are already used.
    pub(crate) fn with_pattern(self, pattern: u16, scale: u16, start: f32) -> Self {
        Self {
            pattern,
            scale: f32::from(scale.max(1)),
            start,
            ..self
        }
    }

    /// Whether the pattern has gaps.
    pub(crate) fn has_gaps(&self) -> bool {
        self.pattern != 0xffff
    }

    /// Returns the number of pixels of the pattern that are used after this line. A line uses an
    /// integer number of pixels, as in OpenGL.
    pub(crate) fn pattern_end(&self, view: &StrokeView) -> f32 {
        self.start + self.pixels(view).ceil()
    }

    /// Returns the line's length in pixels along the picture's axis.
    pub(crate) fn pixels(&self, view: &StrokeView) -> f32 {
        self.pixels_to(self.b, view)
    }

    /// Returns the number of pixels along the picture's axis from the first end to a point.
    fn pixels_to(&self, p: Vec3, view: &StrokeView) -> f32 {
        let at = |p: Vec3| p.dot(self.major) / view.pixel(p);
        let pixels = (at(p) - at(self.a)).abs();
        if pixels.is_finite() { pixels } else { 0.0 }
    }

    fn is_point(&self) -> bool {
        self.a == self.b
    }

    /// Returns the larger width of the ends in meters.
    fn width(&self, view: &StrokeView) -> f32 {
        2.0 * self.half * view.pixel(self.a).max(view.pixel(self.b))
    }

    /// Returns the bounding box.
    pub(crate) fn bounds(&self, view: &StrokeView) -> (Vec3, Vec3) {
        if self.piece.count > 1 {
            return self.bounds_of_piece(view);
        }
        let around = |p: Vec3| {
            let reach = (self.half + TIE_OFFSET as f32) * view.pixel(p).max(0.0);
            let mut size = self.across.abs();
            if self.is_point() {
                size += self.major.abs();
            }
            (p - size * reach, p + size * reach)
        };
        let (a, b) = (around(self.a), around(self.b));
        (a.0.min(b.0), a.1.max(b.1))
    }

    /// Returns the bounding box of a part of a line.
    fn bounds_of_piece(&self, view: &StrokeView) -> (Vec3, Vec3) {
        let Piece { index, count } = self.piece;
        let (a, b) = (self.a.as_dvec3(), self.b.as_dvec3());
        let end = |i: u32| a.lerp(b, f64::from(i) / f64::from(count)).as_vec3();
        let cut = Self {
            a: end(index),
            b: end(index + 1),
            piece: Piece::WHOLE,
            ..*self
        };
        let (min, max) = cut.bounds(view);
        // The ends are rounded.
        let rounding = 4.0 * f32::EPSILON * self.a.abs().max(self.b.abs());
        (min - rounding, max + rounding)
    }

    /// Returns the position of a point along the line, from 0 at `a` to 1 at `b`.
    pub(crate) fn share_at(&self, p: Vec3) -> f32 {
        let along = self.b - self.a;
        let s = (p - self.a).dot(along) / along.length_squared();
        if s.is_finite() {
            s.clamp(0.0, 1.0)
        } else {
            0.0
        }
    }

    /// Returns the normal at a position from 0 to 1, or `None` if it is zero.
    pub(crate) fn normal_at(&self, share: f32) -> Option<Vec3> {
        self.normals[0].lerp(self.normals[1], share).try_normalize()
    }

    /// Returns the distance at which a ray hits the ribbon, or its part, or the square.
    pub(crate) fn intersect(
        &self,
        origin: Vec3,
        direction: Vec3,
        view: &StrokeView,
    ) -> Option<f32> {
        let (a, d) = (self.a.as_dvec3(), direction.as_dvec3());
        let across = self.across.as_dvec3();
        let along = if self.is_point() {
            self.major.as_dvec3()
        } else {
            (self.b - self.a).as_dvec3()
        };
        let normal = along.cross(across);
        let t = (a - origin.as_dvec3()).dot(normal) / d.dot(normal);
        if !t.is_finite() {
            return None; // the ray is in the ribbon's plane
        }
        let p = origin.as_dvec3() + t * d - a;
        let square = normal.length_squared();
        let beside = p.dot(normal.cross(along)) / square;
        let forth = p.dot(across.cross(normal)) / square;
        (self.piece.contains(forth) && self.covers(a, along, forth, beside, view))
            .then_some(t as f32)
    }

    /// Whether the stroke covers a point of its plane.
    fn covers(&self, a: DVec3, along: DVec3, forth: f64, beside: f64, view: &StrokeView) -> bool {
        let within = |v: f64, foot: Vec3, aside: f64| {
            let pixels = v / f64::from(view.pixel(foot)) + aside;
            pixels.abs() <= f64::from(self.half)
        };
        if self.is_point() {
            let inside = |v| within(v, self.a, -TIE_OFFSET);
            return inside(forth) && inside(beside);
        }
        let foot = (a + forth * along).as_vec3();
        (0.0..=1.0).contains(&forth)
            && within(beside, foot, TIE_OFFSET)
            && self.is_inked(foot, view)
    }

    /// Whether the pattern has a dash at a point of the line.
    fn is_inked(&self, foot: Vec3, view: &StrokeView) -> bool {
        !self.has_gaps() || {
            let pixel = (self.start + self.pixels_to(foot, view)).floor();
            let bit = (pixel / self.scale) as u64 % 16;
            self.pattern >> bit & 1 == 1
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const VIEW: StrokeView = StrokeView {
        right: Vec3::X,
        up: Vec3::Y,
        forward: Vec3::NEG_Z,
        fixed: 0.0,
        per_depth: 0.01,
    };

    /// A ray through a line hits one of its pieces, inside of the piece's box.
    #[test]
    fn a_hit_on_a_line_is_in_the_box_of_one_piece() {
        let ends = [Vec3::new(-2.0, -1.0, -10.0), Vec3::new(0.3, 0.15, -1.0)];
        let line = Stroke::new(ends, 3.0, &VIEW);
        let mut hit = 0;
        for i in 0..2000 {
            let p = ends[0].lerp(ends[1], i as f32 / 1999.0);
            let origin = Vec3::new(0.3 * (i % 7) as f32, 1.0, 0.5);
            let known = line.intersect(origin, p - origin, &VIEW);
            let found: Vec<(Stroke, f32)> = line
                .divided(17)
                .filter_map(|piece| Some((piece, piece.intersect(origin, p - origin, &VIEW)?)))
                .collect();
            assert_eq!(found.len(), usize::from(known.is_some()), "{i}");
            for (piece, t) in found {
                assert_eq!(Some(t), known);
                let (min, max) = piece.bounds(&VIEW);
                let at = origin + t * (p - origin);
                assert!(
                    at.cmpge(min - 1e-6).all() && at.cmple(max + 1e-6).all(),
                    "{i}"
                );
                hit += 1;
            }
        }
        assert!(hit > 1900, "{hit}");
    }

    /// A thousand lines across a cube are divided, one alone and a point are not.
    #[test]
    fn long_lines_are_divided_and_points_are_not() {
        let across = [Vec3::splat(-1.0), Vec3::splat(1.0)];
        let mut all = vec![Stroke::new(across, 1.0, &VIEW); 1000];
        all.push(Stroke::new([Vec3::ZERO; 2], 1.0, &VIEW));
        let counts = piece_counts(&all, &VIEW, (across[0], across[1]));
        assert!(
            counts[..1000].iter().all(|n| (2..=64).contains(n)),
            "{counts:?}"
        );
        assert_eq!(counts[1000], 1);
        assert_eq!(piece_counts(&all[..1], &VIEW, (across[0], across[1])), [1]);
    }

    fn hits(stroke: &Stroke, x: f32, y: f32) -> bool {
        let direction = Vec3::new(x * 0.01, y * 0.01, -1.0); // in pixels
        stroke.intersect(Vec3::ZERO, direction, &VIEW).is_some()
    }

    #[test]
    fn a_line_has_its_width_in_pixels_at_any_depth() {
        for z in [-1.0, -10.0, -1000.0] {
            let ends = [Vec3::new(-1e3, 0.0, z), Vec3::new(1e3, 0.0, z)];
            let line = Stroke::new(ends, 2.0, &VIEW);
            assert!(hits(&line, 0.0, 0.99));
            assert!(!hits(&line, 0.0, 1.01));
        }
    }

    #[test]
    fn a_line_one_pixel_wide_covers_one_pixel_in_each_column() {
        // The line runs from far left to near right and rises by half a pixel in each column.
        let ends = [Vec3::new(-2.0, -1.0, -10.0), Vec3::new(0.3, 0.15, -1.0)];
        let line = Stroke::new(ends, 1.0, &VIEW);
        for column in -19..29 {
            let x = column as f32 + 0.4;
            let count = (-30..30).filter(|&row| hits(&line, x, row as f32)).count();
            assert_eq!(count, 1, "column {column}");
        }
        assert!(!hits(&line, 30.5, 15.25), "past its end");
    }

    #[test]
    fn the_lowest_bit_of_a_pattern_is_its_first_pixel() {
        let ends = [Vec3::new(0.0, 0.0, -1.0), Vec3::new(0.4, 0.0, -1.0)];
        let line = Stroke::new(ends, 1.0, &VIEW).with_pattern(0x0003, 1, 0.0);
        let seen: Vec<usize> = (0..40)
            .filter(|&i| hits(&line, i as f32 + 0.5, 0.0))
            .collect();
        assert_eq!(seen, [0, 1, 16, 17, 32, 33]);
        assert!((line.pattern_end(&VIEW) - 40.0).abs() < 1e-3);
    }

    #[test]
    fn a_point_between_pixels_covers_the_upper_right_one() {
        let point = Stroke::new([Vec3::new(0.0, 0.0, -7.0); 2], 1.0, &VIEW);
        assert!(hits(&point, 0.5, 0.5) && !hits(&point, -0.5, 0.5) && !hits(&point, 0.5, -0.5));
    }

    #[test]
    fn a_point_is_a_square_of_its_size_in_pixels() {
        let point = Stroke::new([Vec3::new(0.0, 0.0, -7.0); 2], 3.0, &VIEW);
        assert!(hits(&point, 1.49, -1.49) && !hits(&point, 1.51, 0.0));
    }
}
