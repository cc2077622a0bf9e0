use std::sync::Arc;

use ivcam_base::diag::{Diagnostic, Result, Sink, Source};

use crate::lens::{Lens, Shape, shipped_names};
use crate::prescription::formats::dat::reader;
use crate::prescription::formats::reader::PrescriptionReader;
use crate::prescription::formats::reading::{Gap, Reading};
use crate::prescription::prescription::Prescription;
use crate::prescription::surface::polynomial;

fn read(source: &Arc<Source>, gap: Option<Gap>, sink: &mut Sink) -> Result<Prescription> {
    let options = Reading {
        gap,
        ..Reading::default()
    };
    let options = &options;
    reader::read(PrescriptionReader { source, options }, sink)
}

fn parse(text: &str) -> (Result<Prescription>, Sink) {
    let source = Arc::new(Source::new("a.dat", text.as_bytes().to_vec()));
    let mut sink = Sink::new();
    sink.set_source(Some(source.clone()));
    let result = read(&source, None, &mut sink);
    (result, sink)
}

fn place(error: &Diagnostic) -> (u32, u32) {
    error.location().1.unwrap()
}

#[test]
fn a_stop_may_be_written_in_three_ways_and_keeps_its_medium() {
    for stop in ["0 1 0 8", "1 1.33 8", "0 1 8"] {
        let text = format!("# eye\nradius thick n ap\n10 2 1.33 9\n{stop}\n-10 20 1 9\n");
        let lens = parse(&text).0.unwrap();
        assert_eq!(lens.stop(), Some(1), "{stop}");
        assert_eq!(lens.surfaces[1].medium.n_d, 1.33);
        assert_eq!(lens.surfaces[1].thickness, 1.0);
        assert_eq!(lens.surfaces[1].semi_diameter, 4.0);
        assert_eq!(lens.notes, ["eye"]);
    }
}

#[test]
fn a_comment_may_name_the_unit() {
    let lens = |unit: &str| parse(&format!("# units: {unit}\n5 0.3 1.5 2\n-5 0 1 2\n")).0;
    assert_eq!(lens("cm").unwrap().surfaces[0].thickness, 3.0);
    assert_eq!(lens("in").unwrap().surfaces[1].semi_diameter, 25.4);
    let error = lens("ells").unwrap_err();
    assert_eq!(
        (place(&error), &*error.message),
        ((1, 3), "`ells` is not a unit of length")
    );
}

#[test]
fn the_comment_of_the_unit_may_be_in_any_case_and_without_blanks() {
    for comment in [
        "# Units: in",
        "# UNITS: IN",
        "#units:in",
        "#  units :  in",
        "# units in",
        "# Unit = inches",
    ] {
        let lens = parse(&format!("{comment}\n5 0.3 1.5 2\n-5 0 1 2\n"))
            .0
            .unwrap();
        assert!(
            (lens.surfaces[0].thickness - 7.62).abs() < 1e-12,
            "{comment}"
        );
    }
    // A sentence is no unit.
    for sentence in [
        "# unit: front group",
        "# Units: see the patent",
        "# Unit = 1 mm",
    ] {
        assert!(
            parse(&format!("{sentence}\n5 0.3 1.5 2\n-5 0 1 2\n"))
                .0
                .is_ok()
        );
    }
    let lens = parse("# units unknown\n5 0.3 1.5 2\n-5 0 1 2\n").0.unwrap();
    assert_eq!(lens.surfaces[0].thickness, 0.3);
}

#[test]
fn a_length_of_a_comment_is_in_its_own_unit_or_in_that_of_the_file() {
    for (unit, height, expected) in [
        ("cm", "21.6 mm", 21.6),
        ("cm", "2.16", 21.6),
        ("cm", "0.85 in", 21.59),
        ("mm", "2.16 cm", 21.6),
        ("mm", "21.6mm", 21.6),
        ("mm", "21.6", 21.6),
        ("mm", "21.6 in the patent", 21.6),
    ] {
        let text = format!("# units: {unit}\n# image height: {height}\n5 0.3 1.5 2\n-5 0 1 2\n");
        let found = parse(&text).0.unwrap().image_height.unwrap();
        assert!((found - expected).abs() < 1e-9, "{unit}, {height}: {found}");
    }
}

#[test]
fn a_stated_focal_length_may_be_in_another_unit_and_a_field_in_radians() {
    let rows = "100 5 1.5 20\n-100 5 1 20\n0 90 0 19\n";
    let warned = |comment: &str| {
        let (lens, sink) = parse(&format!("# {comment}\n{rows}"));
        assert!(lens.is_ok());
        sink.items()
            .iter()
            .any(|d| d.message.contains("states a focal length"))
    };
    // 1/f = 0.5 (2/100 - 0.5 * 5/(1.5 * 100 * 100)).
    assert!(!warned("focal length: 10.08 cm") && !warned("Focal length = 3.97 in"));
    assert!(warned("focal length: 10.08") && warned("focal length: 8 cm"));
    // A mark that closes a quotation is no foot.
    assert!(!warned("'Focal length 100.8' as printed") && warned("'focal length 10.08'"));
    // What follows the number is no part of it.
    for text in [
        "{}, f/4",
        "{}; f/4",
        "({})",
        "{}/50 mm",
        "{}-200 mm",
        "{}\u{2013}200mm",
    ] {
        let stated = |number: &str| format!("focal length {}", text.replace("{}", number));
        assert!(!warned(&stated("100.8")) && warned(&stated("90")), "{text}");
    }
    let lens = parse(&format!("# field: 0.5 rad\n{rows}")).0.unwrap();
    let field = crate::prescription::about::About::of(&lens)
        .field_degrees
        .unwrap();
    assert!((field - 28.6479).abs() < 1e-4);
}

#[test]
fn the_older_order_gives_the_same_lens() {
    let now = "50 3 1.5 20\n0 2 0 8\n-50 0 1 20\n";
    let old = "50 0 1.5 20\n0 3 0 8\n-50 2 1 20\n";
    let gaps = |text: &str| -> Vec<f64> {
        parse(text)
            .0
            .unwrap()
            .surfaces
            .iter()
            .map(|s| s.thickness)
            .collect()
    };
    assert_eq!(gaps(old), gaps(now));
    assert_eq!(gaps(&format!("# radius axpos N ap\n{old}")), gaps(now));
    // A stop that touches the first surface does not make it an older file.
    assert_eq!(
        gaps("0 0 0 8\n50 3 1.5 20\n-50 90 1 20\n"),
        [0.0, 3.0, 90.0]
    );
}

#[test]
fn a_fifth_column_that_is_announced_is_the_abbe_number() {
    let text = "# radius thickness n_d aperture V_d\n50 3 1.5168 20 64.17\n-50 0 1 20\n";
    let lens = parse(text).0.unwrap();
    assert!((lens.surfaces[0].medium.abbe().unwrap() - 64.17).abs() < 1e-9);
    assert!(!lens.surfaces[1].medium.is_dispersive());
}

#[test]
fn the_abbe_number_may_stand_before_the_aperture() {
    let lens = parse(
        "# radius thickness ior v-no aperture\n50 3 1.5168 64.17 20\n0 1 0 0 8\n-50 0 1 0 20\n",
    );
    let lens = lens.0.unwrap();
    assert!((lens.surfaces[0].medium.abbe().unwrap() - 64.17).abs() < 1e-9);
    let halves: Vec<f64> = lens.surfaces.iter().map(|s| s.semi_diameter).collect();
    assert_eq!(halves, [10.0, 4.0, 10.0]);
}

#[test]
fn radius_0_with_an_index_is_a_plane() {
    let lens = parse("0 5 1.5 20\n0 1 0 8\n-50 0 1 20\n").0.unwrap();
    assert!(lens.surfaces[0].is_plane() && !lens.surfaces[0].is_stop);
    assert_eq!(lens.stop(), Some(1));
}

#[test]
fn a_bad_row_is_named_by_line_and_column() {
    for (text, at, says) in [
        ("", (1, 1), "no surfaces"),
        ("10 2 1.5 9\n20 3 1.5\n", (2, 9), "too few"),
        ("10 2 1.5 9 7\n", (1, 12), "too many"),
        ("10 2 1.5 9\n10 2 x 9\n", (2, 6), "no glass named `x`"),
        ("10 2 NaN 9\n", (1, 6), "not a number"),
        ("10 2 1.5 -9\n", (1, 10), "not greater than 0"),
        ("10 1.5 0.9 9\n", (1, 8), "less than 1"),
        ("10 2 1.5 9\n0 1 0 5\n0 1 0 5\n", (3, 1), "second stop"),
        ("0 1 0 5\n", (1, 1), "nothing else"),
        (
            "10 -2 1.5 9\n0 1 0 5\n-10 0 1 9\n20 0 1 5",
            (1, 4),
            "backwards through glass",
        ),
    ] {
        let error = parse(text).0.unwrap_err();
        assert!(error.message.contains(says), "{text}: {}", error.message);
        assert_eq!(place(&error), at, "{text}");
    }
}

#[test]
fn an_aperture_wider_than_its_sphere_is_clamped_with_a_warning() {
    let (lens, sink) = parse("10 2 1.5 30\n0 1 0 5\n-10 0 1 9\n");
    assert_eq!(lens.unwrap().surfaces[0].semi_diameter, 10.0);
    assert!(sink.items()[0].message.contains("more than its radius"));
}

/// The last thickness of a singlet of 100 mm, right and wrong.
#[test]
fn a_last_thickness_that_is_not_the_back_focus_is_warned_of() {
    let table = |last: f64| format!("50 1 1.5 10\n0 {last} 1 10\n");
    assert!(
        !parse(&table(99.3333))
            .1
            .items()
            .iter()
            .any(|d| d.message.contains("focus"))
    );
    assert!(
        parse(&table(60.0))
            .1
            .items()
            .iter()
            .any(|d| d.message.contains("focus"))
    );
}

/// The rows of a lens in four columns, with the gaps of a reading of the second column.
fn rows(lens: &Prescription, gap: Gap, last: f64) -> String {
    let mut text = String::new();
    let (mut before, mut position) = (0.0, 0.0);
    for (i, surface) in lens.surfaces.iter().enumerate() {
        let thickness = if i + 1 < lens.surfaces.len() {
            surface.thickness
        } else {
            last
        };
        let column = match gap {
            Gap::Next => thickness,
            Gap::Previous => before,
            Gap::Position => position,
        };
        let index = if surface.is_stop {
            0.0
        } else {
            surface.medium.n_d
        };
        let (radius, diameter) = (surface.curvature.radius(), 2.0 * surface.semi_diameter);
        text += &format!("{radius} {column} {index} {diameter}\n");
        before = thickness;
        position += thickness;
    }
    text
}

/// Every shipped lens of spheres, in each order of its gaps, under a heading that says nothing,
/// and under one that says something else.
#[test]
fn the_second_column_is_what_the_surfaces_say_whatever_the_heading_says() {
    let mut tried = 0;
    for name in shipped_names() {
        let shipped = Lens::named(name).unwrap();
        let lens = shipped.prescription();
        let spheres = lens.surfaces.iter().all(|s| s.shape == Shape::Sphere);
        // A first surface that is the stop gives less evidence.
        if !spheres || lens.has_mirrors() || lens.surfaces.len() < 4 || lens.surfaces[0].is_stop {
            continue;
        }
        tried += 1;
        let focus = shipped.first_order().focal.unwrap().bfl;
        let orders = [
            (Gap::Next, 0.0),
            (Gap::Next, focus),
            (Gap::Previous, 0.0),
            (Gap::Position, 0.0),
        ];
        for (gap, last) in orders {
            // Few numbers that increase are not enough for positions.
            if gap == Gap::Position && lens.surfaces.len() < 6 {
                continue;
            }
            for heading in [
                "",
                "# radius axpos N aperture\n",
                "# radius thickness N aperture\n",
            ] {
                let (read, sink) = parse(&format!("{heading}{}", rows(lens, gap, last)));
                let read = read.unwrap();
                let thicknesses = lens.surfaces.iter().zip(&read.surfaces);
                let count = lens.surfaces.len();
                for (i, (right, read)) in thicknesses.take(count - 1).enumerate() {
                    let off = (right.thickness - read.thickness).abs();
                    assert!(off < 1e-9, "{name} {gap:?} {last} {heading}: surface {i}");
                }
                let doubt = sink
                    .items()
                    .iter()
                    .find(|d| d.message.contains("it may be"));
                assert!(
                    doubt.is_none(),
                    "{name} {gap:?} {last} {heading}: {}",
                    doubt.unwrap()
                );
            }
        }
    }
    assert!(tried >= 15, "{tried}");
}

/// Two thin lenses: nothing crosses, no number is 0, and there is no film.
#[test]
fn thin_evidence_names_both_readings_and_the_option_decides() {
    let text = "0 4 1.5 9\n-60 5 1 9\n0 6 1.5 9\n-80 3 1 9\n0 2 0 9\n";
    let (lens, sink) = parse(&format!("# radius axpos N aperture\n{text}"));
    assert_eq!(lens.unwrap().surfaces[0].thickness, 4.0);
    let doubt = sink
        .items()
        .iter()
        .find(|d| d.message.contains("it may be"))
        .unwrap();
    assert!(
        doubt
            .message
            .contains("from the vertex before (focal length"),
        "{doubt}"
    );
    assert!(doubt.help.as_ref().unwrap().contains("--gap previous"));
    for (gap, first) in [(Gap::Next, 4.0), (Gap::Previous, 5.0)] {
        let source = Arc::new(Source::new("a.dat", text.as_bytes().to_vec()));
        let mut sink = Sink::new();
        let lens = read(&source, Some(gap), &mut sink).unwrap();
        assert_eq!(lens.surfaces[0].thickness, first);
        assert!(!sink.items().iter().any(|d| d.message.contains("it may be")));
    }
}

/// A comment that mentions `axpos` is not a heading.
#[test]
fn a_sentence_about_columns_is_not_a_heading() {
    let text = "# the axpos column of that file was the distance from the PREVIOUS vertex, radius in mm\n\
                50 3 1.5 20\n0 2 0 8\n-50 0 1 20\n";
    let (lens, sink) = parse(text);
    assert_eq!(lens.unwrap().surfaces[0].thickness, 3.0);
    assert!(sink.items().is_empty(), "{}", sink.items()[0]);
}

/// A biconvex lens of zoic's kind: air has the index 0 everywhere, and the columns have words
/// between slashes. Its apertures are semi-diameters, as its f-number says.
#[test]
fn five_columns_may_write_air_as_0_and_give_semi_diameters() {
    let text = "## EFFECTIVE FOCAL LENGTH = \t100.0\n## BACK FOCAL LENGTH = 3\n## MAX NUMERICAL APERTURE = \tF/5.0\n\
                ## RADIUS OF CURVATURE // THICKNESS // MATERIAL // IOR // V-NUMBER // APERTURE\n\
                100\t4\tBK7\t1.5\t60\t11\n-98.65 2 AIR 0.0 0.0 11\n0.0 95.4 AIR 0.0 0.0 9.8\n";
    let (lens, sink) = parse(text);
    let lens = lens.unwrap();
    assert_eq!(lens.stop(), Some(2));
    assert_eq!(lens.surfaces[1].medium.n_d, 1.0);
    assert_eq!(lens.surfaces[0].semi_diameter, 11.0);
    assert!((lens.surfaces[0].medium.abbe().unwrap() - 60.0).abs() < 1e-9);
    assert!(
        sink.items()
            .iter()
            .any(|d| d.message.contains("semi-diameters: the file states f/5"))
    );
}

#[test]
fn five_columns_without_a_heading_are_distinguished_by_their_values() {
    let abbe = |text: &str| {
        parse(text)
            .0
            .map(|l| (l.surfaces[0].medium.abbe(), l.surfaces[0].semi_diameter))
    };
    for text in [
        "50 3 1.5 60 20\n-50 40 1 0 20\n",
        "50 3 1.5 120 60\n-50 40 1 120 0\n",
    ] {
        let (abbe, semi) = abbe(text).unwrap();
        assert!(
            (abbe.unwrap() - 60.0).abs() < 1e-9 && semi >= 10.0,
            "{text}"
        );
    }
    // Both columns may be the Abbe number.
    assert!(
        abbe("50 3 1.5 60 40\n-50 40 1 0 0\n")
            .unwrap_err()
            .message
            .contains("too many")
    );
}

#[test]
fn a_table_of_too_many_rows_is_refused_as_a_limit() {
    let text = "50 3 1.5 20\n-50 2 1 20\n".repeat(501);
    let error = parse(&text).0.unwrap_err();
    assert_eq!(error.kind, ivcam_base::diag::ErrorKind::Limit);
    assert!(parse(&text["50 3 1.5 20\n-50 2 1 20\n".len()..]).0.is_ok());
}

#[test]
fn a_heading_may_name_conic_constants_and_coefficients() {
    let text = "# radius thickness glass semi-diameter conic A4 A6\n\
                22 3 N-BK7 9.5 -0.5 1e-5 -2E-8\n0 1 0 5\n-40 30 1 9.5 0.25\n";
    let lens = parse(text).0.unwrap();
    let terms = polynomial([(4, 1e-5), (6, -2e-8)]);
    assert_eq!(lens.surfaces[0].shape, Shape::Asphere { k: -0.5, terms });
    assert_eq!(lens.surfaces[1].shape, Shape::Sphere);
    assert_eq!(lens.surfaces[2].shape, Shape::Conic { k: 0.25 });
    // Centimeters: 1e-5 cm\u{207b}\u{b3} are 1e-8 mm\u{207b}\u{b3}.
    let lens = parse(&format!("# units: cm\n{text}")).0.unwrap();
    assert!(
        matches!(&lens.surfaces[0].shape, Shape::Asphere { terms, .. }
            if (terms[4] / 1e-8 - 1.0).abs() < 1e-12)
    );
}

#[test]
fn a_column_that_is_not_read_is_refused_where_it_has_numbers() {
    let row = |word: &str, value: &str| {
        let text = format!(
            "# radius thickness index semi-diameter {word}\n22 3 1.5 9.5 {value}\n-22 30 1 9 0\n"
        );
        parse(&text).0
    };
    for (word, help) in [
        ("kappa", "1 + k"),
        ("A2", "need .zmx"),
        ("n_F", "need .zmx"),
    ] {
        let error = row(word, "0.5").unwrap_err();
        let says = format!("the column `{}` is not read", word.to_lowercase());
        assert_eq!(
            (&*error.message, place(&error)),
            (&*says, (2, 14)),
            "{word}"
        );
        assert!(error.help.as_ref().unwrap().contains(help), "{error}");
    }
    // Most words of this heading are unknown.
    let error = parse("# R d n_e V_e phi\n50 3 1.5 60 20\n-50 30 1 0 20\n").0;
    assert!(error.unwrap_err().message.contains("`n_e` is not read"));
    assert!(
        parse("# No radius thickness index aperture\n1 22 3 1.5 9\n2 -22 30 1 9\n")
            .0
            .is_ok()
    );
}

/// The same lens as a patent prints it, in several ways.
#[test]
fn a_table_of_a_patent_may_have_blanks_and_marks() {
    let heading = "# radius thickness index abbe semi-diameter\n";
    let plain = format!(
        "{heading}22 3 1.5168 64.17 9.5\n-60 2 1 0 9\n0 4 0 0 5\n0 1 1.62 36.3 9\n30 40 1 0 9\n"
    );
    let bare = |text: &str| {
        let mut lens = parse(text).0.unwrap_or_else(|e| panic!("{text}: {e}"));
        lens.surfaces
            .iter_mut()
            .for_each(|s| s.span = Default::default());
        lens
    };
    let right = bare(&plain);
    assert_eq!(
        (right.stop(), right.surfaces[2].semi_diameter),
        (Some(2), 5.0)
    );
    for (air, stop, plane) in [
        ("-60 2 1 9", "0 4 0 5", "\u{221e} 1 1.62 36.3 9"),
        (
            "\u{2212}60 2 1 - 9",
            "\u{221e} 4 AIR stop 5",
            "inf 1 1.62 36.3 9",
        ),
        ("-60 2 AIR - 9", "stop 4 1 - 5", "plano 1 1.62 36.3 9"),
        ("-60 2 - - 9", "stop 4 5", "0 1 1.62 36.3 9"),
        ("-60,2,1,,9", "\u{221e} 4 stop 5", "0 1 1.62 36.3 9"),
        (
            "-60 2 1 \u{2014} 9",
            "\u{221e} 4 1 - 5 (stop)",
            "0 1 1.62 36.3 9",
        ),
    ] {
        let text = format!("{heading}22 3 1.5168 64.17 9.5\n{air}\n{stop}\n{plane}\n30 40 1 9\n");
        assert_eq!(bare(&text), right, "{text}");
    }
    // A glass that is the stop keeps its radius and its index.
    let lens = bare(
        &plain
            .replace("0 4 0 0 5\n", "")
            .replace("64.17 9.5", "64.17 9.5 stop"),
    );
    assert_eq!(
        (lens.stop(), lens.surfaces[0].medium.n_d),
        (Some(0), 1.5168)
    );
    assert_eq!(lens.surfaces[0].curvature.radius(), 22.0);
}

#[test]
fn a_row_that_does_not_fit_its_heading_says_what_the_heading_means() {
    for (text, says, help) in [
        (
            "# radius thickness index abbe diameter\n50 3 1.5 20\n-50 40 1 0 20\n",
            "too few numbers in this row: 4 instead of 5",
            "radius, thickness, index or glass, Abbe number, diameter; write `-`",
        ),
        (
            "# r d n D\n50 3 1.5 20\n",
            "names the column of `d` twice: thickness",
            "radius, thickness, index or glass, thickness; `diameter`",
        ),
        (
            "# r d D semi-diameter abbe\n50 3 1.5 20 60\n",
            "names the column of `d` twice",
            "apertures",
        ),
        (
            "# radius thickness index abbe semi-diameter k\n50 3 1.5 60 9 0\n-50 40 1 9 0.5\n",
            "may lack one cell or another",
            "write `-`",
        ),
        (
            "# radius thickness aperture\n50 3 20\n",
            "no column of indices",
            "radius, thickness, diameter;",
        ),
    ] {
        let error = parse(text).0.unwrap_err();
        assert!(error.message.contains(says), "{text}: {error}");
        assert!(
            error.help.as_ref().unwrap().contains(help),
            "{text}: {error}"
        );
    }
}

/// A singlet of 100 mm behind its stop: paraxial arithmetic by hand.
#[test]
fn apertures_that_a_table_leaves_out_are_those_of_the_stated_beam() {
    let table = "# r d nd vd\nstop 10\n\u{221e} 0 1.5 60\n-50 99 1\n";
    let stated = "# f-number: 5\n# field: 20 degrees\n";
    let (lens, sink) = parse(&format!("{stated}{table}"));
    let halves: Vec<f64> = lens
        .unwrap()
        .surfaces
        .iter()
        .map(|s| s.semi_diameter)
        .collect();
    let edge = 10.0 + 10.0 * libm::tan(10_f64.to_radians());
    assert!((halves[0] - 10.0).abs() < 1e-9, "{halves:?}");
    assert!(
        (halves[1] - edge).abs() < 1e-9 && (halves[2] - edge).abs() < 1e-9,
        "{halves:?}"
    );
    assert!(
        sink.items()
            .iter()
            .any(|d| d.message.contains("those of its beam"))
    );
    for lost in ["# f-number: 5\n", "# field: 20 degrees\n", ""] {
        let error = parse(&format!("{lost}{table}")).0.unwrap_err();
        assert!(error.message.contains("has no aperture"), "{error}");
        assert!(
            error
                .help
                .as_ref()
                .unwrap()
                .contains("`# field: 40 degrees`")
        );
    }
    // `-` leaves one of them out.
    let text =
        format!("{stated}# r d nd vd diameter\nstop 10 - - 16\n0 0 1.5 60 -\n-50 99 1 - 30\n");
    let halves = parse(&text)
        .0
        .unwrap()
        .surfaces
        .iter()
        .map(|s| s.semi_diameter)
        .collect::<Vec<_>>();
    assert_eq!((halves[0], halves[2]), (8.0, 15.0));
    assert!((halves[1] - edge).abs() < 1e-9, "{halves:?}");
}

/// The example of the guide, with a table of the same lens in which nothing is blank.
#[test]
fn the_blanks_of_air_in_a_printed_table_are_air() {
    let blank = "# r d nd vd conic A4\n58 7.6 1.62041 60.33 -0.3 2.1e-7\n171 0.3\nstop 14\n-40 90 1 - 0.2 -\n";
    let whole = "# r d nd vd conic A4\n58 7.6 1.62041 60.33 -0.3 2.1e-7\n171 0.3 1 0 0 0\n0 14 0 0 0 0\n-40 90 1 0 0.2 0\n";
    let lens = |table: &str| {
        let stated = "# f-number: 8\n# field: 10 degrees\n";
        let mut lens = parse(&format!("{stated}{table}")).0.unwrap();
        lens.surfaces
            .iter_mut()
            .for_each(|s| s.span = Default::default());
        lens
    };
    assert_eq!(lens(blank), lens(whole));
    // A glass that lost its index is not air, and no surface is between air and air.
    for lost in ["58 7.6 60.33", "58 7.6"] {
        let text = format!("# r d nd vd\n{lost}\n171 0.3\n");
        assert!(
            parse(&text).0.unwrap_err().message.contains("too few"),
            "{lost}"
        );
    }
}

/// A singlet of 100 mm at f/5.
#[test]
fn a_stated_focal_length_that_the_rows_contradict_is_warned_of() {
    let warned = |stated: &str| {
        let (_, sink) = parse(&format!(
            "# focal length: {stated} mm\n50 1 1.5 20\n0 99.3333 1 20\n"
        ));
        sink.items()
            .iter()
            .any(|d| d.message.contains("but its rows have 100.00"))
    };
    assert!(warned("97") && warned("103"));
    assert!(!warned("99") && !warned("101.5"));
}

#[test]
fn apertures_of_the_beam_that_cross_are_blamed_themselves() {
    let table = "# r d nd vd\nstop 1\n20 2 1.5 60\n-20 90 1\n";
    let help = |text: &str| {
        let source = Arc::new(Source::new("a.dat", text.as_bytes().to_vec()));
        let mut sink = Sink::new();
        read(&source, Some(Gap::Next), &mut sink).unwrap();
        let crossing = sink.items().iter().find(|d| d.message.contains("cross"));
        crossing.map(|d| d.help.as_ref().unwrap().to_string())
    };
    let derived = help(&format!("# f-number: 1\n# field: 60 degrees\n{table}")).unwrap();
    assert!(derived.contains("too wide"), "{derived}");
    let given = help("0 1 0 30\n20 2 1.5 36\n-20 90 1 36\n").unwrap();
    assert!(given.contains("the two radii"), "{given}");
}
