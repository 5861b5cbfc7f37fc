//! Microbenchmarks of the kernels: stresses of laws, and whole steps of small cubes for each element.
//! `pliant-lab bench` measures the user's wall time; these help when changing a kernel:
//! `cargo bench -p pliant-bench`.

use divan::{Bencher, counter::ItemsCount};
use pliant_bench::{Clocked, HOURGLASS, Hexes, Specimen, Tets, Timed};
use pliant_explicit::{Scalar, State};
use pliant_mechanics::law::AnyLaw;
use pliant_mechanics::model::Averaging;
use pliant_mechanics::tissue::{deformation, elastic, liver, soft_tissue};
use pliant_meshing::{Block, DEFAULT_CELL_LIMIT, Resolution, VolumeCell};

fn main() {
    divan::main();
}

/// The stress of a law at one deformation, in plain numbers.
#[divan::bench(args = ["neo-hookean", "transversely-isotropic"])]
fn stress(bencher: Bencher<'_, '_>, law: &str) {
    let law: AnyLaw = if law == "neo-hookean" { soft_tissue() } else { liver() };
    let at = deformation([[1.1, 0.05, 0.0], [0.0, 0.95, 0.02], [0.01, 0.0, 1.02]]);
    let fibre = [[0.0, 1.0, 0.0]];
    let fibres = &fibre[..law.families()];
    bencher.bench(|| divan::black_box(&law).stress(divan::black_box(&at), fibres));
}

/// Cells along the edge of the cubes: few enough for the second cache.
const EDGE: usize = 8;

#[divan::bench(args = ["tet4", "tet4-anp", "hex8", "hex8-full"], types = [f32, f64])]
fn step<R: Scalar>(bencher: Bencher<'_, '_>, element: &str) {
    let kind = if element.starts_with("tet4") { VolumeCell::Tet } else { VolumeCell::Hex };
    let mesh = Block::new([0.1; 3]).mesh(Resolution::Counts([EDGE; 3]), kind, DEFAULT_CELL_LIMIT);
    let mesh = mesh.unwrap_or_else(|error| panic!("{error}"));
    let tets = if element == "tet4-anp" { Tets::Averaged(Averaging::Nodal) } else { Tets::Plain };
    let hexes = if element == "hex8-full" { Hexes::Full } else { Hexes::UniformStrain(HOURGLASS) };
    let specimen = Specimen::of_elements(mesh, tets, hexes, &elastic(soft_tissue()), [0.0, 1.0, 0.0]);
    let (model, step) = (&specimen.model, 0.5 * specimen.element_bound());
    let pool =
        rayon::ThreadPoolBuilder::new().num_threads(1).build().unwrap_or_else(|error| panic!("{error}"));
    let cells = ItemsCount::new(model.cell_count());
    let clocked = Clocked::<R>::new(model.clone(), step, State::at_rest(model));
    let mut clocked = clocked.unwrap_or_else(|error| panic!("{error}"));
    bencher.counter(cells).bench_local(|| pool.install(|| clocked.seconds_per_step(1)));
}
