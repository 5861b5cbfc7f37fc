//! A run that cannot go on says what happened.

use pliant_mechanics::StepError;
use pliant_mechanics::curve::{Curve, Shape};
use pliant_meshing::VolumeCell;
use pliant_validation::{Specimen, elastic, run, soft_tissue};

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
