//! Takes snapshots of documents, and measures the bounding boxes that their engines need.

use std::sync::Arc;

use ivcam_inventor::events::{Action, ShapePicker, SnapshotOptions, hears_collisions};
use ivcam_inventor::iv::{Document, NodeId};
use ivcam_inventor::snapshot::{Bounds, Corners, Snapshot};
use ivcam_inventor::traversal::state::{Language, State};

use super::options::CompileOptions;
use super::pick::Picker;
use super::survey::{bounds_of, survey};

/// Takes a snapshot of a document. The compile options determine how the bounding boxes that
/// engines need are measured, and where the pointer meets shapes.
pub fn snapshot<'a>(
    document: &'a Document,
    at: &SnapshotOptions,
    options: &CompileOptions,
) -> Snapshot<'a> {
    let points = at.actions.iter().any(Action::depends_on_viewer);
    if at.picker.is_some() || !(points || hears_collisions(document)) {
        return Snapshot::take(document, at, &SurveyBounds(options));
    }
    let at = SnapshotOptions {
        picker: Some(shape_picker(options)),
        ..at.clone()
    };
    Snapshot::take(document, &at, &SurveyBounds(options))
}

/// Returns what tells where the pointer meets shapes that are compiled with some options.
pub fn shape_picker(options: &CompileOptions) -> Arc<dyn ShapePicker> {
    Arc::new(Picker(options.clone()))
}

/// Measures bounding boxes by surveys.
struct SurveyBounds<'a>(&'a CompileOptions);

impl Bounds for SurveyBounds<'_> {
    fn of_roots(&self, part: &Snapshot<'_>) -> Option<Corners> {
        survey(part, self.0).bounds
    }

    fn of_nodes(&self, part: &Snapshot<'_>, nodes: &[NodeId]) -> Option<Corners> {
        bounds_of(part, nodes, State::new(Language::Inventor))
    }
}

#[cfg(test)]
mod tests {
    use std::sync::Arc;

    use glam::DVec3;

    use super::*;
    use crate::scene::RenderScene;
    use ivcam_inventor::grammar;
    use ivcam_inventor::iv::{Limits, NoFiles};

    fn bounds(text: &str) -> Option<(DVec3, DVec3)> {
        let text = format!("#Inventor V2.1 ascii\n{text}").into_bytes();
        let document = Document::read("a.iv", text, Arc::new(NoFiles), &Limits::default());
        let document = document.expect("reads");
        let at = SnapshotOptions {
            handles: true,
            ..SnapshotOptions::default()
        };
        let options = CompileOptions::default();
        RenderScene::survey(&snapshot(&document, &at, &options), &options).bounds
    }

    #[test]
    fn every_dragger_of_the_catalogue_has_handles() {
        for class in grammar::CLASSES
            .iter()
            .filter(|c| c.name.ends_with("Dragger"))
        {
            if class.treatment != grammar::Treatment::Abstract && class.name != "Dragger" {
                assert!(
                    bounds(&format!("{} {{ }}", class.name)).is_some(),
                    "{}",
                    class.name
                );
            }
        }
    }

    #[test]
    fn a_draggers_handles_move_with_it_and_following_nodes_do_not() {
        let (min, max) = bounds("Translate1Dragger { translation 10 0 0 } Cube { }").expect("both");
        assert!((min.x + 1.0).abs() < 1e-5 && (max.x - 11.5).abs() < 1e-5);
    }

    #[test]
    fn a_manipulators_handles_surround_the_shapes_that_it_moves() {
        let (min, max) = bounds(
            "Separator { HandleBoxManip { } Translation { translation 3 0 0 } Cube { width 4 } }",
        )
        .expect("both");
        assert!(
            min.x < 1.0 && min.x > 0.0 && max.x > 5.0 && max.x < 6.5,
            "{min} {max}"
        );
    }

    #[test]
    fn a_part_in_the_file_replaces_the_default_handles() {
        let (min, _) =
            bounds("Translate1Dragger { translator Sphere { radius 7 } }").expect("a ball");
        assert!((min.x + 7.0).abs() < 1e-5);
    }
}
