//! Whether a shape comes near a point: the canvas that measures distances instead of keeping
//! geometry. Round shapes are measured as polygons of the highest complexity.

use glam::DVec3;
use ivcam_inventor::iv::NodeRef;
use ivcam_inventor::traversal::State;

use super::canvas::{Canvas, PictureView, Wants, draw_facets};
use super::census::Census;
use super::placement::Placement;
use super::shapes;
use crate::geometry::{Corner, Fineness, QuadricKind};

/// Returns whether a face of a shape is within a distance in meters of a point of the world.
pub(super) fn is_near<'a>(
    shape: NodeRef<'a>,
    state: &State<'a>,
    (point, distance): (DVec3, f64),
    picture: PictureView,
) -> bool {
    let mut canvas = NearCanvas {
        point,
        distance,
        is_near: false,
        picture,
        placement: Placement::around(DVec3::ZERO),
        census: Census::default(),
    };
    shapes::draw(shape, state, &mut canvas);
    canvas.is_near
}

struct NearCanvas {
    point: DVec3,
    distance: f64,
    is_near: bool,
    picture: PictureView,
    placement: Placement,
    census: Census,
}

impl Canvas for NearCanvas {
    fn wants(&self) -> Wants {
        Wants::default()
    }

    fn picture(&self) -> &PictureView {
        &self.picture
    }

    fn begin(&mut self, _node: NodeRef<'_>, state: &State<'_>) {
        self.placement = self.placement.moved_to(state.world_from_object);
    }

    fn placement(&self) -> &Placement {
        &self.placement
    }

    fn set_placement(&mut self, placement: Placement) {
        self.placement = placement;
    }

    fn triangle(&mut self, corners: [Corner; 3]) {
        let matrix = &self.placement.scene_from_object;
        let corners = corners.map(|c| matrix.transform_point3(c.position.as_dvec3()));
        self.is_near |= distance_to(self.point, corners) <= self.distance;
    }

    fn quadric(&mut self, kind: QuadricKind, material: u32) {
        draw_facets(self, kind, Fineness::of_complexity(1.0), material);
    }

    fn census(&mut self) -> &mut Census {
        &mut self.census
    }
}

/// Returns the distance of a point from a triangle: from its plane if the point is above it, else
/// from its nearest edge. NaN for corners that are not finite.
fn distance_to(point: DVec3, corners: [DVec3; 3]) -> f64 {
    let sides = [(0, 1), (1, 2), (2, 0)].map(|(a, b)| (corners[a], corners[b] - corners[a]));
    let normal = sides[0].1.cross(sides[1].1).normalize_or_zero();
    let is_inside = |(from, along): &(DVec3, DVec3)| normal.cross(*along).dot(point - *from) >= 0.0;
    if normal != DVec3::ZERO && sides.iter().all(is_inside) {
        return (point - corners[0]).dot(normal).abs();
    }
    let to_edge = sides.map(|(from, along)| {
        let length = along.length_squared().max(f64::MIN_POSITIVE);
        let share = ((point - from).dot(along) / length).clamp(0.0, 1.0);
        (point - from - share * along).length()
    });
    to_edge[0].min(to_edge[1]).min(to_edge[2])
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_distance_from_a_triangle_is_that_of_its_nearest_point() {
        let corners = [DVec3::ZERO, 2.0 * DVec3::X, 2.0 * DVec3::Y];
        let at = |x, y, z| distance_to(DVec3::new(x, y, z), corners);
        assert_eq!(at(0.5, 0.5, 3.0), 3.0);
        assert_eq!(at(0.5, 0.5, -3.0), 3.0);
        assert_eq!(at(1.0, -2.0, 0.0), 2.0);
        assert_eq!(at(-3.0, -4.0, 0.0), 5.0);
        assert!((at(2.0, 2.0, 0.0) - 2f64.sqrt()).abs() < 1e-15);
        // A triangle without an area is an edge.
        let flat = [DVec3::ZERO, DVec3::X, 2.0 * DVec3::X];
        assert_eq!(distance_to(DVec3::new(1.5, 2.0, 0.0), flat), 2.0);
    }
}
