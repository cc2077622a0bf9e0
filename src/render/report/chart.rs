//! The convergence chart: relRMSE over seconds, both axes logarithmic, as SVG.

use std::fmt::Write as _;

use super::convergence::{Convergence, Row};

const WIDTH: f64 = 720.0;
const HEIGHT: f64 = 480.0;
/// Left, right, top, bottom.
const MARGIN: [f64; 4] = [78.0, 150.0, 48.0, 58.0];
/// Okabe and Ito's colors, which color-blind readers can tell apart.
const COLORS: [&str; 7] = [
    "#0072b2", "#d55e00", "#009e73", "#cc79a7", "#56b4e9", "#e69f00", "#333333",
];

/// A logarithmic axis over whole decades.
struct Axis {
    low: i32,
    high: i32,
    from: f64,
    to: f64,
}

impl Axis {
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

    fn at(&self, value: f64) -> f64 {
        let share = (libm::log10(value) - f64::from(self.low)) / f64::from(self.high - self.low);
        self.from + share * (self.to - self.from)
    }

    fn decades(&self) -> impl Iterator<Item = (f64, i32)> + '_ {
        (self.low..=self.high).map(|d| (self.at(libm::exp10(f64::from(d))), d))
    }
}

fn error(row: &Row) -> f64 {
    row.deviation.rel_mse.sqrt()
}

pub(super) fn chart(table: &Convergence) -> String {
    let [left, right, top, bottom] = MARGIN;
    let (x1, y1) = (WIDTH - right, HEIGHT - bottom);
    let x = Axis::over(table.rows.iter().map(|r| r.seconds), left, x1);
    let y = Axis::over(table.rows.iter().map(error), y1, top);
    let mut out = format!(
        "<svg xmlns=\"http://www.w3.org/2000/svg\" viewBox=\"0 0 {WIDTH} {HEIGHT}\" \
         font-family=\"Helvetica, Arial, sans-serif\" font-size=\"12\" fill=\"#333\">\n\
         <rect width=\"{WIDTH}\" height=\"{HEIGHT}\" fill=\"#fff\"/>\n\
         <text x=\"{left}\" y=\"24\" font-size=\"15\">{}</text>\n\
         <text x=\"{left}\" y=\"40\" fill=\"#777\">against {}</text>\n",
        escape(&table.scene),
        escape(&table.reference)
    );
    for (at, decade) in x.decades() {
        let _ = writeln!(
            out,
            "<path d=\"M{at:.1} {top}V{y1}\" stroke=\"#ddd\"/><text x=\"{at:.1}\" y=\"{:.1}\" \
             text-anchor=\"middle\">{}</text>",
            y1 + 18.0,
            power(decade)
        );
    }
    for (at, decade) in y.decades() {
        let _ = writeln!(
            out,
            "<path d=\"M{left} {at:.1}H{x1}\" stroke=\"#ddd\"/><text x=\"{:.1}\" y=\"{:.1}\" \
             text-anchor=\"end\">{}</text>",
            left - 8.0,
            at + 4.0,
            power(decade)
        );
    }
    let middle = 0.5 * (left + x1);
    let half = 0.5 * (top + y1);
    let _ = writeln!(
        out,
        "<text x=\"{middle:.1}\" y=\"{:.1}\" text-anchor=\"middle\">seconds</text>\n\
         <text transform=\"translate(20 {half:.1}) rotate(-90)\" text-anchor=\"middle\">relative RMSE</text>",
        HEIGHT - 14.0
    );
    let mut methods: Vec<&str> = Vec::new();
    for row in &table.rows {
        if !methods.contains(&row.method.as_str()) {
            methods.push(&row.method);
        }
    }
    let mut labels: Vec<(f64, &str, &str)> = Vec::new();
    for (method, color) in methods.iter().zip(COLORS.iter().cycle()) {
        let points: Vec<(f64, f64)> = table
            .rows
            .iter()
            .filter(|r| r.method == *method && error(r) > 0.0)
            .map(|r| (x.at(r.seconds), y.at(error(r))))
            .collect();
        let line: Vec<String> = points
            .iter()
            .map(|(a, b)| format!("{a:.1},{b:.1}"))
            .collect();
        let _ = writeln!(
            out,
            "<polyline points=\"{}\" fill=\"none\" stroke=\"{color}\" stroke-width=\"1.8\"/>",
            line.join(" ")
        );
        for (a, b) in &points {
            let _ = writeln!(
                out,
                "<circle cx=\"{a:.1}\" cy=\"{b:.1}\" r=\"3\" fill=\"{color}\"/>"
            );
        }
        if let Some((_, b)) = points.last() {
            labels.push((*b, method, color));
        }
    }
    // Names stand at the ends of their lines, pushed apart where they would touch.
    labels.sort_by(|a, b| a.0.total_cmp(&b.0));
    let mut next = f64::NEG_INFINITY;
    for (at, method, color) in labels {
        let at = at.max(next);
        next = at + 15.0;
        let _ = writeln!(
            out,
            "<text x=\"{:.1}\" y=\"{:.1}\" fill=\"{color}\">{}</text>",
            x1 + 10.0,
            at + 4.0,
            escape(method)
        );
    }
    out.push_str("</svg>\n");
    out
}

/// `0.01` … `1000`, and powers of ten beyond.
fn power(decade: i32) -> String {
    match decade {
        -3..=4 => libm::exp10(f64::from(decade)).to_string(),
        _ => format!("1e{decade}"),
    }
}

fn escape(text: &str) -> String {
    text.replace('&', "&amp;")
        .replace('<', "&lt;")
        .replace('>', "&gt;")
}
