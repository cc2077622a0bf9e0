//! Tests of what conversions lose, and what they say about it.

use super::*;
use crate::export::rewriting;
use crate::photo::snapshot_options;
use ivcam_render::scene::snapshot;

#[test]
fn a_viewport_mapping_is_a_loss_where_cameras_have_none() {
    let scene = |mapping: &str| {
        format!(
            "#Inventor V2.1 ascii\nEnvironment {{ ambientIntensity 0 }}
             PerspectiveCamera {{ aspectRatio 2 viewportMapping {mapping} }} Cube {{ }}"
        )
    };
    for (target, expected) in [
        (Target::Glb, &["viewport-mapping"][..]),
        (Target::X3d, &["viewport-mapping"]),
        (Target::Inventor, &[]),
    ] {
        assert_eq!(
            losses(&scene("LEAVE_ALONE"), target),
            expected,
            "{target:?}"
        );
        assert_eq!(losses(&scene("ADJUST_CAMERA"), target), [""; 0]);
    }
}

/// A camera of Inventor shows a height, and the rectangle of an `OrthoViewpoint` has a width too.
#[test]
fn the_rectangle_of_an_ortho_viewpoint_is_lost_unless_it_is_a_square() {
    let codes = |sides: &str| {
        let text = format!(
            "#X3D V3.3 utf8\nPROFILE Full\nNavigationInfo {{ headlight FALSE }}\n\
             OrthoViewpoint {{ fieldOfView [ {sides} ] }} Shape {{ geometry Box {{ }} }}\n"
        );
        losses(&text, Target::Inventor)
    };
    assert!(codes("-4 -1 4 1").contains(&"viewport-mapping".to_owned()));
    assert!(!codes("-1 -1 1 1").contains(&"viewport-mapping".to_owned()));
}

/// A camera that is animated, and a light below a transform that is.
#[test]
fn motion_of_cameras_and_lights_is_lost_where_the_format_has_none() {
    let text = "#VRML V2.0 utf8\nNavigationInfo { headlight FALSE }
        DEF V Viewpoint { } DEF T Transform { children PointLight { radius 1e9 } }
        Shape { geometry Box { } }
        DEF C TimeSensor { loop TRUE }
        DEF P PositionInterpolator { key [ 0, 1 ] keyValue [ 0 0 10, 5 0 10 ] }
        ROUTE C.fraction_changed TO P.set_fraction ROUTE P.value_changed TO V.set_position
        ROUTE P.value_changed TO T.set_translation";
    for (target, expected) in [
        (Target::Inventor, &["Viewpoint", "PointLight"][..]),
        (Target::Obj, &[]),
        (Target::Glb, &[]),
    ] {
        let losses = converted(text, target).losses;
        let motion = losses.iter().filter(|loss| loss.code == "motion");
        let moving: Vec<&str> = motion.map(|loss| &*loss.place.class).collect();
        assert_eq!(moving, expected, "{target:?}");
    }
}

/// A `Viewpoint` whose angle changes, and a light that moves and grows: no format has the angle and
/// the strength as functions of time, and glTF has the motion.
#[test]
fn a_view_that_widens_and_a_light_that_brightens_are_lost() {
    let text = "#VRML V2.0 utf8\nNavigationInfo { headlight FALSE }
        DEF V Viewpoint { } DEF L PointLight { radius 1e9 } DEF M PointLight { radius 1e9 }
        Shape { geometry Box { } }
        DEF C TimeSensor { loop TRUE }
        DEF S ScalarInterpolator { key [ 0, 1 ] keyValue [ 0.5, 1 ] }
        DEF P PositionInterpolator { key [ 0, 1 ] keyValue [ 0 0 10, 5 0 10 ] }
        ROUTE C.fraction_changed TO S.set_fraction ROUTE S.value_changed TO V.set_fieldOfView
        ROUTE C.fraction_changed TO P.set_fraction ROUTE P.value_changed TO L.set_location
        ROUTE S.value_changed TO M.set_intensity ROUTE P.value_changed TO V.set_position";
    let losses = converted(text, Target::Glb).losses;
    let changing = losses.iter().filter(|loss| loss.code == "changing-value");
    let lost: Vec<Option<&str>> = changing.map(|loss| loss.place.name.as_deref()).collect();
    assert_eq!(lost, [Some("V"), Some("M")]);
}

/// VRML97, 4.14.4: a light adds its ambient part to the ambient color of the material.
#[test]
fn the_ambient_part_of_a_light_is_lost_where_lights_have_none() {
    let scene = |ambient: f32| {
        format!(
            "#VRML V2.0 utf8\nNavigationInfo {{ headlight FALSE }}
             DirectionalLight {{ ambientIntensity {ambient} }}
             Shape {{ appearance Appearance {{ material Material {{ }} }} geometry Box {{ }} }}"
        )
    };
    for target in [Target::Glb, Target::Usda, Target::Inventor] {
        let lost = |ambient| losses(&scene(ambient), target).contains(&"ambient-light".to_owned());
        assert_eq!(lost(0.3), target != Target::Inventor, "{target:?}");
        assert!(!lost(0.01), "below half a level of 255");
    }
}

/// Inventor's viewer is at infinity for highlights, VRML97's and glTF's at its place.
#[test]
fn highlights_that_depend_on_the_place_of_the_viewer_are_noted() {
    let text = "#Inventor V2.1 ascii\nEnvironment { ambientIntensity 0 }
        DirectionalLight { } Material { specularColor 1 1 1 } Cube { }";
    for (target, is_noted) in [
        (Target::Glb, true),
        (Target::X3d, true),
        (Target::Obj, false),
    ] {
        let losses = converted(text, target).losses;
        let mut found = losses.iter().filter(|loss| loss.code == "highlight");
        assert_eq!(found.next().is_some(), is_noted, "{target:?}");
        assert!(!losses.iter().any(|l| l.code == "highlight" && l.stated));
    }
}

/// Inventor's default mapping shows the height in a picture of any shape.
#[test]
fn a_parallel_view_keeps_its_height_whatever_its_aspect_ratio() {
    let text = "#Inventor V2.1 ascii\nOrthographicCamera { aspectRatio 2 height 3 } Cube { }";
    for target in [Target::Glb, Target::X3d] {
        let bytes = converted(text, target).bytes;
        let document = Document::read("a", bytes, Arc::new(NoFiles), &Limits::default()).unwrap();
        let options = ExportOptions::default();
        let taken = snapshot(&document, &snapshot_options(0.0), &options.model.compile);
        let pose = &Model::of(&taken, &options.model).cameras[0].pose;
        let extent = pose.view_extent(1.5).half;
        assert!((extent.y - 1.5).abs() < 1e-6, "{target:?} {extent}");
    }
}

/// OBJ has one opacity for a material, and a surface of USD one source of its color.
#[test]
fn colors_of_vertices_become_their_mean_where_the_format_has_one_value() {
    let scene = |texture: &str| {
        format!(
            "#Inventor V2.1 ascii\nEnvironment {{ ambientIntensity 0 }} {texture}
             ShapeHints {{ vertexOrdering COUNTERCLOCKWISE }}
             Material {{ diffuseColor [ 1 0 0, 0 0 1 ] transparency [ 0, 0.5 ] }}
             MaterialBinding {{ value PER_VERTEX_INDEXED }}
             Coordinate3 {{ point [ 0 0 0, 1 0 0, 0 1 0, 1 1 0 ] }}
             IndexedFaceSet {{ coordIndex [ 0 1 3 2 -1 ] materialIndex [ 0 1 0 1 -1 ] }}"
        )
    };
    let obj = converted(&scene(""), Target::Obj);
    let library = String::from_utf8(obj.beside[0].1.clone()).expect("text");
    assert!(
        library.contains("Kd 1 1 1\n") && library.contains("d 0.75\n"),
        "{library}"
    );
    let codes = |conversion: &Conversion| {
        let losses = conversion.losses.iter();
        losses.map(|loss| loss.code.clone()).collect::<Vec<_>>()
    };
    assert_eq!(codes(&obj), ["vertex-opacity"]);
    let usd = converted(&scene("Texture2 { image 1 1 3 0xffffff }"), Target::Usda);
    assert_eq!(codes(&usd), ["vertex-colors"]);
    let text = String::from_utf8(usd.bytes).expect("text");
    // Half of a screen's level is 0.214 of its light.
    assert!(
        text.contains("inputs:scale = (0.21404114, 0, 0.21404114, 0.75)"),
        "{text}"
    );
    assert!(!text.contains("def Shader \"Color\""), "{text}");
    let plain = converted(&scene(""), Target::Usda);
    assert_eq!(codes(&plain), [""; 0]);
}

#[test]
fn the_other_sides_of_faces_are_a_loss_where_they_would_be_seen() {
    let scene = |faces: &str| {
        let text = "ShapeHints { vertexOrdering COUNTERCLOCKWISE shapeType SOLID }
                    Environment { ambientIntensity 0 }
                    Coordinate3 { point [ 0 0 0, 1 0 0, 0 1 0, 0 0 1 ] }";
        format!("#Inventor V2.1 ascii\n{text} IndexedFaceSet {{ coordIndex [ {faces} ] }}")
    };
    let closed = "0 2 1 -1 0 1 3 -1 0 3 2 -1 1 2 3 -1";
    let open = "0 2 1 -1 0 1 3 -1 0 3 2 -1";
    let inward = "0 1 2 -1 0 3 1 -1 0 2 3 -1 1 3 2 -1";
    for (faces, target, expected) in [
        (closed, Target::Obj, false),
        (open, Target::Obj, true),
        (inward, Target::Obj, true),
        (open, Target::Ply, true),
        (open, Target::Glb, false),
        (open, Target::Vrml97, false),
    ] {
        let found = losses(&scene(faces), target);
        assert_eq!(
            found.contains(&"one-sided".to_owned()),
            expected,
            "{found:?}"
        );
    }
    let glass = format!(
        "#Inventor V2.1 ascii\nMaterial {{ transparency .5 }} {}",
        &scene(closed)[20..]
    );
    assert!(losses(&glass, Target::Obj).contains(&"one-sided".to_owned()));
    let both = scene(open).replace("SOLID", "UNKNOWN_SHAPE_TYPE");
    assert!(!losses(&both, Target::Obj).contains(&"one-sided".to_owned()));
}

#[test]
fn bright_colors_and_ambient_light_are_lost_where_the_format_has_none() {
    let has = |text: &str, target: Target, code: &str| {
        let scene = format!("#Inventor V2.1 ascii\n{text} Cube {{ }}");
        losses(&scene, target).iter().any(|found| found == code)
    };
    let bright = "Material { diffuseColor 1.5 1 1 }";
    for (target, is_lost) in [
        (Target::Glb, true),
        (Target::Vrml97, true),
        (Target::X3d, true),
        (Target::Ply, true),
        (Target::Obj, false),
        (Target::Usda, false),
        (Target::Inventor, false),
    ] {
        assert_eq!(has(bright, target, "color-range"), is_lost, "{target:?}");
        assert!(!has("", target, "color-range"));
    }
    // Inventor's defaults have 0.2 of 0.2, which are ten levels of 255.
    for (target, is_lost) in [
        (Target::Glb, true),
        (Target::Usda, true),
        (Target::Obj, true),
        (Target::Ply, true),
        (Target::X3d, false),
        (Target::Vrml97, false),
        (Target::Inventor, false),
    ] {
        assert_eq!(has("", target, "ambient-light"), is_lost, "{target:?}");
        assert!(!has(
            "Environment { ambientIntensity 0 }",
            target,
            "ambient-light"
        ));
        assert!(!has(
            "LightModel { model BASE_COLOR }",
            target,
            "ambient-light"
        ));
    }
}

/// Ambient light without an `Environment`, the attenuation and the radius of lights and the side of
/// faces have defaults that are lost.
#[test]
fn a_default_of_the_language_is_no_loss_of_the_file() {
    const INVENTOR: &str = "#Inventor V2.1 ascii";
    const VRML97: &str = "#VRML V2.0 utf8";
    let face = "coord Coordinate { point [ 0 0 0, 1 0 0, 0 1 0 ] } coordIndex [ 0 1 2 ] } }";
    let shape = |sides: &str| format!("Shape {{ geometry IndexedFaceSet {{ {sides} {face}");
    let lit = |light: &str| format!("{light} Shape {{ geometry Box {{ }} }}");
    let cases = [
        (INVENTOR, "Cube { }", Target::Glb, "ambient-light", ""),
        (
            INVENTOR,
            "Environment { fogType NONE } Cube { }",
            Target::Glb,
            "ambient-light",
            "",
        ),
        (
            INVENTOR,
            "Separator { Environment { ambientIntensity 1 } } Cube { }",
            Target::Ply,
            "ambient-light",
            "",
        ),
        (
            INVENTOR,
            "Environment { ambientIntensity 0.2 } Cube { } Cube { }",
            Target::Obj,
            "ambient-light",
            "Environment",
        ),
        (
            INVENTOR,
            "PointLight { } Cube { }",
            Target::Usda,
            "light-falloff",
            "",
        ),
        (
            INVENTOR,
            "Environment { attenuation 0 1 0 } PointLight { } Cube { }",
            Target::Usda,
            "light-falloff",
            "PointLight",
        ),
        (
            VRML97,
            &lit("PointLight { }"),
            Target::Glb,
            "light-falloff",
            "",
        ),
        (
            VRML97,
            &lit("PointLight { attenuation 1 0 0 }"),
            Target::Glb,
            "light-falloff",
            "PointLight",
        ),
        (
            VRML97,
            &lit("PointLight { location 0 0 200 }"),
            Target::Inventor,
            "light-radius",
            "",
        ),
        (
            VRML97,
            &lit("PointLight { location 0 0 200 radius 100 }"),
            Target::Inventor,
            "light-radius",
            "PointLight",
        ),
        (
            INVENTOR,
            "Coordinate3 { point [ 0 0 0, 1 0 0, 0 1 0 ] } FaceSet { } FaceSet { }",
            Target::Glb,
            "one-sided-light",
            "",
        ),
        (VRML97, &shape(""), Target::Obj, "one-sided", ""),
        (
            VRML97,
            &shape("solid TRUE"),
            Target::Ply,
            "one-sided",
            "IndexedFaceSet",
        ),
    ];
    for (header, scene, target, code, stated) in cases {
        let losses = converted(&format!("{header}\n{scene}"), target).losses;
        let found: Vec<_> = losses.iter().filter(|loss| loss.code == code).collect();
        assert_eq!(found.len(), 1, "{scene}: {losses:?}");
        let node = if found[0].stated {
            &*found[0].place.class
        } else {
            ""
        };
        assert_eq!(node, stated, "{scene}");
    }
    let lit = converted("#Inventor V2.1 ascii\nCube { }", Target::Glb).losses;
    assert!(!lit.is_empty() && !lit.has_stated() && lit.total() == 0);
    let report = lit.json("scene.iv", "glb", "scene.glb");
    assert_eq!(
        [&report["losses"][0]["stated"], &report["count"]],
        [&Json::from(false), &Json::from(0)]
    );
}

#[test]
fn the_texels_of_a_small_pixel_texture_are_squares_where_the_format_has_them() {
    let scene = |texture: &str| {
        let face = "coord Coordinate { point [ 0 0 0, 1 0 0, 0 1 0 ] } coordIndex [ 0 1 2 ]";
        format!(
            "#VRML V2.0 utf8\nShape {{ appearance Appearance {{ texture PixelTexture {{ \
             {texture} }} }} geometry IndexedFaceSet {{ solid FALSE {face} }} }}"
        )
    };
    let [small, wide] = [
        "2 1 3 0xff0000 0x00ff00",
        &format!("9 1 1 {}", "7 ".repeat(9)),
    ]
    .map(|image| scene(&format!("image {image}")));
    let filter = |text: &str| {
        let bytes = converted(text, Target::Gltf).bytes;
        let gltf: Json = serde_json::from_slice(&bytes).expect("JSON");
        gltf["samplers"][0]["magFilter"].clone()
    };
    assert_eq!([filter(&small), filter(&wide)], [9728, 9729]);
    for (target, expected) in [
        (Target::Obj, &["texture-filter"][..]),
        (Target::Usda, &["texture-filter"]),
        (Target::Inventor, &[]),
        (Target::Glb, &[]),
    ] {
        assert_eq!(losses(&small, target), expected, "{target:?}");
        assert_eq!(losses(&wide, target), [""; 0], "{target:?}");
    }
    let strip = scene("image 9 1 1 0 0 0 0 0 0 0 0 0 repeatT FALSE");
    assert_eq!(losses(&strip, Target::Obj), ["texture-repeat"]);
    assert_eq!(losses(&strip, Target::Glb), [""; 0]);
}

#[test]
fn lines_that_inventor_lights_are_a_loss_where_the_format_lights_none() {
    let lit = "#Inventor V2.1 ascii\nEnvironment { ambientIntensity 0 }
               DrawStyle { style LINES } Cube { }";
    let unlit = lit.replace("DrawStyle", "LightModel { model BASE_COLOR } DrawStyle");
    for (target, expected) in [
        (Target::Vrml97, &["lit-lines"][..]),
        (Target::X3d, &["lit-lines"]),
        (Target::Obj, &["lit-lines"]),
        (Target::Glb, &[]),
        (Target::Ply, &["lines-and-points"]),
    ] {
        assert_eq!(losses(lit, target), expected, "{target:?}");
    }
    assert_eq!(losses(&unlit, Target::Vrml97), [""; 0]);
    let unlit_cube = unlit.replace("DrawStyle { style LINES }", "");
    assert_eq!(losses(&unlit_cube, Target::Ply), ["shading"]);
    assert_eq!(losses(&unlit_cube, Target::Obj), [""; 0]);
}

#[test]
fn what_inventors_binary_form_cannot_hold_is_named_with_its_node() {
    let scene = "#VRML V2.0 utf8\nPROTO BOX [ ] { Shape { geometry Box { } } } BOX { }
                 DEF CLOCK TimeSensor { }\nDEF FADE Script { eventIn SFFloat now url \"\" }
                 ROUTE CLOCK.fraction_changed TO FADE.now";
    let losses = rewriting(&document(scene), Format::Binary, &ExportOptions::default()).losses;
    let found = losses.iter().map(|loss| (&*loss.code, loss.place.line()));
    let expected = [
        ("protos", Some(2)),
        ("routes", Some(4)),
        ("script-interfaces", Some(4)),
    ];
    assert_eq!(found.collect::<Vec<_>>(), expected);
}

#[test]
fn a_headlight_beside_lights_is_a_loss_in_formats_without_one() {
    let shape = "Shape { appearance Appearance { material Material { } } geometry Box { } }";
    let headlight = |head: &str| {
        let scene = document(&format!("#VRML V2.0 utf8\n{head} {shape}"));
        let options = ExportOptions::default();
        let converted = convert(&scene, Target::Glb, &options).expect("converts");
        let mut losses = converted.losses.iter();
        losses
            .find(|loss| loss.code == "headlight")
            .map(|loss| loss.stated)
    };
    assert_eq!(headlight(""), None);
    assert_eq!(headlight("DirectionalLight { }"), Some(false));
    let off = "NavigationInfo { headlight FALSE }";
    assert_eq!(headlight(off), Some(true));
    assert_eq!(headlight(&format!("{off} DirectionalLight {{ }}")), None);
}

/// The same document in its own language keeps what it states.
#[test]
fn what_pictures_do_not_apply_is_a_loss_unless_nodes_are_written_as_they_are() {
    let inventor = "#Inventor V2.1 ascii\nBumpMap { } Cube { } AlphaTest { }";
    let x3d = "<X3D profile='Full' version='4.0'><Scene><Transform visible='false'><Shape>\n\
         <Appearance><PhysicalMaterial emissiveColor='1 1 1'><PixelTexture image='1 1 1 9' \
         containerField='emissiveTexture'/><PixelTexture image='1 1 1 9' \
         containerField='normalTexture'/></PhysicalMaterial><FillProperties filled='false'/>\
         </Appearance><Box/></Shape></Transform></Scene></X3D>";
    for (text, own, expected) in [
        (
            inventor,
            Target::Inventor,
            [("BumpMap", Some(2)), ("AlphaTest", Some(2))].as_slice(),
        ),
        (
            x3d,
            Target::X3d,
            &[
                ("Transform", Some(1)),
                ("FillProperties", Some(2)),
                ("PhysicalMaterial", Some(2)),
                ("PhysicalMaterial", Some(2)),
            ],
        ),
    ] {
        let losses = converted(text, Target::Glb).losses;
        let lost = losses.iter().filter(|loss| loss.code == "not-applied");
        let found: Vec<_> = lost
            .inspect(|loss| assert!(loss.stated))
            .map(|loss| (&*loss.place.class, loss.place.line()))
            .collect();
        assert_eq!(found, expected);
        assert_eq!(self::losses(text, own), [""; 0]);
    }
}

#[test]
fn losses_name_their_node_and_line() {
    let scene = "#VRML V2.0 utf8\nFog { visibilityRange 9 }\nTransform { children [\n\
                 TouchSensor { } Shape { geometry Box { } } ] }\n";
    let conversion = converted(scene, Target::Glb);
    let found: Vec<(&str, Option<u32>)> = conversion
        .losses
        .iter()
        .map(|loss| (loss.place.class.as_str(), loss.place.line()))
        .collect();
    assert_eq!(found, [("Fog", Some(2)), ("TouchSensor", Some(4))]);
    let report = conversion.losses.json("scene.wrl", "glb", "scene.glb");
    assert_eq!(report["losses"][1]["feature"], "interaction");
    assert_eq!(report["count"], 2);
    let plain = "#VRML V2.0 utf8\nTransform { children Shape { geometry Box { } } }";
    assert!(losses(plain, Target::Glb).is_empty());
    // A shape without a material is not lit in VRML97.
    assert_eq!(losses(plain, Target::Ply), ["shading"]);
}
