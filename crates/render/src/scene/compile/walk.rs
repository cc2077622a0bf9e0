//! Walks a snapshot, and draws its shapes into the scene builder.

use std::collections::HashSet;

use indexmap::IndexMap;
use ivcam_base::diag::{Diagnostic, Result};
use ivcam_base::memory::MemoryBudget;
use ivcam_inventor::iv::{NodeId, NodeRef, Value};
use ivcam_inventor::snapshot::Snapshot;
use ivcam_inventor::traversal::property::fog97;
use ivcam_inventor::traversal::role::{Role, role};
use ivcam_inventor::traversal::state::{EnvironmentElement, FogKind, LightElement, State};
use ivcam_inventor::traversal::{self, Instance, Visitor};

use super::deferred_text::DeferredText;
use super::instances::CompiledInstances;
use super::scene_builder::SceneBuilder;
use super::surface_namer::SurfaceNamer;
use crate::bvh::Bvh;
use crate::scene::canvas::Canvas;
use crate::scene::instancing::{Prototypes, draw_instance};
use crate::scene::looks::{Background, Light, LightBits};
use crate::scene::options::CompileOptions;
use crate::scene::render_scene::RenderScene;
use crate::scene::{shapes, survey};

/// The largest number of triangles for which memory is reserved in advance. The lists grow beyond
/// it, so its exact value does not matter: it bounds what a false count can reserve.
const MAX_RESERVED: usize = 1 << 18;

/// The visitor that compiles a scene.
pub(super) struct Compiler<'a> {
    pub(super) snapshot: &'a Snapshot<'a>,
    pub(super) builder: SceneBuilder,
    /// The prototypes and instances, of which an expanded scene has none.
    pub(super) instances: CompiledInstances<'a>,
    background_set: bool,
    /// Whether the walk has reached each node of the document.
    reached: Vec<bool>,
    /// The nodes of lights that are on.
    lights: HashSet<NodeId>,
    /// The different lights that are on, by their bits, if those that light no shape are kept.
    shining: Option<IndexMap<LightBits, Light>>,
    /// Names the surfaces, if that is asked for.
    pub(super) namer: Option<SurfaceNamer<'a>>,
    /// The environment of the first VRML 97 `Fog`; the inner value is `None` if that means no fog.
    fog: Option<Option<EnvironmentElement>>,
}

impl RenderScene {
    /// Compiles a snapshot.
    ///
    /// # Errors
    /// Returns a diagnostic if the scene has more than 2^32 primitives, or if the system does not
    /// have the memory of its tree.
    pub fn compile(snapshot: &Snapshot<'_>, options: &CompileOptions) -> Result<Self> {
        let walk_options = options.walk();
        let mut compiler = Compiler {
            snapshot,
            builder: SceneBuilder::new(options),
            instances: CompiledInstances::new(snapshot, options, &walk_options),
            background_set: options.background.is_some_and(|(_, replaces)| replaces),
            reached: vec![false; snapshot.document().nodes.len()],
            lights: HashSet::new(),
            shining: options.idle_lights.then(IndexMap::new),
            namer: options
                .names
                .then(|| SurfaceNamer::new(snapshot.document())),
            fog: None,
        };
        if let Some((color, _)) = options.background {
            compiler.builder.scene.background = Background::plain(color).into_light(options.colors);
        }
        let prototypes = compiler.instances.prototypes.as_ref();
        compiler.builder.deferred = prototypes.map(|_| DeferredText::new());
        compiler.reserve_all();
        traversal::walk(snapshot, &walk_options, &mut compiler);
        compiler.finish()
    }
}

impl Compiler<'_> {
    /// Counts the memory of the document, and reserves memory for the number of triangles that its
    /// lists can give if each is used once. Memory that is not written costs nothing, but lists
    /// that grow are copied.
    fn reserve_all(&mut self) {
        let nodes = &self.snapshot.document().nodes;
        let (mut most, mut bytes) = (0, size_of_val(&nodes[..]));
        for field in nodes.iter().flat_map(|n| &n.fields) {
            most += match &field.value {
                Value::Ints(list) => list.len(),
                Value::Vec3s(list) => list.len(),
                _ => 0,
            };
            bytes += size_of_val(field) + field.value.list_bytes();
        }
        self.builder.memory.count(bytes as u64);
        let most = most.min(MAX_RESERVED);
        let most = most.min(self.builder.options.limits.primitives);
        // Without this memory the lists grow as they need.
        let _ = self.builder.scene.triangles.try_reserve(most);
        let _ = self.builder.owners.triangles.try_reserve(most);
    }

    /// Marks a node as reached. Default parts of kits are in a document of their own.
    fn reach(&mut self, node: NodeRef<'_>) {
        if std::ptr::eq(node.document, self.snapshot.document()) {
            self.reached[node.id.0 as usize] = true;
        }
    }

    /// Returns the number of shapes that the walk has not reached.
    fn unreached_shapes(&self) -> usize {
        let document = self.snapshot.document();
        let ids = document.ids();
        ids.filter(|&id| {
            let is_shape = matches!(
                role(document.node(id)),
                Role::Shape | Role::AppearanceAndGeometry
            );
            is_shape && !self.reached[id.0 as usize] && !document.is_template(id)
        })
        .count()
    }

    /// Assembles the scene after the walk.
    fn finish(mut self) -> Result<RenderScene> {
        let walked = self.builder.lengths().surfaces;
        self.add_studio();
        let (lights_seen, shapes_unreached) = (self.lights.len(), self.unreached_shapes());
        let mut builder = self.builder;
        builder.assign_surface();
        let mut scene = builder.scene;
        let all = scene.surfaces.len();
        scene.names = self
            .namer
            .map(|namer| Box::new(namer.finish(walked, all, "Studio")));
        if let Some(Some(fog)) = self.fog {
            let surfaces = scene.surfaces.iter_mut();
            for surface in surfaces.filter(|s| s.environment.fog == FogKind::None) {
                let (fog, fog_color, visibility) = (fog.fog, fog.fog_color, fog.visibility);
                surface.environment = EnvironmentElement {
                    fog,
                    fog_color,
                    visibility,
                    ..surface.environment
                };
            }
        }
        let mut owners = builder.owners;
        scene.owners = owners.triangles;
        scene.owners.append(&mut owners.quadrics);
        scene.owners.append(&mut owners.strokes);
        scene.census.lights_seen = lights_seen as u64;
        scene.census.shapes_unreached = shapes_unreached as u64;
        let lights = builder.shared.lights;
        scene.census.lights = lights.nodes();
        scene.light_sets = lights.finish(builder.options.needs.lights);
        scene.idle_lights = self.shining.map(|mut all| {
            let of_shapes = scene.light_sets.different();
            let of_shapes: HashSet<_> = of_shapes.iter().map(Light::bits).collect();
            all.retain(|bits, _| !of_shapes.contains(bits));
            all.into_values().collect()
        });
        let notices = builder.shared.files.notices;
        notices.into_iter().for_each(|d| builder.reports.add(*d));
        scene.census.diagnostics = builder.reports.finish();
        self.instances.finish(&mut scene);
        let culls = scene.surfaces.iter().any(|surface| surface.culls);
        scene.culls_shadows = culls && !builder.options.culled_faces_cast_shadows;
        scene.finalize()?;
        if let (Some(_), Some((low, high))) = (&builder.options.camera, scene.bounds) {
            scene.light_sets.find_lights_at_eye((high - low).length());
        }
        let primitives = scene.owners.len() + scene.instances.as_ref().map_or(0, |all| all.len());
        let tree = primitives as u64 * Bvh::BYTES_OF_PRIMITIVE;
        MemoryBudget::new(u64::MAX).take("the tree of the scene", tree)?;
        Ok(scene)
    }
}

impl<'a> Visitor<'a> for Compiler<'a> {
    fn shape(&mut self, node: NodeRef<'a>, state: &State<'a>) {
        self.reach(node);
        if self.repeats_last(node, state) {
            return;
        }
        let before = self.builder.lengths();
        shapes::draw(node, state, &mut self.builder);
        self.end_shape(before, state);
        self.end_text(node, state);
        self.note_shape(node, before, state);
        self.name_shape(node, before, state);
    }

    fn enter(&mut self, node: NodeRef<'a>, _state: &State<'a>) {
        if let Some(namer) = &mut self.namer {
            namer.enter(node);
        }
    }

    fn leave(&mut self) {
        if let Some(namer) = &mut self.namer {
            namer.leave();
        }
    }

    fn light(&mut self, _node: NodeRef<'a>, light: &LightElement, _state: &State<'a>) {
        self.lights.insert(light.node);
        // A part with a light is expanded after its recording.
        let Some(shining) = self.shining.as_mut().filter(|_| !self.builder.is_recording) else {
            return;
        };
        let builder = &mut self.builder;
        let light = Light::new(light, builder.scene.origin, builder.options.colors);
        if shining.insert(light.bits(), light).is_none() {
            let bytes = 2 * (size_of::<Light>() + size_of::<LightBits>());
            builder.memory.count(bytes as u64);
        }
    }

    fn node(&mut self, node: NodeRef<'a>, role: Role) {
        self.reach(node);
        self.begin_node(node, role);
        let handles = self.snapshot.has_handles();
        self.builder.census().see_node(node, handles);
        self.builder.reports.not_applied(node);
    }

    fn instance(&mut self, part: Instance<'a>, state: &State<'a>) -> bool {
        draw_instance(self, part, state)
    }

    fn bindable(&mut self, node: NodeRef<'a>, state: &State<'a>) {
        let name = node.known_class().map_or("", |class| class.name);
        if name.ends_with("Fog") {
            let colors = self.builder.options.colors;
            self.fog.get_or_insert_with(|| {
                fog97(node, state).map(|fog| EnvironmentElement {
                    fog_color: colors.light(fog.fog_color),
                    ..fog
                })
            });
        } else if name.ends_with("Background") && !self.background_set {
            self.background_set = true;
            let builder = &mut self.builder;
            let files = (&mut builder.shared.files, &mut builder.memory);
            let files = builder.options.needs.textures.then_some(files);
            let colors = builder.options.colors;
            let (background, diagnostics) = Background::of(node, state, colors, files);
            self.builder.scene.background = background;
            diagnostics
                .into_iter()
                .for_each(|d| self.builder.reports.add(*d));
        }
    }

    fn screen_area(&mut self, node: NodeRef<'a>, state: &State<'a>) -> Option<f64> {
        survey::screen_area(self.snapshot, node, state, self.builder.picture())
    }

    fn report(&mut self, diagnostic: Box<Diagnostic>) {
        self.builder.reports.add(*diagnostic);
    }

    fn is_full(&self) -> bool {
        let prototypes = self.instances.prototypes.as_ref();
        let is_full = self.builder.over_limit || self.builder.spoiled;
        is_full || prototypes.is_some_and(Prototypes::is_full)
    }
}
