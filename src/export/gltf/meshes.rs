//! Writes meshes: each list once, however many meshes and materials use it.

use std::collections::HashMap;

use glam::{Affine2, Vec2};
use ivcam_render::scene::model::{Model, Part, Primitives};

use super::buffer::BinaryBuffer;
use super::materials::{MaterialUse, Materials};
use super::schema::{Attributes, Index, Mesh, Primitive};
use crate::export::appearance::texture_point;
use crate::export::color::base_color;

/// The meshes of a file.
#[derive(Debug, Default)]
pub(super) struct Meshes {
    pub meshes: Vec<Mesh>,
    known: HashMap<Vec<Part>, Index>,
    /// The lists of each mesh of the model that are written, and its indices.
    lists: HashMap<usize, (Attributes, Option<Index>)>,
    /// Texture coordinates by the mesh and the bits of the matrix that is applied to them.
    texcoords: HashMap<(usize, [u32; 6]), Index>,
    /// Colors by mesh and the bits of the material's share of its base color.
    colors: HashMap<(usize, u32), Index>,
}

impl Meshes {
    /// Returns the entry of a node's parts, which is added at its first use with the node's name.
    pub(super) fn entry(
        &mut self,
        model: &Model,
        (name, parts): (&str, &[Part]),
        materials: &mut Materials,
        buffer: &mut BinaryBuffer,
    ) -> Index {
        if let Some(index) = self.known.get(parts) {
            return *index;
        }
        let primitives = parts
            .iter()
            .map(|part| self.primitive(model, *part, materials, buffer))
            .collect();
        self.meshes.push(Mesh {
            name: name.to_owned(),
            primitives,
        });
        let index = self.meshes.len() - 1;
        self.known.insert(parts.to_vec(), index);
        index
    }

    /// Makes a primitive.
    fn primitive(
        &mut self,
        model: &Model,
        part: Part,
        materials: &mut Materials,
        buffer: &mut BinaryBuffer,
    ) -> Primitive {
        let mesh = &model.meshes[part.mesh];
        let used = MaterialUse {
            material: part.material,
            is_colorful: !mesh.colors.is_empty(),
            is_transparent: mesh.colors.iter().any(|c| c[3] < 1.0),
        };
        let material = materials.entry(model, used, buffer);
        let (mut attributes, indices) = self.lists(model, part.mesh, buffer);
        let has_texture = model.materials[part.material].texture.is_some();
        if has_texture && !mesh.coordinates.is_empty() {
            let index = self.texcoords(model, part.mesh, material.matrix, buffer);
            attributes.texcoord = Some(index);
        }
        if material.keeps_colors {
            let share = model.materials[part.material].diffuse_share();
            let colors = mesh.colors.iter();
            let light = |&[r, g, b, a]: &[f32; 4]| {
                let [r, g, b] = base_color([r, g, b], share);
                [r, g, b, a]
            };
            let index = self.colors.entry((part.mesh, share.to_bits()));
            attributes.color = Some(*index.or_insert_with(|| buffer.colors(colors.map(light))));
        }
        Primitive {
            attributes,
            indices,
            material: material.index,
            mode: match mesh.primitives {
                Primitives::Points => 0,
                Primitives::Lines(_) => 1,
                Primitives::Triangles(_) => 4,
            },
        }
    }

    /// Returns the positions, normals and indices of a mesh.
    fn lists(
        &mut self,
        model: &Model,
        number: usize,
        buffer: &mut BinaryBuffer,
    ) -> (Attributes, Option<Index>) {
        if let Some(known) = self.lists.get(&number) {
            return known.clone();
        }
        let mesh = &model.meshes[number];
        let positions: Vec<[f32; 3]> = mesh.positions.iter().map(|p| p.to_array()).collect();
        let normals: Vec<[f32; 3]> = mesh.normals.iter().map(|n| n.to_array()).collect();
        let attributes = Attributes {
            position: buffer.positions(&positions),
            normal: (!normals.is_empty()).then(|| buffer.vectors(&normals)),
            texcoord: None,
            color: None,
        };
        let vertices = positions.len();
        let indices = match &mesh.primitives {
            Primitives::Triangles(list) => Some(buffer.indices(list.as_flattened(), vertices)),
            Primitives::Lines(list) => Some(buffer.indices(list.as_flattened(), vertices)),
            Primitives::Points => None,
        };
        self.lists.insert(number, (attributes.clone(), indices));
        (attributes, indices)
    }

    /// Returns the texture coordinates of a mesh after a matrix.
    fn texcoords(
        &mut self,
        model: &Model,
        number: usize,
        matrix: Affine2,
        buffer: &mut BinaryBuffer,
    ) -> Index {
        let key = (number, matrix.to_cols_array().map(f32::to_bits));
        *self.texcoords.entry(key).or_insert_with(|| {
            let list = model.meshes[number].coordinates.iter();
            // glTF's v runs downward.
            let flipped = list.map(|c| {
                let Vec2 { x, y } = texture_point(matrix, *c);
                [x, 1.0 - y]
            });
            buffer.vectors(&flipped.collect::<Vec<_>>())
        })
    }
}
