//! Fields of contacts by a barrier: pressure and gap of a node, and how far it slides.

use pliant_geometry::{CellKind, io};
use pliant_testing::scenes::{last_row, resumes, run, world};

use super::barriers::{HELD, pressed};

/// A block of 40 × 40 × 20 mm of hexes stands 20 µm above a floor and shrinks along z alone. A pressure of 50
/// Pa presses its top within 0.1 s.
fn standing(run: &str, floor: &str, more: &str) -> String {
    format!(
        "[scene]\nuntil = 1\n[run]\n{run}\n\
         [law.tissue]\ntype = 'neo-hookean'\nyoung-modulus = 5e3\npoisson-ratio = 0\n\
         [body.block]\nmesh = {{ block = {{ size = [0.04, 0.04, 0.02], cells = [6, 6, 3] }}, as = 'hexes' }}\n\
         law = 'tissue'\ndensity = 1000\ndamping = 40\n\
         [obstacle.floor]\nshape = 'half-space'\nat = [0, 0, -2e-5]\n{floor}\n\
         [contact.below]\nbetween = ['block', 'floor']\nfaces = {{ set = 'z-min' }}\nfriction = 0.0\nbarrier-distance = 1e-4\nbarrier-stiffness = 500\n\
         [load.top]\ntype = 'pressure'\non = 'block'\nfaces = {{ set = 'z-max' }}\npressure = 50\nto = 0.1\n\
         [output.history]\ntype = 'csv'\nevery = 0.2\n\
         probes.foot = {{ on = 'block', at = [0.02, 0.02, 0], data = ['displacement', 'contact-force', 'contact-pressure', 'gap', 'slip'] }}\n{more}"
    )
}

const IMPLICIT: &str = "solver = 'implicit'\nstep = 0.02";
const UPRIGHT: &str =
    "[constraint.upright]\ntype = 'fix'\nbody = 'block'\nnodes = 'all'\ncomponents = ['x', 'y']\n";

/// Under a load of 50 Pa the pressure of a node is 50 Pa, and obeys the law of the barrier at its gap. Forces
/// of nodes sum to the force of the contact.
#[test]
fn the_pressure_of_a_node_is_the_load_over_the_area_and_the_law_at_its_gap() {
    let output = "[output.all]\ntype = 'vtu'\nevery = 1\ndata = ['contact-force', 'contact-pressure', 'gap', 'slip']\n";
    let text = standing(IMPLICIT, "", &format!("{UPRIGHT}{output}"));
    let out = tempfile::tempdir().unwrap();
    run(&text, &out.path().join("out"));
    let mesh = io::read(&out.path().join("out/all/000001.vtu")).unwrap().mesh;
    let hexes = &mesh.block(CellKind::Hex).unwrap().nodes;
    let count = *hexes.iter().max().unwrap() as usize + 1;
    let [forces, pressures, gaps, slips] = ["contact-force", "contact-pressure", "gap", "slip"]
        .map(|name| mesh.point_data[name].values.as_slice());
    let (mut feet, mut inner, mut sum, mut off) = (0, 0, 0.0, 0.0);
    for node in 0..count {
        let [x, y, z] = mesh.points[node].into();
        if z > 1e-9 {
            let values = [pressures[node], gaps[node], slips[node]];
            assert!(values.iter().all(|value| value.is_nan()), "node {node}: {values:?}");
            continue;
        }
        feet += 1;
        sum += forces[3 * node + 2];
        let y_of_gap = gaps[node] / 1e-4;
        let law = 500.0 * (2.0 * (y_of_gap - 1.0) * y_of_gap.ln() + (y_of_gap - 1.0).powi(2) / y_of_gap);
        assert!((pressures[node] / law - 1.0).abs() < 1e-9, "{} {law}", pressures[node]);
        assert!(slips[node] < 1e-12, "{}", slips[node]);
        // Hexes share a load among their corners in quarters, triangles in thirds. Only inner nodes, with all
        // six triangles, show the true pressure.
        if [x, y].iter().all(|x| *x > 0.01 && *x < 0.03) {
            inner += 1;
            off = f64::max(off, (pressures[node] / 50.0 - 1.0).abs());
            assert!(off < 2e-3, "{} Pa", pressures[node]);
        }
    }
    let row = last_row(&text);
    println!(
        "{feet} feet, {inner} within are off by {off:.1e}, {} Pa, {sum} N",
        row["probe.foot.contact-pressure"]
    );
    assert!(feet == 49 && inner == 9);
    assert!((sum / -row["contact.below.z"] - 1.0).abs() < 1e-9 && (sum / 0.08 - 1.0).abs() < 1e-3);
}

/// A floor that moves by 10 mm under a held block slides by 10 mm under each node. Its way back adds 5 mm. A
/// floor that carries the block along does not slide. The slip ends with the touch.
#[test]
fn the_slip_of_a_node_is_the_way_of_the_floor() {
    let slips = |floor: &str, more: &str, friction: &str| {
        let text = standing(IMPLICIT, floor, more).replace("friction = 0.0", friction);
        let row = last_row(&text);
        println!("{floor} {friction}: slip {}, {row:?}", row["probe.foot.slip"]);
        row["probe.foot.slip"]
    };
    let there = slips("by = [0.006, 0.008, 0]\nfrom = 0.3\nto = 0.8", UPRIGHT, "friction = 0.0");
    assert!((there / 0.01 - 1.0).abs() < 1e-9, "{there}");
    let table = "by = [0.01, 0, 0]\ncurve = { table = [[0.2, 0], [0.5, 1], [0.9, 0.5]] }";
    let back = slips(table, UPRIGHT, "friction = 0.3");
    // A step that turns back goes less than its halves.
    assert!((back / 0.015 - 1.0).abs() < 1e-9, "{back}");
    let carried = slips("by = [0.006, 0.008, 0]\nfrom = 0.3\nto = 0.8", "", "friction = 0.8");
    assert!(carried < 1e-3 * 0.8, "{carried}");
    let held = "[constraint.top]\ntype = 'fix'\nbody = 'block'\nnodes = { set = 'z-max' }\n";
    let left = slips("by = [0, 0, -0.004]\nfrom = 0.3\nto = 0.8", held, "friction = 0.0");
    assert!(left.is_nan(), "{left}");
}

/// Pressure and slip of a block under a ball that is drawn over it continue with the same bits.
#[test]
fn fields_go_on_with_the_same_bits_in_a_resumed_run() {
    let run = "solver = 'implicit'\nstep = 0.02\ncheckpoint = { every = 0.44 }";
    let text = pressed(run, HELD)
        .replace("by = [0, 0, -0.003]\nto = 0.4", "by = [0.004, 0, -0.003]\nto = 0.8")
        .replace("'gap']", "'contact-pressure', 'gap', 'slip']");
    resumes(&text);
    for colour in ["contact-pressure", "slip"] {
        world(&format!("{text}[view]\ncolour = '{colour}'\n")).unwrap();
    }
    let row = last_row(&text);
    assert!(row["probe.top.slip"] > 1e-4 && row["probe.top.contact-pressure"] > 0.0, "{row:?}");
}

/// A balloon of a shell that bends is filled by volume and comes to lie against a tube around it. No volume
/// is lost, the tube bears a part of the pressure, and the sum of its forces on the balloon is zero.
#[test]
fn a_balloon_of_a_shell_is_filled_in_a_tube() {
    let text = "[scene]\nuntil = 1\n[run]\nsolver = 'implicit'\nstep = 0.02\n\
         [law.rubber]\ntype = 'neo-hookean'\nyoung-modulus = 1e6\npoisson-ratio = 0.4\n\
         [body.balloon]\nmodel = 'shell'\nmesh = { sphere = { radius = 0.03, levels = 2 } }\nlaw = 'rubber'\n\
         density = 1000\nthickness = 0.001\ndamping = 40\n\
         [constraint.air]\ntype = 'volume'\nbody = 'balloon'\nby = 1.5e-5\nto = 0.8\n\
         [obstacle.tube]\nshape = { cylinder = { radius = 0.031, length = 0.2 } }\ninside = true\n\
         [contact.wall]\nbetween = ['balloon', 'tube']\nfriction = 0.2\nbarrier-distance = 2e-4\nthickness = 0\ncheck-intersections = true\n\
         [output.history]\ntype = 'csv'\nevery = 0.2\n\
         probes.side = { on = 'balloon', at = [0.03, 0, 0], data = ['displacement', 'contact-pressure', 'gap', 'slip'] }\n";
    let [row, rest] = ["by = 1.5e-5", "by = 0"].map(|by| last_row(&text.replace("by = 1.5e-5", by)));
    println!("{row:?}");
    let [pressure, gap] = ["contact-pressure", "gap"].map(|field| row[&format!("probe.side.{field}")]);
    let way = row["probe.side.displacement.x"];
    assert!((gap + way - 1e-3).abs() < 1e-9 && gap > 0.0, "{gap} {way}");
    assert!(pressure > 0.1 * row["pressure.air"] && pressure < row["pressure.air"], "{pressure}");
    assert!((row["volume.air"] - rest["volume.air"] - 1.5e-5).abs() < 1e-13, "{}", row["volume.air"]);
    assert!(["x", "y", "z"].iter().all(|axis| row[&format!("contact.wall.{axis}")].abs() < 1e-9));
}
