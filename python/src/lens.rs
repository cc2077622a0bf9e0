//! Lenses: rays in arrays, spots, light on the film, and what `ivcam lens` prints.

use ivcam::cli::output_of_lens;
use ivcam::diag::{Severity, Sink};
use ivcam::glam::{DVec2, DVec3};
use ivcam::lens::{
    FieldPoint, Focus, Meridian, PointSpreads, RayRows, SheetSetting, Toward, TracedRows,
    shipped_names,
};
use ivcam::photo::{LensChoice, LensWavelength};
use ivcam_optics::diagram::{LensDiagram, SectionOptions, white_light};
use ivcam_optics::prescription::formats::write::{OutputFormat, write};
use numpy::{
    PyArray1, PyArrayMethods, PyReadonlyArray1, PyReadonlyArray2, PyReadwriteArray1,
    PyReadwriteArray2,
};
use pyo3::exceptions::PyValueError;
use pyo3::prelude::*;
use pyo3::types::{PyDict, PyList};

use crate::calls::{on_pool, on_this_thread};
use crate::errors::{OrRaise, records};
use crate::options::Keywords;
use crate::values::rows;

/// A lens, focused if it has a distance.
#[pyclass(frozen, module = "ivcam._ivcam", name = "Lens")]
pub(crate) struct PyLens {
    lens: ivcam::Lens,
    /// The lens before it was focused.
    unfocused: ivcam::Lens,
    focus: Option<Focus>,
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
            let (mut choice, distance) = LensChoice::from_options(&name, &given, &mut sink)?;
            choice.wavelength = wavelength.map_or(LensWavelength::Primary, LensWavelength::Nm);
            let opened = choice.open(&mut sink)?;
            let unfocused = match wavelength {
                Some(nm) => opened.at_wavelength(nm),
                None => opened.at_primary_wavelength(),
            };
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
        let words: Vec<String> = self.words.iter().cloned().chain(words).collect();
        let output = on_pool(py, || output_of_lens(&self.unfocused, &words))?.or_raise(py)?;
        Ok((output.text, output.messages))
    }

    /// Traces rays, whose rows of three the caller checks, into arrays with a row for each ray. One
    /// row of origins or directions goes with all of the other array. With `at_z` the points of the
    /// rays are on that plane.
    #[allow(clippy::too_many_arguments)]
    fn trace<'py>(
        &self,
        py: Python<'py>,
        origins: PyReadonlyArray2<'py, f64>,
        directions: PyReadonlyArray2<'py, f64>,
        wavelength: Option<f64>,
        to_scene: bool,
        at_z: Option<f64>,
        threads: usize,
        rays: (PyReadwriteArray2<'py, f64>, PyReadwriteArray2<'py, f64>),
        mut code: PyReadwriteArray1<'py, u8>,
        mut surface: PyReadwriteArray1<'py, i32>,
    ) -> PyResult<()> {
        let (mut origin, mut direction) = rays;
        let toward = if to_scene {
            Toward::Scene
        } else {
            Toward::Film
        };
        let lens = wavelength.map(|nm| self.lens.at_wavelength(nm));
        let lens = lens.as_ref().unwrap_or(&self.lens);
        let queries = RayRows {
            origins: origins.as_slice()?.as_chunks::<3>().0,
            directions: directions.as_slice()?.as_chunks::<3>().0,
        };
        let traced = TracedRows {
            origins: origin.as_slice_mut()?.as_chunks_mut::<3>().0,
            directions: direction.as_slice_mut()?.as_chunks_mut::<3>().0,
            codes: code.as_slice_mut()?,
            surfaces: surface.as_slice_mut()?,
        };
        if !traced.count().is_some_and(|count| queries.are_of(count)) {
            return Err(PyValueError::new_err("arrays of rays differ in length"));
        }
        let tracing = Tracing {
            lens,
            toward,
            plane: at_z,
        };
        on_this_thread(py, || tracing.on_threads(threads, queries, traced))
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
        let plane = if on_x { Meridian::X } else { Meridian::Y };
        let heights = heights.as_slice()?;
        let at = |height: &f64| match self.lens.distortion(plane, *height, film_z) {
            Some(found) => [found.angle, found.f_tan, found.f_theta],
            None => [f64::NAN; 3],
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
        write(self.lens.prescription(), OutputFormat::Json).or_raise(py)
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

/// How rays are traced.
struct Tracing<'a> {
    lens: &'a ivcam::Lens,
    toward: Toward,
    /// The z of the plane on which the rays end, in millimeters, if any.
    plane: Option<f64>,
}

impl Tracing<'_> {
    /// Traces rays on a number of threads. The last part is this thread's own, so one thread starts
    /// no other.
    fn on_threads(&self, threads: usize, queries: RayRows<'_>, traced: TracedRows<'_>) {
        let count = traced.codes.len();
        let share = count.div_ceil(threads.max(1)).max(1);
        std::thread::scope(|scope| {
            let (mut first, mut rest) = (0, traced);
            while count - first > share {
                let (part, others) = rest.split_at(share);
                let rows = queries.part(first..first + share);
                scope.spawn(move || self.part(rows, part));
                (first, rest) = (first + share, others);
            }
            self.part(queries.part(first..count), rest);
        });
    }

    fn part(&self, queries: RayRows<'_>, mut traced: TracedRows<'_>) {
        self.lens
            .trace_rows(queries, self.toward, self.plane, &mut traced);
    }
}

/// Returns the names of the lenses that come with the package.
#[pyfunction]
pub(crate) fn shipped_lenses() -> Vec<&'static str> {
    shipped_names().collect()
}
