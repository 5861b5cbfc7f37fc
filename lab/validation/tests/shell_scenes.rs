//! The benchmarks of shells as scene files (`scenes/shells/`). The tests run them as a user does and read
//! their tables. References and tolerances are the same as in `shell_linear.rs` and
//! `shell_large_rotation.rs`. The prototype's numbers of curved walls are for `dkt-opt`.

use std::path::Path;

use pliant_format::{Scene, open};
use pliant_run::{OutputFolder, run};
use pliant_scene::World;
use pliant_validation::{claim, numbers, reference};

/// The table over time that a scene wrote.
struct Table {
    header: Vec<String>,
    rows: Vec<Vec<f64>>,
}

impl Table {
    fn column(&self, name: &str) -> Vec<f64> {
        let at = self.header.iter().position(|column| column == name);
        let at = at.unwrap_or_else(|| panic!("no column {name} in {:?}", self.header));
        self.rows.iter().map(|row| row[at]).collect()
    }

    fn last(&self, name: &str) -> f64 {
        self.column(name)[self.rows.len() - 1]
    }

    /// The value of a column at the instant closest to a time.
    fn at(&self, time: f64, name: &str) -> f64 {
        let times = self.column("time");
        let off = |row: &usize| (times[*row] - time).abs();
        let row = (0..times.len()).min_by(|a, b| off(a).total_cmp(&off(b))).unwrap();
        assert!(off(&row) < 1e-9, "no row at {time}");
        self.column(name)[row]
    }
}

/// Runs a scene with some of its values changed and reads its table.
fn table(name: &str, changes: &[&str]) -> Table {
    let path = Path::new(env!("CARGO_MANIFEST_DIR")).join("scenes/shells").join(format!("{name}.toml"));
    let (mut source, folder) = open(&path).unwrap();
    for change in changes {
        source.assign(change).unwrap_or_else(|error| panic!("{change}: {error:?}"));
    }
    let scene = Scene::from_source(source, folder).unwrap_or_else(|error| panic!("{}", error.plain()));
    let world = World::new(&scene).unwrap_or_else(|error| panic!("{}", error.plain()));
    let out = tempfile::tempdir().unwrap();
    let outputs = OutputFolder::prepare(out.path().join(name), &scene, false).unwrap();
    let summary = run(&world, &outputs, &mut |_| {}).unwrap();
    let report = serde_json::to_value(&summary).unwrap();
    assert_eq!(report["status"], "done", "{name}: {report}");
    let text = std::fs::read_to_string(outputs.path().join("history.csv")).unwrap();
    let mut lines = text.lines();
    let header = lines.next().unwrap().split(',').map(str::to_owned).collect();
    let rows = lines.map(|line| line.split(',').map(|value| value.parse().unwrap()).collect()).collect();
    Table { header, rows }
}

/// Prints a ratio and the expected ratio, and asserts that they agree within a tolerance.
#[track_caller]
fn expect(what: &str, ratio: f64, expected: f64, tolerance: f64) {
    println!("{what}: {ratio:.4}, expected {expected:.3}");
    claim(what, (ratio - expected).abs(), tolerance);
}

/// The rows of a table of the literature.
fn literature(name: &str) -> Vec<Vec<f64>> {
    reference("shell/large_rotation.json")[name]["rows"].as_array().unwrap().iter().map(numbers).collect()
}

/// The largest deviation of two columns, with signs, from a table of the literature, over the table's largest
/// values. Its rows are compared at the instants of the run.
fn deviation(found: &Table, reference: &str, columns: [(&str, f64); 2]) -> f64 {
    let rows = literature(reference);
    let off = |c: usize| {
        let largest = rows.iter().map(|row| row[c + 1].abs()).fold(0.0, f64::max);
        let (name, sign) = columns[c];
        let off = |row: &Vec<f64>| (sign * found.at(row[0], name) - row[c + 1]).abs() / largest;
        let times = found.column("time");
        let shared = rows.iter().filter(|row| times.iter().any(|time| (time - row[0]).abs() < 1e-9));
        shared.map(off).fold(0.0, f64::max)
    };
    off(0).max(off(1))
}

/// Deflection in the middle over Timoshenko's 0.00126532 q L⁴/D.
fn clamped_plate(changes: &[&str]) -> f64 {
    table("clamped-plate", changes).last("probe.centre.displacement.z") / (0.126532 * 1e-2)
}

#[test]
fn timoshenko_clamped_plate() {
    let rows = [
        ("diagonal", [1.030, 1.008, 1.002]),
        ("union-jack", [1.026, 1.007, 1.002]),
        ("crossed", [1.013, 1.004, 1.001]),
    ];
    for (pattern, expected) in rows {
        for (cells, expected) in [8, 16, 32].into_iter().zip(expected) {
            let ratio = clamped_plate(&[
                &format!("body.plate.mesh.plate.pattern=\"{pattern}\""),
                &format!("body.plate.mesh.plate.cells=[{cells}, {cells}]"),
            ]);
            expect(&format!("clamped plate, {pattern}, N = {cells}"), ratio, expected, 0.002);
        }
    }
}

/// Inner nodes moved at random by up to 0.3 of a cell. The probe reads the flat triangle over the middle,
/// which lies above the nodes' deflections by up to w″h²/8 (0.002 at N = 32). Seeds 3 and 4 fold a triangle
/// back (which is warned about), seed 5 makes a sliver of 3 % of its area.
#[test]
fn clamped_plate_of_distorted_cells() {
    for seed in 1..=6 {
        let ratio = clamped_plate(&[
            "body.plate.mesh.plate.cells=[32, 32]",
            "body.plate.mesh.plate.distortion=0.3",
            &format!("body.plate.mesh.plate.seed={seed}"),
        ]);
        expect(&format!("clamped plate, distorted, N = 32, seed {seed}"), ratio, 1.002, 0.005);
    }
}

#[test]
fn scordelis_lo_roof() {
    for (cells, expected) in [(8, 1.021), (16, 0.999), (32, 0.995)] {
        let changes =
            ["body.roof.element=\"dkt-opt\"", &*format!("body.roof.mesh.cylinder.cells=[{cells}, {cells}]")];
        let ratio = -table("scordelis-lo", &changes).last("probe.edge.displacement.x") / 0.3024e-3;
        expect(&format!("Scordelis-Lo, N = {cells}"), ratio, expected, 0.005);
    }
}

#[test]
fn pinched_cylinder_with_diaphragms() {
    for (cells, expected) in [(8, 0.973), (16, 1.023), (32, 1.012)] {
        let cells = format!("body.cylinder.mesh.cylinder.cells=[{cells}, {cells}]");
        let changes = ["body.cylinder.element=\"dkt-opt\"", &*cells];
        let ratio = -table("pinched-cylinder", &changes).last("probe.top.displacement.x") / 1.8248e-5;
        expect(&format!("pinched cylinder, {cells}"), ratio, expected, 0.01);
    }
}

#[test]
fn pinched_hemisphere() {
    for (cells, expected) in [(4, 0.680), (8, 0.961), (16, 0.992)] {
        let changes = [
            "body.shell.element=\"dkt-opt\"",
            &*format!("body.shell.mesh.hemisphere.cells=[{cells}, {cells}]"),
        ];
        let found = table("hemisphere", &changes);
        let both = found.last("probe.pulled.displacement.y") - found.last("probe.pushed.displacement.x");
        expect(&format!("hemisphere, N = {cells}"), 0.5 * both / 0.094e-3, expected, 0.005);
    }
}

#[test]
fn cook_membrane() {
    let ratio = table("cook", &[]).last("probe.middle.displacement.y") / 23.96e-4;
    expect("Cook, N = 8", ratio, 0.951, 0.005);
}

#[test]
fn straight_cantilever() {
    let ratio = table("straight-beam", &[]).last("probe.end.displacement.y") / 0.1081e-2;
    expect("cantilever of rectangles, in plane", ratio, 1.0517, 0.0105);
    let out = table("straight-beam", &["load.end.traction=[0, 0, 0.05]"]);
    expect(
        "cantilever of rectangles, out of plane",
        out.last("probe.end.displacement.z") / 0.4321e-2,
        0.9771,
        0.0098,
    );
}

#[test]
fn twisted_beam() {
    let rows = [
        ("0.32", 1.0, [5.424e-3, 1.754e-3], [0.995, 0.998]),
        ("0.0032", 1e-6, [5.256e-3, 1.294e-3], [0.9981, 0.998]),
    ];
    for (thickness, load, references, expected) in rows {
        for (c, axis) in ["z", "y"].into_iter().enumerate() {
            // A thousandth of the thin beam's load bends it little.
            let part = if load < 1.0 { 1e-2 } else { 1.0 };
            let mut force = ["0", "0", "0"].map(String::from);
            force[2 - c] = format!("{:e}", load * part);
            let changes = [
                "body.beam.element=\"dkt-opt\"".into(),
                format!("body.beam.thickness={thickness}"),
                format!("load.end.total=[{}]", force.join(", ")),
            ];
            let found = table("twisted-beam", &changes.each_ref().map(String::as_str));
            let ratio = found.last(&format!("probe.end.displacement.{axis}")) / (part * references[c]);
            expect(&format!("twisted beam t = {thickness}, along {axis}"), ratio, expected[c], 0.01);
        }
    }
}

#[test]
fn cantilever_under_end_shear() {
    let found = table("end-shear", &[]);
    let columns = [("probe.end.displacement.x", -1.0), ("probe.end.displacement.z", 1.0)];
    claim("end shear, U", (-found.last(columns[0].0) - 3.290).abs(), 0.01);
    claim("end shear, W", (found.last(columns[1].0) - 6.704).abs(), 0.01);
    claim("end shear, all steps", deviation(&found, "cantilever_end_shear", columns), 0.005);
}

#[test]
fn cantilever_rolled_up() {
    let found = table("roll-up", &[]);
    let columns = [("probe.end.displacement.x", -1.0), ("probe.end.displacement.z", 1.0)];
    let closed = (found.last(columns[0].0) + 12.0).abs().max(found.last(columns[1].0).abs());
    claim("the circle closes", closed, 1e-3);
    claim("roll-up, all steps", deviation(&found, "cantilever_end_moment", columns), 0.005);
}

#[test]
fn slit_annulus_lifted_at_its_slit() {
    let found = table("slit-annulus", &[]);
    let columns = [("probe.inner.displacement.z", 1.0), ("probe.outer.displacement.z", 1.0)];
    claim("slit annulus, W_A", (found.last(columns[0].0) / 13.840 - 1.0).abs(), 0.01);
    claim("slit annulus, W_B", (found.last(columns[1].0) / 17.478 - 1.0).abs(), 0.01);
    claim("slit annulus, all steps", deviation(&found, "slit_annular_plate", columns), 0.01);
}

#[test]
#[ignore = "seconds"]
fn slit_annulus_on_a_fine_mesh() {
    let found = table("slit-annulus", &["body.ring.mesh.annulus.cells=[10, 80]"]);
    claim("slit annulus, W_A", (found.last("probe.inner.displacement.z") / 13.860 - 1.0).abs(), 0.005);
    claim("slit annulus, W_B", (found.last("probe.outer.displacement.z") / 17.498 - 1.0).abs(), 0.005);
}

#[test]
fn pinched_hemisphere_in_large_rotation() {
    let found = table(
        "hemisphere",
        &[
            "body.shell.element=\"dkt-opt\"",
            "run.load-steps=20",
            "load.pull.total=[0, 200, 0]",
            "load.push.total=[-200, 0, 0]",
        ],
    );
    claim("hemisphere, V_A", (found.last("probe.pulled.displacement.y") - 4.018).abs(), 0.03);
    claim("hemisphere, U_B", (-found.last("probe.pushed.displacement.x") - 7.999).abs(), 0.03);
}

/// The load between the steps of the control, by linear interpolation. Loads are over 3000 N.
#[test]
fn hinged_roof_snaps_through() {
    let found = table("hinged-roof", &[]);
    let curve: Vec<[f64; 2]> = (found.column("probe.middle.displacement.x").into_iter())
        .zip(found.column("load-factor"))
        .map(|(x, factor)| [-1e3 * x, factor])
        .collect();
    let at = |w: f64| {
        let pair = curve.windows(2).find(|pair| pair[0][0] <= w && w <= pair[1][0]).unwrap();
        let part = (w - pair[0][0]) / (pair[1][0] - pair[0][0]);
        pair[0][1] + part * (pair[1][1] - pair[0][1])
    };
    claim("hinged roof, first limit load", (at(11.293) - 0.737).abs(), 0.01);
    claim("hinged roof, second limit load", (at(19.852) - 0.1737).abs(), 0.01);
    for (w, expected) in [(3.087, 0.352), (9.339, 0.7248), (17.657, 0.2250), (28.663, 0.980)] {
        claim(&format!("hinged roof at w = {w} mm"), (at(w) - expected).abs(), 0.01);
    }
}

/// By arc length the roof passes both limit points. With `stop` the run ends at the load of the second limit
/// point; without it the run ends where the load is as written.
#[test]
fn hinged_roof_by_arc_length_ends() {
    let run = |stop: &str| {
        let control = format!("run.control={{ load = \"push\", arc-length = 0.006{stop} }}");
        table("hinged-roof", &[&control, "run.load-steps=200", "output.history.every=0.001"])
    };
    let found = run(", stop = { limit-points = 2 }");
    let factors = found.column("load-factor");
    let highest = factors.iter().copied().fold(0.0, f64::max);
    let last = factors[factors.len() - 1];
    println!("hinged roof: {} steps, {highest:.4} at most, {last:.4} at the end", factors.len() - 1);
    assert!(factors.len() < 200, "{factors:?}");
    claim("hinged roof by arc length, first limit load", (highest - 0.737).abs(), 0.01);
    let lowest = factors[factors.len() - 2];
    claim("hinged roof by arc length, second limit load", (lowest - 0.1737).abs(), 0.01);
    let whole = run("");
    let last = whole.last("load-factor");
    assert!((1.0..1.2).contains(&last) && whole.rows.len() < 200, "{last}");
}

#[test]
fn the_plate_of_the_thesis_is_no_linear_case() {
    let large = table("thesis-plate", &[]);
    for (q, expected) in (1..=5).zip([0.0890, 0.1310, 0.1588, 0.1801, 0.1977]) {
        let w = large.at(f64::from(q), "probe.centre.displacement.z");
        claim(&format!("thesis's plate at q = {q}"), (w / expected - 1.0).abs(), 0.01);
    }
    let small = table("thesis-plate", &["load.weight.traction=[0, 0, 0.01]", "run.load-steps=1"]);
    let w = small.last("probe.centre.displacement.z");
    claim("q = 0.01: w/(0.126532 q)", (w / (0.126532 * 0.01) - 1.0).abs(), 0.01);
}

/// p = 2 E t/(1 − ν) (ΔR/R)/R for a thin sphere that grows by 0.8 % in radius; 2 % for flat triangles and for
/// the wall that grows. R is the radius of a sphere of the triangles' volume.
#[test]
fn a_balloon_takes_the_pressure_of_a_thin_sphere() {
    let found = table("balloon", &[]);
    let pressure = 1000.0 * found.last("load-factor");
    let [rest, full] = [rest_volume(), 4.25e-3].map(|volume| (volume * 0.75 / std::f64::consts::PI).cbrt());
    let thin = 2.0 * 1e6 * 0.001 / (1.0 - 0.45) * (full / rest - 1.0) / rest;
    println!("balloon: {pressure:.2} Pa, thin sphere {thin:.2} Pa");
    claim("balloon, pressure", (pressure / thin - 1.0).abs(), 0.02);
    let reaction = ["x", "y", "z"].map(|axis| found.last(&format!("reaction.knot.{axis}")).abs());
    // Over the force p π R² with which the halves are driven apart.
    let apart = pressure * std::f64::consts::PI * full * full;
    claim("balloon, nothing pulls at its knot", reaction.into_iter().fold(0.0, f64::max) / apart, 1e-6);
}

/// Volume [m³] of the balloon's mesh.
fn rest_volume() -> f64 {
    let mesh = pliant_meshing::sphere(0.1, 3, pliant_meshing::DEFAULT_CELL_LIMIT).unwrap();
    let tet = |corners: &[u32]| {
        let [a, b, c] = [0, 1, 2].map(|corner| mesh.points[corners[corner] as usize]);
        a.dot(&b.cross(&c)) / 6.0
    };
    mesh.blocks[0].cells().map(tet).sum()
}

/// Free fall by backward Euler: v = v₀ + g t, and z = v₀ t + g h² n(n+1)/2.
#[test]
fn a_thrown_disc_falls_freely() {
    let found = table("free-flight", &[]);
    for probe in ["front", "back"] {
        for (axis, velocity, way) in
            [("x", 1.0, 0.5), ("y", 2.0, 1.0), ("z", 3.0 - 9.81 * 0.5, 1.5 - 9.81 * 1e-4 * 50.0 * 51.0 / 2.0)]
        {
            let found = |field| found.last(&format!("probe.{probe}.{field}.{axis}"));
            claim(&format!("velocity along {axis}"), (found("velocity") - velocity).abs(), 1e-9);
            claim(&format!("way along {axis}"), (found("displacement") - way).abs(), 1e-9);
        }
    }
}

/// Bent little, a beam of the co-rotated linear law is one of another law, relaxed by another solver.
#[test]
fn tets_bend_as_those_of_large_strain() {
    let [stiff, solid] = [
        vec![],
        vec!["law.rubber.type=\"st-venant-kirchhoff\"", "run.solver=\"quasi-static\"", "run.tolerance=1e-9"],
    ]
    .map(|changes| table("tet-beam", &changes).last("probe.end.displacement.z"));
    println!("tets: {stiff:e}, of large strain {solid:e}");
    claim("beam of tets", (stiff / solid - 1.0).abs(), 1e-5);
}
