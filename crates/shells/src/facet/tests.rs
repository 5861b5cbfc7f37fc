//! The force is the gradient of the energy, in any pose; packs do as facets do.

use pliant_geometry::EDGES;
use pliant_linear::lanes::PACK;
use pliant_testing::Random;
use pulp::Arch;

use super::*;
use crate::element::Elasticity;
use crate::facet_packs::{FacetPack, Work};
use crate::rotation::exponential;

const MATERIAL: Wall = Wall { elastic: Elasticity { young: 1e3, poisson: 0.3 }, density: 1000.0 };

type Pose = ([Vector3<f64>; 3], [UnitQuaternion<f64>; 3]);

fn vector(random: &mut Random) -> Vector3<f64> {
    Vector3::from_fn(|_, _| random.number())
}

fn rest() -> [Vector3<f64>; 3] {
    [[0.1, -0.2, 0.3], [1.3, 0.1, 0.2], [0.3, 0.8, 0.7]].map(Vector3::from)
}

fn flat(order: [usize; 3], membrane: Membrane) -> Facet {
    let x = rest();
    let nodes = order.map(|i| i as u32);
    let formulation = Formulation { membrane, ..Formulation::default() };
    Facet::new(nodes, order.map(|i| x[i]), 0.1, MATERIAL, formulation).unwrap()
}

/// Normals that lean by 0.2 to 0.4 rad.
fn normals() -> [Vector3<f64>; 3] {
    let [a, b, c] = rest();
    let normal = (b - a).cross(&(c - a)).normalize();
    [[0.3, 0.1, 0.0], [-0.1, 0.2, 0.1], [0.2, -0.3, 0.1]].map(|n| (normal + Vector3::from(n)).normalize())
}

/// With a curved membrane, one of its edges straight.
fn facet(order: [usize; 3]) -> Facet {
    let mut facet = flat(order, Membrane::default());
    let normals = normals();
    // The edge from the second to the third node of the rest shape.
    let straight = EDGES.map(|edge| edge.map(|corner| order[corner]).iter().all(|&node| node > 0));
    facet.curve(order.map(|i| normals[i]), straight);
    facet
}

/// Mean strain and stiffness equal ANDES-OPT where the normals are the facet's, and where all edges are
/// straight: 1e-13.
#[test]
fn a_curved_membrane_without_curvature_is_andes() {
    let [a, b, c] = rest();
    let normal = (b - a).cross(&(c - a)).normalize();
    let andes = flat([0, 1, 2], Membrane::Opt { adaptation: 10.0 });
    for (normals, straight) in [([normal; 3], [false; 6]), (normals(), [true; 6])] {
        let mut facet = flat([0, 1, 2], Membrane::default());
        facet.curve(normals, straight);
        let off = (facet.stiffness - andes.stiffness).amax() / andes.stiffness.amax();
        assert!(off < 1e-13, "{off:e}");
        let off = (facet.strain.0 - andes.strain.0).amax() / andes.strain.0.amax();
        assert!(off < 1e-13, "{off:e}");
    }
    assert!((facet([0, 1, 2]).stiffness - andes.stiffness).amax() > 1e-3 * andes.stiffness.amax());
}

/// Six rigid motions cost nothing, 1e-12 of the stiffness; no other does.
#[test]
fn a_curved_facet_has_six_rigid_motions() {
    let facet = facet([0, 1, 2]);
    let scale = facet.stiffness.amax();
    for motion in 0..6 {
        let mut rigid = Vector18::zeros();
        for (i, corner) in facet.corners.iter().enumerate() {
            let axis = Vector3::ith(motion % 3, 1.0);
            if motion < 3 {
                rigid.fixed_rows_mut::<3>(6 * i).copy_from(&axis);
            } else {
                rigid.fixed_rows_mut::<3>(6 * i).copy_from(&axis.cross(&corner.push(0.0)));
                rigid.fixed_rows_mut::<3>(6 * i + 3).copy_from(&axis);
            }
        }
        let off = (facet.stiffness * rigid).amax() / scale;
        assert!(off < 1e-12, "{motion}: {off:e}");
    }
    let symmetric = 0.5 * (facet.stiffness + facet.stiffness.transpose());
    let values = SymmetricEigen::new(symmetric).eigenvalues;
    assert_eq!(values.iter().filter(|value| **value > 1e-9 * scale).count(), 12, "{values}");
    assert!(values.min() > -1e-12 * scale);
}

/// A large common rotation, stretch and shear of 5 %, nodes turned by up to 0.3 rad.
fn pose(random: &mut Random, size: f64) -> Pose {
    let common = exponential(&(vector(random) * 2.0));
    let x = rest().map(|x| common * (x + vector(random) * 0.05 * size) + Vector3::new(1.0, 2.0, -3.0));
    let rotation = [(); 3].map(|()| common * exponential(&(vector(random) * 0.3 * size)));
    (x, rotation)
}

fn moved((x, rotation): &Pose, place: usize, by: f64) -> Pose {
    let (mut x, mut rotation) = (*x, *rotation);
    let (node, component) = (place / 6, place % 6);
    if component < 3 {
        x[node][component] += by;
    } else {
        let mut spin = Vector3::zeros();
        spin[component - 3] = by;
        rotation[node] = exponential(&spin) * rotation[node];
    }
    (x, rotation)
}

fn evaluate(facet: &Facet, (x, rotation): &Pose) -> (f64, Vector18) {
    facet.force(&facet.place(x, rotation).unwrap())
}

/// Central differences with steps of 1e-5 agree to 1e-7 of the largest force, as the specification demands.
#[test]
fn force_is_the_gradient_of_the_energy() {
    let mut random = Random::new(1);
    let facet = facet([0, 1, 2]);
    for size in [0.02, 1.0] {
        let pose = pose(&mut random, size);
        let force = evaluate(&facet, &pose).1;
        let h = 1e-5;
        let slope = Vector18::from_fn(|i, _| {
            (evaluate(&facet, &moved(&pose, i, h)).0 - evaluate(&facet, &moved(&pose, i, -h)).0) / (2.0 * h)
        });
        let off = (slope - force).amax() / force.amax();
        println!("force against differences: {off:.1e}");
        assert!(off < 1e-7, "{off:e}");
    }
}

/// Packs of eight facets, the last one not full, give energies, forces and stiffness of single facets to
/// round-off. Facets are curved and under tension, some bent by half a radian.
#[test]
fn packs_have_forces_and_stiffness_of_single_facets() {
    let mut random = Random::new(21);
    for size in [0.0, 0.1, 1.0, 2.0] {
        let orders = [[0, 1, 2], [1, 2, 0], [2, 0, 1]];
        let facets: Vec<Facet> =
            (0..11).map(|k| facet(orders[k % 3]).under_tension(10.0 * k as f64)).collect();
        let packs = FacetPack::packed(Arch::new(), &facets, |node| rest()[node as usize]);
        for (pack, chunk) in packs.iter().zip(facets.chunks(PACK)) {
            let mut work = Work::new();
            let poses: Vec<Pose> = chunk.iter().map(|_| pose(&mut random, size)).collect();
            poses.iter().enumerate().for_each(|(lane, (x, rotation))| work.put(lane, x, rotation));
            work.find(Arch::new(), pack, chunk.len(), true);
            for (lane, (facet, (x, rotation))) in chunk.iter().zip(&poses).enumerate() {
                let placed = &facet.place(x, rotation).unwrap();
                assert_eq!(work.broken(lane), None);
                let ((energy, force), mut tangent) = (work.force(lane), Matrix18::zeros());
                work.take_tangent(lane, &mut tangent);
                let (single_energy, single_force) = facet.force(placed);
                let single = facet.hessian(placed);
                // Places are known to round-off, along which forces work.
                let work = single_force.amax() * x[0].metric_distance(&x[1]);
                let off = [
                    (energy - single_energy).abs() / single_energy.abs().max(work).max(1e-9),
                    (force - single_force).amax() / (facet.stiffness.amax() * size).max(1.0),
                    (tangent - single).amax() / single.amax(),
                ];
                assert!(off.iter().all(|off| *off < 1e-12), "size {size}, lane {lane}: {off:?}");
            }
        }
    }
}

/// Central differences with steps of 1e-5: 1e-6.
#[test]
fn tangent_is_the_derivative_of_the_force() {
    let mut random = Random::new(2);
    let facet = facet([0, 1, 2]);
    for size in [0.02, 1.0] {
        let pose = pose(&mut random, size);
        let placed = facet.place(&pose.0, &pose.1).unwrap();
        let h = 1e-5;
        let mut slope = Matrix18::zeros();
        for j in 0..18 {
            let change = evaluate(&facet, &moved(&pose, j, h)).1 - evaluate(&facet, &moved(&pose, j, -h)).1;
            slope.set_column(j, &(change / (2.0 * h)));
        }
        let k = facet.tangent(&placed);
        let off = (slope - k).amax() / k.amax();
        println!("tangent against differences: {off:.1e}");
        assert!(off < 1e-6, "{off:e}");
    }
}

#[test]
fn forces_and_moments_of_a_facet_balance() {
    let mut random = Random::new(3);
    let facet = facet([0, 1, 2]);
    let pose = pose(&mut random, 1.0);
    let force = evaluate(&facet, &pose).1;
    let part = |i: usize| force.fixed_rows::<3>(3 * i).into_owned();
    let sum = part(0) + part(2) + part(4);
    let moment = (0..3).fold(Vector3::zeros(), |m, i| m + pose.0[i].cross(&part(2 * i)) + part(2 * i + 1));
    assert!(sum.norm() < 1e-12 * force.norm(), "{sum}");
    assert!(moment.norm() < 1e-12 * force.norm() * 5.0, "{moment}");
}

/// E(Q x, Q R) = E(x, R), f turns with Q; 1e-12.
#[test]
fn a_rotation_of_space_turns_the_forces_and_costs_nothing() {
    let mut random = Random::new(4);
    let facet = facet([0, 1, 2]);
    let (x, rotation) = pose(&mut random, 1.0);
    let (energy, force) = evaluate(&facet, &(x, rotation));
    let q = exponential(&Vector3::new(2.0, -1.0, 1.5));
    let turned = (x.map(|x| q * x + Vector3::new(5.0, 0.0, 1.0)), rotation.map(|r| q * r));
    let (same, turned) = evaluate(&facet, &turned);
    assert!((energy - same).abs() < 1e-12 * energy);
    for a in 0..6 {
        let off = turned.fixed_rows::<3>(3 * a) - q * force.fixed_rows::<3>(3 * a).into_owned();
        assert!(off.norm() < 1e-12 * force.norm(), "{off}");
    }
    let rigid = evaluate(&facet, &(rest().map(|x| q * x), [q; 3]));
    assert!(rigid.0 < 1e-24 * energy.max(1.0) && rigid.1.norm() < 1e-12 * force.norm());
}

#[test]
fn the_order_of_the_corners_changes_nothing() {
    let mut random = Random::new(5);
    let (x, rotation) = pose(&mut random, 1.0);
    let (energy, force) = evaluate(&facet([0, 1, 2]), &(x, rotation));
    let order = [1, 2, 0];
    let (same, other) = evaluate(&facet(order), &(order.map(|i| x[i]), order.map(|i| rotation[i])));
    assert!((energy - same).abs() < 1e-12 * energy);
    for (place, &node) in order.iter().enumerate() {
        let off = other.fixed_rows::<6>(6 * place) - force.fixed_rows::<6>(6 * node);
        assert!(off.norm() < 1e-12 * force.norm(), "{off}");
    }
}

#[test]
fn parts_of_the_energy_add_up() {
    let mut random = Random::new(6);
    let (x, rotation) = pose(&mut random, 1.0);
    for membrane in [Membrane::default(), Membrane::Opt { adaptation: f64::INFINITY }] {
        let mut facet = flat([0, 1, 2], membrane);
        facet.curve(normals(), [false; 6]);
        let placed = facet.place(&x, &rotation).unwrap();
        let parts = facet.energy(&placed);
        let whole = facet.force(&placed).0;
        assert!((parts.membrane + parts.bending + parts.drilling - whole).abs() < 1e-12 * whole);
        assert!(parts.membrane > 0.0 && parts.bending > 0.0 && parts.drilling > 0.0);
    }
}

#[test]
fn a_facet_folded_over_or_without_area_is_found() {
    let facet = facet([0, 1, 2]);
    let none = [UnitQuaternion::identity(); 3];
    let flat = [rest()[0], rest()[1], rest()[0]];
    assert!(matches!(facet.place(&flat, &none), Err(Broken::Area(_))));
    let [a, b, c] = rest();
    assert!(matches!(facet.place(&[a, c, b], &none), Err(Broken::Folded(angle)) if angle > 2.0));
}

#[test]
fn packs_at_rest_have_no_deformation_at_all() {
    let mut random = Random::new(9);
    for _ in 0..20 {
        let (corners, _) = pose(&mut random, 1.0);
        let facet = Facet::new([0, 1, 2], corners, 0.1, MATERIAL, Formulation::default()).unwrap();
        let packs = FacetPack::packed(Arch::new(), &[facet], |node| corners[node as usize]);
        let mut work = Work::new();
        work.put(0, &corners, &[UnitQuaternion::identity(); 3]);
        work.find(Arch::new(), &packs[0], 1, false);
        assert_eq!(work.force(0), (0.0, Vector18::zeros()));
    }
}

/// Beside a facet whose rotations have the other sign, which is the same rotation.
#[test]
fn packs_find_what_is_broken_and_nothing_else() {
    let facets = vec![facet([0, 1, 2]); 4];
    let (x, rotation) = pose(&mut Random::new(8), 0.3);
    let negative = rotation.map(|turn| UnitQuaternion::new_unchecked(-turn.into_inner()));
    let none = [UnitQuaternion::identity(); 3];
    let [a, b, c] = rest();
    let (nowhere, flat) = ([Vector3::repeat(f64::NAN); 3], [a, b, a]);
    let poses = [(x, negative), (flat, none), ([a, c, b], none), (nowhere, none)];
    let mut work = Work::new();
    poses.iter().enumerate().for_each(|(lane, (x, turn))| work.put(lane, x, turn));
    let packs = FacetPack::packed(Arch::new(), &facets, |node| rest()[node as usize]);
    work.find(Arch::new(), &packs[0], 4, true);
    let whole = evaluate(&facets[0], &(x, rotation)).1;
    assert!((work.force(0).1 - whole).amax() < 1e-12 * whole.amax());
    assert_eq!(work.broken(0), None);
    assert!(matches!(work.broken(1), Some(Broken::Area(area)) if area.abs() < 1e-20));
    assert!(matches!(work.broken(2), Some(Broken::Folded(angle)) if angle > 2.0));
    assert!(matches!(work.broken(3), Some(Broken::Area(area)) if area.is_nan()));
}
