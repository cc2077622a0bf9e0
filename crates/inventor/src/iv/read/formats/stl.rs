//! Reads STL, as text and binary (3D Systems, *StereoLithography Interface Specification*, 1989).
//!
//! A file states triangles without common corners and without materials. Each solid becomes a
//! `Shape` with a `TriangleSet`. The normals of the file are not used: they are those of the
//! triangles, or missing.

use glam::Vec3;
use ivcam_base::diag::{Result, Span};

use super::builder::Builder;
use super::text_lines::text_lines;
use crate::grammar::value::{NodeId, Value};
use crate::grammar::{class, coordinate, triangle_set};
use crate::iv::read::assemble::Assembler;
use crate::iv::read::header::{stl_count, stl_is_text};

/// Reads the triangles of a file and returns the shapes.
///
/// # Errors
/// Returns an error if a limit is exceeded.
pub(in crate::iv::read) fn read(asm: &mut Assembler<'_>, bytes: &[u8]) -> Result<Vec<NodeId>> {
    asm.spend_read(bytes.len(), 0)?;
    let mut builder = Builder { asm };
    match stl_is_text(bytes) {
        true => text(&mut builder, bytes),
        false => binary(&mut builder, bytes),
    }
}

/// Reads the text form.
fn text(builder: &mut Builder<'_, '_>, bytes: &[u8]) -> Result<Vec<NodeId>> {
    let mut shapes = Vec::new();
    let (mut name, mut start) = (String::new(), 0);
    let mut points: Vec<Vec3> = Vec::new();
    let mut first_of_facet = 0;
    let mut is_open = false;
    for line in text_lines(bytes) {
        let mut words = line.words();
        match words.next().map(str::to_ascii_lowercase).as_deref() {
            Some("solid") => (name, start, is_open) = (line.after_first(), line.start, true),
            Some("facet") => first_of_facet = points.len(),
            Some("vertex") => {
                let numbers: Vec<f32> = line.numbers().collect();
                match numbers[..] {
                    [x, y, z] => points.push(Vec3::new(x, y, z)),
                    _ => {
                        let message = "a `vertex` needs three numbers; its triangle is left out";
                        builder.damage(line.span(), message);
                    }
                }
            }
            Some("endfacet") if points.len() - first_of_facet != 3 => {
                if points.len() - first_of_facet > 3 {
                    let message = "a facet has more than three corners, and is left out";
                    builder.warn(line.span(), message);
                }
                points.truncate(first_of_facet);
            }
            Some("endsolid") => {
                let list = std::mem::take(&mut points);
                let span = Span::new(start, line.span().end as usize);
                shapes.extend(solid(builder, list, &name, span)?);
                (first_of_facet, is_open) = (0, false);
            }
            Some("outer" | "endloop" | "endfacet" | "color") => {}
            _ => {
                builder.damage(line.span(), "a line is none of STL's");
            }
        }
    }
    if is_open {
        let span = Span::at(bytes.len());
        builder
            .damage(span, "the file ends inside a solid")
            .help("the triangles before are kept");
        points.truncate(points.len() / 3 * 3);
        shapes.extend(solid(
            builder,
            points,
            &name,
            Span::new(start, bytes.len()),
        )?);
    }
    Ok(shapes)
}

/// Reads the binary form: 80 bytes, the number of triangles, and 50 bytes for each.
fn binary(builder: &mut Builder<'_, '_>, bytes: &[u8]) -> Result<Vec<NodeId>> {
    let body = bytes.get(84..).unwrap_or_default();
    let count = stl_count(bytes).unwrap_or(0);
    let triangles = body.chunks_exact(50).take(count as usize);
    let found = triangles.len();
    if (found as u64) < count {
        let message = format!("the file ends after {found} of {count} triangles");
        let help = "the triangles before are kept";
        builder.damage(Span::at(bytes.len()), message).help(help);
    } else if body.len() > 50 * found {
        let message = format!("more bytes follow the {count} triangles that the file states");
        let span = Span::new(84 + 50 * found, bytes.len());
        builder.damage(span, message).help("they are not read");
    }
    let mut points = Vec::with_capacity(3 * triangles.len());
    let mut has_attributes = false;
    for triangle in triangles {
        for corner in triangle[12..48].chunks_exact(12) {
            let number = |i: usize| f32::from_le_bytes(std::array::from_fn(|k| corner[4 * i + k]));
            points.push(Vec3::new(number(0), number(1), number(2)));
        }
        has_attributes |= triangle[48..] != [0, 0];
    }
    if has_attributes {
        let message =
            "the attributes of triangles, which some programs use for colors, are not read";
        builder.asm.document.sink.note(Span::at(84), message);
    }
    let name = String::from_utf8_lossy(bytes.get(..80).unwrap_or_default()).into_owned();
    if let Some(name) = name.split('\0').next().map(str::trim)
        && !name.is_empty()
        && builder.asm.source == 0
    {
        let meta = &mut builder.asm.document.meta;
        meta.push(("title".into(), name.into()));
    }
    Ok(solid(builder, points, "", Span::new(0, bytes.len()))?
        .into_iter()
        .collect())
}

/// Adds the shape of a solid, unless it has no triangles.
fn solid(
    builder: &mut Builder<'_, '_>,
    points: Vec<Vec3>,
    name: &str,
    span: Span,
) -> Result<Option<NodeId>> {
    if points.is_empty() {
        return Ok(None);
    }
    let points = Value::Vec3s(points);
    let coord = builder.with(class::COORDINATE, coordinate::POINT, points, span)?;
    let geometry = builder.node(class::TRIANGLE_SET, span)?;
    builder.set(geometry, triangle_set::COORD, Value::Node(Some(coord)));
    builder.set(geometry, triangle_set::SOLID, Value::Bool(false));
    let appearance = builder.plain_appearance()?;
    let shape = builder.shape(appearance, geometry, span)?;
    builder.name(shape, name);
    Ok(Some(shape))
}
