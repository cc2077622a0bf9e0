//! Makes a catalog: the entries that are out of date, the page and its data.

use std::collections::HashMap;
use std::path::{Path, PathBuf};
use std::time::UNIX_EPOCH;

use ivcam_base::diag::{Diagnostic, Result, Sink};
use ivcam_base::files::{read_file, write_whole};
use ivcam_base::platform::real_path;
use ivcam_render::scene::check::without_ending;
use serde::{Deserialize, Serialize};

use super::entry::Entry;
use super::links::{converted, link};
use super::options::CatalogOptions;
use super::page::page;
use super::survey::survey;
use crate::archive::{Job, Jobs, Naming, for_each, is_newer};

/// The names of the files of a catalog, and of the folder with its pictures.
const PAGE: &str = "index.html";
const DATA: &str = "catalog.json";
const PICTURES: &str = "pictures";
/// The largest size of `catalog.json`, in bytes.
const MOST_DATA: usize = 1 << 30;
/// The number of new entries after which the data are written, so that an interrupted run loses
/// few.
const SAVED: usize = 200;

/// The content of `catalog.json`.
#[derive(Debug, Serialize, Deserialize)]
struct Data {
    /// The version of the program that made the catalog.
    ivcam: String,
    /// The options that entries depend on.
    options: Vec<String>,
    /// The folder of scenes as an address relative to the page.
    folder: String,
    scenes: Vec<Entry>,
}

/// The numbers of scenes of a catalog.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub(crate) struct CatalogSum {
    /// All scenes.
    pub scenes: usize,
    /// Scenes that were not read, because their entries are up to date.
    pub up_to_date: usize,
    pub damaged: usize,
    pub unreadable: usize,
    pub empty: usize,
    /// Scenes with something to draw of which no picture could be made.
    pub without_picture: usize,
    pub with_missing: usize,
    pub with_unknown: usize,
}

/// The scenes of a catalog, before they are read.
pub(crate) struct Catalog {
    options: CatalogOptions,
    jobs: Vec<Job>,
    /// The canonical path of the folder of the catalog.
    out: PathBuf,
    /// The entries of the last run, by file. Empty if they were made with other options.
    old: HashMap<String, Entry>,
    /// Warnings about files that are not read.
    pub sink: Sink,
}

impl Catalog {
    /// Finds the scenes, creates the folder of the catalog, and reads the last catalog in it.
    ///
    /// # Errors
    /// Returns an error if there are no scenes, if the folder cannot be created, or if it has an
    /// `index.html` that is not a catalog's.
    pub(crate) fn open(mut options: CatalogOptions) -> Result<Self> {
        let found = Jobs::find(&options.folder, &options.out, "png", Naming::Full)?;
        let mut sink = found.sink;
        let mut jobs = found.list;
        let (page, data) = (options.out.join(PAGE), options.out.join(DATA));
        if page.exists() && !data.exists() && !options.force {
            let text = format!("`{}` exists and is not a catalog", page.display());
            return Err(Diagnostic::error(text)
                .with_help("choose another output folder, or replace it with `--force`"));
        }
        let io = |path: &Path, e: std::io::Error| Diagnostic::io(path.display(), &e);
        std::fs::create_dir_all(&options.out).map_err(|e| io(&options.out, e))?;
        let out = real_path(&options.out).map_err(|e| io(&options.out, e))?;
        let folder = real_path(&options.folder);
        let folder = folder.map_err(|e| io(&options.folder, e))?;
        for job in &mut jobs {
            job.output = out.join(PICTURES).join(format!("{}.png", job.name));
        }
        options.folder = folder;
        let old = match options.force {
            true => HashMap::new(),
            false => old_entries(&data, &options.words, &mut sink),
        };
        Ok(Self {
            options,
            jobs,
            out,
            old,
            sink,
        })
    }

    /// Returns the number of scenes.
    pub(crate) fn len(&self) -> usize {
        self.jobs.len()
    }

    /// Reads the scenes whose entries are out of date, and writes the catalog. `done` receives the
    /// name of each scene that was read, and a line about it if it could not be read.
    ///
    /// # Errors
    /// Returns an error if the catalog cannot be written.
    pub(crate) fn make(&self, done: &mut dyn FnMut(&str, Option<String>)) -> Result<CatalogSum> {
        let (current, waiting): (Vec<&Job>, Vec<&Job>) =
            self.jobs.iter().partition(|job| self.is_current(job));
        let mut entries: HashMap<String, Entry> = current
            .iter()
            .filter_map(|job| Some((job.name.clone(), self.old.get(&job.name)?.clone())))
            .collect();
        let work = |job: &&Job| {
            let name = format!("{PICTURES}/{}.png", job.name);
            let options = &self.options;
            let survey = || survey(options, &job.input, &job.name, &job.output, name);
            Ok(options.allowance.during(survey))
        };
        let mut failure = None;
        let mut add = |job: &&Job, result: Result<Entry>| {
            let mut entry = result.unwrap_or_else(|error| failed(job, &error));
            (entry.bytes, entry.modified) = size_and_time(&job.input).unwrap_or_default();
            let why = entry.error.as_ref().or(entry.no_picture.as_ref());
            done(&job.name, why.map(|why| format!("{}: {why}", job.name)));
            entries.insert(job.name.clone(), entry);
            if entries.len().is_multiple_of(SAVED) {
                failure = failure.take().or(self.write_data(&entries).err());
            }
        };
        for_each(&waiting, self.options.threads, &work, &mut add)?;
        if let Some(error) = failure {
            return Err(error);
        }
        let data = self.write_data(&entries)?;
        let title = self.options.folder.file_name().unwrap_or_default();
        let text = page(&title.to_string_lossy(), &data.folder, &data.scenes);
        write_whole(&self.options.out.join(PAGE), |file| {
            file.write_all(text.as_bytes())
        })?;
        Ok(sum(&data.scenes, current.len()))
    }

    /// Returns whether a scene and the files that it uses are as the last run saw them. A scene
    /// with missing files never is: they may have been found.
    fn is_current(&self, job: &Job) -> bool {
        let Some(old) = self.old.get(&job.name) else {
            return false;
        };
        let uses: Vec<PathBuf> = old
            .uses
            .iter()
            .map(|f| self.options.folder.join(f))
            .collect();
        let uses: Vec<&Path> = uses.iter().map(PathBuf::as_path).collect();
        old.missing.is_empty()
            && old.outside.is_empty()
            && size_and_time(&job.input) == Some((old.bytes, old.modified))
            && match old.picture {
                Some(_) => is_newer(&job.output, &uses),
                None => is_newer(&self.options.out.join(DATA), &uses),
            }
    }

    /// Writes `catalog.json` and returns its content, with the scenes in order.
    fn write_data(&self, entries: &HashMap<String, Entry>) -> Result<Data> {
        let mut stems: HashMap<&str, usize> = HashMap::new();
        for job in &self.jobs {
            *stems.entry(without_ending(&job.name)).or_default() += 1;
        }
        let folders: Vec<PathBuf> = std::iter::once(&self.out)
            .chain(&self.options.converted)
            .cloned()
            .collect();
        let listed = self.jobs.iter().filter_map(|job| {
            let mut entry = entries.get(&job.name)?.clone();
            let stem = Some(without_ending(&job.name)).filter(|stem| stems[stem] == 1);
            let scene = self.options.folder.join(&job.name);
            entry.converted = converted(&self.out, &folders, &job.name, stem, &scene);
            Some(entry)
        });
        let data = Data {
            ivcam: env!("CARGO_PKG_VERSION").to_owned(),
            options: self.options.words.clone(),
            folder: link(&self.out, &self.options.folder),
            scenes: listed.collect(),
        };
        write_whole(&self.options.out.join(DATA), |file| {
            serde_json::to_writer_pretty(&mut *file, &data)?;
            writeln!(file)
        })?;
        Ok(data)
    }
}

/// Reads the entries of the last catalog, if it was made with the same options.
fn old_entries(data: &Path, words: &[String], sink: &mut Sink) -> HashMap<String, Entry> {
    let Ok(bytes) = read_file(data, MOST_DATA) else {
        return HashMap::new();
    };
    match serde_json::from_slice::<Data>(&bytes) {
        Ok(old) if old.options == words && old.ivcam == env!("CARGO_PKG_VERSION") => {
            let entries = old.scenes.into_iter();
            entries.map(|entry| (entry.file.clone(), entry)).collect()
        }
        Ok(_) => HashMap::new(),
        Err(error) => {
            let text = format!("`{}` cannot be read: {error}", data.display());
            let help = "all scenes are read again";
            sink.add(*Diagnostic::warning(text).with_help(help));
            HashMap::new()
        }
    }
}

/// Returns the entry of a scene on which the program failed.
fn failed(job: &Job, error: &Diagnostic) -> Entry {
    Entry {
        file: job.name.clone(),
        state: "unreadable".to_owned(),
        error: Some(error.message.clone()),
        ..Entry::default()
    }
}

/// Returns the size of a file in bytes, and the time of its last modification in seconds.
fn size_and_time(path: &Path) -> Option<(u64, u64)> {
    let about = path.metadata().ok()?;
    let time = about.modified().ok()?.duration_since(UNIX_EPOCH);
    Some((about.len(), time.map_or(0, |time| time.as_secs())))
}

/// Counts the entries of each kind.
fn sum(scenes: &[Entry], up_to_date: usize) -> CatalogSum {
    let count = |is: &dyn Fn(&Entry) -> bool| scenes.iter().filter(|entry| is(entry)).count();
    CatalogSum {
        scenes: scenes.len(),
        up_to_date,
        damaged: count(&|e| e.state == "damaged"),
        unreadable: count(&|e| e.error.is_some()),
        empty: count(&Entry::is_empty),
        without_picture: count(&|e| e.no_picture.is_some()),
        with_missing: count(&|e| !e.missing.is_empty()),
        with_unknown: count(&|e| e.unknown() > 0),
    }
}
