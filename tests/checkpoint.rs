//! Checkpoints as users type them: resumed, divided, merged and interrupted renders, and bad input.

#[path = "common/pixels.rs"]
mod pixels;
#[path = "common/scratch.rs"]
mod scratch;

use std::process::{Command, Output};

use pixels::pixels;
use scratch::{Scratch, must_fail, stderr};

const SCENE: &str = "#Inventor V2.1 ascii\nPerspectiveCamera { position 0 0 4 focalDistance 4 }\n\
    Texture2 { filename \"dots.png\" } PointLight { location 2 3 4 } Sphere { }\n\
    Translation { translation 1 .4 .5 } Cube { width .5 }\n";

/// Makes a folder with the scene.
fn room(name: &str) -> Scratch {
    let scratch = Scratch::new(&format!("checkpoint-{name}"), "room.iv", SCENE);
    scratch.texture(200);
    scratch
}

impl Scratch {
    /// Writes the texture of the scene.
    fn texture(&self, level: u8) {
        let pixels =
            image::RgbImage::from_fn(4, 4, |x, y| image::Rgb([level, 60 * x as u8, 9 * y as u8]));
        pixels.save(self.0.join("dots.png")).unwrap();
    }

    fn render(&self, more: &str) -> Output {
        self.ivcam(&format!("render room.iv --size 26x17 {more}"))
    }

    fn must_render(&self, more: &str) -> String {
        let output = self.render(more);
        assert!(output.status.success(), "{more}: {}", stderr(&output));
        stderr(&output)
    }

    fn must_merge(&self, words: &str) {
        let output = self.ivcam(&format!("merge {words}"));
        assert!(output.status.success(), "{words}: {}", stderr(&output));
    }

    /// Returns whether a file has a text.
    fn has(&self, file: &str, text: &str) -> bool {
        let bytes = std::fs::read(self.0.join(file)).unwrap();
        bytes.windows(text.len()).any(|w| w == text.as_bytes())
    }

    /// Checks that two pictures have the same bits in all channels.
    fn must_be_same(&self, a: &str, b: &str) {
        assert!(
            pixels(&self.0.join(a)) == pixels(&self.0.join(b)),
            "{a} {b}"
        );
    }
}

#[test]
fn parts_of_the_samples_and_of_the_picture_merge_to_the_bits_of_one_render() {
    let scratch = room("parts");
    for (kind, options) in [
        ("even", "--samples 150"),
        ("adaptive", "--samples 150 --adaptive"),
    ] {
        scratch.must_render(&format!("{options} -o {kind}.exr"));
        let part = |name: &str, words: &str| {
            let line = format!("{options} --checkpoint {kind}-{name}.ckpt {words}");
            scratch.must_render(&line);
            assert!(
                !scratch.0.join("room.png").exists(),
                "no picture of a part is written"
            );
        };
        part("a", "--sample-range 0..64 --threads 1");
        part("b", "--sample-range 64..128");
        part("c", "--sample-range 128..150");
        part("left", "--region 0,0,9,17 -o left.exr");
        part("right", "--region 9,0,17,17 -o right.exr");
        part("left-a", "--region 0,0,9,17 --sample-range 0..128");
        part("left-b", "--region 0,0,9,17 --sample-range 128..150");
        let merge = |names: &str, output: &str| {
            let files: Vec<String> = names
                .split(' ')
                .map(|n| format!("{kind}-{n}.ckpt"))
                .collect();
            scratch.must_merge(&format!("{} -o {output}", files.join(" ")));
        };
        for (number, names) in ["c a b", "right left", "left-b right left-a"]
            .iter()
            .enumerate()
        {
            merge(names, &format!("{number}.exr"));
            scratch.must_be_same(&format!("{number}.exr"), &format!("{kind}.exr"));
            assert!(!scratch.has(&format!("{number}.exr"), "ivcam:region"));
        }
        // A checkpoint of parts is one of the picture, and its render has only to state the error.
        merge("b c", &format!("{kind}-bc.ckpt"));
        merge("a bc", "all.ckpt");
        let said = scratch.must_render(&format!("{options} --checkpoint all.ckpt -o all.exr"));
        assert!(said.contains("continues after 150 samples"), "{said}");
        let quiet = format!("{options} --checkpoint all.ckpt -o all.exr --quiet");
        assert!(!scratch.must_render(&quiet).contains("continues"));
        scratch.must_be_same("all.exr", &format!("{kind}.exr"));
    }
}

#[test]
fn samples_are_added_to_a_finished_checkpoint() {
    let scratch = room("more");
    for samples in [20, 100, 150] {
        scratch.must_render(&format!("--samples {samples} --checkpoint a.ckpt -o a.exr"));
        scratch.must_render(&format!("--samples {samples} -o once.exr"));
        scratch.must_be_same("a.exr", "once.exr");
    }
    must_fail(
        &scratch.render("--samples 100 --checkpoint a.ckpt"),
        "it has 150 samples, and 100 are asked for",
    );
    scratch.must_render("--samples 20 --sampler blue --checkpoint blue.ckpt");
    must_fail(
        &scratch.render("--samples 40 --sampler blue --checkpoint blue.ckpt"),
        "samples is 20 there and 40 here",
    );
}

#[test]
fn a_checkpoint_of_something_else_is_refused_with_the_difference() {
    let scratch = room("other");
    scratch.must_render("--samples 4 --checkpoint a.ckpt");
    let kept = std::fs::read(scratch.0.join("a.ckpt")).unwrap();
    let refused = |words: &str, text: &str| {
        must_fail(
            &scratch.render(&format!("--samples 8 --checkpoint a.ckpt {words}")),
            text,
        );
        assert_eq!(std::fs::read(scratch.0.join("a.ckpt")).unwrap(), kept);
    };
    refused("--lens double-gauss", "lens");
    refused("--seed 7", "seed is 0 there and 7 here");
    refused("--exposure 2", "exposure");
    refused("--region 0,0,9,17", "region is");
    refused(
        "--sample-range 64..128 --samples 128",
        "its samples begin with 0, and these with 64",
    );
    refused("--arithmetic portable", "`--arithmetic portable` makes");
    scratch.texture(100);
    refused("", "the content of `dots.png` is");
    scratch.texture(200);
    std::fs::write(scratch.0.join("room.iv"), SCENE.replace("0 0 4", "0 0 5")).unwrap();
    refused("", "the content of `room.iv` is");
    std::fs::write(scratch.0.join("room.iv"), SCENE).unwrap();
    scratch.must_render("--samples 8 --checkpoint a.ckpt");
}

#[test]
fn damaged_checkpoints_and_wrong_options_are_refused() {
    let scratch = room("damaged");
    scratch.must_render("--samples 4 --checkpoint a.ckpt -o a.png");
    let whole = std::fs::read(scratch.0.join("a.ckpt")).unwrap();
    let write = |bytes: &[u8]| std::fs::write(scratch.0.join("bad.ckpt"), bytes).unwrap();
    let again = || scratch.render("--samples 4 --checkpoint bad.ckpt -o b.png");
    for length in [0, 10, 17, 30, whole.len() / 2, whole.len() - 1] {
        write(&whole[..length]);
        let text = if length < 16 {
            "is not a checkpoint"
        } else {
            "is cut short"
        };
        must_fail(&again(), text);
        must_fail(&scratch.ivcam("merge bad.ckpt -o c.png"), text);
    }
    let mut flipped = whole.clone();
    flipped[whole.len() / 2] ^= 1;
    write(&flipped);
    must_fail(&again(), "its checksum is wrong");
    let mut newer = whole.clone();
    newer[16] = 9;
    write(&newer);
    must_fail(&again(), "has version 9 of the format");
    assert!(!scratch.0.join("b.png").exists() && !scratch.0.join("c.png").exists());
    for (words, text) in [
        ("--checkpoint room.iv", "would overwrite the input"),
        ("--checkpoint a.png", "is not a checkpoint"),
        ("--checkpoint x/a.ckpt", "there is no folder `x`"),
        ("--every 5s", "`--every` needs the file of `--checkpoint`"),
        ("--sample-range 0..64", "needs the file of `--checkpoint`"),
        ("--sample-range 64..0 --checkpoint b.ckpt", "goes backwards"),
        ("--sample-range 0..0 --checkpoint b.ckpt", "is empty"),
        ("--sample-range 9 --checkpoint b.ckpt", "is not a range"),
    ] {
        must_fail(&scratch.render(words), text);
    }
}

#[test]
fn parts_that_overlap_or_leave_gaps_are_not_merged() {
    let scratch = room("overlap");
    let part = |name: &str, words: &str| {
        scratch.must_render(&format!("--samples 192 --checkpoint {name}.ckpt {words}"));
    };
    part("a", "--sample-range 0..128");
    part("b", "--sample-range 64..128");
    part("c", "--sample-range 128..192");
    part("other", "--sample-range 128..192 --seed 1");
    part("top", "--sample-range 0..128 --region 0,0,26,9");
    part("low", "--sample-range 0..128 --region 0,8,26,9");
    part("short", "--sample-range 0..64 --region 0,9,26,8");
    for (names, text) in [
        ("a b", "overlap: both have the samples 64 to 127"),
        ("a a", "overlap: both have the samples 0 to 127"),
        ("b", "the samples 0 to 63 are missing"),
        (
            "a other",
            "parts of different pictures: seed is 0 in the first and 1 in the second",
        ),
        ("top low", "`top.ckpt` and `low.ckpt` overlap"),
        ("top short", "have other samples"),
        ("top a", "overlap"),
        ("a none", "none.ckpt"),
    ] {
        let files: Vec<String> = names.split(' ').map(|n| format!("{n}.ckpt")).collect();
        must_fail(
            &scratch.ivcam(&format!("merge {} -o x.exr", files.join(" "))),
            text,
        );
    }
    std::fs::remove_file(scratch.0.join("b.ckpt")).unwrap();
    part("b", "--sample-range 0..64");
    let gap = scratch.ivcam("merge b.ckpt c.ckpt -o x.exr");
    must_fail(
        &gap,
        "the samples 64 to 127 are missing between `b.ckpt` and `c.ckpt`",
    );
    // A beginning is a picture that is unfinished.
    scratch.must_merge("b.ckpt -o beginning.exr");
    assert!(scratch.has("beginning.exr", "ivcam:unfinished"));
    scratch.must_merge("a.ckpt c.ckpt -o whole.exr");
    assert!(!scratch.has("whole.exr", "ivcam:unfinished"));
    part("t", "--target-error 90%");
    scratch.must_merge("t.ckpt -o met.exr");
    assert!(!scratch.has("met.exr", "ivcam:unfinished"));
    part("g", "--sample-range 0..64 --ghosts on --lens double-gauss");
    must_fail(
        &scratch.ivcam("merge g.ckpt -o x.exr"),
        "the light of --ghosts is not in the parts",
    );
    must_fail(
        &scratch.ivcam("merge a.ckpt -o x.jpeg2000"),
        "cannot tell the picture's format",
    );
    assert!(!scratch.0.join("x.exr").exists());
}

/// The shell ignores the signal for files beyond its limit, so that writing fails instead, as on a
/// full disk.
#[cfg(unix)]
#[test]
fn a_render_goes_on_without_room_for_its_checkpoint() {
    let scratch = room("full");
    let line = format!(
        "trap '' XFSZ; ulimit -f 64; exec {} render room.iv --size 64x40 --samples 4 --every 0.001s \
         --checkpoint a.ckpt -o a.png",
        env!("CARGO_BIN_EXE_ivcam")
    );
    let mut shell = Command::new("sh");
    let output = shell
        .current_dir(&scratch.0)
        .args(["-c", &line])
        .output()
        .unwrap();
    let said = stderr(&output);
    assert_eq!(output.status.code(), Some(2), "{said}");
    assert_eq!(
        said.matches("the checkpoint was not written").count(),
        1,
        "{said}"
    );
    assert!(scratch.0.join("a.png").exists() && !scratch.0.join("a.ckpt").exists());
}

/// Signals end a render with a picture and a checkpoint, from which it continues.
#[cfg(unix)]
#[test]
fn a_signal_leaves_the_picture_so_far_and_the_same_command_continues() {
    let scratch = room("signal");
    let words =
        "render room.iv --size 64x40 --samples 640 --checkpoint a.ckpt --every 0.05s -o a.exr";
    let checkpoint = scratch.0.join("a.ckpt");
    let time = || checkpoint.metadata().and_then(|m| m.modified()).ok();
    // What started the tests may have let them ignore signals, which the program then does too.
    let status = std::fs::read_to_string("/proc/self/status").unwrap_or_default();
    let ignored = status.lines().find_map(|line| line.strip_prefix("SigIgn:"));
    let ignored = ignored.map_or(0, |mask| u64::from_str_radix(mask.trim(), 16).unwrap());
    for (signal, number) in [("-INT", 2), ("-TERM", 15), ("-HUP", 1)] {
        if ignored >> (number - 1) & 1 == 1 {
            continue;
        }
        let mut command = Command::new(env!("CARGO_BIN_EXE_ivcam"));
        command.current_dir(&scratch.0).args(words.split(' '));
        let before = time();
        let mut child = command
            .stderr(std::process::Stdio::piped())
            .spawn()
            .unwrap();
        while time() == before && child.try_wait().unwrap().is_none() {
            std::thread::sleep(std::time::Duration::from_millis(5));
        }
        let kill = Command::new("kill")
            .args([signal, &child.id().to_string()])
            .status();
        assert!(kill.unwrap().success());
        let output = child.wait_with_output().unwrap();
        let said = stderr(&output);
        assert_eq!(output.status.code(), Some(128 + number), "{said}");
        assert!(said.contains("the same command continues it"), "{said}");
        assert!(scratch.has("a.exr", "ivcam:unfinished"));
        scratch.must_merge("a.ckpt -o now.exr");
        scratch.must_be_same("now.exr", "a.exr");
    }
    let last = scratch.ivcam(words);
    assert!(last.status.success() && stderr(&last).contains("continues after"));
    scratch.must_render("--size 64x40 --samples 640 -o once.exr");
    scratch.must_be_same("a.exr", "once.exr");
}

/// A shell without job control starts programs in the background so, and `nohup` does it too.
#[cfg(target_os = "linux")]
#[test]
fn a_signal_that_the_program_was_started_to_ignore_stays_ignored() {
    let scratch = room("ignored");
    let line = format!(
        "trap '' INT; {} render room.iv --size 64x40 --samples 64 --checkpoint a.ckpt --every 0.01s \
         -o a.exr & until test -e a.ckpt; do sleep 0.01; done; kill -INT $!; wait $!",
        env!("CARGO_BIN_EXE_ivcam")
    );
    let mut shell = Command::new("sh");
    let run = shell.current_dir(&scratch.0).args(["-c", &line]).output();
    let run = run.unwrap();
    assert!(run.status.success(), "{}", stderr(&run));
    assert!(!scratch.has("a.exr", "ivcam:unfinished"));
}
