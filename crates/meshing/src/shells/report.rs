//! Report on fitted shells, in words and numbers.

use std::fmt;

use pliant_geometry::Vector3;
use serde::Serialize;

use crate::error::counted;
use crate::report::hausdorff::Hausdorff;

/// Distances of shells from their target, and their shape.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct ShellReport {
    /// Number of shells.
    pub shells: usize,
    /// Number of their vertices.
    pub nodes: usize,
    /// Least and mean shape of their flat triangles, 4 √3 A / Σ l²: 1 is equilateral.
    pub shape: [f64; 2],
    /// Distances from the curved shells to the target, and back [m].
    pub distances: Hausdorff,
    /// Place of the largest distance [m].
    pub farthest: [f64; 3],
    /// Distances of the flat triangles of the vertices from the target, and back [m].
    pub flat: Hausdorff,
    /// Diagonal of the target's box [m].
    pub diagonal: f64,
    /// Rounds of refinement.
    pub rounds: usize,
    /// The requested largest distance as a part of the diagonal; `None` if a number of shells is requested.
    pub asked: Option<f64>,
    /// True if the goal was reached.
    pub reached: bool,
    /// True if the bound on work or on rounds ended the fit short of its goal.
    pub stopped: bool,
    /// Vertices on sharp edges of the target, where faces meet at more than 45°: they have no normal.
    pub sharp: usize,
    /// Vertices where the surface folds too sharply for a normal within 60° of all triangles, or for curved
    /// shells that do not cross. They have no normal: `normal` is zero there.
    pub creases: Flaw,
    /// Shells that are as flat as their triangles, since curved they would cross others or be farther from
    /// the target.
    pub flattened: Flaw,
    /// Shells that pass through themselves or each other.
    pub crossings: Flaw,
}

/// Number and place of occurrences of a flaw.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize)]
pub struct Flaw {
    /// Number of occurrences.
    pub count: usize,
    /// Place of the first one [m].
    pub place: Option<[f64; 3]>,
}

impl Flaw {
    pub(super) fn of(count: usize, place: Option<Vector3>) -> Self {
        Self { count, place: place.map(Into::into) }
    }

    fn place(&self) -> String {
        millimetres(&self.place.unwrap_or_default())
    }
}

fn millimetres([x, y, z]: &[f64; 3]) -> String {
    format!("({:.1}, {:.1}, {:.1}) mm", 1e3 * x, 1e3 * y, 1e3 * z)
}

impl ShellReport {
    /// Warnings for a user of the shells, in sentences: a goal that was missed, crossings, flat shells,
    /// creases.
    pub fn warnings(&self) -> Vec<String> {
        let missed = (!self.reached).then(|| self.missed());
        let crossings = (self.crossings.count > 0).then(|| {
            format!(
                "{} through other shells or {}, at {} and elsewhere: so do flat triangles there; the surface may pass through itself, \
                 or a smaller error or more shells help",
                counted(self.crossings.count, "shell passes", "shells pass"),
                if self.crossings.count == 1 { "itself" } else { "themselves" },
                self.crossings.place(),
            )
        });
        let creases = (self.creases.count > 0).then(|| {
            format!(
                "{} without a normal, at {} and elsewhere: the surface folds too sharply there for one within 60° of all triangles, \
                 or for curved shells that do not cross; in a scene they are creases",
                counted(self.creases.count, "node is", "nodes are"),
                self.creases.place(),
            )
        });
        let flat = (self.flattened.count > 0).then(|| {
            format!(
                "{} flat, at {} and elsewhere: curved they would pass through others or be farther off; cell data `flat` says which, and a scene keeps \
                 them flat",
                counted(self.flattened.count, "shell is", "shells are"),
                self.flattened.place(),
            )
        });
        missed.into_iter().chain(crossings).chain(flat).chain(creases).collect()
    }

    /// True if the shells cross or miss the goal.
    pub(super) fn fails(&self) -> bool {
        self.crossings.count > 0 || !self.reached
    }

    /// Rank of the shells; the least is best. Number of shells that cross, true if they miss the goal, and
    /// largest distance [m].
    pub(super) fn rank(&self) -> (usize, bool, f64) {
        (self.crossings.count, !self.reached, self.distances.largest())
    }

    fn missed(&self) -> String {
        let Some(asked) = self.asked else {
            let remedy = "the surface allows no more, or ask for fewer";
            return format!(
                "not reached: {} shells are the most that the work allowed makes; {remedy}",
                self.shells
            );
        };
        let off = self.distances.largest();
        format!(
            "not reached: {} % was asked for; the best so far is {:.3} % ({:.2} mm off) at {}. {}",
            (1e8 * asked).round() / 1e6,
            100.0 * off / self.diagonal,
            1e3 * off,
            millimetres(&self.farthest),
            if self.stopped {
                "The work of a fit is bounded: ask for a larger error, or smooth or crop the surface"
            } else {
                "There the surface may pass through itself or have creases"
            }
        )
    }
}

impl fmt::Display for ShellReport {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        writeln!(
            f,
            "shells           {} with {} nodes, after {} rounds",
            self.shells, self.nodes, self.rounds
        )?;
        writeln!(
            f,
            "shape            {:.2} at least, {:.2} on average (1: equilateral)",
            self.shape[0], self.shape[1]
        )?;
        if self.sharp > 0 {
            let nodes = counted(self.sharp, "node", "nodes");
            writeln!(f, "sharp edges      {nodes}, which have no normal: in a scene they are creases")?;
        }
        let [there, back] = self.distances.lines(self.diagonal, ["shells to target", "target to shells"]);
        writeln!(f, "{there}\n{back}")?;
        writeln!(f, "farthest apart   at {}", millimetres(&self.farthest))?;
        let [there, back] = self.flat.lines(self.diagonal, ["were they flat  ", "and back        "]);
        write!(f, "{there}\n{back}")?;
        self.warnings().iter().try_for_each(|warning| write!(f, "\nwarning: {warning}"))
    }
}
