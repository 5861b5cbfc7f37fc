//! The battery of solids: every element with laws of every kind.

use nalgebra::Vector3;
use pliant_linear::LinearSolver;
use pliant_mechanics::curve::{Curve, Shape};
use pliant_mechanics::element::Cord;
use pliant_mechanics::law::{AnyLaw, samples};
use pliant_mechanics::load::{Load, LoadKind, NO_NODE};
use pliant_mechanics::mapping::Weights;
use pliant_mechanics::model::{Averaging, Cells, Constraint, Material, Motion, Solid, Surface};
use pliant_mechanics::prony::{Prony, PronyPart, PronyTerm, PronyUpdate};
use pliant_testing::Random;
use serde_json::json;

use crate::system::System;
use crate::tests::bar;
use crate::{Assembly, AssemblyState, BackwardEuler, DynamicSettings, ModelError, StaticSettings, Statics};

const ELEMENTS: [&str; 5] = ["tet4", "tet4-anp", "hex8", "growing-hex8", "hex8-full"];

fn law(name: &str) -> AnyLaw {
    let parameters = match name {
        "st-venant-kirchhoff" | "corotational" => json!({ "young-modulus": 1e4, "poisson-ratio": 0.3 }),
        "transversely-isotropic" => {
            json!({ "young-modulus": 1e4, "poisson-ratio": 0.45, "fibre-modulus": 5e3 })
        }
        "ogden" => {
            json!({ "terms": [samples::term(2e3, 2.5), samples::term(1e3, -3.0)], "poisson-ratio": 0.4 })
        }
        _ => json!({ "young-modulus": 1e4, "poisson-ratio": 0.45 }),
    };
    samples::law(name, parameters)
}

/// The nodes of the hexahedra of a bar, in the order of its points.
fn hexes([nx, ny, nz]: [usize; 3]) -> Vec<[u32; 8]> {
    let number = |i: usize, j: usize, k: usize| (i + (nx + 1) * (j + (ny + 1) * k)) as u32;
    let cell = |cell: usize| {
        let [i, j, k] = [cell % nx, cell / nx % ny, cell / nx / ny];
        [[0, 0, 0], [1, 0, 0], [1, 1, 0], [0, 1, 0], [0, 0, 1], [1, 0, 1], [1, 1, 1], [0, 1, 1]]
            .map(|[x, y, z]| number(i + x, j + y, k + z))
    };
    (0..nx * ny * nz).map(cell).collect()
}

/// A block of counts of cells with sides [m], its inner geometry a little irregular.
fn block(element: &str, law: AnyLaw, counts: [usize; 3], sides: [f64; 3]) -> Assembly {
    let (mut points, tets) = bar(counts, sides);
    let mut random = Random::new(7);
    for point in &mut points {
        *point += Vector3::from(random.vector()) * 0.05 * sides[0] / counts[0] as f64;
    }
    let rest: Vec<[f64; 3]> = points.iter().map(|&x| x.into()).collect();
    let cells = match element {
        "tet4" => Cells::tet4(tets, &rest),
        "tet4-anp" => Cells::averaged_tet4(tets, &rest, Averaging::Nodal),
        "hex8" => Cells::hex8(hexes(counts), &rest, 0.2, law.small_strain().shear),
        "growing-hex8" => {
            Cells::hex8(hexes(counts), &rest, 0.2, law.small_strain().shear).with_growing_hourglass()
        }
        "membrane" => {
            let sides: Vec<[u32; 3]> = tets.iter().map(|&[a, b, c, _]| [a, b, c]).collect();
            let thickness: Vec<f64> = (0..sides.len()).map(|cell| 0.01 + 0.001 * (cell % 7) as f64).collect();
            Cells::membrane(sides, &rest, &thickness)
        }
        "bar" | "thread" => {
            let lines = tets.iter().flat_map(|&[a, b, c, d]| [[a, b], [c, d]]).collect();
            Cells::bar(lines, &rest, 2e-4, Cord { slack: 0.95, tension_only: element == "thread" })
        }
        _ => Cells::full_hex8(hexes(counts), &rest),
    };
    let fibre = vec![[0.6, 0.0, 0.8]; law.families() * cells.len()];
    let solid = Solid { fibre, ..Solid::new(0, Material::elastic(law, 1000.0), cells) };
    let mut model = Assembly::new("shell", points);
    model.add_solid("block", solid).unwrap();
    model
}

/// Every element with laws of every kind that it takes.
fn elements_with_laws() -> impl Iterator<Item = (&'static str, &'static str)> {
    let laws = ["neo-hookean", "st-venant-kirchhoff", "ogden", "transversely-isotropic", "corotational"];
    let pairs = ELEMENTS.into_iter().flat_map(move |element| laws.map(|law| (element, law)));
    let takes_all = |element: &str| matches!(element, "tet4" | "hex8" | "growing-hex8");
    pairs.filter(move |(element, name)| takes_all(element) || law(name).has_volumetric_energy())
}

/// Central differences at a state of strains up to 20 %, turned far: force from energy and stiffness from
/// force to 1e-7 of their largest.
#[test]
fn force_and_stiffness_are_derivatives() {
    let half = ["neo-hookean", "transversely-isotropic"].map(|name| (name, Some(0.5)));
    let laws = ["neo-hookean", "st-venant-kirchhoff", "ogden", "transversely-isotropic", "corotational"];
    let of_membranes = laws.map(|name| (name, None)).into_iter().chain(half);
    let membranes = of_membranes.map(|(name, poisson)| match poisson {
        Some(nu) => {
            let json = json!({ "young-modulus": 1e4, "poisson-ratio": nu, "fibre-modulus": 5e3 });
            let json = if name == "neo-hookean" {
                json!({ "young-modulus": 1e4, "poisson-ratio": nu })
            } else {
                json
            };
            ("membrane", name, samples::law(name, json))
        }
        None => ("membrane", name, law(name)),
    });
    let solids = elements_with_laws().map(|(element, name)| (element, name, law(name)));
    let bars = ["bar", "thread"].map(|element| (element, "neo-hookean", law("neo-hookean")));
    for (element, name, law) in solids.chain(membranes).chain(bars) {
        let model = block(element, law, [2, 1, 2], [0.2, 0.1, 0.2]);
        let state = strained(&model, 1);
        let mut system = System::new(model.clone().into(), LinearSolver::Direct).unwrap();
        assert_derivatives(&format!("{element} {name}"), &mut system, &state);
    }
}

/// Central differences at a state: force from energy and stiffness from force to 1e-7 of their largest.
fn assert_derivatives(what: &str, system: &mut System, state: &AssemblyState) {
    let nodes = state.position.len();
    let mut random = Random::new(5);
    let still = vec![0.0; 6 * nodes];
    system.evaluate(state, 0.0, Some(&still)).unwrap();
    let (force, size) = (system.forces.internal.clone(), system.stiffness.equations.count());
    let along: Vec<f64> = (0..size).map(|_| random.number()).collect();
    let mut predicted = vec![0.0; size];
    system.stiffness.matrix.multiply_values(&system.stiffness.matrix.value, &along, &mut predicted);
    let h = 1e-7;
    let mut at = |by: f64| {
        let mut moved = vec![0.0; 6 * nodes];
        system.spread(&along, &mut moved);
        let mut state = state.clone();
        state.advance(&moved, by);
        system.evaluate(&state, 0.0, None).unwrap();
        (system.forces.energy, system.forces.internal.clone())
    };
    let (ahead, behind) = (at(h), at(-h));
    let gather = |components: &[f64]| {
        let mut free = vec![0.0; size];
        system.gather(components, &mut free);
        free
    };
    let work: f64 = gather(&force).iter().zip(&along).map(|(f, d)| f * d).sum();
    let slope = (ahead.0 - behind.0) / (2.0 * h);
    assert!((slope - work).abs() < 1e-6 * work.abs(), "{what}: {slope} for {work}");
    let largest = predicted.iter().fold(0.0_f64, |a, b| a.max(b.abs()));
    let found = gather(&ahead.1).into_iter().zip(gather(&behind.1)).map(|(a, b)| (a - b) / (2.0 * h));
    for (found, predicted) in found.zip(&predicted) {
        assert!((found - predicted).abs() < 1e-7 * largest, "{what}: {found} for {predicted}");
    }
}

/// Pressures on closed faces, the quads of a hexahedron and the triangles of a tetrahedron, have a symmetric
/// stiffness that matches their forces.
#[test]
fn pressures_on_faces_have_their_stiffness() {
    let quads = [[0, 2, 3, 1], [4, 5, 7, 6], [0, 1, 5, 4], [2, 6, 7, 3], [0, 4, 6, 2], [1, 3, 7, 5]];
    let triangles = [[0, 2, 1, NO_NODE], [0, 1, 3, NO_NODE], [1, 2, 3, NO_NODE], [0, 3, 2, NO_NODE]];
    for (element, faces) in [("hex8", quads.to_vec()), ("tet4", triangles.to_vec())] {
        let mut model = match element {
            "hex8" => block("hex8", law("neo-hookean"), [1, 1, 1], [0.1; 3]),
            _ => {
                let rest = [[0.0; 3], [0.1, 0.0, 0.0], [0.0, 0.1, 0.0], [0.0, 0.0, 0.1]];
                let mut model = Assembly::new("shell", rest.map(Vector3::from).to_vec());
                let cells = Cells::tet4(vec![[0, 1, 2, 3]], &rest);
                let solid = Solid::new(0, Material::elastic(law("neo-hookean"), 1000.0), cells);
                model.add_solid("tet", solid).unwrap();
                model
            }
        };
        let stiffness = |model: &Assembly, state: &AssemblyState| {
            let mut system = System::new(model.clone().into(), LinearSolver::Direct).unwrap();
            let still = vec![0.0; 6 * model.rest.len()];
            system.evaluate(state, 1.0, Some(&still)).unwrap();
            system
        };
        let mut random = Random::new(3);
        let mut state = AssemblyState::at_rest(&model);
        state.position.iter_mut().for_each(|x| *x += 0.01 * Vector3::from(random.vector()));
        let bare = stiffness(&model, &state);
        let kind = LoadKind::Pressure { faces, pressure: 1e5 };
        let curve = Curve { shape: Shape::Hold, from: 0.0, to: 0.0 };
        model.model_mut().loads.push(Load::new("press", kind, curve));
        let mut pressed = stiffness(&model, &state);
        let size = pressed.stiffness.equations.count();
        let along: Vec<f64> = (0..size).map(|_| random.number()).collect();
        let mut predicted = vec![0.0; size];
        let of_pressure: Vec<f64> = pressed
            .stiffness
            .matrix
            .value
            .iter()
            .zip(&bare.stiffness.matrix.value)
            .map(|(with, without)| with - without)
            .collect();
        pressed.stiffness.matrix.multiply_values(&of_pressure, &along, &mut predicted);
        let sum: f64 = pressed.forces.external.iter().sum();
        assert!(sum.abs() < 1e-10, "{element}: closed faces push with {sum} N");
        let h = 1e-6;
        let mut at = |by: f64| {
            let mut moved = vec![0.0; 6 * model.rest.len()];
            pressed.spread(&along, &mut moved);
            let mut state = state.clone();
            state.advance(&moved, by);
            pressed.evaluate(&state, 1.0, None).unwrap();
            let mut loads = vec![0.0; size];
            pressed.gather(&pressed.forces.external, &mut loads);
            loads
        };
        let (ahead, behind) = (at(h), at(-h));
        let largest = predicted.iter().fold(0.0_f64, |a, b| a.max(b.abs()));
        for ((a, b), predicted) in ahead.iter().zip(&behind).zip(&predicted) {
            let found = -(a - b) / (2.0 * h);
            assert!((found - predicted).abs() < 1e-7 * largest, "{element}: {found} for {predicted}");
        }
    }
}

/// A surface can be carried by the nodes of a side and numbered differently. Forces and pressures on it then
/// act as if on the side. A point amid four nodes gives a quarter to each.
#[test]
fn loads_on_carried_surfaces_act_through_their_mapping() {
    let loads = |load: Load| {
        let mut model = block("hex8", law("neo-hookean"), [1, 1, 1], [0.1; 3]);
        let one = [[(6, 1.0)], [(7, 1.0)], [(5, 1.0)], [(4, 1.0)]];
        let middle = [4, 5, 6, 7].map(|node| (node, 0.25));
        let rows = one.iter().map(|row| &row[..]).chain([&middle[..]]);
        let mapping = Weights::from_rows(rows);
        model.model_mut().surfaces.push(Surface { name: "top".into(), body: 0, rest: vec![], mapping });
        model.model_mut().loads.push(load);
        let mut state = AssemblyState::at_rest(&model);
        let mut random = Random::new(3);
        state.position.iter_mut().for_each(|x| *x += 0.01 * Vector3::from(random.vector()));
        let mut system = System::new(model.clone().into(), LinearSolver::Direct).unwrap();
        let still = vec![0.0; 6 * model.rest.len()];
        system.evaluate(&state, 1.0, Some(&still)).unwrap();
        system.forces.external
    };
    let load = |kind| Load::new("load", kind, Curve { shape: Shape::Hold, from: 0.0, to: 0.0 });
    let carried = |kind| Load { surface: Some(0), ..load(kind) };
    let press = |face| LoadKind::Pressure { faces: vec![face], pressure: 1e5 };
    let force = [0.1, -0.2, 0.3];
    for (direct, through) in [
        (load(press([4, 5, 7, 6])), carried(press([3, 2, 1, 0]))),
        (load(LoadKind::force([5], force)), carried(LoadKind::force([2], force))),
        (load(LoadKind::force(4..8, force.map(|f| 0.25 * f))), carried(LoadKind::force([4], force))),
    ] {
        let (direct, through) = (loads(direct), loads(through));
        assert!(direct.iter().any(|f| f.abs() > 0.01));
        let off = direct.iter().zip(&through).map(|(a, b)| (a - b).abs()).fold(0.0, f64::max);
        assert!(off < 1e-12, "{off}");
    }
}

fn nodes_at(model: &Assembly, x: f64) -> Vec<u32> {
    (0..model.rest.len() as u32).filter(|&n| (model.place(n as usize).x - x).abs() < 0.02).collect()
}

/// Clamped at x = 0, pushed to the side at its other end.
fn cantilever(element: &str, law: AnyLaw, force: f64, to: f64) -> Assembly {
    let mut model = block(element, law, [6, 2, 2], [0.3, 0.1, 0.1]);
    let held = nodes_at(&model, 0.0);
    let clamp =
        Constraint { name: "clamp".into(), nodes: held, components: [true; 6], motion: Motion::Fixed };
    model.model_mut().constraints.push(clamp);
    let pushed = nodes_at(&model, 0.3);
    let force = Vector3::new(0.0, 0.0, force) / pushed.len() as f64;
    let kind = LoadKind::force(pushed, force);
    let curve = Curve { shape: Shape::Ramp, from: 0.0, to };
    model.model_mut().loads.push(Load::new("push", kind, curve));
    model
}

/// Residuals of a load in one step fall with the square near the equilibrium, 5 to 20 % of the length away;
/// all elements and laws.
#[test]
fn newtons_method_converges_quadratically() {
    for (element, name) in elements_with_laws() {
        let model = cantilever(element, law(name), 0.5, 1.0);
        let mut state = AssemblyState::at_rest(&model);
        let settings = StaticSettings { tolerance: 1e-12, ..StaticSettings::default() };
        let step = Statics::new(model.clone(), settings).unwrap().solve(&mut state, 1.0).unwrap();
        let end = nodes_at(&model, 0.3)[0] as usize;
        println!("{element} {name}: {:.4} m, {:?}", state.displacement(&model, end).z, step.residuals);
        assert!(state.displacement(&model, end).z > 0.015 && step.parts == 1, "{element} {name}");
        // Over the load: r' < 10 r² where that is above round-off. A factor of a tenth an iteration would
        // leave 1e-5 of 1e-4.
        let relative: Vec<f64> = step.residuals.iter().map(|r| r / step.residuals[0]).collect();
        let close = relative.windows(2).filter(|r| (1e-5..0.1).contains(&r[0]));
        let checked =
            close.inspect(|r| assert!(r[1] < 10.0 * r[0] * r[0], "{element} {name}: {relative:?}")).count();
        assert!(checked > 0, "{element} {name}: {relative:?}");
    }
}

/// A block whose law relaxes in both parts, or in the change of shape alone where pressures are averaged.
fn relaxing(element: &str, update: PronyUpdate) -> Assembly {
    let mut model = block(element, law("neo-hookean"), [2, 1, 2], [0.2, 0.1, 0.2]);
    let parts: &[PronyPart] = match element {
        "tet4" | "hex8" => &[PronyPart::Isochoric, PronyPart::Volumetric],
        _ => &[PronyPart::Isochoric],
    };
    let term = |&part| PronyTerm { part, weight: 0.6, time: 0.5 };
    let terms: Vec<PronyTerm> = parts.iter().map(term).collect();
    model.model_mut().solids[0].material.prony = Prony::new(&terms, update).unwrap();
    model
}

/// A state of strains up to 20 %, turned far.
fn strained(model: &Assembly, seed: u64) -> AssemblyState {
    let mut random = Random::new(seed);
    let mut state = AssemblyState::at_rest(model);
    let turn = pliant_shells::rotation::exponential(&Vector3::new(1.0, -2.0, 0.5));
    for x in &mut state.position {
        *x = turn * (*x + 0.008 * Vector3::from(random.vector()));
    }
    state
}

const RELAXING: [&str; 5] = ["tet4", "tet4-anp", "hex8", "hex8-full", "membrane"];

/// In a step from a strained state with its history to another one, force and stiffness are derivatives.
#[test]
fn relaxing_steps_have_their_energy_and_stiffness() {
    for element in RELAXING {
        let model = relaxing(element, PronyUpdate::Exact);
        let mut system = System::new(model.clone().into(), LinearSolver::Direct).unwrap();
        let mut before = strained(&model, 1);
        system.begin_history(&mut before);
        let mut state = AssemblyState { history: before.history.clone(), ..strained(&model, 2) };
        system.end_step(Some(&before), &mut state, 0.3);
        system.begin_step(&state.history, 0.2);
        let next = AssemblyState { history: state.history.clone(), ..strained(&model, 3) };
        assert_derivatives(element, &mut system, &next);
    }
}

/// A strain that is held relaxes by e^(−t/τ), however its steps are cut; with backward Euler by 1/(1 + h/τ) a
/// step. What holds it does no work.
#[test]
fn a_held_strain_relaxes_by_its_series() {
    for element in RELAXING {
        for update in [PronyUpdate::Exact, PronyUpdate::BackwardEuler] {
            let model = relaxing(element, update);
            let mut system = System::forces_only(model.clone().into());
            let mut state = strained(&model, 1);
            system.begin_history(&mut state);
            let loaded = state.history.work[0];
            let mut after = |steps: &[f64]| {
                let mut state = state.clone();
                for &step in steps {
                    let before = state.clone();
                    system.begin_step(&state.history, step);
                    system.evaluate(&state, 0.0, None).unwrap();
                    let within = system.forces.internal.clone();
                    system.end_step(Some(&before), &mut state, step);
                    system.stand(&state.history);
                    system.evaluate(&state, 0.0, None).unwrap();
                    let largest = within.iter().fold(0.0_f64, |a, b| a.max(b.abs()));
                    let off = within.iter().zip(&system.forces.internal).map(|(a, b)| (a - b).abs());
                    assert!(off.fold(0.0, f64::max) < 1e-12 * largest, "{element}");
                }
                assert!((state.history.work[0] - loaded).abs() < 1e-14 * loaded);
                system.forces.internal.clone()
            };
            let (first, last) = (after(&[0.0]), after(&[1e12]));
            let expected = match update {
                PronyUpdate::Exact => (-0.3_f64 / 0.5).exp(),
                PronyUpdate::BackwardEuler => 1.0 / ((1.0 + 0.1 / 0.5) * (1.0 + 0.2 / 0.5)),
            };
            let largest = first.iter().fold(0.0_f64, |a, b| a.max(b.abs()));
            for ((found, first), last) in after(&[0.1, 0.2]).iter().zip(&first).zip(&last) {
                let wanted = last + expected * (first - last);
                assert!((found - wanted).abs() < 1e-11 * largest, "{element}: {found} for {wanted}");
            }
            assert!(first.iter().zip(&last).any(|(a, b)| (a - b).abs() > 1e-2 * largest), "{element}");
        }
    }
}

/// A push that grows with time, backward Euler: half the step, half the error.
#[test]
fn steps_of_backward_euler_are_of_first_order() {
    for element in ELEMENTS {
        let model = cantilever(element, law("neo-hookean"), 1.0, 0.2);
        let at_end = |steps: u32| {
            let mut state = AssemblyState::at_rest(&model);
            let settings =
                DynamicSettings { tolerance: 1e-6, ..DynamicSettings::new(0.2 / f64::from(steps)) };
            let mut solver = BackwardEuler::new(model.clone(), settings).unwrap();
            (0..steps).for_each(|_| drop(solver.advance(&mut state).unwrap()));
            state.position
        };
        let finest = at_end(256);
        let error = |steps: u32| {
            let off = at_end(steps).into_iter().zip(&finest).map(|(a, b)| (a - b).norm());
            off.fold(0.0, f64::max)
        };
        let (coarse, fine) = (error(16), error(32));
        println!("{element}: {coarse:.3e}, {fine:.3e} m");
        // The finest has an eighth of the fine error itself: 2 becomes (1 − 1/16)/(1/2 − 1/16) = 2.14.
        assert!((1.9..2.4).contains(&(coarse / fine)), "{element}: {}", coarse / fine);
    }
}

#[test]
fn solids_without_stiffness_and_broken_ones_are_refused() {
    let plain = law("neo-hookean");
    let (points, tets) = bar([1, 1, 1], [0.1; 3]);
    let rest: Vec<[f64; 3]> = points.iter().map(|&x| x.into()).collect();
    let with = |cells: Cells, material: Material| {
        Assembly::new("shell", points.clone()).add_solid("block", Solid::new(0, material, cells))
    };
    let wide = Cells::averaged_tet4(tets.clone(), &rest, Averaging::Variational);
    let refused = with(wide, Material::elastic(plain, 1000.0)).unwrap_err();
    assert!(refused.to_string().contains("`block`: `tet4-ianp` couples"), "{refused}");
    let term = PronyTerm { part: PronyPart::Volumetric, weight: 0.5, time: 1.0 };
    let prony = Prony::new(&[term], PronyUpdate::Exact).unwrap();
    let relaxing = Material { prony, ..Material::elastic(plain, 1000.0) };
    let averaged = Cells::averaged_tet4(tets.clone(), &rest, Averaging::Nodal);
    let refused = with(averaged, relaxing.clone()).unwrap_err();
    assert!(
        refused.to_string().contains("averages the pressure, but the volumetric part of its law relaxes"),
        "{refused}"
    );
    let bars = Cells::bar(vec![[0, 1]], &rest, 1e-4, Cord { slack: 1.0, tension_only: false });
    let refused = with(bars, relaxing).unwrap_err();
    assert!(refused.to_string().contains("a viscoelastic bar"), "{refused}");
    let anp = Cells::averaged_tet4(tets.clone(), &rest, Averaging::Nodal);
    let refused = with(anp, Material::elastic(law("corotational"), 1000.0)).unwrap_err();
    assert!(refused.to_string().contains("no energy of the volume alone"), "{refused}");
    let light = with(Cells::tet4(tets.clone(), &rest), Material::elastic(plain, 0.0));
    assert!(matches!(light, Err(ModelError::OutOfRange { .. })));
    let [a, b, c, d] = tets[0];
    let inverted = with(Cells::tet4(vec![[b, a, c, d]], &rest), Material::elastic(plain, 1000.0));
    assert!(matches!(inverted, Err(ModelError::Degenerate { what: "volume", .. })), "{inverted:?}");
    let far = with(Cells::tet4(vec![tets[0]], &rest), Material::elastic(plain, 1000.0));
    assert!(far.is_ok());
}

/// Half of a block is squeezed to a seventh, and one corner is pushed through. Tets turn inside out;
/// hexahedra are flat and have an inverted corner. A corner pushed through without squeezing inverts tets
/// only.
#[test]
fn inverted_cells_are_reported() {
    for element in ELEMENTS {
        let model = block(element, law("neo-hookean"), [2, 1, 1], [0.2, 0.1, 0.1]);
        let mut state = AssemblyState::at_rest(&model);
        // A corner that only the second half of the block has.
        let end = nodes_at(&model, 0.2);
        state.position[end[0] as usize].x -= 0.11;
        let alone = System::forces_only(model.clone().into()).evaluate(&state, 0.0, None);
        assert_eq!(alone.is_ok(), element.contains("hex"), "{element}: {alone:?}");
        end[1..].iter().for_each(|&node| state.position[node as usize].x -= 0.085);
        let mut system = System::forces_only(model.clone().into());
        let error = system.evaluate(&state, 0.0, None).unwrap_err();
        let Some((cell, pliant_shells::Broken::Inverted(determinant))) = error.broken() else {
            panic!("{error}")
        };
        let half = model.solids[0].cells.len() / 2;
        assert!(determinant < 0.0 && (half..2 * half).contains(&cell), "{element}: {cell} {determinant}");
    }
}
