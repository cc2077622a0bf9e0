//! Every choice of a photograph in one value, and the value made ready to render.
//!
//! 1999 and now differ by the [`Plan`] they start from, never by an `if` in a loop. The command
//! line, the window, convergence runs and films all make a `Plan` and open a [`Session`] of it, so
//! they render by the same code.

mod headlight;
mod optics;
mod standing;

pub use headlight::{Headlight, HeadlightCause, HeadlightSources, HeadlightState};
pub use standing::camera_of_file;

use std::borrow::Cow;
use std::ffi::OsStr;
use std::path::{Path, PathBuf};
use std::sync::Arc;
use std::time::Instant;

use glam::DVec3;
use indexmap::IndexMap;

use optics::camera;
use standing::{Environment, Overview, first_camera, own_focus, standing};

use crate::camera::{Aim, Camera, film_plane, lens_in_scene};
use crate::diag::{Diagnostic, Result, Severity, Sink};
use crate::film::{Film, FilmFormat, Glare, Metering, Resolution, Response};
use crate::geometry::text::Fonts;
use crate::iv::{Document, Limits};
use crate::lens::{
    Coating, Focus, FocusMethod, Iris, Lens, Movements, Reading, at_zoom_list, open_prescription,
};
use crate::math::{Meters, Mm};
use crate::picture::{Depth, Picture};
use crate::pose::{CameraPose, Projection};
use crate::prescription::glass::D_LINE;
use crate::render::diffraction::diffract;
use crate::render::ghosts::Flare;
use crate::render::report::{RenderReport, Seconds};
use crate::render::{Exposure, Progress, Render, Stop};
use crate::sampling::{DiscMap, Filter, FilterTable, Sampler, SamplerKind};
use crate::scene::{CompileOptions, Light, RenderScene, snapshot};
use crate::shade::{ShadeOptions, Shader, Shading};
use crate::snapshot::{Snapshot, SnapshotOptions};

/// Rays in the ghosts of a light, for each sample of a pixel.
const GHOST_RAYS: u32 = 1 << 17;

/// Whose choices a plan starts from.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Era {
    /// The 1999 program (`docs/vintage.md`).
    Vintage,
    Modern,
}

impl Era {
    pub fn name(self) -> &'static str {
        match self {
            Self::Vintage => "1999",
            Self::Modern => "modern",
        }
    }
}

/// What stands in front of the film.
#[derive(Clone, Debug, PartialEq)]
pub enum Optics {
    /// The scene's own camera, without an aperture.
    Pinhole,
    Ideal(IdealChoice),
    Lens(LensChoice),
}

/// A lens without thickness or faults.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct IdealChoice {
    pub efl: Mm,
    pub f_number: f64,
}

impl Default for IdealChoice {
    /// 50 mm, f/2.
    fn default() -> Self {
        Self {
            efl: Mm(50.0),
            f_number: 2.0,
        }
    }
}

/// A lens with its changes, in the order in which they are made.
#[derive(Clone, Debug, PartialEq)]
pub struct LensChoice {
    /// A name under `lenses/`, or a path.
    pub name: String,
    /// Scale to this focal length first.
    pub efl: Option<Mm>,
    /// Then by this factor.
    pub zoom: f64,
    /// A tabulated position of a zoom lens, from 0, before anything else.
    pub zoom_position: Option<usize>,
    /// Stop down to this f-number; full aperture without.
    pub f_number: Option<f64>,
    pub iris: Iris,
    /// On every surface; what the prescription says without.
    pub coating: Option<Coating>,
    pub method: FocusMethod,
    /// `.agf` files with glasses that the prescription names, besides the built-in table.
    pub catalogues: Vec<PathBuf>,
}

impl LensChoice {
    pub fn named(name: impl Into<String>) -> Self {
        Self {
            name: name.into(),
            efl: None,
            zoom: 1.0,
            zoom_position: None,
            f_number: None,
            iris: Iris::Round,
            coating: None,
            method: FocusMethod::Film,
            catalogues: Vec::new(),
        }
    }

    /// Opens the lens and makes the changes.
    pub fn open(&self, sink: &mut Sink) -> Result<Lens> {
        let mut reading = Reading::default();
        for file in &self.catalogues {
            reading.glasses.add_file(file)?;
        }
        let mut lens = open_prescription(&self.name, &reading, sink)?;
        if let Some(position) = self.zoom_position {
            lens = lens
                .at_zoom(position)
                .map_err(|e| at_zoom_list(e, &self.name))?;
        }
        if let Some(length) = self.efl {
            lens = lens.scaled_to(length, D_LINE)?;
        }
        if self.zoom != 1.0 {
            lens = lens.scaled(self.zoom);
        }
        if let Some(n) = self.f_number {
            lens = lens.at_f_number(n, D_LINE)?;
        }
        if self.iris != Iris::Round {
            lens.iris = self.iris.clone();
        }
        if let Some(coating) = self.coating {
            lens = lens.with_coating(coating);
        }
        Ok(Lens::new(lens))
    }
}

impl LensChoice {
    /// The lens focused at a distance, and where the film is then.
    ///
    /// # Errors
    /// A lens that can't be opened, or can't focus there.
    pub fn open_focused(&self, distance: Meters, sink: &mut Sink) -> Result<(Lens, Focus)> {
        let lens = self.open(sink)?;
        lens.focused(self.method, distance)
            .map_err(|f| f.diagnostic(lens.name()))
    }
}

/// Every choice of a photograph.
#[derive(Clone, Debug, PartialEq)]
pub struct Plan {
    pub era: Era,
    pub scene: PathBuf,
    /// A file with a camera node, or the node itself (anything with a brace); without, the
    /// environment's, the scene's own, or a view of everything.
    pub camera: Option<PathBuf>,
    pub environment: Option<PathBuf>,
    pub optics: Optics,
    /// From the camera. Without: the scene camera's `focalDistance`.
    pub focus: Option<Meters>,
    pub shading: Shading,
    pub headlight: Headlight,
    pub sampler: Sampler,
    /// How a pixel weighs the light around its middle.
    pub filter: Filter,
    /// Whether samples go where a first look finds noise.
    pub adaptive: bool,
    pub aim: Aim,
    /// Whether glass with dispersion parts colors. The 1999 program: no. Default: yes.
    pub dispersion: bool,
    pub film: FilmFormat,
    /// Of the lens against the film; nothing for the scene's own pinhole.
    pub movements: Movements,
    pub resolution: Resolution,
    /// Multiplies the exposure; 1 renders white on the axis as white.
    pub exposure: f64,
    /// Shutter and ISO, instead of the paper's constant; `exposure` then multiplies what they give.
    pub metering: Option<Metering>,
    /// Two reflections inside the lens, of the scene's lights. Default: no; 1999 had none.
    pub ghosts: bool,
    /// Spread the film's light by the pupil's diffraction, see [`crate::diffraction`].
    pub diffraction: bool,
    pub response: Response,
    pub depth: Depth,
    /// Reflections and refractions in a row. Default: 5, through a lens of solids 64.
    pub max_depth: Option<u32>,
    /// The lens stands in the scene as solids, the film behind it: the paper's first approach.
    pub solids: bool,
    /// The scene's own time in seconds.
    pub time: f64,
    /// Draws the handles of draggers and manipulators. Default: no.
    pub handles: bool,
    pub stop: Stop,
    /// Folders besides the scene's own in which files that it names are looked for.
    pub search: Vec<PathBuf>,
    /// Typefaces to draw text with before the shipped ones. Default: none.
    pub fonts: Arc<Fonts>,
    /// How much the scene may ask for.
    pub limits: Limits,
}

impl Plan {
    /// The one place where 1999 and now part.
    pub fn of_era(era: Era, scene: impl Into<PathBuf>) -> Self {
        let (kind, aim, samples, headlight) = match era {
            Era::Vintage => (
                SamplerKind::Jittered,
                Aim::RearElement(DiscMap::Polar),
                1,
                Headlight::Environment,
            ),
            Era::Modern => (SamplerKind::Sobol, Aim::ExitPupil, 16, Headlight::Automatic),
        };
        Self {
            era,
            scene: scene.into(),
            camera: None,
            environment: None,
            optics: Optics::Lens(LensChoice::named("wide-angle")),
            focus: None,
            shading: Shading::Recursive,
            headlight,
            sampler: Sampler {
                kind,
                samples,
                seed: 0,
            },
            filter: Filter::Box,
            adaptive: false,
            aim,
            dispersion: era == Era::Modern,
            film: FilmFormat::STANDARD,
            movements: Movements::default(),
            resolution: Resolution::VINTAGE,
            exposure: 1.0,
            metering: None,
            ghosts: false,
            diffraction: false,
            response: Response::Linear,
            depth: Depth::Eight,
            max_depth: None,
            solids: false,
            time: 0.0,
            handles: false,
            stop: Stop::after(samples),
            search: Vec::new(),
            fonts: Arc::default(),
            limits: Limits::default(),
        }
    }

    /// The plan that the window starts from. It shows a picture that goes on refining, and saves
    /// what it shows, so the samples and the pupil of 1999 are only for those who ask for them.
    pub fn for_window(era: Era, scene: impl Into<PathBuf>) -> Self {
        let modern = Self::of_era(Era::Modern, "");
        let mut plan = Self::of_era(era, scene);
        plan.aim = modern.aim;
        plan.sampler.samples = modern.sampler.samples;
        plan.stop = modern.stop;
        plan
    }

    /// The choices that make the picture what it is, for its metadata and the report.
    pub fn describe(&self) -> IndexMap<String, String> {
        let pupil = match self.aim {
            Aim::RearElement(DiscMap::Polar) => "rear element, polar map",
            Aim::RearElement(DiscMap::Concentric) => "rear element, concentric map",
            Aim::ExitPupil => "exit pupil",
        };
        let Resolution { width, height } = self.resolution;
        [
            ("era", self.era.name().to_owned()),
            ("shading", self.shading.name().to_owned()),
            ("samples", self.sampler.samples.to_string()),
            ("sampler", self.sampler.kind.name().to_owned()),
            ("seed", self.sampler.seed.to_string()),
            ("pupil", pupil.to_owned()),
            (
                "film",
                format!("{}x{} mm", self.film.width, self.film.height),
            ),
            ("size", format!("{width}x{height}")),
            ("exposure", self.exposure.to_string()),
            ("response", self.response.name()),
        ]
        .into_iter()
        .chain((self.filter != Filter::Box).then(|| ("filter", self.filter.name().to_owned())))
        .chain(self.adaptive.then(|| ("adaptive", "yes".to_owned())))
        .map(|(k, v)| (k.to_owned(), v))
        .collect()
    }
}

/// A plan made ready: scene compiled, camera in place, lens focused.
pub struct Session {
    pub plan: Plan,
    pub document: Arc<Document>,
    pub scene: Arc<RenderScene>,
    /// What the scene was compiled for (see [`Camera::projection`]).
    seen: Projection,
    pub pose: CameraPose,
    pub camera: Camera,
    pub headlight: Option<Light>,
    /// What decides about the headlight where the plan leaves it open.
    pub headlight_sources: HeadlightSources,
    /// The environment file's own headlight, in camera space.
    lamp: Option<Light>,
    pub seconds: Seconds,
    /// What reading, compiling and the lens had to say.
    pub sink: Sink,
    /// The plan's choices and those that the scene and the lens brought with them.
    pub described: IndexMap<String, String>,
}

impl Session {
    /// Reads, compiles and focuses.
    ///
    /// # Errors
    /// A file that can't be read, a camera file without a camera, a lens that can't focus there.
    pub fn open(plan: Plan) -> Result<Self> {
        let clock = Instant::now();
        let search: Vec<&Path> = plan.search.iter().map(PathBuf::as_path).collect();
        let mut document = Document::open_with(&plan.scene, &search, &plan.limits)?;
        let environment = match plan.environment.as_deref() {
            Some(path) => Environment::join(&mut document, path, plan.time)?,
            None => Environment::default(),
        };
        let read = clock.elapsed().as_secs_f64();
        let mut session = Self::of_document(plan, document, &environment)?;
        session.seconds.read = read;
        Ok(session)
    }

    fn of_document(plan: Plan, mut document: Document, environment: &Environment) -> Result<Self> {
        let mut seconds = Seconds::default();
        let mut sink = Sink::new();
        sink.extend_from(&document.sink);
        for trouble in &plan.fonts.warnings {
            sink.add((**trouble).clone());
        }

        let clock = Instant::now();
        let mut snapshot = snapshot_of(&document, &plan);
        let overview = Overview::of(&snapshot);
        let headlight_sources = HeadlightSources {
            environment: plan
                .environment
                .is_some()
                .then_some(environment.headlight.is_some()),
            navigation_info: overview.navigation_info,
            scene_has_light: overview.has_light,
        };
        let mut pose = standing(&plan, &snapshot, environment, overview.camera)?;
        if plan.solids {
            drop(snapshot);
            lens_into_scene(&plan, &pose, &mut document, &mut sink)?;
            snapshot = snapshot_of(&document, &plan);
            pose = first_camera(&snapshot).unwrap_or(pose);
        }
        seconds.compile = clock.elapsed().as_secs_f64();

        let clock = Instant::now();
        let (camera, optics) = camera(&plan, &pose, &mut sink)?;
        seconds.pupil = clock.elapsed().as_secs_f64();

        let clock = Instant::now();
        let seen = camera.projection(&pose);
        let scene = RenderScene::compile(&snapshot, &options(&plan, plan.shading, &pose, seen))?;
        drop(snapshot);
        scene.prepare();
        // A picture is made all the same, so none of these is an error.
        for trouble in &scene.census().troubles {
            let severity = trouble.severity.min(Severity::Warning);
            sink.add(Diagnostic {
                severity,
                ..(**trouble).clone()
            });
        }
        seconds.compile += clock.elapsed().as_secs_f64();

        let mut described = plan.describe();
        described.insert("camera".into(), pose.source.clone());
        described.extend(optics);
        let lit = headlight_sources.resolve(plan.headlight);
        described.insert("headlight".into(), lit.describe().into());
        if plan.shading.needs().lights && is_left_dark(headlight_sources, lit) {
            let dark = "the scene has no light, and the headlight is off";
            let help = "`-headlight`, or `--headlight=on`, turns the light on the camera on";
            sink.add(*Diagnostic::warning(dark).with_help(help));
        }
        Ok(Self {
            headlight: headlight::in_world(lit.on, environment.headlight, &pose),
            headlight_sources,
            lamp: environment.headlight,
            plan,
            document: Arc::new(document),
            scene: Arc::new(scene),
            seen,
            pose,
            camera,
            seconds,
            sink,
            described,
        })
    }

    /// Takes on another plan and pose for the same scene file; only what differs is made again.
    ///
    /// # Errors
    /// A lens that can't focus there, or a scene that does not compile.
    pub fn change(&mut self, plan: Plan, pose: CameraPose) -> Result<()> {
        let stands = pose.orientation == self.pose.orientation
            && plan.time == self.plan.time
            && plan.shading == self.plan.shading
            && plan.resolution == self.plan.resolution;
        self.aim(plan, pose)?;
        if stands && self.is_compiled_from_here() {
            return Ok(());
        }
        self.compile(self.plan.shading)
    }

    /// Whether the scene was compiled around where the camera stands, for what it sees.
    pub fn is_compiled_from_here(&self) -> bool {
        self.scene.origin == self.pose.position && self.seen == self.camera.projection(&self.pose)
    }

    /// Compiles the scene anew, around where the camera stands.
    ///
    /// # Errors
    /// A scene that does not compile. Nothing has changed then.
    pub fn compile(&mut self, shading: Shading) -> Result<()> {
        let seen = self.camera.projection(&self.pose);
        let options = options(&self.plan, shading, &self.pose, seen);
        let snapshot = snapshot_of(&self.document, &self.plan);
        let scene = RenderScene::compile(&snapshot, &options)?;
        scene.prepare();
        let camera = self.camera.clone();
        self.camera = camera.posed(&self.pose, scene.origin);
        self.scene = Arc::new(scene);
        self.seen = seen;
        Ok(())
    }

    /// Takes on another plan and pose with the scene as it was compiled. What looks at the camera
    /// (levels of detail, billboards, the width of lines) stays as it is.
    ///
    /// # Errors
    /// A lens that can't focus there. Nothing has changed then.
    pub fn aim(&mut self, plan: Plan, pose: CameraPose) -> Result<()> {
        let focus = |plan: &Plan, pose: &CameraPose| plan.focus.unwrap_or_else(|| own_focus(pose));
        let same_lens = matches!(plan.optics, Optics::Lens(_))
            && plan.optics == self.plan.optics
            && focus(&plan, &pose) == focus(&self.plan, &self.pose)
            && (plan.film, plan.aim) == (self.plan.film, self.plan.aim)
            && plan.dispersion == self.plan.dispersion
            && plan.movements == self.plan.movements;
        let fresh = if same_lens {
            self.camera.clone()
        } else {
            let (fresh, optics) = camera(&plan, &pose, &mut self.sink)?;
            self.described.extend(optics);
            fresh
        };
        self.camera = fresh.posed(&pose, self.scene.origin);
        self.described.extend(plan.describe());
        let lit = self.headlight_sources.resolve(plan.headlight);
        self.described
            .insert("headlight".into(), lit.describe().into());
        self.headlight = headlight::in_world(lit.on, self.lamp, &pose);
        (self.plan, self.pose) = (plan, pose);
        Ok(())
    }

    /// A line for the user where the headlight is on without being asked for.
    pub fn headlight_notice(&self) -> Option<&'static str> {
        let lit = self.headlight_sources.resolve(self.plan.headlight);
        let automatic = lit.on && lit.cause == HeadlightCause::Scene;
        (automatic && self.plan.shading.needs().lights).then_some(
            "headlight: on, because the scene has no light; --headlight=off turns it off",
        )
    }

    /// Exposes a film. Uses rayon's current pool.
    pub fn expose(&self, progress: &(dyn Fn(Progress) + Sync)) -> Exposure {
        self.expose_with(self.plan.sampler, self.plan.stop, progress)
    }

    /// The same with other samples.
    pub fn expose_with(
        &self,
        sampler: Sampler,
        stop: Stop,
        progress: &(dyn Fn(Progress) + Sync),
    ) -> Exposure {
        let mut exposure = Render {
            shader: &self.shader(),
            camera: &self.camera,
            sampler,
            resolution: self.plan.resolution,
            exposure: self.exposure_factor(),
            stop,
            filter: &FilterTable::new(self.plan.filter),
            adaptive: self.plan.adaptive,
        }
        .run(progress);
        let clock = Instant::now();
        exposure.film.glare = self.glare(sampler);
        exposure.seconds += clock.elapsed().as_secs_f64();
        exposure
    }

    /// What turns the plan's rays into radiance.
    pub fn shader(&self) -> Shader<'_> {
        let options = ShadeOptions {
            headlight: self.headlight,
            backward: (self.pose.orientation * DVec3::Z).as_vec3(),
            max_depth: self.max_depth(),
            ..ShadeOptions::default()
        };
        Shader::new(&self.scene, self.plan.shading, options)
    }

    /// The ghosts of the scene's lights, if they are asked for.
    fn glare(&self, sampler: Sampler) -> Option<Glare> {
        let Camera::Lens(camera) = &self.camera else {
            return None;
        };
        self.plan.ghosts.then(|| {
            let flare = Flare {
                scene: &self.scene,
                camera,
                resolution: self.plan.resolution,
                exposure: self.exposure_factor(),
                rays: sampler.samples.saturating_mul(GHOST_RAYS).min(1 << 26),
                seed: sampler.seed,
            };
            flare.expose(&self.scene.lights())
        })
    }

    /// What exposures are multiplied by.
    pub fn exposure_factor(&self) -> f64 {
        let metered = match (&self.plan.metering, &self.camera) {
            (Some(metering), Camera::Lens(camera)) => {
                metering.level_of_white(camera.axial_irradiance())
            }
            (Some(metering), Camera::Ideal(lens)) => metering.level_of_white(lens.axial_irradiance),
            _ => 1.0,
        };
        metered * self.plan.exposure
    }

    /// A ray through solid glass is bent at every surface, and may be mirrored in between.
    fn max_depth(&self) -> u32 {
        let usual = match self.camera {
            Camera::Film(_) => 64,
            _ => ShadeOptions::default().max_depth,
        };
        self.plan.max_depth.unwrap_or(usual)
    }

    /// The film with diffraction, where the plan has it and there is a pupil.
    fn left_by_waves<'a>(&self, film: &'a Film) -> Cow<'a, Film> {
        match &self.camera {
            Camera::Lens(camera) if self.plan.diffraction => Cow::Owned(diffract(film, camera)),
            _ => Cow::Borrowed(film),
        }
    }

    /// The picture of an exposure, with how it was made.
    pub fn develop(&self, exposure: &Exposure, command: &str) -> Picture {
        let film = self.left_by_waves(&exposure.film);
        let mut picture = Picture::develop(&film, self.plan.response.clone());
        let mut say = |key: &str, value: &str| {
            picture.provenance.insert(key.to_owned(), value.to_owned());
        };
        say("Software", concat!("ivcam ", env!("CARGO_PKG_VERSION")));
        say("Command", command);
        self.described
            .iter()
            .for_each(|(k, v)| say(&format!("ivcam:{k}"), v));
        picture
    }

    /// The account of an exposure, but for the picture's name and the time to write it.
    pub fn report(&self, exposure: &Exposure) -> RenderReport {
        let mut seconds = self.seconds;
        seconds.render = exposure.seconds;
        let (triangles, quadrics, strokes) = self.scene.primitives();
        let mut report = RenderReport {
            ivcam: env!("CARGO_PKG_VERSION"),
            scene: self.plan.scene.display().to_string(),
            picture: String::new(),
            plan: self.described.clone(),
            seconds,
            total_seconds: 0.0,
            samples: exposure.samples,
            film_rays: 0,
            scene_rays: 0,
            shadow_rays: 0,
            error_rays: 0,
            passed_share: 0.0,
            relative_rmse: None,
            relative_rmse_low: None,
            relative_rmse_high: None,
            ghosts_of_picture: None,
            ghosts_of_lights: None,
            primitives: (triangles + quadrics + strokes) as u64,
            left_out: self.left_out(),
        };
        report.set_counts(&exposure.counts);
        report.set_error(exposure.film.error());
        report.set_glare(&exposure.film);
        report
    }

    /// What the picture did not need.
    fn left_out(&self) -> Vec<String> {
        let mut out = self.scene.census().left_out();
        let mut leave = |what: &str, why: &str| out.push(format!("{what} ({why})"));
        if self.plan.optics == Optics::Pinhole {
            leave("lens and pupil", "pinhole");
        }
        if let Camera::Lens(camera) = &self.camera
            && !camera.is_dispersing()
        {
            let asked = self.plan.dispersion;
            leave(
                "wavelengths",
                if asked {
                    "glass of one index"
                } else {
                    "dispersion off"
                },
            );
        }
        if !self.plan.shading.needs().secondary {
            leave("secondary rays", "shading");
        }
        out
    }
}

/// Whether nothing lights the scene, and nobody asked for that.
fn is_left_dark(sources: HeadlightSources, lit: HeadlightState) -> bool {
    !lit.on && !sources.scene_has_light && lit.cause != HeadlightCause::Option
}

/// What looks at the camera (levels of detail, lines, how finely textures are read) sees it with
/// its lens: not with the angle that its node has for a pinhole.
fn options(plan: &Plan, shading: Shading, pose: &CameraPose, seen: Projection) -> CompileOptions {
    CompileOptions {
        origin: pose.position,
        camera: Some(CameraPose {
            projection: seen,
            ..pose.clone()
        }),
        needs: shading.needs(),
        pixel_rows: plan.resolution.height,
        texture_folders: plan.search.clone(),
        fonts: plan.fonts.clone(),
        max_primitives: plan.limits.primitives,
        max_visits: plan.limits.visits as u64,
        ..CompileOptions::default()
    }
}

/// The document at the plan's time.
fn snapshot_of<'a>(document: &'a Document, plan: &Plan) -> Snapshot<'a> {
    let at = SnapshotOptions {
        time: plan.time,
        handles: plan.handles,
    };
    let options = CompileOptions {
        fonts: plan.fonts.clone(),
        max_primitives: plan.limits.primitives,
        max_visits: plan.limits.visits as u64,
        ..CompileOptions::default()
    };
    snapshot(document, &at, &options)
}

/// Puts the lens into the scene as solids where the camera stands, and a film behind it, which is
/// the camera then.
fn lens_into_scene(
    plan: &Plan,
    pose: &CameraPose,
    document: &mut Document,
    sink: &mut Sink,
) -> Result<()> {
    let Optics::Lens(choice) = &plan.optics else {
        return Err(Diagnostic::error("there is no lens to put into the scene")
            .with_help("leave out `--lens none`, or `--solids`"));
    };
    if plan.movements != Movements::default() {
        return Err(Diagnostic::error(
            "a film that is moved or bent can't be used with `--solids`",
        )
        .with_help("leave out `--tilt`, `--swing`, `--rise`, `--shift` and `--film-radius`"));
    }
    let distance = plan.focus.unwrap_or_else(|| own_focus(pose));
    let (lens, focus) = choice.open_focused(distance, sink)?;
    let text = lens_in_scene(&lens, &film_plane(&lens, focus.film_z), Some(pose))?;
    let roots = document.read_more("the lens", text.into_bytes())?;
    // In front of the scene, so that its film is the first camera.
    document.roots.splice(..0, roots);
    Ok(())
}

/// The name of a scene's picture where none is given: the scene's with `.png`, in the current
/// folder. Where the 1999 program put it is unknown.
pub fn picture_name(scene: &Path) -> PathBuf {
    let name = scene.file_name().unwrap_or_default().to_string_lossy();
    let stem = name.trim_end_matches(".gz");
    let stem = stem.rsplit_once('.').map_or(stem, |(stem, _)| stem);
    if stem.is_empty() {
        return "picture.png".into();
    }
    PathBuf::from(stem).with_extension("png")
}

/// The line that was typed, quoted where a shell would need it.
pub fn command_line<W: AsRef<OsStr>>(words: &[W]) -> String {
    let quote = |w: &W| {
        let w = w.as_ref().to_string_lossy();
        let plain = |c: char| c.is_ascii_alphanumeric() || "-_./=:,+@".contains(c);
        if !w.is_empty() && w.chars().all(plain) {
            w.into_owned()
        } else {
            format!("'{}'", w.replace('\'', "'\\''"))
        }
    };
    let rest = words.iter().skip(1).map(quote);
    std::iter::once("ivcam".to_owned())
        .chain(rest)
        .collect::<Vec<_>>()
        .join(" ")
}

#[cfg(test)]
mod tests {
    use super::*;

    const SCENE: &str = "#Inventor V2.1 ascii\nPerspectiveCamera { position 0 0 4 }\n\
        PointLight { location 2 3 4 }\nSphere { }\nTranslation { translation 1.5 .4 .5 } Cube { }\n";

    fn plan(folder: &Path) -> Plan {
        std::fs::create_dir_all(folder).expect("a folder for the scene");
        let scene = folder.join("scene.iv");
        std::fs::write(&scene, SCENE).expect("the scene can be written");
        let mut plan = Plan::of_era(Era::Modern, scene);
        plan.resolution = Resolution {
            width: 36,
            height: 24,
        };
        plan.focus = Some(Meters(3.0));
        plan
    }

    /// The scene is compiled in floats around its camera, so a camera a meter off sees it with
    /// other roundings: the same picture to a part in ten thousand, but for rays at an edge.
    #[test]
    fn a_camera_that_is_only_aimed_sees_what_it_sees_after_compiling() {
        let folder = std::env::temp_dir().join(format!("ivcam-plan-{}", std::process::id()));
        let mut session = Session::open(plan(&folder)).expect("the scene is whole");
        let mut pose = session.pose.clone();
        pose.position += DVec3::new(1.0, 0.2, -0.1);
        pose.orientation = glam::DQuat::from_rotation_y(0.2);
        let plan = session.plan.clone();
        session.aim(plan.clone(), pose.clone()).unwrap();
        let aimed = session.expose(&|_| ()).film;
        session.change(plan, pose.clone()).unwrap();
        assert_eq!(session.scene.origin, pose.position);
        let compiled = session.expose(&|_| ()).film;
        let apart = |(a, b): (&crate::film::Exposed, &crate::film::Exposed)| {
            (a.mean - b.mean).abs().max_element() > 1e-4
        };
        let off = aimed
            .pixels
            .iter()
            .zip(&compiled.pixels)
            .filter(|p| apart(*p));
        assert!(off.count() < 8);
        assert!(compiled.mean() > 0.01);
        std::fs::remove_dir_all(folder).unwrap();
    }

    /// Textures and lines are as fine as the lens makes them, also where it stands as solids.
    #[test]
    fn the_scene_is_compiled_for_what_the_lens_sees() {
        let folder = std::env::temp_dir().join(format!("ivcam-seen-{}", std::process::id()));
        let mut session = Session::open(plan(&folder)).expect("the scene is whole");
        let tangent = |session: &Session| match session.seen {
            Projection::Perspective { height_angle } => libm::tan(0.5 * height_angle),
            Projection::Orthographic { .. } => f64::NAN,
        };
        let Camera::Lens(lens) = &session.camera else {
            panic!("the plan has a lens")
        };
        let sees = 12.0 / lens.focus.image_distance;
        assert!((tangent(&session) / sees - 1.0).abs() < 1e-12);

        let mut solid = session.plan.clone();
        solid.solids = true;
        let solid = Session::open(solid).expect("its surfaces are spheres");
        // The angle goes through a file, as a float.
        assert!((tangent(&solid) / sees - 1.0).abs() < 1e-6);

        let mut nearer = session.plan.clone();
        nearer.focus = Some(Meters(0.8));
        let pose = session.pose.clone();
        session.change(nearer, pose).unwrap();
        assert!(session.is_compiled_from_here());
        assert!(tangent(&session) < sees);
        std::fs::remove_dir_all(folder).unwrap();
    }

    #[test]
    fn a_camera_may_be_given_as_the_node_itself() {
        let pose = camera_of_file(Path::new("PerspectiveCamera { position 1 2 3.5 }")).unwrap();
        assert_eq!(pose.position, DVec3::new(1.0, 2.0, 3.5));
        assert!(camera_of_file(Path::new("Cube { }")).is_err());
    }
}
