//! `scenes/lens/bag.toml`: a lens is folded, pushed through a tube of 2.6 mm and comes into a capsular bag
//! that deforms. Each state is searched for edges that go through triangles; such an edge would end the run.

use std::path::Path;

use nalgebra::Vector3;
use pliant_contact::barrier::ccd::Kind;
use pliant_format::{Scene, open};
use pliant_geometry::{CellKind, Mesh};
use pliant_scene::World;
use rayon::prelude::*;

/// End of the tube along y [m].
const TUBE_ENDS: f64 = 30e-3;
/// The size of the force [N] between the lens and the bag above which they touch: the lens weighs 0.14 mN.
const TOUCHES: f64 = 1e-4;

/// Least displacement [m] of the bag where the lens lies in it.
const GIVES: f64 = 3e-5;

/// Layers of the lens, 0.3 mm thick, keep this distance of their middle surfaces at least [m].
const APART: f64 = 0.28e-3;
/// Parts of a layer are nearer to each other at rest than this [m].
const NEIGHBOURS: f64 = 0.36e-3;

/// The least distance [m] of points and triangles, and of edges, of a mesh of triangles that are no
/// neighbours at rest. Pairs farther apart than a millimetre are left out.
struct Layers {
    edges: Vec<[u32; 2]>,
    triangles: Vec<[u32; 3]>,
    rest: Vec<Vector3<f64>>,
}

impl Layers {
    fn new(mesh: &Mesh) -> Self {
        let block = mesh.block(CellKind::Triangle).unwrap();
        let triangles: Vec<[u32; 3]> = block.cells().map(|cell| cell.try_into().unwrap()).collect();
        let sides = triangles.iter().flat_map(|&[a, b, c]| [[a, b], [b, c], [c, a]]);
        let mut edges: Vec<[u32; 2]> = sides.map(|[a, b]| [a.min(b), a.max(b)]).collect();
        edges.sort_unstable();
        edges.dedup();
        Self { edges, triangles, rest: mesh.points.clone() }
    }

    fn least(&self, moved: &[[f64; 3]]) -> f64 {
        let now: Vec<_> = self.rest.iter().zip(moved).map(|(x, u)| x + Vector3::from(*u)).collect();
        let of = |kind: Kind, nodes: [u32; 4]| {
            let [corners, rest] = [&now, &self.rest].map(|places| nodes.map(|n| places[n as usize]));
            let middles = match kind {
                Kind::PointTriangle => corners[0] - (corners[1] + corners[2] + corners[3]) / 3.0,
                Kind::EdgeEdge => 0.5 * (corners[0] + corners[1] - corners[2] - corners[3]),
            };
            let is_pair = middles.norm_squared() < 1e-6 && kind.nearest(&rest).distance > NEIGHBOURS;
            if is_pair { kind.nearest(&corners).distance } else { f64::INFINITY }
        };
        let points = (0..now.len() as u32).into_par_iter().map(|p| {
            let distances = self.triangles.iter().map(|&[a, b, c]| of(Kind::PointTriangle, [p, a, b, c]));
            distances.fold(f64::INFINITY, f64::min)
        });
        let edges = self.edges.par_iter().enumerate().map(|(k, &[a, b])| {
            let distances = self.edges[k + 1..].iter().map(|&[c, d]| of(Kind::EdgeEdge, [a, b, c, d]));
            distances.fold(f64::INFINITY, f64::min)
        });
        points.chain(edges).reduce(|| f64::INFINITY, f64::min)
    }
}

/// Up to 4.3 s, when the lens has left the tube and begins to unfold: 1 to 3 minutes.
#[test]
#[ignore = "takes 1 to 3 minutes"]
fn a_lens_is_injected_into_a_bag_that_deforms() {
    let path = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../scenes/lens/bag.toml");
    let (source, folder) = open(&path).unwrap();
    let scene = Scene::from_source(source, folder).unwrap_or_else(|error| panic!("{}", error.plain()));
    assert!(scene.contacts.iter().any(|(_, contact)| contact.check_intersections));
    let world = World::new(&scene).unwrap_or_else(|error| panic!("{}", error.plain()));
    let part = &world.participants[0].built;
    let body = part.bodies.iter().find(|body| body.name == "lens").unwrap();
    let rest = body.mesh.points.clone();
    let optic: Vec<usize> = (0..rest.len()).filter(|&node| rest[node].norm() < 3.01e-3).collect();
    let layers = Layers::new(&body.mesh);
    let mut simulation = world.simulation().unwrap();
    let (mut steps, mut touched, mut largest, mut given) = (0_u32, 0_u32, 0.0_f64, 0.0);
    let (mut left, mut apart) = (f64::INFINITY, f64::INFINITY);
    simulation
        .run(4.3, |frame| {
            steps += 1;
            let force = frame.contact_force("bag").unwrap();
            touched += u32::from(force.iter().any(|x| x.abs() > TOUCHES));
            let moved = frame.displacements("lens").unwrap();
            let out = optic.iter().all(|&node| rest[node].y + moved[node][1] > TUBE_ENDS);
            if out && left.is_infinite() {
                left = frame.time();
            }
            apart = layers.least(&moved).min(apart);
            let bag = frame.displacements("bag").unwrap();
            let size = |u: &[f64; 3]| u.iter().map(|x| x * x).sum::<f64>().sqrt();
            given = bag.iter().map(size).fold(0.0, f64::max);
            largest = given.max(largest);
        })
        .unwrap_or_else(|failure| panic!("{failure}"));
    println!(
        "{steps} states; layers stay {:.3} mm apart; the optic is out of the tube at {left:.2} s; lens and bag touch in {touched}, the bag gives way by {:.2} mm, by {:.3} mm in the end",
        1e3 * apart,
        1e3 * largest,
        1e3 * given
    );
    assert!(apart >= APART, "{apart}");
    // How far the bag gives way while the lens snaps open is decided within a step, and is not resolved: 0.1
    // mm in steps of 10 ms, 1 mm in steps of 5 ms. The lens that lies in it leaves 0.04 to 0.05 mm with both.
    assert!(steps == 431 && left < 4.3 && touched > 0 && given > GIVES && largest >= given);
}
