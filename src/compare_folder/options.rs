//! The options of a comparison of folders.

use std::path::PathBuf;

use serde_json::Value as Json;

use crate::compare::{Matching, Metric, MetricLimit, Registration, Selection};
use crate::photo::Plan;

/// The options of a comparison of folders.
pub(crate) struct FolderOptions {
    /// The folder of new pictures, or of scenes.
    pub new: PathBuf,
    /// The folder of old pictures.
    pub old: PathBuf,
    /// The folder of the report.
    pub out: PathBuf,
    /// How the old pictures are mapped to the new ones' pixels. `None` aligns pairs whose sizes
    /// differ, and compares others as they are.
    pub registration: Option<Registration>,
    /// The tone curves that are fitted to the old pictures.
    pub matching: Matching,
    /// The pixels that count, in every pair.
    pub selection: Selection,
    /// The viewing resolution for FLIP, in pixels per degree.
    pub pixels_per_degree: f64,
    /// The limits that decide the verdict of each pair.
    pub limits: Vec<MetricLimit>,
    /// The measure that orders the page.
    pub sort: &'static Metric,
    /// The file that states pairs.
    pub pairs: Option<PathBuf>,
    /// Whether pictures are paired by name only.
    pub by_name: bool,
    /// Whether pairs and scenes that are up to date are made again too.
    pub force: bool,
    /// The number of threads.
    pub threads: usize,
    /// The words of the options that the measures depend on.
    pub words: Vec<String>,
    /// How scenes are photographed.
    pub photographs: Photographs,
}

/// How the scenes of the new folder are photographed.
pub(crate) struct Photographs {
    /// The plan of every picture; its scene is replaced.
    pub plan: Plan,
    /// The options that the pictures depend on.
    pub given: Json,
    /// The files that the options name.
    pub uses: Vec<PathBuf>,
}
