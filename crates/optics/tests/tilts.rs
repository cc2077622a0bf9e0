//! Decentered and tilted surfaces against other programs, and what must hold for every lens.

use std::fmt::Write as _;
use std::sync::Arc;

use glam::{DVec2, DVec3};
use ivcam_base::diag::{Sink, Source};
use ivcam_optics::lens::{
    Coating, Lens, LensRay, LensSheet, Prescription, PupilTarget, SeidelSums, Surface, Toward,
};
use ivcam_optics::prescription::formats::read;
use ivcam_optics::prescription::formats::write::{OutputFormat, write};
use ivcam_optics::prescription::{Decenter, Medium, SurfaceFrame};
use serde_json::Value;

use crate::mirrors::{a_bundle_and_the_way_back_agree, is_traced_back};

pub(super) fn lens_of(name: &str, text: String) -> Lens {
    let mut sink = Sink::new();
    let source = Arc::new(Source::new(name, text.into_bytes()));
    let lens = read(&source, &mut sink).unwrap_or_else(|e| panic!("{name}: {e}"));
    Lens::new(lens)
}

/// A system of the reference as a file of CODE V.
fn code_v(rows: &[Value]) -> String {
    let mut text = "RDM;LEN\nDIM M\nSO 0 1e13\n".to_owned();
    for row in rows {
        let index = match row[2].as_f64() {
            None => "REFL".to_owned(),
            Some(1.0) => String::new(),
            Some(n) => format!("{n}:60"),
        };
        let _ = writeln!(text, "S {} {} {index}\n  CIR {}", row[0], row[1], row[3]);
        let terms = row[5].as_array().unwrap();
        let _ = match &terms[..] {
            [] => writeln!(text, "  CON; K {}", row[4]),
            [a, b] => writeln!(text, "  ASP; K {}; A {a}; B {b}", row[4]),
            _ => panic!("{row}"),
        };
        let Some([kind, numbers @ ..]) = row[6].as_array().map(|list| &list[..]) else {
            continue;
        };
        for (command, value) in ["XDE", "YDE", "ADE", "BDE", "CDE"].iter().zip(numbers) {
            let _ = writeln!(text, "  {command} {value}");
        }
        text += match kind.as_str().unwrap() {
            "reverse" => "  REV\n",
            "dec and return" => "  DAR\n",
            "bend" => "  BEN\n",
            _ => "",
        };
    }
    text + "SI 0 0\nGO\n"
}

/// An ideal lens of 50 mm, 3 mm beside its stop: the image is that of the centered lens, shifted.
/// The chief ray of the film's middle is inclined by 3 mm in 50, and nothing is distorted about it.
#[test]
fn distortion_of_a_decentered_lens_is_about_the_chief_ray_of_the_middle() {
    let text = r#"{"schema": "ivlens-1", "name": "a", "h_max": 10, "surfaces": [
        {"kind": "stop", "t": 1, "n_d": 1, "semi_diameter": 4},
        {"kind": "thin_lens", "focal_length": 50, "t": 50, "n_d": 1, "semi_diameter": 30,
         "decenter": [0, 3, 0], "decenter_after": [0, -3, 0]}]}"#;
    let sheet = LensSheet::of(&lens_of("a.json", text.to_owned())).unwrap();
    let middle = libm::atan(3.0 / 50.0).to_degrees();
    assert!((sheet.fields[0].angle_degrees - middle).abs() < 1e-6);
    assert!(
        (sheet.projection_scale - 50.0).abs() < 1e-3,
        "{}",
        sheet.projection_scale
    );
    for row in &sheet.fields {
        assert!(row.distortion_percent.unwrap().abs() < 1e-3, "{row:?}");
    }
}

fn reference() -> Vec<(String, Lens, Vec<Vec<f64>>)> {
    systems_of("tilts.json", code_v)
}

/// The systems of a file in `tests/lenses/reference/` that `crates/measure/mirrors_reference.py`
/// makes: the name, the lens and the rays. `text` is the file of a lens with the rows.
pub(super) fn systems_of(
    file: &str,
    text: impl Fn(&[Value]) -> String,
) -> Vec<(String, Lens, Vec<Vec<f64>>)> {
    let folder = concat!(env!("CARGO_MANIFEST_DIR"), "/../../tests/lenses/reference");
    let file = std::fs::read_to_string(format!("{folder}/{file}")).unwrap();
    let root: Value = serde_json::from_str(&file).unwrap();
    let system = |(name, system): (&String, &Value)| {
        let lens = lens_of(name, text(system["rows"].as_array().unwrap()));
        let rays = system["rays"].as_array().unwrap().iter();
        let list = |ray: &Value| -> Vec<f64> {
            let numbers = ray.as_array().unwrap().iter();
            numbers.map(|v| v.as_f64().unwrap()).collect()
        };
        (name.clone(), lens, rays.map(list).collect())
    };
    let systems = root["systems"].as_object().unwrap();
    systems.iter().map(system).collect()
}

pub(super) fn rays_of(all: &[Vec<f64>]) -> impl Iterator<Item = LensRay> {
    all.iter()
        .map(|ray| LensRay::new(DVec3::from_slice(&ray[..3]), DVec3::from_slice(&ray[3..6])))
}

/// The largest differences of hits and directions are printed for docs/accuracy.md.
#[test]
fn rays_through_tilted_surfaces_are_those_of_rayoptics_and_optiland() {
    let systems = reference();
    assert_eq!(systems.len(), 4);
    for (name, lens, rays) in systems {
        let [off, turned] = differences(&lens, &rays);
        println!("{name}: {off:.1e} mm, {turned:.1e}");
        assert!(off < 1e-11 && turned < 1e-12, "{name}: {off:e} {turned:e}");
    }
}

/// The largest differences of last hits, in millimeters, and of directions from those that are
/// known of the rays of a system.
pub(super) fn differences(lens: &Lens, rays: &[Vec<f64>]) -> [f64; 2] {
    assert_eq!(rays.len(), 36);
    let (mut off, mut turned) = (0.0f64, 0.0f64);
    for (ray, known) in rays_of(rays).zip(rays) {
        let [hit, out] = [6, 9].map(|at| DVec3::from_slice(&known[at..at + 3]));
        let path = lens.trace_path(&ray, Toward::Film, false);
        let found = path.outcome.unwrap();
        let start = lens.in_lens_space(found.origin);
        let end = lens.in_lens_space(found.origin + found.direction);
        off = off.max((*path.hits.last().unwrap() - hit).length());
        off = off.max((start - hit).length());
        turned = turned.max((end - start - out).length());
    }
    [off, turned]
}

/// Checks [`a_bundle_and_the_way_back_agree`] for the rays that pass through a system, which are
/// most of them.
pub(super) fn bundles_and_ways_back_agree(name: &str, lens: &Lens, rays: &[Vec<f64>]) {
    let mut passed = 0;
    for ray in rays_of(rays) {
        let Ok(out) = lens.trace_from_scene(&ray) else {
            continue;
        };
        passed += 1;
        a_bundle_and_the_way_back_agree(name, lens, (&ray, &out));
    }
    assert!(passed > 20, "{name}: {passed}");
}

#[test]
fn bundles_and_rays_from_the_film_take_the_same_paths_through_tilted_surfaces() {
    for (name, lens, rays) in reference() {
        bundles_and_ways_back_agree(&name, &lens, &rays);
    }
}

/// The lens turned end for end, and a lens of 2.5 times the size, take the same paths.
#[test]
fn a_tilted_lens_may_be_reversed_and_scaled() {
    for (name, lens, rays) in reference() {
        let reversed = Lens::new(lens.prescription().reversed());
        let large = lens.scaled(2.5);
        for ray in rays_of(&rays) {
            let Ok(out) = lens.trace_from_scene(&ray) else {
                continue;
            };
            let scaled = LensRay {
                origin: 2.5 * ray.origin,
                ..ray
            };
            let again = large.trace_from_scene(&scaled).unwrap();
            assert!((again.origin - 2.5 * out.origin).length() < 1e-11, "{name}");
            // From behind, z counts from the last vertex the other way.
            let end = lens.length();
            let turned = |v: DVec3| DVec3::new(v.x, v.y, -v.z);
            let back = LensRay::new(
                turned(out.origin - end * DVec3::Z) - 20.0 * turned(-out.direction),
                turned(-out.direction),
            );
            let home = reversed.trace_from_scene(&back).unwrap();
            let direction = turned(home.direction);
            assert!((direction + ray.direction).length() < 1e-12, "{name}");
            let origin = turned(home.origin - reversed.length() * DVec3::Z);
            let off = (origin - ray.origin).cross(ray.direction).length();
            assert!(off < 1e-10, "{name}: {off}");
        }
    }
}

#[test]
fn tilts_are_the_same_in_all_formats_that_hold_them() {
    for (name, lens, rays) in reference() {
        for target in [OutputFormat::Json, OutputFormat::Zemax, OutputFormat::CodeV] {
            let (text, _) = write(lens.prescription(), target).unwrap();
            let again = lens_of(&name, text);
            for ray in rays_of(&rays) {
                let ((a, d), (b, e)) = (leaving(&lens, &ray), leaving(&again, &ray));
                let direction = (d - e).length();
                assert!(direction < 1e-12, "{name} {target:?} {direction:e}");
                let off = (a - b).cross(d).length();
                assert!(off < 1e-10, "{name} {target:?} {off:e}");
            }
        }
        let refused = write(lens.prescription(), OutputFormat::Columns).unwrap_err();
        assert!(refused.message.contains("surface"), "{refused}");
    }
}

/// One system in the files of four programs, of which ray-optics and optiland wrote their own.
#[test]
fn tilts_are_read_from_the_files_of_other_programs() {
    let (_, lens, rays) = reference().remove(3);
    for ending in [".zmx", ".len", ".roa", "-optiland.json"] {
        let root = concat!(
            env!("CARGO_MANIFEST_DIR"),
            "/../../tests/lenses/dialects/tilt"
        );
        let text = std::fs::read_to_string(format!("{root}{ending}")).unwrap();
        let again = lens_of(ending, text);
        for ray in rays_of(&rays) {
            let ((a, d), (b, e)) = (leaving(&lens, &ray), leaving(&again, &ray));
            assert!((d - e).length() < 1e-13, "{ending}: {d} {e}");
            assert!((a - b).length() < 1e-11, "{ending}: {a} {b}");
        }
        // optiland's axis goes through the vertices less exactly than the breaks.
        let off = again.first_order().efl() / lens.first_order().efl() - 1.0;
        assert!(off.abs() < 1e-3, "{ending}: {off}");
    }
}

/// The place and the direction in lens space of a ray behind the lens.
fn leaving(lens: &Lens, ray: &LensRay) -> (DVec3, DVec3) {
    let out = lens.trace_path(ray, Toward::Film, false).outcome.unwrap();
    let start = lens.in_lens_space(out.origin);
    (
        start,
        lens.in_lens_space(out.origin + out.direction) - start,
    )
}

/// A plate of thickness t and index n at 45 degrees shifts a ray along the axis by
/// t sin θ (1 − cos θ/√(n² − sin² θ)), and the thin prism of a wedge of angle α turns it by
/// (n − 1) α.
#[test]
fn a_tilted_plate_shifts_the_axis_and_a_wedge_turns_it() {
    let plate = |tilt: f64, behind: f64| {
        let plane = |thickness, medium| Surface::sphere(0.0, thickness, medium, 50.0);
        let tilted = |degrees| Decenter {
            tilt: DVec3::new(degrees, 0.0, 0.0),
            ..Decenter::NONE
        };
        let front = Surface {
            frame: Some(Box::new(SurfaceFrame {
                before: tilted(tilt),
                after: Decenter::NONE,
            })),
            ..plane(10.0, Medium::constant(1.5))
        };
        let rear = Surface {
            frame: Some(Box::new(SurfaceFrame {
                before: tilted(behind),
                after: tilted(-tilt - behind),
            })),
            ..plane(0.0, Medium::air())
        };
        Lens::new(Prescription::new("plate", vec![front, rear]))
    };
    let axis = LensRay::new(DVec3::new(0.0, 0.0, -5.0), DVec3::Z);
    let lens = plate(45.0, 0.0);
    let out = lens.trace_from_scene(&axis).unwrap();
    let (sin, cos) = libm::sincos(45f64.to_radians());
    let shift = 10.0 * sin * (1.0 - cos / (1.5f64 * 1.5 - sin * sin).sqrt());
    // The tilt moves the plate's rear face up: the axis of the frame behind it is there.
    let place = lens.in_lens_space(out.origin).y;
    assert!((place.abs() - shift).abs() < 1e-12, "{place} {shift}");
    assert!((out.direction - DVec3::Z).length() < 1e-15);
    let wedge = plate(0.0, 0.01).trace_from_scene(&axis).unwrap();
    let turned = libm::asin(wedge.direction.y.abs()).to_degrees();
    assert!((turned / 0.005 - 1.0).abs() < 1e-6, "{turned}");
}

/// Behind a fold mirror a lens does what it does without it: the same spots, light and f-number.
#[test]
fn a_fold_mirror_changes_no_figure_of_a_lens() {
    let plain = Lens::named("double-gauss").unwrap();
    let mut lens = plain.prescription().clone();
    let back = plain.first_order().focal.unwrap().bfl;
    lens.surfaces.last_mut().unwrap().thickness = 40.0;
    let tilt = Decenter {
        tilt: DVec3::new(45.0, 0.0, 0.0),
        ..Decenter::NONE
    };
    lens.surfaces.push(Surface {
        is_mirror: true,
        frame: Some(Box::new(SurfaceFrame::returning(tilt))),
        ..Surface::sphere(0.0, back - 40.0, Medium::air(), 200.0)
    });
    let folded = Lens::new(Prescription {
        notes: Vec::new(),
        ..lens
    })
    .at_wavelength(plain.wavelength());
    assert!((folded.first_order().efl() / plain.first_order().efl() - 1.0).abs() < 1e-14);
    let (a, b) = (
        plain.real_f_number().unwrap(),
        folded.real_f_number().unwrap(),
    );
    assert!((a / b - 1.0).abs() < 1e-4, "{a} {b}");
    // Behind the mirror z counts from its vertex along the light.
    let (film, beyond) = (plain.length() + back, folded.length() + back - 40.0);
    for height in [0.0, 10.0, 20.0] {
        let at = DVec2::new(0.0, height);
        let (a, b) = (plain.irradiance(at, film), folded.irradiance(at, beyond));
        assert!((a / b - 1.0).abs() < 1e-4, "{height}: {a} {b}");
        let [a, b] = [(&plain, film), (&folded, beyond)]
            .map(|(lens, z)| lens.chief_ray(at, z).unwrap().direction);
        assert!((a - b).length() < 1e-12, "{height}");
    }
    assert!(SeidelSums::of(&folded, f64::INFINITY, 10.0, 10.0).is_none());
    // The film is above the mirror, or below it, as the light goes.
    let up = folded.in_lens_space(beyond * DVec3::Z);
    assert!(
        (up.z - folded.length()).abs() < 1e-9 && (up.y.abs() - back + 40.0).abs() < 1e-9,
        "{up}"
    );
}

/// Behind a lens with a decentered element, every ray of a grid that gets through is aimed at, the
/// light on the film is that of the grid, and most aims get through.
#[test]
fn the_pupil_of_a_decentered_lens_holds_all_its_light() {
    let mut lens = Lens::named("double-gauss").unwrap().prescription().clone();
    let decenter = Decenter {
        shift: DVec3::new(1.5, -2.0, 0.0),
        tilt: DVec3::new(-3.0, 2.0, 0.0),
    };
    let [front, rear] = [decenter, decenter.inverse()];
    let frame = |before, after| Some(Box::new(SurfaceFrame { before, after }));
    lens.surfaces[9].frame = frame(front, Decenter::NONE);
    lens.surfaces[10].frame = frame(Decenter::NONE, rear);
    all_light_is_found(&Lens::new(lens), 40.0, 20.0);
}

/// Checks that the light at points of the film is that of a grid of rays within a reach from the
/// axis, in millimeters on the rear vertex plane, and that rays are aimed where it is.
pub(super) fn all_light_is_found(lens: &Lens, reach: f64, film_radius: f64) {
    let film_z = lens.first_order().focal.unwrap().rear_focal_point;
    let target = PupilTarget::exit_pupil(lens, film_z, film_radius);
    for film in [
        DVec2::ZERO,
        DVec2::new(15.0, 0.0),
        DVec2::new(-15.0, 0.0),
        DVec2::new(3.0, -17.0),
        DVec2::new(-9.0, 12.0),
    ] {
        let origin = film.extend(film_z);
        let across = 400;
        let cell = 2.0 * reach / f64::from(across);
        let window = target.window(film);
        let (mut light, mut passed, mut aimed) = (0.0, 0u32, 0u32);
        for k in 0..across * across {
            // A point anywhere in each cell, so that edges along x and y are met evenly.
            let place =
                |i: i32, step: f64| cell * (f64::from(i) + (step * f64::from(k)).fract()) - reach;
            let aim = DVec2::new(
                place(k % across, 0.754_877_666_246_692_7),
                place(k / across, 0.569_840_290_998_053_2),
            );
            let direction = aim.extend(lens.length()) - origin;
            aimed += u32::from(window.contains(aim));
            if lens.trace_from_film(&LensRay { origin, direction }).is_ok() {
                assert!(window.contains(aim), "{film}: {aim}");
                passed += 1;
                let (z2, r2) = (direction.z * direction.z, direction.length_squared());
                light += cell * cell * z2 / (r2 * r2);
            }
        }
        let known = lens.irradiance(film, film_z);
        assert!(
            (known / light - 1.0).abs() < 2e-3,
            "{film}: {known} {light}"
        );
        let share = f64::from(passed) / f64::from(aimed);
        assert!(share > 0.9, "{film}: {share}");
    }
}

/// Ghosts between tilted faces are reversible.
#[test]
fn ghosts_of_a_tilted_lens_are_reversible() {
    let (_, lens, rays) = reference().swap_remove(0);
    let lens = lens.with_coating(Coating::Bare);
    let mut traced = 0;
    for pair in lens.ghost_pairs() {
        for ray in rays_of(&rays).take(6) {
            traced += usize::from(is_traced_back(&lens, &ray, pair));
        }
    }
    assert!(traced >= 6, "{traced}");
}
