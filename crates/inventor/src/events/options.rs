//! The options of a snapshot.

use std::sync::Arc;

use super::action::Action;
use super::engine::ScriptEngine;
use super::picker::ShapePicker;
use crate::pose::CameraPose;

/// The options of a snapshot.
#[derive(Clone, Debug, Default)]
pub struct SnapshotOptions {
    /// Seconds since the scene was opened. Default: 0. A time that is not finite counts as 0.
    pub time: f64,
    /// Whether the handles of draggers and manipulators are added. Default: no.
    pub handles: bool,
    /// The engine that runs scripts. Default: none, so that each script is reported as not run.
    pub scripts: Option<&'static dyn ScriptEngine>,
    /// The viewer, for sensors that depend on it. Default: none, which stands for the bound
    /// `Viewpoint`, or where there is none, for VRML97's default one.
    pub viewer: Option<CameraPose>,
    /// The width of the viewer's picture over its height. Default: 1.
    pub aspect: Option<f64>,
    /// What a user does with the scene. Default: nothing.
    pub actions: Vec<Action>,
    /// Where shapes are, for the pointer. Default: unknown, so that the pointer has no place:
    /// `TouchSensor`s send no points, and drag sensors only `isActive`.
    pub picker: Option<Arc<dyn ShapePicker>>,
    /// Whether the events that nodes send are recorded. Default: no.
    pub log: bool,
}

impl SnapshotOptions {
    /// Returns the time, which is finite.
    pub(super) fn moment(&self) -> f64 {
        if self.time.is_finite() {
            self.time
        } else {
            0.0
        }
    }
}
