//! Every part of the program sees the values of nodes at the time of the picture.

use std::ffi::OsString;
use std::sync::Arc;

use glam::DVec3;
use ivcam_inventor::events::SnapshotOptions;
use ivcam_inventor::iv::{Document, Limits, NoFiles};
use ivcam_render::scene::{CompileOptions, RenderScene, snapshot};

/// Returns the position of the first camera that `check` finds.
fn surveyed(scene: &str, time: f64) -> Option<DVec3> {
    let bytes = scene.as_bytes().to_vec();
    let document = Document::read("scene", bytes, Arc::new(NoFiles), &Limits::default());
    let document = document.expect("reads");
    let at = SnapshotOptions {
        time,
        ..SnapshotOptions::default()
    };
    let options = CompileOptions::default();
    let survey = RenderScene::survey(&snapshot(&document, &at, &options), &options);
    survey.cameras.first().map(|camera| camera.position)
}

/// Renders a picture with `render`.
fn rendered(name: &str, scene: &str, time: f64) -> image::RgbImage {
    let unique = format!("ivcam-snapshot-{}-{name}", std::process::id());
    let folder = std::env::temp_dir().join(unique);
    std::fs::create_dir_all(&folder).expect("a folder");
    let (file, picture) = (folder.join(name), folder.join(format!("{name}.png")));
    std::fs::write(&file, scene).expect("the scene is written");
    let time = time.to_string();
    let words = [
        "ivcam",
        "render",
        "--quiet",
        "--size",
        "36x24",
        "--samples",
        "1",
        "--lens",
        "none",
        "--scene-time",
        &time,
        "-o",
    ];
    let mut words = words.map(OsString::from).to_vec();
    words.extend([picture.clone().into(), file.into()]);
    assert_eq!(crate::cli::run(words), 0);
    let made = image::open(picture).expect("a picture").to_rgb8();
    std::fs::remove_dir_all(folder).expect("the folder can be removed");
    made
}

#[test]
fn a_camera_that_an_engine_moves_is_photographed_from_where_check_finds_it() {
    let scene = |position: &str| {
        format!(
            "#Inventor V2.1 ascii\nPerspectiveCamera {{ position {position} }}
             Cube {{ }} Translation {{ translation 2 1 -1 }} Sphere {{ }}"
        )
    };
    let moved = scene("0 0 5 position = ComposeVec3f { x 3 y 0 z 5 } . vector");
    assert_eq!(surveyed(&moved, 0.0), Some(DVec3::new(3.0, 0.0, 5.0)));
    let picture = rendered("engine.iv", &moved, 0.0);
    assert!(picture == rendered("there.iv", &scene("3 0 5"), 0.0));
    assert!(picture != rendered("as-stated.iv", &scene("0 0 5"), 0.0));
}

#[test]
fn a_route_moves_a_viewpoint_with_the_time_of_the_scene() {
    let scene = |position: &str, routes: &str| {
        format!(
            "#VRML V2.0 utf8\nDEF V Viewpoint {{ position {position} }}
             Shape {{ geometry Box {{ }} }}\n{routes}"
        )
    };
    let routes = "DEF T TimeSensor { loop TRUE cycleInterval 1 }
        DEF P PositionInterpolator { key [ 0 1 ] keyValue [ -2 0 8, 2 0 8 ] }
        ROUTE T.fraction_changed TO P.set_fraction
        ROUTE P.value_changed TO V.set_position";
    let moved = scene("9 9 9", routes);
    for (time, at) in [(0.0, "-2 0 8"), (0.5, "0 0 8")] {
        let still = scene(at, "");
        assert_eq!(surveyed(&moved, time), surveyed(&still, time));
        assert!(rendered("route.wrl", &moved, time) == rendered("still.wrl", &still, 0.0));
    }
    assert!(rendered("first.wrl", &moved, 0.0) != rendered("later.wrl", &moved, 0.5));
}
