//! Loads of NiftySim.

use pliant_format::registry::LoadTable;
use pliant_geometry::CellKind;

use super::{RAMP, assert_lines, assert_note, build, imported, with};

/// A factor from the part of the total time that has passed.
pub(super) type Shape = dyn Fn(f64) -> f64;

#[test]
pub(super) fn load_shapes_reach_their_values_where_niftysims_do() {
    let load = |shape: &str| {
        let more = format!(
            "<Constraint Type=\"Fix\" NumNodes=\"3\"><Nodes>0 1 2</Nodes></Constraint>\
             <Constraint Type=\"Force\" DOF=\"1\" NumNodes=\"1\" LoadShape=\"{shape}\"><Nodes>3</Nodes>\
             <Magnitudes Type=\"UNIFORM\">2</Magnitudes></Constraint>"
        );
        let imported = imported(&with(&more));
        let (_, built) = build(&imported);
        (imported, built)
    };
    let total = 0.1;
    // NiftySim's π is 3.14159.
    // π as NiftySim has it.
    #[expect(clippy::approx_constant)]
    let hilly = |s: f64| s * ((4.0 * 3.14159 * s).cos() - 1.0).exp();
    let shapes: [(&str, &Shape, f64); 6] = [
        ("POLY345", &|s: f64| s.powi(3) * (10.0 - 15.0 * s + 6.0 * s * s), 1e-12),
        ("RAMP", &|s: f64| s, 1e-12),
        ("RAMPHOLD", &|s: f64| (s / 0.1).min(1.0), 1e-12),
        ("STEP", &|s: f64| f64::from(u8::from(s > 0.0)), 1e-12),
        // π in single precision, and nine digits.
        ("HILLY", &hilly, 1e-6),
        ("BUMPY", &|s: f64| s.powi(3) * (10.0 - 15.0 * s + 6.0 * s * s), 1e-12),
    ];
    for (name, shape, tolerance) in shapes {
        let (imported, built) = load(name);
        let curve = &built.model.loads[0].curve;
        // NiftySim's last step goes to 101; its POLY345 has come to an end before.
        let last = if ["RAMP", "HILLY"].contains(&name) { 101 } else { 100 };
        for step in 0..=last {
            let s = f64::from(step) / 100.0;
            let off = (curve.value(s * total) - shape(s)).abs();
            assert!(off <= tolerance, "{name} is off by {off:.1e} at {s} of the total time");
        }
        if name == "BUMPY" {
            assert_note(&imported, "has load shape `BUMPY`: treated as POLY345");
        }
    }
}

#[test]
pub(super) fn what_acts_on_the_same_nodes_along_several_axes_becomes_one() {
    let force = |dof: u32| {
        format!(
            "<Constraint Type=\"Force\" DOF=\"{dof}\" NumNodes=\"2\" LoadShape=\"RAMP\"><Nodes>3 1</Nodes>\
             <Magnitudes Type=\"UNIFORM\">-0.{dof}</Magnitudes></Constraint>"
        )
    };
    let imported = imported(&with(&(force(1) + &force(2))));
    assert_lines(&imported, &["each = [0.0, -0.1, -0.2]", RAMP]);
    assert_eq!(imported.scene.matches("[load.").count(), 1);
}

/// NiftySim first sets held components to 0, then adds displaced ones.
#[test]
pub(super) fn where_nodes_are_held_and_displaced_they_are_displaced() {
    let more = "<Constraint Type=\"Fix\" DOF=\"all\" NumNodes=\"4\"><Nodes>0 1 2 3</Nodes></Constraint>\
                <Constraint Type=\"Disp\" DOF=\"2\" NumNodes=\"1\" LoadShape=\"RAMP\"><Nodes>3</Nodes>\
                <Magnitudes Type=\"UNIFORM\">0.1</Magnitudes></Constraint>";
    let (_, built) = build(&imported(&with(more)));
    let held: Vec<_> =
        built.model.constraints.iter().map(|c| (c.nodes.clone(), &c.components[..3])).collect();
    let expected = [
        (vec![0, 1, 2, 3], &[true, true, false][..]),
        (vec![0, 1, 2], &[false, false, true][..]),
        (vec![3], &[false, false, true][..]),
    ];
    assert_eq!(held, expected);
}

#[test]
pub(super) fn pressure_pushes_as_the_listed_faces_are_turned() {
    // The face 0 1 3 has its outward normal along −y in this order; 0 2 3 looks inwards.
    let more = "<Constraint Type=\"Pressure\" NumFaces=\"2\" FaceType=\"Tri\" LoadShape=\"STEP\">\
                <Faces>0 1 3  0 2 3</Faces><Magnitude>7</Magnitude></Constraint>";
    let imported = imported(&with(more));
    let (scene, built) = build(&imported);
    let pressures: Vec<f64> = scene
        .loads
        .iter()
        .map(|(_, load)| match load {
            LoadTable::Pressure(load) => load.pressure,
            other => panic!("{other:?}"),
        })
        .collect();
    assert_eq!(pressures, [7.0, -7.0]);
    assert_eq!(built.model.loads.len(), 2);
    assert_eq!(imported.meshes[0].1.block(CellKind::Triangle).unwrap().len(), 2);
}

/// NiftySim subtracts tractions from the forces on the nodes (`tledTractionConstraint`; its own test asks for
/// that).
#[test]
pub(super) fn traction_pulls_as_niftysim_pulls() {
    let more = "<Constraint Type=\"Traction\" SpecType=\"NORMAL\" LoadShape=\"STEP\">\
                <Normal ToleranceAngle=\"1\">0 -2 0</Normal>\
                <Magnitudes Type=\"UNIFORM\">0 0 5</Magnitudes></Constraint>";
    let imported = imported(&with(more));
    assert_lines(&imported, &["traction = [0.0, 0.0, -5.0]"]);
    assert_note(&imported, "pulls against the given vector");
    // Both tetrahedra have a side along y = 0.
    assert_eq!(imported.meshes[0].1.block(CellKind::Triangle).unwrap().len(), 2);
    build(&imported);
}

#[test]
pub(super) fn a_load_on_all_faces_is_one_on_the_boundary() {
    let more = "<Constraint Type=\"Pressure\" NumFaces=\"all\" LoadShape=\"STEP\"><Magnitude>7</Magnitude></Constraint>";
    let imported = imported(&with(more));
    assert_lines(&imported, &["faces = \"boundary\"", "pressure = 7.0"]);
    build(&imported);
}

#[test]
pub(super) fn gravity_is_an_acceleration_along_a_unit_vector() {
    let gravity = |attribute: &str, nodes: &str| {
        let more = format!(
            "<Constraint Type=\"Gravity\" {attribute} LoadShape=\"STEP\">{nodes}\
             <AccelerationMagnitude>10</AccelerationMagnitude><AccelerationDirection>0 0 -2</AccelerationDirection>\
             </Constraint>"
        );
        imported(&with(&more))
    };
    let whole = gravity("NumNodes=\"all\"", "");
    assert_lines(&whole, &["on = \"model\"", "acceleration = [0.0, 0.0, -10.0]", "curve = \"hold\""]);
    build(&whole);
    let some = gravity("NumNodes=\"2\"", "<Nodes>0 1</Nodes>");
    assert_lines(&some, &["nodes = { set = \"gravity-0\" }", "acceleration = [0.0, 0.0, -10.0]"]);
    build(&some);
}
