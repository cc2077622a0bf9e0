//! Moves a scene that is far from its origin, because positions in files have 24 bits.

use glam::{DAffine3, DVec3};

use super::mesh::Mesh;
use super::scene_model::Model;
use crate::scene::precision::are_in_reach;

/// A scene is far if its distance from the origin is more than this many times its size. The error
/// of positions with 24 bits is then above 1/16,000 of the size.
const FAR: f64 = 1000.0;

/// Moves a scene that is far from its origin, and the meshes that are far from theirs. A scene
/// out of reach ([`are_in_reach`]) stays where it is.
pub(super) fn recenter(model: &mut Model) {
    let Some(bounds) = model.bounds() else {
        return;
    };
    let center = 0.5 * (bounds.0 + bounds.1);
    let size = (bounds.1 - bounds.0).max_element();
    let distance = center.abs().max_element();
    if !(distance > FAR * size && are_in_reach(&[distance]) && size > 0.0) {
        return;
    }
    // Whole numbers are easy to read and to add again.
    model.offset = center.round();
    let offset = model.offset;
    let alone = used_alone(model);
    let meshes = model.meshes.iter_mut().zip(alone);
    let moves: Vec<DVec3> = meshes
        .map(|(mesh, alone)| {
            if alone {
                center_mesh(mesh)
            } else {
                DVec3::ZERO
            }
        })
        .collect();
    for node in &mut model.nodes {
        node.world.translation -= offset;
        if let [part] = node.parts[..] {
            node.center = moves[part.mesh];
            node.world.translation += node.world.matrix3 * node.center;
        }
        let far = node.world.translation.abs().max_element() > FAR * size;
        if far && node.parts.is_empty() {
            node.world = DAffine3::IDENTITY;
            node.is_fixed = true;
        }
    }
    for light in &mut model.lights {
        light.position -= offset;
    }
    for camera in &mut model.cameras {
        camera.pose.position -= offset;
    }
    model.set_locals();
}

/// Returns for each mesh whether no node has another mesh beside it. Meshes of one node must stay
/// together.
fn used_alone(model: &Model) -> Vec<bool> {
    let mut alone = vec![true; model.meshes.len()];
    for node in model.nodes.iter().filter(|n| n.parts.len() > 1) {
        for part in &node.parts {
            alone[part.mesh] = false;
        }
    }
    alone
}

/// Moves a mesh that is far from its own origin, and returns the point that is its new origin.
fn center_mesh(mesh: &mut Mesh) -> DVec3 {
    let Some((min, max)) = mesh.bounds(&DAffine3::IDENTITY) else {
        return DVec3::ZERO;
    };
    let center = (0.5 * (min + max)).round();
    if center.abs().max_element() <= FAR * (max - min).max_element() {
        return DVec3::ZERO;
    }
    for p in &mut mesh.positions {
        *p = (p.as_dvec3() - center).as_vec3();
    }
    center
}
