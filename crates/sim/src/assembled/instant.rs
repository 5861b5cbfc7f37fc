//! Values of an assembled participant that an observer sees.

use std::fmt::Write;

use nalgebra::Vector3;
use pliant_contact::lag::Lag;
use pliant_contact::pose::Leg;
use pliant_contact::pressure::{faces, pressures};
use pliant_explicit::NodeContact;
use pliant_implicit::AssemblyState;
use pliant_mechanics::Energies;
use pliant_mechanics::model::Enclosed;

use super::*;
use crate::instant::{CellsNow, Effort, Instant};
use crate::snapshot::Iterated;
use crate::solids::SolidCells;

impl Instant for Assembled {
    fn time(&self) -> f64 {
        self.time
    }

    fn displacement(&self, node: usize) -> [f64; 3] {
        (self.state.position[node] - self.bodies.model.place(node)).into()
    }

    fn velocity(&self, node: usize) -> [f64; 3] {
        self.state.velocity[node].into()
    }

    fn rotation(&self, node: usize) -> [f64; 3] {
        self.state.rotation[node].scaled_axis().into()
    }

    fn nodal_reaction(&self, node: usize) -> [f64; 3] {
        self.held(6 * node)
    }

    fn nodal_reaction_moment(&self, node: usize) -> [f64; 3] {
        self.held(6 * node + 3)
    }

    fn reaction(&self, constraint: usize) -> [f64; 3] {
        self.reactions[constraint]
    }

    fn enclosed(&self, constraint: usize) -> Option<Enclosed> {
        self.enclosed[constraint]
    }

    fn contact_forces(&self) -> Vec<[f64; 3]> {
        self.contact.as_ref().map(|now| now.totals.clone()).unwrap_or_default()
    }

    fn contact_moments(&self) -> Option<Vec<[f64; 3]>> {
        Some(self.contact.as_ref().map(|now| now.moments.clone()).unwrap_or_default())
    }

    fn contact_nodes(&self) -> Vec<NodeContact> {
        let (Some(now), Some(contact)) = (&self.contact, &self.bodies.model.contact) else {
            return Vec::new();
        };
        let numbers = contact.contacts.nodes();
        let touch = |node: u32| {
            let found = now.nodes.binary_search_by_key(&node, |touched| touched.node);
            found.ok().map(|at| &now.nodes[at])
        };
        let pushes: Vec<Vector3<f64>> = numbers
            .iter()
            .map(|&node| touch(node).map_or_else(Vector3::zeros, |touched| touched.push.into()))
            .collect();
        let places: Vec<Vector3<f64>> =
            numbers.iter().map(|&node| self.state.position[node as usize]).collect();
        let pressures = pressures(&faces(&contact.contacts, &numbers), &pushes, &places);
        let node_contact = |(node, pressure): (u32, Option<f64>)| {
            let (at, touched) = (6 * node as usize, touch(node));
            NodeContact {
                node,
                force: [0, 1, 2].map(|c| now.forces[at + c]),
                pressure,
                gap: touched.map(|touched| touched.gap),
                slip: touched.map(|touched| touched.slip),
            }
        };
        numbers.into_iter().zip(pressures).map(node_contact).collect()
    }

    fn leg(&self, rigid: usize) -> Option<&Leg> {
        self.method.contact()?.legs().get(&(rigid as u32))
    }

    fn lag(&self, rigid: usize) -> Option<&Lag> {
        self.method.contact()?.lags().iter().find(|lag| lag.number() == rigid)
    }

    fn lag_of_constraint(&self, constraint: usize) -> Option<&Lag> {
        self.method.lags().iter().find(|lag| lag.number() == constraint)
    }

    fn energies(&self) -> Energies {
        self.energies
    }

    fn cells(&self) -> Option<Box<dyn CellsNow + '_>> {
        Some(Box::new(SolidCells::new(&self.model, self.solids.as_ref()?)))
    }

    fn shells(&self) -> Option<&AssemblyState> {
        Some(&self.state)
    }

    fn is_single(&self) -> bool {
        false
    }

    fn steps(&self) -> u64 {
        self.done
    }

    /// The balance is not judged.
    fn balance_floor(&self) -> f64 {
        f64::INFINITY
    }

    fn effort(&self) -> Option<Effort> {
        (!matches!(self.method, SolverMethod::Explicit(_))).then(|| self.effort.clone())
    }

    fn convergence(&self) -> Option<String> {
        let mut table = String::from("step,attempt,time,iteration,residual,allowed,found\n");
        for Iterated { step, attempt, time, iteration, residual, allowed, found } in &self.convergence {
            let found = u8::from(*found);
            // Writing to a String cannot fail.
            let _ = writeln!(table, "{step},{attempt},{time},{iteration},{residual:e},{allowed:e},{found}");
        }
        (!self.convergence.is_empty()).then_some(table)
    }

    fn least_gap(&self) -> Option<f64> {
        self.contact.as_ref()?.gap
    }

    fn ended(&self) -> Option<&str> {
        self.path.ended.as_deref()
    }
}
