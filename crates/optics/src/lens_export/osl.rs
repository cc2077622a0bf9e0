//! A camera for Blender's Cycles, in the Open Shading Language.
//!
//! The shader traces every ray through the surfaces of the lens, from the film into the scene. A
//! table of the exit pupil over the radius on the film says where on the rear vertex plane to aim,
//! and the ray is weighted as ivcam's exposure 1 is: white on the axis with the focus at infinity.

use std::fmt::Write as _;

use glam::DVec2;
use ivcam_base::diag::{Diagnostic, Result};

use crate::lens::pupil::search::pupil_search::PupilSearch;
use crate::lens::{Iris, Shape, Surface};
use crate::lens_export::view::{CHANNELS, View, identifier};
use crate::prescription::surface::MAX_POWER;

/// The number of radii in the table of the pupil.
const RADII: usize = 65;
/// The number of points on the outline of a pupil.
const OUTLINE: usize = 96;
/// What a box of the table is enlarged by, as a share of its half width, for what linear
/// interpolation between neighbors cuts off. No test measures that between the radii. A larger
/// value is safe: a margin of .02 enlarges the area by 4%, whose rays are lost.
const MARGIN: f64 = 0.02;
/// The semi-diameter in millimeters of a surface without a limit; the language has no infinity.
const UNLIMITED: f64 = 1e30;

/// The tracing of the shader, behind the tables. Lengths are in millimeters, as in the tables: z
/// grows toward the film, and the front vertex is the origin.
const TRACE: &str = include_str!("trace.osl");

/// The box around the exit pupil of a film point at a radius: radially from `low` to `high`, across
/// from −`half` to `half`, in millimeters on the rear vertex plane.
#[derive(Clone, Copy, Debug, Default)]
struct PupilBox {
    low: f64,
    high: f64,
    half: f64,
}

/// The shader's text.
///
/// # Errors
///
/// Returns an error if no light reaches the axis, and for mirrors, obstructions, ideal
/// lenses and aspheres measured along a normal, which the shader does not trace.
pub fn osl(view: &View<'_>) -> Result<String> {
    let lens = view.lens;
    if lens.prescription().is_folded() || lens.is_obstructed() || lens.has_outlines() {
        let message = format!(
            "`{}` has mirrors, tilts, a closed middle or apertures that are not round",
            lens.name()
        );
        return Err(Diagnostic::unsupported(message)
            .with_help("the shader traces lenses that light goes straight through"));
    }
    let is_other = |s: &Surface| {
        matches!(
            s.shape,
            Shape::NormalAsphere { .. } | Shape::ThinLens { .. }
        )
    };
    if lens.prescription().surfaces.iter().any(is_other) {
        let message = format!(
            "`{}` has an ideal lens, or an asphere measured along a normal",
            lens.name()
        );
        return Err(Diagnostic::unsupported(message)
            .with_help("the shader traces glass, and aspheres that are measured along the axis"));
    }
    // What `ivcam render` takes for exposure 1: the axis with the film at the focus of infinity.
    let at_infinity = lens.first_order().focal.map(|f| f.rear_focal_point);
    let places = at_infinity.into_iter().chain([view.conjugate.film_z]);
    let light = places
        .map(|z| lens.irradiance(DVec2::ZERO, z))
        .find(|light| *light > 0.0);
    let Some(light) = light else {
        return Err(
            Diagnostic::error(format!("no light gets through `{}`", lens.name()))
                .with_help("open its stop"),
        );
    };
    let mut text = header(view, light);
    parameters(&mut text, view);
    tables(&mut text, view);
    text += TRACE;
    Ok(text)
}

/// The index of the stop.
fn stop(view: &View<'_>) -> usize {
    view.lens.first_order().stop.unwrap_or(0)
}

/// The number of coefficients of a surface's polynomial, from power 0 on.
fn powers(view: &View<'_>) -> usize {
    let surfaces = &view.lens.prescription().surfaces;
    1 + surfaces.iter().map(highest_power).max().unwrap_or(0)
}

/// The comments and the macros, with the irradiance of exposure 1.
fn header(view: &View<'_>, light: f64) -> String {
    let prescription = view.lens.prescription();
    let mut text = String::new();
    for line in view.conditions() {
        let _ = writeln!(text, "// {line}");
    }
    text += "// In Blender: camera type Custom, with this file. The camera is at the front vertex and\n\
             // looks along its own -Z; the render's shape should be that of the film.\n";
    if prescription.iris != Iris::Round {
        text += "// The iris is taken as round.\n";
    }
    let _ = writeln!(text, "#define SURFACES {}", prescription.surfaces.len());
    let _ = writeln!(text, "#define POWERS {}", powers(view));
    let _ = writeln!(text, "#define RADII {RADII}\n#define STOP {}", stop(view));
    let _ = writeln!(
        text,
        "#define LIGHT {light:e}\n#define REACH {:?}",
        view.rays.reach
    );
    text
}

/// The name of the shader and its parameters.
fn parameters(text: &mut String, view: &View<'_>) {
    let prescription = view.lens.prescription();
    let film = view.frame.film;
    // A stop without a limit has an infinite semi-diameter.
    let stop = prescription.surfaces[stop(view)]
        .semi_diameter
        .min(UNLIMITED);
    let _ = writeln!(text, "\nshader ivcam_{}(", identifier(view.lens.name()));
    for (name, value, help) in [
        ("film_width", film.x, "width of the film in millimeters"),
        ("film_height", film.y, "height of the film in millimeters"),
        (
            "film_z",
            view.conjugate.film_z,
            "film behind the front vertex in millimeters",
        ),
        ("stop", stop, "semi-diameter of the stop in millimeters"),
        ("exposure", 1.0, "factor of the exposure"),
        ("scale", 0.001, "scene units per millimeter"),
    ] {
        let _ = writeln!(
            text,
            "    float {name} = {value:?} [[ string help = \"{help}\" ]],"
        );
    }
    let dispersive = i32::from(prescription.is_dispersive());
    let _ = writeln!(
        text,
        "    int dispersion = {dispersive} [[ string widget = \"checkBox\", string help = \"color of the glass\" ]],"
    );
    *text += "    output point position = 0.0,\n    output vector direction = 0.0,\n    \
              output color throughput = 0.0)\n{\n";
}

/// The surfaces, the indices and the pupil.
fn tables(text: &mut String, view: &View<'_>) {
    let prescription = view.lens.prescription();
    let surfaces = &prescription.surfaces;
    let column = |f: fn(&Surface) -> f64| surfaces.iter().map(f).collect::<Vec<_>>();
    let mut z = 0.0;
    let mut vertices = Vec::new();
    for surface in surfaces {
        vertices.push(z);
        z += surface.thickness;
    }
    array(text, "vertex", &vertices);
    array(text, "curvature", &column(|s| s.curvature.per_mm()));
    array(text, "rim", &column(|s| s.semi_diameter.min(UNLIMITED)));
    let conic = column(|s| match s.shape {
        Shape::Conic { k } | Shape::Asphere { k, .. } => k,
        _ => 0.0,
    });
    array(text, "conic", &conic);
    let flag = |s: &Surface| {
        if matches!(s.shape, Shape::Sphere) {
            "0"
        } else {
            "1"
        }
    };
    let flags: Vec<&str> = surfaces.iter().map(flag).collect();
    let _ = writeln!(
        text,
        "    int aspheric[{}] = {{ {} }};",
        flags.len(),
        flags.join(", ")
    );
    let powers = powers(view);
    let terms = |s: &Surface| match &s.shape {
        Shape::Asphere { terms, .. } => terms[..powers].to_vec(),
        _ => vec![0.0; powers],
    };
    array(
        text,
        "term",
        &surfaces.iter().flat_map(terms).collect::<Vec<_>>(),
    );
    // The index in front of every surface and, last, behind the lens: at the wavelength of the
    // export, then for red, green and blue.
    let lines = std::iter::once(view.lens.wavelength()).chain(CHANNELS);
    let indices: Vec<f64> = lines.flat_map(|nm| prescription.indices(nm)).collect();
    array(text, "index", &indices);
    let pupil = pupil_table(view);
    let column = |f: fn(&PupilBox) -> f64| pupil.iter().map(f).collect::<Vec<_>>();
    array(text, "pupil_low", &column(|b| b.low));
    array(text, "pupil_high", &column(|b| b.high));
    array(text, "pupil_half", &column(|b| b.half));
    let _ = writeln!(text, "    float rear = {:?};", view.lens.length());
}

/// The highest power of r in the polynomial of a surface; 0 without one.
fn highest_power(surface: &Surface) -> usize {
    match &surface.shape {
        Shape::Asphere { terms, .. } => (0..=MAX_POWER)
            .rev()
            .find(|p| terms[*p] != 0.0)
            .unwrap_or(0),
        _ => 0,
    }
}

/// The boxes around the exit pupil at evenly spaced radii up to the end of the light.
///
/// They contain the pupils of red, green and blue, too.
fn pupil_table(view: &View<'_>) -> Vec<PupilBox> {
    let is_dispersive = view.lens.prescription().is_dispersive();
    let channels = CHANNELS.into_iter().filter(|_| is_dispersive);
    let lines = std::iter::once(view.lens.wavelength()).chain(channels);
    let lenses: Vec<_> = lines.map(|nm| view.lens.at_wavelength(nm)).collect();
    let searches: Vec<_> = lenses.iter().map(PupilSearch::new).collect();
    let at = |k: usize| {
        let radius = view.rays.reach * k as f64 / (RADII - 1) as f64;
        let film = DVec2::new(0.0, radius).extend(view.conjugate.film_z);
        let mut found: Option<PupilBox> = None;
        for search in &searches {
            let Some((center, rims)) = search.outline_points(film, OUTLINE) else {
                continue;
            };
            for point in rims.iter().map(|rim| center + *rim) {
                let all = found.get_or_insert(PupilBox {
                    low: point.y,
                    high: point.y,
                    half: 0.0,
                });
                all.low = all.low.min(point.y);
                all.high = all.high.max(point.y);
                all.half = all.half.max(point.x.abs());
            }
        }
        let all = found.unwrap_or_default();
        let margin = MARGIN * all.half.max(0.5 * (all.high - all.low));
        PupilBox {
            low: all.low - margin,
            high: all.high + margin,
            half: all.half + margin,
        }
    };
    (0..RADII).map(at).collect()
}

fn array(text: &mut String, name: &str, values: &[f64]) {
    let words: Vec<String> = values.iter().map(|v| format!("{:?}", *v as f32)).collect();
    let lines: Vec<String> = words.chunks(8).map(|line| line.join(", ")).collect();
    let _ = writeln!(
        text,
        "    float {name}[{}] = {{\n        {} }};",
        values.len(),
        lines.join(",\n        ")
    );
}
