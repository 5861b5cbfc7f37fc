//! Analytic organs in place of segmented images: liver, brain, and the ventricles and the tumour in it. They
//! are smooth unions and cuts of ellipsoids with a band of sines on top, as defined in the phantom
//! specification of the project. The numbers below are its millimetres; the public interface uses metres.
//! Leaves out the label images (see `voxels.rs` for cells on a grid).

use pliant_geometry::Vector3;

use crate::MeshingError;
use crate::error::require_positive;
use crate::input::field::{ImplicitField, ellipsoid_value};

/// Millimetres in a metre.
const MILLIMETRES: f64 = 1000.0;

/// The available organs.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Organ {
    /// Two lobes, the left one thin; 774 ml at scale 1.
    Liver,
    /// Both hemispheres with sulci 2–3 mm deep and a fissure of about 2 mm; 1.30 l at scale 1.
    Brain,
    /// The two ventricles inside the brain, which do not meet: a mesh keeps only one.
    Ventricles,
    /// The tumour inside the brain.
    Tumour,
}

/// An organ around the origin. Its field is its signed distance only roughly, and more so with depth.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Phantom {
    organ: Organ,
    /// Factor on all lengths.
    scale: f64,
}

impl Phantom {
    /// An organ with all lengths multiplied by `scale`, which must be positive.
    pub fn new(organ: Organ, scale: f64) -> Result<Self, MeshingError> {
        require_positive("scale", scale)?;
        Ok(Self { organ, scale })
    }
}

impl ImplicitField for Phantom {
    fn value(&self, point: &Vector3) -> f64 {
        let x = point * (MILLIMETRES / self.scale);
        let value = match self.organ {
            Organ::Liver => liver(&x),
            Organ::Brain => brain(&x),
            Organ::Ventricles => ventricles(&x),
            Organ::Tumour => tumour(&x),
        };
        value * (self.scale / MILLIMETRES)
    }

    /// A millimetre or two wider than the organ; a test samples it.
    fn bounds(&self) -> (Vector3, Vector3) {
        let (low, high) = match self.organ {
            Organ::Liver => ([-94.0, -60.0, -46.0], [89.0, 61.0, 49.0]),
            Organ::Brain => ([-69.0, -83.0, -61.0], [69.0, 85.0, 61.0]),
            Organ::Ventricles => ([-24.0, -27.0, -7.0], [24.0, 35.0, 15.0]),
            Organ::Tumour => ([17.0, -35.0, -4.0], [47.0, -8.0, 29.0]),
        };
        let metres = self.scale / MILLIMETRES;
        (Vector3::from(low) * metres, Vector3::from(high) * metres)
    }
}

/// Tissue of the brain phantom at a point [m]: 1 brain, 2 ventricles, 3 tumour, 0 outside.
/// Ventricles and tumour count only inside the brain; the tumour wins over the ventricles.
pub fn brain_label(point: &Vector3, scale: f64) -> u32 {
    let x = point * (MILLIMETRES / scale);
    let inside = brain(&x) > 0.0;
    match (inside, tumour(&x) > 0.0, ventricles(&x) > 0.0) {
        (false, _, _) => 0,
        (true, true, _) => 3,
        (true, false, true) => 2,
        (true, false, false) => 1,
    }
}

fn liver(x: &Vector3) -> f64 {
    let right = ell_rotated(x, [-30.0, 0.0, 0.0], [62.0, 58.0, 48.0], 0.3);
    let left = ell_rotated(x, [32.0, 12.0, 14.0], [58.0, 40.0, 20.0], -0.35);
    let mut f = smooth_union(right, left, 14.0);
    f = cut(f, ell(x, [-5.0, -22.0, -52.0], [60.0, 45.0, 34.0]), 10.0);
    f = cut(f, ell(x, [-8.0, -46.0, 8.0], [10.0, 14.0, 80.0]), 6.0);
    f + 2.0 * noise(x, &LIVER_NOISE)
}

fn brain(x: &Vector3) -> f64 {
    let whole = ell(x, [0.0; 3], [66.0, 82.0, 58.0]);
    let phase = 2.2 * noise(x, &BRAIN_NOISE);
    let sulci = ((x.y + 10.0 * phase) / 6.5).sin() * ((x.x + 8.0 * phase) / 9.0).cos();
    let f = whole + 2.2 * sulci * ((x.norm() - 35.0) / 20.0).clamp(0.0, 1.0);
    let deep = ((x.z - 10.0) / 10.0).clamp(0.0, 1.0);
    if deep == 0.0 {
        return f;
    }
    let fissure = 2.2 - (x.x + 1.5 * (x.y / 20.0).sin()).abs();
    cut(f, fissure * deep - 3.0 * (1.0 - deep), 3.0)
}

fn ventricles(x: &Vector3) -> f64 {
    let right = ell_rotated(x, [-14.0, 4.0, 4.0], [7.0, 30.0, 10.0], 0.15);
    let left = ell_rotated(x, [14.0, 4.0, 4.0], [7.0, 30.0, 10.0], -0.15);
    smooth_union(right, left, 4.0)
}

fn tumour(x: &Vector3) -> f64 {
    ell(x, [32.0, -22.0, 12.0], [14.0, 12.0, 15.0]) + 1.2 * noise(x, &TUMOUR_NOISE)
}

/// ell(x; c, r) of the definition [mm].
fn ell(x: &Vector3, centre: [f64; 3], radii: [f64; 3]) -> f64 {
    ellipsoid_value(&(x - Vector3::from(centre)), &radii.into(), 1e-9)
}

/// ell(x; c, r, R) with R = rotz(angle) = [[cos, sin, 0], [−sin, cos, 0], [0, 0, 1]] and p = R (x − c).
fn ell_rotated(x: &Vector3, centre: [f64; 3], radii: [f64; 3], angle: f64) -> f64 {
    let d = x - Vector3::from(centre);
    let (s, c) = angle.sin_cos();
    ellipsoid_value(&Vector3::new(c * d.x + s * d.y, c * d.y - s * d.x, d.z), &radii.into(), 1e-9)
}

/// smin(a, b, k) = b (1 − h) + a h + k h (1 − h), h = clamp(0.5 + 0.5 (a − b)/k, 0, 1).
fn smooth_union(a: f64, b: f64, k: f64) -> f64 {
    let h = (0.5 + 0.5 * (a - b) / k).clamp(0.0, 1.0);
    b * (1.0 - h) + a * h + k * h * (1.0 - h)
}

/// cut(f, g, k) = −smin(−f, g, k): f without g.
fn cut(f: f64, g: f64, k: f64) -> f64 {
    -smooth_union(-f, g, k)
}

/// noise(x) = (1/6) Σ sin(kᵢ·x + φᵢ), rows [kx, ky, kz, φ] with k in 1/mm.
fn noise(x: &Vector3, rows: &[[f64; 4]; 6]) -> f64 {
    rows.iter().map(|[kx, ky, kz, phase]| (kx * x.x + ky * x.y + kz * x.z + phase).sin()).sum::<f64>() / 6.0
}

const LIVER_NOISE: [[f64; 4]; 6] = [
    [0.284966067, -0.356838155, 0.058377612, 3.655977586],
    [-0.063201764, -0.030103043, -0.282043270, 1.003160384],
    [-0.120806535, 0.463978261, 0.031525758, 3.245128347],
    [-0.039275133, -0.093276866, -0.147326810, 6.005358360],
    [0.067292271, -0.033308367, 0.133728342, 1.838286304],
    [0.003387274, 0.215837308, 0.076111089, 1.971832093],
];

const BRAIN_NOISE: [[f64; 4]; 6] = [
    [0.003580658, 0.142392429, 0.128252491, 0.180166973],
    [-0.031203294, -0.055227544, 0.059661605, 0.814980402],
    [0.078213679, -0.193451401, 0.164048604, 3.211529337],
    [0.071249065, -0.014301193, -0.039699109, 4.948888653],
    [0.086342855, -0.021208878, -0.015999731, 3.448192689],
    [-0.091141859, -0.158585870, 0.041362404, 3.037163097],
];

const TUMOUR_NOISE: [[f64; 4]; 6] = [
    [-0.314917734, -0.520074561, -0.097531381, 1.794832667],
    [0.446124430, 0.043081602, -0.217024095, 0.284328218],
    [0.294031777, 0.641977800, 0.107116048, 1.472724066],
    [-0.376309866, 0.628326027, 0.079671748, 5.301770916],
    [-0.032867418, -0.456797772, -0.247120857, 0.381841037],
    [-0.280117506, 0.217311217, -0.024773803, 0.403266666],
];
