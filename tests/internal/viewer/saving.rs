//! Saved pictures and command lines against batch runs, and what is replaced.

use std::path::{Path, PathBuf};

use egui::{Key, Modifiers, PointerButton};
use egui_kittest::kittest::Queryable;
use glam::DVec3;
use image::imageops::FilterType;
use ivcam_base::diag::Diagnostic;
use ivcam_optics::film::{Resolution, Response};
use ivcam_optics::lens::{FocusMethod, Iris};
use ivcam_optics::sampling::SamplerKind;

use super::bench::{Bench, SCENE, Scratch, batch, check_words, exposed, lens_of, window_model};
use crate::photo::{Era, Headlight, LensChoice, Optics, Plan};
use crate::viewer::model::{Closing, OutputFile, WindowModel};
use crate::viewer::setup::Setup;

/// Returns the picture in the window, at the size of the saved one.
fn seen(bench: &Bench) -> image::RgbImage {
    let plan = &bench.setup().plan;
    let frame = bench.model().frame.as_ref().unwrap();
    let levels = crate::viewer::develop::levels(frame, plan.exposure, &plan.response);
    let size = frame.resolution;
    let picture = image::RgbImage::from_raw(size.width, size.height, levels).unwrap();
    let Resolution { width, height } = plan.resolution;
    image::imageops::resize(&picture, width, height, FilterType::Triangle)
}

/// Returns the root mean square difference of two pictures, in levels of 255.
fn difference(a: &image::RgbImage, b: &image::RgbImage) -> f64 {
    assert_eq!(a.dimensions(), b.dimensions());
    let square = |(a, b): (&u8, &u8)| (f64::from(*a) - f64::from(*b)).powi(2);
    (a.iter().zip(b.iter()).map(square).sum::<f64>() / a.len() as f64).sqrt()
}

/// Composes a picture in the window, saves it, and compares it with the picture on the screen and
/// with that of the batch command.
fn save_what_is_seen(era: Era) {
    let scratch = Scratch::new(&format!("save-{era:?}"));
    let scene = scratch.path("scene.iv").display().to_string();
    let words = format!("--lens double-gauss --focus 3 --size 96x64 {scene}");
    // The window is small, so that its picture has few pixels.
    let mut bench = Bench::sized(scratch, window_model(&words, era), [200.0, 300.0]);
    assert_eq!(bench.setup().plan.era, era);
    let ready = |m: &WindowModel| m.frame.as_ref().is_some_and(|f| f.whole && f.samples >= 16);
    bench.until("a picture", ready);
    let first = seen(&bench);
    bench.drag_picture([0.5, 0.5], [0.56, 0.5], PointerButton::Secondary);
    bench.change(|m| m.edit("aperture", |s| lens_of(s).f_number = Some(4.0)));
    bench.change(|m| m.edit("exposure", |s| s.plan.exposure = 1.5));
    bench.change(|m| m.edit("focus", |s| s.set_focus(2.345_678)));
    let focused = bench.setup().focus();
    bench.until("the picture with these settings", |m| {
        let lens = m.frame.as_ref().and_then(|f| f.view.lens_camera());
        ready(m) && lens.is_some_and(|c| (c.focus.distance / 1e3 - focused).abs() < 1e-9)
    });
    let last = seen(&bench);
    let output = bench.scratch.path("picture.png");
    bench.change(|m| m.output = output.display().to_string());
    bench.change(|m| m.save_picture());
    bench.until("the picture", |m| {
        m.saving.is_empty() && m.status.starts_with("saved")
    });
    let saved = image::open(&output).unwrap().to_rgb8();
    let (as_seen, as_before) = (difference(&saved, &last), difference(&saved, &first));
    // The rest is noise, and edges, which the window shows with more pixels.
    assert!(as_seen < 6.0 && as_before > 24.0, "{as_seen} {as_before}");
    let bytes = std::fs::read(&output).unwrap();
    std::fs::remove_file(&output).unwrap();
    batch(&bench.setup().words(&output));
    let again = std::fs::read(&output).unwrap();
    assert!(again == bytes, "{}", bench.model().command());
}

#[test]
fn the_saved_picture_is_the_one_in_the_window_and_the_batch_commands() {
    save_what_is_seen(Era::Modern);
}

/// The exposure of a studio is metered through the lens, so that both are equally bright.
#[test]
fn a_studio_is_saved_as_it_is_seen_and_undo_takes_the_scene_out_of_it() {
    let cube = "#Inventor V2.1 ascii
Material { diffuseColor .8 .3 .2 } Cube { }";
    let scratch = Scratch::with_scene("studio", cube);
    let scene = scratch.path("scene.iv").display().to_string();
    let words = format!("--lens double-gauss --size 48x32 {scene}");
    let mut bench = Bench::sized(scratch, window_model(&words, Era::Modern), [230.0, 300.0]);
    bench.until("a frame", |m| m.frame.is_some());
    let before = bench.setup().clone();
    bench.change(|m| m.set_studio(true));
    let settled = |m: &WindowModel| {
        let frame = m.frame.as_ref();
        m.shows_request() && frame.is_some_and(|f| f.whole && f.samples >= 16)
    };
    bench.until("the studio", |m| !m.opening && m.setup.pose != before.pose);
    bench.until("its picture", settled);
    assert_eq!(bench.setup().plan.response, Response::Srgb);
    check_words(bench.setup());
    let output = bench.scratch.path("studio.png");
    bench.change(|m| {
        m.output = output.display().to_string();
        m.save_picture();
    });
    bench.until("the picture", |m| m.saving.is_empty());
    let saved = image::open(&output).unwrap().to_rgb8();
    let off = difference(&saved, &seen(&bench));
    assert!(off < 8.0, "{off}");
    bench.change(|m| m.undo());
    bench.until("the scene without it", |m| {
        !m.opening && m.setup.pose == before.pose
    });
    assert_eq!(bench.setup().plan, before.plan);
}

#[test]
fn in_the_1999_form_too_the_saved_picture_is_the_one_in_the_window() {
    save_what_is_seen(Era::Vintage);
}

#[test]
fn the_samples_and_pupil_of_1999_are_shown_and_saved() {
    let plan = window_model("-j 1 --pupil rear a.iv", Era::Vintage)
        .setup
        .plan;
    let old = Plan::of_era(Era::Vintage, "a.iv");
    assert_eq!((plan.sampler, plan.aim), (old.sampler, old.aim));
    let scratch = Scratch::new("rear");
    let mut plan = scratch.plan();
    plan.aim = old.aim;
    let (live, _) = exposed(&plan, 1);
    assert_eq!(live.session().plan.aim, old.aim);
}

#[test]
fn a_picture_is_saved_at_the_size_that_is_seen_unless_one_is_stated() {
    for era in [Era::Modern, Era::Vintage] {
        let stated = window_model("--resolution 96x64 a.iv", era);
        assert!(!stated.setup.as_shown);
        let scratch = Scratch::new(&format!("seen-{era:?}"));
        let scene = scratch.path("scene.iv").display().to_string();
        let model = window_model(&format!("--samples 1 {scene}"), era);
        let mut bench = Bench::sized(scratch, model, [200.0, 300.0]);
        bench.until("a frame", |m| m.frame.is_some());
        let output = bench.scratch.path("seen.png");
        bench.change(|m| {
            m.output = output.display().to_string();
            m.save_picture();
        });
        bench.until("the picture", |m| m.saving.is_empty());
        let (width, height) = image::image_dimensions(&output).unwrap();
        let shown = bench.harness.get_by_label("Picture").rect();
        assert_eq!(width as f32, shown.width());
        assert!((height as f32 - shown.height()).abs() <= 1.0);
        let size = format!("--size {width}x{height}");
        assert!(bench.model().command().contains(&size), "{size}");
    }
}

#[test]
fn copy_command_puts_the_batch_line_on_the_clipboard() {
    let mut bench = Bench::open("copy");
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
        pose: ivcam_inventor::pose::CameraPose::view_all((DVec3::ZERO, DVec3::ONE), 1.5),
        as_shown: false,
    };
    check_words(&setup);
    for i in 1..40 {
        let t = f64::from(i);
        let mut pose = setup.pose.clone();
        pose.position = DVec3::new(t / 7.0, -t / 3.0, 1e-3 * t * t);
        pose.orientation = glam::DQuat::from_euler(glam::EulerRot::XYZ, t, t / 3.0, t / 17.0);
        setup.set_pose(&pose);
        setup.set_focus(1e-3 * libm::exp(t / 2.3));
        setup.plan.exposure = t / 7.0;
        check_words(&setup);
    }
    setup.set_focus(f64::INFINITY);
    setup.plan.headlight = Headlight::Set(false);
    setup.plan.sampler = SamplerKind::Jittered;
    setup.plan.seed = 77;
    setup.plan.response = Response::Srgb;
    let lens = lens_of(&mut setup);
    (lens.zoom, lens.f_number, lens.method) = (0.37, Some(5.6), FocusMethod::Best);
    lens.iris = Iris::Blades {
        count: 7,
        rotation: 13f64.to_radians(),
    };
    check_words(&setup);
    let mut old = Setup {
        plan: Plan::of_era(Era::Vintage, "room.iv"),
        ..setup
    };
    old.plan.stop.samples = 16;
    old.set_focus(1.2);
    check_words(&old);
    let line = old.command(Path::new("a.png"));
    assert_eq!(line, "ivcam --batch -f 1.2 -s r -j 16 -o a.png room.iv");
}

#[test]
fn a_proposed_name_is_one_that_no_file_has() {
    let name = format!("ivcam-made-up-{}", std::process::id());
    let mut model = WindowModel::new(Plan::of_era(Era::Modern, format!("rooms/{name}.iv")));
    assert_eq!(model.output, format!("{name}.png"));
    for end in [".png", "-2.png", "-3.png"] {
        model.save_picture();
        let (_, saving) = model.saves().pop().unwrap();
        assert_eq!(saving.path, PathBuf::from(format!("{name}{end}")));
    }
    // For a name that the user typed, the window asks instead.
    model.output = format!("{name}.png");
    model.save_picture();
    assert!(model.replacing.is_some() && model.saves().is_empty());
}

#[test]
fn a_file_that_is_there_is_replaced_only_after_a_question() {
    let mut bench = Bench::open("replace");
    let picture = bench.scratch.path("old.png");
    for (button, file) in [
        ("Save picture", picture),
        ("Write camera", bench.scratch.path("old.dat")),
        ("Write environment", bench.scratch.path("old.env")),
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
fn a_file_that_the_picture_is_made_of_is_not_replaced() {
    let scene = "#Inventor V2.1 ascii
Texture2 { filename \"wood.png\" } Cube { }";
    let scratch = Scratch::with_scene("inputs", scene);
    let path = |name: &str| scratch.path(name);
    image::RgbImage::new(2, 2).save(path("wood.png")).unwrap();
    std::fs::write(path("film.txt"), "white 0\nsense positive\n-2 2\n0 0.1\n").unwrap();
    std::fs::copy("lenses/normal/double-gauss.dat", path("lens.dat")).unwrap();
    std::fs::write(path("view.env"), "PerspectiveCamera { position 0 0 9 }").unwrap();
    let mut plan = scratch.plan();
    plan.environment = Some(path("view.env"));
    plan.optics = Optics::Lens(LensChoice::named(path("lens.dat").to_string_lossy()));
    let film = format!("mono,{}", path("film.txt").display());
    plan.response = Response::open(&film).unwrap();
    let mut bench = Bench::new(scratch, plan);
    bench.until("a frame", |m| m.frame.is_some());
    for name in ["scene.iv", "wood.png", "film.txt", "lens.dat", "view.env"] {
        for output in [OutputFile::Picture, OutputFile::Camera] {
            let file = bench.scratch.path(name);
            bench.change(|m| m.write(output, &file));
            let model = bench.model();
            assert!(
                model.replacing.is_none() && model.saving.is_empty(),
                "{name}"
            );
            let refused = model.status.contains("would overwrite the input");
            assert!(refused, "{name}: {}", model.status);
            bench.change(|m| m.status.clear());
        }
    }
}

/// Before the picture is made if that is known, and also when the window was to close afterwards.
#[test]
fn a_picture_that_cannot_be_written_is_reported_and_keeps_the_window_open() {
    let mut bench = Bench::open("unwritten");
    let folder = bench.scratch.path("folder");
    std::fs::create_dir(&folder).unwrap();
    bench.change(|m| {
        m.output = folder.join("a.png").display().to_string();
        m.save_picture();
        m.closing = Closing::WhenSaved;
        std::fs::remove_dir(&folder).unwrap();
    });
    bench.until("the failure", |m| m.saving.is_empty());
    assert_eq!(bench.model().closing, Closing::Not);
    bench.change(|m| m.save_picture());
    let model = bench.model();
    assert!(model.saving.is_empty(), "no work begins");
    let reported = |m: &Diagnostic| m.message.starts_with("there is no folder");
    assert_eq!(model.messages.iter().filter(|m| reported(m)).count(), 2);
}

#[test]
fn the_window_asks_before_it_closes_over_a_picture_that_is_made() {
    let mut bench = Bench::open("closing");
    let output = bench.scratch.path("closing.png");
    bench.change(|m| {
        m.output = output.display().to_string();
        m.setup.plan.stop.samples = 4096;
        m.save_picture();
    });
    assert_eq!(bench.model().saving.len(), 1);
    bench.request_close();
    assert_eq!(bench.model().closing, Closing::Asked);
    bench.click("Keep the window");
    assert_eq!(bench.model().closing, Closing::Not);
    bench.request_close();
    bench.click("Close when it is saved");
    assert!(
        bench
            .harness
            .query_by_label("then the window closes")
            .is_some()
    );
    bench.request_close();
    assert_eq!(bench.model().closing, Closing::Asked);
    bench.click("Discard it and close");
    bench.until("the end of the work", |m| m.saving.is_empty());
    assert!(!output.exists());
    let status = &bench.model().status;
    assert!(status.contains("canceled"), "{status}");
}

#[test]
fn a_key_saves_the_picture() {
    let mut bench = Bench::open("key");
    let output = bench.scratch.path("key.png");
    bench.change(|m| m.output = output.display().to_string());
    bench
        .harness
        .key_press_modifiers(Modifiers::COMMAND, Key::S);
    bench.until("the picture", |m| m.status.starts_with("saved"));
    assert!(output.exists());
}

#[test]
fn a_picture_that_is_made_shows_its_time_left_and_can_be_canceled() {
    let mut bench = Bench::open("canceling");
    let output = bench.scratch.path("canceling.png");
    bench.change(|m| {
        m.output = output.display().to_string();
        m.setup.plan.stop.samples = 4096;
        m.save_picture();
    });
    let has_time = |m: &WindowModel| m.saving[0].progress().ends_with("left");
    bench.until("the time left", has_time);
    bench.click("Cancel saving");
    bench.until("the end of the work", |m| m.saving.is_empty());
    assert!(!output.exists() && bench.model().status.contains("canceled"));
    // The next picture is not canceled.
    bench.change(|m| {
        m.setup.plan.stop.samples = 1;
        m.save_picture();
    });
    bench.until("a picture", |m| m.saving.is_empty());
    assert!(output.exists());
}
