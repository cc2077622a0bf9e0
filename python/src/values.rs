//! Values of fields and JSON as objects of Python.

use ivcam::glam::{Mat4, Vec2, Vec3, Vec4};
use ivcam::iv::Value;
use ivcam_inventor::grammar::{Image, Plane, Rotation};
use numpy::{PyArray1, PyArrayMethods};
use pyo3::exceptions::{PyTypeError, PyValueError};
use pyo3::prelude::*;
use pyo3::types::{PyDict, PyList};
use pyo3::{Borrowed, IntoPyObjectExt};
use serde_json::Value as Json;

/// Returns JSON as objects of Python.
pub(crate) fn json<'py>(py: Python<'py>, value: &Json) -> PyResult<Bound<'py, PyAny>> {
    match value {
        Json::Null => Ok(py.None().into_bound(py)),
        Json::Bool(v) => v.into_bound_py_any(py),
        Json::Number(v) => match (v.as_i64(), v.as_u64()) {
            (Some(v), _) => v.into_bound_py_any(py),
            (None, Some(v)) => v.into_bound_py_any(py),
            _ => v.as_f64().into_bound_py_any(py),
        },
        Json::String(v) => v.into_bound_py_any(py),
        Json::Array(all) => {
            let list = PyList::empty(py);
            all.iter().try_for_each(|v| list.append(json(py, v)?))?;
            Ok(list.into_any())
        }
        Json::Object(all) => {
            let dict = PyDict::new(py);
            for (key, v) in all {
                dict.set_item(key, json(py, v)?)?;
            }
            Ok(dict.into_any())
        }
    }
}

/// Returns numbers as an array with rows of `N`.
pub(crate) fn rows<'py, T: numpy::Element, const N: usize>(
    py: Python<'py>,
    all: Vec<[T; N]>,
) -> PyResult<Bound<'py, PyAny>> {
    let count = all.len();
    let flat = PyArray1::from_vec(py, all.into_flattened());
    Ok(flat.reshape([count, N])?.into_any())
}

/// Returns the bytes of an image as rows × columns × components, after its layers if it has
/// several.
fn image<'py>(py: Python<'py>, image: &Image) -> PyResult<Bound<'py, PyAny>> {
    let shape = [
        image.depth,
        image.height,
        image.width,
        u32::from(image.components),
    ];
    let shape = shape.map(|n| n as usize);
    let is_whole = shape.iter().product::<usize>() == image.bytes.len();
    let bytes = PyArray1::from_vec(py, image.bytes.to_vec());
    match (is_whole, image.depth) {
        (false, _) => Ok(bytes.into_any()),
        (true, 1) => Ok(bytes.reshape([shape[1], shape[2], shape[3]])?.into_any()),
        (true, _) => Ok(bytes.reshape(shape)?.into_any()),
    }
}

/// Returns the value of a field: a `bool`, a number, a text, an array, or what `node` makes of the
/// node with a number.
pub(crate) fn field<'py>(
    py: Python<'py>,
    value: &Value,
    node: &dyn Fn(u32) -> PyResult<Bound<'py, PyAny>>,
) -> PyResult<Bound<'py, PyAny>> {
    let flat = |v: Vec<f32>| Ok(PyArray1::from_vec(py, v).into_any());
    let turn = |r: &Rotation| [r.axis.x, r.axis.y, r.axis.z, r.angle];
    let plane = |p: &Plane| [p.normal.x, p.normal.y, p.normal.z, p.distance];
    match value {
        Value::Bool(v) => v.into_bound_py_any(py),
        Value::Int(v) => v.into_bound_py_any(py),
        Value::UInt(v) => v.into_bound_py_any(py),
        Value::Float(v) => v.into_bound_py_any(py),
        Value::Double(v) => v.into_bound_py_any(py),
        Value::String(v) => (&**v).into_bound_py_any(py),
        Value::Vec2(v) => flat(v.to_array().to_vec()),
        Value::Vec3(v) => flat(v.to_array().to_vec()),
        Value::Vec4(v) => flat(v.to_array().to_vec()),
        Value::Rotation(v) => flat(turn(v).to_vec()),
        Value::Plane(v) => flat(plane(v).to_vec()),
        Value::Matrix(v) => {
            let matrix = PyArray1::from_vec(py, v.to_cols_array().to_vec());
            Ok(matrix.reshape([4, 4])?.into_any())
        }
        Value::Image(v) => image(py, v),
        Value::Node(None) | Value::Trigger => Ok(py.None().into_bound(py)),
        Value::Node(Some(id)) => node(id.0),
        Value::Bools(v) => Ok(PyArray1::from_vec(py, v.clone()).into_any()),
        Value::Ints(v) => Ok(PyArray1::from_vec(py, v.clone()).into_any()),
        Value::UInts(v) => Ok(PyArray1::from_vec(py, v.clone()).into_any()),
        Value::Floats(v) => flat(v.clone()),
        Value::Doubles(v) => Ok(PyArray1::from_vec(py, v.clone()).into_any()),
        Value::Strings(v) => v.into_bound_py_any(py),
        Value::Vec2s(v) => rows(py, v.iter().map(Vec2::to_array).collect()),
        Value::Vec3s(v) => rows(py, v.iter().map(Vec3::to_array).collect()),
        Value::Vec4s(v) => rows(py, v.iter().map(Vec4::to_array).collect()),
        Value::Rotations(v) => rows(py, v.iter().map(turn).collect()),
        Value::Planes(v) => rows(py, v.iter().map(plane).collect()),
        Value::Matrices(v) => {
            let all: Vec<f32> = v.iter().flat_map(Mat4::to_cols_array).collect();
            Ok(PyArray1::from_vec(py, all)
                .reshape([v.len(), 4, 4])?
                .into_any())
        }
        Value::Nodes(v) => {
            let list = PyList::empty(py);
            v.iter().try_for_each(|id| list.append(node(id.0)?))?;
            Ok(list.into_any())
        }
    }
}

/// A number of 32 bits.
struct Single(f32);

impl<'py> FromPyObject<'_, 'py> for Single {
    type Error = PyErr;

    /// Rounds a number.
    ///
    /// # Errors
    /// Fails with a `ValueError` if the number is finite and its rounding is not.
    fn extract(object: Borrowed<'_, 'py, PyAny>) -> PyResult<Self> {
        let number: f64 = object.extract()?;
        let rounded = number as f32;
        if rounded.is_infinite() && number.is_finite() {
            let text = format!("{number:e} is beyond the numbers of 32 bits, up to 3.4e38");
            return Err(PyValueError::new_err(text));
        }
        Ok(Self(rounded))
    }
}

/// Returns `N` numbers.
fn numbers_of<const N: usize>(numbers: Vec<Single>) -> PyResult<[f32; N]> {
    let numbers: Vec<f32> = numbers.into_iter().map(|number| number.0).collect();
    let wrong = |_| PyTypeError::new_err("a wrong count of numbers");
    numbers.try_into().map_err(wrong)
}

/// Returns rows of `N` numbers.
fn rows_of<const N: usize>(object: &Bound<'_, PyAny>) -> PyResult<Vec<[f32; N]>> {
    let rows: Vec<Vec<Single>> = object.extract()?;
    rows.into_iter().map(numbers_of).collect()
}

/// Returns the value of a field that has the type of `like`, from an object of Python. Fields of
/// nodes and images cannot be set.
///
/// # Errors
/// Fails if the object does not fit the type; with a `ValueError` if a number is too large for it.
pub(crate) fn like(like: &Value, object: &Bound<'_, PyAny>) -> PyResult<Value> {
    fn of<const N: usize>(object: &Bound<'_, PyAny>) -> PyResult<[f32; N]> {
        numbers_of(object.extract()?)
    }
    let rotation = |[x, y, z, angle]: [f32; 4]| Rotation {
        axis: Vec3::new(x, y, z),
        angle,
    };
    Ok(match like {
        Value::Bool(_) => Value::Bool(object.extract()?),
        Value::Int(_) => Value::Int(object.extract()?),
        Value::UInt(_) => Value::UInt(object.extract()?),
        Value::Float(_) => Value::Float(object.extract::<Single>()?.0),
        Value::Double(_) => Value::Double(object.extract()?),
        Value::String(_) => Value::String(object.extract::<String>()?.into()),
        Value::Vec2(_) => Value::Vec2(of::<2>(object)?.into()),
        Value::Vec3(_) => Value::Vec3(of::<3>(object)?.into()),
        Value::Vec4(_) => Value::Vec4(of::<4>(object)?.into()),
        Value::Rotation(_) => Value::Rotation(rotation(of(object)?)),
        Value::Matrix(_) => {
            let wrong = |_| PyTypeError::new_err("a wrong count of rows");
            let rows: [[f32; 4]; 4] = rows_of(object)?.try_into().map_err(wrong)?;
            Value::Matrix(Box::new(Mat4::from_cols_array_2d(&rows)))
        }
        Value::Bools(_) => Value::Bools(object.extract()?),
        Value::Ints(_) => Value::Ints(object.extract()?),
        Value::UInts(_) => Value::UInts(object.extract()?),
        Value::Floats(_) => {
            let numbers: Vec<Single> = object.extract()?;
            Value::Floats(numbers.into_iter().map(|number| number.0).collect())
        }
        Value::Doubles(_) => Value::Doubles(object.extract()?),
        Value::Strings(_) => Value::Strings(object.extract()?),
        Value::Vec2s(_) => Value::Vec2s(rows_of(object)?.into_iter().map(Vec2::from).collect()),
        Value::Vec3s(_) => Value::Vec3s(rows_of(object)?.into_iter().map(Vec3::from).collect()),
        Value::Vec4s(_) => Value::Vec4s(rows_of(object)?.into_iter().map(Vec4::from).collect()),
        Value::Rotations(_) => {
            Value::Rotations(rows_of(object)?.into_iter().map(rotation).collect())
        }
        _ => return Err(PyTypeError::new_err("a field of nodes or images")),
    })
}
