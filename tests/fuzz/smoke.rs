//! Runs every target on its seeds, on mutations of them, and on what fuzzers found.

use std::panic::{AssertUnwindSafe, catch_unwind};
use std::path::Path;

use super::mutate::{Dice, mutated};
use super::{TARGETS, Target};

/// Runs a target. A panic names the target and the input.
fn run(target: &Target, name: &str, bytes: &[u8]) {
    if catch_unwind(AssertUnwindSafe(|| (target.run)(bytes))).is_err() {
        let text = String::from_utf8_lossy(bytes);
        panic!("the target `{}` panics on {name}:\n{text}", target.name);
    }
}

/// Runs a target on at most `count` of its seeds, and on `5 count` mutations of any of them.
fn run_seeds_and_mutations(name: &str, count: usize) {
    let target = TARGETS.iter().find(|t| t.name == name).expect("a target");
    let (seeds, words) = ((target.seeds)(), (target.words)());
    assert!(!seeds.is_empty());
    for (name, bytes) in seeds.iter().step_by(seeds.len().div_ceil(count)) {
        run(target, name, bytes);
    }
    let mut dice = Dice(1);
    for number in 0..5 * count {
        let (name, seed) = &seeds[dice.below(seeds.len())];
        let bytes = mutated(seed, &words, &mut dice);
        run(target, &format!("mutation {number}, of {name}"), &bytes);
    }
}

#[test]
fn damaged_scenes_are_written_and_read_again_as_the_same_document() {
    run_seeds_and_mutations("scene", 200);
}

#[test]
fn damaged_scenes_are_rendered_without_nan() {
    run_seeds_and_mutations("picture", 20);
}

#[test]
fn damaged_textures_and_fonts_are_used_or_refused() {
    run_seeds_and_mutations("texture", 12);
    run_seeds_and_mutations("font", 6);
}

#[test]
fn damaged_prescriptions_and_catalogues_are_read_or_refused() {
    run_seeds_and_mutations("lens", 60);
    run_seeds_and_mutations("glass", 60);
}

#[test]
fn damaged_cameras_timelines_films_and_tables_are_read_or_refused() {
    for name in ["camera", "timeline", "film", "curves"] {
        run_seeds_and_mutations(name, 200);
    }
}

#[test]
fn damaged_command_lines_are_plans_that_print_as_themselves_or_are_refused() {
    run_seeds_and_mutations("options", 200);
}

/// The inputs that a fuzzer found, by target: `findings/TARGET/NAME`.
#[test]
fn every_finding_of_a_fuzzer_is_corrected() {
    let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/fuzz/findings");
    let mut count = 0;
    for target in &TARGETS {
        let entries = std::fs::read_dir(folder.join(target.name));
        for entry in entries.into_iter().flatten().flatten() {
            let name = entry.file_name().to_string_lossy().into_owned();
            run(target, &name, &std::fs::read(entry.path()).expect("read"));
            count += 1;
        }
    }
    assert!(count > 0, "no findings in {}", folder.display());
}
