//! Reads one scene: its entry in the catalog, its pictures, and what its page shows of it.

use std::path::{Path, PathBuf};

use ivcam_base::diag::{Diagnostic, Result};
use ivcam_base::files::{folder_of, named_project, write_whole};
use ivcam_base::memory::MemoryLimit;
use ivcam_base::work::Budget;
use ivcam_inventor::iv::{Document, Format};
use ivcam_inventor::pose::{CameraPose, ViewDirection};
use ivcam_optics::film::Resolution;
use ivcam_optics::picture::{Depth, Picture};
use ivcam_render::render::Stop;
use ivcam_render::scene::CompileOptions;
use ivcam_render::scene::check::{Checked, classes, packed, unexpected_ending};

use super::alike::look;
use super::entry::{Entry, Message, Need};
use super::formats::pronom;
use super::links::joined;
use super::needs::{inside, needs, size_and_time, typefaces, units};
use super::notes::{notes, producer};
use super::options::CatalogOptions;
use super::place;
use super::sha256::{self, HashWriter};
use super::tree::{MOST_PROBLEMS, SceneDetail, tree};
use crate::archive::{Job, one_color};
use crate::photo::{
    Denoiser, Era, NEUTRAL, Optics, Override, Plan, Session, Shading, WholeView, snapshot_options,
};

/// The largest number of problems that an entry lists.
const MOST_MESSAGES: usize = 20;
/// The ratio of the sizes of the large picture of a scene and its thumbnail.
const ENLARGED: u32 = 3;

/// Reads a scene, writes its pictures and the file of its [`SceneDetail`] below `out`, and returns
/// its entry.
///
/// # Errors
/// Returns an error if the file of the detail cannot be written.
pub(super) fn survey(options: &CatalogOptions, job: &Job, out: &Path) -> Result<Entry> {
    // A file that changes while it is read is seen as changed by the next run.
    let size_and_time = size_and_time(&job.input).unwrap_or_default();
    let sha256 = sha256::of_file(&job.input).unwrap_or_default();
    let search: Vec<&Path> = options.search.iter().map(PathBuf::as_path).collect();
    let compile = CompileOptions {
        texture_folders: options.search.clone(),
        fonts: options.fonts.clone(),
        limits: options.limits.clone(),
        memory: options.allowance.memory,
        ..CompileOptions::default()
    };
    let contain = options.contain.clone();
    let contain = contain.or_else(|| named_project(&job.input, &options.folder));
    let checked = Checked::read(
        &job.input,
        &search,
        contain.as_deref(),
        &options.limits,
        &snapshot_options(0.0),
        &compile,
    );
    let mut entry = of_checked(&checked, &job.name);
    let mut detail = SceneDetail {
        problems: problems(&checked, MOST_PROBLEMS),
        ..SceneDetail::default()
    };
    if let Ok((document, _)) = &checked.document {
        entry.needs = needs(&checked, document, &options.folder);
        entry.typefaces = typefaces(document, &options.fonts);
        entry.scene_sha256 = scene_sha256(document);
        detail.files = files(&entry.needs, &job.name);
        (detail.nodes, detail.nodes_left_out) = tree(document);
    }
    if let Ok((document, survey)) = checked.document {
        entry.uses = document
            .opened_files()
            .iter()
            .map(|path| inside(path, &options.folder))
            .collect();
        if survey.bounds.is_some() {
            let bounds = survey.inventor_bounds.or(survey.bounds);
            let plan = plan(options, &job.input, contain);
            let made = Session::with_document(plan, document)
                .and_then(|session| photograph(session, bounds, options.denoiser.as_ref()))
                .and_then(|large| save_both(&large, &mut entry, out));
            if let Err(error) = made {
                entry.no_picture = Some(error.message);
            }
        }
    }
    entry.out_of_time = Budget::current().stop().is_set();
    entry.sha256 = sha256;
    (entry.bytes, entry.modified) = size_and_time;
    // A page of an earlier run is out of date.
    let _ = std::fs::remove_file(out.join(place::scene_page(&job.name)));
    let path = out.join(place::detail(&job.name));
    create_folder_of(&path)?;
    write_whole(&path, |file| Ok(serde_json::to_writer(file, &detail)?))?;
    Ok(entry)
}

/// Returns the hash of a scene's nodes as they are written, or `None` if there are no nodes.
fn scene_sha256(document: &Document) -> Option<String> {
    let mut hash = HashWriter::default();
    let written = document.write_to(Format::Ascii, &mut hash);
    (written.is_ok() && !document.roots.is_empty()).then(|| hash.finish())
}

/// Returns the addresses, relative to the page of a scene, of the files that it needs and that a
/// catalog can copy.
fn files(needs: &[Need], name: &str) -> Vec<String> {
    let found = needs.iter().filter(|need| need.is_inside());
    let address = |need: &Need| place::root(name) + &joined(place::FILES, &need.file);
    found.map(address).collect()
}

/// Returns the entry of a scene without what needs a picture.
fn of_checked(checked: &Checked, file: &str) -> Entry {
    let named = |outside: bool| {
        let files = checked.missing.iter().filter(|m| m.outside == outside);
        files.map(|m| m.name.clone()).collect()
    };
    let mut entry = Entry {
        file: file.to_owned(),
        state: checked.state().name().to_owned(),
        missing: named(false),
        outside: named(true),
        problems: checked.problems().map(|d| d.count).sum(),
        messages: problems(checked, MOST_MESSAGES),
        ..Entry::default()
    };
    match &checked.document {
        Err(error) => entry.error = Some(own_words(&error.message, checked)),
        Ok((document, survey)) => {
            entry.format = Some(document.format.clone());
            let is_binary = document.sources.first().is_some_and(|source| source.binary);
            entry.pronom = pronom(&document.format, is_binary).map(str::to_owned);
            entry.packed = packed(document).map(str::to_owned);
            entry.unexpected_ending = unexpected_ending(file, document).map(str::to_owned);
            entry.units = units(document);
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

/// Returns the most severe problems of a scene.
fn problems(checked: &Checked, most: usize) -> Vec<Message> {
    let mut problems: Vec<&Diagnostic> = checked.problems().collect();
    problems.sort_by_key(|d| std::cmp::Reverse(d.rank()));
    let listed = problems.into_iter().take(most);
    listed.map(|d| message(d, checked)).collect()
}

/// Returns a problem for the catalog.
fn message(d: &Diagnostic, checked: &Checked) -> Message {
    let (file, place) = d.location();
    let other = file.filter(|file| *file != checked.file);
    let name = other.map(|file| Path::new(file).file_name().unwrap_or_default());
    Message {
        severity: d.class().to_owned(),
        line: place.map(|(line, _)| line),
        column: place.map(|(_, column)| column),
        byte: d.byte(),
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

/// Returns the plan of the large picture: the scene's camera as a pinhole, without shadows or in a
/// studio.
fn plan(options: &CatalogOptions, input: &Path, contain: Option<PathBuf>) -> Plan {
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
    let Resolution { width, height } = options.thumbnail;
    plan.resolution = Resolution::of(ENLARGED * width, ENLARGED * height);
    plan.stop = Stop::after(options.samples);
    plan.search = options.search.clone();
    plan.contain = contain;
    plan.fonts = options.fonts.clone();
    plan.limits = options.limits.clone();
    plan.memory = MemoryLimit::Bytes(options.allowance.memory);
    plan.work = options.allowance.work;
    plan
}

/// Renders the large picture. If the scene's camera sees nothing, everything is seen from three
/// sides.
fn photograph(
    mut session: Session,
    bounds: Option<(glam::DVec3, glam::DVec3)>,
    denoiser: Option<&Denoiser>,
) -> Result<Picture> {
    let picture = |session: &Session| {
        let exposure = session.expose(&|_| {});
        Budget::current().check()?;
        let picture = session.develop(&exposure, "ivcam catalog");
        match one_color(session, &exposure.counts, &picture) {
            Some(why) => Err(why),
            None => Ok((picture, exposure)),
        }
    };
    let first = picture(&session);
    let (picture, exposure) = match bounds.filter(|_| first.is_err()) {
        None => first?,
        Some(bounds) => {
            Budget::current().check()?;
            let plan = session.plan.clone();
            let (aspect, side) = (plan.resolution.aspect(), ViewDirection::THREE_QUARTER);
            let pose = CameraPose::view_all_from(bounds, aspect, side);
            session.change(plan, pose)?;
            picture(&session)?
        }
    };
    match denoiser {
        None => Ok(picture),
        Some(denoiser) => session.denoised(&picture, &session.surfaces_of(&exposure), denoiser),
    }
}

/// Saves a large picture and its thumbnail, and enters them.
fn save_both(large: &Picture, entry: &mut Entry, out: &Path) -> Result<()> {
    let small = reduced(large);
    let names = [place::picture(&entry.file), place::large(&entry.file)];
    for (picture, name) in [&small, large].into_iter().zip(&names) {
        let path = out.join(name);
        create_folder_of(&path)?;
        picture.save(&path, Depth::Eight)?;
    }
    entry.look = Some(look(&small));
    [entry.picture, entry.large] = names.map(Some);
    Ok(())
}

/// Returns the thumbnail of a large picture: each of its pixels is the mean exposure of
/// [`ENLARGED`]² pixels.
fn reduced(large: &Picture) -> Picture {
    let (width, height) = (large.width / ENLARGED, large.height / ENLARGED);
    let part = (0..ENLARGED).flat_map(|y| (0..ENLARGED).map(move |x| (x, y)));
    let mean = |i: u32| {
        let (left, top) = (ENLARGED * (i % width), ENLARGED * (i / width));
        let mut sum = [0.0; 3];
        for (x, y) in part.clone() {
            let pixel = large.pixels[((top + y) * large.width + left + x) as usize];
            sum.iter_mut()
                .zip(pixel)
                .for_each(|(sum, level)| *sum += level);
        }
        sum.map(|sum: f32| sum / (ENLARGED * ENLARGED) as f32)
    };
    Picture {
        width,
        height,
        pixels: (0..width * height).map(mean).collect(),
        response: large.response.clone(),
        provenance: large.provenance.clone(),
    }
}

fn create_folder_of(path: &Path) -> Result<()> {
    let folder = folder_of(path);
    std::fs::create_dir_all(&folder).map_err(|e| Diagnostic::io(folder.display(), &e))
}
