//! Places and sizes of panels, and pictures of the window against references.

use std::path::PathBuf;
use std::time::{Duration, Instant};

use egui_kittest::kittest::Queryable;
use ivcam_base::math::Mm;

use super::bench::{Bench, SCENE, Scratch, difference_from, still};
use super::raster;
use crate::photo::{Era, LensChoice, Optics, Plan};
use crate::viewer::autofocus::Focused;
use crate::viewer::model::WindowModel;
use crate::viewer::saving::Saving;

/// The picture has one pixel for each pixel of the screen, in windows of every size.
#[test]
fn the_live_picture_has_the_resolution_of_the_view() {
    for size in [[660.0, 480.0], [800.0, 600.0], [1360.0, 860.0]] {
        let mut bench = Bench::of_size("resolution", size);
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

/// If a button moved during a click, the click would hit another.
#[test]
fn the_panel_does_not_move_while_pictures_and_focus_change() {
    let scratch = Scratch::new("still");
    let plan = scratch.plan();
    let mut bench = Bench::new(scratch, plan);
    let labels = [
        "∞",
        "Movements",
        "Blades",
        "Headlight",
        "Studio",
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
    let scene = bench.scratch.path("scene.iv");
    bench.change(|m| m.open_scene(&scene));
    bench.until("the scene again", |m| !m.opening && m.focused.is_none());
    assert_eq!(places(&mut bench), before, "another scene");
}

#[test]
fn the_chosen_lens_is_highlighted_and_scrolled_into_view() {
    for name in ["wide-angle", "double-gauss", "anamorphic"] {
        let scratch = Scratch::new("in-view");
        let mut plan = scratch.plan();
        plan.optics = Optics::Lens(LensChoice::named(name));
        let mut bench = Bench::sized(scratch, WindowModel::new(plan), [800.0, 600.0]);
        bench.show("Lenses");
        bench.harness.run_steps(20);
        let row = bench.harness.get_by_label(name).rect();
        assert!(row.top() > 60.0 && row.bottom() < 590.0, "{name}: {row:?}");
        // Right of the name there is no text: the row has another color than its neighbor.
        let canvas =
            raster::Canvas::draw(&bench.harness.ctx, bench.harness.output(), &bench.textures);
        let at = |y: f32| canvas.pixels[y as usize * canvas.width + row.right() as usize - 6];
        let other = if row.top() > 300.0 {
            -row.height()
        } else {
            row.height()
        };
        let (chosen, other) = (at(row.center().y), at(row.center().y + other));
        assert!(
            (chosen[2] - other[2]).abs() > 0.1,
            "{name}: {chosen:?} {other:?}"
        );
    }
}

/// The share of the window that its picture has.
fn share_of_picture(bench: &Bench, size: [f32; 2]) -> f32 {
    bench.harness.get_by_label("Picture").rect().area() / (size[0] * size[1])
}

#[test]
fn the_picture_has_at_least_half_of_a_small_window() {
    for size in [[480.0, 360.0], [800.0, 600.0], [950.0, 630.0]] {
        let mut bench = Bench::of_size("half", size);
        bench.until("a frame", |m| m.frame.is_some());
        let share = share_of_picture(&bench, size);
        assert!(share >= 0.5, "{size:?}: {share}");
    }
    // Where every panel is beside it, it has a third.
    let size = [1360.0, 860.0];
    let share = share_of_picture(&Bench::of_size("third", size), size);
    assert!((1.0 / 3.0..0.5).contains(&share), "{share}");
}

#[test]
fn panels_fold_away_in_a_small_window_and_buttons_show_them() {
    let mut bench = Bench::of_size("fold", [420.0, 320.0]);
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

/// Returns what the last frame asks of the desktop.
fn asked(bench: &Bench) -> Vec<egui::ViewportCommand> {
    let viewports = &bench.harness.output().viewport_output;
    viewports
        .values()
        .flat_map(|v| v.commands.clone())
        .collect()
}

#[test]
fn the_title_names_the_scene() {
    let mut bench = Bench::of_size("title", [800.0, 600.0]);
    assert_eq!(
        WindowModel::new(Plan::of_era(Era::Modern, "")).title(),
        "ivcam"
    );
    let title = |name: &str| egui::ViewportCommand::Title(name.into());
    bench.until("the scene", |m| m.open);
    let other = bench.scratch.path("other.iv");
    std::fs::write(&other, SCENE).unwrap();
    bench.change(|m| m.open_scene(&other));
    bench.until("the other scene", |m| m.setup.plan.scene == other);
    assert!(asked(&bench).contains(&title("other.iv - ivcam")));
    bench.harness.step();
    assert_eq!(asked(&bench), [], "it is set once");
}

#[test]
fn the_window_is_reduced_to_the_screen_on_which_it_opens() {
    for (screen, expected) in [
        ([1360.0, 860.0], Some([1360.0, 788.0])),
        ([1024.0, 768.0], Some([1024.0, 696.0])),
        ([2560.0, 1440.0], None),
    ] {
        let size = [1360.0, 860.0];
        let mut bench = Bench::of_size("screen", size);
        let input = bench.harness.input_mut();
        let viewport = input.viewports.entry(input.viewport_id).or_default();
        viewport.monitor_size = Some(screen.into());
        viewport.inner_rect = Some(egui::Rect::from_min_size(egui::Pos2::ZERO, size.into()));
        let sizes = |bench: &Bench| -> Vec<egui::Vec2> {
            let asked = asked(bench).into_iter();
            asked
                .filter_map(|command| match command {
                    egui::ViewportCommand::InnerSize(size) => Some(size),
                    _ => None,
                })
                .collect()
        };
        bench.harness.step();
        let wanted: Vec<egui::Vec2> = expected.into_iter().map(Into::into).collect();
        assert_eq!(sizes(&bench), wanted, "{screen:?}");
        bench.harness.step();
        assert_eq!(sizes(&bench), [], "once, so that it can be made larger");
    }
}

#[test]
fn the_window_looks_as_it_did() {
    let mut bench = still(Scratch::new("look"));
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

/// Writes pictures of the window at several sizes to the folder that `SHOTS` names, to look at:
/// `SHOTS=folder cargo test --features viewer-tests shots -- --ignored`. `SHOTS_SCENE` names a
/// scene, `SHOTS_SIZES` other sizes, `SHOTS_THEME=light` the other colors, and `SHOTS_CLICK` what is
/// clicked first.
#[test]
#[ignore = "pictures to look at"]
fn shots() {
    let text = |name: &str| std::env::var(name).ok();
    let folder = PathBuf::from(text("SHOTS").expect("a folder"));
    let sizes = text("SHOTS_SIZES");
    let sizes = sizes
        .as_deref()
        .unwrap_or("420x320 800x600 1360x860 2560x1440");
    for size in sizes.split_whitespace() {
        let (width, height) = size.split_once('x').unwrap();
        let size = [width, height].map(|n| n.parse::<f32>().unwrap());
        let scratch = Scratch::new("shots");
        let mut plan = scratch.plan();
        if let Some(scene) = text("SHOTS_SCENE") {
            plan = Plan::of_era(Era::Modern, scene);
        }
        let mut lens = LensChoice::named("wide-angle");
        lens.efl = Some(Mm(20.0));
        plan.optics = Optics::Lens(lens);
        let mut model = WindowModel::new(plan);
        model.setup.as_shown = true;
        let mut bench = Bench::sized(scratch, model, size);
        if text("SHOTS_THEME").as_deref() == Some("light") {
            bench.harness.ctx.set_theme(egui::Theme::Light);
        }
        bench.until("a frame", |m| m.frame.is_some());
        for label in text("SHOTS_CLICK")
            .unwrap_or_default()
            .split_terminator(',')
        {
            bench.click(label);
        }
        let start = Instant::now();
        let ready = |m: &WindowModel| m.frame.as_ref().is_some_and(|f| f.whole && f.samples >= 16);
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

/// Returns the texts that do not fit: shortened by an ellipsis, or wider than their panel.
fn cut_labels(bench: &Bench) -> Vec<String> {
    let mut cut = Vec::new();
    let mut shapes: Vec<(egui::Rect, &egui::Shape)> = Vec::new();
    let output = bench.harness.output();
    shapes.extend(output.shapes.iter().map(|s| (s.clip_rect, &s.shape)));
    while let Some((clip, shape)) = shapes.pop() {
        match shape {
            egui::Shape::Vec(inner) => shapes.extend(inner.iter().map(|s| (clip, s))),
            egui::Shape::Text(text) => {
                let place = text.visual_bounding_rect();
                // Rows of the lists may be scrolled out of view.
                let scrolled = place.bottom() < clip.top() || place.top() > clip.bottom();
                let inside = clip.x_range().expand(0.5).contains(place.left())
                    && clip.x_range().expand(0.5).contains(place.right());
                let empty = text.galley.text().trim().is_empty();
                if !(scrolled || empty) && (text.galley.elided || !inside) {
                    cut.push(text.galley.text().to_owned());
                }
            }
            _ => {}
        }
    }
    cut
}

#[test]
fn no_label_is_cut_at_any_size_of_the_window() {
    for size in [
        [600.0, 440.0],
        [800.0, 600.0],
        [1360.0, 860.0],
        [2560.0, 1440.0],
    ] {
        let mut bench = Bench::of_size("labels", size);
        bench.until("a frame", |m| m.frame.is_some());
        // Where there is no room for both, one panel hides the other.
        for panel in ["Lenses", "Settings"] {
            bench.show(panel);
            assert_eq!(cut_labels(&bench), Vec::<String>::new(), "{size:?} {panel}");
        }
        // The longest result of autofocus.
        bench.change(|m| {
            m.focused = Some(Focused {
                distance: 23.45,
                plain: 20.25,
                gain: Some(12.5),
            });
            m.focused_at = m.setup.focus();
        });
        bench.harness.run_steps(3);
        assert_eq!(cut_labels(&bench), Vec::<String>::new(), "{size:?}");
    }
}

#[test]
fn files_with_long_names_move_nothing() {
    let mut bench = Bench::of_size("long", [1360.0, 860.0]);
    bench.until("a frame", |m| m.frame.is_some());
    let labels = ["Picture", "Refine", "Focus wheel", "WB", "Save picture"];
    let places = |bench: &mut Bench| {
        bench.harness.run_steps(5);
        labels.map(|label| bench.harness.get_by_label(label).rect())
    };
    let before = places(&mut bench);
    let long = bench.scratch.path(&"long-".repeat(40));
    let film = long.with_extension("txt");
    std::fs::write(&film, "white 0\nsense positive\n-2 2\n0 0.1\n").unwrap();
    bench.change(|m| m.take_file(&film));
    assert_eq!(places(&mut bench), before, "a film");
    let lens = long.with_extension("dat");
    std::fs::copy("lenses/normal/double-gauss.dat", &lens).unwrap();
    bench.change(|m| m.take_file(&lens));
    assert_eq!(places(&mut bench), before, "a lens");
    let scene = long.with_extension("iv");
    std::fs::write(&scene, SCENE).unwrap();
    bench.change(|m| m.take_file(&scene));
    bench.until("the scene", |m| m.setup.plan.scene == scene && !m.opening);
    assert_eq!(places(&mut bench), before, "a scene");
    let picture = long.with_extension("png");
    let saving = std::sync::Arc::new(Saving::new(picture.clone()));
    bench.change(|m| m.saving.push(saving));
    assert_eq!(places(&mut bench), before, "a picture that is saved");
    image::RgbImage::new(12, 8).save(&picture).unwrap();
    bench.change(|m| m.take_file(&picture));
    assert_eq!(places(&mut bench), before, "a picture to compare with");
    let (x, right) = (
        |label| bench.harness.get_by_label(label).rect().x_range(),
        1360.0,
    );
    assert!(x("Cancel saving").max < right, "{:?}", x("Cancel saving"));
}

/// The last section of the panel is visible without scrolling in the window's own size.
#[test]
fn all_sections_are_visible_in_a_window_of_the_first_size() {
    let mut bench = Bench::of_size("sections", [1360.0, 860.0]);
    bench.until("a frame", |m| m.frame.is_some());
    let old = bench.scratch.path("old.png");
    let picture = image::RgbImage::from_pixel(12, 8, image::Rgb([250, 10, 10]));
    picture.save(&old).unwrap();
    bench.change(|m| m.take_file(&old));
    bench.harness.run_steps(3);
    let status = bench.harness.get_by_label("Refine").rect();
    for label in ["Comparison", "Onion skin", "Align"] {
        let place = bench.harness.get_by_label(label).rect();
        assert!(place.bottom() < status.top(), "{label}: {place:?}");
    }
}

/// The places that `tests/window/drive.sh` clicks on, in a window of the first size.
#[test]
fn the_places_of_the_driving_script_are_those_of_the_window() {
    let scratch = Scratch::new("places");
    let mut plan = scratch.plan();
    plan.optics = Optics::Lens(LensChoice::named("wide-angle"));
    let mut bench = Bench::sized(scratch, WindowModel::new(plan), [1360.0, 860.0]);
    bench.until("a frame", |m| m.frame.is_some());
    bench.harness.run_steps(20);
    let labels = [
        "angenieux-28",
        "Picture",
        "Focus wheel",
        "f/4",
        "Save picture",
    ];
    let mut text = String::new();
    for label in labels {
        let place = bench.harness.get_by_label(label).rect();
        let [x, y] = [place.left(), place.top()].map(f32::round);
        let [width, height] = [place.width(), place.height()].map(f32::round);
        text += &format!("{label}\t{x} {y} {width} {height}\n");
    }
    let path = PathBuf::from(env!("CARGO_MANIFEST_DIR")).join("tests/window/places.txt");
    if std::env::var_os("UPDATE").is_some() {
        std::fs::write(&path, &text).unwrap();
    }
    assert_eq!(std::fs::read_to_string(&path).unwrap(), text);
}
