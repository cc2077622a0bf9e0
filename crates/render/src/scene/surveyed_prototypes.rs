//! Surveys each prototype of a scene once.

use glam::{DAffine3, DMat4, DVec3};
use ivcam_inventor::traversal::{Grid, State};

use super::canvas::grow;
use super::census::Census;
use super::instances::{grid_bounds, moved};
use super::instancing::{Instancer, Prototypes};
use super::inventor_box::InventorBox;
use super::survey::{Survey, Surveyor};

/// What a survey finds in a prototype, in the prototype's space.
#[derive(Default)]
pub(super) struct SurveyedPrototype {
    survey: Survey,
    census: Census,
    triangles: u64,
    /// The open separators, as [`Surveyor::open`].
    open: Vec<(DMat4, Option<InventorBox>)>,
}

impl<'a> Instancer<'a> for Surveyor<'a> {
    type Outside = SurveyedPrototype;

    fn prototypes(&mut self) -> Option<&mut Prototypes<'a>> {
        self.prototypes.as_mut()
    }

    fn begin_prototype(&mut self, state: &mut State<'a>) -> SurveyedPrototype {
        state.world_from_object = DMat4::IDENTITY;
        let mut outside = SurveyedPrototype {
            open: vec![(DMat4::IDENTITY, None)],
            ..SurveyedPrototype::default()
        };
        self.exchange(&mut outside);
        outside
    }

    fn end_prototype(&mut self, outside: SurveyedPrototype, is_spoiled: bool) -> Option<u32> {
        let mut found = outside;
        self.exchange(&mut found);
        (!is_spoiled).then(|| {
            self.surveyed.push(found);
            self.surveyed.len() as u32 - 1
        })
    }

    fn place(&mut self, prototype: u32, grid: Option<Grid>, state: &State<'a>) -> bool {
        self.add(prototype as usize, grid, state.world_from_object);
        true
    }
}

impl Surveyor<'_> {
    /// Exchanges what was found so far.
    fn exchange(&mut self, other: &mut SurveyedPrototype) {
        use std::mem::swap;
        swap(&mut self.survey, &mut other.survey);
        swap(&mut self.canvas.census, &mut other.census);
        swap(&mut self.canvas.triangle_count, &mut other.triangles);
        swap(&mut self.open, &mut other.open);
    }

    /// Adds a prototype once or on a grid. Its exact box is that around the box in its own space,
    /// which is larger than that of what is drawn if it is turned.
    fn add(&mut self, number: usize, grid: Option<Grid>, world: DMat4) {
        let found = &self.surveyed[number];
        let between = grid.map(|grid| grid_bounds(&grid, [0; 3], grid.last()));
        let (low, high) = between.unwrap_or_default();
        if let Some((min, max)) = found.survey.bounds {
            let around = moved((min + low, max + high), &DAffine3::from_mat4(world));
            if around.0.is_finite() && around.1.is_finite() {
                grow(&mut self.survey.bounds, around);
            }
        }
        let times = grid.map_or(1, |grid| grid.len());
        let add = |sum: &mut u64, n: u64| *sum = sum.saturating_add(n.saturating_mul(times));
        add(&mut self.canvas.triangle_count, found.triangles);
        for (class, count) in &found.survey.shapes {
            add(self.survey.shapes.entry(class).or_default(), *count);
        }
        self.canvas.census.add_drawn(&found.census, times);
        let Some(&(_, Some(bounds))) = found.open.first() else {
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
    use ivcam_inventor::snapshot::{Corners, Snapshot};

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
            [Instancing::WhereItPays, Instancing::Everywhere].map(|when| survey(scene, when));
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
        let found = survey(scene, Instancing::WhereItPays);
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
