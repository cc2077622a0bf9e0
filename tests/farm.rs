//! The farm as users type it: frames that several processes divide, and bad input.

#[path = "common/scratch.rs"]
mod scratch;

use std::path::Path;
use std::process::{Command, Output};

use scratch::{Scratch, must_fail, stderr};

const SCENE: &str = "#Inventor V2.1 ascii\nPerspectiveCamera { position 0 0 5 } Cube { }\n";

/// Makes a folder with the scene.
fn cube(name: &str) -> Scratch {
    Scratch::new(&format!("farm-{name}"), "cube.iv", SCENE)
}

impl Scratch {
    /// Makes frames of a movie of six.
    fn frames(&self, more: &str) -> Output {
        self.ivcam(&format!(
            "pull-focus cube.iv --from 2 --to 4 --length 6 --size 6x4 --samples 1 --folder f {more}"
        ))
    }
}

#[test]
fn a_wrong_range_of_frames_is_refused_before_the_folder_is_made() {
    let scratch = cube("ranges");
    for (line, text) in [
        ("--frames 5-2", "goes backwards"),
        ("--frames 0-5:0", "has a step of 0"),
        ("--frames=", "empty part"),
        ("--frames 1-6", "the frames of this movie are 0 to 5"),
        ("--frames 6", "the same as `--length`"),
        ("--frames 0-1 --claim-expiry 1", "--claim-expiry"),
        ("--frames 0-1 --claim-expiry 5h", "--claim-expiry"),
    ] {
        must_fail(&scratch.frames(line), text);
        assert!(!scratch.0.join("f").exists(), "{line}");
    }
    must_fail(&scratch.ivcam("frames ."), "film.txt");
}

#[test]
fn frames_of_another_movie_and_a_folder_in_the_way_are_refused() {
    let scratch = cube("another");
    assert!(scratch.frames("--frames 0-0").status.success());
    must_fail(
        &scratch.frames("--frames 1-1 --samples 2"),
        "samples is 1 there and 2 here",
    );
    must_fail(
        &scratch.frames("--frames 1-1 --arithmetic portable"),
        "arithmetic is",
    );
    std::fs::write(scratch.0.join("cube.iv"), SCENE.replace("Cube", "Cone")).unwrap();
    must_fail(&scratch.frames("--frames 1-1"), "scene-content is");
    std::fs::write(scratch.0.join("file"), "in the way").unwrap();
    must_fail(&scratch.frames("--frames 1-1 --folder file"), "file");
}

#[test]
fn an_option_of_a_movie_is_refused_for_a_picture_and_the_other_way_around() {
    let scratch = cube("idle");
    for (option, whole, error) in [
        (
            "--chunk 7",
            "render cube.iv -o a.png",
            "does nothing with `render`",
        ),
        (
            "--parts 2",
            "pull-focus cube.iv --from 1 --to 2 -o a.mp4",
            "does nothing with `pull-focus`",
        ),
        ("--parts 2", "ivcam render cube.iv", "`ivcam` makes neither"),
    ] {
        let farm = scratch.ivcam(&format!("farm slurm -o jobs {option} -- {whole}"));
        must_fail(&farm, error);
        assert!(!scratch.0.join("jobs").exists());
    }
}

#[cfg(target_os = "linux")]
#[test]
fn the_frame_of_a_dead_process_is_made_at_once_and_one_in_work_is_listed() {
    let scratch = cube("dead");
    assert!(scratch.frames("--frames 0-3").status.success());
    let boot = std::fs::read_to_string("/proc/sys/kernel/random/boot_id").unwrap();
    let claim = |name: &str, kernel: &str| {
        let text = format!(
            r#"{{"host":"far","pid":7,"started":0,"kernel":"{kernel}","locked":true,"expires":0.1}}"#
        );
        std::fs::write(scratch.0.join("f").join(name), text).unwrap();
    };
    claim("00004.claim", boot.trim());
    claim("00005.claim", "another");
    let list = scratch.ivcam("frames --json f");
    assert_eq!(list.status.code(), Some(1));
    let text = String::from_utf8_lossy(&list.stdout).replace(char::is_whitespace, "");
    for part in [
        r#""missing":[4]"#,
        r#""in_work":[{"frame":5,"host":"far","pid":7}]"#,
        r#""is_complete":false"#,
    ] {
        assert!(text.contains(part), "{part} missing in {text}");
    }
    // The other machine's claim expires after the time that it states.
    let run = scratch.frames("--frames 0-5");
    assert!(run.status.success());
    assert!(
        stderr(&run).contains("waiting for 1 frame"),
        "{}",
        stderr(&run)
    );
    let log = std::fs::read_to_string(scratch.0.join("f/film.log")).unwrap();
    assert_eq!(log.matches("takes over").count(), 2, "{log}");
    let list = scratch.ivcam("frames f");
    assert!(list.status.success());
    assert!(String::from_utf8_lossy(&list.stdout).contains("6 frames, 6 done, 0 missing"));
    assert!(!Path::new(&scratch.0.join("f/00005.claim")).exists());
}

/// The scripts run with names that have a meaning for a shell, or begin like an option.
#[cfg(unix)]
#[test]
fn the_scripts_of_a_farm_make_the_frames_and_the_movie() {
    let scratch = cube("it's \"{{a}}\" é");
    std::fs::rename(scratch.0.join("cube.iv"), scratch.0.join("a cube's $1.iv")).unwrap();
    let ivcam = |scheduler: &str, jobs: &str, words: &[&str]| {
        let mut command = Command::new(env!("CARGO_BIN_EXE_ivcam"));
        command
            .current_dir(&scratch.0)
            .args(["farm", scheduler, "-o", jobs, "--chunk", "2", "--"]);
        command.args(words).output().unwrap()
    };
    let film = "pull-focus --from 2 --to 4 --frames 3 --size 6x4 --samples 1 --folder=-f \
                --output=-m.png";
    let mut words: Vec<&str> = film.split(' ').collect();
    words.push("a cube's $1.iv");
    for (scheduler, file) in [
        ("openjd", "job.json"),
        ("slurm", "submit.sh"),
        ("hq", "submit.py"),
        ("parallel", "run.sh"),
    ] {
        let run = ivcam(scheduler, scheduler, &words);
        assert!(run.status.success(), "{}", stderr(&run));
        assert!(
            stderr(&run).contains("2 tasks of 3 frames"),
            "{}",
            stderr(&run)
        );
        assert!(scratch.0.join(scheduler).join(file).exists());
    }
    let tasks = std::fs::read_to_string(scratch.0.join("slurm/tasks.txt")).unwrap();
    assert_eq!(tasks, "0-1\n2-2\n");
    for (script, argument) in [("task.sh", "0-1"), ("task.sh", "2-2"), ("last.sh", "")] {
        let mut shell = Command::new("sh");
        let script = scratch.0.join("slurm").join(script);
        let run = shell.arg(script).arg(argument).output().unwrap();
        assert!(run.status.success(), "{}", stderr(&run));
    }
    assert!(scratch.0.join("-m.png").exists());

    must_fail(
        &ivcam("slurm", "x", &["lens", "a.iv"]),
        "`lens` makes neither a movie nor a picture",
    );
    words.pop();
    must_fail(&ivcam("slurm", "x", &words), "the command after `--`");
    words.push("-");
    must_fail(&ivcam("slurm", "x", &words), "standard input");
    assert!(!scratch.0.join("x").exists());
}

#[test]
fn a_job_is_not_started_or_left_out_by_the_files_of_an_earlier_one() {
    let scratch = cube("earlier");
    let farm = |scheduler: &str| {
        let whole = "pull-focus cube.iv --from 1 --to 2 -o a.mp4";
        scratch.ivcam(&format!("farm {scheduler} -o jobs -- {whole}"))
    };
    assert!(farm("parallel").status.success());
    let log = scratch.0.join("jobs/tasks.log");
    std::fs::write(&log, "Seq\tHost\n").unwrap();
    assert!(farm("parallel").status.success());
    assert!(!log.exists());
    must_fail(&farm("slurm"), "run.sh` is of a job for another scheduler");
}

/// The script of a task continues its part when it is started again, and the last one makes the
/// picture of the command.
#[cfg(unix)]
#[test]
fn the_scripts_of_a_divided_picture_make_the_picture_of_its_command() {
    let scratch = cube("picture");
    for (samples, tasks) in [
        ("192", "0..64\n64..128\n128..192\n"),
        ("4", "0,0,9,8\n0,8,9,8\n"),
    ] {
        let line = format!("render cube.iv --size 9x16 --samples {samples} --output=-a.png");
        let run = scratch.ivcam(&format!("farm parallel -o jobs --parts 3 -- {line}"));
        assert!(run.status.success(), "{}", stderr(&run));
        let list = std::fs::read_to_string(scratch.0.join("jobs/tasks.txt")).unwrap();
        assert_eq!(list, tasks);
        let script = |name: &str, argument: &str| {
            let mut shell = Command::new("sh");
            let run = shell
                .arg(scratch.0.join("jobs").join(name))
                .arg(argument)
                .output()
                .unwrap();
            assert!(run.status.success(), "{}", stderr(&run));
            stderr(&run)
        };
        list.lines().for_each(|task| drop(script("task.sh", task)));
        let again = script("task.sh", list.lines().next().unwrap());
        assert!(again.contains("continues after"), "{again}");
        script("last.sh", "");
        let made = std::fs::read(scratch.0.join("-a.png")).unwrap();
        let pixels = image::load_from_memory(&made).unwrap();
        assert!(scratch.ivcam(&line).status.success());
        assert_eq!(pixels, image::open(scratch.0.join("-a.png")).unwrap());
    }
}
