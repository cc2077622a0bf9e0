//! The corners of vertex-based shapes, with their normals, materials and texture coordinates.

use glam::{Vec2, Vec3};
use ivcam_inventor::grammar::Field;
use ivcam_inventor::iv::NodeRef;
use ivcam_inventor::traversal::state::{Binding, Coordinates, State, TextureCoordinates, Wrapping};

use super::runs::Runs;
use super::triangle_list::IndexedTriangle;
use crate::geometry::{BoxCoordinates, Corner};

/// Returns a list of indices. Returns `None` if it is empty or starts with −1, for which Inventor
/// uses another list.
pub(crate) fn indices<'a>(node: NodeRef<'a>, field: Field<[i32]>) -> Option<&'a [i32]> {
    let list = node.get(field);
    list.first()
        .is_some_and(|&first| first >= 0)
        .then_some(list)
}

/// Returns the count or the index in a field; a negative one is 0.
pub(crate) fn count(node: NodeRef<'_>, field: Field<i32>) -> usize {
    usize::try_from(node.get(field)).unwrap_or(0)
}

/// The numbers of a corner in its shape, which the bindings use.
#[derive(Clone, Copy, Debug)]
pub(crate) struct VertexPlace {
    /// The index of its coordinate.
    pub coordinate: usize,
    /// The index in `coordIndex`, or the corner's number if there is no index.
    pub position: usize,
    /// The number of corners before this one, without separators.
    pub count: usize,
    /// The number of faces before this one.
    pub face: usize,
    /// The number of faces, strips or lines before this one.
    pub part: usize,
}

/// The normals of a shape.
pub(crate) enum Normals<'a> {
    /// The normals in the file, which are distributed by the binding.
    Given(&'a [Vec3]),
    /// Generated normals, with what each of them is for.
    Generated(Vec<Vec3>, NormalPer),
    /// No normals: +z is used, as in Inventor.
    None,
    /// Zero normals, for lines and points that face the camera.
    Zero,
}

/// What each generated normal is for.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum NormalPer {
    /// One [`Place::position`].
    Position,
    /// One face.
    Face,
    /// One part.
    Part,
    /// The whole shape.
    Shape,
}

/// The lists of a shape, which make corners by the bindings in force.
pub(crate) struct Vertices<'a, 's> {
    /// The state at the shape.
    pub state: &'s State<'a>,
    /// The points.
    pub coordinates: Coordinates<'a>,
    /// The normals.
    pub normals: Normals<'a>,
    /// How given normals are distributed.
    pub normal_binding: Binding,
    /// The field `normalIndex`, if it is used.
    pub normal_index: Option<&'a [i32]>,
    /// How materials are distributed.
    pub material_binding: Binding,
    /// The field `materialIndex`, if it is used.
    pub material_index: Option<&'a [i32]>,
    /// The field `textureCoordIndex`, if it is used.
    pub texture_index: Option<&'a [i32]>,
    /// The field `coordIndex`, if the shape has one.
    pub coord_index: Option<&'a [i32]>,
    /// Texture coordinates from the shape's box, for shapes without their own; `None` without a
    /// texture.
    pub boxed: Option<BoxCoordinates>,
}

impl<'a, 's> Vertices<'a, 's> {
    /// Returns the lists of a shape without an index, before normals and texture coordinates.
    pub(crate) fn unindexed(state: &'s State<'a>) -> Self {
        Self {
            state,
            coordinates: state.coordinates,
            normals: Normals::None,
            normal_binding: without_index(state.normal_binding),
            normal_index: None,
            material_binding: without_index(state.material_binding),
            material_index: None,
            texture_index: None,
            coord_index: None,
            boxed: None,
        }
    }
}

impl Vertices<'_, '_> {
    /// Returns a corner, or `None` if its coordinate does not exist.
    pub(crate) fn corner(&self, place: VertexPlace) -> Option<Corner> {
        let position = self.coordinates.get(place.coordinate)?;
        let normal = self.normal(place);
        let texture = match &self.boxed {
            Some(boxed) => self.texture(place, (position, normal), boxed),
            None => Vec3::ZERO,
        };
        Some(Corner {
            position,
            normal,
            material: self.material(place),
            coordinates: texture.truncate(),
            third: texture.z,
        })
    }

    /// Returns the corners of a triangle, or `None` if a coordinate does not exist. `counts` are
    /// the numbers of corners before each place ([`Runs::counts`]).
    pub(crate) fn corners(
        &self,
        triangle: &IndexedTriangle,
        runs: &Runs<'_>,
        counts: &[u32],
    ) -> Option<[Corner; 3]> {
        let [a, b, c] = triangle.corners.map(|p| {
            self.corner(VertexPlace {
                coordinate: runs.coordinate(p as usize),
                position: p as usize,
                count: counts[p as usize] as usize,
                face: triangle.face as usize,
                part: triangle.part as usize,
            })
        });
        Some([a?, b?, c?])
    }

    /// The source of the texture coordinates of a unit other than the first.
    pub(crate) fn further_coordinates(&self, unit: i32) -> TextureCoordinates<'_> {
        let mut units = self.state.further_textures.iter();
        let found = units.find(|further| further.unit == unit);
        found.map_or(TextureCoordinates::Default, |f| f.coordinates)
    }

    fn normal(&self, place: VertexPlace) -> Vec3 {
        let given = match &self.normals {
            Normals::None => return Vec3::Z,
            Normals::Zero => return Vec3::ZERO,
            Normals::Generated(made, by) => {
                let index = match by {
                    NormalPer::Position => place.position,
                    NormalPer::Face => place.face,
                    NormalPer::Part => place.part,
                    NormalPer::Shape => 0,
                };
                return made.get(index).copied().unwrap_or(Vec3::Z);
            }
            Normals::Given(given) => given,
        };
        let index = self.pick(self.normal_binding, self.normal_index, place);
        // If there are too few normals, the last one is used for the rest.
        given
            .get(index)
            .or(given.last())
            .copied()
            .unwrap_or(Vec3::Z)
    }

    fn material(&self, place: VertexPlace) -> u32 {
        self.pick(self.material_binding, self.material_index, place) as u32
    }

    /// Returns the index of a corner's entry in a list with a binding.
    fn pick(&self, binding: Binding, index: Option<&[i32]>, place: VertexPlace) -> usize {
        let through = |list: Option<&[i32]>, at: usize, otherwise: usize| match list {
            Some(list) => list
                .get(at)
                .and_then(|&i| usize::try_from(i).ok())
                .unwrap_or(0),
            None => otherwise,
        };
        match binding {
            Binding::Overall => 0,
            Binding::PerVertex => place.count,
            Binding::PerVertexIndexed => {
                through(index.or(self.coord_index), place.position, place.count)
            }
            Binding::PerFace => place.face,
            Binding::PerFaceIndexed => through(index, place.face, place.face),
            Binding::PerPart => place.part,
            Binding::PerPartIndexed => through(index, place.part, place.part),
        }
    }

    fn texture(&self, place: VertexPlace, at: (Vec3, Vec3), boxed: &BoxCoordinates) -> Vec3 {
        let index = if self.state.texture_indexed && self.coord_index.is_some() {
            self.texture_index
                .or(self.coord_index)
                .and_then(|list| list.get(place.position))
                .and_then(|&i| usize::try_from(i).ok())
                .unwrap_or(0)
        } else {
            place.count
        };
        match self.state.texture_coordinates {
            TextureCoordinates::Two(list) => {
                list.get(index).copied().unwrap_or_default().extend(0.0)
            }
            TextureCoordinates::Three(list) => list.get(index).copied().unwrap_or_default(),
            TextureCoordinates::Wrapped(wrapping) => {
                wrapped(boxed, wrapping, at.0, at.1).extend(0.0)
            }
            _ => boxed.at(at.0),
        }
    }
}

/// Returns the texture coordinates of a point for a texture that is wrapped around the shape's box.
pub(crate) fn wrapped(boxed: &BoxCoordinates, wrapping: Wrapping, p: Vec3, normal: Vec3) -> Vec2 {
    match wrapping {
        Wrapping::Sphere => boxed.on_sphere(p),
        Wrapping::Cylinder => boxed.on_cylinder(p, normal),
        Wrapping::Cube => boxed.on_cube(p, normal),
    }
}

/// Converts a binding for shapes whose parts are their faces.
pub(crate) fn faces_are_parts(binding: Binding) -> Binding {
    match binding {
        Binding::PerPart => Binding::PerFace,
        Binding::PerPartIndexed => Binding::PerFaceIndexed,
        other => other,
    }
}

/// Converts a binding for shapes without an index.
pub(crate) fn without_index(binding: Binding) -> Binding {
    match binding {
        Binding::PerPartIndexed => Binding::PerPart,
        Binding::PerFaceIndexed => Binding::PerFace,
        Binding::PerVertexIndexed => Binding::PerVertex,
        other => other,
    }
}

/// Whether a binding has one value or index for each vertex.
pub(crate) fn is_per_vertex(binding: Binding) -> bool {
    matches!(binding, Binding::PerVertex | Binding::PerVertexIndexed)
}
