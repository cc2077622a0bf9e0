//! Lens files as people have them: `tests/lenses/dialects` has a file for each dialect, and a table
//! of what becomes of it. Focal lengths in the table are computed by another program, a paraxial
//! trace of the same designs, and those of `.roa` and optiland files also by those programs.

use std::fmt::Write;
use std::path::PathBuf;
use std::sync::Arc;

use ivcam_base::diag::{Severity, Sink, Source};
use ivcam_optics::lens::{Lens, open_prescription};
use ivcam_optics::prescription::Reading;
use ivcam_optics::prescription::formats;
use ivcam_optics::prescription::formats::write::{Target, write};

use super::folder::Folder;

fn folder() -> PathBuf {
    PathBuf::from(env!("CARGO_MANIFEST_DIR")).join("../../tests/lenses/dialects")
}

/// A row of the table: the file, what becomes of it, the focal length in millimeters or `-`, and
/// words of a message, or nothing.
struct Row<'a> {
    file: &'a str,
    fate: &'a str,
    focal_length: Option<f64>,
    says: &'a str,
}

fn rows(table: &str) -> Vec<Row<'_>> {
    let lines = table.lines().filter(|line| !line.starts_with('#'));
    let row = |line| {
        let parts: Vec<&str> = str::split(line, '|').map(str::trim).collect();
        let [file, fate, focal_length, says] = parts[..] else {
            panic!("{line}");
        };
        Row {
            file,
            fate,
            focal_length: focal_length.parse().ok(),
            says,
        }
    };
    lines.map(row).collect()
}

#[test]
fn files_in_all_dialects_are_read_warned_of_or_refused_as_the_table_says() {
    let table = std::fs::read_to_string(folder().join("TABLE.txt")).unwrap();
    let rows = rows(&table);
    assert!(rows.len() >= 60, "{}", rows.len());
    let mut wrong = String::new();
    for row in &rows {
        let mut sink = Sink::new();
        let result = open_prescription(folder().join(row.file), &Reading::default(), &mut sink);
        let warned = sink.items().iter().any(|d| d.severity == Severity::Warning);
        let fate = match (&result, warned) {
            (Err(_), _) => "refused",
            (Ok(_), true) => "warned",
            (Ok(_), false) => "read",
        };
        let mut messages: Vec<String> = sink.items().iter().map(|d| d.message.clone()).collect();
        if let Err(error) = &result {
            messages.push(error.message.clone());
            messages.extend(error.help.clone());
            let (_, place) = error.location();
            assert!(place.is_some(), "{}: {error} has no place", row.file);
        }
        let says = messages.iter().any(|m| m.contains(row.says)) || row.says.is_empty();
        let efl = result.map(|lens| Lens::new(lens).first_order().focal.map(|f| f.efl));
        let efl = efl.ok().flatten();
        let right = match (efl, row.focal_length) {
            // Glasses that a file names have catalogue indices of five places.
            (Some(found), Some(stated)) => (found / stated - 1.0).abs() < 1e-5,
            (None, None) => true,
            _ => false,
        };
        if fate != row.fate || !says || !right {
            writeln!(
                wrong,
                "{}: {fate}, {efl:?}; {}",
                row.file,
                messages.join("; ")
            )
            .unwrap();
        }
    }
    assert!(wrong.is_empty(), "{wrong}");
}

#[test]
fn every_file_is_in_the_table() {
    let table = std::fs::read_to_string(folder().join("TABLE.txt")).unwrap();
    let rows = rows(&table);
    for entry in std::fs::read_dir(folder()).unwrap() {
        let name = entry.unwrap().file_name().to_string_lossy().into_owned();
        let listed = rows.iter().any(|row| row.file == name);
        assert!(listed || name == "TABLE.txt", "{name}");
    }
}

/// The positions of a zoom in the text of the Optical Bench.
#[test]
fn a_zoom_of_the_optical_bench_has_its_positions() {
    let file = folder().join("tele-bench-zoom.txt");
    let lens = open_prescription(file, &Reading::default(), &mut Sink::new()).unwrap();
    assert_eq!(lens.zoom.len(), 2);
    assert_eq!(lens.zoom[1].gaps[0], (2, 36.0));
    let at = |i: usize| Lens::new(lens.at_zoom(i).unwrap());
    let stated = |i: usize| {
        lens.zoom[i]
            .name
            .split(' ')
            .next()
            .unwrap()
            .parse::<f64>()
            .unwrap()
    };
    for i in 0..2 {
        let efl = at(i).first_order().focal.unwrap().efl;
        assert!((efl - stated(i)).abs() < 1e-3, "{i}: {efl}");
    }
    assert!(stated(0) != stated(1));
}

/// A file of ray-optics states its unit beside the surfaces.
#[test]
fn a_file_of_ray_optics_may_be_in_inches() {
    let text = std::fs::read_to_string(folder().join("gauss.roa")).unwrap();
    let focal_length = |unit: &str| {
        let stated = format!("\"_dimensions\":\"{unit}\"");
        let text = text.replace("\"_dimensions\":\"mm\"", &stated);
        assert!(text.contains(&stated));
        let source = Arc::new(Source::new("gauss.roa", text.into_bytes()));
        let lens = formats::read(&source, &mut Sink::new());
        lens.map(|lens| Lens::new(lens).first_order().efl())
    };
    let millimeters = focal_length("mm").unwrap();
    for (unit, factor) in [("inches", 25.4), ("in", 25.4), ("cm", 10.0), ("m", 1000.0)] {
        let ratio = focal_length(unit).unwrap() / millimeters;
        assert!((ratio / factor - 1.0).abs() < 1e-12, "{unit}: {ratio}");
    }
    let error = focal_length("furlong").unwrap_err();
    assert!(
        error.message.contains("`furlong` is not a unit of length"),
        "{error}"
    );
}

/// The aperture of a file may be meant by paraxial rays or by real rays, which differ by 4% in this
/// lens. Only a number that is neither is a contradiction.
#[test]
fn a_stated_f_number_may_be_that_of_real_rays_or_of_paraxial_ones() {
    let lens = Lens::named("angenieux-50").unwrap();
    let (paraxial, real) = (lens.first_order().f_number(), lens.real_f_number());
    let (paraxial, real) = (paraxial.unwrap(), real.unwrap());
    assert!((paraxial / real - 1.0).abs() > 0.03, "{paraxial} {real}");
    let (text, _) = write(lens.prescription(), Target::Zemax).unwrap();
    let scratch = Folder::new("stated-f-number");
    let warnings = |f_number: f64| -> Vec<String> {
        let stated = format!("MODE SEQ\nFNUM {f_number} 0\n");
        let file = scratch.file("stated.zmx", &text.replacen("MODE SEQ\n", &stated, 1));
        let mut sink = Sink::new();
        open_prescription(file, &Reading::default(), &mut sink).unwrap();
        let items = sink.items().iter();
        items
            .map(|d| d.message.clone())
            .filter(|m| m.contains("the file states"))
            .collect()
    };
    assert!(warnings(paraxial).is_empty() && warnings(real).is_empty());
    for wrong in [0.5 * (paraxial + real), 2.0 * real] {
        let found = warnings(wrong);
        let both = [paraxial, real]
            .iter()
            .all(|n| found[0].contains(&format!("f/{n:.3}")));
        assert!(both, "{found:?}");
    }
}
