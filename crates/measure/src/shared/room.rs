//! Measures one scene of many triangles through a real lens, an ideal one and a pinhole, in turn
//! with another program.

use std::fmt::Write as _;
use std::io::{BufRead, BufReader, Lines, Write as _};
use std::path::Path;
use std::process::{Child, ChildStdin, ChildStdout, Command, Stdio};

use ivcam::photo::{Era, IdealChoice, LensChoice, Optics, Plan, Session};
use ivcam_base::math::{Meters, Mm};
use ivcam_optics::sampling::Sampler;
use ivcam_render::render::Stop;
use ivcam_render::render::report::deviation::Deviation;

use super::rays::{median, ratio};

/// Samples per pixel of the reference.
const REFERENCE: u32 = 2048;

/// Samples per pixel of the pictures.
const SAMPLES: [u32; 4] = [4, 16, 64, 256];

/// The rounds in which cameras take turns, after one that does not count.
const ROUNDS: usize = 7;

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

/// A camera whose pictures are measured in turn with others.
enum RoomCamera<'a> {
    /// Our own, with a reference of other samples.
    Own(&'a Session, &'a [[f64; 3]]),
    /// That of a sampler of the peer.
    Peer(&'a str),
}

/// Pictures of one camera: for each of [`SAMPLES`] the seconds of every round and the squares of
/// the relative RMSE.
#[derive(Default)]
struct Rounds([(Vec<f64>, Vec<f64>); SAMPLES.len()]);

impl Rounds {
    /// The relative RMSE of all rounds' pictures at one number of samples.
    fn error(&self, samples: usize) -> f64 {
        let squares = &self.0[samples].1;
        (squares.iter().sum::<f64>() / squares.len() as f64).sqrt()
    }

    /// For each round the seconds to an error.
    fn seconds_to(&self, error: f64) -> Vec<f64> {
        let points = |round: usize| -> Vec<[f64; 2]> {
            let seconds = self.0.iter().map(|(seconds, _)| seconds[round]);
            let points = seconds.enumerate();
            points
                .map(|(k, seconds)| [self.error(k), seconds])
                .collect()
        };
        let rounds = 0..self.0[0].0.len();
        rounds
            .map(|round| seconds_to(error, &points(round)))
            .collect()
    }
}

/// Appends the table of the room through a lens and an ideal lens, beside a peer if there is one,
/// all of which take turns.
pub(crate) fn table(
    report: &mut String,
    scene: &Path,
    command: Option<&str>,
    seconds: &dyn Fn() -> f64,
) {
    let mut peer = command.and_then(|command| PeerProgram::start(command, scene));
    if let (Some(command), None) = (command, &peer) {
        eprintln!("{command}: no names of samplers");
    }
    let mut sessions = Vec::new();
    for (name, optics) in optics() {
        for (name, adaptive) in [
            (name.to_owned(), false),
            (format!("{name}, adaptive"), true),
        ] {
            let mut plan = plan(scene, optics.clone());
            plan.adaptive = adaptive;
            match Session::open(plan) {
                Ok(session) => sessions.push((name, session)),
                Err(error) => return eprintln!("{}", error.message),
            }
        }
    }
    let truths: Vec<_> = sessions
        .chunks(2)
        .map(|of| reference(&of[0].1, REFERENCE))
        .collect();
    let own = sessions.iter().enumerate();
    let mut cameras: Vec<(&str, RoomCamera)> = own
        .map(|(k, (name, session))| (name.as_str(), RoomCamera::Own(session, &truths[k / 2])))
        .collect();
    let samplers = peer
        .as_ref()
        .map_or(Vec::new(), |peer| peer.samplers.clone());
    cameras.extend(
        samplers
            .iter()
            .map(|name| (name.as_str(), RoomCamera::Peer(name))),
    );
    let all = in_turn(&cameras, &mut peer, seconds);
    let _ = writeln!(
        report,
        "## A room of {} triangles\n\nAreas over nine decades, one point light, shadows, matte; \
         360x240, 50 mm f/2, focused at 1.35 m, one thread. Seconds of rendering, the pupil's \
         set-up included, are medians of {ROUNDS} rounds in which all cameras take turns; reading \
         and compiling the scene are beside. Errors are relative RMSE against each camera's own \
         reference of other samples.\n\n| | samples | s | relRMSE |\n|---|---|---|---|",
        sessions[0].1.scene.primitives().0
    );
    for ((name, _), rounds) in cameras.iter().zip(&all) {
        for (k, samples) in SAMPLES.iter().enumerate() {
            let (s, error) = (median(&rounds.0[k].0), rounds.error(k));
            let _ = writeln!(report, "| {name} | {samples} | {s:.3} | {error:.4} |");
        }
    }
    let _ = writeln!(
        report,
        "\nSeconds to an error, along the line through the two nearest points in logarithms, and \
         their ratio to those of the first camera: medians, and the least and the greatest of a \
         round.\n\n| | s to .06 | times the first | s to .03 | times the first |\n\
         |---|---|---|---|---|"
    );
    for ((name, _), rounds) in cameras.iter().zip(&all) {
        let _ = write!(report, "| {name} |");
        for error in [0.06, 0.03] {
            let to = rounds.seconds_to(error);
            let times = ratio(&to, &all[0].seconds_to(error));
            let _ = write!(report, " {:.2} | {times} |", median(&to));
        }
        report.push('\n');
    }
    for (name, session) in sessions.iter().step_by(2) {
        let own = session.seconds;
        let _ = writeln!(
            report,
            "\n{name}: reading {:.3} s, compiling {:.3} s, pupil {:.4} s of the clock.",
            own.read, own.compile, own.pupil
        );
    }
    report.push('\n');
}

/// Takes pictures with all cameras in turn, in one round that does not count and [`ROUNDS`] more.
fn in_turn(
    cameras: &[(&str, RoomCamera)],
    peer: &mut Option<PeerProgram>,
    seconds: &dyn Fn() -> f64,
) -> Vec<Rounds> {
    let mut all: Vec<Rounds> = cameras.iter().map(|_| Rounds::default()).collect();
    for round in 0..=ROUNDS as u64 {
        for (k, &samples) in SAMPLES.iter().enumerate() {
            for ((_, camera), rounds) in cameras.iter().zip(&mut all) {
                let made = match camera {
                    RoomCamera::Own(session, truth) => {
                        let (time, error) = taken(session, samples, round, truth, seconds);
                        Some((time + session.seconds.pupil, error))
                    }
                    RoomCamera::Peer(sampler) => peer
                        .as_mut()
                        .and_then(|peer| peer.picture(sampler, samples, round)),
                };
                // A peer that has ended leaves no figures, and the table shows that.
                let (time, error) = made.unwrap_or((f64::NAN, f64::NAN));
                if round > 0 {
                    rounds.0[k].0.push(time);
                    rounds.0[k].1.push(error * error);
                }
            }
        }
    }
    all
}

/// Appends the table of the scene's own camera, at which ivcam and a peer, started with
/// ` --pinhole` behind its command, take turns. Returns nothing if the peer does not answer.
pub(crate) fn pinholes(
    report: &mut String,
    scene: &Path,
    command: &str,
    seconds: &dyn Fn() -> f64,
) -> Option<()> {
    let session = Session::open(plan(scene, Optics::Pinhole)).ok()?;
    let truth = reference(&session, REFERENCE);
    let mut peer = Some(PeerProgram::start(&format!("{command} --pinhole"), scene)?);
    let samplers = peer.as_ref()?.samplers.clone();
    let mut cameras = vec![("", RoomCamera::Own(&session, &truth))];
    cameras.extend(
        samplers
            .iter()
            .map(|name| (name.as_str(), RoomCamera::Peer(name))),
    );
    let all = in_turn(&cameras, &mut peer, seconds);
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
    let own = &all[0];
    for (sampler, other) in samplers.iter().zip(&all[1..]) {
        for (k, &samples) in SAMPLES.iter().enumerate() {
            let [ours, theirs] = [own, other].map(|rounds| &rounds.0[k].0);
            let each = |s: &[f64]| 1e9 * median(s) / f64::from(pixels * samples);
            let _ = writeln!(
                report,
                "| {sampler} | {samples} | {:.1} | {:.1} | {} | {:.4} | {:.4} |",
                each(ours),
                each(theirs),
                ratio(theirs, ours),
                own.error(k),
                other.error(k)
            );
        }
    }
    report.push('\n');
    Some(())
}

/// A program that takes pictures when it is asked for one, so that it can take turns with ivcam.
struct PeerProgram {
    process: Child,
    questions: Option<ChildStdin>,
    answers: Lines<BufReader<ChildStdout>>,
    samplers: Vec<String>,
}

impl PeerProgram {
    /// Starts a command of the shell, which finds the path of the scene in `$ROOM` and prints the
    /// names of its samplers in one line, separated by tabs.
    fn start(command: &str, scene: &Path) -> Option<Self> {
        let mut shell = Command::new("sh");
        let shell = shell.args(["-c", command]).env("ROOM", scene);
        let streams = shell.stdin(Stdio::piped()).stdout(Stdio::piped());
        let mut process = streams.spawn().ok()?;
        let questions = process.stdin.take();
        let mut answers = BufReader::new(process.stdout.take()?).lines();
        let samplers = answers
            .next()?
            .ok()?
            .split('\t')
            .map(str::to_owned)
            .collect();
        Some(Self {
            process,
            questions,
            answers,
            samplers,
        })
    }

    /// Asks for a picture by a line of a sampler, samples per pixel and a seed, separated by tabs.
    /// Returns the seconds and the relative RMSE, which the peer prints with a tab between.
    fn picture(&mut self, sampler: &str, samples: u32, seed: u64) -> Option<(f64, f64)> {
        writeln!(self.questions.as_ref()?, "{sampler}\t{samples}\t{seed}").ok()?;
        let answer = self.answers.next()?.ok()?;
        let mut numbers = answer.split('\t').map_while(|word| word.parse().ok());
        Some((numbers.next()?, numbers.next()?))
    }
}

impl Drop for PeerProgram {
    /// Closes the peer's input, at which it ends.
    fn drop(&mut self) {
        self.questions = None;
        let _ = self.process.wait();
    }
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

/// Takes one picture, and returns the seconds of rendering and the relative RMSE.
pub(super) fn taken(
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
