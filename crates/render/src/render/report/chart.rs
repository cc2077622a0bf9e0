//! The convergence chart: relRMSE over time or samples, both axes logarithmic, as SVG.

use std::fmt::Write as _;

use ivcam_base::files::escaped;

use super::convergence::Convergence;

/// The quantity on the horizontal axis.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Across {
    /// Seconds of the clock.
    Seconds,
    /// Seconds of processors.
    ProcessorSeconds,
    /// Samples per pixel.
    Samples,
}

impl Across {
    /// The names that `--axis` accepts.
    pub const ALL: [(&'static str, Self); 3] = [
        ("seconds", Self::Seconds),
        ("processor", Self::ProcessorSeconds),
        ("samples", Self::Samples),
    ];

    /// The title of the axis.
    fn title(self) -> &'static str {
        match self {
            Self::Seconds => "seconds",
            Self::ProcessorSeconds => "processor seconds",
            Self::Samples => "samples per pixel",
        }
    }

    fn choose(self, seconds: Option<f64>, processor: Option<f64>, n: Option<f64>) -> Option<f64> {
        match self {
            Self::Seconds => seconds,
            Self::ProcessorSeconds => processor,
            Self::Samples => n,
        }
    }
}

/// The points of one line, in data.
struct ChartCurve<'a> {
    name: &'a str,
    /// Whether it is of another program.
    peer: bool,
    points: Vec<(f64, f64)>,
}

/// Returns the curves of a table, methods first. Points that a logarithmic axis cannot show are
/// left out.
fn curves(table: &Convergence, across: Across) -> Vec<ChartCurve<'_>> {
    let rows = table.rows.iter().map(|r| {
        let n = Some(f64::from(r.samples));
        let x = across.choose(Some(r.seconds), r.processor_seconds, n);
        (r.method.as_str(), false, x, r.deviation.rel_mse.sqrt())
    });
    let peers = table.peers.iter().map(|p| {
        let x = across.choose(p.seconds, p.processor_seconds, p.samples);
        (p.method.as_str(), true, x, p.rel_rmse)
    });
    let mut curves: Vec<ChartCurve<'_>> = Vec::new();
    for (name, peer, x, y) in rows.chain(peers) {
        let Some(x) = x.filter(|x| *x > 0.0 && y > 0.0) else {
            continue;
        };
        match curves.iter_mut().find(|c| (c.name, c.peer) == (name, peer)) {
            Some(curve) => curve.points.push((x, y)),
            None => curves.push(ChartCurve {
                name,
                peer,
                points: vec![(x, y)],
            }),
        }
    }
    curves
}

const WIDTH: f64 = 720.0;
const HEIGHT: f64 = 480.0;
/// Margins around the plot: left, right, top, bottom.
const MARGIN: [f64; 4] = [78.0, 150.0, 48.0, 58.0];
/// Okabe and Ito's colors, which color-blind readers can tell apart.
const COLORS: [&str; 7] = [
    "#0072b2", "#d55e00", "#009e73", "#cc79a7", "#56b4e9", "#e69f00", "#333333",
];

/// A logarithmic axis over whole decades.
struct Axis {
    /// The decimal exponents at the ends.
    low: i32,
    high: i32,
    /// The coordinates of the ends in the drawing.
    from: f64,
    to: f64,
}

impl Axis {
    /// Returns the axis that holds all positive values, or 0.1 to 1 if there are none.
    fn over(values: impl Iterator<Item = f64>, from: f64, to: f64) -> Self {
        let logs: Vec<f64> = values.filter(|v| *v > 0.0).map(libm::log10).collect();
        let low = logs.iter().copied().fold(f64::INFINITY, f64::min);
        let high = logs.iter().copied().fold(f64::NEG_INFINITY, f64::max);
        if !low.is_finite() {
            return Self {
                low: -1,
                high: 0,
                from,
                to,
            };
        }
        let (low, high) = (low.floor() as i32, high.ceil() as i32);
        Self {
            low,
            high: high.max(low + 1),
            from,
            to,
        }
    }

    /// Returns the coordinate of a value.
    fn at(&self, value: f64) -> f64 {
        let share = (libm::log10(value) - f64::from(self.low)) / f64::from(self.high - self.low);
        self.from + share * (self.to - self.from)
    }

    /// Returns the coordinate and the exponent of each power of ten.
    fn decades(&self) -> impl Iterator<Item = (f64, i32)> + '_ {
        (self.low..=self.high).map(|d| (self.at(libm::exp10(f64::from(d))), d))
    }
}

impl Convergence {
    /// Returns a chart of relRMSE as SVG, both axes logarithmic, one line for each method.
    pub fn svg(&self, across: Across) -> String {
        let [left, right, top, bottom] = MARGIN;
        let (x1, y1) = (WIDTH - right, HEIGHT - bottom);
        let curves = curves(self, across);
        let points = || curves.iter().flat_map(|c| c.points.iter());
        let x = Axis::over(points().map(|p| p.0), left, x1);
        let y = Axis::over(points().map(|p| p.1), y1, top);
        let mut out = head(self);
        write_axes(&mut out, &x, &y, across.title());
        let labels = write_lines(&mut out, &curves, &x, &y);
        write_labels(&mut out, labels);
        out.push_str("</svg>\n");
        out
    }
}

/// Returns the opening tag, the background and the titles.
fn head(table: &Convergence) -> String {
    let left = MARGIN[0];
    format!(
        "<svg xmlns=\"http://www.w3.org/2000/svg\" viewBox=\"0 0 {WIDTH} {HEIGHT}\" \
         font-family=\"Helvetica, Arial, sans-serif\" font-size=\"12\" fill=\"#333\">\n\
         <rect width=\"{WIDTH}\" height=\"{HEIGHT}\" fill=\"#fff\"/>\n\
         <text x=\"{left}\" y=\"24\" font-size=\"15\">{}</text>\n\
         <text x=\"{left}\" y=\"40\" fill=\"#777\">against {}</text>\n",
        escaped(&table.scene),
        escaped(&table.reference)
    )
}

/// Writes the grid lines of both axes with their numbers and titles.
fn write_axes(out: &mut String, x: &Axis, y: &Axis, title: &str) {
    let [left, right, top, bottom] = MARGIN;
    let (x1, y1) = (WIDTH - right, HEIGHT - bottom);
    for (at, decade) in x.decades() {
        let _ = writeln!(
            out,
            "<path d=\"M{at:.1} {top}V{y1}\" stroke=\"#ddd\"/><text x=\"{at:.1}\" y=\"{:.1}\" \
             text-anchor=\"middle\">{}</text>",
            y1 + 18.0,
            power_of_ten(decade)
        );
    }
    for (at, decade) in y.decades() {
        let _ = writeln!(
            out,
            "<path d=\"M{left} {at:.1}H{x1}\" stroke=\"#ddd\"/><text x=\"{:.1}\" y=\"{:.1}\" \
             text-anchor=\"end\">{}</text>",
            left - 8.0,
            at + 4.0,
            power_of_ten(decade)
        );
    }
    let middle = 0.5 * (left + x1);
    let half = 0.5 * (top + y1);
    let _ = writeln!(
        out,
        "<text x=\"{middle:.1}\" y=\"{:.1}\" text-anchor=\"middle\">{title}</text>\n\
         <text transform=\"translate(20 {half:.1}) rotate(-90)\" text-anchor=\"middle\">relative RMSE</text>",
        HEIGHT - 14.0
    );
}

/// A method's name at the right of the plot.
struct AxisLabel<'a> {
    y: f64,
    text: &'a str,
    color: &'static str,
}

/// Draws each curve, those of other programs dashed with open circles, and returns the labels at
/// the heights of the last points.
fn write_lines<'a>(
    out: &mut String,
    curves: &'a [ChartCurve<'a>],
    x: &Axis,
    y: &Axis,
) -> Vec<AxisLabel<'a>> {
    let mut labels = Vec::new();
    for (curve, color) in curves.iter().zip(COLORS.into_iter().cycle()) {
        let at = |(a, b): &(f64, f64)| (x.at(*a), y.at(*b));
        let points: Vec<(f64, f64)> = curve.points.iter().map(at).collect();
        let line: Vec<String> = points
            .iter()
            .map(|(a, b)| format!("{a:.1},{b:.1}"))
            .collect();
        let (dashes, inside) = match curve.peer {
            true => (" stroke-dasharray=\"6 4\"", "#fff"),
            false => ("", color),
        };
        let _ = writeln!(
            out,
            "<polyline points=\"{}\" fill=\"none\" stroke=\"{color}\" stroke-width=\"1.8\"{dashes}/>",
            line.join(" ")
        );
        for (a, b) in &points {
            let _ = writeln!(
                out,
                "<circle cx=\"{a:.1}\" cy=\"{b:.1}\" r=\"3\" fill=\"{inside}\" stroke=\"{color}\"/>"
            );
        }
        if let Some(&(_, y)) = points.last() {
            let text = curve.name;
            labels.push(AxisLabel { y, text, color });
        }
    }
    labels
}

/// Writes the labels from top to bottom, at least 15 units apart so that they do not overlap.
fn write_labels(out: &mut String, mut labels: Vec<AxisLabel<'_>>) {
    labels.sort_by(|a, b| a.y.total_cmp(&b.y));
    let mut next = f64::NEG_INFINITY;
    for AxisLabel { y, text, color } in labels {
        let y = y.max(next);
        next = y + 15.0;
        let _ = writeln!(
            out,
            "<text x=\"{:.1}\" y=\"{:.1}\" fill=\"{color}\">{}</text>",
            WIDTH - MARGIN[1] + 10.0,
            y + 4.0,
            escaped(text)
        );
    }
}

/// Formats a power of ten: `0.001` to `10000` in full, others as `1e5`.
fn power_of_ten(decade: i32) -> String {
    match decade {
        -3..=4 => libm::exp10(f64::from(decade)).to_string(),
        _ => format!("1e{decade}"),
    }
}
