//! Collects surfaces and primitives while a walk goes on.
//!
//! A shape's function draws in the shape's own space through a [`Builder`]; the builder moves it
//! into the scene, keeps what the picture needs, and counts.

use std::collections::{HashMap, HashSet};
use std::path::PathBuf;
use std::sync::Arc;

use glam::{DAffine3, DMat3, DMat4, DVec3, DVec4, Vec2, Vec3, Vec4};

use super::census::Census;
use super::looks::{
    Background, CornerNormals, Filter, Light, Mapping, Repeat, Surface, Texture, TextureUse,
    texture,
};
use super::options::{CompileOptions, Needs};
use super::pixel_footprint::Screen;
use super::render_scene::RenderScene;
use super::shapes;
use super::shapes::cut::Scratch;
use super::survey;
use crate::diag::{Diagnostic, Result};
use crate::geometry::quadric::exact_bounds;
use crate::geometry::text::Fonts;
use crate::geometry::{Corner, Mesh, Quadric, QuadricKind, Stroke, StrokeView, facets};
use crate::iv::{NodeId, NodeRef, Value};
use crate::pose::{CameraPose, Projection};
use crate::snapshot::Snapshot;
use crate::traversal::property::fog97;
use crate::traversal::role::Role;
use crate::traversal::state::{
    Diffuse, DrawStyle, Drawing, EnvironmentElement, FogKind, LightElement, State,
    TextureCoordinates,
};
use crate::traversal::{self, Visitor, WalkOptions};

/// A corner, and where it lies in the scene.
#[derive(Clone, Copy, Debug)]
struct Placed {
    corner: Corner,
    position: Vec3,
    normal: Vec3,
    /// Whether it can be drawn: numbers that are numbers, not too far away.
    sound: bool,
}

/// What the triangles of the current shape are kept in; `None` for what the picture does not need.
pub struct Lists<'b> {
    pub triangles: &'b mut Vec<[Vec3; 3]>,
    pub normals: Option<&'b mut CornerNormals>,
    pub materials: Option<&'b mut Vec<[u32; 3]>>,
    pub coordinates: Option<&'b mut Vec<[Vec2; 3]>>,
    pub thirds: Option<&'b mut Vec<[f32; 3]>>,
}

/// What a shape draws into: keeps primitives, or only counts and bounds them.
pub struct Builder<'a> {
    pub snapshot: &'a Snapshot<'a>,
    pub needs: Needs,
    origin: DVec3,
    camera: Option<CameraPose>,
    pixel_rows: u32,
    max_primitives: usize,
    texture_folders: Vec<PathBuf>,
    fonts: Arc<Fonts>,
    /// Counts and bounds only; nothing is kept.
    surveying: bool,
    ignore_draw_style: bool,
    /// The current shape's.
    complexity: f32,
    /// Pixels of the line pattern used so far.
    pattern_at: f32,
    /// Of the face whose edges or corners are being drawn; zero for lines of their own.
    face_normal: Vec3,
    scene_from_object: DAffine3,
    normal_matrix: DMat3,
    scene: RenderScene,
    owners: [Vec<u32>; 3],
    light_sets: HashMap<*const Vec<LightElement>, (u32, Arc<Vec<LightElement>>)>,
    decoded: HashMap<NodeId, Option<Arc<Texture>>>,
    /// Of the current shape, in the world.
    pub(super) bounds: Option<(DVec3, DVec3)>,
    /// Of the current shape, in its own space.
    pub(super) object_bounds: Option<(DVec3, DVec3)>,
    pub(super) triangle_count: u64,
    shape_count: u32,
    uses_normals: bool,
    uses_materials: bool,
    uses_coordinates: bool,
    uses_thirds: bool,
    /// How the current shape is drawn: whole, as edges or as corners.
    drawing: Drawing,
    over_limit: bool,
    background_set: bool,
    /// The first VRML 97 `Fog`, with the environment it stands in.
    fog: Option<Option<EnvironmentElement>>,
    /// Shapes of which was told that parts are left out.
    told: HashSet<NodeId>,
    scratch: Scratch,
    pub troubles: Vec<Box<Diagnostic>>,
}

impl<'a> Builder<'a> {
    pub fn new(snapshot: &'a Snapshot<'a>, options: &CompileOptions) -> Self {
        Self {
            snapshot,
            needs: options.needs,
            origin: options.origin,
            camera: options.camera.clone(),
            pixel_rows: options.pixel_rows,
            max_primitives: options.max_primitives,
            texture_folders: options.texture_folders.clone(),
            fonts: options.fonts.clone(),
            surveying: false,
            ignore_draw_style: options.ignore_draw_style,
            complexity: 0.5,
            pattern_at: 0.0,
            face_normal: Vec3::ZERO,
            scene_from_object: DAffine3::IDENTITY,
            normal_matrix: DMat3::IDENTITY,
            scene: RenderScene {
                origin: options.origin,
                view: view(options),
                ..RenderScene::default()
            },
            owners: Default::default(),
            light_sets: HashMap::new(),
            decoded: HashMap::new(),
            bounds: None,
            object_bounds: None,
            triangle_count: 0,
            shape_count: 0,
            uses_normals: false,
            uses_materials: false,
            uses_coordinates: false,
            uses_thirds: false,
            drawing: Drawing::DEFAULT,
            over_limit: false,
            background_set: false,
            fog: None,
            told: HashSet::new(),
            scratch: Scratch::default(),
            troubles: Vec::new(),
        }
    }

    /// Makes room for as many triangles as the document's lists can give, used once: memory that
    /// is not written to costs nothing, and lists that grow are copied.
    pub(super) fn expect_all(&mut self) {
        let fields = self
            .snapshot
            .document()
            .nodes
            .iter()
            .flat_map(|n| &n.fields);
        let entries = fields.map(|f| match &f.value {
            Value::Ints(list) => list.len(),
            Value::Vec3s(list) => list.len(),
            _ => 0,
        });
        let most = entries.sum::<usize>().min(MOST_EXPECTED);
        let most = most.min(self.max_primitives);
        self.scene.triangles.reserve(most);
        self.owners[0].reserve(most);
    }

    pub(super) fn surveyor(snapshot: &'a Snapshot<'a>, options: &CompileOptions) -> Self {
        Self {
            surveying: true,
            origin: DVec3::ZERO,
            ..Self::new(snapshot, options)
        }
    }

    pub(super) fn census(&self) -> &Census {
        &self.scene.census
    }

    pub fn census_mut(&mut self) -> &mut Census {
        &mut self.scene.census
    }

    /// Whether shapes need to work out normals, materials, texture coordinates at all.
    pub fn wants_normals(&self) -> bool {
        !self.surveying && self.needs.normals
    }

    pub fn wants_coordinates(&self) -> bool {
        self.uses_coordinates
    }

    /// Whether the current shape has a `Texture3`.
    pub fn has_volume_texture(&self) -> bool {
        let texture = self.scene.surfaces.last().and_then(|s| s.texture.as_ref());
        texture.is_some_and(|t| t.texture.is_deep())
    }

    /// Begins the surface of a shape: everything drawn from here on belongs to it.
    pub(super) fn begin(&mut self, node: NodeRef<'a>, state: &State<'a>) {
        self.put(state.world_from_object);
        self.bounds = None;
        self.object_bounds = None;
        self.shape_count += 1;
        if self.surveying {
            return;
        }
        self.drawing = if self.ignore_draw_style {
            Drawing::DEFAULT
        } else {
            state.drawing
        };
        self.complexity = state.complexity.value;
        let surface = self.surface(node, state);
        self.scene.special |= surface.culls || surface.on_top || !surface.clip.is_empty();
        self.scene.annotated |= surface.on_top;
        self.uses_normals = self.needs.normals;
        self.uses_materials = surface.diffuse.len() > 1 || surface.transparency.len() > 1;
        self.uses_coordinates = surface
            .texture
            .as_ref()
            .is_some_and(|t| t.mapping == Mapping::Stored);
        self.uses_thirds = surface
            .texture
            .as_ref()
            .is_some_and(|t| t.texture.is_deep());
        self.own();
        self.scene.surfaces.push(surface);
    }

    /// The triangles since the last time belong to the last surface.
    fn own(&mut self) {
        let owner = self.scene.surfaces.len().saturating_sub(1) as u32;
        self.owners[0].resize(self.scene.triangles.len(), owner);
    }

    /// Makes room for as many triangles of the current shape as are to come at most.
    pub fn expect(&mut self, triangles: usize) {
        if self.surveying || self.outlines() {
            return;
        }
        let room = self
            .max_primitives
            .saturating_sub(self.scene.triangles.len());
        let triangles = triangles.min(room);
        self.scene.triangles.reserve(triangles);
        let Some(surface) = self.scene.surfaces.last_mut() else {
            return;
        };
        if self.uses_normals {
            surface.normals.reserve(triangles);
        }
        if self.uses_materials {
            surface.materials.reserve_exact(triangles);
        }
        if self.uses_coordinates {
            surface.coordinates.reserve_exact(triangles);
        }
    }

    /// Whether invisible shapes still count: for bounds they do, as in Inventor.
    pub(super) fn ignores_draw_style(&self) -> bool {
        self.surveying || self.ignore_draw_style
    }

    /// The matrix for what follows, from the world's.
    fn put(&mut self, world_from_object: DMat4) {
        let mut affine = DAffine3::from_mat4(world_from_object);
        affine.translation -= self.origin;
        self.scene_from_object = affine;
        let inverse = affine.matrix3.inverse();
        self.normal_matrix = if inverse.is_finite() {
            inverse.transpose()
        } else {
            affine.matrix3
        };
    }

    /// Whether the matrix leaves a line or a point of what follows: a scale of 0 in two directions.
    pub fn is_collapsed(&self) -> bool {
        let m = self.scene_from_object.matrix3;
        let areas = [
            m.x_axis.cross(m.y_axis),
            m.y_axis.cross(m.z_axis),
            m.z_axis.cross(m.x_axis),
        ];
        areas.iter().all(|area| *area == DVec3::ZERO)
    }

    /// Draws what follows under a further matrix, in the shape's own space.
    pub fn with_matrix(&mut self, matrix: DMat4, draw: impl FnOnce(&mut Self)) {
        let kept = (self.scene_from_object, self.normal_matrix);
        let mut world = self.scene_from_object;
        world.translation += self.origin;
        self.put(DMat4::from(world) * matrix);
        draw(self);
        (self.scene_from_object, self.normal_matrix) = kept;
    }

    /// `Complexity` `BOUNDING_BOX`: the box around the current shape instead of it.
    pub(super) fn draw_box(&mut self, node: NodeRef<'a>, state: &State<'a>) -> bool {
        let options = CompileOptions {
            camera: self.camera.clone(),
            ..CompileOptions::default()
        };
        let mut surveyor = Builder::surveyor(self.snapshot, &options);
        shapes::draw(node, state, &mut surveyor);
        let Some((min, max)) = surveyor.object_bounds else {
            return false;
        };
        let center = DMat4::from_translation(0.5 * (min + max));
        let half = (0.5 * (max - min)).as_vec3();
        self.with_matrix(center, |out| shapes::solids::block(half, false, out));
        true
    }

    /// Draws what follows under a matrix of its own.
    pub fn with_world(&mut self, world: DMat4, draw: impl FnOnce(&mut Self)) {
        let kept = (self.scene_from_object, self.normal_matrix);
        self.put(world);
        draw(self);
        (self.scene_from_object, self.normal_matrix) = kept;
    }

    /// The picture that the scene is compiled for.
    pub fn screen(&self) -> Option<Screen<'_>> {
        let rows = f64::from(self.pixel_rows());
        let camera = self.camera.as_ref()?;
        Some(Screen { camera, rows })
    }

    /// The user's own typefaces.
    pub fn fonts(&self) -> Arc<Fonts> {
        self.fonts.clone()
    }

    pub fn pixel_rows(&self) -> u32 {
        self.pixel_rows.max(1)
    }

    /// Draws without adding to the count of triangles or the box: for surfaces whose cutting is
    /// nobody's but ours, with a box of their control points.
    pub fn without_counting(&mut self, draw: impl FnOnce(&mut Self)) {
        let kept = (self.triangle_count, self.bounds, self.object_bounds);
        draw(self);
        if self.surveying {
            (self.triangle_count, _, self.object_bounds) = kept;
        }
    }

    /// Overrides the facing rules of the current shape, where its class has its own.
    pub fn set_sides(&mut self, counterclockwise: bool, two_sided: bool, culls: bool) {
        if let Some(surface) = self.scene.surfaces.last_mut() {
            surface.counterclockwise = counterclockwise;
            surface.two_sided = two_sided;
            // A shape that is cut open shows its inside.
            surface.culls = culls && surface.clip.is_empty();
            self.scene.special |= surface.culls;
        }
    }

    fn surface(&mut self, node: NodeRef<'a>, state: &State<'a>) -> Surface {
        let m = &state.material;
        let (mut diffuse, mut transparency) = match m.diffuse {
            Diffuse::Packed(_) => {
                let n = m.diffuse_count();
                (
                    (0..n).map(|i| m.diffuse_at(i)).collect::<Vec<_>>(),
                    (0..n).map(|i| m.transparency_at(i)).collect::<Vec<_>>(),
                )
            }
            Diffuse::Colors(c) => (
                (0..c.len()).map(|i| c.at(i)).collect(),
                (0..m.transparency.len())
                    .map(|i| m.transparency.at(i))
                    .collect(),
            ),
        };
        if state.material_binding == crate::traversal::state::Binding::Overall {
            diffuse.truncate(1);
            transparency.truncate(1);
        }
        for t in &mut transparency {
            *t = if t.is_finite() {
                t.clamp(0.0, 1.0)
            } else {
                0.0
            };
        }
        let mut emissive = m.emissive;
        if let Some(highlight) = state.highlight {
            emissive = highlight.color;
            if highlight.diffuse_too {
                diffuse = vec![highlight.color];
            }
        }
        let texture = self.texture_use(state);
        self.scene.census.transparent |= transparency.iter().any(|&t| t > 0.0)
            || texture.as_ref().is_some_and(|t| t.texture.has_alpha());
        Surface {
            shape: self.shape_count - 1,
            class: node.known_class().map_or("", |c| c.name),
            ambient: m.ambient,
            diffuse,
            specular: m.specular,
            emissive,
            shininess: m.shininess,
            transparency,
            refraction: m.refraction,
            base_color: state.base_color,
            two_sided: state.hints.two_sided(),
            culls: state.hints.culls(),
            counterclockwise: state.hints.counterclockwise(),
            layer: layer(&state.drawing),
            casts_shadow: state.casts_shadow,
            on_top: state.on_top,
            environment: state.environment,
            lights: self.light_set(&state.lights),
            texture,
            clip: state
                .clip_planes
                .iter()
                .map(|(n, d)| (n.as_vec3(), (d - n.dot(self.origin)) as f32))
                .collect(),
            first: self.scene.triangles.len() as u32,
            normals: CornerNormals::default(),
            materials: Vec::new(),
            coordinates: Vec::new(),
            thirds: Vec::new(),
            center: Vec3::ZERO,
        }
    }

    fn light_set(&mut self, lights: &Arc<Vec<LightElement>>) -> u32 {
        if let Some((index, _)) = self.light_sets.get(&Arc::as_ptr(lights)) {
            return *index;
        }
        let set = if self.needs.lights {
            lights.iter().map(|l| Light::new(l, self.origin)).collect()
        } else {
            Vec::new()
        };
        let index = self.scene.light_sets.len() as u32;
        self.scene.light_sets.push(Arc::new(set));
        // Holding the list keeps its address its own.
        self.light_sets
            .insert(Arc::as_ptr(lights), (index, lights.clone()));
        index
    }

    fn texture_use(&mut self, state: &State<'a>) -> Option<TextureUse> {
        let element = state.texture?;
        if !self.needs.textures {
            self.scene.census.textures_left_out += 1;
            return None;
        }
        if element.quality <= 0.0 {
            return None; // Inventor's way to switch textures off
        }
        let id = element.node.id;
        if !self.decoded.contains_key(&id) {
            let decoded = match texture::decode(element.node, &self.texture_folders) {
                Ok(t) => t.map(Arc::new),
                Err(trouble) => {
                    self.troubles.push(trouble);
                    None
                }
            };
            self.scene.census.textures += u64::from(decoded.is_some());
            self.scene.textures.extend(decoded.clone());
            self.decoded.insert(id, decoded);
        }
        let texture = self.decoded.get(&id)?.clone()?;
        Some(TextureUse {
            texture,
            model: element.model,
            blend_color: element.blend_color,
            repeat: Repeat {
                s: element.repeat_s,
                t: element.repeat_t,
                r: element.repeat_r,
            },
            filter: Filter::of(element.quality),
            matrix: state.texture_matrix,
            mapping: self.mapping(state),
        })
    }

    fn mapping(&self, state: &State<'a>) -> Mapping {
        match state.texture_coordinates {
            TextureCoordinates::Plane { s, t } => {
                // The two are length-scaled: a direction of length 2 repeats every 2 units.
                let row = |v: Vec3| {
                    let v = v.as_dvec3();
                    self.plane((v / v.length_squared().max(1e-30)).extend(0.0))
                };
                Mapping::Plane {
                    s: row(s),
                    t: row(t),
                }
            }
            TextureCoordinates::Object { s, t } => Mapping::Plane {
                s: self.plane(s.as_dvec4()),
                t: self.plane(t.as_dvec4()),
            },
            TextureCoordinates::Environment => {
                let turn = self
                    .camera
                    .as_ref()
                    .map_or(glam::DQuat::IDENTITY, |c| c.orientation);
                Mapping::Environment {
                    right: (turn * DVec3::X).as_vec3(),
                    up: (turn * DVec3::Y).as_vec3(),
                }
            }
            _ => Mapping::Stored,
        }
    }

    /// A linear function of the shape's own space as one of the scene.
    fn plane(&self, v: DVec4) -> Vec4 {
        let object = self.scene_from_object.inverse();
        let normal = object.matrix3.transpose() * v.truncate();
        let distance = v.truncate().dot(object.translation) + v.w;
        normal.extend(distance).as_vec4()
    }

    fn extend(&mut self, point: Vec3) {
        let object = point.as_dvec3();
        grow(&mut self.object_bounds, object, object);
        let p = self.scene_from_object.transform_point3(object) + self.origin;
        grow(&mut self.bounds, p, p);
    }

    /// A point that Inventor counts into the shape's box though nothing is drawn there.
    pub fn bound(&mut self, point: Vec3) {
        if self.surveying && point.is_finite() {
            self.extend(point);
        }
    }

    /// The same for many; where nobody asks for boxes the points are not looked at.
    pub fn bound_all(&mut self, points: impl Iterator<Item = Vec3>) {
        if self.surveying {
            points.for_each(|p| self.bound(p));
        }
    }

    /// What Inventor takes for the current shape's box, where it is not the box around what is
    /// drawn. The exact box stays.
    pub fn set_inventor_box(&mut self, object: Option<(DVec3, DVec3)>) {
        if self.surveying {
            self.object_bounds = object;
        }
    }

    /// Whether faces are drawn as their edges or corners; then [`Self::outline`] draws them.
    pub fn outlines(&self) -> bool {
        !self.surveying && matches!(self.drawing.style, DrawStyle::Lines | DrawStyle::Points)
    }

    /// The edges of a face, or its corners, as the draw style says.
    pub fn outline(&mut self, corners: &[Corner]) {
        if corners.is_empty() {
            return; // a face with an index that has no coordinate
        }
        self.begin_line();
        self.face_normal = self.outward(corners);
        // OpenGL begins the pattern of three or four edges with the last one (Mesa).
        let n = corners.len();
        let first = if n <= 4 { n.saturating_sub(1) } else { 0 };
        for i in first..first + n {
            let (corner, next) = (corners[i % n], corners[(i + 1) % n]);
            if self.drawing.style == DrawStyle::Points {
                self.dot(corner, self.drawing.point_size);
            } else {
                self.line([corner, next], self.drawing.line_width);
            }
        }
        self.face_normal = Vec3::ZERO;
    }

    /// The normal of a face in the scene, as long as its area, by Newell's sum.
    fn outward(&self, corners: &[Corner]) -> Vec3 {
        let at = |i: usize| {
            let p = corners[i % corners.len()].position.as_dvec3();
            self.scene_from_object.transform_point3(p)
        };
        let from = at(0);
        (1..corners.len())
            .fold(DVec3::ZERO, |sum, i| {
                sum + (at(i) - from).cross(at(i + 1) - from)
            })
            .as_vec3()
    }

    pub fn is_surveying(&self) -> bool {
        self.surveying
    }

    pub(super) fn scratch(&mut self) -> &mut Scratch {
        &mut self.scratch
    }

    /// Whether triangles of the current shape are kept with their normals.
    pub fn keeps_normals(&self) -> bool {
        !self.surveying && !self.outlines() && self.uses_normals
    }

    /// Whether triangles of the current shape are kept with their materials.
    pub fn keeps_materials(&self) -> bool {
        !self.surveying && !self.outlines() && self.uses_materials
    }

    /// Whether a moved point can be drawn: numbers that are numbers, not too far away.
    pub fn is_drawable(&self, moved: Vec3) -> bool {
        if self.surveying {
            moved.is_finite()
        } else {
            in_reach(moved)
        }
    }

    /// Moves points into the scene, unless only boxes are asked for. Returns whether all of them
    /// can be drawn.
    pub fn move_points(&self, points: impl Iterator<Item = Vec3>, moved: &mut Vec<Vec3>) -> bool {
        if self.surveying {
            moved.extend(points);
        } else {
            let matrix = self.scene_from_object;
            moved.extend(points.map(|p| matrix.transform_point3(p.as_dvec3()).as_vec3()));
        }
        moved.iter().fold(true, |all, p| all & self.is_drawable(*p))
    }

    /// Turns normals of the shape into the scene's, of length 1 or 0.
    pub fn turn_normals(&self, normals: impl Iterator<Item = Vec3>, turned: &mut Vec<Vec3>) {
        let matrix = self.normal_matrix;
        turned.extend(normals.map(|n| turn(&matrix, n)));
    }

    /// Keeps turned normals with the current shape, and gives the number of the first.
    pub fn keep_normals(&mut self, turned: Vec<Vec3>) -> u32 {
        let surface = self.scene.surfaces.last_mut();
        surface.map_or(0, |surface| surface.normals.append(turned))
    }

    /// How many of so many triangles more can be kept.
    pub fn room(&mut self, triangles: usize) -> usize {
        let kept = self.scene.triangles.len() + self.scene.quadrics.len();
        let left = self
            .max_primitives
            .saturating_sub(kept + self.scene.strokes.len());
        if triangles > left {
            self.tell_of_the_limit();
        }
        let room = triangles.min(left);
        self.scene.census.triangles += room as u64;
        room
    }

    /// What triangles of the current shape are kept in.
    pub fn lists(&mut self) -> Lists<'_> {
        let mut lists = Lists {
            triangles: &mut self.scene.triangles,
            normals: None,
            materials: None,
            coordinates: None,
            thirds: None,
        };
        if let Some(surface) = self.scene.surfaces.last_mut() {
            lists.normals = self.uses_normals.then_some(&mut surface.normals);
            lists.materials = self.uses_materials.then_some(&mut surface.materials);
            lists.coordinates = self.uses_coordinates.then_some(&mut surface.coordinates);
            lists.thirds = self.uses_thirds.then_some(&mut surface.thirds);
        }
        lists
    }

    /// Moves a corner into the scene.
    fn place(&self, corner: Corner) -> Placed {
        let mut placed = Placed {
            corner,
            position: corner.position,
            normal: corner.normal,
            sound: corner.position.is_finite(),
        };
        if !placed.sound || self.surveying || self.outlines() {
            return placed;
        }
        let matrix = &self.scene_from_object;
        placed.position = matrix
            .transform_point3(corner.position.as_dvec3())
            .as_vec3();
        placed.sound = in_reach(placed.position);
        if self.uses_normals {
            placed.normal = turn(&self.normal_matrix, corner.normal);
        }
        placed
    }

    pub fn triangle(&mut self, corners: [Corner; 3]) {
        let [a, b, c] = corners.map(|c| self.place(c));
        self.triangle_of([&a, &b, &c]);
    }

    fn triangle_of(&mut self, corners: [&Placed; 3]) {
        self.triangle_count += 1;
        if self.outlines() {
            self.outline(&corners.map(|c| c.corner));
            return;
        }
        if corners.iter().any(|c| !c.sound) {
            self.scene.census.bad_corners += 1;
            return;
        }
        if self.surveying {
            for c in &corners {
                self.extend(c.position);
            }
            return;
        }
        if self.has_no_room() {
            return;
        }
        self.scene.census.triangles += 1;
        self.scene.triangles.push(corners.map(|c| c.position));
        let Some(surface) = self.scene.surfaces.last_mut() else {
            return;
        };
        if self.uses_normals {
            surface.normals.push(corners.map(|c| c.normal));
        }
        if self.uses_materials {
            surface.materials.push(corners.map(|c| c.corner.material));
        }
        if self.uses_coordinates {
            let coordinates = corners.map(|c| c.corner.coordinates);
            surface.coordinates.push(coordinates);
        }
        if self.uses_thirds {
            surface.thirds.push(corners.map(|c| c.corner.third));
        }
    }

    /// Triangles that a shape has made; materials by part, or by the shape's own colors.
    pub fn mesh(&mut self, mesh: &Mesh, by_part: bool) {
        if !mesh.is_sound() {
            self.scene.census.bad_corners += 1;
            return;
        }
        self.expect(mesh.triangles.len());
        let by_part = by_part && mesh.colors.is_empty();
        let mut points = Vec::with_capacity(mesh.positions.len());
        let sound = self.move_points(mesh.positions.iter().copied(), &mut points);
        if self.surveying || self.outlines() || !sound {
            return self.mesh_one_by_one(mesh, by_part);
        }
        let mut normals = Vec::new();
        if self.uses_normals {
            self.turn_normals(mesh.normals.iter().copied(), &mut normals);
        }
        self.triangle_count += mesh.triangles.len() as u64;
        let room = self.room(mesh.triangles.len());
        let triangles = &mesh.triangles[..room];
        let lists = self.lists();
        let all = |list: &[Vec3], t: &[u32; 3]| t.map(|v| list[v as usize]);
        lists
            .triangles
            .extend(triangles.iter().map(|t| all(&points, t)));
        if let Some(list) = lists.normals {
            let first = list.append(normals);
            let numbers = triangles.iter().map(|t| t.map(|v| first + v));
            list.corners().extend(numbers);
        }
        if let Some(list) = lists.materials {
            list.extend((0..room).map(|i| mesh.materials(i, by_part)));
        }
        if let Some(list) = lists.coordinates {
            list.extend(
                triangles
                    .iter()
                    .map(|t| t.map(|v| mesh.texcoords[v as usize])),
            );
        }
        if let Some(list) = lists.thirds {
            list.extend(triangles.iter().map(|_| [0.0; 3]));
        }
    }

    fn mesh_one_by_one(&mut self, mesh: &Mesh, by_part: bool) {
        for (i, triangle) in mesh.triangles.iter().enumerate() {
            let materials = mesh.materials(i, by_part);
            let corner = |k: usize| {
                let v = triangle[k] as usize;
                Corner {
                    position: mesh.positions[v],
                    normal: mesh.normals[v],
                    material: materials[k],
                    coordinates: mesh.texcoords[v],
                    third: 0.0,
                }
            };
            self.triangle([0, 1, 2].map(corner));
        }
    }

    /// Says what keeps a shape, or a part of it, from being drawn.
    pub fn complain(&mut self, node: NodeRef<'_>, what: &str) {
        if self.surveying {
            return;
        }
        let mut trouble =
            Diagnostic::warning(format!("this `{}` is not drawn: {what}", node.class_name()));
        if let Some(source) = node.source() {
            trouble = trouble.at(source, node.span());
        }
        self.troubles.push(trouble);
    }

    /// Says that a shape is not drawn whole, once a node.
    pub(super) fn tell_of_bad_parts(&mut self, node: NodeRef<'_>) {
        if !self.told.insert(node.id) {
            return;
        }
        let class = node.class_name();
        let mut trouble = Diagnostic::warning(format!("parts of this `{class}` are left out"));
        if let Some(source) = node.source() {
            trouble = trouble.at(source, node.span());
        }
        self.troubles.push(trouble.with_help(
            "an index without a coordinate, a number that is none or far too large, or a scale of 0",
        ));
    }

    /// Draws the current shape in its diffuse colors, whatever the lights.
    pub fn set_unlit(&mut self) {
        if let Some(surface) = self.scene.surfaces.last_mut() {
            surface.base_color = true;
        }
    }

    /// Gives the current shape letters for a texture, texel for texel.
    pub fn set_letters(&mut self, letters: Texture) {
        let Some(surface) = self.scene.surfaces.last_mut() else {
            return;
        };
        surface.texture = Some(TextureUse {
            texture: Arc::new(letters),
            model: crate::traversal::state::TextureModel::Modulate,
            blend_color: Vec3::ZERO,
            repeat: Repeat::NONE,
            filter: Filter::Nearest,
            matrix: glam::Mat4::IDENTITY,
            mapping: Mapping::Stored,
        });
        self.uses_coordinates = true;
        self.scene.census.transparent = true;
    }

    /// Stands the camera that later shapes are measured by.
    pub fn set_camera(&mut self, camera: CameraPose) {
        self.camera = Some(camera);
    }

    /// Width and height of the current shape's texture, in texels.
    pub fn texture_size(&self) -> Option<(f32, f32)> {
        let texture = &self.scene.surfaces.last()?.texture.as_ref()?.texture;
        Some((texture.width as f32, texture.height as f32))
    }

    /// The index of the current shape's inside against its outside.
    pub fn set_refraction(&mut self, index: f32) {
        if let Some(surface) = self.scene.surfaces.last_mut() {
            surface.refraction = index;
        }
    }

    pub fn quadric(&mut self, kind: QuadricKind, material: u32) {
        if self.surveying {
            let (min, max) = exact_bounds(kind, &self.scene_from_object);
            if min.is_finite() && max.is_finite() {
                grow(&mut self.bounds, min + self.origin, max + self.origin);
            }
            let (min, max) = exact_bounds(kind, &DAffine3::IDENTITY);
            grow(&mut self.object_bounds, min, max);
            return;
        }
        // A texture with depth needs the exact points.
        let cuts = self.needs.facets && !self.uses_thirds;
        if cuts || self.outlines() {
            self.facets(kind, material);
            return;
        }
        if self.has_no_room() {
            return;
        }
        match Quadric::new(kind, self.scene_from_object, material) {
            Some(quadric) if is_box_in_reach(quadric.bounds()) => {
                self.scene.census.quadrics += 1;
                self.scene.quadrics.push(quadric);
                self.owners[1].push(self.scene.surfaces.len() as u32 - 1);
            }
            Some(_) => self.scene.census.bad_corners += 1,
            // Pressed flat, it has no inside that a ray could be asked about.
            None => self.facets(kind, material),
        }
    }

    fn facets(&mut self, kind: QuadricKind, material: u32) {
        for polygon in facets(kind, self.complexity, material) {
            if self.outlines() {
                self.outline(&polygon);
                continue;
            }
            for pair in polygon[1..].windows(2) {
                self.triangle([polygon[0], pair[0], pair[1]]);
            }
        }
    }

    /// From here the line pattern begins anew.
    pub fn begin_line(&mut self) {
        self.pattern_at = 0.0;
    }

    /// A line between two points, as wide as `width` pixels.
    pub fn line(&mut self, ends: [Corner; 2], width: f32) {
        self.stroke(ends, width);
    }

    /// A square of `size` pixels.
    pub fn dot(&mut self, corner: Corner, size: f32) {
        self.stroke([corner, corner], size);
    }

    fn stroke(&mut self, ends: [Corner; 2], width: f32) {
        let (a, b) = (ends[0].position, ends[1].position);
        if !a.is_finite() || !b.is_finite() {
            self.scene.census.bad_corners += 1;
            return;
        }
        if self.surveying {
            self.extend(a);
            self.extend(b);
            return;
        }
        if self.has_no_room() {
            return;
        }
        let place = |p: Vec3| {
            self.scene_from_object
                .transform_point3(p.as_dvec3())
                .as_vec3()
        };
        let (a, b) = (place(a), place(b));
        if !in_reach(a) || !in_reach(b) {
            self.scene.census.bad_corners += 1;
            return;
        }
        let width = if width > 0.0 { width } else { 1.0 }.min(WIDEST);
        let view = self.scene.view;
        let mut stroke = Stroke::new([a, b], width, &view)
            .with_pattern(self.drawing.line_pattern, self.pattern_at);
        if stroke.has_gaps() {
            self.pattern_at = stroke.pattern_end(&view);
        }
        stroke.face = self.face_normal;
        stroke.materials = ends.map(|e| e.material);
        stroke.normals = ends.map(|e| match e.normal {
            Vec3::ZERO => Vec3::ZERO,
            normal => turn(&self.normal_matrix, normal),
        });
        stroke.coordinates = ends.map(|e| e.coordinates);
        if self.drawing.style == DrawStyle::Filled
            && let Some(surface) = self.scene.surfaces.last_mut()
        {
            surface.layer = 1; // lines of their own stay where they are
        }
        self.scene.census.strokes += 1;
        self.scene.strokes.push(stroke);
        self.owners[2].push(self.scene.surfaces.len() as u32 - 1);
    }

    fn has_no_room(&mut self) -> bool {
        let count =
            self.scene.triangles.len() + self.scene.quadrics.len() + self.scene.strokes.len();
        if count < self.max_primitives {
            return false;
        }
        self.tell_of_the_limit();
        true
    }

    fn tell_of_the_limit(&mut self) {
        if !self.over_limit {
            self.over_limit = true;
            let trouble = Diagnostic::warning(format!(
                "the scene has more than {} primitives; the rest is left out",
                self.max_primitives
            ));
            let help = "`--scene-limit primitives=N` raises this";
            self.troubles.push(trouble.with_help(help));
        }
    }

    pub(super) fn finish(mut self) -> Result<RenderScene> {
        if let Some(Some(fog)) = self.fog {
            let clear = |s: &&mut Surface| s.environment.fog == FogKind::None;
            for surface in self.scene.surfaces.iter_mut().filter(clear) {
                let (fog, fog_color, visibility) = (fog.fog, fog.fog_color, fog.visibility);
                surface.environment = EnvironmentElement {
                    fog,
                    fog_color,
                    visibility,
                    ..surface.environment
                };
            }
        }
        self.own();
        let mut owners = std::mem::take(&mut self.owners[0]);
        owners.append(&mut self.owners[1]);
        owners.append(&mut self.owners[2]);
        self.scene.owners = owners;
        let lights: HashSet<NodeId> = self
            .light_sets
            .values()
            .flat_map(|(_, set)| set.iter().map(|l| l.node))
            .collect();
        self.scene.census.lights = lights.len() as u64;
        self.scene.census.troubles = self.troubles;
        Ok(self.scene)
    }
}

/// The camera as lines and points know it; without one, at the origin and a quarter turn wide.
fn view(options: &CompileOptions) -> StrokeView {
    let (camera, pixel_rows) = (options.camera.as_ref(), options.pixel_rows);
    let rows = f64::from(pixel_rows.max(1));
    let turn = camera.map_or(glam::DQuat::IDENTITY, |c| c.orientation);
    let (fixed, per_depth) = match camera.map(|c| c.projection) {
        Some(Projection::Orthographic { height }) => (height / rows, 0.0),
        Some(Projection::Perspective { height_angle }) => {
            (0.0, 2.0 * libm::tan(0.5 * height_angle) / rows)
        }
        None => (0.0, 2.0 * libm::tan(std::f64::consts::PI / 8.0) / rows),
    };
    StrokeView {
        right: (turn * DVec3::X).as_vec3(),
        up: (turn * DVec3::Y).as_vec3(),
        forward: camera.map_or(DVec3::NEG_Z, CameraPose::direction).as_vec3(),
        fixed: fixed as f32,
        per_depth: per_depth as f32,
    }
}

/// 0 for faces that are pushed back, 1 for most, 2 for those that are pulled forward.
fn layer(drawing: &Drawing) -> u8 {
    let style = match drawing.style {
        DrawStyle::Filled => 1,
        DrawStyle::Lines => 2,
        DrawStyle::Points => 4,
        DrawStyle::Invisible => 0,
    };
    match drawing.offset {
        1 if drawing.offset_styles & style != 0 => 0,
        -1 if drawing.offset_styles & style != 0 => 2,
        _ => 1,
    }
}

/// Points farther away than this are left out: the squares of distances are no `f32` any more.
const FARTHEST: f32 = 1e18;

/// Room for more triangles is made as they come.
const MOST_EXPECTED: usize = 1 << 18;

/// Pixels of a line's width that make a difference.
const WIDEST: f32 = 1e5;

#[inline]
fn in_reach(p: Vec3) -> bool {
    let reaches = |v: f32| v.abs() < FARTHEST; // not so for NaN
    reaches(p.x) & reaches(p.y) & reaches(p.z)
}

/// A shape's normal in the scene, of length 1 or 0.
#[inline]
fn turn(normal_matrix: &DMat3, normal: Vec3) -> Vec3 {
    let turned = *normal_matrix * normal.as_dvec3();
    turned.normalize_or_zero().as_vec3()
}

fn is_box_in_reach((min, max): (DVec3, DVec3)) -> bool {
    in_reach(min.as_vec3()) && in_reach(max.as_vec3())
}

pub(super) fn grow(bounds: &mut Option<(DVec3, DVec3)>, min: DVec3, max: DVec3) {
    *bounds = Some(match *bounds {
        Some((a, b)) => (a.min(min), b.max(max)),
        None => (min, max),
    });
}

impl RenderScene {
    /// Walks the snapshot and compiles what it draws.
    pub fn compile(snapshot: &Snapshot<'_>, options: &CompileOptions) -> Result<Self> {
        let walk_options = WalkOptions {
            camera: options.camera.clone(),
            max_visits: options.max_visits,
            ..WalkOptions::default()
        };
        let mut builder = Builder::new(snapshot, options);
        builder.expect_all();
        traversal::walk(snapshot, &walk_options, &mut builder);
        let mut scene = builder.finish()?;
        scene.finalize()?;
        Ok(scene)
    }
}

impl<'a> Visitor<'a> for Builder<'a> {
    fn shape(&mut self, node: NodeRef<'a>, state: &State<'a>) {
        shapes::draw(node, state, self);
    }

    fn node(&mut self, node: NodeRef<'a>, _role: Role) {
        if let Some(class) = node.known_class() {
            self.scene.census.see(class.name);
            let dragged = class.name.ends_with("Dragger") || class.name.ends_with("Manip");
            if dragged && !self.snapshot.has_handles() {
                self.scene
                    .census
                    .ignore(class.name, "handles are not drawn without `--handles`");
            }
        }
    }

    fn bindable(&mut self, node: NodeRef<'a>, state: &State<'a>) {
        let is_fog = node.known_class().is_some_and(|c| c.name.ends_with("Fog"));
        if is_fog {
            self.fog.get_or_insert_with(|| fog97(node, state));
        } else if !self.background_set && !self.surveying {
            self.background_set = true;
            let pictures = self.needs.textures.then_some(&*self.texture_folders);
            let (background, troubles) = Background::of(node, state, pictures);
            self.scene.background = background;
            self.troubles.extend(troubles);
        }
    }

    fn screen_area(&mut self, node: NodeRef<'a>, state: &State<'a>) -> Option<f64> {
        self.camera.as_ref()?;
        let children = &node.data().children;
        let bounds = survey::bounds_of(self.snapshot, children, state.clone())?;
        Some(self.screen()?.area(bounds))
    }

    fn trouble(&mut self, trouble: Box<Diagnostic>) {
        self.troubles.push(trouble);
    }

    fn is_full(&self) -> bool {
        self.over_limit
    }
}
