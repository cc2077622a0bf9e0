//! Renders every scene under `tests/golden` and compares it with the picture beside it.
//!
//! A scene shows one fact, at 96×64 pixels with a fixed seed. A comment `# flags: -s p --lens none`
//! in its first lines adds flags. Pictures are the same on every machine, so a difference of one
//! level is already a finding, and is all that is allowed.
//!
//! A picture that differs leaves `new.png`, `old.png` and `difference.png` in
//! `target/golden/<scene>/`, and the pictures of all scenes that differ in a run are side by side
//! in `target/golden/sheet.png`. `UPDATE=1` rewrites the references of pictures with any
//! difference, and writes the same sheet.

use std::ffi::OsString;
use std::path::{Path, PathBuf};
use std::sync::{Arc, Mutex};

use image::RgbImage;
use libtest_mimic::{Failed, Trial};

use crate::difference::Difference;
use crate::sheet::{self, Row};

/// What the trials of one run found, in the order in which they ended.
#[derive(Default)]
pub struct Changes {
    rows: Vec<Row>,
    /// Scenes that were compared or updated, whether they changed or not.
    rendered: usize,
}

/// Returns one trial for each scene, named `golden/<folder>/<scene>`.
pub fn trials(changes: &Arc<Mutex<Changes>>) -> Vec<Trial> {
    // Relative to the package, where cargo starts tests: a picture records its command.
    let root = Path::new("tests/golden");
    let mut scenes = Vec::new();
    find(root, &mut scenes);
    // These pictures need the feature that runs scripts.
    if !cfg!(feature = "scripts") {
        scenes.retain(|scene| !scene.starts_with(root.join("scripts")));
    }
    scenes.sort();
    assert!(!scenes.is_empty(), "no scenes in {}", root.display());
    let update = std::env::var_os("UPDATE").is_some();
    let trial = |scene: PathBuf| {
        let name = scene.strip_prefix(root).unwrap().with_extension("");
        let parts: Vec<_> = name.iter().map(|part| part.to_string_lossy()).collect();
        let golden = Golden {
            name: parts.join("/"),
            scene,
        };
        let changes = Arc::clone(changes);
        Trial::test(format!("golden/{}", golden.name), move || {
            let row = golden.examine(update)?;
            let result = match &row {
                Some(row) if !update => Err(Failed::from(&row.message)),
                _ => Ok(()),
            };
            let mut changes = changes.lock().unwrap();
            changes.rendered += 1;
            changes.rows.extend(row);
            result
        })
    };
    scenes.into_iter().map(trial).collect()
}

/// Writes the sheet of a run, or removes an older one if no picture changed.
pub fn finish(changes: &Mutex<Changes>) {
    let mut changes = changes.lock().unwrap();
    if changes.rendered == 0 {
        return;
    }
    changes.rows.sort_by(|a, b| a.name.cmp(&b.name));
    let folder = results();
    if changes.rows.is_empty() {
        sheet::remove(&folder);
    } else {
        let path = sheet::write(&changes.rows, &folder);
        println!("changed pictures: {}\n", path.display());
    }
}

/// The folder of what a run leaves behind: `golden` in cargo's target directory.
///
/// Cargo documents `CARGO_TARGET_TMPDIR` as a folder inside the target directory, wherever
/// `CARGO_TARGET_DIR` puts it.
fn results() -> PathBuf {
    Path::new(env!("CARGO_TARGET_TMPDIR")).with_file_name("golden")
}

/// Finds the scenes that have, or are to get, a picture. Names of files that others include begin
/// with `_`.
fn find(folder: &Path, out: &mut Vec<PathBuf>) {
    let Ok(entries) = std::fs::read_dir(folder) else {
        return;
    };
    for path in entries.map(|e| e.unwrap().path()) {
        let name = path.file_name().unwrap().to_string_lossy().into_owned();
        let is_scene = [".iv", ".wrl"].iter().any(|e| name.ends_with(e));
        if path.is_dir() {
            find(&path, out);
        } else if is_scene && !name.starts_with('_') {
            out.push(path);
        }
    }
}

/// A scene and the name of its trial.
struct Golden {
    name: String,
    scene: PathBuf,
}

impl Golden {
    fn reference(&self) -> PathBuf {
        self.scene.with_extension("png")
    }

    /// The folder of this scene's pictures when they differ.
    fn folder(&self) -> PathBuf {
        results().join(&self.name)
    }

    /// Renders the scene, and returns a row if the picture differs from the reference.
    ///
    /// Leaves the pictures of a scene that differs in its folder. With `update`, the new picture
    /// becomes the reference.
    fn examine(&self, update: bool) -> Result<Option<Row>, Failed> {
        let folder = self.folder();
        if folder.exists() {
            std::fs::remove_dir_all(&folder)?;
        }
        // Two runs at a time share the target directory, so the file has the number of the process.
        let file = format!("{}-{}.png", self.name.replace('/', "-"), std::process::id());
        let made = Path::new(env!("CARGO_TARGET_TMPDIR")).join(file);
        render(&self.scene, &made)?;
        let new = image::open(&made)?.to_rgb8();
        let reference = self.reference();
        let old = if reference.exists() {
            Some(image::open(&reference)?.to_rgb8())
        } else {
            None
        };
        let row = self.compare(old, new, if update { 0 } else { 1 });
        if let Some(row) = &row {
            std::fs::create_dir_all(&folder)?;
            std::fs::copy(&made, folder.join("new.png"))?;
            if let Some(old) = &row.old {
                old.save(folder.join("old.png"))?;
            }
            if let Some(difference) = &row.difference {
                difference.save(folder.join("difference.png"))?;
            }
            if update {
                // Rendered again, since a picture records the command with its own name.
                render(&self.scene, &reference)?;
            }
        }
        std::fs::remove_file(&made)?;
        Ok(row)
    }

    /// Compares two pictures, and says in words how they differ.
    fn compare(&self, old: Option<RgbImage>, new: RgbImage, allowed: u8) -> Option<Row> {
        let (message, difference) = match &old {
            None => {
                let message = format!(
                    "{} is missing; look at {} and make it the reference with \
                     `UPDATE=1 cargo test --test files golden/{}`",
                    self.reference().display(),
                    self.folder().join("new.png").display(),
                    self.name
                );
                (message, None)
            }
            Some(old) if old.dimensions() != new.dimensions() => {
                let ((a, b), (c, d)) = (old.dimensions(), new.dimensions());
                let message = format!(
                    "the picture has {c}×{d} pixels, the reference {a}×{b}; see {}",
                    self.folder().display()
                );
                (message, None)
            }
            Some(old) => {
                let found = Difference::between(old, &new, allowed)?;
                let message = format!(
                    "{found}; the difference is amplified {} times in {}",
                    found.amplification,
                    self.folder().join("difference.png").display()
                );
                (message, Some(found.picture))
            }
        };
        Some(Row {
            name: self.name.clone(),
            message,
            old,
            new,
            difference,
        })
    }
}

fn render(scene: &Path, output: &Path) -> Result<(), Failed> {
    let bytes = std::fs::read(scene)?;
    let text = String::from_utf8_lossy(&bytes);
    let own = text
        .lines()
        .take(8)
        .find_map(|l| l.strip_prefix("# flags:"))
        .unwrap_or_default();
    let common = "ivcam render --quiet --size 96x64 --samples 4";
    let words = common.split_whitespace().chain(own.split_whitespace());
    let mut words: Vec<OsString> = words.map(OsString::from).collect();
    words.extend(["-o".into(), output.into(), scene.into()]);
    match ivcam::cli::run(words) {
        0 => Ok(()),
        code => Err(format!("ended with {code}").into()),
    }
}
