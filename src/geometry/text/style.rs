//! How a text is set: the fields of Inventor's and VRML97's font styles as values.

use super::face::Face;

/// Inventor's justification of a line.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Justify {
    Left,
    Right,
    Center,
}

/// How a text of Inventor or VRML 1.0 is set.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct TextStyle<'a> {
    pub face: Face<'a>,
    /// The font's size, which is the distance between baselines at spacing 1.
    pub size: f32,
    pub spacing: f32,
    pub justify: Justify,
    /// Inventor's complexity from 0 to 1, which says how finely curves are flattened.
    pub complexity: f32,
}

/// VRML97's justification along one axis.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Align {
    Begin,
    First,
    Middle,
    End,
}

impl Align {
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

/// How a VRML97 text is set: the fields of its `FontStyle`.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Vrml97Style<'a> {
    pub face: Face<'a>,
    pub size: f32,
    pub spacing: f32,
    pub horizontal: bool,
    pub left_to_right: bool,
    pub top_to_bottom: bool,
    pub major: Align,
    pub minor: Align,
    pub complexity: f32,
}

impl Vrml97Style<'_> {
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

    /// Sets the major and minor justification from the field `justify`. An empty major string means
    /// `BEGIN`, and a missing minor one `FIRST`.
    pub(crate) fn justified<S: AsRef<str>>(mut self, justify: &[S]) -> Self {
        let named = |i: usize| justify.get(i).and_then(|s| Align::named(s.as_ref()));
        self.major = named(0).unwrap_or(Align::Begin);
        self.minor = named(1).unwrap_or(Align::First);
        self
    }
}
