//! Total Lagrangian explicit dynamics (Miller et al. 2007) of the solids of a
//! [`Model`](pliant_mechanics::Model), and equilibria by dynamic relaxation. The crate has force kernels in
//! lanes, central differences, and the critical time step with its watch. SI units throughout.
//!
//! [`Model`](pliant_mechanics::Model) is constant, [`State`] changes, [`CentralDifference`] advances a state
//! on a model:
//!
//! ```
//! use pliant_explicit::{CentralDifference, State, critical_step};
//! use pliant_mechanics::Model;
//! use pliant_mechanics::law::{AnyLaw, NeoHookean, Volumetric};
//! use pliant_mechanics::load::Load;
//! use pliant_mechanics::model::{Cells, Material, Solid};
//!
//! // One tetrahedron, one face held, falling under its own weight.
//! let mut model = Model::default();
//! let tet = model.add_body("tet", &[[0.0, 0.0, 0.0], [0.1, 0.0, 0.0], [0.0, 0.1, 0.0], [0.0, 0.0, 0.1]]);
//! let law = AnyLaw::NeoHookean(NeoHookean { shear: 1000.0, volumetric: Volumetric::quadratic(10_000.0) });
//! let cells = Cells::tet4(vec![[0, 1, 2, 3]], &model.rest);
//! model.add_solid(Solid::new(tet, Material::elastic(law, 1000.0), cells));
//! model.fix("base", vec![0, 1, 2]);
//! model.loads.push(Load::gravity(tet, [0.0, 0.0, -9.81]));
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
mod collective;
mod contact;
pub mod critical_step;
mod damping_force;
mod dynamic_relaxation;
mod eigenvalues;
mod energies;
mod forces;
mod foresight;
mod history;
mod lanes;
pub mod mass_scaling;
mod node_pass;
pub mod recover;
mod relaxation;
mod scalar;
pub mod stability;
mod stability_record;
mod state;
mod step_control;
mod step_error;
mod stepper;
mod substeps;
mod tangent;

pub use contact::NodeContact;
pub use damping_force::{DISSIPATION, DampingFactors};
pub use dynamic_relaxation::{
    Convergence, DynamicRelaxation, Equilibrium, Iteration, RelaxationError, RelaxationSettings, Way,
};
pub use energies::{BALANCE_LIMIT, BALANCE_STEPS, Sums, balance_floor, model_balance_floor};
pub use forces::Deformed;
pub use history::History;
pub use lanes::{Instructions, MissingInstructions, PACK, Pack};
pub use relaxation::{Relaxation, Series};
pub use scalar::Scalar;
pub use state::{State, Work};
pub use step_control::{Clock, Lengths, StepControl};
pub use step_error::StepError;
pub use stepper::{CentralDifference, NO_MASS, Observable, Wanted};
