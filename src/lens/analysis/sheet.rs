//! The data sheet of a lens: the data of its curves and tables, computed from rays.
//!
//! Lengths are in millimeters, heights are on the film, and the object is at infinity. For a lens
//! without rotational symmetry the sheet shows the meridian of y.

use std::f64::consts::TAU;

use glam::{DVec2, DVec3};
use serde::Serialize;

use crate::lens::analysis::beam::{Beam, polygon_area};
use crate::lens::analysis::diffraction::{Openings, Wavefront};
use crate::lens::lens::Lens;
use crate::lens::optics::breathing::Breathing;
use crate::lens::trace::ray::{LensRay, Toward};
use crate::prescription::about::About;
use crate::prescription::glass::medium::{C_LINE, D_LINE, F_LINE};
use crate::prescription::surface::Plane;

/// The number of steps of the curves over the film's height.
const STEPS: usize = 40;
/// The number of rays along each side of the grid across a beam.
const GRID: usize = 64;
/// The number of steps of the curves over frequency.
const FREQUENCIES: usize = 40;
/// The wavelengths in nanometers from which the modulation in white light is computed, with the
/// luminous efficiency of each (CIE 1924).
const EFFICIENCY: [(f64, f64); 5] = [
    (480.0, 0.139),
    (520.0, 0.710),
    (560.0, 0.995),
    (600.0, 0.631),
    (640.0, 0.175),
];
/// The heights for which the sheet has spots, modulation and pupils, as shares of the full height.
const POINT_HEIGHTS: [f64; 4] = [0.0, 0.5, 0.7, 1.0];

/// The data sheet of a lens. Lengths are in millimeters.
#[derive(Clone, Debug, Serialize)]
pub struct LensSheet {
    /// The z of the film, from the front vertex: the best focus on the axis by real rays.
    pub film_z: f64,
    /// The distance from the paraxial focus to the film.
    pub focus_shift: f64,
    /// Half of the film's diagonal.
    pub image_height: f64,
    /// The angle of the chief ray that arrives at `image_height`, in degrees.
    pub half_field_degrees: f64,
    /// The projection relative to which distortion is given: `f tan θ`, or `f θ` for fields of more
    /// than 120 degrees.
    pub projection: &'static str,
    /// Whether the indices of the glasses depend on the wavelength.
    pub dispersive: bool,
    /// The change of the field and the exposure with the distance, by the focusing group if there
    /// is one, and otherwise by the film.
    pub breathing: Vec<Breathing>,
    /// The curves over the film's height.
    pub fields: Vec<FieldRow>,
    /// The longitudinal spherical aberration.
    pub spherical: Vec<Zone>,
    /// The longitudinal color.
    pub color: Vec<ColorRow>,
    /// The images of points at four heights.
    pub points: Vec<PointImage>,
    /// The frequencies of the modulation curves, in line pairs per millimeter.
    pub frequencies: Vec<f64>,
}

/// The properties of the image at a height on the film. Lengths are in millimeters.
#[derive(Clone, Copy, Debug, Serialize)]
pub struct FieldRow {
    /// The height on the film.
    pub height: f64,
    /// The angle of the chief ray in the scene, in degrees.
    pub angle_degrees: f64,
    /// The distortion relative to [`LensSheet::projection`].
    pub distortion_percent: Option<f64>,
    /// The irradiance over that on the axis.
    pub relative_illumination: f64,
    /// The distance from the film to the focus of rays in the meridian near the chief ray.
    pub tangential_focus: Option<f64>,
    /// The distance from the film to the focus of rays across the meridian near the chief ray.
    pub sagittal_focus: Option<f64>,
    /// The image height at the F line minus that at the d line.
    pub lateral_f: Option<f64>,
    /// The image height at the C line minus that at the d line.
    pub lateral_c: Option<f64>,
}

/// The distances from the film at which rays of a zone of the pupil cross the axis, in millimeters.
#[derive(Clone, Copy, Debug, Serialize)]
pub struct Zone {
    /// The height of the rays in front of the lens, over that of the widest beam.
    pub pupil: f64,
    /// The distance at the F line.
    pub focus_f: Option<f64>,
    /// The distance at the d line.
    pub focus_d: Option<f64>,
    /// The distance at the C line.
    pub focus_c: Option<f64>,
}

/// The paraxial focus at a wavelength.
#[derive(Clone, Copy, Debug, Serialize)]
pub struct ColorRow {
    /// The wavelength in nanometers.
    pub wavelength_nm: f64,
    /// The distance from the focus of the d line, in millimeters.
    pub focus: f64,
}

/// The image of a point at infinity. Lengths are in millimeters.
#[derive(Clone, Debug, Serialize)]
pub struct PointImage {
    /// The height on the film.
    pub height: f64,
    /// The angle of the chief ray in the scene, in degrees.
    pub angle_degrees: f64,
    /// The root mean square radius of the spot at the d line.
    pub rms: f64,
    /// The points at which rays of the F, d and C lines arrive, relative to the centroid of the d
    /// line.
    #[serde(skip)]
    pub spots: [Vec<DVec2>; 3],
    /// The outline of the beam that gets through, perpendicular to the chief ray, over the radius
    /// of the axial beam.
    pub pupil: Vec<[f64; 2]>,
    /// The cross-section of the beam over that of the axial beam.
    pub pupil_area: f64,
    /// The modulation by rays alone.
    pub geometric: Modulation,
    /// The modulation with diffraction.
    pub diffraction: Modulation,
}

/// The modulation at the frequencies of the sheet.
#[derive(Clone, Debug, Default, Serialize)]
pub struct Modulation {
    /// The modulation of lines across the meridian.
    pub tangential: Vec<f64>,
    /// The modulation of lines along the meridian.
    pub sagittal: Vec<f64>,
}

impl LensSheet {
    /// Computes the data sheet; none for an afocal lens, or for one that lets no light through.
    pub fn of(lens: &Lens) -> Option<Self> {
        let paraxial = lens.first_order().focal?.rear_focal_point;
        let film_z = lens.best_focus(f64::INFINITY).unwrap_or(paraxial);
        let about = About::of(lens.prescription());
        let image_height = full_height(lens, &about, film_z)?;
        let lines = [F_LINE, lens.wavelength(), C_LINE].map(|nm| lens.at_wavelength(nm));
        let half = angle_at(lens, image_height, film_z).unwrap_or(0.0);
        let projection = if half > 60f64.to_radians() {
            "f θ"
        } else {
            "f tan θ"
        };
        let mut this = Self {
            film_z,
            focus_shift: film_z - paraxial,
            image_height,
            half_field_degrees: half.to_degrees(),
            projection,
            dispersive: lens.prescription().is_dispersive(),
            breathing: lens.breathing(lens.default_focus_method(), image_height),
            fields: Vec::new(),
            spherical: zones(&lines, film_z),
            color: color(lens),
            points: Vec::new(),
            frequencies: frequencies(image_height),
        };
        this.fields = this.field_rows(lens, &lines);
        let beams: Vec<_> = POINT_HEIGHTS
            .iter()
            .filter_map(|share| Beam::of(lens, share * image_height, film_z, f64::INFINITY))
            .collect();
        let axial = beams.first()?.outline_radius();
        this.points = beams
            .iter()
            .filter_map(|b| point_image(b, &lines, axial, &this))
            .collect();
        Some(this)
    }

    /// The curves over the film's height.
    fn field_rows(&self, lens: &Lens, lines: &[Lens; 3]) -> Vec<FieldRow> {
        let center = lens.irradiance(DVec2::ZERO, self.film_z);
        let scale_at = |height: f64| {
            let distortion = lens.distortion(Plane::Y, height, self.film_z)?;
            let relative = match self.projection {
                "f θ" => distortion.f_theta,
                _ => distortion.f_tan,
            };
            Some((distortion.angle, 1.0 + relative))
        };
        // Off the paraxial focus the image as a whole has another scale, which is not distortion.
        let scale = scale_at(1e-4 * self.image_height).map_or(1.0, |(_, scale)| scale);
        let row = |i: usize| {
            let height = self.image_height * i as f64 / STEPS as f64;
            let film = DVec2::new(0.0, height);
            let distortion = scale_at(height);
            let percent = distortion.map(|(_, local)| 100.0 * (local / scale - 1.0));
            let angle = if i == 0 {
                0.0
            } else {
                distortion.map_or(f64::NAN, |(angle, _)| angle)
            };
            let lateral = |line: &Lens| {
                let there = line.image_height(angle, height, self.film_z)?;
                Some(there - height).filter(|d| d.is_finite() && d.abs() < 0.2 * height.max(1e-9))
            };
            let (tangential_focus, sagittal_focus) = close_foci(lens, film, self.film_z);
            FieldRow {
                height,
                angle_degrees: angle.to_degrees(),
                distortion_percent: if i == 0 {
                    Some(0.0)
                } else {
                    percent.filter(|p| p.is_finite())
                },
                relative_illumination: lens.irradiance(film, self.film_z) / center,
                tangential_focus,
                sagittal_focus,
                lateral_f: if i == 0 {
                    Some(0.0)
                } else {
                    lateral(&lines[0])
                },
                lateral_c: if i == 0 {
                    Some(0.0)
                } else {
                    lateral(&lines[2])
                },
            }
        };
        (0..=STEPS).map(row).collect()
    }
}

/// The angle in the scene of the chief ray that arrives at a height, in radians.
fn angle_at(lens: &Lens, height: f64, film_z: f64) -> Option<f64> {
    Some(lens.distortion(Plane::Y, height, film_z)?.angle).filter(|a| a.is_finite())
}

/// Half of the film's diagonal: the value in the file, or the height at which the stated field
/// arrives, or that at which the light ends.
fn full_height(lens: &Lens, about: &About, film_z: f64) -> Option<f64> {
    let center = lens.irradiance(DVec2::ZERO, film_z);
    if !(center > 0.0) {
        return None;
    }
    let lit = |h: f64| {
        lens.irradiance(DVec2::new(0.0, h), film_z) > 0.02 * center
            && angle_at(lens, h, film_z).is_some()
    };
    let efl = lens.first_order().efl().abs();
    let half = about
        .field_degrees
        .map(|f| 0.5 * f.to_radians())
        .filter(|f| *f > 0.0);
    let wanted = |h: f64| match (about.image_height, half) {
        (Some(height), _) => h <= height,
        (None, Some(half)) => angle_at(lens, h, film_z).is_some_and(|a| a <= half),
        (None, None) => true,
    };
    let step = efl / 24.0;
    let border = |fails: &dyn Fn(f64) -> bool| {
        let first = (1..=96).map(|i| f64::from(i) * step).find(|h| fails(*h));
        let Some(mut high) = first else {
            return 96.0 * step;
        };
        let mut low = high - step;
        for _ in 0..40 {
            let middle = 0.5 * (low + high);
            if fails(middle) {
                high = middle
            } else {
                low = middle
            }
        }
        low
    };
    // A test for light takes many rays, so it is made only where the film would end.
    let height = border(&|h| !wanted(h) || angle_at(lens, h, film_z).is_none());
    let height = if height > 0.0 && lit(height) {
        height
    } else {
        border(&|h| !lit(h)).min(height)
    };
    Some(if height > 0.0 { height } else { 0.01 * efl })
}

/// The longitudinal color from 400 to 700 nm.
fn color(lens: &Lens) -> Vec<ColorRow> {
    let focus = |nm: f64| {
        lens.at_wavelength(nm)
            .first_order()
            .focal
            .map(|f| f.rear_focal_point)
    };
    let Some(d) = focus(D_LINE) else {
        return Vec::new();
    };
    (0..=30)
        .map(|i| 400.0 + 10.0 * f64::from(i))
        .filter_map(|wavelength_nm| {
            Some(ColorRow {
                wavelength_nm,
                focus: focus(wavelength_nm)? - d,
            })
        })
        .collect()
}

/// The longitudinal spherical aberration of the lens at three wavelengths.
fn zones(lines: &[Lens; 3], film_z: f64) -> Vec<Zone> {
    let beam = lines[1].axial_beam().height;
    let focus = |lens: &Lens, pupil: f64| {
        if pupil == 0.0 {
            return lens
                .first_order()
                .focal
                .map(|f| f.rear_focal_point - film_z);
        }
        let start = 0.5 * beam + 1.0 + 4.0 * lens.length();
        let ray = LensRay {
            origin: DVec3::new(0.0, pupil * beam, -start),
            direction: DVec3::Z,
        };
        let out = lens.trace_path(&ray, Toward::Film, false).outcome.ok()?;
        let z = out.origin.z - out.origin.y / out.direction.y * out.direction.z;
        Some(z - film_z).filter(|z| z.is_finite())
    };
    (0..=20)
        .map(|i| f64::from(i) / 20.0)
        .map(|pupil| Zone {
            pupil,
            focus_f: focus(&lines[0], pupil),
            focus_d: focus(&lines[1], pupil),
            focus_c: focus(&lines[2], pupil),
        })
        .collect()
}

/// The tangential and the sagittal focus, from the film: the points at which two rays on either
/// side of the chief ray intersect.
fn close_foci(lens: &Lens, film: DVec2, film_z: f64) -> (Option<f64>, Option<f64>) {
    let Some(chief) = lens.chief_ray(film, film_z) else {
        return (None, None);
    };
    let d = -chief.direction;
    let up = DVec3::new(0.0, d.z, -d.y);
    let aside = DVec3::X;
    let pupil = lens
        .first_order()
        .entrance_pupil
        .map_or(1.0, |p| p.semi_diameter);
    let step = 1e-3 * pupil;
    let trace = |offset: DVec3| {
        let ray = LensRay {
            origin: chief.origin + offset - 10.0 * pupil * d,
            direction: d,
        };
        lens.trace_path(&ray, Toward::Film, false).outcome.ok()
    };
    let crossing = |offset: DVec3, axis: DVec3| {
        let (a, b) = (trace(offset)?, trace(-offset)?);
        // The z at which the two rays have the same coordinate along `axis`.
        let slope = |r: &LensRay| r.direction.dot(axis) / r.direction.z;
        let at = |r: &LensRay| r.origin.dot(axis) + (film_z - r.origin.z) * slope(r);
        let z = (at(&b) - at(&a)) / (slope(&a) - slope(&b));
        Some(z).filter(|z| z.is_finite())
    };
    (
        crossing(step * up, DVec3::Y),
        crossing(step * aside, DVec3::X),
    )
}

/// Frequencies up to 60 line pairs per millimeter for a film diagonal of 43 mm, and in proportion
/// for other films, rounded.
fn frequencies(height: f64) -> Vec<f64> {
    let finest = 60.0 * 21.6 / height.max(1e-3);
    let power = libm::pow(10.0, libm::floor(libm::log10(finest)));
    let finest = [1.0, 2.0, 4.0, 6.0, 8.0, 10.0]
        .map(|m| m * power)
        .into_iter()
        .min_by(|a, b| {
            (a / finest - 1.0)
                .abs()
                .total_cmp(&(b / finest - 1.0).abs())
        })
        .unwrap_or(finest);
    (0..=FREQUENCIES)
        .map(|i| finest * i as f64 / FREQUENCIES as f64)
        .collect()
}

/// The image of the point of a beam; none if too few rays get through.
fn point_image(
    beam: &Beam<'_>,
    lines: &[Lens; 3],
    axial: f64,
    sheet: &LensSheet,
) -> Option<PointImage> {
    let places = lines
        .each_ref()
        .map(|line| arrivals(beam, line, sheet.film_z));
    let count = places[1].len() as f64;
    let centroid = places[1].iter().sum::<DVec2>() / count;
    let spots = places.map(|places| places.iter().map(|p| *p - centroid).collect::<Vec<_>>());
    let square: f64 = spots[1].iter().map(|p| p.length_squared()).sum();
    let outline = beam.outline();
    (count > 8.0).then(|| PointImage {
        height: beam.height,
        angle_degrees: libm::acos(beam.d.z.clamp(-1.0, 1.0)).to_degrees(),
        rms: (square / count).sqrt(),
        geometric: geometric(&spots[1], &sheet.frequencies),
        diffraction: diffraction(beam, &lines[1], centroid.extend(sheet.film_z), sheet),
        spots,
        pupil: outline.iter().map(|p| (*p / axial).to_array()).collect(),
        pupil_area: polygon_area(&outline) / (0.5 * TAU * axial * axial),
    })
}

/// The points at which a grid of rays across the beam hits the film.
fn arrivals(beam: &Beam<'_>, lens: &Lens, film_z: f64) -> Vec<DVec2> {
    let (low, high) = beam.bounds();
    let step = (high - low) / GRID as f64;
    let grid = (0..GRID).flat_map(|j| (0..GRID).map(move |i| DVec2::new(i as f64, j as f64)));
    grid.filter_map(|at| {
        let out = beam.trace(lens, low + step * (at + 0.5))?;
        Some(out.at_z(film_z).truncate())
    })
    .collect()
}

/// The modulation in white light, weighted by luminous efficiency. The transfer functions of the
/// wavelengths are added as complex numbers, so that lateral color is included.
fn diffraction(beam: &Beam<'_>, lens: &Lens, image: DVec3, sheet: &LensSheet) -> Modulation {
    let openings = Openings::of(lens, beam, GRID);
    let waves: Vec<(f64, Wavefront)> = EFFICIENCY
        .iter()
        .filter_map(|(nm, efficiency)| {
            let line = lens.at_wavelength(*nm);
            Some((*efficiency, Wavefront::of(&line, beam, &openings, image)?))
        })
        .collect();
    let total: f64 = waves.iter().map(|(efficiency, _)| efficiency).sum();
    let curve = |axis: usize| -> Vec<f64> {
        let at = |f: &f64| {
            let parts = waves
                .iter()
                .map(|(efficiency, w)| *efficiency * w.transfer(*f, axis));
            parts.sum::<DVec2>().length() / total
        };
        sheet.frequencies.iter().map(at).collect()
    };
    Modulation {
        tangential: curve(1),
        sagittal: curve(0),
    }
}

/// The modulation of lines by the spot alone: the Fourier transform of the spot.
fn geometric(spot: &[DVec2], at: &[f64]) -> Modulation {
    let curve = |axis: usize| -> Vec<f64> {
        at.iter()
            .map(|f| {
                let sum = spot.iter().fold(DVec2::ZERO, |sum, p| {
                    let phase = TAU * f * p[axis];
                    sum + DVec2::new(libm::cos(phase), libm::sin(phase))
                });
                sum.length() / spot.len() as f64
            })
            .collect()
    };
    Modulation {
        tangential: curve(1),
        sagittal: curve(0),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn sheet(name: &str) -> (Lens, LensSheet) {
        let lens = Lens::named(name).unwrap();
        let sheet = LensSheet::of(&lens).unwrap();
        (lens, sheet)
    }

    /// The triplet at f/32 has a circular pupil and negligible aberrations: at each wavelength the
    /// modulation is (2/π)(acos s − s √(1 − s²)), where s = λ N ν.
    #[test]
    fn a_lens_stopped_down_has_the_modulation_of_a_clear_circle() {
        let lens = Lens::named("cooke-triplet")
            .unwrap()
            .at_f_number(32.0)
            .unwrap();
        let sheet = LensSheet::of(&lens).unwrap();
        for (f, m) in sheet
            .frequencies
            .iter()
            .zip(&sheet.points[0].diffraction.tangential)
        {
            let circle = |(nm, efficiency): &(f64, f64)| {
                let s = (nm * 1e-6 * 32.0 * f).min(1.0);
                efficiency * 2.0 / std::f64::consts::PI * (libm::acos(s) - s * (1.0 - s * s).sqrt())
            };
            let total: f64 = EFFICIENCY.iter().map(|(_, efficiency)| efficiency).sum();
            let ideal = EFFICIENCY.iter().map(circle).sum::<f64>() / total;
            assert!((m - ideal).abs() < 0.02, "{f} lp/mm: {m} against {ideal}");
        }
    }

    #[test]
    fn an_aberrated_lens_has_the_same_modulation_by_rays_and_by_waves_at_low_frequencies() {
        let (lens, sheet) = sheet("angenieux-50");
        let beam = Beam::of(&lens, 0.0, sheet.film_z, f64::INFINITY).unwrap();
        let openings = Openings::of(&lens, &beam, GRID);
        let image = sheet.film_z * DVec3::Z;
        let waves = Wavefront::of(&lens, &beam, &openings, image).unwrap();
        let point = &sheet.points[0];
        for i in 1..6 {
            let by_rays = point.geometric.sagittal[i];
            let by_waves = waves.transfer(sheet.frequencies[i], 0).length();
            let off = (by_rays - by_waves).abs();
            assert!(off < 0.06, "{}: {by_rays} {by_waves}", sheet.frequencies[i]);
        }
    }

    #[test]
    fn the_field_of_a_sheet_is_the_stated_one() {
        for (name, half) in [
            ("double-gauss", 22.0),
            ("biogon", 45.0),
            ("wide-angle", 38.0),
        ] {
            let (_, sheet) = sheet(name);
            assert!((sheet.half_field_degrees - half).abs() < 0.5, "{name}");
            assert!((sheet.fields[0].relative_illumination - 1.0).abs() < 1e-12);
        }
    }

    #[test]
    fn curves_of_every_shipped_lens_are_finite() {
        for name in crate::lens::shipped_names() {
            let (lens, sheet) = sheet(name);
            assert!(
                sheet.points.len() >= 3,
                "{name}: {} points",
                sheet.points.len()
            );
            let json = serde_json::to_string(&sheet).unwrap();
            assert!(sheet.points.iter().all(|p| p.rms.is_finite()), "{name}");
            // A missing row or a wrong digit shows here: no design has spots larger than this.
            let efl = lens.first_order().efl();
            let small = sheet.points.iter().take(3).all(|p| p.rms < 6e-3 * efl);
            assert!(small, "{name}: spots larger than any design's");
            assert!(json.len() > 5000, "{name}");
        }
    }
}
