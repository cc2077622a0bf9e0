//! Scenes: documents, nodes, and the check of files.

use std::path::{Path, PathBuf};
use std::sync::{Arc, PoisonError, RwLock, RwLockReadGuard};

use ivcam::cli::keep_inputs;
use ivcam::diag::{Diagnostic, Severity, Sink};
use ivcam::export::{ExportOptions, Losses, Target, convert};
use ivcam::iv::{FolderLoader, Format, Limits, Loader, NoFiles, NodeId, Value};
use ivcam::memory::MemoryLimit;
use ivcam::pose::Projection;
use ivcam::scene::CompileOptions;
use ivcam::scene::check::{Checked, scene_files};
use ivcam::scene::model::{
    LightShape, Model, ModelOptions, Place, Sampling, SceneCamera, SceneLight,
};
use ivcam_base::files::{folder_of, write_whole};
use ivcam_base::work::{Allowance, Budget, WorkLimit};
use ivcam_inventor::events::SnapshotOptions;
use pyo3::exceptions::{PyKeyError, PyOverflowError, PyTypeError, PyValueError};
use pyo3::prelude::*;
use pyo3::types::{PyBytes, PyDict, PyList};

use crate::calls::{on_pool, on_pool_with, on_this_thread};
use crate::errors::{OrRaise, records};
use crate::{triangles, values};

/// What one scene may take.
fn allowance() -> Allowance {
    Allowance {
        memory: MemoryLimit::default().bytes(),
        work: WorkLimit::default(),
        time: None,
    }
}

/// A scene that was read, which several nodes share.
#[pyclass(frozen, module = "ivcam._ivcam", name = "Document")]
pub(crate) struct PyDocument {
    inner: Arc<RwLock<ivcam::Document>>,
    /// The file that it was read from, as it was named.
    path: Option<PathBuf>,
    /// Its absolute path, which holds after a change of the working directory.
    pub(crate) file: Option<PathBuf>,
    /// The absolute paths of more folders of files of the scene.
    search: Vec<PathBuf>,
}

impl PyDocument {
    pub(crate) fn read(&self) -> RwLockReadGuard<'_, ivcam::Document> {
        self.inner.read().unwrap_or_else(PoisonError::into_inner)
    }

    /// Returns the scene's file, or a name for messages.
    pub(crate) fn source_path(&self) -> PathBuf {
        self.path.clone().unwrap_or_else(|| "scene".into())
    }

    /// Adds the folders of the scene to those of a plan.
    pub(crate) fn add_folders(&self, plan: &mut ivcam::Plan) {
        let new = |folder: &&PathBuf| !plan.search.contains(folder);
        let new: Vec<PathBuf> = self.search.iter().filter(new).cloned().collect();
        plan.search.extend(new);
    }

    /// Runs `work` with the document on this process's pool.
    fn on_pool<T: Send>(
        &self,
        py: Python<'_>,
        work: impl FnOnce(&ivcam::Document) -> T + Send,
    ) -> PyResult<T> {
        on_pool_with(py, || self.read(), |document| work(document))
    }

    /// Returns a document of this scene as triangles at a time.
    fn model(
        &self,
        document: &ivcam::Document,
        time: f64,
        tolerance: Option<f64>,
        recenter: bool,
    ) -> ivcam::diag::Result<Model> {
        let options = model_options(&self.search, tolerance, recenter);
        allowance().during(|| {
            let model = Model::at(document, time, &options);
            Budget::current().check()?;
            Ok(model)
        })
    }

    /// Returns an object of Python for a node.
    fn node<'py>(&self, py: Python<'py>, id: u32) -> PyResult<Bound<'py, PyAny>> {
        let inner = self.inner.clone();
        Ok(Bound::new(py, PyNode { inner, id })?.into_any())
    }
}

/// Returns the absolute path.
fn from_root(path: &Path) -> PathBuf {
    std::path::absolute(path).unwrap_or_else(|_| path.to_path_buf())
}

fn model_options(search: &[PathBuf], tolerance: Option<f64>, recenter: bool) -> ModelOptions {
    let defaults = ModelOptions::default();
    ModelOptions {
        tolerance: tolerance.unwrap_or(defaults.tolerance),
        recenter,
        compile: CompileOptions {
            texture_folders: search.to_vec(),
            memory: MemoryLimit::default().bytes(),
            ..defaults.compile
        },
    }
}

#[pymethods]
impl PyDocument {
    #[staticmethod]
    fn open(
        py: Python<'_>,
        path: PathBuf,
        search: Vec<PathBuf>,
        contain: Option<PathBuf>,
    ) -> PyResult<Self> {
        let document = on_pool(py, || {
            let folders: Vec<&Path> = search.iter().map(PathBuf::as_path).collect();
            let limits = Limits::default();
            allowance().during(|| {
                ivcam::Document::open_or_stdin(&path, &folders, contain.as_deref(), &limits)
            })
        })?;
        Ok(Self {
            inner: Arc::new(RwLock::new(document.or_raise(py)?)),
            file: Some(from_root(&path)),
            path: Some(path),
            search: search.iter().map(|folder| from_root(folder)).collect(),
        })
    }

    #[staticmethod]
    fn from_bytes(
        py: Python<'_>,
        bytes: &[u8],
        name: String,
        folder: Option<PathBuf>,
        search: Vec<PathBuf>,
    ) -> PyResult<Self> {
        let bytes = bytes.to_vec();
        let document = on_pool(py, || {
            let limits = Limits::default();
            let loader: Arc<dyn Loader> = match &folder {
                None => Arc::new(NoFiles),
                Some(folder) => {
                    let folders: Vec<&Path> = search.iter().map(PathBuf::as_path).collect();
                    Arc::new(FolderLoader::new(
                        &folder.join(&name),
                        &folders,
                        limits.bytes,
                    ))
                }
            };
            let name = folder.map_or(name.clone(), |f| f.join(name).display().to_string());
            allowance().during(|| ivcam::Document::read(&name, bytes, loader, &limits))
        })?;
        Ok(Self {
            inner: Arc::new(RwLock::new(document.or_raise(py)?)),
            path: None,
            file: None,
            search: search.iter().map(|folder| from_root(folder)).collect(),
        })
    }

    #[getter]
    fn path(&self) -> Option<&Path> {
        self.path.as_deref()
    }

    #[getter]
    fn format(&self) -> String {
        self.read().format.clone()
    }

    fn nodes<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyList>> {
        let ids: Vec<u32> = self.read().descendants().map(|node| node.id.0).collect();
        let list = PyList::empty(py);
        ids.into_iter()
            .try_for_each(|id| list.append(self.node(py, id)?))?;
        Ok(list)
    }

    fn roots<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyList>> {
        let ids: Vec<u32> = self.read().roots().map(|node| node.id.0).collect();
        let list = PyList::empty(py);
        ids.into_iter()
            .try_for_each(|id| list.append(self.node(py, id)?))?;
        Ok(list)
    }

    fn problems<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyList>> {
        // Making objects may run other code of Python, which may wait for the same lock.
        let problems = self.read().sink.items().to_vec();
        records(py, &problems)
    }

    fn cameras<'py>(&self, py: Python<'py>, time: f64) -> PyResult<Bound<'py, PyList>> {
        let model = self.on_pool(py, |document| self.model(document, time, None, false))?;
        let model = model.or_raise(py)?;
        let list = PyList::empty(py);
        let mut all = model.cameras.iter();
        all.try_for_each(|camera| list.append(camera_record(py, camera)?))?;
        Ok(list)
    }

    fn lights<'py>(&self, py: Python<'py>, time: f64) -> PyResult<Bound<'py, PyList>> {
        let model = self.on_pool(py, |document| self.model(document, time, None, false))?;
        let model = model.or_raise(py)?;
        let list = PyList::empty(py);
        let mut all = model.lights.iter();
        all.try_for_each(|light| list.append(light_record(py, light)?))?;
        Ok(list)
    }

    fn triangles<'py>(
        &self,
        py: Python<'py>,
        time: f64,
        tolerance: f64,
        recenter: bool,
    ) -> PyResult<Bound<'py, PyDict>> {
        let make = |document: &ivcam::Document| {
            let model = self.model(document, time, Some(tolerance), recenter)?;
            Ok((triangles::Arrays::of(&model), model))
        };
        let (arrays, model) = self.on_pool(py, make)?.or_raise(py)?;
        arrays.into_dict(py, &model)
    }

    /// Returns the bytes of the scene, and what they leave out.
    fn write<'py>(
        &self,
        py: Python<'py>,
        binary: bool,
    ) -> PyResult<(Bound<'py, PyBytes>, Vec<String>)> {
        let format = if binary {
            Format::Binary
        } else {
            Format::Ascii
        };
        let (bytes, losses) = self.on_pool(py, |document| {
            let document = document.in_inventor(format);
            (document.write(format), document.losses(format))
        })?;
        let losses = losses.into_iter().map(|loss| loss.text).collect();
        Ok((PyBytes::new(py, &bytes), losses))
    }

    #[allow(clippy::too_many_arguments)]
    fn convert<'py>(
        &self,
        py: Python<'py>,
        path: PathBuf,
        target: Option<String>,
        time: f64,
        tolerance: f64,
        recenter: bool,
        animate: Option<f64>,
    ) -> PyResult<Bound<'py, PyDict>> {
        let target = wanted(&path, target.as_deref()).or_raise(py)?;
        let stem = path.file_stem().unwrap_or_default().to_string_lossy();
        let options = ExportOptions {
            time,
            model: model_options(&self.search, Some(tolerance), recenter),
            sampling: (animate != Some(0.0)).then(|| Sampling {
                duration: animate,
                ..Sampling::default()
            }),
            stem: stem.into_owned(),
        };
        let made = self.on_pool(py, |document| {
            let conversion = allowance().during(|| {
                let conversion = convert(document, target, &options)?;
                Budget::current().check().map(|()| conversion)
            })?;
            let mut files = vec![path.clone()];
            let beside = conversion.beside.iter();
            files.extend(beside.map(|(name, _)| path.with_file_name(name)));
            self.keep_inputs(document, &files)?;
            write_all(&conversion.beside, &path, &conversion.bytes)?;
            Ok((conversion, files))
        })?;
        let (conversion, files) = made.or_raise(py)?;
        let record = PyDict::new(py);
        record.set_item("format", target.name())?;
        record.set_item("files", files)?;
        record.set_item("losses", loss_records(py, &conversion.losses)?)?;
        record.set_item("problems", records(py, &conversion.diagnostics)?)?;
        record.set_item("empty", conversion.is_empty)?;
        Ok(record)
    }
}

impl PyDocument {
    /// Refuses to write over the scene or a file that the scene uses.
    fn keep_inputs(
        &self,
        document: &ivcam::Document,
        files: &[PathBuf],
    ) -> ivcam::diag::Result<()> {
        let mut inputs = document.opened_files();
        inputs.extend(self.file.clone());
        let mut files = files.iter();
        files.try_for_each(|file| keep_inputs("path", file, &inputs))
    }
}

/// Returns the format of a conversion.
fn wanted(path: &Path, name: Option<&str>) -> ivcam::diag::Result<Target> {
    let found = match name {
        Some("iv") => Some(Target::Inventor),
        Some(name) => Target::named(name),
        None => Target::of_path(path),
    };
    found.ok_or_else(|| {
        let text = match name {
            Some(name) => format!("there is no format `{name}`"),
            None => format!("`{}` does not name a format", path.display()),
        };
        let names: Vec<&str> = Target::ALL.iter().map(|target| target.name()).collect();
        Diagnostic::unsupported(text).with_help(format!("the formats are {}", names.join(", ")))
    })
}

/// Writes the files of a conversion. The file itself is last, so that those beside it are there.
fn write_all(beside: &[(String, Vec<u8>)], path: &Path, bytes: &[u8]) -> ivcam::diag::Result<()> {
    for (name, bytes) in beside {
        let beside = path.with_file_name(name);
        let folder = folder_of(&beside);
        std::fs::create_dir_all(&folder).map_err(|e| Diagnostic::io(folder.display(), &e))?;
        write_whole(&beside, |file| file.write_all(bytes))?;
    }
    write_whole(path, |file| file.write_all(bytes))
}

fn loss_records<'py>(py: Python<'py>, losses: &Losses) -> PyResult<Bound<'py, PyList>> {
    let list = PyList::empty(py);
    for loss in losses.iter() {
        let record = PyDict::new(py);
        record.set_item("feature", &loss.code)?;
        record.set_item("text", &loss.text)?;
        add_place(&record, &loss.place)?;
        record.set_item("count", loss.count)?;
        record.set_item("stated", loss.stated)?;
        list.append(record)?;
    }
    Ok(list)
}

fn add_place(record: &Bound<'_, PyDict>, place: &Place) -> PyResult<()> {
    record.set_item("node", &place.class)?;
    record.set_item("name", place.name.as_deref())?;
    record.set_item("file", place.file())?;
    record.set_item("line", place.line())
}

fn camera_record<'py>(py: Python<'py>, camera: &SceneCamera) -> PyResult<Bound<'py, PyDict>> {
    let pose = &camera.pose;
    let record = PyDict::new(py);
    record.set_item("class", &camera.place.class)?;
    record.set_item("name", &camera.name)?;
    record.set_item("line", camera.place.line())?;
    record.set_item("position", pose.position.to_array())?;
    record.set_item("orientation", pose.orientation.to_array())?;
    record.set_item("near", pose.near)?;
    record.set_item("far", pose.far)?;
    record.set_item("focal_distance", pose.focal_distance)?;
    match pose.projection {
        Projection::Perspective { height_angle } => {
            record.set_item("height_angle", height_angle)?;
        }
        Projection::Orthographic { height } => record.set_item("height", height)?,
    }
    Ok(record)
}

fn light_record<'py>(py: Python<'py>, light: &SceneLight) -> PyResult<Bound<'py, PyDict>> {
    let record = PyDict::new(py);
    record.set_item("class", &light.place.class)?;
    record.set_item("name", &light.name)?;
    record.set_item("line", light.place.line())?;
    record.set_item("color", light.color.to_array())?;
    record.set_item("intensity", light.intensity)?;
    if !matches!(light.shape, LightShape::Directional) {
        record.set_item("position", light.position.to_array())?;
        record.set_item("attenuation", light.attenuation.to_array())?;
        record.set_item("radius", light.radius)?;
    }
    if !matches!(light.shape, LightShape::Point) {
        record.set_item("direction", light.direction.to_array())?;
    }
    if let LightShape::Spot { inner, outer, .. } = light.shape {
        record.set_item("inner_angle", inner)?;
        record.set_item("outer_angle", outer)?;
    }
    Ok(record)
}

/// A node of a document.
#[pyclass(frozen, module = "ivcam", name = "Node")]
pub(crate) struct PyNode {
    inner: Arc<RwLock<ivcam::Document>>,
    id: u32,
}

impl PyNode {
    fn read(&self) -> RwLockReadGuard<'_, ivcam::Document> {
        self.inner.read().unwrap_or_else(PoisonError::into_inner)
    }

    fn other<'py>(&self, py: Python<'py>, id: u32) -> PyResult<Bound<'py, PyAny>> {
        let inner = self.inner.clone();
        Ok(Bound::new(py, Self { inner, id })?.into_any())
    }
}

#[pymethods]
impl PyNode {
    /// The number of the node in its document.
    #[getter]
    fn id(&self) -> u32 {
        self.id
    }

    /// The name of the class, such as `Cone`.
    #[getter]
    fn class_name(&self) -> String {
        self.read().node(NodeId(self.id)).class_name().to_owned()
    }

    /// The name after `DEF`, or `None`.
    #[getter]
    fn name(&self) -> Option<String> {
        let document = self.read();
        let name = document.node(NodeId(self.id)).data().name.as_deref();
        name.map(str::to_owned)
    }

    /// The line in the file, from 1, or `None` in a binary file.
    #[getter]
    fn line(&self) -> Option<u32> {
        Place::of(self.read().node(NodeId(self.id))).line()
    }

    /// The file that the node is in.
    #[getter]
    fn file(&self) -> Option<String> {
        let document = self.read();
        let place = Place::of(document.node(NodeId(self.id)));
        place.file().map(str::to_owned)
    }

    /// The nodes directly below this one.
    #[getter]
    fn children<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyList>> {
        let document = self.read();
        let ids: Vec<u32> = document
            .node(NodeId(self.id))
            .children()
            .map(|n| n.id.0)
            .collect();
        drop(document);
        let list = PyList::empty(py);
        ids.into_iter()
            .try_for_each(|id| list.append(self.other(py, id)?))?;
        Ok(list)
    }

    /// The fields that the file states, as a dictionary.
    #[getter]
    fn fields<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyDict>> {
        let document = self.read();
        let stated = document.node(NodeId(self.id)).stated_fields();
        let stated: Vec<(String, Value)> = stated
            .map(|(name, value)| (name.to_owned(), value.clone()))
            .collect();
        // Making objects may run other code of Python, which may wait for the same lock.
        drop(document);
        let fields = PyDict::new(py);
        for (name, value) in &stated {
            fields.set_item(name, values::field(py, value, &|id| self.other(py, id))?)?;
        }
        Ok(fields)
    }

    /// The names of all fields of the class.
    fn field_names(&self) -> Vec<String> {
        let document = self.read();
        let node = document.node(NodeId(self.id));
        let known = node.class().map_or(&[][..], |class| class.fields);
        let mut names: Vec<String> = known.iter().map(|field| field.name.to_owned()).collect();
        for (name, _) in node.stated_fields() {
            if !names.iter().any(|known| known == name) {
                names.push(name.to_owned());
            }
        }
        names
    }

    /// Returns the value of a field: the stated one, or else the default of its class.
    fn __getitem__<'py>(&self, py: Python<'py>, name: &str) -> PyResult<Bound<'py, PyAny>> {
        let document = self.read();
        let value = document.node(NodeId(self.id)).value(name).cloned();
        // Making objects may run other code of Python, which may wait for the same lock.
        drop(document);
        match value {
            Some(value) => values::field(py, &value, &|id| self.other(py, id)),
            None => Err(self.no_field(name)),
        }
    }

    /// Sets a field. The document, and pictures and triangles of it from now on, are changed.
    fn __setitem__(&self, py: Python<'_>, name: &str, value: &Bound<'_, PyAny>) -> PyResult<()> {
        let document = self.read();
        let node = document.node(NodeId(self.id));
        let class = node.class_name().to_owned();
        let old = node.value(name).cloned();
        // Reading an object may run other code of Python, which may wait for the same lock.
        drop(document);
        let old = old.ok_or_else(|| self.no_field(name))?;
        let new = values::like(&old, value).map_err(|error| {
            let text = format!("`{name}` of `{class}` cannot be set to {value}");
            if error.is_instance_of::<PyOverflowError>(py) {
                let beyond = "a whole number is beyond the field's 32 bits";
                return PyValueError::new_err(format!("{text}: {beyond}"));
            }
            match error.is_instance_of::<PyValueError>(py) {
                true => PyValueError::new_err(format!("{text}: {}", error.value(py))),
                false => PyTypeError::new_err(text),
            }
        })?;
        // A call that reads the document for long must not hold up all other threads of Python.
        let set = || {
            let mut document = self.inner.write().unwrap_or_else(PoisonError::into_inner);
            document.set(NodeId(self.id), name, new)
        };
        on_this_thread(py, set)?.or_raise(py)
    }

    fn __repr__(&self) -> String {
        let name = self
            .name()
            .map_or(String::new(), |name| format!(" DEF {name}"));
        let line = self
            .line()
            .map_or(String::new(), |line| format!(" line {line}"));
        format!("<ivcam.Node {}{name}{line}>", self.class_name())
    }

    fn __eq__(&self, other: &Self) -> bool {
        self.id == other.id && Arc::ptr_eq(&self.inner, &other.inner)
    }

    fn __hash__(&self) -> u64 {
        u64::from(self.id)
    }
}

impl PyNode {
    /// Returns the exception that a node has no such field, with the nearest name.
    fn no_field(&self, name: &str) -> PyErr {
        let names = self.field_names();
        let near = ivcam::diag::nearest(name, names.iter().map(String::as_str));
        let help = near.map_or(String::new(), |near| format!("; there is `{near}`"));
        PyKeyError::new_err(format!(
            "`{}` has no field `{name}`{help}",
            self.class_name()
        ))
    }
}

/// Checks scene files and the scene files of folders, and returns what `ivcam check --json` prints
/// and the warnings about files that are skipped. Ends early if a signal of Python arrives.
#[pyfunction]
pub(crate) fn check<'py>(
    py: Python<'py>,
    paths: Vec<PathBuf>,
    search: Vec<PathBuf>,
    contain: Option<PathBuf>,
) -> PyResult<(Bound<'py, PyList>, Bound<'py, PyList>)> {
    let mut skipped = Sink::new();
    let named: Vec<&PathBuf> = paths.iter().collect();
    let files = on_pool(py, || scene_files(&named, &mut skipped))?.or_raise(py)?;
    let folders: Vec<&Path> = search.iter().map(PathBuf::as_path).collect();
    let options = CompileOptions {
        texture_folders: search.clone(),
        memory: MemoryLimit::default().bytes(),
        ..CompileOptions::default()
    };
    let (limits, at) = (Limits::default(), SnapshotOptions::default());
    let list = PyList::empty(py);
    for file in &files {
        let read = || Checked::read(file, &folders, contain.as_deref(), &limits, &at, &options);
        let found = on_pool(py, || allowance().during(read).json())?;
        list.append(values::json(py, &found)?)?;
        py.check_signals()?;
    }
    let warnings = skipped
        .items()
        .iter()
        .filter(|d| d.severity >= Severity::Warning);
    Ok((list, records(py, warnings)?))
}

/// Returns the names of the formats of `convert`, each with the endings of its files.
#[pyfunction]
pub(crate) fn formats() -> Vec<(&'static str, Vec<&'static str>)> {
    let all = Target::ALL.iter();
    all.map(|target| (target.name(), target.endings().to_vec()))
        .collect()
}
