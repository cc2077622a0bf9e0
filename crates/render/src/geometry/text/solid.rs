//! Triangulates `Text3`, whose glyphs are swept along a profile.

use std::collections::BTreeMap;

use glam::{Vec2, Vec3};

use super::batch::{GlyphBatch, TextOutput};
use super::glyph::{FlatGlyph, GlyphCache};
use super::layout::{Layout, layout};
use super::style::TextStyle;
use crate::geometry::mesh::TriangleMesh;

/// The parts of a `Text3` that are drawn. In the [`TriangleMesh`] they are parts 0, 1 and 2.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct SolidParts {
    /// The front faces.
    pub front: bool,
    /// The sides.
    pub sides: bool,
    /// The back faces.
    pub back: bool,
}

impl SolidParts {
    /// The default of the field `parts`.
    pub const FRONT: Self = Self {
        front: true,
        sides: false,
        back: false,
    };
    #[cfg(test)]
    pub(crate) const ALL: Self = Self {
        front: true,
        sides: true,
        back: true,
    };
}

/// Draws the triangles of a `Text3`, and returns the layout of its glyphs. Glyphs are in
/// the plane of x and y and are swept toward −z along a profile.
///
/// A profile is a polyline of points (depth behind z = 0, distance outward from the outline);
/// `None` means (0, 0) to (1, 0). Sides are smooth where the outline or the profile turns by less
/// than `crease_angle`, in radians. One unit of the texture coordinates is one font height, from
/// the start of the first baseline (SGI's reference page of SoText3).
///
/// If the profile does not start at distance 0, Coin leaves a gap around the front face. Here the
/// faces follow the profile, which closes the gap.
pub fn text3<S: AsRef<str>>(
    strings: &[S],
    style: &TextStyle<'_>,
    parts: SolidParts,
    profile: Option<&[Vec2]>,
    crease_angle: f32,
    output: TextOutput<'_>,
) -> Layout {
    let straight = [Vec2::ZERO, Vec2::X];
    let profile = profile
        .filter(|p| p.len() > 1 && p.iter().all(|v| v.is_finite()))
        .unwrap_or(&straight);
    let laid = layout(strings, style);
    let pen = Pen {
        size: style.size,
        parts,
        profile,
        smooth: libm::cosf(crease_angle.clamp(0.0, std::f32::consts::PI)),
        per_unit: if style.size > 0.0 {
            1.0 / style.size
        } else {
            0.0
        },
    };
    let mut flat = GlyphCache::new(style.face, style.complexity);
    let mut solid: BTreeMap<char, SolidGlyph> = BTreeMap::new();
    let mut batch = GlyphBatch::new(output);
    for glyph in &laid.glyphs {
        batch.add(glyph, |origin, mesh| {
            let make = || pen.solid(flat.get(glyph.character));
            let cut = solid.entry(glyph.character).or_insert_with(make);
            cut.put(origin, pen.per_unit, mesh);
        });
    }
    batch.finish();
    laid
}

/// The triangles of a glyph, relative to its origin.
#[derive(Debug, Default)]
struct SolidGlyph {
    vertices: Vec<SolidVertex>,
    triangles: Vec<[u32; 3]>,
    /// The part of each triangle.
    parts: Vec<u8>,
}

#[derive(Clone, Copy, Debug)]
struct SolidVertex {
    /// The position in the plane of the text, relative to the glyph's origin.
    place: Vec2,
    /// The distance behind the plane.
    depth: f32,
    normal: Vec3,
    texture: TextureOf,
}

/// The texture coordinates of a vertex.
#[derive(Clone, Copy, Debug)]
enum TextureOf {
    /// The coordinates of the point in the text, with s multiplied by this factor.
    Face(f32),
    /// Fixed coordinates.
    Side(Vec2),
}

impl SolidGlyph {
    /// Adds the glyph to a mesh.
    fn put(&self, origin: Vec2, per_unit: f32, mesh: &mut TriangleMesh) {
        let first = mesh.positions.len() as u32;
        for vertex in &self.vertices {
            let p = origin + vertex.place;
            let texcoord = match vertex.texture {
                TextureOf::Face(mirror) => p * Vec2::new(mirror, 1.0) * per_unit,
                TextureOf::Side(texcoord) => texcoord,
            };
            mesh.vertex(p.extend(-vertex.depth), vertex.normal, texcoord);
        }
        let triangles = self.triangles.iter();
        mesh.triangles
            .extend(triangles.map(|t| t.map(|i| first + i)));
        mesh.parts.extend(&self.parts);
    }
}

/// Makes the faces and sides of solid glyphs.
struct Pen<'a> {
    size: f32,
    parts: SolidParts,
    profile: &'a [Vec2],
    /// The cosine of the crease angle.
    smooth: f32,
    /// The inverse of the font's size, or 0.
    per_unit: f32,
}

impl Pen<'_> {
    /// Makes a glyph.
    fn solid(&self, cut: &FlatGlyph) -> SolidGlyph {
        let mut out = SolidGlyph::default();
        if self.parts.front {
            self.face(cut, true, &mut out);
        }
        if self.parts.sides {
            self.sides(cut, &mut out);
        }
        if self.parts.back {
            self.face(cut, false, &mut out);
        }
        out
    }

    /// Adds the front or the back of a glyph.
    fn face(&self, cut: &FlatGlyph, front: bool, out: &mut SolidGlyph) {
        let end = self.profile[if front { 0 } else { self.profile.len() - 1 }];
        let swollen;
        let cut = if end.y == 0.0 || self.size == 0.0 {
            cut
        } else {
            let by = end.y / self.size;
            swollen = FlatGlyph::fill(cut.outlines.iter().map(|o| swell(o, by)).collect());
            &swollen
        };
        let (normal, mirror) = if front {
            (Vec3::Z, 1.0)
        } else {
            (Vec3::NEG_Z, -1.0)
        };
        let first = out.vertices.len() as u32;
        out.vertices.extend(cut.points.iter().map(|&p| SolidVertex {
            place: self.size * p,
            depth: end.x,
            normal,
            texture: TextureOf::Face(mirror),
        }));
        for &[a, b, c] in &cut.triangles {
            let triangle = if front { [a, b, c] } else { [a, c, b] };
            out.triangles.push(triangle.map(|i| first + i));
            out.parts.push(if front { 0 } else { 2 });
        }
    }

    /// Adds the sides of a glyph.
    fn sides(&self, cut: &FlatGlyph, out: &mut SolidGlyph) {
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
                        let depth = self.profile[rim].x;
                        SolidVertex {
                            place: rims[rim][at],
                            depth,
                            normal: (normal * s.x).extend(s.y),
                            texture: TextureOf::Side(Vec2::new((rear - depth) * self.per_unit, t)),
                        }
                    };
                    let (start, end) = normals[edge];
                    // Clockwise as seen from outside, for an outline with its fill on the right.
                    let a = out.vertices.len() as u32;
                    out.vertices.extend([
                        corner(edge, k, start, slope.0, along),
                        corner(edge, k + 1, start, slope.1, along),
                        corner(next, k + 1, end, slope.1, along + length),
                        corner(next, k, end, slope.0, along + length),
                    ]);
                    out.triangles.extend([[a, a + 2, a + 1], [a, a + 3, a + 2]]);
                    out.parts.extend([1, 1]);
                }
                along += length;
            }
        }
    }
}

/// Returns the mean of two normals whose angle has a cosine above `smooth`, or else the first.
fn blended(a: Vec2, b: Vec2, smooth: f32) -> Vec2 {
    if a.dot(b) > smooth {
        (a + b).normalize_or(a)
    } else {
        a
    }
}

/// Returns the normal at both ends of each piece of a profile, as a unit vector (outward, toward
/// the front).
fn slopes(profile: &[Vec2], smooth: f32) -> Vec<(Vec2, Vec2)> {
    let normals: Vec<Vec2> = profile
        .windows(2)
        .map(|p| (p[1] - p[0]).try_normalize().unwrap_or(Vec2::X))
        .collect();
    let blend = |a, b| blended(a, b, smooth);
    (0..normals.len())
        .map(|i| {
            let n = normals[i];
            let before = normals[i.saturating_sub(1)];
            let after = normals[(i + 1).min(normals.len() - 1)];
            (blend(n, before), blend(n, after))
        })
        .collect()
}

/// Returns the outward normals at both ends of each edge of an outline with its fill on the right.
fn edge_normals(outline: &[Vec2], smooth: f32) -> Vec<(Vec2, Vec2)> {
    let n = outline.len();
    let flat: Vec<Vec2> = (0..n)
        .map(|i| outward(outline[i], outline[(i + 1) % n]))
        .collect();
    let blend = |a, b| blended(a, b, smooth);
    (0..n)
        .map(|i| {
            (
                blend(flat[i], flat[(i + n - 1) % n]),
                blend(flat[i], flat[(i + 1) % n]),
            )
        })
        .collect()
}

/// Returns the outward normal of an edge with its fill on the right.
fn outward(from: Vec2, to: Vec2) -> Vec2 {
    (to - from).perp().normalize_or_zero()
}

/// Scales an outline by the font's size, then moves its edges outward.
fn swell_scaled(outline: &[Vec2], size: f32, by: f32) -> Vec<Vec2> {
    if by == 0.0 {
        return outline.iter().map(|p| size * *p).collect();
    }
    let scaled: Vec<Vec2> = outline.iter().map(|p| size * *p).collect();
    swell(&scaled, by)
}

/// Moves each edge outward. Corners are mitered. Where edges turn by more than 151° the miter would
/// be longer than four times the distance, so it is limited.
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
