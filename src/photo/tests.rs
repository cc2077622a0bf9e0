//! Tests of sessions that change.

use std::path::Path;

use glam::DVec3;

use super::{Era, Plan, Session};
use crate::camera::Camera;
use crate::film::Resolution;
use crate::math::Meters;
use crate::pose::Projection;

const SCENE: &str = "#Inventor V2.1 ascii\nPerspectiveCamera { position 0 0 4 }\n\
    PointLight { location 2 3 4 }\nSphere { }\nTranslation { translation 1.5 .4 .5 } Cube { }\n";

fn plan(folder: &Path) -> Plan {
    std::fs::create_dir_all(folder).expect("a folder for the scene");
    let scene = folder.join("scene.iv");
    std::fs::write(&scene, SCENE).expect("the scene can be written");
    let mut plan = Plan::of_era(Era::Modern, scene);
    plan.resolution = Resolution {
        width: 36,
        height: 24,
    };
    plan.focus = Some(Meters(3.0));
    plan
}

/// The scene is compiled in single precision with its camera as the origin. A camera one meter away
/// has other rounding errors: the pictures agree to 1e-4 except for rays at an edge.
#[test]
fn a_camera_that_is_only_aimed_sees_what_it_sees_after_compiling() {
    let folder = std::env::temp_dir().join(format!("ivcam-plan-{}", std::process::id()));
    let mut session = Session::open(plan(&folder)).expect("the scene is whole");
    let mut pose = session.pose.clone();
    pose.position += DVec3::new(1.0, 0.2, -0.1);
    pose.orientation = glam::DQuat::from_rotation_y(0.2);
    let plan = session.plan.clone();
    session.aim(plan.clone(), pose.clone()).unwrap();
    let aimed = session.expose(&|_| ()).film;
    session.change(plan, pose.clone()).unwrap();
    assert_eq!(session.scene.origin, pose.position);
    let compiled = session.expose(&|_| ()).film;
    let apart = |(a, b): (&crate::film::Exposed, &crate::film::Exposed)| {
        (a.mean - b.mean).abs().max_element() > 1e-4
    };
    let off = aimed
        .pixels
        .iter()
        .zip(&compiled.pixels)
        .filter(|p| apart(*p));
    assert!(off.count() < 8);
    assert!(compiled.mean() > 0.01);
    std::fs::remove_dir_all(folder).unwrap();
}

/// The resolution of textures and lines depends on the lens, also if the lens consists of solids.
#[test]
fn the_scene_is_compiled_for_what_the_lens_sees() {
    let folder = std::env::temp_dir().join(format!("ivcam-seen-{}", std::process::id()));
    let mut session = Session::open(plan(&folder)).expect("the scene is whole");
    let tangent = |session: &Session| match session.projection {
        Projection::Perspective { height_angle } => libm::tan(0.5 * height_angle),
        Projection::Orthographic { .. } => f64::NAN,
    };
    let Camera::Lens(lens) = &session.camera else {
        panic!("the plan has a lens")
    };
    let sees = 12.0 / lens.focus.image_distance;
    assert!((tangent(&session) / sees - 1.0).abs() < 1e-12);

    let mut solid = session.plan.clone();
    solid.solids = true;
    let solid = Session::open(solid).expect("its surfaces are spheres");
    // The angle goes through a file, as a float.
    assert!((tangent(&solid) / sees - 1.0).abs() < 1e-6);

    let mut nearer = session.plan.clone();
    nearer.focus = Some(Meters(0.8));
    let pose = session.pose.clone();
    session.change(nearer, pose).unwrap();
    assert!(session.is_compiled_from_here());
    assert!(tangent(&session) < sees);
    std::fs::remove_dir_all(folder).unwrap();
}
