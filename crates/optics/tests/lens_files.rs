//! Lens files as people have them: `tests/lenses/dialects` has a file for each dialect, and a table
//! of what becomes of it. Focal lengths in the table are computed by another program, a paraxial
//! trace of the same designs, and those of `.roa` and optiland files also by those programs.

use std::fmt::Write;
use std::path::PathBuf;
use std::sync::Arc;

use ivcam_base::diag::{Diagnostic, Severity, Sink, Source};
use ivcam_base::math::Meters;
use ivcam_optics::diagram::html_page;
use ivcam_optics::lens::{
    Aberrations, Breathing, FocusMethod, Lens, LensSheet, SheetSetting, open_prescription,
};
use ivcam_optics::prescription::formats;
use ivcam_optics::prescription::formats::write::{OutputFormat, write};
use ivcam_optics::prescription::{Prescription, Reading};

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
    let (text, _) = write(lens.prescription(), OutputFormat::Zemax).unwrap();
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

/// A doublet of Zemax with wavelengths, weights, a beam, a field and vignetting factors of its own.
const SYSTEM: &str = "VERS 1\nMODE SEQ\nNAME a\nUNIT MM\nENPD 10\nFTYP 0 0 3 3 0 0 0\nXFLN 0 0 0\n\
    YFLN 0 2.3 3.3\nVDYN 0 0 0.1\nVCYN 0 0 0.2\nWAVM 1 0.45 1\nWAVM 2 0.5876 2\nWAVM 3 0.6563 1\n\
    PWAV 2\nSURF 0\n  TYPE STANDARD\n  CURV 0\n  DISZ INFINITY\n\
    SURF 1\n  STOP\n  TYPE STANDARD\n  CURV 0.016\n  DISZ 6\n  GLAS SK16\n  DIAM 5\n\
    SURF 2\n  TYPE STANDARD\n  CURV -0.0225\n  DISZ 2.5\n  GLAS ___BLANK 1 0 1.7 47.1\n  DIAM 6\n\
    SURF 3\n  TYPE STANDARD\n  CURV -0.0075\n  DISZ 97\n  DIAM 6\n\
    SURF 4\n  TYPE STANDARD\n  CURV 0\n  DISZ 0\n";

fn read_text(name: &str, text: &str) -> (Prescription, Sink) {
    let source = Arc::new(Source::new(name, text.as_bytes().to_vec()));
    let mut sink = Sink::new();
    let mut lens = formats::read(&source, &mut sink).unwrap_or_else(|e| panic!("{text}: {e}"));
    let bare = |s: &mut ivcam_optics::prescription::Surface| s.span = Default::default();
    lens.surfaces.iter_mut().for_each(bare);
    lens.stated_f_number = None;
    (lens, sink)
}

#[test]
fn the_system_data_of_a_design_program_go_in_and_out() {
    let (lens, sink) = read_text("a.zmx", SYSTEM);
    let says = |words: &str| {
        sink.items()
            .iter()
            .filter(|d| d.message.contains(words))
            .count()
    };
    assert_eq!(says("vignetting factors are left out: VDYN, VCYN"), 1);
    assert_eq!(says("n_d and V_d alone of SK16"), 1);
    let (zemax, left_out) = write(&lens, OutputFormat::Zemax).unwrap();
    assert!(left_out.is_empty(), "{left_out:?}");
    for line in [
        "ENPD 10",
        "WAVM 1 0.45 1",
        "WAVM 2 0.5875618 2",
        "WAVM 3 0.6562725 1",
        "PWAV 2",
        "YFLN 0 2.31 3.3",
        "  GLAS SK16 0 0 1.62041 60.33",
        "  GLAS ___BLANK 1 0 1.7 47.1 0 0 0 0 0 0",
    ] {
        assert!(zemax.lines().any(|found| found == line), "{line}: {zemax}");
    }
    assert_eq!(read_text("a.zmx", &zemax).0, lens);
    let json = write(&lens, OutputFormat::Json).unwrap().0;
    assert_eq!(read_text("a.json", &json).0, lens);
    assert!(json.contains("\"V_d\": 47.1,"), "{json}");
    let (code_v, _) = write(&lens, OutputFormat::CodeV).unwrap();
    for line in [
        "WL 656.2725 587.5618 450",
        "REF 2",
        "WTW 1 2 1",
        "EPD 10",
        "YAN 0 2.31 3.3",
    ] {
        assert!(
            code_v.lines().any(|found| found == line),
            "{line}: {code_v}"
        );
    }
    assert!(
        code_v.contains(" 1.62041:60.33\n") && code_v.contains(" 1.7:47.1\n"),
        "{code_v}"
    );
    let (back, _) = read_text("a.seq", &code_v);
    assert_eq!(back.stated_beam, lens.stated_beam);
    assert_eq!(back.half_field, lens.half_field);
    // The order of the others is that of the file.
    let pairs = |lens: &Prescription| {
        let pairs = lens.wavelengths_nm.iter().zip(&lens.wavelength_weights);
        let mut pairs: Vec<(f64, f64)> = pairs.map(|(nm, weight)| (*nm, *weight)).collect();
        pairs[1..].sort_by(|a, b| a.0.total_cmp(&b.0));
        pairs
    };
    assert_eq!(
        pairs(&back),
        [(587.5618, 2.0), (450.0, 1.0), (656.2725, 1.0)]
    );
    assert_eq!(pairs(&lens), pairs(&back));
}

/// Half of the lens has half of the pupil; one that is stopped down has none that is stated.
#[test]
fn a_changed_lens_states_the_beam_that_it_has() {
    let (lens, _) = read_text("a.zmx", SYSTEM);
    let half = write(&lens.scaled(0.5), OutputFormat::Zemax).unwrap().0;
    assert!(half.contains("\nENPD 5\n"), "{half}");
    let closed = Lens::new(lens)
        .with_stop(ivcam_base::math::Mm(2.0))
        .unwrap();
    let closed = write(closed.prescription(), OutputFormat::Zemax).unwrap().0;
    assert!(
        closed.contains("\nFLOA\n") && !closed.contains("ENPD"),
        "{closed}"
    );
}

#[test]
fn what_is_left_out_of_a_lens_of_code_v_is_said() {
    let text = "RDM;LEN\nDIM M\nFNO 5\nWL 656.3 587.6 486.1\nREF 2\nWTW 1 2 1\nYRI 0 7 10\n\
        VUY 0 0 0.1\nVLY 0 0 0.2\nSO 0 1e14\nS 50 1 500.600\n STO\n CIR 10\nS 0 99 \n CIR 10\nSI 0 -0.1\nGO\n";
    let (lens, sink) = read_text("a.seq", text);
    for words in [
        "vignetting factors are left out",
        "the defocus of -0.1 at the image",
    ] {
        let found = sink.items().iter().filter(|d| d.message.contains(words));
        assert_eq!(found.count(), 1, "{words}");
    }
    let (code_v, left_out) = write(&lens, OutputFormat::CodeV).unwrap();
    assert!(left_out.is_empty(), "{left_out:?}");
    for line in ["FNO 5", "WTW 1 2 1", "YRI 0 7 10"] {
        assert!(
            code_v.lines().any(|found| found == line),
            "{line}: {code_v}"
        );
    }
    let zemax = write(&lens, OutputFormat::Zemax).unwrap().0;
    assert!(
        zemax.contains("FTYP 3 0 3 3 ") && zemax.contains("YFLN 0 7 10\n"),
        "{zemax}"
    );
    // A lens without a field: fields of 0, and a line that says so.
    let (lens, _) = read_text("a.dat", "50 1 1.5 20\n0 99 1 20\n");
    for target in [OutputFormat::Zemax, OutputFormat::CodeV] {
        let left_out = write(&lens, target).unwrap().1;
        assert!(
            left_out.iter().any(|what| what.contains("the field")),
            "{left_out:?}"
        );
    }
}

/// The same doublet in four formats, with a field of 4 degrees and an infrared primary wavelength.
/// Its sheet opens at both.
#[test]
fn the_field_and_the_wavelengths_of_a_file_are_those_of_its_sheet() {
    let zemax = "VERS 1\nMODE SEQ\nUNIT MM\nENPD 20\nFTYP 0 0 3 3 0 0 0\nYFLN 0 2 4 60\n\
        WAVM 1 0.9 1\nWAVM 2 1.0 1\nWAVM 3 1.2 1\nWAVM 4 0.55 1\nPWAV 2\n\
        SURF 0\n  TYPE STANDARD\n  CURV 0\n  DISZ INFINITY\n\
        SURF 1\n  STOP\n  TYPE STANDARD\n  CURV 0.016\n  DISZ 6\n  GLAS N-BK7\n  DIAM 12.7\n\
        SURF 2\n  TYPE STANDARD\n  CURV -0.0225\n  DISZ 2.5\n  GLAS N-SF6HT\n  DIAM 12.7\n\
        SURF 3\n  TYPE STANDARD\n  CURV -0.0075\n  DISZ 97\n  DIAM 12.7\n\
        SURF 4\n  TYPE STANDARD\n  CURV 0\n  DISZ 0\n";
    let code_v = "RDM;LEN\nDIM M\nEPD 20\nWL 1200 1000 900\nREF 2\nYAN 0 2 4\nSO 0 1e14\n\
        S 62.5 6 NBK7\n STO\n CIR 12.7\nS -44.444444 2.5 NSF6\n CIR 12.7\nS -133.33333 97\n \
        CIR 12.7\nSI 0 0\nGO\n";
    let oslo = "LEN NEW \"a\" 100 3\nEBR 10\nANG 4\nUNI 1.0\nWV 1.0 0.9 1.2\nAIR\nTH 1e20\n\
        NXT\nGLA N-BK7\nRD 62.5\nTH 6\nAP 12.7\nAST\nNXT\nGLA N-SF6\nRD -44.444444\nTH 2.5\n\
        AP 12.7\nNXT\nAIR\nRD -133.33333\nTH 97\nAP 12.7\nNXT\nAIR\nEND 4\n";
    for (name, text) in [("a.zmx", zemax), ("a.seq", code_v), ("a.len", oslo)] {
        let source = Arc::new(Source::new(name, text.as_bytes().to_vec()));
        let read = formats::read(&source, &mut Sink::new());
        let lens = Lens::new(read.unwrap_or_else(|e| panic!("{name}: {e}")));
        assert_eq!(lens.prescription().half_field, Some(4.0), "{name}");
        assert_eq!(lens.spectral_lines()[1], 587.5618, "{name}");
        let lens = lens.at_primary_wavelength();
        assert_eq!(lens.spectral_lines(), [900.0, 1000.0, 1200.0], "{name}");
        let sheet = LensSheet::of(&lens).unwrap();
        assert_eq!(sheet.lines_nm, [900.0, 1000.0, 1200.0], "{name}");
        assert!((sheet.half_field_degrees - 4.0).abs() < 1e-6, "{name}");
        let ends = [sheet.color[0], sheet.color[30]].map(|row| row.wavelength_nm);
        assert_eq!(ends, [900.0, 1200.0], "{name}");
    }
}

/// Lenses whose object is 300 mm in front of them and 8 mm high, in five formats. The sheet opens
/// at the image of its edge: traced chief rays near the axis have that magnification.
#[test]
fn a_field_of_the_object_is_its_image_on_the_sheet() {
    let zemax = "VERS 1\nMODE SEQ\nUNIT MM\nENPD 20\nFTYP 1 0 2 1 0 0 0\nXFLN 0 4.8 90\n\
        YFLN 0 6.4 90\nWAVM 1 0.5875618 1\nSURF 0\n  TYPE STANDARD\n  CURV 0\n  DISZ 260\n\
        SURF 1\n  TYPE STANDARD\n  CURV 0\n  DISZ 40\n\
        SURF 2\n  STOP\n  TYPE STANDARD\n  CURV 0.016\n  DISZ 6\n  GLAS N-BK7\n  DIAM 12.7\n\
        SURF 3\n  TYPE STANDARD\n  CURV -0.0225\n  DISZ 2.5\n  GLAS N-SF6\n  DIAM 12.7\n\
        SURF 4\n  TYPE STANDARD\n  CURV -0.0075\n  DISZ 97\n  DIAM 12.7\n\
        SURF 5\n  TYPE STANDARD\n  CURV 0\n  DISZ 0\n";
    let code_v = "RDM;LEN\nDIM M\nEPD 20\nWL 587.5618\nYOB 0 -8\nSO 0 300\nS 62.5 6 NBK7\n STO\n \
        CIR 12.7\nS -44.444444 2.5 NSF6\n CIR 12.7\nS -133.33333 97\n CIR 12.7\nSI 0 0\nGO\n";
    let oslo = "LEN NEW \"a\" 100 3\nEBR 10\nOBH -8\nUNI 1.0\nAIR\nTH 260\nNXT\nAIR\nTH 40\n\
        NXT\nGLA N-BK7\nRD 62.5\nTH 6\nAP 12.7\nAST\nNXT\nGLA N-SF6\nRD -44.444444\nTH 2.5\n\
        AP 12.7\nNXT\nAIR\nRD -133.33333\nTH 97\nAP 12.7\nNXT\nAIR\nEND 5\n";
    let shared = |name: &str, changes: [[&str; 2]; 3]| {
        let text = std::fs::read_to_string(folder().join(name)).unwrap();
        let change = |text: String, [from, to]: [&str; 2]| {
            assert!(text.contains(from), "{name}: {from}");
            text.replacen(from, to, 1)
        };
        changes.into_iter().fold(text, change)
    };
    let rayoptics = shared(
        "triplet.roa",
        [
            ["\"object\",\"angle\"", "\"object\",\"height\""],
            ["\"_value\":10.0", "\"_value\":8.0"],
            ["\"thi\":10000000000.0", "\"thi\":300.0"],
        ],
    );
    let optiland = shared(
        "triplet-optiland.json",
        [
            ["AngleField", "ObjectHeightField"],
            ["\"y\": 10,", "\"y\": 8,"],
            ["-Infinity", "-300.0"],
        ],
    );
    for (name, text) in [
        ("a.zmx", zemax),
        ("a.seq", code_v),
        ("a.len", oslo),
        ("a.roa", &rayoptics),
        ("a.json", &optiland),
    ] {
        let source = Arc::new(Source::new(name, text.as_bytes().to_vec()));
        let read = formats::read(&source, &mut Sink::new());
        let lens = Lens::new(read.unwrap_or_else(|e| panic!("{name}: {e}")));
        let focus = lens.focus(FocusMethod::Film, Meters(0.3)).unwrap();
        let setting = SheetSetting {
            focus: Some(&focus),
            ..SheetSetting::default()
        };
        let sheet = LensSheet::at(&lens, &setting).unwrap();
        let object = sheet.image_height / sheet.projection_scale.abs();
        assert_eq!(sheet.projection, "m y", "{name}");
        assert!((object / 8.0 - 1.0).abs() < 1e-5, "{name}: {object}");
    }
}

/// Files whose only field is the axis, as an angle, a height of the object and one of the image.
/// Their sheets have one height, and their copies the same field.
#[test]
fn a_field_of_0_is_the_axis_alone() {
    let zemax = |kind: u32| {
        format!(
            "VERS 1\nMODE SEQ\nUNIT MM\nENPD 20\nFTYP {kind} 0 1 1 0 0 0\nXFLN 0 60\nYFLN 0 60\n\
             WAVM 1 0.5875618 1\nSURF 0\n  TYPE STANDARD\n  CURV 0\n  DISZ INFINITY\n\
             SURF 1\n  STOP\n  TYPE STANDARD\n  CURV 0.016\n  DISZ 6\n  GLAS N-BK7\n  DIAM 12.7\n\
             SURF 2\n  TYPE STANDARD\n  CURV -0.0225\n  DISZ 2.5\n  GLAS N-SF6\n  DIAM 12.7\n\
             SURF 3\n  TYPE STANDARD\n  CURV -0.0075\n  DISZ 97\n  DIAM 12.7\n\
             SURF 4\n  TYPE STANDARD\n  CURV 0\n  DISZ 0\n"
        )
    };
    let read = |name: &str, text: String| {
        let source = Arc::new(Source::new(name, text.into_bytes()));
        formats::read(&source, &mut Sink::new()).unwrap_or_else(|e| panic!("{name}: {e}"))
    };
    for kind in [0, 1, 3] {
        let prescription = read("a.zmx", zemax(kind));
        assert_eq!(prescription.half_field, Some(0.0), "{kind}");
        for (name, target) in [
            ("a.zmx", OutputFormat::Zemax),
            ("a.seq", OutputFormat::CodeV),
            ("a.json", OutputFormat::Json),
        ] {
            let (copy, left_out) = write(&prescription, target).unwrap();
            let says = |what: &String| what.contains("field");
            assert!(!left_out.iter().any(says), "{name}: {left_out:?}");
            assert_eq!(read(name, copy).half_field, Some(0.0), "{name}");
        }
        let lens = Lens::new(prescription);
        let (sheet, all) = Aberrations::with_sheet(&lens, &SheetSetting::default()).unwrap();
        assert_eq!((sheet.image_height, sheet.half_field_degrees), (0.0, 0.0));
        let counts = [sheet.fields.len(), sheet.points.len(), all.points.len()];
        assert_eq!(counts, [1, 1, 1]);
        assert!(sheet.frequencies.last().is_some_and(|f| *f < 100.0));
        // The film is not at the paraxial focus.
        let scale = sheet.projection_scale / (lens.first_order().efl() + sheet.focus_shift);
        assert!((scale - 1.0).abs() < 1e-3, "{scale}");
        let is_known = |row: &Breathing| row.field_change_percent.is_none_or(f64::is_finite);
        assert!(sheet.breathing.iter().all(is_known));
        assert!(!html_page(&lens, Some(&sheet), Some(&all)).contains("NaN"));
    }
}

/// A curved image is not read, and a message says so in every format that can have one.
#[test]
fn a_curvature_of_the_image_is_said_to_be_left_out() {
    let zemax = |bend: &str| {
        format!(
            "VERS 1\nMODE SEQ\nENPD 5\nSURF 0\n  TYPE STANDARD\n  DISZ INFINITY\n\
             SURF 1\n  STOP\n  TYPE STANDARD\n  CURV 0.02\n  DISZ 5\n  GLAS N-BK7\n  DIAM 5\n\
             SURF 2\n  TYPE STANDARD\n  CURV 0\n  DISZ 90\n  DIAM 5\nSURF 3\n  TYPE STANDARD\n  CURV {bend}\n"
        )
    };
    let shared = |name: &str| std::fs::read_to_string(folder().join(name)).unwrap();
    let bent = |text: String, [from, to]: [&str; 2]| {
        let at = text.rfind(from).unwrap();
        format!("{}{to}{}", &text[..at], &text[at + from.len()..])
    };
    let (rayoptics, optiland) = (shared("triplet.roa"), shared("triplet-optiland.json"));
    for (name, flat, curved) in [
        ("a.zmx", zemax("0"), zemax("-0.01")),
        (
            "a.roa",
            rayoptics.clone(),
            bent(rayoptics, ["\"cv\":0.0", "\"cv\":-0.01"]),
        ),
        (
            "a.json",
            optiland.clone(),
            bent(optiland, ["\"radius\": Infinity", "\"radius\": -100.0"]),
        ),
    ] {
        for (text, is_said) in [(flat, false), (curved, true)] {
            let source = Arc::new(Source::new(name, text.into_bytes()));
            let mut sink = Sink::new();
            formats::read(&source, &mut sink).unwrap_or_else(|e| panic!("{name}: {e}"));
            let says = |d: &Diagnostic| d.message.contains("curvature of the image");
            assert_eq!(sink.items().iter().any(says), is_said, "{name}");
        }
    }
}

/// A field of the object without a finite object says nothing: the message says what to do.
#[test]
fn a_field_of_an_object_at_infinity_is_said_to_be_lost() {
    let text = "RDM;LEN\nDIM M\nEPD 20\nYOB 0 8\nS 62.5 6 NBK7\n STO\n CIR 12.7\n\
        S -44.444444 97\n CIR 12.7\nSI 0 0\nGO\n";
    let mut sink = Sink::new();
    let source = Arc::new(Source::new("a.seq", text.as_bytes().to_vec()));
    let lens = formats::read(&source, &mut sink).unwrap();
    assert_eq!((lens.image_height, lens.half_field), (None, None));
    let is_said = |d: &Diagnostic| d.message.contains("a height of the object");
    assert!(sink.items().iter().any(is_said));
}

/// A glass that is opaque in the visible is traced at its own wavelength, in the index that its
/// maker's catalogue has there.
#[test]
fn an_infrared_lens_is_read_and_traced_at_its_wavelength() {
    let text = "VERS 1\nMODE SEQ\nUNIT MM\nENPD 10\nWAVM 1 10 1\nPWAV 1\n\
        SURF 0\n  TYPE STANDARD\n  CURV 0\n  DISZ INFINITY\n\
        SURF 1\n  STOP\n  TYPE STANDARD\n  CURV 0.02\n  DISZ 3\n  GLAS GERMANIUM\n  DIAM 6\n\
        SURF 2\n  TYPE STANDARD\n  CURV 0\n  DISZ 50\n  DIAM 6\n\
        SURF 3\n  TYPE STANDARD\n  CURV 0\n";
    let source = Arc::new(Source::new("a.zmx", text.as_bytes().to_vec()));
    let read = formats::read(&source, &mut Sink::new());
    let lens = Lens::new(read.unwrap()).at_primary_wavelength();
    assert_eq!(lens.wavelength(), 10_000.0);
    // f = R/(n − 1) with n = 4.0032 at 10 µm.
    let efl = lens.first_order().efl();
    assert!((efl - 50.0 / 3.0032).abs() < 0.01, "{efl}");
    let sheet = LensSheet::of(&lens).unwrap();
    assert_eq!(sheet.lines_nm, [10_000.0; 3]);
    assert!(sheet.color.is_empty());
}

/// A table may name the glass in place of its index, under a heading or without one.
#[test]
fn a_table_may_name_glasses() {
    let open = |text: &str| {
        let source = Arc::new(Source::new("a.dat", text.as_bytes().to_vec()));
        formats::read(&source, &mut Sink::new())
    };
    let heading = "# radius thickness glass semi-diameter\n";
    for text in [
        "50 5 N-BK7 10\n-50 45 air 10\n",
        "50 5 N-BK7 20\n-50 45 1 20\n",
    ] {
        let text = match text.contains("air") {
            true => format!("{heading}{text}"),
            false => text.to_owned(),
        };
        let lens = open(&text).unwrap_or_else(|e| panic!("{text}: {e}"));
        assert_eq!(lens.surfaces[0].medium.name, "N-BK7", "{text}");
        assert_eq!(lens.surfaces[0].semi_diameter, 10.0, "{text}");
        assert_eq!(lens.surfaces[1].medium.n_d, 1.0, "{text}");
    }
    let error = open("50 5 N-XY99 20\n-50 45 1 20\n").unwrap_err();
    assert!(error.message.contains("N-XY99"), "{error}");
}

/// Two lenses of one glass, the second with pickups and a curvature that makes the beam of 5 mm
/// converge by 0.1, are those of the numbers that follow.
#[test]
fn pickups_and_solves_of_oslo_are_resolved() {
    let read = |numbers: [&str; 4]| {
        let [back, glass, gap, last] = numbers;
        let text = format!(
            "LEN NEW \"a\" 50 5\nEBR 5\nUNI 1.0\nAIR\nTH 1e20\nNXT\nGLA 1.5\nCVF 0.02\nTHF 5\nAST\n\
             NXT\nAIR\n{back}\nTH 10\nNXT\n{glass}\nRDF 100\n{gap}\nNXT\nAIR\n{last}\nNXT\nAIR\nEND 5\n"
        );
        let source = Arc::new(Source::new("a.len", text.into_bytes()));
        formats::read(&source, &mut Sink::new())
    };
    let lens = read(["PK CVM 1 .001", "PK GLA -2", "PK TH 1", "PU -0.1; PY 0"]).unwrap();
    // The marginal ray: n'u' = nu − yc(n' − n), from a height of 5 mm.
    let bends = [0.02, -0.019, 0.01];
    let (mut y, mut nu) = (5.0, 0.0);
    for (c, n, t) in [
        (bends[0], 1.5, 5.0),
        (bends[1], 1.0, 10.0),
        (bends[2], 1.5, 5.0),
    ] {
        let before = if n == 1.5 { 1.0 } else { 1.5 };
        nu -= y * c * (n - before);
        y += t * nu / n;
    }
    let last = (nu + 0.1) / (y * (1.0 - 1.5));
    for (surface, c) in lens
        .surfaces
        .iter()
        .zip([bends[0], bends[1], bends[2], last])
    {
        assert!(
            (surface.curvature.per_mm() - c).abs() < 1e-15,
            "{surface:?}"
        );
    }
    assert!((lens.surfaces[3].thickness - y / 0.1).abs() < 1e-12);
    let same = read(["CV -.019", "GLA 1.5", "TH 5", &format!("CV {last}")]).unwrap();
    let efl = |lens: Prescription| Lens::new(lens).first_order().efl();
    assert!((efl(lens) / efl(same) - 1.0).abs() < 1e-12);
    for wrong in ["PK LN 0 1", "PUC 0.1", "PK CV 4"] {
        assert!(read([wrong, "GLA 1.5", "TH 5", "CV 0"]).is_err(), "{wrong}");
    }
}

/// References to other surfaces are not followed: each is refused with its name.
#[test]
fn references_to_other_surfaces_are_refused_by_name() {
    let oslo = |command: &str| {
        format!(
            "LEN NEW \"a\" 50 3\nUNI 1.0\nAIR\nTH 1e20\nNXT\nRD 50\nTH 3\nGLA 1.5\nAP 9\nNXT\nAIR\nRD -80\nTH 4\n\
             AP 9\nTLA 3\n{command}\nNXT\nAIR\nTH 60\nNXT\nAIR\nEND 3\n"
        )
    };
    let code_v = |command: &str| {
        format!(
            "RDM;LEN\nSO 0 1e13\nS 50 3 1.5:60\n  CIR 9\nS -80 60\n  CIR 9\n  {command}\nSI 0 0\n"
        )
    };
    for (text, says) in [
        (oslo("RCO 1"), "`RCO 1` of surface 2"),
        (oslo("GTO 1"), "`GTO`"),
        (oslo("GCO 1"), "`GCO`"),
        (code_v("RET S1"), "`RET`: surface 2"),
        (code_v("GLB S1"), "`GLB`: surface 2"),
    ] {
        let source = Arc::new(Source::new("a", text.clone().into_bytes()));
        let error = formats::read(&source, &mut Sink::new()).expect_err(&text);
        assert!(error.message.contains(says), "{error}\n{text}");
    }
}
