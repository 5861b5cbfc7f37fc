//! A simulation that is open, with the threads that it computes on.

use std::sync::{Arc, Mutex, MutexGuard};

use pliant_scene::World;
use pliant_sim::{Simulation, StopFlag};
use rayon::ThreadPool;

use super::field::OpenField;
use super::held::Held;
use super::surface::OpenSurface;
use crate::lock::lock;
use crate::status::{Fault, PliantStatus};

/// The part of a simulation that threads share: one thread runs it, any thread stops it.
pub(crate) struct Shared {
    running: Mutex<Running>,
    pub(crate) stopped: StopFlag,
    /// The process that made it: its threads don't come along into a fork.
    process: u32,
}

impl Shared {
    /// A simulation of this process, which is stopped by a flag.
    pub(crate) fn new(running: Running, stopped: StopFlag) -> Self {
        Self { running: Mutex::new(running), stopped, process: std::process::id() }
    }

    /// The simulation, for the one thread that uses it now.
    pub(crate) fn lock(&self) -> Result<MutexGuard<'_, Running>, Fault> {
        if std::process::id() != self.process {
            let message = "the simulation was opened before a fork, which leaves its threads behind: open it in the new process";
            return Err(Fault::new(PliantStatus::Busy, message));
        }
        lock(&self.running)
    }

    pub(crate) fn stop(&self) {
        self.stopped.ask();
    }
}

/// A simulation with its open surfaces, fields and grips.
pub(crate) struct Running {
    pub(crate) world: Arc<World>,
    pub(crate) simulation: Simulation,
    /// The threads that it computes on: its numbers do not depend on the state of the caller's.
    pub(crate) pool: ThreadPool,
    pub(crate) surfaces: Vec<OpenSurface>,
    pub(crate) fields: Vec<OpenField>,
    pub(crate) held: Held,
}

impl Running {
    /// Does something on the threads of the simulation.
    pub(crate) fn compute<T: Send>(&mut self, what: impl FnOnce(&mut Computing<'_>) -> T + Send) -> T {
        let Self { world, simulation, pool, fields, .. } = self;
        pool.install(|| what(&mut Computing { world, simulation, fields }))
    }

    /// True if the state lies on a GPU.
    fn is_on_device(&self) -> bool {
        #[cfg(feature = "gpu")]
        return self.world.device().is_some();
        #[cfg(not(feature = "gpu"))]
        false
    }

    /// Finds forces at the instant, and reads back what lies on a device.
    pub(crate) fn look(&mut self) -> Result<(), Fault> {
        if self.simulation.is_evaluated() && !self.is_on_device() {
            return Ok(());
        }
        self.compute(|now| now.simulation.frame().map(|_| ()))?;
        Ok(())
    }

    /// Brings places of nodes to ordinary memory.
    pub(crate) fn see_places(&mut self) -> Result<(), Fault> {
        if self.is_on_device() { self.look() } else { Ok(()) }
    }

    pub(crate) fn nodes(&self) -> usize {
        self.simulation.world().parts.iter().map(|part| part.model.node_count()).sum()
    }
}

/// Data for computing on the threads of a simulation.
pub(crate) struct Computing<'r> {
    pub(crate) world: &'r Arc<World>,
    pub(crate) simulation: &'r mut Simulation,
    pub(crate) fields: &'r mut Vec<OpenField>,
}
