//! Walls of layers.

use nalgebra::Vector3;
use pliant_mechanics::load::{Load, LoadKind};
use pliant_shells::element::{Elasticity, Layer, Membrane, Orthotropic};
use pliant_shells::rotation::exponential;

use super::{MATERIAL, fix, ramp, strip};
use crate::*;

/// Two layers, the upper one four times as stiff; ν = 0.
pub(super) fn two_layers() -> [Layer; 2] {
    [1e6, 4e6].map(|young| Layer {
        elastic: Elasticity { young, poisson: 0.0 }.into(),
        thickness: 0.05,
        angle: 0.0,
        density: 1000.0,
    })
}

pub(super) fn layered(
    (points, cells): (Vec<Vector3<f64>>, Vec<[u32; 3]>),
    layers: &[Layer],
    membrane: Membrane,
) -> Assembly {
    let mut model = Assembly::new("shell", points);
    let mut shell = Shell::new("wall", cells, 1.0, MATERIAL);
    shell.layers = layers.to_vec();
    shell.direction = vec![Vector3::new(1.0, 0.0, 0.3)];
    shell.formulation.membrane = membrane;
    model.add_shell(&shell).unwrap();
    model
}

/// A strip of two layers under a moment at its end follows the theory of beams. It bends about its neutral
/// axis with Σ E I, so that its middle surface stretches (Timoshenko 1925, bimetals). This is exact, in
/// statics and where damped motion comes to rest.
#[test]
pub(super) fn timoshenko_two_layer_strip_stretches_as_it_bends() {
    let membrane = Membrane::Cst { drilling: 0.01 };
    let mut model = layered(strip(), &two_layers(), membrane);
    model.model_mut().constraints.push(fix(vec![0, 9, 18], [true; 6]));
    let moment = 1e-4;
    for (nodes, part) in [(vec![8, 26], 0.25), (vec![17], 0.5)] {
        let kind = LoadKind::moment(nodes, [0.0, -moment * part, 0.0]);
        model.model_mut().loads.push(Load::new("moment", kind, ramp()));
    }
    // Heights of the layers' middles and of the neutral axis above the middle surface; width 2, length 8.
    let neutral: f64 = 0.025 * (4.0 - 1.0) / (4.0 + 1.0);
    let inertia = 2.0 * 0.05_f64.powi(3) / 12.0;
    let area = 2.0 * 0.05;
    let rigidity = 1e6 * (inertia + area * (0.025 + neutral).powi(2))
        + 4e6 * (inertia + area * (0.025 - neutral).powi(2));
    let curvature = moment / rigidity;
    let mut state = AssemblyState::at_rest(&model);
    Statics::new(model.clone(), StaticSettings::default()).unwrap().solve(&mut state, 1.0).unwrap();
    for node in [8, 17, 26] {
        let moved = state.displacement(&model, node);
        // Lifted, so that the stiff top is pressed; the middle lies on the side of the neutral axis that is
        // pulled.
        let (lift, stretch) = (curvature * 32.0, curvature * neutral * 8.0);
        assert!((moved.z / lift - 1.0).abs() < 1e-6, "{} {lift}", moved.z);
        assert!((moved.x / stretch - 1.0).abs() < 1e-3, "{} {stretch}", moved.x);
    }
    // The top: E κ times its distance from the neutral axis.
    let mut fields = ShellFields::default();
    fields.fill(&model, &state).unwrap();
    let [top, bottom] = [fields.stress[0][7][(0, 0)], fields.stress[2][7][(0, 0)]];
    assert!((top / (-4e6 * curvature * (0.05 - neutral)) - 1.0).abs() < 1e-3, "{top}");
    assert!((bottom / (1e6 * curvature * (0.05 + neutral)) - 1.0).abs() < 1e-3, "{bottom}");
    assert!((fields.largest[7] / top.abs() - 1.0).abs() < 1e-3);
    assert!((model.mass.iter().sum::<f64>() - 1600.0).abs() < 1e-9);
}

/// Uniform strains and curvatures of layers at odd angles give no force on inner nodes. Every triangle has
/// n = A ε + B κ, m = B ε + D κ, with each membrane.
#[test]
pub(super) fn layers_pass_the_patch_test() {
    let elastic = Orthotropic { young: [2e6, 0.5e6], poisson: 0.3, shear: 0.2e6 };
    let layer =
        |angle: f64, thickness| Layer { elastic, thickness, angle: angle.to_radians(), density: 1000.0 };
    let layers = [layer(25.0, 0.05), layer(-50.0, 0.02), layer(80.0, 0.03)];
    let (mut points, cells) = strip();
    for (node, point) in points.iter_mut().enumerate().filter(|(node, _)| (10..17).contains(node)) {
        *point += Vector3::new((node as f64).sin(), (node as f64).cos(), 0.0) * 0.2;
    }
    // Of the wall itself, whose direction is x.
    let stress = |strain: &Vector3<f64>, curvature: &Vector3<f64>| {
        let (mut n, mut m) = (Vector3::zeros(), Vector3::zeros());
        let mut bottom = -0.05;
        for layer in &layers {
            // Many thin sheets.
            for k in 0..200 {
                let z = bottom + layer.thickness * (f64::from(k) + 0.5) / 200.0;
                let single = pliant_shells::element::Section::new(std::slice::from_ref(layer), 0.0);
                let s = single.in_plane().matrix * (strain + curvature * z);
                n += s * (layer.thickness / 200.0);
                m += s * (z * layer.thickness / 200.0);
            }
            bottom += layer.thickness;
        }
        (n, m)
    };
    let (strain, curvature) = (Vector3::new(3e-7, -1e-7, 2e-7), Vector3::new(2e-6, 1e-6, -3e-6));
    let (n, m) = stress(&strain, &curvature);
    for membrane in [Membrane::default(), Membrane::Cst { drilling: 0.01 }] {
        let model = layered((points.clone(), cells.clone()), &layers, membrane);
        let mut state = AssemblyState::at_rest(&model);
        for ((x, r), rest) in state.position.iter_mut().zip(&mut state.rotation).zip(model.places()) {
            let (a, b) = (rest.x, rest.y);
            let [kx, ky, kxy] = curvature.into();
            x.x += strain.x * a + 0.5 * strain.z * b;
            x.y += strain.y * b + 0.5 * strain.z * a;
            x.z -= 0.5 * (kx * a * a + ky * b * b + kxy * a * b);
            *r = exponential(&Vector3::new(-ky * b - 0.5 * kxy * a, kx * a + 0.5 * kxy * b, 0.0));
        }
        let mut forces = Forces::new(model.clone());
        forces.evaluate(&state).unwrap();
        let largest = forces.internal().iter().fold(0.0_f64, |most, force| most.max(force.abs()));
        for node in 10..16 {
            for force in &forces.internal()[6 * node..6 * node + 6] {
                // Rotations of 1e-5 against each other: linear theory to about that.
                assert!(force.abs() < 1e-3 * largest, "{membrane:?}, node {node}: {force:e} of {largest:e}");
            }
        }
        for cell in 0..model.facets.len() {
            let found = state.resultants(&model, cell).unwrap();
            let (n, m) = (in_space(&n), in_space(&m));
            assert!((found.in_space(&found.membrane) - n).norm() < 1e-3 * n.norm(), "{membrane:?} {cell}");
            assert!((found.in_space(&found.moment) - m).norm() < 1e-3 * m.norm(), "{membrane:?} {cell}");
        }
    }
}

/// A tensor (xx, yy, xy) in the plane z = 0.
pub(super) fn in_space(tensor: &Vector3<f64>) -> nalgebra::Matrix3<f64> {
    nalgebra::Matrix3::new(tensor.x, tensor.z, 0.0, tensor.z, tensor.y, 0.0, 0.0, 0.0, 0.0)
}

/// A simply supported plate of layers 0/90/0 under a pressure q sin(π x/a) sin(π y/b): Navier's series has
/// one term (Jones 1999, 5.3).
#[test]
pub(super) fn navier_orthotropic_plate() {
    let elastic = Orthotropic { young: [25e6, 1e6], poisson: 0.25, shear: 0.5e6 };
    let layer =
        |angle: f64, thickness| Layer { elastic, thickness, angle: angle.to_radians(), density: 1000.0 };
    let layers = [layer(0.0, 0.003), layer(90.0, 0.004), layer(0.0, 0.003)];
    let (a, b, cells) = (1.0, 0.7, 16_u32);
    let row = cells + 1;
    let points = (0..row * row)
        .map(|n| Vector3::new(a * f64::from(n % row), b * f64::from(n / row), 0.0) / f64::from(cells));
    let triangles = (0..cells * cells).flat_map(|c| {
        let at = c % cells + row * (c / cells);
        [[at, at + 1, at + row + 1], [at, at + row + 1, at + row]]
    });
    let mut model = layered((points.collect(), triangles.collect()), &layers, Membrane::default());
    let rim = |n: &u32| [n % row, n / row].iter().any(|&i| i == 0 || i == cells);
    model
        .model_mut()
        .constraints
        .push(fix((0..row * row).filter(rim).collect(), [true, true, true, false, false, false]));
    let pressure = 1e-3;
    for node in 0..row * row {
        let [x, y] =
            [node % row, node / row].map(|i| (std::f64::consts::PI * f64::from(i) / f64::from(cells)).sin());
        let force = Vector3::new(0.0, 0.0, pressure * x * y * a * b / f64::from(cells * cells));
        let kind = LoadKind::force([node], force);
        model.model_mut().loads.push(Load::new("pressure", kind, ramp()));
    }
    let mut state = AssemblyState::at_rest(&model);
    Statics::new(model.clone(), StaticSettings::default()).unwrap().solve(&mut state, 1.0).unwrap();
    let part = 1.0 - 0.25 * 0.25 / 25.0;
    let [stiff, soft] = [25e6 / part, 1e6 / part];
    let (whole, core) = (0.01_f64.powi(3) / 12.0, 0.004_f64.powi(3) / 12.0);
    let d11 = stiff * (whole - core) + soft * core;
    let d22 = soft * (whole - core) + stiff * core;
    let mixed = (0.25 * soft + 2.0 * 0.5e6) * whole;
    let pi2 = std::f64::consts::PI.powi(2);
    let exact =
        pressure / (pi2 * pi2 * (d11 / a.powi(4) + 2.0 * mixed / (a * a * b * b) + d22 / f64::powi(b, 4)));
    let ratio = state.position[(row * row / 2) as usize].z / exact;
    println!("orthotropic plate: w over Navier's {ratio:.4}");
    assert!((ratio - 1.0).abs() < 0.01, "{ratio}");
}
