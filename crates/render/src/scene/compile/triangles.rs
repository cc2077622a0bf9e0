//! Compiles triangles: single ones, meshes, and those of vertex-based shapes.
//!
//! Points, normals, materials and texture coordinates of a vertex-based shape are looked up for a
//! batch of triangles, one list after the other. Each point and each normal is transformed to the
//! scene once, however many corners it has.

use glam::{Vec2, Vec3};
use ivcam_inventor::traversal::state::{Binding, TextureCoordinates};

use super::deferred_text::glyph_offset;
use super::numbers::{Numbers, listed, three};
use super::scene_builder::SceneBuilder;
use crate::geometry::normals::face_normal;
use crate::geometry::{Corner, TriangleMesh};
use crate::scene::canvas::{
    IndexedTriangle, MaterialsBy, NormalPer, Normals, Points, Runs, SPARSE_RATIO, TriangleList,
    Vertices, draw_mesh, draw_triangles, wrapped,
};
use crate::scene::placement::Placement;
use crate::scene::precision::in_reach;

impl SceneBuilder {
    /// Keeps the triangles of a vertex-based shape.
    pub(super) fn keep_triangles(
        &mut self,
        runs: &Runs<'_>,
        vertices: &Vertices<'_, '_>,
        most: usize,
        cut: &mut dyn FnMut(&mut TriangleList<'_>),
    ) {
        if self.shape.outlines() {
            return draw_triangles(self, runs, vertices, cut);
        }
        let buffer = std::mem::take(&mut self.points);
        let placement = self.placement;
        let points = Points::of(runs, vertices, buffer, |p| placement.point(p), in_reach);
        let numbers = self.numbers_of(runs, vertices);
        let flat = numbers.has_flat_normals();
        self.reserve(most, flat);
        TriangleList::fill(cut, &mut |triangles| {
            points.drop_missing(triangles, runs, vertices);
            self.scene.census.bad_corners += points.drop_unsound(triangles, in_reach);
            let room = self.admit(triangles.len(), flat);
            let triangles = &triangles[..room];
            self.keep_positions(triangles, &points);
            self.keep_lists(triangles, runs, vertices, &numbers);
        });
        self.points = points.all;
    }

    /// Returns the rules for the lists of a shape, and keeps its normals.
    fn numbers_of<'v>(&mut self, runs: &Runs<'v>, vertices: &'v Vertices<'_, '_>) -> Lookup<'v> {
        let coord = vertices.coord_index;
        let mut lookup = Lookup::default();
        if self.shape.uses.normals
            && let Some(surface) = self.scene.surfaces.last_mut()
        {
            let normals = normals(runs, vertices, &self.placement);
            lookup.normals = normals.numbers;
            lookup.last_normal = normals.last;
            // The list begins with the lowest normal that is used.
            let first = surface.normals.append(normals.list);
            lookup.first_normal = first.wrapping_sub(normals.lowest);
        }
        if self.shape.uses.materials {
            let (binding, index) = (vertices.material_binding, vertices.material_index);
            lookup.materials = Numbers::of(binding, index, coord, runs);
        }
        if vertices.boxed.is_some() {
            let indexed = vertices.state.texture_indexed && coord.is_some();
            let binding = if indexed {
                Binding::PerVertexIndexed
            } else {
                Binding::PerVertex
            };
            lookup.coordinates = Numbers::of(binding, vertices.texture_index, coord, runs);
        }
        lookup
    }

    /// Keeps the positions of the corners of some triangles.
    fn keep_positions(&mut self, triangles: &[IndexedTriangle], points: &Points<'_>) {
        let all = &*points.all;
        match points.index {
            Some(index) => {
                let first = points.first;
                let at = |p: u32| all[(index[p as usize] as u32 - first) as usize];
                let corners = triangles.iter().map(|t| three(t.corners, at));
                self.scene.triangles.extend(corners);
            }
            None => {
                let corners = triangles
                    .iter()
                    .map(|t| three(t.corners, |p| all[p as usize]));
                self.scene.triangles.extend(corners);
            }
        }
    }

    /// Keeps the normals, materials and texture coordinates of the corners of some triangles.
    fn keep_lists(
        &mut self,
        triangles: &[IndexedTriangle],
        runs: &Runs<'_>,
        vertices: &Vertices<'_, '_>,
        lookup: &Lookup<'_>,
    ) {
        let uses = self.shape.uses;
        let Some(surface) = self.scene.surfaces.last_mut() else {
            return;
        };
        if uses.normals {
            let (first, last) = (lookup.first_normal, lookup.last_normal);
            let number = |number: u32| first.wrapping_add(number.min(last));
            match surface.normals.flat() {
                Some(flat) if lookup.has_flat_normals() => {
                    flat.extend(triangles.iter().map(|t| number(t.face)));
                }
                _ => {
                    let corners = surface.normals.corners();
                    lookup.normals.each(triangles, corners, number);
                }
            }
        }
        if uses.materials {
            lookup
                .materials
                .each(triangles, &mut surface.materials, |number| number);
        }
        if uses.coordinates {
            let numbers = &lookup.coordinates;
            let source = vertices.state.texture_coordinates;
            let coordinates = &mut surface.coordinates;
            let thirds = uses.thirds.then_some(&mut surface.thirds);
            let shape = (triangles, runs, vertices);
            keep_coordinates(coordinates, thirds, source, shape, numbers);
            let further = surface.further_textures.iter_mut();
            for further in further.filter(|f| f.has_coordinates()) {
                let source = vertices.further_coordinates(further.unit);
                let coordinates = &mut further.coordinates;
                keep_coordinates(coordinates, None, source, shape, numbers);
            }
        }
    }

    /// Keeps a glyph with its origin at a place.
    pub(super) fn keep_glyph(&mut self, mesh: &TriangleMesh, at: Vec2, materials: MaterialsBy) {
        let placement = self.placement;
        self.placement = placement.moved_to(self.world * glyph_offset(at));
        self.keep_mesh(mesh, materials);
        self.placement = placement;
    }

    /// Keeps a mesh.
    pub(super) fn keep_mesh(&mut self, mesh: &TriangleMesh, materials: MaterialsBy) {
        if !mesh.is_sound() {
            self.scene.census.bad_corners += 1;
            return;
        }
        self.reserve(mesh.triangles.len(), false);
        let by_part = materials == MaterialsBy::Part && mesh.colors.is_empty();
        let placement = self.placement;
        let moved = mesh.positions.iter().map(|p| placement.point(*p));
        let points: Vec<Vec3> = moved.collect();
        if self.shape.outlines() || !points.iter().all(|p| in_reach(*p)) {
            return draw_mesh(self, mesh, materials);
        }
        let room = self.admit(mesh.triangles.len(), false);
        if room == 0 {
            return;
        }
        let triangles = &mesh.triangles[..room];
        let corners = triangles.iter().map(|t| t.map(|v| points[v as usize]));
        self.scene.triangles.extend(corners);
        let uses = self.shape.uses;
        let Some(surface) = self.scene.surfaces.last_mut() else {
            return;
        };
        if uses.normals {
            let turned = mesh.normals.iter().map(|n| placement.normal(*n)).collect();
            let first = surface.normals.append(turned);
            let numbers = triangles.iter().map(|t| t.map(|v| first + v));
            surface.normals.corners().extend(numbers);
        }
        if uses.materials {
            let materials = (0..room).map(|i| mesh.materials(i, by_part));
            surface.materials.extend(materials);
        }
        if uses.coordinates {
            let at = |v: u32| mesh.texcoords[v as usize];
            surface
                .coordinates
                .extend(triangles.iter().map(|t| t.map(at)));
        }
        if uses.thirds {
            surface.thirds.extend(triangles.iter().map(|_| [0.0; 3]));
        }
    }

    /// Keeps a triangle, or its edges or vertices, depending on the draw style.
    pub(super) fn keep_triangle(&mut self, corners: [Corner; 3]) {
        if self.shape.outlines() {
            return self.edges(&corners);
        }
        let moved = corners.map(|c| self.placement.point(c.position));
        let sound = |(c, p): (&Corner, &Vec3)| c.position.is_finite() && in_reach(*p);
        if !corners.iter().zip(&moved).all(sound) {
            self.scene.census.bad_corners += 1;
            return;
        }
        if self.admit(1, false) == 0 {
            return;
        }
        self.scene.triangles.push(moved);
        let uses = self.shape.uses;
        let Some(surface) = self.scene.surfaces.last_mut() else {
            return;
        };
        if uses.normals {
            let placement = &self.placement;
            surface
                .normals
                .push(corners.map(|c| placement.normal(c.normal)));
        }
        if uses.materials {
            surface.materials.push(corners.map(|c| c.material));
        }
        if uses.coordinates {
            surface.coordinates.push(corners.map(|c| c.coordinates));
        }
        if uses.thirds {
            surface.thirds.push(corners.map(|c| c.third));
        }
    }
}

/// The rules for the lists of a shape.
struct Lookup<'v> {
    normals: Numbers<'v>,
    /// The index that normal 0 of the shape would have in the surface's list.
    first_normal: u32,
    /// The shape's last normal, which is used for missing ones.
    last_normal: u32,
    materials: Numbers<'v>,
    coordinates: Numbers<'v>,
}

impl Lookup<'_> {
    /// Whether all corners of a face have the same normal.
    fn has_flat_normals(&self) -> bool {
        matches!(self.normals, Numbers::Face)
    }
}

impl Default for Lookup<'_> {
    fn default() -> Self {
        Self {
            normals: Numbers::Same,
            first_normal: 0,
            last_normal: 0,
            materials: Numbers::Same,
            coordinates: Numbers::Same,
        }
    }
}

/// Keeps the texture coordinates of triangles. They are given, wrapped around the shape's box, or
/// the default ones along the box.
fn keep_coordinates(
    coordinates: &mut Vec<[Vec2; 3]>,
    thirds: Option<&mut Vec<[f32; 3]>>,
    source: TextureCoordinates<'_>,
    (triangles, runs, vertices): (&[IndexedTriangle], &Runs<'_>, &Vertices<'_, '_>),
    numbers: &Numbers<'_>,
) {
    let point = |position: u32| {
        let point = vertices.coordinates.get(runs.coordinate(position as usize));
        point.unwrap_or_default()
    };
    match (source, &vertices.boxed) {
        (TextureCoordinates::Two(list), _) => {
            let at = |number: u32| list.get(number as usize).copied().unwrap_or_default();
            numbers.each(triangles, coordinates, at);
        }
        (TextureCoordinates::Three(list), _) => {
            let at = |number: u32| list.get(number as usize).copied().unwrap_or_default();
            numbers.each(triangles, coordinates, |number| at(number).truncate());
            if let Some(thirds) = thirds {
                numbers.each(triangles, thirds, |number| at(number).z);
            }
            return;
        }
        (TextureCoordinates::Wrapped(wrapping), Some(boxed)) => {
            coordinates.extend(triangles.iter().map(|triangle| {
                let corners = triangle.corners.map(point);
                let normal = face_normal(&corners, true);
                corners.map(|p| wrapped(boxed, wrapping, p, normal))
            }));
        }
        (_, Some(boxed)) => {
            let at = |position: u32| boxed.at(point(position));
            Numbers::Position.each(triangles, coordinates, |p| at(p).truncate());
            if let Some(thirds) = thirds {
                Numbers::Position.each(triangles, thirds, |position| at(position).z);
            }
            return;
        }
        (_, None) => Numbers::Same.each(triangles, coordinates, |_| Vec2::ZERO),
    }
    if let Some(thirds) = thirds {
        Numbers::Same.each(triangles, thirds, |_| 0.0);
    }
}

/// The normals that a shape uses, transformed to the scene.
struct SceneNormals<'v> {
    list: Vec<Vec3>,
    numbers: Numbers<'v>,
    /// The number of the list's first normal in the shape.
    lowest: u32,
    /// The number of the shape's last normal.
    last: u32,
}

/// Returns the normals that a shape uses, transformed to the scene.
fn normals<'v>(
    runs: &Runs<'_>,
    vertices: &'v Vertices<'_, '_>,
    placement: &Placement,
) -> SceneNormals<'v> {
    let (list, numbers): (&[Vec3], _) = match &vertices.normals {
        Normals::None => (&[Vec3::Z], Numbers::Same),
        Normals::Zero => (&[Vec3::ZERO], Numbers::Same),
        Normals::Generated(list, by) => {
            let numbers = match by {
                NormalPer::Position => Numbers::Position,
                NormalPer::Face => Numbers::Face,
                NormalPer::Part => Numbers::Part,
                NormalPer::Shape => Numbers::Same,
            };
            (list, numbers)
        }
        Normals::Given(list) => {
            let (binding, coord) = (vertices.normal_binding, vertices.coord_index);
            let numbers = Numbers::of(binding, vertices.normal_index, coord, runs);
            (list, numbers)
        }
    };
    let list = if list.is_empty() { &[Vec3::Z] } else { list };
    let (positions, last) = (runs.positions(), list.len() - 1);
    let used = match numbers {
        Numbers::Listed(index) => {
            let all = runs.runs.iter().flat_map(|run| run.positions());
            let all = all.map(|p| (listed(index, p as u32) as usize).min(last));
            let (lowest, highest) = all.fold((last, 0), |(l, h), n| (l.min(n), h.max(n)));
            lowest.min(highest)..highest + 1
        }
        Numbers::FaceListed(_) | Numbers::PartListed(_) => 0..last + 1,
        // All other numbers are less than the number of corners.
        _ => 0..(last + 1).min(positions.max(1)),
    };
    if let Numbers::Listed(index) = numbers
        && used.len() > SPARSE_RATIO * positions
    {
        let at = |p: u32| list[(listed(index, p) as usize).min(last)];
        let turned = (0..positions as u32).map(|p| placement.normal(at(p)));
        return SceneNormals {
            list: turned.collect(),
            numbers: Numbers::Position,
            lowest: 0,
            last: u32::MAX,
        };
    }
    let turned = list[used.clone()].iter().map(|n| placement.normal(*n));
    SceneNormals {
        list: turned.collect(),
        numbers,
        lowest: used.start as u32,
        last: last as u32,
    }
}
