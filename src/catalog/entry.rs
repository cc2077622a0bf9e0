//! What a catalog knows about one scene.

use indexmap::IndexMap;
use serde::{Deserialize, Serialize};

/// A scene of a catalog. Its keys in JSON are described in `docs/guide/archives.md`.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub(crate) struct Entry {
    /// The path below the folder of scenes, with `/` between its parts.
    pub file: String,
    /// The size of the file in bytes.
    pub bytes: u64,
    /// The time of the last modification in seconds since the beginning of 1970, UTC.
    pub modified: u64,
    /// `whole`, `damaged` or `unreadable`.
    pub state: String,
    /// The reason why nothing of the file was read.
    pub error: Option<String>,
    /// The format that the header states.
    pub format: Option<String>,
    /// The line of `notes` that seems to name the program or the person that made the file.
    pub producer: Option<String>,
    /// What the file says about itself: the comments at its beginning, and the texts of `Info` and
    /// `WorldInfo` nodes.
    pub notes: Vec<String>,
    /// The number of nodes.
    pub nodes: usize,
    /// The number of nodes of each class, by treatment.
    pub classes: IndexMap<String, IndexMap<String, usize>>,
    /// The number of triangles as Inventor triangulates.
    pub triangles: u64,
    /// The number of shapes of each class.
    pub shapes: IndexMap<String, u64>,
    /// The edges of the bounding box in meters. `None` if there is nothing to draw.
    pub size: Option<[f64; 3]>,
    /// The number of lights that are on.
    pub lights: usize,
    /// The number of cameras and viewpoints.
    pub cameras: usize,
    /// The names of files that are not there or not readable.
    pub missing: Vec<String>,
    /// The names of files that are there, but outside the folders that may be read.
    pub outside: Vec<String>,
    /// The number of problems, each as often as it occurs.
    pub problems: usize,
    /// The most severe problems.
    pub messages: Vec<Message>,
    /// The files that the scene uses: below the folder of scenes by their paths there, elsewhere by
    /// their whole paths.
    pub uses: Vec<String>,
    /// The path of the picture below the folder of the catalog.
    pub picture: Option<String>,
    /// The reason why there is no picture of a scene that was read.
    pub no_picture: Option<String>,
    /// The files that were converted from the scene.
    #[serde(default)]
    pub converted: Vec<Converted>,
}

/// A problem of a scene.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub(crate) struct Message {
    /// `error`, `damaged` or `warning`.
    pub severity: String,
    /// The line in the scene's own file, counted from 1.
    pub line: Option<u32>,
    /// The file that the problem is in, if it is not the scene itself.
    pub file: Option<String>,
    /// The text of the problem.
    pub text: String,
    /// How often it occurs.
    pub count: usize,
}

/// A file that was converted from a scene.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub(crate) struct Converted {
    /// The ending of its name, such as `glb`.
    pub kind: String,
    /// Its address, relative to the page.
    pub link: String,
}

impl Entry {
    /// Returns the number of nodes of classes that are not known.
    pub(crate) fn unknown(&self) -> usize {
        self.classes
            .get("unknown")
            .map_or(0, |list| list.values().sum())
    }

    /// Returns whether the scene was read and has nothing to draw.
    pub(crate) fn is_empty(&self) -> bool {
        self.error.is_none() && self.size.is_none()
    }
}
