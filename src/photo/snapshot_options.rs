//! How this program takes snapshots: with the engine that runs scripts, if it is built in.

use ivcam_inventor::snapshot::SnapshotOptions;
use ivcam_inventor::snapshot::events::ScriptEngine;

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
