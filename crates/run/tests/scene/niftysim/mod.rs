//! Models of NiftySim become scenes that can be read and built; what can't be meant is an error that helps.

mod loads;
mod touching;

use std::fs;
use std::path::{Path, PathBuf};

use pliant_format::Scene;
use pliant_format::source::Source;
use pliant_format::tables::{ByLabel, Hourglass};
use pliant_geometry::{CellKind, io};
use pliant_mechanics::load::LoadKind;
use pliant_niftysim::{ImportError, Imported, import};
use pliant_scene::Built;
use pliant_testing::Random;

use self::touching::contact;

fn sample(name: &str) -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("../../lab/validation/data/niftysim").join(name)
}

/// A folder that is removed when a test ends.
struct Folder(PathBuf);

impl Folder {
    fn new() -> Self {
        use std::sync::atomic::{AtomicU32, Ordering};
        static NUMBER: AtomicU32 = AtomicU32::new(0);
        let number = NUMBER.fetch_add(1, Ordering::Relaxed);
        let path = std::env::temp_dir().join(format!("pliant-niftysim-{}-{number}", std::process::id()));
        fs::create_dir_all(&path).unwrap();
        Self(path)
    }

    fn write(&self, name: &str, text: &str) -> PathBuf {
        let path = self.0.join(name);
        fs::write(&path, text).unwrap();
        path
    }
}

impl Drop for Folder {
    fn drop(&mut self) {
        let _ = fs::remove_dir_all(&self.0);
    }
}

fn import_text(text: &str) -> Result<Imported, ImportError> {
    import(&Folder::new().write("model.xml", text))
}

fn imported(text: &str) -> Imported {
    import_text(text).unwrap_or_else(|error| panic!("{error}"))
}

fn read(imported: &Imported, folder: &Folder) -> Scene {
    for (file, mesh) in &imported.meshes {
        io::write(&folder.0.join(file), mesh).unwrap();
    }
    let source = Source::parse("scene.toml", imported.scene.as_str()).unwrap();
    Scene::from_source(source, folder.0.clone()).unwrap_or_else(|error| panic!("{error}\n{}", imported.scene))
}

fn build(imported: &Imported) -> (Scene, Built) {
    let folder = Folder::new();
    let scene = read(imported, &folder);
    let built = pliant_scene::build(&scene).unwrap_or_else(|error| panic!("{error}\n{}", imported.scene));
    (scene, built)
}

/// Two tetrahedra on the triangle of nodes 0, 1, 2; node 3 above it and node 4 below.
const MESH: &str = "<Nodes DOF=\"3\" NumNodes=\"5\">0 0 0  1 0 0  0 1 0  0 0 1  0 0 -1</Nodes>\n\
                    <Elements NumEls=\"2\" Type=\"T4\">0 1 2 3  0 2 1 4</Elements>\n";
const NEO_HOOKEAN: &str =
    "<Material Type=\"NH\"><ElasticParams NumParams=\"2\">1000 10000</ElasticParams></Material>";
const SYSTEM: &str = "<SystemParams><TimeStep>0.001</TimeStep><TotalTime>0.1</TotalTime>\
                      <DampingCoeff>5</DampingCoeff><Density>1000</Density></SystemParams>\n";

fn sets() -> String {
    format!("<ElementSet Size=\"all\">{NEO_HOOKEAN} 0</ElementSet>\n")
}

/// RAMP over 0.1 s, and on in the step after.
const RAMP: &str = "curve = { table = [[0.0, 0.0], [0.101, 1.01]] }";

/// The two tetrahedra with other things in the model.
fn with(more: &str) -> String {
    format!("<Model>\n{MESH}{}{SYSTEM}{more}\n</Model>", sets())
}

fn assert_lines(imported: &Imported, lines: &[&str]) {
    let found: Vec<&str> =
        imported.scene.lines().map(|line| line.split("  #").next().unwrap_or(line)).collect();
    let there = found.windows(lines.len()).any(|window| window == lines);
    assert!(there, "no {lines:#?} in\n{}", imported.scene);
}

fn assert_note(imported: &Imported, part: &str) {
    assert!(imported.notes.iter().any(|note| note.contains(part)), "no `{part}` in {:#?}", imported.notes);
}

#[test]
fn a_model_becomes_a_scene_that_can_be_read() {
    let imported = import(&sample("T4_NH.xml")).unwrap();
    println!("{}", imported.scene);
    assert_lines(&imported, &["precision = \"single\"", "step = 0.00209617"]);
    // NiftySim takes 401 steps of this model.
    assert_lines(&imported, &["until = 0.84056417"]);
    let law = [
        "[law.material-0]",
        "type = \"neo-hookean\"",
        "shear-modulus = 1034.48276",
        "bulk-modulus = 10000.0",
    ];
    assert_lines(&imported, &law);
    let fix = ["[constraint.fix-0]", "type = \"fix\"", "body = \"model\"", "nodes = { set = \"fix-0\" }", ""];
    assert_lines(&imported, &fix);
    assert_lines(&imported, &["components = [\"z\"]", "by = [0.0, 0.0, 0.02]"]);
    let (scene, built) = build(&imported);
    assert_eq!(scene.constraints.len(), 2);
    assert_eq!((built.model.node_count(), built.model.cell_count()), (125, 384));
    assert_eq!(built.model.constraints[0].nodes, (0..25).collect::<Vec<_>>());
    assert_eq!(built.model.constraints[1].nodes, (100..125).collect::<Vec<_>>());
    assert_eq!(built.model.constraints[1].components[..3], [false, false, true]);
    let mass: f64 = built.model.mass.iter().sum();
    assert!((mass - 1.0).abs() < 1e-12, "a tenth of a metre cubed of water weighs a kilogram, not {mass} kg");
}

#[test]
fn published_fibre_modulus_and_backward_euler_are_kept() {
    let imported = import(&sample("T4_TIV.xml")).unwrap();
    assert_lines(&imported, &["convention = \"taylor\"", "fibre = [0.0, 0.0, 1.0]"]);
    assert_lines(&imported, &["    { part = \"isochoric\", weight = 0.5, time = 0.58 },", "]"]);
    assert_lines(&imported, &["prony-update = \"backward-euler\""]);
    assert_note(&imported, "half of which is in the energy");
    build(&imported);
}

#[test]
fn hourglass_stiffness_is_scaled_as_niftysim_scales_it() {
    let imported = import(&sample("H8_NH.xml")).unwrap();
    let (scene, _) = build(&imported);
    let (mu, kappa) = (1034.48276, 10_000.0);
    let expected = 0.075 * (kappa + 4.0 / 3.0 * mu) / mu;
    assert!(
        matches!(scene.bodies[0].1.hourglass, Some(ByLabel::One(Hourglass(c))) if (c - expected).abs() < 1e-12)
    );
    assert_note(&imported, "0.075 (λ + 2μ), which is 0.8250 μ");
}

/// NiftySim takes the coefficient μ of Arruda and Boyce's law, a scene takes the shear modulus at rest.
#[test]
fn arruda_boyce_and_polynomial_keep_their_parameters() {
    let imported = import(&sample("H8_AB.xml")).unwrap();
    assert_lines(
        &imported,
        &["shear-modulus = 1034.48276", "locking-stretch = 1.05", "bulk-modulus = 10000.0"],
    );
    assert_lines(&imported, &["volumetric = \"quad-log\""]);
    let hourglass = imported.scene.lines().find_map(|line| line.strip_prefix("hourglass = ")).unwrap();
    let ratio = 3.0 / (1.05_f64 * 1.05);
    let c = [1.0 / 2.0, 1.0 / 20.0, 11.0 / 1050.0, 19.0 / 7000.0, 519.0 / 673_750.0];
    let at_rest = 2.0
        * (c[0] + ratio * (2.0 * c[1] + ratio * (3.0 * c[2] + ratio * (4.0 * c[3] + ratio * 5.0 * c[4]))));
    let expected = 0.075 * (10_000.0 / 1034.48276 + 4.0 / 3.0) / at_rest;
    assert!((hourglass.parse::<f64>().unwrap() - expected).abs() < 1e-12, "{hourglass} is not {expected}");
    let imported = import(&sample("T4ANP_PY.xml")).unwrap();
    assert_lines(&imported, &["c10 = 413.793103", "c01 = 103.448276", "c20 = 0.0", "c11 = 0.0", "c02 = 0.0"]);
    assert_lines(&imported, &["element = \"tet4-ianp-niftysim\""]);
}

#[test]
fn polynomial_coefficients_go_by_name_not_by_place() {
    let material =
        "<Material Type=\"PY\"><ElasticParams NumParams=\"6\">10 1 20 2 11 1000</ElasticParams></Material>";
    let set = format!("<ElementSet Size=\"all\">{material} 0</ElementSet>");
    let imported = imported(&format!("<Model>{MESH}{set}{SYSTEM}</Model>"));
    let keys = ["c10 = 10.0", "c01 = 1.0", "c20 = 20.0", "c11 = 11.0", "c02 = 2.0", "bulk-modulus = 1000.0"];
    assert_lines(&imported, &keys);
}

#[test]
fn every_material_type_is_translated() {
    for (kind, parameters, law) in [
        ("NH", "1000 10000", "neo-hookean"),
        ("AB", "1000 2 10000", "arruda-boyce"),
        ("PY", "500 10 1 1 1 10000", "polynomial"),
        ("TI", "1000 10000 2000 1 1 0", "transversely-isotropic"),
        ("NHV", "1000 10000", "neo-hookean"),
        ("TIV", "1000 10000 2000 0 0 1", "transversely-isotropic"),
        ("LE", "3000 0.45", "st-venant-kirchhoff"),
    ] {
        let visco = "<ViscoParams NumIsoTerms=\"1\" NumVolTerms=\"2\">0.3 0.1 0.2 0.4 0.1 0.5</ViscoParams>";
        let count = parameters.split(' ').count();
        let set = format!(
            "<ElementSet Size=\"2\"><Material Type=\"{kind}\"><ElasticParams NumParams=\"{count}\">{parameters}\
             </ElasticParams>{visco}</Material>0</ElementSet>"
        );
        let imported = imported(&format!("<Model>{MESH}{set}{SYSTEM}</Model>"));
        assert_lines(&imported, &[&format!("type = \"{law}\"")]);
        let relaxing = imported.scene.matches("part = \"volumetric\"").count();
        assert_eq!(relaxing, if kind.ends_with('V') { 2 } else { 0 }, "{kind}");
    }
}

#[test]
fn nodes_chosen_by_their_normal_can_be_restricted() {
    let fix = |restriction: &str| {
        let more = format!(
            "<Constraint Type=\"Fix\" SpecType=\"NORMAL\"><Normal ToleranceAngle=\"1\">-1 0 0</Normal>{restriction}</Constraint>"
        );
        let (_, built) = build(&imported(&with(&more)));
        built.model.constraints[0].nodes.clone()
    };
    assert_eq!(fix(""), [0, 2, 3, 4]);
    assert_eq!(fix("<RestrictTo Type=\"Box\">-1 1 -1 0.5 -0.5 2</RestrictTo>"), [0, 3]);
    assert_eq!(fix("<RestrictTo Type=\"Sphere\">0.5 0 0 -1</RestrictTo>"), [4]);
    let both = "<RestrictTo Type=\"Box\">-1 1 -1 0.5 -2 2</RestrictTo><RestrictTo Type=\"Sphere\">0.5 0 0 -1</RestrictTo>";
    assert_eq!(fix(both), [4]);
}

#[test]
fn each_label_has_its_law() {
    let other = NEO_HOOKEAN.replace("1000 ", "2000 ");
    let sets = format!(
        "<ElementSet Size=\"1\">{NEO_HOOKEAN} 1</ElementSet><ElementSet Size=\"1\">{other} 0</ElementSet>"
    );
    let imported = imported(&format!("<Model>{MESH}{sets}{SYSTEM}</Model>"));
    assert_lines(&imported, &["law = { 0 = \"material-0\", 1 = \"material-1\" }"]);
    let block = imported.meshes[0].1.block(CellKind::Tet).unwrap();
    assert_eq!(block.data["label"].values, [1.0, 0.0]);
    let (_, built) = build(&imported);
    assert_eq!(built.model.solids.len(), 2);
}

#[test]
fn each_label_has_its_density_also_within_one_law() {
    let set = |material: &str, member| format!("<ElementSet Size=\"1\">{material} {member}</ElementSet>");
    let heavy = NEO_HOOKEAN.replace("</Material>", "<Density>3000</Density></Material>");
    let other = heavy.replace("1000 ", "2000 ");
    for (second, law) in
        [(heavy, "law = \"material-0\""), (other, "law = { 0 = \"material-0\", 1 = \"material-1\" }")]
    {
        let sets = set(NEO_HOOKEAN, 0) + &set(&second, 1);
        let imported = imported(&format!("<Model>{MESH}{sets}{SYSTEM}</Model>"));
        assert_lines(&imported, &[law, "density = { 0 = 1000.0, 1 = 3000.0 }"]);
        let (_, built) = build(&imported);
        let densities: Vec<f64> = built.model.solids.iter().map(|solid| solid.material.density).collect();
        assert_eq!(densities, [1000.0, 3000.0]);
        assert_eq!(built.model.solids.iter().map(|solid| solid.original[0]).collect::<Vec<_>>(), [0, 1]);
    }
}

/// The mesh of a file is turned about its centre, then scaled, then shifted.
#[test]
fn a_mesh_file_is_placed_in_the_order_of_niftysim() {
    let folder = Folder::new();
    let mesh = &imported(&with("")).meshes[0].1;
    io::write(&folder.0.join("tets.msh"), mesh).unwrap();
    io::write(&folder.0.join("tets.vtu"), mesh).unwrap();
    for (tag, file) in [("MSHMesh", "tets.msh"), ("VTKMesh", "tets.vtu")] {
        // Rotation from the centre (1, 1, 0): node 0 at (−1, −1, 0), around z to (1, −1, 0), around x to (1,
        // 0, −1). Then it is doubled to (2, 1, −1), and shifted. The other way round, first x and then z, it
        // would come to (0, −1, −1).
        let placed = format!(
            "<{tag} Type=\"T4\">\n  {file}\n  <Translation>0 0 10</Translation><ScaleFactor>2</ScaleFactor>\
             <Rotation>1 1 0 90 0 90</Rotation></{tag}>"
        );
        let path = folder.write("placed.xml", &format!("<Model>{placed}{}{SYSTEM}</Model>", sets()));
        let points = &import(&path).unwrap().meshes[0].1.points;
        let expected = [[4.0, 2.0, 8.0], [4.0, 2.0, 10.0], [2.0, 2.0, 8.0]];
        for (point, expected) in points.iter().zip(expected) {
            let off = (point - pliant_geometry::Vector3::from(expected)).norm();
            assert!(off < 1e-12, "{point} is not at {expected:?}");
        }
    }
}

fn submodel(shift: f64, more: &str) -> String {
    let nodes = [[0.0, 0.0, 0.0], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]];
    let nodes: String = nodes.iter().map(|x| format!("{} {} {} ", x[0] + shift, x[1], x[2])).collect();
    format!(
        "<SubModel><Nodes DOF=\"3\" NumNodes=\"4\">{nodes}</Nodes>\
         <Elements NumEls=\"1\" Type=\"T4\">0 1 2 3</Elements>{}{more}</SubModel>",
        sets()
    )
}

#[test]
fn submodels_are_bodies_of_their_own() {
    let fix = "<Constraint Type=\"Fix\" NumNodes=\"1\"><Nodes>3</Nodes></Constraint>";
    let imported = imported(&format!("<Model>{}{}{SYSTEM}</Model>", submodel(0.0, fix), submodel(5.0, fix)));
    assert_eq!(imported.meshes.len(), 2);
    let (_, built) = build(&imported);
    let names: Vec<&str> = built.bodies.iter().map(|body| body.name.as_str()).collect();
    assert_eq!(names, ["part-0", "part-1"]);
    let held: Vec<_> = built.model.constraints.iter().map(|c| c.nodes.clone()).collect();
    assert_eq!(held, [[3], [7]]);
}

/// Node 0 of the second submodel comes to lie at node 1 of the first.
#[test]
fn submodels_weld_within_a_distance() {
    let fix = "<Constraint Type=\"Fix\" NumNodes=\"2\"><Nodes>0 1</Nodes></Constraint>";
    let merger = |d: &str| format!("<SubModelNodeMergerDistance>{d}</SubModelNodeMergerDistance>");
    let model = |d: &str| {
        format!("<Model>{}{}{}{SYSTEM}</Model>", merger(d), submodel(0.0, ""), submodel(1.001, fix))
    };
    let welded = imported(&model("0.01"));
    assert_note(&welded, "2 submodels became one body; 1 nodes merged");
    let mesh = &welded.meshes[0].1;
    assert_eq!(mesh.points.len(), 7);
    assert_eq!(mesh.block(CellKind::Tet).unwrap().nodes, [0, 1, 2, 3, 1, 4, 5, 6]);
    assert_eq!(mesh.point_sets["fix-0"], [1, 4]);
    let model =
        |d: &str| format!("<Model>{}{}{}{SYSTEM}</Model>", merger(d), submodel(0.0, ""), submodel(1.25, ""));
    let nodes = |d: &str| imported(&model(d)).meshes[0].1.points.len();
    assert_eq!((nodes("0.25"), nodes("0.26")), (8, 7), "closer than the distance, not as close");
    let error = import_text(&model("1.5")).unwrap_err().to_string();
    assert!(error.contains("<SubModelNodeMergerDistance>") && error.contains("element 1"), "{error}");
}

/// A constraint of the model itself counts the nodes of all submodels.
#[test]
fn constraints_of_the_whole_join_submodels() {
    let fix = "<Constraint Type=\"Fix\" NumNodes=\"2\"><Nodes>1 6</Nodes></Constraint>";
    let imported =
        imported(&format!("<Model>{}{}{fix}{SYSTEM}</Model>", submodel(0.0, ""), submodel(5.0, "")));
    assert_eq!(imported.meshes[0].1.point_sets["fix-0"], [1, 6]);
    build(&imported);
}

#[test]
fn nodes_without_elements_are_dropped() {
    let mesh = MESH.replace("\"5\"", "\"6\"").replace("0 0 0  1 0 0", "9 9 9  0 0 0  1 0 0");
    let mesh = mesh.replace("0 1 2 3  0 2 1 4", "1 2 3 4  1 3 2 5");
    let fix = "<Constraint Type=\"Fix\" NumNodes=\"1\"><Nodes>4</Nodes></Constraint>";
    let imported = imported(&format!("<Model>{mesh}{}{fix}{SYSTEM}</Model>", sets()));
    assert_note(&imported, "1 nodes that no element uses were dropped");
    let (_, built) = build(&imported);
    assert_eq!(built.model.constraints[0].nodes, [3]);
}

#[test]
fn outputs_become_fields_and_tables() {
    let output = "<Output Freq=\"10\"><Variable>U</Variable><Variable>S</Variable><Variable>E</Variable>\
                  <Variable>F</Variable><Variable>EKin</Variable></Output>";
    let written = imported(&with(output));
    assert_lines(&written, &["every = 0.01", "data = [\"displacement\", \"pk2-stress\", \"green-strain\"]"]);
    assert_lines(&written, &["type = \"csv\"", "every = 0.01", "energy = true"]);
    build(&written);
    assert_note(&imported(&with("")), "asks for no output");
}

#[test]
fn what_is_not_supported_is_named_in_one_note() {
    let more = "<ShellElements Type=\"SURFACE\"/><ShellElementSet Size=\"all\"><Material Type=\"LinearShell\">\
                1 0.4 1 0.4<Density>1</Density><Thickness>1</Thickness></Material></ShellElementSet>\
                <KinematicContact/><Surprise/><ContactCylinder><Origin>0 0 2</Origin><Axis>0 0 1</Axis><Radius>0.1</Radius>\
                <Length>1</Length><RadChange>-0.05</RadChange><SlvNodes NumNodes=\"1\">3</SlvNodes></ContactCylinder>\
                <Constraint Type=\"Disp\" NumNodes=\"1\" LoadShape=\"RAMP\"><Nodes>0</Nodes>\
                <Magnitudes Type=\"FILE\">motion.txt</Magnitudes></Constraint>";
    let more = with(more).replace("</SystemParams>", "<ROM>1</ROM></SystemParams>");
    let imported = imported(&more);
    let left_out: Vec<_> = imported.notes.iter().filter(|note| note.starts_with("left out")).collect();
    let [note] = left_out[..] else { panic!("{:#?}", imported.notes) };
    for part in [
        "the shells of line 6 (LinearShell bends",
        "contact (KinematicContact",
        "contact (ContactCylinder of line 6: its radius changes by -0.05",
        "<Surprise> of line",
        "magnitudes from a file",
    ] {
        assert!(note.contains(part), "no `{part}` in {note}");
        assert!(imported.missing.iter().any(|missing| missing.contains(part)), "{:?}", imported.missing);
    }
    assert_note(&imported, "ROM: the full model is computed");
    build(&imported);
    assert!(self::imported(&with("")).missing.is_empty());
}

/// Each replacement of a good model by a bad one, and what the message must say.
#[test]
fn mistakes_are_named_with_element_line_number_and_remedy() {
    let good = with(
        "<Constraint Type=\"Disp\" DOF=\"2\" NumNodes=\"2\" LoadShape=\"RAMP\"><Nodes>3 4</Nodes>\
         <Magnitudes Type=\"UNIFORM\">0.1</Magnitudes></Constraint>",
    );
    imported(&good);
    let cases: &[(&str, &str, &[&str])] = &[
        (
            "<TimeStep>0.001</TimeStep>",
            "",
            &["line 5, <SystemParams>", "<TimeStep> is missing", "add <TimeStep>"],
        ),
        ("<TotalTime>0.1", "<TotalTime>-1", &["<TotalTime>", "the total time is -1", "greater than 0"]),
        ("<TimeStep>0.001", "<TimeStep>1e-300", &["<SystemParams>", "at most 1e12"]),
        ("0.001</", "soon</", &["line 5, <TimeStep>", "`soon` is not a number", "correct it"]),
        ("0.001</", "nan</", &["`nan` is not a number"]),
        ("<Density>1000</Density>", "", &["<Material>", "<Density> is missing", "<SystemParams>"]),
        ("NumNodes=\"5\"", "NumNodes=\"6\"", &["line 2, <Nodes>", "found 15 coordinates, expected 6 × 3"]),
        ("0 2 1 4<", "0 2 1 5<", &["line 3, <Elements>", "no node 5", "there are 5"]),
        ("0 2 1 4<", "0 2 1 -4<", &["no node -4"]),
        ("0 2 1 4<", "0 2 1<", &["found 7 node indices, expected 2 × 4"]),
        ("0 2 1 4<", "0 2 1 4.5<", &["`4.5` is not an index"]),
        ("Type=\"T4\"", "Type=\"T10\"", &["`T10` is not a known element type", "T4, T4ANP, H8"]),
        ("Type=\"T4\"", "", &["attribute `Type` is missing"]),
        (
            "Type=\"NH\"",
            "Type=\"MR\"",
            &["line 4, <Material>", "`MR` is not a known type of material", "NH, AB"],
        ),
        ("1000 10000", "1000", &["<ElasticParams>", "found 1 parameters, expected 2 (`NumParams`)"]),
        ("\"2\">1000 10000", "\"3\">1000 10000 1", &["found 3 parameters, expected 2: mu kappa (NH)"]),
        ("1000 10000", "-1000 10000", &["mu is -1000", "greater than 0"]),
        ("Size=\"all\"", "Size=\"3\"", &["line 4, <ElementSet>", "no element 2", "there are 2"]),
        ("Size=\"all\"", "Size=\"1\"", &["1 elements are in no <ElementSet>, the first of them element 1"]),
        ("Size=\"all\"", "Size=\"99999999999\"", &["no element 99999999998"]),
        (
            "Type=\"Disp\"",
            "Type=\"Push\"",
            &["line 6, <Constraint>", "`Push` is not a known type of constraint", "Fix, Disp"],
        ),
        ("Type=\"Disp\" ", "", &["attribute `Type` is missing"]),
        ("DOF=\"2\"", "DOF=\"3\"", &["`3` is not a known degree of freedom", "0, 1, 2, all"]),
        ("<Nodes>3 4<", "<Nodes>3 5<", &["line 6, <Nodes>", "no node 5"]),
        ("<Nodes>3 4<", "<Nodes>3 3<", &["node 3 is listed twice"]),
        ("NumNodes=\"2\"", "NumNodes=\"3\"", &["found 2 nodes, expected 3"]),
        ("NumNodes=\"2\"", "SpecType=\"NORMAL\"", &["<Normal> is missing"]),
        ("UNIFORM", "DIFFORM", &["found 1 magnitudes, expected 2, one for each node"]),
        ("UNIFORM", "RANDOM", &["`RANDOM` is not a known type of magnitudes"]),
        ("<Model>", "<Modell>", &["XML is broken"]),
    ];
    for (from, to, expected) in cases {
        assert!(good.contains(from), "{from}");
        let error = import_text(&good.replacen(from, to, 1)).map(|i| i.scene).unwrap_err().to_string();
        println!("{error}");
        for part in *expected {
            assert!(error.contains(part), "no `{part}` in: {error}");
        }
    }
    let error = import_text(&good.replace("Model>", "Madel>")).unwrap_err().to_string();
    assert!(error.contains("line 1, <Madel>") && error.contains("begins with <Model>"), "{error}");
}

#[test]
fn other_mistakes_are_named_too() {
    let disp = "<Constraint Type=\"Disp\" DOF=\"2\" NumNodes=\"1\" LoadShape=\"RAMP\"><Nodes>3</Nodes>\
                <Magnitudes Type=\"UNIFORM\">0.1</Magnitudes></Constraint>";
    let normal = "<Constraint Type=\"Fix\" SpecType=\"NORMAL\"><Normal ToleranceAngle=\"1\">0 0 0</Normal></Constraint>";
    let hexes = "<Nodes NumNodes=\"8\">0 0 0 1 0 0 1 1 0 0 1 0 0 0 1 1 0 1 1 1 1 0 1 1</Nodes>\
                 <Elements NumEls=\"1\" Type=\"H8\">0 1 2 3 4 5 6 7</Elements>";
    let twice = format!("<ElementSet Size=\"1\">{NEO_HOOKEAN} 0</ElementSet>");
    let cases = [
        (with(&disp.repeat(2)), "node 3 is displaced along z twice"),
        (with(normal), "direction of the normal is zero"),
        (with(&normal.replace("0 0 0", "1 -1 0")), "selects no nodes"),
        (with(&twice), "element 0 is in two sets"),
        (format!("<Model>{hexes}{}{SYSTEM}</Model>", sets()), "<HGKappa> is missing"),
        (format!("<Model>{SYSTEM}</Model>"), "<Nodes> is missing"),
        (format!("<Model><Nodes/><Elements Type=\"T4\"/>{SYSTEM}</Model>"), "no solid elements"),
        (format!("<Model><MSHMesh Type=\"T4\">gone.msh</MSHMesh>{SYSTEM}</Model>"), "gone.msh"),
        (format!("<Model><MSHMesh Type=\"T4\"/>{SYSTEM}</Model>"), "names of mesh files"),
        (format!("<Model>{MESH}</Model>"), "<SystemParams> is missing"),
    ];
    for (text, expected) in cases {
        let error = import_text(&text).map(|i| i.scene).unwrap_err().to_string();
        println!("{error}");
        assert!(error.contains(expected), "no `{expected}` in: {error}");
    }
    let error = import(Path::new("/nowhere/model.xml")).unwrap_err();
    assert!(matches!(error, ImportError::File { .. }), "{error}");
}

#[test]
fn every_sample_is_imported_and_none_panics_when_damaged() {
    let folder = Folder::new();
    for name in ["T4_NH", "T4_TIV", "T4ANP_PY", "H8_NH", "H8_AB"] {
        let path = sample(&format!("{name}.xml"));
        import(&path).unwrap_or_else(|error| panic!("{error}"));
        damage(&fs::read(&path).unwrap(), &folder, 60);
    }
    let everything = with(
        "<Constraint Type=\"Pressure\" NumFaces=\"1\" FaceType=\"Tri\" LoadShape=\"HILLY\"><Faces>0 1 3</Faces>\
         <Magnitude>7</Magnitude></Constraint><Constraint Type=\"Fix\" SpecType=\"NORMAL\">\
         <Normal ToleranceAngle=\"9\">0 0 1</Normal><RestrictTo Type=\"Box\">-1 1 -1 1 -1 1</RestrictTo></Constraint>\
         <Constraint Type=\"Gravity\" NumNodes=\"all\" LoadShape=\"STEP\"><AccelerationMagnitude>9</AccelerationMagnitude>\
         <AccelerationDirection>0 0 1</AccelerationDirection></Constraint><Output Freq=\"3\"><Variable>U</Variable></Output>",
    );
    damage(everything.as_bytes(), &folder, 900);
    let merger = "<SubModelNodeMergerDistance>0.1</SubModelNodeMergerDistance>";
    let submodels = format!("<Model>{merger}{}{}{SYSTEM}</Model>", submodel(0.0, ""), submodel(1.01, ""));
    damage(submodels.as_bytes(), &folder, 600);
    let contact =
        with(&contact()).replace("</SystemParams>", "<DoSelfCollision>1</DoSelfCollision></SystemParams>");
    damage(contact.as_bytes(), &folder, 900);
}

/// Cut off, with bits flipped, and with characters replaced: an error or a scene, never a panic.
fn damage(bytes: &[u8], folder: &Folder, rounds: usize) {
    let mut random = Random::new(1);
    let mut next = |limit: usize| random.below(limit);
    let alphabet = b"0123456789-.eE <>/\"=NTaHl";
    let path = folder.0.join("damaged.xml");
    for round in 0..rounds {
        let mut damaged = bytes.to_vec();
        match round % 3 {
            0 => damaged.truncate(next(bytes.len())),
            1 => {
                let at = next(bytes.len());
                damaged[at] ^= 1 << next(8);
            }
            _ => {
                for _ in 0..1 + next(3) {
                    let at = next(bytes.len());
                    damaged[at] = alphabet[next(alphabet.len())];
                }
            }
        }
        fs::write(&path, &damaged).unwrap();
        if let Ok(imported) = import(&path) {
            // An import is valid TOML, whatever it contains.
            Source::parse("scene.toml", imported.scene).unwrap_or_else(|error| panic!("{error}"));
        }
    }
}

/// NiftySim's examples, if the folder in PLIANT_DATA has them.
#[test]
fn niftysims_own_examples_are_imported() {
    let Some(data) = std::env::var_os("PLIANT_DATA") else {
        println!("skipped: set PLIANT_DATA to the folder that holds tled-niftysim/submodel_demo.xml");
        return;
    };
    let folder = Path::new(&data).join("tled-niftysim");
    let demo = import(&folder.join("submodel_demo.xml")).unwrap();
    println!("{}", demo.scene);
    let (_, built) = build(&demo);
    assert_eq!(built.bodies.len(), 3);
    let cube = import(&folder.join("cubehex10.xml")).unwrap();
    println!("{}", cube.scene);
    assert_eq!(cube.meshes[0].1.points.len(), 1331);
    for name in ["box_membrane.xml", "box_membrane_nonlin.xml"] {
        let imported = import(&folder.join(name)).unwrap();
        println!("{}", imported.scene);
        assert_lines(
            &imported,
            &["[body.membrane-0]", "model = \"membrane\"", "on = \"model\"", "law = \"membrane-0\""],
        );
        assert!(imported.missing.is_empty(), "{:?}", imported.missing);
        let (_, built) = build(&imported);
        assert_eq!(built.bodies.len(), 2);
    }
}

#[test]
fn magnitudes_that_differ_from_node_to_node_become_point_data() {
    let difform = |kind: &str, dof: &str| {
        let more = format!(
            "<Constraint Type=\"{kind}\" DOF=\"{dof}\" NumNodes=\"3\" LoadShape=\"STEP\"><Nodes>3 0 4</Nodes>\
             <Magnitudes Type=\"DIFFORM\">0.3 0.1 0.4</Magnitudes></Constraint>"
        );
        imported(&with(&more))
    };
    let moved = difform("Disp", "2");
    assert_lines(&moved, &["components = [\"z\"]", "by = { point-data = \"move-0\" }"]);
    let (_, built) = build(&moved);
    let constraint = &built.model.constraints[0];
    assert_eq!(constraint.nodes, [0, 3, 4]);
    assert_eq!([0, 1, 2].map(|index| constraint.motion.displacement(index, 0.1, 1.0)[2]), [0.1, 0.3, 0.4]);
    let pushed = difform("Force", "0");
    assert_lines(&pushed, &["each = { point-data = \"force-0\" }"]);
    let (_, built) = build(&pushed);
    let LoadKind::Forces(forces) = &built.model.loads[0].kind else { panic!("forces") };
    assert_eq!(forces[..], [(0, [0.1, 0.0, 0.0]), (3, [0.3, 0.0, 0.0]), (4, [0.4, 0.0, 0.0])]);
}

#[test]
fn tractions_that_differ_from_face_to_face_become_forces_on_nodes() {
    let more = "<Constraint Type=\"Traction\" NumFaces=\"2\" FaceType=\"Tri\" LoadShape=\"RAMP\"><Faces>0 1 3  0 1 4</Faces>\
                <Magnitudes Type=\"DIFFORM\">0 0 6  0 12 0</Magnitudes></Constraint>";
    let imported = imported(&with(more));
    assert_note(&imported, "one for each face");
    let (_, built) = build(&imported);
    let LoadKind::Forces(forces) = &built.model.loads[0].kind else { panic!("forces") };
    // Areas of ½ m², shared by three nodes each, and NiftySim's sign.
    assert_eq!(
        forces[..],
        [(0, [0.0, -2.0, -1.0]), (1, [0.0, -2.0, -1.0]), (3, [0.0, 0.0, -1.0]), (4, [0.0, -2.0, 0.0])]
    );
}
