use std::sync::Arc;

use glam::{DVec3, Vec3};

use super::*;
use crate::grammar::value::Rotation;
use crate::iv::{Document, Limits, NoFiles, NodeId, Value};
use crate::snapshot::bounds::NoBounds;
use crate::snapshot::{Bounds, Corners, Snapshot};

fn read(text: &str) -> Document {
    let bytes = text.as_bytes().to_vec();
    Document::read("test.iv", bytes, Arc::new(NoFiles), &Limits::default()).expect("reads")
}

fn field(document: &Document, name: &str, field: &str) -> Value {
    let node = document.node(document.names[name]);
    node.value(field).expect("has the field").clone()
}

/// The value of a field of the node `X` in an Inventor scene at a time.
fn x(scene: &str, name: &str, time: f64) -> Value {
    let document = read(&format!("#Inventor V2.1 ascii\n{scene}"));
    let document = evaluate(&document, time, &NoBounds).unwrap_or(document);
    field(&document, "X", name)
}

#[test]
fn a_scene_without_connections_is_left_alone() {
    let document = read("#Inventor V2.1 ascii\nCube { }");
    assert!(evaluate(&document, 1.0, &NoBounds).is_none());
}

#[test]
fn elapsed_time_turns_a_windmill() {
    let scene = "DEF X RotationXYZ { axis Z angle 0 = ElapsedTime { speed 0.4 } . timeOut }";
    assert_eq!(x(scene, "angle", 0.0), Value::Float(0.0));
    assert_eq!(x(scene, "angle", 5.0), Value::Float(2.0));
    let off = "DEF X RotationXYZ { angle = ElapsedTime { on FALSE } . timeOut }";
    assert_eq!(x(off, "angle", 5.0), Value::Float(0.0));
}

#[test]
fn engines_feed_engines() {
    let scene = r#"DEF X Translation { translation 9 9 9 = Calculator {
        a = GlobalField { type "SFTime" realTime 0 } . realTime
        expression [ "ta = a * 2", "oA = vec3f(ta, floor(a), 1)" ] } . oA }"#;
    assert_eq!(
        x(scene, "translation", 1.5),
        Value::Vec3(Vec3::new(3.0, 1.0, 1.0))
    );
}

#[test]
fn composing_and_decomposing_are_opposites() {
    let scene = "DEF X Translation { translation = ComposeVec3f {
        x = DEF D DecomposeVec3f { vector 1 2 3 } . z  y = USE D . y  z = USE D . x } . vector }";
    assert_eq!(
        x(scene, "translation", 0.0),
        Value::Vec3(Vec3::new(3.0, 2.0, 1.0))
    );
    let scene = "DEF X MatrixTransform { matrix = ComposeMatrix { translation 1 2 3 } . matrix }";
    let Value::Matrix(m) = x(scene, "matrix", 0.0) else {
        panic!()
    };
    assert_eq!(m.w_axis.truncate(), Vec3::new(1.0, 2.0, 3.0));
    let scene = "DEF X Rotation { rotation = ComposeRotation { axis 0 1 0 angle 2 } . rotation }";
    let turn = Rotation::new(Vec3::Y, 2.0);
    assert_eq!(x(scene, "rotation", 0.0), Value::Rotation(turn));
}

#[test]
fn counting_goes_round_with_the_clock() {
    let scene = "DEF X Switch { whichChild = TimeCounter { max 3 frequency 0.5 } . output }";
    let counts = [0.0, 0.6, 1.1, 1.9, 2.1].map(|t| x(scene, "whichChild", t));
    assert_eq!(counts, [0, 1, 2, 3, 0].map(Value::Int));
}

#[test]
fn selecting_gating_and_joining() {
    let select =
        r#"DEF X Cube { width = SelectOne { type "MFFloat" input [ 4, 5, 6 ] index 1 } . output }"#;
    assert_eq!(x(select, "width", 0.0), Value::Float(5.0));
    let gate = r#"DEF X Cube { width 7 = Gate { type "MFFloat" input 3 enable FALSE } . output }"#;
    assert_eq!(x(gate, "width", 0.0), Value::Float(7.0));
    let join = r#"DEF X Coordinate3 { point = Concatenate { type "MFVec3f" input0 [ 1 0 0 ] input2 [ 2 0 0, 3 0 0 ] } . output }"#;
    assert_eq!(
        x(join, "point", 0.0),
        Value::Vec3s(vec![Vec3::X, 2.0 * Vec3::X, 3.0 * Vec3::X])
    );
}

#[test]
fn fields_convert_between_types() {
    let to_text = "DEF X Text3 { string = DEF C Cube { width 2.5 } . width }";
    assert_eq!(
        x(to_text, "string", 0.0),
        Value::Strings(vec!["2.5".to_owned()])
    );
    let to_bool = "DEF X ShapeHints { } DEF X Cube { width = BoolOperation { a TRUE operation NOT_A } . inverse }";
    assert_eq!(x(to_bool, "width", 0.0), Value::Float(1.0));
    let wrong = "DEF X Cube { width 3 = Transform { } . translation }";
    assert_eq!(x(wrong, "width", 0.0), Value::Float(3.0));
}

#[test]
fn a_circle_is_cut_with_a_warning() {
    let scene = "#Inventor V2.1 ascii\nSeparator {
        DEF A Cube { width 5 = DEF B Cube { width 6 = USE A . width } . width } }";
    let document = evaluate(&read(scene), 0.0, &NoBounds).expect("has connections");
    let width = field(&document, "A", "width");
    assert!(width == Value::Float(5.0) || width == Value::Float(6.0));
    assert!(
        document
            .sink
            .items()
            .iter()
            .any(|d| d.message.contains("itself"))
    );
}

#[test]
fn a_long_chain_needs_no_stack() {
    let mut scene = String::from("#Inventor V2.1 ascii\nSeparator { DEF N0 Cube { width 4 }\n");
    for i in 1..20_000 {
        scene += &format!("DEF N{i} Cube {{ width = USE N{} . width }}\n", i - 1);
    }
    let document = evaluate(&read(&(scene + "}")), 0.0, &NoBounds).expect("has connections");
    assert_eq!(field(&document, "N19999", "width"), Value::Float(4.0));
}

struct OneCube;

impl Bounds for OneCube {
    fn of_roots(&self, part: &Snapshot<'_>) -> Option<Corners> {
        let mut roots = part.document().roots();
        let only = roots.next().map(|n| n.class_name());
        assert_eq!((only, roots.count()), (Some("Cube"), 0));
        Some((DVec3::ZERO, DVec3::ONE))
    }

    fn of_nodes(&self, _: &Snapshot<'_>, _: &[NodeId]) -> Option<Corners> {
        None
    }
}

#[test]
fn a_bounding_box_is_the_callers_to_know() {
    let scene = "#Inventor V2.1 ascii\nSeparator { DEF S Cube { }
        DEF X Translation { translation = ComputeBoundingBox { node USE S } . max } }";
    let document = evaluate(&read(scene), 0.0, &OneCube).expect("has connections");
    assert_eq!(field(&document, "X", "translation"), Value::Vec3(Vec3::ONE));
}

#[test]
fn a_clocks_rounds_trigger_other_engines() {
    let count = "DEF X Switch { whichChild = Counter { max 9
        trigger = TriggerAny { input3 = TimeCounter { frequency 2 } . syncOut } . output } . output }";
    assert_eq!(x(count, "whichChild", 0.4), Value::Int(0));
    assert_eq!(x(count, "whichChild", 1.6), Value::Int(3));
    let ramp = "DEF X Cube { width = OneShot { duration 4
        trigger = TimeCounter { frequency 0.125 } . syncOut } . ramp }";
    assert_eq!(x(ramp, "width", 7.0), Value::Float(0.0));
    assert_eq!(x(ramp, "width", 11.0), Value::Float(0.75));
    assert_eq!(x(ramp, "width", 13.0), Value::Float(0.0));
    let toggle = "DEF X Cube { width = OnOff { toggle = TimeCounter { } . syncOut } . isOn }";
    assert_eq!(x(toggle, "width", 3.5), Value::Float(1.0));
}

#[test]
fn interpolating_goes_a_share_of_the_way() {
    let floats = "DEF X LOD { range = InterpolateFloat { input0 [ 1, 2 ] input1 [ 3, 10 ] alpha 0.25 } . output }";
    assert_eq!(x(floats, "range", 0.0), Value::Floats(vec![1.5, 4.0]));
    let vectors = "DEF X Translation { translation = InterpolateVec3f { input0 0 0 0 input1 4 8 12
        alpha = ElapsedTime { } . timeOut } . output }";
    assert_eq!(
        x(vectors, "translation", 0.75),
        Value::Vec3(Vec3::new(3.0, 6.0, 9.0))
    );
    let turns = "DEF X Rotation { rotation = InterpolateRotation { input0 0 0 1 0 input1 0 0 1 2 alpha 0.5 } . output }";
    let Value::Rotation(turn) = x(turns, "rotation", 0.0) else {
        panic!()
    };
    assert!((turn.angle - 1.0).abs() < 1e-6 && (turn.axis - Vec3::Z).length() < 1e-6);
}

#[test]
fn a_matrix_moves_points_and_turns_directions() {
    // A quarter turn about z, then a step of (1, 2, 3): rows of Inventor's matrix.
    let matrix = "0 1 0 0  -1 0 0 0  0 0 1 0  1 2 3 1";
    let transformed = |output: &str| {
        let scene = format!(
            "DEF X Translation {{ translation = TransformVec3f {{ vector 1 0 0 matrix {matrix} }} . {output} }}"
        );
        x(&scene, "translation", 0.0)
    };
    assert_eq!(transformed("point"), Value::Vec3(Vec3::new(1.0, 3.0, 3.0)));
    assert_eq!(transformed("direction"), Value::Vec3(Vec3::Y));
}

#[test]
fn decomposing_gives_the_parts_that_were_put_in() {
    let parts = |output: &str, field: &str, class: &str| {
        let scene = format!(
            "DEF X {class} {{ {field} = DecomposeMatrix {{ matrix = ComposeMatrix {{
               translation 1 2 3 rotation 0 1 0 0.5 scaleFactor 2 3 4 }} . matrix }} . {output} }}"
        );
        x(&scene, field, 0.0)
    };
    assert_eq!(
        parts("translation", "translation", "Translation"),
        Value::Vec3(Vec3::new(1.0, 2.0, 3.0))
    );
    let Value::Rotation(turn) = parts("rotation", "rotation", "Rotation") else {
        panic!()
    };
    assert!((turn.axis * turn.angle - Vec3::new(0.0, 0.5, 0.0)).length() < 1e-5);
    let axis =
        "DEF X Translation { translation = DecomposeRotation { rotation 0 0 2 1.5 } . axis }";
    assert_eq!(x(axis, "translation", 0.0), Value::Vec3(Vec3::Z));
    let angle = "DEF X Cube { width = DecomposeRotation { rotation 0 0 2 1.5 } . angle }";
    assert_eq!(x(angle, "width", 0.0), Value::Float(1.5));
}

#[test]
fn the_sixteen_operations_have_their_truth_tables() {
    // For (a, b) = (F, F), (F, T), (T, F), (T, T).
    let tables = [
        ("CLEAR", "FFFF"),
        ("SET", "TTTT"),
        ("A", "FFTT"),
        ("NOT_A", "TTFF"),
        ("B", "FTFT"),
        ("NOT_B", "TFTF"),
        ("A_OR_B", "FTTT"),
        ("NOT_A_OR_B", "TTFT"),
        ("A_OR_NOT_B", "TFTT"),
        ("NOT_A_OR_NOT_B", "TTTF"),
        ("A_AND_B", "FFFT"),
        ("NOT_A_AND_B", "FTFF"),
        ("A_AND_NOT_B", "FFTF"),
        ("NOT_A_AND_NOT_B", "TFFF"),
        ("A_EQUALS_B", "TFFT"),
        ("A_NOT_EQUALS_B", "FTTF"),
    ];
    for (operation, table) in tables {
        let scene = format!(
            "DEF X LOD {{ range = BoolOperation {{ a [ FALSE, FALSE, TRUE, TRUE ] b [ FALSE, TRUE, FALSE, TRUE ]
               operation {operation} }} . output }}"
        );
        let wanted = table.chars().map(|c| if c == 'T' { 1.0 } else { 0.0 });
        assert_eq!(
            x(&scene, "range", 0.0),
            Value::Floats(wanted.collect()),
            "{operation}"
        );
    }
}

#[test]
fn a_gate_opens_and_a_global_clock_ticks() {
    let gate = r#"DEF X Cube { width 7 = Gate { type "MFFloat" input 3 enable TRUE } . output }"#;
    assert_eq!(x(gate, "width", 0.0), Value::Float(3.0));
    let pulse = r#"DEF X Cube { width 7 = Gate { type "MFFloat" input 3
        trigger = TimeCounter { } . syncOut } . output }"#;
    assert_eq!(x(pulse, "width", 0.5), Value::Float(7.0));
    assert_eq!(x(pulse, "width", 1.5), Value::Float(3.0));
    let clock = r#"DEF X Cube { width = GlobalField { type "SFTime" realTime 0 } . realTime }"#;
    assert_eq!(x(clock, "width", 2.5), Value::Float(2.5));
}
