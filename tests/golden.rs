//! Renders every `tests/golden/**/*.iv` and holds it against the picture beside it.
//!
//! A scene shows one fact, at 96×64 pixels with a fixed seed. A first-lines comment
//! `# flags: -s p --lens none` adds flags. `UPDATE=1` writes the pictures anew: look at them before
//! they are committed. Pictures are the same on every machine, so one level of difference is
//! already a finding, and is all that is allowed.

use std::ffi::OsString;
use std::path::{Path, PathBuf};

use libtest_mimic::{Arguments, Failed, Trial};

fn main() {
    // Below the package, where cargo starts tests: the pictures keep the command that made them.
    let root = Path::new("tests/golden");
    let mut scenes = Vec::new();
    find(root, &mut scenes);
    scenes.sort();
    let trials = scenes
        .into_iter()
        .map(|scene| {
            let name = scene.strip_prefix(root).unwrap().with_extension("");
            Trial::test(name.display().to_string(), move || check(&scene))
        })
        .collect();
    libtest_mimic::run(&Arguments::from_args(), trials).exit();
}

/// Scenes that have, or are to get, a picture; parts that others inline begin with `_`.
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

fn check(scene: &Path) -> Result<(), Failed> {
    let reference = scene.with_extension("png");
    let update = std::env::var_os("UPDATE").is_some();
    let name = scene.to_string_lossy().replace(['/', '\\', ':'], "_");
    let made = if update {
        reference.clone()
    } else {
        std::env::temp_dir().join(format!("ivcam-golden-{}-{name}.png", std::process::id()))
    };
    render(scene, &made)?;
    if update {
        return Ok(());
    }
    let new = image::open(&made)?.to_rgb8();
    std::fs::remove_file(&made)?;
    let old = image::open(&reference)
        .map_err(|e| format!("{}: {e}; UPDATE=1 makes it", reference.display()))?
        .to_rgb8();
    if new.dimensions() != old.dimensions() {
        return Err("the picture has another size".into());
    }
    let far = new
        .iter()
        .zip(old.iter())
        .filter(|(a, b)| a.abs_diff(**b) > 1)
        .count();
    if far > 0 {
        return Err(format!("{far} values differ by more than one level").into());
    }
    Ok(())
}

fn render(scene: &Path, output: &Path) -> Result<(), Failed> {
    let bytes = std::fs::read(scene)?;
    let text = String::from_utf8_lossy(&bytes);
    let own = text
        .lines()
        .take(8)
        .find_map(|l| l.strip_prefix("# flags:"))
        .unwrap_or_default();
    let mut words: Vec<OsString> = [
        "ivcam",
        "render",
        "--quiet",
        "--size",
        "96x64",
        "--samples",
        "4",
    ]
    .map(OsString::from)
    .to_vec();
    words.extend(own.split_whitespace().map(OsString::from));
    words.extend(["-o".into(), output.into(), scene.into()]);
    match ivcam::cli::run(words) {
        0 => Ok(()),
        code => Err(format!("ended with {code}").into()),
    }
}
