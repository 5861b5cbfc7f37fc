//! Results of contacts at single nodes: forces, [pressures](pliant_contact::pressure), gaps and slips.

use nalgebra::Vector3;
use pliant_contact::pressure::pressures;
use pliant_contact::shape::Near;
use pliant_mechanics::tensor::Vector;

use super::{ContactSolver, Own, over};
use crate::State;
use crate::lanes::LaneNumber;

/// Gap, over the margin of a surface at a thing, up to which a touch lasts that nothing bears on.
const LASTS: f64 = 0.1;

/// A node of a surface that may touch, at an instant.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct NodeContact {
    /// Number of the node in the model.
    pub node: u32,
    /// Sum of the forces of contacts on it [N].
    pub force: Vector<f64>,
    /// Force along the normal over its share of the deformed faces [Pa]; `None` without faces.
    pub pressure: Option<f64>,
    /// Least signed distance to what it may touch, less the distance that is kept [m]; `None` where no body
    /// and no thing is near.
    pub gap: Option<f64>,
    /// Distance [m] slid since the touch began; `None` if the node touches nothing.
    pub slip: Option<f64>,
}

impl<R: LaneNumber> ContactSolver<R> {
    /// Returns all nodes that may touch, increasing, at the instant whose forces were found last. `state` is
    /// the state of the model at that instant.
    pub fn nodal(&self, state: &State<R>) -> Vec<NodeContact> {
        let place = |(rest, &number): (&Vector3<f64>, &u32)| {
            self.coupled_surfaces.place_at(number, rest, &state.displacement)
        };
        let places: Vec<Vector3<f64>> = self.rest.iter().zip(&self.numbers).map(place).collect();
        let pressures = pressures(&self.faces, &self.normal_forces(), &places);
        let gaps = self.gaps(&places);
        let parts = self.numbers.iter().zip(&self.nodes).zip(pressures).zip(gaps);
        let is_own = |node: u32| self.coupled_surfaces.place_of(node).is_none();
        parts
            .filter(|(((node, _), _), _)| is_own(**node))
            .map(|(((&node, tracked), pressure), gap)| NodeContact {
                node,
                force: if tracked.near {
                    over(&(tracked.then - tracked.free), &tracked.free_mobility).into()
                } else {
                    [0.0; 3]
                },
                pressure,
                gap: Some(gap).filter(|gap| gap.is_finite()),
                slip: way_of(&state.slip, node),
            })
            .collect()
    }

    /// Sums of the impulses [N] on each node along the normals of its contacts.
    fn normal_forces(&self) -> Vec<Vector3<f64>> {
        let lifted = self.nodes.iter().map(|node| if node.near { node.lifted } else { Vector3::zeros() });
        let mut forces: Vec<Vector3<f64>> = lifted.collect();
        for row in &self.rows {
            for (node, weight) in row.parts() {
                forces[node] += row.normal * (row.push * weight);
            }
        }
        // Jaws that hold a node press on it along their normal.
        for partner in &self.partners {
            let Own::Rigid(at_rigid) = partner else { continue };
            if !at_rigid.grips {
                continue;
            }
            let rigid = &self.contacts.rigids[at_rigid.rigid];
            for &number in &at_rigid.surface.nodes {
                let node = &self.nodes[number as usize];
                if node.near && node.mobility != node.free_mobility {
                    let Near { normal, .. } = at_rigid.passage.near(rigid, &node.then);
                    let held = over(&(node.then - node.free), &node.free_mobility) - node.borne;
                    forces[number as usize] += normal * normal.dot(&held).max(0.0);
                }
            }
        }
        forces
    }

    /// Least gaps [m]; infinite where nothing is near.
    fn gaps(&self, places: &[Vector3<f64>]) -> Vec<f64> {
        let mut gaps = vec![f64::INFINITY; self.nodes.len()];
        for (contact, partner) in self.contacts.contacts.iter().zip(&self.partners) {
            let offset = contact.touch.offset;
            match partner {
                Own::Rigid(at_rigid) => {
                    let rigid = &self.contacts.rigids[at_rigid.rigid];
                    for &node in &at_rigid.surface.nodes {
                        let now = &places[node as usize];
                        let gap = &mut gaps[node as usize];
                        *gap = gap.min(at_rigid.passage.distance_before(rigid, now) - offset);
                    }
                }
                Own::Bodies(pairs, _) => pairs.find(
                    |node| places[node as usize],
                    |pair| {
                        if pair.weights[0] == 1.0 {
                            let gap = &mut gaps[pair.nodes[0] as usize];
                            *gap = gap.min(pair.distance - pair.kept);
                        }
                    },
                ),
            }
        }
        gaps
    }

    /// Adds the ways [m] that nodes slide in the step whose forces were found last. Where several points bear
    /// on a node, their mean counts, weighted by their impulses. A touch lasts while something bears on the
    /// node, or while it is as near as that.
    pub fn slide(&mut self, slip: &mut Vec<(u32, f64)>) {
        let Self { nodes, rows, slips, near, .. } = self;
        near.iter().for_each(|&index| slips[index as usize] = [0.0; 2]);
        for row in rows.iter().filter(|row| row.push > 0.0) {
            let place = row.parts().map(|(node, weight)| nodes[node].then * weight).sum::<Vector3<f64>>();
            let way = across(&(place - row.carried), &row.normal);
            for (node, weight) in row.parts() {
                let load = weight.abs() * row.push;
                slips[node] = [slips[node][0] + load, slips[node][1] + load * way];
            }
        }
        let mut slid = std::mem::take(&mut self.slid);
        slid.clear();
        slid.extend(self.near.iter().filter_map(|&index| {
            let node = self.numbers[index as usize];
            self.coupled_surfaces.place_of(node).is_none().then_some(())?;
            let way = match (self.slips[index as usize], way_of(slip, node)) {
                ([load, ways], before) if load > 0.0 => Some(before.unwrap_or(0.0) + ways / load),
                (_, Some(before)) => self.hovering(index as usize).map(|way| before + way),
                _ => None,
            };
            way.map(|way| (node, way))
        }));
        self.slid = std::mem::replace(slip, slid);
    }

    /// The way [m] that a node slides in a step in which nothing bears on it; `None` if it leaves.
    fn hovering(&self, index: usize) -> Option<f64> {
        let node = Some(&self.nodes[index]).filter(|node| node.near)?;
        let at_rigid = self.contacts.contacts.iter().zip(&self.partners).find_map(|(contact, partner)| {
            let Own::Rigid(at_rigid) = partner else { return None };
            at_rigid.surface.nodes.binary_search(&(index as u32)).ok()?;
            let Near { distance, normal } =
                at_rigid.passage.near(&self.contacts.rigids[at_rigid.rigid], &node.then);
            let near = distance - contact.touch.offset < LASTS * at_rigid.margin;
            near.then(|| across(&(node.then - at_rigid.passage.carry(&self.places[index])), &normal))
        });
        // Its own part in a pair that bears nothing is not known.
        at_rigid.or(node.paired.then_some(0.0))
    }
}

/// Returns the distance [m] that a node has slid, by its number.
fn way_of(slip: &[(u32, f64)], node: u32) -> Option<f64> {
    slip.binary_search_by_key(&node, |&(known, _)| known).ok().map(|at| slip[at].1)
}

/// Length [m] of a way across a normal.
fn across(way: &Vector3<f64>, normal: &Vector3<f64>) -> f64 {
    (way - normal * normal.dot(way)).norm()
}
