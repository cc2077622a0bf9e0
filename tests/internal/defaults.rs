//! What the default picture of a scene shows, as far as it is known from a standard or from what
//! every viewer of the time drew.

use super::common::{Folder, levels, pinhole_plan};
use crate::photo::{Override, WholeView};

/// Two posts, of which the far one is beside the near one in the picture.
const POSTS: &str = "#VRML V2.0 utf8\nViewpoint { position 0 0 6 fieldOfView .8 }
    Transform { translation -1 0 2 children Shape { geometry Box { size .3 2 .3 }
    appearance Appearance { material DEF M Material { diffuseColor 1 1 1 } } } }
    Transform { translation -1 0 -3 children Shape { geometry Box { size .3 2 .3 }
    appearance Appearance { material USE M } } }\n";

/// The headlight is at the eye, and everything that is seen is in its light.
#[test]
fn nothing_that_is_seen_is_in_the_shadow_of_the_headlight() {
    let folder = Folder::new("headlight");
    folder.file("posts.wrl", POSTS);
    let at = [(64, 79), (100, 79)];
    let (lit, session) = levels(pinhole_plan(&folder, "posts.wrl"), &at);
    assert_eq!(lit, [[255; 3]; 2]);
    assert_eq!(session.expose(&|_| {}).counts.shadow_rays, 0);
    let mut vintage = pinhole_plan(&folder, "posts.wrl");
    vintage.unseen_shadows = true;
    assert_eq!(levels(vintage, &at).0, [[255; 3], [0; 3]]);

    // A stated light at the eye.
    let light = "NavigationInfo { headlight FALSE } PointLight { location 0 0 6 }";
    folder.file("lamp.wrl", &format!("{POSTS}{light}"));
    let (lit, _) = levels(pinhole_plan(&folder, "lamp.wrl"), &at);
    assert!(lit.iter().all(|rgb| rgb[0] > 230), "{lit:?}");
}

/// The front of every face is inside, so the camera sees the far side of the box. Light that comes
/// from where the camera is passes the near side as the view does.
#[test]
fn a_face_that_is_culled_throws_no_shadow() {
    let folder = Folder::new("culled");
    let shape = "Shape { appearance Appearance { material Material { diffuseColor 1 0 0 } }
        geometry IndexedFaceSet { ccw FALSE coord Coordinate { point [ -1 -1 1, 1 -1 1, 1 1 1,
        -1 1 1, -1 -1 -1, 1 -1 -1, 1 1 -1, -1 1 -1 ] } coordIndex [ 0 1 2 3 -1, 5 4 7 6 -1,
        1 5 6 2 -1, 4 0 3 7 -1, 3 2 6 7 -1, 4 5 1 0 -1 ] } }\n";
    let light = "NavigationInfo { headlight FALSE } DirectionalLight { direction .1 -.2 -1 }\n";
    for (i, text) in [shape.to_owned(), format!("{light}{shape}")]
        .into_iter()
        .enumerate()
    {
        let [inside, outside] = ["inside", "outside"].map(|name| format!("{name}-{i}.wrl"));
        folder.file(&inside, &format!("#VRML V2.0 utf8\n{text}"));
        let (seen, _) = levels(pinhole_plan(&folder, &inside), &[(120, 80)]);
        assert!(seen[0][0] > 245 && seen[0][1] == 0, "{seen:?}");
        // The faces that the light sees do.
        folder.file(
            &outside,
            &format!("#VRML V2.0 utf8\n{text}").replace("FALSE coord", "TRUE coord"),
        );
        let (seen, _) = levels(pinhole_plan(&folder, &outside), &[(120, 80)]);
        assert!(seen[0][0] > 245 && seen[0][1] == 0, "{seen:?}");
    }
}

#[test]
fn a_material_with_highlights_is_no_mirror_unless_the_plan_says_so() {
    let folder = Folder::new("mirrors");
    let text = "#Inventor V2.1 ascii\nOrthographicCamera { position 0 0 5 height 2 }
        Separator { LightModel { model BASE_COLOR } Material { diffuseColor 0 1 0 }
        Translation { translation 0 0 9 } Cube { width 99 height 99 depth 1 } }
        Material { diffuseColor .2 .2 .2 specularColor 1 1 1 shininess .4 }
        DirectionalLight { direction 1 0 -.1 } Cube { }\n";
    folder.file("chrome.iv", text);
    let green = |mirrors| {
        let mut plan = pinhole_plan(&folder, "chrome.iv");
        plan.mirrors = mirrors;
        levels(plan, &[(120, 80)]).0[0][1]
    };
    assert!(green(None) < 60 && green(Some(0.5)) < 60);
    assert!(green(Some(0.0)) > 100 && green(Some(0.4)) > 100);
}

/// The mirror is wholly in the fog, and so is what it mirrors (ISO 14772-1, 4.14.5).
#[test]
fn fog_before_a_mirror_dims_what_it_mirrors() {
    let folder = Folder::new("fog");
    let text = "#VRML V2.0 utf8\nViewpoint { position 0 0 10 fieldOfView .6 }
        Fog { color .2 .1 .3 visibilityRange 5 } Background { skyColor 0 .5 0 }
        Transform { translation 1.5 0 0 children Shape { geometry Sphere { } appearance Appearance {
        material Material { emissiveColor 1 1 0 specularColor 1 1 1 } } } }\n";
    folder.file("fog.wrl", text);
    let mut plan = pinhole_plan(&folder, "fog.wrl");
    plan.mirrors = Some(0.0);
    assert_eq!(levels(plan, &[(157, 79)]).0, [[51, 26, 77]]);
}

/// ISO 14772-1, 4.6.10. The box is as far away as the main file's `Viewpoint` says.
#[test]
fn the_bindable_nodes_of_an_inlined_file_are_not_bound() {
    let folder = Folder::new("bindable");
    let part = "#VRML V2.0 utf8\nBackground { skyColor 0 1 0 } Viewpoint { position 0 0 40 }
        NavigationInfo { headlight FALSE } Fog { color 0 0 1 visibilityRange 5 }
        Shape { appearance Appearance { material Material { } } geometry Box { } }\n";
    folder.file("part.wrl", part);
    let main = "#VRML V2.0 utf8\nInline { url \"part.wrl\" } Viewpoint { position 0 0 10 }
        Background { skyColor 1 0 0 } NavigationInfo { headlight TRUE }\n";
    folder.file("main.wrl", main);
    let (seen, session) = levels(pinhole_plan(&folder, "main.wrl"), &[(23, 15), (119, 79)]);
    assert_eq!(seen, [[255, 0, 0], [204; 3]]);
    assert!(session.headlight.is_some());
    assert_eq!(session.pose.position.z, 10.0);

    // Nor if the main file has none of them.
    folder.file("none.wrl", "#VRML V2.0 utf8\nInline { url \"part.wrl\" }\n");
    let (seen, session) = levels(pinhole_plan(&folder, "none.wrl"), &[(2, 2), (119, 79)]);
    assert_eq!(seen, [[0; 3], [204; 3]]);
    assert!(session.pose.position.z < 10.0);
}

const FLAT: &str = "Coordinate3 { point [ -1 0 -1, 1 0 -1, 1 0 1, -1 0 1 ] }
    IndexedFaceSet { coordIndex [ 0, 3, 2, 1, -1 ] }\n";

#[test]
fn a_scene_without_a_camera_is_seen_from_the_front_unless_that_shows_nothing() {
    let folder = Folder::new("sides");
    let solid = "ShapeHints { vertexOrdering COUNTERCLOCKWISE shapeType SOLID }
        Coordinate3 { point [ -1 -1 0, 1 -1 0, 1 1 0, -1 1 0 ] }
        IndexedFaceSet { coordIndex [ 3, 2, 1, 0, -1 ] }\n";
    for (i, (body, side)) in [
        ("Cube { }\n", None),
        (FLAT, Some("top")),
        (solid, Some("back")),
        ("Cube { depth 0 width 0 }\n", None),
        ("PerspectiveCamera { position 0 0 5 } ", None),
    ]
    .into_iter()
    .enumerate()
    {
        let name = format!("side-{i}.iv");
        let rest = if body.starts_with("Persp") { FLAT } else { "" };
        folder.file(&name, &format!("#Inventor V2.1 ascii\n{body}{rest}"));
        let (seen, session) = levels(pinhole_plan(&folder, &name), &[(120, 80)]);
        let notice = session.view_notice();
        assert_eq!(notice.is_some(), side.is_some(), "{body}: {notice:?}");
        if let Some(side) = side {
            assert!(notice.is_some_and(|line| line.contains(side)), "{body}");
            assert!(seen[0][0] > 150, "{body}: {seen:?}");
        }
    }
}

/// X3D has VRML97's light (ISO/IEC 19775-1, 17.2.2), and not Inventor's ambient light.
#[test]
fn x3d_has_no_ambient_light_but_that_of_its_lights() {
    let folder = Folder::new("x3d-light");
    for (light, level) in [
        ("", 0),
        ("DirectionalLight { intensity 0 ambientIntensity 0.5 }", 128),
    ] {
        let scene = format!(
            "#X3D V3.3 utf8\nPROFILE Immersive\nNavigationInfo {{ headlight FALSE }} {light}
            Shape {{ appearance Appearance {{ material Material {{
            diffuseColor 1 1 1 ambientIntensity 1 }} }} geometry Box {{ }} }}\n"
        );
        folder.file("box.x3dv", &scene);
        let (seen, _) = levels(pinhole_plan(&folder, "box.x3dv"), &[(120, 80)]);
        assert_eq!(seen, [[level; 3]], "{light}");
    }
}

/// In the frame of a rover's site x is north, y east and z down. The picture of the ground, with
/// north up, is mirrored for a camera below it.
#[test]
fn a_photograph_of_the_ground_is_not_seen_from_below() {
    let folder = Folder::new("ground");
    let ground = |east: i32| {
        format!(
            "#Inventor V2.1 ascii\nTexture2 {{ image 2 1 3 0xff0000 0x00ff00 }}
            Coordinate3 {{ point [ 0 {west} 0, 0 {east} 0, 2 {east} 0, 2 {west} 0 ] }}
            TextureCoordinate2 {{ point [ 0 0, 1 0, 1 1, 0 1 ] }}
            IndexedFaceSet {{ coordIndex [ 0, 1, 2, 3, -1 ] }}\n",
            west = -east
        )
    };
    folder.file("down.iv", &ground(1));
    folder.file("up.iv", &ground(-1));
    let (_, session) = levels(pinhole_plan(&folder, "down.iv"), &[(120, 80)]);
    let notice = session.view_notice().expect("another side");
    assert!(notice.contains("-90,25,-z"), "{notice}");
    let pose = &session.pose;
    assert!(
        pose.position.z < -0.5 && pose.direction().x > 0.5,
        "{pose:?}"
    );
    // East is on the right, and up in the picture is away from the ground.
    assert!((pose.orientation * glam::DVec3::X).y > 0.999, "{pose:?}");
    assert!((pose.orientation * glam::DVec3::Y).z < -0.5, "{pose:?}");
    let (_, session) = levels(pinhole_plan(&folder, "up.iv"), &[(120, 80)]);
    assert_eq!(session.view_notice(), None);
}

/// What a file states is not overruled, except by an option that says so.
#[test]
fn a_view_and_a_background_of_the_plan_go_before_or_after_those_of_the_scene() {
    use ivcam_inventor::pose::ViewDirection;
    let folder = Folder::new("views");
    let stated = "#VRML V2.0 utf8\nViewpoint { position 0 0 30 } Background { skyColor 0 0 1 }
        Shape { geometry Box { } }\n";
    folder.file("stated.wrl", stated);
    folder.file(
        "silent.wrl",
        "#VRML V2.0 utf8\nShape { geometry Box { } }\n",
    );
    let green = glam::Vec3::Y;
    for (scene, always, moved, corner) in [
        ("stated.wrl", true, true, [0, 255, 0]),
        ("stated.wrl", false, false, [0, 0, 255]),
        ("silent.wrl", true, true, [0, 255, 0]),
        ("silent.wrl", false, true, [0, 255, 0]),
    ] {
        let mut plan = pinhole_plan(&folder, scene);
        let top = WholeView::Side(ViewDirection::new(0.0, 90.0));
        (plan.view, plan.background) = match always {
            true => (Some(Override::Always(top)), Some(Override::Always(green))),
            false => (
                Some(Override::IfUnstated(top)),
                Some(Override::IfUnstated(green)),
            ),
        };
        let (seen, session) = levels(plan, &[(1, 1)]);
        assert_eq!(seen, [corner], "{scene} {always}");
        let looks_down = session.pose.direction().y < -0.999;
        assert_eq!(looks_down, moved, "{scene} {always}");
    }
}

/// Microsoft's C library wrote NaN as `-1.#IND`, of which a reader may take `#IND` for a comment.
#[test]
fn a_point_that_is_not_a_number_costs_only_that_point() {
    let folder = Folder::new("nan");
    let text = "#VRML V2.0 utf8\nViewpoint { position .5 .5 4 }\nShape { appearance Appearance {
        material Material { diffuseColor 1 0 0 } } geometry IndexedFaceSet { solid FALSE
        coord Coordinate { point [\n-1.#IND -1.#IND00 1.#QNAN,\n 0 0 0, 1 0 0, 1 1 0, 0 1 0 ] }
        coordIndex [ 1 2 3 4 -1 ] } }\n";
    folder.file("msvc.wrl", text);
    let (seen, session) = levels(pinhole_plan(&folder, "msvc.wrl"), &[(120, 80)]);
    assert!(seen[0][0] > 245, "{seen:?}");
    assert_eq!(session.scene.primitives().0, 2);
    let place = session.sink.items().iter().find_map(|d| d.location().1);
    assert_eq!(place, Some((6, 1)));
}

/// Castle's scenes have a `NavigationInfo` in files of VRML 1.0, which view3dscene obeys.
#[test]
fn a_navigation_info_in_vrml_1_turns_the_headlight_off() {
    let folder = Folder::new("navigation");
    let text = "#VRML V1.0 ascii\nNavigationInfo { headlight FALSE }
        PerspectiveCamera { position 0 0 5 } Cube { }\n";
    let lit = text.replace("FALSE", "TRUE");
    let level = |name: &str, text: &str| {
        folder.file(name, text);
        levels(pinhole_plan(&folder, name), &[(120, 80)]).0[0][0]
    };
    let (dark, lit) = (level("dark.wrl", text), level("lit.wrl", &lit));
    assert!(dark < 15 && lit > 190, "{dark} {lit}");
}

/// A damaged string leaves a `Text2` without letters, whose place alone is nothing to draw.
#[test]
fn a_text_without_ink_is_nothing_to_draw() {
    let folder = Folder::new("ink");
    for (text, nothing) in [("\"\"", true), ("\" \"", true), ("\"a\"", false)] {
        folder.file(
            "text.iv",
            &format!("#Inventor V2.1 ascii\nText2 {{ string {text} }}\n"),
        );
        let (_, session) = levels(pinhole_plan(&folder, "text.iv"), &[(0, 0)]);
        assert_eq!(session.draws_nothing, nothing, "{text}");
    }
}
