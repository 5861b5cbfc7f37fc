//! Walls of layers.

use pliant_testing::scenes::Workshop;

use super::{THICK, refused, wall};

/// Two layers, the upper one four times as stiff, without and with a direction.
pub(super) const LAYERS: &str = "layers = [{ thickness = 0.001 }, { thickness = 0.001, law = \"stiff\" }]";

pub(super) const ALONG: &str = "fibre = [1, 0, 0.2]\nlayers = [{ thickness = 0.001, young-modulus = [1e6, 1e6], poisson-ratio = 0.0, \
                     shear-modulus = 5e5 }, { thickness = 0.001, law = \"stiff\" }]";

/// The cantilever of layers with a force at its end.
pub(super) fn layered(layers: &str, changes: &[(&str, &str)]) -> Workshop {
    let edits = [
        (THICK, layers),
        (
            "poisson-ratio = 0.3",
            "poisson-ratio = 0.0\n[law.stiff]\ntype = \"st-venant-kirchhoff\"\nyoung-modulus = 4e6\npoisson-ratio = 0.0",
        ),
        ("type = \"pressure\"", "type = \"force\""),
        ("faces = \"all\"\npressure = 1", "nodes = { set = \"x-max\" }\ntotal = [0, 0, 1e-6]"),
    ];
    wall(&[&edits[..], changes].concat())
}

/// The deflection is P L³/(3 E I) with E I about the neutral axis of two layers (Timoshenko 1925). Layers
/// turned by a right angle twice give the same, and explicit and implicit motion agree. The mass is the mass
/// of the layers.
#[test]
pub(super) fn a_wall_of_layers_bends_as_a_beam_of_two_materials() {
    let deflection = |workshop: &Workshop| {
        let (_, rows) = workshop.table("out/case/history.csv");
        *rows.last().unwrap().last().unwrap()
    };
    let neutral: f64 = 0.0005 * 3.0 / 5.0;
    let (inertia, area) = (0.1 * 0.001_f64.powi(3) / 12.0, 0.1 * 0.001);
    let rigidity = 1e6 * (inertia + area * (0.0005 + neutral).powi(2))
        + 4e6 * (inertia + area * (0.0005 - neutral).powi(2));
    let exact = 1e-6 * 0.2_f64.powi(3) / (3.0 * rigidity);
    for layers in [LAYERS, ALONG] {
        let workshop = layered(layers, &[]);
        let done = workshop.run(&[]).done();
        let ratio = deflection(&workshop) / exact;
        assert!((ratio - 1.0).abs() < 5e-3, "{layers}: {ratio}");
        assert!((done["mass"].as_f64().unwrap() - 0.04).abs() < 1e-12, "{done}");
    }
    let moved = |solver: &str| {
        let workshop = layered(
            LAYERS,
            &[
                ("\"static\"", solver),
                ("load-steps = 2\n", ""),
                ("until = 1.0", "until = 0.3"),
                ("total = [0, 0, 1e-6]", "total = [0, 0, 1e-6]\ncurve = \"hold\""),
            ],
        );
        workshop.run(&[]).done();
        deflection(&workshop)
    };
    let [explicit, implicit] =
        ["\"explicit\"", "\"implicit\"\nintegrator = \"bdf2\"\nstep = 0.001"].map(moved);
    assert!(explicit > 0.05 * exact && (implicit / explicit - 1.0).abs() < 0.01, "{explicit} {implicit}");
}

#[test]
pub(super) fn layers_that_say_too_little_or_too_much_are_refused() {
    let orthotropic = "young-modulus = [2e6, 1e6], poisson-ratio = 0.3, shear-modulus = 4e5";
    for (layers, pieces) in [
        (
            format!("layers = [{{ thickness = 1e-3, {orthotropic} }}]"),
            ["no direction is given", "`fibre = [x, y, z]`"],
        ),
        (
            format!("fibre = [0, 0, 1]\nlayers = [{{ thickness = 1e-3, {orthotropic} }}]"),
            ["is perpendicular to element 0", "along the wall"],
        ),
        (
            "layers = [{ thickness = 1e-3, young-modulus = [2e6, 1e6] }]".into(),
            ["has incomplete or conflicting elastic constants", "`shear-modulus`"],
        ),
        (
            format!(
                "fibre = [1, 0, 0]\nlayers = [{{ thickness = 1e-3, {} }}]",
                orthotropic.replace("0.3", "1.5")
            ),
            ["Poisson's ratio of layer 0 of `wall` is 1.5", "below √(E₁/E₂) in size"],
        ),
        (
            format!("{THICK}\nlayers = [{{ thickness = 1e-3 }}]"),
            ["`thickness` is for a shell without `layers`", "remove it"],
        ),
        ("layers = [{ thickness = 0 }]".into(), ["must be greater than 0", "found 0"]),
        ("layers = [{ thickness = 1e-3, law = \"none\" }]".into(), ["there is no law `none`", "wall"]),
    ] {
        refused(&[(THICK, &layers)], &pieces);
    }
}
