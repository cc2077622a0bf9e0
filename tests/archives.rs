//! The commands that work through folders: `render FOLDER`, `catalog` and `compare` of two folders.

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
        self.set_age(file, 1);
    }

    /// Sets the age of a file of the archive in hours.
    fn set_age(&self, file: &str, hours: u64) {
        let time = SystemTime::now() - Duration::from_secs(3600 * hours);
        let path = self.0.join("in").join(file);
        let file = std::fs::File::options().append(true).open(path).unwrap();
        file.set_modified(time).unwrap();
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
        ("catalog in -o out --page none", "is not a built page"),
        ("catalog in -o out --about gone.txt", "gone.txt"),
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
        "<h1><bdi>in</bdi></h1>",
        "href=\"../in/%3Cb%3E%26%22.iv\"",
        "Created by &lt;i&gt;hand&lt;/i&gt;",
        "src=\"pictures/b/c.iv.png\"",
        "href=\"../glb/b/c.glb\">glb</a>",
        "1 with nothing to draw",
        "href=\"scenes/gone.iv.html\"",
    ] {
        assert!(page.contains(part), "{part} missing in {page}");
    }
    let gone = String::from_utf8(archive.read("out/scenes/gone.iv.html")).unwrap();
    assert!(
        gone.contains("<bdi>gone.rgb</bdi> <span class=\"line\">texture, missing"),
        "{gone}"
    );
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
fn a_catalog_reads_a_scene_again_whose_texture_or_inlined_scene_changed() {
    let texture = "#Inventor V2.1 ascii\nTexture2 { filename \"wood.png\" } Cube { }\n";
    let outer = "#Inventor V2.1 ascii\nFile { name \"b/part.iv\" }\n";
    let scenes = [("a.iv", texture), ("outer.iv", outer), ("b/part.iv", CUBE)];
    let archive = Archive::new("uses", &scenes);
    let wood = |level: u8| {
        let picture = image::RgbImage::from_pixel(4, 4, image::Rgb([level; 3]));
        picture.save(archive.0.join("in/wood.png")).unwrap();
    };
    wood(250);
    archive.set_age("wood.png", 1);
    let line = "catalog in -o out --size 12x9";
    let read_again = || {
        let before = ["a.iv", "outer.iv", "b/part.iv"]
            .map(|name| archive.read(&format!("out/pictures/{name}.png")));
        let (code, said) = archive.run(line);
        assert_eq!(code, Some(0), "{said}");
        let after = ["a.iv", "outer.iv", "b/part.iv"]
            .map(|name| archive.read(&format!("out/pictures/{name}.png")));
        (said, [0, 1, 2].map(|i| before[i] != after[i]))
    };
    archive.run(line);
    let (said, changed) = read_again();
    assert!(said.contains("3 scenes: 3 up to date"), "{said}");
    assert_eq!(changed, [false; 3]);
    // The copies of an older state are older than the pictures that were made of the newer one.
    wood(40);
    archive.set_age("wood.png", 9);
    let (said, changed) = read_again();
    assert!(said.contains("3 scenes: 2 up to date"), "{said}");
    assert_eq!(changed, [true, false, false]);
    archive.write("b/part.iv", "#Inventor V2.1 ascii\nSphere { }\n");
    archive.set_age("b/part.iv", 9);
    let (said, changed) = read_again();
    assert!(said.contains("3 scenes: 1 up to date"), "{said}");
    assert_eq!(changed, [false, true, true]);
    std::fs::remove_file(archive.0.join("in/wood.png")).unwrap();
    let (said, _) = read_again();
    assert!(
        said.contains("2 up to date, 1 with missing files"),
        "{said}"
    );
    std::fs::remove_file(archive.0.join("out/scenes/outer.iv.html")).unwrap();
    archive.run(line);
    assert!(
        archive.has("out/scenes/outer.iv.html"),
        "a page that is gone is written again"
    );
}

#[test]
fn a_catalog_finds_equal_files_equal_nodes_and_pictures_that_look_alike() {
    let archive = Archive::new(
        "alike",
        &[
            ("a.iv", CUBE),
            ("b/copy.iv", CUBE),
            (
                "c.iv",
                "#Inventor V2.1 ascii\n# Another comment\nCube   {\n}\n",
            ),
            (
                "d.iv",
                "#Inventor V2.1 ascii\nSeparator { Cube { width 4 height 4 depth 4 } }\n",
            ),
            ("e.wrl", SPHERE),
        ],
    );
    let (code, said) = archive.run("catalog in -o out --size 24x18 --title Cubes --quiet");
    assert_eq!((code, &*said), (Some(0), ""));
    let data = archive.json("out/catalog.json");
    let scene = |i: usize| &data["scenes"][i];
    let files = |i: usize, key: &str| scene(i)[key]["files"].clone();
    assert_eq!(files(0, "duplicates"), serde_json::json!(["b/copy.iv"]));
    assert_eq!(files(0, "same_scene"), serde_json::json!(["c.iv"]));
    assert_eq!(files(0, "alike"), serde_json::json!(["d.iv"]));
    assert_eq!(
        files(2, "same_scene"),
        serde_json::json!(["a.iv", "b/copy.iv"])
    );
    assert_eq!(files(4, "alike"), serde_json::json!([]));
    assert_eq!(
        [&scene(0)["pronom"], &scene(4)["pronom"]],
        ["fmt/833", "fmt/94"]
    );
    // As `sha256sum` prints it.
    let sum = "0ccd538595280c7cb6820d667658fbc14dcfbc65aac13313da962f1029cd614b";
    assert_eq!(scene(0)["sha256"], sum);
    assert_eq!(scene(0)["sha256"], scene(1)["sha256"]);

    let page = String::from_utf8(archive.read("out/scenes/b/copy.iv.html")).unwrap();
    for part in [
        "<a href=\"../../scenes/a.iv.html\"><bdi>a.iv</bdi></a>",
        "href=\"../../index.html\"><bdi>Cubes</bdi>",
        "href=\"../../../in/b/copy.iv\"",
        "src=\"../../large/b/copy.iv.jpg\"",
        "fmt/833",
    ] {
        assert!(page.contains(part), "{part} missing in {page}");
    }
    let large = image::load_from_memory(&archive.read("out/large/a.iv.jpg")).unwrap();
    assert_eq!((large.width(), large.height()), (72, 54));
    let table = String::from_utf8(archive.read("out/catalog.csv")).unwrap();
    assert_eq!(table.lines().count(), 6);
    assert!(
        table.contains("\nb/copy.iv,") && table.contains(",fmt/94,"),
        "{table}"
    );
    let linked = archive.json("out/catalog.jsonld");
    assert_eq!([&linked["@type"], &linked["name"]], ["Collection", "Cubes"]);
    assert_eq!(linked["hasPart"].as_array().unwrap().len(), 5);
    assert_eq!(linked["hasPart"][1]["contentUrl"], "../in/b/copy.iv");
    assert_eq!(linked["hasPart"][1]["sha256"], scene(1)["sha256"]);

    // The pages of scenes are written again if a relation changed, and the scene is not read.
    std::fs::remove_file(archive.0.join("in/a.iv")).unwrap();
    let (_, said) = archive.run("catalog in -o out --size 24x18 --title Cubes");
    assert!(said.contains("4 scenes: 4 up to date"), "{said}");
    let page = String::from_utf8(archive.read("out/scenes/b/copy.iv.html")).unwrap();
    assert!(!page.contains("a.iv.html"), "{page}");
}

#[test]
fn markup_in_a_file_and_in_the_text_about_an_archive_stays_text() {
    let hostile = "#Inventor V2.1 ascii\n# Created by <script>alert(1)</script>\n\
        DEF <img/src=x/onerror=alert(2)> Separator { Material { <b> 3 } Cube { }\n\
        Info { string \"</bdi></p><iframe src=x>\" } Font { name \"<svg/onload=alert(3)>\" }\n\
        Texture2 { filename \"<object data=x>.rgb\" } <embed> { } }\n";
    let archive = Archive::new(
        "hostile",
        &[("'\"><img src=x onerror=alert(4)>.iv", hostile)],
    );
    std::fs::write(
        archive.0.join("about.txt"),
        "Old <scenes>\n\n<style>*{}</style>",
    )
    .unwrap();
    archive.run("catalog in -o out --size 12x9 --about about.txt --title <u>x</u>");
    let name = "'\"><img src=x onerror=alert(4)>.iv";
    let scene = format!("out/scenes/{name}.html");
    for (file, pictures) in [("out/index.html", 2), (&*scene, 1)] {
        let page = String::from_utf8(archive.read(file)).unwrap();
        // The page of the catalog has a picture of the scene, and the large one.
        assert_eq!(page.matches("<img").count(), pictures, "{page}");
        for tag in [
            "<u>",
            "<iframe",
            "<svg",
            "<object",
            "<embed",
            "<style>*",
            "<scenes>",
            "<script>alert",
        ] {
            assert!(!page.contains(tag), "{tag} in {page}");
        }
        assert!(page.contains("Created by &lt;script&gt;"), "{page}");
    }
    let page = String::from_utf8(archive.read(&scene)).unwrap();
    assert!(page.contains("line 3, column "), "{page}");
    assert!(page.contains("drawn with a typeface of ivcam"), "{page}");
}

#[test]
fn a_catalog_with_a_page_has_what_opens_each_scene() {
    let texture = "#Inventor V2.1 ascii\nTexture2 { filename \"wood.png\" } Cube { }\n\
        Texture2 { filename \"far.png\" } Sphere { }\n";
    let archive = Archive::new("live", &[("b/a b.iv", texture), ("bad.iv", "nonsense")]);
    let wood = image::RgbImage::from_pixel(4, 4, image::Rgb([200, 9, 9]));
    for (folder, file) in [("in/b", "wood.png"), ("other", "far.png")] {
        std::fs::create_dir_all(archive.0.join(folder)).unwrap();
        wood.save(archive.0.join(folder).join(file)).unwrap();
    }
    std::fs::create_dir_all(archive.0.join("dist/scenes")).unwrap();
    for file in ["index.html", "main.js", "ivcam.wasm", "scenes/x.iv"] {
        std::fs::write(archive.0.join("dist").join(file), file).unwrap();
    }
    let line = "catalog in -o out --size 12x9 --page dist --search other";
    let (_, said) = archive.run(line);
    assert!(
        said.contains("outside the folder and not copied: 1"),
        "{said}"
    );
    assert_eq!(archive.read("out/page/scenes/x.iv"), b"scenes/x.iv");
    assert_eq!(archive.read("out/files/b/a b.iv"), texture.as_bytes());
    assert_eq!(
        archive.read("out/files/b/wood.png"),
        archive.read("in/b/wood.png")
    );
    assert!(!archive.has("out/files/bad.iv") && !archive.has("out/files/far.png"));
    let list = archive.json("out/scenes/b/a b.iv.json");
    assert_eq!(list["files"], serde_json::json!(["../../files/b/wood.png"]));
    let page = String::from_utf8(archive.read("out/index.html")).unwrap();
    let live = "href=\"page/index.html?scene=../files/b/a%2520b.iv&amp;files=../scenes/b/a%2520b.iv.json\"";
    assert!(page.contains(live), "{page}");
    assert!(!page.contains("scene=../files/bad.iv"));
    let own = String::from_utf8(archive.read("out/scenes/b/a b.iv.html")).unwrap();
    assert!(
        own.contains("href=\"../../page/index.html?scene=../files/b/a%2520b.iv"),
        "{own}"
    );
    // A scene that changed is copied again.
    archive.write("b/a b.iv", CUBE);
    archive.run(line);
    assert_eq!(archive.read("out/files/b/a b.iv"), CUBE.as_bytes());
    let (code, said) = archive.run("catalog in -o dist/out --page dist");
    assert!(code == Some(2) && said.contains("into itself"), "{said}");
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

#[cfg(target_os = "linux")]
#[test]
fn scenes_whose_names_differ_in_bytes_that_are_not_utf_8_have_their_own_entries() {
    use std::os::unix::ffi::OsStrExt;
    let archive = Archive::new("bytes", &[("b.iv", CUBE)]);
    for name in [b"b\xe4r.iv", b"b\xf6r.iv"] {
        let path = archive.0.join("in").join(std::ffi::OsStr::from_bytes(name));
        std::fs::copy(archive.0.join("in/b.iv"), path).unwrap();
    }
    let line = "catalog in -o out --size 12x9";
    archive.run(line);
    let catalog = archive.json("out/catalog.json");
    let files = [0, 1, 2].map(|i| catalog["scenes"][i]["file"].as_str().unwrap());
    assert_eq!(files, ["b.iv", "b\\xE4r.iv", "b\\xF6r.iv"]);
    for file in files {
        assert!(archive.has(&format!("out/pictures/{file}.png")), "{file}");
    }
    let page = String::from_utf8(archive.read("out/index.html")).unwrap();
    assert!(page.contains("../in/b%E4r.iv"), "{page}");
    let (_, said) = archive.run(line);
    assert!(said.contains("3 up to date"), "{said}");
}

#[test]
fn a_texture_that_is_no_picture_is_listed_once() {
    let scene = "#Inventor V2.1 ascii\nTexture2 { filename \"a.png\" } Cube { }\n";
    let archive = Archive::new("no-picture", &[("a.iv", scene), ("a.png", "no picture")]);
    archive.run("catalog in -o out --size 12x9");
    let needs = &archive.json("out/catalog.json")["scenes"][0]["needs"];
    assert_eq!(needs.as_array().unwrap().len(), 1, "{needs}");
    assert_eq!(needs[0]["state"], "unreadable");
}

#[test]
fn a_scene_whose_time_ended_is_read_again_with_more() {
    let archive = Archive::new("time", &[("a.iv", CUBE)]);
    let entry = |line: &str| {
        archive.run(line);
        archive.json("out/catalog.json")["scenes"][0].clone()
    };
    let short = entry("catalog in -o out --size 12x9 --time 0.00001s");
    assert_eq!(short["out_of_time"], true, "{short:#}");
    let long = entry("catalog in -o out --size 12x9");
    assert_eq!(long["out_of_time"], false, "{long:#}");
    assert!(long["picture"].is_string(), "{long:#}");
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

#[test]
fn a_damaged_scene_fails_a_strict_conversion_and_its_report_says_what_is_wrong() {
    let faces = "#Inventor V2.1 ascii\nCoordinate3 { point [ 0 0 0, 1 0 0, 0 1 0 ] }\n\
        IndexedFaceSet { coordIndex [ 0, 1";
    // glTF has no ambient light.
    let board = "#Inventor V2.1 ascii\nEnvironment { ambientIntensity 0 } \
        Texture2 { filename \"gone.png\" } Cube { }\n";
    let scenes = [
        ("bad.iv", "nonsense"),
        ("board.iv", board),
        ("cut.iv", "#Inventor V2.1 ascii\nCube { } Sphere { "),
        ("faces.iv", faces),
    ];
    let archive = Archive::new("strict", &scenes);
    let (_, said) = archive.run("convert in -o out --to glb --report report.json");
    let said = said.replace("\n  ", " ");
    let sum = "4 scenes: 2 converted, 1 with nothing to draw, 1 failed, 2 damaged, 1 with missing \
               files";
    assert!(said.contains(sum), "{said}");
    assert!(!archive.has("out/faces.glb") && archive.has("out/cut.glb"));
    let report = archive.json("report.json");
    let file = |i: usize| &report["files"][i];
    let states = [0, 1, 2, 3].map(|i| [&file(i)["result"], &file(i)["state"]]);
    let expected = [
        ["failed", "unreadable"],
        ["converted", "whole"],
        ["converted", "damaged"],
        ["nothing to draw", "damaged"],
    ];
    assert_eq!(states, expected);
    assert_eq!(file(1)["missing"], serde_json::json!(["gone.png"]));
    assert_eq!(file(1)["diagnostics"][0]["severity"], "warning");
    assert_eq!(file(2)["diagnostics"][0]["severity"], "damaged");
    std::fs::remove_file(archive.0.join("in/bad.iv")).unwrap();
    let strict = "convert in -o out --to glb --strict --force";
    assert_eq!(archive.run(strict).0, Some(1));
    // Scenes that are up to date count as before.
    let again = "convert in -o out --to glb --strict --report report.json";
    let (code, said) = archive.run(again);
    assert_eq!(code, Some(1), "{said}");
    let said = said.replace("\n  ", " ");
    let sum = "2 up to date, 1 with nothing to draw, 2 damaged, 1 with missing files";
    assert!(said.contains(sum), "{said}");
    let cut = &archive.json("report.json")["files"][1];
    assert_eq!([&cut["result"], &cut["state"]], ["up to date", "damaged"]);
    std::fs::remove_file(archive.0.join("in/faces.iv")).unwrap();
    assert_eq!(archive.run(again).0, Some(1), "the scene that is cut");
    std::fs::remove_file(archive.0.join("in/cut.iv")).unwrap();
    let fog = "#Inventor V2.1 ascii\nEnvironment { fogType FOG fogVisibility 5 } Cube { }\n";
    archive.write("fog.iv", fog);
    archive.run("convert in -o out --to glb");
    let (code, said) = archive.run(again);
    assert!(
        code == Some(1) && said.contains("2 up to date, 1 with losses"),
        "{said}"
    );
    archive.write("faces.iv", faces);
    // One file says the same.
    let one = "convert in/faces.iv -o faces.glb --report one.json";
    let (code, said) = archive.run(one);
    assert!(
        code == Some(0) && said.contains("nothing to draw was found"),
        "{said}"
    );
    let one_file = archive.json("one.json");
    assert_eq!(
        [&one_file["state"], &one_file["diagnostics"][0]["severity"]],
        ["damaged", "damaged"]
    );
    assert_eq!(archive.run(&format!("{one} --strict")).0, Some(1));
    let (code, said) = archive.run("convert in/board.iv -o board.glb --strict --report one.json");
    assert_eq!(code, Some(0), "a missing file is no loss of the format");
    assert!(said.contains("warning: `gone.png` was not found"), "{said}");
    assert!(!said.contains("error"), "{said}");
    assert_eq!(archive.json("one.json")["missing"], file(1)["missing"]);
}

#[test]
fn a_picture_of_one_color_is_named_and_counted() {
    let clear = "#Inventor V2.1 ascii\nMaterial { transparency 1 } Cube { }\n";
    let cut = format!("{clear} Sphere {{ radius ");
    let scenes = [("clear.iv", clear), ("cut.iv", &cut), ("a.iv", CUBE)];
    let archive = Archive::new("one-color", &scenes);
    let line = "render in -o out --size 6x4 --samples 1 --lens none --report r.json";
    let (code, said) = archive.run(line);
    assert_eq!(code, Some(0), "{said}");
    for part in [
        "clear.iv: the picture has one color everywhere\n",
        "cut.iv: the picture has one color everywhere; 2 problems, such as line 3, column",
        "3 scenes: 3 pictures made, 2 of one color everywhere, 1 with problems",
    ] {
        assert!(said.contains(part), "{part} missing in {said}");
    }
    assert_eq!(archive.json("r.json")["one_color"], 2);
}

#[test]
fn a_line_names_its_scene_once_and_a_place_in_a_binary_file_is_a_byte() {
    let empty = "#Inventor V2.1 ascii\nSeparator { Frob { } }\n";
    let two = "#Inventor V2.1 ascii\nCube { } Sphere { radius 2 }\n";
    let archive = Archive::new("places", &[("a.iv", two), ("b/empty.iv", empty)]);
    archive.run("convert in/a.iv -o in/binary.iv --to binary");
    let bytes = archive.read("in/binary.iv");
    std::fs::write(archive.0.join("in/binary.iv"), &bytes[..bytes.len() - 3]).unwrap();
    std::fs::remove_file(archive.0.join("in/a.iv")).unwrap();
    let place = format!("byte {}", bytes.len() - 4);
    let damage = format!("{place}: damaged: the file ends in the middle of a value");
    let nothing =
        "b/empty.iv: nothing to draw; 1 problem, such as line 2, column 13: warning: `Frob`";
    for line in [
        &format!("render in -o out {}", SMALL.replace(" --quiet", "")),
        "convert in -o glb --to glb --report r.json",
    ] {
        let (_, said) = archive.run(line);
        let of_damage = format!("binary.iv: 1 problem, such as {damage}");
        assert!(
            said.contains(&of_damage) && said.contains(nothing),
            "{said}"
        );
    }
    let (_, said) = archive.output("check in");
    assert!(said.contains(&format!("1 problem: {damage}")), "{said}");
    let (_, said) = archive.output("check in/binary.iv --json");
    let checked: serde_json::Value = serde_json::from_str(&said).unwrap();
    archive.run("catalog in -o catalog --size 12x9");
    let [listed, reported] = [
        &archive.json("catalog/catalog.json")["scenes"][1]["messages"][0],
        &archive.json("r.json")["files"][1]["diagnostics"][0],
    ];
    for said in [listed, reported, &checked["diagnostics"][0]] {
        assert_eq!(said["byte"], bytes.len() - 4, "{said:#}");
        assert!(said["line"].is_null() && said["column"].is_null());
    }
    let page = String::from_utf8(archive.read("catalog/scenes/binary.iv.html")).unwrap();
    assert!(page.contains(&format!("{place}: ")), "{page}");
}

#[test]
fn a_file_is_identified_by_its_content_and_its_change_is_named() {
    let old = "#VRML V1.0 ascii\nCube { }\n";
    let archive = Archive::new("identity", &[("a.iv", CUBE), ("old.iv", old)]);
    let mut gzip = flate2::write::GzEncoder::new(Vec::new(), flate2::Compression::default());
    std::io::Write::write_all(&mut gzip, SPHERE.as_bytes()).unwrap();
    std::fs::write(archive.0.join("in/ball.wrl"), gzip.finish().unwrap()).unwrap();
    let (_, said) = archive.output("check in");
    for part in [
        "ball.wrl: VRML V2.0 utf8 in gzip, 2 nodes (2 drawn), 1 round solid, 0 problems",
        "old.iv: VRML V1.0 ascii, named `.iv`, ",
        "3 whole, 0 damaged, 0 unreadable, 1 packed with gzip, 1 named unlike their format",
    ] {
        assert!(said.contains(part), "{part} missing in {said}");
    }
    let line = "catalog in -o out --size 12x9";
    let (code, said) = archive.run(line);
    assert!(code == Some(0) && !said.contains("changed"), "{said}");
    let data = archive.json("out/catalog.json");
    let of = |i: usize| ["packed", "unexpected_ending"].map(|key| data["scenes"][i][key].clone());
    let null = serde_json::Value::Null;
    assert_eq!(of(0), [null.clone(), null.clone()]);
    assert_eq!(of(1), ["gzip".into(), null.clone()]);
    assert_eq!(of(2), [null, ".iv".into()]);
    let text = |file: &str| String::from_utf8(archive.read(file)).unwrap();
    assert!(text("out/scenes/ball.wrl.html").contains("gzip, x-fmt/266"));
    assert!(text("out/index.html").contains("24 triangles, 1 round solid."));
    assert!(text("out/catalog.csv").contains(",gzip,,1"));
    let linked = archive.json("out/catalog.jsonld");
    assert_eq!(
        linked["hasPart"][1]["encodingFormat"][2],
        "application/gzip"
    );

    // Other bytes of the same size and time are seen by those who hash.
    let path = archive.0.join("in/a.iv");
    let time = path.metadata().unwrap().modified().unwrap();
    std::fs::write(&path, CUBE.replace("Cube", "Cone")).unwrap();
    let file = std::fs::File::options().append(true).open(&path).unwrap();
    file.set_modified(time).unwrap();
    let (_, said) = archive.run(line);
    assert!(said.contains("3 scenes: 3 up to date"), "{said}");
    let force = format!("{line} --force");
    let (_, said) = archive.run(&force);
    assert!(
        said.contains("a.iv: its bytes have changed since the last run"),
        "{said}"
    );
    assert!(
        said.contains("3 scenes: 1 changed since the last run"),
        "{said}"
    );
    let (_, said) = archive.run(&force);
    assert!(!said.contains("changed"), "{said}");
}

#[test]
fn the_folder_that_a_user_names_is_the_project_of_its_scenes() {
    let scene = "#Inventor V2.1 ascii\nTexture2 { filename \"../../maps/wood.png\" } Cube { }\n";
    let archive = Archive::new("project", &[("scenes/deep/a.iv", scene)]);
    let wood = image::RgbImage::from_pixel(4, 4, image::Rgb([200, 9, 9]));
    archive.picture("in/maps/wood.png", &wood);
    let refused = "outside the scene's project folder";
    let (_, said) = archive.run("check in/scenes/deep/a.iv");
    assert!(
        said.contains(refused),
        "alone, its project is in/scenes: {said}"
    );
    let (_, said) = archive.run("check in/scenes --full");
    assert!(said.contains(refused), "{said}");
    let (_, said) = archive.output("check in");
    assert!(
        said.contains("0 problems") && !said.contains("outside"),
        "{said}"
    );
    for line in [
        &format!("render in -o pictures {SMALL}"),
        "convert in -o glb --to glb",
        "catalog in -o catalog --size 12x9",
    ] {
        let (code, said) = archive.run(line);
        assert!(code == Some(0) && !said.contains("outside"), "{said}");
    }
    // The metadata of the picture have the command that makes it alone.
    let picture = archive.read("pictures/scenes/deep/a.png");
    assert!(picture.windows(12).any(|part| part == b"--contain=in"));
    let entry = &archive.json("catalog/catalog.json")["scenes"][0];
    assert_eq!(entry["needs"][0]["state"], "found", "{entry:#}");
}

/// Returns a picture of boxes that depend on `seed`, with its levels raised to a power.
fn boxes(seed: u64, gamma: f32) -> image::RgbImage {
    let mut state = seed;
    let mut next = |n: u64| {
        state = state
            .wrapping_mul(6_364_136_223_846_793_005)
            .wrapping_add(1_442_695_040_888_963_407);
        ((state >> 33) % n) as u32
    };
    let boxes: Vec<[u32; 5]> = (0..40)
        .map(|_| [next(120), next(80), 6 + next(30), 6 + next(20), next(256)])
        .collect();
    image::RgbImage::from_fn(120, 80, |x, y| {
        let inside =
            |b: &&[u32; 5]| (b[0]..b[0] + b[2]).contains(&x) && (b[1]..b[1] + b[3]).contains(&y);
        let level = boxes.iter().rev().find(inside).map_or(128, |b| b[4]);
        image::Rgb([(255.0 * (level as f32 / 255.0).powf(gamma)).round() as u8; 3])
    })
}

impl Archive {
    /// Writes a picture in the format of its name.
    fn picture(&self, file: &str, picture: &image::RgbImage) {
        let path = self.0.join(file);
        std::fs::create_dir_all(path.parent().unwrap()).unwrap();
        picture.save(path).unwrap();
    }

    /// Runs the program and returns its exit code and what it writes to standard output.
    fn output(&self, line: &str) -> (Option<i32>, String) {
        let run = Command::new(env!("CARGO_BIN_EXE_ivcam"))
            .current_dir(&self.0)
            .args(line.split_whitespace())
            .output()
            .unwrap();
        let written = String::from_utf8_lossy(&run.stdout).into_owned();
        (run.status.code(), written)
    }
}

/// Returns two folders: a picture that is equal, one with another ending and folder, one that
/// differs, one with another name, a damaged one, and one in each folder that only that has, of
/// which the old one is damaged too.
fn two_folders(name: &str) -> Archive {
    let archive = Archive::new(name, &[]);
    for (new, old, seed, gamma) in [
        ("equal.png", "equal.png", 1, 1.0),
        ("deep/ending.png", "deep/ending.jpg", 2, 1.0),
        ("moved.png", "scan-7.png", 3, 1.4),
        ("damaged.png", "damaged.png", 4, 1.0),
    ] {
        archive.picture(&format!("new/{new}"), &boxes(seed, 1.0));
        archive.picture(&format!("old/{old}"), &boxes(seed, gamma));
    }
    archive.picture("new/differs.png", &boxes(5, 1.0));
    archive.picture("old/differs.png", &boxes(6, 1.0));
    archive.picture("new/only.png", &boxes(7, 1.0));
    std::fs::write(archive.0.join("old/other.bmp"), "BM").unwrap();
    let bytes = archive.read("old/damaged.png");
    std::fs::write(archive.0.join("old/damaged.png"), &bytes[..bytes.len() / 2]).unwrap();
    archive
}

/// Returns the names of the new pictures of a report with their verdicts.
fn verdicts(report: &serde_json::Value) -> Vec<String> {
    let text = |value: &serde_json::Value| value.as_str().unwrap().to_owned();
    let pairs = report["pairs"].as_array().unwrap();
    pairs
        .iter()
        .map(|pair| format!("{} {}", text(&pair["new"]), text(&pair["verdict"])))
        .collect()
}

#[test]
fn two_folders_are_paired_by_name_and_by_picture_and_reported() {
    let archive = two_folders("compare");
    let (code, said) = archive.run("compare new old -o report --limit ssim=0.9");
    let said = said.replace("\n  ", " "); // A long line is broken.
    assert_eq!(code, Some(2), "{said}");
    for part in [
        "2 new and 2 old without a partner by name: up to 4 pairs",
        "other.bmp: ",
        "5 pairs: 3 within the limits, 1 beyond a limit, 1 not compared",
        "1 paired by picture, 1 new without a partner, 1 old without a partner",
        "1 of these not readable",
        "differs.png: ssim is 0.",
    ] {
        assert!(said.contains(part), "{part} missing in {said}");
    }
    let report = archive.json("report/report.json");
    let expected = [
        "damaged.png failed",
        "deep/ending.png within",
        "differs.png exceeded",
        "equal.png within",
        "moved.png within",
    ];
    assert_eq!(verdicts(&report), expected);
    let pairs = report["pairs"].as_array().unwrap();
    assert!(pairs[0]["error"].as_str().unwrap().contains("damaged.png"));
    assert_eq!(pairs[1]["old"], "deep/ending.jpg");
    assert_eq!(
        (&pairs[3]["measures"]["mse"], &pairs[3]["measures"]["psnr"]),
        (&0.0.into(), &serde_json::Value::Null)
    );
    assert_eq!(
        (&pairs[4]["old"], &pairs[4]["paired_by"]),
        (&"scan-7.png".into(), &"picture".into())
    );
    assert!(pairs[4]["pairing_chance"].as_f64().unwrap() < 1e-3);
    assert_eq!(report["tried"], 2, "the damaged one is not tried");
    assert_eq!(report["unpaired_new"][0]["file"], "only.png");
    assert_eq!(report["unpaired_old"][0]["file"], "other.bmp");

    let table = String::from_utf8(archive.read("report/report.csv")).unwrap();
    let lines: Vec<&str> = table.lines().collect();
    assert_eq!(lines.len(), 6, "{table}");
    assert!(lines[0].starts_with("new,old,paired_by,verdict,registration,mse,psnr,ssim"));
    assert!(lines[4].starts_with("equal.png,equal.png,name,within,none,0,inf,1,0,0,0,1,"));
    assert!(lines[5].starts_with("moved.png,scan-7.png,picture,within,align,"));

    let page = String::from_utf8(archive.read("report/index.html")).unwrap();
    for pair in pairs {
        for kind in ["new", "old", "difference"] {
            let Some(file) = pair["pictures"][kind].as_str() else {
                continue;
            };
            assert!(
                archive.has(&format!("report/{file}")) && page.contains(file),
                "{file}"
            );
        }
    }
    assert!(archive.has("report/unpaired/new/only.png.jpg"));
}

#[test]
fn a_report_does_not_depend_on_threads_and_keeps_what_is_up_to_date() {
    let archive = two_folders("compare-again");
    let line = "compare new old -o report --limit ssim=0.9 --by-name";
    archive.run(&format!("{line} --threads 1"));
    let [json, table] = ["json", "csv"].map(|kind| archive.read(&format!("report/report.{kind}")));
    let picture = archive.read("report/pictures/differs.png.difference.jpg");
    let (_, said) = archive.run(line);
    assert!(said.contains("3 up to date"), "{said}");
    assert!(archive.read("report/report.json") == json);
    let (_, said) = archive.run(&format!("{line} --threads 2 --force"));
    assert!(!said.contains("up to date"), "{said}");
    assert!(
        archive.read("report/report.json") == json && archive.read("report/report.csv") == table
    );
    assert!(archive.read("report/pictures/differs.png.difference.jpg") == picture);
    archive.picture("old/equal.png", &boxes(2, 1.0));
    let (_, said) = archive.run(line);
    assert!(said.contains("2 up to date"), "{said}");
    let (_, said) = archive.run(&format!("{line} --match none"));
    assert!(!said.contains("up to date"), "other options: {said}");
    let (code, _) = archive.run("compare new old -o new");
    assert_eq!(code, Some(2), "a folder that is read");
    std::fs::create_dir(archive.0.join("site")).unwrap();
    std::fs::write(archive.0.join("site/index.html"), "").unwrap();
    let (code, said) = archive.run("compare new old -o site");
    assert!(
        code == Some(2) && said.contains("is not a report"),
        "{said}"
    );
}

#[test]
fn the_exit_code_of_two_folders_says_what_is_wrong() {
    let archive = two_folders("compare-code");
    let code = |options: &str| {
        archive.run(&format!(
            "compare new old -o report --by-name --quiet {options}"
        ))
    };
    assert_eq!(code("").0, Some(2), "damaged files");
    for file in ["damaged.png", "other.bmp"] {
        std::fs::remove_file(archive.0.join("old").join(file)).unwrap();
    }
    assert_eq!(code("--limit ssim=0.9").0, Some(1));
    assert_eq!(code("--limit ssim=-1").0, Some(0));
    assert_eq!(code("").0, Some(0));
    archive.picture("old/differs.png", &image::RgbImage::new(60, 80));
    assert_eq!(
        code("--limit ssim=0.9").0,
        Some(2),
        "a flat picture of another size"
    );
    let (code, json) = archive.output("compare new old -o report --json --by-name --quiet");
    let report: serde_json::Value = serde_json::from_str(&json).unwrap();
    assert_eq!(
        (code, report["pairs"].as_array().unwrap().len()),
        (Some(2), 3)
    );
    assert_eq!(report["unpaired_new"].as_array().unwrap().len(), 3);
}

#[test]
fn a_file_states_pairs_and_a_row_without_a_file_is_an_error_with_its_line() {
    let archive = two_folders("compare-list");
    let list = |text: &str| std::fs::write(archive.0.join("pairs.csv"), text).unwrap();
    list("old,new\nscan-7.png,only.png\nequal.png,differs.png\n");
    archive.run("compare new old -o report --pair pairs.csv --by-name --quiet");
    let report = archive.json("report/report.json");
    let pairs: Vec<(String, String)> = report["pairs"]
        .as_array()
        .unwrap()
        .iter()
        .filter(|pair| pair["paired_by"] == "list")
        .map(|pair| (pair["new"].to_string(), pair["old"].to_string()))
        .collect();
    let pair = |a: &str, b: &str| (format!("\"{a}\""), format!("\"{b}\""));
    assert_eq!(
        pairs,
        [
            pair("differs.png", "equal.png"),
            pair("only.png", "scan-7.png")
        ]
    );
    list("new,old\nonly.png,scan-7.png\nonyl.png,equal.png\n");
    let (code, said) = archive.run("compare new old -o report --pair pairs.csv");
    assert_eq!(code, Some(2));
    for part in [
        "pairs.csv:3",
        "no new picture `onyl.png`",
        "did you mean `only.png`",
    ] {
        assert!(said.contains(part), "{part} missing in {said}");
    }
}

#[test]
fn scenes_without_a_picture_are_photographed_and_compared() {
    let archive = Archive::new("compare-scenes", &[("a.iv", CUBE), ("b/c.wrl", SPHERE)]);
    let flags = "--size 48x36 --samples 1 --lens none --quiet";
    archive.run(&format!("render in -o old {flags}"));
    archive.picture("in/wood.png", &boxes(1, 1.0));
    archive.picture("in/b/c.png", &image::RgbImage::new(48, 36));
    let line = format!("compare in old -o report --by-name {flags}");
    let (code, said) = archive.run(&line);
    assert_eq!((code, &*said), (Some(0), ""));
    let report = archive.json("report/report.json");
    let pairs = report["pairs"].as_array().unwrap();
    assert_eq!(
        (&pairs[0]["new"], &pairs[0]["measures"]["mse"]),
        (&"a.iv".into(), &0.0.into())
    );
    assert_eq!(
        pairs[1]["new"], "b/c.png",
        "a picture beside its scene is the new one"
    );
    assert_eq!(report["beside_scenes"], 1);
    assert!(archive.has("report/rendered/a.png") && !archive.has("report/rendered/b/c.png"));
    let first = archive.read("report/rendered/a.png");
    archive.run(&line);
    assert!(archive.read("report/rendered/a.png") == first, "it is kept");
    let command = b"ivcam render --lens none ";
    assert!(first.windows(command.len()).any(|part| part == command));
    std::fs::write(archive.0.join("in/a.iv"), "nonsense").unwrap();
    let (code, said) = archive.run(&line);
    assert!(code == Some(2) && said.contains("a.iv: "), "{said}");
}
