//! Compiles prototypes, whose shapes stay in their object space, and places their instances.

use std::mem::{replace, take};
use std::sync::Arc;

use glam::DMat4;
use ivcam_base::diag::Diagnostic;
use ivcam_inventor::iv::NodeRef;
use ivcam_inventor::snapshot::Snapshot;
use ivcam_inventor::traversal::role::Role;
use ivcam_inventor::traversal::{Grid, State, Step, WalkOptions};

use super::glyphs::StoredGlyphs;
use super::scene_builder::SceneBuilder;
use super::surface_namer::SurfaceNamer;
use super::walk::Compiler;
use crate::scene::census::{Census, InstanceCounts};
use crate::scene::instances::{ElementContent, Extent, Instances, Prototype, ShapePrimitives};
use crate::scene::instancing::{Instancer, Prototypes};
use crate::scene::looks::Surface;
use crate::scene::options::CompileOptions;
use crate::scene::render_scene::RenderScene;

/// A prototype that is being recorded, or the scene itself.
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
    pub(super) surfaces: usize,
    triangles: usize,
    quadrics: usize,
    strokes: usize,
}

/// What was compiled before the part that is being recorded.
pub(super) struct Outside {
    recording: Recording,
    is_recording: bool,
    lengths: Lengths,
    /// The number of prototypes.
    prototypes: usize,
    census: Census,
    /// Where names began, and the length of their path.
    names: Option<(usize, usize)>,
}

/// The shape that was drawn last, if everything in it is opaque.
struct LastShape<'a> {
    node: NodeRef<'a>,
    matrices: Vec<DMat4>,
    /// Its state. Few shapes follow themselves at one place, so it is kept from the second time on.
    state: Option<Box<State<'a>>>,
}

/// The instances of a scene that is being compiled.
pub(super) struct CompiledInstances<'a> {
    /// The prototypes by their parts, or `None` if the scene is expanded.
    pub prototypes: Option<Prototypes<'a>>,
    /// The innermost recording.
    pub recording: Recording,
    last_shape: Option<LastShape<'a>>,
    store: Box<Instances>,
    /// The counts of each prototype.
    censuses: Vec<Census>,
    /// The glyphs of texts.
    pub glyphs: StoredGlyphs,
}

impl<'a> CompiledInstances<'a> {
    /// Returns a scene without instances so far.
    pub(super) fn new(
        snapshot: &'a Snapshot<'_>,
        options: &CompileOptions,
        walk_options: &WalkOptions,
    ) -> Self {
        Self {
            prototypes: Prototypes::new(snapshot, options, walk_options),
            recording: Recording::new(Step::start()),
            last_shape: None,
            store: Box::new(Instances::new(options.origin)),
            censuses: Vec::new(),
            glyphs: StoredGlyphs::default(),
        }
    }

    /// Keeps a prototype with what it counts. Returns its number.
    pub(super) fn keep(&mut self, mut prototype: Prototype, census: Census) -> u32 {
        prototype.drop_covered(|number| self.store.prototypes[number as usize].is_opaque);
        self.store.prototypes.push(prototype);
        self.censuses.push(census);
        self.censuses.len() as u32 - 1
    }

    /// Moves the instances to the scene, if it has any.
    pub(super) fn finish(self, scene: &mut RenderScene) {
        let mut instances = self.store;
        if instances.prototypes.is_empty() {
            return;
        }
        let mut root = self.recording.contents;
        root.drop_covered(|number| instances.prototypes[number as usize].is_opaque);
        instances.root = root;
        let extent = &instances.root.extent;
        scene.census.instances = InstanceCounts {
            prototypes: instances.prototypes.len() as u64,
            placed: extent.placed,
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

impl<'a> Instancer<'a> for Compiler<'a> {
    type Outside = Outside;

    fn prototypes(&mut self) -> Option<&mut Prototypes<'a>> {
        self.instances.prototypes.as_mut()
    }

    fn begin_prototype(&mut self, state: &mut State<'a>) -> Outside {
        let builder = &mut self.builder;
        builder.assign_surface();
        self.instances.last_shape = None;
        let entry = state.steps.get_or_insert_with(Step::start).clone();
        Outside {
            recording: replace(&mut self.instances.recording, Recording::new(entry)),
            is_recording: replace(&mut builder.is_recording, true),
            lengths: builder.lengths(),
            prototypes: self.instances.censuses.len(),
            census: take(&mut builder.scene.census),
            names: self.namer.as_mut().map(SurfaceNamer::begin_part),
        }
    }

    fn end_prototype(&mut self, outside: Outside, is_spoiled: bool) -> Option<u32> {
        let (builder, instances) = (&mut self.builder, &mut self.instances);
        builder.assign_surface();
        instances.last_shape = None;
        if let (Some(namer), Some(names)) = (&mut self.namer, outside.names) {
            namer.end_part(names);
        }
        let is_spoiled = take(&mut builder.spoiled) | is_spoiled;
        let own = replace(&mut builder.scene.census, outside.census);
        let mut contents = replace(&mut instances.recording, outside.recording).contents;
        builder.is_recording = outside.is_recording;
        if !is_spoiled && contents.extent.depth < Extent::DEEPEST {
            let is_opaque = contents.contents().all(|content| match content {
                ElementContent::Shape { surface } => {
                    builder.scene.surfaces[*surface as usize].is_opaque()
                }
                ElementContent::Instance { prototype, .. } => {
                    instances.store.prototypes[*prototype as usize].is_opaque
                }
            });
            contents.is_opaque = is_opaque;
            builder.scene.census.add_kept(&own);
            return Some(instances.keep(contents, own));
        }
        builder.scene.census.textures += own.textures;
        // Prototypes that were recorded inside keep their primitives.
        if instances.censuses.len() == outside.prototypes {
            builder.truncate(outside.lengths);
            instances.store.shapes.truncate(outside.lengths.surfaces);
        }
        None
    }

    fn place(&mut self, prototype: u32, grid: Option<Grid>, state: &State<'a>) -> bool {
        let matrices = self.matrices(state);
        matrices.is_some_and(|matrices| self.draw(prototype, grid, &matrices))
    }

    fn stands_for(&mut self, prototype: u32, node: NodeRef<'a>) {
        let source = node.source().map(|source| (source.clone(), node.span()));
        self.instances.store.prototypes[prototype as usize].source = source;
    }
}

impl<'a> Compiler<'a> {
    /// Begins a node, of which what is being recorded may have to be spoiled.
    pub(super) fn begin_node(&mut self, node: NodeRef<'a>, role: Role) {
        let prototypes = self.prototypes();
        if let Some(warning) = prototypes.and_then(|all| all.begin_node(node, role)) {
            self.builder.over_limit = true;
            self.builder.reports.add(*warning);
        }
    }

    /// Records the primitives of a shape that was just drawn. `before` are the lengths before it.
    pub(super) fn end_shape(&mut self, before: Lengths, state: &State<'a>) {
        if self.instances.prototypes.is_some() {
            let matrices = self.matrices(state);
            self.keep_shape(before, matrices);
        }
    }

    /// Whether a shape is the one before it once more, at the same place. It is hidden by that one
    /// and need not be drawn.
    pub(super) fn repeats_last(&self, node: NodeRef<'a>, state: &State<'a>) -> bool {
        let last = self.instances.last_shape.as_ref();
        last.filter(|last| last.node.is(node)).is_some_and(|last| {
            let before = last.state.as_deref();
            before.is_some_and(|before| before.is_like(state))
                && self.matrices(state).as_ref() == Some(&last.matrices)
        })
    }

    /// Remembers the shape that was drawn. `before` are the lengths before it.
    pub(super) fn note_shape(&mut self, node: NodeRef<'a>, before: Lengths, state: &State<'a>) {
        let last = self.instances.last_shape.take();
        let scene = &self.builder.scene;
        let mut surfaces = scene.surfaces[before.surfaces..].iter();
        let is_opaque = surfaces.all(Surface::is_opaque) && scene.strokes.len() == before.strokes;
        let matrices = self.matrices(state).filter(|_| is_opaque);
        self.instances.last_shape = matrices.map(|matrices| {
            let is_again = |last: LastShape<'_>| last.node.is(node) && last.matrices == matrices;
            let state = last.is_some_and(is_again).then(|| Box::new(state.clone()));
            LastShape {
                node,
                matrices,
                state,
            }
        });
    }

    /// Names the surfaces of the shape that was drawn, if that is asked for. `before` are the
    /// lengths before it.
    pub(super) fn name_shape(&mut self, node: NodeRef<'a>, before: Lengths, state: &State<'a>) {
        let after = self.builder.scene.surfaces.len();
        if let Some(namer) = self.namer.as_mut().filter(|_| after > before.surfaces) {
            namer.name((before.surfaces, after), node, state);
        }
    }

    /// Returns the matrices from the part that is being recorded, or from the world, to the current
    /// object space. Returns `None` if there are too many.
    pub(super) fn matrices(&self, state: &State<'a>) -> Option<Vec<DMat4>> {
        match self.builder.is_recording {
            true => state.steps.as_ref()?.since(&self.instances.recording.entry),
            false => Some(vec![state.world_from_object]),
        }
    }

    /// Adds the primitives since some lengths to what is being recorded, as one shape. `matrices`
    /// lead to its object space, or are `None` if it cannot be placed later.
    pub(super) fn keep_shape(&mut self, before: Lengths, matrices: Option<Vec<DMat4>>) {
        let (builder, instances) = (&self.builder, &mut self.instances);
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
        let contents = &mut instances.recording.contents;
        let fits = if shape.len() == 0 {
            Some(())
        } else if builder.is_recording {
            matrices.and_then(|matrices| {
                let extent = Extent::of_shape(builder.scene.lists(), &shape, &matrices)?;
                let surface = before.surfaces as u32;
                contents.add(ElementContent::Shape { surface }, &matrices, &extent)
            })
        } else {
            let first = contents.skip(shape.len());
            first.map(|first| shape.first = Some(first))
        };
        let shapes = &mut instances.store.shapes;
        shapes.resize(after.surfaces, ShapePrimitives::default());
        shapes[before.surfaces] = shape;
        if fits.is_none() {
            self.does_not_fit();
        }
    }

    /// Draws a prototype once or on a grid, under matrices from what is being recorded, or from the
    /// world. Returns `false` if it is to be expanded here.
    pub(super) fn draw(&mut self, number: u32, grid: Option<Grid>, matrices: &[DMat4]) -> bool {
        let (builder, instances) = (&mut self.builder, &mut self.instances);
        let store = &instances.store;
        let times = grid.map_or(1, |grid| grid.len());
        if !store.prototypes[number as usize].extent.is_empty() {
            let mut matrices = matrices.to_vec();
            let content = store.content(number, grid, &mut matrices);
            let matrices = &matrices[..];
            let (origin, is_inside) = (builder.options.origin, builder.is_recording);
            let placed = store.extent(&content).and_then(|all| all.under(matrices));
            let placed = placed.filter(|extent| is_inside || extent.is_in_reach(origin));
            let Some(extent) = placed else {
                return false;
            };
            if builder.is_at_limit(64 + size_of_val(matrices)) {
                return true;
            }
            let contents = &mut instances.recording.contents;
            if contents.add(content, matrices, &extent).is_none() {
                self.does_not_fit();
                return true;
            }
            builder.instances += 1;
        }
        let census = &instances.censuses[number as usize];
        builder.scene.census.add_drawn(census, times);
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
