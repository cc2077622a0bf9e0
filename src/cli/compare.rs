//! `ivcam compare`: compares a new picture with an old one.

use std::io::Write;
use std::path::Path;

use clap::{Arg, ArgAction, ArgMatches, Command};
use ivcam_base::diag::{Diagnostic, Result, nearest};
use ivcam_base::files::write_whole;
use ivcam_optics::picture::Raster;
use serde::Serialize;

use super::{exit_code, fit, flags, parsed, switch, text, value};
use crate::compare::{
    self, Alignment, Comparison, METRICS, Mask, Matching, Metric, Options, Plate, Registration,
};

/// The exit code if a limit is exceeded.
const DIFFERENT: i32 = 1;

/// Returns the definition of the command.
pub(crate) fn command() -> Command {
    let picture = |name: &'static str, value: &'static str, help: &'static str| {
        Arg::new(name).value_name(value).required(true).help(help)
    };
    Command::new("compare")
        .about("Compares a new picture with an old one: MSE, PSNR, SSIM, FLIP, edges")
        .arg(picture(
            "new",
            "NEW",
            "new picture, on whose pixels the measures are computed",
        ))
        .arg(picture(
            "old",
            "OLD",
            "archival picture: png, jpeg, tiff, gif, bmp, pnm, tga, sgi, exr or hdr",
        ))
        .arg(switch(
            "align",
            "finds shift, scale, rotation and mirroring of the old picture, and how likely its agreement is by chance",
        ))
        .arg(
            switch("resize", "stretches the old picture to the new one's size")
                .conflicts_with("align"),
        )
        .arg(value(
            "crop",
            "X,Y,W,H",
            "compares only these pixels of the new picture",
        ))
        .arg(value(
            "mask",
            "FILE",
            "compares only where this picture is white; it must have the new one's size",
        ))
        .arg(
            value(
                "match",
                "WHAT",
                "fits gain, offset and gamma: one curve for the picture, one per channel, or none",
            )
            .value_parser(["picture", "channel", "none"])
            .default_value("picture"),
        )
        .arg(value(
            "ppd",
            "N",
            "pixels per degree of view, for FLIP [67.02]",
        ))
        .arg(value(
            "sheet",
            "FILE",
            "writes new, old and difference side by side: .png, .jpg, .tiff or .bmp",
        ))
        .arg(switch("json", "prints JSON"))
        .arg(value(
            "fit",
            "FILE.dat",
            "NEW is a scene: finds the camera of OLD, starting from the flags, and writes it",
        ))
        .args(flags::photograph())
        .arg(Arg::new("scene").long("scene").hide(true))
        .arg(
            value(
                "limit",
                "METRIC=VALUE",
                "exits with 1 if the measure is worse; may be repeated",
            )
            .action(ArgAction::Append),
        )
}

/// Runs the command and returns the exit code.
pub(crate) fn run(matches: &ArgMatches, out: &mut dyn Write) -> Result<i32> {
    let name = |which: &str| text(matches, which).unwrap_or_default();
    let limits = limits(matches)?;
    if let Some(sheet) = text(matches, "sheet") {
        compare::sheet::format_of(Path::new(sheet))?;
    }
    let ppd = |w: &str| w.parse().ok().filter(|p: &f64| (1.0..=1000.0).contains(p));
    let open = |path: &str| Raster::open(Path::new(path)).map(|r| Plate::from_raster(&r));
    let old = open(name("old"))?;
    let fitted = text(matches, "fit").map(Path::new);
    let new = match fitted {
        Some(file) if matches.get_flag("json") => {
            fit::run(matches, &old, file, &mut std::io::stderr())?
        }
        Some(file) => fit::run(matches, &old, file, out)?,
        None => open(name("new"))?,
    };
    let options = Options {
        registration: if fitted.is_some() {
            Registration::Resize
        } else if matches.get_flag("align") {
            Registration::Align
        } else if matches.get_flag("resize") {
            Registration::Resize
        } else {
            Registration::None
        },
        matching: match text(matches, "match") {
            Some("none") => Matching::None,
            Some("channel") => Matching::Channel,
            _ => Matching::Picture,
        },
        mask: mask(matches, &new)?,
        pixels_per_degree: parsed(matches, "ppd", "a number from 1 to 1000", ppd)?
            .unwrap_or(compare::flip::PIXELS_PER_DEGREE),
    };
    let comparison = compare::compare(&new, &old, &options)?;
    if let Some(path) = text(matches, "sheet") {
        let sheet = compare::sheet::ComparisonSheet::draw(&comparison, name("new"), name("old"));
        let bytes = sheet.encode(Path::new(path))?;
        write_whole(Path::new(path), |file| file.write_all(&bytes))?;
    }
    let exceeded: Vec<Exceeded> = limits
        .iter()
        .filter(|(metric, limit)| !metric.holds(&comparison.measures, *limit))
        .map(|&(metric, limit)| Exceeded {
            metric: metric.name,
            limit,
            value: (metric.get)(&comparison.measures),
        })
        .collect();
    let result = if matches.get_flag("json") {
        write_json(&comparison, &exceeded, out)
    } else {
        write_text(&comparison, &exceeded, out)
    };
    let code = if exceeded.is_empty() { 0 } else { DIFFERENT };
    exit_code(result).map(|_| code)
}

/// A limit that is exceeded.
#[derive(Serialize)]
struct Exceeded {
    metric: &'static str,
    limit: f64,
    value: f64,
}

fn limits(matches: &ArgMatches) -> Result<Vec<(&'static Metric, f64)>> {
    let words = matches.get_many::<String>("limit").unwrap_or_default();
    words.map(|word| limit(word)).collect()
}

fn limit(word: &str) -> Result<(&'static Metric, f64)> {
    let names = || METRICS.map(|m| m.name);
    let (name, value) = word.split_once('=').unwrap_or((word, ""));
    let Some(metric) = Metric::named(name) else {
        let help = nearest(name, names()).map_or_else(
            || format!("there is {}", names().join(", ")),
            |near| format!("did you mean `{near}`?"),
        );
        return Err(
            Diagnostic::error(format!("`--limit {word}`: there is no measure `{name}`"))
                .with_help(help),
        );
    };
    match value.parse() {
        Ok(value) if !f64::is_nan(value) => Ok((metric, value)),
        _ => Err(
            Diagnostic::error(format!("the value of `--limit {word}` is not a number"))
                .with_help(format!("write it as `--limit {name}=0.01`")),
        ),
    }
}

/// Returns the pixels that `--crop` and `--mask` select.
fn mask(matches: &ArgMatches, new: &Plate) -> Result<Option<Mask>> {
    let (width, height) = (new.width, new.height);
    let mut mask = None;
    if let Some(path) = text(matches, "mask") {
        let raster = Raster::open(Path::new(path))?;
        let white = |i: usize| raster.color(i).iter().sum::<f32>() > 1.5 && raster.alpha(i) > 0.5;
        mask = Some(Mask {
            width: raster.width as usize,
            height: raster.height as usize,
            counts: (0..raster.pixels()).map(white).collect(),
        });
    }
    let crop = parsed(matches, "crop", "four integers x,y,w,h", |word| {
        let numbers: Option<Vec<usize>> = word.split(',').map(|n| n.trim().parse().ok()).collect();
        <[usize; 4]>::try_from(numbers?).ok()
    })?;
    if let Some([left, top, w, h]) = crop {
        let fits = |from: usize, size: usize, all: usize| {
            size > 0 && from.checked_add(size).is_some_and(|end| end <= all)
        };
        if !fits(left, w, width) || !fits(top, h, height) {
            return Err(Diagnostic::error(format!(
                "`--crop {left},{top},{w},{h}` is not inside the new picture"
            ))
            .with_help(format!(
                "{} is {width}x{height}",
                text(matches, "new").unwrap_or("it")
            )));
        }
        let inside = |i: usize| {
            (left..left + w).contains(&(i % width)) && (top..top + h).contains(&(i / width))
        };
        let crop = Mask {
            width,
            height,
            counts: (0..width * height).map(inside).collect(),
        };
        mask = Some(match mask {
            Some(m) if (m.width, m.height) == (width, height) => m.and(&crop),
            Some(m) => m, // The mask has the wrong size, which `compare` reports.
            None => crop,
        });
    }
    Ok(mask)
}

fn write_text(
    comparison: &Comparison,
    exceeded: &[Exceeded],
    out: &mut dyn Write,
) -> std::io::Result<()> {
    let m = &comparison.measures;
    if let Some(a) = &comparison.alignment {
        write_alignment(a, out)?;
    }
    let [r, g, b] = comparison.tones;
    let same = r == g && g == b;
    let names = if same {
        ["tones", "", ""]
    } else {
        ["red", "green", "blue"]
    };
    for (name, tone) in names.iter().zip([r, g, b]).filter(|(n, _)| !n.is_empty()) {
        writeln!(
            out,
            "{name:<10} gain {:.4}, offset {:+.4}, gamma {:.4} of the old picture",
            tone.gain, tone.offset, tone.gamma
        )?;
    }
    writeln!(
        out,
        "pixels     {} of {}x{}",
        comparison.pixels, comparison.width, comparison.height
    )?;
    writeln!(
        out,
        "MSE        {:.6}   before matching {:.6}",
        m.mse, m.unmatched_mse
    )?;
    writeln!(
        out,
        "PSNR       {:.2} dB   before matching {:.2} dB",
        m.psnr, m.unmatched_psnr
    )?;
    writeln!(out, "SSIM       {:.4}", m.ssim)?;
    writeln!(out, "FLIP       {:.4}", m.flip)?;
    match m.edges {
        Some(e) => writeln!(
            out,
            "edges      {:.3} px apart in the mean, 95% within {:.2} px, {:.1}% matched",
            e.mean,
            e.p95,
            100.0 * e.matched
        )?,
        None => writeln!(out, "edges      one of the pictures has none")?,
    }
    for p in exceeded {
        writeln!(
            out,
            "limit      {} is {}, the limit is {}",
            p.metric, p.value, p.limit
        )?;
    }
    Ok(())
}

/// Writes where the old picture lies, each value with its standard error.
fn write_alignment(a: &Alignment, out: &mut dyn Write) -> std::io::Result<()> {
    writeln!(
        out,
        "aligned    shift {:+.3} {:+.3} px (± {:.3}), scale {:.5} (± {:.5}), rotation {:+.4} degrees (± {:.4})",
        a.shift[0], a.shift[1], a.shift_error, a.scale, a.scale_error, a.rotation, a.rotation_error
    )?;
    if a.mirrored {
        writeln!(
            out,
            "mirrored   the old picture is reversed left to right, as a slide scanned from its back; \
             it is compared unmirrored"
        )?;
    }
    writeln!(
        out,
        "agreement  {:.3}; unrelated pictures agree as well with a probability of at most {}",
        a.agreement,
        compare::probability(a.chance)
    )
}

fn write_json(
    comparison: &Comparison,
    exceeded: &[Exceeded],
    out: &mut dyn Write,
) -> std::io::Result<()> {
    #[derive(Serialize)]
    struct CompareAnswer<'a> {
        #[serde(flatten)]
        comparison: &'a Comparison,
        limits_exceeded: &'a [Exceeded],
    }
    let answer = CompareAnswer {
        comparison,
        limits_exceeded: exceeded,
    };
    serde_json::to_writer_pretty(&mut *out, &answer)?;
    writeln!(out)
}
