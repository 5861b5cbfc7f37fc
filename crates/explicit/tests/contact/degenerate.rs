//! Bodies that meet at corners and edges: primitive scenes of rigid-body libraries, and the degenerate ones
//! of Erleben 2018. The runs end, with finite numbers, in bounds, and no edge of one body is ever in a
//! triangle of another. All bodies are soft, or the held ones are rigid.

use std::sync::Arc;

use nalgebra::Vector3;
use pliant_contact::pairs::Surface;
use pliant_contact::pose::Trajectory;
use pliant_contact::shape::Shape;
use pliant_contact::touch::{Contact, Contacts, Rigid, Touch, With};
use pliant_explicit::{Observable, State};
use pliant_mechanics::law::{AnyLaw, NeoHookean, Volumetric};
use pliant_mechanics::load::Load;
use pliant_mechanics::model::{Cells, Material, Model, Solid};
use pliant_testing::pieces::{self, Piece, Scene, corners_and_edges, erleben, play_all, stacks};

use super::rigid::floor;
use super::stepper;

/// The distance [m] that bodies keep.
const OFFSET: f64 = 1e-4;

/// Shear modulus [Pa] of the bodies, and the step over the critical one, of a scene. A tip of 0.8 mm is
/// crushed between softer edges of a crack at any step: its cells end inverted. On the point of a cone it
/// needs the shorter step that a run would take there.
fn manner(scene: &Scene, is_rigid: bool) -> [f64; 2] {
    match (scene.name, is_rigid) {
        ("spike in a crack", false) => [5e5, 0.5],
        ("spikes", true) => [5e4, 0.25],
        _ => [5e4, 0.5],
    }
}

/// Adds a soft body of a shear modulus [Pa] to a model; its surface.
fn add(piece: &Piece, shear: f64, model: &mut Model) -> Surface {
    let first = model.node_count();
    let body = piece.tets(first as u32);
    let mut nodes: Vec<u32> = body.faces.iter().flatten().copied().collect();
    nodes.sort_unstable();
    nodes.dedup();
    let number = model.add_body("piece", &body.points);
    model.bodies[number].damping = 5.0;
    let law = NeoHookean { shear, volumetric: Volumetric::quadratic(2.0 * shear / 3.0) };
    let cells = Cells::tet4(body.tets, &model.rest);
    model.add_solid(Solid::new(number, Material::elastic(AnyLaw::NeoHookean(law), piece.density), cells));
    model.initial_velocity.resize(first + body.points.len(), piece.velocity.unwrap_or_default());
    if piece.velocity.is_none() {
        model.fix("far side", body.far);
    }
    Surface { nodes, faces: body.faces }
}

fn rigid(piece: &Piece) -> Rigid {
    let (shape, at) = piece.rigid();
    let shape = match shape {
        pieces::Rigid::Cuboid(size) => Shape::Cuboid { size },
        pieces::Rigid::Cone([radius, height]) => Shape::Cone { radius, height },
    };
    Rigid { shape, trajectory: Trajectory::fixed(at), ..floor() }
}

/// Counts the edges of one surface that go through a triangle of another.
fn intersections(surfaces: &[Surface], place: &impl Fn(u32) -> Vector3<f64>) -> usize {
    let mut count = 0;
    for (a, first) in surfaces.iter().enumerate() {
        for (b, second) in surfaces.iter().enumerate() {
            if a == b {
                continue;
            }
            for edge in first.faces.iter().flat_map(|&[a, b, c]| [[a, b], [b, c], [c, a]]) {
                let [from, to] = edge.map(place);
                count += second.faces.iter().filter(|face| crosses(from, to, face.map(place))).count();
            }
        }
    }
    count
}

/// True if a segment goes through a triangle, by signed volumes.
fn crosses(from: Vector3<f64>, to: Vector3<f64>, [a, b, c]: [Vector3<f64>; 3]) -> bool {
    let volume = |p: Vector3<f64>, q: Vector3<f64>, r: Vector3<f64>, s: Vector3<f64>| {
        (q - p).cross(&(r - p)).dot(&(s - p))
    };
    if volume(a, b, c, from) * volume(a, b, c, to) >= 0.0 {
        return false;
    }
    let sides = [volume(from, to, a, b), volume(from, to, b, c), volume(from, to, c, a)];
    sides.iter().all(|side| *side > 0.0) || sides.iter().all(|side| *side < 0.0)
}

/// Plays a scene, with all bodies soft or with rigid ones that are held. Returns an error if the scene fails.
fn play(scene: &Scene, is_rigid: bool) -> Result<(), String> {
    let name = if is_rigid { format!("{}, rigid", scene.name) } else { scene.name.to_owned() };
    let [shear, part] = manner(scene, is_rigid);
    let mut model = Model::default();
    let (held, soft): (Vec<&Piece>, Vec<&Piece>) =
        scene.pieces.iter().partition(|piece| is_rigid && piece.velocity.is_none());
    let surfaces: Vec<Surface> = soft.iter().map(|piece| add(piece, shear, &mut model)).collect();
    let mut rigids: Vec<Rigid> = held.into_iter().map(rigid).collect();
    rigids.extend(scene.has_floor.then(floor));
    model.initial_velocity.resize(model.node_count(), [0.0; 3]);
    for (body, piece) in soft.iter().enumerate() {
        if piece.velocity.is_some() && scene.gravity > 0.0 {
            model.loads.push(Load::gravity(body, [0.0, 0.0, -scene.gravity]));
        }
    }
    let touch = Touch { friction: 0.3, offset: OFFSET };
    let contact =
        |surface: &Surface, with| Contact { name: "touch".into(), surface: surface.clone(), with, touch };
    let mut contacts = Vec::new();
    for (k, first) in surfaces.iter().enumerate() {
        contacts.extend(surfaces[k + 1..].iter().map(|second| contact(first, With::Body(second.clone()))));
        contacts.extend((0..rigids.len()).map(|number| contact(first, With::Rigid(number))));
    }
    let contacts = Arc::new(Contacts { rigids, contacts, ..Default::default() });
    let model = Arc::new(model);
    let mut stepper = stepper(&model, &contacts, part);
    let mut state = State::at_rest(&model);
    let (mut steps, mut touched, mut crossed, mut fastest, mut deepest) = (0, 0, 0, 0.0_f64, 0.0_f64);
    while state.time < 0.4 {
        stepper.evaluate(&mut state).map_err(|error| format!("{name}: {error}"))?;
        touched += usize::from(stepper.contact_forces().iter().any(|force| *force != [0.0; 3]));
        stepper.advance(&mut state);
        steps += 1;
        if steps % 10 == 0 {
            let place = |node: u32| {
                Vector3::from(model.rest[node as usize]) + Vector3::from(state.displacement[node as usize])
            };
            crossed += intersections(&surfaces, &place);
            for rigid in &contacts.rigids {
                let stance = rigid.stance(state.time, None);
                let nodes = surfaces.iter().flat_map(|surface| &surface.nodes);
                deepest =
                    nodes.fold(deepest, |most, &node| most.max(-rigid.near(&stance, &place(node)).distance));
            }
        }
        for way in &state.increment {
            fastest = fastest.max(Vector3::from(*way).norm() / stepper.step());
        }
    }
    let far = state.displacement.iter().flatten().fold(0.0_f64, |most, u| most.max(u.abs()));
    println!(
        "{name}: {steps} steps, contact in {touched}, {crossed} intersections, {deepest:.0e} m deep, at most {fastest:.2} m/s, moved by up to {far:.3} m"
    );
    // Falls in the time are below 0.8 m; shear waves run at 7 m/s, and thin tips are thrown about.
    let fine = touched > 0 && crossed == 0 && deepest <= 0.0 && far < 1.0 && fastest < 20.0;
    let report = || {
        format!(
            "{name}: {crossed} intersections, {deepest} m deep, {far} m, {fastest} m/s, {touched} touches"
        )
    };
    if fine { Ok(()) } else { Err(report()) }
}

/// Corners, edges and faces of free bodies that fly into each other (S2).
#[test]
fn corners_edges_and_faces_that_meet_end_without_intersection() {
    play_all(&corners_and_edges(), play);
}

/// Stacks on a floor, and a heavy block on a light one (S2).
#[test]
fn stacks_and_large_ratios_of_mass_end_without_intersection() {
    play_all(&stacks(), play);
}

/// Spikes, wedges, holes, cracks and cliffs (Erleben 2018; S1).
#[test]
fn spikes_wedges_cracks_and_cliffs_end_without_intersection() {
    play_all(&erleben(), play);
}
