//! Constraints that bind nodes to each other: a prescribed mean displacement, rigid parts of a body, an
//! enclosed volume. A step predicts where the nodes go without the constraint, and corrects the prediction by
//! the least change in the metric of the masses. So momentum and angular momentum are kept. No wave becomes
//! faster: the critical time step stays. The corrections enter the step as forces, hence the energies too.
//!
//! *Mean.* Σ wᵢ uᵢ = d with forces wᵢ λ: λ = (d − Σ wᵢ uᵢ*)/Σ wᵢ² yᵢ, uᵢ* the prediction and yᵢ = Δt²/m the
//! mobility of a node.
//!
//! *Rigid.* x = c + R (X − X̄), with c and X̄ the centres of mass. The forces have no moment about the centre
//! where the nodes are now: Σ mᵢ rᵢ × (R (Xᵢ − X̄) − rᵢ*) = 0 with arms rᵢ now and rᵢ* predicted. This is the
//! discrete rigid body of Moser and Veselov (1991), which keeps Σ m xⁿ × xⁿ⁺¹ exactly. Newton's method finds
//! R. It starts from the rotation of the polar decomposition of Σ mᵢ rᵢ* ⊗ (Xᵢ − X̄) (Kabsch 1976), which
//! nodes on a line keep.
//!
//! *Volume.* V(x* + y g p) = V₀ + ΔV with forces p gᵢ, gᵢ = ∂V/∂xᵢ where the nodes are now; V is of third
//! order in p, which Newton's method finds. The forces of a pressure on a closed surface have no resultant
//! and no moment.

use nalgebra::{Matrix3, Rotation3, Vector3};
use pliant_mechanics::model::{Constraint, Enclosed, Enclosure, Model, Motion};
use pliant_mechanics::rotation::nearest_rotation;
use pliant_mechanics::tensor::{Vector, add, cast, dot, scale, sub};

use crate::lanes::LaneNumber;

/// Steps of Newton's method for a rotation; three are usual.
const MOST_TURNS: usize = 8;
/// Steps of Newton's method for a pressure; two or three are usual.
const MOST_PRESSURES: usize = 20;
/// A part of a volume that counts as none.
const FILLED: f64 = 1e-14;

/// Motion of a node in a step without a constraint.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Predicted {
    /// Displacement [m] of the node now.
    pub now: Vector<f64>,
    /// Displacement [m] of the node after the step.
    pub displacement: Vector<f64>,
    /// Mobility: way per force over the step [m/N].
    pub mobility: f64,
    /// The components that another constraint prescribes; forces do not move them.
    pub held: [bool; 3],
}

/// The nodes of such a constraint.
pub(crate) struct Collective {
    /// The constraint of the model.
    pub constraint: usize,
    /// The force [N] of all of them together at the last evaluation.
    pub force: Vector<f64>,
    /// The volume and its pressure at the last evaluation; zero of other constraints.
    pub enclosed: Enclosed,
    /// Force [N] on each node.
    nodal_forces: Vec<Vector<f64>>,
    predicted: Vec<Predicted>,
    /// Volume [m³] at rest, the gradient [m²] now and that after the step.
    rest_volume: f64,
    gradients: [Vec<Vector<f64>>; 2],
}

impl Collective {
    /// Builds the collective constraints of a model.
    pub fn of_model(model: &Model) -> Vec<Self> {
        let collective =
            model.constraints.iter().enumerate().filter(|(_, constraint)| constraint.motion.is_collective());
        let new = |(index, constraint): (usize, &Constraint)| {
            let mut gradient = vec![[0.0; 3]; constraint.nodes.len()];
            let rest = |at: u32| model.rest[constraint.nodes[at as usize] as usize];
            let rest_volume = match &constraint.motion {
                Motion::Volume { enclosure, .. } => enclosure.add_gradient(rest, &mut gradient),
                _ => 0.0,
            };
            Self {
                constraint: index,
                force: [0.0; 3],
                enclosed: Enclosed { volume: rest_volume, pressure: 0.0 },
                nodal_forces: vec![[0.0; 3]; constraint.nodes.len()],
                predicted: Vec::with_capacity(constraint.nodes.len()),
                rest_volume,
                gradients: [gradient.clone(), gradient],
            }
        };
        collective.map(new).collect()
    }

    /// Finds the forces; `factor` scales a mean's displacement or a volume's growth after the step. The
    /// pressure found is added to the present one.
    pub fn find(&mut self, model: &Model, predicted: impl Fn(u32) -> Predicted, factor: f64) {
        let constraint = &model.constraints[self.constraint];
        self.predicted.clear();
        self.predicted.extend(constraint.nodes.iter().map(|&node| predicted(node)));
        match &constraint.motion {
            Motion::Mean { weights, by, .. } => {
                for c in 0..3 {
                    let free = || self.predicted.iter().zip(weights);
                    let apart = by[c] * factor - free().map(|(p, w)| w * p.displacement[c]).sum::<f64>();
                    let mobility: f64 = free().map(|(p, w)| w * w * p.mobility).sum();
                    let force = if constraint.components[c] { apart / mobility } else { 0.0 };
                    self.nodal_forces.iter_mut().zip(weights).for_each(|(on_node, w)| on_node[c] = w * force);
                }
            }
            Motion::Volume { enclosure, by, .. } => {
                self.find_pressure(model, enclosure, self.rest_volume + by * factor);
            }
            _ => self.find_rigid(model),
        }
        self.force = self.nodal_forces.iter().fold([0.0; 3], |sum, &force| add(sum, force));
    }

    /// Finds the forces of the pressure that fills an enclosure to a volume [m³].
    fn find_pressure(&mut self, model: &Model, enclosure: &Enclosure, volume: f64) {
        let nodes = &model.constraints[self.constraint].nodes;
        let [now, then] = &mut self.gradients;
        let predicted = &self.predicted;
        let rest = |at: u32| model.rest[nodes[at as usize] as usize];
        now.fill([0.0; 3]);
        let held = |at: u32| add(rest(at), predicted[at as usize].now);
        self.enclosed.volume = enclosure.add_gradient(held, now);
        let way = |at: usize, c: usize| {
            let Predicted { mobility, held, .. } = predicted[at];
            if held[c] { 0.0 } else { mobility * now[at][c] }
        };
        let mut pressure = 0.0;
        for _ in 0..MOST_PRESSURES {
            then.fill([0.0; 3]);
            let place = |at: u32| {
                let displacement = predicted[at as usize].displacement;
                let moved = [0, 1, 2].map(|c| displacement[c] + pressure * way(at as usize, c));
                add(rest(at), moved)
            };
            let found = enclosure.add_gradient(place, then);
            let slope: f64 =
                then.iter().enumerate().map(|(at, g)| dot(*g, [0, 1, 2].map(|c| way(at, c)))).sum();
            let more = (volume - found) / slope;
            if !more.is_finite() {
                break;
            }
            pressure += more;
            if (volume - found).abs() <= FILLED * found.abs() {
                break;
            }
        }
        self.nodal_forces.iter_mut().zip(&*now).for_each(|(force, g)| *force = scale(*g, pressure));
        self.enclosed.pressure += pressure;
    }

    /// Turns forces [N] found step by step into the forces of the constraint at these displacements [m].
    /// `forces` has one entry per node of the model. An enclosed volume gets the forces of its pressure, a
    /// rigid part forces without resultant and moment. A mean keeps its forces.
    pub fn renew<R: LaneNumber>(
        &mut self,
        model: &Model,
        displacement: &[Vector<R>],
        forces: &mut [Vector<R>],
    ) {
        let constraint = &model.constraints[self.constraint];
        let place = |at: u32| {
            let node = constraint.nodes[at as usize] as usize;
            add(model.rest[node], cast(displacement[node]))
        };
        match &constraint.motion {
            Motion::Volume { enclosure, .. } => {
                let [now, _] = &mut self.gradients;
                now.fill([0.0; 3]);
                self.enclosed.volume = enclosure.add_gradient(place, now);
                for (&node, g) in constraint.nodes.iter().zip(&*now) {
                    forces[node as usize] = cast(scale(*g, self.enclosed.pressure));
                }
            }
            Motion::Rigid => {
                let nodes = || constraint.nodes.iter().map(|&node| node as usize).zip(0..);
                let part = 1.0 / constraint.nodes.len() as f64;
                let centre = scale(nodes().fold([0.0; 3], |sum, (_, at)| add(sum, place(at))), part);
                let (mut force, mut moment, mut inertia) =
                    (Vector3::zeros(), Vector3::zeros(), Matrix3::zeros());
                for (node, at) in nodes() {
                    let (arm, nodal) =
                        (Vector3::from(sub(place(at), centre)), Vector3::from(cast(forces[node])));
                    force += nodal * part;
                    moment += arm.cross(&nodal);
                    inertia += Matrix3::from_diagonal_element(arm.norm_squared()) - arm * arm.transpose();
                }
                // Nodes on a line have no inertia about it, and no moment.
                let spin = inertia
                    .svd(true, true)
                    .solve(&moment, 1e-12 * inertia.norm())
                    .unwrap_or_else(|_| Vector3::zeros());
                for (node, at) in nodes() {
                    let arm = Vector3::from(sub(place(at), centre));
                    let excess: Vector<f64> = (force + spin.cross(&arm)).into();
                    forces[node] = cast(sub(cast(forces[node]), excess));
                }
            }
            _ => {}
        }
    }

    fn find_rigid(&mut self, model: &Model) {
        let nodes = &model.constraints[self.constraint].nodes;
        let rest = |index: usize| model.rest[nodes[index] as usize];
        let place = |index: usize| add(rest(index), self.predicted[index].displacement);
        let mass = |index: usize| 1.0 / self.predicted[index].mobility;
        let count = nodes.len();
        let whole: f64 = (0..count).map(mass).sum();
        let centre = |of: &dyn Fn(usize) -> Vector<f64>| {
            let sum = (0..count).fold([0.0; 3], |sum, index| add(sum, scale(of(index), mass(index))));
            scale(sum, 1.0 / whole)
        };
        let held = |index: usize| add(rest(index), self.predicted[index].now);
        let (first, then, now) = (centre(&rest), centre(&place), centre(&held));
        let arm = |of: Vector<f64>, centre: Vector<f64>| Vector3::from(sub(of, centre));
        let sum = (0..count).fold(Matrix3::zeros(), |sum, index| {
            sum + arm(place(index), then) * arm(rest(index), first).transpose() * mass(index)
        });
        let mut turn = nearest_rotation(&sum);
        for _ in 0..MOST_TURNS {
            let (mut moment, mut slope) = (Vector3::zeros(), Matrix3::zeros());
            for index in 0..count {
                let (r, y) = (arm(held(index), now), turn * arm(rest(index), first));
                moment += r.cross(&(y - arm(place(index), then))) * mass(index);
                slope += (Matrix3::from_diagonal_element(r.dot(&y)) - y * r.transpose()) * mass(index);
            }
            let Some(inverse) = slope.try_inverse() else { break };
            let more = inverse * moment;
            if !more.norm().is_finite() || more.norm() > 1.0 {
                break;
            }
            turn = Rotation3::new(-more) * turn;
            if more.norm() < 1e-15 {
                break;
            }
        }
        for index in 0..count {
            let target = add(then, (turn * arm(rest(index), first)).into());
            self.nodal_forces[index] = scale(sub(target, place(index)), mass(index));
        }
    }

    /// The force [N] on each node.
    pub fn forces(&self, model: &Model) -> impl Iterator<Item = (u32, Vector<f64>)> {
        model.constraints[self.constraint].nodes.iter().copied().zip(self.nodal_forces.iter().copied())
    }
}

/// Volume and pressure of a constraint of volume; `None` of others.
pub(crate) fn enclosed(model: &Model, collectives: &[Collective], constraint: usize) -> Option<Enclosed> {
    let collective = collectives.iter().find(|collective| collective.constraint == constraint)?;
    model.constraints[constraint].motion.encloses().then_some(collective.enclosed)
}

#[cfg(test)]
mod tests {
    use super::*;
    use pliant_mechanics::curve::{Curve, Shape};
    use pliant_mechanics::law::{AnyLaw, NeoHookean, Volumetric};
    use pliant_mechanics::model::{Cells, Material, Solid};
    use pliant_mechanics::tensor::{cross, dot};
    use pliant_testing::Random;

    use crate::{CentralDifference, Observable, State, critical_step};

    /// A bar of 4 × 1 × 1 cubes of 1 cm, free, in random motion, with a constraint on the nodes of an end.
    fn moving(motion: impl FnOnce(&[u32]) -> Motion, chosen: impl Fn(&Vector<f64>) -> bool) -> Model {
        let mut rest = Vec::new();
        for x in 0..5 {
            for (y, z) in [(0, 0), (1, 0), (0, 1), (1, 1)] {
                rest.push([x, y, z].map(|i| 0.01 * f64::from(i)));
            }
        }
        let hexes = (0..4).map(|x| [0, 4, 5, 1, 2, 6, 7, 3].map(|node| 4 * x + node)).collect();
        let mut model = Model::default();
        let body = model.add_body("bar", &rest);
        let law = AnyLaw::NeoHookean(NeoHookean { shear: 2e3, volumetric: Volumetric::quadratic(1e4) });
        let cells = Cells::hex8(hexes, &rest, 0.2, 2e3);
        model.add_solid(Solid::new(body, Material::elastic(law, 1000.0), cells));
        let mut random = Random::new(5);
        model.initial_velocity = rest
            .iter()
            .map(|x| add(random.vector().map(|v| 0.02 * v), cross([3.0, 5.0, -4.0], *x)))
            .collect();
        let nodes: Vec<u32> = (0..20).filter(|&node| chosen(&rest[node as usize])).collect();
        let motion = motion(&nodes);
        model.constraints.push(Constraint { name: "end".into(), nodes, components: [true; 6], motion });
        model
    }

    /// Momentum, and angular momentum Σ m xⁿ × xⁿ⁺¹/Δt, of the last step.
    fn momenta(model: &Model, state: &State<f64>, step: f64) -> [Vector<f64>; 2] {
        let mut sums = [[0.0; 3]; 2];
        for node in 0..model.node_count() {
            let moment = scale(state.increment[node], model.mass[node] / step);
            let back = sub(state.displacement[node], state.increment[node]);
            sums[0] = add(sums[0], moment);
            sums[1] = add(sums[1], cross(add(model.rest[node], back), moment));
        }
        sums
    }

    /// An end keeps its shape to round-off while the bar tumbles, and so are momentum and angular momentum
    /// kept.
    #[test]
    fn a_rigid_end_tumbles_without_loss() {
        let model = moving(|_| Motion::Rigid, |x| x[0] > 0.025);
        let step = 0.9 * critical_step::assembled(&model).unwrap().step;
        let mut stepper = CentralDifference::<f64>::new(model.clone(), step).unwrap();
        let mut state = State::at_rest(&model);
        let (mut first, mut largest) = (None, [0.0; 2]);
        for _ in 0..2000 {
            stepper.evaluate(&mut state).unwrap();
            stepper.advance(&mut state);
            let now = momenta(&model, &state, step);
            let first = *first.get_or_insert(now);
            // Places are rounded 2,000 times.
            for kind in [0, 1] {
                let change = sub(now[kind], first[kind]);
                let size = dot(first[kind], first[kind]).sqrt();
                largest[kind] = f64::max(largest[kind], dot(change, change).sqrt() / size);
                assert!(dot(change, change).sqrt() < 1e-9 * size, "{kind}: {change:?} of {first:?}");
            }
        }
        println!("momentum {:.1e}, angular momentum {:.1e}", largest[0], largest[1]);
        let place = |node: usize| add(model.rest[node], state.displacement[node]);
        let length = |a: Vector<f64>, b: Vector<f64>| dot(sub(a, b), sub(a, b)).sqrt();
        for a in 12..20 {
            for b in 12..a {
                let change = length(place(a), place(b)) - length(model.rest[a], model.rest[b]);
                assert!(change.abs() < 1e-15, "{a} {b}: {change:e}");
            }
        }
        let turned = length(place(19), model.rest[19]);
        assert!(turned > 0.02, "{turned} m");
        let free = length(place(0), place(4)) - 0.01;
        assert!(free.abs() > 1e-6);
        stepper.evaluate(&mut state).unwrap();
        assert!(stepper.energies().balance.abs() < 1e-2, "{:?}", stepper.energies());
    }

    /// The mean follows its curve while single nodes do not, and the work of its force balances the energies.
    #[test]
    fn a_mean_goes_by_as_much_as_it_is_told() {
        let curve = Curve { shape: Shape::SmoothStep, from: 0.0, to: 0.1 };
        let weights = [0.1, 0.2, 0.3, 0.4];
        let by = [0.002, 0.0, -0.001];
        let mean = |_: &[u32]| Motion::Mean { weights: weights.to_vec(), by, curve: curve.clone() };
        let mut model = moving(mean, |x| x[0] > 0.035);
        model.initial_velocity.clear();
        model.fix("base", vec![0, 1, 2, 3]);
        model.bodies[0].damping = 30.0;
        let step = 0.9 * critical_step::assembled(&model).unwrap().step;
        let mut stepper = CentralDifference::<f64>::new(model.clone(), step).unwrap();
        let mut state = State::at_rest(&model);
        while state.time < 0.6 {
            stepper.evaluate(&mut state).unwrap();
            stepper.advance(&mut state);
            let factor = curve.value(state.time);
            for (c, by) in by.iter().enumerate() {
                let found: f64 = (0..4).map(|k| weights[k] * state.displacement[16 + k][c]).sum();
                assert!((found - factor * by).abs() < 1e-15, "{c}: {found} at {}", state.time);
            }
        }
        stepper.evaluate(&mut state).unwrap();
        let [force, base] = [stepper.reaction(0), stepper.reaction(1)];
        assert!(force[0] > 0.01 && (force[0] + base[0]).abs() < 1e-3 * force[0], "{force:?} {base:?}");
        assert!((state.displacement[16][0] - state.displacement[19][0]).abs() > 1e-6);
        assert!(stepper.energies().balance.abs() < 1e-2);
    }
}
