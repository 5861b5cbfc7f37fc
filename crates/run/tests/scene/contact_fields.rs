//! Fields of contacts in outputs, and bodies that overlap at the start and are pushed apart.

use std::fs;

use pliant_geometry::{CellKind, io};
use pliant_scene::World;
use pliant_testing::scenes::{last_row, resumes, run, world};

use super::contact::{pressed, stacked};

/// Fields of all bodies in a series; of a node in a table.
const FIELDS: &str = "[output.all]\ntype = 'vtu'\nevery = 0.25\n\
    data = ['displacement', 'contact-force', 'contact-pressure', 'gap', 'slip']\n";

/// Forces of nodes in a series sum to the forces of the contacts in the table; nodes that cannot touch have
/// no value.
#[test]
fn fields_of_contacts_are_written_for_all_nodes() {
    let probe = "probes.foot = { on = 'block', at = [0.02, 0.02, 0], data = ['contact-force', 'contact-pressure', 'gap', 'slip'] }\nprobes.top";
    let text = pressed("", FIELDS).replace("probes.top", probe);
    let out = tempfile::tempdir().unwrap();
    run(&text, &out.path().join("out"));
    let mesh = io::read(&out.path().join("out/all/000002.vtu")).unwrap().mesh;
    let nodes: Vec<usize> =
        mesh.block(CellKind::Hex).unwrap().nodes.iter().map(|&node| node as usize).collect();
    let count = nodes.iter().max().unwrap() + 1;
    let [forces, pressures, gaps, slips] = ["contact-force", "contact-pressure", "gap", "slip"]
        .map(|name| mesh.point_data[name].values.as_slice());
    let row = last_row(&text);
    for (c, axis) in ["x", "y", "z"].into_iter().enumerate() {
        let sum: f64 = (0..count).map(|node| forces[3 * node + c]).sum();
        let contacts = row[&format!("contact.above.{axis}")] + row[&format!("contact.below.{axis}")];
        assert!((sum + contacts).abs() < 1e-9 * row["contact.above.z"], "{axis}: {sum} N and {contacts} N");
    }
    let mut touching = 0;
    for node in 0..count {
        let on_surface = !gaps[node].is_nan();
        assert_eq!(on_surface, !pressures[node].is_nan());
        assert!(gaps[node].is_nan() || gaps[node] > -1e-12);
        let pressed = forces[3 * node..3 * node + 3] != [0.0; 3];
        assert!(!pressed || on_surface && pressures[node] > 0.0 && !slips[node].is_nan(), "node {node}");
        touching += u32::from(pressed);
    }
    println!("{touching} of {count} nodes touch");
    assert!(touching > 81 && gaps[..count].iter().filter(|gap| gap.is_nan()).count() == 7 * 7 * 3);
    // Tools and obstacles have no values.
    assert!(mesh.points.len() > count && gaps[count..].iter().all(|gap| gap.is_nan()));
    let foot = |field: &str| row[&format!("probe.foot.{field}")];
    assert!(foot("contact-force.z") > 0.0 && foot("contact-pressure") > 0.0 && foot("slip") < 1e-4);
    assert!(foot("gap").abs() < 1e-12, "{}", foot("gap"));
}

/// The slip of a lid that slides freely on a block is how far it goes beyond it.
#[test]
fn slip_between_bodies_is_how_far_one_goes_beyond_the_other() {
    let foot = "probes.lid = { on = 'lid', at = [0.0125, 0.0125, 0.02], data = ['displacement', 'slip'] }\n\
                probes.block = { on = 'block', at = [0.02, 0.02, 0.02], data = ['displacement', 'slip'] }\nprobes.top";
    let text = stacked("", "")
        .replace("until = 1.0", "until = 0.3")
        .replace("0.0205] }", "0.02] }")
        .replace("friction = 0.3", "friction = 0.0")
        .replace("probes.top", foot);
    let row = last_row(&text);
    let way = row["probe.lid.displacement.x"] - row["probe.block.displacement.x"];
    let slips = ["lid", "block"].map(|body| row[&format!("probe.{body}.slip")]);
    println!("slips {slips:?} m for a way of {way} m");
    assert!(way > 1e-3 && slips.iter().all(|slip| (slip / way - 1.0).abs() < 0.03), "{slips:?} m of {way} m");
}

#[test]
fn fields_of_contacts_go_on_with_the_same_bits_in_a_resumed_run() {
    let probe = "data = ['contact-force', 'contact-pressure', 'gap', 'slip', 'displacement']";
    let text = pressed("step = 2e-4\ncheckpoint = { every = 0.4 }", "")
        .replace("until = 0.5", "until = 1")
        .replace("every = 0.5", "every = 1")
        .replace("data = ['displacement']", probe);
    resumes(&text);
}

/// A lid that slides on a block, taken up with lists of its own: to the same bits, with its slip.
#[test]
fn bodies_that_slide_on_each_other_go_on_with_the_same_bits_in_a_resumed_run() {
    for precision in ["double", "single"] {
        let run = format!("step = 2e-4\nprecision = '{precision}'\ncheckpoint = {{ every = 0.4 }}");
        let data = "data = ['displacement', 'slip', 'contact-force', 'gap']";
        let foot =
            format!("probes.foot = {{ on = 'lid', at = [0.0125, 0.0125, 0.0205], {data} }}\nprobes.top");
        let text = stacked(&run, "")
            .replace("until = 1.0", "until = 1")
            .replace("friction = 0.3", "friction = 0.05")
            .replace("probes.top", &foot);
        resumes(&text);
        let row = last_row(&text);
        assert!(row["probe.foot.slip"] > 3e-3, "{}", row["probe.foot.slip"]);
    }
}

#[test]
fn fields_of_contacts_without_a_contact_are_refused_with_their_line() {
    let text = pressed("", "");
    let (before, rest) = text.split_once("[contact.below]").unwrap();
    let (_, after) = rest.split_once("[output.history]").unwrap();
    let alone = format!("{before}[output.history]{after}");
    let lonely = "[body.other]\nmesh = { block = { size = [0.01, 0.01, 0.01], cells = [1, 1, 1] }, at = [1, 0, 0] }\n\
                  law = 'tissue'\ndensity = 1000\n";
    for (text, pieces) in [
        (
            format!("{alone}{FIELDS}"),
            ["no body touches anything, so there is no `contact-force`", "[contact.NAME]"],
        ),
        (format!("{alone}[view]\ncolour = 'gap'\n"), ["there is no `gap`", "add a contact"]),
        (format!("{alone}[view]\ncontacts = true\n"), ["there is no `contact-force`", "add a contact"]),
        (
            pressed(
                "",
                &format!("{lonely}[output.other]\ntype = 'vtu'\nevery = 1\non = 'other'\ndata = ['slip']\n"),
            ),
            ["`other` touches nothing, so there is no `slip`", "between = [\"other\", …]"],
        ),
        (
            pressed("", &format!("{lonely}[view]\non = 'other'\ncontacts = true\n")),
            ["`other` touches nothing", "add a contact"],
        ),
        (
            pressed(
                "",
                "[surface.skin]\non = 'block'\nmesh = { block = { size = [0.04, 0.04, 0.02], cells = [9, 9, 5] } }\n\
                 [view]\non = 'skin'\ncolour = 'contact-pressure'\n",
            ),
            ["surfaces have no `contact-pressure`", "to see the body itself"],
        ),
    ] {
        crate::assert_refused(&text, &pieces);
    }
}

/// A note reports a gap that is small for the elements of one body: two legs, half a millimetre apart.
#[test]
fn a_gap_that_is_small_for_the_elements_is_noted() {
    let legs = |gap: f64| {
        let place = tempfile::tempdir().unwrap();
        let mut mesh = pliant_geometry::Mesh::default();
        for z in [0.0, 0.01, 0.01 + gap, 0.02 + gap] {
            let corners = [[0.0, 0.0], [0.01, 0.0], [0.01, 0.01], [0.0, 0.01]];
            mesh.points.extend(corners.map(|[x, y]| pliant_geometry::Vector3::new(x, y, z)));
        }
        mesh.block_mut(CellKind::Hex).nodes.extend(0..16);
        let file = place.path().join("legs.vtu");
        io::write(&file, &mesh).unwrap();
        let text = pressed("", "[contact.itself]\nbetween = ['block', 'block']\n").replace(
            "{ block = { size = [0.04, 0.04, 0.02], cells = [8, 8, 4] }, as = 'hexes' }",
            &format!("{{ file = '{}' }}", file.display()),
        );
        let world = world(&text.replace("0.0301]", "0.05]")).unwrap();
        world.notes().find(|note| note.contains("contact `itself`: the gap of")).cloned()
    };
    let note = legs(5e-4).unwrap();
    assert!(note.contains("the gap of 5.000e-4 m at (") && note.contains("smaller elements"), "{note}");
    assert_eq!(legs(0.008), None);
}

/// The lid begins within the block.
fn overlapping(depth: f64, more: &str) -> String {
    stacked("", more)
        .replace("at = [0.005, 0.005, 0.0205]", &format!("at = [0.005, 0.005, {}]", 0.02 - depth))
        .replace("thickness = 0\n", "thickness = 0\nseparate = true\n")
}

/// The displacement [m] of the node of a body that is nearest to a place at the start.
fn pushed(world: &World, body: usize, at: [f64; 3]) -> [f64; 3] {
    let built = &world.only().unwrap().built;
    let distance = |x: &[f64; 3]| (0..3).map(|c| (x[c] - at[c]).powi(2)).sum::<f64>();
    let nodes = built.model.bodies[body].nodes.clone();
    let nearest = nodes.min_by(|&a, &b| {
        distance(&built.model.rest[a as usize]).total_cmp(&distance(&built.model.rest[b as usize]))
    });
    built.pushed.as_ref().unwrap()[nearest.unwrap() as usize]
}

/// A lid that begins within a block: both give way, together by the overlap. The run starts deformed: its
/// energies balance with the energy stored at the start, and it ends where a run ends that began apart.
#[test]
fn bodies_that_overlap_are_pushed_apart() {
    let text = overlapping(0.0015, "");
    let world = world(&text).unwrap();
    let [down, up] = [pushed(&world, 0, [0.02, 0.02, 0.02]), pushed(&world, 1, [0.02, 0.02, 0.0185])];
    let note = world.notes().find(|note| note.contains("pushed apart")).unwrap();
    println!("{down:?} m and {up:?} m; {note}");
    // Points between the nodes of meshes that do not match need a little more.
    let apart = (up[2] - down[2]) / 0.0015;
    assert!((1.0..1.01).contains(&apart) && up[2] > 2e-4 && down[2] < -2e-4, "{down:?} {up:?}");
    assert!(note.contains("nodes that overlapped were pushed apart before the run, by up to"), "{note}");
    let row = last_row(&text);
    let apart = last_row(&stacked("", ""));
    let [top, other] = [&row, &apart].map(|row| row["probe.top.displacement.z"]);
    println!("lid at {top} m, from apart {other} m; energy off by {}", row["energy.balance"]);
    // The probe began 0.002 m lower.
    assert!((top - 0.002 - other).abs() < 3e-5, "{top} m and {other} m");
    assert!(row["energy.balance"] < 0.02 && row["energy.internal"] > 0.0);
    assert!((row["contact.above.z"] / apart["contact.above.z"] - 1.0).abs() < 0.01);
}

#[test]
fn what_is_stored_at_the_start_is_in_the_book() {
    let text = overlapping(0.0015, "").replace("until = 1.0", "until = 0.01");
    let out = tempfile::tempdir().unwrap();
    run(&text.replace("every = 1\n", "every = 0.001\n"), &out.path().join("out"));
    let table = fs::read_to_string(out.path().join("out/history.csv")).unwrap();
    let mut rows = table.lines().map(|line| line.split(',').collect::<Vec<_>>());
    let names = rows.next().unwrap();
    let column = |name: &str| names.iter().position(|known| *known == name).unwrap();
    let [internal, external, hourglass] =
        ["internal", "external", "hourglass"].map(|name| column(&format!("energy.{name}")));
    let rows: Vec<Vec<f64>> =
        rows.map(|row| row.iter().map(|value| value.parse().unwrap()).collect()).collect();
    println!("stored {:?} J", rows.iter().map(|row| row[internal]).collect::<Vec<_>>());
    assert!(
        rows[0][internal] > 1e-5
            && (rows[0][internal] + rows[0][hourglass] - rows[0][external]).abs() < 1e-12
    );
    // Sudden forces unbalance the first steps (`docs/guide/running.md`).
    let balances: Vec<f64> = rows.iter().map(|row| row[column("energy.balance")]).collect();
    println!("balances {balances:?}");
    assert!(rows.iter().all(|row| row[internal] > 0.0) && balances[10] < 0.05);
}

/// Nodes in a ball are pushed onto its surface, and no farther.
#[test]
fn nodes_in_a_tool_are_pushed_onto_its_surface() {
    let text = pressed("", "")
        .replace("0.0301]", "0.0285]")
        .replace("friction = 0.2", "friction = 0.2\nseparate = true");
    let world = world(&text).unwrap();
    let [x, y, z] = pushed(&world, 0, [0.02, 0.02, 0.02]);
    assert!(x.abs() < 1e-9 && y.abs() < 1e-9 && (z + 0.0015).abs() < 1e-7, "{x} {y} {z}");
    let balance = last_row(&text)["energy.balance"];
    assert!(balance < 0.02, "{balance}");
}

/// A thin plate begins a little within the upper side of the block, between and on nodes. It is left on the
/// side where it comes from.
#[test]
fn faces_are_pushed_to_the_side_of_their_nodes() {
    for (y, width) in [(0.02, 0.004), (0.0213, 0.003), (0.017, 0.012)] {
        let plate = format!("{{ box = {{ size = [0.06, {width}, 0.004] }} }}\nat = [0.02, {y}, 0.021]");
        let text = pressed("", "")
            .replace("{ sphere = { radius = 0.01 } }\nat = [0.02, 0.02, 0.0301]", &plate)
            .replace("friction = 0.2", "friction = 0.2\nseparate = true");
        let world = world(&text).unwrap();
        let ways = world.only().unwrap().built.pushed.clone().unwrap();
        let [low, high] = ways.iter().fold([0.0_f64; 2], |[low, high], u| [low.min(u[2]), high.max(u[2])]);
        println!("{width} m at {y} m: {low} m to {high} m");
        // Points of faces rest on nodes beside the plate, which therefore go farther than its millimetre.
        assert!(high < 1e-6 && (-0.0025..-0.9e-3).contains(&low), "{low} m to {high} m");
    }
}

#[test]
fn what_was_pushed_apart_is_not_so_again_in_a_resumed_run() {
    let run = "[run]\nstep = 1e-4\ncheckpoint = { every = 0.4 }\n";
    resumes(&overlapping(0.001, "").replace("[run]\n", run).replace("until = 1.0", "until = 1"));
}

#[test]
fn overlaps_that_cannot_be_undone_are_refused_with_what_is_left() {
    let fixed = |body: &str| format!("[constraint.{body}]\ntype = 'fix'\nbody = '{body}'\nnodes = 'all'\n");
    for (text, pieces) in [
        (
            overlapping(0.001, &(fixed("lid") + &fixed("block"))),
            ["cannot be pushed apart: an overlap of 0.001", "is left after 400 passes"],
        ),
        (overlapping(0.009, &fixed("block")), ["would invert element", "overlaps must be smaller"]),
        (
            stacked("", "").replace("at = [0.005, 0.005, 0.0205]", "at = [0.005, 0.005, 0.019]"),
            ["`lid` and `block` overlap at the start in", "push them apart with `gap` or `separate = true`"],
        ),
        (
            pressed("", "").replace("0.0301]", "0.0285]"),
            ["in `ball` at the start", "push them apart with `gap` or `separate = true`"],
        ),
    ] {
        crate::assert_refused(&text, &pieces);
    }
}
