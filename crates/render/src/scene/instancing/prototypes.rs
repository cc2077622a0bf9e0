//! Remembers which parts of a scene are prototypes, and which are expanded.
//!
//! A part is known by its node and by the state in which it is drawn. If it turns out to depend on
//! its place, the camera or the rest of the scene, its recording is spoiled, and the part is
//! expanded wherever it is used.

use std::collections::HashMap;

use ivcam_base::diag::Diagnostic;
use ivcam_inventor::grammar::{ClassId, class, switch_node, vrml97_switch_node};
use ivcam_inventor::iv::{NodeId, NodeRef};
use ivcam_inventor::snapshot::Snapshot;
use ivcam_inventor::traversal::role::Role;
use ivcam_inventor::traversal::{Instance, Scratch, State, Step, WalkOptions};

use super::sizes::ExpandedSizes;
use crate::scene::options::{CompileOptions, Instancing};

/// The largest number of different states for which a part is recorded. More would be rare, and
/// each state is compared with those before.
const MOST_STATES: usize = 16;
/// The largest number of recordings inside each other, which bounds the stack. Parts between this
/// depth and the innermost ones are expanded.
const DEEPEST: usize = 32;

/// What became of a part in one state.
#[derive(Clone, Copy)]
pub(super) enum Outcome {
    /// The part is being recorded.
    Open,
    /// The part is the prototype with this number.
    Prototype(u32),
    /// The part is expanded at each use.
    Expanded,
}

/// A part: a node, and whether only its children are meant.
type PartKey = (NodeId, bool);

/// The outcomes of a part by the state in which it was drawn.
type Known<'a> = Vec<(Box<State<'a>>, Outcome)>;

fn key(part: Instance<'_>) -> PartKey {
    (part.node().id, !matches!(part, Instance::Node(_)))
}

/// What the walk of a recording needs.
pub(super) struct PartWalk<'a> {
    pub snapshot: &'a Snapshot<'a>,
    pub options: WalkOptions,
    pub scratch: Scratch,
}

/// The prototypes of a scene.
pub(in crate::scene) struct Prototypes<'a> {
    snapshot: &'a Snapshot<'a>,
    sizes: ExpandedSizes,
    everywhere: bool,
    walk_options: WalkOptions,
    known: HashMap<PartKey, Known<'a>>,
    /// For each part that is being recorded, whether it is so small that nothing inside is recorded
    /// by itself.
    open: Vec<bool>,
    /// The memory of walks that have ended.
    scratch: Vec<Scratch>,
    /// Whether what is being recorded depends on its place.
    spoiled: bool,
    visits: u64,
    most_visits: u64,
}

impl<'a> Prototypes<'a> {
    /// Returns a scene without prototypes so far, or `None` if it is to be expanded.
    pub(in crate::scene) fn new(
        snapshot: &'a Snapshot<'_>,
        options: &CompileOptions,
        walk_options: &WalkOptions,
    ) -> Option<Self> {
        let document = snapshot.document();
        let sizes = ExpandedSizes::new(document)?;
        let everywhere = options.instancing == Instancing::Everywhere;
        (everywhere || sizes.pays(&options.limits)).then(|| Self {
            snapshot,
            sizes,
            everywhere,
            walk_options: walk_options.clone(),
            known: HashMap::new(),
            open: Vec::new(),
            scratch: Vec::new(),
            spoiled: false,
            visits: 0,
            most_visits: walk_options.most_visits(document),
        })
    }

    /// Whether the walk is to end: what is being recorded depends on its place, or all walks
    /// together have visited too many nodes.
    pub(in crate::scene) fn is_full(&self) -> bool {
        self.spoiled || self.visits >= self.most_visits.saturating_mul(4)
    }

    /// Notes that what is being recorded depends on its place.
    fn spoil(&mut self) {
        self.spoiled = !self.open.is_empty();
    }

    /// Begins a node. Returns a warning if all walks together have visited too many nodes.
    pub(in crate::scene) fn begin_node(
        &mut self,
        node: NodeRef<'_>,
        role: Role,
    ) -> Option<Box<Diagnostic>> {
        if depends_on_place(node, role) {
            self.spoil();
        }
        self.visits += 1;
        (self.visits == self.most_visits.saturating_mul(4)).then(|| {
            let most = self.most_visits;
            let message =
                format!("the scene has more than {most} nodes to walk; the rest is left out");
            let help = "its parts are used in too many ways; `--scene-limit visits=N` raises this";
            Diagnostic::warning(message).with_help(help)
        })
    }

    fn known(&mut self, key: PartKey, state: &State<'a>) -> Option<&mut Outcome> {
        let known = self.known.get_mut(&key)?.iter_mut();
        let mut known = known.filter(|(before, _)| before.is_like(state));
        known.next().map(|(_, outcome)| outcome)
    }

    /// Returns what became of a part in a state, or `None` if it is to be recorded.
    pub(super) fn find(&mut self, part: Instance<'a>, state: &State<'a>) -> Option<Outcome> {
        let key = key(part);
        let is_inside_small = !self.everywhere && self.open.last() == Some(&true);
        let is_empty = part.grid().is_some_and(|grid| grid.is_empty());
        let is_repeated = key.1 || self.sizes.is_repeated(key.0);
        if self.spoiled || is_inside_small || is_empty || !is_repeated {
            return Some(Outcome::Expanded);
        }
        if let Some(outcome) = self.known(key, state).copied() {
            if matches!(outcome, Outcome::Open) {
                self.spoil(); // the part contains itself
            }
            return Some(outcome);
        }
        if self.open.len() >= DEEPEST {
            self.spoil();
            return Some(Outcome::Expanded);
        }
        let states = self.known.get(&key).map_or(0, Vec::len);
        (states >= MOST_STATES).then_some(Outcome::Expanded)
    }

    /// Begins to record a part. Returns the state in which its walk begins, and what it needs.
    pub(super) fn begin(
        &mut self,
        part: Instance<'a>,
        state: &State<'a>,
    ) -> (State<'a>, PartWalk<'a>) {
        let key = key(part);
        let mut inner = state.clone();
        inner.steps.get_or_insert_with(Step::start);
        let known = self.known.entry(key).or_default();
        known.push((Box::new(inner.clone()), Outcome::Open));
        self.open.push(self.sizes.is_small(key.0));
        let scratch = self.scratch.pop();
        let walk = PartWalk {
            snapshot: self.snapshot,
            options: self.walk_options.clone(),
            scratch: scratch.unwrap_or_else(|| Scratch::new(self.snapshot.document())),
        };
        (inner, walk)
    }

    /// Ends the walk of a recording. Returns whether the recording was spoiled.
    pub(super) fn end(&mut self, walk: PartWalk<'a>) -> bool {
        self.scratch.push(walk.scratch);
        self.open.pop();
        std::mem::take(&mut self.spoiled)
    }

    /// Remembers the number of a part's prototype, or that it has none. Returns the outcome.
    pub(super) fn keep(
        &mut self,
        part: Instance<'a>,
        state: &State<'a>,
        number: Option<u32>,
    ) -> Outcome {
        let outcome = number.map_or(Outcome::Expanded, Outcome::Prototype);
        if let Some(known) = self.known(key(part), state) {
            *known = outcome;
        }
        outcome
    }
}

/// Whether what a node does depends on its place in the world, on the camera or on the rest of the
/// scene, or has effects outside the part that contains it.
fn depends_on_place(node: NodeRef<'_>, role: Role) -> bool {
    const CLASSES: [ClassId; 12] = [
        class::RESET_TRANSFORM,
        class::ANTI_SQUISH,
        class::SURROUND_SCALE,
        class::CLIP_PLANE,
        class::X3D_CLIP_PLANE,
        class::LOCAL_FOG,
        class::VRML97_LOCAL_FOG,
        class::TEXT2,
        class::TEXT2_SET,
        class::IMAGE,
        class::MARKER_SET,
        class::INDEXED_MARKER_SET,
    ];
    match role {
        Role::Light
        | Role::Camera
        | Role::Bindable
        | Role::Billboard
        | Role::Lod
        | Role::LevelOfDetail
        | Role::PathSwitch
        | Role::Kit
        | Role::ListPart => true,
        Role::Switch => {
            let vrml97 = node.find(vrml97_switch_node::WHICH_CHOICE);
            vrml97.unwrap_or_else(|| node.get(switch_node::WHICH_CHILD)) == -2
        }
        Role::Property | Role::Shape => node.known_class().is_some_and(|known| {
            let mut lineage = known.lineage();
            lineage.any(|class| CLASSES.contains(&class.id))
        }),
        _ => false,
    }
}
