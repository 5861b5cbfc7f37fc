//! Meshes between arrays and the engine.

use std::collections::BTreeMap;
use std::path::PathBuf;
use std::sync::Arc;

use numpy::{PyArray1, PyArray2, PyReadonlyArray1, PyReadonlyArray2};
use pliant_geometry::{CellBlock, CellKind, DataArray, SplitCells, SplitKind, Vector3, add_as_tets, io};
use pyo3::prelude::*;
use pyo3::types::PyDict;

use crate::arrays::{array, array1, array3, flat, vectors};
use crate::errors::Trouble;

/// A mesh, shared with the engine.
#[pyclass(frozen, module = "pliant._native")]
pub struct Mesh(pub Arc<pliant_geometry::Mesh>);

/// Kinds of cells by the words of meshio and VTK.
const KINDS: [(&str, CellKind); 6] = [
    ("vertex", CellKind::Vertex),
    ("line", CellKind::Line),
    ("triangle", CellKind::Triangle),
    ("quad", CellKind::Quad),
    ("tetra", CellKind::Tet),
    ("hexahedron", CellKind::Hex),
];

/// Kinds that become tets.
const SPLIT: [(&str, SplitKind); 2] = [("wedge", SplitKind::Wedge), ("pyramid", SplitKind::Pyramid)];

/// The word for a kind.
pub fn word(kind: CellKind) -> &'static str {
    KINDS.iter().find(|(_, known)| *known == kind).map_or("", |(word, _)| word)
}

type Blocks<'py> = Vec<(String, PyReadonlyArray2<'py, u32>)>;
type Data<'py> = Vec<(String, PyReadonlyArray2<'py, f64>)>;

/// A name, a kind of cells, and a value for each cell.
type CellData<'py> = (String, &'static str, Bound<'py, PyArray2<f64>>);

/// A name, a kind of cells, and which of them are in a set.
type CellSet<'py> = (String, &'static str, Bound<'py, PyArray1<u32>>);

#[pymethods]
impl Mesh {
    /// From arrays that Python has checked.
    #[new]
    fn new(
        points: PyReadonlyArray2<'_, f64>,
        cells: Blocks<'_>,
        point_data: Data<'_>,
        cell_data: Vec<(String, String, PyReadonlyArray2<'_, f64>)>,
        point_sets: Vec<(String, PyReadonlyArray1<'_, u32>)>,
        cell_sets: Vec<(String, String, PyReadonlyArray1<'_, u32>)>,
        label_names: BTreeMap<i32, String>,
    ) -> Result<Self, Trouble> {
        let mut mesh = pliant_geometry::Mesh {
            points: vectors(&points)?.into_iter().map(Vector3::from).collect(),
            label_names,
            ..Default::default()
        };
        let data = |array: &PyReadonlyArray2<'_, f64>| {
            let values = array.as_array();
            DataArray { components: values.ncols(), values: values.iter().copied().collect() }
        };
        let set = |array: &PyReadonlyArray1<'_, u32>| {
            let mut members: Vec<u32> = array.as_array().iter().copied().collect();
            members.sort_unstable();
            members.dedup();
            members
        };
        let mut split = Vec::new();
        for (word, nodes) in &cells {
            let nodes = nodes.as_array().iter().copied().collect();
            let cell_values = cell_data.iter().filter(|(kind, ..)| kind == word);
            let cell_values = cell_values.map(|(_, name, values)| (name.clone(), data(values))).collect();
            let sets = cell_sets.iter().filter(|(kind, ..)| kind == word);
            let sets = sets.map(|(_, name, members)| (name.clone(), set(members))).collect();
            if let Some((_, kind)) = KINDS.iter().find(|(known, _)| known == word) {
                mesh.blocks.push(CellBlock { kind: *kind, nodes, data: cell_values, sets });
            } else if let Some(&(_, kind)) = SPLIT.iter().find(|(known, _)| known == word) {
                split.push(SplitCells { kind, nodes, data: cell_values, sets });
            } else {
                let known: Vec<&str> =
                    KINDS.iter().map(|(word, _)| *word).chain(SPLIT.map(|(word, _)| word)).collect();
                let known = known.join(", ");
                return Err(Trouble::Value(format!("unknown kind of cells `{word}`; known kinds: {known}")));
            }
        }
        mesh.point_data.extend(point_data.iter().map(|(name, values)| (name.clone(), data(values))));
        add_as_tets(&mut mesh, &split);
        for (name, nodes) in &point_sets {
            mesh.point_sets.insert(name.clone(), set(nodes));
        }
        Ok(Self(Arc::new(mesh)))
    }

    /// From a file of any format that `pliant info` reads.
    #[staticmethod]
    fn read(py: Python<'_>, path: PathBuf, scale: f64) -> PyResult<(Self, Vec<String>)> {
        crate::jobs::on_thread(py, move || {
            let failed =
                |error: io::MeshFileError| Trouble::Mesh(Some(path.display().to_string()), error.to_string());
            let mut file = io::read(&path).map_err(failed)?;
            file.mesh.points.iter_mut().for_each(|point| *point *= scale);
            Ok((Self(Arc::new(file.mesh)), file.notes))
        })
    }

    /// Writes a file; its ending gives the format.
    fn write(&self, py: Python<'_>, path: PathBuf) -> PyResult<()> {
        let mesh = Arc::clone(&self.0);
        crate::jobs::on_thread(py, move || {
            let failed =
                |error: io::MeshFileError| Trouble::Mesh(Some(path.display().to_string()), error.to_string());
            io::write(&path, &mesh).map_err(failed)
        })
    }

    fn points<'py>(&self, py: Python<'py>) -> Bound<'py, PyArray2<f64>> {
        array3(py, flat(&self.0.points))
    }

    fn cells<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyDict>> {
        let cells = PyDict::new(py);
        for block in &self.0.blocks {
            cells.set_item(word(block.kind), array(py, block.nodes.clone(), block.kind.node_count()))?;
        }
        Ok(cells)
    }

    fn point_data<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyDict>> {
        let data = PyDict::new(py);
        for (name, values) in &self.0.point_data {
            data.set_item(name, array(py, values.values.clone(), values.components))?;
        }
        Ok(data)
    }

    /// By name, one array for each kind of cells that has it.
    fn cell_data<'py>(&self, py: Python<'py>) -> PyResult<Vec<CellData<'py>>> {
        let mut data = Vec::new();
        for block in &self.0.blocks {
            for (name, values) in &block.data {
                data.push((
                    name.clone(),
                    word(block.kind),
                    array(py, values.values.clone(), values.components),
                ));
            }
        }
        Ok(data)
    }

    /// By name, the cells of each kind that are in it.
    fn cell_sets<'py>(&self, py: Python<'py>) -> Vec<CellSet<'py>> {
        let blocks = self.0.blocks.iter().flat_map(|block| {
            block.sets.iter().map(|(name, cells)| (name.clone(), word(block.kind), cells.clone()))
        });
        blocks.map(|(name, kind, cells)| (name, kind, array1(py, cells))).collect()
    }

    fn label_names(&self) -> BTreeMap<i32, String> {
        self.0.label_names.clone()
    }

    /// Sets of points; with `with_cells`, also the points of sets of cells.
    fn point_sets<'py>(&self, py: Python<'py>, with_cells: bool) -> PyResult<Bound<'py, PyDict>> {
        let sets = PyDict::new(py);
        for name in self.0.set_names() {
            let listed = self.0.point_sets.get(name).cloned();
            let Some(points) = (if with_cells { self.0.set_points(name) } else { listed }) else { continue };
            let points: Bound<'_, PyArray1<u32>> = array1(py, points);
            sets.set_item(name, points)?;
        }
        Ok(sets)
    }
}
