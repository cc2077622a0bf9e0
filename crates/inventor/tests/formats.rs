//! Files of other formats than Inventor's and VRML's, read as nodes of X3D.

use std::collections::BTreeMap;
use std::sync::Arc;

use glam::{Vec2, Vec3, Vec4};
use ivcam_base::diag::{Diagnostic, Result};
use ivcam_inventor::grammar::value::Value;
use ivcam_inventor::grammar::{
    appearance, class, color, color_rgba, coordinate, indexed_triangle_set, metadata_boolean,
    physical_material, texture_coordinate, time_sensor, vrml_light,
    vrml97_indexed_face_set as faces97, vrml97_material, vrml97_normal, vrml97_shape,
    vrml97_spot_light as spot97, vrml97_transform,
};
use ivcam_inventor::iv::{Document, Format, LINEAR_LIGHT, Limits, Loader, NoFiles, NodeRef};
use ivcam_inventor::snapshot::Snapshot;

use super::iv::messages;

/// A loader of files in memory.
#[derive(Debug)]
struct Files(BTreeMap<&'static str, Vec<u8>>);

impl Loader for Files {
    fn load(&self, _: &str, reference: &str) -> Result<(String, Vec<u8>)> {
        match self.0.get(reference) {
            Some(bytes) => Ok((reference.into(), bytes.clone())),
            None => Err(Diagnostic::not_found(format!(
                "`{reference}` was not found"
            ))),
        }
    }
}

fn read(bytes: impl Into<Vec<u8>>) -> Document {
    let bytes = bytes.into();
    Document::read("a", bytes, Arc::new(NoFiles), &Limits::default()).expect("reads")
}

/// Reads a document that must have no messages.
fn read_clean(bytes: impl Into<Vec<u8>>) -> Document {
    let document = read(bytes);
    assert_eq!(messages(&document), Vec::<String>::new());
    document
}

/// The document as X3D's classic encoding.
fn classic(document: &Document) -> String {
    String::from_utf8(document.write(Format::Ascii)).expect("text")
}

/// All nodes of a class, in the order of the file.
fn nodes<'a>(document: &'a Document, class: &str) -> Vec<NodeRef<'a>> {
    let all = (0..document.nodes.len()).map(|i| ivcam_inventor::iv::NodeId(i as u32));
    all.map(|id| NodeRef { document, id })
        .filter(|node| node.class_name() == class)
        .collect()
}

/// The same scene in XML and in the classic encoding, with what VRML97 writes otherwise.
const XML: &str = r#"<?xml version="1.0" encoding="UTF-8"?>
<!DOCTYPE X3D PUBLIC "ISO//Web3D//DTD X3D 3.3//EN" "http://www.web3d.org/specifications/x3d-3.3.dtd">
<X3D profile='Immersive' version='3.3'>
  <head><meta name='title' content='a "quoted" title'/></head>
  <Scene>
    <ProtoDeclare name='Ball'>
      <ProtoInterface>
        <field name='size' type='SFFloat' accessType='initializeOnly' value='2'/>
        <field name='look' type='SFNode' accessType='inputOutput'/>
      </ProtoInterface>
      <ProtoBody>
        <Shape>
          <IS><connect nodeField='appearance' protoField='look'/></IS>
          <Sphere><IS><connect nodeField='radius' protoField='size'/></IS></Sphere>
        </Shape>
      </ProtoBody>
    </ProtoDeclare>
    <Switch DEF='S' whichChoice='1'>
      <Group/>
      <ProtoInstance name='Ball'>
        <fieldValue name='size' value='3'/>
        <fieldValue name='look'><Appearance><Material DEF='M' diffuseColor='1 0 0'/></Appearance></fieldValue>
      </ProtoInstance>
    </Switch>
    <Transform DEF='T' translation='1 2 3'>
      <Shape>
        <Appearance><Material USE='M'/></Appearance>
        <IndexedTriangleSet index='0 1 2'><Coordinate point='0 0 0, 1 0 0, 0 1 0'/></IndexedTriangleSet>
      </Shape>
      <Shape><Text string='"a" "b &amp; c"'><FontStyle style='BOLD'/></Text></Shape>
    </Transform>
    <TimeSensor DEF='C' loop='true'/>
    <PositionInterpolator DEF='P' key='0 1' keyValue='0 0 0 4 0 0'/>
    <ROUTE fromNode='C' fromField='fraction_changed' toNode='P' toField='set_fraction'/>
    <ROUTE fromNode='P' fromField='value_changed' toNode='T' toField='set_translation'/>
  </Scene>
</X3D>"#;

const CLASSIC: &str = r#"#X3D V3.3 utf8
PROFILE Immersive
META "title" "a \"quoted\" title"
PROTO Ball [ initializeOnly SFFloat size 2 inputOutput SFNode look NULL ] {
  Shape { appearance IS look geometry Sphere { radius IS size } }
}
DEF S Switch { whichChoice 1 children [ Group { } Ball { size 3 look Appearance { material DEF M Material { diffuseColor 1 0 0 } } } ] }
DEF T Transform { translation 1 2 3 children [
  Shape { appearance Appearance { material USE M }
    geometry IndexedTriangleSet { index [ 0 1 2 ] coord Coordinate { point [ 0 0 0, 1 0 0, 0 1 0 ] } } }
  Shape { geometry Text { string [ "a" "b & c" ] fontStyle FontStyle { style "BOLD" } } }
] }
DEF C TimeSensor { loop TRUE }
DEF P PositionInterpolator { key [ 0 1 ] keyValue [ 0 0 0 4 0 0 ] }
ROUTE C.fraction_changed TO P.set_fraction
ROUTE P.value_changed TO T.set_translation
"#;

#[test]
fn x3d_is_the_same_in_xml_and_in_the_classic_encoding() {
    let (xml, text) = (read_clean(XML), read_clean(CLASSIC));
    assert_eq!(classic(&xml), classic(&text));
    assert_eq!(
        xml.meta,
        [("title".to_owned(), "a \"quoted\" title".to_owned())]
    );
    assert_eq!(xml.stated_routes.len(), 2);
    let again = read_clean(classic(&text));
    assert_eq!(text.difference(&again), None);
}

#[test]
fn nodes_of_xml_have_the_places_of_their_elements() {
    let document = read_clean(XML);
    let material = nodes(&document, "Material")[0];
    let at = material.span().start as usize;
    assert!(
        XML[at..].starts_with("<Material DEF='M'"),
        "{}",
        &XML[at..at + 20]
    );
    let field = &material.data().fields[0];
    let at = field.span.start as usize;
    assert!(
        XML[at..].starts_with("diffuseColor"),
        "{}",
        &XML[at..at + 20]
    );
}

#[test]
fn a_mistake_in_xml_is_reported_with_its_line() {
    for (wrong, line, says) in [
        (
            "<Shape><Sphere radius='big'/></Shape>",
            2,
            "`Sphere.radius`",
        ),
        (
            "<Sphere/>\n<Shape colour='1 0 0'/>",
            3,
            "`Shape` has no field `colour`",
        ),
        (
            "<Group>\n<Nonsense a='1'/></Group>",
            3,
            "`Nonsense` is not a known node class",
        ),
        (
            "<Group USE='nobody'/>",
            2,
            "no earlier node is named `nobody`",
        ),
        ("<Group></Shape>", 2, "not well-formed"),
        ("<Group>", 2, "not well-formed"),
    ] {
        let document = read(format!(
            "<X3D version='3.3'><Scene>\n{wrong}\n</Scene></X3D>"
        ));
        let items = document.sink.items();
        let found = items.iter().find(|item| item.message.contains(says));
        let found = found.unwrap_or_else(|| panic!("{wrong}: {:?}", messages(&document)));
        let (source, span) = found.place.as_ref().expect("a place");
        let least = source.line_column(span.start).0;
        assert!(least >= line, "{wrong}: line {least}");
    }
}

/// The version decides whether a texture multiplies the color, and the limits of many fields.
#[test]
fn the_version_of_x3d_is_that_of_the_root_element() {
    let scene = "<Scene><Shape/></Scene></X3D>";
    let schema = "noNamespaceSchemaLocation='http://x/version-4/a.xsd'";
    let long = format!("<!-- {} -->", "license ".repeat(2000));
    let straddling = format!("<X3D version='4.0'><!-- {} -->", "\u{e4}".repeat(9000));
    let texts = [
        format!("<X3D version='4.0'>{scene}").into_bytes(),
        format!("\u{feff}<?xml version='1.0'?>{long}\n{long}<X3D version='4.0'>{scene}").into(),
        format!("<!-- was <X3D version='3.3'> --><X3D version='4.0'>{scene}").into(),
        format!("<X3D {schema} profile='a>b' version = '4.0'>{scene}").into(),
        format!("{straddling}{scene}").into(),
        format!("{straddling} {scene}")
            .replacen("<!-- ", "<!--", 1)
            .into(),
        [b"<X3D title='\xe4' version='4.0'>", scene.as_bytes()].concat(),
    ];
    for text in texts {
        let format = read(text.clone()).format;
        assert_eq!(format, "X3D V4.0 XML", "{}", text.escape_ascii());
    }
    let of_comments = "# a line\n".repeat(2000) + "v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n";
    assert_eq!(read(of_comments).format, "OBJ");
    let other = b"<!-- <X3D> --><svg></svg>".to_vec();
    Document::read("a", other, Arc::new(NoFiles), &Limits::default()).expect_err("no scene");
}

/// Every reader of XML has to accept it: Extensible Markup Language 1.0, section 4.3.3.
#[test]
fn x3d_in_utf_16_is_read() {
    let text = "\u{feff}<X3D version='4.0'><Scene><WorldInfo title='\u{1f600}'/></Scene></X3D>";
    let units = || text.encode_utf16();
    for bytes in [
        units().flat_map(u16::to_le_bytes).collect::<Vec<u8>>(),
        units().flat_map(u16::to_be_bytes).collect(),
    ] {
        assert!(classic(&read_clean(bytes)).contains("\u{1f600}"));
    }
}

#[test]
fn attributes_cannot_state_nodes_and_entities_are_not_expanded_again() {
    let text = "<X3D version='3.3'><Scene><Transform translation='0 0 0 } Sphere {'/>\
                <WorldInfo title='&amp;lt; &#65;'/></Scene></X3D>";
    let document = read(text);
    assert!(nodes(&document, "Sphere").is_empty());
    assert_eq!(
        nodes(&document, "WorldInfo")[0]
            .value("title")
            .map(|v| format!("{v:?}")),
        Some("String(\"&lt; A\")".to_owned())
    );
}

#[test]
fn the_program_of_a_script_is_all_of_its_text() {
    let text = "<!DOCTYPE X3D [ <!ENTITY f 'go'> ]>\n<X3D version='3.3'><Scene><Script>\n\
                ecmascript: function &f;() { return 1 &lt; 2 &amp;&amp; 3 &gt; &#50;\
                <![CDATA[ && 4 < 5; }]]>\n</Script></Scene></X3D>";
    let program = "ecmascript: function go() { return 1 < 2 && 3 > 2 && 4 < 5; }";
    let document = read(text);
    assert_eq!(messages(&document), Vec::<String>::new());
    let url = nodes(&document, "Script")[0].value("url").unwrap().clone();
    assert_eq!(format!("{url:?}"), format!("Strings([{program:?}])"));
}

/// XML 1.0, 4.4 and 3.1.
#[test]
fn entities_of_the_file_stand_for_their_texts_and_an_attribute_stated_twice_is_reported() {
    let scene = |material: &str| {
        read(format!(
            "<!DOCTYPE X3D [ <!ENTITY col '1 0 0'> ]>\n<X3D version='3.3'><Scene><Shape><Appearance>\
             <Material {material}/></Appearance><Box/></Shape></Scene></X3D>"
        ))
    };
    let document = scene("diffuseColor='&col;'");
    assert_eq!(messages(&document), Vec::<String>::new());
    assert_eq!(document.difference(&scene("diffuseColor='1 0 0'")), None);
    let twice = scene("diffuseColor='1 0 0' diffuseColor='0 1 0'");
    assert_eq!(document.difference(&twice), None);
    assert!(messages(&twice)[0].contains("`diffuseColor` is stated twice"));
}

#[test]
fn vrml97_has_no_fields_of_x3d() {
    let document = read("#VRML V2.0 utf8\nShape { castShadow FALSE }\n");
    assert!(messages(&document)[0].contains("no field `castShadow`"));
    read_clean("#X3D V4.0 utf8\nPROFILE Full\nShape { castShadow FALSE }\n");
}

const OBJ: &str = "# a comment
mtllib a.mtl
v 0 0 0 1 0 0
v 1 0 0 0 1 0
v 1 1 0 0 0 1
v 0 1 0 1 1 1
v 9 9 9
vt 0 0
vt 1 1
vn 0 0 1
o square
usemtl red paint
f 1/1/1 2/2/1 \\
  3/1/1 4/2/1
g rest
s 1
usemtl red paint
f -5 -4 -3
l 1 2 5
p 5
";
const MTL: &str = "newmtl red paint
Kd 1 0 0
Ks 0.5 0.5 0.5
Ke 0 0 0.25
Ns 64
d 0.75
map_Kd -s 2 2 1 a picture.png
";

#[test]
fn obj_becomes_shapes_of_one_material_each() {
    let files = Files(BTreeMap::from([("a.mtl", MTL.as_bytes().to_vec())]));
    let bytes = OBJ.as_bytes().to_vec();
    let document = Document::read("a.obj", bytes, Arc::new(files), &Limits::default());
    let document = document.expect("reads");
    assert_eq!(messages(&document), Vec::<String>::new());
    let sets = nodes(&document, "IndexedFaceSet");
    assert_eq!(sets.len(), 2);
    assert_eq!(sets[0].get(faces97::COORD_INDEX), [0, 1, 2, 3, -1]);
    assert_eq!(sets[0].get(faces97::TEX_COORD_INDEX), [0, 1, 0, 1, -1]);
    assert_eq!(sets[0].get(faces97::NORMAL_INDEX), [0, 0, 0, 0, -1]);
    assert_eq!(sets[0].get(faces97::CREASE_ANGLE), 0.0);
    let smooth = sets[1].get_node(faces97::NORMAL).expect("normals");
    assert!(!smooth.get(vrml97_normal::VECTOR).is_empty());
    let colors = sets[0]
        .get_node(faces97::COLOR)
        .expect("colors")
        .get(color::COLOR);
    assert_eq!(colors, [Vec3::X, Vec3::Y, Vec3::Z, Vec3::ONE]);
    let material = nodes(&document, "Material")[0];
    assert_eq!(material.get(vrml97_material::DIFFUSE_COLOR), Vec3::X);
    assert_eq!(material.get(vrml97_material::SHININESS), 0.5);
    assert_eq!(material.get(vrml97_material::TRANSPARENCY), 0.25);
    assert_eq!(material.get(vrml97_material::EMISSIVE_COLOR).z, 0.25);
    let texture = nodes(&document, "ImageTexture")[0];
    assert_eq!(
        format!("{:?}", texture.value("url")),
        "Some(Strings([\"a picture.png\"]))"
    );
    assert_eq!(texture.source().expect("a file").name, "a.mtl");
    // The texture multiplies `Kd`: that of an `Appearance` would replace it.
    let of_material = material.get_node(vrml97_material::DIFFUSE_TEXTURE);
    assert_eq!(of_material.map(|node| node.id), Some(texture.id));
    let appearance = nodes(&document, "Appearance")[0];
    assert!(appearance.get_node(appearance::TEXTURE).is_none());
    assert_eq!(nodes(&document, "IndexedLineSet").len(), 1);
    assert_eq!(nodes(&document, "PointSet").len(), 1);
    assert_eq!(
        document
            .names
            .keys()
            .map(|name| &**name)
            .collect::<Vec<_>>(),
        ["square", "rest"]
    );
}

#[test]
fn colors_of_mtl_are_those_of_a_screen_and_textures_multiply_them() {
    let color_of = |library: &str| {
        let files = Files(BTreeMap::from([("a.mtl", library.as_bytes().to_vec())]));
        let bytes = OBJ.as_bytes().to_vec();
        let read = Document::read("a.obj", bytes, Arc::new(files), &Limits::default());
        let document = read.expect("reads");
        nodes(&document, "Material")[0].get(vrml97_material::DIFFUSE_COLOR)
    };
    assert_eq!(color_of("newmtl red paint\nmap_Kd a.png\n"), Vec3::ONE);
    assert_eq!(color_of("newmtl red paint\n"), Vec3::splat(0.8));
    let files = Files(BTreeMap::from([(
        "a.mtl",
        b"newmtl red paint\nillum 0\n".to_vec(),
    )]));
    let bytes = OBJ.replace("v 0 0 0 1 0 0", "v 0 0 0 1 0 .5").into_bytes();
    let read = Document::read("a.obj", bytes, Arc::new(files), &Limits::default());
    let document = read.expect("reads");
    let colors = nodes(&document, "IndexedFaceSet")[0].get_node(faces97::COLOR);
    // The light of half a screen's value, by IEC 61966-2-1.
    let blue = colors.expect("colors").get(color::COLOR)[0].z;
    assert!((blue - 0.214_041_1).abs() < 1e-6, "{blue}");
    let black = "newmtl red paint\nmap_Kd a.png\nKd 0 0 0\n";
    assert_eq!(color_of(black), Vec3::ZERO);
}

/// Materials of illumination model 1 have no highlights, whatever their specular color.
#[test]
fn a_material_of_lamberts_law_has_no_highlight() {
    let specular_of = |illumination: &str| {
        let library = format!("newmtl red paint\nKs 0 1 0\n{illumination}\n").into_bytes();
        let files = Arc::new(Files(BTreeMap::from([("a.mtl", library)])));
        let read = Document::read("a.obj", OBJ.into(), files, &Limits::default());
        nodes(&read.expect("reads"), "Material")[0].get(vrml97_material::SPECULAR_COLOR)
    };
    assert_eq!(specular_of("illum 1"), Vec3::ZERO);
    assert_eq!(specular_of("illum 2"), Vec3::Y);
    assert_eq!(specular_of(""), Vec3::Y);
}

#[test]
fn wrong_lines_of_obj_cost_one_face_each() {
    let document = read("v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 0\nf 1 2\nf 1 2 x\ncurv 1 2\nf 1 2 3\n");
    let said = messages(&document);
    assert_eq!(said.len(), 4, "{said:?}");
    let set = nodes(&document, "IndexedFaceSet")[0];
    assert_eq!(set.get(faces97::COORD_INDEX), [0, 1, 2, -1]);
    let (source, span) = document.sink.items()[0].place.as_ref().expect("a place");
    assert_eq!(source.line_column(span.start).0, 4);
}

/// The normals of two squares at a right angle where they meet. They have the same one exactly
/// within one smoothing group, whatever their groups and materials.
#[test]
fn an_edge_of_obj_is_smooth_within_one_smoothing_group() {
    let half = std::f32::consts::FRAC_1_SQRT_2;
    let smooth = Vec3::new(half, 0.0, half);
    for (first, second, normals) in [
        ("s 1", "s 1", [smooth; 2]),
        ("s 1\ng a", "g b", [smooth; 2]),
        ("s 2\nusemtl a", "usemtl b", [smooth; 2]),
        ("s 1", "s 2", [Vec3::Z, Vec3::X]),
        ("s 1", "s 2\ng b", [Vec3::Z, Vec3::X]),
        // The back of the first face cancels nothing.
        ("s 1\nf 4 3 2 1", "", [smooth, Vec3::X]),
    ] {
        let document = read(format!(
            "mtllib a.mtl\nv 0 0 0\nv 1 0 0\nv 1 1 0\nv 0 1 0\nv 1 0 -1\nv 1 1 -1\n\
             {first}\nf 1 2 3 4\n{second}\nf 3 2 5 6\n"
        ));
        let sets = nodes(&document, "IndexedFaceSet");
        let corners = sets.iter().flat_map(|set| {
            let list = set.get_node(faces97::NORMAL).expect("normals");
            let list = list.get(vrml97_normal::VECTOR);
            let index = set.get(faces97::NORMAL_INDEX).iter();
            index.filter(|n| **n >= 0).map(|n| list[*n as usize])
        });
        let corners: Vec<Vec3> = corners.collect();
        // The corner at 1 1 0 is the third of the square at z = 0 and the first of the last one.
        let count = corners.len();
        let found = [corners[count - 6], corners[count - 4]];
        for (found, expected) in found.into_iter().zip(normals) {
            assert!(
                found.distance(expected) < 1e-6,
                "{first:?} {second:?}: {corners:?}"
            );
        }
    }
}

#[test]
fn a_byte_order_mark_costs_nothing() {
    let obj = "v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n";
    let ply = String::from_utf8(ply("ascii")).expect("text");
    for text in [obj, STL, &ply] {
        let marked = read_clean(format!("\u{feff}{text}"));
        assert_eq!(classic(&marked), classic(&read_clean(text)));
    }
}

#[test]
fn obj_of_vertices_alone_is_points() {
    let document = read("v 0 0 0\nv 1 0 0 \nv 0 1 0\n");
    let set = nodes(&document, "PointSet")[0];
    let coord = set.get_node(faces97::COORD).expect("points");
    assert_eq!(coord.get(coordinate::POINT), [Vec3::ZERO, Vec3::X, Vec3::Y]);
    assert_eq!(messages(&document).len(), 1);
}

#[test]
fn a_line_of_ply_with_too_many_numbers_costs_no_other_line() {
    let whole = String::from_utf8(ply("ascii")).expect("text");
    let more = whole.replace("3 0 1 2", "3 0 1 2 9 1 1 1");
    let set = |text: &str| {
        let document = read(text);
        let set = nodes(&document, "IndexedFaceSet")[0];
        let points = set.get_node(faces97::COORD).expect("points");
        let points = points.get(coordinate::POINT).to_vec();
        (
            set.get(faces97::COORD_INDEX).to_vec(),
            points,
            messages(&document).len(),
        )
    };
    let (index, points, said) = set(&more);
    let (own_index, own_points, nothing) = set(&whole);
    assert_eq!((index, points), (own_index, own_points));
    assert_eq!([said, nothing], [1, 0]);
}

/// A square of PLY in one of its forms.
fn ply(form: &str) -> Vec<u8> {
    let mut out = format!(
        "ply\nformat {form} 1.0\ncomment by hand\nelement vertex 4\nproperty float x\n\
         property float y\nproperty double z\nproperty uchar red\nproperty uchar green\n\
         property uchar blue\nelement face 2\nproperty list uchar int vertex_indices\nend_header\n"
    )
    .into_bytes();
    let points = [[0.0f32, 0.0], [1.0, 0.0], [1.0, 1.0], [0.0, 1.0]];
    let faces = [[0i32, 1, 2], [0, 2, 3]];
    let is_big = form.contains("big");
    for [x, y] in points {
        if form == "ascii" {
            out.extend(format!("{x} {y} 0.5 255 0 51\n").bytes());
            continue;
        }
        for n in [x, y] {
            out.extend(if is_big {
                n.to_be_bytes()
            } else {
                n.to_le_bytes()
            });
        }
        out.extend(if is_big {
            0.5f64.to_be_bytes()
        } else {
            0.5f64.to_le_bytes()
        });
        out.extend([255, 0, 51]);
    }
    for face in faces {
        if form == "ascii" {
            out.extend(format!("3 {} {} {}\n", face[0], face[1], face[2]).bytes());
            continue;
        }
        out.push(3);
        for n in face {
            out.extend(if is_big {
                n.to_be_bytes()
            } else {
                n.to_le_bytes()
            });
        }
    }
    out
}

#[test]
fn faces_of_ply_have_colors_where_vertices_have_none() {
    let text = |vertex: &str, color: &str| {
        format!(
            "ply\nformat ascii 1.0\nelement vertex 3\nproperty float x\nproperty float y\n\
             property float z\n{vertex}element face 2\nproperty list uchar int vertex_indices\n\
             property uchar red\nproperty uchar green\nproperty uchar blue\nend_header\n\
             0 0 0{color}\n1 0 0{color}\n0 1 0{color}\n3 0 1 2 255 0 0\n3 2 1 0 0 0 255\n"
        )
    };
    let colors_of = |document: &Document| {
        let set = nodes(document, "IndexedFaceSet")[0];
        let colors = set.get_node(faces97::COLOR).expect("colors");
        (
            set.get(faces97::COLOR_PER_VERTEX),
            colors.get(color::COLOR).to_vec(),
        )
    };
    let document = read_clean(text("", ""));
    assert_eq!(colors_of(&document), (false, vec![Vec3::X, Vec3::Z]));
    let both = text("property float red\n", " .5");
    let document = read(both);
    assert_eq!(
        colors_of(&document),
        (true, vec![Vec3::new(0.5, 0.0, 0.0); 3])
    );
    assert_eq!(messages(&document).len(), 1);
}

#[test]
fn colors_of_ply_in_32_bits_are_0_to_255() {
    for (kind, full) in [
        ("uchar", 255),
        ("ushort", 65535),
        ("int", 255),
        ("uint", 255),
    ] {
        let document = read_clean(format!(
            "ply\nformat ascii 1.0\nelement vertex 1\nproperty float x\nproperty float y\n\
             property float z\nproperty {kind} red\nproperty {kind} green\n\
             property {kind} blue\nend_header\n0 0 0 {full} 0 {full}\n"
        ));
        let colors = nodes(&document, "Color")[0].get(color::COLOR);
        assert_eq!(colors, [Vec3::new(1.0, 0.0, 1.0)], "{kind}");
    }
}

#[test]
fn a_texture_of_ply_has_its_own_colors() {
    let text = String::from_utf8(ply("ascii")).expect("text");
    let color_of = |text: &str| {
        let document = read_clean(text);
        let look = nodes(&document, "Appearance")[0];
        let material = look.get_node(appearance::MATERIAL).expect("a material");
        material.get(vrml97_material::DIFFUSE_COLOR)
    };
    assert_eq!(color_of(&text), Vec3::splat(0.8));
    let textured = text.replace("1.0\n", "1.0\ncomment TextureFile a.png\n");
    assert_eq!(color_of(&textured), Vec3::ONE);
}

#[test]
fn ply_is_the_same_in_its_three_forms() {
    let forms = ["ascii", "binary_little_endian", "binary_big_endian"];
    let read = forms.map(|form| read_clean(ply(form)));
    for document in &read {
        assert_eq!(classic(document), classic(&read[0]));
    }
    let set = nodes(&read[0], "IndexedFaceSet")[0];
    assert_eq!(set.get(faces97::COORD_INDEX), [0, 1, 2, -1, 0, 2, 3, -1]);
    let points = set
        .get_node(faces97::COORD)
        .expect("points")
        .get(coordinate::POINT);
    assert_eq!(points[2], Vec3::new(1.0, 1.0, 0.5));
    let colors = set
        .get_node(faces97::COLOR)
        .expect("colors")
        .get(color::COLOR);
    assert_eq!(colors[0], Vec3::new(1.0, 0.0, 0.2));
    assert!(read[0].meta.contains(&("comment".into(), "by hand".into())));
}

#[test]
fn cut_ply_keeps_what_is_before_and_huge_counts_take_no_memory() {
    for form in ["ascii", "binary_little_endian"] {
        let whole = ply(form);
        let cut = read(&whole[..whole.len() - 6]);
        assert!(
            messages(&cut)[0].contains("ends in the element `face`"),
            "{:?}",
            messages(&cut)
        );
        assert_eq!(
            nodes(&cut, "IndexedFaceSet")[0]
                .get(faces97::COORD_INDEX)
                .len(),
            4
        );
    }
    let text = String::from_utf8(ply("ascii")).expect("text");
    let huge = text.replace("element face 2", "element face 18446744073709551615");
    assert!(messages(&read(huge))[0].contains("ends in the element `face`"));
    let long = text.replace("\n3 0 1 2", "\n4000000000 0 1 2");
    assert!(messages(&read(long))[0].contains("ends in the element `face`"));
    let error = Document::read(
        "a",
        b"ply\nformat ascii 1.0\nelement vertex many\n".to_vec(),
        Arc::new(NoFiles),
        &Limits::default(),
    );
    assert!(
        error
            .expect_err("damaged")
            .message
            .contains("`many` is no count")
    );
}

const STL: &str = "solid tile\nfacet normal 0 0 1\nouter loop\nvertex 0 0 0\nvertex 1 0 0\n\
                   vertex 0 1 0\nendloop\nendfacet\nendsolid tile\n";

#[test]
fn stl_is_the_same_as_text_and_binary() {
    let mut binary = b"solid, but binary".to_vec();
    binary.resize(80, 0);
    binary.extend(1u32.to_le_bytes());
    for n in [
        0.0f32, 0.0, 1.0, 0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 1.0, 0.0,
    ] {
        binary.extend(n.to_le_bytes());
    }
    binary.extend([0, 0]);
    let capitals = read_clean(STL.to_ascii_uppercase());
    // Of a damaged file what is whole is read.
    let damaged = |count: u32, bytes: usize, message: &str| {
        let mut bytes_of = [&binary[..80], &count.to_le_bytes(), &binary[84..]].concat();
        bytes_of.resize(bytes, 7);
        let document = read(bytes_of);
        let said = messages(&document);
        assert!(said.len() == 1 && said[0].contains(message), "{said:?}");
        document
    };
    let cut = damaged(2, 150, "ends after 1 of 2 triangles");
    let long = damaged(1, 138, "more bytes follow the 1 triangles");
    let (text, binary) = (read_clean(STL), read_clean(binary));
    for document in [&text, &binary, &capitals, &cut, &long] {
        let set = nodes(document, "TriangleSet")[0];
        let points = set
            .get_node(faces97::COORD)
            .expect("points")
            .get(coordinate::POINT);
        assert_eq!(points, [Vec3::ZERO, Vec3::X, Vec3::Y]);
    }
    assert_eq!(text.names.keys().next().map(|name| &**name), Some("tile"));
    let cut = read(&STL[..STL.len() - 30]);
    assert_eq!(nodes(&cut, "TriangleSet").len(), 1);
    assert!(
        messages(&cut)
            .iter()
            .any(|said| said.contains("ends inside a solid")),
        "{:?}",
        messages(&cut)
    );
}

/// A GLB file of some JSON and a binary chunk.
fn glb(json: &str, chunk: &[u8]) -> Vec<u8> {
    let mut json = json.as_bytes().to_vec();
    json.resize(json.len().next_multiple_of(4), b' ');
    let mut out = b"glTF\x02\0\0\0".to_vec();
    out.extend(((28 + json.len() + chunk.len()) as u32).to_le_bytes());
    out.extend((json.len() as u32).to_le_bytes());
    out.extend(b"JSON");
    out.extend(json);
    out.extend((chunk.len() as u32).to_le_bytes());
    out.extend(b"BIN\0");
    out.extend(chunk);
    out
}

/// A triangle with everything that a vertex may have: positions, a sparse one of them, texture
/// coordinates and colors in bytes, an index, and an animation of its node.
fn triangle() -> (String, Vec<u8>) {
    let mut chunk = Vec::new();
    for n in [0.0f32, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 1.0, 0.0] {
        chunk.extend(n.to_le_bytes());
    }
    chunk.extend([0u8, 0, 255, 0, 0, 255, 0, 0]); // 36: texture coordinates, padded
    chunk.extend([255u8, 0, 0, 255, 0, 255, 0, 255, 0, 0, 255, 51]); // 44: colors
    chunk.extend([2u8, 0, 1, 0, 0, 0, 0, 0]); // 56: an index of 16 bits, padded
    chunk.extend([1u8, 0, 0, 0]); // 64: the place of a sparse value
    for n in [5.0f32, 0.0, 0.0] {
        chunk.extend(n.to_le_bytes()); // 68: the sparse value
    }
    for n in [0.0f32, 2.0, 0.0, 0.0, 0.0, 4.0, 0.0, 0.0] {
        chunk.extend(n.to_le_bytes()); // 80: times, 88: translations
    }
    let json = r#"{
      "asset": { "version": "2.0", "generator": "by hand" },
      "scene": 0, "scenes": [ { "nodes": [ 0 ] } ],
      "nodes": [ { "name": "top", "mesh": 0, "rotation": [ 0, 0, 0.70710678, 0.70710678 ] } ],
      "meshes": [ { "primitives": [ { "material": 0, "indices": 3,
        "attributes": { "POSITION": 0, "TEXCOORD_0": 1, "COLOR_0": 2 } } ] } ],
      "materials": [ { "doubleSided": true, "emissiveFactor": [ 0, 0.5, 0 ],
        "extensions": { "KHR_materials_emissive_strength": { "emissiveStrength": 4 } },
        "pbrMetallicRoughness": { "baseColorFactor": [ 0.5, 1, 1, 1 ], "metallicFactor": 0.25,
          "baseColorTexture": { "index": 0, "extensions": { "KHR_texture_transform": {
            "offset": [ 0.25, 0.5 ], "scale": [ 2, 4 ] } } } } } ],
      "textures": [ { "source": 0 } ], "images": [ { "uri": "a%20b.png" } ],
      "animations": [ { "channels": [ { "sampler": 0, "target": { "node": 0, "path": "translation" } } ],
        "samplers": [ { "input": 4, "output": 5 } ] } ],
      "accessors": [
        { "bufferView": 0, "componentType": 5126, "count": 3, "type": "VEC3", "sparse": { "count": 1,
          "indices": { "bufferView": 4, "componentType": 5121 }, "values": { "bufferView": 5 } } },
        { "bufferView": 1, "componentType": 5121, "normalized": true, "count": 3, "type": "VEC2" },
        { "bufferView": 2, "componentType": 5121, "normalized": true, "count": 3, "type": "VEC4" },
        { "bufferView": 3, "componentType": 5123, "count": 3, "type": "SCALAR" },
        { "bufferView": 6, "componentType": 5126, "count": 2, "type": "SCALAR" },
        { "bufferView": 7, "componentType": 5126, "count": 2, "type": "VEC3" } ],
      "bufferViews": [
        { "buffer": 0, "byteOffset": 0, "byteLength": 36 }, { "buffer": 0, "byteOffset": 36, "byteLength": 8 },
        { "buffer": 0, "byteOffset": 44, "byteLength": 12 }, { "buffer": 0, "byteOffset": 56, "byteLength": 8 },
        { "buffer": 0, "byteOffset": 64, "byteLength": 4 }, { "buffer": 0, "byteOffset": 68, "byteLength": 12 },
        { "buffer": 0, "byteOffset": 80, "byteLength": 8 }, { "buffer": 0, "byteOffset": 88, "byteLength": 24 } ],
      "buffers": [ { "byteLength": 112 } ]
    }"#;
    (json.to_owned(), chunk)
}

#[test]
fn gltf_becomes_transforms_shapes_and_physical_materials() {
    let (json, chunk) = triangle();
    let document = read_clean(glb(&json, &chunk));
    let set = nodes(&document, "IndexedTriangleSet")[0];
    assert_eq!(set.get(indexed_triangle_set::INDEX), [2, 1, 0]);
    assert!(
        !set.get(indexed_triangle_set::SOLID) && !set.get(indexed_triangle_set::NORMAL_PER_VERTEX)
    );
    let points = set
        .get_node(faces97::COORD)
        .expect("points")
        .get(coordinate::POINT);
    assert_eq!(points, [Vec3::ZERO, 5.0 * Vec3::X, Vec3::Y]);
    let at = set.get_node(faces97::TEX_COORD).expect("coordinates");
    // u' = 2u + ¼ and v' = 4v + ½, and t runs up.
    let expected = [
        Vec2::new(0.25, 0.5),
        Vec2::new(2.25, 0.5),
        Vec2::new(0.25, -3.5),
    ];
    assert_eq!(at.get(texture_coordinate::POINT), expected);
    let colors = set
        .get_node(faces97::COLOR)
        .expect("colors")
        .get(color_rgba::COLOR);
    assert_eq!(colors[0], Vec4::new(0.5, 0.0, 0.0, 1.0));
    assert!((colors[2] - Vec4::new(0.0, 0.0, 1.0, 0.2)).length() < 1e-6);
    let shape = nodes(&document, "Shape")[0];
    let look = shape
        .get_node(vrml97_shape::APPEARANCE)
        .expect("an appearance");
    assert_eq!(look.get(appearance::ALPHA_MODE), "OPAQUE");
    let material = look.get_node(appearance::MATERIAL).expect("a material");
    assert_eq!(material.class_id(), Some(class::PHYSICAL_MATERIAL));
    assert_eq!(material.get(physical_material::METALLIC), 0.25);
    assert_eq!(
        material.get(physical_material::EMISSIVE_COLOR),
        Vec3::new(0.0, 2.0, 0.0)
    );
    let texture = material
        .get_node(physical_material::BASE_TEXTURE)
        .expect("a texture");
    assert_eq!(
        format!("{:?}", texture.value("url")),
        "Some(Strings([\"a b.png\"]))"
    );
    assert_eq!(
        document.meta,
        [("generator".to_owned(), "by hand".to_owned())]
    );
    let again = read_clean(classic(&document));
    assert_eq!(classic(&again), classic(&document));
}

/// glTF 2.0, 3.7.4: where the matrix of a node mirrors, the corners of a front run clockwise.
#[test]
fn a_mirrored_mesh_of_gltf_keeps_its_front() {
    let (json, chunk) = triangle();
    let twice = json
        .replace(r#""nodes": [ 0 ]"#, r#""nodes": [ 0, 1 ]"#)
        .replace(
            r#""nodes": [ { "name""#,
            r#""nodes": [ { "children": [ 2 ], "scale": [ 1, -1, 1 ] },
               { "mesh": 0 }, { "mesh": 0 }, { "name""#,
        );
    let document = read_clean(glb(
        &twice.replace(r#"{ "node": 0,"#, r#"{ "node": 1,"#),
        &chunk,
    ));
    let sets = nodes(&document, "IndexedTriangleSet");
    let mut fronts: Vec<bool> = sets.iter().map(|set| set.get(faces97::CCW)).collect();
    fronts.sort();
    assert_eq!(fronts, [false, true]);
    // A normal that a program computes for `ccw FALSE` points to the back.
    let normals = sets.iter().filter_map(|set| set.get_node(faces97::NORMAL));
    let normals: Vec<&[Vec3]> = normals
        .map(|node| node.get(vrml97_normal::VECTOR))
        .collect();
    assert_eq!(normals, [[Vec3::NEG_Z]]);
    let points = |set: &NodeRef<'_>| set.get_node(faces97::COORD).map(|node| node.id);
    assert_eq!(points(&sets[0]), points(&sets[1]));
}

/// glTF 2.0, 3.9.7: lines with normals are lit, which the program does not do.
#[test]
fn normals_of_lines_of_gltf_that_are_not_used_are_reported() {
    let (json, chunk) = triangle();
    let lines = json.replace(r#""indices": 3,"#, r#""mode": 3, "indices": 3,"#);
    let with_normals = lines.replace(r#""POSITION": 0,"#, r#""POSITION": 0, "NORMAL": 0,"#);
    let unlit = with_normals.replace(
        r#""extensions": { "KHR_materials_emissive_strength""#,
        r#""extensions": { "KHR_materials_unlit": { }, "KHR_materials_emissive_strength""#,
    );
    for (json, expected) in [(&lines, 0), (&with_normals, 1), (&unlit, 0)] {
        let read = read(glb(json, &chunk));
        let said = messages(&read);
        let found = said.iter().filter(|said| said.contains("without lighting"));
        assert_eq!(found.count(), expected, "{said:?}");
    }
}

#[test]
fn animations_of_gltf_move_nodes_at_a_time() {
    let (json, chunk) = triangle();
    let document = read_clean(glb(&json, &chunk));
    let clock = nodes(&document, "TimeSensor")[0];
    assert_eq!(clock.get(time_sensor::CYCLE_INTERVAL), 2.0);
    for (time, x) in [(0.0, 0.0), (0.5, 1.0), (1.5, 3.0), (2.5, 1.0)] {
        let snapshot = Snapshot::at(&document, time);
        let moved = nodes(snapshot.document(), "Transform")[0];
        let at = moved.get(vrml97_transform::TRANSLATION);
        assert!(
            (at - Vec3::new(x, 0.0, 0.0)).length() < 1e-5,
            "{time}: {at}"
        );
    }
    let turned = nodes(&document, "Transform")[0].get(vrml97_transform::ROTATION);
    assert!((turned.angle - std::f32::consts::FRAC_PI_2).abs() < 1e-6);
}

#[test]
fn a_child_that_is_listed_twice_is_there_once() {
    let (json, chunk) = triangle();
    let json = json.replace(
        r#""nodes": [ { "name""#,
        r#""nodes": [ { "children": [ 1, 1 ] }, { "name""#,
    );
    let document = read(glb(&json, &chunk));
    assert!(messages(&document)[0].contains("a node is a child of several nodes"));
    let top = nodes(&document, "Transform")[0];
    assert_eq!(top.get_nodes(vrml97_transform::CHILDREN).len(), 1);
}

#[test]
fn damaged_gltf_loses_only_what_is_damaged() {
    let (json, chunk) = triangle();
    for (from, to, says) in [
        (
            "\"count\": 3, \"type\": \"VEC3\"",
            "\"count\": 4000000000, \"type\": \"VEC3\"",
            "too many elements",
        ),
        (
            "\"count\": 3, \"type\": \"VEC3\"",
            "\"count\": 300, \"type\": \"VEC3\"",
            "beyond its buffer view",
        ),
        (
            "\"byteOffset\": 0, \"byteLength\": 36",
            "\"byteOffset\": 18446744073709551615, \"byteLength\": 36",
            "beyond its buffer",
        ),
        (
            "\"mesh\": 0,",
            "\"mesh\": 0, \"children\": [ 0 ],",
            "child of several nodes, of itself",
        ),
        ("\"mesh\": 0,", "\"mesh\": 7,", "the mesh 7 does not exist"),
        (
            "\"indices\": 3",
            "\"indices\": 99",
            "the accessor 99 does not exist",
        ),
        ("\"POSITION\": 0", "\"NORMAL\": 0", "has no positions"),
        (
            "\"material\": 0",
            "\"material\": 5",
            "the material 5 does not exist",
        ),
        (
            "\"byteLength\": 36 }",
            "\"byteLength\": 36, \"extensions\": { \"EXT_meshopt_compression\": {} } }",
            "EXT_meshopt_compression",
        ),
        (
            "\"asset\"",
            "\"extensionsRequired\": [ \"ACME\" ], \"asset\"",
            "the extension `ACME` is not read",
        ),
    ] {
        assert!(json.contains(from), "{from}");
        let document = read(glb(&json.replacen(from, to, 1), &chunk));
        let said = messages(&document);
        assert!(
            said.iter().any(|said| said.contains(says)),
            "{to}: {said:?}"
        );
    }
    let error = Document::read(
        "a",
        glb(&json[..200], &chunk),
        Arc::new(NoFiles),
        &Limits::default(),
    );
    let error = error.expect_err("damaged JSON");
    assert!(
        error.message.contains("JSON of this glTF file"),
        "{}",
        error.message
    );
    let whole = glb(&json, &chunk);
    for length in (0..whole.len()).step_by(37) {
        let _ = Document::read(
            "a",
            whole[..length].to_vec(),
            Arc::new(NoFiles),
            &Limits::default(),
        );
    }
}

#[test]
fn an_inline_includes_a_file_of_any_format() {
    let (json, chunk) = triangle();
    let files = Files(BTreeMap::from([
        ("a.glb", glb(&json, &chunk)),
        ("a.stl", STL.as_bytes().to_vec()),
        ("a.x3d", XML.as_bytes().to_vec()),
        ("a.ply", ply("binary_big_endian")),
    ]));
    let text = "#VRML V2.0 utf8\nInline { url \"a.glb\" } Inline { url \"a.stl\" }
                Inline { url \"a.x3d\" } Inline { url \"a.ply\" }\n";
    let bytes = text.as_bytes().to_vec();
    let document = Document::read("a.wrl", bytes, Arc::new(files), &Limits::default());
    let document = document.expect("reads");
    assert_eq!(messages(&document), Vec::<String>::new());
    assert_eq!(document.included.len(), 4);
    assert_eq!(nodes(&document, "Shape").len(), 1 + 1 + 3 + 1 + 1);
}

/// ISO 19775-1, 9.4.2: with `load` FALSE the file is not loaded.
#[test]
fn an_inline_whose_load_is_false_includes_nothing() {
    for (load, included) in [("TRUE", 1), ("FALSE", 0)] {
        let files = Files(BTreeMap::from([("a.stl", STL.as_bytes().to_vec())]));
        let text =
            format!("#X3D V3.3 utf8\nPROFILE Full\nInline {{ load {load} url \"a.stl\" }}\n");
        let limits = Limits::default();
        let document = Document::read("a.x3dv", text.into_bytes(), Arc::new(files), &limits);
        let document = document.expect("reads");
        assert_eq!(messages(&document), Vec::<String>::new());
        assert_eq!(document.included.len(), included);
    }
}

#[test]
fn a_light_of_gltf_stays_linear_light() {
    let text = r#"{ "asset": { "version": "2.0" }, "scene": 0, "scenes": [ { "nodes": [ 0 ] } ],
        "nodes": [ { "extensions": { "KHR_lights_punctual": { "light": 0 } } } ],
        "extensionsUsed": [ "KHR_lights_punctual" ],
        "extensions": { "KHR_lights_punctual": { "lights": [
            { "type": "point", "intensity": 12.5663706, "color": [ 1, 1, 1 ] } ] } } }"#;
    let document = read_clean(text);
    let again = read_clean(classic(&document));
    for document in [document, again] {
        let light = nodes(&document, "PointLight")[0];
        assert_eq!(light.value("intensity"), Some(&Value::Float(4.0)));
        let metadata = light.get_node(vrml_light::METADATA).expect("metadata");
        assert_eq!(metadata.get(metadata_boolean::NAME), LINEAR_LIGHT);
    }
}

/// The default angles of a `SpotLight` were exchanged in X3D 3.3.
#[test]
fn a_spot_light_has_the_angles_of_its_version() {
    let angles_of = |header: &str, text: &str| {
        let document = read(format!("{header}\nPROFILE Full\nSpotLight {{ {text} }}"));
        let light = nodes(&document, "SpotLight")[0];
        [spot97::BEAM_WIDTH, spot97::CUT_OFF_ANGLE].map(|angle| light.get(angle))
    };
    let [narrow, wide] = [std::f32::consts::FRAC_PI_4, std::f32::consts::FRAC_PI_2];
    assert_eq!(angles_of("#X3D V3.2 utf8", ""), [wide, narrow]);
    assert_eq!(angles_of("#X3D V3.3 utf8", ""), [narrow, wide]);
    assert_eq!(angles_of("#X3D V4.0 utf8", "cutOffAngle .5")[1], 0.5);
}

/// VRML97's `controlPoint` has the points, X3D's a node.
#[test]
fn control_points_of_x3d_are_a_coordinate() {
    let text = "PROFILE Full\nShape { geometry NurbsCurve { controlPoint Coordinate { point \
                [0 0 0, 1 0 0, 1 1 0] } order 2 knot [0 0 1 2 2] } }";
    let document = read_clean(format!("#X3D V3.3 utf8\n{text}"));
    let curve = nodes(&document, "NurbsCurve")[0];
    let points = curve.get_node(faces97::COORD).expect("points");
    assert_eq!(points.get(coordinate::POINT).len(), 3);
    assert!(classic(&document).contains("controlPoint Coordinate"));
}
