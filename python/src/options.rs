//! Keyword arguments become options of the table that the command line has.

use std::ffi::OsString;

use ivcam::diag::nearest;
use ivcam::photo::options::{GivenOptions, Opt, Takes, all, lens_options as of_lenses};
use pyo3::exceptions::{PyTypeError, PyValueError};
use pyo3::prelude::*;
use pyo3::types::{PyBool, PyDict, PyFloat, PyList, PyTuple};

/// The options of pictures that only a command line has: they are about a terminal, or about
/// processes that share a picture.
pub(crate) const OF_PROCESSES: [&str; 7] = [
    "layers",
    "denoise",
    "checkpoint",
    "every",
    "sample-range",
    "tev",
    "progress",
];

/// The options of pictures that name a file to write.
pub(crate) const OUTPUTS: [&str; 4] = ["output", "aov", "write-camera", "report"];

/// Returns the options of `render`: their names, values and help.
#[pyfunction]
pub(crate) fn render_options(py: Python<'_>) -> PyResult<Bound<'_, PyList>> {
    listed(py, all().filter(|o| !OF_PROCESSES.contains(&o.name)))
}

/// Returns the options of `Lens`: their names, values and help.
#[pyfunction]
pub(crate) fn lens_options(py: Python<'_>) -> PyResult<Bound<'_, PyList>> {
    listed(py, of_lenses())
}

fn listed<'py>(
    py: Python<'py>,
    options: impl Iterator<Item = &'static Opt>,
) -> PyResult<Bound<'py, PyList>> {
    let list = PyList::empty(py);
    for option in options {
        let value = match option.takes {
            Takes::Nothing => "bool",
            Takes::One(name) | Takes::Maybe(name, _) | Takes::Many(name) => name,
        };
        list.append((keyword(option.name), value, option.help))?;
    }
    Ok(list)
}

/// Returns the name of an option as a keyword.
pub(crate) fn keyword(name: &str) -> String {
    name.replace('-', "_")
}

/// The options that keywords give, and the same as words of a command line.
#[derive(Default)]
pub(crate) struct Keywords {
    pub(crate) given: GivenOptions,
    pub(crate) words: Vec<String>,
}

impl Keywords {
    /// Reads the keyword arguments of `function`, which has the options `known`.
    pub(crate) fn read(
        function: &str,
        keywords: &Bound<'_, PyDict>,
        known: &[&'static Opt],
    ) -> PyResult<Self> {
        let mut read = Self::default();
        for (name, value) in keywords.iter() {
            let name: String = name.extract()?;
            let option = find(function, &name, known)?;
            if value.is_none() {
                continue;
            }
            if let Some(values) = texts(option, &name, &value)? {
                read.add(option, values);
            }
        }
        Ok(read)
    }

    fn add(&mut self, option: &'static Opt, values: Vec<String>) {
        if values.is_empty() {
            self.words.push(format!("--{}", option.name));
        }
        let words = values.iter().map(|v| format!("--{}={v}", option.name));
        self.words.extend(words);
        let values = values.into_iter().map(OsString::from).collect();
        self.given.add(option.name, values);
    }
}

/// Finds the option of a keyword.
fn find(function: &str, name: &str, known: &[&'static Opt]) -> PyResult<&'static Opt> {
    let spelled = name.replace('_', "-");
    let is_named = |o: &Opt| o.name == spelled || o.aliases.contains(&&*spelled);
    if let Some(option) = known.iter().find(|option| is_named(option)) {
        return Ok(option);
    }
    if OF_PROCESSES.contains(&&*spelled) && all().any(|option| option.name == spelled) {
        let text = format!("{function}() has no `{name}`: use `ivcam render --{spelled}`");
        return Err(PyTypeError::new_err(text));
    }
    let names = known.iter().flat_map(|o| o.aliases.iter().chain([&o.name]));
    let near = nearest(&spelled, names.copied());
    let help = near.map_or(String::new(), |near| {
        format!(". Did you mean `{}`?", keyword(near))
    });
    let text = format!("{function}() got an unexpected keyword argument `{name}`{help}");
    Err(PyTypeError::new_err(text))
}

/// Returns the values of an option as the command line would have them; none if the option is
/// switched off by `False`.
fn texts(option: &Opt, name: &str, value: &Bound<'_, PyAny>) -> PyResult<Option<Vec<String>>> {
    let flag = value.cast::<PyBool>().ok().map(|flag| flag.is_true());
    match (option.takes, flag) {
        (Takes::Nothing, Some(on)) => Ok(on.then(Vec::new)),
        (Takes::Nothing, None) => {
            let text = format!("`{name}` is True or False");
            Err(PyTypeError::new_err(text))
        }
        (Takes::Maybe(_, _), Some(on)) => Ok(Some(vec![on_or_off(on)])),
        (Takes::One(_), Some(on)) => Ok(Some(vec![on_or_off(on)])),
        (Takes::Many(_), _) if is_sequence(value) => {
            let all = value.try_iter()?;
            let texts = all.map(|one| text(name, &one?));
            Ok(Some(texts.collect::<PyResult<_>>()?))
        }
        (Takes::One(of), None) if is_sequence(value) => {
            let all = value.try_iter()?;
            let texts: Vec<String> = all.map(|one| text(name, &one?)).collect::<PyResult<_>>()?;
            let between = if of == "WxH" || of == "FILM" {
                "x"
            } else {
                ","
            };
            Ok(Some(vec![texts.join(between)]))
        }
        _ => Ok(Some(vec![text(name, value)?])),
    }
}

fn on_or_off(on: bool) -> String {
    (if on { "on" } else { "off" }).to_owned()
}

fn is_sequence(value: &Bound<'_, PyAny>) -> bool {
    value.is_instance_of::<PyList>() || value.is_instance_of::<PyTuple>()
}

/// Returns a text, a path or a number as text.
fn text(name: &str, value: &Bound<'_, PyAny>) -> PyResult<String> {
    let is_number = value.extract::<f64>();
    if is_number.as_ref().is_ok_and(|n| n.is_nan()) {
        return Err(PyValueError::new_err(format!("`{name}` is NaN")));
    }
    if let Ok(text) = value.extract::<String>() {
        return Ok(text);
    }
    if value.hasattr("__fspath__")? {
        return value.call_method0("__fspath__")?.extract();
    }
    // A whole number may be a `float`, and a NumPy scalar prints its type.
    if let (Ok(number), true) = (&is_number, value.is_instance_of::<PyFloat>()) {
        return Ok(number.to_string());
    }
    match is_number {
        Ok(_) => Ok(value.str()?.to_string()),
        Err(_) => Err(PyTypeError::new_err(format!(
            "`{name}` is a text, a number or a path, not {}",
            value.get_type().name()?
        ))),
    }
}
