use super::*;
use crate::testing::{block_of_hexes, block_of_tets, points};
use crate::{CellKind, DataArray, boundary};

/// A selection as a scene file has it.
fn parse(toml: &str) -> Selection {
    read(toml).unwrap_or_else(|error| panic!("{toml}: {error}"))
}

fn read(toml: &str) -> Result<Selection, toml::de::Error> {
    #[derive(Deserialize)]
    struct Table {
        nodes: Selection,
    }
    toml::from_str::<Table>(&format!("nodes = {toml}")).map(|table| table.nodes)
}

/// 2 × 2 × 2 unit cubes with labels 1 (x < 1) and 2, and sets.
fn block() -> Mesh {
    let mut mesh = block_of_hexes([2, 2, 2]);
    let labels = (0..8).map(|cell| if cell % 2 == 0 { 1.0 } else { 2.0 }).collect();
    mesh.blocks[0].data.insert("label".into(), DataArray::scalar(labels));
    mesh.label_names = [(1, "liver".to_owned()), (2, "tumour".to_owned())].into();
    mesh.blocks[0].sets.insert("first-cell".into(), vec![0]);
    mesh.point_sets.insert("bottom".into(), (0..9).collect());
    mesh.block_mut(CellKind::Quad).nodes.extend([0, 1, 4, 3, 4, 13, 14, 5]);
    mesh.blocks[1].sets.insert("skin".into(), vec![0]);
    mesh.blocks[1].sets.insert("inner".into(), vec![1]);
    mesh
}

fn nodes(toml: &str) -> Vec<u32> {
    let mesh = block();
    parse(toml).nodes(&mesh, &boundary(&mesh)).unwrap()
}

fn faces(toml: &str) -> Vec<u32> {
    let mesh = block();
    parse(toml).faces(&mesh, &boundary(&mesh)).unwrap()
}

fn node_error(toml: &str) -> String {
    let mesh = block();
    parse(toml).nodes(&mesh, &boundary(&mesh)).unwrap_err().to_string()
}

const FORMS: [&str; 19] = [
    r#""all""#,
    r#""boundary""#,
    "{ box = [[0, 0, 0], [1, 1.5, 1]] }",
    "{ sphere = { centre = [0, 0, 0], radius = 1 } }",
    "{ half-space = { point = [0, 0, 1], normal = [0, 0, 3] } }",
    "{ plane = { point = [0, 0, 0], normal = [0, 0, 1] } }",
    "{ plane = { point = [0, 0, 0.1], normal = [0, 0, 1], tolerance = 0.2 } }",
    "{ normal = { direction = [0, 0, 1], within = 30.0 } }",
    "{ nearest = { point = [0.1, 0, 0] } }",
    "{ nearest = { point = [0, 0, 0], count = 4 } }",
    r#"{ set = "bottom" }"#,
    "{ label = 2 }",
    "{ label-boundary = [1, 2] }",
    "{ ids = [5, 3, 5] }",
    r#"{ union = [{ ids = [1] }, "boundary"] }"#,
    r#"{ intersection = ["boundary", { label = 2 }] }"#,
    r#"{ difference = ["all", "boundary"] }"#,
    r#"{ label = "Tumour" }"#,
    r#"{ label-boundary = ["liver", 2] }"#,
];

#[test]
fn every_form_is_read_written_back_and_selects_nodes() {
    let counts = [27, 26, 8, 4, 18, 9, 9, 9, 1, 4, 9, 18, 9, 2, 26, 17, 1, 18, 9];
    for (form, count) in FORMS.into_iter().zip(counts) {
        let selection = parse(form);
        let again = serde_json::to_string(&selection).unwrap();
        assert_eq!(serde_json::from_str::<Selection>(&again).unwrap(), selection);
        assert_eq!(nodes(form).len(), count, "{form}");
    }
}

#[test]
fn nodes_are_increasing_and_unique() {
    assert_eq!(nodes("{ ids = [5, 3, 5] }"), [3, 5]);
    assert_eq!(nodes("{ union = [{ ids = [5] }, { ids = [3, 5] }] }"), [3, 5]);
    assert_eq!(nodes(r#"{ difference = ["all", "boundary"] }"#), [13]);
    assert_eq!(nodes("{ nearest = { point = [0.1, 0, 0] } }"), [0]);
    assert_eq!(nodes("{ label-boundary = [1, 2] }"), [1, 4, 7, 10, 13, 16, 19, 22, 25]);
}

#[test]
fn regions_include_their_boundary_in_spite_of_rounding() {
    let mut mesh = block_of_hexes([3, 3, 3]);
    mesh.points.iter_mut().for_each(|p| *p *= 0.1);
    let surface = boundary(&mesh);
    // 3 × 0.1 > 0.3 in floating point.
    for (form, count) in [
        ("{ box = [[0, 0, 0.3], [0.3, 0.3, 0.3]] }", 16),
        ("{ half-space = { point = [0, 0, 0.3], normal = [0, 0, -1] } }", 64),
        ("{ sphere = { centre = [0, 0, 0], radius = 0.1 } }", 4),
        ("{ plane = { point = [0, 0, 0.3], normal = [0, 0, 1], tolerance = 0 } }", 16),
    ] {
        assert_eq!(parse(form).nodes(&mesh, &surface).unwrap().len(), count, "{form}");
    }
}

#[test]
fn faces_follow_their_nodes_their_normal_or_their_cell() {
    assert_eq!(faces(r#""all""#).len(), 24);
    assert_eq!(faces("{ plane = { point = [0, 0, 0], normal = [0, 0, 1] } }").len(), 4);
    assert_eq!(faces("{ normal = { direction = [0, 0, 1], within = 30 } }").len(), 4);
    assert_eq!(faces("{ normal = { direction = [0, 0, 1], within = 90 } }").len(), 20);
    assert_eq!(faces(r#"{ set = "bottom" }"#).len(), 4);
    assert_eq!(faces(r#"{ set = "first-cell" }"#).len(), 3);
    assert_eq!(faces(r#"{ set = "skin" }"#).len(), 1);
    assert_eq!(faces("{ label = 1 }").len(), 12);
    assert_eq!(faces("{ label = 'liver' }"), faces("{ label = 1 }"));
    assert_eq!(faces("{ intersection = [{ label = 1 }, { set = \"bottom\" }] }").len(), 2);
    assert_eq!(faces("{ difference = [\"all\", { label = 1 }, { set = \"bottom\" }] }").len(), 10);
}

#[test]
fn faces_of_tets_work_too() {
    let mesh = block_of_tets([2, 2, 2]);
    let surface = boundary(&mesh);
    let top = parse("{ normal = { direction = [0, 0, 1], within = 1 } }");
    let plane = parse("{ plane = { point = [0, 0, 2], normal = [0, 0, 1] } }");
    let faces = top.faces(&mesh, &surface).unwrap();
    assert_eq!(faces.len(), 8);
    assert_eq!(faces, plane.faces(&mesh, &surface).unwrap());
    assert_eq!(top.nodes(&mesh, &surface), plane.nodes(&mesh, &surface));
}

#[test]
fn a_shell_is_its_own_boundary() {
    let mut mesh =
        Mesh { points: points(&[[0., 0., 0.], [1., 0., 0.], [1., 1., 0.], [0., 1., 0.]]), ..Mesh::default() };
    mesh.block_mut(CellKind::Triangle).nodes.extend([0, 1, 2, 0, 2, 3]);
    mesh.blocks[0].sets.insert("half".into(), vec![1]);
    let surface = boundary(&mesh);
    assert_eq!(parse(r#"{ set = "half" }"#).faces(&mesh, &surface).unwrap(), [1]);
    assert_eq!(parse(r#""boundary""#).nodes(&mesh, &surface).unwrap().len(), 4);
}

#[test]
fn errors_say_what_to_try() {
    for (form, words) in [
        (r#"{ set = "botom" }"#, "; did you mean `bottom`? (the mesh has `bottom`, `first-cell`, `inner`"),
        ("{ ids = [27] }", "there is no node 27: the mesh has 27 nodes, counted from 0"),
        ("{ label = 3 }", "no cell has label 3: the mesh has 1 (liver), 2 (tumour)"),
        ("{ label = 'livr' }", "no label is named `livr`; did you mean `liver`? (the mesh has 1 (liver)"),
        ("{ label-boundary = [1, 'lung'] }", "no label is named `lung`"),
        ("{ box = [[0, 5, 0], [1, 1, 1]] }", "along y: it begins at 5 m and ends at 1 m"),
        ("{ plane = { point = [0, 0, 0], normal = [0, 0, 0] } }", "normal of the plane is zero"),
        ("{ sphere = { centre = [0, nan, 0], radius = 1 } }", "centre of the sphere must be finite, not NaN"),
        (
            "{ sphere = { centre = [0, 0, 0], radius = -1 } }",
            "radius of the sphere must be 0 or more, not -1",
        ),
        ("{ normal = { direction = [0, 0, 1], within = 200 } }", "from 0 to 180 degrees, not 200"),
        ("{ nearest = { point = [0, 0, 0], count = 0 } }", "1 or more, not 0"),
        ("{ difference = [\"all\"] }", "difference needs 2 or more selections, but has 1"),
        ("{ union = [] }", "union needs 1 or more selections, but has 0"),
    ] {
        let error = node_error(form);
        assert!(error.contains(words), "{form}: {error}");
    }
}

#[test]
fn empty_selections_say_how_far_off_they_are() {
    let whole = "the mesh lies between [0, 0, 0] and [2, 2, 2] m";
    for (form, words) in [
        (
            "{ box = [[2.5, 0, 0], [3, 2, 2]] }",
            "selects no nodes: the closest, node 2 at [2, 0, 0], is 0.5 m away",
        ),
        ("{ sphere = { centre = [0.5, 0.5, 0.5], radius = 0.1 } }", "is 0.766025 m away"),
        ("{ plane = { point = [0, 0, 0.25], normal = [0, 0, 2] } }", "is 0.25 m away"),
        ("{ half-space = { point = [0, 0, 7], normal = [0, 0, 1] } }", "is 5 m away"),
        ("{ normal = { direction = [1, 1, 0], within = 10 } }", "of a boundary face is 45° away"),
        ("{ ids = [] }", "the list is empty"),
        ("{ intersection = [{ ids = [1] }, { ids = [2, 3] }] }", "list of 2 ids selects 2; "),
    ] {
        let error = node_error(form);
        assert!(error.contains(words) && error.contains(whole), "{form}: {error}");
    }
    let mesh = block();
    let surface = boundary(&mesh);
    let error = parse("{ ids = [0, 1] }").faces(&mesh, &surface).unwrap_err().to_string();
    assert!(error.contains("it has 2 nodes, but no boundary face lies completely within them"), "{error}");
    let error = parse(r#"{ set = "inner" }"#).faces(&mesh, &surface).unwrap_err().to_string();
    assert!(error.contains("no boundary face lies completely within"), "{error}");
    let error = Selection::All.nodes(&Mesh::default(), &Surface::default()).unwrap_err().to_string();
    assert!(error.contains("the mesh has no points"), "{error}");
}

#[test]
fn broken_sets_are_errors() {
    let mut mesh = block();
    mesh.blocks[0].sets.insert("broken".into(), vec![8]);
    mesh.point_sets.insert("gone".into(), vec![99]);
    let surface = boundary(&mesh);
    for (name, words) in [("broken", "it contains hex 8, but there are 8"), ("gone", "it contains node 99")] {
        let selection = Selection::Set(name.into());
        assert!(selection.nodes(&mesh, &surface).unwrap_err().to_string().contains(words));
        assert!(selection.faces(&mesh, &surface).is_err());
    }
}

#[test]
fn misspelt_forms_are_refused() {
    for form in [
        r#""everything""#,
        "{ sphere = { center = [0, 0, 0], radius = 1 } }",
        "{ plane = { point = [0, 0, 0], normal = [0, 0, 1], tol = 1 } }",
        "{ box = [[0, 0], [1, 1, 1]] }",
        "{ ids = [-1] }",
    ] {
        assert!(read(form).is_err(), "{form}");
    }
}

#[test]
fn schema_describes_every_form() {
    let schema = serde_json::to_value(schemars::schema_for!(Selection)).unwrap();
    let text = schema.to_string();
    for word in ["half-space", "label-boundary", "\"boundary\"", "Greatest angle", "\"difference\""] {
        assert!(text.contains(word), "{word} not in {text}");
    }
    let forms = schema["oneOf"].as_array().unwrap();
    assert!(forms.iter().all(|form| form["description"].is_string() || form["enum"].is_array()));
}
