//! Movies: what changes from frame to frame, and the frames.
//!
//! A [`Timeline`] says how focus, zoom, aperture, camera and the time of the scene change; a
//! [`Shoot`] renders its frames into a folder; a [`Container`] makes one file of them.

mod container;
mod ease;
mod shoot;
mod timeline;
mod timeline_file;

pub(crate) use container::{Container, has_ffmpeg};
pub(crate) use ease::Ease;
pub(crate) use shoot::{Event, Shoot};
pub(crate) use timeline::Timeline;
