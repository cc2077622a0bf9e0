//! What a report knows about each pair, and about the pictures without a partner.

use std::path::Path;
use std::time::UNIX_EPOCH;

use indexmap::IndexMap;
use serde::{Deserialize, Serialize};
use serde_json::Value as Json;

use super::files::PictureFile;
use super::pairing::{FilePair, PairedBy};
use super::search::SearchRecord;
use crate::compare::{ExceededLimit, METRICS, Metric, MetricLimit, exceeded};

/// The result of a pair.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
pub(crate) enum PairVerdict {
    /// The pair could not be compared.
    #[default]
    Failed,
    /// A limit is exceeded.
    Exceeded,
    /// All limits hold.
    Within,
    /// The pair was compared, and there are no limits.
    Compared,
}

impl PairVerdict {
    /// Returns the name in the report.
    pub(super) fn name(self) -> &'static str {
        match self {
            Self::Failed => "failed",
            Self::Exceeded => "exceeded",
            Self::Within => "within",
            Self::Compared => "compared",
        }
    }
}

/// The size and the time of a file, by which a change of it is noticed.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
pub(super) struct Stamp {
    pub bytes: u64,
    /// The time of the last modification in nanoseconds since the beginning of 1970, UTC.
    pub modified: u64,
}

impl Stamp {
    /// Returns the stamp of a file; of none, that of a missing one.
    pub(super) fn of(path: &Path) -> Self {
        let Ok(about) = path.metadata() else {
            return Self::default();
        };
        let time = about.modified().ok();
        let time = time.and_then(|time| time.duration_since(UNIX_EPOCH).ok());
        Self {
            bytes: about.len(),
            modified: time.map_or(0, |time| time.as_nanos() as u64),
        }
    }
}

/// The pictures of a pair below the folder of the report, in two sizes.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub(super) struct PairPictures {
    pub new: String,
    /// The old picture on the pixels of the new one, with matched tones.
    pub old: String,
    pub difference: String,
    /// Thumbnails of the new picture, the old one and their difference.
    pub small: [String; 3],
    /// The difference of levels, from 0 to 1, that has the last color of the scale.
    pub scale: f64,
}

/// A pair of the report. Its keys in JSON are described in `docs/guide/compare.md`.
#[derive(Clone, Debug, Serialize, Deserialize)]
pub(super) struct PairEntry {
    /// The paths below the two folders, with `/` between their parts.
    pub new: String,
    pub old: String,
    pub paired_by: PairedBy,
    /// For a pair by picture, a bound on the probability that any of the tried pairs agrees as
    /// well by chance.
    pub pairing_chance: Option<f64>,
    /// `none`, `resize` or `align`: how the old picture was mapped to the new one's pixels.
    pub registration: String,
    pub verdict: PairVerdict,
    #[serde(skip_deserializing)]
    pub limits_exceeded: Vec<ExceededLimit>,
    /// The reason why the pair could not be compared, and what to do.
    pub error: Option<String>,
    pub help: Option<String>,
    /// The measures by the names of `--limit`. `None` is an infinite PSNR, or no edges.
    pub measures: IndexMap<String, Option<f64>>,
    /// What `ivcam compare NEW OLD --json` writes about the pair.
    pub comparison: Option<Json>,
    pub pictures: Option<PairPictures>,
    /// The state of the two files.
    pub stamps: [Stamp; 2],
}

impl PairEntry {
    /// Returns the entry of a pair that is not compared yet.
    pub(super) fn of(pair: &FilePair, new: &PictureFile, old: &PictureFile) -> Self {
        Self {
            new: new.name.clone(),
            old: old.name.clone(),
            paired_by: pair.by,
            pairing_chance: pair.chance,
            registration: "none".to_owned(),
            verdict: PairVerdict::Failed,
            limits_exceeded: Vec::new(),
            error: None,
            help: None,
            measures: IndexMap::new(),
            comparison: None,
            pictures: None,
            stamps: [Stamp::of(&new.path), Stamp::of(&old.path)],
        }
    }

    /// Returns the value of a measure, NaN if it does not exist. Equal pictures have an infinite
    /// PSNR, which JSON does not have.
    pub(super) fn value(&self, metric: &Metric) -> f64 {
        let of = |name: &str| self.measures.get(name).copied().flatten();
        let is_equal = |error: &str| of(error) == Some(0.0);
        of(metric.name).unwrap_or(match metric.name {
            "psnr" if is_equal("mse") => f64::INFINITY,
            "unmatched-psnr" if is_equal("unmatched-mse") => f64::INFINITY,
            _ => f64::NAN,
        })
    }

    /// Decides the verdict.
    pub(super) fn judge(&mut self, limits: &[MetricLimit]) {
        self.limits_exceeded.clear();
        if self.comparison.is_none() {
            self.verdict = PairVerdict::Failed;
            return;
        }
        self.limits_exceeded = exceeded(limits, |metric| self.value(metric));
        self.verdict = match (limits.is_empty(), self.limits_exceeded.is_empty()) {
            (true, _) => PairVerdict::Compared,
            (false, true) => PairVerdict::Within,
            (false, false) => PairVerdict::Exceeded,
        };
    }

    /// Returns the values of all measures by name.
    pub(super) fn values_of(measures: &crate::compare::Measures) -> IndexMap<String, Option<f64>> {
        let value = |metric: &Metric| Some((metric.get)(measures)).filter(|v| v.is_finite());
        let pairs = METRICS.iter().map(|m| (m.name.to_owned(), value(m)));
        pairs.collect()
    }
}

/// A picture without a partner.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub(super) struct UnpairedFile {
    /// The path below its folder.
    pub file: String,
    /// A small picture below the folder of the report.
    pub small: Option<String>,
    /// The reason why it was not read.
    pub error: Option<String>,
    /// What else is to be known, such as the pair that it resembles.
    pub note: Option<String>,
}

/// The content of `report.json`.
#[derive(Debug, Serialize, Deserialize)]
pub(super) struct ReportData {
    /// The version of the program.
    pub ivcam: String,
    /// The options that the measures depend on.
    pub options: Vec<String>,
    /// The limits, as they were given.
    pub limits: Vec<String>,
    /// Whether the run has ended. The data of an interrupted run lack pairs.
    pub is_complete: bool,
    /// The addresses of the two folders, relative to the page.
    pub folders: [String; 2],
    /// The number of pairs that were tried by picture.
    pub tried: usize,
    /// What the search has found, for the next run.
    pub search: SearchRecord,
    /// The number of pictures beside scenes that are paired by no name.
    pub beside_scenes: usize,
    /// In the order of the new pictures' names.
    pub pairs: Vec<PairEntry>,
    pub unpaired_new: Vec<UnpairedFile>,
    pub unpaired_old: Vec<UnpairedFile>,
}

/// The numbers of a report.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub(crate) struct ReportSum {
    pub pairs: usize,
    pub within: usize,
    pub exceeded: usize,
    pub compared: usize,
    pub failed: usize,
    /// Pairs whose measures an earlier run has found.
    pub up_to_date: usize,
    pub by_picture: usize,
    pub unpaired_new: usize,
    pub unpaired_old: usize,
    /// Files without a partner that could not be read or photographed.
    pub unreadable: usize,
    pub beside_scenes: usize,
}

impl ReportData {
    pub(super) fn sum(&self, up_to_date: usize) -> ReportSum {
        let count = |verdict| self.pairs.iter().filter(|p| p.verdict == verdict).count();
        let unpaired = || self.unpaired_new.iter().chain(&self.unpaired_old);
        let by_picture = |pair: &&PairEntry| pair.paired_by == PairedBy::Picture;
        ReportSum {
            pairs: self.pairs.len(),
            within: count(PairVerdict::Within),
            exceeded: count(PairVerdict::Exceeded),
            compared: count(PairVerdict::Compared),
            failed: count(PairVerdict::Failed),
            up_to_date,
            by_picture: self.pairs.iter().filter(by_picture).count(),
            unpaired_new: self.unpaired_new.len(),
            unpaired_old: self.unpaired_old.len(),
            unreadable: unpaired().filter(|file| file.error.is_some()).count(),
            beside_scenes: self.beside_scenes,
        }
    }
}
