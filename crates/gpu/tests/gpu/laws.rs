//! Every law in WGSL against its Rust twin in double precision. The twin in single precision is compared,
//! too.
//!
//! An error is measured in the Frobenius norm, part by part, relative to |S| + M |H|. Here M is the part's
//! modulus at rest (longitudinal modulus without κ; κ). Strains are sums of terms of the size of H, each
//! rounded. So small strains without rotation count relative to their own stress. Strains under a large
//! rotation count relative to the digits that the rotation leaves.

use naga::valid::{Capabilities, ValidationFlags, Validator};
use pliant_gpu::Device;
use pliant_mechanics::Number;
use pliant_mechanics::law::samples::{every_law, law, merged, term};
use pliant_mechanics::law::{AnyLaw, Deformation};
use pliant_mechanics::tensor::{Symmetric, Tensor, Vector, cross, dot, scale, sub};
use pliant_testing::Random;
use serde_json::json;

use crate::compute::compute;
use crate::support;

const EPSILON: f64 = f32::EPSILON as f64;

/// The laws that tests run, and what else their snippets can do.
fn laws() -> Vec<AnyLaw> {
    let moduli = json!({ "shear-modulus": 0.7, "bulk-modulus": 5.0 });
    let aligned = json!({ "fibre-modulus": 0.9, "fibre-exponent": 0.8 });
    let six: Vec<_> = (1..7).map(|k| term(0.1, 1.5 * f64::from(k) - 5.0)).collect();
    let more = [
        law("holzapfel-gasser-ogden", merged(moduli, aligned)),
        law("ogden", json!({ "terms": six, "bulk-modulus": 5.0 })),
        law("ogden", json!({ "terms": [term(0.7, 2.0)], "poisson-ratio": 0.49 })),
    ];
    every_law().into_iter().filter(|law| law.shader().is_some()).chain(more).collect()
}

/// A number of a magnitude between the two, every order of magnitude as likely as another.
fn magnitude(random: &mut Random, least: f64, largest: f64) -> f64 {
    least * (largest / least).powf(0.5 + 0.5 * random.number())
}

/// A unit vector.
fn direction(random: &mut Random) -> Vector<f64> {
    loop {
        let v = random.vector();
        let square = dot(v, v);
        if (0.01..1.0).contains(&square) {
            return scale(v, square.sqrt().recip());
        }
    }
}

/// R − I about a random axis, by Rodrigues' formula.
fn rotation_change(random: &mut Random) -> Tensor<f64> {
    let ([x, y, z], angle) = (direction(random), magnitude(random, 1e-4, 3.0));
    let skew = Tensor([[0.0, -z, y], [z, 0.0, -x], [-y, x, 0.0]]);
    let squared = skew.times_symmetric(&Symmetric::IDENTITY).0.map(|row| skew.transpose().apply(row));
    Tensor(skew.0.map(|row| scale(row, angle.sin()))).plus_scaled(&Tensor(squared), 1.0 - angle.cos())
}

/// U − I with principal values between −`size` and `size` along random directions.
fn stretch(random: &mut Random, size: f64) -> Tensor<f64> {
    let (a, other) = (direction(random), direction(random));
    let b = sub(other, scale(a, dot(a, other)));
    let b = scale(b, dot(b, b).sqrt().recip());
    let c = cross(a, b);
    let mut h = Tensor::ZERO;
    for direction in [a, b, c] {
        h.add_outer(scale(direction, size * random.number()), direction);
    }
    h
}

/// A displacement gradient and two fibres, in single precision.
struct Sample {
    h: [[f32; 3]; 3],
    fibres: [Vector<f32>; 2],
}

impl Sample {
    fn new(h: &Tensor<f64>, random: &mut Random) -> Self {
        let fibres = [direction(random), direction(random)].map(|a| a.map(|x| x as f32));
        Self { h: h.0.map(|row| row.map(|x| x as f32)), fibres }
    }

    fn deformation(&self) -> Deformation<f64> {
        Deformation::from_displacement_gradient(&Tensor(self.h.map(|row| row.map(f64::from))))
    }

    /// |H|.
    fn size(&self) -> f64 {
        self.h.as_flattened().iter().map(|&x| f64::from(x).powi(2)).sum::<f64>().sqrt()
    }
}

/// Strains of 1e-6 to 60 %, half of them above 10 %, every other one under a rotation; rest, dilations,
/// nearly diagonal tensors.
fn samples() -> Vec<Sample> {
    let mut random = Random::new(7);
    let mut samples: Vec<Sample> = (0..1000)
        .map(|k| {
            let size = magnitude(&mut random, if k % 4 < 2 { 1e-6 } else { 0.1 }, 0.6);
            let mut h = stretch(&mut random, size);
            if k % 2 == 1 {
                // R U − I = (R − I) + (U − I) + (R − I)(U − I).
                let turn = rotation_change(&mut random);
                let columns = h.transpose().0.map(|column| turn.apply(column));
                h = h.plus_scaled(&turn, 1.0).plus_scaled(&Tensor(columns).transpose(), 1.0);
            }
            Sample::new(&h, &mut random)
        })
        .collect();
    let special = [[0.0, 0.0], [0.3, 0.0], [-0.3, 0.0], [1e-6, 0.0], [0.1, 3e-20], [0.0, 1e-12]];
    for [dilation, shear] in special {
        let h = Tensor([[dilation, shear, 0.0], [0.0, dilation, 0.0], [0.0, 0.0, dilation]]);
        samples.push(Sample::new(&h, &mut random));
    }
    samples
}

/// A module around a law's text: an `invocation` for each element of `results`, from `given` numbers.
fn module(source: &str, results: &str, invocation: &str) -> String {
    format!(
        "{source}
@group(0) @binding(0) var<storage, read> parameters: array<f32>;
@group(0) @binding(1) var<storage, read> given: array<f32>;
@group(0) @binding(2) var<storage, read_write> results: array<{results}>;

fn parameter(index: u32) -> f32 {{
    return parameters[index];
}}

fn given_vector(at: u32) -> vec3f {{
    return vec3f(given[at], given[at + 1], given[at + 2]);
}}

@compute @workgroup_size(64)
fn main(@builtin(global_invocation_id) id: vec3u) {{
    let index = id.x;
    // Every array is bound, so every one must be used.
    _ = parameters[0];
    if index < arrayLength(&results) {{
        {invocation}
    }}
}}
"
    )
}

const STRESS: &str = "
        let at = 15 * index;
        let h = transpose(mat3x3f(given_vector(at), given_vector(at + 3), given_vector(at + 6)));
        let stress = law_stress(deformation(h), given_vector(at + 9), given_vector(at + 12));
        results[index] = array(
            stress.isochoric.diagonal.x, stress.isochoric.diagonal.y, stress.isochoric.diagonal.z,
            stress.isochoric.shear.x, stress.isochoric.shear.y, stress.isochoric.shear.z,
            stress.volumetric.diagonal.x, stress.volumetric.diagonal.y, stress.volumetric.diagonal.z,
            stress.volumetric.shear.x, stress.volumetric.shear.y, stress.volumetric.shear.z,
        );";

/// A number for each component, at every sample.
fn at_samples<const N: usize>(
    device: &Device,
    law: &AnyLaw,
    samples: &[Sample],
    invocation: &str,
) -> Vec<[f32; N]> {
    let shader = law.shader().unwrap();
    let given: Vec<f32> = samples
        .iter()
        .flat_map(|sample| [sample.h.as_flattened(), sample.fibres.as_flattened()].concat())
        .collect();
    let source = module(&shader.source, &format!("array<f32, {N}>"), invocation);
    let results = compute(device, &source, samples.len(), &[&shader.parameters, &given], N * samples.len());
    results.as_chunks().0.to_vec()
}

/// The two parts of the stress at every sample.
fn stresses(device: &Device, law: &AnyLaw, samples: &[Sample]) -> Vec<[Symmetric<f32>; 2]> {
    let parts = at_samples::<12>(device, law, samples, STRESS).into_iter();
    parts.map(|s| [0, 6].map(|first| Symmetric([0, 1, 2, 3, 4, 5].map(|k| s[first + k])))).collect()
}

fn norm(s: &Symmetric<f64>) -> f64 {
    s.commuting_product(s).trace().sqrt()
}

/// An error relative to its scale, infinite if it is not a number.
fn relative(error: f64, scale: f64) -> f64 {
    let relative = if error == 0.0 { 0.0 } else { (error / scale).abs() };
    if relative.is_nan() { f64::INFINITY } else { relative }
}

fn largest(errors: impl Iterator<Item = f64>) -> f64 {
    errors.fold(0.0, f64::max)
}

/// The error of the two parts, each relative to its scale; infinite if a result is not finite. None beyond
/// the limit of a law that locks.
fn errors(law: &AnyLaw, sample: &Sample, found: &[Symmetric<f32>; 2]) -> [f64; 2] {
    let fibres = sample.fibres.map(|a| a.map(f64::from));
    let exact = law.stress(&sample.deformation(), &fibres[..law.families()]);
    let bulk = law.small_strain().bulk;
    let part = |exact: &Symmetric<f64>, modulus: f64, found: &Symmetric<f32>| {
        let error = norm(&(Symmetric(found.0.map(f64::from)) - *exact));
        let scale = norm(exact) + modulus * sample.size();
        if scale.is_finite() { relative(error, scale) } else { 0.0 }
    };
    [
        part(&exact.isochoric, law.longitudinal_modulus() - bulk, &found[0]),
        part(&exact.volumetric, bulk, &found[1]),
    ]
}

fn worst(errors: impl Iterator<Item = [f64; 2]>) -> [f64; 2] {
    errors.fold([0.0; 2], |worst, error| [worst[0].max(error[0]), worst[1].max(error[1])])
}

/// The twin in single precision.
fn single(law: &AnyLaw, sample: &Sample) -> [Symmetric<f32>; 2] {
    let deformation = Deformation::<f32>::from_displacement_gradient(&Tensor(sample.h));
    let stress = law.stress(&deformation, &sample.fibres[..law.families()]);
    [stress.isochoric, stress.volumetric]
}

#[test]
fn stresses_follow_double_precision_as_closely_as_single_precision_does() {
    let Some(device) = support::device() else { return };
    let samples = samples();
    for law in laws() {
        let on_device = stresses(&device, &law, &samples);
        let gpu = worst(samples.iter().zip(&on_device).map(|(sample, s)| errors(&law, sample, s)));
        let cpu = worst(samples.iter().map(|sample| errors(&law, sample, &single(&law, sample))));
        println!(
            "{:24} device {:.1e} {:.1e}, processor {:.1e} {:.1e}",
            law.name(),
            gpu[0],
            gpu[1],
            cpu[0],
            cpu[1]
        );
        for part in [0, 1] {
            // The same operations, but in another order, joined, or with divisions and functions that are a
            // few units in the last place off.
            let bound = 3.0 * cpu[part] + 4.0 * EPSILON;
            assert!(cpu[part] < 2e-5 && gpu[part] <= bound, "{law:?}: part {part} off by {:e}", gpu[part]);
        }
        let rest = samples.iter().position(|sample| sample.size() == 0.0).unwrap();
        assert!(on_device[rest].iter().all(|s| s.0 == [0.0; 6]), "{law:?} at rest: {:?}", on_device[rest]);
    }
}

/// Returns the expression at every one of the given numbers, `x`.
fn values(device: &Device, law: &AnyLaw, expression: &str, given: &[f32]) -> Vec<f32> {
    let shader = law.shader().unwrap();
    let invocation = format!("let x = given[index];\n        results[index] = {expression};");
    let source = module(&shader.source, "f32", &invocation);
    compute(device, &source, given.len(), &[&shader.parameters, given], given.len())
}

/// U′(J) from the stress S = J U′ C⁻¹ of a law in the pure dilation with this J − 1.
fn pressure<R: Number>(law: &AnyLaw, volume_change: R) -> R {
    let (c, o) = ((R::ONE + volume_change).cbrt(), R::ZERO);
    let stretch = volume_change / (c * c + c + R::ONE);
    let h = Tensor([[stretch, o, o], [o, stretch, o], [o, o, stretch]]);
    let any = [[R::ONE, o, o]; 2];
    let stress = law.stress(&Deformation::from_displacement_gradient(&h), &any[..law.families()]);
    stress.volumetric.0[0] / c
}

#[test]
fn pressures_follow_double_precision_as_closely_as_single_precision_does() {
    let Some(device) = support::device() else { return };
    let mut random = Random::new(5);
    let mut changes: Vec<f32> =
        (0..200).map(|_| (magnitude(&mut random, 1e-7, 0.9) * random.number().signum()) as f32).collect();
    changes.push(0.0);
    for law in laws().into_iter().filter(AnyLaw::has_volumetric_energy) {
        let found = values(&device, &law, "law_pressure(x)", &changes);
        let off = |x: f32, p: f32| {
            let exact = pressure(&law, f64::from(x));
            relative(f64::from(p) - exact, exact)
        };
        let gpu = largest(changes.iter().zip(&found).map(|(&x, &p)| off(x, p)));
        let cpu = largest(changes.iter().map(|&x| off(x, pressure(&law, x))));
        println!("{:24} device {gpu:.1e}, processor {cpu:.1e}", law.name());
        assert!(gpu <= 3.0 * cpu + 4.0 * EPSILON, "{law:?}: pressure off by {gpu:e}");
    }
}

#[test]
fn what_locks_or_overflows_is_not_finite() {
    let Some(device) = support::device() else { return };
    // Simple shear by 10: Ī₁ − 3 = 100.
    let sheared = Sample { h: [[0.0, 10.0, 0.0], [0.0; 3], [0.0; 3]], fibres: [[0.0, 1.0, 0.0]; 2] };
    let stiffening = ["gent", "demiray", "veronda-westmann", "holzapfel-gasser-ogden", "fung-orthotropic"];
    for law in laws().iter().filter(|law| stiffening.contains(&law.name())) {
        let [isochoric, _] = stresses(&device, law, std::slice::from_ref(&sheared))[0];
        assert!(isochoric.0.iter().any(|s| !s.is_finite()), "{law:?}: {isochoric:?}");
    }
}

#[test]
fn products_and_cofactors_of_gradients_are_those_of_tensors() {
    let Some(device) = support::device() else { return };
    let samples = samples();
    let invocation = "
        let at = 15 * index;
        let h = transpose(mat3x3f(given_vector(at), given_vector(at + 3), given_vector(at + 6)));
        let d = deformation(h);
        let product = gradient_times(d.gradient, Symmetric(given_vector(at + 9), given_vector(at + 12)));
        let other = cofactor(d.gradient);
        results[index] = array(
            product[0].x, product[1].x, product[2].x, product[0].y, product[1].y, product[2].y,
            product[0].z, product[1].z, product[2].z,
            other[0].x, other[1].x, other[2].x, other[0].y, other[1].y, other[2].y,
            other[0].z, other[1].z, other[2].z,
        );";
    for (sample, found) in samples.iter().zip(at_samples::<18>(&device, &laws()[0], &samples, invocation)) {
        let f = sample.deformation().gradient;
        let [[a, b, c], [d, e, g]] = sample.fibres.map(|a| a.map(f64::from));
        let exact = [f.times_symmetric(&Symmetric([a, b, c, d, e, g])), f.cofactor()];
        for (k, exact) in exact.iter().flat_map(|t| t.0.as_flattened()).enumerate() {
            // Sums of three products of numbers up to 1.6, or two such sums, of a gradient rounded once.
            assert!((f64::from(found[k]) - exact).abs() < 10.0 * EPSILON, "component {k} of {:?}", sample.h);
        }
    }
}

#[test]
fn every_law_is_valid_without_any_optional_feature() {
    for law in laws() {
        let pressure = if law.has_volumetric_energy() { "law_pressure(given[index])" } else { "0.0" };
        let invocation = format!("{STRESS}\n        results[index][0] += {pressure};");
        let source = module(&law.shader().unwrap().source, "array<f32, 12>", &invocation);
        let parsed =
            naga::front::wgsl::parse_str(&source).unwrap_or_else(|e| panic!("{}", e.emit_to_string(&source)));
        let mut validator = Validator::new(ValidationFlags::all(), Capabilities::empty());
        validator.validate(&parsed).unwrap_or_else(|e| panic!("{law:?}: {}", e.emit_to_string(&source)));
    }
}

#[test]
fn functions_of_one_number_keep_their_relative_digits() {
    let Some(device) = support::device() else { return };
    let mut random = Random::new(3);
    // From 1e-9 on, below and above zero.
    let mut magnitudes = |largest: f64| -> Vec<f32> {
        (0..20_000)
            .map(|_| (magnitude(&mut random, 1e-9, largest) * random.number().signum()) as f32)
            .collect()
    };
    let changes: Vec<f32> = magnitudes(20.0).into_iter().filter(|x| *x > -0.999).collect();
    let ratios: Vec<f32> = changes.iter().map(|x| 1.0 + x).collect();
    let exponents = magnitudes(80.0);
    type Exact = fn(f64) -> f64;
    let functions: [(&str, Exact, &[f32]); 5] = [
        ("ln_1p", f64::ln_1p, &changes),
        ("cbrt", f64::cbrt, &ratios),
        ("inverse_cbrt", |x| x.cbrt().recip(), &ratios),
        ("exp_m1", f64::exp_m1, &exponents),
        ("exponential", f64::exp, &exponents),
    ];
    let plain = laws()[0];
    for (name, exact, given) in functions {
        let call = format!("{name}(x)");
        let off = |(&x, y): (&f32, f32)| {
            let exact = exact(f64::from(x));
            relative(f64::from(y) - exact, exact)
        };
        let error = largest(given.iter().zip(values(&device, &plain, &call, given)).map(off));
        println!("{name:24} {error:.1e}");
        assert!(error < 3e-7, "{name} is off by {error:e}");
        assert!(values(&device, &plain, &call, &[f32::NAN])[0].is_nan(), "{name} of what is not a number");
    }
}
