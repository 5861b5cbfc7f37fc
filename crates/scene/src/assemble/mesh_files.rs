//! Meshes of files in metres, and the words for their cells.

use pliant_geometry::Mesh;
use pliant_sim::number;

use crate::format::{Cells, MeshTable};

/// An organ larger or smaller than this [m] is probably in other units.
const PLAUSIBLE_SIZE: [f64; 2] = [1e-3, 10.0];

/// A size that no organ has: the mesh is probably not in metres.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct SizeDoubt {
    /// Diagonal of the box [m].
    size: f64,
}

impl SizeDoubt {
    /// `None` for a size that an organ can have, and for a mesh without points.
    pub fn of(mesh: &Mesh) -> Option<Self> {
        let (low, high) = mesh.bounds()?;
        let size = (high - low).norm();
        (!(PLAUSIBLE_SIZE[0]..=PLAUSIBLE_SIZE[1]).contains(&size) && size > 0.0).then_some(Self { size })
    }

    /// Whether it is too large, not too small.
    pub fn is_large(&self) -> bool {
        self.size > PLAUSIBLE_SIZE[1]
    }

    /// What to do; `scale` is how the factor is given, such as `--scale `.
    pub fn advice(&self, scale: &str) -> String {
        match self.size {
            size if size > 1e4 => {
                format!("`{scale}1e-6` brings micrometres to metres, `{scale}0.001` millimetres")
            }
            _ if self.is_large() => {
                format!("`{scale}0.001` brings millimetres to metres, `{scale}0.01` centimetres")
            }
            _ => format!(
                "`{scale}1` is for a file in metres: it is the size of one unit of the file in metres"
            ),
        }
    }
}

impl std::fmt::Display for SizeDoubt {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        let size = number(self.size);
        match self.size {
            size_in_metres if size_in_metres > 1e4 => {
                write!(f, "{size} m across, larger than any organ: its lengths are probably micrometres")
            }
            size_in_metres if size_in_metres > 40.0 => {
                write!(f, "{size} m across, larger than any organ: its lengths are probably millimetres")
            }
            _ if self.is_large() => {
                write!(
                    f,
                    "{size} m across, larger than any organ: its lengths are probably centimetres or millimetres"
                )
            }
            _ => {
                write!(f, "{size} m across, smaller than any organ: it was probably scaled to metres before")
            }
        }
    }
}

/// Brings the mesh of a file to metres; the message and what to do where it is in metres only by default, and too large for that.
pub(super) fn unscaled(mesh: &mut Mesh, table: &MeshTable) -> Option<(String, String)> {
    mesh.points.iter_mut().for_each(|point| *point *= table.factor());
    let doubt = SizeDoubt::of(mesh).filter(|doubt| doubt.is_large() && table.scale.is_none())?;
    let help = format!("{}; `scale = 1` if it is in metres", doubt.advice("scale = "));
    Some((format!("the mesh measures {doubt}"), help))
}

/// The word for cells in messages.
pub(super) fn words(cells: Cells) -> &'static str {
    match cells {
        Cells::Tets => "tets",
        Cells::Hexes => "hexes",
        Cells::ImmersedHexes => "immersed hexes",
        Cells::Surface => "a surface",
        Cells::Shells => "shells",
    }
}
