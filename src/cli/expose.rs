//! `ivcam expose`: adds several exposures, as on one film.

use std::io::Write;
use std::path::Path;

use clap::{Arg, ArgAction, ArgMatches, Command};
use indexmap::IndexMap;
use ivcam_base::diag::{Diagnostic, Result};
use ivcam_base::files::{MAX_PICTURE, read_file};
use ivcam_optics::film::Response;
use ivcam_optics::picture::{Depth, Picture, PictureFormat, Raster, exr_text};

use super::outputs::{is_standard_stream, picture_format, save_picture};
use super::{exit_code, parsed, switch, text, value};
use crate::compare::difference::provenance;
use crate::photo::UNFINISHED;

/// Returns the definition of the command.
pub(crate) fn command() -> Command {
    Command::new("expose")
        .about("Adds exposures, like a multiple exposure on film")
        .arg(
            Arg::new("pictures")
                .value_name("PICTURE")
                .required(true)
                .action(ArgAction::Append)
                .num_args(1..)
                .help("exposures of one size, .exr; levels of other formats are taken as exposure"),
        )
        .arg(
            value("output", "FILE", "picture to write: .exr, .png, .tif, .jpg, .rgb, .sgi or .ppm; - for standard output as PNG").short('o').required(true),
        )
        .arg(switch(
            "average",
            "divides by the number of exposures, for the parts of one exposure",
        ))
        .arg(
            Arg::new("weights")
                .long("weights")
                .value_name("A,B,…")
                .conflicts_with("average")
                .help("multiplies each exposure [1 each]"),
        )
        .arg(value(
            "response",
            "FILM",
            "how exposure becomes levels, as for `render`, with a white balance as in 3200K,srgb [what the exposures state, or linear]",
        ))
}

/// Runs the command and returns the exit code.
pub(crate) fn run(matches: &ArgMatches, command: &str, out: &mut dyn Write) -> Result<i32> {
    let names: Vec<&String> = matches.get_many("pictures").into_iter().flatten().collect();
    let weights = weights(matches, names.len())?;
    let output = Path::new(text(matches, "output").unwrap_or_default());
    let format = picture_format(output)?;
    let mut film: Option<Picture> = None;
    let (mut stated, mut kept) = (Vec::new(), Vec::new());
    for (name, weight) in names.iter().zip(&weights) {
        let bytes = read_file(Path::new(name), MAX_PICTURE)?;
        let raster = Raster::decode(&bytes, name)?;
        stated.extend(exr_text(&bytes, "ivcam:response").map(|response| (*name, response)));
        for key in kept_entries(names.len()) {
            kept.extend(exr_text(&bytes, key).map(|text| (*key, *name, text)));
        }
        let film = film.get_or_insert_with(|| blank(&raster));
        add(film, &raster, *weight).map_err(|e| {
            e.in_file(name.as_str())
                .with_help(format!("`{}` is {}x{}", names[0], film.width, film.height))
        })?;
    }
    let Some(mut film) = film else {
        return Err(Diagnostic::error("there is nothing to expose"));
    };
    let list: Vec<String> = names
        .iter()
        .zip(&weights)
        .map(|(n, w)| format!("{w} {n}"))
        .collect();
    film.provenance = provenance(command);
    film.provenance
        .insert("ivcam:exposures".into(), list.join("; "));
    for (key, name, text) in kept {
        let text = match names.len() {
            1 => text,
            _ => format!("{name}: {text}"),
        };
        let entry: &mut String = film.provenance.entry(key.into()).or_default();
        let separator = if entry.is_empty() { "" } else { "; " };
        *entry += &format!("{separator}{text}");
    }
    if let Some(words) = response(text(matches, "response"), &stated, format)? {
        film.response = Response::open(words).map_err(|e| e.with_help(CHOOSE))?;
        film.provenance
            .insert("ivcam:response".into(), words.into());
    }
    save_picture(&film, output, Depth::Eight)?;
    if is_standard_stream(output) {
        return Ok(0);
    }
    exit_code(writeln!(
        out,
        "{} exposures on {}",
        names.len(),
        output.display()
    ))
}

/// Returns the entries of exposures that hold for their sum: of a single one its samples and its
/// relative error, and of any that it is unfinished.
fn kept_entries(exposures: usize) -> &'static [&'static str] {
    match exposures {
        1 => &[UNFINISHED, "ivcam:samples", "ivcam:error"],
        _ => &[UNFINISHED],
    }
}

/// The help for a response that the exposures do not decide.
const CHOOSE: &str = "choose one with `--response`, such as `--response srgb`";

/// Returns the response that is given, or else the one that the exposures state. An EXR has
/// exposures, so those of different responses may be added in it.
fn response<'s>(
    given: Option<&'s str>,
    stated: &'s [(&String, String)],
    format: PictureFormat,
) -> Result<Option<&'s str>> {
    let (Some((first, response)), None) = (stated.first(), given) else {
        return Ok(given);
    };
    match stated.iter().find(|(_, other)| other != response) {
        None => Ok(Some(response)),
        Some(_) if format == PictureFormat::Exr => Ok(None),
        Some((name, other)) => {
            let error = format!(
                "`{first}` was exposed for the response `{response}`, and `{name}` for `{other}`"
            );
            Err(Diagnostic::error(error).with_help(CHOOSE))
        }
    }
}

/// Returns the weight of each exposure.
fn weights(matches: &ArgMatches, count: usize) -> Result<Vec<f32>> {
    if matches.get_flag("average") {
        return Ok(vec![1.0 / count as f32; count]);
    }
    let list = parsed(matches, "weights", "numbers with commas between", |word| {
        let numbers = word.split(',').map(|n| n.trim().parse::<f32>().ok());
        numbers
            .map(|n| n.filter(|n| n.is_finite()))
            .collect::<Option<Vec<f32>>>()
    })?;
    match list {
        None => Ok(vec![1.0; count]),
        Some(list) if list.iter().all(|w| *w == 0.0) => {
            Err(Diagnostic::error("with weights of 0 nothing is exposed"))
        }
        Some(list) if list.len() == count => Ok(list),
        Some(list) => Err(Diagnostic::error(format!(
            "`--weights` has {} numbers for {count} pictures",
            list.len()
        ))),
    }
}

fn blank(first: &Raster) -> Picture {
    Picture {
        width: first.width,
        height: first.height,
        pixels: vec![[0.0; 3]; first.pixels()],
        response: Response::Linear,
        provenance: IndexMap::new(),
    }
}

fn add(film: &mut Picture, raster: &Raster, weight: f32) -> Result<()> {
    if (raster.width, raster.height) != (film.width, film.height) {
        return Err(Diagnostic::error(format!(
            "a picture of {}x{} does not fit on the film",
            raster.width, raster.height
        )));
    }
    for (i, pixel) in film.pixels.iter_mut().enumerate() {
        for (sum, value) in pixel.iter_mut().zip(raster.color(i)) {
            *sum += weight * value;
        }
    }
    Ok(())
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::folder::Folder;

    /// Writes exposures of two pixels, each of which states a response.
    fn write_pair(path: impl Fn(&str) -> String, responses: [&str; 2]) {
        for ((name, value), response) in [("a.exr", 0.75), ("b.exr", 0.5)].iter().zip(responses) {
            let mut picture = blank(&Raster {
                width: 2,
                height: 1,
                channels: 1,
                samples: ivcam_optics::picture::Samples::U8(vec![0, 0]),
            });
            picture.pixels.fill([*value, 0.0, 1.0]);
            picture
                .provenance
                .insert("ivcam:response".into(), response.into());
            picture.save(Path::new(&path(name)), Depth::Eight).unwrap();
        }
    }

    #[test]
    fn levels_are_those_of_the_response_that_the_exposures_state() {
        let folder = Folder::new("expose-response");
        let path = |name: &str| folder.path(name);
        write_pair(path, ["3200K,srgb"; 2]);
        let (a, b, out) = (path("a.exr"), path("b.exr"), path("out.png"));
        let red = || Raster::open(Path::new(&out)).unwrap().color(0)[0];
        let level = |words: &str| {
            let level = Response::open(words).unwrap().levels([0.625, 0.0, 1.0])[0];
            (255.0 * level).round() as f32 / 255.0
        };
        run_words(&[&a, &b, "--average", "-o", &out]).unwrap();
        assert_eq!(red(), level("3200K,srgb"));
        run_words(&[&a, &b, "--average", "-o", &out, "--response", "linear"]).unwrap();
        assert_eq!(red(), level("linear"));
        // A sum states the response again.
        let sum = path("sum.exr");
        run_words(&[&a, &b, "--average", "-o", &sum]).unwrap();
        run_words(&[&sum, "-o", &out]).unwrap();
        assert_eq!(red(), level("3200K,srgb"));
        write_pair(path, ["filmic", "srgb"]);
        let error = run_words(&[&a, &b, "-o", &out]).unwrap_err();
        assert!(error.message.contains("`filmic`"), "{error}");
        run_words(&[&a, &b, "-o", &sum]).unwrap();
    }

    fn run_words(words: &[&str]) -> Result<i32> {
        let matches = command().no_binary_name(true).get_matches_from(words);
        run(&matches, "ivcam expose", &mut Vec::new())
    }

    #[test]
    fn a_copy_of_an_unfinished_exposure_is_unfinished() {
        let folder = Folder::new("expose-unfinished");
        let path = |name: &str| folder.path(name);
        write_pair(path, ["srgb"; 2]);
        let (a, b, out) = (path("a.exr"), path("b.exr"), path("out.exr"));
        let mut picture = blank(&Raster::open(Path::new(&a)).unwrap());
        for (key, text) in [(UNFINISHED, "half"), ("ivcam:samples", "3")] {
            picture.provenance.insert(key.into(), text.into());
        }
        picture.save(Path::new(&a), Depth::Eight).unwrap();
        let stated = |key: &str| exr_text(&std::fs::read(&out).unwrap(), key);
        run_words(&[&a, "-o", &out]).unwrap();
        assert_eq!(stated(UNFINISHED).as_deref(), Some("half"));
        assert_eq!(stated("ivcam:samples").as_deref(), Some("3"));
        run_words(&[&b, &a, "-o", &out]).unwrap();
        assert_eq!(stated(UNFINISHED), Some(format!("{a}: half")));
        assert_eq!(stated("ivcam:samples"), None);
    }

    #[test]
    fn exposures_add_beyond_white_and_average_back() {
        let folder = std::env::temp_dir().join(format!("ivcam-expose-{}", std::process::id()));
        std::fs::create_dir_all(&folder).unwrap();
        let path = |name: &str| folder.join(name).display().to_string();
        for (name, value) in [("a.exr", 0.75), ("b.exr", 0.5)] {
            let mut picture = blank(&Raster {
                width: 2,
                height: 1,
                channels: 1,
                samples: ivcam_optics::picture::Samples::U8(vec![0, 0]),
            });
            picture.pixels.fill([value, 0.0, 1.0]);
            picture.save(Path::new(&path(name)), Depth::Eight).unwrap();
        }
        let (a, b, sum) = (path("a.exr"), path("b.exr"), path("sum.exr"));
        run_words(&[&a, &b, "-o", &sum]).unwrap();
        let read = || Raster::open(Path::new(&sum)).unwrap().color(1);
        assert_eq!(read(), [1.25, 0.0, 2.0]);
        run_words(&[&a, &b, "-o", &sum, "--average"]).unwrap();
        assert_eq!(read(), [0.625, 0.0, 1.0]);
        let error = run_words(&[&a, &b, "-o", &sum, "--weights", "1"]).unwrap_err();
        assert!(error.message.contains("2 pictures"));
        let error = run_words(&[&a, &b, "-o", &sum, "--weights", "0,0"]).unwrap_err();
        assert!(error.message.contains("nothing is exposed"));
        std::fs::remove_dir_all(folder).unwrap();
    }
}
