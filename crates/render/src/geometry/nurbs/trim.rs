//! Trimming loops in the parameter plane of a surface.

use glam::{DVec2, DVec3, DVec4};
use lyon_tessellation::{
    BuffersBuilder, FillOptions, FillTessellator, FillVertex, VertexBuffers, math::point,
    path::Path,
};

use super::control::MAX_CELLS;
use super::curve::Curve;
use super::detail::Detail;

/// Returns a trimming curve with control points `(u, v, w)` as a polyline of the surface's
/// parameters. `detail` is that of [`NurbsSurface::detail_of_trims`].
///
/// [`NurbsSurface::detail_of_trims`]: super::surface::NurbsSurface::detail_of_trims
///
/// # Errors
/// See [`Curve::new`] and [`Curve::polyline`].
pub(crate) fn trim_curve(
    points: &[DVec3],
    knots: &[f32],
    detail: &Detail<'_>,
) -> Result<Vec<DVec2>, String> {
    let points = points
        .iter()
        .map(|p| DVec4::new(p.x, p.y, 0.0, p.z))
        .collect();
    let line = Curve::new(points, knots)?.polyline(detail)?;
    Ok(line.iter().map(|p| p.truncate()).collect())
}

/// Returns counterclockwise triangles of the part that the loops keep, in the surface's parameters.
pub(super) fn fill(
    u: (f64, f64),
    v: (f64, f64),
    trims: &[Vec<DVec2>],
) -> Result<Vec<Vec<DVec2>>, String> {
    let low = DVec2::new(u.0, v.0);
    let extent = DVec2::new(u.1 - u.0, v.1 - v.0);
    // The tolerances of lyon's tessellator are absolute; the largest is 0.1. The domain is scaled
    // to 4096 units, which is 4e4 times as large, and `f32` still resolves a 4000th of a unit.
    const SPREAD: f64 = 4096.0;
    let mut loops: Vec<Vec<DVec2>> = trims
        .iter()
        .filter(|l| l.len() > 2 && l.iter().all(|p| p.is_finite()))
        .map(|l| {
            let shares = l
                .iter()
                .map(|p| ((*p - low) / extent).clamp(DVec2::ZERO, DVec2::ONE));
            shares.collect()
        })
        .collect();
    if loops.is_empty() {
        return Err("no trimming loop has three points".to_owned());
    }
    if loops.iter().map(Vec::len).sum::<usize>() > MAX_CELLS {
        return Err("the trimming loops have too many points".to_owned());
    }
    if loops.iter().all(|l| signed_area(l) < 0.0) {
        loops.push(vec![DVec2::ZERO, DVec2::X, DVec2::ONE, DVec2::Y]);
    }
    let mut builder = Path::builder();
    for line in &loops {
        let mut points = line
            .iter()
            .map(|p| point((SPREAD * p.x) as f32, (SPREAD * p.y) as f32));
        if let Some(first) = points.next() {
            builder.begin(first);
            points.for_each(|p| {
                builder.line_to(p);
            });
            builder.close();
        }
    }
    let mut buffers: VertexBuffers<DVec2, u32> = VertexBuffers::new();
    FillTessellator::new()
        .tessellate_path(
            &builder.build(),
            &FillOptions::non_zero(),
            &mut BuffersBuilder::new(&mut buffers, |vertex: FillVertex| {
                let p = vertex.position();
                low + extent * (DVec2::new(f64::from(p.x), f64::from(p.y)) / SPREAD)
            }),
        )
        .map_err(|_| "the trimming loops cannot be filled".to_owned())?;
    let corner = |i: u32| buffers.vertices[i as usize];
    Ok(buffers
        .indices
        .chunks_exact(3)
        .map(|t| {
            let (a, b, c) = (corner(t[0]), corner(t[1]), corner(t[2]));
            if (b - a).perp_dot(c - a) < 0.0 {
                vec![a, c, b]
            } else {
                vec![a, b, c]
            }
        })
        .collect())
}

fn signed_area(line: &[DVec2]) -> f64 {
    let n = line.len();
    (0..n)
        .map(|i| 0.5 * line[i].perp_dot(line[(i + 1) % n]))
        .sum()
}

/// Cuts a convex polygon along the line `axis = cut` for each of the ascending cuts.
pub(super) fn slice(polygon: &[DVec2], axis: usize, cuts: &[f64]) -> Vec<Vec<DVec2>> {
    let lo = polygon
        .iter()
        .map(|p| p[axis])
        .fold(f64::INFINITY, f64::min);
    let hi = polygon
        .iter()
        .map(|p| p[axis])
        .fold(f64::NEG_INFINITY, f64::max);
    let from = cuts.partition_point(|&c| c <= lo);
    let mut pieces = Vec::new();
    let mut rest = polygon.to_vec();
    for &cut in cuts[from..].iter().take_while(|&&c| c < hi) {
        pieces.push(half(&rest, axis, cut, 1.0));
        rest = half(&rest, axis, cut, -1.0);
    }
    pieces.push(rest);
    pieces.retain(|p| p.len() > 2);
    pieces
}

/// Returns the part of a convex polygon below a line (side 1) or above it (side −1).
fn half(polygon: &[DVec2], axis: usize, cut: f64, side: f64) -> Vec<DVec2> {
    let mut out = Vec::with_capacity(polygon.len() + 1);
    for (i, &a) in polygon.iter().enumerate() {
        let b = polygon[(i + 1) % polygon.len()];
        let (da, db) = (side * (cut - a[axis]), side * (cut - b[axis]));
        if da >= 0.0 {
            out.push(a);
        }
        if (da > 0.0 && db < 0.0) || (da < 0.0 && db > 0.0) {
            out.push(crossing(a, b, axis, cut));
        }
    }
    out
}

/// Returns the intersection of an edge with a line. The result does not depend on the direction of
/// the edge, so that neighboring polygons share the point.
fn crossing(a: DVec2, b: DVec2, axis: usize, cut: f64) -> DVec2 {
    let (a, b) = if a[axis] < b[axis] { (a, b) } else { (b, a) };
    let mut p = a + (b - a) * ((cut - a[axis]) / (b[axis] - a[axis]));
    p[axis] = cut;
    p
}
