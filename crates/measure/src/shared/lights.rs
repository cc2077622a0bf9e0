//! Measures a scene of a thousand lights, and prints another program's figures beside it.

use std::fmt::Write as _;
use std::path::{Path, PathBuf};
use std::process::Command;

use ivcam::photo::{Era, Optics, Plan, Session};
use ivcam_optics::sampling::{mix, unit};

use super::pictures::saved;
use super::room::{reference, seconds_to, taken};

/// The relative RMSE at which times are compared.
const ERROR: f64 = 0.06;

/// The time and error of one picture.
struct Made {
    name: String,
    samples: u32,
    seconds: f64,
    error: f64,
}

/// Writes the scene: a sphere and a floor under 1,000 point lights whose light decreases with the
/// square of the distance. Returns its path, or none if it cannot be written.
fn write() -> Option<PathBuf> {
    let scattered = |index: usize| 2.0 * unit(mix(index as u64)) - 1.0;
    let light = |i: usize| {
        let [x, y, z] = [0, 1, 2].map(|axis| scattered(3 * i + axis));
        let (x, y, z) = (4.0 * x, 2.5 + y, 3.0 * z);
        format!("PointLight {{ intensity .02 location {x:.4} {y:.4} {z:.4} }}\n")
    };
    let lights: String = (0..1000).map(light).collect();
    let text = format!(
        "#Inventor V2.1 ascii\nPerspectiveCamera {{ position 0 3 9 orientation 1 0 0 -.32175 heightAngle .7 \
         nearDistance .1 farDistance 100 }}\n\
         Environment {{ ambientIntensity 0 attenuation 1 0 0 }}\n{lights}\
         Material {{ diffuseColor .8 .8 .8 ambientColor 0 0 0 }}\nSphere {{ }}\n\
         Translation {{ translation 0 -1 0 }}\nCube {{ width 9 depth 9 height .1 }}\n"
    );
    saved("lights.iv", &text)
}

/// Appends the table. `peer` is a command for the shell, which finds the path of the scene in
/// `$ROOM` and prints lines of a name, samples per pixel, seconds, and the relative RMSE against
/// its own reference, separated by tabs.
pub(in super::super) fn table(report: &mut String, peer: Option<&str>, seconds: &dyn Fn() -> f64) {
    let Some(scene) = write() else {
        return eprintln!("cannot write to the temporary folder");
    };
    let mut all = match pictures(&scene, seconds) {
        Ok(own) => own,
        Err(error) => return eprintln!("{}", error.message),
    };
    all.extend(peer.into_iter().flat_map(|command| peers(command, &scene)));
    report.push_str(
        "## A thousand lights\n\nA matte sphere and a floor under 1,000 point lights whose light \
         decreases with the square of the distance; pinhole, 360x240, one thread. Seconds of \
         rendering. Errors are relative RMSE against each program's own reference of other \
         samples.\n\n| | samples | s | relRMSE |\n|---|---|---|---|\n",
    );
    for m in &all {
        let _ = writeln!(
            report,
            "| {} | {} | {:.3} | {:.4} |",
            m.name, m.samples, m.seconds, m.error
        );
    }
    let _ = writeln!(report, "\n| | s to {ERROR} |\n|---|---|");
    for of_one in all.chunk_by(|a, b| a.name == b.name) {
        let points: Vec<[f64; 2]> = of_one.iter().map(|m| [m.error, m.seconds]).collect();
        let _ = writeln!(
            report,
            "| {} | {:.2} |",
            of_one[0].name,
            seconds_to(ERROR, &points)
        );
    }
    report.push('\n');
}

/// Takes pictures with several numbers of samples.
fn pictures(scene: &Path, seconds: &dyn Fn() -> f64) -> ivcam_base::diag::Result<Vec<Made>> {
    let mut plan = Plan::of_era(Era::Modern, scene);
    plan.optics = Optics::Pinhole;
    let session = Session::open(plan)?;
    let truth = reference(&session, 256);
    let one = |samples| {
        let takes = [0, 1, 2].map(|seed| taken(&session, samples, seed, &truth, seconds));
        Made {
            name: "ivcam".to_owned(),
            samples,
            seconds: takes
                .iter()
                .fold(f64::INFINITY, |least, take| least.min(take.0)),
            error: takes[0].1,
        }
    };
    Ok([1, 4, 16].map(one).into())
}

/// Runs the command of a peer.
fn peers(command: &str, scene: &Path) -> Vec<Made> {
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
