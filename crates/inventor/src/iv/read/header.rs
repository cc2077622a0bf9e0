//! Reads the header of a file, and decompresses files that are packed with gzip.
//!
//! Only the header determines the format; the file name does not.

use std::io::Read;

use ivcam_base::diag::{Diagnostic, ErrorKind, Result};
use ivcam_base::files::FileBytes;
use nom::Parser;
use nom::branch::alt;
use nom::bytes::complete::{tag, take_till, take_till1, take_while, take_while_m_n, take_while1};
use nom::combinator::{consumed, opt, value, verify};
use nom::sequence::{pair, preceded};
use quick_xml::events::Event;
use quick_xml::reader::Reader;

use super::syntax_error::{Parsed, SyntaxError};
use crate::grammar::Dialect;
use crate::iv::encoding::{Escapes, text};
use crate::iv::limits::Limits;

/// The form in which a file states a scene.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Encoding {
    /// The text of Inventor, VRML, and X3D's classic encoding.
    Text,
    /// Inventor's binary form.
    Binary,
    /// X3D in XML.
    Xml,
    /// Wavefront's OBJ.
    Obj,
    /// PLY.
    Ply,
    /// STL, as text or binary.
    Stl,
    /// glTF 2.0, as JSON or binary.
    Gltf,
}

impl Encoding {
    /// Whether the file is not text, so that messages quote no lines.
    pub(super) fn is_binary(self, bytes: &[u8]) -> bool {
        match self {
            Self::Text | Self::Xml | Self::Obj => false,
            Self::Binary => true,
            Self::Ply => !ply_is_text(bytes),
            Self::Stl => !stl_is_text(bytes),
            Self::Gltf => bytes.starts_with(b"glTF"),
        }
    }
}

/// The content of the first line of a file.
#[derive(Clone, Debug, PartialEq, Eq)]
pub(super) struct Header {
    /// The dialect whose classes come first when a name is looked up, as bits of [`Dialect`].
    pub dialect: u8,
    /// The major and minor version of the format.
    pub version: (u8, u8),
    /// The form of the rest of the file.
    pub encoding: Encoding,
    /// The format as the header states it, such as `Inventor V2.1 ascii`.
    pub words: String,
    /// The number of bytes up to the end of the line, with the line ending.
    pub length: usize,
}

impl Header {
    /// Returns the header that is assumed for a `.dat` or `.env` file without one.
    pub(super) fn ascii_2_1() -> Self {
        Self {
            dialect: Dialect::IV2 | Dialect::COIN,
            version: (2, 1),
            encoding: Encoding::Text,
            words: "Inventor V2.1 ascii".into(),
            length: 0,
        }
    }

    /// Returns the header that is assumed for the text that a script makes nodes from.
    pub(super) fn vrml97() -> Self {
        Self {
            dialect: Dialect::VRML97,
            version: (2, 0),
            encoding: Encoding::Text,
            words: "VRML V2.0 utf8".into(),
            length: 0,
        }
    }

    /// Returns the header of a format whose scenes become nodes of X3D.
    pub(super) fn of_nodes(encoding: Encoding, version: (u8, u8), words: String) -> Self {
        Self {
            dialect: Dialect::VRML97 | Dialect::X3D,
            version,
            encoding,
            words,
            length: 0,
        }
    }

    /// Returns whether the file is VRML97.
    pub(super) fn is_vrml97(&self) -> bool {
        self.dialect == Dialect::VRML97
    }

    /// Returns whether the file is X3D, or of a format whose scenes become nodes of X3D.
    pub(super) fn is_x3d(&self) -> bool {
        self.dialect & Dialect::X3D != 0
    }

    /// Returns the escapes within the strings of the format.
    pub(super) fn escapes(&self) -> Escapes {
        Escapes::of(self.is_vrml97() || self.is_x3d())
    }

    /// Returns whether a texture multiplies the color of a material, as in X3D 4 and glTF, and does
    /// not replace it.
    pub(super) fn multiplies_textures(&self) -> bool {
        self.is_x3d() && self.version >= (4, 0)
    }

    /// Finds the format of a file by its first bytes.
    ///
    /// # Errors
    /// Returns an error if the bytes do not begin a file of a supported format. The message quotes
    /// the beginning of the file.
    pub(super) fn parse(bytes: &[u8], name: &str) -> Result<Self> {
        let start = before(bytes).map_or(bytes, |(start, _)| start);
        match first_line(start) {
            Ok((rest, ((dialect, version), binary, words))) => Ok(Self {
                dialect,
                version,
                encoding: match binary {
                    true => Encoding::Binary,
                    false => Encoding::Text,
                },
                words,
                length: bytes.len() - rest.len(),
            }),
            Err(_) => other_format(bytes).ok_or_else(|| unknown_header(name, start)),
        }
    }
}

/// Returns a text after its byte-order mark.
pub(super) fn without_mark(text: &[u8]) -> &[u8] {
    text.strip_prefix("\u{feff}".as_bytes()).unwrap_or(text)
}

/// Skips a byte-order mark and empty lines.
fn before(input: &[u8]) -> Parsed<'_, &[u8]> {
    let order = opt(tag("\u{feff}"));
    preceded(order, take_while(|b: u8| b.is_ascii_whitespace())).parse(input)
}

/// A dialect, as bits of [`Dialect`], and a version.
type HeaderLanguage = (u8, (u8, u8));

/// Parses a header such as `#Inventor V2.1 ascii`; the rest of the line may be anything. Returns
/// the dialect and version, whether the file is binary, and the words of the header.
fn first_line(input: &[u8]) -> Parsed<'_, (HeaderLanguage, bool, String)> {
    let hashes = take_while1(|b| b == b'#');
    let (rest, (words, (language, binary))) =
        preceded(hashes, consumed(pair(language, is_binary))).parse(input)?;
    let line_end = opt(take_while_m_n(1, 1, is_line_end));
    let (rest, _) = pair(take_till(is_line_end), line_end).parse(rest)?;
    let words: Vec<_> = words.split(is_space).filter(|w| !w.is_empty()).collect();
    let words = String::from_utf8_lossy(&words.join(&b' ')).into_owned();
    Ok((rest, (language, binary, words)))
}

/// Parses the first two words, such as `Inventor V2.1`.
fn language(input: &[u8]) -> Parsed<'_, HeaderLanguage> {
    alt((
        value((Dialect::IV1, (1, 0)), pair(name("Inventor"), name("V1.0"))),
        value((Dialect::IV2, (2, 0)), pair(name("Inventor"), name("V2.0"))),
        value((Dialect::IV2, (2, 1)), pair(name("Inventor"), word)),
        value((Dialect::VRML1, (1, 0)), pair(name("VRML"), name("V1.0"))),
        value((Dialect::VRML97, (2, 0)), pair(name("VRML"), name("V2.0"))),
        preceded(name("X3D"), word).map(|word| {
            let version = std::str::from_utf8(word).unwrap_or_default();
            (Dialect::VRML97 | Dialect::X3D, x3d_version(version))
        }),
    ))
    .parse(input)
}

/// Returns a version such as `V3.3` or `4.0`, or 3.0 if it is none.
fn x3d_version(text: &str) -> (u8, u8) {
    let numbers = text.trim_start_matches('V').split_once('.');
    let parsed =
        numbers.and_then(|(major, minor)| Some((major.parse().ok()?, minor.parse().ok()?)));
    parsed.unwrap_or((3, 0))
}

/// The number of bytes among which the format of a file is searched, after leading comments.
const HEAD: usize = 8192;

/// The names of lists of glTF, of which the beginning of a file has one.
const GLTF_LISTS: [&[u8]; 6] = [
    b"\"asset\"",
    b"\"accessors\"",
    b"\"animations\"",
    b"\"bufferViews\"",
    b"\"meshes\"",
    b"\"nodes\"",
];

/// Returns the header of a file of a format without a first line of its own, by its first bytes.
fn other_format(bytes: &[u8]) -> Option<Header> {
    let new = Header::of_nodes;
    let head = &bytes[..bytes.len().min(HEAD)];
    let head = without_mark(head);
    let start = head.trim_ascii_start();
    let has = |word: &[u8]| head.windows(word.len()).any(|window| window == word);
    if bytes.starts_with(b"glTF") {
        return Some(new(Encoding::Gltf, (4, 0), "glTF 2.0 binary".into()));
    }
    if start.starts_with(b"ply") && start.get(3).is_some_and(u8::is_ascii_whitespace) {
        return Some(new(Encoding::Ply, (4, 0), "PLY 1.0".into()));
    }
    if let Some(version) = version_in_xml(bytes) {
        let words = format!("X3D V{}.{} XML", version.0, version.1);
        return Some(new(Encoding::Xml, version, words));
    }
    if start.starts_with(b"{") && GLTF_LISTS.iter().any(|name| has(name)) {
        return Some(new(Encoding::Gltf, (4, 0), "glTF 2.0".into()));
    }
    if stl_is_text(bytes) || stl_is_binary(bytes) {
        return Some(new(Encoding::Stl, (4, 0), "STL".into()));
    }
    if is_obj(bytes) {
        return Some(new(Encoding::Obj, (4, 0), "OBJ".into()));
    }
    stl_is_damaged(bytes).then(|| new(Encoding::Stl, (4, 0), "STL".into()))
}

/// Returns the version that an X3D file in XML states, or 3.0 if it states none; `None` for other
/// files. Comments at the beginning may be of any length.
fn version_in_xml(bytes: &[u8]) -> Option<(u8, u8)> {
    let start = without_prolog(bytes);
    if !start.starts_with(b"<") {
        return None;
    }
    let head = text(&start[..start.len().min(HEAD)]);
    let mut reader = Reader::from_str(&head);
    reader.config_mut().check_end_names = false;
    loop {
        let element = match reader.read_event() {
            Ok(Event::Start(element) | Event::Empty(element)) => element,
            Ok(Event::Eof) => return None,
            Ok(_) => continue,
            // The reader of the whole file says where it is not well-formed.
            Err(_) => return head.contains("<X3D").then_some((3, 0)),
        };
        if matches!(element.name().into_inner(), "X3D" | "Scene") {
            let mut attributes = element.attributes();
            let mut attributes = attributes.with_checks(false).flatten();
            let version = attributes.find(|attribute| attribute.key.into_inner() == "version");
            return Some(x3d_version(version.as_ref().map_or("", |a| &a.value)));
        }
    }
}

/// Skips a byte-order mark, the declaration of XML, and comments.
fn without_prolog(bytes: &[u8]) -> &[u8] {
    let mut rest = without_mark(bytes);
    loop {
        rest = rest.trim_ascii_start();
        let marks: [(&[u8], &[u8]); 2] = [(b"<?", b"?>"), (b"<!--", b"-->")];
        let end = marks.iter().find(|(begin, _)| rest.starts_with(begin));
        match end.and_then(|(_, end)| Some(find(rest, end)? + end.len())) {
            Some(length) => rest = &rest[length..],
            None => return rest,
        }
    }
}

fn find(text: &[u8], word: &[u8]) -> Option<usize> {
    text.windows(word.len()).position(|window| window == word)
}

/// Returns whether a PLY file states its elements as text.
fn ply_is_text(bytes: &[u8]) -> bool {
    let head = &bytes[..bytes.len().min(HEAD)];
    let mut lines = head.split(|&b| is_line_end(b)).map(<[u8]>::trim_ascii);
    lines.any(|line| line.starts_with(b"format ascii"))
}

/// Returns whether an STL file is text. Binary files may begin with `solid` too.
pub(super) fn stl_is_text(bytes: &[u8]) -> bool {
    let head = bytes[..bytes.len().min(HEAD)].to_ascii_lowercase();
    let start = without_mark(&head).trim_ascii_start();
    let is_solid = start.starts_with(b"solid") && !start.contains(&0);
    is_solid && (find(start, b"facet").is_some() || find(start, b"endsolid").is_some())
}

/// Returns the number of triangles that a binary STL file states, if it is not 0.
pub(super) fn stl_count(bytes: &[u8]) -> Option<u64> {
    let count = bytes.get(80..84)?.try_into().ok()?;
    Some(u64::from(u32::from_le_bytes(count))).filter(|count| *count > 0)
}

/// Returns whether a file has the size that the number of triangles of a binary STL file states.
fn stl_is_binary(bytes: &[u8]) -> bool {
    stl_count(bytes).is_some_and(|count| bytes.len() as u64 == 84 + 50 * count)
}

/// Returns whether a file of any other size begins as a binary STL file: its first triangles have
/// finite corners, which are not all 0, and normals of length 1 or 0.
fn stl_is_damaged(bytes: &[u8]) -> bool {
    let is_likely = |triangle: &[u8]| {
        let numbers: [f32; 12] = std::array::from_fn(|i| {
            f32::from_le_bytes(std::array::from_fn(|k| triangle[4 * i + k]))
        });
        let length = numbers[..3].iter().map(|n| n * n).sum::<f32>();
        let has_corners = numbers[3..].iter().any(|n| *n != 0.0);
        has_corners
            && numbers.iter().all(|n| n.is_finite())
            && (length == 0.0 || (length - 1.0).abs() < 0.01)
    };
    let body = bytes.get(84..).unwrap_or_default();
    let count = stl_count(bytes).map_or(0, |count| count.min(16) as usize);
    let mut first = body.chunks_exact(50).take(count).peekable();
    first.peek().is_some() && first.all(is_likely)
}

/// Returns whether the first lines are those of an OBJ file: comments and statements, of which one
/// has a material library, a material, a name, or a point.
fn is_obj(bytes: &[u8]) -> bool {
    const NAMES: [&[u8]; 5] = [b"mtllib", b"usemtl", b"o", b"g", b"s"];
    let lines = without_mark(bytes)
        .split(|&b| is_line_end(b))
        .map(<[u8]>::trim_ascii);
    let mut first = lines.filter(|line| !line.is_empty() && line[0] != b'#');
    let Some(line) = first.next() else {
        return false;
    };
    let mut words = line
        .split(u8::is_ascii_whitespace)
        .filter(|word| !word.is_empty());
    let keyword = words.next().unwrap_or_default();
    let is_number = |word: &[u8]| std::str::from_utf8(word).is_ok_and(|w| w.parse::<f64>().is_ok());
    match keyword {
        b"v" | b"vn" | b"vt" => words.clone().count() >= 2 && words.all(is_number),
        name => NAMES.contains(&name) && words.next().is_some(),
    }
}

/// Parses the encoding, and returns whether it is binary.
fn is_binary(input: &[u8]) -> Parsed<'_, bool> {
    let text = alt((name("ascii"), name("utf8")));
    alt((value(false, text), value(true, name("binary")))).parse(input)
}

/// Makes a parser of one fixed word.
fn name<'a>(
    expected: &'static str,
) -> impl Parser<&'a [u8], Output = &'a [u8], Error = SyntaxError<'a>> {
    verify(word, |word: &[u8]| word == expected.as_bytes())
}

/// Parses a word, which ends at a space or at the end of the line.
fn word(input: &[u8]) -> Parsed<'_, &[u8]> {
    let letters = take_till1(|b| is_space(&b) || is_line_end(b));
    preceded(take_while(|b| is_space(&b)), letters).parse(input)
}

fn is_space(byte: &u8) -> bool {
    matches!(byte, b' ' | b'\t' | 0x0b | 0x0c)
}

fn is_line_end(byte: u8) -> bool {
    matches!(byte, b'\n' | b'\r')
}

/// The first bytes of files that people take for scenes, and what to do with them.
const OTHER_FORMATS: [(&[u8], &str); 7] = [
    (b"<", "of the formats in XML, X3D is read"),
    (
        b"BLENDER",
        "a file of Blender; export it there as glTF (.glb)",
    ),
    (
        b"Kaydara FBX",
        "an FBX file; convert it to glTF (.glb), with Blender for example",
    ),
    (
        b"; FBX",
        "an FBX file; convert it to glTF (.glb), with Blender for example",
    ),
    (
        b"#usda",
        "USD is written and not read; export the scene as glTF (.glb)",
    ),
    (
        b"PXR-USDC",
        "USD is written and not read; export the scene as glTF (.glb)",
    ),
    (b"PK\x03\x04", "a ZIP archive; unpack it"),
];

/// Returns the error for a file with an unknown header.
fn unknown_header(name: &str, start: &[u8]) -> Box<Diagnostic> {
    let expected = "Inventor, VRML, X3D, glTF, OBJ, PLY and STL are read; the first line of an Inventor file is \
         `#Inventor V2.1 ascii` or similar";
    if start.is_empty() {
        return Diagnostic::error(format!("`{name}` is empty"))
            .in_file(name)
            .of_kind(ErrorKind::Damaged)
            .with_help(expected);
    }
    let line = start.split(|&b| is_line_end(b)).next().unwrap_or_default();
    let text = String::from_utf8_lossy(&line[..line.len().min(200)]);
    let begins: String = text
        .chars()
        .take(40)
        .map(|c| if c.is_control() { '?' } else { c })
        .collect();
    let message = format!("`{name}` is no scene of a known format: it begins with `{begins}`");
    let other = OTHER_FORMATS
        .iter()
        .find(|(begin, _)| start.starts_with(begin));
    let help = other.map_or(expected, |(_, help)| help);
    Diagnostic::error(message)
        .in_file(name)
        .of_kind(ErrorKind::Damaged)
        .with_help(help)
}

/// The first bytes of a file that is packed with gzip (RFC 1952, 2.3.1).
pub(super) const GZIP: [u8; 2] = [0x1f, 0x8b];

/// Decompresses a file that is packed with gzip, and returns other files unchanged. For a damaged
/// archive it returns the part that can be decompressed, and a warning.
///
/// # Errors
/// Returns an error if the result is larger than the limit, or if nothing can be decompressed.
pub(super) fn unpack(
    bytes: FileBytes,
    name: &str,
    limits: &Limits,
) -> Result<(FileBytes, Option<Box<Diagnostic>>)> {
    let too_big = |n: usize| {
        Diagnostic::beyond_limit(format!("`{name}` is larger than {n} bytes"))
            .in_file(name)
            .with_help("`--scene-limit bytes=N` raises this, if the file is meant to be that big")
    };
    if !bytes.starts_with(&GZIP) {
        return if bytes.len() > limits.bytes {
            Err(too_big(limits.bytes))
        } else {
            Ok((bytes, None))
        };
    }
    let mut out = Vec::new();
    let read = flate2::read::MultiGzDecoder::new(&bytes[..])
        .take(limits.bytes as u64 + 1)
        .read_to_end(&mut out);
    drop(bytes);
    match read {
        Ok(_) if out.len() > limits.bytes => Err(too_big(limits.bytes)),
        Ok(_) => Ok((FileBytes::Read(out), None)),
        // Bytes after a complete archive are ignored, as by `gunzip`.
        Err(error) if !out.is_empty() && error.to_string() == "invalid gzip header" => {
            Ok((FileBytes::Read(out), None))
        }
        Err(error) if !out.is_empty() => {
            let message = format!("the gzip archive is damaged: {error}");
            let help = format!("{} bytes could be unpacked, and are read", out.len());
            let warning = Diagnostic::warning(message).in_file(name);
            let warning = warning.of_kind(ErrorKind::Damaged).with_help(help);
            Ok((FileBytes::Read(out), Some(warning)))
        }
        Err(error) => Err(
            Diagnostic::error(format!("`{name}` cannot be unpacked: {error}"))
                .in_file(name)
                .of_kind(ErrorKind::Damaged),
        ),
    }
}
