//! Tests of conversions, by what the files say.

use std::collections::HashSet;
use std::sync::Arc;

use ivcam_inventor::grammar::{class, vrml97_navigation_info};
use ivcam_inventor::iv::{ClassRef, Document, Format, Limits, NoFiles, NodeId};
use ivcam_render::scene::model::{Model, ModelOptions, Sampling};
use serde_json::Value as Json;

use super::{Conversion, ExportOptions, Target, convert};

mod losses;

fn document(text: &str) -> Document {
    let text = text.as_bytes().to_vec();
    Document::read("scene.iv", text, Arc::new(NoFiles), &Limits::default()).expect("reads")
}

fn converted(text: &str, target: Target) -> Conversion {
    let options = ExportOptions {
        stem: "scene".into(),
        sampling: Some(Sampling::default()),
        ..ExportOptions::default()
    };
    convert(&document(text), target, &options).expect("converts")
}

/// Converts a scene of Inventor to glTF as JSON.
fn gltf(text: &str) -> Json {
    let text = format!("#Inventor V2.1 ascii\n{text}");
    serde_json::from_slice(&converted(&text, Target::Gltf).bytes).expect("JSON")
}

/// The node with a name.
fn node<'j>(gltf: &'j Json, name: &str) -> &'j Json {
    let nodes = gltf["nodes"].as_array().expect("nodes");
    let found = nodes.iter().find(|n| n["name"] == name);
    found.unwrap_or_else(|| panic!("no node {name} in {gltf:#}"))
}

/// The codes of the losses of a scene.
fn losses(text: &str, target: Target) -> Vec<String> {
    let conversion = converted(text, target);
    conversion.losses.iter().map(|l| l.code.clone()).collect()
}

#[test]
fn names_matrices_and_shared_meshes_are_kept() {
    let gltf = gltf(
        "DEF ROOM Separator { Translation { translation 1 2 3 }\n  DEF BALL Sphere { }
         Separator { Translation { translation 4 0 0 } USE BALL } Cube { } }",
    );
    let room = node(&gltf, "ROOM");
    assert_eq!(room["translation"], serde_json::json!([1.0, 2.0, 3.0]));
    let children = room["children"].as_array().expect("children");
    let child = |i: usize| &gltf["nodes"][children[i].as_u64().expect("an index") as usize];
    assert_eq!(child(0)["name"], "BALL");
    assert_eq!(child(1)["translation"], serde_json::json!([4.0, 0.0, 0.0]));
    assert_eq!(child(0)["mesh"], child(1)["mesh"]);
    assert_eq!(child(2)["name"], "Cube");
    assert_eq!(gltf["meshes"].as_array().map(Vec::len), Some(2));
}

#[test]
fn inventors_state_is_resolved_for_each_shape() {
    let text = "Material { diffuseColor 1 0 0 } Cube { } Group { Scale { scaleFactor 2 1 1 } }
                Material { diffuseColor 0 0 0.5 shininess 1 specularColor 1 1 1 } Cube { }";
    let gltf = gltf(text);
    let materials = gltf["materials"].as_array().expect("materials");
    let color = |i: usize| &materials[i]["pbrMetallicRoughness"]["baseColorFactor"];
    assert_eq!(*color(0), serde_json::json!([1.0, 0.0, 0.0, 1.0]));
    // 0.5 on a screen has 21.4% of the light.
    assert!((color(1)[2].as_f64().unwrap() - 0.214_041).abs() < 1e-5);
    assert!(materials[0]["extensions"]["KHR_materials_specular"]["specularFactor"] == 0.0);
    // α² = 2 / 130.
    let roughness = materials[1]["pbrMetallicRoughness"]["roughnessFactor"].as_f64();
    assert!((roughness.unwrap() - (2.0f64 / 130.0).powf(0.25)).abs() < 1e-6);
    let second = gltf["nodes"]
        .as_array()
        .unwrap()
        .iter()
        .filter(|n| n["name"] == "Cube");
    let scales: Vec<&Json> = second.map(|n| &n["scale"]).collect();
    assert_eq!(scales, [&Json::Null, &serde_json::json!([2.0, 1.0, 1.0])]);
}

#[test]
fn colors_of_vertices_are_linear_and_transparent_ones_blend() {
    let gltf = gltf(
        "PackedColor { orderedRGBA [0xff0000ff, 0x00800080] } MaterialBinding { value PER_FACE }
         Coordinate3 { point [0 0 0, 1 0 0, 1 1 0, 0 1 0] } FaceSet { numVertices [3, 3] }
         IndexedFaceSet { coordIndex [0, 1, 2, -1, 0, 2, 3, -1] }",
    );
    let primitive = &gltf["meshes"][1]["primitives"][0];
    let color = primitive["attributes"]["COLOR_0"].as_u64().expect("colors") as usize;
    assert_eq!(gltf["accessors"][color]["normalized"], true);
    let material = primitive["material"].as_u64().expect("a material") as usize;
    assert_eq!(gltf["materials"][material]["alphaMode"], "BLEND");
}

#[test]
fn a_scene_far_from_the_origin_is_moved_and_says_by_how_much() {
    let text = "Separator { Translation { translation 5e6 0 -4e5 }
                Coordinate3 { point [0 0 0, 1 0 0, 0 1 0] } FaceSet { numVertices 3 } }
                Coordinate3 { point [5000000 2 -400000, 5000001 2 -400000, 5000000 3 -400000] }
                FaceSet { numVertices 3 }";
    let scene = format!("#Inventor V2.1 ascii\n{text}");
    let model = Model::at(&document(&scene), 0.0, &ModelOptions::default());
    assert_eq!(model.offset.to_array(), [5_000_001.0, 2.0, -400_000.0]);
    let (min, max) = model.bounds().expect("two triangles");
    assert_eq!(min.to_array(), [-1.0, -2.0, 0.0]);
    assert_eq!(max.to_array(), [0.0, 1.0, 0.0]);
    let gltf = gltf(text);
    let offset = &gltf["nodes"][0]["extras"]["offset"];
    assert_eq!(*offset, serde_json::json!([5_000_001.0, 2.0, -400_000.0]));
    let options = ModelOptions {
        recenter: false,
        ..ModelOptions::default()
    };
    let model = Model::at(&document(&scene), 0.0, &options);
    assert_eq!(model.bounds().expect("two").1.x, 5_000_001.0);
    assert_eq!(losses(&scene, Target::Ply), ["ambient-light", "offset"]);
}

#[test]
fn what_moves_becomes_an_animation() {
    let gltf = gltf(
        "Separator { DEF TURN Rotor { speed 0.5 } DEF A Separator { Cube { } } }
         DEF B Blinker { whichChild 0 speed 1 Cube { } Sphere { } } DEF STILL Separator { Cone { } }",
    );
    let channels = gltf["animations"][0]["channels"]
        .as_array()
        .expect("channels");
    let paths: Vec<&str> = channels
        .iter()
        .filter_map(|c| c["target"]["path"].as_str())
        .collect();
    assert_eq!(paths, ["rotation", "scale"]);
    let samplers = &gltf["animations"][0]["samplers"];
    assert_eq!(samplers[1]["interpolation"], "STEP");
    let times = samplers[0]["input"].as_u64().expect("times") as usize;
    assert_eq!(gltf["accessors"][times]["max"][0], 2.0);
}

/// A range and a cone of glTF have their own numbers, and lose nothing.
#[test]
fn a_light_of_gltf_goes_through_gltf_whole() {
    let scene = r#"{ "asset": { "version": "2.0" }, "scene": 0, "scenes": [ { "nodes": [ 0 ] } ],
        "nodes": [ { "extensions": { "KHR_lights_punctual": { "light": 0 } } } ],
        "extensionsUsed": [ "KHR_lights_punctual" ],
        "extensions": { "KHR_lights_punctual": { "lights": [ { "type": "spot", "range": 2.5,
            "spot": { "innerConeAngle": 0.25, "outerConeAngle": 0.5 } } ] } } }"#;
    let conversion = converted(scene, Target::Gltf);
    assert!(conversion.losses.is_empty(), "{:?}", conversion.losses);
    let gltf: Json = serde_json::from_slice(&conversion.bytes).expect("JSON");
    let light = &gltf["extensions"]["KHR_lights_punctual"]["lights"][0];
    assert_eq!(light["range"], 2.5);
    assert_eq!(light["spot"]["outerConeAngle"], 0.5);
    let as_vrml = converted(scene, Target::Vrml97).losses;
    assert!(as_vrml.iter().any(|loss| loss.code == "spot-falloff"));
}

/// `KHR_lights_punctual`: scales and rotations act on a light by its position only.
#[test]
fn a_light_of_gltf_is_not_scaled() {
    for scale in [0.01, 1.0, 2.0] {
        let place = 6.0 / scale;
        let scene = format!(
            r#"{{ "asset": {{ "version": "2.0" }}, "scene": 0, "scenes": [ {{ "nodes": [ 0 ] }} ],
            "nodes": [ {{ "scale": [ {scale}, {scale}, {scale} ], "children": [ 1 ] }},
                {{ "translation": [ {place}, 0, 0 ],
                   "extensions": {{ "KHR_lights_punctual": {{ "light": 0 }} }} }} ],
            "extensionsUsed": [ "KHR_lights_punctual" ],
            "extensions": {{ "KHR_lights_punctual": {{ "lights": [
                {{ "type": "point", "intensity": 20, "range": 3 }} ] }} }} }}"#
        );
        let model = Model::at(&document(&scene), 0.0, &ModelOptions::default());
        let light = &model.lights[0];
        assert!((light.position.x - 6.0).abs() < 1e-5, "{scale}");
        assert_eq!((light.radius, light.attenuation), (3.0, glam::Vec3::X));
        let gltf: Json =
            serde_json::from_slice(&converted(&scene, Target::Gltf).bytes).expect("JSON");
        assert_eq!(
            gltf["extensions"]["KHR_lights_punctual"]["lights"][0]["range"],
            3.0
        );
    }
}

/// A box moves away by 20 m and back, and a camera toward it from 30 m to 10 m.
#[test]
fn the_planes_of_a_camera_enclose_the_scene_at_all_times() {
    let scene = "#VRML V2.0 utf8\nDEF T TimeSensor { cycleInterval 2 loop TRUE }
        DEF V Viewpoint { position 0 0 30 } Viewpoint { position 0 0 10 }
        DEF P PositionInterpolator { key [ 0 .5 1 ] keyValue [ 0 0 0, 0 0 -20, 0 0 0 ] }
        DEF Q PositionInterpolator { key [ 0 .5 1 ] keyValue [ 0 0 30, 0 0 10, 0 0 30 ] }
        DEF A Transform { children Transform { children Shape { geometry Box { } } } }
        ROUTE T.fraction_changed TO P.set_fraction ROUTE P.value_changed TO A.translation
        ROUTE T.fraction_changed TO Q.set_fraction ROUTE Q.value_changed TO V.position";
    let gltf: Json = serde_json::from_slice(&converted(scene, Target::Gltf).bytes).expect("JSON");
    let usd = String::from_utf8(converted(scene, Target::Usda).bytes).expect("text");
    let ranges = usd
        .lines()
        .filter_map(|line| line.trim().strip_prefix("float2 clippingRange = "));
    let ranges: Vec<Vec<f64>> = ranges
        .map(|pair| {
            pair.trim_matches(['(', ')'])
                .split(", ")
                .map(|n| n.parse().unwrap())
                .collect()
        })
        .collect();
    for (number, [nearest, farthest]) in [[9.0, 51.0], [9.0, 31.0]].into_iter().enumerate() {
        let written = &gltf["cameras"][number]["perspective"];
        for [near, far] in [
            ["znear", "zfar"].map(|name| written[name].as_f64().expect("a distance")),
            [ranges[number][0], ranges[number][1]],
        ] {
            // The sphere around a box is larger.
            assert!(near < nearest && near > 0.0, "{number}: {near}");
            assert!(far > farthest && far < farthest + 4.0, "{number}: {far}");
        }
    }
}

#[test]
fn a_texture_is_embedded_with_its_transform() {
    let gltf = gltf(
        "Texture2 { image 2 1 3 0xff0000 0x00ff00 wrapT CLAMP }
         Texture2Transform { scaleFactor 2 3 translation 0.25 0 } Cube { }",
    );
    let texture = &gltf["materials"][0]["pbrMetallicRoughness"]["baseColorTexture"];
    let transform = &texture["extensions"]["KHR_texture_transform"];
    assert_eq!(transform["scale"], serde_json::json!([2.0, 3.0]));
    assert_eq!(transform["offset"], serde_json::json!([0.25, -2.0]));
    assert_eq!(gltf["samplers"][0]["wrapS"], 10_497);
    assert_eq!(gltf["samplers"][0]["wrapT"], 33_071);
    assert_eq!(gltf["images"][0]["mimeType"], "image/png");
    let used = gltf["extensionsUsed"].as_array().expect("extensions");
    assert!(used.contains(&"KHR_texture_transform".into()));
}

#[test]
fn lights_and_cameras_have_their_places_and_units() {
    let gltf = gltf(
        "DEF EYE PerspectiveCamera { position 0 0 5 heightAngle 0.8 }
         DirectionalLight { direction 0 -1 0 intensity 0.5 } SpotLight { cutOffAngle 0.5 } Cube { }",
    );
    let eye = node(&gltf, "EYE");
    assert_eq!(eye["translation"], serde_json::json!([0.0, 0.0, 5.0]));
    let angle = gltf["cameras"][0]["perspective"]["yfov"]
        .as_f64()
        .expect("an angle");
    assert!((angle - 0.8).abs() < 1e-6);
    let lights = &gltf["extensions"]["KHR_lights_punctual"]["lights"];
    let lux = lights[0]["intensity"].as_f64().expect("an intensity");
    assert!(
        (lux - std::f64::consts::PI * 0.214_041).abs() < 1e-4,
        "{lux}"
    );
    // A color above 1 is a stronger light: 0.5 on a screen is 0.214 of its light, and 2 is 4.954.
    let bright = self::gltf("DirectionalLight { color 2 1 0.5 } Cube { }");
    let bright = &bright["extensions"]["KHR_lights_punctual"]["lights"][0];
    let number = |value: &Json| value.as_f64().expect("a number");
    for (i, light) in [4.953_846, 1.0, 0.214_041].into_iter().enumerate() {
        let product = number(&bright["intensity"]) * number(&bright["color"][i]);
        assert!(
            (product - std::f64::consts::PI * light).abs() < 1e-4,
            "{bright}"
        );
        assert!(number(&bright["color"][i]) <= 1.0);
    }
    let cone = lights[1]["spot"]["outerConeAngle"]
        .as_f64()
        .expect("a cone");
    assert!((cone - 0.5).abs() < 1e-6);
}

#[test]
fn the_front_of_a_face_is_where_its_normal_points() {
    // The order of corners is unknown, so the normal alone decides.
    let text = "#Inventor V2.1 ascii\nNormal { vector 0 0 -1 } NormalBinding { value OVERALL }
                Coordinate3 { point [0 0 0, 1 0 0, 0 1 0] } FaceSet { numVertices 3 }";
    let front = |text: &str| {
        let model = Model::at(&document(text), 0.0, &ModelOptions::default());
        let mesh = &model.meshes[0];
        let [a, b, c] = mesh.triangles()[0].map(|v| mesh.positions[v as usize]);
        (b - a).cross(c - a).z
    };
    assert_eq!(front(text), -1.0);
    let known = text.replace(
        "Normal {",
        "ShapeHints { vertexOrdering COUNTERCLOCKWISE } Normal {",
    );
    assert_eq!(front(&known), 1.0);
    let clockwise = known.replace("COUNTERCLOCKWISE", "CLOCKWISE");
    assert_eq!(front(&clockwise), -1.0);
    // A mirroring matrix exchanges the sides in Inventor, and not in glTF.
    let mirrored = known.replace("ShapeHints", "Scale { scaleFactor -1 1 1 } ShapeHints");
    assert_eq!(front(&mirrored), -1.0);
}

/// Decision 16: a matrix that mirrors exchanges front and back of a face of VRML97.
#[test]
fn faces_with_a_repeated_vertex_are_not_written() {
    let scene = "#VRML V2.0 utf8\nShape { geometry IndexedFaceSet {
           coord Coordinate { point [ 0 0 0, 1 0 0, 1 1 0 ] }
           coordIndex [ 0 1 1 -1, 0 0 0 -1, 0 1 2 -1, 0 1 0 2 -1 ] } }";
    let obj = String::from_utf8(converted(scene, Target::Obj).bytes).expect("text");
    let faces = obj.lines().filter(|line| line.starts_with("f "));
    for face in faces.clone() {
        let corners: HashSet<&str> = face.split(' ').skip(1).collect();
        assert_eq!(corners.len(), 3, "{face}");
    }
    // Of the last face the triangulation may leave one triangle.
    assert!((1..=2).contains(&faces.count()), "{obj}");
}

#[test]
fn a_mirrored_face_keeps_its_front_in_every_graph_of_nodes() {
    let scene = "#Inventor V2.1 ascii\nShapeHints { vertexOrdering CLOCKWISE shapeType SOLID }
                 Coordinate3 { point [ 0 0 0, 1 0 0, 0 1 0 ] } DEF FACE FaceSet { numVertices 3 }
                 Separator { Scale { scaleFactor -1 1 1 } USE FACE }";
    // The z of the front of each face in the world.
    let fronts = |document: &Document| {
        let model = Model::at(document, 0.0, &ModelOptions::default());
        let placed = model.placed_meshes().map(|(mesh, _, world, _)| {
            let corners = mesh.triangles()[0].map(|v| mesh.positions[v as usize].as_dvec3());
            let [a, b, c] = corners.map(|p| world.transform_point3(p));
            // The order of a mesh under a matrix that mirrors is that of the mesh's own space.
            (b - a).cross(c - a).z * world.matrix3.determinant().signum()
        });
        placed.collect::<Vec<_>>()
    };
    assert_eq!(fronts(&document(scene)), [-1.0, 1.0]);
    for target in [Target::X3d, Target::Vrml97, Target::Inventor] {
        let written = String::from_utf8(converted(scene, target).bytes).expect("text");
        assert_eq!(fronts(&document(&written)), [-1.0, 1.0], "{written}");
    }
}

#[test]
fn colors_of_vertices_without_lighting_stay_as_they_are() {
    let scene = "#Inventor V2.1 ascii\nLightModel { model BASE_COLOR }
                 Material { diffuseColor [ 1 0 0, 0 .5 0, 0 0 .25 ] }
                 MaterialBinding { value PER_VERTEX }
                 Coordinate3 { point [ 0 0 0, 1 0 0, 0 1 0 ] } FaceSet { numVertices 3 }";
    let look = |document: &Document| {
        let model = Model::at(document, 0.0, &ModelOptions::default());
        let (mesh, material, ..) = model.placed_meshes().next().expect("a face");
        (material.unlit, material.emissive, mesh.colors.clone())
    };
    let original = look(&document(scene));
    assert!(original.0 && original.2.len() == 3);
    for target in [Target::X3d, Target::Vrml97, Target::Inventor] {
        let written = String::from_utf8(converted(scene, target).bytes).expect("text");
        assert_eq!(look(&document(&written)), original, "{written}");
    }
}

/// A triangle of X3D with a metal of a base color, and other fields and attributes.
fn metal(attributes: &str, fields: &str) -> String {
    format!(
        "<X3D profile='Full' version='4.0'><Scene><Shape><Appearance><PhysicalMaterial metallic='1' \
         roughness='.3' {attributes}/></Appearance><TriangleSet>\
         <Coordinate point='0 0 0 1 0 0 0 1 0'/>{fields}</TriangleSet></Shape></Scene></X3D>"
    )
}

#[test]
fn the_colors_of_vertices_of_a_metal_come_back_from_gltf() {
    let scene = metal("", "<Color color='.9 .6 .2 .9 .6 .2 .1 .2 .3'/>");
    let colors = |document: &Document| {
        let model = Model::at(document, 0.0, &ModelOptions::default());
        let colors = model.meshes[0].colors.iter();
        // glTF has 16 bits for each.
        colors
            .map(|c| c.map(|v| (v * 1000.0).round()))
            .collect::<Vec<_>>()
    };
    let original = colors(&document(&scene));
    assert_eq!(original.len(), 3);
    let written = String::from_utf8(converted(&scene, Target::Gltf).bytes).expect("text");
    assert_eq!(colors(&document(&written)), original);
    let usd = String::from_utf8(converted(&scene, Target::Usda).bytes).expect("text");
    let list = usd
        .lines()
        .find(|line| line.contains("displayColor = "))
        .expect("colors");
    let numbers = list
        .split(['(', ',', ')', '[', ']'])
        .filter_map(|w| w.trim().parse::<f32>().ok());
    let expected = [0.9, 0.6, 0.2, 0.9, 0.6, 0.2, 0.1, 0.2, 0.3];
    assert!(
        numbers.zip(expected).all(|(a, b)| (a - b).abs() < 1e-6),
        "{list}"
    );
}

#[test]
fn the_strength_of_a_physical_material_comes_back_from_gltf() {
    let scene = "<X3D profile='Full' version='4.0'><Scene><Shape><Appearance><PhysicalMaterial>\
        <SpecularMaterialExtension containerField='extensions' specularStrength='.5' \
        specularColor='1 .5 .25'/></PhysicalMaterial></Appearance><TriangleSet>\
        <Coordinate point='0 0 0 1 0 0 0 1 0'/></TriangleSet></Shape></Scene></X3D>";
    let written = String::from_utf8(converted(scene, Target::Gltf).bytes).expect("text");
    let model = Model::at(&document(&written), 0.0, &ModelOptions::default());
    let own = model.materials[0].physical.expect("a physical material");
    assert_eq!(own.grazing, 0.5);
    let off = own.dielectric - 0.02 * glam::Vec3::new(1.0, 0.5, 0.25);
    assert!(off.length() < 1e-8, "{}", own.dielectric);
}

#[test]
fn a_metal_is_a_metal_in_usd() {
    let scene = metal("baseColor='.9 .6 .2'", "");
    let usd = String::from_utf8(converted(&scene, Target::Usda).bytes).expect("text");
    let input = |name: &str| {
        let line = usd
            .lines()
            .find(|line| line.contains(&format!("inputs:{name} = ")));
        line.and_then(|line| Some(line.split_once(" = ")?.1.to_owned()))
    };
    assert_eq!(input("useSpecularWorkflow").as_deref(), Some("0"));
    assert_eq!(input("metallic").as_deref(), Some("1"));
    assert_eq!(input("specularColor"), None);
    // The index of glTF's dielectrics, whose reflectance is 0.04.
    let index = input("ior")
        .and_then(|text| text.parse::<f32>().ok())
        .expect("an index");
    assert!((index - 1.5).abs() < 1e-5);
    let color = input("diffuseColor").expect("a color");
    let numbers = color
        .split(['(', ',', ')'])
        .filter_map(|w| w.trim().parse::<f32>().ok());
    assert!(
        numbers
            .zip([0.9, 0.6, 0.2])
            .all(|(a, b)| (a - b).abs() < 1e-6),
        "{color}"
    );
}

/// In Inventor's files VRML97 has no ambient light and a headlight beside lights only if they say
/// so.
#[test]
fn the_light_of_vrml97_is_stated_in_inventors_binary_form() {
    let lit = "DirectionalLight { } Shape { appearance Appearance { material Material { } }
               geometry Box { } }";
    for (info, headlight) in [("", true), ("NavigationInfo { headlight FALSE }", false)] {
        let scene = document(&format!("#VRML V2.0 utf8\n{info} {lit}"));
        let bytes = scene.in_inventor(Format::Binary).write(Format::Binary);
        let limits = Limits::default();
        let again = Document::read("scene.iv", bytes, Arc::new(NoFiles), &limits).expect("reads");
        let model = Model::at(&again, 0.0, &ModelOptions::default());
        assert_eq!(model.materials[0].ambient_light, glam::Vec3::ZERO);
        let info = again
            .nodes
            .iter()
            .position(|node| node.class == ClassRef::Known(class::VRML97_NAVIGATION_INFO));
        let info = again.node(NodeId(info.expect("a NavigationInfo") as u32));
        assert_eq!(info.get(vrml97_navigation_info::HEADLIGHT), headlight);
    }
}

#[test]
fn a_wire_sphere_has_the_wires_of_its_complexity_at_any_tolerance() {
    let lines = |style: &str, tolerance: f64| {
        let text = format!("#Inventor V2.1 ascii\nDrawStyle {{ style {style} }} Sphere {{ }}");
        let options = ModelOptions {
            tolerance,
            ..ModelOptions::default()
        };
        Model::at(&document(&text), 0.0, &options).meshes[0].clone()
    };
    assert_eq!(lines("LINES", 0.0005), lines("LINES", 0.01));
    assert_ne!(lines("FILLED", 0.0005), lines("FILLED", 0.01));
}

#[test]
fn a_text_in_pixels_alone_has_the_size_that_it_has_in_pictures() {
    let text = "#Inventor V2.1 ascii\nText2 { string \"habla\" }";
    let conversion = converted(text, Target::Glb);
    assert!(!conversion.is_empty);
    let rewritten = converted(text, Target::Inventor);
    assert!(!rewritten.is_empty);
}

/// The files show what VRML 1.0 means otherwise than Inventor: `PER_VERTEX`, the crease angle and
/// materials of computed light.
#[test]
fn what_vrml_1_means_otherwise_than_inventor_is_written_in_inventors_terms() {
    let scenes = ["precomputed", "shape-hints", "material-binding"].map(|name| {
        let path = format!(
            "{}/tests/golden/vrml1/{name}.wrl",
            env!("CARGO_MANIFEST_DIR")
        );
        std::fs::read_to_string(path).expect("a scene")
    });
    let own = "#VRML V1.0 ascii\nSeparator {
        Coordinate3 { point [ -2 -2 0, 0 -2 .4, 2 -2 0, -2 2 0, 0 2 .4, 2 2 0 ] }
        Material { diffuseColor [ 1 0 0, 0 1 0, 0 0 1, 1 1 0, 1 0 1, 0 1 1 ] }
        DEF FACES IndexedFaceSet { coordIndex [ 0, 1, 4, 3, -1, 1, 2, 5, 4, -1 ] }
        MaterialBinding { value PER_VERTEX } USE FACES
        IndexedLineSet { coordIndex [ 5, 0, 2, -1, 3, 1, -1 ] } PointSet { }
        Normal { vector [ 0 0 1, 0 1 0, 1 0 0, 0 0 1, 0 1 0, 1 0 0 ] }
        NormalBinding { value PER_VERTEX } USE FACES ShapeHints { shapeType SOLID } USE FACES }";
    for scene in scenes.iter().map(String::as_str).chain([own]) {
        let original = document(scene);
        let looks = |document: &Document| {
            let model = Model::at(document, 0.0, &ModelOptions::default());
            let parts = model.placed_meshes();
            let parts = parts.map(|(mesh, material, ..)| (mesh.clone(), material.clone()));
            parts.collect::<Vec<_>>()
        };
        for format in [Format::Ascii, Format::Binary] {
            let bytes = original.in_inventor(format).write(format);
            let limits = Limits::default();
            let again = Document::read("scene.iv", bytes, Arc::new(NoFiles), &limits);
            assert_eq!(looks(&again.expect("reads")), looks(&original), "{scene}");
        }
    }
}

/// The numbers come from the files as a reader finds them.
#[test]
fn every_format_has_the_same_triangles() {
    let text = "#Inventor V2.1 ascii\nSeparator { Scale { scaleFactor -1 2 1 } Cube { } Cone { } }
                Cylinder { height 3 }";
    let count = Model::at(&document(text), 0.0, &ModelOptions::default()).triangle_count();
    assert_eq!(count, 12 + (32 + 30) + (64 + 30 + 30));
    let obj = String::from_utf8(converted(text, Target::Obj).bytes).expect("text");
    assert_eq!(obj.lines().filter(|l| l.starts_with("f ")).count(), count);
    let ply = converted(text, Target::Ply).bytes;
    let header = String::from_utf8_lossy(&ply);
    assert!(
        header.contains(&format!("element face {count}\n")),
        "{count}"
    );
    let usd = String::from_utf8(converted(text, Target::Usda).bytes).expect("text");
    let lists = usd.lines().filter(|l| l.contains("faceVertexCounts"));
    assert_eq!(lists.map(|l| l.matches('3').count()).sum::<usize>(), count);
    let text = text.split_once('\n').expect("a header").1;
    let gltf = gltf(text);
    let indices = gltf["meshes"]
        .as_array()
        .expect("meshes")
        .iter()
        .map(|mesh| {
            let accessor = mesh["primitives"][0]["indices"].as_u64().expect("indices");
            gltf["accessors"][accessor as usize]["count"]
                .as_u64()
                .expect("a count")
        });
    assert_eq!(indices.sum::<u64>() as usize, 3 * count);
}

#[test]
fn numbers_that_are_not_finite_do_not_reach_the_json_of_gltf() {
    let mut failed = Vec::new();
    // The reader makes infinity of 1e39.
    for scene in [
        "PointLight { location 1e39 0 0 intensity 1e39 color 1e39 0 0 }",
        "PointLight { location 1e30 0 0 intensity 1e38 }",
        "DirectionalLight { intensity 1e30 direction 1e39 0 0 }",
        "SpotLight { dropOffRate 1e39 cutOffAngle 1e39 location 0 0 -1e39 }",
        "Environment { attenuation 1e39 0 0 } PointLight { }",
        "PerspectiveCamera { position 0 1e39 0 orientation 1e39 0 0 1 heightAngle 1e39 }",
        "OrthographicCamera { position 0 1e25 0 height 1e39 }",
        "Separator { Translation { translation 1e38 0 0 } Cube { } }",
        "Separator { Scale { scaleFactor 1e-30 1e-30 1e-30 } Cube { } Separator { Cube { }
         Translation { translation 1e10 0 0 } Sphere { } } }",
        "Separator { Scale { scaleFactor 1e17 1e17 1e17 } Coordinate3 { point [1e30 0 0, 1.1e30 0 0,
         1e30 1e25 0] } FaceSet { numVertices 3 } }",
        "Texture2 { image 1 1 1 0x77 } Texture2Transform { translation 3e38 3e38
         scaleFactor 3e38 3e38 } Cube { }",
        "Material { diffuseColor 1e39 0 0 emissiveColor 1e39 0 0 shininess 1e39 transparency 1e39 }",
    ] {
        let text = format!("#Inventor V2.1 ascii\n{scene} Cone {{ }}");
        let bytes = converted(&text, Target::Glb).bytes;
        let length = u32::from_le_bytes(bytes[12..16].try_into().expect("four bytes"));
        let json = String::from_utf8_lossy(&bytes[20..20 + length as usize]);
        assert!(json.contains("\"meshes\":["), "{scene}: {json}");
        if json.contains("null") {
            failed.push((scene, json.into_owned()));
        }
    }
    assert!(failed.is_empty(), "{failed:#?}");
}

#[test]
fn a_light_without_a_finite_position_is_at_the_default_of_its_class() {
    let gltf =
        gltf("DEF A PointLight { location 1e39 0 0 } PointLight { location 2 0 0 } Cube { }");
    assert_eq!(
        node(&gltf, "A")["translation"],
        serde_json::json!([0.0, 0.0, 1.0])
    );
    let second = node(&gltf, "PointLight");
    assert_eq!(second["translation"], serde_json::json!([2.0, 0.0, 0.0]));
}

#[test]
fn deep_groups_do_not_make_usd_quadratic() {
    let depth = 1_000;
    let group = "Separator { Translation { translation 1 0 0 } Cube { } ";
    let text = format!(
        "#Inventor V2.1 ascii\n{}{}",
        group.repeat(depth),
        "}".repeat(depth)
    );
    let size = |text: &str| converted(text, Target::Usda).bytes.len();
    assert!(size(&text) < 3_000 * depth, "{}", size(&text));
}

#[test]
fn names_of_files_and_texture_coordinates_cannot_break_text_formats() {
    let scene = "#Inventor V2.1 ascii\nTexture2 { image 1 1 3 0xff0000 }
                 Texture2Transform { translation 3e38 3e38 scaleFactor 3e38 3e38 }
                 TextureCoordinate2 { point [2 2, 3 3, 4 5] }
                 Coordinate3 { point [0 0 0, 1 0 0, 0 1 0] } FaceSet { numVertices 3 }";
    let options = ExportOptions {
        stem: "a@b\nc".into(),
        ..ExportOptions::default()
    };
    let of = |target| convert(&document(scene), target, &options).expect("converts");
    let words = |bytes: &[u8]| {
        let text = String::from_utf8_lossy(bytes).into_owned();
        let mut words = text.split(|c: char| !c.is_ascii_alphanumeric());
        assert!(words.all(|w| w != "inf" && w != "NaN"), "{text}");
        text
    };
    let obj = of(Target::Obj);
    assert!(words(&obj.bytes).contains("mtllib a@b_c.mtl\n"));
    let names: Vec<&str> = obj.beside.iter().map(|(name, _)| &**name).collect();
    assert_eq!(names, ["a@b_c.mtl", "a@b_c-obj-1.png"]);
    let usd = of(Target::Usda);
    assert!(words(&usd.bytes).contains("= @@@./a@bc-usda-1.png@@@\n"));
    assert_eq!(usd.beside[0].0, "a@bc-usda-1.png");
}

#[test]
fn a_usd_shape_is_bound_to_a_material_that_the_stage_defines() {
    let text =
        "#Inventor V2.1 ascii\nMaterial { diffuseColor 1 0 0 } Cube { } Material { } Sphere { }";
    let usd = String::from_utf8(converted(text, Target::Usda).bytes).expect("text");
    let bound = usd.lines().filter_map(|line| {
        line.trim()
            .strip_prefix("rel material:binding = </Scene/Materials/")
    });
    let names: Vec<&str> = bound.map(|rest| rest.trim_end_matches('>')).collect();
    assert_eq!(names.len(), 2, "{usd}");
    assert!(usd.contains("def Scope \"Materials\""));
    for name in names {
        assert!(usd.contains(&format!("def Material \"{name}\"")), "{name}");
    }
}
