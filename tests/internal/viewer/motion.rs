//! Moving the camera by mouse and key, and where a scene is first seen from.

use egui::{Key, Modifiers, PointerButton};
use glam::DVec3;

use crate::photo::{LensChoice, Optics, Session};

use super::bench::{Bench, SCENE, Scratch};

#[test]
fn the_mouse_moves_the_camera_and_undo_moves_it_back() {
    let mut bench = Bench::open("go");
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

/// A scene without a camera, as `ivcam render` frames it.
#[test]
fn a_scene_without_a_camera_is_framed_as_a_batch_run_frames_it() {
    let scene = "#Inventor V2.1 ascii
Translation { translation 1 2 3 } Cube { width 3 }";
    let open = |optics: Optics| {
        let scratch = Scratch::with_scene("framing", scene);
        let mut plan = scratch.plan();
        plan.optics = optics;
        let batch = Session::open(plan.clone()).unwrap().pose;
        let mut bench = Bench::new(scratch, plan);
        bench.until("the scene", |m| m.open);
        assert_eq!(bench.setup().pose, batch);
        (bench, batch)
    };
    for name in ["double-gauss", "wide-angle", "fisheye", "telephoto"] {
        let (mut bench, batch) = open(Optics::Lens(LensChoice::named(name)));
        bench.click("View all");
        let away = (bench.setup().pose.position - batch.position).length();
        assert!(away < 1e-6 * batch.focal_distance, "{name}: {away} m");
    }
    open(Optics::Pinhole);
}

/// The focus is at 3 m, but the sphere in the middle is 2.4 m away.
#[test]
fn an_orbit_turns_about_what_is_in_the_middle_and_stops_at_a_wall() {
    let wall = "Translation { translation 1 0 0 } Cube { width .1 height 20 depth 20 }";
    let mut bench = Bench::open_scene("orbit", &format!("{SCENE}{wall}"));
    let pivot = DVec3::new(0.0, 0.0, 0.6);
    bench.click("Orbit");
    // To the left there is room.
    bench.drag_picture([0.5, 0.5], [0.6, 0.5], PointerButton::Primary);
    let pose = bench.setup().pose.clone();
    assert!(pose.position.x < -0.3, "{}", pose.position);
    let to_pivot = pivot - pose.position;
    assert!((to_pivot.length() - 2.4).abs() < 0.01, "{to_pivot}");
    assert!(to_pivot.normalize().dot(pose.direction()) > 1.0 - 1e-4);
    bench.click("Undo");
    // To the right is a wall, whose near side is at x = 0.95.
    for _ in 0..6 {
        bench.drag_picture([0.6, 0.5], [0.55, 0.5], PointerButton::Primary);
    }
    let pose = bench.setup().pose.clone();
    assert!(
        pose.position.x > 0.3 && pose.position.x < 0.95,
        "{}",
        pose.position
    );
}
