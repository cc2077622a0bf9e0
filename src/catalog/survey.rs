//! Reads one scene: its entry in the catalog, and its thumbnail.

use std::path::{Path, PathBuf};

use ivcam_base::diag::{Diagnostic, Result};
use ivcam_base::files::folder_of;
use ivcam_base::memory::MemoryLimit;
use ivcam_base::work::Budget;
use ivcam_inventor::pose::{CameraPose, ViewDirection};
use ivcam_optics::picture::{Depth, Picture};
use ivcam_render::render::{Counts, Stop};
use ivcam_render::scene::CompileOptions;
use ivcam_render::scene::check::{Checked, classes};

use super::entry::{Entry, Message};
use super::notes::{notes, producer};
use super::options::CatalogOptions;
use crate::photo::{
    Era, NEUTRAL, Optics, Override, Plan, Session, Shading, WholeView, snapshot_options,
};

/// The largest number of problems that an entry lists.
const MOST_MESSAGES: usize = 20;

/// Reads a scene and makes its entry. `file` is its path below `folder`, and `picture` the file of
/// its thumbnail, `name` that file as the page names it.
pub(super) fn survey(
    options: &CatalogOptions,
    input: &Path,
    file: &str,
    picture: &Path,
    name: String,
) -> Entry {
    let search: Vec<&Path> = options.search.iter().map(PathBuf::as_path).collect();
    let compile = CompileOptions {
        texture_folders: options.search.clone(),
        fonts: options.fonts.clone(),
        limits: options.limits.clone(),
        memory: options.allowance.memory,
        ..CompileOptions::default()
    };
    let checked = Checked::read(
        input,
        &search,
        options.contain.as_deref(),
        &options.limits,
        &snapshot_options(0.0),
        &compile,
    );
    let mut entry = of_checked(&checked, file);
    if let Ok((document, survey)) = checked.document {
        entry.uses = document
            .opened_files()
            .iter()
            .map(|path| inside(path, &options.folder))
            .collect();
        if survey.bounds.is_some() {
            let bounds = survey.inventor_bounds.or(survey.bounds);
            let plan = plan(options, input);
            let made = Session::with_document(plan, document)
                .and_then(|session| thumbnail(session, bounds))
                .and_then(|picture_of| save(&picture_of, picture));
            match made {
                Ok(()) => entry.picture = Some(name),
                Err(error) => entry.no_picture = Some(error.message),
            }
        }
    }
    entry
}

/// Returns the entry of a scene without what needs a picture.
fn of_checked(checked: &Checked, file: &str) -> Entry {
    let mut problems: Vec<&Diagnostic> = checked.problems().collect();
    problems.sort_by_key(|d| std::cmp::Reverse(d.rank()));
    let named = |outside: bool| {
        let files = checked.missing.iter().filter(|m| m.outside == outside);
        files.map(|m| m.name.clone()).collect()
    };
    let mut entry = Entry {
        file: file.to_owned(),
        state: checked.state().name().to_owned(),
        missing: named(false),
        outside: named(true),
        problems: problems.iter().map(|d| d.count).sum(),
        messages: problems
            .iter()
            .take(MOST_MESSAGES)
            .map(|d| message(d, checked))
            .collect(),
        ..Entry::default()
    };
    match &checked.document {
        Err(error) => entry.error = Some(own_words(&error.message, checked)),
        Ok((document, survey)) => {
            entry.format = Some(document.format.clone());
            entry.notes = notes(document);
            entry.producer = producer(&entry.notes);
            entry.nodes = document.nodes.len();
            entry.classes = classes(document)
                .into_iter()
                .map(|(heading, list)| (heading.to_owned(), list.into_iter().collect()))
                .collect();
            entry.triangles = survey.triangles;
            let shapes = survey.shapes.iter();
            entry.shapes = shapes.map(|(class, n)| ((*class).to_owned(), *n)).collect();
            entry.size = survey.bounds.map(|(low, high)| (high - low).to_array());
            entry.lights = survey.lights.len();
            entry.cameras = survey.cameras.len();
        }
    }
    entry
}

/// Returns a problem for the catalog.
fn message(d: &Diagnostic, checked: &Checked) -> Message {
    let (file, place) = d.location();
    let other = file.filter(|file| *file != checked.file);
    let name = other.map(|file| Path::new(file).file_name().unwrap_or_default());
    Message {
        severity: d.class().to_owned(),
        line: place.map(|(line, _)| line),
        file: name.map(|name| name.to_string_lossy().into_owned()),
        text: own_words(&d.message, checked),
        count: d.count,
    }
}

/// Returns a message without the path of the scene, which the page shows beside it.
fn own_words(text: &str, checked: &Checked) -> String {
    let quoted = format!("`{}`", checked.file);
    match text.strip_prefix(&format!("{quoted}: ")) {
        Some(rest) => rest.to_owned(),
        None => text.replace(&quoted, "this file"),
    }
}

/// Returns a path below the folder of scenes relative to it, with `/` between its parts.
fn inside(path: &Path, folder: &Path) -> String {
    match path.strip_prefix(folder) {
        Err(_) => path.display().to_string(),
        Ok(rest) => {
            let parts = rest.components().map(|c| c.as_os_str().to_string_lossy());
            parts.collect::<Vec<_>>().join("/")
        }
    }
}

/// Returns the plan of a thumbnail: the scene's camera as a pinhole, without shadows or in a
/// studio.
fn plan(options: &CatalogOptions, input: &Path) -> Plan {
    let mut plan = Plan::of_era(Era::Modern, input);
    plan.optics = Optics::Pinhole;
    plan.shading = Shading::Phong;
    plan.view = Some(Override::IfUnstated(WholeView::Side(
        ViewDirection::THREE_QUARTER,
    )));
    if options.studio {
        plan.shading = Shading::Path;
        plan.light.studio = true;
        plan.response = plan.usual_response();
    } else {
        plan.background = Some(Override::IfUnstated(NEUTRAL));
    }
    plan.resolution = options.thumbnail;
    plan.stop = Stop::after(options.samples);
    plan.search = options.search.clone();
    plan.contain = options.contain.clone();
    plan.fonts = options.fonts.clone();
    plan.limits = options.limits.clone();
    plan.memory = MemoryLimit::Bytes(options.allowance.memory);
    plan.work = options.allowance.work;
    plan
}

/// Renders a thumbnail. If the scene's camera sees nothing, everything is seen from three sides.
fn thumbnail(mut session: Session, bounds: Option<(glam::DVec3, glam::DVec3)>) -> Result<Picture> {
    let picture = |session: &Session| {
        let exposure = session.expose(&|_| {});
        Budget::current().check()?;
        let picture = session.develop(&exposure, "ivcam catalog");
        match is_uniform(&picture) {
            true => Err(nothing_seen(session, &exposure.counts, &picture)),
            false => Ok(picture),
        }
    };
    let first = picture(&session);
    let Some(bounds) = bounds.filter(|_| first.is_err()) else {
        return first;
    };
    Budget::current().check()?;
    let plan = session.plan.clone();
    let (aspect, side) = (plan.resolution.aspect(), ViewDirection::THREE_QUARTER);
    let pose = CameraPose::view_all_from(bounds, aspect, side);
    session.change(plan, pose)?;
    picture(&session)
}

/// Returns why a picture of one color stands for nothing.
fn nothing_seen(session: &Session, counts: &Counts, picture: &Picture) -> Box<Diagnostic> {
    let warning = session.warn_if_black_or_clipped(counts, picture);
    warning.unwrap_or_else(|| Diagnostic::error("the picture has one color everywhere"))
}

/// Returns whether all pixels are the same.
fn is_uniform(picture: &Picture) -> bool {
    picture.pixels.windows(2).all(|pair| pair[0] == pair[1])
}

fn save(picture: &Picture, path: &Path) -> Result<()> {
    let folder = folder_of(path);
    std::fs::create_dir_all(&folder).map_err(|e| Diagnostic::io(folder.display(), &e))?;
    picture.save(path, Depth::Eight)
}
