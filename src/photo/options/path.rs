//! Options of model `i`.

use ivcam_base::diag::Diagnostic;
use ivcam_base::math::Meters;
use ivcam_render::scene::ColorCoding;
use ivcam_render::shade::{ClearSky, Shading};

use super::option::{Opt, OptionNeeds, Takes};
use super::values::{
    POSITIVE, angle, degrees, distance, distance_word, finite, if_any, positive, set, switch,
    unless_default,
};
use crate::photo::light_plan::{Backdrop, GRAY_PAPER, Surroundings, WHITE_PAPER};
use crate::photo::view::{color_word, parse_color};

pub(super) static OPTIONS: [Opt; 10] = [
    Opt::new(
        "colors",
        Takes::One("display|linear"),
        "for --shading path: the file's colors are levels of a display, decoded by sRGB, or amounts of light, as those of glTF and PhysicalMaterial are in any case; with display the response is srgb unless given [display]",
    )
    .needs(OptionNeeds::Path)
    .plan(
        |plan, words, _| {
            let names = [("display", ColorCoding::Display), ("linear", ColorCoding::Linear)];
            set(&mut plan.light.colors, words.named("colors", &names)?);
            Ok(())
        },
        |plan, usual| {
            unless_default(plan.light.colors, usual.light.colors, |colors| {
                match colors {
                    ColorCoding::Linear => "linear",
                    _ => "display",
                }
                .into()
            })
        },
    )
    .examples(&["-s i --colors linear", "--shading path --colors display"]),
    Opt::new(
        "emission",
        Takes::One("SCALE"),
        "for --shading path: multiplies emissive colors, which light the scene; 0 turns them off [1]",
    )
    .needs(OptionNeeds::Path)
    .plan(
        |plan, words, _| {
            let scale = |word: &str| finite(word).filter(|x| (0.0..=1e9).contains(x));
            let scale = words.parsed("emission", "a number from 0 to 1e9", scale)?;
            set(&mut plan.light.emission, scale.map(|x| x as f32));
            Ok(())
        },
        |plan, usual| unless_default(plan.light.emission, usual.light.emission, |x| x.to_string()),
    )
    .examples(&["-s i --emission 20", "-s i --emission 0"]),
    Opt::new(
        "light-size",
        Takes::One("LENGTH"),
        "for --shading path: the diameter of point and spot lights, such as 5cm; a bare number is meters; their shadows are soft [0]",
    )
    .needs(OptionNeeds::Path)
    .plan(
        |plan, words, _| {
            let size = |word: &str| match word {
                "0" => Some(Meters(0.0)),
                _ => distance(word),
            };
            set(
                &mut plan.light.light_size,
                words.parsed("light-size", "a length, such as 5cm or 0.05", size)?,
            );
            Ok(())
        },
        |plan, usual| {
            unless_default(plan.light.light_size, usual.light.light_size, distance_word)
        },
    )
    .examples(&["-s i --light-size 5cm", "-s i --light-size 0.2"]),
    Opt::new(
        "sun-size",
        Takes::One("DEGREES"),
        "for --shading path: the angle across directional lights; the sun's is 0.53 [0]",
    )
    .needs(OptionNeeds::Path)
    .plan(
        |plan, words, _| {
            let size = |word: &str| angle(word).filter(|a| *a >= 0.0);
            let size = words.parsed("sun-size", "an angle in degrees from 0 to below 90", size)?;
            set(&mut plan.light.sun_size, size);
            Ok(())
        },
        |plan, usual| {
            unless_default(plan.light.sun_size, usual.light.sun_size, |a| {
                degrees(a).to_string()
            })
        },
    )
    .examples(&["-s i --sun-size .53deg", "-s i --sun-size 5"]),
    Opt::new(
        "environment-light",
        Takes::One("FILE|background"),
        "for --shading path: light from an equirectangular picture (EXR, HDR, PNG), its middle toward -z, or from the scene's Background [the file's ambient light]",
    )
    .needs(OptionNeeds::Path)
    .plan(
        |plan, words, _| {
            let light = |word: &str| match word {
                "background" => Some(Surroundings::Background),
                _ => Some(Surroundings::Picture(word.into())),
            };
            plan.light.surroundings = words.parsed("environment-light", "a file", light)?;
            Ok(())
        },
        |plan, _| {
            match &plan.light.surroundings {
                Some(Surroundings::Background) => vec!["background".into()],
                Some(Surroundings::Picture(path)) => vec![path.display().to_string()],
                Some(Surroundings::Sky(_)) | None => Vec::new(),
            }
        },
    )
    .examples(&["-s i --environment-light sky.exr", "-s i --environment-light background"]),
    Opt::new(
        "sky",
        Takes::One("ELEVATION[,AZIMUTH]"),
        "for --shading path: a clear sky, with the sun at these angles in degrees above the horizon and from -z toward +x [the file's ambient light; azimuth 45]",
    )
    .needs(OptionNeeds::Path)
    .plan(
        |plan, words, _| {
            let expects = "an angle from 1 to 90 and one from -360 to 360, such as 30,45";
            if let Some(sky) = words.parsed("sky", expects, clear_sky)? {
                if plan.light.surroundings.is_some() {
                    let message = "`--environment-light` and `--sky` both surround the scene with light";
                    return Err(Diagnostic::error(message).with_help("leave one out"));
                }
                plan.light.surroundings = Some(Surroundings::Sky(sky));
            }
            Ok(())
        },
        |plan, _| match &plan.light.surroundings {
            Some(Surroundings::Sky(sky)) => {
                vec![format!("{},{}", degrees(sky.elevation), degrees(sky.azimuth))]
            }
            _ => Vec::new(),
        },
    )
    .examples(&["-s i --sky 30", "-s i --sky 12.5,-100"]),
    Opt::new(
        "clamp",
        Takes::One("RADIANCE"),
        "for --shading path: limits the indirect light of each path, which hides bright specks and darkens the picture [no limit]",
    )
    .needs(OptionNeeds::Path)
    .plan(
        |plan, words, _| {
            let limit = words.parsed("clamp", POSITIVE, positive)?;
            plan.light.clamp = limit.map(|x| x as f32);
            Ok(())
        },
        |plan, _| if_any(plan.light.clamp, |x| x.to_string()),
    )
    .describe(|plan| plan.light.clamp.map(|x| format!("{x} (the picture is biased)")))
    .examples(&["-s i --clamp 10", "-s i --clamp 0.5"]),
    Opt::new(
        "studio",
        Takes::Nothing,
        "puts the scene on white paper under soft lamps, seen from three quarters, with enough depth of field and a metered exposure, by --shading path; what the scene or another option states is kept",
    )
    .plan(
        |plan, words, sink| {
            if words.has("studio") {
                plan.set_studio(true);
                if !words.has("shading") {
                    plan.shading = Shading::Path;
                }
                if plan.shading != Shading::Path {
                    let model = plan.shading.name();
                    let text = format!(
                        "with model {model}, `--studio` has no light and meters no exposure"
                    );
                    let help = "leave `--shading` out: a studio is lit by model path";
                    sink.add(*Diagnostic::warning(text).with_help(help));
                }
            }
            Ok(())
        },
        |plan, _| switch(plan.light.studio),
    )
    .examples(&["--studio"]),
    Opt::new(
        "ground",
        Takes::Nothing,
        "adds a flat ground below the scene, if there is no backdrop [no ground]",
    )
    .plan(
        |plan, words, _| {
            plan.light.ground = words.has("ground");
            Ok(())
        },
        |plan, _| switch(plan.light.ground),
    )
    .examples(&["-s i --ground"]),
    Opt::new(
        "backdrop",
        Takes::One("white|gray|COLOR|none"),
        "adds paper below the scene that rises behind it: white reflects 75%, gray 18% of the light [none; white with --studio]",
    )
    .plan(
        |plan, words, _| {
            let paper = |word: &str| match word {
                "none" => Some(Backdrop::None),
                "white" => Some(Backdrop::Color(WHITE_PAPER)),
                "gray" => Some(Backdrop::Color(GRAY_PAPER)),
                _ => parse_color(word).map(Backdrop::Color),
            };
            let expects = "white, gray, none or a color, such as #8090a0";
            plan.light.backdrop = words.parsed("backdrop", expects, paper)?;
            Ok(())
        },
        |plan, _| {
            if_any(plan.light.backdrop, |paper| match paper {
                Backdrop::None => "none".into(),
                Backdrop::Color(color) if color == WHITE_PAPER => "white".into(),
                Backdrop::Color(color) if color == GRAY_PAPER => "gray".into(),
                Backdrop::Color(color) => color_word(color),
            })
        },
    )
    .examples(&["-s i --backdrop gray", "--studio --backdrop none", "--studio --backdrop #203040"]),
];

/// Parses the place of the sun.
fn clear_sky(word: &str) -> Option<ClearSky> {
    let (elevation, azimuth) = word.split_once(',').unwrap_or((word, "45"));
    let elevation = finite(elevation.trim()).filter(|e| (1.0..=90.0).contains(e))?;
    let azimuth = finite(azimuth.trim()).filter(|a| a.abs() <= 360.0)?;
    Some(ClearSky {
        elevation: elevation.to_radians(),
        azimuth: azimuth.to_radians(),
        turbidity: 3.0,
    })
}
