//! Files of every kind that are dropped on the window or named.

use std::path::Path;

use ivcam_base::diag::{Diagnostic, Result, Sink};
use ivcam_optics::film::Response;
use ivcam_optics::lens::Lens;
use ivcam_render::shade::Shading;

use super::files::DroppedKind;
use super::model::{WindowModel, file_name};
use crate::photo::{CameraChoice, Optics, Surroundings};

impl WindowModel {
    /// Opens a file of any kind that was dropped on the window or named.
    pub(crate) fn take_file(&mut self, path: &Path) {
        let name = path.to_string_lossy().into_owned();
        let taken = match DroppedKind::of(path) {
            DroppedKind::Scene => {
                self.open_scene(path);
                Ok(())
            }
            DroppedKind::Camera => self.read_camera(path),
            DroppedKind::Environment => {
                self.read_environment(path);
                Ok(())
            }
            DroppedKind::Picture => self.archive.load(path),
            DroppedKind::Lens => {
                Lens::open(&name).map(|_| self.edit("lens", |s| s.choose_lens(&name)))
            }
            DroppedKind::Glasses => self.add_glasses(path),
            DroppedKind::Film => Response::open(&name).map(|film| {
                self.edit("film", |s| {
                    s.plan.response = film.balanced(s.plan.response.balance());
                });
            }),
            DroppedKind::Surroundings => {
                self.edit("surroundings", |s| {
                    s.plan.light.surroundings = Some(Surroundings::Picture(path.to_owned()));
                    s.set_shading(Shading::Path);
                });
                self.reopen();
                Ok(())
            }
            DroppedKind::Folder => {
                let error = Diagnostic::unsupported(format!("`{name}` is a folder"));
                let help = "open a scene of it; `ivcam catalog FOLDER` makes pictures of all";
                Err(error.with_help(help))
            }
        };
        if let Err(error) = taken {
            self.add_message(*error);
        }
    }

    /// Adds a catalogue of glasses to the lens.
    fn add_glasses(&mut self, path: &Path) -> Result<()> {
        let Some(mut choice) = self.setup.lens().cloned() else {
            let error = Diagnostic::unsupported("a catalogue of glasses is for a lens");
            return Err(error.with_help("choose the lens first"));
        };
        choice.catalogues.push(path.to_owned());
        choice.reading()?;
        self.edit("lens", |s| s.plan.optics = Optics::Lens(choice));
        self.status = format!("glasses of {}", file_name(path));
        Ok(())
    }

    /// Sets the camera from a camera file.
    ///
    /// # Errors
    /// Fails if the file has no camera.
    pub(crate) fn read_camera(&mut self, path: &Path) -> Result<()> {
        let camera = CameraChoice::File(path.to_owned());
        let mut found = Sink::new();
        let pose = camera.pose(&mut found)?;
        self.edit("camera file", |setup| {
            setup.keep_places();
            (setup.plan.camera, setup.plan.view) = (Some(camera), None);
            setup.plan.focus = None;
            setup.pose = pose;
        });
        self.status = format!("camera of {}", file_name(path));
        for diagnostic in found.items() {
            self.add_message(diagnostic.clone());
        }
        Ok(())
    }

    /// Opens the scene again with a SceneViewer environment.
    pub(crate) fn read_environment(&mut self, path: &Path) {
        let mut plan = self.setup.plan.clone();
        (plan.environment, plan.camera) = (Some(path.to_owned()), None);
        self.order_open(plan);
    }
}
