//! PLY: the triangles of a scene in world space, as one mesh with colors of vertices.
//!
//! The file is binary, little endian. Colors are those of materials, as a screen shows them.

use std::io::Write;

use glam::{DAffine3, DVec3, Vec3};
use ivcam_base::diag::{Diagnostic, Result};
use ivcam_base::work::until_stopped;
use ivcam_render::scene::model::{Material, Mesh, Model};

/// Writes a model.
///
/// # Errors
/// Fails if there are more than 2^32 vertices.
pub(super) fn write(model: &Model) -> Result<Vec<u8>> {
    let meshes = || {
        model
            .placed_meshes()
            .filter(|m| !m.0.triangles().is_empty())
    };
    let vertices: usize = meshes().map(|(mesh, ..)| mesh.positions.len()).sum();
    if u32::try_from(vertices).is_err() {
        return Err(Diagnostic::beyond_limit(format!(
            "{vertices} vertices are too many for PLY"
        )));
    }
    let mut out = Vec::new();
    header(&mut out, model, vertices);
    for (mesh, material, world, _) in meshes() {
        write_vertices(&mut out, mesh, material, world);
    }
    let mut first = 0;
    for (mesh, _, world, _) in meshes() {
        let is_mirrored = world.matrix3.determinant() < 0.0;
        for &[a, b, c] in until_stopped(mesh.triangles().iter()) {
            let corners = if is_mirrored { [a, c, b] } else { [a, b, c] };
            out.push(3);
            for v in corners {
                out.extend((first + v).to_le_bytes());
            }
        }
        first += mesh.positions.len() as u32;
    }
    Ok(out)
}

/// Writes the header.
fn header(out: &mut Vec<u8>, model: &Model, vertices: usize) {
    let DVec3 { x, y, z } = model.offset;
    let mut text = String::from("ply\nformat binary_little_endian 1.0\ncomment by ivcam\n");
    if model.offset != DVec3::ZERO {
        text += &format!("comment offset {x} {y} {z}\n");
    }
    text += &format!("element vertex {vertices}\n");
    for name in ["x", "y", "z", "nx", "ny", "nz"] {
        text += &format!("property float {name}\n");
    }
    for name in ["red", "green", "blue", "alpha"] {
        text += &format!("property uchar {name}\n");
    }
    let triangles = model.triangle_count();
    text += &format!("element face {triangles}\nproperty list uchar uint vertex_indices\n");
    out.extend(text.bytes());
    out.extend(b"end_header\n");
}

/// Writes the vertices of a mesh in world space.
fn write_vertices(out: &mut Vec<u8>, mesh: &Mesh, material: &Material, world: &DAffine3) {
    let turn = normal_matrix(world);
    let plain = material.diffuse.extend(1.0 - material.transparency);
    for (i, p) in until_stopped(mesh.positions.iter()).enumerate() {
        let position = world.transform_point3(p.as_dvec3()).as_vec3();
        let normal = mesh.normals.get(i).copied().unwrap_or(Vec3::Z);
        let normal = (turn * normal.as_dvec3()).normalize_or(DVec3::Z).as_vec3();
        for v in position.to_array().into_iter().chain(normal.to_array()) {
            out.extend(v.to_le_bytes());
        }
        let color = mesh.colors.get(i).copied().unwrap_or(plain.to_array());
        let level = |v: f32| (v.clamp(0.0, 1.0) * 255.0 + 0.5) as u8;
        out.write_all(&color.map(level))
            .expect("a vector accepts bytes");
    }
}

/// The matrix that turns normals to world space.
pub(super) fn normal_matrix(world: &DAffine3) -> glam::DMat3 {
    let inverse = world.matrix3.inverse();
    if inverse.is_finite() {
        inverse.transpose()
    } else {
        world.matrix3
    }
}
