//! Where the viewer is, and what the sensors that depend on it send.

use std::collections::BTreeSet;

use glam::DMat4;

use super::collision::{collisions, hears_collisions};
use super::survey::{WorldSurvey, is_viewer_sensor};
use super::viewer_sensor::{EventOut, ViewerSensor};
use super::world::World;
use crate::grammar::{class, navigation_info};
use crate::iv::{NodeId, NodeRef};
use crate::pose::CameraPose;
use crate::snapshot::{BindableKind, move_viewer};

impl World {
    /// Finds the sensors that depend on the viewer, and the `Collision`s if one has a route, among
    /// the nodes of the arena from an index on.
    pub(super) fn find_viewer_sensors(&mut self, first: usize) {
        let hears = hears_collisions(&self.document);
        for index in first..self.document.nodes.len() {
            let id = NodeId(index as u32);
            let document = &self.document;
            let node = NodeRef { document, id };
            let is_collision = hears && node.class_id() == Some(class::COLLISION);
            if (is_collision || is_viewer_sensor(node)) && !document.is_template(id) {
                self.viewer_sensors.insert(id, ViewerSensor::default());
            }
        }
    }

    /// Looks where sensors and viewpoints are now.
    pub(super) fn survey(&self) -> WorldSurvey {
        WorldSurvey::of(
            &self.document,
            self.now,
            self.viewer.as_ref(),
            &self.leading,
        )
    }

    /// Returns the viewer: the one that was given, or the one at a `Viewpoint`, from which it may
    /// have moved.
    pub(super) fn viewer_at(
        &self,
        survey: &WorldSurvey,
        viewpoint: Option<NodeId>,
        viewpoint_from_viewer: DMat4,
    ) -> CameraPose {
        if let Some(viewer) = &self.viewer {
            return viewer.clone();
        }
        let mut found = survey.viewpoints.iter();
        let found = found.find(|(node, _)| Some(*node) == viewpoint);
        let mut pose = found.map_or_else(CameraPose::default_viewpoint, |(_, pose)| pose.clone());
        move_viewer(&mut pose, viewpoint_from_viewer);
        pose
    }

    /// Returns the `Collision`s that the viewer meets: those with a shape nearer than the first
    /// number of the `avatarSize` of the bound `NavigationInfo`.
    fn met_collisions(&self, viewer: &CameraPose) -> BTreeSet<NodeId> {
        let document = &self.document;
        let mut sensors = self
            .viewer_sensors
            .keys()
            .map(|&id| NodeRef { document, id });
        let is_heard = sensors.any(|node| node.class_id() == Some(class::COLLISION));
        let Some(picker) = self.picker.as_ref().filter(|_| is_heard) else {
            return BTreeSet::new();
        };
        let bound = self.binding.top(BindableKind::NavigationInfo);
        let sizes = bound.map_or(navigation_info::AVATAR_SIZE.default(), |id| {
            document.node(id).get(navigation_info::AVATAR_SIZE)
        });
        let distance = f64::from(sizes.first().copied().unwrap_or(0.25));
        collisions(document, self.now, (viewer.position, distance), &**picker)
    }

    /// Returns what the sensors that depend on the viewer send now.
    pub(super) fn look(&mut self) -> Vec<EventOut> {
        if self.viewer_sensors.is_empty() {
            return Vec::new();
        }
        let survey = self.survey();
        let bound = self.binding.top(BindableKind::Viewpoint);
        let viewer = self.viewer_at(&survey, bound, self.binding.viewpoint_from_viewer);
        let met = self.met_collisions(&viewer);
        let mut outputs = Vec::new();
        let mut sensors = std::mem::take(&mut self.viewer_sensors);
        for (id, sensor) in &mut sensors {
            let node = NodeRef {
                document: &self.document,
                id: *id,
            };
            if node.class_id() == Some(class::COLLISION) {
                let events = sensor.collide(met.contains(id), self.now);
                outputs.extend(events.into_iter().map(|(name, value)| (*id, name, value)));
                continue;
            }
            let places = survey.sensors.iter().filter(|(other, _)| other == id);
            let places: Vec<DMat4> = places.map(|(_, place)| *place).collect();
            let events = sensor.look(node, &places, (&viewer, self.aspect), self.now);
            outputs.extend(events.into_iter().map(|(name, value)| (*id, name, value)));
        }
        self.viewer_sensors = sensors;
        outputs
    }
}
