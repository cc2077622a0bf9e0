//! Scenes as X3D and VRML97, with what is lost.

use std::sync::Arc;

use ivcam_base::diag::ErrorKind;
use ivcam_inventor::events::SnapshotOptions;
use ivcam_inventor::iv::{Document, Limits, NoFiles};
use ivcam_render::scene::model::{Image, Material, Model, ModelOptions};
use ivcam_render::scene::{CompileOptions, RenderScene, snapshot};

use crate::export::{Conversion, ExportOptions, Target, convert};
use crate::photo::snapshot_options;

fn document(text: &str) -> Document {
    let bytes = text.as_bytes().to_vec();
    Document::read("a.wrl", bytes, Arc::new(NoFiles), &Limits::default()).unwrap()
}

fn converted(text: &str, target: Target) -> Conversion {
    convert(&document(text), target, &ExportOptions::default()).unwrap()
}

/// Returns the lines between the tags of the scene, without their indentation.
fn scene(text: &str) -> Vec<String> {
    let conversion = converted(text, Target::X3d);
    let written = String::from_utf8(conversion.bytes).unwrap();
    let lines = written.lines().map(|line| line.trim().to_owned());
    let inside = lines.skip_while(|line| line != "<Scene>").skip(1);
    inside.take_while(|line| line != "</Scene>").collect()
}

/// X3D 3.3 exchanged the default angles of a `SpotLight` of VRML97.
#[test]
fn a_spot_light_of_vrml97_keeps_its_angles() {
    let text = "Group { children SpotLight { beamWidth 0.5 } }";
    let found = scene(&format!("#VRML V2.0 utf8\n{text}"));
    assert_eq!(
        found[1],
        "<SpotLight beamWidth='0.5' cutOffAngle='0.785398'/>"
    );
    let of_x3d = scene(&format!("#X3D V3.3 utf8\nPROFILE Full\n{text}"));
    assert_eq!(
        of_x3d[1],
        "<SpotLight beamWidth='0.5' cutOffAngle='1.5707964'/>"
    );
}

#[test]
fn nodes_fields_and_uses_of_vrml97_are_kept() {
    let found = scene(
        "#VRML V2.0 utf8\nTransform { translation 1 2 3 children [ DEF S Shape { appearance \
         Appearance { material DEF M Material { diffuseColor 1 0 0 } } geometry Box { } } USE S ] }\n\
         LOD { range [ 5 ] level [ Shape { appearance Appearance { material USE M } } ] }\n\
         Collision { collide FALSE proxy USE S }",
    );
    let expected = [
        "<Transform translation='1 2 3'>",
        "<Shape DEF='S'>",
        "<Appearance>",
        "<Material DEF='M' diffuseColor='1 0 0'/>",
        "</Appearance>",
        "<Box/>",
        "</Shape>",
        "<Shape USE='S'/>",
        "</Transform>",
        "<LOD range='5'>",
        "<Shape>",
        "<Appearance>",
        "<Material USE='M'/>",
        "</Appearance>",
        "</Shape>",
        "</LOD>",
        "<Collision enabled='false'>",
        "<Shape USE='S' containerField='proxy'/>",
        "</Collision>",
    ];
    assert_eq!(found, expected);
}

#[test]
fn prototypes_links_scripts_and_routes_are_kept() {
    let found = scene(
        "#VRML V2.0 utf8\nPROTO P [ exposedField SFColor c 1 0 0 field MFNode n [ ] eventIn \
         SFTime t ] { Group { children IS n } Material { diffuseColor IS c } }\n\
         EXTERNPROTO E [ field SFInt32 i ] \"e.wrl#E\"\n\
         DEF A P { c 0 1 0 n [ Group { } ] }\nE { i 3 }\n\
         DEF T TimeSensor { }\n\
         DEF X Script { eventIn SFTime set_t field SFNode g USE A eventOut SFTime out\n\
         url \"javascript:function set_t(v) { out = v; } // <&'\\n\" }\n\
         ROUTE T.cycleTime TO X.set_t\nROUTE X.out TO A.t",
    );
    let expected = [
        "<ProtoDeclare name='P'>",
        "<ProtoInterface>",
        "<field accessType='inputOutput' name='c' type='SFColor' value='1 0 0'/>",
        "<field accessType='initializeOnly' name='n' type='MFNode'/>",
        "<field accessType='inputOnly' name='t' type='SFTime'/>",
        "</ProtoInterface>",
        "<ProtoBody>",
        "<Group>",
        "<IS>",
        "<connect nodeField='children' protoField='n'/>",
        "</IS>",
        "</Group>",
        "<Material containerField='children'>",
        "<IS>",
        "<connect nodeField='diffuseColor' protoField='c'/>",
        "</IS>",
        "</Material>",
        "</ProtoBody>",
        "</ProtoDeclare>",
        "<ExternProtoDeclare name='E' url='\"e.wrl#E\"'>",
        "<field accessType='initializeOnly' name='i' type='SFInt32'/>",
        "</ExternProtoDeclare>",
        "<ProtoInstance name='P' DEF='A'>",
        "<fieldValue name='c' value='0 1 0'/>",
        "<fieldValue name='n'>",
        "<Group/>",
        "</fieldValue>",
        "</ProtoInstance>",
        "<ProtoInstance name='E'>",
        "<fieldValue name='i' value='3'/>",
        "</ProtoInstance>",
        "<TimeSensor DEF='T'/>",
    ];
    assert_eq!(found[..expected.len()], expected, "{found:#?}");
    let rest = &found[expected.len()..];
    let url = "<Script DEF='X' url='\"ecmascript:function set_t(v) { out = v; } // &lt;&amp;&apos;";
    assert!(rest[0].starts_with(url), "{}", rest[0]);
    assert!(rest.contains(&"<ProtoInstance name='P' USE='A'/>".to_owned()));
    let routes = [
        "<ROUTE fromField='cycleTime' fromNode='T' toField='set_t' toNode='X'/>",
        "<ROUTE fromField='out' fromNode='X' toField='t' toNode='A'/>",
    ];
    assert!(rest.ends_with(&routes.map(str::to_owned)), "{rest:#?}");
}

#[test]
fn names_are_identifiers_of_xml_and_each_is_given_once() {
    let found = scene(
        "#VRML V2.0 utf8\nDEF a:b Group { }\nDEF N Group { }\nDEF N Group { }\nUSE N\n\
         PROTO P [ ] { DEF N Group { } }\nP { }",
    );
    for line in [
        "<Group DEF='a_b'/>",
        "<Group USE='N_3'/>",
        "<Group DEF='N'/>",
    ] {
        assert!(found.contains(&line.to_owned()), "{line} in {found:#?}");
    }
    let mut given: Vec<&str> = found
        .iter()
        .filter_map(|line| line.split_once("DEF='")?.1.split('\'').next())
        .collect();
    let all = given.len();
    given.sort_unstable();
    given.dedup();
    assert_eq!(given.len(), all);
}

/// VRML97, A.3: these words are no names.
#[test]
fn the_first_of_equal_names_stays_and_no_name_is_a_word_of_the_language() {
    let group = |name: &str| format!("DEF {name} Separator {{ Cube {{ }} }}");
    let text = ["A", "A", "TRUE", "field", "A"].map(group).join("\n");
    let text = format!("#Inventor V2.1 ascii\nTranslation {{ translation 1 0 0 }}\n{text}");
    let written = String::from_utf8(converted(&text, Target::Vrml97).bytes).unwrap();
    let names = written
        .split("DEF ")
        .skip(1)
        .filter_map(|rest| rest.split(' ').next());
    let names: Vec<&str> = names.filter(|name| *name != "shape").collect();
    assert_eq!(names, ["A", "A_2", "TRUE_2", "field_2", "A_3"], "{written}");
}

#[test]
fn a_node_in_a_default_of_a_prototype_is_not_used_from_outside() {
    let found = scene(
        "#VRML V2.0 utf8\nDEF B Box { }\nPROTO P [ field SFNode g USE B ] { Shape { geometry IS g } }\n\
         Shape { geometry USE B }\nP { }",
    );
    let boxes: Vec<&String> = found.iter().filter(|l| l.contains("<Box")).collect();
    let expected = [
        "<Box DEF='B' containerField='children'/>",
        "<Box DEF='B_2' containerField='children'/>",
        "<Box USE='B_2'/>",
    ];
    assert_eq!(boxes, expected.each_ref(), "{found:#?}");
}

#[test]
fn colors_beyond_one_are_limited_and_reported() {
    let text = "#VRML V2.0 utf8\nMaterial { emissiveColor 1.7 0.5 -1 }";
    assert!(scene(text)[0].contains("emissiveColor='1 0.5 0'"));
    let losses = converted(text, Target::X3d).losses;
    let codes: Vec<&str> = losses.iter().map(|loss| &*loss.code).collect();
    assert_eq!(codes, ["color-range"]);
}

#[test]
fn different_opacities_of_vertices_become_their_mean_with_a_loss() {
    let text = "#Inventor V2.1 ascii\nMaterial { diffuseColor [ 1 0 0, 0 1 0 ] transparency [ 0, 0.5 ] }\n\
         MaterialBinding { value PER_FACE }\nCoordinate3 { point [ 0 0 0, 1 0 0, 0 1 0, 1 1 0 ] }\n\
         IndexedFaceSet { coordIndex [ 0 1 2 -1 1 3 2 -1 ] }";
    let conversion = converted(text, Target::Vrml97);
    let has = conversion
        .losses
        .iter()
        .any(|loss| loss.code == "vertex-opacity");
    let written = String::from_utf8(conversion.bytes).unwrap();
    assert!(has && written.contains("transparency 0.25"), "{written}");
}

/// Converts a face of Inventor with red and blue vertices and other properties. Returns the scene,
/// which is read again, with the codes of the losses.
fn with_vertex_colors(
    properties: &str,
    target: Target,
) -> (Material, Vec<[f32; 4]>, Vec<Image>, Vec<String>) {
    let text = format!(
        "#Inventor V2.1 ascii\nEnvironment {{ ambientIntensity 0 }}
         ShapeHints {{ vertexOrdering COUNTERCLOCKWISE }}
         Material {{ diffuseColor [ 1 0 0, 0 0 1 ] transparency [ 0, 0.5 ] }}
         MaterialBinding {{ value PER_VERTEX_INDEXED }} {properties}
         Coordinate3 {{ point [ 0 0 0, 1 0 0, 0 1 0, 1 1 0 ] }}
         IndexedFaceSet {{ coordIndex [ 0 1 3 2 -1 ] materialIndex [ 0 1 0 1 -1 ] }}"
    );
    let conversion = converted(&text, target);
    let losses = conversion.losses.iter().map(|l| l.code.clone()).collect();
    let written = String::from_utf8(conversion.bytes).unwrap();
    let model = Model::at(&document(&written), 0.0, &ModelOptions::default());
    let mut colors = model.meshes[0].colors.clone();
    colors.sort_by(|a, b| a[0].total_cmp(&b[0]));
    colors.dedup();
    (model.materials[0].clone(), colors, model.images, losses)
}

#[test]
fn the_opacities_of_vertices_are_kept_in_x3d() {
    let own = [[0.0, 0.0, 1.0, 0.5], [1.0, 0.0, 0.0, 1.0]];
    let opaque = own.map(|[r, g, b, _]| [r, g, b, 1.0]);
    let unlit = "LightModel { model BASE_COLOR }";
    for (properties, target, is_unlit, expected, lost) in [
        ("", Target::X3d, false, own, false),
        (unlit, Target::X3d, true, own, false),
        (unlit, Target::Vrml97, true, opaque, true),
    ] {
        let (material, colors, _, losses) = with_vertex_colors(properties, target);
        assert_eq!((material.unlit, &colors[..]), (is_unlit, &expected[..]));
        assert_eq!(losses.contains(&"vertex-opacity".to_owned()), lost);
    }
}

/// VRML97, table 4.5: a texture in color replaces the colors of vertices, and a gray one multiplies
/// them.
#[test]
fn the_colors_of_vertices_under_a_texture_become_their_mean_in_vrml97() {
    let (_, colors, images, losses) =
        with_vertex_colors("Texture2 { image 1 1 3 0xffffff }", Target::Vrml97);
    assert_eq!((colors.len(), images[0].pixels[0]), (0, [128, 0, 128, 255]));
    assert_eq!(losses, ["vertex-colors"]);
    let (_, colors, images, losses) =
        with_vertex_colors("Texture2 { image 1 1 1 0xff }", Target::Vrml97);
    assert_eq!((colors.len(), images[0].pixels[0]), (2, [255; 4]));
    assert_eq!(losses, ["vertex-opacity"]);
    let (_, colors, images, losses) =
        with_vertex_colors("Texture2 { image 1 1 3 0xffffff }", Target::X3d);
    assert_eq!((colors.len(), images[0].pixels[0]), (2, [255; 4]));
    assert_eq!(losses, [""; 0]);
}

/// VRML97, 4.14: the alpha of a texture replaces the material's transparency.
#[test]
fn the_transparency_of_inventor_multiplies_the_alpha_of_a_texture_of_vrml97() {
    for (image, model, expected) in [
        ("1 1 2 0x80ff", "MODULATE", [128, 128, 128, 128]),
        ("1 1 4 0x0000ff80", "MODULATE", [0, 0, 255, 64]),
        // Without a material there is no other opacity.
        ("1 1 3 0x0000ff", "DECAL", [0, 0, 255, 128]),
    ] {
        let text = format!(
            "#Inventor V2.1 ascii\nMaterial {{ diffuseColor 1 1 1 transparency 0.5 }}
             Texture2 {{ image {image} model {model} }} Cube {{ }}"
        );
        let written = String::from_utf8(converted(&text, Target::Vrml97).bytes).unwrap();
        let model = Model::at(&document(&written), 0.0, &ModelOptions::default());
        assert_eq!(model.images[0].pixels[0], expected, "{written}");
    }
}

#[test]
fn what_x3d_does_not_have_is_reported_with_its_line() {
    let conversion = converted(
        "#VRML V2.0 utf8\nDEF G GeoOrigin { }\nUnheardOf { }\nDEF T TimeSensor { }\n",
        Target::X3d,
    );
    let found: Vec<(String, Option<u32>)> = conversion
        .losses
        .iter()
        .map(|loss| (loss.place.class.clone(), loss.place.line()))
        .collect();
    assert_eq!(
        found,
        [("GeoOrigin".into(), Some(2)), ("UnheardOf".into(), Some(3))]
    );
    let nothing = converted(
        "#VRML V2.0 utf8\nShape { geometry Sphere { } }",
        Target::X3d,
    );
    assert!(nothing.losses.is_empty());
}

/// The scene of the tests of Inventor's state: a color and a translation leak out of a group, and
/// a shape is used twice.
const INVENTOR: &str = "#Inventor V2.1 ascii\n\
     DirectionalLight { direction 0 -1 0 }\n\
     PerspectiveCamera { position 0 0 9 }\n\
     Group { Material { diffuseColor 1 0 0 } Translation { translation 5 0 0 } }\n\
     DEF box Separator { Rotation { rotation 0 0 1 0.5 } Scale { scaleFactor 1 3 1 }\n\
     Rotation { rotation 0 1 1 1 } Cube { } }\n\
     Separator { Translation { translation 0 7 0 } USE box }\n";

#[test]
fn the_state_of_inventor_becomes_shapes_with_materials() {
    let found = scene(INVENTOR);
    let materials = found.iter().filter(|l| l.starts_with("<Material"));
    assert_eq!(materials.clone().count(), 1, "{found:#?}");
    assert!(
        materials
            .clone()
            .all(|l| l.contains("diffuseColor='1 0 0'"))
    );
    assert_eq!(
        found.iter().filter(|l| l.starts_with("<Shape USE")).count(),
        1
    );
    // The second light has the ambient light.
    for (start, expected) in [
        ("<DirectionalLight", 2),
        ("<Viewpoint", 1),
        ("<NavigationInfo", 1),
        ("<IndexedFaceSet", 1),
    ] {
        let count = found.iter().filter(|l| l.starts_with(start)).count();
        assert_eq!(count, expected, "{start} in {found:#?}");
    }
}

#[test]
fn ambient_light_is_that_of_a_light_of_its_own() {
    let found = scene(
        "#Inventor V2.1 ascii\nEnvironment { ambientIntensity 0.5 ambientColor 1 0.8 0.6 }\n\
         PointLight { }\nMaterial { diffuseColor 0.8 0.4 0.2 ambientColor 0.4 0.2 0.1 }\nCube { }",
    );
    let starting = |start: &str| found.iter().find(|l| l.starts_with(start)).unwrap();
    let light = starting("<DirectionalLight");
    for field in [
        "color='1 0.8 0.6'",
        "intensity='0'",
        "ambientIntensity='0.5'",
    ] {
        assert!(light.contains(field), "{light}");
    }
    assert!(starting("<Material").contains("ambientIntensity='0.5'"));
    let own = "#VRML V2.0 utf8\nPointLight { ambientIntensity 0.3 }\nShape { geometry Box { } }";
    let glow = "#Inventor V2.1 ascii\nMaterial { diffuseColor 1 0 0 ambientColor 0 1 0 }\n\
                Environment { ambientIntensity 0.5 } Cube { }";
    let codes = |text: &str| -> Vec<String> {
        let losses = converted(text, Target::Vrml97).losses;
        losses.iter().map(|loss| loss.code.clone()).collect()
    };
    assert!(codes(own).is_empty());
    assert_eq!(codes(glow), ["ambient-color"]);
}

/// Returns the bounding box of a document, its triangles and its lights and cameras.
fn content(document: &Document) -> (Vec<f64>, u64, usize, usize) {
    let options = CompileOptions::default();
    let taken = snapshot(document, &SnapshotOptions::default(), &options);
    let survey = RenderScene::survey(&taken, &options);
    let (low, high) = survey.bounds.unwrap();
    let numbers = low.to_array().into_iter().chain(high.to_array());
    let counts = (survey.lights.len(), survey.cameras.len());
    (numbers.collect(), survey.triangles, counts.0, counts.1)
}

#[test]
fn vrml97_from_inventor_reads_back_with_the_same_content() {
    let before = content(&document(INVENTOR));
    let conversion = converted(INVENTOR, Target::Vrml97);
    let text = String::from_utf8(conversion.bytes).unwrap();
    let read = document(&text);
    let is_problem = |d: &crate::Diagnostic| d.kind != ErrorKind::Unsupported;
    let problems: Vec<_> = read.sink.items().iter().filter(|d| is_problem(d)).collect();
    assert!(problems.is_empty(), "{problems:?}\n{text}");
    let after = content(&read);
    assert_eq!(
        (before.1, before.2 + 1, before.3), // and a light with the ambient light
        (after.1, after.2, after.3),
        "{text}"
    );
    for (a, b) in before.0.iter().zip(&after.0) {
        assert!((a - b).abs() < 1e-5, "{before:?} {after:?}\n{text}");
    }
    // A second time nothing changes: the scene is VRML97 already.
    assert_eq!(converted(&text, Target::Vrml97).bytes, text.as_bytes());
}

#[test]
fn textures_are_inside_x3d_and_beside_vrml97() {
    let textured = "#Inventor V2.1 ascii\nMaterial { diffuseColor 0 1 1 }\n\
         Texture2 { image 2 1 3 0xff0000 0x00ff00 }\nTexture2Transform { scaleFactor 2 3 }\nCube { }";
    let found = scene(textured);
    let image = found
        .iter()
        .find(|l| l.starts_with("<ImageTexture"))
        .unwrap();
    assert!(
        image.contains("url='\"data:image/png;base64,iVBOR"),
        "{image}"
    );
    assert!(
        found
            .iter()
            .any(|l| l.starts_with("<TextureTransform") && l.contains("scale='2 3'"))
    );
    assert!(
        found
            .iter()
            .any(|l| l.starts_with("<Material") && l.contains("diffuseColor='0 1 1'"))
    );
    let options = ExportOptions {
        stem: "out".to_owned(),
        ..ExportOptions::default()
    };
    let beside = convert(&document(textured), Target::Vrml97, &options).unwrap();
    assert_eq!(beside.beside.len(), 1);
    assert_eq!(beside.beside[0].0, "out-wrl-1.png");
    // In VRML97 the picture replaces the color, so it is multiplied by it.
    let picture = image::load_from_memory(&beside.beside[0].1)
        .unwrap()
        .to_rgb8();
    assert_eq!(picture.into_raw(), [0, 0, 0, 0, 255, 0]);
    let piped = converted(textured, Target::Vrml97);
    assert!(
        String::from_utf8(piped.bytes)
            .unwrap()
            .contains("image 2 1 3")
    );
}

/// VRML97, table 4.5: a texture replaces colors, also those of a prototype, of vertices, and of a
/// route. It does so in X3D 3.3, and multiplies them in X3D 4.
#[test]
fn a_texture_replaces_in_the_version_of_x3d_what_it_replaced_in_the_scene() {
    let body = "PROTO P [ exposedField SFColor c 1 0 0 ] { Shape { appearance Appearance { \
        material Material { diffuseColor IS c } texture PixelTexture { image 1 1 3 0x00FF00 } } \
        geometry Box { } } } P { } DEF S Shape { appearance Appearance { \
        material Material { diffuseColor 0 0 1 transparency 0.5 } \
        texture PixelTexture { image 1 1 4 0x00FF00FF } } geometry IndexedFaceSet { \
        color Color { color 1 0 1 } colorPerVertex FALSE coordIndex [ 0 1 2 ] \
        coord Coordinate { point [ 0 0 0, 1 0 0, 0 1 0 ] } } }";
    for (head, version) in [
        ("#VRML V2.0 utf8\n", "3.3"),
        ("#X3D V3.0 utf8\nPROFILE Full\n", "3.3"),
        ("#X3D V4.0 utf8\nPROFILE Full\n", "4.0"),
    ] {
        let source = document(&format!("{head}{body}"));
        let written = converted(&format!("{head}{body}"), Target::X3d).bytes;
        let text = String::from_utf8(written.clone()).unwrap();
        assert!(text.contains(&format!("version='{version}'")), "{text}");
        assert!(text.contains("diffuseColor='0 0 1' transparency='0.5'"));
        let again = Document::read("a.x3d", written, Arc::new(NoFiles), &Limits::default());
        let materials = [&source, &again.unwrap()].map(|document| {
            let options = ExportOptions::default();
            let taken = snapshot(document, &snapshot_options(0.0), &options.model.compile);
            Model::of(&taken, &options.model).materials
        });
        assert_eq!(materials[0], materials[1], "{head}");
    }
}

#[test]
fn deep_nesting_neither_overflows_the_stack_nor_the_file() {
    let depth = 20_000;
    let deep = "Group { children ".repeat(depth) + "Group { }" + &" }".repeat(depth);
    let bytes = converted(&format!("#VRML V2.0 utf8\n{deep}"), Target::X3d).bytes;
    assert!(bytes.len() < depth * 200);
    assert_eq!(
        String::from_utf8(bytes).unwrap().matches("<Group").count(),
        depth + 1
    );
}

#[test]
fn appearances_with_the_same_picture_share_its_texture() {
    let text = "#Inventor V2.1 ascii\nTexture2 { image 2 1 3 0xff0000 0x00ff00 }\n\
         Material { diffuseColor 0 1 1 } Cube { } Material { diffuseColor 0 1 0 } Cube { }\n\
         Texture2 { image 2 1 3 0xff0000 0x00ff00 wrapS CLAMP } Cube { }";
    let found = scene(text);
    let textures: Vec<&String> = found
        .iter()
        .filter(|l| l.starts_with("<ImageTexture"))
        .collect();
    assert_eq!(textures.len(), 3, "{found:#?}");
    assert!(textures[0].contains("DEF='texture'") && textures[0].contains("data:image"));
    assert_eq!(textures[1], "<ImageTexture USE='texture'/>");
    assert!(textures[2].contains("repeatS='false'"), "{}", textures[2]);
}

#[test]
fn a_texture_matrix_that_vrml97_cannot_have_is_reported() {
    let codes = |transform: &str| -> Vec<String> {
        let text = format!(
            "#Inventor V2.1 ascii\nTexture2 {{ image 1 1 1 0x77 }}\n{transform} Cube {{ }}"
        );
        let losses = converted(&text, Target::Vrml97).losses;
        losses.iter().map(|loss| loss.code.clone()).collect()
    };
    let turn = "Texture2Transform { rotation 0.5 }";
    let stretch = "Texture2Transform { scaleFactor 1 3 translation 0.2 0.1 }";
    assert!(codes(stretch).is_empty());
    assert!(codes(turn).is_empty());
    // One of the two orders of a rotation and a scale is S·R, and the other one shears.
    let orders = [format!("{turn} {stretch}"), format!("{stretch} {turn}")];
    let mut found: Vec<Vec<String>> = orders.iter().map(|t| codes(t)).collect();
    found.sort();
    assert_eq!(found, [vec![], vec!["texture-matrix".to_owned()]]);
    assert_eq!(
        codes("Texture2Transform { scaleFactor 0 1 }"),
        ["texture-matrix"]
    );
}
