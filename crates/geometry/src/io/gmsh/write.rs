//! Writes Gmsh 4.1 as text. Cells with the same `label` and the same sets share an entity, whose physical
//! groups are the label's number and the named sets. The cells are numbered in the order of the mesh.

use std::collections::{BTreeMap, BTreeSet};
use std::io::{self, Write};

use super::type_number;
use crate::{CellBlock, CellKind, Mesh};

/// Physical groups of a cell: numbers, the label first.
type Groups = Vec<i64>;

/// The entry of one cell.
struct ElementEntry<'a> {
    kind: CellKind,
    nodes: &'a [u32],
    number: usize,
}

/// Numbers of the physical groups of one dimension.
#[derive(Default)]
struct Physical {
    /// Number by name of the set.
    number: BTreeMap<String, i64>,
}

/// Writes a mesh that was checked before.
pub(crate) fn write(out: &mut dyn Write, mesh: &Mesh) -> io::Result<()> {
    let physical: Vec<Physical> = (0..4).map(|dimension| Physical::new(mesh, dimension)).collect();
    let mut entities: [BTreeMap<Groups, Vec<ElementEntry<'_>>>; 4] = Default::default();
    let mut number = 0;
    let mut of_point = point_groups(mesh, &physical[0]);
    let points: Vec<u32> = (0..mesh.points.len() as u32).collect();
    for block in &mesh.blocks {
        let dimension = block.kind.dimension();
        for (nodes, mut groups) in block.cells().zip(cell_groups(block, &physical[dimension])) {
            number += 1;
            if dimension == 0
                && let Some(more) = of_point.remove(&nodes[0])
            {
                groups.extend(more.into_iter().filter(|group| !groups.contains(group)).collect::<Vec<_>>());
            }
            let element = ElementEntry { kind: block.kind, nodes, number };
            entities[dimension].entry(groups).or_default().push(element);
        }
    }
    for (point, groups) in of_point {
        number += 1;
        let nodes = std::slice::from_ref(&points[point as usize]);
        entities[0].entry(groups).or_default().push(ElementEntry { kind: CellKind::Vertex, nodes, number });
    }

    writeln!(out, "$MeshFormat\n4.1 0 8\n$EndMeshFormat")?;
    write_names(out, &physical)?;
    write_entities(out, mesh, &entities)?;
    write_nodes(out, mesh, &entities)?;
    write_elements(out, &entities)?;
    write_point_data(out, mesh)?;
    write_cell_data(out, mesh, &entities)
}

/// The label of a cell if it can be the number of a physical group.
fn group_of_label(label: f64) -> Option<i64> {
    (label.fract() == 0.0 && (1.0..=f64::from(i32::MAX)).contains(&label)).then_some(label as i64)
}

/// Labels per cell as numbers of physical groups; `None` for cells without.
fn labels(block: &CellBlock) -> Vec<Option<i64>> {
    match block.data.get("label") {
        Some(label) if label.components == 1 => label.values.iter().map(|&l| group_of_label(l)).collect(),
        _ => vec![None; block.len()],
    }
}

impl Physical {
    /// Numbers the sets of a dimension. A set of exactly the cells with one label takes the label's number.
    fn new(mesh: &Mesh, dimension: usize) -> Self {
        let blocks: Vec<&CellBlock> =
            mesh.blocks.iter().filter(|block| block.kind.dimension() == dimension).collect();
        let mut members: BTreeMap<i64, Vec<(CellKind, u32)>> = BTreeMap::new();
        for block in &blocks {
            for (cell, label) in labels(block).into_iter().enumerate() {
                if let Some(label) = label {
                    members.entry(label).or_default().push((block.kind, cell as u32));
                }
            }
        }
        let mut names: BTreeSet<&String> = blocks.iter().flat_map(|block| block.sets.keys()).collect();
        if dimension == 0 {
            names.extend(mesh.point_sets.keys());
        }
        let mut next = members.keys().last().map_or(1, |last| last + 1);
        let mut number = BTreeMap::new();
        for name in names {
            let cells: Vec<(CellKind, u32)> = blocks
                .iter()
                .flat_map(|block| block.sets.get(name).into_iter().flatten().map(|&cell| (block.kind, cell)))
                .collect();
            let label = cells.first().and_then(|&(kind, cell)| {
                let block = blocks.iter().find(|block| block.kind == kind)?;
                group_of_label(*block.data.get("label")?.values.get(cell as usize)?)
            });
            let of_points = mesh.point_sets.get(name).filter(|_| dimension == 0);
            let same = label.filter(|label| {
                members.get(label) == Some(&cells)
                    && of_points.is_none_or(|set| *set == points_of(mesh, &cells))
            });
            let taken = match same {
                Some(label) if !number.values().any(|&taken| taken == label) => label,
                _ => {
                    next += 1;
                    next - 1
                }
            };
            number.insert(name.clone(), taken);
        }
        Self { number }
    }
}

/// The points of vertex cells, increasing, each once.
fn points_of(mesh: &Mesh, cells: &[(CellKind, u32)]) -> Vec<u32> {
    let vertices = mesh.block(CellKind::Vertex).map(|block| block.nodes.as_slice()).unwrap_or_default();
    let mut points: Vec<u32> = cells.iter().map(|&(_, cell)| vertices[cell as usize]).collect();
    points.sort_unstable();
    points.dedup();
    points
}

/// The group of cells without a label: meshio 5.3.5 reads groups of all cells or of none.
const NO_LABEL: i64 = 0;

/// Physical groups per cell.
fn cell_groups(block: &CellBlock, physical: &Physical) -> Vec<Groups> {
    let mut groups: Vec<Groups> =
        labels(block).into_iter().map(|label| vec![label.unwrap_or(NO_LABEL)]).collect();
    for (name, set) in &block.sets {
        let Some(&number) = physical.number.get(name) else { continue };
        for &cell in set {
            let groups = &mut groups[cell as usize];
            if !groups.contains(&number) {
                groups.push(number);
            }
        }
    }
    groups
}

/// Physical groups of the points that are in a named set.
fn point_groups(mesh: &Mesh, physical: &Physical) -> BTreeMap<u32, Groups> {
    let mut groups: BTreeMap<u32, Groups> = BTreeMap::new();
    for (name, set) in &mesh.point_sets {
        let Some(&number) = physical.number.get(name) else { continue };
        for &point in set {
            groups.entry(point).or_insert_with(|| vec![NO_LABEL]).push(number);
        }
    }
    groups
}

/// A name between quotes.
fn quoted(name: &str) -> String {
    format!("\"{}\"", name.replace('"', "'").replace(['\n', '\r'], " "))
}

fn write_names(out: &mut dyn Write, physical: &[Physical]) -> io::Result<()> {
    let count: usize = physical.iter().map(|physical| physical.number.len()).sum();
    if count == 0 {
        return Ok(());
    }
    writeln!(out, "$PhysicalNames\n{count}")?;
    for (dimension, physical) in physical.iter().enumerate() {
        for (name, number) in &physical.number {
            writeln!(out, "{dimension} {number} {}", quoted(name))?;
        }
    }
    writeln!(out, "$EndPhysicalNames")
}

type Entities<'a> = [BTreeMap<Groups, Vec<ElementEntry<'a>>>; 4];

fn write_entities(out: &mut dyn Write, mesh: &Mesh, entities: &Entities<'_>) -> io::Result<()> {
    let (low, high) = mesh.bounds().unwrap_or_default();
    let counts: Vec<String> = entities.iter().map(|of_dimension| of_dimension.len().to_string()).collect();
    writeln!(out, "$Entities\n{}", counts.join(" "))?;
    for (dimension, of_dimension) in entities.iter().enumerate() {
        for (tag, (groups, elements)) in (1..).zip(of_dimension) {
            write!(out, "{tag}")?;
            if dimension == 0 {
                let x = elements.first().map_or(low, |element| mesh.points[element.nodes[0] as usize]);
                write!(out, " {:?} {:?} {:?}", x.x, x.y, x.z)?;
            } else {
                for x in low.iter().chain(high.iter()) {
                    write!(out, " {x:?}")?;
                }
            }
            write!(out, " {}", groups.len())?;
            for group in groups {
                write!(out, " {group}")?;
            }
            writeln!(out, "{}", if dimension == 0 { "" } else { " 0" })?;
        }
    }
    writeln!(out, "$EndEntities")
}

/// Writes the nodes as one block, on the first entity of the highest dimension.
fn write_nodes(out: &mut dyn Write, mesh: &Mesh, entities: &Entities<'_>) -> io::Result<()> {
    let dimension = entities.iter().rposition(|of_dimension| !of_dimension.is_empty()).unwrap_or(0);
    let count = mesh.points.len();
    writeln!(out, "$Nodes\n1 {count} 1 {count}\n{dimension} 1 0 {count}")?;
    for number in 1..=count {
        writeln!(out, "{number}")?;
    }
    for x in &mesh.points {
        writeln!(out, "{:?} {:?} {:?}", x.x, x.y, x.z)?;
    }
    writeln!(out, "$EndNodes")
}

fn write_elements(out: &mut dyn Write, entities: &Entities<'_>) -> io::Result<()> {
    // Elements of an entity are sorted by kind; blocks hold one kind each.
    let mut blocks: Vec<(usize, usize, &[ElementEntry<'_>])> = Vec::new();
    for (dimension, of_dimension) in entities.iter().enumerate() {
        for (tag, elements) in (1..).zip(of_dimension.values()) {
            for run in elements.chunk_by(|a, b| a.kind == b.kind) {
                blocks.push((dimension, tag, run));
            }
        }
    }
    let count: usize = blocks.iter().map(|(.., run)| run.len()).sum();
    writeln!(out, "$Elements\n{} {count} 1 {count}", blocks.len())?;
    for (dimension, tag, run) in blocks {
        writeln!(out, "{dimension} {tag} {} {}", type_number(run[0].kind), run.len())?;
        for element in run {
            write!(out, "{}", element.number)?;
            for &node in element.nodes {
                write!(out, " {}", node as usize + 1)?;
            }
            writeln!(out)?;
        }
    }
    writeln!(out, "$EndElements")
}

/// The head of a data section, up to the count of its items.
fn write_head(
    out: &mut dyn Write,
    section: &str,
    name: &str,
    components: usize,
    count: usize,
) -> io::Result<()> {
    writeln!(out, "${section}\n1\n{}\n1\n0.0\n3\n0\n{components}\n{count}", quoted(name))
}

fn write_item(out: &mut dyn Write, number: usize, values: &[f64]) -> io::Result<()> {
    write!(out, "{number}")?;
    for value in values {
        write!(out, " {value:?}")?;
    }
    writeln!(out)
}

fn write_point_data(out: &mut dyn Write, mesh: &Mesh) -> io::Result<()> {
    for (name, array) in &mesh.point_data {
        write_head(out, "NodeData", name, array.components, array.len())?;
        for (number, values) in (1..).zip(array.values.chunks_exact(array.components)) {
            write_item(out, number, values)?;
        }
        writeln!(out, "$EndNodeData")?;
    }
    Ok(())
}

/// Cell data; the `label` only if it differs from the physical groups. Items cover all elements in the
/// order of `$Elements`, NaN for missing ones, because meshio uses the order and not the numbers.
fn write_cell_data(out: &mut dyn Write, mesh: &Mesh, entities: &Entities<'_>) -> io::Result<()> {
    let names: BTreeSet<&String> = mesh.blocks.iter().flat_map(|block| block.data.keys()).collect();
    let order: Vec<usize> =
        entities.iter().flat_map(BTreeMap::values).flatten().map(|element| element.number).collect();
    for name in names {
        let is_said = |block: &CellBlock| name == "label" && labels(block).iter().all(Option::is_some);
        let mut items: Vec<Option<&[f64]>> = Vec::with_capacity(order.len());
        let mut components = 1;
        for block in &mesh.blocks {
            match block.data.get(name).filter(|_| !is_said(block)) {
                Some(array) => {
                    components = array.components;
                    items.extend(array.values.chunks_exact(components).map(Some));
                }
                None => items.resize(items.len() + block.len(), None),
            }
        }
        if items.iter().all(Option::is_none) {
            continue;
        }
        let missing = vec![f64::NAN; components];
        write_head(out, "ElementData", name, components, order.len())?;
        for &number in &order {
            let values = items.get(number - 1).copied().flatten().unwrap_or(&missing);
            write_item(out, number, values)?;
        }
        writeln!(out, "$EndElementData")?;
    }
    Ok(())
}
