//! Outputs and messages of a run, through the real binary: files, names and numbers as promised.

use std::fs;
use std::path::Path;
use std::process::Stdio;
use std::time::{Duration, Instant};

use pliant_testing::scenes::ROOT;
use serde_json::Value;

use crate::support::{BLOCK, CORNERS, FROM_FILE, Said, TETS, Workshop, changed, labels, series, vtk};

#[track_caller]
fn assert_close(found: f64, expected: f64, tolerance: f64, what: &str) {
    assert!(
        (found - expected).abs() <= tolerance,
        "{what}: found {found}, expected {expected} ± {tolerance}"
    );
}

fn keys(object: &Value) -> Vec<&str> {
    object.as_object().expect("an object").keys().map(String::as_str).collect()
}

/// The keys of `--json`, in their order.
const KEYS: [&str; 31] = [
    "status",
    "error",
    "bodies",
    "nodes",
    "elements",
    "mass",
    "step",
    "element_bound",
    "critical_step",
    "limiting_element",
    "participants",
    "ties",
    "guests",
    "solver",
    "equilibria",
    "ended",
    "shell_strains",
    "intersections",
    "volume_changes",
    "device",
    "precision",
    "steps",
    "wall_seconds",
    "real_time_factor",
    "stability",
    "added_mass",
    "energy_balance",
    "reactions",
    "volumes",
    "warnings",
    "files",
];

#[test]
fn json_has_exactly_the_promised_keys() {
    let workshop = Workshop::new(BLOCK);
    // The four automatic steps hardly resolve a gravity that sets in at once.
    let done = workshop.run(&["--step", "1e-3"]).done();
    assert_eq!(keys(&done), KEYS);
    assert!(done["error"].is_null());
    assert_eq!((done["nodes"].as_u64(), done["elements"].as_u64()), (Some(27), Some(48)));
    assert_close(done["mass"].as_f64().unwrap(), 1.0, 1e-12, "mass [kg]");
    assert_eq!(done["bodies"][0]["name"], "block");
    assert_eq!(keys(&done["reactions"]), ["base", "hand"]);
    assert_eq!(done["reactions"]["base"].as_array().unwrap().len(), 3);
    assert_eq!(done["limiting_element"]["body"], "block");
    assert!(done["energy_balance"].as_f64().unwrap() < 0.01);
    let files: Vec<&str> = done["files"].as_array().unwrap().iter().filter_map(Value::as_str).collect();
    let expected_files = ["fields.pvd", "history.csv", "plot.svg", "summary.md"];
    assert_eq!(files, expected_files.map(|file| format!("out/case/{file}")));
    assert!(files.iter().all(|file| workshop.path(file).is_file()));

    let refused = Workshop::block("density = 1000", "density = 0").run(&[]).json();
    assert_eq!(keys(&refused), KEYS);
    let error = ["kind", "body", "element", "node", "time", "load_step", "blocked", "message"];
    assert_eq!(keys(&refused["error"]), error);
}

#[test]
fn options_take_the_place_of_what_the_scene_says() {
    let workshop = Workshop::new(BLOCK);
    let done = workshop.run(&["--until", "0.004", "--step", "0.001", "--out", "elsewhere/deep"]).done();
    assert_eq!(done["steps"], 4);
    assert_close(done["step"].as_f64().unwrap(), 0.001, 1e-15, "step [s]");
    assert!(workshop.path("elsewhere/deep/summary.md").exists() && !workshop.path("out").exists());

    let history = |arguments: &[&str]| {
        workshop.run(&[&["--force"], arguments].concat()).done();
        (workshop.read("out/case/history.csv"), workshop.read("out/case/summary.md"))
    };
    let (one, page) = history(&["--threads", "1"]);
    assert!(page.contains("| threads | 1 |") && page.contains("| precision | double |"), "{page}");
    let (three, page) = history(&["--threads", "3"]);
    assert!(page.contains("| threads | 3 |"), "{page}");
    assert_eq!(one, three, "the number of threads changed a bit");
    let (single, page) = history(&["--precision", "single"]);
    assert!(page.contains("| precision | single |"), "{page}");
    assert_ne!(one, single);
}

#[test]
fn a_folder_means_its_scene_and_names_the_outputs() {
    let workshop = Workshop::new(BLOCK);
    workshop.write("case/other.toml", BLOCK);
    for (scene, out) in [("case", "out/case"), ("case/other.toml", "out/other")] {
        let output = workshop.pliant(&["run", scene, "--json", "--until", "0.002"]);
        output.done();
        assert!(workshop.path(out).join("summary.md").exists(), "{out}");
    }
    let output = workshop.pliant(&["run", "case/scene.toml", "--until", "0.002"]);
    assert_eq!(output.code, 2, "the folder of the scene holds a run already: {}", output.out);
    let mut inside = workshop.command(&["run", ".", "--until", "0.002"]);
    let output = Said::from(inside.current_dir(workshop.path("case")).output().unwrap());
    assert_eq!(output.code, 0, "{}", output.err);
    assert!(workshop.path("case/out/case/summary.md").exists());
}

#[test]
fn a_run_tells_its_result_in_words() {
    let workshop = Workshop::new(BLOCK);
    let output = workshop.pliant(&["run", "case"]);
    assert_eq!(output.code, 0);
    for piece in [
        "27 nodes, 48 elements; step ",
        "real time; energies balance to",
        "smallest stable step seen: ",
        "reaction of `hand`: (",
        "wrote out/case/summary.md",
    ] {
        assert!(output.out.contains(piece), "no `{piece}` in {}", output.out);
    }
    let page = workshop.read("out/case/summary.md");
    for piece in [
        "| block |",
        "element bound",
        "critical time step (assembled model)",
        "Balance:",
        "| base |",
        "wall time",
        "real-time factor",
        "plot.svg",
    ] {
        assert!(page.contains(piece), "no `{piece}` in {page}");
    }
    let plot = workshop.read("out/case/plot.svg");
    assert!(
        plot.starts_with("<svg") && plot.contains("Reaction [N]") && plot.contains("external work"),
        "{plot}"
    );
}

#[test]
fn a_failed_run_says_where_and_leaves_what_it_wrote() {
    let scene =
        changed(BLOCK, "by = [0, 0, 0.001]", "by = [0, 0, -0.2]").replace("until = 0.02", "until = 0.1");
    let workshop = Workshop::new(&scene);
    let output = workshop.run(&[]);
    assert_eq!(output.code, 1);
    let json = output.json();
    assert_eq!((&json["status"], &json["error"]["kind"]), (&"failed".into(), &"inverted".into()));
    assert_eq!(json["error"]["body"], "block");
    let element = json["error"]["element"].as_u64().unwrap();
    assert!(element < 48 && json["error"]["node"].as_u64().unwrap() < 27, "{json}");
    let time = json["error"]["time"].as_f64().unwrap();
    assert!(time > 0.0 && time < 0.1, "{json}");
    let message = json["error"]["message"].as_str().unwrap();
    for piece in [&format!("element {element} of `block` is inverted"), "det F", "t = ", "finer mesh"] {
        assert!(message.contains(piece) && output.err.contains(piece), "no `{piece}` in {message}");
    }
    let frames = workshop.series("out/case/fields.pvd");
    assert!(frames.len() > 1 && frames.iter().all(|(written, _)| *written < time));
    let (_, rows) = workshop.table("out/case/history.csv");
    assert!(rows.last().unwrap()[0] <= time);
    let page = workshop.read("out/case/summary.md");
    assert!(page.contains("**Failed** (inverted)") && page.contains(message), "{page}");
}

#[test]
fn a_killed_run_leaves_a_series_that_can_be_read() {
    let workshop = Workshop::block("until = 0.02", "until = 100");
    let mut child =
        workshop.command(&["run", "case"]).stdout(Stdio::null()).stderr(Stdio::null()).spawn().unwrap();
    let index = workshop.path("out/case/fields.pvd");
    let patience = Instant::now();
    while fs::read_to_string(&index).map_or(0, |text| text.matches("<DataSet").count()) < 5 {
        assert!(patience.elapsed() < Duration::from_secs(30), "no frames came");
        std::thread::sleep(Duration::from_millis(1));
    }
    child.kill().unwrap();
    child.wait().unwrap();
    let frames = series(&index);
    assert!(frames.len() >= 5 && frames[0].0 == 0.0);
    assert!(!workshop.path("out/case/summary.md").exists());
    let (_, rows) = workshop.table("out/case/history.csv");
    assert!(!rows.is_empty());
    // The next run in the same folder leaves none of these files.
    workshop.run(&["--force", "--until", "0.004"]).done();
    assert_eq!(workshop.series("out/case/fields.pvd").len(), 2);
    assert_eq!(fs::read_dir(workshop.path("out/case/fields")).unwrap().count(), 2);
}

#[test]
fn info_asks_whether_a_large_mesh_is_in_millimetres() {
    let workshop = Workshop::new("");
    workshop.write("organ.vtk", vtk(&CORNERS.map(|p| p.map(|x| 1000.0 * x)), &TETS, ""));
    let hint = "`--scale 0.001` brings millimetres to metres";
    assert!(workshop.pliant(&["info", "organ.vtk"]).out.contains(hint));
    assert!(!workshop.pliant(&["info", "organ.vtk", "--scale", "0.001"]).out.contains(hint));
}

#[test]
fn a_new_scene_runs_as_it_is() {
    let workshop = Workshop::new(BLOCK);
    for name in ["my-organ", "deep/er \"organ\""] {
        let output = workshop.pliant(&["new", name]);
        assert_eq!(output.code, 0, "{}", output.err);
        assert!(output.out.contains("try: pliant run"), "{}", output.out);
        let output = workshop.pliant(&["run", name, "--json", "--until", "0.01"]);
        output.done();
    }
    let check = workshop.pliant(&["check", "my-organ"]);
    assert!(check.out.starts_with("my-organ\n"), "{}", check.out);
    assert_eq!((check.code, check.err.as_str()), (0, ""), "a starter scene leaves no doubts");
}

#[test]
fn check_prints_the_model_and_writes_nothing() {
    let workshop = Workshop::new(BLOCK);
    let output = workshop.pliant(&["check", "case"]);
    assert_eq!((output.code, output.err.as_str()), (0, ""));
    for piece in [
        "body `block`",
        "27 nodes, 48 elements",
        "mass 1.000 kg",
        "transversely-isotropic",
        "1 relaxing term\n",
        "quality",
        "0.9–1.0",
        "surface `skin` on `block`",
        "constraint `base`: fixes xyz of 9 nodes",
        "constraint `hand`: moves xyz of 9 nodes",
        "load `push`: (0.1000, 0, 0) N in all on 1 node",
        "load `wind`: (0, 0.1000, 0) N in all on",
        "load `squeeze`: 20.00 Pa on 8 faces",
        "load `tilt`: (1.000, 0, 0) m/s² on `block`",
        "output `fields`: fields.pvd, a frame every 0.004000 s",
        "element bound",
        "set by element 0 (tet4) of `block`",
        "critical time step",
        "assembled",
        "expected cost",
        "real-time factor",
    ] {
        assert!(output.out.contains(piece), "no `{piece}` in {}", output.out);
    }
    let left: Vec<_> =
        fs::read_dir(workshop.path("")).unwrap().map(|entry| entry.unwrap().file_name()).collect();
    assert_eq!(left, ["case"]);
    assert_eq!(fs::read_dir(workshop.path("case")).unwrap().count(), 1);
}

#[test]
fn info_tells_what_a_mesh_holds_and_what_is_wrong() {
    let workshop = Workshop::new(BLOCK);
    workshop.write("good.vtk", vtk(&CORNERS, &TETS, &labels(&[1; 6])));
    let output = workshop.pliant(&["info", "good.vtk", "--scale", "0.5"]);
    assert_eq!(output.code, 0, "{}", output.err);
    for piece in [
        "legacy VTK 3.0 ASCII",
        "from (0, 0, 0) to (0.05000",
        "tet cells        6",
        "1.250000e-4 m³",
        "cell data `label`",
        "no faults found",
    ] {
        assert!(output.out.contains(piece), "no `{piece}` in {}", output.out);
    }
    let output = workshop.pliant(&["info", "good.vtk", "--convert", "good.msh"]);
    assert_eq!(output.code, 0, "{}", output.err);
    assert!(workshop.pliant(&["info", "good.msh"]).out.contains("tet cells        6"));
    let mut tets = TETS;
    tets[2] = &[0, 6, 2, 7];
    workshop.write("bad.vtk", vtk(&CORNERS, &tets, ""));
    let output = workshop.pliant(&["info", "bad.vtk"]);
    assert_eq!(output.code, 0);
    assert!(output.out.contains("inverted cells: 1 (tet 2)"), "{}", output.out);
    let object = workshop.pliant(&["info", "bad.vtk", "--json"]).json();
    assert_eq!((&object["usable"], &object["cells"]["tet"]), (&false.into(), &6.into()), "{object}");
    let open = "OFF\n4 2 0\n0 0 0\n1 0 0\n1 1 0\n0 1 0\n3 0 1 2\n3 0 2 3\n";
    workshop.write("open.off", open);
    assert!(workshop.pliant(&["info", "open.off"]).out.contains("open edges: 4"));
}

#[test]
fn every_subcommand_helps_with_an_example() {
    let workshop = Workshop::new(BLOCK);
    for subcommand in [&[][..], &["run"], &["check"], &["sweep"], &["new"], &["schema"], &["info"]] {
        let output = workshop.pliant(&[subcommand, &["--help"]].concat());
        assert_eq!(output.code, 0);
        let example =
            output.out.split_once("Example").unwrap_or_else(|| panic!("{subcommand:?}: {}", output.out)).1;
        assert!(example.contains(&format!("pliant {}", subcommand.first().unwrap_or(&"run"))), "{example}");
    }
    assert_eq!(workshop.pliant(&[]).code, 2);
}

/// The schema of `pliant schema`.
fn schema() -> Value {
    let output = Workshop::new(BLOCK).pliant(&["schema"]);
    assert_eq!(output.code, 0);
    output.json()
}

/// The target of a schema reference, and its alternatives.
fn alternatives<'s>(schema: &'s Value, root: &'s Value) -> Vec<&'s Value> {
    let target = schema["$ref"].as_str().and_then(|path| root.pointer(path.strip_prefix('#')?));
    let parts = ["anyOf", "oneOf"].into_iter().filter_map(|key| schema[key].as_array()).flatten();
    let deeper = target.into_iter().chain(parts).flat_map(|part| alternatives(part, root));
    std::iter::once(schema).chain(deeper).collect()
}

/// Asserts that a schema has every key of a value, recursively.
fn assert_known(value: &toml::Value, schemas: &[&Value], root: &Value, path: &str) {
    let choices: Vec<&Value> = schemas.iter().flat_map(|schema| alternatives(schema, root)).collect();
    match value {
        toml::Value::Table(table) => {
            for (key, child) in table {
                let of = |schema: &&'_ Value| {
                    let property = schema["properties"].get(key);
                    let found = property
                        .or_else(|| schema.get("additionalProperties").filter(|other| other.is_object()));
                    found.cloned()
                };
                let known: Vec<Value> = choices.iter().filter_map(of).collect();
                assert!(!known.is_empty(), "the schema has no `{path}.{key}`");
                assert_known(child, &known.iter().collect::<Vec<_>>(), root, &format!("{path}.{key}"));
            }
        }
        toml::Value::Array(items) => {
            let of_items: Vec<&Value> = choices.iter().filter_map(|schema| schema.get("items")).collect();
            items.iter().for_each(|item| assert_known(item, &of_items, root, path));
        }
        _ => {}
    }
}

#[test]
fn the_schema_knows_every_key_of_the_shipped_scenes() {
    let schema = schema();
    assert_eq!(schema["$schema"], "https://json-schema.org/draft/2020-12/schema");
    let shipped = fs::read_dir(Path::new(ROOT).join("scenes")).unwrap();
    let mut scenes: Vec<String> = shipped
        .map(|entry| entry.unwrap().path())
        .filter(|path| path.is_dir())
        .map(|folder| fs::read_to_string(folder.join("scene.toml")).expect("a scene"))
        .collect();
    scenes.extend([BLOCK.to_owned(), pliant_format::starter("a scene"), FROM_FILE.to_owned()]);
    for text in scenes {
        let scene: toml::Table = toml::from_str(&text).unwrap();
        assert_known(&toml::Value::Table(scene), &[&schema], &schema, "");
    }
    for (table, section) in
        [("constraint", "fix"), ("load", "pressure"), ("output", "csv"), ("law", "neo-hookean")]
    {
        let kinds = schema["properties"][table]["additionalProperties"]["oneOf"].as_array().unwrap();
        assert!(kinds.iter().any(|kind| kind["properties"]["type"]["const"] == section), "{table} {section}");
    }
}

#[test]
fn the_reference_page_lists_every_kind_of_table() {
    let page = Workshop::new(BLOCK).pliant(&["schema", "--markdown"]).out;
    for piece in
        ["## `[scene]`", "### `type = \"transversely-isotropic\"`", "| `edge` |", "| `weight` |", "kg/m³"]
    {
        assert!(page.contains(piece), "no `{piece}`");
    }
}

#[test]
fn a_shipped_scene_runs_from_anywhere() {
    let workshop = Workshop::new(BLOCK);
    let liver = Path::new(ROOT).join("scenes/liver");
    let output = workshop.pliant(&["check", liver.to_str().unwrap()]);
    assert_eq!((output.code, output.err.as_str()), (0, ""));
    let output = workshop.pliant(&["run", liver.to_str().unwrap(), "--json", "--until", "0.01"]);
    assert!(output.done()["elements"].as_u64().unwrap() >= 2400);
    assert!(workshop.path("out/liver/summary.md").exists());
}

#[test]
fn a_reader_that_leaves_early_is_no_mistake() {
    let workshop = Workshop::new(BLOCK);
    let mut child =
        workshop.command(&["schema"]).stdout(Stdio::piped()).stderr(Stdio::piped()).spawn().unwrap();
    drop(child.stdout.take());
    let output = Said::from(child.wait_with_output().unwrap());
    assert_eq!((output.code, output.err.as_str()), (0, ""));
}

#[test]
fn a_niftysim_model_runs_as_it_is_or_as_the_scene_it_becomes() {
    let model = r#"<Model>
        <Nodes DOF="3" NumNodes="4">0 0 0  0.1 0 0  0 0.1 0  0 0 0.1</Nodes>
        <Elements NumEls="1" Type="T4">0 1 2 3</Elements>
        <ElementSet Size="all"><Material Type="AB">
            <ElasticParams NumParams="3">1000 3 10000</ElasticParams></Material></ElementSet>
        <Constraint Type="Fix" DOF="all" NumNodes="3"><Nodes>0 1 2</Nodes></Constraint>
        <Constraint Type="Disp" DOF="2" NumNodes="1" LoadShape="RAMP">
            <Nodes>3</Nodes><Magnitudes Type="UNIFORM">0.01</Magnitudes></Constraint>
        <SystemParams><TimeStep>0.001</TimeStep><TotalTime>0.1</TotalTime><DampingCoeff>1</DampingCoeff>
            <Density>1000</Density></SystemParams></Model>"#;
    let workshop = Workshop::new("");
    workshop.write("model.xml", model);
    let output = workshop.pliant(&["run", "model.xml", "--json"]);
    let direct = output.done();
    assert!(output.err.contains("note: "), "{}", output.err);
    assert!(workshop.path("out/model/fields.pvd").is_file());
    workshop.pliant(&["import", "model.xml", "-o", "translated.toml"]).words();
    let scene = workshop.pliant(&["run", "translated.toml", "--json"]).done();
    assert_eq!(direct["reactions"], scene["reactions"]);
    let again = workshop.pliant(&["import", "model.xml", "-o", "translated.toml"]);
    assert!(again.code == 2 && again.err.contains("exists already"), "{}", again.err);
    let more = "<KinematicContact/><ShellElements Type=\"SURFACE\"/><ShellElementSet Size=\"all\"><Material Type=\"LinearShell\">\
                1 0.4 1 0.4<Density>1</Density><Thickness>1</Thickness></Material></ShellElementSet></Model>";
    workshop.write("partial.xml", model.replace("</Model>", more));
    for arguments in
        [&["run", "partial.xml"][..], &["import", "partial.xml", "-o", "partial"], &["check", "partial.xml"]]
    {
        let output = workshop.pliant(arguments);
        assert_eq!(output.code, 2, "{arguments:?}: {}", output.err);
        for part in ["partial.xml", "LinearShell bends", "contact (KinematicContact", "--allow-partial"] {
            assert!(output.err.contains(part), "{arguments:?}: no `{part}` in {}", output.err);
        }
        assert!(!workshop.path("out/partial").exists() && !workshop.path("partial").exists());
    }
    let output = workshop.pliant(&["run", "partial.xml", "--allow-partial", "--json"]);
    assert!(output.err.contains("left out"), "{}", output.err);
    assert_eq!(output.done()["reactions"], direct["reactions"]);
    workshop.pliant(&["import", "partial.xml", "-o", "partial", "--allow-partial"]).words();
    assert!(workshop.path("partial/scene.toml").is_file());
    // A plate that turns away from the tip, which moves off it, and a rigid surface that follows a table of
    // poses.
    let contact = "<ContactPlate><a>-1 -1 -1</a><b>1 -1 -1</b><c>-1 1 -1</c><Disp>0 0 -0.1</Disp>\
                   <SlvNodes NumNodes=\"3\">0 1 2</SlvNodes></ContactPlate>\
                   <ContactSurface><Nodes NumNodes=\"3\">-1 -1 -0.5  1 -1 -0.5  0 1 -0.5</Nodes><Elements NumEls=\"1\" Type=\"T3\">0 1 2\
                   </Elements><Motion Type=\"Rotation\">0.1 0.1 0  0 0 -0.5</Motion></ContactSurface>\
                   <ShellElements Type=\"SURFACE\"/><ShellElementSet Size=\"all\"><Material Type=\"NeoHookean\">100\
                   <Density>1000</Density><Thickness>1e-3</Thickness></Material></ShellElementSet></Model>";
    workshop.write("touching.xml", model.replace("</Model>", contact));
    let direct = workshop.pliant(&["run", "touching.xml", "--json"]).done();
    workshop.pliant(&["import", "touching.xml", "-o", "carried"]).words();
    assert!(workshop.path("carried/touching-surface-0.csv").is_file());
    let scene = workshop.pliant(&["run", "carried", "--json"]).done();
    assert_eq!(direct["reactions"], scene["reactions"]);
    workshop.write("broken.xml", &model[..200]);
    let output = workshop.pliant(&["run", "broken.xml"]);
    assert!(output.code == 2 && output.err.contains("broken.xml"), "{}", output.err);
}
