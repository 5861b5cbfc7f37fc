//! Segmented images, from files and from arrays.

use std::collections::BTreeMap;
use std::path::PathBuf;
use std::sync::Arc;

use nalgebra::Matrix3;
use numpy::PyArray1;
use pliant_geometry::{Grid, Vector3};
use pliant_imaging::{LabelNames, Scalar};
use pyo3::prelude::*;

use crate::arrays::array1;
use crate::errors::Trouble;
use crate::jobs::on_thread;

/// An image, shared with the engine.
#[pyclass(frozen, module = "pliant._native")]
pub struct Image(pub Arc<pliant_imaging::Image>);

/// Types of numbers by the words of NumPy.
const NUMBERS: [(&str, Scalar); 10] = [
    ("int8", Scalar::I8),
    ("uint8", Scalar::U8),
    ("int16", Scalar::I16),
    ("uint16", Scalar::U16),
    ("int32", Scalar::I32),
    ("uint32", Scalar::U32),
    ("int64", Scalar::I64),
    ("uint64", Scalar::U64),
    ("float32", Scalar::F32),
    ("float64", Scalar::F64),
];

#[pymethods]
impl Image {
    /// From little-endian bytes, i fastest, of numbers of a type, the affine matrix to metres row by row, and
    /// names of labels.
    #[new]
    fn new(
        bytes: Vec<u8>,
        numbers: &str,
        dims: [usize; 3],
        affine: [[f64; 4]; 3],
        names: Vec<(i32, String)>,
    ) -> Result<Self, Trouble> {
        let known = NUMBERS.iter().find(|(word, _)| *word == numbers);
        let (_, scalar) =
            known.ok_or_else(|| Trouble::Value(format!("images cannot hold numbers of type {numbers}")))?;
        let axes = Matrix3::from_fn(|row, column| affine[row][column]);
        let grid = Grid::new(dims, Vector3::from_fn(|row, _| affine[row][3]), axes)
            .map_err(|error| Trouble::Mesh(None, error.to_string()))?;
        let mut label_names = LabelNames::default();
        names.iter().for_each(|(label, name)| label_names.insert(*label, name));
        let image = pliant_imaging::Image::new(grid, *scalar, bytes, label_names);
        let image =
            image.ok_or_else(|| Trouble::Value("the bytes of an image do not match its voxels".into()))?;
        Ok(Self(Arc::new(image)))
    }

    /// The labels but 0 with their voxels, rounded as the mesher does.
    fn labels(&self, py: Python<'_>) -> PyResult<Vec<(i32, usize)>> {
        let image = Arc::clone(&self.0);
        on_thread(py, move || {
            let labels = image.labels().map_err(|error| Trouble::Mesh(None, error.to_string()))?;
            let mut counts = BTreeMap::<i32, usize>::new();
            labels.labels.iter().for_each(|&label| *counts.entry(label).or_default() += 1);
            counts.remove(&0);
            Ok(counts.into_iter().collect())
        })
    }
}

/// Values (i fastest), their numbers along i, j and k, the affine matrix to metres row by row, and names of
/// labels.
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
