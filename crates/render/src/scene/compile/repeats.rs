//! Stores the parts of a scene once that are drawn many times.
//!
//! A recorded part is a prototype, whose shapes stay in their object space.

use std::sync::Arc;

use glam::DMat4;
use ivcam_base::diag::Diagnostic;
use ivcam_inventor::iv::NodeRef;
use ivcam_inventor::snapshot::Snapshot;
use ivcam_inventor::traversal::role::Role;
use ivcam_inventor::traversal::{Grid, Repeated, State, Step, WalkOptions};

use super::glyphs::StoredGlyphs;
use super::scene_builder::SceneBuilder;
use super::walk::Compiler;
use crate::scene::census::{Census, InstanceCounts};
use crate::scene::instances::{Content, Extent, Instances, Prototype, ShapePrimitives, product};
use crate::scene::options::CompileOptions;
use crate::scene::render_scene::RenderScene;
use crate::scene::shared_parts::{Outcome, RecordsParts, SharedParts, walk_recorded};

/// A prototype that is being recorded. The first one is the scene itself.
pub(super) struct Recording {
    pub contents: Prototype,
    /// The step at which the part began.
    entry: Arc<Step>,
}

impl Recording {
    /// Begins a recording at a step.
    pub(super) fn new(entry: Arc<Step>) -> Self {
        Self {
            contents: Prototype::default(),
            entry,
        }
    }
}

/// The numbers of surfaces and primitives at some time.
#[derive(Clone, Copy)]
pub(super) struct Lengths {
    surfaces: usize,
    triangles: usize,
    quadrics: usize,
    strokes: usize,
}

/// The prototypes of a scene that is being compiled.
pub(super) struct Repeats<'a> {
    parts: SharedParts<'a>,
    pub recordings: Vec<Recording>,
    pub instances: Box<Instances>,
    /// The counts of each prototype.
    pub censuses: Vec<Census>,
    /// The glyphs of texts.
    pub glyphs: StoredGlyphs,
}

impl<'a> Repeats<'a> {
    /// Returns what is needed to store parts once, or `None` if the scene is to be expanded.
    pub(super) fn of(
        snapshot: &Snapshot<'_>,
        options: &CompileOptions,
        walk_options: &WalkOptions,
    ) -> Option<Self> {
        let parts = SharedParts::of(snapshot, options, walk_options)?;
        Some(Self {
            parts,
            recordings: vec![Recording::new(Step::start())],
            instances: Box::new(Instances::new(options.origin)),
            censuses: Vec::new(),
            glyphs: StoredGlyphs::default(),
        })
    }

    /// Moves the instances to the scene, if it has any.
    pub(super) fn finish(mut self, scene: &mut RenderScene) {
        let Some(root) = self.recordings.pop() else {
            return;
        };
        let mut instances = self.instances;
        if instances.prototypes.is_empty() {
            return;
        }
        instances.root = root.contents;
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
}

impl<'a> RecordsParts<'a> for Compiler<'a> {
    fn parts(&mut self) -> Option<&mut SharedParts<'a>> {
        self.repeats.as_mut().map(|repeats| &mut repeats.parts)
    }
}

impl<'a> Compiler<'a> {
    /// Begins a node. Returns whether it is to be counted; the first node of a recording was
    /// counted before.
    pub(super) fn begin_node(&mut self, node: NodeRef<'a>, role: Role) -> bool {
        let Some(repeats) = &mut self.repeats else {
            return true;
        };
        let is_counted = !repeats.parts.is_entering(node);
        if let Some(warning) = repeats.parts.begin_node(node, role) {
            self.builder.over_limit = true;
            self.builder.reports.add(*warning);
        }
        is_counted
    }

    /// Whether the walk of a recording is to end, because it is spoiled.
    pub(super) fn is_spoiled(&self) -> bool {
        let repeats = self.repeats.as_ref();
        self.builder.spoiled || repeats.is_some_and(|r| r.parts.is_spoiled())
    }

    /// Records the primitives of a shape that was just drawn. `before` are the lengths before it.
    pub(super) fn end_shape(&mut self, before: Lengths, state: &State<'a>) {
        let matrices = self.matrices(state);
        self.keep_shape(before, matrices);
    }

    /// Returns the matrices from the part that is being recorded to the current object space.
    pub(super) fn matrices(&self, state: &State<'a>) -> Option<Vec<DMat4>> {
        let recording = self.repeats.as_ref()?.recordings.last()?;
        state.steps.as_ref()?.since(&recording.entry)
    }

    /// Adds the primitives since some lengths to what is being recorded, as one shape. `matrices`
    /// lead to its object space, or are `None` if it cannot be placed later.
    pub(super) fn keep_shape(&mut self, before: Lengths, matrices: Option<Vec<DMat4>>) {
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
            first: None,
            triangles: range(before.triangles, after.triangles),
            quadrics: range(before.quadrics, after.quadrics),
            strokes: range(before.strokes, after.strokes),
        };
        let is_recording = builder.is_recording;
        let Some(recording) = repeats.recordings.last_mut() else {
            return;
        };
        let fits = if shape.len() == 0 {
            Some(())
        } else if is_recording {
            matrices.and_then(|matrices| {
                let (lists, matrix) = (builder.scene.lists(), product(&matrices));
                let boxes = lists.numbers(&shape).map(|n| lists.around(n, &matrix));
                let none = Extent::NONE.bounds;
                let bounds = boxes.fold(none, |a, b| (a.0.min(b.0), a.1.max(b.1)));
                let extent = Extent::of_shape(shape.len(), bounds, &matrices)?;
                let surface = before.surfaces as u32;
                let content = Content::Shape { surface };
                recording.contents.add(content, &matrices, &extent)
            })
        } else {
            let first = recording.contents.skip(shape.len());
            first.map(|first| shape.first = Some(first))
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
        let outcome = match repeats.parts.find(part, state) {
            Outcome::New => self.record(part, state),
            outcome => outcome,
        };
        match outcome {
            Outcome::Recorded(number) => {
                let grid = match part {
                    Repeated::Grid(_, grid) => Some(grid),
                    _ => None,
                };
                let matrices = if self.builder.is_recording {
                    self.matrices(state)
                } else {
                    Some(vec![state.world_from_object])
                };
                self.draw(number, grid, matrices)
            }
            _ => false,
        }
    }

    /// Records a part.
    fn record(&mut self, part: Repeated<'a>, state: &State<'a>) -> Outcome {
        let Some(repeats) = &mut self.repeats else {
            return Outcome::Expanded;
        };
        self.builder.assign_surface();
        self.builder.is_recording = true;
        let (lengths, parts) = (self.builder.lengths(), repeats.censuses.len());
        let counts = std::mem::take(&mut self.builder.scene.census);
        let mut inner = repeats.parts.begin(part, state);
        let entry = inner.steps.get_or_insert_with(Step::start).clone();
        repeats.recordings.push(Recording::new(entry));
        walk_recorded(self.snapshot, part, inner, self);
        let record = self.end_recording((lengths, parts), counts);
        let Some(repeats) = &mut self.repeats else {
            return Outcome::Expanded;
        };
        repeats.parts.keep(part, state, record)
    }

    /// Keeps what was recorded as a prototype and returns its number, or drops it if it was
    /// spoiled.
    fn end_recording(&mut self, (lengths, parts): (Lengths, usize), counts: Census) -> Option<u32> {
        let repeats = self.repeats.as_mut()?;
        let builder = &mut self.builder;
        builder.assign_surface();
        let is_spoiled = repeats.parts.end() | std::mem::take(&mut builder.spoiled);
        let recording = repeats.recordings.pop();
        let recording =
            recording.filter(|r| !is_spoiled && r.contents.extent.depth < Extent::DEEPEST);
        let own = std::mem::replace(&mut builder.scene.census, counts);
        let record = match recording {
            Some(recording) => {
                builder.scene.census.add_kept(&own);
                repeats.instances.prototypes.push(recording.contents);
                repeats.censuses.push(own);
                Some(repeats.censuses.len() as u32 - 1)
            }
            None => {
                builder.scene.census.textures += own.textures;
                // Prototypes that were recorded inside keep their primitives.
                if repeats.censuses.len() == parts {
                    builder.truncate(lengths);
                    repeats.instances.shapes.truncate(lengths.surfaces);
                }
                None
            }
        };
        builder.is_recording = repeats.parts.is_recording();
        record
    }

    /// Draws a prototype once or on a grid, under matrices from what is being recorded, or from the
    /// world. Returns `false` if it is to be expanded here.
    pub(super) fn draw(
        &mut self,
        number: u32,
        grid: Option<Grid>,
        matrices: Option<Vec<DMat4>>,
    ) -> bool {
        let Some(repeats) = &mut self.repeats else {
            return false;
        };
        let is_recording = self.builder.is_recording;
        let instances = &mut repeats.instances;
        let Some(recording) = repeats.recordings.last_mut() else {
            return false;
        };
        let times = grid.map_or(1, |grid| grid.len());
        if !instances.prototypes[number as usize].extent.is_empty() {
            let content = Content::Instance {
                prototype: number,
                grid: grid.map(Box::new),
            };
            let placed = matrices.and_then(|matrices| {
                let extent = instances.extent(&content)?.under(&matrices)?;
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
            self.builder.instances += 1;
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
