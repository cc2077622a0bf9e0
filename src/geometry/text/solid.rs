//! Triangulates `Text3`, whose glyphs are swept along a profile.

use glam::{Vec2, Vec3};

use super::glyph::{FlatGlyph, GlyphCache};
use super::layout::{Layout, layout};
use super::style::TextStyle;
use crate::geometry::mesh::Mesh;

/// The parts of a `Text3` that are drawn. In the [`Mesh`] they are parts 0, 1 and 2.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) struct SolidParts {
    /// The front faces.
    pub front: bool,
    /// The sides.
    pub sides: bool,
    /// The back faces.
    pub back: bool,
}

impl SolidParts {
    /// The default of the field `parts`.
    pub(crate) const FRONT: Self = Self {
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

/// Returns the triangles of a `Text3`, and the layout of its glyphs. Glyphs are in the plane of x
/// and y and are swept toward −z along a profile.
///
/// A profile is a polyline of points (depth behind z = 0, distance outward from the outline);
/// `None` means (0, 0) to (1, 0). Sides are smooth where the outline or the profile turns by less
/// than `crease_angle`, in radians. One unit of the texture coordinates is one font height, from
/// the start of the first baseline (SGI's reference page of SoText3).
///
/// If the profile does not start at distance 0, Coin leaves a gap around the front face. Here the
/// faces follow the profile, which closes the gap.
pub(crate) fn text3<S: AsRef<str>>(
    strings: &[S],
    style: &TextStyle<'_>,
    parts: SolidParts,
    profile: Option<&[Vec2]>,
    crease_angle: f32,
) -> (Mesh, Layout) {
    let straight = [Vec2::ZERO, Vec2::X];
    let profile = profile
        .filter(|p| p.len() > 1 && p.iter().all(|v| v.is_finite()))
        .unwrap_or(&straight);
    let laid = layout(strings, style);
    let mut pen = SolidBuilder {
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
    let mut glyphs = GlyphCache::new(style.face, style.complexity);
    for glyph in &laid.glyphs {
        let cut = glyphs.get(glyph.character);
        if parts.front {
            pen.face(cut, glyph.origin, true);
        }
        if parts.sides {
            pen.sides(cut, glyph.origin);
        }
        if parts.back {
            pen.face(cut, glyph.origin, false);
        }
    }
    (pen.mesh, laid)
}

/// Builds the faces and sides of solid text.
struct SolidBuilder<'a> {
    mesh: Mesh,
    size: f32,
    profile: &'a [Vec2],
    /// The cosine of the crease angle.
    smooth: f32,
    /// The inverse of the font's size, or 0.
    per_unit: f32,
}

impl SolidBuilder<'_> {
    /// Adds the front or the back of a glyph.
    fn face(&mut self, cut: &FlatGlyph, origin: Vec2, front: bool) {
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

    /// Adds the sides of a glyph.
    fn sides(&mut self, cut: &FlatGlyph, origin: Vec2) {
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

    /// Adds a quadrilateral of a side. Its corners are clockwise as seen from outside, for an
    /// outline with its fill on the right.
    fn quad(&mut self, corners: [(Vec3, Vec3, Vec2); 4]) {
        let [a, b, c, d] = corners.map(|(p, n, t)| self.mesh.vertex(p, n, t));
        self.mesh.triangles.extend([[a, c, b], [a, d, c]]);
        self.mesh.parts.extend([1, 1]);
    }
}

/// Returns the normal at both ends of each piece of a profile, as a unit vector (outward, toward
/// the front).
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

/// Returns the outward normals at both ends of each edge of an outline with its fill on the right.
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
