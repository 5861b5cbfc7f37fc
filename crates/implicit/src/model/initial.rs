//! States to start from other than rest.

use nalgebra::{Matrix3, UnitQuaternion, Vector3};
use pliant_mechanics::rotation::nearest_rotation;

use crate::model::assembly::Assembly;
use crate::model::state::AssemblyState;

impl AssemblyState {
    /// Gives nodes the motion of a rigid body: a velocity [m/s] at a point [m] and a spin [rad/s].
    pub fn set_motion(
        &mut self,
        nodes: &[u32],
        velocity: Vector3<f64>,
        spin: Vector3<f64>,
        about: Vector3<f64>,
    ) {
        for node in nodes.iter().map(|&node| node as usize) {
            self.velocity[node] = velocity + spin.cross(&(self.position[node] - about));
            self.spin[node] = spin;
        }
    }

    /// Puts the nodes to positions [m] and turns the nodes of shells with the facets round them. The rotation
    /// of a node best maps corners and normals of these facets from rest (Kabsch 1976; Procrustes), so that a
    /// rigid motion costs nothing.
    pub fn set_positions(&mut self, model: &Assembly, positions: &[Vector3<f64>]) {
        self.position.copy_from_slice(positions);
        let mut moments = vec![Matrix3::zeros(); model.rest.len()];
        for facet in &model.facets {
            let arms = |x: &dyn Fn(usize) -> Vector3<f64>| {
                let corners = facet.nodes.map(|node| x(node as usize));
                let centre = (corners[0] + corners[1] + corners[2]) / 3.0;
                let normal = (corners[1] - corners[0]).cross(&(corners[2] - corners[0]));
                // As long as the arms are.
                let normal = normal.try_normalize(0.0).unwrap_or_default() * facet.area.sqrt();
                (corners.map(|x| x - centre), normal)
            };
            let ((now, normal), (rest, rest_normal)) =
                (arms(&|node| positions[node]), arms(&|node| model.place(node)));
            let corners = now.iter().zip(&rest).map(|(x, r)| x * r.transpose()).sum::<Matrix3<f64>>();
            let moment = corners + normal * rest_normal.transpose();
            facet.nodes.iter().for_each(|&node| moments[node as usize] += moment);
        }
        for (rotation, moment) in self.rotation.iter_mut().zip(&moments) {
            *rotation = UnitQuaternion::from_rotation_matrix(&nearest_rotation(moment));
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::CurvedSurface;
    use crate::tests::{ball, cantilever, model, ramp};
    use crate::{BackwardEuler, DynamicSettings, StaticSettings, Statics};
    use pliant_mechanics::load::{Load, LoadKind};
    use pliant_mechanics::mapping::Weights;
    use pliant_mechanics::model::{Motion, Surface};
    use pliant_shells::EdgeRule;
    use pliant_shells::rotation::exponential;

    /// A rigid motion given as positions turns every node by its rotation and costs nothing.
    #[test]
    fn a_turned_start_is_not_strained() {
        let model = model(ball(2), 0.02);
        let turn = exponential(&Vector3::new(1.0, -2.0, 1.5));
        let positions: Vec<_> = model.places().map(|x| turn * x + Vector3::x()).collect();
        let mut state = AssemblyState::at_rest(&model);
        state.set_positions(&model, &positions);
        let energy = state.shell_energy(&model).unwrap();
        assert!(energy.membrane + energy.bending + energy.drilling.abs() < 1e-18, "{energy:?}");
        assert!(state.rotation.iter().all(|r| r.angle_to(&turn) < 1e-12));
    }

    /// A free ball that starts as a rigid body in small spin moves on as one: after 0.1 s its centre has gone
    /// v t.
    #[test]
    fn a_start_velocity_moves_a_free_body() {
        let model = model(ball(2), 0.02);
        let (velocity, spin) = (Vector3::new(1.0, -2.0, 0.5), Vector3::new(0.0, 0.0, 0.2));
        let mut state = AssemblyState::at_rest(&model);
        let nodes: Vec<u32> = (0..model.rest.len() as u32).collect();
        state.set_motion(&nodes, velocity, spin, Vector3::zeros());
        let mut solver = BackwardEuler::new(model.clone(), DynamicSettings::new(0.02)).unwrap();
        for _ in 0..5 {
            solver.advance(&mut state).unwrap();
        }
        let turn = exponential(&(spin * 0.1));
        for (x, rest) in state.position.iter().zip(model.places()) {
            // Backward Euler turns by arctan(ω h) a step and grows by (ω h)²/2: 1e-4 in all.
            assert!((x - (turn * rest + velocity * 0.1)).norm() < 1e-4, "{x} {rest}");
        }
    }

    /// The free end of a strip is turned about three axes at once. At each factor it turns by exactly
    /// exp(factor · vector), statically and step by step.
    #[test]
    fn a_rotation_vector_is_prescribed_exactly() {
        let mut model = cantilever();
        let vector = Vector3::new(0.9, -0.6, 0.7);
        let mut end = model.constraints[0].clone();
        end.nodes = vec![8, 17, 26];
        end.components = [false, false, false, true, true, true];
        end.motion = Motion::turn([0.0; 3], vector.into(), 3, ramp());
        model.model_mut().constraints.push(end);
        let mut state = AssemblyState::at_rest(&model);
        let mut solver = Statics::new(model.clone(), StaticSettings::default()).unwrap();
        for time in [0.3, 0.5, 1.0] {
            solver.solve(&mut state, time).unwrap();
            let wanted = exponential(&(vector * time));
            for node in [8, 17, 26] {
                assert!(state.rotation[node].angle_to(&wanted) < 1e-12, "{time}");
            }
        }
        let mut state = AssemblyState::at_rest(&model);
        let mut solver = BackwardEuler::new(model.clone(), DynamicSettings::new(0.1)).unwrap();
        for _ in 0..7 {
            solver.advance(&mut state).unwrap();
        }
        let wanted = exponential(&(vector * 0.7));
        assert!(state.rotation[17].angle_to(&wanted) < 1e-12);
    }

    /// A force on a point above a node is that force and the moment of its arm about the node, which turns
    /// with the shell. The solver finds its equilibrium, and the work of the load equals force times
    /// displacement of the point.
    #[test]
    fn a_force_on_a_carried_point_has_its_moment() {
        let mut model = cantilever();
        model.model_mut().loads.clear();
        let surface = CurvedSurface::new(&model, EdgeRule::Arc);
        let above = model.place(17) + Vector3::new(0.0, 0.0, 2.0);
        let cells: Vec<u32> = (0..32).collect();
        let points = surface.carry_all(&model, &AssemblyState::at_rest(&model), &cells, &[above]).unwrap();
        let force = Vector3::new(3.0, 0.5, 0.2);
        let skin =
            Surface { name: "skin".into(), body: 0, rest: vec![above.into()], mapping: Weights::default() };
        model.model_mut().surfaces.push(skin);
        model.carried.insert(0, points.clone());
        let kind = LoadKind::force([0], force);
        model.model_mut().loads.push(Load { surface: Some(0), ..Load::new("pull", kind, ramp()) });
        let mut state = AssemblyState::at_rest(&model);
        let step =
            Statics::new(model.clone(), StaticSettings::default()).unwrap().solve(&mut state, 1.0).unwrap();
        println!("{} iterations", step.residuals.len());
        let point = surface.carried(&model, &state, &points[0]);
        let arm = point - state.position[17];
        let normal = state.rotation[17] * Vector3::z();
        assert!((arm - 2.0 * normal).norm() < 1e-9, "{arm} {normal}");
        assert!(state.displacement(&model, 17).norm() > 0.5);
        let mut system = crate::system::System::forces_only(model.clone().into());
        system.evaluate(&state, 1.0, None).unwrap();
        let at = |of: &[f64], at: usize| Vector3::new(of[at], of[at + 1], of[at + 2]);
        let (nodal, moment) = (at(&system.forces.external, 6 * 17), at(&system.forces.external, 6 * 17 + 3));
        assert!((nodal - force).norm() < 1e-9 && (moment - arm.cross(&force)).norm() < 1e-9);
        // The clamp bears it all: Σ over its nodes of internal forces, and of moments about the origin.
        let (mut sum, mut turning) = (force, point.cross(&force));
        for node in [0, 9, 18] {
            let (f, m) = (at(&system.forces.internal, 6 * node), at(&system.forces.internal, 6 * node + 3));
            sum += f;
            turning += state.position[node].cross(&f) + m;
        }
        assert!(sum.norm() < 1e-5 && turning.norm() < 1e-5, "{sum} {turning}");
    }
}
