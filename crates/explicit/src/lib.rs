//! Total Lagrangian explicit dynamics (Miller et al. 2007) of the solids of a [`Model`](pliant_mechanics::Model), and equilibria by
//! dynamic relaxation: force kernels in lanes, central differences, the critical time step and its watch. SI units throughout.
//!
//! [`Model`] is constant, [`State`] changes, [`CentralDifference`] advances a state on a model:
//!
//! ```
//! use pliant_mechanics::curve::{Curve, Shape};
//! use pliant_mechanics::law::{AnyLaw, NeoHookean, Volumetric};
//! use pliant_mechanics::load::{Load, LoadKind};
//! use pliant_mechanics::model::{Body, Cells, Constraint, Material, Model, Motion, Solid};
//! use pliant_explicit::{CentralDifference, State, critical_step};
//!
//! // One tetrahedron, one face held, falling under its own weight.
//! let rest = vec![[0.0, 0.0, 0.0], [0.1, 0.0, 0.0], [0.0, 0.1, 0.0], [0.0, 0.0, 0.1]];
//! let mut model = Model { mass: vec![0.0; 4], rest, ..Model::default() };
//! model.bodies.push(Body { name: "block".into(), nodes: 0..4, damping: 0.0 });
//! let volumetric = Volumetric::quadratic(10_000.0);
//! let law = AnyLaw::NeoHookean(NeoHookean { shear: 1000.0, volumetric });
//! let material = Material { law, prony: Default::default(), density: 1000.0 };
//! let cells = Cells::tet4(vec![[0, 1, 2, 3]], &model.rest);
//! model.add_solid(Solid { body: 0, material, cells, fibre: vec![], original: vec![0] });
//! let motion = Motion::Fixed;
//! model.constraints.push(Constraint { name: "base".into(), nodes: vec![0, 1, 2], components: [true; 3], motion });
//! let gravity = LoadKind::Gravity { body: 0, acceleration: [0.0, 0.0, -9.81] };
//! let curve = Curve { shape: Shape::Hold, from: 0.0, to: 1.0 };
//! model.loads.push(Load { name: "gravity".into(), kind: gravity, curve, surface: None });
//!
//! let step = 0.9 * critical_step::element_bound(&model).unwrap().step;
//! let mut state = State::<f64>::at_rest(&model);
//! let mut stepper = CentralDifference::new(model.clone(), step)?;
//! for _ in 0..10 {
//!     stepper.evaluate(&mut state)?;
//!     stepper.advance(&mut state);
//! }
//! assert!(state.displacement[3][2] < 0.0);
//! # Ok::<(), Box<dyn std::error::Error>>(())
//! ```

mod applied;
pub mod critical_step;
mod dynamic_relaxation;
mod energies;
mod forces;
mod lanes;
pub mod recover;
mod relaxation;
pub mod stability;
mod state;
mod step_control;
mod step_error;
mod stepper;
mod tangent;

pub use dynamic_relaxation::{
    Convergence, DynamicRelaxation, Equilibrium, Iteration, RelaxationError, RelaxationSettings, Way,
};
pub use energies::{BALANCE_LIMIT, BALANCE_STEPS, Sums, balance_floor, model_balance_floor};
pub use forces::{Deformed, Scalar};
pub use lanes::{Instructions, MissingInstructions, PACK, Pack};
pub use relaxation::{Relaxation, Series};
pub use state::{History, State, Work};
pub use step_control::{Clock, Lengths, StepControl};
pub use step_error::StepError;
pub use stepper::{CentralDifference, Observable};
