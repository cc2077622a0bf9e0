//! Traces rays that are rows of arrays: coordinates of a ray next to each other.
//!
//! Rows become lanes, and lanes rows, with vectors too. One number after another, that takes two
//! thirds of the time of a lens of six spheres.

use std::ops::Range;

use ivcam_base::math::lanes::{LANES, SimdKernel, Width, fused};

use crate::lens::lanes::bundle::{Bundle, EMPTY, MISSED};
use crate::lens::lens::Lens;
use crate::lens::trace::ray::{LensRay, Toward, unit};

/// Rays in lens space, in millimeters. One row of either kind goes with all rows of the other.
#[derive(Clone, Copy, Debug)]
pub struct RayRows<'a> {
    /// Points of the rays.
    pub origins: &'a [[f64; 3]],
    /// Directions of any length.
    pub directions: &'a [[f64; 3]],
}

/// Receives rays as they leave a lens. All rows have the same number.
#[derive(Debug)]
pub struct TracedRows<'a> {
    /// Points of the rays in millimeters; NaN for a lost ray.
    pub origins: &'a mut [[f64; 3]],
    /// Directions of unit length; NaN for a lost ray.
    pub directions: &'a mut [[f64; 3]],
    /// 0 for a ray that passed, 1 for one that missed a surface, 2 for one that an aperture
    /// blocked, and 3 for one that was totally reflected.
    pub codes: &'a mut [u8],
    /// The surface where a ray was lost, counted from 0 at the front; −1 for a ray that passed.
    pub surfaces: &'a mut [i32],
}

impl TracedRows<'_> {
    /// The number of rays; none if the arrays differ in length.
    pub fn count(&self) -> Option<usize> {
        let count = self.codes.len();
        let others = [
            self.origins.len(),
            self.directions.len(),
            self.surfaces.len(),
        ];
        others.iter().all(|other| *other == count).then_some(count)
    }

    /// Divides the rows in two, before row `row`.
    ///
    /// # Panics
    /// Panics if there are fewer rows.
    pub fn split_at(self, row: usize) -> (Self, Self) {
        let (origins, more_origins) = self.origins.split_at_mut(row);
        let (directions, more_directions) = self.directions.split_at_mut(row);
        let (codes, more_codes) = self.codes.split_at_mut(row);
        let (surfaces, more_surfaces) = self.surfaces.split_at_mut(row);
        let first = Self {
            origins,
            directions,
            codes,
            surfaces,
        };
        let rest = Self {
            origins: more_origins,
            directions: more_directions,
            codes: more_codes,
            surfaces: more_surfaces,
        };
        (first, rest)
    }

    /// The rows from `start` on, one for each lane; none if there are fewer.
    fn block(&mut self, start: usize) -> Option<RowBlock<'_>> {
        Some(RowBlock {
            origins: self.origins[start..].first_chunk_mut()?,
            directions: self.directions[start..].first_chunk_mut()?,
            codes: self.codes[start..].first_chunk_mut()?,
            surfaces: self.surfaces[start..].first_chunk_mut()?,
        })
    }

    /// Fills the rows from `start` on, which are fewer than the lanes.
    fn fill_rest(&mut self, start: usize, store: impl FnOnce(RowBlock<'_>)) {
        let rest = self.codes.len() - start;
        let (mut origins, mut directions) = ([[0.0; 3]; LANES], [[0.0; 3]; LANES]);
        let (mut codes, mut surfaces) = ([0; LANES], [0; LANES]);
        store(RowBlock {
            origins: &mut origins,
            directions: &mut directions,
            codes: &mut codes,
            surfaces: &mut surfaces,
        });
        self.origins[start..].copy_from_slice(&origins[..rest]);
        self.directions[start..].copy_from_slice(&directions[..rest]);
        self.codes[start..].copy_from_slice(&codes[..rest]);
        self.surfaces[start..].copy_from_slice(&surfaces[..rest]);
    }
}

impl<'a> RayRows<'a> {
    /// Returns whether the rows are those of `count` rays.
    pub fn are_of(&self, count: usize) -> bool {
        let rows = [self.origins.len(), self.directions.len()];
        rows.iter().all(|rows| *rows == count || *rows == 1)
    }

    /// Returns some of the rays.
    ///
    /// # Panics
    /// Panics if there are fewer rows.
    pub fn part(self, rows: Range<usize>) -> Self {
        let part = |all: &'a [[f64; 3]]| match all {
            [_] => all,
            _ => &all[rows.clone()],
        };
        Self {
            origins: part(self.origins),
            directions: part(self.directions),
        }
    }
}

impl Lens {
    /// Traces rays with the results of [`Lens::trace_all`], to the bit, but draws on no account.
    /// With `plane`, a z in millimeters, the points of rays that pass are where they cross that
    /// plane.
    ///
    /// # Panics
    /// Panics if the numbers of rows differ.
    pub fn trace_rows(
        &self,
        rays: RayRows<'_>,
        toward: Toward,
        plane: Option<f64>,
        traced: &mut TracedRows<'_>,
    ) {
        let count = traced.count().filter(|count| rays.are_of(*count));
        let Some(count) = count else {
            panic!("the rows of rays differ in number");
        };
        let entered = match toward {
            Toward::Film => 0,
            Toward::Scene => self.prescription().surfaces.len().saturating_sub(1),
        };
        let missed = ((entered << 2) as u64 | MISSED) as f64;
        let (mut bundle, width) = (Bundle::default(), Width::detect());
        let (mut origins, mut directions) = ([[0.0; 3]; LANES], [[0.0; 3]; LANES]);
        for start in (0..count).step_by(LANES) {
            width.run(RowLoad {
                origins: block(rays.origins, start, &mut origins),
                directions: block(rays.directions, start, &mut directions),
                bundle: &mut bundle,
            });
            self.trace_bundle(&mut bundle, toward, width);
            let mut store = |to: RowBlock<'_>| {
                width.run(RowStore {
                    bundle: &mut bundle,
                    plane,
                    missed,
                    to,
                });
            };
            match traced.block(start) {
                Some(to) => store(to),
                None => traced.fill_rest(start, store),
            }
        }
    }
}

/// Rows of [`TracedRows`], one for each lane.
struct RowBlock<'a> {
    origins: &'a mut [[f64; 3]; LANES],
    directions: &'a mut [[f64; 3]; LANES],
    codes: &'a mut [u8; LANES],
    surfaces: &'a mut [i32; LANES],
}

/// Returns the rows from `start` on, one for each lane. One row fills all lanes, and lanes beyond
/// the last row have NaN. Where rows have to be copied, they are in `copy`.
fn block<'r>(
    rows: &'r [[f64; 3]],
    start: usize,
    copy: &'r mut [[f64; 3]; LANES],
) -> &'r [[f64; 3]; LANES] {
    if let [row] = rows {
        copy.fill(*row);
        return copy;
    }
    let rest = &rows[start..];
    if let Some(whole) = rest.first_chunk() {
        return whole;
    }
    copy[..rest.len()].copy_from_slice(rest);
    copy[rest.len()..].fill([f64::NAN; 3]);
    copy
}

/// The kernel that turns rows into a bundle.
struct RowLoad<'a> {
    origins: &'a [[f64; 3]; LANES],
    directions: &'a [[f64; 3]; LANES],
    bundle: &'a mut Bundle,
}

impl SimdKernel for RowLoad<'_> {
    type Output = ();

    #[inline(always)]
    fn run<const FUSED: bool>(self) {
        let b = self.bundle;
        b.start();
        for (i, row) in self.origins.iter().enumerate() {
            [b.x[i], b.y[i], b.z[i]] = *row;
        }
        for (i, row) in self.directions.iter().enumerate() {
            [b.dx[i], b.dy[i], b.dz[i]] = *row;
        }
        // Bits, unlike numbers, may be combined in any order, so that the loop takes vectors.
        let (mut others, mut unusual) = (0, 0);
        for i in 0..LANES {
            let square = b.dx[i] * b.dx[i] + b.dy[i] * b.dy[i] + b.dz[i] * b.dz[i];
            let is_unit = (square - 1.0).abs() <= 8.0 * f64::EPSILON;
            // Not 0 if a coordinate is not finite.
            let size = b.x[i] * 0.0 + b.y[i] * 0.0 + b.z[i] * 0.0;
            let is_usual = (square > 1e-199) & (square < 1e199) & (size == 0.0);
            others |= u64::from(!is_unit);
            unusual |= u64::from(!is_usual);
        }
        if unusual != 0 {
            each_to_unit(b);
        } else if others != 0 {
            to_unit(b);
        }
    }
}

/// Makes directions unit vectors as [`unit`] does, if none is so short or so long that its square
/// leaves the range of numbers.
#[inline(always)]
fn to_unit(b: &mut Bundle) {
    for i in 0..LANES {
        let square = b.dx[i] * b.dx[i] + b.dy[i] * b.dy[i] + b.dz[i] * b.dz[i];
        let is_unit = (square - 1.0).abs() <= 8.0 * f64::EPSILON;
        let length = if is_unit { 1.0 } else { square.sqrt() };
        b.dx[i] /= length;
        b.dy[i] /= length;
        b.dz[i] /= length;
    }
}

/// Makes directions unit vectors, one after another. A ray without a direction, or with a
/// coordinate that is not finite, leaves its lane empty.
fn each_to_unit(b: &mut Bundle) {
    for lane in 0..LANES {
        let ray = b.ray(lane);
        match unit(ray.direction).filter(|_| ray.origin.is_finite()) {
            Some(direction) => b.put(lane, &LensRay { direction, ..ray }),
            None => b.clear(lane),
        }
    }
}

/// The kernel that turns a bundle, behind the lens, into rows.
struct RowStore<'a> {
    bundle: &'a mut Bundle,
    /// The z of the plane on which the points of the rays are, if any.
    plane: Option<f64>,
    /// The code of [`Bundle::lost`] for an empty lane: the ray misses the first surface.
    missed: f64,
    to: RowBlock<'a>,
}

impl SimdKernel for RowStore<'_> {
    type Output = ();

    #[inline(always)]
    fn run<const FUSED: bool>(self) {
        let (b, to) = (self.bundle, self.to);
        if let Some(plane) = self.plane {
            for i in 0..LANES {
                let step = (plane - b.z[i]) / b.dz[i];
                b.x[i] = fused::<FUSED>(step, b.dx[i], b.x[i]);
                b.y[i] = fused::<FUSED>(step, b.dy[i], b.y[i]);
                b.z[i] = plane;
            }
        }
        for i in 0..LANES {
            let of_passed = |number: f64| if b.lost[i] == 0.0 { number } else { f64::NAN };
            to.origins[i] = [b.x[i], b.y[i], b.z[i]].map(of_passed);
            to.directions[i] = [b.dx[i], b.dy[i], b.dz[i]].map(of_passed);
        }
        for i in 0..LANES {
            let lost = if b.lost[i] == EMPTY {
                self.missed
            } else {
                b.lost[i]
            };
            let code = (lost + TO_BITS).to_bits() as i32;
            to.codes[i] = (code & 3) as u8;
            to.surfaces[i] = (code >> 2) - i32::from(code == 0);
        }
    }
}

/// Adding this number puts a small integer into the lowest bits, for all lanes at once. The
/// compiler makes casts one by one.
const TO_BITS: f64 = 6_755_399_441_055_744.0;

#[cfg(test)]
mod tests {
    use glam::DVec3;

    use super::*;
    use crate::lens::trace::ray::{Loss, LossKind};

    /// Rays of any direction and length near a lens, some of them invalid.
    fn rays(lens: &Lens, count: usize) -> Vec<LensRay> {
        let pupil = lens.first_order().entrance_pupil.unwrap();
        let place = |k: usize| 1.6 * pupil.semi_diameter * (k as f64 / 10.0 - 1.0);
        let ray = |k: usize| {
            let direction = match k % 50 {
                20 => DVec3::ZERO,
                21 => DVec3::new(0.0, f64::NAN, 1.0),
                22 => DVec3::new(0.0, 1e-200, 1e-199),
                23 => DVec3::new(0.0, -1e180, 1e181),
                _ => DVec3::new(0.02, 0.1, 1.5 + k as f64),
            };
            // Whole bundles of usual rays too.
            let direction = if (k / 64).is_multiple_of(2) {
                DVec3::new(0.0, 0.6, 0.8)
            } else {
                direction
            };
            let y = if k % 50 == 30 {
                f64::INFINITY
            } else {
                place(k / 21 % 21)
            };
            LensRay::new(
                DVec3::new(place(k % 21), y, pupil.z) - 20.0 * direction.normalize_or_zero(),
                direction,
            )
        };
        (0..count).map(ray).collect()
    }

    /// What `trace_rows` makes of rays: a row of six numbers with the code and the surface.
    fn traced(
        lens: &Lens,
        rays: &RayRows<'_>,
        toward: Toward,
        plane: Option<f64>,
    ) -> Vec<([f64; 6], u8, i32)> {
        let count = rays.origins.len().max(rays.directions.len());
        let (mut origins, mut directions) = (vec![[0.0; 3]; count], vec![[0.0; 3]; count]);
        let (mut codes, mut surfaces) = (vec![9; count], vec![9; count]);
        let mut rows = TracedRows {
            origins: &mut origins,
            directions: &mut directions,
            codes: &mut codes,
            surfaces: &mut surfaces,
        };
        lens.trace_rows(*rays, toward, plane, &mut rows);
        let row = |i: usize| {
            let ([x, y, z], [dx, dy, dz]) = (origins[i], directions[i]);
            ([x, y, z, dx, dy, dz], codes[i], surfaces[i])
        };
        (0..count).map(row).collect()
    }

    fn expected(ray: &std::result::Result<LensRay, Loss>) -> ([f64; 6], u8, i32) {
        match ray {
            Ok(ray) => {
                let ([x, y, z], [dx, dy, dz]) = (ray.origin.to_array(), ray.direction.to_array());
                ([x, y, z, dx, dy, dz], 0, -1)
            }
            Err(loss) => {
                let code = match loss.kind {
                    LossKind::Missed => 1,
                    LossKind::Blocked => 2,
                    LossKind::TotalReflection => 3,
                };
                ([f64::NAN; 6], code, loss.surface as i32)
            }
        }
    }

    fn bits(row: &([f64; 6], u8, i32)) -> ([u64; 6], u8, i32) {
        (row.0.map(f64::to_bits), row.1, row.2)
    }

    #[test]
    fn rows_have_the_bits_of_single_bundles() {
        for name in ["double-gauss", "canon-14", "phone", "anamorphic"] {
            let lens = Lens::named(name).unwrap();
            for count in [0, 1, 31, 32, 33, 441] {
                let rays = rays(&lens, count);
                let origins: Vec<[f64; 3]> = rays.iter().map(|r| r.origin.to_array()).collect();
                let directions: Vec<[f64; 3]> =
                    rays.iter().map(|r| r.direction.to_array()).collect();
                let rows = RayRows {
                    origins: &origins,
                    directions: &directions,
                };
                for toward in [Toward::Film, Toward::Scene] {
                    let found = traced(&lens, &rows, toward, None);
                    let known: Vec<_> =
                        lens.trace_all(&rays, toward).iter().map(expected).collect();
                    let passed = found.iter().filter(|row| row.1 == 0).count();
                    assert!(
                        count < 441 || toward == Toward::Scene || passed > 20,
                        "{name} {passed}"
                    );
                    assert!(
                        found.iter().map(bits).eq(known.iter().map(bits)),
                        "{name} {count}"
                    );
                }
            }
        }
    }

    #[test]
    fn one_row_goes_with_all_others_and_points_are_on_the_plane() {
        let lens = Lens::named("double-gauss").unwrap();
        let pupil = lens.first_order().entrance_pupil.unwrap();
        let height = |k: usize| pupil.semi_diameter * (k as f64 / 20.0 - 1.1);
        let origins: Vec<[f64; 3]> = (0..45).map(|k| [0.1, height(k), pupil.z - 50.0]).collect();
        let (one, many) = ([[0.0, 0.0, 5.0]], vec![[0.0, 0.0, 5.0]; 45]);
        let [one, many] = [&one[..], &many[..]].map(|directions| RayRows {
            origins: &origins,
            directions,
        });
        let at = traced(&lens, &one, Toward::Film, Some(70.0));
        let with_all = traced(&lens, &many, Toward::Film, Some(70.0));
        assert!(at.iter().map(bits).eq(with_all.iter().map(bits)));
        let mut passed = 0;
        for (found, behind) in at.iter().zip(traced(&lens, &one, Toward::Film, None)) {
            assert_eq!(found.1, behind.1);
            let [x, y, z, dx, dy, dz] = behind.0;
            let ray = LensRay::new(DVec3::new(x, y, z), DVec3::new(dx, dy, dz));
            if found.1 == 0 {
                passed += 1;
                let off = ray.at_z(70.0) - DVec3::from_slice(&found.0[..3]);
                assert!(off.length() < 1e-13, "{off}");
                assert_eq!(found.0[2], 70.0);
            }
        }
        assert!(passed > 10 && passed < 45, "{passed}");
    }
}
