//! The tree of nodes of a glTF file, with its cameras and lights.

use std::collections::HashMap;

use glam::{Mat4, Quat, Vec3};
use indexmap::IndexSet;
use ivcam_base::diag::{Result, Span, excerpt};

use super::buffers::Buffers;
use super::container::container;
use super::materials::MaterialNodes;
use super::meshes::{MeshNodes, Posing};
use super::schema::{Camera, Light, Node, Root};
use crate::grammar::value::{NodeId, Rotation, Value};
use crate::grammar::{
    class, metadata_boolean, navigation_info, ortho_viewpoint, viewpoint,
    vrml97_directional_light as directional, vrml97_group, vrml97_point_light as point,
    vrml97_spot_light as spot, vrml97_transform,
};
use crate::iv::display::{LINEAR_LIGHT, display_color};
use crate::iv::read::assemble::Assembler;
use crate::iv::read::formats::builder::Builder;

/// The extensions that are read, or change nothing that is drawn.
const READ: [&str; 10] = [
    "KHR_lights_punctual",
    "KHR_texture_transform",
    "KHR_materials_unlit",
    "KHR_materials_emissive_strength",
    "KHR_materials_specular",
    "KHR_materials_ior",
    "KHR_mesh_quantization",
    // These have messages of their own, where they are used.
    "KHR_draco_mesh_compression",
    "EXT_meshopt_compression",
    "KHR_xmp_json_ld",
];

/// The radius of a light without a range.
const FAR: f32 = 1e9;

/// The state of reading a file.
pub(super) struct GltfReader<'a, 'd, 'b> {
    pub(super) builder: Builder<'a, 'd>,
    pub(super) root: &'b Root,
    pub(super) buffers: Buffers<'b>,
    pub(super) materials: MaterialNodes,
    pub(super) meshes: MeshNodes,
    /// The `Transform` of each node of the scene.
    pub(super) transforms: Vec<Option<NodeId>>,
    /// The transform of each node of the scene to the world, at rest.
    pub(super) world: Vec<Mat4>,
    /// The shapes of meshes with a skin, which are placed in the world.
    pub(super) skinned: Vec<NodeId>,
    /// The parent of each node of the scene.
    parents: HashMap<usize, Option<usize>>,
    has_lights: bool,
}

/// Reads the nodes of a file and returns the top-level ones.
///
/// # Errors
/// Returns an error if a limit is exceeded, or if the JSON is damaged.
pub(in crate::iv::read) fn read(asm: &mut Assembler<'_>, bytes: &[u8]) -> Result<Vec<NodeId>> {
    asm.spend_read(bytes.len(), 0)?;
    let container = container(&mut asm.document.sink, bytes)?;
    let root = &container.root;
    let buffers = Buffers::read(asm, root, container.chunk)?;
    let mut reader = GltfReader {
        builder: Builder { asm },
        root,
        buffers,
        materials: MaterialNodes::default(),
        meshes: MeshNodes::default(),
        transforms: vec![None; root.nodes.len()],
        world: vec![Mat4::IDENTITY; root.nodes.len()],
        skinned: Vec::new(),
        parents: HashMap::new(),
        has_lights: false,
    };
    reader.about();
    reader.scene()
}

impl GltfReader<'_, '_, '_> {
    /// Keeps what the file says about itself, and reports what is not read.
    fn about(&mut self) {
        let asm = &mut *self.builder.asm;
        if asm.source == 0 {
            let texts = self.root.asset.iter().filter_map(|(name, value)| {
                let text = value.as_str()?;
                (name != "version").then(|| (name.clone(), text.to_owned()))
            });
            asm.document.meta.extend(texts);
        }
        let required = &self.root.extensions_required;
        for name in self.root.extensions_used.iter().chain(required) {
            if READ.contains(&&**name) {
                continue;
            }
            let message = format!("the extension `{}` is not read", excerpt(name));
            let help = match required.contains(name) {
                true => "the file says that it cannot be drawn correctly without it",
                false => "the scene is drawn as by a program without it",
            };
            asm.document.sink.warn(Span::at(0), message).help(help);
        }
    }

    /// Adds the nodes of the scene.
    fn scene(&mut self) -> Result<Vec<NodeId>> {
        let tops = self.tops();
        let order = self.order(&tops);
        for &(index, parent) in &order {
            let node = &self.root.nodes[index];
            let local = local_matrix(node);
            let around = parent.map_or(Mat4::IDENTITY, |parent: usize| self.world[parent]);
            self.world[index] = around * local;
            self.transforms[index] = Some(self.transform(node)?);
        }
        for &(index, _) in &order {
            self.content(index)?;
        }
        let mut roots: Vec<NodeId> = Vec::new();
        if self.has_lights {
            let field = navigation_info::HEADLIGHT;
            let class = class::VRML97_NAVIGATION_INFO;
            roots.push(
                self.builder
                    .with(class, field, Value::Bool(false), Span::default())?,
            );
        }
        roots.extend(tops.iter().filter_map(|&top| self.transforms[top]));
        if !self.skinned.is_empty() {
            let shapes = Value::Nodes(std::mem::take(&mut self.skinned));
            let class = class::VRML97_GROUP;
            let field = vrml97_group::CHILDREN;
            roots.push(self.builder.with(class, field, shapes, Span::default())?);
        }
        roots.extend(self.animations()?);
        Ok(roots)
    }

    /// Returns the top-level nodes of the scene that the file shows first.
    fn tops(&mut self) -> Vec<usize> {
        let count = self.root.nodes.len();
        if self.root.scenes.len() > 1 {
            let more = self.root.scenes.len() - 1;
            let message = format!("{more} further scenes of the file are not read");
            self.builder.warn(Span::at(0), message);
        }
        let listed = self.root.scenes.get(self.root.scene.unwrap_or(0));
        match listed {
            Some(scene) => scene
                .nodes
                .iter()
                .copied()
                .filter(|&node| node < count)
                .collect(),
            None => {
                let mut is_child = vec![false; count];
                for &child in self.root.nodes.iter().flat_map(|node| &node.children) {
                    if let Some(is_child) = is_child.get_mut(child) {
                        *is_child = true;
                    }
                }
                (0..count).filter(|&node| !is_child[node]).collect()
            }
        }
    }

    /// Returns the nodes below some others with their parents, which come first. A node that is
    /// reached again is left out there.
    fn order(&mut self, tops: &[usize]) -> Vec<(usize, Option<usize>)> {
        let mut is_seen = vec![false; self.root.nodes.len()];
        let mut stack: Vec<(usize, Option<usize>)> =
            tops.iter().rev().map(|&top| (top, None)).collect();
        let mut order = Vec::new();
        while let Some((index, parent)) = stack.pop() {
            let is_new = is_seen.get(index).is_some_and(|is_seen| !is_seen);
            if !is_new {
                let message = "a node is a child of several nodes, of itself, or does not exist";
                self.builder
                    .damage(Span::at(0), message)
                    .help("it is drawn once");
                continue;
            }
            is_seen[index] = true;
            order.push((index, parent));
            let children = self.root.nodes[index].children.iter().rev();
            stack.extend(children.map(|&child| (child, Some(index))));
        }
        self.parents = order.iter().copied().collect();
        order
    }

    /// Adds the `Transform` of a node.
    fn transform(&mut self, node: &Node) -> Result<NodeId> {
        let id = self
            .builder
            .node(class::VRML97_TRANSFORM, Span::default())?;
        self.builder.name(id, &node.name);
        let (mut translation, mut rotation, mut scale) = (
            node.translation.map(Vec3::from_array),
            node.rotation.map(Quat::from_array),
            node.scale.map(Vec3::from_array),
        );
        if let Some(matrix) = node.matrix {
            let matrix = Mat4::from_cols_array(&matrix);
            let (s, r, t) = matrix.to_scale_rotation_translation();
            let again = Mat4::from_scale_rotation_translation(s, r, t);
            let size = matrix
                .to_cols_array()
                .iter()
                .fold(0.0f32, |most, n| most.max(n.abs()));
            if !again.abs_diff_eq(matrix, 1e-4 * size.max(1e-6)) {
                let message = "a matrix that shears is drawn without its shear";
                self.builder.warn(Span::at(0), message);
            }
            let rotation_is_known = r.is_finite();
            (translation, scale) = (Some(t), Some(s));
            rotation = Some(r).filter(|_| rotation_is_known);
        }
        if let Some(translation) = translation.filter(|t| *t != Vec3::ZERO) {
            self.builder
                .set(id, vrml97_transform::TRANSLATION, Value::Vec3(translation));
        }
        if let Some(rotation) = rotation.filter(|r| *r != Quat::IDENTITY) {
            let rotation = Value::Rotation(rotation_of(rotation));
            self.builder.set(id, vrml97_transform::ROTATION, rotation);
        }
        if let Some(scale) = scale.filter(|s| *s != Vec3::ONE) {
            self.builder
                .set(id, vrml97_transform::SCALE, Value::Vec3(scale));
        }
        Ok(id)
    }

    /// Adds what a node holds, and its children, to its `Transform`.
    fn content(&mut self, index: usize) -> Result<()> {
        let root = self.root;
        let node = &root.nodes[index];
        let mut children = Vec::new();
        if let Some(mesh) = node.mesh {
            match node.skin {
                Some(skin) => {
                    let shapes = self.skinned_mesh(mesh, skin, &node.weights)?;
                    self.skinned.extend(shapes);
                }
                None => {
                    let posing = Posing {
                        weights: &node.weights,
                        joints: None,
                        is_mirrored: self.world[index].determinant() < 0.0,
                    };
                    children.extend(self.mesh(mesh, &posing)?);
                }
            }
        }
        if let Some(camera) = node.camera.and_then(|camera| root.cameras.get(camera)) {
            children.extend(self.camera(camera, &node.name)?);
        }
        if let Some(light) = &node.extensions.light {
            let lights = root.extensions.lights.as_ref();
            match lights.and_then(|lights| lights.lights.get(light.light)) {
                Some(light) => children.push(self.light(light)?),
                None => {
                    let message = format!("the light {} does not exist", light.light);
                    self.builder.damage(Span::at(0), message);
                }
            }
        }
        let is_own = |child: &&usize| self.parents.get(child).is_some_and(|p| *p == Some(index));
        let own: IndexSet<&usize> = node.children.iter().filter(is_own).collect();
        let own: Vec<NodeId> = own
            .into_iter()
            .filter_map(|&child| self.transforms[child])
            .collect();
        children.extend(own);
        if let Some(id) = self.transforms[index].filter(|_| !children.is_empty()) {
            self.builder
                .set(id, vrml97_transform::CHILDREN, Value::Nodes(children));
        }
        Ok(())
    }

    /// Adds the viewpoint of a camera.
    fn camera(&mut self, camera: &Camera, node: &str) -> Result<Option<NodeId>> {
        let name = if camera.name.is_empty() {
            node
        } else {
            &camera.name
        };
        let id = if let Some(own) = &camera.perspective {
            // `fieldOfView` is the angle of the shorter side of the picture.
            let half = libm::tanf(0.5 * own.yfov);
            let side = own
                .aspect_ratio
                .filter(|aspect| *aspect > 0.0)
                .unwrap_or(1.0)
                .min(1.0);
            let angle = 2.0 * libm::atanf(half * side);
            let id = self.builder.node(class::VIEWPOINT, Span::default())?;
            self.builder
                .set(id, viewpoint::FIELD_OF_VIEW, Value::Float(angle));
            id
        } else if let Some(own) = &camera.orthographic {
            let id = self.builder.node(class::ORTHO_VIEWPOINT, Span::default())?;
            let view = vec![-own.xmag, -own.ymag, own.xmag, own.ymag];
            self.builder
                .set(id, ortho_viewpoint::FIELD_OF_VIEW, Value::Floats(view));
            id
        } else {
            self.builder
                .damage(Span::at(0), "a camera has no projection");
            return Ok(None);
        };
        self.builder
            .set(id, viewpoint::POSITION, Value::Vec3(Vec3::ZERO));
        self.builder
            .set(id, viewpoint::DESCRIPTION, Value::String(name.into()));
        Ok(Some(id))
    }

    /// Adds a light. One of π lux, or of π candela at a distance of 1, lights a white surface to
    /// white, as one of the intensity 1 in X3D. The intensity stays linear, which
    /// [`LINEAR_LIGHT`] says.
    fn light(&mut self, light: &Light) -> Result<NodeId> {
        self.has_lights = true;
        let class = match &*light.kind {
            "directional" => class::VRML97_DIRECTIONAL_LIGHT,
            "spot" => class::VRML97_SPOT_LIGHT,
            _ => class::VRML97_POINT_LIGHT,
        };
        let id = self.builder.node(class, Span::default())?;
        self.builder.name(id, &light.name);
        let linear = self
            .builder
            .node(class::METADATA_BOOLEAN, Span::default())?;
        let name = Value::String(LINEAR_LIGHT.into());
        self.builder.set(linear, metadata_boolean::NAME, name);
        let value = Value::Bools(vec![true]);
        self.builder.set(linear, metadata_boolean::VALUE, value);
        self.builder
            .set(id, directional::METADATA, Value::Node(Some(linear)));
        let intensity = light.intensity.max(0.0) / std::f32::consts::PI;
        let color = display_color(Vec3::from_array(light.color).max(Vec3::ZERO));
        self.builder
            .set(id, directional::INTENSITY, Value::Float(intensity));
        self.builder.set(id, directional::COLOR, Value::Vec3(color));
        if class == class::VRML97_DIRECTIONAL_LIGHT {
            self.builder.set(id, directional::GLOBAL, Value::Bool(true));
            return Ok(id);
        }
        let falloff = Value::Vec3(Vec3::new(0.0, 0.0, 1.0));
        self.builder.set(id, point::ATTENUATION, falloff);
        let range = light.range.filter(|range| *range > 0.0).unwrap_or(FAR);
        self.builder.set(id, point::RADIUS, Value::Float(range));
        if class == class::VRML97_SPOT_LIGHT {
            let own = &light.spot;
            self.builder
                .set(id, spot::BEAM_WIDTH, Value::Float(own.inner_cone_angle));
            self.builder
                .set(id, spot::CUT_OFF_ANGLE, Value::Float(own.outer_cone_angle));
        }
        Ok(id)
    }
}

/// Returns the transform of a node to its parent.
pub(super) fn local_matrix(node: &Node) -> Mat4 {
    match node.matrix {
        Some(matrix) => Mat4::from_cols_array(&matrix),
        None => Mat4::from_scale_rotation_translation(
            Vec3::from_array(node.scale.unwrap_or([1.0; 3])),
            Quat::from_array(node.rotation.unwrap_or([0.0, 0.0, 0.0, 1.0])),
            Vec3::from_array(node.translation.unwrap_or([0.0; 3])),
        ),
    }
}

/// Returns a rotation as an axis and an angle.
pub(super) fn rotation_of(rotation: Quat) -> Rotation {
    let rotation = match rotation.length_squared() > 0.0 && rotation.is_finite() {
        true => rotation.normalize(),
        false => Quat::IDENTITY,
    };
    let rotation = if rotation.w < 0.0 {
        -rotation
    } else {
        rotation
    };
    let sine = rotation.xyz().length();
    if sine == 0.0 {
        return Rotation::IDENTITY;
    }
    Rotation::new(rotation.xyz() / sine, 2.0 * libm::atan2f(sine, rotation.w))
}
