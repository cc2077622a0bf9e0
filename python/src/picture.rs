//! Pictures: a scene is rendered on threads of its own, while the calling thread listens for
//! signals and shows progress.

use std::path::{Path, PathBuf};
use std::sync::mpsc::{RecvTimeoutError, channel};
use std::sync::{Mutex, PoisonError};
use std::time::Duration;

use indexmap::IndexMap;
use ivcam::cli::{check_outputs, files_in, keep_inputs};
use ivcam::diag::{Diagnostic, Severity, Sink};
use ivcam::film::{ErrorEstimate, Response};
use ivcam::math::use_portable_arithmetic;
use ivcam::photo::options::{GivenOptions, all, command_line};
use ivcam::photo::picture_name;
use ivcam::picture::{ChannelImage, Depth, PictureFormat};
use ivcam::render::report::{RenderReport, error_text, percent};
use ivcam::render::{Exposure, Progress};
use ivcam::{Era, Plan, Session};
use ivcam_base::files::write_whole;
use ivcam_base::work::{Budget, StopCause};
use numpy::{PyArray1, PyArray3, PyArrayMethods};
use pyo3::exceptions::{PyRuntimeError, PyValueError};
use pyo3::prelude::*;
use pyo3::types::{PyBytes, PyDict, PyList};

use crate::calls::{Call, STACK, on_pool};
use crate::document::PyDocument;
use crate::errors::{OrRaise, records};
use crate::options::{Keywords, OF_PROCESSES, OUTPUTS, keyword};
use crate::values;

type Result<T> = ivcam::diag::Result<T>;

/// The time between two looks for signals.
const LOOK: Duration = Duration::from_millis(50);

/// The options of the output, which are not part of a plan.
struct Outputs {
    picture: Option<PathBuf>,
    layers: Option<PathBuf>,
    camera: Option<PathBuf>,
    report: Option<PathBuf>,
    threads: usize,
    /// Whether the picture gets its layers.
    keeps_layers: bool,
}

impl Outputs {
    fn of(given: &GivenOptions, keeps_layers: bool) -> Result<Self> {
        let path = |name: &str| given.text(name).map(PathBuf::from);
        let outputs = Self {
            picture: path("output"),
            layers: path("aov"),
            camera: path("write-camera"),
            report: path("report"),
            threads: threads(given)?,
            keeps_layers,
        };
        outputs
            .picture
            .as_deref()
            .map(PictureFormat::of)
            .transpose()?;
        Ok(outputs)
    }

    /// Checks the files before the render. An existing file that another option names, or the file
    /// of the scene, is an input.
    fn check(&self, given: &GivenOptions, scene: Option<&Path>) -> Result<()> {
        let others = given.list().filter(|(name, _)| !OUTPUTS.contains(name));
        let values = others.flat_map(|(_, values)| values).map(Path::new);
        let inputs: Vec<PathBuf> = values.chain(scene).flat_map(files_in).collect();
        check_outputs(&self.files(), &inputs)
    }

    /// Refuses to replace a file that the scene names, such as a texture.
    fn keep(&self, session: &Session) -> Result<()> {
        let inputs = session.document.opened_files();
        let mut files = self.files().into_iter();
        files.try_for_each(|(option, path)| keep_inputs(&option, &path, &inputs))
    }

    /// Returns the files, each with its keyword.
    fn files(&self) -> Vec<(String, PathBuf)> {
        let paths = [&self.picture, &self.layers, &self.camera, &self.report];
        let named = OUTPUTS.iter().zip(paths);
        named
            .filter_map(|(name, path)| Some((keyword(name), path.clone()?)))
            .collect()
    }

    fn needs_layers(&self) -> bool {
        self.keeps_layers || self.layers.is_some()
    }
}

/// Reads the number of threads, and the arithmetic, which holds for the process.
///
/// # Errors
/// Fails if a value is invalid.
pub(crate) fn threads(given: &GivenOptions) -> Result<usize> {
    let here = std::thread::available_parallelism().map_or(1, usize::from);
    let count = |w: &str| w.parse().ok().filter(|n| (1..=1024).contains(n));
    let expects = "a number of threads from 1 to 1024";
    let kinds = [("fast", false), ("portable", true)];
    if given.named("arithmetic", &kinds)? == Some(true) {
        use_portable_arithmetic();
    }
    Ok(given.parsed("threads", expects, count)?.unwrap_or(here))
}

/// What a render made.
struct RenderOutput {
    picture: ivcam::Picture,
    layers: Option<ChannelImage>,
    depth: Depth,
    error: Option<ErrorEstimate>,
    samples: u32,
    report: serde_json::Value,
    warnings: Vec<Diagnostic>,
    notices: Vec<String>,
}

/// A picture in linear exposure values, with its error and its provenance.
#[pyclass(frozen, module = "ivcam._ivcam", name = "Picture")]
pub(crate) struct PyPicture {
    pixels: Py<PyArray3<f32>>,
    size: [u32; 2],
    response: Response,
    depth: Depth,
    provenance: IndexMap<String, String>,
    layers: Option<ChannelImage>,
    report: serde_json::Value,
    warnings: Vec<Diagnostic>,
    #[pyo3(get)]
    notices: Vec<String>,
    /// The relative root mean square error, and the ends of its 95% interval.
    error: Option<ErrorEstimate>,
    #[pyo3(get)]
    samples: u32,
}

impl PyPicture {
    fn new(py: Python<'_>, made: RenderOutput) -> PyResult<Self> {
        let picture = made.picture;
        let (width, height) = (picture.width as usize, picture.height as usize);
        let flat = PyArray1::from_vec(py, picture.pixels.into_flattened());
        let pixels = flat.reshape([height, width, 3])?;
        let keywords = PyDict::new(py);
        keywords.set_item("write", false)?;
        pixels.call_method("setflags", (), Some(&keywords))?;
        Ok(Self {
            pixels: pixels.unbind(),
            size: [picture.width, picture.height],
            response: picture.response,
            depth: made.depth,
            provenance: picture.provenance,
            layers: made.layers,
            report: made.report,
            warnings: made.warnings,
            notices: made.notices,
            error: made.error,
            samples: made.samples,
        })
    }

    /// Returns the picture for the writers of files.
    fn picture(&self, py: Python<'_>) -> PyResult<ivcam::Picture> {
        let pixels = self.pixels.bind(py).readonly();
        Ok(ivcam::Picture {
            width: self.size[0],
            height: self.size[1],
            pixels: pixels.as_slice()?.as_chunks::<3>().0.to_vec(),
            response: self.response.clone(),
            provenance: self.provenance.clone(),
        })
    }
}

#[pymethods]
impl PyPicture {
    #[getter]
    fn pixels(&self, py: Python<'_>) -> Py<PyArray3<f32>> {
        self.pixels.clone_ref(py)
    }

    #[getter]
    fn error(&self) -> Option<f64> {
        self.error.map(|e| e.relative_rmse)
    }

    #[getter]
    fn interval(&self) -> Option<(f64, f64)> {
        self.error.map(|e| (e.low, e.high))
    }

    #[getter]
    fn metadata(&self) -> IndexMap<String, String> {
        self.provenance.clone()
    }

    fn report<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyAny>> {
        values::json(py, &self.report)
    }

    fn warnings<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyList>> {
        records(py, &self.warnings)
    }

    /// Returns the layers by their names in EXR files, each of height × width.
    fn layers<'py>(&self, py: Python<'py>) -> PyResult<Option<Bound<'py, PyDict>>> {
        let Some(layers) = &self.layers else {
            return Ok(None);
        };
        let shape = [layers.height as usize, layers.width as usize];
        let dict = PyDict::new(py);
        for (name, values) in &layers.channels {
            dict.set_item(name, PyArray1::from_slice(py, values).reshape(shape)?)?;
        }
        Ok(Some(dict))
    }

    /// Returns the levels as integers, as they are written to files: height × width × 3.
    fn levels<'py>(&self, py: Python<'py>, depth: i64) -> PyResult<Bound<'py, PyAny>> {
        let picture = self.picture(py)?;
        let (height, width) = (picture.height as usize, picture.width as usize);
        let depth = depth_of(Some(depth), self.depth)?;
        let bytes = on_pool(py, || picture.levels(depth))?;
        if depth == Depth::Eight {
            return Ok(PyArray1::from_vec(py, bytes)
                .reshape([height, width, 3])?
                .into_any());
        }
        let pairs = bytes.as_chunks::<2>().0.iter();
        let wide: Vec<u16> = pairs.map(|pair| u16::from_be_bytes(*pair)).collect();
        Ok(PyArray1::from_vec(py, wide)
            .reshape([height, width, 3])?
            .into_any())
    }

    fn save(&self, py: Python<'_>, path: PathBuf, depth: Option<i64>) -> PyResult<()> {
        let (picture, depth) = (self.picture(py)?, depth_of(depth, self.depth)?);
        on_pool(py, || picture.save(&path, depth))?.or_raise(py)
    }

    fn png<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyBytes>> {
        let picture = self.picture(py)?;
        let mut bytes = Vec::new();
        on_pool(py, || {
            picture.write(PictureFormat::Png, Depth::Eight, &mut bytes)
        })??;
        Ok(PyBytes::new(py, &bytes))
    }
}

fn depth_of(bits: Option<i64>, usual: Depth) -> PyResult<Depth> {
    match bits {
        None => Ok(usual),
        Some(8) => Ok(Depth::Eight),
        Some(16) => Ok(Depth::Sixteen),
        Some(_) => Err(PyValueError::new_err("a depth is 8 or 16 bits")),
    }
}

/// Renders a scene, which is a file or a document. `progress` is called with the finished work, all
/// work, the samples of all pixels and the error so far.
#[pyfunction]
pub(crate) fn render(
    py: Python<'_>,
    scene: &Bound<'_, PyAny>,
    options: &Bound<'_, PyDict>,
    progress: Option<&Bound<'_, PyAny>>,
    layers: bool,
) -> PyResult<PyPicture> {
    let known: Vec<_> = all().filter(|o| !OF_PROCESSES.contains(&o.name)).collect();
    let Keywords { given, .. } = Keywords::read("render", options, &known)?;
    let document = scene.cast::<PyDocument>().ok().map(|d| d.get());
    let path: PathBuf = match document {
        Some(document) => document.source_path(),
        None => scene.extract()?,
    };
    if document.is_some() && given.has("environment") {
        let text = "an environment is read with its scene: render the file, not a document";
        return Err(PyValueError::new_err(text));
    }
    let mut sink = Sink::new();
    let plan = Plan::from_options(
        &given,
        Era::Modern,
        |era| Plan::of_era(era, &path),
        &mut sink,
    );
    let mut plan = plan.or_raise(py)?;
    if let Some(document) = document {
        document.add_folders(&mut plan);
    }
    let outputs = Outputs::of(&given, layers).or_raise(py)?;
    let file = document.map_or(Some(&*path), |document| document.file.as_deref());
    outputs.check(&given, file).or_raise(py)?;
    let budget = plan.budget();
    let seen: Mutex<Option<Progress>> = Mutex::new(None);
    let work = || {
        let scene = document.map(|document| document.read().clone());
        on_threads(outputs.threads, || {
            budget.during(|| make(plan, scene, &outputs, sink, &seen))
        })?
    };
    let made = listening(py, work, &budget, || match progress {
        None => Ok(()),
        Some(call) => match *seen.lock().unwrap_or_else(PoisonError::into_inner) {
            None => Ok(()),
            Some(p) => call
                .call1((p.work_done, p.work, p.samples, p.error))
                .map(|_| ()),
        },
    })?;
    PyPicture::new(py, made.or_raise(py)?)
}

/// Does some work on another thread, while this one listens for signals and calls `look`. An
/// exception cancels the work and is raised when the work has ended.
///
/// # Errors
/// Returns the exception of `look` or of a signal, and fails if the interpreter is ending.
pub(crate) fn listening<T: Send>(
    py: Python<'_>,
    work: impl FnOnce() -> T + Send,
    budget: &Budget,
    look: impl Fn() -> PyResult<()>,
) -> PyResult<T> {
    let _call = Call::begin(py, Some(budget.stop()))?;
    std::thread::scope(|scope| {
        let (sender, receiver) = channel();
        scope.spawn(move || sender.send(work()));
        // `detach` asks for a closure that any thread may run, and a receiver is not.
        let receiver = Mutex::new(receiver);
        let wait = |time| {
            let receiver = receiver.lock().unwrap_or_else(PoisonError::into_inner);
            receiver.recv_timeout(time)
        };
        loop {
            match py.detach(|| wait(LOOK)) {
                Ok(done) => return look().map(|()| done),
                Err(RecvTimeoutError::Disconnected) => {
                    return Err(PyRuntimeError::new_err(
                        "the render ended by a fault of ivcam",
                    ));
                }
                Err(RecvTimeoutError::Timeout) => {}
            }
            if let Err(error) = py.check_signals().and_then(|()| look()) {
                budget.stop().cancel();
                while let Err(RecvTimeoutError::Timeout) = py.detach(|| wait(LOOK)) {}
                return Err(error);
            }
        }
    })
}

/// Runs `work` on a pool with this number of threads.
///
/// # Errors
/// Fails if the threads cannot be started.
pub(crate) fn on_threads<T: Send>(threads: usize, work: impl FnOnce() -> T + Send) -> Result<T> {
    let pool = rayon::ThreadPoolBuilder::new()
        .num_threads(threads)
        .stack_size(STACK)
        .build();
    let pool =
        pool.map_err(|e| Diagnostic::error(format!("cannot start {threads} threads: {e}")))?;
    Ok(pool.install(work))
}

/// Opens the scene, exposes and develops the picture, and writes the files that were asked for.
fn make(
    plan: Plan,
    document: Option<ivcam::Document>,
    outputs: &Outputs,
    sink: Sink,
    seen: &Mutex<Option<Progress>>,
) -> Result<RenderOutput> {
    let mut session = match document {
        Some(document) => Session::with_document(plan, document)?,
        None => Session::open_once(plan)?,
    };
    outputs.keep(&session)?;
    if outputs.needs_layers() {
        session.take_layers()?;
    }
    if let Some(path) = &outputs.camera {
        let text = session.camera_file()?;
        write_whole(path, |file| file.write_all(text.as_bytes()))?;
        if let Some(warning) = session.focus_beyond_camera_file() {
            session.sink.add(*warning);
        }
    }
    let exposure = session.expose(&|progress| {
        *seen.lock().unwrap_or_else(PoisonError::into_inner) = Some(progress);
    });
    let mut warnings: Vec<Diagnostic> = sink.items().to_vec();
    warnings.extend(session.sink.items().iter().cloned());
    warnings.retain(|d| d.severity >= Severity::Warning);
    warnings.extend(end_of(&session, &exposure)?.map(|warning| *warning));
    let name = outputs.picture.clone();
    let name = name.unwrap_or_else(|| picture_name(&session.plan.scene));
    let command = command_line(&session.plan.to_args(&name));
    let picture = session.develop(&exposure, &command);
    if exposure.stopped.is_none() {
        let hint = session.warn_if_black_or_clipped(&exposure.counts, &picture);
        warnings.extend(hint.map(|hint| *hint));
    }
    let layers = outputs.needs_layers().then(|| {
        let surfaces = session.surfaces_of(&exposure);
        session.layers(&exposure, &picture, &surfaces)
    });
    let report = write_all(&session, outputs, &exposure, (&picture, layers.as_ref()))?;
    Ok(RenderOutput {
        depth: session.plan.depth,
        error: session.error_of(&picture, exposure.film.error()).ok(),
        samples: exposure.samples,
        layers: layers.filter(|_| outputs.keeps_layers),
        notices: session.notices(),
        picture,
        report,
        warnings,
    })
}

/// Returns the warning of a render that ended before its aim.
///
/// # Errors
/// Fails if the time ended before any pixel had a sample.
fn end_of(session: &Session, exposure: &Exposure) -> Result<Option<Box<Diagnostic>>> {
    if let Some(stopped) = &exposure.stopped {
        if Budget::current().stop().cause() != Some(StopCause::Time) {
            return Err(Diagnostic::error("the render was interrupted"));
        }
        if exposure.is_blank() {
            return Err(session.too_late());
        }
        return Ok(Some(session.ended_within_pass(exposure, stopped)));
    }
    let (Some(limit), Ok(error)) = (session.plan.stop.error, exposure.film.error()) else {
        return Ok(None);
    };
    Ok((error.high > limit).then(|| {
        let (found, target) = (error_text(&error), percent(limit, 3));
        let text =
            format!("the relative error is {found}, so the target of {target} may not be met");
        Diagnostic::warning(text).with_help("more samples or more time reach it")
    }))
}

/// Writes the files that were asked for, and returns the report.
fn write_all(
    session: &Session,
    outputs: &Outputs,
    exposure: &Exposure,
    (picture, layers): (&ivcam::Picture, Option<&ChannelImage>),
) -> Result<serde_json::Value> {
    let mut report: RenderReport = session.report(exposure);
    report.set_error(session.error_of(picture, exposure.film.error()));
    if let Some(path) = &outputs.picture {
        picture.save(path, session.plan.depth)?;
        report.picture = path.display().to_string();
    }
    if let (Some(path), Some(layers)) = (&outputs.layers, layers) {
        layers.save(path)?;
    }
    report.total_seconds = report.seconds.total();
    let report = serde_json::to_value(report)
        .map_err(|e| Diagnostic::error(format!("the report cannot be written: {e}")))?;
    if let Some(path) = &outputs.report {
        write_whole(path, |file| writeln!(file, "{report:#}"))?;
    }
    Ok(report)
}
