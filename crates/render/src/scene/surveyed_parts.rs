//! Surveys a part of a scene once that is drawn many times.

use glam::{DAffine3, DMat4, DVec3};
use indexmap::IndexMap;
use ivcam_inventor::snapshot::Corners;
use ivcam_inventor::traversal::{Grid, Repeated, State};

use super::canvas::grow;
use super::census::Census;
use super::instances::{grid_bounds, moved};
use super::inventor_box::InventorBox;
use super::shared_parts::{Outcome, RecordsParts, SharedParts, walk_recorded};
use super::survey::Surveyor;

/// What a survey finds in a part, in the part's space.
pub(super) struct SurveyedPart {
    bounds: Option<Corners>,
    inventor_bounds: Option<InventorBox>,
    triangles: u64,
    shapes: IndexMap<&'static str, u64>,
    census: Census,
}

impl<'a> RecordsParts<'a> for Surveyor<'a> {
    fn parts(&mut self) -> Option<&mut SharedParts<'a>> {
        self.parts.as_mut()
    }
}

impl<'a> Surveyor<'a> {
    /// Adds a part by what is known of it; it is surveyed at its first use. Returns `false` if the
    /// part is to be walked.
    pub(super) fn repeat(&mut self, part: Repeated<'a>, state: &State<'a>) -> bool {
        let Some(parts) = &mut self.parts else {
            return false;
        };
        let outcome = match parts.find(part, state) {
            Outcome::New => self.record(part, state),
            outcome => outcome,
        };
        if let Outcome::Recorded(number) = outcome {
            let grid = match part {
                Repeated::Grid(_, grid) => Some(grid),
                _ => None,
            };
            self.add(number as usize, grid, state.world_from_object);
        }
        matches!(outcome, Outcome::Recorded(_))
    }

    /// Surveys a part in its own space.
    fn record(&mut self, part: Repeated<'a>, state: &State<'a>) -> Outcome {
        let Some(parts) = &mut self.parts else {
            return Outcome::Expanded;
        };
        let mut inner = parts.begin(part, state);
        inner.world_from_object = DMat4::IDENTITY;
        let survey = std::mem::take(&mut self.survey);
        let census = std::mem::take(&mut self.canvas.census);
        let triangles = std::mem::take(&mut self.canvas.triangle_count);
        let open = std::mem::replace(&mut self.open, vec![(DMat4::IDENTITY, None)]);
        walk_recorded(self.snapshot, part, inner, self);
        let own = std::mem::replace(&mut self.survey, survey);
        let own_open = std::mem::replace(&mut self.open, open);
        let found = SurveyedPart {
            bounds: own.bounds,
            inventor_bounds: own_open.first().and_then(|(_, bounds)| *bounds),
            triangles: std::mem::replace(&mut self.canvas.triangle_count, triangles),
            shapes: own.shapes,
            census: std::mem::replace(&mut self.canvas.census, census),
        };
        let Some(parts) = &mut self.parts else {
            return Outcome::Expanded;
        };
        let record = (!parts.end()).then(|| {
            self.surveyed.push(found);
            self.surveyed.len() as u32 - 1
        });
        parts.keep(part, state, record)
    }

    /// Adds a part once or on a grid. Its exact box is that around the box in the part's space,
    /// which is larger than that of what is drawn if the part is turned.
    fn add(&mut self, number: usize, grid: Option<Grid>, world: DMat4) {
        let part = &self.surveyed[number];
        let between = grid.map(|grid| grid_bounds(&grid, [0; 3], grid.last()));
        let (low, high) = between.unwrap_or_default();
        if let Some((min, max)) = part.bounds {
            let around = moved((min + low, max + high), &DAffine3::from_mat4(world));
            if around.0.is_finite() && around.1.is_finite() {
                grow(&mut self.survey.bounds, around);
            }
        }
        let times = grid.map_or(1, |grid| grid.len());
        let add = |sum: &mut u64, n: u64| *sum = sum.saturating_add(n.saturating_mul(times));
        add(&mut self.canvas.triangle_count, part.triangles);
        for (class, count) in &part.shapes {
            add(self.survey.shapes.entry(class).or_default(), *count);
        }
        self.canvas.census.add_drawn(&part.census, times);
        let Some(bounds) = part.inventor_bounds else {
            return;
        };
        let outer = self.open.last().map(|(matrix, _)| matrix.inverse());
        let local = outer.unwrap_or_default() * world;
        let corners = grid.map(|grid| grid.corners([0; 3], grid.last()));
        let corners = corners.as_ref().map_or(&[DVec3::ZERO][..], |all| all);
        for &offset in corners {
            let placed = local * DMat4::from_translation(offset);
            if placed.is_finite() {
                self.join(bounds.under(placed));
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::scene::options::Instancing;
    use crate::scene::{CompileOptions, RenderScene, Survey};
    use ivcam_inventor::iv::Document;
    use ivcam_inventor::snapshot::Snapshot;

    fn survey(scene: &str, instancing: Instancing) -> Survey {
        let text = format!("#Inventor V2.1 ascii\n{scene}").into_bytes();
        let document = Document::read_headerless("s.iv", text).expect("reads");
        let options = CompileOptions {
            instancing,
            ..CompileOptions::default()
        };
        RenderScene::survey(&Snapshot::at(&document, 0.0), &options)
    }

    #[test]
    fn a_scene_with_shared_parts_has_the_survey_of_the_expanded_one() {
        let scene = "DEF a Separator { Sphere { } Translation { translation 2 0 0 } Cube { } }
            Separator { Transform { translation 1 7 2 scaleFactor 1 2 -1 } USE a }
            DEF b Separator { RotationXYZ { axis Z angle .5 } USE a }
            Separator { Translation { translation 0 0 9 } USE b PointLight { } }
            Array { numElements1 3 numElements3 2 separation1 4 0 0 separation3 1 0 6 USE a }
            PerspectiveCamera { }";
        let [known, found] =
            [Instancing::BeyondLimits, Instancing::Everywhere].map(|when| survey(scene, when));
        assert_eq!(known.shapes, found.shapes);
        assert_eq!(known.triangles, found.triangles);
        assert_eq!(known.census.seen, found.census.seen);
        assert_eq!((found.lights.len(), found.cameras.len()), (1, 1));
        let near = |a: Option<Corners>, b: Option<Corners>| {
            let (a, b) = (a.expect("a box"), b.expect("a box"));
            (a.0 - b.0).abs().max((a.1 - b.1).abs()).max_element()
        };
        assert!(near(known.inventor_bounds, found.inventor_bounds) < 1e-9);
        // Boxes of turned parts are larger.
        let ((low, high), (min, max)) =
            (known.bounds.expect("a box"), found.bounds.expect("a box"));
        assert!(min.cmple(low + 1e-9).all() && max.cmpge(high - 1e-9).all());
        assert!(near(known.bounds, found.bounds) < 2.0);
    }

    #[test]
    fn a_forest_of_a_million_copies_is_surveyed() {
        let scene = "Array { numElements1 1000 numElements2 1000 separation1 3 0 0 Cube { } }";
        let found = survey(scene, Instancing::BeyondLimits);
        assert!(found.diagnostics.is_empty(), "{:?}", found.diagnostics);
        assert_eq!(found.shapes["Cube"], 1_000_000);
        assert_eq!(found.triangles, 12_000_000);
        let (low, high) = found.bounds.expect("a box");
        assert_eq!(
            (low, high),
            (DVec3::splat(-1.0), DVec3::new(2998.0, 1000.0, 1.0))
        );
        assert_eq!(found.inventor_bounds, Some((low, high)));
    }
}
