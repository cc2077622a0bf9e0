//! Options of the lens and of its focus.

use ivcam_base::diag::{Diagnostic, Result, Sink};
use ivcam_base::math::{LengthUnit, Mm, parse_length};
use ivcam_optics::lens::{Coating, FocusMethod, Gap, Iris};

use super::given::GivenOptions;
use super::option::{Opt, OptionNeeds, Takes};
use super::values::{
    POSITIVE, degrees, distance, distance_word, finite, if_any, on_off, paths, positive, set,
    switch, unless_default,
};
use crate::photo::plan::{IdealChoice, LensChoice, Optics, Plan};

/// Where a distance in focus may come from.
const DISTANCES: &str = "the README beside a scene may list distances; `ivcam view` focuses where you click, and \
    `--aov FILE.exr` writes the distance of every pixel as layer Z";

const METHODS: [FocusMethod; 4] = [
    FocusMethod::Film,
    FocusMethod::Lens,
    FocusMethod::Group,
    FocusMethod::Best,
];

pub(super) static OPTIONS: [Opt; 16] = [
    Opt::new(
        "lens",
        Takes::One("LENS"),
        "lens by name or prescription file; ideal has no faults, none is the scene's own pinhole [wide-angle]",
    )
    .needs(OptionNeeds::Camera)
    .plan(
        |plan, words, _| {
            match words.text("lens") {
                None => {}
                Some("none") => plan.optics = Optics::Pinhole,
                Some("ideal") => plan.optics = Optics::Ideal(IdealChoice::default()),
                Some(name) => {
                    plan.optics = Optics::Lens(LensChoice::of_era(plan.era, name));
                }
            }
            Ok(())
        },
        |plan, usual| {
            let name = |plan: &Plan| match &plan.optics {
                Optics::Lens(lens) => lens.name.clone(),
                Optics::Ideal(_) => "ideal".into(),
                Optics::Pinhole => "none".into(),
            };
            unless_default(name(plan), name(usual), |name| name)
        },
    )
    .examples(&["--lens double-gauss", "--lens none", "--lens ideal"]),
    Opt::new(
        "focus",
        Takes::One("DISTANCE"),
        "distance in focus, from the camera, such as 1.2, 40cm or 5'6\"; a bare number is meters [the scene camera's focalDistance]",
    )
    .vintage("f")
    .needs(OptionNeeds::Lens)
    .plan(
        |plan, words, _| {
            let expects = "a distance greater than 0, such as 1.2, 40cm or inf";
            plan.focus = words.parsed("focus", expects, distance).map_err(|e| e.with_help(DISTANCES))?;
            Ok(())
        },
        |plan, _| if_any(plan.focus, distance_word),
    )
    .examples(&["-f 1.2", "--focus 40cm", "--focus inf", "--focus 0.3333333mm"]),
    Opt::new(
        "zoom",
        Takes::One("FACTOR"),
        "scales the lens by this factor; the lenses of 1999 are about 100 mm [1]",
    )
    .vintage("z")
    .needs(OptionNeeds::Prescription)
    .plan(
        |plan, words, _| {
            if let Some(lens) = plan.lens_mut() {
                set(&mut lens.zoom, words.parsed("zoom", POSITIVE, positive)?);
            }
            Ok(())
        },
        |plan, _| {
            let lens = plan.lens();
            lens.map_or(Vec::new(), |l| unless_default(l.zoom, 1.0, |z| z.to_string()))
        },
    )
    .examples(&["-z 0.2", "--zoom 3"]),
    Opt::new(
        "efl",
        Takes::One("LENGTH"),
        "scales the lens to this focal length, such as 20mm; --zoom then scales on from there",
    )
    .aliases(&["focal-length"])
    .needs(OptionNeeds::Lens)
    .plan(focal_length, |plan, _| match &plan.optics {
        Optics::Lens(lens) => if_any(lens.efl, |efl| format!("{}mm", efl.0)),
        Optics::Ideal(ideal) => vec![format!("{}mm", ideal.efl.0)],
        Optics::Pinhole => Vec::new(),
    })
    .examples(&["--efl 20mm", "--focal-length 20mm --zoom 2", "--lens ideal --efl 3cm"]),
    Opt::new(
        "distortion",
        Takes::One("K1[,K2]"),
        "radial distortion of the pinhole, OpenCV's k1 and k2: r(1 + k1 r^2 + k2 r^4), r the tangent of the field angle [0]",
    )
    .needs(OptionNeeds::Pinhole)
    .plan(
        |plan, words, _| {
            let expects = "one or two numbers, such as -0.28 or -0.28,0.07";
            set(&mut plan.distortion, words.parsed("distortion", expects, distortion)?);
            Ok(())
        },
        |plan, _| {
            unless_default(plan.distortion, [0.0; 2], |[k1, k2]| match k2 {
                0.0 => k1.to_string(),
                _ => format!("{k1},{k2}"),
            })
        },
    )
    .examples(&["--lens none --distortion -0.28", "--lens none --distortion -0.28,0.07"]),
    Opt::new(
        "aperture",
        Takes::One("F-NUMBER"),
        "stops the lens down, such as f/8 or 8 [full aperture]",
    )
    .aliases(&["f-number", "fstop", "f-stop"])
    .needs(OptionNeeds::Lens)
    .plan(
        |plan, words, _| {
            let number = words.parsed("aperture", "an f-number such as f/8", f_number)?;
            match &mut plan.optics {
                Optics::Lens(lens) => lens.f_number = number.or(lens.f_number),
                Optics::Ideal(ideal) => set(&mut ideal.f_number, number),
                Optics::Pinhole => {}
            }
            Ok(())
        },
        |plan, _| match &plan.optics {
            Optics::Lens(lens) => if_any(lens.f_number, |n| n.to_string()),
            Optics::Ideal(ideal) => vec![ideal.f_number.to_string()],
            Optics::Pinhole => Vec::new(),
        },
    )
    .examples(&["--aperture f/8", "--f-number 5.6", "--fstop 2.8", "--lens ideal --aperture 1.2"]),
    Opt::new(
        "zoom-position",
        Takes::One("N"),
        "a tabulated position of a zoom lens, from 0",
    )
    .needs(OptionNeeds::Prescription)
    .plan(
        |plan, words, _| {
            if let Some(lens) = plan.lens_mut() {
                let expects = "a position of the zoom, from 0";
                let position = words.parsed("zoom-position", expects, |w| w.parse().ok())?;
                lens.zoom_position = position.or(lens.zoom_position);
            }
            Ok(())
        },
        |plan, _| if_any(plan.lens().and_then(|l| l.zoom_position), |n| n.to_string()),
    )
    .examples(&["--zoom-position 0", "--zoom-position 2"]),
    Opt::new(
        "blades",
        Takes::One("N[@DEGREES]"),
        "iris of 3 to 64 straight blades, turned by an angle [round]",
    )
    .needs(OptionNeeds::Prescription)
    .plan(
        |plan, words, _| {
            if let Some(lens) = plan.lens_mut() {
                let expects = "3 to 64 blades, such as 6 or 6@15";
                set(&mut lens.iris, words.parsed("blades", expects, blades)?);
            }
            Ok(())
        },
        |plan, _| match plan.lens().map(|lens| &lens.iris) {
            Some(Iris::Blades { count, rotation }) => vec![match degrees(*rotation) {
                0.0 => count.to_string(),
                turned => format!("{count}@{turned}"),
            }],
            _ => Vec::new(),
        },
    )
    .examples(&["--blades 6", "--blades 7@13", "--blades 5@-12.5deg"]),
    Opt::new(
        "focus-method",
        Takes::One("film|lens|group|best"),
        "what moves: the film (distance from the front vertex), the lens (from the film), its group; best: the film to the least spot [film]",
    )
    .aliases(&["focus-by"])
    .needs(OptionNeeds::Prescription)
    .plan(
        |plan, words, _| {
            if let Some(lens) = plan.lens_mut() {
                let methods = METHODS.map(|method| (method.name(), method));
                set(&mut lens.method, words.named("focus-method", &methods)?);
            }
            Ok(())
        },
        |plan, _| {
            let method = plan.lens().map_or(FocusMethod::Film, |lens| lens.method);
            unless_default(method, FocusMethod::Film, |method| method.name().into())
        },
    )
    .examples(&[
        "--focus-method film",
        "--focus-by lens",
        "--focus-method group",
        "--focus-method best",
    ]),
    Opt::new(
        "coating",
        Takes::One("none|mgf2|ideal"),
        "on every glass surface: none (Fresnel's loss), a quarter wave of MgF2, or ideal [the prescription's, else ideal]",
    )
    .needs(OptionNeeds::Traced)
    .plan(
        |plan, words, _| {
            if let Some(lens) = plan.lens_mut() {
                let coating = words.named("coating", &Coating::ALL)?;
                lens.coating = coating.or(lens.coating);
            }
            Ok(())
        },
        |plan, _| if_any(plan.lens().and_then(|l| l.coating), |c| c.name().into()),
    )
    .examples(&["--coating none", "--coating mgf2", "--coating ideal"]),
    Opt::new(
        "ghosts",
        Takes::One("on|off"),
        "reflections of the scene's lights inside the lens, by its coatings [off]",
    )
    .needs(OptionNeeds::Traced)
    .plan(
        |plan, words, _| {
            set(&mut plan.ghosts, words.on_or_off("ghosts")?);
            Ok(())
        },
        |plan, usual| unless_default(plan.ghosts, usual.ghosts, |on| on_off(on).into()),
    )
    .examples(&["--ghosts on", "--ghosts off"]),
    Opt::new(
        "glass-catalogue",
        Takes::Many("FILE.agf"),
        "catalogue of glasses for the prescription; may be repeated",
    )
    .needs(OptionNeeds::Prescription)
    .plan(
        |plan, words, _| {
            if let Some(lens) = plan.lens_mut() {
                lens.catalogues = words.paths("glass-catalogue");
            }
            Ok(())
        },
        |plan, _| plan.lens().map_or(Vec::new(), |lens| paths(&lens.catalogues)),
    )
    .examples(&[
        "--glass-catalogue a.agf",
        "--glass-catalogue a.agf --glass-catalogue b/c.agf",
    ]),
    Opt::new(
        "gap",
        Takes::One("next|previous|position"),
        "the second column of a table: the distance to the next vertex, from the one before, or the position [by evidence]",
    )
    .needs(OptionNeeds::Prescription)
    .plan(
        |plan, words, _| {
            if let Some(lens) = plan.lens_mut() {
                let gap = words.named("gap", &Gap::ALL)?;
                lens.gap = gap.or(lens.gap);
            }
            Ok(())
        },
        |plan, _| if_any(plan.lens().and_then(|l| l.gap), |gap| gap.name().into()),
    )
    .examples(&["--gap next", "--gap previous", "--gap position"]),
    Opt::new(
        "dispersion",
        Takes::One("on|off"),
        "whether the dispersion of glass is simulated [1999: off, now: on]",
    )
    .needs(OptionNeeds::Traced)
    .plan(
        |plan, words, _| {
            set(&mut plan.dispersion, words.on_or_off("dispersion")?);
            Ok(())
        },
        |plan, usual| unless_default(plan.dispersion, usual.dispersion, |on| on_off(on).into()),
    )
    .examples(&["--dispersion on", "--dispersion off"]),
    Opt::new(
        "diffraction",
        Takes::One("on|off"),
        "spreads the light by the diffraction of the pupil, blades and all [off]",
    )
    .needs(OptionNeeds::Traced)
    .plan(
        |plan, words, _| {
            set(&mut plan.diffraction, words.on_or_off("diffraction")?);
            Ok(())
        },
        |plan, usual| {
            unless_default(plan.diffraction, usual.diffraction, |on| on_off(on).into())
        },
    )
    .examples(&["--diffraction on", "--diffraction off"]),
    Opt::new(
        "solids",
        Takes::Nothing,
        "adds the lens to the scene as solid glass, the paper's first approach, and exposes the film behind it",
    )
    .plan(
        |plan, words, _| {
            plan.solids = words.has("solids");
            Ok(())
        },
        |plan, _| switch(plan.solids),
    )
    .examples(&["--solids"]),
];

fn focal_length(plan: &mut Plan, words: &GivenOptions, sink: &mut Sink) -> Result<()> {
    let length = |word: &str| {
        parse_length(word, LengthUnit::Millimeter).filter(|l| l.0 > 0.0 && l.0.is_finite())
    };
    let Some(efl): Option<Mm> = words.parsed("efl", "a focal length such as 20mm", length)? else {
        return Ok(());
    };
    match &mut plan.optics {
        Optics::Lens(lens) => {
            lens.efl = Some(efl);
            if words.has("zoom") {
                let whole = (efl.0 * lens.zoom * 1e3).round() / 1e3;
                sink.add(*Diagnostic::warning(format!(
                    "`--efl` and `--zoom` both scale the lens: it becomes {whole} mm"
                )));
            }
        }
        Optics::Ideal(ideal) => ideal.efl = efl,
        Optics::Pinhole => {}
    }
    Ok(())
}

/// Parses one or two coefficients of radial distortion.
fn distortion(word: &str) -> Option<[f64; 2]> {
    let (first, second) = word.split_once(',').unwrap_or((word, "0"));
    let number = |word: &str| finite(word.trim());
    Some([number(first)?, number(second)?])
}

/// Parses an f-number: `f/8`, `F8` or `8`.
fn f_number(word: &str) -> Option<f64> {
    let bare = word.trim_start_matches(['f', 'F']).trim_start_matches('/');
    positive(bare)
}

/// Parses the blades of an iris: `6` blades, or `6@15` for blades that are turned by 15 degrees.
fn blades(word: &str) -> Option<Iris> {
    let (count, turn) = word.split_once('@').unwrap_or((word, "0"));
    let count = count.parse().ok().filter(|n| (3..=64).contains(n))?;
    let rotation = finite(turn.trim_end_matches("deg"))?.to_radians();
    Some(Iris::Blades { count, rotation })
}
