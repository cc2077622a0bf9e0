//! Pictures by processes that `mpirun` starts: `cargo test --features mpi --test mpi`.

use std::path::{Path, PathBuf};
use std::process::{Command, Output};

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

/// The values of all channels of an EXR file, by name. Its attributes name the command.
fn pixels(path: &Path) -> Vec<(String, Vec<f32>)> {
    let read = exr::prelude::read_first_flat_layer_from_file(path).expect("a picture");
    let channels = read.layer_data.channel_data.list.iter();
    let channel = |c: &exr::prelude::AnyChannel<exr::prelude::FlatSamples>| {
        (c.name.to_string(), c.sample_data.values_as_f32().collect())
    };
    channels.map(channel).collect()
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
