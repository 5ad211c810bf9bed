//! Arrays of numpy: what gmlc has computed is handed over and not copied.

use crate::errors::wrong;
use numpy::{Element, PyArray1, PyArray2, PyArray3, PyArrayMethods, PyReadonlyArrayDyn, PyUntypedArrayMethods};
use pyo3::prelude::*;

/// A vector as an array, which takes its memory.
pub(crate) fn vector<T: Element>(py: Python<'_>, values: Vec<T>) -> Bound<'_, PyArray1<T>> {
    PyArray1::from_vec(py, values)
}

/// Rows of `N` numbers as an array of two dimensions.
pub(crate) fn rows<T: Element, const N: usize>(py: Python<'_>, rows: Vec<[T; N]>) -> PyResult<Bound<'_, PyArray2<T>>> {
    let count = rows.len();
    PyArray1::from_vec(py, rows.into_flattened()).reshape([count, N])
}

/// Numbers as an array of three dimensions.
pub(crate) fn block(py: Python<'_>, values: Vec<f64>, shape: [usize; 3]) -> PyResult<Bound<'_, PyArray3<f64>>> {
    PyArray1::from_vec(py, values).reshape(shape)
}

/// The numbers of an array of whatever shape, in the order of C.
pub(crate) fn numbers(array: &PyReadonlyArrayDyn<'_, f64>) -> Vec<f64> {
    array.as_array().iter().copied().collect()
}

/// The rows of an array of shape (n, 3).
pub(crate) fn points(array: &PyReadonlyArrayDyn<'_, f64>, name: &str) -> PyResult<Vec<[f64; 3]>> {
    match array.shape() {
        [_, 3] => Ok(numbers(array).as_chunks().0.to_vec()),
        shape => Err(wrong(format!("{name} has the shape {shape:?}; expected (n, 3)"))),
    }
}
