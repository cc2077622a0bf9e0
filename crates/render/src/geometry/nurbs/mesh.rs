//! Triangulates a surface, whole or trimmed.

use glam::{DVec2, DVec3, Vec2};

use super::basis::BasisFunctions;
use super::control::{MAX_CELLS, at_infinity};
use super::detail::Detail;
use super::edges::Edges;
use super::surface::{NurbsSurface, SurfacePoint};
use super::surface_cuts::merged;
use super::trim::{fill, slice};
use crate::geometry::mesh::TriangleMesh;

impl NurbsSurface {
    /// Returns the triangles of the surface, or of the part that its trimming loops keep.
    ///
    /// Loops are polylines of parameters. The last point is joined to the first. As in OpenGL the
    /// surface is kept to the left of a loop: a counterclockwise loop keeps its inside, and a
    /// clockwise one is a hole. If all loops are holes, the edge of the domain is the outer loop;
    /// OpenGL requires the file to contain it. Texture coordinates are x and y of the surface
    /// `texture`. Without it they are the parameters, scaled to 0 to 1 across the domain.
    ///
    /// # Errors
    /// Returns a sentence if there are too many pieces, if a point is at infinity, or if the loops
    /// cannot be filled.
    pub(crate) fn tessellate(
        &self,
        detail: &Detail<'_>,
        trims: &[Vec<DVec2>],
        texture: Option<&Self>,
    ) -> Result<TriangleMesh, String> {
        let (mut us, mut vs, edges) = self.cuts(detail);
        if let Some(map) = texture.filter(|_| edges.is_some()) {
            // The picture on a flat surface may bend.
            let (along_s, along_t) = map.density(detail.complexity);
            let moved = |cuts: Vec<f64>, from, to| -> Vec<f64> {
                let cuts = cuts.into_iter().map(|t| rescaled(t, from, to));
                cuts.collect()
            };
            let s_cuts = moved(map.u.cuts(along_s), map.u_domain(), self.u_domain());
            let t_cuts = moved(map.v.cuts(along_t), map.v_domain(), self.v_domain());
            (us, vs) = (merged(&[&us, &s_cuts]), merged(&[&vs, &t_cuts]));
        }
        if us.len().saturating_mul(vs.len()) > 4 * MAX_CELLS {
            return Err(format!("{} by {} points are too many", us.len(), vs.len()));
        }
        let mut mesher = SurfaceMesher {
            surface: self,
            texture,
            edges,
            mesh: TriangleMesh::default(),
        };
        if trims.is_empty() {
            mesher.whole(&us, &vs)?;
        } else {
            mesher.trimmed(&us, &vs, trims)?;
        }
        Ok(mesher.mesh)
    }
}

/// Vertices in a line, each with its parameter along the line.
type GridLine = Vec<(f64, u32)>;

/// A surface being cut into triangles.
struct SurfaceMesher<'a> {
    surface: &'a NurbsSurface,
    texture: Option<&'a NurbsSurface>,
    /// The edges that the vertices on them are moved to.
    edges: Option<Edges>,
    mesh: TriangleMesh,
}

impl SurfaceMesher<'_> {
    fn vertex(&mut self, u: f64, v: f64) -> Result<u32, String> {
        let at = self.surface.point(u, v).ok_or_else(at_infinity)?;
        Ok(self.add(u, v, &at))
    }

    fn add(&mut self, u: f64, v: f64, at: &SurfacePoint) -> u32 {
        let normal = self.surface.normal(u, v, at).as_vec3();
        let s = rescaled(u, self.surface.u_domain(), (0.0, 1.0));
        let t = rescaled(v, self.surface.v_domain(), (0.0, 1.0));
        let texcoord = match self.texture {
            None => DVec2::new(s, t),
            Some(map) => {
                let u = rescaled(s, (0.0, 1.0), map.u_domain());
                let v = rescaled(t, (0.0, 1.0), map.v_domain());
                let p = map.point(u, v).map_or(DVec3::ZERO, |p| p.position);
                p.truncate()
            }
        };
        let texcoord: Vec2 = texcoord.as_vec2();
        let on_edge = self.edges.as_ref().and_then(|edges| edges.point(u, v));
        let position = on_edge.unwrap_or(at.position).as_vec3();
        self.mesh.vertex(position, normal, texcoord)
    }

    /// Adds the whole surface.
    fn whole(&mut self, us: &[f64], vs: &[f64]) -> Result<(), String> {
        match self.edges.take() {
            None => self.grid(us, vs).map(|_| ())?,
            Some(edges) => {
                // An edge may bend more than a single cell beside it, by rounding.
                let inside = |cuts: &[f64], [low, high]: [&[f64]; 2]| match cuts.len() {
                    0..3 => merged(&[cuts, low, high]),
                    _ => cuts.to_vec(),
                };
                let (on_u, on_v) = (edges.u_cuts(), edges.v_cuts());
                let (us, vs) = (inside(us, on_u), inside(vs, on_v));
                let along_u = on_u.map(|cuts| merged(&[&us, cuts]));
                let along_v = on_v.map(|cuts| merged(&[&vs, cuts]));
                self.edges = Some(edges);
                self.framed(&us, &vs, [along_u, along_v])?;
            }
        }
        self.mesh
            .triangles
            .retain(|&t| has_area(&self.mesh.positions, t));
        Ok(())
    }

    /// Adds a grid of vertices with its cells, and returns the number of its first vertex.
    fn grid(&mut self, us: &[f64], vs: &[f64]) -> Result<u32, String> {
        let first = self.mesh.positions.len() as u32;
        let functions = us.iter().map(|&u| {
            let mut f = BasisFunctions::default();
            self.surface.u.functions(u, &mut f);
            f
        });
        let functions: Vec<BasisFunctions> = functions.collect();
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
                let [a, b] = [first + j * n + i, first + j * n + i + 1];
                self.mesh
                    .triangles
                    .extend([[a, b, b + n], [a, b + n, a + n]]);
            }
        }
        Ok(first)
    }

    /// Adds the whole surface, with other cuts on its edges than inside. `edges` are the parameters
    /// of the vertices on the edges along u and along v, from the smaller of the other parameter.
    fn framed(
        &mut self,
        us: &[f64],
        vs: &[f64],
        [along_u, along_v]: [[Vec<f64>; 2]; 2],
    ) -> Result<(), String> {
        let (u, v) = (self.surface.u_domain(), self.surface.v_domain());
        let mut line = |cuts: &[f64], at: &dyn Fn(f64) -> (f64, f64)| -> Result<GridLine, String> {
            cuts.iter()
                .map(|&t| Ok((t, self.vertex(at(t).0, at(t).1)?)))
                .collect()
        };
        let bottom = line(&along_u[0], &|t| (t, v.0))?;
        let top = line(&along_u[1], &|t| (t, v.1))?;
        let left = line(&along_v[0], &|t| (u.0, t))?;
        let right = line(&along_v[1], &|t| (u.1, t))?;
        // Lines run along u or along v. The second line of a strip is at the left of the first.
        if vs.len() < 3 {
            self.strip(&bottom, &top);
        } else if us.len() < 3 {
            self.strip(&right, &left);
        } else {
            let (us, vs) = (&us[1..us.len() - 1], &vs[1..vs.len() - 1]);
            let first = self.grid(us, vs)?;
            let (n, rows) = (us.len() as u32, vs.len() as u32);
            let row = |j: u32| -> GridLine { us.iter().copied().zip(first + j * n..).collect() };
            let column = |i: u32| -> GridLine {
                let numbers = (0..rows).map(|j| first + j * n + i);
                vs.iter().copied().zip(numbers).collect()
            };
            self.strip(&bottom, &row(0));
            self.strip(&row(rows - 1), &top);
            self.strip(&column(0), &left);
            self.strip(&right, &column(n - 1));
        }
        Ok(())
    }

    /// Adds the triangles between two lines of vertices that run in the same direction, with the
    /// second at the left of the first.
    fn strip(&mut self, right: &GridLine, left: &GridLine) {
        let (mut i, mut j) = (0, 0);
        while let (a, b) = (right.get(i + 1), left.get(j + 1))
            && (a.is_some() || b.is_some())
        {
            let [before_right, before_left] = [right[i].1, left[j].1];
            let triangle = match (a, b) {
                (Some(a), b) if b.is_none_or(|b| a.0 <= b.0) => {
                    i += 1;
                    [before_right, a.1, before_left]
                }
                (_, Some(b)) => {
                    j += 1;
                    [before_right, b.1, before_left]
                }
                _ => break,
            };
            self.mesh.triangles.push(triangle);
        }
    }

    /// Fills the loops in the parameter plane, then cuts the triangles along the lines of the grid,
    /// which continue those of the edges.
    fn trimmed(&mut self, us: &[f64], vs: &[f64], trims: &[Vec<DVec2>]) -> Result<(), String> {
        let (mut us, mut vs) = (vec![us], vec![vs]);
        if let Some(edges) = &self.edges {
            us.extend(edges.u_cuts());
            vs.extend(edges.v_cuts());
        }
        let (us, vs) = (merged(&us), merged(&vs));
        let filling = fill(self.surface.u_domain(), self.surface.v_domain(), trims)?;
        let mut budget = 4 * MAX_CELLS;
        for triangle in filling {
            for strip in slice(&triangle, 0, &us) {
                for piece in slice(&strip, 1, &vs) {
                    budget = budget
                        .checked_sub(piece.len())
                        .ok_or("trimming cuts the surface into too many pieces")?;
                    self.fan(&piece)?;
                }
            }
        }
        Ok(())
    }

    /// Adds a convex polygon of parameters as a fan of triangles.
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

/// Returns a number of one interval at the same place of another one.
fn rescaled(t: f64, from: (f64, f64), to: (f64, f64)) -> f64 {
    to.0 + (t - from.0) / (from.1 - from.0) * (to.1 - to.0)
}

/// Whether the corners of a triangle are three different points.
fn has_area(positions: &[glam::Vec3], triangle: [u32; 3]) -> bool {
    let [a, b, c] = triangle.map(|i| positions[i as usize]);
    a != b && b != c && c != a
}
