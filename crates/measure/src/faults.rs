//! Kills the program at random instants and takes its disk away, and looks at what is left.
//!
//! `cargo run --release -p measure -- faults PROGRAM [--kills N]`, from the
//! folder of the repository.
//!
//! Whatever happens, a file under its final name is whole, the exit code and the message are true,
//! and the next run removes the temporary files of a dead one. The exit code is 1 if a file is
//! partial or left over. The instants depend on the speed of the machine.

use std::ffi::OsStr;
use std::path::{Path, PathBuf};
use std::process::{Child, Command, ExitCode, Output, Stdio};
use std::time::{Duration, Instant};

use ivcam::photo::checkpoint::Checkpoint;
use ivcam_optics::picture::Raster;
use ivcam_optics::sampling::{mix, unit};

use super::shared::words::value_of;

const SCENE: &str = "scenes/desk-lamp/desk-lamp.iv";

/// A command that writes files, which is killed.
struct Victim {
    name: &'static str,
    /// The arguments, separated by spaces. `SCENE` is a scene, and `OUT` is a folder for outputs.
    words: &'static str,
}

const VICTIMS: [Victim; 6] = [
    Victim {
        name: "render to PNG",
        words: "render SCENE --size 192x128 --samples 4 -o OUT/a.png",
    },
    Victim {
        name: "render to EXR, with layers and report",
        words: "render SCENE --size 192x128 --samples 4 -o OUT/a.exr --aov OUT/layers.exr \
                --report OUT/report.json",
    },
    Victim {
        name: "render with checkpoints",
        words: "render SCENE --size 192x128 --samples 16 --checkpoint OUT/a.ckpt --every 0.05s \
                -o OUT/a.png",
    },
    Victim {
        name: "a large picture, mostly written",
        words: "render SCENE --size 1600x1200 --samples 1 --lens none --shading flat -o OUT/a.png",
    },
    Victim {
        name: "movie",
        words: "pull-focus SCENE --from 1 --to 2 --frames 6 --size 96x64 --samples 4 \
                --folder OUT/frames -o OUT/movie.png",
    },
    Victim {
        name: "catalog",
        words: "catalog scenes -o OUT/catalog",
    },
];

pub(crate) fn run(words: Vec<String>) -> ExitCode {
    let Some((program, kills)) = program_and_kills(&words, 200) else {
        return crate::usage("faults");
    };
    let folder = std::env::temp_dir().join(format!("ivcam-faults-{}", std::process::id()));
    let mut failed = 0;
    println!(
        "| command | instants | still running | whole files | partial files | temporary files after \
         the next run |\n|---|---|---|---|---|---|"
    );
    for victim in &VICTIMS {
        match killed(&program, victim, kills, &folder.join("kills")) {
            Ok(row) => failed += row,
            Err(error) => {
                eprintln!("{}: {error}", victim.name);
                failed += 1;
            }
        }
    }
    println!("\n| fault | exit code | message | left |\n|---|---|---|---|");
    for fault in [
        full_disk,
        read_only,
        broken_pipe,
        little_memory,
        disk_errors,
        two_at_once,
    ] {
        match fault(&program, &folder.join("faults")) {
            Ok(row) => failed += row,
            Err(error) => println!("| skipped: {error} | | | |"),
        }
    }
    let _ = std::fs::remove_dir_all(&folder);
    ExitCode::from(u8::from(failed > 0))
}

/// Returns the program to kill and how often, from `PROGRAM [--kills N]`.
pub(crate) fn program_and_kills(words: &[String], default: u64) -> Option<(PathBuf, u64)> {
    let program = words.first().map(PathBuf::from)?;
    let kills = value_of("--kills", words);
    let kills = kills.and_then(|word| word.parse().ok()).unwrap_or(default);
    Some((program, kills))
}

fn command(program: &Path, words: &str, out: &Path) -> Command {
    let mut command = Command::new(program);
    let out = out.to_string_lossy();
    let word = |word: &str| word.replace("SCENE", SCENE).replace("OUT", &out);
    command.args(words.split_whitespace().map(word));
    command.stdout(Stdio::null()).stderr(Stdio::null());
    command
}

/// Kills a command at random instants and prints a row. Returns the number of failures.
fn killed(program: &Path, victim: &Victim, kills: u64, out: &Path) -> std::io::Result<u64> {
    let fresh = || {
        let _ = std::fs::remove_dir_all(out);
        std::fs::create_dir_all(out)
    };
    fresh()?;
    let start = Instant::now();
    let status = command(program, victim.words, out).status()?;
    if !status.success() {
        return Err(std::io::Error::other(format!("it ends with {status}")));
    }
    let whole_run = start.elapsed();
    let (mut running, mut whole, mut partial) = (0, 0, 0);
    for kill in 0..kills {
        fresh()?;
        let mut child = command(program, victim.words, out).spawn()?;
        std::thread::sleep(whole_run.mul_f64(1.05 * unit(mix(kill))));
        running += u64::from(end(&mut child)?);
        let (good, bad) = inspected(out);
        whole += good;
        partial += bad;
    }
    // The files of the last run are still there.
    let again = command(program, victim.words, out)
        .stderr(Stdio::piped())
        .output()?;
    if !again.status.success() {
        let error = String::from_utf8_lossy(&again.stderr);
        eprintln!("{} again: {}: {error}", victim.name, again.status);
    }
    let left = below(out).iter().filter(|path| is_temporary(path)).count() as u64;
    println!(
        "| {} | {kills} | {running} | {whole} | {partial} | {left} |",
        victim.name
    );
    Ok(partial + left + u64::from(!again.status.success()))
}

/// Kills a process. Returns whether it was still running.
fn end(child: &mut Child) -> std::io::Result<bool> {
    let running = child.try_wait()?.is_none();
    if running {
        child.kill()?;
    }
    child.wait()?;
    Ok(running)
}

/// Returns the numbers of whole and of partial files under final names.
fn inspected(out: &Path) -> (u64, u64) {
    let (mut whole, mut partial) = (0, 0);
    for path in below(out).iter().filter(|path| !is_temporary(path)) {
        match is_whole(path) {
            true => whole += 1,
            false => {
                eprintln!("partial: {}", path.display());
                partial += 1;
            }
        }
    }
    (whole, partial)
}

/// Whether a file can be read to its end.
fn is_whole(path: &Path) -> bool {
    let text = || std::fs::read_to_string(path).unwrap_or_default();
    match path.extension().and_then(OsStr::to_str) {
        Some("png" | "exr" | "ppm") => Raster::open(path).is_ok(),
        Some("json") => serde_json::from_str::<serde_json::Value>(&text()).is_ok(),
        Some("html") => text().trim_end().ends_with("</html>"),
        Some("ckpt") => Checkpoint::read(path).is_ok(),
        // Logs and claims grow or are replaced in place, and have no end.
        _ => true,
    }
}

/// The names of temporary files begin with a dot and end in `.tmp`.
fn is_temporary(path: &Path) -> bool {
    let name = path.file_name().unwrap_or_default().to_string_lossy();
    name.starts_with('.') && name.ends_with(".tmp")
}

/// Returns all files below a folder.
fn below(folder: &Path) -> Vec<PathBuf> {
    let Ok(entries) = std::fs::read_dir(folder) else {
        return Vec::new();
    };
    let paths = entries.flatten().map(|entry| entry.path());
    let of_one = |path: PathBuf| match path.is_dir() {
        true => below(&path),
        false => vec![path],
    };
    paths.flat_map(of_one).collect()
}

/// Prints the row of a fault that the program survives with an error. Returns 1 if it did not.
fn row(fault: &str, output: &Output, out: &Path) -> u64 {
    let (whole, partial) = inspected(out);
    let left = below(out).iter().filter(|path| is_temporary(path)).count();
    let text = String::from_utf8_lossy(&output.stderr);
    let error = text.lines().find(|line| line.contains("error"));
    let code = output.status.code();
    println!(
        "| {fault} | {} | {} | {whole} whole, {partial} partial, {left} temporary |",
        code.map_or("a signal".to_owned(), |code| code.to_string()),
        error.unwrap_or("none").replace('|', "\\|"),
    );
    u64::from(code.is_none() || partial > 0 || left > 0)
}

fn shell(text: &str, program: &Path, out: &Path) -> std::io::Result<Output> {
    std::fs::create_dir_all(out)?;
    let mut shell = Command::new("sh");
    shell
        .args(["-c", text])
        .env("PROGRAM", program)
        .env("OUT", out);
    shell.output()
}

/// Renders to a file system that is mounted with these options, which needs the rights of root.
fn mounted(fault: &str, mount: &str, program: &Path, out: &Path) -> std::io::Result<u64> {
    let out = out.join("mounted");
    let mount = format!("mount -t tmpfs -o size=64k{mount} tmpfs \"$OUT\"");
    if !shell(&mount, program, &out)?.status.success() {
        return Err(std::io::Error::other(format!(
            "{fault}: mounting needs root"
        )));
    }
    let render = "\"$PROGRAM\" render scenes/desk-lamp/desk-lamp.iv --size 600x400 --samples 1 \
                  --quiet -o \"$OUT/a.exr\"";
    let output = shell(render, program, &out)?;
    let failed = row(fault, &output, &out) + u64::from(output.status.code() != Some(2));
    shell("umount \"$OUT\"", program, &out)?;
    Ok(failed)
}

fn full_disk(program: &Path, out: &Path) -> std::io::Result<u64> {
    mounted("disk of 64 kB", "", program, out)
}

fn read_only(program: &Path, out: &Path) -> std::io::Result<u64> {
    mounted("read-only disk", ",ro", program, out)
}

fn broken_pipe(program: &Path, out: &Path) -> std::io::Result<u64> {
    let check = "{ \"$PROGRAM\" nodes; echo \"error $?\" >&2; } | head -n 1 >/dev/null";
    let output = shell(check, program, out)?;
    // The second line has the exit code of the program, which is 0.
    let quiet = String::from_utf8_lossy(&output.stderr).trim() == "error 0";
    Ok(row("reader that ends early", &output, out) + u64::from(!quiet))
}

fn little_memory(program: &Path, out: &Path) -> std::io::Result<u64> {
    let render = "ulimit -v 1000000; exec \"$PROGRAM\" render scenes/desk-lamp/desk-lamp.iv \
                  --size 20000x20000 --threads 1 --samples 1 --quiet -o \"$OUT/a.jpg\"";
    let output = shell(render, program, out)?;
    Ok(row("1 GB for a film of 42 GB", &output, out) + u64::from(output.status.code() != Some(2)))
}

/// Lets one system call on the way of a picture to the disk fail with EIO, by `strace`: one of 40
/// writes, or a call that comes after the last one. `strace` counts the calls of each thread, so
/// the first write would be the error message too. The film that is kept must be whole.
fn disk_errors(program: &Path, out: &Path) -> std::io::Result<u64> {
    let out = out.join("errors");
    if !shell("strace -V", program, &out)?.status.success() {
        return Err(std::io::Error::other("EIO: needs strace"));
    }
    let writes = (2..=41).map(|nth| format!("write:error=EIO:when={nth}"));
    let others = ["fdatasync", "rename"].map(|call| format!("{call}:error=EIO"));
    let (mut instants, mut errors, mut wrong) = (0, 0, 0);
    for inject in writes.chain(others) {
        let _ = std::fs::remove_dir_all(&out);
        let render = format!(
            "mkdir \"$OUT/kept\"; TMPDIR=\"$OUT/kept\" strace -f -qq -o /dev/null \
             -e trace=write,fdatasync,rename -e inject={inject} \"$PROGRAM\" render {SCENE} \
             --size 600x400 --samples 1 --lens none --shading flat --threads 1 --quiet \
             -o \"$OUT/a.exr\""
        );
        let output = shell(&render, program, &out)?;
        let left = below(&out);
        let kept = left
            .iter()
            .filter(|path| path.starts_with(out.join("kept")));
        let is_true = match output.status.code() {
            Some(0) => left.len() == 1,
            Some(2) => left.len() == kept.count() && !output.stderr.is_empty(),
            _ => false,
        };
        let is_true = is_true && left.iter().all(|path| is_whole(path));
        instants += 1;
        errors += u64::from(output.status.code() == Some(2));
        wrong += u64::from(!is_true);
    }
    println!(
        "| EIO at one of {instants} system calls | 2 at {errors} of them, else 0 | I/O error | \
         {wrong} partial, left over or without a message |"
    );
    Ok(wrong)
}

fn two_at_once(program: &Path, out: &Path) -> std::io::Result<u64> {
    let mut failed = 0;
    for _ in 0..20 {
        let render = |size| {
            let words = format!("render SCENE --size {size} --samples 1 -o OUT/two.png");
            command(program, &words, out).spawn()
        };
        std::fs::create_dir_all(out)?;
        let mut both = [render("300x200")?, render("320x200")?];
        let ends: Vec<_> = both.iter_mut().map(Child::wait).collect();
        let good = ends.into_iter().flatten().filter(|end| end.success());
        failed += u64::from(good.count() != 2 || inspected(out).1 > 0);
        std::thread::sleep(Duration::from_millis(1));
    }
    println!("| two renders to one file, 20 times | 0 and 0 | none | {failed} times not whole |");
    Ok(failed)
}
