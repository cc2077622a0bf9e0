//! Lines and points with a width in pixels, which therefore grows with the depth from the camera.
//! The camera is the origin.
//!
//! A line is a ribbon. Its width is measured along the picture's rows or columns, whichever the
//! line crosses more steeply, and it ends where the line does. That is OpenGL's rule for lines that
//! are not smoothed, so that a picture through a pinhole shows the same pixels. A point is a
//! square.

use glam::{DVec3, Vec2, Vec3};

/// An offset in pixels that breaks ties. The edges of a line along an axis through the picture's
/// center run exactly through the centers of pixels: the line covers the lower or the left ones,
/// whatever the rounding. A point between pixels covers the upper and the right ones, as in OpenGL.
/// The offset is far above the rounding of a pixel's place and far below what shows.
const TIE_OFFSET: f64 = 1.0 / 256.0;

/// The directions of a picture and the size of its pixels, for strokes.
#[derive(Clone, Copy, Debug, Default)]
pub(crate) struct StrokeView {
    pub right: Vec3,
    pub up: Vec3,
    pub forward: Vec3,
    /// A pixel's size in meters at depth 0.
    pub fixed: f32,
    /// By how much a pixel's size grows with each meter of depth.
    pub per_depth: f32,
}

impl StrokeView {
    fn depth(&self, p: Vec3) -> f32 {
        p.dot(self.forward)
    }

    /// Returns a pixel's size in meters at a point.
    fn pixel(&self, p: Vec3) -> f32 {
        self.fixed + self.per_depth * self.depth(p)
    }

    /// Whether the picture of a line runs more along the rows than along the columns.
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

/// A ribbon between two points, or a square where they are one.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Stroke {
    pub a: Vec3,
    pub b: Vec3,
    /// The direction of the width, of length 1.
    across: Vec3,
    /// The direction of the picture along which the line runs, of length 1.
    major: Vec3,
    /// Half of the width in pixels.
    half: f32,
    /// Materials at the ends, which are interpolated along the line.
    pub materials: [u32; 2],
    /// Normals at the ends for the lighting; a zero normal faces the camera.
    pub normals: [Vec3; 2],
    pub coordinates: [Vec2; 2],
    /// The outward normal, of any length, of the face whose edge or corner it is; zero for a line
    /// or a point that belongs to no face.
    pub face: Vec3,
    /// A pattern of 16 dashes and gaps, each a pixel long, from the lowest bit on.
    pattern: u16,
    /// The pixels of the pattern that preceding lines have used.
    start: f32,
}

impl Stroke {
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
            start: 0.0,
        }
    }

    pub(crate) fn with_pattern(self, pattern: u16, start: f32) -> Self {
        Self {
            pattern,
            start,
            ..self
        }
    }

    /// Whether the pattern has gaps.
    pub(crate) fn has_gaps(&self) -> bool {
        self.pattern != 0xffff
    }

    /// Returns where the pattern continues behind this line: after whole pixels, as OpenGL counts
    /// them.
    pub(crate) fn pattern_end(&self, view: &StrokeView) -> f32 {
        self.start + self.pixels(view).ceil()
    }

    /// Returns the line's length in pixels along the picture's axis.
    pub(crate) fn pixels(&self, view: &StrokeView) -> f32 {
        self.pixels_to(self.b, view)
    }

    /// Returns the number of pixels along the picture's axis from the beginning to a point.
    fn pixels_to(&self, p: Vec3, view: &StrokeView) -> f32 {
        let at = |p: Vec3| p.dot(self.major) / view.pixel(p);
        let pixels = (at(p) - at(self.a)).abs();
        if pixels.is_finite() { pixels } else { 0.0 }
    }

    fn is_point(&self) -> bool {
        self.a == self.b
    }

    pub(crate) fn bounds(&self, view: &StrokeView) -> (Vec3, Vec3) {
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

    /// Returns how far a point is along the way from `a` to `b`, from 0 to 1.
    pub(crate) fn share_at(&self, p: Vec3) -> f32 {
        let along = self.b - self.a;
        let s = (p - self.a).dot(along) / along.length_squared();
        if s.is_finite() {
            s.clamp(0.0, 1.0)
        } else {
            0.0
        }
    }

    /// Returns the normal at a share of the way, or `None` if it has none of its own.
    pub(crate) fn normal_at(&self, share: f32) -> Option<Vec3> {
        self.normals[0].lerp(self.normals[1], share).try_normalize()
    }

    /// Returns the distance at which a ray intersects the ribbon or the square.
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
        self.covers(a, along, forth, beside, view)
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

    fn is_inked(&self, foot: Vec3, view: &StrokeView) -> bool {
        !self.has_gaps() || {
            let pixel = (self.start + self.pixels_to(foot, view)) as u64;
            self.pattern >> (pixel % 16) & 1 == 1
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

    fn meets(stroke: &Stroke, x: f32, y: f32) -> bool {
        let direction = Vec3::new(x * 0.01, y * 0.01, -1.0); // in pixels
        stroke.intersect(Vec3::ZERO, direction, &VIEW).is_some()
    }

    #[test]
    fn a_line_is_as_wide_as_its_pixels_wherever_it_is() {
        for z in [-1.0, -10.0, -1000.0] {
            let ends = [Vec3::new(-1e3, 0.0, z), Vec3::new(1e3, 0.0, z)];
            let line = Stroke::new(ends, 2.0, &VIEW);
            assert!(meets(&line, 0.0, 0.99));
            assert!(!meets(&line, 0.0, 1.01));
        }
    }

    #[test]
    fn a_line_one_pixel_wide_shows_one_pixel_a_column() {
        // From far and left to near and right, rising by half a pixel a column.
        let ends = [Vec3::new(-2.0, -1.0, -10.0), Vec3::new(0.3, 0.15, -1.0)];
        let line = Stroke::new(ends, 1.0, &VIEW);
        for column in -19..29 {
            let x = column as f32 + 0.4;
            let count = (-30..30).filter(|&row| meets(&line, x, row as f32)).count();
            assert_eq!(count, 1, "column {column}");
        }
        assert!(!meets(&line, 30.5, 15.25), "past its end");
    }

    #[test]
    fn a_pattern_s_lowest_bit_is_its_first_pixel() {
        let ends = [Vec3::new(0.0, 0.0, -1.0), Vec3::new(0.4, 0.0, -1.0)];
        let line = Stroke::new(ends, 1.0, &VIEW).with_pattern(0x0003, 0.0);
        let seen: Vec<usize> = (0..40)
            .filter(|&i| meets(&line, i as f32 + 0.5, 0.0))
            .collect();
        assert_eq!(seen, [0, 1, 16, 17, 32, 33]);
        assert!((line.pattern_end(&VIEW) - 40.0).abs() < 1e-3);
    }

    #[test]
    fn a_point_between_pixels_has_the_upper_right_one() {
        let point = Stroke::new([Vec3::new(0.0, 0.0, -7.0); 2], 1.0, &VIEW);
        assert!(meets(&point, 0.5, 0.5) && !meets(&point, -0.5, 0.5) && !meets(&point, 0.5, -0.5));
    }

    #[test]
    fn a_point_is_a_square_of_its_pixels() {
        let point = Stroke::new([Vec3::new(0.0, 0.0, -7.0); 2], 3.0, &VIEW);
        assert!(meets(&point, 1.49, -1.49) && !meets(&point, 1.51, 0.0));
    }
}
