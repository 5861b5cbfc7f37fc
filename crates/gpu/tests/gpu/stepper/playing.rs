//! Tests for windows: bodies that are held by hand, steps without a look, and points that never leave the
//! device.

use std::time::Duration;

use pliant_explicit::Wanted;
use pliant_explicit::{CentralDifference, Observable, State};
use pliant_gpu::{Design, PointValue};
use pliant_mechanics::grip::Grip;
use pliant_mechanics::mapping::{Displaced, Mapping};
use pliant_mechanics::model::Model;

use super::against::{designs, distance, double, step_of, stepper};
use super::cube::{elastic, moved_cube, neo_hookean};
use crate::support;

const LONG: Duration = Duration::from_secs(100);

/// The nodes of a model displaced by some lengths [m].
fn displaced<'a>(model: &'a Model, displacement: &'a [[f64; 3]]) -> Displaced<'a, f64> {
    Displaced { rest: &model.rest, displacement, velocity: &[] }
}

/// A hand at a free node and one that is held in part or whole, and a pin.
fn grips(model: &Model, step: f64) -> Vec<Grip> {
    let last = model.node_count() as u32 - 1;
    let nodes = [vec![(last, 0.25), (last / 2, 0.75)], vec![(0, 0.5), (last - 1, 0.3), (last - 7, 0.2)]];
    (nodes.into_iter().zip([[1e-3, -2e-3, 3e-3], [0.0; 3]]))
        .map(|(nodes, by)| {
            let mut grip = Grip { nodes, ..Grip::default() };
            let rest = vec![[0.0; 3]; model.node_count()];
            let nodes = displaced(model, &rest);
            grip.stiffness = 0.1 * grip.stiffest(&nodes, model, step);
            let point = grip.position(&nodes, 0);
            grip.place = [0, 1, 2].map(|c| point[c] + by[c]);
            grip
        })
        .collect()
}

#[test]
fn grips_pull_as_on_the_processor_in_every_design_and_let_go() {
    let Some(device) = support::device() else { return };
    let model = moved_cube("tet4", elastic(neo_hookean()));
    let step = step_of(&model);
    let held = grips(&model, step);
    let mut reference = State::<f64>::at_rest(&model);
    let mut processor = CentralDifference::new(model.clone(), step).unwrap();
    let mut go = |grips: &[Grip], steps: u64| {
        processor.grip(grips);
        // An instant is evaluated once, or its work would be entered twice.
        if reference.is_at_start() {
            processor.evaluate(&mut reference).unwrap();
        }
        for _ in 0..steps {
            processor.advance(&mut reference);
            processor.evaluate(&mut reference).unwrap();
        }
        let reactions: Vec<_> = (0..model.constraints.len()).map(|c| processor.reaction(c)).collect();
        (reference.displacement.clone(), reactions, *processor.energies())
    };
    // After the second look the grips act one step later, on both.
    let expected = [go(&held, 150), go(&held[..1], 100), go(&[], 100)];
    for design in designs(&device) {
        let mut state = State::<f32>::at_rest(&model);
        let mut stepper = stepper(&device, &model, step, design);
        let phases = [(&held[..], 150), (&held[..1], 100), (&[], 100)];
        for ((grips, steps), (displacement, reactions, energies)) in phases.into_iter().zip(&expected) {
            stepper.grip(grips).unwrap();
            stepper.advance(&mut state, steps).unwrap();
            stepper.evaluate(&mut state, Wanted::Everything).unwrap();
            let moved = distance(displacement, &double(&state.displacement));
            let found: Vec<_> = (0..model.constraints.len()).map(|c| stepper.reaction(c)).collect();
            let reaction = distance(reactions, &found);
            let work = (stepper.energies().external - energies.external).abs() / energies.external.abs();
            println!("{design}: displacement {moved:.1e}, reactions {reaction:.1e}, work {work:.1e}");
            assert!(moved <= 1e-5, "{design}: displacements are off by {moved:.1e}");
            assert!(reaction <= 1e-4, "{design}: reactions are off by {reaction:.1e}");
            assert!(work <= 1e-4, "{design}: external work is off by {work:.1e}");
            for grip in grips {
                let force = |displacement: &[[f64; 3]]| grip.force(&displaced(&model, displacement));
                let off = distance(&[force(displacement)], &[force(&double(&state.displacement))]);
                assert!(off <= 1e-4, "{design}: the force of a grip is off by {off:.1e}");
            }
        }
    }
}

#[test]
fn many_grips_are_as_many_as_asked_for() {
    let Some(device) = support::device() else { return };
    let model = moved_cube("hex8", elastic(neo_hookean()));
    let mut stepper = stepper(&device, &model, step_of(&model), Design::Blocks);
    let one = grips(&model, step_of(&model)).remove(1);
    let mut state = State::<f32>::at_rest(&model);
    for count in [1, 300, 2] {
        let grip = Grip { stiffness: one.stiffness / f64::from(count), ..one.clone() };
        stepper.grip(&vec![grip; count as usize]).unwrap();
        stepper.advance(&mut state, 5).unwrap();
    }
}

#[test]
fn steps_without_a_look_have_the_bits_of_those_with_and_read_nothing_back() {
    let Some(device) = support::device() else { return };
    let model = moved_cube("hex8", elastic(neo_hookean()));
    let step = step_of(&model);
    for design in [Design::Gather, Design::Blocks] {
        let (mut looked, mut advanced) = (State::<f32>::at_rest(&model), State::<f32>::at_rest(&model));
        let mut one = stepper(&device, &model, step, design);
        let mut other = stepper(&device, &model, step, design);
        other.evaluate(&mut advanced, Wanted::Energies).unwrap();
        for steps in [1, 2, 150, 7] {
            one.advance(&mut looked, steps).unwrap();
            let before = device.read_backs();
            let mut left = steps;
            while left > 0 {
                left -= other.advance_without_read_back(&mut advanced, left, LONG).unwrap();
            }
            assert_eq!(device.read_backs(), before, "{design}: something came back");
            assert_eq!(looked.time, advanced.time);
        }
        one.evaluate(&mut looked, Wanted::Everything).unwrap();
        other.evaluate(&mut advanced, Wanted::Everything).unwrap();
        assert_eq!(looked.displacement, advanced.displacement, "{design}");
        assert_eq!(looked.increment, advanced.increment, "{design}");
        let (a, b) = (one.energies(), other.energies());
        assert!((a.external - b.external).abs() <= 1e-5 * a.external.abs(), "{design}: {a:?} {b:?}");
        assert!((a.internal - b.internal).abs() <= 1e-5 * a.internal.abs(), "{design}: {a:?} {b:?}");
    }
}

#[test]
fn points_on_the_device_are_those_of_the_state() {
    let Some(device) = support::device() else { return };
    let model = moved_cube("tet4", elastic(neo_hookean()));
    let mut stepper = stepper(&device, &model, step_of(&model), Design::Blocks);
    let nodes = |point: usize| vec![(point as u32, 0.25), ((point as u32 * 7) % 50, 0.75)];
    let rest = |point: usize| {
        nodes(point)
            .iter()
            .fold([0.0; 3], |sum, &(n, w)| [0, 1, 2].map(|c| sum[c] + w * model.rest[n as usize][c]))
    };
    let count = model.node_count();
    let mapping = stepper.map((0..count).map(|point| (rest(point), nodes(point)))).unwrap();
    let mut state = State::<f32>::at_rest(&model);
    for (steps, value) in [
        (1, PointValue::Size),
        (2, PointValue::Component(1)),
        (30, PointValue::Given),
        (31, PointValue::Size),
    ] {
        stepper.advance_without_read_back(&mut state, steps, LONG).unwrap();
        mapping.give(&vec![7.0; count]);
        stepper.apply(&mapping, value);
        let drawn = mapping.points().read().unwrap();
        stepper.evaluate(&mut state, Wanted::Everything).unwrap();
        let moved = |point: usize| {
            nodes(point).iter().fold([0.0_f32; 3], |sum, &(n, w)| {
                [0, 1, 2].map(|c| sum[c] + w as f32 * state.displacement[n as usize][c])
            })
        };
        assert_eq!(drawn.len(), count);
        for (point, drawn) in drawn.iter().enumerate() {
            let (place, u) = (rest(point), moved(point));
            for c in 0..3 {
                assert!((f64::from(drawn[c]) - place[c] - f64::from(u[c])).abs() < 1e-6);
            }
            let size = u.iter().map(|u| u * u).sum::<f32>().sqrt();
            let expected = match value {
                PointValue::Component(c) => u[usize::from(c)],
                PointValue::Size => size,
                PointValue::Given => 7.0,
            };
            assert!((drawn[3] - expected).abs() <= 1e-6 * size.max(expected.abs()), "{drawn:?} {expected}");
        }
    }
}
