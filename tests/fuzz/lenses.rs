//! Fuzz targets for prescriptions and for glass catalogues.

use std::sync::Arc;

use glam::DVec3;
use ivcam_base::diag::{Sink, Source, Span};
use ivcam_base::math::meters;
use ivcam_inventor::pose::CameraPose;
use ivcam_optics::film::FilmFormat;
use ivcam_optics::lens::{FocusMethod, Lens, LensRay, Toward};
use ivcam_optics::prescription::formats;
use ivcam_optics::prescription::formats::write::{OutputFormat, write};
use ivcam_optics::prescription::glass::agf;
use ivcam_optics::prescription::{Medium, Prescription, Surface};
use ivcam_render::camera::{Aim, Camera, LensCamera};

/// The largest number of surfaces of a lens that rays are traced through.
const MOST_TRACED: usize = 40;

fn read(text: &[u8]) -> Option<Prescription> {
    let source = Arc::new(Source::new("fuzzed.dat", text.to_vec()));
    let mut sink = Sink::new();
    let result = formats::read(&source, &mut sink);
    for message in sink.items() {
        std::hint::black_box(message.render(false).len());
    }
    result.ok()
}

/// Reads a prescription, writes it in every format, reads that again, and traces rays.
///
/// What has been written as JSON must be read again as the same surfaces. What has been written in
/// another format must be read again as the same number of surfaces, or fewer by those that have no
/// effect. Planes that only break the axis do not count: two breaks in a row may become one.
pub(super) fn lens(bytes: &[u8]) {
    let Some(lens) = read(bytes) else {
        return;
    };
    for target in [
        OutputFormat::Columns,
        OutputFormat::Zemax,
        OutputFormat::CodeV,
        OutputFormat::Json,
    ] {
        let Ok((text, _)) = write(&lens, target) else {
            continue;
        };
        let again = read(text.as_bytes());
        let again = again.unwrap_or_else(|| panic!("not read as {target:?}:\n{text}"));
        let count = again.surfaces.len() - breaks(&again);
        assert!(
            (effective(&lens) - breaks(&lens)..=lens.surfaces.len()).contains(&count),
            "{count} surfaces, written as {target:?}:\n{text}"
        );
        if target == OutputFormat::Json {
            assert_eq!(
                without_places(&again),
                without_places(&lens),
                "written as JSON:\n{text}"
            );
        }
    }
    if lens.surfaces.len() <= MOST_TRACED {
        trace(&Lens::new(lens));
    }
}

/// Returns the number of surfaces without the planes that have no effect, which some formats leave
/// out.
fn effective(lens: &Prescription) -> usize {
    let media = lens.surfaces.iter().map(|surface| &surface.medium);
    let before = std::iter::once(&lens.object_medium).chain(media);
    let all = lens.surfaces.iter().zip(before);
    all.filter(|(surface, before)| !surface.is_dummy(before))
        .count()
}

/// Returns the number of planes that only break the axis. Their aperture may be that of the beam.
fn breaks(lens: &Prescription) -> usize {
    let media = lens.surfaces.iter().map(|surface| &surface.medium);
    let before = std::iter::once(&lens.object_medium).chain(media);
    let all = lens.surfaces.iter().zip(before);
    let is_break = |(s, before): &(&Surface, &Medium)| {
        let is_idle = !s.is_stop && !s.is_mirror && s.medium == **before;
        is_idle && s.frame.is_some() && s.curvature.is_plane()
    };
    all.filter(is_break).count()
}

/// Returns the surfaces without their places in the file, and without the names of the glasses that
/// the file asked for, which are only reported when it is read.
fn without_places(lens: &Prescription) -> Vec<Surface> {
    let surfaces = lens.surfaces.iter().cloned();
    let without = |surface: Surface| Surface {
        span: Span::default(),
        medium: Medium {
            stands_for: None,
            ..surface.medium
        },
        ..surface
    };
    surfaces.map(without).collect()
}

/// Traces rays from the scene and from the film, and checks that those that pass are numbers.
fn trace(lens: &Lens) {
    std::hint::black_box((lens.first_order(), lens.real_f_number()));
    for i in 0..8 {
        let at = f64::from(i);
        let ray = LensRay::new(
            DVec3::new(0.0, 0.3 * at, -10.0),
            DVec3::new(0.0, 0.02 * at, 1.0),
        );
        if let Ok(out) = lens.trace_path(&ray, Toward::Film, i % 2 == 0).outcome {
            let numbers = out.origin.is_finite() && out.direction.is_finite();
            assert!(numbers, "a ray from the scene: {out:?}");
        }
    }
    let Ok((lens, focus)) = lens.focused(FocusMethod::Film, meters(3.0)) else {
        return;
    };
    let pose = CameraPose::view_all((DVec3::NEG_ONE, DVec3::ONE), 1.5);
    let camera = LensCamera::new(lens, focus, FilmFormat::STANDARD, Aim::ExitPupil, &pose);
    let camera = Camera::Lens(Box::new(camera)).posed(&pose, DVec3::ZERO);
    for i in 0..32u32 {
        let part = |n: u32| (f64::from(i * n % 32) + 0.5) / 32.0;
        if let Some(ray) = camera.at(part(5), part(7)).ray([part(11), part(13)]) {
            let numbers = ray.origin.is_finite() && ray.direction.is_finite();
            assert!(numbers, "a ray from the film: {ray:?}");
        }
    }
}

/// Reads a glass catalogue, and computes the indices of its glasses. A glass for the infrared has
/// none in visible light.
pub(super) fn glass(bytes: &[u8]) {
    let source = Arc::new(Source::new("fuzzed.agf", bytes.to_vec()));
    for glass in agf::read(&source).unwrap_or_default() {
        std::hint::black_box(glass.index(550.0));
    }
}
