//! Lenses: rays in arrays, spots, light on the film, and what `ivcam lens` prints.

use ivcam::cli::lens_output;
use ivcam::diag::{Severity, Sink};
use ivcam::glam::{DVec2, DVec3};
use ivcam::lens::trace::ray::unit;
use ivcam::lens::{
    Bundle, FieldPoint, Focus, LANES, LensRay, Loss, LossKind, Plane, PointSpreads, SheetSetting,
    Toward, shipped_names,
};
use ivcam::photo::LensChoice;
use ivcam_base::math::lanes::Width;
use ivcam_optics::diagram::{LensDiagram, SectionOptions, white_light};
use ivcam_optics::prescription::formats::write::{Target, write};
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

/// The coordinates of a ray that is lost.
const LOST: [f64; 3] = [f64::NAN; 3];

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

    /// Traces rays, whose rows of three the caller checks, into arrays with a row for each ray. One
    /// row of origins or directions goes with all of the other array.
    #[allow(clippy::too_many_arguments)]
    fn trace<'py>(
        &self,
        py: Python<'py>,
        origins: PyReadonlyArray2<'py, f64>,
        directions: PyReadonlyArray2<'py, f64>,
        wavelength: Option<f64>,
        to_scene: bool,
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
        let (from, _) = origins.as_slice()?.as_chunks::<3>();
        let (along, _) = directions.as_slice()?.as_chunks::<3>();
        let traced = RayColumns {
            origin: origin.as_slice_mut()?.as_chunks_mut::<3>().0,
            direction: direction.as_slice_mut()?.as_chunks_mut::<3>().0,
            code: code.as_slice_mut()?,
            surface: surface.as_slice_mut()?,
        };
        let count = traced.code.len();
        let fits = |n: usize| n == count || n == 1;
        if !fits(from.len()) || !fits(along.len()) || !traced.has_length(count) {
            return Err(PyValueError::new_err("arrays of rays differ in length"));
        }
        let queries = Queries { from, along };
        on_this_thread(py, || trace_on(lens, toward, threads, &queries, traced))
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
            None => LOST,
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

/// Rays to trace. One origin or direction goes with all of the others.
struct Queries<'a> {
    from: &'a [[f64; 3]],
    along: &'a [[f64; 3]],
}

impl Queries<'_> {
    /// Returns a ray with a direction of unit length; none without a direction, or with a
    /// coordinate that is not finite.
    fn ray(&self, i: usize) -> Option<LensRay> {
        let row = |rows: &[[f64; 3]]| DVec3::from_array(rows[if rows.len() == 1 { 0 } else { i }]);
        let origin = Some(row(self.from)).filter(|origin| origin.is_finite())?;
        let direction = unit(row(self.along))?;
        Some(LensRay { origin, direction })
    }
}

/// The rows of arrays that receive the rays as they leave the lens.
struct RayColumns<'a> {
    origin: &'a mut [[f64; 3]],
    direction: &'a mut [[f64; 3]],
    code: &'a mut [u8],
    surface: &'a mut [i32],
}

impl<'a> RayColumns<'a> {
    fn has_length(&self, count: usize) -> bool {
        let lengths = [
            self.origin.len(),
            self.direction.len(),
            self.code.len(),
            self.surface.len(),
        ];
        lengths.iter().all(|length| *length == count)
    }

    fn split_at(self, row: usize) -> (Self, Self) {
        let (origin, origins) = self.origin.split_at_mut(row);
        let (direction, directions) = self.direction.split_at_mut(row);
        let (code, codes) = self.code.split_at_mut(row);
        let (surface, surfaces) = self.surface.split_at_mut(row);
        let first = Self {
            origin,
            direction,
            code,
            surface,
        };
        let rest = Self {
            origin: origins,
            direction: directions,
            code: codes,
            surface: surfaces,
        };
        (first, rest)
    }

    fn set(&mut self, i: usize, result: std::result::Result<LensRay, Loss>) {
        let (origin, direction, code, surface) = match result {
            Ok(ray) => (ray.origin.to_array(), ray.direction.to_array(), 0, -1),
            Err(loss) => (LOST, LOST, code_of(loss.kind), number_of(loss.surface)),
        };
        self.origin[i] = origin;
        self.direction[i] = direction;
        self.code[i] = code;
        self.surface[i] = surface;
    }
}

fn code_of(kind: LossKind) -> u8 {
    match kind {
        LossKind::Missed => 1,
        LossKind::Blocked => 2,
        LossKind::TotalReflection => 3,
    }
}

fn number_of(surface: usize) -> i32 {
    i32::try_from(surface).unwrap_or(i32::MAX)
}

/// Traces rays on a number of threads. The last part is this thread's own, so one thread starts no
/// other.
fn trace_on(
    lens: &ivcam::Lens,
    toward: Toward,
    threads: usize,
    queries: &Queries<'_>,
    traced: RayColumns<'_>,
) {
    let count = traced.code.len();
    let share = count.div_ceil(threads.max(1)).max(1);
    std::thread::scope(|scope| {
        let (mut first, mut rest) = (0, traced);
        while count - first > share {
            let (mut part, others) = rest.split_at(share);
            let start = first;
            scope.spawn(move || trace_part(lens, toward, (queries, start), &mut part));
            (first, rest) = (first + share, others);
        }
        trace_part(lens, toward, (queries, first), &mut rest);
    });
}

/// Traces the rays of one thread, from the query with the number `first` on. It is
/// `Lens::trace_all` without lists between the arrays, which take as long as the tracing.
fn trace_part(
    lens: &ivcam::Lens,
    toward: Toward,
    (queries, first): (&Queries<'_>, usize),
    traced: &mut RayColumns<'_>,
) {
    let count = traced.code.len();
    let entered = match toward {
        Toward::Film => 0,
        Toward::Scene => lens.prescription().surfaces.len().saturating_sub(1),
    };
    let missed = Loss {
        surface: entered,
        kind: LossKind::Missed,
    };
    let (mut bundle, width) = (Bundle::default(), Width::detect());
    for start in (0..count).step_by(LANES) {
        let rays = LANES.min(count - start);
        for lane in 0..rays {
            match queries.ray(first + start + lane) {
                Some(ray) => bundle.set(lane, &ray),
                None => bundle.clear(lane),
            }
        }
        (rays..LANES).for_each(|lane| bundle.clear(lane));
        lens.trace_bundle(&mut bundle, toward, width);
        for lane in 0..rays {
            let result = match bundle.passed(lane) {
                true => Ok(bundle.ray(lane)),
                false => Err(bundle.loss(lane).unwrap_or(missed)),
            };
            traced.set(start + lane, result);
        }
    }
}

/// Returns the names of the lenses that come with the package.
#[pyfunction]
pub(crate) fn shipped_lenses() -> Vec<&'static str> {
    shipped_names().collect()
}
