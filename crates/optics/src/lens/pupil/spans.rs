//! The interpolated pupils between measured film radii, prepared for aiming many rays at once.

use glam::DVec2;
use ivcam_base::math::lanes::Lane;

use crate::lens::pupil::polygon::Polygon;
use crate::lens::pupil::radial::Radial;
use crate::lens::pupil::sides::{Outline, SIDES, Support};
use crate::lens::pupil::span::Span;

/// A table of pupils over the film's radius, prepared for aiming.
#[derive(Clone, Debug, Default)]
pub(crate) struct Spans {
    /// The film radii in millimeters at which the spans end, ascending. The first span begins at 0.
    pub ends: Vec<f64>,
    pub spans: Vec<Span>,
    /// The reciprocal of each span's length, per millimeter; 0 for a span of length 0.
    pub(super) inverse_length: Vec<f64>,
    /// The number of cells per millimeter of the radius.
    cells_per_mm: f64,
    /// The first span that each of [`CELLS`] equal parts of the radius overlaps.
    starts: Vec<u32>,
}

/// The number of equal parts of the film's radius in the table that finds a span.
const CELLS: usize = 256;

impl Spans {
    /// The spans between the nodes of a table, whose polygons have the normals `sides`.
    pub(crate) fn new(nodes: &Radial, sides: &[DVec2; SIDES]) -> Self {
        let outline = |node: &(f64, Support)| Outline::of(&node.1, sides);
        let mut this = Self::default();
        this.spans.reserve_exact(nodes.len().saturating_sub(1));
        for pair in nodes.windows(2) {
            let length = pair[1].0 - pair[0].0;
            this.ends.push(pair[1].0);
            this.inverse_length
                .push(if length > 0.0 { 1.0 / length } else { 0.0 });
            this.spans
                .push(Span::new(outline(&pair[0]), outline(&pair[1])));
        }
        let reach = this.ends.last().copied().unwrap_or(0.0);
        this.cells_per_mm = CELLS as f64 / reach.max(f64::MIN_POSITIVE);
        for cell in 0..CELLS {
            let radius = reach * cell as f64 / CELLS as f64;
            let first = this.ends.partition_point(|end| *end < radius);
            this.starts.push(first as u32);
        }
        this
    }

    /// The polygon at which rays from a film point are aimed; none if no light reaches it.
    pub(crate) fn window(&self, film: DVec2) -> Option<Polygon<'_>> {
        let (span, t, turn) = self.find(film)?;
        Polygon::between(span, t, turn)
    }

    /// The span of a film point, the mixing parameter in it, and the direction to which +x is
    /// rotated.
    fn find(&self, film: DVec2) -> Option<(&Span, f64, DVec2)> {
        let radius = film.length();
        let (number, t) = self.at(radius)?;
        Some((&self.spans[number], t, turn(film, radius)))
    }

    /// The number of the span of a film radius, and the mixing parameter in it.
    #[inline(always)]
    pub(crate) fn at(&self, radius: f64) -> Option<(usize, f64)> {
        let i = self.number(radius)?;
        Some((i, (radius - self.start(i)) * self.inverse_length[i]))
    }

    /// The number of the span of a film radius.
    #[inline(always)]
    fn number(&self, radius: f64) -> Option<usize> {
        let reach = *self.ends.last()?;
        if !(radius <= reach) {
            return None;
        }
        let cell = (radius * self.cells_per_mm) as usize;
        let mut i = self.starts[cell.min(CELLS - 1)] as usize;
        // Rounding may have placed the radius in a neighboring cell.
        while i > 0 && radius <= self.ends[i - 1] {
            i -= 1;
        }
        while self.ends[i] < radius {
            i += 1;
        }
        Some(i)
    }

    /// The number of the span that contains all radii, if one does. Mostly the film points of one
    /// pixel lie in one span.
    #[inline(always)]
    pub(super) fn all_in_one(&self, radii: &Lane) -> Option<usize> {
        let number = self.number(radii[0])?;
        let (start, end) = (self.start(number), self.ends[number]);
        let mut inside = true;
        for radius in radii {
            inside &= (*radius >= start) & (*radius <= end);
        }
        inside.then_some(number)
    }

    /// The film radius where a span begins.
    #[inline(always)]
    pub(crate) fn start(&self, number: usize) -> f64 {
        if number > 0 {
            self.ends[number - 1]
        } else {
            0.0
        }
    }
}

/// The unit vector from the axis to a film point; +x on the axis.
fn turn(film: DVec2, radius: f64) -> DVec2 {
    if radius > 0.0 {
        film / radius
    } else {
        DVec2::X
    }
}
