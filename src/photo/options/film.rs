//! Options of the film: its size, its position, and its exposure.

use ivcam_base::diag::{Diagnostic, Result, Sink};
use ivcam_base::math::Mm;
use ivcam_optics::film::{FilmFormat, Metering, Region, Resolution, Response, WhiteBalance};
use ivcam_optics::picture::Depth;
use ivcam_render::shade::Shading;

use super::given::GivenOptions;
use super::option::{Opt, OptionNeeds, Takes};
use super::shutter::{metering, shutter_word};
use super::values::{angle, degrees, finite, if_any, length, pair, positive, set, unless_default};
use crate::photo::plan::{Optics, Plan};

const ANGLE: &str = "an angle in degrees, less than 90, such as 8 or -5";
const LENGTH: &str = "a length in millimeters, such as 8 or -5mm";

pub(super) static OPTIONS: [Opt; 16] = [
    Opt::new(
        "film",
        Takes::One("WxH"),
        "film size in millimeters [36x24]",
    )
    .needs(OptionNeeds::Lens)
    .plan(
        |plan, words, _| {
            let size = words.parsed("film", "a film size in millimeters, such as 36x24, which is film of 35 mm", film_size)?;
            set(&mut plan.film, size);
            Ok(())
        },
        |plan, usual| {
            unless_default(plan.film, usual.film, |f| {
                format!("{}x{}", f.width, f.height)
            })
        },
    )
    .describe(|plan| {
        let FilmFormat { width, height } = plan.film;
        (plan.optics != Optics::Pinhole).then(|| format!("{width}x{height} mm"))
    })
    .examples(&["--film 24x36", "--film 10.26x7.49mm"]),
    Opt::new(
        "fov",
        Takes::One("DEGREES"),
        "scales the lens to this angle of view across the film, of a lens without distortion",
    )
    .needs(OptionNeeds::Lens)
    .plan(field_of_view, |_, _| Vec::new()) // The entry of `--efl` writes it.
    .examples(&["--fov 60", "--film 6x6 --fov 40deg", "--lens ideal --fov 90"]),
    Opt::new(
        "size",
        Takes::One("WxH"),
        "picture size in pixels [360x240]",
    )
    .aliases(&["resolution"])
    .plan(
        |plan, words, _| {
            if let Some((width, height)) =
                words.parsed("size", "a size such as 360x240", pair::<u32>)?
            {
                plan.resolution = Resolution::new(width, height)?;
            }
            Ok(())
        },
        |plan, usual| unless_default(plan.resolution, usual.resolution, pixels),
    )
    .describe(|plan| Some(pixels(plan.resolution)))
    .examples(&["--size 96x64", "--size 1x1"]),
    Opt::new(
        "region",
        Takes::One("X,Y,W,H"),
        "renders and writes only these pixels of the picture, with the same bits",
    )
    .plan(
        |plan, words, _| {
            let expects = "four numbers of pixels, left,top,width,height";
            plan.region = words.parsed("region", expects, region)?;
            Ok(())
        },
        |plan, _| if_any(plan.region, |region| region.to_string()),
    )
    .describe(|plan| plan.region.map(|region| region.to_string()))
    .examples(&["--region 0,0,1,1", "--size 720x480 --region 300,200,90,60"]),
    Opt::new(
        "tilt",
        Takes::One("DEGREES"),
        "tilts the lens forward against the film: the sharp plane lies down [0]",
    )
    .needs(OptionNeeds::Lens)
    .plan(
        |plan, words, _| {
            set(&mut plan.movements.tilt, words.parsed("tilt", ANGLE, angle)?);
            Ok(())
        },
        |plan, _| unless_default(degrees(plan.movements.tilt), 0.0, |d| d.to_string()),
    )
    .examples(&["--tilt 8", "--tilt -5.25"]),
    Opt::new(
        "swing",
        Takes::One("DEGREES"),
        "swings the lens to the right against the film [0]",
    )
    .needs(OptionNeeds::Lens)
    .plan(
        |plan, words, _| {
            let swing = words.parsed("swing", ANGLE, angle)?;
            set(&mut plan.movements.swing, swing);
            Ok(())
        },
        |plan, _| unless_default(degrees(plan.movements.swing), 0.0, |d| d.to_string()),
    )
    .examples(&["--swing 13", "--swing -0.5"]),
    Opt::new(
        "rise",
        Takes::One("LENGTH"),
        "raises the lens against the film, such as 8mm; falls if negative [0]",
    )
    .needs(OptionNeeds::Lens)
    .plan(
        |plan, words, _| {
            let rise = words.parsed("rise", LENGTH, length)?;
            set(&mut plan.movements.rise, rise);
            Ok(())
        },
        |plan, _| unless_default(plan.movements.rise, 0.0, |mm| mm.to_string()),
    )
    .examples(&["--rise 8mm", "--rise -3.7"]),
    Opt::new(
        "shift",
        Takes::One("LENGTH"),
        "shifts the lens to the right against the film, such as 8mm [0]",
    )
    .needs(OptionNeeds::Lens)
    .plan(
        |plan, words, _| {
            let shift = words.parsed("shift", LENGTH, length)?;
            set(&mut plan.movements.shift, shift);
            Ok(())
        },
        |plan, _| unless_default(plan.movements.shift, 0.0, |mm| mm.to_string()),
    )
    .examples(&["--shift 1cm", "--shift -2.1"]),
    Opt::new(
        "film-radius",
        Takes::One("LENGTH"),
        "film bent to a sphere; less than 0 is hollow toward the lens [flat]",
    )
    .needs(OptionNeeds::Lens)
    .plan(
        |plan, words, _| {
            let radius = |word: &str| match word {
                "flat" => Some(None),
                _ => length(word).filter(|r| *r != 0.0).map(Some),
            };
            let expects = "a length in millimeters other than 0, or flat";
            let radius = words.parsed("film-radius", expects, radius)?;
            set(&mut plan.movements.film_radius, radius);
            Ok(())
        },
        |plan, _| if_any(plan.movements.film_radius, |mm| mm.to_string()),
    )
    .examples(&["--film-radius -150", "--film-radius flat", "--film-radius 1m"]),
    Opt::new(
        "exposure",
        Takes::One("FACTOR|auto"),
        "a factor; 1 renders white on the axis as white; auto: metered [1]",
    )
    .plan(
        |plan, words, _| {
            if words.text("exposure") == Some("auto") {
                plan.meters = true;
                return Ok(());
            }
            // Beyond these, exposures overflow single precision.
            let factor = |word: &str| positive(word).filter(|x| (1e-30..=1e30).contains(x));
            let expects = "a factor from 1e-30 to 1e30, or auto, which meters it; a stop more is 2, a stop less 0.5";
            set(&mut plan.exposure, words.parsed("exposure", expects, factor)?);
            Ok(())
        },
        |plan, usual| match plan.meters {
            true => vec!["auto".into()],
            false => unless_default(plan.exposure, usual.exposure, |x| x.to_string()),
        },
    )
    .describe(|plan| {
        Some(match plan.meters {
            true => "auto".into(),
            false => plan.exposure.to_string(),
        })
    })
    .examples(&["--exposure 2", "--exposure 0.3333333333333333", "--exposure auto"]),
    Opt::new(
        "shutter",
        Takes::One("TIME"),
        "meters by the lens's light instead: open for 1/60, 0.5s …; for a movie also a part of a frame, 0.5 or 180deg, for motion blur",
    )
    .plan(
        |plan, words, _| {
            plan.metering = metering(words)?;
            Ok(())
        },
        |plan, _| if_any(plan.metering, |metering| shutter_word(metering.shutter)),
    )
    .examples(&[
        "--shutter 1/60",
        "--shutter 0.5s",
        "--shutter 2s",
        "--shutter 16.7ms",
        "--shutter 3/70",
    ]),
    Opt::new(
        "iso",
        Takes::One("N"),
        "speed of the film, with --shutter [100]",
    )
    .plan(
        |_, _, _| Ok(()), // The entry of `--shutter` reads it.
        |plan, _| {
            let metering = plan.metering.filter(|m| m.iso != Metering::new(1.0).iso);
            if_any(metering, |metering| metering.iso.to_string())
        },
    )
    .examples(&["--shutter 1/60 --iso 400", "--iso 12.5 --shutter 1s"]),
    Opt::new(
        "white",
        Takes::One("CD/M2"),
        "luminance of Inventor's white, with --shutter [25424: sunny 16]",
    )
    .plan(
        |_, _, _| Ok(()), // The entry of `--shutter` reads it.
        |plan, _| {
            let metering = plan.metering.filter(|m| m.white != Metering::SUNLIT_WHITE);
            if_any(metering, |metering| metering.white.to_string())
        },
    )
    .examples(&["--shutter 1/60 --white 200", "--shutter 2s --white 25424"]),
    Opt::new(
        "response",
        Takes::One("FILM"),
        "how exposure becomes levels: linear, srgb, filmic, reversal, negative,paper, mono for black and white, alone or as in mono,filmic, or files of density curves [linear; srgb for --shading path]",
    )
    .plan(
        response,
        |plan, _| {
            let response = plan.response.unbalanced();
            unless_default(response, &plan.usual_response(), |response| response.name())
        },
    )
    .describe(|plan| Some(plan.response.name()))
    .examples(&[
        "--response linear",
        "--response srgb",
        "--response filmic",
        "--response reversal",
        "--response negative,paper",
        "--response mono",
        "--response mono,filmic",
        "--response films/negative.txt",
    ]),
    Opt::new(
        "white-balance",
        Takes::One("KELVIN"),
        "shows light of this color temperature as white, such as 3200K for lamps [as it is]",
    )
    .plan(
        |plan, words, _| {
            let kelvin = |word: &str| word.trim_end_matches('K').parse().ok();
            let balance = |word: &str| kelvin(word).and_then(WhiteBalance::of_kelvin);
            let expects = "a color temperature from 2500 to 25000 K, such as 3200K for lamps or 5500K for daylight";
            if let Some(balance) = words.parsed("white-balance", expects, balance)? {
                plan.response = plan.response.balanced(Some(balance));
            }
            Ok(())
        },
        |plan, _| if_any(plan.response.balance(), |balance| format!("{}K", balance.kelvin())),
    )
    .examples(&["--white-balance 3200K", "--white-balance 5500"]),
    Opt::new(
        "depth",
        Takes::One("8|16"),
        "bits per channel in PNG, PPM, TIFF and SGI files [8]",
    )
    .plan(
        |plan, words, _| {
            let depths = [("8", Depth::Eight), ("16", Depth::Sixteen)];
            set(&mut plan.depth, words.named("depth", &depths)?);
            Ok(())
        },
        |plan, usual| {
            unless_default(plan.depth, usual.depth, |depth| {
                if depth == Depth::Eight { "8" } else { "16" }.into()
            })
        },
    )
    .examples(&["--depth 8", "--depth 16"]),
];

/// Sets the focal length with which a lens without distortion sees an angle across the film.
fn field_of_view(plan: &mut Plan, words: &GivenOptions, _: &mut Sink) -> Result<()> {
    let angle = |word: &str| finite(word.trim_end_matches("deg"));
    let angle = |word: &str| angle(word).filter(|a| 0.1 <= *a && *a < 170.0);
    let expects = "an angle in degrees from 0.1 to less than 170, such as 60";
    let Some(angle) = words.parsed("fov", expects, angle)? else {
        return Ok(());
    };
    if let Some(other) = ["efl", "zoom"].into_iter().find(|name| words.has(name)) {
        let message = format!("`--fov` and `--{other}` both set the focal length");
        return Err(Diagnostic::error(message).with_help("leave one out"));
    }
    let efl = Mm(0.5 * plan.film.width / libm::tan(0.5 * angle.to_radians()));
    match &mut plan.optics {
        Optics::Lens(lens) => lens.efl = Some(efl),
        Optics::Ideal(ideal) => ideal.efl = efl,
        Optics::Pinhole => {}
    }
    Ok(())
}

/// Sets the response, and warns if it is one for light and the model's colors are levels already.
fn response(plan: &mut Plan, words: &GivenOptions, sink: &mut Sink) -> Result<()> {
    let usual = plan.usual_response();
    plan.response = match words.text("response") {
        None => usual,
        Some("mono") => Response::Mono(usual.into()),
        Some(films) => Response::open(films)?,
    };
    let of_levels = [Response::Linear, Response::Mono(Response::Linear.into())];
    if plan.shading != Shading::Path && !of_levels.contains(&plan.response) {
        let (name, model) = (plan.response.name(), plan.shading.letter());
        let message = format!(
            "`--response {name}` is for light, and the colors of model `{model}` are levels of a \
             display: the picture is pale"
        );
        let help = "add `--shading path`, which computes light, or leave `--response` out";
        sink.add(*Diagnostic::warning(message).with_help(help));
    }
    Ok(())
}

fn film_size(word: &str) -> Option<FilmFormat> {
    let (width, height) = pair::<f64>(word.trim_end_matches("mm"))?;
    let fits = |x: f64| x > 0.0 && x.is_finite();
    (fits(width) && fits(height)).then_some(FilmFormat { width, height })
}

fn region(word: &str) -> Option<Region> {
    let numbers: Option<Vec<u32>> = word.split(',').map(|n| n.trim().parse().ok()).collect();
    let [left, top, width, height] = numbers?.try_into().ok()?;
    Some(Region::new([left, top], [width, height]))
}

fn pixels(size: Resolution) -> String {
    format!("{}x{}", size.width, size.height)
}
