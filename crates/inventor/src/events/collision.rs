//! `Collision`: whether the viewer is closer to its shapes than the avatar's size (ISO 14772-1,
//! 6.8).

use std::collections::BTreeSet;

use glam::DVec3;

use super::picker::ShapePicker;
use crate::grammar::{class, collision};
use crate::iv::{Document, NodeId, NodeRef};
use crate::snapshot::Snapshot;
use crate::traversal::{State, Visitor, WalkOptions, walk, walk_list};

/// Returns whether what happens in a scene depends on whether the viewer meets a shape: whether a
/// route begins at a `Collision`.
pub fn hears_collisions(document: &Document) -> bool {
    let mut routes = document.routes.iter();
    routes.any(|route| document.node(route.from).class_id() == Some(class::COLLISION))
}

/// Finds the `Collision`s that have a shape within a distance in meters of the viewer, in a
/// document at a time in seconds.
pub(super) fn collisions(
    document: &Document,
    now: f64,
    (viewer, distance): (DVec3, f64),
    picker: &dyn ShapePicker,
) -> BTreeSet<NodeId> {
    let snapshot = Snapshot::of_part(document, now);
    let options = WalkOptions::default();
    let mut search = CollisionSearch {
        picker,
        viewer,
        distance,
        groups: Vec::new(),
        proxies: Vec::new(),
        met: BTreeSet::new(),
    };
    walk(&snapshot, &options, &mut search);
    for (groups, list, state) in std::mem::take(&mut search.proxies) {
        search.groups = groups;
        walk_list(&snapshot, list, state, &options, &mut search);
    }
    search.met
}

/// A group around a shape.
#[derive(Clone, Copy)]
enum CollisionGroup {
    /// No `Collision`.
    Plain,
    /// A `Collision` whose children are met.
    Solid(NodeId),
    /// A `Collision` whose children are not met: it is off, or has a proxy.
    Open,
}

struct CollisionSearch<'p, 'a> {
    picker: &'p dyn ShapePicker,
    viewer: DVec3,
    distance: f64,
    groups: Vec<CollisionGroup>,
    /// The proxies, each with the groups around it and the state.
    proxies: Vec<(Vec<CollisionGroup>, &'a [NodeId], State<'a>)>,
    met: BTreeSet<NodeId>,
}

impl<'a> Visitor<'a> for CollisionSearch<'_, 'a> {
    fn shape(&mut self, node: NodeRef<'a>, state: &State<'a>) {
        let around = self.groups.iter().rev();
        let around = around.take_while(|group| !matches!(group, CollisionGroup::Open));
        let solid: Vec<NodeId> = around
            .filter_map(|group| match group {
                CollisionGroup::Solid(id) => Some(*id),
                _ => None,
            })
            .collect();
        let is_known = solid.iter().all(|id| self.met.contains(id));
        if !is_known && self.picker.is_near(node, state, self.viewer, self.distance) {
            self.met.extend(solid);
        }
    }

    fn enter(&mut self, node: NodeRef<'a>, state: &State<'a>) {
        if node.class_id() != Some(class::COLLISION) {
            return self.groups.push(CollisionGroup::Plain);
        }
        let proxy = node.get_nodes(collision::PROXY);
        let solid = CollisionGroup::Solid(node.id);
        let collides = node.get(collision::COLLIDE);
        if collides && !proxy.is_empty() {
            let around = self.groups.iter().copied().chain([solid]);
            self.proxies.push((around.collect(), proxy, state.clone()));
        }
        self.groups.push(match collides && proxy.is_empty() {
            true => solid,
            false => CollisionGroup::Open,
        });
    }

    fn leave(&mut self) {
        self.groups.pop();
    }
}
