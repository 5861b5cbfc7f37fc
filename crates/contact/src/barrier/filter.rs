//! The filter of steps: the part of a motion until anything comes near.

use nalgebra::Vector3;

use super::candidates::Group;
use super::ccd::ADVANCES;
use super::configuration::Configuration;
use super::step::BarrierStep;
use super::system::Barriers;
use crate::pose::Stance;
use crate::touch::Passage;

/// Largest number of restarts in a step while following a rigid thing that turns.
const TURNS: usize = 40;
/// Part of the way to a meeting that is gone where things turn.
const SHORTER: f64 = 0.9;

impl BarrierStep {
    /// Returns the largest part, at most `most`, of a motion (six numbers a node) from places [m] at a
    /// fraction of the step that is free of collisions. At least half of `keep` of every gap is left. Rigid
    /// things go the same part of their remaining way. Lists pairs anew if need be. The evaluated state stays
    /// unchanged.
    pub fn collision_free_fraction(
        &mut self,
        position: &[Vector3<f64>],
        motion: &[f64],
        time_fraction: f64,
        [keep, most]: [f64; 2],
    ) -> f64 {
        let Self { barriers, ends, tried, .. } = self;
        tried.move_things(ends, time_fraction);
        tried.place_nodes(position, &barriers.rigid_nodes);
        self.is_current &= *tried == self.now;
        barriers.grow(&tried.stances);
        barriers.set_motion(tried, motion, most, ends, 1.0);
        let mut part = most;
        if !barriers.lists_hold(tried) || !barriers.lists_have_motion(tried) {
            part *= barriers.list(tried);
        }
        let [from, to] = &*ends;
        let turns = time_fraction < 1.0
            && from.iter().zip(to).any(|(from, to)| from.pose.rotation != to.pose.rotation);
        for _ in 0..TURNS {
            // Things that turn do not move on a straight way: the way to where they really come is searched.
            let target = time_fraction + part * (1.0 - time_fraction);
            barriers.set_motion(tried, motion, part, ends, target);
            if turns && !barriers.lists_have_motion(tried) {
                part *= SHORTER;
                continue;
            }
            let gone = barriers.filtered(tried, ends, target, keep);
            part *= gone;
            if !turns || gone == 1.0 || part == 0.0 {
                return part;
            }
            part *= SHORTER;
        }
        0.0
    }
}

impl Barriers {
    /// Returns the part of the motion that is set which leaves at least half of `keep` of every gap. Rigid
    /// things go to a fraction of the step between both ends.
    fn filtered(
        &mut self,
        now: &Configuration,
        [from, to]: &[Vec<Stance>; 2],
        target: f64,
        keep: f64,
    ) -> f64 {
        let mut most = 1.0;
        for number in 0..self.groups.len() {
            most = self.groups[number].collision_free_fraction(&now.place, &self.motion, keep, most);
            let (group, distances) = (&self.groups[number], &self.wall_distances[number]);
            let Some(wall) = group.wall else { continue };
            let target = Stance::between([&from[wall as usize], &to[wall as usize]], target);
            most = self.filtered_at_wall((group, wall, distances), now, target, [keep, most]);
        }
        most
    }

    /// Runs [`filtered`](Self::filtered) for nodes at a wall that goes to a target, with their distances [m]
    /// when pairs were listed. A node comes nearer to the wall by at most the ways of both.
    fn filtered_at_wall(
        &self,
        (group, wall, distances): (&Group, u32, &[f64]),
        at: &Configuration,
        target: Stance,
        [keep, mut most]: [f64; 2],
    ) -> f64 {
        let (rigid, now) = (&self.contacts.rigids[wall as usize], at.stances[wall as usize]);
        let travel =
            if target == now { 0.0 } else { Passage::new(rigid, [now, target]).travel_from(rigid, &now) };
        let since = self.travel(wall, at);
        let offset = group.parameters.kept;
        for (&node, then) in group.sides[0].points.iter().zip(distances) {
            let (place, motion) = (at.place[node as usize], self.motion[node as usize]);
            let bound = then - (place - self.listed.place[node as usize]).norm() - since - offset;
            let way = motion.norm() + travel;
            if bound * (1.0 - keep) > way * most {
                continue;
            }
            let gap_at = |part: f64| {
                let stance = if target == now { now } else { Stance::between([&now, &target], part) };
                rigid.distance(&stance, &(place + motion * part)) - offset
            };
            // A plane that turns has no largest way: it is followed where the node is.
            let way = if way.is_finite() { way } else { motion.norm() + swing([&now, &target], &place) };
            let start = gap_at(0.0);
            let (mut gone, mut gap) = (0.0, start);
            if start <= 0.0 {
                return 0.0;
            }
            for _ in 0..ADVANCES {
                if gap <= keep * start || gone >= most {
                    break;
                }
                gone += (gap - 0.5 * keep * start) / way;
                gap = gap_at(gone.min(1.0));
            }
            most = most.min(gone);
        }
        most
    }
}

/// Returns a bound of the way [m] that a turning thing goes at the place of a node, from one stance to
/// another.
fn swing([now, target]: [&Stance; 2], place: &Vector3<f64>) -> f64 {
    let [from, to] = [&now.pose, &target.pose].map(|pose| pose.translation.vector);
    let shift = (to - from).norm();
    let arm = (place - from).norm() + shift;
    let turn = now.pose.rotation.angle_to(&target.pose.rotation);
    shift + turn * arm + (target.growth - now.growth).abs()
}
