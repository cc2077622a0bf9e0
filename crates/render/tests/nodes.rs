//! Nodes whose picture is measured in pixels or by hand, one fact per test.
//!
//! The camera is at z = 100 and sees 100 units in 100 rows, so a unit is a pixel.

use std::sync::Arc;

use glam::{DVec3, Vec3};
use ivcam_base::diag::Diagnostic;
use ivcam_inventor::grammar::class;
use ivcam_inventor::iv::{Document, Limits, NoFiles};
use ivcam_inventor::pose::{CameraPose, Projection};
use ivcam_inventor::snapshot::Snapshot;
use ivcam_inventor::traversal::state::FogKind;
use ivcam_render::bvh::{Hit, Ray};
use ivcam_render::scene::model::{Model, ModelOptions};
use ivcam_render::scene::{CompileOptions, RenderScene};
use ivcam_render::shade::{ShadeOptions, Shader, Shading, Work};

fn document(text: &str) -> Document {
    Document::read("test", text.into(), Arc::new(NoFiles), &Limits::default()).expect("reads")
}

fn compile_file(text: &str) -> RenderScene {
    let camera = CameraPose {
        position: DVec3::new(0.0, 0.0, 100.0),
        projection: Projection::Orthographic { height: 100.0 },
        ..CameraPose::view_all((DVec3::ZERO, DVec3::ONE), 1.0)
    };
    let options = CompileOptions {
        origin: camera.position,
        camera: Some(camera),
        pixel_rows: 100,
        ..CompileOptions::default()
    };
    let document = document(text);
    RenderScene::compile(&Snapshot::at(&document, 0.0), &options).expect("compiles")
}

fn compile(text: &str) -> RenderScene {
    compile_file(&format!("#Inventor V2.1 ascii\n{text}"))
}

fn ray(x: f32, y: f32) -> Ray {
    Ray::new(Vec3::new(x, y, 0.0), Vec3::NEG_Z)
}

fn hit(scene: &RenderScene, x: f32, y: f32) -> Option<Hit> {
    scene.hit(&ray(x, y))
}

fn class_at(scene: &RenderScene, x: f32, y: f32) -> &'static str {
    hit(scene, x, y).map_or("", |h| scene.surface(&h).class)
}

fn color_at(scene: &RenderScene, x: f32, y: f32) -> Vec3 {
    let ray = ray(x, y);
    let hit = scene.hit(&ray).expect("something is there");
    scene.point(&ray, &hit).texel.expect("a texture").truncate()
}

/// The color that is seen, without lights.
fn radiance_at(scene: &RenderScene, x: f32, y: f32) -> Vec3 {
    shown(scene, Shading::Flat, x, y)
}

fn shown(scene: &RenderScene, shading: Shading, x: f32, y: f32) -> Vec3 {
    let shader = Shader::new(scene, shading, ShadeOptions::default());
    shader.radiance(&ray(x, y), &mut Work::default())
}

#[test]
fn markers_are_five_seven_and_nine_pixels_wide() {
    let scene = compile(
        "Coordinate3 { point [ -20 0 0, 0.2 0.9 0, 20.7 0.5 0, 40 0 0 ] }
         MarkerSet { markerIndex [ 21, 51, 81, -1 ] }",
    );
    // Each marker is around the center of its point's pixel; a point between two pixels is in the
    // right one.
    for (x, half) in [(-19.5, 2.5), (0.5, 3.5), (20.5, 4.5)] {
        for way in [-1.0, 1.0] {
            assert!(hit(&scene, x + way * (half - 0.1), 0.2).is_some(), "at {x}");
            assert!(hit(&scene, x + way * (half + 0.1), 0.2).is_none(), "at {x}");
        }
    }
    assert!(hit(&scene, 40.5, 0.5).is_none(), "NONE is no marker");
}

#[test]
fn a_line_pattern_is_drawn_bit_by_bit_from_the_lowest() {
    let scene = compile(
        "DrawStyle { linePattern 0x00ff } Coordinate3 { point [ -16 0 0, 16 0 0 ] } LineSet { }",
    );
    let drawn: String = (0..32)
        .map(|i| {
            if hit(&scene, i as f32 - 15.5, 0.0).is_some() {
                '-'
            } else {
                ' '
            }
        })
        .collect();
    assert_eq!(drawn, "--------        --------        ");
}

#[test]
fn an_image_is_as_many_pixels_as_it_has_and_sits_where_it_says() {
    let scene = compile(
        "Translation { translation 5 0 -3 }
         Image { horAlignment CENTER vertAlignment BOTTOM image 4 2 3
           0xff0000 0xff0000 0x0000ff 0x0000ff 0xff0000 0xff0000 0x0000ff 0x0000ff }",
    );
    assert_eq!(color_at(&scene, 3.5, 1.0), Vec3::X);
    assert_eq!(color_at(&scene, 6.5, 1.0), Vec3::Z);
    for (x, y) in [(2.9, 1.0), (7.1, 1.0), (5.0, -0.1), (5.0, 2.1)] {
        assert!(hit(&scene, x, y).is_none(), "at {x} {y}");
    }
}

#[test]
fn a_texture_in_depth_has_its_third_coordinate() {
    let scene = compile(
        "Texture3 { images 1 1 2 3 0xff0000 0x0000ff wrapR CLAMP }
         TextureCoordinate3 { point [ 0 0 .25, 0 0 .75, 0 0 .75, 0 0 .25 ] }
         Coordinate3 { point [ -10 -1 0, 10 -1 0, 10 1 0, -10 1 0 ] } FaceSet { numVertices 4 }",
    );
    assert!(color_at(&scene, -9.99, 0.0).distance(Vec3::X) < 1e-2);
    assert!(color_at(&scene, 9.99, 0.0).distance(Vec3::Z) < 1e-2);
    assert!(color_at(&scene, 0.0, 0.0).distance(Vec3::new(0.5, 0.0, 0.5)) < 1e-2);
}

#[test]
fn a_clip_plane_leaves_what_is_on_its_side() {
    let scene = compile("ClipPlane { plane 1 0 0 2 } Cube { width 20 height 20 depth 20 }");
    assert!(hit(&scene, 1.9, 0.0).is_none());
    assert!(hit(&scene, 2.1, 0.0).is_some());
    let off = compile("ClipPlane { plane 1 0 0 2 on FALSE } Cube { width 20 }");
    assert!(hit(&off, 0.0, 0.0).is_some());
}

/// X3D shows what lies where the equation of the plane is greater than 0.
#[test]
fn a_clip_plane_of_x3d_leaves_where_its_equation_is_positive() {
    let of = |plane: &str| {
        compile_file(&format!(
            "#X3D V3.3 utf8\nPROFILE Full\n\
             Group {{ children [ ClipPlane {{ {plane} }} Shape {{ geometry Box {{ size 20 20 20 }} }} ] }}"
        ))
    };
    let scene = of("plane 1 0 0 -2");
    assert!(hit(&scene, 1.9, 0.0).is_none());
    assert!(hit(&scene, 2.1, 0.0).is_some());
    let usual = of("");
    assert!(hit(&usual, 0.0, -0.1).is_none() && hit(&usual, 0.0, 0.1).is_some());
    assert!(hit(&of("enabled FALSE"), 0.0, -0.1).is_some());
}

/// A cutoff is compared with the product of the opacities of material, vertex and texture at each
/// point.
#[test]
fn a_masked_place_is_there_or_not() {
    let transparency = |material: &str, cutoff: f32, color: &str, x: f32| {
        let scene = compile_file(&format!(
            "#X3D V4.0 utf8\nPROFILE Full\nShape {{ appearance Appearance {{ alphaMode \"MASK\" \
             alphaCutoff {cutoff} material PhysicalMaterial {{ {material} }} }} geometry \
             IndexedFaceSet {{ solid FALSE coordIndex [ 0 1 2 3 -1 ] {color} \
             coord Coordinate {{ point [ -10 -10 0, 10 -10 0, 10 10 0, -10 10 0 ] }} }} }}"
        ));
        let ray = ray(x, 1.0);
        let hit = scene.hit(&ray).expect("something is there");
        scene.point(&ray, &hit).transparency
    };
    let fade = "color ColorRGBA { color [ 1 1 1 0, 1 1 1 1, 1 1 1 1, 1 1 1 0 ] }";
    for (x, expected) in [(-9.0, 1.0), (-0.1, 1.0), (0.1, 0.0), (9.0, 0.0)] {
        assert_eq!(transparency("", 0.5, fade, x), expected, "{x}");
    }
    let both = "transparency .5 baseTexture PixelTexture { image 1 1 2 0xFFC8 }";
    assert_eq!(transparency(both, 0.38, "", 0.0), 0.0);
    assert_eq!(transparency(both, 0.4, "", 0.0), 1.0);
    assert_eq!(transparency("transparency .5", 0.49, "", 0.0), 0.0);
}

#[test]
fn a_solid_text_of_x3d_has_no_back() {
    let of = |solid: &str, turn: &str| {
        compile_file(&format!(
            "#X3D V4.0 utf8\nPROFILE Full\nTransform {{ rotation 0 1 0 {turn} children Shape {{ \
             geometry Text {{ solid {solid} string \"I\" fontStyle FontStyle {{ size 30 \
             justify [\"MIDDLE\" \"MIDDLE\"] }} }} }} }}"
        ))
    };
    let is_seen = |scene: RenderScene| hit(&scene, 0.0, 0.0).is_some();
    assert!(is_seen(of("TRUE", "0")) && is_seen(of("FALSE", "3.14159265")));
    assert!(!is_seen(of("TRUE", "3.14159265")));
}

#[test]
fn an_annotation_is_drawn_over_everything() {
    let scene = compile(
        "Annotation { Translation { translation 0 0 -50 } Sphere { radius 5 } } Cube { width 20 height 20 }",
    );
    assert_eq!(class_at(&scene, 0.0, 0.0), "Sphere");
    assert_eq!(class_at(&scene, 8.0, 0.0), "Cube");
}

#[test]
fn the_level_of_detail_of_a_cube_ten_pixels_wide_is_for_a_hundred_pixels() {
    let level = |areas: &str| {
        let scene = compile(&format!(
            "LevelOfDetail {{ screenArea [ {areas} ] Cube {{ width 10 height 10 depth 10 }} Sphere {{ radius 5 }} }}"
        ));
        class_at(&scene, 0.0, 0.0)
    };
    assert_eq!(level("99"), "Cube");
    assert_eq!(level("101"), "Sphere");
}

#[test]
fn one_fog_lies_over_a_whole_vrml97_scene() {
    let scene = compile_file(
        "#VRML V2.0 utf8
         Shape { geometry Box { } }
         Transform { scale 2 2 2 children Fog { visibilityRange 30 color 0 1 0 fogType \"EXPONENTIAL\" } }
         Fog { visibilityRange 1 }",
    );
    let hit = hit(&scene, 0.0, 0.0).expect("the box");
    let environment = scene.surface(&hit).environment;
    assert_eq!(environment.fog, FogKind::Exponential);
    assert_eq!(environment.fog_color, Vec3::Y);
    assert!((environment.visibility - 60.0).abs() < 1e-4);
}

#[test]
fn a_shape_that_casts_no_shadow_lets_light_through() {
    let style = |style: &str| compile(&format!("ShadowStyle {{ style {style} }} Cube {{ }}"));
    assert_eq!(style("SHADOWED").transmittance(&ray(0.0, 0.0), 1e3), 1.0);
    assert_eq!(
        style("CASTS_SHADOW").transmittance(&ray(0.0, 0.0), 1e3),
        0.0
    );
}

/// A degree of longitude on the equator is 111,319.49 m. The scene has the frame of its origin: x
/// east, y north, z up; the middle of a chord lies below the arc.
#[test]
fn places_on_the_globe_are_in_the_frame_of_the_origin() {
    let scene = compile(
        "GeoOrigin { geoCoords 0 10 0 }
         Separator {
           GeoCoordinate { point [ 0 9.9999 0, 0 10.0001 0, .0001 10 0 ] }
           IndexedFaceSet { coordIndex [ 0, 1, 2, -1 ] }
         }
         GeoSeparator { geoCoords 0.0003 10.0002 5 Sphere { radius 1 } }
         GeoSeparator { geoSystem [ \"UTM\", \"Z32\" ] geoCoords 611280.6 22.1 50
           Cube { width 4 height 4 depth 0.5 } }",
    );
    let height = |x: f32, y: f32| hit(&scene, x, y).map(|h| 100.0 - h.t);
    assert!(height(-11.0, 0.1).is_some_and(|z| z.abs() < 1e-3));
    assert!(height(-11.3, 0.1).is_none() && height(11.0, 0.1).is_some());
    assert!(height(0.0, 10.9).is_some() && height(0.0, 11.2).is_none());
    assert!(height(0.0, 22.1).is_some_and(|z| (z - 50.25).abs() < 1e-2));
    assert!(height(22.26, 33.17).is_some_and(|z| (z - 6.0).abs() < 1e-2));
}

/// OpenGL cuts the lit color, as viewers of VRML97 show it; Inventor's libraries keep the color of
/// the material in bytes, so model `g` cuts it before.
#[test]
fn a_diffuse_color_above_one_is_cut_after_lighting() {
    let face = "Coordinate3 { point [ -9 -9 0, 9 -9 0, 0 9 0 ] }
        IndexedFaceSet { coordIndex [ 0, 1, 2, -1 ] }";
    let head =
        "Environment { ambientIntensity 0 } DirectionalLight { direction 0 0 -1 intensity .5 }
        Material { diffuseColor 1.7 .5 255 }";
    let lit = compile(&format!("{head} {face}"));
    assert_eq!(
        shown(&lit, Shading::Phong, 0.0, 0.0),
        Vec3::new(0.85, 0.25, 1.0)
    );
    assert_eq!(
        shown(&lit, Shading::Recursive, 0.0, 0.0),
        Vec3::new(0.85, 0.25, 127.5)
    );
    assert_eq!(
        shown(&lit, Shading::Gl, 0.0, 0.0),
        Vec3::new(0.5, 0.25, 0.5)
    );
    let unlit = compile(&format!("LightModel {{ model BASE_COLOR }} {head} {face}"));
    for shading in [
        Shading::Phong,
        Shading::Gl,
        Shading::Recursive,
        Shading::Path,
    ] {
        let color = shown(&unlit, shading, 0.0, 0.0);
        assert_eq!(color, Vec3::new(1.0, 0.5, 1.0), "{shading:?}");
    }
}

#[test]
fn the_textures_of_all_units_are_applied_in_their_order() {
    let units = |first: &str, second: &str| {
        let scene = compile(&format!(
            "LightModel {{ model BASE_COLOR }} TextureUnit {{ unit 1 }} Texture2 {{ {second} }}
             TextureUnit {{ unit 0 }} Texture2 {{ {first} }} Cube {{ width 20 }}"
        ));
        (radiance_at(&scene, 5.0, 0.0) * 255.0).round()
    };
    let orange = "image 1 1 3 0xff8000";
    let modulated = units(orange, "image 1 1 3 0x8080ff");
    assert_eq!(modulated, Vec3::new(0.8 * 128.0, 0.8 * 64.0, 0.0).round());
    let decal = units(orange, "model DECAL image 1 1 4 0x0000ff33");
    let under = Vec3::new(255.0, 128.0, 0.0) * 0.8;
    assert_eq!(decal, under.lerp(Vec3::Z * 255.0, 0.2).round());
    let blend = units(orange, "model BLEND blendColor 0 0 1 image 1 1 1 0x33");
    assert_eq!(blend, under.lerp(Vec3::Z * 255.0, 0.2).round());
    assert_eq!(
        units(orange, "model REPLACE image 1 1 3 0x00ff00"),
        Vec3::Y * 255.0
    );
    assert_eq!(units("", "image 1 1 3 0x0000ff"), Vec3::Z * 204.0);
}

/// The left half of the first texture is white and the second's right half; the second unit has
/// coordinates of its own, which exchange left and right, or a matrix that does.
#[test]
fn a_texture_unit_has_its_own_coordinates_and_matrix() {
    let face = "Coordinate3 { point [ -9 -9 0, 9 -9 0, 9 9 0, -9 9 0 ] }";
    let first = "TextureCoordinate2 { point [ 0 0, 1 0, 1 1, 0 1 ] }
                 Texture2 { image 2 1 1 0xff 0x80 wrapS CLAMP }";
    let second = "TextureUnit { unit 3 } Texture2 { image 2 1 3 0xff0000 0x00ff00 wrapS CLAMP }";
    for own in [
        "TextureCoordinate2 { point [ 1 0, 0 0, 0 1, 1 1 ] }",
        "TextureCoordinate2 { point [ 0 0, 1 0, 1 1, 0 1 ] }
         Texture2Transform { center .5 .5 scaleFactor -1 1 }",
        "TextureCoordinatePlane { directionS -.055555556 0 0 } Texture2Transform { translation .5 0 }",
    ] {
        let scene = compile(&format!(
            "LightModel {{ model BASE_COLOR }} {face} {first} {second} {own}
             IndexedFaceSet {{ coordIndex [ 0, 1, 2, 3, -1 ] }}"
        ));
        let at = |x: f32| (radiance_at(&scene, x, 1.0) * 255.0).round();
        assert_eq!(at(-8.0), Vec3::Y * 204.0, "{own}");
        assert_eq!(at(8.0), Vec3::X * (0.8 * 128.0_f32).round(), "{own}");
    }
}

#[test]
fn amendment_ones_flat_surface_is_flat_and_trimmed() {
    let surface = "NurbsSurface { solid FALSE uDimension 2 vDimension 2 uOrder 2 vOrder 2
        controlPoint [ -10 -10 0, 10 -10 0, -10 10 0, 10 10 0 ] uKnot [ 0 0 1 1 ] vKnot [ 0 0 1 1 ] }";
    let whole = compile_file(&format!("#VRML V2.0 utf8\nShape {{ geometry {surface} }}"));
    let found = hit(&whole, 9.0, 9.0).expect("the surface");
    assert!((found.t - 100.0).abs() < 1e-3);
    let of_x3d = surface
        .replace("NurbsSurface", "NurbsPatchSurface")
        .replace("controlPoint [", "controlPoint Coordinate { point [")
        .replace("0 ] uKnot", "0 ] } uKnot");
    let same = compile_file(&format!(
        "#X3D V3.3 utf8\nPROFILE Full\nShape {{ geometry {of_x3d} }}"
    ));
    assert_eq!(hit(&same, 9.0, 9.0).expect("the surface").t, found.t);
    let trimmed = compile_file(&format!(
        "#VRML V2.0 utf8\nShape {{ geometry TrimmedSurface {{ surface {surface}
           trimmingContour Contour2D {{ children Polyline2D {{ point [ 0 0, .5 0, .5 1, 0 1, 0 0 ] }} }} }} }}"
    ));
    assert!(hit(&trimmed, -5.0, 1.0).is_some());
    assert!(hit(&trimmed, 5.0, 1.0).is_none());
}

/// A text that is used twice is counted once. A scene without such letters has no warning.
#[test]
fn letters_without_a_glyph_are_one_warning_whatever_the_scene_is_read_for() {
    let warnings = |text: &str| {
        let document = document(&format!("#Inventor V2.1 ascii\n{text}"));
        let (snapshot, options) = (Snapshot::at(&document, 0.0), CompileOptions::default());
        let compiled = RenderScene::compile(&snapshot, &options).expect("compiles");
        let surveyed = RenderScene::survey(&snapshot, &options);
        let model = Model::of(&snapshot, &ModelOptions::default());
        let texts = |list: &[Diagnostic]| -> Vec<String> {
            let text = |d: &Diagnostic| format!("{:?}: {}", d.location().1, d.message);
            list.iter().map(text).collect()
        };
        let found = texts(&surveyed.diagnostics);
        assert_eq!(texts(&compiled.census().diagnostics), found);
        assert_eq!(texts(&model.diagnostics), found);
        found
    };
    let scene = "Text3 { string \"abc\" }
        Separator { AsciiText { string [ \"a你\", \"\u{200d}好\u{3000}\" ] } }
        DEF T Text2 { string \"日\" } USE T Text2Set { position 0 0 0 string \"क\" }";
    let message = "4 characters are in no typeface and are drawn as boxes: 3 Chinese, \
                   1 Devanagari; the first is `你` (U+4F60)";
    assert_eq!(warnings(scene), [format!("Some((3, 21)): {message}")]);
    assert!(warnings("Text3 { string \"Příklad Жук →\" }").is_empty());
}

#[test]
fn a_survey_says_that_a_text_is_too_long() {
    let document = document(&format!(
        "#Inventor V2.1 ascii\nText3 {{ string \"{}\" }}",
        "a".repeat(250_001)
    ));
    let survey = RenderScene::survey(&Snapshot::at(&document, 0.0), &CompileOptions::default());
    let messages: Vec<&str> = survey.diagnostics.iter().map(|d| &*d.message).collect();
    assert_eq!(messages.len(), 1, "{messages:?}");
    assert!(messages[0].contains("more than 250000 characters"));
}

/// The light that a kit makes is not among the nodes of the document.
#[test]
fn a_light_that_a_kit_makes_has_its_class() {
    let document = document("#Inventor V2.1 ascii\nLightKit { }\nCube { }");
    let snapshot = Snapshot::at(&document, 0.0);
    let survey = RenderScene::survey(&snapshot, &CompileOptions::default());
    let surveyed: Vec<&str> = survey.lights.iter().map(|(class, _)| &**class).collect();
    let model = Model::of(&snapshot, &ModelOptions::default());
    let modeled: Vec<&str> = model.lights.iter().map(|l| &*l.place.class).collect();
    assert_eq!([surveyed, modeled], [["DirectionalLight"]; 2]);
}

/// The cube that a kit makes has the number of its class, which a node of the file may have too.
#[test]
fn the_shape_that_a_kit_makes_is_no_repetition_of_a_node_with_its_number() {
    let number = usize::from(class::CUBE.0);
    let text = format!(
        "#Inventor V2.1 ascii\n{} DEF A Cube {{ width 1 }} USE A USE A ShapeKit {{ }}",
        "Label { } ".repeat(number)
    );
    assert_eq!(document(&text).nodes[number].name.as_deref(), Some("A"));
    let scene = compile_file(&text);
    assert!(hit(&scene, 0.75, 0.0).is_some());
}

/// SGI's library and Coin show a shape by the last camera before it, which a `Separator` restores.
#[test]
fn a_later_camera_that_acts_on_shapes_is_reported() {
    let camera = "PerspectiveCamera { }";
    for (scene, problems) in [
        (format!("{camera} {camera} Cube {{ }} Cube {{ }}"), 1),
        (format!("Separator {{ {camera} }} {camera} Cube {{ }}"), 1),
        (format!("{camera} Separator {{ {camera} }} Cube {{ }}"), 0),
        (format!("{camera} Cube {{ }} {camera}"), 0),
        (
            format!("Switch {{ whichChild 0 {camera} {camera} }} Cube {{ }}"),
            0,
        ),
    ] {
        for (header, problems) in [("Inventor V2.1", problems), ("VRML V1.0", 0)] {
            let document = document(&format!("#{header} ascii\n{scene}\n"));
            let survey = RenderScene::survey(&Snapshot::at(&document, 0.0), &Default::default());
            let found = &survey.diagnostics;
            assert_eq!(found.len(), problems, "{header} {scene}: {found:?}");
        }
    }
}

#[test]
fn what_is_wrong_with_a_nurbs_surface_is_reported_once() {
    let sizes = "uDimension 2 vDimension 2 uOrder 2 vOrder 2 controlPoint";
    let points = "[ -1 -1 0, 1 -1 0, -1 1 0, 1 1 0 ]";
    let patch = |points: String| {
        let geometry = format!("NurbsPatchSurface {{ {sizes} {points} }}");
        format!("#X3D V3.3 utf8\nPROFILE Full\nShape {{ geometry {geometry} }}")
    };
    let trimmed = |contour: &str| {
        let line = format!("Contour2D {{ children Polyline2D {{ point [ {contour} ] }} }}");
        let surface = format!("surface NurbsSurface {{ {sizes} {points} }}");
        let geometry = format!("TrimmedSurface {{ {surface} trimmingContour {line} }}");
        format!("#VRML V2.0 utf8\nShape {{ geometry {geometry} }}")
    };
    for (text, expected) in [
        (patch(format!("Coordinate {{ point {points} }}")), ""),
        (
            patch(format!("CoordinateDouble {{ point {points} }}")),
            "is not applied",
        ),
        (patch("Coordinate { }".into()), "fewer control points"),
        (trimmed(".2 .2, .8 .2, .5 .8, .2 .2"), ""),
        (trimmed(".2 .2, .8 .2, .5 .8"), "open trimming curve"),
    ] {
        let document = document(&text);
        let (snapshot, options) = (Snapshot::at(&document, 0.0), CompileOptions::default());
        let compiled = RenderScene::compile(&snapshot, &options).expect("compiles");
        let surveyed = RenderScene::survey(&snapshot, &options);
        for found in [&compiled.census().diagnostics, &surveyed.diagnostics] {
            let is_right = found.len() == usize::from(!expected.is_empty());
            let of = |d: &ivcam_base::diag::Diagnostic| d.message.contains(expected);
            assert!(is_right && found.iter().all(of), "{text}: {found:?}");
        }
    }
}
