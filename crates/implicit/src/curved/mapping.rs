//! Surfaces carried by bodies of an assembly: by weights of nodes on solids, by the curved surface on shells.

use nalgebra::Vector3;
use pliant_mechanics::mapping::{Configuration, Mapping, Weights};
use pliant_shells::Carried;

use crate::curved::surface::CurvedSurface;
use crate::model::assembly::Assembly;
use crate::model::state::AssemblyState;

impl Configuration for AssemblyState {
    fn position(&self, node: u32) -> [f64; 3] {
        self.position[node as usize].into()
    }

    fn velocity(&self, node: u32) -> [f64; 3] {
        self.velocity[node as usize].into()
    }
}

/// The points of a surface that a body carries.
#[derive(Clone, Copy)]
pub enum CarriedPoints<'a> {
    /// On a solid.
    Solid(&'a Weights),
    /// On the curved surface of shells.
    Shell(&'a Assembly, &'a CurvedSurface, &'a [Carried]),
}

impl<'a> CarriedPoints<'a> {
    /// The points of a surface of the model. Points on shells need their curved surface.
    pub fn new(assembly: &'a Assembly, curved: Option<&'a CurvedSurface>, surface: usize) -> Self {
        match (curved, assembly.carried.get(&surface)) {
            (Some(curved), Some(points)) => Self::Shell(assembly, curved, points),
            _ => Self::Solid(&assembly.model.surfaces[surface].mapping),
        }
    }
}

impl Mapping<AssemblyState> for CarriedPoints<'_> {
    fn position(&self, state: &AssemblyState, point: usize) -> [f64; 3] {
        match self {
            Self::Solid(weights) => weights.position(state, point),
            Self::Shell(assembly, curved, points) => curved.carried(assembly, state, &points[point]).into(),
        }
    }

    fn velocity(&self, state: &AssemblyState, point: usize) -> [f64; 3] {
        match self {
            Self::Solid(weights) => weights.velocity(state, point),
            Self::Shell(assembly, curved, points) => {
                let facet = points[point].place.facet;
                let by = curved.patch(assembly, state, facet).carried_jacobian(&points[point]);
                let mut sum = Vector3::zeros();
                for (corner, node) in
                    assembly.facets[facet as usize].nodes.map(|n| n as usize).into_iter().enumerate()
                {
                    sum += by.fixed_columns::<3>(6 * corner) * state.velocity[node];
                    sum += by.fixed_columns::<3>(6 * corner + 3) * state.spin[node];
                }
                sum.into()
            }
        }
    }

    fn add_force(
        &self,
        state: &AssemblyState,
        point: usize,
        force: [f64; 3],
        add: &mut dyn FnMut(u32, [f64; 3], [f64; 3]),
    ) {
        match self {
            Self::Solid(weights) => weights.add_force(state, point, force, add),
            Self::Shell(assembly, curved, points) => {
                let facet = points[point].place.facet;
                let patch = curved.patch(assembly, state, facet);
                let back = patch.carried_forces(&points[point], &Vector3::from(force));
                for (corner, &node) in assembly.facets[facet as usize].nodes.iter().enumerate() {
                    let part = |first: usize| back.fixed_rows::<3>(6 * corner + first).into_owned().into();
                    add(node, part(0), part(3));
                }
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use pliant_mechanics::mapping::check;
    use pliant_mechanics::model::Surface;
    use pliant_testing::Random;

    use super::*;
    use crate::tests::{ball, cube, model, strip};
    use pliant_shells::EdgeRule;

    /// Points around shaken and spinning shells of every kind, and points of weights.
    #[test]
    fn carried_points_pass_the_battery() {
        let mut random = Random::new(7);
        for shape in [ball(2), cube(), strip()] {
            let mut assembly = model(shape, 0.01);
            let curved = CurvedSurface::new(&assembly, EdgeRule::Arc);
            let mut state = AssemblyState::at_rest(&assembly);
            let points: Vec<Vector3<f64>> = (0..40).map(|_| Vector3::from(random.vector()) * 2.0).collect();
            let facets: Vec<u32> = (0..assembly.facets.len() as u32).collect();
            let carried = curved.carry_all(&assembly, &state, &facets, &points).unwrap();
            assembly.carried.insert(1, carried);
            let weights = Weights::from_rows([&[(0, 0.25), (3, 0.75)][..]]);
            let surface =
                |name: &str| Surface { name: name.into(), body: 0, rest: vec![], mapping: weights.clone() };
            assembly.model_mut().surfaces = vec![surface("weights"), surface("curved")];
            let shake: Vec<f64> = (0..6 * assembly.rest.len()).map(|_| 0.05 * random.number()).collect();
            state.advance(&shake, 1.0);
            for (velocity, spin) in state.velocity.iter_mut().zip(&mut state.spin) {
                (*velocity, *spin) = (random.vector().into(), random.vector().into());
            }
            let motion: Vec<f64> = state
                .velocity
                .iter()
                .zip(&state.spin)
                .flat_map(|(v, w)| [v.x, v.y, v.z, w.x, w.y, w.z])
                .collect();
            let [before, after] = [-1e-6, 1e-6].map(|time| {
                let mut moved = state.clone();
                moved.advance(&motion, time);
                moved
            });
            let node = |node: u32| {
                let spin = state.spin[node as usize].into();
                [Configuration::position(&state, node), Configuration::velocity(&state, node), spin]
            };
            for (surface, count) in [(0, 1), (1, points.len())] {
                let mapping = CarriedPoints::new(&assembly, Some(&curved), surface);
                check(&mapping, [&before, &state, &after], 2e-6, node, 0..count).unwrap();
            }
        }
    }
}
