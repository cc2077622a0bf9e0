//! How this program takes snapshots: with the engine that runs scripts, if it is built in.

use ivcam_inventor::events::ScriptEngine;
use ivcam_inventor::pose::CameraPose;

use super::plan::Plan;
use ivcam_inventor::events::SnapshotOptions;

/// Returns the options of the snapshot for a plan, with the viewer if it is not at the scene's own
/// camera.
pub(super) fn snapshot_for(plan: &Plan, viewer: Option<&CameraPose>) -> SnapshotOptions {
    SnapshotOptions {
        handles: plan.handles,
        actions: plan.actions.clone(),
        aspect: Some(plan.resolution.aspect()),
        viewer: viewer.cloned(),
        ..snapshot_options(plan.time)
    }
}

/// Returns the options of a snapshot at a time in seconds.
pub(crate) fn snapshot_options(time: f64) -> SnapshotOptions {
    SnapshotOptions {
        time,
        scripts: engine(),
        ..SnapshotOptions::default()
    }
}

/// Returns the engine that runs scripts.
#[cfg(feature = "scripts")]
fn engine() -> Option<&'static dyn ScriptEngine> {
    Some(&ivcam_script::JavaScript)
}

#[cfg(not(feature = "scripts"))]
fn engine() -> Option<&'static dyn ScriptEngine> {
    None
}
