//! The share of the light that a lens transmits, for all lanes and several wavelengths at once.
//!
//! The formulas are those of [`Coating::reflectance`](crate::lens::Coating::reflectance), written
//! for the products n cos θ of the media: a before the surface, b behind it and f in its layer. The
//! transmittance of a layer is 8abf²/(X + Y + (X − Y) cos φ) with X = f²(a + b)² and
//! Y = (f² + ab)², where φ is the phase of the path through the layer and back. For light polarized
//! in the plane of incidence each product is divided by the square of its index. Numerators and
//! denominators are multiplied over all surfaces, so that a ray takes one quotient.

use std::f64::consts::{FRAC_PI_2, PI};

use ivcam_base::math::lanes::{LANES, Lane, fused};

use crate::lens::lanes::step::LaneStep;
use crate::prescription::glass::coating::{FLUORIDE, QUARTER_WAVE_AT, Reflection};

/// The number of lanes whose transmittances are multiplied at a time.
const AT_ONCE: usize = 8;

/// The shares of the light of a bundle's rays that surfaces transmit, at wavelengths whose
/// reciprocals are evenly spaced.
#[derive(Clone, Debug)]
pub struct Transmittances {
    /// The phase φ/f at the first wavelength.
    first: f64,
    /// The difference of the phases φ/f at neighboring wavelengths.
    step: f64,
    /// The numerator and the denominator of the factor that all wavelengths share.
    common: [Lane; 2],
    /// The numerators and the denominators of each wavelength.
    own: Vec<[Lane; 2]>,
}

/// The phase φ/f of a layer at a wavelength in nanometers.
fn phase(wavelength_nm: f64) -> f64 {
    PI * QUARTER_WAVE_AT / (wavelength_nm * FLUORIDE)
}

impl Transmittances {
    /// The shares at one wavelength, in nanometers.
    pub fn at(wavelength_nm: f64) -> Self {
        Self::between([wavelength_nm; 2], 1)
    }

    /// The shares at `count` wavelengths from the first of `ends` to the last, in nanometers: from
    /// about 700 to 400 in at least four steps, for which the series of cosines are long enough.
    pub fn between(ends: [f64; 2], count: usize) -> Self {
        let [first, last] = ends.map(phase);
        Self {
            first,
            step: (last - first) / (count.max(2) - 1) as f64,
            common: [[1.0; LANES]; 2],
            own: vec![[[1.0; LANES]; 2]; count],
        }
    }

    /// Prepares for the rays of another bundle.
    pub(super) fn start(&mut self) {
        for all in self.own.iter_mut().chain([&mut self.common]) {
            *all = [[1.0; LANES]; 2];
        }
    }

    /// The share of each ray's light that all surfaces transmit, at the wavelength of a number.
    /// The shares of lost rays are meaningless.
    #[inline(always)]
    pub fn shares(&self, number: usize) -> Lane {
        let ([over, under], [above, below]) = (&self.common, &self.own[number]);
        std::array::from_fn(|i| over[i] * above[i] / (under[i] * below[i]))
    }

    /// Notes that rays cross a surface. `cos` are the cosines of the angles of incidence.
    #[inline(always)]
    pub(super) fn cross<const FUSED: bool>(&mut self, step: &LaneStep<'_>, cos: &Lane) {
        let [front, behind] = step.element.indices;
        let (from, into) = if step.sign > 0.0 {
            (front, behind)
        } else {
            (behind, front)
        };
        match step.element.coating.reflection(from, into) {
            Reflection::None => {}
            Reflection::Bare => self.bare::<FUSED>(from, into, cos),
            Reflection::Layer => self.layer::<FUSED>(from, into, cos),
        }
    }

    /// Crosses a surface without a layer, which transmits all wavelengths alike.
    #[inline(always)]
    fn bare<const FUSED: bool>(&mut self, from: f64, into: f64, cos: &Lane) {
        let [over, under] = &mut self.common;
        let step = into * into - from * from;
        let (in_from, in_into) = (1.0 / (from * from), 1.0 / (into * into));
        let both = in_from * in_into;
        for i in 0..LANES {
            let a = from * cos[i];
            let b = fused::<FUSED>(a, a, step).max(0.0).sqrt();
            let (s, p) = (a + b, fused::<FUSED>(a, in_from, b * in_into));
            let (s, p) = (s * s, p * p);
            over[i] *= 2.0 * a * b * fused::<FUSED>(both, s, p);
            under[i] *= s * p;
        }
    }

    /// Crosses a surface with a layer.
    #[inline(always)]
    fn layer<const FUSED: bool>(&mut self, from: f64, into: f64, cos: &Lane) {
        let [steps, inverse] = [
            [into, FLUORIDE].map(|n| n * n - from * from),
            [into, FLUORIDE].map(|n| 1.0 / (n * n)),
        ];
        let in_from = 1.0 / (from * from);
        let [mut depth, mut turn, mut last, mut twice] = [[0.0; LANES]; 4];
        // For each polarization, the parts of X + Y + (X − Y) cos φ, and those of the numerator.
        let [mut s, mut ds, mut p, mut dp, mut up, mut dup] = [[0.0; LANES]; 6];
        for i in 0..LANES {
            let a = from * cos[i];
            let b = fused::<FUSED>(a, a, steps[0]).max(0.0).sqrt();
            let f = fused::<FUSED>(a, a, steps[1]).max(0.0).sqrt();
            let own = airy::<FUSED>(a, b, f);
            let other = airy::<FUSED>(a * in_from, b * inverse[0], f * inverse[1]);
            [s[i], ds[i], p[i], dp[i]] = [own.sum, own.difference, other.sum, other.difference];
            let halves = [0.5 * own.above, 0.5 * other.above];
            up[i] = fused::<FUSED>(halves[0], other.sum, halves[1] * own.sum);
            dup[i] = fused::<FUSED>(halves[0], other.difference, halves[1] * own.difference);
            depth[i] = f;
        }
        if self.own.len() == 1 {
            for i in 0..LANES {
                turn[i] = cosine::<FUSED>(self.first * depth[i]);
            }
        } else {
            // The cosines of evenly spaced phases follow from the two before.
            for i in 0..LANES {
                turn[i] = cosine_near_quarter::<FUSED>(self.first * depth[i]);
                last[i] = cosine_near_quarter::<FUSED>((self.first - self.step) * depth[i]);
                let angle = self.step * depth[i];
                twice[i] = 2.0 * series::<FUSED>(&COSINE[..7], -angle * angle);
            }
        }
        // A few lanes at a time stay in registers over all wavelengths.
        for first in (0..LANES).step_by(AT_ONCE) {
            for [above, below] in &mut self.own {
                for i in first..first + AT_ONCE {
                    let t = turn[i];
                    above[i] *= fused::<FUSED>(dup[i], t, up[i]);
                    below[i] *= fused::<FUSED>(ds[i], t, s[i]) * fused::<FUSED>(dp[i], t, p[i]);
                    (turn[i], last[i]) = (fused::<FUSED>(twice[i], t, -last[i]), t);
                }
            }
        }
    }
}

/// The terms of the transmittance of a layer for one polarization.
struct Airy {
    /// The numerator 8abf².
    above: f64,
    /// X + Y.
    sum: f64,
    /// X − Y.
    difference: f64,
}

/// Returns the terms of the transmittance of a layer.
#[inline(always)]
fn airy<const FUSED: bool>(a: f64, b: f64, f: f64) -> Airy {
    let (product, across) = (a * b, f * (a + b));
    let along = fused::<FUSED>(f, f, product);
    let (x, y) = (across * across, along * along);
    Airy {
        above: 8.0 * product * (f * f),
        sum: x + y,
        difference: x - y,
    }
}

/// The coefficients of Taylor's series of the cosine, by the powers of the negative square.
const COSINE: [f64; 10] = {
    let mut all = [1.0; 10];
    let mut k = 1;
    while k < 10 {
        all[k] = all[k - 1] / ((2 * k - 1) * 2 * k) as f64;
        k += 1;
    }
    all
};

/// The coefficients of Taylor's series of the sine over the angle, by the powers of the negative
/// square.
const SINE: [f64; 9] = {
    let mut all = [1.0; 9];
    let mut k = 1;
    while k < 9 {
        all[k] = all[k - 1] / ((2 * k + 1) * 2 * k) as f64;
        k += 1;
    }
    all
};

/// The cosine of an angle of a few turns, with an error below 1e-14.
#[inline(always)]
fn cosine<const FUSED: bool>(angle: f64) -> f64 {
    // Adding this number rounds to the nearest integer.
    const SHIFT: f64 = 6_755_399_441_055_744.0;
    let halves = (angle * (1.0 / PI) + SHIFT) - SHIFT;
    let pairs = (halves * 0.5 + SHIFT) - SHIFT;
    let odd = fused::<FUSED>(-2.0, pairs, halves);
    let rest = fused::<FUSED>(-PI, halves, angle);
    // The sign changes with every half turn.
    series::<FUSED>(&COSINE, -rest * rest) * fused::<FUSED>(-2.0, odd * odd, 1.0)
}

/// The cosine of an angle within 1 of a quarter of a turn, with an error below 1e-14.
#[inline(always)]
fn cosine_near_quarter<const FUSED: bool>(angle: f64) -> f64 {
    let rest = FRAC_PI_2 - angle;
    rest * series::<FUSED>(&SINE, -rest * rest)
}

/// The sum of coefficients times the powers of a number.
#[inline(always)]
fn series<const FUSED: bool>(coefficients: &[f64], x: f64) -> f64 {
    let terms = coefficients.iter().rev();
    terms.fold(0.0, |sum, term| fused::<FUSED>(sum, x, *term))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::lens::lanes::bundle::Bundle;
    use crate::lens::{Coating, Lens, Toward};
    use ivcam_base::math::lanes::bits;

    #[test]
    fn the_series_is_the_cosine_of_the_library() {
        for i in -2000..=2000 {
            let angle = f64::from(i) * 0.01;
            let off = cosine::<false>(angle) - libm::cos(angle);
            assert!(off.abs() < 2e-14, "{angle}: {off}");
        }
        for i in -100..=100 {
            let angle = FRAC_PI_2 + f64::from(i) * 0.01;
            let off = cosine_near_quarter::<false>(angle) - libm::cos(angle);
            assert!(off.abs() < 1e-14, "{angle}: {off}");
        }
    }

    /// Rays through whole lenses, from film points near and far from the axis, transmit what the
    /// surfaces leave one after another.
    #[test]
    fn lanes_transmit_what_each_ray_alone_does() {
        let ends = [700.0, 400.0];
        let mut compared = 0;
        for (name, coating) in [
            ("double-gauss", Coating::Bare),
            ("double-gauss", Coating::MagnesiumFluoride),
            ("canon-70-200", Coating::MagnesiumFluoride),
            ("phone", Coating::MagnesiumFluoride),
            ("anamorphic", Coating::Bare),
        ] {
            let lens = Lens::named(name).unwrap().with_coating(coating);
            let mut bundle = Bundle::default();
            let rear = lens.prescription().surfaces.last().unwrap().semi_diameter;
            let back = lens.first_order().focal.unwrap().rear_focal_point;
            for lane in 0..LANES {
                let part = lane as f64 / LANES as f64 - 0.5;
                let origin = glam::DVec3::new(0.2 * rear * part, 0.1 * rear, back);
                let aim = glam::DVec3::new(0.4 * rear * part, 0.8 * rear * part, lens.length());
                let direction = (aim - origin).normalize();
                bundle.set(lane, &crate::lens::LensRay { origin, direction });
            }
            let rays = bundle.clone();
            for (mut shares, wavelengths) in [
                (
                    Transmittances::at(lens.wavelength()),
                    vec![lens.wavelength()],
                ),
                (
                    Transmittances::between(ends, 4),
                    vec![700.0, 560.0, 1400.0 / 3.0, 400.0],
                ),
            ] {
                let mut bundle = rays.clone();
                lens.trace_bundle_transmitted(&mut bundle, &mut shares);
                for (number, nm) in wavelengths.into_iter().enumerate() {
                    let found = shares.shares(number);
                    for lane in bits(bundle.through()) {
                        let known = lens.transmittance_at(&rays.ray(lane), Toward::Scene, nm);
                        let off = found[lane] - known;
                        assert!(off.abs() < 1e-12, "{name} {nm} {lane}: {off}");
                        compared += 1;
                    }
                }
            }
        }
        assert!(compared > 500, "{compared}");
    }
}
