//! A drawing as a list of strokes and texts with a meaning (glass, a ray of the second field, the
//! axis).
//!
//! Each output, a file format or a window, defines how they look: see [`DrawingOutput`]. Positions
//! are x to the right and y down, in the units of the drawing.

/// The meaning of a stroke or a text.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Ink {
    /// The optical axis.
    Axis,
    /// A lens element; the number is how dense its glass is, 0 to 3.
    Glass(u8),
    /// The blades of the stop.
    Stop,
    /// The film.
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

/// The part of a text that is at its position.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Anchor {
    /// The left end.
    Start,
    /// The middle.
    Middle,
    /// The right end.
    End,
}

/// The style of letters.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Lettering {
    /// Upright letters of normal weight.
    Plain,
    /// Slanted letters, for symbols.
    Italic,
    /// Heavy letters, for headings.
    Bold,
}

/// A line through points.
#[derive(Clone, Debug, PartialEq)]
pub struct Path {
    /// The points in the order in which they are joined.
    pub points: Vec<[f64; 2]>,
    /// Whether the last point is joined to the first.
    pub closed: bool,
    /// The meaning of the line.
    pub ink: Ink,
    /// Whether the line is dashed.
    pub dashed: bool,
}

/// A line of text.
#[derive(Clone, Debug, PartialEq)]
pub struct DrawingText {
    /// The position of the anchor, at the lower edge of the letters.
    pub at: [f64; 2],
    /// The part of the text that is at its position.
    pub anchor: Anchor,
    /// The font size in units of the drawing.
    pub size: f64,
    /// The style of the letters.
    pub lettering: Lettering,
    /// The meaning of the text.
    pub ink: Ink,
    /// The characters.
    pub words: String,
}

/// A piece of a drawing.
#[derive(Clone, Debug, PartialEq)]
pub enum DrawingItem {
    /// A line through points.
    Path(Path),
    /// A filled circle.
    Dot {
        /// The center.
        at: [f64; 2],
        /// The radius in units of the drawing.
        radius: f64,
        /// The meaning of the dot.
        ink: Ink,
    },
    /// Many small dots of one kind.
    Dots {
        /// The centers.
        places: Vec<[f64; 2]>,
        /// The radius of each dot in units of the drawing.
        radius: f64,
        /// The meaning of the dots.
        ink: Ink,
    },
    /// A small cross, where a ray is lost.
    Cross {
        /// The center.
        at: [f64; 2],
        /// Half of the width and of the height, in units of the drawing.
        size: f64,
        /// The meaning of the cross.
        ink: Ink,
    },
    /// A line of text.
    Text(DrawingText),
}

/// A target for drawings, which defines how every ink looks.
pub trait DrawingOutput {
    /// Draws a line through points.
    fn path(&mut self, path: &Path);
    /// Draws a filled circle about a center, with a radius in units of the drawing.
    fn dot(&mut self, at: [f64; 2], radius: f64, ink: Ink);
    /// Draws filled circles about several centers, with one radius in units of the drawing.
    fn dots(&mut self, places: &[[f64; 2]], radius: f64, ink: Ink);
    /// Draws a diagonal cross about a center. `size` is half of its width, in units of the drawing.
    fn cross(&mut self, at: [f64; 2], size: f64, ink: Ink);
    /// Draws a line of text.
    fn text(&mut self, text: &DrawingText);
}

/// A drawing of a width and a height.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Drawing {
    /// The width in units of the drawing.
    pub width: f64,
    /// The height in units of the drawing.
    pub height: f64,
    /// The pieces in the order in which they are drawn.
    pub items: Vec<DrawingItem>,
}

impl DrawingItem {
    fn shift(&mut self, [x, y]: [f64; 2]) {
        let places = match self {
            DrawingItem::Path(path) => path.points.as_mut_slice(),
            DrawingItem::Dots { places, .. } => places.as_mut_slice(),
            DrawingItem::Text(text) => std::slice::from_mut(&mut text.at),
            DrawingItem::Dot { at, .. } | DrawingItem::Cross { at, .. } => std::slice::from_mut(at),
        };
        for place in places {
            *place = [place[0] + x, place[1] + y];
        }
    }
}

impl Drawing {
    /// Returns an empty drawing.
    pub fn new(width: f64, height: f64) -> Self {
        Self {
            width,
            height,
            items: Vec::new(),
        }
    }

    /// Draws all items, in their order.
    pub fn draw(&self, output: &mut dyn DrawingOutput) {
        for item in &self.items {
            match item {
                DrawingItem::Path(path) => output.path(path),
                DrawingItem::Dot { at, radius, ink } => output.dot(*at, *radius, *ink),
                DrawingItem::Dots {
                    places,
                    radius,
                    ink,
                } => output.dots(places, *radius, *ink),
                DrawingItem::Cross { at, size, ink } => output.cross(*at, *size, *ink),
                DrawingItem::Text(text) => output.text(text),
            }
        }
    }

    /// Adds a straight line.
    pub(crate) fn line(&mut self, from: [f64; 2], to: [f64; 2], ink: Ink) {
        self.path(vec![from, to], ink);
    }

    /// Adds an open path.
    pub(crate) fn path(&mut self, points: Vec<[f64; 2]>, ink: Ink) {
        self.curve(points, ink, false);
    }

    /// Adds a path that may be dashed.
    pub(crate) fn curve(&mut self, points: Vec<[f64; 2]>, ink: Ink, dashed: bool) {
        self.items.push(DrawingItem::Path(Path {
            points,
            closed: false,
            ink,
            dashed,
        }));
    }

    /// Adds a closed path.
    pub(crate) fn shape(&mut self, points: Vec<[f64; 2]>, ink: Ink) {
        self.items.push(DrawingItem::Path(Path {
            points,
            closed: true,
            ink,
            dashed: false,
        }));
    }

    /// Adds a text in the color of labels.
    pub fn text(&mut self, at: [f64; 2], anchor: Anchor, size: f64, words: impl Into<String>) {
        self.letters(at, anchor, size, (Lettering::Plain, Ink::Label), words);
    }

    /// Adds a symbol in italics.
    pub(crate) fn symbol(
        &mut self,
        at: [f64; 2],
        anchor: Anchor,
        size: f64,
        words: impl Into<String>,
    ) {
        self.letters(at, anchor, size, (Lettering::Italic, Ink::Label), words);
    }

    /// Adds a text in the faint color.
    pub(crate) fn note(
        &mut self,
        at: [f64; 2],
        anchor: Anchor,
        size: f64,
        words: impl Into<String>,
    ) {
        self.letters(at, anchor, size, (Lettering::Plain, Ink::Faint), words);
    }

    /// Adds a bold text.
    pub(crate) fn heading(&mut self, at: [f64; 2], size: f64, words: impl Into<String>) {
        let look = (Lettering::Bold, Ink::Label);
        self.letters(at, Anchor::Start, size, look, words);
    }

    /// Adds a heading with a note on its line, as far behind it as DejaVu Sans needs,
    /// the widest of the usual sans-serif fonts.
    pub(crate) fn heading_with_note(
        &mut self,
        [x, y]: [f64; 2],
        words: &str,
        note: impl Into<String>,
    ) {
        self.heading([x, y], 11.5, words);
        let width = 7.4 * words.chars().count() as f64;
        self.note([x + width + 10.0, y], Anchor::Start, 9.0, note);
    }

    fn letters(
        &mut self,
        at: [f64; 2],
        anchor: Anchor,
        size: f64,
        (lettering, ink): (Lettering, Ink),
        words: impl Into<String>,
    ) {
        self.items.push(DrawingItem::Text(DrawingText {
            at,
            anchor,
            size,
            lettering,
            ink,
            words: words.into(),
        }));
    }

    /// Adds another drawing with its corner at a position.
    pub fn put(&mut self, other: Drawing, by: [f64; 2]) {
        for mut item in other.items {
            item.shift(by);
            self.items.push(item);
        }
    }
}
