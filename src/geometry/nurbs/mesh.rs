//! Triangulates a surface, whole or trimmed.

use glam::{DVec2, DVec3, Vec2};

use super::basis::BasisFunctions;
use super::control::{MAX_CELLS, at_infinity};
use super::surface::{Surface, SurfacePoint};
use super::trim::{fill, slice};
use crate::geometry::mesh::Mesh;

impl Surface {
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
        complexity: f32,
        trims: &[Vec<DVec2>],
        texture: Option<&Self>,
    ) -> Result<Mesh, String> {
        let (along_u, along_v) = self.density(complexity);
        let us = self.u.cuts(along_u);
        let vs = self.v.cuts(along_v);
        if us.len().saturating_mul(vs.len()) > 4 * MAX_CELLS {
            return Err(format!("{} by {} points are too many", us.len(), vs.len()));
        }
        let mut mesher = SurfaceMesher {
            surface: self,
            texture,
            mesh: Mesh::default(),
        };
        if trims.is_empty() {
            mesher.grid(&us, &vs)?;
        } else {
            mesher.trimmed(&us, &vs, trims)?;
        }
        Ok(mesher.mesh)
    }
}

/// A surface being cut into triangles.
struct SurfaceMesher<'a> {
    surface: &'a Surface,
    texture: Option<&'a Surface>,
    mesh: Mesh,
}

impl SurfaceMesher<'_> {
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

    /// Adds the whole surface.
    fn grid(&mut self, us: &[f64], vs: &[f64]) -> Result<(), String> {
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

    /// Fills the loops in the parameter plane, then cuts the triangles along the lines of the grid.
    fn trimmed(&mut self, us: &[f64], vs: &[f64], trims: &[Vec<DVec2>]) -> Result<(), String> {
        let filling = fill(self.surface.u_domain(), self.surface.v_domain(), trims)?;
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

/// Whether the corners of a triangle are three different points.
fn has_area(positions: &[glam::Vec3], triangle: [u32; 3]) -> bool {
    let [a, b, c] = triangle.map(|i| positions[i as usize]);
    a != b && b != c && c != a
}
