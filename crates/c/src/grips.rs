//! Hands and pins: springs between a part of a body and a place that the program moves.

use pliant_mechanics::grip::Grip;

use crate::context::PliantContext;
use crate::open::Running;
use crate::pointers::{array, finite, give, needed, numbers};
use crate::simulation::{PliantSimulation, running};
use crate::status::{Fault, PliantError, PliantStatus};

impl Running {
    /// Holds a combination of nodes at its present place, with the given stiffness or the largest stable one.
    fn take(&mut self, nodes: Vec<(u32, f64)>, stiffness: f64) -> Result<u32, Fault> {
        if stiffness.is_nan() || stiffness <= 0.0 {
            let message = format!("`stiffness` is {stiffness}: it must be above 0; infinity makes a pin");
            return Err(Fault::new(PliantStatus::NotANumber, message));
        }
        self.see_places()?;
        let mut grip = Grip { nodes, ..Grip::default() };
        grip.stiffness = stiffness.min(self.simulation.stiffest(&grip));
        if !(grip.stiffness.is_finite() && grip.stiffness > 0.0) {
            let message = "these nodes cannot be held: they belong to several participants, or the solver needs a finite `stiffness`";
            return Err(Fault::new(PliantStatus::Unsupported, message));
        }
        [grip.place, _] = self.simulation.pulled(&grip);
        let number = self.held.add(grip);
        if let Err(fault) = self.held.put_on(&mut self.simulation) {
            self.held.remove(number);
            let _ = self.held.put_on(&mut self.simulation);
            return Err(fault);
        }
        Ok(number)
    }
}

/// Takes hold of nodes by a spring of a stiffness [N/m]; infinite is a pin. It acts on their mean by
/// `weights`, which need not sum to 1; null weighs all the same. The stiffness is at most the one with which
/// steps stay stable; `pliant_grip` reports it. `grip` gets the number of the grip. The grip pulls nothing
/// until it is moved.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn pliant_grip_nodes(
    context: *const PliantContext,
    simulation: PliantSimulation,
    nodes: *const u32,
    weights: *const f64,
    count: usize,
    stiffness: f64,
    grip: *mut u32,
    error: *mut PliantError,
) -> PliantStatus {
    // SAFETY: the caller promises valid pointers.
    unsafe {
        running(context, simulation, error, |running| {
            needed(grip, "grip")?;
            let nodes = array(nodes, count, "nodes")?;
            let node_count = running.nodes();
            if count == 0 || nodes.iter().any(|&node| node as usize >= node_count) {
                let message =
                    format!("a grip needs at least one node, with numbers from 0 to {}", node_count - 1);
                return Err(Fault::new(PliantStatus::Unknown, message));
            }
            let same = vec![1.0; count];
            let weights = if weights.is_null() { &same[..] } else { array(weights, count, "weights")? };
            finite(weights, "weights")?;
            let sum: f64 = weights.iter().sum();
            if weights.iter().any(|&weight| weight < 0.0) || sum <= 0.0 || !sum.is_finite() {
                let message = "`weights` must be at least 0, with a sum that is finite and above 0";
                return Err(Fault::new(PliantStatus::NotANumber, message));
            }
            let mut held: Vec<(u32, f64)> =
                nodes.iter().copied().zip(weights.iter().map(|weight| weight / sum)).collect();
            held.sort_by_key(|(node, _)| *node);
            held.dedup_by(|(b, more), (a, weight)| {
                let same = a == b;
                *weight += if same { *more } else { 0.0 };
                same
            });
            give(grip, "grip", running.take(held, stiffness)?)
        })
    }
}

/// Takes hold of a surface around its vertex that is nearest to a point [m], as a hand does. The grip holds
/// the connected surface within a radius [m] of that vertex at rest, less with the distance. With a radius of
/// 0 it holds the vertex alone. Stiffness and number are as in `pliant_grip_nodes`.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn pliant_grip_surface(
    context: *const PliantContext,
    simulation: PliantSimulation,
    surface: u32,
    point: *const f64,
    radius: f64,
    stiffness: f64,
    grip: *mut u32,
    error: *mut PliantError,
) -> PliantStatus {
    // SAFETY: the caller promises valid pointers.
    unsafe {
        running(context, simulation, error, |running| {
            needed(grip, "grip")?;
            let point: [f64; 3] = numbers(point, "point")?;
            finite(&[radius], "radius")?;
            if radius < 0.0 {
                return Err(Fault::new(PliantStatus::NotANumber, "`radius` must be at least 0"));
            }
            running.see_places()?;
            running.surface(surface)?;
            let skin = &running.surfaces[surface as usize].skin;
            let (mut nearest, mut least) = (0, f64::INFINITY);
            skin.positions(&running.world, &running.simulation, |vertex, place| {
                let apart = (0..3).map(|c| (place[c] - point[c]).powi(2)).sum();
                if apart < least {
                    (nearest, least) = (vertex as u32, apart);
                }
            });
            let held = skin.around(&running.simulation, nearest, radius);
            give(grip, "grip", running.take(held, stiffness)?)
        })
    }
}

/// Moves a grip to a place [m]: it pulls its nodes there from the next step on.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn pliant_grip_move(
    context: *const PliantContext,
    simulation: PliantSimulation,
    grip: u32,
    place: *const f64,
    error: *mut PliantError,
) -> PliantStatus {
    // SAFETY: the caller promises valid pointers.
    unsafe {
        running(context, simulation, error, |running| {
            let place = numbers(place, "place")?;
            running.held.get(grip)?.place = place;
            running.held.put_on(&mut running.simulation)
        })
    }
}

/// A grip at an instant.
#[repr(C)]
#[derive(Clone, Copy, Debug)]
pub struct PliantGrip {
    /// Mean place of its nodes [m].
    pub point: [f64; 3],
    /// Place to which the grip pulls [m].
    pub place: [f64; 3],
    /// Its force on the body [N].
    pub force: [f64; 3],
    /// Its stiffness [N/m].
    pub stiffness: f64,
}

/// Reports the pull of a grip.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn pliant_grip(
    context: *const PliantContext,
    simulation: PliantSimulation,
    grip: u32,
    now: *mut PliantGrip,
    error: *mut PliantError,
) -> PliantStatus {
    // SAFETY: the caller promises valid pointers.
    unsafe {
        running(context, simulation, error, |running| {
            running.see_places()?;
            let held = running.held.get(grip)?.clone();
            let [point, force] = running.simulation.pulled(&held);
            give(now, "now", PliantGrip { point, place: held.place, force, stiffness: held.stiffness })
        })
    }
}

/// Releases a grip.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn pliant_grip_release(
    context: *const PliantContext,
    simulation: PliantSimulation,
    grip: u32,
    error: *mut PliantError,
) -> PliantStatus {
    // SAFETY: the caller promises valid pointers.
    unsafe {
        running(context, simulation, error, |running| {
            running.held.get(grip)?;
            running.held.remove(grip);
            running.held.put_on(&mut running.simulation)
        })
    }
}
