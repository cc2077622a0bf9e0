//! `ivcam catalog`: makes a page with a picture of every scene below a folder.

use std::path::{Path, PathBuf};
use std::time::Duration;

use clap::{Arg, ArgAction, ArgMatches, Command, value_parser};
use ivcam_base::diag::{Diagnostic, Result};
use ivcam_base::files::{MAX_TEXT, read_file};
use ivcam_base::work::Allowance;
use ivcam_optics::film::Resolution;

use super::flags::{FONTS, LIMIT, MEMORY, WORK, given_options};
use super::folder_mode::{FileProgress, refuse_standard_output};
use super::{ERROR, parsed, print_diagnostic, print_warnings, render, switch};
use crate::catalog::{Catalog, CatalogOptions};
use crate::photo::options::all;

/// The default size of a thumbnail in pixels, the largest, and the samples of each pixel of the
/// large picture, of which nine pixels are averaged in one of the thumbnail.
const THUMBNAIL: (u32, u32) = (256, 192);
const LARGEST: u32 = 1024;
const SAMPLES: u32 = 4;
/// The samples of each pixel in a studio, whose soft lamps need more.
const STUDIO_SAMPLES: u32 = 16;
/// The time that each scene may take, unless `--time` gives another. No search is recorded: usual
/// scenes take less than a second.
const USUAL_TIME: Duration = Duration::from_secs(60);

/// Returns the definition of the command.
pub(crate) fn command() -> Command {
    let path = |name: &'static str| Arg::new(name).value_parser(value_parser!(PathBuf));
    let several = |name: &'static str| {
        path(name)
            .long(name)
            .value_name("FOLDER")
            .action(ArgAction::Append)
    };
    let output = all().filter(|option| ["denoise", "threads", "quiet"].contains(&option.name));
    Command::new("catalog")
        .about("Makes pages with pictures of every scene below a folder, and their data")
        .args_override_self(true)
        .arg(
            path("folder")
                .value_name("FOLDER")
                .required(true)
                .help("folder of scenes"),
        )
        .arg(
            path("catalog")
                .short('o')
                .long("output")
                .value_name("OUT")
                .required(true)
                .help("folder of the catalog, which gets index.html, a page and two pictures of each scene, \
                     and catalog.json, .csv and .jsonld"),
        )
        .arg(several("converted").help(
            "links to files below this folder that were converted from the scenes, as to those in OUT",
        ))
        .arg(several("search").help(
            "searches this folder too for files of a scene, and opens files below it",
        ))
        .arg(path("contain").long("contain").value_name("FOLDER").help(
            "opens files of a scene only below this folder and those of --search [the scene's project]",
        ))
        .arg(
            Arg::new("size")
                .long("size")
                .value_name("WxH")
                .help("size of the small pictures in pixels, at most 1024; the large ones are three times as \
                       wide and high [256x192]"),
        )
        .arg(
            Arg::new("title")
                .long("title")
                .value_name("TEXT")
                .help("title of the catalog [the folder's name]"),
        )
        .arg(path("about").long("about").value_name("FILE").help(
            "text about the archive for the top of the page; empty lines separate paragraphs",
        ))
        .arg(path("page").long("page").value_name("FOLDER").help(
            "copies this page, which `web/build` makes, and the scenes with the files below FOLDER \
             that they need, and links each scene to open it live in a browser",
        ))
        .arg(switch(
            "studio",
            "photographs every scene on white paper under soft lamps, as `render --studio` does",
        ))
        .arg(switch("force", "reads all scenes, also those that are up to date"))
        .args([FONTS, LIMIT, MEMORY, WORK].iter().chain(output).map(super::flags::argument))
        .arg(super::time_for_each("ends each scene after this time, such as 10s [60s]"))
}

/// Runs the command and returns the exit code, which is that of an error if a scene could not be
/// read.
///
/// # Errors
/// Returns an error if an option is invalid or if the catalog cannot be written.
pub(crate) fn run(m: &ArgMatches) -> Result<i32> {
    let options = options(m)?;
    options
        .fonts
        .warnings
        .iter()
        .for_each(|t| print_diagnostic(t));
    let catalog = Catalog::open(options)?;
    print_warnings(&catalog.sink);
    let progress = FileProgress::new(catalog.len(), m.get_flag("quiet"));
    let sum = catalog.make(&mut |name, line| progress.done(name, line.as_deref()))?;
    progress.finish(
        sum.scenes,
        &[
            (sum.up_to_date, "up to date"),
            (sum.changed, "changed since the last run"),
            (sum.damaged, "damaged"),
            (sum.unreadable, "unreadable"),
            (sum.with_missing, "with missing files"),
            (sum.with_unknown, "with unknown nodes"),
            (sum.empty, "with nothing to draw"),
            (sum.without_picture, "without a picture"),
        ],
    );
    if sum.not_copied > 0 {
        let text = format!(
            "files that scenes use, outside the folder and not copied: {}",
            sum.not_copied
        );
        let help = "scenes that are opened live are without them";
        print_diagnostic(&Diagnostic::warning(text).with_help(help));
    }
    Ok(if sum.unreadable > 0 { ERROR } else { 0 })
}

/// Reads the options.
fn options(m: &ArgMatches) -> Result<CatalogOptions> {
    let (Some(folder), Some(out)) = (
        m.get_one::<PathBuf>("folder"),
        m.get_one::<PathBuf>("catalog"),
    ) else {
        return Err(Diagnostic::error(
            "a folder of scenes and `-o OUT` are needed",
        ));
    };
    refuse_standard_output(out)?;
    if !folder.is_dir() {
        let text = format!("`{}` is not a folder", folder.display());
        return Err(Diagnostic::not_found(text)
            .with_help("a catalog is made of a folder of scenes; `ivcam check` reads one scene"));
    }
    if out.exists() && !out.is_dir() {
        let text = format!("`{}` is a file", out.display());
        return Err(Diagnostic::error(text).with_help("`-o` has to name a folder"));
    }
    let (search, contain) = (
        folders(m, "search")?,
        m.get_one::<PathBuf>("contain").cloned(),
    );
    let named = search
        .iter()
        .map(|path| format!("--search {}", path.display()));
    let mut words: Vec<String> = named.collect();
    words.extend(contain.iter().map(|p| format!("--contain {}", p.display())));
    for (name, values) in given_options(m).list() {
        if [FONTS.name, LIMIT.name, MEMORY.name, WORK.name].contains(&name) {
            let values = values.iter().map(|v| v.to_string_lossy());
            words.extend(values.map(|value| format!("--{name} {value}")));
        }
    }
    let about = m.get_one::<PathBuf>("about");
    let about = about.map(|path| text_file(path)).transpose()?;
    let size = thumbnail(m)?;
    let threads = render::threads(m)?;
    let allowance = super::allowance(m, threads)?;
    words.push(format!("--size {}x{}", size.width, size.height));
    let studio = m.get_flag("studio");
    words.extend(studio.then(|| "--studio".to_owned()));
    let denoiser = render::denoiser(m)?;
    words.extend(denoiser.iter().map(|d| format!("--denoise={}", d.name())));
    Ok(CatalogOptions {
        folder: folder.clone(),
        out: out.clone(),
        converted: folders(m, "converted")?,
        search,
        contain,
        fonts: super::fonts(m)?,
        limits: super::limits(m)?,
        allowance: Allowance {
            time: allowance.time.or(Some(USUAL_TIME)),
            ..allowance
        },
        threads,
        force: m.get_flag("force"),
        thumbnail: size,
        studio,
        denoiser,
        title: m.get_one::<String>("title").cloned(),
        about,
        page: m.get_one::<PathBuf>("page").cloned(),
        samples: if studio { STUDIO_SAMPLES } else { SAMPLES },
        words,
    })
}

/// Returns the folders of an option.
fn folders(m: &ArgMatches, name: &str) -> Result<Vec<PathBuf>> {
    let given = m.get_many::<PathBuf>(name);
    let folders: Vec<PathBuf> = given.into_iter().flatten().cloned().collect();
    match folders.iter().find(|folder| !folder.is_dir()) {
        None => Ok(folders),
        Some(absent) => {
            let text = format!("there is no folder `{}`", absent.display());
            Err(Diagnostic::not_found(text).with_help(format!("`--{name}` takes a folder")))
        }
    }
}

/// Reads a file of text.
fn text_file(path: &Path) -> Result<String> {
    String::from_utf8(read_file(path, MAX_TEXT)?).map_err(|_| {
        let error = Diagnostic::error(format!("`{}` is not UTF-8", path.display()));
        error.with_help("save the text in this encoding")
    })
}

/// Returns the size of a thumbnail.
fn thumbnail(m: &ArgMatches) -> Result<Resolution> {
    let expects = format!("two numbers of pixels from 1 to {LARGEST}, as in 256x192");
    let size = parsed(m, "size", &expects, |word| {
        let (width, height) = word.split_once('x')?;
        let size = (width.parse().ok()?, height.parse().ok()?);
        let fits = |n: u32| (1..=LARGEST).contains(&n);
        (fits(size.0) && fits(size.1)).then_some(size)
    })?;
    let (width, height) = size.unwrap_or(THUMBNAIL);
    Resolution::new(width, height)
}
