//! The camera of an archival picture.

use std::path::PathBuf;
use std::sync::{Mutex, PoisonError};

use ivcam::compare::fit::FitStep;
use ivcam::compare::{
    Comparison, FittedCamera, Options, Plate, Registration, compare, fit_camera,
    fit_camera_and_aperture,
};
use ivcam::diag::{Diagnostic, Severity, Sink};
use ivcam::photo::options::{Opt, all};
use ivcam::{Era, Plan, Session};
use pyo3::exceptions::PyValueError;
use pyo3::prelude::*;
use pyo3::types::PyDict;

use crate::comparison::Operand;
use crate::document::PyDocument;
use crate::errors::{OrRaise, records};
use crate::options::{Keywords, OF_PROCESSES, OUTPUTS};
use crate::picture::{listening, on_threads, threads};
use crate::{comparison, values};

type Result<T> = ivcam::diag::Result<T>;

/// What a fit found.
struct Found {
    camera: FittedCamera,
    rendering: Plate,
    comparison: Comparison,
    warnings: Vec<Diagnostic>,
}

/// Returns the options of a fit, which writes no files.
fn known() -> Vec<&'static Opt> {
    let is_known = |o: &&Opt| !OF_PROCESSES.contains(&o.name) && !OUTPUTS.contains(&o.name);
    all().filter(is_known).collect()
}

/// Finds the camera of a picture in a scene, which is a file or a document, as `ivcam compare
/// --fit` does, and with `aperture` as `--fit-aperture` does. `progress` is called with the
/// finished share of the work and the residual.
#[pyfunction]
pub(crate) fn fit<'py>(
    py: Python<'py>,
    scene: &Bound<'py, PyAny>,
    picture: &Bound<'py, PyAny>,
    aperture: bool,
    options: &Bound<'py, PyDict>,
    progress: Option<&Bound<'py, PyAny>>,
) -> PyResult<Bound<'py, PyDict>> {
    let Keywords { given, .. } = Keywords::read("fit", options, &known())?;
    let document = scene.cast::<PyDocument>().ok().map(|d| d.get());
    let path: PathBuf = match document {
        Some(document) => document.source_path(),
        None => scene.extract()?,
    };
    if document.is_some() && given.has("environment") {
        let text = "an environment is read with its scene: fit the file, not a document";
        return Err(PyValueError::new_err(text));
    }
    let target = Operand::read(py, "picture", picture)?;
    let mut sink = Sink::new();
    let start = |era| Plan::of_era(era, path);
    let mut plan = Plan::from_options(&given, Era::Modern, start, &mut sink).or_raise(py)?;
    if let Some(document) = document {
        document.add_folders(&mut plan);
    }
    let threads = threads(&given).or_raise(py)?;
    let budget = plan.budget();
    let seen: Mutex<Option<(f64, f64)>> = Mutex::new(None);
    let work = || {
        let scene = document.map(|document| document.read().clone());
        on_threads(threads, || {
            let open = || match scene {
                Some(scene) => Session::with_document(plan, scene),
                None => Session::open(plan),
            };
            search(budget.during(open)?, &target.plate, aperture, &seen)
        })?
    };
    let mut found = listening(py, work, &budget, || match progress {
        None => Ok(()),
        Some(call) => match *seen.lock().unwrap_or_else(PoisonError::into_inner) {
            None => Ok(()),
            Some(step) => call.call1(step).map(|_| ()),
        },
    })?
    .or_raise(py)?;
    let mut warnings = sink.items().to_vec();
    warnings.append(&mut found.warnings);
    let pair = [
        (&found.rendering, "the rendering"),
        (&target.plate, &*target.name),
    ];
    warnings.extend(Plate::mixed(pair).map(|warning| *warning));
    warnings.retain(|d| d.severity >= Severity::Warning);
    record(py, &found, &warnings)
}

/// Fits the camera of an open session, with `aperture` also its f-number, and compares its picture.
fn search(
    mut session: Session,
    target: &Plate,
    aperture: bool,
    seen: &Mutex<Option<(f64, f64)>>,
) -> Result<Found> {
    // The pixels that were left at the first step.
    let mut all = 0.0f64;
    let mut report = |step: &FitStep<'_>| {
        all = all.max(step.pixels_left);
        let done = if all > 0.0 {
            1.0 - step.pixels_left / all
        } else {
            1.0
        };
        let step = (done, step.cost.max(0.0).sqrt());
        *seen.lock().unwrap_or_else(PoisonError::into_inner) = Some(step);
    };
    let fit = match aperture {
        true => fit_camera_and_aperture,
        false => fit_camera,
    };
    let (camera, rendering) = fit(&mut session, target, &mut report)?;
    let options = Options {
        registration: Registration::Resize,
        ..Options::default()
    };
    Ok(Found {
        comparison: compare(&rendering, target, &options)?,
        warnings: session.sink.items().to_vec(),
        camera,
        rendering,
    })
}

fn record<'py>(
    py: Python<'py>,
    found: &Found,
    warnings: &[Diagnostic],
) -> PyResult<Bound<'py, PyDict>> {
    let text = |e: serde_json::Error| PyValueError::new_err(e.to_string());
    let camera = serde_json::to_value(&found.camera).map_err(text)?;
    let comparison = serde_json::to_value(&found.comparison).map_err(text)?;
    let record = PyDict::new(py);
    record.set_item("camera", values::json(py, &camera)?)?;
    record.set_item("comparison", values::json(py, &comparison)?)?;
    record.set_item("rendering", comparison::plate(py, &found.rendering)?)?;
    record.set_item("problems", records(py, warnings)?)?;
    Ok(record)
}
