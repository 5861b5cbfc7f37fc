//! Determinism: every run gives the same bits on any number of threads. Single precision is also compared
//! with double.

use pliant_explicit::{Scalar, State};
use pliant_geometry::{CellBlock, Mesh, Vector3};
use pliant_mechanics::model::Material;
use pliant_mechanics::prony::{Part, Prony, PronyTerm, PronyUpdate};
use pliant_mechanics::tensor::Vector;
use pliant_meshing::{Block, DEFAULT_CELL_LIMIT, Resolution, VolumeCell};
use pliant_validation::{Specimen, claim, liver, run, smooth_step};

/// Steps of a run.
const STEPS: f64 = 200.0;

/// Two cubes in one body, one of 1000 hexes and one of 3072 tets: enough for several tasks of nodes and of
/// cells.
fn tets_beside_hexes() -> Mesh {
    let cube = |counts, cells, x| {
        let block = Block { origin: Vector3::new(x, 0.0, 0.0), size: [0.1; 3] };
        block.mesh(Resolution::Counts([counts; 3]), cells, DEFAULT_CELL_LIMIT).unwrap()
    };
    let (mut both, tets) = (cube(10, VolumeCell::Hex, 0.0), cube(8, VolumeCell::Tet, 0.2));
    let first = both.points.len() as u32;
    both.points.extend(&tets.points);
    both.blocks.extend(
        tets.blocks
            .iter()
            .map(|block| CellBlock::new(block.kind, block.nodes.iter().map(|n| n + first).collect())),
    );
    both
}

/// Liver with oblique fibres and three terms of relaxation, pulled at one end and falling.
fn specimen() -> Specimen {
    let term = |part, weight, time| PronyTerm { part, weight, time };
    let terms = [
        term(Part::Isochoric, 0.3, 0.58),
        term(Part::Isochoric, 0.2, 0.05),
        term(Part::Volumetric, 0.1, 0.2),
    ];
    let material =
        Material { law: liver(), prony: Prony::new(&terms, PronyUpdate::Exact).unwrap(), density: 1060.0 };
    Specimen::new(tets_beside_hexes(), &material, [0.6, 0.0, 0.8])
        .fix("y-min", [true; 3])
        .shift("y-max", 0.02, smooth_step(0.05))
        .falling([0.0, 0.0, -9.81])
        .damped(5.0)
}

fn state_after_200_steps<R: Scalar>(threads: usize) -> State<R> {
    let specimen = specimen();
    let step = 0.9 * specimen.element_bound();
    let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap();
    // Half a step less, so that round-off of the time does not add one.
    let run = || run::<R>(&specimen.model, step, (STEPS - 0.5) * step, |_, _| ()).map(|(_, state)| state);
    let state = pool.install(run).unwrap_or_else(|error| panic!("{error}"));
    assert_eq!(state.steps, STEPS as u64);
    state
}

/// Bits of all displacements and increments; `==` alone takes 0 for −0.
fn bits<R: Scalar>(state: &State<R>) -> Vec<u64> {
    let fields = state.displacement.iter().chain(&state.increment);
    fields.flatten().map(|x| x.to_f64().to_bits()).collect()
}

fn same_bits<R: Scalar>() {
    let alone = state_after_200_steps::<R>(1);
    for (what, threads) in [("again on 1 thread", 1), ("on 2 threads", 2), ("on 8 threads", 8)] {
        let other = state_after_200_steps::<R>(threads);
        assert!(alone == other, "{what}");
        assert!(bits(&alone) == bits(&other), "{what}");
        println!("{}: the same bits {what}", R::PRECISION);
    }
}

#[test]
fn same_bits_on_1_2_and_8_threads_in_double_precision() {
    same_bits::<f64>();
}

#[test]
fn same_bits_on_1_2_and_8_threads_in_single_precision() {
    same_bits::<f32>();
}

#[test]
fn single_precision_stays_within_1e_5_of_double() {
    let fine = state_after_200_steps::<f64>(1).displacement;
    let coarse = state_after_200_steps::<f32>(1).displacement;
    let norm = |u: &mut dyn Iterator<Item = f64>| u.map(|x| x * x).sum::<f64>().sqrt();
    let pairs = fine.iter().flatten().zip(coarse.iter().flatten());
    let difference = norm(&mut pairs.map(|(a, &b)| a - f64::from(b)));
    let whole = norm(&mut fine.iter().copied().flat_map(Vector::<f64>::into_iter));
    // 200 steps round off by 6e-8 each, at random signs 1e-6 together; ten times that is left for stiff
    // vibrations.
    claim("‖u₃₂ − u₆₄‖/‖u₆₄‖ after 200 steps", difference / whole, 1e-5);
}
