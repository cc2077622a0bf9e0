//! Rational B-spline curves and surfaces of any order, their trimming, and triangles for them.
//!
//! Control points are homogeneous as in Inventor: `(x, y, z, w)` is the point `(x, y, z) / w`.
//! Everything is `f64`. A surface is cut evenly between knots, at least as finely as Coin does,
//! and finer where its control net bends; positions and normals are the surface's own.
//!
//! Input is a file's, so it may be anything: what cannot be drawn is a sentence that says why,
//! and work is bounded by [`MAX_ORDER`] and [`MAX_CELLS`].

use glam::{DVec2, DVec3, DVec4, Vec2};
use lyon_tessellation::{
    BuffersBuilder, FillOptions, FillTessellator, FillVertex, VertexBuffers, math::point,
    path::Path,
};

use super::mesh::Mesh;

/// GLU's limit is 24.
pub const MAX_ORDER: usize = 64;
/// Grid cells of one surface, and points of one curve.
pub const MAX_CELLS: usize = 1 << 20;

/// One direction of a surface, or a curve's only one: the order is knots less control points.
#[derive(Clone, Debug, PartialEq)]
pub struct Basis {
    order: usize,
    count: usize,
    knots: Vec<f64>,
}

impl Basis {
    pub fn new(count: usize, knots: &[f32]) -> Result<Self, String> {
        let Some(order) = knots.len().checked_sub(count).filter(|&o| o >= 2) else {
            return Err(format!(
                "{} knots are too few for {count} control points: there must be at least {}",
                knots.len(),
                count.saturating_add(2)
            ));
        };
        if order > MAX_ORDER {
            return Err(format!(
                "{} knots for {count} control points ask for order {order}; at most {MAX_ORDER} is drawn",
                knots.len()
            ));
        }
        if order > count {
            return Err(format!(
                "order {order} needs {order} control points, there are {count}"
            ));
        }
        if let Some(i) = knots.iter().position(|k| !k.is_finite()) {
            return Err(format!("knot {i} is not a number"));
        }
        if let Some(i) = knots.windows(2).position(|k| k[1] < k[0]) {
            return Err(format!("knot {} is less than the one before it", i + 1));
        }
        let knots: Vec<f64> = knots.iter().map(|&k| f64::from(k)).collect();
        if !(knots[count] > knots[order - 1]) {
            return Err("the knots leave no room between first and last".to_owned());
        }
        Ok(Self {
            order,
            count,
            knots,
        })
    }

    pub fn domain(&self) -> (f64, f64) {
        (self.knots[self.order - 1], self.knots[self.count])
    }

    /// The knot span that holds the parameter; the last one is closed.
    fn span(&self, t: f64) -> usize {
        let (first, last) = (self.order - 1, self.count - 1);
        let inside = &self.knots[first..=self.count];
        let mut at = first + inside.partition_point(|&k| k <= t).saturating_sub(1);
        at = at.min(last);
        while at > first && self.knots[at] >= self.knots[at + 1] {
            at -= 1;
        }
        at
    }

    /// The basis functions that are not zero at `t`, with their derivatives: the first belongs
    /// to control point `span − order + 1` (Piegl and Tiller, algorithms A2.2 and A2.3).
    fn functions(&self, t: f64, out: &mut Functions) {
        let span = self.span(t);
        let k = &self.knots;
        out.first = span + 1 - self.order;
        out.value.clear();
        out.value.push(1.0);
        let mut lower = Vec::new();
        for degree in 1..self.order {
            if degree + 1 == self.order {
                lower.clone_from(&out.value);
            }
            let mut saved = 0.0;
            for r in 0..degree {
                let right = k[span + r + 1];
                let left = k[span + 1 + r - degree];
                let share = out.value[r] / (right - left);
                out.value[r] = saved + (right - t) * share;
                saved = (t - left) * share;
            }
            out.value.push(saved);
        }
        let degree = self.order - 1;
        out.slope.clear();
        out.slope.resize(self.order, 0.0);
        for (r, n) in lower.iter().enumerate() {
            let slope = degree as f64 * n / (k[span + r + 1] - k[span + 1 + r - degree]);
            out.slope[r] -= slope;
            out.slope[r + 1] += slope;
        }
    }

    /// Parameters at which to cut: each span between knots into `pieces`.
    fn cuts(&self, pieces: usize) -> Vec<f64> {
        let mut cuts = vec![self.domain().0];
        for k in self.knots[self.order - 1..=self.count].windows(2) {
            if k[1] > k[0] {
                cuts.extend((1..=pieces).map(|i| {
                    if i == pieces {
                        k[1]
                    } else {
                        k[0] + (k[1] - k[0]) * (i as f64 / pieces as f64)
                    }
                }));
            }
        }
        cuts
    }

    fn spans(&self) -> usize {
        let inside = &self.knots[self.order - 1..=self.count];
        inside.windows(2).filter(|k| k[1] > k[0]).count()
    }

    fn clamp(&self, t: f64) -> f64 {
        let (lo, hi) = self.domain();
        t.clamp(lo, hi)
    }
}

/// Nonzero basis functions at a parameter.
#[derive(Default)]
struct Functions {
    first: usize,
    value: Vec<f64>,
    slope: Vec<f64>,
}

/// Pieces a span for a complexity from 0 to 1: 4, 11 at 0.5, 32. Coin's were 3, 6 and 31,
/// measured on a bicubic patch at 0, 0.1, 0.2, 0.3, 0.5, 0.7, 0.9 and 1; these are never fewer.
/// More, up to four times as many, where control points bend: chords then stay within
/// 0.004 · 0.02^complexity of the size, 0.0006 of it at 0.5.
fn pieces(complexity: f32, degree: usize, bend: f64, size: f64) -> usize {
    let c = if complexity.is_nan() {
        0.5
    } else {
        f64::from(complexity.clamp(0.0, 1.0))
    };
    if degree == 1 && bend == 0.0 {
        return 1;
    }
    let base = (4.0 * libm::pow(8.0, c)).round();
    let tolerance = size * 0.004 * libm::pow(0.02, c);
    let wanted = (0.125 * (degree * degree) as f64 * bend / tolerance)
        .sqrt()
        .ceil();
    let finest = 4.0 * base;
    (if wanted > base {
        wanted.min(finest)
    } else {
        base
    }) as usize
}

/// The point of a homogeneous one, unless that is at infinity.
fn project(p: DVec4) -> Option<DVec3> {
    let q = p.truncate() / p.w;
    (p.w != 0.0 && q.is_finite()).then_some(q)
}

/// The largest second difference along a row of control points, and whether their weights vary.
fn bend(row: impl Iterator<Item = DVec4>) -> f64 {
    let points: Vec<DVec4> = row.collect();
    let spread = points.windows(2).any(|p| p[0].w != p[1].w);
    let flat: Vec<DVec3> = points.iter().filter_map(|&p| project(p)).collect();
    let second = flat
        .windows(3)
        .map(|p| (p[0] - 2.0 * p[1] + p[2]).length())
        .fold(0.0, f64::max);
    let first = flat
        .windows(2)
        .map(|p| p[0].distance(p[1]))
        .fold(0.0, f64::max);
    if spread { second.max(first) } else { second }
}

fn size_of(points: &[DVec4]) -> f64 {
    let mut flat = points.iter().filter_map(|&p| project(p));
    let Some(first) = flat.next() else { return 0.0 };
    let (lo, hi) = flat.fold((first, first), |(lo, hi), p| (lo.min(p), hi.max(p)));
    lo.distance(hi)
}

fn check_points(points: &[DVec4]) -> Result<(), String> {
    match points.iter().position(|p| !p.is_finite()) {
        Some(i) => Err(format!("control point {i} is not a number")),
        None => Ok(()),
    }
}

/// A curve in space, or, with z = 0, in a surface's parameters.
#[derive(Clone, Debug, PartialEq)]
pub struct Curve {
    basis: Basis,
    points: Vec<DVec4>,
}

impl Curve {
    pub fn new(points: Vec<DVec4>, knots: &[f32]) -> Result<Self, String> {
        check_points(&points)?;
        let basis = Basis::new(points.len(), knots)?;
        Ok(Self { basis, points })
    }

    pub fn domain(&self) -> (f64, f64) {
        self.basis.domain()
    }

    /// The point at a parameter; `None` where it is at infinity.
    pub fn point(&self, t: f64) -> Option<DVec3> {
        let mut f = Functions::default();
        self.basis.functions(self.basis.clamp(t), &mut f);
        let sum = (0..f.value.len()).map(|i| f.value[i] * self.points[f.first + i]);
        project(sum.sum())
    }

    /// Points along the curve from end to end.
    pub fn polyline(&self, complexity: f32) -> Result<Vec<DVec3>, String> {
        let bend = bend(self.points.iter().copied());
        let degree = self.basis.order - 1;
        let wanted = pieces(complexity, degree, bend, size_of(&self.points));
        // A straight piece between knots needs no cut, whatever its neighbors do.
        let wanted = if degree == 1 { 1 } else { wanted };
        let most = (MAX_CELLS / self.basis.spans()).max(1);
        self.basis
            .cuts(wanted.min(most))
            .into_iter()
            .map(|t| self.point(t).ok_or_else(at_infinity))
            .collect()
    }
}

fn at_infinity() -> String {
    "a point is at infinity: its weight is 0".to_owned()
}

/// A trimming curve by control points `(u, v, w)`, as a polyline of the surface's parameters.
pub fn trim_curve(points: &[DVec3], knots: &[f32], complexity: f32) -> Result<Vec<DVec2>, String> {
    let points = points
        .iter()
        .map(|p| DVec4::new(p.x, p.y, 0.0, p.z))
        .collect();
    let line = Curve::new(points, knots)?.polyline(complexity)?;
    Ok(line.iter().map(|p| p.truncate()).collect())
}

/// A surface. Control points run along u first, as in Inventor.
#[derive(Clone, Debug, PartialEq)]
pub struct Surface {
    u: Basis,
    v: Basis,
    points: Vec<DVec4>,
}

/// A surface's point and its derivatives along u and v.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct SurfacePoint {
    pub position: DVec3,
    pub du: DVec3,
    pub dv: DVec3,
}

impl SurfacePoint {
    /// From the homogeneous point and its derivatives.
    fn of(s: DVec4, su: DVec4, sv: DVec4) -> Option<Self> {
        let position = project(s)?;
        let quotient = |d: DVec4| (d.truncate() - d.w * position) / s.w;
        Some(Self {
            position,
            du: quotient(su),
            dv: quotient(sv),
        })
    }

    fn on_row(row: &[(DVec4, DVec4)], fu: &Functions) -> Option<Self> {
        let (mut s, mut su, mut sv) = (DVec4::ZERO, DVec4::ZERO, DVec4::ZERO);
        for (i, (p, dp)) in row[fu.first..].iter().take(fu.value.len()).enumerate() {
            s += fu.value[i] * *p;
            su += fu.slope[i] * *p;
            sv += fu.value[i] * *dp;
        }
        Self::of(s, su, sv)
    }
}

impl Surface {
    /// `points` must hold `u_count · v_count` or more; the rest is left alone.
    pub fn new(
        u_count: usize,
        v_count: usize,
        u_knots: &[f32],
        v_knots: &[f32],
        mut points: Vec<DVec4>,
    ) -> Result<Self, String> {
        let needed = u_count.checked_mul(v_count).filter(|&n| n <= points.len());
        let Some(needed) = needed else {
            return Err(format!(
                "{u_count} by {v_count} control points are asked for, there are {}",
                points.len()
            ));
        };
        points.truncate(needed);
        check_points(&points)?;
        let u = Basis::new(u_count, u_knots).map_err(|e| format!("along u: {e}"))?;
        let v = Basis::new(v_count, v_knots).map_err(|e| format!("along v: {e}"))?;
        Ok(Self { u, v, points })
    }

    pub fn u_domain(&self) -> (f64, f64) {
        self.u.domain()
    }

    pub fn v_domain(&self) -> (f64, f64) {
        self.v.domain()
    }

    /// The point and its derivatives; `None` where it is at infinity.
    pub fn point(&self, u: f64, v: f64) -> Option<SurfacePoint> {
        let (mut fu, mut fv) = (Functions::default(), Functions::default());
        self.u.functions(self.u.clamp(u), &mut fu);
        self.v.functions(self.v.clamp(v), &mut fv);
        self.combine(&fu, &fv)
    }

    fn combine(&self, fu: &Functions, fv: &Functions) -> Option<SurfacePoint> {
        let (mut s, mut su, mut sv) = (DVec4::ZERO, DVec4::ZERO, DVec4::ZERO);
        for j in 0..fv.value.len() {
            let row = (fv.first + j) * self.u.count + fu.first;
            let (mut p, mut pu) = (DVec4::ZERO, DVec4::ZERO);
            for i in 0..fu.value.len() {
                p += fu.value[i] * self.points[row + i];
                pu += fu.slope[i] * self.points[row + i];
            }
            s += fv.value[j] * p;
            su += fv.value[j] * pu;
            sv += fv.slope[j] * p;
        }
        SurfacePoint::of(s, su, sv)
    }

    /// The surface at one v as a curve of u: its control points, and their change along v.
    fn row(&self, v: f64) -> Vec<(DVec4, DVec4)> {
        let mut f = Functions::default();
        self.v.functions(self.v.clamp(v), &mut f);
        let column = |i: usize| {
            let terms = (0..f.value.len()).map(|j| {
                let p = self.points[(f.first + j) * self.u.count + i];
                (f.value[j] * p, f.slope[j] * p)
            });
            terms.fold((DVec4::ZERO, DVec4::ZERO), |a, b| (a.0 + b.0, a.1 + b.1))
        };
        (0..self.u.count).map(column).collect()
    }

    /// The unit normal ∂u × ∂v. Where that vanishes (the tip of a cone, an edge drawn together
    /// to a point) it is taken a little toward the middle of the domain.
    fn normal(&self, u: f64, v: f64, at: &SurfacePoint) -> DVec3 {
        let cross = |p: &SurfacePoint| {
            let (du, dv) = (p.du.try_normalize()?, p.dv.try_normalize()?);
            let n = du.cross(dv);
            (n.length() > 1e-6).then(|| n.normalize())
        };
        if let Some(n) = cross(at) {
            return n;
        }
        let middle = |(lo, hi): (f64, f64)| 0.5 * (lo + hi);
        let (mu, mv) = (middle(self.u.domain()), middle(self.v.domain()));
        [1e-4, 1e-2, 0.1]
            .into_iter()
            .find_map(|t| {
                let p = self.point(u + t * (mu - u), v + t * (mv - v))?;
                cross(&p)
            })
            .unwrap_or(DVec3::Z)
    }

    /// Pieces a span along u and along v.
    fn density(&self, complexity: f32) -> (usize, usize) {
        let size = size_of(&self.points);
        let (nu, nv) = (self.u.count, self.v.count);
        let row = |j: usize| self.points[j * nu..(j + 1) * nu].iter().copied();
        let column = |i: usize| (0..nv).map(move |j| self.points[j * nu + i]);
        let bend_u = (0..nv).map(|j| bend(row(j))).fold(0.0, f64::max);
        let bend_v = (0..nu).map(|i| bend(column(i))).fold(0.0, f64::max);
        // A bilinear patch may be twisted, so only a flat net is left uncut.
        let twist = self.twist();
        let mut along_u = pieces(complexity, self.u.order - 1, bend_u.max(twist), size);
        let mut along_v = pieces(complexity, self.v.order - 1, bend_v.max(twist), size);
        while along_u * self.u.spans() * along_v * self.v.spans() > MAX_CELLS
            && along_u.max(along_v) > 1
        {
            along_u = along_u.div_ceil(2);
            along_v = along_v.div_ceil(2);
        }
        (along_u, along_v)
    }

    /// How far opposite edges of the net's cells are from parallel.
    fn twist(&self) -> f64 {
        let at =
            |i: usize, j: usize| project(self.points[j * self.u.count + i]).unwrap_or_default();
        let mut most = 0.0_f64;
        for j in 1..self.v.count {
            for i in 1..self.u.count {
                let twist = at(i, j) - at(i - 1, j) - at(i, j - 1) + at(i - 1, j - 1);
                most = most.max(twist.length());
            }
        }
        most
    }

    /// Triangles for the surface, or what its trimming loops leave of it.
    ///
    /// Loops are polylines of parameters, closed or not (the last point is joined to the first).
    /// As in OpenGL the surface is kept to the left of a loop: inside a counterclockwise one,
    /// outside a clockwise one, which is a hole. With holes alone the domain's edge is the outer
    /// loop; OpenGL asks the file to state it. Texture coordinates are the surface given for
    /// them (their x and y), or the parameters from 0 to 1 across the domain.
    pub fn tessellate(
        &self,
        complexity: f32,
        trims: &[Vec<DVec2>],
        texture: Option<&Self>,
    ) -> Result<Mesh, String> {
        let (along_u, along_v) = self.density(complexity);
        let us = self.u.cuts(along_u);
        let vs = self.v.cuts(along_v);
        if us.len().saturating_mul(vs.len()) > 4 * MAX_CELLS {
            return Err(format!("{} by {} pieces are too many", us.len(), vs.len()));
        }
        let mut cloth = Cloth {
            surface: self,
            texture,
            mesh: Mesh::default(),
        };
        if trims.is_empty() {
            cloth.grid(&us, &vs)?;
        } else {
            cloth.trimmed(&us, &vs, trims)?;
        }
        Ok(cloth.mesh)
    }
}

/// A surface being cut into triangles.
struct Cloth<'a> {
    surface: &'a Surface,
    texture: Option<&'a Surface>,
    mesh: Mesh,
}

impl Cloth<'_> {
    fn vertex(&mut self, u: f64, v: f64) -> Result<u32, String> {
        let at = self.surface.point(u, v).ok_or_else(at_infinity)?;
        Ok(self.add(u, v, &at))
    }

    fn add(&mut self, u: f64, v: f64, at: &SurfacePoint) -> u32 {
        let normal = self.surface.normal(u, v, at).as_vec3();
        let share = |t: f64, (lo, hi): (f64, f64)| (t - lo) / (hi - lo);
        let s = share(u, self.surface.u_domain());
        let t = share(v, self.surface.v_domain());
        let texcoord = match self.texture {
            None => DVec2::new(s, t),
            Some(map) => {
                let across = |x: f64, (lo, hi): (f64, f64)| lo + x * (hi - lo);
                let (u, v) = (across(s, map.u_domain()), across(t, map.v_domain()));
                let p = map.point(u, v).map_or(DVec3::ZERO, |p| p.position);
                p.truncate()
            }
        };
        let texcoord: Vec2 = texcoord.as_vec2();
        self.mesh.vertex(at.position.as_vec3(), normal, texcoord)
    }

    fn grid(&mut self, us: &[f64], vs: &[f64]) -> Result<(), String> {
        let functions = us.iter().map(|&u| {
            let mut f = Functions::default();
            self.surface.u.functions(u, &mut f);
            f
        });
        let functions: Vec<Functions> = functions.collect();
        for &v in vs {
            let row = self.surface.row(v);
            for (&u, f) in us.iter().zip(&functions) {
                let at = SurfacePoint::on_row(&row, f).ok_or_else(at_infinity)?;
                self.add(u, v, &at);
            }
        }
        let n = us.len() as u32;
        for j in 0..vs.len() as u32 - 1 {
            for i in 0..n - 1 {
                let [a, b] = [j * n + i, j * n + i + 1];
                self.mesh
                    .triangles
                    .extend([[a, b, b + n], [a, b + n, a + n]]);
            }
        }
        self.mesh
            .triangles
            .retain(|&t| has_area(&self.mesh.positions, t));
        Ok(())
    }

    /// Fills the loops in the plane of parameters, then cuts the filling along the grid's lines.
    fn trimmed(&mut self, us: &[f64], vs: &[f64], trims: &[Vec<DVec2>]) -> Result<(), String> {
        let filling = fill(self.surface, trims)?;
        let mut budget = 4 * MAX_CELLS;
        for triangle in filling {
            for strip in slice(&triangle, 0, us) {
                for piece in slice(&strip, 1, vs) {
                    budget = budget
                        .checked_sub(piece.len())
                        .ok_or("trimming cuts the surface into too many pieces")?;
                    self.fan(&piece)?;
                }
            }
        }
        Ok(())
    }

    fn fan(&mut self, piece: &[DVec2]) -> Result<(), String> {
        let corners: Result<Vec<u32>, String> =
            piece.iter().map(|p| self.vertex(p.x, p.y)).collect();
        let corners = corners?;
        for i in 2..corners.len() {
            let triangle = [corners[0], corners[i - 1], corners[i]];
            if has_area(&self.mesh.positions, triangle) {
                self.mesh.triangles.push(triangle);
            }
        }
        Ok(())
    }
}

fn has_area(positions: &[glam::Vec3], triangle: [u32; 3]) -> bool {
    let [a, b, c] = triangle.map(|i| positions[i as usize]);
    a != b && b != c && c != a
}

/// Counterclockwise triangles of what the loops keep, in the surface's parameters.
fn fill(surface: &Surface, trims: &[Vec<DVec2>]) -> Result<Vec<Vec<DVec2>>, String> {
    let (u, v) = (surface.u_domain(), surface.v_domain());
    let low = DVec2::new(u.0, v.0);
    let extent = DVec2::new(u.1 - u.0, v.1 - v.0);
    // The tessellator works on a fixed grid of `f32`; this spreads the domain over it.
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

/// Cuts a convex polygon along the lines `axis = cut` for each of the ascending cuts.
fn slice(polygon: &[DVec2], axis: usize, cuts: &[f64]) -> Vec<Vec<DVec2>> {
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

/// The part of a convex polygon below a line (side 1) or above it (side −1).
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

/// Where an edge meets a line; the same point from either end, so that neighbors agree.
fn crossing(a: DVec2, b: DVec2, axis: usize, cut: f64) -> DVec2 {
    let (a, b) = if a[axis] < b[axis] { (a, b) } else { (b, a) };
    let mut p = a + (b - a) * ((cut - a[axis]) / (b[axis] - a[axis]));
    p[axis] = cut;
    p
}

#[cfg(test)]
mod tests {
    use super::*;

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
        for p in curve.polyline(1.0).unwrap() {
            assert!((p.length() - 1.0).abs() < 4e-16, "{}", p.length() - 1.0);
        }
    }

    #[test]
    fn a_cylinders_normals_point_away_from_its_axis() {
        let mut points = quarter(0.0, 2.0).to_vec();
        points.extend(quarter(3.0, 2.0));
        let cylinder = Surface::new(3, 2, &QUADRATIC, &[0.0, 0.0, 1.0, 1.0], points).unwrap();
        let mesh = cylinder.tessellate(0.5, &[], None).unwrap();
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

    /// A quarter circle turned about its end is an eighth of a sphere, pole and all.
    #[test]
    fn a_sphere_has_its_normals_at_the_pole_too() {
        let h = 0.5_f64.sqrt();
        let profile = [(1.0, 0.0, 1.0), (1.0, 1.0, h), (0.0, 1.0, 1.0)];
        let mut points = Vec::new();
        for (r, z, w) in profile {
            points.extend(
                quarter(0.0, r).map(|p| DVec4::new(p.x * w, p.y * w, p.w * w * z, p.w * w)),
            );
        }
        let octant = Surface::new(3, 3, &QUADRATIC, &QUADRATIC, points).unwrap();
        let mesh = octant.tessellate(0.5, &[], None).unwrap();
        for (p, n) in mesh.positions.iter().zip(&mesh.normals) {
            assert!((p.length() - 1.0).abs() < 1e-6);
            assert!(n.dot(*p) > 1.0 - 1e-4, "{p} {n}");
        }
    }

    #[test]
    fn weights_below_and_knots_inside_still_give_the_polynomial() {
        // Uniform cubic B-spline of a straight line with equal steps: the line itself.
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

    fn square() -> Surface {
        let corner = |x, y| DVec4::new(x, y, 0.0, 1.0);
        let points = vec![
            corner(0.0, 0.0),
            corner(3.0, 0.0),
            corner(0.0, 3.0),
            corner(3.0, 3.0),
        ];
        let knots = [0.0, 0.0, 1.0, 1.0];
        Surface::new(2, 2, &knots, &knots, points).unwrap()
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
            let mesh = square().tessellate(0.5, &trims, None).unwrap();
            assert!((mesh.area() - area).abs() < 1e-5, "{} {area}", mesh.area());
            assert!(mesh.normals.iter().all(|n| n.z == 1.0));
        }
    }

    #[test]
    fn a_flat_patch_is_two_triangles() {
        let mesh = square().tessellate(1.0, &[], None).unwrap();
        assert_eq!(mesh.triangles.len(), 2);
        assert_eq!(mesh.texcoords[3], Vec2::ONE);
    }

    #[test]
    fn a_round_trim_on_a_curved_surface_has_the_right_area() {
        let mut points = quarter(0.0, 1.0).to_vec();
        points.extend(quarter(1.0, 1.0));
        let cylinder = Surface::new(3, 2, &QUADRATIC, &[0.0, 0.0, 1.0, 1.0], points).unwrap();
        let half = vec![ring([0.0, 0.0, 0.5, 1.0])];
        let mesh = cylinder.tessellate(0.5, &half, None).unwrap();
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
        let map = Surface::new(2, 2, &[0.0, 0.0, 9.0, 9.0], &[0.0, 0.0, 9.0, 9.0], map).unwrap();
        let mesh = square().tessellate(0.5, &[], Some(&map)).unwrap();
        assert_eq!(
            mesh.texcoords,
            [(0.5, 0.0), (1.0, 0.0), (0.5, 2.0), (1.0, 2.0)].map(Vec2::from)
        );
    }

    #[test]
    fn what_cannot_be_drawn_is_a_sentence() {
        let p = |w| vec![DVec4::new(1.0, 0.0, 0.0, w); 4];
        let cubic = [0.0, 0.0, 0.0, 0.0, 1.0, 1.0, 1.0, 1.0];
        for (points, knots, part) in [
            (p(1.0), vec![0.0; 5], "too few"),
            (p(1.0), vec![0.0; 8], "no room"),
            (
                p(1.0),
                vec![0.0, 0.0, 0.0, 0.0, 1.0, 0.5, 1.0, 1.0],
                "less than",
            ),
            (
                p(1.0),
                vec![0.0, 0.0, 0.0, f32::NAN, 1.0, 1.0, 1.0, 1.0],
                "not a number",
            ),
            (p(f64::NAN), cubic.to_vec(), "not a number"),
            (p(1.0), vec![0.0; 200], "order 196"),
            (p(1.0), vec![0.0; 10], "order 6 needs"),
        ] {
            let error = Curve::new(points, &knots).unwrap_err();
            assert!(error.contains(part), "{error}");
        }
        let infinite = Curve::new(p(0.0), &cubic).unwrap();
        assert!(infinite.polyline(0.5).unwrap_err().contains("infinity"));
        let huge = Surface::new(usize::MAX, 2, &cubic, &cubic, p(1.0)).unwrap_err();
        assert!(huge.contains("asked for"));
    }

    proptest::proptest! {
        /// Whatever the numbers, there is a sound mesh or a sentence.
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
            let made = Surface::new(u, v, &u_knots, &v_knots, points)
                .and_then(|s| s.tessellate(0.2, &trims, None));
            match made {
                Ok(mesh) => proptest::prop_assert!(mesh.is_sound()),
                Err(sentence) => proptest::prop_assert!(!sentence.is_empty()),
            }
        }
    }
}
