//! Where a ray meets one shape: the canvas that intersects instead of keeping geometry.

use glam::{DVec2, DVec3};
use ivcam_inventor::events::{ShapeHit, ShapePicker};
use ivcam_inventor::iv::NodeRef;
use ivcam_inventor::pose::ViewRay;
use ivcam_inventor::snapshot::Corners;
use ivcam_inventor::traversal::State;

use super::canvas::{BoundsCanvas, Canvas, PictureView, Sides, Wants};
use super::census::Census;
use super::near::is_near;
use super::options::CompileOptions;
use super::placement::Placement;
use super::shapes;
use crate::geometry::{Corner, Quadric, QuadricKind};

/// Intersects rays with shapes as they are drawn with some options.
#[derive(Clone, Debug)]
pub(super) struct Picker(pub(super) CompileOptions);

impl ShapePicker for Picker {
    fn hit<'a>(&self, shape: NodeRef<'a>, state: &State<'a>, ray: &ViewRay) -> Option<ShapeHit> {
        let mut canvas = PickCanvas {
            ray: *ray,
            nearest: None,
            sides: Sides::BOTH,
            picture: PictureView::of(&self.0),
            placement: Placement::around(DVec3::ZERO),
            census: Census::default(),
        };
        shapes::draw(shape, state, &mut canvas);
        canvas.nearest
    }

    fn is_near<'a>(
        &self,
        shape: NodeRef<'a>,
        state: &State<'a>,
        point: DVec3,
        distance: f64,
    ) -> bool {
        is_near(shape, state, (point, distance), PictureView::of(&self.0))
    }

    fn bounds<'a>(&self, shape: NodeRef<'a>, state: &State<'a>) -> Option<Corners> {
        let mut canvas = BoundsCanvas::new(PictureView::of(&self.0));
        shapes::draw(shape, state, &mut canvas);
        canvas.bounds
    }
}

/// The canvas that keeps the nearest visible point of a shape on a ray. Lines and points are
/// ignored.
struct PickCanvas {
    ray: ViewRay,
    nearest: Option<ShapeHit>,
    sides: Sides,
    picture: PictureView,
    placement: Placement,
    census: Census,
}

impl PickCanvas {
    /// Keeps a point if it is in front of the ray's origin and the nearest so far. `outward` is the
    /// normal of the front face, and `normal` that of the file.
    fn meet(&mut self, distance: f64, outward: DVec3, normal: DVec3, coordinates: DVec2) {
        let is_front = outward.dot(self.ray.direction) < 0.0;
        let is_nearer = self.nearest.is_none_or(|hit| distance <= hit.distance);
        if !(distance > 0.0 && distance.is_finite() && is_nearer) || self.sides.culls && !is_front {
            return;
        }
        self.nearest = Some(ShapeHit {
            distance,
            point: self.ray.at(distance),
            normal: if is_front { normal } else { -normal },
            coordinates,
        });
    }
}

impl Canvas for PickCanvas {
    fn wants(&self) -> Wants {
        Wants {
            normals: true,
            coordinates: true,
            ..Wants::default()
        }
    }

    fn picture(&self) -> &PictureView {
        &self.picture
    }

    fn begin(&mut self, _node: NodeRef<'_>, state: &State<'_>) {
        self.placement = self.placement.moved_to(state.world_from_object);
        self.sides = Sides {
            counterclockwise: state.hints.counterclockwise(),
            two_sided: state.hints.two_sided(),
            culls: state.hints.culls(),
        };
    }

    fn placement(&self) -> &Placement {
        &self.placement
    }

    fn set_placement(&mut self, placement: Placement) {
        self.placement = placement;
    }

    fn set_sides(&mut self, sides: Sides) {
        self.sides = sides;
    }

    /// Intersects a triangle (Möller and Trumbore, *Fast, Minimum Storage Ray/Triangle
    /// Intersection*, 1997), in f64.
    fn triangle(&mut self, corners: [Corner; 3]) {
        let matrix = &self.placement.scene_from_object;
        let [a, b, c] = corners.map(|c| matrix.transform_point3(c.position.as_dvec3()));
        let (ab, ac, to) = (b - a, c - a, self.ray.origin - a);
        let across = self.ray.direction.cross(ac);
        let scale = 1.0 / ab.dot(across);
        let u = scale * to.dot(across);
        let turned = to.cross(ab);
        let v = scale * self.ray.direction.dot(turned);
        // NaN is outside.
        if !(scale.is_finite() && u >= 0.0 && v >= 0.0 && u + v <= 1.0) {
            return;
        }
        let turn = if self.sides.counterclockwise {
            1.0
        } else {
            -1.0
        };
        let outward = turn * ab.cross(ac).normalize_or_zero();
        let weights = [1.0 - u - v, u, v];
        let [mut normal, mut coordinates] = [DVec3::ZERO; 2];
        for (corner, weight) in corners.iter().zip(weights) {
            normal += weight * self.placement.normal(corner.normal).as_dvec3();
            coordinates += weight * corner.coordinates.as_dvec2().extend(0.0);
        }
        let distance = scale * ac.dot(turned);
        let normal = normal.normalize_or(outward);
        self.meet(distance, outward, normal, coordinates.truncate());
    }

    fn quadric(&mut self, kind: QuadricKind, material: u32) {
        let matrix = self.placement.scene_from_object;
        let Some(quadric) = Quadric::new(kind, matrix, material) else {
            return;
        };
        let front = self.sides.counterclockwise != quadric.mirrored;
        for distance in quadric.intersect(self.ray.origin, self.ray.direction) {
            if distance.is_nan() {
                continue;
            }
            let (object, normal) = quadric.project_to_surface(self.ray.at(distance));
            let to_world = quadric.object_from_scene.matrix3.transpose();
            let normal = (to_world * normal).normalize_or_zero();
            let outward = if front { normal } else { -normal };
            let coordinates = quadric.texture_coordinates(object);
            self.meet(distance, outward, normal, coordinates);
        }
    }

    fn census(&mut self) -> &mut Census {
        &mut self.census
    }
}
