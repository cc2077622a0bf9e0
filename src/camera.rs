//! A ray for a film point and a lens point.
//!
//! This is where the film's and the lens's millimeters meet the scene's meters. Film and lens
//! space: the front vertex at the origin, light travels toward +z, the film at positive z. The
//! camera looks down its −z with +y up, so the two share their axes and differ by a factor of
//! 1000. The image on the film is upside down; a picture is the film turned upright.

mod ideal;
mod lanes;
mod lens_in_scene;
mod redraw;
mod waves;

use std::sync::OnceLock;

use glam::{DMat3, DQuat, DVec2, DVec3};

use crate::film::{FilmFormat, Resolution};
use crate::lens::{
    Aims, Bundle, FilmPlace, Focus, LANES, Lens, LensRay, PupilTarget, PupilTransmission,
    PupilWindow, RayPath, RearElement, Toward,
};
use crate::pose::{CameraPose, FilmPlane, Projection, ViewportMapping};
use crate::sampling::{DiscMap, Samples};
use crate::scene::wide::bits;
use crate::scene::{BUNDLE, RayLanes, Sides, of_lane};
use crate::spectrum::{HERO, SETS};

pub use ideal::IdealLens;
pub use lens_in_scene::lens_in_scene;

use lanes::{Outside, Sheaf};
use redraw::Redraws;
pub use waves::Doubts;
use waves::Waves;

/// Meters in a millimeter.
const METERS_FROM_MM: f64 = 1e-3;

/// A ray into the scene: meters, world directions, relative to the camera's position.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct CameraRay {
    pub origin: DVec3,
    pub direction: DVec3,
    /// What the radiance along the ray counts for, so that the mean over all samples (lost ones
    /// included) is the exposure; white on the axis is 1.
    pub weight: f64,
}

/// As many rays of a bundle stay in their lanes; fewer move up to those before them.
const MOST: u32 = 24;

/// Rays into the scene that answer samples: meters, from the scene's origin. They lie in bundles,
/// whose masks tell which lanes hold one.
#[derive(Clone, Debug, Default)]
pub struct Shots {
    bundles: Vec<RayLanes>,
    /// The number of each lane's sample,
    pub samples: Vec<u32>,
    /// what radiance counts for, as [`CameraRay::weight`],
    pub weights: Vec<f64>,
    /// and what becomes of its color, where wavelengths are told apart.
    pub colors: Vec<DMat3>,
    /// How many rays the lens let through; of a sample's wavelengths not all go on into the scene.
    pub passed: usize,
}

impl Shots {
    /// Lanes, with or without a ray.
    pub fn len(&self) -> usize {
        self.samples.len()
    }

    pub fn is_empty(&self) -> bool {
        self.samples.is_empty()
    }

    pub fn bundles(&self) -> &[RayLanes] {
        &self.bundles[..self.len().div_ceil(BUNDLE)]
    }

    fn clear(&mut self) {
        self.samples.clear();
        self.weights.clear();
        self.colors.clear();
        self.passed = 0;
    }

    fn push(&mut self, sample: usize, ray: &CameraRay) {
        let at = self.len();
        let (o, d) = (ray.origin.as_vec3(), ray.direction.as_vec3());
        self.put(at, o.to_array(), d.to_array());
        self.samples.push(sample as u32);
        self.weights.push(ray.weight);
        self.passed += 1;
    }

    /// Takes a ray that counts by a color.
    fn push_colored(&mut self, sample: u32, origin: [f32; 3], direction: [f32; 3], color: DMat3) {
        self.put(self.len(), origin, direction);
        self.samples.push(sample);
        self.weights.push(1.0);
        self.colors.push(color);
    }

    #[inline(always)]
    fn put(&mut self, at: usize, origin: [f32; 3], direction: [f32; 3]) {
        let lane = at % BUNDLE;
        let to = self.bundle(at / BUNDLE);
        for axis in 0..3 {
            to.origin[axis][lane] = origin[axis];
            to.direction[axis][lane] = direction[axis];
        }
        to.mask = (to.mask & ((1 << lane) - 1)) | 1 << lane;
    }

    fn bundle(&mut self, number: usize) -> &mut RayLanes {
        if number == self.bundles.len() {
            self.bundles.push(RayLanes::default());
        }
        &mut self.bundles[number]
    }

    /// Takes the rays that got through, of samples from a number on.
    fn take(&mut self, out: &Outside, sample: usize) {
        let mask = out.rays.mask;
        self.passed += mask.count_ones() as usize;
        if mask.count_ones() < MOST {
            return self.take_some(out, |lane| sample + lane);
        }
        let sample = sample as u32;
        // A bundle that was begun stays as it is.
        let first = self.len().next_multiple_of(BUNDLE);
        self.samples.resize(first, 0);
        self.weights.resize(first, 0.0);
        self.bundle(first / BUNDLE).clone_from(&out.rays);
        self.samples.extend(sample..sample + BUNDLE as u32);
        self.weights.extend_from_slice(&out.weight);
    }

    /// Takes the rays that got through, one after another, of samples that are told by lane.
    fn take_some(&mut self, out: &Outside, sample: impl Fn(usize) -> usize) {
        let (first, lanes) = (self.len(), out.rays.mask);
        for (i, lane) in bits(lanes).enumerate() {
            let (origin, direction) = out.ray(lane);
            self.put(first + i, origin, direction);
        }
        self.samples
            .extend(bits(lanes).map(|lane| sample(lane) as u32));
        self.weights
            .extend(bits(lanes).map(|lane| out.weight[lane]));
    }
}

/// What makes the picture.
#[derive(Clone, Debug)]
pub enum Camera {
    Pinhole(Pinhole),
    Lens(Box<LensCamera>),
    Ideal(IdealLens),
    /// The lens stands in the scene: the paper's first approach.
    Film(BareFilm),
}

impl Camera {
    /// Everything that depends on the film point alone. `x` and `y` run over the picture from 0
    /// to 1, from its upper left corner.
    pub fn at(&self, x: f64, y: f64) -> FilmPoint<'_> {
        match self {
            Self::Pinhole(pinhole) => FilmPoint::Pinhole(pinhole.ray(x, y)),
            Self::Ideal(lens) => FilmPoint::Ideal {
                lens,
                place: [x, y],
            },
            Self::Film(film) => FilmPoint::Bare {
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

    /// The rays of samples whose places are given over the picture from 0 to 1: those that get
    /// through and are to be followed, and those to be looked at.
    pub fn shoot(
        &self,
        samples: &Samples,
        bundle: &mut Bundle,
        shots: &mut Shots,
        doubts: &mut Doubts,
    ) {
        shots.clear();
        doubts.clear();
        let mut each = |ray: &dyn Fn([f64; 2], [f64; 2]) -> Option<CameraRay>| {
            for i in 0..samples.len() {
                let [film, pupil] = [&samples.film, &samples.pupil].map(|at| [at[0][i], at[1][i]]);
                if let Some(ray) = ray(film, pupil) {
                    shots.push(i, &ray);
                }
            }
        };
        match self {
            Self::Pinhole(pinhole) => each(&|[x, y], _| pinhole.ray(x, y)),
            Self::Ideal(lens) => lens.shoot(samples, shots),
            Self::Film(film) => {
                each(&|[x, y], pupil| film.ray(film_point(film.format, x, y), pupil))
            }
            Self::Lens(camera) => match &camera.waves {
                None => camera.shoot(samples, bundle, shots),
                Some(waves) => camera.shoot_by_wavelength(waves, samples, bundle, shots, doubts),
            },
        }
    }

    fn waves(&self) -> Option<&Waves> {
        match self {
            Self::Pinhole(_) | Self::Ideal(_) | Self::Film(_) => None,
            Self::Lens(camera) => camera.waves.as_deref(),
        }
    }

    /// How many samples are best taken together: enough that rays to be drawn anew fill lanes.
    pub fn batch(&self) -> usize {
        match self {
            Self::Lens(camera) if camera.waves.is_none() => 16 * LANES,
            Self::Lens(_) => SETS * LANES,
            _ => 4 * LANES,
        }
    }

    /// Adds what the radiances along shots, bundle by bundle, bring to their samples' exposures.
    pub fn expose(&self, shots: &Shots, radiances: &[Sides], exposures: &mut [DVec3]) {
        let bundles = shots
            .samples
            .chunks(BUNDLE)
            .zip(shots.weights.chunks(BUNDLE))
            .zip(shots.bundles());
        for (number, (((samples, weights), rays), light)) in bundles.zip(radiances).enumerate() {
            for lane in bits(rays.mask) {
                let mut light = of_lane(light, lane).as_dvec3() * weights[lane];
                if let Some(color) = shots.colors.get(number * BUNDLE + lane) {
                    light = *color * light;
                }
                exposures[samples[lane] as usize] += light;
            }
        }
    }

    /// The rays of one sample from the film: one, or one for each wavelength of a hero set.
    pub fn rays_each(&self) -> usize {
        self.waves().map_or(1, |_| HERO)
    }
}

impl Camera {
    /// How a pinhole in the lens's place would see: the height angle of the film by the paper's
    /// equation 7, or what the pose says where there is no lens.
    pub fn projection(&self, pose: &CameraPose) -> Projection {
        match self {
            Self::Lens(lens) => Projection::Perspective {
                height_angle: lens.focus.height_angle(0.5 * lens.format.height),
            },
            _ => pose.projection,
        }
    }

    /// The same camera standing and looking as the pose says, for a scene compiled around
    /// `origin`: what is seen from elsewhere without compiling again.
    pub fn posed(mut self, pose: &CameraPose, origin: DVec3) -> Self {
        let eye = pose.position - origin;
        match &mut self {
            Self::Pinhole(pinhole) => {
                (pinhole.world_from_camera, pinhole.eye) = (pose.orientation, eye)
            }
            Self::Lens(lens) => lens.stand(pose.orientation, eye),
            Self::Ideal(lens) => {
                (lens.world_from_camera, lens.eye) = (pose.orientation, eye);
            }
            Self::Film(film) => (film.world_from_camera, film.eye) = (pose.orientation, eye),
        }
        self
    }
}

/// A point of the film, ready to look through any point of the lens. It lives on the stack for
/// one pixel's sake, so its size costs nothing.
#[allow(clippy::large_enum_variant)]
pub enum FilmPoint<'a> {
    Pinhole(Option<CameraRay>),
    Ideal {
        lens: &'a IdealLens,
        /// Over the picture from 0 to 1.
        place: [f64; 2],
    },
    Bare {
        film: &'a BareFilm,
        point: DVec2,
    },
    Lens {
        camera: &'a LensCamera,
        point: DVec2,
        window: PupilWindow<'a>,
    },
}

impl FilmPoint<'_> {
    /// The ray at the lens's own wavelength through a point of the lens, given in the unit square;
    /// `None` is a lost ray.
    pub fn ray(&self, pupil: [f64; 2]) -> Option<CameraRay> {
        match self {
            Self::Pinhole(ray) => *ray,
            Self::Ideal { lens, place } => Some(lens.ray(*place, pupil)),
            Self::Bare { film, point } => film.ray(*point, pupil),
            Self::Lens {
                camera,
                point,
                window,
            } => camera.ray(*point, window, pupil),
        }
    }
}

/// A camera of no aperture: the scene's own, as Inventor renders it.
#[derive(Clone, Copy, Debug)]
pub struct Pinhole {
    world_from_camera: DQuat,
    projection: Projection,
    /// Half the view's width and height at distance 1 (perspective) or anywhere (orthographic).
    half: DVec2,
    /// The part of the picture that is the view: −1 to 1 on each axis. Outside is black, where
    /// the camera crops the viewport.
    frame: DVec2,
    near: f64,
    eye: DVec3,
}

impl Pinhole {
    /// Inventor's rules for a picture of another shape than the camera (`viewportMapping`):
    /// `ADJUST_CAMERA` keeps the whole height angle on the shorter side, the `CROP_` ones leave a
    /// part of the picture black, `LEAVE_ALONE` stretches.
    pub fn new(pose: &CameraPose, aspect: f64) -> Self {
        let half_height = match pose.projection {
            Projection::Perspective { height_angle } => libm::tan(0.5 * height_angle),
            Projection::Orthographic { height } => 0.5 * height,
        };
        let own = if pose.aspect_ratio > 0.0 {
            pose.aspect_ratio
        } else {
            1.0
        };
        let (half, frame) = match pose.viewport_mapping {
            ViewportMapping::AdjustCamera => {
                let y = if aspect < 1.0 {
                    half_height / aspect
                } else {
                    half_height
                };
                (DVec2::new(aspect * y, y), DVec2::ONE)
            }
            ViewportMapping::LeaveAlone => (DVec2::new(own * half_height, half_height), DVec2::ONE),
            _ if aspect > own => {
                let half = DVec2::new(aspect * half_height, half_height);
                (half, DVec2::new(own / aspect, 1.0))
            }
            _ => {
                let half = DVec2::new(own * half_height, own * half_height / aspect);
                (half, DVec2::new(1.0, aspect / own))
            }
        };
        let near = match pose.projection {
            Projection::Perspective { .. } => 0.0,
            Projection::Orthographic { .. } => pose.near,
        };
        Self {
            world_from_camera: pose.orientation,
            projection: pose.projection,
            half,
            frame,
            near,
            eye: DVec3::ZERO,
        }
    }

    fn ray(&self, x: f64, y: f64) -> Option<CameraRay> {
        let view = DVec2::new(2.0 * x - 1.0, 1.0 - 2.0 * y);
        if view.x.abs() > self.frame.x || view.y.abs() > self.frame.y {
            return None;
        }
        let at = view * self.half;
        let (origin, direction) = match self.projection {
            Projection::Perspective { .. } => (DVec3::ZERO, DVec3::new(at.x, at.y, -1.0)),
            Projection::Orthographic { .. } => (at.extend(-self.near), DVec3::NEG_Z),
        };
        Some(CameraRay {
            origin: self.eye + self.world_from_camera * origin,
            direction: (self.world_from_camera * direction).normalize(),
            weight: 1.0,
        })
    }
}

/// Where on the lens to aim (see `lens::pupil`).
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Aim {
    /// The rear-most element: the 1999 program.
    RearElement(DiscMap),
    /// The real exit pupil. Default.
    ExitPupil,
}

/// A lens in front of a film.
#[derive(Clone, Debug)]
pub struct LensCamera {
    pub lens: Lens,
    pub focus: Focus,
    pub format: FilmFormat,
    place: FilmPlace,
    target: PupilTarget,
    /// How much of what is aimed at is light. Measured when the first ray asks for it.
    light: OnceLock<PupilTransmission>,
    /// The lens at other wavelengths; none where one is enough.
    waves: Option<Box<Waves>>,
    world_from_lens: DQuat,
    /// Where lens space's origin is, from the scene's.
    eye: DVec3,
    rear_z: f64,
    /// Irradiance on the axis from radiance 1, with the lens at infinity: what exposure 1 means.
    axial_irradiance: f64,
}

impl LensCamera {
    pub fn new(lens: Lens, focus: Focus, format: FilmFormat, aim: Aim, pose: &CameraPose) -> Self {
        let place = FilmPlace::flat(focus.film_z);
        Self::with_film(lens, focus, place, format, aim, pose)
    }

    /// With a film that is moved or bent.
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
            light: OnceLock::new(),
            waves: None,
        };
        this.stand(pose.orientation, DVec3::ZERO);
        this
    }

    /// The same camera seeing colors by their wavelengths. Through a lens without dispersion and
    /// without coatings they take the same way, and it goes on to see one.
    pub fn dispersing(mut self) -> Self {
        if self.lens.prescription().is_chromatic() {
            let waves = Waves::of(&self.lens, &self.target, &self.place, self.format);
            self.waves = Some(Box::new(waves));
        }
        self
    }

    /// Whether the picture is made of wavelengths.
    pub fn is_dispersing(&self) -> bool {
        self.waves.is_some()
    }

    /// Stands at a point, in meters from the scene's origin, and looks somewhere.
    fn stand(&mut self, orientation: DQuat, eye: DVec3) {
        self.world_from_lens = orientation * self.place.camera_from_lens;
        self.eye = eye + orientation * (self.place.offset * METERS_FROM_MM);
    }

    /// Where the film stands.
    pub fn place(&self) -> &FilmPlace {
        &self.place
    }

    /// What a film point aims at.
    pub fn window(&self, film: DVec2) -> PupilWindow<'_> {
        self.target.window(film)
    }

    /// Irradiance on the axis from radiance 1, in steradians: π/(4 N²) for an ideal lens.
    pub fn axial_irradiance(&self) -> f64 {
        self.axial_irradiance
    }

    /// Millimeters on the film of a point of the upright picture.
    pub fn film_point(&self, x: f64, y: f64) -> DVec2 {
        film_point(self.format, x, y)
    }

    /// The pixel that a ray behind the lens falls on, and how much of its area the film has there:
    /// bent film has more than what it is bent from. `None` beside the film.
    pub fn pixel(&self, out: &LensRay, resolution: Resolution) -> Option<(u32, f64)> {
        let film = self.place.meet(out)?;
        let x = (0.5 - film.x / self.format.width) * f64::from(resolution.width);
        let y = (film.y / self.format.height + 0.5) * f64::from(resolution.height);
        let inside = (0.0..f64::from(resolution.width)).contains(&x)
            && (0.0..f64::from(resolution.height)).contains(&y);
        let slant = self.place.normal(film).dot(self.place.normal(DVec2::ZERO));
        inside.then(|| (y as u32 * resolution.width + x as u32, slant))
    }

    /// A point of the scene, from its origin, in lens space.
    pub fn lens_point(&self, world: DVec3) -> DVec3 {
        self.lens_direction(world - self.eye) / METERS_FROM_MM
    }

    /// A direction of the scene in lens space.
    pub fn lens_direction(&self, world: DVec3) -> DVec3 {
        self.world_from_lens.inverse() * world
    }

    /// A point of lens space in the scene, from its origin.
    pub fn world_point(&self, lens: DVec3) -> DVec3 {
        self.eye + self.world_from_lens * (lens * METERS_FROM_MM)
    }

    /// The ray from a film point (millimeters) through a lens point of its window.
    pub fn ray(&self, film: DVec2, window: &PupilWindow<'_>, pupil: [f64; 2]) -> Option<CameraRay> {
        self.ray_through(&self.lens, film, window, pupil)
    }

    /// The same through the lens at another wavelength.
    fn ray_through(
        &self,
        lens: &Lens,
        film: DVec2,
        window: &PupilWindow<'_>,
        pupil: [f64; 2],
    ) -> Option<CameraRay> {
        let (inside, weight) = self.aim(film, window, pupil)?;
        let out = lens.trace_from_film(&inside).ok()?;
        Some(self.outside(&out, weight * kept(lens, &inside)))
    }

    /// The way of a sample's ray through the lens, in lens space, from its film point; `None`
    /// where no lens point is aimed at.
    pub fn path(&self, film: DVec2, pupil: [f64; 2]) -> Option<(LensRay, RayPath)> {
        let (inside, _) = self.aim(film, &self.target.window(film), pupil)?;
        let path = self.lens.trace_path(&inside, Toward::Scene, true);
        Some((inside, path))
    }

    /// The ray behind the lens, and its weight.
    fn aim(
        &self,
        film: DVec2,
        window: &PupilWindow<'_>,
        pupil: [f64; 2],
    ) -> Option<(LensRay, f64)> {
        let (inside, weight) = aimed(&self.place, film, self.rear_z, window, pupil)?;
        Some((inside, weight / self.axial_irradiance))
    }

    fn outside(&self, out: &LensRay, weight: f64) -> CameraRay {
        CameraRay {
            origin: self.world_point(out.origin),
            direction: self.world_from_lens * out.direction,
            weight,
        }
    }

    fn shoot(&self, samples: &Samples, bundle: &mut Bundle, shots: &mut Shots) {
        let (mut sheaf, mut aims) = (Sheaf::default(), Aims::default());
        let mut out = Outside::default();
        let light = self
            .light
            .get_or_init(|| self.target.transmission(&self.lens, &self.place));
        let mut redraws = Redraws::default();
        for first in (0..samples.len()).step_by(LANES) {
            sheaf.take_from(self.format, samples, first);
            self.target
                .aims(&sheaf.film, &sheaf.pupil, light, &mut aims);
            self.trace(&self.lens, &sheaf, &aims, bundle, &mut out);
            redraws.note(&sheaf, &aims, &mut out, first);
            shots.take(&out, first);
        }
        self.redraw(&mut redraws, light, bundle, shots);
    }
}

/// The share of a ray's light that the surfaces do not reflect.
fn kept(lens: &Lens, inside: &LensRay) -> f64 {
    if lens.reflects() {
        lens.transmittance(inside, Toward::Scene)
    } else {
        1.0
    }
}

/// A film in the dark, and no lens that the camera knows of: it stands in the scene as solids,
/// which send on what the film sees of its rear element, or do not.
#[derive(Clone, Copy, Debug)]
pub struct BareFilm {
    pub format: FilmFormat,
    plane: FilmPlane,
    map: DiscMap,
    world_from_camera: DQuat,
    /// Where the front vertex is, from the scene's origin, in meters.
    eye: DVec3,
}

impl BareFilm {
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

    /// The ray from a film point (millimeters) to a point of the rear element.
    fn ray(&self, film: DVec2, pupil: [f64; 2]) -> Option<CameraRay> {
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

/// Millimeters on the film of a point of the upright picture, which is upside down on the film.
fn film_point(format: FilmFormat, x: f64, y: f64) -> DVec2 {
    DVec2::new((0.5 - x) * format.width, (y - 0.5) * format.height)
}

/// The ray from a film point to a point of the rear vertex plane, and equation 1 over the density
/// of such points.
fn aimed(
    place: &FilmPlace,
    film: DVec2,
    rear_z: f64,
    window: &PupilWindow<'_>,
    [u, v]: [f64; 2],
) -> Option<(LensRay, f64)> {
    (!window.is_closed()).then(|| {
        let aim = window.point(u, v);
        toward(place, film, aim.extend(rear_z), window.density(aim))
    })
}

/// The ray to a point that was drawn with a density, and its weight.
fn toward(place: &FilmPlace, film: DVec2, aim: DVec3, density: f64) -> (LensRay, f64) {
    let origin = place.point(film);
    let across = aim - origin;
    let direction = across.normalize();
    let weight = equation_1(across, place.normal(film)) / density;
    (LensRay { origin, direction }, weight)
}

/// Half of the angle (radians) that a lens sees on a film's shorter side, focused at infinity: that
/// of the real ray through the middle of the exit pupil, or what the focal length says.
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
    // A fish-eye sees behind itself; so near nobody wants to stand.
    Some(angle.min(1.2)).filter(|a| *a > 0.0)
}

/// Half the height of 35 mm film, in millimeters.
const FILM_HALF_HEIGHT: f64 = 12.0;

/// The film behind a lens that stands in the scene as solids, to write into that scene.
pub fn film_plane(lens: &Lens, film_z: f64) -> FilmPlane {
    let focal = lens.first_order().focal;
    let image_distance = film_z - focal.map_or(0.0, |f| f.rear_principal_plane);
    FilmPlane {
        film_z: film_z * METERS_FROM_MM,
        height_angle: 2.0 * libm::atan(FILM_HALF_HEIGHT / image_distance.abs()),
        rear_z: lens.length() * METERS_FROM_MM,
        rear_radius: RearElement::of(lens, DiscMap::Concentric).radius * METERS_FROM_MM,
        irradiance: white_irradiance(lens, film_z),
    }
}

/// What exposure 1 means: the irradiance on the axis with the lens focused at infinity, or at its
/// own film where it has no focus there.
fn white_irradiance(lens: &Lens, film_z: f64) -> f64 {
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

/// cos θ cos θ′/‖x′ − x‖² of the paper's equation 1, with the film's normal at x. Where film and
/// rear plane are parallel this is cos⁴θ/Z²; Z is the same for every ray of a picture, which is
/// why equation 2 can drop it.
#[inline(always)]
fn equation_1(across: DVec3, normal: DVec3) -> f64 {
    let squared = across.length_squared();
    (normal.dot(across) * -across.z).max(0.0) / (squared * squared)
}

/// The picture's aspect and the film's must agree, or pixels are not square.
pub fn pixel_aspect(format: FilmFormat, resolution: Resolution) -> f64 {
    (format.width / f64::from(resolution.width)) / (format.height / f64::from(resolution.height))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_ray_falls_on_the_pixel_that_sees_along_it() {
        let camera = camera(Lens::named("double-gauss").unwrap(), Aim::ExitPupil);
        let size = Resolution {
            width: 36,
            height: 24,
        };
        for (column, row) in [(0, 0), (35, 0), (7, 20), (35, 23)] {
            let place = |cell: u32, of: u32| (f64::from(cell) + 0.5) / f64::from(of);
            let film = camera.film_point(place(column, 36), place(row, 24));
            let origin = DVec3::new(0.0, 0.0, camera.rear_z);
            let direction = film.extend(camera.focus.film_z) - origin;
            let pixel = camera.pixel(&LensRay { origin, direction }, size);
            assert_eq!(pixel, Some((row * 36 + column, 1.0)));
        }
        let aside = LensRay {
            origin: DVec3::ZERO,
            direction: DVec3::new(1.0, 0.0, 1.0),
        };
        assert_eq!(camera.pixel(&aside, size), None);
    }
    use crate::lens::{Coating, FocusMethod};
    use crate::math::Meters;
    use crate::sampling::{Sampler, SamplerKind};

    fn camera(lens: Lens, aim: Aim) -> LensCamera {
        let focus = lens
            .focus(FocusMethod::Film, Meters(f64::INFINITY))
            .unwrap();
        let pose = CameraPose::view_all(Default::default(), 1.5);
        LensCamera::new(lens, focus, FilmFormat::STANDARD, aim, &pose)
    }

    /// The steepest ray from the film's center that gets through, by halving: sin θ′.
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

    /// Mean and standard error of the irradiance that random rays bring to a film point from a
    /// scene of radiance 1, in units of radiance times steradian.
    fn by_rays(camera: &LensCamera, film: DVec2) -> (f64, f64) {
        let sampler = Sampler {
            kind: SamplerKind::Random,
            samples: 40_000,
            seed: 7,
        };
        let window = camera.target.window(film);
        let weight = |i| {
            let pupil = sampler.sample(0, i).pupil;
            let ray = camera.ray(film, &window, pupil);
            ray.map_or(0.0, |r| r.weight * camera.axial_irradiance())
        };
        let all: Vec<f64> = (0..sampler.samples).map(weight).collect();
        let n = all.len() as f64;
        let mean = all.iter().sum::<f64>() / n;
        let variance = all.iter().map(|w| (w - mean) * (w - mean)).sum::<f64>() / (n - 1.0);
        (mean, (variance / n).sqrt())
    }

    /// From the paper's equation 1 over a pupil that is a disc as the film sees it: E = π L sin²θ′.
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
    fn off_the_axis_the_rays_bring_the_irradiance_that_the_pupil_outline_gives() {
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

    /// The Tessar's last surface is hollow toward the scene: seen from the side, a part of its rim
    /// stands outside of the disc about its vertex. What the rear element brings is what passes
    /// through the disc, on a grid; the exit pupil brings all.
    #[test]
    fn the_disc_of_the_rear_element_misses_what_passes_beside_it() {
        let lens = Lens::named("tessar").unwrap();
        let [pupil, rear] = [Aim::ExitPupil, Aim::RearElement(DiscMap::Concentric)]
            .map(|aim| camera(lens.clone(), aim));
        let film = DVec2::new(0.0, 21.0);
        let (origin, rear_z) = (film.extend(pupil.focus.film_z), lens.length());
        let radius = RearElement::of(&lens, DiscMap::Concentric).radius;
        let (mut inside, mut all) = (0.0, 0.0);
        const SIDE: i32 = 1200;
        for k in 0..SIDE * SIDE {
            let place = |i: i32| 1.1 * radius * (2.0 * f64::from(i) + 1.0 - f64::from(SIDE));
            let aim = DVec2::new(place(k % SIDE), place(k / SIDE)) / f64::from(SIDE);
            let across = aim.extend(rear_z) - origin;
            let ray = LensRay {
                origin,
                direction: across,
            };
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
    fn a_bare_lens_is_darker_on_the_axis_by_what_its_t_number_says() {
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
