//! Explicit runs whose steps fail go back to an earlier state and halve their steps.

use pliant_testing::pressed_cube as pressed;
use pliant_testing::scenes::{Workshop, world};

/// Until then, steps of 0.5 ms can follow.
const SOON: f64 = 3.003;
/// Until then, no eighth of a step can.
const AT_ONCE: f64 = 3.001;

/// A shell that swings in implicit steps beside the cube.
const SHELL: &str = r#"
[participant.walls]
bodies = ["strip"]
solver = "implicit"
step = 0.01
[law.wall]
type = "neo-hookean"
young-modulus = 1e6
poisson-ratio = 0.4
[body.strip]
model = "shell"
mesh = { plate = { size = [0.1, 0.02] }, edge = 0.02 }
law = "wall"
density = 1000
thickness = 0.002
damping = 2
[constraint.end]
type = "fix"
body = "strip"
nodes = { set = "x-min" }
"#;

#[test]
fn a_run_whose_step_fails_goes_back_and_halves_its_steps() {
    let workshop = Workshop::new(&pressed(SOON));
    let output = workshop.run(&[]).done();
    assert_eq!(output["stability"]["halvings"], 1, "{output}");
    assert!(workshop.read("out/case/summary.md").contains("went back 1 time"));
    // Each instant appears once, and the rows before the rollback equal the rows of a run until then.
    let (names, rows) = workshop.table("out/case/history.csv");
    let times: Vec<f64> = rows.iter().map(|row| row[0]).collect();
    assert_eq!(times.len(), 401);
    assert!(times.iter().enumerate().all(|(k, time)| (time - 0.01 * k as f64).abs() < 1e-9));
    assert_eq!(workshop.series("out/case/fields.pvd").len(), 81);
    workshop.run_into("out/before", &["scene.until=2.0"]).done();
    let before = workshop.read("out/before/history.csv");
    let (before, _) = before.trim_end().rsplit_once('\n').unwrap();
    assert!(workshop.read("out/case/history.csv").starts_with(before));
    // The energies are balanced in the end.
    let column = names.iter().position(|name| name == "energy.balance").unwrap();
    assert!(rows.last().unwrap()[column] < 0.01);
}

#[test]
fn a_run_that_is_resumed_before_or_after_it_went_back_ends_in_the_same_bits() {
    let workshop = Workshop::new(&pressed(SOON));
    workshop.run_into("out/whole", &[]).done();
    for until in ["2.5", "3.5"] {
        let parts = format!("out/until-{until}");
        workshop.run_into(&parts, &[&format!("scene.until={until}")]).done();
        let output = workshop.resume(&parts, &[]).done();
        assert_eq!(output["stability"]["halvings"], 1, "{until}");
        // Samples of the plot follow the time at which a run was to end.
        let files = |folder: &str| {
            let mut files = workshop.files(folder);
            files.retain(|(name, _)| !name.ends_with("plot.svg"));
            files
        };
        assert!(files("out/whole") == files(&parts), "{until}");
    }
}

#[test]
fn steps_are_halved_three_times_at_most() {
    let output = Workshop::new(&pressed(AT_ONCE)).run(&[]);
    let json = output.json();
    assert_eq!((output.status(), &json["stability"]["halvings"]), ("failed", &3.into()), "{json}");
    assert!(json["error"]["message"].as_str().unwrap().contains("`step`"), "{json}");
}

#[test]
fn all_participants_go_back_together() {
    let scene = pressed(SOON).replacen("until = 4.0", "until = 4.0\ngravity = [0, 0, -1]", 1);
    let workshop = Workshop::new(&(scene + SHELL));
    let output = workshop.run(&[]).done();
    assert!(output.to_string().contains("\"halvings\":1"), "{output}");
    // The shell swings as it does beside a cube that never fails.
    workshop.run_into("out/calm", &["constraint.top.by=[0,0,0]"]).done();
    let [both, calm] = ["out/case/history.csv", "out/calm/history.csv"].map(|name| workshop.table(name));
    let column = both.0.iter().position(|name| name == "reaction.end.z").unwrap();
    assert_eq!(both.1.len(), calm.1.len());
    assert!(both.1.iter().zip(&calm.1).all(|(a, b)| a[column] == b[column]));
    // Of its iterations no row is of a step that was undone.
    let [both, calm] =
        ["out/case", "out/calm"].map(|folder| workshop.read(&format!("{folder}/convergence-walls.csv")));
    assert!(both == calm && both.lines().count() > 100);
}

#[test]
#[cfg(feature = "gpu")]
fn a_run_on_a_gpu_goes_back_too() {
    if !pliant_testing::has_gpu(pliant_sim::gpu::adapters().len()) {
        return;
    }
    let on = |device: &str| Workshop::new(&pressed(SOON).replace("precision = \"double\"", device));
    let [gpu, cpu] = [on("device = \"gpu\""), on("precision = \"single\"")]
        .map(|workshop| (workshop.run(&[]).done(), workshop.table("out/case/history.csv")));
    for (output, (_, rows)) in [&gpu, &cpu] {
        assert_eq!((output["stability"]["halvings"].as_u64(), rows.len()), (Some(1), 401), "{output}");
    }
    let column = cpu.1.0.iter().position(|name| name == "reaction.top.z").unwrap();
    let [last, other] = [&gpu, &cpu].map(|(_, (_, rows))| rows.last().unwrap()[column]);
    assert!((last / other - 1.0).abs() < 1e-3, "{last} {other}");
}

/// A block that lies on a floor. Going back to the start with half the step leaves the floor's force, since
/// the weight on it is the same.
#[test]
fn contact_forces_at_the_start_do_not_depend_on_the_step() {
    let fixed = "[constraint.low]\ntype = \"fix\"\nbody = \"b\"\nnodes = { set = \"z-min\" }";
    let floor = "[obstacle.floor]\nshape = \"half-space\"\n[contact.feet]\nbetween = [\"b\", \"floor\"]";
    let scene = pressed(SOON)
        .replacen("until = 4.0", "until = 1.0\ngravity = [0, 0, -9.81]", 1)
        .replacen("damping = 20", "damping = 0", 1)
        .replacen(fixed, floor, 1);
    for device in ["precision = \"double\"", "device = \"gpu\""] {
        if device.contains("gpu") && !(cfg!(feature = "gpu") && pliant_testing::has_gpu(1)) {
            continue;
        }
        let world = world(&scene.replace("precision = \"double\"", device)).unwrap();
        let mut simulation = world.simulation().unwrap();
        let start = simulation.state().unwrap();
        let mut force = || simulation.frame().unwrap().contact_force("feet").unwrap()[2];
        let whole = force();
        let mut halved = start;
        assert!(halved.halve_steps(simulation.setup()));
        simulation.restore(halved).unwrap();
        let half = simulation.frame().unwrap().contact_force("feet").unwrap()[2];
        assert!(whole < 0.0 && (half / whole - 1.0).abs() < 1e-5, "{device}: {half} N for {whole} N");
    }
}

#[test]
fn a_step_of_a_simulation_does_not_go_back_but_names_step() {
    let world = world(&pressed(SOON)).unwrap();
    let mut simulation = world.simulation().unwrap();
    let failure = (0..4000).find_map(|_| simulation.step(1).err()).unwrap();
    assert!(failure.message.contains("`step`") && failure.time > Some(3.0), "{failure}");
    assert!(simulation.instants().all(|now| now.stability().halvings == 0));
}
