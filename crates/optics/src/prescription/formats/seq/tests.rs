use std::sync::Arc;

use ivcam_base::diag::{Result, Sink, Source, Span};

use crate::prescription::formats::reader::PrescriptionReader;
use crate::prescription::formats::reading::Reading;
use crate::prescription::formats::seq::reader;
use crate::prescription::prescription::Prescription;
use crate::prescription::surface::Shape;

fn parse(text: &str) -> Result<Prescription> {
    let source = Arc::new(Source::new("a.seq", text.as_bytes().to_vec()));
    read(&source, &mut Sink::new())
}

fn read(source: &Arc<Source>, sink: &mut Sink) -> Result<Prescription> {
    let options = &Reading::default();
    reader::read(PrescriptionReader { source, options }, sink)
}

#[test]
fn surfaces_are_read_in_either_mode_and_any_unit() {
    let text = |mode: &str, bend: &str| {
        format!(
            "{mode};LEN \"VERSION\"\nTITLE 'A; lens'\nDIM I\nEPD 1.0 ; YAN 0 10\nSO 0 1e14\n\
             S {bend} 0.25 NBK7_SCHOTT\n  CIR 0.5\nS 0 0.5 517642 ! flat\n  STO; CIR 0.4\n\
             S -{bend} &\n 2.0\n  ASP; K -1.0; A 0.5;&\n  B 0.25\n  CIR 0.6\nSI 0 0\n  XDE 0\nGO\n"
        )
    };
    for lens in [
        parse(&text("RDM", "2")).unwrap(),
        parse(&text("RDM N", ".5")).unwrap(),
    ] {
        assert_eq!((lens.name.as_str(), lens.surfaces.len()), ("A; lens", 3));
        let [first, second, third] = &lens.surfaces[..] else {
            panic!()
        };
        assert!((first.curvature.radius() - 50.8).abs() < 1e-12);
        assert_eq!(first.medium.name, "N-BK7");
        assert_eq!(lens.stop(), Some(1));
        assert_eq!(second.medium.n_d, 1.517);
        assert!((second.medium.abbe().unwrap() - 64.2).abs() < 1e-9);
        assert!(matches!(&third.shape, Shape::Asphere { k, terms }
            if *k == -1.0 && (terms[6] * 25.4_f64.powi(5) - 0.25).abs() < 1e-12));
        assert_eq!(third.thickness, 50.8);
    }
}

#[test]
fn a_file_that_does_not_state_radii_or_curvatures_is_warned_of() {
    let text = "SO 0 1e9\nS .2 3 NBK7\n STO\n CIR 1\nS -.2 5\nSI 0 0\n";
    for (mode, count) in [("", 1), ("RDM\n", 0), ("RDM N\n", 0)] {
        let found = warnings(&format!("{mode}{text}"));
        let found = found.iter().filter(|m| m.contains("radii or curvatures"));
        assert_eq!(found.count(), count, "{mode}");
    }
}

#[test]
fn a_command_continues_after_an_ampersand_with_windows_line_ends_too() {
    let text = "RDM\r\nSO 0 1e9\r\nS 10 &\r\n 3 NBK7\r\n STO\r\n CIR 4\r\nS -9 5\r\nSI 0 0\r\n";
    assert_eq!(parse(text).unwrap().surfaces[0].thickness, 3.0);
}

#[test]
fn a_private_glass_is_its_table() {
    let lens = parse(
        "RDM\nPRV\n PWL 700 656.2725 587.5618 486.1327 400\n 'E48' 1.52 1.528 1.531 1.538&\n \
         1.55\nEND\nSO 0 1e9\nS 10 3 'E48'\n STO\n CIR 4\nS -10 5\n CIR 4\nSI 0 0\n",
    )
    .unwrap();
    assert_eq!(lens.surfaces[0].medium.n_d, 1.531);
    assert!((lens.surfaces[0].medium.abbe().unwrap() - 53.1).abs() < 1e-9);
}

#[test]
fn a_private_glass_may_be_a_laurent_series() {
    let text = |series: &str| {
        format!(
            "RDM\nPRV\n PWL 587.6\n 'W' LAU {series}\nEND\nSO 0 1e9\nS 10 3 'W'\n STO\n CIR 4\nS -10 5\n \
             CIR 4\nSI 0 0\n"
        )
    };
    let lens = parse(&text("1.7614 -0.0135 0.0066 5e-5")).unwrap();
    let um2 = 0.5875618_f64.powi(2);
    let square = 1.7614 - 0.0135 * um2 + 0.0066 / um2 + 5e-5 / (um2 * um2);
    assert!((lens.surfaces[0].medium.n_d - square.sqrt()).abs() < 1e-9);
    let error = parse(&text("-1")).unwrap_err();
    assert!(error.message.contains("`W` has no index"), "{error}");
}

#[test]
fn what_can_not_be_traced_is_refused_by_name_and_place() {
    let around = |inner: &str| format!("RDM\nSO 0 1e9\nS 10 3 NBK7\n{inner}\nSI 0 0\n");
    for (inner, says, at) in [
        (" ADE x", "`x` is not a number", (4, 6)),
        ("S 0 2 REFR_REFL", "mirror", (4, 7)),
        (" RMD TIR", "`RMD TIR` of surface 1", (4, 6)),
        (" DIF DOE", "`DIF` diffracts", (4, 2)),
        (" RET S1", "`RET`: surface 1 returns", (4, 2)),
        ("S 0 2 NBK77", "no glass named `NBK77`", (4, 7)),
        ("S 0", "too few", (4, 4)),
        ("S x 2", "not a number", (4, 3)),
        (" STO\nS 5 2\n STO", "second stop", (5, 3)),
    ] {
        let error = parse(&around(inner)).unwrap_err();
        assert!(error.message.contains(says), "{inner}: {}", error.message);
        assert_eq!(error.location().1, Some(at), "{inner}");
    }
}

#[test]
fn a_lens_without_apertures_gets_those_of_its_beam() {
    let text = "RDM\nEPD 10\nYAN 0 5\nSO 0 1e9\nS 50 3 NBK7\n STO\nS -50 48\nSI 0 0\n";
    let lens = parse(text).unwrap();
    assert_eq!(lens.surfaces[0].semi_diameter, 5.0);
    assert!((4.5..5.5).contains(&lens.surfaces[1].semi_diameter));
}

/// The same lens three times: each surface with its commands, by numbers, and by commands alone.
#[test]
fn a_command_may_name_its_surface() {
    let plain = "RDM\nTIT 'a ! b'\nSO 0 1e9\nS 50 5 517642\n STO\n CIR 9\n ASP\n K -1\n A 1e-6\n\
                 S -80 60\n CIR 8\nSI 0 0\n";
    let numbered = "RDM\nTIT 'a ! b'\nS0 0 1e9\nS1 50 5 700300\nS2 -80 60\nSI 0 0\nSTO S1\n\
                    CIR S1..2 9\nCIR S2 8\nGLA S1 517642\nASP S1 K -1 A 1e-6\n";
    let commands = "RDM N\nTIT 'a ! b'\nSO\nS 0 1 517642\n RDY 50; THI 5; STO; CIR 9\n ASP K -1 A 1e-6\n\
                    S 0 60\n RDY -80\n CIR 8\nSI\n";
    let bare = |text| {
        let mut lens = parse(text).unwrap();
        lens.surfaces
            .iter_mut()
            .for_each(|s| s.span = Span::default());
        lens
    };
    assert_eq!(bare(numbered), bare(plain));
    assert_eq!(bare(commands), bare(plain));
    assert_eq!(bare(plain).name, "a ! b");
    for (command, says) in [
        ("CIR S3 5", "no surface `S3`"),
        ("ADE S3 5", "no surface `S3`"),
        ("ZOO 2\nZOO THI S7 1 2", "no surface `S7`"),
    ] {
        let error = parse(&format!("{numbered}{command}\n")).unwrap_err();
        assert!(error.message.contains(says), "{command}: {error}");
    }
    // A tilt by 0 is not a tilt.
    let text = format!("{numbered}ADE S2 0\nXDE S1 0.0\n");
    assert!(!parse(&text).unwrap().is_decentered());
    let tilted = parse(&format!("{numbered}ADE S2 5\nDAR S2\n")).unwrap();
    let frame = tilted.surfaces[1].frame.as_deref().unwrap();
    assert_eq!((frame.before.tilt.x, frame.after.tilt.x), (-5.0, 5.0));
}

#[test]
fn a_hole_is_closed_as_an_obstruction_is() {
    let text = |hole: &str| {
        format!(
            "RDM\nEPD 100\nSO 0 1e13\nS -400 -150 REFL\nSTO\nCIR 52\n{hole}\nS -150 150 REFL\nCIR 14\nSI 0 0\n"
        )
    };
    for (hole, closed) in [("CIR HOL 10", 10.0), ("CIR OBS 10", 10.0), ("", 0.0)] {
        let first = &parse(&text(hole)).unwrap().surfaces[0];
        assert_eq!(
            (first.semi_diameter, first.obstruction),
            (52.0, closed),
            "{hole}"
        );
    }
}

#[test]
fn zoom_positions_may_change_gaps_and_the_stop() {
    let text = "RDM\nSO 0 1e9\nS 50 5 517642\n CIR 9\nS 0 2\n STO\n CIR 5\nS -80 60\n CIR 8\nSI 0 0\n\
                ZOO 2\nZOO THI S2 2 4\nZOO CIR S2 5 4\n";
    let lens = parse(text).unwrap();
    assert_eq!(lens.zoom[1].gaps, [(1, 4.0)]);
    assert_eq!(lens.zoom[1].stop_semi_diameter, Some(4.0));
}

/// The lines of N-BK7 rounded as catalogues print wavelengths, and none of them in the visible.
#[test]
fn a_private_glass_has_its_indices_at_any_wavelengths() {
    let text = |table: &str| {
        format!("RDM\nPRV\n{table}\nEND\nSO 0 1e9\nS 50 5 'G'\n STO\n CIR 9\nS -80 60\nSI 0 0\n")
    };
    let glass = |table: &str| parse(&text(table)).map(|lens| lens.surfaces[0].medium.clone());
    let lines = glass("PWL 656.27 587.56 486.13\n'G' 1.51432 1.5168 1.52238").unwrap();
    assert_eq!(lines.n_d, 1.5168);
    assert!((lines.abbe().unwrap() - 0.5168 / 0.00806).abs() < 1e-9);
    assert_eq!(glass("PWL 587.6\n'G' 1.6").unwrap().n_d, 1.6);
    // Sparse, and without the line itself: Malitson's silica is 1.458464 there.
    let sparse =
        glass("PWL 404.7 486.1 546.1 643.8 706.5\n'G' 1.46961 1.46313 1.46008 1.45670 1.45515");
    assert!((sparse.unwrap().n_d - 1.458464).abs() < 1e-5);
    // Of the infrared alone, it has the index that is nearest to the line.
    let infrared = "PWL 1310 1064\n'G' 1.44 1.45";
    assert_eq!(glass(infrared).unwrap().n_d, 1.45);
    let warned = warnings(&text(infrared));
    assert!(
        warned
            .iter()
            .any(|m| m.contains("at 588 nm is extrapolated")),
        "{warned:?}"
    );
}

fn warnings(text: &str) -> Vec<String> {
    let source = Arc::new(Source::new("a.seq", text.as_bytes().to_vec()));
    let mut sink = Sink::new();
    read(&source, &mut sink).unwrap_or_else(|e| panic!("{e}"));
    sink.items().iter().map(|d| d.message.clone()).collect()
}

#[test]
fn zoom_positions_that_change_what_is_not_read_are_warned_of_once() {
    let text = "RDM\nSO 0 1e13\nS 50 5 517642\nSTO\nCIR 5\nS -80 60\nCIR 6\nSI 0 0\nZOO 2\n\
                ZOO THI S2 60 61\nZOO YDE S1 0 1\nZOO YDE S2 0 1\nZOO ADE S1 0 1\nZOO TIT 'a' 'b'\n";
    let found = warnings(text);
    let found = found.iter().filter(|m| m.contains("zoom positions"));
    let found: Vec<&str> = found.filter_map(|m| m.split('`').nth(1)).collect();
    assert_eq!(found, ["YDE", "ADE"]);
}

#[test]
fn pickups_and_solves_are_warned_of_once() {
    let text = |more: &str| {
        format!(
            "RDM\nSO 0 1e13\nS 50 5 517642\nSTO\nCIR 10\nS -50 100\nCIR 10\n{more}\nSI 0 0\nGO\n"
        )
    };
    let found = |more: &str| {
        let about = |text: &String| text.contains("pickups and solves");
        warnings(&text(more))
            .iter()
            .filter(|text| about(text))
            .count()
    };
    assert_eq!(found("PIK CUY S2 S1 -1\nUMY S2 -0.1"), 1);
    assert_eq!(found("PIM"), 0);
}

#[test]
fn commands_that_move_or_change_surfaces_are_refused() {
    let text = |command: &str| {
        format!(
            "RDM\nSO 0 1e13\nS 50 5 517642\nSTO\nCIR 5\nS -80 60\nCIR 6\nADE 3\n{command}\nSI 0 0\n"
        )
    };
    assert!(parse(&text("YOD 0")).is_ok());
    for command in [
        "YOD 2",
        "XOD S1 2",
        "SCL 2",
        "DEL S1",
        "INS S1",
        "FLY S1..2",
    ] {
        let error = parse(&text(command)).expect_err(command);
        assert!(error.message.contains(&command[..3]), "{error}");
    }
    assert!(parse(&format!("{}SCL 2\n", text(""))).is_err());
}

#[test]
fn a_field_in_x_and_y_is_the_diagonal() {
    let lens = |fields: &str| {
        parse(&format!(
            "RDM\nEPD 5\n{fields}\nSO 0 200\nS 50 5 517642\nSTO\nS -80 60\nSI 0 0\n"
        ))
        .unwrap()
    };
    assert_eq!(lens("XIM 0 3 0\nYIM 0 4 4.5").image_height, Some(5.0));
    let half = lens("XAN 0 10\nYAN 0 10").half_field.unwrap();
    let diagonal = 2f64.sqrt() * libm::tan(10f64.to_radians());
    assert!(
        (libm::tan(half.to_radians()) - diagonal).abs() < 1e-12,
        "{half}"
    );
    let [x, both] =
        ["XOB 0 5", "XOB 0 3\nYOB 0 4"].map(|fields| lens(fields).image_height.unwrap());
    assert!((x - both).abs() < 1e-12, "{x} {both}");
}

/// A private glass with an index at the wavelength of the file has that index there.
#[test]
fn a_private_glass_has_all_indices_of_its_table() {
    let text = |table: &str| {
        format!(
            "RDM\nEPD 10\nWL 1550\nPRV\n{table}\nEND\nSO 0 1e13\nS 50 5 MYGL\nSTO\nCIR 10\nS -80 60\nCIR 10\n\
             SI 0 0\n"
        )
    };
    let whole =
        text("PWL 1550 1064 656.3 587.6 486.1\n'MYGL' 1.50066 1.50664 1.51432 1.51680 1.52238");
    let lens = parse(&whole).unwrap();
    assert_eq!(lens.surfaces[0].medium.index(1550.0), 1.50066);
    assert_eq!(lens.surfaces[0].medium.index(587.5618), 1.51680);
    let warned = |text: &str| {
        warnings(text)
            .iter()
            .any(|m| m.contains("1550 nm is extrapolated"))
    };
    assert!(!warned(&whole));
    assert!(warned(&text(
        "PWL 656.3 587.6 486.1\n'MYGL' 1.51432 1.51680 1.52238"
    )));
}
