//! Meshes of several participants as one.

use std::collections::{BTreeMap, BTreeSet};

use pliant_geometry::{CellBlock, CellKind, DataArray, Mesh};

/// Meshes with their data as one mesh, each with the number of its first `body`, from which its cells count.
/// Data that a mesh lacks are not a number there; labels and marks of things are 0.
pub(super) fn merged(numbered: &[(&Mesh, usize)]) -> Mesh {
    let meshes: Vec<&Mesh> = numbered.iter().map(|(mesh, _)| *mesh).collect();
    let mut result = Mesh::default();
    let sizes = meshes.iter().map(|mesh| mesh.points.len());
    result.point_data = joined(meshes.iter().map(|mesh| &mesh.point_data).zip(sizes));
    let mut first_points = vec![0];
    for mesh in &meshes {
        result.points.extend_from_slice(&mesh.points);
        result.label_names.extend(mesh.label_names.clone());
        first_points.push(result.points.len() as u32);
    }
    let kinds: BTreeSet<CellKind> =
        meshes.iter().flat_map(|mesh| &mesh.blocks).map(|block| block.kind).collect();
    for kind in kinds {
        let blocks: Vec<(usize, &CellBlock)> =
            meshes.iter().enumerate().filter_map(|(index, mesh)| Some((index, mesh.block(kind)?))).collect();
        let nodes = blocks.iter().flat_map(|&(index, block)| {
            let first = first_points[index];
            block.nodes.iter().map(move |node| first + node)
        });
        let mut whole = CellBlock::new(kind, nodes.collect());
        whole.data = joined(blocks.iter().map(|(_, block)| (&block.data, block.len())));
        let body = blocks.iter().flat_map(|&(index, block)| {
            let (first, given) = (numbered[index].1 as f64, block.data.get("body"));
            (0..block.len()).map(move |cell| first + given.map_or(0.0, |given| given.values[cell]))
        });
        whole.data.insert("body".into(), DataArray::scalar(body.collect()));
        for name in ["label", "thing"] {
            let Some(numbers) = whole.data.get_mut(name) else { continue };
            numbers.values.iter_mut().filter(|number| number.is_nan()).for_each(|number| *number = 0.0);
        }
        result.blocks.push(whole);
    }
    result
}

/// Joins data one after another; each part has the given number of items.
fn joined<'a>(
    parts: impl Iterator<Item = (&'a BTreeMap<String, DataArray>, usize)> + Clone,
) -> BTreeMap<String, DataArray> {
    let mut names: BTreeMap<&str, usize> = BTreeMap::new();
    for (data, _) in parts.clone() {
        names.extend(data.iter().map(|(name, array)| (name.as_str(), array.components)));
    }
    let join = |(name, components): (&str, usize)| {
        let mut values = Vec::new();
        for (data, items) in parts.clone() {
            match data.get(name) {
                Some(array) => values.extend_from_slice(&array.values),
                None => values.resize(values.len() + items * components, f64::NAN),
            }
        }
        (name.to_owned(), DataArray { components, values })
    };
    names.into_iter().map(join).collect()
}
