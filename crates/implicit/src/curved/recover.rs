//! Fields of the cells at a state, recovered from displacements and rotations as symmetric tensors in space.
//!
//! Shells: membrane forces and bending moments are means over the facet. With uniform strains and curvatures
//! they do the same work as its nodal forces. The forces are n = t Dm Lᵀd/(t A) of the ANDES membrane
//! (Felippa 2003, CMAME 192:2125), whose strain has a part from drilling. The moments are m = t³/12 Dm κ with
//! the mean curvature of the discrete Kirchhoff triangle (Batoz, Bathe, Ho 1980). Stress at a height z along
//! the facet's normal is σ(z) = n/t + 12 z m/t³ (Timoshenko and Woinowsky-Krieger 1959). In layers it is Q
//! (ε + z κ) with ε and κ of n and m. Fields of solids come from `pliant-explicit`. Leaves out: shear across
//! the thickness, variation within a facet, averages at nodes.

use nalgebra::{Matrix3, Vector3};
use pliant_shells::ShellStrain;
use pliant_shells::{Broken, Facet, Resultants, ShellEnergy};
use rayon::prelude::*;

use crate::model::assembly::Assembly;
use crate::model::error::SolveError;
use crate::model::state::AssemblyState;

impl AssemblyState {
    /// Displacement of a node [m].
    pub fn displacement(&self, model: &Assembly, node: usize) -> Vector3<f64> {
        self.position[node] - model.place(node)
    }

    /// The current direction of a nodal normal.
    pub fn normal(&self, model: &Assembly, number: usize) -> Vector3<f64> {
        let normal = model.normals[number];
        self.rotation[normal.node as usize] * normal.direction
    }

    /// Energy of all facets [J].
    ///
    /// # Errors
    /// If a facet is collapsed or folded over.
    pub fn shell_energy(&self, model: &Assembly) -> Result<ShellEnergy, Broken> {
        let mut sum = ShellEnergy::default();
        for facet in &model.facets {
            let (x, rotation) = self.corners(facet.nodes);
            let part = facet.energy(&facet.place(&x, &rotation)?);
            sum.membrane += part.membrane;
            sum.bending += part.bending;
            sum.drilling += part.drilling;
        }
        Ok(sum)
    }

    /// Forces and moments per length in a facet.
    ///
    /// # Errors
    /// If the facet is collapsed or folded over.
    pub fn resultants(&self, model: &Assembly, facet: usize) -> Result<Resultants, Broken> {
        let facet = &model.facets[facet];
        let (x, rotation) = self.corners(facet.nodes);
        Ok(facet.resultants(&facet.place(&x, &rotation)?))
    }

    /// The strains of all facets, side by side; none of one that is collapsed or folded over.
    pub fn shell_strains(&self, model: &Assembly) -> Vec<ShellStrain> {
        let strain = |facet: &Facet| {
            let (x, rotation) = self.corners(facet.nodes);
            facet.place(&x, &rotation).map(|placed| facet.strain(&placed)).unwrap_or_default()
        };
        model.facets.par_iter().with_min_len(64).map(strain).collect()
    }
}

/// Fields of all facets, one entry a facet. Its arrays are made at the first use and kept.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct ShellFields {
    /// Membrane forces [N/m]: tensors in the plane of the facet, in space.
    pub membrane: Vec<Matrix3<f64>>,
    /// Bending moments [N], positive where the top is in tension.
    pub moment: Vec<Matrix3<f64>>,
    /// Stress [Pa] at the top (half the thickness along the facet's normal), in the middle and at the bottom.
    pub stress: [Vec<Matrix3<f64>>; 3],
    /// Von Mises stress [Pa] there.
    pub von_mises: [Vec<f64>; 3],
    /// The largest of the three [Pa]; in a wall of layers of both faces of each.
    pub largest: Vec<f64>,
    /// Strain energy over the area at rest [J/m²] in its parts.
    pub energy: Vec<ShellEnergy>,
    /// Thickness [m] with the strain across that plane stress asks for; forces do not feel it.
    pub thickness: Vec<f64>,
    /// Strain of each facet.
    pub strain: Vec<ShellStrain>,
}

impl ShellFields {
    /// Fills the arrays for a state, facets side by side.
    ///
    /// # Errors
    /// If a facet is collapsed or folded over: the first one. The arrays then are partly of before.
    pub fn fill(&mut self, model: &Assembly, state: &AssemblyState) -> Result<(), SolveError> {
        let count = model.facets.len();
        for tensors in [&mut self.membrane, &mut self.moment].into_iter().chain(&mut self.stress) {
            tensors.resize(count, Matrix3::zeros());
        }
        for numbers in self.von_mises.iter_mut().chain([&mut self.largest, &mut self.thickness]) {
            numbers.resize(count, 0.0);
        }
        self.energy.resize(count, ShellEnergy::default());
        self.strain.resize(count, ShellStrain::default());
        let [top, middle, bottom] = &mut self.stress;
        let [top_mises, middle_mises, bottom_mises] = &mut self.von_mises;
        let broken = (
            &model.facets,
            (&mut self.membrane, &mut self.moment, &mut self.largest, &mut self.energy),
            (&mut self.thickness, &mut self.strain),
            (top, middle, bottom),
            (top_mises, middle_mises, bottom_mises),
        )
            .into_par_iter()
            .with_min_len(64)
            .enumerate()
            .find_map_first(|(cell, (facet, section, wall, stress, mises))| {
                let (x, rotation) = state.corners(facet.nodes);
                let placed = match facet.place(&x, &rotation) {
                    Ok(placed) => placed,
                    Err(why) => return Some(SolveError::Broken { cell, why }),
                };
                let (resultants, energy) = (facet.resultants(&placed), facet.energy(&placed));
                let in_space = |tensor: &Vector3<f64>| resultants.in_space(tensor);
                let (stresses, largest) = facet.stresses(&resultants);
                let stresses = stresses.map(|stress| in_space(&stress));
                let each = stresses.map(|stress| von_mises(&stress));
                *section.0 = in_space(&resultants.membrane);
                *section.1 = in_space(&resultants.moment);
                *section.2 = largest;
                *section.3 = ShellEnergy {
                    membrane: energy.membrane / facet.area,
                    bending: energy.bending / facet.area,
                    drilling: energy.drilling / facet.area,
                };
                (*wall.0, *wall.1) = (facet.thickness_now(&placed), facet.strain(&placed));
                [*stress.0, *stress.1, *stress.2] = stresses;
                [*mises.0, *mises.1, *mises.2] = each;
                None
            });
        broken.map_or(Ok(()), Err)
    }
}

/// Von Mises stress √(3/2 s:s) with s the deviator (von Mises 1913): of plane stress √(σx² − σx σy + σy² + 3
/// τ²).
pub fn von_mises(stress: &Matrix3<f64>) -> f64 {
    let deviator = stress - Matrix3::from_diagonal_element(stress.trace() / 3.0);
    (1.5 * deviator.norm_squared()).sqrt()
}

#[cfg(test)]
mod tests {
    use std::f64::consts::TAU;

    use pliant_mechanics::curve::{Curve, Shape};

    use super::*;
    use crate::tests::{FLAT, MATERIAL, balloon, model, strip};
    use crate::{Shell, StaticSettings, Statics};
    use pliant_mechanics::load::{Load, LoadKind, Spread};
    use pliant_mechanics::model::{Constraint, Motion};
    use pliant_shells::element::Formulation;
    use pliant_shells::rotation::exponential;

    const YOUNG: f64 = MATERIAL.elastic.young;
    const POISSON: f64 = MATERIAL.elastic.poisson;

    /// Returns a copy of a state with positions and rotations turned by a radian about a skew axis.
    fn turned(state: &AssemblyState) -> (AssemblyState, Matrix3<f64>) {
        let turn = exponential(&Vector3::new(1.0, -2.0, 0.5).normalize());
        let mut state = state.clone();
        state.position.iter_mut().for_each(|x| *x = turn * *x);
        state.rotation.iter_mut().for_each(|r| *r = turn * *r);
        (state, *turn.to_rotation_matrix().matrix())
    }

    /// A plate bent to w = ½ k x²: mxx = −D k, myy = ν mxx, energy ½ D k²; the top in compression. Small, so
    /// that linear theory is right to 1e-6; turned by a radian, so are its tensors.
    #[test]
    fn a_plate_under_a_uniform_moment() {
        let model = model(strip(), 0.1);
        let k = 1e-7;
        let mut state = AssemblyState::at_rest(&model);
        for ((x, r), rest) in state.position.iter_mut().zip(&mut state.rotation).zip(model.places()) {
            x.z = 0.5 * k * rest.x * rest.x;
            *r = exponential(&Vector3::new(0.0, -k * rest.x, 0.0));
        }
        let (state, turn) = turned(&state);
        let mut fields = ShellFields::default();
        fields.fill(&model, &state).unwrap();
        let rigidity = YOUNG * 1e-3 / (12.0 * (1.0 - POISSON * POISSON));
        let moment = Matrix3::from_diagonal(&Vector3::new(-rigidity * k, -POISSON * rigidity * k, 0.0));
        let top = moment * (6.0 / 0.01);
        let mises = rigidity * k * 600.0 * (1.0 - POISSON + POISSON * POISSON).sqrt();
        for cell in 0..model.facets.len() {
            let back = |tensor: &Matrix3<f64>| turn.transpose() * tensor * turn;
            assert!((back(&fields.moment[cell]) - moment).norm() < 1e-3 * moment.norm());
            assert!((back(&fields.stress[0][cell]) - top).norm() < 1e-3 * top.norm());
            assert!((back(&fields.stress[2][cell]) + top).norm() < 1e-3 * top.norm());
            assert!(fields.stress[1][cell].norm() < 1e-3 * top.norm());
            assert!((fields.largest[cell] / mises - 1.0).abs() < 1e-3, "{}", fields.largest[cell]);
            let energy = fields.energy[cell];
            assert!((energy.bending / (0.5 * rigidity * k * k) - 1.0).abs() < 1e-3, "{energy:?}");
        }
    }

    /// A strip stretched by 1 % and turned by a radian: n = E t ε in its direction alone, energy ½ E t ε²,
    /// exactly.
    #[test]
    fn a_strip_in_tension_turned_by_a_radian() {
        let model = model(strip(), 0.1);
        let strain = 0.01;
        let mut state = AssemblyState::at_rest(&model);
        for x in &mut state.position {
            *x = Vector3::new(x.x * (1.0 + strain), x.y * (1.0 - POISSON * strain), 0.0);
        }
        let (state, turn) = turned(&state);
        let mut fields = ShellFields::default();
        fields.fill(&model, &state).unwrap();
        let along = turn.column(0) * turn.column(0).transpose();
        for cell in 0..model.facets.len() {
            let force = along * (YOUNG * 0.1 * strain);
            assert!((fields.membrane[cell] - force).norm() < 1e-9 * force.norm());
            for layer in 0..3 {
                let stress = YOUNG * strain;
                assert!((fields.stress[layer][cell] - along * stress).norm() < 1e-9 * stress);
                assert!((fields.von_mises[layer][cell] / stress - 1.0).abs() < 1e-9);
            }
            let energy = fields.energy[cell].membrane;
            assert!((energy / (0.5 * YOUNG * 0.1 * strain * strain) - 1.0).abs() < 1e-9, "{energy}");
        }
    }

    /// A ball under pressure: n = p R/2 in every direction. Its mean is right to 1 % with 512 facets; facets
    /// that are unequal scatter, four times less with edges of half the length.
    #[test]
    fn membrane_forces_of_a_ball_under_pressure() {
        let pressure = 10.0;
        let scatter = [2, 3].map(|cuts| {
            let mut model = balloon(cuts, pressure);
            model.model_mut().loads[0].controlled = false;
            let mut state = AssemblyState::at_rest(&model);
            Statics::new(model.clone(), StaticSettings::default()).unwrap().solve(&mut state, 1.0).unwrap();
            let mut fields = ShellFields::default();
            fields.fill(&model, &state).unwrap();
            let count = model.facets.len() as f64;
            let ratios: Vec<f64> = fields.membrane.iter().map(|n| n.trace() / pressure).collect();
            let mean = ratios.iter().sum::<f64>() / count;
            let scatter = (ratios.iter().map(|n| (n - 1.0).powi(2)).sum::<f64>() / count).sqrt();
            println!("ball of {count} facets: n over p R/2, mean {mean:.4}, scatter {scatter:.3}");
            assert!((mean - 1.0).abs() < if cuts == 3 { 0.01 } else { 0.04 });
            let work: f64 = fields.energy.iter().zip(&model.facets).map(|(e, f)| e.membrane * f.area).sum();
            assert!((work / state.shell_energy(&model).unwrap().membrane - 1.0).abs() < 1e-12);
            scatter
        });
        assert!(scatter[1] < scatter[0] / 3.0, "{scatter:?}");
    }

    /// A closed cylinder (its ends are pulled with p R/2): hoop p R, along p R/2. With 48 facets round, 0.5
    /// %.
    #[test]
    fn membrane_forces_of_a_cylinder_under_pressure() {
        cylinder_under_pressure(FLAT, Spread::Lumped, [0.02, 0.002]);
        cylinder_under_pressure(Formulation::default(), Spread::Curved, [0.01, 0.003]);
    }

    fn cylinder_under_pressure(formulation: Formulation, spread: Spread, limits: [f64; 2]) {
        let (round, long, pressure) = (48_u32, 6_u32, 10.0);
        let node = |i: u32, j: u32| i % round + round * j;
        let points = (0..round * (long + 1)).map(|n| {
            let angle = TAU * f64::from(n % round) / f64::from(round);
            Vector3::new(angle.cos(), angle.sin(), 0.13 * f64::from(n / round))
        });
        let cells = (0..round * long).flat_map(|c| {
            let (i, j) = (c % round, c / round);
            [
                [node(i, j), node(i + 1, j), node(i + 1, j + 1)],
                [node(i, j), node(i + 1, j + 1), node(i, j + 1)],
            ]
        });
        let mut model = Assembly::new("shell", points);
        let shell = Shell { formulation, ..Shell::new("cylinder", cells.collect(), 0.02, MATERIAL) };
        model.add_shell(&shell).unwrap();
        let mut prescribe = |nodes: Vec<u32>, components| {
            let motion = Motion::Fixed;
            model.model_mut().constraints.push(Constraint { name: "held".into(), nodes, components, motion });
        };
        prescribe((0..round).collect(), [false, false, true, false, false, false]);
        prescribe(vec![0, round / 2], [false, true, false, false, false, false]);
        prescribe(vec![round / 4], [true, false, false, false, false, false]);
        let curve = Curve { shape: Shape::Hold, from: 0.0, to: 1.0 };
        let edges: Vec<_> = (0..round).map(|i| [node(i, long), node(i + 1, long)]).collect();
        let cells = (0..model.facets.len() as u32).collect();
        for kind in [
            LoadKind::ShellPressure { facets: cells, pressure, spread },
            model.edge_load(&edges, Vector3::new(0.0, 0.0, 0.5 * pressure)),
        ] {
            model.model_mut().loads.push(Load::new("load", kind, curve.clone()));
        }
        let mut state = AssemblyState::at_rest(&model);
        Statics::new(model.clone(), StaticSettings::default()).unwrap().solve(&mut state, 1.0).unwrap();
        let mut fields = ShellFields::default();
        fields.fill(&model, &state).unwrap();
        let ratios = model.facets.iter().zip(&fields.membrane).map(|(facet, n)| {
            let centre: Vector3<f64> = facet.nodes.iter().map(|&n| state.position[n as usize]).sum();
            let around = Vector3::new(-centre.y, centre.x, 0.0).normalize();
            [around.dot(&(n * around)) / pressure, n[(2, 2)] / (0.5 * pressure)]
        });
        let ratios: Vec<[f64; 2]> = ratios.collect();
        for (direction, middle) in limits.into_iter().enumerate() {
            let mean = ratios.iter().map(|n| n[direction]).sum::<f64>() / ratios.len() as f64;
            let off =
                |cells: &[[f64; 2]]| cells.iter().map(|n| (n[direction] - 1.0).abs()).fold(0.0, f64::max);
            // Two of six rings are away from the ends.
            let (whole, inner) = (off(&ratios), off(&ratios[192..384]));
            println!("cylinder: mean {mean:.4}, off by {inner:.4}, at the ends {whole:.4}");
            assert!((mean - 1.0).abs() < 0.003 && inner < middle, "{mean} {inner}");
        }
    }

    /// A collapsed facet is reported with its number, the same one for any number of threads.
    #[test]
    fn the_first_broken_cell_is_told() {
        let model = model(strip(), 0.1);
        let mut state = AssemblyState::at_rest(&model);
        for facet in &model.facets[17..] {
            facet.nodes.iter().for_each(|&node| state.position[node as usize] = Vector3::zeros());
        }
        let error = ShellFields::default().fill(&model, &state).unwrap_err();
        let first = (0..32).find(|&cell| state.resultants(&model, cell).is_err()).unwrap();
        assert!(matches!(error, SolveError::Broken { cell, .. } if cell == first), "{error}");
    }
}
