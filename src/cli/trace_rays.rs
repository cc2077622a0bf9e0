//! `ivcam lens LENS --trace`: traces a list of rays, as JSON, and draws them.

use std::path::Path;
use std::sync::Arc;

use glam::{DVec2, DVec3};
use ivcam_base::diag::{Diagnostic, Result, Source, Span};
use ivcam_base::files::{MAX_TEXT, read_file, read_stream};
use ivcam_optics::diagram::drawing::Ink;
use ivcam_optics::diagram::{LensDiagram, SectionOptions};
use ivcam_optics::lens::trace::ray::unit;
use ivcam_optics::lens::{Lens, LensRay, LossKind, RayPath, Toward};
use ivcam_optics::prescription::glass;
use serde::{Deserialize, Serialize};

/// The wavelengths that can be traced, in nanometers.
const WAVELENGTHS: std::ops::RangeInclusive<f64> = 100.0..=100_000.0;

/// The largest number of rays that are drawn. More would make a file that no program displays.
const DRAWN: usize = 20_000;

/// A ray to trace.
#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct RayQuery {
    origin: [f64; 3],
    direction: [f64; 3],
    #[serde(default)]
    from: From,
    #[serde(default = "yes")]
    apertures: bool,
    wavelength_nm: Option<f64>,
}

#[derive(Clone, Copy, Default, Deserialize)]
#[serde(rename_all = "lowercase")]
enum From {
    #[default]
    Scene,
    Film,
}

fn yes() -> bool {
    true
}

/// What becomes of a ray: its loss, its status in JSON, its name in the legend, and its color.
const FATES: [(Option<LossKind>, &str, &str, Ink); 4] = [
    (None, "passed", "passed", Ink::Ray(0)),
    (BLOCKED, "blocked", "blocked by an aperture", Ink::Lost(2)),
    (MISSED, "missed", "missed a surface", Ink::Lost(3)),
    (
        REFLECTED,
        "total_reflection",
        "totally reflected",
        Ink::Lost(1),
    ),
];
const BLOCKED: Option<LossKind> = Some(LossKind::Blocked);
const MISSED: Option<LossKind> = Some(LossKind::Missed);
const REFLECTED: Option<LossKind> = Some(LossKind::TotalReflection);

/// Returns the index in [`FATES`] of what became of a ray.
fn fate(path: &RayPath) -> usize {
    let loss = path.outcome.err().map(|loss| loss.kind);
    let found = FATES.iter().position(|(kind, ..)| *kind == loss);
    found.unwrap_or(0)
}

/// The result of tracing a ray.
#[derive(Serialize)]
struct RayAnswer<'a> {
    status: &'static str,
    #[serde(skip_serializing_if = "Option::is_none")]
    surface: Option<usize>,
    #[serde(skip_serializing_if = "Option::is_none")]
    origin: Option<DVec3>,
    #[serde(skip_serializing_if = "Option::is_none")]
    direction: Option<DVec3>,
    hits: &'a [DVec3],
}

/// A ray with its path through the lens.
struct TracedRay {
    start: LensRay,
    from: From,
    path: RayPath,
}

/// The rays of a list, traced.
pub(super) struct Traced(Vec<TracedRay>);

impl Traced {
    /// Reads a list of rays and traces them.
    ///
    /// # Errors
    /// Fails if the list cannot be read, or if a ray of it cannot be traced.
    pub(super) fn read(lens: &Lens, file: &str) -> Result<Self> {
        let mut lenses: Vec<Lens> = vec![lens.clone()];
        let mut traced = Vec::new();
        for (number, ray) in read(file)?.iter().enumerate() {
            let nm = ray.wavelength_nm.map_or(Ok(lens.wavelength()), wavelength);
            let nm = glass::named_line(nm.map_err(|e| e.in_file(file))?);
            let found = lenses.iter().position(|l| l.wavelength() == nm);
            let index = found.unwrap_or_else(|| {
                lenses.push(lens.at_wavelength(nm));
                lenses.len() - 1
            });
            let ray = trace(&lenses[index], number, ray);
            traced.push(ray.map_err(|e| e.in_file(file))?);
        }
        Ok(Self(traced))
    }

    /// Returns what became of the rays, as JSON.
    ///
    /// # Errors
    /// Fails if the result cannot be written as JSON.
    pub(super) fn json(&self) -> Result<String> {
        let answers: Vec<RayAnswer<'_>> = self.0.iter().map(|ray| answer(&ray.path)).collect();
        let text = serde_json::to_string(&answers);
        let text = text.map_err(|e| Diagnostic::io("standard output", &e.into()))?;
        Ok(text + "\n")
    }

    /// Draws the section with the rays, each in the color of what became of it. A ray is projected
    /// to the plane of y and the axis. The film is at `film_z`, if it has a place.
    pub(super) fn diagram(&self, lens: &Lens, film_z: Option<f64>, file: &str) -> LensDiagram {
        let all = self.0.len();
        if all > DRAWN {
            super::status!("warning: `{file}` has the first {DRAWN} of {all} rays");
        }
        let film_z = film_z.unwrap_or(1.3 * lens.length());
        let options = SectionOptions {
            fields: Vec::new(),
            ..SectionOptions::of(film_z, 0.0)
        };
        let mut diagram = LensDiagram::of(lens, options);
        let mut counts = [0; 4];
        let lead = 0.25 * film_z.max(lens.length());
        for ray in self.0.iter().take(DRAWN) {
            let fate = fate(&ray.path);
            counts[fate] += 1;
            diagram.add_path(drawn_path(lens, ray, film_z, lead), FATES[fate].3, fate > 0);
        }
        for ((.., name, ink), count) in FATES.into_iter().zip(counts).filter(|(_, n)| *n > 0) {
            diagram.add_legend(format!("{name}: {count}"), ink);
        }
        diagram
    }
}

/// Reads a list of rays.
fn read(file: &str) -> Result<Vec<RayQuery>> {
    let bytes = match file {
        "-" => read_stream(std::io::stdin(), "standard input", MAX_TEXT)?,
        _ => read_file(Path::new(file), MAX_TEXT)?,
    };
    let source = Arc::new(Source::new(file, bytes));
    serde_json::from_slice(&source.bytes).map_err(|error| {
        let before: usize = source
            .bytes
            .split_inclusive(|&b| b == b'\n')
            .take(error.line().saturating_sub(1))
            .map(<[u8]>::len)
            .sum();
        let at = (before + error.column().saturating_sub(1)).min(source.bytes.len());
        let text = error.to_string();
        let reason = text.rsplit_once(" at line").map_or(text.as_str(), |(reason, _)| reason);
        Diagnostic::error(format!("this is not a list of rays: {reason}"))
            .at(&source, Span::at(at))
            .with_help(
                r#"a ray is {"origin": [x, y, z], "direction": [x, y, z]}; "from": "scene" or "film", "apertures": true or false and "wavelength_nm" may follow"#,
            )
    })
}

/// Checks that a wavelength in nanometers can be traced.
pub(super) fn wavelength(nm: f64) -> Result<f64> {
    if WAVELENGTHS.contains(&nm) {
        return Ok(nm);
    }
    Err(
        Diagnostic::error(format!("a wavelength of {nm} nm can't be traced"))
            .with_help("wavelengths are in nanometers; visible light is 380 to 750"),
    )
}

/// Traces one ray.
fn trace(lens: &Lens, number: usize, asked: &RayQuery) -> Result<TracedRay> {
    let start = LensRay::new(
        DVec3::from_array(asked.origin),
        DVec3::from_array(asked.direction),
    );
    if unit(start.direction).is_none() || !start.origin.is_finite() {
        let text = format!("ray {number} has no direction or no finite origin");
        return Err(Diagnostic::error(text)
            .with_help("rays are counted from 0; a direction may have any length but 0"));
    }
    let toward = match asked.from {
        From::Scene => Toward::Film,
        From::Film => Toward::Scene,
    };
    let path = lens.trace_path(&start, toward, asked.apertures);
    let from = asked.from;
    Ok(TracedRay { start, from, path })
}

/// The answer for a path.
fn answer(path: &RayPath) -> RayAnswer<'_> {
    let ray = path.outcome.ok();
    RayAnswer {
        status: FATES[fate(path)].1,
        surface: path.outcome.err().map(|loss| loss.surface),
        origin: ray.map(|ray| ray.origin),
        direction: ray.map(|ray| ray.direction),
        hits: &path.hits,
    }
}

/// Returns the points of a ray on the drawing, as (z, y). A ray that starts farther off than
/// `lead`, in millimeters, is drawn from there.
fn drawn_path(lens: &Lens, ray: &TracedRay, film_z: f64, lead: f64) -> Vec<DVec2> {
    let TracedRay { start, from, path } = ray;
    let flat = |p: DVec3| DVec2::new(p.z, p.y);
    let start = &match from {
        From::Scene => *start,
        From::Film => in_lens_space(lens, start),
    };
    let d = start.direction.normalize();
    let near = match (path.hits.first(), from) {
        (Some(hit), _) => *hit,
        // A ray that missed its first surface is drawn to that surface's vertex plane.
        (None, From::Scene) => plane_hit(start, d, 0.0, lead),
        (None, From::Film) => plane_hit(start, d, lens.length(), lead),
    };
    let before = (near - start.origin).dot(d).clamp(0.0, lead);
    let mut points = vec![flat(near - before * d)];
    match path.hits.is_empty() {
        true => points.push(flat(near)),
        false => points.extend(path.hits.iter().map(|p| flat(*p))),
    }
    if let Ok(out) = path.outcome {
        let end = match from {
            From::Scene if out.direction.z > 1e-6 => out.at_z(film_z.max(out.origin.z)),
            _ => out.origin + lead * out.direction,
        };
        let end = match from {
            From::Scene => lens.in_lens_space(end),
            From::Film => end,
        };
        points.push(flat(end));
    }
    points
}

/// The ray in lens space of one that has the coordinates behind the lens.
fn in_lens_space(lens: &Lens, ray: &LensRay) -> LensRay {
    let origin = lens.in_lens_space(ray.origin);
    LensRay::new(
        origin,
        lens.in_lens_space(ray.origin + ray.direction) - origin,
    )
}

/// The point where a ray crosses a plane, if that is near, and otherwise a point on the ray.
fn plane_hit(ray: &LensRay, d: DVec3, z: f64, lead: f64) -> DVec3 {
    let t = (z - ray.origin.z) / d.z;
    ray.origin + if (0.0..1e6).contains(&t) { t } else { lead } * d
}
