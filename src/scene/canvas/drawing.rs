//! The interface that shapes draw through.

use glam::{DMat4, Vec3};

use super::picture_view::PictureView;
use super::placement::Placement;
use super::runs::Runs;
use super::triangle_list::TriangleList;
use super::vertices::Vertices;
use crate::geometry::{Corner, Mesh, QuadricKind};
use crate::iv::NodeRef;
use crate::scene::census::Census;
use crate::scene::looks::Texture;
use crate::snapshot::Corners;
use crate::traversal::state::State;

/// What of the current shape is read. Shapes leave out the rest.
#[derive(Clone, Copy, Debug, Default)]
pub(crate) struct Wants {
    pub normals: bool,
    /// Texture coordinates that corners bring.
    pub coordinates: bool,
    /// Faces are drawn as their edges or corners: [`Canvas::outline`] takes them whole.
    pub outlines: bool,
    /// Points that belong to the shape's box though nothing is drawn there.
    pub bounds: bool,
}

/// Which sides of a shape's faces are lit and seen.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Sides {
    /// Corners run counterclockwise as seen from outside.
    pub counterclockwise: bool,
    /// The back is lit as the front is.
    pub two_sided: bool,
    /// The back is not seen.
    pub culls: bool,
}

impl Sides {
    /// Both sides are seen and lit.
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

/// What the materials of a mesh are dealt out by.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum MaterialsBy {
    /// The colors of its vertices; the first where it has none.
    Vertex,
    /// The parts of its triangles, unless its vertices have colors.
    Part,
}

/// Takes what shapes draw, in the shape's own space.
pub(crate) trait Canvas {
    fn wants(&self) -> Wants;

    /// The picture by which sizes in pixels are measured.
    fn picture(&self) -> &PictureView;

    /// Whether shapes that `DrawStyle` hides, or `Complexity` shows as boxes, are drawn all the same.
    fn ignores_draw_style(&self) -> bool;

    /// Begins a shape: all that is drawn from here on belongs to it.
    fn begin(&mut self, node: NodeRef<'_>, state: &State<'_>);

    fn placement(&self) -> &Placement;

    fn set_placement(&mut self, placement: Placement);

    /// The current shape's texture.
    fn texture(&self) -> Option<&Texture> {
        None
    }

    /// Overrides the facing rules of the current shape, where its class has its own.
    fn set_sides(&mut self, _sides: Sides) {}

    /// Draws the current shape in its diffuse colors, whatever the lights.
    fn set_unlit(&mut self) {}

    /// Sets the index of refraction of the current shape's inside against its outside.
    fn set_refraction(&mut self, _index: f32) {}

    /// Gives the current shape letters for a texture, texel for texel.
    fn set_letters(&mut self, _letters: Texture) {}

    /// Draws triangles whose corners are looked up in the lists of a shape: `most` of them at most,
    /// which `cut` adds to the list that it is given.
    fn triangles(
        &mut self,
        runs: &Runs<'_>,
        vertices: &Vertices<'_, '_>,
        most: usize,
        cut: &mut dyn FnMut(&mut TriangleList<'_>),
    );

    fn triangle(&mut self, corners: [Corner; 3]);

    /// Draws the edges of a face, or its corners, as the draw style says.
    fn outline(&mut self, corners: &[Corner]);

    /// Draws triangles that a shape has made.
    fn mesh(&mut self, mesh: &Mesh, materials: MaterialsBy);

    /// Draws the triangles of a curved surface, which Inventor counts and bounds by its control
    /// points: they add nothing to the count or to Inventor's box.
    fn curved_mesh(&mut self, mesh: &Mesh) {
        self.mesh(mesh, MaterialsBy::Vertex);
    }

    fn quadric(&mut self, kind: QuadricKind, material: u32);

    /// Starts the line pattern from its beginning.
    fn begin_line(&mut self) {}

    /// Draws a line between two points, as wide as `width` pixels.
    fn line(&mut self, ends: [Corner; 2], width: f32);

    /// Draws a square of `size` pixels.
    fn dot(&mut self, corner: Corner, size: f32) {
        self.line([corner, corner], size);
    }

    /// Adds a point to the shape's box though nothing is drawn there, as Inventor does.
    fn bound(&mut self, _point: Vec3) {}

    /// Inventor's box of the current shape, in its own space; `None` where boxes are not wanted.
    fn inventor_box(&self) -> Option<Corners> {
        None
    }

    /// Sets what Inventor takes for the current shape's box, where it is not the box around what
    /// is drawn. The exact box stays.
    fn set_inventor_box(&mut self, _object: Option<Corners>) {}

    fn census(&mut self) -> &mut Census;

    /// Reports what keeps a shape, or a part of it, from being drawn.
    fn report(&mut self, _node: NodeRef<'_>, _what: &str) {}

    /// Reports that a shape is not drawn whole, once a node.
    fn report_bad_parts(&mut self, node: NodeRef<'_>);
}

impl dyn Canvas + '_ {
    /// Adds points to the shape's box. Where boxes are not wanted the points are not computed.
    pub(crate) fn bound_all(&mut self, points: impl Iterator<Item = Vec3>) {
        if self.wants().bounds {
            points.for_each(|p| self.bound(p));
        }
    }

    /// Draws under a further matrix, in the shape's own space.
    pub(crate) fn with_matrix(&mut self, matrix: DMat4, draw: impl FnOnce(&mut dyn Canvas)) {
        self.with_placement(self.placement().times(matrix), draw);
    }

    /// Draws under a matrix of its own.
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
