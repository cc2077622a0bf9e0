//! The data sheet of a lens: the data of its curves and tables, computed from rays.
//!
//! Lengths are in millimeters and heights are on the film. The object is at infinity unless a
//! [`SheetSetting`] has a focus. For a lens without rotational symmetry the sheet shows the
//! meridian of y.

use glam::DVec2;
use ivcam_base::work::Budget;
use rayon::prelude::*;
use serde::Serialize;

use crate::lens::analysis::beam::Beam;
use crate::lens::analysis::curves::{ColorRow, Conjugate, FieldRow, Zone, typical_height};
use crate::lens::analysis::points::{PointImage, PointWaves, point_image};
use crate::lens::lens::Lens;
use crate::lens::optics::breathing::Breathing;
use crate::lens::optics::focus::Focus;
use crate::prescription::about::About;
use crate::prescription::glass::medium::line_name;
use crate::prescription::surface::Meridian;

/// The number of steps of the curves over frequency.
const FREQUENCIES: usize = 40;
/// The heights for which the sheet has spots, modulation and pupils, as shares of the full height.
const POINT_HEIGHTS: [f64; 4] = [0.0, 0.5, 0.7, 1.0];

/// The number of points up to which their waves are kept. Those of one take about 2 MB.
const KEPT: usize = 16;

/// The conditions for which a data sheet is computed. The default is an object at infinity with the
/// film at the best focus.
#[derive(Clone, Debug, Default)]
pub struct SheetSetting<'a> {
    /// The lens before it was focused, if its focusing group has been moved. It determines the
    /// field and the table of breathing.
    pub unfocused: Option<&'a Lens>,
    /// The focus, with the position of the film. Default: the best focus at infinity.
    pub focus: Option<&'a Focus>,
    /// A shift of the film away from the lens, in millimeters.
    pub defocus: f64,
    /// Half of the film's diagonal, in millimeters. Default: the stated field of the lens.
    pub image_height: Option<f64>,
    /// The points for which the sheet has spots and modulation. Default: 0, 50, 70 and 100% of the
    /// image height.
    pub fields: Vec<FieldPoint>,
    /// The frequencies of the modulation in line pairs per millimeter, in rising order. Default: 41
    /// from 0 to what suits the film.
    pub frequencies: Vec<f64>,
}

/// A place on the film's diagonal.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum FieldPoint {
    /// The height on the film in millimeters.
    Height(f64),
    /// A share of half of the film's diagonal.
    Share(f64),
    /// The angle of the chief ray in the scene, in radians.
    Angle(f64),
}

/// The data sheet of a lens. Lengths are in millimeters.
#[derive(Clone, Debug, Serialize)]
pub struct LensSheet {
    /// The distance of the object from the front vertex; none for infinity.
    pub object_distance: Option<f64>,
    /// The z of the film, from the front vertex. Without a focus it is the best focus on the axis
    /// by real rays.
    pub film_z: f64,
    /// The distance from the paraxial image to the film.
    pub focus_shift: f64,
    /// The part of `focus_shift` that was asked for as defocus.
    pub defocus: f64,
    /// The z of the film for which the root mean square spot on the axis is least.
    pub best_film_z: Option<f64>,
    /// Half of the film's diagonal; 0 if the stated field is the axis alone.
    pub image_height: f64,
    /// The angle of the chief ray that arrives at `image_height`, in degrees.
    pub half_field_degrees: f64,
    /// The projection relative to which distortion is given: `f tan θ`, or `f θ` for fields of more
    /// than 120 degrees, or `m y` (magnification times object height) for a near object.
    pub projection: &'static str,
    /// The f in millimeters, or the m, of `projection`: that of chief rays near the axis on this
    /// film.
    pub projection_scale: f64,
    /// The wavelengths of the values whose names end in `_f` and `_c`, around that of the others,
    /// in nanometers: the F and the C line around the d line, unless the prescription states
    /// others.
    pub lines_nm: [f64; 3],
    /// Whether the indices of the glasses depend on the wavelength.
    pub dispersive: bool,
    /// The change of the field and the exposure with the distance, by the focusing group if there
    /// is one, and otherwise by the film.
    pub breathing: Vec<Breathing>,
    /// The curves over the film's height; a single row for a height of 0.
    pub fields: Vec<FieldRow>,
    /// The longitudinal spherical aberration.
    pub spherical: Vec<Zone>,
    /// The longitudinal color.
    pub color: Vec<ColorRow>,
    /// The images of points: by default at four heights.
    pub points: Vec<PointImage>,
    /// The frequencies of the modulation curves, in line pairs per millimeter.
    pub frequencies: Vec<f64>,
}

impl LensSheet {
    /// Computes the data sheet for an object at infinity, with the film at the best focus; none for
    /// an afocal lens, or for one that lets no light through.
    pub fn of(lens: &Lens) -> Option<Self> {
        Self::at(lens, &SheetSetting::default())
    }

    /// Computes the data sheet of a focused lens under the conditions of a setting; none for an
    /// afocal lens, or for one that lets no light through.
    pub fn at(lens: &Lens, setting: &SheetSetting<'_>) -> Option<Self> {
        Some(Self::with_waves(lens, setting)?.0)
    }

    /// Computes the data sheet like [`Self::at`], with the waves of its points. Those of more than
    /// [`KEPT`] points would take too much memory and are left out.
    pub(super) fn with_waves<'a>(
        lens: &'a Lens,
        setting: &SheetSetting<'_>,
    ) -> Option<(Self, Vec<Option<PointWaves<'a>>>)> {
        let conjugate = setting.conjugate(lens)?;
        let film_z = conjugate.film_z;
        let base = setting.unfocused.unwrap_or(lens);
        let image_height = setting.full_height(lens)?;
        let lines = lens.spectral_lines().map(|nm| lens.at_wavelength(nm));
        let half = angle_at(lens, image_height, film_z).unwrap_or(0.0);
        let projection = conjugate.projection(lens, image_height);
        let frequencies = match setting.frequencies.is_empty() {
            true => frequencies(typical_height(lens, image_height)),
            false => setting.frequencies.clone(),
        };
        let axial = Beam::of(lens, 0.0, film_z, conjugate.distance)?.outline_radius();
        let heights = setting.heights(lens, image_height, film_z);
        let is_kept = heights.len() <= KEPT;
        let image = |height: f64| {
            let beam = lit_beam(lens, height, conjugate)?;
            let waves = PointWaves::of(lens, beam, film_z)?;
            let image = point_image(&waves, &lines, axial, &frequencies);
            Some((image, is_kept.then_some(waves)))
        };
        let account = Budget::current();
        let images = heights.into_par_iter();
        let images = images.filter_map(|height| account.during(|| image(height)));
        let (points, waves): (Vec<_>, Vec<_>) = images.unzip();
        let this = Self {
            object_distance: Some(conjugate.distance).filter(|d| d.is_finite()),
            film_z,
            focus_shift: film_z - conjugate.paraxial_image(lens)?,
            defocus: setting.defocus,
            best_film_z: lens.best_focus(conjugate.distance),
            image_height,
            half_field_degrees: half.to_degrees(),
            projection: projection.law.name(),
            projection_scale: projection.scale.unwrap_or(f64::NAN),
            lines_nm: lens.spectral_lines(),
            dispersive: lens.prescription().is_dispersive(),
            breathing: base.breathing(base.default_focus_method(), image_height),
            fields: conjugate.field_rows(&lines, image_height, &projection),
            spherical: conjugate.zones(&lines),
            color: conjugate.color(lens),
            points,
            frequencies,
        };
        Some((this, waves))
    }

    /// The names of `lines_nm`.
    pub fn line_names(&self) -> [String; 3] {
        self.lines_nm.map(line_name)
    }

    /// A focus over the height on the film. One that is farther from that on the axis than a
    /// quarter of the image height is left out: at the edge of the field it may be anywhere.
    pub(crate) fn focus_curve(&self, focus: impl Fn(&FieldRow) -> Option<f64>) -> Vec<[f64; 2]> {
        let on_axis = self.fields.iter().find_map(&focus).unwrap_or(0.0);
        let is_near = |v: &f64| (v - on_axis).abs() < 0.25 * self.image_height;
        let place = |row: &FieldRow| Some([row.height, focus(row).filter(is_near)?]);
        self.fields.iter().filter_map(place).collect()
    }

    /// What distortion is referred to, as a sentence part.
    pub fn distortion_reference(&self) -> String {
        match self.projection {
            "m y" => format!(
                "m y, m = {:.5} of chief rays near the axis",
                self.projection_scale
            ),
            name => format!(
                "{name}, f = {:.3} mm of chief rays near the axis",
                self.projection_scale
            ),
        }
    }
}

impl SheetSetting<'_> {
    /// The object plane and the film; none for an afocal lens without a focus.
    pub fn conjugate(&self, lens: &Lens) -> Option<Conjugate> {
        let (distance, film_z) = match self.focus {
            Some(focus) => (focus.object_distance(), focus.film_z),
            None => {
                let paraxial = lens.first_order().focal?.rear_focal_point;
                (
                    f64::INFINITY,
                    lens.best_focus(f64::INFINITY).unwrap_or(paraxial),
                )
            }
        };
        Some(Conjugate {
            distance,
            film_z: film_z + self.defocus,
        })
    }

    /// Half of the film's diagonal, in millimeters; 0 if the stated field is the axis alone.
    pub fn full_height(&self, lens: &Lens) -> Option<f64> {
        let stated = || full_height(self.unfocused.unwrap_or(lens));
        self.image_height.or_else(stated)
    }

    /// The heights on the film of the points, in millimeters as `image_height`, half of the film's
    /// diagonal, and `film_z`.
    pub fn heights(&self, lens: &Lens, image_height: f64, film_z: f64) -> Vec<f64> {
        if self.fields.is_empty() {
            // A field of 0 is one point.
            let shares = if image_height == 0.0 {
                &[0.0]
            } else {
                &POINT_HEIGHTS[..]
            };
            return shares.iter().map(|share| share * image_height).collect();
        }
        let height = |field: &FieldPoint| match *field {
            FieldPoint::Height(height) => Some(height),
            FieldPoint::Share(share) => Some(share * image_height),
            FieldPoint::Angle(0.0) => Some(0.0),
            FieldPoint::Angle(angle) => {
                let near = lens.first_order().efl().abs() * angle.min(1.0);
                let film = typical_height(lens, image_height);
                lens.image_height(angle, near.min(0.5 * film), film_z)
            }
        };
        self.fields.iter().filter_map(height).collect()
    }

    /// The number of the given points that the data sheet leaves out, because no ray from their
    /// place on the film gets through the lens.
    pub fn dark_fields(&self, lens: &Lens) -> usize {
        if self.fields.is_empty() {
            return 0;
        }
        let lit = || {
            let conjugate = self.conjugate(lens)?;
            let heights = self.heights(lens, self.full_height(lens)?, conjugate.film_z);
            let is_lit = |height: &f64| lit_beam(lens, *height, conjugate).is_some();
            Some(heights.iter().filter(|height| is_lit(height)).count())
        };
        lit().map_or(0, |lit| self.fields.len() - lit)
    }
}

/// The beam that arrives at a height; none where the film is dark. The light of the object point
/// of a dark chief ray, if there is any, arrives elsewhere.
fn lit_beam(lens: &Lens, height: f64, conjugate: Conjugate) -> Option<Beam<'_>> {
    let is_lit = lens.is_lit(height, conjugate.film_z);
    is_lit
        .then(|| Beam::of(lens, height, conjugate.film_z, conjugate.distance))
        .flatten()
}

/// The angle in the scene of the chief ray that arrives at a height, in radians.
fn angle_at(lens: &Lens, height: f64, film_z: f64) -> Option<f64> {
    Some(lens.distortion(Meridian::Y, height, film_z)?.angle).filter(|a| a.is_finite())
}

/// Half of the film's diagonal: the value in the file, or the height at which the stated field
/// arrives, or that at which the light ends.
fn full_height(lens: &Lens) -> Option<f64> {
    let about = About::of(lens.prescription());
    let paraxial = lens.first_order().focal?.rear_focal_point;
    let film_z = lens.best_focus(f64::INFINITY).unwrap_or(paraxial);
    let light = FilmLight::of(lens, film_z)?;
    let efl = lens.first_order().efl().abs();
    let half = about.field_degrees.map(|f| 0.5 * f.to_radians());
    if half == Some(0.0) && about.image_height.is_none() {
        return Some(0.0);
    }
    let half = half.filter(|f| *f > 0.0);
    let wanted = |h: f64, angle: f64| match (about.image_height, half) {
        (Some(height), _) => h <= height,
        (None, Some(half)) => angle <= half,
        (None, None) => true,
    };
    let ends = |h: f64| !angle_at(lens, h, film_z).is_some_and(|angle| wanted(h, angle));
    let step = efl / STEPS_PER_EFL;
    let height = match first_step(step, ends) {
        Some(high) => bisected([high - step, high], 40, ends)[0],
        None => LAST_STEP * step,
    };
    // A test for light takes many rays, so it is made only where the film would end.
    let is_lit = height > 0.0 && light.reaches(height) && angle_at(lens, height, film_z).is_some();
    let height = match is_lit {
        true => height,
        false => light.end(step).min(height),
    };
    Some(if height > 0.0 { height } else { 0.01 * efl })
}

/// The steps in which the end of the field is searched, for each focal length.
const STEPS_PER_EFL: f64 = 24.0;
/// The number of the last of them.
const LAST_STEP: f64 = 96.0;

/// The first height, in whole steps, at which something holds.
fn first_step(step: f64, holds: impl Fn(f64) -> bool) -> Option<f64> {
    let heights = (1..=LAST_STEP as u32).map(|i| f64::from(i) * step);
    heights.into_iter().find(|h| holds(*h))
}

/// Halves an interval, at whose upper end something holds, a number of times.
fn bisected([mut low, mut high]: [f64; 2], times: u32, holds: impl Fn(f64) -> bool) -> [f64; 2] {
    for _ in 0..times {
        let middle = 0.5 * (low + high);
        *(if holds(middle) { &mut high } else { &mut low }) = middle;
    }
    [low, high]
}

/// The light on a film, of which 2% of that on the axis is the least that counts.
struct FilmLight<'a> {
    lens: &'a Lens,
    film_z: f64,
    /// That on the axis, and the same by an outline of [`FilmLight::FEW`] points.
    center: [f64; 2],
}

impl<'a> FilmLight<'a> {
    /// The least share that counts.
    const LEAST: f64 = 0.02;
    /// The number of points of an outline with which the end of the light is searched. Its area is
    /// 0.07% less than a circle's.
    const FEW: usize = 96;

    /// The light on a film; none if its center is dark.
    fn of(lens: &'a Lens, film_z: f64) -> Option<Self> {
        let fine = lens.irradiance(DVec2::ZERO, film_z);
        let coarse = lens.irradiance_by(DVec2::ZERO, film_z, Self::FEW).0;
        (fine > 0.0).then_some(Self {
            lens,
            film_z,
            center: [fine, coarse],
        })
    }

    /// The share at a height, less the least that counts.
    fn excess(&self, height: f64) -> f64 {
        let film = DVec2::new(0.0, height);
        self.lens.irradiance(film, self.film_z) / self.center[0] - Self::LEAST
    }

    /// Whether light that counts reaches a height.
    fn reaches(&self, height: f64) -> bool {
        self.excess(height) > 0.0
    }

    /// Whether a height is dark, by few points.
    fn is_dark(&self, height: f64) -> bool {
        let film = DVec2::new(0.0, height);
        let light = self.lens.irradiance_by(film, self.film_z, Self::FEW).0;
        !(light > Self::LEAST * self.center[1])
            || angle_at(self.lens, height, self.film_z).is_none()
    }

    /// The height at which the light ends. It is searched with few points, and then between
    /// heights with little light and enough of it by the whole outline, by the false position with
    /// halved ends (the Illinois method).
    fn end(&self, step: f64) -> f64 {
        let Some(high) = first_step(step, |h| self.is_dark(h)) else {
            return LAST_STEP * step;
        };
        let [mut low, mut high] = bisected([high - step, high], 8, |h| self.is_dark(h));
        let excess = |h: f64| match angle_at(self.lens, h, self.film_z) {
            Some(_) => self.excess(h),
            None => -Self::LEAST,
        };
        let mut width = high - low;
        while low > 0.0 && !(excess(low) > 0.0) {
            (low, width) = ((low - width).max(0.0), 2.0 * width);
        }
        while excess(high) > 0.0 && high < LAST_STEP * step {
            (high, width) = (high + width, 2.0 * width);
        }
        let (mut above, mut below) = (excess(low), excess(high));
        let mut last = None;
        for _ in 0..100 {
            if high - low <= 1e-10 * step {
                break;
            }
            let next = low + above / (above - below) * (high - low);
            let value = excess(next);
            let is_lit = value > 0.0;
            // An end that stays counts half, so that the interval closes from both ends.
            let halves = last.replace(is_lit) == Some(is_lit);
            let kept = if halves { 0.5 } else { 1.0 };
            match is_lit {
                true => (low, above, below) = (next, value, kept * below),
                false => (high, below, above) = (next, value, kept * above),
            }
        }
        low
    }
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

#[cfg(test)]
mod tests {
    use glam::DVec3;

    use super::*;
    use crate::lens::analysis::diffraction::{Openings, Wavefront};
    use crate::lens::analysis::points::{EFFICIENCY, GRID};
    use crate::lens::{FocusMethod, Prescription};
    use ivcam_base::math::Meters;

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
            assert!((m - ideal).abs() < 0.004, "{f} lp/mm: {m} against {ideal}");
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

    fn near(name: &str, method: FocusMethod, meters: f64) -> (Lens, Focus) {
        let lens = Lens::named(name).unwrap();
        let (lens, focus) = lens.focused(method, Meters(meters)).unwrap();
        (lens, focus)
    }

    /// A perfectly symmetric lens at life size has no distortion and no lateral color.
    #[test]
    fn a_symmetric_lens_at_life_size_has_no_distortion() {
        let glass = crate::prescription::Medium::constant(1.6);
        let surface = |radius, gap, medium| crate::lens::Surface::sphere(radius, gap, medium, 9.0);
        let air = crate::prescription::Medium::air;
        let lens = Lens::new(Prescription::new(
            "symmetric",
            vec![
                surface(30.0, 5.0, glass.clone()),
                surface(120.0, 6.0, air()),
                crate::lens::Surface::stop(6.0, air(), 3.0),
                surface(-120.0, 5.0, glass),
                surface(-30.0, 0.0, air()),
            ],
        ));
        // At life size the object is a focal length in front of the front focal point.
        let focal = lens.first_order().focal.unwrap();
        let distance = focal.efl - focal.front_focal_point;
        let focus = lens
            .focus(FocusMethod::Film, Meters(1e-3 * distance))
            .unwrap();
        assert!((focus.magnification + 1.0).abs() < 1e-9);
        let setting = SheetSetting {
            focus: Some(&focus),
            image_height: Some(8.0),
            ..SheetSetting::default()
        };
        let sheet = LensSheet::at(&lens, &setting).unwrap();
        assert!(
            (sheet.projection_scale - 1.0).abs() < 1e-6,
            "{}",
            sheet.projection_scale
        );
        for row in &sheet.fields {
            let percent = row.distortion_percent.unwrap();
            assert!(percent.abs() < 1e-6, "{percent} at {}", row.height);
            let out = row.chief_ray_angle_degrees.unwrap();
            assert!(
                (out - row.angle_degrees).abs() < 1e-6,
                "{out} {}",
                row.angle_degrees
            );
        }
    }

    #[test]
    fn the_spot_on_the_axis_is_least_at_the_best_focus_of_every_conjugate() {
        for (name, meters) in [
            ("telephoto", f64::INFINITY),
            ("telephoto", 5.0),
            ("double-gauss", 1.0),
        ] {
            let (lens, focus) = near(name, FocusMethod::Best, meters);
            let rms = |defocus: f64| {
                let beam = Beam::of(&lens, 0.0, focus.film_z, focus.object_distance()).unwrap();
                let places =
                    crate::lens::analysis::points::arrivals(&beam, &lens, focus.film_z + defocus);
                let square: f64 = places.iter().map(|p| p.length_squared()).sum();
                (square / places.len() as f64).sqrt()
            };
            // The vertex of the parabola of the squared radius, by an independent grid of rays.
            let step = 0.05;
            let [a, b, c] = [-step, 0.0, step].map(|d| rms(d) * rms(d));
            let vertex = 0.5 * step * (a - c) / (a - 2.0 * b + c);
            assert!(
                vertex.abs() < 1.5e-3,
                "{name} at {meters} m: off by {vertex} mm"
            );
        }
    }

    #[test]
    fn a_sheet_follows_focus_defocus_fields_and_frequencies() {
        let (lens, focus) = near("double-gauss", FocusMethod::Film, 1.5);
        let setting = SheetSetting {
            focus: Some(&focus),
            defocus: 0.25,
            image_height: Some(21.6),
            fields: vec![
                FieldPoint::Height(0.0),
                FieldPoint::Share(0.5),
                FieldPoint::Angle(0.1),
            ],
            frequencies: vec![5.0, 25.0],
            ..SheetSetting::default()
        };
        let sheet = LensSheet::at(&lens, &setting).unwrap();
        assert_eq!(sheet.film_z, focus.film_z + 0.25);
        assert_eq!(sheet.object_distance, Some(1500.0));
        assert!((sheet.focus_shift - 0.25).abs() < 1e-9);
        assert_eq!(sheet.frequencies, [5.0, 25.0]);
        assert_eq!(sheet.points[1].height, 10.8);
        assert!((sheet.points[2].angle_degrees.to_radians() - 0.1).abs() < 1e-9);
        assert_eq!(sheet.points[0].diffraction.sagittal.len(), 2);
        let scale = sheet.projection_scale / focus.magnification.abs();
        assert!((scale - 1.0).abs() < 0.01, "{scale}");
    }
}
