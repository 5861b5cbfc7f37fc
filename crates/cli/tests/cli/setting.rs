//! Values set on the command line, through the real binary.

use crate::support::{BLOCK, Said, Workshop, changed};

fn check(workshop: &Workshop, set: &[&str]) -> Said {
    let options: Vec<&str> = set.iter().flat_map(|set| ["--set", *set]).collect();
    workshop.pliant(&[&["check", "case"], options.as_slice()].concat())
}

#[test]
fn a_value_set_is_as_if_it_stood_in_the_file() {
    let by_file = changed(BLOCK, "young-modulus = 10e3", "young-modulus = 4e3");
    let by_file = changed(&by_file, "gravity = [0, 0, -9.81]", "gravity = [0, 0, -1.62]");
    let by_file = changed(&by_file, "curve = \"smooth-step\"", "curve = { table = [[0, 0], [0.01, 1]] }");
    let by_file = changed(&by_file, "weight = 0.3", "weight = 0.2");
    let by_file = changed(&by_file, "total = [0.1, 0, 0]", "total = [0, 0, 0.2]");
    let other = Workshop::new(&by_file);
    other.run(&[]).done();
    let workshop = Workshop::new(BLOCK);
    let set = [
        "law.tissue.young-modulus=4e3",
        "scene.gravity.2 = -1.62",
        "constraint.hand.curve={ table = [[0, 0], [0.01, 1]] }",
        "law.tissue.prony.0.weight=0.2",
        "load.push.total=[0, 0, 0.2]",
    ];
    let options: Vec<&str> = set.iter().flat_map(|set| ["--set", *set]).collect();
    workshop.run(&options).done();
    assert_eq!(workshop.read("out/case/history.csv"), other.read("out/case/history.csv"));
    let page = workshop.read("out/case/summary.md");
    assert!(page.contains("Set on the command line:"), "{page}");
    assert!(set.iter().all(|set| page.contains(&format!("* `{set}`"))), "{page}");
    assert!(!other.read("out/case/summary.md").contains("Set on"));
}

#[test]
fn words_need_no_quotes_and_missing_tables_are_made() {
    let workshop =
        Workshop::new(&changed(BLOCK, "[run]\nprecision = \"double\"\nstep = \"auto\"\nthreads = 1\n", ""));
    let output = check(
        &workshop,
        &[
            "body.block.element=tet4-anp",
            "run.solver=quasi-static",
            "run.load-steps=3",
            "scene.title=\"a block, pulled\"",
            "output.more={ type = \"csv\", every = 0.01 }",
            "surface.skin.mesh.edge=0.05",
        ],
    );
    assert_eq!((output.code, output.err.as_str()), (0, ""));
    for piece in ["a block, pulled", "tet4-anp", "output `more`", "set on the command line: run.load-steps=3"]
    {
        assert!(output.out.contains(piece), "no `{piece}` in {}", output.out);
    }
}

#[test]
fn a_mistake_shows_what_was_typed_underlined() {
    let workshop = Workshop::new(BLOCK);
    for (set, pieces) in [
        ("law.tisue.young-modulus=4e3", &["the scene has no law `tisue`", "did you mean `tissue`?"][..]),
        (
            "load.wobble.total=[0, 0, 1]",
            &["no load `wobble`", "the scene has `push`, `wind`, `squeeze`, `tilt`"],
        ),
        ("law.tissue.yong-modulus=4e3", &["unknown key `yong-modulus`", "did you mean `young-modulus`?"]),
        ("lw.tissue.young-modulus=4e3", &["unknown table `lw`", "did you mean `law`?"]),
        ("law.tissue.poisson-ratio=0.7", &["`law.tissue.poisson-ratio` must be", "found 0.7"]),
        ("law.tissue.young-modulus=soft", &["expected a number [Pa], found the text \"soft\""]),
        ("run.solver=quasistatic", &["did you mean \"quasi-static\"?"]),
        ("body.block.law=tisue", &["there is no law `tisue`", "did you mean `tissue`?"]),
        ("run.step=1", &["the step 1.000 s is above the critical time step"]),
        ("scene.gravity.3=0", &["the array `scene.gravity` has 3 items", "counted from 0"]),
        ("scene.until.x=0", &["`scene.until` is not a table"]),
        ("scene.until", &["is not an assignment", "write key=value, such as run.threads=2"]),
        ("scene.until=", &["is not an assignment", "write key=value"]),
        ("scene.until=1 2", &["is not an assignment"]),
        ("scene.until=-0.1", &["`scene.until` must be greater than 0, found -0.1"]),
        ("scene.until=99999999999999999999", &["64 bits"]),
        ("constraint.base.nodes.set=z-mni", &["z-mni", "did you mean"]),
    ] {
        let output = check(&workshop, &[set]);
        assert_eq!(output.code, 2, "{set}: {}", output.out);
        for piece in pieces {
            assert!(output.words().contains(piece), "{set}: no `{piece}` in {}", output.err);
        }
        assert!(output.underlines(&format!("--set {set}")), "{set}: {}", output.err);
        let json = workshop.run(&["--set", set]).json();
        let message = json["error"]["message"].as_str().unwrap();
        assert!(message.starts_with(&format!("--set {set}: error: ")), "{message}");
    }
    assert!(!workshop.path("out").exists());
}

#[test]
fn mistakes_of_the_file_and_of_several_options_are_told_together() {
    let workshop = Workshop::block("density = 1000", "density = 0");
    let output = check(&workshop, &["law.tissue.young-modulus=-1", "law.tissue.fibre-modulus=-2"]);
    assert_eq!(output.code, 2);
    assert!(output.words().contains("3 mistakes in case/scene.toml"), "{}", output.err);
    for line in ["density = 0", "--set law.tissue.young-modulus=-1", "--set law.tissue.fibre-modulus=-2"] {
        assert!(output.underlines(line), "{line}: {}", output.err);
    }
    let output = check(&Workshop::new(BLOCK), &["scene.until=0.1", "scene.until=0.2"]);
    assert!(output.words().contains("`scene.until` is set twice"), "{}", output.err);
    assert!(output.words().contains("it is set by `--set scene.until=0.1`, too"), "{}", output.err);
}
