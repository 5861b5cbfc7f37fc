//! Cost of the order and the shape of a mesh. The liver in stuffed tetrahedra is timed as meshed, with its
//! cells shuffled, and with its nodes also shuffled. A cube of about as many cells is timed for comparison.
//! Neo-Hookean, single precision, one thread. The meshes are stepped alternately, and the fastest of two
//! hundred short repeats counts.

use std::error::Error;

use pliant_bench::{Clocked, Specimen, Spread, Timed};
use pliant_explicit::State;
use pliant_geometry::Mesh;
use pliant_mechanics::tissue::{elastic, soft_tissue};
use pliant_meshing::{Organ, Phantom, Stuffing, VolumeCell};
use pliant_testing::Random;

/// Turns of all meshes.
const TURNS: usize = 200;
/// Wall time of a repeat [s].
const SECONDS: f64 = 0.003;

/// Numbers from 0 on in an order without pattern.
fn shuffled(count: usize) -> Vec<u32> {
    let mut order: Vec<u32> = (0..count as u32).collect();
    let mut random = Random::new(1);
    for k in (1..count).rev() {
        order.swap(k, random.below(k + 1));
    }
    order
}

/// Returns the mesh with its cells in another order, and its nodes too if `nodes`.
fn in_disorder(mesh: &Mesh, nodes: bool) -> Mesh {
    let mut mesh = mesh.clone();
    if nodes {
        let order = shuffled(mesh.points.len());
        let points = mesh.points.clone();
        for (&to, point) in order.iter().zip(points) {
            mesh.points[to as usize] = point;
        }
        mesh.blocks
            .iter_mut()
            .flat_map(|block| &mut block.nodes)
            .for_each(|node| *node = order[*node as usize]);
    }
    for block in &mut mesh.blocks {
        let cells: Vec<Vec<u32>> = block.cells().map(<[u32]>::to_vec).collect();
        block.nodes =
            shuffled(cells.len()).into_iter().flat_map(|cell| cells[cell as usize].clone()).collect();
    }
    mesh
}

fn main() -> Result<(), Box<dyn Error>> {
    let organ = Stuffing::new(0.0046).mesh(&Phantom::new(Organ::Liver, 1.0)?)?.mesh;
    let material = elastic(soft_tissue());
    let specimen = |mesh: Mesh| Specimen::new(mesh, &material, [0.0, 1.0, 0.0]);
    let cube = Specimen::block([0.1; 3], [21; 3], VolumeCell::Tet, &material, [0.0, 1.0, 0.0]);
    let meshes = [
        ("cube", cube),
        ("liver", specimen(organ.clone())),
        ("liver, cells shuffled", specimen(in_disorder(&organ, false))),
        ("liver, cells and nodes shuffled", specimen(in_disorder(&organ, true))),
    ];
    let mut clocked = Vec::new();
    for (_, specimen) in &meshes {
        let model = &specimen.model;
        let displacement =
            model.rest.iter().map(|x| [-0.02 * x[0], 0.01 * x[0], 0.005 * x[0]].map(|u| u as f32));
        let state = State { displacement: displacement.collect(), ..State::at_rest(model) };
        clocked.push(Clocked::new(model.clone(), 0.5 * specimen.element_bound(), state)?);
    }
    let pool = rayon::ThreadPoolBuilder::new().num_threads(1).build()?;
    let mut times = vec![Vec::new(); meshes.len()];
    pool.install(|| -> Result<(), Box<dyn Error + Send + Sync>> {
        for _ in 0..TURNS {
            for (clocked, times) in clocked.iter_mut().zip(&mut times) {
                let steps = clocked.steps_within(SECONDS)?;
                times.push(clocked.seconds_per_step(steps)?);
            }
        }
        Ok(())
    })
    .map_err(|error| error.to_string())?;
    let mut first = None;
    println!("| mesh | elements | nodes | ns | median | × cube |\n|:--|--:|--:|--:|--:|--:|");
    for ((name, specimen), times) in meshes.iter().zip(times) {
        let (cells, nodes) = (specimen.model.cell_count(), specimen.model.node_count());
        let spread = Spread::of(times.into_iter().map(|seconds| 1e9 * seconds / cells as f64));
        let cube = *first.get_or_insert(spread.least);
        let Spread { least, median, .. } = spread;
        println!("| {name} | {cells} | {nodes} | {least:.2} | {median:.2} | {:.2} |", least / cube);
    }
    Ok(())
}
