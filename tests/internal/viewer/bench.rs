//! A window without a display: a scratch folder with a scene, and a bench that clicks, drags and
//! types.

use std::ffi::OsString;
use std::path::{Path, PathBuf};
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::time::{Duration, Instant};

use egui::accesskit::{Action, ActionData, ActionRequest, Role};
use egui::{Event, Modifiers, PointerButton, Pos2, UiBuilder, vec2};
use egui_kittest::Harness;
use egui_kittest::kittest::{NodeT, Queryable};
use ivcam_base::diag::Sink;
use ivcam_optics::film::Resolution;

use super::raster;
use crate::photo::{Era, LensChoice, Optics, Plan};
use crate::viewer::draft::Preview;
use crate::viewer::engine::Engine;
use crate::viewer::lenses::LensMenu;
use crate::viewer::live::{Live, LiveFrame, Request};
use crate::viewer::model::WindowModel;
use crate::viewer::panels::Window;
use crate::viewer::setup::Setup;

/// A striped sphere three meters away, a cube nearer to the left, and a wall behind.
pub(super) const SCENE: &str = "#Inventor V2.1 ascii
PerspectiveCamera { position 0 0 3 focalDistance 3 heightAngle .6 farDistance 20 }
PointLight { location 2 3 4 }
Separator { Material { diffuseColor .9 .8 .2 } Sphere { radius .6 } }
Separator { Translation { translation -.8 .2 1 } Material { diffuseColor .2 .4 .9 } Cube { width .3 height .3 depth .3 } }
Separator { Translation { translation 0 0 -4 } Material { diffuseColor .6 .6 .6 } Cube { width 20 height 20 depth .1 } }
";

/// A temporary folder with a scene in it.
pub(super) struct Scratch(PathBuf);

impl Scratch {
    /// Makes a folder with [`SCENE`] in it.
    pub(super) fn new(name: &str) -> Self {
        Self::with_scene(name, SCENE)
    }

    /// Makes a folder with this text as `scene.iv`.
    pub(super) fn with_scene(name: &str, scene: &str) -> Self {
        let path = std::env::temp_dir().join(format!("ivcam-viewer-{}-{name}", std::process::id()));
        std::fs::create_dir_all(&path).unwrap();
        std::fs::write(path.join("scene.iv"), scene).unwrap();
        Self(path)
    }

    pub(super) fn path(&self, name: &str) -> PathBuf {
        self.0.join(name)
    }

    pub(super) fn plan(&self) -> Plan {
        let mut plan = Plan::of_era(Era::Modern, self.path("scene.iv"));
        plan.optics = Optics::Lens(crate::photo::LensChoice::named("double-gauss"));
        plan.resolution = Resolution::of(96, 64);
        plan.stop.samples = 2;
        plan
    }
}

impl Drop for Scratch {
    fn drop(&mut self) {
        let _ = std::fs::remove_dir_all(&self.0);
    }
}

/// A window without a display, with its folder.
pub(super) struct Bench {
    pub harness: Harness<'static, Window>,
    pub textures: raster::Textures,
    /// Makes the renderer panic at its next news.
    pub breaks: Arc<AtomicBool>,
    /// The folder of the scene.
    pub scratch: Scratch,
}

pub(super) fn lens_of(setup: &mut Setup) -> &mut LensChoice {
    match &mut setup.plan.optics {
        Optics::Lens(choice) => choice,
        optics => panic!("no lens: {optics:?}"),
    }
}

impl Bench {
    /// Opens a window on the scene, in a folder of its own with this name, and waits for its first
    /// frame.
    pub(super) fn open(name: &str) -> Self {
        Self::open_scene(name, SCENE)
    }

    /// Opens a window on the text of a scene and waits for its first frame.
    pub(super) fn open_scene(name: &str, scene: &str) -> Self {
        let scratch = Scratch::with_scene(name, scene);
        let plan = scratch.plan();
        let mut bench = Self::new(scratch, plan);
        bench.until("a frame", |m| m.frame.is_some());
        bench
    }

    /// Opens a window that is tall enough for every control to be visible.
    pub(super) fn new(scratch: Scratch, plan: Plan) -> Self {
        Self::sized(scratch, WindowModel::new(plan), [1360.0, 1500.0])
    }

    /// Opens a window of a size in points on the scene.
    pub(super) fn of_size(name: &str, size: [f32; 2]) -> Self {
        let scratch = Scratch::new(name);
        let model = WindowModel::new(scratch.plan());
        Self::sized(scratch, model, size)
    }

    /// Opens a window of a size in points on a model.
    pub(super) fn sized(scratch: Scratch, model: WindowModel, size: [f32; 2]) -> Self {
        let breaks = Arc::new(AtomicBool::new(false));
        let wake = breaks.clone();
        let wake = move || assert!(!wake.swap(false, Ordering::Relaxed), "as ordered");
        let engine = Engine::start(2, Arc::new(wake)).unwrap();
        let window = Window::new(model, engine, LensMenu::ready());
        let textures = raster::Textures::default();
        let harness = Harness::builder()
            .with_size(size)
            .with_step_dt(0.05)
            .renderer(textures.clone())
            .build_ui_state(whole_window, window);
        Self {
            harness,
            textures,
            breaks,
            scratch,
        }
    }

    pub(super) fn model(&self) -> &WindowModel {
        &self.harness.state().model
    }

    pub(super) fn setup(&self) -> &Setup {
        &self.model().setup
    }

    pub(super) fn until(&mut self, what: &str, there: impl Fn(&WindowModel) -> bool) {
        let start = Instant::now();
        loop {
            self.harness.step();
            if there(self.model()) {
                return;
            }
            assert!(
                start.elapsed() < Duration::from_secs(240),
                "{what} never came: {}",
                self.model().status
            );
            std::thread::sleep(Duration::from_millis(2));
        }
    }

    /// Closes the window as its frame does.
    pub(super) fn request_close(&mut self) {
        let input = self.harness.input_mut();
        let window = input.viewports.entry(input.viewport_id).or_default();
        window.events.push(egui::ViewportEvent::Close);
        self.harness.step();
        let input = self.harness.input_mut();
        input
            .viewports
            .entry(input.viewport_id)
            .or_default()
            .events
            .clear();
        self.harness.step();
    }

    /// Drops a file on the window.
    pub(super) fn drop_file(&mut self, path: &Path) {
        let dropped = Arc::new(Dropped(path.to_owned()));
        self.harness.input_mut().dropped_files.push(dropped);
        self.harness.step();
        self.harness.input_mut().dropped_files.clear();
    }

    pub(super) fn click(&mut self, label: &str) {
        // A panel that has just appeared is laid out first.
        self.harness.run_steps(2);
        self.harness.get_by_label(label).click();
        self.harness.run_steps(3);
    }

    /// Clicks on a check box, and not on the field that it is the label of.
    pub(super) fn check(&mut self, label: &str) {
        let found = self.harness.get_by_role_and_label(Role::CheckBox, label);
        found.click();
        self.harness.run_steps(3);
    }

    /// Shows the lenses or the settings, if they are folded away.
    pub(super) fn show(&mut self, panel: &str) {
        let inside = match panel {
            "Lenses" => "Film",
            _ => "Movements",
        };
        self.harness.run_steps(2);
        if self.harness.query_by_label(inside).is_none() {
            self.click(panel);
        }
    }

    /// Returns the screen position of a place on the picture, from 0 to 1.
    pub(super) fn at(&self, x: f32, y: f32) -> Pos2 {
        let rect = self.harness.get_by_label("Picture").rect();
        rect.min + vec2(x, y) * rect.size()
    }

    pub(super) fn press(&mut self, at: Pos2, button: PointerButton, pressed: bool) {
        self.harness.event(Event::PointerMoved(at));
        self.harness.event(Event::PointerButton {
            pos: at,
            button,
            pressed,
            modifiers: Modifiers::NONE,
        });
        self.harness.step();
    }

    pub(super) fn drag(&mut self, from: Pos2, to: Pos2, button: PointerButton) {
        self.press(from, button, true);
        for i in 1..=4 {
            self.harness
                .event(Event::PointerMoved(from + (to - from) * (i as f32 / 4.0)));
            self.harness.step();
        }
        self.press(to, button, false);
        self.harness.run_steps(2);
    }

    /// Drags from one place on the picture to another, each from 0 to 1.
    pub(super) fn drag_picture(&mut self, from: [f32; 2], to: [f32; 2], button: PointerButton) {
        let (from, to) = (self.at(from[0], from[1]), self.at(to[0], to[1]));
        self.drag(from, to, button);
    }

    pub(super) fn click_at(&mut self, at: Pos2) {
        self.press(at, PointerButton::Primary, true);
        self.press(at, PointerButton::Primary, false);
        self.harness.run_steps(2);
    }

    /// Enters a number into a field or slider, as a screen reader does.
    pub(super) fn put(&mut self, role: Role, label: &str, value: f64) {
        let node = self.harness.get_by_role_and_label(role, label);
        let (target_node, target_tree) = node.accesskit_node().locate();
        self.harness
            .event(Event::AccessKitActionRequest(ActionRequest {
                action: Action::SetValue,
                target_tree,
                target_node,
                data: Some(ActionData::NumericValue(value)),
            }));
        self.harness.run_steps(3);
    }

    pub(super) fn scroll(&mut self, at: Pos2, by: f32, modifiers: Modifiers) {
        self.harness.event(Event::PointerMoved(at));
        self.harness.step();
        let delta = vec2(0.0, by);
        self.harness.event_modifiers(
            Event::MouseWheel {
                unit: egui::MouseWheelUnit::Point,
                delta,
                phase: egui::TouchPhase::Move,
                source: egui::MouseWheelSource::Unknown,
                modifiers,
            },
            modifiers,
        );
        self.harness.run_steps(4);
    }

    pub(super) fn change(&mut self, change: impl FnOnce(&mut WindowModel)) {
        change(&mut self.harness.state_mut().model);
        self.harness.step();
    }
}

/// Shows the window on the whole screen, without the margin of a harness.
fn whole_window(ui: &mut egui::Ui, window: &mut Window) {
    let whole = UiBuilder::new().max_rect(ui.ctx().content_rect());
    window.show(&mut ui.new_child(whole));
}

/// A file that is dropped on the window.
#[derive(Debug)]
struct Dropped(PathBuf);

impl egui::DroppedFile for Dropped {
    fn path(&self) -> &Path {
        &self.0
    }

    fn bytes(&self) -> Result<Vec<u8>, String> {
        std::fs::read(&self.0).map_err(|e| e.to_string())
    }
}

/// Runs a batch command line as the program does.
pub(super) fn batch(line: &[String]) {
    assert_eq!(
        crate::cli::run(line.iter().map(OsString::from)),
        0,
        "{line:?}"
    );
}

/// Returns the window's state for command-line arguments.
pub(super) fn window_model(words: &str, era: Era) -> WindowModel {
    let matches = clap::Command::new("ivcam")
        .no_binary_name(true)
        .args(crate::cli::flags::photograph())
        .arg(clap::Arg::new("scene"))
        .try_get_matches_from(words.split_whitespace())
        .unwrap();
    crate::cli::view::window_model(&matches, era).unwrap()
}

/// Checks that the arguments of a photograph parse to the same plan.
pub(super) fn check_words(setup: &Setup) {
    let words = setup.words(Path::new("a.png"));
    let modern = setup.plan.era == Era::Modern;
    let rest = words.iter().skip(if modern { 2 } else { 1 });
    let matches = clap::Command::new("ivcam")
        .no_binary_name(true)
        .args(crate::cli::flags::photograph())
        .arg(clap::Arg::new("scene"))
        .try_get_matches_from(rest)
        .unwrap();
    let plan = crate::cli::render::plan(&matches, setup.plan.era).unwrap();
    assert_eq!(plan, setup.plan, "{words:?}");
    if let Some(camera) = &setup.plan.camera {
        assert_eq!(camera.pose(&mut Sink::new()).unwrap(), setup.pose);
    }
}

/// Exposes a plan's live picture, at the plan's resolution, to a number of samples.
pub(super) fn exposed(plan: &Plan, samples: u32) -> (Live, LiveFrame) {
    let mut live = Live::open(plan).unwrap();
    let request = Request {
        setup: live.setup().clone(),
        preview: Preview::Lens,
        resolution: None,
        serial: 1,
        at: Instant::now(),
    };
    live.show(request).unwrap();
    loop {
        let frame = live.step(&|| true).unwrap();
        if frame.whole && frame.samples >= samples {
            return (live, frame);
        }
    }
}

/// Opens a window whose picture is always the same: exposed to four samples by hand, without a
/// renderer.
pub(super) fn still(scratch: Scratch) -> Bench {
    let (live, mut frame) = exposed(&scratch.plan(), 4);
    let setup = live.setup().clone();
    frame.rate = 1e6;
    let mut model = WindowModel::new(Plan::of_era(Era::Modern, ""));
    model.setup = setup;
    model.headlight = live.session().headlight_sources;
    model.depths = Some(Arc::new(frame.view.depths(&|| true).unwrap()));
    model.frame = Some(frame);
    model.scenes = vec![model.setup.plan.scene.clone()];
    model.open = true;
    Bench::sized(scratch, model, [1360.0, 860.0])
}

/// Returns the share of pixels that differ visibly from the reference picture of a name. Fonts and
/// lines are drawn with the standard library's arithmetic, so a pixel at an edge may be rounded up
/// or down.
pub(super) fn difference_from(name: &str, bench: &Bench) -> f64 {
    let canvas = raster::Canvas::draw(&bench.harness.ctx, bench.harness.output(), &bench.textures);
    let path = Path::new(env!("CARGO_MANIFEST_DIR"))
        .join("tests/viewer")
        .join(format!("{name}.png"));
    let (width, height) = (canvas.width as u32, canvas.height as u32);
    let whole = image::RgbImage::from_raw(width, height, canvas.levels()).unwrap();
    // The reference picture is reduced to half of the size.
    let now = image::imageops::thumbnail(&whole, width / 2, height / 2);
    if std::env::var_os("UPDATE").is_some() {
        now.save(&path).unwrap();
    }
    let kept = image::open(&path).unwrap().to_rgb8();
    assert_eq!(kept.dimensions(), now.dimensions());
    let differ = kept
        .pixels()
        .zip(now.pixels())
        .filter(|(a, b)| a.0.iter().zip(b.0).any(|(x, y)| x.abs_diff(y) > 16));
    differ.count() as f64 / f64::from(now.width() * now.height())
}
