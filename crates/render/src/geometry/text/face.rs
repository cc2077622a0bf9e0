//! The shipped typefaces and the font names for which they are used.

use skrifa::FontRef;

use super::library::{Fonts, UserFont};

/// The families of the shipped typefaces.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Family {
    /// The family with the metrics of Times.
    Serif,
    /// The family with the metrics of Helvetica.
    Sans,
    /// The family with the metrics of Courier.
    Mono,
}

/// The name by which the user's fonts are searched for [`Family::Serif`].
const SERIF_NAME: &str = "Times";
/// The name by which the user's fonts are searched for [`Family::Sans`].
const SANS_NAME: &str = "Helvetica";
/// The name by which the user's fonts are searched for [`Family::Mono`].
const MONO_NAME: &str = "Courier";

/// The typeface to draw with.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Face<'a> {
    /// The shipped family.
    pub family: Family,
    /// Whether the style is bold.
    pub bold: bool,
    /// Whether the style is italic or oblique.
    pub italic: bool,
    /// Whether glyphs are laid out like those of Coin's built-in font, which it uses for a text
    /// without a font. It is Times at 10/9 of the size in the file, with each glyph spaced by its
    /// outline (measured).
    pub built_in: bool,
    /// The user's typeface that replaces the shipped one, if any.
    pub own: Option<UserFont<'a>>,
    /// The user's typefaces, which are searched for characters that this one lacks.
    pub fonts: Option<&'a Fonts>,
}

impl<'a> Face<'a> {
    /// The typeface of a text without a font.
    pub const DEFAULT: Self = Self {
        family: Family::Serif,
        bold: false,
        italic: false,
        built_in: true,
        own: None,
        fonts: None,
    };

    /// Returns the typeface with others of the user for characters that it lacks.
    pub(crate) fn with_fonts(self, fonts: &'a Fonts) -> Self {
        let fonts = Some(fonts);
        Self { fonts, ..self }
    }

    /// Returns the size of the glyphs relative to the size in the file.
    pub(super) fn scale(self) -> f32 {
        if self.built_in { 10.0 / 9.0 } else { 1.0 }
    }

    /// Returns a shipped typeface.
    pub(super) fn plain(family: Family, bold: bool, italic: bool) -> Self {
        Self {
            family,
            bold,
            italic,
            built_in: false,
            own: None,
            fonts: None,
        }
    }

    /// Returns the shipped typeface for the name in an Inventor `Font` (`Times-Roman`,
    /// `Helvetica:Bold Italic`, …). An unknown name gets the serif family, as in SGI's library,
    /// whose fallback was the serif font Utopia.
    pub(crate) fn named(name: &str) -> Self {
        let name = name.to_ascii_lowercase();
        if name.is_empty() || name.starts_with("defaultfont") {
            return Self::DEFAULT;
        }
        let has = |words: &[&str]| words.iter().any(|w| name.contains(w));
        const MONO: &[&str] = &[
            "courier",
            "mono",
            "typewriter",
            "fixed",
            "terminal",
            "screen",
            "console",
            "consolas",
        ];
        const SANS: &[&str] = &[
            "helvetica",
            "arial",
            "sans",
            "univers",
            "futura",
            "verdana",
            "tahoma",
            "geneva",
            "avantgarde",
            "swiss",
            "gothic",
            "frutiger",
            "lucida",
            "haeberli",
            "iris",
            "rock",
        ];
        let family = if has(MONO) {
            Family::Mono
        } else if has(SANS) {
            Family::Sans
        } else {
            Family::Serif
        };
        let bold = has(&["bold", "black", "heavy", "demi"]);
        Self::plain(family, bold, has(&["italic", "oblique", "slanted"]))
    }

    /// Returns the user's typeface for the name in an Inventor `Font`, or else that of
    /// [`Face::named`].
    pub(crate) fn named_of(name: &str, fonts: &'a Fonts) -> Self {
        let shipped = Self::named(name).with_fonts(fonts);
        if shipped.built_in {
            return shipped;
        }
        shipped.or_own(name, fonts)
    }

    /// Replaces the shipped typeface by the user's with a name, if there is one.
    fn or_own(self, name: &str, fonts: &'a Fonts) -> Self {
        let own = fonts.find(name, self.bold, self.italic);
        Self { own, ..self }.with_fonts(fonts)
    }

    /// Returns the user's typeface of a family, or else the shipped one.
    pub(crate) fn of_family(family: Family, bold: bool, italic: bool, fonts: &'a Fonts) -> Self {
        let name = match family {
            Family::Serif => SERIF_NAME,
            Family::Sans => SANS_NAME,
            Family::Mono => MONO_NAME,
        };
        Self::plain(family, bold, italic).or_own(name, fonts)
    }

    /// Returns the typeface for a VRML97 `FontStyle`: that of the first family that is standard or
    /// that the user has. The shipped serif family, which is the default, is laid out like the
    /// built-in font.
    pub(crate) fn of_vrml97<S: AsRef<str>>(families: &[S], style: &str, fonts: &'a Fonts) -> Self {
        let (bold, italic) = (style.contains("BOLD"), style.contains("ITALIC"));
        let of = |family: Family, own: Option<UserFont<'a>>| Self {
            built_in: family == Family::Serif && own.is_none(),
            own,
            ..Self::plain(family, bold, italic).with_fonts(fonts)
        };
        let known = families.iter().find_map(|f| match f.as_ref() {
            "SERIF" => Some(of(Family::Serif, None)),
            "SANS" => Some(of(Family::Sans, fonts.find(SANS_NAME, bold, italic))),
            "TYPEWRITER" => Some(of(Family::Mono, fonts.find(MONO_NAME, bold, italic))),
            name => {
                let own = fonts.find(name, bold, italic);
                own.map(|own| of(Self::named(name).family, Some(own)))
            }
        });
        known.unwrap_or_else(|| match families.first() {
            Some(name) => of(Self::named(name.as_ref()).family, None),
            None => of(Family::Serif, None),
        })
    }

    /// Opens the typeface.
    pub(super) fn font(self) -> Option<FontRef<'a>> {
        match self.own {
            Some(own) => own.open(),
            None => FontRef::new(self.bytes()).ok(),
        }
    }

    /// The file of the shipped typeface.
    fn bytes(self) -> &'static [u8] {
        macro_rules! font {
            ($name:literal) => {
                include_bytes!(concat!("fonts/", $name, ".otf"))
            };
        }
        match (self.family, self.bold, self.italic) {
            (Family::Serif, false, false) => font!("serif"),
            (Family::Serif, true, false) => font!("serif-bold"),
            (Family::Serif, false, true) => font!("serif-italic"),
            (Family::Serif, true, true) => font!("serif-bold-italic"),
            (Family::Sans, false, false) => font!("sans"),
            (Family::Sans, true, false) => font!("sans-bold"),
            (Family::Sans, false, true) => font!("sans-italic"),
            (Family::Sans, true, true) => font!("sans-bold-italic"),
            (Family::Mono, false, false) => font!("mono"),
            (Family::Mono, true, false) => font!("mono-bold"),
            (Family::Mono, false, true) => font!("mono-italic"),
            (Family::Mono, true, true) => font!("mono-bold-italic"),
        }
    }
}
