//! Diagnostics become exceptions by kind, and dictionaries.

use ivcam::{Diagnostic, ErrorKind};
use pyo3::prelude::*;
use pyo3::types::{PyDict, PyList};

/// Returns the name of the exception for a kind of error, in `ivcam/_errors.py`.
fn exception(kind: ErrorKind) -> &'static str {
    match kind {
        ErrorKind::NotFound => "NotFoundError",
        ErrorKind::Io => "FileError",
        ErrorKind::Syntax => "SceneSyntaxError",
        ErrorKind::Damaged => "DamagedError",
        ErrorKind::OutsideFolder => "OutsideFolderError",
        ErrorKind::Limit => "LimitError",
        ErrorKind::Unsupported => "UnsupportedError",
        ErrorKind::CannotFocus => "FocusError",
        _ => "ArgumentError",
    }
}

/// Returns the exception for a diagnostic, with its place and help.
pub(crate) fn error(py: Python<'_>, diagnostic: &Diagnostic) -> PyErr {
    let make = || {
        let class = py
            .import("ivcam._errors")?
            .getattr(exception(diagnostic.kind))?;
        let (file, place) = diagnostic.location();
        let (line, column) = place.unzip();
        class.call1((
            &diagnostic.message,
            diagnostic.help.as_deref(),
            file,
            line,
            column,
        ))
    };
    make().map_or_else(|e| e, PyErr::from_value)
}

/// The result of the library as one of Python.
pub(crate) trait OrRaise<T> {
    /// Returns the value, or raises the exception for the diagnostic.
    fn or_raise(self, py: Python<'_>) -> PyResult<T>;
}

impl<T> OrRaise<T> for ivcam::diag::Result<T> {
    fn or_raise(self, py: Python<'_>) -> PyResult<T> {
        self.map_err(|diagnostic| error(py, &diagnostic))
    }
}

/// Returns a diagnostic as a dictionary with the keys of `ivcam check --json`.
pub(crate) fn record<'py>(py: Python<'py>, d: &Diagnostic) -> PyResult<Bound<'py, PyDict>> {
    let (file, place) = d.location();
    let (line, column) = place.unzip();
    let record = PyDict::new(py);
    record.set_item("severity", d.class())?;
    record.set_item("line", line)?;
    record.set_item("column", column)?;
    record.set_item("byte", d.byte())?;
    record.set_item("message", &d.message)?;
    record.set_item("help", d.help.as_deref())?;
    record.set_item("file", file)?;
    record.set_item("count", d.count)?;
    Ok(record)
}

/// Returns diagnostics as a list of dictionaries.
pub(crate) fn records<'py, 'd>(
    py: Python<'py>,
    all: impl IntoIterator<Item = &'d Diagnostic>,
) -> PyResult<Bound<'py, PyList>> {
    let list = PyList::empty(py);
    for diagnostic in all {
        list.append(record(py, diagnostic)?)?;
    }
    Ok(list)
}
