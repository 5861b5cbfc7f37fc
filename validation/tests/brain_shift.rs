//! Brain shift on an ellipsoid (the setting is in `brain_shift` of the library), held to a converged solution of
//! quadratic tets at 52 points inside and, mesh by mesh, to two other codes.

use pliant_geometry::{Locator, Mesh, Vector3, boundary, io};
use pliant_mechanics::model::Averaging;
use pliant_mechanics::tensor::{Vector, dot, sub};
use pliant_validation::brain_shift::{brain, mesh, stuffed, with_regions};
use pliant_validation::{Tets, claim, data_file, largest, numbers, reference, relax};
use serde_json::Value;

const ANP: Tets = Tets::Averaged(Averaging::Nodal);

fn length(v: Vector<f64>) -> f64 {
    dot(v, v).sqrt()
}

fn vectors(value: &Value) -> Vec<Vector<f64>> {
    value.as_array().unwrap().iter().map(|v| numbers(v).try_into().unwrap()).collect()
}

/// The mesh of 734 nodes of the reference.
fn reference_mesh() -> Mesh {
    with_regions(io::read(&data_file("ellipsoid_tet4_h14mm.msh")).unwrap().mesh)
}

/// The largest difference of two fields over the largest vector of the second.
fn off(found: &[Vector<f64>], expected: &[Vector<f64>]) -> f64 {
    let difference = found.iter().zip(expected).map(|(a, b)| length(sub(*a, *b)));
    largest(difference) / largest(expected.iter().map(|&u| length(u)))
}

/// Holds the root mean square and the largest deviation [m] at the 52 points to limits.
fn check_points(name: &str, mesh: Mesh, [rms_limit, largest_limit]: [f64; 2]) {
    let data = reference("ellipsoid.json");
    let brain = brain(mesh, ANP);
    let (_, state) = relax(&brain.model);
    let locator = Locator::new(&brain.mesh);
    let at = |point: Vector<f64>| {
        let location = locator.locate(Vector3::from(point)).unwrap();
        assert_eq!(location.distance, 0.0);
        let nodes = brain.mesh.block(location.kind).unwrap().cell(location.cell as usize);
        let mut u = [0.0; 3];
        for (&node, weight) in nodes.iter().zip(location.weights()) {
            (0..3).for_each(|c| u[c] += weight * state.displacement[node as usize][c]);
        }
        u
    };
    let (points, expected) = (vectors(&data["points"]), vectors(&data["displacement"]));
    assert_eq!((points.len(), expected.len()), (52, 52));
    let off: Vec<f64> = points.iter().zip(&expected).map(|(&point, &u)| length(sub(at(point), u))).collect();
    let rms = (off.iter().map(|d| d * d).sum::<f64>() / off.len() as f64).sqrt();
    println!("{name}: {} nodes", brain.model.node_count());
    claim(&format!("{name}: rms deviation [m]"), rms, rms_limit);
    claim(&format!("{name}: largest deviation [m]"), largest(off), largest_limit);
}

/// 1e-5: the accuracy of the reference, held by two codes.
#[test]
fn plain_tets_shift_as_two_other_codes_say() {
    let brain = brain(reference_mesh(), Tets::Plain);
    let (_, state) = relax(&brain.model);
    claim("T4", off(&state.displacement, &vectors(&reference("ellipsoid.json")["T4"])), 1e-5);
}

/// 1e-4: one prototype, whose force was verified as the gradient of its energy.
#[test]
fn tets_with_average_nodal_pressure_shift_as_the_prototype_says() {
    let brain = brain(reference_mesh(), ANP);
    let (_, state) = relax(&brain.model);
    claim("ANP", off(&state.displacement, &vectors(&reference("ellipsoid.json")["ANP"])), 1e-4);
}

#[test]
fn on_the_mesh_of_the_reference_the_shift_inside_is_right_to_a_quarter_of_a_millimetre() {
    check_points("734 nodes of the reference", reference_mesh(), [0.22e-3, 0.65e-3]);
}

#[test]
fn on_a_stuffed_mesh_the_shift_inside_is_right_to_a_tenth_of_a_millimetre() {
    check_points("stuffed", mesh(), [0.12e-3, 0.35e-3]);
}

#[test]
fn surface_nodes_of_the_stuffed_mesh_lie_on_the_ellipsoid() {
    let mesh = stuffed(0.02);
    let radii = Vector3::new(0.08, 0.065, 0.06);
    for node in boundary(&mesh).nodes() {
        let q = mesh.points[node as usize].component_div(&radii).norm();
        // Bisection finds the surface to 6e-8 of an edge, which is 0.3 of a radius at the most.
        assert!((q - 1.0).abs() < 1e-7, "node {node}: {q}");
    }
}

/// The file holds numbers as 64-bit floats.
#[test]
fn the_mesh_beside_the_scene_is_this_one() {
    let path = std::path::Path::new(env!("CARGO_MANIFEST_DIR")).join("../scenes/brain-shift/ellipsoid.vtu");
    assert_eq!(io::read(&path).unwrap().mesh, mesh());
}
