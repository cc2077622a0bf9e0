//! Photographs Open Inventor and VRML scenes through real lens prescriptions.
//!
//! Data moves one way. Bytes become a [`Document`]; a [`Snapshot`] is the document at one time;
//! a [`RenderScene`] is what a ray can hit; a lens prescription and a camera's pose become a
//! [`Camera`]; and a [`Film`] collects the radiance that the camera's rays bring. Each step can be
//! used alone. Nothing is global and nothing prints. A wrong file is a [`Diagnostic`] with its
//! place, and a ray that does not pass a lens is a [`Loss`](lens::Loss); neither is a panic.
//!
//! # A tour
//!
//! ```
//! use ivcam::math::{meters, mm};
//! use ivcam::photo::LensChoice;
//! use ivcam::render::Stop;
//! use ivcam::snapshot::SnapshotOptions;
//! use ivcam::{CompileOptions, Document, RenderScene, scene};
//! use ivcam::{Era, Lens, Optics, Plan, Resolution, Session};
//!
//! // Read a scene. `document.sink` has its warnings, with file, line and column.
//! let document = Document::open("scenes/livroom/livroom.iv")?;
//! let cameras = document.descendants().filter(|n| n.class_name() == "PerspectiveCamera");
//! println!("{} nodes, {} cameras", document.nodes.len(), cameras.count());
//!
//! // Evaluate its engines at a time, and compile what can be seen.
//! let options = CompileOptions::default();
//! let snapshot = scene::snapshot(&document, &SnapshotOptions::default(), &options);
//! let compiled = RenderScene::compile(&snapshot, &options)?;
//! println!("{:?} in the box {:?}", compiled.primitives(), compiled.bounds());
//!
//! // Look at a lens: lengths are in millimeters.
//! let lens = Lens::open("double-gauss")?;
//! assert!((lens.first_order().efl() - 100.0).abs() < 1.0);
//!
//! // Photograph the scene through it. A session does all of the above by itself.
//! let mut plan = Plan::of_era(Era::Modern, "scenes/livroom/livroom.iv");
//! let lens = LensChoice { efl: Some(mm(60.0)), ..LensChoice::named("double-gauss") };
//! plan.optics = Optics::Lens(lens);
//! plan.focus = Some(meters(3.6));
//! plan.resolution = Resolution::new(18, 12)?;
//! plan.stop = Stop::after(4);
//! let session = Session::open(plan)?;
//! let exposure = session.expose(&|_progress| {});
//! let error = exposure.film.error();
//! assert!(exposure.film.mean() > 0.0);
//! let picture = session.develop(&exposure, "a command, for the metadata");
//! # let folder = std::env::temp_dir().join(format!("ivcam-tour-{}", std::process::id()));
//! # std::fs::create_dir_all(&folder)?;
//! # let file = folder.join("livroom.png");
//! picture.save(&file, session.plan.depth)?;
//! # std::fs::remove_dir_all(&folder)?;
//! # Ok::<(), Box<dyn std::error::Error>>(())
//! ```
//!
//! # Units
//!
//! Scenes are in meters and lenses in millimeters; [`math::Meters`] and [`math::Mm`] stand where
//! the two meet. Angles are in radians and wavelengths in nanometers unless a name says otherwise.
//! Vectors and matrices are those of [`glam`], which is re-exported.

#![deny(unsafe_code)]
#![forbid(unsafe_op_in_unsafe_fn)]
#![deny(clippy::undocumented_unsafe_blocks)]
#![warn(missing_docs, unreachable_pub)]

mod archive;
mod catalog;
pub mod cli;
pub mod compare;
pub mod export;
mod farm;
pub mod movie;
pub mod photo;
mod stability;
// Without the window itself, only tests and `measure latency` drive what is in it.
#[cfg(feature = "panels")]
#[cfg_attr(not(feature = "viewer"), allow(dead_code))]
pub mod viewer;

pub use glam;
pub use ivcam_base::{diag, math, memory};
pub use ivcam_inventor::{grammar, iv, pose, snapshot};
pub use ivcam_optics::{film, lens, picture, prescription};
pub use ivcam_render::{camera, render, scene};

pub use camera::Camera;
pub use diag::{Diagnostic, ErrorKind};
pub use film::{Film, Resolution};
pub use iv::{Document, NodeRef};
pub use lens::Lens;
pub use photo::{Era, Optics, Plan, Session};
pub use picture::Picture;
pub use prescription::Prescription;
pub use scene::{CompileOptions, RenderScene};
pub use snapshot::Snapshot;

/// The program in the README, compiled.
#[cfg(doctest)]
#[doc = include_str!("../README.md")]
struct Readme;

// The fuzz targets are also part of the crate in `tests/fuzz/afl`, where they import from `ivcam`.
#[cfg(test)]
extern crate self as ivcam;

#[cfg(test)]
#[path = "../tests/fuzz/mod.rs"]
mod fuzz;

#[cfg(test)]
#[path = "../tests/internal/mod.rs"]
mod internal_tests;

#[cfg(test)]
#[path = "../tests/common/folder.rs"]
mod folder;
