//! Meshes of the label images of the analytic organs, made for the time step: the meshing specification's T2,
//! T3 and T5. Meshes of different density are compared by τ = Δt c / h with h = (V / nodes)^(1/3). Δt is the
//! critical time step. For the same organs, TetGen gives τ = 0.02 to 0.29, fTetWild 0.19, and Gmsh 0.29 to
//! 0.52. The ideal lattice has 0.73.

use pliant_geometry::{Mesh, Vector3};
use pliant_imaging::{Cleaning, LabelImage, ReadOptions, Smoothing, read};
use pliant_meshing::{Anatomy, Organ, OrganMesh, OrganTets};
use pliant_testing::mesh_checks::{conforming_boundary, edge_counts, pinched};
use pliant_testing::organs;
use pliant_validation::{Specimen, elastic, law, run};
use serde_json::json;

const YOUNG: f64 = 3000.0;
const POISSON: f64 = 0.45;
const DENSITY: f64 = 1000.0;

fn specimen(mesh: Mesh) -> Specimen {
    let tissue = law("neo-hookean", json!({ "young-modulus": YOUNG, "poisson-ratio": POISSON }));
    Specimen::new(mesh, &elastic(tissue), [0.0; 3])
}

fn organ(image: &LabelImage, labels: &[i32], edge: f64, origin: Vector3) -> OrganMesh {
    let cleaning = Cleaning { keep_largest: true, ..Cleaning::default() };
    let (anatomy, _) = Anatomy::from_image(image, labels, &cleaning, &Smoothing::default(), &|_| {}).unwrap();
    let request = OrganTets { origin: Some(origin), ..OrganTets::new(edge) };
    request.mesh(&anatomy, &|_| {}).unwrap()
}

/// The critical time step [s] and τ.
fn limit(made: &OrganMesh) -> [f64; 2] {
    let limit = specimen(made.mesh.clone()).critical_step();
    let modulus = YOUNG * (1.0 - POISSON) / ((1.0 + POISSON) * (1.0 - 2.0 * POISSON));
    let volume: f64 = made.report.materials.iter().map(|material| material.volume).sum();
    let h = (volume / made.report.nodes as f64).cbrt();
    [limit, limit * (modulus / DENSITY).sqrt() / h]
}

fn check(name: &str, image: &LabelImage, labels: &[i32], edge: f64, least: f64) {
    let made = organ(image, labels, edge, Vector3::zeros());
    let [step, tau] = limit(&made);
    println!(
        "{name} at {:.0} mm: {} nodes, {} tets, least acoustic length {:.3} of ideal, critical time step {:.3} ms, τ {tau:.3}",
        edge * 1e3,
        made.report.nodes,
        made.report.tets,
        made.report.acoustic_part,
        step * 1e3
    );
    assert!(made.report.acoustic_part >= 0.75);
    assert!(tau >= least, "τ = {tau}");
}

#[test]
fn the_liver_at_10_mm_has_the_step_of_the_specification() {
    check("liver", &organs::liver(), &[1], 0.010, 0.58);
}

#[test]
fn the_brain_at_10_mm_has_the_step_of_the_specification() {
    check("brain", &organs::whole_brain(), &[1], 0.010, 0.58);
}

#[test]
fn inner_materials_do_not_cost_the_step() {
    check("brain with ventricles and tumour", &organs::brain(), &[1, 2, 3], 0.010, 0.58);
}

/// The brain at 5 mm, with its materials, misses 0.56: τ = 0.545.
#[test]
#[ignore = "slow: 20 s in release"]
fn the_liver_at_5_mm_has_the_step_of_the_specification() {
    check("liver", &organs::liver(), &[1], 0.005, 0.56);
}

/// Everything that the specification asks of meshes of the organs, lattice by lattice, as a table: `cargo
/// test --release -p pliant-validation --test organ_meshes table -- --ignored --nocapture`. Distances in
/// lattice constants: RMS from the mesh to the true surface, H both ways, and RMS of the interfaces of
/// ventricles and tumour. Times: the median of three on one core.
#[test]
#[ignore = "slow: minutes in release"]
fn table_of_organ_meshes() {
    let one_core = || rayon::ThreadPoolBuilder::new().num_threads(1).build().unwrap();
    println!(
        "organ edge[mm] lattice | tets | acoustic raw τ | RMS H→ H← | interfaces | volumes[%] | time[s]"
    );
    for (name, image, labels, edge, lattices) in [
        ("liver", organs::liver(), &[1][..], 0.010, 8),
        ("brain", organs::whole_brain(), &[1], 0.010, 8),
        ("brain+inner", organs::brain(), &[1, 2, 3], 0.010, 8),
        ("liver", organs::liver(), &[1], 0.005, 2),
        ("brain+inner", organs::brain(), &[1, 2, 3], 0.005, 2),
    ] {
        let truth = organs::truth(name);
        let cleaning = Cleaning { keep_largest: true, ..Cleaning::default() };
        let (anatomy, _) =
            Anatomy::from_image(&image, labels, &cleaning, &Smoothing::default(), &|_| {}).unwrap();
        for lattice in 0..lattices {
            // Low-discrepancy offsets (multiples of the plastic number's powers), the first of them zero.
            let shift =
                [0.8191725, 0.6710436, 0.5497005].map(|part: f64| (f64::from(lattice) * part).fract());
            let request = OrganTets { origin: Some(Vector3::from(shift) * edge), ..OrganTets::new(edge) };
            let run = || {
                let start = std::time::Instant::now();
                let made = one_core().install(|| request.mesh(&anatomy, &|_| {}).unwrap());
                (start.elapsed().as_secs_f64(), made)
            };
            let mut runs = [run(), run(), run()];
            runs.sort_by(|a, b| a.0.total_cmp(&b.0));
            let (seconds, made) = &runs[1];
            let [_, tau] = limit(made);
            let [forth, back, rms] = organs::distances(&made.mesh, &truth).map(|x| x / edge);
            let inner =
                [(2, Organ::Ventricles), (3, Organ::Tumour)].into_iter().filter(|(l, _)| labels.contains(l));
            let interfaces: Vec<String> = inner
                .map(|(label, organ)| {
                    format!("{:.3}", organs::interface_rms(&made.mesh, label, organ) / edge)
                })
                .collect();
            let volumes: Vec<String> = (made.report.materials.iter())
                .filter_map(|m| Some(format!("{:+.2}", (m.volume / m.voxel_volume? - 1.0) * 100.0)))
                .collect();
            println!(
                "{name} {:.0} {lattice} | {} | {:.3} {:.3} {tau:.3} | {rms:.4} {forth:.3} {back:.3} | {} | {} | {seconds:.2}",
                edge * 1e3,
                made.report.tets,
                made.report.acoustic_part,
                made.report.raw_acoustic_part,
                interfaces.join(" "),
                volumes.join(" ")
            );
        }
    }
}

/// T5: 0.95 of the critical time step runs 10⁴ steps, 1.1 of it diverges.
#[test]
#[ignore = "slow: 10⁴ steps"]
fn the_critical_step_of_an_organ_is_sharp() {
    let mesh = organ(&organs::liver(), &[1], 0.010, Vector3::zeros()).mesh;
    let held = specimen(mesh).fix("z-min", [true; 3]).falling([1e-3, 2e-3, -3e-3]);
    let limit = held.critical_step();
    let mut steps = 0;
    run::<f64>(&held.model, 0.95 * limit, 1e4 * 0.95 * limit, |_, state| steps = state.steps)
        .unwrap_or_else(|error| panic!("0.95 of the critical time step: {error}"));
    println!("0.95 of the critical time step {:.4} ms: {steps} steps", limit * 1e3);
    assert!(steps >= 10_000);
    let failure = run::<f64>(&held.model, 1.1 * limit, 1e4 * limit, |_, state| steps = state.steps);
    let failure = failure.err().expect("1.1 of the critical time step diverges");
    println!("1.1 of the critical time step fails after {steps} steps: {failure}");
}

/// Meshes the white matter of an average brain, folded as finely as the cells. No two sheets of the boundary
/// meet in a point or an edge.
#[test]
#[ignore = "slow: real organ"]
fn white_matter_has_no_pinch_points() {
    let Some(folder) = std::env::var_os("PLIANT_DATA") else {
        println!("skipped: PLIANT_DATA is not set");
        return;
    };
    let path = std::path::Path::new(&folder).join("brain-mni152/mni_icbm152_wm_2009a_sym.nii.gz");
    let image = read(&path, &ReadOptions::default()).unwrap().threshold(128.0..=f64::INFINITY);
    let made = organ(&image, &[1], 0.004, Vector3::zeros());
    println!("{}", made.report);
    let faces = conforming_boundary(&made.mesh);
    assert!(pinched(&faces).is_empty() && made.report.pinched_points.is_empty());
    assert!(edge_counts(&faces).values().all(|&count| count == 2));
}
