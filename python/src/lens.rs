//! Lenses: rays in arrays, spots, light on the film, and what `ivcam lens` prints.

use ivcam::cli::lens_output;
use ivcam::diag::{Severity, Sink};
use ivcam::glam::{DVec2, DVec3};
use ivcam::lens::{
    FieldPoint, Focus, LensRay, Loss, LossKind, Plane, PointSpreads, SheetSetting, Toward,
    shipped_names,
};
use ivcam::photo::LensChoice;
use ivcam_optics::diagram::{LensDiagram, SectionOptions, white_light};
use ivcam_optics::prescription::formats::write::{Target, write};
use numpy::{PyArray1, PyArrayMethods, PyReadonlyArray1, PyReadonlyArray2};
use pyo3::exceptions::PyValueError;
use pyo3::prelude::*;
use pyo3::types::{PyDict, PyList};

use crate::calls::{on_pool, on_this_thread};
use crate::errors::{OrRaise, records};
use crate::options::Keywords;
use crate::values::rows;

/// The rays that are traced together, so that they stay in the cache between the steps.
const BLOCK: usize = 4096;

/// A ray, and how it left the lens.
#[derive(Clone, Copy)]
struct RayOutcome {
    origin: [f64; 3],
    direction: [f64; 3],
    code: u8,
    surface: i32,
}

impl RayOutcome {
    const LOST: [f64; 3] = [f64::NAN; 3];

    fn of(result: std::result::Result<LensRay, Loss>) -> Self {
        match result {
            Ok(ray) => Self {
                origin: ray.origin.to_array(),
                direction: ray.direction.to_array(),
                code: 0,
                surface: -1,
            },
            Err(loss) => Self {
                origin: Self::LOST,
                direction: Self::LOST,
                code: match loss.kind {
                    LossKind::Missed => 1,
                    LossKind::Blocked => 2,
                    LossKind::TotalReflection => 3,
                },
                surface: i32::try_from(loss.surface).unwrap_or(i32::MAX),
            },
        }
    }
}

/// A lens, focused if it has a distance.
#[pyclass(frozen, module = "ivcam._ivcam", name = "Lens")]
pub(crate) struct PyLens {
    lens: ivcam::Lens,
    /// The lens before it was focused.
    unfocused: ivcam::Lens,
    focus: Option<Focus>,
    name: String,
    /// The options as words of a command line.
    words: Vec<String>,
    sink: Sink,
}

impl PyLens {
    fn setting(&self) -> SheetSetting<'_> {
        SheetSetting {
            unfocused: Some(&self.unfocused),
            focus: self.focus.as_ref(),
            ..SheetSetting::default()
        }
    }
}

type Traced<'py> = (
    Bound<'py, PyAny>,
    Bound<'py, PyAny>,
    Bound<'py, PyArray1<u8>>,
    Bound<'py, PyArray1<i32>>,
);

#[pymethods]
impl PyLens {
    #[new]
    fn new(
        py: Python<'_>,
        name: String,
        options: &Bound<'_, PyDict>,
        wavelength: Option<f64>,
    ) -> PyResult<Self> {
        let known: Vec<_> = ivcam::photo::options::lens_options().collect();
        let Keywords { given, mut words } = Keywords::read("Lens", options, &known)?;
        let mut sink = Sink::new();
        let opened = on_pool(py, || {
            let (choice, distance) = LensChoice::from_options(&name, &given, &mut sink)?;
            let mut unfocused = choice.open(&mut sink)?;
            if let Some(nm) = wavelength {
                unfocused = unfocused.at_wavelength(nm);
            }
            let Some(distance) = distance else {
                return Ok((unfocused.clone(), unfocused, None));
            };
            let focused = unfocused.focused(choice.method, distance);
            let (lens, focus) = focused.map_err(|fault| fault.diagnostic(unfocused.name()))?;
            Ok((lens, unfocused, Some(focus)))
        })?;
        let (lens, unfocused, focus) = opened.or_raise(py)?;
        words.extend(wavelength.map(|nm| format!("--wavelength={nm}")));
        Ok(Self {
            lens,
            unfocused,
            focus,
            name,
            words,
            sink,
        })
    }

    #[getter]
    fn name(&self) -> &str {
        self.lens.name()
    }

    #[getter]
    fn wavelength(&self) -> f64 {
        self.lens.wavelength()
    }

    /// The z of the film in millimeters: at the focus, or at the focal point without a distance.
    #[getter]
    fn film_z(&self) -> Option<f64> {
        let at_infinity = || self.lens.first_order().focal.map(|f| f.rear_focal_point);
        self.focus.map(|f| f.film_z).or_else(at_infinity)
    }

    fn problems<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyList>> {
        let warnings = self.sink.items().iter();
        records(py, warnings.filter(|d| d.severity >= Severity::Warning))
    }

    /// Returns what `ivcam lens` prints for this lens with more arguments, and its warnings.
    fn output(&self, py: Python<'_>, words: Vec<String>) -> PyResult<(String, Vec<String>)> {
        let name = ["--".to_owned(), self.name.clone()];
        let words: Vec<String> = self
            .words
            .iter()
            .cloned()
            .chain(words)
            .chain(name)
            .collect();
        let output = on_pool(py, || lens_output(&words))?.or_raise(py)?;
        Ok((output.text, output.messages))
    }

    /// Traces rays. The arrays have rows of three and the same length, which the caller checks.
    fn trace<'py>(
        &self,
        py: Python<'py>,
        origins: PyReadonlyArray2<'py, f64>,
        directions: PyReadonlyArray2<'py, f64>,
        wavelength: Option<f64>,
        to_scene: bool,
        threads: usize,
    ) -> PyResult<Traced<'py>> {
        let (from, along) = (origins.as_slice()?, directions.as_slice()?);
        if from.len() != along.len() || from.len() % 3 != 0 {
            return Err(PyValueError::new_err(
                "origins and directions differ in length",
            ));
        }
        let toward = if to_scene {
            Toward::Scene
        } else {
            Toward::Film
        };
        let lens = wavelength.map(|nm| self.lens.at_wavelength(nm));
        let lens = lens.as_ref().unwrap_or(&self.lens);
        let (all, _) = from.as_chunks::<3>();
        let (ways, _) = along.as_chunks::<3>();
        let mut origin = vec![RayOutcome::LOST; all.len()];
        let mut direction = vec![RayOutcome::LOST; all.len()];
        let (mut code, mut surface) = (vec![0_u8; all.len()], vec![0_i32; all.len()]);
        on_this_thread(py, || {
            let share = all.len().div_ceil(threads.max(1)).max(1);
            let parts = origin
                .chunks_mut(share)
                .zip(direction.chunks_mut(share))
                .zip(code.chunks_mut(share).zip(surface.chunks_mut(share)));
            let rays = all.chunks(share).zip(ways.chunks(share));
            std::thread::scope(|scope| {
                for (i, (rays, ((o, d), (c, s)))) in rays.zip(parts).enumerate() {
                    let mut work = move || trace_part(lens, toward, rays, (o, d, c, s));
                    // The last part is this thread's own, so one thread starts no other.
                    if (i + 1) * share >= all.len() {
                        work();
                    } else {
                        scope.spawn(work);
                    }
                }
            });
        })?;
        Ok((
            rows(py, origin)?,
            rows(py, direction)?,
            PyArray1::from_vec(py, code),
            PyArray1::from_vec(py, surface),
        ))
    }

    /// Returns the spot of the point at infinity whose chief ray arrives at a film point.
    fn spot<'py>(
        &self,
        py: Python<'py>,
        x: f64,
        y: f64,
        film_z: f64,
        grid: usize,
    ) -> PyResult<Option<Bound<'py, PyDict>>> {
        let spot = on_pool(py, || self.lens.spot(DVec2::new(x, y), film_z, grid))?;
        let Some(spot) = spot else { return Ok(None) };
        let record = PyDict::new(py);
        let points = spot.points.iter().map(DVec2::to_array).collect();
        record.set_item("points", rows(py, points)?)?;
        record.set_item("centroid", spot.centroid.to_array())?;
        record.set_item("rms", spot.rms)?;
        record.set_item("largest", spot.largest)?;
        record.set_item("beam_area", spot.beam_area)?;
        record.set_item("best_shift", spot.best_shift)?;
        record.set_item("best_rms", spot.best_rms)?;
        Ok(Some(record))
    }

    /// Returns the images of points by diffraction, in white light (three colors), or by
    /// wavelengths in nanometers with their weights (one color).
    fn psf<'py>(
        &self,
        py: Python<'py>,
        fields: Vec<(String, f64)>,
        waves: Option<Vec<(f64, f64)>>,
        side: usize,
        image_height: Option<f64>,
        defocus: f64,
    ) -> PyResult<Bound<'py, PyDict>> {
        let is_white = waves.is_none();
        let gray = |waves: Vec<(f64, f64)>| {
            let whole: f64 = waves.iter().map(|(_, weight)| weight).sum();
            let share = |(nm, weight): (f64, f64)| (nm, DVec3::splat(weight / whole));
            waves.into_iter().map(share).collect()
        };
        let colors: Vec<(f64, DVec3)> = waves.map_or_else(white_light, gray);
        let setting = SheetSetting {
            defocus,
            image_height,
            fields: fields.iter().map(field_point).collect(),
            ..self.setting()
        };
        let made = on_pool(py, || PointSpreads::of(&self.lens, &setting, &colors, side))?;
        let spreads = made.or_raise(py)?;
        let count = spreads.images.len();
        let pixels = spreads.images.iter().flatten();
        let (values, channels): (Vec<f64>, usize) = match is_white {
            true => (pixels.flat_map(DVec3::to_array).collect(), 3),
            false => (pixels.map(|color| color.x).collect(), 1),
        };
        let record = PyDict::new(py);
        let images = PyArray1::from_vec(py, values).reshape([count, side, side, channels])?;
        record.set_item("images", images)?;
        record.set_item("pitch", spreads.pitch)?;
        record.set_item("heights", PyArray1::from_vec(py, spreads.heights))?;
        Ok(record)
    }

    /// Returns the irradiance at film points, for a scene of radiance 1.
    fn irradiance<'py>(
        &self,
        py: Python<'py>,
        points: PyReadonlyArray2<'py, f64>,
        film_z: f64,
    ) -> PyResult<Bound<'py, PyArray1<f64>>> {
        let (points, _) = points.as_slice()?.as_chunks::<2>();
        let at = |p: &[f64; 2]| self.lens.irradiance(DVec2::from_array(*p), film_z);
        let all = on_pool(py, || points.iter().map(at).collect())?;
        Ok(PyArray1::from_vec(py, all))
    }

    /// Returns the angle of the chief ray, and the distortion against f tan θ and f θ, in rows, at
    /// heights on the film's x or y axis. A height without a chief ray has NaN.
    fn distortion<'py>(
        &self,
        py: Python<'py>,
        heights: PyReadonlyArray1<'py, f64>,
        on_x: bool,
        film_z: f64,
    ) -> PyResult<Bound<'py, PyAny>> {
        let plane = if on_x { Plane::X } else { Plane::Y };
        let heights = heights.as_slice()?;
        let at = |height: &f64| match self.lens.distortion(plane, *height, film_z) {
            Some(found) => [found.angle, found.f_tan, found.f_theta],
            None => RayOutcome::LOST,
        };
        let all = on_pool(py, || heights.iter().map(at).collect())?;
        rows(py, all)
    }

    /// Returns the z of the film with the smallest spot on the axis, in millimeters.
    fn best_focus(&self, py: Python<'_>, distance: f64) -> PyResult<Option<f64>> {
        on_pool(py, || self.lens.best_focus(distance))
    }

    /// Returns the section with rays as SVG.
    fn svg(&self, py: Python<'_>) -> PyResult<String> {
        on_pool(py, || {
            let options = SectionOptions::for_lens(&self.lens, &self.setting());
            LensDiagram::of(&self.lens, options).drawing().to_svg()
        })
    }

    /// Returns the prescription as JSON, with what the format leaves out.
    fn prescription(&self, py: Python<'_>) -> PyResult<(String, Vec<String>)> {
        write(self.lens.prescription(), Target::Json).or_raise(py)
    }
}

/// Returns the place on the film's diagonal that a unit and a number name.
fn field_point((unit, value): &(String, f64)) -> FieldPoint {
    match unit.as_str() {
        "%" => FieldPoint::Share(0.01 * value),
        "deg" => FieldPoint::Angle(value.to_radians()),
        _ => FieldPoint::Height(*value),
    }
}

/// Traces the rays of one thread.
fn trace_part(
    lens: &ivcam::Lens,
    toward: Toward,
    (origins, directions): (&[[f64; 3]], &[[f64; 3]]),
    (o, d, c, s): (&mut [[f64; 3]], &mut [[f64; 3]], &mut [u8], &mut [i32]),
) {
    let mut rays = Vec::with_capacity(BLOCK);
    for (block, (from, along)) in origins
        .chunks(BLOCK)
        .zip(directions.chunks(BLOCK))
        .enumerate()
    {
        rays.clear();
        rays.extend(from.iter().zip(along).map(|(o, d)| LensRay {
            origin: DVec3::from_array(*o),
            direction: DVec3::from_array(*d),
        }));
        for (i, result) in (block * BLOCK..).zip(lens.trace_all(&rays, toward)) {
            let out = RayOutcome::of(result);
            (o[i], d[i], c[i], s[i]) = (out.origin, out.direction, out.code, out.surface);
        }
    }
}

/// Returns the names of the lenses that come with the package.
#[pyfunction]
pub(crate) fn shipped_lenses() -> Vec<&'static str> {
    shipped_names().collect()
}
