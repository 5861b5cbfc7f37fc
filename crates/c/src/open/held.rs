//! The grips by which a program holds a simulation.

use std::collections::BTreeMap;

use pliant_mechanics::grip::Grip;
use pliant_sim::Simulation;

use crate::status::{Fault, PliantStatus};

/// Grips of a program.
#[derive(Default)]
pub(crate) struct Held {
    /// Grips by their number.
    grips: BTreeMap<u32, Grip>,
    /// Number of the next grip: numbers of released grips are not used again.
    next: u32,
}

impl Held {
    fn grips(&self) -> Vec<Grip> {
        self.grips.values().cloned().collect()
    }

    /// Lets all grips act.
    pub(crate) fn put_on(&self, simulation: &mut Simulation) -> Result<(), Fault> {
        match simulation.grip(&self.grips()) {
            true => Ok(()),
            false => {
                let message = "nothing can be held here: the solver does not support grips, or a grip has nodes of several participants";
                Err(Fault::new(PliantStatus::Unsupported, message))
            }
        }
    }

    pub(crate) fn get(&mut self, number: u32) -> Result<&mut Grip, Fault> {
        match self.grips.get_mut(&number) {
            Some(grip) => Ok(grip),
            None if number < self.next => {
                Err(Fault::new(PliantStatus::Closed, format!("the grip {number} is released")))
            }
            None => Err(Fault::new(PliantStatus::BadHandle, format!("there is no grip {number}"))),
        }
    }

    /// Takes one more grip; its number.
    pub(crate) fn add(&mut self, grip: Grip) -> u32 {
        let number = self.next;
        self.next += 1;
        self.grips.insert(number, grip);
        number
    }

    /// Releases a grip.
    pub(crate) fn remove(&mut self, number: u32) {
        self.grips.remove(&number);
    }
}
