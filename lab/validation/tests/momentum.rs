//! Momentum, angular momentum and free fall of a free body: exact in the central difference method, to
//! round-off.

use pliant_explicit::State;
use pliant_explicit::recover::Recovery;
use pliant_mechanics::curve::{Curve, Shape};
use pliant_mechanics::load::LoadKind;
use pliant_mechanics::tensor::{Vector, add, cross, dot, scale, sub};
use pliant_meshing::VolumeCell;
use pliant_validation::{Specimen, claim, elastic, largest, run, soft_tissue};

const ELEMENTS: [VolumeCell; 2] = [VolumeCell::Tet, VolumeCell::Hex];

fn block(cells: VolumeCell) -> Specimen {
    Specimen::block([0.1, 0.06, 0.08], [4, 3, 4], cells, &elastic(soft_tissue()), [0.0; 3])
}

fn length(v: Vector<f64>) -> f64 {
    dot(v, v).sqrt()
}

/// Momentum [kg m/s] and angular momentum [kg m²/s] half a step before the state.
fn momenta(block: &Specimen, state: &State<f64>, step: f64) -> [Vector<f64>; 2] {
    let mut sums = [[0.0; 3]; 2];
    for (node, &mass) in block.model.mass.iter().enumerate() {
        let momentum = scale(state.increment[node], mass / step);
        let place = add(block.model.rest[node], state.displacement[node]);
        sums = [add(sums[0], momentum), add(sums[1], cross(place, momentum))];
    }
    sums
}

#[test]
fn struck_body_takes_up_the_impulse_and_keeps_momentum_and_angular_momentum() {
    for cells in ELEMENTS {
        let block = block(cells);
        let step = 0.8 * block.element_bound();
        // A triangle of force in time, with its peak of 0.4 N after 10 steps and its end after 20. Its
        // corners lie on steps, so that the method's trapezoidal rule integrates it exactly.
        let [rise, end] = [10.0 * step, 20.0 * step];
        let curve =
            Curve { shape: Shape::Table(vec![(0.0, 0.0), (rise, 1.0), (end, 0.0)]), from: 0.0, to: end };
        let force = [0.1, 0.2, -0.33];
        let corner = block.node_at([0.1, 0.06, 0.0]) as u32;
        let block = block.loaded(LoadKind::Forces(vec![(corner, force)]), curve);
        let impulse = scale(force, 10.0 * step);

        let mut after: Option<[Vector<f64>; 2]> = None;
        let mut drift = [0.0; 2];
        let (_, state) = run::<f64>(&block.model, step, 0.5, |_, state| {
            if state.steps > 21 {
                let now = momenta(&block, state, step);
                let first = *after.get_or_insert(now);
                drift = [0, 1].map(|k| largest([drift[k], length(sub(now[k], first[k])) / length(first[k])]));
            }
        })
        .unwrap();
        let [momentum, _] = after.unwrap();
        claim(
            &format!("{cells:?}: momentum off the impulse"),
            length(sub(momentum, impulse)) / length(impulse),
            1e-12,
        );
        // Round-off of some hundred nodes over a thousand steps.
        claim(&format!("{cells:?}: drift of momentum over {} steps", state.steps), drift[0], 1e-11);
        claim(&format!("{cells:?}: drift of angular momentum"), drift[1], 1e-11);
    }
}

#[test]
fn body_in_free_fall_moves_by_half_g_t_squared_without_strain() {
    let g = [1.0, -2.0, -9.81];
    for cells in ELEMENTS {
        let block = block(cells).falling(g);
        let (mut off, mut strain) = (0.0, 0.0);
        run::<f64>(&block.model, 0.9 * block.element_bound(), 0.4, |_, state| {
            let fallen = scale(g, 0.5 * state.time * state.time);
            let worst = largest(state.displacement.iter().map(|&u| length(sub(u, fallen))));
            off = largest([off, worst / length(fallen).max(1e-6)]);
            let cells = 0..block.model.solids[0].cells.len();
            let recovery = Recovery::new(&block.model, state);
            let fields = cells.map(|cell| recovery.cell(0, cell).green_strain.0);
            strain = largest(fields.flatten().map(f64::abs).chain([strain]));
        })
        .unwrap();
        // Round-off: hundreds of increments, each exact to 1e-16.
        claim(&format!("{cells:?}: off ½ g t², relative"), off, 1e-12);
        claim(&format!("{cells:?}: strain"), strain, 1e-12);
    }
}
