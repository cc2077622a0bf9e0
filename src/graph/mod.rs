//! Walks a document with Inventor's state rules and tells a visitor what it meets.
//!
//! The stack is a `Vec`, so depth costs memory, not the program's stack; a node that contains
//! itself is entered once a path; a budget of visits bounds trees that double at every level.

pub mod engines;
mod kit;
pub mod property;
pub mod read;
pub mod role;
pub mod state;

use std::sync::Arc;

use glam::{DMat4, DVec3, Mat4, Vec3};

use crate::diag::Diagnostic;
use crate::grammar::value::{Choice, Value};
use crate::iv::{Document, NodeId, NodeRef};
use crate::pose::{CameraPose, Projection};

use read::{Fields, nodes_in};
use role::Role;
pub use state::State;

/// What a walk may take for granted, and where it stops.
#[derive(Clone, Debug)]
pub struct WalkOptions {
    /// Seconds since the start, for nodes that move by themselves. Default: 0.
    pub time: f64,
    /// The camera that levels of detail and billboards go by. Default: none, the finest level.
    pub camera: Option<CameraPose>,
    /// Nodes met before the walk gives up. Default: 300,000, or twice the
    /// document's nodes if that is more.
    pub max_visits: u64,
    /// Walks every child of an LOD or a Blinker, as Inventor's bounding boxes do. Default: no.
    pub all_levels: bool,
    /// Turns billboards to the plane of the picture, as Coin does, not to the eye. Default: no.
    pub flat_billboards: bool,
}

impl Default for WalkOptions {
    fn default() -> Self {
        Self {
            time: 0.0,
            camera: None,
            max_visits: 300_000,
            all_levels: false,
            flat_billboards: false,
        }
    }
}

/// What a walk tells. Every call has the state as the node finds it.
pub trait Visitor<'a> {
    /// A shape: drawn with this state.
    fn shape(&mut self, node: NodeRef<'a>, state: &State<'a>);
    fn light(&mut self, _light: &state::LightElement, _state: &State<'a>) {}
    fn camera(&mut self, _node: NodeRef<'a>, _state: &State<'a>) {}
    /// Any node, before anything else.
    fn node(&mut self, _node: NodeRef<'a>, _role: Role) {}
    /// A separator begins, in this state; [`Self::close`] ends it.
    fn open(&mut self, _state: &State<'a>) {}
    fn close(&mut self) {}
    /// A VRML 97 `Background` or `Fog`, of which a scene has one in force: the first.
    fn bindable(&mut self, _node: NodeRef<'a>, _state: &State<'a>) {}
    /// Pixels that the box around a node's children takes up; `None` where nobody looks.
    fn screen_area(&mut self, _node: NodeRef<'a>, _state: &State<'a>) -> Option<f64> {
        None
    }
    /// Whether the visitor has no room for more; the walk ends then.
    fn is_full(&self) -> bool {
        false
    }
    /// Something wrong with the scene that walking found.
    #[allow(clippy::boxed_local)] // boxed as every diagnostic that is handed on
    fn trouble(&mut self, _trouble: Box<Diagnostic>) {}
}

enum Frame<'a> {
    Visit(NodeId),
    VisitDefault(NodeRef<'a>),
    /// The children of a list from an index on.
    List {
        list: &'a [NodeId],
        next: usize,
    },
    Leave(NodeId),
    Restore(Box<State<'a>>),
    /// The same at the end of a separator.
    Close(Box<State<'a>>),
    RestoreMatrix(DMat4),
    /// Frames, the first to be walked first, inside a separator that a kit makes.
    Scope {
        inner: Vec<Frame<'a>>,
        matrix_only: bool,
    },
    /// A subtree walked again under another matrix.
    Place {
        node: NodeRef<'a>,
        matrix: DMat4,
        choice: i32,
    },
    Geometry {
        shape: NodeRef<'a>,
    },
}

struct Walk<'a, 'v, V> {
    document: &'a Document,
    options: &'v WalkOptions,
    visitor: &'v mut V,
    state: State<'a>,
    stack: Vec<Frame<'a>>,
    /// Whether a node is on the path from the root to here.
    on_path: Vec<bool>,
    visits: u64,
    told_cycle: bool,
}

/// Walks all roots in order, under one state.
pub fn walk<'a, V: Visitor<'a>>(document: &'a Document, options: &WalkOptions, visitor: &mut V) {
    let vrml97 = document.format.starts_with("VRML V2");
    let vrml1 = document.format.starts_with("VRML V1");
    let state = State::new(vrml1, vrml97);
    walk_list(document, &document.roots, state, options, visitor);
}

/// Walks some nodes of a document in order, beginning with a state.
pub fn walk_list<'a, V: Visitor<'a>>(
    document: &'a Document,
    list: &'a [NodeId],
    state: State<'a>,
    options: &WalkOptions,
    visitor: &mut V,
) {
    let mut walk = Walk {
        document,
        options,
        visitor,
        state,
        stack: vec![Frame::List { list, next: 0 }],
        on_path: vec![false; document.nodes.len()],
        visits: 0,
        told_cycle: false,
    };
    let most = options.max_visits.max(2 * document.nodes.len() as u64);
    while let Some(frame) = walk.stack.pop() {
        walk.step(frame);
        if walk.visitor.is_full() {
            break;
        }
        if walk.visits > most {
            let trouble = Diagnostic::warning(format!(
                "the scene has more than {most} nodes to walk; the rest is left out"
            ));
            walk.visitor.trouble(trouble.with_help(
                "a subtree used by subtrees used again grows fast; `--scene-limit visits=N` raises this",
            ));
            break;
        }
    }
}

impl<'a, V: Visitor<'a>> Walk<'a, '_, V> {
    fn step(&mut self, frame: Frame<'a>) {
        match frame {
            Frame::Visit(id) => self.visit(self.document.node(id)),
            Frame::VisitDefault(node) => self.visit(node),
            Frame::List { list, next } => {
                if let Some(&id) = list.get(next) {
                    self.stack.push(Frame::List {
                        list,
                        next: next + 1,
                    });
                    self.visit(self.document.node(id));
                }
            }
            Frame::Leave(id) => self.on_path[id.0 as usize] = false,
            Frame::Restore(state) => self.state = *state,
            Frame::Close(state) => {
                self.state = *state;
                self.visitor.close();
            }
            Frame::RestoreMatrix(matrix) => self.state.world_from_object = matrix,
            Frame::Scope { inner, matrix_only } => {
                if matrix_only {
                    self.stack
                        .push(Frame::RestoreMatrix(self.state.world_from_object));
                } else {
                    self.open_separator();
                }
                self.stack.extend(inner.into_iter().rev());
            }
            Frame::Place {
                node,
                matrix,
                choice,
            } => {
                self.keep_state();
                self.state.world_from_object *= matrix;
                self.state.switch = choice;
                self.children(node);
            }
            Frame::Geometry { shape } => self.geometry(shape),
        }
    }

    fn visit(&mut self, node: NodeRef<'a>) {
        self.visits += 1;
        let role = role::role(node);
        self.visitor.node(node, role);
        match role {
            // A class nobody knows, or nothing to draw: SGI and Coin walk past it too.
            Role::Kept => {}
            Role::Property => {
                property::apply(&mut self.state, node, self.options.time);
            }
            Role::Shape => self.visitor.shape(node, &self.state),
            Role::Light => self.light(node),
            Role::Camera => self.visitor.camera(node, &self.state),
            Role::Bindable => self.visitor.bindable(node, &self.state),
            _ => self.enter(node, role),
        }
    }

    fn light(&mut self, node: NodeRef<'a>) {
        if let Some(light) = property::light(&self.state, node) {
            self.visitor.light(&light, &self.state);
            Arc::make_mut(&mut self.state.lights).push(light);
        }
    }

    /// A node with children. Being on the path already means that it contains itself.
    fn enter(&mut self, node: NodeRef<'a>, role: Role) {
        let index = node.id.0 as usize;
        if !std::ptr::eq(node.document, self.document) {
            return; // a part that a kit makes up: it has no children
        }
        if self.on_path[index] {
            if !self.told_cycle {
                self.told_cycle = true;
                let mut trouble = Diagnostic::warning(format!(
                    "this `{}` contains itself; it is entered once",
                    node.class_name()
                ));
                if let Some(source) = node.source() {
                    trouble = trouble.at(source, node.span());
                }
                self.visitor.trouble(trouble);
            }
            return;
        }
        self.on_path[index] = true;
        self.stack.push(Frame::Leave(node.id));
        match role {
            Role::Group => self.children(node),
            Role::File => {
                if let Some(list) = self.document.included.get(&node.id) {
                    self.stack.push(Frame::List { list, next: 0 });
                }
            }
            Role::Separator | Role::Collision => {
                self.open_separator();
                self.state.on_top |= node.known_class().is_some_and(|c| c.is_a("Annotation"));
                self.state.highlight = property::highlight(node).or(self.state.highlight);
                self.children(node);
            }
            Role::TransformSeparator => {
                self.stack
                    .push(Frame::RestoreMatrix(self.state.world_from_object));
                self.children(node);
            }
            Role::Transform97 => {
                self.open_separator();
                self.state.world_from_object *= property::transform(node, "scale");
                self.children(node);
            }
            Role::Billboard => {
                self.open_separator();
                self.turn_to_camera(node);
                self.children(node);
            }
            Role::Switch => self.switch(node),
            Role::Blinker => self.blinker(node),
            Role::PathSwitch => self.path_switch(node),
            Role::Array => self.array(node),
            Role::MultipleCopy => self.multiple_copy(node),
            Role::Lod => self.lod(node),
            Role::LevelOfDetail => self.level_of_detail(node),
            Role::AppearanceAndGeometry => self.appearance(node),
            Role::Kit => kit::plan(node, &mut self.stack),
            Role::ListPart => self.stack.push(Frame::List {
                list: nodes_in(node, "containerNode"),
                next: 0,
            }),
            _ => {}
        }
    }

    fn keep_state(&mut self) {
        self.stack
            .push(Frame::Restore(Box::new(self.state.clone())));
    }

    fn open_separator(&mut self) {
        self.visitor.open(&self.state);
        self.stack.push(Frame::Close(Box::new(self.state.clone())));
    }

    fn children(&mut self, node: NodeRef<'a>) {
        // VRML 97 keeps children in a field; the last pushed is walked first.
        for field in ["level", "choice", "children"] {
            let list = nodes_in(node, field);
            if !list.is_empty() {
                self.stack.push(Frame::List { list, next: 0 });
            }
        }
        self.stack.push(Frame::List {
            list: &node.data().children,
            next: 0,
        });
    }

    /// The children among which a switch or a level of detail picks.
    fn choices(node: NodeRef<'a>) -> &'a [NodeId] {
        ["choice", "level", "children"]
            .iter()
            .map(|field| nodes_in(node, field))
            .find(|list| !list.is_empty())
            .unwrap_or(&node.data().children)
    }

    fn pick(&mut self, list: &'a [NodeId], index: usize) {
        if let Some(&id) = list.get(index) {
            self.stack.push(Frame::Visit(id));
        }
    }

    fn switch(&mut self, node: NodeRef<'a>) {
        let list = Self::choices(node);
        let vrml97 = node.value("whichChoice").is_some();
        let field = if vrml97 { "whichChoice" } else { "whichChild" };
        let mut which = node.read::<i32>(field).unwrap_or(-1);
        if vrml97 {
            self.keep_state();
        }
        if which == -2 {
            which = self.state.switch;
            if which >= 0 && !list.is_empty() {
                which %= list.len() as i32;
            }
        }
        self.state.switch = which;
        match which {
            -3 => self.stack.push(Frame::List { list, next: 0 }),
            0.. => self.pick(list, which as usize),
            _ => {}
        }
    }

    /// One child after the other, a round every 1/speed seconds; a single child comes and goes.
    /// Before the clock starts the file's own choice holds, and one that is off shows a child (as
    /// Coin does, measured).
    fn blinker(&mut self, node: NodeRef<'a>) {
        let list = Self::choices(node);
        if self.options.all_levels {
            self.stack.push(Frame::List { list, next: 0 });
            return;
        }
        let stated = node.read::<i32>("whichChild").unwrap_or(-1);
        let speed = f64::from(node.read::<f32>("speed").unwrap_or(1.0));
        let round = speed * self.options.time;
        let share = round - round.floor();
        let which = match (node.read::<bool>("on").unwrap_or(true), list.len()) {
            (false, _) => stated.max(0),
            (true, 1) if round > 0.0 => libm::floor(2.0 * share) as i32 - 1,
            (true, n) if round > 0.0 => libm::floor(share * n as f64) as i32,
            _ => stated,
        };
        self.state.switch = which;
        if let Ok(index) = usize::try_from(which) {
            self.pick(list, index);
        }
    }

    /// Walks its children where the nodes above end with its path.
    fn path_switch(&mut self, node: NodeRef<'a>) {
        let Some(path) = node.node_in("path") else {
            return;
        };
        let mut wanted: Vec<NodeId> = nodes_in(path, "head").to_vec();
        for &index in path.read::<[i32]>("indices").unwrap_or(&[]) {
            let below = wanted.last().map(|&id| self.document.node(id));
            let child = below.and_then(|n| n.data().children.get(usize::try_from(index).ok()?));
            let Some(&child) = child else {
                return;
            };
            wanted.push(child);
        }
        let above: Vec<NodeId> = self
            .stack
            .iter()
            .filter_map(|frame| match frame {
                Frame::Leave(id) if *id != node.id => Some(*id),
                _ => None,
            })
            .collect();
        if !wanted.is_empty() && above.ends_with(&wanted) {
            self.children(node);
        }
    }

    /// Walks the children at every place of a grid, as Inventor does: z slowest, x fastest, and
    /// every copy from the state that the array itself was met in.
    fn array(&mut self, node: NodeRef<'a>) {
        let count = |i: usize| {
            let n = node.read::<i16>(["numElements1", "numElements2", "numElements3"][i]);
            i64::from(n.unwrap_or(1).max(0))
        };
        let step = |i: usize| {
            node.read::<Vec3>(["separation1", "separation2", "separation3"][i])
                .unwrap_or_default()
                .as_dvec3()
        };
        let (n, s) = ([count(0), count(1), count(2)], [step(0), step(1), step(2)]);
        if n[0] * n[1] * n[2] > 10_000_000 {
            return;
        }
        let from = |i: usize| match node.read::<Choice>("origin") {
            Some(1) => -0.5 * (n[i] - 1) as f64,
            Some(2) => -(n[i] - 1) as f64,
            _ => 0.0,
        };
        let mut places = Vec::new();
        for k in 0..n[2] {
            for j in 0..n[1] {
                for i in 0..n[0] {
                    let offset: DVec3 = (from(0) + i as f64) * s[0]
                        + (from(1) + j as f64) * s[1]
                        + (from(2) + k as f64) * s[2];
                    places.push(DMat4::from_translation(offset));
                }
            }
        }
        self.place(node, &places);
    }

    fn multiple_copy(&mut self, node: NodeRef<'a>) {
        let matrices = node.read::<[Mat4]>("matrix").unwrap_or(&[]);
        let places: Vec<DMat4> = matrices.iter().map(Mat4::as_dmat4).collect();
        self.place(node, &places);
    }

    fn place(&mut self, node: NodeRef<'a>, places: &[DMat4]) {
        for (i, &matrix) in places.iter().enumerate().rev() {
            self.stack.push(Frame::Place {
                node,
                matrix,
                choice: i as i32,
            });
        }
    }

    /// Inventor's LOD: by the distance from the eye to the center, both in the world.
    fn lod(&mut self, node: NodeRef<'a>) {
        let list = Self::choices(node);
        if self.options.all_levels {
            self.stack.push(Frame::List { list, next: 0 });
            return;
        }
        let ranges = node.read::<[f32]>("range").unwrap_or(&[]);
        let center = node.read::<Vec3>("center").unwrap_or_default().as_dvec3();
        let world = self.state.world_from_object.transform_point3(center);
        let level = match &self.options.camera {
            Some(camera) => {
                let distance = camera.position.distance(world);
                ranges
                    .iter()
                    .take_while(|&&range| distance >= f64::from(range))
                    .count()
            }
            None => 0,
        };
        self.pick(list, level.min(list.len().saturating_sub(1)));
    }

    /// SGI's LevelOfDetail goes by the pixels that the box around its children takes up, times
    /// `Complexity` and a half (Coin); `Complexity` 0 asks for the coarsest, 1 for the finest.
    fn level_of_detail(&mut self, node: NodeRef<'a>) {
        let list = Self::choices(node);
        if self.options.all_levels {
            self.stack.push(Frame::List { list, next: 0 });
            return;
        }
        let last = list.len().saturating_sub(1);
        let complexity = self.state.complexity.value;
        let index = if complexity <= 0.0 {
            last
        } else if complexity >= 1.0 {
            0
        } else {
            match self.visitor.screen_area(node, &self.state) {
                Some(area) => {
                    let area = area * (f64::from(complexity) + 0.5);
                    let limits = node.read::<[f32]>("screenArea").unwrap_or(&[0.0]);
                    let level = limits.iter().position(|&limit| area > f64::from(limit));
                    let none = if limits.is_empty() { 0 } else { last };
                    level.unwrap_or(none).min(last)
                }
                None => 0,
            }
        };
        self.pick(list, index);
    }

    /// VRML 97's Billboard turns +z to the camera, about its axis or freely.
    fn turn_to_camera(&mut self, node: NodeRef<'a>) {
        let Some(camera) = &self.options.camera else {
            return;
        };
        let inverse = self.state.world_from_object.inverse();
        let eye = match camera.projection {
            Projection::Perspective { .. } if !self.options.flat_billboards => {
                inverse.transform_point3(camera.position)
            }
            _ => inverse.transform_vector3(-camera.direction()),
        };
        let axis = node.read::<Vec3>("axisOfRotation").unwrap_or(Vec3::Y);
        let turn = match axis.as_dvec3().try_normalize() {
            Some(axis) => {
                let flat = (eye - axis * eye.dot(axis)).try_normalize();
                let front = (DVec3::Z - axis * axis.z).try_normalize();
                let (Some(flat), Some(front)) = (flat, front) else {
                    return;
                };
                let angle = libm::atan2(front.cross(flat).dot(axis), front.dot(flat));
                glam::DQuat::from_axis_angle(axis, angle)
            }
            None => {
                let up = inverse.transform_vector3(camera.orientation * DVec3::Y);
                let Some(z) = eye.try_normalize() else {
                    return;
                };
                let Some(x) = up.cross(z).try_normalize() else {
                    return;
                };
                glam::DQuat::from_mat3(&glam::DMat3::from_cols(x, z.cross(x), z))
            }
        };
        if turn.is_finite() {
            self.state.world_from_object *= DMat4::from_quat(turn);
        }
    }

    fn appearance(&mut self, node: NodeRef<'a>) {
        self.keep_state();
        self.stack.push(Frame::Geometry { shape: node });
        self.state.vrml97 = true;
    }

    /// VRML 97's Shape: the appearance replaces material and texture, then the geometry is drawn.
    fn geometry(&mut self, shape: NodeRef<'a>) {
        appearance97(&mut self.state, shape.node_in("appearance"));
        for id in nodes_in(shape, "geometry") {
            let geometry = self.document.node(*id);
            self.visits += 1;
            let role = role::role(geometry);
            self.visitor.node(geometry, role);
            if role == Role::Shape {
                self.visitor.shape(geometry, &self.state);
            } else if role != Role::Kept {
                self.enter(geometry, role); // a PROTO's body
            }
        }
    }
}

/// A VRML 97 `Appearance`. No material: unlit white (the specification, 6.3 and 4.14).
fn appearance97<'a>(state: &mut State<'a>, appearance: Option<NodeRef<'a>>) {
    use state::{Diffuse, List, MaterialElement, TextureElement, TextureModel};
    let material = appearance.and_then(|a| a.node_in("material"));
    state.texture = None;
    state.texture_matrix = Mat4::IDENTITY;
    state.texture_coordinates = state::TextureCoordinates::Default;
    match material {
        None => {
            state.base_color = true;
            state.material = MaterialElement {
                diffuse: Diffuse::Colors(List::One(Vec3::ONE)),
                ..MaterialElement::DEFAULT
            };
        }
        Some(m) => {
            state.base_color = false;
            let color = |name: &str, default: Vec3| m.read::<Vec3>(name).unwrap_or(default);
            let number = |name: &str, default: f32| m.read::<f32>(name).unwrap_or(default);
            let diffuse = color("diffuseColor", Vec3::splat(0.8));
            state.material = MaterialElement {
                ambient: diffuse * number("ambientIntensity", 0.2),
                diffuse: Diffuse::Colors(List::One(diffuse)),
                specular: color("specularColor", Vec3::ZERO),
                emissive: color("emissiveColor", Vec3::ZERO),
                shininess: number("shininess", 0.2),
                transparency: List::One(number("transparency", 0.0)),
                refraction: 1.0,
            };
        }
    }
    let Some(appearance) = appearance else {
        return;
    };
    if let Some(texture) = appearance.node_in("texture") {
        state.texture = Some(TextureElement {
            node: texture,
            model: TextureModel::Modulate,
            blend_color: Vec3::ZERO,
            repeat_s: texture.read::<bool>("repeatS").unwrap_or(true),
            repeat_t: texture.read::<bool>("repeatT").unwrap_or(true),
            repeat_r: true,
            quality: 0.5,
        });
    }
    if let Some(transform) = appearance.node_in("textureTransform") {
        state.texture_matrix = texture_transform97(transform);
    }
}

/// VRML 97's texture transform: p' = −c S R c t applied to p, 6.47 of the specification.
fn texture_transform97(node: NodeRef<'_>) -> Mat4 {
    let pair = |name: &str, default: f32| {
        node.read::<glam::Vec2>(name)
            .unwrap_or(glam::Vec2::splat(default))
    };
    let center = pair("center", 0.0).extend(0.0);
    let turn = property::turn_z(node.read::<f32>("rotation").unwrap_or(0.0));
    Mat4::from_translation(-center)
        * Mat4::from_scale(pair("scale", 1.0).extend(1.0))
        * Mat4::from_quat(turn)
        * Mat4::from_translation(center + pair("translation", 0.0).extend(0.0))
}

/// Whether any field of the document takes its value from elsewhere.
pub fn has_connections(document: &Document) -> bool {
    document
        .nodes
        .iter()
        .any(|n| n.fields.iter().any(|f| f.connection.is_some()))
}

/// The first node of a field that holds nodes, whatever its type.
pub fn first_node<'a>(node: NodeRef<'a>, name: &str) -> Option<NodeRef<'a>> {
    match node.value(name)? {
        Value::Node(Some(id)) => Some(node.document.node(*id)),
        Value::Nodes(list) => list.first().map(|&id| node.document.node(id)),
        _ => None,
    }
}

#[cfg(test)]
mod tests;
