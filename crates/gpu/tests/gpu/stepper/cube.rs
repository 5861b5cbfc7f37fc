//! A cube of distorted cells, held at its base and moved at its top; and one without any order, deformed at
//! random.

use pliant_mechanics::curve::{Curve, Shape};
use pliant_mechanics::element::Cord;
use pliant_mechanics::law::AnyLaw;
use pliant_mechanics::model::{Averaging, Body, Cells, Constraint, Material, Model, Motion, Solid};
use pliant_mechanics::prony::Prony;
use pliant_mechanics::tensor::Vector;
use pliant_testing::Random;
use serde_json::{Value, json};

/// Every element.
pub const ELEMENTS: [&str; 9] =
    ["tet4", "tet4-anp", "tet4-ianp", "tet4-ianp-niftysim", "hex8", "hex8-full", "membrane", "bar", "thread"];

/// Edge of the cube [m].
pub const EDGE: f64 = 0.1;

/// Cells along an edge.
pub const CELLS: u32 = 4;

/// A law from its name and parameters.
pub fn law(name: &str, parameters: Value) -> AnyLaw {
    AnyLaw::from_json(name, parameters).unwrap()
}

/// Tissue of 1 kPa.
pub fn neo_hookean() -> AnyLaw {
    law("neo-hookean", json!({ "shear-modulus": 1000.0, "bulk-modulus": 5000.0 }))
}

/// A material without relaxation.
pub fn elastic(law: AnyLaw) -> Material {
    Material { law, prony: Prony::default(), density: 1000.0 }
}

fn place(x: u32, y: u32, z: u32) -> u32 {
    (z * (CELLS + 1) + y) * (CELLS + 1) + x
}

/// The nodes of a plane z = const.
pub fn layer(z: u32) -> Vec<u32> {
    (0..=CELLS).flat_map(|y| (0..=CELLS).map(move |x| place(x, y, z))).collect()
}

/// The quads of the top, outward.
pub fn top_quads() -> Vec<[u32; 4]> {
    let quad = |x, y| {
        [place(x, y, CELLS), place(x + 1, y, CELLS), place(x + 1, y + 1, CELLS), place(x, y + 1, CELLS)]
    };
    (0..CELLS).flat_map(|y| (0..CELLS).map(move |x| quad(x, y))).collect()
}

/// A factor that grows smoothly from 0 to 1 until a time [s].
pub fn smooth(to: f64) -> Curve {
    Curve { shape: Shape::SmoothStep, from: 0.0, to }
}

/// A vector in [−½, ½)³.
fn vector(random: &mut Random) -> Vector<f64> {
    [0; 3].map(|_| random.half())
}

fn shuffle<T>(random: &mut Random, items: &mut [T]) {
    (1..items.len()).for_each(|last| items.swap(last, random.below(last + 1)));
}

/// Nodes and hexahedra; inner nodes are shifted by up to half of `jitter` cells.
fn grid(jitter: f64, random: &mut Random) -> (Vec<Vector<f64>>, Vec<[u32; 8]>) {
    let size = EDGE / f64::from(CELLS);
    let triples =
        |end: u32| (0..end).flat_map(move |z| (0..end).flat_map(move |y| (0..end).map(move |x| [x, y, z])));
    let shifted = |at: [u32; 3]| {
        let interior = at.iter().all(|&i| i > 0 && i < CELLS);
        let shift = if interior { vector(random) } else { [0.0; 3] };
        [0, 1, 2].map(|c| (f64::from(at[c]) + jitter * shift[c]) * size)
    };
    let rest = triples(CELLS + 1).map(shifted).collect();
    let hex = |[x, y, z]: [u32; 3]| {
        let low = [place(x, y, z), place(x + 1, y, z), place(x + 1, y + 1, z), place(x, y + 1, z)];
        let [a, b, c, d] = low.map(|node| node + place(0, 0, 1));
        [low[0], low[1], low[2], low[3], a, b, c, d]
    };
    (rest, triples(CELLS).map(hex).collect())
}

/// Kuhn's split: all six tets around the diagonal 0–6.
pub fn tets_of(hexes: &[[u32; 8]]) -> Vec<[u32; 4]> {
    const KUHN: [[usize; 4]; 6] =
        [[0, 1, 2, 6], [0, 2, 3, 6], [0, 3, 7, 6], [0, 7, 4, 6], [0, 4, 5, 6], [0, 5, 1, 6]];
    hexes.iter().flat_map(|hex| KUHN.map(|tet| tet.map(|corner| hex[corner]))).collect()
}

/// A block of `cells` cells of six tetrahedra along each edge, of a size [m] from the origin on.
pub fn tet_block(cells: [u32; 3], size: [f64; 3]) -> (Vec<Vector<f64>>, Vec<[u32; 4]>) {
    let [nx, ny, nz] = cells;
    let triples = |[nx, ny, nz]: [u32; 3]| {
        (0..nz).flat_map(move |z| (0..ny).flat_map(move |y| (0..nx).map(move |x| [x, y, z])))
    };
    let point = |at: [u32; 3]| [0, 1, 2].map(|c| size[c] * f64::from(at[c]) / f64::from(cells[c]));
    let node = |[x, y, z]: [u32; 3]| (z * (ny + 1) + y) * (nx + 1) + x;
    let hex = |[x, y, z]: [u32; 3]| {
        let low = [[x, y, z], [x + 1, y, z], [x + 1, y + 1, z], [x, y + 1, z]];
        let [a, b, c, d] = low.map(|[x, y, z]| node([x, y, z + 1]));
        let [e, f, g, h] = low.map(node);
        [e, f, g, h, a, b, c, d]
    };
    let hexes: Vec<[u32; 8]> = triples([nx, ny, nz]).map(hex).collect();
    (triples([nx + 1, ny + 1, nz + 1]).map(point).collect(), tets_of(&hexes))
}

/// Builds a body of one element type.
fn body(
    element: &str,
    material: Material,
    rest: Vec<Vector<f64>>,
    tets: Vec<[u32; 4]>,
    hexes: Vec<[u32; 8]>,
) -> Model {
    // Walls and bars alone are slack: they buckle, and round-off grows.
    let inside = matches!(element, "membrane" | "bar" | "thread").then(|| Cells::tet4(tets.clone(), &rest));
    let cells = match element {
        "tet4" => Cells::tet4(tets, &rest),
        "tet4-anp" => Cells::averaged_tet4(tets, &rest, Averaging::Nodal),
        "tet4-ianp" => Cells::averaged_tet4(tets, &rest, Averaging::Variational),
        "tet4-ianp-niftysim" => Cells::averaged_tet4(tets, &rest, Averaging::NiftySim),
        "hex8" => Cells::hex8(hexes, &rest, 0.1, material.law.small_strain().shear),
        "growing-hex8" => {
            Cells::hex8(hexes, &rest, 0.1, material.law.small_strain().shear).with_growing_hourglass()
        }
        "hex8-full" => Cells::full_hex8(hexes, &rest),
        "membrane" => {
            // Two sides of each hexahedron, of several thicknesses.
            const SIDES: [[usize; 3]; 4] = [[0, 1, 2], [0, 2, 3], [0, 1, 5], [0, 5, 4]];
            let sides: Vec<[u32; 3]> =
                hexes.iter().flat_map(|hex| SIDES.map(|side| side.map(|corner| hex[corner]))).collect();
            let thickness: Vec<f64> = (0..sides.len()).map(|cell| 0.01 + 0.001 * (cell % 7) as f64).collect();
            Cells::membrane(sides, &rest, &thickness)
        }
        "bar" | "thread" => {
            const SIDES: [[usize; 2]; 4] = [[0, 1], [0, 3], [0, 4], [0, 6]];
            let lines = hexes.iter().flat_map(|hex| SIDES.map(|side| side.map(|corner| hex[corner])));
            Cells::bar(lines.collect(), &rest, 2e-5, Cord { slack: 0.98, tension_only: element == "thread" })
        }
        other => panic!("no element `{other}`"),
    };
    let mut model = Model { mass: vec![0.0; rest.len()], rest, ..Model::default() };
    model.bodies.push(Body {
        name: "cube".into(),
        nodes: 0..model.rest.len() as u32,
        shared: vec![],
        damping: 0.0,
    });
    let families = material.law.families();
    let directions = [[0.6, 0.0, 0.8], [0.0, 0.8, -0.6]];
    let fibre = (0..cells.len()).flat_map(|_| directions[..families].to_vec()).collect();
    let original = (0..cells.len() as u32).collect();
    model.add_solid(Solid { body: 0, material, cells, fibre, original });
    if let Some(cells) = inside {
        model.add_solid(Solid::new(0, elastic(neo_hookean()), cells));
    }
    model
}

/// The cube, free.
pub fn free_cube(element: &str, material: Material) -> Model {
    let (rest, hexes) = grid(0.2, &mut Random::new(7));
    body(element, material, rest, tets_of(&hexes), hexes)
}

/// A cube without any order.
pub struct Jumble {
    /// Model with its base held.
    pub model: Model,
    /// A smooth displacement at random, with strains of up to a fifth.
    pub start: Vec<Vector<f64>>,
    /// The node of each node of the cube in order.
    pub node: Vec<u32>,
}

/// A cube whose inner nodes lie at random, whose nodes and cells are numbered at random, and cells from any
/// of their nodes.
pub fn jumbled_cube(element: &str, material: Material) -> Jumble {
    let mut random = Random::new(11);
    let (ordered, mut hexes) = grid(0.5, &mut random);
    let mut node: Vec<u32> = (0..ordered.len() as u32).collect();
    shuffle(&mut random, &mut node);
    let mut rest = ordered.clone();
    (0..).zip(&node).for_each(|(from, &to): (usize, _)| rest[to as usize] = ordered[from]);
    let mut tets = tets_of(&hexes);
    shuffle(&mut random, &mut tets);
    shuffle(&mut random, &mut hexes);
    for tet in &mut tets {
        // Even permutations keep the volume.
        tet[1..].rotate_left(random.below(3));
        if random.below(2) == 1 {
            *tet = [tet[1], tet[0], tet[3], tet[2]];
        }
        *tet = tet.map(|corner| node[corner as usize]);
    }
    for hex in &mut hexes {
        let turn = random.below(4);
        hex[..4].rotate_left(turn);
        hex[4..].rotate_left(turn);
        *hex = hex.map(|corner| node[corner as usize]);
    }
    let start = deformation(&rest, &mut random);
    let mut model = body(element, material, rest, tets, hexes);
    let nodes = layer(0).iter().map(|&base| node[base as usize]).collect();
    let (name, components) = ("base".into(), [true; 6]);
    model.constraints.push(Constraint { name, nodes, components, motion: Motion::Fixed });
    Jumble { model, start, node }
}

/// (z/L) Σ a sin(k·X + φ) over some waves with lengths of the cube's size, such that the largest ‖sym ∇u‖ is
/// 0.2.
fn deformation(places: &[Vector<f64>], random: &mut Random) -> Vec<Vector<f64>> {
    let wave =
        |_| (vector(random), vector(random).map(|k| 2.0 * k * std::f64::consts::TAU / EDGE), random.half());
    let waves: Vec<_> = (0..5).map(wave).collect();
    let field = |x: Vector<f64>| {
        let mut u = [0.0; 3];
        for (a, k, phase) in &waves {
            let sine = (k[0] * x[0] + k[1] * x[1] + k[2] * x[2] + phase * std::f64::consts::TAU).sin();
            (0..3).for_each(|c| u[c] += x[2] / EDGE * a[c] * sine);
        }
        u
    };
    let strain = |&x: &Vector<f64>| {
        let h = 1e-6 * EDGE;
        let mut gradient = [[0.0; 3]; 3];
        for d in 0..3 {
            let (mut low, mut high) = (x, x);
            (low[d], high[d]) = (x[d] - h, x[d] + h);
            let (low, high) = (field(low), field(high));
            (0..3).for_each(|c| gradient[c][d] = (high[c] - low[c]) / (2.0 * h));
        }
        let symmetric = |c: usize, d: usize| 0.5 * (gradient[c][d] + gradient[d][c]);
        (0..9).map(|i| symmetric(i / 3, i % 3).powi(2)).sum::<f64>().sqrt()
    };
    let largest = places.iter().map(strain).fold(0.0, f64::max);
    places.iter().map(|&x| field(x).map(|u| 0.2 / largest * u)).collect()
}

/// The cube with its base held.
pub fn held_cube(element: &str, material: Material) -> Model {
    let mut model = free_cube(element, material);
    let (name, components) = ("base".into(), [true; 6]);
    model.constraints.push(Constraint { name, nodes: layer(0), components, motion: Motion::Fixed });
    model
}

/// The cube with its base held and its top moved aside and down by up to a fifth.
pub fn moved_cube(element: &str, material: Material) -> Model {
    let mut model = held_cube(element, material);
    let motion = Motion::Displacement([0.1 * EDGE, 0.05 * EDGE, -0.2 * EDGE], smooth(0.2));
    model.constraints.push(Constraint {
        name: "top".into(),
        nodes: layer(CELLS),
        components: [true; 6],
        motion,
    });
    model
}

/// Every law, with a choice of volumetric energies.
pub fn every_law() -> Vec<AnyLaw> {
    let matrix = |extra: Value| merged(json!({ "shear-modulus": 700.0, "bulk-modulus": 5000.0 }), extra);
    let bulk = |extra: Value| merged(json!({ "bulk-modulus": 5000.0 }), extra);
    let laws = vec![
        ("neo-hookean", matrix(json!({ "volumetric": "quad-log" }))),
        ("coupled-neo-hookean", matrix(json!({}))),
        ("logarithmic-neo-hookean", matrix(json!({}))),
        ("st-venant-kirchhoff", matrix(json!({}))),
        ("corotational", matrix(json!({}))),
        ("mooney-rivlin", bulk(json!({ "c10": 300.0, "c01": 150.0, "volumetric": "ln-squared" }))),
        ("polynomial", bulk(json!({ "c10": 300.0, "c01": 100.0, "c20": 50.0, "c11": 30.0, "c02": 20.0 }))),
        ("yeoh", bulk(json!({ "c1": 300.0, "c2": 100.0, "c3": 50.0, "volumetric": "j-ln-j" }))),
        ("arruda-boyce", bulk(json!({ "shear-modulus": 700.0, "locking-stretch": 1.8 }))),
        ("gent", matrix(json!({ "limit": 4.0 }))),
        ("demiray", matrix(json!({ "exponent": 2.0 }))),
        ("veronda-westmann", bulk(json!({ "c1": 250.0, "c2": 1.5 }))),
        ("ogden", bulk(json!({ "terms": [term(500.0, 2.5), term(200.0, -3.0)] }))),
        ("transversely-isotropic", matrix(json!({ "fibre-modulus": 1100.0 }))),
        ("orthotropic", matrix(json!({ "e4": 1100.0, "e5": 300.0, "e6": 600.0, "e7": 200.0 }))),
        (
            "holzapfel-gasser-ogden",
            matrix(
                json!({ "fibre-modulus": 900.0, "fibre-exponent": 0.8, "dispersion": 0.12, "families": 2 }),
            ),
        ),
        (
            "fung-orthotropic",
            bulk(json!({
                "modulus": 400.0, "normal": [[1.2, 0.3, 0.25], [0.3, 0.9, 0.2], [0.25, 0.2, 0.7]],
                "shear": [0.8, 0.6, 0.5], "axes": [[0.6, 0.8, 0.0], [-0.8, 0.6, 0.0], [0.0, 0.0, 1.0]]
            })),
        ),
    ];
    assert_eq!(laws.iter().map(|(name, _)| *name).collect::<Vec<_>>(), AnyLaw::NAMES);
    laws.into_iter().map(|(name, parameters)| law(name, parameters)).collect()
}

fn merged(mut parameters: Value, extra: Value) -> Value {
    let (Value::Object(table), Value::Object(extra)) = (&mut parameters, extra) else {
        panic!("not a table")
    };
    table.extend(extra);
    parameters
}

fn term(modulus: f64, exponent: f64) -> Value {
    json!({ "shear-modulus": modulus, "exponent": exponent })
}
