//! Triangulates a VRML97 `Extrusion` (6.18).
//!
//! The sides are quadrilaterals, which are cut from their first corner to their third, and convex
//! caps are fans, as in Coin. Normals are smooth within the crease angle, between quadrilaterals
//! or, if the extrusion is not `convex`, between triangles. In the result front faces are
//! counterclockwise, whatever the value of the field `ccw`.

use earcut::Earcut;
use glam::{DQuat, DVec3, Vec2, Vec3};

use super::mesh::{QUAD_CORNERS, TriangleMesh};
use super::normals::{Faces, face_normal, merge_equal, unit};

/// The largest number of quadrilaterals of one extrusion, which bounds its memory.
pub(super) const MAX_QUADS: usize = 1 << 22;

/// The fields of an `Extrusion`.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Extrusion<'a> {
    /// The points of the cross section in the plane of x and z.
    pub cross_section: &'a [Vec2],
    /// The points of the spine.
    pub spine: &'a [Vec3],
    /// The scales at the spine's points. The last scale applies to all further points.
    pub scale: &'a [Vec2],
    /// The rotations at the spine's points, as unit quaternions. The last one applies to all
    /// further points.
    pub orientation: &'a [glam::Quat],
    /// Whether the beginning is closed.
    pub begin_cap: bool,
    /// Whether the end is closed.
    pub end_cap: bool,
    /// Whether the cross section is counterclockwise as the standard defines it.
    pub ccw: bool,
    /// Whether the cross section is convex.
    pub convex: bool,
    /// The largest angle between smooth faces, in radians.
    pub crease_angle: f32,
}

impl Extrusion<'_> {
    /// The memory in bytes of a quadrilateral while an extrusion is made: its corners, its
    /// triangles, and the lists by which normals are smoothed.
    const BYTES_OF_QUAD: usize = 320;

    /// Returns the memory in bytes that making the triangles takes.
    pub(crate) fn bytes(&self) -> u64 {
        let quads = self.cross_section.len().saturating_mul(self.spine.len());
        quads.saturating_mul(Self::BYTES_OF_QUAD) as u64
    }
}

/// Returns the triangles of an extrusion. The sides are part 0, the first cap is part 1 and the
/// second cap is part 2. The standard gives all three the same material.
///
/// # Errors
/// Returns a sentence if there are more than [`MAX_QUADS`] quadrilaterals, or if a point is not
/// finite.
pub(crate) fn extrusion(node: &Extrusion<'_>) -> Result<TriangleMesh, String> {
    let Extrusion {
        cross_section: cross,
        spine,
        ..
    } = *node;
    if cross.is_empty() || spine.len() < 2 {
        return Ok(TriangleMesh::default());
    }
    if (cross.len() - 1).saturating_mul(spine.len() - 1) > MAX_QUADS {
        return Err(format!(
            "a cross section of {} points along a spine of {} is too large",
            cross.len(),
            spine.len()
        ));
    }
    let frames = frames(spine);
    let mut points = Vec::with_capacity(cross.len() * spine.len());
    for (i, frame) in frames.iter().enumerate() {
        let scale = last_for(node.scale, i).unwrap_or(Vec2::ONE);
        let turn = last_for(node.orientation, i).map_or(DQuat::IDENTITY, |q| q.as_dquat());
        points.extend(cross.iter().map(|c| frame.place(turn, *c * scale)));
    }
    if points.iter().any(|p| !p.is_finite()) {
        return Err("a point of the extrusion is not finite".to_owned());
    }
    let n = cross.len();
    let rows = spine.len();
    let (s, t) = (along(cross, |p| p.extend(0.0)), along(spine, |p| p));
    let mut faceted = FacetedMesh::default();
    for row in 0..rows - 1 {
        for column in 0..n - 1 {
            let quad = QUAD_CORNERS.map(|(dx, dy)| {
                let (x, y) = (column + dx, row + dy);
                (points[y * n + x].as_vec3(), Vec2::new(s[x], t[y]))
            });
            let [a, b, c, d] = quad;
            if node.convex {
                faceted.face(&quad, 0);
            } else {
                faceted.face(&[a, b, c], 0);
                faceted.face(&[a, c, d], 0);
            }
        }
    }
    // A closed spine has no caps (Coin).
    let closed = spine[0] == spine[rows - 1];
    for (wanted, row, part) in [(node.begin_cap, 0, 1), (node.end_cap, rows - 1, 2)] {
        if wanted && !closed {
            let rim = &points[row * n..(row + 1) * n];
            cap(&mut faceted, rim, cross, node.convex, part);
        }
    }
    let mut mesh = faceted.smoothed(node.crease_angle);
    if !node.ccw {
        turn_over(&mut mesh);
    }
    Ok(mesh)
}

/// A mesh under construction, whose faces do not share vertices.
#[derive(Default)]
struct FacetedMesh {
    mesh: TriangleMesh,
    normals: Vec<Vec3>,
    /// The face of each corner.
    faces: Vec<u32>,
}

impl FacetedMesh {
    /// Adds a triangle or a quadrilateral.
    fn face(&mut self, corners: &[(Vec3, Vec2)], part: u8) {
        let points: Vec<Vec3> = corners.iter().map(|c| c.0).collect();
        let normal = face_normal(&points, true);
        let first = self.mesh.positions.len() as u32;
        for &(position, texcoord) in corners {
            self.mesh.vertex(position, normal, texcoord);
            self.faces.push(self.normals.len() as u32);
        }
        self.normals.push(normal);
        for i in 2..corners.len() as u32 {
            self.mesh.triangles.push([first, first + i - 1, first + i]);
            self.mesh.parts.push(part);
        }
    }

    /// Makes the triangles from a face on one face of a plane, which counts once in a smooth
    /// normal.
    fn join(&mut self, first: u32) {
        let sum: Vec3 = self.normals.drain(first as usize..).sum();
        self.normals.push(unit(sum));
        let joined = self.faces.iter_mut().rev();
        joined
            .take_while(|face| **face >= first)
            .for_each(|face| *face = first);
    }

    /// Smooths the normals by the crease angle. Caps are smoothed like all other faces (Coin).
    fn smoothed(mut self, crease_angle: f32) -> TriangleMesh {
        if crease_angle > 0.0 {
            let vertices = merge_equal(self.mesh.positions.iter().copied());
            let faces = Faces {
                normals: self.normals,
                corners: vertices.into_iter().zip(self.faces).collect(),
            };
            let around = faces.around(crease_angle);
            let corners = faces.corners.iter();
            self.mesh.normals = corners.map(|&(v, f)| around.normal(v, f)).collect();
        }
        self.mesh
    }
}

/// Returns an entry of a list, or its last entry for an index beyond it.
fn last_for<T: Copy>(values: &[T], index: usize) -> Option<T> {
    values.get(index).or(values.last()).copied()
}

/// Returns the length of a polyline up to each of its points, as a fraction of the whole length.
fn along<T: Copy>(line: &[T], point: impl Fn(T) -> Vec3) -> Vec<f32> {
    let mut sum = 0.0;
    let mut sums = vec![0.0];
    for pair in line.windows(2) {
        sum += f64::from(point(pair[0]).distance(point(pair[1])));
        sums.push(sum);
    }
    let scale = if sum > 0.0 && sum.is_finite() {
        1.0 / sum
    } else {
        0.0
    };
    sums.into_iter().map(|d| (d * scale) as f32).collect()
}

/// Reverses the sides of all triangles.
fn turn_over(mesh: &mut TriangleMesh) {
    mesh.triangles.iter_mut().for_each(|t| t.swap(1, 2));
    mesh.normals.iter_mut().for_each(|n| *n = -*n);
}

/// Closes one end. The texture coordinates of a cap are the x and z of the cross section, scaled so
/// that the larger extent is from 0 to 1.
fn cap(faceted: &mut FacetedMesh, rim: &[DVec3], cross: &[Vec2], convex: bool, part: u8) {
    let count = if cross.first() == cross.last() {
        rim.len() - 1
    } else {
        rim.len()
    };
    if count < 3 {
        return;
    }
    let (lo, hi) = cross
        .iter()
        .fold((cross[0], cross[0]), |(l, h), p| (l.min(*p), h.max(*p)));
    let extent = (hi - lo).max_element();
    let scale = if extent > 0.0 { 1.0 / extent } else { 0.0 };
    let corner = |i: u32| {
        let i = i as usize;
        (rim[i].as_vec3(), (cross[i] - lo) * scale)
    };
    let first = faceted.normals.len() as u32;
    for [a, b, c] in polygon(&cross[..count], convex) {
        // The plane of x and z is mirrored when seen along y.
        let triangle = if part == 1 { [a, c, b] } else { [a, b, c] };
        faceted.face(&triangle.map(corner), part);
    }
    faceted.join(first);
}

/// Returns the triangles of a polygon, all with the polygon's orientation.
fn polygon(points: &[Vec2], convex: bool) -> Vec<[u32; 3]> {
    let n = points.len() as u32;
    if convex {
        return (2..n).map(|i| [0, i - 1, i]).collect();
    }
    let flat: Vec<[f64; 2]> = points.iter().map(|p| p.as_dvec2().to_array()).collect();
    let mut indices: Vec<u32> = Vec::new();
    Earcut::new().earcut(flat.iter().copied(), &[] as &[u32], &mut indices);
    let area: f32 = (0..points.len())
        .map(|i| points[i].perp_dot(points[(i + 1) % points.len()]))
        .sum();
    indices
        .chunks_exact(3)
        .map(|t| {
            let [a, b, c] = [t[0], t[1], t[2]].map(|i| points[i as usize]);
            let turned = (b - a).perp_dot(c - a) * area < 0.0;
            if turned {
                [t[0], t[2], t[1]]
            } else {
                [t[0], t[1], t[2]]
            }
        })
        .collect()
}

/// The spine-aligned cross-section plane (SCP) of the standard at one point of the spine.
#[derive(Clone, Copy, Debug)]
struct SpineFrame {
    origin: DVec3,
    x: DVec3,
    y: DVec3,
    z: DVec3,
}

impl SpineFrame {
    /// Returns the position of a point of the cross section after a rotation.
    fn place(&self, turn: DQuat, point: Vec2) -> DVec3 {
        let p = turn * DVec3::new(f64::from(point.x), 0.0, f64::from(point.y));
        self.origin + p.x * self.x + p.y * self.y + p.z * self.z
    }
}

/// Returns the plane at each point of a spine (6.18.3).
///
/// y is the direction of the spine, and z is the normal of the plane through a point and its
/// neighbors. z is kept on straight sections, and negated if it would flip. An entirely straight
/// spine uses the shortest rotation from y to its direction; for the direction −y that is a half
/// turn about z, as in Coin.
fn frames(spine: &[Vec3]) -> Vec<SpineFrame> {
    let points: Vec<DVec3> = spine.iter().map(|p| p.as_dvec3()).collect();
    let n = points.len();
    let closed = n > 2 && points[0] == points[n - 1];
    let ys = tangents(&points, closed);
    let mut zs: Vec<Option<DVec3>> = (0..n)
        .map(|i| {
            let (before, after) = match i {
                0 if closed => (points[n - 2], points[1]),
                i if i == n - 1 && closed => (points[n - 2], points[1]),
                0 => return None,
                i if i == n - 1 => return None,
                i => (points[i - 1], points[i + 1]),
            };
            let (a, b) = (
                (after - points[i]).normalize_or_zero(),
                (before - points[i]).normalize_or_zero(),
            );
            let z = a.cross(b);
            (z.length_squared() > 1e-12).then(|| z.normalize())
        })
        .collect();
    let first = zs.iter().flatten().next().copied();
    let mut last = first;
    for z in &mut zs {
        *z = match (*z, last) {
            (Some(z), Some(before)) if z.dot(before) < 0.0 => Some(-z),
            (Some(z), _) => Some(z),
            (None, before) => before,
        };
        last = *z;
    }
    let straight = shortest_turn(ys[0]);
    (0..n)
        .map(|i| {
            let origin = points[i];
            let y = ys[i];
            match zs[i] {
                // On a straight section z may not be perpendicular to y, so the frame is made
                // orthogonal.
                Some(z) => {
                    let x = y.cross(z).normalize_or(DVec3::X);
                    SpineFrame {
                        origin,
                        x,
                        y,
                        z: x.cross(y),
                    }
                }
                None => {
                    let (x, z) = straight;
                    SpineFrame { origin, x, y, z }
                }
            }
        })
        .collect()
}

/// Returns the direction of the spine at each point. A point that repeats another has the direction
/// of its neighbor.
fn tangents(points: &[DVec3], closed: bool) -> Vec<DVec3> {
    let n = points.len();
    let mut ys: Vec<Option<DVec3>> = (0..n)
        .map(|i| {
            let (from, to) = match i {
                0 if closed => (n - 2, 1),
                i if i == n - 1 && closed => (n - 2, 1),
                0 => (0, 1),
                i if i == n - 1 => (n - 2, n - 1),
                i => (i - 1, i + 1),
            };
            (points[to] - points[from]).try_normalize()
        })
        .collect();
    let mut last = ys.iter().flatten().next().copied().unwrap_or(DVec3::Y);
    for y in &mut ys {
        last = y.unwrap_or(last);
        *y = Some(last);
    }
    ys.into_iter().flatten().collect()
}

/// Returns the x and z axes after the shortest rotation from y to a direction.
fn shortest_turn(y: DVec3) -> (DVec3, DVec3) {
    if y.y < -1.0 + 1e-12 {
        return (DVec3::NEG_X, DVec3::Z);
    }
    let turn = DQuat::from_rotation_arc(DVec3::Y, y);
    (turn * DVec3::X, turn * DVec3::Z)
}

#[cfg(test)]
mod tests {
    use super::*;

    const SQUARE: [Vec2; 5] = [
        Vec2::new(1.0, 1.0),
        Vec2::new(1.0, -1.0),
        Vec2::new(-1.0, -1.0),
        Vec2::new(-1.0, 1.0),
        Vec2::new(1.0, 1.0),
    ];

    fn plain<'a>(cross_section: &'a [Vec2], spine: &'a [Vec3]) -> Extrusion<'a> {
        Extrusion {
            cross_section,
            spine,
            scale: &[],
            orientation: &[],
            begin_cap: true,
            end_cap: true,
            ccw: true,
            convex: true,
            crease_angle: 0.0,
        }
    }

    fn faces_its_normals(mesh: &TriangleMesh) -> bool {
        mesh.triangles.iter().all(|t| {
            let [a, b, c] = t.map(|i| mesh.positions[i as usize]);
            (b - a).cross(c - a).dot(mesh.normals[t[0] as usize]) > 0.0
        })
    }

    #[test]
    fn the_default_extrusion_is_a_box() {
        let mesh = extrusion(&plain(&SQUARE, &[Vec3::ZERO, Vec3::Y])).unwrap();
        assert!(mesh.is_sound() && faces_its_normals(&mesh));
        assert_eq!(mesh.triangles.len(), 12);
        assert!((mesh.volume() - 4.0).abs() < 1e-6);
        let inside_out = Extrusion {
            ccw: false,
            ..plain(&SQUARE, &[Vec3::ZERO, Vec3::Y])
        };
        let mesh = extrusion(&inside_out).unwrap();
        assert!(faces_its_normals(&mesh) && (mesh.volume() + 4.0).abs() < 1e-6);
    }

    /// By Guldin's rule a section that is rotated about an axis sweeps its area times the path of
    /// its center. Sixty-four straight pieces are 0.16% shorter than the circle.
    #[test]
    fn a_closed_spine_makes_a_ring() {
        let n = 64;
        let spine: Vec<Vec3> = (0..=n)
            .map(|i| {
                let a = std::f32::consts::TAU * (i % n) as f32 / n as f32;
                Vec3::new(5.0 * libm::cosf(a), 0.0, 5.0 * libm::sinf(a))
            })
            .collect();
        let ring = Extrusion {
            begin_cap: false,
            end_cap: false,
            ..plain(&SQUARE, &spine)
        };
        let mesh = extrusion(&ring).unwrap();
        let volume = 4.0 * std::f64::consts::TAU * 5.0;
        assert!(
            (mesh.volume().abs() / volume - 1.0).abs() < 0.005,
            "{}",
            mesh.volume()
        );
    }

    /// The expected points are Coin's, for a spine with a bend, a straight section and a flip.
    #[test]
    fn planes_along_a_spine_are_the_standards() {
        let cross = [Vec2::new(0.5, 0.0), Vec2::new(0.0, -0.5)];
        let spine = [(0, 0, 0), (0, 1, 0), (1, 1, 0), (2, 1, 0), (2, 2, 1)]
            .map(|(x, y, z)| Vec3::new(x as f32, y as f32, z as f32));
        let mesh = extrusion(&plain(&cross, &spine)).unwrap();
        let expected = [
            (-0.5, 0.0, 0.0),
            (0.0, 1.0, 0.5),
            (1.0, 1.5, 0.0),
            (1.592, 1.204, 0.204),
            (1.5, 2.0, 1.0),
        ];
        has_corners(&mesh, &expected);
    }

    fn has_corners(mesh: &TriangleMesh, expected: &[(f32, f32, f32)]) {
        for corner in expected {
            let corner = Vec3::from(*corner);
            let distances = mesh.positions.iter().map(|p| p.distance(corner));
            let near = distances.fold(9.0, f32::min);
            assert!(near < 1e-3, "{corner} is {near} off");
        }
    }

    #[test]
    fn scale_and_orientation_apply_in_the_plane_of_the_section() {
        let cross = [Vec2::new(0.5, 0.0), Vec2::new(0.0, -0.5)];
        let half_turn = |axis: Vec3, angle: f32| glam::Quat::from_axis_angle(axis, angle);
        let node = Extrusion {
            scale: &[Vec2::new(1.0, 2.0), Vec2::new(2.0, 2.0)],
            orientation: &[half_turn(Vec3::Y, 0.5), half_turn(Vec3::X, 1.0)],
            ..plain(&cross, &[Vec3::ZERO, Vec3::X])
        };
        let mesh = extrusion(&node).unwrap();
        let expected = [
            (0.0, -0.439, -0.24),
            (0.0, 0.479, -0.878),
            (1.841, 0.0, -0.54),
            (1.0, -1.0, 0.0),
        ];
        has_corners(&mesh, &expected);
    }

    #[test]
    fn a_concave_cap_covers_its_own_area() {
        let arrow = [
            (1.0, 1.0),
            (1.0, -1.0),
            (0.0, 0.0),
            (-1.0, -1.0),
            (-1.0, 1.0),
            (1.0, 1.0),
        ]
        .map(Vec2::from);
        let node = Extrusion {
            convex: false,
            ..plain(&arrow, &[Vec3::ZERO, Vec3::Y])
        };
        let mesh = extrusion(&node).unwrap();
        assert!(faces_its_normals(&mesh));
        assert!((mesh.volume() - 3.0).abs() < 1e-6, "{}", mesh.volume());
    }

    #[test]
    fn edges_within_the_crease_angle_are_smooth() {
        let round: Vec<Vec2> = (0..=8)
            .map(|i| {
                let a = std::f32::consts::TAU * (i % 8) as f32 / 8.0;
                Vec2::new(libm::cosf(a), -libm::sinf(a))
            })
            .collect();
        let spine = [Vec3::ZERO, Vec3::Y];
        let tube = Extrusion {
            begin_cap: false,
            end_cap: false,
            crease_angle: 1.0,
            ..plain(&round, &spine)
        };
        for (p, n) in extrusion(&tube)
            .unwrap()
            .positions
            .iter()
            .zip(extrusion(&tube).unwrap().normals)
        {
            assert!((Vec3::new(p.x, 0.0, p.z) - n).length() < 1e-6, "{p} {n}");
        }
    }

    #[test]
    fn wrong_values_are_errors_or_draw_nothing() {
        assert!(extrusion(&plain(&SQUARE, &[Vec3::NAN, Vec3::Y])).is_err());
        assert_eq!(
            extrusion(&plain(&[], &[Vec3::ZERO, Vec3::Y])).unwrap(),
            TriangleMesh::default()
        );
        for spine in [
            vec![Vec3::ZERO; 4],
            vec![Vec3::Y, Vec3::ZERO],
            vec![Vec3::ZERO, Vec3::Y, Vec3::ZERO],
        ] {
            assert!(extrusion(&plain(&SQUARE, &spine)).unwrap().is_sound());
        }
        let long = vec![Vec2::ONE; 5000];
        let spine: Vec<Vec3> = (0..5000).map(|i| Vec3::new(0.0, i as f32, 0.0)).collect();
        assert!(extrusion(&plain(&long, &spine)).is_err());
    }
}
