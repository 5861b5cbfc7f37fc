//! Smooth fields of voxel bodies.

use nalgebra::{Matrix3, Rotation3, Vector3};
use pliant_geometry::{DistanceField, Grid};
use pliant_imaging::{LabelImage, Smoothing};

const RADIUS: f64 = 0.02;

/// A ball on a grid that may be oblique, anisotropic and left-handed.
fn ball(axes: Matrix3<f64>) -> LabelImage {
    let dims = [48, 48, 48];
    let middle = axes * Vector3::repeat(23.7);
    let grid = Grid::new(dims, Vector3::new(0.1, 0.2, 0.3) - middle, axes).unwrap();
    let inside = |at: usize| {
        let place = grid.position(&grid.triple(at).map(|i| i as f64).into());
        (place - Vector3::new(0.1, 0.2, 0.3)).norm() < RADIUS
    };
    LabelImage { labels: (0..grid.len()).map(|at| i32::from(inside(at))).collect(), grid }
}

fn field(image: &LabelImage, smoothing: &Smoothing) -> DistanceField {
    let region = image.region(&[1], smoothing.margin()).unwrap();
    region.distance_field(smoothing, &|_| {}).unwrap()
}

#[test]
fn the_surface_of_a_ball_is_found_to_a_fraction_of_a_voxel() {
    let tilt = *Rotation3::from_euler_angles(0.3, 0.5, -0.9).matrix();
    let long = Matrix3::from_diagonal(&Vector3::new(1e-3, 1e-3, -2.2e-3));
    // Voxels leave the surface open to half their longest step.
    for (axes, worst) in [(Matrix3::identity() * 1e-3, 0.5e-3), (tilt * 1e-3, 0.5e-3), (tilt * long, 1.1e-3)]
    {
        let field = field(&ball(axes), &Smoothing::default());
        let mut largest = 0.0_f64;
        for at in 0..500 {
            // Points spread over the sphere by the golden angle.
            let z = 1.0 - (2 * at + 1) as f64 / 500.0;
            let (sine, cosine) = (2.399963229728653 * at as f64).sin_cos();
            let normal = Vector3::new((1.0 - z * z).sqrt() * cosine, (1.0 - z * z).sqrt() * sine, z);
            let value = |r: f64| field.value(&(Vector3::new(0.1, 0.2, 0.3) + normal * r));
            let (mut low, mut high) = (0.5 * RADIUS, 1.5 * RADIUS);
            assert!(value(low) > 0.0 && value(high) < 0.0);
            for _ in 0..40 {
                let middle = (low + high) / 2.0;
                if value(middle) > 0.0 { low = middle } else { high = middle }
            }
            largest = largest.max((low - RADIUS).abs());
            let gradient = field.gradient(&(Vector3::new(0.1, 0.2, 0.3) + normal * RADIUS));
            assert!(gradient.dot(&normal) < -0.6, "{gradient}");
        }
        println!("largest error {:.3} mm", largest * 1e3);
        assert!(largest < worst, "{largest}");
    }
}

/// The shift makes the enclosed volume equal to the volume of the voxels.
#[test]
fn the_volume_is_that_of_the_voxels() {
    let image = ball(Matrix3::identity() * 1e-3);
    let field = field(&image, &Smoothing::default());
    let voxels = image.labels.iter().filter(|&&label| label == 1).count() as f64 * 1e-9;
    let [low, high] = field.bounds();
    let n = 100;
    let step = (high - low) / n as f64;
    let inside = (0..n * n * n).filter(|at| {
        let index = Vector3::new((at % n) as f64, (at / n % n) as f64, (at / n / n) as f64).add_scalar(0.5);
        field.value(&(low + step.component_mul(&index))) > 0.0
    });
    let volume = inside.count() as f64 * step.product();
    println!("voxels {:.4} ml, field {:.4} ml", voxels * 1e6, volume * 1e6);
    assert!((volume / voxels - 1.0).abs() < 2e-3);
}

#[test]
fn without_smoothing_the_field_of_a_half_space_is_exact() {
    let grid = Grid::along_axes([20, 20, 20], Vector3::zeros(), [1e-3, 2e-3, 1.5e-3]).unwrap();
    for axis in 0..3 {
        let labels = (0..grid.len()).map(|at| i32::from(grid.triple(at)[axis] < 10)).collect();
        let image = LabelImage { labels, grid };
        let smoothing = Smoothing { sigma: 0.0, clip: 6.0 };
        let region = image.region(&[1], 4).unwrap();
        let field = region.distance_field(&smoothing, &|_| {}).unwrap();
        let h = grid.spacing()[axis];
        let mut place = Vector3::new(9.0e-3, 18.0e-3, 13.5e-3);
        for i in [7.0, 8.3, 9.5, 10.0, 11.6] {
            place[axis] = i * h;
            let exact = (9.5 - i) * h;
            // The shift accounts for voxels at the rim, a little.
            assert!(
                (field.value(&place) - exact).abs() < 0.05 * h,
                "axis {axis} at {i}: {}",
                field.value(&place)
            );
        }
    }
}

#[test]
fn the_thread_count_never_changes_a_bit() {
    let image = ball(Matrix3::identity() * 1.3e-3);
    let with = |count| {
        let pool = rayon::ThreadPoolBuilder::new().num_threads(count).build().unwrap();
        pool.install(|| field(&image, &Smoothing::default()))
    };
    assert_eq!(with(1), with(3));
}
