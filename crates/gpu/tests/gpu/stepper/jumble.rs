//! Every law, element and load on meshes without any order, deformed at random, in the designs that run
//! blocks and in the plain one.

use pliant_gpu::Design;
use pliant_mechanics::curve::{Curve, Shape};
use pliant_mechanics::load::{Face, Load, LoadKind, NO_NODE};
use pliant_mechanics::mapping::Weights;
use pliant_mechanics::model::Surface;

use super::against::{PLAIN, compare_from, designs, load, step_of};
use super::cube::{CELLS, Jumble, elastic, every_law, jumbled_cube, layer, neo_hookean, top_quads};
use crate::support;

/// Designs that differ most from each other.
const EACH: &[Design] = &[Design::Gather, Design::Blocks, Design::Fast];

fn compare(
    device: &pliant_gpu::Device,
    what: &str,
    Jumble { model, start, .. }: &Jumble,
    designs: &[Design],
) {
    // Laws that stiffen have smaller stable steps where they are deformed.
    compare_from(device, what, (model, start), 0.5 * step_of(model), designs);
}

#[test]
fn every_law_on_every_kind_of_element() {
    let Some(device) = support::device() else { return };
    for law in every_law() {
        for element in ["tet4", "tet4-anp", "hex8"] {
            if element != "tet4-anp" || law.has_volumetric_energy() {
                let what = format!("{} on {element}", law.name());
                // A law meets an element in the same lines whatever the design, so that one element will do
                // for the others.
                let designs = if element == "tet4" { EACH } else { PLAIN };
                compare(&device, &what, &jumbled_cube(element, elastic(law)), designs);
            }
        }
    }
}

/// Quads, or two triangles for each quad.
fn top(cube: &Jumble, triangles: bool) -> Vec<Face> {
    let halves = |[a, b, c, d]: Face| vec![[a, b, c, NO_NODE], [a, c, d, NO_NODE]];
    let quads = top_quads().into_iter().map(|quad| quad.map(|corner| cube.node[corner as usize]));
    quads.flat_map(|quad| if triangles { halves(quad) } else { vec![quad] }).collect()
}

fn pull(cube: &Jumble, force: f64) -> LoadKind {
    let nodes = layer(CELLS).into_iter().map(|node| cube.node[node as usize]);
    LoadKind::Forces(nodes.map(|node| (node, [0.5 * force, 0.0, force])).collect())
}

#[test]
fn every_load() {
    let Some(device) = support::device() else { return };
    let cube = || jumbled_cube("tet4", elastic(neo_hookean()));
    let pressure = |triangles| LoadKind::Pressure { faces: top(&cube(), triangles), pressure: 300.0 };
    let acceleration = [2.0, 0.0, -9.81];
    let gravity = || LoadKind::Gravity { body: 0, acceleration };
    let cases = [
        ("gravity", gravity()),
        ("forces", pull(&cube(), 4e-2)),
        ("pressure on quads", pressure(false)),
        ("pressure on triangles", pressure(true)),
    ];
    for (what, kind) in cases {
        let mut cube = cube();
        cube.model.loads.push(load(what, kind, None));
        compare(&device, what, &cube, EACH);
    }
    // A surface of the nodes of the top, each carried half by the node below.
    let mut cube = cube();
    let mut below = cube.node.clone();
    for (upper, &node) in cube.node.iter().enumerate() {
        below[node as usize] = cube.node[upper.saturating_sub(layer(0).len())];
    }
    let rows: Vec<[(u32, f64); 2]> =
        (0..).zip(below).map(|(node, below)| [(node, 0.5), (below, 0.5)]).collect();
    let mapping = Weights::from_rows(rows.iter().map(<[_; 2]>::as_slice));
    let rest = mapping.apply(&cube.model.rest);
    cube.model.surfaces.push(Surface { name: "skin".into(), body: 0, rest, mapping });
    let pulling = pull(&cube, 4e-2);
    cube.model.loads = vec![
        load("gravity", gravity(), None),
        load("press", pressure(false), Some(0)),
        load("also", pressure(true), Some(0)),
        load("pull", pulling, Some(0)),
    ];
    compare(&device, "all at once on a carried surface", &cube, &designs(&device).collect::<Vec<_>>());
}

#[test]
fn a_load_without_limit_does_nothing_while_its_factor_is_zero() {
    let Some(device) = support::device() else { return };
    let mut cube = jumbled_cube("tet4", elastic(neo_hookean()));
    let pressure = LoadKind::Pressure { faces: top(&cube, false), pressure: f64::INFINITY };
    let curve = Curve { shape: Shape::Table(vec![(0.0, 0.0), (1.0, 0.0)]), from: 0.0, to: 0.0 };
    for (name, kind) in [("pull", pull(&cube, f64::INFINITY)), ("press", pressure)] {
        cube.model.loads.push(Load { curve: curve.clone(), ..load(name, kind, None) });
    }
    compare(&device, "loads without limit", &cube, EACH);
}
