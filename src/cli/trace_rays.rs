//! `ivcam lens LENS --trace`: traces a list of rays, as JSON, and draws them.

use std::io::Write;
use std::path::Path;
use std::sync::Arc;

use glam::{DVec2, DVec3};
use ivcam_base::diag::{Diagnostic, Result, Source, Span};
use ivcam_base::files::{MAX_TEXT, read_file, read_stream};
use ivcam_optics::diagram::drawing::Ink;
use ivcam_optics::diagram::{LensDiagram, SectionOptions};
use ivcam_optics::lens::{Lens, LensRay, LossKind, RayPath, Toward, trace};
use ivcam_optics::prescription::glass;
use serde::{Deserialize, Serialize};

use super::lens::wavelength;

/// The largest number of rays that are drawn. More would make a file that no program displays.
const DRAWN: usize = 20_000;

/// A ray to trace.
#[derive(Deserialize)]
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

/// The result of tracing a ray.
#[derive(Serialize)]
struct RayAnswer {
    status: &'static str,
    #[serde(skip_serializing_if = "Option::is_none")]
    surface: Option<usize>,
    #[serde(skip_serializing_if = "Option::is_none")]
    origin: Option<[f64; 3]>,
    #[serde(skip_serializing_if = "Option::is_none")]
    direction: Option<[f64; 3]>,
    hits: Vec<[f64; 3]>,
}

/// Traces the rays of a file, writes what became of them, and draws them if `diagram` is given.
/// The film of the drawing is at `film_z`, or at the focus.
pub(super) fn run(
    lens: &Lens,
    film_z: Option<f64>,
    file: &str,
    diagram: Option<&str>,
    out: &mut dyn Write,
) -> Result<i32> {
    let asked = read(file)?;
    let mut lenses: Vec<Lens> = vec![lens.clone()];
    let mut answers = Vec::with_capacity(asked.len());
    let mut drawn = Vec::new();
    for (i, ray) in asked.iter().enumerate() {
        let nm = match ray.wavelength_nm {
            Some(nm) => wavelength(nm).map_err(|e| e.in_file(file))?,
            None => lens.wavelength(),
        };
        let nm = glass::named_line(nm);
        let found = lenses.iter().position(|l| l.wavelength() == nm);
        let index = found.unwrap_or_else(|| {
            lenses.push(lens.at_wavelength(nm));
            lenses.len() - 1
        });
        let (start, path) = path(&lenses[index], i, ray).map_err(|e| e.in_file(file))?;
        if diagram.is_some() && drawn.len() < DRAWN {
            drawn.push((start, ray.from, path.clone()));
        }
        answers.push(answer(path));
    }
    if let Some(picture) = diagram {
        if asked.len() > DRAWN {
            super::status!(
                "warning: `{picture}` has the first {DRAWN} of {} rays",
                asked.len()
            );
        }
        super::sheet::save_drawing(&draw(lens, film_z, &drawn).drawing(), picture)?;
    }
    serde_json::to_writer(&mut *out, &answers)
        .map_err(std::io::Error::from)
        .and_then(|()| writeln!(out))
        .map_err(|e| Diagnostic::io("standard output", &e))?;
    Ok(0)
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
                r#"a ray is {"origin": [x, y, z], "direction": [x, y, z], "from": "scene" or "film"}"#,
            )
    })
}

/// Traces one ray. Returns it with its path.
fn path(lens: &Lens, number: usize, asked: &RayQuery) -> Result<(LensRay, RayPath)> {
    let ray = LensRay {
        origin: DVec3::from_array(asked.origin),
        direction: DVec3::from_array(asked.direction),
    };
    if trace::ray::unit(ray.direction).is_none() || !ray.origin.is_finite() {
        return Err(Diagnostic::error(format!(
            "ray {number} has no direction or no finite origin"
        ))
        .with_help("rays are counted from 0; a direction may have any length but 0"));
    }
    let toward = match asked.from {
        From::Scene => Toward::Film,
        From::Film => Toward::Scene,
    };
    Ok((ray, lens.trace_path(&ray, toward, asked.apertures)))
}

/// The answer for a path.
fn answer(path: RayPath) -> RayAnswer {
    let hits = path.hits.iter().map(|h| h.to_array()).collect();
    match path.outcome {
        Ok(ray) => RayAnswer {
            status: "passed",
            surface: None,
            origin: Some(ray.origin.to_array()),
            direction: Some(ray.direction.to_array()),
            hits,
        },
        Err(loss) => RayAnswer {
            status: match loss.kind {
                LossKind::Missed => "missed",
                LossKind::Blocked => "blocked",
                LossKind::TotalReflection => "total_reflection",
            },
            surface: Some(loss.surface),
            origin: None,
            direction: None,
            hits,
        },
    }
}

/// Draws the section with the rays, each in the color of what became of it. A ray is projected to
/// the plane of y and the axis.
fn draw(lens: &Lens, film_z: Option<f64>, rays: &[(LensRay, From, RayPath)]) -> LensDiagram {
    let focal = lens.first_order().focal;
    let film_z = film_z.or(focal.map(|f| f.rear_focal_point));
    let film_z = film_z.unwrap_or(1.3 * lens.length());
    let options = SectionOptions {
        fields: Vec::new(),
        ..SectionOptions::of(film_z, 0.0)
    };
    let mut diagram = LensDiagram::of(lens, options);
    let fates = [
        ("passed", Ink::Ray(0)),
        ("blocked by an aperture", Ink::Lost(2)),
        ("missed a surface", Ink::Lost(3)),
        ("totally reflected", Ink::Lost(1)),
    ];
    let mut counts = [0; 4];
    let lead = 0.25 * film_z.max(lens.length());
    for (start, from, path) in rays {
        let fate = match path.outcome {
            Ok(_) => 0,
            Err(loss) => match loss.kind {
                LossKind::Blocked => 1,
                LossKind::Missed => 2,
                LossKind::TotalReflection => 3,
            },
        };
        counts[fate] += 1;
        let points = drawn_path(lens, start, *from, path, (film_z, lead));
        diagram.add_path(points, fates[fate].1, fate > 0);
    }
    for ((name, ink), count) in fates.into_iter().zip(counts).filter(|(_, n)| *n > 0) {
        diagram.add_legend(format!("{name}: {count}"), ink);
    }
    diagram
}

/// The points of a ray on the drawing, as (z, y). A ray that starts farther off than `lead`, in
/// millimeters, is drawn from there.
fn drawn_path(
    lens: &Lens,
    start: &LensRay,
    from: From,
    path: &RayPath,
    (film_z, lead): (f64, f64),
) -> Vec<DVec2> {
    let flat = |p: DVec3| DVec2::new(p.z, p.y);
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
        points.push(flat(end));
    }
    points
}

/// The point where a ray crosses a plane, if that is near, and otherwise a point on the ray.
fn plane_hit(ray: &LensRay, d: DVec3, z: f64, lead: f64) -> DVec3 {
    let t = (z - ray.origin.z) / d.z;
    ray.origin + if (0.0..1e6).contains(&t) { t } else { lead } * d
}
