//! Reads PLY, as text and as binary of both orders of bytes (Greg Turk, *The PLY Polygon File
//! Format*, 1994).
//!
//! The vertices and faces of a file become one `Shape` with an `IndexedFaceSet`; triangle strips,
//! edges and points become shapes of their own kinds. Colors are those of a screen, as in VRML97.

use glam::{Vec2, Vec3, Vec4};
use ivcam_base::diag::{Diagnostic, ErrorKind, Result, Span, excerpt};

use super::builder::Builder;
use crate::grammar::value::{NodeId, Value};
use crate::grammar::{
    appearance, class, color, color_rgba, coordinate, image_texture,
    vrml97_indexed_face_set as faces97, vrml97_indexed_line_set as lines97, vrml97_material,
    vrml97_normal,
};
use crate::iv::encoding::text;
use crate::iv::read::assemble::Assembler;

/// The angle in radians up to which edges between faces without normals are smoothed: 30°. PLY does
/// not state it.
const CREASE_ANGLE: f32 = std::f32::consts::FRAC_PI_6;

/// The number of values after which the account of work is charged.
const CHUNK: usize = 1 << 14;

/// The type of a number.
#[derive(Clone, Copy, Debug, PartialEq)]
enum Number {
    Signed(usize),
    Unsigned(usize),
    Float(usize),
}

impl Number {
    fn named(name: &str) -> Option<Self> {
        Some(match name {
            "char" | "int8" => Self::Signed(1),
            "uchar" | "uint8" => Self::Unsigned(1),
            "short" | "int16" => Self::Signed(2),
            "ushort" | "uint16" => Self::Unsigned(2),
            "int" | "int32" => Self::Signed(4),
            "uint" | "uint32" => Self::Unsigned(4),
            "float" | "float32" => Self::Float(4),
            "double" | "float64" => Self::Float(8),
            _ => return None,
        })
    }

    fn bytes(self) -> usize {
        match self {
            Self::Signed(n) | Self::Unsigned(n) | Self::Float(n) => n,
        }
    }

    /// The largest value of a color, which is 1: of integers their largest number. Colors in 32
    /// bits are 0 to 255, as programs write them whose other numbers have this type.
    fn most(self) -> f32 {
        match self {
            Self::Signed(4) | Self::Unsigned(4) => 255.0,
            Self::Signed(n) => ((1u64 << (8 * n - 1)) - 1) as f32,
            Self::Unsigned(n) => ((1u64 << (8 * n)) - 1) as f32,
            Self::Float(_) => 1.0,
        }
    }
}

/// A property of an element. A list has the type of its length.
struct Property {
    name: String,
    kind: Number,
    length: Option<Number>,
}

/// An element, such as `vertex`, with the number of its entries.
struct PlyElement {
    name: String,
    count: u64,
    properties: Vec<Property>,
}

/// The order of bytes, or text.
#[derive(Clone, Copy, PartialEq)]
enum PlyFormat {
    Text,
    LittleEndian,
    BigEndian,
}

/// The header of a file.
struct PlyHeader {
    form: PlyFormat,
    elements: Vec<PlyElement>,
    texture: Option<String>,
    length: usize,
}

/// The numbers of a file after its header.
struct PlyNumbers<'b> {
    bytes: &'b [u8],
    at: usize,
    form: PlyFormat,
    /// Whether each entry of the elements has a line of its own.
    by_line: bool,
}

/// What a file states.
#[derive(Default)]
struct PlyMesh {
    points: Vec<Vec3>,
    normals: Vec<Vec3>,
    colors: PlyColors,
    coordinates: Vec<Vec2>,
    /// The corners of faces, with −1 after each.
    faces: Vec<i32>,
    face_colors: PlyColors,
    /// The ends of edges, with −1 after each.
    edges: Vec<i32>,
}

/// The colors of the entries of an element.
#[derive(Default)]
struct PlyColors {
    list: Vec<Vec4>,
    has_alpha: bool,
}

impl PlyColors {
    /// Keeps the color of an entry, if its properties state one.
    fn read(&mut self, element: &PlyElement, uses: &[PropertyRole], values: &[f64]) {
        let mut color = None;
        for ((property, role), value) in element.properties.iter().zip(uses).zip(values) {
            if let PropertyRole::Color(i) = *role {
                color.get_or_insert(Vec4::W)[i] = *value as f32 / property.kind.most();
                self.has_alpha |= i == 3;
            }
        }
        self.list.extend(color);
    }

    /// Adds a node with the colors.
    fn node(self, builder: &mut Builder<'_, '_>, span: Span) -> Result<NodeId> {
        if self.has_alpha {
            let colors = Value::Vec4s(self.list);
            return builder.with(class::COLOR_RGBA, color_rgba::COLOR, colors, span);
        }
        let colors = Value::Vec3s(self.list.into_iter().map(Vec4::truncate).collect());
        builder.with(class::COLOR, color::COLOR, colors, span)
    }
}

/// Reads the mesh of a file and returns the shape.
///
/// # Errors
/// Returns an error if a limit is exceeded, or if the header is damaged.
pub(in crate::iv::read) fn read(asm: &mut Assembler<'_>, bytes: &[u8]) -> Result<Vec<NodeId>> {
    let mut builder = Builder { asm };
    let header = header(&mut builder, bytes)?;
    let mut numbers = PlyNumbers {
        bytes,
        at: header.length,
        form: header.form,
        by_line: header.has_lines_of_entries(bytes),
    };
    let mut mesh = PlyMesh::default();
    for element in &header.elements {
        if !mesh.element(&mut builder, element, &mut numbers)? {
            let message = format!("the file ends in the element `{}`", excerpt(&element.name));
            let help = "the entries before are kept";
            builder.damage(Span::at(numbers.at), message).help(help);
            break;
        }
    }
    mesh.shapes(
        &mut builder,
        header.texture.as_deref(),
        Span::new(0, bytes.len()),
    )
}

/// Reads the header.
fn header(builder: &mut Builder<'_, '_>, bytes: &[u8]) -> Result<PlyHeader> {
    let mut header = PlyHeader {
        form: PlyFormat::Text,
        elements: Vec::new(),
        texture: None,
        length: 0,
    };
    let mut at = 0;
    while at < bytes.len() {
        let end = bytes[at..].iter().position(|b| matches!(b, b'\n' | b'\r'));
        let end = end.map_or(bytes.len(), |end| at + end);
        let line = text(&bytes[at..end]);
        let span = Span::new(at, end);
        let is_pair = bytes[end..].starts_with(b"\r\n");
        at = end + if is_pair { 2 } else { 1 };
        let words: Vec<&str> = line.split_ascii_whitespace().collect();
        match words[..] {
            ["end_header", ..] => {
                header.length = at.min(bytes.len());
                return Ok(header);
            }
            ["format", form, ..] => {
                header.form = match form {
                    "ascii" => PlyFormat::Text,
                    "binary_little_endian" => PlyFormat::LittleEndian,
                    "binary_big_endian" => PlyFormat::BigEndian,
                    _ => {
                        let message = format!("`{}` is not a format", excerpt(form));
                        return Err(damaged(builder, span, message));
                    }
                }
            }
            ["element", name, count] => header.elements.push(PlyElement {
                name: name.into(),
                count: match count.parse() {
                    Ok(count) => count,
                    Err(_) => {
                        let message = format!("`{}` is no count", excerpt(count));
                        return Err(damaged(builder, span, message));
                    }
                },
                properties: Vec::new(),
            }),
            ["property", ref rest @ ..] => {
                let property = property(rest);
                match (property, header.elements.last_mut()) {
                    (Some(property), Some(element)) => element.properties.push(property),
                    _ => {
                        let message = format!("`{}` is no property", excerpt(&line));
                        return Err(damaged(builder, span, message));
                    }
                }
            }
            ["comment", "TextureFile", ..] => {
                let name = line
                    .split_once("TextureFile")
                    .map_or("", |(_, name)| name.trim());
                header.texture = Some(name.to_owned());
            }
            ["comment" | "obj_info", ..] if builder.asm.source == 0 => {
                let content = line
                    .split_once(char::is_whitespace)
                    .map_or("", |(_, c)| c.trim());
                let meta = &mut builder.asm.document.meta;
                meta.push((words[0].into(), content.into()));
            }
            _ => {}
        }
    }
    Err(damaged(
        builder,
        Span::at(bytes.len()),
        "the header has no end".into(),
    ))
}

impl PlyHeader {
    /// Whether a file of text has as many lines as entries. A line with more numbers than its entry
    /// then costs no other entry.
    fn has_lines_of_entries(&self, bytes: &[u8]) -> bool {
        let counts = self.elements.iter().map(|element| element.count);
        let count = counts.fold(0_u64, u64::saturating_add);
        self.form == PlyFormat::Text && {
            let lines = bytes[self.length..].split(|b| matches!(b, b'\n' | b'\r'));
            let lines = lines.filter(|line| !line.trim_ascii().is_empty());
            lines.count() as u64 == count
        }
    }
}

/// Returns the error of a damaged header.
fn damaged(builder: &Builder<'_, '_>, span: Span, message: String) -> Box<Diagnostic> {
    builder
        .asm
        .document
        .sink
        .error(span, message)
        .of_kind(ErrorKind::Damaged)
}

/// Reads the words after `property`.
fn property(words: &[&str]) -> Option<Property> {
    let (length, kind, name) = match *words {
        ["list", length, kind, name] => (Some(Number::named(length)?), kind, name),
        [kind, name] => (None, kind, name),
        _ => return None,
    };
    Some(Property {
        name: name.to_ascii_lowercase(),
        kind: Number::named(kind)?,
        length,
    })
}

impl PlyNumbers<'_> {
    /// Reads the next number, or returns `None` at the end.
    fn next(&mut self, kind: Number) -> Option<f64> {
        match self.form {
            PlyFormat::Text => self.word(),
            form => {
                let n = kind.bytes();
                let raw = self.bytes.get(self.at..self.at + n)?;
                self.at += n;
                let mut eight = [0u8; 8];
                eight[..n].copy_from_slice(raw);
                if form == PlyFormat::BigEndian {
                    eight[..n].reverse();
                }
                let bits = u64::from_le_bytes(eight);
                Some(match kind {
                    Number::Unsigned(_) => bits as f64,
                    Number::Signed(1) => f64::from(bits as u8 as i8),
                    Number::Signed(2) => f64::from(bits as u16 as i16),
                    Number::Signed(_) => f64::from(bits as u32 as i32),
                    Number::Float(4) => f64::from(f32::from_bits(bits as u32)),
                    Number::Float(_) => f64::from_bits(bits),
                })
            }
        }
    }

    fn word(&mut self) -> Option<f64> {
        let rest = self.bytes.get(self.at..)?;
        let start = self.at + rest.iter().position(|b| !b.is_ascii_whitespace())?;
        let rest = &self.bytes[start..];
        let length = rest
            .iter()
            .position(u8::is_ascii_whitespace)
            .unwrap_or(rest.len());
        self.at = start + length;
        std::str::from_utf8(&rest[..length]).ok()?.parse().ok()
    }

    /// Skips the rest of a line, if each entry has one. Returns whether that passes anything.
    fn end_line(&mut self) -> bool {
        let rest = match self.by_line {
            true => self.bytes.get(self.at..).unwrap_or_default(),
            false => &[],
        };
        let end = rest.iter().position(|b| matches!(b, b'\n' | b'\r'));
        let line = &rest[..end.unwrap_or(rest.len())];
        self.at += line.len();
        !line.trim_ascii().is_empty()
    }

    /// Reads a list by the types of its length and its numbers, and keeps it. Returns `None` at
    /// the end.
    fn list(&mut self, [length, kind]: [Number; 2], kept: Option<&mut Vec<i32>>) -> Option<()> {
        let length = self
            .next(length)
            .filter(|length| self.holds(*length, kind))?;
        match kept {
            None => (0..length as u64).try_for_each(|_| self.next(kind).map(drop)),
            Some(list) => {
                list.clear();
                (0..length as u64).try_for_each(|_| {
                    list.push(self.next(kind)? as i32);
                    Some(())
                })
            }
        }
    }

    /// Whether a whole list of numbers may remain.
    fn holds(&self, count: f64, kind: Number) -> bool {
        let least = if self.form == PlyFormat::Text {
            1
        } else {
            kind.bytes()
        };
        count >= 0.0
            && count * least as f64 <= (self.bytes.len() - self.at.min(self.bytes.len())) as f64
    }
}

/// Says what of an element is not drawn.
fn warn_about(builder: &mut Builder<'_, '_>, element: &PlyElement) {
    if !matches!(&*element.name, "vertex" | "face" | "tristrips" | "edge") {
        let message = format!("the element `{}` is not drawn", excerpt(&element.name));
        builder.warn(Span::at(0), message);
    }
    let is_by_corner = |p: &Property| p.name == "texcoord" && p.length.is_some();
    if element.name == "face" && element.properties.iter().any(is_by_corner) {
        let message = "texture coordinates by corner are not read";
        let help = "the texture is left out; coordinates of vertices are read";
        builder.warn(Span::at(0), message).help(help);
    }
}

impl PlyMesh {
    /// Reads the entries of an element. Returns `false` if the file ends among them.
    fn element(
        &mut self,
        builder: &mut Builder<'_, '_>,
        element: &PlyElement,
        numbers: &mut PlyNumbers<'_>,
    ) -> Result<bool> {
        let uses: Vec<PropertyRole> = element
            .properties
            .iter()
            .map(|p| PropertyRole::of(&element.name, p))
            .collect();
        warn_about(builder, element);
        if element.properties.is_empty() {
            return Ok(true);
        }
        let mut values = vec![0.0f64; element.properties.len()];
        let mut list: Vec<i32> = Vec::new();
        let mut charged = numbers.at;
        for entry in 0..element.count {
            if (entry as usize).is_multiple_of(CHUNK) {
                builder.asm.spend_read(numbers.at - charged, numbers.at)?;
                charged = numbers.at;
            }
            for (place, property) in element.properties.iter().enumerate() {
                let Some(length) = property.length else {
                    match numbers.next(property.kind) {
                        Some(value) => values[place] = value,
                        None => return Ok(false),
                    }
                    continue;
                };
                let kept = (uses[place] == PropertyRole::Corners).then_some(&mut list);
                if numbers.list([length, property.kind], kept).is_none() {
                    return Ok(false);
                }
            }
            let end = numbers.at;
            if numbers.end_line() {
                let message = format!(
                    "a `{}` has more numbers than the header states",
                    excerpt(&element.name)
                );
                let found = builder.damage(Span::new(end, numbers.at), message);
                found.help("the rest of its line is skipped");
            }
            match &*element.name {
                "vertex" => self.vertex(element, &uses, &values),
                "face" if self.face(&list) => self.face_colors.read(element, &uses, &values),
                "tristrips" => self.strips(&list),
                "edge" => self.edge(&uses, &values),
                _ => {}
            }
        }
        builder.asm.spend_read(numbers.at - charged, numbers.at)?;
        Ok(true)
    }

    fn vertex(&mut self, element: &PlyElement, uses: &[PropertyRole], values: &[f64]) {
        let mut point = [0.0f32; 3];
        let (mut normal, mut coordinate) = ([0.0f32; 3], [0.0f32; 2]);
        let (mut has_normal, mut has_coordinate) = (false, false);
        for (role, value) in uses.iter().zip(values) {
            let value = *value as f32;
            match *role {
                PropertyRole::Point(i) => point[i] = value,
                PropertyRole::Normal(i) => (normal[i], has_normal) = (value, true),
                PropertyRole::Texture(i) => (coordinate[i], has_coordinate) = (value, true),
                _ => {}
            }
        }
        self.points.push(Vec3::from_array(point));
        if has_normal {
            self.normals.push(Vec3::from_array(normal));
        }
        self.colors.read(element, uses, values);
        if has_coordinate {
            self.coordinates.push(Vec2::from_array(coordinate));
        }
    }

    /// Adds a face. Returns `false` if it has less than three corners.
    fn face(&mut self, corners: &[i32]) -> bool {
        let is_face = corners.len() >= 3;
        if is_face {
            self.faces.extend_from_slice(corners);
            self.faces.push(-1);
        }
        is_face
    }

    /// Adds the triangles of strips, which are separated by −1.
    fn strips(&mut self, corners: &[i32]) {
        for strip in corners.split(|&corner| corner < 0) {
            for (number, triangle) in strip.windows(3).enumerate() {
                let [a, b, c] = [triangle[0], triangle[1], triangle[2]];
                let triangle = if number % 2 == 0 {
                    [a, b, c]
                } else {
                    [b, a, c]
                };
                self.face(&triangle);
            }
        }
    }

    fn edge(&mut self, uses: &[PropertyRole], values: &[f64]) {
        let end = |i| uses.iter().position(|kind| *kind == PropertyRole::End(i));
        if let (Some(first), Some(second)) = (end(0), end(1)) {
            self.edges
                .extend([values[first] as i32, values[second] as i32, -1]);
        }
    }

    /// Adds the shapes of the mesh.
    fn shapes(
        mut self,
        builder: &mut Builder<'_, '_>,
        texture: Option<&str>,
        span: Span,
    ) -> Result<Vec<NodeId>> {
        let count = self.points.len();
        if count == 0 {
            builder.warn(span, "the file has no vertices");
            return Ok(Vec::new());
        }
        let points = Value::Vec3s(std::mem::take(&mut self.points));
        let coord = builder.with(class::COORDINATE, coordinate::POINT, points, span)?;
        let colors = std::mem::take(&mut self.colors);
        let color = (colors.list.len() == count)
            .then(|| colors.node(builder, span))
            .transpose()?;
        let appearance = builder.plain_appearance()?;
        let mut shapes = Vec::new();
        if !self.faces.is_empty() {
            let faces = self.face_set(builder, coord, color, count, span)?;
            if let Some(name) = texture {
                let urls = Value::Strings(vec![name.into()]);
                let node = builder.with(class::IMAGE_TEXTURE, image_texture::URL, urls, span)?;
                builder.set(appearance, appearance::TEXTURE, Value::Node(Some(node)));
                // The texture multiplies this color. PLY states none.
                let white = Value::Vec3(Vec3::ONE);
                let material = builder.with(
                    class::VRML97_MATERIAL,
                    vrml97_material::DIFFUSE_COLOR,
                    white,
                    span,
                )?;
                builder.set(
                    appearance,
                    appearance::MATERIAL,
                    Value::Node(Some(material)),
                );
            }
            shapes.push(builder.shape(appearance, faces, span)?);
        }
        if !self.edges.is_empty() {
            let edges = std::mem::take(&mut self.edges);
            let lines = builder.node(class::VRML97_INDEXED_LINE_SET, span)?;
            builder.set(lines, lines97::COORD, Value::Node(Some(coord)));
            builder.set(lines, lines97::COLOR, Value::Node(color));
            builder.set(lines, lines97::COORD_INDEX, Value::Ints(edges));
            shapes.push(builder.unlit_shape(lines, span)?);
        }
        if shapes.is_empty() {
            let set = builder.node(class::VRML97_POINT_SET, span)?;
            builder.set(set, faces97::COORD, Value::Node(Some(coord)));
            builder.set(set, faces97::COLOR, Value::Node(color));
            shapes.push(builder.unlit_shape(set, span)?);
        }
        Ok(shapes)
    }

    fn face_set(
        &mut self,
        builder: &mut Builder<'_, '_>,
        coord: NodeId,
        color: Option<NodeId>,
        count: usize,
        span: Span,
    ) -> Result<NodeId> {
        let faces = builder.node(class::VRML97_INDEXED_FACE_SET, span)?;
        builder.set(faces, faces97::COORD, Value::Node(Some(coord)));
        let index = std::mem::take(&mut self.faces);
        let face_colors = std::mem::take(&mut self.face_colors);
        let number = index.iter().filter(|&&corner| corner < 0).count();
        builder.set(faces, faces97::COORD_INDEX, Value::Ints(index));
        builder.set(faces, faces97::SOLID, Value::Bool(false));
        builder.set(faces, faces97::CONVEX, Value::Bool(false));
        let mut color = color;
        if color.is_some() && !face_colors.list.is_empty() {
            let message = "colors of faces are not drawn where vertices have colors";
            builder.warn(span, message);
        } else if face_colors.list.len() == number {
            color = Some(face_colors.node(builder, span)?);
            builder.set(faces, faces97::COLOR_PER_VERTEX, Value::Bool(false));
        }
        if color.is_some() {
            builder.set(faces, faces97::COLOR, Value::Node(color));
        }
        if self.normals.len() == count {
            let normals = Value::Vec3s(std::mem::take(&mut self.normals));
            let node = builder.with(class::VRML97_NORMAL, vrml97_normal::VECTOR, normals, span)?;
            builder.set(faces, faces97::NORMAL, Value::Node(Some(node)));
        } else {
            builder.set(faces, faces97::CREASE_ANGLE, Value::Float(CREASE_ANGLE));
        }
        if self.coordinates.len() == count {
            let list = std::mem::take(&mut self.coordinates);
            let node = builder.texture_coordinates(list, span)?;
            builder.set(faces, faces97::TEX_COORD, Value::Node(Some(node)));
        }
        Ok(faces)
    }
}

/// What a property is used for, with the number of its component.
#[derive(Clone, Copy, PartialEq)]
enum PropertyRole {
    Point(usize),
    Normal(usize),
    Color(usize),
    Texture(usize),
    End(usize),
    Corners,
    Nothing,
}

impl PropertyRole {
    fn of(element: &str, property: &Property) -> Self {
        if property.length.is_some() {
            return match (element, &*property.name) {
                ("face" | "tristrips", "vertex_indices" | "vertex_index") => Self::Corners,
                _ => Self::Nothing,
            };
        }
        let at = |names: [&str; 4]| names.iter().position(|name| *name == property.name);
        if element == "edge" {
            return at(["vertex1", "vertex2", "", ""]).map_or(Self::Nothing, Self::End);
        }
        let name = property
            .name
            .strip_prefix("diffuse_")
            .unwrap_or(&property.name);
        let color = ["red", "green", "blue", "alpha"]
            .iter()
            .position(|n| *n == name);
        let short = at(["r", "g", "b", "a"]).or(color);
        let texture = at(["s", "t", "", ""])
            .or_else(|| at(["u", "v", "", ""]))
            .or_else(|| at(["texture_u", "texture_v", "", ""]));
        (at(["x", "y", "z", ""]).map(Self::Point))
            .or_else(|| at(["nx", "ny", "nz", ""]).map(Self::Normal))
            .or_else(|| short.map(Self::Color))
            .or_else(|| texture.map(Self::Texture))
            .unwrap_or(Self::Nothing)
    }
}
