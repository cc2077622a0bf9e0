//! Meshes of glTF as shapes of X3D.

use std::collections::{BTreeMap, HashMap};

use glam::{Mat4, Vec2, Vec3, Vec4};
use ivcam_base::diag::{Diagnostic, Result, Span, excerpt};

use super::materials::TexturePlace;
use super::reader::GltfReader;
use super::schema::Primitive;
use crate::grammar::value::{NodeId, Value};
use crate::grammar::{
    ClassId, class, color_rgba, coordinate, indexed_triangle_set, texture_coordinate,
    triangle_fan_set, triangle_set, vrml97_indexed_face_set as faces97,
    vrml97_indexed_line_set as lines97, vrml97_normal, x3d_triangle_strip_set,
};

/// The nodes of the attributes that were added.
#[derive(Default)]
pub(super) struct MeshNodes {
    /// The shapes of each mesh without a skin, with the bits of its weights and whether it is
    /// mirrored.
    shapes: HashMap<(usize, Vec<u32>, bool), Vec<NodeId>>,
    points: HashMap<usize, NodeId>,
    normals: HashMap<usize, NodeId>,
    colors: HashMap<(usize, [u32; 4]), NodeId>,
    coordinates: HashMap<(usize, [u32; 6]), NodeId>,
}

/// A matrix for each joint of a skin.
pub(super) type Joints = Vec<Mat4>;

/// What places the vertices of a mesh.
pub(super) struct Posing<'p> {
    /// The weights of the targets of the mesh.
    pub(super) weights: &'p [f32],
    pub(super) joints: Option<&'p Joints>,
    /// Whether the matrix of the node mirrors the mesh.
    pub(super) is_mirrored: bool,
}

/// Why a part of a mesh is not added.
enum MeshFault {
    /// It is left out because of what the message says.
    LeftOut(String),
    /// Reading ends: a limit is exceeded.
    Fatal(Box<Diagnostic>),
}

impl MeshFault {
    /// Returns the message, or the error that ends reading.
    fn message(self) -> Result<String> {
        match self {
            Self::LeftOut(message) => Ok(message),
            Self::Fatal(error) => Err(error),
        }
    }
}

impl From<String> for MeshFault {
    fn from(message: String) -> Self {
        Self::LeftOut(message)
    }
}

impl From<Box<Diagnostic>> for MeshFault {
    fn from(error: Box<Diagnostic>) -> Self {
        Self::Fatal(error)
    }
}

type MeshPart<T> = std::result::Result<T, MeshFault>;

impl GltfReader<'_, '_, '_> {
    /// Returns the shapes of a mesh.
    ///
    /// # Errors
    /// Returns an error if a limit is exceeded.
    pub(super) fn mesh(&mut self, index: usize, posing: &Posing<'_>) -> Result<Vec<NodeId>> {
        let root = self.root;
        let Some(mesh) = root.meshes.get(index) else {
            self.builder
                .damage(Span::at(0), format!("the mesh {index} does not exist"));
            return Ok(Vec::new());
        };
        let weights = match posing.weights.is_empty() {
            true => &mesh.weights,
            false => posing.weights,
        };
        let key = (
            index,
            weights.iter().map(|weight| weight.to_bits()).collect(),
            posing.is_mirrored,
        );
        if posing.joints.is_none()
            && let Some(shapes) = self.meshes.shapes.get(&key)
        {
            return Ok(shapes.clone());
        }
        let posing = Posing { weights, ..*posing };
        let mut shapes = Vec::with_capacity(mesh.primitives.len());
        for (number, primitive) in mesh.primitives.iter().enumerate() {
            match self.primitive(primitive, &posing) {
                Ok(shape) => shapes.push(shape),
                Err(fault) => {
                    let message = fault.message()?;
                    let name = match mesh.name.is_empty() {
                        true => index.to_string(),
                        false => format!("`{}`", excerpt(&mesh.name)),
                    };
                    let message = format!("primitive {number} of mesh {name}: {message}");
                    let help = "it is left out";
                    self.builder.damage(Span::at(0), message).help(help);
                }
            }
        }
        if posing.joints.is_none() {
            self.meshes.shapes.insert(key, shapes.clone());
        }
        Ok(shapes)
    }

    /// Adds the shape of a primitive.
    fn primitive(&mut self, primitive: &Primitive, posing: &Posing<'_>) -> MeshPart<NodeId> {
        let is_here = |index: &usize| {
            let accessor = self.root.accessors.get(*index);
            accessor.is_some_and(|accessor| accessor.buffer_view.is_some())
        };
        let is_draco = primitive
            .extensions
            .contains_key("KHR_draco_mesh_compression");
        if is_draco && !primitive.attributes.values().all(is_here) {
            let message = "meshes that are compressed by Draco are not read";
            return Err(message.to_owned().into());
        }
        let integers = |index| self.buffers.integers(self.root, index, 1);
        let index = primitive.indices.map(integers).transpose()?;
        let index: Option<Vec<i32>> = index.map(|list| list.into_iter().map(index_of).collect());
        let mode = primitive.mode.unwrap_or(4);
        let is_face = (4..=6).contains(&mode);
        let position = primitive.attributes.get("POSITION").copied();
        let position = position.ok_or_else(|| "it has no positions".to_owned())?;
        let (coord, count) = self.points(position, primitive, posing)?;
        let is_flat = is_face && !primitive.attributes.contains_key("NORMAL");
        let flat = match posing.is_mirrored && is_flat {
            true => Some(self.flat_normals(coord, mode, index.as_deref())?),
            false => None,
        };
        let geometry = self.geometry(mode, index, count)?;
        let geometry = geometry.ok_or_else(|| format!("the mode {mode} is none of glTF's"))?;
        self.builder
            .set(geometry, faces97::COORD, Value::Node(Some(coord)));
        if is_face {
            self.face_attributes(geometry, primitive, posing)?;
        } else if primitive.attributes.contains_key("NORMAL") && self.is_lit(primitive.material) {
            let message =
                "the lines or points of a mesh have normals, and are drawn without lighting";
            self.builder.warn(Span::at(0), message);
        }
        if flat.is_some() {
            self.builder
                .set(geometry, faces97::NORMAL, Value::Node(flat));
        }
        if let Some(&color) = primitive.attributes.get("COLOR_0") {
            let factor = self.color_factor(primitive.material);
            let color = self.color(color, factor);
            if let Some(node) = self.unless_left_out(color, "colors")? {
                self.builder
                    .set(geometry, faces97::COLOR, Value::Node(Some(node)));
            }
        }
        let appearance = self.appearance(primitive.material, is_face)?;
        Ok(self.builder.shape(appearance, geometry, Span::default())?)
    }

    /// Adds a normal for each triangle of a mirrored mesh that states none. Those that a program
    /// computes for `ccw FALSE` point to the back.
    fn flat_normals(&mut self, coord: NodeId, mode: u32, index: Option<&[i32]>) -> Result<NodeId> {
        let points = self.builder.asm.document.node(coord).get(coordinate::POINT);
        let point = |number: i32| points.get(number as usize).copied().unwrap_or_default();
        let corners: Vec<Vec3> = match index {
            Some(index) => index.iter().map(|&number| point(number)).collect(),
            None => points.to_vec(),
        };
        let normal = |a: Vec3, b: Vec3, c: Vec3| (b - a).cross(c - a).normalize_or_zero();
        let normals: Vec<Vec3> = match (mode, &corners[..]) {
            (5, strip) => {
                let turned = [1.0, -1.0].into_iter().cycle();
                let triangles = strip.windows(3).zip(turned);
                triangles
                    .map(|(t, sign)| sign * normal(t[0], t[1], t[2]))
                    .collect()
            }
            (6, [first, rim @ ..]) => rim
                .windows(2)
                .map(|edge| normal(*first, edge[0], edge[1]))
                .collect(),
            (_, list) => list
                .chunks_exact(3)
                .map(|t| normal(t[0], t[1], t[2]))
                .collect(),
        };
        let (class, field) = (class::VRML97_NORMAL, vrml97_normal::VECTOR);
        let normals = Value::Vec3s(normals);
        self.builder.with(class, field, normals, Span::default())
    }

    /// Returns an attribute, or reports why a mesh is drawn without it.
    fn unless_left_out(&mut self, part: MeshPart<NodeId>, name: &str) -> Result<Option<NodeId>> {
        part.map(Some).or_else(|fault| {
            let message = format!("{name} of a mesh: {}", fault.message()?);
            self.builder.damage(Span::at(0), message);
            Ok(None)
        })
    }

    /// Adds the geometry node of a mode of primitives, without its attributes.
    fn geometry(
        &mut self,
        mode: u32,
        index: Option<Vec<i32>>,
        count: usize,
    ) -> Result<Option<NodeId>> {
        let all = || (0..count as i32).collect::<Vec<i32>>();
        let whole = |count| Value::Ints(vec![count]);
        let add = |this: &mut Self, class: ClassId| this.builder.node(class, Span::default());
        let node = match (mode, index) {
            (0, None) => add(self, class::VRML97_POINT_SET)?,
            (0, Some(index)) => {
                // A `PointSet` has no index: lines of one point would not be drawn.
                if !index.iter().copied().eq(0..count as i32) {
                    let message = "the points of a mesh are drawn without their index";
                    self.builder.warn(Span::at(0), message);
                }
                add(self, class::VRML97_POINT_SET)?
            }
            (1..=3, index) => {
                let node = add(self, class::VRML97_INDEXED_LINE_SET)?;
                let lines = polylines(mode, index.unwrap_or_else(all));
                self.builder
                    .set(node, lines97::COORD_INDEX, Value::Ints(lines));
                node
            }
            (4, None) => add(self, class::TRIANGLE_SET)?,
            (5, None) => {
                let node = add(self, class::X3D_TRIANGLE_STRIP_SET)?;
                self.builder.set(
                    node,
                    x3d_triangle_strip_set::STRIP_COUNT,
                    whole(count as i32),
                );
                node
            }
            (6, None) => {
                let node = add(self, class::TRIANGLE_FAN_SET)?;
                self.builder
                    .set(node, triangle_fan_set::FAN_COUNT, whole(count as i32));
                node
            }
            (4..=6, Some(index)) => {
                let class = match mode {
                    4 => class::INDEXED_TRIANGLE_SET,
                    5 => class::X3D_INDEXED_TRIANGLE_STRIP_SET,
                    _ => class::INDEXED_TRIANGLE_FAN_SET,
                };
                let node = add(self, class)?;
                self.builder
                    .set(node, indexed_triangle_set::INDEX, Value::Ints(index));
                node
            }
            _ => return Ok(None),
        };
        Ok(Some(node))
    }

    /// Adds normals and texture coordinates, and sets which sides are visible.
    fn face_attributes(
        &mut self,
        geometry: NodeId,
        primitive: &Primitive,
        posing: &Posing<'_>,
    ) -> Result<()> {
        if self.is_double_sided(primitive.material) {
            self.builder
                .set(geometry, faces97::SOLID, Value::Bool(false));
        }
        // A mirroring matrix exchanges the sides of a shape, and not those of a mesh (glTF 2.0,
        // 3.7.4).
        if posing.is_mirrored {
            self.builder.set(geometry, faces97::CCW, Value::Bool(false));
        }
        let normals = match primitive.attributes.get("NORMAL") {
            Some(&normal) => {
                let normals = self.normals(normal, primitive, posing);
                self.unless_left_out(normals, "normals")?
            }
            None => None,
        };
        match normals {
            Some(node) => self
                .builder
                .set(geometry, faces97::NORMAL, Value::Node(Some(node))),
            None => self.builder.set(
                geometry,
                triangle_set::NORMAL_PER_VERTEX,
                Value::Bool(false),
            ),
        }
        let place = self.texture_place(primitive.material);
        let set = place.map_or(0, |place| place.set);
        let other =
            |name: &&String| name.starts_with("TEXCOORD_") && **name != format!("TEXCOORD_{set}");
        if place.is_some() && primitive.attributes.keys().any(|name| other(&name)) {
            let message = "a further set of texture coordinates is not used";
            self.builder.asm.document.sink.note(Span::at(0), message);
        }
        let Some(place) = place else {
            return Ok(());
        };
        let Some(&accessor) = primitive.attributes.get(&format!("TEXCOORD_{set}")) else {
            self.builder.warn(
                Span::at(0),
                "a mesh with a texture has no texture coordinates",
            );
            return Ok(());
        };
        let coordinates = self.coordinates(accessor, place);
        if let Some(node) = self.unless_left_out(coordinates, "texture coordinates")? {
            self.builder
                .set(geometry, faces97::TEX_COORD, Value::Node(Some(node)));
        }
        Ok(())
    }

    /// Returns the vectors of an attribute, moved by the targets of the mesh.
    fn vectors(
        &self,
        accessor: usize,
        name: &str,
        primitive: &Primitive,
        weights: &[f32],
    ) -> std::result::Result<Vec<Vec3>, String> {
        let vectors = |accessor| -> std::result::Result<Vec<Vec3>, String> {
            let (list, _) = self.buffers.floats(self.root, accessor, &[3])?;
            Ok(list.chunks_exact(3).map(Vec3::from_slice).collect())
        };
        let mut list = vectors(accessor)?;
        for (target, weight) in primitive.targets.iter().zip(weights) {
            let Some(&accessor) = target.get(name).filter(|_| *weight != 0.0) else {
                continue;
            };
            let moved = vectors(accessor)?;
            list.iter_mut()
                .zip(moved)
                .for_each(|(at, by)| *at += *weight * by);
        }
        Ok(list)
    }

    /// Returns the vectors of an attribute of a posed mesh, each moved by the matrix of its vertex.
    fn posed(
        &self,
        accessor: usize,
        name: &str,
        (primitive, posing): (&Primitive, &Posing<'_>),
        moved: fn(&Mat4, Vec3) -> Vec3,
    ) -> std::result::Result<Vec<Vec3>, String> {
        let mut list = self.vectors(accessor, name, primitive, posing.weights)?;
        if let Some(joints) = posing.joints {
            let matrices = self.blended(&primitive.attributes, joints, list.len())?;
            for (vector, matrix) in list.iter_mut().zip(matrices) {
                *vector = moved(&matrix, *vector);
            }
        }
        Ok(list)
    }

    /// Adds the points of a mesh. Returns the node and their number.
    fn points(
        &mut self,
        accessor: usize,
        primitive: &Primitive,
        posing: &Posing<'_>,
    ) -> MeshPart<(NodeId, usize)> {
        let is_posed = is_posed(primitive, posing);
        if let Some(&node) = self.meshes.points.get(&accessor).filter(|_| !is_posed) {
            let accessor = self.root.accessors.get(accessor);
            return Ok((node, accessor.map_or(0, |accessor| accessor.count)));
        }
        let mesh = (primitive, posing);
        let list = self.posed(accessor, "POSITION", mesh, |m, point| {
            m.transform_point3(point)
        })?;
        let count = list.len();
        let (class, field) = (class::COORDINATE, coordinate::POINT);
        let points = Value::Vec3s(list);
        let node = self.builder.with(class, field, points, Span::default())?;
        if !is_posed {
            self.meshes.points.insert(accessor, node);
        }
        Ok((node, count))
    }

    fn normals(
        &mut self,
        accessor: usize,
        primitive: &Primitive,
        posing: &Posing<'_>,
    ) -> MeshPart<NodeId> {
        let is_posed = is_posed(primitive, posing);
        if let Some(&node) = self.meshes.normals.get(&accessor).filter(|_| !is_posed) {
            return Ok(node);
        }
        let turned = |m: &Mat4, normal| m.transform_vector3(normal).normalize_or_zero();
        let list = self.posed(accessor, "NORMAL", (primitive, posing), turned)?;
        let (class, field) = (class::VRML97_NORMAL, vrml97_normal::VECTOR);
        let normals = Value::Vec3s(list);
        let node = self.builder.with(class, field, normals, Span::default())?;
        if !is_posed {
            self.meshes.normals.insert(accessor, node);
        }
        Ok(node)
    }

    /// Returns the matrix of each vertex of a mesh with a skin.
    fn blended(
        &self,
        attributes: &BTreeMap<String, usize>,
        joints: &Joints,
        count: usize,
    ) -> std::result::Result<Vec<Mat4>, String> {
        let mut matrices = vec![Mat4::ZERO; count];
        let mut sums = vec![0.0f32; count];
        for set in 0..4 {
            let of = |name: &str| attributes.get(&format!("{name}_{set}"));
            let (Some(&of_joints), Some(&of_weights)) = (of("JOINTS"), of("WEIGHTS")) else {
                break;
            };
            let numbers = self.buffers.integers(self.root, of_joints, 4)?;
            let (weights, _) = self.buffers.floats(self.root, of_weights, &[4])?;
            for (place, (number, weight)) in numbers.iter().zip(weights).enumerate() {
                let (vertex, joint) = (place / 4, joints.get(*number as usize));
                if let (Some(matrix), Some(joint)) = (matrices.get_mut(vertex), joint) {
                    *matrix += *joint * weight;
                    sums[vertex] += weight;
                }
            }
        }
        for (matrix, sum) in matrices.iter_mut().zip(sums) {
            *matrix = if sum > 0.0 {
                *matrix * (1.0 / sum)
            } else {
                Mat4::IDENTITY
            };
        }
        Ok(matrices)
    }

    /// Adds the colors of vertices, multiplied by the factor of the material's color.
    fn color(&mut self, accessor: usize, factor: [f32; 4]) -> MeshPart<NodeId> {
        let key = (accessor, factor.map(f32::to_bits));
        if let Some(&node) = self.meshes.colors.get(&key) {
            return Ok(node);
        }
        let (list, width) = self.buffers.floats(self.root, accessor, &[3, 4])?;
        let factor = Vec4::from_array(factor);
        let color = |numbers: &[f32]| {
            let alpha = numbers.get(3).copied().unwrap_or(1.0);
            let own = Vec3::from_slice(&numbers[..3]).extend(alpha);
            (own * factor).clamp(Vec4::ZERO, Vec4::ONE)
        };
        let colors = Value::Vec4s(list.chunks_exact(width).map(color).collect());
        let class = class::COLOR_RGBA;
        let node = self
            .builder
            .with(class, color_rgba::COLOR, colors, Span::default())?;
        self.meshes.colors.insert(key, node);
        Ok(node)
    }

    /// Adds texture coordinates.
    fn coordinates(&mut self, accessor: usize, place: TexturePlace) -> MeshPart<NodeId> {
        let key = (accessor, place.transform.to_cols_array().map(f32::to_bits));
        if let Some(&node) = self.meshes.coordinates.get(&key) {
            return Ok(node);
        }
        let (list, _) = self.buffers.floats(self.root, accessor, &[2])?;
        let turned = list
            .chunks_exact(2)
            .map(|at| place.apply(Vec2::from_slice(at)));
        let points = Value::Vec2s(turned.collect());
        let class = class::TEXTURE_COORDINATE;
        let node = self
            .builder
            .with(class, texture_coordinate::POINT, points, Span::default())?;
        self.meshes.coordinates.insert(key, node);
        Ok(node)
    }
}

/// Returns whether joints or a target of a mesh move its vertices.
fn is_posed(primitive: &Primitive, posing: &Posing<'_>) -> bool {
    let mut targets = primitive.targets.iter().zip(posing.weights);
    posing.joints.is_some() || targets.any(|(_, weight)| *weight != 0.0)
}

/// Returns an index as X3D has it. A larger one does not exist in either.
fn index_of(index: u32) -> i32 {
    i32::try_from(index).unwrap_or(i32::MAX)
}

/// Returns the polylines of a mode of lines, with −1 after each.
fn polylines(mode: u32, index: Vec<i32>) -> Vec<i32> {
    match mode {
        1 => index
            .chunks_exact(2)
            .flat_map(|line| [line[0], line[1], -1])
            .collect(),
        2 => {
            let first = index.first().copied();
            index.into_iter().chain(first).chain([-1]).collect()
        }
        _ => index.into_iter().chain([-1]).collect(),
    }
}
