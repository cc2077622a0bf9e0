//! Camera and environment files, which `--camera` and `--environment` read.

use std::path::{Path, PathBuf};

use ivcam_base::diag::{Diagnostic, Result, Sink};
use ivcam_base::files::write_whole;
use ivcam_base::files::{MAX_TEXT, read_file};
use ivcam_inventor::grammar::{class, directional_light};
use ivcam_inventor::iv::{Document, Format};
use ivcam_inventor::pose::CameraPose;
use ivcam_optics::film::Response;

use super::setup::Setup;
use crate::photo::output_files::{overwritten_input, writable};
use crate::photo::{CameraChoice, FileKind, camera_file};

/// The probable kind of a file that was dropped or named.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum DroppedKind {
    Scene,
    Camera,
    Environment,
    Picture,
    Lens,
    /// A catalogue of glasses for lenses.
    Glasses,
    /// A table of a film's density.
    Film,
    /// A picture of the surroundings, which lights the scene.
    Surroundings,
    Folder,
}

impl DroppedKind {
    /// Returns the kind by the name's extension, or else by the content. A `.dat` is a camera if it
    /// holds a camera node, otherwise a lens.
    pub(crate) fn of(path: &Path) -> Self {
        if path.is_dir() {
            return Self::Folder;
        }
        let end = path
            .extension()
            .unwrap_or_default()
            .to_string_lossy()
            .to_lowercase();
        match end.as_str() {
            "png" | "jpg" | "jpeg" | "tif" | "tiff" | "gif" | "bmp" | "ppm" | "pgm" | "pnm"
            | "tga" | "rgb" | "sgi" | "bw" | "exr" => Self::Picture,
            "zmx" | "seq" | "json" | "len" | "lens" | "roa" | "fx" | "lhlt" => Self::Lens,
            "env" => Self::Environment,
            "agf" => Self::Glasses,
            "hdr" => Self::Surroundings,
            "dat"
                if CameraChoice::File(path.to_owned())
                    .pose(&mut Sink::new())
                    .is_ok() =>
            {
                Self::Camera
            }
            "dat" => Self::Lens,
            "iv" | "wrl" | "x3d" | "x3dv" | "gltf" | "glb" | "obj" | "ply" | "stl" | "gz" => {
                Self::Scene
            }
            _ => Self::by_content(path),
        }
    }

    fn by_content(path: &Path) -> Self {
        if Response::open(&path.to_string_lossy()).is_ok() {
            return Self::Film;
        }
        match FileKind::of(path) {
            Some(FileKind::Picture) => Self::Picture,
            Some(FileKind::Lens) => Self::Lens,
            // A file that is none of these is read as a scene, and the reader says what is wrong.
            Some(FileKind::Scene) | None => Self::Scene,
        }
    }

    /// Returns what the window does with a file of this kind.
    pub(crate) fn action(self) -> &'static str {
        match self {
            Self::Scene => "opens the scene",
            Self::Camera => "takes this camera",
            Self::Environment => "opens the scene with this environment",
            Self::Picture => "compares this picture",
            Self::Lens => "takes this lens",
            Self::Glasses => "adds these glasses to the lens",
            Self::Film => "takes this film",
            Self::Surroundings => "lights the scene by this picture",
            Self::Folder => "is a folder, which the window does not open",
        }
    }
}

/// Returns a camera file with the pose, and the focus distance as the camera's own.
pub(crate) fn camera_text(setup: &Setup) -> String {
    camera_file(&setup.fitted_pose(), setup.focus())
}

/// Returns a SceneViewer environment file: the camera, the other nodes of the environment read
/// before (fog, lights), and the headlight if it is `lit`.
///
/// # Errors
/// Fails if the environment read before cannot be read again.
pub(crate) fn environment_text(setup: &Setup, lit: bool) -> Result<String> {
    let mut text = camera_text(setup);
    let mut lamp = None;
    if let Some(path) = &setup.plan.environment {
        let bytes = read_file(path, MAX_TEXT)?;
        let mut document = Document::read_headerless(&path.display().to_string(), bytes)?;
        let roots = std::mem::take(&mut document.roots);
        for id in roots {
            let node = document.node(id);
            if node.class_id() == Some(class::DIRECTIONAL_LIGHT) {
                lamp = Some(id);
            } else if CameraPose::from_node(node, glam::DMat4::IDENTITY).is_none() {
                document.roots.push(id);
            }
        }
        text += &body(&document);
        document.roots = lamp.into_iter().collect();
        let is_on = |id| document.node(id).get(directional_light::ON);
        if lit && lamp.is_some_and(is_on) {
            return Ok(text + &body(&document));
        }
    }
    if lit {
        text += "DirectionalLight { direction 0 0 -1 }\n";
    }
    Ok(text)
}

/// Returns a document without its header.
fn body(document: &Document) -> String {
    if document.roots.is_empty() {
        return String::new();
    }
    let written = String::from_utf8_lossy(&document.write(Format::Ascii)).into_owned();
    written
        .split_once('\n')
        .map_or(String::new(), |(_, rest)| rest.to_owned())
}

/// Checks that a file can be written and is none of `inputs`, before the work for it begins.
///
/// # Errors
/// Fails if the folder does not exist, if nothing can be written to it, or if the file is an input.
pub(crate) fn check_output(path: &Path, inputs: &[PathBuf]) -> Result<()> {
    writable(path)?;
    let Some(input) = overwritten_input(path, inputs) else {
        return Ok(());
    };
    let (path, input) = (path.display(), input.display());
    let text = format!("`{path}` would overwrite the input `{input}`");
    Err(Diagnostic::error(text).with_help("give the new file another name"))
}

/// Writes a text file.
///
/// # Errors
/// Fails if the file cannot be written.
pub(crate) fn write(path: &Path, text: &str) -> Result<()> {
    write_whole(path, |file| file.write_all(text.as_bytes()))
}
