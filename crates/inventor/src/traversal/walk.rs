//! The walk: its stack, and the steps at each node.

use std::collections::HashSet;

use ivcam_base::diag::Diagnostic;
use ivcam_base::work::{self, Budget, Cut};

use super::frame::WalkFrame;
use super::geo;
use super::kit;
use super::lights;
use super::property::{self, LightReach};
use super::role::{self, Role};
use super::state::{Bindables, Language, State};
use super::visitor::{Instance, Visitor, WalkOptions};
use crate::grammar::{
    Class, class, node_kit_list_part, vrml97_group, vrml97_lod, vrml97_switch_node,
    vrml97_transform,
};
use crate::iv::{Document, NodeId, NodeRef, Value};
use crate::snapshot::Snapshot;

/// The steps of work that a visit takes.
const VISIT_STEPS: u64 = 50;
/// The further steps of a node with children: its frames may need new memory. A visit took 320 ns
/// in 100,000 nested levels of detail.
const ENTER_STEPS: u64 = 50;

/// A walk in progress.
pub(super) struct Walk<'a, 'v, V> {
    pub(super) document: &'a Document,
    /// The time of the snapshot, in seconds.
    pub(super) time: f64,
    pub(super) options: &'v WalkOptions,
    pub(super) visitor: &'v mut V,
    pub(super) state: State<'a>,
    /// The steps still to be done, the next one last.
    pub(super) stack: Vec<WalkFrame<'a>>,
    /// For each node, whether it is on the path from the root to the current node.
    on_path: &'v mut [bool],
    /// The number of nodes visited so far.
    pub(super) visits: u64,
    /// Why the account of the scene cut the walk, and the node before which it did.
    cut: Option<(Cut, NodeRef<'a>)>,
    /// Whether a cycle was reported; only the first one is.
    reported_cycle: bool,
    /// The arrays that were reported.
    pub(super) reported: HashSet<NodeId>,
    /// Whether the document has lights that shine on all of their group.
    pub(super) has_group_lights: bool,
}

/// Walks all roots of a snapshot in order, with one state.
pub fn walk<'a, V: Visitor<'a>>(
    snapshot: &'a Snapshot<'_>,
    options: &WalkOptions,
    visitor: &mut V,
) {
    let document = snapshot.document();
    let mut state = State::new(Language::of(document));
    state.bindables = snapshot.bound().map_or(Bindables::First, Bindables::Bound);
    let lights = lights::scene_lights(snapshot, &document.roots, &state, options);
    state.lights = lights.into_iter().collect();
    walk_list(snapshot, &document.roots, state, options, visitor);
}

/// Walks some nodes of a snapshot in order, beginning with a state.
pub fn walk_list<'a, V: Visitor<'a>>(
    snapshot: &'a Snapshot<'_>,
    list: &'a [NodeId],
    state: State<'a>,
    options: &WalkOptions,
    visitor: &mut V,
) {
    let mut scratch = Scratch::new(snapshot.document());
    let mut walk = Walk::new(snapshot, state, options, visitor, &mut scratch);
    walk.stack.push(WalkFrame::List { list, next: 0 });
    walk.light_group(list);
    walk.run();
}

/// Walks what is in a part of a snapshot inside another walk, beginning with a state. The node of
/// the part itself is not visited again. `scratch` is memory that walks of the same document share.
pub fn walk_part<'a, V: Visitor<'a>>(
    snapshot: &'a Snapshot<'_>,
    part: Instance<'a>,
    state: State<'a>,
    (options, scratch): (&WalkOptions, &mut Scratch),
    visitor: &mut V,
) {
    let mut walk = Walk::new(snapshot, state, options, visitor, scratch);
    match part {
        Instance::Node(node) => walk.enter(node, role::role(node)),
        Instance::Copy(node) | Instance::Grid(node, _) => walk.children(node),
    }
    walk.run();
}

/// The memory of a walk that depends only on the document.
pub struct Scratch {
    /// For each node, whether it is on the path from the root to the current node.
    on_path: Vec<bool>,
    /// Whether the document has lights that shine on all of their group.
    has_group_lights: bool,
}

impl Scratch {
    /// The memory for walks of a document.
    pub fn new(document: &Document) -> Self {
        Self {
            on_path: vec![false; document.nodes.len()],
            has_group_lights: lights::has_light(document, LightReach::Group),
        }
    }
}

impl<'a, 'v, V: Visitor<'a>> Walk<'a, 'v, V> {
    fn new(
        snapshot: &'a Snapshot<'_>,
        state: State<'a>,
        options: &'v WalkOptions,
        visitor: &'v mut V,
        scratch: &'v mut Scratch,
    ) -> Self {
        Self {
            document: snapshot.document(),
            time: snapshot.time(),
            options,
            visitor,
            state,
            stack: Vec::new(),
            has_group_lights: scratch.has_group_lights,
            on_path: &mut scratch.on_path,
            visits: 0,
            cut: None,
            reported_cycle: false,
            reported: HashSet::new(),
        }
    }

    /// Does all steps, up to the limits.
    fn run(&mut self) {
        let most = self.options.most_visits(self.document);
        while let Some(frame) = self.stack.pop() {
            self.step(frame);
            if self.visitor.is_full() {
                break;
            }
            if let Some((cut, node)) = self.cut {
                let warning = Budget::current().warning(cut);
                let warning = match node.source() {
                    Some(source) => warning.at(source, node.span()),
                    None => warning,
                };
                self.visitor.report(warning);
                break;
            }
            if self.visits > most {
                let diagnostic = Diagnostic::warning(format!(
                    "the scene has more than {most} nodes to walk; the rest is left out"
                ));
                self.visitor.report(diagnostic.with_help(
                    "a subtree used by subtrees used again grows fast; `--scene-limit visits=N` raises this",
                ));
                break;
            }
        }
        for frame in self.stack.drain(..) {
            if let WalkFrame::Leave(id) = frame {
                self.on_path[id.0 as usize] = false;
            }
        }
    }
}

impl<'a, V: Visitor<'a>> Walk<'a, '_, V> {
    fn step(&mut self, frame: WalkFrame<'a>) {
        match frame {
            WalkFrame::Visit(id) => self.visit(self.document.node(id)),
            WalkFrame::VisitDefault(node) => self.visit(node),
            WalkFrame::List { list, next } => {
                if let Some(&id) = list.get(next) {
                    self.stack.push(WalkFrame::List {
                        list,
                        next: next + 1,
                    });
                    self.visit(self.document.node(id));
                }
            }
            WalkFrame::Leave(id) => {
                self.on_path[id.0 as usize] = false;
                self.visitor.leave();
            }
            WalkFrame::Restore(state) => self.state = *state,
            WalkFrame::Close(state) => {
                self.state = *state;
                self.visitor.close();
            }
            WalkFrame::RestoreMatrix(matrix, steps) => {
                self.state.world_from_object = matrix;
                self.state.steps = steps;
            }
            WalkFrame::Scope { inner, matrix_only } => {
                if matrix_only {
                    self.keep_matrix();
                } else {
                    self.open_separator();
                }
                self.stack.extend(inner.into_iter().rev());
            }
            WalkFrame::Copies {
                node,
                copies,
                next,
                visits,
            } => self.copy(node, copies, next, visits),
            WalkFrame::Geometry { shape } => self.geometry(shape),
        }
    }

    fn visit(&mut self, node: NodeRef<'a>) {
        self.visits += 1;
        if let Err(cut) = work::spend(VISIT_STEPS) {
            self.cut = Some((cut, node));
            return;
        }
        let role = role::role(node);
        self.visitor.node(node, role);
        match role {
            // Unknown classes and invisible nodes are skipped, as in SGI's library and in Coin.
            Role::Kept | Role::Held => self.alternative(node),
            Role::Property => {
                property::apply(&mut self.state, node, self.time);
            }
            Role::Shape => self.visitor.shape(node, &self.state),
            Role::Light => self.light(node),
            Role::Camera => {
                self.state.camera = Some(node);
                self.visitor.camera(node, &self.state);
            }
            Role::Bindable => {
                if self.state.bindables.include(node.id) {
                    self.visitor.bindable(node, &self.state);
                }
            }
            Role::Sensor => self.visitor.sensor(node, &self.state),
            _ => self.enter_once(node, role),
        }
    }

    /// Walks the node that the file gives for a node whose class is not known, or for a file that
    /// is not there (SGI's reference pages of `SoUnknownNode` and `SoWWWInline`).
    fn alternative(&mut self, node: NodeRef<'a>) {
        let is_known = node.known_class().is_some_and(|c| c.role != Role::File);
        if let Some(Value::Node(Some(id))) = node.value("alternateRep").filter(|_| !is_known) {
            self.stack.push(WalkFrame::Visit(*id));
        }
    }

    /// Enters a node with children, unless the visitor draws it as an instance, or it is already on
    /// the path, which means that it contains itself.
    pub(super) fn enter_once(&mut self, node: NodeRef<'a>, role: Role) {
        if !std::ptr::eq(node.document, self.document) {
            return; // a default part of a kit, which has no children
        }
        let restores = matches!(
            role,
            Role::Separator | Role::TransformGroup | Role::AppearanceAndGeometry
        );
        if restores && self.visitor.instance(Instance::Node(node), &self.state) {
            return;
        }
        if self.on_path[node.id.0 as usize] {
            if !self.reported_cycle {
                self.reported_cycle = true;
                let mut diagnostic = Diagnostic::warning(format!(
                    "this `{}` contains itself; it is entered once",
                    node.class_name()
                ));
                if let Some(source) = node.source() {
                    diagnostic = diagnostic.at(source, node.span());
                }
                self.visitor.report(diagnostic);
            }
            return;
        }
        self.enter(node, role);
    }

    /// Enters a node with children.
    fn enter(&mut self, node: NodeRef<'a>, role: Role) {
        if let Err(cut) = work::spend(ENTER_STEPS) {
            self.cut = Some((cut, node));
            return;
        }
        self.on_path[node.id.0 as usize] = true;
        self.stack.push(WalkFrame::Leave(node.id));
        self.visitor.enter(node, &self.state);
        match role {
            Role::Group => self.children(node),
            Role::File => {
                if let Some(list) = self.document.included.get(&node.id) {
                    if node.known_class().is_some_and(Class::is_vrml97) {
                        self.keep_state();
                        if matches!(self.state.bindables, Bindables::First) {
                            self.state.bindables = Bindables::Inlined;
                        }
                    }
                    self.light_group(list);
                    self.stack.push(WalkFrame::List { list, next: 0 });
                } else {
                    self.alternative(node);
                }
            }
            Role::Separator => {
                self.open_separator();
                let class = node.known_class();
                self.state.on_top |= class.is_some_and(|c| c.descends_from(class::ANNOTATION));
                self.state.highlight = property::highlight(node).or(self.state.highlight);
                if node.class_id() == Some(class::GEO_SEPARATOR) {
                    self.state.multiply(geo::separator(&self.state, node));
                }
                self.children(node);
            }
            Role::TransformSeparator => {
                self.keep_matrix();
                self.children(node);
            }
            Role::TransformGroup => {
                self.open_separator();
                self.state
                    .multiply(property::transform(node, vrml97_transform::SCALE));
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
            Role::ListPart => self.stack.push(WalkFrame::List {
                list: node.get_nodes(node_kit_list_part::CONTAINER_NODE),
                next: 0,
            }),
            _ => {}
        }
    }

    /// Restores the state after the steps that are pushed next.
    pub(super) fn keep_state(&mut self) {
        self.stack
            .push(WalkFrame::Restore(Box::new(self.state.clone())));
    }

    /// Restores the matrix after the steps that are pushed next.
    fn keep_matrix(&mut self) {
        let matrix = self.state.world_from_object;
        self.stack
            .push(WalkFrame::RestoreMatrix(matrix, self.state.steps.clone()));
    }

    /// Begins a separator, which ends after the steps that are pushed next.
    pub(super) fn open_separator(&mut self) {
        self.visitor.open(&self.state);
        self.stack
            .push(WalkFrame::Close(Box::new(self.state.clone())));
    }

    /// Walks a node's children.
    pub(super) fn children(&mut self, node: NodeRef<'a>) {
        // VRML97 stores children in a field. The list that is pushed last is walked first.
        for field in [
            vrml97_lod::LEVEL,
            vrml97_switch_node::CHOICE,
            vrml97_group::CHILDREN,
        ] {
            let list = node.get_nodes(field);
            if !list.is_empty() {
                self.light_group(list);
                self.stack.push(WalkFrame::List { list, next: 0 });
            }
        }
        self.stack.push(WalkFrame::List {
            list: &node.data().children,
            next: 0,
        });
    }
}
