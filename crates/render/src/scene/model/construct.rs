//! Makes models of snapshots and of documents.

use ivcam_inventor::events::SnapshotOptions;
use ivcam_inventor::iv::Document;
use ivcam_inventor::snapshot::Snapshot;

use super::options::ModelOptions;
use super::recenter::recenter;
use super::scene_model::Model;
use super::tree;
use crate::scene::snapshot;

impl Model {
    /// Makes a model of a snapshot.
    pub fn of(snapshot: &Snapshot<'_>, options: &ModelOptions) -> Self {
        let mut model = tree::build(snapshot, options);
        let found = snapshot.diagnostics().iter().cloned();
        model.diagnostics.extend(found);
        if options.recenter {
            recenter(&mut model);
        }
        model
    }

    /// Makes a model of a document at a time in seconds.
    pub fn at(document: &Document, time: f64, options: &ModelOptions) -> Self {
        let at = SnapshotOptions {
            time,
            ..SnapshotOptions::default()
        };
        Self::of(&snapshot(document, &at, &options.compile), options)
    }
}
