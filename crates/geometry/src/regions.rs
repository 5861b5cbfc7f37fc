//! Regions of a mesh by the marks of their cells: a label (cell data `label`), or a body, an obstacle or a
//! tool (cell data `body`). Users name regions to hide them, or to change their look.

use std::collections::BTreeMap;

use crate::labels::{CellLabel, Labels, UnknownLabel, most_similar};
use crate::{CellBlock, Mesh, cell_label};

/// Cells with a mark in common.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub enum Region {
    /// Cells of a label.
    Label(i32),
    /// Cells of a body, an obstacle or a tool.
    Body(i32),
}

impl Region {
    /// True if a cell with these marks is in it.
    pub fn has(self, label: Option<i32>, body: i32) -> bool {
        match self {
            Self::Label(wanted) => label == Some(wanted),
            Self::Body(wanted) => body == wanted,
        }
    }
}

/// The body of a cell; 0 in a mesh of a single one.
pub fn cell_body(block: &CellBlock, cell: u32) -> i32 {
    let bodies = block.data.get("body").and_then(|bodies| bodies.values.get(cell as usize));
    bodies.map_or(0, |&body| body as i32)
}

/// The regions of a mesh with their names.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct RegionNames {
    /// Labels.
    pub labels: Labels,
    /// Bodies, obstacles and tools by their number.
    pub bodies: BTreeMap<i32, String>,
}

impl RegionNames {
    /// Names of the regions of a mesh.
    pub fn of(mesh: &Mesh) -> Self {
        Self { labels: Labels::of(mesh), bodies: mesh.body_names.clone() }
    }

    /// The regions of a number, name or range: labels, else bodies of the name.
    ///
    /// # Errors
    /// If nothing has the name or the number.
    pub fn find(&self, name: &CellLabel) -> Result<Vec<Region>, UnknownLabel> {
        let unknown = match self.labels.find_all(name) {
            Ok(labels) => return Ok(labels.into_iter().map(Region::Label).collect()),
            Err(unknown) => unknown,
        };
        let CellLabel::Name(name) = name else { return Err(unknown) };
        let named = self.bodies.iter().filter(|(_, known)| *known == name);
        let found: Vec<Region> = named.map(|(&body, _)| Region::Body(body)).collect();
        match unknown {
            _ if !found.is_empty() => Ok(found),
            UnknownLabel::Name { nearest: None, mut known, .. } if !self.bodies.is_empty() => {
                known.extend(self.bodies.values().cloned());
                known.dedup();
                let nearest = most_similar(name, self.bodies.values());
                Err(UnknownLabel::Region { name: name.clone(), nearest, known })
            }
            unknown => Err(unknown),
        }
    }
}

impl Mesh {
    /// Removes the cells of some regions, with their data and places in sets; all points stay.
    pub fn drop_regions(&mut self, regions: &[Region]) {
        for block in &mut self.blocks {
            let kept = |cell| {
                let (label, body) = (cell_label(block, cell), cell_body(block, cell));
                !regions.iter().any(|region| region.has(label, body))
            };
            let kept: Vec<bool> = (0..block.len() as u32).map(kept).collect();
            block.retain(&kept);
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::{CellKind, DataArray};

    fn mesh() -> Mesh {
        let mut mesh = Mesh { points: vec![crate::Vector3::zeros(); 4], ..Mesh::default() };
        let block = mesh.block_mut(CellKind::Triangle);
        block.nodes.extend([0, 1, 2, 1, 2, 3, 2, 3, 0]);
        block.data.insert("label".into(), DataArray::scalar(vec![1.0, 2.0, 0.0]));
        block.data.insert("body".into(), DataArray::scalar(vec![0.0, 0.0, 1.0]));
        mesh.label_names = [(1, "liver".to_owned()), (2, "tumour".to_owned())].into();
        mesh.body_names = [(0, "liver".to_owned()), (1, "grasper".to_owned())].into();
        mesh
    }

    #[test]
    fn labels_go_before_bodies_of_the_same_name() {
        let names = RegionNames::of(&mesh());
        let find = |name: &str| names.find(&CellLabel::Name(name.into()));
        assert_eq!(find("liver").unwrap(), [Region::Label(1)]);
        assert_eq!(find("grasper").unwrap(), [Region::Body(1)]);
        assert_eq!(find("1-2").unwrap(), [Region::Label(1), Region::Label(2)]);
        let message = find("graper").unwrap_err().to_string();
        assert!(message.contains("did you mean `grasper`?") && message.contains("2 (tumour)"), "{message}");
        let message = find("tumor").unwrap_err().to_string();
        assert!(message.contains("did you mean `tumour`?"), "{message}");
    }

    #[test]
    fn cells_of_a_label_or_a_body_are_removed() {
        let left = |region| {
            let mut mesh = mesh();
            mesh.drop_regions(&[region]);
            mesh.blocks[0].nodes.clone()
        };
        assert_eq!(left(Region::Label(1)), [1, 2, 3, 2, 3, 0]);
        assert_eq!(left(Region::Body(1)), [0, 1, 2, 1, 2, 3]);
        assert_eq!(left(Region::Body(7)).len(), 9);
    }
}
