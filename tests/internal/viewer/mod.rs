//! Tests of the window without a display: every control against the state that it changes, pictures
//! of the panels, and saved pictures against those of a batch run.
//!
//! `cargo test --features viewer-tests viewer`; `UPDATE=1` rewrites the pictures.

mod raster;

use std::ffi::OsString;
use std::path::{Path, PathBuf};
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::time::{Duration, Instant};

use egui::accesskit::{Action, ActionData, ActionRequest, Role};
use egui::{Event, Key, Modifiers, PointerButton, Pos2, vec2};
use egui_kittest::Harness;
use egui_kittest::kittest::{NodeT, Queryable};
use glam::DVec3;

use crate::film::{Resolution, Response};
use crate::lens::{FocusMethod, Iris};
use crate::math::Mm;
use crate::photo::{Era, Headlight, LensChoice, Optics, Plan};
use crate::sampling::SamplerKind;
use crate::shade::Shading;
use crate::viewer::archive::ArchiveMode;
use crate::viewer::draft::Preview;
use crate::viewer::engine::Engine;
use crate::viewer::lenses::LensMenu;
use crate::viewer::live::{Live, Request};
use crate::viewer::model::Model;
use crate::viewer::navigate::Tool;
use crate::viewer::panels::Window;
use crate::viewer::setup::Setup;

/// A striped sphere three meters away, a cube nearer to the left, and a wall behind.
const SCENE: &str = "#Inventor V2.1 ascii
PerspectiveCamera { position 0 0 3 focalDistance 3 heightAngle .6 farDistance 20 }
PointLight { location 2 3 4 }
Separator { Material { diffuseColor .9 .8 .2 } Sphere { radius .6 } }
Separator { Translation { translation -.8 .2 1 } Material { diffuseColor .2 .4 .9 } Cube { width .3 height .3 depth .3 } }
Separator { Translation { translation 0 0 -4 } Material { diffuseColor .6 .6 .6 } Cube { width 20 height 20 depth .1 } }
";

/// A temporary folder with a scene in it.
struct Scratch(PathBuf);

impl Scratch {
    fn new(name: &str) -> Self {
        let path = std::env::temp_dir().join(format!("ivcam-viewer-{}-{name}", std::process::id()));
        std::fs::create_dir_all(&path).unwrap();
        std::fs::write(path.join("scene.iv"), SCENE).unwrap();
        Self(path)
    }

    fn path(&self, name: &str) -> PathBuf {
        self.0.join(name)
    }

    fn plan(&self) -> Plan {
        let mut plan = Plan::of_era(Era::Modern, self.path("scene.iv"));
        plan.optics = Optics::Lens(crate::photo::LensChoice::named("double-gauss"));
        plan.resolution = Resolution {
            width: 96,
            height: 64,
        };
        plan.sampler.samples = 2;
        plan.stop.samples = 2;
        plan
    }
}

impl Drop for Scratch {
    fn drop(&mut self) {
        let _ = std::fs::remove_dir_all(&self.0);
    }
}

struct Bench {
    harness: Harness<'static, Window>,
    textures: raster::Textures,
    /// Makes the renderer panic at its next news.
    breaks: Arc<AtomicBool>,
}

fn lens_of(setup: &mut Setup) -> &mut LensChoice {
    match &mut setup.plan.optics {
        Optics::Lens(choice) => choice,
        optics => panic!("no lens: {optics:?}"),
    }
}

impl Bench {
    fn new(plan: Plan) -> Self {
        Self::with(Model::new(plan))
    }

    /// Opens a window that is tall enough for every control to be visible.
    fn with(model: Model) -> Self {
        Self::sized(model, [1360.0, 1500.0])
    }

    fn sized(model: Model, size: [f32; 2]) -> Self {
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
            .build_state(|ctx, window: &mut Window| window.show(ctx), window);
        Self {
            harness,
            textures,
            breaks,
        }
    }

    /// Opens a window on the scene and waits for its first frame.
    fn open(scratch: &Scratch) -> Self {
        let mut bench = Self::new(scratch.plan());
        bench.until("a frame", |m| m.frame.is_some());
        bench
    }

    fn model(&self) -> &Model {
        &self.harness.state().model
    }

    fn setup(&self) -> &Setup {
        &self.model().setup
    }

    fn until(&mut self, what: &str, there: impl Fn(&Model) -> bool) {
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

    fn click(&mut self, label: &str) {
        // A panel that has just appeared is laid out first.
        self.harness.run_steps(2);
        self.harness.get_by_label(label).click();
        self.harness.run_steps(3);
    }

    /// Returns the screen position of a place on the picture, from 0 to 1.
    fn at(&self, x: f32, y: f32) -> Pos2 {
        let rect = self.harness.get_by_label("Picture").rect();
        rect.min + vec2(x, y) * rect.size()
    }

    fn press(&mut self, at: Pos2, button: PointerButton, pressed: bool) {
        self.harness.event(Event::PointerMoved(at));
        self.harness.event(Event::PointerButton {
            pos: at,
            button,
            pressed,
            modifiers: Modifiers::NONE,
        });
        self.harness.step();
    }

    fn drag(&mut self, from: Pos2, to: Pos2, button: PointerButton) {
        self.press(from, button, true);
        for i in 1..=4 {
            self.harness
                .event(Event::PointerMoved(from + (to - from) * (i as f32 / 4.0)));
            self.harness.step();
        }
        self.press(to, button, false);
        self.harness.run_steps(2);
    }

    fn click_at(&mut self, at: Pos2) {
        self.press(at, PointerButton::Primary, true);
        self.press(at, PointerButton::Primary, false);
        self.harness.run_steps(2);
    }

    /// Enters a number into a field or slider, as a screen reader does.
    fn put(&mut self, role: Role, label: &str, value: f64) {
        let node = self.harness.get_by_role_and_label(role, label);
        let target = node.accesskit_node().id();
        self.harness
            .event(Event::AccessKitActionRequest(ActionRequest {
                action: Action::SetValue,
                target,
                data: Some(ActionData::NumericValue(value)),
            }));
        self.harness.run_steps(3);
    }

    fn scroll(&mut self, at: Pos2, by: f32, modifiers: Modifiers) {
        self.harness.event(Event::PointerMoved(at));
        self.harness.step();
        let delta = vec2(0.0, by);
        self.harness.event_modifiers(
            Event::MouseWheel {
                unit: egui::MouseWheelUnit::Point,
                delta,
                modifiers,
            },
            modifiers,
        );
        self.harness.run_steps(4);
    }

    fn change(&mut self, change: impl FnOnce(&mut Model)) {
        change(&mut self.harness.state_mut().model);
        self.harness.step();
    }
}

#[test]
fn every_lens_is_in_the_menu_and_a_click_selects_it() {
    let scratch = Scratch::new("lens");
    let mut bench = Bench::open(&scratch);
    bench.click("biotar");
    assert_eq!(bench.setup().lens().unwrap().name, "biotar");
    let shown = |m: &Model| {
        m.frame
            .as_ref()
            .unwrap()
            .view
            .lens_camera()
            .is_some_and(|c| c.lens.name().contains("iotar"))
    };
    bench.until("the picture through it", shown);
    bench.click("Pinhole (the scene's own camera)");
    assert_eq!(bench.setup().plan.optics, Optics::Pinhole);
    bench.click("Undo");
    assert_eq!(bench.setup().lens().unwrap().name, "biotar");
    bench.click("Undo");
    assert_eq!(bench.setup().lens().unwrap().name, "double-gauss");
    bench.click("Redo");
    assert_eq!(bench.setup().lens().unwrap().name, "biotar");
}

#[test]
fn the_wheel_turns_by_drag_scroll_and_key_and_faster_at_a_distance() {
    let scratch = Scratch::new("wheel");
    let mut bench = Bench::open(&scratch);
    let wheel = bench.harness.get_by_label("Focus wheel").rect().center();
    assert_eq!(bench.setup().focus(), 3.0);
    bench.drag(wheel, wheel + vec2(30.0, 0.0), PointerButton::Primary);
    let dragged = bench.setup().focus();
    assert!(dragged > 3.0, "{dragged}");
    bench.scroll(wheel, -200.0, Modifiers::NONE);
    let scrolled = bench.setup().focus();
    assert!(scrolled < dragged, "{scrolled}");
    let step = |bench: &mut Bench, from: f64| {
        bench.change(|m| m.edit("test", |s| s.set_focus(from)));
        bench.harness.key_press(Key::ArrowRight);
        bench.harness.run_steps(2);
        bench.setup().focus() - from
    };
    bench.click_at(wheel);
    let (near, far) = (step(&mut bench, 2.0), step(&mut bench, 20.0));
    assert!(
        near > 0.0 && (far / near - 10.0).abs() < 0.05,
        "{near} {far}"
    );
    bench.click("∞");
    assert_eq!(bench.setup().focus(), f64::INFINITY);
}

#[test]
fn a_click_focuses_on_what_is_there() {
    let scratch = Scratch::new("click");
    let mut bench = Bench::open(&scratch);
    // The sphere's nearest point is 2.4 m away and is the first visible surface there.
    bench.click_at(bench.at(0.5, 0.5));
    bench.until("the focus", |m| m.focused.is_some());
    let found = bench.model().focused.unwrap();
    assert!((found.plain - 2.4).abs() < 0.01, "{found:?}");
    assert!((bench.setup().focus() / found.distance - 1.0).abs() < 1e-4);
    assert!((bench.setup().focus() - 2.4).abs() < 0.2, "{found:?}");
}

#[test]
fn stops_and_blades_change_the_hole_and_the_depth_of_field() {
    let scratch = Scratch::new("stops");
    let mut bench = Bench::open(&scratch);
    let open = bench.model().depth_of_field().unwrap();
    bench.click("f/8");
    assert_eq!(bench.setup().lens().unwrap().f_number, Some(8.0));
    bench.until("f/8", |m| {
        m.depth_of_field()
            .is_some_and(|d| d.far - d.near > 2.0 * (open.far - open.near))
    });
    bench.change(|m| {
        m.edit("aperture", |s| {
            lens_of(s).iris = Iris::Blades {
                count: 6,
                rotation: 0.0,
            }
        })
    });
    let hexagon = |m: &Model| {
        m.frame
            .as_ref()
            .unwrap()
            .view
            .lens_camera()
            .is_some_and(|c| c.lens.prescription().iris != Iris::Round)
    };
    bench.until("blades", hexagon);
    bench.click("open");
    assert_eq!(bench.setup().lens().unwrap().f_number, None);
}

#[test]
fn the_focal_length_and_the_blades_are_those_of_the_fields() {
    let scratch = Scratch::new("fields");
    let mut bench = Bench::open(&scratch);
    bench.put(Role::Slider, "Zoom", 0.5);
    assert_eq!(bench.setup().lens().unwrap().zoom, 0.5);
    bench
        .harness
        .get_by_role_and_label(Role::CheckBox, "Focal length")
        .click();
    bench.harness.run_steps(3);
    bench.put(Role::SpinButton, "Focal length", 35.0);
    assert_eq!(bench.setup().lens().unwrap().efl, Some(Mm(35.0)));
    let shown = |m: &Model| {
        let lens = m.frame.as_ref().and_then(|f| f.view.lens_camera());
        // The value is half of 35 mm, because the zoom still scales it.
        lens.is_some_and(|c| (c.lens.first_order().efl() - 17.5).abs() < 1e-9)
    };
    bench.until("a lens of that length", shown);
    bench.put(Role::SpinButton, "Blades", 7.0);
    bench.put(Role::SpinButton, "turned", 15.0);
    let iris = bench.setup().lens().unwrap().iris.clone();
    let Iris::Blades { count, rotation } = iris else {
        panic!("{iris:?}");
    };
    assert!(count == 7 && (rotation.to_degrees() - 15.0).abs() < 1e-9);
    bench.put(Role::SpinButton, "Blades", 2.0);
    assert_eq!(bench.setup().lens().unwrap().iris, Iris::Round);
}

#[test]
fn the_focus_and_its_method_are_those_of_the_field_and_the_menu() {
    let scratch = Scratch::new("distance");
    let mut bench = Bench::open(&scratch);
    bench.put(Role::SpinButton, "Focus 3.000 m", 1.75);
    assert_eq!(bench.setup().focus(), 1.75);
    bench.click("moves to focus");
    bench.click("lens");
    assert_eq!(bench.setup().lens().unwrap().method, FocusMethod::Lens);
    let shown = |m: &Model| {
        let lens = m.frame.as_ref().and_then(|f| f.view.lens_camera());
        lens.is_some_and(|c| (c.focus.method, c.focus.distance) == (FocusMethod::Lens, 1750.0))
    };
    bench.until("a picture so focused", shown);
}

#[test]
fn the_movements_of_the_lens_are_those_of_the_sliders() {
    let scratch = Scratch::new("movements");
    let mut bench = Bench::open(&scratch);
    bench.click("Movements");
    bench.harness.run_steps(8);
    for (name, value) in [
        ("tilt", 4.0),
        ("swing", -2.5),
        ("rise", 3.0),
        ("shift", -1.5),
    ] {
        bench.put(Role::Slider, name, value);
    }
    let moved = bench.setup().plan.movements;
    let angles = [moved.tilt, moved.swing].map(|a| (a.to_degrees() * 10.0).round() / 10.0);
    assert_eq!(angles, [4.0, -2.5]);
    assert_eq!((moved.rise, moved.shift), (3.0, -1.5));
    bench.click("Undo");
    assert_eq!(bench.setup().plan.movements.shift, 0.0);
}

#[test]
fn the_picture_to_save_has_the_size_and_samples_of_its_fields() {
    let scratch = Scratch::new("size");
    let mut bench = Bench::open(&scratch);
    bench.put(Role::SpinButton, "Size", 120.0);
    let size = bench.setup().plan.resolution;
    assert_eq!((size.width, size.height), (120, 80));
    bench.put(Role::SpinButton, "samples", 9.0);
    let plan = &bench.setup().plan;
    assert_eq!((plan.sampler.samples, plan.stop.samples), (9, 9));
    bench.click("Refine");
    assert!(!bench.model().refine);
}

#[test]
fn light_and_shading_are_those_of_their_controls() {
    let scratch = Scratch::new("light");
    let mut bench = Bench::open(&scratch);
    bench.click("Headlight");
    assert_eq!(bench.setup().plan.headlight, Headlight::Set(true));
    bench.click("Headlight");
    assert_eq!(bench.setup().plan.headlight, Headlight::Set(false));
    bench.click("sRGB");
    assert_eq!(bench.setup().plan.response, Response::Srgb);
    bench.click("Shading");
    bench.click("normal");
    assert_eq!(bench.setup().plan.shading, Shading::Normal);
    let slider = bench
        .harness
        .get_by_role_and_label(Role::Slider, "Exposure")
        .rect();
    bench.click_at(slider.left_center() + vec2(0.75 * slider.width(), 0.0));
    assert!(
        bench.setup().plan.exposure > 2.0,
        "{}",
        bench.setup().plan.exposure
    );
}

#[test]
fn overlays_tools_and_previews_are_chosen_by_click_and_key() {
    let scratch = Scratch::new("marks");
    let mut bench = Bench::open(&scratch);
    for label in [
        "Focus plane",
        "curved",
        "Peaking",
        "Clipping",
        "Thirds",
        "Grid",
    ] {
        bench.click(label);
    }
    let marks = bench.model().marks;
    assert!(
        marks.plane
            && marks.curved
            && marks.peaking
            && marks.clipping
            && marks.thirds
            && marks.grid
    );
    bench.until("distances", |m| m.depths.is_some() && m.surface.is_some());
    for (tool, name, _) in Tool::ALL {
        bench.click(name);
        assert_eq!(bench.model().tool, tool);
    }
    bench.harness.key_press(Key::Num2);
    bench.harness.run_steps(2);
    assert_eq!(bench.model().tool, Tool::Orbit);
    for (preview, name, _) in Preview::ALL.into_iter().rev() {
        bench.click(name);
        assert_eq!(bench.model().preview, preview);
    }
}

#[test]
fn the_mouse_moves_the_camera_and_undo_moves_it_back() {
    let scratch = Scratch::new("go");
    let mut bench = Bench::open(&scratch);
    let home = bench.setup().pose.position;
    let (from, to) = (bench.at(0.5, 0.5), bench.at(0.6, 0.55));
    for (name, button) in [
        ("Orbit", PointerButton::Primary),
        ("Pan", PointerButton::Primary),
        ("Dolly", PointerButton::Primary),
        ("Focus", PointerButton::Middle),
        ("Focus", PointerButton::Secondary),
    ] {
        bench.click(name);
        bench.drag(from, to, button);
        let there = bench.setup().pose.position;
        assert!((there - home).length() > 0.01, "{name} {button:?}");
        bench.click("Undo");
        assert!(
            (bench.setup().pose.position - home).length() < 1e-6,
            "{name}: one gesture is one step"
        );
    }
    bench.scroll(from, 120.0, Modifiers::NONE);
    assert!(bench.setup().pose.position.z < home.z);
    bench.click("View all");
    let all = bench.setup().pose.clone();
    assert!(
        all.position.z > 20.0,
        "a wall of 20 m is in the picture: {}",
        all.position
    );
    bench.click("Undo");
    bench.click("Seek");
    bench.until("a frame", |m| m.frame.is_some());
    bench.click_at(bench.at(0.5, 0.5));
    bench.until("the end of the flight", |m| m.flight.is_none());
    assert!(bench.setup().pose.position.z < home.z - 0.5);
    bench.click("Fly");
    let before = bench.setup().pose.position;
    bench.harness.key_down(Key::D);
    bench.harness.run_steps(5);
    bench.harness.key_up(Key::D);
    bench.harness.run_steps(2);
    assert!(bench.setup().pose.position.x > before.x);
}

/// The picture has one pixel for each pixel of the screen, in windows of every size.
#[test]
fn the_live_picture_has_the_resolution_of_the_view() {
    let scratch = Scratch::new("resolution");
    for size in [[660.0, 480.0], [800.0, 600.0], [1360.0, 860.0]] {
        let mut bench = Bench::sized(Model::new(scratch.plan()), size);
        bench.until("a coarse frame", |m| m.frame.is_some());
        bench.until("the resolution of the view", |m| {
            m.frame.as_ref().is_some_and(|f| f.whole)
        });
        let frame = bench.model().frame.as_ref().unwrap();
        let shown = bench.harness.get_by_label("Picture").rect().size();
        let pixels = [frame.resolution.width, frame.resolution.height];
        assert_eq!(pixels.map(|n| n as f32), [shown.x, shown.y], "{size:?}");
        assert_eq!(bench.setup().plan.resolution.width, 96);
    }
}

/// A scene without a camera, as `ivcam render` frames it.
#[test]
fn a_scene_without_a_camera_is_framed_as_a_batch_run_frames_it() {
    let scratch = Scratch::new("framing");
    let scene = "#Inventor V2.1 ascii
Translation { translation 1 2 3 } Cube { width 3 }";
    std::fs::write(scratch.path("scene.iv"), scene).unwrap();
    let mut plan = scratch.plan();
    for name in ["double-gauss", "wide-angle", "fisheye", "telephoto"] {
        plan.optics = Optics::Lens(LensChoice::named(name));
        let batch = crate::photo::Session::open(plan.clone()).unwrap().pose;
        let mut bench = Bench::new(plan.clone());
        bench.until("the scene", |m| m.open);
        assert_eq!(bench.setup().pose, batch, "{name}");
        bench.click("View all");
        let away = (bench.setup().pose.position - batch.position).length();
        assert!(away < 1e-6 * batch.focal_distance, "{name}: {away} m");
    }
    plan.optics = Optics::Pinhole;
    let batch = crate::photo::Session::open(plan.clone()).unwrap().pose;
    let mut bench = Bench::new(plan);
    bench.until("the scene", |m| m.open);
    assert_eq!(bench.setup().pose, batch);
}

/// The focus is at 3 m, but the sphere in the middle is 2.4 m away.
#[test]
fn an_orbit_turns_about_what_is_in_the_middle_and_stops_at_a_wall() {
    let scratch = Scratch::new("orbit");
    let wall = "Translation { translation 1 0 0 } Cube { width .1 height 20 depth 20 }";
    std::fs::write(scratch.path("scene.iv"), format!("{SCENE}{wall}")).unwrap();
    let mut bench = Bench::open(&scratch);
    let pivot = DVec3::new(0.0, 0.0, 0.6);
    bench.click("Orbit");
    // To the left there is room.
    bench.drag(
        bench.at(0.5, 0.5),
        bench.at(0.6, 0.5),
        PointerButton::Primary,
    );
    let pose = bench.setup().pose.clone();
    assert!(pose.position.x < -0.3, "{}", pose.position);
    let to_pivot = pivot - pose.position;
    assert!((to_pivot.length() - 2.4).abs() < 0.01, "{to_pivot}");
    assert!(to_pivot.normalize().dot(pose.direction()) > 1.0 - 1e-4);
    bench.click("Undo");
    // To the right is a wall, whose near side is at x = 0.95.
    for _ in 0..6 {
        bench.drag(
            bench.at(0.6, 0.5),
            bench.at(0.55, 0.5),
            PointerButton::Primary,
        );
    }
    let pose = bench.setup().pose.clone();
    assert!(
        pose.position.x > 0.3 && pose.position.x < 0.95,
        "{}",
        pose.position
    );
}

#[test]
fn a_film_of_another_shape_keeps_pixels_square() {
    let scratch = Scratch::new("film");
    let mut bench = Bench::open(&scratch);
    bench.click("Film");
    bench.click("6x6  56x56");
    let plan = &bench.setup().plan;
    assert_eq!((plan.film.width, plan.film.height), (56.0, 56.0));
    assert_eq!(plan.resolution.width, plan.resolution.height);
}

/// Runs a batch command line as the program does.
fn batch(line: &[String]) {
    assert_eq!(
        crate::cli::run(line.iter().map(OsString::from)),
        0,
        "{line:?}"
    );
}

#[test]
fn the_saved_picture_is_the_batch_commands_bit_for_bit() {
    let scratch = Scratch::new("save");
    let mut bench = Bench::open(&scratch);
    bench.drag(
        bench.at(0.5, 0.5),
        bench.at(0.52, 0.5),
        PointerButton::Secondary,
    );
    bench.click("f/4");
    bench.change(|m| m.edit("focus", |s| s.set_focus(2.345_678)));
    let output = scratch.path("picture.png");
    bench.change(|m| m.output = output.display().to_string());
    bench.click("Save picture");
    bench.until("the picture", |m| {
        m.saving.is_empty() && m.status.starts_with("saved")
    });
    let saved = std::fs::read(&output).unwrap();
    std::fs::remove_file(&output).unwrap();
    batch(&bench.setup().words(&output));
    assert!(
        std::fs::read(&output).unwrap() == saved,
        "{}",
        bench.model().command()
    );
}

#[test]
fn copy_command_puts_the_batch_line_on_the_clipboard() {
    let scratch = Scratch::new("copy");
    let mut bench = Bench::open(&scratch);
    bench.harness.get_by_label("Copy command").click();
    let mut copied = None;
    for _ in 0..4 {
        bench.harness.step();
        for command in &bench.harness.output().platform_output.commands {
            if let egui::OutputCommand::CopyText(text) = command {
                copied = Some(text.clone());
            }
        }
    }
    let line = copied.expect("a text on the clipboard");
    assert_eq!(line, bench.model().command());
    assert!(
        line.starts_with("ivcam render --lens double-gauss"),
        "{line}"
    );
}

/// The arguments of a plan parse to the same plan.
#[test]
fn a_command_line_describes_its_plan_exactly() {
    let scratch = Scratch::new("words");
    let mut setup = Setup {
        plan: scratch.plan(),
        pose: crate::pose::CameraPose::view_all((DVec3::ZERO, DVec3::ONE), 1.5),
    };
    let check = |setup: &Setup| {
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
            assert_eq!(camera.pose().unwrap(), setup.pose);
        }
    };
    check(&setup);
    for i in 1..40 {
        let t = f64::from(i);
        let mut pose = setup.pose.clone();
        pose.position = DVec3::new(t / 7.0, -t / 3.0, 1e-3 * t * t);
        pose.orientation = glam::DQuat::from_euler(glam::EulerRot::XYZ, t, t / 3.0, t / 17.0);
        setup.set_pose(&pose);
        setup.set_focus(1e-3 * libm::exp(t / 2.3));
        setup.plan.exposure = t / 7.0;
        check(&setup);
    }
    setup.set_focus(f64::INFINITY);
    setup.plan.headlight = Headlight::Set(false);
    setup.plan.sampler.kind = SamplerKind::Jittered;
    setup.plan.sampler.seed = 77;
    setup.plan.response = Response::Srgb;
    let lens = lens_of(&mut setup);
    (lens.zoom, lens.f_number, lens.method) = (0.37, Some(5.6), FocusMethod::Best);
    lens.iris = Iris::Blades {
        count: 7,
        rotation: 13f64.to_radians(),
    };
    check(&setup);
    let mut old = Setup {
        plan: Plan::of_era(Era::Vintage, "room.iv"),
        ..setup
    };
    old.plan.sampler.samples = 16;
    old.plan.stop.samples = 16;
    old.set_focus(1.2);
    check(&old);
    let line = old.command(Path::new("a.png"));
    assert_eq!(line, "ivcam --batch -f 1.2 -s r -j 16 -o a.png room.iv");
}

#[test]
fn a_scene_that_fails_leaves_the_old_one_with_its_messages() {
    let scratch = Scratch::new("bad");
    let mut bench = Bench::open(&scratch);
    let bad = scratch.path("bad.iv");
    std::fs::write(&bad, "solid ball\n").unwrap();
    bench
        .harness
        .input_mut()
        .dropped_files
        .push(egui::DroppedFile {
            path: Some(bad),
            ..Default::default()
        });
    bench.until("the message", |m| !m.messages.is_empty());
    assert!(bench.model().open && bench.setup().plan.scene.ends_with("scene.iv"));
    bench.until("the window at rest", |m| !m.opening);
    bench.click("f/8");
    bench.until("the old scene again", |m| {
        m.depth_of_field().is_some() && m.refusal.is_none()
    });
}

#[test]
fn a_message_shows_its_lines_when_it_is_clicked() {
    let scratch = Scratch::new("lines");
    let wrong = SCENE.replace("Sphere { radius .6 }", "Sphere { radius .6 flavour 3 }");
    std::fs::write(scratch.path("scene.iv"), wrong).unwrap();
    let mut bench = Bench::open(&scratch);
    assert_eq!(bench.model().messages.len(), 1);
    let line = bench.model().messages[0].to_string();
    assert!(line.contains("scene.iv:4:"), "{line}");
    bench.click(&line);
    assert_eq!(bench.model().shown_message, Some(0));
    assert!(bench.harness.query_by_label_contains("flavour 3").is_some());
    bench.click("Clear");
    assert!(bench.model().messages.is_empty());
}

#[test]
fn a_lens_that_cannot_focus_there_offers_the_nearest_distance_that_it_can() {
    let scratch = Scratch::new("near");
    let mut bench = Bench::open(&scratch);
    bench.change(|m| m.edit("focus", |s| s.set_focus(0.01)));
    bench.until("the refusal", |m| m.refusal.is_some());
    let nearest = bench.model().refusal.as_ref().unwrap().nearest.unwrap();
    assert!(nearest > 0.01 && bench.model().frame.is_some());
    bench.harness.get_by_label_contains("Focus at").click();
    bench.until("the picture there", |m| m.refusal.is_none());
    assert!((bench.setup().focus() / nearest - 1.0).abs() < 1e-3);
}

#[test]
fn a_panic_in_the_renderer_takes_neither_window_nor_settings() {
    let scratch = Scratch::new("panic");
    let mut bench = Bench::open(&scratch);
    bench.click("f/4");
    bench.breaks.store(true, Ordering::Relaxed);
    bench.until("its words", |m| {
        m.messages.iter().any(|m| m.message.contains("as ordered"))
    });
    assert_eq!(bench.setup().lens().unwrap().f_number, Some(4.0));
    let serial = bench.model().frame.as_ref().unwrap().serial;
    bench.click("Try again");
    bench.until("a frame after it", |m| {
        m.frame.as_ref().is_some_and(|f| f.serial > serial)
    });
}

#[test]
fn cameras_and_environments_go_to_files_and_come_back() {
    let scratch = Scratch::new("files");
    let mut bench = Bench::open(&scratch);
    bench.drag(
        bench.at(0.5, 0.5),
        bench.at(0.6, 0.5),
        PointerButton::Secondary,
    );
    bench.click("Headlight");
    let pose = bench.setup().pose.clone();
    let focus = bench.setup().focus();
    let camera = scratch.path("mine.dat");
    let environment = scratch.path("mine.env");
    bench.change(|m| m.written = camera.display().to_string());
    bench.click("Write camera");
    bench.change(|m| m.written = environment.display().to_string());
    bench.click("Write environment");
    bench.change(|m| m.view_all());
    bench.change(|m| m.file = camera.display().to_string());
    bench.click("Open");
    assert_eq!(bench.setup().pose.position, pose.position);
    assert!((bench.setup().focus() - focus).abs() < 1e-6);
    bench.change(|m| m.file = environment.display().to_string());
    bench.click("Read environment");
    bench.until("the scene with it", |m| !m.opening);
    assert_eq!(
        bench.setup().plan.environment.as_deref(),
        Some(environment.as_path())
    );
    assert_eq!(bench.setup().pose.position, pose.position);
    bench.change(|m| m.file = scratch.path("none.dat").display().to_string());
    bench.click("Open");
    assert!(
        bench
            .model()
            .messages
            .iter()
            .any(|m| m.message.contains("none.dat"))
    );
}

#[test]
fn a_file_that_is_there_is_replaced_only_after_a_question() {
    let scratch = Scratch::new("replace");
    let mut bench = Bench::open(&scratch);
    let picture = scratch.path("old.png");
    for (button, file) in [
        ("Save picture", picture),
        ("Write camera", scratch.path("scene.iv")),
        ("Write environment", scratch.path("scene.iv")),
    ] {
        std::fs::write(&file, SCENE).unwrap();
        let name = file.display().to_string();
        bench.change(|m| (m.output, m.written) = (name.clone(), name));
        bench.click(button);
        let question = format!("Replace {}?", file.file_name().unwrap().display());
        assert!(bench.harness.query_by_label(&question).is_some());
        bench.click("Keep it");
        assert!(bench.harness.query_by_label(&question).is_none());
        assert_eq!(std::fs::read_to_string(&file).unwrap(), SCENE, "{button}");
        bench.click(button);
        bench.harness.key_press(Key::Escape);
        bench.harness.run_steps(3);
        assert_eq!(bench.model().replacing, None);
        assert_eq!(std::fs::read_to_string(&file).unwrap(), SCENE, "{button}");
        bench.click(button);
        bench.click("Replace it");
        bench.until("the new file", |m| m.saving.is_empty());
        assert_ne!(std::fs::read(&file).unwrap(), SCENE.as_bytes(), "{button}");
    }
}

#[test]
fn opening_has_a_name_field_of_its_own() {
    let scratch = Scratch::new("own-field");
    let mut bench = Bench::open(&scratch);
    bench.change(|m| m.file = scratch.path("scene.iv").display().to_string());
    for button in ["Write camera", "Write environment"] {
        bench.click(button);
        assert_eq!(bench.model().replacing, None);
    }
    let scene = std::fs::read_to_string(scratch.path("scene.iv")).unwrap();
    assert_eq!(scene, SCENE);
}

/// If a button moved during a click, the click would hit another.
#[test]
fn the_panel_does_not_move_while_pictures_and_focus_change() {
    let scratch = Scratch::new("still");
    let mut bench = Bench::new(scratch.plan());
    let labels = [
        "∞",
        "Zoom",
        "Movements",
        "Blades",
        "Headlight",
        "Peaking",
        "Save picture",
        "Open",
        "Write environment",
    ];
    let places = |bench: &mut Bench| {
        bench.harness.run_steps(3);
        labels.map(|label| {
            let mut nodes = bench.harness.query_all_by_label(label);
            nodes.next().unwrap().rect().min
        })
    };
    // The panel finds its width in two frames of the window.
    bench.harness.run_steps(2);
    assert!(bench.model().frame.is_none() || bench.model().open);
    let before = places(&mut bench);
    bench.until("a frame", |m| m.frame.is_some());
    assert_eq!(places(&mut bench), before, "a picture came");
    bench.click_at(bench.at(0.5, 0.5));
    bench.until("the focus", |m| m.focused.is_some());
    assert_eq!(places(&mut bench), before, "autofocus");
    bench.change(|m| m.open_scene(&scratch.path("scene.iv")));
    bench.until("the scene again", |m| !m.opening && m.focused.is_none());
    assert_eq!(places(&mut bench), before, "another scene");
}

#[test]
fn a_proposed_name_is_one_that_no_file_has() {
    let name = format!("ivcam-made-up-{}", std::process::id());
    let mut model = Model::new(Plan::of_era(Era::Modern, format!("rooms/{name}.iv")));
    assert_eq!(model.output, format!("{name}.png"));
    for end in [".png", "-2.png", "-3.png"] {
        model.save_picture();
        let (_, path) = model.saves().pop().unwrap();
        assert_eq!(path, PathBuf::from(format!("{name}{end}")));
    }
    // For a name that the user typed, the window asks instead.
    model.output = format!("{name}.png");
    model.save_picture();
    assert!(model.replacing.is_some() && model.saves().is_empty());
}

/// Returns the window's plan for command-line arguments.
fn window_plan(words: &str, era: Era) -> Plan {
    let matches = clap::Command::new("ivcam")
        .no_binary_name(true)
        .args(crate::cli::flags::photograph())
        .arg(clap::Arg::new("scene"))
        .try_get_matches_from(words.split_whitespace())
        .unwrap();
    crate::cli::render::window_plan(&matches, era).unwrap()
}

#[test]
fn in_the_1999_form_too_the_saved_picture_is_the_one_in_the_window() {
    let scratch = Scratch::new("old-form");
    let scene = scratch.path("scene.iv").display().to_string();
    let words = format!("--lens double-gauss --aperture f/8 --focus 3 --size 96x64 {scene}");
    // The window is small, so that its picture has few pixels.
    let mut bench = Bench::sized(
        Model::new(window_plan(&words, Era::Vintage)),
        [660.0, 900.0],
    );
    assert_eq!(bench.setup().plan.era, Era::Vintage);
    bench.until("a picture", |m| {
        m.frame.as_ref().is_some_and(|f| f.whole && f.samples >= 16)
    });
    let plan = &bench.setup().plan;
    let frame = bench.model().frame.as_ref().unwrap();
    let seen = crate::viewer::develop::levels(frame, plan.exposure, &plan.response);
    let size = frame.resolution;
    let seen = image::RgbImage::from_raw(size.width, size.height, seen).unwrap();
    let seen = image::imageops::resize(&seen, 96, 64, image::imageops::FilterType::Triangle);
    let output = scratch.path("picture.png");
    bench.change(|m| m.output = output.display().to_string());
    bench.change(|m| m.save_picture());
    bench.until("the picture", |m| m.status.starts_with("saved"));
    let saved = image::open(&output).unwrap().to_rgb8();
    let off = seen.iter().zip(saved.iter()).map(|(a, b)| {
        let off = f64::from(*a) - f64::from(*b);
        off * off
    });
    let rms = (off.sum::<f64>() / seen.len() as f64).sqrt();
    assert!(rms < 12.0, "{rms} levels");
    let bytes = std::fs::read(&output).unwrap();
    batch(&bench.setup().words(&output));
    assert!(std::fs::read(&output).unwrap() == bytes);
}

#[test]
fn the_samples_and_pupil_of_1999_are_shown_and_saved() {
    let plan = window_plan("-j 1 --pupil rear a.iv", Era::Vintage);
    let old = Plan::of_era(Era::Vintage, "a.iv");
    assert_eq!((plan.sampler, plan.aim), (old.sampler, old.aim));
    let scratch = Scratch::new("rear");
    let mut setup = Setup {
        plan: scratch.plan(),
        pose: crate::pose::CameraPose::view_all((DVec3::ZERO, DVec3::ONE), 1.5),
    };
    setup.plan.aim = old.aim;
    let mut live = Live::open(&setup.plan).unwrap();
    setup.pose = live.setup().pose.clone();
    let request = Request {
        setup,
        preview: Preview::Lens,
        resolution: None,
        serial: 1,
        at: Instant::now(),
    };
    live.show(request).unwrap();
    assert_eq!(live.session().plan.aim, old.aim);
}

#[test]
fn an_archival_picture_is_blinked_wiped_and_blended() {
    let scratch = Scratch::new("archive");
    let mut bench = Bench::open(&scratch);
    let old = scratch.path("old.png");
    image::RgbImage::from_pixel(12, 8, image::Rgb([250, 10, 10]))
        .save(&old)
        .unwrap();
    bench.change(|m| m.take_file(&old));
    assert_eq!(bench.model().archive.mode, ArchiveMode::Wipe);
    for (mode, name) in ArchiveMode::ALL {
        bench.click(name);
        assert_eq!(bench.model().archive.mode, mode);
        match mode {
            ArchiveMode::Wipe => bench.put(Role::Slider, "line", 0.25),
            ArchiveMode::Onion => bench.put(Role::Slider, "opacity", 0.75),
            ArchiveMode::Off | ArchiveMode::Blink => {}
        }
    }
    let archive = &bench.model().archive;
    assert_eq!((archive.line, archive.opacity), (0.25, 0.75));
    bench.click("Onion skin");
    // In the blend, the picture's red increases where it was dark.
    let middle = bench.at(0.1, 0.1);
    let red = |bench: &Bench| {
        let canvas =
            raster::Canvas::draw(&bench.harness.ctx, bench.harness.output(), &bench.textures);
        canvas.pixels[middle.y as usize * canvas.width + middle.x as usize]
    };
    let with = red(&bench);
    bench.click("Off");
    let without = red(&bench);
    assert!(
        with[0] > without[0] + 0.2 && with[1] < without[1] + 0.05,
        "{with:?} {without:?}"
    );
}

/// The old picture is twice as large as the live one, has a border, and is shifted in it.
#[test]
fn an_archival_picture_is_aligned_with_the_live_one() {
    let scratch = Scratch::new("align");
    let mut plan = scratch.plan();
    plan.optics = Optics::Pinhole;
    plan.resolution = Resolution {
        width: 120,
        height: 80,
    };
    let mut live = Live::open(&plan).unwrap();
    let request = Request {
        setup: live.setup().clone(),
        preview: Preview::Lens,
        resolution: None,
        serial: 1,
        at: Instant::now(),
    };
    live.show(request).unwrap();
    let mut frame = live.step(&|| true).unwrap();
    while !frame.whole || frame.samples < 8 {
        frame = live.step(&|| true).unwrap();
    }
    let levels = crate::viewer::develop::levels(&frame, 1.0, &plan.response);
    let picture = image::RgbImage::from_raw(120, 80, levels.clone()).unwrap();
    let large =
        image::imageops::resize(&picture, 240, 160, image::imageops::FilterType::CatmullRom);
    let mut old = image::RgbImage::from_pixel(300, 230, image::Rgb([128; 3]));
    image::imageops::overlay(&mut old, &large, 40, 20);
    let path = scratch.path("old.png");
    old.save(&path).unwrap();

    let mut archive = crate::viewer::archive::Archive::default();
    archive.load(&path).unwrap();
    assert_eq!(archive.aspect(), Some(300.0 / 230.0));
    let job = archive.alignment_job(frame.resolution, || levels.clone());
    let aligned = job.unwrap().run().unwrap();
    assert!(
        (aligned.alignment.scale - 0.5).abs() < 0.005,
        "{:?}",
        aligned.alignment
    );
    assert_eq!(aligned.levels.size, [120, 80]);
    let pixels = aligned
        .levels
        .rgba
        .chunks_exact(4)
        .zip(levels.chunks_exact(3));
    let (mut covered, mut difference) = (0, 0.0);
    for (old, new) in pixels.filter(|(old, _)| old[3] == 255) {
        covered += 1;
        difference += (0..3)
            .map(|c| f64::from(old[c].abs_diff(new[c])))
            .sum::<f64>()
            / 3.0;
    }
    assert!(covered > 9000, "{covered} of 9600 pixels");
    assert!(
        difference / f64::from(covered) < 2.0,
        "{difference} levels in all"
    );
    archive.align_done(archive.version, Ok(aligned));
    assert_eq!(archive.aspect(), Some(1.5));
}

#[test]
fn the_enter_key_opens_the_file_that_is_named() {
    let scratch = Scratch::new("enter");
    let mut bench = Bench::open(&scratch);
    std::fs::write(scratch.path("second.iv"), SCENE).unwrap();
    let name = scratch.path("second.iv").display().to_string();
    bench.change(|m| m.file = name);
    bench.harness.get_by_label("File to open").focus();
    bench.harness.run_steps(3);
    bench.harness.key_press(Key::Enter);
    bench.until("the second scene", |m| {
        m.setup.plan.scene.ends_with("second.iv")
    });
}

#[test]
fn the_file_dialog_opens_the_file_that_is_chosen() {
    let scratch = Scratch::new("dialog");
    std::fs::write(scratch.path("second.iv"), SCENE).unwrap();
    let mut bench = Bench::open(&scratch);
    bench.click("choose a file to open (Ctrl+O)");
    // Clicks in quick succession would be a double click.
    bench.harness.run_steps(10);
    bench.harness.get_by_label_contains("second.iv").click();
    bench.harness.run_steps(10);
    assert!(bench.setup().plan.scene.ends_with("scene.iv"));
    bench.click("Open file");
    bench.until("the second scene", |m| {
        m.setup.plan.scene.ends_with("second.iv")
    });
    assert!(bench.harness.query_by_label("Open file").is_none());
    bench.click("choose the name of the picture");
    bench.click("Cancel");
    assert!(bench.harness.query_by_label("Cancel").is_none());
}

#[test]
fn the_chosen_lens_is_scrolled_into_view() {
    let scratch = Scratch::new("in-view");
    let mut plan = scratch.plan();
    for name in ["wide-angle", "double-gauss", "anamorphic"] {
        plan.optics = Optics::Lens(LensChoice::named(name));
        let mut bench = Bench::sized(Model::new(plan.clone()), [800.0, 600.0]);
        bench.harness.run_steps(20);
        let row = bench.harness.get_by_label(name).rect();
        assert!(row.top() > 60.0 && row.bottom() < 590.0, "{name}: {row:?}");
    }
}

#[test]
fn panels_fold_away_in_a_small_window_and_buttons_show_them() {
    let scratch = Scratch::new("fold");
    let mut bench = Bench::sized(Model::new(scratch.plan()), [420.0, 320.0]);
    bench.until("a frame", |m| m.frame.is_some());
    let picture = bench.harness.get_by_label("Picture").rect();
    assert!(picture.width() > 250.0, "{picture:?}");
    assert!(bench.harness.query_by_label("Movements").is_none());
    bench.click("Settings");
    assert!(bench.harness.query_by_label("Movements").is_some());
    bench.click("Lenses");
    assert!(bench.harness.query_by_label("Movements").is_none());
    assert!(bench.harness.query_by_label("Film").is_some());
}

#[test]
fn the_result_of_autofocus_goes_when_the_focus_is_changed_otherwise() {
    let scratch = Scratch::new("stale");
    let mut bench = Bench::open(&scratch);
    bench.click_at(bench.at(0.5, 0.5));
    bench.until("the focus", |m| m.focused.is_some());
    let shown = |bench: &Bench| {
        bench
            .harness
            .query_by_label_contains("autofocus ")
            .is_some()
    };
    bench.harness.run_steps(2);
    assert!(shown(&bench));
    bench.click("Undo");
    assert!(!shown(&bench));
}

/// Opens a window whose picture is always the same: exposed to four samples by hand, without a
/// renderer.
fn still(scratch: &Scratch) -> Bench {
    let plan = scratch.plan();
    let mut live = Live::open(&plan).unwrap();
    let setup = live.setup().clone();
    let request = Request {
        setup: setup.clone(),
        preview: Preview::Lens,
        resolution: None,
        serial: 1,
        at: Instant::now(),
    };
    live.show(request).unwrap();
    let mut frame = live.step(&|| true).unwrap();
    while !frame.whole || frame.samples < 4 {
        frame = live.step(&|| true).unwrap();
    }
    frame.rate = 1e6;
    let mut model = Model::new(Plan::of_era(Era::Modern, ""));
    model.setup = setup;
    model.headlight = live.session().headlight_sources;
    model.depths = Some(Arc::new(frame.view.depths(&|| true).unwrap()));
    model.frame = Some(frame);
    model.scenes = vec![model.setup.plan.scene.clone()];
    model.open = true;
    Bench::sized(model, [1360.0, 860.0])
}

/// Returns the share of pixels that differ visibly from the reference picture of a name. Fonts and
/// lines are drawn with the standard library's arithmetic, so a pixel at an edge may be rounded up
/// or down.
fn difference_from(name: &str, bench: &Bench) -> f64 {
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

/// Writes pictures of the window at several sizes to the folder that `SHOTS` names, to look at:
/// `SHOTS=folder cargo test --features viewer-tests shots -- --ignored`. `SHOTS_SCENE` names a
/// scene, and `SHOTS_SIZES` other sizes. docs/guide/window.png is made so.
#[test]
#[ignore = "pictures to look at"]
fn shots() {
    let text = |name: &str| std::env::var(name).ok();
    let folder = PathBuf::from(text("SHOTS").expect("a folder"));
    let sizes = text("SHOTS_SIZES");
    let sizes = sizes
        .as_deref()
        .unwrap_or("420x320 800x600 1360x860 2560x1440");
    let scratch = Scratch::new("shots");
    for size in sizes.split_whitespace() {
        let (width, height) = size.split_once('x').unwrap();
        let size = [width, height].map(|n| n.parse::<f32>().unwrap());
        let mut plan = scratch.plan();
        if let Some(scene) = text("SHOTS_SCENE") {
            plan = Plan::of_era(Era::Modern, scene);
        }
        let mut lens = LensChoice::named("wide-angle");
        lens.efl = Some(Mm(20.0));
        plan.optics = Optics::Lens(lens);
        let mut bench = Bench::sized(Model::new(plan), size);
        bench.until("a frame", |m| m.frame.is_some());
        let start = Instant::now();
        let ready = |m: &Model| m.frame.as_ref().is_some_and(|f| f.whole && f.samples >= 16);
        while !ready(bench.model()) && start.elapsed() < Duration::from_secs(90) {
            bench.harness.step();
            std::thread::sleep(Duration::from_millis(50));
        }
        let canvas =
            raster::Canvas::draw(&bench.harness.ctx, bench.harness.output(), &bench.textures);
        let (width, height) = (canvas.width as u32, canvas.height as u32);
        let picture = image::RgbImage::from_raw(width, height, canvas.levels()).unwrap();
        let name = format!("{width}x{height}.png");
        picture.save(folder.join(name)).unwrap();
    }
}

#[test]
fn the_window_looks_as_it_did() {
    let scratch = Scratch::new("look");
    let mut bench = still(&scratch);
    bench.harness.run_steps(3);
    assert!(difference_from("window", &bench) < 1e-3);
    bench.change(|m| {
        m.marks.plane = true;
        m.marks.thirds = true;
        m.edit("focus", |s| s.set_focus(2.2));
    });
    bench.harness.run_steps(3);
    assert!(difference_from("focus-plane", &bench) < 1e-3);
}
