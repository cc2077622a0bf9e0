//! Tests of meshes within a tolerance.

use glam::{DAffine3, DMat3, DVec2, DVec3, DVec4, Vec3};

use super::{ChordalTolerance, Curve, Detail, NurbsSurface, trim_curve};
use crate::geometry::mesh::TriangleMesh;

const QUADRATIC: [f32; 6] = [0.0, 0.0, 0.0, 1.0, 1.0, 1.0];
const CUBIC: [f32; 8] = [0.0, 0.0, 0.0, 0.0, 1.0, 1.0, 1.0, 1.0];
const LINEAR: [f32; 4] = [0.0, 0.0, 1.0, 1.0];
/// The knots of eight control points of order 4.
const FIVE_SPANS: [f32; 12] = [0.0, 0.0, 0.0, 0.0, 1.0, 2.0, 3.0, 4.0, 5.0, 5.0, 5.0, 5.0];

fn surface(columns: usize, knots: [&[f32]; 2], points: &[[f64; 4]]) -> NurbsSurface {
    let points: Vec<DVec4> = points.iter().map(|&p| DVec4::from(p)).collect();
    let rows = points.len() / columns;
    NurbsSurface::new(columns, rows, knots[0], knots[1], points).unwrap()
}

/// An eighth of the unit sphere, whose weights `steepness` changes without changing its shape.
fn octant(steepness: f64) -> NurbsSurface {
    let h = steepness * 0.5_f64.sqrt();
    let end = steepness * steepness;
    let arc = [(1.0, 0.0, 1.0), (1.0, 1.0, h), (0.0, 1.0, end)];
    let points =
        arc.map(|(r, z, w)| arc.map(|(x, y, v)| [r * x, r * y, z, 1.0].map(|c| c * w * v)));
    surface(3, [&QUADRATIC, &QUADRATIC], points.as_flattened())
}

/// A surface of order 4 over control points at whole places.
fn wave(columns: usize, knots: [&[f32]; 2], height: impl Fn(f64, f64) -> f64) -> NurbsSurface {
    let rows = knots[1].len() - 4;
    let point = |k: usize| {
        let (x, y) = ((k % columns) as f64, (k / columns) as f64);
        [x, y, height(x, y), 1.0]
    };
    let points: Vec<[f64; 4]> = (0..columns * rows).map(point).collect();
    surface(columns, knots, &points)
}

fn waves() -> NurbsSurface {
    wave(8, [&FIVE_SPANS, &FIVE_SPANS], |x, y| {
        (1.3 * x).sin() * (1.7 * y).cos()
    })
}

/// Waves over knots that are not repeated at the ends.
fn open_waves() -> NurbsSurface {
    let knots: Vec<f32> = (0..12).map(|i| i as f32).collect();
    wave(8, [&knots, &FIVE_SPANS], |x, y| {
        (1.3 * x).sin() * (1.7 * y).cos()
    })
}

/// A bilinear patch with two corners up and two down.
fn saddle() -> NurbsSurface {
    let corners = [
        [0.0, 0.0, 0.0, 1.0],
        [1.0, 0.0, 1.0, 1.0],
        [0.0, 1.0, 1.0, 1.0],
        [1.0, 1.0, 0.0, 1.0],
    ];
    surface(2, [&LINEAR, &LINEAR], &corners)
}

fn cylinder() -> NurbsSurface {
    let h = 0.5_f64.sqrt();
    let ring = |z: f64| [[1.0, 0.0, z, 1.0], [h, h, h * z, h], [0.0, 1.0, z, 1.0]];
    surface(
        3,
        [&QUADRATIC, &LINEAR],
        [ring(0.0), ring(2.0)].as_flattened(),
    )
}

/// Calls a function with the detail of one distance in object space.
fn within<T>(distance: f64, make: impl FnOnce(&Detail<'_>) -> T) -> T {
    let tolerance = ChordalTolerance {
        world_from_object: DAffine3::IDENTITY,
        distance: &|_| distance,
    };
    make(&Detail {
        complexity: 0.5,
        tolerance: Some(tolerance),
    })
}

fn mesh_within(surface: &NurbsSurface, distance: f64) -> TriangleMesh {
    within(distance, |detail| surface.tessellate(detail, &[], None)).unwrap()
}

/// Returns the largest distance of points of the triangles from the surface at the same parameters,
/// which are the texture coordinates.
fn largest_distance(surface: &NurbsSurface, mesh: &TriangleMesh) -> f64 {
    let (u, v) = (surface.u_domain(), surface.v_domain());
    let mut most = 0.0_f64;
    for triangle in &mesh.triangles {
        for (a, b) in (0..5).flat_map(|a| (0..5 - a).map(move |b| (a, b))) {
            let share = [a, b, 4 - a - b].map(|n| f64::from(n) / 4.0);
            let mix = |of: &dyn Fn(usize) -> DVec3| -> DVec3 {
                (0..3).map(|k| share[k] * of(triangle[k] as usize)).sum()
            };
            let flat = mix(&|i| mesh.positions[i].as_dvec3());
            let at = mix(&|i| mesh.texcoords[i].as_dvec2().extend(0.0));
            let exact = surface.point(u.0 + at.x * (u.1 - u.0), v.0 + at.y * (v.1 - v.0));
            most = most.max(exact.unwrap().position.distance(flat));
        }
    }
    most
}

#[test]
fn a_mesh_keeps_within_its_tolerance_and_is_not_much_finer() {
    for (name, surface, coarsest) in [
        ("waves", waves(), 2.5),
        ("waves with open ends", open_waves(), 2.5),
        ("octant", octant(1.0), 3.5),
        ("octant with steep weights", octant(40.0), 12.0),
        ("saddle", saddle(), 2.0),
        ("cylinder", cylinder(), 3.0),
    ] {
        for tolerance in [0.1, 0.01] {
            let mesh = mesh_within(&surface, tolerance);
            assert!(mesh.is_sound());
            let found = largest_distance(&surface, &mesh);
            assert!(found < tolerance + 1e-5, "{name}: {found} for {tolerance}");
            assert!(
                coarsest * found > tolerance,
                "{name}: {found} for {tolerance}"
            );
            for (p, n) in mesh.positions.iter().zip(&mesh.normals) {
                assert!((n.length() - 1.0).abs() < 1e-5, "{name}: {p} {n}");
            }
        }
    }
}

#[test]
fn flat_surfaces_have_one_cell_in_each_span_and_straight_lines_one_piece() {
    let plane = wave(4, [&CUBIC, &CUBIC], |x, y| 2.0 * x - y);
    assert_eq!(mesh_within(&plane, 1e-6).triangles.len(), 2);
    // A cylinder is straight in one direction.
    let mesh = mesh_within(&cylinder(), 1e-4);
    assert!(mesh.positions.iter().all(|p| p.z == 0.0 || p.z == 2.0));
    let points = (0..4).map(|i| DVec4::new(f64::from(i), 1.0, 0.0, 1.0));
    let line = Curve::new(points.collect(), &CUBIC).unwrap();
    assert_eq!(
        within(1e-9, |detail| line.polyline(detail)).unwrap().len(),
        2
    );
}

#[test]
fn a_curve_keeps_within_its_tolerance() {
    let h = 0.5_f64.sqrt();
    let arc = [[1.0, 0.0, 0.0, 1.0], [h, h, 0.0, h], [0.0, 1.0, 0.0, 1.0]].map(DVec4::from);
    let arc = Curve::new(arc.to_vec(), &QUADRATIC).unwrap();
    for tolerance in [0.1, 0.001, 0.00001] {
        let line = within(tolerance, |detail| arc.polyline(detail)).unwrap();
        let sag = line
            .windows(2)
            .map(|p| 1.0 - (0.5 * (p[0] + p[1])).length());
        let sag = sag.fold(0.0, f64::max);
        assert!(
            sag < tolerance && sag > 0.2 * tolerance,
            "{sag} for {tolerance}"
        );
    }
}

#[test]
fn the_tolerance_is_one_of_world_space() {
    let scaled = ChordalTolerance {
        world_from_object: DAffine3::from_mat3(DMat3::from_diagonal(DVec3::new(3.0, 3.0, 3.0))),
        distance: &|_| 0.03,
    };
    let detail = Detail {
        complexity: 0.5,
        tolerance: Some(scaled),
    };
    let curved = wave(4, [&CUBIC, &CUBIC], |x, _| x * x / 9.0);
    let mesh = curved.tessellate(&detail, &[], None).unwrap();
    assert_eq!(mesh.triangles, mesh_within(&curved, 0.01).triangles);
}

/// Returns the distance of a point from the nearest of some triangles' edges.
fn distance_from_edges(point: Vec3, mesh: &TriangleMesh) -> f32 {
    let edges = mesh
        .triangles
        .iter()
        .flat_map(|t| [[t[0], t[1]], [t[1], t[2]], [t[2], t[0]]]);
    let distances = edges.map(|edge| {
        let [a, b] = edge.map(|i| mesh.positions[i as usize]);
        let along = ((point - a).dot(b - a) / (b - a).length_squared()).clamp(0.0, 1.0);
        point.distance(a.lerp(b, along))
    });
    distances.fold(f32::INFINITY, f32::min)
}

/// Checks that the vertices of each mesh at x = 7 are on the edges of the other mesh.
fn assert_joined(meshes: [&TriangleMesh; 2]) {
    for [a, b] in [meshes, [meshes[1], meshes[0]]] {
        let on_edge: Vec<Vec3> = a.positions.iter().copied().filter(|p| p.x == 7.0).collect();
        assert!(on_edge.len() > 8);
        for p in on_edge {
            let gap = distance_from_edges(p, b);
            assert!(gap < 2e-6, "{gap} at {p}");
        }
    }
}

#[test]
fn no_gap_opens_between_neighbors_that_are_cut_differently() {
    let edge = |y: f64| (1.7 * y).cos();
    let rough = wave(8, [&FIVE_SPANS, &FIVE_SPANS], |x, y| {
        edge(y) * (0.9 * (7.0 - x)).cos()
    });
    let smooth = wave(8, [&FIVE_SPANS, &FIVE_SPANS], |x, y| edge(y) + 0.1 * x);
    // The smooth neighbor begins at x = 7.
    let beside = |mesh: &mut TriangleMesh| mesh.positions.iter_mut().for_each(|p| p.x += 7.0);
    for tolerance in [0.3, 0.1] {
        let first = mesh_within(&rough, tolerance);
        let mut second = mesh_within(&smooth, tolerance);
        beside(&mut second);
        assert_ne!(first.triangles.len(), second.triangles.len());
        assert_joined([&first, &second]);
        // A trimmed neighbor that keeps the edge.
        let half = [(0.0, 0.0), (2.5, 0.0), (2.5, 5.0), (0.0, 5.0)]
            .map(DVec2::from)
            .to_vec();
        let trimmed = within(tolerance, |detail| smooth.tessellate(detail, &[half], None));
        let mut trimmed = trimmed.unwrap();
        beside(&mut trimmed);
        assert_joined([&first, &trimmed]);
    }
}

#[test]
fn a_mesh_is_closed_where_a_surface_meets_itself() {
    // Each edge of a triangle inside the octant belongs to two triangles.
    for surface in [octant(1.0), waves(), saddle(), cylinder()] {
        for tolerance in [0.3, 0.05] {
            let mesh = mesh_within(&surface, tolerance);
            let mut edges = std::collections::HashMap::new();
            let key = |i: u32| mesh.positions[i as usize].to_array().map(f32::to_bits);
            for t in &mesh.triangles {
                for [a, b] in [[t[0], t[1]], [t[1], t[2]], [t[2], t[0]]] {
                    *edges.entry((key(a), key(b))).or_insert(0) += 1;
                }
            }
            let open = edges.keys().filter(|(a, b)| !edges.contains_key(&(*b, *a)));
            let on_border = |p: &[u32; 3]| {
                let at = mesh
                    .positions
                    .iter()
                    .position(|q| q.to_array().map(f32::to_bits) == *p);
                let st = mesh.texcoords[at.unwrap()];
                st.x == 0.0 || st.x == 1.0 || st.y == 0.0 || st.y == 1.0
            };
            assert!(open.clone().all(|(a, b)| on_border(a) && on_border(b)));
            assert!(edges.values().all(|&uses| uses == 1));
        }
    }
}

#[test]
fn trimming_curves_are_as_fine_as_their_surface() {
    let h = 0.5_f64.sqrt();
    // A quarter of a circle around a corner of the saddle's parameters.
    let arc = [(1.0, 0.0, 1.0), (h, h, h), (0.0, 1.0, 1.0)].map(DVec3::from);
    let flat = wave(4, [&CUBIC, &CUBIC], |x, y| 2.0 * x - y);
    let mut counts = Vec::new();
    for tolerance in [0.1, 0.001] {
        let line = within(tolerance, |detail| {
            trim_curve(&arc, &QUADRATIC, &flat.detail_of_trims(detail))
        });
        let line = line.unwrap();
        let sag = line.windows(2).map(|p| {
            let middle = 0.5 * (p[0] + p[1]);
            let place = |p: DVec2| flat.point(p.x, p.y).unwrap().position;
            place(middle).distance(place(middle.normalize()))
        });
        let sag = sag.fold(0.0, f64::max);
        assert!(sag < tolerance, "{sag} for {tolerance}");
        counts.push(line.len());
    }
    assert!(counts[1] > 5 * counts[0] && counts[1] < 200, "{counts:?}");
}

#[test]
fn a_surface_without_positive_weights_is_cut_by_its_complexity() {
    let points = |w: f64| {
        [
            [0.0, 0.0, 0.0, 1.0],
            [1.0, 0.0, 1.0, w],
            [2.0, 0.0, 0.0, 1.0],
        ]
        .map(DVec4::from)
    };
    let odd = Curve::new(points(-0.2).to_vec(), &QUADRATIC).unwrap();
    let line = within(0.01, |detail| odd.polyline(detail));
    let detail = Detail {
        complexity: 0.5,
        tolerance: None,
    };
    assert_eq!(line, odd.polyline(&detail));
}

#[test]
fn a_tolerance_too_small_for_the_limit_of_cells_is_increased() {
    let (us, vs, edges) = within(1e-9, |detail| waves().cuts(detail));
    let cells = (us.len() - 1) * (vs.len() - 1);
    assert!(
        edges.is_some() && cells <= 1 << 20 && cells > 1 << 16,
        "{cells}"
    );
}

proptest::proptest! {
    #![proptest_config(proptest::test_runner::Config::with_cases(64))]

    /// Any numbers give a sound mesh or a sentence, also within a tolerance.
    #[test]
    fn no_numbers_break_a_surface_within_a_tolerance(
        u_knots in proptest::collection::vec(-2.0f32..4.0, 7),
        v_knots in proptest::collection::vec(-2.0f32..4.0, 6),
        points in proptest::collection::vec(proptest::array::uniform4(-3i8..4), 16),
        weights in proptest::collection::vec(1i8..9, 16),
        scale in -30i32..5,
        trimmed: bool,
    ) {
        let (mut u_knots, mut v_knots) = (u_knots, v_knots);
        u_knots.sort_by(f32::total_cmp);
        v_knots.sort_by(f32::total_cmp);
        let factor = 2f64.powi(scale);
        let points = points.iter().zip(&weights).map(|(p, w)| {
            let [x, y, z, _] = p.map(f64::from);
            DVec4::new(factor * x, factor * y, factor * z, f64::from(*w))
        });
        let loops = [[(-1.0, -1.0), (2.0, 0.0), (1.0, 3.0)].map(DVec2::from).to_vec()];
        let trims = if trimmed { &loops[..] } else { &[] };
        let made = NurbsSurface::new(4, 4, &u_knots, &v_knots, points.collect())
            .and_then(|s| within(1.0, |detail| s.tessellate(detail, trims, None)));
        match made {
            Ok(mesh) => proptest::prop_assert!(mesh.is_sound()),
            Err(sentence) => proptest::prop_assert!(!sentence.is_empty()),
        }
    }
}
