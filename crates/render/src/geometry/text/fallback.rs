//! The shipped typefaces for characters that the twelve of `face` lack.
//!
//! They are packed (`crates/measure/text_faces.py` makes them), and are unpacked at the first text
//! that needs one.

use std::io::Read;
use std::sync::OnceLock;

use skrifa::FontRef;

use super::face::Family;

/// A font file that is packed with gzip.
struct PackedFont {
    packed: &'static [u8],
    /// The font; empty if it cannot be unpacked.
    unpacked: OnceLock<Vec<u8>>,
}

impl PackedFont {
    const fn new(packed: &'static [u8]) -> Self {
        let unpacked = OnceLock::new();
        Self { packed, unpacked }
    }

    /// Opens the typeface.
    fn open(&'static self) -> Option<FontRef<'static>> {
        let bytes = self.unpacked.get_or_init(|| {
            let mut bytes = Vec::new();
            let read = flate2::read::GzDecoder::new(self.packed).read_to_end(&mut bytes);
            read.map_or(Vec::new(), |_| bytes)
        });
        FontRef::new(bytes).ok()
    }
}

macro_rules! packed {
    ($name:literal) => {
        PackedFont::new(include_bytes!(concat!("fonts/", $name, ".gz")))
    };
}

/// The other Latin letters of the twelve typefaces: regular, bold, italic and bold italic of each
/// family.
static LATIN: [[PackedFont; 4]; 3] = [
    [
        packed!("serif-latin.otf"),
        packed!("serif-bold-latin.otf"),
        packed!("serif-italic-latin.otf"),
        packed!("serif-bold-italic-latin.otf"),
    ],
    [
        packed!("sans-latin.otf"),
        packed!("sans-bold-latin.otf"),
        packed!("sans-italic-latin.otf"),
        packed!("sans-bold-italic-latin.otf"),
    ],
    [
        packed!("mono-latin.otf"),
        packed!("mono-bold-latin.otf"),
        packed!("mono-italic-latin.otf"),
        packed!("mono-bold-italic-latin.otf"),
    ],
];

static SERIF: PackedFont = packed!("serif-other.ttf");
static SERIF_BOLD: PackedFont = packed!("serif-bold-other.ttf");
static SANS_BOLD: PackedFont = packed!("sans-bold-other.ttf");
static MONO: PackedFont = packed!("mono-other.ttf");
static ANY: PackedFont = packed!("any-other.ttf");

/// Opens the other Latin letters of a shipped typeface.
pub(super) fn latin(family: Family, bold: bool, italic: bool) -> Option<FontRef<'static>> {
    let styles = &LATIN[match family {
        Family::Serif => 0,
        Family::Sans => 1,
        Family::Mono => 2,
    }];
    styles[usize::from(bold) + 2 * usize::from(italic)].open()
}

/// Opens the Greek and Cyrillic letters in the style of a family, or returns `None` if `any` has
/// them.
pub(super) fn greek_and_cyrillic(family: Family, bold: bool) -> Option<FontRef<'static>> {
    match (family, bold) {
        (Family::Serif, false) => SERIF.open(),
        (Family::Serif, true) => SERIF_BOLD.open(),
        (Family::Sans, false) => None,
        (Family::Sans, true) => SANS_BOLD.open(),
        (Family::Mono, _) => MONO.open(),
    }
}

/// Opens the typeface with every other character that is shipped.
pub(super) fn any() -> Option<FontRef<'static>> {
    ANY.open()
}

/// Returns the size of the glyphs of these typefaces beside those of a family. Their capitals are
/// 0.729 of the font's size high, those of Times 0.662 and those of Helvetica 0.729. Those of
/// Courier are lower, but its letters are as wide.
pub(super) fn scale(family: Family) -> f32 {
    match family {
        Family::Serif => 0.9,
        Family::Sans | Family::Mono => 1.0,
    }
}
