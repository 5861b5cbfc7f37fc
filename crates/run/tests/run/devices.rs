//! Scenes on a GPU: the same result as on the CPU, rejections and messages. Without an adapter, the tests
//! that need one are skipped with a notice; with `PLIANT_REQUIRE_GPU=1` they fail.

use pliant_mechanics::grip::Grip;
use pliant_sim::gpu::adapters;
use pliant_testing::scenes::{BLOCK, Workshop, changed, world};

/// [`BLOCK`] on a device.
fn on(device: &str) -> Workshop {
    Workshop::new(&changed(BLOCK, "precision = \"double\"", device))
}

#[test]
fn what_only_the_processor_can_do_is_refused_by_name_before_the_run() {
    for (run, line, says) in [
        (
            "device = \"gpu\"\nsolver = \"quasi-static\"",
            "solver = \"quasi-static\"",
            "the solver `quasi-static`",
        ),
        ("device = \"gpu\"\nprecision = \"double\"", "precision = \"double\"", "double precision"),
    ] {
        let output = on(run).check(&[]);
        assert_eq!(output.status(), "invalid", "{}", output.err);
        assert!(output.underlines(line) || output.underlines("device = \"gpu\""), "{}", output.err);
        assert!(output.words().contains(&format!("{says} runs on the CPU only")), "{}", output.err);
        assert!(output.words().contains("device = \"cpu\""), "{}", output.err);
    }
    let auto = on("device = \"auto\"\nsolver = \"quasi-static\"\nload-steps = 2");
    let output = auto.run(&[]);
    assert_eq!(output.done()["device"], "cpu");
    assert!(output.words().contains("the solver `quasi-static` runs on the CPU only"), "{}", output.err);
}

#[test]
fn an_adapter_that_is_not_there_or_not_used_is_refused_in_the_users_line() {
    for line in ["adapter = \"x\"", "design = \"blocks\""] {
        let unused = on(&format!("device = \"cpu\"\n{line}")).run(&[]);
        assert_eq!(unused.status(), "invalid", "{}", unused.err);
        assert!(unused.underlines(line) && unused.words().contains("runs on the CPU"), "{}", unused.err);
    }
    if !pliant_testing::has_gpu(adapters().len()) {
        return;
    }
    let unknown = on("device = \"gpu\"\nadapter = \"no such adapter\"").run(&[]);
    assert_eq!(unknown.status(), "invalid", "{}", unknown.err);
    assert!(unknown.underlines("adapter = \"no such adapter\""), "{}", unknown.err);
    for piece in ["there is no adapter", &adapters()[0].name, "pliant devices"] {
        assert!(unknown.words().contains(piece), "no `{piece}` in:\n{}", unknown.err);
    }
}

#[test]
fn a_design_that_is_not_there_is_answered_with_those_that_are() {
    let line = "design = \"fixed-atomics\"";
    let unknown = on(&format!("device = \"gpu\"\n{line}")).check(&[]);
    assert_eq!(unknown.status(), "invalid", "{}", unknown.err);
    assert!(unknown.underlines(line), "{}", unknown.err);
    let names = r#"expected one of "gather", "blocks", "float-atomics", "fast""#;
    for piece in [names, "the ways that measured best: `fast`, and `gather` on adapters that are software"] {
        assert!(unknown.words().contains(piece), "no `{piece}` in:\n{}", unknown.err);
    }
}

/// Distance between the last displacements of two series, over the size of the first.
fn apart(a: &Workshop, b: &Workshop) -> f64 {
    apart_in([(a, "out/case/fields.pvd"), (b, "out/case/fields.pvd")])
}

fn apart_in(series: [(&Workshop, &str); 2]) -> f64 {
    let [(time_a, a), (time_b, b)] = series.map(|(workshop, name)| {
        let (time, frame) = workshop.series(name).pop().expect("a frame");
        (time, frame.mesh.point_data["displacement"].values.clone())
    });
    assert_eq!(time_a, time_b);
    let norm = |values: &mut dyn Iterator<Item = f64>| values.map(|value| value * value).sum::<f64>().sqrt();
    norm(&mut a.iter().zip(&b).map(|(a, b)| a - b)) / norm(&mut a.iter().copied())
}

/// A step that resolves the gravity of [`BLOCK`], which sets in at once.
const STEP: &str = "run.step=1e-3";

#[test]
fn a_scene_of_every_kind_of_part_runs_on_a_device_as_on_the_processor() {
    if !pliant_testing::has_gpu(adapters().len()) {
        return;
    }
    let [cpu, gpu] = ["device = \"cpu\"", "device = \"gpu\""].map(on);
    let reference = cpu.run(&[STEP]).done();
    let output = gpu.run(&[STEP]);
    let json = output.done();
    assert_eq!(json["device"], adapters()[0].name);
    assert_eq!((&json["precision"], &reference["precision"]), (&"single".into(), &"double".into()));
    let apart = apart(&cpu, &gpu);
    assert!(apart < 1e-5, "displacements are {apart} apart");
    for constraint in ["base", "hand"] {
        for axis in 0..3 {
            let [a, b] =
                [&reference, &json].map(|json| json["reactions"][constraint][axis].as_f64().unwrap());
            assert!((a - b).abs() < 1e-4, "{constraint} {axis}: {a} N, {b} N");
        }
    }
    // The tables have the same rows; the page names the device.
    let [(_, a), (_, b)] = [&cpu, &gpu].map(|workshop| workshop.table("out/case/history.csv"));
    assert_eq!(
        a.iter().map(|row| row[0]).collect::<Vec<_>>(),
        b.iter().map(|row| row[0]).collect::<Vec<_>>()
    );
    assert!(gpu.read("out/case/summary.md").contains(json["device"].as_str().unwrap()));
}

/// The start of a scene in which two organs lie on a table, on each other and on themselves. A grasper moves
/// in, and all contacts have friction. The solver finds impulses to a thousandth of the deepest gap with a
/// limited number of passes. Faces at the jaws come in another order. The impulses between the organs at an
/// instant depend on the last digits, soon also between single and double precision on the processor. Places
/// and energies do not.
#[test]
fn organs_and_a_grasper_touch_on_a_device_as_on_the_processor() {
    if !pliant_testing::has_gpu(adapters().len()) {
        return;
    }
    let workshop = Workshop::shipped("retraction");
    for device in ["cpu", "gpu"] {
        let out = format!("out/{device}");
        let device_is = format!("run.device={device}");
        let output = workshop.run_into(&out, &["scene.until=0.1", "output.history.every=0.02", &device_is]);
        let json = output.done();
        assert_eq!(json["device"] == "cpu", device == "cpu", "{}", output.err);
    }
    let [(names, cpu), (_, gpu)] =
        ["cpu", "gpu"].map(|device| workshop.table(&format!("out/{device}/history.csv")));
    let column = |name: &str| names.iter().position(|known| known == name).expect("a column");
    let bears = column("contact.lie.liver-stomach.z");
    assert!([&cpu, &gpu].iter().all(|rows| rows.iter().any(|row| row[bears] < -1.0)));
    for (name, within) in [("contact.lie.liver-table.z", 1e-3), ("energy.internal", 1e-3)] {
        let at = column(name);
        let largest = cpu.iter().map(|row| row[at].abs()).fold(0.0, f64::max);
        let off = cpu.iter().zip(&gpu).map(|(a, b)| (a[at] - b[at]).abs()).fold(0.0, f64::max);
        println!("{name}: {off:.1e} of {largest}");
        assert!(largest > 0.0 && off < within * largest, "{name}: {off} of {largest}");
    }
    let apart = apart_in([(&workshop, "out/cpu/bodies.pvd"), (&workshop, "out/gpu/bodies.pvd")]);
    println!("displacements are {apart:.1e} apart");
    assert!(apart < 1e-3, "displacements are {apart} apart");
}

/// A tube under a pressure that sets in at once, in implicit steps.
const TUBE: &str = r#"[scene]
until = 0.4

[run]
solver = "implicit"
step = 0.04
linear = "conjugate-gradients"

[law.wall]
type = "st-venant-kirchhoff"
young-modulus = 1e5
poisson-ratio = 0.45

[body.tube]
model = "shell"
mesh = { cylinder = { radius = 0.02, length = 0.1 }, edge = 0.008 }
law = "wall"
density = 1000
thickness = 0.002

[constraint.ends]
type = "fix"
body = "tube"
nodes = { union = [{ set = "z-min" }, { set = "z-max" }] }

[load.push]
type = "pressure"
on = "tube"
faces = "all"
pressure = 500

[output.fields]
type = "vtu"
every = 0.4
"#;

fn tube(run: &str) -> Workshop {
    Workshop::new(&changed(TUBE, "step = 0.04", &format!("step = 0.04\n{run}")))
}

/// Solutions to a residual of 1e-6 on both; Newton's method ends at 1e-6, too.
#[test]
fn equations_of_shells_are_solved_on_a_device_as_on_the_processor() {
    if !pliant_testing::has_gpu(adapters().len()) {
        return;
    }
    let linear = "run.linear={ by = \"conjugate-gradients\", tolerance = 1e-6 }";
    let [cpu, gpu] = ["device = \"cpu\"", "device = \"gpu\""].map(tube);
    let reference = cpu.run(&[linear]).done();
    let json = gpu.run(&[linear]).done();
    assert_eq!(json["device"], adapters()[0].name);
    assert_eq!((&json["precision"], &reference["precision"]), (&"double".into(), &"double".into()));
    assert!(json["solver"]["linear_iterations"].as_u64() > Some(0), "{json}");
    assert_eq!(json["solver"]["left_to_cpu"], 0, "{json}");
    let apart = apart(&cpu, &gpu);
    println!("displacements are {apart:.1e} apart");
    assert!(apart < 1e-5, "displacements are {apart} apart");
}

/// Residuals in double precision end near 1e-15. The CPU takes the rest of the way to 1e-17, as its residual
/// is carried from step to step.
#[test]
fn solutions_that_a_device_leaves_to_the_processor_are_counted() {
    if !pliant_testing::has_gpu(adapters().len()) {
        return;
    }
    let linear = "run.linear={ by = \"conjugate-gradients\", tolerance = 1e-17 }";
    let gpu = tube("device = \"gpu\"");
    let json = gpu.run(&[linear]).done();
    let [left, solved] = ["left_to_cpu", "solutions"].map(|key| json["solver"][key].as_u64().unwrap());
    assert!(left > 0 && left <= solved, "{json}");
    let row = format!("| solutions that the GPU left to the CPU | {left} of {solved} |");
    assert!(gpu.read("out/case/summary.md").contains(&row), "{row}");
}

#[test]
fn equations_that_a_device_does_not_solve_are_refused_by_name() {
    let linear = |table: &str| format!("run.linear={table}");
    let lagged = linear("{ by = \"conjugate-gradients\", preconditioner = \"lagged-factors\" }");
    for (given, says, help) in [
        (
            linear("direct"),
            "the linear solver `direct` runs on the CPU only",
            "`linear = \"conjugate-gradients\"`",
        ),
        (linear("unsymmetric"), "the linear solver `unsymmetric` runs on the CPU only", "device = \"cpu\""),
        (
            lagged,
            "the preconditioner `lagged-factors` runs on the CPU only",
            "`aggregates` or `block-jacobi`",
        ),
    ] {
        let output = tube("device = \"gpu\"").check(&[&given]);
        assert_eq!(output.status(), "invalid", "{}", output.err);
        assert!(output.words().contains(says) && output.words().contains(help), "{given}: {}", output.err);
    }
    let output = tube("device = \"auto\"").run(&["run.linear=direct"]);
    assert_eq!(output.done()["device"], "cpu");
    assert!(output.words().contains("the linear solver `direct` runs on the CPU only"), "{}", output.err);
    if !pliant_testing::has_gpu(adapters().len()) {
        return;
    }
    let output = tube("device = \"gpu\"\ndesign = \"gather\"").check(&[]);
    assert_eq!(output.status(), "invalid", "{}", output.err);
    assert!(
        output.underlines("design = \"gather\"") && output.words().contains("for explicit solids"),
        "{}",
        output.err
    );
}

/// [`TUBE`] in explicit steps of 0.24 ms, whose end is moved and turned, with more lines in `[run]`.
fn explicit_tube(run: &str) -> String {
    let text = changed(TUBE, "solver = \"implicit\"", "solver = \"explicit\"");
    let text = changed(&text, "step = 0.04\nlinear = \"conjugate-gradients\"", run);
    let text = changed(&text, "until = 0.4", "until = 0.01").replace("every = 0.4", "every = 0.005");
    let text =
        changed(&text, "{ union = [{ set = \"z-min\" }, { set = \"z-max\" }] }", "{ set = \"z-min\" }");
    let moved = "[constraint.head]\ntype = \"move\"\nbody = \"tube\"\nnodes = { set = \"z-max\" }\nby = [0, 0.001, 0.002]\n\
        turn = [0, 0, 0.17]\n\n";
    let history = "\n[output.history]\ntype = \"csv\"\nevery = 0.0005\nenergy = true\nreactions = [\"head\", \"ends\"]\n";
    changed(&text, "[load.push]", &format!("{moved}[load.push]")) + history
}

/// 2500 steps. Displacements to 1e-5, the round-off of single precision; reactions and energies of each
/// instant to 1e-4 of the largest.
#[test]
fn explicit_shells_run_on_a_device_as_on_the_processor() {
    if !pliant_testing::has_gpu(adapters().len()) {
        return;
    }
    let [cpu, gpu] = ["device = \"cpu\"", "device = \"gpu\""].map(|run| Workshop::new(&explicit_tube(run)));
    let reference = cpu.run(&["run.step=4e-6"]).done();
    let json = gpu.run(&["run.step=4e-6"]).done();
    assert_eq!(json["device"], adapters()[0].name);
    assert_eq!((&json["precision"], &reference["precision"]), (&"single".into(), &"double".into()));
    let apart = apart(&cpu, &gpu);
    println!("displacements are {apart:.1e} apart");
    assert!(apart < 1e-5, "displacements are {apart} apart");
    let [(names, a), (_, b)] = [&cpu, &gpu].map(|workshop| workshop.table("out/case/history.csv"));
    assert_eq!(a.len(), b.len());
    for (column, name) in names.iter().enumerate() {
        let largest = a.iter().map(|row| row[column].abs()).fold(0.0, f64::max);
        let off = a.iter().zip(&b).map(|(a, b)| (a[column] - b[column]).abs()).fold(0.0, f64::max);
        println!("{name}: {off:.1e} of {largest:.1e}");
        // Forces that vanish by symmetry are round-off.
        assert!(off < 1e-4 * largest || largest < 1e-3, "{name}: {off:e} of {largest:e}");
    }
    assert!(gpu.read("out/case/summary.md").contains(json["device"].as_str().unwrap()));
}

#[test]
fn explicit_shells_that_only_the_processor_has_are_refused_by_name() {
    let output = Workshop::new(&explicit_tube("device = \"gpu\"\nprecision = \"double\"")).check(&[]);
    assert!(
        output.underlines("precision = \"double\"") || output.underlines("device = \"gpu\""),
        "{}",
        output.err
    );
    assert!(output.words().contains("double precision runs on the CPU only"), "{}", output.err);
    let spring = "\n[constraint.bed]\ntype = \"spring\"\nbody = \"tube\"\nnodes = \"all\"\nstiffness = 1\n";
    let sprung = |device: &str| Workshop::new(&(explicit_tube(device) + spring));
    let output = sprung("device = \"gpu\"").check(&[]);
    assert_eq!(output.status(), "invalid", "{}", output.err);
    assert!(output.underlines("device = \"gpu\""), "{}", output.err);
    assert!(output.words().contains("a spring on explicit shells runs on the CPU only"), "{}", output.err);
    let output = sprung("device = \"auto\"").run(&["scene.until=1e-4"]);
    assert_eq!(output.done()["device"], "cpu");
    assert!(output.words().contains("a spring on explicit shells runs on the CPU only"), "{}", output.err);
}

/// A hand and a force from outside move them as on the processor, and again from a snapshot: 1e-5 of the
/// largest displacement and of the work.
#[test]
fn hands_and_forces_move_explicit_shells_on_a_device() {
    if !pliant_testing::has_gpu(adapters().len()) {
        return;
    }
    let run = |device: &str| {
        let world = world(&explicit_tube(&format!("device = \"{device}\""))).unwrap();
        let mut simulation = world.simulation().unwrap();
        let nodes = simulation.setup().parts[0].model.node_count();
        let (held, pushed) = (nodes as u32 / 2, nodes / 2 + 1);
        let [x, y, z] = simulation.rest(held);
        let grip = Grip { nodes: vec![(held, 1.0)], place: [x, y, z + 0.005], stiffness: 5.0 };
        let mut forces = vec![[0.0; 3]; nodes];
        forces[pushed] = [0.01, 0.0, 0.0];
        assert!(simulation.grip(std::slice::from_ref(&grip)));
        simulation.push(&forces).unwrap();
        simulation.run(1e-3, |_| ()).unwrap();
        let snapshot = simulation.state().unwrap();
        let mut ends = Vec::new();
        for _ in 0..2 {
            simulation.run(2e-3, |_| ()).unwrap();
            let frame = simulation.frame().unwrap();
            ends.push((frame.displacements("tube").unwrap(), frame.energies().external));
            simulation.restore(snapshot.clone()).unwrap();
            assert!(simulation.grip(std::slice::from_ref(&grip)));
            simulation.push(&forces).unwrap();
        }
        ends
    };
    let cpu = &run("cpu")[0];
    let largest = cpu.0.as_flattened().iter().fold(0.0, |most: f64, u| most.max(u.abs()));
    for gpu in run("gpu") {
        let pairs = cpu.0.as_flattened().iter().zip(gpu.0.as_flattened());
        let off = pairs.fold(0.0, |most: f64, (a, b)| most.max((a - b).abs()));
        println!("off by {off:.1e} of {largest:.1e} m, {:e} and {:e} J", cpu.1, gpu.1);
        assert!(off < 1e-5 * largest && (gpu.1 - cpu.1).abs() < 1e-5 * cpu.1.abs());
    }
}

/// Displacements of a run that continues on another device match an uninterrupted run to 1e-5.
#[test]
fn a_checkpoint_of_explicit_shells_goes_from_device_to_processor_and_back() {
    if !pliant_testing::has_gpu(adapters().len()) {
        return;
    }
    let with = |device: &str| {
        Workshop::new(&explicit_tube(&format!("device = \"{device}\"\ncheckpoint = {{ every = 0.005 }}")))
    };
    let whole = with("cpu");
    whole.run(&[]).done();
    for (begun, then) in [("gpu", "cpu"), ("cpu", "gpu"), ("gpu", "gpu")] {
        let workshop = with(begun);
        workshop.run(&[]).done();
        let files = std::fs::read_dir(workshop.path("out/case")).unwrap();
        let names = files.map(|file| file.unwrap().file_name().into_string().unwrap());
        let first = names.filter(|name| name.ends_with(".pliant")).min().expect("a checkpoint");
        let resumed = workshop.resume(&format!("out/case/{first}"), &[&format!("run.device={then}")]);
        let json = resumed.done();
        assert_eq!(json["device"] == "cpu", then == "cpu", "{}", resumed.err);
        let apart = apart(&whole, &workshop);
        assert!(apart < 1e-5, "from {begun} to {then} displacements are {apart} apart");
        // The work of loads and motions continues, too.
        let [a, b] = [&whole, &workshop].map(|workshop| {
            let (names, rows) = workshop.table("out/case/history.csv");
            let column = names.iter().position(|name| name == "energy.external").expect("a column");
            rows.last().expect("a row")[column]
        });
        assert!((a - b).abs() < 1e-4 * a.abs(), "from {begun} to {then}: {a} J, {b} J");
    }
}

#[test]
fn a_checkpoint_goes_from_device_to_processor_and_back() {
    if !pliant_testing::has_gpu(adapters().len()) {
        return;
    }
    let with = |device: &str| {
        let scene = changed(
            BLOCK,
            "precision = \"double\"",
            &format!("device = \"{device}\"\nprecision = \"single\""),
        );
        Workshop::new(&changed(&scene, "threads = 1", "threads = 1\ncheckpoint = { every = 0.005 }"))
    };
    let whole = with("cpu");
    whole.run(&[STEP]).done();
    for (first, then) in [("gpu", "cpu"), ("cpu", "gpu"), ("gpu", "gpu")] {
        let workshop = with(first);
        workshop.run(&[STEP]).done();
        // The last one but the one at the end.
        let checkpoint = "out/case/checkpoint-0000000015.pliant";
        let resumed = workshop.resume(checkpoint, &[STEP, &format!("run.device={then}")]);
        assert_eq!(resumed.done()["device"] == "cpu", then == "cpu", "{}", resumed.err);
        let apart = apart(&whole, &workshop);
        assert!(apart < 1e-5, "from {first} to {then} displacements are {apart} apart");
    }
}

#[test]
fn a_failed_run_on_a_device_names_element_and_time() {
    if !pliant_testing::has_gpu(adapters().len()) {
        return;
    }
    let crushed = changed(BLOCK, "by = [0, 0, 0.001]", "by = [0, 0, -0.12]");
    let output = Workshop::new(&changed(&crushed, "precision = \"double\"", "device = \"gpu\"")).run(&[STEP]);
    assert_eq!(output.status(), "failed", "{}", output.err);
    let error = &output.json()["error"];
    assert!(["inverted", "not-finite", "unstable"].contains(&error["kind"].as_str().unwrap()), "{error}");
    assert_eq!(error["body"], "block");
    assert!(error["node"].is_u64() && error["time"].as_f64().is_some_and(|time| time > 0.0), "{error}");
}
