//! The lists of a mesh as `Mesh`, `BasisCurves` or `Points`.

use glam::{Affine2, DAffine3};
use ivcam_render::scene::model::{Mesh, Primitives};

use super::text::{UsdText, numbers, tuple, tuples};
use crate::export::appearance::texture_point;
use crate::export::color::base_color;

/// The width of lines and points as a fraction of the scene's size. USD has no widths in pixels.
const WIDTH: f64 = 0.001;

/// The name of the schema of a mesh.
pub(super) fn schema(mesh: &Mesh) -> &'static str {
    match mesh.primitives {
        Primitives::Triangles(_) => "Mesh",
        Primitives::Lines(_) => "BasisCurves",
        Primitives::Points => "Points",
    }
}

/// How a material changes the lists of a mesh.
#[derive(Clone, Copy, Debug)]
pub(super) struct MeshLook {
    /// The matrix of the texture coordinates.
    pub matrix: Affine2,
    /// The share of the base color in the colors of the mesh.
    pub share: f32,
}

/// Writes the properties of a mesh under a material. `size` is that of the scene.
pub(super) fn write(out: &mut UsdText, mesh: &Mesh, look: MeshLook, size: f64) {
    match &mesh.primitives {
        Primitives::Triangles(list) => {
            out.line("uniform token subdivisionScheme = \"none\"");
            out.line(format_args!(
                "int[] faceVertexCounts = {}",
                numbers(&vec![3; list.len()])
            ));
            out.line(format_args!(
                "int[] faceVertexIndices = {}",
                numbers(list.as_flattened())
            ));
            lists(out, mesh, None, look);
        }
        Primitives::Lines(list) => {
            let corners: Vec<usize> = list.as_flattened().iter().map(|v| *v as usize).collect();
            out.line("uniform token type = \"linear\"");
            out.line(format_args!(
                "int[] curveVertexCounts = {}",
                numbers(&vec![2; list.len()])
            ));
            widths(out, size);
            lists(out, mesh, Some(&corners), look);
        }
        Primitives::Points => {
            widths(out, size);
            lists(out, mesh, None, look);
        }
    }
}

fn widths(out: &mut UsdText, size: f64) {
    let width = (WIDTH * size) as f32;
    out.line(format_args!(
        "float[] widths = [{width}] (\n        interpolation = \"constant\"\n    )"
    ));
}

/// Writes the lists of vertices: all in order, or those of `corners`.
fn lists(out: &mut UsdText, mesh: &Mesh, corners: Option<&[usize]>, look: MeshLook) {
    let all: Vec<usize> = (0..mesh.positions.len()).collect();
    let corners = corners.unwrap_or(&all);
    if let Some((min, max)) = mesh.bounds(&DAffine3::IDENTITY) {
        let [min, max] = [min, max].map(|p| tuple(p.as_vec3().to_array()));
        out.line(format_args!("float3[] extent = [{min}, {max}]"));
    }
    let points = corners.iter().map(|&v| mesh.positions[v].to_array());
    out.line(format_args!("point3f[] points = {}", tuples(points)));
    let mut primvar = |kind: &str, list: String| {
        out.line(format_args!("{kind} = {list} ("));
        out.line("    interpolation = \"vertex\"");
        out.line(")");
    };
    if !mesh.normals.is_empty() {
        let normals = corners.iter().map(|&v| mesh.normals[v].to_array());
        primvar("normal3f[] normals", tuples(normals));
    }
    if !mesh.coordinates.is_empty() {
        let at = |v: &usize| texture_point(look.matrix, mesh.coordinates[*v]).to_array();
        primvar("texCoord2f[] primvars:st", tuples(corners.iter().map(at)));
    }
    if !mesh.colors.is_empty() {
        let color = |v: &usize| {
            let [r, g, b, _] = mesh.colors[*v];
            base_color([r, g, b], look.share)
        };
        let colors = tuples(corners.iter().map(color));
        primvar("color3f[] primvars:displayColor", colors);
        let opacities: Vec<f32> = corners.iter().map(|&v| mesh.colors[v][3]).collect();
        if opacities.iter().any(|a| *a < 1.0) {
            primvar("float[] primvars:displayOpacity", numbers(&opacities));
        }
    }
}
