//! A call of the program in this process, and pictures of small scenes.

use std::ffi::OsString;

use ivcam_optics::film::Resolution;

pub(crate) use crate::folder::Folder;
use crate::photo::{Era, Optics, Plan, Session};

/// Runs the program with a line of arguments without spaces in them, and more arguments; returns
/// the exit code.
pub(crate) fn ivcam(line: &str, more: &[&str]) -> i32 {
    let words = ["ivcam"].into_iter().chain(line.split_whitespace());
    crate::cli::run(words.chain(more.iter().copied()).map(OsString::from))
}

/// A plan of a scene of a folder without a lens, with pictures of 240×160 pixels.
pub(crate) fn pinhole_plan(folder: &Folder, scene: &str) -> Plan {
    let mut plan = Plan::of_era(Era::Modern, folder.path(scene));
    plan.optics = Optics::Pinhole;
    plan.resolution = Resolution::new(240, 160).expect("a size");
    plan
}

/// Returns the levels of some pixels of a plan's picture, and its session.
pub(crate) fn levels(plan: Plan, pixels: &[(usize, usize)]) -> (Vec<[u8; 3]>, Session) {
    let session = Session::open(plan).expect("the scene can be read");
    let picture = session.develop(&session.expose(&|_| {}), "");
    let level = |x: f32| (255.0 * x).round().clamp(0.0, 255.0) as u8;
    let width = picture.width as usize;
    let of = |(x, y): &(usize, usize)| picture.pixels[y * width + x].map(level);
    (pixels.iter().map(of).collect(), session)
}
