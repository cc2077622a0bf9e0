//! The plan: all choices of a photograph.

use std::path::{Path, PathBuf};
use std::sync::Arc;

use glam::Vec3;
use ivcam_base::diag::{Result, Sink};
use ivcam_base::math::{Meters, Mm};
use ivcam_base::memory::MemoryLimit;
use ivcam_base::work::WorkLimit;
use ivcam_inventor::events::Action;
use ivcam_inventor::iv::Limits;
use ivcam_inventor::pose::ViewDirection;
use ivcam_optics::film::{FilmFormat, Metering, Region, Resolution, Response};
use ivcam_optics::lens::{
    Coating, Focus, FocusMethod, Gap, Iris, Lens, Movements, Reading, at_zoom_list,
    open_prescription,
};
use ivcam_optics::picture::Depth;
use ivcam_optics::prescription::glass::D_LINE;
use ivcam_optics::sampling::{DiscMap, Filter, Sampler, SamplerKind};
use ivcam_render::camera::Aim;
use ivcam_render::geometry::text::Fonts;
use ivcam_render::render::Stop;
use ivcam_render::scene::{ColorCoding, TextureFilter};
use ivcam_render::shade::Shading;

use super::camera_choice::CameraChoice;
use super::headlight::Headlight;
use super::layer_choice::FurtherLayers;
use super::light_plan::LightPlan;
use super::view::{Override, WholeView};

/// The set of defaults that a plan starts from.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Era {
    /// The defaults of the 1999 program (`docs/vintage.md`).
    Vintage,
    /// ivcam's own defaults.
    Modern,
}

impl Era {
    /// The names that the option `--era` accepts.
    pub const NAMES: [(&'static str, Self); 3] = [
        ("1999", Self::Vintage),
        ("vintage", Self::Vintage),
        ("modern", Self::Modern),
    ];

    /// Returns the name of the era.
    pub fn name(self) -> &'static str {
        match self {
            Self::Vintage => "1999",
            Self::Modern => "modern",
        }
    }
}

/// Choices that together give a picture a known look. Options go before them.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum PictureLook {
    /// What a viewer of the 1990s drew, such as SceneViewer or a browser of VRML.
    Viewer,
}

impl PictureLook {
    /// The names that the option `--look` accepts.
    pub(crate) const NAMES: [(&'static str, Self); 1] = [("viewer", Self::Viewer)];

    /// Makes the choices in a plan.
    pub(crate) fn choose(self, plan: &mut Plan) {
        match self {
            Self::Viewer => {
                plan.optics = Optics::Pinhole;
                plan.shading = Shading::Gl;
                plan.headlight = Headlight::Viewer;
                plan.view = Some(Override::IfUnstated(WholeView::Standard));
                (plan.sampler, plan.stop.samples) = (SamplerKind::Center, 1);
            }
        }
    }
}

/// The optics in front of the film.
#[derive(Clone, Debug, PartialEq)]
pub enum Optics {
    /// The scene's own camera as a pinhole.
    Pinhole,
    /// A thin lens without aberrations.
    Ideal(IdealChoice),
    /// A lens with a prescription.
    Lens(LensChoice),
}

/// A thin lens without aberrations.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct IdealChoice {
    /// The focal length.
    pub efl: Mm,
    /// The f-number.
    pub f_number: f64,
}

impl Default for IdealChoice {
    /// Returns a lens of 50 mm f/2.
    fn default() -> Self {
        Self {
            efl: Mm(50.0),
            f_number: 2.0,
        }
    }
}

/// The wavelength at which a lens has the focal length and the f-number that are asked for.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
#[non_exhaustive]
pub enum LensWavelength {
    /// The d line, as for photographs.
    #[default]
    D,
    /// The primary wavelength that its file states, or else the d line.
    Primary,
    /// A wavelength in nanometers.
    Nm(f64),
}

/// A lens with a prescription, and the changes to it.
///
/// [`LensChoice::open`] sets the zoom position first, then scales to `efl`, scales by `zoom`, and
/// stops down to `f_number`.
#[derive(Clone, Debug, PartialEq)]
pub struct LensChoice {
    /// The name of a shipped lens, or the path of a file.
    pub name: String,
    /// The focal length to scale the lens to. Default: no scaling.
    pub efl: Option<Mm>,
    /// A factor to scale the lens by, from the size that it has at 1. Default: 1.
    pub zoom: f64,
    /// Whether a lens keeps the lengths of its file, as in 1999, though the file states a nominal
    /// focal length. Default: no.
    pub as_published: bool,
    /// A tabulated position of a zoom lens, counted from 0. Default: the first.
    pub zoom_position: Option<usize>,
    /// The f-number to stop down to. Default: full aperture.
    pub f_number: Option<f64>,
    /// The wavelength of `efl` and `f_number`. Default: the d line.
    pub wavelength: LensWavelength,
    /// The shape of the aperture stop. Default: round.
    pub iris: Iris,
    /// The coating of all surfaces. Default: that of the prescription.
    pub coating: Option<Coating>,
    /// The part that moves for focusing. Default: the film.
    pub method: FocusMethod,
    /// Glass catalogues (`.agf` files) that are searched in addition to the built-in one.
    pub catalogues: Vec<PathBuf>,
    /// The meaning of the second column of a table; none leaves it to the file's evidence.
    pub gap: Option<Gap>,
}

impl LensChoice {
    /// Creates a choice of a lens without changes.
    pub fn named(name: impl Into<String>) -> Self {
        Self {
            name: name.into(),
            efl: None,
            zoom: 1.0,
            as_published: false,
            zoom_position: None,
            f_number: None,
            wavelength: LensWavelength::D,
            iris: Iris::Round,
            coating: None,
            method: FocusMethod::Film,
            catalogues: Vec::new(),
            gap: None,
        }
    }

    /// Creates a choice of a lens without changes, of the size that it has in an era.
    pub(crate) fn of_era(era: Era, name: impl Into<String>) -> Self {
        Self {
            as_published: era == Era::Vintage,
            ..Self::named(name)
        }
    }

    /// Opens the lens and applies the changes.
    ///
    /// # Errors
    /// Returns an error if the lens cannot be read, or if a change is impossible.
    pub fn open(&self, sink: &mut Sink) -> Result<Lens> {
        self.open_as(Reading::default(), sink)
    }

    /// Opens the lens as [`LensChoice::open`] does, with options for reading its file.
    ///
    /// # Errors
    /// Returns the errors of [`LensChoice::open`].
    pub fn open_as(&self, reading: Reading, sink: &mut Sink) -> Result<Lens> {
        let mut reading = self.completed(reading)?;
        // A lens is scaled to `efl` from the lengths of its file, so that they are rounded once.
        reading.as_published |= self.as_published || self.efl.is_some();
        let mut lens = open_prescription(&self.name, &reading, sink)?;
        if let Some(position) = self.zoom_position {
            lens = lens
                .at_zoom(position)
                .map_err(|e| at_zoom_list(e, &self.name))?;
        }
        let primary = lens.wavelengths_nm.first();
        let nm = match self.wavelength {
            LensWavelength::D => D_LINE,
            LensWavelength::Primary => *primary.unwrap_or(&D_LINE),
            LensWavelength::Nm(nm) => nm,
        };
        if let Some(length) = self.efl {
            lens = lens.scaled_to(length, nm)?;
        }
        if self.zoom != 1.0 {
            lens = lens.scaled(self.zoom);
        }
        if let Some(coating) = self.coating {
            lens = lens.with_coating(coating);
        }
        let mut lens = Lens::new(lens);
        if let Some(n) = self.f_number {
            lens = lens.at_wavelength(nm).at_f_number(n)?.at_wavelength(D_LINE);
        }
        if self.iris != Iris::Round {
            lens = lens.with_iris(self.iris.clone());
        }
        Ok(lens)
    }

    /// Returns the options for reading lens files, with the catalogues of this choice.
    ///
    /// # Errors
    /// Returns an error if a catalogue cannot be read.
    pub(crate) fn reading(&self) -> Result<Reading> {
        self.completed(Reading::default())
    }

    fn completed(&self, mut reading: Reading) -> Result<Reading> {
        for file in &self.catalogues {
            reading.glasses.add_file(file)?;
        }
        reading.gap = self.gap.or(reading.gap);
        Ok(reading)
    }

    /// Opens the lens and focuses it at a distance. Returns it with the position of the film.
    ///
    /// # Errors
    /// Returns an error if the lens cannot be opened or cannot focus at the distance.
    pub fn open_focused(&self, distance: Meters, sink: &mut Sink) -> Result<(Lens, Focus)> {
        let lens = self.open(sink)?;
        lens.focused(self.method, distance)
            .map_err(|f| f.diagnostic(lens.name()))
    }
}

/// The largest number of samples per pixel if the error or the time ends a render. It only prevents
/// endless renders: 65,536 samples take hours for any picture.
pub(crate) const SAMPLE_LIMIT: u32 = 65_536;

/// All choices of a photograph.
#[derive(Clone, Debug, PartialEq)]
pub struct Plan {
    /// The set of defaults that the plan started from.
    pub era: Era,
    /// The path of the scene file.
    pub scene: PathBuf,
    /// The camera. Default: the environment's camera, or else the scene's first camera, or else a
    /// view of the whole scene.
    pub camera: Option<CameraChoice>,
    /// The side from which the whole scene is seen. Default: the scene's camera, and without one
    /// the front, or the side that shows most if the front shows next to nothing.
    pub view: Option<Override<WholeView>>,
    /// The color of what rays without a hit see. Default: the scene's `Background`, or else black.
    pub background: Option<Override<Vec3>>,
    /// The path of a SceneViewer environment file.
    pub environment: Option<PathBuf>,
    /// The optics in front of the film.
    pub optics: Optics,
    /// The distance in focus, from the camera. Default: the scene camera's `focalDistance`.
    pub focus: Option<Meters>,
    /// The shading model.
    pub shading: Shading,
    /// The setting of the headlight.
    pub headlight: Headlight,
    /// The least fraction of light, from 0 to 1, that a surface reflects for it to be a mirror.
    /// `None` makes no surface a mirror. The 1999 program: 0, every surface with highlights.
    /// Default: `None`.
    pub mirrors: Option<f32>,
    /// How textures are filtered. Default: as the scene asks.
    pub texture_filter: Option<TextureFilter>,
    /// The choices of model `i`.
    pub light: LightPlan,
    /// Whether what is not seen casts shadows: culled faces, and everything in the light of the
    /// headlight. The 1999 program: yes (a guess). Default: no.
    pub unseen_shadows: bool,
    /// The distribution of a pixel's samples. Their number is `stop.samples`.
    pub sampler: SamplerKind,
    /// The seed of all random numbers.
    pub seed: u64,
    /// The pixel filter, which weights the light around a pixel's center.
    pub filter: Filter,
    /// Whether most samples are taken where a first pass finds noise.
    pub adaptive: bool,
    /// The region of the lens that rays from the film aim at.
    pub aim: Aim,
    /// Whether the dispersion of glass is simulated. The 1999 program: no. Default: yes.
    pub dispersion: bool,
    /// The size of the film.
    pub film: FilmFormat,
    /// The radial distortion of a pinhole: k₁ and k₂ of OpenCV's camera model. Lenses ignore it.
    pub distortion: [f64; 2],
    /// The movements of the lens against the film. A pinhole ignores them.
    pub movements: Movements,
    /// The size of the picture in pixels.
    pub resolution: Resolution,
    /// The part of the picture that is rendered and written. Default: the whole picture.
    pub region: Option<Region>,
    /// A factor of the exposure. At 1 a white surface on the axis renders as white.
    pub exposure: f64,
    /// Whether the exposure is metered through the lens. `exposure` multiplies the result.
    pub meters: bool,
    /// Shutter and ISO, which replace the paper's constant. `exposure` multiplies their result.
    pub metering: Option<Metering>,
    /// Whether ghosts of the scene's lights (two reflections inside the lens) are added. Default:
    /// no.
    pub ghosts: bool,
    /// Whether the diffraction of the pupil spreads the light on the film.
    pub diffraction: bool,
    /// The conversion from exposure to levels.
    pub response: Response,
    /// The number of bits per channel in PNG and PPM files.
    pub depth: Depth,
    /// The largest number of successive reflections and refractions. Default: 5, or 64 with
    /// `solids`.
    pub max_depth: Option<u32>,
    /// Whether the lens is part of the scene as solids with the film behind it, which is the
    /// paper's first approach.
    pub solids: bool,
    /// The time of the scene's engines and sensors, in seconds.
    pub time: f64,
    /// What a user does with the scene before that time.
    pub actions: Vec<Action>,
    /// Other times at which all of a scene without a camera has to be in the picture: those of the
    /// frames of a movie.
    pub(crate) framed_over: Vec<f64>,
    /// Whether the handles of draggers and manipulators are drawn. Default: no.
    pub handles: bool,
    /// The conditions that end a render.
    pub stop: Stop,
    /// Folders that are searched for files of the scene, in addition to the scene's own folder.
    pub search: Vec<PathBuf>,
    /// The folder below which the scene's files must be. Default: the folder of its project, see
    /// [`FolderLoader::new`](ivcam_inventor::iv::FolderLoader::new).
    pub contain: Option<PathBuf>,
    /// Typefaces that are preferred to the shipped ones. Default: none.
    pub fonts: Arc<Fonts>,
    /// Limits on the size of the scene.
    pub limits: Limits,
    /// How much memory the scene, its textures and its film may use. Default: half of what the
    /// machine has.
    pub memory: MemoryLimit,
    /// How many steps of work the scene may cause. Default: [`WorkLimit::default`].
    pub work: WorkLimit,
    /// What needs the whole film in memory at once, besides options of the plan. If it is `None`, a
    /// film that does not fit is rendered in strips.
    pub whole_film: Option<&'static str>,
    /// The layers that the session can make besides those of [`Session::layers`].
    ///
    /// [`Session::layers`]: super::Session::layers
    pub layers: FurtherLayers,
}

impl Plan {
    /// Returns the response of a film unless the plan states another. Model `i` computes with
    /// light, so colors of a display show as themselves by the display's curve.
    pub(crate) fn usual_response(&self) -> Response {
        match self.shading == Shading::Path && self.light.colors == ColorCoding::Display {
            true => Response::Srgb,
            false => Response::Linear,
        }
    }

    /// Puts the scene on paper under the lamps of a studio, or takes these away. A scene without a
    /// camera is seen from three quarters there, unless a side is stated.
    pub(crate) fn set_studio(&mut self, on: bool) {
        let side = Override::IfUnstated(WholeView::Side(ViewDirection::THREE_QUARTER));
        self.light.studio = on;
        self.view = match on {
            true => self.view.or(Some(side)),
            false => self.view.filter(|view| *view != side),
        };
    }

    /// Returns the lens, if it has a prescription.
    pub(crate) fn lens(&self) -> Option<&LensChoice> {
        match &self.optics {
            Optics::Lens(choice) => Some(choice),
            Optics::Pinhole | Optics::Ideal(_) => None,
        }
    }

    /// Returns the lens for changes, if it has a prescription.
    pub(crate) fn lens_mut(&mut self) -> Option<&mut LensChoice> {
        match &mut self.optics {
            Optics::Lens(choice) => Some(choice),
            Optics::Pinhole | Optics::Ideal(_) => None,
        }
    }

    /// Creates a plan with the defaults of an era. This is the only function in which the eras
    /// differ.
    pub fn of_era(era: Era, scene: impl Into<PathBuf>) -> Self {
        let samples = usual_samples(era);
        let (sampler, aim, headlight) = match era {
            Era::Vintage => (
                SamplerKind::Jittered,
                Aim::RearElement(DiscMap::Polar),
                Headlight::Environment,
            ),
            Era::Modern => (SamplerKind::Sobol, Aim::ExitPupil, Headlight::Automatic),
        };
        Self {
            era,
            scene: scene.into(),
            camera: None,
            view: None,
            background: None,
            environment: None,
            optics: Optics::Lens(LensChoice::of_era(era, "wide-angle")),
            focus: None,
            shading: Shading::Recursive,
            headlight,
            mirrors: (era == Era::Vintage).then_some(0.0),
            texture_filter: None,
            light: LightPlan::default(),
            unseen_shadows: era == Era::Vintage,
            sampler,
            seed: 0,
            filter: Filter::Box,
            adaptive: false,
            aim,
            dispersion: era == Era::Modern,
            film: FilmFormat::STANDARD,
            distortion: [0.0; 2],
            movements: Movements::default(),
            resolution: Resolution::VINTAGE,
            region: None,
            exposure: 1.0,
            meters: false,
            metering: None,
            ghosts: false,
            diffraction: false,
            response: Response::Linear,
            depth: Depth::Eight,
            max_depth: None,
            solids: false,
            time: 0.0,
            actions: Vec::new(),
            framed_over: Vec::new(),
            handles: false,
            stop: Stop::after(samples),
            search: Vec::new(),
            contain: None,
            fonts: Arc::default(),
            limits: Limits::default(),
            memory: MemoryLimit::default(),
            work: WorkLimit::default(),
            whole_film: Some("this command"),
            layers: FurtherLayers::default(),
        }
    }

    /// Returns the sampler of the picture's pixels. It is laid out for `stop.samples`, or for the
    /// era's usual number if only the error or the time ends the render.
    pub fn pixel_sampler(&self) -> Sampler {
        let samples = match self.stop.samples {
            SAMPLE_LIMIT => usual_samples(self.era),
            samples => samples,
        };
        Sampler::new(self.sampler, samples, self.seed)
    }

    /// Creates the plan that the window starts from. The window refines its picture continuously,
    /// so the number of samples and the aim are those of [`Era::Modern`].
    #[cfg(any(feature = "viewer", all(test, feature = "panels")))]
    pub(crate) fn for_window(era: Era, scene: impl Into<PathBuf>) -> Self {
        let modern = Self::of_era(Era::Modern, "");
        let mut plan = Self::of_era(era, scene);
        plan.aim = modern.aim;
        plan.stop = modern.stop;
        plan
    }
}

/// Returns an era's number of samples per pixel.
fn usual_samples(era: Era) -> u32 {
    match era {
        Era::Vintage => 1,
        Era::Modern => 16,
    }
}

/// Returns the default name of a scene's picture: the scene's name with `.png`, in the current
/// folder. The rule of the 1999 program is unknown.
pub fn picture_name(scene: &Path) -> PathBuf {
    let name = scene.file_name().unwrap_or_default().to_string_lossy();
    let stem = name.trim_end_matches(".gz");
    let stem = stem.rsplit_once('.').map_or(stem, |(stem, _)| stem);
    if stem.is_empty() || stem == "-" {
        return "picture.png".into();
    }
    PathBuf::from(stem).with_extension("png")
}

/// Returns the first of `name.png`, `name-2.png`, `name-3.png`, … that is not taken.
pub(crate) fn free_name(path: &Path, mut taken: impl FnMut(&Path) -> bool) -> PathBuf {
    let stem = path.file_stem().unwrap_or_default().to_string_lossy();
    let end = path.extension().unwrap_or_default().to_string_lossy();
    let numbered = (2..).map(|n: u32| path.with_file_name(format!("{stem}-{n}.{end}")));
    std::iter::once(path.to_owned())
        .chain(numbered)
        .find(|path| !taken(path))
        .unwrap_or_else(|| path.to_owned())
}
