use std::sync::Arc;

use ivcam_base::diag::{Result, Sink, Source, Span};

use crate::prescription::formats::reader::PrescriptionReader;
use crate::prescription::formats::reading::Reading;
use crate::prescription::formats::zmx::reader;
use crate::prescription::prescription::Prescription;
use crate::prescription::surface::Shape;

fn parse(text: &str) -> Result<Prescription> {
    let source = Arc::new(Source::new("a.zmx", text.as_bytes().to_vec()));
    read(&source, &mut Sink::new())
}

fn read(source: &Arc<Source>, sink: &mut Sink) -> Result<Prescription> {
    let options = &Reading::default();
    reader::read(PrescriptionReader { source, options }, sink)
}

fn file(surfaces: &str, rest: &str) -> String {
    format!(
        "VERS 1\nMODE SEQ\nNAME A lens\nNOTE 0 of no patent\nUNIT CM X\nENPD 1\n\
         SURF 0\n  TYPE STANDARD\n  DISZ INFINITY\n{surfaces}\
         SURF 9\n  TYPE STANDARD\n  CURV 0\n{rest}"
    )
}

#[test]
fn surfaces_glasses_and_units_are_read() {
    let lens = parse(&file(
        "SURF 1\n  TYPE STANDARD\n  CURV 0\n  DISZ 3\n  DIAM 9\n\
         SURF 2\n  STOP\n  TYPE STANDARD\n  CURV 0.5\n  DISZ 1\n  GLAS N-BK7 0 0 1.5 40\n  DIAM 1\n\
         SURF 3\n  TYPE EVENASPH\n  CURV -0.5\n  CONI -1\n  PARM 2 0.25\n  DISZ 0.5\n  DIAM 1\n\
         SURF 4\n  TYPE XOSPHERE\n  CURV 0.1\n  GLAS ___BLANK 1 0 1.7 30\n  DISZ 1\n  DIAM 1\n  \
         XDAT 1 3\n  XDAT 2 2.0\n  XDAT 5 0.8\n\
         SURF 5\n  TYPE TOROIDAL\n  CURV 0.1\n  PARM 1 5\n  DISZ 7\n  DIAM 1\n",
        "MNUM 2 1\nTHIC 3 1 0.5 0 0\nTHIC 3 2 0.75 0 0\n",
    ))
    .unwrap();
    assert_eq!((lens.name.as_str(), lens.surfaces.len()), ("A lens", 4));
    assert_eq!(lens.notes, ["of no patent"]);
    let [first, second, third, fourth] = &lens.surfaces[..] else {
        panic!()
    };
    assert_eq!(
        (lens.stop(), first.medium.name.as_str()),
        (Some(0), "N-BK7")
    );
    assert_eq!(
        (
            first.curvature.radius(),
            first.thickness,
            first.semi_diameter
        ),
        (20.0, 10.0, 10.0)
    );
    // 0.25 cm⁻³ is 0.25e-3 mm⁻³.
    assert!(
        matches!(&second.shape, Shape::Asphere { k, terms } if *k == -1.0
        && (terms[4] - 0.25e-3).abs() < 1e-18)
    );
    assert!(
        matches!(&third.shape, Shape::Asphere { terms, .. } if (terms[3] - 1e-3).abs() < 1e-18)
    );
    assert!((third.medium.abbe().unwrap() - 30.0).abs() < 1e-9);
    assert!(matches!(&fourth.shape, Shape::Toroid { across, .. } if across.radius() == 50.0));
    assert_eq!(lens.zoom.len(), 2);
    assert_eq!(lens.zoom[1].gaps, [(1, 7.5)]);
}

#[test]
fn what_can_not_be_traced_is_refused_by_name_and_line() {
    for (lines, says, line) in [
        ("  TYPE COORDBRK\n  PARM 3 x\n", "`x` is not a number", 12),
        ("  TYPE PARAXIAL\n", "has no focal length", 10),
        ("  TYPE PARAX_XY\n", "an ideal lens of two powers", 11),
        ("  TYPE DGRATING\n", "grating", 11),
        (
            "  TYPE STANDARD\n  GLAS N-BK77 0 0 1.5 40\n",
            "no glass named `N-BK77`",
            12,
        ),
        ("  TYPE STANDARD\n  CURV nan\n", "not a number", 12),
        (
            "  TYPE STANDARD\n  GLAS ___BLANK 1 0 0.5 40\n  DIAM 1\n",
            "less than 1",
            12,
        ),
    ] {
        let error = parse(&file(&format!("SURF 1\n{lines}"), "")).unwrap_err();
        assert!(error.message.contains(says), "{lines}: {}", error.message);
        assert_eq!(error.location().1.unwrap().0, line, "{lines}");
    }
    assert!(parse("MODE NSC\n").unwrap_err().message.contains("mode"));
    assert!(
        parse("SURF 0\n")
            .unwrap_err()
            .message
            .contains("no surfaces")
    );
}

/// A dummy plane divides a gap: configurations may change either part of it.
#[test]
fn a_gap_of_a_configuration_counts_the_dummies_in_it() {
    let glass = "TYPE STANDARD\n  GLAS N-BK7 0 0 1.5 40";
    let lens = parse(&file(
        &format!(
            "SURF 1\n  {glass}\n  CURV 0.5\n  DISZ 1\n  DIAM 1\n\
             SURF 2\n  TYPE STANDARD\n  CURV 0\n  DISZ 2\n  DIAM 1\n\
             SURF 3\n  TYPE STANDARD\n  CURV 0\n  DISZ 4\n  DIAM 1\n\
             SURF 4\n  STOP\n  TYPE STANDARD\n  CURV 0\n  DISZ 3\n  DIAM 1\n"
        ),
        "MNUM 2 1\nMOFF 0 1 \"\" 0\nTHIC 2 1 2 0 0\nTHIC 2 2 5 0 0\nSDIA 4 2 0.5 0 0\n",
    ))
    .unwrap();
    assert_eq!(lens.surfaces.len(), 3);
    assert_eq!(lens.surfaces[1].thickness, 60.0);
    let gaps: Vec<_> = lens.zoom.iter().map(|z| z.gaps.clone()).collect();
    assert_eq!(gaps, [[(1, 60.0)], [(1, 90.0)]]);
    assert_eq!(lens.zoom[1].stop_semi_diameter, Some(5.0));
    for (line, says) in [
        ("THIC 17 1 2 0", "no surface `17`"),
        ("THIC 4 3 2 0", "no configuration `3`"),
    ] {
        let surfaces = format!("SURF 4\n  {glass}\n  CURV 0.5\n  DIAM 1\n");
        let error = parse(&file(&surfaces, &format!("MNUM 2 1\n{line}\n"))).unwrap_err();
        assert!(error.message.contains(says), "{error}");
    }
}

/// Coordinate breaks around a surface are its decenters in front of it and behind it.
#[test]
fn the_tilts_of_a_surface_are_those_of_coordinate_breaks_around_it() {
    let stop = "SURF 1\n  STOP\n  TYPE STANDARD\n  CURV 0\n  DISZ 5\n  DIAM 5\n";
    let lens = "  TYPE STANDARD\n  CURV 0.02\n  GLAS N-BK7\n  DIAM 10\n";
    let rear = "  TYPE STANDARD\n  CURV -0.01\n  DISZ 50\n  DIAM 10\n";
    let numbers = |order: &str| format!("PARM 1 1\n  PARM 2 2\n  PARM 3 5\n  PARM 6 {order}\n");
    let breaks = format!(
        "{stop}SURF 2\n  TYPE COORDBRK\n  {}  DISZ 0\nSURF 3\n{lens}  DISZ 0\nSURF 4\n  TYPE COORDBRK\n  \
         {}  DISZ 4\nSURF 5\n{rear}",
        numbers("0"),
        numbers("1")
    );
    let own = format!(
        "{stop}SURF 2\n  SCBD 1 0 0 1 2 5 0 0\n  SCBD 2 1 0 1 2 5 0 0\n{lens}  DISZ 4\nSURF 3\n{rear}"
    );
    let bare = |text: &str| {
        let surfaces = parse(&file(text, "")).unwrap().surfaces;
        surfaces
            .into_iter()
            .map(|s| (s.curvature, s.thickness, s.frame))
            .collect::<Vec<_>>()
    };
    assert!(bare(&own)[1].2.is_some());
    assert_eq!(bare(&own), bare(&breaks));
    let follows = own.replace("SCBD 2 1 0", "SCBD 2 1 2");
    assert!(
        parse(&file(&follows, ""))
            .unwrap_err()
            .message
            .contains("surface 2")
    );
}

#[test]
fn a_glass_may_be_that_of_another_surface() {
    let text = |other: u32| {
        file(
            &format!(
                "SURF 1\n  STOP\n  CURV 0.5\n  GLAS ___BLANK 1 0 1.7 30\n  DIAM 1\n\
                 SURF 2\n  CURV 0.1\n  DIAM 1\n\
                 SURF 3\n  CURV 0.1\n  GLAS ___BLANK 2 {other} 1.5 40\n  DIAM 1\n"
            ),
            "",
        )
    };
    assert_eq!(parse(&text(1)).unwrap().surfaces[2].medium.n_d, 1.7);
    assert!(
        parse(&text(3))
            .unwrap_err()
            .message
            .contains("no surface `3`")
    );
}

#[test]
fn a_file_without_indentation_is_the_same_lens() {
    let text = file(
        "SURF 1\n  STOP\n  TYPE EVENASPH\n  CURV 0.5\n  PARM 2 0.1\n  GLAS N-BK7\n  DIAM 1\n",
        "MNUM 1 1\n",
    );
    let bare = |text: &str| {
        let mut lens = parse(text).unwrap();
        lens.surfaces
            .iter_mut()
            .for_each(|s| s.span = Span::default());
        lens
    };
    assert_eq!(bare(&text.replace("\n  ", "\n")), bare(&text));
}

#[test]
fn a_biconic_that_bends_in_x_only_is_a_cylinder() {
    let surface = "SURF 1\n  STOP\n  TYPE BICONICX\n  CURV 0\n  PARM 1 5\n  DIAM 1\n";
    let lens = parse(&file(surface, "")).unwrap();
    assert_eq!(lens.surfaces[0].shape, Shape::CylinderY);
    assert_eq!(lens.surfaces[0].curvature.radius(), 50.0);
    let both = surface.replace("CURV 0", "CURV 0.1");
    assert!(
        parse(&file(&both, ""))
            .unwrap_err()
            .message
            .contains("BICONICX")
    );
}

#[test]
fn a_configuration_that_changes_what_is_not_read_is_warned_of_once() {
    let surfaces = "SURF 1\n  STOP\n  TYPE STANDARD\n  CURV 0.02\n  DISZ 5\n  DIAM 5\n";
    let operands = "MNUM 2 1\nTHIC 1 1 5 0\nTHIC 1 2 6 0\nIGNR 1 1 0 0\nIGNR 1 2 1 0\nCATX 1 2 3 0\n\
                    MOFF 0 1 0 0\nTOL TOFF 0 0\n";
    let source = Arc::new(Source::new("a.zmx", file(surfaces, operands).into_bytes()));
    let mut sink = Sink::new();
    read(&source, &mut sink).unwrap();
    let found = sink
        .items()
        .iter()
        .filter(|d| d.message.contains("configurations that change"));
    let found: Vec<&str> = found.filter_map(|d| d.message.split('`').nth(1)).collect();
    assert_eq!(found, ["IGNR", "CATX"]);
}
