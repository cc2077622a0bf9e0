//! Reads every file under `tests/iv`, files as people wrote them.
//!
//! A file in `accept` reads without a message, and as what its `# means:` lines say, if it has any.
//! A file in `tolerate` reads with the messages of its `# says:` lines and no others. A file in
//! `reject` does not read, and fails with the message of its `# fails:` line.

use std::path::{Path, PathBuf};
use std::sync::Arc;

use ivcam::iv::{Document, Format, Limits, NoFiles};
use libtest_mimic::{Failed, Trial};

/// Returns one trial for each file, named `iv/<folder>/<file>`.
pub fn trials() -> Vec<Trial> {
    let root = Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/iv");
    let mut trials = Vec::new();
    for (kind, check) in [
        ("accept", accept as fn(&Path) -> Result<(), Failed>),
        ("tolerate", tolerate),
        ("reject", reject),
    ] {
        for file in files(&root.join(kind)) {
            let name = file.file_stem().unwrap_or_default().to_string_lossy();
            let name = format!("iv/{kind}/{name}");
            trials.push(Trial::test(name, move || check(&file)));
        }
    }
    trials
}

fn files(folder: &Path) -> Vec<PathBuf> {
    let entries = std::fs::read_dir(folder).into_iter().flatten().flatten();
    let mut files: Vec<PathBuf> = entries.map(|e| e.path()).collect();
    files.sort();
    assert!(!files.is_empty(), "no files in {}", folder.display());
    files
}

/// Returns the texts of the comments that begin with a word and a colon.
fn stated(file: &Path, word: &str) -> Result<Vec<String>, Failed> {
    let bytes = std::fs::read(file)?;
    let text: String = bytes.iter().map(|&b| char::from(b)).collect();
    let prefix = format!("# {word}: ");
    let lines = text.split(['\n', '\r']);
    let found = lines.filter_map(|l| l.strip_prefix(&prefix));
    Ok(found.map(str::to_owned).collect())
}

fn messages(document: &Document) -> Vec<String> {
    let items = document.sink.items().iter();
    items.map(ToString::to_string).collect()
}

fn accept(file: &Path) -> Result<(), Failed> {
    let document = Document::open(file).map_err(|e| e.render(false))?;
    let said = messages(&document);
    if !said.is_empty() {
        return Err(said.join("\n").into());
    }
    let means = stated(file, "means")?.join("\n");
    if !means.is_empty() {
        let text = format!("#Inventor V2.1 ascii\n{means}").into_bytes();
        let plain = Document::read("means", text, Arc::new(NoFiles), &Limits::default())
            .map_err(|e| e.render(false))?;
        let written = |d: &Document| String::from_utf8_lossy(&d.write(Format::Ascii)).into_owned();
        if written(&plain) != written(&document) {
            let (wanted, got) = (written(&plain), written(&document));
            return Err(format!("wanted\n{wanted}\ngot\n{got}").into());
        }
    }
    Ok(())
}

fn tolerate(file: &Path) -> Result<(), Failed> {
    let document = Document::open(file).map_err(|e| e.render(false))?;
    let said = messages(&document);
    let wanted = stated(file, "says")?;
    let all_there = wanted.iter().all(|w| said.iter().any(|s| s.contains(w)));
    if all_there && wanted.len() == said.len() && !wanted.is_empty() {
        Ok(())
    } else {
        Err(format!("wanted\n{}\ngot\n{}", wanted.join("\n"), said.join("\n")).into())
    }
}

fn reject(file: &Path) -> Result<(), Failed> {
    let Err(error) = Document::open(file) else {
        return Err("it reads".into());
    };
    let wanted = stated(file, "fails")?;
    if wanted.iter().all(|w| error.message.contains(w)) {
        Ok(())
    } else {
        Err(format!("wanted {wanted:?}, got {}", error.message).into())
    }
}
