//! Errors of a step that could not be taken, with place, time and remedy.

use pliant_mechanics::model::Model;
use pliant_mechanics::tensor::cast;

use crate::lanes::LaneNumber;
use crate::stability::StepLimit;
use crate::state::State;

/// The name of a node's body and the node's number in it.
fn located(model: &Model, node: u32) -> (String, u32) {
    let (body, node) = model.locate_node(node);
    (model.bodies[body].name.clone(), node)
}

/// Returns the place in an element as text, if it is a corner.
pub(crate) fn at_corner(corner: bool, node: u32) -> String {
    if corner { format!(" at its corner at node {node}") } else { String::new() }
}

/// Reason why a step could not be taken.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum StepError {
    /// A displacement is not a number or infinite.
    #[error("the displacement of node {node} of `{body}` is no longer finite at t = {time:.6} s")]
    NotFinite {
        /// The body.
        body: String,
        /// The node, numbered in its body.
        node: u32,
        /// Time [s].
        time: f64,
    },
    /// A cell is turned inside out.
    #[error(
        "element {element} of `{body}` is inverted{} (det F = {determinant:.3e}) at t = {time:.6} s",
        at_corner(*corner, *node)
    )]
    Inverted {
        /// The body.
        body: String,
        /// The element, numbered as in the user's mesh.
        element: u32,
        /// First node of the element, or the node of the corner, numbered in its body.
        node: u32,
        /// True if the inversion is at a corner of a hexahedron, not at its middle.
        corner: bool,
        /// det F there.
        determinant: f64,
        /// Time [s].
        time: f64,
    },
    /// The largest stable step fell below the running one.
    #[error(
        "the largest stable step has fallen to {limit:.3e} s, below the step {step:.3e} s, at t = {time:.6} s: element \
         {element} of `{body}` has become too stiff for it"
    )]
    BelowLimit {
        /// The body.
        body: String,
        /// The element that sets the limit, numbered as in the user's mesh.
        element: u32,
        /// First node of the element, numbered in its body.
        node: u32,
        /// The limit [s].
        limit: f64,
        /// The step [s].
        step: f64,
        /// Time [s].
        time: f64,
    },
    /// Energy appears or vanishes: the run is unstable.
    #[error(
        "the energies are off balance by {:.0} % at t = {time:.6} s; the fastest node is {node} of `{body}`",
        balance * 100.0
    )]
    Unbalanced {
        /// The body of the fastest node.
        body: String,
        /// The fastest node, numbered in its body.
        node: u32,
        /// The balance, as a fraction.
        balance: f64,
        /// Time [s].
        time: f64,
    },
}

impl StepError {
    pub(crate) fn not_finite(model: &Model, node: u32, time: f64) -> Self {
        let (body, node) = located(model, node);
        Self::NotFinite { body, node, time }
    }

    pub(crate) fn inverted(model: &Model, solid: usize, cell: usize, determinant: f64, time: f64) -> Self {
        let solid = &model.solids[solid];
        let (body, node) = located(model, solid.cells.nodes(cell)[0]);
        Self::Inverted { body, element: solid.original[cell], node, corner: false, determinant, time }
    }

    /// Makes the error of a hexahedron with a corner turned inside out.
    pub(crate) fn folded<R: LaneNumber>(
        model: &Model,
        (solid, cell): (usize, usize),
        state: &State<R>,
    ) -> Self {
        let solid = &model.solids[solid];
        let worst = solid.cells.worst_corner(cell, |node| cast(state.displacement[node as usize]));
        let (node, determinant) = worst.unwrap_or((solid.cells.nodes(cell)[0], 0.0));
        let (body, node) = located(model, node);
        Self::Inverted {
            body,
            element: solid.original[cell],
            node,
            corner: true,
            determinant,
            time: state.time,
        }
    }

    pub(crate) fn below_limit(model: &Model, look: &StepLimit, step: f64, time: f64) -> Self {
        let solid = &model.solids[look.solid];
        let (body, node) = located(model, solid.cells.nodes(look.cell)[0]);
        Self::BelowLimit { body, element: solid.original[look.cell], node, limit: look.limit, step, time }
    }

    /// Makes the error of a state whose energies are off balance, with its fastest node.
    pub fn unbalanced(model: &Model, fastest: u32, balance: f64, time: f64) -> Self {
        let (body, node) = located(model, fastest);
        Self::Unbalanced { body, node, balance, time }
    }

    /// Returns advice on what to try.
    pub fn remedy(&self) -> &'static str {
        match self {
            Self::NotFinite { .. } | Self::Unbalanced { .. } => {
                "the step is too large for the deformed state: try a smaller `step`, a slower motion or a smoother curve"
            }
            Self::BelowLimit { .. } => {
                "try a smaller `step` or a slower motion, or let the run cut its steps (`on-unstable = \"substep\"`; into 100 \
                 parts at the most)"
            }
            Self::Inverted { .. } => {
                "try a slower or smaller motion, a smaller `step`, more damping, or a finer mesh there"
            }
        }
    }
}
