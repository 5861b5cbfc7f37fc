//! Which time step a run takes: from the mesh and the laws, or as the user asks, held against the true limit.

use pliant_mechanics::critical_step::{ElementBound, TrueLimit, element_bound, true_limit};
use serde::Serialize;

use crate::build::Built;
use crate::diagnostic::{Diagnostic, SceneErrors};
use crate::format::StepChoice;
use crate::scene::Scene;

/// Part of the element bound that an automatic step takes.
pub const SAFETY: f64 = 0.9;

/// The step of a run and what limits it.
#[derive(Clone, Debug)]
pub struct Plan {
    /// Step [s]; a whole number of them makes the duration.
    pub step: f64,
    /// Steps to take.
    pub steps: u64,
    /// The smallest element bound.
    pub bound: ElementBound,
    /// The limit of the assembled operator.
    pub limit: TrueLimit,
    /// The cell that sets the bound.
    pub limiting: LimitingElement,
    /// What to tell the user about a step that was asked for.
    pub note: Option<String>,
}

/// The cell that sets the element bound.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct LimitingElement {
    /// Its body.
    pub body: String,
    /// `tet4` or `hex8`.
    pub element: String,
    /// Its number, counted from 0 over the cells of its kind.
    pub number: u32,
    /// Its centre at rest [m].
    pub centre: [f64; 3],
}

impl std::fmt::Display for LimitingElement {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        let [x, y, z] = self.centre;
        write!(f, "{} {} of `{}` at ({x:.4}, {y:.4}, {z:.4}) m", self.element, self.number, self.body)
    }
}

/// Chooses the step.
///
/// # Errors
/// If the step asked for is above the true limit.
pub fn plan(scene: &Scene, built: &Built) -> Result<Plan, SceneErrors> {
    let fail = |diagnostic| Err(scene.source.errors(vec![diagnostic]));
    let Some(bound) = element_bound(&built.model) else {
        return fail(Diagnostic::error("the scene has no elements"));
    };
    let limit = match true_limit(&built.model) {
        Ok(limit) => limit,
        Err(contradiction) => return fail(Diagnostic::error(contradiction.to_string())),
    };
    let limiting = limiting_element(built, bound);
    let (asked, note) = match scene.run.step {
        StepChoice::Auto(_) => (SAFETY * bound.step, None),
        StepChoice::Seconds(step) if step > limit.step => {
            let message = format!(
                "the step {step:.4e} s is above the true limit {:.4e} s of the model: it would be unstable",
                limit.step
            );
            let help = format!(
                "the element bound {:.4e} s is set by {limiting}; take `step = \"auto\"` ({:.4e} s), a step below \
                 {:.4e} s, or a mesh without small cells there",
                bound.step,
                SAFETY * bound.step,
                SAFETY * limit.step
            );
            let place = scene.source.span(&["run", "step"]);
            return fail(Diagnostic::error(message).at(place, "too large").help(help));
        }
        StepChoice::Seconds(step) => (step, note_on_step(step, bound.step, limit.step)),
    };
    let steps = (scene.scene.until / asked - 1e-9).ceil().max(1.0);
    Ok(Plan { step: scene.scene.until / steps, steps: steps as u64, bound, limit, limiting, note })
}

fn note_on_step(step: f64, bound: f64, limit: f64) -> Option<String> {
    (step > bound).then(|| {
        format!(
            "the step {step:.4e} s lies between the element bound {bound:.4e} s and the true limit {limit:.4e} s: \
             stable at rest, with little reserve for deformation"
        )
    })
}

fn limiting_element(built: &Built, bound: ElementBound) -> LimitingElement {
    let solid = &built.model.solids[bound.solid];
    let nodes = solid.cells.nodes(bound.cell);
    let mut centre = [0.0; 3];
    for &node in nodes {
        for (c, x) in centre.iter_mut().zip(built.model.rest[node as usize]) {
            *c += x / nodes.len() as f64;
        }
    }
    LimitingElement {
        body: built.model.bodies[solid.body].name.clone(),
        element: solid.cells.element().into(),
        number: solid.original[bound.cell],
        centre,
    }
}
