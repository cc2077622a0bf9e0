//! The lights of a walk, with the scopes of Inventor and of VRML97.
//!
//! An Inventor light shines on what follows it. A VRML97 `DirectionalLight` shines on all of its
//! group, and the other lights of VRML97 on all shapes within their radius (4.6.6). Those are
//! therefore in force before the shapes around them are visited.

use super::leading::Leading;
use super::property::{self, LightReach};
use super::state::{LightElement, State};
use super::visitor::{Instance, Visitor, WalkOptions};
use super::walk::{Walk, walk_list};
use crate::iv::{Document, NodeId, NodeRef};
use crate::snapshot::Snapshot;

/// Whether the document has a node that shines in a given way.
pub(super) fn has_light(document: &Document, wanted: LightReach) -> bool {
    let nodes = document.ids();
    let reaches = |id: NodeId| property::reach(document.node(id));
    nodes.into_iter().any(|id| reaches(id) == Some(wanted))
}

/// Returns the lights that shine on the whole scene. A walk of its own finds them, because shapes
/// before a light are lit too.
pub(super) fn scene_lights<'a>(
    snapshot: &'a Snapshot<'_>,
    list: &'a [NodeId],
    state: &State<'a>,
    options: &WalkOptions,
) -> Vec<LightElement> {
    struct Collector(Vec<LightElement>, Leading);
    impl<'a> Visitor<'a> for Collector {
        fn shape(&mut self, _: NodeRef<'a>, _: &State<'a>) {}
        fn instance(&mut self, part: Instance<'a>, _: &State<'a>) -> bool {
            !self.1.is_in(part)
        }
        fn light(&mut self, node: NodeRef<'a>, light: &LightElement, _: &State<'a>) {
            if property::reach(node) == Some(LightReach::Scene) {
                self.0.push(*light);
            }
        }
    }
    let document = snapshot.document();
    if !has_light(document, LightReach::Scene) {
        return Vec::new();
    }
    let is_scene_light = |node: NodeRef<'_>| property::reach(node) == Some(LightReach::Scene);
    let leading = Leading::to(document, is_scene_light);
    let mut collector = Collector(Vec::new(), leading);
    walk_list(snapshot, list, state.clone(), options, &mut collector);
    collector.0
}

impl<'a, V: Visitor<'a>> Walk<'a, '_, V> {
    /// Adds a light to the state, unless it is in force already.
    pub(super) fn light(&mut self, node: NodeRef<'a>) {
        let Some(light) = property::light(&self.state, node) else {
            return;
        };
        self.visitor.light(node, &light, &self.state);
        let is_in_force = match property::reach(node) {
            Some(LightReach::Scene) => true,
            Some(LightReach::Group) => self.state.lights.backward().any(|l| l.node == node.id),
            _ => false,
        };
        if !is_in_force {
            self.state.lights.push(light);
        }
    }

    /// Adds the lights among the members of a group that shine on all of the group.
    pub(super) fn light_group(&mut self, members: &[NodeId]) {
        if !self.has_group_lights {
            return;
        }
        for &id in members {
            let node = self.document.node(id);
            if property::reach(node) == Some(LightReach::Group)
                && let Some(light) = property::light(&self.state, node)
            {
                self.state.lights.push(light);
            }
        }
    }
}
