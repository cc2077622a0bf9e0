//! Options of light and shading.

use ivcam_render::scene::TextureFilter;
use ivcam_render::shade::Shading;

use super::option::{Opt, OptionNeeds, Takes};
use super::values::{if_any, set, unless_default};
use crate::photo::headlight::Headlight;

pub(super) static OPTIONS: [Opt; 5] = [
    Opt::new(
        "shading",
        Takes::One("flat|normal|ambient|diffuse|phong|gl|recursive|path"),
        "how surfaces look: gl as OpenGL draws them, path with indirect light; or their letters: f, n, a, d, p, g, r and i [r]",
    )
    .vintage("s")
    .plan(
        |plan, words, _| {
            let model = words.parsed("shading", &models(), Shading::named)?;
            set(&mut plan.shading, model);
            Ok(())
        },
        |plan, _| vec![plan.shading.letter().to_string()],
    )
    .describe(|plan| Some(plan.shading.name().to_owned()))
    .examples(&["-s f", "-s n", "--shading ambient", "-s d", "-s p", "-s gl", "-s r", "-s i"]),
    Opt::new(
        "headlight",
        Takes::Maybe("on|off|viewer", "flip"),
        "toggles the headlight on the camera, or sets it; viewer: on unless NavigationInfo says no [1999: off; now: on if the scene has no light, and in VRML97]",
    )
    .vintage("headlight")
    .needs(OptionNeeds::Lights)
    .plan(
        |plan, words, _| {
            let choice = words.parsed("headlight", "on, off or viewer", headlight)?;
            set(&mut plan.headlight, choice);
            Ok(())
        },
        |plan, _| match plan.headlight {
            Headlight::Automatic | Headlight::Environment => Vec::new(),
            Headlight::Viewer => vec!["viewer".into()],
            Headlight::Flipped => vec![String::new()],
            Headlight::Set(true) => vec!["on".into()],
            Headlight::Set(false) => vec!["off".into()],
        },
    )
    .examples(&["--headlight", "--headlight=on", "--headlight=off", "--headlight=viewer"]),
    Opt::new(
        "mirrors",
        Takes::One("off|all|SHARE"),
        "surfaces that model r draws as mirrors: those that reflect at least this share of the light, specular times shininess [1999: all, now: off]",
    )
    .needs(OptionNeeds::Reflections)
    .plan(
        |plan, words, _| {
            let expected = "off, all or a number from 0 to 1, such as 0.3";
            set(&mut plan.mirrors, words.parsed("mirrors", expected, mirrors)?);
            Ok(())
        },
        |plan, usual| {
            unless_default(plan.mirrors, usual.mirrors, |least| match least {
                None => "off".into(),
                Some(0.0) => "all".into(),
                Some(least) => least.to_string(),
            })
        },
    )
    .examples(&["--mirrors off", "--mirrors all", "--mirrors 0.3"]),
    Opt::new(
        "texture-filter",
        Takes::One("nearest|linear|smooth"),
        "how all textures are filtered: the nearest texel, interpolation, or interpolation between smaller versions too [by textureQuality; a PixelTexture of at most 8x8 texels: nearest]",
    )
    .needs(OptionNeeds::Textures)
    .plan(
        |plan, words, _| {
            let named = |word: &str| {
                let mut filters = TextureFilter::NAMED.into_iter();
                filters.find(|(name, _)| *name == word).map(|(_, filter)| filter)
            };
            let expected = "nearest, linear or smooth";
            plan.texture_filter = words.parsed("texture-filter", expected, named)?;
            Ok(())
        },
        |plan, _| {
            let filters = TextureFilter::NAMED.into_iter();
            let own = filters.filter(|(_, filter)| plan.texture_filter == Some(*filter));
            own.map(|(name, _)| name.to_owned()).collect()
        },
    )
    .examples(&["--texture-filter nearest", "--texture-filter smooth"]),
    Opt::new(
        "max-depth",
        Takes::One("N"),
        "largest number of successive reflections and refractions [5; with --solids: 64]; for --shading path, of surfaces that scatter light on its way [no limit]",
    )
    .needs(OptionNeeds::Reflections)
    .plan(
        |plan, words, _| {
            let depth = |w: &str| w.parse().ok().filter(|n| *n <= 10_000);
            plan.max_depth = words.parsed("max-depth", "a number from 0 to 10000", depth)?;
            Ok(())
        },
        |plan, _| if_any(plan.max_depth, |n| n.to_string()),
    )
    .examples(&["--max-depth 0", "--max-depth 12"]),
];

/// Returns the description of the values of `--shading` for messages.
fn models() -> String {
    let names = Shading::ALL.map(|model| format!("{} ({})", model.letter(), model.name()));
    match names.split_last() {
        Some((last, rest)) => format!("a shading model: {} or {last}", rest.join(", ")),
        None => "a shading model".into(),
    }
}

/// Parses the value of `--mirrors`.
fn mirrors(word: &str) -> Option<Option<f32>> {
    match word {
        "off" => Some(None),
        "all" => Some(Some(0.0)),
        _ => word
            .parse()
            .ok()
            .filter(|x| (0.0..=1.0).contains(x))
            .map(Some),
    }
}

fn headlight(word: &str) -> Option<Headlight> {
    match word {
        "flip" => Some(Headlight::Flipped),
        "viewer" => Some(Headlight::Viewer),
        "on" => Some(Headlight::Set(true)),
        "off" => Some(Headlight::Set(false)),
        _ => None,
    }
}
