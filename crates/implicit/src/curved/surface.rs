//! The curved surface of a shell: a patch over each facet. Each control point of an edge depends on that
//! edge's nodes alone, so the surface is watertight in every configuration. Leaves out: continuous tangents
//! across edges (their jump falls with h²).

use nalgebra::Vector3;
use pliant_shells::{Carried, EdgeRule, Patch, Place};
use pliant_shells::{sides, straight_edges};

use crate::model::assembly::Assembly;
use crate::model::state::AssemblyState;

/// The curved surface of a model's shells.
#[derive(Clone, Debug)]
pub struct CurvedSurface {
    rule: EdgeRule,
    /// Edge control points on the straight edge, as at creases.
    straight: Vec<[bool; 6]>,
    /// The facet across each edge 12, 23, 31.
    neighbours: Vec<[Option<u32>; 3]>,
}

impl CurvedSurface {
    /// The surface of all facets.
    pub fn new(model: &Assembly, rule: EdgeRule) -> Self {
        let mut neighbours = vec![[None; 3]; model.facets.len()];
        for sides in sides(&model.facets).values() {
            if let [(a, i), (b, j)] = sides[..] {
                neighbours[a][i] = Some(b as u32);
                neighbours[b][j] = Some(a as u32);
            }
        }
        let straight = straight_edges(&model.facets, &model.corner_normals, &model.normals, &model.rest);
        Self { rule, straight, neighbours }
    }

    /// The patch over a facet.
    pub fn patch(&self, model: &Assembly, state: &AssemblyState, facet: u32) -> Patch {
        let facet = facet as usize;
        let p = model.facets[facet].nodes.map(|node| state.position[node as usize]);
        let n = model.corner_normals[facet].map(|normal| state.normal(model, normal as usize));
        Patch::new(p, n, self.straight[facet], self.rule)
    }

    /// The foot of a point on the surface at a state, found from a facet near it. The search starts at the
    /// nearest place of that facet's patch. It moves to neighbours across the edges on which the place lies,
    /// as long as their places are nearer.
    pub fn project(&self, model: &Assembly, state: &AssemblyState, point: Vector3<f64>, facet: u32) -> Place {
        let nearest = |facet: u32| {
            let (weights, distance) = self.patch(model, state, facet).closest(&point, [1.0 / 3.0; 3]);
            (Place { facet, weights }, distance)
        };
        let mut best = nearest(facet);
        let mut seen = vec![facet];
        let mut next = vec![best.0];
        while let Some(place) = next.pop() {
            for corner in (0..3).filter(|&corner| place.weights[corner] < 1e-12) {
                // The edge opposite to a corner lies across from it.
                let across = self.neighbours[place.facet as usize][(corner + 1) % 3];
                let Some(across) = across.filter(|facet| !seen.contains(facet)) else { continue };
                seen.push(across);
                let found = nearest(across);
                // Equally near, round a common corner, are ways on.
                if found.1 <= best.1 * (1.0 + 1e-9) {
                    next.push(found.0);
                }
                if found.1 < best.1 {
                    best = found;
                }
            }
        }
        best.0
    }

    /// A point of a visual mesh, bound to the surface where it now is; `facet` is one near it.
    pub fn carry(&self, model: &Assembly, state: &AssemblyState, point: Vector3<f64>, facet: u32) -> Carried {
        self.bind(model, state, &point, self.project(model, state, point, facet))
    }

    pub(crate) fn bind(
        &self,
        model: &Assembly,
        state: &AssemblyState,
        point: &Vector3<f64>,
        place: Place,
    ) -> Carried {
        let patch = self.patch(model, state, place.facet);
        let offset = point - patch.point(place.weights);
        let [first, second, normal] = patch.frame(place.weights);
        Carried { place, height: offset.dot(&normal), aside: [offset.dot(&first), offset.dot(&second)] }
    }

    /// Position [m] of a carried point.
    pub fn carried(&self, model: &Assembly, state: &AssemblyState, point: &Carried) -> Vector3<f64> {
        self.patch(model, state, point.place.facet).carried(point)
    }
}
