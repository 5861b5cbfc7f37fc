//! Improves a tetrahedral mesh for explicit dynamics, where the smallest acoustic length sets the time step.
//! Tets below a rising threshold lose an edge, are flipped or change their material. Then points move to
//! improve their worst tet. Points between sides stay between them. No edge exceeds 1.6 lattice constants.
//! Lengths are measured in the local lattice constant, which may be graded. Deterministic: work follows the
//! order of numbers, and a fixed sequence rotates the directions of trial moves.

use std::cell::OnceCell;

use pliant_geometry::{CellKind, Vector3};
use rayon::prelude::*;
use serde::Serialize;

use crate::input::surfaces::Surfaces;
use crate::tets::complex::{Complex, OUTSIDE, Sides, acoustic_length};
use crate::tets::guard::Guard;

/// Threshold of the first round, in ideal acoustic lengths.
const FIRST_THRESHOLD: f64 = 0.3;

/// Rounds aim this much higher than the target, because the critical time step depends on the number of tets
/// near the smallest length. With 1 it was 3 % lower for the brain phantom at 10 mm.
const AIM: f64 = 1.07;

/// The threshold reaches its goal in this part of the rounds.
const RAMP: f64 = 0.6;

/// Sweeps over the points in a round, and the factor by which trial moves shrink from sweep to sweep.
const SWEEPS: usize = 3;
const SHRINK: f64 = 0.6;

/// First trial moves, in lattice constants.
const REACH: f64 = 0.15;

/// Largest shift of surfaces, in lattice constants.
const LARGEST_SHIFT: f64 = 0.25;

/// Sweeps that slide points to follow a surface, and their first moves in lattice constants.
const FIT_SWEEPS: usize = 5;
const FIT_REACH: f64 = 0.25;

/// Faces that follow their surface this well (root mean square, in lattice constants) stay.
const FIT_ENOUGH: f64 = 0.01;

/// Distances, in lattice constants, by which points around bad tets may leave their surfaces. They apply in
/// turn while the aim, a little above the target, is not reached. The last applies only if the target itself
/// is not reached.
const SLACKS: [f64; 3] = [0.03, 0.06, 0.12];

/// Boundary edges may flip if the new one is at most this far from the surface, in lattice constants.
const FLIP_OFF: f64 = 0.03;

/// Worst tet, in ideal acoustic lengths, below which inner points are moved at the end. These moves raised τ
/// of the liver phantom at 10 mm from 0.63 to 0.66 on average.
const POLISH: f64 = 0.9;

/// Volumes within this fraction of their target are not adjusted.
const VOLUME_TOLERANCE: f64 = 2e-3;

/// The steps of the optimiser.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize)]
pub struct Steps {
    /// Rounds run.
    pub rounds: usize,
    /// Tets taken off the boundary.
    pub peeled: usize,
    /// Flat tets between materials moved to the other material.
    pub given: usize,
    /// Edges collapsed.
    pub collapsed: usize,
    /// Edges and faces flipped.
    pub flipped: usize,
    /// Moves of points.
    pub moved: usize,
}

/// The optimiser of one mesh.
pub(crate) struct Optimiser<'a> {
    complex: &'a mut Complex,
    surfaces: Surfaces<'a>,
    /// Tolerated distance of a point from the sides it lies between, in lattice constants.
    slack: f64,
    /// True if points where three materials meet, or two and the outside, only keep to the outside.
    lines_are_free: bool,
    /// Rejects changes that would let the boundary intersect itself, if present.
    guard: Option<Guard>,
    noise: u64,
    done: Steps,
}

impl<'a> Optimiser<'a> {
    pub(crate) fn new(complex: &'a mut Complex, surfaces: Surfaces<'a>, guard: Option<Guard>) -> Self {
        let (slack, lines_are_free, done) = (0.0, false, Steps::default());
        Self { complex, surfaces, slack, lines_are_free, guard, noise: 1, done }
    }

    /// True if a point may move to `place`.
    fn lets_move(&self, node: u32, place: &Vector3) -> bool {
        self.guard.as_ref().is_none_or(|guard| guard.lets_move(self.complex, node, place))
    }

    fn move_to(&mut self, node: u32, place: Vector3) {
        self.complex.points[node as usize] = place;
        self.note(&[node]);
    }

    /// Records changes round points.
    fn note(&mut self, nodes: &[u32]) {
        if let Some(guard) = &mut self.guard {
            guard.note(self.complex, nodes);
        }
    }

    /// Runs up to `rounds` rounds towards a least acoustic length of `target` × ideal. Then it shifts
    /// surfaces until the mesh encloses the volumes [m³] of the whole and of the inner materials, as far as
    /// these are known. `volumes` gives them for the mesh before the shifts.
    pub(crate) fn run(
        &mut self,
        target: f64,
        rounds: usize,
        volumes: &dyn Fn(&Complex) -> Vec<Option<f64>>,
        progress: &dyn Fn(f64),
    ) -> Steps {
        let aim = (AIM * target).min(1.0);
        self.improve(aim, rounds, RAMP, &|done| progress(0.6 * done));
        let mut wanted = None;
        for sweep in 0..FIT_SWEEPS {
            self.fit(aim, FIT_REACH * SHRINK.powi(sweep as i32));
            let wanted = wanted.get_or_insert_with(|| volumes(self.complex));
            if self.shift_surfaces(wanted, aim) {
                self.improve(aim, rounds.div_ceil(2), 0.0, &|_| {});
            }
            progress(0.6 + 0.3 * (sweep + 1) as f64 / FIT_SWEEPS as f64);
        }
        for (slack, goal) in [(SLACKS[0], aim), (SLACKS[1], aim), (SLACKS[2], target)] {
            if self.complex.worst() >= goal {
                break;
            }
            self.slack = slack;
            self.improve(aim, rounds.div_ceil(2), 0.0, &|_| {});
        }
        if self.complex.worst() < target {
            self.lines_are_free = true;
            self.improve(target, rounds.div_ceil(2), 0.0, &|_| {});
        }
        // Inner points move freely, at no cost for a surface.
        for sweep in 0..SWEEPS {
            let reach = REACH * SHRINK.powi(sweep as i32);
            self.relocate(POLISH, reach, &|sides| sides.count_ones() == 1);
        }
        self.done
    }

    /// Shifts the surfaces whose volume is off, together with their points. Returns whether any was shifted.
    fn shift_surfaces(&mut self, volumes: &[Option<f64>], target: f64) -> bool {
        let measured = measure(self.complex, self.surfaces.materials());
        let mut shifted = 0;
        for (surface, (wanted, [volume, area])) in volumes.iter().zip(measured).enumerate() {
            let Some(wanted) = wanted else { continue };
            if (volume / wanted - 1.0).abs() > VOLUME_TOLERANCE && area > 0.0 {
                let moved = self.surfaces.shift(
                    surface,
                    (wanted - volume) / area,
                    LARGEST_SHIFT * self.surfaces.edge(),
                );
                // Bit 0 of the sides is the outside, bit m the material m.
                shifted |= match (moved, surface) {
                    (false, _) => 0,
                    (true, 0) => OUTSIDE,
                    (true, _) => 1 << (surface + 1),
                };
            }
        }
        for node in 0..self.complex.points.len() as u32 {
            let sides = self.complex.sides[node as usize];
            if sides.count_ones() > 1 && sides & shifted != 0 {
                let here = self.complex.points[node as usize];
                let least = self.star_min(node, &here, u32::MAX, 0.0).min(0.6 * target);
                if let Some(there) = self.project(node, here)
                    && self.star_min(node, &there, u32::MAX, 0.0) >= least
                    && !self.complex.stretches(node, &there, u32::MAX)
                    && self.lets_move(node, &there)
                {
                    self.move_to(node, there);
                }
            }
        }
        shifted != 0
    }

    fn improve(&mut self, target: f64, rounds: usize, ramp: f64, progress: &dyn Fn(f64)) {
        let mut idle = 0;
        let ramp_over = ramp == 0.0;
        for round in 0..rounds {
            let ramp = ((round + 1) as f64 / (ramp * rounds as f64)).min(1.0);
            let threshold = FIRST_THRESHOLD + (target - FIRST_THRESHOLD) * ramp;
            let before = self.state(target);
            self.peel(threshold);
            self.hand_over(threshold);
            self.collapse(threshold);
            self.flip(threshold);
            // While the threshold rises, points just above it move too.
            let threshold = if ramp_over { threshold } else { 1.05 * threshold };
            for sweep in 0..SWEEPS {
                self.relocate(threshold, REACH * SHRINK.powi(sweep as i32), &|_| true);
            }
            self.done.rounds += 1;
            progress((round + 1) as f64 / rounds as f64);
            let after = self.state(target);
            if after.0 >= target {
                break;
            }
            let better = after.0 > before.0 * (1.0 + 1e-6) || after.1 < before.1;
            idle = if ramp == 1.0 && !better { idle + 1 } else { 0 };
            if idle == 2 {
                break;
            }
        }
    }

    /// Acoustic length of each tet as a part of the ideal; infinite for removed tets.
    fn parts(&self) -> Vec<f64> {
        let part = |tet: u32| if self.complex.is_alive(tet) { self.complex.part(tet) } else { f64::INFINITY };
        (0..self.complex.tets.len() as u32).into_par_iter().map(part).collect()
    }

    /// Least acoustic length as a part of the ideal, and how many tets are below `target`.
    fn state(&self, target: f64) -> (f64, usize) {
        self.parts().into_iter().fold((f64::INFINITY, 0), |(least, short), part| {
            (least.min(part), short + usize::from(part < target))
        })
    }

    /// Tets below a part of the ideal length, the worst first.
    fn below(&self, threshold: f64) -> Vec<u32> {
        let parts = self.parts().into_iter().zip(0..);
        let mut bad: Vec<(f64, u32)> = parts.filter(|(part, _)| *part < threshold).collect();
        bad.sort_by(|a, b| a.0.total_cmp(&b.0).then(a.1.cmp(&b.1)));
        bad.into_iter().map(|(_, tet)| tet).collect()
    }

    /// Removes tets of the boundary that the body does not need to stay connected. These are tets below half
    /// the threshold, and tips that are light for their stiffness.
    fn peel(&mut self, threshold: f64) {
        let mut peeled = 0;
        let short = |node: &u32| self.nodal_part(*node, &self.complex.points[*node as usize]) < threshold;
        let is_tip = |tet: &u32| {
            let nodes = self.complex.tets[*tet as usize];
            nodes.iter().any(|node| self.complex.star[*node as usize].len() == 1 && short(node))
        };
        let tips: Vec<u32> = self.complex.alive().filter(is_tip).collect();
        for tet in self.below(threshold / 2.0).into_iter().chain(tips) {
            if self.complex.is_alive(tet) && self.may_peel(tet) {
                let nodes = self.complex.tets[tet as usize];
                self.complex.remove(tet);
                self.complex.find_sides_of(&nodes);
                self.note(&nodes);
                peeled += 1;
            }
        }
        self.done.peeled += peeled;
    }

    /// Three boundary faces: a tip. Two: a wedge, if the edge that its removal lays open is not on the
    /// boundary yet.
    fn may_peel(&self, tet: u32) -> bool {
        let nodes = self.complex.tets[tet as usize];
        let is_open = |corner: usize| {
            let face: Vec<u32> =
                nodes.iter().enumerate().filter(|&(at, _)| at != corner).map(|(_, &n)| n).collect();
            let mut both = self.complex.star[face[0] as usize]
                .iter()
                .filter(|&&other| face.iter().all(|node| self.complex.tets[other as usize].contains(node)));
            both.next().is_some() && both.next().is_none()
        };
        let open: Vec<usize> = (0..4).filter(|&corner| is_open(corner)).collect();
        // Peeling must not change the material of the boundary.
        let one_material =
            nodes.iter().all(|&node| (self.complex.sides[node as usize] & !OUTSIDE).count_ones() == 1);
        match open.as_slice() {
            [_, _, _] => one_material,
            &[a, b] => {
                // Faces opposite a and b are open: the edge from a to b is inside.
                let edge = [nodes[a], nodes[b]];
                let rim = self.complex.rim_of(edge[0], |_| true);
                one_material && !rim.iter().any(|face| face.contains(&edge[1]))
            }
            _ => false,
        }
    }

    /// Moves tets below half the threshold, flat ones between materials, to the material with more of their
    /// surface.
    fn hand_over(&mut self, threshold: f64) {
        let mut given = 0;
        for tet in self.below(threshold / 2.0) {
            let current = self.complex.material[tet as usize];
            // Area [m²] of the faces towards each material.
            let mut towards: Vec<(u8, f64)> = vec![(current, 0.0)];
            for face in self.complex.faces(tet) {
                let Some(other) = self.complex.behind(tet, face) else { continue };
                let material = self.complex.material[other as usize];
                let area = pliant_geometry::volume(
                    CellKind::Triangle,
                    &face.map(|node| self.complex.points[node as usize]),
                );
                match towards.iter_mut().find(|(known, _)| *known == material) {
                    Some((_, sum)) => *sum += area,
                    None => towards.push((material, area)),
                }
            }
            let most = towards
                .iter()
                .skip(1)
                .fold(towards[0], |most, other| if other.1 > most.1 { *other } else { most });
            if most.0 != current {
                self.complex.material[tet as usize] = most.0;
                let nodes = self.complex.tets[tet as usize];
                self.complex.find_sides_of(&nodes);
                given += 1;
            }
        }
        self.done.given += given;
    }

    fn collapse(&mut self, threshold: f64) {
        let mut collapsed = 0;
        for tet in self.below(threshold) {
            let nodes = self.complex.tets[tet as usize];
            // An earlier collapse may have removed or improved the tet.
            if self.complex.is_alive(tet)
                && self.complex.part(tet) < threshold
                && self.collapse_one(nodes, threshold)
            {
                collapsed += 1;
            }
        }
        self.done.collapsed += collapsed;
    }

    /// Flips edges and faces of tets below a part of the ideal length.
    fn flip(&mut self, threshold: f64) {
        let mut flipped = 0;
        for tet in self.below(threshold) {
            if !self.complex.is_alive(tet) {
                continue;
            }
            let (surfaces, guard) = (&self.surfaces, &self.guard);
            let follows = |complex: &Complex, edge: [u32; 2], ends: [u32; 2]| {
                let [a, b] = ends.map(|end| complex.points[end as usize]);
                let [first, last] = ends.map(|end| complex.size[end as usize]);
                surfaces.off(OUTSIDE, &((a + b) / 2.0)) <= FLIP_OFF * first.min(last)
                    && guard.as_ref().is_none_or(|guard| guard.lets_turn(complex, edge, ends))
            };
            let nodes = self.complex.tets[tet as usize];
            if self.complex.flip(tet, &follows) {
                self.note(&nodes);
                flipped += 1;
            }
        }
        self.done.flipped += flipped;
    }

    /// Tries the edges of a tet, the shortest first, both ways.
    fn collapse_one(&mut self, nodes: [u32; 4], threshold: f64) -> bool {
        let point = |node: u32| self.complex.points[node as usize];
        let mut edges: Vec<(f64, u32, u32)> = Vec::with_capacity(6);
        for (i, &p) in nodes.iter().enumerate() {
            edges.extend(nodes[i + 1..].iter().map(|&q| ((point(p) - point(q)).norm(), p, q)));
        }
        edges.sort_by(|a, b| a.0.total_cmp(&b.0));
        for (_, p, q) in edges {
            for (gone, kept) in [(p, q), (q, p)] {
                if let Some(position) = self.best_collapse(gone, kept, threshold)
                    && self.complex.may_collapse(gone, kept)
                    && self
                        .guard
                        .as_ref()
                        .is_none_or(|guard| guard.lets_collapse(self.complex, gone, kept, &position))
                {
                    self.complex.collapse(gone, kept, position);
                    self.note(&[gone, kept]);
                    return true;
                }
            }
        }
        false
    }

    /// Best place of the joined point, if that is better than before.
    fn best_collapse(&self, gone: u32, kept: u32, threshold: f64) -> Option<Vector3> {
        let [gone_sides, kept_sides] = [gone, kept].map(|node| self.complex.sides[node as usize]);
        if gone_sides & !kept_sides != 0 {
            return None;
        }
        let [from, to] = [gone, kept].map(|node| self.complex.points[node as usize]);
        let middle = (from + to) / 2.0;
        let places = match (gone_sides == kept_sides, gone_sides.count_ones()) {
            (false, _) => vec![to],
            (true, 1) => vec![middle, from, to],
            (true, _) => self.project(kept, middle).into_iter().chain([from, to]).collect(),
        };
        let old = self.star_min(gone, &self.complex.points[gone as usize], u32::MAX, 0.0).min(self.star_min(
            kept,
            &self.complex.points[kept as usize],
            u32::MAX,
            0.0,
        ));
        let mut best: Option<(f64, Vector3)> = None;
        for place in places {
            let floor = best.map_or(old, |(length, _)| length);
            let new = self.star_min(gone, &place, kept, floor);
            let new = if new > floor { new.min(self.star_min(kept, &place, gone, floor)) } else { new };
            let bears = new > floor && (new >= threshold || new > 1.2 * old);
            if bears && !self.complex.overstretches(gone, kept, &place) {
                best = Some((new, place));
            }
        }
        best.map(|(_, place)| place)
    }

    /// Parts of the ideal length of a node at `place`: the least of its tets, and its nodal length.
    fn parts_round(&self, node: u32, place: &Vector3) -> [f64; 2] {
        [self.star_min(node, place, u32::MAX, 0.0), self.nodal_part(node, place)]
    }

    /// Nodal acoustic length of a node at `place`, as a part of the ideal one.
    fn nodal_part(&self, node: u32, place: &Vector3) -> f64 {
        self.complex.nodal_length(node, place) / self.complex.ideal([node; 4])
    }

    /// Least acoustic length of the tets round a node if it were at `place`, as a part of the ideal. Tets
    /// with the node `without` are left out. The search stops once the length is not above `floor`.
    fn star_min(&self, node: u32, place: &Vector3, without: u32, floor: f64) -> f64 {
        let mut least = f64::INFINITY;
        for &tet in &self.complex.star[node as usize] {
            let nodes = self.complex.tets[tet as usize];
            if nodes.contains(&without) {
                continue;
            }
            let corners = nodes.map(|n| if n == node { *place } else { self.complex.points[n as usize] });
            least = least.min(acoustic_length(corners) / self.complex.ideal(nodes));
            if least <= floor {
                break;
            }
        }
        least
    }

    /// The position nearest to `place` between the sides of a node, if it is on the same side of the body. On
    /// that side the normals differ by less than 90°. The other side of a gap or of a thin lobe may be
    /// nearer.
    fn project(&self, node: u32, place: Vector3) -> Option<Vector3> {
        self.project_from(node, place, &OnceCell::new())
    }

    /// Projects like [`Self::project`]; `look` is the normal at the node, found once for several places.
    fn project_from(&self, node: u32, place: Vector3, look: &OnceCell<Vector3>) -> Option<Vector3> {
        let mut sides = self.complex.sides[node as usize];
        if self.lines_are_free && sides.count_ones() > 2 {
            // The outside and the lowest material: their statements about each other are redundant.
            let materials = sides & !OUTSIDE;
            sides = sides & OUTSIDE | materials & materials.wrapping_neg();
        }
        if sides.count_ones() < 2 {
            return Some(place);
        }
        let size = self.complex.size[node as usize];
        let looks = |point: &Vector3| self.surfaces.constraints(sides, point).first_gradient();
        let near = self.slack > 0.0 && self.surfaces.off(sides, &place) < self.slack * size;
        let (there, its_look) =
            match near && (sides & OUTSIDE == 0 || self.surfaces.has_room(&place, self.slack * size)) {
                true => (place, looks(&place)),
                false => self.surfaces.project(sides, &place, 0.15 * size)?,
            };
        let here = self.complex.points[node as usize];
        let own_look = look.get_or_init(|| looks(&here));
        (own_look.dot(&its_look) > 0.0).then_some(there)
    }

    /// Slides points along their surface to where its facets follow the field best, as long as no tet falls
    /// below the target; `reach` is in lattice constants. Points that fall short of a crest move onto it.
    fn fit(&mut self, target: f64, reach: f64) {
        for node in 0..self.complex.points.len() as u32 {
            if self.complex.sides[node as usize].count_ones() == 2 {
                self.fit_one(node, target, reach);
            }
        }
    }

    fn fit_one(&mut self, node: u32, least: f64, reach: f64) {
        let here = self.complex.points[node as usize];
        let sides = self.complex.sides[node as usize];
        let last = Sides::BITS - 1 - sides.leading_zeros();
        let faces = match sides & OUTSIDE {
            0 => self.complex.rim_of(node, |tet| u32::from(self.complex.material[tet as usize]) == last),
            _ => self.complex.rim_of(node, |_| true),
        };
        let [misfit, area] = self.misfit(node, &here, &faces);
        let size = self.complex.size[node as usize];
        if misfit < area * (FIT_ENOUGH * size).powi(2) {
            return;
        }
        // The quality that a move must not lower.
        let floors = self.parts_round(node, &here).map(|part| part.min(least));
        let bears = |trial: &Vector3| {
            let parts = self.parts_round(node, trial);
            parts.iter().zip(floors).all(|(part, floor)| *part >= floor)
                && !self.complex.stretches(node, trial, u32::MAX)
        };
        let (mut best, mut place) = (0.99 * misfit, here);
        let look = OnceCell::new();
        for direction in directions() {
            let trial = here + direction * (reach * size);
            let Some(trial) = self.project_from(node, trial, &look) else { continue };
            let [misfit, _] = self.misfit(node, &trial, &faces);
            if misfit < best && bears(&trial) && self.lets_move(node, &trial) {
                (best, place) = (misfit, trial);
            }
        }
        if place != here {
            self.move_to(node, place);
            self.done.moved += 1;
        }
    }

    /// Misfit of the faces round a node if it were at `place`: sum of area × mean squared distance from the
    /// surface [m⁴]. The mean is over the middle of each face and of its edges at the node. Also returns the
    /// area [m²].
    fn misfit(&self, node: u32, place: &Vector3, faces: &[[u32; 3]]) -> [f64; 2] {
        let sides = self.complex.sides[node as usize];
        let of_face = |face: &[u32; 3]| {
            let [a, b, c] = face.map(|n| if n == node { *place } else { self.complex.points[n as usize] });
            let [a, b, c] = if face[0] == node {
                [a, b, c]
            } else if face[1] == node {
                [b, c, a]
            } else {
                [c, a, b]
            };
            let area = (b - a).cross(&(c - a)).norm() / 2.0;
            let off = |point: Vector3| self.surfaces.off(sides, &point).powi(2);
            [area * (off((a + b + c) / 3.0) + off((a + b) / 2.0) + off((a + c) / 2.0)) / 3.0, area]
        };
        faces
            .iter()
            .map(of_face)
            .fold([0.0; 2], |[misfit, total], [part, area]| [misfit + part, total + area])
    }

    /// Moves the chosen points whose worst tet is below the threshold to the best of some places round them;
    /// `reach` in lattice constants.
    fn relocate(&mut self, threshold: f64, reach: f64, chosen: &dyn Fn(Sides) -> bool) {
        let mut parts = self.parts();
        for node in 0..self.complex.points.len() as u32 {
            let star = self.complex.star[node as usize].iter();
            let now = star.map(|&tet| parts[tet as usize]).fold(f64::INFINITY, f64::min);
            if now < threshold && chosen(self.complex.sides[node as usize]) {
                self.relocate_one(node, now, reach, &mut parts);
            }
        }
    }

    /// Moves a point; `parts` are the acoustic lengths of all tets over the ideal, before and after.
    fn relocate_one(&mut self, node: u32, now: f64, reach: f64, parts: &mut [f64]) {
        let here = self.complex.points[node as usize];
        let neighbours = self.complex.neighbours(node);
        let sum: Vector3 = neighbours.iter().map(|&other| self.complex.points[other as usize]).sum();
        let half_way = (here + sum / neighbours.len() as f64) / 2.0;
        let reach = reach * self.complex.size[node as usize] * (0.5 + self.random());
        // Worst tets first: most trials end at the first tet.
        let star = &mut self.complex.star[node as usize];
        star.sort_by(|&a, &b| parts[a as usize].total_cmp(&parts[b as usize]).then(a.cmp(&b)));
        let (mut best, mut place) = (now, here);
        let look = OnceCell::new();
        for trial in std::iter::once(half_way).chain(directions().map(|direction| here + direction * reach)) {
            // Each trial is projected between the sides of the node, and must then improve the worst tet.
            if let Some(trial) = self.project_from(node, trial, &look) {
                let part = self.star_min(node, &trial, u32::MAX, best);
                if part > best
                    && !self.complex.stretches(node, &trial, u32::MAX)
                    && self.lets_move(node, &trial)
                {
                    (best, place) = (part, trial);
                }
            }
        }
        if place != here {
            self.move_to(node, place);
            self.done.moved += 1;
            for &tet in &self.complex.star[node as usize] {
                parts[tet as usize] = self.complex.part(tet);
            }
        }
    }

    /// From 0 to 1, the same sequence every time (Knuth's multiplier).
    fn random(&mut self) -> f64 {
        self.noise = self.noise.wrapping_mul(6364136223846793005).wrapping_add(1442695040888963407);
        (self.noise >> 11) as f64 / (1_u64 << 53) as f64
    }
}

/// The 26 unit vectors to the neighbours in a cubic grid.
pub(crate) fn directions() -> impl Iterator<Item = Vector3> {
    let grid = (0..27)
        .map(|at| Vector3::new((at % 3) as f64 - 1.0, (at / 3 % 3) as f64 - 1.0, (at / 9) as f64 - 1.0));
    grid.filter(|direction| *direction != Vector3::zeros()).map(|direction| direction.normalize())
}

/// Volume [m³] and area [m²] of the whole and of each inner material; the area of a material excludes the
/// boundary of the whole.
fn measure(complex: &Complex, materials: usize) -> Vec<[f64; 2]> {
    let mut measured = vec![[0.0; 2]; materials];
    let mut faces: Vec<([u32; 3], u8)> = Vec::new();
    for tet in complex.alive() {
        let corners = complex.corners(tet);
        let volume = pliant_geometry::volume(CellKind::Tet, &corners);
        let material = complex.material[tet as usize];
        measured[0][0] += volume;
        if material > 1 {
            measured[usize::from(material) - 1][0] += volume;
        }
        for mut face in complex.faces(tet) {
            face.sort_unstable();
            faces.push((face, material));
        }
    }
    faces.sort_unstable();
    for same in faces.chunk_by(|a, b| a.0 == b.0) {
        let area =
            pliant_geometry::volume(CellKind::Triangle, &same[0].0.map(|node| complex.points[node as usize]));
        match same {
            [_] => measured[0][1] += area,
            [(_, a), (_, b)] if a != b => {
                for m in [a, b].into_iter().filter(|m| **m > 1) {
                    measured[usize::from(*m) - 1][1] += area;
                }
            }
            _ => {}
        }
    }
    measured
}
