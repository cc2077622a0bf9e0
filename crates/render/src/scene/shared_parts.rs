//! Finds the parts of a scene that are drawn many times, and remembers what became of them.
//!
//! A visitor of a walk records a part at its first use by a walk of its own, and uses the record
//! whenever the part is drawn again in the same state. If the part turns out to depend on its
//! place, the camera or the rest of the scene, the recording is spoiled, and the part is expanded
//! wherever it is used.

use std::collections::HashMap;

use ivcam_base::diag::Diagnostic;
use ivcam_inventor::grammar::{ClassId, class, switch_node, vrml97_switch_node};
use ivcam_inventor::iv::Limits;
use ivcam_inventor::iv::{NodeId, NodeRef};
use ivcam_inventor::snapshot::Snapshot;
use ivcam_inventor::traversal::role::Role;
use ivcam_inventor::traversal::{Repeated, Scratch, State, Step, Visitor, WalkOptions, walk_part};

use super::options::{CompileOptions, Instancing};
use super::sharing::Sharing;

/// The largest number of different states for which a part is recorded. More would be rare, and
/// each state is compared with those before.
const MOST_STATES: usize = 16;
/// The largest number of recordings inside each other, which bounds the stack.
const DEEPEST: usize = 32;

/// How far the recording of a part in one state has come.
#[derive(Clone, Copy)]
pub(super) enum Outcome {
    /// The part has not been drawn in this state before.
    New,
    /// The part is being recorded.
    Open,
    /// The part is recorded under this number.
    Recorded(u32),
    /// The part is expanded at each use.
    Expanded,
}

/// A part: a node, and whether only its children are meant.
type PartKey = (NodeId, bool);

/// The outcomes of a part by the state in which it was drawn.
type Known<'a> = Vec<(Box<State<'a>>, Outcome)>;

fn key(part: Repeated<'_>) -> PartKey {
    match part {
        Repeated::Node(node) => (node.id, false),
        Repeated::Copy(node) | Repeated::Grid(node, _) => (node.id, true),
    }
}

/// The parts of a scene that are drawn many times.
pub(super) struct SharedParts<'a> {
    sharing: Sharing,
    everywhere: bool,
    walk_options: WalkOptions,
    known: HashMap<PartKey, Known<'a>>,
    /// For each part that is being recorded, whether it is so small that nothing inside is recorded
    /// by itself.
    open: Vec<bool>,
    scratch: Vec<Scratch>,
    /// The node that begins a recording, until the walk enters it.
    entering: Option<NodeId>,
    /// Whether what is being recorded depends on its place.
    spoiled: bool,
    /// Whether there were too many recordings inside each other. All are then given up, and the
    /// scene is expanded by one more level.
    too_deep: bool,
    visits: u64,
    most_visits: u64,
}

impl<'a> SharedParts<'a> {
    /// Returns the parts of a scene, or `None` if the scene is to be expanded.
    pub(super) fn of(
        snapshot: &Snapshot<'_>,
        options: &CompileOptions,
        walk_options: &WalkOptions,
    ) -> Option<Self> {
        let document = snapshot.document();
        let sharing = Sharing::of(document)?;
        let everywhere = options.instancing == Instancing::Everywhere;
        let most = walk_options.most_visits(document);
        // Higher limits of the user do not make a scene expand that is shared without them.
        let usual = WalkOptions::default().most_visits(document);
        let primitives = options.limits.primitives.min(Limits::default().primitives);
        let exceeds = sharing.exceeds(most.min(usual), primitives as u64);
        let exceeds = exceeds || sharing.has_long_text();
        (everywhere || exceeds).then(|| Self {
            sharing,
            everywhere,
            walk_options: walk_options.clone(),
            known: HashMap::new(),
            open: Vec::new(),
            scratch: Vec::new(),
            entering: None,
            spoiled: false,
            too_deep: false,
            visits: 0,
            most_visits: most.saturating_mul(4),
        })
    }

    /// Whether a part is being recorded.
    pub(super) fn is_recording(&self) -> bool {
        !self.open.is_empty()
    }

    /// Whether what is being recorded depends on its place.
    pub(super) fn is_spoiled(&self) -> bool {
        self.spoiled
    }

    /// Notes that what is being recorded depends on its place.
    pub(super) fn spoil(&mut self) {
        self.spoiled = self.is_recording();
    }

    /// Begins a node. Returns a warning if all walks together have visited too many nodes.
    pub(super) fn begin_node(&mut self, node: NodeRef<'_>, role: Role) -> Option<Box<Diagnostic>> {
        if depends_on_place(node, role) {
            self.spoil();
        }
        self.visits += 1;
        (self.visits == self.most_visits).then(|| {
            let most = self.most_visits / 4;
            let message =
                format!("the scene has more than {most} nodes to walk; the rest is left out");
            let help = "its parts are used in too many ways; `--scene-limit visits=N` raises this";
            Diagnostic::warning(message).with_help(help)
        })
    }

    /// Whether all walks together have visited too many nodes.
    pub(super) fn is_beyond(&self) -> bool {
        self.visits >= self.most_visits
    }

    /// Whether a node begins a recording. It was counted before.
    pub(super) fn is_entering(&self, node: NodeRef<'_>) -> bool {
        self.entering == Some(node.id)
    }

    fn known(&mut self, key: PartKey, state: &State<'a>) -> Option<&mut Outcome> {
        let known = self.known.get_mut(&key)?.iter_mut();
        let mut known = known.filter(|(before, _)| before.is_like(state));
        known.next().map(|(_, outcome)| outcome)
    }

    /// Returns what became of a part in a state.
    pub(super) fn find(&mut self, part: Repeated<'a>, state: &State<'a>) -> Outcome {
        let (id, is_children) = key(part);
        if !is_children && self.entering.take_if(|node| *node == id).is_some() {
            return Outcome::Expanded;
        }
        let is_inside_small = !self.everywhere && self.open.last() == Some(&true);
        let is_empty = matches!(part, Repeated::Grid(_, grid) if grid.is_empty());
        let is_candidate = is_children || self.sharing.is_shared(id);
        if self.spoiled || is_inside_small || is_empty || !is_candidate {
            return Outcome::Expanded;
        }
        if let Some(outcome) = self.known((id, is_children), state) {
            let outcome = *outcome;
            if matches!(outcome, Outcome::Open) {
                self.spoil(); // the part contains itself
            }
            return outcome;
        }
        if self.open.len() >= DEEPEST {
            self.too_deep = true;
            self.spoil();
            return Outcome::Expanded;
        }
        let states = self.known.get(&(id, is_children)).map_or(0, Vec::len);
        if states < MOST_STATES {
            Outcome::New
        } else {
            Outcome::Expanded
        }
    }

    /// Begins to record a part, and returns the state for the walk.
    pub(super) fn begin(&mut self, part: Repeated<'a>, state: &State<'a>) -> State<'a> {
        let key = key(part);
        let mut inner = state.clone();
        inner.steps.get_or_insert_with(Step::start);
        let known = self.known.entry(key).or_default();
        known.push((Box::new(inner.clone()), Outcome::Open));
        self.open.push(self.sharing.is_small(key.0));
        self.entering = (!key.1).then_some(key.0);
        inner
    }

    /// Ends a recording. Returns whether it was spoiled.
    pub(super) fn end(&mut self) -> bool {
        self.open.pop();
        self.entering = None;
        std::mem::take(&mut self.spoiled)
    }

    /// Remembers the number of a part's record, or that it has none. Returns the outcome.
    pub(super) fn keep(
        &mut self,
        part: Repeated<'a>,
        state: &State<'a>,
        record: Option<u32>,
    ) -> Outcome {
        let outcome = record.map_or(Outcome::Expanded, Outcome::Recorded);
        if self.too_deep && self.is_recording() {
            self.spoil();
            if let Some(known) = self.known.get_mut(&key(part)) {
                known.retain(|(_, outcome)| !matches!(outcome, Outcome::Open));
            }
        } else if let Some(known) = self.known(key(part), state) {
            *known = outcome;
            self.too_deep = false;
        }
        outcome
    }

    /// Takes what a walk of a part needs.
    fn walk_memory(&mut self, snapshot: &Snapshot<'_>) -> (WalkOptions, Scratch) {
        let scratch = self.scratch.pop();
        let scratch = scratch.unwrap_or_else(|| Scratch::new(snapshot.document()));
        (self.walk_options.clone(), scratch)
    }
}

/// A visitor that records shared parts.
pub(super) trait RecordsParts<'a>: Visitor<'a> {
    /// The parts, if the scene is not to be expanded.
    fn parts(&mut self) -> Option<&mut SharedParts<'a>>;
}

/// Walks a part for a recording, with the state that [`SharedParts::begin`] returned.
pub(super) fn walk_recorded<'a, V: RecordsParts<'a>>(
    snapshot: &'a Snapshot<'_>,
    part: Repeated<'a>,
    inner: State<'a>,
    visitor: &mut V,
) {
    let memory = visitor.parts().map(|parts| parts.walk_memory(snapshot));
    if let Some((options, mut scratch)) = memory {
        walk_part(snapshot, part, inner, (&options, &mut scratch), visitor);
        if let Some(parts) = visitor.parts() {
            parts.scratch.push(scratch);
        }
    }
}

/// Whether what a node does depends on its place in the world, on the camera or on the rest of the
/// scene, or has effects outside the part that contains it.
fn depends_on_place(node: NodeRef<'_>, role: Role) -> bool {
    const CLASSES: [ClassId; 11] = [
        class::RESET_TRANSFORM,
        class::ANTI_SQUISH,
        class::SURROUND_SCALE,
        class::CLIP_PLANE,
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
