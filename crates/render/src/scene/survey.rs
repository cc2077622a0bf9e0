//! Surveys a scene without compiling it: bounds, cameras, lights and counts.

use glam::{DMat4, DVec3};
use indexmap::IndexMap;
use ivcam_base::diag::{Diagnostic, counted};
use ivcam_inventor::grammar::{class, reset_transform};
use ivcam_inventor::iv::{Document, NodeId, NodeRef};
use ivcam_inventor::pose::CameraPose;
use ivcam_inventor::snapshot::{Corners, Snapshot};
use ivcam_inventor::traversal::role::Role;
use ivcam_inventor::traversal::state::{LightElement, State};
use ivcam_inventor::traversal::{self, Instance, LaterCamera, Visitor, WalkOptions};

use super::canvas::{BoundsCanvas, PictureView, grow};
use super::census::Census;
use super::instancing::{Prototypes, draw_instance};
use super::inventor_box::InventorBox;
use super::options::CompileOptions;
use super::render_scene::RenderScene;
use super::shapes;
use super::surveyed_prototypes::SurveyedPrototype;

/// The contents of a scene. Positions are in meters in world space.
#[derive(Clone, Debug, Default)]
pub struct Survey {
    /// The smallest and the largest corner of the exact bounding box of everything drawn.
    pub bounds: Option<(DVec3, DVec3)>,
    /// The bounding box that Inventor computes from nested boxes, at least as large as the exact
    /// one.
    pub inventor_bounds: Option<(DVec3, DVec3)>,
    /// The cameras and viewpoints in order of traversal.
    pub cameras: Vec<CameraPose>,
    /// The lights that are on, with the names of their classes, in order of traversal.
    pub lights: Vec<(String, LightElement)>,
    /// The number of triangles as Inventor triangulates. A cube has 12; spheres, cones and
    /// cylinders are not counted.
    pub triangles: u64,
    /// The number of shapes of each class.
    pub shapes: IndexMap<&'static str, u64>,
    /// The counts of nodes and of what is left out.
    pub census: Census,
    /// What is wrong with the scene.
    pub diagnostics: Vec<Diagnostic>,
}

/// The visitor that makes a survey.
pub(super) struct Surveyor<'a> {
    pub(super) snapshot: &'a Snapshot<'a>,
    pub(super) canvas: BoundsCanvas,
    pub(super) survey: Survey,
    /// The matrix of each open separator and the box of its contents so far, with the root first.
    pub(super) open: Vec<(DMat4, Option<InventorBox>)>,
    /// The prototypes, unless the scene is expanded.
    pub(super) prototypes: Option<Prototypes<'a>>,
    /// The findings of each prototype, by its number.
    pub(super) surveyed: Vec<SurveyedPrototype>,
    /// Whether sizes in pixels depend on the last camera of the scene, because the options have
    /// none.
    uses_scene_cameras: bool,
    cameras: LaterCamera,
    /// Whether the walk ends at the first shape with a size.
    ends_at_shape: bool,
}

impl<'a> Surveyor<'a> {
    /// Prepares a survey of a whole snapshot.
    fn new(snapshot: &'a Snapshot<'a>, options: &CompileOptions, walk: &WalkOptions) -> Self {
        Self {
            snapshot,
            canvas: BoundsCanvas::new(PictureView::of(options)),
            survey: Survey::default(),
            open: vec![(DMat4::IDENTITY, None)],
            prototypes: Prototypes::new(snapshot, options, walk),
            surveyed: Vec::new(),
            uses_scene_cameras: options.camera.is_none(),
            cameras: LaterCamera::default(),
            ends_at_shape: false,
        }
    }

    /// Adds a box to that of the innermost open separator.
    pub(super) fn join(&mut self, below: InventorBox) {
        if let Some((_, all)) = self.open.last_mut() {
            *all = Some(match *all {
                Some(before) => before.join(below),
                None => below,
            });
        }
    }
}

impl RenderScene {
    /// Surveys a snapshot.
    pub fn survey(snapshot: &Snapshot<'_>, options: &CompileOptions) -> Survey {
        survey(snapshot, options)
    }
}

/// Returns whether a snapshot has nothing to draw: it has no shape, or none with a size that is
/// drawn.
pub fn draws_nothing(snapshot: &Snapshot<'_>, options: &CompileOptions) -> bool {
    let mut surveyor = Surveyor::new(snapshot, options, &options.walk());
    surveyor.ends_at_shape = true;
    traversal::walk(snapshot, &options.walk(), &mut surveyor);
    surveyor.survey.bounds.is_none()
}

/// Returns a warning if a document declares prototypes and uses none, as a library for other files
/// does.
pub fn unused_prototypes(document: &Document) -> Option<Box<Diagnostic>> {
    let declared = document.protos.list.iter().filter(|p| !p.external).count();
    if declared == 0 || !document.expansions.is_empty() {
        return None;
    }
    let message = format!(
        "the file declares {} and uses none",
        counted(declared, "prototype")
    );
    let help = "a file that uses them, by `EXTERNPROTO`, shows them";
    Some(Diagnostic::warning(message).with_help(help))
}

/// Surveys a snapshot.
pub(super) fn survey(snapshot: &Snapshot<'_>, options: &CompileOptions) -> Survey {
    let mut survey = survey_once(snapshot, options, false);
    // The box of a node that switches by time or distance contains all its children (Coin, SGI).
    let switches = ["Blinker", "LOD", "LevelOfDetail"];
    if switches.iter().any(|c| survey.census.seen.contains_key(c)) {
        survey.inventor_bounds = survey_once(snapshot, options, true).inventor_bounds;
    }
    let found = snapshot.diagnostics().iter().cloned();
    survey.diagnostics.extend(found);
    let unused = unused_prototypes(snapshot.document());
    let unused = unused.filter(|_| survey.bounds.is_none());
    survey.diagnostics.extend(unused.map(|warning| *warning));
    survey
}

/// Surveys a snapshot by one walk.
fn survey_once(snapshot: &Snapshot<'_>, options: &CompileOptions, all_levels: bool) -> Survey {
    let walk_options = WalkOptions {
        all_levels,
        ..options.walk()
    };
    let mut surveyor = Surveyor::new(snapshot, options, &walk_options);
    traversal::walk(snapshot, &walk_options, &mut surveyor);
    let Surveyor {
        canvas,
        mut survey,
        open,
        ..
    } = surveyor;
    survey.inventor_bounds = open[0].1.map(|b| b.project());
    survey.triangles = canvas.triangle_count;
    survey.census = canvas.census;
    survey.diagnostics = canvas.reports.finish();
    survey
}

/// Returns the first camera in the order of traversal, or a view of everything from the front, as
/// pictures have it: a `Text2` alone has a size in Inventor's box and none in the box of surfaces.
/// Returns `None` for a scene without anything to see.
pub(super) fn first_camera(
    snapshot: &Snapshot<'_>,
    options: &CompileOptions,
) -> Option<CameraPose> {
    let walk = WalkOptions::within(&options.limits);
    traversal::first_camera(snapshot, &walk).or_else(|| {
        let bounds = survey(snapshot, options).inventor_bounds?;
        Some(CameraPose::view_all(bounds, 1.0))
    })
}

/// Returns the exact bounding box of some nodes in world space, walked with a given state.
pub(super) fn bounds_of<'a>(
    snapshot: &'a Snapshot<'_>,
    list: &'a [NodeId],
    state: State<'a>,
) -> Option<Corners> {
    struct BoundsVisitor(BoundsCanvas, Option<Corners>);
    impl<'a> Visitor<'a> for BoundsVisitor {
        fn shape(&mut self, node: NodeRef<'a>, state: &State<'a>) {
            shapes::draw(node, state, &mut self.0);
            if let Some(bounds) = self.0.bounds.take() {
                grow(&mut self.1, bounds);
            }
        }
    }
    let options = WalkOptions {
        all_levels: true,
        max_visits: 100_000,
        ..WalkOptions::default()
    };
    let picture = PictureView::of(&CompileOptions::default());
    let mut bounds = BoundsVisitor(BoundsCanvas::new(picture), None);
    traversal::walk_list(snapshot, list, state, &options, &mut bounds);
    bounds.1
}

/// Returns the area of the bounding box of a node's children in the picture, in pixels. Returns
/// `None` without a camera.
pub(super) fn screen_area<'a>(
    snapshot: &'a Snapshot<'_>,
    node: NodeRef<'a>,
    state: &State<'a>,
    picture: &PictureView,
) -> Option<f64> {
    let screen = picture.screen()?;
    let children = &node.data().children;
    let bounds = bounds_of(snapshot, children, state.clone())?;
    Some(screen.area(bounds))
}

/// Whether a node resets Inventor's bounding box of its separator.
fn resets_box(node: NodeRef<'_>) -> bool {
    let resets = |what| what & reset_transform::WHAT_TO_RESET_BBOX != 0;
    node.known_class()
        .is_some_and(|c| c.id == class::RESET_TRANSFORM)
        && node
            .acting(reset_transform::WHAT_TO_RESET)
            .is_some_and(resets)
}

impl<'a> Visitor<'a> for Surveyor<'a> {
    fn shape(&mut self, node: NodeRef<'a>, state: &State<'a>) {
        if let Some(class) = node.known_class() {
            *self.survey.shapes.entry(class.name).or_default() += 1;
        }
        if let Some(warning) = self.cameras.at_shape(state) {
            self.canvas.reports.add(*warning);
        }
        shapes::draw(node, state, &mut self.canvas);
        if let Some(bounds) = self.canvas.bounds {
            grow(&mut self.survey.bounds, bounds);
        }
        if let Some(object) = self.canvas.object_bounds
            && let Some((matrix, _)) = self.open.last()
        {
            let local = matrix.inverse() * state.world_from_object;
            if local.is_finite() {
                self.join(InventorBox::new(object, local));
            }
        }
        self.canvas.bounds = None;
        self.canvas.object_bounds = None;
    }

    fn instance(&mut self, part: Instance<'a>, state: &State<'a>) -> bool {
        draw_instance(self, part, state)
    }

    fn is_full(&self) -> bool {
        let has_shape = self.ends_at_shape && self.survey.bounds.is_some();
        has_shape || self.prototypes.as_ref().is_some_and(Prototypes::is_full)
    }

    fn open(&mut self, state: &State<'a>) {
        self.open.push((state.world_from_object, None));
    }

    fn close(&mut self) {
        let Some((matrix, below)) = self.open.pop() else {
            return;
        };
        if let (Some(below), Some((outer, _))) = (below, self.open.last()) {
            let local = outer.inverse() * matrix;
            if local.is_finite() {
                self.join(below.under(local));
            }
        }
    }

    fn light(&mut self, node: NodeRef<'a>, light: &LightElement, _state: &State<'a>) {
        let class = node.class_name().to_owned();
        self.survey.lights.push((class, *light));
    }

    fn camera(&mut self, node: NodeRef<'a>, state: &State<'a>) {
        self.cameras.at_camera(node);
        let Some(pose) = CameraPose::from_node(node, state.world_from_object) else {
            return;
        };
        let is_viewpoint = node
            .known_class()
            .is_some_and(|c| c.name.ends_with("Viewpoint"));
        if self.uses_scene_cameras && !is_viewpoint {
            self.canvas.picture.camera = Some(pose.clone());
        }
        self.survey.cameras.push(pose);
    }

    fn node(&mut self, node: NodeRef<'a>, role: Role) {
        if let Some(prototypes) = &mut self.prototypes {
            let warning = prototypes.begin_node(node, role);
            self.canvas.reports.diagnostics.extend(warning.map(|w| *w));
        }
        if resets_box(node)
            && let Some((_, all)) = self.open.last_mut()
        {
            *all = None;
        }
        let handles = self.snapshot.has_handles();
        self.canvas.census.see_node(node, handles);
        self.canvas.reports.not_applied(node);
    }

    fn screen_area(&mut self, node: NodeRef<'a>, state: &State<'a>) -> Option<f64> {
        screen_area(self.snapshot, node, state, &self.canvas.picture)
    }

    fn report(&mut self, diagnostic: Box<Diagnostic>) {
        self.canvas.reports.add(*diagnostic);
    }
}
