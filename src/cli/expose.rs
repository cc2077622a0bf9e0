//! `ivcam expose`: adds several exposures, as on one film.

use std::io::Write;
use std::path::Path;

use clap::{Arg, ArgAction, ArgMatches, Command};
use indexmap::IndexMap;
use ivcam_base::diag::{Diagnostic, Result};
use ivcam_optics::film::Response;
use ivcam_optics::picture::{Depth, Picture, Raster};

use super::outputs::{is_standard_stream, picture_format, save_picture};
use super::{exit_code, parsed, switch, text, value};

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
}

/// Runs the command and returns the exit code.
pub(crate) fn run(matches: &ArgMatches, out: &mut dyn Write) -> Result<i32> {
    let names: Vec<&String> = matches.get_many("pictures").into_iter().flatten().collect();
    let weights = weights(matches, names.len())?;
    let output = Path::new(text(matches, "output").unwrap_or_default());
    picture_format(output)?;
    let mut film: Option<Picture> = None;
    for (name, weight) in names.iter().zip(&weights) {
        let raster = Raster::open(Path::new(name))?;
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
    film.provenance.insert(
        "Software".into(),
        concat!("ivcam ", env!("CARGO_PKG_VERSION")).into(),
    );
    film.provenance
        .insert("ivcam:exposures".into(), list.join("; "));
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

    fn run_words(words: &[&str]) -> Result<i32> {
        let matches = command().no_binary_name(true).get_matches_from(words);
        run(&matches, &mut Vec::new())
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
