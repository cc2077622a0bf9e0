//! Pictures by processes that `mpirun` starts: `cargo test --features mpi --test mpi`.

#[path = "common/pixels.rs"]
mod pixels;
#[path = "common/viewer.rs"]
mod viewer;

use std::path::{Path, PathBuf};
use std::process::{Command, Output};

use pixels::pixels;
use viewer::Viewer;

/// The words for `mpirun` in a container, where the user may be root and cores may be few.
const MPIRUN: [&str; 4] = [
    "--allow-run-as-root",
    "--oversubscribe",
    "--bind-to",
    "none",
];

/// Returns a folder for a test, or `None` with a line on stderr where there is no `mpirun`.
fn folder(name: &str) -> Option<PathBuf> {
    if Command::new("mpirun").arg("--version").output().is_err() {
        eprintln!("skipped: there is no mpirun");
        return None;
    }
    let folder = std::env::temp_dir().join(format!("ivcam-mpi-{name}-{}", std::process::id()));
    std::fs::create_dir_all(&folder).expect("a folder");
    Some(folder)
}

fn program() -> Command {
    Command::new(env!("CARGO_BIN_EXE_ivcam"))
}

/// Starts processes with the same arguments.
fn processes(number: usize, arguments: &[&str]) -> Output {
    let mut command = Command::new("mpirun");
    command.args(MPIRUN).args(["-n", &number.to_string()]);
    command.arg(env!("CARGO_BIN_EXE_ivcam")).args(arguments);
    command.output().expect("mpirun runs")
}

fn words<'a>(picture: &'a Path, more: &[&'a str]) -> Vec<&'a str> {
    let scene = concat!(env!("CARGO_MANIFEST_DIR"), "/scenes/desk-lamp/desk-lamp.iv");
    let output = picture.to_str().expect("a name in UTF-8");
    let mut words = vec![
        "render",
        scene,
        "--size",
        "48x32",
        "--samples",
        "8",
        "-o",
        output,
    ];
    words.extend(more);
    words
}

#[test]
fn any_number_of_processes_makes_the_same_pixels() {
    let Some(folder) = folder("same") else {
        return;
    };
    for (case, more) in [
        &["--lens", "double-gauss"][..],
        &["--lens", "double-gauss", "--adaptive", "--seed", "7"],
        &["--lens", "double-gauss", "--target-error", "10%"],
    ]
    .into_iter()
    .enumerate()
    {
        let alone = folder.join(format!("alone-{case}.exr"));
        let status = program().args(words(&alone, more)).status();
        assert!(status.expect("it runs").success());
        for (number, threads) in [(1, "1"), (2, "1"), (2, "2"), (3, "1"), (4, "2")] {
            let picture = folder.join(format!("{case}-{number}-{threads}.exr"));
            let more = [more, &["--threads", threads]].concat();
            let output = processes(number, &words(&picture, &more));
            let text = String::from_utf8_lossy(&output.stderr).into_owned();
            assert!(output.status.success(), "{text}");
            assert!(
                pixels(&picture) == pixels(&alone),
                "{case} {number} {threads}"
            );
            // One process prints.
            assert_eq!(text.matches("through the lens").count(), 1, "{text}");
        }
    }
    std::fs::remove_dir_all(folder).expect("removed");
}

/// Parts of the samples, and a checkpoint that other processes continue, on any number of
/// processes.
#[test]
fn parts_and_checkpoints_of_any_number_of_processes_have_the_bits_of_one() {
    let Some(folder) = folder("parts") else {
        return;
    };
    let file = |name: &str| folder.join(name).display().to_string();
    let alone = folder.join("alone.exr");
    let samples = ["--lens", "double-gauss", "--samples", "192"];
    let status = program().args(words(&alone, &samples)).status();
    assert!(status.expect("it runs").success());
    let mut merge = vec!["merge".to_owned(), "-o".into(), file("merged.exr")];
    for (number, threads, range) in [(1, "1", "0..64"), (2, "2", "64..128"), (3, "1", "128..192")] {
        let part = file(&format!("{range}.ckpt"));
        let more = [
            "--sample-range",
            range,
            "--threads",
            threads,
            "--checkpoint",
            &part,
        ];
        let picture = folder.join(format!("{range}.exr"));
        let output = processes(number, &words(&picture, &[&samples[..], &more].concat()));
        assert!(output.status.success(), "{output:?}");
        merge.push(part);
    }
    assert!(program().args(merge).status().expect("it runs").success());
    assert!(pixels(&folder.join("merged.exr")) == pixels(&alone));
    let checkpoint = file("grown.ckpt");
    for (number, samples) in [(2, "40"), (3, "100"), (1, "192")] {
        let more = [
            "--lens",
            "double-gauss",
            "--samples",
            samples,
            "--checkpoint",
            &checkpoint,
        ];
        let output = processes(number, &words(&folder.join("grown.exr"), &more));
        assert!(output.status.success(), "{output:?}");
    }
    assert!(pixels(&folder.join("grown.exr")) == pixels(&alone));
    std::fs::remove_dir_all(folder).expect("removed");
}

#[test]
fn a_viewer_receives_the_picture_from_one_of_the_processes() {
    let Some(folder) = folder("viewer") else {
        return;
    };
    let picture = folder.join("a.exr");
    let viewer = Viewer::start(usize::MAX);
    let output = processes(3, &words(&picture, &["--tev", &viewer.address]));
    assert!(output.status.success(), "{output:?}");
    let written = pixels(&picture);
    let shown = viewer.shown();
    assert!(picture.ends_with(&shown.name) && shown.states > 0);
    assert_eq!((shown.width, shown.height), (48, 32));
    for (pixels, name) in shown.channels() {
        let (_, values) = written.iter().find(|(n, _)| n == name).expect("a channel");
        assert!(pixels == *values);
    }
    std::fs::remove_dir_all(folder).expect("removed");
}

#[test]
fn one_message_names_an_error_and_it_ends_all_processes() {
    let Some(folder) = folder("error") else {
        return;
    };
    let picture = folder.join("none.exr");
    let output = processes(3, &words(&picture, &["--lens", "no-such-lens"]));
    let text = String::from_utf8_lossy(&output.stderr).into_owned();
    assert!(!output.status.success() && !picture.exists());
    assert_eq!(text.matches("there is no lens named").count(), 1, "{text}");
    std::fs::remove_dir_all(folder).expect("removed");
}

/// `mpirun` can start different commands together, separated by colons.
#[test]
fn processes_with_other_choices_are_refused() {
    let Some(folder) = folder("other") else {
        return;
    };
    let picture = folder.join("none.exr");
    let mut command = Command::new("mpirun");
    command
        .args(MPIRUN)
        .args(["-n", "1", env!("CARGO_BIN_EXE_ivcam")]);
    command.args(words(&picture, &["--lens", "double-gauss"]));
    command.args([":", "-n", "1", env!("CARGO_BIN_EXE_ivcam")]);
    let output = command
        .args(words(&picture, &["--lens", "telephoto"]))
        .output();
    let output = output.expect("mpirun runs");
    let text = String::from_utf8_lossy(&output.stderr).into_owned();
    assert!(!output.status.success() && !picture.exists());
    assert!(text.contains("process 1 has another lens"), "{text}");
    std::fs::remove_dir_all(folder).expect("removed");
}
