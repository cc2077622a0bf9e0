//! What all pages of a catalog say at their top.

use serde::{Deserialize, Serialize};

use super::options::CatalogOptions;

/// What a catalog says of itself, a part of `catalog.json`.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub(super) struct CatalogHeading {
    /// The title: that of `--title`, or the name of the folder.
    #[serde(default)]
    pub title: String,
    /// The text of `--about`.
    #[serde(default)]
    pub about: Option<String>,
    /// Whether a page that opens the scenes is beside the catalog.
    #[serde(default)]
    pub live: bool,
    /// The folder of scenes as an address relative to the page.
    pub folder: String,
}

impl CatalogHeading {
    /// Returns the heading of a catalog. `folder` is the address of the folder of scenes.
    pub(super) fn new(options: &CatalogOptions, folder: String) -> Self {
        let name = options
            .folder
            .file_name()
            .unwrap_or_default()
            .to_string_lossy();
        let title = options.title.clone().unwrap_or_else(|| name.into_owned());
        Self {
            title: if title.is_empty() {
                "scenes".to_owned()
            } else {
                title
            },
            about: options.about.clone(),
            live: options.page.is_some(),
            folder,
        }
    }

    /// Returns the paragraphs of the text about the archive, which empty lines separate.
    pub(super) fn paragraphs(&self) -> Vec<String> {
        let text = self
            .about
            .as_deref()
            .unwrap_or_default()
            .replace("\r\n", "\n");
        let paragraphs = text.split("\n\n").map(|part| part.trim().to_owned());
        paragraphs.filter(|part| !part.is_empty()).collect()
    }
}
