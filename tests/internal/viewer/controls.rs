//! Each control against the state that it changes.

use std::ffi::OsString;

use egui::accesskit::Role;
use egui::{Event, Key, Modifiers, PointerButton, vec2};
use egui_kittest::kittest::Queryable;
use ivcam_base::math::{Meters, Mm};
use ivcam_optics::film::Response;
use ivcam_optics::lens::{Coating, FocusMethod, Iris};
use ivcam_render::shade::Shading;

use super::bench::{Bench, check_words, lens_of};
use crate::cli::pull_focus::MovieFilm;
use crate::photo::{Headlight, Optics};
use crate::viewer::draft::Preview;
use crate::viewer::model::WindowModel;
use crate::viewer::navigate::Tool;

#[test]
fn every_lens_is_in_the_menu_and_a_click_selects_it() {
    let mut bench = Bench::open("lens");
    bench.click("biotar");
    assert_eq!(bench.setup().lens().unwrap().name, "biotar");
    let shown = |m: &WindowModel| {
        m.frame
            .as_ref()
            .unwrap()
            .view
            .lens_camera()
            .is_some_and(|c| c.lens.name().contains("iotar"))
    };
    bench.until("the picture through it", shown);
    bench.click("Pinhole of the scene");
    assert_eq!(bench.setup().plan.optics, Optics::Pinhole);
    bench.click("Undo");
    assert_eq!(bench.setup().lens().unwrap().name, "biotar");
    bench.click("Undo");
    assert_eq!(bench.setup().lens().unwrap().name, "double-gauss");
    bench.click("Redo");
    assert_eq!(bench.setup().lens().unwrap().name, "biotar");
}

#[test]
fn choices_beyond_the_reach_of_a_control_stay() {
    let mut bench = Bench::open("beyond");
    bench.change(|m| {
        m.edit("all", |s| {
            s.set_width(12_000);
            s.plan.exposure = 1000.0;
            s.plan.movements.rise = 40.0;
            lens_of(s).iris = Iris::Blades {
                count: 64,
                rotation: 0.0,
            };
        });
    });
    let before = bench.setup().plan.clone();
    bench.click("Movements");
    bench.harness.run_steps(10);
    assert_eq!(bench.setup().plan, before);
}

#[test]
fn a_search_leaves_the_lenses_that_have_its_words_and_enter_takes_the_first() {
    let mut bench = Bench::open("search");
    let listed = |bench: &Bench, name: &str| bench.harness.query_by_label(name).is_some();
    assert!(listed(&bench, "Wide") && listed(&bench, "Normal"), "groups");
    bench.harness.get_by_label("Search for a lens").focus();
    bench.harness.run_steps(2);
    bench.harness.event(Event::Text("nikkor wide".into()));
    bench.harness.run_steps(3);
    assert!(listed(&bench, "nikkor-28") && !listed(&bench, "nikkor-6"));
    assert!(listed(&bench, "Wide") && !listed(&bench, "Normal"));
    // A digit that is typed chooses no tool.
    bench.harness.event(Event::Text(" 28".into()));
    bench.harness.key_press(Key::Num2);
    bench.harness.run_steps(2);
    assert_eq!(bench.model().tool, Tool::Focus);
    bench.harness.key_press(Key::Enter);
    bench.harness.run_steps(3);
    assert_eq!(bench.setup().lens().unwrap().name, "nikkor-28");
}

#[test]
fn a_focal_length_that_was_chosen_is_that_of_the_next_lens_too() {
    let mut bench = Bench::open("length");
    bench.click("biotar");
    assert_eq!(bench.setup().lens().unwrap().efl, None);
    bench.change(|m| m.edit("zoom", |s| lens_of(s).efl = Some(Mm(35.0))));
    bench.click("tessar");
    assert_eq!(bench.setup().lens().unwrap().efl, Some(Mm(35.0)));
    let shown = |m: &WindowModel| {
        let lens = m.frame.as_ref().and_then(|f| f.view.lens_camera());
        lens.is_some_and(|c| {
            c.lens.name().contains("essar") && (c.lens.first_order().efl() - 35.0).abs() < 1e-9
        })
    };
    bench.until("the picture through it", shown);
}

#[test]
fn f1_shows_the_keys_and_each_key_of_a_tool_chooses_it() {
    let mut bench = Bench::open("keys");
    let shown = |bench: &Bench| bench.harness.query_by_label("Keys and mouse").is_some();
    assert!(!shown(&bench));
    for (modifiers, key) in [
        (Modifiers::NONE, Key::F1),
        (Modifiers::SHIFT, Key::Questionmark),
    ] {
        bench.harness.key_press_modifiers(modifiers, key);
        bench.harness.run_steps(3);
        assert!(shown(&bench), "{key:?}");
        assert!(bench.harness.query_by_label("saves the picture").is_some());
        bench.harness.key_press_modifiers(modifiers, key);
        bench.harness.run_steps(3);
        assert!(!shown(&bench), "{key:?}");
    }
    bench.click("?");
    assert!(shown(&bench));
    bench.harness.key_press(Key::Escape);
    bench.harness.run_steps(3);
    assert!(!shown(&bench));
    let keys = [
        Key::Num1,
        Key::Num2,
        Key::Num3,
        Key::Num4,
        Key::Num5,
        Key::Num6,
    ];
    for (key, (tool, ..)) in keys.into_iter().zip(Tool::ALL) {
        bench.harness.key_press(key);
        bench.harness.run_steps(2);
        assert_eq!(bench.model().tool, tool);
    }
}

#[test]
fn the_wheel_turns_by_drag_scroll_and_key_and_faster_at_a_distance() {
    let mut bench = Bench::open("wheel");
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
    let mut bench = Bench::open("click");
    // The sphere's nearest point is 2.4 m away and is the first visible surface there.
    bench.click_at(bench.at(0.5, 0.5));
    bench.until("the focus", |m| m.focused.is_some());
    let found = bench.model().focused.unwrap();
    assert!((found.plain - 2.4).abs() < 0.01, "{found:?}");
    assert!((bench.setup().focus() / found.distance - 1.0).abs() < 1e-4);
    assert!((bench.setup().focus() - 2.4).abs() < 0.2, "{found:?}");
}

#[test]
fn the_result_of_autofocus_goes_when_the_focus_is_changed_otherwise() {
    let mut bench = Bench::open("stale");
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

#[test]
fn stops_and_blades_change_the_hole_and_the_depth_of_field() {
    let mut bench = Bench::open("stops");
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
    let hexagon = |m: &WindowModel| {
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
    let mut bench = Bench::open("fields");
    bench.put(Role::Slider, "Zoom", 0.5);
    assert_eq!(bench.setup().lens().unwrap().zoom, 0.5);
    bench.check("Focal length");
    bench.put(Role::SpinButton, "Focal length", 35.0);
    assert_eq!(bench.setup().lens().unwrap().efl, Some(Mm(35.0)));
    let shown = |m: &WindowModel| {
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
    let mut bench = Bench::open("distance");
    bench.put(Role::SpinButton, "Focus 3.000 m", 1.75);
    assert_eq!(bench.setup().focus(), 1.75);
    bench.click("Movements");
    bench.harness.run_steps(8);
    bench.click("moves to focus");
    bench.click("lens");
    assert_eq!(bench.setup().lens().unwrap().method, FocusMethod::Lens);
    let shown = |m: &WindowModel| {
        let lens = m.frame.as_ref().and_then(|f| f.view.lens_camera());
        lens.is_some_and(|c| (c.focus.method, c.focus.distance) == (FocusMethod::Lens, 1750.0))
    };
    bench.until("a picture so focused", shown);
}

#[test]
fn the_movements_of_the_lens_are_those_of_the_sliders() {
    let mut bench = Bench::open("movements");
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
    let mut bench = Bench::open("size");
    bench.put(Role::SpinButton, "Size", 120.0);
    let size = bench.setup().plan.resolution;
    assert_eq!((size.width, size.height), (120, 80));
    bench.click("as shown");
    let (size, view) = (
        bench.model().to_save().plan.resolution,
        bench.model().view_size.unwrap(),
    );
    assert_eq!(size.width, view.width);
    assert!(size.width > 600 && size.height.abs_diff(view.height) <= 1);
    // A size that is typed is no more the one that is shown, and undo returns to it. Changes in
    // quick succession would be one step.
    bench.harness.run_steps(15);
    bench.put(Role::SpinButton, "Size", 90.0);
    let size = bench.model().to_save().plan.resolution;
    assert_eq!((size.width, size.height), (90, 60));
    bench.click("Undo");
    assert!(bench.setup().as_shown);
    bench.put(Role::SpinButton, "Samples", 9.0);
    let plan = &bench.setup().plan;
    assert_eq!(plan.stop.samples, 9);
    bench.click("Refine");
    assert!(!bench.model().refine);
}

#[test]
fn light_and_shading_are_those_of_their_controls() {
    let mut bench = Bench::open("light");
    bench.click("Headlight");
    assert_eq!(bench.setup().plan.headlight, Headlight::Set(true));
    bench.click("Headlight");
    assert_eq!(bench.setup().plan.headlight, Headlight::Set(false));
    bench.click("Response");
    bench.click("srgb");
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
fn coating_ghosts_dispersion_and_diffraction_are_those_of_their_controls() {
    let mut bench = Bench::open("glass");
    bench.click("Ghosts");
    bench.click("Diffraction");
    bench.click("Dispersion");
    let plan = &bench.setup().plan;
    assert!(plan.ghosts && plan.diffraction && !plan.dispersion);
    // A lens that reflects nothing has no ghosts, and the window says so.
    assert!(
        bench
            .harness
            .query_by_label("none: ideal coating")
            .is_some()
    );
    bench.click("Coating");
    bench.click("MgF2");
    assert_eq!(
        lens_of(&mut bench.setup().clone()).coating,
        Some(Coating::MagnesiumFluoride)
    );
    bench.until("a coated lens", WindowModel::reflects);
    bench.harness.run_steps(2);
    assert!(bench.harness.query_by_label("when saved").is_some());
    check_words(bench.setup());
    bench.click("Undo");
    assert_eq!(bench.setup().lens().unwrap().coating, None);
}

#[test]
fn shutter_iso_film_white_balance_and_lamps_are_those_of_their_controls() {
    let mut bench = Bench::open("film-controls");
    let level = |m: &WindowModel| m.frame.as_ref().unwrap().metered;
    bench.click("Shutter");
    let metering = bench.setup().plan.metering.unwrap();
    bench.until("the metered picture", |m| {
        m.shows_request() && level(m) != 1.0
    });
    // The dial has whole stops, so the picture keeps its brightness within half of one.
    let stops = libm::log2(level(bench.model())).abs();
    assert!(stops <= 0.55, "{stops} at {}", metering.dial());
    bench.click("Shutter time");
    bench.click("1/250 s");
    bench.put(Role::SpinButton, "ISO", 400.0);
    let metering = bench.setup().plan.metering.unwrap();
    assert_eq!((metering.shutter, metering.iso), (1.0 / 250.0, 400.0));
    bench.click("Response");
    bench.click("negative,paper");
    bench.check("WB");
    bench.put(Role::SpinButton, "WB", 3200.0);
    assert_eq!(bench.setup().plan.response.name(), "3200K,negative,paper");
    bench.click("Shading");
    bench.click("path");
    bench.put(Role::SpinButton, "Lamps", 4.5);
    assert_eq!(bench.setup().plan.light.light_size, Meters(0.045));
    assert_eq!(bench.setup().plan.response.name(), "3200K,negative,paper");
    check_words(bench.setup());
    bench.check("WB");
    bench.click("Shutter");
    assert_eq!(bench.setup().plan.response.name(), "negative,paper");
    assert_eq!(bench.setup().plan.metering, None);
}

#[test]
fn a_focus_pull_between_two_keys_is_played_and_its_command_makes_the_movie() {
    let mut bench = Bench::open("pull");
    bench.harness.key_press(Key::P);
    bench.harness.run_steps(2);
    assert!(!bench.model().pull.is_shown());
    for (distance, key) in [(2.0, Key::OpenBracket), (4.0, Key::CloseBracket)] {
        bench.change(|m| m.edit("test", |s| s.set_focus(distance)));
        bench.harness.key_press(key);
        bench.harness.run_steps(2);
    }
    assert!(bench.harness.query_by_label("A 2.000 m").is_some());
    bench.harness.run_steps(15);
    bench.harness.key_press(Key::P);
    let mut seen = Vec::new();
    while seen.is_empty() || bench.model().pull.is_shown() {
        bench.harness.step();
        seen.push(bench.setup().focus());
        assert!(seen.len() < 1000);
    }
    let rising = seen.windows(2).skip(1).all(|pair| pair[0] <= pair[1]);
    assert!(rising && *seen.last().unwrap() == 4.0, "{seen:?}");
    // Half of the way in half of the time.
    let middle = seen[seen.len() / 2];
    assert!((middle - 3.0).abs() < 0.15, "{middle}");
    bench.click("Undo");
    assert_eq!(bench.setup().focus(), 4.0, "the preview is one step");
    let command = bench.model().pull_command().unwrap();
    let words: Vec<OsString> = command.split(' ').skip(1).map(OsString::from).collect();
    let film = MovieFilm::of_command(&words).unwrap();
    assert_eq!(film.length, Some(96), "{command}");
    assert!(command.contains("--from 2m --to 4m"), "{command}");
    // Whoever focuses meanwhile ends the preview.
    bench.change(|m| m.preview_pull());
    bench.harness.run_steps(3);
    bench.click("∞");
    assert!(!bench.model().pull.is_shown() && bench.setup().focus().is_infinite());
}

/// The renderer makes the picture in a thread of its own, so the window reacts in the frame of the
/// change: it asks for the picture and shows the new value.
#[test]
fn a_change_is_shown_and_asked_of_the_renderer_in_the_same_frame() {
    let mut bench = Bench::open("reaction");
    bench.until("the picture", WindowModel::shows_request);
    let model = &mut bench.harness.state_mut().model;
    model.edit("focus", |s| s.set_focus(1.5));
    assert!(!model.shows_request());
    bench.harness.step();
    assert!(bench.harness.query_by_label("Focus 1.500 m").is_some());
    let asked_later = bench.harness.state_mut().model.take_request();
    assert!(asked_later.is_none(), "it was asked for in that frame");
    bench.until("its picture", WindowModel::shows_request);
}

#[test]
fn overlays_tools_and_previews_are_chosen_by_click_and_key() {
    let mut bench = Bench::open("marks");
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
fn a_film_of_another_shape_keeps_pixels_square() {
    let mut bench = Bench::open("film");
    bench.click("Film");
    bench.click("6x6  56x56");
    let plan = &bench.setup().plan;
    assert_eq!((plan.film.width, plan.film.height), (56.0, 56.0));
    assert_eq!(plan.resolution.width, plan.resolution.height);
}

#[test]
fn a_lens_that_cannot_focus_there_offers_the_nearest_distance_that_it_can() {
    let mut bench = Bench::open("near");
    bench.change(|m| m.edit("focus", |s| s.set_focus(0.01)));
    bench.until("the refusal", |m| m.refusal.is_some());
    let nearest = bench.model().refusal.as_ref().unwrap().nearest.unwrap();
    assert!(nearest > 0.01 && bench.model().frame.is_some());
    bench.harness.get_by_label_contains("Focus at").click();
    bench.until("the picture there", |m| m.refusal.is_none());
    assert!((bench.setup().focus() / nearest - 1.0).abs() < 1e-3);
}
