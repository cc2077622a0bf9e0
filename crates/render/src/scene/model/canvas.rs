//! The canvas that makes meshes: it welds the corners of a shape, in object space.

use glam::{DAffine3, DMat3, Vec3};
use ivcam_base::diag::Diagnostic;
use ivcam_inventor::iv::NodeRef;
use ivcam_inventor::traversal::state::{DrawStyle, DrawStyleElement, ShapeHints, State};

use super::feature::Feature;
use super::material::Material;
use super::mesh::{Mesh, Primitives};
use super::options::ModelOptions;
use super::surface::{Images, ModelSurface, TextureMapping};
use super::weld::{self, Lists};
use crate::geometry::{self, Corner, Fineness, QuadricKind};
use crate::scene::canvas::{
    Canvas, MaterialsBy, Mistake, PictureView, Reports, Sides, Wants, draw_facets, draw_mesh,
};
use crate::scene::census::Census;
use crate::scene::looks::Texture;
use crate::scene::placement::Placement;
use crate::scene::precision::in_reach;

/// The current shape.
struct ModelShape {
    surface: ModelSurface,
    drawing: DrawStyleElement,
    complexity: f32,
    hints: ShapeHints,
    sides: Option<Sides>,
    /// Whether its matrix mirrors it.
    is_mirrored: bool,
    triangles: (weld::WeldedVertices, Vec<[u32; 3]>),
    lines: (weld::WeldedVertices, Vec<[u32; 2]>),
    points: weld::WeldedVertices,
    has_points: bool,
    features: Vec<Feature>,
}

/// The meshes of a shape with their materials, and the features that they do not hold.
#[derive(Default)]
pub(super) struct Drawn {
    pub parts: Vec<(Mesh, Material)>,
    pub features: Vec<Feature>,
}

/// The canvas of models.
pub(super) struct MeshCanvas {
    ignores_draw_style: bool,
    fineness: Fineness,
    pub picture: PictureView,
    placement: Placement,
    /// The placement with which the shape began.
    object: Placement,
    /// The matrix from the placement to object space, if they differ.
    moved: Option<(DAffine3, DMat3)>,
    shape: Option<ModelShape>,
    pub images: Images,
    census: Census,
    pub reports: Reports,
    /// The number of primitives that can still be kept.
    left: usize,
    /// The largest number of primitives.
    most: usize,
}

impl MeshCanvas {
    pub(super) fn new(options: &ModelOptions) -> Self {
        let placement = Placement::around(glam::DVec3::ZERO);
        Self {
            ignores_draw_style: options.compile.ignore_draw_style,
            fineness: Fineness::within(options.error()),
            picture: PictureView::of(&options.compile),
            placement,
            object: placement,
            moved: None,
            shape: None,
            images: Images::new(&options.compile),
            census: Census::default(),
            reports: Reports::default(),
            left: options.compile.limits.primitives,
            most: options.compile.limits.primitives,
        }
    }

    /// Whether the limit of primitives is reached.
    pub(super) fn is_full(&self) -> bool {
        self.left == 0
    }

    /// Returns the meshes of the current shape, and ends it.
    pub(super) fn finish(&mut self) -> Drawn {
        let Some(shape) = self.shape.take() else {
            return Drawn::default();
        };
        shape.finish()
    }

    /// Counts a primitive, and returns whether it is within the limit.
    fn admit(&mut self) -> bool {
        if self.left == 0 {
            return false;
        }
        self.left -= 1;
        if self.left == 0 {
            let most = self.most;
            let text = format!("the scene has {most} primitives or more; the rest is left out");
            let help = "`--scene-limit primitives=N` raises this";
            self.reports.add(*Diagnostic::warning(text).with_help(help));
        }
        true
    }

    /// Returns a corner in object space, or `None` if it cannot be drawn.
    fn place(&mut self, corner: &Corner) -> Option<Corner> {
        if !in_reach(corner.position) || !in_reach(self.placement.point(corner.position)) {
            self.census.bad_corners += 1;
            return None;
        }
        let mut corner = *corner;
        if let Some((matrix, normals)) = &self.moved {
            let position = matrix.transform_point3(corner.position.as_dvec3());
            corner.position = position.as_vec3();
            let normal = *normals * corner.normal.as_dvec3();
            corner.normal = normal.normalize_or_zero().as_vec3();
            if !in_reach(corner.position) {
                self.census.bad_corners += 1;
                return None;
            }
        }
        corner.normal = unit(corner.normal);
        let surface = &self.shape.as_ref()?.surface;
        corner.coordinates = surface.coordinates(corner.coordinates, corner.position);
        if !corner.coordinates.is_finite() {
            corner.coordinates = glam::Vec2::ZERO;
        }
        Some(corner)
    }

    /// Keeps the edges or the vertices of a face, by the draw style.
    fn edges(&mut self, corners: &[Corner]) {
        let Some(drawing) = self.shape.as_ref().map(|s| s.drawing) else {
            return;
        };
        for (i, corner) in corners.iter().enumerate() {
            if drawing.style == DrawStyle::Points {
                self.dot(*corner, drawing.point_size);
            } else {
                let next = corners[(i + 1) % corners.len()];
                self.line([*corner, next], drawing.line_width);
            }
        }
    }

    fn outlines(&self) -> bool {
        let shape = self.shape.as_ref();
        shape.is_some_and(|shape| has_outlines(&shape.drawing))
    }

    /// Whether edges or vertices of shapes with a state are kept instead of faces.
    pub(super) fn will_outline(&self, state: &State<'_>) -> bool {
        !self.ignores_draw_style && has_outlines(&state.drawing)
    }
}

/// Whether only edges or vertices are drawn.
fn has_outlines(drawing: &DrawStyleElement) -> bool {
    matches!(drawing.style, DrawStyle::Lines | DrawStyle::Points)
}

/// Returns a vector with length 1, or zero.
fn unit(normal: Vec3) -> Vec3 {
    normal.as_dvec3().normalize_or_zero().as_vec3()
}

impl ModelShape {
    fn lists(&self) -> Lists {
        Lists {
            coordinates: self.surface.material.texture.is_some(),
            colors: self.surface.is_colorful(),
        }
    }

    /// Makes the meshes.
    fn finish(self) -> Drawn {
        let lists = self.lists();
        let mut features = self.features;
        let drawing = &self.drawing;
        let mut parts = Vec::new();
        let mut material = self.surface.material.clone();
        if let Some(sides) = self.sides {
            material.double_sided = !sides.culls;
        }
        let color = |m: u32| self.surface.color(m);
        if !self.triangles.1.is_empty() {
            let (vertices, triangles) = self.triangles;
            let mut mesh = vertices.into_mesh(Primitives::Triangles(triangles), lists, color);
            let flips = match self.sides {
                Some(sides) => sides.culls || sides.two_sided,
                None => self.hints.culls() || self.hints.two_sided(),
            };
            let counterclockwise = self
                .sides
                .map_or(self.hints.counterclockwise(), |s| s.counterclockwise);
            if flips {
                // A mirroring matrix exchanges front and back in Inventor, and not in the formats.
                turn(&mut mesh, |_| counterclockwise == self.is_mirrored);
            }
            complete_normals(&mut mesh);
            if !flips {
                let normals = mesh.normals.clone();
                turn_to_normals(&mut mesh, &normals);
                let is_lit = self.sides.is_none() && !material.unlit;
                let shows_dark = is_lit && mesh.shows_backs();
                features.extend(shows_dark.then_some(Feature::OneSidedLight));
            }
            parts.push((mesh, material.clone()));
        }
        material.double_sided = true;
        if !self.lines.1.is_empty() {
            let (vertices, lines) = self.lines;
            let mesh = vertices.into_mesh(Primitives::Lines(lines), lists, color);
            features.extend((drawing.line_width > 1.0).then_some(Feature::LineWidth));
            features.extend((drawing.line_pattern != 0xffff).then_some(Feature::LinePattern));
            let unlit = material.unlit || mesh.normals.is_empty();
            parts.push((
                mesh,
                Material {
                    unlit,
                    ..material.clone()
                },
            ));
        }
        if self.has_points {
            let mesh = self.points.into_mesh(Primitives::Points, lists, color);
            features.extend((drawing.point_size > 1.0).then_some(Feature::PointSize));
            let unlit = material.unlit || mesh.normals.is_empty();
            parts.push((mesh, Material { unlit, ..material }));
        }
        Drawn { parts, features }
    }
}

/// Exchanges two corners of the triangles for which `wrong` returns true.
fn turn(mesh: &mut Mesh, wrong: impl Fn(&[u32; 3]) -> bool) {
    if let Primitives::Triangles(list) = &mut mesh.primitives {
        for triangle in list.iter_mut().filter(|t| wrong(t)) {
            triangle.swap(1, 2);
        }
    }
}

/// Twice the area of a triangle along its normal.
fn area(positions: &[Vec3], triangle: &[u32; 3]) -> glam::DVec3 {
    let [a, b, c] = triangle.map(|v| positions[v as usize].as_dvec3());
    (b - a).cross(c - a)
}

/// Orders the corners of each triangle so that its front is where its normals point. If the order
/// is unknown, Inventor lights both sides by the normals alone.
fn turn_to_normals(mesh: &mut Mesh, normals: &[Vec3]) {
    let positions = std::mem::take(&mut mesh.positions);
    turn(mesh, |triangle| {
        let sum: Vec3 = triangle.iter().map(|v| normals[*v as usize]).sum();
        area(&positions, triangle).dot(sum.as_dvec3()) < 0.0
    });
    mesh.positions = positions;
}

/// Gives vertices without a normal that of their first triangle, or +z if it has no area.
fn complete_normals(mesh: &mut Mesh) {
    if mesh.normals.iter().all(|n| *n != Vec3::ZERO) {
        return;
    }
    if let Primitives::Triangles(list) = &mesh.primitives {
        for triangle in list {
            for v in triangle.map(|v| v as usize) {
                if mesh.normals[v] == Vec3::ZERO {
                    let normal = area(&mesh.positions, triangle).normalize_or_zero();
                    mesh.normals[v] = normal.as_vec3();
                }
            }
        }
    }
    for normal in mesh.normals.iter_mut().filter(|n| **n == Vec3::ZERO) {
        *normal = Vec3::Z;
    }
}

impl Canvas for MeshCanvas {
    fn wants(&self) -> Wants {
        let surface = self.shape.as_ref().map(|s| &s.surface);
        Wants {
            normals: true,
            coordinates: surface.is_some_and(|s| {
                s.material.texture.is_some() && s.mapping == TextureMapping::Stored
            }),
            outlines: self.outlines(),
            bounds: false,
        }
    }

    fn picture(&self) -> &PictureView {
        &self.picture
    }

    fn ignores_draw_style(&self) -> bool {
        self.ignores_draw_style
    }

    fn begin(&mut self, node: NodeRef<'_>, state: &State<'_>) {
        self.placement = self.placement.moved_to(state.world_from_object);
        self.object = self.placement;
        self.moved = None;
        let reports = &mut self.reports;
        let mut report = |d: Box<Diagnostic>| reports.add(*d);
        let (surface, mut features) = ModelSurface::of(state, &mut self.images, &mut report, node);
        let drawing = if self.ignores_draw_style {
            DrawStyleElement::DEFAULT
        } else {
            state.drawing
        };
        features.extend((!state.clip_planes.is_empty()).then_some(Feature::ClipPlane));
        features.extend(state.on_top.then_some(Feature::OnTop));
        features.extend((drawing.offset != 0).then_some(Feature::PolygonOffset));
        self.shape = Some(ModelShape {
            surface,
            drawing,
            complexity: state.complexity.value,
            hints: state.hints,
            sides: None,
            is_mirrored: self.placement.scene_from_object.matrix3.determinant() < 0.0,
            triangles: Default::default(),
            lines: Default::default(),
            points: Default::default(),
            has_points: false,
            features,
        });
    }

    fn placement(&self) -> &Placement {
        &self.placement
    }

    fn set_placement(&mut self, placement: Placement) {
        self.placement = placement;
        let (to, from) = (placement.scene_from_object, self.object.scene_from_object);
        self.moved = (to != from).then(|| {
            let matrix = from.inverse() * to;
            (matrix, matrix.matrix3.inverse().transpose())
        });
    }

    fn texture(&self) -> Option<&Texture> {
        self.shape.as_ref()?.surface.texture.as_deref()
    }

    fn set_sides(&mut self, sides: Sides) {
        if let Some(shape) = &mut self.shape {
            shape.sides = Some(sides);
        }
    }

    fn set_unlit(&mut self) {
        if let Some(shape) = &mut self.shape {
            shape.surface.material.unlit = true;
        }
    }

    fn set_text_texture(&mut self, text: Texture) {
        if let Some(shape) = &mut self.shape {
            shape.surface.set_text(text, &mut self.images);
        }
    }

    fn triangle(&mut self, corners: [Corner; 3]) {
        if self.outlines() {
            return self.edges(&corners);
        }
        let [Some(a), Some(b), Some(c)] = corners.map(|c| self.place(&c)) else {
            return;
        };
        let [p, q, r] = [a, b, c].map(|corner| corner.position);
        // Nothing is seen of a triangle with two corners in one place, and programs that read faces
        // with a repeated vertex may fail.
        if p == q || q == r || r == p || !self.admit() {
            return;
        }
        if let Some(shape) = &mut self.shape {
            let lists = shape.lists();
            let (vertices, list) = &mut shape.triangles;
            list.push([a, b, c].map(|corner| vertices.number(&corner, lists)));
        }
    }

    fn outline(&mut self, corners: &[Corner]) {
        self.edges(corners);
    }

    fn mesh(&mut self, mesh: &geometry::TriangleMesh, materials: MaterialsBy) {
        if !mesh.is_sound() {
            self.census.bad_corners += 1;
            return;
        }
        draw_mesh(self, mesh, materials);
    }

    fn quadric(&mut self, kind: QuadricKind, material: u32) {
        let fineness = match &self.shape {
            Some(shape) if self.outlines() => Fineness::of_complexity(shape.complexity),
            _ => self.fineness,
        };
        draw_facets(self, kind, fineness, material);
    }

    fn line(&mut self, ends: [Corner; 2], _width: f32) {
        let [Some(a), Some(b)] = ends.map(|c| self.place(&c)) else {
            return;
        };
        if !self.admit() {
            return;
        }
        if let Some(shape) = &mut self.shape {
            let lists = shape.lists();
            let (vertices, list) = &mut shape.lines;
            list.push([a, b].map(|corner| vertices.number(&corner, lists)));
        }
    }

    fn dot(&mut self, corner: Corner, _size: f32) {
        let Some(corner) = self.place(&corner) else {
            return;
        };
        if !self.admit() {
            return;
        }
        if let Some(shape) = &mut self.shape {
            let lists = shape.lists();
            shape.points.number(&corner, lists);
            shape.has_points = true;
        }
    }

    fn census(&mut self) -> &mut Census {
        &mut self.census
    }

    fn reports(&mut self) -> Option<&mut Reports> {
        Some(&mut self.reports)
    }

    /// Mistakes in the lists of a shape are reported by `check`, and change nothing in a model.
    fn note(&mut self, _mistake: Mistake) {}
}
