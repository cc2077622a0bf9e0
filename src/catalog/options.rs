//! The options of a catalog.

use std::path::PathBuf;
use std::sync::Arc;

use ivcam_base::work::Allowance;
use ivcam_inventor::iv::Limits;
use ivcam_optics::film::Resolution;
use ivcam_render::geometry::text::Fonts;

use crate::photo::Denoiser;

/// The options of a catalog.
#[derive(Clone, Debug)]
pub(crate) struct CatalogOptions {
    /// The folder of scenes.
    pub folder: PathBuf,
    /// The folder of the catalog.
    pub out: PathBuf,
    /// Folders with files converted from the scenes, in addition to `out`.
    pub converted: Vec<PathBuf>,
    /// Folders that are searched for files of scenes.
    pub search: Vec<PathBuf>,
    /// The folder below which files of scenes must be.
    pub contain: Option<PathBuf>,
    /// Typefaces that are preferred to the shipped ones.
    pub fonts: Arc<Fonts>,
    /// Limits on the size of a scene.
    pub limits: Limits,
    /// What each scene may take.
    pub allowance: Allowance,
    /// The number of threads.
    pub threads: usize,
    /// Whether all entries are made again.
    pub force: bool,
    /// The size of a thumbnail in pixels.
    pub thumbnail: Resolution,
    /// Whether the scenes are photographed in a studio.
    pub studio: bool,
    /// The program that denoises the large pictures.
    pub denoiser: Option<Denoiser>,
    /// The samples of each pixel of a large picture.
    pub samples: u32,
    /// The heading of the pages. `None` is the name of the folder.
    pub title: Option<String>,
    /// A text about the archive.
    pub about: Option<String>,
    /// The folder of a built page, which is copied beside the catalog to open scenes.
    pub page: Option<PathBuf>,
    /// The words of the options that entries depend on.
    pub words: Vec<String>,
}
