//! Every choice of a photograph.

use std::path::{Path, PathBuf};
use std::sync::Arc;

use super::camera_choice::CameraChoice;
use super::headlight::Headlight;
use crate::camera::Aim;
use crate::diag::{Result, Sink};
use crate::film::{FilmFormat, Metering, Resolution, Response};
use crate::geometry::text::Fonts;
use crate::iv::Limits;
use crate::lens::{
    Coating, Focus, FocusMethod, Iris, Lens, Movements, Reading, at_zoom_list, open_prescription,
};
use crate::math::{Meters, Mm};
use crate::picture::Depth;
use crate::prescription::glass::D_LINE;
use crate::render::Stop;
use crate::sampling::{DiscMap, Filter, Sampler, SamplerKind};
use crate::shade::Shading;

/// Whose choices a plan starts from.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Era {
    /// The 1999 program (`docs/vintage.md`).
    Vintage,
    Modern,
}

impl Era {
    /// The words for an era.
    pub const NAMES: [(&'static str, Self); 3] = [
        ("1999", Self::Vintage),
        ("vintage", Self::Vintage),
        ("modern", Self::Modern),
    ];

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
    ///
    /// # Errors
    /// A lens that can't be read, or can't be changed so.
    pub fn open(&self, sink: &mut Sink) -> Result<Lens> {
        self.open_as(Reading::default(), sink)
    }

    /// Opens the lens like [`LensChoice::open`], with given glasses and a given form of its file.
    ///
    /// # Errors
    /// Returns the errors of [`LensChoice::open`].
    pub fn open_as(&self, mut reading: Reading, sink: &mut Sink) -> Result<Lens> {
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
    /// Default: the environment's camera, else the scene's own, else a view of everything.
    pub camera: Option<CameraChoice>,
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
    pub(crate) fonts: Arc<Fonts>,
    /// How much the scene may ask for.
    pub limits: Limits,
}

impl Plan {
    /// The lens, if it has a prescription.
    pub(crate) fn lens(&self) -> Option<&LensChoice> {
        match &self.optics {
            Optics::Lens(choice) => Some(choice),
            Optics::Pinhole | Optics::Ideal(_) => None,
        }
    }

    pub(crate) fn lens_mut(&mut self) -> Option<&mut LensChoice> {
        match &mut self.optics {
            Optics::Lens(choice) => Some(choice),
            Optics::Pinhole | Optics::Ideal(_) => None,
        }
    }

    /// The one place where 1999 and today differ.
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
    #[cfg(any(feature = "viewer", all(test, feature = "panels")))]
    pub(crate) fn for_window(era: Era, scene: impl Into<PathBuf>) -> Self {
        let modern = Self::of_era(Era::Modern, "");
        let mut plan = Self::of_era(era, scene);
        plan.aim = modern.aim;
        plan.sampler.samples = modern.sampler.samples;
        plan.stop = modern.stop;
        plan
    }
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
