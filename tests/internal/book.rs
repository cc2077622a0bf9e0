//! Checks the pages of the book in `docs/`.

use std::path::{Path, PathBuf};

#[test]
fn every_page_is_in_the_summary_of_the_book() {
    let docs = Path::new(env!("CARGO_MANIFEST_DIR")).join("docs");
    let summary = std::fs::read_to_string(docs.join("SUMMARY.md")).expect("the summary is there");
    let (mut folders, mut pages) = (vec![docs.clone()], Vec::new());
    while let Some(folder) = folders.pop() {
        let entries = std::fs::read_dir(folder).expect("a folder of the book");
        let (below, files): (Vec<PathBuf>, Vec<PathBuf>) = entries
            .map(|entry| entry.expect("an entry of the folder").path())
            .partition(|path| path.is_dir());
        folders.extend(below);
        pages.extend(
            files
                .into_iter()
                .filter(|path| path.extension() == Some("md".as_ref())),
        );
    }
    let name = |page: &PathBuf| {
        page.strip_prefix(&docs)
            .map(|page| page.display().to_string())
    };
    let names = pages
        .iter()
        .flat_map(name)
        .filter(|name| name != "SUMMARY.md");
    let missing: Vec<String> = names
        .filter(|name| !summary.contains(&format!("({name})")))
        .collect();
    assert!(pages.len() > 80 && missing.is_empty(), "{missing:?}");
}
