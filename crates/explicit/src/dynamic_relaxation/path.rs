//! The way of loads to an instant, and equilibria before it.

use pliant_mechanics::Energies;
use pliant_mechanics::count;
use pliant_mechanics::tensor::Vector;
use serde::{Deserialize, Serialize};

use super::SHORTEST;
use crate::lanes::LaneNumber;

/// Record of the equilibrium a state stands at, besides the state: a restart needs it to show the equilibrium
/// again.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct Equilibrium<R> {
    /// Energies [J].
    pub energies: Energies,
    /// Internal minus applied force [N] of each node.
    pub residual: Vec<Vector<R>>,
    /// Way to the equilibrium.
    pub way: Way<R>,
}

/// The way through the equilibria found so far, as far as the work along it needs it.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct Way<R> {
    /// Equilibria found.
    #[serde(deserialize_with = "count::read")]
    pub equilibria: u64,
    /// Estimated error of the external work [J]: the trapezia less the integral. The error of the first
    /// trapezium is known if the next way isn't much shorter.
    pub error: Option<f64>,
    /// Estimated error of the displacements over the largest one, at worst.
    pub displacement_error: f64,
    /// Motion [m] of each node from the last equilibrium but one to the last, and its change of load and
    /// reaction [N].
    pub(super) last: Vec<[Vector<R>; 2]>,
}

impl<R> Way<R> {
    /// True if the way belongs to a model with `nodes` nodes.
    pub fn fits(&self, nodes: usize) -> bool {
        self.last.len() == if self.equilibria > 0 { nodes } else { 0 }
    }
}

impl<R: LaneNumber> Way<R> {
    /// Extends the way by motions [m] and changes of the forces from outside [N].
    pub(super) fn go_on(&mut self, next: Vec<[Vector<R>; 2]>) {
        let square = |way: &[[Vector<R>; 2]]| -> f64 {
            way.iter().flat_map(|[motion, _]| motion).map(|x| x.to_f64().powi(2)).sum()
        };
        let [a, b] = [&self.last, &next].map(|way| square(way).sqrt());
        if a > 0.0 && b > 0.0 {
            let product =
                |u: &Vector<R>, f: &Vector<R>| -> f64 { (0..3).map(|c| u[c].to_f64() * f[c].to_f64()).sum() };
            // T_ab − T_a − T_b.
            let difference: f64 = (self.last.iter().zip(&next))
                .map(|([u, f], [v, g])| 0.5 * (product(u, g) - product(v, f)))
                .sum();
            let of =
                |length: f64, other: f64| difference * length * length / (3.0 * other * (length + other));
            // A short way says little about a long one.
            let latest = of(b, a.max(SHORTEST * b));
            self.error = match self.error {
                None if self.equilibria == 1 && b >= SHORTEST * a => Some(latest + of(a, b)),
                before => before.map(|before| before + latest),
            };
        }
        self.equilibria += 1;
        self.last = next;
    }
}

/// Instant that is sought or passed. It has the loads and motions of a time [s], or at the start a part of
/// those at time 0.
#[derive(Clone, Copy, Debug)]
pub(super) struct Instant {
    pub(super) time: f64,
    pub(super) part: f64,
}

/// Quantity that grows on the way to the next equilibrium.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum LoadPath {
    /// The part of what acts at time 0, from 0 to 1.
    Start,
    /// Time.
    Time,
}

impl LoadPath {
    pub(super) fn instant(self, reached: f64) -> Instant {
        match self {
            Self::Start => Instant { time: 0.0, part: reached },
            Self::Time => Instant { time: reached, part: 1.0 },
        }
    }

    /// The time [s] over which laws relax.
    pub(super) fn duration(self, from: f64, to: f64) -> f64 {
        self.instant(to).time - self.instant(from).time
    }
}
