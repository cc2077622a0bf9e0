use std::sync::Arc;

use glam::Vec3;

use super::*;
use crate::iv::{Document, Limits, NoFiles, Value};
use crate::snapshot::{BindableKind, NoBounds, Snapshot};
use crate::traversal::{WalkOptions, first_camera};
use ivcam_base::diag::Severity;

fn read(text: &str) -> Document {
    let bytes = text.as_bytes().to_vec();
    Document::read("test.wrl", bytes, Arc::new(NoFiles), &Limits::default()).expect("reads")
}

fn field(document: &Document, name: &str, field: &str) -> Value {
    let node = document.node(document.names[name]);
    node.value(field).expect("has the field").clone()
}

/// Returns a document after its events up to a time, or `None` if it has none.
fn play(document: &Document, time: f64, actions: &[Action]) -> Option<Document> {
    let options = SnapshotOptions {
        time,
        actions: actions.to_vec(),
        ..SnapshotOptions::default()
    };
    play::play(document, &options).map(|played| played.document)
}

/// Returns the field of a node of a VRML97 scene at a time.
fn at(scene: &str, time: f64, name: &str, of: &str) -> Value {
    after(scene, &[], time, name, of)
}

/// Returns the field of a node of a VRML97 scene at a time, after what a user did.
fn after(scene: &str, actions: &[Action], time: f64, name: &str, of: &str) -> Value {
    let document = read(&format!("#VRML V2.0 utf8\n{scene}"));
    let played = play(&document, time, actions).unwrap_or(document);
    field(&played, name, of)
}

/// Returns a user's event.
fn event(time: f64, node: &str, event: &str, value: &str) -> Action {
    Action {
        time,
        node: node.into(),
        what: ActionKind::Send {
            event: event.into(),
            value: value.into(),
        },
        viewer: None,
    }
}

/// Returns a touch.
fn touch(time: f64, node: &str) -> Action {
    Action {
        time,
        node: node.into(),
        what: ActionKind::Touch { place: None },
        viewer: None,
    }
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
    let document = play(&read(ROUTED), 7.0, &[]).expect("has routes");
    let place = field(&document, "X", "translation");
    assert_eq!(place, Value::Vec3(Vec3::new(2.0, 2.0, 0.0)));
    let Value::Rotation(turn) = field(&document, "X", "rotation") else {
        panic!()
    };
    assert!((turn.angle - 2.25).abs() < 1e-6 && (turn.axis - Vec3::Z).length() < 1e-6);
    let half = play(&read(ROUTED), 2.0, &[]).expect("has routes");
    assert_eq!(
        field(&half, "M", "diffuseColor"),
        Value::Vec3(Vec3::new(1.0, 1.0, 0.0))
    );
}

#[test]
fn a_sensor_that_has_not_started_sends_nothing() {
    let waiting = ROUTED.replace("loop TRUE", "loop FALSE");
    let document = play(&read(&waiting), 2.0, &[]).expect("has routes");
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

/// Returns the fraction of a sensor, or 0.125 if it sends none.
fn fraction(sensor: &str, time: f64) -> Value {
    fraction_after(sensor, &[], time)
}

/// Returns the fraction of a sensor after what a user did.
fn fraction_after(sensor: &str, actions: &[Action], time: f64) -> Value {
    let scene = format!(
        "DEF T TimeSensor {{ {sensor} }} DEF X Material {{ transparency 0.125 }}
         ROUTE T.fraction_changed TO X.set_transparency"
    );
    after(&scene, actions, time, "X", "transparency")
}

#[test]
fn the_fraction_of_a_sensor_follows_the_standards_formula() {
    // VRML97, 6.50: f = fmod(now - startTime, cycleInterval), and 1 where that is 0 after the
    // start.
    let looping = "loop TRUE cycleInterval 4";
    for (time, f) in [(0.0, 0.0), (1.0, 0.25), (4.0, 1.0), (5.0, 0.25), (8.0, 1.0)] {
        assert_eq!(fraction(looping, time), Value::Float(f), "at {time}");
    }
    let starts = [event(0.0, "T", "startTime", "2")];
    for (time, f) in [
        (1.9, 0.125),
        (2.0, 0.0),
        (3.0, 0.25),
        (6.0, 1.0),
        (60.0, 1.0),
    ] {
        let once = fraction_after("cycleInterval 4", &starts, time);
        assert_eq!(once, Value::Float(f), "at {time}");
    }
}

#[test]
fn a_sensor_stops_at_its_stop_time_if_that_is_after_its_start() {
    let looping = "loop TRUE cycleInterval 4";
    let starts = |stop: &str| {
        [
            event(0.0, "T", "startTime", "1"),
            event(0.0, "T", "stopTime", stop),
        ]
    };
    let stopped = |time| fraction_after(looping, &starts("4"), time);
    assert_eq!(stopped(3.0), Value::Float(0.5));
    assert_eq!(stopped(100.0), Value::Float(0.75));
    let ignored = fraction_after(looping, &starts("0.5"), 4.0);
    assert_eq!(ignored, Value::Float(0.75));
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
fn a_sensor_that_another_switches_off_stops_then_in_either_order() {
    let sensors = [
        "DEF A TimeSensor { loop TRUE cycleInterval 10 }",
        "DEF B TimeSensor { }",
    ];
    for [first, second] in [sensors, [sensors[1], sensors[0]]] {
        for (input, value) in [("enabled", 0.125), ("loop", 1.0)] {
            let scene = format!(
                "{first} {second} DEF X Material {{ transparency 0.5 }}
                ROUTE A.fraction_changed TO X.transparency ROUTE B.isActive TO A.{input}"
            );
            let starts = [event(0.25, "B", "startTime", "0.25")];
            let stopped = after(&scene, &starts, 30.0, "X", "transparency");
            assert_eq!(stopped, Value::Float(value), "{first} {input}");
        }
    }
}

#[test]
fn a_sensor_that_anothers_time_restarts_does_so_in_frames() {
    // It runs from 0 to 1 and from the next frame, at 1.04, on.
    let scene = "DEF A TimeSensor { loop TRUE cycleInterval 100 } DEF B TimeSensor { }
        ROUTE A.time TO B.startTime";
    let start = at(scene, 1.7, "B", "startTime");
    assert_eq!(start, Value::Double(26.0 * FRAME));
}

#[test]
fn the_record_names_nodes_and_has_an_event_of_a_loop_once() {
    let scene = "#VRML V2.0 utf8
        DEF A Group { } DEF B Group { } DEF M Material { } DEF N Material { }
        DEF X Group { children [ DEF C Group { }, Shape { } ] }
        ROUTE X.children TO A.children
        ROUTE M.shininess_changed TO N.set_shininess ROUTE N.shininess TO M.shininess";
    let options = SnapshotOptions {
        actions: vec![
            event(0.0, "X", "addChildren", "B"),
            event(1.0, "M", "shininess", "1"),
        ],
        time: 1.0,
        log: true,
        ..SnapshotOptions::default()
    };
    let played = play::play(&read(scene), &options).expect("has actions");
    let sent = played.sent.iter();
    let sent: Vec<String> = sent
        .map(|sent| format!("{}.{} {}", sent.node, sent.event, sent.value))
        .collect();
    let children = "children [ C, Shape, B ]";
    let [x, a] = ["X", "A"].map(|name| format!("{name}.{children}"));
    assert_eq!(sent, [&*x, &*a, "M.shininess 1", "N.shininess 1"]);
}

/// ISO/IEC 19775-1, 8.2.4: a pause takes no part of the time of a sensor.
#[test]
fn a_sensor_of_x3d_pauses_and_resumes() {
    for sensor in ["loop TRUE cycleInterval 10", "cycleInterval 10"] {
        let document = read(&format!(
            "#X3D V3.3 utf8\nPROFILE Immersive
            DEF A TimeSensor {{ {sensor} }} DEF X Material {{ }} DEF Y Transform {{ }}
            DEF B TimeSensor {{ }} DEF L PointLight {{ on FALSE }}
            ROUTE A.fraction_changed TO X.transparency ROUTE A.isPaused TO L.on
            ROUTE A.elapsedTime TO B.cycleInterval"
        ));
        let events = [
            event(0.0, "A", "startTime", "0"),
            event(0.0, "A", "pauseTime", "2"),
            event(3.0, "A", "resumeTime", "3"),
        ];
        for (time, done, is_paused) in [
            (1.0, 1.0, false),
            (2.0, 2.0, true),
            (2.5, 2.0, true),
            (5.0, 4.0, false),
            (11.0, 10.0, false),
        ] {
            let played = play(&document, time, &events).expect("has events");
            let values = [("X", "transparency"), ("B", "cycleInterval"), ("L", "on")];
            let [fraction, elapsed, paused] = values.map(|(node, of)| field(&played, node, of));
            assert_eq!(
                fraction,
                Value::Float((done / 10.0) as f32),
                "{sensor} {time}"
            );
            assert_eq!(elapsed, Value::Double(done), "{sensor} {time}");
            assert_eq!(paused, Value::Bool(is_paused), "{sensor} {time}");
        }
    }
}

/// Sums and quotients of tenths are rounded to either side of the whole number.
#[test]
fn a_cycle_ends_at_its_end_whatever_its_start_and_length_round_to() {
    for (start, cycle) in (0..40).flat_map(|s| (1..30).map(move |c| (s, c))) {
        let (start, cycle) = (f64::from(start) / 10.0, f64::from(cycle) / 10.0);
        let starts = [event(0.0, "T", "startTime", &start.to_string())];
        let once = fraction_after(&format!("cycleInterval {cycle}"), &starts, 9.0);
        assert_eq!(once, Value::Float(1.0), "{cycle} s from {start} s");
        let scene = format!(
            "DEF A TimeSensor {{ loop TRUE cycleInterval {cycle} startTime {start} }}
            DEF B TimeSensor {{ cycleInterval 0.001 }} ROUTE A.cycleTime TO B.set_startTime"
        );
        let last = start + ((9.05 - start) / cycle).floor() * cycle;
        let Value::Double(sent) = at(&scene, 9.05, "B", "startTime") else {
            panic!()
        };
        assert!(
            (sent - last).abs() < 1e-9,
            "{sent}, not {last}: {cycle} s from {start} s"
        );
    }
}

/// A clip is active from its start to its stop time (VRML97, 4.6.9), whatever its file has.
#[test]
fn a_clip_and_a_movie_say_when_they_play() {
    for clip in ["AudioClip { }", "MovieTexture { }"] {
        let scene = format!(
            "DEF C {clip} DEF L DirectionalLight {{ on FALSE }}
            ROUTE C.isActive TO L.set_on"
        );
        let start = event(1.0, "C", "startTime", "1");
        let stop = event(3.0, "C", "stopTime", "3");
        for (time, on) in [(0.5, false), (1.5, true), (2.5, true), (3.5, false)] {
            let actions = [start.clone(), stop.clone()];
            let is_on = after(&scene, &actions, time, "L", "on");
            assert_eq!(is_on, Value::Bool(on), "{clip} at {time}");
        }
    }
    // One that always loops plays when the scene is opened; one that does not has ended.
    for (clip, on) in [("loop TRUE", true), ("loop FALSE", false)] {
        let scene = format!(
            "DEF C AudioClip {{ {clip} }} DEF L DirectionalLight {{ on FALSE }}
            ROUTE C.isActive TO L.set_on"
        );
        assert_eq!(at(&scene, 1.0, "L", "on"), Value::Bool(on), "{clip}");
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
    let played = play(&document, 1e9, &[]).expect("has routes");
    assert!(played.sink.items().is_empty());
}

#[test]
fn a_script_that_does_not_run_is_reported_with_the_feature_that_runs_it() {
    let scene = "#VRML V2.0 utf8
        Script { url \"javascript: function initialize() { }\" } Script { }
        Script { url \"Rotate.class\" }";
    let played = play(&read(scene), 0.0, &[]).expect("has scripts");
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

/// Times that a file states count from 1970 (VRML97, 4.11.1), which is long ago.
#[test]
fn times_of_a_file_were_before_the_scene_was_opened() {
    let rests = Value::Float(0.125);
    for past in [
        "loop TRUE stopTime 1",
        "cycleInterval 5 startTime 5 stopTime 1",
        "cycleInterval 5 startTime 1 stopTime 3",
        "loop TRUE startTime 1e12",
    ] {
        for time in [0.0, 0.5, 6.0] {
            assert_eq!(fraction(past, time), rests, "{past} at {time}");
        }
    }
    let always = "loop TRUE cycleInterval 4 startTime 5 stopTime 1";
    assert_eq!(fraction(always, 0.0), Value::Float(0.75));
    assert_eq!(fraction(always, 2.0), Value::Float(0.25));
    // An event starts a sensor whose stop time is past.
    let starts = [event(1.0, "T", "startTime", "1")];
    let started = fraction_after("loop TRUE stopTime 1 cycleInterval 4", &starts, 2.0);
    assert_eq!(started, Value::Float(0.25));
}

#[test]
fn a_sensor_that_is_disabled_sends_its_outputs_first() {
    let off = [event(1.0, "T", "enabled", "FALSE")];
    let fraction = fraction_after("loop TRUE cycleInterval 4", &off, 3.0);
    assert_eq!(fraction, Value::Float(0.25));
}

const VIEWS: &str = "DEF V Viewpoint { } DEF W Viewpoint { position 10 0 0 }
    DEF S Viewpoint { position 0 5 0 jump FALSE }
    DEF B Background { } DEF C Background { }
    DEF L DirectionalLight { on FALSE } DEF M DirectionalLight { on TRUE }
    ROUTE V.isBound TO L.on ROUTE W.isBound TO M.on ";

/// Returns the names of the bound `Viewpoint` and `Background` after some events, and the viewer's
/// position.
fn bound(actions: &[Action]) -> (Option<String>, Option<String>, Vec3) {
    let document = read(&format!("#VRML V2.0 utf8\n{VIEWS}"));
    let options = SnapshotOptions {
        actions: actions.to_vec(),
        time: 9.0,
        ..SnapshotOptions::default()
    };
    let snapshot = Snapshot::take(&document, &options, &NoBounds);
    let name = |kind| {
        let node = snapshot.bound()?.get(kind)?;
        let found = document.names.iter().find(|(_, id)| **id == node);
        found.map(|(name, _)| name.to_string())
    };
    let camera = first_camera(&snapshot, &WalkOptions::default());
    (
        name(BindableKind::Viewpoint),
        name(BindableKind::Background),
        camera.map_or(Vec3::NAN, |pose| pose.position.as_vec3()),
    )
}

/// ISO 14772-1, 4.6.10.
#[test]
fn a_bound_node_is_the_last_of_its_stack() {
    let bind = |time, node| event(time, node, "set_bind", "TRUE");
    let unbind = |time, node| event(time, node, "set_bind", "FALSE");
    let first = (None, None, Vec3::new(0.0, 0.0, 10.0));
    assert_eq!(bound(&[]), first);
    let second = bound(&[bind(1.0, "W"), bind(1.0, "C")]);
    let w = Vec3::new(10.0, 0.0, 0.0);
    assert_eq!(second, (Some("W".into()), Some("C".into()), w));
    let (view, back, _) = bound(&[bind(1.0, "W"), bind(2.0, "C"), unbind(3.0, "C")]);
    assert_eq!((view.as_deref(), back.as_deref()), (Some("W"), Some("B")));
    let (view, ..) = bound(&[bind(1.0, "W"), bind(2.0, "V"), unbind(3.0, "V")]);
    assert_eq!(view.as_deref(), Some("W"));
    // A viewpoint that does not jump leaves the viewer where it is.
    let (view, _, place) = bound(&[bind(1.0, "W"), bind(2.0, "S")]);
    assert_eq!((view.as_deref(), place), (Some("S"), w));
}

#[test]
fn bindable_nodes_say_whether_they_are_bound() {
    let bind = [event(1.0, "W", "set_bind", "TRUE")];
    let on = |actions: &[Action], light| after(VIEWS, actions, 2.0, light, "on");
    assert_eq!(on(&[], "L"), Value::Bool(true));
    assert_eq!(on(&bind, "L"), Value::Bool(false));
    assert_eq!(on(&bind, "M"), Value::Bool(true));
}

#[test]
fn sensors_know_where_the_viewer_is() {
    let scene = "DEF V Viewpoint { } DEF A Transform { children [
          DEF P ProximitySensor { size 4 4 4 } DEF E VisibilitySensor { size 1 1 1 } ] }
        DEF L DirectionalLight { on FALSE } DEF M DirectionalLight { on FALSE }
        DEF X Transform { } DEF T TimeSensor { }
        ROUTE P.isActive TO L.on ROUTE E.isActive TO M.on
        ROUTE P.position_changed TO X.translation ROUTE P.enterTime TO T.startTime";
    let moved = |z| [event(1.0, "A", "translation", z)];
    let on = |actions: &[Action], light| after(scene, actions, 2.0, light, "on");
    assert_eq!(
        (on(&[], "L"), on(&[], "M")),
        (Value::Bool(false), Value::Bool(true))
    );
    // The viewer is at 0 0 10, one meter in front of the sensors.
    let near = moved("0 0 9");
    assert_eq!(
        (on(&near, "L"), on(&near, "M")),
        (Value::Bool(true), Value::Bool(true))
    );
    let place = after(scene, &near, 2.0, "X", "translation");
    assert_eq!(place, Value::Vec3(Vec3::Z));
    assert_eq!(
        after(scene, &near, 2.0, "T", "startTime"),
        Value::Double(1.0)
    );
    let behind = moved("0 0 13");
    assert_eq!(
        (on(&behind, "L"), on(&behind, "M")),
        (Value::Bool(false), Value::Bool(false))
    );
}

#[test]
fn a_touch_reaches_the_sensor_beside_the_shape() {
    let scene = "DEF V Viewpoint { } DEF W Viewpoint { position 10 0 0 }
        DEF G Group { children [ DEF S TouchSensor { } DEF X Transform { children DEF Q Shape { } } ] }
        DEF A Anchor { url \"#W\" children DEF Z Shape { } }
        DEF T TimeSensor { } DEF L DirectionalLight { on FALSE }
        ROUTE S.touchTime TO T.startTime ROUTE W.isBound TO L.on";
    for node in ["S", "Q", "X"] {
        let start = after(scene, &[touch(3.0, node)], 4.0, "T", "startTime");
        assert_eq!(start, Value::Double(3.0), "{node}");
    }
    for node in ["A", "Z"] {
        let on = after(scene, &[touch(3.0, node)], 4.0, "L", "on");
        assert_eq!(on, Value::Bool(true), "{node}");
    }
}

#[test]
fn a_node_without_a_name_is_found_by_its_class_if_it_is_the_only_one() {
    let scene = |count| {
        let anchor = "Anchor { url \"#W\" children Shape { } } ";
        let anchors = anchor.repeat(count);
        format!(
            "DEF V Viewpoint {{ }} DEF W Viewpoint {{ }} DEF L DirectionalLight {{ on FALSE }}
            {anchors} ROUTE W.isBound TO L.on"
        )
    };
    let on = |count| after(&scene(count), &[touch(1.0, "Anchor")], 2.0, "L", "on");
    assert_eq!((on(1), on(2)), (Value::Bool(true), Value::Bool(false)));
}

/// ISO 14772-1, 4.6.7.3: the sensors of one group act together, those of a group above it do not.
#[test]
fn sensors_of_the_lowest_group_act_together() {
    let scene = "DEF V Viewpoint { } DEF U Group { children [ DEF A PlaneSensor { } DEF G Group {
          children [ DEF S TouchSensor { } DEF C CylinderSensor { } DEF Q Shape { } ] } ] }
        DEF L DirectionalLight { } DEF M DirectionalLight { } DEF T TimeSensor { }
        ROUTE A.isActive TO L.on ROUTE C.isActive TO M.on ROUTE S.touchTime TO T.startTime";
    for node in ["S", "C", "G", "Q"] {
        let state = |name, field| after(scene, &[touch(3.0, node)], 4.0, name, field);
        // A press and a release leave what `isActive` is routed to FALSE.
        assert_eq!(state("L", "on"), Value::Bool(true), "{node}");
        assert_eq!(state("M", "on"), Value::Bool(false), "{node}");
        assert_eq!(state("T", "startTime"), Value::Double(3.0), "{node}");
    }
}

#[test]
fn what_a_user_cannot_do_is_reported() {
    let scene = "#VRML V2.0 utf8\nDEF M Material { } DEF A Anchor { url \"b.wrl\" }";
    let messages = |action| {
        let played = play(&read(scene), 1.0, &[action]).expect("an action");
        let items = played.sink.items().iter();
        let warnings = items.filter(|item| item.severity == Severity::Warning);
        warnings
            .map(|item| item.message.clone())
            .collect::<String>()
    };
    assert!(messages(event(0.0, "N", "on", "TRUE")).contains("no node is called `N`"));
    assert!(messages(event(0.0, "M", "on", "TRUE")).contains("has no event `on`"));
    let message = messages(event(0.0, "M", "transparency", "TRUE"));
    assert!(message.contains("not a value of type SFFloat"), "{message}");
    assert!(messages(touch(0.0, "M")).contains("nothing happens"));
    assert!(messages(touch(0.0, "A")).contains("leads to `b.wrl`"));
}
