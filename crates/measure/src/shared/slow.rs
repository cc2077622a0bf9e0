//! Measures scenes of which many renderers are slow: lines, spheres, lights, text, patches, panes.

use std::fmt::Write as _;
use std::process::{Command, ExitCode};

use ivcam::photo::{Plan, Session};
use ivcam_optics::sampling::{Filter, Sampler, mix, unit};
use ivcam_render::render::{Exposure, Stop};

use super::pictures::{
    ball_nodes, one_thread, opened, peak_kilobytes, plan_of, thread_seconds, written,
};

const LIT: &str = "PointLight { location 3 5 6 }\n";
/// The most pictures of a scene, of which the fastest counts.
const ROUNDS: usize = 3;
/// The seconds of rendering after which no further picture of a scene is taken.
const ENOUGH: f64 = 2.0;

/// A scene that may be slow.
struct Case {
    name: &'static str,
    nodes: fn() -> String,
    /// The samples per pixel, or the most of them if the plan states an error.
    samples: u32,
    change: fn(&mut Plan),
}

const fn case(
    name: &'static str,
    nodes: fn() -> String,
    samples: u32,
    change: fn(&mut Plan),
) -> Case {
    Case {
        name,
        nodes,
        samples,
        change,
    }
}

const CASES: [Case; 9] = [
    case(
        "20,000 triangles, for comparison",
        || ball(20_000),
        64,
        |_| (),
    ),
    case(
        "the same, Mitchell's filter",
        || ball(20_000),
        64,
        |plan| {
            plan.filter = Filter::Mitchell;
        },
    ),
    case("1,000,000 triangles", || ball(1_000_000), 64, |_| ()),
    case("20,000 spheres", spheres, 64, |_| ()),
    case("10,000 long lines", lines, 64, |_| ()),
    case("1,000 point lights, to .06", lights, 4096, |plan| {
        plan.stop.error = Some(0.06);
    }),
    case("2,000 lines of Text3", text, 64, |_| ()),
    case("100 NURBS patches", patches, 64, |_| ()),
    case("20 transparent panes", panes, 4, |plan| {
        plan.max_depth = Some(64)
    }),
];

/// Returns a number from -1 to 1 for each index.
fn scattered(index: usize) -> f64 {
    2.0 * unit(mix(index as u64)) - 1.0
}

/// Returns a point in a box that fills the picture.
fn place(index: usize) -> String {
    let [x, y, z] = [0, 1, 2].map(|axis| scattered(3 * index + axis));
    format!("{:.4} {:.4} {:.4}", 3.4 * x, 2.2 * y, z)
}

fn ball(triangles: usize) -> String {
    LIT.to_owned() + &ball_nodes(triangles)
}

fn spheres() -> String {
    let sphere = |i: usize| {
        let place = place(i);
        format!("Separator {{ Translation {{ translation {place} }} Sphere {{ radius .03 }} }}\n")
    };
    LIT.to_owned() + &(0..20_000).map(sphere).collect::<String>()
}

fn lines() -> String {
    let points: String = (0..20_000).map(|i| place(i) + ",\n").collect();
    format!(
        "{LIT}Coordinate3 {{ point [ {points} ] }}\nLineSet {{ numVertices [ {} ] }}\n",
        "2,".repeat(10_000)
    )
}

fn lights() -> String {
    let light = |i: usize| {
        let [x, y, z] = [0, 1, 2].map(|axis| scattered(3 * i + axis));
        let (x, y, z) = (4.0 * x, 2.5 + y, 3.0 * z);
        format!("PointLight {{ intensity .004 location {x:.3} {y:.3} {z:.3} }}\n")
    };
    let lights: String = (0..1000).map(light).collect();
    format!(
        "{lights}Sphere {{ }} Translation {{ translation 0 -1 0 }} \
         Cube {{ width 9 depth 9 height .1 }}\n"
    )
}

/// Returns five layers of ten columns of forty lines.
fn text() -> String {
    let column = |k: usize| {
        let (x, z) = (-3.4 + 0.7 * (k % 10) as f64, -0.5 + 0.2 * (k / 10) as f64);
        let line = |line: usize| format!("\"Line {} of text\", ", 40 * k + line);
        let strings: String = (0..40).map(line).collect();
        format!(
            "Separator {{ Translation {{ translation {x} 2.2 {z} }} \
             Font {{ name \"Times-Roman\" size .11 }} Text3 {{ string [ {strings} ] parts ALL }} }}\n"
        )
    };
    LIT.to_owned() + &(0..50).map(column).collect::<String>()
}

/// Returns ten by ten patches, lit on both sides, of eight by eight control points each.
fn patches() -> String {
    let patch = |i: usize| {
        let point = |k: usize| {
            let [u, v] = [k / 8, k % 8].map(|n| n as f64);
            let x = -3.4 + 0.68 * ((i % 10) as f64 + u / 7.0);
            let y = -2.2 + 0.44 * ((i / 10) as f64 + v / 7.0);
            let z = 0.2 * libm::sin(1.3 * u + i as f64) * libm::cos(1.7 * v);
            format!("{x:.4} {y:.4} {z:.4}, ")
        };
        let points: String = (0..64).map(point).collect();
        let knots = "[ 0, 0, 0, 0, 1, 2, 3, 4, 5, 5, 5, 5 ]";
        format!(
            "Separator {{ Coordinate3 {{ point [ {points} ] }} NurbsSurface {{ numUControlPoints 8 \
             numVControlPoints 8 uKnotVector {knots} vKnotVector {knots} }} }}\n"
        )
    };
    let both_sides = "ShapeHints { vertexOrdering COUNTERCLOCKWISE }\n";
    LIT.to_owned() + both_sides + &(0..100).map(patch).collect::<String>()
}

/// Returns panes in front of the ball, over the whole picture.
fn panes() -> String {
    let pane = "Translation { translation 0 0 .08 } Cube { width 9 height 6 depth .01 }\n";
    format!(
        "{LIT}Separator {{ Translation {{ translation 0 0 1.2 }} \
         Material {{ diffuseColor .6 .7 .8 transparency .9 }} {} }}\n{}",
        pane.repeat(20),
        ball_nodes(20_000)
    )
}

/// Writes the table. Each scene has a process of its own, whose memory counts.
pub(in super::super) fn table(report: &mut String) {
    let _ = writeln!(
        report,
        "## Scenes that may be slow\n\nEach fills a picture of 180x120 through the wide-angle; \
         recursive, one light, one thread. The seconds of rendering are processor time, the least \
         of {ROUNDS} pictures or of {ENOUGH} s; those of reading and compiling, the tree included, are of the clock. *Rays* \
         are those through the scene and toward lights. Peak MB is the memory of the whole \
         process.\n\n\
         | scene | read, s | compile, s | samples | render, s | rays | ns per ray | relRMSE | peak MB |\n\
         |---|---|---|---|---|---|---|---|---|"
    );
    let Ok(program) = std::env::current_exe() else {
        return eprintln!("this program's path is unknown");
    };
    for (number, case) in CASES.iter().enumerate() {
        let light = if case.name.contains("lights") {
            ""
        } else {
            LIT
        };
        let Some(plan) = written("slow.iv", &format!("{light}{}", (case.nodes)())) else {
            return eprintln!("cannot write to the temporary folder");
        };
        let mut one = Command::new(&program);
        one.args(["speed", "--slow-case", &number.to_string()]);
        match one.arg(&plan.scene).output() {
            Ok(output) => {
                eprint!("{}", String::from_utf8_lossy(&output.stderr));
                report.push_str(&String::from_utf8_lossy(&output.stdout));
            }
            Err(error) => eprintln!("{}: {error}", case.name),
        }
    }
    report.push('\n');
}

/// Measures one case, whose number and scene file are the words, and prints its row.
pub(in super::super) fn one(words: &[String]) -> ExitCode {
    let number = words.first().and_then(|n| n.parse::<usize>().ok());
    let case = number.and_then(|n| CASES.get(n));
    let Some((case, scene)) = case.zip(words.get(1)) else {
        return ExitCode::from(2);
    };
    let mut plan = plan_of(scene);
    (case.change)(&mut plan);
    one_thread(|| match opened(plan) {
        Ok(session) => {
            row(case.name, case.samples, &session);
            ExitCode::SUCCESS
        }
        Err(error) => {
            eprintln!("{}: {}", case.name, error.message);
            ExitCode::FAILURE
        }
    })
}

fn row(name: &str, samples: u32, session: &Session) {
    let stop = Stop {
        samples,
        ..session.plan.stop
    };
    let sampler = Sampler {
        samples,
        ..session.plan.pixel_sampler()
    };
    let mut total = 0.0;
    let once = |_| -> Option<(f64, Exposure)> {
        let start = thread_seconds();
        let made = (total < ENOUGH).then(|| session.expose_with(sampler, stop, &|_| ()))?;
        let seconds = thread_seconds() - start;
        total += seconds;
        Some((seconds, made))
    };
    let all = (0..ROUNDS).map_while(once);
    let Some((seconds, made)) = all.min_by(|a, b| a.0.total_cmp(&b.0)) else {
        return;
    };
    let rays = made.counts.scene_rays + made.counts.shadow_rays;
    println!(
        "| {name} | {:.2} | {:.2} | {} | {seconds:.2} | {rays} | {:.0} | {:.3} | {:.0} |",
        session.seconds.read,
        session.seconds.compile,
        made.samples,
        1e9 * seconds / rays as f64,
        made.film.relative_rmse().unwrap_or(f64::NAN),
        peak_kilobytes().map_or(f64::NAN, |kb| kb as f64 / 1e3)
    );
}
