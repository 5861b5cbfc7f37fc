//! Contact with the solver `explicit` goes with every shape of a tool, every element, law, precision and way
//! to step; a choice of faces; threads.

use pliant_testing::scenes::{last_row, run, world};

use super::contact::{pressed, stacked};
use super::coupled_surfaces::column;

/// Checks that the force of the tool comes out on the floor, in balance, in the mean of the last 0.2 s. Nodes
/// of averaged tets tremble in contact, so the two forces of an instant differ by up to 9 %.
fn goes_through(what: &str, text: &str) -> f64 {
    let out = tempfile::tempdir().unwrap();
    let folder = out.path().join("out");
    let balance = run(&text.replace("every = 0.5", "every = 0.005"), &folder).energy_balance.unwrap();
    let columns = ["contact.above.z", "contact.below.z"].map(|name| column(&folder, name, 0.3));
    assert!(columns[0].len() >= 40, "{}", columns[0].len());
    let [up, down] = columns.map(|forces| forces.iter().sum::<f64>() / forces.len() as f64);
    println!("{what}: {up} N on the tool, {down} N on the floor, energies balance to {balance:.1e}");
    assert!(up > 0.01 && (up / -down - 1.0).abs() < 0.02, "{what}: {up} N and {down} N");
    assert!(balance < 0.01, "{what}: {balance}");
    up
}

/// Every shape presses 2 mm deep, with its lowest point 0.1 mm above the block at first; some turned about.
#[test]
fn every_shape_of_a_tool_presses() {
    let plain = pressed("", "").replace("by = [0, 0, -0.005]", "by = [0, 0, -0.0021]");
    for (shape, height, turn) in [
        ("{ sphere = { radius = 0.01 } }", 0.01, ""),
        ("{ capsule = { radius = 0.005, length = 0.02 } }", 0.005, "[0, 1.5707963267948966, 0]"),
        ("{ cylinder = { radius = 0.008, length = 0.02 } }", 0.01, ""),
        ("{ box = { size = [0.015, 0.012, 0.01] } }", 0.005, "[0, 0, 0.4]"),
        ("{ cone = { radius = 0.01, height = 0.01 } }", 0.01, "[3.141592653589793, 0, 0]"),
        ("'half-space'", 0.0, "[3.141592653589793, 0, 0]"),
        ("{ revolved = { outline = [[-0.01, 0, 0], [-0.01, 0.006, 0.002], [0.02, 0.009, 0]] } }", 0.01, ""),
    ] {
        let turn = if turn.is_empty() { String::new() } else { format!("turn = {turn}\n") };
        let text = plain
            .replace("{ sphere = { radius = 0.01 } }", shape)
            .replace("at = [0.02, 0.02, 0.0301]", &format!("at = [0.02, 0.02, {}]\n{turn}", 0.0201 + height));
        goes_through(shape, &text);
    }
}

/// A capsule beside the block that is turned about the y axis comes down onto it.
#[test]
fn a_tool_that_turns_presses() {
    let text = pressed("", "")
        .replace("{ sphere = { radius = 0.01 } }", "{ capsule = { radius = 0.005, length = 0.02 } }")
        .replace("at = [0.02, 0.02, 0.0301]\nby = [0, 0, -0.005]", "at = [0.03, 0.02, 0.0261]\nturn = [0, 1.5707963267948966, 0]\nrotate = { axis = [0, 1, 0], centre = [0.1, 0.02, 0.0261], angle = -0.05 }");
    goes_through("turned", &text);
}

#[test]
fn contact_goes_with_every_element_law_and_way_to_step() {
    let plain = pressed("", "").replace("by = [0, 0, -0.005]", "by = [0, 0, -0.003]");
    let replaced = |pairs: &[[&str; 2]]| {
        pairs.iter().fold(plain.clone(), |text, [from, to]| {
            assert!(text.contains(from), "{from}");
            text.replace(from, to)
        })
    };
    let hexes = goes_through("hex8", &plain);
    for element in ["tet4", "tet4-anp", "tet4-ianp", "tet4-ianp-niftysim", "hex8-full"] {
        let lines = format!("law = 'tissue'\nelement = '{element}'");
        let mesh = if element.starts_with("tet") { "as = 'tets'" } else { "as = 'hexes'" };
        let found = goes_through(element, &replaced(&[["law = 'tissue'", &lines], ["as = 'hexes'", mesh]]));
        // Coarse cells of another kind.
        assert!((0.7..1.8).contains(&(found / hexes)), "{element}: {found} {hexes}");
    }
    for law in [
        "type = 'st-venant-kirchhoff'\nyoung-modulus = 5e3\npoisson-ratio = 0.3",
        "type = 'transversely-isotropic'\nshear-modulus = 1.8e3\nbulk-modulus = 8e3\nfibre-modulus = 3e3\nfibre = [0, 1, 0]",
        "type = 'neo-hookean'\nyoung-modulus = 5e3\npoisson-ratio = 0.4\nprony = [{ part = 'isochoric', weight = 0.3, time = 0.1 }]",
    ] {
        goes_through(
            law,
            &replaced(&[["type = 'neo-hookean'\nyoung-modulus = 5e3\npoisson-ratio = 0.4", law]]),
        );
    }
    for more in ["precision = 'single'", "mass-scaling = { target-step = 6e-4 }", "step = 1e-4"] {
        let found = goes_through(more, &replaced(&[["[run]\n", &format!("[run]\n{more}\n")]]));
        assert!((found / hexes - 1.0).abs() < 0.02, "{more}: {found} {hexes}");
    }
}

/// Contact uses only the chosen faces. Without the faces that meet, the lid falls into the block; with these
/// faces alone, the force stays the same.
#[test]
fn faces_choose_what_touches() {
    let text = stacked("", "");
    let chosen = |faces: &str| text.replace("thickness = 0\n", &format!("thickness = 0\n{faces}\n"));
    let whole = last_row(&text)["contact.above.z"];
    for faces in ["faces = { set = 'z-min' }", "other-faces = { set = 'z-max' }"] {
        let found = last_row(&chosen(faces))["contact.above.z"];
        println!("{faces}: {found} N of {whole} N");
        assert!((found / whole - 1.0).abs() < 1e-3, "{faces}: {found} {whole}");
    }
    for faces in ["faces = { set = 'z-max' }", "other-faces = { set = 'z-min' }"] {
        // The lid falls into the block at once: the run is short.
        let text =
            chosen(faces).replace("until = 1.0", "until = 0.02").replace("every = 1\n", "every = 0.02\n");
        let row = last_row(&text);
        assert_eq!(row["contact.above.z"], 0.0, "{faces}");
        assert!(row["probe.top.displacement.z"] < -1e-3, "{faces}: {row:?}");
    }
}

/// Contacts with an obstacle, a tool, another body and itself: the same bits with one thread and with three.
#[test]
fn threads_change_no_bit_in_contact() {
    let more = "[tool.ball]\nshape = { sphere = { radius = 0.01 } }\nat = [0.02, 0.02, 0.0511]\nby = [0, 0, -0.004]\nto = 0.1\n\
                [contact.press]\nbetween = ['lid', 'ball']\nfriction = 0.2\n[contact.self]\nbetween = ['block', 'block']\n";
    let text = |threads: u32| {
        stacked(&format!("threads = {threads}"), more)
            .replace("until = 1.0", "until = 0.2")
            .replace("every = 1\n", "every = 0.2\n")
    };
    assert!(world(&text(1)).is_ok(), "{:?}", world(&text(1)).err());
    let [one, three] = [1, 3].map(|threads| last_row(&text(threads)));
    assert!(one["contact.press.z"] > 0.0 && one["contact.above.z"] < 0.0, "{one:?}");
    assert_eq!(one, three);
}

/// Another order of bodies, obstacles, tools and contacts gives the same bits; `contact::all_touch_all` tests
/// the bodies the other way round.
#[test]
fn the_order_of_tables_changes_no_bit() {
    let more = "[tool.ball]\nshape = { sphere = { radius = 0.01 } }\nat = [0.02, 0.02, 0.0511]\nby = [0.003, 0, -0.004]\nto = 0.1\n\
                [contact.press]\nbetween = ['lid', 'ball']\nfriction = 0.2\n";
    // A barrier needs a gap to begin with.
    let plain = stacked("", more)
        .replace("shape = 'half-space'\n", "shape = 'half-space'\nat = [0, 0, -0.0001]\n")
        .replace("thickness = 0\n", "");
    for solver in ["", "solver = 'implicit'\nstep = 0.01"] {
        let text = plain
            .replace("[run]\n", &format!("[run]\n{solver}\n"))
            .replace("until = 1.0", "until = 0.2")
            .replace("every = 1\n", "every = 0.2\n");
        let mut tables: Vec<&str> = text.split_inclusive('\n').collect();
        let starts: Vec<usize> = (0..tables.len()).filter(|&at| tables[at].starts_with('[')).collect();
        let mut reversed = Vec::new();
        for end in (0..starts.len()).rev() {
            reversed.extend(tables.drain(starts[end]..));
        }
        let other = reversed.concat();
        assert!(other != text && other.len() == text.len());
        let [one, two] = [&text, &other].map(|text| last_row(text));
        assert!(one["contact.above.z"] < 0.0 && one["contact.press.z"] > 0.0, "{one:?}");
        assert_eq!(one, two);
    }
}
