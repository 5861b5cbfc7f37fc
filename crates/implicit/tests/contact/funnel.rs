//! A soft ball pushed through a funnel and a tube that is narrower than it (S8).

use std::sync::Arc;

use nalgebra::Vector3;
use pliant_contact::barrier::BarrierSettings;
use pliant_contact::pose::{Pose, Trajectory};
use pliant_contact::profile::{Corner, Profile};
use pliant_contact::shape::Shape;
use pliant_implicit::AssemblySolver;
use pliant_implicit::{Assembly, AssemblyState, BackwardEuler, DynamicSettings};
use pliant_mechanics::curve::{Curve, Shape as CurveShape};
use pliant_mechanics::law::{AnyLaw, NeoHookean, Volumetric};
use pliant_mechanics::model::{Cells, Material, Solid};
use pliant_testing::ball_of_hexes;

use super::{at_rigid, rigid, surface, touch};

const RADIUS: f64 = 0.01;
const YOUNG: f64 = 2e4;
/// Radius [m] of the tube.
const BORE: f64 = 0.008;

/// The ball is longer than it was by a tenth while it is in the tube, comes out, and has its shape back to 2
/// %.
#[test]
fn a_ball_goes_through_a_narrow_tube_and_is_round_again() {
    let (points, hexes) = ball_of_hexes(RADIUS, 2, 1);
    let up = Vector3::new(0.0, 0.0, 0.012);
    let mut model = Assembly::new("ball", points.iter().map(|&x| Vector3::from(x) + up));
    let shear = YOUNG / 2.6;
    let law = NeoHookean { shear, volumetric: Volumetric::quadratic(YOUNG / 1.2) };
    let cells = Cells::full_hex8(hexes.clone(), &model.rest);
    model
        .add_solid("ball", Solid::new(0, Material::elastic(AnyLaw::NeoHookean(law), 1000.0), cells))
        .unwrap();
    model.model_mut().bodies[0].damping = 10.0;
    const SIDES: [[usize; 4]; 6] =
        [[0, 3, 2, 1], [4, 5, 6, 7], [0, 1, 5, 4], [1, 2, 6, 5], [2, 3, 7, 6], [3, 0, 4, 7]];
    let is_outer = |node: u32| (Vector3::from(points[node as usize]).norm() - RADIUS).abs() < 1e-9;
    let sides = hexes.iter().flat_map(|hex| SIDES.map(|side| side.map(|k| hex[k])));
    let outer = sides.filter(|side| side.iter().all(|&node| is_outer(node)));
    let skin = surface(outer.flat_map(|[a, b, c, d]| [[a, b, c], [a, c, d]]).collect());
    let corners = [
        ([-0.1, 0.03], 0.0),
        ([-0.045, 0.03], 0.002),
        ([-0.04, BORE], 0.004),
        ([0.0, BORE], 0.01),
        ([0.02, 0.02], 0.0),
    ];
    let profile = Profile::new(corners.map(|(at, rounding)| Corner { at, rounding }).to_vec()).unwrap();
    let mut funnel = rigid("funnel", Shape::Revolved(Arc::new(profile)), Trajectory::fixed(Pose::identity()));
    funnel.inside = true;
    let upside_down = Pose::new(Vector3::z() * (0.012 + 1.02 * RADIUS), Vector3::x() * std::f64::consts::PI);
    let ramp = Curve { shape: CurveShape::Ramp, from: 0.0, to: 0.7 };
    let plunger = rigid("plunger", Shape::HalfSpace, Trajectory::by(upside_down, [0.0, 0.0, -0.07], ramp));
    let barrier = BarrierSettings { distance: 1e-4, stiffness: 0.1 * YOUNG, creep_speed: 1e-3 };
    touch(&mut model, at_rigid(&skin, vec![funnel, plunger], 0.1, 0.0), barrier);
    let settings = DynamicSettings { iterations: 200, ..DynamicSettings::new(0.01) };
    let mut solver = BackwardEuler::new(model.clone(), settings).unwrap();
    let mut state = AssemblyState::at_rest(&model);
    // How much longer or shorter an edge has become at most.
    let stretched = |state: &AssemblyState| {
        let ends =
            [[0, 1], [1, 2], [2, 3], [3, 0], [4, 5], [5, 6], [6, 7], [7, 4], [0, 4], [1, 5], [2, 6], [3, 7]];
        let edges =
            hexes.iter().flat_map(|hex| ends.map(|[a, b]: [usize; 2]| [hex[a] as usize, hex[b] as usize]));
        let change = edges.map(|[a, b]| {
            (state.position[a] - state.position[b]).norm() / (model.place(a) - model.place(b)).norm() - 1.0
        });
        change.fold(0.0_f64, |most, strain| most.max(strain.abs()))
    };
    let (mut most, mut iterations, mut halved, mut least) = (0.0_f64, 0, 0, f64::INFINITY);
    while state.time < 1.0 - 1e-9 {
        let done = solver.advance(&mut state).unwrap_or_else(|error| panic!("at {} s: {error}", state.time));
        iterations += done.residuals.len();
        halved += usize::from(done.parts > 1);
        most = most.max(stretched(&state));
        least = least.min(solver.contact().unwrap().now().gap.unwrap_or(f64::INFINITY));
    }
    let lowest = state.position.iter().map(|x| x.z).fold(f64::NEG_INFINITY, f64::max);
    let left = stretched(&state);
    println!(
        "{iterations} iterations in 100 steps, {halved} halved, least gap {:.2} um; edges change by up to {most:.3}, at the end by {left:.4}; the top of the ball is at {lowest:.3} m",
        1e6 * least
    );
    assert!(most > 0.1 && lowest < -0.045 && left < 0.02, "{most} {lowest} {left}");
    assert!(least > 0.0, "{least}");
}
