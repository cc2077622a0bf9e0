//! Stores the parts of a scene once that are drawn many times.
//!
//! At the first use of a shared part, a walk of its own records the part as a prototype: its shapes
//! stay in their object space. If the part turns out to depend on its place, the camera or the rest
//! of the scene, the recording is spoiled, and the part is expanded wherever it is used.

use std::collections::HashMap;
use std::sync::Arc;

use glam::{DMat4, DVec3};

use super::scene_builder::{Owners, SceneBuilder};
use super::sharing::Sharing;
use super::walk::Compiler;
use crate::diag::Diagnostic;
use crate::geometry::quadric::exact_bounds;
use crate::geometry::{Quadric, Stroke};
use crate::grammar::{ClassId, class, switch_node, vrml97_switch_node};
use crate::iv::{NodeId, NodeRef};
use crate::scene::census::{Census, InstanceCounts};
use crate::scene::instances::{
    Content, Extent, Instances, Prototype, ShapePrimitives, around, product,
};
use crate::scene::options::{CompileOptions, Instancing};
use crate::scene::render_scene::RenderScene;
use crate::snapshot::Snapshot;
use crate::traversal::role::Role;
use crate::traversal::{Grid, Repeated, Scratch, State, Step, WalkOptions, walk_part};

/// The largest number of different states for which a part is recorded. More would be rare, and
/// each state is compared with those before.
const MOST_STATES: usize = 16;
/// The largest number of recordings inside each other, which bounds the stack.
const DEEPEST: usize = 32;

/// What became of the recording of a part.
#[derive(Clone, Copy)]
enum Outcome {
    /// It is being recorded.
    Open,
    /// It is the prototype with this number.
    Recorded(u32),
    /// It cannot be recorded.
    Expanded,
}

/// The outcomes of a part by the state in which it was drawn.
type Known<'a> = Vec<(Box<State<'a>>, Outcome)>;

/// A prototype that is being recorded. The first one is the scene itself.
struct Recording {
    contents: Prototype,
    /// The step at which the part began.
    entry: Arc<Step>,
    /// Whether the part is so small that nothing inside is recorded by itself.
    is_small: bool,
}

/// The primitives of prototypes while those of the scene are compiled, and the reverse.
#[derive(Default)]
struct Primitives {
    triangles: Vec<[glam::Vec3; 3]>,
    quadrics: Vec<Quadric>,
    strokes: Vec<Stroke>,
    owners: Owners,
}

/// The numbers of surfaces and primitives at some time.
#[derive(Clone, Copy)]
pub(super) struct Lengths {
    surfaces: usize,
    triangles: usize,
    quadrics: usize,
    strokes: usize,
}

/// What is known of the parts that are drawn many times.
pub(super) struct Repeats<'a> {
    sharing: Sharing,
    everywhere: bool,
    walk_options: WalkOptions,
    /// The outcomes for each part, by the state in which it was drawn. The second half of the key
    /// is whether the part is the children of the node.
    known: HashMap<(NodeId, bool), Known<'a>>,
    recordings: Vec<Recording>,
    instances: Box<Instances>,
    /// The counts of each prototype.
    censuses: Vec<Census>,
    other: Primitives,
    scratch: Vec<Scratch>,
    /// The node that begins a recording, until the walk enters it.
    entering: Option<NodeId>,
    /// Whether there were too many recordings inside each other. All are then given up, and the
    /// scene is expanded by one more level.
    too_deep: bool,
    visits: u64,
    most_visits: u64,
}

impl<'a> Repeats<'a> {
    /// Returns what is needed to store parts once, or `None` if the scene is to be expanded.
    pub(super) fn of(
        snapshot: &Snapshot<'_>,
        options: &CompileOptions,
        walk_options: &WalkOptions,
    ) -> Option<Self> {
        let document = snapshot.document();
        let sharing = Sharing::of(document)?;
        let everywhere = options.instancing == Instancing::Everywhere;
        let most = walk_options.most_visits(document);
        if !everywhere && !sharing.exceeds(most, options.max_primitives as u64) {
            return None;
        }
        Some(Self {
            sharing,
            everywhere,
            walk_options: walk_options.clone(),
            known: HashMap::new(),
            recordings: vec![Recording {
                contents: Prototype::default(),
                entry: Step::start(),
                is_small: false,
            }],
            instances: Box::new(Instances::new(options.origin)),
            censuses: Vec::new(),
            other: Primitives::default(),
            scratch: Vec::new(),
            entering: None,
            too_deep: false,
            visits: 0,
            most_visits: most.saturating_mul(4),
        })
    }

    /// Whether a part is being recorded.
    fn is_recording(&self) -> bool {
        self.recordings.len() > 1
    }

    /// Returns the outcome of a part in a state, if there is one.
    fn outcome(&mut self, key: (NodeId, bool), state: &State<'a>) -> Option<&mut Outcome> {
        let known = self.known.get_mut(&key)?;
        let known = known.iter_mut().find(|(before, _)| before.is_like(state));
        known.map(|(_, outcome)| outcome)
    }

    /// Moves the instances to the scene, if it has any.
    pub(super) fn finish(mut self, scene: &mut RenderScene) {
        let Some(root) = self.recordings.pop() else {
            return;
        };
        if root.contents.len() == 0 {
            return;
        }
        let mut instances = self.instances;
        instances.root = root.contents;
        let mut owners = self.other.owners;
        instances.triangles = self.other.triangles;
        instances.quadrics = self.other.quadrics;
        instances.owners = owners.triangles;
        instances.owners.append(&mut owners.quadrics);
        let extent = &instances.root.extent;
        scene.census.instances = InstanceCounts {
            parts: instances.prototypes.len() as u64,
            uses: extent.uses,
            primitives: extent.count,
        };
        scene.instances = Some(instances);
    }
}

impl SceneBuilder {
    /// The numbers of surfaces and primitives.
    pub(super) fn lengths(&self) -> Lengths {
        Lengths {
            surfaces: self.scene.surfaces.len(),
            triangles: self.scene.triangles.len(),
            quadrics: self.scene.quadrics.len(),
            strokes: self.scene.strokes.len(),
        }
    }

    /// Removes what was added since.
    fn truncate(&mut self, lengths: Lengths) {
        self.scene.surfaces.truncate(lengths.surfaces);
        self.scene.triangles.truncate(lengths.triangles);
        self.scene.quadrics.truncate(lengths.quadrics);
        self.scene.strokes.truncate(lengths.strokes);
        self.owners.triangles.truncate(lengths.triangles);
        self.owners.quadrics.truncate(lengths.quadrics);
        self.owners.strokes.truncate(lengths.strokes);
    }

    /// Exchanges the lists of primitives, before or after a recording.
    fn exchange(&mut self, other: &mut Primitives) {
        use std::mem::swap;
        let before = self.lengths();
        swap(&mut self.scene.triangles, &mut other.triangles);
        swap(&mut self.scene.quadrics, &mut other.quadrics);
        swap(&mut self.scene.strokes, &mut other.strokes);
        swap(&mut self.owners, &mut other.owners);
        let total = |n: Lengths| n.triangles + n.quadrics + n.strokes;
        self.elsewhere = self.elsewhere + total(before) - total(self.lengths());
    }
}

impl<'a> Compiler<'a> {
    /// Begins a node. Returns whether it is to be counted; the first node of a recording was
    /// counted before.
    pub(super) fn begin_node(&mut self, node: NodeRef<'a>, role: Role) -> bool {
        let Some(repeats) = &mut self.repeats else {
            return true;
        };
        repeats.visits += 1;
        if repeats.visits == repeats.most_visits {
            self.builder.over_limit = true;
            let most = repeats.most_visits / 4;
            let message = "the scene has more than";
            let message = format!("{message} {most} nodes to walk; the rest is left out");
            let help = "its parts are used in too many ways; `--scene-limit visits=N` raises this";
            let warning = Diagnostic::warning(message).with_help(help);
            self.builder.reports.add(*warning);
        }
        if repeats.is_recording() && depends_on_place(node, role) {
            self.builder.spoiled = true;
        }
        repeats.entering != Some(node.id)
    }

    /// Records the primitives of a shape that was just drawn. `before` are the lengths before it.
    pub(super) fn end_shape(&mut self, before: Lengths, state: &State<'a>) {
        let Some(repeats) = &mut self.repeats else {
            return;
        };
        let builder = &mut self.builder;
        let after = builder.lengths();
        if after.surfaces == before.surfaces || builder.spoiled {
            return;
        }
        let range = |from: usize, to: usize| from as u32..to as u32;
        let mut shape = ShapePrimitives {
            first: 0,
            triangles: range(before.triangles, after.triangles),
            quadrics: range(before.quadrics, after.quadrics),
            strokes: range(before.strokes, after.strokes),
        };
        let is_recording = repeats.is_recording();
        let Some(recording) = repeats.recordings.last_mut() else {
            return;
        };
        let fits = if shape.len() == 0 {
            Some(())
        } else if is_recording {
            let steps = state.steps.as_ref();
            let matrices = steps.and_then(|steps| steps.since(&recording.entry));
            matrices.and_then(|matrices| {
                let bounds = bounds(&builder.scene, &shape, &matrices);
                let extent = Extent::of_shape(shape.len(), bounds, &matrices)?;
                let surface = before.surfaces as u32;
                let content = Content::Shape { surface };
                recording.contents.add(content, &matrices, &extent)
            })
        } else {
            let first = recording.contents.skip(shape.len());
            first.map(|first| shape.first = first)
        };
        let shapes = &mut repeats.instances.shapes;
        shapes.resize(after.surfaces, ShapePrimitives::default());
        shapes[before.surfaces] = shape;
        if fits.is_none() {
            self.does_not_fit();
        }
    }

    /// Draws a part as a use of a prototype, which is recorded at the first use. Returns `false` if
    /// the part is to be expanded.
    pub(super) fn repeat(&mut self, part: Repeated<'a>, state: &State<'a>) -> bool {
        let Some(repeats) = &mut self.repeats else {
            return false;
        };
        let (node, is_children, grid) = match part {
            Repeated::Node(node) => (node, false, None),
            Repeated::Copy(node) => (node, true, None),
            Repeated::Grid(node, grid) => (node, true, Some(grid)),
        };
        if !is_children && repeats.entering.take_if(|id| *id == node.id).is_some() {
            return false;
        }
        let is_inside_small = repeats.recordings.last().is_some_and(|r| r.is_small);
        let is_candidate = is_children || repeats.sharing.is_shared(node.id);
        if self.builder.spoiled
            || is_inside_small && !repeats.everywhere
            || !is_candidate
            || grid.is_some_and(|grid| grid.len() == 0)
        {
            return false;
        }
        let key = (node.id, is_children);
        let outcome = match repeats.outcome(key, state) {
            Some(outcome) => *outcome,
            None => self.record(part, key, state),
        };
        match outcome {
            Outcome::Recorded(number) => self.draw(number, grid, state),
            Outcome::Expanded => false,
            Outcome::Open => {
                self.builder.spoiled = true; // the part contains itself
                false
            }
        }
    }

    /// Records a part.
    fn record(&mut self, part: Repeated<'a>, key: (NodeId, bool), state: &State<'a>) -> Outcome {
        let Some(repeats) = &mut self.repeats else {
            return Outcome::Expanded;
        };
        let known = repeats.known.entry(key).or_default();
        if known.len() >= MOST_STATES {
            return Outcome::Expanded;
        }
        if repeats.recordings.len() > DEEPEST {
            repeats.too_deep = true;
            self.builder.spoiled = true;
            return Outcome::Expanded;
        }
        let mut inner = state.clone();
        let entry = inner.steps.get_or_insert_with(Step::start).clone();
        known.push((Box::new(inner.clone()), Outcome::Open));
        self.builder.assign_surface();
        if !repeats.is_recording() {
            self.builder.exchange(&mut repeats.other);
            self.builder.is_recording = true;
        }
        let (lengths, parts) = (self.builder.lengths(), repeats.censuses.len());
        let counts = std::mem::take(&mut self.builder.scene.census);
        repeats.recordings.push(Recording {
            contents: Prototype::default(),
            entry,
            is_small: repeats.sharing.is_small(key.0),
        });
        repeats.entering = (!key.1).then_some(key.0);
        let options = repeats.walk_options.clone();
        let scratch = repeats.scratch.pop();
        let mut scratch = scratch.unwrap_or_else(|| Scratch::new(self.snapshot.document()));
        walk_part(self.snapshot, part, inner, (&options, &mut scratch), self);
        self.end_recording((lengths, parts), counts, scratch, (key, state))
    }

    /// Keeps what was recorded as a prototype, or drops it if it was spoiled.
    fn end_recording(
        &mut self,
        (lengths, parts): (Lengths, usize),
        counts: Census,
        scratch: Scratch,
        (key, state): ((NodeId, bool), &State<'a>),
    ) -> Outcome {
        let Some(repeats) = &mut self.repeats else {
            return Outcome::Expanded;
        };
        let builder = &mut self.builder;
        builder.assign_surface();
        repeats.scratch.push(scratch);
        repeats.entering = None;
        let recording = repeats.recordings.pop();
        let is_spoiled = std::mem::take(&mut builder.spoiled);
        let recording =
            recording.filter(|r| !is_spoiled && r.contents.extent.depth < Extent::DEEPEST);
        let own = std::mem::replace(&mut builder.scene.census, counts);
        let outcome = match recording {
            Some(recording) => {
                builder.scene.census.add_kept(&own);
                repeats.instances.prototypes.push(recording.contents);
                repeats.censuses.push(own);
                Outcome::Recorded(repeats.censuses.len() as u32 - 1)
            }
            None => {
                builder.scene.census.textures += own.textures;
                // Prototypes that were recorded inside keep their primitives.
                if repeats.censuses.len() == parts {
                    builder.truncate(lengths);
                    repeats.instances.shapes.truncate(lengths.surfaces);
                }
                Outcome::Expanded
            }
        };
        if !repeats.is_recording() {
            builder.exchange(&mut repeats.other);
            builder.is_recording = false;
        }
        if repeats.too_deep && repeats.is_recording() {
            builder.spoiled = true;
            if let Some(known) = repeats.known.get_mut(&key) {
                known.retain(|(_, outcome)| !matches!(outcome, Outcome::Open));
            }
        } else if let Some(known) = repeats.outcome(key, state) {
            *known = outcome;
            repeats.too_deep = false;
        }
        outcome
    }

    /// Draws a prototype once or on a grid. Returns `false` if it is to be expanded here.
    fn draw(&mut self, number: u32, grid: Option<Grid>, state: &State<'a>) -> bool {
        let Some(repeats) = &mut self.repeats else {
            return false;
        };
        let (is_recording, instances) = (repeats.is_recording(), &mut repeats.instances);
        let Some(recording) = repeats.recordings.last_mut() else {
            return false;
        };
        let times = grid.map_or(1, |grid| grid.len());
        if !instances.prototypes[number as usize].extent.is_empty() {
            let matrices = if is_recording {
                let steps = state.steps.as_ref();
                steps.and_then(|steps| steps.since(&recording.entry))
            } else {
                Some(vec![state.world_from_object])
            };
            let content = match grid {
                None => Content::Prototype { number },
                Some(grid) => {
                    instances.grids.push(grid);
                    let grid = instances.grids.len() as u32 - 1;
                    Content::Grid { number, grid }
                }
            };
            let placed = matrices.and_then(|matrices| {
                let extent = instances.extent(content)?.under(&matrices)?;
                Some((extent, matrices))
            });
            let origin = self.builder.options.origin;
            let reaches = |extent: &Extent| is_recording || extent.is_in_reach(origin);
            let Some((extent, matrices)) = placed.filter(|(extent, _)| reaches(extent)) else {
                return false;
            };
            let bytes = 64 + size_of_val(&matrices[..]);
            if self.builder.is_at_limit(bytes) {
                return true;
            }
            if recording
                .contents
                .add(content, &matrices, &extent)
                .is_none()
            {
                self.does_not_fit();
                return true;
            }
            self.builder.elsewhere += 1;
        }
        let part = &repeats.censuses[number as usize];
        self.builder.scene.census.add_drawn(part, times);
        true
    }

    /// Spoils the recording, or reports that the scene is too large.
    fn does_not_fit(&mut self) {
        let builder = &mut self.builder;
        if builder.is_recording {
            builder.spoiled = true;
        } else if !builder.over_limit {
            builder.over_limit = true;
            let message = "the scene draws more than 2^60 primitives; the rest is left out";
            let help = "arrays or shared parts inside each other multiply; use fewer of them";
            let warning = Diagnostic::warning(message.to_owned()).with_help(help);
            builder.reports.add(*warning);
        }
    }
}

/// The box around a shape's primitives under matrices.
fn bounds(scene: &RenderScene, shape: &ShapePrimitives, matrices: &[DMat4]) -> (DVec3, DVec3) {
    let matrix = product(matrices);
    let triangles = shape.triangles.start as usize..shape.triangles.end as usize;
    let quadrics = shape.quadrics.start as usize..shape.quadrics.end as usize;
    let triangles = scene.triangles[triangles].iter();
    let quadrics = scene.quadrics[quadrics].iter();
    let all = triangles.map(|corners| around(corners, &matrix));
    let all = all.chain(quadrics.map(|quadric| exact_bounds(quadric.kind, &matrix)));
    all.fold(Extent::NONE.bounds, |a, b| (a.0.min(b.0), a.1.max(b.1)))
}

/// Whether what a node does depends on its place in the world, on the camera or on the rest of the
/// scene, or has effects outside the part that contains it.
fn depends_on_place(node: NodeRef<'_>, role: Role) -> bool {
    const CLASSES: [ClassId; 9] = [
        class::RESET_TRANSFORM,
        class::ANTI_SQUISH,
        class::SURROUND_SCALE,
        class::CLIP_PLANE,
        class::LOCAL_FOG,
        class::VRML97_LOCAL_FOG,
        class::TEXT2,
        class::TEXT2_SET,
        class::IMAGE,
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
