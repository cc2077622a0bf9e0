//! Comparison of two pictures.

use ivcam::compare::{Comparison, Mask, Matching, Options, Plate, Registration};
use ivcam::diag::Diagnostic;
use ivcam::picture::{Raster, Samples};
use numpy::{PyArray1, PyArray3, PyArrayMethods, PyReadonlyArray2, PyReadonlyArray3};
use pyo3::exceptions::PyTypeError;
use pyo3::prelude::*;
use pyo3::types::{PyDict, PyList};
use std::path::PathBuf;

use crate::calls::on_pool;
use crate::errors::{OrRaise, records};
use crate::values;

/// A picture to compare.
pub(crate) struct Operand {
    pub(crate) plate: Plate,
    /// Its name for messages: that of the file, or of the argument.
    pub(crate) name: String,
    /// Whether it is known if its values are linear light or levels: not for an array of floats,
    /// which count as levels.
    is_coded: bool,
}

impl Operand {
    /// Reads a picture: a file, or an array of height × width × channels, which is called `name`.
    pub(crate) fn read(py: Python<'_>, name: &str, picture: &Bound<'_, PyAny>) -> PyResult<Self> {
        let array = if let Ok(array) = picture.extract::<PyReadonlyArray3<'_, f32>>() {
            shaped(&array, Samples::F32(array.to_vec()?))
        } else if let Ok(array) = picture.extract::<PyReadonlyArray3<'_, u16>>() {
            shaped(&array, Samples::U16(array.to_vec()?))
        } else if let Ok(array) = picture.extract::<PyReadonlyArray3<'_, u8>>() {
            shaped(&array, Samples::U8(array.to_vec()?))
        } else {
            let path: PathBuf = picture.extract().map_err(|_| {
                PyTypeError::new_err(
                    "a picture is a file, or an array of height × width × channels",
                )
            })?;
            return Ok(Self {
                plate: on_pool(py, || Plate::open(&path))?.or_raise(py)?,
                name: path.display().to_string(),
                is_coded: true,
            });
        };
        Ok(Self {
            plate: on_pool(py, || Plate::from_raster(&array))?,
            name: name.to_owned(),
            is_coded: !matches!(array.samples, Samples::F32(_)),
        })
    }

    /// Takes the values for linear light if those of another picture are and nothing is known of
    /// these.
    fn follow(&mut self, other: &Self) {
        self.plate.is_light |= !self.is_coded && other.plate.is_light;
    }
}

fn shaped<T: numpy::Element>(array: &PyReadonlyArray3<'_, T>, samples: Samples) -> Raster {
    let shape = array.as_array();
    let (height, width, channels) = shape.dim();
    Raster {
        width: width as u32,
        height: height as u32,
        channels,
        samples,
    }
}

/// Returns a picture as an array of height × width × 3.
pub(crate) fn plate<'py>(py: Python<'py>, plate: &Plate) -> PyResult<Bound<'py, PyArray3<f32>>> {
    let pixels = 0..plate.width * plate.height;
    let values: Vec<f32> = pixels.flat_map(|pixel| plate.color(pixel)).collect();
    PyArray1::from_vec(py, values).reshape([plate.height, plate.width, 3])
}

/// Returns the pixels that count, from an array of height × width.
fn mask(array: &PyReadonlyArray2<'_, bool>) -> PyResult<Mask> {
    let (height, width) = array.as_array().dim();
    let counts = array.to_vec()?;
    Ok(Mask {
        width,
        height,
        counts,
    })
}

/// Compares a new picture with an old one, as `ivcam compare --json` does. Returns that, with
/// `pictures` also the old picture on the new one's pixels and the pixels that counted, and the
/// warnings.
#[pyfunction]
#[allow(clippy::too_many_arguments)]
pub(crate) fn compare<'py>(
    py: Python<'py>,
    new: &Bound<'py, PyAny>,
    old: &Bound<'py, PyAny>,
    registration: &str,
    matching: &str,
    pixels_per_degree: Option<f64>,
    counts: Option<PyReadonlyArray2<'py, bool>>,
    pictures: bool,
) -> PyResult<(Bound<'py, PyAny>, Bound<'py, PyList>)> {
    let mut new = Operand::read(py, "new", new)?;
    let mut old = Operand::read(py, "old", old)?;
    new.follow(&old);
    old.follow(&new);
    let mut options = Options {
        registration: match registration {
            "align" => Registration::Align,
            "resize" => Registration::Resize,
            _ => Registration::None,
        },
        matching: match matching {
            "channel" => Matching::Channel,
            "none" => Matching::None,
            _ => Matching::Picture,
        },
        mask: counts.as_ref().map(mask).transpose()?,
        ..Options::default()
    };
    options.pixels_per_degree = pixels_per_degree.unwrap_or(options.pixels_per_degree);
    let compared = on_pool(py, || {
        let found: Comparison = ivcam::compare::compare(&new.plate, &old.plate, &options)?;
        let json = serde_json::to_value(&found);
        let json = json.map_err(|e| Diagnostic::error(e.to_string()))?;
        Ok((json, found))
    })?;
    let (json, found) = compared.or_raise(py)?;
    let record = values::json(py, &json)?;
    if pictures {
        let record = record.cast::<PyDict>()?;
        record.set_item("old", plate(py, &found.old)?)?;
        let shape = [found.height, found.width];
        let counts = PyArray1::from_vec(py, found.mask.counts).reshape(shape)?;
        record.set_item("mask", counts)?;
    }
    let warning = Plate::mixed([&new, &old].map(|picture| (&picture.plate, &*picture.name)));
    Ok((record, records(py, warning.as_deref())?))
}
