//! The surface of a body, or one that a body carries, as triangles: where its vertices are, and their
//! normals. It is what a renderer, a haptic loop or another program draws; fields come from
//! [`FieldReader`](crate::FieldReader).

use pliant_geometry::{Mesh, Surface, Vector3, boundary, patch};
use pliant_scene::World;
use pliant_sim::{Instant, Simulation};

use crate::output::{Frame, carried_on_shell};

/// A surface of a world. It reads the displacements that are at hand: displacements of a state on a GPU are
/// known after an instant is [looked at](Simulation::frame).
pub struct Skin {
    /// The participant, by number.
    part: usize,
    /// Places of vertices at rest [m].
    rest: Vec<[f64; 3]>,
    triangles: Vec<[u32; 3]>,
    follows: Follows,
}

/// Nodes or body that the vertices follow.
enum Follows {
    /// The node of the participant's model of each vertex.
    Nodes(Vec<u32>),
    /// The body that carries the surface, by the number of the surface in the model.
    Carrier(usize),
}

impl Skin {
    /// Finds the boundary of a body, or a carried surface, by name; without a name the boundary of the only
    /// body. Returns `None` if there is no such surface, or without a name if there are several bodies.
    pub fn new(world: &World, on: Option<&str>) -> Option<Self> {
        for (index, part) in world.participants.iter().enumerate() {
            let built = &part.built;
            let surface = built.model.surfaces.iter().position(|surface| Some(surface.name.as_str()) == on);
            if let Some(number) = surface {
                let (rest, triangles, _) =
                    used(&built.surfaces[number], &boundary(&built.surfaces[number]), false);
                return Some(Self { part: index, rest, triangles, follows: Follows::Carrier(number) });
            }
            let only = || on.is_none() && world.participants.len() == 1 && built.bodies.len() == 1;
            let body = built.bodies.iter().position(|body| Some(body.name.as_str()) == on || only());
            if let Some(number) = body {
                let body = &built.bodies[number];
                let (rest, triangles, vertices) = used(&body.mesh, &body.boundary, true);
                let nodes = vertices.iter().map(|&node| built.model.bodies[number].node(node)).collect();
                return Some(Self { part: index, rest, triangles, follows: Follows::Nodes(nodes) });
            }
        }
        None
    }

    /// The vertices of each triangle, in the order that makes its normal point outward where the body has an
    /// inside.
    pub fn triangles(&self) -> &[[u32; 3]] {
        &self.triangles
    }

    /// Returns the places of the vertices at rest [m].
    pub fn rest(&self) -> &[[f64; 3]] {
        &self.rest
    }

    /// A vertex as a combination of nodes, counted over the models of all participants.
    pub fn nodes_of(&self, simulation: &Simulation, vertex: u32) -> Vec<(u32, f64)> {
        match &self.follows {
            Follows::Nodes(nodes) => vec![(simulation.node(self.part, nodes[vertex as usize]), 1.0)],
            Follows::Carrier(number) => {
                let model = &simulation.setup().parts[self.part].model;
                let row = model.surfaces[*number].mapping.row(vertex as usize);
                row.map(|(node, weight)| (simulation.node(self.part, node), weight)).collect()
            }
        }
    }

    /// Returns the surface around a vertex within a radius [m] as a combination of nodes, like the grip of a
    /// hand ([`patch`]). With a radius of 0 it is the vertex alone.
    pub fn around(&self, simulation: &Simulation, vertex: u32, radius: f64) -> Vec<(u32, f64)> {
        let points: Vec<Vector3> = self.rest.iter().map(|&place| place.into()).collect();
        let at = |triangle: &&[u32; 3]| triangle.contains(&vertex);
        let held = match self.triangles.iter().find(at).filter(|_| radius > 0.0) {
            Some(&corners) => {
                let weights = corners.map(|corner| f64::from(u8::from(corner == vertex)));
                patch(&points, &self.triangles, corners, weights, Some(radius))
            }
            None => vec![(vertex, 1.0)],
        };
        let mut nodes: Vec<(u32, f64)> = Vec::new();
        for (vertex, weight) in held {
            nodes.extend(
                self.nodes_of(simulation, vertex).into_iter().map(|(node, share)| (node, share * weight)),
            );
        }
        nodes.sort_by_key(|(node, _)| *node);
        nodes.dedup_by(|(b, more), (a, weight)| {
            let same = a == b;
            *weight += if same { *more } else { 0.0 };
            same
        });
        nodes
    }

    /// Hands where each vertex is [m] to `take`, in their order.
    pub fn positions(&self, world: &World, simulation: &Simulation, mut take: impl FnMut(usize, [f64; 3])) {
        let Some(now) = simulation.instants().nth(self.part) else { return };
        match &self.follows {
            Follows::Nodes(nodes) => {
                for (vertex, (&node, rest)) in nodes.iter().zip(&self.rest).enumerate() {
                    let moved = now.displacement(node as usize);
                    take(vertex, [rest[0] + moved[0], rest[1] + moved[1], rest[2] + moved[2]]);
                }
            }
            Follows::Carrier(number) => self.carried(world, now, *number, take),
        }
    }

    fn carried(
        &self,
        world: &World,
        now: &dyn Instant,
        number: usize,
        mut take: impl FnMut(usize, [f64; 3]),
    ) {
        let part = &world.participants[self.part];
        let mapping = &part.built.model.surfaces[number].mapping;
        let on_shell = carried_on_shell(&Frame::new(part, now), number);
        for (vertex, rest) in self.rest.iter().enumerate() {
            let mut place = *rest;
            match &on_shell {
                Some(moved) => (0..3).for_each(|c| place[c] += moved[vertex][c]),
                None => {
                    for (node, weight) in mapping.row(vertex) {
                        let moved = now.displacement(node as usize);
                        (0..3).for_each(|c| place[c] += weight * moved[c]);
                    }
                }
            }
            take(vertex, place);
        }
    }

    /// Computes unit normals of vertices at these places [m]: the mean of the normals of the triangles around
    /// each, by area. Where these cancel the normal is zero.
    pub fn normals(&self, places: &[[f64; 3]], normals: &mut [[f64; 3]]) {
        normals.fill([0.0; 3]);
        for triangle in &self.triangles {
            let [a, b, c] = triangle.map(|vertex| places[vertex as usize]);
            let (u, v) = ([b[0] - a[0], b[1] - a[1], b[2] - a[2]], [c[0] - a[0], c[1] - a[1], c[2] - a[2]]);
            let area = [u[1] * v[2] - u[2] * v[1], u[2] * v[0] - u[0] * v[2], u[0] * v[1] - u[1] * v[0]];
            for &vertex in triangle {
                let sum = &mut normals[vertex as usize];
                (0..3).for_each(|c| sum[c] += area[c]);
            }
        }
        for normal in normals {
            let length = normal.iter().map(|x| x * x).sum::<f64>().sqrt();
            *normal = if length > 0.0 { normal.map(|x| x / length) } else { [0.0; 3] };
        }
    }
}

/// Takes points of a mesh as vertices: all points, or only the points of the surface. Returns them, the
/// triangles of the surface on them, and the point of each vertex.
fn used(mesh: &Mesh, surface: &Surface, only: bool) -> (Vec<[f64; 3]>, Vec<[u32; 3]>, Vec<u32>) {
    let mut triangles = surface.triangles();
    let vertices = if only { surface.nodes() } else { (0..mesh.points.len() as u32).collect() };
    if only {
        let mut number = vec![0; mesh.points.len()];
        vertices.iter().zip(0..).for_each(|(&point, vertex)| number[point as usize] = vertex);
        triangles.iter_mut().flatten().for_each(|point| *point = number[*point as usize]);
    }
    let place = |&point: &u32| -> [f64; 3] { Vector3::into(mesh.points[point as usize]) };
    (vertices.iter().map(place).collect(), triangles, vertices)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::testing::read;

    /// A block of tets with its own surface as one that it carries, bent by its weight.
    const BENT: &str = r#"
[scene]
until = 0.02
gravity = [0, 0, -9.81]
[law.tissue]
type = "neo-hookean"
young-modulus = 1e4
poisson-ratio = 0.45
[body.block]
mesh = { block = { size = [0.1, 0.05, 0.05] }, edge = 0.025, as = "tets" }
law = "tissue"
density = 1000
[constraint.wall]
type = "fix"
body = "block"
nodes = { set = "x-min" }
"#;

    #[test]
    fn vertices_follow_nodes_and_normals_point_outward() {
        let world = World::new(&read(BENT)).unwrap();
        assert!(Skin::new(&world, Some("blok")).is_none());
        let skin = Skin::new(&world, None).unwrap();
        let mut simulation = world.simulation().unwrap();
        simulation.run(0.02, |_| ()).unwrap();
        let mut places = vec![[0.0; 3]; skin.rest().len()];
        skin.positions(&world, &simulation, |vertex, place| places[vertex] = place);
        let mut normals = places.clone();
        skin.normals(&places, &mut normals);
        let now = simulation.instants().next().unwrap();
        let (mut flux, mut volume) = ([0.0; 3], 0.0);
        for (vertex, place) in places.iter().enumerate() {
            let nodes = skin.nodes_of(&simulation, vertex as u32);
            let ([(node, 1.0)], rest) = (&nodes[..], skin.rest()[vertex]) else {
                panic!("a node: {nodes:?}")
            };
            let moved = now.displacement(*node as usize);
            assert_eq!(*place, [0, 1, 2].map(|c| rest[c] + moved[c]));
            assert!((normals[vertex].iter().map(|x| x * x).sum::<f64>() - 1.0).abs() < 1e-12);
            let outward: f64 = (0..3).map(|c| normals[vertex][c] * (rest[c] - [0.05, 0.025, 0.025][c])).sum();
            assert!(outward > 0.0, "{rest:?} {:?}", normals[vertex]);
        }
        for triangle in skin.triangles() {
            let [a, b, c] = triangle.map(|vertex| Vector3::from(places[vertex as usize]));
            let area = (b - a).cross(&(c - a)) / 2.0;
            (0..3).for_each(|k| flux[k] += area[k]);
            volume += area.dot(&a) / 3.0;
        }
        assert!(flux.iter().all(|f: &f64| f.abs() < 1e-15) && (volume / 2.5e-4 - 1.0).abs() < 0.01);
    }
}
