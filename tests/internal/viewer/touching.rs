//! Clicks and drags that the scene answers to.

use egui::{Event, Modifiers, PointerButton};
use glam::DVec2;
use ivcam_inventor::events::ActionKind;

use super::bench::{Bench, Scratch};
use crate::photo::{Optics, Plan, Session};
use crate::viewer::model::WindowModel;

/// A red box in the middle that becomes green when it is touched, a blue slider at the right that is
/// dragged, and a gray wall.
const WORLD: &str = "#VRML V2.0 utf8
Viewpoint { position 0 0 10 }
Group { children [
  DEF Button TouchSensor { }
  Shape { appearance Appearance { material DEF M Material { diffuseColor 0 0 0 emissiveColor 1 0 0 } }
    geometry Box { } } ] }
DEF Clock TimeSensor { cycleInterval .1 }
DEF Green ColorInterpolator { key [0, 1] keyValue [1 0 0, 0 1 0] }
ROUTE Button.touchTime TO Clock.set_startTime
ROUTE Clock.fraction_changed TO Green.set_fraction
ROUTE Green.value_changed TO M.set_emissiveColor
Group { children [
  DEF Slider PlaneSensor { }
  DEF Moved Transform { children Transform { translation 3 0 0 children
    Shape { appearance Appearance { material Material { diffuseColor 0 0 0 emissiveColor 0 0 1 } }
      geometry Box { } } } } ] }
ROUTE Slider.translation_changed TO Moved.set_translation
Transform { translation 0 0 -4 children Shape { geometry Box { size 40 40 .1 } } }
";

fn open(name: &str) -> Bench {
    let scratch = Scratch::with_scene(name, WORLD);
    let mut plan = scratch.plan();
    plan.optics = Optics::Pinhole;
    let mut bench = Bench::new(scratch, plan);
    bench.until("a frame", |m| m.frame.is_some());
    bench
}

/// The color of the picture at a place from 0 to 1.
fn color(model: &WindowModel, x: f64, y: f64) -> [f32; 3] {
    let frame = model.frame.as_ref().unwrap();
    let (width, height) = (frame.resolution.width, frame.resolution.height);
    let (column, row) = (
        (x * f64::from(width)) as u32,
        (y * f64::from(height)) as u32,
    );
    frame.pixels[(row * width + column) as usize]
}

fn is_green([red, green, _]: [f32; 3]) -> bool {
    green > 0.5 && red < 0.5
}

/// The picture of a plan, as its command line makes it.
fn batch_color(plan: &Plan, x: f64, y: f64) -> [f32; 3] {
    let session = Session::open(plan.clone()).unwrap();
    let film = session.expose(&|_| ()).film;
    let (width, height) = (film.resolution.width, film.resolution.height);
    let (column, row) = (
        (x * f64::from(width)) as u32,
        (y * f64::from(height)) as u32,
    );
    film.pixels[(row * width + column) as usize]
        .mean
        .as_vec3()
        .to_array()
}

#[test]
fn a_click_touches_a_sensor_and_the_command_line_makes_the_picture_again() {
    let mut bench = open("touch");
    bench.click_at(bench.at(0.5, 0.5));
    assert_eq!(bench.setup().plan.actions.len(), 1);
    let focused = bench.setup().plan.focus;
    assert_eq!(focused, None, "the tool does nothing");
    bench.until("green", |m| {
        m.playing.is_none() && is_green(color(m, 0.5, 0.5))
    });
    let command = bench.model().command();
    assert!(command.contains("--touch 0.5,0.5"), "{command}");
    assert!(command.contains("--scene-time 3"), "{command}");
    assert!(is_green(batch_color(&bench.setup().plan, 0.5, 0.5)));
    bench.click("Forget touches");
    bench.until("red", |m| !is_green(color(m, 0.5, 0.5)));
}

#[test]
fn a_touch_stays_where_it_was_when_the_camera_moves() {
    let mut bench = open("stays");
    bench.click_at(bench.at(0.5, 0.5));
    bench.until("the end", |m| {
        m.playing.is_none() && is_green(color(m, 0.5, 0.5))
    });
    // The box is at the left of the picture now, and the middle is the wall.
    bench.change(|m| {
        let mut pose = m.setup.pose.clone();
        pose.position.x += 2.0;
        m.go("camera", &pose);
    });
    bench.until("the box at the left", |m| is_green(color(m, 0.3, 0.5)));
    let command = bench.model().command();
    assert!(command.contains(" from PerspectiveCamera {"), "{command}");
    assert!(is_green(batch_color(&bench.setup().plan, 0.3, 0.5)));
}

#[test]
fn a_drag_that_begins_on_a_sensor_drags_it_and_one_beside_it_orbits() {
    let mut bench = open("drag");
    let home = bench.setup().pose.clone();
    bench.click("Orbit");
    // The middle of the slider: 3 of 6.2 half widths to the right of the middle.
    bench.drag_picture([0.74, 0.5], [0.74, 0.75], PointerButton::Primary);
    assert_eq!(bench.setup().pose, home);
    let action = bench.setup().plan.actions[0].clone();
    let ActionKind::Drag { path, .. } = &action.what else {
        panic!("{action:?}");
    };
    let (first, last) = (path[0], path[path.len() - 1]);
    assert!((first - DVec2::new(0.74, 0.5)).length() < 2e-3, "{first}");
    assert!((last - DVec2::new(0.74, 0.75)).length() < 2e-3, "{last}");
    let is_blue = |c: [f32; 3]| c[2] > 0.5 && c[0] < 0.5;
    bench.until("the slider below", |m| {
        m.playing.is_none() && m.shows_request() && is_blue(color(m, 0.74, 0.75))
    });
    assert!(!is_blue(color(bench.model(), 0.74, 0.42)));
    assert!(is_blue(batch_color(&bench.setup().plan, 0.74, 0.75)));
    bench.click("Undo");
    bench.click("Undo");
    assert!(bench.setup().plan.actions.is_empty(), "a drag is one step");
    bench.drag_picture([0.1, 0.2], [0.2, 0.2], PointerButton::Primary);
    assert_ne!(bench.setup().pose, home);
    assert!(bench.setup().plan.actions.is_empty());
}

#[test]
fn with_shift_the_tool_acts_and_the_cursor_says_what_is_under_it() {
    let mut bench = open("cursor");
    let icon = |bench: &Bench| bench.harness.output().platform_output.cursor_icon;
    for (place, expected) in [
        ([0.5, 0.5], egui::CursorIcon::PointingHand),
        ([0.74, 0.5], egui::CursorIcon::Grab),
        ([0.1, 0.1], egui::CursorIcon::Default),
    ] {
        let at = bench.at(place[0], place[1]);
        bench.harness.event(Event::PointerMoved(at));
        bench.harness.run_steps(2);
        assert_eq!(icon(&bench), expected, "{place:?}");
    }
    bench.click("Seek");
    let (at, home) = (bench.at(0.5, 0.5), bench.setup().pose.clone());
    for pressed in [true, false] {
        let button = Event::PointerButton {
            pos: at,
            button: PointerButton::Primary,
            pressed,
            modifiers: Modifiers::SHIFT,
        };
        bench.harness.event(Event::PointerMoved(at));
        bench.harness.event_modifiers(button, Modifiers::SHIFT);
        bench.harness.step();
    }
    bench.until("a flight", |m| m.setup.pose != home);
    assert!(bench.setup().plan.actions.is_empty());
}
