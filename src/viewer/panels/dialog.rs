//! The file dialog: which file to open, and the names of files to write.

use std::path::{Path, PathBuf};

use egui::{Align2, Context, Vec2};
use egui_file::FileDialog;

use crate::viewer::model::WindowModel;

/// What the chosen file is for.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Purpose {
    /// It is opened.
    Open,
    /// It is the name of the picture to save.
    Picture,
    /// It is the name of the camera or environment to write.
    Written,
}

/// A file dialog that is shown.
pub(super) struct Dialog {
    purpose: Purpose,
    files: FileDialog,
}

impl Dialog {
    /// Shows a dialog in the folder of the name typed so far, or else of the scene.
    pub(super) fn open(purpose: Purpose, model: &WindowModel) -> Self {
        let typed = match purpose {
            Purpose::Open => &model.file,
            Purpose::Picture => &model.output,
            Purpose::Written => &model.written,
        };
        let typed = Path::new(typed.trim());
        let folder = folder_for(typed, &model.setup.plan.scene);
        let files = match purpose {
            Purpose::Open => FileDialog::open_file()
                .title("Open a scene, camera, environment, lens or picture")
                .open_button_text("Open file".into())
                .show_new_folder(false),
            Purpose::Picture => FileDialog::save_file()
                .title("Name of the picture")
                .save_button_text("Use name".into()),
            Purpose::Written => FileDialog::save_file()
                .title("Name of the camera or environment")
                .save_button_text("Use name".into()),
        };
        let name = typed.file_name().unwrap_or_default().to_string_lossy();
        let mut files = files
            .initial_path(folder)
            .show_rename(false)
            .default_filename(name)
            .default_size([420.0, 320.0])
            .anchor(Align2::CENTER_CENTER, Vec2::ZERO);
        files.open();
        Self { purpose, files }
    }

    /// Shows the dialog and acts on the chosen file. Returns whether the dialog stays open.
    pub(super) fn show(&mut self, ctx: &Context, model: &mut WindowModel) -> bool {
        if self.files.show(ctx).selected()
            && let Some(path) = self.files.path()
        {
            let name = path.display().to_string();
            match self.purpose {
                Purpose::Open => {
                    let path = path.to_owned();
                    model.file = name;
                    model.take_file(&path);
                }
                Purpose::Picture => model.output = name,
                Purpose::Written => model.written = name,
            }
        }
        self.files.visible()
    }
}

/// Returns the folder of a name if it exists, or else the folder of the scene, or else the current
/// one.
fn folder_for(typed: &Path, scene: &Path) -> PathBuf {
    let folder = |path: &Path| {
        let folder = path.parent()?;
        let here = folder.as_os_str().is_empty() && !path.as_os_str().is_empty();
        let folder = if here { Path::new(".") } else { folder };
        folder.canonicalize().ok().filter(|f| f.is_dir())
    };
    folder(typed)
        .or_else(|| folder(scene))
        .or_else(|| std::env::current_dir().ok())
        .unwrap_or_else(|| PathBuf::from("/"))
}
