//! Things so thin or so fast that a step could pass through them.

use std::sync::Arc;

use pliant_contact::pose::{Pose, Trajectory};
use pliant_contact::shape::Shape;
use pliant_contact::touch::Rigid;
use pliant_explicit::{Observable, State};
use pliant_mechanics::curve::{Curve, Shape as CurveShape};
use pliant_mechanics::prony::Prony;

use super::rigid::at;
use super::{block, stepper};

/// A block flies against sheets of 1 mm to 10 µm, by up to 60 of their thicknesses in a step. All of it stays
/// on its side (S5).
#[test]
fn a_fast_body_does_not_pass_through_a_thin_sheet() {
    for (thickness, speed) in [(1e-3, 1.0), (1e-4, 1.0), (1e-5, 1.0), (1e-5, 0.1)] {
        let mut model = block([3, 3, 3], 0.01, 2e3, Prony::default());
        model.initial_velocity = vec![[0.0, 0.0, -speed]; model.node_count()];
        let shape = Shape::Cuboid { size: [0.2, 0.2, thickness] };
        let trajectory = Trajectory::fixed(Pose::translation(0.015, 0.015, -0.0002 - 0.5 * thickness));
        let sheet = Rigid { name: "sheet".into(), shape, trajectory, inside: false, jaw: None };
        let contacts = at(sheet, &model, 0.0);
        let model = Arc::new(model);
        let mut stepper = stepper(&model, &contacts, 0.5);
        let mut state = State::at_rest(&model);
        let (mut lowest, mut impulse) = (f64::INFINITY, 0.0);
        while state.time < 0.06 {
            stepper.evaluate(&mut state).unwrap();
            impulse -= stepper.contact_forces()[0][2] * stepper.step();
            stepper.advance(&mut state);
            let heights = state.displacement.iter().zip(&model.rest).map(|(u, x)| u[2] + x[2] + 0.0002);
            lowest = heights.fold(lowest, f64::min);
        }
        let momentum = speed * model.mass.iter().sum::<f64>();
        println!(
            "sheet of {thickness} m at {speed} m/s, {:.1} thicknesses in a step: lowest {lowest:.1e} m, impulse {:.3} of the momentum",
            speed * stepper.step() / thickness,
            impulse / momentum
        );
        assert!(lowest > -1e-9 && impulse > momentum, "{lowest:.1e} {impulse}");
    }
}

/// A ball of 1 mm shoots through a block by up to 200 mm in a step. It takes the node in its way along: the
/// node is never behind it.
#[test]
fn a_fast_thin_tool_passes_over_no_node() {
    let model = Arc::new(block([2, 2, 1], 0.01, 2e3, Prony::default()));
    let middle = [0.01; 3];
    let in_the_way = model.rest.iter().position(|x| (0..3).all(|c| (x[c] - middle[c]).abs() < 1e-9)).unwrap();
    for speed in [10.0, 100.0, 400.0] {
        let time = 0.02 / speed + 2e-4;
        let curve = Curve { shape: CurveShape::Ramp, from: 0.0, to: time };
        let trajectory =
            Trajectory::by(Pose::translation(0.01, 0.01, 0.0115), [0.0, 0.0, -speed * time], curve);
        let (radius, name) = (1e-3, "tool".into());
        let tool = Rigid { name, shape: Shape::Sphere { radius }, trajectory, inside: false, jaw: None };
        let mut stepper = stepper(&model, &at(tool.clone(), &model, 0.0), 0.1);
        let mut state = State::at_rest(&model);
        stepper.evaluate(&mut state).unwrap();
        stepper.advance(&mut state);
        let tip = tool.trajectory.at(state.time).translation.vector.z - radius;
        let height = middle[2] + state.displacement[in_the_way][2];
        let way = speed * stepper.step();
        println!("{speed} m/s, {way:.3} m in a step: tip at {tip:.4} m, node at {height:.4} m");
        assert!(height < tip + 1e-9, "{height} {tip}");
    }
}
