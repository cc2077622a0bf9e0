//! Ends commands at random moments, by `--time` and by signals, and measures how long they go on.
//!
//! `cargo run --release -p measure -- stops PROGRAM [--moments N] [--only NAME]`, from the folder
//! of the repository.
//!
//! The moments are spread over the time that a command takes, or over its first ten seconds. A
//! third of them is the time of `--time`, the others are SIGTERM and SIGINT. A delay is the clock's
//! from the moment to the end of the process; the processor seconds after it tell what part of the
//! delay other programs cause. The exit code is 1 if a delay is above 1 s.

use std::fmt::Write as _;
use std::path::{Path, PathBuf};
use std::process::{Child, Command, ExitCode, Stdio};
use std::time::{Duration, Instant};

use ivcam_optics::sampling::{mix, unit};

use super::hostile::processor_seconds;
use super::shared::words::value_of;

/// The longest time in which moments are chosen.
const SPAN: Duration = Duration::from_secs(10);
/// The time after a moment at which a command is killed.
const PATIENCE: Duration = Duration::from_secs(30);
/// The greatest delay that is no failure.
const DELAY: Duration = Duration::from_secs(1);
/// The ways to end a command.
const WAYS: [&str; 3] = ["--time", "SIGTERM", "SIGINT"];

/// A command that takes long.
struct Case {
    name: &'static str,
    /// The arguments, separated by spaces. `SCENE` is a scene, and `OUT` is a folder for outputs.
    words: &'static str,
    /// Writes the scene and what it needs into a folder, and returns the scene's text. No text
    /// stands for a scene of the repository.
    scene: fn(&Path) -> std::io::Result<Option<String>>,
}

const RENDER: &str = "render SCENE --lens none --size 96x64 --samples 4096 --quiet -o OUT/a.png";

const CASES: [Case; 10] = [
    Case {
        name: "a lens of 1,000 surfaces",
        words: "render SCENE --lens OUT/lens.dat --work 1T --size 96x64 --quiet -o OUT/a.png",
        scene: |folder| {
            let rows = "50 0.1 1.5 60 20\n-50 0.1 1 0 20\n".repeat(500);
            std::fs::write(folder.join("lens.dat"), format!("# lens\n{rows}"))?;
            inventor("Cube { }")
        },
    },
    Case {
        name: "arrays inside each other",
        words: RENDER,
        scene: |_| {
            let side = "numElements1 200 numElements2 200 numElements3 200 separation1 .3 .1 0";
            let open = format!("Array {{ {side} ").repeat(3);
            inventor(&format!("{open} Sphere {{ }} }} }} }}"))
        },
    },
    Case {
        name: "3 million triangles at one place",
        words: RENDER,
        scene: |_| {
            let faces = "0,1,2,-1,".repeat(3_000_000);
            let points = "Coordinate3 { point [ 0 0 0, 1 0 0, 0 1 0 ] }";
            inventor(&format!(
                "{points} IndexedFaceSet {{ coordIndex [ {faces} ] }}"
            ))
        },
    },
    Case {
        name: "textures of 16384 × 16384",
        words: RENDER,
        scene: |folder| {
            let picture = image::GrayImage::new(16384, 16384);
            let mut text = String::new();
            for i in 0..4 {
                let file = folder.join(format!("t{i}.png"));
                picture.save(file).map_err(std::io::Error::other)?;
                let _ = write!(text, "Texture2 {{ filename \"t{i}.png\" }} Cube {{ }} ");
            }
            inventor(&text)
        },
    },
    Case {
        name: "10 million points",
        words: RENDER,
        scene: |_| {
            let points = "1 2 3,".repeat(10_000_000);
            inventor(&format!(
                "Coordinate3 {{ point [ {points} ] }} PointSet {{ }}"
            ))
        },
    },
    Case {
        name: "200 endless scripts",
        words: "render SCENE --lens none --work 1T --size 96x64 --quiet -o OUT/a.png",
        scene: |_| {
            let script = "Script { url \"javascript: for(;;);\" } ".repeat(200);
            Ok(Some(format!("#VRML V2.0 utf8\n{script}\n")))
        },
    },
    Case {
        name: "diffraction on 2000 × 1500 pixels",
        words: "render SCENE --lens double-gauss --aperture f/16 --diffraction on --samples 1 \
                --size 2000x1500 --quiet -o OUT/a.png",
        scene: |_| inventor("Cube { }"),
    },
    Case {
        name: "ghosts",
        words: "render SCENE --lens double-gauss --ghosts on --samples 256 --size 96x64 --quiet \
                -o OUT/a.png",
        scene: |_| inventor("PointLight { location 2 2 -3 } Cube { }"),
    },
    Case {
        name: "a desk lamp",
        words: "render SCENE --adaptive --samples 4096 --size 192x128 --quiet -o OUT/a.png",
        scene: |_| Ok(None),
    },
    Case {
        name: "conversion of 3 million triangles",
        words: "convert SCENE -o OUT/a.obj",
        scene: |_| {
            let faces = "0,1,2,-1,".repeat(3_000_000);
            let points = "Coordinate3 { point [ 0 0 0, 1 0 0, 0 1 0 ] }";
            inventor(&format!(
                "{points} IndexedFaceSet {{ coordIndex [ {faces} ] }}"
            ))
        },
    },
];

fn inventor(text: &str) -> std::io::Result<Option<String>> {
    Ok(Some(format!("#Inventor V2.1 ascii\n{text}\n")))
}

/// What a command did after a moment.
#[derive(Clone, Copy, Default)]
struct Delay {
    clock: Duration,
    /// The processor seconds after the moment.
    processor: f64,
}

pub(crate) fn run(words: Vec<String>) -> ExitCode {
    let Some(program) = words.first().map(PathBuf::from) else {
        return crate::usage("stops");
    };
    let value = |name: &str| value_of(name, &words);
    let moments = value("--moments").and_then(|word| word.parse().ok());
    let folder = std::env::temp_dir().join(format!("ivcam-stops-{}", std::process::id()));
    println!(
        "| command | takes, s | moments | `--time`: delay, s | SIGTERM | SIGINT | processor, s |\n\
         |---|---|---|---|---|---|---|"
    );
    let mut failed = false;
    for case in &CASES {
        if value("--only").is_some_and(|only| !case.name.contains(only.as_str())) {
            continue;
        }
        match ended(&program, case, moments.unwrap_or(60), &folder) {
            Ok(is_late) => failed |= is_late,
            Err(error) => {
                eprintln!("{}: {error}", case.name);
                failed = true;
            }
        }
        let _ = std::fs::remove_dir_all(&folder);
    }
    ExitCode::from(u8::from(failed))
}

/// Ends a command at some moments and prints a row. Returns whether a delay is too long.
fn ended(program: &Path, case: &Case, moments: u64, folder: &Path) -> std::io::Result<bool> {
    std::fs::create_dir_all(folder)?;
    let scene = match (case.scene)(folder)? {
        None => PathBuf::from("scenes/desk-lamp/desk-lamp.iv"),
        Some(text) => {
            let scene = folder.join("scene.iv");
            std::fs::write(&scene, text)?;
            scene
        }
    };
    let command = |time: Option<Duration>| {
        let mut command = Command::new(program);
        let place = |word: &str| {
            let word = word.replace("SCENE", &scene.to_string_lossy());
            word.replace("OUT", &folder.to_string_lossy())
        };
        command.args(case.words.split_whitespace().map(place));
        if let Some(time) = time {
            command.args(["--time", &format!("{}s", time.as_secs_f64())]);
        }
        command.stdout(Stdio::null()).stderr(Stdio::null());
        command
    };
    let start = Instant::now();
    let mut child = command(None).spawn()?;
    while start.elapsed() < SPAN && child.try_wait()?.is_none() {
        std::thread::sleep(Duration::from_millis(5));
    }
    let whole_run = start.elapsed();
    end(&mut child)?;
    let mut worst = [Delay::default(); WAYS.len()];
    for number in 0..moments {
        let moment = whole_run
            .mul_f64(unit(mix(number)))
            .max(Duration::from_millis(50));
        let way = number as usize % WAYS.len();
        let start = Instant::now();
        let mut child = command((way == 0).then_some(moment)).spawn()?;
        let delay = delay(&mut child, start + moment, WAYS[way])?;
        worst[way].clock = worst[way].clock.max(delay.clock);
        worst[way].processor = worst[way].processor.max(delay.processor);
    }
    let [time, term, int] = worst.map(|delay| delay.clock.as_secs_f64());
    let processor = worst
        .iter()
        .map(|delay| delay.processor)
        .fold(0.0, f64::max);
    println!(
        "| {} | {:.1} | {moments} | {time:.2} | {term:.2} | {int:.2} | {processor:.2} |",
        case.name,
        whole_run.as_secs_f64(),
    );
    Ok(worst.iter().any(|delay| delay.clock > DELAY))
}

/// Ends a process in a way at a moment, and measures how long it goes on. One that has ended before
/// has no delay.
fn delay(child: &mut Child, moment: Instant, way: &str) -> std::io::Result<Delay> {
    let stat = format!("/proc/{}/stat", child.id());
    while Instant::now() < moment {
        if child.try_wait()?.is_some() {
            return Ok(Delay::default());
        }
        std::thread::sleep(Duration::from_millis(2));
    }
    let before = processor_seconds(&stat).unwrap_or_default();
    let mut after = before;
    if let Some(signal) = way.strip_prefix("SIG") {
        let mut kill = Command::new("kill");
        kill.args(["-s", signal, &child.id().to_string()]);
        kill.stderr(Stdio::null()).status()?;
    }
    while moment.elapsed() < PATIENCE && child.try_wait()?.is_none() {
        after = after.max(processor_seconds(&stat).unwrap_or_default());
        std::thread::sleep(Duration::from_millis(2));
    }
    let clock = moment.elapsed();
    end(child)?;
    Ok(Delay {
        clock,
        processor: after - before,
    })
}

/// Kills a process that still runs, and waits for it.
fn end(child: &mut Child) -> std::io::Result<()> {
    if child.try_wait()?.is_none() {
        child.kill()?;
    }
    child.wait().map(|_| ())
}
