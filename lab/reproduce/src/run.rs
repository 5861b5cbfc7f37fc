//! Running a model from rest, through its history or to its equilibrium, by a [`Simulation`].

use std::collections::BTreeMap;

use pliant_mechanics::Model;
use pliant_mechanics::curve::{Curve, Shape};
use pliant_mechanics::tensor::{Vector, dot};
use pliant_sim::{Frame, Method, ParticipantSetup, Precision, Setup, Simulation, Steps};

use crate::CaseError;

/// The name of the only participant.
const NAME: &str = "model";

/// Steps a model from rest to a time [s] by central differences of a given length [s], which is never cut.
/// `look` sees every instant, both ends included.
///
/// # Errors
/// If a step fails or constraints contradict each other.
pub fn run(
    model: &Model,
    precision: Precision,
    step: f64,
    until: f64,
    look: impl FnMut(&Frame<'_>),
) -> Result<Simulation, CaseError> {
    let mut part = ParticipantSetup::explicit(NAME, model.clone(), until)?;
    if let Method::Explicit(settings) = &mut part.method {
        settings.precision = precision;
        settings.critical_step = f64::INFINITY;
    }
    // A time that is a whole number of steps except for round-off takes no further step.
    part.steps = Steps { step, number: (until / step - 1e-9).ceil() as u64, ends: None };
    let end = part.steps.end_of(part.steps.number);
    let mut simulation = Simulation::new(Setup::new(vec![part]))?;
    simulation.run(end, look)?;
    Ok(simulation)
}

/// A model that has come to rest.
pub struct Equilibrium {
    /// Nodal displacements [m].
    pub displacement: Vec<Vector<f64>>,
    /// The largest displacement [m].
    pub largest: f64,
    /// The largest speed of a node [m/s].
    speed: f64,
    /// Force [N] that holds or moves the nodes of each constraint.
    reactions: BTreeMap<String, Vector<f64>>,
}

impl Equilibrium {
    fn of(simulation: &mut Simulation) -> Result<Self, CaseError> {
        let frame = simulation.frame()?;
        let (part, now) =
            frame.parts().next().ok_or_else(|| CaseError::Run("nothing was simulated".into()))?;
        let (model, constraints) = (&part.model, part.model.constraints.iter());
        let length = |v: Vector<f64>| dot(v, v).sqrt();
        let displacement: Vec<_> = (0..model.node_count()).map(|node| now.displacement(node)).collect();
        Ok(Self {
            largest: displacement.iter().map(|&u| length(u)).fold(0.0, f64::max),
            displacement,
            speed: (0..model.node_count()).map(|node| length(now.velocity(node))).fold(0.0, f64::max),
            reactions: constraints
                .enumerate()
                .map(|(at, constraint)| (constraint.name.clone(), now.reaction(at)))
                .collect(),
        })
    }

    /// Force [N] that holds or moves the nodes of a constraint; not a number without a constraint of this
    /// name.
    pub fn reaction(&self, constraint: &str) -> Vector<f64> {
        self.reactions.get(constraint).copied().unwrap_or([f64::NAN; 3])
    }
}

/// Applies the loads and motions of a damped model within `until` seconds and checks that it has come to
/// rest. At its largest final speed, no node may move by more than 1e-7 of the largest displacement in a
/// tenth of a second. The slowest overdamped vibration of these models decays at least by e in this time.
///
/// # Errors
/// If a step fails or the model still moves.
pub fn settle(model: &Model, step: f64, until: f64) -> Result<Equilibrium, CaseError> {
    let rest = Equilibrium::of(&mut run(model, Precision::Double, step, until, |_| ())?)?;
    let creep = 0.1 * rest.speed / rest.largest;
    if creep < 1e-7 { Ok(rest) } else { Err(CaseError::Moving { until, creep }) }
}

/// The equilibrium at 1 s, computed in one load step by dynamic relaxation to a residual of 1e-8 of the
/// largest force.
///
/// # Errors
/// If none exists.
pub fn relax(model: &Model) -> Result<Equilibrium, CaseError> {
    Equilibrium::of(&mut relaxed(model, 1.0, Some(1e-8))?)
}

/// Runs to the equilibrium at a time [s], to a relative residual; the residual of double precision if not
/// given.
pub(crate) fn relaxed(model: &Model, until: f64, tolerance: Option<f64>) -> Result<Simulation, CaseError> {
    let mut part = ParticipantSetup::quasi_static(NAME, model.clone(), until, 1);
    part.method = Method::QuasiStatic { precision: Precision::Double, tolerance };
    let mut simulation = Simulation::new(Setup::new(vec![part]))?;
    simulation.run(until, |_| ())?;
    Ok(simulation)
}

/// Curve from 0 at the start to 1 at a time [s], with a continuous velocity.
pub fn smooth_step(to: f64) -> Curve {
    Curve { shape: Shape::SmoothStep, from: 0.0, to }
}
