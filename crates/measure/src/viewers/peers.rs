//! The scenes of a corpus, and what other programs draw of them.

use std::path::{Path, PathBuf};
use std::process::Command;

use ivcam_inventor::iv::{Document, Limits};
use serde_json::Value;

use super::{SECONDS, SIZE, ViewersOptions, file};

/// A source of pictures to compare with.
#[derive(Clone, Copy, PartialEq, Eq)]
pub(super) enum PictureSource {
    /// Coin's pictures in the corpus, with a headlight if the scene has no light.
    Archive,
    /// Coin with the headlight, as its viewers have it.
    Coin,
    View3dscene,
}

impl PictureSource {
    pub(super) fn name(self) -> &'static str {
        match self {
            Self::Archive => "Coin, archived",
            Self::Coin => "Coin",
            Self::View3dscene => "view3dscene",
        }
    }

    /// Returns why a file's pictures differ, from the list beside this program: the name of the
    /// program, a tab, the end of the file's path, a tab, and the cause.
    pub(super) fn cause(self, scene: &str) -> &'static str {
        let program = match self {
            Self::Archive | Self::Coin => "Coin",
            Self::View3dscene => "view3dscene",
        };
        let causes = include_str!("causes.tsv").lines();
        let columns = causes.filter_map(|line| {
            let (name, rest) = line.split_once('\t')?;
            let (end, cause) = rest.split_once('\t')?;
            Some((name, end, cause))
        });
        columns
            .filter(|(name, end, _)| *name == program && scene.ends_with(end))
            .map(|(.., cause)| cause)
            .next()
            .unwrap_or("unexplained")
    }
}

/// A scene of the corpus.
pub(super) struct CorpusScene {
    /// The path below the corpus's scenes.
    pub name: String,
    pub file: PathBuf,
    /// Whether the archived picture has a headlight.
    pub headlight: bool,
    archived: Option<PathBuf>,
}

/// Returns the scenes that the manifest of a corpus lists, by name.
pub(super) fn scenes(corpus: &Path) -> Vec<CorpusScene> {
    let manifest = std::fs::read_to_string(corpus.join("manifest.tsv")).unwrap_or_default();
    let names = manifest
        .lines()
        .skip(1)
        .filter_map(|l| l.split('\t').next());
    let mut names: Vec<&str> = names.filter(|name| !name.ends_with(".env")).collect();
    names.sort_unstable();
    names.into_iter().map(|name| scene(corpus, name)).collect()
}

fn scene(corpus: &Path, name: &str) -> CorpusScene {
    let reference = |ending: &str| corpus.join("reference").join(format!("{name}.{ending}"));
    let answer: Value = std::fs::read(reference("json"))
        .ok()
        .and_then(|bytes| serde_json::from_slice(&bytes).ok())
        .unwrap_or(Value::Null);
    let mut lights = answer["lights"].as_array().into_iter().flatten();
    CorpusScene {
        name: name.to_owned(),
        file: corpus.join("scenes").join(name),
        headlight: lights.any(|light| light["headlight"] == true),
        archived: Some(reference("png")).filter(|picture| picture.exists()),
    }
}

impl CorpusScene {
    /// Returns the pictures of the scene by other programs.
    pub(super) fn pictures(&self, options: &ViewersOptions) -> Vec<(PictureSource, PathBuf)> {
        let mut all = Vec::new();
        if let Some(picture) = &self.archived {
            all.push((PictureSource::Archive, picture.clone()));
        }
        let drawn = self.archived.is_some() && self.headlight;
        if let Some(program) = options.coin.as_ref().filter(|_| !drawn) {
            let size = format!("{}x{}", SIZE.0, SIZE.1);
            let words = ["-headlight", "on", "-s", &size, "-png"];
            all.extend(self.drawn(options, PictureSource::Coin, |command, output| {
                command.arg(program).args(words).arg(output).arg(&self.file);
            }));
        }
        if let Some(program) = options.view3dscene.as_ref().filter(|_| self.is_vrml_view()) {
            let size = format!("{}x{}", SIZE.0, SIZE.1);
            let words = ["--no-sound", "-H", "--hide-menu", "--geometry", &size];
            all.extend(
                self.drawn(options, PictureSource::View3dscene, |command, output| {
                    command.arg(program).args(words).arg(&self.file);
                    command.args(["--screenshot", "0"]).arg(output);
                }),
            );
        }
        all
    }

    /// Returns whether the scene is a VRML file with a camera, because programs choose different
    /// views without one.
    fn is_vrml_view(&self) -> bool {
        const CAMERAS: [&str; 3] = ["Viewpoint", "PerspectiveCamera", "OrthographicCamera"];
        let Ok(document) = Document::open_with(&self.file, &[], &Limits::default()) else {
            return false;
        };
        let mut nodes = document.descendants();
        self.name.contains(".wrl") && nodes.any(|n| CAMERAS.contains(&n.class_name()))
    }

    /// Returns the picture that a command draws, or that an earlier run of it has drawn.
    fn drawn(
        &self,
        options: &ViewersOptions,
        peer: PictureSource,
        describe: impl FnOnce(&mut Command, &Path),
    ) -> Option<(PictureSource, PathBuf)> {
        let output = file(&options.out, "peers", peer, &self.name);
        if !output.exists() {
            let mut command = Command::new("timeout");
            command.arg(SECONDS);
            describe(&mut command, &output);
            // A program that fails writes no picture.
            let _ = command.output();
        }
        let made = output.exists();
        if !made {
            println!("no picture by {}: {}", peer.name(), self.name);
        }
        made.then_some((peer, output))
    }
}
