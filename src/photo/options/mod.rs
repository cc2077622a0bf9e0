//! The table of options: everything that can be asked of a photograph, one entry each.
//!
//! An entry ([`Opt`]) holds the spellings of 1999 and of today, the help, what the option changes
//! in a [`Plan`](super::Plan), how a plan is written as the option's words again, and what the
//! metadata and the report say of it. The command line, the window's *Copy command*, the metadata,
//! the report and `ivcam lens` are faces of this table. It knows nothing of clap: `cli::flags`
//! makes arguments of it.

mod faces;
mod film;
mod lens;
mod light;
mod option;
mod output;
mod sampling;
mod scene;
mod shutter;
mod table;
mod values;
mod words;

pub(crate) use faces::{command_line, idle_options};
pub(crate) use lens::for_a_lens_alone;
pub(crate) use option::{Needs, Opt, Takes};
pub(crate) use scene::{FONTS, LIMIT, limits, typefaces};
pub(crate) use shutter::Shutter;
pub(crate) use table::{all, groups};
pub(crate) use words::{MovieFrame, Words, not_understood};
