//! A run that cannot continue reports the reason.

use pliant_explicit::{CentralDifference, State, StepError};
use pliant_mechanics::curve::{Curve, Shape};
use pliant_mechanics::model::{Constraint, Motion};
use pliant_meshing::VolumeCell;
use pliant_validation::{Hexes, Specimen, Tets, elastic, run, smooth_step, soft_tissue};

#[test]
fn block_pushed_through_itself_names_the_inverted_element() {
    for cells in [VolumeCell::Tet, VolumeCell::Hex] {
        // One end moves through the other within few steps: faster than any wave.
        let curve = Curve { shape: Shape::Ramp, from: 0.0, to: 0.01 };
        let block = Specimen::block([0.1; 3], [3; 3], cells, &elastic(soft_tissue()), [0.0; 3])
            .fix("x-min", [true; 3])
            .shift("x-max", -0.2, curve);
        let failure = run::<f64>(&block.model, 0.5 * block.element_bound(), 0.1, |_, _| ()).err();
        println!("{cells:?}: {failure:?}");
        assert!(matches!(failure, Some(StepError::Inverted { determinant, .. }) if determinant <= 0.0));
    }
}

/// A cube that is glued to two plates which come together turns inside out at the rim.
#[test]
fn a_cube_squeezed_between_glued_plates_fails() {
    let mesh = Specimen::block([0.1; 3], [4; 3], VolumeCell::Hex, &elastic(soft_tissue()), [0.0; 3]).mesh;
    let material = elastic(soft_tissue());
    let mut cube = Specimen::of_elements(mesh, Tets::Plain, Hexes::Full, &material, [0.0; 3])
        .fix("z-min", [true; 3])
        .damped(50.0);
    let motion = Motion::Displacement([0.0, 0.0, -0.095], smooth_step(1.0));
    let (name, nodes) = ("top".into(), cube.face("z-max"));
    cube.model.constraints.push(Constraint { name, nodes, components: [true; 6], motion });
    let step = 0.3 * cube.element_bound();
    let mut stepper = CentralDifference::<f64>::new(cube.model.clone(), step).unwrap();
    let mut state = State::at_rest(&cube.model);
    let failure = loop {
        if let Err(failure) = stepper.evaluate(&mut state) {
            break failure;
        }
        assert!(state.time < 1.0, "the cube is flat, and nothing has been said");
        stepper.advance(&mut state);
    };
    println!("{failure}");
    assert!(matches!(failure, StepError::Inverted { determinant, .. } if determinant <= 0.0));
}
