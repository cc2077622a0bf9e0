//! What the report of a conversion says about the file that was read.

use ivcam_base::diag::Severity;
use ivcam_inventor::iv::Document;
use ivcam_render::scene::check::{FileState, diagnostic_json, missing};
use ivcam_render::scene::{CompileOptions, snapshot};
use serde_json::{Value as Json, json};

use super::conversion::Conversion;
use crate::photo::snapshot_options;

/// Returns the keys of a report about the source of a conversion, with the meanings that they have
/// in `ivcam check --json` and in `catalog.json`: the state of the file, the files that it names
/// and that are missing or outside the folders that may be read, and its problems.
pub(crate) fn source_report(
    document: &Document,
    conversion: &Conversion,
    compile: &CompileOptions,
) -> Json {
    let taken = snapshot(document, &snapshot_options(0.0), compile);
    let files = missing(&taken, compile);
    let named = |outside: bool| -> Vec<&str> {
        let files = files.iter().filter(|file| file.outside == outside);
        files.map(|file| &*file.name).collect()
    };
    let found = document.sink.items().iter().chain(&conversion.diagnostics);
    let problems = found.filter(|d| d.severity >= Severity::Warning);
    json!({
        "state": FileState::of(document).name(),
        "missing": named(false),
        "outside": named(true),
        "diagnostics": problems.map(diagnostic_json).collect::<Vec<Json>>(),
    })
}
