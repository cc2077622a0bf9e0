//! Makes a report: the pairs that are out of date, the page and its data.

use std::collections::{BTreeMap, HashMap};
use std::path::{Path, PathBuf};

use ivcam_base::diag::{Diagnostic, Result, Sink};
use ivcam_base::files::{read_file, write_whole};
use ivcam_base::platform::real_path;

use super::entry::{PairEntry, PairVerdict, ReportData, ReportSum, Stamp, UnpairedFile};
use super::files::{PictureFile, pictures, scenes};
use super::options::FolderOptions;
use super::page::page;
use super::pair::{entry, set_error};
use super::pairing::{FilePair, PairedBy, Pairing};
use super::pictures::{small, write_bytes};
use super::progress::ReportProgress;
use super::search::{Agreement, SearchPicture, SearchRecord, add_found, agreements};
use super::stated::stated_pairs;
use super::table::table;
use crate::archive::{for_each, is_below};
use crate::catalog::link;
use crate::compare::Plate;

/// The names of the files of a report, and of the folder with pictures that have no partner.
const PAGE: &str = "index.html";
const DATA: &str = "report.json";
const TABLE: &str = "report.csv";
const UNPAIRED: &str = "unpaired";
/// The largest size of `report.json`, in bytes.
const MOST_DATA: usize = 1 << 30;
/// The number of new pairs after which the data are written, so that an interrupted run loses few.
const SAVED: usize = 10;

/// The result of a run.
pub(crate) struct FolderReport {
    pub sum: ReportSum,
    /// A line for each pair that exceeds a limit, and for each file or pair with an error.
    pub lines: Vec<String>,
    /// The content of `report.json`.
    pub json: String,
    /// The file of the page.
    pub page: PathBuf,
}

/// The pictures of two folders, before they are read.
pub(crate) struct FolderComparison {
    options: FolderOptions,
    new: Vec<PictureFile>,
    old: Vec<PictureFile>,
    pairing: Pairing,
    /// Whether there are scenes among the new files. Pictures beside them may be textures.
    has_scenes: bool,
    last: LastReport,
    /// Warnings about names and about files that are not read.
    pub sink: Sink,
}

/// What the last run left.
#[derive(Default)]
struct LastReport {
    /// The entries by the names of their files. Empty if they were made with other options.
    pairs: HashMap<[String; 2], PairEntry>,
    search: SearchRecord,
}

/// A picture without a partner that was read.
struct FreePicture {
    small: Vec<u8>,
    search: SearchPicture,
}

/// What is known about the pictures without a partner, by side and number.
type FreePictures = [BTreeMap<usize, Result<FreePicture>>; 2];

impl FolderComparison {
    /// Finds the pictures and pairs their names, creates the folder of the report, and reads the
    /// last report in it.
    ///
    /// # Errors
    /// Returns an error if a folder has no pictures, if the file of pairs is invalid, if the folder
    /// of the report cannot be created, or if it has an `index.html` that is not a report's.
    pub(crate) fn open(mut options: FolderOptions) -> Result<Self> {
        prepare(&mut options)?;
        let mut sink = Sink::new();
        let mut new = pictures(&options.new, &options.out, &mut sink)?;
        let mut old = pictures(&options.old, &options.out, &mut sink)?;
        let scenes = scenes(&options.new, &options.out, &new, &mut sink)?;
        let has_scenes = scenes.is_some();
        new.extend(scenes.unwrap_or_default());
        for (files, folder, what) in [
            (&new, &options.new, "pictures and no scenes"),
            (&old, &options.old, "pictures"),
        ] {
            if files.is_empty() {
                let text = format!("there are no {what} below `{}`", folder.display());
                return Err(Diagnostic::not_found(text));
            }
        }
        let stated = match &options.pairs {
            Some(file) => {
                let folders = [&*options.new, &*options.old];
                stated_pairs(file, folders, [&mut new, &mut old])?
            }
            None => Vec::new(),
        };
        let mut pairing = Pairing::of(new.len(), old.len());
        stated.iter().for_each(|pair| pairing.add(*pair));
        pairing.add_by_name(&new, &old, &mut sink);
        let last = match options.force {
            true => LastReport::default(),
            false => last_report(&options, &mut sink),
        };
        Ok(Self {
            options,
            new,
            old,
            pairing,
            has_scenes,
            last,
            sink,
        })
    }

    /// Returns the numbers of new and of old pictures that have no partner by name, and that are
    /// to be compared by what they show.
    pub(crate) fn to_search(&self) -> [usize; 2] {
        match self.options.by_name {
            true => [0; 2],
            false => self.listed_free().map(|free| free.len()),
        }
    }

    /// Photographs scenes, pairs what is left, compares the pairs that are out of date, and writes
    /// the report.
    ///
    /// # Errors
    /// Returns an error if the report cannot be written.
    pub(crate) fn make(mut self, progress: &mut dyn ReportProgress) -> Result<FolderReport> {
        let not_made = self.photograph(progress)?;
        let free = self.read_free(&not_made, progress)?;
        let (search, found) = self.search(&free, progress)?;
        let rest = add_found(&mut self.pairing, &found);
        let unpaired = self.unpaired(&free, &not_made, &rest)?;
        drop(free);
        let [unpaired_new, unpaired_old] = unpaired;
        let mut data = ReportData {
            ivcam: env!("CARGO_PKG_VERSION").to_owned(),
            options: self.options.words.clone(),
            limits: self.limit_words(),
            is_complete: false,
            folders: [&self.options.new, &self.options.old]
                .map(|folder| link(&self.options.out, folder)),
            tried: search.tried(),
            search,
            beside_scenes: self.beside_scenes(),
            pairs: Vec::new(),
            unpaired_new,
            unpaired_old,
        };
        let kept = self.compare_pairs(&mut data, &not_made, progress)?;
        data.is_complete = true;
        self.write(data, kept)
    }

    /// Photographs the scenes whose pictures are needed. Returns the errors by name.
    fn photograph(
        &self,
        progress: &mut dyn ReportProgress,
    ) -> Result<HashMap<String, Box<Diagnostic>>> {
        let [free_new, free_old] = self.pairing.free();
        let is_needed = |i: &usize| {
            let is_searched = !self.options.by_name && !free_old.is_empty();
            is_searched || free_new.binary_search(i).is_err()
        };
        let scenes: Vec<&PictureFile> = (0..self.new.len())
            .filter(is_needed)
            .map(|i| &self.new[i])
            .filter(|file| file.scene.is_some())
            .collect();
        match scenes.is_empty() {
            true => Ok(HashMap::new()),
            false => super::scenes::photograph(&self.options, &scenes, progress),
        }
    }

    /// Returns the pictures without a partner that the report lists: those beside scenes may be
    /// textures, and are only counted.
    fn listed_free(&self) -> [Vec<usize>; 2] {
        let [mut new, old] = self.pairing.free();
        new.retain(|i| !self.has_scenes || self.new[*i].scene.is_some());
        [new, old]
    }

    /// Returns the number of pictures beside scenes that have no partner.
    fn beside_scenes(&self) -> usize {
        self.pairing.free()[0].len() - self.listed_free()[0].len()
    }

    /// Reads the pictures without a partner. Of each, a small copy is kept.
    fn read_free(
        &self,
        not_made: &HashMap<String, Box<Diagnostic>>,
        progress: &mut dyn ReportProgress,
    ) -> Result<FreePictures> {
        let lists = [&self.new, &self.old];
        let mut files: Vec<(usize, usize)> = Vec::new();
        for (side, free) in self.listed_free().into_iter().enumerate() {
            let is_there = |i: &usize| {
                let file = &lists[side][*i];
                !not_made.contains_key(&file.name) && (file.scene.is_none() || file.path.is_file())
            };
            files.extend(free.into_iter().filter(is_there).map(|i| (side, i)));
        }
        progress.begin(files.len());
        let work = |&(side, i): &(usize, usize)| {
            let plate = Plate::open(&lists[side][i].path)?;
            Ok(FreePicture {
                small: small(&plate)?,
                search: SearchPicture::of(i, &lists[side][i], &plate),
            })
        };
        let mut read: FreePictures = Default::default();
        let mut done = |&(side, i): &(usize, usize), result: Result<FreePicture>| {
            progress.done(&lists[side][i].name);
            read[side].insert(i, result);
        };
        for_each(&files, self.options.threads, &work, &mut done)?;
        Ok(read)
    }

    /// Finds the pictures without a partner that show the same. Returns what was tried too.
    fn search(
        &self,
        free: &FreePictures,
        progress: &mut dyn ReportProgress,
    ) -> Result<(SearchRecord, Vec<Agreement>)> {
        if self.options.by_name {
            return Ok(Default::default());
        }
        let [new, old] = [0, 1].map(|side| -> Vec<&SearchPicture> {
            let read = free[side].values().flatten();
            read.map(|picture| &picture.search).collect()
        });
        let (last, threads) = (&self.last.search, self.options.threads);
        agreements([&new, &old], last, threads, progress)
    }

    /// Writes small copies of the pictures that have no partner, and returns their entries.
    fn unpaired(
        &self,
        free: &FreePictures,
        not_made: &HashMap<String, Box<Diagnostic>>,
        rest: &[Agreement],
    ) -> Result<[Vec<UnpairedFile>; 2]> {
        let lists = [&self.new, &self.old];
        let mut entries = [Vec::new(), Vec::new()];
        for (side, numbers) in self.listed_free().into_iter().enumerate() {
            for i in numbers {
                let file = &lists[side][i];
                let mut entry = UnpairedFile {
                    file: file.name.clone(),
                    note: self.resembles(side, i, rest),
                    ..UnpairedFile::default()
                };
                match free[side].get(&i) {
                    Some(Ok(picture)) => {
                        let name = format!("{UNPAIRED}/{}/{}.jpg", ["new", "old"][side], file.name);
                        write_bytes(&self.options.out.join(&name), &picture.small)?;
                        entry.small = Some(name);
                    }
                    Some(Err(error)) => entry.error = Some(error.message.clone()),
                    None => match not_made.get(&file.name) {
                        Some(error) => entry.error = Some(error.message.clone()),
                        None => {
                            entry.note = Some("not photographed: no old picture needs it".into())
                        }
                    },
                }
                entries[side].push(entry);
            }
        }
        Ok(entries)
    }

    /// Returns a note about the picture of the other folder that agrees best with one, but has
    /// another partner.
    fn resembles(&self, side: usize, i: usize, rest: &[Agreement]) -> Option<String> {
        let is_its = |a: &&Agreement| [a.new, a.old][side] == i;
        let best = rest.iter().find(is_its)?;
        let (name, partner) = match side {
            0 => {
                let pair = self.pairing.pairs.iter().find(|p| p.old == best.old)?;
                (&self.old[best.old].name, &self.new[pair.new].name)
            }
            _ => {
                let pair = self.pairing.pairs.iter().find(|p| p.new == best.new)?;
                (&self.new[best.new].name, &self.old[pair.old].name)
            }
        };
        Some(format!(
            "agrees with `{name}`, which is paired with `{partner}`"
        ))
    }

    fn limit_words(&self) -> Vec<String> {
        let limits = self.options.limits.iter();
        limits
            .map(|limit| format!("{}={}", limit.metric.name, limit.value))
            .collect()
    }

    /// Compares the pairs, and adds them to the data in the order of their names. Returns the
    /// number of pairs that were kept from the last run.
    fn compare_pairs(
        &self,
        data: &mut ReportData,
        not_made: &HashMap<String, Box<Diagnostic>>,
        progress: &mut dyn ReportProgress,
    ) -> Result<usize> {
        let mut pairs = self.pairing.pairs.clone();
        pairs.sort_by_key(|pair| (&self.new[pair.new].name, pair.new));
        let mut entries: BTreeMap<usize, PairEntry> = BTreeMap::new();
        for (i, pair) in pairs.iter().enumerate() {
            // The picture of an earlier run is out of date if its scene cannot be photographed now.
            if !not_made.contains_key(&self.new[pair.new].name) {
                entries.extend(self.kept(pair).map(|entry| (i, entry)));
            }
        }
        let limits = &self.options.limits;
        entries.values_mut().for_each(|entry| entry.judge(limits));
        let kept = entries.len();
        let waiting: Vec<usize> = (0..pairs.len())
            .filter(|i| !entries.contains_key(i))
            .collect();
        progress.begin(waiting.len());
        let work = |i: &usize| {
            let (new, old) = (&self.new[pairs[*i].new], &self.old[pairs[*i].old]);
            match not_made.get(&new.name) {
                Some(error) => Err(error.clone()),
                None => Ok(entry(&self.options, &pairs[*i], new, old)),
            }
        };
        let mut failure = None;
        let mut done = |i: &usize, result: Result<PairEntry>| {
            let (new, old) = (&self.new[pairs[*i].new], &self.old[pairs[*i].old]);
            progress.done(&new.name);
            let mut entry = result.unwrap_or_else(|error| {
                let mut entry = PairEntry::of(&pairs[*i], new, old);
                set_error(&mut entry, &error);
                entry
            });
            entry.judge(limits);
            entries.insert(*i, entry);
            if entries.len().is_multiple_of(SAVED) {
                data.pairs = entries.values().cloned().collect();
                failure = failure.take().or(self.write_data(data).err());
            }
        };
        for_each(&waiting, self.options.threads, &work, &mut done)?;
        data.pairs = entries.into_values().collect();
        failure.map_or(Ok(kept), Err)
    }

    /// Returns the entry of a pair from the last run, if nothing has changed since.
    fn kept(&self, pair: &FilePair) -> Option<PairEntry> {
        let (new, old) = (&self.new[pair.new], &self.old[pair.old]);
        let last = self.last.pairs.get(&[new.name.clone(), old.name.clone()])?;
        let pictures = last.pictures.as_ref()?;
        let is_by_picture = |by: PairedBy| by == PairedBy::Picture;
        let is_current = last.comparison.is_some()
            && is_by_picture(last.paired_by) == is_by_picture(pair.by)
            && last.stamps == [Stamp::of(&new.path), Stamp::of(&old.path)]
            && self.options.out.join(&pictures.difference).is_file();
        is_current.then(|| PairEntry {
            paired_by: pair.by,
            pairing_chance: pair.chance,
            ..last.clone()
        })
    }

    /// Writes the three files of the report.
    fn write(&self, data: ReportData, kept: usize) -> Result<FolderReport> {
        let out = &self.options.out;
        let json = self.write_data(&data)?;
        write_text(&out.join(TABLE), &table(&data))?;
        let text = page(&data, &self.options);
        write_text(&out.join(PAGE), &text)?;
        Ok(FolderReport {
            sum: data.sum(kept),
            lines: lines(&data),
            json,
            page: out.join(PAGE),
        })
    }

    /// Writes `report.json` and returns its content.
    fn write_data(&self, data: &ReportData) -> Result<String> {
        let mut json = serde_json::to_string_pretty(data)
            .map_err(|e| Diagnostic::error(format!("the report has no JSON: {e}")))?;
        json.push('\n');
        write_text(&self.options.out.join(DATA), &json)?;
        Ok(json)
    }
}

fn write_text(path: &Path, text: &str) -> Result<()> {
    write_whole(path, |file| file.write_all(text.as_bytes()))
}

/// Checks and creates the folder of the report, and makes the paths of the folders canonical.
fn prepare(options: &mut FolderOptions) -> Result<()> {
    let (out, page, data) = (&options.out, PAGE, DATA);
    for folder in [&options.new, &options.old] {
        if is_below(out, folder) && is_below(folder, out) {
            let text = format!("`{}` is a folder that is read", out.display());
            return Err(Diagnostic::error(text).with_help("name another folder with `-o`"));
        }
    }
    if out.join(page).exists() && !out.join(data).exists() && !options.force {
        let text = format!("`{}` exists and is not a report", out.join(page).display());
        return Err(Diagnostic::error(text)
            .with_help("choose another output folder, or replace it with `--force`"));
    }
    std::fs::create_dir_all(out).map_err(|e| Diagnostic::io(out.display(), &e))?;
    for folder in [&mut options.new, &mut options.old, &mut options.out] {
        *folder = real_path(folder).map_err(|e| Diagnostic::io(folder.display(), &e))?;
    }
    Ok(())
}

/// Reads what the last run left, if it was one of this version. Its entries are kept only if they
/// were made with the same options.
fn last_report(options: &FolderOptions, sink: &mut Sink) -> LastReport {
    let path = options.out.join(DATA);
    let Ok(bytes) = read_file(&path, MOST_DATA) else {
        return LastReport::default();
    };
    let last = match serde_json::from_slice::<ReportData>(&bytes) {
        Ok(last) => last,
        Err(error) => {
            let text = format!("`{}` cannot be read: {error}", path.display());
            sink.add(*Diagnostic::warning(text).with_help("all pairs are compared again"));
            return LastReport::default();
        }
    };
    if last.ivcam != env!("CARGO_PKG_VERSION") {
        return LastReport::default();
    }
    let is_same = last.options == options.words;
    let pairs = last.pairs.into_iter().filter(|_| is_same);
    LastReport {
        pairs: pairs
            .map(|pair| ([pair.new.clone(), pair.old.clone()], pair))
            .collect(),
        search: last.search,
    }
}

/// Returns a line for each pair that exceeds a limit, and for each pair or file with an error.
fn lines(data: &ReportData) -> Vec<String> {
    let pair_lines = data.pairs.iter().filter_map(|pair| match pair.verdict {
        PairVerdict::Failed => {
            let help = pair.help.iter().map(|help| format!("; {help}"));
            let error = pair.error.as_deref().unwrap_or_default();
            Some(format!("{}: {error}{}", pair.new, help.collect::<String>()))
        }
        PairVerdict::Exceeded => {
            let exceeded = pair.limits_exceeded.iter();
            let parts =
                exceeded.map(|e| format!("{} is {}, the limit is {}", e.metric, e.value, e.limit));
            Some(format!(
                "{}: {}",
                pair.new,
                parts.collect::<Vec<_>>().join("; ")
            ))
        }
        PairVerdict::Within | PairVerdict::Compared => None,
    });
    let unpaired = data.unpaired_new.iter().chain(&data.unpaired_old);
    let errors = unpaired.filter_map(|file| {
        let error = file.error.as_ref()?;
        Some(format!("{}: {error}", file.file))
    });
    pair_lines.chain(errors).collect()
}
