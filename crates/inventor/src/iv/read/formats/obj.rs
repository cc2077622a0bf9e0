//! Reads Wavefront's OBJ (Wavefront Technologies, *Advanced Visualizer Manual*, appendix B1).
//!
//! The faces of one group with one material and the same kinds of corners become one `Shape` with
//! an `IndexedFaceSet`. A group with several of them is a `Group`. Smoothing groups become normals,
//! because they cross groups and materials. Colors after the coordinates of a vertex, which many
//! programs write, are read.

use std::collections::HashMap;

use glam::{DVec3, Vec2, Vec3};
use indexmap::IndexMap;
use ivcam_base::diag::{Result, Span, excerpt};
use ivcam_base::math::polygon_normal;

use super::builder::Builder;
use super::mtl::MaterialLibraries;
use super::text_lines::{TextLine, text_lines};
use crate::grammar::value::{NodeId, Value};
use crate::grammar::{
    Field, NodeRefValue, class, color, coordinate, vrml97_group,
    vrml97_indexed_face_set as faces97, vrml97_indexed_line_set as lines97, vrml97_normal,
};
use crate::iv::display::linear_of_display;
use crate::iv::read::assemble::Assembler;
use crate::iv::read::numbers::float;

/// The bytes of lines after which the account of work is charged.
const CHUNK: usize = 1 << 16;

/// The lists of points and their like that corners refer to.
#[derive(Default)]
struct ObjLists {
    points: Vec<Vec3>,
    /// The color of each point; NaN for a point without one. Empty if no point has one.
    colors: Vec<Vec3>,
    coordinates: Vec<Vec2>,
    normals: Vec<Vec3>,
    /// The normals of smoothing groups at their points.
    smooth_normals: Vec<Vec3>,
}

/// What the primitives of a shape have in common.
#[derive(Clone, Default, PartialEq, Eq, Hash)]
struct ShapeKey {
    material: Option<usize>,
    is_smooth: bool,
    has_coordinates: bool,
    has_normals: bool,
    kind: Kind,
}

/// The kind of primitives of a shape.
#[derive(Clone, Copy, Default, PartialEq, Eq, Hash)]
enum Kind {
    #[default]
    Faces,
    Lines,
    Points,
}

/// The corners of the primitives of a shape, with −1 after each primitive.
#[derive(Default)]
struct IndexLists {
    points: Vec<i32>,
    coordinates: Vec<i32>,
    normals: Vec<i32>,
    span: Span,
}

/// The state of reading a file.
struct ObjReader<'a, 'd> {
    builder: Builder<'a, 'd>,
    lists: ObjLists,
    library: MaterialLibraries,
    /// The shapes of each group, by the name of the group.
    groups: IndexMap<String, IndexMap<ShapeKey, IndexLists>>,
    group: String,
    material: Option<usize>,
    /// The number of the smoothing group; 0 if there is none.
    smoothing: u32,
    /// The place in the smooth normals of each smoothing group at each point.
    smooth_places: HashMap<(u32, i32), i32>,
}

/// Reads the shapes of a file and returns the top-level nodes.
///
/// # Errors
/// Returns an error if a limit is exceeded.
pub(in crate::iv::read) fn read(asm: &mut Assembler<'_>, bytes: &[u8]) -> Result<Vec<NodeId>> {
    let mut reader = ObjReader {
        builder: Builder { asm },
        lists: ObjLists::default(),
        library: MaterialLibraries::default(),
        groups: IndexMap::new(),
        group: String::new(),
        material: None,
        smoothing: 0,
        smooth_places: HashMap::new(),
    };
    let mut charged = 0;
    for line in text_lines(bytes) {
        if line.start - charged >= CHUNK {
            reader
                .builder
                .asm
                .spend_read(line.start - charged, line.start)?;
            charged = line.start;
        }
        reader.line(line)?;
    }
    reader
        .builder
        .asm
        .spend_read(bytes.len() - charged, bytes.len())?;
    if reader.groups.is_empty() {
        reader.lone_points(Span::new(0, bytes.len()));
    }
    reader.shapes()
}

impl ObjReader<'_, '_> {
    fn line(&mut self, line: TextLine<'_>) -> Result<()> {
        let mut words = line.words();
        match words.next().unwrap_or_default() {
            "v" => self.vertex(line),
            "vt" => {
                let numbers = self.floats::<2>(line, 1);
                self.lists.coordinates.push(Vec2::from_array(numbers));
            }
            "vn" => {
                let numbers = self.floats::<3>(line, 3);
                self.lists.normals.push(Vec3::from_array(numbers));
            }
            "f" | "fo" => self.primitive(line, Kind::Faces),
            "l" => self.primitive(line, Kind::Lines),
            "p" => self.primitive(line, Kind::Points),
            "g" | "o" => self.group = line.after_first(),
            "s" => {
                self.smoothing = match words.next() {
                    None | Some("off") => 0,
                    Some(number) => number.parse().unwrap_or(1), // `on`, which some programs write
                }
            }
            "usemtl" => {
                let name = line.after_first();
                self.material = self.library.named(&name);
                if self.material.is_none() {
                    let name = excerpt(&name);
                    let message = format!("no material library has the material `{name}`");
                    self.builder
                        .warn(line.span(), message)
                        .help("its faces are gray");
                }
            }
            "mtllib" => self.library.read(&mut self.builder, line)?,
            word if word.starts_with('#') => {}
            "lod" | "bevel" | "c_interp" | "d_interp" | "shadow_obj" | "trace_obj" | "usemap"
            | "maplib" | "mg" => {}
            word => {
                let message = format!("the statement `{}` is not read", excerpt(word));
                let help =
                    "of OBJ, polygons, lines and points are read; curves and surfaces are not";
                self.builder.warn(line.span(), message).help(help);
            }
        }
        Ok(())
    }

    /// Reads numbers, of which the first `least` must be there.
    fn floats<const N: usize>(&mut self, line: TextLine<'_>, least: usize) -> [f32; N] {
        let mut numbers = [0.0; N];
        let words = line.words().skip(1);
        let mut count = 0;
        for (number, word) in numbers.iter_mut().zip(words) {
            match float(word.as_bytes()) {
                Ok(([], n)) => *number = n,
                _ => break,
            }
            count += 1;
        }
        if count < least {
            let message = format!("expected {least} numbers; 0 is used for those that are missing");
            self.builder.damage(line.span(), message);
        }
        numbers
    }

    fn vertex(&mut self, line: TextLine<'_>) {
        // After three coordinates come a weight, a color, or a weight and a color.
        let count = line.words().count() - 1;
        let numbers = self.floats::<7>(line, 3);
        self.lists.points.push(Vec3::from_slice(&numbers[..3]));
        let color = match count {
            6 => Some(Vec3::from_slice(&numbers[3..6])),
            7 => Some(Vec3::from_slice(&numbers[4..7])),
            _ => None,
        };
        if color.is_some() || !self.lists.colors.is_empty() {
            let before = self.lists.points.len() - 1;
            self.lists.colors.resize(before, Vec3::NAN);
            self.lists.colors.push(color.unwrap_or(Vec3::NAN));
        }
    }

    /// Reads the corners of a primitive: `point`, `point/coordinate`, `point//normal` or
    /// `point/coordinate/normal`.
    fn primitive(&mut self, line: TextLine<'_>, kind: Kind) {
        let counts = [
            self.lists.points.len(),
            self.lists.coordinates.len(),
            self.lists.normals.len(),
        ];
        let mut corners: Vec<[Option<i32>; 3]> = Vec::new();
        for word in line
            .words()
            .skip(1)
            .take_while(|word| !word.starts_with('#'))
        {
            let Some(corner) = corner(word, counts) else {
                let message = format!("`{}` is no corner; its face is left out", excerpt(word));
                self.builder
                    .damage(line.span(), message)
                    .help("a corner is a number, or numbers with `/` between them, not 0");
                return;
            };
            corners.push(corner);
        }
        let least = match kind {
            Kind::Faces => 3,
            Kind::Lines => 2,
            Kind::Points => 1,
        };
        if corners.len() < least {
            let message = format!("a primitive has fewer than {least} corners, and is left out");
            self.builder.warn(line.span(), message);
            return;
        }
        let has = |place: usize| corners.iter().all(|corner| corner[place].is_some());
        let is_face = kind == Kind::Faces;
        let key = ShapeKey {
            material: self.material,
            is_smooth: self.smoothing != 0 && is_face && !has(2),
            has_coordinates: is_face && has(1),
            has_normals: is_face && has(2),
            kind,
        };
        if key.is_smooth {
            for [point, _, normal] in &mut corners {
                let place = (self.smoothing, point.unwrap_or(0));
                let next = self.smooth_places.len() as i32;
                *normal = Some(*self.smooth_places.entry(place).or_insert(next));
            }
        }
        let shapes = match self.groups.get_mut(&self.group) {
            Some(shapes) => shapes,
            None => self.groups.entry(self.group.clone()).or_default(),
        };
        let (wants_coordinates, wants_normals) =
            (key.has_coordinates, key.has_normals || key.is_smooth);
        let shape = shapes.entry(key).or_insert_with(|| IndexLists {
            span: line.span(),
            ..IndexLists::default()
        });
        shape.span.end = line.span().end;
        let put = |list: &mut Vec<i32>, place: usize| {
            list.extend(corners.iter().map(|corner| corner[place].unwrap_or(0)));
            if kind != Kind::Points {
                list.push(-1);
            }
        };
        put(&mut shape.points, 0);
        if wants_coordinates {
            put(&mut shape.coordinates, 1);
        }
        if wants_normals {
            put(&mut shape.normals, 2);
        }
    }

    /// Draws the points of a file without faces, lines and points, which is a cloud of them.
    fn lone_points(&mut self, span: Span) {
        let points: Vec<i32> = (0..self.lists.points.len() as i32).collect();
        if points.is_empty() {
            return;
        }
        let help = "its vertices are drawn as points";
        let message = "the file has no faces, lines and points";
        self.builder.warn(span, message).help(help);
        let key = ShapeKey {
            kind: Kind::Points,
            ..ShapeKey::default()
        };
        let corners = IndexLists {
            points,
            span,
            ..IndexLists::default()
        };
        let group = self.groups.entry(self.group.clone()).or_default();
        group.insert(key, corners);
    }

    /// Computes the normals of the smoothing groups. All faces at a point have the same weight, as
    /// by crease angles. A face that another cancels, such as its back, has a normal of its own.
    fn smooth(&mut self) {
        let count = self.smooth_places.len();
        let (mut sums, mut last_face) = (vec![DVec3::ZERO; count], vec![usize::MAX; count]);
        let points = &self.lists.points;
        let shapes = self.groups.values_mut().flatten();
        let mut shapes: Vec<_> = shapes
            .filter_map(|(key, corners)| key.is_smooth.then_some(corners))
            .collect();
        let mut face = 0;
        for shape in &shapes {
            for (corners, places) in faces(&shape.points).zip(faces(&shape.normals)) {
                let normal = face_normal(points, corners);
                for place in places.iter().map(|&place| place as usize) {
                    if std::mem::replace(&mut last_face[place], face) != face {
                        sums[place] += normal;
                    }
                }
                face += 1;
            }
        }
        for shape in &mut shapes {
            let places = shape.normals.split_mut(|&place| place < 0);
            for (corners, places) in faces(&shape.points).zip(places) {
                let normal = face_normal(points, corners);
                for place in places {
                    let sum = sums[*place as usize];
                    if sum.dot(normal) < 1e-3 {
                        *place = sums.len() as i32;
                        sums.push(sum + normal);
                    }
                }
            }
        }
        let unit = |sum: DVec3| sum.normalize_or_zero().as_vec3();
        self.lists.smooth_normals = sums.into_iter().map(unit).collect();
    }

    /// Adds the nodes of all groups.
    fn shapes(mut self) -> Result<Vec<NodeId>> {
        self.smooth();
        let mut roots = Vec::new();
        for (name, shapes) in std::mem::take(&mut self.groups) {
            let spans = shapes.values().map(|corners| corners.span);
            let span = spans.reduce(|a, b| Span {
                start: a.start,
                end: b.end.max(a.end),
            });
            let mut nodes = Vec::with_capacity(shapes.len());
            for (key, corners) in shapes {
                nodes.push(self.shape(&key, corners)?);
            }
            match nodes[..] {
                [node] => {
                    self.builder.name(node, &name);
                    roots.push(node);
                }
                _ => {
                    let span = span.unwrap_or_default();
                    let group = self.builder.node(class::VRML97_GROUP, span)?;
                    self.builder
                        .set(group, vrml97_group::CHILDREN, Value::Nodes(nodes));
                    self.builder.name(group, &name);
                    roots.push(group);
                }
            }
        }
        Ok(roots)
    }

    /// Adds the node of a shape.
    fn shape(&mut self, key: &ShapeKey, mut corners: IndexLists) -> Result<NodeId> {
        let span = corners.span;
        let has_colors = corners.points.iter().all(|&point| {
            let color = usize::try_from(point).map(|point| self.lists.colors.get(point));
            color.is_err() || color.is_ok_and(|color| color.is_some_and(|c| !c.is_nan()))
        });
        let mut same = corners.points.clone();
        let mut colors = has_colors.then(|| used(&self.lists.colors, &mut same));
        if key.kind == Kind::Faces
            && key
                .material
                .is_some_and(|number| self.library.is_unlit(number))
        {
            // Colors of X3D's `UnlitMaterial` are linear.
            let colors = colors.iter_mut().flatten();
            colors.for_each(|color| *color = color.map(linear_of_display));
        }
        let points = Value::Vec3s(used(&self.lists.points, &mut corners.points));
        let class = match key.kind {
            Kind::Faces => class::VRML97_INDEXED_FACE_SET,
            Kind::Lines => class::VRML97_INDEXED_LINE_SET,
            Kind::Points => class::VRML97_POINT_SET,
        };
        let builder = &mut self.builder;
        let geometry = builder.node(class, span)?;
        let coord = builder.with(class::COORDINATE, coordinate::POINT, points, span)?;
        let put = |builder: &mut Builder<'_, '_>, field: Field<NodeRefValue>, node| {
            builder.set(geometry, field, Value::Node(Some(node)));
        };
        put(builder, faces97::COORD, coord);
        if let Some(colors) = colors {
            let colors = Value::Vec3s(colors);
            let node = builder.with(class::COLOR, color::COLOR, colors, span)?;
            put(builder, faces97::COLOR, node);
        }
        match key.kind {
            Kind::Points => return self.finish(key, geometry, span),
            Kind::Lines => {
                let index = Value::Ints(corners.points);
                self.builder.set(geometry, lines97::COORD_INDEX, index);
                return self.finish(key, geometry, span);
            }
            Kind::Faces => {}
        }
        builder.set(geometry, faces97::COORD_INDEX, Value::Ints(corners.points));
        builder.set(geometry, faces97::SOLID, Value::Bool(false));
        builder.set(geometry, faces97::CONVEX, Value::Bool(false));
        if key.has_coordinates {
            let list = used(&self.lists.coordinates, &mut corners.coordinates);
            let node = builder.texture_coordinates(list, span)?;
            put(builder, faces97::TEX_COORD, node);
            let index = Value::Ints(corners.coordinates);
            builder.set(geometry, faces97::TEX_COORD_INDEX, index);
        }
        if key.has_normals || key.is_smooth {
            let normals = match key.is_smooth {
                true => &self.lists.smooth_normals,
                false => &self.lists.normals,
            };
            let list = Value::Vec3s(used(normals, &mut corners.normals));
            let node = builder.with(class::VRML97_NORMAL, vrml97_normal::VECTOR, list, span)?;
            put(builder, faces97::NORMAL, node);
            builder.set(
                geometry,
                faces97::NORMAL_INDEX,
                Value::Ints(corners.normals),
            );
        }
        self.finish(key, geometry, span)
    }

    /// Adds the `Shape` of a geometry.
    fn finish(&mut self, key: &ShapeKey, geometry: NodeId, span: Span) -> Result<NodeId> {
        let appearance = match key.material {
            Some(material) => {
                self.library
                    .appearance(&mut self.builder, material, key.kind == Kind::Faces)?
            }
            None if key.kind != Kind::Faces => return self.builder.unlit_shape(geometry, span),
            None => self.library.plain(&mut self.builder)?,
        };
        self.builder.shape(appearance, geometry, span)
    }
}

/// Returns the corners of each face.
fn faces(index: &[i32]) -> impl Iterator<Item = &[i32]> {
    index.split(|&n| n < 0)
}

/// Returns the unit normal of a polygon, or zero if it has no area.
fn face_normal(points: &[Vec3], corners: &[i32]) -> DVec3 {
    let corners = corners.iter().filter_map(|&n| points.get(n as usize));
    polygon_normal(corners.map(|point| point.as_dvec3())).normalize_or_zero()
}

/// Reads a corner. Negative numbers count back from the last entry of a list so far.
fn corner(word: &str, counts: [usize; 3]) -> Option<[Option<i32>; 3]> {
    let mut corner = [None; 3];
    let mut parts = word.split('/');
    for (place, count) in counts.into_iter().enumerate() {
        let part = parts.next().unwrap_or_default();
        if part.is_empty() {
            continue;
        }
        let number: i64 = part.parse().ok()?;
        let index = match number {
            1.. => number - 1,
            ..=-1 => number + count as i64,
            0 => return None,
        };
        corner[place] = Some(i32::try_from(index).ok().filter(|index| *index >= 0)?);
    }
    corner[0].is_some().then_some(corner)
}

/// Returns the entries of a list that an index uses, and changes the index to theirs. An index that
/// does not exist stays one that does not.
fn used<T: Copy>(list: &[T], index: &mut [i32]) -> Vec<T> {
    let exists = |n: i32| usize::try_from(n).is_ok_and(|n| n < list.len());
    let existing = || index.iter().copied().filter(|&n| exists(n));
    let (Some(first), Some(last)) = (existing().min(), existing().max()) else {
        return Vec::new();
    };
    let range = first as usize..=last as usize;
    if range.clone().count() <= 4 * index.len() {
        for n in index.iter_mut().filter(|n| **n >= 0) {
            *n = if exists(*n) { *n - first } else { i32::MAX };
        }
        return list[range].to_vec();
    }
    let mut places: HashMap<i32, i32> = HashMap::new();
    let mut out = Vec::new();
    for n in index.iter_mut().filter(|n| **n >= 0) {
        if !exists(*n) {
            *n = i32::MAX;
            continue;
        }
        *n = *places.entry(*n).or_insert_with(|| {
            out.push(list[*n as usize]);
            out.len() as i32 - 1
        });
    }
    out
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn an_index_leads_to_the_same_entries_after_unused_ones_are_dropped() {
        let list: Vec<u32> = (0..1000).collect();
        for index in [vec![5, 7, 6, -1, 5, 9, 7, -1], vec![999, 0, 500, -1]] {
            let mut own = index.clone();
            let kept = used(&list, &mut own);
            assert!(kept.len() <= 5);
            for (before, after) in index.iter().zip(&own) {
                match before {
                    -1 => assert_eq!(*after, -1),
                    n => assert_eq!(kept[*after as usize], *n as u32),
                }
            }
        }
        let mut beyond = [0, 1000, -1];
        assert_eq!(used(&list, &mut beyond), [0]);
        assert_eq!(beyond, [0, i32::MAX, -1]);
    }

    #[test]
    fn a_corner_counts_from_one_or_back_from_the_last() {
        let counts = [8, 4, 2];
        assert_eq!(corner("1", counts), Some([Some(0), None, None]));
        assert_eq!(corner("-1/2/-2", counts), Some([Some(7), Some(1), Some(0)]));
        assert_eq!(corner("3//1", counts), Some([Some(2), None, Some(0)]));
        for wrong in ["0", "-9", "a", "/1", "1/x", ""] {
            assert_eq!(corner(wrong, counts), None, "{wrong}");
        }
    }
}
