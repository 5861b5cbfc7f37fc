//! A participant as observers read it. Numbers of any precision come out as `f64`.

use nalgebra::Translation3;
use pliant_contact::lag::Lag;
use pliant_contact::pose::{Leg, Pose, Stance};
use pliant_contact::touch::Rigid;
use pliant_explicit::NodeContact;
use pliant_explicit::recover::CellFields;
use pliant_explicit::stability::Stability;
use pliant_mechanics::Energies;
use pliant_mechanics::count;
use pliant_mechanics::model::Enclosed;
use serde::{Deserialize, Serialize};

use crate::reals::Reals;
use crate::solver::Equilibria;

/// A participant at the instant last evaluated. Nodes and constraints are numbered in its model.
pub trait Instant {
    /// Time [s].
    fn time(&self) -> f64;

    /// Whole steps done.
    fn steps(&self) -> u64;

    /// Displacement [m] of a node.
    fn displacement(&self, node: usize) -> [f64; 3];

    /// Displacements [m] of all nodes in the stepper's own numbers, where it keeps them; `None` of one that
    /// keeps positions. They stay at their address as long as the simulation lives, over steps that fail,
    /// [`restore`](crate::Simulation::restore) and [`exchange`](crate::Simulation::exchange), too. Of a state
    /// on a GPU, those last brought back.
    fn displacements(&self) -> Option<Reals<'_>> {
        None
    }

    /// Velocity [m/s] of a node.
    fn velocity(&self, node: usize) -> [f64; 3];

    /// Rotation vector [rad] of a node.
    fn rotation(&self, _node: usize) -> [f64; 3] {
        [0.0; 3]
    }

    /// Force [N] by which constraints hold or move a node; zero along components that are free.
    fn nodal_reaction(&self, node: usize) -> [f64; 3];

    /// Moment [N m] by which constraints hold or turn a node.
    fn nodal_reaction_moment(&self, node: usize) -> [f64; 3];

    /// Force [N] that holds or moves the nodes of a constraint, summed.
    fn reaction(&self, constraint: usize) -> [f64; 3];

    /// Volume that a constraint of volume encloses; `None` for other constraints.
    fn enclosed(&self, _constraint: usize) -> Option<Enclosed> {
        None
    }

    /// Force [N] of each contact on the rigid thing that it is with, in the order of the contacts.
    fn contact_forces(&self) -> Vec<[f64; 3]> {
        Vec::new()
    }

    /// Moment [N m] about the origin of the force of each contact on its rigid thing, in the order of the
    /// contacts. `None` where the moments are not found: on a GPU.
    fn contact_moments(&self) -> Option<Vec<[f64; 3]>> {
        None
    }

    /// The nodes that may touch something, increasing, with what contacts do to them.
    fn contact_nodes(&self) -> Vec<NodeContact> {
        Vec::new()
    }

    /// Way of a tool or a jaw that was driven from outside, by its index among the rigid things of the
    /// contacts.
    fn leg(&self, _rigid: usize) -> Option<&Leg> {
        None
    }

    /// Lag of a rigid thing with limited force behind its trajectory, by its index among the rigid things of
    /// the contacts.
    fn lag(&self, _rigid: usize) -> Option<&Lag> {
        None
    }

    /// Lag of the nodes of a constraint with limited force behind their motion. For a volume with limited
    /// pressure, the first axis has the lag of the volume [m³].
    fn lag_of_constraint(&self, _constraint: usize) -> Option<&Lag> {
        None
    }

    /// Pose of a rigid thing, or of the tool of a jaw, and the angle [rad] between the jaws.
    fn posture(&self, number: usize, rigid: &Rigid) -> (Pose, f64) {
        let (pose, opening) = rigid.posture(self.time(), self.leg(number));
        (Translation3::from(self.lag(number).map(Lag::now).unwrap_or_default()) * pose, opening)
    }

    /// The pose of a rigid thing, of a jaw its own.
    fn pose(&self, number: usize, rigid: &Rigid) -> Pose {
        let lag = self.lag(number).map(Lag::now).unwrap_or_default();
        Translation3::from(lag) * rigid.at(self.time(), self.leg(number))
    }

    /// Pose and growth of a rigid thing; a jaw has its own pose.
    fn stance(&self, number: usize, rigid: &Rigid) -> Stance {
        Stance { pose: self.pose(number, rigid), growth: rigid.trajectory.growth(self.time()) }
    }

    /// Energies [J].
    fn energies(&self) -> Energies;

    /// Finds the fields of cells of solids, where there are some.
    fn cells(&self) -> Option<Box<dyn CellsNow + '_>> {
        None
    }

    /// The state of shells, and of solids whose equations are solved.
    fn shells(&self) -> Option<&pliant_implicit::State> {
        None
    }

    /// True if the participant is computed in single precision.
    fn is_single(&self) -> bool;

    /// Energy [J] above which the balance of energies is judged; infinite where it never is.
    fn balance_floor(&self) -> f64;

    /// The largest energy so far [J].
    fn largest_energy(&self) -> f64 {
        0.0
    }

    /// The critical time step as it was monitored.
    fn stability(&self) -> Stability {
        Stability::default()
    }

    /// Quality of its equilibria; `None` for a participant without dynamic relaxation.
    fn equilibria(&self) -> Option<Equilibria> {
        None
    }

    /// Cost of its equations; `None` of a participant that solves none.
    fn effort(&self) -> Option<Effort> {
        None
    }

    /// Residuals of its last iterations, as a table; `None` of a participant that solves no equations.
    fn convergence(&self) -> Option<String> {
        None
    }

    /// The least gap [m] in contacts with barriers; `None` where nothing is near.
    fn least_gap(&self) -> Option<f64> {
        None
    }

    /// Reason why it has ended before its last step.
    fn ended(&self) -> Option<&str> {
        None
    }
}

/// Effort for the equations of an implicit or a static run.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct Effort {
    /// Iterations of Newton's method in all.
    #[serde(deserialize_with = "count::read")]
    pub newton_iterations: u64,
    /// Linear equations solved.
    #[serde(deserialize_with = "count::read")]
    pub solutions: u64,
    /// Iterations of conjugate gradients in all; 0 with factors.
    #[serde(deserialize_with = "count::read")]
    pub linear_iterations: u64,
    /// Linear equations that single precision on a GPU could not solve, and that the CPU finished.
    #[serde(deserialize_with = "count::read")]
    pub left_to_cpu: u64,
    /// Residual of the last solution by conjugate gradients over its right-hand side; 0 with factors.
    pub linear_residual: f64,
    /// Residual of the last step over the largest of loads, internal and inertial forces; `None` where it was
    /// not checked.
    pub residual: Option<f64>,
    /// Steps that were halved.
    #[serde(deserialize_with = "count::read")]
    pub halved: u64,
    /// Steps whose iterations ran out, and that were taken as they were.
    #[serde(deserialize_with = "count::read")]
    pub unconverged: u64,
    /// Wall time of forces and stiffness of the cells [s].
    pub seconds_cells: f64,
    /// Wall time of contacts [s].
    pub seconds_contact: f64,
    /// Wall time of factorising, or of making the preconditioner [s].
    pub seconds_factors: f64,
    /// Wall time of solving with them [s].
    pub seconds_solution: f64,
    /// Beginning of the first unstable equilibrium [s], seen from a negative pivot.
    pub unstable_from: Option<f64>,
}

/// Finds fields of cells at an instant.
pub trait CellsNow: Sync {
    /// The fields of a cell of a solid; its stable step [s], too, if it is wanted.
    fn at(&self, solid: usize, cell: usize, step: bool) -> CellFields;

    /// `width` numbers of each cell of a solid, which `of` writes from its fields. Stable steps [s] are among
    /// these if `steps` are wanted; they cost far more than the rest.
    fn numbers(
        &self,
        solid: usize,
        steps: bool,
        width: usize,
        of: &(dyn Fn(&CellFields, &mut [f64]) + Sync),
    ) -> Vec<f64>;
}
