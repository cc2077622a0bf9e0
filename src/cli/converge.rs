//! `ivcam converge`: measures the error over samples and time for several methods.

use std::io::Write;
use std::path::Path;

use clap::{ArgMatches, Command};
use ivcam_base::diag::{Diagnostic, Result};
use ivcam_base::files::write_whole;
use ivcam_optics::picture::{Raster, Samples};
use ivcam_optics::sampling::{DiscMap, Filter, Sampler, SamplerKind};
use ivcam_render::camera::Aim;
use ivcam_render::render::Stop;
use ivcam_render::render::report::{Across, Convergence, Peer, Row, percent};

use super::render::{OutputOptions, plan, print_notices, refuse_region};
use super::render_outputs::listed;
use super::{flags, parsed, print_warnings, scene_argument, text, value};
use crate::photo::options::can_adapt;
use crate::photo::{Era, Plan, Session};

/// Returns the definition of the command.
pub(crate) fn command() -> Command {
    Command::new("converge")
        .about("Measures error against samples and run time, for a list of methods")
        .args(flags::photograph().map(|arg| listed(arg, "converge", &["region"])))
        .after_help(flags::MORE)
        .mut_arg("output", |arg| arg.hide(true))
        .arg(value(
            "methods",
            "LIST",
            "of 1999, random, jittered, sobol, blue, golden, each also with +rear, +adaptive or +FILTER \
             [sobol,jittered,1999; with --adaptive sobol,blue]",
        ))
        .arg(value(
            "from",
            "N",
            "samples per pixel of the first render; they double up to --samples [1]",
        ))
        .arg(value(
            "reference",
            "FILE",
            "picture (EXR) to compare with [a render with --reference-samples]",
        ))
        .arg(value(
            "reference-samples",
            "N",
            "samples per pixel of the rendered reference [16 times --samples]",
        ))
        .arg(value("csv", "FILE", "also writes the table as CSV"))
        .arg(value("json", "FILE", "also writes the table as JSON"))
        .arg(value(
            "svg",
            "FILE",
            "also draws relative RMSE over the quantity of --axis",
        ))
        .arg(value(
            "axis",
            "NAME",
            "seconds, processor (seconds of processors) or samples [seconds]",
        ))
        .arg(value(
            "peers",
            "FILE",
            "CSV with curves of other programs, which are added to the table and the chart",
        ))
        .arg(scene_argument())
}

pub(crate) fn run(m: &ArgMatches, out: &mut dyn Write) -> Result<i32> {
    if let Some(output) = text(m, "output") {
        return Err(
            Diagnostic::error(format!("there is no picture to write to `{output}`"))
                .with_help("a convergence run makes tables: give `--csv`, `--json` or `--svg`"),
        );
    }
    let is_svg = |file: &&str| file.to_ascii_lowercase().ends_with(".svg");
    if let Some(file) = text(m, "svg").filter(|file| !is_svg(file)) {
        let error = format!("`--svg {file}` is not the name of an SVG file");
        return Err(Diagnostic::unsupported(error).with_help("end the name in .svg"));
    }
    let options = OutputOptions::of(m)?;
    let plan = plan(m, Era::Modern)?;
    refuse_region(&plan)?;
    let most = plan.pixel_sampler().samples;
    let whole = |w: &str| w.parse::<u32>().ok().filter(|n| (1..=1 << 24).contains(n));
    let from = parsed(m, "from", "a number of samples", whole)?.unwrap_or(1);
    let deep = parsed(m, "reference-samples", "a number of samples", whole)?.unwrap_or(16 * most);
    let methods: Vec<ConvergenceMethod> = text(m, "methods")
        .unwrap_or(match plan.adaptive {
            true => "sobol,blue",
            false => "sobol,jittered,1999",
        })
        .split(',')
        .map(|word| ConvergenceMethod::parse(word, plan.adaptive))
        .collect::<Result<_>>()?;
    let across = axis(m)?;
    let peers = text(m, "peers").map(|file| Peer::open(Path::new(file)));
    let base = options.on_threads(|| Session::open(plan.clone()))??;
    print_warnings(&base.sink);
    print_notices(&base, options.quiet);

    let mut table = Convergence {
        scene: plan.scene.display().to_string(),
        ..Convergence::default()
    };
    table.set_peers(peers.transpose()?.unwrap_or_default());
    let reference = match text(m, "reference") {
        Some(file) => {
            table.reference = file.to_owned();
            read_reference(Path::new(file), &plan)?
        }
        None => {
            let sampler = Sampler {
                kind: SamplerKind::Sobol,
                samples: deep,
                seed: !plan.seed,
            };
            let run = || base.expose_with(sampler, Stop::after(deep), &|_| ());
            let exposure = options.on_threads(run)?;
            let error = match exposure.film.error() {
                Ok(error) => format!("relative error {}", percent(error.relative_rmse, 2)),
                Err(reason) => format!("error unknown: {reason}"),
            };
            table.reference = format!("{deep} spp of sobol, {error}");
            exposure
                .film
                .pixels
                .iter()
                .map(|p| p.mean.to_array())
                .collect()
        }
    };
    drop(base);

    for method in &methods {
        let session = options.on_threads(|| Session::open(method.of(&plan)))??;
        let mut samples = from;
        while samples <= most {
            let sampler = Sampler {
                samples,
                ..session.plan.pixel_sampler()
            };
            let run = || session.expose_with(sampler, Stop::after(samples), &|_| ());
            let exposure = options.on_threads(run)?;
            table.push(Row::new(&method.name, &exposure, &reference));
            if !options.quiet {
                super::status!(
                    "{} {samples} spp: {:.2} s",
                    method.name,
                    exposure.spent.seconds
                );
            }
            write(m, &table, across)?;
            samples *= 2;
        }
    }
    super::exit_code(write!(out, "{}", table.text()))
}

/// Writes the tables. It is called after every render, so that an interrupted run loses nothing.
fn write(m: &ArgMatches, table: &Convergence, across: Across) -> Result<()> {
    let save = |name: &str, content: &dyn Fn() -> String| match text(m, name) {
        Some(file) => write_whole(Path::new(file), |f| f.write_all(content().as_bytes())),
        None => Ok(()),
    };
    save("csv", &|| table.csv())?;
    save("json", &|| {
        serde_json::to_string_pretty(table).unwrap_or_default() + "\n"
    })?;
    save("svg", &|| table.svg(across))
}

/// Returns the quantity on the chart's horizontal axis.
fn axis(m: &ArgMatches) -> Result<Across> {
    let named = |word: &str| Across::ALL.iter().find(|(n, _)| *n == word).map(|a| a.1);
    let axis = parsed(m, "axis", "seconds, processor or samples", named)?;
    Ok(axis.unwrap_or(Across::Seconds))
}

const METHODS: &str = "methods are 1999, random, jittered, sobol, blue and golden, each also with +rear, +adaptive \
     or +FILTER: sobol+adaptive+mitchell";

/// A method: the changes to a plan that a name describes.
struct ConvergenceMethod {
    name: String,
    kind: SamplerKind,
    aim: Aim,
    adaptive: bool,
    /// The pixel filter. Default: that of the plan.
    filter: Option<Filter>,
}

impl ConvergenceMethod {
    /// Reads a method. `adaptive` says whether the options make every method adaptive.
    fn parse(word: &str, adaptive: bool) -> Result<Self> {
        let name = word.trim().to_owned();
        let mut words = name.split('+');
        let sampler = words.next().unwrap_or_default();
        let unknown =
            |what: &str| Diagnostic::error(format!("there is no {what}")).with_help(METHODS);
        let kind = SamplerKind::ALL.iter().find(|(n, _)| *n == sampler);
        let (kind, aim) = match (sampler, kind) {
            ("1999", _) => (SamplerKind::Jittered, Aim::RearElement(DiscMap::Polar)),
            (_, Some((_, kind))) => (*kind, Aim::ExitPupil),
            _ => return Err(unknown(&format!("method `{sampler}`"))),
        };
        let mut method = Self {
            name: name.clone(),
            kind,
            aim,
            adaptive,
            filter: None,
        };
        for word in words {
            match (word, Filter::ALL.iter().find(|(n, _)| *n == word)) {
                ("rear", _) => method.aim = Aim::RearElement(DiscMap::Concentric),
                ("adaptive", _) => method.adaptive = true,
                (_, Some((_, filter))) => method.filter = Some(*filter),
                _ => return Err(unknown(&format!("`+{word}`"))),
            }
        }
        if method.adaptive {
            let help =
                "of the methods, random, sobol, blue and golden adapt, as in `sobol+adaptive`";
            can_adapt(kind).map_err(|error| error.with_help(help))?;
        }
        Ok(method)
    }

    fn of(&self, plan: &Plan) -> Plan {
        let mut plan = plan.clone();
        plan.sampler = self.kind;
        plan.aim = self.aim;
        plan.adaptive = self.adaptive;
        plan.filter = self.filter.unwrap_or(plan.filter);
        plan
    }
}

/// Reads the linear values of a picture file that has the plan's size.
fn read_reference(path: &Path, plan: &Plan) -> Result<Vec<[f64; 3]>> {
    let picture = Raster::open(path)?;
    if picture.channels < 3 || !matches!(picture.samples, Samples::F32(_)) {
        return Err(
            Diagnostic::error("the reference has no linear red, green and blue")
                .in_file(path.display().to_string())
                .with_help("give an EXR that ivcam wrote"),
        );
    }
    let size = plan.resolution;
    if (picture.width, picture.height) != (size.width, size.height) {
        return Err(Diagnostic::error(format!(
            "the reference is {}x{}, the picture {}x{}",
            picture.width, picture.height, size.width, size.height
        ))
        .in_file(path.display().to_string())
        .with_help(format!(
            "render with `--size {}x{}`",
            picture.width, picture.height
        )));
    }
    let pixels = 0..picture.pixels();
    Ok(pixels.map(|i| picture.color(i).map(f64::from)).collect())
}
