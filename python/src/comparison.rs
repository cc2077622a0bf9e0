//! Comparison of two pictures.

use ivcam::compare::{Comparison, Matching, Options, Plate, Registration};
use ivcam::diag::Diagnostic;
use ivcam::picture::{Raster, Samples};
use numpy::{PyArrayMethods, PyReadonlyArray3};
use pyo3::exceptions::PyTypeError;
use pyo3::prelude::*;
use std::path::PathBuf;

use crate::errors::OrRaise;
use crate::values;

/// Reads a picture: a file, or an array of height × width × channels.
fn raster(py: Python<'_>, picture: &Bound<'_, PyAny>) -> PyResult<Raster> {
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
    py.detach(|| Raster::open(&path)).or_raise(py)
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

/// Compares a new picture with an old one, as `ivcam compare --json` does.
#[pyfunction]
pub(crate) fn compare<'py>(
    py: Python<'py>,
    new: &Bound<'py, PyAny>,
    old: &Bound<'py, PyAny>,
    registration: &str,
    matching: &str,
    pixels_per_degree: Option<f64>,
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
        ..Options::default()
    };
    options.pixels_per_degree = pixels_per_degree.unwrap_or(options.pixels_per_degree);
    let compared = py.detach(|| {
        let (new, old) = (Plate::from_raster(&new), Plate::from_raster(&old));
        let found: Comparison = ivcam::compare::compare(&new, &old, &options)?;
        serde_json::to_value(&found).map_err(|e| Diagnostic::error(e.to_string()))
    });
    values::json(py, &compared.or_raise(py)?)
}
