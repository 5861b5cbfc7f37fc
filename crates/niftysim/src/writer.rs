//! The text of a scene as it grows: lines, curves and named sets.

use std::collections::{BTreeMap, BTreeSet};

use pliant_geometry::{Mesh, boundary};

use super::conditions::{LoadShape, sorted};
use super::geometry::Solid;
use super::material::Material;
use super::system::System;

/// Most pairs of the written curve HILLY: one for each step, or straight lines with an error of at most 1e-5.
const HILLY_POINTS: f64 = 2000.0;
/// π as NiftySim has it, in the curve HILLY.
#[expect(clippy::approx_constant, reason = "NiftySim's")]
const PI: f64 = 3.14159_f32 as f64;
/// From this excess over 1 on, in NiftySim's step after the total time, POLY345 continues there.
const TOLD_EXCESS: f64 = 1e-5;

/// The scene so far.
pub(super) struct Writer {
    pub system: System,
    pub laws: Vec<Material>,
    /// Tables of bodies and what acts on them.
    pub tables: String,
    pub notes: Vec<String>,
    pub missing: Vec<String>,
    /// Number of tables of each name.
    pub numbers: BTreeMap<&'static str, usize>,
    /// Tables of poses, with their file names.
    pub files: Vec<(String, String)>,
}

impl Writer {
    /// A name with the next number of its kind.
    pub fn numbered(&mut self, kind: &'static str) -> String {
        let number = self.numbers.entry(kind).or_insert(0);
        *number += 1;
        format!("{kind}-{}", *number - 1)
    }

    /// The curve of a load, or of a motion.
    pub fn curve(&mut self, shape: LoadShape, moves: bool) {
        let total = self.system.total;
        match shape {
            LoadShape::Polynomial => {
                let s = self.system.end() / total;
                let excess = s * s * s * (10.0 - s * (15.0 - 6.0 * s)) - 1.0;
                if excess > TOLD_EXCESS {
                    self.note(&format!(
                        "POLY345: in the one step after the total time NiftySim's load still grows, by a fraction {excess:.1e}; the \
                         scene's load does not"
                    ));
                }
                self.line("curve = \"polynomial-10-15-6\"".into());
                self.line(format!("to = {total:?}"));
            }
            LoadShape::Ramp => {
                let end = self.system.end();
                self.line(format!(
                    "curve = {{ table = [[0.0, 0.0], [{end:?}, {:?}]] }}  # t / {total:?} s, also in the step after the total time",
                    end / total
                ));
            }
            LoadShape::RampHold => {
                self.line("curve = \"ramp\"".into());
                self.line(format!("to = {:?}  # a tenth of the total time", 0.1 * total));
            }
            LoadShape::Step => {
                self.line("curve = \"hold\"".into());
                // Nodes that jump during the run would throw its energies off balance.
                if moves {
                    self.note("STEP of a Disp: the nodes start displaced; NiftySim displaces them in its first step");
                    return;
                }
                self.line(format!(
                    "from = {:?}  # half a step: NiftySim applies it after its first step",
                    0.5 * self.system.step
                ));
            }
            LoadShape::Hilly => self.hilly(),
        }
    }

    fn hilly(&mut self) {
        let System { total, step, .. } = self.system;
        self.line(format!("# s exp(cos 4πs − 1), s = t / {total:?} s"));
        self.line("curve = { table = [".into());
        let steps = (self.system.end() / step).round();
        let count = steps.min(HILLY_POINTS);
        let point = |i: u32| {
            let time = self.system.end() * (f64::from(i) / count);
            let s = time / total;
            let factor = s * ((4.0 * PI * s).cos() - 1.0).exp();
            format!("[{time:?}, {factor:.9}]")
        };
        let points: Vec<String> = (0..=count as u32).map(point).collect();
        for row in points.chunks(4) {
            self.line(format!("    {},", row.join(", ")));
        }
        self.line("] }".into());
    }

    pub fn line(&mut self, line: String) {
        self.tables.push_str(&line);
        self.tables.push('\n');
    }

    /// Notes something once.
    pub fn note(&mut self, note: &str) {
        if !self.notes.iter().any(|known| known == note) {
            self.notes.push(note.to_owned());
        }
    }
}

/// Outcome of the conversion of faces to a set of a mesh.
pub(super) struct Faces {
    /// Number of faces on the boundary.
    pub outside: usize,
    /// Number of other faces.
    pub inside: usize,
    /// True if they are the whole boundary, which needs no set.
    pub whole: bool,
}

/// Adds faces as cells of a named set; those that are not on the boundary stay out.
pub(super) fn add_faces(mesh: &mut Mesh, solid: Solid, set: &str, faces: &[Vec<u32>]) -> Faces {
    let surface = boundary(mesh);
    let key = |nodes: &[u32]| sorted(nodes.to_vec());
    let outer: BTreeSet<Vec<u32>> = surface.faces.iter().map(|face| key(face.nodes())).collect();
    let given: BTreeMap<Vec<u32>, &Vec<u32>> = faces.iter().map(|face| (key(face), face)).collect();
    let (on, off): (Vec<_>, Vec<_>) = given.into_iter().partition(|(key, _)| outer.contains(key));
    let whole = on.len() == outer.len();
    if !whole && !on.is_empty() {
        let block = mesh.block_mut(solid.face());
        let first = block.len() as u32;
        block.nodes.extend(on.iter().flat_map(|(_, face)| face.iter()));
        block.sets.insert(set.to_owned(), (first..first + on.len() as u32).collect());
    }
    Faces { outside: on.len(), inside: off.len(), whole }
}
