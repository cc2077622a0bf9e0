//! Movies: timelines, the rendering of frames, and movie files.
//!
//! A [`Timeline`] states how focus, zoom, aperture, camera and scene time change; a `Shoot`
//! renders the frames into a folder, which several processes may do at once; `Frames` says which
//! are done; a `Container` writes one file of them.

mod container;
mod ease;
mod frame_list;
mod frames;
mod journal;
mod label;
mod moments;
mod shoot;
mod timeline;
mod timeline_file;

pub(crate) use container::{Container, has_ffmpeg};
pub(crate) use ease::Ease;
pub(crate) use frame_list::{frames_text, parse_frames};
pub(crate) use frames::{FrameState, Frames, folder_beside};
pub use moments::expose_moments;
pub(crate) use shoot::{Shoot, ShootEvent};
pub use timeline::Timeline;
pub(crate) use timeline::{RATES, RATES_TEXT};
