//! Two cards that lean on each other stand by the friction of the floor (S3).

use nalgebra::Vector3;
use pliant_contact::barrier::BarrierSettings;
use pliant_contact::pose::Pose;
use pliant_contact::shape::Shape;
use pliant_contact::touch::{Contact, Contacts, Touch, With};
use pliant_implicit::{Assembly, AssemblyState, BackwardEuler, DynamicSettings};
use pliant_mechanics::law::{AnyLaw, NeoHookean, Volumetric};
use pliant_mechanics::load::Load;
use pliant_mechanics::model::{Cells, Material, Solid};
use pliant_testing::pieces::Piece;

use super::{fixed, surface, touch};

const LENGTH: f64 = 0.04;
const THICKNESS: f64 = 2e-3;
const YOUNG: f64 = 1e7;
/// The lean of a card against the upright [rad].
const LEAN: f64 = std::f64::consts::FRAC_PI_6;

/// Distance [m] that the top has come down after half a second.
fn sunk(friction: f64) -> f64 {
    let barrier = 1e-4;
    let mut model = Assembly::default();
    let (sine, cosine) = LEAN.sin_cos();
    let mut surfaces = Vec::new();
    for side in [-1.0, 1.0] {
        // The corners that meet are 0.8 of the barrier's gap apart, and so is the lower inner corner from the
        // floor.
        let x = side * (0.5 * THICKNESS * cosine + 0.4 * barrier);
        let z = LENGTH * cosine + 0.5 * THICKNESS * sine + 0.8 * barrier;
        let at = Pose::new(Vector3::new(x, 0.0, z), Vector3::y() * (-side * LEAN));
        let piece = Piece { size: [THICKNESS, 0.02, LENGTH], cells: [1, 2, 8], ..Piece::cube(at) };
        let body = piece.tets(model.rest.len() as u32);
        let number = model.add_body("card", body.points.iter().map(|&x| x.into()));
        let law = NeoHookean { shear: YOUNG / 2.6, volumetric: Volumetric::quadratic(YOUNG / 1.2) };
        let cells = Cells::tet4(body.tets, &model.rest);
        model
            .add_solid("card", Solid::new(number, Material::elastic(AnyLaw::NeoHookean(law), 1000.0), cells))
            .unwrap();
        model.model_mut().loads.push(Load::gravity(number, [0.0, 0.0, -9.81]));
        surfaces.push(surface(body.faces));
    }
    let settings = Touch { friction, offset: 0.0 };
    let contact = |card: usize, with| Contact {
        name: "touch".into(),
        surface: surfaces[card].clone(),
        with,
        touch: settings,
    };
    let contacts = vec![
        contact(0, With::Body(surfaces[1].clone())),
        contact(0, With::Rigid(0)),
        contact(1, With::Rigid(0)),
    ];
    let floor = fixed("floor", Shape::HalfSpace, [0.0; 3], [0.0; 3]);
    let barrier = BarrierSettings { distance: barrier, stiffness: 1e4, creep_speed: 1e-3 };
    touch(&mut model, Contacts { rigids: vec![floor], contacts, ..Default::default() }, barrier);
    let settings = DynamicSettings { iterations: 200, ..DynamicSettings::new(5e-3) };
    let mut solver = BackwardEuler::new(model.clone(), settings).unwrap();
    let mut state = AssemblyState::at_rest(&model);
    let top = |state: &AssemblyState| state.position.iter().map(|x| x.z).fold(0.0, f64::max);
    let start = top(&state);
    let mut iterations = 0;
    while state.time < 0.5 - 1e-9 {
        let done = solver.advance(&mut state).unwrap_or_else(|error| panic!("at {} s: {error}", state.time));
        iterations += done.residuals.len();
    }
    let sunk = start - top(&state);
    println!("mu {friction}: the top is {:.3} mm lower after {iterations} iterations", 1e3 * sunk);
    sunk
}

/// Each card of weight W is pushed apart by H = W/2 (tan α − t/L), which the floor holds by μ W: 0.264 is the
/// limit here. The weight per length bends the cards by less than 1 µm.
#[test]
fn a_house_of_cards_stands_by_friction() {
    let limit = 0.5 * (LEAN.tan() - THICKNESS / LENGTH);
    println!("limit {limit:.3}");
    // It creeps by half of the creep speed or so at each foot.
    let stands = sunk(limit + 0.05);
    let falls = sunk(limit - 0.05);
    assert!(stands < 1e-3 && falls > 5e-3, "{stands} {falls}");
}
