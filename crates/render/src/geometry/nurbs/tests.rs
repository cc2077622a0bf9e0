use glam::{DVec2, DVec4, Vec2};

use super::*;

/// The detail of a complexity without a picture.
fn by_complexity(complexity: f32) -> Detail<'static> {
    Detail {
        complexity,
        tolerance: None,
    }
}

/// A quarter of the unit circle is exactly a rational curve of order 3.
fn quarter(z: f64, radius: f64) -> [DVec4; 3] {
    let h = 0.5_f64.sqrt();
    [
        DVec4::new(radius, 0.0, z, 1.0),
        DVec4::new(radius * h, radius * h, z * h, h),
        DVec4::new(0.0, radius, z, 1.0),
    ]
}

const QUADRATIC: [f32; 6] = [0.0, 0.0, 0.0, 1.0, 1.0, 1.0];

#[test]
fn a_rational_quadratic_is_a_circle_to_the_last_bits() {
    let curve = Curve::new(quarter(0.0, 1.0).to_vec(), &QUADRATIC).unwrap();
    for p in curve.polyline(&by_complexity(1.0)).unwrap() {
        assert!((p.length() - 1.0).abs() < 4e-16, "{}", p.length() - 1.0);
    }
}

#[test]
fn a_cylinders_normals_point_away_from_its_axis() {
    let mut points = quarter(0.0, 2.0).to_vec();
    points.extend(quarter(3.0, 2.0));
    let cylinder = NurbsSurface::new(3, 2, &QUADRATIC, &[0.0, 0.0, 1.0, 1.0], points).unwrap();
    let mesh = cylinder.tessellate(&by_complexity(0.5), &[], None).unwrap();
    assert!(mesh.is_sound());
    for (p, n) in mesh.positions.iter().zip(&mesh.normals) {
        let outward = p.truncate() / 2.0;
        assert!((n.truncate() - outward).length() < 1e-6 && n.z.abs() < 1e-6);
    }
    let area = std::f64::consts::PI * 3.0;
    assert!((mesh.area() / area - 1.0).abs() < 1e-3, "{}", mesh.area());
    for t in &mesh.triangles {
        let [a, b, c] = t.map(|i| mesh.positions[i as usize]);
        assert!((b - a).cross(c - a).dot(mesh.normals[t[0] as usize]) > 0.0);
    }
}

/// A quarter circle rotated about its end is an eighth of a sphere, with a pole.
#[test]
fn a_sphere_has_correct_normals_at_its_pole() {
    let h = 0.5_f64.sqrt();
    let profile = [(1.0, 0.0, 1.0), (1.0, 1.0, h), (0.0, 1.0, 1.0)];
    let mut points = Vec::new();
    for (r, z, w) in profile {
        points.extend(quarter(0.0, r).map(|p| DVec4::new(p.x * w, p.y * w, p.w * w * z, p.w * w)));
    }
    let octant = NurbsSurface::new(3, 3, &QUADRATIC, &QUADRATIC, points).unwrap();
    let mesh = octant.tessellate(&by_complexity(0.5), &[], None).unwrap();
    for (p, n) in mesh.positions.iter().zip(&mesh.normals) {
        assert!((p.length() - 1.0).abs() < 1e-6);
        assert!(n.dot(*p) > 1.0 - 1e-4, "{p} {n}");
    }
}

#[test]
fn a_uniform_spline_of_a_line_is_the_line() {
    // The uniform cubic B-spline of equally spaced points on a line is the line itself.
    let points = (0..7).map(|i| DVec4::new(f64::from(i), 2.0 * f64::from(i), 0.0, 1.0));
    let knots: Vec<f32> = (0..11).map(|i| i as f32).collect();
    let curve = Curve::new(points.collect(), &knots).unwrap();
    let (lo, hi) = curve.domain();
    assert_eq!((lo, hi), (3.0, 7.0));
    for i in 0..=8 {
        let t = lo + f64::from(i) * 0.5;
        let p = curve.point(t).unwrap();
        assert!((p.x - (t - 2.0)).abs() < 1e-12 && (p.y - 2.0 * p.x).abs() < 1e-12);
    }
}

fn square() -> NurbsSurface {
    let corner = |x, y| DVec4::new(x, y, 0.0, 1.0);
    let points = vec![
        corner(0.0, 0.0),
        corner(3.0, 0.0),
        corner(0.0, 3.0),
        corner(3.0, 3.0),
    ];
    let knots = [0.0, 0.0, 1.0, 1.0];
    NurbsSurface::new(2, 2, &knots, &knots, points).unwrap()
}

fn ring(corners: [f64; 4]) -> Vec<DVec2> {
    let [x0, y0, x1, y1] = corners;
    [(x0, y0), (x1, y0), (x1, y1), (x0, y1), (x0, y0)]
        .map(DVec2::from)
        .to_vec()
}

#[test]
fn a_counterclockwise_loop_keeps_its_inside_and_a_clockwise_one_cuts_a_hole() {
    let inner = ring([0.25, 0.25, 0.75, 0.75]);
    let hole: Vec<_> = inner.iter().rev().copied().collect();
    let outer = ring([0.0, 0.0, 1.0, 1.0]);
    for (trims, area) in [
        (vec![inner.clone()], 2.25),
        (vec![outer.clone(), hole.clone()], 6.75),
        (vec![hole], 6.75),
        (vec![outer], 9.0),
    ] {
        let mesh = square()
            .tessellate(&by_complexity(0.5), &trims, None)
            .unwrap();
        assert!((mesh.area() - area).abs() < 1e-5, "{} {area}", mesh.area());
        assert!(mesh.normals.iter().all(|n| n.z == 1.0));
    }
}

#[test]
fn a_flat_patch_is_two_triangles() {
    let mesh = square().tessellate(&by_complexity(1.0), &[], None).unwrap();
    assert_eq!(mesh.triangles.len(), 2);
    assert_eq!(mesh.texcoords[3], Vec2::ONE);
}

#[test]
fn a_round_trim_on_a_curved_surface_has_the_right_area() {
    let mut points = quarter(0.0, 1.0).to_vec();
    points.extend(quarter(1.0, 1.0));
    let cylinder = NurbsSurface::new(3, 2, &QUADRATIC, &[0.0, 0.0, 1.0, 1.0], points).unwrap();
    let half = vec![ring([0.0, 0.0, 0.5, 1.0])];
    let mesh = cylinder
        .tessellate(&by_complexity(0.5), &half, None)
        .unwrap();
    // By symmetry the middle of the parameters is the middle of the arc.
    let area = std::f64::consts::FRAC_PI_4;
    assert!((mesh.area() / area - 1.0).abs() < 2e-3, "{}", mesh.area());
}

#[test]
fn texture_coordinates_may_be_a_surface_of_their_own() {
    let corner = |x, y| DVec4::new(x, y, 0.0, 1.0);
    let map = vec![
        corner(0.5, 0.0),
        corner(1.0, 0.0),
        corner(0.5, 2.0),
        corner(1.0, 2.0),
    ];
    let map = NurbsSurface::new(2, 2, &[0.0, 0.0, 9.0, 9.0], &[0.0, 0.0, 9.0, 9.0], map).unwrap();
    let mesh = square()
        .tessellate(&by_complexity(0.5), &[], Some(&map))
        .unwrap();
    assert_eq!(
        mesh.texcoords,
        [(0.5, 0.0), (1.0, 0.0), (0.5, 2.0), (1.0, 2.0)].map(Vec2::from)
    );
}

#[test]
fn curves_that_cannot_be_drawn_give_a_sentence() {
    let p = |w| vec![DVec4::new(1.0, 0.0, 0.0, w); 4];
    let cubic = [0.0, 0.0, 0.0, 0.0, 1.0, 1.0, 1.0, 1.0];
    for (points, knots, part) in [
        (p(1.0), vec![0.0; 5], "too few"),
        (p(1.0), vec![0.0; 8], "is empty"),
        (
            p(1.0),
            vec![0.0, 0.0, 0.0, 0.0, 1.0, 0.5, 1.0, 1.0],
            "less than",
        ),
        (
            p(1.0),
            vec![0.0, 0.0, 0.0, f32::NAN, 1.0, 1.0, 1.0, 1.0],
            "not finite",
        ),
        (p(f64::NAN), cubic.to_vec(), "not finite"),
        (p(1.0), vec![0.0; 200], "order 196"),
        (p(1.0), vec![0.0; 10], "order 6 needs"),
    ] {
        let error = Curve::new(points, &knots).unwrap_err();
        assert!(error.contains(part), "{error}");
    }
    let infinite = Curve::new(p(0.0), &cubic).unwrap();
    assert!(
        infinite
            .polyline(&by_complexity(0.5))
            .unwrap_err()
            .contains("infinity")
    );
    let huge = NurbsSurface::new(usize::MAX, 2, &cubic, &cubic, p(1.0)).unwrap_err();
    assert!(huge.contains("the surface needs"));
}

proptest::proptest! {
    /// Any numbers give a sound mesh or a sentence.
    #[test]
    fn no_numbers_break_a_surface(
        u in 0usize..6, v in 0usize..6,
        u_knots in proptest::collection::vec(-2.0f32..4.0, 0..14),
        v_knots in proptest::collection::vec(-2.0f32..4.0, 0..14),
        sorted: bool,
        points in proptest::collection::vec(proptest::array::uniform4(-2i8..3), 0..36),
        trims in proptest::collection::vec(
            proptest::collection::vec(proptest::array::uniform2(-1.0f64..5.0), 0..8), 0..3),
    ) {
        let (mut u_knots, mut v_knots) = (u_knots, v_knots);
        if sorted {
            u_knots.sort_by(f32::total_cmp);
            v_knots.sort_by(f32::total_cmp);
        }
        let points = points.iter().map(|p| DVec4::from(p.map(f64::from))).collect();
        let trims: Vec<Vec<DVec2>> =
            trims.into_iter().map(|l| l.into_iter().map(DVec2::from).collect()).collect();
        let made = NurbsSurface::new(u, v, &u_knots, &v_knots, points)
            .and_then(|s| s.tessellate(&by_complexity(0.2), &trims, None));
        match made {
            Ok(mesh) => proptest::prop_assert!(mesh.is_sound()),
            Err(sentence) => proptest::prop_assert!(!sentence.is_empty()),
        }
    }
}
