//! Reflection at a rough surface of tiny mirrors, in coordinates whose z axis is the normal.
//!
//! The slopes are distributed by GGX (Walter and others, "Microfacet models for refraction through
//! rough surfaces", 2007), and hide each other by Smith's height-correlated function. Normals are
//! drawn as a viewer sees them (Heitz, "Sampling the GGX distribution of visible normals", 2018).

use std::f32::consts::{PI, TAU};
use std::sync::OnceLock;

use glam::Vec3;

/// A distribution of slopes with the roughness α, from 0 to 1.
#[derive(Clone, Copy, Debug)]
pub(super) struct Microfacets {
    pub(super) alpha: f32,
}

impl Microfacets {
    /// The roughness of the highlight cosⁿ of the angle to the halfway vector: α = √(2/(n+2))
    /// (Walter and others, equation 30 and the text after it).
    pub(super) fn of_exponent(n: f32) -> Self {
        Self {
            alpha: (2.0 / (n + 2.0)).sqrt(),
        }
    }

    /// The density D of microfacet normals: the integral of D·cos over the hemisphere is 1.
    fn density(self, h: Vec3) -> f32 {
        let a = self.alpha * self.alpha;
        let d = h.z * h.z * (a - 1.0) + 1.0;
        a / (PI * d * d).max(1e-30)
    }

    /// Smith's function Λ of a direction.
    fn lambda(self, w: Vec3) -> f32 {
        let cos2 = (w.z * w.z).max(1e-12);
        let tan2 = (1.0 - cos2).max(0.0) / cos2;
        0.5 * ((1.0 + self.alpha * self.alpha * tan2).sqrt() - 1.0)
    }

    /// The share of the visible normals' light that is not hidden on its way out: G₂/G₁.
    fn unhidden(self, wo: Vec3, wi: Vec3) -> f32 {
        let (o, i) = (self.lambda(wo), self.lambda(wi));
        (1.0 + o) / (1.0 + o + i)
    }

    /// The BRDF times the cosine of `wi`, without Fresnel's factor; and the density with which
    /// [`Microfacets::sample`] draws `wi`.
    pub(super) fn eval(self, wo: Vec3, wi: Vec3, h: Vec3) -> (f32, f32) {
        let (o, i) = (self.lambda(wo), self.lambda(wi));
        let common = self.density(h) / (4.0 * wo.z);
        (common / (1.0 + o + i), common / (1.0 + o))
    }

    /// Draws the normal of a mirror that is seen from `wo`.
    pub(super) fn sample(self, wo: Vec3, u: [f32; 2]) -> Vec3 {
        let a = self.alpha;
        let v = Vec3::new(a * wo.x, a * wo.y, wo.z).normalize_or(Vec3::Z);
        let across = Vec3::new(-v.y, v.x, 0.0).normalize_or(Vec3::X);
        let up = v.cross(across);
        let (r, turn) = (u[0].sqrt(), TAU * u[1]);
        let (x, mut y) = (r * libm::cosf(turn), r * libm::sinf(turn));
        let s = 0.5 * (1.0 + v.z);
        y = (1.0 - s) * (1.0 - x * x).max(0.0).sqrt() + s * y;
        let n = x * across + y * up + (1.0 - x * x - y * y).max(0.0).sqrt() * v;
        Vec3::new(a * n.x, a * n.y, n.z.max(1e-6)).normalize_or(Vec3::Z)
    }
}

/// The part of Schlick's factor that grows toward grazing angles: (1 − cos)⁵.
pub(super) fn schlick(cos: f32) -> f32 {
    let m = (1.0 - cos).clamp(0.0, 1.0);
    m * m * (m * m) * m
}

/// The share of light that the microfacets send back: `F0 · base + F90 · edge`.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct LobeAlbedo {
    pub(super) base: f32,
    pub(super) edge: f32,
}

impl LobeAlbedo {
    fn lerp(self, other: Self, share: f32) -> Self {
        Self {
            base: self.base + (other.base - self.base) * share,
            edge: self.edge + (other.edge - self.edge) * share,
        }
    }

    /// The share of light for a reflectance at normal incidence and at grazing angles.
    pub(super) fn of(self, f0: Vec3, f90: f32) -> Vec3 {
        f0 * self.base + Vec3::splat(f90 * self.edge)
    }
}

/// The intervals of roughness in the table.
const ROUGH: usize = 16;
/// The intervals of the cosine's square root in the table.
const COSINES: usize = 32;
/// The binary logarithm of the samples of an entry.
const SAMPLE_BITS: u32 = 10;

/// The albedos of a roughness by the cosine of the direction, and their means over all directions.
struct TableRow {
    at: [LobeAlbedo; COSINES + 1],
    mean: LobeAlbedo,
}

static TABLE: OnceLock<Vec<TableRow>> = OnceLock::new();

/// The albedos by roughness, from 0 to 1. They are integrated over 1024 visible normals,
/// at Hammersley's points: an entry is right to 1e-3.
fn table() -> &'static [TableRow] {
    TABLE.get_or_init(|| (0..=ROUGH).map(row).collect())
}

fn cosine_of(entry: usize) -> f32 {
    let x = entry as f32 / COSINES as f32;
    (x * x).max(1e-4)
}

fn row(number: usize) -> TableRow {
    let facets = Microfacets {
        alpha: (number as f32 / ROUGH as f32).max(1e-3),
    };
    let mut at = [LobeAlbedo::default(); COSINES + 1];
    for (entry, out) in at.iter_mut().enumerate() {
        *out = albedo(facets, cosine_of(entry));
    }
    // ∫ 2μE dμ of the function between the entries, which is linear in √μ = x: ∫ 4x³E dx.
    let mut mean = LobeAlbedo::default();
    for (i, pair) in at.windows(2).enumerate() {
        let (a, b) = (i as f32 / COSINES as f32, (i + 1) as f32 / COSINES as f32);
        // ∫ 4x³ over the interval, and the part of it that the upper entry has.
        let fourth = |x: f32| x * x * x * x;
        let all = fourth(b) - fourth(a);
        let upper = (0.8 * (b * fourth(b) - a * fourth(a)) - a * all) / (b - a);
        mean.base += pair[0].base * (all - upper) + pair[1].base * upper;
        mean.edge += pair[0].edge * (all - upper) + pair[1].edge * upper;
    }
    TableRow { at, mean }
}

fn albedo(facets: Microfacets, cosine: f32) -> LobeAlbedo {
    let wo = Vec3::new((1.0 - cosine * cosine).max(0.0).sqrt(), 0.0, cosine);
    let mut sum = LobeAlbedo::default();
    let count = 1u32 << SAMPLE_BITS;
    for i in 0..count {
        let reversed = i.reverse_bits() >> (32 - SAMPLE_BITS);
        let u = [i, reversed].map(|k| (k as f32 + 0.5) / count as f32);
        let h = facets.sample(wo, u);
        let wi = 2.0 * wo.dot(h) * h - wo;
        if wi.z > 0.0 {
            let (share, edge) = (facets.unhidden(wo, wi), schlick(wo.dot(h)));
            sum.base += share * (1.0 - edge);
            sum.edge += share * edge;
        }
    }
    let count = count as f32;
    LobeAlbedo {
        base: sum.base / count,
        edge: sum.edge / count,
    }
}

/// The albedos of one roughness: a function of the cosine, and its mean over all directions.
#[derive(Clone, Copy)]
pub(super) struct AlbedoRow {
    low: &'static TableRow,
    high: &'static TableRow,
    share: f32,
}

impl AlbedoRow {
    pub(super) fn of(facets: Microfacets) -> Self {
        let at = facets.alpha.clamp(0.0, 1.0) * ROUGH as f32;
        let low = (at as usize).min(ROUGH - 1);
        let table = table();
        Self {
            low: &table[low],
            high: &table[low + 1],
            share: at - low as f32,
        }
    }

    /// The albedo in a direction with a cosine.
    pub(super) fn at(&self, cosine: f32) -> LobeAlbedo {
        let x = cosine.clamp(0.0, 1.0).sqrt() * COSINES as f32;
        let low = (x as usize).min(COSINES - 1);
        let of = |row: &TableRow| row.at[low].lerp(row.at[low + 1], x - low as f32);
        of(self.low).lerp(of(self.high), self.share)
    }

    /// The mean albedo over all directions, each weighted by its cosine.
    pub(super) fn mean(&self) -> LobeAlbedo {
        self.low.mean.lerp(self.high.mean, self.share)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// The exponent's density (n+2)/2π·cosⁿ and GGX agree where Phong's highlight is brightest.
    #[test]
    fn the_roughness_of_an_exponent_has_the_peak_of_its_highlight() {
        for n in [2.0, 10.0, 50.0, 128.0f32] {
            let peak = Microfacets::of_exponent(n).density(Vec3::Z);
            assert!((peak / ((n + 2.0) / TAU) - 1.0).abs() < 1e-4, "{n}: {peak}");
        }
    }

    /// The mean of the table is compared with the midpoint rule over the interpolated function.
    #[test]
    fn the_mean_albedo_is_that_of_the_interpolated_table() {
        for alpha in [0.13, 0.4, 1.0] {
            let row = AlbedoRow::of(Microfacets { alpha });
            let n = 20_000;
            let sum: f64 = (0..n)
                .map(|i| {
                    let cosine = (f64::from(i) + 0.5) / f64::from(n);
                    let albedo = row.at(cosine as f32);
                    2.0 * cosine * f64::from(albedo.base + albedo.edge) / f64::from(n)
                })
                .sum();
            let mean = f64::from(row.mean().base + row.mean().edge);
            assert!((sum - mean).abs() < 2e-6, "{alpha}: {sum} {mean}");
        }
    }
}
