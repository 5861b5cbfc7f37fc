//! The time step of a run. It comes from the mesh and the laws, or is requested and then compared with the
//! critical time step of the assembled model.

use pliant_explicit::critical_step::ElementBound;
use pliant_format::Scene;
use pliant_format::diagnostic::{Diagnostic, SceneErrors};
use pliant_format::tables::{SolverName, StepChoice};
use pliant_geometry::words::{counted, number};
use pliant_implicit::ExplicitShells;
use pliant_sim::{Critical, ImplicitBodies, SAFETY, Steps};
use serde::Serialize;

use crate::assemble::Built;
use crate::target::Target;

/// A step that is shortened by more than this part is reported.
const SHORTENED: f64 = 1e-3;
/// Automatic step [s] of implicit runs.
pub(crate) const IMPLICIT_STEP: f64 = 0.01;

/// The step of a run and what limits it.
#[derive(Clone, Debug)]
pub struct Plan {
    /// Its steps; a whole number of them makes the duration.
    pub steps: Steps,
    /// Limits of explicit steps of solids; `None` for shells, and for solids whose equations are solved.
    pub limits: Option<Limits>,
    /// A remark about a requested step.
    pub note: Option<String>,
    /// The device and the number type.
    pub target: Target,
}

/// Limits of explicit steps.
#[derive(Clone, Debug)]
pub struct Limits {
    /// The critical time step, and the element bound below it.
    pub critical: Critical,
    /// The cell that sets the bound.
    pub limiting: LimitingElement,
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
        write!(
            f,
            "element {} ({}) of `{}` at ({x:.4}, {y:.4}, {z:.4}) m",
            self.number, self.element, self.body
        )
    }
}

/// Chooses the step and the device.
///
/// # Errors
/// If the requested step is above the critical time step of the assembled model, or the scene can't run on
/// the requested device.
pub fn plan(scene: &Scene, built: &Built) -> Result<Plan, SceneErrors> {
    let fail = |diagnostic| Err(scene.source.errors(vec![diagnostic]));
    let (limits, note) = match &built.implicit {
        Some(part) => (None, check_explicit_step(scene, part)),
        None => match limits(scene, built) {
            Ok((limits, note)) => (Some(limits), Ok(note)),
            Err(diagnostic) => return fail(*diagnostic),
        },
    };
    let note = match note {
        Ok(note) => note,
        Err(diagnostic) => return fail(*diagnostic),
    };
    let target = match Target::choose(scene, built) {
        Ok(target) => target,
        Err(diagnostic) => return fail(*diagnostic),
    };
    let steps = steps(limits.as_ref(), scene, built, scene.scene.until);
    let mut plan = Plan { steps, limits, note, target };
    if let Some(ends) = &plan.steps.ends {
        let times: Vec<String> = ends.iter().map(|&end| number(end)).collect();
        plan.note = Some(format!("the load steps end at t = {} s", times.join(", ")));
    }
    if let StepChoice::Seconds(asked) = scene.run.step
        && plan.steps.step < asked * (1.0 - SHORTENED)
    {
        let [asked, until, step] = [asked, scene.scene.until, plan.steps.step].map(number);
        let steps = counted(plan.steps.number as usize, "step");
        let message = format!(
            "a step of {asked} s does not divide the {until} s of the scene: it takes {steps} of {step} s"
        );
        plan.note = Some(plan.note.map_or(message.clone(), |note| format!("{note}; {message}")));
    }
    Ok(plan)
}

/// Compares an explicit step of shells with the critical one.
fn check_explicit_step(scene: &Scene, part: &ImplicitBodies) -> Result<Option<String>, Box<Diagnostic>> {
    let StepChoice::Seconds(step) = scene.run.step else { return Ok(None) };
    let stable = ExplicitShells::stable_step(&part.model);
    if scene.run.solver != SolverName::Explicit || step <= stable {
        return Ok(None);
    }
    let message = format!(
        "the step {} s is above the critical time step {} s: it would be unstable",
        number(step),
        number(stable)
    );
    let help = "take `step = \"auto\"`, or `solver = \"implicit\"` for long steps";
    let place = scene.source.span(&scene.run_at("step"));
    Err(Box::new(Diagnostic::error(message).at(place, "too large").help(help)))
}

/// Returns the limits of the steps of solids, and a remark about a requested step.
fn limits(scene: &Scene, built: &Built) -> Result<(Limits, Option<String>), Box<Diagnostic>> {
    let fail = |diagnostic| Err(Box::new(diagnostic));
    let critical = match Critical::of(&built.model) {
        Ok(Some(critical)) => critical,
        Ok(None) => return fail(Diagnostic::error("the scene has no elements")),
        Err(contradiction) => return fail(Diagnostic::error(contradiction.to_string())),
    };
    let Critical { bound, assembled } = &critical;
    let limiting = limiting_element(built, bound);
    let note = match scene.run.step {
        StepChoice::Seconds(step) if scene.run.solver == SolverName::Explicit => {
            if step > assembled.step {
                let message = format!(
                    "the step {} s is above the critical time step {} s of the assembled model: it would be unstable",
                    number(step),
                    number(assembled.step)
                );
                let help = format!(
                    "the element bound {} s is set by {limiting}; take `step = \"auto\"` ({} s), a step below {} s, or \
                     a mesh without small cells there",
                    number(bound.step),
                    number(critical.automatic()),
                    number(assembled.step)
                );
                let place = scene.source.span(&scene.run_at("step"));
                return fail(Diagnostic::error(message).at(place, "too large").help(help));
            }
            note_on_step(step, assembled.step)
        }
        _ => None,
    };
    Ok((Limits { critical, limiting }, note))
}

/// The steps of a scene of a duration [s].
pub(crate) fn steps(limits: Option<&Limits>, scene: &Scene, built: &Built, until: f64) -> Steps {
    let longest = match scene.run.step {
        StepChoice::Seconds(step) => step,
        StepChoice::Auto(_) => match (scene.run.solver, limits, &built.implicit) {
            (SolverName::QuasiStatic | SolverName::Static, ..)
                if let Some(ends) = scene.run.load_steps.ends(until) =>
            {
                let number = ends.len() as u64;
                return Steps { step: until / number as f64, number, ends: Some(ends) };
            }
            (SolverName::QuasiStatic | SolverName::Static, ..) => scene.run.load_steps.first(until),
            (SolverName::Explicit, Some(limits), _) => limits.critical.automatic(),
            (SolverName::Explicit, None, Some(part)) => SAFETY * ExplicitShells::stable_step(&part.model),
            _ => IMPLICIT_STEP.min(until),
        },
    };
    Steps::within(until, longest)
}

fn note_on_step(step: f64, limit: f64) -> Option<String> {
    (step > SAFETY * limit).then(|| {
        format!(
            "the step {} s is close to the critical time step {} s of the assembled model: stable at rest, with little reserve for deformation",
            number(step),
            number(limit)
        )
    })
}

fn limiting_element(built: &Built, bound: &ElementBound) -> LimitingElement {
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

#[cfg(test)]
mod tests {
    use super::*;
    use crate::testing::{built, scene};

    fn planned(more: &str) -> Result<Plan, SceneErrors> {
        plan(&scene(more), &built(more))
    }

    #[test]
    fn an_automatic_step_is_a_whole_part_of_the_duration_below_the_critical_step() {
        let plan = planned("").unwrap();
        let limits = plan.limits.as_ref().unwrap();
        assert!(
            plan.steps.step <= SAFETY * limits.critical.assembled.step
                && limits.critical.bound.step <= limits.critical.assembled.step
        );
        assert!((plan.steps.step * plan.steps.number as f64 - 0.1).abs() < 1e-15);
        assert!(
            0.1 / (plan.steps.number - 1) as f64 > SAFETY * limits.critical.assembled.step,
            "one step fewer would be too large"
        );
        assert_eq!((limits.limiting.body.as_str(), limits.limiting.element.as_str()), ("cube", "hex8"));
        assert!(plan.note.is_none());
    }

    #[test]
    fn a_step_is_held_against_bound_and_critical_step() {
        let automatic = planned("").unwrap().limits.unwrap();
        let asked = |step: f64| planned(&format!("[run]\nstep = {step:e}\n"));
        let close = asked(0.95 * automatic.critical.assembled.step).unwrap();
        assert!(close.note.is_some_and(|note| note.contains("close to the critical time step")));
        // A whole part of the duration, or the note reports that it is shortened.
        let below = automatic.critical.bound.step.min(0.9 * automatic.critical.assembled.step);
        assert_eq!(asked(0.1 / (0.1 / below).ceil()).unwrap().note, None);
        let refused = asked(1.001 * automatic.critical.assembled.step).unwrap_err().plain().to_string();
        for piece in [
            "cube.toml:",
            "above the critical time step",
            "is set by element 0 (hex8) of `cube`",
            "`step = \"auto\"`",
        ] {
            assert!(refused.contains(piece), "no `{piece}` in {refused}");
        }
    }

    #[test]
    fn a_step_that_does_not_divide_the_duration_is_told() {
        let with = |step: &str| planned(&format!("[run]\nsolver = 'quasi-static'\nstep = {step}\n")).unwrap();
        let plan = with("0.03");
        assert_eq!((plan.steps.number, plan.steps.step), (4, 0.025));
        let note = plan.note.unwrap();
        for piece in ["0.03", "does not divide", "4 steps of 0.025"] {
            assert!(note.contains(piece), "no `{piece}` in {note}");
        }
        assert_eq!(with("0.025").note, None);
    }

    #[test]
    fn unequal_load_steps_end_where_they_are_told_to_and_with_the_scene() {
        let plan =
            planned("[run]\nsolver = 'quasi-static'\nload-steps = { times = [0.01, 0.04] }\n").unwrap();
        assert_eq!(plan.steps.ends.as_deref(), Some([0.01, 0.04, 0.1].as_slice()));
        let of = |time: f64| (plan.steps.number_from(time), plan.steps.step_from(time));
        assert_eq!([of(0.0), of(0.01)], [(1, 0.01), (2, 0.03)]);
        assert_eq!((of(0.04).0, of(0.1).1), (3, 0.1 - 0.04));
        assert_eq!([1, 2, 3].map(|number| plan.steps.end_of(number)), [0.01, 0.04, 0.1]);
    }

    #[test]
    fn a_duration_below_one_step_takes_one() {
        let scene = crate::testing::read(&crate::testing::CUBE.replace("until = 0.1", "until = 1e-6"));
        let plan = plan(&scene, &built("")).unwrap();
        assert_eq!((plan.steps.number, plan.steps.step), (1, 1e-6));
    }
}
