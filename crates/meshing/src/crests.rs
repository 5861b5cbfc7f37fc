//! Crests and grooves that the boundary of a mesh cuts off: where the middle of a boundary edge is far from the surface, the
//! edge is turned, or halved at the surface and the points round it moved, if the tets stay as long as they must be.

use pliant_geometry::Vector3;

use crate::complex::OUTSIDE;
use crate::optimise::Optimiser;

/// Sweeps over the edges that are off.
const SWEEPS: usize = 3;

/// Points whose faces are this far off (root mean square) slide first, by these lengths, in lattice constants.
const STEEP: f64 = 0.03;
const SLIDES: [f64; 4] = [0.25, 0.15, 0.09, 0.05];

/// Edges with their middle nearer to the surface than this, in lattice constants, stay.
const NEAR: f64 = 0.06;

/// A change must leave the largest distance from the surface below this part of what it was.
const GAIN: f64 = 0.9;

/// Rounds of moves round a new point.
const ROUNDS: usize = 6;

impl Optimiser<'_> {
    /// Turns and halves edges of the boundary that cut off crests and grooves, leaving acoustic lengths of `aim` × ideal.
    pub(crate) fn follow_crests(&mut self, aim: f64) {
        for reach in SLIDES {
            self.fit(aim, reach * self.edge, STEEP, &|sides| sides & OUTSIDE != 0);
        }
        for _ in 0..SWEEPS {
            let mut changes = 0;
            for (_, edge) in self.edges_off() {
                if self.off_middle(edge).is_some_and(|off| off > NEAR * self.edge)
                    && (self.turn(edge, aim) || self.halve(edge, aim))
                {
                    changes += 1;
                }
            }
            if changes == 0 {
                break;
            }
        }
    }

    /// Boundary edges whose middle is off the surface, the farthest first.
    fn edges_off(&self) -> Vec<(f64, [u32; 2])> {
        let mut off: Vec<(f64, [u32; 2])> = Vec::new();
        for node in
            (0..self.complex.points.len() as u32).filter(|&n| self.complex.sides[n as usize] & OUTSIDE != 0)
        {
            let mut ends: Vec<u32> = self.complex.rim_of(node, |_| true).concat();
            ends.sort_unstable();
            ends.dedup();
            for end in ends.into_iter().filter(|&end| end > node) {
                let distance = self.surfaces.off(OUTSIDE, &self.middle([node, end]));
                if distance > NEAR * self.edge {
                    off.push((distance, [node, end]));
                }
            }
        }
        off.sort_by(|a, b| b.0.total_cmp(&a.0).then(a.1.cmp(&b.1)));
        off
    }

    fn middle(&self, edge: [u32; 2]) -> Vector3 {
        let [p, q] = edge.map(|node| self.complex.points[node as usize]);
        (p + q) / 2.0
    }

    /// Largest distance of the middles of boundary edges and faces round some nodes [m].
    fn worst_off(&self, nodes: &[u32]) -> f64 {
        let mut worst = 0.0_f64;
        for &node in nodes.iter().filter(|&&node| self.complex.sides[node as usize] & OUTSIDE != 0) {
            for face in self.complex.rim_of(node, |_| true) {
                let [a, b, c] = face.map(|n| self.complex.points[n as usize]);
                for point in [(a + b) / 2.0, (b + c) / 2.0, (c + a) / 2.0, (a + b + c) / 3.0] {
                    worst = worst.max(self.surfaces.off(OUTSIDE, &point));
                }
            }
        }
        worst
    }

    /// How far the middle of an edge is from the surface [m], if it still is one of the boundary.
    fn off_middle(&self, edge: [u32; 2]) -> Option<f64> {
        let there = self.complex.rim_of(edge[0], |_| true).iter().any(|face| face.contains(&edge[1]));
        there.then(|| self.surfaces.off(OUTSIDE, &self.middle(edge)))
    }

    /// Turns an edge where the new one is nearer to the surface.
    fn turn(&mut self, edge: [u32; 2], aim: f64) -> bool {
        let surfaces = &self.surfaces;
        let allowed = GAIN * surfaces.off(OUTSIDE, &self.middle(edge));
        let follows = |middle: &Vector3| surfaces.off(OUTSIDE, middle) <= allowed;
        self.complex.turn(edge, aim * self.ideal, &follows)
    }

    /// Halves an edge at the surface; undone where its tets stay too short.
    fn halve(&mut self, [p, q]: [u32; 2], aim: f64) -> bool {
        let middle = self.middle([p, q]);
        let Some(place) = self.surfaces.project(OUTSIDE, &middle, 0.15 * self.edge) else { return false };
        let sides = self.complex.sides[p as usize] & self.complex.sides[q as usize];
        if sides.count_ones() != 2 || (place - middle).norm() > 0.4 * self.edge {
            return false;
        }
        let banks = [p, q].map(|node| self.complex.neighbours(node)).concat();
        let off_before = self.worst_off(&banks);
        let new = self.complex.bisect([p, q], place);
        let mut round: Vec<u32> = self.complex.neighbours(new);
        round.push(new);
        let before: Vec<Vector3> = round.iter().map(|&node| self.complex.points[node as usize]).collect();
        for sweep in 0..ROUNDS {
            for &node in &round {
                self.move_up(node, aim * self.ideal, if sweep % 2 == 0 { 0.2 } else { 0.1 } * self.edge);
            }
        }
        let mut all: Vec<u32> = round.iter().flat_map(|&node| self.complex.neighbours(node)).collect();
        all.sort_unstable();
        all.dedup();
        if self.worst_off(&all) < GAIN * off_before
            && self.complex.sides[new as usize] == sides
            && round.iter().all(|&node| self.is_long(node, aim * self.ideal))
        {
            return true;
        }
        for (&node, point) in round.iter().zip(before) {
            self.complex.points[node as usize] = point;
        }
        let end = self.complex.points[q as usize];
        self.complex.collapse(new, q, end);
        false
    }
}
