//! What a picture of a VRML97 world shows: events, the viewer, bound nodes and the standard's
//! light.

use glam::DVec2;
use ivcam_inventor::events::{Action, ActionKind};
use ivcam_render::scene::TextureFilter;

use super::common::{Folder, levels, pinhole_plan};
use crate::photo::{CameraChoice, Override, Plan, WholeView};

/// Writes a scene to a folder, and returns its plan without a lens.
fn plan(folder: &Folder, scene: &str, text: &str) -> Plan {
    folder.file(scene, &format!("#VRML V2.0 utf8\n{text}"));
    pinhole_plan(folder, scene)
}

fn event(time: f64, node: &str, event: &str, value: &str) -> Action {
    let what = ActionKind::Send {
        event: event.into(),
        value: value.into(),
    };
    Action {
        time,
        node: node.into(),
        what,
        viewer: None,
    }
}

const RED: [u8; 3] = [255, 0, 0];
const GREEN: [u8; 3] = [0, 255, 0];

/// ISO 14772-1, 4.6.10: a route binds a `Background` and a `Viewpoint` one second after the start.
#[test]
fn a_picture_shows_the_bound_viewpoint_and_background() {
    let folder = Folder::new("binding");
    let text =
        "DEF V Viewpoint { } DEF W Viewpoint { position 0 0 -10 orientation 0 1 0 3.14159265 }
        DEF B Background { skyColor 1 0 0 } DEF C Background { skyColor 0 1 0 }
        DEF T TimeSensor { } ROUTE T.isActive TO W.set_bind ROUTE T.isActive TO C.set_bind
        Shape { geometry Box { } appearance Appearance { material Material { } } }\n";
    for (time, sky, z) in [(0.5, RED, 10.0), (1.5, GREEN, -10.0)] {
        let mut plan = plan(&folder, "binding.wrl", text);
        plan.time = time;
        plan.actions = vec![event(0.0, "T", "startTime", "1")];
        let (seen, session) = levels(plan, &[(5, 5)]);
        assert_eq!((seen[0], session.pose.position.z), (sky, z), "at {time}");
    }
}

/// The viewer stands in the sensor, which carries a sign into its view and turns on a light.
#[test]
fn a_sensor_knows_the_camera_of_the_picture() {
    let folder = Folder::new("proximity");
    let text = "NavigationInfo { headlight FALSE } DEF L DirectionalLight { on FALSE }
        DEF P ProximitySensor { size 40 40 40 } DEF S Transform { children Transform {
        translation 0 0 -5 children Shape { appearance Appearance { material Material {
        diffuseColor 1 1 1 } } geometry Box { size 1 1 1 } } } }
        ROUTE P.isActive TO L.on ROUTE P.position_changed TO S.translation\n";
    let viewpoint = format!("Viewpoint {{ position 3 0 10 }} {text}");
    let (seen, _) = levels(plan(&folder, "inside.wrl", &viewpoint), &[(120, 80)]);
    assert_eq!(seen, [[255; 3]]);
    let far = format!("Viewpoint {{ position 3 0 30 }} {text}");
    let (seen, _) = levels(plan(&folder, "outside.wrl", &far), &[(120, 80)]);
    assert_eq!(seen, [[0; 3]]);
    // A camera that the user chooses is where the viewer is.
    let mut chosen = plan(&folder, "chosen.wrl", &far);
    chosen.view = Some(Override::Always(WholeView::Standard));
    let (seen, _) = levels(chosen, &[(120, 80)]);
    assert_eq!(seen, [[255; 3]]);
}

/// What is dragged stays under the pointer, from whatever camera, also in the middle of the drag.
#[test]
fn a_drag_is_seen_from_the_camera_of_the_picture() {
    let folder = Folder::new("drag");
    let text = "Viewpoint { position 0 0 5 } Background { skyColor 0 1 0 } DEF P PlaneSensor { }
        DEF B Transform { children Shape { geometry Box { size .5 .5 .5 }
        appearance Appearance { material Material { emissiveColor 1 0 0 diffuseColor 0 0 0 } } } }
        ROUTE P.translation_changed TO B.translation\n";
    let aside = "#VRML V2.0 utf8\nViewpoint { position 3 0 5 orientation 0 1 0 .5404 }";
    for camera in [None, Some(aside)] {
        for (time, x) in [(0.5, 0.5), (1.5, 0.625), (3.0, 0.75)] {
            let mut plan = plan(&folder, "drag.wrl", text);
            plan.camera = camera.map(|node| CameraChoice::parse(node.as_ref()).expect("a camera"));
            plan.time = time;
            let path = [0.5, 0.75].map(|x| DVec2::new(x, 0.5)).to_vec();
            plan.actions = vec![Action {
                time: 1.0,
                node: "P".into(),
                what: ActionKind::Drag { path, end: 2.0 },
                viewer: None,
            }];
            let (width, height) = (plan.resolution.width, plan.resolution.height);
            let places = [0.5, 0.625, 0.75];
            let pixels = places.map(|x| ((f64::from(width) * x) as usize, height as usize / 2));
            let (seen, _) = levels(plan, &pixels);
            let wanted = places.map(|place| if place == x { RED } else { GREEN });
            assert_eq!(seen, wanted, "at {time}");
        }
    }
}

/// A scene without a camera is framed for all that is shown of it, so that motion is seen.
#[test]
fn pictures_of_two_times_show_what_moves() {
    let folder = Folder::new("motion");
    let text = "DEF T TimeSensor { loop TRUE cycleInterval 4 }
        DEF P PositionInterpolator { key [ 0 1 ] keyValue [ 0 0 0, 8 0 0 ] }
        DEF X Transform { children Shape { geometry Box { } appearance Appearance { material
        Material { emissiveColor 1 0 0 } } } }
        ROUTE T.fraction_changed TO P.set_fraction ROUTE P.value_changed TO X.translation\n";
    let middle = |time, view| {
        let mut plan = plan(&folder, "motion.wrl", text);
        (plan.time, plan.view) = (time, view);
        levels(plan, &[(120, 80)]).1.pose.position
    };
    let (start, end) = (middle(0.0, None), middle(3.0, None));
    assert!(
        start.x == 0.0 && (end.x - 3.0).abs() < 1e-6,
        "{start} {end}"
    );
    let standard = Some(Override::IfUnstated(WholeView::Standard));
    let there = glam::DVec3::new(0.0, 0.0, 10.0);
    assert_eq!([middle(0.0, standard), middle(3.0, standard)], [there; 2]);
}

#[test]
fn a_render_reports_what_fails_in_engines_and_scripts() {
    let folder = Folder::new("reports");
    let text = "Viewpoint { } Script { url \"Turn.class\" } Shape { geometry Sphere { } }\n";
    let (_, session) = levels(plan(&folder, "java.wrl", text), &[]);
    let mut messages = session.sink.items().iter().map(|d| d.message.clone());
    assert!(messages.any(|m| m.contains("`Script` was not run")));
}

#[cfg(feature = "scripts")]
#[test]
fn a_script_binds_and_reads_outputs() {
    let folder = Folder::new("script-world");
    let text = "Viewpoint { } Background { skyColor 1 0 0 } DEF B Background { skyColor 0 1 0 }
        DEF P PositionInterpolator { key [ 0 1 ] keyValue [ 0 0 7, 9 9 9 ] }
        Script { directOutput TRUE field SFNode b USE B field SFNode p USE P
        url \"javascript: function initialize() { if (p.value_changed.z == 7) b.set_bind = true; }\" }\n";
    let (seen, _) = levels(plan(&folder, "script.wrl", text), &[(5, 5)]);
    assert_eq!(seen, [GREEN]);
}

/// ISO 14772-1, 4.14.4. The light comes along the axis, so the half vector of a point at the angle
/// θ from the viewer's axis is θ/2 from the normal. Inventor's viewer is at infinity.
#[test]
fn highlights_of_vrml97_depend_on_the_viewers_position() {
    let folder = Folder::new("viewer");
    let text =
        "Viewpoint { position 0 0 10 } NavigationInfo { headlight FALSE } DirectionalLight { }
        Shape { appearance Appearance { material Material { diffuseColor 0 0 0 specularColor 1 1 1
        shininess .25 } } geometry Box { size 8 6 .0001 } }\n";
    let x = 180.0_f64;
    let slope = (x + 0.5 - 120.0) / 80.0 * (std::f64::consts::PI / 8.0).tan();
    let expected = 255.0 * (0.5 * slope.atan()).cos().powf(32.0);
    for phong in [false, true] {
        let mut plan = plan(&folder, "highlight.wrl", text);
        if phong {
            plan.shading = crate::photo::Shading::Phong;
        }
        let (seen, _) = levels(plan, &[(180, 79)]);
        let error = f64::from(seen[0][0]) - expected;
        assert!(error.abs() <= 1.5, "{seen:?} instead of {expected}");
    }
    folder.file(
        "infinite.iv",
        "#Inventor V2.1 ascii\nPerspectiveCamera { position 0 0 10 } DirectionalLight { }
        Material { diffuseColor 0 0 0 specularColor 1 1 1 shininess .25 }
        Cube { width 8 height 6 depth .0001 }\n",
    );
    let infinite = pinhole_plan(&folder, "infinite.iv");
    assert_eq!(levels(infinite, &[(180, 79)]).0, [[255; 3]]);
}

/// A textured card: two texels, of which the corners of the card have the middles.
fn card(image: &str) -> String {
    format!(
        "Viewpoint {{ position 0 0 5 }} Shape {{ appearance Appearance {{ texture PixelTexture {{
        image {image} }} }} geometry IndexedFaceSet {{ solid FALSE coord Coordinate {{
        point [ -1 -1 0, 1 -1 0, 1 1 0, -1 1 0 ] }} coordIndex [ 0 1 2 3 -1 ]
        texCoord TextureCoordinate {{ point [ .25 .5, .75 .5, .75 .5, .25 .5 ] }} }} }}\n"
    )
}

/// Between red and clear yellow there is red that fades, and no yellow.
#[test]
fn clear_texels_give_no_color_to_their_neighbors() {
    let folder = Folder::new("texels");
    let text = card("2 1 4 0xFF0000FF 0xFFFF0000");
    let mut smooth = plan(&folder, "clear.wrl", &text);
    smooth.texture_filter = Some(TextureFilter::Linear);
    let (seen, _) = levels(smooth, &[(119, 79)]);
    let [red, green, blue] = seen[0];
    assert!(
        (120..=136).contains(&red) && green == 0 && blue == 0,
        "{seen:?}"
    );
}

#[test]
fn texels_that_a_file_states_one_by_one_are_squares() {
    let folder = Folder::new("squares");
    let text = card("2 1 3 0xFF0000 0x00FF00");
    let at = [(105, 79), (135, 79)];
    let (seen, _) = levels(plan(&folder, "squares.wrl", &text), &at);
    assert_eq!(seen, [RED, GREEN]);
    let mut smooth = plan(&folder, "smooth.wrl", &text);
    smooth.texture_filter = Some(TextureFilter::Smooth);
    let (seen, _) = levels(smooth, &at);
    assert!(seen[0][1] > 20 && seen[1][0] > 20, "{seen:?}");
}

/// A clear front face shows the sky, and not the inside of the back face, which is culled.
#[test]
fn back_faces_of_solids_are_culled_behind_clear_parts() {
    let folder = Folder::new("clear-solid");
    let text = "Background { skyColor 0 0 1 } Viewpoint { position 0 0 6 }
        Shape { appearance Appearance { material Material { transparency .6 emissiveColor 1 0 0
        diffuseColor 0 0 0 } } geometry Box { } }\n";
    let (seen, _) = levels(plan(&folder, "clear.wrl", text), &[(120, 80)]);
    assert_eq!(seen, [[102, 0, 153]]);
}

/// The rim of a smooth cylinder is lit alike wherever its cross section begins: in front of the
/// camera or behind the cylinder.
#[test]
fn a_cap_counts_once_in_the_normals_of_its_rim() {
    let folder = Folder::new("rim");
    let rim = |name: &str, first: u32| {
        let point = |i: u32| {
            let angle = std::f64::consts::PI / 12.0 * f64::from((i + first) % 24);
            format!("{} {}", 2.0 * angle.sin(), 2.0 * angle.cos())
        };
        let points: Vec<String> = (0..=24).map(point).collect();
        let text = format!(
            "Viewpoint {{ position 0 1 12 }} Shape {{ appearance Appearance {{ material Material {{ }} }}
            geometry Extrusion {{ creaseAngle 6 solid FALSE spine [ 0 0 0, 0 2 0 ]
            crossSection [ {} ] }} }}\n",
            points.join(", ")
        );
        levels(plan(&folder, name, &text), &[(119, 63), (119, 66)]).0
    };
    let (in_front, behind) = (rim("front.wrl", 0), rim("behind.wrl", 12));
    for (a, b) in in_front.iter().zip(&behind) {
        assert!(
            a[0].abs_diff(b[0]) <= 1 && a[0] > 60,
            "{in_front:?} {behind:?}"
        );
    }
}
