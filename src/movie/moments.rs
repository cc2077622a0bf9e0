//! A frame that is exposed at several moments while the shutter is open.

use ivcam_base::diag::{Diagnostic, Result};
use ivcam_render::render::{Exposure, Stop};

/// The largest number of times that a frame is exposed to reach its target error.
const ATTEMPTS: u32 = 3;

/// Exposes a frame at `count` moments, each for an equal part of it. `expose` returns the exposure
/// of a moment that ends at given conditions. Samples and time are shared out evenly.
///
/// The error of the mean of n pictures that have the same error and the same mean is 1/√n of
/// theirs, so the moments' target is √n of the frame's. Where the frame then has a larger error,
/// because the moments differ, it is exposed again with a smaller target.
///
/// # Errors
/// Returns the first error of `expose`, or an error if there is no moment.
pub fn expose_moments(
    count: u32,
    stop: Stop,
    expose: &mut dyn FnMut(u32, Stop) -> Result<Exposure>,
) -> Result<Exposure> {
    let parts = count.max(1);
    let mut of_moment = Stop {
        error: stop.error.map(|e| e * f64::from(parts).sqrt()),
        time: stop.time.map(|t| t / parts),
        ..stop
    };
    let mut attempt = 1;
    loop {
        let mut frame: Option<Exposure> = None;
        for i in 0..count {
            let samples = share(stop.samples, i, parts);
            let part = expose(
                i,
                Stop {
                    samples,
                    ..of_moment
                },
            )?;
            match &mut frame {
                None => frame = Some(part),
                Some(sum) => sum.join(&part, 1.0 / f64::from(i + 1)),
            }
        }
        let frame =
            frame.ok_or_else(|| Diagnostic::error("a frame without a moment can't be exposed"))?;
        let excess = stop.error.map(|target| match frame.film.error() {
            Ok(error) => error.high / target,
            Err(_) => 2.0,
        });
        let excess = excess.filter(|excess| *excess > 1.0);
        let may_go_on = attempt < ATTEMPTS && stop.time.is_none() && frame.samples < stop.samples;
        match excess {
            Some(excess) if may_go_on => {
                of_moment.error = of_moment.error.map(|e| 0.9 * e / excess);
                attempt += 1;
            }
            _ => return Ok(frame),
        }
    }
}

/// Returns the number of samples of one of several parts: the remainder of the division is spread
/// evenly over them. Every part has at least one.
pub(super) fn share(samples: u32, part: u32, parts: u32) -> u32 {
    let before = |part: u32| u64::from(samples) * u64::from(part) / u64::from(parts);
    ((before(part + 1) - before(part)) as u32).max(1)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_parts_of_a_frame_have_all_of_its_samples() {
        for (samples, parts) in [
            (31, 16),
            (16, 16),
            (17, 16),
            (100, 16),
            (3, 2),
            (u32::MAX, 16),
        ] {
            let shares: Vec<u32> = (0..parts).map(|i| share(samples, i, parts)).collect();
            let sum: u64 = shares.iter().map(|n| u64::from(*n)).sum();
            assert_eq!(sum, u64::from(samples));
            let (least, most) = (shares.iter().min(), shares.iter().max());
            assert!(most.unwrap() - least.unwrap() <= 1, "{shares:?}");
        }
    }
    use ivcam_optics::film::Resolution;

    /// What is seen at one of two moments has half of its light, whichever moment it is.
    #[test]
    fn a_moment_without_light_darkens_the_frame() {
        let resolution = Resolution::new(2, 1).unwrap();
        for lit_moment in 0..2 {
            let mut expose = |moment: u32, stop: Stop| {
                let mut exposure = Exposure::without_light(resolution, stop.samples);
                if moment == lit_moment {
                    for pixel in &mut exposure.film.pixels {
                        *pixel = Default::default();
                        for level in [1.0, 3.0] {
                            pixel.add(glam::DVec3::splat(level));
                        }
                    }
                }
                Ok(exposure)
            };
            let frame = expose_moments(2, Stop::after(4), &mut expose).unwrap();
            for pixel in &frame.film.pixels {
                assert_eq!((pixel.count, pixel.mean.x), (4, 1.0));
            }
        }
    }
}
