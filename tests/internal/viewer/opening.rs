//! Opening scenes, cameras and environments, and what happens when they are wrong.

use std::sync::atomic::Ordering;

use egui::{HoveredFile, Key, PointerButton};
use egui_kittest::kittest::Queryable;

use ivcam_base::math::Mm;
use ivcam_optics::film::Metering;
use ivcam_render::shade::Shading;

use crate::photo::{Era, Override, Plan, Session, Surroundings, WholeView};
use crate::viewer::files::{self, DroppedKind};
use crate::viewer::model::WindowModel;
use crate::viewer::recent::RecentScenes;

use super::bench::{Bench, SCENE, Scratch, check_words, lens_of};

#[test]
fn cameras_and_environments_go_to_files_and_come_back() {
    let mut bench = Bench::open("files");
    bench.drag_picture([0.5, 0.5], [0.6, 0.5], PointerButton::Secondary);
    bench.click("Headlight");
    let pose = bench.setup().pose.clone();
    let focus = bench.setup().focus();
    let camera = bench.scratch.path("mine.dat");
    let environment = bench.scratch.path("mine.env");
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
    let missing = bench.scratch.path("none.dat").display().to_string();
    bench.change(|m| m.file = missing);
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
fn opening_has_a_name_field_of_its_own() {
    let mut bench = Bench::open("own-field");
    let scene = bench.scratch.path("scene.iv").display().to_string();
    bench.change(|m| m.file = scene);
    for button in ["Write camera", "Write environment"] {
        bench.click(button);
        assert_eq!(bench.model().replacing, None);
    }
    let scene = std::fs::read_to_string(bench.scratch.path("scene.iv")).unwrap();
    assert_eq!(scene, SCENE);
}

#[test]
fn a_scene_opens_with_a_shutter_and_a_moved_camera_replaces_a_side() {
    let scratch = Scratch::new("shutter");
    let mut plan = scratch.plan();
    plan.metering = Some(Metering::new(1.0 / 60.0));
    plan.view = Some(Override::Always(WholeView::Standard));
    let mut bench = Bench::new(scratch, plan);
    assert!(bench.model().open && bench.model().messages.is_empty());
    bench.drag_picture([0.5, 0.5], [0.6, 0.5], PointerButton::Secondary);
    check_words(bench.setup());
    let saved = bench.model().to_save();
    assert!(saved.plan.camera.is_some());
    Session::open(saved.plan).expect("the command is no contradiction");
}

#[test]
fn another_scene_is_opened_without_the_environment_of_the_first() {
    let mut bench = Bench::open("without");
    let environment = bench.scratch.path("mine.env");
    bench.change(|m| m.written = environment.display().to_string());
    bench.click("Write environment");
    let text = std::fs::read_to_string(&environment).unwrap();
    std::fs::write(&environment, text + "DirectionalLight { on FALSE }\n").unwrap();
    bench.change(|m| m.read_environment(&environment));
    bench.until("the scene with it", |m| !m.opening);
    let lit = files::environment_text(bench.setup(), true).unwrap();
    assert!(!lit.contains("on FALSE"), "{lit}");
    let second = bench.scratch.path("second.iv");
    std::fs::write(&second, SCENE).unwrap();
    bench.change(|m| m.open_scene(&second));
    bench.until("the second scene", |m| {
        !m.opening && m.setup.plan.scene.ends_with("second.iv")
    });
    assert_eq!(bench.setup().plan.environment, None);
}

/// The camera of a scene without one is made up for the lens.
#[test]
fn another_lens_keeps_a_made_up_camera_in_the_window_and_in_what_is_saved() {
    let scene = "#Inventor V2.1 ascii\nSphere { radius .6 }\n";
    let mut bench = Bench::open_scene("made-up", scene);
    let before = bench.setup().pose.clone();
    assert_eq!(bench.setup().plan.camera, None);
    bench.change(|m| m.edit("lens", |s| s.choose_lens("wide-angle")));
    let saved = bench.model().to_save();
    let session = Session::open(saved.plan.clone()).unwrap();
    for pose in [&bench.setup().pose, &session.pose] {
        assert!(
            (pose.position - before.position).length() < 1e-6,
            "{pose:?}"
        );
        assert!((pose.focal_distance - before.focal_distance).abs() < 1e-6);
    }
}

#[test]
fn what_is_changed_while_a_scene_is_opened_stays() {
    let mut bench = Bench::open("meanwhile");
    let second = bench.scratch.path("second.iv");
    std::fs::write(&second, SCENE).unwrap();
    bench.change(|m| {
        m.open_scene(&second);
        m.edit("shading", |s| s.set_shading(Shading::Flat));
    });
    bench.until("the second scene", |m| {
        !m.opening && m.setup.plan.scene.ends_with("second.iv")
    });
    assert_eq!(bench.setup().plan.shading, Shading::Flat);
}

#[test]
fn the_enter_key_opens_the_file_that_is_named() {
    let mut bench = Bench::open("enter");
    std::fs::write(bench.scratch.path("second.iv"), SCENE).unwrap();
    let name = bench.scratch.path("second.iv").display().to_string();
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
    let mut bench = Bench::open("dialog");
    std::fs::write(bench.scratch.path("second.iv"), SCENE).unwrap();
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
fn a_scene_that_fails_leaves_the_old_one_with_its_messages() {
    let mut bench = Bench::open("bad");
    let bad = bench.scratch.path("bad.iv");
    std::fs::write(&bad, "solid ball\n").unwrap();
    bench.drop_file(&bad);
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
    let wrong = SCENE.replace("Sphere { radius .6 }", "Sphere { radius .6 flavour 3 }");
    let mut bench = Bench::open_scene("lines", &wrong);
    assert_eq!(bench.model().messages.len(), 1);
    let line = bench.model().messages[0].to_string();
    assert!(line.contains("scene.iv:4:"), "{line}");
    bench.click(&line);
    assert_eq!(bench.model().shown_message, Some(0));
    assert!(bench.harness.query_by_label_contains("flavour 3").is_some());
    bench.click("Clear");
    assert!(bench.model().messages.is_empty());
}

/// The double Gauss of this scene sees less than half of what its camera sees.
#[test]
fn messages_about_the_camera_are_in_the_status_line_as_long_as_they_are_true() {
    const TITLE: &str = "1 message about lens and camera";
    let mut bench = Bench::open("warned");
    assert!(bench.model().messages.is_empty());
    bench.click(TITLE);
    let seen = bench
        .harness
        .query_by_label_contains("the scene's camera sees");
    assert!(seen.is_some());
    bench.click(TITLE);
    let fitting = 24.0 / (2.0 * 0.3f64.tan());
    bench.change(|model| model.edit("lens", |s| lens_of(s).efl = Some(Mm(fitting))));
    let ended = |m: &WindowModel| m.frame.as_ref().is_some_and(|f| f.view.messages.is_empty());
    bench.until("a picture without messages", ended);
    assert!(bench.harness.query_by_label(TITLE).is_none());
}

#[test]
fn a_panic_in_the_renderer_takes_neither_window_nor_settings() {
    let mut bench = Bench::open("panic");
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
fn a_window_without_a_scene_offers_to_open_one() {
    let scratch = Scratch::new("without");
    let model = WindowModel::new(Plan::of_era(Era::Modern, ""));
    let mut bench = Bench::sized(scratch, model, [1360.0, 860.0]);
    bench.click("Open a scene …");
    assert!(bench.harness.query_by_label("Open file").is_some());
}

#[test]
fn scenes_of_earlier_runs_are_in_the_menu() {
    let mut bench = Bench::open("recent");
    let list = bench.scratch.path("state/ivcam/recent");
    let [second, gone] = ["second.iv", "gone.iv"].map(|name| bench.scratch.path(name));
    for scene in [&second, &gone] {
        std::fs::write(scene, SCENE).unwrap();
        bench.change(|m| {
            m.recent = RecentScenes::of_file(Some(list.clone()));
            m.open_scene(scene);
        });
        bench.until("the scene", |m| m.setup.plan.scene == *scene);
    }
    std::fs::remove_file(&gone).unwrap();
    let later = Scratch::new("later");
    let mut model = WindowModel::new(later.plan());
    model.recent = RecentScenes::of_file(Some(list.clone()));
    let mut later = Bench::sized(later, model, [1360.0, 860.0]);
    later.until("a frame", |m| m.frame.is_some());
    later.click("Scenes");
    assert!(later.harness.query_by_label("gone.iv").is_none());
    later.click("second.iv");
    later.until("the second scene", |m| {
        m.setup.plan.scene.ends_with("second.iv")
    });
    // The scene that was opened last is the first of the list.
    let text = std::fs::read_to_string(&list).unwrap();
    let first = text.lines().next().unwrap();
    assert!(
        first.ends_with("second.iv") && text.lines().count() == 2,
        "{text}"
    );
}

#[test]
fn a_list_of_recent_scenes_that_cannot_be_written_is_told() {
    let mut bench = Bench::open("unwritable");
    // A file stands where the folder should be.
    let list = bench.scratch.path("scene.iv").join("recent");
    let scene = bench.scratch.path("scene.iv");
    bench.change(|m| {
        m.recent = RecentScenes::of_file(Some(list));
        m.open_scene(&scene);
    });
    bench.until("the scene", |m| !m.opening);
    assert!(
        bench.model().status.contains("recent"),
        "{}",
        bench.model().status
    );
}

#[test]
fn a_file_of_each_kind_that_is_dropped_does_what_the_window_says() {
    let mut bench = Bench::open("drop");
    let glass = "NM N-TEST 2 0 1.5168 64.17 0 0\nCD 1.0396 0.006 0.2318 0.02 1.0104 103.56\n";
    let files = [
        (
            "film.txt",
            "white 0\nsense positive\n-2 2\n0 0.1\n",
            DroppedKind::Film,
        ),
        ("glass.agf", glass, DroppedKind::Glasses),
        ("scene-without-ending", SCENE, DroppedKind::Scene),
        ("wrong.xyz", "nothing that is known", DroppedKind::Scene),
    ];
    for (name, text, kind) in files {
        let path = bench.scratch.path(name);
        std::fs::write(&path, text).unwrap();
        assert_eq!(DroppedKind::of(&path), kind, "{name}");
    }
    let drop = |bench: &mut Bench, name: &str| {
        let path = bench.scratch.path(name);
        let hovered = HoveredFile {
            path: Some(path.clone()),
            ..Default::default()
        };
        bench.harness.input_mut().hovered_files.push(hovered);
        bench.harness.run_steps(2);
        let kind = DroppedKind::of(&path);
        let told = format!("{name}: {}", kind.action());
        assert!(bench.harness.query_by_label(&told).is_some(), "{told}");
        bench.harness.input_mut().hovered_files.clear();
        bench.drop_file(&path);
        bench.harness.run_steps(2);
    };
    drop(&mut bench, "film.txt");
    assert!(bench.setup().plan.response.name().ends_with("film.txt"));
    drop(&mut bench, "glass.agf");
    assert_eq!(
        bench.setup().lens().unwrap().catalogues.len(),
        1,
        "{:?}",
        bench.model().messages
    );
    drop(&mut bench, "scene-without-ending");
    bench.until("the scene", |m| {
        m.setup.plan.scene.ends_with("scene-without-ending")
    });
    std::fs::create_dir(bench.scratch.path("folder")).unwrap();
    drop(&mut bench, "folder");
    let last = bench.model().messages.last().unwrap();
    assert!(last.message.ends_with("is a folder"), "{last}");
    let light = bench.scratch.path("light.hdr");
    let white = image::Rgb32FImage::from_pixel(8, 4, image::Rgb([2.0, 2.0, 2.0]));
    white.save(&light).unwrap();
    drop(&mut bench, "light.hdr");
    bench.until("the light", |m| !m.opening && m.shows_request());
    assert_eq!(
        bench.setup().plan.light.surroundings,
        Some(Surroundings::Picture(light))
    );
    check_words(bench.setup());
    bench.change(|m| {
        m.undo();
        assert!(m.opening, "the light is taken from the scene again");
    });
    assert_eq!(bench.setup().plan.light.surroundings, None);
}
