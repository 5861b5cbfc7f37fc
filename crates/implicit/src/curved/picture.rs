//! Pictures of the curved surface: each patch cut into small triangles, with the fields that a writer or a
//! window needs at their corners. Facets share the points of an edge where they share its normals. Where the
//! normals differ, at creases, each side has its own points at the same places. The number of points is
//! linear in the facets and in the square of the parts of an edge. Leaves out: fewer triangles where the
//! surface is flat.

use nalgebra::{Quaternion, UnitQuaternion, Vector3};
use pliant_shells::Place;
use pliant_shells::rotation::logarithm;
use rayon::prelude::*;

use crate::curved::surface::CurvedSurface;
use crate::model::assembly::Assembly;
use crate::model::state::AssemblyState;

/// Points and triangles that show the surface.
#[derive(Clone, Debug, PartialEq)]
pub struct Picture {
    /// Places of its points on the surface.
    pub places: Vec<Place>,
    /// Its triangles, facet by facet.
    pub triangles: Vec<[u32; 3]>,
    /// Bits of each triangle: bit i is set if the side opposite to corner i lies on an edge of the facet.
    pub facet_edges: Vec<u8>,
    /// Its points at rest [m].
    pub rest: Vec<Vector3<f64>>,
    /// Triangles of each facet.
    per_facet: usize,
}

/// Fields at the points of a picture. Its arrays are made at the first use and kept.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct PictureFields {
    /// Positions [m].
    pub position: Vec<Vector3<f64>>,
    /// Displacements [m]: of points of the curved surface from where these are at rest.
    pub displacement: Vec<Vector3<f64>>,
    /// Rotation vectors [rad], of length at most π, of the mean of the rotations of the facet's nodes
    /// weighted by area coordinates.
    pub rotation: Vec<Vector3<f64>>,
    /// Unit normals for shading, the same on both sides of edges but at creases: quadratic, see
    /// [`Patch::shading_normal`](pliant_shells::Patch::shading_normal).
    pub normal: Vec<Vector3<f64>>,
}

impl CurvedSurface {
    /// Points and triangles with each edge cut into `parts` (at least 1).
    pub fn picture(&self, model: &Assembly, parts: u32) -> Picture {
        let parts = parts.max(1);
        let mut edges: Vec<[u32; 2]> = model
            .corner_normals
            .iter()
            .flat_map(|n| [0, 1, 2].map(|i| sorted(n[i], n[(i + 1) % 3])))
            .collect();
        edges.sort_unstable();
        edges.dedup();
        let on_edge = parts - 1;
        let first_on_edges = model.normals.len() as u32;
        let first_inside = first_on_edges + edges.len() as u32 * on_edge;
        let inside = on_edge * on_edge.saturating_sub(1) / 2;
        let facets = model.facets.len();
        let count = first_inside as usize + facets * inside as usize;
        let mut places = vec![Place { facet: 0, weights: [1.0, 0.0, 0.0] }; count];
        let per_facet = (parts * parts) as usize;
        let mut triangles = Vec::with_capacity(facets * per_facet);
        let mut facet_edges = Vec::with_capacity(facets * per_facet);
        // Points by (second, third), row after row of third.
        let mut grid = Vec::new();
        for (facet, normals) in model.corner_normals.iter().enumerate() {
            // Where the points of each edge begin, and whether they run from its second corner to its first.
            let along = [0, 1, 2].map(|i| {
                let ends = [normals[i], normals[(i + 1) % 3]];
                let number = edges.partition_point(|edge| *edge < sorted(ends[0], ends[1])) as u32;
                (first_on_edges + number * on_edge, ends[0] > ends[1])
            });
            let mut next_inside = first_inside + facet as u32 * inside;
            grid.clear();
            for third in 0..=parts {
                for second in 0..=parts - third {
                    let shares = [parts - second - third, second, third];
                    let corner = shares.iter().position(|&share| share == parts);
                    let opposite = shares.iter().position(|&share| share == 0);
                    let point = match (corner, opposite) {
                        (Some(corner), _) => normals[corner],
                        (None, Some(opposite)) => {
                            let edge = (opposite + 1) % 3;
                            let (first, reversed) = along[edge];
                            first + shares[if reversed { edge } else { (edge + 1) % 3 }] - 1
                        }
                        (None, None) => {
                            next_inside += 1;
                            next_inside - 1
                        }
                    };
                    let weights = shares.map(|share| f64::from(share) / f64::from(parts));
                    places[point as usize] = Place { facet: facet as u32, weights };
                    grid.push(point);
                }
            }
            let mut row = 0;
            for width in (1..=parts as usize).rev() {
                let above = row + width + 1;
                for at in 0..width {
                    triangles.push([grid[row + at], grid[row + at + 1], grid[above + at]]);
                    let on_edges = [at + 1 == width, at == 0, width == parts as usize];
                    facet_edges.push(on_edges.iter().zip(0..).map(|(&on, bit)| u8::from(on) << bit).sum());
                    if at + 1 < width {
                        facet_edges.push(0);
                        triangles.push([grid[row + at + 1], grid[above + at + 1], grid[above + at]]);
                    }
                }
                row = above;
            }
        }
        let state = AssemblyState::at_rest(model);
        let point = |place: &Place| self.patch(model, &state, place.facet).point(place.weights);
        let rest = places.par_iter().with_min_len(64).map(point).collect();
        Picture { places, triangles, facet_edges, rest, per_facet }
    }
}

fn sorted(a: u32, b: u32) -> [u32; 2] {
    [a.min(b), a.max(b)]
}

impl Picture {
    /// The facet that a triangle is part of.
    pub fn facet(&self, triangle: usize) -> u32 {
        (triangle / self.per_facet) as u32
    }
}

impl PictureFields {
    /// Fills the arrays for a state, points side by side.
    pub fn fill(
        &mut self,
        picture: &Picture,
        surface: &CurvedSurface,
        model: &Assembly,
        state: &AssemblyState,
    ) {
        let count = picture.places.len();
        for vectors in [&mut self.position, &mut self.displacement, &mut self.rotation, &mut self.normal] {
            vectors.resize(count, Vector3::zeros());
        }
        (
            &picture.places,
            &picture.rest,
            &mut self.position,
            &mut self.displacement,
            &mut self.rotation,
            &mut self.normal,
        )
            .into_par_iter()
            .with_min_len(64)
            .for_each(|(place, rest, position, displacement, rotation, normal)| {
                let patch = surface.patch(model, state, place.facet);
                *position = patch.point(place.weights);
                *displacement = *position - rest;
                let nodes = model.facets[place.facet as usize].nodes;
                *rotation = mean_rotation(nodes.map(|node| state.rotation[node as usize]), place.weights);
                *normal = patch.shading_normal(place.weights);
            });
    }
}

/// The rotation vector of the normalised mean of quaternions, taken with the signs of one half of their
/// sphere.
fn mean_rotation(rotations: [UnitQuaternion<f64>; 3], weights: [f64; 3]) -> Vector3<f64> {
    let first = rotations[0].coords;
    let parts = rotations.iter().zip(weights).map(|(rotation, weight)| {
        let sign = if rotation.coords.dot(&first) < 0.0 { -1.0 } else { 1.0 };
        rotation.coords * (sign * weight)
    });
    logarithm(&UnitQuaternion::new_normalize(Quaternion::from_vector(parts.sum())))
}

#[cfg(test)]
mod tests {
    use std::collections::BTreeMap;

    use super::*;
    use crate::tests::{ball, cube, model};
    use pliant_shells::EdgeRule;
    use pliant_testing::Random;

    fn shaken(model: &Assembly, size: f64, seed: u64) -> AssemblyState {
        let mut random = Random::new(seed);
        let mut state = AssemblyState::at_rest(model);
        let shake: Vec<f64> = (0..6 * model.rest.len()).map(|_| size * random.number()).collect();
        state.advance(&shake, 1.0);
        state
    }

    /// Each edge of each triangle has exactly one partner that runs the other way.
    fn closed(triangles: impl Iterator<Item = [u32; 3]>) -> bool {
        let mut sides: BTreeMap<[u32; 2], i32> = BTreeMap::new();
        for [a, b, c] in triangles {
            for (from, to) in [(a, b), (b, c), (c, a)] {
                *sides.entry(sorted(from, to)).or_default() += if from < to { 1 } else { 100 };
            }
        }
        sides.values().all(|&count| count == 101)
    }

    /// A smooth ball is closed by shared points alone. It has V + E (k − 1) + F (k − 1)(k − 2)/2 points and F
    /// k² triangles, so the cost is linear in F.
    #[test]
    fn pictures_are_watertight_and_their_size_is_linear() {
        for cuts in [1, 2] {
            let model = model(ball(cuts), 0.01);
            let (v, f) = (model.rest.len(), model.facets.len());
            let surface = CurvedSurface::new(&model, EdgeRule::Arc);
            for k in 1..=5 {
                let picture = surface.picture(&model, k as u32);
                assert!(closed(picture.triangles.iter().copied()));
                assert_eq!(picture.triangles.len(), f * k * k);
                // Each facet has three edges of k parts.
                let on_edges: u32 = picture.facet_edges.iter().map(|bits| bits.count_ones()).sum();
                assert_eq!(on_edges as usize, 3 * k * f);
                for (triangle, bits) in picture.triangles.iter().zip(&picture.facet_edges) {
                    for corner in (0..3).filter(|corner| bits >> corner & 1 == 1) {
                        let ends = [triangle[(corner + 1) % 3], triangle[(corner + 2) % 3]];
                        assert!(
                            ends.into_iter().all(|end| picture.places[end as usize].weights.contains(&0.0))
                        );
                    }
                }
                let inside = (k - 1) * k.saturating_sub(2) / 2;
                assert_eq!(picture.places.len(), v + 3 * f / 2 * (k - 1) + f * inside);
                // Triangles lie above their facets.
                for (number, triangle) in picture.triangles.iter().enumerate() {
                    let mean = |points: [u32; 3], of: &dyn Fn(usize) -> Vector3<f64>| -> Vector3<f64> {
                        points.iter().map(|&p| of(p as usize)).sum::<Vector3<f64>>() / 3.0
                    };
                    let nodes = model.facets[picture.facet(number) as usize].nodes;
                    let reach = (model.place(nodes[0] as usize) - model.place(nodes[1] as usize)).norm();
                    let gap = mean(*triangle, &|p| picture.rest[p]) - mean(nodes, &|n| model.place(n));
                    assert!(gap.norm() < reach, "{number}");
                }
            }
        }
    }

    /// A cube has creases: points there are doubled, but lie at the same places in any configuration, for any
    /// parts.
    #[test]
    fn creases_are_watertight_in_place() {
        let model = model(cube(), 0.01);
        let surface = CurvedSurface::new(&model, EdgeRule::Arc);
        for (seed, parts) in [(1, 1), (2, 2), (3, 3), (4, 7)] {
            let state = shaken(&model, 0.2, seed);
            let picture = surface.picture(&model, parts);
            let mut fields = PictureFields::default();
            fields.fill(&picture, &surface, &model, &state);
            assert!(!closed(picture.triangles.iter().copied()));
            let same = |a: &Vector3<f64>| {
                fields.position.iter().position(|b| (a - b).norm() < 1e-13).unwrap_or_default() as u32
            };
            let welded: Vec<u32> = fields.position.iter().map(same).collect();
            assert!(closed(picture.triangles.iter().map(|t| t.map(|p| welded[p as usize]))));
        }
    }

    /// Shared points are the same from whichever facet they are computed.
    #[test]
    fn fields_of_shared_points_do_not_depend_on_the_facet() {
        let model = model(ball(1), 0.01);
        let surface = CurvedSurface::new(&model, EdgeRule::Arc);
        let state = shaken(&model, 0.2, 5);
        for facet in 0..model.facets.len() as u32 {
            let nodes = model.facets[facet as usize].nodes;
            let patch = surface.patch(&model, &state, facet);
            for other in 0..facet {
                let there = surface.patch(&model, &state, other);
                let shared =
                    nodes.map(|node| model.facets[other as usize].nodes.iter().position(|&n| n == node));
                let Some(missing) = shared.iter().position(Option::is_none) else { continue };
                if shared.iter().flatten().count() != 2 {
                    continue;
                }
                let mut here = [0.3, 0.3, 0.3];
                (here[(missing + 1) % 3], here[(missing + 2) % 3], here[missing]) = (0.4, 0.6, 0.0);
                let mut across = [0.0; 3];
                for (corner, weight) in shared.into_iter().zip(here) {
                    corner.into_iter().for_each(|corner| across[corner] = weight);
                }
                assert!((patch.point(here) - there.point(across)).norm() < 1e-14);
                assert!((patch.shading_normal(here) - there.shading_normal(across)).norm() < 1e-14);
            }
        }
    }

    /// At rest nothing is displaced. In a rigid motion every point moves with the body and has its rotation
    /// vector.
    #[test]
    fn a_rigid_motion_of_a_picture() {
        let model = model(ball(2), 0.01);
        let surface = CurvedSurface::new(&model, EdgeRule::Arc);
        let picture = surface.picture(&model, 3);
        let mut state = AssemblyState::at_rest(&model);
        let mut fields = PictureFields::default();
        fields.fill(&picture, &surface, &model, &state);
        assert!(fields.displacement.iter().chain(&fields.rotation).all(|d| *d == Vector3::zeros()));
        let rest_normals = fields.normal.clone();
        let vector = Vector3::new(1.0, -0.5, 2.0);
        let turn = pliant_shells::rotation::exponential(&vector);
        state.position.iter_mut().for_each(|x| *x = turn * *x + vector);
        state.rotation.iter_mut().for_each(|r| *r = turn * *r);
        fields.fill(&picture, &surface, &model, &state);
        for (point, rest) in picture.rest.iter().enumerate() {
            assert!((fields.displacement[point] - (turn * rest + vector - rest)).norm() < 1e-13);
            assert!((fields.rotation[point] - vector).norm() < 1e-13);
            assert!((fields.normal[point] - turn * rest_normals[point]).norm() < 1e-13);
        }
    }

    /// On a ball of 128 patches the shading normals agree with the normals of the sphere to 1°.
    #[test]
    fn a_ball_is_shaded_as_a_sphere() {
        let mut model = model(ball(2), 0.01);
        let places: Vec<_> = model.places().collect();
        model.normals.iter_mut().for_each(|normal| normal.direction = places[normal.node as usize]);
        let surface = CurvedSurface::new(&model, EdgeRule::Arc);
        let picture = surface.picture(&model, 4);
        let mut fields = PictureFields::default();
        fields.fill(&picture, &surface, &model, &AssemblyState::at_rest(&model));
        let off = fields.normal.iter().zip(&fields.position).map(|(n, x)| n.angle(x)).fold(0.0, f64::max);
        println!("shading normals off by {:.2}°", off.to_degrees());
        assert!(off < 1_f64.to_radians(), "{off}");
    }
}
