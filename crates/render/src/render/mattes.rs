//! Which objects and materials each pixel shows, and how much of its light each may give.
//!
//! The share of an object is the part of the pixel's light that it would give if everything had the
//! same radiance: the sum of the weights of the picture's own samples that meet it, over that of
//! all which pass through the lens. The weights contain the pixel filter. What is transparent gets
//! the opaque part of a sample, and what is behind it the rest; a surface that bends light gets
//! all, since what is behind it is not where a straight ray goes.

use ivcam_optics::film::Region;

use super::batch::Batch;
use super::passes::Render;
use crate::bvh::{Hit, Ray};
use crate::scene::{MatteKind, RenderScene, SurfaceNames};

/// The largest number of names in a pixel: eight layers of two, the most that readers expect.
const MOST_RANKS: usize = 16;
/// The largest number of transparent surfaces along a ray. The rest is given to the last.
const MOST_SURFACES: usize = 32;
/// A ray ends where less than this part of it goes on.
const LEAST_REST: f32 = 1.0 / 4096.0;

/// The names of one kind that a pixel shows, by their numbers, with the share of each. The largest
/// share is first, and of equal shares the lower number.
pub type MatteRanks = Vec<(u32, f32)>;

/// The objects and materials that the pixels of a region show.
#[derive(Clone, Debug, Default)]
pub struct Mattes {
    /// The ranks of each pixel, row by row, for each kind in the order of [`MatteKind::ALL`].
    pub ranks: [Vec<MatteRanks>; 2],
    /// The number of pixels that show more names of a kind than are kept.
    pub cut: usize,
}

/// The weights of the names that one pixel shows.
#[derive(Default)]
struct NameWeights {
    kinds: [Vec<(u32, f64)>; 2],
    /// The weight of all samples that pass through the lens.
    all: f64,
}

impl NameWeights {
    /// Adds a sample.
    fn add(
        &mut self,
        (scene, names): (&RenderScene, &SurfaceNames),
        ray: &Ray,
        mut hit: Option<Hit>,
        weight: f64,
    ) {
        self.all += weight;
        let (mut ray, mut rest) = (*ray, 1.0_f32);
        for step in 1..=MOST_SURFACES {
            let Some(met) = hit else { return };
            let point = scene.point(&ray, &met);
            let bends = point.surface.refraction != 1.0;
            let through = if bends {
                0.0
            } else {
                rest * point.transparency.clamp(0.0, 1.0)
            };
            let is_last = through < LEAST_REST || step == MOST_SURFACES;
            let own = if is_last { rest } else { rest - through };
            self.give(names, scene.owner(met.primitive), weight * f64::from(own));
            if is_last {
                return;
            }
            rest = through;
            ray = scene.continue_behind(&ray, &met);
            hit = scene.hit(&ray);
        }
    }

    /// Adds a weight to the names of a surface.
    fn give(&mut self, names: &SurfaceNames, surface: u32, weight: f64) {
        for (kind, weights) in MatteKind::ALL.into_iter().zip(&mut self.kinds) {
            let name = names.number(kind, surface);
            match weights.iter_mut().find(|(known, _)| *known == name) {
                Some((_, sum)) => *sum += weight,
                None => weights.push((name, weight)),
            }
        }
    }

    /// Returns the ranks of both kinds, and whether names were left out.
    fn ranks(self) -> ([MatteRanks; 2], bool) {
        let mut is_cut = false;
        let ranks = self.kinds.map(|weights| {
            let share = |(name, weight): (u32, f64)| (name, (weight / self.all) as f32);
            let mut ranks: MatteRanks = weights.into_iter().map(share).collect();
            // The negative lobes of a filter may leave a name less than nothing.
            ranks.retain(|(_, share)| *share > 0.0);
            ranks.sort_by(|a, b| b.1.total_cmp(&a.1).then(a.0.cmp(&b.0)));
            is_cut |= ranks.len() > MOST_RANKS;
            ranks.truncate(MOST_RANKS);
            ranks.shrink_to_fit();
            ranks
        });
        (ranks, is_cut)
    }
}

impl Render<'_> {
    /// Finds the objects and the materials that the samples of each pixel of a region meet, at the
    /// lens's own wavelength. `samples` is the number of samples of each pixel of the region, row
    /// by row. Returns `None` if the scene was compiled without names. Uses rayon's current pool.
    pub fn mattes(&self, region: Region, samples: &[u32]) -> Option<Mattes> {
        let scene = self.shader.scene();
        let known = (scene, scene.names()?);
        let all = self.survey(region, |batch: &mut Batch<'_>, at, sampler, number| {
            let mut weights = NameWeights::default();
            batch.survey(at, sampler, 0..samples[number], &mut |ray, hit, weight| {
                weights.add(known, ray, hit, weight);
            });
            weights.ranks()
        });
        let mut mattes = Mattes::default();
        for ([objects, materials], is_cut) in all {
            mattes.ranks[0].push(objects);
            mattes.ranks[1].push(materials);
            mattes.cut += usize::from(is_cut);
        }
        Some(mattes)
    }
}
