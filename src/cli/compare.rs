//! `ivcam compare`: compares a new picture with an old one.

use std::ffi::OsString;
use std::io::Write;
use std::path::Path;

use clap::{Arg, ArgAction, ArgMatches, Command};
use ivcam_base::diag::Result;
use ivcam_base::files::write_whole;
use ivcam_optics::film::Response;
use ivcam_optics::picture::{Depth, Picture};
use serde::Serialize;

use super::compare_options::{
    Compared, check_outputs, limits, matching, pixels_per_degree, registration, selection,
};
use super::{
    compare_folder, exit_code, fit, flags, print_diagnostic, render, render_folder, switch, text,
    value,
};
use crate::compare::{
    self, Alignment, Comparison, ExceededLimit, FittedCamera, Options, Plate, Registration,
    difference,
};
use crate::photo::options::command_line;

/// The exit code if a limit is exceeded.
const DIFFERENT: i32 = 1;

/// Returns the definition of the command.
pub(crate) fn command() -> Command {
    let picture = |name: &'static str, value: &'static str, help: &'static str| {
        Arg::new(name).value_name(value).required(true).help(help)
    };
    Command::new("compare")
        .about(
            "Compares a new picture with an old one, or two folders of pictures: MSE, PSNR, SSIM, FLIP, edges",
        )
        .arg(picture(
            "new",
            "NEW",
            "new picture, on whose pixels the measures are computed; or a folder of pictures or scenes",
        ))
        .arg(picture(
            "old",
            "OLD",
            "archival picture: png, jpeg, tiff, gif, bmp, pnm, tga, sgi, exr or hdr; or a folder of them",
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
            "compares only these pixels of the new picture, or fits only them",
        ))
        .arg(value(
            "mask",
            "FILE",
            "compares or fits only where this picture is white; it must have the new one's size",
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
        .arg(value(
            "difference",
            "FILE",
            "writes the new picture minus the old one: numbers to .exr, levels around gray to .png",
        ))
        .arg(switch("json", "prints JSON"))
        .args(of_folders())
        .arg(value(
            "fit",
            "FILE.dat",
            "NEW is a scene: finds the camera of OLD, starting from the flags, and writes it; \
             with --lens any, the lens too, among the shipped ones",
        ))
        .arg(switch(
            "fit-aperture",
            "with --fit: finds the f-number too, from what is out of focus",
        ))
        .args(flags::photograph())
        .mut_arg("output", |arg| {
            arg.value_name("OUT").help(
                "folder of the report of two folders, which gets index.html, report.json and report.csv; \
                 with --fit, the picture of the found camera",
            )
        })
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

/// Returns the arguments for two folders.
fn of_folders() -> [Arg; 4] {
    [
        value(
            "pair",
            "FILE.csv",
            "two folders: states pairs in columns new and old, with paths below the folders",
        ),
        switch(
            "by-name",
            "two folders: pairs pictures by their names only, and not by what they show",
        ),
        value(
            "sort",
            "METRIC",
            "two folders: the measure whose worst values are first on the page [ssim]",
        ),
        render_folder::remake().help("two folders: compares and renders what is up to date too"),
    ]
}

/// Runs the command and returns the exit code. `words` are the arguments in today's spelling.
///
/// # Errors
/// Returns an error if an option is invalid or has no effect, if a file cannot be read or written,
/// or if the pictures cannot be compared.
pub(crate) fn run(matches: &ArgMatches, words: &[OsString], out: &mut dyn Write) -> Result<i32> {
    let compared = Compared::of(matches)?;
    compared.check(matches)?;
    match compared {
        Compared::Folders | Compared::Scenes => compare_folder::run(matches, out),
        Compared::Pictures | Compared::Fit => compare_pictures(matches, &command_line(words), out),
    }
}

/// Compares two pictures, of which the new one may be the rendering at a fitted camera.
fn compare_pictures(matches: &ArgMatches, command: &str, out: &mut dyn Write) -> Result<i32> {
    let limits = limits(matches)?;
    check_outputs(matches)?;
    render::set_arithmetic(matches)?;
    let mut said = Vec::new();
    let threads = render::threads(matches)?;
    let (comparison, camera) = render::on_threads(threads, || comparison(matches, &mut said))??;
    exit_code(out.write_all(&said))?;
    write_files(matches, &comparison, command)?;
    let exceeded = compare::exceeded(&limits, |metric| (metric.get)(&comparison.measures));
    let result = if matches.get_flag("json") {
        let answer = CompareAnswer {
            comparison: &comparison,
            camera: camera.as_ref(),
            limits_exceeded: &exceeded,
        };
        write_json(&answer, out)
    } else {
        write_text(&comparison, &exceeded, out)
    };
    let code = if exceeded.is_empty() { 0 } else { DIFFERENT };
    exit_code(result).map(|_| code)
}

/// Reads the two pictures, or fits the camera of the old one, and compares them. Returns the
/// camera too if it was fitted. `said` gets the lines about the camera.
fn comparison(
    matches: &ArgMatches,
    said: &mut Vec<u8>,
) -> Result<(Comparison, Option<FittedCamera>)> {
    let name = |which: &str| text(matches, which).unwrap_or_default();
    let selection = selection(matches)?;
    let old = Plate::open(name("old"))?;
    let fitted = text(matches, "fit").map(Path::new);
    let is_json = matches.get_flag("json");
    let mut fit = |file| match is_json {
        true => fit::run(matches, (&old, &selection), file, &mut std::io::stderr()),
        false => fit::run(matches, (&old, &selection), file, said),
    };
    let (new, camera) = match fitted.map(&mut fit).transpose()? {
        Some(found) => (found.rendering, Some(found.camera)),
        None => (Plate::open(name("new"))?, None),
    };
    let options = Options {
        registration: match fitted {
            Some(_) => Registration::Resize,
            None => registration(matches).unwrap_or(Registration::None),
        },
        matching: matching(matches),
        mask: selection.of((new.width, new.height), name("new"))?,
        pixels_per_degree: pixels_per_degree(matches)?,
    };
    let comparison = compare::compare(&new, &old, &options)?;
    if let Some(warning) = Plate::mixed([(&new, name("new")), (&old, name("old"))]) {
        print_diagnostic(&warning);
    }
    Ok((comparison, camera))
}

/// Writes the pictures that were asked for.
fn write_files(matches: &ArgMatches, comparison: &Comparison, command: &str) -> Result<()> {
    let name = |which: &str| text(matches, which).unwrap_or_default();
    if let Some(path) = text(matches, "sheet") {
        let sheet = compare::sheet::ComparisonSheet::draw(comparison, name("new"), name("old"));
        let bytes = sheet.encode(Path::new(path))?;
        write_whole(Path::new(path), |file| file.write_all(&bytes))?;
    }
    if let Some(path) = text(matches, "difference") {
        difference::write(comparison, command, Path::new(path))?;
    }
    let Some(path) = text(matches, "output") else {
        return Ok(());
    };
    let (width, height) = (comparison.width, comparison.height);
    let picture = Picture {
        width: width as u32,
        height: height as u32,
        pixels: (0..width * height)
            .map(|i| comparison.new.color(i))
            .collect(),
        // The plate has levels, to which the plan's response is applied already.
        response: Response::Linear,
        provenance: difference::provenance(command),
    };
    picture.save(
        path,
        match text(matches, "depth") {
            Some("16") => Depth::Sixteen,
            _ => Depth::Eight,
        },
    )
}

fn write_text(
    comparison: &Comparison,
    exceeded: &[ExceededLimit],
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
    if comparison.not_finite > 0 {
        let number = comparison.not_finite;
        writeln!(out, "left out   {number} that are infinite or not a number")?;
    }
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
    if let Some(p) = a.photograph {
        writeln!(
            out,
            "border     left out; the photograph is {}x{} pixels of the old picture, from {},{}",
            p.width, p.height, p.left, p.top
        )?;
    }
    for other in &a.alternatives {
        writeln!(
            out,
            "or         it agrees as well with scale {:.3}, rotation {:+.1} degrees{}; the place that \
             changes it least was taken",
            other.scale,
            other.rotation,
            if other.mirrored { ", mirrored" } else { "" }
        )?;
    }
    writeln!(
        out,
        "agreement  {:.3}; unrelated pictures agree as well with a probability of at most {}",
        a.agreement,
        compare::probability(a.chance)
    )
}

/// What `--json` prints.
#[derive(Serialize)]
struct CompareAnswer<'a> {
    #[serde(flatten)]
    comparison: &'a Comparison,
    #[serde(skip_serializing_if = "Option::is_none")]
    camera: Option<&'a FittedCamera>,
    limits_exceeded: &'a [ExceededLimit],
}

fn write_json(answer: &CompareAnswer<'_>, out: &mut dyn Write) -> std::io::Result<()> {
    serde_json::to_writer_pretty(&mut *out, answer)?;
    writeln!(out)
}
