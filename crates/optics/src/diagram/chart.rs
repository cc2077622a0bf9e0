//! Small charts of curves: thin axes, few ticks, no frame.

use super::drawing::{Anchor, Drawing, Ink};
use super::numbers::{round_number, tidy};

/// A curve of a chart.
pub struct Series {
    /// The points (x, y) in the units of the axes; those that are not finite are left out.
    pub points: Vec<[f64; 2]>,
    /// The meaning of the curve, which gives its color.
    pub ink: Ink,
    /// Whether the curve is dashed.
    pub dashed: bool,
    /// The name in the legend; empty for a curve without an entry.
    pub name: String,
}

impl Series {
    /// Makes a solid curve with the ink [`Ink::Curve`] of a number.
    pub fn new(points: Vec<[f64; 2]>, curve: u8, name: &str) -> Self {
        Self {
            points,
            ink: Ink::Curve(curve),
            dashed: false,
            name: name.to_owned(),
        }
    }

    /// Returns the same curve, dashed.
    pub fn dashed(self) -> Self {
        Self {
            dashed: true,
            ..self
        }
    }
}

/// Curves over a common axis.
pub struct Chart {
    /// The heading above the chart.
    pub title: String,
    /// The quantity and the unit of the x axis.
    pub x_label: String,
    /// The quantity and the unit of the y axis.
    pub y_label: String,
    /// The curves in the order in which they are drawn.
    pub series: Vec<Series>,
    /// The smallest range of the y axis; curves beyond it extend it.
    pub y_span: (f64, f64),
    /// The range of the x axis; `None` for the range of all curves.
    pub x_span: Option<(f64, f64)>,
    /// Whether x is drawn upward and y to the right, as lens designers draw what varies over the
    /// field or the pupil.
    pub upright: bool,
}

const LEFT: f64 = 40.0;
const RIGHT: f64 = 10.0;
const TOP: f64 = 34.0;
const BOTTOM: f64 = 34.0;
/// The distance of lines of labels.
const LINE: f64 = 12.0;
/// The width of an entry of the legend beside its name.
const ENTRY: f64 = 21.0;

impl Chart {
    /// Returns a drawing of the chart with a width and a height in units of the drawing.
    pub fn draw(&self, width: f64, height: f64) -> Drawing {
        let mut drawing = Drawing::new(width, height);
        let (x_low, x_high) = self
            .x_span
            .unwrap_or_else(|| self.span(0, (f64::MAX, f64::MIN)));
        let (y_low, y_high) = self.span(1, self.y_span);
        let y_step = round_number((y_high - y_low) / 4.0);
        let (y_low, y_high) = (
            libm::floor(y_low / y_step + 1e-6) * y_step,
            libm::ceil(y_high / y_step - 1e-6) * y_step,
        );
        let x_step = round_number((x_high - x_low) / 5.0);
        let (right, bottom) = (width - RIGHT, height - BOTTOM);
        let labels = match self.upright {
            true => [&*self.y_label, &*self.x_label],
            false => [&*self.x_label, &*self.y_label],
        };
        // Long names in the legend have a line of their own above the label.
        let is_crossed =
            !labels[1].is_empty() && LEFT + text_width(labels[1]) > right - self.legend_width();
        let lower = if is_crossed { LINE } else { 0.0 };
        let top = TOP + lower;
        let place = |[x, y]: [f64; 2]| {
            let x = (x - x_low) / (x_high - x_low).max(1e-300);
            let y = (y - y_low) / (y_high - y_low).max(1e-300);
            let [across, up] = if self.upright { [y, x] } else { [x, y] };
            [LEFT + (right - LEFT) * across, bottom - (bottom - top) * up]
        };
        drawing.heading([0.0, 11.0], 11.5, &*self.title);
        self.legend(&mut drawing, width);
        let note = |drawing: &mut Drawing, [x, y]: [f64; 2], is_beside: bool, text: String| {
            match is_beside {
                true => drawing.note([LEFT - 6.0, y + 3.2], Anchor::End, 9.0, text),
                false => drawing.note([x, bottom + 14.0], Anchor::Middle, 9.0, text),
            }
        };
        for value in ticks(y_low, y_high, y_step) {
            let ends = [place([x_low, value]), place([x_high, value])];
            let is_zero = value.abs() < 1e-9 * y_step;
            let ink = if is_zero { Ink::Plane } else { Ink::Faint };
            if is_zero {
                drawing.line(ends[0], ends[1], Ink::Faint);
            }
            drawing.line(ends[0], ends[1], ink);
            note(&mut drawing, ends[0], !self.upright, tidy(value, y_step));
        }
        for value in ticks(x_low, x_high, x_step) {
            let [x, y] = place([value, y_low]);
            let tick = if self.upright {
                [x - 3.0, y]
            } else {
                [x, y + 3.0]
            };
            drawing.line([x, y], tick, Ink::Faint);
            note(&mut drawing, [x, y], self.upright, tidy(value, x_step));
        }
        drawing.note([right, height - 7.0], Anchor::End, 9.0, labels[0]);
        drawing.note([LEFT, 26.0 + lower], Anchor::Start, 9.0, labels[1]);
        for series in &self.series {
            let inside = series
                .points
                .iter()
                .filter(|p| p.iter().all(|v| v.is_finite()));
            let points: Vec<[f64; 2]> = inside.map(|p| place(*p)).collect();
            if points.len() > 1 {
                drawing.curve(points, series.ink, series.dashed);
            }
        }
        drawing
    }

    /// Returns the chart with x upward.
    pub(super) fn upright(self) -> Self {
        Self {
            upright: true,
            ..self
        }
    }

    /// Returns the range of all curves, and at least `span`.
    fn span(&self, axis: usize, span: (f64, f64)) -> (f64, f64) {
        let all = self
            .series
            .iter()
            .flat_map(|s| s.points.iter().map(|p| p[axis]));
        let all = all.filter(|v| v.is_finite());
        let (low, high) = all.fold(span, |(low, high), v| (low.min(v), high.max(v)));
        if high > low {
            (low, high)
        } else {
            (low - 1.0, low + 1.0)
        }
    }

    /// The curves that have an entry in the legend.
    fn named(&self) -> impl DoubleEndedIterator<Item = &Series> {
        self.series.iter().filter(|s| !s.name.is_empty())
    }

    /// The width of the legend.
    fn legend_width(&self) -> f64 {
        self.named().map(|s| text_width(&s.name) + ENTRY).sum()
    }

    /// Draws the names with a piece of their line, from the right.
    fn legend(&self, drawing: &mut Drawing, width: f64) {
        let mut x = width - RIGHT;
        for series in self.named().rev() {
            let length = text_width(&series.name);
            drawing.note([x, 26.0], Anchor::End, 9.0, &*series.name);
            let (from, to) = ([x - length - 14.0, 23.0], [x - length - 3.0, 23.0]);
            drawing.curve(vec![from, to], series.ink, series.dashed);
            x -= length + ENTRY;
        }
    }
}

/// The width of a label. The widest of the usual sans-serif fonts, DejaVu Sans, needs this for
/// digits.
fn text_width(text: &str) -> f64 {
    5.7 * text.chars().count() as f64
}

fn ticks(low: f64, high: f64, step: f64) -> impl Iterator<Item = f64> {
    let first = libm::ceil(low / step - 1e-6) as i64;
    let last = libm::floor(high / step + 1e-6) as i64;
    (first..=last.min(first.saturating_add(40))).map(move |i| i as f64 * step)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_legend_of_long_names_is_above_the_label() {
        let text = |names: [&str; 3]| {
            let curve = |name: &str| Series::new(vec![[0.0, 0.0], [1.0, 1.0]], 0, name);
            let chart = Chart {
                title: "fan".into(),
                x_label: String::new(),
                y_label: "\u{b5}m on the film".into(),
                series: names.map(curve).into(),
                y_span: (0.0, 1.0),
                x_span: None,
                upright: false,
            };
            chart.draw(223.6, 140.0).to_svg()
        };
        let height = |text: &str| {
            let label = text
                .split("<text")
                .find(|part| part.contains("on the film"));
            let y =
                label.and_then(|part| part.split("y=\"").nth(1)?.split('"').next()?.parse().ok());
            y.unwrap_or(0.0)
        };
        let [short, long] =
            [["F", "d", "C"], ["486 nm", "588 nm", "656 nm"]].map(|n| height(&text(n)));
        assert_eq!(long - short, LINE, "{short} {long}");
    }
}
