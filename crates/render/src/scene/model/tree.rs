//! Builds the tree of a model by one walk over a snapshot.
//!
//! In Inventor a transformation acts on what follows it, so a group has no matrix of its own. Here
//! a group gets the matrix that is in force at its first child that is a group or a shape, and the
//! others are relative to it. A group that contains nothing to draw is left out, and a group of one
//! shape becomes that shape.

use std::collections::HashMap;
use std::hash::{DefaultHasher, Hash, Hasher};

use glam::{DAffine3, DMat4, DVec3};
use indexmap::IndexMap;
use ivcam_base::diag::Diagnostic;
use ivcam_inventor::grammar::{
    Class, class, environment, extrusion, switch_node, viewpoint, vrml97_group, vrml97_lod,
    vrml97_switch_node,
};
use ivcam_inventor::iv::{NodeId, NodeRef};
use ivcam_inventor::pose::CameraPose;
use ivcam_inventor::snapshot::Snapshot;
use ivcam_inventor::traversal::role::{self, Role};
use ivcam_inventor::traversal::state::{DrawStyle, FogKind, LightElement, State};
use ivcam_inventor::traversal::{self, Visitor, WalkOptions};

use super::canvas::MeshCanvas;
use super::feature::{Feature, NotApplied, Occurrence, Place};
use super::lights::{Pose, SceneCamera, SceneLight};
use super::mesh::{Mesh, Primitives};
use super::options::ModelOptions;
use super::scene_model::{Model, Part, SceneNode};
use crate::scene::canvas::Canvas;
use crate::scene::looks::{self, LightTree};
use crate::scene::options::ColorCoding;
use crate::scene::precision::are_in_reach;
use crate::scene::unapplied::{Unapplied, unapplied};
use crate::scene::{shapes, survey};

/// A group that the walk is in.
struct Open {
    /// Its index in the model.
    node: usize,
    /// Whether its matrix is known.
    is_placed: bool,
    /// The number of visits of each child so far.
    visits: HashMap<NodeId, u32>,
}

/// The visitor that builds a model.
struct ModelBuilder<'a> {
    /// Whether shapes are drawn.
    draws: bool,
    canvas: MeshCanvas,
    model: Model,
    open: Vec<Open>,
    /// The features by their node; those without one are defaults of the file's language.
    features: IndexMap<(Feature, Option<NodeId>), Occurrence>,
    /// What is not applied, by its node and field.
    not_applied: IndexMap<(NodeId, Option<&'static str>), NotApplied>,
    /// The meshes and materials so far, by a hash of their content.
    meshes: HashMap<u64, Vec<usize>>,
    materials: HashMap<Vec<u32>, usize>,
    /// The sets of lights that shapes have.
    lights: LightTree,
    /// The number of shapes that each set of lights shines on.
    lit: Vec<u64>,
    /// The total number of shapes that a light shines on.
    shapes: u64,
    light_nodes: Vec<NodeRef<'a>>,
    /// The least complexity of text and NURBS.
    complexity: f32,
    has_camera: bool,
}

/// The matrices of a tree without its shapes, to find what moves.
#[derive(Debug)]
pub(super) struct Skeleton {
    /// The matrix to world space of each node, by its key.
    pub worlds: HashMap<u64, DAffine3>,
    /// The poses of the cameras.
    pub cameras: Vec<Pose>,
    /// The poses of the lights.
    pub lights: Vec<Pose>,
}

/// Makes the tree of a snapshot.
pub(super) fn build(snapshot: &Snapshot<'_>, options: &ModelOptions) -> Model {
    let mut options = options.clone();
    if options.compile.camera.is_none() {
        options.compile.camera = survey::first_camera(snapshot, &options.compile);
    }
    let mut model = walk(snapshot, &options, true).finish();
    model.view = options.compile.camera;
    model
}

/// Makes the skeleton of the tree that [`build`] makes. The options have the camera.
pub(super) fn skeleton(snapshot: &Snapshot<'_>, options: &ModelOptions) -> Skeleton {
    let model = walk(snapshot, options, false).model;
    let cameras = model.cameras.iter().map(|camera| Pose {
        position: camera.pose.position,
        orientation: camera.pose.orientation,
    });
    let lights = model.lights.iter().map(|light| Pose {
        position: light.position,
        orientation: light.rotation(),
    });
    Skeleton {
        cameras: cameras.collect(),
        lights: lights.collect(),
        worlds: model.nodes.iter().map(|n| (n.key, n.world)).collect(),
    }
}

/// Walks a snapshot, and draws its shapes if `draws`.
fn walk<'a>(snapshot: &'a Snapshot<'a>, options: &ModelOptions, draws: bool) -> ModelBuilder<'a> {
    let walk_options = WalkOptions {
        finest_level: true,
        ..options.compile.walk()
    };
    let root = SceneNode {
        place: Place {
            class: "Scene".into(),
            ..Place::default()
        },
        parent: None,
        children: Vec::new(),
        local: DAffine3::IDENTITY,
        world: DAffine3::IDENTITY,
        parts: Vec::new(),
        states_sides: false,
        key: 0,
        center: DVec3::ZERO,
        is_fixed: false,
    };
    let mut builder = ModelBuilder {
        draws,
        canvas: MeshCanvas::new(options),
        model: Model {
            nodes: vec![root],
            ..Model::default()
        },
        open: vec![Open {
            node: 0,
            is_placed: true,
            visits: HashMap::new(),
        }],
        features: IndexMap::new(),
        not_applied: IndexMap::new(),
        meshes: HashMap::new(),
        materials: HashMap::new(),
        lights: LightTree::default(),
        lit: Vec::new(),
        shapes: 0,
        light_nodes: Vec::new(),
        complexity: options.complexity(),
        has_camera: options.compile.camera.is_some(),
    };
    traversal::walk(snapshot, &walk_options, &mut builder);
    builder
}

/// Whether all elements of a matrix are finite and not too large.
fn is_bounded(matrix: &DAffine3) -> bool {
    are_in_reach(&matrix.to_cols_array())
}

/// Returns the matrix if a group may have it: it can be inverted, and it and its inverse are
/// bounded.
fn invertible(matrix: DMat4) -> Option<DAffine3> {
    let matrix = DAffine3::from_mat4(matrix);
    let m = matrix.matrix3;
    let sizes = m.x_axis.length() * m.y_axis.length() * m.z_axis.length();
    let sound = is_bounded(&matrix) && m.determinant().abs() > 1e-9 * sizes;
    (sound && is_bounded(&matrix.inverse())).then_some(matrix)
}

impl ModelBuilder<'_> {
    /// Sets the matrix of the innermost group, unless it has one.
    fn place_group(&mut self, matrix: DMat4) {
        let Some(open) = self.open.last_mut().filter(|o| !o.is_placed) else {
            return;
        };
        open.is_placed = true;
        if let Some(world) = invertible(matrix) {
            self.model.nodes[open.node].world = world;
        }
    }

    /// Counts a visit of a child of the innermost group, and returns the key of the child's node.
    fn visit(&mut self, node: NodeRef<'_>) -> u64 {
        let Some(open) = self.open.last_mut() else {
            return 0;
        };
        let visits = open.visits.entry(node.id).or_default();
        *visits += 1;
        let mut hasher = DefaultHasher::new();
        (self.model.nodes[open.node].key, node.id, *visits).hash(&mut hasher);
        hasher.finish()
    }

    /// Adds a node with a key below the innermost group.
    fn add(&mut self, node: NodeRef<'_>, key: u64, world: Option<DAffine3>) -> usize {
        let index = self.model.nodes.len();
        let parent = self.open.last().map_or(0, |open| open.node);
        self.model.nodes[parent].children.push(index);
        let above = self.model.nodes[parent].world;
        self.model.nodes.push(SceneNode {
            place: Place::of(node),
            parent: Some(parent),
            children: Vec::new(),
            local: DAffine3::IDENTITY,
            world: world.unwrap_or(above),
            parts: Vec::new(),
            states_sides: false,
            key,
            center: DVec3::ZERO,
            is_fixed: false,
        });
        index
    }

    /// Removes the last node, which has no children.
    fn remove_last(&mut self) {
        if let Some(SceneNode {
            parent: Some(parent),
            ..
        }) = self.model.nodes.pop()
        {
            self.model.nodes[parent].children.pop();
        }
    }

    /// Ends a group: leaves it out if it is empty, and joins it with its shape if it has only one.
    fn close_group(&mut self, group: usize) {
        let node = &self.model.nodes[group];
        match node.children[..] {
            [] if node.parts.is_empty() => self.remove_last(),
            [child] => {
                let shape = &self.model.nodes[child];
                let is_shape = shape.children.is_empty() && shape.world == node.world;
                if is_shape && (node.place.name.is_none() || shape.place.name.is_none()) {
                    // The key is the shape's, which may be hidden at times when the group is not.
                    let (parts, key) = (shape.parts.clone(), shape.key);
                    let states_sides = shape.states_sides;
                    let mut place = shape.place.clone();
                    place.name = node.place.name.clone().or(place.name);
                    self.model.nodes.truncate(child);
                    let node = &mut self.model.nodes[group];
                    node.children.clear();
                    (node.parts, node.place, node.key) = (parts, place, key);
                    node.states_sides = states_sides;
                }
            }
            _ => {}
        }
    }

    /// Counts a feature of a node.
    fn note(&mut self, feature: Feature, node: NodeRef<'_>) {
        self.note_by(feature, Some(node));
    }

    /// Counts a feature of a node, or adds one that no node states.
    fn note_by(&mut self, feature: Feature, node: Option<NodeRef<'_>>) {
        let entry = self.features.entry((feature, node.map(|node| node.id)));
        let occurrence = entry.or_insert_with(|| Occurrence {
            feature,
            place: node.map(Place::of).unwrap_or_default(),
            count: u64::from(node.is_none()),
            stated: node.is_some(),
        });
        occurrence.count += u64::from(node.is_some());
    }

    /// Counts what is not applied of a node.
    fn note_not_applied(&mut self, node: NodeRef<'_>) {
        for Unapplied { node, field, lack } in unapplied(node) {
            let entry = self.not_applied.entry((node.id, field));
            let found = entry.or_insert_with(|| NotApplied {
                place: Place::of(node),
                text: field.map_or_else(
                    || lack.to_owned(),
                    |field| format!("`{field}` is not applied: {lack}"),
                ),
                count: 0,
            });
            found.count += 1;
        }
    }

    /// Returns the index of a mesh, which is added unless the model has an equal one.
    fn mesh(&mut self, mesh: Mesh) -> usize {
        let known = self.meshes.entry(content(&mesh)).or_default();
        if let Some(&index) = known.iter().find(|&&i| self.model.meshes[i] == mesh) {
            return index;
        }
        let index = self.model.meshes.len();
        known.push(index);
        self.model.meshes.push(mesh);
        index
    }

    /// Ends the walk.
    fn finish(mut self) -> Model {
        let lit_by = self.lights.uses(&self.lit);
        for node in std::mem::take(&mut self.light_nodes) {
            let lit = lit_by.get(&node.id).copied().unwrap_or(0);
            if lit < self.shapes {
                self.note(Feature::LightScope, node);
                if let Some(o) = self.features.get_mut(&(Feature::LightScope, Some(node.id))) {
                    o.count = self.shapes - lit;
                }
            }
        }
        let mut model = self.model;
        model.images = self.canvas.images.list;
        model.features = self.features.into_values().collect();
        model.not_applied = self.not_applied.into_values().collect();
        model.diagnostics = self.canvas.reports.finish();
        model.set_locals();
        model
    }
}

/// A hash of the content of a mesh.
fn content(mesh: &Mesh) -> u64 {
    let mut hasher = DefaultHasher::new();
    let mut add = |values: &[f32]| values.iter().for_each(|v| v.to_bits().hash(&mut hasher));
    mesh.positions.iter().for_each(|p| add(&p.to_array()));
    mesh.normals.iter().for_each(|p| add(&p.to_array()));
    mesh.coordinates.iter().for_each(|p| add(&p.to_array()));
    mesh.colors.iter().for_each(|p| add(p));
    match &mesh.primitives {
        Primitives::Triangles(list) => list.hash(&mut hasher),
        Primitives::Lines(list) => list.hash(&mut hasher),
        Primitives::Points => {}
    }
    hasher.finish()
}

/// Returns the feature of a node that no shape draws, by its class.
fn feature_of(node: NodeRef<'_>, role: Role) -> Option<Feature> {
    let Some(class) = node.known_class() else {
        return Some(Feature::UnknownNode);
    };
    let name = class.name;
    let ends = |ends: &[&str]| ends.iter().any(|e| name.ends_with(e));
    if name == "Script" {
        Some(Feature::Script)
    } else if matches!(name, "Sound" | "AudioClip") {
        Some(Feature::Sound)
    } else if name.ends_with("Sensor") && name != "TimeSensor" || ends(&["Anchor", "Dragger"]) {
        Some(Feature::Interaction)
    } else if role == Role::Billboard {
        Some(Feature::Billboard)
    } else if name == "Environment" {
        (node.get(environment::FOG_TYPE) != environment::FOG_TYPE_NONE).then_some(Feature::Fog)
    } else if role == Role::Property && name.ends_with("Fog") {
        Some(Feature::Fog)
    } else {
        None
    }
}

/// The number of children of a switch or a level of detail.
fn choices(node: NodeRef<'_>) -> usize {
    [
        vrml97_switch_node::CHOICE,
        vrml97_lod::LEVEL,
        vrml97_group::CHILDREN,
    ]
    .map(|field| node.get_nodes(field).len())
    .into_iter()
    .find(|n| *n > 0)
    .unwrap_or(node.data().children.len())
}

/// Whether a switch hides some of its children.
fn hides(node: NodeRef<'_>) -> bool {
    let vrml97 = node.find(vrml97_switch_node::WHICH_CHOICE);
    let which = vrml97.unwrap_or_else(|| node.get(switch_node::WHICH_CHILD));
    let hidden = match which {
        -3 => 0,
        0.. => choices(node).saturating_sub(1),
        _ => choices(node),
    };
    hidden > 0
}

impl<'a> Visitor<'a> for ModelBuilder<'a> {
    fn shape(&mut self, node: NodeRef<'a>, state: &State<'a>) {
        let key = self.visit(node);
        if state.drawing.style == DrawStyle::Invisible && !Canvas::ignores_draw_style(&self.canvas)
        {
            self.note(Feature::InvisibleShape, node);
            return;
        }
        self.place_group(state.world_from_object);
        let world = DAffine3::from_mat4(state.world_from_object);
        if !self.draws {
            if is_bounded(&world) {
                self.add(node, key, Some(world));
            }
            return;
        }
        let mut finer;
        let mut state = state;
        // The edges of round shapes are those of the scene's complexity.
        if !self.canvas.will_outline(state) && state.complexity.value < self.complexity {
            finer = state.clone();
            finer.complexity.value = self.complexity;
            state = &finer;
        }
        shapes::draw(node, state, &mut self.canvas);
        let drawn = self.canvas.finish();
        if drawn.parts.is_empty() || !is_bounded(&world) {
            return;
        }
        for feature in drawn.features {
            let is_default = feature == Feature::OneSidedLight;
            self.note_by(feature, Some(node).filter(|_| !is_default));
        }
        if is_screen_aligned(node) {
            self.note(Feature::ScreenAligned, node);
        }
        let mut materials = drawn.parts.iter().map(|(_, material)| material);
        if materials.any(|m| m.reflects_ambient_light(m.ambient_light)) {
            self.note_by(Feature::AmbientLight, ambient_node(state));
        }
        if !drawn.parts.iter().all(|(_, m)| m.unlit) {
            self.shapes += 1;
            let compile =
                |light: &LightElement| looks::Light::new(light, DVec3::ZERO, ColorCoding::Levels);
            let set = self.lights.set(&state.lights, compile) as usize;
            self.lit.resize(self.lit.len().max(set + 1), 0);
            self.lit[set] += 1;
        }
        let index = self.add(node, key, Some(world));
        self.model.nodes[index].states_sides = states_sides(node);
        for (mesh, material) in drawn.parts {
            let mesh = self.mesh(mesh);
            let next = self.materials.len();
            let number = *self.materials.entry(material.key()).or_insert(next);
            if number == next {
                self.model.materials.push(material);
            }
            self.model.nodes[index].parts.push(Part {
                mesh,
                material: number,
            });
        }
    }

    fn enter(&mut self, node: NodeRef<'a>, state: &State<'a>) {
        self.place_group(state.world_from_object);
        match role::role(node) {
            Role::Switch if hides(node) => self.note(Feature::HiddenChildren, node),
            Role::Blinker if choices(node) > 0 => self.note(Feature::BlinkingChildren, node),
            Role::Lod | Role::LevelOfDetail if choices(node) > 1 => {
                self.note(Feature::Levels, node);
            }
            _ => {}
        }
        let key = self.visit(node);
        let index = self.add(node, key, None);
        self.open.push(Open {
            node: index,
            is_placed: false,
            visits: HashMap::new(),
        });
    }

    fn leave(&mut self) {
        if self.open.len() > 1
            && let Some(open) = self.open.pop()
            && self.draws
        {
            self.close_group(open.node);
        }
    }

    fn light(&mut self, node: NodeRef<'a>, light: &LightElement, state: &State<'a>) {
        let place = Place::of(node);
        let name = place.name.clone().unwrap_or_else(|| place.class.clone());
        self.light_nodes.push(node);
        let light = SceneLight::new(light, node, state, name, place);
        self.model.lights.push(light);
    }

    fn camera(&mut self, node: NodeRef<'a>, state: &State<'a>) {
        let Some(pose) = CameraPose::from_node(node, state.world_from_object) else {
            return;
        };
        let place = Place::of(node);
        let described = node.find(viewpoint::DESCRIPTION).filter(|d| !d.is_empty());
        let described = described.map(str::to_owned);
        let name = place.name.clone().or(described);
        let name = name.unwrap_or_else(|| place.class.clone());
        let camera = SceneCamera::new(node, pose, name, place);
        self.model.cameras.push(camera);
    }

    fn node(&mut self, node: NodeRef<'a>, role: Role) {
        if !self.draws {
            return;
        }
        self.note_not_applied(node);
        if let Some(feature) = feature_of(node, role)
            && (feature != Feature::Billboard || self.has_camera)
        {
            self.note(feature, node);
        }
    }

    fn bindable(&mut self, node: NodeRef<'a>, state: &State<'a>) {
        let name = node.known_class().map_or("", |class| class.name);
        if name.ends_with("Background") {
            self.note(Feature::Background, node);
        } else if name.ends_with("Fog")
            && traversal::property::fog97(node, state).is_some_and(|f| f.fog != FogKind::None)
        {
            self.note(Feature::Fog, node);
        }
    }

    fn report(&mut self, diagnostic: Box<Diagnostic>) {
        self.canvas.reports.add(*diagnostic);
    }

    fn is_full(&self) -> bool {
        self.canvas.is_full()
    }
}

/// Returns the node that states the ambient light, or `None` if it is that of the language.
fn ambient_node<'a>(state: &State<'a>) -> Option<NodeRef<'a>> {
    let node = state.environment_node?;
    let is_stated =
        node.states(environment::AMBIENT_INTENSITY) || node.states(environment::AMBIENT_COLOR);
    is_stated.then_some(node)
}

/// Whether the file states which sides of a shape are seen. In Inventor both are unless it does.
fn states_sides(node: NodeRef<'_>) -> bool {
    let is_vrml97 = node.known_class().is_some_and(Class::is_vrml97);
    !is_vrml97 || node.states(extrusion::SOLID)
}

/// Whether a shape faces the camera, with a size in pixels.
fn is_screen_aligned(node: NodeRef<'_>) -> bool {
    let classes = [
        class::TEXT2,
        class::TEXT2_SET,
        class::IMAGE,
        class::MARKER_SET,
        class::INDEXED_MARKER_SET,
    ];
    let is_one = |known: &'static Class| classes.iter().any(|c| known.descends_from(*c));
    node.known_class().is_some_and(is_one)
}
