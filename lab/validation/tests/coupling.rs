//! Solids with thin walls on their nodes, against closed forms and an independent finite-element program
//! (`data/coupling`).

use std::collections::BTreeMap;

use pliant_explicit::{DynamicRelaxation, Observable, RelaxationSettings, State};
use pliant_geometry::{CellBlock, CellKind, Locator, Mesh, Vector3, boundary};
use pliant_mechanics::Model;
use pliant_mechanics::curve::{Curve, Shape};
use pliant_mechanics::law::{AnyLaw, Corotational, NeoHookean, StVenantKirchhoff, Volumetric};
use pliant_mechanics::load::{Load, LoadKind};
use pliant_mechanics::mapping::Weights;
use pliant_mechanics::model::{Averaging, Cells, Constraint, Material, Motion, Solid};
use pliant_mechanics::tensor::{Vector, dot, sub};
use pliant_meshing::{Ellipsoid, Stuffing};
use pliant_validation::{claim, largest, numbers, reference, soft_tissue};
use serde_json::Value;

const RAMP: Curve = Curve { shape: Shape::Ramp, from: 0.0, to: 1.0 };

/// E [Pa], ν and thickness [m] of a coat.
fn coat(table: &Value) -> [f64; 3] {
    ["E", "nu", "t"].map(|key| table[key].as_f64().unwrap())
}

fn st_venant_kirchhoff([young, nu, _]: [f64; 3]) -> AnyLaw {
    let shear = young / (2.0 * (1.0 + nu));
    AnyLaw::StVenantKirchhoff(StVenantKirchhoff { shear, lame: 2.0 * shear * nu / (1.0 - 2.0 * nu) })
}

fn wall(law: AnyLaw, triangles: Vec<[u32; 3]>, rest: &[Vector<f64>], thickness: f64) -> Solid {
    let count = triangles.len();
    Solid::new(0, Material::elastic(law, 1000.0), Cells::membrane(triangles, rest, &vec![thickness; count]))
}

fn prescribe(model: &mut Model, name: &str, component: usize, nodes: Vec<u32>, motion: Motion) {
    let mut components = [false; 6];
    components[component] = true;
    model.constraints.push(Constraint { name: name.into(), nodes, components, motion });
}

/// The equilibrium under the whole load, in some load steps.
fn equilibrium(model: &Model, steps: u32, tolerance: f64) -> (DynamicRelaxation<f64>, State<f64>) {
    let settings = RelaxationSettings { tolerance, iterations: 2_000_000, ..RelaxationSettings::default() };
    let mut solver = DynamicRelaxation::new(model.clone(), settings).unwrap();
    let mut state = State::at_rest(model);
    for step in 1..=steps {
        solver.solve(&mut state, f64::from(step) / f64::from(steps)).unwrap();
    }
    (solver, state)
}

/// A coated block stretched to 1.001 … 1.3 of its length, its width held: the homogeneous state is exact.
/// Three laws of the coat.
#[test]
fn a_coated_block_is_stretched_as_in_closed_form() {
    let data = reference("coupling/coated_block_uniaxial.json");
    let [length, width, height] = ["L", "w", "h"].map(|key| data[key].as_f64().unwrap());
    let mut worst = 0.0_f64;
    for row in data["rows"].as_array().unwrap() {
        let name = row["coating"].as_str().unwrap();
        let coat = coat(&data["coats"][name]);
        let [young, nu, thickness] = coat;
        let stretch = row["eps"].as_f64().unwrap();
        let (shear, bulk) = (young / (2.0 * (1.0 + nu)), young / (3.0 * (1.0 - 2.0 * nu)));
        let neo_hookean = NeoHookean { shear, volumetric: Volumetric::quadratic(bulk) };
        for (key, law) in [
            ("stvk", st_venant_kirchhoff(coat)),
            ("corotational", AnyLaw::Corotational(Corotational::from_young(young, nu))),
            ("neo-hookean", AnyLaw::NeoHookean(neo_hookean)),
        ] {
            let mut model = Model::default();
            let corners: Vec<Vector<f64>> = pliant_mechanics::element::HEX_CORNERS
                .map(|c| {
                    [length, width, height]
                        .into_iter()
                        .zip(c)
                        .map(|(l, x)| 0.5 * l * (1.0 + x))
                        .collect::<Vec<_>>()
                        .try_into()
                        .unwrap()
                })
                .to_vec();
            model.add_body("block", &corners);
            let cells = Cells::hex8(vec![[0, 1, 2, 3, 4, 5, 6, 7]], &corners, 0.1, 1000.0);
            model.add_solid(Solid::new(0, Material::elastic(soft_tissue(), 1000.0), cells));
            model.add_solid(wall(law, vec![[4, 5, 6], [4, 6, 7]], &corners, thickness));
            let at = |component: usize, place: f64| -> Vec<u32> {
                (0..8).filter(|&n| (corners[n as usize][component] - place).abs() < 1e-9).collect()
            };
            prescribe(&mut model, "start", 0, at(0, 0.0), Motion::Fixed);
            prescribe(&mut model, "sides", 1, (0..8).collect(), Motion::Fixed);
            prescribe(&mut model, "base", 2, at(2, 0.0), Motion::Fixed);
            let pulled = Motion::Displacement([stretch * length, 0.0, 0.0], RAMP);
            prescribe(&mut model, "end", 0, at(0, length), pulled);
            let (solver, _) = equilibrium(&model, 3, 1e-9);
            let force = solver.reaction(3)[0];
            let wanted = row[key].as_f64().unwrap();
            worst = worst.max((force / wanted - 1.0).abs());
        }
    }
    claim("coated block: force over the closed form", worst, 1e-6);
}

/// The quarter block of 729 nodes, uncoated and coated, on the meshes of an independent program: linear tets
/// and triangles.
#[test]
fn coated_blocks_stand_where_another_program_puts_them() {
    let data = reference("coupling/coated_block_t4.json");
    let rows = |value: &Value| -> Vec<Vec<f64>> { value.as_array().unwrap().iter().map(numbers).collect() };
    let points: Vec<Vector<f64>> = rows(&data["points"]).into_iter().map(|x| x.try_into().unwrap()).collect();
    let cell = |row: Vec<f64>| row.into_iter().map(|node| node as u32).collect::<Vec<u32>>();
    let tets: Vec<[u32; 4]> = rows(&data["tets"]).into_iter().map(|t| cell(t).try_into().unwrap()).collect();
    let top: Vec<[u32; 3]> = rows(&data["top"]).into_iter().map(|t| cell(t).try_into().unwrap()).collect();
    let fixed = cell(numbers(&data["fixed"]));
    for (name, steps) in [("none", 2), ("pressed", 10), ("pulled", 10)] {
        let mut model = Model::default();
        model.add_body("block", &points);
        model.add_solid(Solid::new(
            0,
            Material::elastic(soft_tissue(), 1000.0),
            Cells::tet4(tets.clone(), &points),
        ));
        if name != "none" {
            model.add_solid(wall(st_venant_kirchhoff([1e6, 0.3, 1e-4]), top.clone(), &points, 1e-4));
        }
        for component in 0..3 {
            let nodes =
                fixed.iter().filter(|&&dof| dof as usize % 3 == component).map(|dof| dof / 3).collect();
            prescribe(&mut model, "held", component, nodes, Motion::Fixed);
        }
        let forces = rows(&data[name]["force"]).into_iter().zip(0..);
        let forces = forces.map(|(f, node)| (node, f.try_into().unwrap())).filter(|(_, f)| *f != [0.0; 3]);
        model.loads.push(Load::new("traction", LoadKind::Forces(forces.collect()), RAMP));
        let (_, state) = equilibrium(&model, steps, 1e-9);
        let wanted: Vec<Vector<f64>> =
            rows(&data[name]["displacement"]).into_iter().map(|u| u.try_into().unwrap()).collect();
        let size = largest(wanted.iter().map(|&u| dot(u, u).sqrt()));
        let off =
            state.displacement.iter().zip(&wanted).map(|(&u, &v)| dot(sub(u, v), sub(u, v)).sqrt() / size);
        claim(&format!("block, {name}: displacements over the largest"), largest(off), 1e-6);
    }
}

/// Nodal forces of the traction T₀ (1 − (x² + y²)/R₀²)^power e_z on triangles, scaled to a total [N].
fn patch(
    triangles: &[[u32; 3]],
    points: &[Vector<f64>],
    radius: f64,
    power: i32,
    total: f64,
) -> Vec<(u32, Vector<f64>)> {
    let mut forces: BTreeMap<u32, f64> = BTreeMap::new();
    const CUTS: usize = 8;
    for triangle in triangles {
        let [a, b, c] = triangle.map(|node| Vector3::from(points[node as usize]));
        let area = 0.5 * (b - a).cross(&(c - a)).norm() / (CUTS * CUTS) as f64;
        for i in 0..CUTS {
            for j in 0..2 * (CUTS - i) - 1 {
                // Centres of the small triangles, in natural coordinates.
                let (k, down) = (j / 2, j % 2);
                let third = (1 + down) as f64 / 3.0;
                let [s, t] = [i as f64 + third, k as f64 + third].map(|x| x / CUTS as f64);
                let weights = [1.0 - s - t, s, t];
                let place = a * weights[0] + b * weights[1] + c * weights[2];
                let part = 1.0 - (place.x * place.x + place.y * place.y) / (radius * radius);
                if part > 0.0 {
                    for (&node, w) in triangle.iter().zip(weights) {
                        *forces.entry(node).or_default() += w * area * part.powi(power);
                    }
                }
            }
        }
    }
    let sum: f64 = forces.values().sum();
    forces.into_iter().map(|(node, f)| (node, [0.0, 0.0, f * total / sum])).collect()
}

/// Solves a quarter of the block of 40 × 40 × 20 mm with coat A, under a patch of traction of F on the whole
/// block. Returns the displacement [m] of the middle of its top. Each cube has six tets. There are n cubes
/// over the 10 mm at the patch and half as many over the 10 mm beyond.
fn block_patch(n: u32, force: f64) -> f64 {
    let count = 3 * n / 2 + 1;
    let fine = 0.01 / f64::from(n);
    // Away from the patch.
    let along = |i: u32| fine * (f64::from(i.min(n)) + 2.0 * f64::from(i.max(n) - n));
    let at = |i: u32, j: u32, k: u32| (k * count + j) * count + i;
    let mut points = Vec::new();
    for (k, j, i) in (0..count).flat_map(|k| (0..count).flat_map(move |j| (0..count).map(move |i| (k, j, i))))
    {
        points.push([along(i), along(j), 0.02 - along(count - 1 - k)]);
    }
    let n = count - 1;
    let squares = || (0..n).flat_map(move |j| (0..n).map(move |i| (i, j)));
    let hexes = (0..n).flat_map(|k| squares().map(move |(i, j)| (i, j, k))).map(|(i, j, k)| {
        let low = [at(i, j, k), at(i + 1, j, k), at(i + 1, j + 1, k), at(i, j + 1, k)];
        let high = low.map(|node| node + count * count);
        [low[0], low[1], low[2], low[3], high[0], high[1], high[2], high[3]]
    });
    let top: Vec<[u32; 3]> = squares()
        .flat_map(|(i, j)| {
            let [a, b, c, d] = [at(i, j, n), at(i + 1, j, n), at(i + 1, j + 1, n), at(i, j + 1, n)];
            if (i + j).is_multiple_of(2) { [[a, b, c], [a, c, d]] } else { [[a, b, d], [b, c, d]] }
        })
        .collect();
    let mut model = Model::default();
    model.add_body("block", &points);
    // Kuhn's split around the diagonal 0–6.
    const TETS: [[usize; 4]; 6] =
        [[0, 1, 2, 6], [0, 2, 3, 6], [0, 3, 7, 6], [0, 7, 4, 6], [0, 4, 5, 6], [0, 5, 1, 6]];
    let tets = hexes.flat_map(|hex: [u32; 8]| TETS.map(|tet| tet.map(|corner| hex[corner]))).collect();
    let cells = Cells::averaged_tet4(tets, &points, Averaging::Nodal);
    model.add_solid(Solid::new(0, Material::elastic(soft_tissue(), 1000.0), cells));
    model.add_solid(wall(st_venant_kirchhoff([1e6, 0.3, 1e-4]), top.clone(), &points, 1e-4));
    let on = |component: usize| -> Vec<u32> {
        (0..points.len() as u32).filter(|&node| points[node as usize][component].abs() < 1e-12).collect()
    };
    prescribe(&mut model, "x", 0, on(0), Motion::Fixed);
    prescribe(&mut model, "y", 1, on(1), Motion::Fixed);
    model.fix("base", on(2));
    let forces = patch(&top, &points, 0.008, 2, 0.25 * force);
    model.loads.push(Load::new("traction", LoadKind::Forces(forces), RAMP));
    let (_, state) = equilibrium(&model, 4, 1e-6);
    state.displacement[at(0, 0, n) as usize][2]
}

/// Displacement of the middle of the top at full load [m].
fn centre(data: &Value, row: &str) -> f64 {
    let rows = data["rows"][row].as_array().unwrap();
    numbers(&rows[rows.len() - 1]["probes"]["(0.0, 0.0, 20.0)"])[2]
}

#[test]
fn a_coated_block_converges_to_the_reference() {
    let data = reference("coupling/coated_block_patch.json");
    for (row, force) in [("A_F-0.1_n8", -0.1), ("A_F0.1_n8", 0.1)] {
        let wanted = centre(&data, row);
        let off = [4, 8].map(|n| block_patch(n, force) / wanted - 1.0);
        println!(
            "{row}: {wanted:.4e} m, off by {:.2} % with 4 and {:.2} % with 8 cells",
            100.0 * off[0],
            100.0 * off[1]
        );
        claim(&format!("{row}: middle of the top, 8 cells"), off[1].abs(), 0.03);
        assert!(off[1].abs() < off[0].abs(), "{row}: no convergence, {off:?}");
    }
}

/// Errors of an ellipsoid of 60 × 45 × 30 mm, held at its back and pulled at its front, with or without a
/// capsule. They are errors of the displacements of the five probes, over the reference's largest.
fn ellipsoid_off(edge: f64, data: &Value, row: &str) -> f64 {
    let ellipsoid = Ellipsoid { centre: Vector3::zeros(), radii: Vector3::new(0.06, 0.045, 0.03) };
    let mesh = Stuffing::new(edge).mesh(&ellipsoid).unwrap().mesh;
    let points: Vec<Vector<f64>> = mesh.points.iter().map(|&x| x.into()).collect();
    let skin: Vec<[u32; 3]> =
        boundary(&mesh).faces.iter().map(|face| face.nodes().try_into().unwrap()).collect();
    let tets = mesh.block(CellKind::Tet).unwrap().cells().map(|cell| cell.try_into().unwrap()).collect();
    let mut model = Model::default();
    model.add_body("organ", &points);
    let cells = Cells::averaged_tet4(tets, &points, Averaging::Nodal);
    model.add_solid(Solid::new(0, Material::elastic(soft_tissue(), 1060.0), cells));
    let capsule = &data["capsules"][row.trim_start_matches("pull_")];
    if !capsule.is_null() {
        let coat = coat(capsule);
        model.add_solid(wall(st_venant_kirchhoff(coat), skin.clone(), &points, coat[2]));
    }
    let mut held: Vec<u32> =
        skin.iter().flatten().copied().filter(|&n| points[n as usize][2] <= -0.015 + 1e-9).collect();
    held.sort_unstable();
    held.dedup();
    model.fix("back", held);
    let front: Vec<[u32; 3]> =
        skin.iter().copied().filter(|face| face.iter().all(|&node| points[node as usize][2] > 0.0)).collect();
    let rows = data["rows"][row].as_array().unwrap();
    let last = &rows[rows.len() - 1];
    let forces = patch(&front, &points, 0.015, 2, last["total_load"].as_f64().unwrap());
    model.loads.push(Load::new("pull", LoadKind::Forces(forces), RAMP));
    let (_, state) = equilibrium(&model, 4, 1e-6);
    let probes = [[0.0, 0.0, 0.03], [0.0; 3], [0.03, 0.0, 0.0], [0.0, 0.03, 0.0], [0.03, 0.02, 0.01]];
    let locator = Locator::new(&mesh);
    let of = |probe: &[f64; 3]| {
        let found = locator.locate(Vector3::from(*probe)).unwrap();
        let nodes = mesh.block(found.kind).unwrap().cell(found.cell as usize);
        let parts = nodes.iter().zip(found.weights());
        parts.map(|(&node, &w)| Vector3::from(state.displacement[node as usize]) * w).sum::<Vector3>()
    };
    let wanted = last["probes"].as_array().unwrap().iter().map(|u| Vector3::from_row_slice(&numbers(u)));
    let off = probes.iter().zip(wanted).map(|(probe, wanted)| (of(probe) - wanted).norm());
    largest(off) / last["umax"].as_f64().unwrap()
}

#[test]
fn an_ellipsoid_in_its_capsule_converges_to_the_reference() {
    let data = reference("coupling/ellipsoid_capsule.json");
    for row in ["pull_none", "pull_A"] {
        let off = [0.009, 0.006].map(|edge| ellipsoid_off(edge, &data, row));
        println!(
            "{row}: off by {:.2} % of the largest with 9 mm, {:.2} % with 6 mm",
            100.0 * off[0],
            100.0 * off[1]
        );
        claim(&format!("{row}: probes, tets of 6 mm"), off[1], 0.03);
        assert!(off[1] < off[0], "{row}: no convergence, {off:?}");
    }
}

/// A layer of a tube: radii [m] and Young's modulus [Pa], ν = 0.45.
type Layer = [f64; 3];

/// A quarter of a slice of a tube in plane strain, in full hexahedra. Each layer has its own number of cells
/// around and through the wall. The inner layer is tied to the next.
struct Tube {
    model: Model,
    /// The nodes of the inner and of the outer surface.
    surfaces: [Vec<u32>; 2],
}

/// Thickness of the slice [m].
const SLICE: f64 = 1e-4;

fn tube(layers: &[(Layer, [usize; 2])]) -> Tube {
    let mut model = Model::default();
    let mut rings: Vec<[Vec<u32>; 2]> = Vec::new();
    let mut meshes: Vec<(Mesh, u32)> = Vec::new();
    for &([inner, outer, young], [round, through]) in layers {
        let mut points = Vec::new();
        for (k, j, i) in
            (0..2).flat_map(|k| (0..=through).flat_map(move |j| (0..=round).map(move |i| (k, j, i))))
        {
            let radius = inner + (outer - inner) * j as f64 / through as f64;
            let angle = 0.5 * std::f64::consts::PI * i as f64 / round as f64;
            points.push([radius * angle.cos(), radius * angle.sin(), SLICE * k as f64]);
        }
        let first = model.rest.len() as u32;
        let body = model.add_body("layer", &points);
        let at = |i: usize, j: usize, k: usize| ((k * (through + 1) + j) * (round + 1) + i) as u32;
        let hexes: Vec<[u32; 8]> = (0..through)
            .flat_map(|j| (0..round).map(move |i| (i, j)))
            .map(|(i, j)| {
                // Outwards, round, along.
                let low = [at(i, j, 0), at(i, j + 1, 0), at(i + 1, j + 1, 0), at(i + 1, j, 0)];
                let [a, b, c, d] = low;
                let [e, f, g, h] = low.map(|node| node + at(0, 0, 1));
                [a, b, c, d, e, f, g, h]
            })
            .collect();
        let (shear, bulk) = (young / 2.9, young / 0.3);
        let law = AnyLaw::NeoHookean(NeoHookean { shear, volumetric: Volumetric::quadratic(bulk) });
        let numbered = hexes.iter().map(|hex| hex.map(|node| first + node)).collect();
        let cells = Cells::full_hex8(numbered, &model.rest);
        model.add_solid(Solid::new(body, Material::elastic(law, 1000.0), cells));
        let ring = |j: usize| -> Vec<u32> {
            let of_side = |k: usize| (0..=round).map(move |i| (i, k));
            (0..2).flat_map(of_side).map(|(i, k)| first + at(i, j, k)).collect()
        };
        rings.push([ring(0), ring(through)]);
        let places = points.iter().map(|&x| Vector3::from(x)).collect();
        let block = CellBlock::new(CellKind::Hex, hexes.into_flattened());
        meshes.push((Mesh { points: places, blocks: vec![block], ..Mesh::default() }, first));
    }
    for number in 0..layers.len() - 1 {
        // The inner layer follows the next one.
        let nodes = rings[number][1].clone();
        let (mesh, first) = &meshes[number + 1];
        let locator = Locator::new(mesh);
        let row = |&node: &u32| -> Vec<(u32, f64)> {
            let found = locator.locate(Vector3::from(model.rest[node as usize])).unwrap();
            let cell = mesh.block(CellKind::Hex).unwrap().cell(found.cell as usize);
            cell.iter()
                .zip(found.weights())
                .map(|(&node, &w)| (first + node, w))
                .filter(|(_, w)| w.abs() > 1e-12)
                .collect()
        };
        let rows: Vec<_> = nodes.iter().map(row).collect();
        model.tie("bond", nodes, Weights::from_rows(rows.iter().map(Vec::as_slice))).unwrap();
    }
    let follows = model.followers();
    let mut on = |component: usize, name: &str| {
        let is_on =
            |node: &u32| model.rest[*node as usize][component].abs() < 1e-9 && !follows[*node as usize];
        let nodes = (0..model.node_count() as u32).filter(is_on).collect();
        prescribe(&mut model, name, component, nodes, Motion::Fixed);
    };
    on(0, "y axis");
    on(1, "x axis");
    let free = (0..model.node_count() as u32).filter(|&node| !follows[node as usize]).collect();
    prescribe(&mut model, "slice", 2, free, Motion::Fixed);
    let last = rings.len() - 1;
    Tube { surfaces: [rings[0][0].clone(), rings[last][1].clone()], model }
}

/// Moves the inner surface to a radius [m], as a balloon does. Returns its pressure [Pa], and the radius of
/// the outer surface.
fn inflated(mut tube: Tube, radius: f64) -> [f64; 2] {
    let rest = tube.model.rest.clone();
    let inner = &tube.surfaces[0];
    let by = |&node: &u32| {
        let [x, y, _] = rest[node as usize];
        let grow = radius / x.hypot(y) - 1.0;
        [x * grow, y * grow, 0.0]
    };
    tube.model.constraints.push(Constraint {
        name: "balloon".into(),
        nodes: inner.clone(),
        components: [true, true, false, false, false, false],
        motion: Motion::Displacements(inner.iter().map(by).collect(), RAMP),
    });
    // Where two constraints hold a component, the first has the reaction: the balloon comes first.
    let last = tube.model.constraints.len() - 1;
    tube.model.constraints.swap(0, last);
    for constraint in &mut tube.model.constraints[1..] {
        constraint.nodes.retain(|node| !inner.contains(node) || constraint.name == "slice");
    }
    let (solver, state) = equilibrium(&tube.model, 4, 1e-8);
    let radial = |&node: &u32| {
        let [x, y, _] = rest[node as usize];
        let [fx, fy, _] = solver.nodal_reaction(node as usize);
        (x * fx + y * fy) / x.hypot(y)
    };
    let force: f64 = inner.iter().map(radial).sum();
    let area = 0.5 * std::f64::consts::PI * radius * SLICE;
    let outer = tube.surfaces[1].iter().map(|&node| {
        let [x, y, _] = pliant_mechanics::tensor::add(rest[node as usize], state.displacement[node as usize]);
        x.hypot(y)
    });
    [force / area, outer.sum::<f64>() / tube.surfaces[1].len() as f64]
}

/// Thick tubes blown up to twice their radius and more, and tubes of two layers whose meshes do not match,
/// tied.
#[test]
fn thick_and_layered_tubes_are_inflated_as_in_closed_form() {
    let data = reference("coupling/tubes.json");
    let mut worst = [0.0_f64; 2];
    for row in data["nh_compressible"]["rows"].as_array().unwrap() {
        let layer = |value: &Value| -> Layer { ["R0", "R1", "E"].map(|key| value[key].as_f64().unwrap()) };
        let layers: Vec<Layer> = row["layers"].as_array().unwrap().iter().map(layer).collect();
        let [radius, pressure] = ["r_inner", "pressure"].map(|key| row[key].as_f64().unwrap());
        let outer = numbers(&row["radii_at_layer_ends"])[layers.len() - 1];
        let counts = [[30, 10], [23, 8]];
        let parts: Vec<_> = layers.iter().copied().zip(counts).collect();
        let [found, reached] = inflated(tube(&parts), radius);
        let off = (found / pressure - 1.0).abs().max((reached / outer - 1.0).abs());
        println!(
            "{} layers to {radius} m: {found:.1} Pa for {pressure:.1}, {reached:.6} m for {outer:.6}",
            layers.len()
        );
        let kind = layers.len() - 1;
        worst[kind] = worst[kind].max(off);
    }
    claim("thick tubes: pressure and outer radius", worst[0], 0.01);
    claim("tubes of two tied layers: pressure and outer radius", worst[1], 0.01);
}

/// Tests a liver and its portal vein from a scan (TotalSegmentator), in the scene that `pliant mesh` makes.
/// The liver is stiffer in its capsule, and the energy is balanced.
#[test]
fn a_segmented_liver_is_pulled_with_and_without_its_capsule() {
    let Some(data) = std::env::var_os("PLIANT_DATA").map(std::path::PathBuf::from) else {
        println!("skipped: PLIANT_DATA is not set");
        return;
    };
    let mask = |name: &str| {
        format!("masks = [{:?}]", data.join("abdomen-totalseg").join(name).display().to_string())
    };
    let mut organ = pliant_format::OrganScene {
        title: "liver".into(),
        source: format!("{}, clean = {{ keep-largest = true }}, labels = [1]", mask("fast_liver.nii.gz")),
        edge: 0.014,
        vessels: vec![(format!("{}, label = 1", mask("fast_portal_vein_and_splenic_vein.nii.gz")), 1e-3)],
        capsule: Some(1e-4),
        // Bounds of the mask.
        bounds: [Vector3::new(-0.0655, 0.0848, 0.0928), Vector3::new(0.1355, 0.2708, 0.1828)],
    };
    let pulled = |organ: &pliant_format::OrganScene| {
        let text = organ.text().replace("until = 3.0", "until = 0.4").replace("to = 2.0", "to = 0.4");
        let source = pliant_format::source::Source::parse("liver.toml", text).unwrap();
        let mut scene = pliant_format::Scene::from_source(source, ".".into()).unwrap();
        scene.outputs.clear();
        let world = pliant_scene::World::new(&scene).unwrap_or_else(|errors| panic!("{}", errors.plain()));
        let out = tempfile::tempdir().unwrap();
        let folder = pliant_run::OutputFolder::prepare(out.path().to_owned(), &world.scene, false).unwrap();
        let summary = pliant_run::run(&world, &folder, &mut |_| ()).unwrap();
        assert_eq!(summary.status, "done", "{:?}", summary.error);
        let balance = summary.energy_balance.unwrap().abs();
        let force = summary.reactions.iter().find(|(name, _)| name == "pull").unwrap().1;
        println!("{} N, balance {balance:.1e}", dot(force, force).sqrt());
        assert!(balance < 0.01, "{balance}");
        dot(force, force).sqrt()
    };
    let coated = pulled(&organ);
    organ.capsule = None;
    let bare = pulled(&organ);
    claim("a segmented liver: force without its capsule over that in it", bare / coated, 0.5);
}
