//! Scenes in VRML97 that are written as Inventor and read back.

use std::sync::Arc;

use glam::{Affine2, DVec3, Vec3};
use ivcam_inventor::iv::{Document, Limits, NoFiles};
use ivcam_render::scene::model::{
    LightShape, Material, Mesh, Model, ModelOptions, Primitives, SceneCamera, SceneLight,
};

use crate::export::{Conversion, ExportOptions, Target, convert};

fn document(name: &str, bytes: &[u8]) -> Document {
    let limits = Limits::default();
    Document::read(name, bytes.to_vec(), Arc::new(NoFiles), &limits).expect("a scene")
}

fn converted(text: &str) -> Conversion {
    let text = format!("#VRML V2.0 utf8\n{text}");
    let scene = document("a.wrl", text.as_bytes());
    convert(&scene, Target::Inventor, &ExportOptions::default()).expect("a conversion")
}

/// Returns the text of a converted scene.
fn written(text: &str) -> String {
    String::from_utf8(converted(text).bytes).expect("text")
}

fn model(document: &Document) -> Model {
    Model::at(document, 0.0, &ModelOptions::default())
}

/// Returns the models of a scene and of its conversion, which has to be read without a diagnostic.
fn both(text: &str) -> [Model; 2] {
    let original = document("a.wrl", format!("#VRML V2.0 utf8\n{text}").as_bytes());
    let file = written(text);
    let read = document("a.iv", file.as_bytes());
    assert!(file.starts_with("#Inventor V2.1 ascii\n"), "{file}");
    assert!(read.sink.items().is_empty(), "{:?}", read.sink.items());
    [model(&original), model(&read)]
}

/// Returns the codes of the losses of a scene.
fn losses(text: &str) -> Vec<String> {
    let losses = converted(text).losses;
    losses.iter().map(|loss| loss.code.clone()).collect()
}

/// The numbers of a material.
fn numbers(material: &Material) -> Vec<f32> {
    let colors = [
        material.ambient,
        material.diffuse,
        material.specular,
        material.emissive,
    ];
    let mut numbers: Vec<f32> = colors.iter().flat_map(Vec3::to_array).collect();
    numbers.extend([material.shininess, material.transparency]);
    numbers.extend([material.unlit, material.double_sided].map(|b| f32::from(u8::from(b))));
    numbers
}

/// The numbers of a light.
fn light_numbers(light: &SceneLight) -> Vec<f32> {
    let mut numbers = light.color.to_array().to_vec();
    numbers.push(light.intensity);
    numbers.extend(light.attenuation.to_array());
    let mut place = |v: DVec3| numbers.extend(v.as_vec3().to_array());
    if light.shape != LightShape::Directional {
        place(light.position);
    }
    if light.shape != LightShape::Point {
        place(light.direction);
    }
    if let LightShape::Spot { inner, outer, .. } = light.shape {
        numbers.extend([inner.min(outer), outer]);
    }
    numbers
}

fn camera_numbers(camera: &SceneCamera) -> Vec<f32> {
    let pose = &camera.pose;
    let mut numbers = pose.position.as_vec3().to_array().to_vec();
    numbers.extend(pose.direction().as_vec3().to_array());
    numbers
}

fn assert_close(a: &[f32], b: &[f32], what: &str) {
    assert_eq!(a.len(), b.len(), "{what}: {a:?} {b:?}");
    for (x, y) in a.iter().zip(b) {
        assert!(
            (x - y).abs() <= 1e-5 * x.abs().max(1.0),
            "{what}: {a:?} {b:?}"
        );
    }
}

fn bounds(model: &Model) -> Vec<f32> {
    let (min, max) = model.bounds().expect("something to draw");
    let corners = [min, max].map(|corner| corner.as_vec3().to_array());
    corners.concat()
}

/// The positions, normals and colors of the corners of all primitives, in their order.
fn corner_numbers(mesh: &Mesh) -> Vec<f32> {
    let corners: Vec<u32> = match &mesh.primitives {
        Primitives::Triangles(list) => list.concat(),
        Primitives::Lines(list) => list.concat(),
        Primitives::Points => (0..mesh.positions.len() as u32).collect(),
    };
    let numbers = corners.iter().flat_map(|&corner| {
        let i = corner as usize;
        let mut numbers = mesh.positions[i].to_array().to_vec();
        numbers.extend(mesh.normals.get(i).iter().flat_map(|n| n.to_array()));
        numbers.extend(mesh.colors.get(i).into_iter().flatten());
        numbers
    });
    numbers.collect()
}

/// A color and a shininess, so that no number has its default.
const SHINY: &str = "Appearance { material Material { diffuseColor 0.9 0.5 0.1 ambientIntensity 0.4
    specularColor 0.3 0.2 0.1 emissiveColor 0 0.1 0 shininess 0.6 transparency 0.25 } }";

/// Small scenes without anything that Inventor lacks.
fn scenes() -> Vec<String> {
    let square = "coord Coordinate { point [ 0 0 0, 1 0 0, 1 1 0, 0 1 0 ] }";
    let color = "color Color { color [ 1 0 0, 0 1 0, 0 0 1, 1 1 1 ] }";
    vec![
        format!(
            "DEF ROOM Transform {{ translation 1 2 3 rotation 1 2 0 0.7 scale 1 2 3
             scaleOrientation 0 1 1 0.4 children [ DEF S Shape {{ appearance {SHINY} geometry Box {{ }} }}
             Transform {{ translation 0 5 0 children USE S }} ] }}"
        ),
        format!(
            "Transform {{ scale -1 2 1 rotation 0 1 0 1 children [
             Shape {{ appearance {SHINY} geometry IndexedFaceSet {{ {square} coordIndex [ 0 1 2 3 -1 ] }} }}
             Shape {{ geometry IndexedFaceSet {{ {square} {color} solid FALSE coordIndex [ 0 1 2 3 -1 ] }} }} ] }}"
        ),
        format!(
            "Shape {{ geometry IndexedLineSet {{ {square} {color} coordIndex [ 0 1 2 -1 2 3 -1 ] }} }}
             Shape {{ geometry PointSet {{ {square} {color} }} }} Shape {{ geometry Sphere {{ }} }}"
        ),
        "NavigationInfo { headlight TRUE } Shape { geometry Text { string \"ab\" } }
         Shape { geometry Extrusion { creaseAngle 1 } } Shape { geometry Cone { } }
         Shape { geometry ElevationGrid { xDimension 2 zDimension 2 height [ 0 1 0 2 ] } }"
            .to_owned(),
    ]
}

#[test]
fn what_is_read_back_has_the_same_triangles_and_materials() {
    for scene in scenes() {
        let [before, after] = both(&scene);
        assert!(before.triangle_count() + before.meshes.len() > 1, "{scene}");
        assert_eq!(before.triangle_count(), after.triangle_count(), "{scene}");
        assert_close(&bounds(&before), &bounds(&after), &scene);
        let materials = |model: &Model| -> Vec<f32> {
            let placed = model.placed_meshes();
            placed
                .flat_map(|(_, material, ..)| numbers(material))
                .collect()
        };
        assert_close(&materials(&before), &materials(&after), &scene);
        // The corners of each triangle run as before, also where a matrix mirrors.
        for (a, b) in before.placed_meshes().zip(after.placed_meshes()) {
            assert_close(&corner_numbers(a.0), &corner_numbers(b.0), &scene);
        }
        assert_eq!(losses(&scene), Vec::<String>::new(), "{scene}");
    }
}

#[test]
fn lights_and_cameras_are_where_they_were() {
    let scene = "NavigationInfo { headlight FALSE }
        Transform { translation 0 1 0 rotation 0 0 1 0.5 children [
          PointLight { location 1 2 3 color 1 0.5 0 intensity 0.7 attenuation 1 0.5 0.25 }
          SpotLight { location 0 3 0 direction 1 -1 0 cutOffAngle 0.6 }
          DirectionalLight { direction 0 -1 -1 intensity 0.5 }
          Viewpoint { position 1 2 9 orientation 0 1 0 0.3 fieldOfView 0.9 description \"in front\" }
          Viewpoint { position 9 2 1 }
          Shape { appearance Appearance { material Material { } } geometry Box { } } ] }";
    let [before, after] = both(scene);
    assert_eq!(before.lights.len(), 3);
    let lights =
        |model: &Model| -> Vec<f32> { model.lights.iter().flat_map(light_numbers).collect() };
    assert_close(&lights(&before), &lights(&after), "lights");
    // The other viewpoint is in a switch that hides it.
    assert_eq!((before.cameras.len(), after.cameras.len()), (2, 1));
    let first = |model: &Model| camera_numbers(&model.cameras[0]);
    assert_close(&first(&before), &first(&after), "camera");
    assert!(written(scene).contains("DEF in_front PerspectiveCamera"));
}

#[test]
fn the_headlight_turns_with_the_camera_if_there_are_other_lights() {
    let shape = "Shape { appearance Appearance { material Material { } } geometry Box { } }";
    let lit = format!("DirectionalLight {{ direction 0 -1 0 }} {shape}");
    // A viewer of Inventor lights a scene without lights.
    assert!(!written(shape).contains("DirectionalLight"));
    let directions = |text: &str| -> Vec<DVec3> {
        let lights = both(text)[1].lights.clone();
        lights.iter().map(|light| light.direction).collect()
    };
    let turned = format!("Viewpoint {{ orientation 0 1 0 1.5707963 }} {lit}");
    let found = directions(&turned);
    assert!((found[0] - DVec3::NEG_X).length() < 1e-6, "{found:?}");
    assert_eq!(found[1], DVec3::NEG_Y);
    assert!(losses(&turned).is_empty());
    assert_eq!(losses(&format!("Viewpoint {{ }} {turned}")), ["headlight"]);
    assert_eq!(directions(&lit)[0], DVec3::NEG_Z);
    assert_eq!(losses(&lit), ["headlight"]);
    let is_stated = |text: &str| converted(text).losses.has_stated();
    assert!(!is_stated(&lit));
    assert!(is_stated(&format!(
        "NavigationInfo {{ headlight TRUE }} {lit}"
    )));
    let dark = both(&format!("NavigationInfo {{ headlight FALSE }} {shape}"));
    assert_eq!(dark[1].lights[0].intensity, 0.0);
}

#[test]
fn textures_have_their_pixels_and_their_matrix() {
    let scene = |transform: &str, image: &str| {
        format!(
            "Shape {{ appearance Appearance {{ material Material {{ diffuseColor 1 0 0 }}
             texture PixelTexture {{ image {image} repeatT FALSE }}
             textureTransform TextureTransform {{ {transform} }} }} geometry Box {{ }} }}"
        )
    };
    for transform in [
        "",
        "scale 2 3 translation 0.25 0.5",
        "rotation 0.4 center 0.5 0.5",
        "scale -2 3 rotation 0.4 translation 0.1 0.2",
        "scale 0 3 rotation 0.4",
    ] {
        let [before, after] = both(&scene(transform, "2 1 3 0xff0000 0x00ff00"));
        let textures = [&before, &after].map(|m| m.materials[0].texture.clone().expect("one"));
        let matrix = |t: Affine2| t.to_cols_array();
        let [a, b] = [&textures[0], &textures[1]];
        assert_close(&matrix(a.matrix), &matrix(b.matrix), transform);
        assert_eq!(a.repeat, b.repeat);
        assert_eq!(before.images, after.images);
        assert_eq!(after.materials[0].diffuse, Vec3::ONE);
    }
    let [_, gray] = both(&scene("", "1 1 2 0x8040"));
    assert_eq!(gray.materials[0].diffuse, Vec3::X);
    assert_eq!(losses(&scene("", "1 1 1 0x80")), Vec::<String>::new());
    let options = ExportOptions {
        stem: "room".to_owned(),
        ..ExportOptions::default()
    };
    let text = format!("#VRML V2.0 utf8\n{}", scene("", "1 1 3 0xff0000"));
    let scene = document("a.wrl", text.as_bytes());
    let conversion = convert(&scene, Target::Inventor, &options).expect("a conversion");
    assert_eq!(conversion.beside[0].0, "room-iv-1.png");
    let file = String::from_utf8(conversion.bytes).expect("text");
    assert!(file.contains("filename \"room-iv-1.png\""), "{file}");
}

#[test]
fn what_inventor_does_not_have_is_reported() {
    let shape = "Shape { appearance Appearance { material Material { specularColor 1 1 1 }
        texture PixelTexture { image 1 1 1 0x77 } } geometry Box { } }";
    let codes = losses(&format!(
        "NavigationInfo {{ headlight FALSE }} Background {{ skyColor 1 0 0 }}
         Fog {{ visibilityRange 9 }} TouchSensor {{ }}
         PointLight {{ location 5 0 0 radius 5 ambientIntensity 0.5 attenuation 0 0 1 }}
         SpotLight {{ beamWidth 0.2 cutOffAngle 0.7 radius 50 }} {shape}"
    ));
    let expected = [
        "background",
        "fog",
        "headlight",
        "interaction",
        "light-ambient",
        "light-falloff",
        "light-radius",
        "spot-falloff",
        "texture-blend",
    ];
    let mut sorted = codes;
    sorted.sort();
    assert_eq!(sorted, expected);
}

#[test]
fn inventor_and_vrml_1_are_rewritten_with_their_nodes() {
    let text = b"#VRML V1.0 ascii\nSeparator { Translation { translation 1 0 0 } Cube { } }";
    let scene = document("a.wrl", text);
    let options = ExportOptions::default();
    let conversion = convert(&scene, Target::Inventor, &options).expect("a conversion");
    let file = String::from_utf8(conversion.bytes).expect("text");
    assert!(
        file.contains("Translation") && file.contains("Cube"),
        "{file}"
    );
}
