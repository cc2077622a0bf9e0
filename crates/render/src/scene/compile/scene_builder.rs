//! The scene builder, which collects surfaces and primitives during a walk.

use glam::{DMat4, DVec3, Vec2, Vec3};
use ivcam_base::diag::Diagnostic;
use ivcam_base::memory::{MemoryBudget, size_text};
use ivcam_inventor::iv::NodeRef;
use ivcam_inventor::traversal::state::{DrawStyle, DrawStyleElement, FogKind, State};

use super::appearance::Shared;
use super::deferred_text::DeferredText;
use super::strokes;
use crate::bvh::Bvh;
use crate::geometry::{Corner, Fineness, Quadric, QuadricKind, TriangleMesh};
use crate::scene::canvas::{
    Canvas, MaterialsBy, PictureView, Reports, Runs, Sides, TriangleList, Vertices, Wants,
    draw_facets,
};
use crate::scene::census::Census;
use crate::scene::looks::{Mapping, Surface, Texture, TextureFiles, TextureUse};
use crate::scene::options::CompileOptions;
use crate::scene::placement::Placement;
use crate::scene::precision::in_reach;
use crate::scene::render_scene::RenderScene;

/// The lists that are kept for the triangles of the current shape. See [`Surface`] for their
/// meaning.
///
/// [`Surface`]: crate::scene::Surface
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct Uses {
    pub normals: bool,
    pub materials: bool,
    pub coordinates: bool,
    pub thirds: bool,
    /// The number of further textures that have coordinates of their own.
    pub further: usize,
}

/// The state of the current shape.
#[derive(Debug)]
pub(super) struct CurrentShape {
    /// The number of shapes before it.
    pub number: u32,
    /// Inventor's complexity from 0 to 1.
    pub complexity: f32,
    /// The draw style.
    pub drawing: DrawStyleElement,
    /// The lists that are kept.
    pub uses: Uses,
    /// The number of pixels of the line pattern that are used so far.
    pub pattern_at: f32,
    /// The normal of the face whose edges or vertices are being drawn; zero for other lines.
    pub face_normal: Vec3,
}

impl CurrentShape {
    /// Whether faces are drawn as their edges or vertices.
    pub(super) fn outlines(&self) -> bool {
        matches!(self.drawing.style, DrawStyle::Lines | DrawStyle::Points)
    }
}

/// The surface number of each primitive, by kind.
#[derive(Debug, Default)]
pub(super) struct Owners {
    pub triangles: Vec<u32>,
    pub quadrics: Vec<u32>,
    pub strokes: Vec<u32>,
}

/// The canvas that keeps triangles, quadrics, lines and surfaces.
pub(super) struct SceneBuilder {
    pub options: CompileOptions,
    pub picture: PictureView,
    pub placement: Placement,
    /// The matrix from the object space of the current shape to world space.
    pub world: DMat4,
    pub scene: RenderScene,
    pub owners: Owners,
    pub shared: Shared,
    /// The memory that the scene may use, with what is in use.
    pub memory: MemoryBudget,
    pub shape: CurrentShape,
    pub reports: Reports,
    /// Whether the limit of primitives was exceeded.
    pub over_limit: bool,
    /// Whether shapes are recorded in their object space, to be placed later.
    pub is_recording: bool,
    /// Whether something was recorded that depends on its place.
    pub spoiled: bool,
    /// The glyphs of the current text, if they are stored when it has ended.
    pub deferred: Option<DeferredText>,
    /// The number of instances so far, which count as primitives.
    pub instances: usize,
    /// The number of shapes so far.
    shapes: u32,
    /// A buffer for the transformed points of a shape.
    pub points: Vec<Vec3>,
}

impl SceneBuilder {
    pub(super) fn new(options: &CompileOptions) -> Self {
        Self {
            picture: PictureView::of(options),
            placement: Placement::around(options.origin),
            world: DMat4::IDENTITY,
            scene: RenderScene {
                origin: options.origin,
                view: strokes::view(options),
                ..RenderScene::default()
            },
            owners: Owners::default(),
            shared: Shared {
                files: TextureFiles::new(&options.texture_folders),
                ..Shared::default()
            },
            memory: MemoryBudget::new(options.memory),
            shape: CurrentShape {
                number: 0,
                complexity: 0.5,
                drawing: DrawStyleElement::DEFAULT,
                uses: Uses::default(),
                pattern_at: 0.0,
                face_normal: Vec3::ZERO,
            },
            reports: Reports::default(),
            over_limit: false,
            is_recording: false,
            spoiled: false,
            deferred: None,
            instances: 0,
            shapes: 0,
            points: Vec::new(),
            options: options.clone(),
        }
    }

    /// Assigns the last surface to the triangles that have none yet.
    pub(super) fn assign_surface(&mut self) {
        let owner = self.scene.surfaces.len().saturating_sub(1) as u32;
        let triangles = self.scene.triangles.len();
        self.owners.triangles.resize(triangles, owner);
    }

    /// The number of the current shape's surface.
    pub(super) fn last_surface(&self) -> u32 {
        self.scene.surfaces.len() as u32 - 1
    }

    /// Reserves memory for further triangles of the current shape, and returns whether the system
    /// has it. `flat` is whether all of them are parts of flat faces.
    pub(super) fn reserve(&mut self, triangles: usize, flat: bool) -> bool {
        if self.shape.outlines() {
            return true;
        }
        let room = self.left().min(self.memory_left(self.bytes_of_triangle()));
        let triangles = triangles.min(room);
        let uses = self.shape.uses;
        let mut has_room = self.scene.triangles.try_reserve(triangles).is_ok();
        if let Some(surface) = self.scene.surfaces.last_mut() {
            has_room &= !uses.normals || surface.normals.try_reserve(triangles, flat);
            has_room &= !uses.materials || surface.materials.try_reserve(triangles).is_ok();
            has_room &= !uses.coordinates || surface.coordinates.try_reserve(triangles).is_ok();
        }
        has_room
    }

    /// The memory of a triangle of the current shape, in bytes, with its part of the tree.
    fn bytes_of_triangle(&self) -> u64 {
        let uses = self.shape.uses;
        let list = |is_used: bool, bytes: usize| if is_used { bytes } else { 0 };
        let bytes = size_of::<[Vec3; 3]>()
            + size_of::<u32>()
            // Corners share normals, about one for each triangle.
            + list(uses.normals, size_of::<[u32; 3]>() + size_of::<Vec3>())
            + list(uses.materials, size_of::<[u32; 3]>())
            + list(uses.coordinates, size_of::<[Vec2; 3]>())
            + list(uses.thirds, size_of::<[f32; 3]>())
            + uses.further * size_of::<[Vec2; 3]>();
        bytes as u64 + Bvh::BYTES_OF_PRIMITIVE
    }

    /// The number of things of a size for which memory is left.
    fn memory_left(&self, bytes: u64) -> usize {
        usize::try_from(self.memory.remaining() / bytes).unwrap_or(usize::MAX)
    }

    /// The number of primitives that can still be kept.
    fn left(&self) -> usize {
        let (triangles, quadrics, strokes) = self.scene.primitives();
        let kept = triangles + quadrics + strokes + self.instances;
        self.options.limits.primitives.saturating_sub(kept)
    }

    /// Returns how many of some further triangles are within the limits, and counts them. `flat` is
    /// whether all of them are parts of flat faces.
    pub(super) fn admit(&mut self, triangles: usize, flat: bool) -> usize {
        let each = self.bytes_of_triangle();
        let (left, fit) = (self.left(), self.memory_left(each));
        if triangles > left {
            self.report_limit();
        } else if triangles > fit {
            self.report_memory();
        }
        let mut room = triangles.min(left).min(fit);
        if !self.reserve(room, flat) {
            self.report_memory();
            room = 0;
        }
        self.memory.count(room as u64 * each);
        self.scene.census.triangles += room as u64;
        room
    }

    /// Whether no further primitive of a size in bytes, without its part of the tree, can be kept,
    /// which is then reported. Otherwise its memory is counted.
    pub(super) fn is_at_limit(&mut self, bytes: usize) -> bool {
        let bytes = bytes as u64 + size_of::<u32>() as u64 + Bvh::BYTES_OF_PRIMITIVE;
        if self.left() == 0 {
            self.report_limit();
        } else if self.memory_left(bytes) == 0 {
            self.report_memory();
        } else {
            self.memory.count(bytes);
            return false;
        }
        true
    }

    /// Reports that the scene does not fit into its memory, once.
    fn report_memory(&mut self) {
        if !self.over_limit {
            self.over_limit = true;
            let limit = size_text(self.memory.limit());
            let warning = Diagnostic::warning(format!(
                "the scene needs more than {limit} of memory; the rest is left out"
            ));
            self.reports
                .add(*warning.with_help("`--memory SIZE` raises the limit"));
        }
    }

    /// Reports that the limit of primitives was exceeded, once.
    fn report_limit(&mut self) {
        if !self.over_limit {
            self.over_limit = true;
            let most = self.options.limits.primitives;
            let warning = Diagnostic::warning(format!(
                "the scene has more than {most} primitives; the rest is left out"
            ));
            let help = "`--scene-limit primitives=N` raises this";
            self.reports.add(*warning.with_help(help));
        }
    }

    /// Whether a surface depends on the place or on the bounds of the scene, so that its shape
    /// cannot be placed later. The model that needs facets sorts transparent shapes by their
    /// centers.
    fn depends_on_place(&self, surface: &Surface) -> bool {
        let environment = &surface.environment;
        let is_mapped = surface
            .textures()
            .any(|t| matches!(t.mapping, Mapping::Plane { .. }));
        let is_in_scene_fog = environment.fog != FogKind::None && environment.visibility <= 0.0;
        is_mapped || is_in_scene_fog || self.options.needs.facets && !surface.is_opaque()
    }

    /// Adds a surface, which is that of the following primitives.
    pub(super) fn add_surface(&mut self, surface: Surface) {
        self.memory.count(size_of::<Surface>() as u64);
        self.scene.surfaces.push(surface);
    }

    /// Adds a surface with the look of another one, whose shape has no triangles.
    pub(super) fn copy_surface(&mut self, number: u32) {
        let surface = Surface {
            first: self.scene.triangles.len() as u32,
            ..self.scene.surfaces[number as usize].clone()
        };
        self.add_surface(surface);
    }

    /// Draws a round shape as polygons.
    fn facets(&mut self, kind: QuadricKind, material: u32) {
        let fineness = Fineness::of_complexity(self.shape.complexity);
        draw_facets(self, kind, fineness, material);
    }
}

impl Canvas for SceneBuilder {
    fn wants(&self) -> Wants {
        Wants {
            normals: self.options.needs.normals,
            coordinates: self.shape.uses.coordinates,
            outlines: self.shape.outlines(),
            bounds: false,
        }
    }

    fn picture(&self) -> &PictureView {
        &self.picture
    }

    fn resolved_picture(&self) -> Option<&PictureView> {
        // What is recorded is seen from several distances. Light that is interpolated between
        // corners depends on the corners of the file's complexity.
        (!self.is_recording && !self.options.needs.facets).then_some(&self.picture)
    }

    fn ignores_draw_style(&self) -> bool {
        self.options.ignore_draw_style
    }

    fn begin(&mut self, node: NodeRef<'_>, state: &State<'_>) {
        self.placement = if self.is_recording {
            self.placement.deferred()
        } else {
            self.placement.moved_to(state.world_from_object)
        };
        self.world = state.world_from_object;
        self.shape.number = self.shapes;
        self.shapes += 1;
        self.shape.drawing = if self.options.ignore_draw_style {
            DrawStyleElement::DEFAULT
        } else {
            state.drawing
        };
        self.shape.complexity = state.complexity.value;
        let surface = self.surface(node, state);
        self.scene.special |= surface.culls || surface.on_top || !surface.clip.is_empty();
        self.scene.annotated |= surface.on_top;
        self.spoiled |= self.is_recording && self.depends_on_place(&surface);
        let is_stored = |t: &TextureUse| t.mapping == Mapping::Stored;
        let further = surface.further_textures.iter();
        self.shape.uses = Uses {
            normals: self.options.needs.normals,
            materials: surface.diffuse.len() > 1 || surface.transparency.len() > 1,
            coordinates: self.options.coordinates || surface.textures().any(is_stored),
            thirds: surface
                .texture
                .as_ref()
                .is_some_and(|t| t.texture.is_deep()),
            further: further.filter(|f| f.has_coordinates()).count(),
        };
        self.assign_surface();
        self.add_surface(surface);
    }

    fn placement(&self) -> &Placement {
        &self.placement
    }

    fn set_placement(&mut self, placement: Placement) {
        self.spoiled |= self.is_recording;
        self.placement = placement;
    }

    fn texture(&self) -> Option<&Texture> {
        Some(&self.scene.surfaces.last()?.texture.as_ref()?.texture)
    }

    fn set_sides(&mut self, sides: Sides) {
        if let Some(surface) = self.scene.surfaces.last_mut() {
            surface.counterclockwise = sides.counterclockwise;
            surface.two_sided = sides.two_sided;
            // The inside of a clipped shape is visible.
            surface.culls = sides.culls && surface.clip.is_empty();
            self.scene.special |= surface.culls;
        }
    }

    fn set_unlit(&mut self) {
        if let Some(surface) = self.scene.surfaces.last_mut() {
            surface.base_color = true;
        }
    }

    fn set_refraction(&mut self, index: f32) {
        if let Some(surface) = self.scene.surfaces.last_mut() {
            surface.refraction = index;
        }
    }

    fn set_text_texture(&mut self, text: Texture) {
        self.replace_texture(text);
    }

    fn triangles(
        &mut self,
        runs: &Runs<'_>,
        vertices: &Vertices<'_, '_>,
        most: usize,
        cut: &mut dyn FnMut(&mut TriangleList<'_>),
    ) {
        self.keep_triangles(runs, vertices, most, cut);
    }

    fn has_memory(&mut self, bytes: u64) -> bool {
        let is_left = bytes <= self.memory.remaining();
        if !is_left {
            self.report_memory();
        }
        is_left
    }

    fn triangle(&mut self, corners: [Corner; 3]) {
        self.keep_triangle(corners);
    }

    fn outline(&mut self, corners: &[Corner]) {
        self.edges(corners);
    }

    fn mesh(&mut self, mesh: &TriangleMesh, materials: MaterialsBy) {
        self.keep_mesh(mesh, materials);
    }

    fn takes_glyphs(&self) -> bool {
        // The texture coordinates of a glyph depend on its place in the text.
        !self.shape.outlines() && !self.shape.uses.coordinates
    }

    fn glyph(&mut self, glyph: (usize, &TriangleMesh), at: Vec2, materials: MaterialsBy) {
        let surface = self.scene.surfaces.last();
        let is_movable = surface.is_some_and(|s| !self.depends_on_place(s));
        match &mut self.deferred {
            Some(text) if is_movable => text.add(glyph, at, materials),
            _ => self.keep_glyph(glyph.1, at, materials),
        }
    }

    fn quadric(&mut self, kind: QuadricKind, material: u32) {
        // A 3D texture needs the exact points.
        let cuts = self.options.needs.facets && !self.shape.uses.thirds;
        if cuts || self.shape.outlines() {
            return self.facets(kind, material);
        }
        if self.is_at_limit(size_of::<Quadric>()) {
            return;
        }
        match Quadric::new(kind, self.placement.scene_from_object, material) {
            Some(quadric) if is_box_in_reach(quadric.bounds()) => {
                self.scene.census.quadrics += 1;
                self.scene.quadrics.push(quadric);
                self.owners.quadrics.push(self.last_surface());
            }
            Some(_) => self.scene.census.bad_corners += 1,
            // The matrix has no inverse, so the ray cannot be transformed to object space.
            None => self.facets(kind, material),
        }
    }

    fn begin_line(&mut self) {
        self.shape.pattern_at = 0.0;
    }

    fn line(&mut self, ends: [Corner; 2], width: f32) {
        self.stroke(ends, width);
    }

    fn census(&mut self) -> &mut Census {
        &mut self.scene.census
    }

    fn reports(&mut self) -> Option<&mut Reports> {
        Some(&mut self.reports)
    }
}

fn is_box_in_reach((min, max): (DVec3, DVec3)) -> bool {
    in_reach(min.as_vec3()) && in_reach(max.as_vec3())
}
