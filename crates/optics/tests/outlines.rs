//! Clear apertures that are not round, and not on the axis.

use std::sync::Arc;

use glam::{DVec2, DVec3};
use ivcam_base::diag::{Sink, Source};
use ivcam_base::math::lanes::Width;
use ivcam_optics::lens::{Bundle, Iris, Lens, LensRay, Toward};
use ivcam_optics::prescription::formats::read;
use ivcam_optics::prescription::formats::write::{OutputFormat, write};

use crate::tilts::all_light_is_found;

/// A singlet whose front has the lines of Zemax, and behind it a stop.
fn zemax(lines: &str) -> Lens {
    let text = format!(
        "VERS 1\nMODE SEQ\nUNIT MM\nSURF 0\n  DISZ INFINITY\nSURF 1\n  TYPE STANDARD\n  CURV 0.02\n\
         \x20 DISZ 5\n  GLAS ___BLANK 1 0 1.6 0\n  DIAM 12\n{lines}SURF 2\n  TYPE STANDARD\n  CURV -0.001\n\
         \x20 DISZ 8\n  DIAM 14\nSURF 3\n  STOP\n  TYPE STANDARD\n  CURV 0\n  DISZ 70\n  DIAM 9\nSURF 4\n"
    );
    lens_of("a.zmx", text).0
}

fn lens_of(name: &str, text: String) -> (Lens, Vec<String>) {
    let mut sink = Sink::new();
    let source = Arc::new(Source::new(name, text.into_bytes()));
    let lens = read(&source, &mut sink).unwrap_or_else(|e| panic!("{name}: {e}"));
    let messages = sink.items().iter().map(|item| item.message.clone());
    (Lens::new(lens), messages.collect())
}

/// Whether a ray parallel to the axis gets through, alone and in a bundle.
fn passes(lens: &Lens, x: f64, y: f64) -> bool {
    let ray = LensRay::new(DVec3::new(x, y, -1.0), DVec3::Z);
    let mut bundle = Bundle::default();
    bundle.set(5, &ray);
    lens.trace_bundle(&mut bundle, Toward::Film, Width::detect());
    let alone = lens.trace_from_scene(&ray).is_ok();
    assert_eq!(alone, bundle.passed(5), "{x} {y}");
    alone
}

const RECTANGLE: &str = "  SQAP 4 6 0\n";
const SHIFTED: &str = "  SQAP 4 6 0\n  OBDC 1 -2\n";
const ELLIPSE: &str = "  ELAP 3 7 0\n";
const CIRCLE: &str = "  CLAP 0 5 0\n  OBDC 2.5 0\n";

#[test]
fn apertures_of_zemax_block_rays_outside_of_them() {
    for (lines, open, closed) in [
        (
            RECTANGLE,
            [[3.9, 5.9], [-3.9, -5.9]],
            [[4.1, 0.0], [0.0, 6.1]],
        ),
        (
            SHIFTED,
            [[4.9, 3.9], [-2.9, -7.9]],
            [[-3.1, 0.0], [0.0, 4.1]],
        ),
        (ELLIPSE, [[2.9, 0.0], [1.9, -5.0]], [[2.3, 5.0], [0.0, 7.1]]),
        (CIRCLE, [[7.4, 0.0], [-2.4, 0.0]], [[-2.6, 0.0], [5.0, 4.5]]),
    ] {
        let lens = zemax(lines);
        assert!(open.iter().all(|[x, y]| passes(&lens, *x, *y)), "{lines}");
        assert!(
            !closed.iter().any(|[x, y]| passes(&lens, *x, *y)),
            "{lines}"
        );
    }
}

#[test]
fn the_pupil_behind_an_outline_holds_all_its_light() {
    for lines in [RECTANGLE, SHIFTED, ELLIPSE, CIRCLE] {
        all_light_is_found(&zemax(lines), 12.0, 20.0);
    }
}

/// The same apertures in other formats let the same rays pass.
#[test]
fn outlines_are_read_and_written() {
    let grid = || (0..31 * 31).map(|k| [k % 31, k / 31].map(|i| 0.7 * f64::from(i) - 10.37));
    let same = |a: &Lens, b: &Lens| grid().all(|[x, y]| passes(a, x, y) == passes(b, x, y));
    for lines in [RECTANGLE, SHIFTED, ELLIPSE, CIRCLE] {
        let lens = zemax(lines);
        assert!(grid().filter(|[x, y]| passes(&lens, *x, *y)).count() > 40);
        let is_rectangle = lines.contains("SQAP");
        for target in [OutputFormat::Json, OutputFormat::Zemax, OutputFormat::CodeV] {
            let (text, left_out) = write(lens.prescription(), target).unwrap();
            let keeps = is_rectangle || target == OutputFormat::Json;
            let says = left_out
                .iter()
                .any(|what| what.contains("the outline of surface 0"));
            assert_eq!(says, !keeps, "{left_out:?}");
            assert!(
                !keeps || same(&lens_of("b", text).0, &lens),
                "{lines} {target:?}"
            );
        }
        let error = write(lens.prescription(), OutputFormat::Columns).unwrap_err();
        assert!(error.message.contains("not round"), "{error}");
    }
    let code_v = |lines: &str| {
        let text = format!(
            "RDM;LEN\nDIM M\nSO 0 1e13\nS 50 5 1.6:60\n{lines}S -1000 8\n  CIR 14\nS 0 70\n  STO\n  CIR 9\nSI 0 0\n"
        );
        lens_of("a.seq", text)
    };
    for (lines, of_zemax) in [
        ("  REX 4; REY 6\n", RECTANGLE),
        ("  REX 4; REY 6; ADX 1; ADY -2\n", SHIFTED),
        ("  ELX 7; ELY 3; ARO 90\n", ELLIPSE),
        ("  CIR 5; ADX 2.5\n", CIRCLE),
    ] {
        assert!(same(&code_v(lines).0, &zemax(of_zemax)), "{lines}");
    }
    for (lines, says) in [
        ("  CIR 9; REX 4\n", "in x or y alone"),
        ("  CIR 9; REX OBS 4\n", "obstruction is left out"),
    ] {
        let messages = code_v(lines).1;
        assert!(
            messages.iter().any(|message| message.contains(says)),
            "{messages:?}"
        );
    }
}

/// A stop with a rectangle has an iris of that shape, which closes with the stop.
#[test]
fn the_outline_of_a_stop_is_its_iris() {
    let lens = lens_of(
        "a.json",
        "{\"surfaces\": [{\"kind\": \"stop\", \"t\": 1, \"outline\": [[3, 2], [-3, 2], [-3, -2], [3, -2]]},
          {\"R\": 30, \"t\": 3, \"n_d\": 1.5, \"semi_diameter\": 9}, {\"R\": -30, \"t\": 0, \"semi_diameter\": 9}]}"
            .into(),
    )
    .0;
    assert!(matches!(lens.prescription().iris, Iris::Outline { .. }));
    assert!(!lens.prescription().has_outlines());
    assert!(passes(&lens, 2.9, 1.9) && !passes(&lens, 2.9, 2.1) && !passes(&lens, 3.1, 0.0));
    let half = lens.prescription().scaled(0.5);
    assert!(!passes(&Lens::new(half), 2.0, 0.0));
}

#[test]
fn an_outline_scales_with_its_lens() {
    let lens = Lens::new(zemax(SHIFTED).prescription().scaled(0.5));
    let corners = lens.prescription().surfaces[0].outline.as_deref().unwrap();
    assert!(corners.contains(&DVec2::new(2.5, 2.0)), "{corners:?}");
    assert!(passes(&lens, 2.4, 1.9) && !passes(&lens, 2.6, 0.0));
}

#[test]
fn an_outline_is_a_polygon_of_a_few_corners() {
    for (count, says) in [(2, "no polygon"), (257, "has 257 corners")] {
        let corners = vec!["[1, 0]"; count].join(",");
        let text = format!(
            "{{\"surfaces\": [{{\"R\": 9, \"t\": 1, \"n_d\": 1.5, \"outline\": [{corners}]}}, {{\"R\": 0, \"t\": 9}}]}}"
        );
        let source = Arc::new(Source::new("a.json", text.into_bytes()));
        let error = read(&source, &mut Sink::new()).unwrap_err();
        assert!(error.message.contains(says), "{error}");
    }
}
