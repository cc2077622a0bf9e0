//! Renders and checks hostile scenes of its own with 2 GB of memory and 5 s of processor time each.
//!
//! `cargo run --release -p measure -- hostile PROGRAM [--all] [--only NAME]`
//!
//! A row has the bytes of the scene, the processor seconds and the seconds of the clock of the
//! slower command, the most memory that either had, and the first message. Without `--all` only the
//! largest scene of each kind is listed; all are run. The exit code is 1 if a command takes more
//! processor time, needs more memory, or ends by a signal. The clock alone is no failure, because
//! other programs may keep the processors busy.

use std::fmt::Write;
use std::path::{Path, PathBuf};
use std::process::{Command, ExitCode, Stdio};
use std::time::{Duration, Instant};

use super::shared::pictures::peak_kilobytes_of;
use super::shared::words::value_of;

/// The memory that a command may use, in kilobytes.
const KILOBYTES: u64 = 2 << 20;
/// The processor time that a command may use, in seconds.
const PROCESSOR: f64 = 5.0;
/// The time of the clock after which a command is ended, as one that waits for ever.
const CLOCK: Duration = Duration::from_secs(60);
/// The processor time unit of `/proc`, in seconds.
const TICK: f64 = 0.01;

/// A kind of hostile scene: its name, its sizes, and its text by size.
type Kind = (&'static str, [usize; 4], fn(usize) -> String);

fn iv(text: &str) -> String {
    format!("#Inventor V2.1 ascii\n{text}\n")
}

fn vrml(text: &str) -> String {
    format!("#VRML V2.0 utf8\n{text}\n")
}

fn many(n: usize, item: impl Fn(usize) -> String) -> String {
    (0..n).fold(String::new(), |mut all, i| {
        let _ = write!(all, "{} ", item(i));
        all
    })
}

/// Arrays inside each other, each of 200 copies along three axes.
fn arrays(depth: usize, steps: &str, inside: &str) -> String {
    let side = "numElements1 200 numElements2 200 numElements3 200";
    let open = many(depth, |_| format!("Array {{ {side} {steps}"));
    iv(&format!(
        "DirectionalLight {{ }} {open} {inside} {}",
        "} ".repeat(depth)
    ))
}

/// Separators that each use the one before ten times.
fn uses(depth: usize, inside: &str, between: &str) -> String {
    let uses = |i: usize| format!("USE a{i} {between} ").repeat(10);
    let levels = many(depth, |i| {
        format!("DEF a{} Separator {{ {} }}", i + 1, uses(i))
    });
    iv(&format!("DEF a0 Separator {{ {inside} }} {levels}"))
}

fn concatenated(engines: usize, kind: &str, first: &str) -> String {
    let engine = |i: usize| {
        let from = format!("[ ] = USE c{i} . output");
        let next = i + 1;
        format!("DEF c{next} Concatenate {{ type {kind} input0 {from} input1 {from} }}")
    };
    let first = format!("DEF c0 Concatenate {{ type {kind} input0 [ {first} ] }}");
    iv(&format!("{first} {} Cube {{ }}", many(engines, engine)))
}

fn scripts(n: usize, program: &str) -> String {
    vrml(&many(n, |_| {
        format!("Script {{ url \"javascript: {program}\" }}")
    }))
}

fn shape(geometry: &str) -> String {
    format!("Shape {{ appearance Appearance {{ material Material {{ }} }} geometry {geometry} }}")
}

const UNEVEN: &str = "separation1 .3 .1 0 separation2 0 .37 .05 separation3 .01 0 .29";
const CLEAR: &str = "Material { transparency .5 } Cube { }";

const KINDS: [Kind; 52] = [
    ("arrays inside each other", [1, 2, 3, 5], |n| {
        arrays(n, "", "Cube { }")
    }),
    ("uneven arrays", [1, 2, 3, 4], |n| {
        arrays(n, UNEVEN, "Sphere { radius 3 }")
    }),
    ("transparent arrays", [1, 2, 3, 4], |n| arrays(n, "", CLEAR)),
    ("arrays without a step", [1, 2, 3, 4], |n| {
        let none = "separation1 0 0 0 separation2 0 0 0 separation3 0 0 0";
        arrays(n, none, "Sphere { }")
    }),
    ("uses inside each other", [4, 8, 12, 30], |n| {
        uses(n, "Cube { }", "")
    }),
    ("moved uses", [4, 6, 8, 12], |n| {
        uses(n, "Sphere { }", "Translation { translation .01 0 0 }")
    }),
    ("transparent uses", [4, 6, 8, 12], |n| uses(n, CLEAR, "")),
    ("copies by matrices", [2, 3, 4, 6], |n| {
        let matrix = "1 0 0 0 0 1 0 0 0 0 1 0 0 0 0 1, ".repeat(100);
        let open = format!("MultipleCopy {{ matrix [ {matrix} ] ").repeat(n);
        iv(&format!("{open} Cube {{ }} {}", "} ".repeat(n)))
    }),
    (
        "lists joined to twice their length",
        [10, 20, 30, 60],
        |n| concatenated(n, "MFFloat", "1 2 3 4"),
    ),
    (
        "strings joined to twice their number",
        [10, 16, 24, 60],
        |n| concatenated(n, "MFString", &format!("\"{}\"", "x".repeat(1000))),
    ),
    ("matrices joined", [10, 20, 30, 60], |n| {
        concatenated(n, "MFMatrix", "1 0 0 0 0 1 0 0 0 0 1 0 0 0 0 1")
    }),
    (
        "a calculator of many values",
        [1000, 10_000, 100_000, 400_000],
        |n| {
            let values = "1 ".repeat(n);
            let terms = "+ sin(a) * cos(a)".repeat(100);
            iv(&format!(
                "DEF c Calculator {{ a [ {values} ] expression \"oa = a {terms}\" }}
             Coordinate3 {{ point [ ] = USE c . oA }} Cube {{ }}"
            ))
        },
    ),
    ("declared fields", [1000, 25_000, 100_000, 400_000], |n| {
        iv(&format!(
            "A {{ fields [ {} ] }}",
            many(n, |i| format!("SFFloat f{i}"))
        ))
    }),
    ("stated fields", [1000, 5000, 20_000, 100_000], |n| {
        let fields = many(n, |i| format!("SFFloat f{i}"));
        iv(&format!(
            "A {{ fields [ {fields} ] {} }}",
            many(n, |i| format!("f{i} 1"))
        ))
    }),
    ("a chain of prototypes", [100, 1000, 10_000, 40_000], |n| {
        let link = |i: usize| {
            format!(
                "PROTO p{} [ field SFFloat r 1 ] {{ p{i} {{ r IS r }} }}",
                i + 1
            )
        };
        let first = "PROTO p0 [ field SFFloat r 1 ] { Cone { height IS r } }";
        vrml(&format!("{first} {} p{n} {{ }}", many(n, link)))
    }),
    ("prototypes that double", [10, 20, 30, 60], |n| {
        let two = |i: usize| {
            format!(
                "PROTO p{} [ ] {{ Group {{ children [ p{i} {{ }} p{i} {{ }} ] }} }}",
                i + 1
            )
        };
        vrml(&format!(
            "PROTO p0 [ ] {{ Group {{ }} }} {} p{n} {{ }}",
            many(n, two)
        ))
    }),
    (
        "an interface with links",
        [1000, 4000, 20_000, 100_000],
        |n| {
            let interface = many(n, |i| format!("field SFFloat f{i} 1"));
            let body = many(n, |i| format!("Cone {{ height IS f{i} }}"));
            vrml(&format!(
                "PROTO a [ {interface} ] {{ Group {{ children [ {body} ] }} }} a {{ }}"
            ))
        },
    ),
    (
        "names inside each other",
        [100, 1000, 20_000, 100_000],
        |n| {
            let open = "DEF a Group { ".repeat(n);
            iv(&format!("{open}{}{}", "USE a ".repeat(n), "} ".repeat(n)))
        },
    ),
    (
        "separators inside each other",
        [1000, 10_000, 100_000, 400_000],
        |n| {
            iv(&format!(
                "{}Cube {{ }}{}",
                "Separator { ".repeat(n),
                "} ".repeat(n)
            ))
        },
    ),
    (
        "unknown classes inside each other",
        [1000, 10_000, 100_000, 400_000],
        |n| iv(&format!("{}{}", "Foo { ".repeat(n), "} ".repeat(n))),
    ),
    ("open brackets", [1000, 10_000, 100_000, 1_000_000], |n| {
        iv(&"[ ".repeat(n))
    }),
    ("open strings", [1000, 10_000, 100_000, 1_000_000], |n| {
        iv(&"Label { string \" ".repeat(n / 8))
    }),
    ("unknown fields", [1000, 10_000, 100_000, 400_000], |n| {
        iv(&format!("Cube {{ {} }}", many(n, |i| format!("f{i} 1"))))
    }),
    ("unknown names", [1000, 10_000, 100_000, 400_000], |n| {
        iv(&many(n, |i| format!("USE n{i}")))
    }),
    ("endless scripts", [1, 20, 200, 600], |n| {
        scripts(n, "function initialize() { for (;;); }")
    }),
    (
        "scripts that never define anything",
        [1, 20, 200, 600],
        |n| scripts(n, "for (;;);"),
    ),
    ("scripts that make scripts", [1, 2, 8, 32], |n| {
        let one =
            "Browser.createVrmlFromString('Script { url \\\\\\\"javascript: ' + s + '\\\\\\\" }');";
        scripts(
            n,
            &format!(
                "var s = 'x'; function initialize() {{ for (var i = 0; i < 500; i++) {one} }}"
            ),
        )
    }),
    ("scripts with long strings", [1, 4, 20, 100], |n| {
        scripts(
            n,
            "var s = 'x'; function initialize() { for (;;) s = s + s; }",
        )
    }),
    ("scripts with long lists", [1, 4, 20, 100], |n| {
        scripts(
            n,
            "var a = []; function initialize() { for (;;) a.push([a.length]); }",
        )
    }),
    (
        "spheres at one place",
        [1000, 10_000, 100_000, 300_000],
        |n| iv(&"Sphere { } ".repeat(n)),
    ),
    (
        "clear spheres at one place",
        [100, 1000, 10_000, 100_000],
        |n| {
            iv(&format!(
                "Material {{ transparency .9 }} {}",
                "Sphere { } ".repeat(n)
            ))
        },
    ),
    (
        "triangles at one place",
        [1000, 10_000, 100_000, 1_000_000],
        |n| {
            let faces = "0 1 2 -1 ".repeat(n);
            iv(&format!(
                "Coordinate3 {{ point [ -1 -1 0, 1 -1 0, 0 1 0 ] }}
             IndexedFaceSet {{ coordIndex [ {faces} ] }}"
            ))
        },
    ),
    ("lights on cubes", [10, 100, 1000, 3000], |n| {
        let lit =
            "Group { PointLight { location 0 9 9 } Cube { } Translation { translation 3 0 0 } } ";
        iv(&lit.repeat(n))
    }),
    ("mirrors inside each other", [10, 100, 1000, 10_000], |n| {
        let ball = |i: usize| format!("Sphere {{ radius {} }}", 1.0 + i as f64 / 100.0);
        let look = "Material { specularColor 1 1 1 shininess 1 transparency .5 }";
        iv(&format!("{look} {}", many(n, ball)))
    }),
    ("a surface of a high order", [10, 50, 200, 800], |n| {
        let knots = |n: usize| format!("{}{}", "0 ".repeat(n), "1 ".repeat(n));
        let points = many(n * n, |i| format!("{} {} {},", i % n, i / n, (i * 7) % 5));
        iv(&format!(
            "Coordinate3 {{ point [ {points} ] }} NurbsSurface {{ numUControlPoints {n}
             numVControlPoints {n} uKnotVector [ {k} ] vKnotVector [ {k} ] }}",
            k = knots(n)
        ))
    }),
    ("solid text", [10, 100, 1000, 10_000], |n| {
        iv(&format!(
            "Text3 {{ parts ALL string [ {} ] }}",
            "\"hostile text\" ".repeat(n)
        ))
    }),
    ("many texts", [10, 100, 1000, 4000], |n| {
        iv(&"Text3 { parts ALL string \"hostile\" } ".repeat(n))
    }),
    ("a grid of heights", [10, 100, 500, 1000], |n| {
        let heights = many(n * n, |i| format!("{}", (i * 31) % 7));
        let size = format!("xDimension {n} zDimension {n}");
        vrml(&shape(&format!(
            "ElevationGrid {{ {size} height [ {heights} ] }}"
        )))
    }),
    ("an extrusion", [10, 100, 1000, 4000], |n| {
        let points = |w: usize| many(n, move |i| "1 ".repeat(w - 1) + &format!("{i},"));
        let (cross, spine) = (many(60, |i| format!("{i} {}", i % 7)), points(3));
        vrml(&shape(&format!(
            "Extrusion {{ crossSection [ {cross} ] spine [ {spine} ] }}"
        )))
    }),
    (
        "levels of detail inside each other",
        [10, 1000, 10_000, 100_000],
        |n| {
            iv(&format!(
                "{}Cube {{ }}{}",
                "LevelOfDetail { screenArea [ 1 ] ".repeat(n),
                "} ".repeat(n)
            ))
        },
    ),
    ("boxes of boxes", [10, 100, 200, 1000], |n| {
        let engine = "ComputeBoundingBox { node USE all }";
        let cube = |_| format!("Translation {{ translation 0 0 0 = {engine} . max }} Cube {{ }}");
        iv(&format!(
            "DEF all Separator {{ {} }} {}",
            "Cube { } ".repeat(3000),
            many(n, cube)
        ))
    }),
    ("routes in a circle", [10, 1000, 10_000, 100_000], |n| {
        let nodes = many(n, |i| format!("DEF t{i} Transform {{ }}"));
        let to = |i: usize| format!("ROUTE t{i}.translation TO t{}.translation", (i + 1) % n);
        vrml(&format!(
            "DEF c TimeSensor {{ loop TRUE }} {nodes} {}",
            many(n, to)
        ))
    }),
    (
        "an interpolator to many",
        [10, 1000, 10_000, 100_000],
        |n| {
            let keys = many(n, |i| format!("{}", i as f64 / n as f64));
            let nodes = many(n, |i| format!("DEF t{i} Transform {{ }}"));
            let to = |i: usize| format!("ROUTE p.value_changed TO t{i}.translation");
            vrml(&format!(
                "DEF c TimeSensor {{ loop TRUE }} DEF p PositionInterpolator {{ key [ {keys} ]
             keyValue [ {} ] }} ROUTE c.fraction_changed TO p.set_fraction {nodes} {}",
                "0 1 2, ".repeat(n),
                many(n, to)
            ))
        },
    ),
    ("a picture of many texels", [10, 100, 1000, 60_000], |n| {
        iv(&format!(
            "Texture2 {{ image {n} {n} 3 {} }} Cube {{ }}",
            "0xff8800 ".repeat(100_000)
        ))
    }),
    ("lines in patterns", [10, 1000, 10_000, 100_000], |n| {
        let points = many(n, |i| format!("{} {} {},", i % 97, i % 89, i % 83));
        iv(&format!(
            "DrawStyle {{ linePattern 0x5555 lineWidth 9 }} Coordinate3 {{ point [ {points} ] }}
             LineSet {{ numVertices {n} }}"
        ))
    }),
    ("points of many pixels", [10, 1000, 10_000, 100_000], |n| {
        let points = many(n, |i| format!("{} {} {},", i % 97, i % 89, i % 83));
        let style = "DrawStyle { pointSize 500 }";
        iv(&format!(
            "{style} Coordinate3 {{ point [ {points} ] }} PointSet {{ numPoints {n} }}"
        ))
    }),
    ("clear sheets", [10, 100, 1000, 20_000], |n| {
        let sheet = "Translation { translation 0 0 -.01 } Cube { depth .001 } ";
        iv(&format!(
            "Material {{ transparency .99 }} {}",
            sheet.repeat(n)
        ))
    }),
    ("clip planes", [10, 100, 1000, 20_000], |n| {
        iv(&format!(
            "{}Sphere {{ }}",
            "ClipPlane { plane 0 0 1 -1 } ".repeat(n)
        ))
    }),
    ("long numbers", [1000, 10_000, 100_000, 4_000_000], |n| {
        iv(&format!("Cube {{ width 1.{} }}", "3".repeat(n)))
    }),
    ("a node inside itself", [1, 100, 10_000, 100_000], |n| {
        iv(&format!(
            "DEF a Group {{ Cube {{ }} {} }}",
            "USE a ".repeat(n)
        ))
    }),
    ("groups used twice each", [10, 20, 59, 1000], |n| {
        let twice = |i: usize| format!("DEF g{} Group {{ USE g{i} USE g{i} }}", i + 1);
        iv(&format!("DEF g0 Group {{ Cube {{ }} }} {}", many(n, twice)))
    }),
    ("large numbers of copies", [10, 1000, 30_000, 65_000], |n| {
        let side = format!("numElements1 {n} numElements2 {n} numElements3 {n}");
        iv(&format!(
            "Array {{ {side} separation1 9 0 0 PointLight {{ }} Cube {{ }} }}"
        ))
    }),
];

/// What a command took.
struct CaseCost {
    /// The processor seconds of all its threads.
    processor: f64,
    /// The seconds of the clock.
    seconds: f64,
    megabytes: f64,
    message: String,
    /// Whether it kept its limits and ended by itself.
    is_good: bool,
}

pub(crate) fn run(words: Vec<String>) -> ExitCode {
    let Some(program) = words.first().map(PathBuf::from) else {
        return crate::usage("hostile");
    };
    let lists_all = words.iter().any(|word| word == "--all");
    let only = value_of("--only", &words);
    let folder = std::env::temp_dir().join(format!("ivcam-hostile-{}", std::process::id()));
    if let Err(error) = std::fs::create_dir_all(&folder) {
        eprintln!("{}: {error}", folder.display());
        return ExitCode::from(2);
    }
    println!(
        "| scene | size | bytes | processor, s | clock, s | MB | message |\n\
         |---|---|---|---|---|---|---|"
    );
    let (mut scenes, mut failed) = (0, 0);
    for (name, sizes, text) in KINDS
        .iter()
        .filter(|kind| only.is_none_or(|o| kind.0.contains(o)))
    {
        for size in sizes {
            let text = text(*size);
            let cost = match measured(&program, &folder, &text) {
                Ok(cost) => cost,
                Err(error) => {
                    eprintln!("{name} {size}: {error}");
                    return ExitCode::from(2);
                }
            };
            scenes += 1;
            failed += u32::from(!cost.is_good);
            if lists_all || !cost.is_good || *size == sizes[3] {
                println!(
                    "| {name} | {size} | {} | {:.1} | {:.1} | {:.0} | {} |",
                    text.len(),
                    cost.processor,
                    cost.seconds,
                    cost.megabytes,
                    cost.message
                );
            }
        }
    }
    println!("\n{scenes} scenes, {failed} beyond {PROCESSOR} s of processor time or 2 GB");
    let _ = std::fs::remove_dir_all(&folder);
    ExitCode::from(u8::from(failed > 0))
}

/// Renders and checks a scene.
fn measured(program: &Path, folder: &Path, text: &str) -> std::io::Result<CaseCost> {
    let scene = folder.join("scene.iv");
    std::fs::write(&scene, text)?;
    let picture = folder.join("picture.png");
    let words = "--lens none --size 48x32 --samples 2 --quiet -o";
    let mut render: Vec<&str> = vec!["render", "scene.iv"];
    render.extend(words.split(' '));
    let picture = picture.to_string_lossy();
    render.push(&picture);
    let render = one(program, folder, &render)?;
    let check = one(program, folder, &["check", "scene.iv"])?;
    Ok(CaseCost {
        processor: render.processor.max(check.processor),
        seconds: render.seconds.max(check.seconds),
        megabytes: render.megabytes.max(check.megabytes),
        message: if render.is_good {
            render.message
        } else {
            format!("BEYOND: {}", render.message)
        },
        is_good: render.is_good && check.is_good,
    })
}

/// Runs a command with its limits.
fn one(program: &Path, folder: &Path, words: &[&str]) -> std::io::Result<CaseCost> {
    let log = folder.join("messages");
    let limited = format!("ulimit -v {KILOBYTES}; exec \"$0\" \"$@\"");
    let start = Instant::now();
    let mut child = Command::new("sh")
        .args(["-c", &limited])
        .arg(program)
        .args(words)
        .current_dir(folder)
        .stdout(Stdio::null())
        .stderr(std::fs::File::create(&log)?)
        .spawn()?;
    let status = format!("/proc/{}/status", child.id());
    let stat = format!("/proc/{}/stat", child.id());
    let (mut peak, mut processor) = (0.0f64, 0.0f64);
    let ended = loop {
        if let Some(ended) = child.try_wait()? {
            break Some(ended);
        }
        processor = processor.max(processor_seconds(&stat).unwrap_or_default());
        if processor > PROCESSOR || start.elapsed() > CLOCK {
            child.kill()?;
            child.wait()?;
            break None;
        }
        peak = peak.max(peak_megabytes(&status).unwrap_or_default());
        std::thread::sleep(Duration::from_millis(2));
    };
    let said = String::from_utf8_lossy(&std::fs::read(&log)?).into_owned();
    let is_message = |line: &&str| {
        ["error", "warning", "damaged"]
            .iter()
            .any(|w| line.starts_with(w))
    };
    Ok(CaseCost {
        processor,
        seconds: start.elapsed().as_secs_f64(),
        megabytes: peak,
        message: said
            .lines()
            .find(is_message)
            .unwrap_or_default()
            .replace('|', "/"),
        is_good: ended.is_some_and(|ended| ended.code().is_some_and(|code| code <= 2)),
    })
}

/// Returns the processor seconds that a process has used so far, in user and in system mode.
pub(crate) fn processor_seconds(stat: &str) -> Option<f64> {
    let text = std::fs::read_to_string(stat).ok()?;
    // The name of the program is in parentheses and may have spaces.
    let mut fields = text.rsplit_once(')')?.1.split_whitespace().skip(11);
    let mut ticks = || fields.next()?.parse::<f64>().ok();
    Some(TICK * (ticks()? + ticks()?))
}

/// Returns the most memory that a process has had so far.
fn peak_megabytes(status: &str) -> Option<f64> {
    Some(peak_kilobytes_of(status)? as f64 / 1024.0)
}
