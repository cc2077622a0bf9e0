//! Hostile scenes: whatever draws from the account of a scene is driven to its limit, and readers
//! take work in proportion to the file.

use std::sync::Arc;
use std::time::{Duration, Instant};

use ivcam_base::diag::{Diagnostic, ErrorKind, Result};
use ivcam_base::memory::MemoryLimit;
use ivcam_base::work::{Budget, WorkLimit};
use ivcam_inventor::iv::{Document, Format, Limits, NoFiles};
use ivcam_inventor::snapshot::Snapshot;
use ivcam_optics::film::{ErrorUnknown, Resolution};

use crate::photo::{Era, LensChoice, Optics, Plan, Session};

/// Reads a scene on an account of a number of steps.
fn read(scene: &str, steps: u64) -> (Result<Document>, Budget) {
    let budget = Budget::new(1 << 30, WorkLimit(steps));
    let bytes = scene.as_bytes().to_vec();
    let read = || Document::read("a.iv", bytes, Arc::new(NoFiles), &Limits::default());
    (budget.during(read), budget)
}

/// Returns the steps that reading a scene takes.
fn steps(scene: &str) -> u64 {
    let (read, budget) = read(scene, u64::MAX);
    assert!(read.is_ok(), "{:?}", read.err());
    budget.used_steps()
}

/// Returns the plan of a small picture of a scene without a lens.
fn plan() -> Plan {
    let mut plan = Plan::of_era(Era::Modern, "a.iv");
    plan.optics = Optics::Pinhole;
    plan.resolution = Resolution::new(12, 8).unwrap();
    plan.memory = MemoryLimit::Bytes(64 << 20);
    plan
}

/// Opens a plan for the text of a scene.
fn open(plan: Plan, scene: &str) -> Result<Session> {
    let (document, _) = read(scene, u64::MAX);
    Session::with_document(plan, document?)
}

fn limits(session: &Session) -> Vec<&Diagnostic> {
    let items = session.sink.items().iter();
    items.filter(|d| d.kind == ErrorKind::Limit).collect()
}

const IV: &str = "#Inventor V2.1 ascii\n";
const VRML: &str = "#VRML V2.0 utf8\n";

/// Engines of which each makes twice the values of the one before.
fn doubling(engines: usize) -> String {
    let mut scene = format!("{IV}DEF c0 Concatenate {{ type MFFloat input0 [ 1 2 3 4 ] }}\n");
    for i in 1..=engines {
        let from = format!("[ ] = USE c{} . output", i - 1);
        scene += &format!("DEF c{i} Concatenate {{ type MFFloat input0 {from} input1 {from} }}\n");
    }
    scene + "Cube { }"
}

#[test]
fn readers_are_cut_with_the_place_and_the_option() {
    let numbers = "1 2 3 4 ".repeat(1000);
    let nodes = "Cube { } ".repeat(1000);
    let text = format!("{IV}Separator {{ Coordinate3 {{ point [ {numbers} ] }} {nodes} }}");
    let (document, _) = read(&text, u64::MAX);
    let binary = document.unwrap().write(Format::Binary);
    let proto = "PROTO a [ ] { Group { children [ Group { } Group { } ] } } ";
    let mut protos = format!("{VRML}{proto}");
    for (outer, inner) in ["b", "c", "d", "e", "f", "g", "h"]
        .iter()
        .zip(["a", "b", "c", "d", "e", "f", "g"])
    {
        protos += &format!(
            "PROTO {outer} [ ] {{ Group {{ children [ {inner} {{ }} {inner} {{ }} ] }} }} "
        );
    }
    for scene in [text.into_bytes(), binary, (protos + "h { }").into_bytes()] {
        let budget = Budget::new(1 << 30, WorkLimit(20_000));
        let read = || Document::read("a.iv", scene, Arc::new(NoFiles), &Limits::default());
        let error = budget.during(read).expect_err("it is cut");
        assert_eq!(error.message, "the scene takes more than 20k steps of work");
        assert_eq!(error.kind, ErrorKind::Limit);
        assert!(error.place.is_some() && error.help.unwrap_or_default().contains("`--work N`"));
    }
}

/// Takes a snapshot of a scene on an account; returns the messages of its engines.
fn evaluated(scene: &str, bytes: u64, steps: u64) -> Vec<Diagnostic> {
    let (document, _) = read(scene, u64::MAX);
    let document = document.unwrap();
    let budget = Budget::new(bytes, WorkLimit(steps));
    budget.during(|| Snapshot::at(&document, 0.0).diagnostics().to_vec())
}

#[test]
fn engines_that_double_their_values_are_cut_by_memory_and_by_work() {
    let scene = doubling(40);
    for (bytes, steps, text) in [
        (
            1 << 26,
            1 << 40,
            "the scene's values need more than 64 MB of memory",
        ),
        (
            1 << 40,
            50_000,
            "the scene takes more than 50k steps of work",
        ),
    ] {
        let said = evaluated(&scene, bytes, steps);
        assert_eq!(said.len(), 1, "{said:?}");
        assert_eq!(said[0].message, format!("{text}; the rest is left out"));
        assert!(said[0].place.is_some() && said[0].help.is_some());
        assert_eq!(said[0].kind, ErrorKind::Limit);
    }
    // Few engines have the values that they ought to have.
    assert!(evaluated(&doubling(10), 1 << 26, 1 << 40).is_empty());
}

#[test]
fn a_calculator_and_a_walk_are_cut() {
    let values = "1 ".repeat(5000);
    let calculator = format!(
        "{IV}DEF c Calculator {{ a [ {values} ] expression \"oa = a * 2 + sin(a)\" }}
         Coordinate3 {{ point [ 0 0 0 ] }} Scale {{ scaleFactor 1 1 1 = USE c . oA }} Cube {{ }}"
    );
    let walk = format!(
        "{IV}DEF a Group {{ {} }} USE a USE a",
        "Cube { } ".repeat(300)
    );
    let text = "the scene takes more than 20k steps of work; the rest is left out";
    let said = evaluated(&calculator, 1 << 30, 20_000);
    assert!(said.iter().any(|d| d.message == text), "{said:?}");
    let mut plan = plan();
    plan.work = WorkLimit(20_000);
    let session = open(plan, &walk).expect("it opens");
    let said = limits(&session);
    assert_eq!(said.len(), 1, "{:?}", session.sink.items());
    assert_eq!(said[0].message, text);
}

#[test]
fn a_ray_among_overlapping_parts_is_cut_with_the_same_bits_at_any_number_of_threads() {
    let scene = format!(
        "{IV}PerspectiveCamera {{ position 3 3 30 heightAngle 1 }} DirectionalLight {{ }}
         Array {{ numElements1 40 numElements2 40 numElements3 40 separation1 .3 .1 0
           separation2 0 .37 .05 separation3 .01 0 .29
         Array {{ numElements1 40 numElements2 40 numElements3 40 separation1 .31 0 .02
           separation2 0 .3 0 separation3 0 .04 .3 Sphere {{ radius 3 }} }} }}"
    );
    let mut plan = plan();
    plan.work = WorkLimit(1 << 28);
    let session = open(plan, &scene).expect("it opens");
    let pictures = [1, 3].map(|threads| {
        let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build();
        let exposure = pool.unwrap().install(|| session.expose(&|_| {}));
        assert!(matches!(
            exposure.film.error(),
            Err(ErrorUnknown::CutRays { .. })
        ));
        let levels = exposure
            .film
            .pixels
            .iter()
            .map(|p| p.mean.to_array().map(f64::to_bits));
        levels.collect::<Vec<_>>()
    });
    assert_eq!(pictures[0], pictures[1]);
    let warning = session.scene.warn_of_cut_rays().expect("rays were cut");
    assert!(
        warning.message.contains("more than 1024 steps"),
        "{}",
        warning.message
    );
    assert!(warning.place.is_some());
}

#[test]
fn copies_of_opaque_parts_at_one_place_are_drawn_once() {
    let mut twelve = format!("{IV}DEF a0 Separator {{ Cube {{ }} }}\n");
    for i in 1..12 {
        let uses = format!("USE a{} ", i - 1).repeat(10);
        twelve += &format!("DEF a{i} Separator {{ {uses} }}\n");
    }
    let side = "numElements1 200 numElements2 200 numElements3 200";
    let arrays = format!("{IV}Array {{ {side} Array {{ {side} Array {{ {side} Cube {{ }} }} }} }}");
    for scene in [twelve, arrays] {
        let session = open(plan(), &scene).expect("it opens");
        let exposure = session.expose(&|_| {});
        assert_eq!(session.scene.cut_rays(), 0, "{scene:.60}");
        assert!(exposure.film.mean() > 0.01);
    }
}

#[test]
fn a_lens_of_a_thousand_surfaces_is_traced_or_refused() {
    let row = "50 .1 1.5 60 20\n-50 .1 1 0 20\n";
    let folder = super::common::Folder::new("rows");
    let file = folder.file("rows.dat", &format!("# rows\n{}", row.repeat(500)));
    let mut plan = plan();
    plan.optics = Optics::Lens(LensChoice::named(file));
    plan.work = WorkLimit(1_000_000);
    let error = open(plan, &format!("{IV}Cube {{ }}"))
        .err()
        .expect("it is refused");
    assert!(
        error
            .message
            .contains("1000 surfaces, takes more than 1M steps"),
        "{}",
        error.message
    );
    assert_eq!(error.kind, ErrorKind::Limit);
}

#[test]
fn a_signal_ends_the_render_of_a_hostile_scene_at_once() {
    let side = "numElements1 300 numElements2 300 numElements3 300";
    let scene = format!(
        "{IV}PerspectiveCamera {{ position 3 3 300 }} DirectionalLight {{ }}
         Array {{ {side} separation1 .3 .1 0 separation2 0 .37 .05 separation3 .01 0 .29
         Array {{ {side} separation1 .31 0 .02 separation2 0 .3 0 separation3 0 .04 .3
         Sphere {{ radius 30 }} }} }}"
    );
    let mut plan = plan();
    plan.work = WorkLimit(1 << 50);
    let session = open(plan, &scene).expect("it opens");
    let stop = session.budget.stop().clone();
    let start = Instant::now();
    let _timer = stop.after(Duration::from_millis(200));
    let exposure = session.expose(&|_| {});
    assert!(exposure.stopped.is_some() && start.elapsed() < Duration::from_secs(2));
}

/// Rules of the grammar, each as a scene of some size. The work of reading twice as much is about
/// twice as much.
#[test]
fn readers_take_work_in_proportion_to_the_file() {
    let many = |n: usize, item: &dyn Fn(usize) -> String| (0..n).map(item).collect::<String>();
    let rules: [(&str, &dyn Fn(usize) -> String); 12] = [
        ("declared fields", &|n| {
            format!(
                "{IV}A {{ fields [ {} ] }}",
                many(n, &|i| format!("SFFloat f{i} "))
            )
        }),
        ("stated fields of a declared class", &|n| {
            let fields = many(n, &|i| format!("SFFloat f{i} "));
            format!(
                "{IV}A {{ fields [ {fields} ] {} }}",
                many(n, &|i| format!("f{i} 1 "))
            )
        }),
        ("an interface with links", &|n| {
            let interface = many(n, &|i| format!("field SFFloat f{i} 1 "));
            let body = many(n, &|i| format!("Cone {{ height IS f{i} }} "));
            format!("{VRML}PROTO a [ {interface} ] {{ Group {{ children [ {body} ] }} }} a {{ }}")
        }),
        ("a chain of links", &|n| {
            let first = "PROTO p0 [ field SFFloat r 1 ] { Cone { height IS r } } ";
            let link = |i: usize| {
                format!(
                    "PROTO p{} [ field SFFloat r 1 ] {{ p{i} {{ r IS r }} }} ",
                    i + 1
                )
            };
            format!("{VRML}{first}{} p{n} {{ }}", many(n, &link))
        }),
        ("names inside each other", &|n| {
            let open = "DEF a Group { ".repeat(n);
            format!("{IV}{open}{}{}", "USE a ".repeat(n), "} ".repeat(n))
        }),
        ("uses of one node", &|n| {
            format!("{IV}DEF a Cube {{ }} {}", "USE a ".repeat(n))
        }),
        ("names that are new", &|n| {
            format!(
                "{IV}{}",
                many(n, &|i| format!("DEF n{i} Cube {{ }} USE n{i} "))
            )
        }),
        ("numbers", &|n| {
            format!("{IV}Coordinate3 {{ point [ {} ] }}", "1 2 3, ".repeat(n))
        }),
        ("strings", &|n| {
            format!("{IV}Label {{ label \"{}\" }}", "a b ".repeat(n))
        }),
        ("unknown fields", &|n| {
            format!("{IV}Cube {{ {} }}", many(n, &|i| format!("f{i} 1 ")))
        }),
        ("a script's interface", &|n| {
            format!(
                "{VRML}Script {{ {} }}",
                many(n, &|i| format!("field SFFloat f{i} 1 "))
            )
        }),
        ("routes", &|n| {
            let route = "ROUTE a.translation TO b.translation ";
            format!(
                "{VRML}DEF a Transform {{ }} DEF b Transform {{ }} {}",
                route.repeat(n)
            )
        }),
    ];
    for (rule, scene) in rules {
        let [once, twice] = [1000, 2000].map(|n| steps(&scene(n)));
        let ratio = twice as f64 / once as f64;
        assert!(
            (1.8..2.3).contains(&ratio),
            "{rule}: {once} and {twice} steps"
        );
    }
}
