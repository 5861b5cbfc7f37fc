//! The cone of friction, in all directions.

use std::sync::Arc;

use nalgebra::{Isometry3, Vector3};
use pliant_contact::pose::{Pose, Trajectory};
use pliant_contact::shape::Shape;
use pliant_contact::touch::Rigid;
use pliant_explicit::{Observable, State};
use pliant_mechanics::curve::{Curve, Shape as CurveShape};
use pliant_mechanics::law::{AnyLaw, NeoHookean, Volumetric};
use pliant_mechanics::load::Load;
use pliant_mechanics::model::{Constraint, Material, Model, Motion};
use pliant_mechanics::prony::Prony;

use super::rigid::{at, floor};
use super::{add_block, block, stepper};

/// A block is pressed onto a floor. It is drawn over the floor at 10 mm/s by its top, or rests while the
/// floor is drawn away beneath it. The floor feels μ N along the slip in any direction (A5).
#[test]
fn friction_of_a_dragged_block_is_mu_times_the_load_along_the_slip() {
    let (speed, friction) = (0.01, 0.3);
    let (mut off, mut askew) = (0.0_f64, 0.0_f64);
    for degrees in [0, 17, 45, 90, 137, 200, 265, 330] {
        let angle = f64::from(degrees).to_radians();
        let along = Vector3::new(angle.cos(), angle.sin(), 0.0);
        for floor_moves in [false, true] {
            let mut model = block([3, 2, 2], 0.01, 3e3, Prony::default());
            model.bodies[0].damping = 60.0;
            let nodes = 0..model.node_count() as u32;
            let top: Vec<u32> = nodes.filter(|&node| model.rest[node as usize][2] > 0.0199).collect();
            let press = Curve { shape: CurveShape::SmoothStep, from: 0.0, to: 0.1 };
            let drag = Curve { shape: CurveShape::SmoothStep, from: 0.1, to: 0.2 };
            let drawn = if floor_moves { Vector3::zeros() } else { along * speed };
            let mut prescribe = |components: [bool; 3], motion| {
                let [x, y, z] = components;
                let components = [x, y, z, false, false, false];
                let name = "top".into();
                model.constraints.push(Constraint { name, nodes: top.clone(), components, motion });
            };
            prescribe([false, false, true], Motion::Displacement([0.0, 0.0, -0.001], press));
            prescribe([true, true, false], Motion::Velocity(drawn.into(), drag));
            let way = if floor_moves { -along * speed } else { Vector3::zeros() };
            let curve = Curve { shape: CurveShape::Ramp, from: 0.2, to: 1.2 };
            let trajectory = Trajectory::by(Pose::identity(), way.into(), curve);
            let floor =
                Rigid { name: "floor".into(), shape: Shape::HalfSpace, trajectory, inside: false, jaw: None };
            let contacts = at(floor, &model, friction);
            let model = Arc::new(model);
            let mut stepper = stepper(&model, &contacts, 0.8);
            let mut state = State::at_rest(&model);
            while state.time < 0.8 {
                stepper.evaluate(&mut state).unwrap();
                if state.time > 0.6 {
                    let force = Vector3::from(stepper.contact_forces()[0]);
                    let across = Vector3::new(force.x, force.y, 0.0);
                    assert!(force.z < -0.1, "{force}");
                    off = off.max((across.norm() / (friction * -force.z) - 1.0).abs());
                    askew = askew.max(across.angle(&along).to_degrees());
                }
                stepper.advance(&mut state);
            }
        }
    }
    println!("friction off by {off:.1e} of mu N at most, and {askew:.1e} degrees beside the slip");
    assert!(off < 0.01 && askew < 1.0, "{off:.1e} {askew:.1e}");
}

/// A stiff block, 1 MPa, is put on a plane of slope ½, gravity at once. Trembling would let the block slide
/// at friction 0.51, and too fast at 0.49. Damping by stiffness of as much as the critical time step calms
/// the block. The block sticks, or slides by 43.87 mm/s² t², except for the way it gains in the first
/// tremble.
#[test]
fn a_stiff_block_on_an_incline_sticks_or_slides_with_damping_by_stiffness() {
    let slid = |friction: f64, damping: f64, mass_damping: f64| {
        let mut model = Model::default();
        let (young, poisson) = (1e6, 0.4);
        let (shear, bulk) = (young / (2.0 * (1.0 + poisson)), young / (3.0 * (1.0 - 2.0 * poisson)));
        let law = AnyLaw::NeoHookean(NeoHookean { shear, volumetric: Volumetric::quadratic(bulk) });
        let material = Material::elastic(law, 1000.0);
        add_block(&mut model, [3, 3, 3], [0.02; 3], Isometry3::identity(), material);
        model.bodies[0].damping = mass_damping;
        model.stiffness_damping = damping;
        model.loads.push(Load::gravity(0, [4.387165, 0.0, -8.774331]));
        let contacts = at(floor(), &model, friction);
        let model = Arc::new(model);
        let mut stepper = stepper(&model, &contacts, 0.9);
        let mut state = State::<f64>::at_rest(&model);
        let mean = |state: &State<f64>| {
            state.displacement.iter().map(|u| u[0]).sum::<f64>() / state.displacement.len() as f64
        };
        let mut then = None;
        while state.time < 1.5 {
            stepper.evaluate(&mut state).unwrap();
            if state.time >= 0.5 {
                then.get_or_insert(mean(&state));
            }
            stepper.advance(&mut state);
        }
        let energies = stepper.energies();
        assert!(energies.balance < 1e-3 && energies.damping > 0.0, "{energies:?}");
        (mean(&state), mean(&state) - then.unwrap())
    };
    let damping = 1.28e-4;
    for mass_damping in [5.0, 0.0] {
        let (_, creep) = slid(0.51, damping, mass_damping);
        println!("friction 0.51, {mass_damping}/s: {creep:.1e} m in the last second");
        assert!(creep.abs() < 1e-6, "{creep}");
        let (way, _) = slid(0.49, damping, mass_damping);
        let acceleration = 4.387165 - 0.49 * 8.774331;
        let wanted = match mass_damping {
            0.0 => 0.5 * acceleration * 2.25,
            of => acceleration / of * (1.5 - (1.0 - f64::exp(-1.5 * of)) / of),
        };
        println!("friction 0.49, {mass_damping}/s: {way} m of {wanted} m");
        assert!((way / wanted - 1.0).abs() < 0.05, "{way} m of {wanted} m");
    }
}
