//! Barriers of whole surfaces: forces are gradients of the energy, they balance, and no motion that is
//! allowed goes through anything.

use std::sync::Arc;

use nalgebra::{Matrix3, Vector3};
use pliant_mechanics::curve::{Curve, Shape as CurveShape};
use pliant_testing::Random;

use super::{BarrierSettings, BarrierStep, Barriers, Stencil};
use crate::pairs::Surface;
use crate::pose::{Pose, Trajectory};
use crate::shape::Shape;
use crate::touch::{Contact, Contacts, Rigid, Touch, With};

/// A sheet of cells of 0.1 m around the origin, in a plane z = 0; nodes from a number on.
fn sheet(cells: u32, first: u32) -> (Surface, Vec<Vector3<f64>>) {
    let node = |i: u32, j: u32| first + j * (cells + 1) + i;
    let cell = |i: u32, j: u32| {
        let [a, b, c, d] = [node(i, j), node(i + 1, j), node(i + 1, j + 1), node(i, j + 1)];
        [[a, b, c], [a, c, d]]
    };
    let faces = (0..cells).flat_map(|j| (0..cells).flat_map(move |i| cell(i, j))).collect();
    let count = (cells + 1) * (cells + 1);
    let half = 0.5 * f64::from(cells);
    let place = |k: u32| {
        let [i, j] = [k % (cells + 1), k / (cells + 1)].map(|k| 0.1 * (f64::from(k) - half));
        Vector3::new(i, j, 0.0)
    };
    (Surface { nodes: (first..first + count).collect(), faces }, (0..count).map(place).collect())
}

fn rigid(shape: Shape, at: [f64; 3], by: [f64; 3]) -> Rigid {
    let curve = Curve { shape: CurveShape::Ramp, from: 0.0, to: 1.0 };
    let trajectory = Trajectory::by(Pose::translation(at[0], at[1], at[2]), by, curve);
    Rigid { name: "thing".into(), shape, trajectory, inside: false, jaw: None }
}

/// Two sheets on top of each other, bumpy, over a thing; the upper one touches itself.
struct Scene {
    step: BarrierStep,
    places: Vec<Vector3<f64>>,
}

impl Scene {
    fn new(thing: Rigid, friction: f64) -> Self {
        let (low, mut places) = sheet(6, 0);
        let (high, above) = sheet(4, 49);
        let mut random = Random::new(11);
        places.iter_mut().for_each(|x| *x += 0.004 * Vector3::from(random.vector()));
        places.extend(
            above.iter().map(|x| x + Vector3::new(0.03, 0.02, 0.02) + 0.004 * Vector3::from(random.vector())),
        );
        let touch = Touch { friction, offset: 0.005 };
        let contact = |name: &str, surface: &Surface, with: With| Contact {
            name: name.into(),
            surface: surface.clone(),
            with,
            touch,
        };
        let contacts = vec![
            contact("sheets", &low, With::Body(high.clone())),
            contact("itself", &high, With::Itself),
            contact("thing", &low, With::Rigid(0)),
        ];
        let settings = BarrierSettings { distance: 0.015, stiffness: 1e4, creep_speed: 1e-3 };
        let rest: Vec<[f64; 3]> = places.iter().map(|&x| x.into()).collect();
        let contacts = Arc::new(Contacts { rigids: vec![thing], contacts, ..Default::default() });
        let step = Barriers::new(contacts, &[settings; 3], &rest).begin(
            &places,
            &vec![0.0; 6 * places.len()],
            [0.0, 1.0],
        );
        Self { step, places }
    }

    /// Begins the next step from where nodes are.
    fn begin(&mut self, motion: &[f64]) {
        self.step.begin_next(&self.places, motion, [0.0, 1.0]);
    }
}

fn things() -> Vec<Rigid> {
    let by = [0.001, 0.0, 0.002];
    vec![
        rigid(Shape::Sphere { radius: 0.3 }, [0.02, 0.03, -0.312], by),
        rigid(Shape::Capsule { radius: 0.1, length: 0.1 }, [0.01, 0.0, -0.162], by),
        rigid(Shape::Cuboid { size: [0.25, 0.2, 0.1] }, [0.01, 0.0, -0.062], by),
        rigid(Shape::Cone { radius: 0.1, height: 0.2 }, [0.01, 0.02, -0.211], by),
        rigid(Shape::HalfSpace, [0.0, 0.0, -0.012], by),
    ]
}

/// Things that stay where they are and grow by a distance [m].
fn growing(by: f64) -> Vec<Rigid> {
    let curve = Curve { shape: CurveShape::Ramp, from: 0.0, to: 1.0 };
    let rigids = things().into_iter().map(|thing| {
        let trajectory = Trajectory::fixed(thing.at(0.0, None)).growing(by, curve.clone());
        Rigid { trajectory, ..thing }
    });
    rigids.collect()
}

/// Forces are minus the gradient of the energy of barriers and friction together. Forces of a contact between
/// bodies balance the forces on the other side.
#[test]
fn forces_are_gradients_and_balance() {
    let mut random = Random::new(2);
    for thing in things().into_iter().chain(growing(0.002)) {
        let shape = format!("{:?}", thing.shape);
        let mut scene = Scene::new(thing, 0.4);
        let count = scene.places.len();
        scene.begin(&vec![0.0; 6 * count]);
        let kinds = [0, 1, 2].map(|contact| {
            scene
                .step
                .normal_collisions()
                .iter()
                .filter(|collision| collision.stencil.contact == contact)
                .count()
        });
        assert!(kinds[0] > 10 && kinds[2] > 0, "{shape}: {kinds:?}");
        let mut moved = scene.places.clone();
        moved.iter_mut().for_each(|x| *x += 3e-4 * Vector3::from(random.vector()));
        let time_fraction = 0.4;
        let energy = scene.step.evaluate(&moved, time_fraction);
        assert!(energy.is_finite() && energy > 0.0);
        let (mut forces, mut totals) = (vec![0.0; 6 * count], vec![Vector3::zeros(); 3]);
        scene.step.add_forces(&mut forces, &mut totals);
        let size = forces.iter().fold(0.0_f64, |most, f| most.max(f.abs()));
        let h = 1e-7;
        for _ in 0..150 {
            let (node, c) = (random.below(count), random.below(3));
            let mut at = |by: f64| {
                let mut moved = moved.clone();
                moved[node][c] += by;
                scene.step.evaluate(&moved, time_fraction)
            };
            let slope = (at(h) - at(-h)) / (2.0 * h);
            let expected = -forces[6 * node + c];
            assert!((slope - expected).abs() < 1e-5 * size, "{shape} {node} {c}: {expected} {slope}, {size}");
        }
        let sum: Vector3<f64> = forces.chunks_exact(6).map(|f| Vector3::new(f[0], f[1], f[2])).sum();
        assert!((sum + totals[2]).norm() < 1e-10 * size, "{shape}: {sum} {}", totals[2]);
    }
}

/// The stiffness is positive semi-definite. Along a thing of any shape, outside or inside, it equals the
/// stiffness of the wall by differences.
#[test]
fn stiffness_is_never_negative() {
    let mut hollow = rigid(Shape::Sphere { radius: 0.6 }, [0.0, 0.0, 0.407], [0.001, 0.0, 0.002]);
    hollow.inside = true;
    for thing in [things().remove(4), hollow] {
        let (shape, inside) = (format!("{:?}", thing.shape), thing.inside);
        let mut scene = Scene::new(thing, 0.4);
        let count = scene.places.len();
        scene.begin(&vec![0.0; 6 * count]);
        scene.step.evaluate(&scene.places.clone(), 0.0);
        let (normal, friction) =
            (scene.step.normal_collisions().to_vec(), scene.step.friction_collisions().to_vec());
        let (mut number, mut at_wall) = (0, 0);
        scene.step.stiffness(|stencil: &Stencil, block, ways| {
            let values = block.symmetric_eigenvalues();
            assert!(values.min() > -1e-12 * values.max(), "{shape}");
            if stencil.count > 1 {
                assert_eq!(ways, [Vector3::zeros(); 4]);
            } else {
                // The thing comes nearer by 2 mm and goes aside by 1 mm.
                assert!((ways[0] + Vector3::new(0.001, 0.0, 0.002)).norm() < 1e-12, "{shape}: {ways:?}");
                if let Some(collision) = normal.get(number).filter(|collision| collision.region.is_none()) {
                    // From within, a sphere bends away from the normal everywhere: (I − n nᵀ)/r.
                    let centre = Vector3::new(0.0, 0.0, 0.407);
                    let r = (scene.places[stencil.nodes[0] as usize] - centre).norm();
                    let along = collision.normal * collision.normal.transpose();
                    let across =
                        (Matrix3::identity() - along) * (f64::from(u8::from(inside)) * collision.force / r);
                    let wanted = along * collision.stiffness + across;
                    let off = (block.fixed_view::<3, 3>(0, 0) - wanted).amax();
                    assert!(off < 1e-5 * wanted.amax(), "{shape}: {off:e} of {:e}", wanted.amax());
                    at_wall += 1;
                }
            }
            number += 1;
        });
        assert!(number == normal.len() + friction.len() && at_wall > 3, "{shape}: {at_wall}");
    }
}

/// The allowed part of any motion ends with gaps everywhere and no edge in a triangle. A small motion is
/// allowed wholly.
#[test]
fn no_motion_that_is_allowed_goes_through() {
    let mut random = Random::new(9);
    for thing in things().into_iter().chain(growing(0.2)) {
        let shape = format!("{:?}", thing.shape);
        for round in 0..12 {
            let mut scene = Scene::new(thing.clone(), 0.0);
            let size = if round == 0 { 1e-5 } else { 0.3 };
            let drift = Vector3::from(random.vector()) * 0.1;
            let motion: Vec<f64> = (0..scene.places.len())
                .flat_map(|_| {
                    let way = Vector3::from(random.vector()) * size + drift * f64::from(round.min(1));
                    [way.x, way.y, way.z, 0.0, 0.0, 0.0]
                })
                .collect();
            scene.begin(&motion);
            let (mut time_fraction, mut part) = (0.0, 0.0);
            for _ in 0..4 {
                part = scene.step.collision_free_fraction(&scene.places, &motion, time_fraction, [0.1, 1.0]);
                for (x, way) in scene.places.iter_mut().zip(motion.chunks_exact(6)) {
                    *x += Vector3::new(way[0], way[1], way[2]) * part;
                }
                time_fraction += part * (1.0 - time_fraction);
                let energy = scene.step.evaluate(&scene.places, time_fraction);
                assert!(energy.is_finite(), "{shape} {round}");
                let mut crossed = 0;
                scene.step.intersections(|_, _, _| crossed += 1);
                assert_eq!(crossed, 0, "{shape} {round}");
            }
            let is_small = round == 0 && scene.step.contacts().rigids[0].trajectory.growth(1.0) == 0.0;
            assert!(!is_small || part == 1.0, "{shape}: {part}");
        }
    }
}

/// A sheet that is thicker than its triangles are high has a smaller reach between neighbours. Nothing acts
/// at rest, and no allowed motion takes an edge through a triangle. Parts that are farther from each other
/// keep the whole distance.
#[test]
fn neighbours_of_a_thick_sheet_keep_the_guarantee() {
    let (surface, flat) = sheet(6, 0);
    let touch = Touch { friction: 0.0, offset: 0.12 };
    let contact = Contact { name: "itself".into(), surface, with: With::Itself, touch };
    let contacts = Arc::new(Contacts { contacts: vec![contact], ..Default::default() });
    let settings = BarrierSettings { distance: 0.03, stiffness: 1e4, creep_speed: 1e-3 };
    let rest: Vec<[f64; 3]> = flat.iter().map(|&x| x.into()).collect();
    let mut random = Random::new(5);
    let still = vec![0.0; 6 * flat.len()];
    for round in 0..20 {
        let barriers = Barriers::new(Arc::clone(&contacts), &[settings], &rest);
        assert_eq!(barriers.apart_counts(), [0]);
        let mut places = flat.clone();
        let mut step = barriers.begin(&places, &still, [0.0, 1.0]);
        assert!(step.normal_collisions().is_empty() && step.least_gap().is_none());
        for _ in 0..6 {
            let motion: Vec<f64> = (0..still.len()).map(|_| 0.3 * (2.0 * random.part() - 1.0)).collect();
            step.begin_next(&places, &motion, [0.0, 1.0]);
            let part = step.collision_free_fraction(&places, &motion, 0.0, [0.1, 1.0]);
            let ways = motion.chunks_exact(6).map(|way| Vector3::new(way[0], way[1], way[2]) * part);
            places.iter_mut().zip(ways).for_each(|(x, way)| *x += way);
            assert!(step.evaluate(&places, 0.0).is_finite(), "{round}");
            let mut crossed = 0;
            step.intersections(|_, _, _| crossed += 1);
            assert_eq!(crossed, 0, "{round}");
        }
        // Corners across are 0.85 m apart at rest.
        let mut across = flat.clone();
        across[48] = across[0] + Vector3::new(0.0, 0.0, 0.119);
        step.begin_next(&across, &still, [0.0, 1.0]);
        assert!(step.evaluate(&across, 0.0).is_infinite());
    }
}

/// A thing that grows by d presses like one that is larger by d. Its remaining way changes forces as its
/// stiffness says.
#[test]
fn what_grows_presses_like_what_is_larger() {
    for (thing, larger) in [
        (Shape::Sphere { radius: 0.3 }, Shape::Sphere { radius: 0.302 }),
        (Shape::Capsule { radius: 0.1, length: 0.1 }, Shape::Capsule { radius: 0.102, length: 0.1 }),
    ] {
        let at = [0.02, 0.03, if matches!(thing, Shape::Sphere { .. }) { -0.312 } else { -0.162 }];
        let curve = Curve { shape: CurveShape::Ramp, from: 0.0, to: 1.0 };
        let mut grown = rigid(thing, at, [0.0; 3]);
        grown.trajectory = grown.trajectory.growing(0.002, curve);
        let forces = |thing: Rigid, time_fraction: f64| {
            let mut scene = Scene::new(thing, 0.0);
            let count = scene.places.len();
            scene.begin(&vec![0.0; 6 * count]);
            assert!(scene.step.evaluate(&scene.places.clone(), time_fraction).is_finite());
            let (mut forces, mut totals) = (vec![0.0; 6 * count], vec![Vector3::zeros(); 3]);
            scene.step.add_forces(&mut forces, &mut totals);
            (forces, totals[2], scene)
        };
        let (grown_forces, total, _) = forces(grown.clone(), 1.0);
        let (wanted, same, _) = forces(rigid(larger, at, [0.0; 3]), 1.0);
        let size = wanted.iter().fold(0.0_f64, |most, f| most.max(f.abs()));
        let off = grown_forces.iter().zip(&wanted).map(|(a, b)| (a - b).abs()).fold(0.0, f64::max);
        assert!(off < 1e-11 * size && (total - same).norm() < 1e-11 * size && total.norm() > 0.0, "{off:e}");
        // Forces fall by the stiffness times the way that is left: by differences over the fraction of time.
        let (_, _, scene) = forces(grown.clone(), 0.5);
        let mut slope = vec![0.0; grown_forces.len()];
        scene.step.stiffness(|stencil: &Stencil, block, ways| {
            let way = nalgebra::SVector::<f64, 12>::from_fn(|k, _| ways[k / 3][k % 3]);
            let pull = block * way;
            for (at, (node, _)) in stencil.parts().enumerate().filter(|(_, (node, _))| *node < 74) {
                (0..3).for_each(|c| slope[6 * node as usize + c] -= pull[3 * at + c]);
            }
        });
        let h = 1e-6;
        let (after, before) = (forces(grown.clone(), 0.5 + h).0, forces(grown, 0.5 - h).0);
        let most = slope.iter().fold(0.0_f64, |most, f| most.max(f.abs()));
        let differences = after.iter().zip(&before).map(|(a, b)| 0.5 * (a - b) / (2.0 * h));
        let off = differences.zip(&slope).map(|(a, b)| (a - b).abs()).fold(0.0, f64::max);
        assert!(most > 0.0 && off < 1e-5 * most, "{off:e} of {most:e}");
    }
}

/// Things that turn fast are followed on their arcs.
#[test]
fn a_turning_thing_goes_through_nothing() {
    let curve = Curve { shape: CurveShape::Ramp, from: 0.0, to: 1.0 };
    let trajectory =
        Trajectory::turn(Pose::translation(0.0, 0.0, 0.3), [0.0, 1.0, 0.0], [0.0, 0.0, 0.3], 3.0, curve);
    let size = [0.5, 0.05, 0.02];
    let bar =
        Rigid { name: "bar".into(), shape: Shape::Cuboid { size }, trajectory, inside: false, jaw: None };
    let mut scene = Scene::new(bar, 0.0);
    // The upper sheet out of the way.
    scene.places[49..].iter_mut().for_each(|x| x.z -= 0.2);
    scene.places[..49].iter_mut().for_each(|x| x.z += 0.1);
    let still = vec![0.0; 6 * scene.places.len()];
    scene.begin(&still);
    let mut time_fraction = 0.0;
    for _ in 0..30 {
        time_fraction += scene.step.collision_free_fraction(&scene.places, &still, time_fraction, [0.1, 1.0])
            * (1.0 - time_fraction);
        assert!(scene.step.evaluate(&scene.places, time_fraction).is_finite());
        let mut crossed = 0;
        scene.step.intersections(|_, _, _| crossed += 1);
        assert_eq!(crossed, 0, "{time_fraction}");
    }
    // Its corner comes to the sheet after 0.9 rad or so.
    assert!(time_fraction > 0.1 && time_fraction < 0.5, "{time_fraction}");
}

/// A search for a fraction elsewhere leaves the evaluated state unchanged: stiffness, lagged friction and
/// near pairs.
#[test]
fn a_search_leaves_what_was_evaluated() {
    for thing in things().into_iter().chain(growing(0.002)) {
        let mut scene = Scene::new(thing, 0.4);
        scene.step.evaluate(&scene.places, 0.3);
        scene.step.lag();
        let read = |step: &mut BarrierStep| {
            let (mut blocks, mut near) = (Vec::new(), Vec::new());
            step.stiffness(|stencil, block, ways| blocks.push((stencil.nodes, *block, ways)));
            step.near(0.3, |nodes| near.push(nodes.to_vec()));
            step.lag();
            near.sort_unstable();
            (blocks, near, step.friction_limits(), step.least_gap())
        };
        let wanted = read(&mut scene.step);
        let away: Vec<_> = scene.places.iter().map(|x| x + Vector3::new(0.01, 0.02, 0.5)).collect();
        let motion = vec![0.1; 6 * away.len()];
        scene.step.collision_free_fraction(&away, &motion, 0.6, [0.1, 1.0]);
        assert!(wanted.0.len() > 10 && read(&mut scene.step) == wanted);
    }
}

/// Bodies that start within each other are reported with contact, node and gap.
#[test]
fn what_has_no_gap_at_the_start_is_told() {
    let mut scene = Scene::new(things().remove(0), 0.0);
    assert!(scene.step.barriers.clone().meetings(&scene.places, 0.0).is_empty());
    scene.places[60].z -= 0.2;
    let met = scene.step.barriers.meetings(&scene.places, 0.0);
    assert!(met.iter().any(|one| one.contact == 0 && one.gap.is_none()), "{met:?}");
}

/// Collisions at a place are the same, to the bit and in order, whatever motion led there. The wide pairs
/// that lists are chosen from have no effect, however nodes have moved since they were found.
#[test]
fn what_acts_does_not_depend_on_where_one_comes_from() {
    let mut random = Random::new(29);
    for thing in things() {
        let mut scene = Scene::new(thing.clone(), 0.3);
        let count = scene.places.len();
        let mut acting = 0;
        for step in 0..30 {
            // Small motions in which wide pairs last, and now and then a large one.
            let size = if step % 10 == 9 { 0.05 } else { 0.003 };
            let motion: Vec<f64> = (0..6 * count).map(|_| size * random.number()).collect();
            scene.begin(&motion);
            let part = scene.step.collision_free_fraction(&scene.places, &motion, 0.0, [0.1, 1.0]);
            let ways = motion.chunks_exact(6).map(|way| Vector3::new(way[0], way[1], way[2]) * part);
            scene.places.iter_mut().zip(ways).for_each(|(x, way)| *x += way);
            let mut fresh = Scene::new(thing.clone(), 0.3);
            fresh.places.clone_from(&scene.places);
            let rows = [&mut scene, &mut fresh].map(|scene| {
                scene.begin(&vec![0.002; 6 * count]);
                let rows = scene.step.normal_collisions().iter();
                rows.map(|collision| (collision.stencil.nodes, collision.energy.to_bits()))
                    .collect::<Vec<_>>()
            });
            assert_eq!(rows[0], rows[1], "step {step}");
            acting += rows[0].len();
        }
        assert!(acting > 100, "{acting}");
    }
}
