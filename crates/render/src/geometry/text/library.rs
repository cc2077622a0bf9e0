//! Finds the user's own fonts by the names that scene files use.
//!
//! Only the shipped typefaces give the same picture on every machine, so no folder is searched
//! unless the user names it. A name is searched for unchanged, then as a family with a style, then
//! among the typefaces that replace the old ones (`STAND_INS`). The folders are read once for the
//! names of their fonts; glyphs are read from the files that a scene needs. The characters of all
//! fonts are listed when a text first has one that its own typeface lacks.
//!
//! Bitmap fonts and PostScript Type 1 (`.pfb`) are not supported. Variable fonts are drawn with
//! their default settings.

use std::borrow::Cow;
use std::fmt;
use std::path::{Path, PathBuf};
use std::sync::OnceLock;

use ivcam_base::diag::{Diagnostic, Result};
use ivcam_base::files::read_file;
use skrifa::attribute::Style;
use skrifa::raw::FileRef;
use skrifa::string::StringId;
use skrifa::{FontRef, GlyphId, MetadataProvider};

/// The extensions of font files.
const ENDINGS: [&str; 4] = ["otf", "ttf", "ttc", "otc"];

/// The largest number of files that are read. Like the two limits below it is far larger than in
/// any font folder, and stops a search in the wrong folder.
const MAX_FILES: usize = 10_000;
/// The largest size of a font file in bytes.
const MAX_BYTES: usize = 256 << 20;
/// The largest depth of folders below the one that the user names.
const MAX_DEPTH: usize = 16;

/// The normalized names of typefaces, and the typefaces with the same metrics. The first one that
/// is installed is used. The order is URW's current fonts, URW's older fonts, TeX Gyre, Liberation.
const STAND_INS: [(&[&str], &[&str]); 9] = [
    (
        &["times", "timesroman", "timesnewroman", "timesnewromanps"],
        &[
            "nimbusroman",
            "nimbusromanno9l",
            "texgyretermes",
            "liberationserif",
        ],
    ),
    (
        &["helvetica", "arial"],
        &[
            "nimbussans",
            "nimbussansl",
            "texgyreheros",
            "liberationsans",
        ],
    ),
    (
        &["courier", "couriernew"],
        &[
            "nimbusmonops",
            "nimbusmonol",
            "texgyrecursor",
            "liberationmono",
        ],
    ),
    (
        &["helveticanarrow", "arialnarrow"],
        &["nimbussansnarrow", "nimbussanslcondensed", "texgyreheroscn"],
    ),
    (
        &["palatino", "palatinoroman", "palatinolinotype"],
        &["p052", "urwpalladiol", "texgyrepagella"],
    ),
    (
        &["bookman", "itcbookman"],
        &["urwbookman", "urwbookmanl", "texgyrebonum"],
    ),
    (
        &["avantgarde", "itcavantgardegothic"],
        &["urwgothic", "urwgothicl", "texgyreadventor"],
    ),
    (
        &[
            "newcenturyschlbk",
            "newcenturyschoolbook",
            "centuryschoolbook",
        ],
        &["c059", "centuryschoolbookl", "texgyreschola"],
    ),
    (
        &["zapfchancery", "itczapfchancery"],
        &["z003", "urwchanceryl", "texgyrechorus"],
    ),
];

/// A typeface of the user: the bytes of its file, and its index in the file.
#[derive(Clone, Copy, PartialEq)]
pub struct UserFont<'a> {
    bytes: &'a [u8],
    index: u32,
}

impl<'a> UserFont<'a> {
    /// Opens the typeface, or returns `None` if its file is damaged.
    pub(super) fn open(self) -> Option<FontRef<'a>> {
        FontRef::from_index(self.bytes, self.index).ok()
    }
}

impl fmt::Debug for UserFont<'_> {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "UserFont({} bytes, {})", self.bytes.len(), self.index)
    }
}

/// The typefaces in some folders and their subfolders.
#[derive(Debug, Default)]
pub struct Fonts {
    folders: Vec<PathBuf>,
    files: Vec<File>,
    faces: Vec<FaceEntry>,
    /// Warnings about font files that could not be read, and about folders without fonts.
    pub warnings: Vec<Box<Diagnostic>>,
}

/// Two libraries are equal if their folders have the same paths; the files are not compared.
impl PartialEq for Fonts {
    fn eq(&self, other: &Self) -> bool {
        self.folders == other.folders
    }
}

#[derive(Debug)]
struct File {
    path: PathBuf,
    /// The contents, read when a scene first needs the file; empty if that failed.
    bytes: OnceLock<Vec<u8>>,
}

/// A typeface's names, as [`normalized`] returns them, and its style.
#[derive(Debug)]
struct FaceEntry {
    file: usize,
    index: u32,
    /// The legacy name of the family, and the typographic one without the style.
    families: Vec<String>,
    /// The full name and the PostScript name.
    whole: Vec<String>,
    /// The weight from 1 to 1000; 400 is regular and 700 is bold.
    weight: f32,
    italic: bool,
    /// The characters that it has, listed when they are first asked for.
    characters: OnceLock<CharacterRanges>,
}

/// A set of characters as ranges, in order and with both ends included.
#[derive(Debug, Default)]
struct CharacterRanges(Vec<(u32, u32)>);

impl CharacterRanges {
    /// Returns the characters of a typeface.
    fn of(font: &FontRef<'_>) -> Self {
        let mappings = font.charmap().mappings();
        let mapped = mappings.filter(|(_, glyph)| *glyph != GlyphId::NOTDEF);
        let mut characters: Vec<u32> = mapped.map(|(character, _)| character).collect();
        characters.sort_unstable();
        let mut ranges: Vec<(u32, u32)> = Vec::new();
        for character in characters {
            match ranges.last_mut() {
                Some((_, last)) if character <= *last + 1 => *last = character,
                _ => ranges.push((character, character)),
            }
        }
        ranges.shrink_to_fit();
        Self(ranges)
    }

    fn contains(&self, character: char) -> bool {
        let character = u32::from(character);
        let after = self.0.partition_point(|(first, _)| *first <= character);
        after > 0 && character <= self.0[after - 1].1
    }
}

impl Fonts {
    /// Reads the names of all fonts in the folders and their subfolders. Fonts of earlier folders
    /// are preferred.
    ///
    /// # Errors
    /// Returns a diagnostic if a folder does not exist or cannot be read. A file that is not a font
    /// only adds a warning to `warnings`.
    pub fn open<P: AsRef<Path>>(folders: &[P]) -> Result<Self> {
        let mut out = Self::default();
        for folder in folders {
            let folder = folder.as_ref();
            let mut paths = Vec::new();
            walk(folder, 0, &mut paths).map_err(|error| {
                Diagnostic::io(folder.display(), &error)
                    .with_help("`--fonts` takes a folder with .otf, .ttf or .ttc files below it")
            })?;
            let before = out.faces.len();
            for path in paths {
                if let Err(warning) = out.add(path) {
                    out.warnings.push(warning);
                }
            }
            if out.faces.len() == before {
                let name = folder.display();
                let message = format!("there are no fonts below `{name}`");
                out.warnings.push(
                    Diagnostic::warning(message)
                        .with_help("`.otf`, `.ttf` and `.ttc` files are read"),
                );
            }
            out.folders.push(folder.to_path_buf());
        }
        Ok(out)
    }

    /// The folders that were searched.
    pub fn folders(&self) -> &[PathBuf] {
        &self.folders
    }

    /// Adds the typefaces of a file.
    fn add(&mut self, path: PathBuf) -> Result<()> {
        let name = path.display().to_string();
        let warning = |why: &str| {
            Diagnostic::warning(format!("`{name}`: {why}; it is left out")).in_file(name.clone())
        };
        let about = path.metadata().map_err(|_| warning("cannot be read"))?;
        if !about.is_file() {
            return Err(warning("is not a regular file"));
        }
        if about.len() > MAX_BYTES as u64 {
            return Err(warning("is larger than 256 MB"));
        }
        let bytes = read_file(&path, MAX_BYTES).map_err(|_| warning("cannot be read"))?;
        self.add_faces(path, &bytes).map_err(warning)
    }

    /// Adds the typefaces of a file with these contents. The error says what is wrong with them.
    fn add_faces(&mut self, path: PathBuf, bytes: &[u8]) -> std::result::Result<(), &'static str> {
        let file = FileRef::new(bytes).map_err(|_| "is not a font, or is damaged")?;
        let before = self.faces.len();
        for (index, font) in file.fonts().enumerate() {
            let font = font.map_err(|_| "is damaged")?;
            if font.charmap().has_map() && font.outline_glyphs().format().is_some() {
                let entry = FaceEntry::of(&font, self.files.len(), index as u32);
                self.faces.push(entry);
            }
        }
        if self.faces.len() == before {
            return Err("has no glyph outlines");
        }
        let bytes = OnceLock::new();
        self.files.push(File { path, bytes });
        Ok(())
    }

    /// Returns the typefaces in a font file's contents, for tests of hostile files.
    pub fn of_bytes(bytes: &[u8]) -> Self {
        let mut fonts = Self::default();
        if fonts.add_faces(PathBuf::new(), bytes).is_ok() {
            let file = fonts
                .files
                .last()
                .map(|file| file.bytes.set(bytes.to_vec()));
            debug_assert_eq!(file, Some(Ok(())), "nobody has read the file");
        }
        fonts
    }

    /// Returns all typefaces.
    pub fn all(&self) -> impl Iterator<Item = UserFont<'_>> {
        self.faces.iter().map(|face| UserFont {
            bytes: self.files[face.file].bytes.get().map_or(&[], Vec::as_slice),
            index: face.index,
        })
    }

    /// Returns whether there is a typeface for a name in a scene file.
    pub fn has(&self, name: &str) -> bool {
        self.find(name, false, false).is_some()
    }

    /// Returns the typeface for a name in a scene file, such as `Times-Roman` or `Helvetica:Bold`.
    pub(crate) fn find(&self, name: &str, bold: bool, italic: bool) -> Option<UserFont<'_>> {
        let whole = normalized(name);
        if self.faces.is_empty() || whole.is_empty() {
            return None;
        }
        let exact = self.faces.iter().find(|e| e.whole.contains(&whole));
        let entry = exact.or_else(|| {
            let candidates = [name, part(name, ':'), part(part(name, ':'), '-')];
            candidates
                .into_iter()
                .map(normalized)
                .chain([without_style(name)])
                .find_map(|family| self.family(&family, bold, italic))
        })?;
        let own = self.font(entry);
        own.open().map(|_| own)
    }

    /// Returns a typeface that has a character, whatever its name: that with the nearest style, and
    /// of several the first. The number is that of the typeface.
    pub(super) fn with_character(
        &self,
        character: char,
        bold: bool,
        italic: bool,
    ) -> Option<(usize, UserFont<'_>)> {
        let has = |e: &&FaceEntry| self.characters(e).contains(character);
        let nearest = nearest_style(self.faces.iter().filter(has), bold, italic)?;
        let number = self.faces.iter().position(|e| std::ptr::eq(e, nearest))?;
        Some((number, self.font(nearest)))
    }

    /// Returns the characters of a typeface. Its file is read, but not kept.
    fn characters<'f>(&self, entry: &'f FaceEntry) -> &'f CharacterRanges {
        entry.characters.get_or_init(|| {
            let file = &self.files[entry.file];
            let known = file.bytes.get().map(|bytes| (&bytes[..]).into());
            let bytes: Cow<'_, [u8]> = known
                .unwrap_or_else(|| read_file(&file.path, MAX_BYTES).unwrap_or_default().into());
            FontRef::from_index(&bytes, entry.index)
                .map_or_else(|_| CharacterRanges::default(), |f| CharacterRanges::of(&f))
        })
    }

    /// Returns a typeface with the contents of its file, which is kept.
    fn font(&self, entry: &FaceEntry) -> UserFont<'_> {
        let file = &self.files[entry.file];
        let read = || read_file(&file.path, MAX_BYTES).unwrap_or_default();
        UserFont {
            bytes: file.bytes.get_or_init(read),
            index: entry.index,
        }
    }

    /// Returns the typeface with the nearest style, of a family or of the families that replace it.
    fn family(&self, family: &str, bold: bool, italic: bool) -> Option<&FaceEntry> {
        let stand_ins = STAND_INS.iter().find(|(names, _)| names.contains(&family));
        let stand_ins = stand_ins.map_or(&[][..], |(_, stand_ins)| stand_ins);
        [family].iter().chain(stand_ins).find_map(|name| {
            let of_family = self.faces.iter().filter(|e| e.is_of(name));
            nearest_style(of_family, bold, italic)
        })
    }
}

/// Returns the first of the typefaces whose style is nearest to a wanted one.
fn nearest_style<'f>(
    entries: impl Iterator<Item = &'f FaceEntry>,
    bold: bool,
    italic: bool,
) -> Option<&'f FaceEntry> {
    let off = |e: &&FaceEntry| {
        let wanted = if bold { 700.0 } else { 400.0 };
        let turned = if e.italic == italic { 0.0 } else { 1e4 };
        turned + (e.weight - wanted).abs()
    };
    entries.min_by(|a, b| off(a).total_cmp(&off(b)))
}

impl FaceEntry {
    fn of(font: &FontRef<'_>, file: usize, index: u32) -> Self {
        let names = |ids: &[StringId]| {
            let string = |id: &StringId| {
                let string = font.localized_strings(*id).english_or_first()?;
                Some(normalized(&string.chars().collect::<String>()))
            };
            let names = ids.iter().filter_map(string);
            names.filter(|n| !n.is_empty()).collect::<Vec<_>>()
        };
        let attributes = font.attributes();
        Self {
            file,
            index,
            families: names(&[StringId::FAMILY_NAME, StringId::TYPOGRAPHIC_FAMILY_NAME]),
            whole: names(&[StringId::FULL_NAME, StringId::POSTSCRIPT_NAME]),
            weight: attributes.weight.value(),
            italic: attributes.style != Style::Normal,
            characters: OnceLock::new(),
        }
    }

    fn is_of(&self, family: &str) -> bool {
        self.families.iter().any(|f| f == family)
    }
}

/// Returns the letters and digits of a name, in lower case.
fn normalized(name: &str) -> String {
    let letters = name.chars().filter(|c| c.is_alphanumeric());
    letters.flat_map(char::to_lowercase).collect()
}

/// Returns the part of a name before a character.
fn part(name: &str, end: char) -> &str {
    name.split(end).next().unwrap_or_default()
}

/// Returns a normalized name without its style: `lucidabright` for `Lucida Bright Demi Bold`.
fn without_style(name: &str) -> String {
    const STYLES: [&str; 9] = [
        "bold", "demi", "italic", "oblique", "regular", "roman", "plain", "medium", "book",
    ];
    let words = name.split(|c: char| !c.is_alphanumeric());
    let family = words.filter(|w| !STYLES.contains(&w.to_lowercase().as_str()));
    normalized(&family.collect::<String>())
}

/// Collects every font file in a folder and its subfolders, in the order of names.
fn walk(folder: &Path, depth: usize, files: &mut Vec<PathBuf>) -> std::io::Result<()> {
    let entries = std::fs::read_dir(folder)?;
    let mut paths: Vec<PathBuf> = entries.flatten().map(|e| e.path()).collect();
    paths.sort();
    for path in paths {
        let is_font = path.extension().is_some_and(|e| {
            let ending = e.to_string_lossy().to_lowercase();
            ENDINGS.contains(&ending.as_str())
        });
        if path.is_dir() {
            if depth < MAX_DEPTH {
                // A subfolder that cannot be read is skipped. Only the folder that the user named
                // must be readable.
                let _ = walk(&path, depth + 1, files);
            }
        } else if is_font && files.len() < MAX_FILES {
            files.push(path);
        }
    }
    Ok(())
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::folder::Folder;
    use crate::geometry::text::{Face, Family};

    impl Folder {
        fn put(&self, name: &str, bytes: &[u8]) {
            let path = self.0.join(name);
            std::fs::create_dir_all(path.parent().expect("a folder")).expect("a folder");
            std::fs::write(path, bytes).expect("written");
        }
    }

    const SERIF: &[u8] = include_bytes!("fonts/serif.otf");
    const SERIF_BOLD: &[u8] = include_bytes!("fonts/serif-bold.otf");
    const SANS: &[u8] = include_bytes!("fonts/sans.otf");

    /// Returns a font file in which a name is replaced by another of the same length.
    fn renamed(font: &[u8], from: &str, to: &str) -> Vec<u8> {
        let wide = |name: &str| name.bytes().flat_map(|b| [0, b]).collect::<Vec<u8>>();
        let (from, to) = (wide(from), wide(to));
        assert_eq!(from.len(), to.len());
        let mut out = font.to_vec();
        for at in 0..out.len() - from.len() {
            if out[at..].starts_with(&from) {
                out[at..at + to.len()].copy_from_slice(&to);
            }
        }
        out
    }

    fn font_name(own: Option<UserFont<'_>>) -> Option<String> {
        let font = own?.open()?;
        let name = font
            .localized_strings(StringId::FULL_NAME)
            .english_or_first()?;
        Some(name.chars().collect())
    }

    #[test]
    fn names_find_the_family_with_its_style_or_its_replacement() {
        let folder = Folder::new("fonts-found");
        let roman = |font| renamed(font, "ivcam serif", "NimbusRoman");
        folder.put("a.otf", &roman(SERIF));
        folder.put("below/b.OTF", &roman(SERIF_BOLD));
        folder.put("below/c.txt", b"no font");
        let fonts = Fonts::open(&[&folder.0]).expect("a folder");
        assert!(fonts.warnings.is_empty());
        let find = |name: &str| {
            let face = Face::named(name);
            font_name(fonts.find(name, face.bold, face.italic))
        };
        for name in ["Times", "Times-Roman", "Times New Roman", "times:Italic"] {
            assert_eq!(find(name).as_deref(), Some("NimbusRoman"), "{name}");
        }
        for name in [
            "Times-Bold",
            "Times:Bold",
            "Nimbus Roman Bold",
            "NimbusRoman-Bold",
        ] {
            assert_eq!(find(name).as_deref(), Some("NimbusRoman-bold"), "{name}");
        }
        for name in ["Helvetica", "Timescale", "", "-", ":Bold"] {
            assert_eq!(find(name), None, "{name}");
        }
    }

    #[test]
    fn a_vrml97_style_uses_the_first_known_family() {
        let folder = Folder::new("fonts-97");
        folder.put("a.otf", &renamed(SANS, "ivcam sans", "NimbusSans"));
        let fonts = Fonts::open(&[&folder.0]).expect("a folder");
        let own = |families: &[&str]| Face::of_vrml97(families, "PLAIN", &fonts);
        assert!(own(&["Unknown", "Nimbus Sans", "SERIF"]).own.is_some());
        assert!(own(&["SANS"]).own.is_some());
        let serif = own(&["SERIF", "SANS"]);
        assert!(serif.own.is_none() && serif.built_in);
        let typewriter = own(&["TYPEWRITER"]);
        assert_eq!((typewriter.own, typewriter.family), (None, Family::Mono));
    }

    #[test]
    fn text_is_drawn_with_the_users_font_of_that_name() {
        use crate::geometry::TriangleMesh;
        use crate::geometry::text::{Justify, TextOutput, TextStyle, ascii_text};
        let folder = Folder::new("fonts-drawn");
        folder.put("a.otf", &renamed(SANS, "ivcam sans", "my letters"));
        let fonts = Fonts::open(&[&folder.0]).expect("a folder");
        let drawn = |face| {
            let style = TextStyle {
                face,
                size: 10.0,
                spacing: 1.0,
                justify: Justify::Left,
                complexity: 0.5,
            };
            {
                let mut positions = Vec::new();
                let mut draw = |mesh: &TriangleMesh| positions.extend(mesh.positions.clone());
                ascii_text(&["Rays"], &style, &[], TextOutput::Batches(&mut draw));
                positions
            }
        };
        let name = "My Letters";
        let own = drawn(Face::named_of(name, &fonts));
        assert!(
            own == drawn(Face::named("Helvetica")),
            "the letters of the file"
        );
        assert!(own != drawn(Face::named(name)), "not the shipped ones");
    }

    /// Of two fonts with Greek letters, the one with the text's style is used.
    #[test]
    fn a_font_of_any_name_has_what_the_typeface_of_a_text_lacks() {
        use crate::geometry::text::glyph::Typeface;
        let folder = Folder::new("fonts-missing");
        let unpacked = |packed: &[u8]| {
            let mut font = Vec::new();
            let mut reader = flate2::read::GzDecoder::new(packed);
            std::io::Read::read_to_end(&mut reader, &mut font).expect("unpacks");
            font
        };
        let bold: &[u8] = include_bytes!("fonts/serif-bold-other.ttf.gz");
        let mono: &[u8] = include_bytes!("fonts/mono-other.ttf.gz");
        folder.put("a.ttf", &unpacked(bold));
        folder.put("b.ttf", &unpacked(mono));
        let fonts = Fonts::open(&[&folder.0]).expect("a folder");
        let outlines = |face, character| Typeface::open(face).outlines(character, 1e-3);
        let by_name = |name| outlines(Face::named_of(name, &fonts), 'Ω');
        for name in ["Times", "Helvetica", "Courier-Oblique", "Unknown"] {
            assert_eq!(Face::named_of(name, &fonts).own, None);
            assert!(by_name(name) == by_name("ivcam mono-other"), "{name}");
        }
        assert!(by_name("Helvetica-Bold") == by_name("ivcam serif-bold-other"));
        // What these fonts lack too is in the shipped ones, or in none.
        for character in ['ř', 'ש', '你'] {
            let shipped = outlines(Face::named("Times"), character);
            assert!(outlines(Face::named_of("Times", &fonts), character) == shipped);
            assert_eq!(fonts.with_character(character, false, false), None);
        }
    }

    #[test]
    fn damaged_fonts_are_reported_and_left_out() {
        let folder = Folder::new("fonts-damaged");
        folder.put("cut.otf", &SERIF[..SERIF.len() / 8]);
        folder.put("empty.ttf", b"");
        folder.put("sound.otf", &renamed(SANS, "ivcam sans", "NimbusSans"));
        let fonts = Fonts::open(&[&folder.0]).expect("a folder");
        let messages: Vec<&str> = fonts.warnings.iter().map(|t| t.message.as_str()).collect();
        assert_eq!(messages.len(), 2, "{messages:?}");
        assert!(
            messages
                .iter()
                .any(|t| t.contains("empty.ttf`: is not a font"))
        );
        assert!(fonts.find("Times", false, false).is_none());
        assert!(fonts.find("Arial", false, false).is_some());
    }

    #[test]
    fn a_missing_folder_is_an_error_and_one_without_fonts_a_warning() {
        let error = Fonts::open(&["no/such/folder"]).expect_err("no folder");
        assert!(error.message.contains("no/such/folder"));
        let folder = Folder::new("fonts-none");
        let fonts = Fonts::open(&[&folder.0]).expect("a folder");
        assert!(fonts.warnings[0].message.contains("no fonts below"));
    }
}
