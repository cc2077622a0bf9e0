//! A mesh made by a formula, and rays through it, for measurements of trees of triangles.

use std::hint::black_box;

use glam::{DVec3, Vec3};
use ivcam_base::math::lanes::{LANES, Lanes, RaysInLanes, bits};
use ivcam_optics::sampling::mix;
use ivcam_render::bvh::{
    Block, BlockHits, Bvh, PacketHits, PreparedRay, Primitives, Ray, RayPacket,
};

/// Returns a bumpy sphere of about `count` triangles, whose corners are counterclockwise from
/// outside.
pub(crate) fn ball(count: usize) -> Vec<[Vec3; 3]> {
    let rows = ((count / 4) as f64).sqrt() as usize;
    let columns = 2 * rows;
    let point = |i: usize, j: usize| {
        let (a, b) = (
            std::f64::consts::PI * i as f64 / rows as f64,
            std::f64::consts::TAU * j as f64 / columns as f64,
        );
        let r = 1.0 + 0.1 * libm::sin(9.0 * a) * libm::cos(7.0 * b);
        let p = DVec3::new(
            libm::sin(a) * libm::cos(b),
            libm::cos(a),
            libm::sin(a) * libm::sin(b),
        );
        (r * p).as_vec3()
    };
    let mut triangles = Vec::with_capacity(2 * rows * columns);
    for i in 0..rows {
        for j in 0..columns {
            let [a, b, c, d] = [
                point(i, j),
                point(i + 1, j),
                point(i + 1, j + 1),
                point(i, j + 1),
            ];
            triangles.push([a, c, b]);
            triangles.push([a, d, c]);
        }
    }
    triangles
}

pub(crate) fn tree(triangles: &[[Vec3; 3]]) -> Bvh {
    let boxes = triangles
        .iter()
        .map(|[a, b, c]| (a.min(*b).min(*c), a.max(*b).max(*c)));
    Bvh::build(boxes, true, |p| Some(triangles[p as usize]))
}

/// Rays of one kind.
pub(crate) struct Rays {
    pub name: &'static str,
    /// Whether any hit ends a ray.
    pub any: bool,
    pub rays: Vec<Ray>,
}

/// Returns rays from a point outside (rows of a picture), from the points that they hit to a light,
/// and from there in random directions.
pub(crate) fn rays(tree: &Bvh) -> [Rays; 3] {
    let eye = Vec3::new(0.3, 0.4, 4.0);
    let side = 256;
    let primary: Vec<Ray> = (0..side * side)
        .map(|i| {
            let (x, y) = (
                (i % side) as f32 / side as f32,
                (i / side) as f32 / side as f32,
            );
            Ray::new(eye, Vec3::new(2.0 * x - 1.0, 2.0 * y - 1.0, -3.0))
        })
        .collect();
    let hits: Vec<Vec3> = primary
        .iter()
        .filter_map(|r| nearest(tree, r).map(|(t, ..)| r.at(t * (1.0 - 1e-4))))
        .collect();
    let light = Vec3::new(3.0, 5.0, 3.0);
    let to_light = |p: &Vec3| {
        let mut ray = Ray::new(*p, light - *p);
        ray.t_max = 1.0;
        ray
    };
    let mut state = 1;
    let mut unit = || {
        state = mix(state);
        (state >> 40) as f32 / (1u64 << 23) as f32 - 1.0
    };
    let kind = |name, any, rays| Rays { name, any, rays };
    [
        kind("shadow", true, hits.iter().map(to_light).collect()),
        kind(
            "incoherent",
            false,
            hits.iter()
                .map(|p| Ray::new(*p, Vec3::new(unit(), unit(), unit())))
                .collect(),
        ),
        kind("primary", false, primary),
    ]
}

/// Returns the distance, the weights of the second and third corner, and the number of the nearest
/// triangle.
pub(super) fn nearest(tree: &Bvh, ray: &Ray) -> Option<(f32, [f32; 2], u32)> {
    let prepared = PreparedRay::new(ray);
    let mut best = None;
    let visit = |block: &Block, hits: &BlockHits, mut t_max| {
        for lane in bits(hits.mask) {
            if hits.t[lane] < t_max {
                t_max = hits.t[lane];
                best = Some((t_max, [hits.u[lane], hits.v[lane]], block.primitive(lane)));
            }
        }
        t_max
    };
    tree.walk(&prepared, 0.0, ray.t_max, visit);
    best
}

fn is_blocked(tree: &Bvh, ray: &Ray) -> bool {
    let prepared = PreparedRay::new(ray);
    let mut found = false;
    tree.walk_any(&prepared, 0.0, ray.t_max, |_, hits, t_max| {
        found |= hits.mask != 0;
        if found { -1.0 } else { t_max }
    });
    found
}

/// A scene that has only triangles.
struct TrianglesOnly;

impl Primitives for TrianglesOnly {
    fn distances(&self, _: Vec3, _: Vec3, _: u32, _: f32) -> [f32; 2] {
        [f32::NAN; 2]
    }

    fn distances_in_lanes(
        &self,
        _: RaysInLanes<'_>,
        _: u32,
        _: u32,
        _: &mut [Lanes<f32>; 2],
    ) -> u32 {
        0
    }

    fn transmittance_of(&self, _: u32) -> f32 {
        0.0
    }
}

/// Traces rays one by one, and stores their distances: ∞ without a hit. A ray that any hit ends
/// gets −∞, or its greatest distance if nothing blocks it.
pub(crate) fn one_by_one(tree: &Bvh, rays: &Rays, distances: &mut [f32]) {
    for (ray, distance) in rays.rays.iter().zip(distances) {
        *distance = match rays.any {
            true if is_blocked(tree, ray) => f32::NEG_INFINITY,
            true => ray.t_max,
            false => black_box(nearest(tree, ray)).map_or(f32::INFINITY, |hit| hit.0),
        };
    }
}

/// Traces rays in packets, and stores their distances as [`one_by_one`] does.
pub(crate) fn in_packets(tree: &Bvh, rays: &Rays, distances: &mut [f32]) {
    let mut hits = PacketHits::default();
    let parts = rays.rays.chunks(LANES).zip(distances.chunks_mut(LANES));
    for (some, distances) in parts {
        let mut packet = RayPacket::default();
        for (lane, ray) in some.iter().enumerate() {
            packet.set(lane, ray);
        }
        if rays.any {
            tree.transmittances(&packet, &TrianglesOnly, &mut hits);
        } else {
            black_box(tree.nearest_hits(&packet, &TrianglesOnly, &mut hits));
        }
        for (lane, distance) in distances.iter_mut().enumerate() {
            *distance = match (hits.mask >> lane & 1 == 1, rays.any) {
                (true, true) => f32::NEG_INFINITY,
                (true, false) => hits.t[lane],
                (false, _) => packet.t_max[lane],
            };
        }
    }
}
