//! Presses, moves and releases the pointer: what sensors and an `Anchor` make of it (ISO 14772-1,
//! 4.6.7).

use std::collections::BTreeSet;

use glam::{DMat4, DVec2, DVec3};
use ivcam_base::diag::{Diagnostic, Result};

use super::drag::{Drag, Sent};
use super::picker::ShapeHit;
use super::pointer::{PointerHit, PointerWorld, is_sensor};
use super::pointer_path::PointerPath;
use super::viewer_sensor::EventOut;
use super::world::World;
use crate::grammar::{anchor, class, vrml_sensor};
use crate::iv::{NodeId, NodeRef, Value};
use crate::pose::{CameraPose, ViewRay};
use crate::snapshot::BindableKind;
use crate::traversal::{Parents, each_child};

/// What is pressed, until it is released.
#[derive(Debug)]
pub(super) struct Grab {
    path: PointerPath,
    /// The viewer that sees the path, if it is not that of the picture.
    from: Option<CameraPose>,
    /// Where the pointer is now.
    place: Option<DVec2>,
    targets: Vec<Grabbed>,
}

/// A sensor or an `Anchor` that is pressed.
#[derive(Debug)]
struct Grabbed {
    id: NodeId,
    kind: GrabKind,
}

#[derive(Debug)]
enum GrabKind {
    Anchor,
    /// A `TouchSensor`, and whether the pointer is over its shapes.
    Touch {
        is_over: bool,
    },
    /// A drag sensor, and its drag if it is known where the pointer met the shape.
    Drag(Option<Box<Drag>>),
}

/// What the pointer is over.
#[derive(Default)]
struct Pointed {
    /// What acts, each with the transform from its space to the world if it is known.
    targets: Vec<(NodeId, Option<DMat4>)>,
    /// The ray of the pointer, and where it meets the shape.
    hit: Option<(ViewRay, ShapeHit)>,
}

impl Grab {
    /// Returns when the pointer moves next.
    pub(super) fn next_time(&self, now: f64) -> f64 {
        self.path.next_time(now)
    }
}

impl World {
    /// Presses the pointer on a node, or on what is at the first place of its path if the name is
    /// empty. The outputs wait.
    pub(super) fn press(
        &mut self,
        name: &str,
        path: PointerPath,
        from: Option<CameraPose>,
    ) -> Result<()> {
        let place = path.first();
        let viewer = from.clone().unwrap_or_else(|| self.present_viewer());
        let pointed = match place {
            Some(place) => self.pointed_at(name, place, &viewer)?,
            None => self.pointed_by_name(name, &viewer)?,
        };
        let mut targets = Vec::new();
        for (id, place) in &pointed.targets {
            let hit = pointed.hit.as_ref().zip(*place);
            targets.extend(self.grab(*id, hit).map(|kind| Grabbed { id: *id, kind }));
        }
        self.grabs.push(Grab {
            path,
            from,
            place,
            targets,
        });
        Ok(())
    }

    /// Moves the pointers that are pressed to where they are now. Those whose time has come are
    /// released. The outputs wait.
    pub(super) fn move_pointers(&mut self) {
        let mut grabs = std::mem::take(&mut self.grabs);
        let now = self.now;
        for grab in &mut grabs {
            let place = grab.path.at(now);
            if let Some(place) = place.filter(|_| place != grab.place) {
                let viewer = grab.from.clone().unwrap_or_else(|| self.present_viewer());
                self.move_grab(&mut grab.targets, place, &viewer);
            }
            grab.place = place;
        }
        let (ended, held) = grabs.into_iter().partition(|grab| now >= grab.path.end);
        self.grabs = held;
        let ended: Vec<Grab> = ended;
        for target in ended.into_iter().flat_map(|grab| grab.targets) {
            self.release(target);
        }
    }

    /// Lets a target feel the press. Returns `None` if it is a sensor that is not enabled.
    fn grab(&mut self, id: NodeId, hit: Option<(&(ViewRay, ShapeHit), DMat4)>) -> Option<GrabKind> {
        let document = &self.document;
        let node = NodeRef { document, id };
        if node.class_id() == Some(class::ANCHOR) {
            return Some(GrabKind::Anchor);
        }
        if !node.get(vrml_sensor::ENABLED) {
            self.warn(id, "this sensor was touched while it is not enabled".into());
            return None;
        }
        let active = ("isActive", Value::Bool(true));
        let (kind, sent) = if node.class_id() == Some(class::TOUCH_SENSOR) {
            let over = ("isOver", Value::Bool(true));
            let hits = hit.map(|((_, hit), place)| hit_events(hit, place));
            let sent = [over].into_iter().chain(hits.into_iter().flatten());
            let kind = GrabKind::Touch { is_over: true };
            (kind, sent.chain([active]).collect())
        } else {
            let mut drag =
                hit.and_then(|((ray, hit), place)| Drag::begin(node, place, hit.point, ray));
            let mut sent = vec![active];
            if let (Some(drag), Some(((ray, _), _))) = (&mut drag, hit) {
                sent.extend(drag.follow(node, ray));
            }
            (GrabKind::Drag(drag.map(Box::new)), sent)
        };
        self.wait_to_send(id, sent);
        Some(kind)
    }

    /// Moves the pointer with what is pressed to a place in the picture.
    fn move_grab(&mut self, targets: &mut Vec<Grabbed>, place: DVec2, viewer: &CameraPose) {
        let ray = viewer.ray(place, self.aspect);
        let touches = |target: &Grabbed| matches!(target.kind, GrabKind::Touch { .. });
        let under = targets
            .iter()
            .any(touches)
            .then(|| self.under(viewer, &ray));
        let under = under.flatten();
        targets.retain_mut(|target| {
            let document = &self.document;
            let node = NodeRef {
                document,
                id: target.id,
            };
            let is_enabled =
                matches!(target.kind, GrabKind::Anchor) || node.get(vrml_sensor::ENABLED);
            if !is_enabled {
                self.wait_to_send(target.id, vec![("isActive", Value::Bool(false))]);
                return false;
            }
            let sent = match &mut target.kind {
                GrabKind::Anchor | GrabKind::Drag(None) => Vec::new(),
                GrabKind::Drag(Some(drag)) => drag.follow(node, &ray),
                GrabKind::Touch { is_over } => touch_moved(target.id, is_over, under.as_ref()),
            };
            self.wait_to_send(target.id, sent);
            true
        });
    }

    /// Lets a target feel the release.
    fn release(&mut self, target: Grabbed) {
        let Grabbed { id, kind } = target;
        let inactive = ("isActive", Value::Bool(false));
        match kind {
            GrabKind::Anchor => self.follow_anchor(id),
            GrabKind::Touch { is_over } => {
                let mut sent = vec![inactive];
                if is_over {
                    sent.push(("touchTime", Value::Double(self.now)));
                    sent.push(("isOver", Value::Bool(false)));
                }
                self.wait_to_send(id, sent);
            }
            GrabKind::Drag(drag) => {
                self.wait_to_send(id, vec![inactive]);
                let offset = drag.as_deref().and_then(Drag::new_offset);
                if let Some(offset) = offset {
                    self.keep_offset(id, offset);
                }
            }
        }
    }

    /// Keeps the last value of a drag as the sensor's offset, if its `autoOffset` says so.
    fn keep_offset(&mut self, id: NodeId, offset: &Value) {
        let document = &self.document;
        let node = NodeRef { document, id };
        let keeps = node.value("autoOffset") != Some(&Value::Bool(false));
        let field = node.class().and_then(|class| class.field("offset"));
        if let Some((index, _)) = field.filter(|_| keeps) {
            self.document.store(id, index as u16, offset.clone());
            self.wait_to_send(id, vec![("offset", offset.clone())]);
        }
    }

    /// Lets outputs wait, each for a cascade of its own.
    fn wait_to_send(&mut self, id: NodeId, sent: Vec<Sent>) {
        let outputs = sent.into_iter();
        let outputs = outputs.map(|(name, value)| -> EventOut { (id, name, value) });
        self.cascades.extend(outputs);
    }

    /// Returns the viewer as it is now.
    fn present_viewer(&self) -> CameraPose {
        let bound = self.binding.top(BindableKind::Viewpoint);
        self.viewer_at(&self.survey(), bound, self.binding.viewpoint_from_viewer)
    }

    /// Returns the document as a pointer searches it, if the program can tell where shapes are.
    fn pointer_world<'w>(&'w self, viewer: &'w CameraPose) -> Option<PointerWorld<'w>> {
        Some(PointerWorld {
            document: &self.document,
            now: self.now,
            viewer,
            picker: self.picker.as_ref()?,
        })
    }

    /// Returns the nearest shape on a ray.
    fn under(&self, viewer: &CameraPose, ray: &ViewRay) -> Option<PointerHit> {
        self.pointer_world(viewer)?.search(ray, None).hit
    }

    /// Finds what is at a place of the picture.
    ///
    /// # Errors
    /// Returns a warning if nothing is there that acts, or not the node that is named.
    fn pointed_at(&self, name: &str, place: DVec2, viewer: &CameraPose) -> Result<Pointed> {
        let wanted = match name {
            "" => None,
            name => Some(self.document.node(self.named(name)?).id),
        };
        let at = format!("{},{}", place.x, place.y);
        let ray = viewer.ray(place, self.aspect);
        let Some(hit) = self.under(viewer, &ray) else {
            let message = format!("nothing is at {at} of the picture to be touched");
            let help = "0,0 is the upper left corner and 1,1 the lower right one, without a lens";
            return Err(Diagnostic::warning(message).with_help(help));
        };
        let shape = *hit.path.last().expect("a path ends with its shape");
        let class = self.class_name(shape);
        let is_wanted = |id| {
            let acts = hit.targets.iter().any(|(target, _)| *target == id);
            acts || hit.path.contains(&id)
        };
        if let Some(id) = wanted.filter(|id| !is_wanted(*id)) {
            let message = format!("at {at} of the picture is a `{class}`, not `{name}`");
            let why = self.document.node(id).class_name();
            return Err(Diagnostic::warning(message).with_help(format!(
                "`{name}`, a `{why}`, does not act for that shape, or is behind it"
            )));
        }
        if hit.targets.is_empty() {
            let message = format!("nothing happens when the `{class}` at {at} is touched");
            return Err(Diagnostic::warning(message)
                .with_help("no enabled sensor and no `Anchor` acts for it"));
        }
        let targets = hit.targets.iter();
        Ok(Pointed {
            targets: targets.map(|(id, place)| (*id, Some(*place))).collect(),
            hit: Some((ray, hit.surface)),
        })
    }

    /// Finds what acts for a node, with the pointer over the middle of its shapes.
    ///
    /// # Errors
    /// Returns a warning if there is no such node, or nothing acts for it.
    fn pointed_by_name(&self, name: &str, viewer: &CameraPose) -> Result<Pointed> {
        let id = self.named(name)?;
        let targets = self.touched_with(id);
        if targets.is_empty() {
            let message = format!("nothing happens when `{name}` is touched");
            return Err(Diagnostic::warning(message)
                .with_help("neither a sensor nor an `Anchor` is in it, beside it or above it"));
        }
        let id = self.document.node(id).id;
        let only = self.shapes_for(id);
        let found = self.pointer_world(viewer).and_then(|world| {
            let middle: DVec3 = world.middle(only.as_ref())?;
            let ray = viewer.ray_through(middle);
            Some((ray, world.search(&ray, only.as_ref())))
        });
        let place_of = |id: NodeId| {
            let (_, found) = found.as_ref()?;
            let own = found.hit.iter().flat_map(|hit| &hit.targets);
            let mut known = own.chain(&found.sensors);
            known
                .find(|(target, _)| *target == id)
                .map(|(_, place)| *place)
        };
        Ok(Pointed {
            targets: targets.iter().map(|id| (*id, place_of(*id))).collect(),
            hit: found.as_ref().and_then(|(ray, found)| {
                let hit = found.hit.as_ref()?;
                Some((*ray, hit.surface))
            }),
        })
    }

    /// Returns the nodes below which there are the shapes for which a node stands: for a sensor the
    /// groups that have it, for other nodes itself. Returns `None` for a sensor among the roots,
    /// which stands for all shapes.
    fn shapes_for(&self, id: NodeId) -> Option<BTreeSet<NodeId>> {
        if !is_sensor(self.document.node(id)) {
            return Some(BTreeSet::from([id]));
        }
        let is_root = self.document.roots().any(|root| root.id == id);
        let groups = || Parents::of(&self.document).of_node(id).collect();
        (!is_root).then(groups)
    }

    /// Returns the sensors and anchors that act when a node is touched: those of the lowest group
    /// that has any, from the node itself upward. All sensors of that group act together
    /// (ISO 14772-1, 4.6.7.3).
    fn touched_with(&self, id: NodeId) -> Vec<NodeId> {
        let document = &self.document;
        let id = document.node(id).id;
        let own = self.sensors_of(id);
        if !own.is_empty() {
            return own;
        }
        let parents = Parents::of(document);
        // The node, and the instance of a prototype that it represents.
        let all = document.ids();
        let same = all.filter(|other| document.node(*other).id == id);
        let mut level: BTreeSet<NodeId> = same.collect();
        let mut known = level.clone();
        while !level.is_empty() {
            let above = level.iter().flat_map(|node| parents.of_node(*node));
            let above: BTreeSet<NodeId> = above.collect();
            let groups = above.iter().flat_map(|group| self.sensors_of(*group));
            let mut sensors: BTreeSet<NodeId> = groups.collect();
            if document.roots.iter().any(|root| level.contains(root)) {
                let roots = document.roots().filter(|node| is_sensor(*node));
                sensors.extend(roots.map(|node| node.id));
            }
            if !sensors.is_empty() {
                return sensors.into_iter().collect();
            }
            level = &above - &known;
            known.extend(&level);
        }
        Vec::new()
    }

    /// Returns what acts for the shapes below a group: the sensors among its children, and the
    /// group itself if it is an `Anchor`.
    fn sensors_of(&self, group: NodeId) -> Vec<NodeId> {
        let document = &self.document;
        let node = document.node(group);
        let mut sensors = Vec::new();
        if node.class_id() == Some(class::ANCHOR) {
            sensors.push(node.id);
        }
        each_child(document, group, |child| {
            let child = document.node(child);
            if is_sensor(child) {
                sensors.push(child.id);
            }
        });
        sensors
    }

    /// Follows an `Anchor` to a `Viewpoint` of the scene, or reports where it leads.
    fn follow_anchor(&mut self, id: NodeId) {
        let url = self.document.node(id).get(anchor::URL);
        let Some(url) = url.first().cloned() else {
            return;
        };
        let name = url.strip_prefix('#').unwrap_or_default();
        let view = self.document.names.get(name).copied();
        let kind = view.and_then(|view| BindableKind::of(self.document.node(view)));
        match view {
            Some(view) if kind == Some(BindableKind::Viewpoint) => {
                self.send_directly(view, "set_bind", &Value::Bool(true));
            }
            _ => {
                let message = format!("this `Anchor` leads to `{url}`, which is not opened");
                self.warn(id, message);
            }
        }
    }
}

/// Returns what a `TouchSensor` sends about the point under the pointer, in its own space.
fn hit_events(hit: &ShapeHit, world_from_sensor: DMat4) -> Vec<Sent> {
    let sensor_from_world = world_from_sensor.inverse();
    let point = sensor_from_world.transform_point3(hit.point);
    // A normal is transformed by the transpose of the inverse, which here is the matrix itself.
    let normal = world_from_sensor.transpose().transform_vector3(hit.normal);
    let normal = normal.normalize_or_zero();
    if !(point.is_finite() && normal.is_finite()) {
        return Vec::new();
    }
    vec![
        ("hitPoint_changed", Value::Vec3(point.as_vec3())),
        ("hitNormal_changed", Value::Vec3(normal.as_vec3())),
        (
            "hitTexCoord_changed",
            Value::Vec2(hit.coordinates.as_vec2()),
        ),
    ]
}

/// Returns what a pressed `TouchSensor` sends when the pointer has moved.
fn touch_moved(id: NodeId, was_over: &mut bool, under: Option<&PointerHit>) -> Vec<Sent> {
    let target = under.and_then(|hit| {
        let found = hit.targets.iter().find(|(target, _)| *target == id);
        found.map(|(_, place)| (hit, *place))
    });
    let is_over = target.is_some();
    let mut sent = Vec::new();
    if std::mem::replace(was_over, is_over) != is_over {
        sent.push(("isOver", Value::Bool(is_over)));
    }
    if let Some((hit, place)) = target {
        sent.extend(hit_events(&hit.surface, place));
    }
    sent
}
