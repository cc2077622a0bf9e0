//! Photographs the scenes of the new folder that have no picture.

use std::collections::HashMap;
use std::path::{Path, PathBuf};

use ivcam_base::diag::{Diagnostic, Result};
use ivcam_base::files::named_project;

use super::files::{PictureFile, RENDERED};
use super::options::FolderOptions;
use super::progress::ReportProgress;
use crate::archive::{MadePicture, Record, for_each, make_picture};
use crate::photo::Plan;
use crate::photo::options::command_line;

/// Photographs some scenes, unless their pictures are up to date. Returns the errors by the names
/// of the scenes.
///
/// # Errors
/// Returns an error if the folder of the pictures cannot be written.
pub(super) fn photograph(
    options: &FolderOptions,
    scenes: &[&PictureFile],
    progress: &mut dyn ReportProgress,
) -> Result<HashMap<String, Box<Diagnostic>>> {
    let photographs = &options.photographs;
    let out = options.out.join(RENDERED);
    std::fs::create_dir_all(&out).map_err(|e| Diagnostic::io(out.display(), &e))?;
    let record = Record::open(&out, "render", photographs.given.clone());
    record.write()?;
    let is_current = |file: &&&PictureFile| {
        let scene = file.scene.iter();
        let inputs = photographs.uses.iter().chain(scene).map(PathBuf::as_path);
        let inputs: Vec<&Path> = inputs.collect();
        !options.force && record.is_up_to_date(&file.path, &inputs)
    };
    let waiting: Vec<&PictureFile> = scenes.iter().filter(|s| !is_current(s)).copied().collect();
    let at_once = options.threads.min(waiting.len()).max(1);
    progress.begin(waiting.len());
    let work = |file: &&PictureFile| {
        let scene = file.scene.clone().unwrap_or_default();
        let contain = photographs.plan.contain.clone();
        let plan = Plan {
            contain: contain.or_else(|| named_project(&scene, &options.new)),
            scene,
            memory: photographs.plan.memory.for_each_of(at_once),
            ..photographs.plan.clone()
        };
        let command = command_line(&plan.to_args(&file.path));
        make_picture(plan, &file.path, &command, None)
    };
    let mut errors = HashMap::new();
    let mut done = |file: &&PictureFile, result: Result<MadePicture>| {
        let error = match result {
            Ok(made) if !made.is_empty => None,
            Ok(_) => Some(Diagnostic::error("the scene has nothing to draw")),
            Err(error) => Some(error),
        };
        progress.done(&file.name);
        if let Some(error) = error {
            errors.insert(file.name.clone(), error);
        }
    };
    for_each(&waiting, options.threads, &work, &mut done)?;
    Ok(errors)
}
