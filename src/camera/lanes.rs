//! Rays through a lens side by side: aimed, traced, and brought into the scene.

use glam::{DMat3, DQuat, DVec2, DVec3};

use crate::film::FilmFormat;
use crate::lens::{Aims, Bundle, FilmPlace, LANES, Lens};
use crate::math::lanes::{Lane, Lanewise, fused, widely};
use crate::sampling::Samples;
use crate::scene::wide::bits;

use super::{LensCamera, METERS_FROM_MM, equation_1, kept};

/// Film points in millimeters from the film's middle, and lens points in the unit square.
pub(super) struct Sheaf {
    pub film: [Lane; 2],
    pub pupil: [Lane; 2],
    pub count: usize,
}

impl Sheaf {
    /// The samples of some numbers, at most [`LANES`]. What is left over is the first again.
    pub fn of(format: FilmFormat, samples: &Samples, numbers: &[usize]) -> Self {
        let at = |lane: usize| numbers.get(lane).copied().unwrap_or(numbers[0]);
        let of = |all: &[f64]| -> Lane { std::array::from_fn(|lane| all[at(lane)]) };
        Self::placed(
            format,
            [&samples.film[0], &samples.film[1]].map(|all| of(all)),
            [&samples.pupil[0], &samples.pupil[1]].map(|all| of(all)),
            numbers.len(),
        )
    }

    /// The samples from a number on.
    pub fn from(format: FilmFormat, samples: &Samples, first: usize) -> Self {
        let count = (samples.len() - first).min(LANES);
        let of = |all: &[f64]| {
            let mut lane = [all[first]; LANES];
            lane[..count].copy_from_slice(&all[first..first + count]);
            lane
        };
        Self::placed(
            format,
            [&samples.film[0], &samples.film[1]].map(|all| of(all)),
            [&samples.pupil[0], &samples.pupil[1]].map(|all| of(all)),
            count,
        )
    }

    fn placed(format: FilmFormat, place: [Lane; 2], pupil: [Lane; 2], count: usize) -> Self {
        let [mut x, mut y] = place;
        x.iter_mut().for_each(|x| *x = (0.5 - *x) * format.width);
        y.iter_mut().for_each(|y| *y = (*y - 0.5) * format.height);
        Self {
            film: [x, y],
            pupil,
            count,
        }
    }
}

/// What lanes bring: where each ray leaves the lens, which way, and what it counts for.
#[derive(Clone, Debug)]
pub(super) struct Outside {
    pub origin: [[f32; LANES]; 3],
    pub direction: [[f32; LANES]; 3],
    pub weight: Lane,
}

impl Outside {
    /// The origin and the direction of one lane.
    #[inline(always)]
    pub fn ray(&self, lane: usize) -> ([f32; 3], [f32; 3]) {
        let of = |v: &[[f32; LANES]; 3]| [v[0][lane], v[1][lane], v[2][lane]];
        (of(&self.origin), of(&self.direction))
    }
}

impl Default for Outside {
    fn default() -> Self {
        Self {
            origin: [[0.0; LANES]; 3],
            direction: [[0.0; LANES]; 3],
            weight: [0.0; LANES],
        }
    }
}

impl LensCamera {
    /// Traces the rays from film points to what is aimed at. The bundle says which get through.
    pub(super) fn trace(
        &self,
        lens: &Lens,
        sheaf: &Sheaf,
        aims: &Aims,
        bundle: &mut Bundle,
    ) -> Outside {
        let mut weight = [0.0; LANES];
        widely(Aimed {
            place: &self.place,
            rear_z: self.rear_z,
            unit: 1.0 / self.axial_irradiance,
            sheaf,
            aims,
            bundle: &mut *bundle,
            weight: &mut weight,
        });
        for (lane, area) in aims.area.iter().enumerate() {
            if lane >= sheaf.count || !(*area > 0.0) {
                bundle.clear(lane);
            }
        }
        if lens.reflects() {
            for lane in bits(bundle.through()) {
                weight[lane] *= kept(lens, &bundle.ray(lane));
            }
        }
        lens.trace_bundle_from_film(bundle);
        widely(Leaving {
            turn: self.world_from_lens,
            eye: self.eye,
            bundle,
            weight,
        })
    }
}

/// Puts rays from film points to aims into a bundle, and weighs them by equation 1.
struct Aimed<'a> {
    place: &'a FilmPlace,
    rear_z: f64,
    unit: f64,
    sheaf: &'a Sheaf,
    aims: &'a Aims,
    bundle: &'a mut Bundle,
    weight: &'a mut Lane,
}

impl Lanewise for Aimed<'_> {
    type Output = ();

    #[inline(always)]
    fn run<const FUSED: bool>(self) {
        let bundle = self.bundle;
        for i in 0..LANES {
            let film = DVec2::new(self.sheaf.film[0][i], self.sheaf.film[1][i]);
            let aim = DVec3::new(self.aims.x[i], self.aims.y[i], self.rear_z);
            let origin = self.place.point(film);
            let across = aim - origin;
            let direction = across * (1.0 / across.length_squared().sqrt());
            let seen = equation_1(across, self.place.normal(film));
            self.weight[i] = seen * self.aims.area[i] * self.unit;
            [bundle.x[i], bundle.y[i], bundle.z[i]] = [origin.x, origin.y, origin.z];
            [bundle.dx[i], bundle.dy[i], bundle.dz[i]] = [direction.x, direction.y, direction.z];
        }
        bundle.start();
    }
}

/// Brings the rays of a bundle from the lens into the scene.
struct Leaving<'a> {
    turn: DQuat,
    eye: DVec3,
    bundle: &'a Bundle,
    weight: Lane,
}

impl Lanewise for Leaving<'_> {
    type Output = Outside;

    #[inline(always)]
    fn run<const FUSED: bool>(self) -> Outside {
        let turn = DMat3::from_quat(self.turn);
        let scaled = turn * METERS_FROM_MM;
        let mut out = Outside {
            weight: self.weight,
            ..Outside::default()
        };
        let b = self.bundle;
        for axis in 0..3 {
            let [rx, ry, rz] = scaled.row(axis).to_array();
            let [tx, ty, tz] = turn.row(axis).to_array();
            let eye = self.eye[axis];
            for i in 0..LANES {
                let at = fused::<FUSED>(rx, b.x[i], fused::<FUSED>(ry, b.y[i], rz * b.z[i]));
                out.origin[axis][i] = (eye + at) as f32;
                let d = fused::<FUSED>(tx, b.dx[i], fused::<FUSED>(ty, b.dy[i], tz * b.dz[i]));
                out.direction[axis][i] = d as f32;
            }
        }
        out
    }
}
