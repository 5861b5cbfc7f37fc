//! Segmented images from files.

use std::path::PathBuf;

use numpy::PyArray1;
use pyo3::prelude::*;

use crate::arrays::array1;
use crate::errors::Trouble;
use crate::jobs::on_thread;

/// Values (i fastest), their numbers along i, j and k, the affine matrix to metres row by row, and names of labels.
type Read<'py> = (Bound<'py, PyArray1<f64>>, [usize; 3], [[f64; 4]; 3], Vec<(i32, String)>);

/// Reads an image of any format that `pliant labels` reads.
#[pyfunction]
pub fn read_image(py: Python<'_>, path: PathBuf) -> PyResult<Read<'_>> {
    let image = on_thread(py, move || {
        let failed = |error: pliant_imaging::ImageError| {
            Trouble::Mesh(Some(path.display().to_string()), error.to_string())
        };
        pliant_imaging::read(&path, &pliant_imaging::ReadOptions::default()).map_err(failed)
    })?;
    let grid = image.grid;
    let values: Vec<f64> = (0..grid.len()).map(|at| image.value(at)).collect();
    let row = |r: usize| [grid.axes[(r, 0)], grid.axes[(r, 1)], grid.axes[(r, 2)], grid.origin[r]];
    let present = image.labels().map(|labels| labels.present()).unwrap_or_default();
    let names = image.names.of(&present).into_iter().collect();
    Ok((array1(py, values), grid.dims, [row(0), row(1), row(2)], names))
}
