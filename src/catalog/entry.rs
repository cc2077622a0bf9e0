//! What a catalog knows about one scene.

use indexmap::IndexMap;
use ivcam_render::scene::check::round_solids;
use serde::{Deserialize, Serialize};

/// A scene of a catalog. Its keys in JSON are described in `docs/guide/archives.md`.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub(crate) struct Entry {
    /// The path below the folder of scenes, with `/` between its parts.
    pub file: String,
    /// The size of the file in bytes.
    pub bytes: u64,
    /// The SHA-256 of the file in hexadecimal digits. Empty if it could not be read.
    pub sha256: String,
    /// The SHA-256 of the nodes as `ivcam convert --to ascii` writes them, which does not depend on
    /// comments and spaces. `None` if nothing was read.
    pub scene_sha256: Option<String>,
    /// The time of the last modification in seconds since the beginning of 1970, UTC.
    pub modified: u64,
    /// `whole`, `damaged` or `unreadable`.
    pub state: String,
    /// The reason why nothing of the file was read.
    pub error: Option<String>,
    /// The format that the header states.
    pub format: Option<String>,
    /// The identifier of the format in PRONOM, such as `fmt/94`, if it has one.
    pub pronom: Option<String>,
    /// How the file is packed: `gzip`, or `None` if it is not.
    #[serde(default)]
    pub packed: Option<String>,
    /// The ending of the file's name, if its format is another than that promises.
    #[serde(default)]
    pub unexpected_ending: Option<String>,
    /// The unit of length that the file or its format states.
    pub units: Option<String>,
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
    /// The files that the scene names, with what became of each.
    pub needs: Vec<Need>,
    /// The typefaces that the scene names.
    pub typefaces: Vec<NamedTypeface>,
    /// The path of the picture below the folder of the catalog.
    pub picture: Option<String>,
    /// The path of the larger picture below the folder of the catalog.
    pub large: Option<String>,
    /// The mean colors of the parts of the picture, in hexadecimal digits (see `alike`).
    pub look: Option<String>,
    /// The reason why there is no picture of a scene with something to draw.
    pub no_picture: Option<String>,
    /// Whether the time for the scene ended before all was read and drawn.
    #[serde(default)]
    pub out_of_time: bool,
    /// The files that were converted from the scene.
    #[serde(default)]
    pub converted: Vec<Converted>,
    /// Scenes with the same bytes.
    #[serde(default)]
    pub duplicates: Others,
    /// Scenes with other bytes and the same nodes.
    #[serde(default)]
    pub same_scene: Others,
    /// Scenes with other nodes whose pictures look alike.
    #[serde(default)]
    pub alike: Others,
}

/// Some other scenes of the catalog.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub(crate) struct Others {
    /// Their paths below the folder of scenes.
    pub files: Vec<String>,
    /// Whether there are more than are listed.
    pub more: bool,
}

/// A file that a scene names.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub(crate) struct Need {
    /// A file that is there: its path below the folder of scenes, elsewhere its whole path. A file
    /// that is missing or may not be read: its name in the scene.
    pub file: String,
    /// `scene`, `texture` or `other`.
    pub kind: String,
    /// `found`, `missing`, `unreadable` or `outside`.
    pub state: String,
    /// The size in bytes and the time of the last modification in seconds since the beginning of
    /// 1970, of a file that is there.
    pub size_and_time: Option<(u64, u64)>,
}

/// A typeface that a scene names.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub(crate) struct NamedTypeface {
    pub name: String,
    /// Whether the folders of `--fonts` have it. Otherwise a typeface of the program is drawn.
    pub found: bool,
}

/// A problem of a scene.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub(crate) struct Message {
    /// `error`, `damaged` or `warning`.
    pub severity: String,
    /// The line, counted from 1.
    pub line: Option<u32>,
    /// The column, counted from 1.
    pub column: Option<u32>,
    /// The offset in bytes in a binary file, which has no lines.
    #[serde(default)]
    pub byte: Option<u32>,
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

impl Need {
    /// Returns whether the file is there and below the folder of scenes.
    pub(crate) fn is_inside(&self) -> bool {
        self.state == "found" && !std::path::Path::new(&self.file).is_absolute()
    }
}

impl Entry {
    /// Returns the number of shapes that are drawn exactly and have no triangles.
    pub(crate) fn round_solids(&self) -> u64 {
        round_solids(self.shapes.iter().map(|(class, count)| (&**class, *count)))
    }

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
