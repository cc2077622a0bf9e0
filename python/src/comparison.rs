//! Comparison of two pictures.

use ivcam::compare::{Comparison, Mask, Matching, Options, Plate, Registration};
use ivcam::diag::Diagnostic;
use ivcam::picture::{Raster, Samples};
use numpy::{PyArray1, PyArray3, PyArrayMethods, PyReadonlyArray2, PyReadonlyArray3};
use pyo3::exceptions::PyTypeError;
use pyo3::prelude::*;
use pyo3::types::PyDict;
use std::path::PathBuf;

use crate::calls::on_pool;
use crate::errors::OrRaise;
use crate::values;

/// Reads a picture: a file, or an array of height × width × channels.
pub(crate) fn raster(py: Python<'_>, picture: &Bound<'_, PyAny>) -> PyResult<Raster> {
    if let Ok(array) = picture.extract::<PyReadonlyArray3<'_, f32>>() {
        let samples = Samples::F32(array.to_vec()?);
        return Ok(shaped(&array, samples));
    }
    if let Ok(array) = picture.extract::<PyReadonlyArray3<'_, u8>>() {
        let samples = Samples::U8(array.to_vec()?);
        return Ok(shaped(&array, samples));
    }
    let path: PathBuf = picture.extract().map_err(|_| {
        PyTypeError::new_err("a picture is a file, or an array of height × width × channels")
    })?;
    on_pool(py, || Raster::open(&path))?.or_raise(py)
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

/// Compares a new picture with an old one, as `ivcam compare --json` does. Returns that, and with
/// `pictures` also the old picture on the new one's pixels and the pixels that counted.
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
) -> PyResult<Bound<'py, PyAny>> {
    let (new, old) = (raster(py, new)?, raster(py, old)?);
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
        let (new, old) = (Plate::from_raster(&new), Plate::from_raster(&old));
        let found: Comparison = ivcam::compare::compare(&new, &old, &options)?;
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
    Ok(record)
}
