//! Bodies that meet at corners and edges by barriers (S1, S2). Scenes are primitive ones of rigid-body
//! libraries, and the degenerate ones of Erleben (2018). Bodies are all soft, or the held ones are rigid.
//! Scenes end within bounds, and no state has an edge in a triangle.

use nalgebra::Vector3;
use pliant_contact::barrier::BarrierSettings;
use pliant_contact::pairs::Surface;
use pliant_contact::pose::Trajectory;
use pliant_contact::shape::Shape;
use pliant_contact::touch::{Contact, Contacts, Rigid, Touch, With};
use pliant_implicit::AssemblySolver;
use pliant_implicit::{Assembly, AssemblyState, BackwardEuler, DynamicSettings};
use pliant_mechanics::law::{AnyLaw, NeoHookean, Volumetric};
use pliant_mechanics::load::Load;
use pliant_mechanics::model::{Cells, Material, Solid};
use pliant_testing::pieces::{self, Piece, Scene, corners_and_edges, erleben, play_all, stacks};

use super::{fixed, surface, touch};

const SHEAR: f64 = 5e4;

/// Adds a soft body; its surface.
fn add(piece: &Piece, model: &mut Assembly) -> Surface {
    let body = piece.tets(model.rest.len() as u32);
    let number = model.add_body("piece", body.points.iter().map(|&x| x.into()));
    model.model_mut().bodies[number].damping = 5.0;
    let law = NeoHookean { shear: SHEAR, volumetric: Volumetric::quadratic(2.0 * SHEAR / 3.0) };
    let cells = Cells::tet4(body.tets, &model.rest);
    let material = Material::elastic(AnyLaw::NeoHookean(law), piece.density);
    model.add_solid("piece", Solid::new(number, material, cells)).unwrap();
    if piece.velocity.is_none() {
        model.model_mut().fix("far side", body.far);
    }
    surface(body.faces)
}

fn rigid(piece: &Piece) -> Rigid {
    let (shape, at) = piece.rigid();
    let shape = match shape {
        pieces::Rigid::Cuboid(size) => Shape::Cuboid { size },
        pieces::Rigid::Cone([radius, height]) => Shape::Cone { radius, height },
    };
    super::rigid("held", shape, Trajectory::fixed(at))
}

/// Plays a scene, with all bodies soft or with rigid held ones. An error gives the numbers that are out of
/// bounds.
fn play(scene: &Scene, is_rigid: bool) -> Result<(), String> {
    let name = if is_rigid { format!("{}, rigid", scene.name) } else { scene.name.to_owned() };
    let (held, soft): (Vec<&Piece>, Vec<&Piece>) =
        scene.pieces.iter().partition(|piece| is_rigid && piece.velocity.is_none());
    let mut model = Assembly::default();
    let mut velocity = Vec::new();
    let mut surfaces = Vec::new();
    for (body, piece) in soft.into_iter().enumerate() {
        surfaces.push(add(piece, &mut model));
        velocity.resize(model.rest.len(), Vector3::from(piece.velocity.unwrap_or_default()));
        if piece.velocity.is_some() && scene.gravity > 0.0 {
            model.model_mut().loads.push(Load::gravity(body, [0.0, 0.0, -scene.gravity]));
        }
    }
    let mut rigids: Vec<Rigid> = held.into_iter().map(rigid).collect();
    rigids.extend(scene.has_floor.then(|| fixed("floor", Shape::HalfSpace, [0.0; 3], [0.0; 3])));
    let settings = Touch { friction: 0.3, offset: 0.0 };
    let contact = |surface: &Surface, with| Contact {
        name: "touch".into(),
        surface: surface.clone(),
        with,
        touch: settings,
    };
    let mut contacts = Vec::new();
    for (k, first) in surfaces.iter().enumerate() {
        contacts.extend(surfaces[k + 1..].iter().map(|second| contact(first, With::Body(second.clone()))));
        contacts.extend((0..rigids.len()).map(|number| contact(first, With::Rigid(number))));
    }
    let barrier = BarrierSettings { distance: 2e-4, stiffness: 0.2 * SHEAR, creep_speed: 1e-3 };
    touch(&mut model, Contacts { rigids, contacts, ..Default::default() }, barrier);
    let settings = DynamicSettings { iterations: 200, ..DynamicSettings::new(5e-3) };
    let mut solver =
        BackwardEuler::new(model.clone(), settings).map_err(|error| format!("{name}: {error}"))?;
    let mut state = AssemblyState::at_rest(&model);
    state.velocity = velocity;
    let (mut steps, mut iterations, mut touched, mut halved) = (0, 0, 0, 0);
    let (mut fastest, mut least) = (0.0_f64, f64::INFINITY);
    while state.time < 0.4 - 1e-9 {
        let done =
            solver.advance(&mut state).map_err(|error| format!("{name} at {} s: {error}", state.time))?;
        steps += 1;
        iterations += done.residuals.len();
        halved += usize::from(done.parts > 1);
        if let Some(gap) = solver.contact().unwrap().now().gap {
            (touched, least) = (touched + 1, least.min(gap));
        }
        fastest = state.velocity.iter().fold(fastest, |most, v| most.max(v.norm()));
    }
    let far = (0..model.rest.len()).fold(0.0_f64, |most, n| most.max(state.displacement(&model, n).norm()));
    println!(
        "{name}: {steps} steps, {iterations} iterations, {halved} halved, contact in {touched}, least gap {:.2} um, at most {fastest:.2} m/s, moved by up to {far:.3} m",
        1e6 * least
    );
    // Falls in the time are below 0.8 m and reach 4 m/s; thin tips are thrown about.
    let fine = touched > 0 && least > 0.0 && far < 1.0 && fastest < 20.0;
    if fine {
        Ok(())
    } else {
        Err(format!("{name}: gap {least} m, {far} m, {fastest} m/s, {touched} touches"))
    }
}

#[test]
fn corners_edges_and_faces_that_meet_never_cross() {
    play_all(&corners_and_edges(), play);
}

#[test]
fn stacks_and_large_ratios_of_mass_never_cross() {
    play_all(&stacks(), play);
}

#[test]
fn spikes_wedges_cracks_and_cliffs_never_cross() {
    play_all(&erleben(), play);
}
