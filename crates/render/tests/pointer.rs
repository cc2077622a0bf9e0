//! What sensors send when the pointer touches and drags shapes (ISO 14772-1, 6.15, 6.34, 6.44 and
//! 6.51). Expected values are computed from the standard's formulas for the default `Viewpoint`,
//! 10 m before the origin, and not by the program's rays.

use std::sync::Arc;

use glam::{DQuat, DVec2, DVec3};
use ivcam_inventor::events::{Action, ActionKind, SnapshotOptions};
use ivcam_inventor::iv::{Document, Limits, NoFiles};
use ivcam_render::scene::{CompileOptions, snapshot};

/// The events that a scene sends, and its warnings.
struct Played {
    sent: Vec<(f64, String, String)>,
    warnings: Vec<String>,
}

impl Played {
    /// Returns the times and numbers of an event, which is named as `NODE.EVENT`.
    fn all(&self, name: &str) -> Vec<(f64, Vec<f64>)> {
        let named = self.sent.iter().filter(|(_, event, _)| event == name);
        let numbers = |value: &str| -> Vec<f64> {
            let words = value.split_whitespace();
            words.map(|word| word.parse().expect("a number")).collect()
        };
        named
            .map(|(time, _, value)| (*time, numbers(value)))
            .collect()
    }

    /// Returns the numbers of an event that is sent last.
    fn last(&self, name: &str) -> Vec<f64> {
        let all = self.all(name);
        all.last()
            .unwrap_or_else(|| panic!("{name} is sent"))
            .1
            .clone()
    }

    /// Returns the words of an event, in their order.
    fn words(&self, name: &str) -> Vec<&str> {
        let named = self.sent.iter().filter(|(_, event, _)| event == name);
        named.map(|(.., value)| value.as_str()).collect()
    }
}

fn play(scene: &str, actions: &[Action], time: f64) -> Played {
    let text = format!("#VRML V2.0 utf8\nViewpoint {{ }}\n{scene}").into_bytes();
    let document = Document::read("a.wrl", text, Arc::new(NoFiles), &Limits::default());
    let document = document.expect("reads");
    let at = SnapshotOptions {
        time,
        actions: actions.to_vec(),
        log: true,
        ..SnapshotOptions::default()
    };
    let snapshot = snapshot(&document, &at, &CompileOptions::default());
    let sent = snapshot.sent().iter();
    let warnings = snapshot.diagnostics().iter();
    Played {
        sent: sent
            .map(|e| (e.time, format!("{}.{}", e.node, e.event), e.value.clone()))
            .collect(),
        warnings: warnings.map(|d| d.message.clone()).collect(),
    }
}

fn touch(node: &str, place: Option<DVec2>) -> Action {
    Action {
        time: 1.0,
        node: node.into(),
        what: ActionKind::Touch { place },
        viewer: None,
    }
}

/// Returns a drag from 1 s to 2 s by way of the places in the picture at which points of the world
/// are seen.
fn drag(node: &str, points: &[DVec3]) -> Action {
    Action {
        time: 1.0,
        node: node.into(),
        what: ActionKind::Drag {
            path: points.iter().map(|point| place(*point)).collect(),
            end: 2.0,
        },
        viewer: None,
    }
}

/// The angle of view of the default `Viewpoint` in radians, as ISO 14772-1, 6.53 rounds π/4.
#[allow(clippy::approx_constant)]
const FIELD_OF_VIEW: f32 = 0.785_398;

/// Returns where the default `Viewpoint` sees a point in a square picture.
fn place(point: DVec3) -> DVec2 {
    let half = libm::tan(0.5 * f64::from(FIELD_OF_VIEW));
    let at = point.truncate() / ((10.0 - point.z) * half);
    DVec2::new(0.5 + 0.5 * at.x, 0.5 - 0.5 * at.y)
}

#[track_caller]
fn assert_near(found: &[f64], wanted: &[f64]) {
    let near = |(a, b): (&f64, &f64)| (a - b).abs() < 2e-6 * (1.0 + b.abs());
    let is_near = found.len() == wanted.len() && found.iter().zip(wanted).all(near);
    assert!(is_near, "{found:?}, not {wanted:?}");
}

#[test]
fn a_touch_sensor_sends_the_point_and_the_normal_in_its_own_space() {
    let scene = "Transform { translation 1 .5 -2 rotation 0 0 1 .7 scale 2 1 1 children [
        DEF S TouchSensor { } Shape { geometry Sphere { } } ] }";
    // A point of the unit sphere that faces the viewer, and where it is in the world.
    let own = DVec3::new(0.3, -0.4, (1.0f64 - 0.25).sqrt());
    let turn = DQuat::from_axis_angle(DVec3::Z, f64::from(0.7f32));
    let world = DVec3::new(1.0, 0.5, -2.0) + turn * (own * DVec3::new(2.0, 1.0, 1.0));
    for name in ["S", "", "Sphere"] {
        let played = play(scene, &[touch(name, Some(place(world)))], 1.0);
        assert_near(&played.last("S.hitPoint_changed"), &own.to_array());
        assert_near(&played.last("S.hitNormal_changed"), &own.to_array());
        assert_eq!(played.words("S.isOver"), ["TRUE", "FALSE"]);
        assert_eq!(played.words("S.isActive"), ["TRUE", "FALSE"]);
        assert_near(&played.last("S.touchTime"), &[1.0]);
    }
}

#[test]
fn a_touch_sensor_sends_the_texture_coordinates_of_the_file() {
    let touched = |geometry: &str, point: DVec3| {
        let scene = format!("DEF S TouchSensor {{ }} Shape {{ geometry {geometry} }}");
        play(&scene, &[touch("S", Some(place(point)))], 1.0).last("S.hitTexCoord_changed")
    };
    // The front of a box of size 2 is at z = 1, with the coordinates of its left lower corner 0 0.
    let point = DVec3::new(0.5, -0.2, 1.0);
    assert_near(&touched("Box { }", point), &[0.75, 0.4]);
    let faces = "IndexedFaceSet { coord Coordinate { point [ -1 -1 0, 1 -1 0, 1 1 0, -1 1 0 ] }
        coordIndex [ 0 1 2 3 ] texCoord TextureCoordinate { point [ 0 0, 3 0, 3 5, 0 5 ] } }";
    assert_near(&touched(faces, DVec3::new(0.5, 0.0, 0.0)), &[2.25, 2.5]);
    // The middle of a sphere's front is half around from the seam at its back.
    assert_near(&touched("Sphere { }", DVec3::Z), &[0.5, 0.5]);
}

#[test]
fn without_a_place_the_pointer_is_over_the_middle_of_the_node() {
    let scene = "Transform { translation 2 1 0 children [ DEF S TouchSensor { }
        DEF B Shape { geometry Box { } } ] }
        Transform { translation 0 0 8 children Shape { geometry Box { size 4 4 .1 } } }";
    // The ray from 0 0 10 through 2 1 0 meets the front of the box at a tenth of the way.
    for name in ["S", "B"] {
        let played = play(scene, &[touch(name, None)], 1.0);
        assert_near(&played.last("S.hitPoint_changed"), &[-0.2, -0.1, 1.0]);
        assert_near(&played.last("S.hitNormal_changed"), &[0.0, 0.0, 1.0]);
    }
}

#[test]
fn what_is_nearest_is_touched_and_the_lowest_enabled_sensor_acts() {
    let scene = "Group { children [ DEF O TouchSensor { } Shape { geometry Box { } }
        Group { children [ DEF D TouchSensor { enabled FALSE }
          Transform { translation 1 0 3 children Shape { geometry Box { size 1 1 1 } } } ] }
        Group { children [ DEF I TouchSensor { }
          Transform { translation -1 0 3 children DEF L Shape { geometry Box { size 1 1 1 } } } ] }
        ] }
        Transform { translation 0 1 4 children DEF F Shape { geometry Box { size .5 .5 .5 } } }";
    let front = |x| touch("", Some(place(DVec3::new(x, 0.0, 3.5))));
    let active =
        |played: &Played| ["O", "D", "I"].map(|s| played.words(&format!("{s}.isActive")).len());
    assert_eq!(active(&play(scene, &[front(-1.0)], 1.0)), [0, 0, 2]);
    assert_eq!(active(&play(scene, &[front(1.0)], 1.0)), [2, 0, 0]);
    assert_eq!(active(&play(scene, &[front(0.0)], 1.0)), [2, 0, 0]);
    let cannot = |node: &str, point| {
        let played = play(scene, &[touch(node, Some(place(point)))], 1.0);
        assert_eq!(active(&played), [0, 0, 0]);
        played.warnings.concat()
    };
    assert!(cannot("", DVec3::new(0.0, 1.0, 4.25)).contains("nothing happens"));
    assert!(cannot("", DVec3::new(3.0, 3.0, 0.0)).contains("nothing is at"));
    let other = cannot("L", DVec3::new(1.0, 0.0, 3.5));
    assert!(other.contains("is a `Box`, not `L`"), "{other}");
}

#[test]
fn a_back_that_is_not_drawn_is_not_touched() {
    let scene = |solid: &str| {
        format!(
            "Transform {{ translation 0 0 10 children [ DEF S TouchSensor {{ }}
             Shape {{ geometry Box {{ size 30 30 30 }} }} ] }}
             DEF T TouchSensor {{ }}
             Shape {{ geometry IndexedFaceSet {{ solid {solid} coordIndex [ 0 1 2 ]
               coord Coordinate {{ point [ -1 -1 0, 0 1 0, 1 -1 0 ] }} }} }}"
        )
    };
    let middle = touch("", Some(DVec2::splat(0.5)));
    let hits = |solid| play(&scene(solid), std::slice::from_ref(&middle), 1.0);
    // The viewer is inside the box, whose faces are seen from outside only.
    let culled = hits("TRUE");
    assert!(
        culled.warnings.concat().contains("nothing is at"),
        "{:?} {:?}",
        culled.warnings,
        culled.words("T.hitPoint_changed")
    );
    let both = hits("FALSE");
    assert_near(&both.last("T.hitNormal_changed"), &[0.0, 0.0, 1.0]);
    assert_near(&both.last("T.hitPoint_changed"), &[0.0, 0.0, 0.0]);
}

#[test]
fn a_shape_that_is_used_twice_is_touched_where_it_is() {
    let scene = "Transform { translation 2 0 0 children DEF G Group { children [
          DEF S TouchSensor { } Shape { geometry Sphere { } } ] } }
        Transform { translation -3 1 0 scale 2 2 2 children USE G }";
    // The front of the second sphere, which is twice as large.
    let played = play(
        scene,
        &[touch("", Some(place(DVec3::new(-3.0, 1.0, 2.0))))],
        1.0,
    );
    assert_near(&played.last("S.hitPoint_changed"), &[0.0, 0.0, 1.0]);
}

#[test]
fn a_touch_ends_without_its_time_if_the_pointer_left_the_shape() {
    let scene = "DEF S TouchSensor { } Shape { geometry Sphere { } }";
    let (on, off) = (DVec3::Z, DVec3::new(3.0, 0.0, 0.0));
    let away = play(scene, &[drag("S", &[on, off])], 3.0);
    assert_eq!(away.words("S.isOver"), ["TRUE", "FALSE"]);
    assert_eq!(away.words("S.isActive"), ["TRUE", "FALSE"]);
    assert!(away.words("S.touchTime").is_empty());
    let back = play(scene, &[drag("S", &[on, off, on])], 3.0);
    assert_eq!(back.words("S.isOver"), ["TRUE", "FALSE", "TRUE", "FALSE"]);
    assert_near(&back.last("S.touchTime"), &[2.0]);
    // The points are sent while the pointer is over the sphere.
    for (_, point) in back.all("S.hitPoint_changed") {
        assert_near(&[DVec3::from_slice(&point).length()], &[1.0]);
    }
}

const SLIDER: &str = "Transform { translation 0 0 2 rotation 0 0 1 1.570796327 scale 2 2 2 children [
    DEF P PlaneSensor { FIELDS } DEF B Transform { children Shape { geometry Box { size 1 1 1 } } } ] }
    ROUTE P.translation_changed TO B.translation";

/// Returns the drag of the slider's front, which is at z = 3, between two points of the world.
fn slide(fields: &str, x: [f64; 2], time: f64) -> Played {
    let points = x.map(|x| DVec3::new(x, 0.25, 3.0));
    play(
        &SLIDER.replace("FIELDS", fields),
        &[drag("P", &points)],
        time,
    )
}

#[test]
fn a_plane_sensor_follows_the_pointer_on_the_plane_of_the_first_point() {
    // The sensor's x is the world's y, its y the world's −x, and its unit is 2 m.
    let played = slide("offset .5 0 0", [0.5, 1.5], 3.0);
    assert_near(&played.last("P.translation_changed"), &[0.5, -0.5, 0.0]);
    assert_near(&played.last("P.trackPoint_changed"), &[0.125, -0.75, 0.5]);
    let first = &played.all("P.translation_changed")[0];
    assert_near(&first.1, &[0.5, 0.0, 0.0]);
    assert_near(&played.last("P.offset"), &[0.5, -0.5, 0.0]);
    assert_eq!(played.words("P.isActive"), ["TRUE", "FALSE"]);
    // In the middle of the drag the pointer is in the middle, and still pressed.
    let middle = slide("", [0.5, 1.5], 1.5);
    assert_near(&middle.last("P.translation_changed"), &[0.0, -0.25, 0.0]);
    assert_eq!(middle.words("P.isActive"), ["TRUE"]);
    assert!(
        slide("autoOffset FALSE", [0.5, 1.5], 3.0)
            .words("P.offset")
            .is_empty()
    );
}

#[test]
fn a_plane_sensor_keeps_within_its_least_and_largest_position() {
    let ends = |fields, to| slide(fields, [0.5, to], 3.0).last("P.translation_changed");
    let within = "minPosition 0 -.25 maxPosition 0 .125";
    assert_near(&ends(within, 9.0), &[0.0, -0.25, 0.0]);
    assert_near(&ends(within, -9.0), &[0.0, 0.125, 0.0]);
    // A least position above the largest one means no limit.
    let only_x = "minPosition .25 0 maxPosition 1 -1";
    assert_near(&ends(only_x, 2.5), &[0.25, -1.0, 0.0]);
}

#[test]
fn the_next_drag_begins_with_the_offset_of_the_last() {
    let first = drag(
        "P",
        &[DVec3::new(0.5, 0.25, 3.0), DVec3::new(1.5, 0.25, 3.0)],
    );
    let second = Action {
        time: 4.0,
        what: match drag(
            "P",
            &[DVec3::new(1.5, 0.25, 3.0), DVec3::new(1.5, 1.25, 3.0)],
        )
        .what
        {
            ActionKind::Drag { path, .. } => ActionKind::Drag { path, end: 5.0 },
            other => other,
        },
        ..first.clone()
    };
    let ends = |fields: &str| {
        let played = play(
            &SLIDER.replace("FIELDS", fields),
            &[first.clone(), second.clone()],
            6.0,
        );
        played.last("P.translation_changed")
    };
    assert_near(&ends(""), &[0.5, -0.5, 0.0]);
    assert_near(&ends("autoOffset FALSE"), &[0.5, 0.0, 0.0]);
}

#[test]
fn a_sphere_sensor_turns_the_first_point_to_the_pointer() {
    let scene = "Transform { translation 0 1 0 children [
        DEF P SphereSensor { offset 1 0 0 .5 } Shape { geometry Sphere { radius 2 } } ] }";
    let [from, to] = [DVec3::new(-0.4, 0.3, 0.0), DVec3::new(1.2, -0.8, 0.0)]
        .map(|p| DVec3::new(p.x, p.y, (4.0 - p.length_squared()).sqrt()));
    let up = DVec3::Y;
    let played = play(scene, &[drag("P", &[from + up, to + up])], 3.0);
    let turn = played.last("P.rotation_changed");
    let turn = DQuat::from_axis_angle(DVec3::from_slice(&turn).normalize(), turn[3]);
    let offset = DQuat::from_axis_angle(DVec3::X, 0.5);
    // What was turned by the offset before is turned on, by the shortest way.
    let only = turn * offset.inverse();
    assert_near(&(only * from).to_array(), &to.to_array());
    let axis = DVec3::new(only.x, only.y, only.z);
    assert!(axis.dot(from).abs() < 1e-5 && axis.dot(to).abs() < 1e-5);
    assert_near(&played.last("P.trackPoint_changed"), &to.to_array());
    // Beside the sphere the pointer keeps to the nearest point of its outline.
    let beside = DVec3::new(2.6, 1.0, 0.0);
    let beside = play(scene, &[drag("P", &[from + up, beside])], 3.0);
    let edge = DVec3::from_slice(&beside.last("P.trackPoint_changed"));
    assert_near(&[edge.length()], &[2.0]);
    assert!(edge.x > 1.9 && edge.y.abs() < 0.1, "{edge}");
}

const WHEEL: &str = "DEF P CylinderSensor { FIELDS }
    Transform { TURN children Shape { geometry Cylinder { radius 2 height 3 } } }";

#[test]
fn a_cylinder_sensor_turns_the_side_around_its_axis() {
    let side = |angle: f64| 2.0 * DVec3::new(angle.sin(), 0.1, angle.cos());
    let ends = |fields: &str, points: &[DVec3]| {
        let scene = WHEEL.replace("FIELDS", fields).replace("TURN", "");
        play(&scene, &[drag("P", points)], 3.0).last("P.rotation_changed")
    };
    let points = [side(-0.4), side(0.9)];
    assert_near(&ends("", &points), &[0.0, 1.0, 0.0, 1.3]);
    assert_near(&ends("offset -.5", &points), &[0.0, 1.0, 0.0, 0.8]);
    let within = "minAngle -.25 maxAngle .5";
    assert_near(&ends(within, &points), &[0.0, 1.0, 0.0, 0.5]);
    let back = [points[1], points[0]];
    assert_near(&ends(within, &back), &[0.0, 1.0, 0.0, -0.25]);
}

#[test]
fn a_cylinder_sensor_is_a_disk_when_it_is_seen_along_its_axis() {
    // The axis is along z, toward the viewer. Its x stays x, and its z is the world's −y.
    let scene = "Transform { rotation 1 0 0 1.570796327 children [ DEF P CylinderSensor { FIELDS }
        Shape { geometry Cylinder { radius 2 height 3 } } ] }";
    let rim = |angle: f64| DVec3::new(angle.cos(), angle.sin(), 1.5);
    let turned = |fields: &str, angles: &[f64]| {
        let points: Vec<DVec3> = angles.iter().map(|angle| rim(*angle)).collect();
        let played = play(&scene.replace("FIELDS", fields), &[drag("P", &points)], 3.0);
        played.last("P.rotation_changed")[3]
    };
    assert_near(&[turned("", &[0.2, 1.2])], &[1.0]);
    // More than half a turn is followed.
    let far: Vec<f64> = (0..=10).map(|i| 0.5 * f64::from(i)).collect();
    assert_near(&[turned("", &far)], &[5.0]);
    // With a smaller angle the same wheel is a cylinder through the first point, 1 m from the axis.
    let outward = |fields: &str| {
        let points = [rim(0.2), rim(0.2) * DVec3::new(1.5, 1.5, 1.0)];
        let played = play(&scene.replace("FIELDS", fields), &[drag("P", &points)], 3.0);
        let point = DVec3::from_slice(&played.last("P.trackPoint_changed"));
        [DVec2::new(point.x, point.z).length(), point.y]
    };
    assert_near(&outward(""), &[1.5, 1.5]);
    assert_near(&outward("diskAngle 0")[..1], &[1.0]);
}

#[test]
fn a_sensor_that_is_disabled_in_a_drag_ends_it() {
    let stop = Action {
        time: 1.5,
        node: "P".into(),
        what: ActionKind::Send {
            event: "enabled".into(),
            value: "FALSE".into(),
        },
        viewer: None,
    };
    let points = [DVec3::new(0.0, 0.0, 3.0), DVec3::new(1.0, 0.0, 3.0)];
    let scene = SLIDER.replace("FIELDS", "");
    let played = play(&scene, &[drag("P", &points), stop], 3.0);
    assert_eq!(played.words("P.isActive"), ["TRUE", "FALSE"]);
    let moved = played.last("P.translation_changed");
    assert!((moved[1] + 0.25).abs() < 0.02, "{moved:?}");
}

/// The viewer is 10 m from the origin, and 0.25 m is the avatar's size unless a scene states
/// another.
#[test]
fn a_collision_is_sent_when_the_viewer_is_within_the_avatars_size_of_a_shape() {
    let scene = |fields: &str, shapes: &str, rest: &str| {
        format!(
            "DEF C Collision {{ {fields} children {shapes} }}
             DEF T TimeSensor {{ }} ROUTE C.collideTime TO T.set_startTime {rest}"
        )
    };
    let shape = |z: f64, geometry: &str| {
        format!("Transform {{ translation 0 0 {z} children Shape {{ geometry {geometry} }} }}")
    };
    let is_sent = |scene: &str| !play(scene, &[], 1.0).all("C.collideTime").is_empty();
    // The nearest face of the box is one in front of its middle.
    for (z, geometry, met) in [
        (8.76, "Box { }", true),
        (8.74, "Box { }", false),
        (8.76, "Sphere { }", true),
        (8.74, "Sphere { }", false),
        (11.2, "Box { }", true),
    ] {
        let scene = scene("", &shape(z, geometry), "");
        assert_eq!(is_sent(&scene), met, "{z} {geometry}");
    }
    let near = shape(8.76, "Box { }");
    assert!(!is_sent(&scene("collide FALSE", &near, "")));
    let inner = format!("Collision {{ collide FALSE children {near} }}");
    assert!(!is_sent(&scene("", &inner, "")));
    let far = shape(0.0, "Box { }");
    assert!(is_sent(&scene(&format!("proxy {near}"), &far, "")));
    assert!(!is_sent(&scene(&format!("proxy {far}"), &near, "")));
    assert!(is_sent(&scene(
        "",
        &shape(8.0, "Box { }"),
        "NavigationInfo { avatarSize [ 1.1 ] }"
    )));
}

#[test]
fn a_shape_that_moves_to_the_viewer_collides_once() {
    let scene =
        "DEF C Collision { children DEF M Transform { children Shape { geometry Box { } } } }
        DEF T TimeSensor { cycleInterval 10 loop TRUE }
        DEF P PositionInterpolator { key [ 0 1 ] keyValue [ 0 0 0, 0 0 10 ] }
        ROUTE T.fraction_changed TO P.set_fraction ROUTE P.value_changed TO M.set_translation
        DEF S TimeSensor { } ROUTE C.collideTime TO S.set_startTime";
    let sent = play(scene, &[], 9.9).all("C.collideTime");
    assert_eq!(sent.len(), 1, "{sent:?}");
    // Its face is 0.25 m away after 8.75 s, and is measured 25 times a second.
    let late = sent[0].0 - 8.75;
    assert!((0.0..0.04 + 1e-9).contains(&late), "{sent:?}");
}
