//! A lens as scene geometry: the approach that the 1999 paper proposed first and gave up, because
//! Inventor could not say a part of a sphere exactly. `LensSurface`, an extension node, can.
//!
//! Meters, in the camera's own space or where a camera stands: the front vertex is the camera's
//! place, the scene lies at its -z, the film, a `FilmCamera`, at its +z. Only spherical and plane surfaces without tilt.

use std::fmt::Write as _;

use crate::diag::{Diagnostic, Result};
use crate::lens::{Lens, Shape, Surface};
use crate::pose::{CameraPose, FilmPlane, axis_angle};

const METERS: f64 = 1e-3;

/// The lens as an Inventor file: glass as clear surfaces with the ratio of the indices,
/// everything outside the semi-diameters as black rims in a black barrel, and the film behind.
/// At the origin, or where a camera stands.
///
/// # Errors
/// A surface that is not a sphere or a plane about the axis.
pub fn lens_in_scene(lens: &Lens, film: &FilmPlane, place: Option<&CameraPose>) -> Result<String> {
    let surfaces = &lens.prescription().surfaces;
    let indices = lens.prescription().indices(lens.wavelength());
    let widest = surfaces.iter().map(|s| s.semi_diameter);
    let widest = widest.filter(|r| r.is_finite()).fold(0.0, f64::max);
    if widest == 0.0 {
        return Err(Diagnostic::error(format!(
            "`{}` has no apertures: it would be without end as a solid",
            lens.name()
        )));
    }
    let barrel = 1.02 * widest;
    let mut profiles = Vec::with_capacity(surfaces.len());
    let mut z = 0.0;
    for (i, surface) in surfaces.iter().enumerate() {
        let radius = radius_of(surface).ok_or_else(|| {
            Diagnostic::error(format!(
                "surface {} of `{}` is no sphere about the axis",
                i + 1,
                lens.name()
            ))
        })?;
        let rim = surface.semi_diameter.min(barrel);
        profiles.push(Profile { z, radius, rim });
        z += surface.thickness;
    }
    let mut out = opening(lens.name());
    if let Some(pose) = place {
        add_place(&mut out, pose);
    }
    add_film(&mut out, film);
    for (i, profile) in profiles.iter().enumerate() {
        let before = i.checked_sub(1).map(|b| &profiles[b]);
        let end = profile.end(before, profiles.get(i + 1), barrel);
        profile.write(&mut out, end, indices[i] / indices[i + 1]);
    }
    // Between the outermost rims: past them the barrel would cut what leaves the lens.
    let from = profiles.first().map_or(0.0, |p| p.at(barrel));
    let to = profiles.last().map_or(0.0, |p| p.at(barrel));
    add_barrel(&mut out, barrel, from, to);
    out.push_str("}\n");
    Ok(out)
}

/// A surface in section: millimeters, the radius 0 for a plane.
struct Profile {
    z: f64,
    radius: f64,
    rim: f64,
}

impl Profile {
    /// Where the surface's sphere ends: at its equator, or never.
    fn equator(&self) -> f64 {
        if self.radius == 0.0 {
            f64::INFINITY
        } else {
            self.radius.abs()
        }
    }

    /// The surface's z off the axis; past the equator a flat ring goes on.
    fn at(&self, off: f64) -> f64 {
        if self.radius == 0.0 {
            return self.z;
        }
        let share = (off / self.radius).powi(2).min(1.0);
        self.z + self.radius * share / (1.0 + (1.0 - share).sqrt())
    }

    /// How far out the black rim goes: to the barrel, or to where it meets a neighbor. Past that
    /// it would stand in the way of rays between other surfaces.
    fn end(&self, before: Option<&Self>, after: Option<&Self>, barrel: f64) -> f64 {
        const STEPS: u32 = 4096;
        let crosses = |off: &f64| {
            let z = self.at(*off);
            before.is_some_and(|b| b.at(*off) > z) || after.is_some_and(|a| a.at(*off) < z)
        };
        let step = (barrel - self.rim) / f64::from(STEPS);
        let mut places = (1..=STEPS).map(|i| self.rim + f64::from(i) * step);
        places.find(crosses).unwrap_or(barrel)
    }

    /// Clear to the rim, black from there on, on the same sphere as far as it goes, as the tracer
    /// of the camera model blocks rays where they meet that sphere.
    fn write(&self, out: &mut String, end: f64, ratio: f64) {
        let mut zone = |z: f64, material: &str, radius: f64, inner: f64, outer: f64| {
            let [z, radius, inner, outer] = [z, radius, inner, outer].map(|v| v * METERS);
            let _ = writeln!(
                out,
                "  Separator {{\n    MatrixTransform {{ matrix {TURN}  0 0 {z} 1 }}\n    {material}\n    \
                 LensSurface {{\n      {FIELDS}\n      \
                 radius {radius} inner {inner} outer {outer} refractionIndex {ratio}\n    }}\n  }}"
            );
        };
        let reach = end.min(self.equator());
        let rim = self.rim.min(reach);
        if ratio != 1.0 {
            zone(self.z, CLEAR, self.radius, 0.0, rim);
        }
        if rim < reach {
            zone(self.z, BLACK, self.radius, rim, reach);
        }
        if reach < end {
            zone(self.z + self.radius, BLACK, 0.0, reach, end);
        }
    }
}

/// 0 for a plane.
fn radius_of(surface: &Surface) -> Option<f64> {
    match surface.shape {
        Shape::Sphere if surface.curvature.is_plane() => Some(0.0),
        Shape::Sphere => Some(surface.curvature.radius()),
        _ => None,
    }
}

fn opening(name: &str) -> String {
    format!(
        "#Inventor V2.1 ascii\n#\n# {name}, as solids: meters, the front vertex at the origin, the film at +z.\n\n\
         DEF LENS Separator {{\n"
    )
}

fn add_place(out: &mut String, pose: &CameraPose) {
    let p = pose.position;
    let (axis, angle) = axis_angle(pose.orientation);
    let _ = writeln!(
        out,
        "  Translation {{ translation {} {} {} }}\n  Rotation {{ rotation {} {} {}  {angle} }}",
        p.x, p.y, p.z, axis.x, axis.y, axis.z
    );
}

/// A camera for other programs too: they see with its height angle.
fn add_film(out: &mut String, film: &FilmPlane) {
    let FilmPlane {
        height_angle,
        film_z,
        rear_z,
        rear_radius,
        irradiance,
    } = film;
    let _ = writeln!(
        out,
        "  FilmCamera {{\n    {FILM_FIELDS}\n    position 0 0 0 heightAngle {height_angle}\n    \
         filmDistance {film_z} rearDistance {rear_z} rearRadius {rear_radius} irradiance {irradiance}\n  }}"
    );
}

const FILM_FIELDS: &str = "fields [ SFVec3f position, SFFloat heightAngle, SFFloat filmDistance, SFFloat rearDistance, SFFloat rearRadius, SFFloat irradiance ]";
const BLACK: &str = "Material { ambientColor 0 0 0  diffuseColor 0 0 0  specularColor 0 0 0 }";
const CLEAR: &str =
    "Material { ambientColor 0 0 0  diffuseColor 0 0 0  specularColor 0 0 0  transparency 1 }";
const FIELDS: &str =
    "fields [ SFFloat radius, SFFloat inner, SFFloat outer, SFFloat refractionIndex ]";
/// Maps the surfaces' y to the lens's z, without a rounded rotation.
const TURN: &str = "1 0 0 0  0 0 1 0  0 -1 0 0";

fn add_barrel(out: &mut String, barrel: f64, from: f64, to: f64) {
    if to <= from {
        return;
    }
    let [radius, middle, height] = [barrel, 0.5 * (from + to), to - from].map(|v| v * METERS);
    let _ = writeln!(
        out,
        "  Separator {{\n    MatrixTransform {{ matrix {TURN}  0 0 {middle} 1 }}\n    {BLACK}\n    \
         Cylinder {{ parts SIDES radius {radius} height {height} }}\n  }}"
    );
}
