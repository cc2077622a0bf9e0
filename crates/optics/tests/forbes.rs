//! Aspheres by Forbes's polynomials, against their published closed forms and optiland.

use std::sync::Arc;

use glam::DVec3;
use ivcam_base::diag::{Sink, Source};
use ivcam_base::math::lanes::Width;
use ivcam_optics::lens::{Bundle, Lens, LensRay, Shape, Toward};
use ivcam_optics::prescription::formats;
use ivcam_optics::prescription::formats::write::{OutputFormat, write};

const CURVATURE: f64 = 0.03;
const CONIC: f64 = -0.4;
const RADIUS: f64 = 14.0;
const COEFFICIENTS: [f64; 3] = [-0.3, 0.08, -0.02];

/// A plano-convex lens in air with a front surface of Zemax's type 0 or 1.
fn lens(kind: u32) -> Lens {
    let [a, b, c] = COEFFICIENTS;
    let text = format!(
        "VERS 1\nMODE SEQ\nUNIT MM\nENPD 20\nSURF 0\n  TYPE STANDARD\n  DISZ INFINITY\n\
         SURF 1\n  STOP\n  TYPE QED_TYPE\n  CURV {CURVATURE}\n  CONI {CONIC}\n  XDAT 1 {kind}\n  \
         XDAT 2 3\n  XDAT 3 {RADIUS}\n  XDAT 4 {a}\n  XDAT 5 {b}\n  XDAT 6 {c}\n  XDAT 7 5\n  \
         DISZ 9\n  GLAS ___BLANK 1 0 1.5 0\n  DIAM 12\n\
         SURF 2\n  TYPE STANDARD\n  CURV 0\n  DISZ 50\n  DIAM 12\n\
         SURF 3\n  TYPE STANDARD\n  CURV 0\n"
    );
    let source = Arc::new(Source::new("a.zmx", text.into_bytes()));
    Lens::new(formats::read(&source, &mut Sink::new()).unwrap())
}

/// The sag by the polynomials that the paper of 2007 prints.
fn sag(kind: u32, r: f64) -> f64 {
    let x = (r / RADIUS).powi(2);
    let [bend, k] = [(CURVATURE * r).powi(2), CONIC];
    let conic = CURVATURE * r * r / (1.0 + (1.0 - (1.0 + k) * bend).sqrt());
    let polynomials = match kind {
        0 => [
            1.0,
            (13.0 - 16.0 * x) / 19_f64.sqrt(),
            (2.0_f64 / 95.0).sqrt() * (29.0 - 4.0 * x * (25.0 - 19.0 * x)),
        ],
        _ => [1.0, 6.0 * x - 5.0, 15.0 - 14.0 * x * (3.0 - 2.0 * x)],
    };
    let sum: f64 = std::iter::zip(polynomials, COEFFICIENTS)
        .map(|(q, a)| q * a)
        .sum();
    // The slope of the conic is that of a normal with this cosine.
    let slope = CURVATURE * r / (1.0 - (1.0 + k) * bend).sqrt();
    conic
        + match kind {
            0 => x * (1.0 - x) * sum * (1.0 + slope * slope).sqrt(),
            _ => x * x * sum,
        }
}

/// Rays parallel to the axis meet the surface at its sag, and leave it by Snell's law at the normal
/// of its slope; bundles have the same rays.
#[test]
fn rays_meet_q_type_aspheres_where_the_published_polynomials_are() {
    for kind in [0, 1] {
        let lens = lens(kind);
        let surface = &lens.prescription().surfaces[0];
        for y in [0.5, 3.0, 7.0, 10.0, 11.9] {
            let ray = LensRay::new(DVec3::new(0.0, y, -5.0), DVec3::Z);
            let path = lens.trace_path(&ray, Toward::Film, true);
            let exact = sag(kind, y);
            assert!(
                (path.hits[0].z - exact).abs() < 1e-12,
                "{kind}: {exact} at {y}"
            );
            assert!((surface.sag(y) - exact).abs() < 1e-12);
            let slope = (sag(kind, y + 1e-4) - sag(kind, y - 1e-4)) / 2e-4;
            let incidence = libm::atan(slope);
            let turn = libm::asin(libm::sin(incidence) / 1.5) - incidence;
            let inner = path.hits[1] - path.hits[0];
            assert!(
                (inner.y / inner.z - libm::tan(turn)).abs() < 1e-8,
                "{kind} at {y}"
            );
            let mut bundle = Bundle::default();
            (0..32).for_each(|lane| bundle.set(lane, &ray));
            lens.trace_bundle(&mut bundle, Toward::Film, Width::detect());
            let (one, lane) = (path.outcome.unwrap(), bundle.ray(7));
            let apart = (one.origin - lane.origin).length();
            assert!(apart < 1e-12 && bundle.passed(7), "{kind} at {y}: {apart}");
        }
    }
}

/// First-order power is that of the curvature at the vertex, which Q-bfs change.
#[test]
fn the_focal_length_is_that_of_rays_near_the_axis() {
    for kind in [0, 1] {
        let lens = lens(kind);
        let ray = LensRay::new(DVec3::new(0.0, 1e-4, -5.0), DVec3::Z);
        let out = lens.trace_path(&ray, Toward::Film, true).outcome.unwrap();
        let efl = -1e-4 / (out.direction.y / out.direction.z);
        assert!(
            (lens.first_order().efl() / efl - 1.0).abs() < 1e-8,
            "{kind}: {efl}"
        );
    }
}

#[test]
fn json_keeps_an_asphere_along_a_normal_and_other_formats_refuse_it() {
    let (bfs, con) = (lens(0), lens(1));
    assert!(matches!(
        bfs.prescription().surfaces[0].shape,
        Shape::NormalAsphere { .. }
    ));
    assert!(matches!(
        con.prescription().surfaces[0].shape,
        Shape::Asphere { .. }
    ));
    let (text, _) = write(bfs.prescription(), OutputFormat::Json).unwrap();
    let source = Arc::new(Source::new("a.json", text.into_bytes()));
    let again = formats::read(&source, &mut Sink::new()).unwrap();
    assert_eq!(
        again.surfaces[0].shape,
        bfs.prescription().surfaces[0].shape
    );
    for target in [
        OutputFormat::Columns,
        OutputFormat::Zemax,
        OutputFormat::CodeV,
    ] {
        let error = write(bfs.prescription(), target).unwrap_err();
        assert!(error.to_string().contains("surface 0"), "{error}");
        assert!(write(con.prescription(), target).is_ok() || target == OutputFormat::Columns);
    }
}

/// Rays of optiland 0.6.3 through its own file, whose surfaces it meets within 1e-15 mm: starts on
/// the vertex plane, directions, and the points and directions on the film.
#[test]
fn rays_through_a_file_of_optiland_are_those_of_optiland() {
    let file = concat!(
        env!("CARGO_MANIFEST_DIR"),
        "/../../tests/lenses/dialects/forbes-optiland.json"
    );
    let source = Arc::new(Source::new("a.json", std::fs::read(file).unwrap()));
    let lens = Lens::new(formats::read(&source, &mut Sink::new()).unwrap());
    let tilt = 0.0871557427476582;
    for ([x, y, m], film, direction) in [
        (
            [0.0, 3.0, 0.0],
            [0.0, 0.007744874728651041],
            [0.0, -0.05589960068398754, 0.9984363948912174],
        ),
        (
            [2.0, 7.0, 0.0],
            [-0.0067574385346480526, -0.023651034871269516],
            [-0.03748003042154628, -0.131180106475412, 0.9906498003758437],
        ),
        (
            [0.0, 10.0, tilt],
            [0.0, 4.428124818622218],
            [0.0, -0.10854783680534363, 0.9940912267618505],
        ),
        (
            [-6.0, 8.0, -tilt],
            [0.10984813270894112, -4.889627693169718],
            [
                0.11219562415865421,
                -0.23359864041257028,
                0.9658384011401948,
            ],
        ),
    ] {
        let d = DVec3::new(0.0, m, (1.0 - m * m).sqrt());
        let ray = LensRay::new(DVec3::new(x, y, 0.0) - 5.0 / d.z * d, d);
        let out = lens.trace_path(&ray, Toward::Film, false).outcome.unwrap();
        let at = out.origin + (56.0 - out.origin.z) / out.direction.z * out.direction;
        let apart = (at.truncate() - glam::DVec2::from_array(film)).length();
        let turned = (out.direction - DVec3::from_array(direction)).length();
        assert!(apart < 1e-12 && turned < 1e-14, "{apart} {turned}");
    }
}
