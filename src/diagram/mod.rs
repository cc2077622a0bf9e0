//! Lens sections and ray paths, and the data sheet of a lens, as SVG or xfig.
//!
//! A drawing is a list of strokes and words with a meaning (glass, a ray of the second field, the
//! axis); how they look is decided once, where they are written out. Nothing here computes
//! optics: `lens::sheet` does.

mod chart;
mod fig;
mod page;
mod section;
mod svg;

pub use page::{html_page, svg_page};
pub use section::{LensDiagram, SectionOptions};

/// What a stroke or a word is.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Ink {
    /// The optical axis.
    Axis,
    /// A lens element; the number is how dense its glass is, 0 to 3.
    Glass(u8),
    /// The blades of the stop.
    Stop,
    Film,
    /// A ray of a field, counted from the axis.
    Ray(u8),
    /// A ray that is lost.
    Lost(u8),
    /// A principal plane or a pupil.
    Plane,
    /// A focal point.
    Mark,
    /// Lettering.
    Label,
    /// Scales, ticks and grids.
    Faint,
    /// A curve of a chart, by number.
    Curve(u8),
}

/// Where a word stands on its place.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Anchor {
    Start,
    Middle,
    End,
}

/// A piece of a drawing. Places are x to the right and y down, in the units of the drawing.
#[derive(Clone, Debug, PartialEq)]
pub enum Item {
    Path {
        points: Vec<[f64; 2]>,
        closed: bool,
        ink: Ink,
        dashed: bool,
    },
    Dot {
        at: [f64; 2],
        radius: f64,
        ink: Ink,
    },
    /// Many small dots of one kind.
    Dots {
        places: Vec<[f64; 2]>,
        radius: f64,
        ink: Ink,
    },
    /// A small cross: where a ray is lost.
    Cross {
        at: [f64; 2],
        size: f64,
        ink: Ink,
    },
    Text {
        at: [f64; 2],
        anchor: Anchor,
        size: f64,
        italic: bool,
        bold: bool,
        ink: Ink,
        text: String,
    },
}

/// A drawing of a width and a height.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Drawing {
    pub width: f64,
    pub height: f64,
    pub items: Vec<Item>,
}

impl Item {
    fn shift(&mut self, [x, y]: [f64; 2]) {
        let places = match self {
            Item::Path { points, .. } => points.as_mut_slice(),
            Item::Dots { places, .. } => places.as_mut_slice(),
            Item::Dot { at, .. } | Item::Cross { at, .. } | Item::Text { at, .. } => {
                std::slice::from_mut(at)
            }
        };
        for place in places {
            *place = [place[0] + x, place[1] + y];
        }
    }
}

impl Drawing {
    pub fn new(width: f64, height: f64) -> Self {
        Self {
            width,
            height,
            items: Vec::new(),
        }
    }

    pub fn line(&mut self, from: [f64; 2], to: [f64; 2], ink: Ink) {
        self.path(vec![from, to], ink);
    }

    pub fn path(&mut self, points: Vec<[f64; 2]>, ink: Ink) {
        self.items.push(Item::Path {
            points,
            closed: false,
            ink,
            dashed: false,
        });
    }

    pub fn dashed(&mut self, points: Vec<[f64; 2]>, ink: Ink) {
        self.items.push(Item::Path {
            points,
            closed: false,
            ink,
            dashed: true,
        });
    }

    pub fn shape(&mut self, points: Vec<[f64; 2]>, ink: Ink) {
        self.items.push(Item::Path {
            points,
            closed: true,
            ink,
            dashed: false,
        });
    }

    pub fn text(&mut self, at: [f64; 2], anchor: Anchor, size: f64, text: impl Into<String>) {
        self.items.push(Item::Text {
            at,
            anchor,
            size,
            italic: false,
            bold: false,
            ink: Ink::Label,
            text: text.into(),
        });
    }

    /// A symbol, in italics.
    pub fn symbol(&mut self, at: [f64; 2], anchor: Anchor, size: f64, text: impl Into<String>) {
        self.items.push(Item::Text {
            at,
            anchor,
            size,
            italic: true,
            bold: false,
            ink: Ink::Label,
            text: text.into(),
        });
    }

    /// Secondary lettering.
    pub fn note(&mut self, at: [f64; 2], anchor: Anchor, size: f64, text: impl Into<String>) {
        self.items.push(Item::Text {
            at,
            anchor,
            size,
            italic: false,
            bold: false,
            ink: Ink::Faint,
            text: text.into(),
        });
    }

    pub fn heading(&mut self, at: [f64; 2], size: f64, text: impl Into<String>) {
        self.items.push(Item::Text {
            at,
            anchor: Anchor::Start,
            size,
            italic: false,
            bold: true,
            ink: Ink::Label,
            text: text.into(),
        });
    }

    /// Puts another drawing into this one, its corner at a place.
    pub fn put(&mut self, other: Drawing, by: [f64; 2]) {
        for mut item in other.items {
            item.shift(by);
            self.items.push(item);
        }
    }

    pub fn to_svg(&self) -> String {
        svg::write(self)
    }

    pub fn to_fig(&self) -> String {
        fig::write(self)
    }
}

/// A round number of about a size: 1, 2 or 5 times a power of ten.
pub(crate) fn round_number(size: f64) -> f64 {
    if !(size > 0.0 && size.is_finite()) {
        return 1.0;
    }
    let power = libm::pow(10.0, libm::floor(libm::log10(size)));
    let lead = size / power;
    power
        * match lead {
            l if l < 1.5 => 1.0,
            l if l < 3.5 => 2.0,
            l if l < 7.5 => 5.0,
            _ => 10.0,
        }
}

/// A number with as many places as a step needs, with a real minus sign.
pub(crate) fn tidy(value: f64, step: f64) -> String {
    if value.is_infinite() {
        return "\u{221e}".to_owned();
    }
    let places = (-libm::floor(libm::log10(step.abs().max(1e-12)) + 1e-9)).clamp(0.0, 9.0) as usize;
    let text = format!("{value:.places$}");
    let zero = text
        .trim_start_matches('-')
        .chars()
        .all(|c| c == '0' || c == '.');
    match text.strip_prefix('-') {
        Some(rest) if !zero => format!("\u{2212}{rest}"),
        Some(rest) => rest.to_owned(),
        None => text,
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn numbers_on_scales_are_round() {
        assert_eq!(round_number(0.0123), 0.01);
        assert_eq!(round_number(37.0), 50.0);
        assert_eq!(round_number(2.2e3), 2e3);
        assert_eq!(tidy(-0.5, 0.25), "\u{2212}0.5");
        assert_eq!(tidy(-0.04, 0.1), "0.0");
        assert_eq!(tidy(20.0, 10.0), "20");
    }
}
