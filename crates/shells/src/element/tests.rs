use nalgebra::{DMatrix, DVector, SVector, SymmetricEigen};
use pliant_testing::Random;

use super::*;

const ELASTIC: Elasticity = Elasticity { young: 1e6, poisson: 0.25 };
const THICKNESS: f64 = 0.03;

type Stiffness = fn(&Corners, &PlaneStress, f64) -> Matrix9;

fn opta(corners: &Corners, elastic: &PlaneStress, thickness: f64) -> Matrix9 {
    andes_opt(corners, elastic, thickness, 10.0)
}

fn opt(corners: &Corners, elastic: &PlaneStress, thickness: f64) -> Matrix9 {
    andes_opt(corners, elastic, thickness, f64::INFINITY)
}

fn cst(corners: &Corners, elastic: &PlaneStress, thickness: f64) -> Matrix9 {
    constant_strain(corners, elastic, thickness, 1e-3)
}

const MEMBRANES: [Stiffness; 3] = [opta, opt, cst];
const PLATES: [Stiffness; 2] = [discrete_kirchhoff, comas_2010];

/// 155 triangles of all shapes whose smallest altitude is at least a tenth of their longest edge.
fn triangles() -> Vec<Corners> {
    let mut random = Random::new(7);
    let mut found = Vec::new();
    while found.len() < 155 {
        let corners = [(); 3].map(|()| Vector2::new(random.number(), random.number()));
        let longest = (0..3).map(|i| (corners[i] - corners[(i + 1) % 3]).norm()).fold(0.0, f64::max);
        if 2.0 * area(&corners) > 0.1 * longest * longest {
            found.push(corners);
        }
    }
    found
}

/// (u, v, θz) of a linear displacement.
fn linear(corners: &Corners, h: [f64; 4]) -> SVector<f64, 9> {
    SVector::from_iterator(
        corners.iter().flat_map(|p| [h[0] * p.x + h[1] * p.y, h[2] * p.x + h[3] * p.y, 0.5 * (h[2] - h[1])]),
    )
}

/// (w, θx, θy) of w = (a x² + b y²)/2 + c xy + s x + t y.
fn quadratic(corners: &Corners, [a, b, c, s, t]: [f64; 5]) -> SVector<f64, 9> {
    SVector::from_iterator(corners.iter().flat_map(|p| {
        let w = 0.5 * (a * p.x * p.x + b * p.y * p.y) + c * p.x * p.y + s * p.x + t * p.y;
        [w, b * p.y + c * p.x + t, -(a * p.x + c * p.y + s)]
    }))
}

/// Three zero eigenvalues of nine (1e-13 of the largest), the rest well above.
#[test]
fn three_rigid_motions_and_no_other_mode_cost_nothing() {
    for corners in triangles() {
        for stiffness in MEMBRANES.into_iter().chain(PLATES) {
            let k = stiffness(&corners, &ELASTIC.into(), THICKNESS);
            let mut values: Vec<f64> =
                SymmetricEigen::new(0.5 * (k + k.transpose())).eigenvalues.iter().copied().collect();
            values.sort_by(f64::total_cmp);
            // Scaled like the eigenvectors: lengths of order 1.
            assert!(values[2].abs() < 1e-13 * values[8], "{values:?}");
            assert!(values[3] > 1e-9 * values[8], "{values:?}");
        }
        for membrane in MEMBRANES {
            let k = membrane(&corners, &ELASTIC.into(), THICKNESS);
            let rigid = linear(&corners, [0.0, -1.0, 1.0, 0.0]);
            assert!((k * rigid).norm() < 1e-13 * k.norm() * rigid.norm());
        }
        let k = discrete_kirchhoff(&corners, &ELASTIC.into(), THICKNESS);
        let rigid = quadratic(&corners, [0.0, 0.0, 0.0, 0.7, -0.4]);
        assert!((k * rigid).norm() < 1e-13 * k.norm() * rigid.norm());
    }
}

/// ½ ε D ε t A and ½ κ D κ t³/12 A, to 1e-10.
#[test]
fn constant_strain_and_curvature_have_their_energy() {
    let d = ELASTIC.matrix();
    for corners in triangles() {
        let h = [0.3, -0.2, 0.5, -0.7];
        let strain = nalgebra::Vector3::new(h[0], h[3], h[1] + h[2]);
        let exact = 0.5 * strain.dot(&(d * strain)) * THICKNESS * area(&corners);
        for membrane in MEMBRANES {
            let v = linear(&corners, h);
            let energy = 0.5 * v.dot(&(membrane(&corners, &ELASTIC.into(), THICKNESS) * v));
            assert!((energy / exact - 1.0).abs() < 1e-10, "{energy} {exact}");
        }
        let w = [0.3, -0.8, 0.4, 0.2, 0.1];
        let curvature = nalgebra::Vector3::new(-w[0], -w[1], -2.0 * w[2]);
        let exact = 0.5 * curvature.dot(&(d * curvature)) * THICKNESS.powi(3) / 12.0 * area(&corners);
        for plate in PLATES {
            let v = quadratic(&corners, w);
            let energy = 0.5 * v.dot(&(plate(&corners, &ELASTIC.into(), THICKNESS) * v));
            assert!((energy / exact - 1.0).abs() < 1e-10, "{energy} {exact}");
        }
    }
}

/// The largest change of the stiffness, of its largest entry, when the corners are numbered from the second
/// on.
fn asymmetry(stiffness: Stiffness, corners: &Corners) -> f64 {
    let k = stiffness(corners, &ELASTIC.into(), THICKNESS);
    let turned = stiffness(&[corners[1], corners[2], corners[0]], &ELASTIC.into(), THICKNESS);
    let back = |i: usize| (i + 6) % 9;
    let change = (0..81).map(|at| {
        let (i, j) = (at / 9, at % 9);
        (k[(i, j)] - turned[(back(i), back(j))]).abs()
    });
    change.fold(0.0, f64::max) / k.amax().max(turned.amax())
}

/// Limit 1e-13 for the elements to use; Comas's changes by up to 97 % (reported by the specification).
#[test]
fn only_the_element_of_comas_depends_on_the_order_of_its_corners() {
    let worst = |stiffness| triangles().iter().map(|c| asymmetry(stiffness, c)).fold(0.0, f64::max);
    for stiffness in MEMBRANES.into_iter().chain([discrete_kirchhoff as Stiffness]) {
        let worst = worst(stiffness);
        assert!(worst < 1e-13, "{worst:e}");
    }
    let comas = worst(comas_2010);
    println!("Comas 2010: {comas:.2}");
    assert!(comas > 0.5, "{comas}");
}

/// The patch of MacNeal and Harder (1985): five distorted quadrilaterals, each cut in two.
fn patch() -> (Vec<Vector2<f64>>, Vec<[usize; 3]>) {
    let points = [[0.0, 0.0], [0.24, 0.0], [0.24, 0.12], [0.0, 0.12]]
        .into_iter()
        .chain([[0.04, 0.02], [0.18, 0.03], [0.16, 0.08], [0.08, 0.08]])
        .map(Vector2::from)
        .collect();
    let quadrilaterals = [[0, 1, 5, 4], [1, 2, 6, 5], [2, 3, 7, 6], [3, 0, 4, 7], [4, 5, 6, 7]];
    (points, quadrilaterals.into_iter().flat_map(|[a, b, c, d]| [[a, b, c], [a, c, d]]).collect())
}

/// The largest deviation of the inner nodes from a displacement given at the outer four, over its largest
/// value. Each triangle's first corner is `start` places on.
fn patch_error(
    stiffness: Stiffness,
    field: impl Fn(&Corners) -> SVector<f64, 9>,
    start: impl Fn(usize) -> usize,
) -> f64 {
    let (points, triangles) = patch();
    let mut k = DMatrix::<f64>::zeros(24, 24);
    let mut exact = DVector::<f64>::zeros(24);
    for (number, triangle) in triangles.iter().enumerate() {
        let nodes = [0, 1, 2].map(|i| triangle[(i + start(number)) % 3]);
        let corners = nodes.map(|node| points[node]);
        let (element, values) = (stiffness(&corners, &ELASTIC.into(), 1e-3), field(&corners));
        for i in 0..9 {
            exact[3 * nodes[i / 3] + i % 3] = values[i];
            for j in 0..9 {
                k[(3 * nodes[i / 3] + i % 3, 3 * nodes[j / 3] + j % 3)] += element[(i, j)];
            }
        }
    }
    let inner = k.view((12, 12), (12, 12)).into_owned();
    let right = -(k.view((12, 0), (12, 12)) * exact.rows(0, 12));
    let solution = inner.lu().solve(&right).unwrap();
    // Rotations and deflections have their own sizes.
    (0..3)
        .map(|c| {
            let of = |v: &dyn Fn(usize) -> f64| (0..4).map(|n| v(3 * n + c).abs()).fold(0.0, f64::max);
            of(&|i| solution[i] - exact[12 + i]) / (0..8).map(|n| exact[3 * n + c].abs()).fold(0.0, f64::max)
        })
        .fold(0.0, f64::max)
}

/// Limit 1e-10. The element of Comas misses by more than 1 %, and by how much depends on the numbering.
#[test]
fn macneal_harder_patch_test() {
    let starts: [fn(usize) -> usize; 3] = [|_| 0, |_| 1, |n| (7 * n + n / 3) % 3];
    let bending = |c: &Corners| quadratic(c, [1e-3, 1e-3, 5e-4, 0.0, 0.0]);
    let membrane = |c: &Corners| linear(c, [1e-3, 6e-4, 4e-4, 1e-3]);
    for start in starts {
        for stiffness in [opta, opt] {
            let error = patch_error(stiffness, membrane, start);
            assert!(error < 1e-10, "membrane: {error:e}");
        }
        let error = patch_error(discrete_kirchhoff, bending, start);
        assert!(error < 1e-10, "bending: {error:e}");
        let comas = patch_error(comas_2010, bending, start);
        println!("Comas 2010 misses the patch test by {comas:.2e}");
        assert!(comas > 0.01, "{comas:e}");
    }
}
