//! The table of options, with one entry for each option of a photograph.
//!
//! An entry ([`Opt`]) has the option's spellings of 1999 and of today, its help, functions that
//! change a [`Plan`](super::Plan) by it and that write a plan's value as arguments, and the text
//! for the metadata and the report. The command line, the window's *Copy command*, the metadata,
//! the report and `ivcam lens` all use this table. It does not depend on clap: `cli::flags`
//! converts it to clap's arguments.

mod conversions;
mod film;
mod given;
mod lens;
mod light;
mod option;
mod output;
mod path;
mod sampling;
mod scene;
mod shutter;
mod table;
mod values;

pub use conversions::command_line;
pub(crate) use conversions::idle_options;
pub use given::GivenOptions;
pub(crate) use given::{MovieFrame, parsed_word};
pub(crate) use option::OptionNeeds;
pub use option::{Opt, Takes};
pub(crate) use sampling::{can_adapt, rear_element};
pub(crate) use scene::{
    DRAG, EVENT, FONTS, LIMIT, MEMORY, TIME, TOUCH, WORK, actions, limits, memory, scene_time,
    typefaces, work,
};
pub(crate) use shutter::Shutter;
pub(crate) use table::groups;
pub use table::{all, lens_options};
pub(crate) use values::{POSITIVE, distance, duration, positive};
