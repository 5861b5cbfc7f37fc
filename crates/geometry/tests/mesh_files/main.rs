//! Mesh files in and out: files of other programs (see `data/README.md`), our own round trips, and broken
//! files. Broken files must give errors and never a panic.

mod broken;
mod written;

use std::collections::BTreeMap;
use std::fs;
use std::path::{Path, PathBuf};

use pliant_geometry::io::{Format, MeshFile, VtuOptions, read, read_bytes, write_vtu};
use pliant_geometry::{CellBlock, CellKind, DataArray, Mesh, Vector3};

fn data() -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/data")
}

fn read_data(name: &str) -> MeshFile {
    read(&data().join(name)).unwrap_or_else(|error| panic!("{error}"))
}

/// A separate folder for a test, under Cargo's folder for tests.
fn scratch(test: &str) -> PathBuf {
    let folder = Path::new(env!("CARGO_TARGET_TMPDIR")).join(test);
    fs::create_dir_all(&folder).unwrap();
    folder
}

fn points(coordinates: &[[f64; 3]]) -> Vec<Vector3> {
    coordinates.iter().map(|&[x, y, z]| Vector3::new(x, y, z)).collect()
}

/// The mixed mesh of `data/generate.py`, written here a second time by hand.
fn mixed() -> Mesh {
    let mut mesh = Mesh {
        points: points(&[
            [0.0, 0.0, 0.0],
            [1.0, 0.0, 0.0],
            [1.0, 1.0, 0.0],
            [0.0, 1.0, 0.0],
            [0.0, 0.0, 1.0],
            [1.0, 0.0, 1.0],
            [1.0, 1.0, 1.0],
            [0.0, 1.0, 1.0],
            [0.5, 0.25, 2.125],
        ]),
        blocks: vec![
            CellBlock::new(CellKind::Hex, vec![0, 1, 2, 3, 4, 5, 6, 7]),
            CellBlock::new(CellKind::Tet, vec![4, 5, 6, 8, 4, 6, 7, 8]),
            CellBlock::new(CellKind::Triangle, vec![4, 5, 8, 5, 6, 8]),
            CellBlock::new(CellKind::Quad, vec![0, 3, 2, 1]),
            CellBlock::new(CellKind::Line, vec![0, 1, 1, 2]),
            CellBlock::new(CellKind::Vertex, vec![8]),
        ],
        ..Mesh::default()
    };
    let velocity = mesh.points.iter().flat_map(|x| [2.0 * x.x + 1.0, 2.0 * x.y + 1.0, 2.0 * x.z + 1.0]);
    mesh.point_data = BTreeMap::from([
        ("temperature".to_owned(), DataArray::scalar((0..9).map(|i| 0.5 * f64::from(i)).collect())),
        ("velocity".to_owned(), DataArray { components: 3, values: velocity.collect() }),
        ("number".to_owned(), DataArray::scalar((0..9).map(|i| 1000.0 * f64::from(i)).collect())),
    ]);
    let mut label = 10.0;
    let mut stress = 0.0;
    for block in &mut mesh.blocks {
        let labels = (0..block.len()).map(|i| label + i as f64).collect();
        let stresses = (0..9 * block.len()).map(|i| stress + 0.125 * i as f64).collect();
        label += block.len() as f64;
        stress += 9.0 * 0.125 * block.len() as f64;
        block.data.insert("label".to_owned(), DataArray::scalar(labels));
        block.data.insert("stress".to_owned(), DataArray { components: 9, values: stresses });
    }
    mesh
}

/// The mixed mesh with sets of points and cells.
fn with_sets() -> Mesh {
    let mut mesh = mixed();
    mesh.point_sets.insert("top & tip".to_owned(), vec![4, 5, 8]);
    mesh.point_sets.insert("fixed".to_owned(), vec![0, 1]);
    mesh.block_mut(CellKind::Tet).sets.insert("tumour \"2\"".to_owned(), vec![1]);
    mesh.block_mut(CellKind::Tet).sets.insert("all".to_owned(), vec![0, 1]);
    mesh.block_mut(CellKind::Hex).sets.insert("all".to_owned(), vec![0]);
    mesh.block_mut(CellKind::Triangle).sets.insert("wall".to_owned(), vec![0]);
    mesh
}

// --- files of other programs
// --------------------------------------------------------------------------------

#[test]
fn names_of_labels_and_bodies_come_back_from_vtu_files() {
    let mut mesh = mixed();
    let names = [(10, "liver"), (11, "left kidney"), (-3, "Größe & <b>")];
    mesh.label_names = names.iter().map(|&(label, name)| (label, name.to_owned())).collect();
    mesh.body_names = [(0, "liver".to_owned()), (1, "a grasper".to_owned())].into();
    for options in
        [VtuOptions::default(), VtuOptions { compress: true, time: Some(0.5), ..VtuOptions::default() }]
    {
        let mut bytes = Vec::new();
        write_vtu(&mut bytes, &mesh, &options).unwrap();
        let back = read_bytes(&bytes, Format::Vtu).unwrap();
        assert_eq!(back.mesh.body_names, mesh.body_names);
        assert_eq!((&back.mesh.label_names, back.time), (&mesh.label_names, options.time));
        let text = String::from_utf8(bytes).unwrap();
        // meshio 5.3.5 rejects files with texts; earlier versions wrote them.
        assert!(!text.contains("String"));
        let earlier = ["label-names", "body-names"].into_iter().fold(text.clone(), |text, names| {
            text.replace(&format!("\"UInt8\" Name=\"{names}"), &format!("\"String\" Name=\"{names}"))
        });
        let earlier = read_bytes(earlier.as_bytes(), Format::Vtu).unwrap().mesh;
        assert_eq!((&earlier.label_names, &earlier.body_names), (&mesh.label_names, &mesh.body_names));
        // Texts without a name are ignored; invalid codes are rejected.
        let odd = text.replace("\"ascii\">45 51 32", "\"ascii\">32 300 0 7 0 45 51 32");
        assert_eq!(read_bytes(odd.as_bytes(), Format::Vtu).unwrap().mesh.label_names.len(), 3);
        let broken = text.replace("\"ascii\">45 51 32", "\"ascii\">45 x 32");
        assert!(read_bytes(broken.as_bytes(), Format::Vtu).is_err());
    }
}

#[test]
fn vtu_of_vtk_in_every_storage() {
    for name in [
        "ascii.vtu",
        "inline.vtu",
        "inline-64-big.vtu",
        "inline-zlib.vtu",
        "appended-raw.vtu",
        "appended-raw-zlib.vtu",
        "appended-raw-32-big.vtu",
        "appended-base64.vtu",
        "appended-base64-zlib-big.vtu",
    ] {
        let file = read_data(name);
        assert_eq!(file.mesh, mixed(), "{name}");
        assert_eq!(file.time, Some(0.25), "{name}");
        assert!(file.format.starts_with("VTU"), "{name}");
        assert!(file.notes.is_empty(), "{name}: {:?}", file.notes);
    }
}

#[test]
fn legacy_vtk_of_vtk() {
    for (name, format) in [
        ("v42.vtk", "legacy VTK 4.2 ASCII"),
        ("v42-binary.vtk", "legacy VTK 4.2 binary"),
        ("v51.vtk", "legacy VTK 5.1 ASCII"),
        ("v51-binary.vtk", "legacy VTK 5.1 binary"),
    ] {
        let file = read_data(name);
        assert_eq!(file.mesh, mixed(), "{name}");
        assert_eq!(file.time, Some(0.25), "{name}");
        assert_eq!(file.format, format);
        assert!(file.notes.is_empty(), "{name}: {:?}", file.notes);
    }
}

#[test]
fn vtk_files_of_meshio() {
    for name in ["meshio.vtu", "meshio-zlib.vtu", "meshio-v42.vtk", "meshio-v51.vtk"] {
        assert_eq!(read_data(name).mesh, mixed(), "{name}");
    }
}

#[test]
fn poly_data_is_split_into_cells() {
    for name in ["poly-v42.vtk", "poly-v51-binary.vtk", "poly.vtp"] {
        let mesh = read_data(name).mesh;
        let nodes = |kind| mesh.block(kind).unwrap().nodes.as_slice();
        let ids = |kind| mesh.block(kind).unwrap().data["id"].values.as_slice();
        assert_eq!(nodes(CellKind::Vertex), [8]);
        assert_eq!(nodes(CellKind::Line), [0, 1, 1, 4]);
        assert_eq!(nodes(CellKind::Quad), [1, 4, 5, 2]);
        // The triangle, the pentagon as a fan, the strip with its second triangle turned round.
        assert_eq!(
            nodes(CellKind::Triangle),
            [0, 1, 2, 3, 2, 7, 3, 7, 8, 3, 8, 6, 3, 2, 6, 6, 2, 7],
            "{name}"
        );
        assert_eq!(ids(CellKind::Vertex), [0.0]);
        assert_eq!(ids(CellKind::Line), [1.0, 1.0]);
        assert_eq!(ids(CellKind::Triangle), [2.0, 4.0, 4.0, 4.0, 5.0, 5.0]);
        assert_eq!(ids(CellKind::Quad), [3.0]);
        let colour = &mesh.point_data["colour of point"];
        assert_eq!((colour.components, colour.item(8)), (3, [24.0, 25.0, 26.0].as_slice()));
    }
}

fn tet_volume(mesh: &Mesh) -> f64 {
    let tets = mesh.block(CellKind::Tet).unwrap();
    tets.cells()
        .map(|cell| {
            let [a, b, c, d] = [0, 1, 2, 3].map(|i| mesh.points[cell[i] as usize]);
            (b - a).cross(&(c - a)).dot(&(d - a)) / 6.0
        })
        .sum()
}

#[test]
fn gmsh_groups_labels_and_data() {
    for (name, format) in [
        ("gmsh22.msh", "Gmsh 2.2 ASCII"),
        ("gmsh22-binary.msh", "Gmsh 2.2 binary"),
        ("gmsh41.msh", "Gmsh 4.1 ASCII"),
        ("gmsh41-binary.msh", "Gmsh 4.1 binary"),
    ] {
        let file = read_data(name);
        let mesh = &file.mesh;
        assert_eq!(file.format, format);
        assert_eq!(file.time, Some(0.5));
        assert_eq!(mesh.points.len(), 23, "{name}");
        // Two unit cubes; every tet the right way round.
        assert!((tet_volume(mesh) - 2.0).abs() < 1e-14, "{name}");
        let tets = mesh.block(CellKind::Tet).unwrap();
        assert_eq!(tets.len(), 48);
        assert_eq!(tets.sets["all"], (0..48).collect::<Vec<u32>>());
        // Sets and labels separate the cubes as their positions do.
        for (i, cell) in tets.cells().enumerate() {
            let is_left = cell.iter().all(|&node| mesh.points[node as usize].x <= 1.0);
            let set = if is_left { "left lobe" } else { "right lobe" };
            assert!(tets.sets[set].contains(&(i as u32)));
            assert_eq!(tets.data["label"].values[i], if is_left { 5.0 } else { 6.0 });
        }
        assert_eq!(tets.sets["left lobe"].len() + tets.sets["right lobe"].len(), 48);
        let triangles = mesh.block(CellKind::Triangle).unwrap();
        assert_eq!(triangles.sets["wall"], [0, 1, 2, 3]);
        assert_eq!(triangles.data["label"].values, [8.0; 4]);
        assert!(!triangles.data.contains_key("flow"));
        assert_eq!(mesh.point_sets["pins"], [0, 1]);
        assert_eq!(mesh.block(CellKind::Vertex).unwrap().nodes, [0, 1]);
        let speed = &mesh.point_data["speed"];
        for (x, speed) in mesh.points.iter().zip(&speed.values) {
            assert!((x.x + 10.0 * x.y - speed).abs() < 1e-12);
        }
        // The data of each tet is its number in Gmsh, three times: one number each, increasing.
        let flow = &tets.data["flow"];
        assert_eq!((flow.components, flow.len()), (3, 48));
        assert!(flow.values.chunks(3).all(|v| v[0] == v[1] && v[1] == v[2]));
        assert!(flow.values.chunks(3).is_sorted_by(|a, b| a[0] < b[0]));
    }
    // Versions 2.2 and 4.1, text and binary, hold the same mesh.
    let expected = read_data("gmsh41.msh").mesh;
    assert_eq!(read_data("gmsh41-binary.msh").mesh, expected);
    assert_eq!(read_data("gmsh22-binary.msh").mesh, read_data("gmsh22.msh").mesh);
    assert_eq!(read_data("gmsh22.msh").mesh.points, expected.points);
}

#[test]
fn gmsh_1_has_labels_but_no_names() {
    let file = read_data("gmsh1.msh");
    assert_eq!(file.format, "Gmsh 1 ASCII");
    let tets = file.mesh.block(CellKind::Tet).unwrap();
    assert_eq!(tets.len(), 48);
    assert!((tet_volume(&file.mesh) - 2.0).abs() < 1e-14);
    let of_five = tets.data["label"].values.iter().filter(|&&label| label == 5.0).count();
    assert_eq!(of_five, 24);
    assert!(tets.sets.is_empty());
    assert!(file.notes.iter().any(|note| note.contains("48 cells are listed once per physical group")));
}

#[test]
fn partitioned_gmsh_keeps_its_group() {
    for name in ["partitioned.msh", "partitioned-binary.msh"] {
        let mesh = read_data(name).mesh;
        let hexes = mesh.block(CellKind::Hex).unwrap();
        assert_eq!(hexes.len(), 2, "{name}");
        assert_eq!(hexes.sets["bar"], [0, 1]);
        assert_eq!(hexes.data["label"].values, [3.0, 3.0]);
        assert_eq!(mesh.points.len(), 12);
    }
}

#[test]
fn freesurfer_tells_its_shift_and_is_found_by_its_first_bytes() {
    let pial = read_data("nibabel.pial");
    assert_eq!(pial.format, "FreeSurfer binary");
    assert!(pial.notes[0].contains("(1.5, -2, 3) mm (c_ras)"), "{:?}", pial.notes);
    let folder = tempfile::tempdir().unwrap();
    let of = |name: &str| fs::read(data().join(name)).unwrap();
    for (name, bytes) in [
        ("lh.anything", of("nibabel.pial")),
        ("rh.graymid.asc", of("tetrahedron-text.pial")),
        ("surface.xml", of("nibabel-gzip.gii")),
    ] {
        let path = folder.path().join(name);
        fs::write(&path, bytes).unwrap();
        assert!(Format::of_path(&path).is_none() && Format::of_file(&path).is_some(), "{name}");
        assert_eq!(read(&path).unwrap().mesh.points.len(), 4, "{name}");
    }
    assert_eq!(Format::of_path(Path::new("lh.white")), Some(Format::FreeSurfer));
}

#[test]
fn gifti_says_what_it_leaves_out() {
    let text = fs::read_to_string(data().join("nibabel-ascii.gii")).unwrap();
    let changed = |from: &str, to: &str| {
        assert!(text.contains(from), "{from}");
        read_bytes(text.replacen(from, to, 1).as_bytes(), Format::Gifti)
    };
    let moved =
        changed("0.000000   1.000000   0.000000   0.000000", "0.000000   1.000000   0.000000   7.000000")
            .unwrap();
    assert!(moved.notes[0].contains("was not applied"), "{:?}", moved.notes);
    for (from, to, says) in [
        ("Encoding=\"ASCII\"", "Encoding=\"ExternalFileBinary\"", "ExternalFileBinary"),
        ("NIFTI_TYPE_FLOAT32", "NIFTI_TYPE_RGB24", "not a type of points"),
        ("Dim1=\"3\"", "Dim1=\"2\"", "`Dim0` and `Dim1`"),
        ("Dim0=\"4\"", "Dim0=\"400000000\"", "far larger than the file"),
        ("SYSTEM \"http", "[<!ENTITY a \"b\">] \"http", "its own declarations"),
        ("<GIFTI", "<GOFTI", "XML is broken"),
        ("NIFTI_INTENT_TRIANGLE", "NIFTI_INTENT_SHAPE", "no cells"),
    ] {
        let message = changed(from, to).unwrap_err().to_string();
        assert!(message.contains(says), "{message}");
    }
}

#[test]
#[cfg(unix)]
fn pipes_and_devices_are_refused_and_not_waited_for() {
    let folder = tempfile::tempdir().unwrap();
    let pipe = folder.path().join("pipe.stl");
    assert!(std::process::Command::new("mkfifo").arg(&pipe).status().unwrap().success());
    let zero = folder.path().join("zero.vtu");
    std::os::unix::fs::symlink("/dev/zero", &zero).unwrap();
    for path in [&pipe, &zero] {
        let message = read(path).unwrap_err().to_string();
        assert!(message.contains("cannot open") && message.contains("not a regular file"), "{message}");
    }
    let huge = folder.path().join("huge.stl");
    // Without any block on the disk.
    fs::File::create(&huge).unwrap().set_len(1 << 40).unwrap();
    let message = read(&huge).unwrap_err().to_string();
    assert!(message.contains("1048576 MB, more than"), "{message}");
}

#[test]
fn surfaces_of_other_programs() {
    let expected = points(&[[0.0, 0.0, 0.0], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.5]]);
    let faces = [[0, 2, 1], [0, 1, 3], [1, 2, 3], [2, 0, 3]];
    for name in [
        "meshio.stl",
        "meshio-binary.stl",
        "vtk.stl",
        "vtk-binary.stl",
        "meshio.off",
        "meshio.obj",
        "vtk.obj",
        "vtk-big.ply",
        "nibabel-ascii.gii",
        "nibabel-base64.gii",
        "nibabel-gzip.gii",
        "nibabel.pial",
        "tetrahedron-text.pial",
    ] {
        let mesh = read_data(name).mesh;
        assert_eq!(mesh.points.len(), 4, "{name}");
        assert_eq!(mesh.blocks.len(), 1, "{name}");
        // STL numbers its points by their first use: compare the corners' positions.
        let block = &mesh.blocks[0];
        assert_eq!((block.kind, block.len()), (CellKind::Triangle, 4));
        for (cell, face) in block.cells().zip(faces) {
            for (&node, corner) in cell.iter().zip(face) {
                assert_eq!(mesh.points[node as usize], expected[corner], "{name}");
            }
        }
    }
    for name in ["meshio.ply", "meshio-binary.ply"] {
        let mesh = read_data(name).mesh;
        assert_eq!(mesh.points, mixed().points[..8]);
        assert_eq!(mesh.block(CellKind::Triangle).unwrap().nodes, [0, 2, 1]);
        assert_eq!(mesh.block(CellKind::Quad).unwrap().nodes, [4, 5, 6, 7, 0, 1, 5, 4]);
        assert_eq!(mesh.point_data["temperature"].values, [0.0, 0.5, 1.0, 1.5, 2.0, 2.5, 3.0, 3.5]);
    }
}

// --- variants written by hand
// -------------------------------------------------------------------------------

fn text(content: &str, format: Format) -> MeshFile {
    read_bytes(content.as_bytes(), format).unwrap_or_else(|error| panic!("{error}"))
}

#[test]
fn obj_groups_negative_indices_and_polygons() {
    let file = text(
        "# a comment\nmtllib x.mtl\no body\nv 0 0 0 1.0\nv 1 0 0\nv 1 1 0\nv 0 1 0\nv -1 0.5 0\nvn 0 0 1\nvt 0 0\n\
         g left  top\nusemtl skin\nf 1/1/1 2//1 \\\n 3/1\nf -5 -4 -3 -2 # quad\ng\nf 1 2 3 4 5\nl 1 2 3\np 5\nsp 1\n",
        Format::Obj,
    );
    let mesh = file.mesh;
    assert_eq!(mesh.block(CellKind::Triangle).unwrap().nodes, [0, 1, 2, 0, 1, 2, 0, 2, 3, 0, 3, 4]);
    assert_eq!(mesh.block(CellKind::Quad).unwrap().nodes, [0, 1, 2, 3]);
    assert_eq!(mesh.block(CellKind::Line).unwrap().nodes, [0, 1, 1, 2]);
    assert_eq!(mesh.block(CellKind::Vertex).unwrap().nodes, [4]);
    let triangles = &mesh.block(CellKind::Triangle).unwrap().sets;
    assert_eq!(triangles["left"], [0]);
    assert_eq!(triangles["top"], [0]);
    assert_eq!(triangles["skin"], [0, 1, 2, 3]);
    assert_eq!(triangles["body"], [0, 1, 2, 3]);
    assert_eq!(mesh.block(CellKind::Quad).unwrap().sets["left"], [0]);
    assert_eq!(file.notes.len(), 2, "{:?}", file.notes);
}

#[test]
fn off_with_comments_counts_beside_the_word_and_colours() {
    let counts_beside =
        "OFF 4 2 0 # counts\n# comment\n0 0 0\n1 0 0\n\n1 1 0\n0 1 0\n3 0 1 2 255 0 0\n4 0 1 2 3\n";
    let counts_below =
        "COFF\n4 2\n0 0 0 1 1 1 1\n1 0 0 1 1 1 1\n1 1 0 1 1 1 1\n0 1 0 1 1 1 1\n3 0 1 2\n4 0 1 2 3\n";
    let without_word = "4 2 0\n0 0 0\n1 0 0\n1 1 0\n0 1 0\n3 0 1 2\n4 0 1 2 3";
    for content in [counts_beside, counts_below, without_word] {
        let mesh = text(content, Format::Off).mesh;
        assert_eq!(mesh.points, mixed().points[..4]);
        assert_eq!(mesh.block(CellKind::Triangle).unwrap().nodes, [0, 1, 2]);
        assert_eq!(mesh.block(CellKind::Quad).unwrap().nodes, [0, 1, 2, 3]);
    }
}

#[test]
fn stl_solids_become_sets_and_corners_are_shared() {
    let facet = |a: &str, b: &str, c: &str| {
        format!(
            "facet normal 0 0 1\n outer loop\n vertex {a}\n vertex {b}\n vertex {c}\n endloop\nendfacet\n"
        )
    };
    let content = format!(
        "solid left lobe\n{}{}endsolid left lobe\nsolid\n{}endsolid\n",
        facet("0 0 0", "1 0 0", "1 1 0"),
        facet("0 0 0", "0.0 0.0 -0.0", "1 1 0"),
        facet("0 -0 0", "1 1 0", "0 1 0")
    );
    let file = text(&content, Format::Stl);
    assert_eq!(file.mesh.points, mixed().points[..4]);
    let triangles = &file.mesh.blocks[0];
    assert_eq!(triangles.nodes, [0, 1, 2, 0, 2, 3]);
    assert_eq!(triangles.sets, BTreeMap::from([("left lobe".to_owned(), vec![0])]));
    assert!(file.notes[0].contains("1 triangles with two equal corners"));
}

/// STL of some programs, with every ending as two words.
#[test]
fn endings_of_stl_may_be_two_words() {
    let content = "solid a\nfacet normal 0 0 1\nouter loop\nvertex 0 0 0\nvertex 1 0 0\nvertex 1 1 0\nend loop\nEnd Facet\n\
                   end solid a\nsolid b\nfacet normal 0 0 1\nouter loop\nvertex 0 0 0\nvertex 1 1 0\nvertex 0 1 0\nendloop\n\
                   endfacet\nend solid b\n";
    let triangles = &text(content, Format::Stl).mesh.blocks[0];
    assert_eq!(triangles.nodes, [0, 1, 2, 0, 2, 3]);
    assert_eq!(triangles.sets.keys().collect::<Vec<_>>(), ["a", "b"]);
    let broken = content.replacen("end loop", "end lop", 1);
    let error = read_bytes(broken.as_bytes(), Format::Stl).unwrap_err().to_string();
    assert!(error.contains("`lop` found instead of `loop` in facet 1"), "{error}");
}

/// 3D Slicer writes surfaces with x to the left and y to the back, and says so. Images have x to the right
/// and y to the front.
#[test]
fn surfaces_of_3d_slicer_have_the_axes_of_images() {
    let lps = "3D Slicer output. SPACE=LPS";
    let facets =
        "facet normal 0 0 1\nouter loop\nvertex -1 -2 3\nvertex -4 -2 3\nvertex -4 -5 3\nendloop\nendfacet\n";
    let triangle = "-1 -2 3\n-4 -2 3\n-4 -5 3\n";
    let off = "POINTS 3 float\n".to_owned() + triangle + "POLYGONS 1 4\n3 0 1 2\n";
    let vtp = |space: &str| {
        let codes: Vec<String> = space.bytes().chain([0]).map(|byte| byte.to_string()).collect();
        format!(
            "<VTKFile type=\"PolyData\"><PolyData><FieldData><Array type=\"String\" Name=\"SPACE\" NumberOfTuples=\"1\" \
             format=\"ascii\">{}</Array></FieldData><Piece NumberOfPoints=\"3\" NumberOfPolys=\"1\"><PointData>\
             <DataArray type=\"Float64\" Name=\"Normals\" NumberOfComponents=\"3\" format=\"ascii\">1 0 0 0 1 0 0 0 1</DataArray>\
             </PointData><Points><DataArray type=\"Float64\" NumberOfComponents=\"3\" format=\"ascii\">{}</DataArray></Points>\
             <Polys><DataArray type=\"Int32\" Name=\"connectivity\" format=\"ascii\">0 1 2</DataArray>\
             <DataArray type=\"Int32\" Name=\"offsets\" format=\"ascii\">3</DataArray></Polys></Piece></PolyData></VTKFile>",
            codes.join(" "),
            triangle.replace('\n', " ")
        )
    };
    let v = "v -1 -2 3\nv -4 -2 3\nv -4 -5 3\nf 1 2 3\n";
    let ply = "element vertex 3\nproperty float x\nproperty float y\nproperty float z\nelement face 1\n\
               property list uchar int vertex_index\nend_header\n";
    let files = [
        (Format::Stl, format!("solid {lps}\n{facets}endsolid\n")),
        (Format::Obj, format!("# {lps}\n{v}")),
        (Format::Ply, format!("ply\nformat ascii 1.0\ncomment {lps}\n{ply}{triangle}3 0 1 2\n")),
        (Format::Vtk, format!("# vtk DataFile Version 3.0\n{lps}\nASCII\nDATASET POLYDATA\n{off}")),
        (Format::Vtp, vtp("LPS")),
    ];
    for (format, content) in files {
        let file = text(&content, format);
        let expected = points(&[[1.0, 2.0, 3.0], [4.0, 2.0, 3.0], [4.0, 5.0, 3.0]]);
        assert_eq!(file.mesh.points, expected, "{format:?}");
        assert!(
            file.notes.iter().any(|note| note.contains("(LPS), were turned")),
            "{format:?}: {:?}",
            file.notes
        );
        let kept = content.replace("SPACE=LPS", "SPACE=RAS");
        if kept != content {
            assert_eq!(text(&kept, format).mesh.points[0], Vector3::new(-1.0, -2.0, 3.0), "{format:?}");
        }
    }
    let normals = &text(&vtp("LPS"), Format::Vtp).mesh.point_data["Normals"];
    assert_eq!(normals.values, [-1.0, 0.0, 0.0, 0.0, -1.0, 0.0, 0.0, 0.0, 1.0]);
    assert_eq!(text(&vtp("RAS"), Format::Vtp).mesh.points[0], Vector3::new(-1.0, -2.0, 3.0));
}

#[test]
fn binary_stl_whose_head_begins_like_text() {
    let mut bytes = fs::read(data().join("meshio-binary.stl")).unwrap();
    bytes[..12].copy_from_slice(b"solid facet ");
    let file = read_bytes(&bytes, Format::Stl).unwrap();
    assert_eq!(file.format, "STL binary");
    assert_eq!(file.mesh.points.len(), 4);
}

#[test]
fn ply_properties_become_data_and_sets() {
    let file = text(
        "ply\nformat ascii 1.0\ncomment x\nelement material 1\nproperty list uchar float colours\n\
         element vertex 4\nproperty float x\nproperty float y\nproperty float z\n\
         property float speed_0\nproperty float speed_1\nproperty uchar set:fixed\n\
         element face 2\nproperty list uchar int vertex_index\nproperty int label\nproperty uchar set:wall\n\
         element edge 1\nproperty int vertex1\nproperty int vertex2\nproperty int label\nend_header\n\
         2 0.5 0.25\n0 0 0 1 2 1\n1 0 0 3 4 0\n1 1 0 5 6 0\n0 1 0 7 8 1\n3 0 1 2 7 0\n4 0 1 2 3 8 1\n0 1 9\n",
        Format::Ply,
    );
    let mesh = file.mesh;
    assert_eq!(
        mesh.point_data["speed"],
        DataArray { components: 2, values: (1..=8).map(f64::from).collect() }
    );
    assert_eq!(mesh.point_sets["fixed"], [0, 3]);
    let label = |kind| mesh.block(kind).unwrap().data["label"].values.clone();
    assert_eq!(label(CellKind::Triangle), [7.0]);
    assert_eq!(label(CellKind::Quad), [8.0]);
    assert_eq!(label(CellKind::Line), [9.0]);
    assert_eq!(mesh.block(CellKind::Quad).unwrap().sets["wall"], [0]);
    assert!(!mesh.block(CellKind::Line).unwrap().sets.contains_key("wall"));
}

#[test]
fn gmsh_numbers_need_not_be_contiguous() {
    let mesh = text(
        "$MeshFormat\n2.2 0 8\n$EndMeshFormat\n$Nodes\n4\n70 1 0 0\n5 0 0 0\n1000000007 0 0 1\n71 0 1 0\n$EndNodes\n\
         $Elements\n1\n9 4 2 -3 1 5 70 71 1000000007\n$EndElements\n\
         $NodeData\n1\n\"u\"\n1\n0.0\n3\n0\n1\n2\n71 4.5\n70 1.5\n$EndNodeData\n",
        Format::Gmsh,
    )
    .mesh;
    assert_eq!(mesh.block(CellKind::Tet).unwrap().nodes, [1, 0, 3, 2]);
    assert_eq!(mesh.block(CellKind::Tet).unwrap().data["label"].values, [3.0]);
    let u = &mesh.point_data["u"].values;
    assert_eq!((u[0], u[3]), (1.5, 4.5));
    assert!(u[1].is_nan() && u[2].is_nan());
}

#[test]
fn gmsh_binary_of_the_other_byte_order() {
    let mut bytes = b"$MeshFormat\n2.2 1 8\n".to_vec();
    bytes.extend(1_i32.to_be_bytes());
    bytes.extend(b"\n$EndMeshFormat\n$Nodes\n3\n");
    for (i, x) in [[0.0, 0.0, 0.0], [1.0, 0.0, 0.0], [0.0, 1.0, 0.5_f64]].into_iter().enumerate() {
        bytes.extend((i as i32 + 1).to_be_bytes());
        x.iter().for_each(|x| bytes.extend(x.to_be_bytes()));
    }
    bytes.extend(b"\n$EndNodes\n$Elements\n1\n");
    [2, 1, 2, 1, 42, 1, 1, 2, 3_i32].iter().for_each(|i| bytes.extend(i.to_be_bytes()));
    bytes.extend(b"\n$EndElements\n");
    let mesh = read_bytes(&bytes, Format::Gmsh).unwrap().mesh;
    assert_eq!(mesh.points[2], Vector3::new(0.0, 1.0, 0.5));
    assert_eq!(mesh.blocks[0].nodes, [0, 1, 2]);
    assert_eq!(mesh.blocks[0].data["label"].values, [42.0]);

    let mut bytes = b"$MeshFormat\n4.1 1 8\n".to_vec();
    bytes.extend(1_i32.to_be_bytes());
    bytes.extend(b"\n$EndMeshFormat\n$Nodes\n");
    [1, 3, 1, 3_u64].iter().for_each(|i| bytes.extend(i.to_be_bytes()));
    [2, 1, 0_i32].iter().for_each(|i| bytes.extend(i.to_be_bytes()));
    [3, 1, 2, 3_u64].iter().for_each(|i| bytes.extend(i.to_be_bytes()));
    [0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 1.0, 0.5_f64].iter().for_each(|x| bytes.extend(x.to_be_bytes()));
    bytes.extend(b"\n$EndNodes\n$Elements\n");
    [1, 1, 1, 1_u64].iter().for_each(|i| bytes.extend(i.to_be_bytes()));
    [2, 1, 2_i32].iter().for_each(|i| bytes.extend(i.to_be_bytes()));
    [1, 1, 1, 2, 3_u64].iter().for_each(|i| bytes.extend(i.to_be_bytes()));
    bytes.extend(b"\n$EndElements\n");
    let mesh = read_bytes(&bytes, Format::Gmsh).unwrap().mesh;
    assert_eq!(mesh.points[2], Vector3::new(0.0, 1.0, 0.5));
    assert_eq!(mesh.blocks[0].nodes, [0, 1, 2]);
}

#[test]
fn pixels_and_voxels_are_reordered() {
    let mesh = text(
        "# vtk DataFile Version 2.0\nx\nASCII\nDATASET UNSTRUCTURED_GRID\nPOINTS 8 float\n\
         0 0 0 1 0 0 0 1 0 1 1 0 0 0 1 1 0 1 0 1 1 1 1 1\nCELLS 2 14\n8 0 1 2 3 4 5 6 7\n4 0 1 2 3\n\
         CELL_TYPES 2\n11\n8\nCELL_DATA 2\nSCALARS a float\nLOOKUP_TABLE default\n1 2\n\
         POINT_DATA 8\nSCALARS b int 1\n1 2 3 4 5 6 7 8\nVECTORS v double\n\
         0 0 0 0 0 0 0 0 0 0 0 0 0 0 0 0 0 0 0 0 0 0 0 9\n",
        Format::Vtk,
    )
    .mesh;
    assert_eq!(mesh.block(CellKind::Hex).unwrap().nodes, [0, 1, 3, 2, 4, 5, 7, 6]);
    assert_eq!(mesh.block(CellKind::Quad).unwrap().nodes, [0, 1, 3, 2]);
    assert_eq!(mesh.block(CellKind::Quad).unwrap().data["a"].values, [2.0]);
    assert_eq!(mesh.point_data["b"].values[7], 8.0);
    assert_eq!(mesh.point_data["v"].item(7), [0.0, 0.0, 9.0]);
}

#[test]
fn pieces_of_a_vtu_are_joined() {
    let piece = |x: f64, extra: &str| {
        format!(
            "<Piece NumberOfPoints=\"2\" NumberOfCells=\"1\"><PointData>{extra}</PointData>\
             <Points><DataArray type=\"Float32\" NumberOfComponents=\"3\">{x} 0 0 {x} 1 0</DataArray></Points>\
             <Cells><DataArray type=\"Int32\" Name=\"connectivity\" format=\"ascii\">0 1</DataArray>\
             <DataArray type=\"Int32\" Name=\"offsets\" format=\"ascii\">2</DataArray>\
             <DataArray type=\"UInt8\" Name=\"types\" format=\"ascii\">3</DataArray></Cells></Piece>"
        )
    };
    let extra = "<DataArray type=\"Float32\" Name=\"t\" format=\"ascii\">5 6</DataArray>";
    let content = format!(
        "<VTKFile type=\"UnstructuredGrid\"><UnstructuredGrid>{}{}</UnstructuredGrid></VTKFile>",
        piece(0.0, ""),
        piece(1.0, extra)
    );
    let mesh = text(&content, Format::Vtu).mesh;
    assert_eq!(mesh.blocks[0].nodes, [0, 1, 2, 3]);
    assert_eq!(mesh.points[3], Vector3::new(1.0, 1.0, 0.0));
    let t = &mesh.point_data["t"].values;
    assert!(t[0].is_nan() && t[1].is_nan());
    assert_eq!(t[2..], [5.0, 6.0]);
}

#[test]
fn content_tells_the_format_before_the_ending_does() {
    let path = scratch("content").join("really-vtk.VTU");
    fs::copy(data().join("v42.vtk"), &path).unwrap();
    let file = read(&path).unwrap();
    assert_eq!(file.mesh, mixed());
    assert!(file.notes[0].contains("the extension says VTU, but the file is legacy VTK"), "{:?}", file.notes);
}

// --- errors
// -------------------------------------------------------------------------------------------------

// --- what we write
// ------------------------------------------------------------------------------------------
