//! The flat luminous shapes of a scene: triangles, and pairs of triangles that are parallelograms.
//!
//! A lamp is often a box. Its light comes from six rectangles, whose outer sides alone are seen, so
//! that most of twelve triangles with two sides bring a point no light.

use std::collections::HashMap;

use glam::Vec3;

use super::emitter_tree::TreeItem;

/// The largest number of flat shapes whose neighbors are looked for.
pub(super) const MOST_FACES: usize = 1 << 16;
/// The largest distance of a parallelogram's fourth corner from its place, over the longest edge.
const ASKEW: f32 = 1e-5;
/// The number that stands for no leaf and no primitive.
pub(super) const NONE: u32 = u32::MAX;

/// A flat luminous shape.
#[derive(Clone, Copy, Debug)]
pub(crate) struct LampFace {
    /// The triangle, and the other half of a parallelogram or [`NONE`].
    pub(super) halves: [u32; 2],
    /// The corners P, Q and R, and for a parallelogram S, which is opposite of P.
    pub(super) corners: [Vec3; 4],
    /// The places of P, Q and R among the corners of the first half, and of S, R and Q among those
    /// of the other.
    pub(super) order: [[u8; 3]; 2],
    /// The normal of length 1, outward if the face belongs to a closed surface.
    pub(crate) normal: Vec3,
    pub(super) is_closed: bool,
    /// The area in square meters.
    pub(super) area: f32,
    /// The emissive color, if it is the same everywhere and nothing is transparent, clipped or
    /// culled.
    pub(crate) even: Option<Vec3>,
    /// The distance from the face at which a ray along its normal starts clear of it, in meters.
    pub(crate) clearance: f32,
}

/// A luminous triangle.
#[derive(Clone, Copy, Debug)]
pub(super) struct LampTriangle {
    pub(super) primitive: u32,
    /// The number of the surface. Only triangles of one surface are neighbors.
    pub(super) surface: u32,
    pub(super) corners: [Vec3; 3],
    /// See [`LampFace::even`].
    pub(super) even: Option<Vec3>,
}

impl LampFace {
    /// A triangle alone.
    pub(super) fn of(triangle: &LampTriangle) -> Self {
        let [a, b, c] = triangle.corners;
        let across = (b - a).cross(c - a);
        Self {
            halves: [triangle.primitive, NONE],
            corners: [a, b, c, b],
            order: [[0, 1, 2]; 2],
            normal: across.normalize_or_zero(),
            is_closed: false,
            area: 0.5 * across.length(),
            even: triangle.even,
            clearance: 0.0,
        }
    }

    /// The leaf of the face, by that of its first half.
    pub(super) fn item(&self, number: u32, half: &TreeItem) -> TreeItem {
        TreeItem {
            face: number,
            low: half.low.min(self.corners[3]),
            high: half.high.max(self.corners[3]),
            area: self.area,
            power: half.power * (self.area / half.area),
            ..*half
        }
    }

    pub(super) fn is_parallelogram(&self) -> bool {
        self.halves[1] != NONE
    }

    /// A bound of what `Point::clearance` is anywhere on the face.
    fn find_clearance(&mut self) {
        let reach = self.corners.iter().map(|p| p.abs().max_element());
        let reach = reach.fold(0.0, f32::max);
        self.clearance = f32::EPSILON * reach * (16.0 + 8.0 * self.normal.abs().element_sum());
    }

    /// The point of a place in the unit square, with its primitive and its weights of that one's
    /// second and third corner. Equal areas of the square are equal areas of the face.
    pub(super) fn point(&self, [x, y]: [f32; 2]) -> (Vec3, u32, [f32; 2]) {
        let [p, q, r, s] = self.corners;
        let (half, [u, v]) = match self.is_parallelogram() {
            true if x + y > 1.0 => (1, [1.0 - x, 1.0 - y]),
            true => (0, [x, y]),
            false => (0, even_weights([x, y])),
        };
        let (from, to) = [(p, [q, r]), (s, [r, q])][half];
        let own = [1.0 - u - v, u, v];
        let position = from * own[0] + to[0] * u + to[1] * v;
        let mut weights = [0.0; 3];
        for (weight, at) in own.into_iter().zip(self.order[half]) {
            weights[usize::from(at)] = weight;
        }
        (position, self.halves[half], [weights[1], weights[2]])
    }
}

/// The weights of a triangle's second and third corner at a place in the unit square, even over the
/// area (Heitz, "A low-distortion map between triangle and square", 2019).
pub(super) fn even_weights([x, y]: [f32; 2]) -> [f32; 2] {
    match x < y {
        true => [0.5 * x, y - 0.5 * x],
        false => [x - 0.5 * y, 0.5 * y],
    }
}

/// A corner by its bits, so that equal corners are one.
type CornerBits = [u32; 3];

fn corner(p: Vec3) -> CornerBits {
    p.to_array().map(|x| (x + 0.0).to_bits())
}

/// Makes the faces of luminous triangles.
pub(super) fn faces(triangles: &[LampTriangle]) -> Vec<LampFace> {
    let neighbors = neighbors(triangles);
    let outward = outward(triangles, &neighbors);
    let mut faces = Vec::with_capacity(triangles.len());
    let mut used = vec![false; triangles.len()];
    for (number, triangle) in triangles.iter().enumerate() {
        if used[number] {
            continue;
        }
        let mut face = LampFace::of(triangle);
        let other = (0..3).find_map(|edge| {
            let (other, back) = neighbors[number][edge]?;
            let is_free = !used[other] && other != number;
            let whole = parallelogram((triangle, edge), (&triangles[other], back));
            whole.filter(|_| is_free).map(|whole| (other, whole))
        });
        if let Some((other, whole)) = other {
            face = whole;
            used[other] = true;
        }
        if let Some(sign) = outward[number] {
            face.normal *= sign;
            face.is_closed = true;
        }
        face.find_clearance();
        faces.push(face);
    }
    faces
}

/// For each edge of each triangle, which goes from the corner with its number to the next, the
/// triangle that has it the other way round, and its number there. It is `None` where there is no
/// such triangle, or more than one.
fn neighbors(triangles: &[LampTriangle]) -> Vec<[Option<(usize, usize)>; 3]> {
    let edge = |number: usize, edge: usize| {
        let triangle = &triangles[number];
        let [a, b] = [edge, (edge + 1) % 3].map(|k| corner(triangle.corners[k]));
        (triangle.surface, a, b)
    };
    let mut edges: HashMap<_, Option<(usize, usize)>> = HashMap::new();
    for number in 0..triangles.len() {
        for side in 0..3 {
            let once = Some((number, side));
            edges
                .entry(edge(number, side))
                .and_modify(|e| *e = None)
                .or_insert(once);
        }
    }
    let other = |number: usize, side: usize| {
        let (surface, a, b) = edge(number, side);
        edges[&(surface, a, b)]?;
        edges.get(&(surface, b, a)).copied().flatten()
    };
    (0..triangles.len())
        .map(|number| [0, 1, 2].map(|side| other(number, side)))
        .collect()
}

/// For each triangle that belongs to a closed surface, the sign that makes its normal point
/// outward.
fn outward(
    triangles: &[LampTriangle],
    neighbors: &[[Option<(usize, usize)>; 3]],
) -> Vec<Option<f32>> {
    let mut signs = vec![None; triangles.len()];
    let mut seen = vec![false; triangles.len()];
    for first in 0..triangles.len() {
        if seen[first] {
            continue;
        }
        seen[first] = true;
        let (mut part, mut next) = (vec![first], 0);
        let (mut is_closed, mut volume) = (true, 0.0);
        let origin = triangles[first].corners[0];
        while let Some(&number) = part.get(next) {
            next += 1;
            let [a, b, c] = triangles[number].corners.map(|p| (p - origin).as_dvec3());
            volume += a.dot(b.cross(c));
            for other in neighbors[number] {
                let Some((other, _)) = other else {
                    is_closed = false;
                    continue;
                };
                if !seen[other] {
                    seen[other] = true;
                    part.push(other);
                }
            }
        }
        if is_closed && volume != 0.0 {
            let sign = if volume > 0.0 { 1.0 } else { -1.0 };
            part.iter().for_each(|number| signs[*number] = Some(sign));
        }
    }
    signs
}

/// The parallelogram of two triangles with an edge in common, if they are one and shine evenly.
fn parallelogram(
    (first, edge): (&LampTriangle, usize),
    (other, back): (&LampTriangle, usize),
) -> Option<LampFace> {
    first.even.filter(|even| other.even == Some(*even))?;
    let order = |edge: usize| [(edge + 2) % 3, edge, (edge + 1) % 3];
    let (own, others) = (order(edge), order(back));
    let [p, q, r] = own.map(|k| first.corners[k]);
    let s = other.corners[others[0]];
    let longest = [q - p, r - p, r - q]
        .map(Vec3::length)
        .into_iter()
        .fold(0.0, f32::max);
    let is_whole = (p + s - q - r).length() <= ASKEW * longest;
    let across = (q - p).cross(r - p);
    is_whole.then(|| LampFace {
        halves: [first.primitive, other.primitive],
        corners: [p, q, r, s],
        order: [own, others].map(|order| order.map(|k| k as u8)),
        area: across.length(),
        normal: across.normalize_or_zero(),
        ..LampFace::of(first)
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    fn triangles(corners: &[[Vec3; 3]]) -> Vec<LampTriangle> {
        let triangle = |(number, corners): (u32, &[Vec3; 3])| LampTriangle {
            primitive: number,
            surface: 0,
            corners: *corners,
            even: Some(Vec3::ONE),
        };
        (0..).zip(corners).map(triangle).collect()
    }

    /// The triangles of a box, whose corners go around as seen from outside.
    fn cuboid() -> Vec<[Vec3; 3]> {
        let corner = |k: u8| Vec3::from([0, 1, 2].map(|axis| f32::from(k >> axis & 1)));
        let sides = [
            [0, 4, 6, 2],
            [1, 3, 7, 5],
            [0, 1, 5, 4],
            [2, 6, 7, 3],
            [0, 2, 3, 1],
            [4, 5, 7, 6],
        ];
        let halves = sides.map(|[a, b, c, d]| [[a, b, c], [a, c, d]]);
        let halves = halves.as_flattened().iter();
        halves.map(|half| half.map(corner)).collect()
    }

    #[test]
    fn a_box_is_six_rectangles_that_face_outward_whichever_way_its_corners_go() {
        for reversed in [false, true] {
            let mut corners = cuboid();
            if reversed {
                corners.iter_mut().for_each(|corners| corners.reverse());
            }
            let faces = faces(&triangles(&corners));
            assert_eq!(faces.len(), 6);
            for face in &faces {
                let [p, _, _, s] = face.corners;
                let out = 0.5 * (p + s) - 0.5;
                assert!(face.is_closed && face.is_parallelogram());
                assert!(face.normal.dot(out) > 0.49 && (face.area - 1.0).abs() < 1e-6);
            }
        }
    }

    #[test]
    fn a_box_without_a_triangle_has_two_sides() {
        let faces = faces(&triangles(&cuboid()[1..]));
        assert!(faces.len() == 6 && faces.iter().all(|face| !face.is_closed));
        assert_eq!(
            faces.iter().filter(|face| !face.is_parallelogram()).count(),
            1
        );
    }

    /// The weights are those of the triangle's own corners, and every quarter of a parallelogram
    /// gets a quarter of the points.
    #[test]
    fn points_of_a_face_are_spread_evenly_and_known_by_their_weights() {
        let corners = cuboid();
        for face in faces(&triangles(&corners)) {
            let mut quarters = [0; 4];
            let [p, q, r, _] = face.corners;
            for i in 0..64 * 64u16 {
                let at = [i % 64, i / 64].map(|k| (f32::from(k) + 0.5) / 64.0);
                let (position, primitive, [u, v]) = face.point(at);
                let [a, b, c] = corners[primitive as usize];
                let by_weights = a * (1.0 - u - v) + b * u + c * v;
                assert!((by_weights - position).length() < 1e-6);
                let far = |edge: Vec3| usize::from((position - p).dot(edge) > 0.5);
                quarters[far(q - p) + 2 * far(r - p)] += 1;
            }
            assert_eq!(quarters, [1024; 4]);
        }
    }
}
