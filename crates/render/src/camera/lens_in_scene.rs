//! A lens as scene geometry: the approach that the 1999 paper proposed first and abandoned, because
//! Inventor has no exact part of a sphere. `LensSurface`, an extension node, is one.
//!
//! Lengths are in meters, in the camera's own space or at a camera's pose: the front vertex is at
//! the camera's position, the scene is toward −z, and the film, a `FilmCamera`, at +z. Only
//! spherical and plane surfaces without tilt are supported.

use std::fmt::Write as _;

use ivcam_base::diag::{Diagnostic, Result};
use ivcam_inventor::pose::{CameraPose, FilmPlane, axis_angle};
use ivcam_optics::lens::{Lens, Shape, Surface};

use super::rays::METERS_FROM_MM;

/// The lens as the text of an Inventor file: glass as transparent surfaces with the ratio of the
/// indices, black rims outside the semi-diameters in a black barrel, and the film behind. The lens
/// is at the origin, or at the pose of a camera.
///
/// # Errors
///
/// Returns an error if a surface is not a sphere or a plane centered on the axis, or reflects, or
/// if no surface has a semi-diameter.
pub fn lens_in_scene(lens: &Lens, film: &FilmPlane, place: Option<&CameraPose>) -> Result<String> {
    let surfaces = &lens.prescription().surfaces;
    let indices = lens.prescription().indices(lens.wavelength());
    let widest = lens.prescription().widest_semi_diameter();
    if widest == 0.0 {
        return Err(Diagnostic::error(format!(
            "`{}` has no semi-diameters, so it cannot be written as a solid",
            lens.name()
        ))
        .with_help("give the surfaces semi-diameters"));
    }
    if lens.prescription().is_folded() || lens.is_obstructed() || lens.has_outlines() {
        let message = format!(
            "`{}` has mirrors, tilts, a closed middle or apertures that are not round",
            lens.name()
        );
        return Err(Diagnostic::unsupported(message)
            .with_help("solids are lenses that light goes straight through"));
    }
    let barrel = 1.02 * widest;
    let mut profiles = Vec::with_capacity(surfaces.len());
    let mut z = 0.0;
    for (i, surface) in surfaces.iter().enumerate() {
        let radius = radius_of(surface).ok_or_else(|| {
            Diagnostic::error(format!(
                "surface {} of `{}` is not a sphere centered on the axis",
                i + 1,
                lens.name()
            ))
        })?;
        let rim = surface.semi_diameter.min(barrel);
        profiles.push(SolidProfile { z, radius, rim });
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
    // The barrel extends between the outermost rims. Beyond them it would cut off light.
    let from = profiles.first().map_or(0.0, |p| p.at(barrel));
    let to = profiles.last().map_or(0.0, |p| p.at(barrel));
    add_barrel(&mut out, barrel, from, to);
    out.push_str("}\n");
    Ok(out)
}

/// The cross-section of a surface, in millimeters.
struct SolidProfile {
    /// The z of the vertex.
    z: f64,
    /// The signed radius of curvature; 0 for a plane.
    radius: f64,
    /// The semi-diameter, at most the radius of the barrel.
    rim: f64,
}

impl SolidProfile {
    /// The distance from the axis at which the sphere ends: that of its equator; infinite for a
    /// plane.
    fn equator(&self) -> f64 {
        if self.radius == 0.0 {
            f64::INFINITY
        } else {
            self.radius.abs()
        }
    }

    /// The surface's z at a distance from the axis. Beyond the equator a flat ring continues it.
    fn at(&self, off: f64) -> f64 {
        if self.radius == 0.0 {
            return self.z;
        }
        let share = (off / self.radius).powi(2).min(1.0);
        self.z + self.radius * share / (1.0 + (1.0 - share).sqrt())
    }

    /// The distance from the axis at which the black rim ends: the barrel, or the intersection with
    /// a neighboring surface. Beyond that it would block rays between other surfaces.
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

    /// Writes the surface: transparent up to the rim, and black from there on. The black part is on
    /// the same sphere as far as that extends, because the lens tracer blocks rays on that sphere.
    fn write(&self, out: &mut String, end: f64, ratio: f64) {
        let mut zone = |z: f64, material: &str, radius: f64, inner: f64, outer: f64| {
            let [z, radius, inner, outer] = [z, radius, inner, outer].map(|v| v * METERS_FROM_MM);
            let _ = writeln!(
                out,
                "  Separator {{\n    MatrixTransform {{ matrix {Z_FROM_Y}  0 0 {z} 1 }}\n    {material}\n    \
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

/// The signed radius of a sphere, or 0 for a plane; none for other shapes.
fn radius_of(surface: &Surface) -> Option<f64> {
    match surface.shape {
        Shape::Sphere if surface.curvature.is_plane() => Some(0.0),
        Shape::Sphere => Some(surface.curvature.radius()),
        _ => None,
    }
}

/// The header of the file.
fn opening(name: &str) -> String {
    format!(
        "#Inventor V2.1 ascii\n#\n# {name}, as solids: meters, the front vertex at the origin, the film at +z.\n\n\
         DEF LENS Separator {{\n"
    )
}

/// Writes the transform to the pose of a camera.
fn add_place(out: &mut String, pose: &CameraPose) {
    let p = pose.position;
    let (axis, angle) = axis_angle(pose.orientation);
    let _ = writeln!(
        out,
        "  Translation {{ translation {} {} {} }}\n  Rotation {{ rotation {} {} {}  {angle} }}",
        p.x, p.y, p.z, axis.x, axis.y, axis.z
    );
}

/// Writes the film as a camera. Other programs use its height angle.
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
/// The first three rows of the matrix that maps the surfaces' y axis to the lens's z axis. A
/// rotation by an angle would be rounded.
const Z_FROM_Y: &str = "1 0 0 0  0 0 1 0  0 -1 0 0";

/// Writes the barrel as a black cylinder between two z in millimeters.
fn add_barrel(out: &mut String, barrel: f64, from: f64, to: f64) {
    if to <= from {
        return;
    }
    let [radius, middle, height] =
        [barrel, 0.5 * (from + to), to - from].map(|v| v * METERS_FROM_MM);
    let _ = writeln!(
        out,
        "  Separator {{\n    MatrixTransform {{ matrix {Z_FROM_Y}  0 0 {middle} 1 }}\n    {BLACK}\n    \
         Cylinder {{ parts SIDES radius {radius} height {height} }}\n  }}"
    );
}
