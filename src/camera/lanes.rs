//! Rays through a lens side by side: aimed, traced, and brought into the scene.

use glam::{DMat3, DQuat, DVec2, DVec3};

use crate::film::FilmFormat;
use crate::lens::{Aims, Bundle, FilmPlace, LANES, Lens};
use crate::math::lanes::{Lane, Lanewise, fused, widely};
use crate::sampling::Samples;
use crate::scene::wide::bits;
use crate::scene::{BUNDLE, RayLanes, Sides};

use super::{LensCamera, METERS_FROM_MM, equation_1, kept};

/// Film points in millimeters from the film's middle, and lens points in the unit square. It is
/// filled again and again.
#[derive(Default)]
pub(super) struct Sheaf {
    pub film: [Lane; 2],
    pub pupil: [Lane; 2],
    pub count: usize,
}

impl Sheaf {
    /// Takes the samples of some numbers, at most [`LANES`]. What is left over is the first again.
    pub fn take(&mut self, format: FilmFormat, samples: &Samples, numbers: &[usize]) {
        let at = |lane: usize| numbers.get(lane).copied().unwrap_or(numbers[0]);
        self.fill(format, samples, numbers.len(), |lane, all| {
            *lane = std::array::from_fn(|i| all[at(i)]);
        });
    }

    /// Takes the samples from a number on.
    pub fn take_from(&mut self, format: FilmFormat, samples: &Samples, first: usize) {
        let count = (samples.len() - first).min(LANES);
        self.fill(format, samples, count, |lane, all| {
            lane[count..].fill(all[first]);
            lane[..count].copy_from_slice(&all[first..first + count]);
        });
    }

    fn fill(
        &mut self,
        format: FilmFormat,
        samples: &Samples,
        count: usize,
        copy: impl Fn(&mut Lane, &[f64]),
    ) {
        for d in 0..2 {
            copy(&mut self.film[d], &samples.film[d]);
            copy(&mut self.pupil[d], &samples.pupil[d]);
        }
        let [x, y] = &mut self.film;
        x.iter_mut().for_each(|x| *x = (0.5 - *x) * format.width);
        y.iter_mut().for_each(|y| *y = (*y - 0.5) * format.height);
        self.count = count;
    }
}

/// What lanes bring: the rays that leave the lens, and what each counts for. It is filled again
/// and again.
#[derive(Clone, Debug, Default)]
pub(super) struct Outside {
    pub rays: RayLanes,
    pub weight: Lane,
}

impl Outside {
    /// The origin and the direction of one lane.
    #[inline(always)]
    pub fn ray(&self, lane: usize) -> ([f32; 3], [f32; 3]) {
        let of = |v: &Sides| [v[0][lane], v[1][lane], v[2][lane]];
        (of(&self.rays.origin), of(&self.rays.direction))
    }
}

impl LensCamera {
    /// Traces the rays from film points to what is aimed at.
    pub(super) fn trace(
        &self,
        lens: &Lens,
        sheaf: &Sheaf,
        aims: &Aims,
        bundle: &mut Bundle,
        out: &mut Outside,
    ) {
        widely(Aimed {
            place: &self.place,
            rear_z: self.rear_z,
            unit: 1.0 / self.axial_irradiance,
            sheaf,
            aims,
            bundle: &mut *bundle,
            weight: &mut out.weight,
        });
        for (lane, area) in aims.area.iter().enumerate() {
            if lane >= sheaf.count || !(*area > 0.0) {
                bundle.clear(lane);
            }
        }
        if lens.reflects() {
            for lane in bits(bundle.through()) {
                out.weight[lane] *= kept(lens, &bundle.ray(lane));
            }
        }
        lens.trace_bundle_from_film(bundle);
        widely(Leaving {
            turn: self.world_from_lens,
            eye: self.eye,
            bundle,
            out: &mut out.rays,
        });
        out.rays.mask = bundle.through();
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
    out: &'a mut RayLanes,
}

impl Lanewise for Leaving<'_> {
    type Output = ();

    #[inline(always)]
    fn run<const FUSED: bool>(self) {
        const { assert!(LANES == BUNDLE) }
        let turn = DMat3::from_quat(self.turn);
        let scaled = turn * METERS_FROM_MM;
        let (b, out) = (self.bundle, self.out);
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
    }
}
