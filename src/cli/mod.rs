//! The command line: the flags in both spellings, and the commands.
//!
//! Data is written to stdout, messages to stderr. The exit code is 0 for success, 1 if pictures
//! differ or a limit is exceeded, and 2 for an error.

mod announcement;
mod arguments;
mod catalog;
pub(crate) mod check;
pub(crate) mod compare;
mod compare_folder;
mod compare_options;
mod completions;
pub(crate) mod converge;
pub(crate) mod convert;
pub(crate) mod convert_folder;
mod dispatch;
pub(crate) mod expose;
pub(crate) mod farm;
mod farm_picture;
pub(crate) mod fit;
pub mod flags;
mod folder_mode;
pub(crate) mod frames;
mod gallery;
mod keeping;
pub(crate) mod lens;
mod lens_batch;
mod lens_csv;
mod lens_export;
mod lens_files;
mod lens_json;
mod lens_list;
mod lens_request;
mod lens_survey;
mod licenses;
mod man;
pub(crate) mod merge;
mod messages;
mod meter;
mod movie_warnings;
pub(crate) mod nodes;
mod outputs;
pub(crate) mod pull_focus;
pub(crate) mod render;
mod render_folder;
mod render_outputs;
mod sheet;
mod stability;
mod team;
#[cfg(feature = "mpi")]
mod team_mpi;
mod tev;
mod trace_rays;
mod usage;
pub(crate) mod view;
mod vintage_help;
mod wrong_file;

pub use crate::photo::output_files::files_in;
pub(crate) use arguments::{
    allowance, compares_folder, folder_of_scenes, fonts, is_given, limits, memory, parsed,
    readable_folders, reading_arguments, scene_argument, switch, text, time_for_each, value,
};
use dispatch::unknown_command;
pub use dispatch::{open, plan, run};
pub use lens::{LensOutput, lens_output, output_of_lens};
pub(crate) use messages::status;
pub(crate) use messages::{ERROR, exit_code, print_diagnostic, print_warnings, print_wrapped};
pub use outputs::{check_outputs, keep_inputs};
