//! Tests of `--exposure auto`, and of the messages about a picture that is badly exposed.

use std::path::PathBuf;

use ivcam_base::diag::Sink;
use ivcam_base::math::{Meters, mm};
use ivcam_optics::film::{Metering, Resolution};
use ivcam_render::render::Stop;
use ivcam_render::shade::Shading;

use crate::photo::options::GivenOptions;
use crate::photo::{Era, LensChoice, Optics, Plan, Session};

/// A wall that fills the view, whose left half has the color .25 and its right half .1, unlit.
const WALL: &str = "PerspectiveCamera { position 0 0 .3 focalDistance .3 }\n\
    LightModel { model BASE_COLOR }\n\
    Separator { Material { diffuseColor .25 .2 .1 } Translation { translation -10 0 -.5 } \
    Cube { width 20 height 90 depth 1 } }\n\
    Separator { Material { diffuseColor .1 .1 .1 } Translation { translation 10 0 -.5 } \
    Cube { width 20 height 90 depth 1 } }\n";

fn plan(name: &str, body: &str) -> Plan {
    let folder = std::env::temp_dir().join(format!("ivcam-metering-{}", std::process::id()));
    std::fs::create_dir_all(&folder).expect("a folder for the scene");
    let scene: PathBuf = folder.join(format!("{name}.iv"));
    std::fs::write(&scene, format!("#Inventor V2.1 ascii\n{body}")).expect("the scene is written");
    let mut plan = Plan::of_era(Era::Modern, scene);
    plan.resolution = Resolution::of(36, 24);
    plan.stop = Stop::after(16);
    plan
}

fn session(plan: Plan) -> Session {
    Session::open(plan).expect("the scene is whole")
}

/// The picture's own brightest tenth tells what the meter should have found: near the lens it gets
/// less light than the radiance of the wall says.
#[test]
fn the_metered_exposure_gives_the_brightest_tenth_of_the_film_80_percent_of_white() {
    let macro_lens = Optics::Lens(LensChoice {
        efl: Some(mm(50.0)),
        ..LensChoice::named("double-gauss")
    });
    let mut factors = Vec::new();
    for (optics, metering) in [
        (Optics::Pinhole, None),
        (macro_lens.clone(), None),
        (macro_lens, Some(Metering::new(1.0 / 30.0))),
    ] {
        let mut plan = plan("wall", WALL);
        plan.shading = Shading::Flat;
        plan.focus = Some(Meters(0.3));
        (plan.optics, plan.metering, plan.meters) = (optics, metering, true);
        let session = session(plan);
        let picture = session.develop(&session.expose(&|_| ()), "");
        let mut levels: Vec<f32> = picture.pixels.iter().map(|p| p[0]).collect();
        levels.sort_by(f32::total_cmp);
        let bright = levels[levels.len() * 9 / 10];
        // The factor has two digits, so it is within 5%.
        assert!((bright / 0.8 - 1.0).abs() < 0.06, "{bright}");
        factors.push(session.stated_exposure());
    }
    assert_eq!(factors[0], 3.2);
    assert!(factors[1] > 1.2 * factors[0], "{factors:?}");
    assert!(factors[2] != factors[1], "{factors:?}");
}

#[test]
fn the_metered_factor_can_be_typed_and_is_in_the_recorded_command() {
    let mut metered = plan("wall", WALL);
    metered.meters = true;
    let mut typed = metered.clone();
    let metered = session(metered);
    (typed.meters, typed.exposure) = (false, metered.stated_exposure());
    let typed = session(typed);
    let [a, b] = [&metered, &typed].map(|session| {
        let exposure = session.expose(&|_| ());
        session.develop(
            &exposure,
            "ivcam render a.iv --exposure auto --exposure=auto",
        )
    });
    assert_eq!(a.pixels, b.pixels);
    let factor = metered.stated_exposure();
    let command = format!("ivcam render a.iv --exposure {factor} --exposure={factor}");
    assert_eq!(a.provenance["Command"], command);
    assert_eq!(a.provenance["ivcam:exposure"], factor.to_string());
    assert_eq!(
        metered.report(&metered.expose(&|_| ())).plan["exposure"],
        factor.to_string()
    );
}

#[test]
fn a_meter_that_sees_no_light_says_so() {
    let mut plan = plan(
        "away",
        "PerspectiveCamera { position 0 0 9 orientation 0 1 0 3 } Cube { }",
    );
    plan.meters = true;
    let session = session(plan);
    assert_eq!(session.stated_exposure(), 1.0);
    assert!(
        session
            .sink
            .items()
            .iter()
            .any(|d| d.message.contains("meters no light"))
    );
}

fn error_of(option: &'static str, word: &str) -> String {
    let mut words = GivenOptions::default();
    words.add(option, vec![word.into()]);
    let start = |era| Plan::of_era(era, "a.iv");
    let error = Plan::from_options(&words, Era::Modern, start, &mut Sink::new()).unwrap_err();
    format!("{error:?}")
}

#[test]
fn wrong_values_of_photographers_say_what_there_is() {
    assert!(error_of("exposure", "bright").contains("auto"));
    assert!(error_of("focus", "telephone").contains("ivcam view"));
    assert!(error_of("response", "bw").contains("`mono`"));
    let all = error_of("response", "kodak");
    for name in ivcam_optics::film::Response::names() {
        assert!(all.contains(name), "{name} is not in: {all}");
    }
}

#[test]
fn a_response_for_light_warns_with_a_model_of_display_colors() {
    let warnings = |shading: Shading, response: &str| {
        let (mut words, mut sink) = (GivenOptions::default(), Sink::new());
        words.add("shading", vec![shading.letter().to_string().into()]);
        words.add("response", vec![response.into()]);
        let start = |era| Plan::of_era(era, "a.iv");
        Plan::from_options(&words, Era::Modern, start, &mut sink).unwrap();
        sink.items()
            .iter()
            .filter(|d| d.message.contains("pale"))
            .count()
    };
    assert_eq!(warnings(Shading::Recursive, "filmic"), 1);
    assert_eq!(warnings(Shading::Phong, "mono,filmic"), 1);
    for (shading, response) in [
        (Shading::Path, "filmic"),
        (Shading::Path, "mono"),
        (Shading::Recursive, "linear"),
        (Shading::Recursive, "mono"),
    ] {
        assert_eq!(warnings(shading, response), 0, "{shading:?} {response}");
    }
}

/// A room is some hundred times darker than the sun's white that shutter and ISO assume.
#[test]
fn a_room_that_is_exposed_for_the_sun_is_told_of_the_luminance_of_white() {
    let help = |shutter: f64| {
        let mut plan = plan("wall", WALL);
        plan.shading = Shading::Flat;
        plan.optics = Optics::Lens(LensChoice::named("double-gauss"));
        plan.metering = Some(Metering::new(shutter));
        let session = session(plan);
        let exposure = session.expose(&|_| ());
        let picture = session.develop(&exposure, "");
        let warning = session.warn_if_black_or_clipped(&exposure.counts, &picture);
        warning
            .expect("the picture is clipped")
            .help
            .unwrap_or_default()
    };
    assert!(
        help(1.0 / 4.0).contains("`--white 100`"),
        "{}",
        help(1.0 / 4.0)
    );
    // Here it would be too bright still.
    assert!(!help(60.0).contains("--white"), "{}", help(60.0));
}

#[test]
fn luminous_shapes_in_a_dark_picture_are_told_of_the_model_in_which_they_shine() {
    let room = |intensity: f64| {
        format!(
            "PerspectiveCamera {{ position 0 0 4 }} PointLight {{ location 0 0 3 intensity {intensity} }}\n\
             Separator {{ Translation {{ translation 0 0 -3 }} Cube {{ width 20 height 20 }} }}\n\
             Material {{ emissiveColor 1 1 1 }} Sphere {{ radius .2 }}\n"
        )
    };
    let notice = |body: &str, shading| {
        let mut plan = plan("glow", body);
        plan.optics = Optics::Pinhole;
        plan.shading = shading;
        let session = session(plan);
        session.glow_notice(&session.develop(&session.expose(&|_| ()), ""))
    };
    let dark = notice(&room(0.05), Shading::Recursive);
    assert!(dark.is_some_and(|line| line.contains("--shading path")));
    assert_eq!(notice(&room(1.0), Shading::Recursive), None);
    assert_eq!(notice(&room(0.05), Shading::Path), None);
    let unlit = room(0.05).replace("emissiveColor", "diffuseColor");
    assert_eq!(notice(&unlit, Shading::Recursive), None);
}
