//! The command line as users type it: the README's and the paper's own lines, and bad input.

use std::path::{Path, PathBuf};
use std::process::{Command, Output};

/// A temporary folder that is removed at the end.
struct Scratch(PathBuf);

impl Scratch {
    fn new(name: &str) -> Self {
        let path = std::env::temp_dir().join(format!("ivcam-cli-{}-{name}", std::process::id()));
        std::fs::create_dir_all(&path).unwrap();
        Self(path)
    }

    fn file(&self, name: &str, content: &str) -> PathBuf {
        let path = self.0.join(name);
        std::fs::write(&path, content).unwrap();
        path
    }

    /// Writes an Inventor file.
    fn inventor(&self, name: &str, body: &str) -> PathBuf {
        self.file(name, &format!("#Inventor V2.1 ascii\n{body}"))
    }

    fn names(&self) -> Vec<String> {
        let entries = std::fs::read_dir(&self.0).unwrap();
        let mut names: Vec<String> = entries
            .map(|e| e.unwrap().file_name().to_string_lossy().into_owned())
            .collect();
        names.sort();
        names
    }
}

impl Drop for Scratch {
    fn drop(&mut self) {
        let _ = std::fs::remove_dir_all(&self.0);
    }
}

fn root() -> &'static Path {
    Path::new(env!("CARGO_MANIFEST_DIR"))
}

fn ivcam(line: &str) -> Command {
    let mut command = Command::new(env!("CARGO_BIN_EXE_ivcam"));
    command.current_dir(root()).args(line.split_whitespace());
    command
}

fn stderr(output: &Output) -> String {
    String::from_utf8_lossy(&output.stderr).into_owned()
}

#[test]
fn the_papers_own_command_line_runs_unchanged() {
    let scratch = Scratch::new("paper");
    let picture = scratch.0.join("a.png");
    let line = "-batch -j 16 -s r -f 1.2 -z 0.2 -camread camera/cam-1.dat \
                scenes/livroom/livroom.iv";
    let run = ivcam(line)
        .args(["--size", "18x12", "-o"])
        .arg(&picture)
        .output()
        .unwrap();
    assert!(run.status.success(), "{}", stderr(&run));
    let said = stderr(&run);
    for part in [
        "era 1999",
        "rear element, polar map",
        "samples 16",
        "efl 20.0",
        "relative error",
    ] {
        assert!(said.contains(part), "{part} missing in {said}");
    }
}

/// As in 1999, the window opens without `-batch`. Without a display, with one that does not answer,
/// or in a build without the window, one sentence states what works.
#[test]
fn without_a_display_one_sentence_names_batch() {
    for (line, display) in [
        ("scenes/livroom/livroom.iv", ""),
        ("view scenes/livroom/livroom.iv", ""),
        ("view scenes/livroom/livroom.iv", ":98765"),
    ] {
        let mut command = ivcam(line);
        command
            .env("DISPLAY", display)
            .env_remove("WAYLAND_DISPLAY");
        let run = command.output().unwrap();
        let said = stderr(&run);
        assert_eq!(run.status.code(), Some(2), "{said}");
        assert_eq!(said.matches("error").count(), 1, "{said}");
        assert!(
            said.contains("`-batch`") && !said.contains("panicked") && !said.contains(".rs"),
            "{said}"
        );
    }
}

#[test]
fn the_report_has_time_error_and_the_parts_left_out() {
    let scratch = Scratch::new("report");
    let scene = scratch.file("a.iv", "#Inventor V2.1 ascii\nSphere { }\n");
    let report = scratch.0.join("report.json");
    let run =
        ivcam("render --lens double-gauss --focus 3 --size 12x8 -s p --headlight=on --report")
            .arg(&report)
            .arg(&scene)
            .arg("-o")
            .arg(scratch.0.join("a.png"))
            .output()
            .unwrap();
    assert!(run.status.success(), "{}", stderr(&run));
    let text = std::fs::read_to_string(report).unwrap();
    let json: serde_json::Value = serde_json::from_str(&text).unwrap();
    for phase in ["read", "compile", "pupil", "render", "write"] {
        assert!(json["seconds"][phase].as_f64().unwrap() >= 0.0);
    }
    assert!(json["relative_rmse"].as_f64().unwrap() > 0.0);
    assert!(json["passed_share"].as_f64().unwrap() > 0.5);
    assert_eq!(json["film_rays"], 12 * 8 * 16);
}

/// Runs a command line that must fail with exit code 2, one error that contains all of `parts`, and
/// no new file in the folder.
fn must_fail(scratch: &Scratch, line: &str, parts: &[&str]) {
    let before = scratch.names();
    let folder = scratch.0.display().to_string();
    let run = ivcam(&line.replace("DIR", &folder)).output().unwrap();
    let said = stderr(&run);
    assert_eq!(run.status.code(), Some(2), "{line}: {said}");
    assert_eq!(said.matches("error").count(), 1, "{line}: {said}");
    assert!(!said.contains("panicked"), "{said}");
    for part in parts {
        assert!(said.contains(part), "{line}: `{part}` missing in\n{said}");
    }
    assert_eq!(scratch.names(), before, "{line}");
}

#[test]
fn bad_input_ends_in_one_clear_message_and_no_file() {
    let scratch = Scratch::new("bad");
    scratch.file("good.iv", "#Inventor V2.1 ascii\nCube { }\n");
    scratch.file("not.iv", "a letter\nto nobody\n");
    scratch.file("empty.iv", "");
    scratch.file("none.dat", "# radius thickness n_d aperture\n");
    scratch.file("negative.dat", "50 5 1.5 20\n-50 40 1 -20\n");
    scratch.file("nocam.dat", "Cube { }\n");
    let render = "render -o DIR/out.png";
    for (rest, parts) in [
        ("DIR/not.iv", &["not.iv", "Inventor"][..]),
        ("DIR/empty.iv", &["empty.iv"]),
        ("DIR/missing.iv", &["missing.iv", "no such file"]),
        ("--lens DIR/none.dat DIR/good.iv", &["none.dat", "surface"]),
        (
            "--lens DIR/negative.dat DIR/good.iv",
            &["negative.dat:2", "aperture"],
        ),
        (
            "--lens wide-angel DIR/good.iv",
            &["wide-angel", "did you mean `wide-angle`"],
        ),
        ("--lens double-gauss --focus 0.01 DIR/good.iv", &["nearest"]),
        ("--focus -1 DIR/good.iv", &["--focus -1"]),
        ("--size 0x24 DIR/good.iv", &["0x24", "no pixels"]),
        ("--samples 0 DIR/good.iv", &["--samples 0"]),
        ("--shading q DIR/good.iv", &["--shading q"]),
        (
            "--camera DIR/nocam.dat DIR/good.iv",
            &["nocam.dat", "no camera"],
        ),
        (
            "--camera DIR/gone.dat DIR/good.iv",
            &["gone.dat", "no such file"],
        ),
    ] {
        must_fail(&scratch, &format!("{render} {rest}"), parts);
    }
    must_fail(
        &scratch,
        "render -o DIR/out.bmp DIR/good.iv",
        &["out.bmp", ".png"],
    );
    must_fail(
        &scratch,
        "render -o DIR/gone/out.png --size 4x4 --focus 9 DIR/good.iv",
        &["gone/out.png"],
    );
    must_fail(
        &scratch,
        "render -o DIR/a.png --report DIR/a.png DIR/good.iv",
        &["a.png"],
    );
    let run = ivcam("render --target-error 2 scenes/office.iv").output();
    let said = stderr(&run.unwrap());
    assert!(said.contains("`--target-error 2` is not"), "{said}");
    must_fail(&scratch, "rendr", &["did you mean `render`"]);
    must_fail(&scratch, "lens DIR/none.dat", &["none.dat"]);
    must_fail(&scratch, "nodes Conne", &["did you mean `Cone`"]);
}

#[test]
fn a_missing_part_is_a_warning_and_a_picture() {
    let scratch = Scratch::new("parts");
    let scene = "#Inventor V2.1 ascii\nFile { name \"gone.iv\" }\nTexture2 { filename \"gone.rgb\" }\n\
                 Cube { }\n";
    scratch.file("a.iv", scene);
    let line = format!(
        "render --size 12x8 --lens none -o {0}/a.png {0}/a.iv",
        scratch.0.display()
    );
    let run = ivcam(&line).output().unwrap();
    assert!(run.status.success(), "{}", stderr(&run));
    for part in ["warning", "gone.iv", "a.iv:2"] {
        assert!(
            stderr(&run).contains(part),
            "{part} missing in {}",
            stderr(&run)
        );
    }
    assert!(scratch.0.join("a.png").exists());
}

/// Returns the highest level of a picture, and the messages.
fn lit(scratch: &Scratch, line: &str) -> (u8, String) {
    let picture = scratch.0.join("lit.png");
    let run = ivcam(&line.replace("DIR", &scratch.0.display().to_string()))
        .args(["--lens", "none", "--size", "12x8", "-j", "4", "-o"])
        .arg(&picture)
        .output()
        .unwrap();
    assert!(run.status.success(), "{line}: {}", stderr(&run));
    let levels = image::open(picture).unwrap().to_luma8();
    (levels.iter().copied().max().unwrap(), stderr(&run))
}

const HEADLIGHT_ON: &str = "headlight: on, because the scene has no light; --headlight=off turns it off, --studio lights it softly";

#[test]
fn a_scene_without_light_is_lit_from_the_camera_with_a_notice() {
    let scratch = Scratch::new("dark");
    scratch.file("dark.iv", "#Inventor V2.1 ascii\nCube { }\n");
    scratch.file(
        "off.iv",
        "#Inventor V2.1 ascii\nPointLight { on FALSE }\nCube { }\n",
    );
    scratch.file(
        "lamp.iv",
        "#Inventor V2.1 ascii\nDirectionalLight { direction 0 0 1 }\nCube { }\n",
    );
    for scene in ["dark.iv", "off.iv"] {
        let (level, said) = lit(&scratch, &format!("render DIR/{scene}"));
        assert!(level > 100, "{scene}: {level}");
        assert_eq!(said.matches(HEADLIGHT_ON).count(), 1, "{said}");
    }
    // From behind, the light of this scene reaches no visible surface, so the picture remains dark.
    for (line, cause) in [
        ("render DIR/lamp.iv", "do not reach what the camera sees"),
        ("render --headlight=off DIR/dark.iv", "no light is on"),
    ] {
        let (level, said) = lit(&scratch, line);
        assert!(level < 20 && !said.contains(HEADLIGHT_ON), "{level} {said}");
        assert_eq!(said.matches("warning").count(), 1, "{said}");
        assert!(said.contains(cause), "{said}");
    }
    for flag in ["--headlight", "--headlight=on"] {
        let (level, said) = lit(&scratch, &format!("render {flag} DIR/dark.iv"));
        assert!(
            level > 100 && !said.contains(HEADLIGHT_ON),
            "{level} {said}"
        );
    }
    // By model `path` an unlit shape shines, but it is no lamp that an object needs.
    scratch.file(
        "label.iv",
        "#Inventor V2.1 ascii\nSeparator { LightModel { model BASE_COLOR } Cube { } }\n\
         Translation { translation 4 0 0 } Cube { }\n",
    );
    let (level, said) = lit(&scratch, "render --shading path DIR/label.iv");
    assert!(level > 100 && said.contains("headlight: a flash"), "{said}");
    scratch.file(
        "label.wrl",
        "#VRML V2.0 utf8\nNavigationInfo { headlight FALSE }\nShape { geometry Box { } }\n",
    );
    let (level, said) = lit(&scratch, "render --shading path DIR/label.wrl");
    assert!(level > 100 && !said.contains("warning"), "{said}");
    // The shading by normals needs no light.
    let (_, said) = lit(&scratch, "render -s n DIR/dark.iv");
    assert!(!said.contains(HEADLIGHT_ON), "{said}");
}

#[test]
fn in_the_1999_form_the_headlight_remains_off_with_a_hint() {
    let scratch = Scratch::new("dark-1999");
    scratch.file("dark.iv", "#Inventor V2.1 ascii\nCube { }\n");
    let (level, said) = lit(&scratch, "-batch DIR/dark.iv");
    assert!(level < 20, "{level}");
    for part in ["warning", "no light", "-headlight"] {
        assert!(said.contains(part), "{part} missing in {said}");
    }
    let (level, said) = lit(&scratch, "-batch -headlight DIR/dark.iv");
    assert!(level > 100 && !said.contains("warning"), "{level} {said}");
}

#[test]
fn a_picture_that_is_black_or_clipped_says_so_with_the_likely_cause() {
    let scratch = Scratch::new("black");
    let scene = |name: &str, text: &str| {
        scratch.file(name, &format!("#Inventor V2.1 ascii\n{text}\n"));
    };
    let wall = "Cube { width 40 height 40 depth 0.1 }";
    scene("empty.iv", "Separator { }");
    scene(
        "wall.iv",
        &format!("PerspectiveCamera {{ position 0 0 3 }} {wall}"),
    );
    scene(
        "behind.iv",
        &format!("PerspectiveCamera {{ position 0 0 -3 }} {wall}"),
    );
    scene(
        "past.iv",
        "PerspectiveCamera { position 50 0 3 } Cube { depth 0.1 }",
    );
    scene(
        "shadow.iv",
        &format!(
            "PerspectiveCamera {{ position 0 0 3 }} DirectionalLight {{ }} {wall} \
             Translation {{ translation 0 0 5 }} {wall}"
        ),
    );
    let face = "Normal { vector 0 0 -1 } NormalBinding { value OVERALL } FaceSet { numVertices 4 }";
    scene(
        "away.iv",
        &format!(
            "PerspectiveCamera {{ position 0 0 3 }} \
             Coordinate3 {{ point [ -9 -9 0, 9 -9 0, 9 9 0, -9 9 0 ] }} {face}"
        ),
    );
    scene(
        "edge.iv",
        &format!(
            "PerspectiveCamera {{ position 0 0 3 }} \
             Coordinate3 {{ point [ -1 0 -1, 1 0 -1, 1 0 1, -1 0 1 ] }} {face}"
        ),
    );
    // A light after the last shape lights nothing, so the headlight is on.
    let (level, messages) = {
        scene("late.iv", "Cube { } PointLight { location 0 0 9 }");
        lit(&scratch, "render DIR/late.iv")
    };
    assert!(level > 100 && messages.contains(HEADLIGHT_ON), "{messages}");
    scene(
        "dull.iv",
        &format!("PerspectiveCamera {{ position 0 0 3 }} Material {{ diffuseColor 0 0 0 }} {wall}"),
    );
    let glow = "Material { emissiveColor .02 .02 .02 diffuseColor 0 0 0 }";
    scene(
        "glow.iv",
        &format!("PerspectiveCamera {{ position 0 0 3 }} {glow} {wall}"),
    );
    for (line, cause, next) in [
        ("render DIR/empty.iv", "nothing to see", "ivcam check"),
        ("render DIR/behind.iv", "behind the camera", "--camera"),
        ("render DIR/past.iv", "looks past the scene", "--view SIDE"),
        ("render DIR/shadow.iv", "is in shadow", "--headlight=on"),
        ("-batch DIR/shadow.iv", "is in shadow", "-headlight on"),
        (
            "render --exposure 1e-4 DIR/wall.iv",
            "too short",
            "--exposure",
        ),
        (
            "render --exposure 900 DIR/wall.iv",
            "too long",
            "--exposure",
        ),
        ("render DIR/dull.iv", "black or nearly so", "--exposure"),
        (
            "render --shading path --headlight=off DIR/glow.iv",
            "its only light, of shapes or surroundings, is dim",
            "--exposure",
        ),
        ("render DIR/away.iv", "face away from the light", "-s f"),
        ("render DIR/edge.iv", "too thin to see", "--camera"),
        // A warning is no progress and no summary, so it is not suppressed.
        (
            "render --quiet DIR/behind.iv",
            "behind the camera",
            "--camera",
        ),
    ] {
        let (_, messages) = lit(&scratch, line);
        let warnings: Vec<&str> = messages
            .lines()
            .filter(|l| l.starts_with("warning"))
            .collect();
        assert_eq!(warnings.len(), 1, "{line}: {messages}");
        assert!(warnings[0].contains("the picture is"), "{line}: {messages}");
        assert!(warnings[0].contains(cause), "{line}: {messages}");
        assert!(messages.contains(next), "{line}: {messages}");
    }
    let (level, messages) = lit(&scratch, "render DIR/wall.iv");
    assert!(
        level > 100 && !messages.contains("the picture is"),
        "{messages}"
    );
}

#[test]
fn help_is_grouped_short_and_names_the_spellings_of_its_form() {
    let help = |line: &str| {
        let output = ivcam(line).output().expect("runs");
        assert_eq!(output.status.code(), Some(0), "{line}");
        String::from_utf8_lossy(&output.stdout).into_owned()
    };
    let (short, long) = (help("render -h"), help("render --help"));
    assert!(short.lines().count() <= 50, "{short}");
    assert!(short.contains("--aperture") && !short.contains("--film-radius"));
    for heading in ["Lens:", "Film:", "Sampling:", "Output:"] {
        assert!(
            short.contains(heading) && long.contains(heading),
            "{heading}"
        );
    }
    assert!(long.contains("--film-radius") && !long.contains("--batch"));
    assert!(!help("view --help").contains("--batch"));
    for refused in [
        "gallery --efl",
        "gallery --region",
        "pull-focus --aov",
        "converge --time",
    ] {
        let (command, option) = refused.split_once(' ').unwrap();
        assert!(
            !help(&format!("{command} --help")).contains(option),
            "{refused}"
        );
    }
    for line in ["-help", "-batch --help", "-batch -help scene.iv"] {
        let text = help(line);
        for old in ["-batch", "-camread FILE", "-j ", "-headlight"] {
            assert!(
                text.contains(&format!("\n  {old}")),
                "{line}: {old} missing in {text}"
            );
        }
    }
}

#[test]
fn messages_name_the_option_as_it_was_typed() {
    for (line, message) in [
        ("-batch -s q a.iv", "`-s q` is not"),
        ("-batch -j 0 a.iv", "`-j 0` is not"),
        ("render --samples 0 a.iv", "`--samples 0` is not"),
        ("render -j0 a.iv", "`-j 0` is not"),
        (
            "-batch -f -camread x scene.iv",
            "`-f` wants a distance, and `-camread` is an option",
        ),
    ] {
        let output = ivcam(line).output().expect("runs");
        assert_eq!(output.status.code(), Some(2), "{line}");
        assert!(
            stderr(&output).contains(message),
            "{line}: {}",
            stderr(&output)
        );
    }
    let scratch = Scratch::new("typed");
    scratch.file("cube.iv", CUBE);
    let warned = "--lens none --size 4x4 -o DIR/a.png DIR/cube.iv";
    for option in ["-z", "--zoom"] {
        let run = must_run(&scratch, &format!("-batch {option} 0.2 {warned}"));
        let expected = format!("without a lens, `{option}` does nothing");
        assert!(stderr(&run).contains(&expected), "{}", stderr(&run));
    }
    let output = ivcam("-batch a.iv b.iv").output().expect("runs");
    let text = stderr(&output);
    assert!(text.contains("b.iv") && !text.contains("--batch"), "{text}");
}

#[test]
fn navigation_info_and_environment_set_the_headlight() {
    let scratch = Scratch::new("say");
    let world = |info: &str, lamp: &str| {
        format!(
            "#VRML V2.0 utf8\n{info}\n{lamp}\nShape {{ appearance Appearance {{ \
             material Material {{ }} }} geometry Box {{ }} }}\n"
        )
    };
    let behind = "DirectionalLight { direction 0 0 1 }";
    scratch.file("on.wrl", &world("NavigationInfo { }", behind));
    scratch.file("off.wrl", &world("NavigationInfo { headlight FALSE }", ""));
    scratch.file("none.wrl", &world("", behind));
    for (line, bright) in [
        ("render DIR/on.wrl", true),
        ("render --headlight=off DIR/on.wrl", false),
        ("render DIR/off.wrl", false),
        ("render --headlight=on DIR/off.wrl", true),
        ("render DIR/none.wrl", true),
        ("-batch DIR/on.wrl", false),
    ] {
        let (level, said) = lit(&scratch, line);
        assert_eq!(level > 100, bright, "{line}: {level}");
        assert!(!said.contains(HEADLIGHT_ON), "{said}");
    }
    let camera = "PerspectiveCamera { position 0 0 5 }";
    scratch.file("off.env", camera);
    let lamp = "DirectionalLight { direction 0 0 -1 }";
    scratch.file("on.env", &format!("{camera}\n{lamp}\n"));
    for (environment, bright) in [("off", false), ("on", true)] {
        for scene in ["on.wrl", "off.wrl"] {
            let line = format!("render -e DIR/{environment}.env DIR/{scene}");
            let (level, _) = lit(&scratch, &line);
            assert_eq!(level > 100, bright, "{line}: {level}");
        }
    }
}

#[test]
fn metadata_and_report_state_the_headlight() {
    let scratch = Scratch::new("lit-report");
    scratch.file("dark.iv", "#Inventor V2.1 ascii\nCube { }\n");
    for (flags, words) in [
        ("", "on, because the scene has no light"),
        ("--headlight=off", "off, by option"),
    ] {
        lit(
            &scratch,
            &format!("render {flags} --report DIR/a.json DIR/dark.iv"),
        );
        let report = std::fs::read_to_string(scratch.0.join("a.json")).unwrap();
        let report: serde_json::Value = serde_json::from_str(&report).unwrap();
        assert_eq!(report["plan"]["headlight"], words);
        let picture = std::fs::read(scratch.0.join("lit.png")).unwrap();
        let picture = String::from_utf8_lossy(&picture);
        assert!(picture.contains("ivcam:headlight") && picture.contains(words));
    }
}

#[test]
fn of_many_files_each_has_a_line_with_its_worst_problem_and_all_have_a_sum() {
    let scratch = Scratch::new("check-many");
    scratch.inventor("a.iv", "Cube { }");
    scratch.inventor("b.iv", "Cube { depth 1\n hight 2 }");
    scratch.inventor("c.iv", "Texture2 { filename \"gone.png\" } Whatsit { a 1 }");
    std::fs::write(scratch.0.join("d.iv"), "no scene").expect("writes");
    let folder = scratch.0.display();
    let output = ivcam(&format!("check {folder}")).output().expect("runs");
    let text = String::from_utf8_lossy(&output.stdout).into_owned();
    let lines: Vec<&str> = text.lines().collect();
    assert_eq!(lines.len(), 5, "{text}");
    assert!(lines[0].ends_with("0 problems"), "{text}");
    assert!(
        lines[1].contains("1 problem: line 3, column 2: warning: `Cube` has no field `hight`"),
        "{text}"
    );
    assert!(lines[2].contains("1 file missing, 2 problems"), "{text}");
    assert_eq!(lines[3].matches("d.iv").count(), 1, "{text}");
    assert_eq!(
        lines[4],
        "4 files: 3 whole, 0 damaged, 1 unreadable, 2 with problems, 1 with unknown classes, \
         1 with missing files"
    );
    assert_eq!(output.status.code(), Some(2));
    let output = ivcam(&format!("check --full {folder}"))
        .output()
        .expect("runs");
    assert!(String::from_utf8_lossy(&output.stdout).contains("  missing    gone.png"));
    assert!(
        stderr(&output).contains("did you mean `height`?"),
        "{}",
        stderr(&output)
    );
}

#[test]
fn damaged_files_are_a_class_of_their_own_and_can_be_listed_alone() {
    let scratch = Scratch::new("check-damaged");
    scratch.inventor("cut.iv", "Cube { hight 2 }\nSeparator { Cone { }\n");
    scratch.inventor("empty-scene.iv", "Separator { }");
    scratch.inventor("value.iv", "Cube { width high }");
    scratch.inventor("whole.iv", "Cube { hight 2 }");
    std::fs::write(scratch.0.join("zero.iv"), "").expect("writes");
    let check = |flags: &str| {
        let mut output = ivcam(&format!("check {flags} {}", scratch.0.display()));
        let output = output.output().expect("runs");
        assert_eq!(output.status.code(), Some(2), "one file is unreadable");
        let text = String::from_utf8_lossy(&output.stdout).into_owned();
        (text, stderr(&output))
    };
    let sum = "5 files: 2 whole, 2 damaged, 1 unreadable, 3 with problems";
    let (text, _) = check("");
    let lines: Vec<&str> = text.lines().collect();
    assert!(lines[0].contains("damaged: the file ends inside the `Separator`"));
    assert!(lines[1].contains("0 triangles, nothing to see, 0 problems"));
    assert!(lines[2].contains("line 2, column 14: damaged: `Cube.width`: expected a number"));
    assert!(lines[3].contains("warning: `Cube` has no field `hight`"));
    assert!(lines[4].ends_with("zero.iv: error: this is empty"));
    assert_eq!(lines[5], sum, "{text}");

    let (text, _) = check("--only damaged");
    let lines: Vec<&str> = text.lines().collect();
    assert_eq!(lines.len(), 3, "{text}");
    assert!(lines[0].contains("cut.iv") && lines[1].contains("value.iv") && lines[2] == sum);

    let (text, messages) = check("--json --only damaged,unreadable");
    let objects: Vec<serde_json::Value> = text
        .lines()
        .map(|line| serde_json::from_str(line).expect("is JSON"))
        .collect();
    let states: Vec<&str> = objects.iter().filter_map(|o| o["state"].as_str()).collect();
    assert_eq!(states, ["damaged", "damaged", "unreadable"]);
    assert_eq!(objects[0]["diagnostics"][0]["severity"], "warning");
    assert_eq!(objects[0]["diagnostics"][1]["severity"], "damaged");
    assert!(messages.contains(sum), "{messages}");
}

/// A `MovieTexture` shows a picture as other textures do, and of a `Texture3` each layer is a file.
#[test]
fn every_picture_that_is_not_there_is_missing_by_its_own_name() {
    let scratch = Scratch::new("check-pictures");
    let layer = image::RgbImage::from_pixel(2, 2, image::Rgb([200, 9, 9]));
    layer.save(scratch.0.join("layer.png")).unwrap();
    let layers = "Texture3 { filenames [ \"layer.png\", \"gone.png\" ] }\nCube { }";
    scratch.inventor("layers.iv", layers);
    let movie = "Shape { appearance Appearance { texture MovieTexture { url \"gone.mpg\" } }\n\
        geometry Box { } }";
    scratch.file("movie.wrl", &format!("#VRML V2.0 utf8\n{movie}\n"));
    let sound = "Sound { source MovieTexture { url \"gone.mpg\" } }\nShape { geometry Box { } }";
    scratch.file("sound.wrl", &format!("#VRML V2.0 utf8\n{sound}\n"));
    for (scene, missing) in [
        ("layers.iv", &["gone.png"][..]),
        ("movie.wrl", &["gone.mpg"]),
        ("sound.wrl", &[]),
    ] {
        let run = must_run(&scratch, &format!("check DIR/{scene} --json"));
        let facts: serde_json::Value = serde_json::from_slice(&run.stdout).unwrap();
        assert_eq!(facts["missing"], serde_json::json!(missing), "{scene}");
    }
}

/// A browser of the 1990s showed a world without a `Viewpoint` from 0 0 10, with a height of 45°.
#[test]
fn the_look_of_a_viewer_shows_a_world_from_ten_meters() {
    let scratch = Scratch::new("look");
    let material = "appearance Appearance { material Material { emissiveColor 1 1 1 } }";
    let shape = format!("Shape {{ {material} geometry Box {{ size 2 2 2 }} }}");
    scratch.file("box.wrl", &format!("#VRML V2.0 utf8\n{shape}\n"));
    must_run(
        &scratch,
        "render DIR/box.wrl --look viewer --size 60x60 --quiet -o DIR/a.ppm",
    );
    let bright = levels(&scratch.0.join("a.ppm"))[5..]
        .chunks(3)
        .filter(|p| p[0] > 99)
        .count();
    // The front of the box, 2 across at a distance of 9: 60/9/tan 22.5° = 16.1 pixels.
    assert_eq!(bright, 16 * 16);
}

#[test]
fn a_cut_off_archive_is_damaged_and_a_file_outside_the_folder_is_not_missing() {
    use std::io::Write;
    let scratch = Scratch::new("check-archive");
    let folder = scratch.0.join("a");
    std::fs::create_dir(&folder).expect("makes a folder");
    std::fs::write(folder.join(".ivcam-project"), "").expect("writes");
    std::fs::write(scratch.0.join("near.iv"), "#Inventor V2.1 ascii\nCube { }").expect("writes");
    let text = "#Inventor V2.1 ascii\nFile { name \"../near.iv\" }\nFile { name \"gone.iv\" }\n";
    std::fs::write(folder.join("far.iv"), text).expect("writes");
    let mut gzip = flate2::write::GzEncoder::new(Vec::new(), flate2::Compression::default());
    gzip.write_all(b"#Inventor V2.1 ascii\nCube { }\n")
        .expect("packs");
    let bytes = gzip.finish().expect("packs");
    // Without its last byte the archive unpacks whole, and its checksum cannot be read.
    std::fs::write(folder.join("pack.iv.gz"), &bytes[..bytes.len() - 1]).expect("writes");
    let output = ivcam(&format!("check {}", folder.display()))
        .output()
        .expect("runs");
    let text = String::from_utf8_lossy(&output.stdout).into_owned();
    assert!(
        text.contains(
            "1 file missing, 1 file outside the folder (`--search` opens more), 2 problems"
        ),
        "{text}"
    );
    assert!(
        text.contains("damaged: the gzip archive is damaged"),
        "{text}"
    );
    assert!(
        text.contains("2 files: 1 whole, 1 damaged, 0 unreadable"),
        "{text}"
    );
    let total = text.lines().last().unwrap_or_default();
    let outside = "1 with files outside the folder (`--search` opens more)";
    assert!(total.ends_with(outside), "{text}");
    let output = ivcam(&format!("check {} --contain", folder.display()))
        .arg(&scratch.0)
        .output()
        .expect("runs");
    let text = String::from_utf8_lossy(&output.stdout);
    assert!(text.contains("1 file missing, 1 problem"), "{text}");
}

#[test]
fn an_export_states_its_residual_and_refuses_a_model_that_does_not_fit() {
    let scratch = Scratch::new("export");
    let run = |line: &str| ivcam(line).output().unwrap();
    let calibration = run("lens double-gauss --export opencv --film 36x24 --size 1200x800");
    let text = String::from_utf8_lossy(&calibration.stdout).into_owned();
    assert!(calibration.status.success(), "{}", stderr(&calibration));
    let maps = scratch.0.join("map.exr").display().to_string();
    let line = format!("lens double-gauss --film 36x24 --size 30x20 --export stmap -o {maps}");
    assert!(run(&line).status.success());
    assert_eq!(scratch.names(), ["map-distort.exr", "map-undistort.exr"]);
    assert!(text.contains("image_height: 800\n") && text.contains("residual_max_pixels: "));
    for (line, parts) in [
        (
            "lens nikkor-16 --film 36x24 --export ros --model brown",
            ["brown", "degrees"],
        ),
        (
            "lens biogon --film 36x24 --export ros --model other",
            ["--model other", "rational"],
        ),
        (
            "lens biogon --film 36x24 --export dxf",
            ["no export format `dxf`", "opencv"],
        ),
        (
            "lens biogon --film 36x24 --export ros --size 300x3",
            ["shape", "300x200"],
        ),
        (
            "lens biogon --film 36x24 --export stmap",
            ["EXR", "-o NAME.exr"],
        ),
        (
            "lens biogon --film 36x24 --export psf -o DIR/a.png",
            ["EXR", "-o NAME.exr"],
        ),
        (
            "lens anamorphic --film 36x24 --export osl",
            ["cylinders", "revolution"],
        ),
        ("lens biogon --size 300x200", ["--export", "missing"]),
    ] {
        must_fail(&scratch, line, &parts);
    }
}

#[test]
fn lens_writes_every_output_that_is_asked_for() {
    let scratch = Scratch::new("lens-outputs");
    let rays = r#"[{"origin": [0, 5, -100], "direction": [0, 0, 1]}]"#;
    scratch.file("rays.json", rays);
    for (options, printed) in [
        ("--as-scene a.iv --csv b.csv --sheet c.html", ""),
        (
            "--trace rays.json --csv b.csv --write w.dat",
            r#"[{"status":"passed","#,
        ),
        (
            "--export opencv --film 36x24 --csv b.csv --write w.dat",
            "%YAML",
        ),
        (
            "--json --curves --export zmx --output lens.zmx --write w.dat",
            "{\n  \"name\": \"double-gauss\",",
        ),
    ] {
        let is_file = |word: &&str| word.contains('.');
        for file in options
            .split(' ')
            .filter(is_file)
            .filter(|f| *f != "rays.json")
        {
            let _ = std::fs::remove_file(scratch.0.join(file));
        }
        let run = ivcam("lens double-gauss --fields 0 --frequencies 10")
            .args(options.split(' '))
            .current_dir(&scratch.0)
            .output()
            .unwrap();
        assert!(run.status.success(), "{options}: {}", stderr(&run));
        let text = String::from_utf8_lossy(&run.stdout).into_owned();
        assert!(text.starts_with(printed), "{options}: {text}");
        assert_eq!(text.is_empty(), printed.is_empty(), "{options}");
        for file in options.split(' ').filter(is_file) {
            assert!(scratch.0.join(file).exists(), "{options}: {file}");
        }
    }
}

#[test]
fn lens_refuses_outputs_before_it_writes_any() {
    let scratch = Scratch::new("lens-refused");
    scratch.file("rays.json", "[]");
    for (line, parts) in [
        (
            "lens biogon --trace DIR/rays.json --json --csv DIR/b.csv",
            ["`--trace` and `--json`", "standard output"],
        ),
        (
            "lens biogon --export ros --trace DIR/rays.json --csv DIR/b.csv",
            ["`--trace` and `--export`", "`-o FILE`"],
        ),
        (
            "lens biogon --csv DIR/b.csv --sheet DIR/c.txt",
            ["c.txt` has no known extension", ".html, .htm or .svg"],
        ),
        (
            "lens biogon --write DIR/w.dat --psf DIR/c.txt",
            ["c.txt", ".png"],
        ),
        (
            "lens biogon --write DIR/w.dat --export dxf",
            ["no export format `dxf`", "opencv"],
        ),
        ("lens --csv DIR/b.csv", ["`--csv` needs a lens", "lists"]),
    ] {
        must_fail(&scratch, line, &parts);
    }
    assert_eq!(scratch.names(), ["rays.json"]);
}

#[test]
fn lens_reports_every_invalid_value_in_one_style() {
    let scratch = Scratch::new("lens-values");
    for (option, wanted) in [
        ("--film x", "a film size in millimeters such as 36x24"),
        ("--film 1x2x3", "a film size in millimeters such as 36x24"),
        ("--focus x", "a distance greater than 0"),
        ("--wavelength 0", "a number greater than 0"),
        ("--defocus nan", "a length in millimeters"),
        ("--fields -1", "a list of up to 400 heights"),
        ("--frequencies 0", "a list of up to 400 numbers"),
        ("--export ros --size 300x", "a width and a height in pixels"),
        ("--export ros --model other", "brown, rational or fisheye"),
        ("--export ros --residual 0", "a number greater than 0"),
    ] {
        let given = option.rsplit("--").next().unwrap();
        let message = format!("error: `--{given}` is not {wanted}");
        must_fail(&scratch, &format!("lens biogon {option}"), &[&message]);
    }
}

#[test]
fn the_same_seed_gives_the_same_bits_at_any_number_of_threads() {
    let scratch = Scratch::new("threads");
    let scene = scratch.file(
        "a.iv",
        "#Inventor V2.1 ascii\nDirectionalLight { }\nMaterial { transparency 0.3 }\nCone { }\n",
    );
    let mut pictures = Vec::new();
    for threads in ["1", "2", "7"] {
        let picture = scratch.0.join(format!("{threads}.ppm"));
        let run = ivcam("render --size 30x20 --focus 4 --quiet --depth 16 --threads")
            .args([threads, "-o"])
            .arg(&picture)
            .arg(&scene)
            .output()
            .unwrap();
        assert!(run.status.success(), "{}", stderr(&run));
        let bytes = std::fs::read(picture).unwrap();
        // The command is in the header; the levels follow the line with the largest level.
        let at = bytes.windows(7).position(|w| w == b"\n65535\n").unwrap();
        pictures.push(bytes[at..].to_vec());
    }
    assert!(pictures.iter().all(|p| *p == pictures[0]));
}

#[test]
fn a_missing_dash_is_reported_and_attached_values_are_accepted() {
    let scratch = Scratch::new("slips");
    scratch.file("a.iv", "#Inventor V2.1 ascii\nCube { }\n");
    for (slip, parts) in [
        ("-foo", &["no flag `-foo`"][..]),
        ("-samples", &["no flag `-samples`", "--samples"]),
        ("-bach", &["no flag `-bach`", "-batch"]),
    ] {
        must_fail(&scratch, &format!("{slip} 3 DIR/a.iv"), parts);
        must_fail(&scratch, &format!("render {slip} 3 DIR/a.iv"), parts);
    }
    let line = format!(
        "-batch -f3.5 -j2 -sp -z.5 --size 6x4 -o {0}/a.png {0}/a.iv",
        scratch.0.display()
    );
    let run = ivcam(&line).output().unwrap();
    assert!(run.status.success(), "{}", stderr(&run));
    for part in ["samples 2", "phong", "focus 3.5 m", "efl 50."] {
        assert!(stderr(&run).contains(part), "{part}: {}", stderr(&run));
    }
}

#[test]
fn flags_without_effect_and_flags_that_combine_are_reported() {
    let scratch = Scratch::new("idle");
    scratch.file("a.iv", "#Inventor V2.1 ascii\nCube { }\n");
    let folder = scratch.0.display().to_string();
    let said = |flags: &str| {
        let line = format!("render {flags} --quiet --size 6x4 -o {folder}/a.png {folder}/a.iv");
        let run = ivcam(&line).output().unwrap();
        assert!(run.status.success(), "{}", stderr(&run));
        stderr(&run)
    };
    let idle = said("--lens none --efl 20mm --focus 3 --aperture f/8");
    assert!(
        idle.contains("`--focus`, `--efl` and `--aperture` do nothing"),
        "{idle}"
    );
    assert!(said("--lens none --film 24x36").contains("without a lens, `--film` does nothing"));
    assert!(said("--efl 20mm --zoom 2").contains("40 mm"));
    let of_paths = said("--sky 30 --clamp 2 --colors linear --emission 2");
    assert!(
        of_paths.contains(
            "with model recursive, `--colors`, `--emission`, `--sky` and `--clamp` do nothing"
        ) && of_paths.contains("`--shading path`"),
        "{of_paths}"
    );
    assert!(said("--shading gl --mirrors all").contains("with model gl, `--mirrors` does nothing"));
    assert!(said("--disc polar").contains("at the exit pupil, `--disc` does nothing"));
    for used in [
        "--shading path --sky 30 --max-depth 2",
        "--mirrors all",
        "--pupil rear --disc polar",
    ] {
        assert!(!said(used).contains("nothing"), "{used}");
    }
    assert_eq!(said("--f-number f/8 --focus-by lens --headlight on"), "");
    for flag in ["--aperture f/8", "--f-number 8"] {
        let sheet = ivcam(&format!("lens double-gauss {flag}"))
            .output()
            .unwrap();
        let said = String::from_utf8_lossy(&sheet.stdout).into_owned();
        let line = said.lines().find(|l| l.contains("f-number"));
        assert!(line.is_some_and(|l| l.contains("8.0000")), "{flag}: {said}");
    }
}

/// A long lens must be farther away than a pinhole of 45 degrees.
#[test]
fn a_scene_without_a_camera_is_seen_whole_through_the_lens_it_is_seen_through() {
    let scratch = Scratch::new("whole");
    scratch.file(
        "a.iv",
        "#Inventor V2.1 ascii\nLightModel { model BASE_COLOR }\nSphere { }\n",
    );
    let folder = scratch.0.display().to_string();
    for lens in [
        "double-gauss --efl 35mm",
        "double-gauss",
        "telephoto --efl 300mm",
        "fisheye",
    ] {
        let line = format!(
            "render --lens {lens} --quiet --size 36x24 --samples 4 -o {folder}/a.png {folder}/a.iv"
        );
        let run = ivcam(&line).output().unwrap();
        assert!(run.status.success(), "{lens}: {}", stderr(&run));
        let picture = image::open(scratch.0.join("a.png")).unwrap().to_luma8();
        let lit = |x: u32, y: u32| u32::from(picture.get_pixel(x, y).0[0] > 20);
        let border = (0..36).map(|x| lit(x, 0) + lit(x, 23)).sum::<u32>()
            + (0..24).map(|y| lit(0, y) + lit(35, y)).sum::<u32>();
        let middle = lit(18, 12) + lit(18, 6) + lit(18, 17);
        assert!(middle == 3 && border <= 8, "{lens}: {middle} {border}");
    }
}

#[cfg(unix)]
#[test]
fn a_picture_written_through_a_link_leaves_the_link() {
    let scratch = Scratch::new("link");
    scratch.file("a.iv", "#Inventor V2.1 ascii\nCube { }\n");
    let target = scratch.file("real.png", "");
    let link = scratch.0.join("link.png");
    std::os::unix::fs::symlink(&target, &link).unwrap();
    let line = format!(
        "render --lens none --quiet --size 6x4 -o {} {}/a.iv",
        link.display(),
        scratch.0.display()
    );
    assert!(ivcam(&line).status().unwrap().success());
    assert!(link.is_symlink());
    assert_eq!(image::image_dimensions(target).unwrap(), (6, 4));
}

/// A scene file whose bytes every refused command must leave alone.
const ROOM: &str = "#Inventor V2.1 ascii\nTexture2 { filename \"wood.ppm\" }\nCube { }\n";

#[test]
fn no_output_replaces_an_input_under_any_of_its_names() {
    let scratch = Scratch::new("inputs");
    let room = scratch.file("room.iv", ROOM);
    scratch.file("wood.ppm", "P3 1 1 255 9 9 9\n");
    scratch.file("lens.dat", "50 5 1.5 20\n-50 40 1 20\n");
    scratch.file("a.ppm", "P3 1 1 255 9 9 9\n");
    scratch.file("b.ppm", "P3 1 1 255 9 9 9\n");
    scratch.file("cam.dat", "PerspectiveCamera { position 0 0 5 }\n");
    scratch.file("a.tl", "frames 2\n");
    std::fs::create_dir(scratch.0.join("sub")).unwrap();
    let mut names = vec!["room.iv", "./room.iv", "sub/../room.iv"];
    #[cfg(unix)]
    {
        std::os::unix::fs::symlink(&room, scratch.0.join("link.iv")).unwrap();
        std::fs::hard_link(&room, scratch.0.join("hard.iv")).unwrap();
        names.extend(["link.iv", "hard.iv"]);
    }
    let small = "--size 4x4 -j 1 --lens none";
    for name in names {
        for line in [
            format!("render {small} -o DIR/p.png --report DIR/{name} DIR/room.iv"),
            format!("-batch {small} -o DIR/p.png --report DIR/{name} DIR/room.iv"),
            format!("convert -o DIR/{name} DIR/room.iv"),
            format!("converge {small} --csv DIR/{name} DIR/room.iv"),
            format!("converge {small} --json DIR/{name} DIR/room.iv"),
            format!("converge {small} --svg DIR/{name} DIR/room.iv"),
            format!("compare DIR/room.iv DIR/a.ppm --fit DIR/{name}"),
        ] {
            must_fail(
                &scratch,
                &line,
                &["overwrite the input", "room.iv", "another name"],
            );
        }
    }
    for line in [
        format!("render {small} -o DIR/wood.ppm DIR/room.iv"),
        format!("render {small} -o DIR/p.png --report DIR/wood.ppm DIR/room.iv"),
        format!(
            "render {small} -o DIR/p.png --camera DIR/cam.dat --report DIR/cam.dat DIR/room.iv"
        ),
        format!("render {small} -o DIR/p.png -e DIR/cam.dat --report DIR/cam.dat DIR/room.iv"),
        format!(
            "render {small} -o DIR/p.png --response DIR/a.ppm,DIR/b.ppm --report DIR/b.ppm DIR/room.iv"
        ),
        "lens DIR/lens.dat --write DIR/lens.dat".to_owned(),
        "lens DIR/lens.dat --diagram DIR/lens.dat".to_owned(),
        "lens DIR/lens.dat --sheet DIR/lens.dat".to_owned(),
        "lens DIR/lens.dat --psf DIR/lens.dat".to_owned(),
        "lens DIR/lens.dat --as-scene DIR/lens.dat".to_owned(),
        "compare DIR/a.ppm DIR/b.ppm --sheet DIR/b.ppm".to_owned(),
        "expose DIR/a.ppm DIR/b.ppm -o DIR/b.ppm".to_owned(),
        "pull-focus --animate DIR/a.tl -o DIR/a.tl DIR/room.iv".to_owned(),
    ] {
        must_fail(&scratch, &line, &["overwrite the input"]);
    }
    let same = format!("converge {small} --csv DIR/t --svg DIR/./t DIR/room.iv");
    must_fail(&scratch, &same, &["`--csv` and `--svg`", "same file"]);
    assert_eq!(std::fs::read_to_string(room).unwrap(), ROOM);
}

#[test]
fn convert_replaces_its_scene_only_by_force_and_names_only_what_it_writes() {
    let scratch = Scratch::new("convert");
    let room = scratch.file("room.iv", "#Inventor V1.0 ascii\nCube { }\n");
    scratch.file("one.wrl", "#VRML V1.0 ascii\nCube { }\n");
    scratch.file("two.wrl", "#VRML V2.0 utf8\nShape { geometry Box { } }\n");
    let run = |line: &str| {
        let line = line.replace("DIR", &scratch.0.display().to_string());
        ivcam(&line).output().unwrap()
    };
    for (line, ending) in [
        ("room.iv -o DIR/room.stl", "`.iv`"),
        ("room.iv --to obj -o DIR/room.ply", "`.obj`"),
        ("room.iv -o DIR/room.iv.gz", "`.iv`"),
        ("room.iv -o DIR/room", "`.iv`"),
        ("two.wrl --to ascii -o DIR/two.iv", "`.wrl`"),
        ("two.wrl --to iv -o DIR/two-new.wrl", "`.iv`"),
        ("two.wrl --to binary -o DIR/two-new.wrl", "`.iv`"),
    ] {
        let line = format!("convert DIR/{line}");
        must_fail(&scratch, &line, &["does not name the format", ending]);
    }
    for line in [
        "two.wrl -o DIR/new.wrl",
        "one.wrl -o DIR/new.iv",
        "room.iv --force -o DIR/room.iv",
    ] {
        let output = run(&format!("convert DIR/{line}"));
        assert!(output.status.success(), "{line}: {}", stderr(&output));
    }
    let written = std::fs::read_to_string(room).unwrap();
    assert!(written.starts_with("#Inventor V2.1 ascii"), "{written}");
}

#[test]
fn vrml97_becomes_inventor_by_the_ending_or_by_the_name_of_the_format() {
    let scratch = Scratch::new("to-inventor");
    let scene = "#VRML V2.0 utf8\nFog { visibilityRange 9 }\nDEF BOX Shape { geometry Box { }
        appearance Appearance { texture PixelTexture { image 1 1 3 0xff0000 } } }\n";
    scratch.file("room.wrl", scene);
    scratch.file("old.wrl", "#VRML V1.0 ascii\nDEF BALL Sphere { }\n");
    let run = |line: &str| {
        let line = line.replace("DIR", &scratch.0.display().to_string());
        let output = ivcam(&format!("convert {line}")).output().unwrap();
        let text = String::from_utf8(output.stdout.clone()).unwrap();
        (output.status.code(), text, stderr(&output))
    };
    let (code, _, said) = run("DIR/room.wrl -o DIR/room.iv --strict");
    assert!(
        code == Some(1) && said.contains("fog is left out"),
        "{said}"
    );
    let written = std::fs::read_to_string(scratch.0.join("room.iv")).unwrap();
    assert!(written.starts_with("#Inventor V2.1 ascii"), "{written}");
    assert!(written.contains("filename \"room-iv-1.png\""), "{written}");
    assert!(scratch.0.join("room-iv-1.png").exists());
    for name in ["iv", "inventor"] {
        let (code, written, said) = run(&format!("DIR/room.wrl --to {name}"));
        assert_eq!(code, Some(0), "{said}");
        assert!(written.starts_with("#Inventor V2.1 ascii"), "{written}");
        assert!(written.contains("image 1 1 3"), "{written}");
        let (_, written, said) = run(&format!("DIR/old.wrl --to {name}"));
        assert!(written.contains("DEF BALL Sphere"), "{written} {said}");
    }
    let (_, written, said) = run("DIR/room.wrl --to ascii");
    assert!(written.starts_with("#VRML V2.0 utf8"), "{written} {said}");
}

#[test]
fn a_conversion_carries_along_what_it_names_or_says_why_not() {
    let scratch = Scratch::new("carried");
    let folders = ["in/maps", "out"].map(|folder| scratch.0.join(folder));
    folders
        .iter()
        .for_each(|folder| std::fs::create_dir_all(folder).unwrap());
    scratch.file(
        "in/part.wrl",
        "#VRML V2.0 utf8\nShape { geometry Box { } }\n",
    );
    scratch.file("in/maps/wood.rgb", "a texture");
    scratch.file("beside.png", "a picture outside the folder");
    let room = "#VRML V2.0 utf8\nInline { url [ \"gone.wrl\", \"part.wrl\" ] }
        Shape { geometry Box { } appearance Appearance {
        texture ImageTexture { url \"maps/wood.rgb\" } } }\n";
    scratch.file("in/room.wrl", room);
    let convert = |options: &str| {
        let folder = scratch.0.display();
        let options = options.replace("-o ", &format!("-o {folder}/"));
        let mut run = ivcam(&format!(
            "convert {folder}/in/{options} --strict --report {folder}/r.json"
        ));
        let run = run.output().unwrap();
        let report = std::fs::read_to_string(scratch.0.join("r.json")).unwrap();
        (run.status.code(), report + &stderr(&run))
    };
    for output in ["room.x3d", "new.wrl"] {
        let (code, said) = convert(&format!("room.wrl -o out/{output}"));
        assert_eq!(code, Some(0), "{said}");
        for name in ["part.wrl", "maps/wood.rgb"] {
            let [from, to] = ["in", "out"].map(|folder| scratch.0.join(folder).join(name));
            assert_eq!(std::fs::read(from).unwrap(), std::fs::read(to).unwrap());
        }
    }
    // A file of another content keeps its place, and one outside the scene's folder stays there.
    scratch.file("out/part.wrl", "another file");
    let (code, said) = convert("room.wrl -o out/room.x3d");
    assert!(
        code == Some(1) && said.contains("part.wrl` is another file"),
        "{said}"
    );
    scratch.file(
        "in/out.wrl",
        &room.replace("maps/wood.rgb", "../beside.png"),
    );
    let (code, said) = convert("out.wrl -o out/out.x3d");
    assert!(
        code == Some(1) && said.contains("outside the scene's folder"),
        "{said}"
    );
}

#[test]
fn a_conversion_names_pictures_after_its_format() {
    let scratch = Scratch::new("left-behind");
    scratch.inventor("part.iv", "Cube { }");
    let texture = "Texture2 { image 1 1 1 0x80 }";
    scratch.inventor(
        "room.iv",
        &format!("File {{ name \"part.iv\" }} {texture} Cube {{ }}"),
    );
    scratch.file("room-1.png", "a photograph");
    std::fs::create_dir(scratch.0.join("other")).unwrap();
    let convert = |output: &str| {
        let folder = scratch.0.display();
        let line = format!("convert {folder}/room.iv -o {folder}/{output}");
        let run = ivcam(&line).output().unwrap();
        assert!(run.status.success(), "{output}: {}", stderr(&run));
    };
    convert("other/room.iv");
    assert!(scratch.0.join("other/part.iv").exists());
    convert("room.obj");
    convert("room.wrl");
    for name in ["room-obj-1.png", "room-wrl-1.png"] {
        assert!(scratch.0.join(name).exists(), "{name}");
    }
    let photograph = std::fs::read_to_string(scratch.0.join("room-1.png")).unwrap();
    assert_eq!(photograph, "a photograph");
}

#[test]
fn a_camera_that_sees_far_more_than_the_lens_is_pointed_out() {
    let scratch = Scratch::new("field");
    scratch.inventor("room.iv", "PerspectiveCamera { heightAngle 1.1 } Cube { }");
    let render = |options: &str| {
        let folder = scratch.0.display();
        let line = format!("render {options} --size 4x4 -o {folder}/a.png {folder}/room.iv");
        stderr(&ivcam(&line).output().unwrap())
    };
    assert!(render("").contains("`--efl 20mm` shows what the camera sees"));
    assert!(!render("--efl 100mm").contains("`--efl"));
    assert!(!render("--lens none").contains("`--efl"));
}

#[test]
fn a_folder_is_converted_once_and_what_fails_does_not_stop_the_rest() {
    let scratch = Scratch::new("convert-folder");
    std::fs::create_dir_all(scratch.0.join("in/b")).unwrap();
    scratch.file("in/a.iv", "#Inventor V2.1 ascii\nDEF BALL Sphere { }\n");
    scratch.file(
        "in/a.wrl",
        "#VRML V2.0 utf8\nFog { visibilityRange 9 }\nShape { geometry Box { } }\n",
    );
    scratch.file("in/b/empty.iv", "#Inventor V2.1 ascii\nSeparator { }\n");
    scratch.file("in/b/broken.iv", "this is not a scene\n");
    let texture = "#Inventor V2.1 ascii\nTexture2 { filename \"gone.png\" }\nCube { }\n";
    scratch.file("in/b/c.iv", texture);
    let run = |line: &str| {
        let line = line.replace("DIR", &scratch.0.display().to_string());
        let output = ivcam(&line).output().unwrap();
        (output.status.code(), stderr(&output))
    };
    let line = "convert DIR/in --to glb -o DIR/out --report DIR/report.json";
    let (code, said) = run(line);
    assert_eq!(code, Some(2), "{said}");
    for part in [
        "broken.iv",
        "empty.iv: nothing to draw",
        "gone.png",
        "5 scenes: 3 converted",
        "1 with nothing to draw",
        "1 failed",
        "1 with losses",
        "1 with missing files",
    ] {
        assert!(said.contains(part), "{part} in {said}");
    }
    for name in ["a.iv.glb", "a.wrl.glb", "b/c.glb"] {
        let bytes = std::fs::read(scratch.0.join("out").join(name)).unwrap();
        assert!(bytes.starts_with(b"glTF"), "{name}");
    }
    let report = std::fs::read_to_string(scratch.0.join("report.json")).unwrap();
    assert!(report.contains("\"feature\": \"fog\""), "{report}");
    let (_, said) = run(line);
    assert!(said.contains("3 up to date"), "{said}");
    let (code, said) = run("convert DIR/in -o DIR/out2");
    assert!(code == Some(2) && said.contains("--to glb"), "{said}");
    let (code, said) = run("convert DIR/in --to glb -o DIR/in");
    assert!(
        code == Some(2) && said.contains("the folder that is read"),
        "{said}"
    );
}

#[test]
fn a_conversion_that_loses_something_fails_only_if_it_is_strict() {
    let scratch = Scratch::new("convert-strict");
    scratch.file(
        "fog.wrl",
        "#VRML V2.0 utf8\nFog { visibilityRange 9 }\nShape { geometry Box { } }\n",
    );
    for (more, expected) in [("", 0), (" --strict", 1)] {
        let line = format!("convert DIR/fog.wrl -o DIR/fog.glb{more}");
        let line = line.replace("DIR", &scratch.0.display().to_string());
        let output = ivcam(&line).output().unwrap();
        assert_eq!(output.status.code(), Some(expected), "{more}");
        assert!(
            stderr(&output).contains("fog is left out"),
            "{}",
            stderr(&output)
        );
    }
    // Inventor has ambient light by default, which glTF has not.
    scratch.inventor("default.iv", "Cube { }");
    scratch.inventor("stated.iv", "Environment { ambientIntensity 0.2 } Cube { }");
    let lost = "the ambient light is left out";
    for (scene, code, start) in [
        ("default", 0, "note: "),
        ("stated", 1, "warning: `Environment`: "),
    ] {
        let line = format!("convert DIR/{scene}.iv -o DIR/{scene}.glb --strict");
        let line = line.replace("DIR", &scratch.0.display().to_string());
        let output = ivcam(&line).output().unwrap();
        assert_eq!(output.status.code(), Some(code), "{scene}");
        let said = stderr(&output);
        assert!(said.starts_with(start) && said.contains(lost), "{said}");
    }
    must_fail(
        &scratch,
        "convert DIR/fog.wrl --to obj",
        &["needs files beside it"],
    );
    must_fail(
        &scratch,
        "convert DIR/fog.wrl -o DIR/a.glb --tolerance 2",
        &["0.0001 to 0.1"],
    );
}

#[test]
fn a_name_made_up_for_a_picture_replaces_no_file() {
    let scratch = Scratch::new("made-up");
    scratch.file("room.iv", "#Inventor V2.1 ascii\nCube { }\n");
    for form in ["render", "-batch", "render"] {
        let run = ivcam(form)
            .current_dir(&scratch.0)
            .args(["--size", "4x4", "--lens", "none", "room.iv"])
            .output()
            .unwrap();
        assert!(run.status.success(), "{}", stderr(&run));
    }
    let names = ["room-2.png", "room-3.png", "room.iv", "room.png"];
    assert_eq!(scratch.names(), names);
    // Runs at the same time take different names.
    let runs = [0; 4].map(|_| {
        let mut command = ivcam("render --size 4x4 --lens none --quiet room.iv");
        command.current_dir(&scratch.0).spawn().unwrap()
    });
    for mut run in runs {
        assert!(run.wait().unwrap().success());
    }
    assert_eq!(scratch.names().len(), 4 + 4);
}

/// A scene with a light, a camera and something to see.
const CUBE: &str = "#Inventor V2.1 ascii\nPerspectiveCamera { position 0.5 0.2 6 focalDistance 5 }\n\
                    DirectionalLight { direction -1 -1 -1 }\nCube { }\n";

/// Runs a command line in which `DIR` stands for the folder, and that must succeed.
fn must_run(scratch: &Scratch, line: &str) -> Output {
    let line = line.replace("DIR", &scratch.0.display().to_string());
    let run = ivcam(&line).output().unwrap();
    assert!(run.status.success(), "{line}: {}", stderr(&run));
    run
}

/// Returns the levels of a PPM picture of 8 bits, without its header.
fn levels(path: &Path) -> Vec<u8> {
    let bytes = std::fs::read(path).unwrap();
    let at = bytes.windows(5).position(|w| w == b"\n255\n").unwrap();
    bytes[at..].to_vec()
}

#[test]
fn the_camera_in_use_is_written_and_makes_the_same_picture() {
    let scratch = Scratch::new("camwrite");
    scratch.file("cube.iv", CUBE);
    let small = "--size 15x10 -j 4 --lens double-gauss --efl 50mm --pupil exit";
    let focused = format!("-f 4.5 -o DIR/a.ppm DIR/cube.iv {small}");
    must_run(&scratch, &format!("-batch -camwrite DIR/old.dat {focused}"));
    let old = levels(&scratch.0.join("a.ppm"));
    must_run(
        &scratch,
        &format!("-batch -camread DIR/old.dat -o DIR/b.ppm DIR/cube.iv {small}"),
    );
    assert!(old == levels(&scratch.0.join("b.ppm")));
    must_run(
        &scratch,
        &format!("render --write-camera DIR/new.dat {focused}"),
    );
    let read = |name: &str| std::fs::read_to_string(scratch.0.join(name)).unwrap();
    assert_eq!(read("old.dat"), read("new.dat"));
    assert!(
        read("new.dat").contains("\n  focalDistance 4.5\n"),
        "{}",
        read("new.dat")
    );
    let far = format!("--focus inf -o DIR/a.ppm DIR/cube.iv {small}");
    let said = stderr(&must_run(
        &scratch,
        &format!("render --write-camera DIR/far.dat {far}"),
    ));
    assert!(said.contains("give `--focus inf` again"), "{said}");
    assert!(read("far.dat").contains("render with --focus inf"));
    assert!(!read("far.dat").contains("focalDistance inf"));
    for (line, part) in [
        ("-camwrite DIR/c.dat DIR/cube.iv", "-batch"),
        ("--aov DIR/c.exr DIR/cube.iv", "-batch"),
        (
            "compare --aov DIR/c.exr DIR/a.ppm DIR/b.ppm",
            "ivcam render",
        ),
        ("render --aov DIR/c.png DIR/cube.iv", "end the name in .exr"),
        (
            "compare --write-camera DIR/c.dat DIR/a.ppm DIR/b.ppm",
            "ivcam render",
        ),
        (
            "render --size 4x4 --solids --write-camera DIR/c.dat -o DIR/c.png DIR/cube.iv",
            "--solids",
        ),
        (
            "render --camera DIR/new.dat --write-camera DIR/./new.dat -o DIR/c.png DIR/cube.iv",
            "overwrite",
        ),
    ] {
        must_fail(&scratch, line, &[part]);
    }
}

/// A denoiser that takes the arguments of `oidnDenoise` and returns one of its inputs.
#[cfg(unix)]
fn denoiser(scratch: &Scratch, name: &str, command: &str) {
    use std::os::unix::fs::PermissionsExt;
    let script = format!(
        "#!/bin/sh\n\
         [ $1 = --help ] && exit\n\
         while [ $# -gt 1 ]; do\n\
         case $1 in --hdr) color=$2;; --alb) albedo=$2;; --nrm) normal=$2;; --output) to=$2;; esac\n\
         shift\n\
         done\n\
         [ $color ] || exec cp ${{albedo:-$normal}} $to\n\
         {command}\n"
    );
    let path = scratch.file(name, &script);
    std::fs::set_permissions(path, PermissionsExt::from_mode(0o700)).unwrap();
}

/// Returns red, green and blue of a picture of 16 bits at its center.
#[cfg(unix)]
fn center(path: &Path) -> [u16; 3] {
    let image = image::open(path).unwrap().into_rgb16();
    image.get_pixel(image.width() / 2, image.height() / 2).0
}

#[cfg(unix)]
#[test]
fn a_denoiser_gets_color_albedo_and_normals_and_its_picture_states_no_error() {
    let scratch = Scratch::new("denoise");
    let camera = "PerspectiveCamera { position 0 0 6 }";
    let body = format!("{camera} Material {{ diffuseColor .8 .4 .2 }} Cube {{ }}");
    scratch.inventor("a.iv", &body);
    for input in ["color", "albedo", "normal"] {
        denoiser(&scratch, input, &format!("cp ${input} $to"));
    }
    let render = |name: &str, options: &str| {
        let line = format!("render --lens none --size 15x11 --depth 16 -o DIR/{name} DIR/a.iv");
        stderr(&must_run(&scratch, &format!("{line} {options}")))
    };
    let said = render("plain.png", "");
    assert!(said.contains("relative error"), "{said}");
    let said = render("same.png", "--denoise=DIR/color --report DIR/report.json");
    assert!(
        said.contains("error unknown: the picture is denoised"),
        "{said}"
    );
    assert!(!said.contains("relative error"), "{said}");
    let pixels = |name: &str| image::open(scratch.0.join(name)).unwrap().into_rgb16();
    assert!(pixels("plain.png") == pixels("same.png"));
    let text = std::fs::read_to_string(scratch.0.join("report.json")).unwrap();
    let report: serde_json::Value = serde_json::from_str(&text).unwrap();
    assert_eq!(report["relative_rmse"], serde_json::Value::Null);
    assert_eq!(report["error_unknown"], "the picture is denoised");
    assert!(
        report["plan"]["denoise"]
            .as_str()
            .unwrap()
            .ends_with("color")
    );
    let metadata =
        String::from_utf8_lossy(&std::fs::read(scratch.0.join("same.png")).unwrap()).into_owned();
    assert!(metadata.contains("unknown: the picture is denoised"));

    render("albedo.png", "--denoise=DIR/albedo --aov DIR/layers.exr");
    let level = |share: f64| (share * 65_535.0).round() as u16;
    assert_eq!(
        center(&scratch.0.join("albedo.png")),
        [0.8, 0.4, 0.2].map(level)
    );
    render("normal.png", "--denoise=DIR/normal");
    assert_eq!(
        center(&scratch.0.join("normal.png")),
        [0.0, 0.0, 1.0].map(level)
    );
    let layers = std::fs::read(scratch.0.join("layers.exr")).unwrap();
    assert!(!String::from_utf8_lossy(&layers).contains("is denoised"));
}

/// The denoiser returns the albedo.
#[cfg(unix)]
#[test]
fn pictures_of_a_folder_and_of_a_catalog_are_denoised_or_say_why_not() {
    let scratch = Scratch::new("denoised-folder");
    let camera = "PerspectiveCamera { position 0 0 6 }";
    let body = format!("{camera} Material {{ diffuseColor .8 .4 .2 }} Cube {{ }}");
    std::fs::create_dir(scratch.0.join("in")).unwrap();
    scratch.inventor("in/a.iv", &body);
    denoiser(&scratch, "albedo", "cp $albedo $to");
    denoiser(&scratch, "fails", "echo no device >&2; exit 1");
    let folder = "render --lens none --size 15x11 --depth 16 DIR/in -o DIR/out";
    must_run(&scratch, &format!("{folder} --denoise=DIR/albedo"));
    let level = |share: f64| (share * 65_535.0).round() as u16;
    let picture = scratch.0.join("out/a.png");
    let albedo = [0.8, 0.4, 0.2].map(level);
    assert_eq!(center(&picture), albedo);
    // Another denoiser makes another picture; one that fails leaves it as it was.
    must_fail(
        &scratch,
        &format!("{folder} --denoise=DIR/fails"),
        &["no device", "without denoising"],
    );
    assert_ne!(center(&picture), albedo);

    let catalog = "catalog --size 30x22 DIR/in -o DIR/catalog";
    must_run(&scratch, &format!("{catalog} --denoise=DIR/albedo"));
    let pictures = scratch.0.join("catalog");
    let found = find_png(&pictures);
    let eight = |v: u16| (v >> 8) as u8;
    let albedo_8 = albedo.map(eight);
    let red = |path: &Path| center(path).map(eight);
    assert!(!found.is_empty() && found.iter().any(|path| red(path) == albedo_8));
    let said = must_run(&scratch, &format!("{catalog} --denoise=DIR/fails"));
    assert!(
        stderr(&said).contains("1 without a picture"),
        "{}",
        stderr(&said)
    );
}

/// The pictures below a folder.
#[cfg(unix)]
fn find_png(folder: &Path) -> Vec<PathBuf> {
    let mut found = Vec::new();
    for entry in std::fs::read_dir(folder).unwrap() {
        let path = entry.unwrap().path();
        if path.is_dir() {
            found.extend(find_png(&path));
        } else if path.extension().is_some_and(|e| e == "png") {
            found.push(path);
        }
    }
    found
}

#[cfg(unix)]
#[test]
fn a_missing_denoiser_is_an_error_before_the_work_and_a_failed_one_leaves_the_picture() {
    let scratch = Scratch::new("no-denoiser");
    scratch.inventor("a.iv", "Cube { }");
    denoiser(&scratch, "fails", "echo no device >&2; exit 1");
    denoiser(&scratch, "silent", "");
    denoiser(&scratch, "short", "head -c 60 $color > $to");
    let render = "render --lens none --size 9x6 -o DIR/a.png DIR/a.iv";
    for (line, part) in [
        (format!("{render} --denoise=DIR/none"), "Open Image Denoise"),
        (
            "pull-focus --denoise=DIR/silent DIR/a.iv".to_owned(),
            "goes with a render",
        ),
        (
            "render --denoise=DIR/none DIR -o DIR/out".to_owned(),
            "Open Image Denoise",
        ),
    ] {
        must_fail(&scratch, &line, &[part]);
    }
    for (name, part) in [("fails", "no device"), ("silent", "9x6"), ("short", "9x6")] {
        let line = format!("{render} --denoise=DIR/{name}");
        let folder = scratch.0.display().to_string();
        let run = ivcam(&line.replace("DIR", &folder)).output().unwrap();
        let said = stderr(&run);
        assert_eq!(run.status.code(), Some(2), "{said}");
        assert!(
            said.contains(part) && said.contains("without denoising"),
            "{said}"
        );
        let picture = scratch.0.join("a.png");
        assert_eq!(image::image_dimensions(&picture).unwrap(), (9, 6));
        std::fs::remove_file(picture).unwrap();
    }
}

#[test]
fn a_frame_with_an_open_shutter_ends_at_the_target_error_of_the_whole_frame() {
    let scratch = Scratch::new("frame-target");
    let camera = "PerspectiveCamera { position 0 0 6 }";
    let light = "PointLight { location 2 3 4 }";
    scratch.inventor("a.iv", &format!("{camera} {light} Cube {{ }}"));
    scratch.file("a.tl", "frames 2\nshutter .5\nfocus 0 4m\nfocus 1 8m\n");
    let line =
        "pull-focus --animate DIR/a.tl --frames 0-1 --size 24x16 --efl 100mm --quiet DIR/a.iv";
    let frame = |folder: &str, options: &str| {
        let line = format!("{line} --folder DIR/{folder} {options}");
        let said = stderr(&must_run(&scratch, &line));
        let file = scratch.0.join(folder).join("00001.png");
        (said, provenance(&file))
    };
    let (said, text) = frame("plain", "");
    assert!(said.is_empty() && text["ivcam:samples"] == "16", "{said}");
    let (said, text) = frame("target", "--target-error 3%");
    let high = text["ivcam:error"].split("to ").nth(1).unwrap();
    let high: f64 = high.trim_end_matches("%)").parse().unwrap();
    assert!(said.is_empty() && high <= 3.0, "{text:?} {said}");
    let samples: u32 = text["ivcam:samples"].parse().unwrap();
    assert!((17..65_536).contains(&samples), "{samples}");
    let (said, _) = frame("limit", "--target-error .1% --samples 16");
    assert!(said.contains("frame 1 may not meet the target"), "{said}");
    let other = format!("{line} --folder DIR/plain --target-error 3%");
    must_fail(&scratch, &other, &["another movie"]);
}

#[test]
fn when_most_rays_are_lost_the_summary_says_how_many_and_what_helps() {
    let scratch = Scratch::new("lost");
    scratch.file("cube.iv", CUBE);
    let line = "-batch --size 12x8 -j 4 -o DIR/a.png DIR/cube.iv";
    let said = stderr(&must_run(&scratch, line));
    let help = "`--pupil exit` aims only where light passes";
    assert_eq!(said.matches(help).count(), 1, "{said}");
    assert!(
        said.contains("% of the rays passed through the lens, "),
        "{said}"
    );
    let exit = stderr(&must_run(&scratch, &format!("{line} --pupil exit")));
    assert!(!exit.contains(help), "{exit}");
}

/// Returns the provenance of a PNG picture.
fn provenance(path: &Path) -> std::collections::BTreeMap<String, String> {
    let file = std::io::BufReader::new(std::fs::File::open(path).unwrap());
    let reader = png::Decoder::new(file).read_info().unwrap();
    let texts = reader.info().utf8_text.iter();
    texts
        .map(|text| (text.keyword.clone(), text.get_text().unwrap()))
        .collect()
}

#[test]
fn metadata_states_the_samples_taken_and_the_pupil_used() {
    let scratch = Scratch::new("truth");
    scratch.file("cube.iv", CUBE);
    let picture = scratch.0.join("a.png");
    let run = |flags: &str| {
        let line =
            format!("render --size 24x16 {flags} --report DIR/a.json -o DIR/a.png DIR/cube.iv");
        must_run(&scratch, &line);
        let report = std::fs::read_to_string(scratch.0.join("a.json")).unwrap();
        let report: serde_json::Value = serde_json::from_str(&report).unwrap();
        (provenance(&picture), report)
    };
    for (flags, taken) in [
        ("--target-error 1000%", 1..=15),
        ("--target-error 0.0001% --samples 32", 32..=32),
        ("--samples 3", 3..=3),
    ] {
        let (texts, report) = run(flags);
        let samples: u64 = texts["ivcam:samples"].parse().unwrap();
        assert!(taken.contains(&samples), "{flags}: {samples}");
        assert_eq!(report["samples"], samples);
        assert_eq!(report["plan"]["samples"], samples.to_string());
    }
    for (flags, pupil) in [
        ("--samples 1", Some("exit pupil")),
        (
            "--samples 1 --lens ideal --efl 50mm --pupil rear",
            Some("exit pupil"),
        ),
        ("--samples 1 --lens none", None),
        ("--samples 1 --solids", Some("rear element, concentric map")),
    ] {
        let (texts, report) = run(flags);
        let stated = texts.get("ivcam:pupil").map(String::as_str);
        assert_eq!(stated, pupil, "{flags}");
        assert_eq!(report["plan"]["pupil"].as_str(), pupil, "{flags}");
    }
}

#[test]
fn the_ending_chooses_the_format_of_a_picture() {
    let scratch = Scratch::new("formats");
    scratch.file("cube.iv", CUBE);
    for ending in ["tif", "tiff", "jpg", "jpeg", "rgb", "sgi"] {
        let line = format!("render --size 13x7 -j 1 --lens none -o DIR/a.{ending} DIR/cube.iv");
        must_run(&scratch, &line);
        let path = scratch.0.join(format!("a.{ending}"));
        if ["rgb", "sgi"].contains(&ending) {
            let bytes = std::fs::read(path).unwrap();
            assert_eq!(bytes[..12], [1, 0xda, 0, 1, 0, 3, 0, 13, 0, 7, 0, 3]);
            assert_eq!(bytes.len(), 512 + 13 * 7 * 3);
        } else {
            assert_eq!(image::image_dimensions(path).unwrap(), (13, 7), "{ending}");
        }
    }
}

#[test]
fn a_hyphen_is_standard_input_and_standard_output() {
    use std::io::Write as _;
    let scratch = Scratch::new("streams");
    scratch.file("cube.iv", CUBE);
    let piped = |line: &str| {
        let mut command = ivcam(line);
        command.current_dir(&scratch.0);
        command.stdin(std::process::Stdio::piped());
        command.stdout(std::process::Stdio::piped());
        command.stderr(std::process::Stdio::piped());
        let mut child = command.spawn().unwrap();
        child
            .stdin
            .take()
            .unwrap()
            .write_all(CUBE.as_bytes())
            .unwrap();
        let run = child.wait_with_output().unwrap();
        assert!(run.status.success(), "{line}: {}", stderr(&run));
        run
    };
    let small = "--size 13x7 -j 1 --lens none";
    let run = piped(&format!("render {small} -o - -"));
    let from_stream = image::load_from_memory(&run.stdout).unwrap().to_rgb8();
    must_run(
        &scratch,
        &format!("render {small} -o DIR/a.png DIR/cube.iv"),
    );
    assert_eq!(
        from_stream,
        image::open(scratch.0.join("a.png")).unwrap().to_rgb8()
    );
    // A name made up for the picture of a stream is not that of a stream.
    piped(&format!("-batch {small} -"));
    assert_eq!(scratch.names(), ["a.png", "cube.iv", "picture.png"]);
    let checked = piped("check -");
    assert!(
        String::from_utf8_lossy(&checked.stdout).contains("Cube"),
        "{checked:?}"
    );
    let converted = piped("convert -o - -");
    assert!(
        converted.stdout.starts_with(b"#Inventor V2.1 ascii"),
        "{converted:?}"
    );
}

#[test]
fn a_lens_at_another_wavelength_has_the_length_and_the_stop_that_are_asked_for() {
    let scratch = Scratch::new("wavelength");
    let line = "lens achromat --efl 50mm --aperture 8 --wavelength 450";
    let sheet = must_run(&scratch, line);
    let sheet = String::from_utf8_lossy(&sheet.stdout);
    let value = |name: &str| {
        let line = sheet.lines().find(|line| line.trim().starts_with(name));
        let line = line.unwrap_or_else(|| panic!("{name}: {sheet}"));
        let word = line.trim()[name.len()..].split_whitespace().next();
        word.unwrap().parse::<f64>().unwrap()
    };
    assert!((value("focal length") - 50.0).abs() < 1e-4, "{sheet}");
    assert!((value("f-number, real rays") - 8.0).abs() < 1e-4, "{sheet}");
}

#[test]
fn a_copy_of_a_stopped_lens_states_its_own_f_number() {
    let scratch = Scratch::new("stopped");
    must_run(&scratch, "lens canon-50 --aperture 11 --write DIR/c.dat");
    let read = must_run(&scratch, "lens DIR/c.dat");
    assert!(!stderr(&read).contains("the file states"), "{read:?}");
}

#[test]
fn a_film_without_an_image_is_named() {
    let scratch = Scratch::new("no-image");
    let read = must_run(&scratch, "lens tessar --defocus -300");
    assert!(stderr(&read).contains("the film has no image"), "{read:?}");
}

/// A pentagon has 5 sin 72° / 2π = 75.7% of the area of the circle through its corners.
#[test]
fn the_summary_states_the_t_number_of_blades() {
    let scratch = Scratch::new("blades");
    scratch.file("cube.iv", CUBE);
    let said = |options: &str| {
        let line = "render --lens double-gauss --aperture f/4 --size 4x3 -j 1 -o DIR/a.png";
        stderr(&must_run(
            &scratch,
            &format!("{line} {options} DIR/cube.iv"),
        ))
    };
    let bladed = said("--blades 5");
    assert!(
        bladed.contains("f/4.00") && bladed.contains("T/4.60"),
        "{bladed}"
    );
    assert!(!said("").contains("T/"));
}

/// Light falls on the lens whether it lights a shape or not, and in every shading model.
#[test]
fn a_light_after_all_shapes_or_without_any_makes_ghosts() {
    let scratch = Scratch::new("idle-light");
    let light = "DirectionalLight { direction .12 -.06 1 }";
    let (cube, camera) = (
        "Translation { translation 0 0 50 } Cube { }",
        "PerspectiveCamera { }",
    );
    for (number, (scene, options)) in [
        (format!("{camera} {light} {cube}"), ""),
        (format!("{camera} {light} {cube}"), "-s flat"),
        (format!("{camera} {cube} {light}"), ""),
        (format!("{camera} {light}"), ""),
    ]
    .into_iter()
    .enumerate()
    {
        scratch.file("a.iv", &format!("#Inventor V2.1 ascii\n{scene}\n"));
        let line = "render --lens double-gauss --ghosts on --coating none --size 9x6 -j 1";
        let run = must_run(&scratch, &format!("{line} {options} -o DIR/a.png DIR/a.iv"));
        let said = stderr(&run);
        assert!(
            said.contains("ghosts ") && said.contains("% of the lights'"),
            "{number}: {said}"
        );
        assert!(
            !said.contains("exact") && !said.contains("light no shape"),
            "{number}: {said}"
        );
    }
}

#[test]
fn a_region_is_that_part_of_the_picture() {
    let scratch = Scratch::new("region");
    scratch.file("cube.iv", CUBE);
    let line = "render --size 40x27 -j 4 --ghosts on --coating none";
    must_run(&scratch, &format!("{line} -o DIR/whole.png DIR/cube.iv"));
    let part = format!("{line} --region 11,6,17,13 -o DIR/part.png DIR/cube.iv");
    must_run(&scratch, &part);
    let read = |name: &str| image::open(scratch.0.join(name)).unwrap().to_rgb8();
    let cut = image::imageops::crop_imm(&read("whole.png"), 11, 6, 17, 13).to_image();
    assert_eq!(read("part.png"), cut);
    assert_eq!(
        provenance(&scratch.0.join("part.png"))["ivcam:region"],
        "11,6,17,13"
    );
    let to = "-o DIR/a.png DIR/cube.iv";
    for (line, part) in [
        (
            format!("render --size 9x9 --region 8,0,2,1 {to}"),
            "not inside",
        ),
        (
            format!("render --region 1,2,3 {to}"),
            "left,top,width,height",
        ),
        (
            format!("render --diffraction on --region 1,2,3,4 {to}"),
            "--diffraction",
        ),
        ("converge --region 0,0,9,9 DIR/cube.iv".into(), "--region"),
        (
            "compare --region 0,0,9,9 --fit DIR/c.dat DIR/cube.iv DIR/whole.png".into(),
            "--region",
        ),
    ] {
        must_fail(&scratch, &line, &[part]);
    }
}

#[test]
fn options_of_one_render_are_refused_by_a_movie_and_a_convergence_run() {
    let scratch = Scratch::new("of-one-render");
    scratch.file("cube.iv", CUBE);
    let pull = "pull-focus --from 1 --to 2";
    for (command, option) in [
        (pull, "--report DIR/r.json"),
        (pull, "--progress json"),
        ("converge", "--report DIR/r.json"),
        ("converge", "--progress json"),
        ("converge", "--time 1s"),
        ("converge", "--sampler blue"),
        ("converge", "--depth 16"),
        ("converge", "--response linear"),
        ("converge", "--white-balance 5000"),
    ] {
        let name = option.split(' ').next().unwrap();
        let line = format!("{command} {option} DIR/cube.iv");
        must_fail(&scratch, &line, &[name, "is not for `ivcam"]);
    }
}

#[test]
fn options_and_tracks_without_effect_on_a_movie_are_named() {
    let scratch = Scratch::new("movie-warnings");
    scratch.file("cube.iv", CUBE);
    scratch.file("a.tl", "frames 2\nfocus 0 2\nzoom 0 1\nzoom 1 2\n");
    let pull = "--from 2 --to 4 --frames 2";
    let lens = "--lens achromat";
    for (number, (options, part)) in [
        (
            format!("{pull} --lens none"),
            "without a lens, `--from` and `--to` do nothing",
        ),
        (
            format!("{pull} --focus 3"),
            "`--focus` does nothing, because `--from` and `--to` set it",
        ),
        (
            format!("--animate DIR/a.tl {lens} --focus 3"),
            "`--focus` does nothing, because the track `focus` sets it",
        ),
        (
            format!("--animate DIR/a.tl {lens} --efl 30mm"),
            "`--efl` and the track `zoom` both scale the lens",
        ),
        (
            "--animate DIR/a.tl --lens ideal".into(),
            "with an ideal lens, the track `zoom` does nothing",
        ),
    ]
    .into_iter()
    .enumerate()
    {
        let line = format!("pull-focus {options} --size 4x3 --samples 1 -o DIR/{number}.png");
        let said = stderr(&must_run(&scratch, &format!("{line} DIR/cube.iv")));
        assert!(said.contains(part), "{options}: {said}");
    }
    let line = "pull-focus --animate DIR/a.tl --ease distance DIR/cube.iv";
    must_fail(&scratch, line, &["--ease"]);
}

#[test]
fn options_without_effect_on_a_picture_are_named_or_refused() {
    let scratch = Scratch::new("idle");
    scratch.file("cube.iv", CUBE);
    let render = "render --lens none --size 4x3";
    for (options, part) in [
        ("-s r --studio -o DIR/a.png", "`--studio` has no light"),
        ("--response srgb -o DIR/a.exr", "`--response` is only noted"),
        (
            "--response srgb --white-balance 3200K -o DIR/a.exr",
            "`ivcam expose",
        ),
        (
            "--sampler center --samples 16 -o DIR/a.png",
            "all samples of a pixel by `--sampler center` are equal",
        ),
        ("--touch Cube@5s -o DIR/a.png", "comes after 0 s"),
        (
            "-s f --headlight=on -o DIR/a.png",
            "`--headlight` does nothing",
        ),
        (
            "-s n --texture-filter nearest -o DIR/a.png",
            "`--texture-filter` does nothing",
        ),
        (
            "-s p --sky 30 -o DIR/a.png",
            "`--shading path` uses such options",
        ),
    ] {
        let said = stderr(&must_run(
            &scratch,
            &format!("{render} {options} DIR/cube.iv"),
        ));
        assert!(said.contains(part), "{options}: {said}");
    }
    scratch.inventor("dark.iv", "Cube { }");
    let line = format!("{render} -s r --studio -o DIR/a.png DIR/dark.iv");
    let dark = stderr(&must_run(&scratch, &line));
    assert!(
        dark.contains("headlight: on") && !dark.contains("--studio lights"),
        "{dark}"
    );
    let solids = "render --size 4x3 --solids -s p -o DIR/a.png DIR/cube.iv";
    must_fail(&scratch, solids, &["does not refract"]);
    let line = format!("{render} --sampler center --target-error 1% -o DIR/a.png DIR/cube.iv");
    let run = ivcam(&line.replace("DIR", &scratch.0.display().to_string()))
        .output()
        .unwrap();
    assert_eq!(run.status.code(), Some(2));
    assert!(
        stderr(&run).contains("no noise to measure"),
        "{}",
        stderr(&run)
    );
}

#[test]
fn an_output_of_another_type_than_its_name_is_refused() {
    let scratch = Scratch::new("endings");
    scratch.file("cube.iv", CUBE);
    for (line, part) in [
        ("lens biogon achromat --sheet DIR/a.svg", "a page of HTML"),
        ("lens biogon achromat --sheet DIR/a.pdf", "a page of HTML"),
        ("lens biogon --as-scene DIR/a.glb", "end the name in .iv"),
        (
            "converge --svg DIR/a.png DIR/cube.iv",
            "end the name in .svg",
        ),
        ("render DIR -o -", "`-o -` is standard output"),
        ("convert DIR --to glb -o -", "`-o -` is standard output"),
        ("catalog DIR -o -", "`-o -` is standard output"),
        ("gallery DIR/cube.iv -o -", "`-o -` is standard output"),
        ("compare DIR DIR -o -", "`-o -` is standard output"),
        ("lens biogon --curves", "--json"),
        ("lens biogon --trials 9", "--tolerance"),
        ("lens biogon --film-at best", "--batch"),
    ] {
        must_fail(&scratch, line, &[part]);
    }
    assert_eq!(scratch.names(), ["cube.iv"]);
}

#[test]
fn a_movie_without_a_name_does_not_replace_a_movie() {
    let scratch = Scratch::new("movie-names");
    scratch.file("cube.iv", CUBE);
    let run = |number: usize| {
        let line = "pull-focus cube.iv --from 2 --to 4 --frames 2 --size 4x3 --samples 1";
        let mut command = ivcam(line);
        // Without a program path there is no ffmpeg.
        command.current_dir(&scratch.0).env("PATH", &scratch.0);
        let output = command.output().unwrap();
        assert!(output.status.success(), "{number}: {}", stderr(&output));
        let movies = scratch.names();
        movies
            .into_iter()
            .filter(|name| name.ends_with(".png"))
            .collect::<Vec<_>>()
    };
    assert_eq!(run(1), ["cube.png"]);
    let first = std::fs::read(scratch.0.join("cube.png")).unwrap();
    assert_eq!(run(2), ["cube-2.png", "cube.png"]);
    assert_eq!(std::fs::read(scratch.0.join("cube.png")).unwrap(), first);
}

/// The script is run where no program but the shell is found, so without ffmpeg.
#[cfg(unix)]
#[test]
fn the_papers_movie_is_made_without_ffmpeg() {
    let scratch = Scratch::new("movie");
    for folder in ["scenes", "camera"] {
        std::os::unix::fs::symlink(root().join(folder), scratch.0.join(folder)).unwrap();
    }
    let script = |arguments: &[&str]| {
        let mut command = Command::new("/bin/sh");
        command
            .arg("scenes/livroom/pull-focus.sh")
            .args(arguments)
            .current_dir(&scratch.0)
            .env("PATH", &scratch.0)
            .env("IVCAM", env!("CARGO_BIN_EXE_ivcam"))
            .env("FRAMES", "2")
            .env("SAMPLES", "1");
        command.output().unwrap()
    };
    let run = script(&["small.png", "--size", "6x4"]);
    assert!(run.status.success(), "{}", stderr(&run));
    let movie = std::fs::read(scratch.0.join("small.png")).unwrap();
    let frames = movie.windows(8).position(|w| w == b"acTL\0\0\0\x02");
    assert!(frames.is_some() && !stderr(&run).contains("ffmpeg"));
    // The film of the paper's size is only begun: the folder of its frames cannot be made.
    std::fs::write(scratch.0.join("pull-focus-frames"), "in the way").unwrap();
    let said = stderr(&script(&[]));
    assert!(
        said.contains("pull-focus.png") && said.contains("With ffmpeg"),
        "{said}"
    );
}

/// The bits of a picture, as a hash (FNV-1a, 64 bits) of its exposures.
fn exposures_hash(path: &Path) -> u64 {
    let image = exr::prelude::read_first_flat_layer_from_file(path).unwrap();
    let channels = image.layer_data.channel_data.list;
    let values = channels.iter().flat_map(|c| c.sample_data.values_as_f32());
    values.fold(0xcbf2_9ce4_8422_2325, |hash: u64, value| {
        let bytes = value.to_bits().to_le_bytes();
        bytes.iter().fold(hash, |hash, byte| {
            (hash ^ u64::from(*byte)).wrapping_mul(0x0100_0000_01b3)
        })
    })
}

/// The hash was the same on a processor with AVX-512 and on emulated ones without AVX.
#[cfg(target_arch = "x86_64")]
#[test]
fn portable_arithmetic_gives_the_same_bits_on_every_processor() {
    let scratch = Scratch::new("portable");
    scratch.file("cube.iv", CUBE);
    let line = "render --arithmetic portable --size 30x20 --samples 8 --lens telephoto --coating mgf2 \
                --dispersion on --adaptive -o DIR/a.exr DIR/cube.iv";
    must_run(&scratch, line);
    assert_eq!(
        exposures_hash(&scratch.0.join("a.exr")),
        0xc0f1_1d44_d46a_713d
    );
    must_fail(
        &scratch,
        "render --arithmetic exact DIR/cube.iv",
        &["fast or portable"],
    );
    must_fail(
        &scratch,
        "render --exposure 1e39 DIR/cube.iv",
        &["from 1e-30 to 1e30"],
    );
}

#[test]
fn the_stability_tables_hold_and_unknown_tables_are_errors() {
    let run = ivcam("stability lens --json").output().unwrap();
    assert!(run.status.success(), "{}", stderr(&run));
    let tables: serde_json::Value = serde_json::from_slice(&run.stdout).unwrap();
    assert!(tables["lens"].as_array().unwrap().len() > 40 && tables["scene"].is_null());
    let run = ivcam("stability scene --markdown").output().unwrap();
    let table = String::from_utf8(run.stdout).unwrap();
    assert!(table.starts_with("| scene | expected |") && table.contains("cases hold"));
    assert_eq!(
        ivcam("stability lenses").output().unwrap().status.code(),
        Some(2)
    );
}

#[cfg(feature = "scripts")]
#[test]
fn what_a_script_prints_is_a_note_of_check() {
    let scratch = Scratch::new("printed");
    let program = "javascript: function initialize() { print('hello'); }";
    let scene = format!("#VRML V2.0 utf8\nScript {{ url \"{program}\" }}\n");
    scratch.file("a.wrl", &scene);
    let said = stderr(&must_run(&scratch, "check DIR/a.wrl"));
    assert!(said.contains("hello"), "{said}");
}

#[cfg(unix)]
#[test]
fn a_name_that_is_not_text_is_named() {
    use std::os::unix::ffi::OsStrExt as _;
    let mut command = ivcam("render");
    let run = command
        .arg(std::ffi::OsStr::from_bytes(b"a\xff.iv"))
        .output()
        .unwrap();
    assert_eq!(run.status.code(), Some(2));
    assert!(stderr(&run).contains(r#""a\xFF.iv""#), "{}", stderr(&run));
}

#[cfg(target_os = "linux")]
#[test]
fn help_that_cannot_be_written_is_an_error() {
    for words in ["help", "--help", "--version", "check --help", "-help"] {
        let full = std::fs::File::create("/dev/full").unwrap();
        let run = ivcam(words).stdout(full).output().unwrap();
        assert_eq!(run.status.code(), Some(2), "{words}");
        assert!(stderr(&run).contains("standard output"), "{words}");
    }
}

/// The picture's name is a link to a device on which no byte has room.
#[cfg(target_os = "linux")]
#[test]
fn a_picture_that_cannot_be_written_is_kept_as_its_exposures() {
    let scratch = Scratch::new("kept");
    let scene = scratch.inventor("a.iv", "PerspectiveCamera { position 0 0 4 } Cube { }");
    let kept = scratch.0.join("kept");
    std::fs::create_dir(&kept).unwrap();
    let full = scratch.0.join("full.png");
    std::os::unix::fs::symlink("/dev/full", &full).unwrap();
    let render = |output: &Path| {
        let mut command = ivcam("render --quiet --size 18x12 --samples 1 --lens none -o");
        command.arg(output).arg(&scene).env("TMPDIR", &kept);
        command.output().unwrap()
    };
    let run = render(&full);
    let said = stderr(&run);
    assert_eq!(run.status.code(), Some(2), "{said}");
    let exposures = kept.join("full.exr");
    let help = format!("`ivcam expose {} -o OUTPUT`", exposures.display());
    assert!(
        said.contains("No space left") && said.contains(&help),
        "{said}"
    );
    let [direct, later] = ["direct.png", "later.png"].map(|name| scratch.0.join(name));
    assert!(render(&direct).status.success());
    let mut expose = ivcam("expose -o");
    let run = expose.arg(&later).arg(&exposures).output().unwrap();
    assert!(run.status.success(), "{}", stderr(&run));
    let pixels = |path: &Path| image::open(path).unwrap().to_rgb8();
    assert_eq!(pixels(&direct), pixels(&later));
}

#[test]
fn a_folder_of_lenses_is_surveyed_as_text_json_csv_and_a_page() {
    let scratch = Scratch::new("survey");
    scratch.file("a.dat", "50 5 N-BK7 20\n-50 45 1 20\n");
    scratch.file("broken.seq", "RDM\nS 5 5 NOGLASS99\n");
    scratch.file("notes.txt", "no lens\n");
    std::fs::create_dir_all(scratch.0.join("sub")).unwrap();
    scratch.file("sub/b.dat", "100 5 1.5 20\n0 45 1 20\n");
    let folder = scratch.0.to_str().unwrap();
    let run = |options: &str| {
        let output = ivcam(&format!("lens {folder} {options}")).output().unwrap();
        assert!(output.status.success(), "{}", stderr(&output));
        String::from_utf8(output.stdout).unwrap()
    };
    let text = run("");
    assert!(text.contains("2 lenses, 1 file not read"), "{text}");
    assert!(
        text.contains("NOGLASS99") && !text.contains("notes"),
        "{text}"
    );
    let rows: serde_json::Value = serde_json::from_str(&run("--json")).unwrap();
    // f = R/(n − 1) of a plane and a sphere of 100 mm.
    let efl = |row: &serde_json::Value| row["efl"].as_f64().unwrap();
    assert!((efl(&rows[2]) - 200.0).abs() < 1e-9, "{rows}");
    assert!((efl(&rows[0]) - 49.2).abs() < 0.1 && rows[1]["error"].is_string());
    let files = ["lenses.csv", "lenses.html"].map(|name| scratch.0.join(name));
    let [csv, page] = files.each_ref().map(|path| path.to_str().unwrap());
    run(&format!("--csv {csv} --sheet {page}"));
    let [csv, page] = files.map(|path| std::fs::read_to_string(path).unwrap());
    assert_eq!(csv.lines().count(), 4, "{csv}");
    assert_eq!(page.matches("<svg").count(), 2);
    let refused = ivcam(&format!("lens {folder} --psf a.png"))
        .output()
        .unwrap();
    assert!(stderr(&refused).contains("needs one lens"));
}

#[test]
fn lenses_are_listed_by_a_word_and_one_that_is_too_small_for_the_film_says_so() {
    let scratch = Scratch::new("cover");
    let listed = ivcam("lens nikon").output().unwrap();
    let listed = String::from_utf8(listed.stdout).unwrap();
    assert!(
        listed.contains("nikkor-28") && !listed.contains("biogon"),
        "{listed}"
    );
    let scene = scratch.inventor("a.iv", "Cube { }");
    let picture = scratch.0.join("a.png");
    let said = |options: &str| {
        let line = format!(
            "render {} --lens angenieux-50 {options} --size 6x4 --samples 1 -o {}",
            scene.display(),
            picture.display()
        );
        stderr(&ivcam(&line).output().unwrap())
    };
    assert!(said("--efl 35mm").contains("stay black"));
    assert!(!said("--efl 35mm --film 18x12").contains("stay black"));
}

/// What a user of other programs, or one in a hurry, may write, and what the answer says is wrong
/// and what to do. `SCENE`, `LENS`, `CAMERA`, `PICTURE`, `TEXT`, `FBX` and `ZIP` stand for files.
const MISTAKES: [(&str, &str, &str); 102] = [
    (
        "render SCENE --fstopp 2",
        "no option `--fstopp`",
        "`--fstop`",
    ),
    ("render SCENE --width 30", "no option `--width`", "`--size"),
    (
        "render SCENE --hdri PICTURE",
        "no option `--hdri`",
        "`--environment-light",
    ),
    (
        "render SCENE --pinhole",
        "no option `--pinhole`",
        "`--lens none`",
    ),
    ("render SCENE --ev 1", "no option `--ev`", "`--exposure"),
    (
        "render SCENE --shading path --sun-size 90",
        "`--sun-size 90`",
        "from 0 to below 90",
    ),
    (
        "render SCENE --xyzzy",
        "no option `--xyzzy`",
        "`ivcam render --help`",
    ),
    (
        "check SCENE --xyzzy",
        "no option `--xyzzy`",
        "`ivcam check --help`",
    ),
    (
        "-batch SCENE --xyzzy",
        "no option `--xyzzy`",
        "`ivcam render --help`",
    ),
    (
        "render SCENE --fov 60 --efl 50mm",
        "`--fov` and `--efl`",
        "leave one out",
    ),
    (
        "render SCENE --shading path --sky 30 --environment-light background",
        "`--environment-light` and `--sky`",
        "leave one out",
    ),
    (
        "render SCENE --fov 180",
        "`--fov 180` is not an angle",
        "60",
    ),
    (
        "render SCENE SCENE",
        "one word too many",
        "a folder of scenes",
    ),
    ("render SCENE out.png", "one word too many", "`-o out.png`"),
    ("convert SCENE out.glb", "one word too many", "`-o out.glb`"),
    (
        "compare SCENE SCENE --ppd -3",
        "one word too many",
        "`--option=-3`",
    ),
    ("render SCENE LENS", "one word too many", "`--lens"),
    ("render", "no scene is named", "`ivcam render --help`"),
    ("-batch -j SCENE", "no scene is named", "`-j` takes `"),
    ("render SCENE --lens", "`--lens` has no value", "LENS"),
    (
        "render SCENE --focus --lens ideal",
        "`--focus` wants a distance",
        "`--lens` is an option",
    ),
    ("rendr SCENE", "no command and no scene `rendr`", "`render`"),
    ("render LENS", "is a lens, not a scene", "`--lens"),
    (
        "render PICTURE",
        "is a picture, not a scene",
        "`ivcam compare",
    ),
    (
        "render SCENE --camera LENS",
        "is a lens, not a camera",
        "`--lens",
    ),
    (
        "render SCENE --lens SCENE",
        "is a scene or a camera, not a lens",
        "`ivcam render",
    ),
    (
        "render SCENE --lens CAMERA",
        "is a scene or a camera, not a lens",
        "`--camera",
    ),
    (
        "render SCENE --lens PICTURE",
        "is a picture, not a lens",
        "`ivcam compare",
    ),
    (
        "lens SCENE",
        "is a scene or a camera, not a lens",
        "`ivcam render",
    ),
    (
        "compare SCENE PICTURE",
        "is a scene or a camera, not a picture",
        "`--fit",
    ),
    (
        "compare PICTURE LENS",
        "is a lens, not a picture",
        "`ivcam lens",
    ),
    (
        "compare PICTURE PICTURE -o difference.png",
        "`-o` has nothing to write",
        "`--difference FILE`",
    ),
    (
        "compare PICTURE PICTURE --report r.json",
        "`--report` has no effect",
        "`--json`",
    ),
    (
        "compare PICTURE PICTURE --lens nosuch",
        "`--lens` is for a photograph",
        "`--fit FILE.dat`, where NEW is a scene, and with a folder of scenes",
    ),
    (
        "compare PICTURE PICTURE --samples 4",
        "`--samples` is for a photograph",
        "`--fit FILE.dat`",
    ),
    (
        "compare PICTURE PICTURE --progress json",
        "`--progress` has no effect",
        "`--quiet`",
    ),
    (
        "compare PICTURE PICTURE --limit sim=0.9",
        "there is no measure `sim`",
        "`ssim`",
    ),
    (
        "compare PICTURE PICTURE --sheet s.html",
        "cannot tell the sheet's format",
        "a page is made of two folders",
    ),
    (
        "compare PICTURE PICTURE --difference d.jpg",
        "a difference has signs",
        ".exr",
    ),
    (
        "compare PICTURE PICTURE --pair p.csv",
        "`--pair` is for two folders",
        "-o REPORT/",
    ),
    (
        "compare PICTURE PICTURE --force",
        "`--force` is for two folders",
        "-o REPORT/",
    ),
    (
        "compare SCENE PICTURE --fit f.dat --align",
        "`--align` has no effect with `--fit`",
        "leave it out",
    ),
    (
        "compare SCENE PICTURE --fit f.dat -o p.exr",
        "an EXR holds exposures",
        "`ivcam render`",
    ),
    (
        "compare FOLDER PICTURE -o r",
        "is a folder",
        "two folders with `-o REPORT/`",
    ),
    (
        "compare FOLDER FOLDER",
        "there is no output folder",
        "`-o OUT/`",
    ),
    (
        "compare FOLDER FOLDER -o r --sheet s.png",
        "`--sheet` is for two pictures",
        "every pair",
    ),
    (
        "compare FOLDER FOLDER -o r --lens wide-angle",
        "`--lens` is for a photograph",
        "a folder of scenes",
    ),
    (
        "compare FOLDER FOLDER -o r --report r.json",
        "`--report` has no effect",
        "report.json and report.csv",
    ),
    (
        "compare FOLDER FOLDER -o r --sort size",
        "there is no measure `size`",
        "there is mse",
    ),
    (
        "render TEXT",
        "no scene of a known format",
        "`#Inventor V2.1 ascii`",
    ),
    (
        "lens double-gauss --export blender",
        "no export format `blender`",
        "`osl`",
    ),
    (
        "pull-focus SCENE --from 1 --to 2 --ease x",
        "`--ease x` is not one of",
        "`diopters smooth`",
    ),
    ("render SCENE --focus 5'13\"", "is not a distance", "40cm"),
    (
        "render SCENE --size 30",
        "`--size 30` is not a size",
        "360x240",
    ),
    (
        "render SCENE --samples ten",
        "`--samples ten` is not",
        "a number",
    ),
    (
        "render SCENE -o picture.xyz",
        "cannot tell the picture's format",
        ".png",
    ),
    (
        "merge a b",
        "`--output <FILE>` is missing",
        "`ivcam merge --help`",
    ),
    (
        "render SCENE --lens TEXT",
        "the lens has no surfaces",
        "file of Zemax",
    ),
    ("lens TEXT", "the lens has no surfaces", "file of Zemax"),
    (
        "render SCENE --camera TEXT",
        "no camera in the file",
        "`PerspectiveCamera",
    ),
    ("render FBX", "no scene of a known format", "glTF"),
    ("render ZIP", "no scene of a known format", "unpack it"),
    (
        "render https://example.org/a.iv",
        "is a network address",
        "download it",
    ),
    ("render nosuch.iv", "`nosuch.iv`: no such file", ""),
    ("render SCENE -o FOLDER", "is a folder", "name of a file"),
    (
        "render SCENE -o nosuch/a.png",
        "there is no folder `nosuch`",
        "",
    ),
    (
        "render SCENE --force",
        "`--force` is for a folder of scenes",
        "leave it out",
    ),
    (
        "render SCENE --aperture 0",
        "`--aperture 0` is not an f-number",
        "f/8",
    ),
    (
        "render SCENE --efl fifty",
        "`--efl fifty` is not a focal length",
        "20mm",
    ),
    (
        "render SCENE --film 35mm",
        "`--film 35mm` is not a film size",
        "36x24",
    ),
    (
        "render SCENE --exposure -1",
        "`--exposure -1` is not a factor",
        "a stop less 0.5",
    ),
    (
        "render SCENE --focus far",
        "`--focus far` is not a distance",
        "inf",
    ),
    (
        "render SCENE --shutter 60",
        "`--shutter 60` is not a time",
        "1/60",
    ),
    (
        "render SCENE --iso 400",
        "need an open shutter",
        "`--shutter 1/60`",
    ),
    (
        "render SCENE --lens none --shutter 1/60",
        "a pinhole has no aperture",
        "give a lens",
    ),
    (
        "render SCENE --white-balance daylight",
        "is not a color temperature",
        "5500K for daylight",
    ),
    (
        "render SCENE --response kodak",
        "no response named `kodak`",
        "use linear, srgb",
    ),
    (
        "render SCENE --shading raytrace",
        "is not a shading model",
        "r (recursive)",
    ),
    (
        "render SCENE --target-error 5",
        "is not a relative error",
        "1%",
    ),
    (
        "render SCENE --ghosts yes",
        "`--ghosts yes` is not one of",
        "on, off",
    ),
    (
        "render SCENE --every 5m",
        "`--every` needs the file",
        "`--checkpoint FILE`",
    ),
    (
        "render SCENE --size 99999x99999",
        "is too large",
        "65536 pixels",
    ),
    (
        "catalog",
        "`--output <OUT>` and `<FOLDER>` are missing",
        "`ivcam catalog --help`",
    ),
    (
        "catalog SCENE -o q",
        "is not a folder",
        "`ivcam check` reads one scene",
    ),
    (
        "catalog FOLDER -o q --search nosuch",
        "there is no folder `nosuch`",
        "`--search`",
    ),
    (
        "catalog FOLDER -o q --converted nosuch",
        "there is no folder `nosuch`",
        "`--converted`",
    ),
    (
        "catalog FOLDER -o q --about PICTURE",
        "is not UTF-8",
        "save the text",
    ),
    (
        "render SCENE --search nosuch -o q.png",
        "there is no folder `nosuch`",
        "`--search`",
    ),
    (
        "compare FOLDER nosuch -o q",
        "there is no file or folder `nosuch`",
        "two folders with `-o REPORT/`",
    ),
    (
        "compare PICTURE",
        "no old picture is named",
        "`ivcam compare --help`",
    ),
    (
        "merge PICTURE -o q.exr",
        "is not a checkpoint",
        "`ivcam render --checkpoint",
    ),
    (
        "convert SCENE -o s.fbx",
        "does not name the format",
        "`.glb`",
    ),
    ("nodes Kube", "no node class `Kube`", "`Cube`"),
    ("help rendr", "no command `rendr`", "`render`"),
    (
        "gallery SCENE -o OUT --fov 30",
        "`--fov` is for one picture",
        "leave it out",
    ),
    (
        "converge SCENE --methods 1999+adaptive",
        "cannot be used with the sampler `jittered`",
        "`sobol+adaptive`",
    ),
    (
        "converge SCENE --methods jittered --adaptive",
        "cannot be used with the sampler `jittered`",
        "`sobol+adaptive`",
    ),
    (
        "render -- SCENE --size 30x20",
        "`--size` is after `--`",
        "before `--`",
    ),
    (
        "pull-focus SCENE --from 1 --to 2 --claim-expiry 2h",
        "is not a time from 1s to 1h",
        "",
    ),
    (
        "render SCENE -o q.png --report -",
        "`--report -`",
        "the name of a file",
    ),
    (
        "pull-focus SCENE",
        "`--from` is missing",
        "`--animate FILE`",
    ),
    (
        "pull-focus SCENE --from 1 --to 2 -o m.avi",
        "cannot tell the movie's format",
        ".mp4",
    ),
];

#[test]
fn mistakes_are_answered_by_what_is_wrong_and_what_to_do() {
    let scratch = Scratch::new("mistakes");
    let picture = scratch.0.join("old.png");
    image::RgbImage::new(4, 3).save(&picture).unwrap();
    let folder = scratch.0.join("pictures");
    std::fs::create_dir(&folder).unwrap();
    std::fs::copy(&picture, folder.join("old.png")).unwrap();
    let files = [
        ("FOLDER", folder),
        ("SCENE", scratch.inventor("scene.iv", "Cube { }")),
        ("LENS", root().join("lenses/normal/double-gauss.dat")),
        ("CAMERA", root().join("camera/cam-1.dat")),
        ("PICTURE", picture),
        ("TEXT", scratch.file("notes.txt", "hello\n")),
        ("FBX", scratch.file("scene.fbx", "Kaydara FBX Binary")),
        ("ZIP", scratch.file("scene.zip", "PK\u{3}\u{4}")),
    ];
    let before = scratch.names();
    for (line, wrong, help) in MISTAKES {
        let words = line.split_whitespace().map(|word| {
            let file = files.iter().find(|(name, _)| *name == word);
            file.map_or(PathBuf::from(word), |(_, path)| path.clone())
        });
        let mut command = Command::new(env!("CARGO_BIN_EXE_ivcam"));
        let run = command
            .current_dir(&scratch.0)
            .args(words)
            .output()
            .unwrap();
        let said = stderr(&run);
        assert_eq!(run.status.code(), Some(2), "{line}\n{said}");
        assert!(said.starts_with("error: "), "{line}\n{said}");
        assert!(
            said.contains(wrong) && said.contains(help),
            "{line}\n{said}"
        );
        assert!(!said.contains("For more information"), "{line}\n{said}");
    }
    assert_eq!(scratch.names(), before, "no mistake leaves a file behind");
}

#[test]
fn words_of_photographers_and_of_other_programs_mean_the_same() {
    let scratch = Scratch::new("words");
    let scene = scratch.inventor("scene.iv", "PerspectiveCamera { } Cube { }");
    let text = scene.to_string_lossy();
    let picture = |words: &str| {
        let out = scratch.0.join("a.png");
        let line = format!("{words} --size 9x6 --quiet -o");
        let run = ivcam(&line).arg(&out).output().unwrap();
        assert!(run.status.success(), "{words}: {}", stderr(&run));
        image::open(out).unwrap().into_rgb8().into_raw()
    };
    for (ours, theirs) in [
        ("--samples 2", "--spp 2"),
        ("--samples 1 --aperture f/8", "--spp 1 -f/8"),
        ("--samples 1 --aperture 8", "--spp 1 --fstop 8"),
        ("--samples 1 --efl 50mm", "--spp 1 --focal-length 50mm"),
        ("--samples 1 --efl 18mm", "--spp 1 --fov 90"),
        ("--samples 1 --focus 1.8288", "--spp 1 --focus 6'"),
        ("--samples 1 --focus 1.6764m", "--spp 1 --focus 5'6\""),
    ] {
        let ours = picture(&format!("render {text} {ours}"));
        assert_eq!(
            ours,
            picture(&format!("render {text} {theirs}")),
            "{theirs}"
        );
    }
    // In the 1999 form a name without an ending is that of a PNG.
    let line = format!("-batch {text} -j 1 --size 9x6 --quiet -o");
    let run = ivcam(&line).arg(scratch.0.join("out")).output().unwrap();
    assert!(run.status.success(), "{}", stderr(&run));
    assert!(scratch.0.join("out.png").exists());
}

#[test]
fn a_depth_that_the_format_does_not_have_is_told() {
    let scratch = Scratch::new("depth");
    let scene = scratch.inventor("scene.iv", "Cube { }");
    for (name, told) in [("a.jpg", true), ("a.exr", true), ("a.png", false)] {
        let line = format!("render {} --size 6x4 --depth 16 -o", scene.display());
        let run = ivcam(&line).arg(scratch.0.join(name)).output().unwrap();
        let said = stderr(&run);
        assert!(run.status.success(), "{said}");
        assert_eq!(
            said.contains("`--depth 16` has no effect"),
            told,
            "{name}: {said}"
        );
    }
}

#[test]
fn manual_pages_and_completions_know_every_command_and_option() {
    let scratch = Scratch::new("man");
    let run = ivcam("man -o").arg(&scratch.0).output().unwrap();
    assert!(run.status.success(), "{}", stderr(&run));
    let names = scratch.names();
    for name in [
        "ivcam.1",
        "ivcam-render.1",
        "ivcam-lens.1",
        "ivcam-catalog.1",
    ] {
        assert!(names.iter().any(|n| n == name), "{names:?}");
    }
    let page = |name: &str| std::fs::read_to_string(scratch.0.join(name)).unwrap();
    let render = page("ivcam-render.1");
    for part in [
        ".TH ivcam-render 1",
        "target\\-error",
        "white\\-balance",
        "catalogue of glasses",
        "also \\-\\-f\\-number",
    ] {
        assert!(render.contains(part), "{part}");
    }
    assert!(page("ivcam.1").contains("\\fB\\-camread\\fR \\fIFILE\\fR"));
    let one = ivcam("man render").output().unwrap();
    assert_eq!(String::from_utf8(one.stdout).unwrap(), render);
    let unknown = stderr(&ivcam("man rendr").output().unwrap());
    assert!(unknown.contains("did you mean `render`?"), "{unknown}");
    for (shell, old) in [
        ("bash", " -camread "),
        ("zsh", "'-camread["),
        ("fish", " -o camread "),
    ] {
        let run = ivcam(&format!("completions {shell}")).output().unwrap();
        assert!(run.status.success(), "{}", stderr(&run));
        let text = String::from_utf8_lossy(&run.stdout);
        for part in ["target-error", "pull-focus", "mgf2", old] {
            assert!(text.contains(part), "{shell}: {part}");
        }
    }
}

#[test]
fn licenses_name_crates_typefaces_and_lenses_and_the_bill_of_materials_is_whole() {
    let said = |line: &str| String::from_utf8(ivcam(line).output().unwrap().stdout).unwrap();
    let list = said("licenses");
    for part in [
        "rayon 1",
        "GUST Font License",
        "US 2,673,491",
        "MIT OR Apache-2.0",
    ] {
        assert!(list.contains(part), "{part}");
    }
    assert!(
        !list.contains("proptest"),
        "tests are no part of the program"
    );
    let bill: serde_json::Value = serde_json::from_str(&said("licenses --sbom")).unwrap();
    assert_eq!(bill["metadata"]["component"]["name"], "ivcam");
    let components = bill["components"].as_array().unwrap();
    let crates = components.iter().filter(|c| c["type"] == "library");
    for component in crates {
        let license = component["licenses"][0]["expression"].as_str();
        assert!(
            license.is_some_and(|license| !license.is_empty()),
            "{component}"
        );
        let is_own = component["name"].as_str().unwrap().starts_with("ivcam-");
        let hash = component["hashes"][0]["content"].as_str();
        assert!(
            is_own || hash.is_some_and(|hash| hash.len() == 64),
            "{component}"
        );
    }
    let needs = bill["dependencies"].as_array().unwrap().iter();
    let refs = needs.flat_map(|entry| entry["dependsOn"].as_array().unwrap());
    for reference in refs {
        assert!(
            components.iter().any(|c| c["bom-ref"] == *reference),
            "{reference}"
        );
    }
}
