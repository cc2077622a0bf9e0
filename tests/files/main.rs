//! Data-driven tests: one trial for every scene under `tests/golden`, every file under `tests/iv`
//! and every picture of the README and the guide.
//!
//! A trial has the name of its file, so `cargo test --test files golden/lights` runs the golden
//! pictures of one folder, `iv/reject` the files that must not read, and `guide` the guide's
//! pictures.
//!
//! To update golden pictures, run `UPDATE=1 cargo test --test files golden`, look at
//! `target/golden/sheet.png`, which shows the old picture, the new one and their difference in one
//! row for each picture that changed, and commit the references only if every new picture is right.

mod difference;
mod golden;
mod guide;
mod iv_files;
mod sheet;

use std::sync::Arc;

use libtest_mimic::Arguments;

fn main() {
    let arguments = Arguments::from_args();
    let changes = Arc::default();
    let mut trials = golden::trials(&changes);
    trials.extend(iv_files::trials());
    trials.extend(guide::trials());
    let conclusion = libtest_mimic::run(&arguments, trials);
    golden::finish(&changes);
    conclusion.exit();
}
