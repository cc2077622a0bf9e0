//! Traces rays through a lens, one in each lane: aims them, traces them, and transforms them to the
//! scene.

use glam::{DMat3, DQuat, DVec2, DVec3};
use ivcam_base::math::lanes::{LANES, Lane, SimdKernel, dispatch, fused};
use ivcam_optics::lens::{Aims, Bundle, FilmPlace, Lens, Transmittances};

use super::aim::equation_1;
use super::film_samples::FilmSamples;
use super::lens_camera::LensCamera;
use super::rays::{ExitRays, METERS_FROM_MM};
use super::tint::Tinted;
use crate::bvh::RayPacket;

impl LensCamera {
    /// The transmittances of rays through a lens, to be measured by [`Self::trace`]; none if the
    /// lens does not reflect.
    pub(super) fn transmittances(&self, lens: &Lens) -> Option<Transmittances> {
        lens.reflects().then(|| match &self.tint {
            Some(tint) => tint.transmittances(),
            None => Transmittances::at(lens.wavelength()),
        })
    }

    /// Traces the rays from film points to their aims, and on through a lens into the scene. Their
    /// light decreases by the transmittances, if there are any.
    pub(super) fn trace(
        &self,
        lens: &Lens,
        samples: &FilmSamples,
        aims: &Aims,
        bundle: &mut Bundle,
        transmittances: Option<&mut Transmittances>,
        out: &mut ExitRays,
    ) {
        dispatch(Aimed {
            place: &self.place,
            rear_z: self.rear_z,
            unit: 1.0 / self.axial_irradiance,
            samples,
            aims,
            bundle: &mut *bundle,
            weight: &mut out.weights,
        });
        for (lane, area) in aims.area.iter().enumerate() {
            if lane >= samples.count || !(*area > 0.0) {
                bundle.clear(lane);
            }
        }
        match transmittances {
            None => lens.trace_bundle_from_film(bundle),
            Some(transmittances) => {
                lens.trace_bundle_transmitted(bundle, transmittances);
                self.dim(transmittances, out);
            }
        }
        dispatch(Leaving {
            turn: self.world_from_lens,
            eye: self.eye,
            bundle,
            out: &mut out.rays,
        });
        out.rays.mask = bundle.through();
    }

    /// Multiplies the light of rays by their transmittances.
    fn dim(&self, transmittances: &Transmittances, out: &mut ExitRays) {
        if let Some(tint) = &self.tint {
            let out = out.tint.get_or_insert_default();
            return dispatch(Tinted {
                tint,
                transmittances,
                out,
            });
        }
        let shares = transmittances.shares(0);
        for (weight, share) in out.weights.iter_mut().zip(shares) {
            *weight *= share;
        }
    }
}

/// The kernel that fills a bundle with the rays from film points to aims, weighted by equation 1.
struct Aimed<'a> {
    place: &'a FilmPlace,
    rear_z: f64,
    /// The reciprocal of the irradiance of exposure 1.
    unit: f64,
    samples: &'a FilmSamples,
    aims: &'a Aims,
    bundle: &'a mut Bundle,
    weight: &'a mut Lane,
}

impl SimdKernel for Aimed<'_> {
    type Output = ();

    #[inline(always)]
    fn run<const FUSED: bool>(self) {
        let bundle = self.bundle;
        for i in 0..LANES {
            let film = DVec2::new(self.samples.film[0][i], self.samples.film[1][i]);
            let aim = DVec3::new(self.aims.x[i], self.aims.y[i], self.rear_z);
            let origin = self.place.point(film);
            let across = aim - origin;
            let direction = across * (1.0 / across.length_squared().sqrt());
            let factor = equation_1(across, self.place.normal(film));
            self.weight[i] = factor * self.aims.area[i] * self.unit;
            [bundle.x[i], bundle.y[i], bundle.z[i]] = [origin.x, origin.y, origin.z];
            [bundle.dx[i], bundle.dy[i], bundle.dz[i]] = [direction.x, direction.y, direction.z];
        }
        bundle.start();
    }
}

/// The kernel that transforms the rays of a bundle from lens space to the scene.
struct Leaving<'a> {
    turn: DQuat,
    eye: DVec3,
    bundle: &'a Bundle,
    out: &'a mut RayPacket,
}

impl SimdKernel for Leaving<'_> {
    type Output = ();

    #[inline(always)]
    fn run<const FUSED: bool>(self) {
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
