//! Tests of lenses through the public interface of the crate.

mod aberrations;
mod extreme;
#[path = "../../../tests/common/folder.rs"]
mod folder;
mod forbes;
mod lens;
mod lens_files;
mod merit;
mod mirrors;
mod outlines;
mod thin_lenses;
mod tilts;
