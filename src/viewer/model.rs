//! The state of the window and its actions, without widgets.
//!
//! Panels read the model and change its [`Setup`] through [`Model::change`]. The window passes
//! orders to the [`super::engine`] and its news to [`Model::handle`]. Tests drive the model by
//! itself, and the panels with it.

use std::path::{Path, PathBuf};
use std::sync::Arc;
use std::time::Instant;

use glam::{DVec2, DVec3};
use ivcam_base::diag::{Diagnostic, Severity, Sink};
use ivcam_base::math::Meters;
use ivcam_inventor::pose::{CameraPose, Projection};
use ivcam_optics::film::Resolution;
use ivcam_render::camera::Camera;
use ivcam_render::shade::Shading;

use super::archive::{AlignmentJob, Archive};
use super::autofocus::Focused;
use super::develop;
use super::draft::{self, Preview};
use super::engine::{EngineOrder, News, Opened};
use super::files;
use super::history::History;
use super::live::{LiveFrame, Request};
use super::navigate::{self, Tool, Viewpoint};
use super::pull::FocusPull;
use super::recent::RecentScenes;
use super::saving::Saving;
use super::setup::Setup;
use super::sharpness::{DepthOfField, depth_of_field};
use super::touch::{Hovered, SensorDrag};
use super::view::{DepthMap, FocalSurface};
use crate::photo::headlight::HeadlightSources;
use crate::photo::{Optics, Plan, VisiblePoint, free_name, picture_name, view_through_lens};

/// The marks that are drawn over the picture.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub(crate) struct Marks {
    /// The focus plane of the paper: a tint behind it, and a frame whose size falls with distance.
    pub plane: bool,
    /// The traced surface of sharp focus instead of the plane.
    pub curved: bool,
    pub peaking: bool,
    pub clipping: bool,
    pub thirds: bool,
    pub grid: bool,
}

/// A movement from one pose to another in progress.
#[derive(Clone, Debug)]
pub(crate) struct Flight {
    from: CameraPose,
    to: CameraPose,
    start: f64,
}

/// Samples per pixel of the live picture with which an archival one is aligned. No search is
/// recorded: with fewer samples noise hides edges, and with more the alignment appears later.
const ALIGNED_SAMPLES: u32 = 4;

/// Seconds of a seek (Inventor's own default is 2).
const FLIGHT: f64 = 0.6;

/// The reason why a request cannot be shown, and the nearest distance that can.
#[derive(Clone, Debug)]
pub(crate) struct Refusal {
    pub why: Diagnostic,
    pub nearest: Option<f64>,
}

/// Whether the window closes while pictures are being saved.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Closing {
    /// Nobody has closed it.
    Not,
    /// The user has closed it and is asked.
    Asked,
    /// It closes when all are saved or discarded; one that cannot be saved keeps it open.
    WhenSaved,
}

/// A kind of file that the window writes.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum OutputFile {
    Picture,
    Camera,
    /// The camera with its environment, as SceneViewer saves it.
    Environment,
}

/// The state of the window.
pub(crate) struct WindowModel {
    pub setup: Setup,
    pub preview: Preview,
    pub tool: Tool,
    pub marks: Marks,
    pub refine: bool,
    pub history: History,
    /// Whether a scene is open.
    pub open: bool,
    /// Whether a scene is being opened.
    pub opening: bool,
    /// The scenes opened so far, for the menu.
    pub scenes: Vec<PathBuf>,
    /// Those opened in earlier runs too.
    pub recent: RecentScenes,
    /// The last frame of the renderer.
    pub frame: Option<LiveFrame>,
    /// The pixels of the place where the picture is shown; `None` before the first layout.
    pub view_size: Option<Resolution>,
    /// The bounding box of the scene as `viewAll` sees it, in meters.
    pub bounds: Option<(DVec3, DVec3)>,
    /// The files that the scene names, such as textures.
    scene_files: Vec<PathBuf>,
    /// Whether the pose was made up for the lens when the scene was opened.
    is_framed: bool,
    /// The plan of the setup when a scene was last ordered.
    at_order: Option<Plan>,
    /// The point in the world that an orbit turns about, while a mouse button is held.
    pivot: Option<DVec3>,
    pub depths: Option<Arc<DepthMap>>,
    pub surface: Option<FocalSurface>,
    pub messages: Vec<Diagnostic>,
    /// The index of the message whose source lines are shown.
    pub shown_message: Option<usize>,
    /// The reason why the last request cannot be shown.
    pub refusal: Option<Refusal>,
    /// The last result of autofocus.
    pub focused: Option<Focused>,
    /// The focus distance that autofocus set, in meters.
    pub focused_at: f64,
    /// The description of the last action.
    pub status: String,
    /// The position of the cursor on the picture, from 0 to 1.
    pub cursor: Option<(f64, f64)>,
    pub archive: Archive,
    /// The name typed for the picture to save.
    pub output: String,
    /// The name of the picture that the program proposed.
    made_up: String,
    /// The name typed for a file to open.
    pub file: String,
    /// The name typed for a camera or environment to write.
    pub written: String,
    /// The existing file that a write would replace, until the user answers.
    pub replacing: Option<(OutputFile, PathBuf)>,
    /// The pictures that are being saved.
    pub saving: Vec<Arc<Saving>>,
    /// Whether the window closes in spite of them.
    pub closing: Closing,
    /// The sources that determine the headlight where the plan does not.
    pub headlight: HeadlightSources,
    /// A line for the terminal about the scene that was opened.
    pub notice: Option<&'static str>,
    /// The present time in seconds.
    pub now: f64,
    /// Whether a mouse button is held.
    pub held: bool,
    pub flight: Option<Flight>,
    pub pull: FocusPull,
    /// What was last under the cursor.
    pub hovered: Option<Hovered>,
    /// The drag of a sensor in progress.
    pub sensor_drag: Option<SensorDrag>,
    /// The time of the scene until which it plays.
    pub playing: Option<f64>,
    /// The present time at which the time of the scene was last set.
    pub clock: f64,
    orders: Vec<EngineOrder>,
    saves: Vec<(Setup, Arc<Saving>)>,
    request: Option<(Setup, Preview, Option<Resolution>)>,
    serial: u64,
}

impl WindowModel {
    /// Returns the state of a window on a plan, before its scene is opened.
    pub(crate) fn new(plan: Plan) -> Self {
        let pose = CameraPose::view_all((DVec3::splat(-1.0), DVec3::splat(1.0)), 1.5);
        let mut model = Self {
            setup: Setup {
                plan,
                pose,
                as_shown: false,
            },
            preview: Preview::Lens,
            tool: Tool::Focus,
            marks: Marks::default(),
            refine: true,
            history: History::default(),
            open: false,
            opening: false,
            scenes: Vec::new(),
            recent: RecentScenes::default(),
            frame: None,
            view_size: None,
            bounds: None,
            scene_files: Vec::new(),
            is_framed: false,
            at_order: None,
            pivot: None,
            depths: None,
            surface: None,
            messages: Vec::new(),
            shown_message: None,
            refusal: None,
            focused: None,
            focused_at: f64::NAN,
            status: String::new(),
            cursor: None,
            archive: Archive::default(),
            output: String::new(),
            made_up: String::new(),
            file: String::new(),
            written: String::new(),
            replacing: None,
            saving: Vec::new(),
            closing: Closing::Not,
            headlight: HeadlightSources::default(),
            notice: None,
            now: 0.0,
            held: false,
            flight: None,
            pull: FocusPull::default(),
            hovered: None,
            sensor_drag: None,
            playing: None,
            clock: 0.0,
            orders: Vec::new(),
            saves: Vec::new(),
            request: None,
            serial: 0,
        };
        model.propose_name();
        if !model.setup.plan.scene.as_os_str().is_empty() {
            model.reopen();
        }
        model
    }

    /// Changes the setup on behalf of a control; undo returns to the one before.
    pub(crate) fn change(&mut self, control: &'static str, mut next: Setup) {
        if next == self.setup {
            return;
        }
        if self.is_framed && !are_framed_alike(&next.plan, &self.setup.plan) {
            next.keep_pose();
        }
        self.history.keep(&self.setup, control, self.now, self.held);
        self.setup = next;
    }

    /// Changes the setup in place on behalf of a control.
    pub(crate) fn edit(&mut self, control: &'static str, edit: impl FnOnce(&mut Setup)) {
        let mut next = self.setup.clone();
        edit(&mut next);
        self.change(control, next);
    }

    /// Returns to the setup before the last change.
    pub(crate) fn undo(&mut self) {
        if let Some(setup) = self.history.undo(&self.setup) {
            self.go_to(setup);
        }
    }

    /// Repeats the change that was last undone.
    pub(crate) fn redo(&mut self) {
        if let Some(setup) = self.history.redo(&self.setup) {
            self.go_to(setup);
        }
    }

    fn go_to(&mut self, setup: Setup) {
        let reopen = is_opened_anew(&setup.plan, &self.setup.plan);
        self.setup = setup;
        self.playing = None;
        if reopen {
            self.reopen();
        }
    }

    /// Opens another scene with the same lens and options, seen from its own camera.
    pub(crate) fn open_scene(&mut self, path: &Path) {
        let mut plan = self.setup.plan.clone();
        (plan.scene, plan.camera, plan.focus) = (path.to_owned(), None, None);
        plan.environment = None; // it has a camera of the scene before
        (plan.actions, plan.time) = (Vec::new(), 0.0);
        self.order_open(plan);
    }

    /// Puts the scene into a studio, or takes it out again, as `--studio` does.
    pub(crate) fn set_studio(&mut self, on: bool) {
        self.edit("studio", |setup| {
            setup.plan.set_studio(on);
            setup.set_shading(if on {
                Shading::Path
            } else {
                Shading::Recursive
            });
        });
        self.reopen();
    }

    pub(super) fn reopen(&mut self) {
        self.order_open(self.setup.plan.clone());
    }

    pub(super) fn order_open(&mut self, plan: Plan) {
        self.opening = true;
        self.at_order = Some(self.setup.plan.clone());
        self.status = format!("opening {}", file_name(&plan.scene));
        self.orders.push(EngineOrder::Open(Box::new(plan)));
    }

    /// Saves the picture. A name that the program proposed is replaced by one that no file has.
    pub(crate) fn save_picture(&mut self) {
        if self.output == self.made_up {
            self.propose_name();
        }
        let path = PathBuf::from(self.output.trim());
        self.write(OutputFile::Picture, &path);
    }

    fn propose_name(&mut self) {
        let name = picture_name(&self.setup.plan.scene);
        let taken = |path: &Path| path.exists() || self.saving.iter().any(|s| s.path == path);
        self.made_up = free_name(&name, taken).display().to_string();
        self.output = self.made_up.clone();
    }

    /// Writes a file, after the user has agreed to replace an existing one. A file that the picture
    /// is made of is never replaced.
    pub(crate) fn write(&mut self, output: OutputFile, path: &Path) {
        let inputs = [self.setup.plan.named_files(), self.scene_files.clone()].concat();
        if let Err(error) = files::check_output(path, &inputs) {
            self.add_message(*error);
        } else if path.exists() || self.saving.iter().any(|s| s.path == path) {
            self.replacing = Some((output, path.to_owned()));
        } else {
            self.write_now(output, path);
        }
    }

    /// Handles the user's answer to [`Model::replacing`].
    pub(crate) fn answer_replacing(&mut self, replace: bool) {
        let Some((output, path)) = self.replacing.take() else {
            return;
        };
        if replace {
            self.write_now(output, &path);
        } else {
            self.status = format!("kept {}", path.display());
        }
    }

    fn write_now(&mut self, output: OutputFile, path: &Path) {
        let text = match output {
            OutputFile::Picture => {
                self.status = format!("making {}", path.display());
                let saving = Arc::new(Saving::new(path.to_owned()));
                self.saving.push(saving.clone());
                self.saves.push((self.to_save(), saving));
                return;
            }
            OutputFile::Camera => Ok(files::camera_text(&self.setup)),
            OutputFile::Environment => {
                let lit = self.headlight.resolve(self.setup.plan.headlight).on;
                files::environment_text(&self.setup, lit)
            }
        };
        match text.and_then(|text| files::write(path, &text)) {
            Ok(()) => self.status = format!("wrote {}", path.display()),
            Err(error) => self.add_message(*error),
        }
    }

    /// Returns the pictures that are to be saved.
    pub(crate) fn saves(&mut self) -> Vec<(Setup, Arc<Saving>)> {
        std::mem::take(&mut self.saves)
    }

    /// Returns the archival picture to align with the live one, once that has little noise.
    pub(crate) fn alignment_job(&mut self) -> Option<AlignmentJob> {
        let frame = self.frame.as_ref()?;
        let ready = frame.whole && frame.serial == self.serial && frame.samples >= ALIGNED_SAMPLES;
        if !ready {
            return None;
        }
        let plan = &self.setup.plan;
        let levels = || develop::levels(frame, plan.exposure, &plan.response);
        self.archive.alignment_job(frame.resolution, levels)
    }

    /// Adds a message and shows its source lines.
    pub(crate) fn add_message(&mut self, message: Diagnostic) {
        self.status = message.message.clone();
        self.messages.push(message);
        self.shown_message = Some(self.messages.len() - 1);
    }

    /// Returns the orders for the renderer.
    pub(crate) fn orders(&mut self) -> Vec<EngineOrder> {
        std::mem::take(&mut self.orders)
    }

    /// Returns the request to be shown, if it has changed.
    pub(crate) fn take_request(&mut self) -> Option<Request> {
        let wanted = (self.setup.clone(), self.preview, self.view_size);
        if !self.open || self.request.as_ref() == Some(&wanted) {
            return None;
        }
        self.serial += 1;
        self.request = Some(wanted);
        Some(Request {
            setup: self.setup.clone(),
            preview: self.preview,
            resolution: self.view_size,
            serial: self.serial,
            at: Instant::now(),
        })
    }

    /// Returns whether the picture is that of the present setup.
    pub(crate) fn shows_request(&self) -> bool {
        let shown = self.frame.as_ref().is_some_and(|f| f.serial == self.serial);
        let asked = self
            .request
            .as_ref()
            .is_some_and(|(setup, ..)| *setup == self.setup);
        shown && asked
    }

    /// Moves the camera where the scene's own camera has moved.
    fn follow_scene(&mut self, pose: &CameraPose) {
        let setup = &mut self.setup;
        if setup.plan.camera.is_some() || setup.pose == *pose {
            return;
        }
        setup.keep_places();
        setup.pose = pose.clone();
    }

    /// Handles news of the renderer.
    pub(crate) fn handle(&mut self, news: News) {
        match news {
            News::Opened(opened) => self.opened(*opened),
            News::NotOpened(path, error) => {
                self.opening = false;
                self.status = format!("{} cannot be opened", file_name(&path));
                self.add_message(*error);
            }
            News::Frame(frame) => {
                if frame.serial == self.serial {
                    self.refusal = None;
                    self.follow_scene(&frame.view.pose);
                }
                self.frame = Some(*frame);
            }
            News::Depths(depths, surface) => {
                self.depths = Some(depths);
                self.surface = surface;
            }
            News::Refused(serial, error) => {
                if serial == self.serial {
                    let nearest = nearest_focus(&self.setup);
                    self.refusal = Some(Refusal {
                        why: *error,
                        nearest,
                    });
                }
            }
            News::Focused(found) => self.focus_found(found),
            News::Aligned(version, aligned) => self.archive.align_done(version, aligned),
            News::Saved(path, line) => {
                self.end_saving(&path);
                // The line begins with the name of the picture.
                self.status = format!("saved {line}");
            }
            News::NotSaved(path, error) => {
                let ended = self.end_saving(&path);
                if ended.is_some_and(|saving| !saving.stop().is_set()) {
                    self.closing = Closing::Not;
                }
                self.status = format!("{} was not saved", path.display());
                self.add_message(*error);
            }
            News::Panicked(words) => {
                let help = "the settings are kept; change something, or press Try again";
                self.add_message(*Diagnostic::error(words).with_help(help));
            }
        }
    }

    /// Returns whether the window may close now. If pictures are being saved, the user is asked.
    pub(crate) fn may_close(&mut self) -> bool {
        if !self.saving.is_empty() {
            self.closing = Closing::Asked;
        }
        self.saving.is_empty()
    }

    /// Removes a picture that was saved or failed to save, and returns it.
    fn end_saving(&mut self, path: &Path) -> Option<Arc<Saving>> {
        let i = self.saving.iter().position(|s| s.path == path)?;
        Some(self.saving.remove(i))
    }

    fn opened(&mut self, opened: Opened) {
        let scene = opened.setup.plan.scene.clone();
        (self.headlight, self.notice) = (opened.headlight, opened.notice);
        (self.bounds, self.pivot) = (opened.bounds, None);
        self.scene_files = opened.files;
        (self.open, self.opening) = (true, false);
        self.status = format!("opened {}", file_name(&scene));
        // What follows names options of the command line.
        if let Some(notice) = opened.notice.and_then(|notice| notice.split(';').next()) {
            self.status += &format!("; {notice}");
        }
        self.messages = opened.messages;
        self.messages.retain(|m| m.severity >= Severity::Warning);
        self.shown_message = None;
        (self.hovered, self.sensor_drag, self.playing) = (None, None, None);
        let other = opened.setup.plan.scene != self.setup.plan.scene;
        self.is_framed = opened.is_framed;
        self.setup = self.setup_of_opened(opened.setup);
        // The pose of a frame that was asked for before is no longer that of the scene's camera.
        self.serial += 1;
        if other && self.output == self.made_up {
            self.propose_name();
        }
        (self.request, self.depths, self.refusal, self.focused) = (None, None, None, None);
        if let Err(error) = self.recent.add(&scene) {
            self.status = error.message.clone();
        }
        if !self.scenes.contains(&scene) {
            self.scenes.push(scene);
            self.history.forget();
        }
    }

    /// Returns the setup of a scene that was opened, with what was changed since it was ordered.
    fn setup_of_opened(&self, opened: Setup) -> Setup {
        let (ordered, now) = (opened.plan, self.setup.plan.clone());
        let before = self.at_order.as_ref().unwrap_or(&now);
        let is_same = ordered.scene == before.scene;
        let moved = is_same && now.camera != before.camera;
        let focused = is_same && now.focus != before.focus;
        let played = is_same && (now.time, &now.actions) != (before.time, &before.actions);
        let mut setup = Setup {
            pose: if moved {
                self.setup.pose.clone()
            } else {
                opened.pose
            },
            as_shown: self.setup.as_shown,
            plan: Plan {
                scene: ordered.scene.clone(),
                environment: ordered.environment.clone(),
                camera: if moved {
                    now.camera.clone()
                } else {
                    ordered.camera.clone()
                },
                focus: if focused { now.focus } else { ordered.focus },
                time: if played { now.time } else { ordered.time },
                actions: if played {
                    now.actions.clone()
                } else {
                    ordered.actions.clone()
                },
                ..now
            },
        };
        if self.is_framed && !are_framed_alike(&setup.plan, &ordered) {
            setup.keep_pose();
        }
        setup
    }

    /// Repeats the last request, as after a panic.
    pub(crate) fn try_again(&mut self) {
        self.request = None;
    }

    /// Focuses on a place of the picture, from 0 to 1, as soon as the renderer can.
    pub(crate) fn focus_at(&mut self, x: f64, y: f64) {
        self.orders.push(EngineOrder::FocusAt(x, y));
    }

    fn focus_found(&mut self, found: Option<Focused>) {
        self.focused = found;
        match found {
            Some(found) => {
                self.edit("focus", |s| s.set_focus(found.distance));
                self.focused_at = self.setup.focus();
            }
            None => self.status = "no surface to focus on at this place".into(),
        }
    }

    /// Returns the visible point at a place of the picture.
    pub(crate) fn look(&self, x: f64, y: f64) -> Option<VisiblePoint> {
        self.frame.as_ref()?.view.look(x, y)
    }

    /// Returns the height angle of the view, in radians.
    pub(crate) fn height_angle(&self) -> f64 {
        let view = self.frame.as_ref().map(|f| &f.view.camera);
        match (view, self.setup.pose.projection) {
            (Some(Camera::Lens(camera)), _) => draft::height_angle(camera),
            (_, Projection::Perspective { height_angle }) => height_angle,
            _ => std::f64::consts::FRAC_PI_4,
        }
    }

    /// Returns the depth of field of the lens, if the picture has one.
    pub(crate) fn depth_of_field(&self) -> Option<DepthOfField> {
        depth_of_field(self.frame.as_ref()?.view.lens_camera()?)
    }

    /// Returns the camera's pose with its pivot: the visible point in the middle of the picture, or
    /// the focus.
    pub(crate) fn viewpoint(&self) -> Viewpoint {
        let bounds = self.frame.as_ref().and_then(|f| f.view.bounds());
        let extent = bounds.map_or(1.0, |(a, b)| (b - a).length()).max(1e-6);
        let pose = self.setup.pose.clone();
        let along = |point: DVec3| (point - pose.position).dot(pose.direction());
        let middle = || self.visible_in_the_middle().map(along);
        let distance = self.pivot.map(along).or_else(middle).filter(|d| *d > 0.0);
        let focus = self.setup.focus();
        let distance = distance.unwrap_or(if focus.is_finite() {
            focus.min(10.0 * extent)
        } else {
            extent
        });
        Viewpoint {
            pose,
            distance,
            extent,
        }
    }

    /// Returns the visible point in the middle of the picture, in the world, if there is one.
    fn visible_in_the_middle(&self) -> Option<DVec3> {
        self.look(0.5, 0.5).map(|seen| seen.point)
    }

    /// Turns the camera about what is in the middle of the picture, by radians to the right and up.
    /// The pivot is kept until the mouse button is released, and the camera stops at a surface.
    pub(crate) fn orbit(&mut self, by: DVec2) -> Option<CameraPose> {
        let from = self.viewpoint();
        let pivot = from.pose.position + from.distance * from.pose.direction();
        self.pivot = Some(pivot);
        let to = from.orbit(by);
        let view = &self.frame.as_ref()?.view;
        // The camera keeps a fiftieth of its distance from what is in its way.
        if view.blocks(from.pose.position, to.position, 0.02 * from.distance) {
            self.status = "a surface is in the way of the camera".into();
            return None;
        }
        Some(to)
    }

    /// Forgets the pivot of an orbit when no mouse button is held.
    pub(crate) fn release_pivot(&mut self) {
        if !self.held {
            self.pivot = None;
        }
    }

    /// Moves the camera.
    pub(crate) fn go(&mut self, control: &'static str, pose: &CameraPose) {
        self.flight = None;
        self.edit(control, |s| s.set_pose(pose));
    }

    /// Moves the camera back until the scene fills the picture.
    pub(crate) fn view_all(&mut self) {
        let Some(bounds) = self.bounds else {
            return;
        };
        let through_lens = view_through_lens(bounds, &self.setup.plan);
        let distance = through_lens.map_or_else(
            || {
                let aspect = self.setup.plan.resolution.aspect();
                navigate::viewing_distance(bounds, self.height_angle(), aspect)
            },
            |pose| pose.focal_distance,
        );
        let pose = navigate::view_all(&self.setup.pose, bounds, distance);
        self.go("view all", &pose);
        self.edit("view all", |s| s.set_focus(pose.focal_distance));
    }

    /// Starts the movement to a point, like Inventor's seek.
    pub(crate) fn seek(&mut self, x: f64, y: f64) {
        let Some(seen) = self.look(x, y) else {
            self.status = "no surface to move to at this place".into();
            return;
        };
        self.flight = Some(Flight {
            from: self.setup.pose.clone(),
            to: navigate::seek(&self.setup.pose, seen.point),
            start: self.now,
        });
    }

    /// Continues a flight, and returns whether there is one.
    pub(crate) fn continue_flight(&mut self) -> bool {
        let Some(flight) = self.flight.take() else {
            return false;
        };
        let at = (self.now - flight.start) / FLIGHT;
        let pose = navigate::between(&flight.from, &flight.to, at);
        self.edit("seek", |s| s.set_pose(&pose));
        if at < 1.0 {
            self.flight = Some(flight);
        }
        true
    }

    /// Returns whether the lens of the picture reflects light, which makes ghosts; yes as long as
    /// it is not known.
    pub(crate) fn reflects(&self) -> bool {
        let lens = self.frame.as_ref().and_then(|f| f.view.lens_camera());
        lens.is_none_or(|camera| camera.lens.reflects())
    }

    /// Returns the title of the window: the name of the scene, and of the program.
    pub(crate) fn title(&self) -> String {
        match &self.setup.plan.scene {
            scene if self.open => format!("{} - ivcam", file_name(scene)),
            _ => "ivcam".into(),
        }
    }

    /// Returns the command line that makes the picture.
    pub(crate) fn command(&self) -> String {
        self.to_save().command(Path::new(&self.output))
    }

    /// Returns the photograph to save: the present one, at the size of the window's if that is
    /// wanted.
    pub(crate) fn to_save(&self) -> Setup {
        let mut setup = self.setup.clone();
        if let (true, Some(view)) = (setup.as_shown, self.view_size) {
            setup.set_width(view.width.clamp(1, Resolution::LIMIT));
        }
        setup
    }
}

/// Returns whether a scene without a camera is seen from the same place by two plans.
fn are_framed_alike(a: &Plan, b: &Plan) -> bool {
    let framed = |plan: &Plan| (plan.optics.clone(), plan.film, plan.resolution.aspect());
    framed(a) == framed(b)
}

/// Returns whether a plan differs from another in what a scene is opened with.
fn is_opened_anew(a: &Plan, b: &Plan) -> bool {
    a.scene != b.scene
        || a.environment != b.environment
        || a.light.studio != b.light.studio
        || a.light.surroundings != b.light.surroundings
}

/// Returns the last part of a path, for the status line.
pub(super) fn file_name(path: &Path) -> String {
    path.file_name()
        .unwrap_or(path.as_os_str())
        .to_string_lossy()
        .into_owned()
}

/// Returns the nearest distance at which the lens of a setup can focus, in meters.
fn nearest_focus(setup: &Setup) -> Option<f64> {
    let Optics::Lens(choice) = &setup.plan.optics else {
        return None;
    };
    let lens = choice.open(&mut Sink::new()).ok()?;
    let fault = lens.focused(choice.method, Meters(setup.focus())).err()?;
    // The distance is slightly farther, so that rounding does not make it too near.
    fault
        .nearest()
        .map(|mm| mm / 1000.0 * 1.0005)
        .filter(|d| d.is_finite())
}
