//! The options of `ivcam compare`: what is compared, which options have an effect on that, and
//! their values. An option without an effect is refused.

use std::path::{Path, PathBuf};

use clap::ArgMatches;
use ivcam_base::diag::{Diagnostic, Result, nearest};
use ivcam_optics::picture::{PictureFormat, Raster};

use super::folder_mode::output_folder;
use super::{flags, is_given, parsed, text};
use crate::compare::{
    self, METRICS, Matching, Metric, MetricLimit, Registration, Selection, difference, sheet,
};
use crate::compare_folder::has_scenes;

/// What a command compares.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Compared {
    Pictures,
    /// A scene and a picture whose camera is found.
    Fit,
    Folders,
    /// A folder with scenes, which are photographed, and a folder of pictures.
    Scenes,
}

/// The options of a photograph that have an effect on any comparison, or a use in none.
const ALWAYS: [&str; 3] = ["threads", "quiet", "batch"];
/// The options of a photograph that no comparison has.
const NEVER: [&str; 2] = ["report", "progress"];
/// The options for two folders, and those for two pictures.
const OF_FOLDERS: [&str; 4] = ["pair", "by-name", "sort", "remake"];
const OF_PICTURES: [&str; 2] = ["sheet", "difference"];

impl Compared {
    /// Finds what the arguments compare.
    ///
    /// # Errors
    /// Returns an error if one is a folder and the other is not, or if there is no folder for the
    /// report of two folders.
    pub(super) fn of(m: &ArgMatches) -> Result<Self> {
        let [new, old] = paths(m);
        let is_fit = is_given(m, "fit");
        match (new.is_dir(), old.is_dir()) {
            (false, false) if is_fit => Ok(Self::Fit),
            (false, false) => Ok(Self::Pictures),
            (true, true) if !is_fit => match has_scenes(&new, &output_folder(m, &new)?) {
                true => Ok(Self::Scenes),
                false => Ok(Self::Folders),
            },
            (new_is_folder, _) => {
                let folder = if new_is_folder { &new } else { &old };
                let absent = [&new, &old].into_iter().find(|path| !path.exists());
                let error = Diagnostic::error(match absent {
                    Some(absent) => format!("there is no file or folder `{}`", absent.display()),
                    None => format!("`{}` is a folder", folder.display()),
                });
                Err(error.with_help(match is_fit {
                    true => "`--fit` finds the camera of one picture of one scene",
                    false => "compare two pictures, or two folders with `-o REPORT/`",
                }))
            }
        }
    }

    /// Refuses the options that have no effect on this comparison.
    ///
    /// # Errors
    /// Returns an error that names the first one, and what it is for.
    pub(super) fn check(self, m: &ArgMatches) -> Result<()> {
        let is_folder = matches!(self, Self::Folders | Self::Scenes);
        let given = |names: &[&'static str]| {
            let mut names = names.iter().copied();
            names.find(|name| is_given(m, name))
        };
        let refused = |error: String, help| Err(Diagnostic::unsupported(error).with_help(help));
        if let Some(name) = given(&OF_FOLDERS).filter(|_| !is_folder) {
            let name = if name == "remake" { "force" } else { name };
            let help = "two folders are compared by `ivcam compare NEW/ OLD/ -o REPORT/`";
            return refused(format!("`--{name}` is for two folders"), help);
        }
        if let Some(name) = given(&OF_PICTURES).filter(|_| is_folder) {
            let error = format!("`--{name}` is for two pictures, and these are folders");
            let help = "the page in the folder of `-o` shows every pair with its difference";
            return refused(error, help);
        }
        if given(&["fit-aperture"]).is_some() && self != Self::Fit {
            let help = "it goes with `--fit FILE.dat`, where NEW is a scene";
            return refused("`--fit-aperture` finds nothing here".to_owned(), help);
        }
        if let Some(name) = given(&["align", "resize"]).filter(|_| self == Self::Fit) {
            let error = format!("`--{name}` has no effect with `--fit`");
            let help = "leave it out: the rendering at the found camera lies on the picture";
            return refused(error, help);
        }
        let given = flags::given_options(m);
        let idle = given.list().find(|(name, _)| !self.uses(name));
        idle.map_or(Ok(()), |(name, _)| Err(self.refusal(name)))
    }

    /// Returns whether an option of a photograph has an effect.
    fn uses(self, name: &str) -> bool {
        ALWAYS.contains(&name)
            || match self {
                Self::Pictures => false,
                Self::Folders => name == "output",
                Self::Fit | Self::Scenes => !NEVER.contains(&name),
            }
    }

    /// Returns the error about an option of a photograph without an effect.
    fn refusal(self, name: &str) -> Box<Diagnostic> {
        let is_folder = matches!(self, Self::Folders | Self::Scenes);
        let (text, help) = match name {
            "output" => (
                "`-o` has nothing to write: two pictures are compared",
                "`--difference FILE` writes the difference, `--sheet FILE` the pictures side by \
                 side; `-o` is for two folders, and with `--fit` for the rendering",
            ),
            "report" if is_folder => (
                "`--report` has no effect on a comparison of folders",
                "leave it out: the folder of `-o` gets report.json and report.csv",
            ),
            "report" => (
                "`--report` has no effect on a comparison",
                "`--json` prints the numbers as JSON, as in `--json > FILE.json`",
            ),
            "progress" => (
                "`--progress` has no effect on a comparison",
                "leave it out, or give `--quiet`",
            ),
            _ => {
                let text = format!("`--{name}` is for a photograph, and none is made here");
                let help = "it goes with `--fit FILE.dat`, where NEW is a scene, and with a folder \
                            of scenes as NEW";
                return Diagnostic::unsupported(text).with_help(help);
            }
        };
        Diagnostic::unsupported(text).with_help(help)
    }
}

/// Returns the paths of the new and of the old picture or folder.
pub(super) fn paths(m: &ArgMatches) -> [PathBuf; 2] {
    ["new", "old"].map(|name| PathBuf::from(text(m, name).unwrap_or_default()))
}

/// Checks the endings of the files that a comparison of two pictures writes.
///
/// # Errors
/// Returns an error if a file's format is unknown, or cannot hold what is to be written.
pub(super) fn check_outputs(m: &ArgMatches) -> Result<()> {
    if let Some(file) = text(m, "sheet") {
        sheet::format_of(Path::new(file))?;
    }
    if let Some(file) = text(m, "difference") {
        difference::format_of(Path::new(file))?;
    }
    let Some(file) = text(m, "output") else {
        return Ok(());
    };
    match PictureFormat::of(Path::new(file))? {
        PictureFormat::Exr => Err(Diagnostic::unsupported(format!(
            "`-o {file}`: a fit renders levels, and an EXR holds exposures"
        ))
        .with_help("end the name in .png, or render the found camera with `ivcam render`")),
        _ => Ok(()),
    }
}

/// Returns the limits.
///
/// # Errors
/// Returns an error if there is no such measure, or its limit is not a number.
pub(super) fn limits(m: &ArgMatches) -> Result<Vec<MetricLimit>> {
    let words = m.get_many::<String>("limit").unwrap_or_default();
    words.map(|word| limit(word)).collect()
}

fn limit(word: &str) -> Result<MetricLimit> {
    let (name, value) = word.split_once('=').unwrap_or((word, ""));
    let metric = metric(name, &format!("--limit {word}"))?;
    match value.parse() {
        Ok(value) if !f64::is_nan(value) => Ok(MetricLimit { metric, value }),
        _ => Err(
            Diagnostic::error(format!("the value of `--limit {word}` is not a number"))
                .with_help(format!("write it as `--limit {name}=0.01`")),
        ),
    }
}

/// Returns the measure of a name. `option` is where it was given.
fn metric(name: &str, option: &str) -> Result<&'static Metric> {
    let names = || METRICS.map(|m| m.name);
    Metric::named(name).ok_or_else(|| {
        let help = nearest(name, names()).map_or_else(
            || format!("there is {}", names().join(", ")),
            |near| format!("did you mean `{near}`?"),
        );
        Diagnostic::error(format!("`{option}`: there is no measure `{name}`")).with_help(help)
    })
}

/// Returns the measure of `--sort`: SSIM if none is given.
///
/// # Errors
/// Returns an error if there is no such measure.
pub(super) fn sort(m: &ArgMatches) -> Result<&'static Metric> {
    let name = text(m, "sort").unwrap_or("ssim");
    metric(name, &format!("--sort {name}"))
}

/// Returns the mapping that `--align` or `--resize` asks for.
pub(super) fn registration(m: &ArgMatches) -> Option<Registration> {
    match (m.get_flag("align"), m.get_flag("resize")) {
        (true, _) => Some(Registration::Align),
        (_, true) => Some(Registration::Resize),
        _ => None,
    }
}

/// Returns the tone curves that `--match` asks for.
pub(super) fn matching(m: &ArgMatches) -> Matching {
    match text(m, "match") {
        Some("none") => Matching::None,
        Some("channel") => Matching::Channel,
        _ => Matching::Picture,
    }
}

/// Returns the pixels per degree of `--ppd`.
///
/// # Errors
/// Returns an error if the value is not a number from 1 to 1000.
pub(super) fn pixels_per_degree(m: &ArgMatches) -> Result<f64> {
    let ppd = |w: &str| w.parse().ok().filter(|p: &f64| (1.0..=1000.0).contains(p));
    let given = parsed(m, "ppd", "a number from 1 to 1000", ppd)?;
    Ok(given.unwrap_or(compare::PIXELS_PER_DEGREE))
}

/// Returns the pixels that `--crop` and `--mask` select.
///
/// # Errors
/// Returns an error if the value of `--crop` is invalid, or the mask cannot be read.
pub(super) fn selection(m: &ArgMatches) -> Result<Selection> {
    let mask = text(m, "mask").map(|path| Raster::open(Path::new(path)));
    Ok(Selection {
        mask: mask.transpose()?.as_ref().map(Selection::white_pixels),
        crop: parsed(m, "crop", "four integers x,y,w,h", |word| {
            let numbers = word.split(',').map(|n| n.trim().parse().ok());
            let numbers: Option<Vec<usize>> = numbers.collect();
            <[usize; 4]>::try_from(numbers?).ok()
        })?,
    })
}
