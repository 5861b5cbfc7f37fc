//! Quasi-static equilibria by dynamic relaxation, held to other codes on the same meshes.

use pliant_geometry::io;
use pliant_mechanics::law::AnyLaw;
use pliant_mechanics::tensor::{dot, sub};
use pliant_mechanics::{DynamicRelaxation, RelaxationSettings, State};
use pliant_validation::{
    Specimen, claim, data_file, elastic, largest, liver, numbers, reference, smooth_step, soft_tissue,
};

/// The cube of 476 nodes at 30 %, against nodal displacements from two codes that agree to 5e-8.
fn compressed_tets_match(solution: &str, law: AnyLaw) {
    let mesh = io::read(&data_file("cube_tet4.msh")).unwrap().mesh;
    let cube = Specimen::new(mesh, &elastic(law), [0.0, 1.0, 0.0])
        .shift("x-max", -0.03, smooth_step(1.0))
        .fix("x-max", [false, true, true])
        .fix("x-min", [true; 3]);
    let settings = RelaxationSettings { tolerance: 1e-8, ..RelaxationSettings::default() };
    let mut solver = DynamicRelaxation::new(&cube.model, settings).unwrap();
    let mut state = State::<f64>::at_rest(&cube.model);
    let convergence = solver.solve(&mut state, 1.0).unwrap();
    println!("{solution}: {convergence:?}, {:?}", solver.energies());
    let expected = &reference("cube_tet4_solutions.json")[solution];
    let displacement: Vec<[f64; 3]> =
        expected["displacement"].as_array().unwrap().iter().map(|u| numbers(u).try_into().unwrap()).collect();
    let length = |v: [f64; 3]| dot(v, v).sqrt();
    let scale = largest(displacement.iter().map(|&u| length(u)));
    let off = largest(state.displacement.iter().zip(&displacement).map(|(&u, &v)| length(sub(u, v))));
    claim(&format!("{solution}: displacements over the largest"), off / scale, 1e-5);
    let reaction = solver.reaction(cube.constraint("fix x-min"));
    let expected: [f64; 3] = numbers(&expected["reaction"]).try_into().unwrap();
    claim(&format!("{solution}: reaction"), length(sub(reaction, expected)) / length(expected), 1e-5);
}

#[test]
fn neo_hookean_tets_at_30_percent_stand_where_two_other_codes_put_them() {
    compressed_tets_match("NH_T4", soft_tissue());
}

#[test]
fn liver_tets_with_fibres_across_at_30_percent_stand_where_two_other_codes_put_them() {
    compressed_tets_match("TIy_T4", liver());
}
