//! A scene's triangles as arrays.

use ivcam::glam::{DMat3, DVec3, Vec2};
use ivcam::scene::model::{Image, Material, Model, Primitives, Texture};
use numpy::{PyArray1, PyArrayMethods};
use pyo3::prelude::*;
use pyo3::types::{PyDict, PyList};

use crate::errors::records;
use crate::values::rows;

/// The triangles of all meshes in world space, with a list for each kind of value.
#[derive(Default)]
pub(crate) struct Arrays {
    positions: Vec<[f32; 3]>,
    normals: Vec<[f32; 3]>,
    uv: Vec<[f32; 2]>,
    colors: Vec<[f32; 4]>,
    faces: Vec<[u32; 3]>,
    /// For each triangle, the index of its material and of its node in the model.
    material: Vec<u32>,
    node: Vec<u32>,
    lines: usize,
    points: usize,
}

impl Arrays {
    pub(crate) fn of(model: &Model) -> Self {
        let mut arrays = Self::default();
        for (number, node) in model.nodes.iter().enumerate() {
            for part in &node.parts {
                arrays.add(model, number, (part.mesh, part.material));
            }
        }
        arrays
    }

    /// Adds a mesh of a node with a material.
    fn add(&mut self, model: &Model, node: usize, (mesh, material): (usize, usize)) {
        let (mesh, look) = (&model.meshes[mesh], &model.materials[material]);
        let list = match &mesh.primitives {
            Primitives::Triangles(list) => list,
            Primitives::Lines(list) => return self.lines += list.len(),
            Primitives::Points => return self.points += mesh.positions.len(),
        };
        let world = &model.nodes[node].world;
        let first = self.positions.len() as u32;
        let count = mesh.positions.len();
        let moved = |p: &ivcam::glam::Vec3| world.transform_point3(p.as_dvec3()).as_vec3();
        self.positions
            .extend(mesh.positions.iter().map(|p| moved(p).to_array()));
        let turn = normal_matrix(world.matrix3);
        let turned = |i: usize| match mesh.normals.get(i) {
            Some(n) => (turn * n.as_dvec3())
                .normalize_or_zero()
                .as_vec3()
                .to_array(),
            None => [0.0; 3],
        };
        self.normals.extend((0..count).map(turned));
        let place = |i: usize| texture_point(look, mesh.coordinates.get(i)).to_array();
        self.uv.extend((0..count).map(place));
        let plain = look.diffuse.extend(1.0 - look.transparency).to_array();
        let color = |i: usize| mesh.colors.get(i).copied().unwrap_or(plain);
        self.colors.extend((0..count).map(color));
        let is_mirrored = world.matrix3.determinant() < 0.0;
        self.faces.extend(list.iter().map(|&[a, b, c]| {
            let [b, c] = if is_mirrored { [c, b] } else { [b, c] };
            [a + first, b + first, c + first]
        }));
        self.material.resize(self.faces.len(), material as u32);
        self.node.resize(self.faces.len(), node as u32);
    }

    /// Returns the arrays, with the materials, the pictures and the paths of nodes.
    pub(crate) fn into_dict<'py>(
        self,
        py: Python<'py>,
        model: &Model,
    ) -> PyResult<Bound<'py, PyDict>> {
        let dict = PyDict::new(py);
        dict.set_item("positions", rows(py, self.positions)?)?;
        dict.set_item("normals", rows(py, self.normals)?)?;
        dict.set_item("uv", rows(py, self.uv)?)?;
        dict.set_item("colors", rows(py, self.colors)?)?;
        dict.set_item("faces", rows(py, self.faces)?)?;
        dict.set_item("material", PyArray1::from_vec(py, self.material))?;
        dict.set_item("node", PyArray1::from_vec(py, self.node))?;
        dict.set_item("offset", model.offset.to_array())?;
        dict.set_item("lines", self.lines)?;
        dict.set_item("points", self.points)?;
        dict.set_item("paths", paths(model))?;
        let materials = PyList::empty(py);
        for material in &model.materials {
            materials.append(material_record(py, material, model)?)?;
        }
        dict.set_item("materials", materials)?;
        let images = PyList::empty(py);
        for image in &model.images {
            let shape = [image.height as usize, image.width as usize, 4];
            let bytes = image.pixels.as_flattened().to_vec();
            images.append(PyArray1::from_vec(py, bytes).reshape(shape)?)?;
        }
        dict.set_item("images", images)?;
        dict.set_item("problems", records(py, &model.diagnostics)?)?;
        Ok(dict)
    }
}

/// The matrix that turns normals: the cofactors, which exist for flat scales too.
fn normal_matrix(m: DMat3) -> DMat3 {
    let [x, y, z]: [DVec3; 3] = [m.x_axis, m.y_axis, m.z_axis];
    let sign = if m.determinant() < 0.0 { -1.0 } else { 1.0 };
    DMat3::from_cols(sign * y.cross(z), sign * z.cross(x), sign * x.cross(y))
}

/// Texture coordinates after the matrix of the texture.
fn texture_point(material: &Material, at: Option<&Vec2>) -> Vec2 {
    let at = at.copied().unwrap_or_default();
    let matrix = material.texture.as_ref().map(|texture| texture.matrix);
    let finite = |v: f32| if v.is_finite() { v } else { 0.0 };
    matrix.map_or(at, |m| m.transform_point2(at)).map(finite)
}

/// The path of each node: the names from the root, with slashes between them.
fn paths(model: &Model) -> Vec<String> {
    let mut paths: Vec<String> = Vec::with_capacity(model.nodes.len());
    for node in &model.nodes {
        let above = node.parent.map_or("", |parent| &*paths[parent]);
        paths.push(match above {
            "" => node.name().to_owned(),
            above => format!("{above}/{}", node.name()),
        });
    }
    paths
}

fn material_record<'py>(
    py: Python<'py>,
    m: &Material,
    model: &Model,
) -> PyResult<Bound<'py, PyDict>> {
    let replaces = |what: fn(&Texture, &Image) -> bool| {
        let texture = m.texture.as_ref();
        texture.is_some_and(|texture| what(texture, &model.images[texture.image]))
    };
    let record = PyDict::new(py);
    record.set_item("ambient", m.ambient.to_array())?;
    record.set_item("diffuse", m.diffuse.to_array())?;
    record.set_item("specular", m.specular.to_array())?;
    record.set_item("emissive", m.emissive.to_array())?;
    record.set_item("shininess", m.shininess)?;
    record.set_item("transparency", m.transparency)?;
    record.set_item("unlit", m.unlit)?;
    record.set_item("double_sided", m.double_sided)?;
    record.set_item("image", m.texture.as_ref().map(|t| t.image))?;
    record.set_item("image_replaces_color", replaces(Texture::replaces_color))?;
    record.set_item(
        "image_replaces_opacity",
        replaces(Texture::replaces_opacity),
    )?;
    record.set_item("repeat", m.texture.as_ref().map(|t| t.repeat))?;
    Ok(record)
}
