//! A lens in front of a film.

use std::f64::consts::PI;
use std::sync::OnceLock;

use glam::{DQuat, DVec2, DVec3};
use ivcam_inventor::pose::CameraPose;
use ivcam_optics::film::{FilmFormat, Resolution};
use ivcam_optics::lens::{
    FilmPlace, Focus, Iris, Lens, LensRay, PupilTarget, PupilWindow, RayPath, Toward, Vignetting,
};

use super::aim::{Aim, aimed, film_point};
use super::rays::{CameraRay, METERS_FROM_MM};
use super::spectral_lenses::SpectralLenses;
use super::tint::Tint;

/// A real lens in front of a film.
#[derive(Clone, Debug)]
pub struct LensCamera {
    /// The lens.
    pub lens: Lens,
    /// The focus of the lens.
    pub focus: Focus,
    /// The size of the film.
    pub format: FilmFormat,
    pub(super) place: FilmPlace,
    pub(super) target: PupilTarget,
    /// The unvignetted fraction of the area at which rays are aimed. It is measured for the first
    /// ray.
    pub(super) vignetting: OnceLock<Vignetting>,
    /// The lens at other wavelengths; none if one wavelength is enough.
    pub(super) spectral: Option<Box<SpectralLenses>>,
    /// The color of light behind the coatings, if rays of all wavelengths take the same path and
    /// one wavelength is not enough.
    pub(super) tint: Option<Tint>,
    pub(super) world_from_lens: DQuat,
    /// The origin of lens space, from the scene's origin, in meters.
    pub(super) eye: DVec3,
    /// The z of the rear vertex, in millimeters.
    pub(super) rear_z: f64,
    /// The irradiance on the axis from radiance 1, with the lens focused at infinity, in
    /// steradians. It is exposure 1.
    pub(super) axial_irradiance: f64,
}

impl LensCamera {
    /// A camera with a flat film, at the scene's origin with the orientation of a pose.
    pub fn new(lens: Lens, focus: Focus, format: FilmFormat, aim: Aim, pose: &CameraPose) -> Self {
        let place = FilmPlace::flat(focus.film_z);
        Self::with_film(lens, focus, place, format, aim, pose)
    }

    /// The radius of the circle on the film that the lens lights, in millimeters, if the film's
    /// corners are outside it. None for a film that is moved or bent.
    pub fn lit_radius(&self) -> Option<f64> {
        let (corner, film_z) = (self.format.half_diagonal(), self.focus.film_z);
        if self.place != FilmPlace::flat(film_z) {
            return None;
        }
        let lit = self.lens.lit_height(corner, film_z);
        (lit < corner).then_some(lit)
    }

    /// A camera with a film that may be moved or bent, at the scene's origin with the orientation
    /// of a pose.
    pub fn with_film(
        lens: Lens,
        focus: Focus,
        place: FilmPlace,
        format: FilmFormat,
        aim: Aim,
        pose: &CameraPose,
    ) -> Self {
        let target = match aim {
            Aim::RearElement(map) => PupilTarget::rear_element(&lens, map),
            Aim::ExitPupil => PupilTarget::exit_pupil_of(&lens, &place, format.half_diagonal()),
        };
        let mut this = Self {
            rear_z: lens.length(),
            world_from_lens: DQuat::IDENTITY,
            eye: DVec3::ZERO,
            axial_irradiance: white_irradiance(&lens, focus.film_z),
            lens,
            focus,
            format,
            place,
            target,
            vignetting: OnceLock::new(),
            spectral: None,
            tint: None,
        };
        this.set_pose(pose.orientation, DVec3::ZERO);
        this
    }

    /// The camera with rays of several wavelengths. Without dispersion all wavelengths take the
    /// same path, so that only coatings can tint the light.
    pub fn dispersing(mut self) -> Self {
        if self.lens.prescription().is_dispersive() {
            let lenses = SpectralLenses::of(&self.lens, &self.target, &self.place, self.format);
            self.spectral = Some(Box::new(lenses));
        } else if self.lens.prescription().is_chromatic() {
            self.tint = Some(Tint::default());
        }
        self
    }

    /// Whether the camera regards several wavelengths.
    pub fn is_dispersing(&self) -> bool {
        self.spectral.is_some() || self.tint.is_some()
    }

    /// The camera at the lens's own wavelength.
    pub(super) fn at_one_wavelength(&self) -> Self {
        Self {
            spectral: None,
            tint: None,
            ..self.clone()
        }
    }

    /// Sets the orientation and the position, in meters from the scene's origin.
    pub(super) fn set_pose(&mut self, orientation: DQuat, eye: DVec3) {
        self.world_from_lens = orientation * self.place.camera_from_lens;
        self.eye = eye + orientation * (self.place.offset * METERS_FROM_MM);
    }

    /// The position and the shape of the film.
    pub(crate) fn place(&self) -> &FilmPlace {
        &self.place
    }

    /// The window at which rays from a film point are aimed.
    pub(crate) fn window(&self, film: DVec2) -> PupilWindow<'_> {
        self.target.window(film)
    }

    /// The irradiance on the axis from radiance 1, in steradians: π/(4 N²) for an ideal lens.
    pub fn axial_irradiance(&self) -> f64 {
        self.axial_irradiance
    }

    /// The irradiance by which a film is metered, in steradians: π/(4 N²) with the f-number by real
    /// rays, less what straight blades take from the circle around them and obstructions from its
    /// middle. It differs from
    /// [`Self::axial_irradiance`] as far as the lens violates the sine condition, about 3% in the
    /// phone's lens, so that one stop is twice the exposure in every lens.
    pub fn metered_irradiance(&self) -> f64 {
        let Some(n) = self.lens.real_f_number() else {
            return self.axial_irradiance;
        };
        let blades = match self.lens.iris_edges().is_empty() {
            true => 1.0,
            false => {
                let round = self.lens.with_iris(Iris::Round);
                self.axial_irradiance / white_irradiance(&round, self.focus.film_z)
            }
        };
        let open = self.lens.axial_open_share().unwrap_or(1.0);
        PI / (4.0 * n * n) * blades * open
    }

    /// The film point, in millimeters from the film's middle, of a point of the picture from 0 to
    /// 1.
    pub fn film_point(&self, x: f64, y: f64) -> DVec2 {
        film_point(self.format, x, y)
    }

    /// The pixel that a ray behind the lens hits, and the cosine of the film's slope there: a bent
    /// film has a greater area than its projection. Returns none outside the film.
    pub(crate) fn pixel(&self, out: &LensRay, resolution: Resolution) -> Option<(u32, f64)> {
        let film = self.place.intersect(out)?;
        let x = (0.5 - film.x / self.format.width) * f64::from(resolution.width);
        let y = (film.y / self.format.height + 0.5) * f64::from(resolution.height);
        let inside = (0.0..f64::from(resolution.width)).contains(&x)
            && (0.0..f64::from(resolution.height)).contains(&y);
        let slant = self.place.normal(film).dot(self.place.normal(DVec2::ZERO));
        inside.then(|| (y as u32 * resolution.width + x as u32, slant))
    }

    /// A point of the scene, in meters from its origin, in lens space.
    pub(crate) fn lens_point(&self, world: DVec3) -> DVec3 {
        self.lens_direction(world - self.eye) / METERS_FROM_MM
    }

    /// A direction of the scene in lens space.
    pub(crate) fn lens_direction(&self, world: DVec3) -> DVec3 {
        self.world_from_lens.inverse() * world
    }

    /// A point of lens space in the scene, in meters from its origin.
    pub(crate) fn world_point(&self, lens: DVec3) -> DVec3 {
        self.eye + self.world_from_lens * (lens * METERS_FROM_MM)
    }

    /// The ray from a film point, in millimeters from the film's middle, through the point of its
    /// window for a point of the unit square; none if it is lost.
    pub(crate) fn ray(
        &self,
        film: DVec2,
        window: &PupilWindow<'_>,
        pupil: [f64; 2],
    ) -> Option<CameraRay> {
        self.ray_through(&self.lens, film, window, pupil)
    }

    /// The ray from a film point through the middle of the stop, which apertures do not block.
    pub(super) fn chief_ray(&self, film: DVec2) -> Option<CameraRay> {
        let point = self.place.point(film);
        let out = self.lens.chief_ray(point.truncate(), point.z)?;
        Some(self.exit_ray(&out, 1.0))
    }

    /// The ray of [`Self::ray`] through the lens at another wavelength.
    pub(super) fn ray_through(
        &self,
        lens: &Lens,
        film: DVec2,
        window: &PupilWindow<'_>,
        pupil: [f64; 2],
    ) -> Option<CameraRay> {
        let (inside, weight) = self.aim(film, window, pupil)?;
        let out = lens.trace_from_film(&inside).ok()?;
        let share = match lens.reflects() {
            true => lens.transmittance(&inside, Toward::Scene),
            false => 1.0,
        };
        Some(self.exit_ray(&out, weight * share))
    }

    /// The ray of a sample behind the lens and its path through the lens, in lens space; none if no
    /// light reaches the film point.
    pub fn path(&self, film: DVec2, pupil: [f64; 2]) -> Option<(LensRay, RayPath)> {
        let (inside, _) = self.aim(film, &self.target.window(film), pupil)?;
        let path = self.lens.trace_path(&inside, Toward::Scene, true);
        Some((inside, path))
    }

    /// The ray from a film point to the lens, and its weight.
    fn aim(
        &self,
        film: DVec2,
        window: &PupilWindow<'_>,
        pupil: [f64; 2],
    ) -> Option<(LensRay, f64)> {
        let (inside, weight) = aimed(&self.place, film, self.rear_z, window, pupil)?;
        Some((inside, weight / self.axial_irradiance))
    }

    /// The ray in the scene of a ray in front of the lens.
    fn exit_ray(&self, out: &LensRay, weight: f64) -> CameraRay {
        CameraRay {
            origin: self.world_point(out.origin),
            direction: self.world_from_lens * out.direction,
            weight,
        }
    }
}

/// Half of the field angle on a film's shorter side, in radians, for a lens focused at infinity. It
/// is the angle of the real ray through the middle of the exit pupil, or follows from the focal
/// length if that ray is lost. Returns none for an afocal lens.
pub fn half_field(lens: &Lens, format: FilmFormat) -> Option<f64> {
    let optics = lens.first_order();
    let focal = optics.focal?;
    let height = 0.5 * format.width.min(format.height);
    let origin = DVec3::new(0.0, height, focal.rear_focal_point);
    let real = optics.exit_pupil.and_then(|pupil| {
        let across = DVec3::Z * pupil.z - origin;
        let direction = -across.normalize() * across.z.signum();
        let ray = LensRay { origin, direction };
        let out = lens.trace_from_film(&ray).ok()?.direction;
        Some(libm::atan2(out.y.abs(), -out.z))
    });
    let angle = real.unwrap_or_else(|| libm::atan(height / focal.efl.abs()));
    // A fish-eye may have a half field of 90° or more, for which no view would contain the scene.
    // With 1.2 radians the distance is 1.07 times the scene's radius.
    Some(angle.min(1.2)).filter(|a| *a > 0.0)
}

/// The irradiance of exposure 1, in steradians: that on the axis from radiance 1 with the lens
/// focused at infinity, or on the film at `film_z` if the lens has no focus at infinity.
pub(super) fn white_irradiance(lens: &Lens, film_z: f64) -> f64 {
    let at_infinity = lens
        .first_order()
        .focal
        .map_or(f64::NAN, |f| f.rear_focal_point);
    let usable = |e: &f64| e.is_normal() && *e > 0.0;
    [at_infinity, film_z]
        .map(|z| lens.irradiance(DVec2::ZERO, z))
        .into_iter()
        .find(usable)
        .unwrap_or(1.0)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::camera::aim::equation_1;
    use ivcam_base::math::Meters;
    use ivcam_optics::lens::{Coating, FocusMethod, RearElement};
    use ivcam_optics::sampling::{DiscMap, Sampler, SamplerKind};

    /// One stop is a factor of two in every lens, and the metered irradiance is that of the rays
    /// but for the offence against the sine condition.
    #[test]
    fn two_stops_of_any_shipped_lens_are_four_times_the_light() {
        for name in ivcam_optics::lens::shipped_names() {
            let open = Lens::named(name).unwrap();
            if open.is_obstructed() {
                // It cannot be stopped down by two stops.
                continue;
            }
            let wide = open.real_f_number().unwrap().max(2.8);
            let metered = |n: f64| {
                let camera = camera(open.at_f_number(n).unwrap(), Aim::ExitPupil);
                let (metered, traced) = (camera.metered_irradiance(), camera.axial_irradiance());
                assert!(
                    (metered / traced - 1.0).abs() < 0.05,
                    "{name}: {metered} {traced}"
                );
                metered
            };
            let ratio = metered(wide) / metered(2.0 * wide);
            assert!((ratio - 4.0).abs() < 1e-6, "{name}: {ratio}");
        }
    }

    #[test]
    fn a_ray_hits_the_pixel_whose_own_ray_is_the_reverse() {
        let camera = camera(Lens::named("double-gauss").unwrap(), Aim::ExitPupil);
        let size = Resolution::of(36, 24);
        for (column, row) in [(0, 0), (35, 0), (7, 20), (35, 23)] {
            let place = |cell: u32, of: u32| (f64::from(cell) + 0.5) / f64::from(of);
            let film = camera.film_point(place(column, 36), place(row, 24));
            let origin = DVec3::new(0.0, 0.0, camera.rear_z);
            let direction = film.extend(camera.focus.film_z) - origin;
            let pixel = camera.pixel(&LensRay { origin, direction }, size);
            assert_eq!(pixel, Some((row * 36 + column, 1.0)));
        }
        let aside = LensRay::new(DVec3::ZERO, DVec3::new(1.0, 0.0, 1.0));
        assert_eq!(camera.pixel(&aside, size), None);
    }

    fn camera(lens: Lens, aim: Aim) -> LensCamera {
        let focus = lens
            .focus(FocusMethod::Film, Meters(f64::INFINITY))
            .unwrap();
        let pose = CameraPose::view_all(Default::default(), 1.5);
        LensCamera::new(lens, focus, FilmFormat::STANDARD, aim, &pose)
    }

    /// The sine sin θ′ of the steepest ray from the film's center that gets through, by bisection.
    fn sine_of_marginal_ray(camera: &LensCamera) -> f64 {
        let origin = DVec3::new(0.0, 0.0, camera.focus.film_z);
        let (mut low, mut high) = (0.0, 1.0);
        for _ in 0..60 {
            let sine = 0.5 * (low + high);
            let direction = DVec3::new(0.0, sine, -f64::sqrt(1.0 - sine * sine));
            match camera.lens.trace_from_film(&LensRay { origin, direction }) {
                Ok(_) => low = sine,
                Err(_) => high = sine,
            }
        }
        low
    }

    /// The mean and the standard error of the irradiance at a film point from a scene of radiance
    /// 1, by random rays, in steradians.
    fn by_rays(camera: &LensCamera, film: DVec2) -> (f64, f64) {
        let sampler = Sampler::new(SamplerKind::Random, 40_000, 7);
        let pixel = sampler.pixel(0, [0, 0]);
        let window = camera.target.window(film);
        let weight = |i| {
            let pupil = pixel.sample(i).pupil;
            let ray = camera.ray(film, &window, pupil);
            ray.map_or(0.0, |r| r.weight * camera.axial_irradiance())
        };
        let all: Vec<f64> = (0..sampler.samples).map(weight).collect();
        let n = all.len() as f64;
        let mean = all.iter().sum::<f64>() / n;
        let variance = all.iter().map(|w| (w - mean) * (w - mean)).sum::<f64>() / (n - 1.0);
        (mean, (variance / n).sqrt())
    }

    /// Equation 1 of the paper, integrated over a pupil that is a disc, gives E = π L sin²θ′.
    #[test]
    fn a_field_of_radiance_1_gives_pi_times_the_squared_sine_of_the_marginal_ray_on_the_axis() {
        for name in ["double-gauss", "cooke-triplet", "biogon", "wide-angle"] {
            let camera = camera(Lens::named(name).unwrap(), Aim::ExitPupil);
            let sine = sine_of_marginal_ray(&camera);
            let known = std::f64::consts::PI * sine * sine;
            let exact = camera.lens.irradiance(DVec2::ZERO, camera.focus.film_z);
            assert!(
                (exact / known - 1.0).abs() < 1e-4,
                "{name}: {exact} {known}"
            );
            let (mean, error) = by_rays(&camera, DVec2::ZERO);
            assert!((mean - known).abs() < 4.0 * error, "{name}: {mean} {known}");
            assert!((camera.axial_irradiance() / known - 1.0).abs() < 1e-4);
        }
    }

    #[test]
    fn off_the_axis_rays_and_the_pupil_outline_give_the_same_irradiance() {
        for name in ["double-gauss", "biogon"] {
            for aim in [Aim::ExitPupil, Aim::RearElement(DiscMap::Polar)] {
                let camera = camera(Lens::named(name).unwrap(), aim);
                for height in [5.0, 10.0, 15.0, 20.0] {
                    let film = height * DVec2::new(0.6, 0.8);
                    let known = camera.lens.irradiance(film, camera.focus.film_z);
                    let (mean, error) = by_rays(&camera, film);
                    let off = (mean - known) / error.max(1e-5 * known);
                    assert!(
                        off.abs() < 4.0,
                        "{name} {aim:?} at {height} mm: {mean} {known}"
                    );
                }
            }
        }
    }

    /// The Tessar's last surface is hollow toward the scene: from the side, a part of its rim lies
    /// outside the disc about its vertex. The rear element gives the light through the disc, which
    /// is computed on a grid; the exit pupil gives all light.
    #[test]
    fn the_disc_of_the_rear_element_misses_the_light_outside_it() {
        let lens = Lens::named("tessar").unwrap();
        let [pupil, rear] = [Aim::ExitPupil, Aim::RearElement(DiscMap::Concentric)]
            .map(|aim| camera(lens.clone(), aim));
        let film = DVec2::new(0.0, 21.0);
        let (origin, rear_z) = (film.extend(pupil.focus.film_z), lens.length());
        let radius = RearElement::new(&lens, DiscMap::Concentric).radius;
        let (mut inside, mut all) = (0.0, 0.0);
        const SIDE: i32 = 1200;
        for k in 0..SIDE * SIDE {
            let place = |i: i32| 1.1 * radius * (2.0 * f64::from(i) + 1.0 - f64::from(SIDE));
            let aim = DVec2::new(place(k % SIDE), place(k / SIDE)) / f64::from(SIDE);
            let across = aim.extend(rear_z) - origin;
            let ray = LensRay::new(origin, across);
            if lens.trace_from_film(&ray).is_ok() {
                let light = equation_1(across, -DVec3::Z);
                all += light;
                inside += if aim.length() < radius { light } else { 0.0 };
            }
        }
        let missed = 1.0 - inside / all;
        assert!(missed > 2e-3, "{missed}");
        let known = lens.irradiance(film, pupil.focus.film_z);
        let (whole, error) = by_rays(&pupil, film);
        assert!((whole - known).abs() < 4.0 * error, "{whole} {known}");
        let (part, error) = by_rays(&rear, film);
        let expected = known * (1.0 - missed);
        assert!(
            (part - expected).abs() < 4.0 * error,
            "{part} {expected} {known}"
        );
    }

    #[test]
    fn a_bare_lens_is_darker_on_the_axis_by_its_transmittance() {
        let lens = Lens::named("double-gauss")
            .unwrap()
            .at_f_number(8.0)
            .unwrap();
        let bare = lens.with_coating(Coating::Bare);
        let share = bare.axial_transmittance().unwrap();
        let (full, error) = by_rays(&camera(lens, Aim::ExitPupil), DVec2::ZERO);
        let (less, _) = by_rays(&camera(bare, Aim::ExitPupil), DVec2::ZERO);
        assert!(
            (less / full - share).abs() < 4.0 * error / full + 1e-3,
            "{less} {full} {share}"
        );
    }
}
