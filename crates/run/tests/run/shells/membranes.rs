//! Membranes and large strains.

use super::{PLATE, STEPS, THICK, from_file, refused, says, wall};

/// Curved membranes take the pressure of the curved surface, flat ones a third to each corner; other pairs
/// are warned about.
#[test]
pub(super) fn pressures_and_membranes_go_in_pairs() {
    let check = |element: &str, spread: &str| {
        let scene = wall(&[
            (THICK, &format!("{THICK}\n{element}")),
            ("pressure = 1", &format!("pressure = 1\n{spread}")),
        ]);
        let output = scene.check(&[]);
        assert_eq!(output.status(), "checked", "{}", output.err);
        output
    };
    let (flat, lumped, curved) = ("element = \"dkt-opt\"", "spread = \"lumped\"", "spread = \"curved\"");
    for (element, spread) in
        [("", ""), ("", curved), (flat, ""), (flat, lumped), ("element = \"plate\"", curved)]
    {
        let output = check(element, spread);
        assert!(!output.words().contains("does not go with"), "{element} {spread}: {}", output.err);
    }
    let output = check("", lumped);
    says(
        &output,
        &["a lumped pressure does not go with `dkt-curved`, the element of `wall`", "leave `spread` out"],
    );
    let output = check(flat, curved);
    says(&output, &["does not go with the flat membrane of `wall`", "take `element = \"dkt-curved\"`"]);
}

/// R t = 5e-5 m²: edges up to 14 mm on irregular meshes. Normals of a file without any are estimated, and
/// that is said where the wall is curved.
#[test]
pub(super) fn coarse_meshes_of_curved_walls_under_pressure_are_warned_about() {
    let cylinder = |more: &str| {
        let mesh = format!("mesh = {{ cylinder = {{ radius = 0.1, length = 0.2, cells = [12, 6]{more} }} }}");
        let output = wall(&[
            (PLATE, &mesh),
            ("{ set = \"x-min\" }", "{ set = \"z-min\" }"),
            (THICK, "thickness = 5e-4"),
        ])
        .check(&[]);
        assert_eq!(output.status(), "checked", "{}", output.err);
        output
    };
    let output = cylinder(", distortion = 0.2");
    says(
        &output,
        &[
            "of `wall` under pressure have edges above 2 √(R t)",
            "m, above its limit of",
            "take shorter edges or a regular mesh",
        ],
    );
    let regular = cylinder("");
    for output in [&regular, &output] {
        assert!(!output.words().contains("are estimated"), "{}", output.err);
    }
    assert!(!regular.words().contains("2 √(R t)"), "{}", regular.err);
    let points = [
        [0.0, 0.0, 0.0],
        [0.1, 0.0, 0.02],
        [0.2, 0.0, 0.0],
        [0.0, 0.1, 0.0],
        [0.1, 0.1, 0.02],
        [0.2, 0.1, 0.0],
    ];
    let output = from_file(&points, &[&[0, 1, 4], &[0, 4, 3], &[1, 2, 5], &[1, 5, 4]], &[]);
    says(
        &output,
        &["the normals of 4 of 4 curved triangles under pressure are estimated from the triangles"],
    );
}

/// A flat membrane held along its border bulges, with factors and with conjugate gradients; a tension
/// flattens it. Without tension the run gives a warning. Held on one side the membrane has no equilibrium
/// under a pressure, and the error has no infinite residual.
#[test]
pub(super) fn a_slack_membrane_is_told_and_starts() {
    let sides =
        "{ union = [{ set = \"x-min\" }, { set = \"x-max\" }, { set = \"y-min\" }, { set = \"y-max\" }] }";
    let held = |line: &str, run: &str| {
        let workshop = wall(&[
            (THICK, &format!("thickness = 0.002\nelement = \"membrane\"\n{line}")),
            ("{ set = \"x-min\" }", sides),
            ("at = [0.2, 0.05, 0]", "at = [0.1, 0.05, 0]"),
            (STEPS, &format!("load-steps = 2\n{run}")),
        ]);
        let output = workshop.run(&[]);
        output.done();
        let (_, rows) = workshop.table("out/case/history.csv");
        (output, *rows.last().unwrap().last().unwrap(), workshop.read("out/case/convergence.csv"))
    };
    let (output, slack, table) = held("", "");
    says(
        &output,
        &["15 nodes of the membrane lie in one plane", "artificial stiffness", "`pre-tension` [N/m]"],
    );
    assert!(table.starts_with("step,attempt,time,iteration,residual,allowed,found\n1,1,0.5,0,"), "{table}");
    let gradients = "linear = { by = \"conjugate-gradients\", tolerance = 1e-6 }";
    assert!((held("", gradients).1 / slack - 1.0).abs() < 1e-4);
    let (output, taut, _) = held("pre-tension = 100", "");
    assert!(!output.words().contains("artificial"), "{}", output.err);
    assert!(slack > 2e-5 && taut > 0.0 && taut < 0.1 * slack, "{slack} {taut}");

    let output = wall(&[(THICK, "thickness = 0.002\nelement = \"membrane\"")]).run(&[]);
    assert_eq!(output.status(), "failed", "{}", output.err);
    says(&output, &["in `wall`", "a membrane without tension has no transverse stiffness"]);
    assert!(!output.words().contains("inf"), "{}", output.err);
    let plate = "thickness = 0.002\nelement = \"plate\"\npre-tension = 1";
    refused(&[(THICK, plate)], &["`pre-tension` is for a shell with stiffness in its plane"]);
}

/// A wall pulled by half its length gives a warning about large strain, with body, triangle and time; pulled
/// by 1 % it gives none.
#[test]
pub(super) fn large_strains_are_told() {
    let pulled = |by: f64| {
        let workshop = wall(&[
            (
                "[load.push]",
                &format!(
                    "[constraint.pull]\ntype = \"move\"\nbody = \"wall\"\nnodes = {{ set = \"x-max\" }}\n\
                 by = [{by}, 0, 0]\n\n[load.push]"
                ),
            ),
            (STEPS, "load-steps = 10"),
            ("pressure = 1", "pressure = 0"),
        ]);
        let output = workshop.run(&[]);
        (output.done(), output, workshop.read("out/case/summary.md"))
    };
    let (json, output, page) = pulled(0.1);
    let strain = &json["shell_strains"][0];
    assert_eq!((&strain["body"], &strain["time"]), (&"wall".into(), &1.0.into()), "{strain}");
    let largest = strain["largest"].as_f64().unwrap();
    assert!(largest > 0.5 && largest < 0.7, "{strain}");
    // 5 % a load step.
    assert!((strain["above_from"].as_f64().unwrap() - 0.3).abs() < 1e-9, "{strain}");
    let mut warnings = json["warnings"].as_array().unwrap().iter().map(|text| text.as_str().unwrap());
    let warning = warnings.find(|text| text.contains("is strained by")).unwrap();
    let wanted = format!("in triangle {} (counted from 0) at t = 1.000 s", strain["element"]);
    for piece in ["`wall` is strained by", &wanted, "by more than 10 % from t = 0.3000 s on"] {
        assert!(warning.contains(piece), "no `{piece}` in {warning}");
        assert!(page.contains(piece), "no `{piece}` in {page}");
    }
    says(
        &output,
        &[
            "`wall` is strained by",
            "for small strain",
            "`model = \"membrane\"`",
            "a solid, both with a hyper",
        ],
    );
    let (json, output, page) = pulled(0.002);
    // A thin wall that is clamped and pulled has unstable equilibria by its triangles; it has no other
    // warning.
    let warnings = json["warnings"].as_array().unwrap();
    assert!(
        warnings.iter().all(|warning| warning.as_str().unwrap().contains("are unstable")),
        "{}",
        output.err
    );
    assert!(json["shell_strains"][0]["above_from"].is_null(), "{json}");
    assert!(page.contains("| wall | 1."), "{page}");
}

/// The warning's advice works: as a membrane of rubber the wall may be stretched by half, without a warning,
/// and keeps its volume.
#[test]
pub(super) fn a_membrane_takes_the_strain_that_is_too_large_for_a_shell() {
    let workshop = wall(&[
        ("model = \"shell\"", "model = \"membrane\""),
        ("\"st-venant-kirchhoff\"", "\"neo-hookean\""),
        ("poisson-ratio = 0.3", "poisson-ratio = 0.5"),
        ("nodes = { set = \"x-min\" }", "nodes = { set = \"x-min\" }\ncomponents = [\"x\"]"),
        (
            "[load.push]",
            "[constraint.flat]\ntype = \"fix\"\nbody = \"wall\"\nnodes = \"all\"\ncomponents = [\"z\"]\n\n\
             [constraint.side]\ntype = \"fix\"\nbody = \"wall\"\nnodes = { set = \"y-min\" }\ncomponents = [\"y\"]\n\n\
             [constraint.pull]\ntype = \"move\"\nbody = \"wall\"\nnodes = { set = \"x-max\" }\ncomponents = [\"x\"]\n\
             by = [0.1, 0, 0]\n\n[load.push]",
        ),
        ("pressure = 1", "pressure = 0"),
        ("at = [0.2, 0.05, 0] }", "at = [0.1, 0.05, 0], data = [\"current-thickness\"] }"),
    ]);
    let json = workshop.run(&[]).done();
    assert_eq!(json["warnings"], serde_json::json!([]), "{json}");
    let (_, rows) = workshop.table("out/case/history.csv");
    let thickness = rows.last().unwrap().last().unwrap() / 0.002;
    assert!((thickness / 1.5_f64.powf(-0.5) - 1.0).abs() < 1e-4, "{thickness}");
}

/// A wall that is pulled by 1 % between straight ends and free to narrow gets thinner by ν × 1 %. Its faces
/// are strained by 1 %.
#[test]
pub(super) fn a_pulled_shell_tells_how_thin_it_is() {
    let workshop = wall(&[
        (
            "nodes = { set = \"x-min\" }",
            "nodes = { set = \"x-min\" }\ncomponents = [\"x\", \"z\", \"rx\", \"ry\", \"rz\"]",
        ),
        (
            "[load.push]",
            "[constraint.side]\ntype = \"fix\"\nbody = \"wall\"\nnodes = { set = \"y-min\" }\ncomponents = [\"y\", \"rx\", \"rz\"]\n\n\
             [constraint.pull]\ntype = \"move\"\nbody = \"wall\"\nnodes = { set = \"x-max\" }\ncomponents = [\"x\", \"rz\"]\n\
             by = [0.002, 0, 0]\n\n[load.push]",
        ),
        ("pressure = 1", "pressure = 0"),
        (
            "at = [0.2, 0.05, 0] }",
            "at = [0.1, 0.05, 0], data = [\"thickness\", \"current-thickness\", \"surface-strain\"] }",
        ),
    ]);
    workshop.run(&[]).done();
    let (header, rows) = workshop.table("out/case/history.csv");
    let of = |field: &str| {
        let column = header.iter().position(|name| *name == format!("probe.end.{field}")).unwrap();
        [0, rows.len() - 1].map(|row| rows[row][column])
    };
    assert_eq!(of("thickness"), [0.002; 2]);
    let [before, after] = of("current-thickness");
    assert!((before - 0.002).abs() < 1e-15, "{before}");
    // To second order in the strain.
    assert!((after / (0.002 * (1.0 - 0.3 * 0.01)) - 1.0).abs() < 1e-4, "{after}");
    let [before, after] = of("surface-strain");
    assert!(before.abs() < 1e-12 && (after / 0.01 - 1.0).abs() < 1e-4, "{before} {after}");
}
