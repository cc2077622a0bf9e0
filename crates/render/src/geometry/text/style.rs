//! The styles of text: the fields of Inventor's and VRML97's nodes.

use super::face::Face;

/// The justification of a line in Inventor.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Justify {
    /// Lines begin at x = 0.
    Left,
    /// Lines end at x = 0.
    Right,
    /// Lines are centered at x = 0.
    Center,
}

/// The style of a text of Inventor or VRML 1.0.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct TextStyle<'a> {
    /// The typeface.
    pub face: Face<'a>,
    /// The font's size, which is the distance between baselines at spacing 1.
    pub size: f32,
    /// The distance between baselines as a multiple of the size.
    pub spacing: f32,
    /// The justification of lines.
    pub justify: Justify,
    /// Inventor's complexity from 0 to 1, which determines how finely curves are flattened.
    pub complexity: f32,
}

/// The justification along one axis in VRML97.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Align {
    /// The text begins at the origin.
    Begin,
    /// The first line has its baseline at the origin.
    First,
    /// The text is centered at the origin.
    Middle,
    /// The text ends at the origin.
    End,
}

impl Align {
    /// Returns the justification with a name, or `None` for an unknown name.
    pub(crate) fn named(name: &str) -> Option<Self> {
        match name {
            "BEGIN" => Some(Self::Begin),
            "FIRST" => Some(Self::First),
            "MIDDLE" => Some(Self::Middle),
            "END" => Some(Self::End),
            _ => None,
        }
    }
}

/// The style of a VRML97 text: the fields of its `FontStyle`.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Vrml97Style<'a> {
    /// The typeface.
    pub face: Face<'a>,
    /// The font's size.
    pub size: f32,
    /// The distance between lines as a multiple of the size.
    pub spacing: f32,
    /// Whether lines are horizontal.
    pub horizontal: bool,
    /// Whether text advances to the right.
    pub left_to_right: bool,
    /// Whether text advances downward.
    pub top_to_bottom: bool,
    /// The justification along the lines.
    pub(crate) major: Align,
    /// The justification across the lines.
    pub(crate) minor: Align,
    /// Inventor's complexity from 0 to 1.
    pub complexity: f32,
}

impl Vrml97Style<'_> {
    /// The style of a text without a `FontStyle`.
    pub(crate) const DEFAULT: Self = Self {
        face: Face::DEFAULT,
        size: 1.0,
        spacing: 1.0,
        horizontal: true,
        left_to_right: true,
        top_to_bottom: true,
        major: Align::Begin,
        minor: Align::First,
        complexity: 0.5,
    };

    /// Sets the major and minor justification from the field `justify`. A missing or unknown major
    /// string means `BEGIN`, and a missing or unknown minor one `FIRST`.
    pub(crate) fn justified<S: AsRef<str>>(mut self, justify: &[S]) -> Self {
        let named = |i: usize| justify.get(i).and_then(|s| Align::named(s.as_ref()));
        self.major = named(0).unwrap_or(Align::Begin);
        self.minor = named(1).unwrap_or(Align::First);
        self
    }
}
