//! `ivcam check`: what is in a scene file, what of it is drawn, and what is wrong with it.
//!
//! The JSON form is described in `docs/guide/machine.md`.

use std::io::{IsTerminal, Write};
use std::path::{Path, PathBuf};

use clap::{Arg, ArgAction, ArgMatches, Command, value_parser};
use indexmap::IndexMap;
use serde_json::{Value as Json, json};

use super::{ERROR, switch, tell};
use crate::diag::{Diagnostic, Result, Severity};
use crate::grammar::Treatment;
use crate::graph::state::{LightElement, LightKind};
use crate::iv::{Document, Limits};
use crate::pose::{CameraPose, Projection};
use crate::scene::{CompileOptions, RenderScene, Survey};

/// Endings of the files that a folder is searched for.
const ENDINGS: [&str; 6] = [".iv", ".wrl", ".iv.gz", ".wrl.gz", ".wrz", ".vrml"];

pub fn command() -> Command {
    let path = |name: &'static str| Arg::new(name).value_parser(value_parser!(PathBuf));
    Command::new("check")
        .about("Tells what is in scene files, what is drawn of it, and what is wrong")
        .arg(
            path("scenes")
                .value_name("SCENE")
                .num_args(1..)
                .required(true)
                .help("scene files, or folders to walk"),
        )
        .arg(switch("json", "answer as JSON, one object a file"))
        .arg(
            path("search")
                .long("search")
                .value_name("FOLDER")
                .action(ArgAction::Append)
                .help("also look here for files that a scene names"),
        )
}

pub fn run(matches: &ArgMatches, out: &mut dyn Write) -> Result<i32> {
    let named: Vec<&PathBuf> = matches.get_many("scenes").into_iter().flatten().collect();
    let search: Vec<&Path> = matches
        .get_many::<PathBuf>("search")
        .into_iter()
        .flatten()
        .map(PathBuf::as_path)
        .collect();
    let files = expand(&named)?;
    let json = matches.get_flag("json");
    let several = files.len() > 1 || named.iter().any(|p| p.is_dir());
    let bar = progress(files.len(), several);
    let mut code = 0;
    for file in &files {
        let checked = Checked::read(file, &search);
        code = code.max(if checked.document.is_ok() { 0 } else { ERROR });
        let written = match (json, several) {
            (true, true) => writeln!(out, "{}", checked.json()),
            (true, false) => writeln!(out, "{:#}", checked.json()),
            (false, true) => bar.suspend(|| writeln!(out, "{}", checked.summary())),
            (false, false) => checked.report(out),
        };
        super::written(written)?;
        if json && !several {
            checked.document.as_ref().err().iter().for_each(|e| tell(e));
        }
        bar.inc(1);
    }
    bar.finish_and_clear();
    Ok(code)
}

fn progress(files: usize, several: bool) -> indicatif::ProgressBar {
    if several && std::io::stderr().is_terminal() {
        indicatif::ProgressBar::new(files as u64)
    } else {
        indicatif::ProgressBar::hidden()
    }
}

/// Every file that was named, and every scene below every folder that was named, sorted.
fn expand(named: &[&PathBuf]) -> Result<Vec<PathBuf>> {
    let mut files = Vec::new();
    for path in named {
        if !path.is_dir() {
            files.push((*path).clone());
            continue;
        }
        let mut folders = vec![(*path).clone()];
        let before = files.len();
        while let Some(folder) = folders.pop() {
            let entries =
                std::fs::read_dir(&folder).map_err(|e| Diagnostic::io(folder.display(), &e))?;
            for path in entries.filter_map(|e| e.ok().map(|e| e.path())) {
                let name = path.to_string_lossy().to_lowercase();
                if path.is_dir() && !path.is_symlink() {
                    folders.push(path);
                } else if ENDINGS.iter().any(|e| name.ends_with(e)) {
                    files.push(path);
                }
            }
        }
        files[before..].sort();
        if files.len() == before {
            return Err(
                Diagnostic::error(format!("no scene files below `{}`", path.display()))
                    .with_help(format!("looked for {}", ENDINGS.join(", "))),
            );
        }
    }
    Ok(files)
}

/// A file that was read and surveyed, or why it could not be.
struct Checked {
    file: String,
    document: Result<(Document, Survey)>,
}

impl Checked {
    fn read(path: &Path, search: &[&Path]) -> Self {
        let document = Document::open_with(path, search, &Limits::default()).map(|document| {
            let options = CompileOptions::default();
            let survey = RenderScene::survey(&document, &options);
            (document, survey)
        });
        Self {
            file: path.display().to_string(),
            document,
        }
    }

    fn diagnostics(&self) -> Vec<&Diagnostic> {
        match &self.document {
            Ok((document, survey)) => {
                let troubles = survey.troubles.iter().map(|t| &**t);
                document.sink.items().iter().chain(troubles).collect()
            }
            Err(error) => vec![error],
        }
    }

    fn json(&self) -> Json {
        let diagnostics: Vec<Json> = self.diagnostics().into_iter().map(diagnostic).collect();
        let Ok((document, survey)) = &self.document else {
            return json!({ "file": self.file, "diagnostics": diagnostics });
        };
        json!({
            "file": self.file,
            "format": document.format,
            "nodes": document.nodes.len(),
            "diagnostics": diagnostics,
            "bounds": survey.bounds.map(|(min, max)| json!({
                "min": min.to_array(), "max": max.to_array(),
            })),
            "triangles": survey.triangles,
            "shapes": survey.shapes,
            "lights": survey.lights.iter().map(|l| light(document, l)).collect::<Vec<_>>(),
            "camera": survey.cameras.first().map(camera),
        })
    }

    /// One line: file, format, nodes, triangles, problems.
    fn summary(&self) -> String {
        match &self.document {
            Err(error) => format!("{}: {error}", self.file),
            Ok((document, survey)) => {
                let problems = self.problems().count();
                let shapes: usize = survey.shapes.values().map(|n| *n as usize).sum();
                format!(
                    "{}: {}, {} nodes, {shapes} shapes, {} triangles, {problems} problems",
                    self.file,
                    document.format,
                    document.nodes.len(),
                    survey.triangles,
                )
            }
        }
    }

    fn problems(&self) -> impl Iterator<Item = &Diagnostic> {
        self.diagnostics()
            .into_iter()
            .filter(|d| d.severity >= Severity::Warning)
    }

    fn report(&self, out: &mut dyn Write) -> std::io::Result<()> {
        let (document, survey) = match &self.document {
            Ok(read) => read,
            Err(error) => {
                tell(error);
                return Ok(());
            }
        };
        writeln!(out, "{}", self.file)?;
        writeln!(out, "  format     {}", document.format)?;
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
                "  bounds     {} {} {}  to  {} {} {}",
                a.x as f32, a.y as f32, a.z as f32, b.x as f32, b.y as f32, b.z as f32
            )?,
            None => writeln!(out, "  bounds     nothing to see")?,
        }
        writeln!(out, "  triangles  {}", survey.triangles)?;
        for camera in &survey.cameras {
            writeln!(out, "  camera     {}", one_line(&self::camera(camera)))?;
        }
        for light in &survey.lights {
            writeln!(
                out,
                "  light      {}",
                one_line(&self::light(document, light))
            )?;
        }
        let problems: Vec<&Diagnostic> = self.problems().collect();
        writeln!(out, "  problems   {}", problems.len())?;
        out.flush()?;
        problems.into_iter().for_each(tell);
        Ok(())
    }
}

/// Nodes by class and by what becomes of them, the most frequent first.
fn classes(document: &Document) -> [(&'static str, Vec<(String, usize)>); 4] {
    let mut counts: IndexMap<(&str, usize), usize> = IndexMap::new();
    for id in 0..document.nodes.len() {
        let node = document.node(crate::iv::NodeId(id as u32));
        let column = match node.class().map(|c| c.treatment) {
            Some(Treatment::Rendered) => 0,
            Some(Treatment::State | Treatment::Group) => 1,
            Some(Treatment::Kept | Treatment::Abstract) => 2,
            None => 3,
        };
        *counts.entry((node.class_name(), column)).or_default() += 1;
    }
    counts.sort_by(|a, n, b, m| m.cmp(n).then(a.cmp(b)));
    ["drawn", "structure", "kept", "unknown"].map(|heading| {
        let column = ["drawn", "structure", "kept", "unknown"]
            .iter()
            .position(|h| *h == heading)
            .unwrap_or_default();
        let of = counts.iter().filter(|((_, c), _)| *c == column);
        (
            heading,
            of.map(|((class, _), n)| ((*class).to_owned(), *n))
                .collect(),
        )
    })
}

fn diagnostic(d: &Diagnostic) -> Json {
    let (file, place) = d.location();
    json!({
        "severity": d.severity.name(),
        "line": place.map(|p| p.0),
        "column": place.map(|p| p.1),
        "message": d.message,
        "help": d.help,
        "file": file,
        "count": d.count,
    })
}

fn light(document: &Document, light: &LightElement) -> Json {
    let mut object = json!({
        "type": document.node(light.node).class_name(),
        "on": true,
        "intensity": light.intensity,
        "color": light.color.to_array(),
        "location": light.position.to_array(),
        "direction": light.direction.to_array(),
    });
    if let LightKind::Spot { drop_off, cut_off } = light.kind {
        object["dropOffRate"] = json!(drop_off);
        object["cutOffAngle"] = json!(cut_off);
    }
    object
}

fn camera(pose: &CameraPose) -> Json {
    let (axis, angle) = pose.orientation.to_axis_angle();
    let mut object = json!({
        "type": pose.source,
        "position": pose.position.to_array(),
        "orientation": { "axis": axis.to_array(), "angle": angle },
        "near": pose.near,
        "far": pose.far,
        "focalDistance": pose.focal_distance,
    });
    match pose.projection {
        Projection::Perspective { height_angle } => object["heightAngle"] = json!(height_angle),
        Projection::Orthographic { height } => object["height"] = json!(height),
    }
    object
}

/// `type PointLight, on true, …` of a flat object.
fn one_line(object: &Json) -> String {
    let parts = object.as_object().into_iter().flatten();
    parts
        .map(|(k, v)| format!("{k} {v}"))
        .collect::<Vec<_>>()
        .join(", ")
}
