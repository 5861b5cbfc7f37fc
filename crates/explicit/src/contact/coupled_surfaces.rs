//! Coupled nodes: nodes of surfaces that another solver moves. That solver gives their places; no impulse
//! moves them, and their impulses are summed for it.

use nalgebra::Vector3;
use pliant_mechanics::tensor::{Vector, add};

use super::{Free, Nodes};
use crate::lanes::LaneNumber;

/// The coupled nodes of a model.
pub(super) struct CoupledSurfaces {
    /// Nodes of the model; coupled nodes are numbered from here on.
    first: usize,
    /// The times [s] between which they go, and where they are then [m].
    times: [f64; 2],
    ways: Vec<[Vector<f64>; 2]>,
    /// Shares of that time at the beginning and the end of the step.
    time_fractions: [f64; 2],
    /// Impulse [N s] on each node since the nodes were led.
    impulses: Vec<Vector<f64>>,
}

impl CoupledSurfaces {
    /// Coupled nodes with these places at rest [m], in a model with `first` nodes of its own. They stay until
    /// they are led.
    pub fn new(first: usize, rest: &[Vector<f64>]) -> Self {
        Self {
            first,
            times: [0.0, 1.0],
            ways: rest.iter().map(|&place| [place; 2]).collect(),
            time_fractions: [0.0; 2],
            impulses: vec![[0.0; 3]; rest.len()],
        }
    }

    /// Returns the place [m] at rest of a coupled node, by its number.
    pub fn rest(&self, number: usize) -> Vector3<f64> {
        self.ways[number - self.first][0].into()
    }

    /// Returns the place of a node among the coupled nodes; `None` for a node of the model.
    pub fn place_of(&self, number: u32) -> Option<usize> {
        (number as usize).checked_sub(self.first)
    }

    pub fn lead(&mut self, times: [f64; 2], ways: &[[Vector<f64>; 2]]) {
        self.times = times;
        self.ways.copy_from_slice(ways);
        self.impulses.fill([0.0; 3]);
    }

    /// Begins a step between two times [s].
    pub fn go(&mut self, times: [f64; 2]) {
        let [from, to] = self.times;
        self.time_fractions = times.map(|time| (time - from) / (to - from));
    }

    pub fn impulses(&self) -> &[Vector<f64>] {
        &self.impulses
    }

    pub fn press(&mut self, coupled: usize, impulse: Vector3<f64>) {
        let sum = &mut self.impulses[coupled];
        *sum = add(*sum, impulse.into());
    }

    fn at(&self, coupled: usize, time_fraction: f64) -> Vector3<f64> {
        let [from, to] = self.ways[coupled].map(Vector3::from);
        from.lerp(&to, time_fraction)
    }

    /// Returns the motion of a coupled node; `None` for a node of the model.
    pub fn free(&self, number: u32) -> Option<Free> {
        let coupled = self.place_of(number)?;
        Some(Free { then: self.at(coupled, self.time_fractions[1]).into(), mobility: [0.0; 3] })
    }

    /// Finds where nodes are before the step [m], by their places among `numbers`.
    pub fn place<R: LaneNumber>(
        &self,
        nodes: impl Iterator<Item = u32>,
        numbers: &[u32],
        rest: &[Vector3<f64>],
        now: &Nodes<'_, R>,
        places: &mut [Vector3<f64>],
    ) {
        for node in nodes.map(|node| node as usize) {
            places[node] = self.place_at(numbers[node], &rest[node], now.displacement);
        }
    }

    /// Returns the place [m] of a node before the step, by its number and its place at rest.
    pub(crate) fn place_at<R: LaneNumber>(
        &self,
        number: u32,
        rest: &Vector3<f64>,
        displacement: &[Vector<R>],
    ) -> Vector3<f64> {
        match self.place_of(number) {
            None => rest + Vector3::from(displacement[number as usize].map(|x| x.to_f64())),
            Some(coupled) => self.at(coupled, self.time_fractions[0]),
        }
    }
}
