//! Triangulates a VRML97 `ElevationGrid` (6.17).
//!
//! Normals are smooth between quadrilaterals within the crease angle. In the result front faces are
//! counterclockwise, whatever the value of the field `ccw`.

use glam::{DVec3, Vec2, Vec3};
use ivcam_base::math::polygon_normal;

use super::mesh::{QUAD_CORNERS, TriangleMesh};

/// The fields of an `ElevationGrid`, with the values of the nodes in them.
#[derive(Clone, Copy, Debug)]
pub(crate) struct ElevationGrid<'a> {
    /// The number of columns of points.
    pub x_dimension: i32,
    /// The number of rows of points.
    pub z_dimension: i32,
    /// The distance between columns.
    pub x_spacing: f32,
    /// The distance between rows.
    pub z_spacing: f32,
    /// The heights of the points, row by row.
    pub height: &'a [f32],
    /// Whether the front is the upper side.
    pub ccw: bool,
    /// The largest angle between smooth faces, in radians.
    pub crease_angle: f32,
    /// Whether colors are bound to vertices and not to faces; `None` without a `Color` node.
    pub color_per_vertex: Option<bool>,
    /// The normals; empty without a `Normal` node.
    pub normals: &'a [Vec3],
    /// Whether normals are bound to vertices and not to faces.
    pub normal_per_vertex: bool,
    /// The texture coordinates; empty without a `TextureCoordinate` node.
    pub texcoords: &'a [Vec2],
}

impl ElevationGrid<'_> {
    /// The memory in bytes of a point while a grid is made: its four vertices and two triangles.
    const BYTES_OF_POINT: usize = 220;

    /// Returns the memory in bytes that making the triangles takes.
    pub(crate) fn bytes(&self) -> u64 {
        self.height.len().saturating_mul(Self::BYTES_OF_POINT) as u64
    }
}

/// Returns the triangles of an elevation grid.
///
/// Each quadrilateral is cut from the corner with smaller x and larger z to the opposite one, as in
/// Coin. Default texture coordinates run from 0 to 1 along x and z.
///
/// # Errors
/// Returns a sentence if there are too few heights, or if a point is not finite.
pub(crate) fn elevation_grid(node: &ElevationGrid<'_>) -> Result<TriangleMesh, String> {
    let dimension = |d: i32| usize::try_from(d).unwrap_or(0);
    let (nx, nz) = (dimension(node.x_dimension), dimension(node.z_dimension));
    if nx < 2 || nz < 2 {
        return Ok(TriangleMesh::default());
    }
    let needed = nx.checked_mul(nz).filter(|&n| n <= node.height.len());
    let Some(needed) = needed else {
        return Err(format!(
            "the grid needs {nx} by {nz} heights, but there are {}",
            node.height.len()
        ));
    };
    let points: Vec<DVec3> = (0..needed)
        .map(|i| {
            let x = (i % nx) as f64 * f64::from(node.x_spacing);
            let z = (i / nx) as f64 * f64::from(node.z_spacing);
            DVec3::new(x, f64::from(node.height[i]), z)
        })
        .collect();
    if let Some(i) = points.iter().position(|p| !p.is_finite()) {
        return Err(format!("height {i} is not finite"));
    }
    let patch = GridPatch {
        points,
        columns: nx,
    };
    Ok(mesh_of(&patch, node))
}

/// Makes the mesh of a grid of points.
fn mesh_of(patch: &GridPatch, node: &ElevationGrid<'_>) -> TriangleMesh {
    let nx = patch.columns;
    let nz = patch.rows();
    let normals = patch.normals();
    let smooth = f64::from(libm::cosf(
        node.crease_angle.clamp(0.0, std::f32::consts::PI),
    ));
    // In the order of `QUAD_CORNERS` the normals of the quadrilaterals point down.
    let up = if node.ccw { -1.0 } else { 1.0 };
    let mut mesh = TriangleMesh::default();
    for z in 0..nz - 1 {
        for x in 0..nx - 1 {
            let quad = z * (nx - 1) + x;
            let corners = QUAD_CORNERS.map(|(dx, dz)| {
                let point = (z + dz) * nx + x + dx;
                let stated = if node.normal_per_vertex { point } else { quad };
                let normal = match node.normals.get(stated) {
                    Some(n) => n.normalize_or_zero(),
                    None => (up * patch.corner(&normals, (x, z), (dx, dz), smooth)).as_vec3(),
                };
                let share = Vec2::new(
                    (x + dx) as f32 / (nx - 1) as f32,
                    (z + dz) as f32 / (nz - 1) as f32,
                );
                let texcoord = node.texcoords.get(point).copied().unwrap_or(share);
                if let Some(per_vertex) = node.color_per_vertex {
                    mesh.colors
                        .push(if per_vertex { point } else { quad } as u32);
                }
                mesh.vertex(patch.points[point].as_vec3(), normal, texcoord)
            });
            let [a, b, c, d] = corners;
            let halves = if node.ccw {
                [[d, c, b], [d, b, a]]
            } else {
                [[d, b, c], [d, a, b]]
            };
            mesh.triangles.extend(halves);
        }
    }
    mesh
}

/// A grid of points, row by row, with a quadrilateral between each four of them.
struct GridPatch {
    points: Vec<DVec3>,
    columns: usize,
}

impl GridPatch {
    fn rows(&self) -> usize {
        self.points.len() / self.columns
    }

    /// Returns the unit normals of the quadrilaterals. A quadrilateral without area has a zero
    /// normal.
    fn normals(&self) -> Vec<DVec3> {
        let n = self.columns;
        let at = |x: usize, y: usize| self.points[y * n + x];
        let quads = (0..self.rows() - 1).flat_map(|y| (0..n - 1).map(move |x| (x, y)));
        quads
            .map(|(x, y)| {
                polygon_normal(QUAD_CORNERS.map(|(dx, dy)| at(x + dx, y + dy))).normalize_or_zero()
            })
            .collect()
    }

    /// Returns the normal of a quadrilateral at one of its corners. It is the mean of the face's
    /// own normal and of those faces' normals at the corner that are within the crease angle of it.
    /// `smooth` is the cosine of that angle.
    fn corner(
        &self,
        normals: &[DVec3],
        (x, y): (usize, usize),
        (dx, dy): (usize, usize),
        smooth: f64,
    ) -> DVec3 {
        let (across, down) = (self.columns - 1, self.rows() - 1);
        let own = normals[y * across + x];
        let beside = step(x, dx, across);
        let below = step(y, dy, down);
        let neighbors = [
            beside.map(|x| (x, y)),
            below.map(|y| (x, y)),
            beside.zip(below),
        ];
        let sum = neighbors.into_iter().flatten().fold(own, |sum, (x, y)| {
            let other = normals[y * across + x];
            if own.dot(other) > smooth {
                sum + other
            } else {
                sum
            }
        });
        sum.normalize_or(own)
    }
}

/// Returns the neighbor before (`side` 0) or after (`side` 1) an index in a row of `count`.
fn step(at: usize, side: usize, count: usize) -> Option<usize> {
    match side {
        0 => at.checked_sub(1),
        _ => (at + 1 < count).then_some(at + 1),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn grid<'a>(height: &'a [f32], x: i32, z: i32) -> ElevationGrid<'a> {
        ElevationGrid {
            x_dimension: x,
            z_dimension: z,
            x_spacing: 2.0,
            z_spacing: 1.0,
            height,
            ccw: true,
            crease_angle: 0.0,
            color_per_vertex: None,
            normals: &[],
            normal_per_vertex: true,
            texcoords: &[],
        }
    }

    #[test]
    fn a_grid_faces_up_and_is_cut_as_in_coin() {
        let heights = [0.0, 1.0, 0.0, 2.0, 0.0, 1.0];
        let mesh = elevation_grid(&grid(&heights, 3, 2)).unwrap();
        assert!(mesh.is_sound() && mesh.normals.iter().all(|n| n.y > 0.0));
        let first = mesh.triangles[0].map(|i| mesh.positions[i as usize].to_array());
        assert_eq!(first, [[0.0, 2.0, 1.0], [2.0, 0.0, 1.0], [2.0, 1.0, 0.0]]);
        let [a, b, c] = first.map(Vec3::from);
        assert!((b - a).cross(c - a).y > 0.0);
        let down = ElevationGrid {
            ccw: false,
            ..grid(&heights, 3, 2)
        };
        assert!(
            elevation_grid(&down)
                .unwrap()
                .normals
                .iter()
                .all(|n| n.y < 0.0)
        );
    }

    #[test]
    fn a_tilted_plane_has_one_normal_and_colors_by_vertex_or_face() {
        let heights: Vec<f32> = (0..12).map(|i| (i % 4) as f32 * 2.0).collect();
        let node = ElevationGrid {
            color_per_vertex: Some(false),
            ..grid(&heights, 4, 3)
        };
        let mesh = elevation_grid(&node).unwrap();
        let tilted = Vec3::new(-1.0, 1.0, 0.0).normalize();
        assert!(mesh.normals.iter().all(|n| (*n - tilted).length() < 1e-6));
        assert_eq!(mesh.colors.iter().max(), Some(&5));
        let node = ElevationGrid {
            color_per_vertex: Some(true),
            ..node
        };
        assert_eq!(
            elevation_grid(&node).unwrap().colors.iter().max(),
            Some(&11)
        );
    }

    #[test]
    fn wrong_values_are_errors_or_draw_nothing() {
        assert!(elevation_grid(&grid(&[0.0; 3], i32::MAX, i32::MAX)).is_err());
        assert!(elevation_grid(&grid(&[f32::NAN; 4], 2, 2)).is_err());
        assert_eq!(
            elevation_grid(&grid(&[], -1, 5)).unwrap(),
            TriangleMesh::default()
        );
    }
}
