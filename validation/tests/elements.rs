//! Which element to trust for nearly incompressible tissue, ν = 0.49: the cantilever under its own weight and the glued
//! cube at 20 %, with the meshes of the element study. Prints the study's table.
//!
//! Cantilever 0.08 × 0.03 × 0.03 m, half of it modelled, E = 20 kPa, ρ = 1000: tip (0.08, 0, 0.03) sinks by
//! 34.85 ± 0.15 mm. Cube of 0.1 m, an eighth of it modelled, E = 3 kPa: F = 9.15 ± 0.15 N, bulge 7.57 ± 0.08 mm.

use pliant_geometry::{Mesh, io};
use pliant_mechanics::Observable;
use pliant_mechanics::law::{AnyLaw, NeoHookean, Volumetric};
use pliant_mechanics::model::Averaging;
use pliant_meshing::{Block, DEFAULT_CELL_LIMIT, Resolution, VolumeCell};
use pliant_validation::{Hexes, Specimen, Tets, claim, data_file, elastic, relax, smooth_step};

const TIP: f64 = -34.85;
const FORCE: f64 = 9.15;
const ANP: Tets = Tets::Averaged(Averaging::Nodal);
const IANP: Tets = Tets::Averaged(Averaging::Variational);

fn nearly_incompressible(young: f64) -> AnyLaw {
    AnyLaw::NeoHookean(NeoHookean { shear: young / 2.98, volumetric: Volumetric::quadratic(young / 0.06) })
}

fn tets(file: &str) -> Mesh {
    io::read(&data_file(file)).unwrap().mesh
}

fn hexes(size: [f64; 3], counts: [usize; 3]) -> Mesh {
    Block::new(size).mesh(Resolution::Counts(counts), VolumeCell::Hex, DEFAULT_CELL_LIMIT).unwrap()
}

/// u_z of the tip [mm].
fn cantilever(name: &str, mesh: Mesh, tets: Tets, hexes: Hexes) -> f64 {
    let material = elastic(nearly_incompressible(20e3));
    let beam = Specimen::of_elements(mesh, tets, hexes, &material, [0.0; 3])
        .fix("x-min", [true; 3])
        .fix("y-min", [false, true, false])
        .falling([0.0, 0.0, -9.81]);
    let (_, state) = relax(&beam.model);
    let tip = 1e3 * state.displacement[beam.node_at([0.08, 0.0, 0.03])][2];
    println!(
        "cantilever, {name}, {} nodes: tip {tip:.2} mm ({:+.1} %)",
        beam.model.node_count(),
        off(tip, TIP)
    );
    tip
}

/// Force on the platen [N].
fn cube(name: &str, mesh: Mesh, tets: Tets, hexes: Hexes) -> f64 {
    let material = elastic(nearly_incompressible(3e3));
    let eighth = Specimen::of_elements(mesh, tets, hexes, &material, [0.0; 3])
        .shift("x-min", 0.2 * 0.05, smooth_step(1.0))
        .fix("x-min", [false, true, true])
        .fix("x-max", [true, false, false])
        .fix("y-min", [false, true, false])
        .fix("z-min", [false, false, true]);
    let (solver, state) = relax(&eighth.model);
    let force = 4.0 * solver.reaction(eighth.constraint("move x-min"))[0];
    let bulge = 1e3 * state.displacement[eighth.node_at([0.05, 0.05, 0.0])][1];
    let nodes = eighth.model.node_count();
    println!(
        "cube, {name}, {nodes} nodes: F {force:.3} N ({:+.1} %), bulge {bulge:.2} mm",
        off(force, FORCE)
    );
    force
}

/// Deviation in percent.
fn off(value: f64, truth: f64) -> f64 {
    100.0 * (value / truth - 1.0)
}

#[test]
fn cantilever_at_poisson_ratio_049_locks_plain_tets_and_no_others() {
    let mesh = || tets("cantilever_half_tet4.msh");
    let plain = cantilever("tet4", mesh(), Tets::Plain, Hexes::Full);
    assert!(off(plain, TIP) < -20.0, "plain tets are known to lock");
    let nodal = cantilever("tet4-anp", mesh(), ANP, Hexes::Full);
    claim("tet4-anp off by [%]", off(nodal, TIP).abs(), 8.0);
    cantilever("tet4-ianp", mesh(), IANP, Hexes::Full);
    let block = || hexes([0.08, 0.015, 0.03], [16, 3, 6]);
    let uniform = cantilever("hex8", block(), Tets::Plain, Hexes::UniformStrain(0.2));
    claim("hex8 off by [%]", off(uniform, TIP).abs(), 1.0);
    cantilever("hex8-full", block(), Tets::Plain, Hexes::Full);
}

#[test]
fn cube_at_poisson_ratio_049_locks_plain_tets_and_no_others() {
    let mesh = || tets("cube_eighth_tet4.msh");
    let plain = cube("tet4", mesh(), Tets::Plain, Hexes::Full);
    assert!(off(plain, FORCE) > 10.0, "plain tets are known to lock");
    let nodal = cube("tet4-anp", mesh(), ANP, Hexes::Full);
    claim("tet4-anp off by [%]", off(nodal, FORCE).abs(), 5.5);
    cube("tet4-ianp", mesh(), IANP, Hexes::Full);
    let block = || hexes([0.05; 3], [10; 3]);
    cube("hex8", block(), Tets::Plain, Hexes::UniformStrain(0.05));
    cube("hex8-full", block(), Tets::Plain, Hexes::Full);
}
