//! Visual meshes carried by shells. Each point finds the nearest place of the curved surface, follows it, and
//! gives forces back. A search tree holds the flat facets. A patch is at most its bulge away from its facet.
//! Patches are tried from the nearest facet on, until no other can be nearer. The place found is the nearest
//! of all, at a cost per point that grows with the logarithm of the number of facets. Leaves out: keeping
//! neighbouring points of a mesh on the same side of a fold.

use nalgebra::Vector3;
use pliant_geometry::barycentric_of_closest;
use pliant_shells::{Carried, Place};
use rayon::prelude::*;
use rstar::{AABB, PointDistance, RTree, RTreeObject};

use crate::curved::surface::CurvedSurface;
use crate::model::assembly::Assembly;
use crate::model::state::AssemblyState;

/// A search tree over the curved surface where it was when the tree was made.
struct Nearest<'s> {
    surface: &'s CurvedSurface,
    model: &'s Assembly,
    state: &'s AssemblyState,
    tree: RTree<Flat>,
    /// No point of a patch is farther than this from its flat facet [m].
    bulge: f64,
}

struct Flat {
    facet: u32,
    corners: [Vector3<f64>; 3],
}

impl RTreeObject for Flat {
    type Envelope = AABB<[f64; 3]>;

    fn envelope(&self) -> Self::Envelope {
        let [a, b, c] = self.corners;
        AABB::from_corners(a.inf(&b).inf(&c).into(), a.sup(&b).sup(&c).into())
    }
}

impl PointDistance for Flat {
    fn distance_2(&self, point: &[f64; 3]) -> f64 {
        let point = Vector3::from(*point);
        let weights = barycentric_of_closest(&self.corners, &point);
        (self.corners.iter().zip(weights).map(|(x, w)| x * w).sum::<Vector3<f64>>() - point).norm_squared()
    }
}

impl<'s> Nearest<'s> {
    fn new(surface: &'s CurvedSurface, model: &'s Assembly, state: &'s AssemblyState, cells: &[u32]) -> Self {
        let flat = |&facet: &u32| {
            let nodes = model.facets[facet as usize].nodes;
            Flat { facet, corners: nodes.map(|node| state.position[node as usize]) }
        };
        let bulge = |&facet: &u32| surface.patch(model, state, facet).bulge();
        Self {
            surface,
            model,
            state,
            tree: RTree::bulk_load(cells.iter().map(flat).collect()),
            bulge: cells.iter().map(bulge).fold(0.0, f64::max),
        }
    }

    fn place(&self, point: &Vector3<f64>) -> Option<Place> {
        let mut best: Option<(Place, f64)> = None;
        for (flat, squared) in self.tree.nearest_neighbor_iter_with_distance_2((*point).into()) {
            if best.is_some_and(|(_, distance)| squared.sqrt() - self.bulge >= distance) {
                break;
            }
            let patch = self.surface.patch(self.model, self.state, flat.facet);
            let (weights, distance) = patch.closest(point, barycentric_of_closest(&flat.corners, point));
            if best.is_none_or(|(_, nearest)| distance < nearest) {
                best = Some((Place { facet: flat.facet, weights }, distance));
            }
        }
        best.map(|(place, _)| place)
    }
}

impl CurvedSurface {
    /// Points of a visual mesh [m], each bound to the nearest place of the patches over some facets at a
    /// state. `None` without facets.
    pub fn carry_all(
        &self,
        model: &Assembly,
        state: &AssemblyState,
        cells: &[u32],
        points: &[Vector3<f64>],
    ) -> Option<Vec<Carried>> {
        let nearest = Nearest::new(self, model, state, cells);
        let bind = |point| Some(self.bind(model, state, point, nearest.place(point)?));
        points.par_iter().with_min_len(16).map(bind).collect()
    }

    /// Writes the positions [m] of carried points to a slice of the same length.
    pub fn carried_all(
        &self,
        model: &Assembly,
        state: &AssemblyState,
        points: &[Carried],
        positions: &mut [Vector3<f64>],
    ) {
        let both = positions.par_iter_mut().zip(points).with_min_len(64);
        both.for_each(|(position, point)| *position = self.carried(model, state, point));
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::curved::mapping::CarriedPoints;
    use crate::tests::{ball, cube, model, strip};
    use pliant_mechanics::mapping::Mapping;
    use pliant_shells::EdgeRule;
    use pliant_testing::Random;

    fn vector(random: &mut Random) -> Vector3<f64> {
        Vector3::from_fn(|_, _| random.number())
    }

    /// Around a ball, a cube with creases and a strip with borders, points at any distance find the nearest
    /// place. No point of a fine picture is nearer by more than 1e-6 (Gauss–Newton is slow where the distance
    /// equals the radius). The carried points stay where they are.
    #[test]
    fn points_find_the_nearest_place_of_all() {
        let mut random = Random::new(3);
        for shape in [ball(2), cube(), strip()] {
            let model = model(shape, 0.01);
            let surface = CurvedSurface::new(&model, EdgeRule::Arc);
            let mut state = AssemblyState::at_rest(&model);
            let shake: Vec<f64> = (0..6 * model.rest.len()).map(|_| 0.1 * random.number()).collect();
            state.advance(&shake, 1.0);
            let picture = surface.picture(&model, 24);
            let seen: Vec<_> = picture
                .places
                .iter()
                .map(|p| surface.patch(&model, &state, p.facet).point(p.weights))
                .collect();
            let points: Vec<_> = (0..200).map(|_| vector(&mut random) * 2.0).collect();
            let cells: Vec<u32> = (0..model.facets.len() as u32).collect();
            let carried = surface.carry_all(&model, &state, &cells, &points).unwrap();
            let mut positions = vec![Vector3::zeros(); points.len()];
            surface.carried_all(&model, &state, &carried, &mut positions);
            for ((point, carried), position) in points.iter().zip(&carried).zip(&positions) {
                assert!((point - position).norm() < 1e-13);
                let foot = surface.patch(&model, &state, carried.place.facet).point(carried.place.weights);
                let distance = (foot - point).norm();
                let other = seen.iter().map(|x| (x - point).norm()).fold(f64::INFINITY, f64::min);
                assert!(distance < other + 1e-6, "{distance} {other}");
            }
        }
    }

    /// Beyond the border of a plane strip a point has its foot on the border; from a facet far away it is
    /// found by walking.
    #[test]
    fn feet_lie_on_borders_and_are_found_from_afar() {
        let model = model(strip(), 0.01);
        let surface = CurvedSurface::new(&model, EdgeRule::Arc);
        let state = AssemblyState::at_rest(&model);
        let point = Vector3::new(6.3, -0.5, 0.2);
        for start in 0..32 {
            let carried = surface.carry(&model, &state, point, start);
            let foot = surface.patch(&model, &state, carried.place.facet).point(carried.place.weights);
            assert!((foot - Vector3::new(6.3, 0.0, 0.0)).norm() < 1e-9, "{start}: {foot}");
            assert!((carried.height - 0.2).abs() < 1e-9);
            assert!((carried.aside[0].hypot(carried.aside[1]) - 0.5).abs() < 1e-9);
        }
    }

    #[test]
    fn nothing_carries_without_facets() {
        let model = model(strip(), 0.01);
        let surface = CurvedSurface::new(&model, EdgeRule::Arc);
        assert_eq!(
            surface.carry_all(&model, &AssemblyState::at_rest(&model), &[], &[Vector3::zeros()]),
            None
        );
    }

    /// Forces on points off a shaken ball: the same work for any motion, force and moment in all to 1e-11.
    #[test]
    fn forces_on_carried_points_keep_work_and_resultants() {
        let mut random = Random::new(4);
        let model = model(ball(2), 0.01);
        let surface = CurvedSurface::new(&model, EdgeRule::Arc);
        let rest = AssemblyState::at_rest(&model);
        let points: Vec<_> = (0..50).map(|_| vector(&mut random).normalize() * 1.2).collect();
        let cells: Vec<u32> = (0..128).collect();
        let carried = surface.carry_all(&model, &rest, &cells, &points).unwrap();
        let mut state = rest.clone();
        let shake: Vec<f64> = (0..6 * model.rest.len()).map(|_| 0.05 * random.number()).collect();
        state.advance(&shake, 1.0);
        let forces: Vec<_> = points.iter().map(|_| vector(&mut random)).collect();
        let mut nodal = vec![0.0; 6 * model.rest.len()];
        let mapping = CarriedPoints::Shell(&model, &surface, &carried);
        for (point, force) in forces.iter().enumerate() {
            mapping.add_force(&state, point, (*force).into(), &mut |node, force, moment| {
                let components = force.into_iter().chain(moment);
                nodal[6 * node as usize..].iter_mut().zip(components).for_each(|(sum, value)| *sum += value);
            });
        }
        let part = |at: usize| Vector3::new(nodal[at], nodal[at + 1], nodal[at + 2]);
        let (mut force, mut moment) = (Vector3::zeros(), Vector3::zeros());
        for (node, x) in state.position.iter().enumerate() {
            force += part(6 * node);
            moment += x.cross(&part(6 * node)) + part(6 * node + 3);
        }
        for (point, f) in carried.iter().zip(&forces) {
            force -= f;
            moment -= surface.carried(&model, &state, point).cross(f);
        }
        assert!(force.norm() < 1e-11 && moment.norm() < 1e-11, "{force} {moment}");

        let motion: Vec<f64> = nodal.iter().map(|_| random.number()).collect();
        let h = 1e-6;
        let moved = |by: f64| {
            let mut state = state.clone();
            state.advance(&motion, by);
            let works = carried.iter().zip(&forces).map(|(p, f)| surface.carried(&model, &state, p).dot(f));
            works.sum::<f64>()
        };
        let (work, power) =
            ((moved(h) - moved(-h)) / (2.0 * h), nodal.iter().zip(&motion).map(|(f, v)| f * v).sum::<f64>());
        assert!((work - power).abs() < 1e-7 * power.abs().max(1.0), "{work} {power}");
    }
}
