//! Arrays of NumPy from vectors, and vectors from arrays.

use nalgebra::Vector3;
use numpy::ndarray::Array2;
use numpy::{IntoPyArray, PyArray1, PyArray2, PyReadonlyArray2, PyUntypedArrayMethods};
use pyo3::prelude::*;

use crate::errors::Trouble;

/// A fresh array (n, 3) of numbers, three an item.
pub fn array3<'py, T: numpy::Element>(py: Python<'py>, flat: Vec<T>) -> Bound<'py, PyArray2<T>> {
    array(py, flat, 3)
}

/// A fresh array (n, `columns`).
pub fn array<'py, T: numpy::Element>(
    py: Python<'py>,
    flat: Vec<T>,
    columns: usize,
) -> Bound<'py, PyArray2<T>> {
    let rows = flat.len() / columns.max(1);
    let whole = Array2::from_shape_vec((rows, columns), flat);
    // The length is a product of both.
    whole.unwrap_or_else(|_| Array2::from_shape_simple_fn((0, columns), || unreachable!())).into_pyarray(py)
}

/// A fresh array (n,).
pub fn array1<T: numpy::Element>(py: Python<'_>, values: Vec<T>) -> Bound<'_, PyArray1<T>> {
    values.into_pyarray(py)
}

/// Three numbers an item, from an array (n, 3) of any strides that Python has checked.
pub fn vectors(array: &PyReadonlyArray2<'_, f64>) -> Result<Vec<[f64; 3]>, Trouble> {
    let [rows, columns] = array.shape() else {
        return Err(Trouble::Value("expected an array of shape (n, 3)".into()));
    };
    if *columns != 3 {
        return Err(Trouble::Value(format!("expected an array of shape (n, 3), found ({rows}, {columns})")));
    }
    if let Ok(numbers) = array.as_slice() {
        return Ok(numbers.as_chunks().0.to_vec());
    }
    let view = array.as_array();
    Ok(view.rows().into_iter().map(|row| [row[0], row[1], row[2]]).collect())
}

/// Places as three numbers an item.
pub fn flat(points: &[Vector3<f64>]) -> Vec<f64> {
    points.iter().flat_map(|point| [point.x, point.y, point.z]).collect()
}
