//! Vectors on some nodes of a body, from its mesh file or a table next to the scene.

use std::collections::BTreeMap;
use std::io;
use std::path::{Path, PathBuf};

use pliant_format::suggestion;
use pliant_format::tables::{NodeVectorSource, NodeVectors};
use pliant_format::{rows_of, table};
use pliant_geometry::words::counted;
use pliant_geometry::{DataArray, Mesh};

use super::Meshed;

/// Fault of a table of vectors, with its remedy.
#[derive(Debug)]
struct VectorFault {
    message: String,
    help: String,
}

fn fault(message: String, help: impl Into<String>) -> VectorFault {
    VectorFault { message, help: help.into() }
}

impl Meshed<'_> {
    /// The vector of each of some nodes (numbered in the model) of a body [m or N].
    pub(in crate::assemble) fn node_vectors(
        &mut self,
        table: &NodeVectors,
        body: usize,
        nodes: &[u32],
        path: &[&str],
    ) -> Option<Vec<[f64; 3]>> {
        let built = &self.bodies[body];
        let numbers: BTreeMap<u32, u32> = self.assembly.bodies[body].all_nodes().zip(0..).collect();
        let body_nodes: Vec<u32> = nodes.iter().filter_map(|node| numbers.get(node).copied()).collect();
        let (key, found) = match &table.from {
            NodeVectorSource::PointData(name) => (
                "point-data",
                point_data(name, &built.name, &built.mesh).and_then(|data| of_data(name, data, &body_nodes)),
            ),
            NodeVectorSource::Csv(file) => {
                let rows = read_rows(self.scene.file(file), file, built.file_nodes);
                let numbers = body_nodes.iter().map(|&node| built.number_in_file(node));
                ("csv", rows.and_then(|rows| of_rows(file, &rows, numbers)))
            }
        };
        match found {
            Ok(vectors) => Some(vectors.into_iter().map(|v| v.map(|x| x * table.scale)).collect()),
            Err(VectorFault { message, help }) => {
                self.error(&[path, &[key]].concat(), message, "here", help);
                None
            }
        }
    }
}

fn point_data<'m>(name: &str, body: &str, mesh: &'m Mesh) -> Result<&'m DataArray, VectorFault> {
    mesh.point_data.get(name).ok_or_else(|| {
        let known: Vec<&str> = mesh.point_data.keys().map(String::as_str).collect();
        let help = suggestion(name, &known, "the mesh", "point data");
        fault(format!("the mesh of `{body}` has no point data `{name}`"), help)
    })
}

fn of_data(name: &str, data: &DataArray, nodes: &[u32]) -> Result<Vec<[f64; 3]>, VectorFault> {
    if data.components != 3 {
        let message =
            format!("point data `{name}` has {}, but a vector has 3", counted(data.components, "component"));
        return Err(fault(message, "name an array of vectors; pad plane vectors with zeros"));
    }
    let vector = |&node: &u32| {
        let item = data.item(node as usize);
        let vector = [item[0], item[1], item[2]];
        if vector.iter().all(|x| x.is_finite()) {
            return Ok(vector);
        }
        let message = format!("point data `{name}` is {vector:?} at node {node} (counted from 0)");
        Err(fault(message, "give every node of the selection finite numbers, or select fewer nodes"))
    };
    nodes.iter().map(vector).collect()
}

/// Reads the rows of a table by node; `count` nodes are in the mesh file. Empty lines and text after a # are
/// skipped.
fn read_rows(
    found: io::Result<PathBuf>,
    path: &Path,
    count: usize,
) -> Result<BTreeMap<u32, [f64; 3]>, VectorFault> {
    const FORM: &str =
        "each row is `node,x,y,z`: a node counted from 0 and three numbers in metres (or newtons)";
    let text = found.and_then(|found| table(&found)).map_err(|error| {
        let help = "it must be a text file; file names are relative to the scene file";
        fault(format!("`{}` cannot be read: {error}", path.display()), help)
    })?;
    let shown = path.file_name().unwrap_or(path.as_os_str()).to_string_lossy();
    let mut rows = BTreeMap::new();
    let mut header_allowed = true;
    for (row, line) in rows_of(&text) {
        let columns: Vec<&str> = row.split(',').map(str::trim).collect();
        if std::mem::take(&mut header_allowed) && columns[0].eq_ignore_ascii_case("node") {
            continue;
        }
        let wrong = |what: String| fault(format!("{shown}:{line}: {what}, found `{row}`"), FORM);
        let [node, components @ ..] = columns.as_slice() else { continue };
        let Ok(components) = <[&str; 3]>::try_from(components) else {
            return Err(wrong(format!("a row has 4 columns, but this one has {}", columns.len())));
        };
        let node: u32 =
            node.parse().map_err(|_| wrong("the first column must be the number of a node".into()))?;
        let mut vector = [0.0; 3];
        for (x, text) in vector.iter_mut().zip(components) {
            let number = text.parse().ok().filter(|x: &f64| x.is_finite());
            *x = number.ok_or_else(|| wrong(format!("`{text}` is not a finite number")))?;
        }
        if node as usize >= count {
            let message = format!(
                "{shown}:{line}: there is no node {node}: the mesh has {count} nodes, counted from 0"
            );
            return Err(fault(message, "if the table counts from 1, subtract 1 from its first column"));
        }
        if rows.insert(node, vector).is_some() {
            let message = format!("{shown}:{line}: node {node} has a row already");
            return Err(fault(message, "give one row for each node"));
        }
    }
    Ok(rows)
}

fn of_rows(
    file: &Path,
    rows: &BTreeMap<u32, [f64; 3]>,
    nodes: impl Iterator<Item = u32> + Clone,
) -> Result<Vec<[f64; 3]>, VectorFault> {
    let mut missing = nodes.clone().filter(|node| !rows.contains_key(node));
    if let Some(first) = missing.next() {
        let others = match missing.count() {
            0 => String::new(),
            n => format!(" and for {} more of the selection", counted(n, "node")),
        };
        let message = format!("`{}` has no row for node {first} (counted from 0){others}", file.display());
        return Err(fault(message, "add a row for every node of the selection, or select fewer nodes"));
    }
    Ok(nodes.map(|node| rows[&node]).collect())
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Reads a table of a mesh of four nodes.
    fn read(text: &str) -> Result<BTreeMap<u32, [f64; 3]>, String> {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("motion.csv");
        std::fs::write(&path, text).unwrap();
        read_rows(Ok(path.clone()), &path, 4).map_err(|fault| fault.message)
    }

    #[test]
    fn a_table_is_read_with_and_without_header_in_any_order() {
        let expected: BTreeMap<u32, [f64; 3]> = [(0, [0.0, 1e-3, -2.0]), (3, [1.0, 2.0, 3.0])].into();
        for text in
            ["3,1,2,3\n0,0,1e-3,-2\n", "\u{feff}node, x, y, z\r\n0, 0, 0.001, -2\r\n# the last\r\n3, 1, 2, 3"]
        {
            assert_eq!(read(text).unwrap(), expected, "{text}");
        }
    }

    #[test]
    fn a_bad_row_is_told_with_its_line() {
        for (text, says) in [
            ("0,0,0,0\n1,0,0\n", "motion.csv:2: a row has 4 columns, but this one has 3, found `1,0,0`"),
            ("0,0,0,0\n\n1,0,x,0\n", "motion.csv:3: `x` is not a finite number"),
            ("0,0,nan,0\n", "motion.csv:1: `nan` is not a finite number"),
            ("x,y,z,node\n0,0,0,0\n", "motion.csv:1: the first column must be the number of a node"),
            ("-1,0,0,0\n", "motion.csv:1: the first column must be the number of a node"),
            ("4,0,0,0\n", "motion.csv:1: there is no node 4: the mesh has 4 nodes"),
            ("1,0,0,0\n1,0,0,0\n", "motion.csv:2: node 1 has a row already"),
        ] {
            let message = read(text).unwrap_err();
            assert!(message.starts_with(says), "{message}");
        }
    }

    #[test]
    fn nodes_without_a_row_are_counted() {
        let rows = [(1, [0.0; 3])].into();
        let message = of_rows(Path::new("m.csv"), &rows, [1, 2, 3].into_iter()).unwrap_err().message;
        assert_eq!(
            message,
            "`m.csv` has no row for node 2 (counted from 0) and for 1 node more of the selection"
        );
    }
}
