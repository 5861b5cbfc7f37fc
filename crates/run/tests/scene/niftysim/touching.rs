//! Contact and membranes of NiftySim.

use super::{Folder, SYSTEM, assert_lines, assert_note, build, import_text, imported, read, submodel, with};

/// Each kind of contact, and a membrane, for the two tetrahedra.
pub(super) fn contact() -> String {
    let slaves = "<SlvNodes NumNodes=\"3\">0 1 3</SlvNodes>";
    let round = |tag: &str| {
        format!(
            "<{tag}><Origin>0.3 -1 0.3</Origin><Axis>1 0 0</Axis><Radius>0.1</Radius><Length>1</Length>\
             <OrigDisp>0 0.1 0</OrigDisp><RadChange>0</RadChange>{slaves}</{tag}>\n"
        )
    };
    format!(
        "<ContactPlate><a>-1 -0.5 -1</a><b>-1 -0.5 2</b><c>2 -0.5 -1</c><Disp>0 0.1 0</Disp>{slaves}</ContactPlate>\n{}{}\
         <ContactSurface><Nodes DOF=\"3\" NumNodes=\"4\">-1 -1 -2  2 -1 -2  2 2 -2  -1 2 -2</Nodes>\n\
         <Elements NumEls=\"2\" Type=\"T3\">0 1 2  0 2 3</Elements><FrictionCoefficient>0.2</FrictionCoefficient>\
         <SlaveNodes NumNodes=\"4\">0 1 2 4</SlaveNodes><Motion Type=\"Rotation\">0.1 0.2 0  0 0 -2</Motion>\
         <Motion Type=\"Translation\">0 0 -0.1</Motion></ContactSurface>\n\
         <ShellElements Type=\"T3\" NumEls=\"1\">0 1 3</ShellElements><ShellElementSet Size=\"1\">\
         <Material Type=\"NeoHookean\">500<Density>10</Density><Thickness>0.05</Thickness></Material>0</ShellElementSet>\n",
        round("ContactCylinder"),
        round("ContactUSProbe")
    )
}

/// Contact and membranes as tables, each with NiftySim's numbers.
#[test]
pub(super) fn contact_and_membranes_become_tables() {
    let of_bodies = "<DoSelfCollision>1</DoSelfCollision><DeformableFrictionCoefficient>0.3</DeformableFrictionCoefficient>\
                     <ContactSafetyMargin>0.001</ContactSafetyMargin></SystemParams>";
    let imported = imported(&with(&contact()).replace("</SystemParams>", of_bodies));
    println!("{}", imported.scene);
    assert!(imported.missing.is_empty(), "{:?}", imported.missing);
    assert_lines(
        &imported,
        &["[tool.plate-0]", "shape = { box = { size = [3.0, 3.0, 3.0] } }", "at = [0.5, -2.0, 0.5]"],
    );
    assert_lines(&imported, &["by = [0.0, 0.1, 0.0]", "curve = \"polynomial-10-15-6\"", "to = 0.1"]);
    let cylinder = [
        "[tool.cylinder-0]",
        "shape = { cylinder = { radius = 0.1, length = 1.0 } }",
        "at = [0.8, -1.0, 0.3]",
    ];
    assert_lines(&imported, &cylinder);
    assert_lines(&imported, &["[tool.probe-0]", "shape = { capsule = { radius = 0.1, length = 1.0 } }"]);
    assert_lines(&imported, &["poses = \"model-surface-0.csv\""]);
    let touch =
        ["[contact.cylinder-0]", "between = [\"model\", \"cylinder-0\"]", "faces = { set = \"cylinder-0\" }"];
    assert_lines(&imported, &touch);
    let sheet = ["faces = { set = \"surface-0\" }", "friction = 0.2", "thickness = 0.001"];
    assert_lines(&imported, &sheet);
    let itself =
        ["[contact.model-itself]", "between = [\"model\", \"model\"]", "friction = 0.3", "thickness = 0.001"];
    assert_lines(&imported, &itself);
    assert_lines(&imported, &["type = \"neo-hookean\"", "young-modulus = 1500.0", "poisson-ratio = 0.5"]);
    assert_lines(
        &imported,
        &["faces = { set = \"membrane-0\" }", "law = \"membrane-0\"", "density = 10.0", "thickness = 0.05"],
    );
    assert_eq!(imported.tables[0].1.lines().count(), 1003);
    let folder = Folder::new();
    for (file, text) in &imported.tables {
        folder.write(file, text);
    }
    let scene = read(&imported, &folder);
    let built = pliant_scene::build(&scene).unwrap_or_else(|error| panic!("{error}\n{}", imported.scene));
    let contacts = built.contacts.unwrap();
    assert_eq!((contacts.rigids.len(), contacts.contacts.len()), (4, 5));
    assert_eq!(contacts.contacts[0].surface.nodes, [0, 1, 3]);
}

/// The nodes that touch are counted through all submodels; a thing with none of a body does not touch it.
#[test]
pub(super) fn contact_counts_the_nodes_of_all_submodels() {
    let plate = |nodes: &str| {
        format!(
            "<ContactPlate><a>-9 -9 -1</a><b>9 -9 -1</b><c>-9 9 -1</c>\
             <SlvNodes NumNodes=\"3\">{nodes}</SlvNodes></ContactPlate>"
        )
    };
    let model = |nodes: &str| {
        format!("<Model>{}{}{}{SYSTEM}</Model>", submodel(0.0, ""), submodel(5.0, ""), plate(nodes))
    };
    let second = imported(&model("4 5 6"));
    assert_lines(&second, &["[contact.plate-0-part-1]", "between = [\"part-1\", \"plate-0\"]"]);
    assert_lines(&second, &["[obstacle.plate-0]"]);
    assert_eq!(second.scene.matches("[contact.").count(), 1);
    let (_, built) = build(&second);
    assert_eq!(built.contacts.unwrap().contacts[0].surface.nodes, [4, 5, 6]);
    let none = imported(&model("4 5 6").replace("NumNodes=\"3\">4 5 6", "NumNodes=\"0\">"));
    assert_note(&none, "`plate-0`: none of its listed nodes is on a boundary");
    let both = imported(&model("4 5 6").replace("NumNodes=\"3\">4 5 6", "NumNodes=\"all\">"));
    assert_eq!(both.scene.matches("[contact.").count(), 2);
}

/// Each replacement in a good model with contact by a bad one, and the words of the error.
#[test]
pub(super) fn mistakes_of_contact_and_membranes_are_named() {
    let good = with(&contact());
    let errors: &[(&str, &str, &[&str])] = &[
        ("<b>-1 -0.5 2</b>", "", &["line 6, <ContactPlate>", "<b> is missing", "add <b>"]),
        ("<b>-1 -0.5 2</b>", "<b>-1 -0.5 -1</b>", &["the edge from a to b is 0", "longer than 0"]),
        (
            "<a>-1 -0.5 -1</a>",
            "<a>1e200 -0.5 -1</a>",
            &["line 6, <ContactPlate>", "longer than 0 and finite"],
        ),
        ("<Axis>1 0 0", "<Axis>1e200 1e200 0", &["<ContactCylinder>", "the length of the axis is inf"]),
        (
            "<Origin>0.3 -1 0.3</Origin><Axis>1 0 0</Axis><Radius>0.1</Radius><Length>1<",
            "<Origin>1.7e308 -1 0.3</Origin><Axis>1 0 0</Axis><Radius>0.1</Radius><Length>1.7e308<",
            &["a coordinate of its frame is inf"],
        ),
        ("<c>2 -0.5 -1</c>", "<c>2 -0.5</c>", &["<c>", "found 2 coordinates, expected 3"]),
        ("<SlvNodes NumNodes=\"3\">0 1 3</SlvNodes></ContactP", "</ContactP", &["<SlvNodes> is missing"]),
        ("<SlvNodes NumNodes=\"3\">0 1 3", "<SlvNodes NumNodes=\"3\">0 1 5", &["no node 5"]),
        ("<Axis>1 0 0", "<Axis>0 0 0", &["the length of the axis is 0"]),
        ("<Radius>0.1", "<Radius>-0.1", &["the radius is -0.1"]),
        ("NumEls=\"2\" Type=\"T3\"", "NumEls=\"2\" Type=\"T6\"", &["`T6` is not a known type of surface"]),
        ("<RadChange>0<", "<RadChange>-0.1<", &["the change of the radius is -0.1", "minus the radius"]),
        ("<FrictionCoefficient>0.2", "<FrictionCoefficient>-1", &["friction is -1", "at least 0"]),
        (
            "Type=\"Rotation\">0.1 0.2 0  0 0 -2",
            "Type=\"Rotation\">0 0 0  0 0 -2",
            &["angles are all 0", "angles first"],
        ),
        ("Type=\"Rotation\"", "Type=\"Spin\"", &["`Spin` is not a known type of motion"]),
        ("<Thickness>0.05</Thickness>", "", &["<Thickness> is missing"]),
        ("\"NeoHookean\">500", "\"NeoHookean\">500 1", &["found 2 parameters, expected 1: mu"]),
        ("\"NeoHookean\">500", "\"Linear\">500 0.5", &["nu is 0.5", "less than 0.5"]),
        ("NumEls=\"1\">0 1 3", "NumEls=\"1\">0 1", &["found 2 node indices"]),
    ];
    for (from, to, expected) in errors {
        assert!(good.contains(from), "{from}");
        let error = import_text(&good.replacen(from, to, 1)).map(|i| i.scene).unwrap_err().to_string();
        println!("{error}");
        for part in *expected {
            assert!(error.contains(part), "no `{part}` in: {error}");
        }
    }
    let left_out: &[(&str, &str, &str)] = &[
        ("<c>2 -0.5 -1</c>", "<c>2 -0.5 0</c>", "its edges meet at 71.57°, but plates are rectangles"),
        (
            "<RadChange>0<",
            "<RadChange>-0.05<",
            "its radius changes by -0.05, and cylinders of a scene only grow",
        ),
        ("<RadChange>0<", "<RadChange>0.05<", ""),
        ("0 1 2  0 2 3<", "0 1 2  2 3 0<", ""),
        (
            "0 1 2  0 2 3<",
            "0 1 2  0 3 2<",
            "1 of its edges lie between triangles that turn to different sides",
        ),
        (
            "<SlvNodes NumNodes=\"3\">0 1 3",
            "<SlvNodes NumNodes=\"2\">0 3",
            "no face has all its nodes among the 2",
        ),
        ("NumEls=\"1\">0 1 3", "NumEls=\"1\">0 1 2", "not on the boundary"),
        ("\"NeoHookean\">500", "\"LinearThickShell\">500 1", "LinearThickShell bends"),
    ];
    for (from, to, expected) in left_out {
        assert!(good.contains(from), "{from}");
        let missing = imported(&good.replacen(from, to, 1)).missing.join("; ");
        println!("{missing}");
        assert!(
            missing.contains(expected) && missing.is_empty() == expected.is_empty(),
            "no `{expected}` in: {missing}"
        );
    }
    let one_piece = with("")
        .replace("</SystemParams>", "<DoDeformableCollision>1</DoDeformableCollision></SystemParams>");
    assert_note(&imported(&one_piece), "the model is one piece");
}
