//! Makes a catalog: the entries that are out of date, the pages and the data.

use std::collections::HashMap;
use std::path::{Path, PathBuf};

use ivcam_base::diag::{Diagnostic, Result, Sink};
use ivcam_base::files::{read_file, write_whole};
use ivcam_base::platform::real_path;
use ivcam_render::scene::check::without_ending;
use serde::{Deserialize, Serialize};

use super::alike::relate;
use super::entry::Entry;
use super::heading::CatalogHeading;
use super::linked::write_linked;
use super::links::{converted, link};
use super::live;
use super::needs::size_and_time;
use super::options::CatalogOptions;
use super::page::write_page;
use super::place;
use super::scene_page::ScenePages;
use super::survey::survey;
use super::table::write_table;
use super::template::STYLE;
use crate::archive::{Job, Jobs, Naming, for_each, is_newer, path_of};

/// The largest size of `catalog.json`, in bytes.
const MOST_DATA: usize = 1 << 30;
/// The number of new entries after which the data are written, so that an interrupted run loses
/// few, and the most times that this is done in a run.
const SAVED: usize = 200;
const MOST_SAVES: usize = 20;

/// The words about a scene whose bytes differ from those of the last run.
const CHANGED: &str = "its bytes have changed since the last run (SHA-256)";

/// The content of `catalog.json`. `E` is [`Entry`] or a reference to one.
#[derive(Debug, Serialize, Deserialize)]
struct Data<E> {
    /// The version of the program that made the catalog.
    ivcam: String,
    /// The options that entries depend on.
    options: Vec<String>,
    #[serde(flatten)]
    heading: CatalogHeading,
    scenes: Vec<E>,
}

/// The numbers of scenes of a catalog.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub(crate) struct CatalogSum {
    /// All scenes.
    pub scenes: usize,
    /// Scenes that were not read, because their entries are up to date.
    pub up_to_date: usize,
    /// Scenes whose bytes are others than in the last run.
    pub changed: usize,
    pub damaged: usize,
    pub unreadable: usize,
    pub empty: usize,
    /// Scenes with something to draw of which no picture could be made.
    pub without_picture: usize,
    pub with_missing: usize,
    pub with_unknown: usize,
    /// Files that scenes use, outside the folder of scenes, and that were not copied for a page
    /// that opens scenes.
    pub not_copied: usize,
}

/// The scenes of a catalog, before they are read.
pub(crate) struct Catalog {
    options: CatalogOptions,
    jobs: Vec<Job>,
    /// The canonical path of the folder of the catalog.
    out: PathBuf,
    heading: CatalogHeading,
    /// The entries of the last run, by file. Empty if they were made with other options.
    old: HashMap<String, Entry>,
    /// The SHA-256 of each file as the last run saw it, whatever its options.
    hashes: HashMap<String, String>,
    /// Whether the last run had the same heading, so that the pages of scenes show it.
    same_heading: bool,
    /// Warnings about files that are not read.
    pub sink: Sink,
}

impl Catalog {
    /// Finds the scenes, creates the folder of the catalog, and reads the last catalog in it.
    ///
    /// # Errors
    /// Returns an error if there are no scenes, if the folder cannot be created, if it has an
    /// `index.html` that is not a catalog's, or if the folder of `--page` has no built page.
    pub(crate) fn open(mut options: CatalogOptions) -> Result<Self> {
        let found = Jobs::find(&options.folder, &options.out, "png", Naming::Full)?;
        let mut sink = found.sink;
        let mut jobs = found.list;
        let (page, data) = (options.out.join(place::PAGE), options.out.join(place::DATA));
        if page.exists() && !data.exists() && !options.force {
            let text = format!("`{}` exists and is not a catalog", page.display());
            return Err(Diagnostic::error(text)
                .with_help("choose another output folder, or replace it with `--force`"));
        }
        if let Some(page) = &options.page {
            live::check_page(page, &options.out)?;
        }
        let io = |path: &Path, e: std::io::Error| Diagnostic::io(path.display(), &e);
        std::fs::create_dir_all(&options.out).map_err(|e| io(&options.out, e))?;
        let out = real_path(&options.out).map_err(|e| io(&options.out, e))?;
        let folder = real_path(&options.folder);
        let folder = folder.map_err(|e| io(&options.folder, e))?;
        for job in &mut jobs {
            job.output = out.join(place::picture(&job.name));
        }
        options.folder = folder;
        let heading = CatalogHeading::new(&options, link(&out, &options.folder));
        let last = last_data(&data, &mut sink);
        let seen = last.iter().flat_map(|last| &last.scenes);
        let hashes = seen.map(|entry| (entry.file.clone(), entry.sha256.clone()));
        let hashes = hashes.collect();
        let is_same = |last: &Data<Entry>| {
            !options.force
                && last.options == options.words
                && last.ivcam == env!("CARGO_PKG_VERSION")
        };
        let old = last.filter(is_same);
        let same_heading = old.as_ref().is_some_and(|old| old.heading == heading);
        let entries = old.map_or_else(Vec::new, |old| old.scenes).into_iter();
        Ok(Self {
            options,
            jobs,
            out,
            heading,
            old: entries.map(|entry| (entry.file.clone(), entry)).collect(),
            hashes,
            same_heading,
            sink,
        })
    }

    /// Returns the number of scenes.
    pub(crate) fn len(&self) -> usize {
        self.jobs.len()
    }

    /// Reads the scenes whose entries are out of date, and writes the catalog. `done` receives the
    /// name of each scene that was read, and a line if it could not be read or has changed.
    ///
    /// # Errors
    /// Returns an error if the catalog cannot be written.
    pub(crate) fn make(&self, done: &mut dyn FnMut(&str, Option<String>)) -> Result<CatalogSum> {
        let current = |job: &Job| self.is_current(job).then(|| self.old[&job.name].clone());
        let mut entries: Vec<Option<Entry>> = self.jobs.iter().map(current).collect();
        let up_to_date = entries.iter().flatten().count();
        self.survey_all(&mut entries, done)?;
        let mut entries: Vec<Entry> = entries.into_iter().flatten().collect();
        self.find_converted(&mut entries);
        relate(&mut entries);
        self.write_data(&entries.iter().collect::<Vec<_>>())?;
        self.write_pages(&entries)?;
        let mut sum = sum(&entries, up_to_date);
        sum.changed = entries.iter().filter(|e| self.has_changed(e)).count();
        if let Some(page) = &self.options.page {
            live::copy_page(page, &self.out)?;
            sum.not_copied = live::copy_files(&self.options.folder, &self.out, &entries)?;
        }
        Ok(sum)
    }

    /// Reads the scenes without an entry. The data are written from time to time.
    fn survey_all(
        &self,
        entries: &mut [Option<Entry>],
        done: &mut dyn FnMut(&str, Option<String>),
    ) -> Result<()> {
        let waiting: Vec<usize> = (0..entries.len())
            .filter(|&i| entries[i].is_none())
            .collect();
        let work = |&i: &usize| {
            let survey = || survey(&self.options, &self.jobs[i], &self.out);
            self.options.allowance.during(survey)
        };
        let between = SAVED.max(waiting.len() / MOST_SAVES);
        let (mut failure, mut new) = (None, 0);
        let mut add = |&i: &usize, result: Result<Entry>| {
            let job = &self.jobs[i];
            let entry = result.unwrap_or_else(|error| failed(job, &error));
            let why = entry.error.as_ref().or(entry.no_picture.as_ref());
            let changed = self.has_changed(&entry).then_some(CHANGED);
            let said: Vec<&str> = changed.into_iter().chain(why.map(String::as_str)).collect();
            let line = (!said.is_empty()).then(|| format!("{}: {}", job.name, said.join("; ")));
            done(&job.name, line);
            entries[i] = Some(entry);
            new += 1;
            if new % between == 0 && failure.is_none() {
                let made: Vec<&Entry> = entries.iter().flatten().collect();
                failure = self.write_data(&made).err();
            }
        };
        for_each(&waiting, self.options.threads, &work, &mut add)?;
        failure.map_or(Ok(()), Err)
    }

    /// Returns whether the bytes of a scene are others than the last run saw.
    fn has_changed(&self, entry: &Entry) -> bool {
        let before = self.hashes.get(&entry.file);
        before.is_some_and(|hash| {
            !hash.is_empty() && !entry.sha256.is_empty() && *hash != entry.sha256
        })
    }

    /// Returns whether a scene and the files that it uses are as the last run saw them, and what
    /// was made of them is there. A scene with missing files never is current, because they may
    /// have been found, nor is one whose time ended, because it may have more now.
    fn is_current(&self, job: &Job) -> bool {
        let Some(old) = self.old.get(&job.name) else {
            return false;
        };
        let path = |file: &String| self.options.folder.join(path_of(file));
        let uses: Vec<PathBuf> = old.uses.iter().map(path).collect();
        let uses: Vec<&Path> = uses.iter().map(PathBuf::as_path).collect();
        let is_same = |file: &String, before| size_and_time(&path(file)) == before;
        let found = old.needs.iter().filter(|need| need.state == "found");
        let made = [old.large.clone(), Some(place::detail(&job.name))];
        !old.out_of_time
            && old.missing.is_empty()
            && old.outside.is_empty()
            && is_same(&job.name, Some((old.bytes, old.modified)))
            && found
                .into_iter()
                .all(|need| is_same(&need.file, need.size_and_time))
            && made
                .iter()
                .flatten()
                .all(|file| self.out.join(file).exists())
            && match old.picture {
                Some(_) => is_newer(&job.output, &uses),
                None => is_newer(&self.out.join(place::DATA), &uses),
            }
    }

    /// Finds the files that were converted from each scene.
    fn find_converted(&self, entries: &mut [Entry]) {
        let mut stems: HashMap<&str, usize> = HashMap::new();
        for job in &self.jobs {
            *stems.entry(without_ending(&job.name)).or_default() += 1;
        }
        let folders: Vec<PathBuf> = std::iter::once(&self.out)
            .chain(&self.options.converted)
            .cloned()
            .collect();
        for entry in entries {
            let stem = Some(without_ending(&entry.file)).filter(|stem| stems[stem] == 1);
            let scene = self.options.folder.join(path_of(&entry.file));
            entry.converted = converted(&self.out, &folders, &entry.file, stem, &scene);
        }
    }

    /// Writes `catalog.json`.
    fn write_data(&self, entries: &[&Entry]) -> Result<()> {
        let data = Data {
            ivcam: env!("CARGO_PKG_VERSION").to_owned(),
            options: self.options.words.clone(),
            heading: self.heading.clone(),
            scenes: entries.to_vec(),
        };
        write_whole(&self.out.join(place::DATA), |file| {
            serde_json::to_writer_pretty(&mut *file, &data)?;
            writeln!(file)
        })
    }

    /// Writes the pages and the other forms of the data. Pages of scenes that show the same as
    /// those of the last run are kept.
    fn write_pages(&self, entries: &[Entry]) -> Result<()> {
        let pages = ScenePages::new(&self.out, &self.heading);
        for entry in entries {
            let is_same = self.same_heading && self.old.get(&entry.file) == Some(entry);
            if !is_same || !self.out.join(place::scene_page(&entry.file)).exists() {
                pages.write(entry)?;
            }
        }
        write_whole(&self.out.join(place::STYLE_FILE), |file| {
            write!(file, "{STYLE}{}", include_str!("catalog.css"))
        })?;
        write_table(&self.out, entries)?;
        write_linked(&self.out, &self.heading, entries)?;
        write_page(&self.out, &self.heading, entries)
    }
}

/// Reads the last catalog, if there is one.
fn last_data(data: &Path, sink: &mut Sink) -> Option<Data<Entry>> {
    let bytes = read_file(data, MOST_DATA).ok()?;
    match serde_json::from_slice::<Data<Entry>>(&bytes) {
        Ok(last) => Some(last),
        Err(error) => {
            let text = format!("`{}` cannot be read: {error}", data.display());
            let help = "all scenes are read again";
            sink.add(*Diagnostic::warning(text).with_help(help));
            None
        }
    }
}

/// Returns the entry of a scene on which the program failed.
fn failed(job: &Job, error: &Diagnostic) -> Entry {
    let (bytes, modified) = size_and_time(&job.input).unwrap_or_default();
    Entry {
        file: job.name.clone(),
        bytes,
        modified,
        state: "unreadable".to_owned(),
        error: Some(error.message.clone()),
        ..Entry::default()
    }
}

/// Counts the entries of each kind.
fn sum(scenes: &[Entry], up_to_date: usize) -> CatalogSum {
    let count = |is: &dyn Fn(&Entry) -> bool| scenes.iter().filter(|entry| is(entry)).count();
    CatalogSum {
        scenes: scenes.len(),
        up_to_date,
        changed: 0,
        damaged: count(&|e| e.state == "damaged"),
        unreadable: count(&|e| e.error.is_some()),
        empty: count(&Entry::is_empty),
        without_picture: count(&|e| e.no_picture.is_some()),
        with_missing: count(&|e| !e.missing.is_empty()),
        with_unknown: count(&|e| e.unknown() > 0),
        not_copied: 0,
    }
}
