//! Sweeps: the product of the values, one table, the same on any number of threads.

use pliant_run::SweepOptions;
use pliant_testing::scenes::{BLOCK, Workshop};

#[test]
fn a_sweep_runs_the_product_and_tells_what_each_run_came_to() {
    let workshop = Workshop::new(BLOCK);
    let set =
        ["law.tissue.young-modulus=5e3..20e3/3", "scene.gravity=[0,0,-9.81],[0,0,0]", "scene.until=0.008"];
    let summary = workshop.sweep("out/sweep", &set, SweepOptions { threads: 1, ..SweepOptions::default() });
    assert_eq!((summary.runs, summary.failures.len()), (6, 0), "{summary:?}");
    // A curve for each run, named by its values, in a panel for each constraint.
    let plot = workshop.read("out/sweep/sweep.svg");
    assert!(plot.contains("<svg") && plot.contains("Reaction of"), "{plot}");
    assert_eq!(
        plot.matches("law.tissue.young-modulus=12500.0").count(),
        2 * plot.matches("Reaction of").count()
    );
    let rows = workshop.cells("out/sweep/sweep.csv");
    let column = |name: &str| rows[0].iter().position(|other| other == name).expect(name);
    assert_eq!(rows.len(), 7);
    assert!(rows.iter().all(|row| row.len() == rows[0].len()));
    let values: Vec<(&str, &str)> = rows[1..].iter().map(|row| (row[1].as_str(), row[2].as_str())).collect();
    assert_eq!(values[..3], [("5000.0", "[0,0,-9.81]"), ("5000.0", "[0,0,0]"), ("12500.0", "[0,0,-9.81]")]);
    for (run, row) in rows[1..].iter().enumerate() {
        assert_eq!((row[0].as_str(), row[column("status")].as_str()), (&*run.to_string(), "done"));
        assert!((row[column("time")].parse::<f64>().unwrap() - 0.008).abs() < 1e-12);
        // Every number equals the number of the single run.
        let single = workshop.table(&format!("out/sweep/run-{run:04}/history.csv"));
        let last = single.1.last().unwrap();
        for (name, value) in single.0.iter().zip(last).skip(1) {
            let name = if name.starts_with("probe.") { &format!("history.{name}") } else { name };
            assert_eq!(row[column(name)].parse::<f64>().unwrap(), *value, "{name}");
        }
        assert!(workshop.path(&format!("out/sweep/run-{run:04}/summary.md")).exists());
        assert!(!workshop.path(&format!("out/sweep/run-{run:04}/fields.pvd")).exists());
    }
    // One of them by hand.
    let by_hand = ["law.tissue.young-modulus=12500.0", "scene.gravity=[0,0,0]", "scene.until=0.008"];
    workshop.run(&by_hand).done();
    assert_eq!(workshop.read("out/case/history.csv"), workshop.read("out/sweep/run-0003/history.csv"));

    // The same on any number of threads, except the wall time in the last column.
    let summary = workshop.sweep(
        "out/again",
        &set,
        SweepOptions { threads: 3, keep_fields: true, ..SweepOptions::default() },
    );
    assert_eq!((summary.runs, summary.failures.len()), (6, 0), "{summary:?}");
    let other = workshop.cells("out/again/sweep.csv");
    let without = |rows: &[Vec<String>]| -> Vec<Vec<String>> {
        rows.iter().map(|row| row[..row.len() - 1].to_vec()).collect()
    };
    assert_eq!(without(&rows), without(&other));
    assert!(workshop.series("out/again/run-0005/fields.pvd").len() > 1);
}
