//! Tests of groups that select among children, and of nodes that move with time.

use std::sync::Arc;

use glam::DVec3;
use ivcam_base::diag::Diagnostic;

use super::*;
use crate::iv::{Document, Limits, NoFiles, NodeRef};
use crate::snapshot::Snapshot;

/// Records shapes with their places. `area` is the screen area of every box, in pixels.
struct Recorder {
    shapes: Vec<String>,
    area: Option<f64>,
    reports: Vec<String>,
}

impl<'a> Visitor<'a> for Recorder {
    fn shape(&mut self, node: NodeRef<'a>, state: &State<'a>) {
        let at = state.world_from_object.transform_point3(DVec3::ZERO);
        let at = (at * 1e4).round() / 1e4 + DVec3::ZERO;
        self.shapes
            .push(format!("{} {} {}", node.class_name(), at.x, at.y));
    }

    fn screen_area(&mut self, _: NodeRef<'a>, _: &State<'a>) -> Option<f64> {
        self.area
    }

    fn report(&mut self, diagnostic: Box<Diagnostic>) {
        self.reports.push(diagnostic.message);
    }
}

fn walked(scene: &str, time: f64, options: &WalkOptions, area: Option<f64>) -> Recorder {
    let text = format!("#Inventor V2.1 ascii\n{scene}").into_bytes();
    let document = Document::read("test.iv", text, Arc::new(NoFiles), &Limits::default());
    let mut recorder = Recorder {
        shapes: Vec::new(),
        area,
        reports: Vec::new(),
    };
    let document = document.expect("reads");
    walk(&Snapshot::at(&document, time), options, &mut recorder);
    recorder
}

fn shapes_with(scene: &str, time: f64, options: &WalkOptions, area: Option<f64>) -> Vec<String> {
    walked(scene, time, options, area).shapes
}

fn shapes(scene: &str, time: f64) -> Vec<String> {
    shapes_with(scene, time, &WalkOptions::default(), None)
}

#[test]
fn a_blinker_shows_one_child_after_the_other() {
    let three = "Blinker { speed 0.5 Cube { } Sphere { } Cone { } }";
    let names = [0.0, 0.7, 1.5, 2.1].map(|t| shapes(three, t).concat());
    assert_eq!(names, ["Cube 0 0", "Sphere 0 0", "Cone 0 0", "Cube 0 0"]);
    let one = "Blinker { Cube { } }";
    assert_eq!([0.25, 0.75, 1.25].map(|t| shapes(one, t).len()), [0, 1, 0]);
    assert_eq!(
        shapes("Blinker { on FALSE Cube { } Cone { } }", 9.7),
        ["Cube 0 0"]
    );
}

#[test]
fn a_path_switch_shows_its_children_below_its_path_only() {
    let scene = "DEF A Separator { Switch { DEF S Separator { PathSwitch { path Path { USE S 0 } Cube { } } } } }
        Separator { Translation { translation 3 0 0 } USE S }
        PathSwitch { path Path { USE A 0 } Sphere { } } PathSwitch { Cone { } }";
    assert_eq!(shapes(scene, 0.0), ["Cube 3 0"]);
}

#[test]
fn moving_nodes_have_the_place_of_their_time() {
    let shuttle = "Shuttle { translation0 0 0 0 translation1 8 0 0 speed 0.25 } Cube { }";
    let places = [0.0, 1.0, 2.0, 4.0].map(|t| shapes(shuttle, t).concat());
    assert_eq!(places, ["Cube 0 0", "Cube 4 0", "Cube 8 0", "Cube 0 0"]);
    let rotor = "Rotor { rotation 0 0 1 0 speed 0.5 } Translation { translation 1 0 0 } Cube { }";
    let places = [0.0, 0.5, 1.0].map(|t| shapes(rotor, t).concat());
    assert_eq!(places, ["Cube 1 0", "Cube 0 1", "Cube -1 0"]);
    let pendulum = "Pendulum { rotation0 0 0 1 0 rotation1 0 0 1 1.5707963 } Translation { translation 1 0 0 } Cube { }";
    assert_eq!(shapes(pendulum, 0.5), ["Cube 0 1"]);
}

#[test]
fn a_level_of_detail_is_selected_by_its_screen_area() {
    let scene = |complexity: &str| {
        format!(
            "Complexity {{ value {complexity} }} LevelOfDetail {{ screenArea [ 100, 10 ] Cube {{ }} Sphere {{ }} Cone {{ }} }}"
        )
    };
    let at = |complexity: &str, area| {
        shapes_with(&scene(complexity), 0.0, &WalkOptions::default(), area).concat()
    };
    assert_eq!(at("0.5", Some(101.0)), "Cube 0 0");
    assert_eq!(at("0.5", Some(99.0)), "Sphere 0 0");
    assert_eq!(at("0.5", Some(9.0)), "Cone 0 0");
    assert_eq!(at("0.5", Some(100.0)), "Cube 0 0");
    assert_eq!(at("0.25", Some(199.0)), "Sphere 0 0");
    assert_eq!(at("0.1", Some(101.0)), "Sphere 0 0");
    assert_eq!(at("0.8", Some(99.0)), "Sphere 0 0");
    assert_eq!(at("0.75", Some(1.0)), "Sphere 0 0");
    assert_eq!(at("0", Some(1e9)), "Cone 0 0");
    assert_eq!(at("1", Some(0.0)), "Cube 0 0");
    assert_eq!(at("0.5", None), "Cube 0 0");
}

#[test]
fn reset_transform_and_anti_squish_change_only_the_matrix() {
    let reset = "Separator { Translation { translation 5 0 0 } BaseColor { } ResetTransform { } Cube { } } Cone { }";
    assert_eq!(shapes(reset, 0.0), ["Cube 0 0", "Cone 0 0"]);
    // Scales 1, 4 and 1 have the average 2.
    let squish =
        "Scale { scaleFactor 1 4 1 } AntiSquish { } Translation { translation 1 1 0 } Cube { }";
    assert_eq!(shapes(squish, 0.0), ["Cube 2 2"]);
    // The principal stretches of a rotated shape are those of the `Scale`.
    for (sizing, factor) in [("X", 2.0), ("Y", 0.5), ("Z", 3.0)] {
        let turned = format!(
            "Scale {{ scaleFactor 2 .5 3 }} Rotation {{ rotation 0 0 1 .6 }} \
             AntiSquish {{ sizing {sizing} }} Rotation {{ rotation 0 0 1 -.6 }} \
             Translation {{ translation 1 1 0 }} Cube {{ }}"
        );
        assert_eq!(shapes(&turned, 0.0), [format!("Cube {factor} {factor}")]);
    }
    let around = "SurroundScale { } Translation { translation 1 1 0 } Cube { }";
    assert_eq!(shapes(around, 0.0), ["Cube 1 1"]);
}

/// Records clip planes.
struct Planes(Vec<(DVec3, f64)>);

impl<'a> Visitor<'a> for Planes {
    fn shape(&mut self, _: NodeRef<'a>, state: &State<'a>) {
        self.0.extend(state.clip_planes.iter());
    }
}

/// A plane of Inventor has a normal of any length and a distance along it.
#[test]
fn the_length_of_a_clip_planes_normal_does_not_matter() {
    let planes = |plane: &str| {
        let scale = "Scale { scaleFactor 2 1 1 }";
        let text =
            format!("#Inventor V2.1 ascii\n{scale} ClipPlane {{ plane {plane} }} Cube {{ }}");
        let document = Document::read_headerless("a", text.into()).expect("reads");
        let mut planes = Planes(Vec::new());
        walk(
            &Snapshot::at(&document, 0.0),
            &WalkOptions::default(),
            &mut planes,
        );
        planes.0
    };
    assert_eq!(planes("0 4 0 .5"), [(DVec3::Y, 0.5)]);
    assert_eq!(planes("-4 0 0 .5"), [(DVec3::NEG_X, 1.0)]);
    // Through (-√2, √2)/4 in object space, which is (-2√2, √2)/4 in the world.
    let (normal, distance) = planes("-1 1 0 .5")[0];
    let expected = DVec3::new(-0.5, 1.0, 0.0).normalize();
    let on_plane = DVec3::new(-(0.5f64.sqrt()), 0.5 * 0.5f64.sqrt(), 0.0);
    assert!((normal - expected).length() < 1e-12, "{normal}");
    assert!(
        (distance - expected.dot(on_plane)).abs() < 1e-7,
        "{distance}"
    );
}

#[test]
fn shadow_groups_and_annotations_are_separators() {
    for class in ["ShadowGroup", "Annotation", "Selection", "LocateHighlight"] {
        let scene =
            format!("{class} {{ Translation {{ translation 1 0 0 }} Cube {{ }} }} Cone {{ }}");
        assert_eq!(shapes(&scene, 0.0), ["Cube 1 0", "Cone 0 0"], "{class}");
    }
}

/// An array of 2 x 2 x 2 is whole. Of larger ones the copies up to the limit of visits are walked,
/// and the rest is reported.
#[test]
fn the_copies_of_an_array_beyond_the_limit_are_reported() {
    let options = WalkOptions {
        max_visits: 100,
        ..WalkOptions::default()
    };
    let array = |counts: [i32; 3]| {
        let [a, b, c] = counts;
        let scene = format!(
            "Array {{ numElements1 {a} numElements2 {b} numElements3 {c} \
             separation1 1 0 0 separation2 0 1 0 Cube {{ }} }}"
        );
        let recorder = walked(&scene, 0.0, &options, None);
        (recorder.shapes, recorder.reports)
    };
    let (shapes, reports) = array([2, 2, 2]);
    assert_eq!((shapes.len(), reports.len()), (8, 0));
    assert_eq!(shapes[..3], ["Cube 0 0", "Cube 1 0", "Cube 0 1"]);
    for counts in [[101, 1, 1], [32_767, 32_767, 32_767]] {
        let (shapes, reports) = array(counts);
        assert_eq!(shapes.len(), 100, "{counts:?}");
        let [a, b, c] = counts;
        let what = format!("this `Array` makes {a} x {b} x {c} copies; the first 100 are drawn");
        assert_eq!(reports[0], what);
    }
    let (shapes, reports) = array([0, 5, 5]);
    assert!(shapes.is_empty());
    let what = "this `Array` makes 0 x 5 x 5 copies, so it draws nothing";
    assert_eq!(reports, [what]);
}

/// Eight arrays inside each other are 8 million to the power of 8 copies. The copies of arrays of
/// nothing count as visits, so the walk ends there too.
#[test]
fn nested_arrays_are_walked_up_to_the_limit() {
    let options = WalkOptions {
        max_visits: 1000,
        ..WalkOptions::default()
    };
    for inside in ["Cube { }", "", "Switch { Cube { } }"] {
        let array = "Array { numElements1 200 numElements2 200 numElements3 200 ";
        let scene = format!("{}{inside}{}", array.repeat(8), "}".repeat(8));
        let recorder = walked(&scene, 0.0, &options, None);
        let cubes = if inside.starts_with("Cube") { 992 } else { 0 };
        assert!(recorder.shapes.len().abs_diff(cubes) <= 1, "{inside}");
        assert_eq!(recorder.reports.len(), 9, "{inside}"); // one for each array, and the limit
    }
}

#[test]
fn a_multiple_copy_has_a_copy_for_each_matrix() {
    let scene = "MultipleCopy { matrix [ 1 0 0 0 0 1 0 0 0 0 1 0 5 0 0 1, \
                 0 1 0 0 -1 0 0 0 0 0 1 0 0 7 0 1 ] Translation { translation 1 0 0 } Cube { } }";
    assert_eq!(shapes(scene, 0.0), ["Cube 6 0", "Cube 0 8"]);
}
