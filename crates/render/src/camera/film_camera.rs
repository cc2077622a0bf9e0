//! A film behind a lens that is part of the scene's geometry.

use glam::{DQuat, DVec2, DVec3};
use ivcam_inventor::pose::{CameraPose, FilmPlane};
use ivcam_optics::film::FilmFormat;
use ivcam_optics::lens::{FilmPlace, Lens, PupilWindow, RearElement};
use ivcam_optics::sampling::{CameraSamples, DiscMap};

use super::aim::{Aim, aimed, film_point};
use super::lens_camera::white_irradiance;
use super::rays::{CameraRay, CameraRays, METERS_FROM_MM};

/// A film without a lens model. The lens is part of the scene's geometry, which refracts or blocks
/// the rays from the film to the rear element.
#[derive(Clone, Copy, Debug)]
pub struct FilmCamera {
    /// The size of the film.
    pub format: FilmFormat,
    plane: FilmPlane,
    map: DiscMap,
    pub(super) world_from_camera: DQuat,
    /// The position of the front vertex, from the scene's origin, in meters.
    pub(super) eye: DVec3,
}

impl FilmCamera {
    /// A camera at the scene's origin, with the orientation of a pose.
    pub fn new(plane: FilmPlane, format: FilmFormat, aim: Aim, pose: &CameraPose) -> Self {
        Self {
            format,
            plane,
            map: match aim {
                Aim::RearElement(map) => map,
                Aim::ExitPupil => DiscMap::Concentric,
            },
            world_from_camera: pose.orientation,
            eye: DVec3::ZERO,
        }
    }

    /// Returns the map from samples to the rear element, the only disc that rays are aimed at.
    pub fn disc_map(&self) -> DiscMap {
        self.map
    }

    /// Makes the rays of samples.
    pub(super) fn shoot(&self, samples: &CameraSamples, rays: &mut CameraRays) {
        for i in 0..samples.len() {
            let [x, y] = samples.film.each_ref().map(|at| at[i]);
            let pupil = samples.pupil.each_ref().map(|at| at[i]);
            if let Some(ray) = self.ray(film_point(self.format, x, y), pupil) {
                rays.push(i, &ray);
            }
        }
    }

    /// The ray from a film point, in millimeters from the film's middle, to a point of the rear
    /// element.
    pub(super) fn ray(&self, film: DVec2, pupil: [f64; 2]) -> Option<CameraRay> {
        let [film_z, rear_z, radius] =
            [self.plane.film_z, self.plane.rear_z, self.plane.rear_radius]
                .map(|meters| meters / METERS_FROM_MM);
        let window = PupilWindow::Disc {
            radius,
            map: self.map,
        };
        let place = FilmPlace::flat(film_z);
        let (ray, weight) = aimed(&place, film, rear_z, &window, pupil)?;
        Some(CameraRay {
            origin: self.eye + self.world_from_camera * (ray.origin * METERS_FROM_MM),
            direction: self.world_from_camera * ray.direction,
            weight: weight / self.plane.irradiance,
        })
    }
}

/// Half the height of 35 mm film, in millimeters.
const FILM_HALF_HEIGHT: f64 = 12.0;

/// The film behind a lens, to be written into a scene that contains the lens as solids. `film_z` is
/// in millimeters.
pub fn film_plane(lens: &Lens, film_z: f64) -> FilmPlane {
    let focal = lens.first_order().focal;
    let image_distance = film_z - focal.map_or(0.0, |f| f.rear_principal_plane);
    FilmPlane {
        film_z: film_z * METERS_FROM_MM,
        height_angle: 2.0 * libm::atan(FILM_HALF_HEIGHT / image_distance.abs()),
        rear_z: lens.length() * METERS_FROM_MM,
        rear_radius: RearElement::new(lens, DiscMap::Concentric).radius * METERS_FROM_MM,
        irradiance: white_irradiance(lens, film_z),
    }
}
