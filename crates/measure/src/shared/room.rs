//! Measures one scene of many triangles through a real lens and an ideal one, and prints another
//! program's figures beside them. Through a pinhole both programs take turns.

use std::fmt::Write as _;
use std::io::{BufRead, BufReader, Write as _};
use std::path::Path;
use std::process::{Command, Stdio};

use ivcam::photo::{Era, IdealChoice, LensChoice, Optics, Plan, Session};
use ivcam_base::math::{Meters, Mm};
use ivcam_optics::sampling::Sampler;
use ivcam_render::render::Stop;
use ivcam_render::render::report::deviation::Deviation;

use super::rays::{median, ratio};

/// Samples per pixel of the reference.
const REFERENCE: u32 = 2048;

/// The rounds in which the pinholes of both programs take turns, after one that does not count.
const ROUNDS: usize = 7;

/// The time and error of one picture.
pub(super) struct Made {
    pub name: String,
    pub samples: u32,
    pub seconds: f64,
    pub error: f64,
}

/// Returns a plan for the room.
pub(crate) fn plan(scene: &Path, optics: Optics) -> Plan {
    let mut plan = Plan::of_era(Era::Modern, scene);
    plan.focus = Some(Meters(1.35));
    plan.optics = optics;
    plan
}

fn optics() -> [(&'static str, Optics); 2] {
    let lens = at_50_mm("double-gauss");
    let ideal = Optics::Ideal(IdealChoice::default());
    [("double Gauss", Optics::Lens(lens)), ("ideal lens", ideal)]
}

/// Returns a shipped lens, scaled to 50 mm.
pub(crate) fn at_50_mm(name: &str) -> LensChoice {
    LensChoice {
        efl: Some(Mm(50.0)),
        ..LensChoice::named(name)
    }
}

/// Returns the table. `peer` is a command for the shell, which finds the path of the scene in
/// `$ROOM` and prints lines of a name, samples per pixel, seconds, and the relative RMSE against
/// its own reference, separated by tabs.
pub(crate) fn table(
    report: &mut String,
    scene: &Path,
    peer: Option<&str>,
    seconds: &dyn Fn() -> f64,
) {
    let mut all = Vec::new();
    let (mut beside, mut triangles) = (String::new(), 0);
    for (name, optics) in optics() {
        let mut truth = Vec::new();
        for adaptive in [false, true] {
            let mut plan = plan(scene, optics.clone());
            plan.adaptive = adaptive;
            let session = match Session::open(plan) {
                Ok(session) => session,
                Err(error) => return eprintln!("{}", error.message),
            };
            if truth.is_empty() {
                truth = reference(&session, REFERENCE);
                let own = session.seconds;
                triangles = session.scene.primitives().0;
                let _ = writeln!(
                    beside,
                    "\n{name}: reading {:.3} s, compiling {:.3} s, pupil {:.4} s of the clock.",
                    own.read, own.compile, own.pupil
                );
            }
            for samples in [4, 16, 64, 256] {
                all.push(made(&session, samples, &truth, name, adaptive, seconds));
            }
        }
    }
    all.extend(peer.into_iter().flat_map(|command| peers(command, scene)));
    let _ = writeln!(
        report,
        "## A room of {triangles} triangles\n\nAreas over nine decades, one point light, shadows, \
         matte; 360x240, 50 mm f/2, focused at 1.35 m, one thread. Seconds of rendering, the \
         pupil's set-up included; reading and compiling the scene are beside. Errors are relative \
         RMSE against each camera's own reference of other samples.\n\n\
         | | samples | s | relRMSE |\n|---|---|---|---|"
    );
    for m in &all {
        let _ = writeln!(
            report,
            "| {} | {} | {:.3} | {:.4} |",
            m.name, m.samples, m.seconds, m.error
        );
    }
    report.push_str(
        "\nSeconds to an error, along the line through the two nearest points of the table in \
         logarithms:\n\n| | s to .06 | s to .03 |\n|---|---|---|\n",
    );
    for of_one in all.chunk_by(|a, b| a.name == b.name) {
        let points: Vec<[f64; 2]> = of_one.iter().map(|m| [m.error, m.seconds]).collect();
        let [a, b] = [0.06, 0.03].map(|error| seconds_to(error, &points));
        let _ = writeln!(report, "| {} | {a:.2} | {b:.2} |", of_one[0].name);
    }
    report.push_str(&beside);
    report.push('\n');
}

/// Appends the table of the scene's own camera, at which both programs take turns. The command of
/// the peer with ` --pinhole` behind it prints the names of its samplers in one line. For each line
/// that it reads, of a sampler, samples per pixel and a seed, it prints seconds and the error.
/// Returns nothing if the command does not do so.
pub(crate) fn pinholes(
    report: &mut String,
    scene: &Path,
    command: &str,
    seconds: &dyn Fn() -> f64,
) -> Option<()> {
    let session = Session::open(plan(scene, Optics::Pinhole)).ok()?;
    let truth = reference(&session, REFERENCE);
    let mut shell = Command::new("sh");
    let shell = shell.args(["-c", &format!("{command} --pinhole")]);
    let streams = shell.stdin(Stdio::piped()).stdout(Stdio::piped());
    let mut peer = streams.env("ROOM", scene).spawn().ok()?;
    let (mut questions, answers) = (peer.stdin.take()?, peer.stdout.take()?);
    let mut answers = BufReader::new(answers).lines().map_while(Result::ok);
    let samplers = answers.next()?;
    let pixels = session.plan.resolution.width * session.plan.resolution.height;
    let _ = writeln!(
        report,
        "## A pinhole in the room\n\nThe scene's own camera at 360x240, one thread. Nanoseconds per \
         sample of rendering alone, medians of {ROUNDS} rounds in which the programs take turns, and \
         the ratio of the other program's time to ivcam's with the least and the greatest of a \
         round. Errors are relative RMSE against each program's own reference of other samples.\n\n\
         | other program | samples | ns, ivcam | ns, other | other / ivcam | relRMSE, ivcam | \
         relRMSE, other |\n|---|---|---|---|---|---|---|"
    );
    for sampler in samplers.split('\t') {
        for samples in [4, 16, 64, 256] {
            let (mut ours, mut theirs) = (Vec::new(), Vec::new());
            let mut errors = [0.0; 2];
            for round in 0..=ROUNDS {
                let own = taken(&session, samples, round as u64, &truth, seconds);
                writeln!(questions, "{sampler}\t{samples}\t{round}").ok()?;
                let answer = answers.next()?;
                let mut numbers = answer
                    .split('\t')
                    .map_while(|word| word.parse::<f64>().ok());
                let other = (numbers.next()?, numbers.next()?);
                if round > 0 {
                    ours.push(own.0);
                    theirs.push(other.0);
                    errors = [own.1, other.1];
                }
            }
            let each = |s: &[f64]| 1e9 * median(s) / f64::from(pixels * samples);
            let _ = writeln!(
                report,
                "| {sampler} | {samples} | {:.1} | {:.1} | {} | {:.4} | {:.4} |",
                each(&ours),
                each(&theirs),
                ratio(&theirs, &ours),
                errors[0],
                errors[1]
            );
        }
    }
    report.push('\n');
    drop(questions);
    peer.wait().ok().map(|_| ())
}

/// Interpolates the seconds to an error between points of falling errors and their seconds.
pub(crate) fn seconds_to(error: f64, points: &[[f64; 2]]) -> f64 {
    let behind = points.partition_point(|p| p[0] > error);
    let first = behind.saturating_sub(1).min(points.len().saturating_sub(2));
    let [a, b] = [first, first + 1].map(|i| points[i.min(points.len() - 1)]);
    let share = (a[0] / error).ln() / (a[0] / b[0]).ln();
    a[1] * (b[1] / a[1]).powf(share)
}

/// Returns levels of the same plan with many independent, evenly distributed samples.
pub(super) fn reference(session: &Session, samples: u32) -> Vec<[f64; 3]> {
    let sampler = Sampler {
        seed: 0x5eed,
        samples,
        ..session.plan.pixel_sampler()
    };
    let made = session.expose_with(sampler, Stop::after(samples), &|_| ());
    made.film.pixels.iter().map(|p| p.mean.to_array()).collect()
}

/// Takes a picture. Its time is the least of three, of one at 256 samples.
pub(super) fn made(
    session: &Session,
    samples: u32,
    truth: &[[f64; 3]],
    name: &str,
    adaptive: bool,
    seconds: &dyn Fn() -> f64,
) -> Made {
    let (mut least, mut error) = (f64::INFINITY, 0.0);
    for _ in 0..if samples < 256 { 3 } else { 1 } {
        let (time, deviation) = taken(session, samples, session.plan.seed, truth, seconds);
        (least, error) = (least.min(time), deviation);
    }
    let how = if adaptive { ", adaptive" } else { "" };
    Made {
        name: format!("{name}{how}"),
        samples,
        seconds: least + session.seconds.pupil,
        error,
    }
}

/// Takes one picture, and returns the seconds of rendering and the relative RMSE.
fn taken(
    session: &Session,
    samples: u32,
    seed: u64,
    truth: &[[f64; 3]],
    seconds: &dyn Fn() -> f64,
) -> (f64, f64) {
    let sampler = Sampler {
        samples,
        seed,
        ..session.plan.pixel_sampler()
    };
    let start = seconds();
    let made = session.expose_with(sampler, Stop::after(samples), &|_| ());
    let time = seconds() - start;
    (time, Deviation::of(&made.film, truth).rel_mse.sqrt())
}

/// Runs the command of a peer.
pub(super) fn peers(command: &str, scene: &Path) -> Vec<Made> {
    let mut shell = Command::new("sh");
    let output = shell.args(["-c", command]).env("ROOM", scene).output();
    let text = output.map(|o| String::from_utf8_lossy(&o.stdout).into_owned());
    let line = |line: &str| {
        let mut words = line.split('\t');
        Some(Made {
            name: words.next()?.to_owned(),
            samples: words.next()?.parse().ok()?,
            seconds: words.next()?.parse().ok()?,
            error: words.next()?.trim().parse().ok()?,
        })
    };
    text.unwrap_or_default().lines().filter_map(line).collect()
}
