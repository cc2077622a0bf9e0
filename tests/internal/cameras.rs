//! Every camera with every option about lens and film: none is ignored without a word.

use ivcam_base::diag::Sink;
use ivcam_optics::film::{Resolution, Response};
use ivcam_render::render::Stop;

use super::common::Folder;
use crate::photo::options::GivenOptions;
use crate::photo::{Era, Plan, Session};

/// A ball before a cube, lit by a lamp.
const SCENE: &str = "#Inventor V2.1 ascii
PerspectiveCamera { position 0 1 4 heightAngle .6 focalDistance 4 }
PointLight { location 1 2 3 }
Separator { Translation { translation 0 .5 0 } Material { diffuseColor .8 .3 .2 } Sphere { radius .5 } }
Separator { Translation { translation .9 1.4 -2 } Cube { width .6 height .6 depth .6 } }
";

fn plan(folder: &Folder) -> Plan {
    let scene = folder.path("scene.iv");
    std::fs::write(&scene, SCENE).unwrap();
    let mut plan = Plan::of_era(Era::Modern, scene);
    plan.resolution = Resolution::new(24, 16).unwrap();
    plan
}

/// Options about the lens or the film, with a value other than the default.
const OPTIONS_OF_CAMERAS: [(&str, &str); 21] = [
    ("zoom", "0.7"),
    ("efl", "40mm"),
    ("aperture", "f/11"),
    ("focus", "1"),
    ("focus-method", "best"),
    ("blades", "5"),
    ("coating", "none"),
    ("ghosts", "on"),
    ("dispersion", "off"),
    ("diffraction", "on"),
    ("pupil", "rear"),
    ("film", "30x24"),
    ("tilt", "5"),
    ("swing", "5"),
    ("rise", "3mm"),
    ("shift", "3mm"),
    ("film-radius", "-120"),
    ("exposure", "2"),
    ("shutter", "1/60"),
    ("iso", "400"),
    ("response", "srgb"),
];

/// The exposures of a picture, and the film that makes levels of them.
type Levels = (Vec<[f32; 3]>, Response);

/// The picture of some options, or the message of a refusal, and the warnings.
fn picture_of(
    folder: &Folder,
    words: &[(&'static str, &'static str)],
) -> (Result<Levels, String>, String) {
    let mut given = GivenOptions::default();
    for (name, value) in words.iter().filter(|(name, _)| *name != "solids") {
        given.add(name, vec![value.into()]);
    }
    if words.iter().any(|(name, _)| *name == "solids") {
        given.add("solids", Vec::new());
    }
    let mut sink = Sink::new();
    let plan = Plan::from_options(&given, Era::Modern, |_| plan(folder), &mut sink);
    let text = |sink: &Sink| -> String {
        let all = sink
            .items()
            .iter()
            .map(|d| format!("{} {:?}; ", d.message, d.help));
        all.collect()
    };
    let session = plan.and_then(|mut plan| {
        plan.stop = Stop::after(8);
        Session::open(plan)
    });
    match session {
        Err(error) => (Err(error.message.clone()), text(&sink)),
        Ok(session) => {
            let exposure = session.expose(&|_| ());
            let picture = session.develop(&exposure, "");
            let warned = format!("{}{}", text(&sink), text(&session.sink));
            (Ok((picture.pixels, picture.response)), warned)
        }
    }
}

/// With each camera, every option changes the picture, is refused, or has a warning that names it.
#[test]
fn no_camera_ignores_an_option_in_silence() {
    let folder = Folder::new("cameras");
    let cameras: [&[(&'static str, &'static str)]; 4] = [
        &[("lens", "flektogon")],
        &[("lens", "ideal")],
        &[("lens", "none")],
        &[("lens", "flektogon"), ("solids", "")],
    ];
    let mut silent = Vec::new();
    for camera in cameras {
        let (usual, _) = picture_of(&folder, camera);
        let usual = usual.expect("the camera works");
        for option in OPTIONS_OF_CAMERAS {
            let words: Vec<_> = camera.iter().copied().chain([option]).collect();
            let (picture, warnings) = picture_of(&folder, &words);
            // Only the lens in the camera has dispersion to turn off, and the film of a pinhole is
            // but the unit of the focal length in a fit.
            let is_idle = match option.0 {
                "dispersion" => camera != cameras[0],
                "film" => camera == cameras[2],
                _ => false,
            };
            let is_answered = match picture {
                Ok(levels) => levels != usual || warnings.contains(option.0) || is_idle,
                Err(_) => true,
            };
            if !is_answered {
                silent.push(format!("{camera:?} --{} {}", option.0, option.1));
            }
        }
    }
    assert!(silent.is_empty(), "{silent:#?}");
}
