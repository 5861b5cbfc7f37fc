//! Prints size, quality and time of the raw meshes of the analytic organs, for the default lattice and the
//! worst of eight others: `cargo run --release -p pliant-meshing --example measure`

use std::time::Instant;

use pliant_meshing::{MeshingError, Organ, Phantom, Stuffing, Voxels};
use pliant_testing::{Random, mesh_checks};

fn main() -> Result<(), MeshingError> {
    for (organ, edge) in [
        (Organ::Liver, 0.010),
        (Organ::Liver, 0.005),
        (Organ::Liver, 0.0025),
        (Organ::Brain, 0.010),
        (Organ::Brain, 0.008),
        (Organ::Brain, 0.005),
    ] {
        println!("{organ:?}, {:.1} mm", edge * 1e3);
        default_lattice(&Phantom::new(organ, 1.0)?, edge)?;
        worst_lattice(&Phantom::new(organ, 1.0)?, edge)?;
        cubes(&Phantom::new(organ, 1.0)?, edge)?;
    }
    Ok(())
}

fn default_lattice(phantom: &Phantom, edge: f64) -> Result<(), MeshingError> {
    let mut best = f64::INFINITY;
    for _ in 0..5 {
        let start = Instant::now();
        Stuffing::new(edge).mesh(phantom)?;
        best = best.min(start.elapsed().as_secs_f64());
    }
    let filled = Stuffing::new(edge).mesh(phantom)?;
    let [sharpest, bluntest] = mesh_checks::dihedral_range(&filled.mesh);
    println!(
        "  tets: {} nodes, {} tets, {:.1} ml, dihedral {sharpest:.1} to {bluntest:.1} degrees, \
         least acoustic length {:.3} of ideal, {} non-manifold edges, {} cells dropped, {:.1} ms (best of 5)",
        filled.mesh.points.len(),
        filled.mesh.blocks[0].len(),
        mesh_checks::tet_volume(&filled.mesh) * 1e6,
        mesh_checks::least_acoustic_length(&filled.mesh) / mesh_checks::ideal_acoustic_length(edge),
        filled.non_manifold_edges,
        filled.dropped_cells,
        best * 1e3
    );
    Ok(())
}

fn worst_lattice(phantom: &Phantom, edge: f64) -> Result<(), MeshingError> {
    let mut random = Random::new(9);
    let (mut sharpest, mut bluntest, mut shortest) = (180.0_f64, 0.0_f64, f64::INFINITY);
    for _ in 0..8 {
        let stuffing =
            Stuffing { origin: Some(mesh_checks::offset(&mut random, edge)), ..Stuffing::new(edge) };
        let mesh = stuffing.mesh(phantom)?.mesh;
        let [low, high] = mesh_checks::dihedral_range(&mesh);
        (sharpest, bluntest) = (sharpest.min(low), bluntest.max(high));
        shortest = shortest
            .min(mesh_checks::least_acoustic_length(&mesh) / mesh_checks::ideal_acoustic_length(edge));
    }
    println!(
        "  8 offsets: dihedral {sharpest:.1} to {bluntest:.1} degrees, least acoustic length {shortest:.3}"
    );
    Ok(())
}

fn cubes(phantom: &Phantom, edge: f64) -> Result<(), MeshingError> {
    let start = Instant::now();
    let cubes = Voxels::new(edge).mesh(phantom)?;
    println!(
        "  cubes: {} nodes, {} cells, {} non-manifold edges, {:.1} ms",
        cubes.mesh.points.len(),
        cubes.mesh.blocks[0].len(),
        cubes.non_manifold_edges,
        start.elapsed().as_secs_f64() * 1e3
    );
    Ok(())
}
