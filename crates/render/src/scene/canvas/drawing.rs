//! The canvas: the interface through which shapes draw.

use glam::{DMat4, Vec2, Vec3};
use ivcam_inventor::iv::NodeRef;
use ivcam_inventor::snapshot::Corners;
use ivcam_inventor::traversal::state::State;

use super::mistake::Mistake;
use super::picture_view::PictureView;
use super::reports::Reports;
use super::runs::Runs;
use super::triangle_list::TriangleList;
use super::vertices::Vertices;
use crate::geometry::text::MissingCharacters;
use crate::geometry::{Corner, QuadricKind, TriangleMesh};
use crate::scene::census::Census;
use crate::scene::looks::Texture;
use crate::scene::placement::Placement;

/// What a canvas needs of the current shape. The shape may leave out the rest.
#[derive(Clone, Copy, Debug, Default)]
pub(crate) struct Wants {
    /// The normals of corners.
    pub normals: bool,
    /// The texture coordinates of corners.
    pub coordinates: bool,
    /// Whole faces for [`Canvas::outline`], because their edges or vertices are drawn.
    pub outlines: bool,
    /// Points that extend the shape's box although nothing is drawn there.
    pub bounds: bool,
}

/// Which sides of a shape's faces are lit and visible.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Sides {
    /// Whether corners run counterclockwise as seen from outside.
    pub counterclockwise: bool,
    /// Whether the back is lit like the front.
    pub two_sided: bool,
    /// Whether the back is invisible.
    pub culls: bool,
}

impl Sides {
    /// Both sides are visible and lit.
    pub(crate) const BOTH: Self = Self {
        counterclockwise: true,
        two_sided: true,
        culls: false,
    };

    /// The sides of VRML 97's field `solid`.
    pub(crate) fn of_solid(solid: bool, counterclockwise: bool) -> Self {
        Self {
            counterclockwise,
            two_sided: !solid,
            culls: solid,
        }
    }
}

/// How the materials of a mesh are distributed.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum MaterialsBy {
    /// By the colors of its vertices. Without them the first material is used.
    Vertex,
    /// By the parts of its triangles, unless its vertices have colors.
    Part,
}

/// Draws the triangles of a vertex-based shape.
pub(crate) fn draw_triangles(
    out: &mut (impl Canvas + ?Sized),
    runs: &Runs<'_>,
    vertices: &Vertices<'_, '_>,
    cut: &mut dyn FnMut(&mut TriangleList<'_>),
) {
    let counts = runs.counts();
    TriangleList::fill(cut, &mut |triangles| {
        for triangle in triangles.iter() {
            if let Some(corners) = vertices.corners(triangle, runs, &counts) {
                out.triangle(corners);
            }
        }
    });
}

/// Draws the triangles of a mesh.
pub(crate) fn draw_mesh(
    out: &mut (impl Canvas + ?Sized),
    mesh: &TriangleMesh,
    materials: MaterialsBy,
) {
    let by_part = materials == MaterialsBy::Part && mesh.colors.is_empty();
    for (i, triangle) in mesh.triangles.iter().enumerate() {
        let materials = mesh.materials(i, by_part);
        out.triangle([0, 1, 2].map(|k| {
            let v = triangle[k] as usize;
            Corner {
                position: mesh.positions[v],
                normal: mesh.normals[v],
                material: materials[k],
                coordinates: mesh.texcoords[v],
                third: 0.0,
            }
        }));
    }
}

/// Receives the geometry of shapes, in object space.
pub(crate) trait Canvas {
    /// What the canvas needs of the current shape.
    fn wants(&self) -> Wants;

    /// The picture that sizes in pixels refer to.
    fn picture(&self) -> &PictureView;

    /// The picture whose pixels decide how finely curves and curved surfaces are cut, or `None` if
    /// their complexity decides.
    fn resolved_picture(&self) -> Option<&PictureView> {
        None
    }

    /// Whether `DrawStyle` and the boxes of `Complexity` are ignored, so that all shapes are drawn.
    fn ignores_draw_style(&self) -> bool {
        false
    }

    /// Begins a shape. Everything drawn until the next call belongs to it.
    fn begin(&mut self, node: NodeRef<'_>, state: &State<'_>);

    /// The placement of the current shape.
    fn placement(&self) -> &Placement;

    /// Changes the placement of the current shape.
    fn set_placement(&mut self, placement: Placement);

    /// The current shape's texture.
    fn texture(&self) -> Option<&Texture> {
        None
    }

    /// Sets the sides of the current shape, if its class has its own rules.
    fn set_sides(&mut self, _sides: Sides) {}

    /// Draws the current shape in its diffuse colors, whatever the lights.
    fn set_unlit(&mut self) {}

    /// Sets the index of refraction of the current shape's inside relative to its outside.
    fn set_refraction(&mut self, _index: f32) {}

    /// Sets the texture of the current shape to rasterized text, without interpolation.
    fn set_text_texture(&mut self, _text: Texture) {}

    /// Draws triangles whose corners are in the lists of a shape; by default one by one. `cut`
    /// adds at most `_most` triangles to the list.
    fn triangles(
        &mut self,
        runs: &Runs<'_>,
        vertices: &Vertices<'_, '_>,
        _most: usize,
        cut: &mut dyn FnMut(&mut TriangleList<'_>),
    ) {
        draw_triangles(self, runs, vertices, cut);
    }

    /// Returns whether there is memory to make a shape of a number of bytes before it is drawn. If
    /// not, this is reported, and the shape is not to be drawn.
    fn has_memory(&mut self, _bytes: u64) -> bool {
        true
    }

    /// Draws a triangle.
    fn triangle(&mut self, corners: [Corner; 3]);

    /// Draws the edges or the vertices of a face, depending on the draw style.
    fn outline(&mut self, _corners: &[Corner]) {}

    /// Draws a mesh; by default one triangle after the other.
    fn mesh(&mut self, mesh: &TriangleMesh, materials: MaterialsBy) {
        if mesh.is_sound() {
            draw_mesh(self, mesh, materials);
        }
    }

    /// Whether the glyphs of a text are drawn by [`Self::glyph`].
    fn takes_glyphs(&self) -> bool {
        false
    }

    /// Draws a glyph: its number and its triangles, as `TextOutput::Glyphs` passes them, with its
    /// origin at a place in the plane z = 0.
    fn glyph(&mut self, _glyph: (usize, &TriangleMesh), _at: Vec2, _materials: MaterialsBy) {}

    /// Draws the mesh of a curved surface. Inventor counts and bounds such a surface by its control
    /// points, so the mesh adds nothing to the count or to Inventor's box.
    fn curved_mesh(&mut self, mesh: &TriangleMesh) {
        self.mesh(mesh, MaterialsBy::Vertex);
    }

    /// Draws a round surface.
    fn quadric(&mut self, kind: QuadricKind, material: u32);

    /// Restarts the line pattern.
    fn begin_line(&mut self) {}

    /// Draws a line between two points, with a width in pixels.
    fn line(&mut self, _ends: [Corner; 2], _width: f32) {}

    /// Draws a square with a size in pixels.
    fn dot(&mut self, corner: Corner, size: f32) {
        self.line([corner, corner], size);
    }

    /// Extends the shape's box to a point although nothing is drawn there, as Inventor does.
    fn bound(&mut self, _point: Vec3) {}

    /// Inventor's box of the current shape in object space, or `None` if boxes are not needed.
    fn inventor_box(&self) -> Option<Corners> {
        None
    }

    /// Sets Inventor's box of the current shape, if it differs from the box of what is drawn. The
    /// exact box does not change.
    fn set_inventor_box(&mut self, _object: Option<Corners>) {}

    /// The counts of what is drawn.
    fn census(&mut self) -> &mut Census;

    /// The diagnostics of what is drawn, unless the canvas leaves them to another one.
    fn reports(&mut self) -> Option<&mut Reports> {
        None
    }

    /// Reports why a shape or a part of it is not drawn.
    fn report(&mut self, node: NodeRef<'_>, what: &str) {
        if let Some(reports) = self.reports() {
            reports.not_drawn(node, what);
        }
    }

    /// Reports why a part of a shape is not drawn.
    fn report_part(&mut self, node: NodeRef<'_>, what: &str) {
        if let Some(reports) = self.reports() {
            reports.cut(node, what);
        }
    }

    /// Reports the characters of a text that are not drawn as written.
    fn report_characters(&mut self, node: NodeRef<'_>, missing: &MissingCharacters) {
        if let Some(reports) = self.reports() {
            reports.characters(node, missing);
        }
    }

    /// Reports that parts of a shape are left out, once for each node.
    fn report_bad_parts(&mut self, node: NodeRef<'_>) {
        if let Some(reports) = self.reports() {
            reports.bad_parts(node);
        }
    }

    /// Notes a mistake in the lists of the current shape.
    fn note(&mut self, mistake: Mistake) {
        if let Some(reports) = self.reports() {
            reports.note(mistake);
        }
    }

    /// Reports the mistakes that were noted, once for each node.
    fn report_mistakes(&mut self, node: NodeRef<'_>) {
        if let Some(reports) = self.reports() {
            reports.mistakes(node);
        }
    }
}

impl dyn Canvas + '_ {
    /// Extends the shape's box to some points. They are not computed if boxes are not needed.
    pub(crate) fn bound_all(&mut self, points: impl Iterator<Item = Vec3>) {
        if self.wants().bounds {
            points.for_each(|p| self.bound(p));
        }
    }

    /// Draws with an additional matrix, in object space.
    pub(crate) fn with_matrix(&mut self, matrix: DMat4, draw: impl FnOnce(&mut dyn Canvas)) {
        self.with_placement(self.placement().times(matrix), draw);
    }

    /// Draws with a matrix to world space that replaces the current one.
    pub(crate) fn with_world(&mut self, world: DMat4, draw: impl FnOnce(&mut dyn Canvas)) {
        self.with_placement(self.placement().moved_to(world), draw);
    }

    fn with_placement(&mut self, placement: Placement, draw: impl FnOnce(&mut dyn Canvas)) {
        let kept = *self.placement();
        self.set_placement(placement);
        draw(self);
        self.set_placement(kept);
    }
}
