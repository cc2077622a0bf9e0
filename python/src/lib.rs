//! The extension module `ivcam._ivcam`. The package `ivcam` around it is written in Python: it
//! checks shapes, names the results and shows warnings; here arrays become rays, and pictures
//! become arrays.

#![deny(unsafe_code)]

mod calls;
mod comparison;
mod document;
mod errors;
mod fit;
mod lens;
mod options;
mod picture;
mod triangles;
mod values;

use pyo3::prelude::*;

#[pymodule(gil_used = false)]
fn _ivcam(module: &Bound<'_, PyModule>) -> PyResult<()> {
    module.add("__version__", env!("CARGO_PKG_VERSION"))?;
    module.add_class::<document::PyDocument>()?;
    module.add_class::<document::PyNode>()?;
    module.add_class::<lens::PyLens>()?;
    module.add_class::<picture::PyPicture>()?;
    module.add_function(wrap_pyfunction!(document::check, module)?)?;
    module.add_function(wrap_pyfunction!(document::formats, module)?)?;
    module.add_function(wrap_pyfunction!(lens::shipped_lenses, module)?)?;
    module.add_function(wrap_pyfunction!(options::render_options, module)?)?;
    module.add_function(wrap_pyfunction!(options::lens_options, module)?)?;
    module.add_function(wrap_pyfunction!(picture::render, module)?)?;
    module.add_function(wrap_pyfunction!(comparison::compare, module)?)?;
    module.add_function(wrap_pyfunction!(fit::fit, module)?)?;
    module.add_function(wrap_pyfunction!(calls::end_calls, module)?)?;
    Ok(())
}
