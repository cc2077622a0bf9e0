//! `ivcam check`: what is in a scene file, what of it is drawn, and what is wrong with it.
//!
//! The JSON form is described in `docs/guide/machine.md`.

use std::io::{IsTerminal, Write};
use std::path::{Path, PathBuf};

use clap::{Arg, ArgAction, ArgMatches, Command, value_parser};
use indexmap::IndexMap;
use serde_json::{Value as Json, json};

use super::flags::{FONTS, LIMIT};
use super::{ERROR, switch, tell};
use crate::diag::{Diagnostic, Result, Severity};
use crate::grammar::Treatment;
use crate::graph::read::Fields;
use crate::graph::state::{LightElement, LightKind};
use crate::iv::{Document, Limits, NodeId};
use crate::pose::{CameraPose, Projection};
use crate::scene::{CompileOptions, RenderScene, Survey, texture};

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
        .arg(switch(
            "full",
            "of many files, the whole report of each, not a line",
        ))
        .arg(switch(
            "handles",
            "count the handles of draggers and manipulators in",
        ))
        .arg(
            path("search")
                .long("search")
                .value_name("FOLDER")
                .action(ArgAction::Append)
                .help("also look here for files that a scene names"),
        )
        .args(super::flags::arguments(&[FONTS, LIMIT]))
}

pub fn run(matches: &ArgMatches, out: &mut dyn Write) -> Result<i32> {
    let named: Vec<&PathBuf> = matches.get_many("scenes").into_iter().flatten().collect();
    let search: Vec<&Path> = matches
        .get_many::<PathBuf>("search")
        .into_iter()
        .flatten()
        .map(PathBuf::as_path)
        .collect();
    let limits = super::limits(matches)?;
    let fonts = super::fonts(matches)?;
    fonts.troubles.iter().for_each(|t| tell(t));
    let options = CompileOptions {
        texture_folders: search.iter().map(|p| p.to_path_buf()).collect(),
        fonts,
        max_primitives: limits.primitives,
        max_visits: limits.visits as u64,
        handles: matches.get_flag("handles"),
        ..CompileOptions::default()
    };
    let files = expand(&named)?;
    let json = matches.get_flag("json");
    let several = files.len() > 1 || named.iter().any(|p| p.is_dir());
    let lines = several && !matches.get_flag("full");
    let bar = progress(files.len(), several);
    let mut total = Total::default();
    for file in &files {
        let checked = Checked::read(file, &search, &limits, &options);
        total.add(&checked);
        let written = match (json, lines) {
            (true, _) if several => writeln!(out, "{}", checked.json()),
            (true, _) => writeln!(out, "{:#}", checked.json()),
            (false, true) => bar.suspend(|| writeln!(out, "{}", checked.summary())),
            (false, false) => bar.suspend(|| checked.report(out)),
        };
        super::written(written)?;
        if json && !several {
            checked.document.as_ref().err().iter().for_each(|e| tell(e));
        }
        bar.inc(1);
    }
    bar.finish_and_clear();
    if several && !json {
        super::written(writeln!(out, "{}", total.line()))?;
    }
    Ok(if total.unread > 0 { ERROR } else { 0 })
}

/// What many files come to.
#[derive(Default)]
struct Total {
    files: usize,
    unread: usize,
    with_problems: usize,
    with_unknown: usize,
    with_missing: usize,
}

impl Total {
    fn add(&mut self, checked: &Checked) {
        self.files += 1;
        self.unread += usize::from(checked.document.is_err());
        self.with_missing += usize::from(!checked.missing.is_empty());
        if let Ok((document, _)) = &checked.document {
            self.with_problems += usize::from(checked.problems().next().is_some());
            self.with_unknown += usize::from(!classes(document)[3].1.is_empty());
        }
    }

    /// `3 files: 1 not read, 1 with problems, …`; what there is none of is left out.
    fn line(&self) -> String {
        let parts = [
            (self.unread, "not read"),
            (self.with_problems, "with problems"),
            (self.with_unknown, "with unknown classes"),
            (self.with_missing, "with missing files"),
        ];
        let told: Vec<String> = parts
            .iter()
            .filter(|(n, _)| *n > 0)
            .map(|(n, what)| format!("{n} {what}"))
            .collect();
        let told = match told.is_empty() {
            true => "nothing to tell".to_owned(),
            false => told.join(", "),
        };
        format!("{}: {told}", counted(self.files, "file"))
    }
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
    /// Files that the scene names and that cannot be read, with why.
    missing: Vec<Missing>,
}

/// A file that is named and cannot be read.
struct Missing {
    name: String,
    trouble: Option<Box<Diagnostic>>,
}

impl Checked {
    fn read(path: &Path, search: &[&Path], limits: &Limits, options: &CompileOptions) -> Self {
        let document = Document::open_with(path, search, limits).map(|document| {
            let survey = RenderScene::survey(&document, options);
            (document, survey)
        });
        let missing = match &document {
            Ok((document, _)) => missing(document, &options.texture_folders),
            Err(_) => Vec::new(),
        };
        Self {
            file: path.display().to_string(),
            document,
            missing,
        }
    }

    fn diagnostics(&self) -> Vec<&Diagnostic> {
        match &self.document {
            Ok((document, survey)) => {
                let troubles = survey.troubles.iter().map(|t| &**t);
                let textures = self.missing.iter().filter_map(|m| m.trouble.as_deref());
                let all = document.sink.items().iter().chain(troubles);
                all.chain(textures).collect()
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
            "classes": classes(document)
                .into_iter()
                .map(|(heading, list)| (heading.to_owned(), json!(list.into_iter().collect::<IndexMap<_, _>>())))
                .collect::<serde_json::Map<_, _>>(),
            "missing": self.missing.iter().map(|m| &m.name).collect::<Vec<_>>(),
            "diagnostics": diagnostics,
            "bounds": survey.bounds.map(|(min, max)| json!({
                "min": min.to_array(), "max": max.to_array(),
            })),
            "view_all": survey.inventor_bounds.map(|(min, max)| json!({
                "min": min.to_array(), "max": max.to_array(),
            })),
            "triangles": survey.triangles,
            "shapes": survey.shapes,
            "lights": survey.lights.iter().map(|l| light(document, l)).collect::<Vec<_>>(),
            "camera": survey.cameras.first().map(camera),
        })
    }

    /// One line: file, format, nodes and what becomes of them, triangles, problems.
    fn summary(&self) -> String {
        match &self.document {
            Err(error) => format!("{}: {}", self.file, self.beside_its_name(error)),
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
                    document.format,
                    counted(document.nodes.len(), "node")
                );
                if !becomes.is_empty() {
                    line += &format!(" ({})", becomes.join(", "));
                }
                line += &format!(", {}", counted(survey.triangles as usize, "triangle"));
                if !self.missing.is_empty() {
                    line += &format!(", {} missing", counted(self.missing.len(), "file"));
                }
                let problems: usize = self.problems().map(|d| d.count).sum();
                line += &format!(", {}", counted(problems, "problem"));
                match self.problems().next() {
                    Some(first) => line + ": " + &self.beside_its_name(first),
                    None => line,
                }
            }
        }
    }

    /// What is wrong, for a line that begins with the file's name.
    fn beside_its_name(&self, trouble: &Diagnostic) -> String {
        let what = trouble.message.replace(&format!("`{}`", self.file), "this");
        let kind = trouble.severity.name();
        match trouble.location() {
            (Some(file), Some((line, column))) if file == self.file => {
                format!("line {line}, column {column}: {kind}: {what}")
            }
            (Some(file), _) if file != self.file => trouble.to_string(),
            _ => format!("{kind}: {what}"),
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
                "  bounds     {}  to  {}",
                short(&json!(a.to_array())),
                short(&json!(b.to_array()))
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
        if !self.missing.is_empty() {
            let names: Vec<&str> = self.missing.iter().map(|m| &*m.name).collect();
            writeln!(out, "  missing    {}", names.join(", "))?;
        }
        let problems: Vec<&Diagnostic> = self.problems().collect();
        let count: usize = problems.iter().map(|d| d.count).sum();
        writeln!(out, "  problems   {count}")?;
        out.flush()?;
        problems.into_iter().for_each(tell);
        Ok(())
    }
}

/// `1 node`, `2 nodes`.
fn counted(n: usize, what: &str) -> String {
    format!("{n} {what}{}", if n == 1 { "" } else { "s" })
}

/// Files that nodes name and that are not there or not readable: included scenes, which reading
/// has told of, and pictures, which it has not opened.
fn missing(document: &Document, folders: &[PathBuf]) -> Vec<Missing> {
    let mut missing: Vec<Missing> = Vec::new();
    for index in 0..document.nodes.len() {
        let id = NodeId(index as u32);
        let node = document.node(id);
        let Some(class) = node.known_class().filter(|_| !document.is_template(id)) else {
            continue;
        };
        let pictures: &[&[&str]] = match class.name {
            "Texture2" | "Texture3" | "Image" | "ImageTexture" => {
                &[&["filename", "url", "filenames"]]
            }
            "Background" => &texture::PANORAMA,
            "File" | "WWWInline" | "Inline" if !document.included.contains_key(&id) => {
                for field in ["name", "url"] {
                    // What is there and not included includes itself, or is no scene.
                    let names = texture::files_named(node, field)
                        .filter(|n| !n.starts_with('<') && document.load_beside(id, n).is_err());
                    missing.extend(names.map(|name| Missing {
                        name: name.to_owned(),
                        trouble: None,
                    }));
                }
                continue;
            }
            _ => continue,
        };
        for fields in pictures {
            if let Err(trouble) = texture::decode_named(node, fields, folders) {
                let name = fields
                    .iter()
                    .flat_map(|f| texture::files_named(node, f))
                    .next();
                missing.push(Missing {
                    name: name.unwrap_or_default().to_owned(),
                    trouble: Some(Box::new(Diagnostic {
                        severity: Severity::Warning,
                        ..*trouble
                    })),
                });
            }
        }
    }
    missing.sort_by(|a, b| a.name.cmp(&b.name));
    missing.dedup_by(|later, first| {
        let same = later.name == first.name;
        if let (true, Some(trouble), Some(_)) = (same, &mut first.trouble, &later.trouble) {
            trouble.count += 1;
        }
        same
    });
    missing
}

/// An `f32` with the digits that people write, and no more.
fn plain(value: f32) -> Json {
    let text = value.to_string();
    text.parse::<f64>().map_or(Json::Null, |v| json!(v))
}

/// Nodes by class and by what becomes of them, the most frequent first.
fn classes(document: &Document) -> [(&'static str, Vec<(String, usize)>); 4] {
    let mut counts: IndexMap<(&str, usize), usize> = IndexMap::new();
    for id in 0..document.nodes.len() {
        let id = NodeId(id as u32);
        if document.is_template(id) || document.stands_for.contains_key(&id) {
            continue; // a proto's body is counted where it is used, by its own nodes
        }
        let node = document.node(id);
        let column = match node.known_class().map(|c| c.treatment) {
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
        "intensity": plain(light.intensity),
        "color": light.color.to_array().map(plain),
    });
    if light.kind != LightKind::Directional {
        object["location"] = json!(light.position.to_array());
    }
    if light.kind != LightKind::Point {
        object["direction"] = json!(light.direction.to_array());
    }
    match light.kind {
        LightKind::Spot { drop_off, cut_off } => {
            object["dropOffRate"] = plain(drop_off);
            object["cutOffAngle"] = plain(cut_off);
        }
        LightKind::Beam {
            beam_width,
            cut_off,
        } => {
            object["beamWidth"] = plain(beam_width);
            object["cutOffAngle"] = plain(cut_off);
        }
        LightKind::Directional | LightKind::Point => {}
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
        .map(|(k, v)| format!("{k} {}", short(v)))
        .collect::<Vec<_>>()
        .join(", ")
}

/// For people: numbers to six digits, lists without brackets, strings without quotes.
fn short(value: &Json) -> String {
    match value {
        Json::Number(n) => match n.as_f64() {
            Some(v) if v != 0.0 => {
                let digits = (5.0 - v.abs().log10().floor()).clamp(0.0, 12.0) as usize;
                let text = format!("{v:.digits$}");
                match text.contains('.') {
                    true => text.trim_end_matches('0').trim_end_matches('.').to_owned(),
                    false => text,
                }
            }
            _ => n.to_string(),
        },
        Json::Array(list) => list.iter().map(short).collect::<Vec<_>>().join(" "),
        Json::Object(_) => one_line(value),
        Json::String(text) => text.clone(),
        other => other.to_string(),
    }
}
