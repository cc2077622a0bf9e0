//! Ideal thin lenses inside of a system, against optiland and what an ideal lens is by definition.

use std::fmt::Write as _;

use glam::DVec2;
use ivcam_optics::lens::analysis::aberrations::fans::PointFans;
use ivcam_optics::lens::analysis::aberrations::seidel::SeidelSums;
use ivcam_optics::lens::analysis::diffraction::Openings;
use ivcam_optics::lens::{Beam, Conjugate, Lens, Prescription, Shape, Surface, Wavefront};
use ivcam_optics::prescription::Medium;
use ivcam_optics::prescription::formats::write::{OutputFormat, write};
use serde_json::Value;

use crate::tilts::{bundles_and_ways_back_agree, differences, lens_of, systems_of};

/// A system of the reference as a file of Zemax.
fn zemax(rows: &[Value]) -> String {
    let number = |value: &Value| value.as_f64().unwrap_or(0.0);
    let mut text =
        "VERS 1\nMODE SEQ\nUNIT MM\nSURF 0\n  TYPE STANDARD\n  DISZ INFINITY\n".to_owned();
    let mut count = 0;
    for row in rows {
        let mut begin = |text: &mut String| {
            count += 1;
            let _ = writeln!(text, "SURF {count}");
        };
        let tilt: Vec<f64> = row[6]
            .as_array()
            .into_iter()
            .flatten()
            .skip(1)
            .map(number)
            .collect();
        let mut gap = row[1].clone();
        if let [dx, dy, angle, ..] = tilt[..] {
            // The angle about x has the sign of CODE V.
            begin(&mut text);
            let _ = writeln!(
                text,
                "  TYPE COORDBRK\n  PARM 1 {dx}\n  PARM 2 {dy}\n  PARM 3 {}",
                -angle
            );
            gap = Value::from(0.0);
        }
        begin(&mut text);
        let radius = number(&row[0]);
        let c = if radius == 0.0 { 0.0 } else { 1.0 / radius };
        let _ = match row[7].as_f64() {
            Some(f) => writeln!(text, "  TYPE PARAXIAL\n  CURV 0\n  PARM 1 {f}\n  PARM 2 0"),
            None => writeln!(text, "  TYPE STANDARD\n  CURV {c}\n  CONI {}", row[4]),
        };
        let _ = writeln!(text, "  DISZ {gap}\n  DIAM {}", row[3]);
        let _ = match row[2].as_f64() {
            None => writeln!(text, "  GLAS MIRROR 0 0"),
            Some(1.0) => Ok(()),
            Some(n) => writeln!(text, "  GLAS ___BLANK 1 0 {n} 0"),
        };
        if let [dx, dy, angle, ..] = tilt[..] {
            begin(&mut text);
            let back = [-dx, -dy, angle, 0.0, 0.0, 1.0];
            let _ = writeln!(text, "  TYPE COORDBRK\n  DISZ {}", row[1]);
            for (i, value) in back.iter().enumerate() {
                let _ = writeln!(text, "  PARM {} {value}", i + 1);
            }
        }
    }
    let _ = writeln!(text, "SURF {}\n  TYPE STANDARD\n  DISZ 0", count + 1);
    text
}

fn ideal(focal_length: f64, thickness: f64, semi_diameter: f64) -> Surface {
    Surface {
        shape: Shape::ThinLens { focal_length },
        ..Surface::sphere(0.0, thickness, Medium::air(), semi_diameter)
    }
}

/// A converging lens behind a stop, and with `second` a diverging one behind it.
fn telephoto(second: bool) -> Lens {
    let mut surfaces = vec![
        Surface::stop(10.0, Medium::air(), 12.5),
        ideal(50.0, 30.0, 30.0),
    ];
    if second {
        surfaces.push(ideal(-35.0, 0.0, 30.0));
    }
    Lens::new(Prescription::new("ideal", surfaces))
}

/// Newton's equation for the paraxial image.
fn image_of(lens: &Lens, distance: f64) -> f64 {
    let focal = lens.first_order().focal.unwrap();
    let beyond = focal.efl * focal.efl / (distance + focal.front_focal_point);
    focal.rear_focal_point + beyond
}

/// The largest differences of hits and directions are printed for docs/accuracy.md.
#[test]
fn rays_through_ideal_lenses_are_those_of_optiland() {
    let systems = systems_of("thin_lenses.json", zemax);
    assert_eq!(systems.len(), 5);
    for (name, lens, rays) in systems {
        let [off, turned] = differences(&lens, &rays);
        println!("{name}: {off:.1e} mm, {turned:.1e}");
        assert!(off < 1e-11 && turned < 1e-12, "{name}: {off:e} {turned:e}");
    }
}

#[test]
fn bundles_and_rays_from_the_film_take_the_same_paths_through_ideal_lenses() {
    for (name, lens, rays) in systems_of("thin_lenses.json", zemax) {
        bundles_and_ways_back_agree(&name, &lens, &rays);
    }
}

#[test]
fn lenses_with_ideal_ones_are_written_or_refused() {
    for (name, lens, rays) in systems_of("thin_lenses.json", zemax) {
        for target in [OutputFormat::Zemax, OutputFormat::Json] {
            let (text, _) = write(lens.prescription(), target).unwrap();
            let [off, turned] = differences(&lens_of(&name, text), &rays);
            assert!(off < 1e-11 && turned < 1e-12, "{name}: {off:e} {turned:e}");
        }
        for target in [OutputFormat::CodeV, OutputFormat::Columns] {
            let error = write(lens.prescription(), target).unwrap_err();
            let of_mirrors = target == OutputFormat::Columns && lens.prescription().has_mirrors();
            assert!(
                of_mirrors || error.message.contains("ideal lens"),
                "{error}"
            );
        }
    }
}

/// At f/2 and half a field of 22 degrees, for far objects and for near ones: every point is sharp,
/// in phase, and where the focal length has it.
#[test]
fn ideal_lenses_have_no_aberrations_at_any_conjugate() {
    for (second, distance) in [
        (false, f64::INFINITY),
        (true, f64::INFINITY),
        (false, 150.0),
        (true, 400.0),
    ] {
        let lens = telephoto(second);
        let film_z = image_of(&lens, distance);
        let conjugate = Conjugate { distance, film_z };
        for height in [0.0, 8.0, 20.0] {
            is_perfect(&lens, height, conjugate);
        }
        let sums = SeidelSums::of(&lens, distance, 12.0, 20.0).unwrap();
        assert_eq!(sums.sum.values(), [0.0; 7]);
    }
}

/// Checks that the rays of a point meet in a point, in phase.
fn is_perfect(lens: &Lens, height: f64, conjugate: Conjugate) {
    let place = format!("{height} {conjugate:?}");
    let lines = [587.0, 588.0, 589.0].map(|nm| lens.at_wavelength(nm));
    let found = PointFans::of(&lines, height, conjugate);
    let fans = found.unwrap_or_else(|| panic!("no rays at {place}")).fans;
    for ray in fans
        .iter()
        .flat_map(|fan| fan.tangential.iter().chain(&fan.sagittal))
    {
        assert!(ray.x.hypot(ray.y) < 1e-10, "{place} {ray:?}");
        assert!(ray.waves.abs() < 1e-6, "{place} {ray:?}");
    }
    let beam = Beam::of(lens, height, conjugate.film_z, conjugate.distance).unwrap();
    let openings = Openings::of(lens, &beam, 64);
    let image = DVec2::new(0.0, height).extend(conjugate.film_z);
    let strehl = Wavefront::of(lens, &beam, &openings, image)
        .unwrap()
        .strehl();
    assert!((strehl - 1.0).abs() < 1e-6, "{place} {strehl}");
}

#[test]
fn what_is_no_ideal_lens_is_refused() {
    let text = |lines: &str| {
        format!(
            "VERS 1\nSURF 0\n  DISZ INFINITY\nSURF 1\n  TYPE PARAXIAL\n{lines}  DISZ 9\n  DIAM 5\nSURF 2\n"
        )
    };
    for (lines, says) in [
        ("", "has no focal length"),
        ("  PARM 1 0\n", "is 0"),
        ("  PARM 1 50\n  GLAS MIRROR 0 0\n", "and a mirror"),
    ] {
        let source = ivcam_base::diag::Source::new("a.zmx", text(lines).into_bytes());
        let mut sink = ivcam_base::diag::Sink::new();
        let error =
            ivcam_optics::prescription::formats::read(&std::sync::Arc::new(source), &mut sink);
        let error = error.unwrap_err();
        assert!(error.message.contains(says), "{error}");
    }
}
