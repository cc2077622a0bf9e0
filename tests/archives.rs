//! The commands that work through folders of scenes: `render FOLDER` and `catalog`.

use std::path::{Path, PathBuf};
use std::process::{Command, Output};
use std::time::{Duration, SystemTime};

/// A temporary folder with an archive in `in`. It is removed at the end.
struct Archive(PathBuf);

impl Archive {
    fn new(name: &str, scenes: &[(&str, &str)]) -> Self {
        let name = format!("ivcam-archive-{}-{name}", std::process::id());
        let this = Self(std::env::temp_dir().join(name));
        scenes
            .iter()
            .for_each(|(file, text)| this.write(file, text));
        this
    }

    /// Writes a scene that is an hour old.
    fn write(&self, file: &str, text: &str) {
        let path = self.0.join("in").join(file);
        std::fs::create_dir_all(path.parent().unwrap()).unwrap();
        std::fs::write(&path, text).unwrap();
        let hour = SystemTime::now() - Duration::from_secs(3600);
        let file = std::fs::File::options().append(true).open(&path).unwrap();
        file.set_modified(hour).unwrap();
    }

    /// Runs the program in the folder, and returns its exit code and what it prints.
    fn run(&self, line: &str) -> (Option<i32>, String) {
        let run: Output = Command::new(env!("CARGO_BIN_EXE_ivcam"))
            .current_dir(&self.0)
            .args(line.split_whitespace())
            .output()
            .unwrap();
        let said = String::from_utf8_lossy(&run.stderr).into_owned();
        assert!(!said.contains("panicked"), "{said}");
        (run.status.code(), said)
    }

    fn read(&self, file: &str) -> Vec<u8> {
        std::fs::read(self.0.join(file)).unwrap()
    }

    fn json(&self, file: &str) -> serde_json::Value {
        serde_json::from_slice(&self.read(file)).unwrap()
    }

    fn has(&self, file: &str) -> bool {
        self.0.join(file).exists()
    }
}

impl Drop for Archive {
    fn drop(&mut self) {
        let _ = std::fs::remove_dir_all(&self.0);
    }
}

const CUBE: &str = "#Inventor V2.1 ascii\nCube { }\n";
const SPHERE: &str = "#VRML V2.0 utf8\nShape { geometry Sphere { } }\n";
const SMALL: &str = "--size 6x4 --samples 1 --lens none --quiet";

fn scenes() -> [(&'static str, &'static str); 6] {
    [
        ("a.iv", CUBE),
        ("a.wrl", SPHERE),
        ("b/c.iv", CUBE),
        ("b/cut.iv", "#Inventor V2.1 ascii\nCube { } Sphere { "),
        ("bad.iv", "nonsense"),
        ("empty.iv", "#Inventor V2.1 ascii\nSeparator { }\n"),
    ]
}

#[test]
fn a_folder_gets_a_picture_of_every_scene_and_only_once() {
    let archive = Archive::new("render", &scenes());
    let line = format!("render in -o out {SMALL} --report report.json");
    let (code, said) = archive.run(&line);
    assert_eq!(code, Some(2), "{said}");
    for part in [
        "bad.iv: error",
        "empty.iv: nothing to draw",
        "b/cut.iv: 1 problem",
    ] {
        assert!(said.contains(part), "{part} missing in {said}");
    }
    for picture in ["a.iv", "a.wrl", "b/c", "b/cut"] {
        assert!(archive.has(&format!("out/{picture}.png")), "{picture}");
    }
    assert!(!archive.has("out/empty.png") && !archive.has("out/bad.png"));
    let counts = |report: &serde_json::Value| {
        ["made", "up_to_date", "empty", "failed"].map(|key| report[key].as_u64().unwrap())
    };
    let report = archive.json("report.json");
    assert_eq!(counts(&report), [4, 0, 1, 1]);
    assert_eq!(report["files"].as_array().unwrap().len(), 6);
    archive.run(&line);
    assert_eq!(counts(&archive.json("report.json")), [0, 4, 1, 1]);
    let (_, said) = archive.run("render in -o out --size 6x4 --samples 1 --lens none");
    assert!(said.contains("6 scenes: 4 up to date"), "{said}");
    archive.run(&line.replace("6x4", "8x4"));
    assert_eq!(
        counts(&archive.json("report.json")),
        [4, 0, 1, 1],
        "options"
    );
    archive.run(&format!("{} --force", line.replace("6x4", "8x4")));
    assert_eq!(
        counts(&archive.json("report.json")),
        [4, 0, 1, 1],
        "--force"
    );
    // The metadata have the command that makes this picture alone.
    let picture = archive.read("out/b/c.png");
    let command = b"ivcam render in/b/c.iv -o out/b/c.png --size 8x4";
    assert!(picture.windows(command.len()).any(|part| part == command));
}

#[test]
fn a_picture_of_a_folder_is_that_of_the_scene_alone() {
    let archive = Archive::new("same", &[("a.iv", CUBE)]);
    archive.run(&format!("render in -o out {SMALL} --threads 1"));
    let folders = "--view else:three-quarter --background else:neutral";
    archive.run(&format!("render in/a.iv -o a.png {SMALL} {folders}"));
    let [folder, alone] = ["out/a.png", "a.png"].map(|file| {
        let picture = image::load_from_memory(&archive.read(file)).unwrap();
        picture.to_rgb8().into_raw()
    });
    assert_eq!(folder, alone);
}

#[test]
fn an_output_folder_that_cannot_be_used_is_one_clear_error() {
    let archive = Archive::new("output", &[("a.iv", CUBE), ("out/old.iv", CUBE)]);
    std::fs::create_dir_all(archive.0.join("others")).unwrap();
    std::fs::write(archive.0.join("others/a.png"), "not ours").unwrap();
    std::fs::write(archive.0.join("others/index.html"), "not ours").unwrap();
    std::fs::create_dir_all(archive.0.join("none")).unwrap();
    for (line, part) in [
        ("render in", "there is no output folder"),
        ("render in -o a.png", "is the name of a file"),
        ("render in -o in/a.iv", "is a file"),
        ("render in -o in", "is the folder that is read"),
        ("render in -o others", "`ivcam render` did not make it"),
        (
            "render in -o out --write-camera c.dat",
            "and this is a folder",
        ),
        ("render in -o out --aov c.exr", "and this is a folder"),
        ("render in -o out --report in/a.iv", "is not a JSON file"),
        (
            "convert in -o out --to glb --report in/a.iv",
            "is not a JSON file",
        ),
        ("convert in -o out.glb --to glb", "is the name of a file"),
        ("convert in -o out --to ascii", "`--to iv`"),
        ("convert in -o out", "the format of a folder"),
        ("render none -o out", "no scene files below `none`"),
        ("catalog in -o in", "is the folder that is read"),
        ("catalog in -o others", "is not a catalog"),
        ("catalog in/a.iv -o out", "is not a folder"),
        ("catalog gone -o out", "is not a folder"),
        ("catalog in -o out --size 0x9", "from 1 to 1024"),
        ("catalog none -o out", "no scene files below `none`"),
    ] {
        let (code, said) = archive.run(line);
        assert_eq!(
            (code, said.matches("error").count()),
            (Some(2), 1),
            "{said}"
        );
        assert!(said.contains(part), "{line}: {part} missing in {said}");
        assert!(!archive.has("out"), "{line}");
    }
    assert_eq!(archive.read("others/a.png"), b"not ours");
    assert_eq!(archive.read("in/a.iv"), CUBE.as_bytes());
    // An output folder inside the archive is not read.
    let (code, said) = archive.run(&format!("render in -o in/out {SMALL}"));
    assert_eq!(code, Some(0), "{said}");
    assert!(
        said.contains("is inside `in`; 1 scene in it left out"),
        "{said}"
    );
    assert!(archive.has("in/out/a.png") && !archive.has("in/out/out"));
}

#[test]
fn a_texture_is_not_replaced_by_a_picture() {
    let scene = "#Inventor V2.1 ascii\nTexture2 { filename \"a.png\" } Cube { }\n";
    let archive = Archive::new("texture", &[("b/a.iv", scene), ("b/.ivcam-project", "")]);
    let texture = image::RgbImage::from_pixel(2, 2, image::Rgb([200, 9, 9]));
    texture.save(archive.0.join("in/b/a.png")).unwrap();
    let before = archive.read("in/b/a.png");
    let (code, said) = archive.run(&format!("render in/b -o in/b/../b/. {SMALL}"));
    assert_eq!(code, Some(2), "{said}");
    std::fs::create_dir_all(archive.0.join("out")).unwrap();
    // The scene's folder under another name, and forced.
    let (code, said) = archive.run(&format!("render in -o in/b/.. {SMALL} --force"));
    assert_eq!(code, Some(2), "{said}");
    assert_eq!(archive.read("in/b/a.png"), before);
}

#[test]
fn a_catalog_shows_every_scene_and_reads_only_what_changed() {
    let archive = Archive::new("catalog", &scenes());
    archive.write(
        "<b>&\".iv",
        "#Inventor V2.1 ascii\n# Created by <i>hand</i>\nCube { } Foo { }\n",
    );
    archive.write(
        "gone.iv",
        "#Inventor V2.1 ascii\nTexture2 { filename \"gone.rgb\" } Cube { }\n",
    );
    std::fs::create_dir_all(archive.0.join("glb/b")).unwrap();
    std::fs::write(archive.0.join("glb/b/c.glb"), "").unwrap();
    let line = "catalog in -o out --converted glb --size 12x9";
    let (code, said) = archive.run(line);
    assert_eq!(code, Some(2), "{said}");
    let sum = "8 scenes: 1 damaged, 1 unreadable, 1 with missing files, 1 with unknown nodes,";
    assert!(said.contains(sum), "{said}");
    let page = String::from_utf8(archive.read("out/index.html")).unwrap();
    for part in [
        "<h1>in</h1>",
        "href=\"../in/%3Cb%3E%26%22.iv\"",
        "Created by &lt;i&gt;hand&lt;/i&gt;",
        "src=\"pictures/b/c.iv.png\"",
        "href=\"../glb/b/c.glb\">glb</a>",
        "1 with nothing to draw",
        "<dd><bdi>gone.rgb</bdi></dd>",
    ] {
        assert!(page.contains(part), "{part} missing in {page}");
    }
    assert!(!page.contains("http://") && !page.contains("https://"));
    let data = archive.json("out/catalog.json");
    let scenes = data["scenes"].as_array().unwrap();
    assert_eq!(scenes.len(), 8);
    let cube = scenes.iter().find(|s| s["file"] == "b/c.iv").unwrap();
    assert_eq!(cube["triangles"], 12);
    assert_eq!(cube["size"], serde_json::json!([2.0, 2.0, 2.0]));
    let picture = image::load_from_memory(&archive.read("out/pictures/b/c.iv.png")).unwrap();
    let levels = picture.to_luma8();
    assert!(levels.iter().any(|level| *level > 100), "the cube is lit");

    let (_, said) = archive.run(line);
    assert!(said.contains("8 scenes: 7 up to date"), "{said}");
    archive.write("b/c.iv", "#Inventor V2.1 ascii\nCube { } Cube { }\n");
    std::fs::remove_file(archive.0.join("out/pictures/a.iv.png")).unwrap();
    let (_, said) = archive.run(line);
    assert!(said.contains("8 scenes: 5 up to date"), "{said}");
    assert!(archive.has("out/pictures/a.iv.png"));
    let (_, said) = archive.run("catalog in -o out --size 12x9 --scene-limit depth=99");
    assert!(!said.contains("up to date"), "{said}");
    std::fs::write(archive.0.join("out/catalog.json"), "{").unwrap();
    let (_, said) = archive.run(line);
    assert!(
        said.contains("cannot be read") && !said.contains("up to date"),
        "{said}"
    );
}

#[test]
fn a_camera_that_sees_nothing_is_replaced_in_a_thumbnail() {
    let away = "#Inventor V2.1 ascii\nPerspectiveCamera { position 0 0 -9 } Cube { }\n";
    let archive = Archive::new("away", &[("away.iv", away)]);
    let (code, said) = archive.run("catalog in -o out --quiet --size 12x9");
    assert_eq!((code, &*said), (Some(0), ""));
    let picture = image::load_from_memory(&archive.read("out/pictures/away.iv.png")).unwrap();
    assert!(picture.to_luma8().iter().any(|level| *level > 100));
    assert!(Path::new(&archive.0.join("out/index.html")).exists());
}

#[test]
fn a_catalog_in_a_studio_shows_scenes_on_white_paper() {
    let archive = Archive::new("studio", &[("a.iv", CUBE)]);
    let lower_corners = |line: &str| {
        let (code, said) = archive.run(line);
        assert_eq!(code, Some(0), "{said}");
        let picture = image::load_from_memory(&archive.read("out/pictures/a.iv.png")).unwrap();
        let picture = picture.to_luma8();
        [(0, 11), (15, 11)].map(|(x, y)| picture.get_pixel(x, y)[0])
    };
    let plain = lower_corners("catalog in -o out --quiet --size 16x12");
    let studio = lower_corners("catalog in -o out --quiet --size 16x12 --studio");
    for (paper, gray) in studio.into_iter().zip(plain) {
        assert!(paper > gray + 30, "{studio:?} {plain:?}");
    }
}

/// The page has its own sign for a scene without a picture, with the reason.
#[test]
fn a_scene_that_shows_nothing_has_no_thumbnail() {
    let clear = "#Inventor V2.1 ascii\nMaterial { transparency 1 } Cube { }\n";
    let cut = format!("{clear} Sphere {{ radius ");
    let archive = Archive::new("nothing", &[("clear.iv", clear), ("cut.iv", &cut)]);
    let (_, said) = archive.run("catalog in -o out --size 12x9");
    let catalog = archive.json("out/catalog.json");
    let entry = |i: usize| &catalog["scenes"][i];
    for (i, state) in [(0, "whole"), (1, "damaged")] {
        assert_eq!(entry(i)["state"], state, "{said}");
        assert!(entry(i)["picture"].is_null(), "{catalog:#}");
        let why = entry(i)["no_picture"].as_str().unwrap();
        assert!(why.contains("the picture"), "{why}");
    }
}

#[test]
fn a_folder_of_vrml97_is_written_as_inventor_and_files_keep_the_names_that_scenes_use() {
    let vrml97 = "#VRML V2.0 utf8\nShape { geometry Box { } }\n";
    let outer = "#Inventor V2.1 ascii\nFile { name \"b.wrl\" } File { name \"c.iv\" }\n";
    let scenes = [("a.iv", outer), ("b.wrl", vrml97), ("c.iv", CUBE)];
    let archive = Archive::new("languages", &scenes);
    let (code, said) = archive.run("convert in -o out --to iv");
    assert_eq!(code, Some(0), "{said}");
    assert!(said.contains("3 converted"), "{said}");
    for name in ["a.iv", "b.iv", "c.iv"] {
        let written = archive.read(&format!("out/{name}"));
        assert!(written.starts_with(b"#Inventor V2.1 ascii"), "{name}");
    }
    assert_eq!(archive.read("out/b.wrl"), vrml97.as_bytes());
}

#[test]
fn the_report_of_a_conversion_does_not_replace_a_texture() {
    let scene = "#Inventor V2.1 ascii\nTexture2 { filename \"a.png\" } Cube { }\n";
    let archive = Archive::new("report", &[("a.iv", scene)]);
    let texture = image::RgbImage::from_pixel(2, 2, image::Rgb([200, 9, 9]));
    texture.save(archive.0.join("in/a.png")).unwrap();
    let before = archive.read("in/a.png");
    let (code, said) = archive.run("convert in/a.iv -o a.glb --report in/a.png");
    assert_eq!(code, Some(2), "{said}");
    assert_eq!(archive.read("in/a.png"), before);
}
