//! The session: a plan with its scene compiled and its lens focused.

use std::path::{Path, PathBuf};
use std::sync::Arc;
use std::time::{Duration, Instant};

use glam::DVec3;
use indexmap::IndexMap;
use ivcam_base::diag::{Diagnostic, Result, Sink};
use ivcam_base::files::Inputs;
use ivcam_base::math::Meters;
use ivcam_base::math::lanes::is_portable;
use ivcam_base::memory::MemoryBudget;
use ivcam_base::work::{Budget, StopCause};
use ivcam_inventor::events::{Action, depends_on_viewer};
use ivcam_inventor::iv::Document;
use ivcam_inventor::pose::{CameraPose, Projection, UpAxis, ViewDirection};
use ivcam_inventor::snapshot::Snapshot;
use ivcam_inventor::traversal::state::Language;
use ivcam_inventor::traversal::{WalkOptions, first_camera};
use ivcam_optics::film::{ErrorEstimate, ErrorUnknown, Film, GhostImage, Region};
use ivcam_optics::lens::Movements;
use ivcam_optics::picture::{Depth, Picture};
use ivcam_optics::sampling::{FilterTable, Sampler};
use ivcam_render::camera::{Camera, LampFinder, LensCamera, film_plane, lens_in_scene};
use ivcam_render::render::diffraction::{diffract, diffraction_time, error_of_diffracted};
use ivcam_render::render::ghosts::GhostRender;
use ivcam_render::render::report::{RenderReport, StageSeconds, stated_error};
use ivcam_render::render::{
    Exposure, Progress, Render, Stop, Stopped, Stopwatch, Summary, SurfaceSum, Task, is_stopped,
};
#[cfg(test)]
use ivcam_render::scene::Unneeded;
use ivcam_render::scene::{
    ColorCoding, CompileOptions, Light, Needs, RenderScene, Studio, draws_nothing,
    precision_warning, snapshot, unused_prototypes,
};
use ivcam_render::shade::{EnvironmentLight, PathOptions, ShadeOptions, Shader, Shading};
use ivcam_render::team::Team;

use super::camera_choice::{camera_file, is_beyond_a_file};
use super::checkpoint::Label;
use super::environment_picture::environment_picture;
use super::flash::flash_of;
use super::headlight::{HeadlightCause, HeadlightSources, HeadlightState, headlight_in_world};
use super::lens_settings::{camera, in_meters, warn_about_camera};
use super::light_plan::Surroundings;
use super::memory::{film_bytes, memory_beside_film};
use super::overview::Overview;
use super::plan::{Era, Optics, Plan};
use super::pose::{Environment, inventor_bounds, own_focus, resolve_pose, view_of_everything};
use super::snapshot_options::snapshot_for;
use super::stopping::{GRACE, StopKeeper};
use super::studio::{stopped_down, studio_of};
use super::view::{Override, better_side, photographed_side};

/// The options that two runs of one picture may have different values of.
pub(super) const FREE: [&str; 7] = [
    "samples",
    "time",
    "target-error",
    "region",
    "memory",
    "search",
    "contain",
];

/// The number of rays for the ghosts of each light, per sample of a pixel. No search is recorded:
/// the time is proportional to it, and the noise of the ghosts to the inverse of its root. The mean
/// does not depend on it.
const GHOST_RAYS: u32 = 1 << 17;

/// The key of the metadata of a picture whose render was interrupted.
pub(crate) const UNFINISHED: &str = "ivcam:unfinished";
/// The time that is kept for diffraction, over the one that was measured: threads share caches.
const MARGIN: f64 = 1.3;
/// The end of the note about a picture whose diffraction was canceled.
const WITHOUT_DIFFRACTION: &str = "without diffraction";

/// A plan that is ready to render: the scene is compiled, the camera is placed and the lens is
/// focused.
pub struct Session {
    /// The choices of the photograph.
    pub plan: Plan,
    /// The scene file. [`Session::open`] keeps its nodes; the command line frees them.
    pub document: Arc<Document>,
    /// The compiled scene.
    pub scene: Arc<RenderScene>,
    /// The projection that the scene was compiled for (see [`Camera::projection`]).
    pub(super) projection: Projection,
    /// The pose of the camera in the scene.
    pub pose: CameraPose,
    /// The camera with its lens.
    pub camera: Camera,
    /// The headlight in world space, if it is on.
    pub(crate) headlight: Option<Light>,
    /// Whether the scene has nothing to draw, wherever the camera is.
    pub(crate) draws_nothing: bool,
    /// The side that was chosen because the front shows next to nothing.
    turned: Option<ViewDirection>,
    /// Whether the camera was the scene's own, which events can move or change.
    follows_scene: bool,
    /// The facts that decide about the headlight if the plan does not set it.
    pub(crate) headlight_sources: HeadlightSources,
    /// The headlight of the environment file, in camera space.
    environment_headlight: Option<Light>,
    /// What is added to the scene.
    studio: Option<Studio>,
    /// The metered factor of the exposure, of a studio or of `--exposure auto`.
    pub(super) metered: f64,
    /// The light of the surroundings, with a sun.
    surroundings: Option<(Arc<EnvironmentLight>, Option<Light>)>,
    /// The processes that share the work of rendering; `None` if this one does it alone.
    pub(crate) team: Option<Arc<Team>>,
    /// The seconds that each step took.
    pub seconds: StageSeconds,
    /// The diagnostics of reading, compiling and the lens. [`Session::notices`] has what else the
    /// program tells its user.
    pub sink: Sink,
    /// The messages about the lens, as it was opened.
    lens_messages: Sink,
    /// The plan's memory, from which the film and the scene have taken theirs.
    pub memory: MemoryBudget,
    /// The account of the scene, with the signal that ends its work.
    pub(crate) budget: Budget,
    /// The time that opening took, if `--time` is for opening and one exposure together.
    pub(super) opening: Option<Duration>,
    /// The choices for the metadata and the report, with those of the scene and the lens.
    pub described: IndexMap<String, String>,
}

/// The number of rays from the camera and toward lights for a picture of 16 samples, the usual
/// number. It does not depend on the plan's samples or region: a ray may hit another triangle in
/// another tree (12 of 460,800 values of a picture differed by up to 1e-4), and a picture that is
/// continued or made in parts has to have the same bits.
fn usual_rays(plan: &Plan, scene: &RenderScene) -> u64 {
    let pixels = u64::from(plan.resolution.width) * u64::from(plan.resolution.height);
    let lights = match plan.shading {
        Shading::Recursive => scene.lights().len() as u64,
        // The rays of three turns, each with its rays toward lamps.
        Shading::Path => 8,
        _ => 0,
    };
    pixels.saturating_mul(16 * (1 + lights))
}

/// What a plan's scene is compiled from.
struct SceneSource<'a> {
    plan: &'a Plan,
    document: &'a Document,
    snapshot: &'a Snapshot<'a>,
    studio: Option<Studio>,
}

/// A compiled scene with the camera in front of it.
struct FramedScene {
    pose: CameraPose,
    camera: Camera,
    /// The projection that the scene was compiled for.
    projection: Projection,
    scene: RenderScene,
}

impl SceneSource<'_> {
    fn options(&self, pose: &CameraPose, projection: Projection) -> CompileOptions {
        CompileOptions {
            studio: self.studio,
            ..options(self.plan, self.plan.shading.needs(), pose, projection)
        }
    }

    fn compile(&self, pose: CameraPose, camera: Camera) -> Result<FramedScene> {
        let projection = camera.projection(&pose);
        let scene = RenderScene::compile(self.snapshot, &self.options(&pose, projection))?;
        Ok(FramedScene {
            pose,
            camera,
            projection,
            scene,
        })
    }

    /// Views the scene from another side if the front shows next to nothing, or photographs of the
    /// scene are seen from there. Returns that side, too.
    fn turned(
        &self,
        framed: FramedScene,
        framing: &Plan,
    ) -> Result<(FramedScene, Option<ViewDirection>)> {
        let FramedScene {
            pose,
            camera,
            scene,
            ..
        } = &framed;
        let side = better_side(scene, camera, pose);
        let Some(side) = side.or_else(|| photographed_side(scene, camera, pose)) else {
            return Ok((framed, None));
        };
        let bounds = framed_bounds(self.document, self.snapshot, self.plan);
        let pose = view_of_everything(bounds, framing, side);
        let mut turned = self.compile(pose, framed.camera)?;
        turned.camera = turned.camera.posed(&turned.pose, turned.scene.origin);
        Ok((turned, Some(side)))
    }

    /// Adds what the snapshot found. Returns whether there is nothing to draw.
    fn report(&self, framed: &FramedScene, sink: &mut Sink) -> bool {
        let options = || self.options(&framed.pose, framed.projection);
        let draws_nothing =
            framed.scene.primitives() == (0, 0, 0) && draws_nothing(self.snapshot, &options());
        if draws_nothing && let Some(warning) = unused_prototypes(self.document) {
            sink.add(*warning);
        }
        for diagnostic in self.snapshot.diagnostics() {
            sink.add_at_most_warning(diagnostic);
        }
        draws_nothing
    }
}

/// Returns what reading the files of a plan has found.
fn found_in_reading(document: &Document, plan: &Plan) -> Sink {
    let mut sink = Sink::new();
    sink.extend_from(&document.sink);
    for diagnostic in &plan.fonts.warnings {
        sink.add((**diagnostic).clone());
    }
    sink
}

/// Returns what decides about the headlight, as far as it is known before the scene is compiled.
fn headlight_sources(
    plan: &Plan,
    document: &Document,
    environment: &Environment,
    overview: &Overview,
) -> HeadlightSources {
    let lights_itself = plan.light.shines() && plan.shading == Shading::Path;
    let has_environment = plan.environment.is_some();
    HeadlightSources {
        environment: has_environment.then_some(environment.headlight.is_some()),
        navigation_info: overview.navigation_info,
        is_vrml97: Language::of(document) == Language::Vrml97 && !lights_itself,
        scene_has_light: overview.has_light || lights_itself,
    }
}

/// Whether the side from which the scene is seen is ours to choose.
fn may_turn(plan: &Plan, framing: &Plan, environment: &Environment, overview: &Overview) -> bool {
    let is_stated =
        framing.camera.is_some() || environment.pose.is_some() || overview.camera.is_some();
    // What the pointer was over was seen from the front.
    let is_touched = plan.actions.iter().any(Action::depends_on_viewer);
    !is_stated && !plan.solids && framing.view.is_none() && !is_touched
}

/// What a session does with the nodes of its document after compiling them.
#[derive(Clone, Copy, PartialEq, Eq)]
enum Nodes {
    Kept,
    Freed,
}

impl Session {
    /// Reads and compiles the scene, and focuses the lens.
    ///
    /// # Errors
    /// Returns an error if a file cannot be read, if a camera file has no camera, or if the lens
    /// cannot focus at the distance.
    pub fn open(plan: Plan) -> Result<Self> {
        let framing = plan.clone();
        Self::open_framed(plan, &framing)
    }

    /// Opens a plan like [`Session::open`], for a scene that is compiled only once. The text of a
    /// large file is freed before that, and its nodes before the tree over the primitives is built.
    ///
    /// # Errors
    /// Returns the errors of [`Session::open`].
    pub fn open_once(plan: Plan) -> Result<Self> {
        let framing = plan.clone();
        Self::read(plan, &framing, Nodes::Freed)
    }

    /// Opens a plan with the camera pose of another plan for the same scene. The window opens a
    /// scene with a pinhole, but frames it for the lens that the pinhole replaces.
    ///
    /// # Errors
    /// Returns an error if a file cannot be read, if a camera file has no camera, or if the lens
    /// cannot focus at the distance.
    pub(crate) fn open_framed(plan: Plan, framing: &Plan) -> Result<Self> {
        Self::read(plan, framing, Nodes::Kept)
    }

    fn read(plan: Plan, framing: &Plan, nodes: Nodes) -> Result<Self> {
        check_region(&plan)?;
        memory_beside_film(&plan)?;
        let budget = budget_of(&plan);
        let time = plan.stop.time.filter(|_| nodes == Nodes::Freed);
        let _timer = time.map(|time| budget.stop().after(time + GRACE));
        let clock = Instant::now();
        let mut session = budget.during(|| Self::read_scene(plan, framing, nodes))?;
        session.opening = time.map(|_| clock.elapsed());
        Ok(session)
    }

    fn read_scene(plan: Plan, framing: &Plan, nodes: Nodes) -> Result<Self> {
        let clock = Instant::now();
        let search: Vec<&Path> = plan.search.iter().map(PathBuf::as_path).collect();
        let mut document =
            Document::open_or_stdin(&plan.scene, &search, plan.contain.as_deref(), &plan.limits)?;
        let environment = match plan.environment.as_deref() {
            Some(path) => Environment::merge(&mut document, path, plan.time)?,
            None => Environment::default(),
        };
        if nodes == Nodes::Freed {
            document.release_text();
        }
        let read = clock.elapsed().as_secs_f64();
        let mut session = Self::from_document(plan, framing, (document, nodes), &environment)?;
        session.seconds.read = read;
        Ok(session)
    }

    /// Opens a plan whose scene has been read already. An environment file is not read.
    ///
    /// # Errors
    /// Returns the errors of [`Session::open`].
    pub fn with_document(plan: Plan, document: Document) -> Result<Self> {
        check_region(&plan)?;
        let framing = plan.clone();
        budget_of(&plan).during(|| {
            let document = (document, Nodes::Kept);
            Self::from_document(plan, &framing, document, &Environment::default())
        })
    }

    /// Compiles a document that has been read, and focuses the lens.
    fn from_document(
        plan: Plan,
        framing: &Plan,
        (mut document, nodes): (Document, Nodes),
        environment: &Environment,
    ) -> Result<Self> {
        let memory = memory_beside_film(&plan)?;
        let budget = Budget::current();
        let mut seconds = StageSeconds::default();
        let mut sink = found_in_reading(&document, &plan);

        let clock = Instant::now();
        let mut snapshot = snapshot_of(&document, &plan, None);
        let overview = Overview::of(&snapshot, &plan.limits);
        let headlight_sources = headlight_sources(&plan, &document, environment, &overview);
        let may_turn = may_turn(&plan, framing, environment, &overview);
        let bounds = || framed_bounds(&document, &snapshot, &plan);
        let own = overview.camera.clone();
        let mut pose = resolve_pose(framing, &snapshot, environment, own, bounds, &mut sink)?;
        let follows_scene = overview.camera.as_ref() == Some(&pose);
        if !follows_scene && has_viewer(&document, &plan) {
            snapshot = snapshot_of(&document, &plan, Some(&pose));
        }
        if plan.solids {
            drop(snapshot);
            lens_into_scene(&plan, &pose, &mut document, &mut sink)?;
            snapshot = snapshot_of(&document, &plan, None);
            pose = first_camera(&snapshot, &WalkOptions::within(&plan.limits)).unwrap_or(pose);
        }
        seconds.compile = clock.elapsed().as_secs_f64();
        budget.check()?;

        let clock = Instant::now();
        let studio = studio_of(&plan, &snapshot);
        let stopped = stopped_down(&plan, &pose, studio.as_ref());
        let choices = stopped.as_ref().unwrap_or(&plan);
        let mut lens_messages = Sink::new();
        let (camera, settings) = camera(choices, &pose, &mut lens_messages)?;
        sink.extend_from(&lens_messages);
        warn_about_camera(choices, &pose, &camera, &mut sink);
        budget.check()?;
        seconds.pupil = clock.elapsed().as_secs_f64();

        let clock = Instant::now();
        let source = SceneSource {
            plan: &plan,
            document: &document,
            snapshot: &snapshot,
            studio,
        };
        let framed = source.compile(pose, camera)?;
        let (framed, turned) = match may_turn {
            true => source.turned(framed, framing)?,
            false => (framed, None),
        };
        let draws_nothing = source.report(&framed, &mut sink);
        drop(snapshot);
        if nodes == Nodes::Freed {
            document.free_nodes();
        }
        let FramedScene {
            pose,
            camera,
            projection,
            scene,
        } = framed;
        budget.check()?;
        scene.prepare(usual_rays(&plan, &scene));
        budget.check()?;
        seconds.compile += clock.elapsed().as_secs_f64();

        let surroundings = surroundings(&plan, &mut sink)?;
        let mut described = plan.describe();
        described.insert("camera".into(), pose.source.clone());
        described.extend(settings);
        let mut session = Self {
            headlight: None,
            draws_nothing,
            turned,
            follows_scene,
            headlight_sources,
            environment_headlight: environment.headlight,
            surroundings,
            metered: 1.0,
            studio,
            plan,
            document: Arc::new(document),
            scene: Arc::new(scene),
            projection,
            pose,
            camera,
            team: None,
            seconds,
            sink,
            lens_messages,
            memory,
            budget,
            opening: None,
            described,
        };
        session.add_findings(overview.diagnostics);
        if let Some(warning) = overview.later_camera.filter(|_| session.follows_scene) {
            session.sink.add(*warning);
        }
        session.decide_headlight();
        session.meter();
        Ok(session)
    }

    /// Adds what compiling and traversing the scene found. The picture can be rendered in spite of
    /// it, so what compiling found are at most warnings.
    fn add_findings(&mut self, traversal: Vec<Diagnostic>) {
        let Self { sink, scene, .. } = self;
        for diagnostic in &scene.census().diagnostics {
            sink.add_at_most_warning(diagnostic);
        }
        let unknown = traversal.into_iter().filter(|d| !sink.has(&d.message));
        for diagnostic in unknown.collect::<Vec<_>>() {
            sink.add(diagnostic);
        }
        let world = |p: glam::Vec3| p.as_dvec3() + scene.origin;
        let bounds = scene.bounds().map(|(low, high)| (world(low), world(high)));
        if let Some(warning) = precision_warning(bounds, Some(self.pose.position)) {
            sink.add(*warning);
        }
    }

    /// Turns the headlight on or off as the plan and the scene say.
    fn turn_headlight(&mut self) -> HeadlightState {
        let lit = self.headlight_state();
        self.headlight = headlight_in_world(lit.on, self.environment_headlight, &self.pose);
        self.described
            .insert("headlight".into(), lit.describe().into());
        lit
    }

    /// Turns the headlight on or off, and warns if that leaves the scene without any light.
    fn decide_headlight(&mut self) {
        let (is_path, emission) = (self.plan.shading == Shading::Path, self.plan.light.emission);
        self.headlight_sources.scene_has_light |= is_path && self.scene.has_lamps(emission);
        let lit = self.turn_headlight();
        let can_be_lit = self.plan.shading.needs().lights && self.scene.primitives() != (0, 0, 0);
        let glows = is_path && self.scene.has_glow(emission);
        if can_be_lit && !glows && is_left_dark(self.headlight_sources, lit) {
            let dark = "the scene has no light, and the headlight is off";
            let help = "`-headlight`, or `--headlight=on`, turns the light on the camera on";
            self.sink.add(*Diagnostic::warning(dark).with_help(help));
        }
    }

    /// Changes the plan and the pose for the same scene file. Only the parts that differ are
    /// updated.
    ///
    /// # Errors
    /// Returns an error if the lens cannot focus at the distance, or if the scene does not compile.
    pub(crate) fn change(&mut self, plan: Plan, pose: CameraPose) -> Result<()> {
        let stands = pose.orientation == self.pose.orientation
            && plan.time == self.plan.time
            && plan.shading == self.plan.shading
            && plan.light == self.plan.light
            && plan.resolution == self.plan.resolution;
        self.aim(plan, pose)?;
        if stands && self.is_compiled_from_here() {
            return Ok(());
        }
        self.compile(self.plan.shading)
    }

    /// Returns whether the scene was compiled for the camera's present position and projection.
    pub(crate) fn is_compiled_from_here(&self) -> bool {
        self.scene.origin == self.pose.position
            && self.projection == self.camera.projection(&self.pose)
    }

    /// Compiles the scene again, with the camera's position as its origin.
    ///
    /// # Errors
    /// Returns an error if the scene does not compile. The session is then unchanged.
    pub(crate) fn compile(&mut self, shading: Shading) -> Result<()> {
        self.compile_parts(shading.needs())
    }

    /// Compiles the scene with parts that the shading model does not need.
    #[cfg(test)]
    pub(crate) fn compile_everything(&mut self) -> Result<()> {
        let facets = self.plan.shading.needs().facets;
        self.compile_parts(Needs {
            facets,
            ..Needs::ALL
        })
    }

    /// Makes every ray do work that the scene does not need.
    #[cfg(test)]
    pub(crate) fn force(&mut self, unneeded: Unneeded) {
        if let Some(scene) = Arc::get_mut(&mut self.scene) {
            scene.force(unneeded);
        }
    }

    /// Returns the pose of the scene's own camera at the time of a plan, if the session began with
    /// it.
    pub(crate) fn scene_pose(&self, plan: &Plan) -> Option<CameraPose> {
        let snapshot = self
            .follows_scene
            .then(|| snapshot_of(&self.document, plan, None))?;
        first_camera(&snapshot, &WalkOptions::within(&plan.limits))
    }

    fn compile_parts(&mut self, needs: Needs) -> Result<()> {
        self.budget = self.budget.renewed();
        let budget = self.budget.clone();
        budget.during(|| self.compile_again(needs))?;
        budget.check()
    }

    /// Returns the viewer of the scene, if what happens depends on one that is not at the scene's
    /// own camera.
    pub(super) fn viewer(&self) -> Option<&CameraPose> {
        has_viewer(&self.document, &self.plan)
            .then_some(&self.pose)
            .filter(|pose| self.scene_pose(&self.plan).as_ref() != Some(pose))
    }

    fn compile_again(&mut self, needs: Needs) -> Result<()> {
        let projection = self.camera.projection(&self.pose);
        let options = options(&self.plan, needs, &self.pose, projection);
        let snapshot = snapshot_of(&self.document, &self.plan, self.viewer());
        let options = CompileOptions {
            studio: studio_of(&self.plan, &snapshot),
            ..options
        };
        self.studio = options.studio;
        let scene = RenderScene::compile(&snapshot, &options)?;
        for diagnostic in snapshot.diagnostics() {
            if !self.sink.has(&diagnostic.message) {
                self.sink.add_at_most_warning(diagnostic);
            }
        }
        scene.prepare(usual_rays(&self.plan, &scene));
        let camera = self.camera.clone();
        self.camera = camera.posed(&self.pose, scene.origin);
        self.scene = Arc::new(scene);
        self.projection = projection;
        Ok(())
    }

    /// Changes the plan and the pose without compiling the scene again. Parts of the scene that
    /// depend on the camera (levels of detail, billboards, line widths) are not updated.
    ///
    /// # Errors
    /// Returns an error if the lens cannot focus at the distance. The session is then unchanged.
    pub(crate) fn aim(&mut self, plan: Plan, pose: CameraPose) -> Result<()> {
        let focus = |plan: &Plan, pose: &CameraPose| plan.focus.unwrap_or_else(|| own_focus(pose));
        let same_lens = matches!(plan.optics, Optics::Lens(_))
            && plan.optics == self.plan.optics
            && focus(&plan, &pose) == focus(&self.plan, &self.pose)
            && (plan.film, plan.aim) == (self.plan.film, self.plan.aim)
            && plan.dispersion == self.plan.dispersion
            && plan.movements == self.plan.movements;
        let stop = |plan: &Plan, pose| stopped_down(plan, pose, self.studio.as_ref());
        let stopped = stop(&plan, &pose);
        let choice = |stopped: &Option<Plan>| stopped.as_ref()?.lens().cloned();
        let same_stop = || choice(&stopped) == choice(&stop(&self.plan, &self.pose));
        let fresh = if same_lens && same_stop() {
            self.camera.clone()
        } else {
            let choices = stopped.as_ref().unwrap_or(&plan);
            let mut lens_messages = Sink::new();
            let (fresh, settings) = camera(choices, &pose, &mut lens_messages)?;
            self.sink.extend_from(&lens_messages);
            warn_about_camera(choices, &pose, &fresh, &mut self.sink);
            self.lens_messages = lens_messages;
            self.described.extend(settings);
            fresh
        };
        self.camera = fresh.posed(&pose, self.scene.origin);
        self.described.extend(plan.describe());
        (self.plan, self.pose) = (plan, pose);
        self.turn_headlight();
        self.state_metered();
        Ok(())
    }

    /// Returns the messages about the lens and the camera in use.
    #[cfg(feature = "panels")]
    pub(crate) fn camera_messages(&self) -> Vec<Diagnostic> {
        let mut messages = self.lens_messages.clone();
        warn_about_camera(&self.plan, &self.pose, &self.camera, &mut messages);
        messages.items().to_vec()
    }

    /// Returns the bounding box of the scene as Inventor's `viewAll` sees it, in meters.
    #[cfg(feature = "panels")]
    pub(crate) fn inventor_bounds(&self) -> Option<(DVec3, DVec3)> {
        let snapshot = snapshot_of(&self.document, &self.plan, None);
        super::pose::inventor_bounds(&snapshot, &self.plan)
    }

    /// Returns whether the headlight is on, and why.
    pub(super) fn headlight_state(&self) -> HeadlightState {
        self.headlight_sources.resolve(self.plan.headlight)
    }

    /// Returns the camera in use as a file for `--camera`, with the distance in focus.
    /// [`Self::focus_beyond_camera_file`] warns if that is infinite.
    ///
    /// # Errors
    /// Fails if the camera is a film behind solid glass, which a camera file has no node for.
    pub fn camera_file(&self) -> Result<String> {
        if self.pose.film.is_some() {
            return Err(Diagnostic::unsupported(
                "a camera file can't hold a film behind solid glass",
            )
            .with_help("write the camera without `--solids`"));
        }
        let focus = self.plan.focus.unwrap_or_else(|| own_focus(&self.pose));
        let pose = self.pose.clone().fitted(self.plan.resolution.aspect());
        Ok(camera_file(&pose, focus.0))
    }

    /// Returns the warning that [`Self::camera_file`] does not hold the lens's focus at infinity.
    pub fn focus_beyond_camera_file(&self) -> Option<Box<Diagnostic>> {
        let focus = self
            .plan
            .focus
            .filter(|_| self.plan.optics != Optics::Pinhole)?;
        is_beyond_a_file(&self.pose, focus.0).then(|| {
            let own = in_meters(Meters(self.pose.focal_distance));
            let text = format!(
                "a camera file can't hold the focus at infinity; this one is focused at {own}"
            );
            Diagnostic::warning(text).with_help("give `--focus inf` again, with `--camera`")
        })
    }

    /// Returns whether the headlight is a flash beside the lens: in model `i`, if the scene has no
    /// light and neither an option nor a file asks for the headlight.
    fn has_flash(&self) -> bool {
        let lit = self.headlight_state();
        let is_implied = matches!(lit.cause, HeadlightCause::Scene | HeadlightCause::Vrml97);
        let is_alone = !self.headlight_sources.scene_has_light;
        self.plan.shading == Shading::Path && lit.on && is_implied && is_alone
    }

    /// Returns a line for the user if the headlight is on only because the scene has no light.
    pub fn headlight_notice(&self) -> Option<&'static str> {
        let lit = self.headlight_state();
        let automatic = lit.on && lit.cause == HeadlightCause::Scene;
        let can_be_lit = self.plan.shading.needs().lights && self.scene.primitives() != (0, 0, 0);
        let line = match self.has_flash() {
            false => {
                "headlight: on, because the scene has no light; --headlight=off turns it off, --studio lights it softly"
            }
            true => {
                "headlight: a flash beside the lens, because the scene has no light; --headlight=off turns it off, --headlight=on puts it at the lens, --studio lights it softly"
            }
        };
        let advice = match self.plan.light.studio {
            true => ", --studio lights it softly",
            false => "",
        };
        (automatic && can_be_lit).then(|| line.strip_suffix(advice).unwrap_or(line))
    }

    /// Returns the lines for the user about what was chosen for a scene that states no light or no
    /// camera, and about a lens that does not light the corners of the film.
    pub fn notices(&self) -> Vec<String> {
        let headlight = self.headlight_notice().map(str::to_owned);
        let rest = [self.view_notice(), self.cover_notice()];
        headlight
            .into_iter()
            .chain(rest.into_iter().flatten())
            .collect()
    }

    /// Returns the distance from the middle of the film at which the light of the lens ends, in
    /// millimeters, if it does not light the corners.
    pub(crate) fn lit_radius(&self) -> Option<f64> {
        match &self.camera {
            Camera::Lens(camera) => camera.lit_radius(),
            _ => None,
        }
    }

    /// Returns a line for the user if the lens does not light the corners of the film. The program
    /// of 1999 had none.
    pub fn cover_notice(&self) -> Option<String> {
        let Camera::Lens(camera) = &self.camera else {
            return None;
        };
        let lit = self.lit_radius().filter(|_| self.plan.era == Era::Modern)?;
        let (corner, film) = (camera.format.half_diagonal(), camera.format);
        let efl = camera.lens.first_order().efl() * corner / lit;
        // Rounded down, because the corners of a larger film stay black.
        let covered = |length: f64| libm::floor(10.0 * length * lit / corner) / 10.0;
        Some(format!(
            "lens: its light ends {lit:.1} mm from the middle of the film, whose corners are at {corner:.1} mm \
             and stay black; `--efl {:.0}mm` covers the film, and the lens covers `--film {:.1}x{:.1}`",
            efl.ceil(),
            covered(film.width),
            covered(film.height)
        ))
    }

    /// Returns a line for the user if the scene has no camera and is not seen from the front.
    pub fn view_notice(&self) -> Option<String> {
        let side = self.turned?.name();
        let fault = match self.turned?.up {
            UpAxis::Y => "shows next to nothing from the front",
            _ => "its pictures are mirrored from the front: z is down",
        };
        Some(format!(
            "view: {side}, because the scene has no camera and {fault}; --view front keeps to it"
        ))
    }

    /// Exposes a film on the threads of rayon's current pool. `progress` is called after each tile.
    pub fn expose(&self, progress: &(dyn Fn(Progress) + Sync)) -> Exposure {
        self.expose_task(Task::default(), progress)
    }

    /// Exposes a film as far as a task says. A film that is interrupted has no ghosts.
    pub(crate) fn expose_task(
        &self,
        task: Task<'_>,
        progress: &(dyn Fn(Progress) + Sync),
    ) -> Exposure {
        let sampler = self.plan.pixel_sampler();
        self.expose_all(sampler, self.plan.stop, task, progress)
    }

    /// Exposes a film with another sampler and another end than the plan's.
    pub fn expose_with(
        &self,
        sampler: Sampler,
        stop: Stop,
        progress: &(dyn Fn(Progress) + Sync),
    ) -> Exposure {
        self.expose_all(sampler, stop, Task::default(), progress)
    }

    fn expose_all(
        &self,
        sampler: Sampler,
        mut stop: Stop,
        task: Task<'_>,
        progress: &(dyn Fn(Progress) + Sync),
    ) -> Exposure {
        let is_whole = task.samples.is_none() && task.sums.is_none();
        let left = self.opening.zip(stop.time);
        let left = left.map(|(opening, time)| time.saturating_sub(opening));
        let _timer = left.map(|left| self.budget.stop().after(left + GRACE));
        stop.time = left.or(stop.time).map(|time| self.time_for_rays(time));
        let signal = StopKeeper(self.budget.stop().clone());
        let keepers = &[task.keepers, &[&signal]].concat()[..];
        let task = Task { keepers, ..task };
        let mut exposure = match is_whole && self.shows_nothing() {
            true => Exposure::without_light(self.region().resolution(), stop.samples),
            false => self.with_render(sampler, stop, |render| {
                render.run_inside(self.region(), task, progress)
            }),
        };
        let (Camera::Lens(camera), true) = (&self.camera, self.plan.ghosts) else {
            return exposure;
        };
        if exposure.stopped.is_some() {
            return exposure;
        }
        let watch = Stopwatch::start();
        match self.ghosts(camera, sampler, &|| !is_stopped(keepers)) {
            Some(ghosts) => {
                exposure.film.ghosts = Some(match self.plan.region {
                    Some(region) => ghosts.cut(region, self.plan.resolution),
                    None => ghosts,
                });
            }
            None => exposure.stopped = Some(Stopped::before_ghosts(exposure.samples)),
        }
        exposure.spent = exposure.spent.plus(watch.spent());
        exposure
    }

    /// Does the work that the first process of a team hands out, until it ends. Uses rayon's
    /// current pool.
    #[cfg(any(test, feature = "mpi"))]
    pub(crate) fn serve(&self, team: &Team) {
        self.with_render(self.plan.pixel_sampler(), self.plan.stop, |render| {
            render.serve(team);
        });
    }

    /// Returns whether the scene has no primitive, and neither a background nor surroundings, so
    /// that no ray can bring light.
    pub(super) fn shows_nothing(&self) -> bool {
        let is_empty = self.scene.primitives() == (0, 0, 0);
        is_empty && self.scene.background().is_black() && self.surroundings.is_none()
    }

    /// Returns what the first samples of each pixel meet. Uses rayon's current pool.
    pub(super) fn surfaces(&self, samples: u32) -> Vec<SurfaceSum> {
        let render = |render: &Render<'_>| render.surfaces(self.region(), samples);
        self.with_render(self.plan.pixel_sampler(), self.plan.stop, render)
    }

    /// Returns the label of a checkpoint of the picture. `inputs` are the files that were read.
    pub(crate) fn label(&self, inputs: &Inputs) -> Label {
        let is_lens = matches!(self.camera, Camera::Lens(_));
        let additions = [
            (self.plan.ghosts && is_lens, "--ghosts"),
            (self.plan.diffraction && is_lens, "--diffraction"),
        ];
        let used = additions.into_iter().filter(|(used, _)| *used);
        Label {
            facts: self.facts(inputs),
            described: self.choices(),
            response: self.plan.response.name(),
            is_deep: self.plan.depth == Depth::Sixteen,
            additions: used.map(|(_, name)| name.to_owned()).collect(),
        }
    }

    /// Returns the region of the picture that is rendered.
    pub(crate) fn region(&self) -> Region {
        let all = Region::whole(self.plan.resolution);
        self.plan.region.unwrap_or(all)
    }

    /// Calls `work` with the scene, the camera and the settings of a render.
    pub(super) fn with_render<T>(
        &self,
        sampler: Sampler,
        stop: Stop,
        work: impl FnOnce(&Render<'_>) -> T,
    ) -> T {
        let lamps = match self.plan.shading {
            Shading::Path => LampFinder::new(&self.scene, &self.camera),
            _ => None,
        };
        work(&Render {
            shader: &self.shader(),
            camera: &self.camera,
            sampler,
            resolution: self.plan.resolution,
            exposure: self.exposure_factor(),
            stop,
            filter: &FilterTable::new(self.plan.filter),
            adaptive: self.plan.adaptive,
            team: self.team.as_deref(),
            lamps: lamps.as_ref(),
        })
    }

    /// Returns the shader of the plan, which computes the radiance along rays.
    pub(crate) fn shader(&self) -> Shader<'_> {
        self.shader_of(self.plan.shading)
    }

    /// Returns a shader of another model, which may need no more of the scene than the plan's.
    pub(super) fn shader_of(&self, shading: Shading) -> Shader<'_> {
        let options = ShadeOptions {
            headlight: self.headlight,
            backward: (self.pose.orientation * DVec3::Z).as_vec3(),
            start: match (&self.plan.optics, self.pose.projection) {
                (Optics::Pinhole, Projection::Orthographic { .. }) => self.pose.near as f32,
                _ => 0.0,
            },
            viewer: (self.pose.position - self.scene.origin).as_vec3(),
            max_depth: self.max_depth(),
            mirrors: self.plan.mirrors,
            shadows_at_eye: self.plan.unseen_shadows,
            path: self.path_options(),
            ..ShadeOptions::default()
        };
        Shader::new(&self.scene, shading, options)
    }

    /// Returns the options of model `i`.
    fn path_options(&self) -> PathOptions {
        let light = &self.plan.light;
        PathOptions {
            max_depth: self.plan.max_depth,
            clamp: light.clamp,
            emission: light.emission,
            light_radius: 0.5 * light.light_size.0 as f32,
            sun_angle: light.sun_size as f32,
            environment: self.surroundings.as_ref().map(|(light, _)| light.clone()),
            sun: self.surroundings.as_ref().and_then(|(_, sun)| *sun),
            flash: match self.has_flash() {
                true => flash_of(&self.scene, &self.camera, &self.pose),
                false => None,
            },
            background_lights: light.surroundings == Some(Surroundings::Background),
        }
    }

    /// Returns the ghosts of the scene's lights; none if `proceed` returns false meanwhile.
    fn ghosts(
        &self,
        camera: &LensCamera,
        sampler: Sampler,
        proceed: &(dyn Fn() -> bool + Sync),
    ) -> Option<GhostImage> {
        let render = GhostRender {
            scene: &self.scene,
            camera,
            resolution: self.plan.resolution,
            exposure: self.exposure_factor(),
            rays: sampler.samples.saturating_mul(GHOST_RAYS).min(1 << 26),
            seed: sampler.seed,
        };
        render.expose(&self.scene.lights_on_lens(), proceed)
    }

    /// Returns the factor of the exposure.
    pub(crate) fn exposure_factor(&self) -> f64 {
        self.level_of_white() * self.metered_factor() * self.plan.exposure
    }

    /// Returns the exposure of radiance 1 on the axis by shutter and ISO; 1 without them.
    pub(super) fn level_of_white(&self) -> f64 {
        match (&self.plan.metering, &self.camera) {
            (Some(metering), Camera::Lens(camera)) => {
                metering.level_of_white(camera.metered_irradiance())
            }
            (Some(metering), Camera::Ideal(lens)) => metering.level_of_white(lens.axial_irradiance),
            _ => 1.0,
        }
    }

    /// Returns the largest number of successive reflections and refractions. Through a lens of
    /// solids the default is 64, because a ray is refracted at every surface.
    fn max_depth(&self) -> u32 {
        let usual = match self.camera {
            Camera::Film(_) => 64,
            _ => ShadeOptions::default().max_depth,
        };
        self.plan.max_depth.unwrap_or(usual)
    }

    /// Returns the film of an exposure with diffraction, if the plan has it, the camera has a
    /// pupil, and the work is not stopped before.
    fn diffracted(&self, exposure: &Exposure) -> Option<Film> {
        let Camera::Lens(camera) = &self.camera else {
            return None;
        };
        if !self.plan.diffraction {
            return None;
        }
        let stop = self.budget.stop();
        let spent = Duration::try_from_secs_f64(exposure.spent.seconds).unwrap_or_default();
        let left = self.opening.zip(self.plan.stop.time);
        let left = left.map(|(opening, time)| time.saturating_sub(opening).saturating_sub(spent));
        // Unlike a pass, it can be left out, so it does not go on after the time.
        let _timer = left.map(|left| stop.after(left));
        diffract(&exposure.film, camera, stop)
    }

    /// Returns the part of a time that is left for rays: diffraction, whose time is measured, takes
    /// up to a half.
    fn time_for_rays(&self, time: Duration) -> Duration {
        match &self.camera {
            Camera::Lens(camera) if self.plan.diffraction => {
                let (size, stop) = (self.plan.resolution, self.budget.stop());
                let diffraction = diffraction_time(size, camera, stop).mul_f64(MARGIN);
                time.saturating_sub(diffraction).max(time / 2)
            }
            _ => time,
        }
    }

    /// Whether the plan has diffraction, and the camera a pupil.
    fn spreads_light(&self) -> bool {
        self.plan.diffraction && matches!(self.camera, Camera::Lens(_))
    }

    /// Returns the error of a developed picture, from that of its rays.
    pub fn error_of(
        &self,
        picture: &Picture,
        rays: std::result::Result<ErrorEstimate, ErrorUnknown>,
    ) -> std::result::Result<ErrorEstimate, ErrorUnknown> {
        match self.is_diffracted(picture) {
            true => error_of_diffracted(rays),
            false => rays,
        }
    }

    /// Returns whether a developed picture has diffraction.
    fn is_diffracted(&self, picture: &Picture) -> bool {
        let said = picture.provenance.get(UNFINISHED);
        self.spreads_light() && !said.is_some_and(|text| text.ends_with(WITHOUT_DIFFRACTION))
    }

    /// Returns the warning that a picture has no diffraction because the work was stopped.
    pub fn warn_without_diffraction(&self, picture: &Picture) -> Option<Box<Diagnostic>> {
        if self.is_diffracted(picture) || !self.spreads_light() {
            return None;
        }
        Some(match self.budget.stop().cause() {
            Some(StopCause::Time) => Diagnostic::warning(
                "`--time` is too short for diffraction; the picture is without it",
            )
            .with_help("give `--time` a longer time, or make a smaller picture"),
            _ => Diagnostic::warning("the work was canceled; the picture is without diffraction"),
        })
    }

    /// Develops an exposure to a picture. Its metadata has the plan and the command line.
    pub fn develop(&self, exposure: &Exposure, command: &str) -> Picture {
        let diffracted = self.diffracted(exposure);
        let film = diffracted.as_ref().unwrap_or(&exposure.film);
        let picture = Picture::develop(film, self.plan.response.clone());
        Picture {
            provenance: self.provenance_of(exposure, diffracted.is_some(), command),
            ..picture
        }
    }

    /// Develops an exposure as [`Session::develop`] does, and releases its memory meanwhile.
    pub(crate) fn develop_last(&self, exposure: Exposure, command: &str) -> Picture {
        let diffracted = self.diffracted(&exposure);
        let provenance = self.provenance_of(&exposure, diffracted.is_some(), command);
        let film = diffracted.unwrap_or(exposure.film);
        let picture = Picture::develop_last(film, self.plan.response.clone());
        Picture {
            provenance,
            ..picture
        }
    }

    /// Returns the metadata of an exposure's picture, with or without diffraction.
    fn provenance_of(
        &self,
        exposure: &Exposure,
        is_diffracted: bool,
        command: &str,
    ) -> IndexMap<String, String> {
        let error = match is_diffracted {
            true => error_of_diffracted(exposure.film.error()),
            false => exposure.film.error(),
        };
        let error = stated_error(error);
        let mut provenance = self.provenance(command, exposure.samples, &error);
        if let Some(stopped) = &exposure.stopped {
            let text = stopped.describe(self.plan.stop.samples);
            provenance.insert(UNFINISHED.into(), text);
        }
        if self.spreads_light() && !is_diffracted {
            let text: &mut String = provenance.entry(UNFINISHED.into()).or_default();
            if !text.is_empty() {
                text.push_str(", ");
            }
            text.push_str(WITHOUT_DIFFRACTION);
        }
        provenance
    }

    /// Returns the metadata of a picture.
    pub(super) fn provenance(
        &self,
        command: &str,
        samples: u32,
        error: &str,
    ) -> IndexMap<String, String> {
        let mut provenance = IndexMap::new();
        let mut say = |key: &str, value: &str| {
            provenance.insert(key.to_owned(), value.to_owned());
        };
        say("Software", concat!("ivcam ", env!("CARGO_PKG_VERSION")));
        say("Command", &self.with_metered_exposure(command));
        say("ivcam:error", error);
        self.described_as_exposed(samples)
            .iter()
            .for_each(|(k, v)| say(&format!("ivcam:{k}"), v));
        provenance
    }

    /// Returns all choices that determine the picture: what the summary says, and the given options
    /// that it does not say.
    fn choices(&self) -> IndexMap<String, String> {
        let scene = self.plan.scene.file_name().unwrap_or_default();
        let scene = ("scene".to_owned(), scene.to_string_lossy().into_owned());
        let mut choices = IndexMap::from([scene]);
        choices.extend(self.plan.with_given(self.described.clone()));
        choices
    }

    /// Returns the choices, with the samples that were really taken: a render that the time or the
    /// error ends takes others than the plan's.
    fn described_as_exposed(&self, samples: u32) -> IndexMap<String, String> {
        let mut described = self.choices();
        described.insert("samples".into(), samples.to_string());
        if is_portable() {
            described.insert("arithmetic".into(), "portable".into());
        }
        described
    }

    /// Returns the report of an exposure, without the picture's name and the time to write it.
    pub fn report(&self, exposure: &Exposure) -> RenderReport {
        let mut report = self.report_of(&exposure.summary());
        report.set_ghosts(&exposure.film);
        report
    }

    /// Returns the report of a render without ghosts, without the picture's name and the time to
    /// write it.
    pub(crate) fn report_of(&self, made: &Summary) -> RenderReport {
        let mut seconds = self.seconds;
        seconds.render = made.spent.seconds;
        let (triangles, quadrics, strokes) = self.scene.primitives();
        let stored = (triangles + quadrics + strokes) as u64;
        let instances = self.scene.census().instances;
        let mut report = RenderReport {
            ivcam: env!("CARGO_PKG_VERSION"),
            scene: self.plan.scene.display().to_string(),
            picture: String::new(),
            plan: self.described_as_exposed(made.samples),
            seconds,
            total_seconds: 0.0,
            processor_seconds: made.spent.processor_seconds,
            samples: made.samples,
            film_rays: 0,
            scene_rays: 0,
            shadow_rays: 0,
            error_rays: 0,
            passed_share: 0.0,
            relative_rmse: None,
            relative_rmse_low: None,
            relative_rmse_high: None,
            error_unknown: None,
            ghosts_of_picture: None,
            ghosts_of_lights: None,
            primitives: stored,
            primitives_drawn: stored.max(instances.primitives),
            shared_parts: instances.prototypes,
            shared_uses: instances.placed,
            left_out: self.left_out(),
        };
        report.set_counts(&made.counts);
        report.set_error(made.error);
        report
    }

    /// Lists what model `i` leaves out of the scene.
    fn leave_of_paths(&self, leave: &mut dyn FnMut(&str, &str)) {
        if !self.scene.has_emitters() {
            leave("luminous shapes", "none");
        }
        if !self.scene.is_transparent() {
            leave("refracted rays", "nothing transparent");
        }
        match self.scene.excess_materials() {
            0 => {}
            count => leave(
                &format!("excess light of {count} materials"),
                "diffuse and specular color exceed 1 in sum and are scaled",
            ),
        }
        match self.scene.unsound_emitters() {
            0 => {}
            count => leave(
                &format!("part of the emission of {count} materials"),
                "it is negative, not a number, or above 1e9",
            ),
        }
    }

    /// Lists the features that the picture did not need, with the reasons.
    fn left_out(&self) -> Vec<String> {
        let mut out = self.scene.left_out();
        let mut leave = |what: &str, why: &str| out.push(format!("{what} ({why})"));
        if self.plan.optics == Optics::Pinhole {
            leave("lens and pupil", "pinhole");
        }
        if let Camera::Lens(camera) = &self.camera
            && !camera.is_dispersing()
        {
            let asked = self.plan.dispersion;
            leave(
                "wavelengths",
                if asked {
                    "glass of one index"
                } else {
                    "dispersion off"
                },
            );
        }
        if self.plan.shading == Shading::Path {
            self.leave_of_paths(&mut leave);
        } else if self.plan.shading.needs().secondary {
            if !self.scene.has_lights() {
                match self.headlight {
                    None => leave("shadow rays", "no lights"),
                    Some(light) if light.at_eye && !self.plan.unseen_shadows => {
                        leave("shadow rays", "no light but the headlight");
                    }
                    Some(_) => {}
                }
            }
            let largest = self.scene.largest_mirror();
            match self.plan.mirrors {
                _ if largest == 0.0 => leave("reflected rays", "no mirrors"),
                None => leave("reflected rays", "mirrors off"),
                Some(least) if largest < least => leave("reflected rays", "no mirrors"),
                Some(_) => {}
            }
            if !self.scene.is_transparent() {
                leave("refracted rays", "nothing transparent");
            }
        } else {
            leave("secondary rays", "shading");
        }
        if self.shows_nothing() {
            let rays = match self.plan.ghosts {
                true => "rays from the film",
                false => "all rays",
            };
            leave(rays, "nothing to see");
        }
        out
    }
}

/// Checks that the plan's region, if it has one, is inside its picture and can be rendered alone.
///
/// # Errors
/// Returns an error if it is not.
pub(crate) fn check_region(plan: &Plan) -> Result<()> {
    let Some(region) = plan.region else {
        return Ok(());
    };
    if plan.diffraction {
        let error = "`--region` can't be used with `--diffraction on`";
        return Err(Diagnostic::unsupported(error).with_help(
            "leave one of them out: diffraction brings light from outside the region into it",
        ));
    }
    region.check(plan.resolution)
}

/// Returns the light of the plan's surroundings, of which it reads the picture, and their sun.
fn surroundings(
    plan: &Plan,
    sink: &mut Sink,
) -> Result<Option<(Arc<EnvironmentLight>, Option<Light>)>> {
    Ok(match &plan.light.surroundings {
        Some(Surroundings::Picture(path)) => {
            Some((Arc::new(environment_picture(path, plan, sink)?), None))
        }
        Some(Surroundings::Sky(sky)) => sky.light().map(|(light, sun)| (light.into(), Some(sun))),
        Some(Surroundings::Background) | None => None,
    })
}

/// Returns whether nothing lights the scene although no option turned the headlight off.
pub(super) fn is_left_dark(sources: HeadlightSources, lit: HeadlightState) -> bool {
    !lit.on && !sources.scene_has_light && lit.cause != HeadlightCause::Option
}

/// Returns the options for compiling a plan's scene. Features that depend on the camera (levels of
/// detail, lines, texture filtering) use the lens's angle of view, and not that of the camera node.
pub(super) fn options(
    plan: &Plan,
    needs: Needs,
    pose: &CameraPose,
    projection: Projection,
) -> CompileOptions {
    CompileOptions {
        origin: pose.position,
        camera: Some(CameraPose {
            projection,
            ..pose.clone()
        }),
        needs,
        pixel_rows: plan.resolution.height,
        texture_folders: plan.search.clone(),
        fonts: plan.fonts.clone(),
        limits: plan.limits.clone(),
        memory: memory_of_scene(plan),
        texture_filter: plan.texture_filter,
        names: plan.layers.mattes,
        coordinates: plan.layers.coordinates,
        idle_lights: plan.ghosts && plan.lens().is_some(),
        culled_faces_cast_shadows: plan.unseen_shadows,
        colors: match plan.shading {
            Shading::Path => plan.light.colors,
            _ => ColorCoding::Levels,
        },
        background: plan.background.map(|choice| match choice {
            Override::Always(color) => (color, true),
            Override::IfUnstated(color) => (color, false),
        }),
        ..CompileOptions::default()
    }
}

/// Returns the account of this thread, or a new one for a plan's scene.
fn budget_of(plan: &Plan) -> Budget {
    Budget::of_thread().unwrap_or_else(|| plan.budget())
}

impl Plan {
    /// Returns a new account for the plan's scene.
    pub fn budget(&self) -> Budget {
        Budget::new(memory_of_scene(self), self.work)
    }
}

/// Returns the memory in bytes that the plan's film leaves to the scene.
fn memory_of_scene(plan: &Plan) -> u64 {
    plan.memory.bytes().saturating_sub(film_bytes(plan))
}

/// Returns the box around a scene at the plan's time, when it was opened, and at the other times at
/// which it has to be in the picture. Pictures of several times then show what moves.
fn framed_bounds(document: &Document, snapshot: &Snapshot<'_>, plan: &Plan) -> (DVec3, DVec3) {
    let others = std::iter::once(&0.0).chain(&plan.framed_over);
    let boxes = others.filter(|time| **time != plan.time).map(|time| {
        let then = Plan {
            time: *time,
            ..plan.clone()
        };
        inventor_bounds(&snapshot_of(document, &then, None), plan)
    });
    let now = inventor_bounds(snapshot, plan);
    let whole = boxes.chain([now]).flatten();
    let whole = whole.reduce(|a, b| (a.0.min(b.0), a.1.max(b.1)));
    whole.unwrap_or_default()
}

/// Returns whether what happens in a scene depends on where its viewer is.
fn has_viewer(document: &Document, plan: &Plan) -> bool {
    plan.actions.iter().any(Action::depends_on_viewer) || depends_on_viewer(document)
}

/// Returns the document at the plan's time. The viewer is given if it is not at the scene's camera.
pub(super) fn snapshot_of<'a>(
    document: &'a Document,
    plan: &Plan,
    viewer: Option<&CameraPose>,
) -> Snapshot<'a> {
    let options = CompileOptions {
        fonts: plan.fonts.clone(),
        limits: plan.limits.clone(),
        memory: memory_of_scene(plan),
        ..CompileOptions::default()
    };
    snapshot(document, &snapshot_for(plan, viewer), &options)
}

/// Adds the lens to the scene as solids at the camera's position, with a film behind it. The film
/// is then the camera.
fn lens_into_scene(
    plan: &Plan,
    pose: &CameraPose,
    document: &mut Document,
    sink: &mut Sink,
) -> Result<()> {
    let Optics::Lens(choice) = &plan.optics else {
        return Err(Diagnostic::error("there is no lens to add to the scene")
            .with_help("leave out `--lens none`, or `--solids`"));
    };
    if !plan.shading.needs().secondary {
        let model = plan.shading.name();
        let error = format!("with model {model}, the glass of `--solids` does not refract");
        return Err(Diagnostic::error(error)
            .with_help("give `--shading recursive` or `--shading path`, or leave out `--solids`"));
    }
    if plan.movements != Movements::default() {
        return Err(Diagnostic::error(
            "a film that is moved or bent can't be used with `--solids`",
        )
        .with_help("leave out `--tilt`, `--swing`, `--rise`, `--shift` and `--film-radius`"));
    }
    if plan.metering.is_some() {
        let error = "a lens that is part of the scene has no f-number to expose a film by";
        return Err(
            Diagnostic::error(error).with_help("leave out `--shutter` and `--iso`, or `--solids`")
        );
    }
    let distance = plan.focus.unwrap_or_else(|| own_focus(pose));
    let (lens, focus) = choice.open_focused(distance, sink)?;
    let text = lens_in_scene(&lens, &film_plane(&lens, focus.film_z), Some(pose))?;
    let roots = document.read_more("the lens", text.into_bytes())?;
    // In front of the scene, so that its film is the first camera.
    document.roots.splice(..0, roots);
    Ok(())
}
