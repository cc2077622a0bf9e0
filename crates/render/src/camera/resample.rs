//! Rays that are lost in the margin of the area aimed at are resampled.
//!
//! A lost ray is a sample without light, and if a hundredth of all samples are lost, that is the
//! greatest noise of an even part of a picture. Where the unvignetted fraction of the area aimed
//! at is known ([`Vignetting`]), a lost ray is aimed again from its film point until it gets
//! through, and every ray is weighted by the area of the light alone. The mean is the same, and the
//! noise is gone.

use ivcam_base::math::lanes::{LANES, bits};
use ivcam_optics::lens::{Aims, Bundle, Transmittances, Vignetting};
use ivcam_optics::sampling::CameraSamples;

use super::film_samples::{AimedSample, FilmSamples, ROUNDS};
use super::lens_camera::LensCamera;
use super::rays::{CameraRays, ExitRays};

/// Traces samples that are all aimed in the same way.
struct Shooting<'a> {
    camera: &'a LensCamera,
    vignetting: &'a Vignetting,
    transmittances: Option<Transmittances>,
    bundle: &'a mut Bundle,
    /// The samples to be traced.
    samples: FilmSamples,
    aims: Aims,
    /// The samples whose rays must be aimed again.
    lost: Vec<AimedSample>,
}

impl Shooting<'_> {
    /// Aims the rays of the samples and traces them. Multiplies their weights by the unvignetted
    /// fraction of the area at which they were aimed, and adds the samples of lost rays to
    /// `self.lost`. `number` returns the number of the sample in a lane.
    fn trace(&mut self, out: &mut ExitRays, number: impl Fn(usize) -> usize) {
        let (camera, samples, aims) = (self.camera, &self.samples, &mut self.aims);
        let target = &camera.target;
        target.aims(&samples.film, &samples.pupil, self.vignetting, aims);
        let dimming = self.transmittances.as_mut();
        camera.trace(&camera.lens, samples, aims, self.bundle, dimming, out);
        let known = aims.known_vignetting();
        for (weight, unvignetted) in out.weights.iter_mut().zip(&aims.unvignetted) {
            *weight *= match *unvignetted > 0.0 {
                true => *unvignetted,
                false => 1.0,
            };
        }
        let used = u32::MAX >> (LANES - samples.count);
        let lost = bits(known & used & !out.rays.mask);
        self.lost
            .extend(lost.map(|lane| samples.of_lane(lane, number(lane))));
    }
}

impl LensCamera {
    /// Makes the rays of samples at the lens's own wavelength. Lost rays are aimed again from their
    /// film points until they get through, up to [`ROUNDS`] times.
    pub(super) fn shoot(
        &self,
        samples: &CameraSamples,
        bundle: &mut Bundle,
        rays: &mut CameraRays,
    ) {
        let mut shooting = Shooting {
            camera: self,
            vignetting: self
                .vignetting
                .get_or_init(|| self.target.vignetting(&self.lens, &self.place)),
            transmittances: self.transmittances(&self.lens),
            bundle,
            samples: FilmSamples::default(),
            aims: Aims::default(),
            lost: Vec::new(),
        };
        for first in (0..samples.len()).step_by(LANES) {
            shooting.samples.take_from(self.format, samples, first);
            shooting.trace(rays.next_packet(), |lane| first + lane);
            rays.accept(first);
        }
        for round in 0..ROUNDS {
            let mut lost = std::mem::take(&mut shooting.lost);
            lost.iter_mut().for_each(|lost| lost.aim_again(round));
            for chunk in lost.chunks(LANES) {
                shooting.samples.take(chunk);
                shooting.trace(rays.next_packet(), |lane| chunk[lane].sample);
                rays.append_filled(|lane| chunk[lane].sample as u32);
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use glam::DVec2;

    use super::*;
    use crate::camera::Aim;
    use ivcam_base::math::Meters;
    use ivcam_inventor::pose::CameraPose;
    use ivcam_optics::film::FilmFormat;
    use ivcam_optics::lens::{FocusMethod, Lens};
    use ivcam_optics::sampling::{Sampler, SamplerKind};

    /// Every sample has a ray that gets through, and their mean weight is the irradiance by the
    /// pupil's outline: over 1,024 scrambled nets for each film point, within 4.5 standard errors
    /// and 2e-4.
    #[test]
    fn every_sample_finds_light_and_the_mean_is_the_irradiance() {
        for name in ["double-gauss", "biogon", "primoplan"] {
            let lens = Lens::named(name).unwrap();
            let focus = lens
                .focus(FocusMethod::Film, Meters(f64::INFINITY))
                .unwrap();
            let pose = CameraPose::view_all(Default::default(), 1.5);
            let camera = LensCamera::new(lens, focus, FilmFormat::STANDARD, Aim::ExitPupil, &pose);
            for place in [[0.5, 0.5], [0.6, 0.35], [0.1, 0.9], [0.02, 0.03]] {
                let film: DVec2 = camera.film_point(place[0], place[1]);
                let known = camera.lens.irradiance(film, camera.focus.film_z);
                let sampler = Sampler::new(SamplerKind::Sobol, 64, 3);
                let means: Vec<f64> = (0..1024)
                    .map(|pixel| {
                        let mut samples = CameraSamples::default();
                        samples.request(&sampler.pixel(pixel, [0, 0]), 0..64);
                        samples.draw();
                        samples.film = place.map(|at| vec![at; 64]);
                        let (mut bundle, mut shot) = (Bundle::default(), CameraRays::default());
                        camera.shoot(&samples, &mut bundle, &mut shot);
                        let (mut sum, mut rays) = (0.0, 0);
                        for packet in shot.packets() {
                            for lane in bits(packet.rays.mask) {
                                sum += packet.weights[lane];
                                rays += 1;
                            }
                        }
                        assert_eq!(rays, 64, "{name} {place:?}");
                        sum / 64.0 * camera.axial_irradiance()
                    })
                    .collect();
                let n = means.len() as f64;
                let mean = means.iter().sum::<f64>() / n;
                let square: f64 = means.iter().map(|m| (m - mean) * (m - mean)).sum();
                let error = (square / (n * (n - 1.0))).sqrt();
                assert!(
                    (mean - known).abs() < 4.5 * error + 2e-4 * known,
                    "{name} {place:?}: {mean} {known} {error}"
                );
            }
        }
    }
}
