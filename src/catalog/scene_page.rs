//! Writes the page of each scene: a large picture, facts, what the scene needs and what is missing,
//! problems, related scenes, and the tree of nodes. It needs no script.

use std::path::{Path, PathBuf};

use ivcam_base::diag::{Diagnostic, Result, counted};
use ivcam_base::files::{folder_of, read_file, write_whole};
use minijinja::Environment;
use minijinja::value::{Serde, Value};
use serde::Serialize;

use super::entry::{Entry, Message, Need, Others};
use super::formats::{GZIP, media_type};
use super::heading::CatalogHeading;
use super::links::{joined, original};
use super::numbers::{date, short, thousands};
use super::page::{SceneLabel, folders_and_name, instead, labels};
use super::place;
use super::template::environment;
use super::tree::{SceneDetail, TreeNode};

/// The largest size of a file with the detail of a scene, in bytes.
const MOST_DETAIL: usize = 1 << 26;

/// The content of a page, as the template names it.
#[derive(Serialize)]
struct ScenePage<'a> {
    title: &'a str,
    version: &'static str,
    /// The address of the folder of the catalog.
    root: String,
    folders: &'a str,
    name: &'a str,
    /// The address of the scene, and the one that opens it in the built page.
    link: String,
    live: Option<String>,
    entry: &'a Entry,
    instead: &'static str,
    labels: Vec<SceneLabel>,
    /// Headings and texts. Empty texts are not shown.
    facts: Vec<(&'static str, String)>,
    /// The names of files and typefaces, what they are, and what became of them.
    needs: Vec<[String; 3]>,
    problems: Vec<Message>,
    problems_left_out: usize,
    related: Vec<Related<'a>>,
    tree: Vec<TreeLine>,
    nodes_left_out: usize,
}

/// Scenes that are related in one way.
#[derive(Serialize)]
struct Related<'a> {
    heading: &'static str,
    /// The names and the addresses of the scenes.
    files: Vec<(&'a str, String)>,
    more: bool,
}

/// A line of the tree.
#[derive(Serialize)]
struct TreeLine {
    #[serde(flatten)]
    node: TreeNode,
    /// Whether nodes below it follow.
    opens: bool,
    /// The number of nodes above it whose last node it is.
    closes: usize,
}

/// Writes the pages of scenes.
pub(super) struct ScenePages<'a> {
    out: &'a Path,
    heading: &'a CatalogHeading,
    templates: Environment<'static>,
}

impl<'a> ScenePages<'a> {
    pub(super) fn new(out: &'a Path, heading: &'a CatalogHeading) -> Self {
        let mut templates = environment();
        templates
            .add_template("scene.html", include_str!("scene.html"))
            .expect("the template is correct");
        Self {
            out,
            heading,
            templates,
        }
    }

    /// Writes the page of a scene.
    ///
    /// # Errors
    /// Returns an error if the file cannot be written.
    pub(super) fn write(&self, entry: &Entry) -> Result<()> {
        let text = self.text(entry, self.detail(entry));
        let path: PathBuf = self.out.join(place::scene_page(&entry.file));
        let folder = folder_of(&path);
        std::fs::create_dir_all(&folder).map_err(|e| Diagnostic::io(folder.display(), &e))?;
        write_whole(&path, |file| file.write_all(text.as_bytes()))
    }

    /// Reads the detail of a scene. A scene on which the program failed has none.
    fn detail(&self, entry: &Entry) -> SceneDetail {
        let bytes = read_file(&self.out.join(place::detail(&entry.file)), MOST_DETAIL).ok();
        let read = bytes.and_then(|bytes| serde_json::from_slice(&bytes).ok());
        read.unwrap_or_default()
    }

    /// Returns the page of a scene.
    fn text(&self, entry: &Entry, detail: SceneDetail) -> String {
        let root = place::root(&entry.file);
        let (folders, name) = folders_and_name(&entry.file);
        let listed: usize = detail.problems.iter().map(|problem| problem.count).sum();
        let live = self.heading.live && entry.error.is_none();
        let related = [
            ("Files with the same bytes", &entry.duplicates),
            ("Files with the same nodes", &entry.same_scene),
            ("Scenes that look alike", &entry.alike),
        ];
        let page = ScenePage {
            title: &self.heading.title,
            version: env!("CARGO_PKG_VERSION"),
            folders,
            name,
            link: original(&format!("{root}{}", self.heading.folder), &entry.file),
            live: live.then(|| format!("{root}{}", place::live(&entry.file))),
            entry,
            instead: instead(entry),
            labels: labels(entry),
            facts: facts(entry),
            needs: needs(entry),
            problems_left_out: entry.problems.saturating_sub(listed),
            problems: detail.problems,
            related: related
                .into_iter()
                .filter(|(_, others)| !others.files.is_empty())
                .map(|(heading, others)| related_to(heading, others, &root))
                .collect(),
            tree: lines(detail.nodes),
            nodes_left_out: detail.nodes_left_out,
            root,
        };
        let template = self
            .templates
            .get_template("scene.html")
            .expect("the template exists");
        let text = template.render(Value::from(Serde(&page)));
        text.expect("the template fits its data")
    }
}

fn related_to<'a>(heading: &'static str, others: &'a Others, root: &str) -> Related<'a> {
    let address = |file: &str| root.to_owned() + &joined("", &place::scene_page(file));
    Related {
        heading,
        files: others
            .files
            .iter()
            .map(|file| (&**file, address(file)))
            .collect(),
        more: others.more,
    }
}

fn facts(entry: &Entry) -> Vec<(&'static str, String)> {
    let text = |text: &Option<String>| text.clone().unwrap_or_default();
    let classes = |treatment: &str| {
        let list = entry.classes.get(treatment).into_iter().flatten();
        let words: Vec<String> = list.map(|(name, n)| format!("{name} {n}")).collect();
        words.join(", ")
    };
    let extent = |[x, y, z]: [f64; 3]| format!("{} × {} × {} m", short(x), short(y), short(z));
    let counts = format!(
        "{}, {}",
        counted(entry.lights, "light"),
        counted(entry.cameras, "camera")
    );
    let media = entry
        .format
        .as_deref()
        .and_then(media_type)
        .unwrap_or_default();
    let packed = entry.packed.as_ref();
    let packed = packed.map(|packed| format!("{packed}, {}", GZIP.0));
    let ending = entry.unexpected_ending.as_ref();
    let ending = ending.map(|ending| format!("{ending}, which is usual for another format"));
    let round = match entry.round_solids() {
        0 => String::new(),
        n => format!("{}, exact and without triangles", thousands(n)),
    };
    vec![
        ("Not read", text(&entry.error)),
        ("No picture", text(&entry.no_picture)),
        ("Format", text(&entry.format)),
        ("PRONOM identifier", text(&entry.pronom)),
        ("Media type", media.to_owned()),
        ("Packed", packed.unwrap_or_default()),
        ("Ending", ending.unwrap_or_default()),
        ("Producer", text(&entry.producer)),
        ("Unit of length", text(&entry.units)),
        ("Extent", entry.size.map(extent).unwrap_or_default()),
        (
            "Lights and cameras",
            if entry.error.is_none() {
                counts
            } else {
                String::new()
            },
        ),
        ("Triangles", thousands(entry.triangles)),
        ("Round solids", round),
        ("Drawn", classes("drawn")),
        ("Structure", classes("structure")),
        ("Kept", classes("kept")),
        ("Unknown", classes("unknown")),
        ("Size", format!("{} bytes", thousands(entry.bytes))),
        ("Modified", date(entry.modified)),
        ("SHA-256", entry.sha256.clone()),
    ]
}

fn needs(entry: &Entry) -> Vec<[String; 3]> {
    let kind = |need: &Need| match &*need.kind {
        "scene" => "inlined scene",
        "texture" => "texture",
        _ => "file",
    };
    let became = |need: &Need| match (&*need.state, need.is_inside()) {
        ("found", true) => "found",
        ("found", false) => "found elsewhere",
        ("outside", _) => "outside the folder, not read",
        ("unreadable", _) => "found, not readable",
        _ => "missing",
    };
    // The path of a file elsewhere says more about the machine than about the archive.
    let name = |need: &Need| match (&*need.state, need.is_inside()) {
        ("found", false) => folders_and_name(&need.file).1.to_owned(),
        _ => need.file.clone(),
    };
    let files = entry.needs.iter();
    let files = files.map(|need| [name(need), kind(need).to_owned(), became(need).to_owned()]);
    let drawn = |found| {
        if found {
            "found"
        } else {
            "drawn with a typeface of ivcam"
        }
    };
    let faces = entry.typefaces.iter();
    let faces = faces.map(|face| {
        [
            face.name.clone(),
            "typeface".to_owned(),
            drawn(face.found).to_owned(),
        ]
    });
    files.chain(faces).collect()
}

/// Returns the lines of a tree.
fn lines(nodes: Vec<TreeNode>) -> Vec<TreeLine> {
    let depths = nodes.iter().skip(1).map(|node| node.depth).chain([0]);
    let depths: Vec<usize> = depths.collect();
    let line = |(node, next): (TreeNode, usize)| TreeLine {
        opens: next > node.depth,
        closes: node.depth.saturating_sub(next),
        node,
    };
    nodes.into_iter().zip(depths).map(line).collect()
}

#[cfg(test)]
mod tests {
    use super::super::entry::NamedTypeface;
    use super::*;

    #[test]
    fn text_from_files_cannot_become_markup() {
        let evil = "<img src=x onerror=alert(1)></p>\"'&\u{202e}\u{7}";
        let text = || evil.to_owned();
        let others = Others {
            files: vec![format!("{evil}.iv")],
            more: true,
        };
        let message = Message {
            severity: "warning".to_owned(),
            line: Some(3),
            column: Some(7),
            byte: None,
            file: Some(text()),
            text: text(),
            count: 2,
        };
        let at_byte = Message {
            line: None,
            column: None,
            byte: Some(0),
            ..message.clone()
        };
        let need = Need {
            file: text(),
            kind: "texture".to_owned(),
            state: "missing".to_owned(),
            size_and_time: None,
        };
        let entry = Entry {
            file: format!("a/{evil}.iv"),
            format: Some(text()),
            producer: Some(text()),
            notes: vec![text()],
            problems: 7,
            needs: vec![need],
            typefaces: vec![NamedTypeface {
                name: text(),
                found: false,
            }],
            large: Some(format!("large/a/{evil}.iv.jpg")),
            duplicates: others.clone(),
            alike: others,
            ..Entry::default()
        };
        let node = |depth| TreeNode {
            depth,
            class: text(),
            name: Some(text()),
            fields: text(),
            file: Some(text()),
            ..TreeNode::default()
        };
        let detail = SceneDetail {
            nodes: vec![node(0), node(1), node(2), node(0)],
            nodes_left_out: 4,
            problems: vec![at_byte, message],
            ..SceneDetail::default()
        };
        let heading = CatalogHeading {
            title: text(),
            live: true,
            ..CatalogHeading::default()
        };
        let page = ScenePages::new(Path::new(""), &heading).text(&entry, detail);
        assert_eq!(page.matches("<img ").count(), 1, "only the picture: {page}");
        assert!(!page.contains("onerror=alert(1)>") && !page.contains('\u{202e}'));
        assert!(!page.contains("<script"));
        for part in [
            "line 3, column 7",
            "byte 0: ",
            "and 3 more",
            "and 4 more nodes",
            "href=\"../../../index.html\"",
            "&lt;img src=x onerror=alert(1)&gt;",
        ] {
            assert!(page.contains(part), "{part} missing in {page}");
        }
        assert_eq!(
            page.matches("<details").count(),
            page.matches("</details>").count()
        );
    }

    #[test]
    fn a_tree_closes_what_it_opens() {
        let depths = [0, 1, 2, 2, 1, 0, 1];
        let nodes = depths.map(|depth| TreeNode {
            depth,
            ..TreeNode::default()
        });
        let marks: Vec<_> = lines(nodes.to_vec())
            .iter()
            .map(|l| (l.opens, l.closes))
            .collect();
        let expected = [
            (true, 0),
            (true, 0),
            (false, 0),
            (false, 1),
            (false, 1),
            (true, 0),
            (false, 1),
        ];
        assert_eq!(marks, expected);
    }
}
