//! The motion of a model's nodes, sampled from snapshots of its document at several times.

use std::collections::HashMap;

use glam::DAffine3;
use ivcam_inventor::events::SnapshotOptions;
use ivcam_inventor::grammar::Role;
use ivcam_inventor::iv::{Document, NodeId, NodeRef, Value};

use super::lights::Pose;
use super::options::ModelOptions;
use super::scene_model::Model;
use super::tree::{self, Skeleton};
use crate::scene::snapshot;

/// The largest number of times at which a scene is sampled.
const MOST_SAMPLES: usize = 601;

/// The largest number of visits of nodes for all samples, which bounds the time of large scenes to
/// about ten seconds.
const MOST_VISITS: usize = 10_000_000;

/// The number of samples at which values other than matrices are compared.
const COMPARED: usize = 4;

/// How the motion of a scene is sampled.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Sampling {
    /// The duration in seconds; `None` for that of the scene's clocks, between 0.1 and 60 s.
    pub duration: Option<f64>,
    /// The number of samples in a second. Fewer are taken of a large scene.
    pub rate: f64,
}

impl Default for Sampling {
    /// The duration of the scene's clocks, at 30 samples in a second.
    fn default() -> Self {
        Self {
            duration: None,
            rate: 30.0,
        }
    }
}

/// The motion of a model, by sample.
#[derive(Clone, Debug, Default)]
pub struct Motion {
    /// The times of the samples in seconds, from 0.
    pub times: Vec<f64>,
    /// The matrices of the nodes that move, relative to their parents, by the number of the node.
    /// `None` means that the node is not shown.
    pub nodes: Vec<(usize, Vec<Option<DAffine3>>)>,
    /// The poses of the cameras that move, by the number of the camera.
    pub cameras: Vec<(usize, Vec<Pose>)>,
    /// The poses of the lights that move, by the number of the light.
    pub lights: Vec<(usize, Vec<Pose>)>,
    /// The nodes of the document whose values change otherwise: geometry, colors, lights.
    pub changing: Vec<NodeId>,
}

impl Motion {
    /// Samples the motion of a model of a document from a snapshot on. A document without clocks
    /// has none.
    pub fn of(
        document: &Document,
        model: &Model,
        start: &SnapshotOptions,
        options: &ModelOptions,
        sampling: &Sampling,
    ) -> Self {
        let Some(period) = period(document) else {
            return Self::default();
        };
        let duration = sampling.duration.unwrap_or(period.clamp(0.1, 60.0));
        if !(duration > 0.0 && duration.is_finite()) {
            return Self::default();
        }
        let visits = document.nodes.len().max(model.nodes.len()).max(1);
        let most = MOST_SAMPLES.min(MOST_VISITS / visits).max(2);
        let wanted = (duration * sampling.rate.clamp(0.01, 1000.0)).ceil() as usize + 1;
        let count = wanted.clamp(2, most);
        let step = duration / (count - 1) as f64;
        let times: Vec<f64> = (0..count).map(|i| i as f64 * step).collect();
        let mut options = options.clone();
        options.compile.camera.clone_from(&model.view);
        let options = &options;
        let mut sampler = MotionSampler::new(model, count);
        let first = snapshot(document, start, &options.compile);
        for (i, time) in times.iter().enumerate() {
            let at = SnapshotOptions {
                time: start.time + time,
                ..start.clone()
            };
            let taken = snapshot(document, &at, &options.compile);
            let skeleton = tree::skeleton(&taken, options);
            sampler.add(&skeleton);
            if i % (count / COMPARED).max(1) == 0 {
                sampler.compare(first.document(), taken.document());
            }
        }
        sampler.finish(times)
    }

    /// Whether nothing moves.
    pub fn is_empty(&self) -> bool {
        self.nodes.is_empty() && self.cameras.is_empty() && self.lights.is_empty()
    }
}

/// Returns the time in which the scene's clocks repeat, as far as it is known, or 5 seconds.
/// Returns `None` for a scene without clocks.
fn period(document: &Document) -> Option<f64> {
    let mut longest: Option<f64> = None;
    for index in 0..document.nodes.len() {
        let node = document.node(NodeId(index as u32));
        let Some(class) = node.known_class() else {
            continue;
        };
        let number = |field: &str| match node.value(field) {
            Some(Value::Double(seconds)) => Some(*seconds),
            Some(Value::Float(value)) => Some(f64::from(*value)),
            _ => None,
        };
        let own = match class.name {
            "TimeSensor" => number("cycleInterval"),
            "Rotor" | "Pendulum" | "Shuttle" | "Blinker" => {
                number("speed").filter(|s| *s != 0.0).map(|s| 1.0 / s.abs())
            }
            "ElapsedTime" | "TimeCounter" | "OneShot" | "GlobalField" => Some(5.0),
            _ => continue,
        };
        let own = own.filter(|s| s.is_finite() && *s > 0.0).unwrap_or(5.0);
        longest = Some(longest.map_or(own, |l| l.max(own)));
    }
    longest
}

/// Collects samples.
struct MotionSampler<'m> {
    model: &'m Model,
    /// The matrix of each node at each time.
    nodes: Vec<Vec<Option<DAffine3>>>,
    cameras: Vec<Vec<Pose>>,
    lights: Vec<Vec<Pose>>,
    changing: Vec<NodeId>,
    is_changing: HashMap<NodeId, ()>,
}

impl<'m> MotionSampler<'m> {
    fn new(model: &'m Model, count: usize) -> Self {
        let room = || Vec::with_capacity(count);
        Self {
            model,
            nodes: model.nodes.iter().map(|_| room()).collect(),
            cameras: vec![Vec::new(); model.cameras.len()],
            lights: vec![Vec::new(); model.lights.len()],
            changing: Vec::new(),
            is_changing: HashMap::new(),
        }
    }

    /// Adds the matrices at one time.
    fn add(&mut self, skeleton: &Skeleton) {
        let offset = self.model.offset;
        let world = |i: usize| {
            let node = &self.model.nodes[i];
            if i == 0 || node.is_fixed {
                return Some(node.world);
            }
            let mut world = *skeleton.worlds.get(&node.key)?;
            world.translation += world.matrix3 * node.center - offset;
            Some(world)
        };
        for (i, node) in self.model.nodes.iter().enumerate() {
            let local = match node.parent {
                None => Some(node.local),
                Some(parent) => world(parent)
                    .zip(world(i))
                    .map(|(above, own)| above.inverse() * own),
            };
            self.nodes[i].push(local.filter(DAffine3::is_finite));
        }
        let moved = |pose: &Pose| Pose {
            position: pose.position - offset,
            ..*pose
        };
        for (list, pose) in self.cameras.iter_mut().zip(&skeleton.cameras) {
            list.push(moved(pose));
        }
        for (list, pose) in self.lights.iter_mut().zip(&skeleton.lights) {
            list.push(moved(pose));
        }
    }

    /// Finds the nodes whose values differ from those at the first time, other than matrices.
    fn compare(&mut self, document: &Document, taken: &Document) {
        if std::ptr::eq(document, taken) {
            return;
        }
        let (before, now) = (&document.nodes, &taken.nodes);
        for (index, (a, b)) in before.iter().zip(now).enumerate() {
            let id = NodeId(index as u32);
            let differs = a.fields.len() != b.fields.len()
                || a.fields
                    .iter()
                    .zip(&b.fields)
                    .any(|(x, y)| x.value != y.value);
            let nodes = || [document, taken].map(|document| NodeRef { document, id });
            if differs && is_lost(nodes()) && self.is_changing.insert(id, ()).is_none() {
                self.changing.push(id);
            }
        }
    }

    /// Keeps what moves.
    fn finish(self, times: Vec<f64>) -> Motion {
        let count = times.len();
        let size = self.model.bounds();
        let size = size.map_or(1.0, |(min, max)| (max - min).length());
        let moves = |list: &[Option<DAffine3>]| {
            list.len() == count && list.iter().any(|m| differs(&list[0], m, size))
        };
        let nodes = self.nodes.into_iter().enumerate();
        let keep = |lists: Vec<Vec<Pose>>| {
            let lists = lists.into_iter().enumerate();
            let moving = lists.filter(|(_, l)| l.len() == count && l.iter().any(|p| *p != l[0]));
            moving.collect()
        };
        Motion {
            times,
            nodes: nodes.filter(|(_, list)| moves(list)).collect(),
            cameras: keep(self.cameras),
            lights: keep(self.lights),
            changing: self.changing,
        }
    }
}

/// Whether two matrices differ by more than rounding, in a scene of a size.
fn differs(a: &Option<DAffine3>, b: &Option<DAffine3>, size: f64) -> bool {
    let (Some(a), Some(b)) = (a, b) else {
        return a.is_some() != b.is_some();
    };
    let off = |x: f64, y: f64, unit: f64| (x - y).abs() > 1e-7 * unit.max(x.abs());
    let (p, q) = (a.to_cols_array(), b.to_cols_array());
    let mut pairs = p.iter().zip(&q).enumerate();
    pairs.any(|(i, (x, y))| off(*x, *y, if i < 9 { 1.0 } else { size }))
}

/// Whether the change of a node from one time to another is of geometry, colors, light or the
/// extent of a view, and neither of a matrix nor of the choice of a switch, which the motion of
/// nodes expresses.
fn is_lost([before, now]: [NodeRef<'_>; 2]) -> bool {
    let Some(class) = before.known_class() else {
        return false;
    };
    let changes = |name: &str| before.value(name) != now.value(name);
    match class.role {
        Role::Camera => ["heightAngle", "height", "fieldOfView", "aspectRatio"]
            .into_iter()
            .any(changes),
        Role::Light => {
            let is_pose = |name: &str| ["location", "position", "direction"].contains(&name);
            let mut names = class.fields.iter().map(|field| field.name);
            names.any(|name| !is_pose(name) && changes(name))
        }
        Role::Shape | Role::Held => true,
        Role::Property => {
            let is_matrix = [
                "Transform",
                "Translation",
                "Rotation",
                "Scale",
                "Manip",
                "Rotor",
            ];
            let moves = ["Pendulum", "Shuttle", "RotationXYZ", "AntiSquish", "Units"];
            let name = class.name;
            let texture = name.starts_with("Texture");
            texture || !is_matrix.iter().chain(&moves).any(|m| name.ends_with(m))
        }
        _ => false,
    }
}
