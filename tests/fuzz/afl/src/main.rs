//! Runs a fuzz target of ivcam under AFL++, writes its seeds and dictionary, or runs it on files.
//!
//! `ivcam-fuzz TARGET` runs a target under `cargo afl fuzz`, or once on the standard input.
//! `ivcam-fuzz list` prints the names of the targets. `ivcam-fuzz prepare TARGET FOLDER` writes
//! `FOLDER/seeds/` and `FOLDER/words.dict`. `ivcam-fuzz replay TARGET FILE...` runs the target on
//! files and prints the seconds that each takes.

use std::path::Path;
use std::process::ExitCode;
use std::time::Instant;

#[path = "../../mod.rs"]
mod fuzz;

use fuzz::{TARGETS, Target};

fn main() -> ExitCode {
    let words: Vec<String> = std::env::args().skip(1).collect();
    let words: Vec<&str> = words.iter().map(String::as_str).collect();
    let named = |name: &str| TARGETS.iter().find(|target| target.name == name);
    match words[..] {
        ["list"] => TARGETS.iter().for_each(|target| println!("{}", target.name)),
        ["prepare", name, folder] if named(name).is_some() => {
            let written = named(name).map(|target| prepare(target, Path::new(folder)));
            if let Some(Err(error)) = written {
                eprintln!("{folder}: {error}");
                return ExitCode::from(2);
            }
        }
        ["replay", name, ref files @ ..] if named(name).is_some() => {
            let target = named(name).expect("checked");
            for file in files {
                let bytes = std::fs::read(file).expect("the file can be read");
                let start = Instant::now();
                (target.run)(&bytes);
                println!("{file}: {:.3} s", start.elapsed().as_secs_f64());
            }
        }
        [name] if named(name).is_some() => {
            let run = named(name).expect("checked").run;
            afl::fuzz!(|bytes: &[u8]| run(bytes));
        }
        _ => {
            eprintln!("usage: ivcam-fuzz list | TARGET | prepare TARGET FOLDER | replay TARGET FILE...");
            return ExitCode::from(2);
        }
    }
    ExitCode::SUCCESS
}

/// Writes the seeds and the dictionary of a target, in AFL++'s format.
fn prepare(target: &Target, folder: &Path) -> std::io::Result<()> {
    let seeds = folder.join("seeds");
    std::fs::create_dir_all(&seeds)?;
    for (name, bytes) in (target.seeds)() {
        std::fs::write(seeds.join(name), bytes)?;
    }
    let quoted = |word: &String| {
        let escaped = |byte: u8| match byte {
            b'"' | b'\\' | 0..=31 | 127.. => format!("\\x{byte:02x}"),
            _ => char::from(byte).to_string(),
        };
        format!("\"{}\"\n", word.bytes().map(escaped).collect::<String>())
    };
    let words: String = (target.words)().iter().map(quoted).collect();
    std::fs::write(folder.join("words.dict"), words)
}
