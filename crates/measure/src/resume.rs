//! Kills renders with a checkpoint at random instants, and compares the pictures that are continued
//! from it with that of a render that nothing interrupts.
//!
//! `cargo run --release -p measure -- resume PROGRAM [--kills N]`, from the
//! folder of the repository. With a program that has the feature `mpi`, a process that `mpirun` has
//! started, all of them, and `mpirun` itself are killed too. The exit code is 1 if a picture
//! differs. The instants depend on the speed of the machine.

use std::path::Path;
use std::process::{Child, Command, ExitCode, Stdio};
use std::time::{Duration, Instant};

use ivcam_optics::picture::Raster;
use ivcam_optics::sampling::{mix, unit};

use super::faults::program_and_kills;

/// The arguments of the render, without the files that it writes.
const RENDER: [&str; 9] = [
    "render",
    "scenes/desk-lamp/desk-lamp.iv",
    "--size",
    "120x80",
    "--samples",
    "160",
    "--adaptive",
    "--every",
    "0.01s",
];
/// The words before the program where several processes make the picture.
const MPIRUN: [&str; 7] = [
    "mpirun",
    "--allow-run-as-root",
    "--oversubscribe",
    "--bind-to",
    "none",
    "-n",
    "3",
];
/// The longest time in which processes end after `mpirun` was killed.
const LONGEST_END: Duration = Duration::from_secs(10);

/// What is killed.
#[derive(Clone, Copy, PartialEq)]
enum Victim {
    Program,
    Rank,
    AllRanks,
    Launcher,
}

impl Victim {
    const ALL: [(&'static str, Self); 4] = [
        ("the program", Self::Program),
        ("one process of three", Self::Rank),
        ("all three processes", Self::AllRanks),
        ("`mpirun`", Self::Launcher),
    ];
}

/// How often what happened.
#[derive(Default)]
struct Counts {
    running: u64,
    resumed: u64,
    same: u64,
}

pub(crate) fn run(words: Vec<String>) -> ExitCode {
    let Some((program, kills)) = program_and_kills(&words, 100) else {
        return crate::usage("resume");
    };
    let folder = std::env::temp_dir().join(format!("ivcam-resume-{}", std::process::id()));
    println!(
        "| killed | instants | still running | continued from a checkpoint | identical pictures |\n\
         |---|---|---|---|---|"
    );
    let mut failed = false;
    for (name, victim) in Victim::ALL {
        match kill(&program, victim, kills, &folder) {
            Ok(Counts {
                running,
                resumed,
                same,
            }) => {
                println!("| {name} | {kills} | {running} | {resumed} | {same} |");
                failed |= same != kills;
            }
            Err(error) => println!("| {name} | skipped: {error} | | | |"),
        }
    }
    let _ = std::fs::remove_dir_all(&folder);
    ExitCode::from(u8::from(failed))
}

/// Returns the command of a render in a folder.
fn render(program: &Path, victim: Victim, folder: &Path) -> Command {
    let mut command = match victim {
        Victim::Program => Command::new(program),
        _ => {
            let mut command = Command::new(MPIRUN[0]);
            command.args(&MPIRUN[1..]).arg(program);
            command
        }
    };
    command
        .args(RENDER)
        .args(["--threads", "1", "--quiet", "--checkpoint"]);
    command
        .arg(folder.join("a.ckpt"))
        .arg("-o")
        .arg(folder.join("a.exr"));
    command.stdout(Stdio::null()).stderr(Stdio::null());
    command
}

/// Kills renders at random instants and continues each.
fn kill(program: &Path, victim: Victim, kills: u64, folder: &Path) -> std::io::Result<Counts> {
    let fresh = || {
        let _ = std::fs::remove_dir_all(folder);
        std::fs::create_dir_all(folder)
    };
    let finish = || {
        let status = render(program, victim, folder).status()?;
        match status.success() {
            true => picture(folder),
            false => Err(std::io::Error::other(format!("it ends with {status}"))),
        }
    };
    fresh()?;
    let start = Instant::now();
    let whole = finish()?;
    let whole_run = start.elapsed();
    let mut counts = Counts::default();
    for number in 0..kills {
        fresh()?;
        let mut child = render(program, victim, folder).spawn()?;
        std::thread::sleep(whole_run.mul_f64(unit(mix(number))));
        counts.running += u64::from(child.try_wait()?.is_none());
        end(&mut child, victim, number)?;
        counts.resumed += u64::from(folder.join("a.ckpt").exists());
        counts.same += u64::from(finish()? == whole);
    }
    Ok(counts)
}

/// Kills what is to be killed, and waits until all processes have ended.
fn end(child: &mut Child, victim: Victim, number: u64) -> std::io::Result<()> {
    let ranks = match victim {
        Victim::Program => Vec::new(),
        _ => children(child.id()),
    };
    match victim {
        Victim::Program | Victim::Launcher => child.kill()?,
        Victim::AllRanks => ranks.iter().try_for_each(|rank| signal(*rank))?,
        Victim::Rank => {
            let chosen = ranks.get(mix(!number) as usize % ranks.len().max(1));
            chosen.map_or(Ok(()), |rank| signal(*rank))?;
        }
    }
    child.wait()?;
    let start = Instant::now();
    while ranks.iter().any(|rank| is_running(*rank)) {
        if start.elapsed() > LONGEST_END {
            return Err(std::io::Error::other("processes go on without `mpirun`"));
        }
        std::thread::sleep(Duration::from_millis(10));
    }
    Ok(())
}

/// Kills a process. One that has ended is no error.
fn signal(process: u32) -> std::io::Result<()> {
    let mut kill = Command::new("kill");
    kill.args(["-9", &process.to_string()])
        .stderr(Stdio::null());
    kill.status().map(|_| ())
}

/// Returns whether a process has not ended. One that nobody has waited for has the state Z.
fn is_running(process: u32) -> bool {
    let stat = std::fs::read_to_string(format!("/proc/{process}/stat"));
    stat.is_ok_and(|stat| !stat.contains(") Z "))
}

/// Returns the processes that a process has started.
fn children(parent: u32) -> Vec<u32> {
    let path = format!("/proc/{parent}/task/{parent}/children");
    let list = std::fs::read_to_string(path).unwrap_or_default();
    list.split_whitespace()
        .filter_map(|n| n.parse().ok())
        .collect()
}

/// Returns the values of the picture.
fn picture(folder: &Path) -> std::io::Result<Vec<[u32; 3]>> {
    let raster = Raster::open(&folder.join("a.exr"));
    let raster = raster.map_err(|e| std::io::Error::other(e.to_string()))?;
    let bits = |i: usize| raster.color(i).map(f32::to_bits);
    Ok((0..raster.pixels()).map(bits).collect())
}
