//! Compares scenes whose parts are stored once with the expanded scenes.

use std::sync::Arc;

use glam::{DVec3, Vec3};
use ivcam_base::math::lanes::{LANES, Vec3Lanes, of_lane};
use ivcam_inventor::iv::{Document, Limits, NoFiles};
use ivcam_inventor::snapshot::Snapshot;

use super::shader::{ShadeOptions, Shader, Work};
use super::shading::Shading;
use crate::bvh::{PacketHits, Ray, RayPacket};
use crate::scene::{CompileOptions, Instancing, RenderScene};

/// The lights of the scenes, which are around z = -20.
const LIGHTS: &str = "PointLight { location 6 9 -4 color 1 .8 .6 }
    DirectionalLight { direction 1 -1 -2 }
    SpotLight { location -8 5 0 direction 8 -5 -20 cutOffAngle .6 }\n";

/// Compiles an Inventor scene with lights, or a scene with its own header.
fn compiled(scene: &str, shading: Shading, instancing: Instancing) -> RenderScene {
    let text = if scene.starts_with('#') {
        scene.to_owned()
    } else {
        format!("#Inventor V2.1 ascii\n{LIGHTS}{scene}")
    };
    let (files, limits) = (Arc::new(NoFiles), Limits::default());
    let document = Document::read("i.iv", text.into_bytes(), files, &limits).expect("reads");
    let options = CompileOptions {
        needs: shading.needs(),
        instancing,
        origin: DVec3::new(0.1, 0.2, 0.3),
        limits: Limits {
            visits: 20_000,
            ..Limits::default()
        },
        ..CompileOptions::default()
    };
    RenderScene::compile(&Snapshot::at(&document, 0.0), &options).expect("compiles")
}

/// The bits of a picture of 48 x 32 pixels, seen from the origin along -z, and the number of rays
/// that hit something.
fn picture(scene: &RenderScene, shading: Shading) -> (Vec<[u32; 3]>, u32) {
    let shader = Shader::new(scene, shading, ShadeOptions::default());
    let (mut pixels, mut hits, mut work) = (Vec::new(), 0, Work::default());
    for first in (0..48 * 32u16).step_by(LANES) {
        let mut rays = RayPacket::default();
        for lane in 0..LANES {
            let pixel = first + lane as u16;
            let at = |i: u16, n: u16| (f32::from(i) + 0.4) / f32::from(n) - 0.5;
            let aim = Vec3::new(1.2 * at(pixel % 48, 48), 0.8 * at(pixel / 48, 32), -1.0);
            rays.set(lane, &Ray::new(Vec3::new(0.01, 0.02, 0.0), aim));
        }
        let mut radiances = Vec3Lanes::default();
        let mut found = PacketHits::default();
        shader.radiances(&rays, None, &mut found, &mut radiances, &mut work);
        hits += found.mask.count_ones();
        let pixel = |lane: usize| of_lane(&radiances, lane).to_array().map(f32::to_bits);
        pixels.extend((0..LANES).map(pixel));
    }
    (pixels, hits)
}

/// Compares the pictures of a scene by all shading models, and returns the numbers of parts and of
/// uses.
fn compared(scene: &str) -> (u64, u64) {
    let mut counts = (0, 0);
    for shading in Shading::ALL {
        let expanded = compiled(scene, shading, Instancing::WhereItPays);
        let instanced = compiled(scene, shading, Instancing::Everywhere);
        assert_eq!(expanded.census().instances.placed, 0);
        let (known, hits) = picture(&expanded, shading);
        assert!(hits > 40, "{hits} hits: {scene}");
        let (found, _) = picture(&instanced, shading);
        let differs = known.iter().zip(&found).filter(|(a, b)| a != b).count();
        assert_eq!(differs, 0, "{shading:?}: {scene}");
        let [expanded, instanced] = [&expanded, &instanced].map(RenderScene::census);
        assert_eq!(expanded.seen, instanced.seen, "{scene}");
        assert_eq!(expanded.drawn, instanced.drawn, "{scene}");
        if shading == Shading::Recursive {
            counts = (instanced.instances.prototypes, instanced.instances.placed);
        }
    }
    counts
}

/// A shared part inside a shared part, with rotations, scales along oblique axes, and mirrors.
/// `shapes` are drawn 12 times.
fn nested(shapes: &str) -> String {
    format!(
        "Translation {{ translation 0 -1 -20 }}
        Material {{ diffuseColor .8 .6 .3 ambientColor .2 .1 .1 }}
        DEF pair Separator {{
            RotationXYZ {{ axis Y angle .4 }}
            DEF one Separator {{ {shapes} }}
            Transform {{ translation 3.1 .3 .2 rotation 1 2 3 .7 scaleFactor .7 1.3 .9
                scaleOrientation 1 1 0 .3 }}
            Separator {{ USE one }}
        }}
        Separator {{ Transform {{ translation -5 3 1 rotation 0 1 1 .8 }} USE pair }}
        Separator {{ Translation {{ translation 5 4 2 }}
            Scale {{ scaleFactor -.8 1 1.2 }} USE pair }}
        TransformSeparator {{ Translation {{ translation -4 -3 3 }} USE pair }}
        Separator {{ Transform {{ translation 4 -4 -2 rotation 1 0 0 2 }}
            MultipleCopy {{ matrix [ 1 0 0 0 0 1 0 0 0 0 1 0 0 0 0 1,
                0 1 0 0 -.5 0 0 0 0 0 1 0 -2 1 2 1 ] USE pair }} }}"
    )
}

const CUBE: &str = "Cube { width 2 height 1.5 depth 1 }";

#[test]
fn nested_uses_have_the_picture_of_the_expanded_document() {
    assert_eq!(compared(&nested(CUBE)), (3, 12 + 6 + 2));
    let mesh = "Coordinate3 { point [ -1 -1 0, 1 -1 .2, 1 1 0, -1 1 .3, 0 0 1.5 ] }
        ShapeHints { vertexOrdering COUNTERCLOCKWISE shapeType SOLID creaseAngle 2 }
        MaterialBinding { value PER_VERTEX_INDEXED }
        Material { diffuseColor [ 1 0 0, 0 1 0, 0 0 1, 1 1 0, 1 1 1 ] }
        IndexedFaceSet { coordIndex [ 0, 1, 4, -1, 1, 2, 4, -1, 2, 3, 4, -1, 3, 0, 4, -1 ] }
        Translation { translation 0 0 -1 } QuadMesh { verticesPerRow 2 verticesPerColumn 2 }";
    compared(&nested(mesh));
    let text = "Font { size 2 } Text3 { string \"ab\" parts ALL }";
    compared(&nested(text));
}

/// Two glyphs are stored, and drawn 3 times in each of the 12 uses of the innermost part.
#[test]
fn the_glyphs_of_texts_are_stored_once_with_the_picture_of_the_expanded_text() {
    let text = |text: &str| format!("Font {{ size 1.3 }} {text}");
    let solid = text("Text3 { string [ \"ab\", \" a\" ] parts ALL justification CENTER }");
    assert_eq!(compared(&nested(&solid)), (3 + 2, 20 + 3 * 12));
    let materials = "MaterialBinding { value PER_PART } Material { diffuseColor [ 1 0 0, 0 1 0 ] }
        ProfileCoordinate2 { point [ 0 0, .1 .05, .4 .05 ] } LinearProfile { index [ 0, 1, 2 ] }";
    let parts = format!("{materials} {solid}");
    assert_eq!(compared(&nested(&parts)).0, 3 + 2);
    let flat = text("AsciiText { string [ \"wide\", \"w\" ] width [ 9, 0 ] }");
    assert_eq!(
        compared(&nested(&flat)).0,
        3 + 5,
        "a stretched glyph is another one"
    );
    let textured = format!("Texture2 {{ image 1 2 3 0xff0000 0x00ff00 }} {solid}");
    assert_eq!(
        compared(&nested(&textured)).0,
        3,
        "textures depend on the place"
    );
    let large = solid.replace("size 1.3", "size 4");
    let outside = format!("Translation {{ translation -1 0 -9 }} {large} {large}");
    assert_eq!(compared(&outside), (2, 6), "two texts share glyphs");
    let clear = format!("Material {{ transparency .5 }} {outside}");
    compared(&clear);
    let vrml97 = "#VRML V2.0 utf8
        Transform { translation -3 0 -9 children Shape {
            appearance Appearance { material Material { } }
            geometry Text { string [ \"abba\" ] fontStyle FontStyle { size 4 } } } }";
    assert_eq!(compared(vrml97), (2, 4));
}

#[test]
fn a_glyph_that_cannot_be_placed_is_expanded() {
    for scale in ["1 0 1", "1e-20 1 1", "1e15 1 1"] {
        let scene = format!(
            "Translation {{ translation -2 0 -12 }} Cube {{ }} Text3 {{ string \"ab\" }}
            Scale {{ scaleFactor {scale} }} Text3 {{ string \"ba\" parts ALL }}"
        );
        assert_eq!(counted(&scene), (4, 2), "{scale}");
    }
}

#[test]
fn a_long_text_is_stored_as_its_glyphs() {
    let line = "The quick brown fox jumps over the lazy dog. ".repeat(4);
    let lines = format!("\"{line}\"\n").repeat(100);
    let scene = format!(
        "Translation {{ translation -9 9 -60 }} Font {{ size 1 }}
        Text3 {{ parts ALL string [ {lines} ] }}"
    );
    let scene = compiled(&scene, Shading::Recursive, Instancing::WhereItPays);
    let (triangles, _, _) = scene.primitives();
    let census = scene.census();
    assert_eq!(
        census.instances.placed,
        100 * 4 * 36,
        "glyphs that are not spaces"
    );
    let drawn = census.instances.primitives;
    assert!(
        triangles < 20_000 && drawn > 4_000_000,
        "{triangles} of {drawn}"
    );
    assert!(picture(&scene, Shading::Recursive).1 > 0);
}

#[test]
fn round_shapes_and_textures_have_the_picture_of_the_expanded_document() {
    let texture = "Texture2 { image 2 2 3 0xff0000 0x00ff00 0x0000ff 0xffffff }";
    let round = "Sphere { } Translation { translation 1 1 0 } Cone { } Cylinder { radius .4 }";
    compared(&nested(round));
    compared(&nested(&format!(
        "{texture} Sphere {{ radius 1.2 }} {CUBE}"
    )));
    let shiny = "Material { diffuseColor .2 .5 .9 specularColor .6 .6 .5 shininess .4 }";
    compared(&nested(&format!("{shiny} Sphere {{ radius 1.2 }} {CUBE}")));
}

#[test]
fn transparent_parts_have_the_picture_of_the_expanded_document() {
    let clear = "Material { diffuseColor .9 .5 .1 transparency .6 }";
    let above = "Translation { translation 0 1 0 } Sphere { }";
    compared(&nested(&format!("{clear} {CUBE} {above}")));
}

/// Of parts in one place the one that is drawn last is seen.
#[test]
fn parts_in_one_place_are_seen_in_the_order_of_drawing() {
    let scene = format!(
        "Translation {{ translation 0 0 -12 }} DEF one Separator {{ {CUBE} Cube {{ height 4 }} }}
        Separator {{ Material {{ diffuseColor 1 0 0 }} USE one }} Cube {{ width 3 }}
        Separator {{ Material {{ diffuseColor 0 1 0 }} USE one }}
        Separator {{ Material {{ diffuseColor 0 0 1 }} Cube {{ width 4 }} USE one }}
        Translation {{ translation 1 0 0 }} USE one USE one"
    );
    assert_eq!(compared(&scene), (4, 6));
}

#[test]
fn an_array_of_arrays_has_the_picture_of_the_expanded_document() {
    let scene = |shapes: &str, origin: &str| {
        format!(
            "Transform {{ translation -4 -3 -20 rotation 1 1 0 .5 }} Array {{ origin {origin}
            numElements1 3 numElements2 2 numElements3 3 separation1 4 0 0 separation2 .5 3 0
            separation3 0 0 5 Array {{ numElements1 2 separation1 0 1.5 .1
            Scale {{ scaleFactor .5 .5 .5 }} {shapes} }} }}"
        )
    };
    assert_eq!(compared(&scene(CUBE, "FIRST")), (2, 18 * 3));
    compared(&scene("Sphere { }", "CENTER"));
    compared(&scene("Material { transparency .5 } Cone { }", "LAST"));
    let inherits = "Switch { whichChild -2 Cube { } Sphere { } }";
    assert_eq!(compared(&scene(inherits, "FIRST")), (0, 0));
}

#[test]
fn another_state_from_outside_makes_another_part() {
    let scene = |second: &str| {
        format!(
            "Translation {{ translation -2 0 -12 }} Material {{ diffuseColor .1 .2 .9 }}
            DEF one Separator {{ {CUBE} Sphere {{ }} }}
            Translation {{ translation 3 0 0 }} {second} USE one USE one"
        )
    };
    assert_eq!(compared(&scene("")), (1, 3));
    assert_eq!(
        compared(&scene("Material { diffuseColor .1 .2 .9 }")),
        (1, 3)
    );
    assert_eq!(compared(&scene("Material { diffuseColor 1 0 0 }")), (2, 3));
    assert_eq!(compared(&scene("Complexity { value .1 }")), (2, 3));
    assert_eq!(compared(&scene("DirectionalLight { }")), (2, 3));
}

#[test]
fn a_part_that_depends_on_its_place_is_expanded() {
    for part in [
        "PointLight { location 0 3 0 } Cube { }",
        "LOD { range 9 Cube { } Sphere { } }",
        "LevelOfDetail { screenArea 9 Cube { } Sphere { } }",
        "ClipPlane { plane 1 0 0 .2 } Cube { }",
        "DrawStyle { style LINES lineWidth 9 } Cube { }",
        "Text2 { string \"wide\" } Cube { }",
        "Translation { translation 1 0 -9 } ResetTransform { } Cube { }",
        "Scale { scaleFactor 2 1 1 } AntiSquish { } Cube { }",
        "Texture2 { image 1 1 3 0xff8000 } TextureCoordinatePlane { } Cube { }",
        "Environment { fogType FOG } Cube { }",
        "Complexity { type BOUNDING_BOX } Sphere { }",
        "PerspectiveCamera { } Cube { }",
    ] {
        assert_eq!(counted(&nested(part)), (0, 0), "{part}");
    }
}

/// Compares the pictures of a scene by one shading model, and returns the numbers of parts and of
/// uses.
fn counted(scene: &str) -> (u64, u64) {
    let [expanded, instanced] = [Instancing::WhereItPays, Instancing::Everywhere]
        .map(|instancing| compiled(scene, Shading::Recursive, instancing));
    let [known, found] = [&expanded, &instanced].map(|scene| picture(scene, Shading::Recursive));
    assert!(known == found && known.1 > 0, "{scene}");
    let counts = instanced.census().instances;
    (counts.prototypes, counts.placed)
}

#[test]
fn a_use_under_a_matrix_without_an_inverse_is_expanded() {
    for scale in ["1 0 1", "0 0 1", "1e-20 1 1", "1e15 1 1"] {
        let scene = format!(
            "Translation {{ translation -2 0 -12 }} DEF one Separator {{ {CUBE} Sphere {{ }} }}
            Translation {{ translation 3 0 0 }} RotationXYZ {{ axis X angle .7 }}
            Separator {{ Scale {{ scaleFactor {scale} }} USE one }} USE one"
        );
        assert_eq!(counted(&scene), (1, 2), "{scale}");
    }
}

#[test]
fn vrml97_shapes_and_transforms_are_shared() {
    let scene = "#VRML V2.0 utf8
        PointLight { location 0 6 -4 }
        DEF one Transform { translation -3 0 -14 rotation 0 1 0 .4 children [
            DEF shape Shape { appearance Appearance { material Material { diffuseColor 1 .5 .2 } }
                geometry Box { } }
            Transform { translation 0 2.5 0 scale .5 1 2 children USE shape } ] }
        Transform { translation 5 1 0 rotation 0 0 1 1 children [ USE one USE shape ] }";
    assert_eq!(compared(scene), (2, 2 + 4 + 1));
}

/// Ten uses of ten uses of ... ten cubes, eight times.
#[test]
fn a_hundred_million_cubes_are_stored_as_a_few() {
    let mut scene = "DEF n0 Separator { Cube { } }\n".to_owned();
    let mut size = 3.0;
    for level in 1..=8 {
        let steps = format!(
            "Translation {{ translation {size} 0 0 }} USE n{} ",
            level - 1
        );
        let turn = "Transform { rotation 1 2 3 .2 scaleFactor .9 1 1 }";
        scene += &format!("DEF n{level} Separator {{ {turn} {} }}\n", steps.repeat(10));
        size *= 3.0;
    }
    let scene = format!("Switch {{ {scene} }} Translation {{ translation -9999 0 -29999 }} USE n8");
    let scene = compiled(&scene, Shading::Recursive, Instancing::WhereItPays);
    let (triangles, _, _) = scene.primitives();
    assert!(triangles < 20_000, "{triangles} triangles");
    let census = scene.census();
    assert_eq!(census.instances.primitives, 1_200_000_000);
    assert_eq!(census.drawn["Cube"], 100_000_000);
    assert!(census.diagnostics.is_empty(), "{:?}", census.diagnostics);
    assert!(picture(&scene, Shading::Recursive).1 > 0);
}

#[test]
fn parts_nested_beyond_all_numbers_are_reported() {
    let mut scene = "DEF n0 Separator { Cube { } }\n".to_owned();
    for level in 1..=80 {
        let (below, step) = (
            level - 1,
            format!("Translation {{ translation 0 0 {level} }}"),
        );
        scene += &format!("DEF n{level} Separator {{ USE n{below} {step} USE n{below} }}\n");
    }
    let scene = format!("Switch {{ {scene} }} Translation {{ translation 0 0 -9 }} USE n80");
    for instancing in [Instancing::WhereItPays, Instancing::Everywhere] {
        let scene = compiled(&scene, Shading::Flat, instancing);
        let reports = &scene.census().diagnostics;
        let is_reported = |d: &ivcam_base::diag::Diagnostic| {
            d.message.contains("more than") && d.message.contains("the rest is left out")
        };
        assert!(reports.iter().any(is_reported), "{reports:?}");
        assert!(picture(&scene, Shading::Flat).1 > 0);
    }
    // Arrays whose steps are multiples of each other would be one grid.
    let arrays = [1.0, 0.7, 0.3].map(|step| {
        let side = "numElements1 30000 numElements2 30000 numElements3 30000";
        format!("Array {{ {side} separation1 {step} 0 0 ")
    });
    let scene = format!("{}Cube {{ }}{}", arrays.concat(), "}".repeat(3));
    let scene = compiled(&scene, Shading::Flat, Instancing::WhereItPays);
    assert!(scene.census().instances.primitives > 1 << 40);
    assert!(!scene.census().diagnostics.is_empty());
}
