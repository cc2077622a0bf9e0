//! A lens at the wavelengths of every hero set.

use crate::film::FilmFormat;
use crate::lens::{ExitPupil, FilmPlace, Lens, PupilTarget};
use crate::spectrum::{HERO, Line, SETS, Spectrum};

/// A lens at the wavelengths of every hero set.
#[derive(Clone, Debug)]
pub(super) struct SpectralLenses {
    /// The wavelengths of each set.
    pub sets: [[Line; HERO]; SETS],
    /// The lens at each of the wavelengths.
    pub lenses: [[Lens; HERO]; SETS],
    /// The size of each wavelength's color: the root of the sum of the squares of its matrix.
    pub sizes: [[f64; HERO]; SETS],
    /// The target of the rays at all wavelengths.
    pub target: PupilTarget,
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
        let size = |line: &Line| {
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
        }
    }
}
