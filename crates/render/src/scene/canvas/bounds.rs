//! The canvas that counts and bounds, and keeps no geometry.

use glam::{DAffine3, DVec3, Vec3};
use ivcam_inventor::iv::NodeRef;
use ivcam_inventor::snapshot::Corners;
use ivcam_inventor::traversal::state::State;

use super::drawing::{Canvas, MaterialsBy, Wants};
use super::picture_view::PictureView;
use super::points::Points;
use super::reports::Reports;
use super::runs::Runs;
use super::triangle_list::TriangleList;
use super::vertices::Vertices;
use crate::geometry::quadric::exact_bounds;
use crate::geometry::{Corner, QuadricKind, TriangleMesh};
use crate::scene::census::Census;
use crate::scene::placement::Placement;

/// Extends a box so that it contains another one.
pub(crate) fn grow(bounds: &mut Option<Corners>, (min, max): Corners) {
    *bounds = Some(match *bounds {
        Some((a, b)) => (a.min(min), b.max(max)),
        None => (min, max),
    });
}

/// The canvas of surveys.
#[derive(Debug)]
pub(crate) struct BoundsCanvas {
    /// The picture that sizes in pixels refer to.
    pub picture: PictureView,
    /// The counts so far.
    pub census: Census,
    /// The diagnostics so far.
    pub reports: Reports,
    /// The exact bounding box of the current shape in world space.
    pub bounds: Option<Corners>,
    /// Inventor's box of the current shape in object space.
    pub object_bounds: Option<Corners>,
    /// The number of triangles so far.
    pub triangle_count: u64,
    placement: Placement,
    points: Vec<Vec3>,
}

impl BoundsCanvas {
    /// A canvas for a picture.
    pub(crate) fn new(picture: PictureView) -> Self {
        Self {
            picture,
            census: Census::default(),
            reports: Reports::default(),
            bounds: None,
            object_bounds: None,
            triangle_count: 0,
            placement: Placement::around(DVec3::ZERO),
            points: Vec::new(),
        }
    }

    /// Extends the boxes to a point.
    fn extend(&mut self, point: Vec3) {
        let object = point.as_dvec3();
        grow(&mut self.object_bounds, (object, object));
        let p = self.placement.scene_from_object.transform_point3(object);
        grow(&mut self.bounds, (p, p));
    }

    /// Extends the boxes to the corners of a primitive, or counts it as bad if one is not finite.
    fn extend_all(&mut self, corners: &[Corner]) {
        if corners.iter().all(|c| c.position.is_finite()) {
            corners.iter().for_each(|c| self.extend(c.position));
        } else {
            self.census.bad_corners += 1;
        }
    }
}

impl Canvas for BoundsCanvas {
    fn wants(&self) -> Wants {
        Wants {
            bounds: true,
            ..Wants::default()
        }
    }

    fn picture(&self) -> &PictureView {
        &self.picture
    }

    /// Returns true, because invisible shapes extend boxes in Inventor.
    fn ignores_draw_style(&self) -> bool {
        true
    }

    fn begin(&mut self, _node: NodeRef<'_>, state: &State<'_>) {
        self.placement = self.placement.moved_to(state.world_from_object);
        self.bounds = None;
        self.object_bounds = None;
    }

    fn placement(&self) -> &Placement {
        &self.placement
    }

    fn set_placement(&mut self, placement: Placement) {
        self.placement = placement;
    }

    fn triangles(
        &mut self,
        runs: &Runs<'_>,
        vertices: &Vertices<'_, '_>,
        _most: usize,
        cut: &mut dyn FnMut(&mut TriangleList<'_>),
    ) {
        let buffer = std::mem::take(&mut self.points);
        let points = Points::of(runs, vertices, buffer, |p| p, Vec3::is_finite);
        let mut used = vec![false; points.all.len()];
        let (mut count, mut bad) = (0, 0);
        TriangleList::fill(cut, &mut |triangles| {
            points.drop_missing(triangles, runs, vertices);
            count += triangles.len() as u64;
            bad += points.drop_unsound(triangles, Vec3::is_finite);
            for position in triangles.iter().flat_map(|t| t.corners) {
                used[points.number(position)] = true;
            }
        });
        self.triangle_count += count;
        self.census.bad_corners += bad;
        for (&point, _) in points.all.iter().zip(used).filter(|(_, used)| *used) {
            self.bound(point);
        }
        self.points = points.all;
    }

    fn triangle(&mut self, corners: [Corner; 3]) {
        self.triangle_count += 1;
        self.extend_all(&corners);
    }

    fn outline(&mut self, corners: &[Corner]) {
        self.extend_all(corners);
    }

    fn mesh(&mut self, mesh: &TriangleMesh, _materials: MaterialsBy) {
        if !mesh.is_sound() {
            self.census.bad_corners += 1;
            return;
        }
        self.triangle_count += mesh.triangles.len() as u64;
        for &v in mesh.triangles.iter().flatten() {
            self.extend(mesh.positions[v as usize]);
        }
    }

    fn curved_mesh(&mut self, mesh: &TriangleMesh) {
        let kept = (self.triangle_count, self.object_bounds);
        self.mesh(mesh, MaterialsBy::Vertex);
        (self.triangle_count, self.object_bounds) = kept;
    }

    fn quadric(&mut self, kind: QuadricKind, _material: u32) {
        let (min, max) = exact_bounds(kind, &self.placement.scene_from_object);
        if min.is_finite() && max.is_finite() {
            grow(&mut self.bounds, (min, max));
        }
        let object = exact_bounds(kind, &DAffine3::IDENTITY);
        grow(&mut self.object_bounds, object);
    }

    fn line(&mut self, ends: [Corner; 2], _width: f32) {
        self.extend_all(&ends);
    }

    fn bound(&mut self, point: Vec3) {
        if point.is_finite() {
            self.extend(point);
        }
    }

    fn inventor_box(&self) -> Option<Corners> {
        self.object_bounds
    }

    fn set_inventor_box(&mut self, object: Option<Corners>) {
        self.object_bounds = object;
    }

    fn census(&mut self) -> &mut Census {
        &mut self.census
    }

    fn reports(&mut self) -> Option<&mut Reports> {
        Some(&mut self.reports)
    }
}
