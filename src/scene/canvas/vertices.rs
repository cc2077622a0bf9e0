//! Corners of vertex shapes: which normal, material and texture coordinate each has.

use glam::{Vec2, Vec3};

use crate::geometry::{BoxCoordinates, Corner};
use crate::grammar::Field;
use crate::iv::NodeRef;
use crate::traversal::state::{Binding, Coordinates, State, TextureCoordinates, Wrapping};

/// Returns a list of indices, unless it is empty or starts with −1, which has Inventor take another
/// one.
pub(crate) fn indices<'a>(node: NodeRef<'a>, field: Field<[i32]>) -> Option<&'a [i32]> {
    let list = node.get(field);
    list.first()
        .is_some_and(|&first| first >= 0)
        .then_some(list)
}

/// Returns a count or an index that a field states; a negative one counts as 0.
pub(crate) fn count(node: NodeRef<'_>, field: Field<i32>) -> usize {
    usize::try_from(node.get(field)).unwrap_or(0)
}

/// Where a corner stands in its shape, by every way of counting.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Place {
    /// Index into the coordinates.
    pub coordinate: usize,
    /// Index into `coordIndex`, or the corner's number where there is none.
    pub position: usize,
    /// Corners before this one, separators not counted.
    pub count: usize,
    /// Faces before this one.
    pub face: usize,
    /// Faces, strips or lines before this one.
    pub part: usize,
}

/// Normals as the shape uses them.
pub(crate) enum Normals<'a> {
    Given(&'a [Vec3]),
    Made(Vec<Vec3>, By),
    /// None to be had: +z, as in Inventor.
    None,
    /// None needed: lines and points that face the camera.
    Zero,
}

/// What made normals are one each of.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum By {
    /// `Place::position`.
    Position,
    Face,
    Part,
    All,
}

/// Hands out corners by the bindings in force.
pub(crate) struct Vertices<'a, 's> {
    pub state: &'s State<'a>,
    pub coordinates: Coordinates<'a>,
    pub normals: Normals<'a>,
    pub normal_binding: Binding,
    pub normal_index: Option<&'a [i32]>,
    pub material_binding: Binding,
    pub material_index: Option<&'a [i32]>,
    pub texture_index: Option<&'a [i32]>,
    pub coord_index: Option<&'a [i32]>,
    /// Coordinates for a texture where the shape has none of its own; `None` without a texture.
    pub boxed: Option<BoxCoordinates>,
}

impl Vertices<'_, '_> {
    /// The corner; `None` where the coordinate does not exist.
    pub(crate) fn corner(&self, place: Place) -> Option<Corner> {
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

    fn normal(&self, place: Place) -> Vec3 {
        let given = match &self.normals {
            Normals::None => return Vec3::Z,
            Normals::Zero => return Vec3::ZERO,
            Normals::Made(made, by) => {
                let index = match by {
                    By::Position => place.position,
                    By::Face => place.face,
                    By::Part => place.part,
                    By::All => 0,
                };
                return made.get(index).copied().unwrap_or(Vec3::Z);
            }
            Normals::Given(given) => given,
        };
        let index = self.pick(self.normal_binding, self.normal_index, place);
        // Too few normals: the last stands for the rest.
        given
            .get(index)
            .or(given.last())
            .copied()
            .unwrap_or(Vec3::Z)
    }

    fn material(&self, place: Place) -> u32 {
        self.pick(self.material_binding, self.material_index, place) as u32
    }

    fn pick(&self, binding: Binding, index: Option<&[i32]>, place: Place) -> usize {
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

    fn texture(&self, place: Place, at: (Vec3, Vec3), boxed: &BoxCoordinates) -> Vec3 {
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
            TextureCoordinates::Wrapped(as_what) => wrapped(boxed, as_what, at.0, at.1).extend(0.0),
            _ => boxed.at(at.0),
        }
    }
}

/// Returns the texture coordinates of a point, wrapped around the box of its shape.
pub(crate) fn wrapped(boxed: &BoxCoordinates, as_what: Wrapping, p: Vec3, normal: Vec3) -> Vec2 {
    match as_what {
        Wrapping::Sphere => boxed.on_sphere(p),
        Wrapping::Cylinder => boxed.on_cylinder(p, normal),
        Wrapping::Cube => boxed.on_cube(p, normal),
    }
}

/// For shapes whose faces are their parts, and for those that have no index.
pub(crate) fn faces_are_parts(binding: Binding) -> Binding {
    match binding {
        Binding::PerPart => Binding::PerFace,
        Binding::PerPartIndexed => Binding::PerFaceIndexed,
        other => other,
    }
}

pub(crate) fn without_index(binding: Binding) -> Binding {
    match binding {
        Binding::PerPartIndexed => Binding::PerPart,
        Binding::PerFaceIndexed => Binding::PerFace,
        Binding::PerVertexIndexed => Binding::PerVertex,
        other => other,
    }
}

pub(crate) fn is_per_vertex(binding: Binding) -> bool {
    matches!(binding, Binding::PerVertex | Binding::PerVertexIndexed)
}
