//! A scene as the pointer searches it: what a click at a place of the picture would act on.

use std::sync::Arc;

use glam::DVec2;
use ivcam_inventor::events::{PointerTarget, ShapePicker};
use ivcam_inventor::iv::Document;
use ivcam_inventor::pose::CameraPose;
use ivcam_render::scene::shape_picker;

use super::session::{Session, options, snapshot_of};

/// A document as events have left it at a time.
#[derive(Debug)]
pub(crate) struct PointerScene {
    document: Document,
    /// Seconds since the scene was opened.
    time: f64,
    picker: Arc<dyn ShapePicker>,
}

impl Session {
    /// Returns the scene as the pointer searches it, if something in it acts for the pointer.
    pub(crate) fn pointer_scene(&self) -> Option<PointerScene> {
        if !PointerTarget::exist_in(&self.document) {
            return None;
        }
        let snapshot = snapshot_of(&self.document, &self.plan, self.viewer());
        let (needs, projection) = (
            self.plan.shading.needs(),
            self.camera.projection(&self.pose),
        );
        let options = options(&self.plan, needs, &self.pose, projection);
        Some(PointerScene {
            document: snapshot.into_document(),
            time: self.plan.time,
            picker: shape_picker(&options),
        })
    }
}

impl PointerScene {
    /// Returns what acts for the shape at a place of the picture of a viewer without a lens.
    pub(crate) fn target(
        &self,
        viewer: &CameraPose,
        place: DVec2,
        aspect: f64,
    ) -> Option<PointerTarget> {
        let ray = viewer.ray(place, aspect);
        PointerTarget::find(&self.document, self.time, viewer, &ray, &self.picker)
    }
}
