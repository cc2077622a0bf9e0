//! A lens at the wavelengths of every hero set.

use std::sync::OnceLock;

use glam::{DMat3, DVec2};
use ivcam_base::math::lanes::{LANES, bits};
use ivcam_optics::film::FilmFormat;
use ivcam_optics::lens::{Aims, Bundle, ExitPupil, FilmPlace, Lens, PupilTarget, Vignetting};
use ivcam_optics::spectrum::{HERO, MAIN, SETS, SpectralLine, Spectrum};

use super::film_samples::FilmSamples;
use super::lens_camera::LensCamera;
use super::rays::ExitRays;
use super::spectral::{distance, probability};

/// The number of equal parts of the film's half diagonal in which the distances of rays are
/// measured.
const RINGS: usize = 12;
/// The sets whose vignetting is measured. That of the others is interpolated.
const MEASURED: [usize; 3] = [0, SETS / 2, SETS - 1];

/// A lens at the wavelengths of every hero set.
#[derive(Clone, Debug)]
pub(super) struct SpectralLenses {
    /// The wavelengths of each set.
    pub sets: [[SpectralLine; HERO]; SETS],
    /// The lens at each of the wavelengths.
    pub lenses: [[Lens; HERO]; SETS],
    /// The size of each wavelength's color: the root of the sum of the squares of its matrix.
    pub sizes: [[f64; HERO]; SETS],
    /// The target of the rays at all wavelengths.
    pub target: PupilTarget,
    /// How the rays of each set are aimed and chosen. It is measured for the first ray.
    aiming: OnceLock<Vec<SetAiming>>,
}

/// How the rays of a hero set are aimed and chosen.
#[derive(Clone, Debug)]
pub(super) struct SetAiming {
    /// The unvignetted fraction of the target's area at the main wavelength.
    pub vignetting: Vignetting,
    /// For each ring of the film, the probability with which each wavelength is traced; 0 for the
    /// main one.
    probabilities: [[f64; HERO]; RINGS],
    /// The number of rings per millimeter.
    rings_per_mm: f64,
}

impl SetAiming {
    /// The probability with which each wavelength is traced from a film point, in millimeters from
    /// the film's middle.
    #[inline(always)]
    pub(super) fn probabilities(&self, film: [f64; 2]) -> &[f64; HERO] {
        let ring = (DVec2::from(film).length() * self.rings_per_mm) as usize;
        &self.probabilities[ring.min(RINGS - 1)]
    }
}

impl SpectralLenses {
    /// Makes the lenses of a lens. The pupil contains those of the shortest wavelength, the lens's
    /// own and the longest.
    pub(super) fn of(
        lens: &Lens,
        target: &PupilTarget,
        place: &FilmPlace,
        format: FilmFormat,
    ) -> Self {
        let sets = Spectrum::default().hero_sets();
        let lenses = sets
            .each_ref()
            .map(|lines| lines.each_ref().map(|line| lens.at_wavelength(line.nm)));
        let size = |line: &SpectralLine| {
            let entries = line.color.to_cols_array();
            entries.iter().map(|x| x * x).sum::<f64>().sqrt()
        };
        let target = match target {
            PupilTarget::RearElement(rear) => PupilTarget::RearElement(*rear),
            PupilTarget::ExitPupil(own) => {
                let at = |lens: &Lens| ExitPupil::new(lens, place, format.half_diagonal());
                let ends = [&lenses[0][0], &lenses[SETS - 1][HERO - 1]].map(at);
                let [blue, red] = &ends;
                PupilTarget::ExitPupil(Box::new(ExitPupil::around(&[blue, own, red])))
            }
        };
        Self {
            sizes: sets.each_ref().map(|lines| lines.each_ref().map(size)),
            sets,
            lenses,
            target,
            aiming: OnceLock::new(),
        }
    }

    /// The color of a wavelength by its number among those of all sets.
    #[inline(always)]
    pub(super) fn color(&self, line: u32) -> DMat3 {
        self.sets[line as usize / HERO][line as usize % HERO].color
    }

    /// How the rays of a set are aimed and chosen in a camera with these lenses.
    pub(super) fn aiming(&self, set: usize, camera: &LensCamera) -> &SetAiming {
        &self.aiming.get_or_init(|| self.measure(camera))[set]
    }

    fn measure(&self, camera: &LensCamera) -> Vec<SetAiming> {
        let nm = |set: usize| self.sets[set][MAIN].nm;
        let place = camera.place();
        let measure = |set: usize| self.target.vignetting(&self.lenses[set][MAIN], place);
        let measured = MEASURED.map(|set| (nm(set), measure(set)));
        let aiming = |set: usize| SetAiming {
            vignetting: Vignetting::interpolated(&measured, nm(set))
                .unwrap_or_else(|| measure(set)),
            probabilities: std::array::from_fn(|ring| self.probabilities(camera, set, ring)),
            rings_per_mm: RINGS as f64 / camera.format.half_diagonal(),
        };
        (0..SETS).map(aiming).collect()
    }

    /// The probability with which each wavelength of a set is traced from a ring of the film. It is
    /// that of being intersected, at the root mean square of the distances from the main ray of one
    /// packet of rays.
    fn probabilities(&self, camera: &LensCamera, set: usize, ring: usize) -> [f64; HERO] {
        let radius = camera.format.half_diagonal() * (ring as f64 + 0.5) / RINGS as f64;
        let even = |lane: usize| (lane as f64 + 0.5) / LANES as f64;
        let lanes = FilmSamples {
            film: [[radius; LANES], [0.0; LANES]],
            pupil: [
                std::array::from_fn(even),
                std::array::from_fn(|lane| even(lane * 13 % LANES)),
            ],
            count: LANES,
        };
        let (mut aims, mut bundle) = (Aims::default(), Bundle::default());
        let unknown = Vignetting::default();
        self.target
            .aims(&lanes.film, &lanes.pupil, &unknown, &mut aims);
        let rays = self.lenses[set].each_ref().map(|lens| {
            let mut out = ExitRays::default();
            camera.trace(lens, &lanes, &aims, &mut bundle, None, &mut out);
            out
        });
        std::array::from_fn(|line| {
            let both = rays[MAIN].rays.mask & rays[line].rays.mask;
            let squares = bits(both).map(|lane| distance([&rays[MAIN], &rays[line]], lane).powi(2));
            let mean = squares.sum::<f64>() / f64::from(both.count_ones().max(1));
            match line {
                MAIN => 0.0,
                _ => probability(self.sizes[set][line], mean.sqrt()),
            }
        })
    }
}
