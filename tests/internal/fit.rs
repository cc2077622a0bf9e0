//! Finds the camera of an archival picture from a start that is disturbed by 5 cm, 2 degrees and 5%
//! of the focal length, and from an 8-bit JPEG with noise.

use std::path::Path;

use common::{Folder, ivcam};
use ivcam_base::math::{Mm, meters};
use ivcam_inventor::iv::Document;
use ivcam_inventor::pose::{CameraPose, Projection};
use ivcam_optics::film::Resolution;

use super::common;
use crate::compare::Plate;
use crate::compare::lens_ranking::{LensQuestion, LensRanking, with_focal_length};
use crate::photo::{CameraChoice, LensChoice, Session};

/// A corner of a room: tiled floor and walls, and solids at several distances.
const SCENE: &str = r#"#Inventor V2.1 ascii
Separator {
  PointLight { location 1 2 2 intensity 0.9 }
  Separator {
    Coordinate3 { point [ -2 0 -3, 2 0 -3, 2 0 1, -2 0 1, -2 2 -3, 2 2 -3 ] }
    Material { diffuseColor [ 0.6 0.5 0.4, 0.4 0.5 0.6 ] }
    MaterialBinding { value PER_FACE }
    IndexedFaceSet { coordIndex [ 0, 3, 2, 1, -1, 0, 1, 5, 4, -1 ] }
  }
  DEF BOX Separator {
    Material { diffuseColor 0.8 0.2 0.1 }
    Translation { translation -0.5 0.2 -0.6 }
    Cube { width 0.4 height 0.4 depth 0.4 }
  }
  Separator { Translation { translation 0.9 0.1 -1.3 } RotationXYZ { axis Y angle 0.5 } USE BOX }
  Separator { Translation { translation -0.4 0.5 -2.2 } RotationXYZ { axis Z angle 0.7 } USE BOX }
  Separator {
    Material { diffuseColor 0.9 0.8 0.2 }
    Translation { translation 0.35 0.25 -0.4 }
    Sphere { radius 0.25 }
    Translation { translation -0.6 0.3 -1.2 }
    Sphere { radius 0.2 }
  }
  Separator {
    Material { diffuseColor 0.1 0.5 0.3 }
    Translation { translation 0.0 0.3 -1.0 }
    Cone { bottomRadius 0.25 height 0.6 }
    Translation { translation 1.2 0.4 -0.8 }
    Cylinder { radius 0.15 height 1.4 }
    Translation { translation -2.6 0.1 -0.4 }
    Cylinder { radius 0.1 height 1.6 }
  }
}
"#;

const TRUTH: &str = "#Inventor V2.1 ascii
PerspectiveCamera { position 0 0.7 1.6 orientation 1 0 0 -0.2 heightAngle 0.8 focalDistance 2 }";

/// The true camera, moved by 3, 4 and 0 cm, rotated by 2 degrees about a slanted axis, and with a
/// focal length longer by 5%.
const DISTURBED: &str = "#Inventor V2.1 ascii
PerspectiveCamera {
  position 0.03 0.74 1.6 orientation 0.97014250 0.24253563 0 -0.18
  heightAngle 0.76536 focalDistance 2
}";

fn pose(path: &str) -> CameraPose {
    let document = Document::open(Path::new(path)).unwrap();
    let node = document.node(document.roots[0]);
    CameraPose::from_node(node, glam::DMat4::IDENTITY).unwrap()
}

fn focal(pose: &CameraPose) -> f64 {
    match pose.projection {
        Projection::Perspective { height_angle } => 12.0 / (0.5 * height_angle).tan(),
        Projection::Orthographic { .. } => f64::NAN,
    }
}

/// Returns the differences in meters, degrees, and fractions of the focal length.
fn apart(a: &CameraPose, b: &CameraPose) -> [f64; 3] {
    let cos = a.orientation.dot(b.orientation).abs().min(1.0);
    [
        a.position.distance(b.position),
        2.0 * cos.acos().to_degrees(),
        (focal(a) / focal(b)).ln().abs(),
    ]
}

/// Adds grain of two levels and writes a JPEG of quality 85.
fn archive(png: &str, jpeg: &str) {
    let mut picture = image::open(png).unwrap().to_rgb8();
    let mut state = 1_u64;
    for level in picture.as_flat_samples_mut().samples {
        let mut sum = 0.0;
        for _ in 0..12 {
            state = state
                .wrapping_mul(6_364_136_223_846_793_005)
                .wrapping_add(1_442_695_040_888_963_407);
            sum += (state >> 40) as f64 / (1 << 24) as f64;
        }
        *level = (f64::from(*level) * 0.9 + 8.0 + 2.0 * (sum - 6.0)).round() as u8;
    }
    let file = std::fs::File::create(jpeg).unwrap();
    image::codecs::jpeg::JpegEncoder::new_with_quality(file, 85)
        .encode_image(&picture)
        .unwrap();
}

/// The result of `compare --fit`, with its output.
struct Found {
    /// The errors of the start and of the result, in meters, degrees, and fractions of the focal
    /// length.
    start: [f64; 3],
    end: [f64; 3],
    camera: CameraPose,
    /// The focal length of the lens, from a comment in the file.
    efl: Option<f64>,
}

/// Renders the room, makes an archival JPEG of it, and fits its camera.
fn found_again(name: &str, true_optics: &str, start_optics: &str, common: &str) -> Found {
    let folder = Folder::new(name);
    let scene = folder.file("room.iv", SCENE);
    let truth = folder.file("true.dat", TRUTH);
    let start = folder.file("start.dat", DISTURBED);
    let [png, jpeg, found] = ["true.png", "old.jpg", "found.dat"].map(|n| folder.path(n));
    let render = format!(
        "render {scene} --camera {truth} {true_optics} -o {png} --samples 64 --seed 7 {common}"
    );
    assert_eq!(ivcam(&render, &[]), 0);
    archive(&png, &jpeg);
    let fit =
        format!("compare {scene} {jpeg} --camera {start} {start_optics} --fit {found} {common}");
    assert_eq!(ivcam(&fit, &[]), 0);
    let [truth, start, camera] = [truth, start, found.clone()].map(|path| pose(&path));
    let text = std::fs::read_to_string(found).unwrap();
    let efl = text
        .split_once("--efl ")
        .and_then(|(_, rest)| rest.split_once("mm"));
    Found {
        start: apart(&start, &truth),
        end: apart(&camera, &truth),
        camera,
        efl: efl.map(|(number, _)| number.parse().unwrap()),
    }
}

#[test]
#[ignore = "a measurement of minutes, listed in docs/performance.md"]
fn a_disturbed_camera_is_found_again_from_a_noisy_jpeg() {
    let common = "--lens none --size 192x128 --quiet";
    let found = found_again("fit", "", "--samples 4", common);
    let [shift, turn, length] = found.start;
    assert!(
        shift > 0.049 && turn > 2.0 && length > 0.048,
        "{shift} {turn} {length}"
    );
    let [shift, turn, length] = found.end;
    eprintln!(
        "{:.2} mm, {turn:.4} degrees, {:.3}% left",
        1000.0 * shift,
        100.0 * length
    );
    // The error is at most a tenth of the disturbance.
    assert!(shift < 0.005, "{shift} m left");
    assert!(turn < 0.2, "{turn} degrees left");
    assert!(length < 0.005, "{length} of the focal length left");
}

#[test]
fn a_picture_of_something_else_is_refused() {
    let folder = Folder::new("fit-else");
    let scene = folder.file("room.iv", SCENE);
    let other = folder.file(
        "other.iv",
        "#Inventor V2.1 ascii\nDirectionalLight { }\nArray { numElements1 5 separation1 .9 0 0 \
         numElements2 4 separation2 0.2 .7 0 origin CENTER Cone { bottomRadius .3 height .5 } }",
    );
    let camera = folder.file("camera.dat", TRUTH);
    let [png, found] = ["other.png", "found.dat"].map(|n| folder.path(n));
    let common = "--lens none --size 96x64 --samples 4 --quiet";
    assert_eq!(ivcam(&format!("render {other} -o {png} {common}"), &[]), 0);
    std::fs::write(&found, "of another fit").unwrap();
    let fit = format!("compare {scene} {png} --camera {camera} --fit {found} {common}");
    assert_eq!(ivcam(&fit, &[]), 2);
    assert_eq!(std::fs::read_to_string(&found).unwrap(), "of another fit");
    // The camera where the fit ended is left.
    let ended = pose(&format!("{found}.part"));
    assert!(ended.position.is_finite());
}

#[test]
#[ignore = "a measurement of minutes, listed in docs/performance.md"]
fn a_distorted_pinhole_is_found_again() {
    let common = "--lens none --size 192x128 --quiet";
    let start = "--distortion -0.05 --samples 4";
    let found = found_again("fit-bent", "--distortion -0.15", start, common);
    let [shift, turn, length] = found.end;
    assert!(shift < 0.005, "{shift} m left");
    assert!(turn < 0.2, "{turn} degrees left");
    assert!(length < 0.005, "{length} of the focal length left");
}

/// A fast lens is focused on the cone; the start is focused far behind it.
#[test]
#[ignore = "a measurement of minutes, listed in docs/performance.md"]
fn a_disturbed_lens_is_found_again_with_its_focus() {
    let common = "--lens double-gauss --size 144x96 --quiet --response srgb";
    let found = found_again(
        "fit-focus",
        "--efl 60mm --focus 1.9",
        "--efl 63mm --focus 2.6 --samples 8",
        common,
    );
    let [shift, turn, _] = found.end;
    let length = (found.efl.unwrap() / 60.0).ln().abs();
    let focus = (found.camera.focal_distance / 1.9).ln().abs();
    eprintln!(
        "{:.2} mm, {turn:.4} degrees, {:.3}% of the focal length, {:.2}% of the focus left",
        1000.0 * shift,
        100.0 * length,
        100.0 * focus
    );
    assert!(shift < 0.01, "{shift} m left");
    assert!(turn < 0.2, "{turn} degrees left");
    assert!(length < 0.005, "{length} of the focal length left");
    assert!(focus < 0.05, "{focus} of the focus left");
}

/// Photographs the room through a lens, and ranks lenses by an archival JPEG of that, from the
/// disturbed camera. Returns the ranking and its report.
fn ranked(name: &str, true_lens: &str, efl: f64, names: &[&str]) -> (LensRanking, String) {
    let folder = Folder::new(name);
    let scene = folder.file("room.iv", SCENE);
    let truth = folder.file("true.dat", TRUTH);
    let start = folder.file("start.dat", DISTURBED);
    let [png, jpeg] = ["true.png", "old.jpg"].map(|n| folder.path(n));
    let common = "--size 96x64 --aperture f/8 --focus 2 --quiet";
    let render = format!(
        "render {scene} --camera {truth} --lens {true_lens} --efl {efl}mm -o {png} --samples 32 {common}"
    );
    assert_eq!(ivcam(&render, &[]), 0);
    archive(&png, &jpeg);
    let mut plan = common::pinhole_plan(&folder, "room.iv");
    plan.camera = Some(CameraChoice::File(start.into()));
    plan.resolution = Resolution::new(96, 64).unwrap();
    plan.focus = Some(meters(2.0));
    plan.stop.samples = 4;
    let mut session = Session::open(plan).unwrap();
    with_focal_length(&mut session, Mm(1.05 * efl)).unwrap();
    let usual = LensChoice {
        f_number: Some(8.0),
        ..LensChoice::named("any")
    };
    let question = LensQuestion {
        target: &Plate::open(&jpeg).unwrap(),
        usual: &usual,
        names,
        mask: None,
    };
    let ranking = LensRanking::of(&mut session, &question, &mut |_, _| ()).unwrap();
    let mut report = Vec::new();
    ranking.report(&mut report).unwrap();
    let report = String::from_utf8(report).unwrap();
    eprintln!("{report}");
    (ranking, report)
}

#[test]
#[ignore = "a measurement of minutes, listed in docs/performance.md"]
fn the_fish_eye_of_a_picture_is_found_among_lenses_that_bend_less() {
    let names = ["biogon", "cooke-triplet", "nikkor-16", "wide-angle"];
    let (ranking, report) = ranked("fit-fish-eye", "nikkor-16", 24.0, &names);
    assert_eq!(ranking.as_good(), ["nikkor-16"]);
    assert!(
        report.contains("distinguishes nikkor-16 from the other 2"),
        "{report}"
    );
    assert!(
        report.contains("not judged cooke-triplet: they leave corners"),
        "{report}"
    );
}

#[test]
#[ignore = "a measurement of minutes, listed in docs/performance.md"]
fn two_lenses_that_bend_alike_are_said_to_be_as_good() {
    let names = ["double-gauss", "nikkor-16", "tessar"];
    let (ranking, report) = ranked("fit-alike", "double-gauss", 60.0, &names);
    assert!(ranking.as_good().contains(&"double-gauss"), "{report}");
    assert!(ranking.as_good().contains(&"tessar"), "{report}");
}
