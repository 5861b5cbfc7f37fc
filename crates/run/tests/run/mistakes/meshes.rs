//! Meshes that are wrong.

use pliant_testing::scenes::{CORNERS, FROM_FILE, TETS, Workshop, changed, labels, vtk};

use super::{MESH_LINE, assert_invalid, assert_refused, bad_mesh, repaired, with_mesh};

#[test]
pub(super) fn unreadable_and_truncated_meshes_tell_the_line() {
    let whole = vtk(&CORNERS, &TETS, "");
    bad_mesh("", &["cannot read `case/organ.vtk`, line 1"]);
    bad_mesh("hello world\n", &["line 1", "`hello world`", "# vtk DataFile"]);
    bad_mesh(&whole[..whole.len() / 2], &["truncated", "export it again"]);
    bad_mesh(whole.replace("3 7\n", "3 99\n"), &["uses node 99", "export it again"]);
    bad_mesh(whole.replace("0.1 0 0\n", "0.1 zero 0\n"), &["`zero` is not"]);
    let scene = FROM_FILE.replace("organ.vtk", "organ.docx");
    let workshop = Workshop::new(&scene);
    workshop.write("case/organ.docx", "PK");
    let line = MESH_LINE.replace("organ.vtk", "organ.docx");
    assert_refused(&workshop, &[&line], &["not in a supported mesh format", "Gmsh (.msh)"]);
}

#[test]
pub(super) fn an_organ_a_thousand_times_too_large_is_refused_and_one_too_small_doubted() {
    let large = CORNERS.map(|point| point.map(|x| 1000.0 * x));
    let says = ["the mesh measures 173.2 m across", "`scale = 0.001` brings millimetres to metres"];
    assert_refused(&with_mesh(vtk(&large, &TETS, ""), FROM_FILE), &[MESH_LINE], &says);
    let scene = changed(FROM_FILE, "\"organ.vtk\"", "\"organ.vtk\", scale = 0.001");
    let output = with_mesh(vtk(&CORNERS, &TETS, ""), &scene).check(&[]);
    assert_eq!(output.status(), "checked");
    assert!(output.words().contains("`organ` measures 1.732e-4 m across"), "{}", output.err);
}

#[test]
pub(super) fn inverted_elements_are_listed_and_reordered_on_request() {
    let mut tets = TETS;
    (tets[0], tets[4]) = (&[0, 3, 1, 7], &[0, 5, 4, 7]);
    let mesh = vtk(&CORNERS, &tets, "");
    bad_mesh(&mesh, &["inverted elements at rest: tet 0, tet 4 (counted from 0)", "add `fix = \"reorder\"`"]);
    repaired(&mesh, "reorder", "2 inverted elements reordered");
    let hex: &[u32] = &[4, 5, 7, 6, 0, 1, 3, 2];
    bad_mesh(vtk(&CORNERS, &[hex], ""), &["inverted elements at rest: hex 0", "fix = \"reorder\""]);
    repaired(&vtk(&CORNERS, &[hex], ""), "reorder", "1 inverted element reordered");
    // A bow tie stays one in any order of its layers.
    let twisted: &[u32] = &[0, 1, 2, 3, 4, 5, 7, 6];
    let scene = changed(FROM_FILE, "\"organ.vtk\"", "\"organ.vtk\", fix = \"reorder\"");
    let output = with_mesh(vtk(&CORNERS, &[twisted], ""), &scene).run(&[]);
    assert_invalid(&output, &["inverted elements at rest: hex 0", "does not help: remesh"]);
}

#[test]
pub(super) fn degenerate_elements_are_listed() {
    let flat: &[u32] = &[0, 1, 2, 3];
    let cells: Vec<&[u32]> = TETS.into_iter().chain([flat]).collect();
    bad_mesh(
        vtk(&CORNERS, &cells, ""),
        &["elements without volume at rest: tet 6 (counted from 0)", "remesh"],
    );
    let cells: Vec<&[u32]> = TETS.into_iter().chain([TETS[1]]).collect();
    bad_mesh(
        vtk(&CORNERS, &cells, ""),
        &["elements that repeat another: tet 6", "faces of more than two elements"],
    );
}

#[test]
pub(super) fn unused_nodes_are_listed_and_dropped_on_request() {
    let points: Vec<[f64; 3]> = CORNERS.into_iter().chain([[0.2, 0.0, 0.0]]).collect();
    let mesh = vtk(&points, &TETS, "");
    bad_mesh(&mesh, &["nodes that no element uses: 8 (counted from 0)", "add `fix = \"drop-unused\"`"]);
    repaired(&mesh, "drop-unused", "1 unused node dropped");
    // A node that only a triangle uses has no mass either.
    let triangle: &[u32] = &[5, 7, 8];
    let cells: Vec<&[u32]> = TETS.into_iter().chain([triangle]).collect();
    let mesh = vtk(&points, &cells, "");
    bad_mesh(&mesh, &["nodes that no element uses: 8"]);
    repaired(&mesh, "drop-unused", "1 unused node dropped");
}

#[test]
pub(super) fn duplicate_nodes_are_listed_and_merged_on_request() {
    let points: Vec<[f64; 3]> = CORNERS.into_iter().chain([CORNERS[7]]).collect();
    let mut tets = TETS;
    tets[5] = &[0, 5, 1, 8];
    let mesh = vtk(&points, &tets, "");
    bad_mesh(&mesh, &["nodes at the same place: 7 and 8 (counted from 0)", "add `fix = \"merge\"`"]);
    repaired(&mesh, "merge", "1 duplicate node merged");
}

#[test]
pub(super) fn several_repairs_go_in_order() {
    let points: Vec<[f64; 3]> = CORNERS.into_iter().chain([CORNERS[7], [0.3, 0.0, 0.0]]).collect();
    let mut tets = TETS;
    (tets[0], tets[5]) = (&[0, 3, 1, 7], &[0, 5, 1, 8]);
    let fixes = "\"organ.vtk\", fix = [\"merge\", \"reorder\", \"drop-unused\"]";
    let output = with_mesh(vtk(&points, &tets, ""), &changed(FROM_FILE, "\"organ.vtk\"", fixes)).run(&[]);
    assert_eq!(output.done()["nodes"], 8);
}

#[test]
pub(super) fn a_body_without_elements_is_refused() {
    let triangles: [&[u32]; 2] = [&[0, 1, 3], &[0, 3, 2]];
    bad_mesh(vtk(&CORNERS, &triangles, ""), &["`organ` has no volume elements", "needs tets or hexes"]);
    bad_mesh(vtk(&CORNERS, &[], ""), &["points but no cells", "export the elements too"]);
    let scene = changed(FROM_FILE, "density", "element = \"hex8\"\ndensity");
    let workshop = with_mesh(vtk(&CORNERS, &TETS, ""), &scene);
    assert_refused(&workshop, &["element = \"hex8\""], &["the mesh of `organ` has tets", "tets: `tet4`"]);
}

#[test]
pub(super) fn laws_by_label_must_fit_the_labels_of_the_mesh() {
    let mesh = |data: &str| vtk(&CORNERS, &TETS, data);
    let with_law = |law: &str| changed(FROM_FILE, "law = \"tissue\"", law);
    let two = labels(&[1, 1, 1, 2, 2, 2]);
    let law = "law = { 1 = \"tissue\" }";
    let missing = "labels without law: 2 (3 cells)";
    assert_refused(&with_mesh(mesh(&two), &with_law(law)), &[law], &[missing, "add `LABEL = \"law\"`"]);
    assert_refused(
        &with_mesh(mesh(""), &with_law(law)),
        &[law],
        &["the tet cells of `organ` have no labels"],
    );
    let law = "law = { 1 = \"tissue\", 2 = \"tissue\", 3 = \"tissue\" }";
    let none = "no cell of `organ` has label `3`";
    assert_refused(&with_mesh(mesh(&two), &with_law(law)), &[law], &[none, "labels of the mesh: 1, 2"]);
    let law = "law = { 1 = \"tissue\", 2 = \"tisue\" }";
    let unknown = ["there is no law `tisue`", "did you mean `tissue`?"];
    assert_refused(&with_mesh(mesh(&two), &with_law(law)), &[law], &unknown);
}

#[test]
pub(super) fn densities_by_label_must_fit_the_mesh_and_be_positive() {
    let mesh = vtk(&CORNERS, &TETS, &labels(&[1, 1, 1, 2, 2, 2]));
    for (key, says) in [
        ("density = { 1 = 900 }", "labels without density: 2 (3 cells)"),
        ("density = { 1 = 900, 2 = 900, 3 = 900 }", "no cell of `organ` has label `3`"),
        ("density = { 1 = 900, 2 = 0 }", "must be greater than 0, found 0"),
        ("density = 1000\nhourglass = { 1 = 0.1 }", "labels without hourglass: 2 (3 cells)"),
        ("density = 1000\nhourglass = { 1 = 0.1, 2 = 11 }", "found 11"),
    ] {
        let scene = changed(FROM_FILE, "density = 1000", key);
        assert_refused(&with_mesh(&mesh, &scene), &[key.lines().last().unwrap()], &[says]);
    }
}
