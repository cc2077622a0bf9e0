//! Tests of reading correct and faulty files.

use std::sync::Arc;

use ivcam_inventor::grammar::{
    class, cone, coordinate3, environment, indexed_face_set, shape_hints, transform, vrml97_group,
    vrml97_shape, vrml97_sphere,
};
use ivcam_inventor::iv::{Document, Limits, Loader, NoFiles, NodeId, Value};

fn read(text: &str) -> Document {
    Document::read(
        "test.iv",
        text.as_bytes().to_vec(),
        Arc::new(NoFiles),
        &Limits::default(),
    )
    .unwrap_or_else(|e| panic!("{}", e.render(false)))
}

/// The messages about a document as text.
pub(super) fn messages(document: &Document) -> Vec<String> {
    document
        .sink
        .items()
        .iter()
        .map(ToString::to_string)
        .collect()
}

fn clean(text: &str) -> Document {
    let document = read(text);
    assert_eq!(messages(&document), Vec::<String>::new());
    document
}

#[test]
fn values_are_read_as_people_wrote_them() {
    let document = clean(
        "#Inventor V2.1 ascii and more\r\nSeparator{ # a comment\r\n\
         Transform { translation +1 .5 1. scaleFactor 1e0, 2 ,3 ~ }\r\
         Coordinate3 { point 1 2 3 }  Coordinate3 { point [ 1 2 3, 4 5 6, ] }\n\
         SoCone { parts (SIDES | BOTTOM) height 0.25 }\n\
         IndexedFaceSet { coordIndex [0x10,1,2,-1,] } }",
    );
    let root = document.roots().next().expect("one root");
    let nodes: Vec<_> = root.children().collect();
    assert_eq!(
        nodes[0].get(transform::TRANSLATION).to_array(),
        [1.0, 0.5, 1.0]
    );
    assert!(nodes[0].acting(transform::SCALE_FACTOR).is_none());
    assert_eq!(nodes[1].get(coordinate3::POINT).len(), 1);
    assert_eq!(nodes[2].get(coordinate3::POINT).len(), 2);
    assert_eq!(nodes[3].get(cone::PARTS), 3);
    assert_eq!(nodes[4].get(indexed_face_set::COORD_INDEX), [16, 1, 2, -1]);
}

#[test]
fn a_use_is_the_same_node_and_the_latest_definition_counts() {
    let document = clean(
        "#Inventor V2.1 ascii\nDEF a+0 Cube {} USE a+0 DEF a+1 Cone {} USE a+0 USE a+1 DEF +2 Sphere {} USE +2 \
         DEF x Cube {} DEF x Cone {} USE x",
    );
    let ids: Vec<NodeId> = document.roots.clone();
    assert_eq!(ids[0], ids[1]);
    assert_eq!(ids[0], ids[3]);
    assert_eq!(ids[2], ids[4]);
    assert_eq!(ids[5], ids[6]);
    assert_eq!(ids[8], ids[9]);
    assert_eq!(document.nodes[ids[0].0 as usize].name.as_deref(), Some("a"));
    assert_eq!(document.nodes[ids[5].0 as usize].name, None);
}

#[test]
fn a_use_inside_a_node_of_the_same_name_takes_the_definition_before() {
    let text = "#Inventor V2.1 ascii\nDEF a Cube { }\nDEF a Group { DEF b Cone { } USE a USE b }\n\
                USE a DEF c Separator { DEF c Sphere { } USE c } USE c";
    let document = clean(text);
    let binary = document.write(ivcam_inventor::iv::Format::Binary);
    let again = Document::read("a.iv", binary, Arc::new(NoFiles), &Limits::default());
    for document in [document, again.expect("reads")] {
        let roots = &document.roots;
        let node = |id: NodeId| &document.nodes[id.0 as usize];
        let group = node(roots[1]);
        assert_eq!(group.children[1], roots[0], "the group is not complete");
        assert_eq!(group.children[2], group.children[0]);
        assert_eq!(
            roots[2], roots[1],
            "the group is complete and later than the cube"
        );
        let inner = node(roots[3]).children.clone();
        assert_eq!(
            [inner[1], roots[4]],
            [inner[0]; 2],
            "the sphere begins last"
        );
        assert!(document.sink.items().is_empty());
    }
}

#[test]
fn a_connection_names_its_engine_and_output() {
    let document = clean(
        "#Inventor V2.1 ascii\nRotation { rotation 0 0 1 0 = DEF e ComposeRotation { axis 0 1 0 } . rotation } \
         Translation { translation = USE e.rotation }",
    );
    for root in document.roots() {
        let connection = root.data().fields[0]
            .connection
            .as_ref()
            .expect("connected");
        assert_eq!(&*connection.output, "rotation");
        assert_eq!(
            document.node(connection.from).class_name(),
            "ComposeRotation"
        );
    }
}

#[test]
fn engines_of_any_type_get_fields_of_that_type() {
    let document = clean(
        "#Inventor V2.1 ascii\nText2 { string = SelectOne { type \"MFString\" index 1 input [ \"a\", b ] } . output \
         } Rotation { rotation = ElapsedTime { timeIn = GlobalField { type \"SFTime\" realTime 3 } . realTime } . timeOut }",
    );
    let select = document
        .nodes
        .iter()
        .position(|n| !n.fields.is_empty() && n.fields.len() == 3);
    let select = document.node(NodeId(select.expect("three fields") as u32));
    assert_eq!(
        select.value("input"),
        Some(&Value::Strings(vec!["a".into(), "b".into()]))
    );
}

#[test]
fn an_unknown_class_is_skipped_and_what_follows_is_read() {
    let document =
        read("#Inventor V2.1 ascii\nSeparator {\n  Widget { a { b \"}\" } c 1 } Cone { }\n}\n");
    let root = document.roots().next().expect("one root");
    let names: Vec<_> = root.children().map(|c| c.class_name()).collect();
    assert_eq!(names, ["Widget", "Cone"]);
    assert_eq!(
        messages(&document),
        ["test.iv:3:3: warning: `Widget` is not a known node class; its contents are skipped"]
    );
}

#[test]
fn a_file_declares_its_own_classes() {
    let document = clean(
        "#Inventor V2.1 ascii\nWidget { fields [ SFFloat width, SoMFString names ] isA [ \"Group\" ] width 2 names x Cube {} }",
    );
    let widget = document.roots().next().expect("one root");
    assert_eq!(widget.value("width"), Some(&Value::Float(2.0)));
    assert_eq!(widget.children().count(), 1);
}

/// SGI's library writes `fields [ SFFloat width, MFString isA ] isA "Cube"`, and neither it nor
/// Coin reads an `isA` that is not among the fields.
#[test]
fn the_base_class_of_a_declared_class_is_among_its_fields() {
    let text = "#Inventor V2.1 ascii
MyCube { fields [ SFFloat width, MFString isA ] isA \"Cube\" width 4 }";
    let document = read(text);
    assert!(document.sink.items().is_empty());
    let in_brackets = read(&text.replace("\"Cube\"", "[ \"Cube\" ]"));
    assert_eq!(document.difference(&in_brackets), None);
    let written =
        String::from_utf8(document.write(ivcam_inventor::iv::Format::Ascii)).expect("text");
    assert!(
        written.contains("fields [ SFFloat width, MFString isA ]\n  isA [ \"Cube\" ]"),
        "{written}"
    );
    assert_eq!(document.losses(ivcam_inventor::iv::Format::Binary), []);
}

#[test]
fn a_wrong_field_costs_only_itself() {
    let document = read(
        "#Inventor V2.1 ascii\nCone {\n  hieght 2\n  bottomRadius x\n  parts LID\n  height 3 }\nCube { }",
    );
    assert_eq!(
        messages(&document),
        [
            "test.iv:3:3: warning: `Cone` has no field `hieght`",
            "test.iv:4:16: damaged: `Cone.bottomRadius`: expected a number, not `x`",
            "test.iv:5:9: warning: `Cone.parts`: `LID` is not one of its values, which are SIDES, BOTTOM, ALL",
        ]
    );
    let cone = document.roots().next().expect("a root");
    assert_eq!((cone.get(cone::HEIGHT), document.roots.len()), (3.0, 2));
    assert_eq!(cone.class_id(), Some(class::CONE));
}

#[test]
fn a_field_that_files_declare_is_named_with_its_declaration() {
    let text = "#Inventor V2.1 ascii\nMaterial { refractionIndex 1.5 }";
    let document = read(text);
    let message = document.sink.items()[0].render(false);
    let remedy = "fields [ SFFloat refractionIndex ] refractionIndex ";
    assert!(message.contains(remedy), "{message}");
    let declared = read(&text.replace("refractionIndex ", remedy));
    assert_eq!(messages(&declared), [""; 0]);
    // A `Material` of VRML97 has no index of refraction.
    let text = "#VRML V2.0 utf8\nShape { appearance Appearance { material
        Material { refractionIndex 1.5 } } geometry Box { } }";
    let message = read(text).sink.items()[0].render(false);
    assert!(!message.contains(remedy), "{message}");
}

#[test]
fn a_suggested_class_can_be_used() {
    let document = read("#Inventor V2.1 ascii\nProfile { index 0 }");
    let message = document.sink.items()[0].render(false);
    assert!(message.contains("`Profile` is not a known node class"));
    assert!(!message.contains("did you mean `Profile`"), "{message}");
}

#[test]
fn a_truncated_file_keeps_what_was_read() {
    let document = read("#Inventor V2.1 ascii\nSeparator {\n  Cone { height 3\n");
    assert_eq!(
        messages(&document),
        ["test.iv:4:1: damaged: the file ends inside the `Cone` that begins on line 3"]
    );
    assert_eq!(
        document.roots().next().map(|r| r.children().count()),
        Some(1)
    );
}

#[test]
fn another_kind_of_file_is_refused_with_what_it_begins_with() {
    let error = Document::read(
        "a.iv",
        b"solid cube\n".to_vec(),
        Arc::new(NoFiles),
        &Limits::default(),
    );
    let message = error.expect_err("not Inventor").to_string();
    assert!(
        message.contains("a.iv") && message.contains("solid cube"),
        "{message}"
    );
}

#[test]
fn classes_and_fog_of_version_1_are_todays() {
    let document = clean(
        "#Inventor V1.0 ascii\nLayerGroup { Environment { fogType EXPONENTIAL fogDensity 0.05 }\n\
         Environment { fogDensity 0.05 fogType LINEAR } IndexedTriangleMesh { } }",
    );
    let group = document.node(document.roots[0]);
    let names: Vec<&str> = group.children().map(|n| n.class_name()).collect();
    assert_eq!(group.class_name(), "Separator");
    assert_eq!(
        names,
        ["Environment", "Environment", "IndexedTriangleStripSet"]
    );
    // As SGI's upgrader: 2 / density for EXPONENTIAL, and 4 / density for LINEAR.
    let visibility = |n: usize| {
        group
            .children()
            .nth(n)
            .unwrap()
            .get(environment::FOG_VISIBILITY)
    };
    assert_eq!([visibility(0), visibility(1)], [40.0, 80.0]);
}

#[test]
fn old_shape_hints_become_new_ones() {
    let document = clean("#Inventor V1.0 ascii\nShapeHints { hints SOLID | ORDERED | CONVEX }");
    let hints = document.roots().next().expect("a root");
    assert_eq!(
        hints.get(shape_hints::SHAPE_TYPE),
        shape_hints::SHAPE_TYPE_SOLID
    );
    assert_eq!(
        hints.get(shape_hints::VERTEX_ORDERING),
        shape_hints::VERTEX_ORDERING_COUNTERCLOCKWISE
    );
}

#[test]
fn a_node_inside_itself_is_cut() {
    let document = read("#Inventor V2.1 ascii\nDEF a Separator { Group { USE a } Cube {} }");
    assert!(messages(&document)[0].contains("contains itself"));
}

#[test]
fn a_hundred_thousand_nested_separators_are_read_and_dropped() {
    let n = 100_000;
    let text = format!(
        "#Inventor V2.1 ascii\n{}Cube {{}}{}",
        "Separator {".repeat(n),
        "}".repeat(n)
    );
    assert_eq!(clean(&text).nodes.len(), n + 1);
}

/// Files by name, in memory.
#[derive(Debug)]
struct Shelf(&'static [(&'static str, &'static str)]);

impl Loader for Shelf {
    fn load(&self, _: &str, reference: &str) -> ivcam_base::diag::Result<(String, Vec<u8>)> {
        let found = self.0.iter().find(|(name, _)| *name == reference);
        found
            .map(|(name, text)| ((*name).to_owned(), text.as_bytes().to_vec()))
            .ok_or_else(|| {
                ivcam_base::diag::Diagnostic::error(format!("`{reference}` was not found"))
            })
    }
}

#[test]
fn a_file_that_includes_another_has_its_nodes_as_children() {
    let shelf = Shelf(&[("b.iv", "#VRML V1.0 ascii\nCube {} Sphere {}")]);
    let text = b"#Inventor V2.1 ascii\nFile { name \"b.iv\" }".to_vec();
    let document =
        Document::read("a.iv", text, Arc::new(shelf), &Limits::default()).expect("reads");
    let names: Vec<_> = document
        .roots()
        .flat_map(|r| r.children())
        .map(|c| c.class_name())
        .collect();
    assert_eq!(names, ["Cube", "Sphere"]);
}

#[test]
fn files_that_include_each_other_end() {
    let shelf = Shelf(&[
        ("b.iv", "#Inventor V2.1 ascii\nFile { name \"c.iv\" }"),
        ("c.iv", "#Inventor V2.1 ascii\nFile { name \"b.iv\" }"),
    ]);
    let text = b"#Inventor V2.1 ascii\nFile { name \"b.iv\" } File { name \"c.iv\" }".to_vec();
    let document =
        Document::read("a.iv", text, Arc::new(shelf), &Limits::default()).expect("reads");
    assert!(
        messages(&document)
            .iter()
            .any(|m| m.contains("includes itself"))
    );
}

#[test]
fn included_files_beyond_the_limit_of_bytes_are_left_out() {
    let shelf = Shelf(&[
        (
            "b.iv",
            "#Inventor V2.1 ascii\nCube { } # a comment of some length",
        ),
        (
            "c.iv",
            "#Inventor V2.1 ascii\nCone { } # a comment of some length",
        ),
    ]);
    let text = b"#Inventor V2.1 ascii\nFile { name \"b.iv\" } File { name \"c.iv\" } File { name \"b.iv\" }";
    let limits = Limits {
        bytes: 150,
        ..Limits::default()
    };
    let document = Document::read("a.iv", text.to_vec(), Arc::new(shelf), &limits).expect("reads");
    let names: Vec<_> = document
        .roots()
        .flat_map(|r| r.children())
        .map(|c| c.class_name())
        .collect();
    assert_eq!(names, ["Cube", "Cube"]);
    let messages = messages(&document);
    assert_eq!(messages.len(), 1);
    assert!(messages[0].contains("more than 150 bytes"), "{messages:?}");
}

fn read97(text: &str) -> Document {
    clean(&format!("#VRML V2.0 utf8\n{text}"))
}

#[test]
fn an_instance_of_a_proto_is_its_body_with_its_fields_filled_in() {
    let document = read97(
        "PROTO Ball [ field SFFloat size 2 exposedField SFColor color 1 0 0 eventIn SFFloat set_size ] {
           Shape { geometry Sphere { radius IS size }
             appearance Appearance { material Material { diffuseColor IS color } } } }
         Ball { size 3 } Ball { }",
    );
    let radii: Vec<f32> = document
        .roots()
        .map(|ball| {
            assert_eq!(ball.class_id(), Some(class::VRML97_SHAPE));
            let geometry = ball.get(vrml97_shape::GEOMETRY).expect("has one");
            document.node(geometry).get(vrml97_sphere::RADIUS)
        })
        .collect();
    assert_eq!(radii, [3.0, 2.0]);
}

#[test]
fn protos_in_protos_pass_their_fields_on() {
    let document = read97(
        "PROTO Inner [ field SFFloat r 1 ] { Sphere { radius IS r } }
         PROTO Outer [ field SFFloat s 5 field SFNode n NULL ] { Group { children [ Shape { geometry Inner { r IS s } } ] } }
         Outer { s 7 }",
    );
    let group = document.roots().next().expect("a root");
    let shape = document.node(group.get(vrml97_group::CHILDREN)[0]);
    let sphere = document.node(shape.get(vrml97_shape::GEOMETRY).expect("has one"));
    assert_eq!(sphere.get(vrml97_sphere::RADIUS), 7.0);
}

#[test]
fn a_route_to_an_instance_leads_to_the_node_in_its_body() {
    let document = read97(
        "PROTO Mover [ eventIn SFVec3f move eventOut SFTime t ] { Transform { set_translation IS move } }
         DEF m Mover { } DEF p PositionInterpolator { key [ 0 1 ] keyValue [ 0 0 0 1 1 1 ] }
         ROUTE p.value_changed TO m.move",
    );
    assert_eq!(
        (document.routes.len(), document.stated_routes.len()),
        (1, 1)
    );
    assert_eq!(
        document.node(document.routes[0].to).class_name(),
        "Transform"
    );
    assert_eq!(&*document.routes[0].input, "set_translation");
}

#[test]
fn an_externproto_takes_its_body_from_another_file() {
    let lib = "#VRML V2.0 utf8\nPROTO Other [] { Cone {} } PROTO Box1 [ field SFVec3f s 1 1 1 ] { Box { size IS s } }";
    let shelf: &'static [_] = Box::leak(Box::new([("lib.wrl#Box1", lib)]));
    let text = b"#VRML V2.0 utf8\nEXTERNPROTO Mine [ field SFVec3f s ] \"lib.wrl#Box1\"\nShape { geometry Mine { s 1 2 3 } }";
    let document = Document::read(
        "a.wrl",
        text.to_vec(),
        Arc::new(Shelf(shelf)),
        &Limits::default(),
    )
    .expect("reads");
    assert_eq!(messages(&document), Vec::<String>::new());
    let shape = document.roots().next().expect("a root");
    let geometry = document.node(shape.get(vrml97_shape::GEOMETRY).expect("has one"));
    assert_eq!(geometry.class_name(), "Box");
}

/// Returns the radius of the only sphere in a file that has a library beside it, and the messages.
fn ball_beside_a_library(text: &str) -> (Option<f32>, Vec<String>) {
    let lib = "#VRML V2.0 utf8\nPROTO Ball [ field SFFloat r 1 ] { Sphere { radius IS r } }";
    let shelf: &'static [_] = Box::leak(Box::new([("lib.wrl", lib), ("lib.wrl#Ball", lib)]));
    let text = format!("#VRML V2.0 utf8\n{text}");
    let limits = Limits::default();
    let document = Document::read("a.wrl", text.into_bytes(), Arc::new(Shelf(shelf)), &limits);
    let document = document.expect("reads");
    let shape = document.roots().last().expect("a root");
    let geometry = document.node(shape.get(vrml97_shape::GEOMETRY).expect("has one"));
    let is_sphere = geometry.class_name() == "Sphere";
    let radius = is_sphere.then(|| geometry.get(vrml97_sphere::RADIUS));
    (radius, messages(&document))
}

#[test]
fn of_several_urls_the_first_that_has_the_definition_counts() {
    let (radius, told) = ball_beside_a_library(
        "EXTERNPROTO Ball [ field SFFloat r ] [ \"gone.wrl#Ball\" \"urn:none:x\" \"lib.wrl#Ball\" ]
         Shape { geometry Ball { r 4 } }",
    );
    assert_eq!((radius, told), (Some(4.0), Vec::new()));
}

#[test]
fn without_a_definition_the_earlier_proto_is_used_or_nothing_is_drawn() {
    let gone = "EXTERNPROTO Ball [ field SFFloat r ] \"gone.wrl#Ball\"";
    let ball = "Shape { geometry Ball { r 4 } }";
    let local = "PROTO Ball [ field SFFloat r 1 ] { Sphere { radius IS r } }";
    let (radius, told) = ball_beside_a_library(&format!("{local}\n{gone}\n{ball}"));
    assert_eq!(radius, Some(4.0));
    assert_eq!(
        told,
        [
            "a.wrl:3:38: warning: the definition of `Ball` was not found; the earlier `PROTO` is used"
        ]
    );
    let (radius, told) = ball_beside_a_library(&format!("{gone}\n{ball}"));
    assert_eq!(radius, None);
    assert_eq!(
        told,
        ["a.wrl:2:38: warning: the definition of `Ball` was not found; its nodes are not drawn"]
    );
}

#[test]
fn a_script_has_the_fields_it_declares() {
    let document = read97(
        "DEF s Script { url \"javascript:\" field SFFloat k 3 eventIn SFTime now eventOut SFBool on field SFNode me USE s }",
    );
    let script = document.roots().next().expect("a root");
    assert_eq!(script.value("k"), Some(&Value::Float(3.0)));
    assert_eq!(script.class_name(), "Script");
}

#[test]
fn a_binary_file_with_a_count_beyond_its_end_is_reported() {
    let mut bytes = b"#Inventor V2.1 binary  \n".to_vec();
    let string = |bytes: &mut Vec<u8>, text: &str| {
        bytes.extend((text.len() as u32).to_be_bytes());
        bytes.extend(text.bytes());
        bytes.resize(bytes.len().next_multiple_of(4), 0);
    };
    string(&mut bytes, "Coordinate3");
    bytes.extend([0, 0, 0, 0, 0, 0, 0, 1]);
    string(&mut bytes, "point");
    bytes.extend([0xff; 4]);
    let document =
        Document::read("b.iv", bytes, Arc::new(NoFiles), &Limits::default()).expect("reads");
    assert!(
        messages(&document)[0].contains("4294967295 values are declared"),
        "{:?}",
        messages(&document)
    );
}

/// A file that is read past a missing byte would show something else without a word.
#[test]
fn a_byte_that_is_missing_anywhere_in_a_binary_file_is_damage() {
    let scene = read(
        "#Inventor V2.1 ascii\nSeparator { Material { diffuseColor [ 1 0 0, 0 1 0 ] }
         DEF box Cube { width 3 } Coordinate3 { point [ 1 2 3, 4 5 6 ] } Info { string \"a\" } }",
    );
    let bytes = scene.write(ivcam_inventor::iv::Format::Binary);
    let header = bytes
        .iter()
        .position(|&b| b == b'\n')
        .expect("a first line")
        + 1;
    for missing in header..bytes.len() {
        let mut cut = bytes.clone();
        cut.remove(missing);
        let document =
            Document::read("b.iv", cut, Arc::new(NoFiles), &Limits::default()).expect("reads");
        let found = document.sink.items().iter().any(|d| d.class() == "damaged");
        assert!(found, "byte {missing}: {:?}", messages(&document));
    }
}

#[test]
fn a_message_quotes_the_beginning_of_a_name_that_a_damaged_file_makes_long() {
    let mut bytes = b"#Inventor V2.1 binary  \n".to_vec();
    packed(&mut bytes, "Cone");
    bytes.extend([0, 0, 0, 0, 0, 0, 0, 1]);
    packed(&mut bytes, &format!("height\u{1}{}", "x".repeat(2000)));
    let document =
        Document::read("b.iv", bytes, Arc::new(NoFiles), &Limits::default()).expect("reads");
    let name = format!("height\u{fffd}{}…", "x".repeat(33));
    let message = format!("`Cone` has no field `{name}`, so the end of the field is unknown");
    assert!(
        messages(&document)[0].ends_with(&message),
        "{:?}",
        messages(&document)
    );
    let long = "Y".repeat(3000);
    let text = read(&format!(
        "#Inventor V2.1 ascii\n{long} {{ a 1 }} Cube {{ {long} 2 }} USE {long}"
    ));
    assert_eq!(messages(&text).len(), 3);
    assert!(
        messages(&text).iter().all(|said| said.len() < 150),
        "{:?}",
        messages(&text)
    );
}

#[test]
fn nan_and_infinity_are_reported_by_field_and_kept() {
    let document = read(
        "#Inventor V2.1 ascii\nCone { height nan }\nCoordinate3 { point [ 0 0 0, 1 -inf 2 ] }",
    );
    assert_eq!(
        messages(&document),
        [
            "test.iv:2:15: warning: `Cone.height` has a number that is NaN or infinite",
            "test.iv:3:32: warning: `Coordinate3.point` has a number that is NaN or infinite"
        ]
    );
}

#[test]
fn numbers_beyond_16_bits_are_reported_and_the_nearest_that_fits_counts() {
    use ivcam_inventor::grammar::{array, draw_style};
    let document = read(
        "#Inventor V2.1 ascii\nArray { numElements1 70000 numElements2 -40000 numElements3 9 }\n\
         DrawStyle { linePattern 0x1ffff }",
    );
    let what = "has a number beyond 16 bits; the nearest that fits is used";
    let places = [
        "2:9: warning: `Array.numElements1`",
        "2:28: warning: `Array.numElements2`",
    ];
    let mut expected = places.map(|p| format!("test.iv:{p} {what}")).to_vec();
    expected.push(format!(
        "test.iv:3:13: warning: `DrawStyle.linePattern` {what}"
    ));
    assert_eq!(messages(&document), expected);
    let roots: Vec<_> = document.roots().collect();
    assert_eq!(roots[0].get(array::NUM_ELEMENTS1), i16::MAX);
    assert_eq!(roots[0].get(array::NUM_ELEMENTS2), i16::MIN);
    assert_eq!(roots[0].get(array::NUM_ELEMENTS3), 9);
    assert_eq!(roots[1].get(draw_style::LINE_PATTERN), u16::MAX);
}

#[test]
fn a_large_file_gives_the_nodes_and_messages_of_its_bytes() {
    let mut text = String::from("#Inventor V2.1 ascii\nCoordinate3 { point [\n");
    for i in 0..84_000 {
        text += &format!("{i}, {} -.5e-1{:200}\n", i % 7, "");
    }
    text += "] }\nCone { hieght 2 }\nCoordinate3 { point [ 1 nan 3, 4 oops ] }\n";
    assert!(text.len() > 16 << 20);
    let path = std::env::temp_dir().join(format!("ivcam-large-{}.iv", std::process::id()));
    std::fs::write(&path, &text).expect("a folder for temporary files");
    let by_path = Document::open(&path).expect("the header is right");
    let (bytes, name) = (text.into_bytes(), path.display().to_string());
    let by_bytes = Document::read(&name, bytes, Arc::new(NoFiles), &Limits::default());
    let by_bytes = by_bytes.expect("the header is right");
    assert_eq!(by_path.difference(&by_bytes), None);
    assert_eq!(messages(&by_path), messages(&by_bytes));
    assert_eq!(messages(&by_path).len(), 3);
    let first = by_path.roots().next().expect("three nodes");
    assert_eq!(first.get(coordinate3::POINT).len(), 84_000);
    std::fs::remove_file(&path).expect("it was written");
}

#[test]
fn a_gzip_bomb_stops_at_the_limit() {
    use std::io::Write as _;
    let mut gz = flate2::write::GzEncoder::new(Vec::new(), flate2::Compression::best());
    gz.write_all(b"#Inventor V2.1 ascii\n").expect("in memory");
    gz.write_all(&vec![b' '; 8 << 20]).expect("in memory");
    let bytes = gz.finish().expect("in memory");
    let limits = Limits {
        bytes: 1 << 20,
        ..Limits::default()
    };
    let error =
        Document::read("bomb.iv.gz", bytes, Arc::new(NoFiles), &limits).expect_err("too big");
    assert!(
        error.to_string().contains("larger than 1048576 bytes"),
        "{error}"
    );
}

#[test]
fn protos_that_double_at_every_step_stop_at_the_limit() {
    let mut text = String::from("#VRML V2.0 utf8\nPROTO P0 [ ] { Group { } }\n");
    for i in 1..64 {
        let inner = i - 1;
        text += &format!(
            "PROTO P{i} [ ] {{ Group {{ children [ P{inner} {{ }} P{inner} {{ }} ] }} }}\n"
        );
    }
    text += "P63 { }";
    let limits = Limits {
        copies: 10_000,
        ..Limits::default()
    };
    let error = Document::read("p.wrl", text.into_bytes(), Arc::new(NoFiles), &limits)
        .expect_err("too many");
    assert!(
        error.to_string().contains("more than 10000 nodes"),
        "{error}"
    );
}

/// The body of a proto and the default of its interface each have a list of 24 kB.
#[test]
fn protos_with_long_lists_stop_at_the_limit_of_bytes() {
    let list = "1 2 3, ".repeat(2000);
    let protos = [
        format!("PROTO P [ ] {{ Coordinate {{ point [ {list} ] }} }}"),
        format!("PROTO P [ field MFVec3f p [ {list} ] ] {{ Coordinate {{ point IS p }} }}"),
    ];
    for proto in protos {
        let read = |instances: usize| {
            let text = format!("#VRML V2.0 utf8\n{proto}\n{}", "P { } ".repeat(instances));
            let limits = Limits {
                bytes: 1 << 20,
                ..Limits::default()
            };
            Document::read("p.wrl", text.into_bytes(), Arc::new(NoFiles), &limits)
        };
        assert!(read(40).is_ok());
        let error = read(100).expect_err("too many").to_string();
        assert!(
            error.contains("expand to more than 1048576 bytes"),
            "{error}"
        );
    }
}

#[test]
fn numbers_are_read_to_the_nearest_float() {
    let texts = [
        "16777217",
        "1.00000005960464477540",
        "3.4028235e38",
        "1e-45",
        "1e39",
        "0.1",
        "7.0064923216240854e-46",
        "123456789012345678901234567890",
        "1.17549435e-38",
        "2.2250738585072011e-308",
    ];
    for text in texts {
        let document = read(&format!("#Inventor V2.1 ascii\nCone {{ height {text} }}"));
        assert_eq!(messages(&document).is_empty(), text != "1e39", "{text}");
        let read = document.roots().next().map(|c| c.get(cone::HEIGHT));
        assert_eq!(read, text.parse().ok(), "{text}");
    }
}

#[test]
fn what_was_skipped_is_written_as_the_file_had_it() {
    let text = "#Inventor V2.1 ascii\nDEF w Widget { a { b \"}\" } c 1 }";
    let written =
        String::from_utf8(read(text).write(ivcam_inventor::iv::Format::Ascii)).expect("text");
    assert!(
        written.contains("DEF w Widget { a { b \"}\" } c 1 }"),
        "{written}"
    );
}

/// Writes a string of the binary formats: its length, its bytes, padded to a multiple of four.
fn packed(bytes: &mut Vec<u8>, text: &str) {
    bytes.extend((text.len() as u32).to_be_bytes());
    bytes.extend(text.bytes());
    bytes.resize(bytes.len().next_multiple_of(4), 0);
}

#[test]
fn binary_of_the_first_version_has_no_flags_on_its_nodes() {
    for version in ["V1.0", "V2.0"] {
        let mut bytes = format!("#Inventor {version} binary  \n").into_bytes();
        packed(&mut bytes, "Separator");
        if version == "V2.0" {
            bytes.extend([0; 4]); // No fields; V1.0 has no such number for a group without any.
        }
        bytes.extend([0, 0, 0, 1]); // one child
        packed(&mut bytes, "Cone");
        bytes.extend([0, 0, 0, 1]); // one field
        packed(&mut bytes, "height");
        bytes.extend(3.0f32.to_be_bytes());
        bytes.extend([0; 4]); // not ignored, not connected
        if version == "V1.0" {
            bytes.extend([0xff; 4]); // the end of the children, as SGI's library reads it
        }
        let document =
            Document::read("b.iv", bytes, Arc::new(NoFiles), &Limits::default()).expect("reads");
        assert_eq!(messages(&document), Vec::<String>::new(), "{version}");
        let root = document.roots().next().expect("a root");
        let cone = root.children().next().expect("a child");
        assert_eq!(cone.get(cone::HEIGHT), 3.0, "{version}");
    }
}

#[test]
fn a_field_of_a_binary_file_that_holds_its_default_may_be_connected() {
    let mut bytes = b"#Inventor V2.1 binary  \n".to_vec();
    let word = |bytes: &mut Vec<u8>, n: u32| bytes.extend(n.to_be_bytes());
    packed(&mut bytes, "Cone");
    word(&mut bytes, 0); // a node without children
    word(&mut bytes, 1); // one field
    packed(&mut bytes, "height");
    bytes.extend(2.0f32.to_be_bytes());
    word(&mut bytes, 6); // connected, and at its default
    packed(&mut bytes, "ElapsedTime");
    word(&mut bytes, 1); // an engine
    word(&mut bytes, 0); // no fields
    packed(&mut bytes, "timeOut");
    let document =
        Document::read("b.iv", bytes, Arc::new(NoFiles), &Limits::default()).expect("reads");
    assert_eq!(messages(&document), Vec::<String>::new());
    let text = String::from_utf8(document.write(ivcam_inventor::iv::Format::Ascii)).expect("text");
    let words: Vec<&str> = text.split_whitespace().collect();
    let words = words.join(" ");
    assert!(
        words.contains("height 2 = ElapsedTime { } . timeOut"),
        "{text}"
    );
}

/// Reads a binary file that must have no messages.
fn clean_binary(bytes: Vec<u8>) -> Document {
    let document =
        Document::read("b.iv", bytes, Arc::new(NoFiles), &Limits::default()).expect("reads");
    assert_eq!(messages(&document), Vec::<String>::new());
    document
}

/// SGI's library writes nothing between the pixels and the flags of the field, Coin zeros up to a
/// multiple of four.
#[test]
fn a_binary_image_of_any_size_is_read_with_coins_padding_and_without() {
    let ends = [
        "} Cube { width 3 }",
        "wrapS CLAMP }",
        "} Group { } Group { Sphere { } }",
        "}",
    ];
    for end in ends {
        for (width, height, components) in [(1, 1, 1), (1, 1, 2), (1, 1, 3), (5, 3, 3), (2, 2, 3)] {
            let pixels = vec!["0x7f"; width * height].join(" ");
            let scene = clean(&format!(
                "#Inventor V2.1 ascii\nSeparator {{ Separator {{ Texture2 {{
                 image {width} {height} {components} {pixels} {end} }} }}"
            ));
            let unpadded = scene.write(ivcam_inventor::iv::Format::Binary);
            assert_eq!(scene.difference(&clean_binary(unpadded.clone())), None);
            let size = width * height * components;
            let name = unpadded.windows(5).position(|w| w == b"image");
            let after = name.expect("the field") + 8 + 12 + size;
            let padding = vec![0; size.next_multiple_of(4) - size];
            let padded = [&unpadded[..after], &padding, &unpadded[after..]].concat();
            assert_eq!(
                scene.difference(&clean_binary(padded)),
                None,
                "{size} {end}"
            );
        }
    }
}

#[test]
fn pixels_are_followed_at_once_by_the_flags_of_their_field_as_sgis_library_writes_them() {
    let scene = clean("#Inventor V2.1 ascii\nTexture2 { image 1 1 3 0x7f7f7f }");
    let bytes = scene.write(ivcam_inventor::iv::Format::Binary);
    assert!(bytes.ends_with(&[0, 0, 0, 3, 0x7f, 0x7f, 0x7f, 0, 0, 0, 0]));
}

/// The number of fields of a `GlobalField` is 0 in files of SGI's library and 1 in Coin's.
#[test]
fn a_binary_global_field_has_one_field_whatever_its_number() {
    let scene = clean(
        "#Inventor V2.1 ascii\nSeparator { Cube { width = GlobalField { type \"SFFloat\" own 3 }
         . own } Sphere { } }",
    );
    let bytes = scene.write(ivcam_inventor::iv::Format::Binary);
    let kind = bytes.windows(8).position(|w| w == b"SFFloat\0");
    let number = kind.expect("the type") + 8;
    assert_eq!(bytes[number..number + 4], [0, 0, 0, 1]);
    let mut of_sgi = bytes.clone();
    of_sgi[number + 3] = 0;
    for bytes in [bytes, of_sgi] {
        assert_eq!(scene.difference(&clean_binary(bytes)), None);
    }
}

#[test]
fn old_texture_planes_become_directions() {
    use ivcam_inventor::grammar::{texture_coordinate_plane as plane, texture2_transform};
    let document = clean(
        "#Inventor V1.0 ascii\nSeparator {
         TextureCoordinatePlane { coord S normal 0 2 0 repeatInterval 4 }
         TextureCoordinatePlane { coord T normal 0 0 1 distanceFromOrigin 3 repeatInterval 2 } Cube { } }",
    );
    let root = document.roots().next().expect("a root");
    let nodes: Vec<_> = root.children().collect();
    let both = |i: usize| {
        let node = &nodes[i];
        (
            node.get(plane::DIRECTION_S).to_array(),
            node.get(plane::DIRECTION_T).to_array(),
        )
    };
    assert_eq!(both(0), ([0.0, 0.25, 0.0], [0.0, 1.0, 0.0]));
    assert_eq!(both(1), ([0.0, 0.25, 0.0], [0.0, 0.0, 0.5]));
    let shift = nodes[2].get(texture2_transform::TRANSLATION);
    assert_eq!(shift.to_array(), [0.0, 1.5]);
    assert_eq!(nodes[3].class_name(), "Cube");
}

/// A folder with a project, a scene in it, and files in and outside the project.
#[cfg(unix)]
struct Project {
    top: std::path::PathBuf,
    file: std::path::PathBuf,
}

#[cfg(unix)]
impl Project {
    /// Makes `project/models/a.iv` with files beside it, above it, and outside the project.
    fn new(name: &str) -> Self {
        let top = std::env::temp_dir().join(format!("ivcam-{name}-{}", std::process::id()));
        let models = top.join("project/models");
        let part = "#Inventor V2.1 ascii\nCube { }";
        for file in ["models/parts/own.iv", "models/beside.iv", "maps/map.iv"] {
            let file = top.join("project").join(file);
            std::fs::create_dir_all(file.parent().expect("a folder")).expect("a folder");
            std::fs::write(file, part).expect("written");
        }
        std::fs::create_dir_all(top.join("outside")).expect("a folder");
        std::fs::write(top.join("outside/secret.iv"), part).expect("written");
        let link = std::os::unix::fs::symlink::<_, std::path::PathBuf>;
        link(top.join("outside/secret.iv"), models.join("link.iv")).expect("a link");
        link(top.join("outside"), models.join("folder")).expect("a link");
        let file = models.join("a.iv");
        Self { top, file }
    }

    /// Whether a file that the scene names is opened, and the message and the help if it is not.
    fn opened(
        &self,
        name: &str,
        search: &[&str],
        contain: Option<&str>,
    ) -> Result<(), [String; 2]> {
        let text = format!("#Inventor V2.1 ascii\nFile {{ name \"{name}\" }}");
        std::fs::write(&self.file, text).expect("written");
        let search: Vec<_> = search.iter().map(|f| self.top.join(f)).collect();
        let search: Vec<&std::path::Path> = search.iter().map(AsRef::as_ref).collect();
        let contain = contain.map(|f| self.top.join(f));
        let limits = Limits::default();
        let document = Document::open_or_stdin(&self.file, &search, contain.as_deref(), &limits);
        let document = document.expect("reads");
        if document.roots().any(|r| r.children().count() > 0) {
            return Ok(());
        }
        let said = &document.sink.items()[0];
        Err([said.message.clone(), said.help.clone().unwrap_or_default()])
    }
}

#[cfg(unix)]
impl Drop for Project {
    fn drop(&mut self) {
        let _ = std::fs::remove_dir_all(&self.top);
    }
}

#[test]
#[cfg(unix)]
fn only_files_of_the_scenes_project_and_the_search_paths_are_opened() {
    let project = Project::new("project");
    for name in [
        "beside.iv",
        "parts/own.iv",
        "parts/../parts/own.iv",
        "../maps/map.iv",
        "../models/../maps/map.iv",
    ] {
        assert_eq!(project.opened(name, &[], None), Ok(()), "{name}");
    }
    let real = |folder: &str| project.top.join(folder).canonicalize().expect("a folder");
    let (root, outside) = (real("project"), real("outside"));
    let absolute = project.top.join("outside/secret.iv").display().to_string();
    for name in [
        "../../outside/secret.iv",
        "parts/../../../outside/secret.iv",
        "../maps/../../outside/secret.iv",
        "link.iv",
        "folder/secret.iv",
        "../models/folder/secret.iv",
        &absolute,
    ] {
        let message = format!("`{name}` is outside the scene's project folder and is not opened");
        let help = format!(
            "files below `{}` are opened; `--search {}` allows the files below that folder",
            root.display(),
            outside.display()
        );
        assert_eq!(
            project.opened(name, &[], None),
            Err([message, help]),
            "{name}"
        );
        assert_eq!(project.opened(name, &["outside"], None), Ok(()), "{name}");
    }
}

#[test]
#[cfg(unix)]
fn a_marker_widens_and_contain_narrows_what_is_opened() {
    let project = Project::new("contain");
    let opened = |name: &str, contain: Option<&str>| project.opened(name, &[], contain).is_ok();
    let (map, secret) = ("../maps/map.iv", "../../outside/secret.iv");
    assert!(opened(map, None) && !opened(secret, None));
    let models = Some("project/models");
    assert!(opened("beside.iv", models) && opened("parts/own.iv", models));
    assert!(!opened(map, models) && !opened("link.iv", models));
    assert!(!opened("beside.iv", Some("project/models/parts")));
    assert!(opened(secret, Some("")), "the user chose the folder above");
    let [message, _] = project.opened(map, &[], models).unwrap_err();
    let what = "is outside the folder that may be read and is not opened";
    assert_eq!(message, format!("`{map}` {what}"));
    assert_eq!(project.opened(map, &["project/maps"], models), Ok(()));
    std::fs::write(project.top.join(".ivcam-project"), "").expect("written");
    assert!(opened(secret, None), "the marker is above both");
    std::fs::write(project.top.join("project/models/.ivcam-project"), "").expect("written");
    assert!(!opened(map, None), "the nearest marker counts");
    let nowhere = project.top.join("nowhere");
    let error = Document::open_or_stdin(&project.file, &[], Some(&nowhere), &Limits::default());
    let message = error.unwrap_err().message;
    assert_eq!(
        message,
        format!("there is no folder `{}`", nowhere.display())
    );
}
