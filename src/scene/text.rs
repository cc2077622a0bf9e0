//! Strings to triangles: `Text3`, `AsciiText`, VRML97's `Text`, and `Text2` in pixels.
//!
//! Twelve typefaces stand for every font a file may name (`fonts/LICENSE.txt`), so that a picture
//! is the same on every machine. They have the metrics of Times, Helvetica and Courier, which is
//! what SGI's and Coin's libraries draw for those names. Glyph outlines are cut into lines once a
//! call; nothing here is touched by a scene without text.
//!
//! Not done: kerning, ligatures, right-to-left scripts, anything past Latin-1.

use std::collections::BTreeMap;

use glam::{Vec2, Vec3};
use lyon_tessellation::{
    BuffersBuilder, FillOptions, FillTessellator, FillVertex, VertexBuffers, math::point,
    path::Path,
};
use skrifa::outline::{DrawSettings, OutlinePen};
use skrifa::prelude::{FontRef, LocationRef, Size};
use skrifa::{GlyphId, MetadataProvider};

use super::mesh::Mesh;

/// Characters drawn a call; a file with more in one node is cut off there.
pub const MAX_GLYPHS: usize = 50_000;

/// The parts of a `Text3`, as the bits of its field and as the parts of [`Mesh`] (0, 1, 2).
pub const FRONT: i32 = 1;
pub const SIDES: i32 = 2;
pub const BACK: i32 = 4;

#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Family {
    Serif,
    Sans,
    Mono,
}

/// Which of the typefaces to draw with.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Face {
    pub family: Family,
    pub bold: bool,
    pub italic: bool,
    /// Width and height beside the typeface's own. 1, but for the font that a silent file gets:
    /// Coin's built-in serif is 1.055 times as wide and 1.12 times as high as Times (measured
    /// over the alphabet and the capitals).
    pub stretch: Vec2,
}

impl Face {
    pub const DEFAULT: Self = Self {
        family: Family::Serif,
        bold: false,
        italic: false,
        stretch: Vec2::new(1.055, 1.12),
    };

    fn plain(family: Family, bold: bool, italic: bool) -> Self {
        Self {
            family,
            bold,
            italic,
            stretch: Vec2::ONE,
        }
    }

    /// For the name in an Inventor `Font` (`Times-Roman`, `Helvetica:Bold Italic`, …). A name
    /// nobody knows is drawn with serifs, as by SGI, whose fallback was Utopia.
    pub fn named(name: &str) -> Self {
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

    /// For the values of an Inventor or VRML 1.0 `FontStyle`.
    pub fn of_font_style(family: i32, style: i32) -> Self {
        let family = match family {
            1 => Family::Sans,
            2 => Family::Mono,
            _ => Family::Serif,
        };
        Self::plain(family, style & 1 != 0, style & 2 != 0)
    }

    /// For a VRML97 `FontStyle`: the first family that is known counts.
    pub fn of_vrml97<S: AsRef<str>>(families: &[S], style: &str) -> Self {
        let known = families.iter().find_map(|f| match f.as_ref() {
            "SERIF" => Some(Family::Serif),
            "SANS" => Some(Family::Sans),
            "TYPEWRITER" => Some(Family::Mono),
            _ => None,
        });
        let family = known.unwrap_or_else(|| match families.first() {
            Some(name) => Self::named(name.as_ref()).family,
            None => Family::Serif,
        });
        Self::plain(family, style.contains("BOLD"), style.contains("ITALIC"))
    }

    fn bytes(self) -> &'static [u8] {
        macro_rules! font {
            ($name:literal) => {
                include_bytes!(concat!("fonts/", $name, ".ttf"))
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

#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Justify {
    Left,
    Right,
    Center,
}

impl Justify {
    /// From the value of an Inventor `justification` (`LEFT` 1, `RIGHT` 2, `CENTER` 3).
    pub fn from_value(value: i32) -> Self {
        match value {
            2 => Self::Right,
            3 => Self::Center,
            _ => Self::Left,
        }
    }
}

/// How Inventor and VRML 1.0 set a text.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct TextStyle {
    pub face: Face,
    /// Distance between baselines at spacing 1: the font's size.
    pub size: f32,
    pub spacing: f32,
    pub justify: Justify,
    /// Inventor's complexity, 0 to 1: how finely curves are cut.
    pub complexity: f32,
}

/// A character and where its origin stands; `stretch` scales its width.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct PlacedGlyph {
    pub character: char,
    pub origin: Vec2,
    pub stretch: f32,
}

/// The characters of a text in place.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Layout {
    pub glyphs: Vec<PlacedGlyph>,
    /// What the lines take up in x: advances, not ink. Coin's bounding boxes are these in x.
    pub left: f32,
    pub right: f32,
}

/// Where the glyphs of an Inventor text stand: line n's baseline is at y = −n · spacing · size.
pub fn layout<S: AsRef<str>>(strings: &[S], style: &TextStyle) -> Layout {
    let font = Typeface::open(style.face);
    let mut out = Layout::default();
    for (i, line) in strings.iter().enumerate() {
        let advances = font.advances(line.as_ref(), style.size);
        let width: f32 = advances.iter().map(|a| a.1).sum();
        let left = start(style.justify, width);
        let y = -(i as f32) * style.spacing * style.size;
        out.set(&advances, Vec2::new(left, y), 0.0, 1.0);
        out.extend(left, left + width);
    }
    out
}

/// Where the glyphs of an `AsciiText` stand. A line with a positive width is spread out to it
/// by space between its characters, as Coin does, or pressed together in its letters. A line
/// ends where its last letter's ink ends (Coin), so that `RIGHT` is flush.
pub fn ascii_layout<S: AsRef<str>>(strings: &[S], style: &TextStyle, widths: &[f32]) -> Layout {
    let font = Typeface::open(style.face);
    let mut out = Layout::default();
    for (i, line) in strings.iter().enumerate() {
        let advances = font.advances(line.as_ref(), style.size);
        let natural = font.ink_width(&advances, style.size);
        let wanted = widths.get(i).copied().unwrap_or(0.0);
        let (gap, stretch) = fit(natural, wanted, advances.len());
        let width = if wanted > 0.0 && natural > 0.0 {
            wanted
        } else {
            natural
        };
        let left = start(style.justify, width);
        let y = -(i as f32) * style.spacing * style.size;
        out.set(&advances, Vec2::new(left, y), gap, stretch);
        out.extend(left, left + width);
    }
    out
}

/// Space to add between characters and a scale of their widths that bring a line to a width.
fn fit(natural: f32, wanted: f32, count: usize) -> (f32, f32) {
    if !(wanted > 0.0 && natural > 0.0 && wanted.is_finite()) {
        (0.0, 1.0)
    } else if wanted > natural && count > 1 {
        ((wanted - natural) / (count - 1) as f32, 1.0)
    } else {
        (0.0, wanted / natural)
    }
}

fn start(justify: Justify, width: f32) -> f32 {
    match justify {
        Justify::Left => 0.0,
        Justify::Right => -width,
        Justify::Center => -0.5 * width,
    }
}

impl Layout {
    fn set(&mut self, advances: &[(char, f32)], origin: Vec2, gap: f32, stretch: f32) {
        let mut x = origin.x;
        for &(character, advance) in advances {
            self.push(character, Vec2::new(x, origin.y), stretch);
            x += advance * stretch + gap;
        }
    }

    fn push(&mut self, character: char, origin: Vec2, stretch: f32) {
        if self.glyphs.len() < MAX_GLYPHS && origin.is_finite() {
            self.glyphs.push(PlacedGlyph {
                character,
                origin,
                stretch,
            });
        }
    }

    fn extend(&mut self, left: f32, right: f32) {
        self.left = self.left.min(left);
        self.right = self.right.max(right);
    }
}

/// VRML97's justification along one axis.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Align {
    Begin,
    First,
    Middle,
    End,
}

impl Align {
    pub fn named(name: &str) -> Option<Self> {
        match name {
            "BEGIN" => Some(Self::Begin),
            "FIRST" => Some(Self::First),
            "MIDDLE" => Some(Self::Middle),
            "END" => Some(Self::End),
            _ => None,
        }
    }
}

/// How VRML97 sets a text: `FontStyle`'s fields.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Vrml97Style {
    pub face: Face,
    pub size: f32,
    pub spacing: f32,
    pub horizontal: bool,
    pub left_to_right: bool,
    pub top_to_bottom: bool,
    pub major: Align,
    pub minor: Align,
    pub complexity: f32,
}

impl Vrml97Style {
    pub const DEFAULT: Self = Self {
        face: Face {
            stretch: Vec2::ONE,
            ..Face::DEFAULT
        },
        size: 1.0,
        spacing: 1.0,
        horizontal: true,
        left_to_right: true,
        top_to_bottom: true,
        major: Align::Begin,
        minor: Align::First,
        complexity: 0.5,
    };

    /// Sets major and minor from the field `justify`; an empty string is `BEGIN`, silence `FIRST`.
    pub fn justified<S: AsRef<str>>(mut self, justify: &[S]) -> Self {
        let named = |i: usize| justify.get(i).and_then(|s| Align::named(s.as_ref()));
        self.major = named(0).unwrap_or(Align::Begin);
        self.minor = named(1).unwrap_or(Align::First);
        self
    }
}

/// How far a line reaches above its baseline, as a share of the size; the rest is below.
const ABOVE: f32 = 0.8;

/// Where the glyphs of a VRML97 `Text` stand (section 6.47 with 6.22). The standard leaves the
/// height of a line open; here it is the size, four fifths of it above the baseline.
pub fn vrml97_layout<S: AsRef<str>>(
    strings: &[S],
    style: &Vrml97Style,
    lengths: &[f32],
    max_extent: f32,
) -> Layout {
    let font = Typeface::open(style.face);
    let lines: Vec<Line> = strings
        .iter()
        .enumerate()
        .map(|(i, s)| Line::new(&font, s.as_ref(), style, lengths.get(i).copied()))
        .collect();
    let longest = lines.iter().map(|l| l.length).fold(0.0, f32::max);
    let squeeze = if max_extent > 0.0 && longest > max_extent {
        max_extent / longest
    } else {
        1.0
    };
    let mut out = Layout::default();
    for (i, line) in lines.iter().enumerate() {
        line.place(i, lines.len(), squeeze, style, &mut out);
    }
    out
}

/// A string of a VRML97 text with its steps along the major axis.
struct Line {
    advances: Vec<(char, f32)>,
    gap: f32,
    stretch: f32,
    length: f32,
}

impl Line {
    fn new(font: &Typeface, text: &str, style: &Vrml97Style, wanted: Option<f32>) -> Self {
        let advances = font.advances(text, style.size);
        let natural: f32 = if style.horizontal {
            advances.iter().map(|a| a.1).sum()
        } else {
            advances.len() as f32 * style.size
        };
        let wanted = wanted.unwrap_or(0.0);
        let (gap, stretch) = fit(natural, wanted, advances.len());
        let length = if wanted > 0.0 { wanted } else { natural };
        Self {
            advances,
            gap,
            stretch,
            length,
        }
    }

    fn place(&self, i: usize, count: usize, squeeze: f32, style: &Vrml97Style, out: &mut Layout) {
        let step = style.spacing * style.size;
        let length = self.length * squeeze;
        let begin = match style.major {
            Align::Begin | Align::First => 0.0,
            Align::Middle => -0.5 * length,
            Align::End => -length,
        };
        let block = style.size + step * count.saturating_sub(1) as f32;
        let across = i as f32 * step;
        let mut along = begin;
        for &(character, advance) in &self.advances {
            let width = if style.horizontal {
                advance
            } else {
                style.size
            };
            let origin = if style.horizontal {
                let x = if style.left_to_right {
                    along
                } else {
                    -along - width * self.stretch * squeeze
                };
                Vec2::new(x, row(across, block, style))
            } else {
                let top = if style.top_to_bottom {
                    -along
                } else {
                    along + style.size
                };
                Vec2::new(column(across, block, style), top - ABOVE * style.size)
            };
            let stretch = if style.horizontal {
                self.stretch * squeeze
            } else {
                1.0
            };
            out.push(character, origin, stretch);
            out.extend(origin.x, origin.x + advance * stretch);
            along += (width * self.stretch + self.gap) * squeeze;
        }
    }
}

/// The baseline of the line that is `across` past the first, in a block of that height.
fn row(across: f32, block: f32, style: &Vrml97Style) -> f32 {
    let below = (1.0 - ABOVE) * style.size;
    let above = ABOVE * style.size;
    if style.top_to_bottom {
        let first = match style.minor {
            Align::First => 0.0,
            Align::Begin => -above,
            Align::Middle => 0.5 * block - above,
            Align::End => block - above,
        };
        first - across
    } else {
        let first = match style.minor {
            Align::First => 0.0,
            Align::Begin => below,
            Align::Middle => below - 0.5 * block,
            Align::End => below - block,
        };
        first + across
    }
}

/// The left edge of the column that is `across` past the first.
fn column(across: f32, block: f32, style: &Vrml97Style) -> f32 {
    let begin = match style.minor {
        Align::First | Align::Begin => 0.0,
        Align::Middle => -0.5 * block,
        Align::End => -block,
    };
    if style.left_to_right {
        begin + across
    } else {
        -begin - across - style.size
    }
}

/// A `Text3`: glyphs in x and y, swept toward −z along a profile.
///
/// A profile is a polyline of (depth behind z = 0, distance outward from the outline); `None` is
/// (0, 0) to (1, 0). Each face's triangles carry its part: 0 front, 1 sides, 2 back. Sides are
/// smooth where outline or profile turn by less than `crease_angle`. Textures are one font
/// height a unit, from the first baseline's start (SGI's reference page of SoText3).
///
/// Coin leaves the front face at the outline where the profile does not start at 0; the faces
/// here follow the profile, which closes the gap.
pub fn text3<S: AsRef<str>>(
    strings: &[S],
    style: &TextStyle,
    parts: i32,
    profile: Option<&[Vec2]>,
    crease_angle: f32,
) -> (Mesh, Layout) {
    let straight = [Vec2::ZERO, Vec2::X];
    let profile = profile
        .filter(|p| p.len() > 1 && p.iter().all(|v| v.is_finite()))
        .unwrap_or(&straight);
    let laid = layout(strings, style);
    let mut pen = Solid {
        mesh: Mesh::default(),
        size: style.size,
        profile,
        smooth: libm::cosf(crease_angle.clamp(0.0, std::f32::consts::PI)),
        per_unit: if style.size > 0.0 {
            1.0 / style.size
        } else {
            0.0
        },
    };
    let mut glyphs = Glyphs::new(style.face, style.complexity);
    for glyph in &laid.glyphs {
        let cut = glyphs.get(glyph.character);
        if parts & FRONT != 0 {
            pen.face(cut, glyph.origin, true);
        }
        if parts & SIDES != 0 {
            pen.sides(cut, glyph.origin);
        }
        if parts & BACK != 0 {
            pen.face(cut, glyph.origin, false);
        }
    }
    (pen.mesh, laid)
}

/// An `AsciiText`: flat, in z = 0.
pub fn ascii_text<S: AsRef<str>>(
    strings: &[S],
    style: &TextStyle,
    widths: &[f32],
) -> (Mesh, Layout) {
    let laid = ascii_layout(strings, style, widths);
    (flat(&laid, style.face, style.size, style.complexity), laid)
}

/// A VRML97 `Text`: flat, in z = 0.
pub fn vrml97_text<S: AsRef<str>>(
    strings: &[S],
    style: &Vrml97Style,
    lengths: &[f32],
    max_extent: f32,
) -> (Mesh, Layout) {
    let laid = vrml97_layout(strings, style, lengths, max_extent);
    (flat(&laid, style.face, style.size, style.complexity), laid)
}

/// A `Text2`, in pixels: to be set up facing the camera, its origin at the text's point, and
/// scaled so that a unit is a pixel there. The size of the font is in pixels too. Characters
/// stand on whole pixels, as the bitmaps of the old libraries did.
pub fn text2<S: AsRef<str>>(strings: &[S], style: &TextStyle) -> Mesh {
    let mut laid = layout(strings, style);
    for glyph in &mut laid.glyphs {
        glyph.origin = (glyph.origin + 0.5).floor();
    }
    flat(&laid, style.face, style.size, style.complexity)
}

fn flat(laid: &Layout, face: Face, size: f32, complexity: f32) -> Mesh {
    let mut glyphs = Glyphs::new(face, complexity);
    let mut mesh = Mesh::default();
    let per_unit = if size > 0.0 { 1.0 / size } else { 0.0 };
    for glyph in &laid.glyphs {
        let cut = glyphs.get(glyph.character);
        let first = mesh.positions.len() as u32;
        for &p in &cut.points {
            let p = glyph.origin + size * p * Vec2::new(glyph.stretch, 1.0);
            mesh.vertex(p.extend(0.0), Vec3::Z, p * per_unit);
        }
        let triangles = cut.triangles.iter();
        mesh.triangles
            .extend(triangles.map(|t| t.map(|i| first + i)));
    }
    mesh
}

/// Builds the faces and sides of solid text.
struct Solid<'a> {
    mesh: Mesh,
    size: f32,
    profile: &'a [Vec2],
    /// Cosine of the crease angle.
    smooth: f32,
    per_unit: f32,
}

impl Solid<'_> {
    fn face(&mut self, cut: &Cut, origin: Vec2, front: bool) {
        let end = self.profile[if front { 0 } else { self.profile.len() - 1 }];
        let swollen;
        let cut = if end.y == 0.0 || self.size == 0.0 {
            cut
        } else {
            let by = end.y / self.size;
            swollen = Cut::fill(cut.outlines.iter().map(|o| swell(o, by)).collect());
            &swollen
        };
        let (normal, mirror) = if front {
            (Vec3::Z, 1.0)
        } else {
            (Vec3::NEG_Z, -1.0)
        };
        let first = self.mesh.positions.len() as u32;
        for &p in &cut.points {
            let p = origin + self.size * p;
            let texcoord = p * Vec2::new(mirror, 1.0) * self.per_unit;
            self.mesh.vertex(p.extend(-end.x), normal, texcoord);
        }
        for &[a, b, c] in &cut.triangles {
            let triangle = if front { [a, b, c] } else { [a, c, b] };
            self.mesh.triangles.push(triangle.map(|i| first + i));
            self.mesh.parts.push(if front { 0 } else { 2 });
        }
    }

    fn sides(&mut self, cut: &Cut, origin: Vec2) {
        let slopes = slopes(self.profile, self.smooth);
        let rear = self.profile[self.profile.len() - 1].x;
        for outline in &cut.outlines {
            let rims: Vec<Vec<Vec2>> = self
                .profile
                .iter()
                .map(|p| swell_scaled(outline, self.size, p.y))
                .collect();
            let normals = edge_normals(outline, self.smooth);
            let mut along = 0.0;
            for edge in 0..outline.len() {
                let next = (edge + 1) % outline.len();
                let length = outline[edge].distance(outline[next]);
                for (k, slope) in slopes.iter().enumerate() {
                    let corner = |at: usize, rim: usize, normal: Vec2, s: Vec2, t: f32| {
                        let p = origin + rims[rim][at];
                        let depth = self.profile[rim].x;
                        let texcoord = Vec2::new((rear - depth) * self.per_unit, t);
                        (p.extend(-depth), (normal * s.x).extend(s.y), texcoord)
                    };
                    let (start, end) = normals[edge];
                    let corners = [
                        corner(edge, k, start, slope.0, along),
                        corner(edge, k + 1, start, slope.1, along),
                        corner(next, k + 1, end, slope.1, along + length),
                        corner(next, k, end, slope.0, along + length),
                    ];
                    self.quad(corners);
                }
                along += length;
            }
        }
    }

    /// Corners run clockwise seen from outside for an outline with its fill on the right.
    fn quad(&mut self, corners: [(Vec3, Vec3, Vec2); 4]) {
        let [a, b, c, d] = corners.map(|(p, n, t)| self.mesh.vertex(p, n, t));
        self.mesh.triangles.extend([[a, c, b], [a, d, c]]);
        self.mesh.parts.extend([1, 1]);
    }
}

/// The slope's (outward, toward the front) unit vector at both ends of each piece of a profile.
fn slopes(profile: &[Vec2], smooth: f32) -> Vec<(Vec2, Vec2)> {
    let normals: Vec<Vec2> = profile
        .windows(2)
        .map(|p| (p[1] - p[0]).try_normalize().unwrap_or(Vec2::X))
        .collect();
    let blend = |a: Vec2, b: Vec2| {
        if a.dot(b) > smooth {
            (a + b).normalize_or(a)
        } else {
            a
        }
    };
    (0..normals.len())
        .map(|i| {
            let n = normals[i];
            let before = normals[i.saturating_sub(1)];
            let after = normals[(i + 1).min(normals.len() - 1)];
            (blend(n, before), blend(n, after))
        })
        .collect()
}

/// Outward normals at both ends of each edge of an outline that has its fill on the right.
fn edge_normals(outline: &[Vec2], smooth: f32) -> Vec<(Vec2, Vec2)> {
    let n = outline.len();
    let flat: Vec<Vec2> = (0..n)
        .map(|i| outward(outline[i], outline[(i + 1) % n]))
        .collect();
    let blend = |a: Vec2, b: Vec2| {
        if a.dot(b) > smooth {
            (a + b).normalize_or(a)
        } else {
            a
        }
    };
    (0..n)
        .map(|i| {
            (
                blend(flat[i], flat[(i + n - 1) % n]),
                blend(flat[i], flat[(i + 1) % n]),
            )
        })
        .collect()
}

fn outward(from: Vec2, to: Vec2) -> Vec2 {
    (to - from).perp().normalize_or_zero()
}

fn swell_scaled(outline: &[Vec2], size: f32, by: f32) -> Vec<Vec2> {
    if by == 0.0 {
        return outline.iter().map(|p| size * *p).collect();
    }
    let scaled: Vec<Vec2> = outline.iter().map(|p| size * *p).collect();
    swell(&scaled, by)
}

/// Moves each edge outward; corners are mitered, at most to four times the distance.
fn swell(outline: &[Vec2], by: f32) -> Vec<Vec2> {
    let n = outline.len();
    (0..n)
        .map(|i| {
            let (before, here, after) =
                (outline[(i + n - 1) % n], outline[i], outline[(i + 1) % n]);
            let (a, b) = (outward(before, here), outward(here, after));
            let miter = (a + b) / (1.0 + a.dot(b)).max(0.125);
            here + by * miter
        })
        .collect()
}

/// A glyph as polylines and triangles; the size of the font is 1.
#[derive(Clone, Debug, Default)]
struct Cut {
    /// Closed, the fill on the right of each edge (TrueType's rule).
    outlines: Vec<Vec<Vec2>>,
    points: Vec<Vec2>,
    triangles: Vec<[u32; 3]>,
}

impl Cut {
    /// Fills outlines by the nonzero rule. Works in 1/2048 of the size, the grid of the fonts:
    /// the tessellator rounds to a fixed grid of its own.
    fn fill(outlines: Vec<Vec<Vec2>>) -> Self {
        const GRID: f32 = 2048.0;
        let mut builder = Path::builder();
        for outline in &outlines {
            let mut points = outline.iter().map(|p| point(GRID * p.x, GRID * p.y));
            if let Some(first) = points.next() {
                builder.begin(first);
                points.for_each(|p| {
                    builder.line_to(p);
                });
                builder.close();
            }
        }
        let mut buffers: VertexBuffers<Vec2, u32> = VertexBuffers::new();
        let filled = FillTessellator::new().tessellate_path(
            &builder.build(),
            &FillOptions::non_zero(),
            &mut BuffersBuilder::new(&mut buffers, |v: FillVertex| {
                Vec2::new(v.position().x, v.position().y) / GRID
            }),
        );
        if filled.is_err() {
            buffers.clear();
        }
        let points = buffers.vertices;
        let triangles = buffers
            .indices
            .chunks_exact(3)
            .map(|t| counterclockwise(&points, [t[0], t[1], t[2]]))
            .collect();
        Self {
            outlines,
            points,
            triangles,
        }
    }
}

fn counterclockwise(points: &[Vec2], [a, b, c]: [u32; 3]) -> [u32; 3] {
    let p = |i: u32| points[i as usize];
    if (p(b) - p(a)).perp_dot(p(c) - p(a)) < 0.0 {
        [a, c, b]
    } else {
        [a, b, c]
    }
}

/// The glyphs a text has used so far.
struct Glyphs {
    font: Typeface,
    tolerance: f32,
    cuts: BTreeMap<char, Cut>,
}

impl Glyphs {
    /// Curves stay within this much of the size: 0.01 at complexity 0, 0.0007 at 0.5 (32 lines
    /// for Helvetica's o are 0.0012 in Coin), 0.00005 at 1.
    fn new(face: Face, complexity: f32) -> Self {
        let c = complexity.clamp(0.0, 1.0);
        Self {
            font: Typeface::open(face),
            tolerance: if c.is_nan() {
                7e-4
            } else {
                0.01 * libm::powf(0.005, c)
            },
            cuts: BTreeMap::new(),
        }
    }

    fn get(&mut self, character: char) -> &Cut {
        let (font, tolerance) = (&self.font, self.tolerance);
        self.cuts
            .entry(character)
            .or_insert_with(|| Cut::fill(font.outlines(character, tolerance)))
    }
}

/// A shipped typeface, opened.
struct Typeface {
    font: Option<FontRef<'static>>,
    stretch: Vec2,
    builtin: bool,
}

impl Typeface {
    fn open(face: Face) -> Self {
        Self {
            font: FontRef::new(face.bytes()).ok(),
            stretch: face.stretch,
            builtin: face.stretch != Vec2::ONE,
        }
    }

    fn glyph(&self, font: &FontRef<'static>, character: char) -> GlyphId {
        font.charmap().map(character).unwrap_or_default()
    }

    /// The characters with their advances. FreeType in Coin cuts glyphs at 40 pixels to the
    /// size and so has advances in whole fortieths; ours are the same, so that lines are as long.
    fn advances(&self, text: &str, size: f32) -> Vec<(char, f32)> {
        let Some(font) = &self.font else {
            return Vec::new();
        };
        let metrics = font.glyph_metrics(Size::new(40.0), LocationRef::default());
        text.chars()
            .filter(|c| !c.is_control() || *c == '\t')
            .take(MAX_GLYPHS)
            .map(|c| {
                let shown = if c == '\t' { ' ' } else { c };
                let pixels = metrics
                    .advance_width(self.glyph(font, shown))
                    .unwrap_or(0.0);
                let advance = if self.builtin {
                    pixels * self.stretch.x
                } else {
                    (pixels + 0.5).floor()
                };
                (shown, advance / 40.0 * size)
            })
            .collect()
    }

    /// The length of a line up to the last letter's ink.
    fn ink_width(&self, advances: &[(char, f32)], size: f32) -> f32 {
        let full: f32 = advances.iter().map(|a| a.1).sum();
        let (Some(font), Some(&(last, advance))) = (&self.font, advances.last()) else {
            return full;
        };
        let metrics = font.glyph_metrics(Size::new(1.0), LocationRef::default());
        match metrics.bounds(self.glyph(font, last)) {
            Some(b) if b.x_max > b.x_min => full - advance + b.x_max * self.stretch.x * size,
            _ => full,
        }
    }

    fn outlines(&self, character: char, tolerance: f32) -> Vec<Vec<Vec2>> {
        let Some(font) = &self.font else {
            return Vec::new();
        };
        let mut pen = Flattener {
            stretch: self.stretch,
            tolerance,
            outlines: Vec::new(),
        };
        if let Some(glyph) = font.outline_glyphs().get(self.glyph(font, character)) {
            let settings = DrawSettings::unhinted(Size::new(1.0), LocationRef::default());
            if glyph.draw(settings, &mut pen).is_err() {
                return Vec::new();
            }
        }
        pen.outlines.retain(|o| o.len() > 2);
        pen.outlines
    }
}

/// Cuts a glyph's curves into lines.
struct Flattener {
    stretch: Vec2,
    tolerance: f32,
    outlines: Vec<Vec<Vec2>>,
}

impl Flattener {
    fn last(&self) -> Vec2 {
        let last = self.outlines.last().and_then(|o| o.last());
        last.copied().unwrap_or_default()
    }

    fn add(&mut self, p: Vec2) {
        let distinct = p != self.last();
        if let Some(outline) = self.outlines.last_mut()
            && (distinct || outline.is_empty())
        {
            outline.push(p);
        }
    }

    /// Lines that keep a curve within the tolerance, where its middle is `sag` off the chord.
    fn pieces(&self, sag: f32) -> usize {
        ((sag / self.tolerance).sqrt().ceil() as usize).clamp(1, 64)
    }
}

impl OutlinePen for Flattener {
    fn move_to(&mut self, x: f32, y: f32) {
        self.outlines.push(vec![Vec2::new(x, y) * self.stretch]);
    }

    fn line_to(&mut self, x: f32, y: f32) {
        self.add(Vec2::new(x, y) * self.stretch);
    }

    fn quad_to(&mut self, cx: f32, cy: f32, x: f32, y: f32) {
        let (a, b) = (self.last(), Vec2::new(cx, cy) * self.stretch);
        let c = Vec2::new(x, y) * self.stretch;
        let pieces = self.pieces(0.25 * (a - 2.0 * b + c).length());
        for i in 1..=pieces {
            let t = i as f32 / pieces as f32;
            self.add(a.lerp(b, t).lerp(b.lerp(c, t), t));
        }
    }

    fn curve_to(&mut self, bx: f32, by: f32, cx: f32, cy: f32, x: f32, y: f32) {
        let a = self.last();
        let [b, c, d] = [(bx, by), (cx, cy), (x, y)].map(|(x, y)| Vec2::new(x, y) * self.stretch);
        let bend = (a - 2.0 * b + c).length().max((b - 2.0 * c + d).length());
        let pieces = self.pieces(0.75 * bend);
        for i in 1..=pieces {
            let t = i as f32 / pieces as f32;
            let (ab, bc, cd) = (a.lerp(b, t), b.lerp(c, t), c.lerp(d, t));
            self.add(ab.lerp(bc, t).lerp(bc.lerp(cd, t), t));
        }
    }

    fn close(&mut self) {
        if let Some(outline) = self.outlines.last_mut()
            && outline.len() > 1
            && outline.first() == outline.last()
        {
            outline.pop();
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn style(name: &str, size: f32) -> TextStyle {
        TextStyle {
            face: Face::named(name),
            size,
            spacing: 1.0,
            justify: Justify::Left,
            complexity: 0.5,
        }
    }

    fn every_face() -> impl Iterator<Item = Face> {
        [Family::Serif, Family::Sans, Family::Mono]
            .into_iter()
            .flat_map(|f| (0..4).map(move |s| Face::plain(f, s & 1 != 0, s & 2 != 0)))
    }

    #[test]
    fn fonts_are_found_by_the_names_files_use() {
        let face = Face::named("Helvetica-BoldOblique");
        assert_eq!(
            (face.family, face.bold, face.italic),
            (Family::Sans, true, true)
        );
        assert_eq!(Face::named("Times New Roman").family, Family::Serif);
        assert_eq!(Face::named("Courier").family, Family::Mono);
        assert_eq!(Face::named("defaultFont"), Face::DEFAULT);
        assert!(Face::named("Times-Roman:Bold Italic").bold);
    }

    /// A letter I of a sans serif is one rectangle, so its area and volume are known.
    #[test]
    fn an_extruded_i_is_a_box_facing_outward() {
        let (mesh, _) = text3(&["I"], &style("Helvetica", 2.0), 7, None, 0.0);
        assert!(mesh.is_sound());
        assert_eq!(mesh.triangles.len(), 12);
        let (lo, hi) = mesh.bounds().unwrap();
        assert_eq!((lo.z, hi.z), (-1.0, 0.0));
        let size = (hi - lo).as_dvec3();
        let volume = size.x * size.y * size.z;
        assert!(
            (mesh.volume() - volume).abs() < 1e-6 * volume,
            "{}",
            mesh.volume()
        );
        for (i, t) in mesh.triangles.iter().enumerate() {
            let [a, b, c] = t.map(|i| mesh.positions[i as usize]);
            let normal = mesh.normals[t[0] as usize];
            assert!(
                (b - a).cross(c - a).dot(normal) > 0.0,
                "triangle {i} faces its normal"
            );
        }
    }

    /// The sides and the faces meet without gaps only if outlines and fills agree; then the
    /// volume is the area of the face times the depth. Left out are the letters whose accents
    /// overlap them in the typefaces, which the volume counts twice there.
    #[test]
    fn every_glyph_is_closed_and_faces_outward() {
        let all: String = (' '..='~').chain('\u{a1}'..='\u{ff}').collect();
        for face in every_face() {
            let style = TextStyle {
                face,
                ..style("", 1.0)
            };
            for c in all.chars().filter(|c| !"ÅÇç".contains(*c)) {
                let line = [c.to_string()];
                let (mesh, _) = text3(&line, &style, 7, None, 0.0);
                let (front, _) = text3(&line, &style, FRONT, None, 0.0);
                assert!(mesh.is_sound(), "{c} {face:?}");
                let difference = (mesh.volume() - front.area()).abs();
                assert!(difference < 2e-4, "{c} {face:?}: {difference}");
            }
        }
    }

    #[test]
    fn a_profile_bevels_outward_and_ends_at_its_depth() {
        let profile = [
            Vec2::ZERO,
            Vec2::splat(0.05),
            Vec2::new(0.25, 0.05),
            Vec2::new(0.3, 0.0),
        ];
        let sans = style("Helvetica", 1.0);
        let (plain, _) = text3(&["I"], &sans, 7, None, 0.0);
        let (mesh, _) = text3(&["I"], &sans, 7, Some(&profile), 0.0);
        let ((p0, p1), (lo, hi)) = (plain.bounds().unwrap(), mesh.bounds().unwrap());
        assert!((lo.x - (p0.x - 0.05)).abs() < 1e-6 && (hi.y - (p1.y + 0.05)).abs() < 1e-6);
        assert_eq!((lo.z, hi.z), (-0.3, 0.0));
        assert!(mesh.volume() > 0.0);
    }

    /// Widths of Times, Helvetica and Courier in Coin at size 10, from its bounding boxes.
    #[test]
    fn lines_are_as_long_as_coins() {
        for (name, text, width) in [
            ("Times-Roman", "H", 7.25),
            ("Times-Roman:Bold", "H", 7.75),
            ("Helvetica", "HH", 14.5),
            ("Helvetica", "gx", 10.5),
            ("Courier", "gx", 12.0),
        ] {
            let laid = layout(&[text], &style(name, 10.0));
            assert!((laid.right - width).abs() < 1e-4, "{name}: {}", laid.right);
        }
    }

    #[test]
    fn lines_go_down_by_size_and_spacing_and_justify() {
        let base = TextStyle {
            spacing: 2.0,
            justify: Justify::Right,
            ..style("Courier", 10.0)
        };
        let laid = layout(&["ab", "", "c"], &base);
        let places: Vec<_> = laid
            .glyphs
            .iter()
            .map(|g| (g.origin.x, g.origin.y))
            .collect();
        assert_eq!(places, [(-12.0, 0.0), (-6.0, 0.0), (-6.0, -40.0)]);
    }

    #[test]
    fn a_width_spreads_a_line_or_presses_it() {
        let sans = style("Helvetica", 1.0);
        for wanted in [4.0_f32, 0.5] {
            let (mesh, _) = ascii_text(&["HH"], &sans, &[wanted]);
            let (lo, hi) = mesh.bounds().unwrap();
            let bearing = if wanted > 1.0 { lo.x } else { 0.0 };
            assert!(
                (hi.x - bearing - wanted + lo.x.min(bearing)).abs() < 0.01,
                "{lo} {hi}"
            );
        }
    }

    #[test]
    fn vrml97_aligns_lines_on_both_axes() {
        let middle = Vrml97Style::DEFAULT.justified(&["MIDDLE", "MIDDLE"]);
        let laid = vrml97_layout(&["HH", "HH"], &middle, &[], 0.0);
        assert!((laid.left + laid.right).abs() < 1e-6);
        let ys: Vec<f32> = laid.glyphs.iter().map(|g| g.origin.y).collect();
        let center = 0.5 * (ys[0] + ABOVE + ys[2] - (1.0 - ABOVE));
        assert!(center.abs() < 1e-6, "{center}");
        let squeezed = vrml97_layout(&["HHHH", "HH"], &Vrml97Style::DEFAULT, &[], 1.0);
        assert!((squeezed.right - 1.0).abs() < 1e-6);
    }

    #[test]
    fn no_text_and_odd_numbers_draw_nothing_bad() {
        for size in [0.0, -1.0, f32::NAN, f32::INFINITY] {
            let odd = TextStyle {
                complexity: f32::NAN,
                ..style("Times", size)
            };
            let (mesh, _) = text3(&["a\u{1F600}\n"], &odd, 7, Some(&[Vec2::NAN]), f32::NAN);
            assert!(
                mesh.triangles
                    .iter()
                    .flatten()
                    .all(|&i| (i as usize) < mesh.positions.len())
            );
        }
        assert_eq!(
            text3::<&str>(&[], &style("", 1.0), 7, None, 0.0).0,
            Mesh::default()
        );
        let long = "x".repeat(MAX_GLYPHS + 5);
        assert_eq!(layout(&[long], &style("", 1.0)).glyphs.len(), MAX_GLYPHS);
    }
}
