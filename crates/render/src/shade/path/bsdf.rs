//! How a surface scatters light: a matte part under a layer of microfacets.
//!
//! Directions are in coordinates whose z axis is the normal, and point away from the surface. With
//! E the share of light that the layer sends back and Ē its mean over all directions, the sum is
//!
//! ```text
//! f = F·D·G₂ / (4 cosₒ cosᵢ)                               one reflection at a microfacet
//!   + Fₘ (1−E₁(ωₒ))(1−E₁(ωᵢ)) / (π(1−Ē₁))                  several (Kulla and Conty 2017)
//!   + ρ (1−E(ωₒ))(1−E(ωᵢ)) / (π(1−Ē))                      the matte part below
//! ```
//!
//! where E₁ is E of a layer that absorbs nothing and Fₘ = F̄²Ē₁/(1−F̄(1−Ē₁)). The matte part
//! (Kelemen and Szirmay-Kalos, "A microfacet based coupled specular-matte BRDF model", 2001) gets
//! exactly the light that the layer lets through, so f is reciprocal and its albedo is at most 1.
//! Fresnel's factor is Schlick's, from F₀ to F₉₀ at grazing angles. F₉₀ is 1, or less where a
//! physical material says so; a layer with F₀ below 2% fades away (Lagarde and de Rousiers, "Moving
//! Frostbite to physically based rendering", 2014, 3.1.3).

use std::f32::consts::FRAC_1_PI;

use glam::Vec3;

use super::environment::mean;
use super::frame::cosine_direction;
use super::microfacets::{AlbedoRow, Microfacets, schlick};
use crate::scene::sound_color;

/// The reflectances of a surface at a point, none above 1.
#[derive(Clone, Copy, Debug)]
pub(super) struct Reflectance {
    /// The matte part ρ.
    pub(super) diffuse: Vec3,
    /// The microfacets' reflectance at normal incidence, F₀.
    pub(super) specular: Vec3,
    /// The largest reflectance of the microfacets at grazing angles, at least F₀.
    pub(super) grazing: f32,
    /// The microfacets' slopes.
    pub(super) facets: Microfacets,
}

/// Scales two reflectances so that no channel of their sum exceeds 1, as Phong's diffuse and
/// specular color must not. NaN and what is negative become 0.
pub(super) fn conserving(diffuse: Vec3, specular: Vec3) -> (Vec3, Vec3) {
    let (diffuse, specular) = (sound_color(diffuse), sound_color(specular));
    let most = (diffuse + specular).max_element();
    match most > 1.0 {
        true => (diffuse / most, specular / most),
        false => (diffuse, specular),
    }
}

/// The scattering at a point, as seen from one direction.
pub(super) struct Bsdf {
    own: Reflectance,
    wo: Vec3,
    layer: Option<Layer>,
    /// The probability that a microfacet is sampled.
    facet_share: f32,
    /// The shares of light that the microfacets and the rest send back.
    shares: [f32; 2],
    /// Whether the microfacets all face up, so that only one direction is mirrored.
    is_mirror: bool,
}

/// The values of the layer that do not depend on the second direction.
struct Layer {
    f90: f32,
    row: AlbedoRow,
    /// The share Fₘ of the light that one reflection loses which further ones send back.
    share: Vec3,
    /// The factors of 1−E(ωᵢ) and 1−E₁(ωᵢ) in the matte part and in the part of several
    /// reflections.
    matte: Vec3,
    several: Vec3,
}

/// A direction that was drawn.
#[derive(Clone, Copy, Debug)]
pub(super) struct BsdfSample {
    pub(super) wi: Vec3,
    /// The BSDF times the cosine over the density.
    pub(super) weight: Vec3,
    /// The density over solid angle; infinite for a mirrored direction.
    pub(super) pdf: f32,
}

impl Bsdf {
    /// The scattering seen from `wo`, which is above the surface.
    pub(super) fn new(own: Reflectance, wo: Vec3, is_mirror: bool) -> Self {
        let wo = Vec3::new(wo.x, wo.y, wo.z.max(1e-4));
        let f90 = (50.0 * own.specular.max_element()).min(own.grazing);
        if !(f90 > 0.0) {
            return Self {
                own,
                wo,
                layer: None,
                facet_share: 0.0,
                shares: [0.0; 2],
                is_mirror,
            };
        }
        let row = AlbedoRow::of(own.facets);
        let (at, average) = (row.at(wo.z), row.mean());
        let single = average.base + average.edge;
        let fresnel = own.specular + (f90 - own.specular) / 21.0;
        let share = fresnel * fresnel * single / (1.0 - fresnel * (1.0 - single));
        let below = |single: Vec3, whole: f32| Vec3::ONE - single - share * (1.0 - whole);
        let seen = below(at.of(own.specular, f90), at.base + at.edge);
        let all = below(average.of(own.specular, f90), single).max(Vec3::splat(1e-4));
        let matte = own.diffuse * seen / all;
        let several = share * (1.0 - at.base - at.edge) / (1.0 - single).max(1e-4);
        let facets = mean(at.of(own.specular, f90));
        let rest = mean(own.diffuse * seen) + mean(several) * (1.0 - single);
        Self {
            own,
            wo,
            is_mirror,
            shares: [facets, rest],
            facet_share: (facets / (facets + rest).max(1e-9)).clamp(0.1, 0.9),
            layer: Some(Layer {
                f90,
                row,
                share,
                matte,
                several,
            }),
        }
    }

    /// The shares of light that the microfacets and the rest send back; `None` for what is matte or
    /// a mirror.
    pub(super) fn shares(&self) -> Option<[f32; 2]> {
        let is_rough = self.layer.is_some() && !self.is_mirror;
        is_rough.then_some(self.shares)
    }

    /// The direction to the viewer.
    pub(super) fn viewer(&self) -> Vec3 {
        self.wo
    }

    /// The roughness α of the microfacets.
    pub(super) fn roughness(&self) -> f32 {
        self.own.facets.alpha
    }

    /// Whether there is no layer of microfacets.
    pub(super) fn is_matte(&self) -> bool {
        self.layer.is_none()
    }

    /// Returns the BSDF times the cosine of `wi`, and the density with which [`Bsdf::sample`] draws
    /// it. Both are 0 below the surface.
    pub(super) fn eval(&self, wi: Vec3) -> (Vec3, f32) {
        if !(wi.z > 0.0) {
            return (Vec3::ZERO, 0.0);
        }
        let cosine = wi.z * FRAC_1_PI;
        let Some(layer) = &self.layer else {
            return (self.own.diffuse * cosine, cosine);
        };
        let h = (self.wo + wi).normalize_or(Vec3::Z);
        let (facet, pdf) = match self.is_mirror {
            true => (0.0, 0.0),
            false => self.own.facets.eval(self.wo, wi, h),
        };
        let edge = schlick(wi.dot(h));
        let f0 = self.own.specular;
        let fresnel = f0 + (layer.f90 - f0) * edge;
        let at = layer.row.at(wi.z);
        let whole = at.base + at.edge;
        let through = Vec3::ONE - at.of(f0, layer.f90) - layer.share * (1.0 - whole);
        let below = layer.matte * through + layer.several * (1.0 - whole);
        let value = fresnel * facet + below.max(Vec3::ZERO) * cosine;
        let share = self.facet_share;
        (value, share * pdf + (1.0 - share) * cosine)
    }

    /// The density over solid angle with which [`Bsdf::sample`] draws a direction.
    #[cfg(test)]
    fn pdf(&self, wi: Vec3) -> f32 {
        self.eval(wi).1
    }

    /// Draws a direction from which light comes. `choice` and `u` are from 0 to 1. Returns `None`
    /// if the sample is below the surface, which has no light.
    pub(super) fn sample(&self, choice: f32, u: [f32; 2]) -> Option<BsdfSample> {
        if self.is_matte() {
            // The density is the cosine over π, which cancels that of the reflected light.
            let wi = cosine_direction(u);
            return (wi.z > 0.0).then_some(BsdfSample {
                wi,
                weight: self.own.diffuse,
                pdf: wi.z * FRAC_1_PI,
            });
        }
        let wi = if choice < self.facet_share {
            if self.is_mirror {
                return self.mirrored();
            }
            let h = self.own.facets.sample(self.wo, u);
            2.0 * self.wo.dot(h) * h - self.wo
        } else {
            cosine_direction(u)
        };
        let (value, pdf) = self.eval(wi);
        (pdf > 0.0).then(|| BsdfSample {
            wi,
            weight: value / pdf,
            pdf,
        })
    }

    /// The mirrored direction, whose density is infinite.
    fn mirrored(&self) -> Option<BsdfSample> {
        let (f0, f90) = (self.own.specular, self.layer.as_ref()?.f90);
        let fresnel = f0 + (f90 - f0) * schlick(self.wo.z);
        Some(BsdfSample {
            wi: Vec3::new(-self.wo.x, -self.wo.y, self.wo.z),
            weight: fresnel / self.facet_share,
            pdf: f32::INFINITY,
        })
    }
}

#[cfg(test)]
mod tests {
    use super::super::frame::cone_direction;
    use super::*;
    use glam::DVec3;
    use ivcam_optics::sampling::{mix, unit};

    /// Random numbers from a seed.
    struct TestNumbers(u64);

    impl TestNumbers {
        fn next(&mut self) -> f32 {
            self.0 = self.0.wrapping_add(1);
            (unit(mix(self.0)) as f32).min(1.0f32.next_down())
        }

        fn pair(&mut self) -> [f32; 2] {
            [self.next(), self.next()]
        }

        fn vec(&mut self) -> Vec3 {
            Vec3::new(self.next(), self.next(), self.next())
        }

        /// A random material; one in four is matte, and one in four a metal.
        fn material(&mut self) -> Reflectance {
            let kind = self.next();
            let (mut diffuse, mut specular) = (self.vec(), self.vec());
            if kind < 0.25 {
                specular = Vec3::ZERO;
            } else if kind < 0.5 {
                (diffuse, specular) = (Vec3::ZERO, 0.5 + 0.5 * specular);
            }
            (diffuse, specular) = conserving(diffuse, specular);
            Reflectance {
                diffuse,
                specular,
                grazing: 1.0,
                facets: Microfacets::of_exponent(128.0 * self.next()),
            }
        }

        /// A direction above the surface.
        fn direction(&mut self) -> Vec3 {
            cone_direction(Vec3::Z, 0.02, self.pair())
        }
    }

    #[test]
    fn light_takes_the_same_way_in_both_directions() {
        let mut random = TestNumbers(1);
        for _ in 0..10_000 {
            let (own, a, b) = (random.material(), random.direction(), random.direction());
            let there = Bsdf::new(own, a, false).eval(b).0 / b.z;
            let back = Bsdf::new(own, b, false).eval(a).0 / a.z;
            let off = (there - back).abs().max_element();
            assert!(
                off < 1e-3 * there.max_element() + 1e-5,
                "{own:?} {a} {b}: {there} {back}"
            );
        }
    }

    /// The albedo of each channel of 10,000 materials is estimated from 256 samples. If none
    /// exceeds 1, a z-value above 5 has a probability of 3e-7, and one of 30,000 of 0.9%.
    #[test]
    fn no_material_of_ten_thousand_sends_back_more_light_than_it_gets() {
        let mut random = TestNumbers(1 << 40);
        let mut sum = 0.0;
        for number in 0..10_000u32 {
            let own = random.material();
            let bsdf = Bsdf::new(own, random.direction(), false);
            let (mut mean, mut square) = (DVec3::ZERO, DVec3::ZERO);
            for _ in 0..256 {
                let drawn = bsdf.sample(random.next(), random.pair());
                let weight = drawn.map_or(DVec3::ZERO, |s| s.weight.as_dvec3());
                mean += weight / 256.0;
                square += weight * weight / 256.0;
            }
            let variance = (square - mean * mean).max(DVec3::ZERO) / 256.0;
            for channel in 0..3 {
                let sigma = variance[channel].sqrt().max(1e-4);
                let z = (mean[channel] - 1.0) / sigma;
                assert!(z < 5.0, "material {number}, {own:?}: {mean} ± {sigma}");
            }
            sum += mean.x;
        }
        assert!(sum > 3000.0, "{sum}");
    }

    /// Under white light from everywhere a metal that absorbs nothing is as bright as the light,
    /// and so is a clear layer on white.
    #[test]
    fn what_absorbs_nothing_vanishes_in_a_white_furnace() {
        let white = |diffuse: f32, specular: f32| [diffuse, specular].map(Vec3::splat);
        for colors in [white(0.0, 1.0), white(1.0, 0.04), white(1.0, 0.5)] {
            check_in_white_furnace(colors);
        }
    }

    fn check_in_white_furnace([diffuse, specular]: [Vec3; 2]) {
        let mut random = TestNumbers(2);
        for n in [0.0, 3.0, 20.0, 128.0] {
            for cosine in [0.1f32, 0.4, 0.95] {
                let own = Reflectance {
                    diffuse,
                    specular,
                    grazing: 1.0,
                    facets: Microfacets::of_exponent(n),
                };
                let wo = Vec3::new((1.0 - cosine * cosine).sqrt(), 0.0, cosine);
                let bsdf = Bsdf::new(own, wo, false);
                let count = 100_000;
                let (mut sum, mut square) = (0.0f64, 0.0f64);
                for _ in 0..count {
                    let drawn = bsdf.sample(random.next(), random.pair());
                    let w = f64::from(drawn.map_or(0.0, |s| s.weight.x));
                    (sum, square) = (sum + w, square + w * w);
                }
                let mean = sum / f64::from(count);
                let sigma = ((square / f64::from(count) - mean * mean) / f64::from(count)).sqrt();
                // The table's own error is 2e-3.
                assert!(
                    (mean - 1.0).abs() < 4.0 * sigma + 2e-3,
                    "{n} {cosine}: {mean} ± {sigma}"
                );
            }
        }
    }

    /// Pearson's test of drawn directions against the integral of the density over 16 × 32 cells
    /// of the sphere. The p-value of each of 24 materials must exceed 1e-5.
    #[test]
    fn directions_are_drawn_with_the_stated_density() {
        let mut random = TestNumbers(3);
        for number in 0..24 {
            let own = random.material();
            let bsdf = Bsdf::new(own, cone_direction(Vec3::Z, 0.2, random.pair()), false);
            let (rows, columns, count) = (16usize, 32usize, 40_000);
            let mut seen = vec![0.0f64; rows * columns];
            let mut lost = 0.0;
            for _ in 0..count {
                match bsdf.sample(random.next(), random.pair()) {
                    Some(s) => {
                        let turn = libm::atan2f(s.wi.y, s.wi.x) / std::f32::consts::TAU + 0.5;
                        let row = ((s.wi.z * rows as f32) as usize).min(rows - 1);
                        let column = ((turn * columns as f32) as usize).min(columns - 1);
                        seen[row * columns + column] += 1.0;
                    }
                    None => lost += 1.0,
                }
            }
            let (mut chi, mut freedom, mut all) = (0.0, -1.0, 0.0);
            let fine = 24;
            let (mut few, mut few_seen) = (0.0, 0.0);
            for (cell, seen) in seen.iter().enumerate() {
                let mut expected = 0.0f64;
                for i in 0..fine * fine {
                    let (a, b) = ((i / fine) as f32 + 0.5, (i % fine) as f32 + 0.5);
                    let z = ((cell / columns) as f32 + a / fine as f32) / rows as f32;
                    let turn = ((cell % columns) as f32 + b / fine as f32) / columns as f32 - 0.5;
                    let (r, turn) = ((1.0 - z * z).sqrt(), std::f32::consts::TAU * turn);
                    let wi = Vec3::new(r * libm::cosf(turn), r * libm::sinf(turn), z);
                    expected += f64::from(bsdf.pdf(wi));
                }
                let solid = std::f64::consts::TAU / (rows * columns * fine * fine) as f64;
                let expected = expected * solid * f64::from(count);
                all += expected;
                if expected < 8.0 {
                    (few, few_seen) = (few + expected, few_seen + seen);
                    continue;
                }
                chi += (seen - expected).powi(2) / expected;
                freedom += 1.0;
            }
            // The cells with little expected, and what is below the surface, are one cell each.
            let below = f64::from(count) - all;
            for (expected, seen) in [(few, few_seen), (below, lost)] {
                if expected >= 8.0 {
                    chi += (seen - expected).powi(2) / expected;
                    freedom += 1.0;
                }
            }
            // Wilson and Hilferty's normal approximation; 4.27 is a p-value of 1e-5.
            let k: f64 = freedom;
            let z = ((chi / k).cbrt() - (1.0 - 2.0 / (9.0 * k))) / (2.0 / (9.0 * k)).sqrt();
            assert!(
                z < 4.27,
                "material {number}, {own:?}: χ² = {chi} of {freedom}, z = {z}"
            );
        }
    }

    /// The mean of the weights is the integral of the BSDF by a grid over the hemisphere.
    #[test]
    fn samples_have_the_light_of_the_integral() {
        let mut random = TestNumbers(4);
        for number in 0..20 {
            let own = random.material();
            let bsdf = Bsdf::new(own, cone_direction(Vec3::Z, 0.2, random.pair()), false);
            let side = 700;
            let mut exact = 0.0f64;
            for i in 0..side * side {
                let u = [i / side, i % side].map(|k| (k as f32 + 0.5) / side as f32);
                let wi = cosine_direction(u);
                exact += f64::from(bsdf.eval(wi).0.y / (wi.z * FRAC_1_PI));
            }
            exact /= f64::from(side * side);
            let count = 40_000;
            let (mut sum, mut square) = (0.0f64, 0.0f64);
            for _ in 0..count {
                let drawn = bsdf.sample(random.next(), random.pair());
                let w = f64::from(drawn.map_or(0.0, |s| s.weight.y));
                (sum, square) = (sum + w, square + w * w);
            }
            let mean = sum / f64::from(count);
            let sigma = ((square / f64::from(count) - mean * mean) / f64::from(count)).sqrt();
            let z = (mean - exact) / sigma.max(1e-5);
            assert!(
                z.abs() < 4.5,
                "material {number}, {own:?}: {mean} ± {sigma}, {exact}"
            );
        }
    }
}
