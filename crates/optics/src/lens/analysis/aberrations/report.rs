//! All aberrations of a lens for the points of a data sheet.

use glam::DVec2;
use ivcam_base::work::Budget;
use rayon::prelude::*;
use serde::Serialize;

use super::fans::{Fans, PointFans, WavefrontFit};
use super::seidel::SeidelSums;
use super::through_focus::{FocusRow, ThroughFocus};
use crate::lens::analysis::beam::Beam;
use crate::lens::analysis::curves::Conjugate;
use crate::lens::analysis::points::PointWaves;
use crate::lens::analysis::sheet::{LensSheet, SheetSetting};
use crate::lens::lens::Lens;

/// The aberrations of a lens. Lengths are in millimeters.
#[derive(Clone, Debug, Serialize)]
pub struct Aberrations {
    /// The wavelength of all that is not said to be of another, in nanometers.
    pub wavelength_nm: f64,
    /// The order and the normalization of the Zernike coefficients.
    pub zernike_set: &'static str,
    /// The f-number of the cone of rays that arrives on the axis: 1/(2 sin θ′).
    pub working_f_number: Option<f64>,
    /// The Seidel coefficients; none for lenses that have none.
    pub seidel: Option<SeidelSums>,
    /// The frequencies of the modulation through focus, in line pairs per millimeter.
    pub frequencies: Vec<f64>,
    /// The aberrations of each point.
    pub points: Vec<PointAberrations>,
}

/// The aberrations of a point.
#[derive(Clone, Debug, Serialize)]
pub struct PointAberrations {
    /// The height on the film.
    pub height: f64,
    /// The ray and wavefront fans at the F line, the lens's own wavelength and the C line.
    pub fans: Vec<Fans>,
    /// The wavefront; none if too few rays get through.
    pub wavefront: Option<WavefrontFit>,
    /// The peak of the image by diffraction over that of a perfect wavefront through the same
    /// pupil.
    pub strehl: Option<f64>,
    /// Spots and modulation through focus.
    pub through_focus: Vec<FocusRow>,
    /// The spots on five films evenly spaced over that range, each from its centroid.
    #[serde(skip)]
    pub spots: Vec<Vec<DVec2>>,
}

impl Aberrations {
    /// Computes the data sheet of a lens under the conditions of a setting, and the aberrations for
    /// its points; none for an afocal lens, or for one that lets no light through.
    pub fn with_sheet(lens: &Lens, setting: &SheetSetting<'_>) -> Option<(LensSheet, Self)> {
        let (sheet, waves) = LensSheet::with_waves(lens, setting)?;
        let conjugate = setting.conjugate(lens)?;
        let lines = lens.spectral_lines().map(|nm| lens.at_wavelength(nm));
        let beam = lens.beam_height(conjugate.distance);
        let rim = lens.axial_ray(conjugate.distance, beam * (1.0 - 1e-12));
        let rim = lens.trace_from_scene(&rim).ok();
        let working = rim.map(|out| 0.5 / out.direction.truncate().length());
        let working = working.filter(|n| n.is_finite());
        let frequencies = focus_frequencies(&sheet, setting);
        let range = range(lens, &sheet, working.unwrap_or(8.0));
        let account = Budget::current();
        let points = sheet.points.par_iter().zip(waves);
        let points = points.filter_map(|(point, waves)| {
            let at = (point.height, conjugate);
            account.during(|| point_aberrations(&lines, at, waves, range, &frequencies))
        });
        let points = points.collect();
        let this = Self {
            wavelength_nm: lens.wavelength(),
            zernike_set: "fringe (University of Arizona), 1 at the edge of the disc, angles from x",
            working_f_number: working,
            seidel: SeidelSums::of(lens, conjugate.distance, beam, sheet.image_height),
            points,
            frequencies,
        };
        Some((sheet, this))
    }
}

/// The aberrations of the point that arrives at a height; none without a chief ray. Its waves are
/// computed if they are not given.
fn point_aberrations<'a>(
    lines: &'a [Lens; 3],
    (height, conjugate): (f64, Conjugate),
    waves: Option<PointWaves<'a>>,
    range: f64,
    frequencies: &[f64],
) -> Option<PointAberrations> {
    let PointFans { fans, wavefront } = PointFans::of(lines, height, conjugate)?;
    let waves = waves.or_else(|| {
        let beam = Beam::of(&lines[1], height, conjugate.film_z, conjugate.distance)?;
        PointWaves::of(&lines[1], beam, conjugate.film_z)
    });
    let focus = ThroughFocus::of(&lines[1], &waves?, range, frequencies);
    Some(PointAberrations {
        height,
        fans,
        wavefront,
        strehl: focus.strehl,
        through_focus: focus.rows,
        spots: focus.spots,
    })
}

/// The frequencies of the modulation through focus: up to four of those that were asked for, or a
/// sixth, a third and two thirds of the finest.
fn focus_frequencies(sheet: &LensSheet, setting: &SheetSetting<'_>) -> Vec<f64> {
    let asked = &setting.frequencies;
    if !asked.is_empty() {
        return asked.iter().copied().filter(|f| *f > 0.0).take(4).collect();
    }
    let finest = sheet.frequencies.last().copied().unwrap_or(60.0);
    [6.0, 3.0, 1.5].map(|part| finest / part).to_vec()
}

/// The range of the film on each side: eight times the Rayleigh depth 2 λ N², or so far that the
/// spots grow by their own size, rounded to 1, 2 or 5 times a power of ten.
fn range(lens: &Lens, sheet: &LensSheet, f_number: f64) -> f64 {
    let depth = 8.0 * 2.0 * lens.wavelength() * 1e-6 * f_number * f_number;
    let rms = sheet.points.iter().map(|p| p.rms).fold(0.0, f64::max);
    let wanted = depth.max(3.0 * rms * f_number).max(1e-6);
    let power = libm::pow(10.0, libm::floor(libm::log10(wanted)));
    [1.0, 2.0, 5.0, 10.0]
        .map(|lead| lead * power)
        .into_iter()
        .find(|size| *size >= wanted * (1.0 - 1e-9))
        .unwrap_or(wanted)
}

#[cfg(test)]
mod tests {
    use std::f64::consts::PI;

    use super::*;
    use crate::prescription::glass::medium::{C_LINE, F_LINE};
    use crate::prescription::{Curvature, Medium, Prescription, Shape, Surface};

    const NM: f64 = 550.0;

    /// A plane and a hyperboloid: a point at infinity on the axis has a perfect image (Descartes).
    fn perfect(f_number: f64) -> Lens {
        let mut last = Surface::sphere(-25.0, 0.0, Medium::air(), 30.0);
        last.shape = Shape::Conic { k: -2.25 };
        last.curvature = Curvature::from_radius(-25.0);
        let surfaces = vec![
            Surface::stop(1.0, Medium::air(), 25.0 / f_number),
            Surface::sphere(0.0, 10.0, Medium::constant(1.5), 30.0),
            last,
        ];
        Lens::new(Prescription::new("perfect", surfaces)).at_wavelength(NM)
    }

    fn on_axis(lens: &Lens, defocus: f64) -> PointAberrations {
        let film_z = lens.first_order().focal.unwrap().rear_focal_point + defocus;
        let conjugate = Conjugate {
            distance: f64::INFINITY,
            film_z,
        };
        let lines = lens.spectral_lines().map(|nm| lens.at_wavelength(nm));
        point_aberrations(&lines, (0.0, conjugate), None, 0.1, &[20.0]).unwrap()
    }

    /// A film behind the focus by 8 λ N² w has w waves of defocus, W = w ρ²: its fringe terms 1
    /// and 4 are w/2, its rms is w/√12, and its Strehl ratio is sinc²(w) (Born and Wolf, 8.8). The
    /// reference sphere is that through the exit pupil, from which the film is farther than the
    /// focus: W is smaller by the ratio of the two distances.
    #[test]
    fn a_small_defocus_has_the_closed_form_in_every_quantity() {
        let f_number = 20.0;
        let lens = perfect(f_number);
        let sharp = on_axis(&lens, 0.0);
        assert!(
            (sharp.strehl.unwrap() - 1.0).abs() < 1e-3,
            "{:?}",
            sharp.strehl
        );
        assert!(sharp.wavefront.unwrap().rms < 1e-6);
        for waves in [0.1, 0.25, 0.5] {
            let shift = 8.0 * NM * 1e-6 * f_number * f_number * waves;
            let point = on_axis(&lens, shift);
            let fit = point.wavefront.unwrap();
            let sinc = libm::sin(PI * waves) / (PI * waves);
            let from_pupil = lens.first_order().focal.unwrap().rear_focal_point
                - lens.first_order().exit_pupil.unwrap().z;
            let waves = waves * from_pupil / (from_pupil + shift);
            assert!(
                (fit.zernike[3].abs() - 0.5 * waves).abs() < 0.01 * waves,
                "{:?}",
                fit.zernike
            );
            assert!((fit.zernike[0] - fit.zernike[3]).abs() < 1e-3 * waves);
            assert!(
                (fit.rms - waves / 12f64.sqrt()).abs() < 0.015 * waves,
                "{}",
                fit.rms
            );
            let strehl = point.strehl.unwrap();
            assert!(
                (strehl - sinc * sinc).abs() < 0.01,
                "{strehl} {}",
                sinc * sinc
            );
            // Behind the focus the rays have crossed: the upper ray is below the axis.
            let rim = point.fans[0].tangential.last().unwrap();
            let off = rim.y + shift / (2.0 * f_number);
            assert!(off.abs() < 0.02 * shift / f_number, "{}", rim.y);
            assert!(
                (rim.waves.abs() - waves).abs() < 0.002 * waves,
                "{}",
                rim.waves
            );
        }
    }

    /// At a small aperture the wavefront is that of the Seidel sums: at the edge of the pupil
    /// S_I/8 on the axis, and S_II/2 of coma off it (Hopkins).
    #[test]
    fn a_weak_lens_has_the_wavefront_of_its_seidel_sums() {
        let surfaces = vec![
            Surface::stop(0.0, Medium::air(), 4.0),
            Surface::sphere(120.0, 3.0, Medium::constant(1.6), 20.0),
            Surface::sphere(-120.0, 0.0, Medium::air(), 20.0),
        ];
        let lens = Lens::new(Prescription::new("equiconvex", surfaces)).at_wavelength(NM);
        let focal = lens.first_order().focal.unwrap();
        let sums = SeidelSums::of(&lens, f64::INFINITY, 4.0, 1.0).unwrap();
        let lines = [F_LINE, NM, C_LINE].map(|nm| lens.at_wavelength(nm));
        let conjugate = Conjugate {
            distance: f64::INFINITY,
            film_z: focal.rear_focal_point,
        };
        let axis = PointFans::of(&lines, 0.0, conjugate).unwrap();
        let waves = axis.fans[0].tangential.last().unwrap().waves;
        let third = sums.sum.s1 / 8.0 / (NM * 1e-6);
        assert!((waves / third - 1.0).abs() < 0.005, "{waves} {third}");
        let off = PointFans::of(&lines, 1.0, conjugate).unwrap();
        let fan = &off.fans[0].tangential;
        let odd = 0.5 * (fan.last().unwrap().waves - fan[0].waves);
        let coma = sums.sum.s2 / 2.0 / (NM * 1e-6);
        assert!((odd / coma - 1.0).abs() < 0.005, "{odd} {coma}");
    }
}
