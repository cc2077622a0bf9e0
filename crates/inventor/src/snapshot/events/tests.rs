use std::sync::Arc;

use glam::Vec3;

use super::*;
use crate::iv::{Document, Limits, NoFiles, Value};

fn read(text: &str) -> Document {
    let bytes = text.as_bytes().to_vec();
    Document::read("test.wrl", bytes, Arc::new(NoFiles), &Limits::default()).expect("reads")
}

fn field(document: &Document, name: &str, field: &str) -> Value {
    let node = document.node(document.names[name]);
    node.value(field).expect("has the field").clone()
}

/// Returns the field of a node of a VRML97 scene at a time.
fn at(scene: &str, time: f64, name: &str, of: &str) -> Value {
    let document = read(&format!("#VRML V2.0 utf8\n{scene}"));
    let played = play(&document, time, None).unwrap_or(document);
    field(&played, name, of)
}

const ROUTED: &str = "#VRML V2.0 utf8
DEF T TimeSensor { loop TRUE cycleInterval 4 }
DEF P PositionInterpolator { key [ 0 0.5 1 ] keyValue [ 0 0 0, 2 0 0, 2 4 0 ] }
DEF O OrientationInterpolator { key [ 0 1 ] keyValue [ 0 0 1 0, 0 0 1 3 ] }
DEF C ColorInterpolator { key [ 0 1 ] keyValue [ 1 0 0, 0 1 0 ] }
DEF X Transform { translation 9 9 9 }
DEF M Material { }
ROUTE T.fraction_changed TO P.set_fraction
ROUTE T.fraction_changed TO O.set_fraction
ROUTE T.fraction_changed TO C.set_fraction
ROUTE P.value_changed TO X.set_translation
ROUTE O.value_changed TO X.rotation
ROUTE C.value_changed TO M.diffuseColor
";

#[test]
fn routes_carry_a_sensors_time_through_interpolators() {
    let document = play(&read(ROUTED), 7.0, None).expect("has routes");
    let place = field(&document, "X", "translation");
    assert_eq!(place, Value::Vec3(Vec3::new(2.0, 2.0, 0.0)));
    let Value::Rotation(turn) = field(&document, "X", "rotation") else {
        panic!()
    };
    assert!((turn.angle - 2.25).abs() < 1e-6 && (turn.axis - Vec3::Z).length() < 1e-6);
    let half = play(&read(ROUTED), 2.0, None).expect("has routes");
    assert_eq!(
        field(&half, "M", "diffuseColor"),
        Value::Vec3(Vec3::new(1.0, 1.0, 0.0))
    );
}

#[test]
fn a_sensor_that_has_not_started_sends_nothing() {
    let waiting = ROUTED.replace("loop TRUE", "loop FALSE");
    let document = play(&read(&waiting), 2.0, None).expect("has routes");
    assert_eq!(
        field(&document, "X", "translation"),
        Value::Vec3(Vec3::splat(9.0))
    );
}

#[test]
fn a_route_from_a_field_sends_nothing_until_the_field_changes() {
    let scene = "DEF G Group { } DEF B Group { children [ Group { }, Group { } ] }
        DEF M Material { diffuseColor 1 0 0 } DEF N Material { diffuseColor 0 1 0 }
        ROUTE G.children_changed TO B.set_children
        ROUTE M.diffuseColor_changed TO N.set_diffuseColor";
    let Value::Nodes(children) = at(scene, 0.0, "B", "children") else {
        panic!()
    };
    assert_eq!(children.len(), 2);
    let green = Value::Vec3(Vec3::Y);
    assert_eq!(at(scene, 9.0, "N", "diffuseColor"), green);
}

#[test]
fn an_interpolator_that_receives_no_event_sends_nothing() {
    let scene = "DEF P PositionInterpolator { key [ 0 1 ] keyValue [ 1 1 1, 2 2 2 ] }
        DEF X Transform { translation 9 9 9 }
        ROUTE P.value_changed TO X.set_translation";
    let nine = Value::Vec3(Vec3::splat(9.0));
    assert_eq!(at(scene, 3.0, "X", "translation"), nine);
}

/// A sensor that drives a switch through a scalar, so that its fraction can be read.
fn fraction(sensor: &str, time: f64) -> Value {
    let scene = format!(
        "DEF T TimeSensor {{ {sensor} }} DEF X Material {{ transparency 0.125 }}
         ROUTE T.fraction_changed TO X.set_transparency"
    );
    at(&scene, time, "X", "transparency")
}

#[test]
fn the_fraction_of_a_sensor_follows_the_standards_formula() {
    // VRML97, 6.50: f = fmod(now - startTime, cycleInterval), and 1 where that is 0 after the
    // start.
    let looping = "loop TRUE cycleInterval 4";
    for (time, f) in [(0.0, 0.0), (1.0, 0.25), (4.0, 1.0), (5.0, 0.25), (8.0, 1.0)] {
        assert_eq!(fraction(looping, time), Value::Float(f), "at {time}");
    }
    let once = "cycleInterval 4 startTime 2";
    for (time, f) in [
        (1.9, 0.125),
        (2.0, 0.0),
        (3.0, 0.25),
        (6.0, 1.0),
        (60.0, 1.0),
    ] {
        assert_eq!(fraction(once, time), Value::Float(f), "at {time}");
    }
}

#[test]
fn a_sensor_stops_at_its_stop_time_if_that_is_after_its_start() {
    let stops = "loop TRUE cycleInterval 4 startTime 1 stopTime 4";
    assert_eq!(fraction(stops, 3.0), Value::Float(0.5));
    assert_eq!(fraction(stops, 100.0), Value::Float(0.75));
    let ignored = "loop TRUE cycleInterval 4 startTime 1 stopTime 0.5";
    assert_eq!(fraction(ignored, 4.0), Value::Float(0.75));
    let disabled = "loop TRUE enabled FALSE";
    assert_eq!(fraction(disabled, 4.5), Value::Float(0.125));
    let long_ago = "cycleInterval 4";
    assert_eq!(fraction(long_ago, 1.0), Value::Float(0.125));
}

#[test]
fn a_sensor_starts_another_when_it_begins_a_cycle_or_ends() {
    // The second sensor starts at the cycles of the first, at 0, 3, 6, …, and takes 2 seconds.
    let scene =
        "DEF A TimeSensor { loop TRUE cycleInterval 3 } DEF B TimeSensor { cycleInterval 2 }
        DEF X Material { transparency 0.125 }
        ROUTE A.cycleTime TO B.set_startTime
        ROUTE B.fraction_changed TO X.set_transparency";
    for (time, f) in [(0.0, 0.0), (1.0, 0.5), (2.5, 1.0), (3.0, 0.0), (7.0, 0.5)] {
        let value = at(scene, time, "X", "transparency");
        assert_eq!(value, Value::Float(f), "at {time}");
    }
}

#[test]
fn a_loop_of_routes_ends_and_every_node_has_the_value() {
    let scene = "DEF T TimeSensor { loop TRUE cycleInterval 4 }
        DEF A Material { } DEF B Material { } DEF C Material { }
        ROUTE T.fraction_changed TO A.set_transparency
        ROUTE A.transparency_changed TO B.set_transparency
        ROUTE B.transparency_changed TO C.set_transparency
        ROUTE C.transparency_changed TO A.set_transparency";
    for name in ["A", "B", "C"] {
        let value = at(scene, 1.0, name, "transparency");
        assert_eq!(value, Value::Float(0.25), "{name}");
    }
}

#[test]
fn a_group_that_is_sent_to_itself_is_cut() {
    let scene = "DEF T TimeSensor { loop TRUE } DEF A Group { children DEF B Group { } }
        DEF S Switch { }
        ROUTE T.isActive TO S.whichChoice
        ROUTE A.children_changed TO B.set_children";
    // Nothing changes A's children, so B stays as it is.
    assert_eq!(at(scene, 1.0, "B", "children"), Value::Nodes(Vec::new()));
}

#[test]
fn a_sensor_of_tiny_cycles_costs_no_time() {
    let scene = "DEF T TimeSensor { loop TRUE cycleInterval 1e-12 } DEF X Material { }
        ROUTE T.fraction_changed TO X.set_transparency";
    let document = read(&format!("#VRML V2.0 utf8\n{scene}"));
    let played = play(&document, 1e9, None).expect("has routes");
    assert!(played.sink.items().is_empty());
}

#[test]
fn a_script_that_does_not_run_is_reported_with_the_feature_that_runs_it() {
    let scene = "#VRML V2.0 utf8
        Script { url \"javascript: function initialize() { }\" } Script { }
        Script { url \"Rotate.class\" }";
    let played = play(&read(scene), 0.0, None).expect("has scripts");
    let said: Vec<&str> = played.sink.items().iter().map(|d| &*d.message).collect();
    assert_eq!(said.len(), 2, "{said:?}");
    assert!(
        said[0].contains("without the feature `scripts`"),
        "{said:?}"
    );
    assert!(said[1].contains("Java"), "{said:?}");
    let help = played.sink.items()[0].help.as_deref().unwrap_or_default();
    assert!(help.contains("--features viewer,scripts"), "{help}");
}
