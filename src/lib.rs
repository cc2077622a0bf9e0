//! Photographs Open Inventor and VRML scenes through real lens prescriptions.
//!
//! Data moves one way. Bytes become a [`Document`]; a [`Snapshot`] is the document at one time;
//! a [`RenderScene`] is what a ray can hit; a lens prescription and a camera's pose become a
//! [`Camera`]; and a [`Film`] collects the radiance that the camera's rays bring. Each step can be
//! used alone. Nothing is global and nothing prints. A wrong file is a [`Diagnostic`] with its
//! place, and a ray that does not pass a lens is a [`Loss`](lens::Loss); neither is a panic.
//!
//! The parts can be used alone: [`ivcam_inventor`] reads, edits and writes scenes,
//! [`ivcam_optics`] opens lenses and traces rays, [`ivcam_compare`] compares pictures,
//! [`ivcam_render`] compiles and renders scenes.
//!
//! # A tour
//!
//! Read a scene. `document.sink` has its warnings, with file, line and column.
//!
//! ```
//! use ivcam::Document;
//!
//! let document = Document::open("scenes/livroom/livroom.iv")?;
//! for node in document.descendants().filter(|n| n.class_name() == "PerspectiveCamera") {
//!     let stated: Vec<_> = node.stated_fields().collect();
//!     println!("a camera states {stated:?}");
//! }
//! # Ok::<(), Box<ivcam::Diagnostic>>(())
//! ```
//!
//! Evaluate its engines at a time, and compile what can be seen.
//!
//! ```
//! # use ivcam::Document;
//! # let document = Document::open("scenes/livroom/livroom.iv")?;
//! use ivcam::{CompileOptions, RenderScene, scene, events::SnapshotOptions};
//!
//! let options = CompileOptions::default();
//! let snapshot = scene::snapshot(&document, &SnapshotOptions::default(), &options);
//! let compiled = RenderScene::compile(&snapshot, &options)?;
//! println!("{:?} in the box {:?}", compiled.primitives(), compiled.bounds());
//! # Ok::<(), Box<ivcam::Diagnostic>>(())
//! ```
//!
//! Convert it to the format of another program.
//!
//! ```
//! # use ivcam::Document;
//! # let document = Document::open("scenes/livroom/livroom.iv")?;
//! use ivcam::export::{ExportOptions, Target, convert};
//!
//! let converted = convert(&document, Target::Glb, &ExportOptions::default())?;
//! println!("{} bytes, {} losses", converted.bytes.len(), converted.losses.total());
//! # Ok::<(), Box<ivcam::Diagnostic>>(())
//! ```
//!
//! Look at a lens and trace rays through it. Lengths are in millimeters.
//!
//! ```
//! use ivcam::{Lens, glam::DVec3, lens::{LensRay, Toward}};
//!
//! let lens = Lens::open("double-gauss")?;
//! assert!((lens.first_order().efl() - 100.0).abs() < 1.0);
//! let ray = LensRay { origin: DVec3::new(0.0, 5.0, -50.0), direction: DVec3::Z };
//! println!("{:?}", lens.trace_all(&[ray], Toward::Film));
//! # Ok::<(), Box<ivcam::Diagnostic>>(())
//! ```
//!
//! Photograph the scene through it. A session reads and compiles the scene by itself.
//!
//! ```
//! use ivcam::math::{meters, mm};
//! use ivcam::photo::LensChoice;
//! use ivcam::render::Stop;
//! use ivcam::{Era, Optics, Plan, Resolution, Session};
//!
//! let mut plan = Plan::of_era(Era::Modern, "scenes/livroom/livroom.iv");
//! let lens = LensChoice { efl: Some(mm(60.0)), ..LensChoice::named("double-gauss") };
//! plan.optics = Optics::Lens(lens);
//! plan.focus = Some(meters(3.6));
//! plan.resolution = Resolution::new(18, 12)?;
//! plan.stop = Stop::after(4);
//! let session = Session::open(plan)?;
//! let exposure = session.expose(&|_progress| {});
//! let picture = session.develop(&exposure, "a command, for the metadata");
//! # let folder = std::env::temp_dir().join(format!("ivcam-tour-{}", std::process::id()));
//! # std::fs::create_dir_all(&folder)?;
//! # let (file, old) = (folder.join("livroom.png"), folder.join("livroom.png"));
//! picture.save(&file, session.plan.depth)?;
//!
//! // The picture as an array, with its error, and beside another picture.
//! let pixels: Vec<[f64; 3]> = exposure.film.pixels.iter().map(|p| p.mean.to_array()).collect();
//! println!("{} pixels, error {:?}", pixels.len(), exposure.film.error());
//! use ivcam::compare::{Options, Plate, compare};
//! let found = compare(&Plate::open(&file)?, &Plate::open(&old)?, &Options::default())?;
//! println!("{:?}", found.measures);
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
mod compare_folder;
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
pub use ivcam_inventor::{events, grammar, iv, pose, snapshot};
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
