//! The kinds of cameras, and the rays that they make from samples.

use std::borrow::Cow;

use glam::{DMat3, DVec2, DVec3};
use ivcam_base::math::lanes::{LANES, Vec3Lanes, bits, of_lane};
use ivcam_inventor::pose::{CameraPose, Projection};
use ivcam_optics::lens::{Bundle, PupilWindow};
use ivcam_optics::sampling::CameraSamples;
use ivcam_optics::spectrum::SETS;

use super::aim::film_point;
use super::film_camera::FilmCamera;
use super::ideal::IdealLens;
use super::lens_camera::LensCamera;
use super::pinhole::Pinhole;
use super::rays::{CameraRay, CameraRays};
use super::spectral::SpectralCorrections;

/// A camera of any kind.
#[derive(Clone, Debug)]
#[non_exhaustive]
pub enum Camera {
    /// A camera without an aperture.
    Pinhole(Pinhole),
    /// A real lens in front of a film.
    Lens(Box<LensCamera>),
    /// A thin lens without aberrations.
    Ideal(IdealLens),
    /// A film whose lens is part of the scene, which is the paper's first approach.
    Film(FilmCamera),
}

impl Camera {
    /// The film point of a point of the picture, with everything that depends on it alone. `x` and
    /// `y` are from 0 to 1, from the upper left corner.
    pub fn at(&self, x: f64, y: f64) -> FilmPoint<'_> {
        match self {
            Self::Pinhole(pinhole) => FilmPoint::Pinhole(pinhole.ray(x, y)),
            Self::Ideal(lens) => FilmPoint::Ideal {
                lens,
                place: [x, y],
            },
            Self::Film(film) => FilmPoint::Film {
                film,
                point: film_point(film.format, x, y),
            },
            Self::Lens(camera) => {
                let point = camera.film_point(x, y);
                FilmPoint::Lens {
                    camera,
                    point,
                    window: camera.target.window(point),
                }
            }
        }
    }

    /// The ray through the middle of the stop for a point of the picture from 0 to 1, at the lens's
    /// own wavelength; without a stop, that through the middle of the lens.
    pub(super) fn chief_ray(&self, x: f64, y: f64) -> Option<CameraRay> {
        match self {
            Self::Lens(camera) => camera.chief_ray(camera.film_point(x, y)),
            _ => None,
        }
        .or_else(|| self.at(x, y).ray([0.5; 2]))
    }

    /// Makes the rays of samples, whose film points are points of the picture from 0 to 1. `rays`
    /// receives the rays that get through and continue into the scene, and `corrections` those of
    /// other wavelengths that may correct them.
    pub(crate) fn shoot(
        &self,
        samples: &CameraSamples,
        bundle: &mut Bundle,
        rays: &mut CameraRays,
        corrections: &mut SpectralCorrections,
    ) {
        rays.clear();
        corrections.clear();
        match self {
            Self::Pinhole(pinhole) => pinhole.shoot(samples, rays),
            Self::Ideal(lens) => lens.shoot(samples, rays),
            Self::Film(film) => film.shoot(samples, rays),
            Self::Lens(camera) => match &camera.spectral {
                None => camera.shoot(samples, bundle, rays),
                Some(lenses) => {
                    camera.shoot_by_wavelength(lenses, samples, bundle, rays, corrections);
                }
            },
        }
    }

    /// The camera whose rays all have the lens's own wavelength.
    pub(crate) fn at_one_wavelength(&self) -> Cow<'_, Self> {
        match self {
            Self::Lens(lens) if lens.is_dispersing() => {
                Cow::Owned(Self::Lens(Box::new(lens.at_one_wavelength())))
            }
            _ => Cow::Borrowed(self),
        }
    }

    /// Whether each wavelength has a ray of its own.
    pub fn is_spectral(&self) -> bool {
        matches!(self, Self::Lens(camera) if camera.spectral.is_some())
    }

    /// The number of samples in a batch: enough for resampled rays to fill lanes.
    pub(crate) fn batch(&self) -> usize {
        match self {
            Self::Lens(_) if self.is_spectral() => 8 * SETS * LANES,
            Self::Lens(_) => 32 * LANES,
            _ => 4 * LANES,
        }
    }

    /// Adds the radiances along rays, packet by packet, to the exposures of their samples.
    pub(crate) fn expose(
        &self,
        rays: &CameraRays,
        radiances: &[Vec3Lanes],
        exposures: &mut [DVec3],
    ) {
        for (packet, light) in rays.packets().iter().zip(radiances) {
            let tint = |lane: usize, light: DVec3| match &packet.tint {
                Some(tint) => DMat3::from_cols_array(&tint.each_ref().map(|all| all[lane])) * light,
                None => light,
            };
            for lane in bits(packet.rays.mask) {
                let light = tint(lane, of_lane(light, lane).as_dvec3()) * packet.weights[lane];
                exposures[packet.samples[lane] as usize] += light;
            }
        }
        if let Self::Lens(camera) = self
            && let Some(lenses) = &camera.spectral
        {
            for color in &rays.colors {
                let (packet, lane) = rays.lane(color.number);
                let radiance = of_lane(&radiances[color.number as usize / LANES], lane);
                let light = lenses.color(color.line) * (radiance.as_dvec3() * color.factor);
                exposures[packet.samples[lane] as usize] += light;
            }
        }
    }
}

impl Camera {
    /// The projection of a pinhole in place of the lens, with the film's height angle by the
    /// paper's equation 7. For a camera without a real lens it is the projection of the pose.
    pub fn projection(&self, pose: &CameraPose) -> Projection {
        match self {
            Self::Lens(lens) => Projection::Perspective {
                height_angle: lens.focus.height_angle(0.5 * lens.format.height),
            },
            _ => pose.projection,
        }
    }

    /// The camera with the position and orientation of a pose, for a scene that was compiled around
    /// `origin`, in meters. The scene need not be compiled again.
    pub fn posed(mut self, pose: &CameraPose, origin: DVec3) -> Self {
        let eye = pose.position - origin;
        match &mut self {
            Self::Pinhole(pinhole) => {
                (pinhole.world_from_camera, pinhole.eye) = (pose.orientation, eye)
            }
            Self::Lens(lens) => lens.set_pose(pose.orientation, eye),
            Self::Ideal(lens) => lens.set_pose(pose.orientation, eye),
            Self::Film(film) => (film.world_from_camera, film.eye) = (pose.orientation, eye),
        }
        self
    }
}

/// A point of the film, prepared for rays through any point of the lens. It lives on the stack for
/// one pixel, so its size costs nothing.
#[allow(clippy::large_enum_variant)]
pub enum FilmPoint<'a> {
    /// The only ray of the point, or none outside the view.
    Pinhole(Option<CameraRay>),
    /// A film point behind an ideal lens.
    Ideal {
        /// The camera.
        lens: &'a IdealLens,
        /// The point of the picture, from 0 to 1.
        place: [f64; 2],
    },
    /// A film point behind a lens that is part of the scene.
    Film {
        /// The camera.
        film: &'a FilmCamera,
        /// The point in millimeters from the film's middle.
        point: DVec2,
    },
    /// A film point behind a real lens.
    Lens {
        /// The camera.
        camera: &'a LensCamera,
        /// The point in millimeters from the film's middle.
        point: DVec2,
        /// The part of the rear vertex plane at which rays are aimed.
        window: PupilWindow<'a>,
    },
}

impl FilmPoint<'_> {
    /// The ray at the lens's own wavelength through the point of the lens for a point of the unit
    /// square; none if it is lost.
    pub fn ray(&self, pupil: [f64; 2]) -> Option<CameraRay> {
        match self {
            Self::Pinhole(ray) => *ray,
            Self::Ideal { lens, place } => Some(lens.ray(*place, pupil)),
            Self::Film { film, point } => film.ray(*point, pupil),
            Self::Lens {
                camera,
                point,
                window,
            } => camera.ray(*point, window, pupil),
        }
    }
}
