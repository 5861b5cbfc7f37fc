//! The battery every element runs through: patch test, rigid motion, f = dE/du, Σf = 0, Στ = 0. A new element
//! is one line in [`ELEMENTS`] and its energy in [`energy`].

use pliant_mechanics::element::{Cord, GaussPoints};
use pliant_mechanics::law::plane_stress::InPlane;
use pliant_mechanics::law::samples::{every_law, law};
use pliant_mechanics::law::{AnyLaw, Deformation, NeoHookean, Split, TransverselyIsotropic, Volumetric};
use pliant_mechanics::model::{Averaging, Body, CellBlock, Cells, LocalNodes, Material};
use pliant_mechanics::prony::{Prony, PronyPart, PronyTerm, PronyUpdate};
use pliant_mechanics::tensor::scale as times;
use pliant_mechanics::tensor::{Tensor, cross, dot, scale, sub};
use pliant_testing::Random;
use serde_json::json;

use super::*;
use crate::critical_step;
use crate::lanes::Instructions;
use crate::recover::{CellFields, Recovery};
use crate::{CentralDifference, Observable, State};

/// Every element whose force is the gradient of an energy.
const ELEMENTS: [&str; 6] = ["tet4", "tet4-anp", "tet4-ianp", "hex8", "growing-hex8", "hex8-full"];

/// A vector with each coordinate in [−size, size).
fn vector(random: &mut Random, size: f64) -> Vector<f64> {
    random.vector().map(|x| size * x)
}

const CELLS: u32 = 3;

/// A cube of 3×3×3 cells of edge 0.1, interior nodes moved by up to 12 % of an edge.
pub(crate) fn distorted_cube(element: &str, law: AnyLaw) -> Model {
    filled_cube(element, law, 700.0, 1000.0, |_| 1.0)
}

/// Builds a cube like [`distorted_cube`], with a shear modulus for the hourglass control, a density, and a
/// fraction for each cell.
fn filled_cube(
    element: &str,
    law: AnyLaw,
    shear: f64,
    density: f64,
    fraction: impl FnMut(usize) -> f64,
) -> Model {
    let mut random = Random::new(7);
    let n = CELLS + 1;
    let mut rest = Vec::new();
    for (z, y, x) in (0..n).flat_map(|z| (0..n).flat_map(move |y| (0..n).map(move |x| (z, y, x)))) {
        let interior = [x, y, z].iter().all(|&i| i > 0 && i < CELLS);
        let shift = if interior { vector(&mut random, 0.012) } else { [0.0; 3] };
        rest.push(add([x, y, z].map(|i| f64::from(i) * 0.1), shift));
    }
    let mut hex_nodes = Vec::new();
    for (z, y, x) in (0..CELLS).flat_map(|z| (0..CELLS).flat_map(move |y| (0..CELLS).map(move |x| (z, y, x))))
    {
        let at = |dx: u32, dy: u32, dz: u32| ((z + dz) * n + y + dy) * n + x + dx;
        hex_nodes.push([
            at(0, 0, 0),
            at(1, 0, 0),
            at(1, 1, 0),
            at(0, 1, 0),
            at(0, 0, 1),
            at(1, 0, 1),
            at(1, 1, 1),
            at(0, 1, 1),
        ]);
    }
    // Kuhn's split: all six tets around the diagonal 0–6.
    const KUHN: [[usize; 4]; 6] =
        [[0, 1, 2, 6], [0, 2, 3, 6], [0, 3, 7, 6], [0, 7, 4, 6], [0, 4, 5, 6], [0, 5, 1, 6]];
    let tets = || hex_nodes.iter().flat_map(|hex| KUHN.map(|tet| tet.map(|corner| hex[corner]))).collect();
    let cells = match element {
        "tet4" => Cells::tet4(tets(), &rest),
        "tet4-anp" => Cells::averaged_tet4(tets(), &rest, Averaging::Nodal),
        "tet4-ianp" => Cells::averaged_tet4(tets(), &rest, Averaging::Variational),
        "hex8" => Cells::hex8(hex_nodes.clone(), &rest, 0.2, shear),
        "growing-hex8" => Cells::hex8(hex_nodes.clone(), &rest, 0.2, shear).with_growing_hourglass(),
        "membrane" => {
            // Two sides of each hexahedron.
            const SIDES: [[usize; 3]; 4] = [[0, 1, 2], [0, 2, 3], [0, 1, 5], [0, 5, 4]];
            let triangles: Vec<[u32; 3]> =
                hex_nodes.iter().flat_map(|hex| SIDES.map(|side| side.map(|corner| hex[corner]))).collect();
            let thickness: Vec<f64> =
                (0..triangles.len()).map(|cell| 0.01 + 0.001 * (cell % 7) as f64).collect();
            Cells::membrane(triangles, &rest, &thickness)
        }
        "bar" | "thread" => {
            const SIDES: [[usize; 2]; 4] = [[0, 1], [0, 3], [0, 4], [0, 6]];
            let lines = hex_nodes.iter().flat_map(|hex| SIDES.map(|side| side.map(|corner| hex[corner])));
            let cord = Cord { slack: 1.0, tension_only: element == "thread" };
            Cells::bar(lines.collect(), &rest, 2e-4, cord)
        }
        _ => Cells::full_hex8(hex_nodes.clone(), &rest),
    };
    let scene_word = match element {
        "thread" => "bar",
        "growing-hex8" => "hex8",
        other => other,
    };
    assert_eq!(cells.element(), scene_word);
    let fractions: Vec<f64> = (0..cells.len()).map(fraction).collect();
    let cells = cells.filled(&fractions);
    let mut model = Model { mass: vec![0.0; rest.len()], rest, ..Model::default() };
    model.bodies.push(Body { name: "cube".into(), nodes: 0..n.pow(3), shared: vec![], damping: 0.0 });
    let material = Material { law, prony: Prony::default(), density };
    let count = cells.len();
    let fibre = vec![[0.6, 0.0, 0.8]; count * material.law.families()];
    model.add_solid(Solid { body: 0, material, cells, fibre, original: (0..count as u32).collect() });
    model
}

pub(crate) fn laws() -> [AnyLaw; 2] {
    let (shear, volumetric) = (700.0, Volumetric::quadratic(5000.0));
    [
        AnyLaw::NeoHookean(NeoHookean { shear, volumetric }),
        AnyLaw::TransverselyIsotropic(TransverselyIsotropic { shear, fibre: 1100.0, volumetric }),
    ]
}

fn forces(model: &Model, displacement: &[Vector<f64>]) -> (Vec<Vector<f64>>, f64) {
    let mut internal = InternalForces::new(model, 1.0);
    let hourglass =
        internal.evaluate(displacement, &mut vec![History::default(); model.solids.len()]).hourglass;
    ((0..model.node_count()).map(|node| internal.at(node)).collect(), hourglass)
}

/// A solid whose nodes have moved.
struct MovedSolid<'m> {
    solid: &'m Solid,
    displacement: &'m [Vector<f64>],
}

impl MovedSolid<'_> {
    fn gradient(&self, cell: usize, shape: &[Vector<f64>]) -> Tensor<f64> {
        let mut h = Tensor::ZERO;
        for (&node, &b) in self.solid.cells.nodes(cell).iter().zip(shape) {
            h.add_outer(self.displacement[node as usize], b);
        }
        h
    }

    fn split(&self, h: &Tensor<f64>) -> Split<f64> {
        self.solid.material.law.energy(&Deformation::from_displacement_gradient(h), self.solid.fibres(0))
    }

    /// U(J) from a pure dilation.
    fn dilation(&self, change: f64) -> f64 {
        let stretch = (1.0 + change).cbrt() - 1.0;
        let h = Tensor([[stretch, 0.0, 0.0], [0.0, stretch, 0.0], [0.0, 0.0, stretch]]);
        self.split(&h).volumetric
    }

    fn of_full_hexes(&self, block: &CellBlock<8>, points: &[GaussPoints]) -> f64 {
        let stored = |cell: usize| {
            let (mut shape, mut v) = (0.0, 0.0);
            for (gradients, w) in points[cell].gradient.iter().zip(points[cell].weight) {
                let h = self.gradient(cell, gradients);
                shape += w * self.split(&h).isochoric;
                v += w * volume_change(&h);
            }
            let volume = block.rest[cell].volume;
            shape + volume * self.dilation(v / volume)
        };
        (0..block.nodes.len()).map(stored).sum()
    }

    fn of_averaged_tets(&self, block: &CellBlock<4>, averaging: Averaging) -> f64 {
        let local = LocalNodes::new(block);
        let volume = |cell: usize| block.rest[cell].volume;
        let h: Vec<_> =
            (0..block.nodes.len()).map(|cell| self.gradient(cell, &block.rest[cell].gradient)).collect();
        let shape: f64 = h.iter().enumerate().map(|(cell, h)| volume(cell) * self.split(h).isochoric).sum();
        let nodal = |node: usize| {
            let total: f64 = local.cells_at(node).map(volume).sum();
            let changes = local.cells_at(node).map(|cell| volume(cell) * volume_change(&h[cell]));
            (total, changes.sum::<f64>() / total)
        };
        let averaged: Vec<(f64, f64)> = (0..local.len()).map(nodal).collect();
        let of_cell = |cell: usize| {
            let mean = local.nodes[cell].iter().map(|&n| 0.25 * averaged[n as usize].1).sum();
            volume(cell) * self.dilation(mean)
        };
        shape
            + match averaging {
                Averaging::Nodal => averaged.iter().map(|(v, x)| 0.25 * v * self.dilation(*x)).sum::<f64>(),
                _ => (0..h.len()).map(of_cell).sum(),
            }
    }
}

fn volume_change(h: &Tensor<f64>) -> f64 {
    h.determinant() + h.second_invariant() + h.trace()
}

/// The energy [J] that an element's force is the gradient of.
fn energy(model: &Model, displacement: &[Vector<f64>]) -> f64 {
    let solid = &model.solids[0];
    let law = &solid.material.law;
    let moved = MovedSolid { solid, displacement };
    match &solid.cells {
        Cells::FullHex8(block, points) => moved.of_full_hexes(block, points),
        Cells::AveragedTet4(block, averaging) => moved.of_averaged_tets(block, *averaging),
        Cells::Membrane(block, sheets) => {
            let stored = |cell: usize| {
                let h = moved.gradient(cell, &block.rest[cell].gradient);
                let axes = sheets[cell].axes;
                let plane = InPlane::from_changes(&axes, &axes.map(|axis| h.apply(axis)));
                let fibres = solid.law_fibres(cell);
                block.rest[cell].volume * law.plane_stress(plane.strain_twice, &fibres).energy
            };
            (0..block.nodes.len()).map(stored).sum()
        }
        Cells::Bar(block, cord) => {
            let stored = |cell: usize| {
                let [a, b] = block.nodes[cell].map(|node| displacement[node as usize]);
                let rest = &block.rest[cell];
                cord.energy(rest, &cord.pull(rest, sub(b, a), law.small_strain().young()))
            };
            (0..block.nodes.len()).map(stored).sum()
        }
        cells => {
            let stored = |cell: usize| {
                let h = pliant_mechanics::model::with_cells!(cells, block => moved.gradient(cell, &block.rest[cell].gradient));
                let Split { isochoric, volumetric } = moved.split(&h);
                cells.volume(cell) * (isochoric + volumetric)
            };
            (0..cells.len()).map(stored).sum::<f64>() + forces(model, displacement).1
        }
    }
}

pub(crate) fn every_element() -> impl Iterator<Item = Model> {
    laws().into_iter().flat_map(|law| ELEMENTS.map(|element| distorted_cube(element, law)))
}

/// Builds models of every element, each also with cells of which the body fills a part.
fn every_element_full_or_not() -> impl Iterator<Item = Model> {
    let mut random = Random::new(19);
    let filled = laws().into_iter().flat_map(|law| ELEMENTS.map(|element| (element, law)));
    let incompressible = [None, Some(f64::INFINITY)].map(|bulk| {
        laws().map(|law| match (law, bulk) {
            (AnyLaw::NeoHookean(law), Some(bulk)) => {
                AnyLaw::NeoHookean(NeoHookean { volumetric: Volumetric::quadratic(bulk), ..law })
            }
            (AnyLaw::TransverselyIsotropic(law), Some(bulk)) => {
                AnyLaw::TransverselyIsotropic(TransverselyIsotropic {
                    volumetric: Volumetric::quadratic(bulk),
                    ..law
                })
            }
            (law, _) => law,
        })
    });
    let membranes = incompressible.into_iter().flatten().map(|law| distorted_cube("membrane", law));
    let bars = ["bar", "thread"].map(|element| distorted_cube(element, laws()[0]));
    every_element().chain(membranes).chain(bars).chain(
        filled.map(move |(element, law)| {
            filled_cube(element, law, 700.0, 1000.0, |_| 0.55 + 0.9 * random.half())
        }),
    )
}

fn largest(forces: impl IntoIterator<Item = Vector<f64>>) -> f64 {
    forces.into_iter().flatten().fold(0.0, |a, b| f64::max(a, b.abs()))
}

#[test]
fn patch_test_on_distorted_cells() {
    // A homogeneous deformation must leave every interior node in balance, to round-off.
    let h = Tensor([[0.12, 0.2, -0.05], [0.03, -0.1, 0.1], [-0.08, 0.07, 0.15]]);
    for model in every_element() {
        let displacement: Vec<_> = model.rest.iter().map(|&x| h.apply(x)).collect();
        let (forces, hourglass) = forces(&model, &displacement);
        let scale = largest(forces.iter().copied());
        let interior = |x: &Vector<f64>| x.iter().all(|&c| c > 0.01 && c < 0.29);
        let residual = largest(forces.iter().zip(&model.rest).filter(|(_, x)| interior(x)).map(|(&f, _)| f));
        assert!(residual < 1e-12 * scale, "{}: {residual:e} of {scale:e}", model.solids[0].cells.element());
        assert!(hourglass < 1e-24);
    }
}

/// A flat sheet of crooked triangles, turned in space. A homogeneous deformation leaves inner nodes in
/// balance, and the force on an edge follows from the stress.
#[test]
fn a_membrane_passes_the_patch_test() {
    let mut random = Random::new(47);
    let (t, s) = ([0.6, 0.0, 0.8], [0.0, 1.0, 0.0]);
    let place = |x: f64, y: f64| add(scale(t, x), scale(s, y));
    let mut rest = Vec::new();
    for (j, i) in (0..4).flat_map(|j| (0..4).map(move |i| (j, i))) {
        let inside = (1..3).contains(&i) && (1..3).contains(&j);
        let [a, b, _] = if inside { vector(&mut random, 0.02) } else { [0.0; 3] };
        rest.push(place(0.1 * f64::from(i) + a, 0.1 * f64::from(j) + b));
    }
    let square = |j: u32, i: u32| {
        let at = |i: u32, j: u32| 4 * j + i;
        let [a, b, c, d] = [at(i, j), at(i + 1, j), at(i + 1, j + 1), at(i, j + 1)];
        if (i + j).is_multiple_of(2) { [[a, b, c], [a, c, d]] } else { [[a, b, d], [b, c, d]] }
    };
    let triangles: Vec<[u32; 3]> =
        (0..3).flat_map(|j| (0..3).map(move |i| (j, i))).flat_map(|(j, i)| square(j, i)).collect();
    let h = Tensor([[0.12, 0.2, -0.05], [0.03, -0.1, 0.1], [-0.08, 0.07, 0.15]]);
    for law in laws() {
        let mut model = Model { mass: vec![0.0; 16], rest: rest.clone(), ..Model::default() };
        model.bodies.push(Body { name: "sheet".into(), nodes: 0..16, shared: vec![], damping: 0.0 });
        let cells = Cells::membrane(triangles.clone(), &rest, &[0.01; 18]);
        let fibre = vec![t; 18 * law.families()];
        model.add_solid(Solid { fibre, ..Solid::new(0, Material::elastic(law, 1000.0), cells) });
        let displacement: Vec<_> = rest.iter().map(|&x| h.apply(x)).collect();
        let (forces, _) = forces(&model, &displacement);
        let scale = largest(forces.iter().copied());
        let inner = [5, 6, 9, 10].map(|node| forces[node]);
        assert!(largest(inner) < 1e-13 * scale, "{:e} of {scale:e}", largest(inner));
        // The side x = 0.3 m with normal t: F S t per length times thickness and width.
        let changes = [h.apply(t), h.apply(s)];
        let plane = InPlane::from_changes(&[t, s], &changes);
        let fibres = &[[1.0, 0.0, 0.0]][..law.families()];
        let [xx, _, xy] = law.plane_stress(plane.strain_twice, fibres).stress;
        let pull = add(times(add(t, changes[0]), xx), times(add(s, changes[1]), xy));
        let side = [7, 11].into_iter().fold([0.0; 3], |sum, node| add(sum, forces[node]));
        let apart = sub(side, times(pull, 0.01 * 0.2));
        assert!(largest([apart]) < 1e-12 * scale, "{side:?} {pull:?}");
    }
}

/// A single bar, slack or not, has the critical time step of two masses on a spring of E A/L₀. Its force at
/// the start follows from the slack.
#[test]
fn a_bar_vibrates_as_two_masses_on_a_spring() {
    for slack in [1.0, 0.8, 1.3] {
        for tension_only in [false, true] {
            let mut model = Model::default();
            let rest = [[0.0; 3], [0.12, 0.0, 0.16]];
            let body = model.add_body("ligament", &rest);
            let cells = Cells::bar(vec![[0, 1]], &rest, 3e-6, Cord { slack, tension_only });
            model.add_solid(Solid::new(body, Material::elastic(laws()[0], 1100.0), cells));
            let [mass, stiffness] =
                [1100.0 * 3e-6 * 0.1, laws()[0].small_strain().young() * 3e-6 / (0.2 * slack)];
            let wanted = 2.0 / (2.0 * stiffness / mass).sqrt();
            let found = critical_step::assembled(&model).unwrap().step;
            assert!((found / wanted - 1.0).abs() < 1e-4, "{slack} {tension_only}: {found} for {wanted}");
            let bound = critical_step::element_bound(&model).unwrap().step;
            assert!((bound / wanted - 1.0).abs() < 1e-12, "{bound} for {wanted}");
            let alone = crate::stability::cell_limit(&model, 0, 0, &[[0.0; 3], [0.3, 0.0, 0.4]]);
            assert!(alone <= wanted * (1.0 + 1e-12) && (slack < 1.0 || alone > 0.99 * wanted), "{alone}");
            // Pulled from the start by what it is too short.
            let [force, _] = [0, 1].map(|node| forces(&model, &[[0.0; 3]; 2]).0[node]);
            let strain = (1.0 - slack) / slack;
            let pull = if tension_only && strain < 0.0 { 0.0 } else { stiffness * 0.2 * (1.0 - slack) };
            assert!(largest([sub(force, scale([-0.6, 0.0, -0.8], pull))]) < 1e-12, "{force:?} for {pull}");
        }
    }
}

/// A triangle that is folded onto a line ends a run.
#[test]
fn a_flat_triangle_is_found() {
    let model = distorted_cube("membrane", laws()[0]);
    let cell = 17;
    let [a, b, c] = [0, 1, 2].map(|k| model.solids[0].cells.nodes(cell)[k] as usize);
    let mut displacement = vec![[0.0; 3]; model.node_count()];
    let middle = scale(add(model.rest[a], model.rest[b]), 0.5);
    displacement[c] = sub(middle, model.rest[c]);
    for found in [
        InternalForces::<f64>::new(&model, 1.0).evaluate(&displacement, &mut [History::default()]),
        InternalForces::<f32>::new(&model, 1.0)
            .evaluate(&displacement.iter().map(|&u| cast(u)).collect::<Vec<_>>(), &mut [History::default()]),
    ] {
        let (_, cell, ratio) = found.inverted.unwrap();
        assert!(model.solids[0].cells.nodes(cell).contains(&(c as u32)));
        assert!(ratio.is_nan() || ratio <= 0.0, "{ratio}");
    }
}

#[test]
fn rigid_motion_costs_no_force_and_no_energy() {
    // A turn by 70° about (1, 2, 2)/3 and a shift by 20 edges.
    let (c, s) = (70.0_f64.to_radians().cos(), 70.0_f64.to_radians().sin());
    let k = [1.0 / 3.0, 2.0 / 3.0, 2.0 / 3.0];
    let turn = |x: Vector<f64>| {
        let along = scale(k, dot(k, x) * (1.0 - c));
        add(add(scale(x, c), scale(cross(k, x), s)), along)
    };
    for model in every_element_full_or_not() {
        let displacement: Vec<_> =
            model.rest.iter().map(|&x| add(sub(turn(x), x), [2.0, -1.0, 0.5])).collect();
        // Against the force of 1 % strain on a face of a cell: 50 Pa × 0.01 m².
        assert!(largest(forces(&model, &displacement).0) < 1e-12 * 0.5);
        assert!(energy(&model, &displacement) < 1e-12 * 0.01);
    }
}

#[test]
fn force_is_the_derivative_of_energy() {
    let mut random = Random::new(3);
    for model in every_element_full_or_not() {
        let displacement: Vec<_> = model.rest.iter().map(|_| vector(&mut random, 0.008)).collect();
        let (forces, _) = forces(&model, &displacement);
        let scale = largest(forces.iter().copied());
        for node in [0, 21, 42, 63] {
            for component in 0..3 {
                let shifted = |by: f64| {
                    let mut moved = displacement.clone();
                    moved[node][component] += by;
                    energy(&model, &moved)
                };
                let slope = (shifted(1e-6) - shifted(-1e-6)) / 2e-6;
                assert!((slope - forces[node][component]).abs() < 1e-7 * scale);
            }
        }
    }
}

/// A free cube of tissue that stiffens, thrown into itself. Over 4,000 steps a third of the energy passes
/// through hourglass modes and back, and no energy is made.
#[test]
fn a_growing_hourglass_stiffness_conserves_energy() {
    let law = law("demiray", json!({ "shear-modulus": 700.0, "bulk-modulus": 5e3, "exponent": 8.0 }));
    let mut model = distorted_cube("growing-hex8", law);
    let mut random = Random::new(41);
    model.initial_velocity = model.rest.iter().map(|_| vector(&mut random, 0.5)).collect();
    let step = 0.2 * critical_step::assembled(&model).unwrap().step;
    let mut stepper = CentralDifference::<f64>::new(model.clone(), step).unwrap();
    let mut state = State::at_rest(&model);
    let (mut least, mut most, mut hourglass) = (f64::INFINITY, 0.0_f64, 0.0_f64);
    for _ in 0..4000 {
        stepper.evaluate(&mut state).unwrap();
        let energies = stepper.energies();
        let stored = Recovery::new(&model, &state).stored_energy() + energies.hourglass;
        let total = energies.kinetic + stored;
        (least, most) = (least.min(total), most.max(total));
        hourglass = hourglass.max(energies.hourglass / total);
        stepper.advance(&mut state);
    }
    assert!(hourglass > 0.1, "{hourglass}");
    assert!(most / least - 1.0 < 0.02, "{least} to {most}");
}

/// Checks the written energy density; with the J of the cell instead of the averaged one it was up to 1.88
/// times too large.
#[test]
fn energy_densities_sum_to_the_energy_that_the_forces_come_from() {
    let mut random = Random::new(29);
    for model in every_kernel().chain(every_element_full_or_not()) {
        let mut state = State::<f64>::at_rest(&model);
        state.displacement.iter_mut().for_each(|u| *u = vector(&mut random, 0.01));
        let hourglass = forces(&model, &state.displacement).1;
        let recovery = Recovery::new(&model, &state);
        let (summed, expected) = (recovery.stored_energy() + hourglass, energy(&model, &state.displacement));
        let solid = &model.solids[0];
        let name = format!("{} {}", solid.material.law.name(), solid.cells.element());
        assert!((summed / expected - 1.0).abs() < 1e-12, "{name}: {summed:e} for {expected:e}");
        if matches!(solid.cells, Cells::Bar(..)) {
            continue;
        }
        let recovered: Vec<_> = (0..solid.cells.len()).map(|cell| recovery.cell(0, cell)).collect();
        // Averages and cells change the same volume in all.
        let volume = |of: fn(&CellFields) -> f64| -> f64 {
            recovered.iter().enumerate().map(|(cell, fields)| solid.cells.volume(cell) * of(fields)).sum()
        };
        let [averaged, cells] = [volume(|f| f.volume_ratio), volume(|f| f.cell_volume_ratio)];
        assert!((averaged / cells - 1.0).abs() < 1e-12, "{name}: {averaged:e} m³ for {cells:e} m³");
    }
}

/// Fields of all cells, a pack at a time, equal the fields of single cells to the bit. Their stress follows
/// from the law and its history.
#[test]
fn cells_in_lanes_are_recovered_as_one_by_one() {
    let mut random = Random::new(37);
    for model in every_kernel().chain(every_element_full_or_not()) {
        let mut state = State::<f64>::at_rest(&model);
        state.displacement.iter_mut().for_each(|u| *u = vector(&mut random, 0.01));
        let history = &mut state.history[0];
        for pack in history.cells.iter_mut().chain(&mut history.pressures) {
            pack.0.iter_mut().for_each(|number| *number = 100.0 * random.number());
        }
        let (recovery, solid) = (Recovery::new(&model, &state), &model.solids[0]);
        let name = format!("{} {}", solid.material.law.name(), solid.cells.element());
        let numbers = |fields: &CellFields| {
            let tensors = [fields.green_strain, fields.pk2_stress, fields.cauchy_stress];
            let other = [fields.volume_ratio, fields.cell_volume_ratio, fields.energy_density];
            let components =
                fields.gradient.0.into_iter().flatten().chain(tensors.into_iter().flat_map(|s| s.0));
            components.chain(other).chain(fields.fibre_stretch).collect::<Vec<f64>>()
        };
        let width = numbers(&recovery.cell(0, 0)).len();
        let recovered = recovery.numbers(0, width, |_, fields, to| to.copy_from_slice(&numbers(fields)));
        assert_eq!(recovered.len(), width * solid.cells.len());
        for (cell, found) in recovered.chunks(width).enumerate() {
            let fields = &recovery.cell(0, cell);
            let bits = |numbers: &[f64]| numbers.iter().map(|x| x.to_bits()).collect::<Vec<_>>();
            assert_eq!(bits(found), bits(&numbers(fields)), "{name} {cell}");
            if !matches!(solid.cells, Cells::Tet4(_) | Cells::Hex8(_)) {
                continue;
            }
            let mut h = fields.gradient;
            (0..3).for_each(|i| h.0[i][i] -= 1.0);
            let elastic =
                solid.material.law.stress(&Deformation::from_displacement_gradient(&h), solid.fibres(cell));
            let history: Vec<_> = state.history[0].of_point(solid, cell, 0).collect();
            let expected = solid.material.prony.stress(elastic, &history);
            let size = expected.0.iter().fold(1.0, |most: f64, s| most.max(s.abs()));
            let apart = (fields.pk2_stress + expected * -1.0).0;
            assert!(apart.iter().all(|s| s.abs() < 1e-9 * size), "{name} {cell}: {apart:?} of {size}");
        }
    }
}

#[test]
fn the_pressure_written_is_the_one_of_the_volume_ratio_written() {
    let mut random = Random::new(31);
    for element in ["tet4", "tet4-anp", "hex8", "hex8-full"] {
        let model = distorted_cube(element, laws()[0]);
        let mut state = State::<f64>::at_rest(&model);
        state.displacement.iter_mut().for_each(|u| *u = vector(&mut random, 0.01));
        let recovery = Recovery::new(&model, &state);
        for cell in 0..model.solids[0].cells.len() {
            let fields = recovery.cell(0, cell);
            let expected = -5000.0 * (fields.volume_ratio - 1.0);
            assert!((fields.pressure() - expected).abs() < 1e-9 * 5000.0, "{element} {cell}");
        }
    }
}

#[test]
fn forces_and_torques_sum_to_zero() {
    let mut random = Random::new(5);
    for model in every_element_full_or_not() {
        let displacement: Vec<_> = model.rest.iter().map(|_| vector(&mut random, 0.01)).collect();
        let (forces, _) = forces(&model, &displacement);
        let scale = largest(forces.iter().copied());
        let (mut sum, mut torque) = ([0.0; 3], [0.0; 3]);
        for ((&f, &x), &u) in forces.iter().zip(&model.rest).zip(&displacement) {
            sum = add(sum, f);
            torque = add(torque, cross(add(x, u), f));
        }
        assert!(largest([sum]) < 1e-12 * scale, "{sum:?}");
        assert!(largest([torque]) < 1e-12 * scale, "{torque:?}");
    }
}

#[test]
fn a_lumped_mass_is_the_whole_mass() {
    for model in every_element() {
        let total: f64 = model.mass.iter().sum();
        assert!((total - 1000.0 * 0.027).abs() < 1e-12 * total);
    }
}

#[test]
fn cells_filled_by_half_are_cells_of_half_the_modulus_and_half_the_density() {
    let (shear, volumetric) = (350.0, Volumetric::quadratic(2500.0));
    let soft = [
        AnyLaw::NeoHookean(NeoHookean { shear, volumetric }),
        AnyLaw::TransverselyIsotropic(TransverselyIsotropic { shear, fibre: 550.0, volumetric }),
    ];
    let mut random = Random::new(23);
    for (law, soft) in laws().into_iter().zip(soft) {
        for element in ELEMENTS {
            let half = filled_cube(element, law, 700.0, 1000.0, |_| 0.5);
            let light = filled_cube(element, soft, 350.0, 500.0, |_| 1.0);
            let displacement: Vec<_> = half.rest.iter().map(|_| vector(&mut random, 0.01)).collect();
            // A factor of a power of two commutes with every rounding except in an averaged pressure.
            let of = |model| forces(model, &displacement);
            assert!(apart(&of(&light).0, &of(&half).0) < 1e-14, "{element}");
            assert!((of(&light).1 - of(&half).1).abs() <= 1e-14 * of(&light).1, "{element}");
            assert_eq!(half.mass, light.mass);
            let full = distorted_cube(element, law);
            let bounds = [&half, &full].map(|model| critical_step::element_bound(model).unwrap().step);
            assert!((bounds[0] / bounds[1] - 1.0).abs() < 1e-14, "{element}: {bounds:?}");
            let limits = [&half, &full].map(|model| critical_step::assembled(model).unwrap().step);
            assert!((limits[0] / limits[1] - 1.0).abs() < 1e-6, "{element}: {limits:?}");
        }
    }
}

#[test]
fn single_precision_follows_double() {
    let mut random = Random::new(11);
    for model in every_element_full_or_not() {
        let displacement: Vec<_> = model.rest.iter().map(|_| vector(&mut random, 0.01)).collect();
        let (fine, _) = forces(&model, &displacement);
        let coarse_displacement: Vec<Vector<f32>> = displacement.iter().map(|&u| cast(u)).collect();
        let mut coarse = InternalForces::<f32>::new(&model, 1.0);
        coarse.evaluate(&coarse_displacement, &mut [History::default()]);
        let scale = largest(fine.iter().copied());
        for (node, f) in fine.iter().enumerate() {
            for (a, b) in f.iter().zip(coarse.at(node)) {
                assert!((a - f64::from(b)).abs() < 3e-6 * lost_digits(&model) * scale);
            }
        }
    }
}

#[test]
fn an_inverted_cell_is_found() {
    let model = distorted_cube("tet4", laws()[0]);
    let mut displacement = vec![[0.0; 3]; model.node_count()];
    displacement[21] = [0.3, 0.0, 0.0];
    let inverted =
        InternalForces::new(&model, 1.0).evaluate(&displacement, &mut [History::default()]).inverted;
    let (solid, cell, determinant) = inverted.unwrap();
    assert_eq!(solid, 0);
    assert!(determinant < 0.0);
    assert!(model.solids[0].cells.nodes(cell).contains(&21));
    let Split { isochoric, .. } =
        laws()[0].energy(&Deformation::from_displacement_gradient(&Tensor::ZERO), &[]);
    assert_eq!(isochoric, 0.0);
}

/// Forces on the nodes and how far the cells are deformed, on some processor, after a motion of three steps.
fn moved_on<R: LaneNumber>(processor: Processor, model: &Model) -> (Vec<Vector<f64>>, Deformed) {
    let mut internal = InternalForces::<R>::new(model, 0.1);
    internal.set_processor(processor);
    let mut history = State::<R>::at_rest(model).history;
    let mut random = Random::new(13);
    let mut deformed = Deformed::default();
    for _ in 0..3 {
        let displacement: Vec<Vector<R>> =
            model.rest.iter().map(|_| cast(vector(&mut random, 0.01))).collect();
        deformed = internal.evaluate(&displacement, &mut history).deformed;
    }
    ((0..model.node_count()).map(|node| cast(internal.at(node))).collect(), deformed)
}

fn apart(a: &[Vector<f64>], b: &[Vector<f64>]) -> f64 {
    largest(a.iter().zip(b).map(|(&a, &b)| sub(a, b))) / largest(a.iter().copied())
}

/// Factor on the tolerance of a growing hourglass stiffness. Its differences of stresses, over the cube root
/// of round-off in F, lose a third of the digits of their small part in a force.
fn lost_digits(model: &Model) -> f64 {
    if model.solids[0].hourglass_growth().is_some() { 10.0 } else { 1.0 }
}

/// Builds models of every law and element, without and with history: 162 tets or 27 hexes, so that the last
/// pack is not full.
fn every_kernel() -> impl Iterator<Item = Model> {
    let elements = ["tet4", "tet4-anp", "tet4-ianp", "hex8", "growing-hex8", "hex8-full", "membrane"];
    let models = every_law().into_iter().flat_map(move |law| elements.map(|e| (e, law)));
    let any = ["tet4", "hex8", "growing-hex8", "membrane"];
    models.filter(move |(e, law)| any.contains(e) || law.has_volumetric_energy()).flat_map(
        |(element, law)| {
            let terms = [PronyPart::Isochoric, PronyPart::Volumetric].map(|part| PronyTerm {
                part,
                weight: 0.4,
                time: 0.3,
            });
            [vec![], terms.to_vec()].map(|terms| {
                let mut model = distorted_cube(element, law);
                model.solids[0].material.prony = Prony::new(&terms, PronyUpdate::Exact).unwrap();
                model
            })
        },
    )
}

#[test]
fn lanes_compute_what_plain_numbers_do_for_every_law_and_element() {
    for model in every_kernel() {
        let solid = &model.solids[0];
        let name = format!("{} {}", solid.material.law.name(), solid.cells.element());
        let plain = Processor::Plain;
        let (single, double) = (moved_on::<f32>(plain, &model), moved_on::<f64>(plain, &model));
        let wide = Instructions::ALL.into_iter().filter(|&wide| wide != Instructions::Plain);
        for processor in wide.filter_map(|wide| Processor::with(wide).ok()) {
            let (forces, deformed) = moved_on::<f32>(processor, &model);
            let lost = lost_digits(&model);
            assert!(apart(&single.0, &forces) <= 2e-5 * lost, "{name}: {:e}", apart(&single.0, &forces));
            assert!(!deformed.differs(&single.1, 1.0001), "{name}");
            let (forces, deformed) = moved_on::<f64>(processor, &model);
            assert!(apart(&double.0, &forces) <= 1e-12 * lost, "{name}: {:e}", apart(&double.0, &forces));
            assert!(!deformed.differs(&double.1, 1.0001), "{name}");
        }
        // AVX2 and AVX-512, where this processor has both.
        let fused = [Instructions::Avx512, Instructions::Avx2].map(Processor::with);
        if let [Ok(a), Ok(b)] = fused {
            assert_eq!(moved_on::<f32>(a, &model), moved_on::<f32>(b, &model), "{name}");
            assert_eq!(moved_on::<f64>(a, &model), moved_on::<f64>(b, &model), "{name}");
        }
    }
}

#[test]
fn packs_of_tets_are_their_cells_one_by_one() {
    for law in every_law() {
        let model = distorted_cube("tet4", law);
        let mut random = Random::new(17);
        let displacement: Vec<_> = model.rest.iter().map(|_| vector(&mut random, 0.01)).collect();
        let solid = &model.solids[0];
        let mut expected = vec![[0.0; 3]; model.node_count()];
        for cell in 0..solid.cells.len() {
            let Cells::Tet4(block) = &solid.cells else { unreachable!() };
            let (nodes, rest) = (&block.nodes[cell], &block.rest[cell]);
            let mut h = Tensor::ZERO;
            for (&node, &b) in nodes.iter().zip(&rest.gradient) {
                h.add_outer(displacement[node as usize], b);
            }
            let deformation = Deformation::from_displacement_gradient(&h);
            let Split { isochoric, volumetric } = law.stress(&deformation, solid.fibres(cell));
            let piola = deformation.gradient.times_symmetric(&(isochoric + volumetric));
            for (&node, &b) in nodes.iter().zip(&rest.gradient) {
                let force = &mut expected[node as usize];
                *force = add(*force, scale(piola.apply(b), rest.volume));
            }
        }
        let (forces, _) = forces(&model, &displacement);
        assert!(apart(&expected, &forces) <= 1e-12, "{}: {:e}", law.name(), apart(&expected, &forces));
    }
}

/// The corners of flat hexahedra are judged exactly, whatever the estimate that avoids the check gives, in
/// both precisions and in all lanes.
#[test]
fn a_corner_turned_inside_out_is_found_and_no_other() {
    let mut random = Random::new(41);
    let (law, mut counts) = (laws()[0], [0, 0]);
    for element in ["hex8", "hex8-full"] {
        let model = distorted_cube(element, law);
        let solid = &model.solids[0];
        for round in 0..60 {
            let size = 0.001 * f64::from(round);
            // Squeezed to a tenth of their height.
            let squeezed = |rest: &Vector<f64>| {
                let [x, y, z] = vector(&mut random, size);
                [x, y, 0.1 * z - 0.9 * rest[2]]
            };
            let displacement: Vec<_> = model.rest.iter().map(squeezed).collect();
            let worst = |cell| solid.cells.worst_corner(cell, |node| displacement[node as usize]).unwrap().1;
            let folded: Vec<usize> = (0..solid.cells.len()).filter(|&cell| worst(cell) <= 0.0).collect();
            counts[usize::from(folded.is_empty())] += 1;
            let mut history = vec![History::default()];
            let found = InternalForces::<f64>::new(&model, 1.0).evaluate(&displacement, &mut history).folded;
            assert_eq!(found.map(|(_, cell)| cell), folded.first().copied(), "{element} at {size} m");
            let single: Vec<Vector<f32>> = displacement.iter().map(|&u| cast(u)).collect();
            for instructions in Instructions::ALL {
                let Ok(processor) = Processor::with(instructions) else { continue };
                let mut internal = InternalForces::<f32>::new(&model, 1.0);
                internal.set_processor(processor);
                let found = internal.evaluate(&single, &mut [History::default()]).folded;
                assert_eq!(found.map(|(_, cell)| cell), folded.first().copied(), "{element} {instructions}");
            }
        }
    }
    // Both kinds have come up.
    assert!(counts.iter().all(|&count| count > 20), "{counts:?}");
}

/// κ is a bound: F at a corner differs from the mean by no more than κ |q|.
#[test]
fn corners_follow_the_hourglass_patterns_within_their_reach() {
    let mut random = Random::new(43);
    let model = distorted_cube("hex8", laws()[0]);
    let Cells::Hex8(block) = &model.solids[0].cells else { panic!("hexes") };
    let control = block.hourglass.as_ref().unwrap();
    for cell in 0..block.nodes.len() {
        let x = block.nodes[cell].map(|node| model.rest[node as usize]);
        let mut closest = 0.0_f64;
        for _ in 0..50 {
            let u: Vec<Vector<f64>> = (0..8).map(|_| vector(&mut random, 0.01)).collect();
            let mut mean = nalgebra::Matrix3::<f64>::zeros();
            for (u, b) in u.iter().zip(&block.rest[cell].gradient) {
                mean += nalgebra::Vector3::from(*u) * nalgebra::Vector3::from(*b).transpose();
            }
            // The edges at a corner go where F takes them.
            let at_corner = |corner: usize| {
                let edges = |x: &[Vector<f64>]| {
                    let edge = pliant_mechanics::element::HEX_EDGES[corner]
                        .map(|node| nalgebra::Vector3::from(sub(x[node], x[corner])));
                    nalgebra::Matrix3::from_columns(&edge)
                };
                edges(&u) * edges(&x).try_inverse().unwrap()
            };
            let q: f64 = (control.patterns[cell].iter())
                .map(|pattern| {
                    let sum = pattern.iter().zip(&u).fold([0.0; 3], |sum, (p, &u)| add(sum, scale(u, *p)));
                    dot(sum, sum)
                })
                .sum();
            let reach = (control.corner_reach[cell] * q).sqrt();
            for corner in 0..8 {
                let size = (at_corner(corner) - mean).singular_values().max();
                assert!(size <= reach * (1.0 + 1e-12), "cell {cell}: {size} beyond {reach}");
                closest = closest.max(size / reach);
            }
        }
        assert!(closest > 0.3, "cell {cell}: the bound is far off, {closest}");
    }
}
