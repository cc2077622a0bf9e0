//! Checks one scene file.

use std::io::Write;
use std::path::Path;

use indexmap::IndexMap;
use ivcam_base::diag::{Diagnostic, ErrorKind, Result, Severity, counted, printable};
use ivcam_base::work::Budget;
use ivcam_inventor::events::SnapshotOptions;
use ivcam_inventor::iv::{Document, Limits};
use ivcam_inventor::snapshot::SentEvent;
use serde_json::{Value as Json, json};

use super::classes::classes;
use super::contents;
use super::identity::{drawn_text, format_text, packed, round_text, unexpected_ending};
use super::json;
use super::missing::{Missing, missing};
use crate::scene::{CompileOptions, RenderScene, Survey, precision_warning, snapshot};

/// Whether a file could be read as it was written.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum FileState {
    /// Everything in the file was read.
    Whole,
    /// The file is cut off, or a part of it cannot be read.
    Damaged,
    /// Nothing of the file was read.
    Unreadable,
}

impl FileState {
    /// Every state, in the order in which they are counted.
    pub const ALL: [Self; 3] = [Self::Whole, Self::Damaged, Self::Unreadable];

    /// Returns the state of a file that was read. Files that it includes have states of their own.
    pub fn of(document: &Document) -> Self {
        let own = document.sources.first().map(|source| &*source.name);
        let is_damage = |d: &Diagnostic| {
            let file = d.location().0;
            d.kind == ErrorKind::Damaged && (file.is_none() || file == own)
        };
        match document.sink.items().iter().any(is_damage) {
            true => Self::Damaged,
            false => Self::Whole,
        }
    }

    /// Returns the word for the state in reports, in JSON and on the command line.
    pub fn name(self) -> &'static str {
        match self {
            Self::Whole => "whole",
            Self::Damaged => "damaged",
            Self::Unreadable => "unreadable",
        }
    }
}

/// A scene file that was read and surveyed.
pub struct Checked {
    /// The path of the file.
    pub file: String,
    /// The document and its survey, or why the file could not be read.
    pub document: Result<(Document, Survey)>,
    /// The files that the scene names and that cannot be read.
    pub missing: Vec<Missing>,
    /// The events that the scene sends, if the options of the snapshot ask for them.
    pub sent: Vec<SentEvent>,
}

impl Checked {
    /// Reads a file, surveys its scene and decodes its textures.
    pub fn read(
        path: &Path,
        search: &[&Path],
        contain: Option<&Path>,
        limits: &Limits,
        at: &SnapshotOptions,
        options: &CompileOptions,
    ) -> Self {
        let (mut unreadable, mut sent) = (Vec::new(), Vec::new());
        let document = Document::open_or_stdin(path, search, contain, limits).map(|document| {
            let mut survey = {
                let snapshot = snapshot(&document, at, options);
                unreadable = missing(&snapshot, options);
                sent = snapshot.sent().to_vec();
                RenderScene::survey(&snapshot, options)
            };
            let camera = survey.cameras.first().map(|c| c.position);
            let warning = precision_warning(survey.bounds, camera);
            survey.diagnostics.extend(warning.map(|w| *w));
            (document, survey)
        });
        // A survey that had to end is not one of the whole scene.
        let document = document.and_then(|checked| Budget::current().check().map(|()| checked));
        Self {
            file: path.display().to_string(),
            document,
            missing: unreadable,
            sent,
        }
    }

    /// Returns the state of the file itself. Files that it includes have states of their own.
    pub fn state(&self) -> FileState {
        match &self.document {
            Ok((document, _)) => FileState::of(document),
            Err(_) => FileState::Unreadable,
        }
    }

    /// Returns the numbers of named files that are not there or not readable, and of those outside
    /// the folders that may be read.
    pub fn missing_and_outside(&self) -> (usize, usize) {
        let outside = self.missing.iter().filter(|m| m.outside).count();
        (self.missing.len() - outside, outside)
    }

    /// All diagnostics of reading, surveying and decoding.
    pub fn diagnostics(&self) -> Vec<&Diagnostic> {
        match &self.document {
            Ok((document, survey)) => {
                let diagnostics = survey.diagnostics.iter();
                let textures = self.missing.iter().filter_map(|m| m.diagnostic.as_deref());
                let all = document.sink.items().iter().chain(diagnostics);
                all.chain(textures).collect()
            }
            Err(error) => vec![error],
        }
    }

    /// Returns the results as JSON, which docs/guide/machine.md describes.
    pub fn json(&self) -> Json {
        let diagnostics: Vec<Json> = self
            .diagnostics()
            .into_iter()
            .map(json::diagnostic)
            .collect();
        let Ok((document, survey)) = &self.document else {
            let state = self.state().name();
            return json!({ "file": self.file, "state": state, "diagnostics": diagnostics });
        };
        json!({
            "file": self.file,
            "state": self.state().name(),
            "format": document.format,
            "packed": packed(document),
            "unexpected_ending": unexpected_ending(&self.file, document),
            "nodes": document.nodes.len(),
            "classes": classes(document)
                .into_iter()
                .map(|(heading, list)| (heading.to_owned(), json!(list.into_iter().collect::<IndexMap<_, _>>())))
                .collect::<serde_json::Map<_, _>>(),
            "missing": self.missing.iter().map(|m| &m.name).collect::<Vec<_>>(),
            "outside": self.missing.iter().filter(|m| m.outside).map(|m| &m.name).collect::<Vec<_>>(),
            "diagnostics": diagnostics,
            "bounds": survey.bounds.map(|(min, max)| json!({
                "min": min.to_array(), "max": max.to_array(),
            })),
            "view_all": survey.inventor_bounds.map(|(min, max)| json!({
                "min": min.to_array(), "max": max.to_array(),
            })),
            "triangles": survey.triangles,
            "shapes": survey.shapes,
            "lights": survey.lights.iter().map(json::light).collect::<Vec<_>>(),
            "events": self.sent.iter().map(json::event).collect::<Vec<_>>(),
            "camera": survey.cameras.first().map(json::camera),
        })
    }

    /// Returns one line with the file, its format, the numbers of nodes by treatment, of triangles,
    /// round solids and problems, and the worst problem.
    pub fn summary(&self) -> String {
        let line = match &self.document {
            Err(error) => format!("{}: {}", self.file, error.in_line_of(&self.file)),
            Ok((document, survey)) => {
                let becomes: Vec<String> = classes(document)
                    .into_iter()
                    .map(|(heading, list)| (heading, list.iter().map(|c| c.1).sum::<usize>()))
                    .filter(|(_, n)| *n > 0)
                    .map(|(heading, n)| format!("{n} {heading}"))
                    .collect();
                let mut line = format!(
                    "{}: {}, {}",
                    self.file,
                    format_text(&self.file, document),
                    counted(document.nodes.len(), "node")
                );
                if !becomes.is_empty() {
                    line += &format!(" ({})", becomes.join(", "));
                }
                line += &format!(", {}", drawn_text(survey.triangles, &survey.shapes));
                if survey.bounds.is_none() {
                    line += ", nothing to see";
                }
                let (missing, outside) = self.missing_and_outside();
                if missing > 0 {
                    line += &format!(", {} missing", counted(missing, "file"));
                }
                if outside > 0 {
                    let files = counted(outside, "file");
                    line += &format!(", {files} outside the folder (`--search` opens more)");
                }
                let problems: usize = self.problems().map(|d| d.count).sum();
                line += &format!(", {}", counted(problems, "problem"));
                match self.worst_problem() {
                    Some(worst) => line + ": " + &worst.in_line_of(&self.file),
                    None => line,
                }
            }
        };
        printable(&line)
    }

    /// Returns the first of the most severe problems.
    fn worst_problem(&self) -> Option<&Diagnostic> {
        self.problems()
            .reduce(|worst, next| match next.rank() > worst.rank() {
                true => next,
                false => worst,
            })
    }

    /// Warnings and errors.
    pub fn problems(&self) -> impl Iterator<Item = &Diagnostic> {
        self.diagnostics()
            .into_iter()
            .filter(|d| d.severity >= Severity::Warning)
    }

    /// Writes the contents of the file, with a line for each property. Writes nothing if the file
    /// could not be read.
    ///
    /// # Errors
    /// Returns the error of writing to `out`.
    pub fn report(&self, out: &mut dyn Write) -> std::io::Result<()> {
        let Ok((document, survey)) = &self.document else {
            return Ok(());
        };
        writeln!(out, "{}", printable(&self.file))?;
        writeln!(out, "  format     {}", format_text(&self.file, document))?;
        writeln!(out, "  nodes      {}", document.nodes.len())?;
        for (heading, classes) in classes(document) {
            let list: Vec<String> = classes.iter().map(|(c, n)| format!("{c} {n}")).collect();
            if !list.is_empty() {
                writeln!(out, "  {heading:<10} {}", list.join(", "))?;
            }
        }
        match survey.bounds {
            Some((a, b)) => writeln!(
                out,
                "  bounds     {}  to  {}",
                json::short(&json!(a.to_array())),
                json::short(&json!(b.to_array()))
            )?,
            None => writeln!(out, "  bounds     nothing to see")?,
        }
        let round = round_text(&survey.shapes);
        let round = round.map(|round| format!(", and {round} without triangles"));
        let round = round.unwrap_or_default();
        writeln!(out, "  triangles  {}{round}", survey.triangles)?;
        for (heading, line) in contents::lines(document) {
            writeln!(out, "  {heading:<10} {line}")?;
        }
        for event in &self.sent {
            let SentEvent {
                time,
                node,
                event,
                value,
            } = event;
            writeln!(out, "  event      {time:.3} s  {node}.{event} {value}")?;
        }
        for camera in &survey.cameras {
            writeln!(
                out,
                "  camera     {}",
                json::one_line(&json::camera(camera))
            )?;
        }
        for light in &survey.lights {
            writeln!(out, "  light      {}", json::one_line(&json::light(light)))?;
        }
        for (heading, outside) in [("missing", false), ("outside", true)] {
            let files = self.missing.iter().filter(|m| m.outside == outside);
            let names: Vec<&str> = files.map(|m| &*m.name).collect();
            if !names.is_empty() {
                writeln!(out, "  {heading:<10} {}", names.join(", "))?;
            }
        }
        writeln!(out, "  state      {}", self.state().name())?;
        let count: usize = self.problems().map(|d| d.count).sum();
        writeln!(out, "  problems   {count}")?;
        out.flush()
    }
}
