//! Writes a drawing in the format of xfig 3.2, which `fig2dev` reads.
//!
//! Lengths are in xfig's 1200 units per inch; the drawing is 25 cm wide. The fonts are Helvetica
//! and Times; letters that PostScript's Latin encoding lacks are replaced.

use std::fmt::Write as _;

use super::drawing::{Anchor, Drawing, DrawingOutput, DrawingText, Ink, Lettering, Path};

/// Width of the drawing in xfig units: 25 cm.
const WIDTH: f64 = 25.0 / 2.54 * 1200.0;

/// The drawing's own colors, numbered from 32 in the file.
const COLORS: [&str; 12] = [
    "#1c2227", "#9aa5ad", "#40566b", "#e9f2f8", "#dbe8f1", "#cbdbe6", "#b8ccda", "#0072b2",
    "#009e73", "#d55e00", "#a0528e", "#68737c",
];
const INK: usize = 32;
const GRAY: usize = 33;
const EDGE: usize = 34;
const GLASS: usize = 35;
const RAYS: usize = 39;
const SOFT: usize = 43;

/// The style of a line: thickness in 1/80 inch, colors by number, and xfig's depth.
struct LineStyle {
    style: i32,
    thickness: i32,
    pen: usize,
    fill: Option<usize>,
    depth: u32,
}

impl Drawing {
    /// Returns the drawing as an xfig file.
    pub fn to_fig(&self) -> String {
        let mut text =
            String::from("#FIG 3.2\nLandscape\nCenter\nMetric\nA4\n100.00\nSingle\n-2\n1200 2\n");
        for (i, color) in COLORS.iter().enumerate() {
            let _ = writeln!(text, "0 {} {color}", 32 + i);
        }
        let scale = WIDTH / self.width.max(1.0);
        let mut fig = Fig { text, scale };
        self.draw(&mut fig);
        fig.text
    }
}

fn look(ink: Ink, dashed: bool) -> LineStyle {
    let line = |pen, thickness, depth| LineStyle {
        style: i32::from(dashed),
        thickness,
        pen,
        fill: None,
        depth,
    };
    match ink {
        Ink::Axis => LineStyle {
            style: 3,
            ..line(GRAY, 1, 60)
        },
        Ink::Glass(n) => LineStyle {
            fill: Some(GLASS + usize::from(n.min(3))),
            ..line(EDGE, 1, 55)
        },
        Ink::Stop => line(INK, 3, 40),
        Ink::Film => line(INK, 2, 40),
        Ink::Ray(n) => line(RAYS + usize::from(n % 4), 1, 50),
        Ink::Lost(n) => LineStyle {
            style: 2,
            ..line(RAYS + usize::from(n % 4), 1, 50)
        },
        Ink::Plane => LineStyle {
            style: 1,
            ..line(SOFT, 1, 45)
        },
        Ink::Mark | Ink::Label => line(INK, 1, 40),
        Ink::Faint => line(GRAY, 1, 58),
        Ink::Curve(0) => line(INK, 1, 45),
        Ink::Curve(n) => line(RAYS + usize::from((n - 1) % 4), 1, 45),
    }
}

/// The text of the file, and xfig units per unit of the drawing.
struct Fig {
    text: String,
    scale: f64,
}

impl Fig {
    fn place(&self, at: [f64; 2]) -> [i64; 2] {
        at.map(|v| (v * self.scale).round() as i64)
    }

    fn polyline(&mut self, look: &LineStyle, points: &[[f64; 2]], closed: bool) {
        let mut points: Vec<[i64; 2]> = points.iter().map(|p| self.place(*p)).collect();
        if closed && let Some(first) = points.first() {
            points.push(*first);
        }
        let kind = if closed { 3 } else { 1 };
        let (fill, area) = look.fill.map_or((7, -1), |fill| (fill as i64, 20));
        let gap = if look.style == 0 { 0.0 } else { 3.0 };
        let _ = writeln!(
            self.text,
            "2 {kind} {} {} {} {fill} {} -1 {area} {gap:.3} 1 1 -1 0 0 {}",
            look.style,
            look.thickness,
            look.pen,
            look.depth,
            points.len()
        );
        for chunk in points.chunks(8) {
            let words: Vec<String> = chunk.iter().map(|[x, y]| format!("{x} {y}")).collect();
            let _ = writeln!(self.text, "\t {}", words.join(" "));
        }
    }
}

impl DrawingOutput for Fig {
    fn path(&mut self, path: &Path) {
        let look = look(path.ink, path.dashed);
        self.polyline(&look, &path.points, path.closed);
    }

    fn dot(&mut self, at: [f64; 2], radius: f64, ink: Ink) {
        let look = look(ink, false);
        let ([x, y], r) = (
            self.place(at),
            (radius * self.scale).round().max(1.0) as i64,
        );
        let _ = writeln!(
            self.text,
            "1 3 0 1 {pen} {pen} {} -1 20 0.000 1 0.0000 {x} {y} {r} {r} {x} {y} {} {y}",
            look.depth,
            x + r,
            pen = look.pen
        );
    }

    fn dots(&mut self, places: &[[f64; 2]], radius: f64, ink: Ink) {
        for at in places {
            self.dot(*at, radius, ink);
        }
    }

    fn cross(&mut self, [x, y]: [f64; 2], size: f64, ink: Ink) {
        let look = LineStyle {
            style: 0,
            ..look(ink, false)
        };
        for s in [-1.0, 1.0] {
            let ends = [[x - size, y - s * size], [x + size, y + s * size]];
            self.polyline(&look, &ends, false);
        }
    }

    fn text(&mut self, text: &DrawingText) {
        let [x, y] = self.place(text.at);
        let anchor = match text.anchor {
            Anchor::Start => 0,
            Anchor::Middle => 1,
            Anchor::End => 2,
        };
        let font = match text.lettering {
            Lettering::Italic => 1,
            Lettering::Bold => 18,
            Lettering::Plain => 16,
        };
        // The font size in points of 1/72 inch.
        let points = (text.size * self.scale / 1200.0 * 72.0).round().max(4.0);
        let pen = look(text.ink, false).pen;
        let _ = writeln!(
            self.text,
            "4 {anchor} {pen} 35 -1 {font} {points} 0.0000 4 {:.0} {:.0} {x} {y} {}\\001",
            points / 72.0 * 1200.0,
            points / 72.0 * 600.0 * text.words.chars().count() as f64,
            plain(&text.words)
        );
    }
}

/// Encodes a text in xfig's Latin-1 with octal escapes.
fn plain(text: &str) -> String {
    let mut out = String::new();
    for c in text.chars() {
        match c {
            '\u{2212}' | '\u{2013}' => out.push('-'),
            '\u{2032}' => out.push('\''),
            '\\' => out.push_str("\\\\"),
            ' '..='~' => out.push(c),
            '\u{a0}'..='\u{ff}' => {
                let _ = write!(out, "\\{:03o}", c as u32);
            }
            'λ' => out.push_str("lambda"),
            _ => out.push('?'),
        }
    }
    out
}
