//! Frictionless uniaxial stress along x: the lateral stretches are those at which the lateral stress
//! vanishes. Reference: exact homogeneous solutions at forty stretches from 0.6 to 1.4, three tissues.

use pliant_geometry::Mesh;
use pliant_mechanics::law::AnyLaw;
use pliant_mechanics::load::{LoadKind, face_areas};
use pliant_meshing::{Block, DEFAULT_CELL_LIMIT, Resolution, VolumeCell};
use pliant_validation::{
    Specimen, claim, deformation, elastic, largest, law, numbers, reference, settle, smooth_step,
};
use serde_json::{Value, json};

/// Edge of the blocks [m].
const EDGE: f64 = 0.1;

/// One tissue and its table.
struct Tissue {
    name: String,
    law: AnyLaw,
    fibre: [f64; 3],
    /// Rows of (stretch x, y, z, nominal stress [Pa], Cauchy stress [Pa]).
    table: Vec<[f64; 5]>,
}

fn tissues() -> Vec<Tissue> {
    let data = reference("homogeneous_uniaxial.json");
    let tissue = |(name, case): (&String, &Value)| {
        let mut parameters = json!({ "shear-modulus": case["mu"], "bulk-modulus": case["kappa"] });
        let isotropic = case["eta_energy"] == 0.0;
        if !isotropic {
            parameters["fibre-modulus"] = case["eta_energy"].clone();
        }
        let rows = case["table"].as_array().unwrap();
        Tissue {
            name: name.clone(),
            law: law(if isotropic { "neo-hookean" } else { "transversely-isotropic" }, parameters),
            fibre: numbers(&case["a0"]).try_into().unwrap(),
            table: rows.iter().map(|row| numbers(row).try_into().unwrap()).collect(),
        }
    };
    let tissues: Vec<Tissue> = data["cases"].as_object().unwrap().iter().map(tissue).collect();
    assert_eq!(tissues.len(), 3);
    tissues
}

/// Normal components of S [Pa] of a block stretched along its axes.
fn normal_stress(tissue: &Tissue, stretch: [f64; 3]) -> [f64; 3] {
    let [x, y, z] = stretch;
    let state = deformation([[x, 0.0, 0.0], [0.0, y, 0.0], [0.0, 0.0, z]]);
    let stress = tissue.law.stress(&state, &[tissue.fibre][..tissue.law.families()]);
    let [xx, yy, zz, ..] = (stress.isochoric + stress.volumetric).0;
    [xx, yy, zz]
}

/// The stretches (x, y, z) without lateral stress, by Newton's method with the Jacobian from finite
/// differences.
fn free_to_widen(tissue: &Tissue, along: f64) -> [f64; 3] {
    let [mut y, mut z] = [along.sqrt().recip(); 2];
    for _ in 0..50 {
        let [_, sy, sz] = normal_stress(tissue, [along, y, z]);
        let h = 1e-7;
        let slope = |stretch| normal_stress(tissue, stretch);
        let (above, below) = (slope([along, y + h, z]), slope([along, y - h, z]));
        let [_, syy, szy] = [0, 1, 2].map(|c| (above[c] - below[c]) / (2.0 * h));
        let (above, below) = (slope([along, y, z + h]), slope([along, y, z - h]));
        let [_, syz, szz] = [0, 1, 2].map(|c| (above[c] - below[c]) / (2.0 * h));
        let determinant = syy * szz - syz * szy;
        y -= (szz * sy - syz * sz) / determinant;
        z -= (syy * sz - szy * sy) / determinant;
    }
    [along, y, z]
}

#[test]
fn lateral_stretches_and_stresses_of_the_laws_meet_the_exact_solution() {
    for tissue in tissues() {
        let deviation = |row: &[f64; 5]| {
            let [x, y, z] = free_to_widen(&tissue, row[0]);
            let nominal = x * normal_stress(&tissue, [x, y, z])[0];
            largest(
                [y / row[1], z / row[2], nominal / row[3], nominal / (y * z) / row[4]]
                    .map(|r| (r - 1.0).abs()),
            )
        };
        // 1e-6: the table is exact and printed to double; both sides lose some digits where J − 1 is small.
        claim(
            &format!("{}: stretches and stresses", tissue.name),
            largest(tissue.table.iter().map(deviation)),
            1e-6,
        );
    }
}

/// A block of 2 × 2 × 2 (× 6) cells with its inner node out of place: no cell is regular.
fn distorted_block(cells: VolumeCell) -> Mesh {
    let mut mesh = Block::new([EDGE; 3]).mesh(Resolution::Counts([2; 3]), cells, DEFAULT_CELL_LIMIT).unwrap();
    mesh.points[13] += EDGE * pliant_geometry::Vector3::new(0.08, -0.06, 0.1);
    mesh
}

/// Makes a block on rollers, free to widen. Damping is near critical for the slowest vibration, a shear wave
/// between a held and a free face: ω = π/2 √(μ/ρ)/L.
fn specimen(tissue: &Tissue, cells: VolumeCell) -> Specimen {
    let slowest = std::f64::consts::FRAC_PI_2 * (tissue.law.small_strain().shear / 1000.0).sqrt() / EDGE;
    let material = elastic(tissue.law);
    Specimen::new(distorted_block(cells), &material, tissue.fibre).on_rollers().damped(2.0 * slowest)
}

/// A step far below the bound at rest, since cells shrunken by a strong compression have smaller limits.
fn careful_step(specimen: &Specimen) -> f64 {
    0.3 * specimen.element_bound()
}

const ELEMENTS: [VolumeCell; 2] = [VolumeCell::Tet, VolumeCell::Hex];

#[test]
fn moved_block_on_rollers_widens_and_reacts_as_the_exact_solution() {
    for tissue in tissues() {
        for (cells, row) in ELEMENTS.iter().flat_map(|e| [(*e, tissue.table[0]), (*e, tissue.table[39])]) {
            let specimen = specimen(&tissue, cells).shift("x-max", (row[0] - 1.0) * EDGE, smooth_step(0.5));
            let rest = settle(&specimen.model, careful_step(&specimen), 4.0);
            let u = rest.displacement[specimen.node_at([EDGE; 3])];
            let reaction = rest.reaction("move x-max")[0];
            let measured = [1.0 + u[1] / EDGE, 1.0 + u[2] / EDGE, reaction / (EDGE * EDGE)];
            let deviation = largest(measured.iter().zip(&row[1..4]).map(|(a, b)| (a / b - 1.0).abs()));
            // 1e-6 as for the law: linear elements carry a homogeneous state exactly, on any mesh.
            claim(&format!("{} {cells:?} stretched to {}", tissue.name, row[0]), deviation, 1e-6);
        }
    }
}

#[test]
fn dead_traction_of_the_nominal_stress_stretches_the_block_as_the_exact_solution() {
    for tissue in tissues() {
        // Stretches 0.9 and 1.4: under a stronger dead load in compression the block buckles, since its top
        // is free to tilt.
        for (cells, row) in ELEMENTS.iter().flat_map(|e| [(*e, tissue.table[15]), (*e, tissue.table[39])]) {
            let specimen = specimen(&tissue, cells);
            let forces = traction(&specimen, "x-max", row[3]);
            let total: f64 = forces.iter().map(|(_, f)| f[0]).sum();
            claim(
                "resultant of the traction over P₁₁ A, off by",
                (total / (row[3] * EDGE * EDGE) - 1.0).abs(),
                1e-14,
            );
            let specimen = specimen.loaded(LoadKind::Forces(forces), smooth_step(0.5));
            let rest = settle(&specimen.model, careful_step(&specimen), 4.0);
            let u = rest.displacement[specimen.node_at([EDGE; 3])];
            let deviation = largest((0..3).map(|c| ((1.0 + u[c] / EDGE) / row[c] - 1.0).abs()));
            claim(&format!("{} {cells:?} loaded to {}", tissue.name, row[0]), deviation, 1e-6);
        }
    }
}

/// The nodal forces of a traction [Pa] along x on a face.
fn traction(specimen: &Specimen, face: &str, along_x: f64) -> Vec<(u32, [f64; 3])> {
    let on_face = specimen.face(face);
    let faces = specimen
        .surface()
        .into_iter()
        .filter(|f| f.iter().all(|node| on_face.contains(node) || *node == pliant_mechanics::load::NO_NODE));
    faces
        .flat_map(|face| face_areas(&face, |node| specimen.model.rest[node as usize]).collect::<Vec<_>>())
        .map(|(node, area)| (node, [area[0] * along_x, 0.0, 0.0]))
        .collect()
}
