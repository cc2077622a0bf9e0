//! The groups, shapes and geometry.

use std::collections::HashMap;

use glam::DAffine3;
use ivcam_inventor::grammar::normal_binding;
use ivcam_inventor::grammar::value::{NodeId, Value};
use ivcam_render::scene::model::{Mesh, Model, Part, Primitives, SceneNode};

use super::look::Looks;
use crate::export::nodes::{NodeBuilder, indices, needs_group, transform_fields, tree_of};

/// A matrix whose numbers differ by less from those of the identity moves nothing: the difference
/// is the rounding of a product with an inverse.
const STILL: f64 = 1e-12;

/// The state of writing the shapes.
struct TreeWriter<'w, 'm> {
    model: &'m Model,
    nodes: &'w mut NodeBuilder,
    looks: Looks<'m>,
    /// The shapes of parts, with whether their matrix mirrors them.
    shapes: HashMap<(Part, bool), NodeId>,
    /// The geometry of meshes.
    geometry: HashMap<usize, NodeId>,
}

/// Returns the nodes of the model's root, and the pictures beside the file, whose names begin with
/// `stem`. If it is empty, the pictures are in the file.
pub(super) fn tree(
    model: &Model,
    stem: &str,
    nodes: &mut NodeBuilder,
) -> (Vec<NodeId>, Vec<(String, Vec<u8>)>) {
    let mut writer = TreeWriter {
        model,
        nodes,
        looks: Looks::new(model, stem),
        shapes: HashMap::new(),
        geometry: HashMap::new(),
    };
    let roots = writer.groups();
    (roots, writer.looks.beside)
}

impl TreeWriter<'_, '_> {
    /// Returns the nodes of the model's root.
    fn groups(&mut self) -> Vec<NodeId> {
        tree_of(self.model, |node, children| {
            let is_mirrored = node.world.matrix3.determinant() < 0.0;
            let shapes = node.parts.iter().map(|p| self.shape(*p, is_mirrored));
            let own = shapes.chain(children).collect();
            self.grouped(node, own)
        })
    }

    /// Returns the nodes of a node of the model, in a separator with its name and matrix if it
    /// needs one.
    fn grouped(&mut self, node: &SceneNode, own: Vec<NodeId>) -> Vec<NodeId> {
        let name = node.place.name.as_deref();
        let moves = !node.local.abs_diff_eq(DAffine3::IDENTITY, STILL);
        if !needs_group(node, moves, own.len()) {
            return own;
        }
        let mut members = Vec::new();
        if moves {
            let fields = transform_fields(&node.local, "scaleFactor");
            members.push(self.nodes.node("Transform", fields));
        }
        members.extend(own);
        let group = self.nodes.group("Separator", Vec::new(), members);
        if let Some(name) = name {
            self.nodes.name(group, name);
        }
        vec![group]
    }

    /// Returns the shape of a part, which several nodes may share.
    fn shape(&mut self, part: Part, is_mirrored: bool) -> NodeId {
        if let Some(&known) = self.shapes.get(&(part, is_mirrored)) {
            return self.nodes.share(known, "shape");
        }
        let look = self.looks.look(part, is_mirrored, self.nodes);
        let geometry = match self.geometry.get(&part.mesh) {
            Some(&known) => self.nodes.share(known, "geometry"),
            None => {
                let made = geometry(&self.model.meshes[part.mesh], self.nodes);
                self.geometry.insert(part.mesh, made);
                made
            }
        };
        let members = vec![look, geometry];
        let shape = self.nodes.group("Separator", Vec::new(), members);
        self.shapes.insert((part, is_mirrored), shape);
        shape
    }
}

/// Returns a group with the lists of a mesh and its shape. The lists have one entry for each
/// vertex, so the indices of the coordinates are those of all lists.
fn geometry(mesh: &Mesh, nodes: &mut NodeBuilder) -> NodeId {
    let points = Value::Vec3s(mesh.positions.clone());
    let mut members = vec![nodes.node("Coordinate3", vec![("point", points)])];
    if !mesh.normals.is_empty() {
        let vectors = Value::Vec3s(mesh.normals.clone());
        members.push(nodes.node("Normal", vec![("vector", vectors)]));
        members.push(normals_by_vertex(mesh, nodes));
    }
    if !mesh.coordinates.is_empty() {
        let points = Value::Vec2s(mesh.coordinates.clone());
        members.push(nodes.node("TextureCoordinate2", vec![("point", points)]));
    }
    members.push(match &mesh.primitives {
        Primitives::Points => nodes.node("PointSet", Vec::new()),
        Primitives::Lines(lines) => {
            nodes.node("IndexedLineSet", vec![("coordIndex", indices(lines))])
        }
        Primitives::Triangles(triangles) => {
            nodes.node("IndexedFaceSet", vec![("coordIndex", indices(triangles))])
        }
    });
    nodes.group("Group", Vec::new(), members)
}

/// Returns the binding of one normal to each vertex of a mesh.
fn normals_by_vertex(mesh: &Mesh, nodes: &mut NodeBuilder) -> NodeId {
    let value = match mesh.primitives {
        Primitives::Points => normal_binding::VALUE_PER_VERTEX,
        _ => normal_binding::VALUE_PER_VERTEX_INDEXED,
    };
    nodes.stated("NormalBinding", ("value", Value::Int(value)))
}
