//! `ProximitySensor`, `VisibilitySensor` and `Collision`, which depend on where the viewer is
//! (VRML97, 6.38, 6.57 and 6.8).

use glam::{DMat4, DQuat, DVec3};

use crate::grammar::{class, proximity_sensor, visibility_sensor, vrml_sensor};
use crate::iv::{NodeId, NodeRef, Value};
use crate::pose::{CameraPose, Projection, ViewExtent, orientation_in, rotation_value};

/// The state of a sensor while a scene plays.
#[derive(Clone, Debug, Default)]
pub(super) struct ViewerSensor {
    is_active: bool,
    /// What a `ProximitySensor` sent last: the viewer's position and orientation in its space.
    sent: Option<(Value, Value)>,
}

/// An output of a node with its value.
pub(super) type EventOut = (NodeId, &'static str, Value);

impl ViewerSensor {
    /// Returns what the sensor sends. `places` are the transforms from its space to the world.
    pub(super) fn look(
        &mut self,
        node: NodeRef<'_>,
        places: &[DMat4],
        (viewer, aspect): (&CameraPose, f64),
        now: f64,
    ) -> Vec<(&'static str, Value)> {
        let is_proximity = node.class_id() == Some(class::PROXIMITY_SENSOR);
        let region = if is_proximity {
            let center = node.get(proximity_sensor::CENTER);
            (center, node.get(proximity_sensor::SIZE))
        } else {
            let center = node.get(visibility_sensor::CENTER);
            (center, node.get(visibility_sensor::SIZE))
        };
        let (center, half) = (region.0.as_dvec3(), 0.5 * region.1.as_dvec3());
        let is_enabled =
            node.get(vrml_sensor::ENABLED) && (!is_proximity || half.min_element() > 0.0);
        let place = places.iter().filter(|_| is_enabled).find(|place| {
            if is_proximity {
                let eye = place.inverse().transform_point3(viewer.position);
                (eye - center).abs().cmple(half).all()
            } else {
                is_in_view(**place, (center, half), viewer, aspect)
            }
        });
        let mut events = Vec::new();
        if place.is_some() != self.is_active {
            self.is_active = place.is_some();
            let moment = if self.is_active {
                "enterTime"
            } else {
                "exitTime"
            };
            events.push(("isActive", Value::Bool(self.is_active)));
            events.push((moment, Value::Double(now)));
            self.sent = None;
        }
        if let Some(place) = place.filter(|_| is_proximity) {
            let sensor_from_viewer = place.inverse() * viewer.world_from_camera();
            let position = Value::Vec3(sensor_from_viewer.w_axis.truncate().as_vec3());
            let orientation = Value::Rotation(rotation_value(orientation_in(
                sensor_from_viewer,
                DQuat::IDENTITY,
            )));
            let (last_position, last_orientation) = self.sent.take().unzip();
            if last_position.as_ref() != Some(&position) {
                events.push(("position_changed", position.clone()));
            }
            if last_orientation.as_ref() != Some(&orientation) {
                events.push(("orientation_changed", orientation.clone()));
            }
            self.sent = Some((position, orientation));
        }
        events
    }
}

impl ViewerSensor {
    /// Returns what a `Collision` sends, which the viewer meets or not.
    pub(super) fn collide(&mut self, meets: bool, now: f64) -> Vec<(&'static str, Value)> {
        let met_before = std::mem::replace(&mut self.is_active, meets);
        let begins = meets && !met_before;
        begins
            .then_some(("collideTime", Value::Double(now)))
            .into_iter()
            .collect()
    }
}

/// Returns whether a box may be in the viewer's picture: whether no side of the view has all of its
/// corners outside.
fn is_in_view(
    world_from_box: DMat4,
    (center, half): (DVec3, DVec3),
    viewer: &CameraPose,
    aspect: f64,
) -> bool {
    let viewer_from_box = viewer.world_from_camera().inverse() * world_from_box;
    let corner = |i: u32| {
        let sign = |bit: u32| if i >> bit & 1 == 0 { -1.0 } else { 1.0 };
        viewer_from_box.transform_point3(center + half * DVec3::new(sign(0), sign(1), sign(2)))
    };
    let corners: Vec<DVec3> = (0..8).map(corner).collect();
    let ViewExtent { half, center, .. } = viewer.view_extent(aspect);
    // The extent of the view at a depth, which for parallel rays is the same at all depths.
    let at_depth = |depth: f64, extent: f64| match viewer.projection {
        Projection::Perspective { .. } => depth * extent,
        Projection::Orthographic { .. } => extent,
    };
    let is_inside =
        |of: fn(&DVec3) -> f64, extent: f64| corners.iter().any(|p| of(p) < at_depth(-p.z, extent));
    corners.iter().any(|p| p.z < 0.0)
        && is_inside(|p| p.x, half.x + center.x)
        && is_inside(|p| -p.x, half.x - center.x)
        && is_inside(|p| p.y, half.y + center.y)
        && is_inside(|p| -p.y, half.y - center.y)
}
