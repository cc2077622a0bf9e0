//! Hostile scenes: deep, growing, flat, and with NaN. None of them causes a panic, and their valid
//! parts are drawn.

use std::sync::Arc;

use glam::{DVec3, Vec3};
use ivcam_inventor::events::SnapshotOptions;
use ivcam_inventor::grammar::{CLASSES, Class, Default, Dialect, FieldType, Treatment};
use ivcam_inventor::iv::{Document, Limits, NoFiles, NodeRef};
use ivcam_inventor::pose::CameraPose;
use ivcam_inventor::snapshot::Snapshot;
use ivcam_inventor::traversal::{Visitor, WalkOptions, walk};
use ivcam_render::bvh::Ray;
use ivcam_render::scene::{CompileOptions, RenderScene};

fn read(text: &str) -> Document {
    let text = format!("#Inventor V2.1 ascii\n{text}");
    Document::read(
        "test.iv",
        text.into_bytes(),
        Arc::new(NoFiles),
        &Limits::default(),
    )
    .expect("the scene reads")
}

fn compile(text: &str) -> RenderScene {
    let document = read(text);
    RenderScene::compile(&Snapshot::at(&document, 0.0), &CompileOptions::default())
        .expect("the scene compiles")
}

fn distance(scene: &RenderScene) -> Option<f32> {
    let ray = Ray::new(Vec3::new(0.1, 0.2, 10.0), Vec3::NEG_Z);
    scene.hit(&ray).map(|h| h.t)
}

#[derive(Default)]
struct Count(u64, usize);

impl<'a> Visitor<'a> for Count {
    fn shape(&mut self, _: NodeRef<'a>, _: &ivcam_inventor::traversal::State<'a>) {
        self.0 += 1;
    }
    fn report(&mut self, _: Box<ivcam_base::diag::Diagnostic>) {
        self.1 += 1;
    }
}

#[test]
fn a_hundred_thousand_separators_deep_there_is_a_cube() {
    let n = 100_000;
    let text = format!("{}Cube {{ }}{}", "Separator { ".repeat(n), " }".repeat(n));
    assert_eq!(distance(&compile(&text)), Some(9.0));
}

#[test]
fn a_tree_that_doubles_at_every_level_is_left_at_the_limit() {
    let mut text = String::from("Switch { DEF L0 Cube { }\n");
    for i in 1..60 {
        let below = i - 1;
        text += &format!("DEF L{i} Group {{ USE L{below} USE L{below} }}\n");
    }
    text += "} USE L59";
    let document = read(&text);
    let options = WalkOptions {
        max_visits: 100_000,
        ..WalkOptions::default()
    };
    let mut count = Count::default();
    walk(&Snapshot::at(&document, 0.0), &options, &mut count);
    assert!(count.0 > 10_000 && count.0 <= 100_000);
    assert_eq!(count.1, 1, "one message");
}

/// Compiles a scene within some memory, and returns it with its messages.
fn compile_within(text: &str, memory: u64) -> (RenderScene, Vec<String>) {
    let document = read(text);
    let options = CompileOptions {
        memory,
        ..CompileOptions::default()
    };
    let scene = RenderScene::compile(&Snapshot::at(&document, 0.0), &options).expect("compiles");
    let diagnostics = &scene.census().diagnostics;
    let messages = diagnostics.iter().map(|d| d.message.clone()).collect();
    (scene, messages)
}

#[test]
fn what_does_not_fit_into_the_memory_is_left_out_with_one_message() {
    let scenes = [
        format!("Text3 {{ string \"{}\" parts ALL }}", "word ".repeat(200)),
        "Separator { Translation { translation 2 0 0 } Sphere { } } ".repeat(2000),
        "DrawStyle { style LINES } ".to_owned() + &"Cube { } ".repeat(300),
        "Cube { } ".repeat(2000),
    ];
    for scene in scenes {
        let (whole, messages) = compile_within(&scene, 1 << 30);
        assert!(messages.is_empty(), "{messages:?}");
        let (part, messages) = compile_within(&scene, 1 << 20);
        assert_eq!(
            messages,
            ["the scene needs more than 1.0 MB of memory; the rest is left out"]
        );
        let count = |scene: &RenderScene| {
            let (triangles, quadrics, strokes) = scene.primitives();
            triangles + quadrics + strokes
        };
        assert!(
            0 < count(&part) && count(&part) < count(&whole),
            "{}",
            &scene[..20]
        );
    }
}

#[test]
fn a_shape_that_cannot_be_made_within_the_memory_is_left_out_with_a_message() {
    let section = "0 0, 1 0, 1 1, ".repeat(40);
    let spine = "0 0 0, 0 1 0, 0 2 0, ".repeat(40);
    let extrusion = format!("Extrusion {{ crossSection [ {section} ] spine [ {spine} ] }}");
    let heights = "1 2 3 ".repeat(1200);
    let grid = format!("ElevationGrid {{ xDimension 60 zDimension 60 height [ {heights} ] }}");
    for geometry in [extrusion, grid] {
        let text = format!("#VRML V2.0 utf8\nShape {{ geometry {geometry} }}");
        let files = Arc::new(NoFiles);
        let document = Document::read("a.wrl", text.into_bytes(), files, &Limits::default());
        let document = document.expect("reads");
        let drawn = |memory| {
            let options = CompileOptions {
                memory,
                ..CompileOptions::default()
            };
            let scene = RenderScene::compile(&Snapshot::at(&document, 0.0), &options);
            let scene = scene.expect("compiles");
            (scene.primitives().0, scene.census().diagnostics.len())
        };
        let (triangles, messages) = drawn(64 << 20);
        assert!(triangles > 5000 && messages == 0, "{triangles} {messages}");
        assert_eq!(drawn(500_000), (0, 1));
    }
}

#[test]
fn more_primitives_than_the_limit_are_left_out_with_a_message() {
    // Copies in an `Array` would be stored once.
    let cubes = "Cube { } Translation { translation 3 0 0 } ".repeat(30);
    let document = read(&format!("Separator {{ {cubes} }}"));
    let options = CompileOptions {
        limits: Limits {
            primitives: 120,
            ..Limits::default()
        },
        ..CompileOptions::default()
    };
    let snapshot = Snapshot::at(&document, 0.0);
    let scene = RenderScene::compile(&snapshot, &options).expect("compiles");
    assert_eq!(scene.primitives().0, 120);
    assert_eq!(scene.census().diagnostics.len(), 1);
}

#[test]
fn corners_that_are_nan_are_left_out_and_the_rest_is_drawn() {
    let scene = compile(
        "Coordinate3 { point [ -1 -1 0, 1 -1 0, 0 1 0, nan 0 0, inf 1 1 ] }
         IndexedFaceSet { coordIndex [ 0 1 2 -1 0 1 3 -1 2 3 4 -1 0 1 77 -1 0 -1 -1 -1 ] }",
    );
    assert_eq!(distance(&scene), Some(10.0));
    assert_eq!(scene.primitives().0, 1);
    let told: Vec<&str> = scene
        .census()
        .diagnostics
        .iter()
        .map(|t| &*t.message)
        .collect();
    assert_eq!(told, ["parts of this `IndexedFaceSet` are left out"]);
}

#[test]
fn an_incompletely_drawn_node_is_reported_once_with_its_location() {
    let text = "DEF a Separator { Scale { scaleFactor 0 0 0 } Sphere { } }\nUSE a USE a
        Cone { }\nCoordinate3 { point [ 0 0 0, 1 0 0, 0 1 0 ] }
        IndexedTriangleStripSet { coordIndex [ 0 1 2 99 -1 ] } Sphere { }";
    let document = read(text);
    let options = CompileOptions::default();
    let snapshot = Snapshot::at(&document, 0.0);
    let survey = RenderScene::survey(&snapshot, &options);
    let scene = RenderScene::compile(&snapshot, &options).expect("compiles");
    for diagnostics in [&survey.diagnostics, &scene.census().diagnostics] {
        let told: Vec<_> = diagnostics
            .iter()
            .map(|t| (&*t.message, t.location().1))
            .collect();
        let part = |class: &str| format!("parts of this `{class}` are left out");
        let expected = [("Sphere", 2), ("IndexedTriangleStripSet", 6)];
        assert_eq!(told.len(), expected.len(), "{told:?}");
        for ((message, place), (class, line)) in told.iter().zip(expected) {
            assert_eq!(**message, part(class));
            assert_eq!(place.map(|p| p.0), Some(line));
        }
    }
}

#[test]
fn a_face_without_a_corner_left_is_no_face_in_any_style() {
    for style in ["FILLED", "LINES", "POINTS"] {
        let scene = compile(&format!(
            "DrawStyle {{ style {style} }}
             Coordinate3 {{ point [ 0 0 0, 1 0 0, 0 1 0 ] }}
             IndexedFaceSet {{ coordIndex [ 7, 8, 9, -1, 0, 1, 2, -1, 5, -1 ] }}"
        ));
        let face = (style == "FILLED").then_some(10.0);
        assert_eq!(
            distance(&scene),
            face,
            "{style}: only the face in the middle"
        );
    }
}

#[test]
fn a_scale_of_zero_draws_nothing_and_hides_nothing() {
    let scene = compile(
        "Separator { Scale { scaleFactor 0 0 0 } Cube { } Sphere { } Cone { } }
         Translation { translation 0 0 -5 } Cube { }",
    );
    assert_eq!(distance(&scene), Some(14.0));
}

#[test]
fn what_a_scale_presses_flat_is_drawn_flat() {
    for shape in ["Cube", "Sphere", "Cylinder", "Cone"] {
        let scene = compile(&format!("Scale {{ scaleFactor 1 1 0 }} {shape} {{ }}"));
        let t = distance(&scene).unwrap_or(f32::NAN);
        assert!((t - 10.0).abs() < 1e-5, "{shape}: {t}");
        assert!(scene.census().diagnostics.is_empty(), "{shape}");
    }
    let lines = ["1 0 0", "0 0 1"].map(|left| {
        let scene = compile(&format!("Scale {{ scaleFactor {left} }} Cube {{ }}"));
        scene.census().diagnostics.len()
    });
    assert_eq!(lines, [1, 1]);
    // glTF hides a node by a scale of 0.
    let x3d = "#X3D V4.0 utf8\nPROFILE Full\nTransform { scale 0 0 0 children Shape { geometry Box { } } }";
    let document = Document::read_headerless("a", x3d.into()).expect("the scene reads");
    let scene = RenderScene::compile(&Snapshot::at(&document, 0.0), &CompileOptions::default());
    assert!(scene.expect("compiles").census().diagnostics.is_empty());
    let points = compile("Scale { scaleFactor 0 0 0 } Cube { }");
    assert_eq!(points.census().diagnostics.len(), 1);
}

#[test]
fn a_sphere_is_round_under_a_scale_and_from_far_away() {
    // The ellipsoid has half axes 2, 1, 3: a ray along z at (1, 0.5) hits it where (1/2)² + 0.5² +
    // (z/3)² = 1.
    let scene = compile("Scale { scaleFactor 2 1 3 } Sphere { }");
    let ray = Ray::new(Vec3::new(1.0, 0.5, 1000.0), Vec3::NEG_Z);
    let t = scene.hit(&ray).expect("a hit").t;
    let z = 3.0 * 0.5f32.sqrt();
    assert!((t - (1000.0 - z)).abs() < 1e-4, "{t}");
}

#[test]
fn a_position_near_the_origin_is_the_same_from_any_origin() {
    let document = read("Translation { translation 100000 0 0 } Sphere { radius 0.001 }");
    let options = CompileOptions {
        origin: DVec3::new(100_000.0, 0.0, 0.01),
        ..CompileOptions::default()
    };
    let snapshot = Snapshot::at(&document, 0.0);
    let scene = RenderScene::compile(&snapshot, &options).expect("compiles");
    let hit = scene
        .hit(&Ray::new(Vec3::ZERO, Vec3::NEG_Z))
        .expect("a hit");
    assert!((hit.t - 0.009).abs() < 1e-8, "{}", hit.t);
}

#[test]
fn a_point_does_not_shade_itself_in_millimeters_or_in_kilometers() {
    for size in [1e-3, 1.0, 1e5] {
        let text = format!("Scale {{ scaleFactor {size} {size} {size} }} Sphere {{ }}");
        let scene = compile(&text);
        let mut hits = 0;
        for i in 0..2000 {
            let at = i as f32 * 0.618_034;
            let (x, y) = (0.9 * (at.fract() - 0.5), 0.9 * ((at * 7.3).fract() - 0.5));
            let size = size as f32;
            let origin = Vec3::new(x * size, y * size, 50.0 * size);
            let ray = Ray::new(origin, Vec3::NEG_Z);
            let hit = scene.hit(&ray).expect("the sphere is there");
            let point = scene.point(&ray, &hit);
            let away = point.leave(point.geometric);
            hits += usize::from(scene.hit_any_side(&away).is_some());
        }
        assert_eq!(hits, 0, "at size {size}");
    }
}

/// Returns a scene with a node of a class, every number in it replaced by a word, among shapes that
/// it may affect.
fn with_every_number(class: &Class, word: &str) -> String {
    let mut text = format!("{} {{\n", class.name);
    for field in class.fields {
        let numbers = match field.kind {
            kind if kind.name().ends_with("Image") => continue,
            FieldType::SFBool | FieldType::MFBool => continue,
            kind if matches!(field.default, Default::Numbers(_)) || kind.is_multiple() => {
                kind.width()
            }
            _ => continue,
        };
        if field.kind.name().contains("String") || field.kind.name().contains("Node") {
            continue;
        }
        text += &format!(
            "  {} [ {} ]\n",
            field.name,
            vec![word; numbers * 4].join(" ")
        );
        if !field.kind.is_multiple() {
            text += &format!("  {} {}\n", field.name, vec![word; numbers].join(" "));
        }
    }
    text + "}"
}

#[test]
fn a_scene_compiles_with_any_number_in_any_field() {
    let camera = CameraPose::view_all((DVec3::splat(-3.0), DVec3::splat(3.0)), 1.5);
    let options = CompileOptions {
        camera: Some(camera.clone()),
        origin: camera.position,
        limits: Limits {
            primitives: 2_000,
            visits: 2_000,
            ..Limits::default()
        },
        ..CompileOptions::default()
    };
    for class in CLASSES
        .iter()
        .filter(|c| c.treatment != Treatment::Abstract)
    {
        let vrml97 = class.dialects & Dialect::VRML97 != 0 && class.dialects & Dialect::IV2 == 0;
        for word in ["nan", "-inf", "-1", "3e38"] {
            let node = with_every_number(class, word);
            let text = if vrml97 {
                format!(
                    "#VRML V2.0 utf8\n{node} Shape {{ geometry {node} }} Shape {{ appearance {node} geometry Box {{ }} }}"
                )
            } else {
                format!(
                    "#Inventor V2.1 ascii\nSeparator {{ Coordinate3 {{ point [ 0 0 0, 1 0 0, 1 1 0, 0 1 0 ] }}
                     {node} Cube {{ }} Sphere {{ }} FaceSet {{ numVertices 4 }} LineSet {{ }} Text3 {{ string a parts ALL }} {node} }}"
                )
            };
            let document = Document::read("t", text.into(), Arc::new(NoFiles), &Limits::default());
            let document = document.expect("reads");
            let snapshot =
                ivcam_render::scene::snapshot(&document, &SnapshotOptions::default(), &options);
            RenderScene::survey(&snapshot, &options);
            RenderScene::compile(&snapshot, &options).expect("compiles");
        }
    }
}

/// Records the material of the last shape.
#[derive(Default)]
struct LastMaterial(Option<(f32, f32, Vec3)>);

impl<'a> Visitor<'a> for LastMaterial {
    fn shape(&mut self, _: NodeRef<'a>, state: &ivcam_inventor::traversal::State<'a>) {
        let m = &state.material;
        self.0 = Some((m.refraction, m.shininess, m.diffuse_at(0)));
    }
}

#[test]
fn a_refractive_index_reaches_the_material_through_fields_of_the_file_s_own() {
    let own = "Material { fields [ SFColor diffuseColor, SFFloat refractionIndex ]
        diffuseColor 1 0 0 refractionIndex 1.5 } Cube { }";
    let derived = "Glass { fields [ SFFloat refractionIndex, MFColor diffuseColor ]
        isA [ \"Material\" ] refractionIndex 1.5 diffuseColor [ 1 0 0 ] } Cube { }";
    for text in [own, derived] {
        let document = read(text);
        assert!(document.sink.items().is_empty(), "{text}");
        let mut last = LastMaterial::default();
        let snapshot = Snapshot::at(&document, 0.0);
        walk(&snapshot, &WalkOptions::default(), &mut last);
        // The shininess is the catalogue's default, because the file does not set it.
        assert_eq!(last.0, Some((1.5, 0.2, Vec3::X)), "{text}");
    }
}
