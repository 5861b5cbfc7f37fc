//! Broken files.

use std::fs;
use std::path::Path;
use std::time::{Duration, Instant};

use pliant_geometry::io::{Format, MeshFileError, MeshFileProblem, Place, read, read_bytes, write};
use pliant_geometry::{CellKind, boundary, volume};
use pliant_testing::Random;

use super::{data, mixed, scratch, with_sets};

/// The error of a file of some bytes.
pub(super) fn error(content: &str, format: Format) -> (Place, MeshFileProblem, String) {
    match read_bytes(content.as_bytes(), format) {
        Err(error) => {
            let message = error.to_string();
            match error {
                MeshFileError::Content { place, problem, .. } => (place, problem, message),
                other => panic!("{other:?}"),
            }
        }
        Ok(file) => panic!("read as {file:?}"),
    }
}

/// A cell of a column.
struct FileCell {
    /// Its type in VTK and in Gmsh.
    vtk: u8,
    gmsh: u8,
    /// 1 of tets, 2 of wedges, 3 of others.
    label: u8,
    nodes: Vec<usize>,
}

impl FileCell {
    /// Its nodes, numbered from `first` on.
    fn words(&self, first: usize) -> String {
        let words: Vec<String> = self.nodes.iter().map(|node| (node + first).to_string()).collect();
        words.join(" ")
    }
}

/// A column of three cubes: of tets, of wedges, and of a hex under a pyramid.
struct Column {
    points: Vec<String>,
    cells: Vec<FileCell>,
}

impl Column {
    fn new() -> Self {
        let point = |at: usize| format!("{} {} {}", at % 2, at / 2 % 2, at / 4);
        let mut points: Vec<String> = (0..16).map(point).collect();
        points.push("0.5 0.5 4".to_owned());
        let mut cells = Vec::new();
        let mut add = |vtk, gmsh, label, nodes: &[usize]| {
            cells.push(FileCell { vtk, gmsh, label, nodes: nodes.to_vec() });
        };
        for [a, b] in [[1, 3], [3, 2], [2, 6], [6, 4], [4, 5], [5, 1]] {
            add(10, 4, 1, &[0, a, b, 7]);
        }
        add(13, 6, 2, &[4, 5, 7, 8, 9, 11]);
        // The other order.
        add(13, 6, 2, &[8, 11, 10, 4, 7, 6]);
        add(12, 5, 3, &[8, 9, 11, 10, 12, 13, 15, 14]);
        add(14, 7, 3, &[12, 13, 15, 14, 16]);
        add(5, 2, 3, &[0, 2, 3]);
        Self { points, cells }
    }

    fn each(&self, line: impl Fn(&FileCell) -> String) -> Vec<String> {
        self.cells.iter().map(line).collect()
    }

    fn msh1(&self) -> String {
        let cell = |cell: &FileCell| {
            format!("{} {} 1 {} {}", cell.gmsh, cell.label, cell.nodes.len(), cell.words(1))
        };
        format!(
            "$NOD\n17\n{}$ENDNOD\n$ELM\n11\n{}$ENDELM\n",
            numbered(&self.points),
            numbered(&self.each(cell))
        )
    }

    fn msh2(&self) -> String {
        let cell = |cell: &FileCell| format!("{} 2 {} 1 {}", cell.gmsh, cell.label, cell.words(1));
        format!(
            "$MeshFormat\n2.2 0 8\n$EndMeshFormat\n$Nodes\n17\n{}$EndNodes\n$Elements\n11\n{}$EndElements\n",
            numbered(&self.points),
            numbered(&self.each(cell))
        )
    }

    fn msh4(&self) -> String {
        let tags: String = (1..=17).map(|tag| format!("{tag}\n")).collect();
        let block = |(cell, number): (&FileCell, usize)| {
            let dimension = if cell.gmsh == 2 { 2 } else { 3 };
            format!("{dimension} {} {} 1\n{number} {}\n", cell.label, cell.gmsh, cell.words(1))
        };
        let blocks: String = self.cells.iter().zip(1..).map(block).collect();
        let entities: String = (1..=3).map(|tag| format!("{tag} 0 0 0 1 1 4 1 {tag} 0\n")).collect();
        format!(
            "$MeshFormat\n4.1 0 8\n$EndMeshFormat\n$Entities\n0 0 1 3\n3 0 0 0 1 1 4 0 0\n{entities}$EndEntities\n$Nodes\n\
             1 17 1 17\n3 1 0 17\n{tags}{}\n$EndNodes\n$Elements\n11 11 1 11\n{blocks}$EndElements\n",
            self.points.join("\n")
        )
    }

    fn vtk(&self) -> String {
        let lines = self.each(|cell| format!("{} {}", cell.nodes.len(), cell.words(0)));
        let numbers: usize = self.cells.iter().map(|cell| cell.nodes.len() + 1).sum();
        format!(
            "# vtk DataFile Version 3.0\nx\nASCII\nDATASET UNSTRUCTURED_GRID\nPOINTS 17 double\n{}\nCELLS 11 {numbers}\n{}\n\
             CELL_TYPES 11\n{}\nCELL_DATA 11\nSCALARS label int\nLOOKUP_TABLE default\n{}\n",
            self.points.join("\n"),
            lines.join("\n"),
            self.each(|cell| cell.vtk.to_string()).join("\n"),
            self.each(|cell| cell.label.to_string()).join("\n")
        )
    }

    fn vtu(&self) -> String {
        let ends = self.cells.iter().scan(0, |end, cell| {
            *end += cell.nodes.len();
            Some(end.to_string())
        });
        let array = |name: &str, kind: &str, words: Vec<String>| {
            let text = words.join(" ");
            format!("<DataArray type=\"{kind}\" Name=\"{name}\" format=\"ascii\">{text}</DataArray>")
        };
        format!(
            "<VTKFile type=\"UnstructuredGrid\" version=\"0.1\" byte_order=\"LittleEndian\"><UnstructuredGrid>\
             <Piece NumberOfPoints=\"17\" NumberOfCells=\"11\"><Points>\
             <DataArray type=\"Float64\" NumberOfComponents=\"3\" format=\"ascii\">{}</DataArray></Points><Cells>{}{}{}</Cells>\
             <CellData>{}</CellData></Piece></UnstructuredGrid></VTKFile>",
            self.points.join(" "),
            array("connectivity", "Int64", self.each(|cell| cell.words(0))),
            array("offsets", "Int64", ends.collect()),
            array("types", "UInt8", self.each(|cell| cell.vtk.to_string())),
            array("label", "Int32", self.each(|cell| cell.label.to_string()))
        )
    }
}

/// Lines with numbers from 1 on.
fn numbered(lines: &[String]) -> String {
    lines.iter().zip(1..).map(|(line, number)| format!("{number} {line}\n")).collect()
}

#[test]
pub(super) fn wedges_and_pyramids_are_read_as_tets_that_fit() {
    let column = Column::new();
    for (name, text, format) in [
        ("msh 1", column.msh1(), Format::Gmsh),
        ("msh 2", column.msh2(), Format::Gmsh),
        ("msh 4", column.msh4(), Format::Gmsh),
        ("vtk", column.vtk(), Format::Vtk),
        ("vtu", column.vtu(), Format::Vtu),
    ] {
        let file = read_bytes(text.as_bytes(), format).unwrap_or_else(|error| panic!("{error}"));
        let mesh = &file.mesh;
        let tets = mesh.block(CellKind::Tet).unwrap();
        assert!(mesh.block(CellKind::Hex).is_none(), "{name}: a hex next to a wedge stays a hex");
        let volumes = tets.cells().map(|cell| {
            volume(CellKind::Tet, &cell.iter().map(|&n| mesh.points[n as usize]).collect::<Vec<_>>())
        });
        let by_label = volumes.zip(&tets.data["label"].values).fold([0.0; 3], |mut sums, (volume, label)| {
            assert!(volume > 0.0, "{name}");
            sums[*label as usize - 1] += volume;
            sums
        });
        for (found, right) in by_label.into_iter().zip([1.0, 1.0, 1.0 + 1.0 / 3.0]) {
            assert!((found - right).abs() < 1e-12, "{name}: {by_label:?}");
        }
        // A face cut in two ways would be boundary inside the column. The pyramid's sides are √5/4 each.
        let area = boundary(mesh).area(&mesh.points);
        assert!((area - (1.0 + 12.0 + 5.0_f64.sqrt())).abs() < 1e-12, "{name}: {area}");
        let notes = file.notes.join("; ");
        assert!(notes.contains("split into tets: 2 wedges, 1 pyramid, 1 adjacent hex"), "{name}: {notes}");
    }
}

#[test]
pub(super) fn a_body_that_would_lack_cells_is_an_error() {
    let text = Column::new().vtk();
    // The hex as 25 (quadratic) has too few nodes, which nobody looks at.
    let quadratic = text.replace("10\n13\n13\n12\n14\n5\n", "10\n13\n13\n25\n14\n5\n");
    let (_, problem, message) = error(&quadratic, Format::Vtk);
    assert!(matches!(problem, MeshFileProblem::UnsupportedCells { .. }));
    assert!(message.contains("1 quadratic hex (hex20) (VTK type 25)"), "{message}");
    // A face that is not read leaves the body whole.
    let face = text.replace("14\n5\nCELL_DATA", "14\n22\nCELL_DATA");
    let notes = read_bytes(face.as_bytes(), Format::Vtk).unwrap().notes.join("; ");
    assert!(notes.contains("skipped cells of unsupported kinds: 1 quadratic triangle (tri6)"), "{notes}");
}

#[test]
pub(super) fn errors_say_what_is_wrong_and_where() {
    let tet = |nodes: &str, element: &str| {
        format!(
            "$MeshFormat\n2.2 0 8\n$EndMeshFormat\n$Nodes\n4\n{nodes}\n$EndNodes\n$Elements\n1\n{element}\n$EndElements\n"
        )
    };
    let good = "1 0 0 0\n2 1 0 0\n3 0 1 0\n4 0 0 1";
    let (place, problem, message) = error(&tet(good, "1 4 2 1 1 1 2 3 5"), Format::Gmsh);
    assert_eq!(place, Place::Line(13));
    assert_eq!(problem, MeshFileProblem::UndefinedNode { node: 5, cell: "tet 1".to_owned() });
    assert!(message.starts_with("cannot read `bytes.msh`, line 13: tet 1 uses node 5"), "{message}");

    let (place, problem, _) =
        error(&tet("1 0 0 0\n2 1 0 x\n3 0 1 0\n4 0 0 1", "1 4 0 1 2 3 4"), Format::Gmsh);
    assert_eq!(place, Place::Line(7));
    assert!(matches!(problem, MeshFileProblem::BadNumber { ref text, .. } if text == "x"));

    let (place, problem, message) =
        error(&tet("1 0 0 0\n2 1 0 nan\n3 0 1 0\n4 0 0 1", "1 4 0 1 2 3 4"), Format::Gmsh);
    assert_eq!(place, Place::Line(7));
    assert!(matches!(problem, MeshFileProblem::NotFinite { point: 2, .. }), "{message}");

    let (_, problem, message) = error(&tet(good, "1 11 0 1 2 3 4 1 2 3 4 1 2"), Format::Gmsh);
    assert!(matches!(problem, MeshFileProblem::UnsupportedCells { .. }));
    assert!(message.contains("1 quadratic tet (tet10)"), "{message}");
    assert!(matches!(
        error("$MeshFormat\n4.0 0 8\n", Format::Gmsh).1,
        MeshFileProblem::UnsupportedVariant { .. }
    ));
    assert_eq!(error("v 0 0 0\n", Format::Obj).1, MeshFileProblem::NoCells);
    assert_eq!(error("# nothing\n", Format::Obj).1, MeshFileProblem::NoPoints);
    let (place, problem, _) = error("v 0 0 0\nv 1 0 0\n\nf 1 2 3\n", Format::Obj);
    assert_eq!(place, Place::Line(4));
    assert!(matches!(problem, MeshFileProblem::UndefinedNode { node: 3, .. }));
    let (place, _, message) = error("OFF\n3 1 0\n0 0 0\n1 0 0\n0 1\n3 0 1 2\n", Format::Off);
    assert_eq!(place, Place::Line(5), "{message}");
    let (place, ..) = error("solid\nfacet normal 0 0 1\nouter loop\nvertex 0 0 inf\n", Format::Stl);
    assert_eq!(place, Place::Line(4));
    let lz4 = read(&data().join("appended-lz4.vtu")).unwrap_err().to_string();
    assert!(lz4.contains("vtkLZ4DataCompressor is not supported; save the file with zlib"), "{lz4}");
    let quadratic = read(&data().join("quadratic.msh")).unwrap_err().to_string();
    assert!(quadratic.contains("48 quadratic tet (tet10)"), "{quadratic}");
}

#[test]
pub(super) fn errors_of_paths() {
    let missing = read(Path::new("no/such/file.vtu"));
    assert!(matches!(missing, Err(MeshFileError::Open { .. })));
    let folder = scratch("paths");
    let unknown = folder.join("mesh.inp");
    fs::write(&unknown, "*Heading").unwrap();
    let message = read(&unknown).unwrap_err().to_string();
    assert!(message.contains("formats read: Gmsh (.msh), legacy VTK (.vtk), VTU (.vtu)"), "{message}");
    let message = write(&folder.join("mesh.vtk"), &mixed()).unwrap_err().to_string();
    assert!(message.contains("formats written: VTU (.vtu), Gmsh (.msh), OBJ (.obj)"), "{message}");
    assert!(matches!(write(&folder.join("no/where.vtu"), &mixed()), Err(MeshFileError::Write { .. })));
}

#[test]
pub(super) fn announced_counts_allocate_nothing() {
    let gmsh = "$MeshFormat\n2.2 0 8\n$EndMeshFormat\n$Nodes\n4000000000\n1 0 0 0\n";
    let vtk = "# vtk DataFile Version 3.0\nx\nBINARY\nDATASET POLYDATA\nPOINTS 4000000000 double\n1234";
    let off = "OFF\n4000000000 4000000000 0\n0 0 0\n";
    let ply = "ply\nformat binary_little_endian 1.0\nelement vertex 4000000000\nproperty float x\n\
               property float y\nproperty float z\nelement nothing 18446744073709551615\nend_header\n0123";
    let vtu = "<VTKFile type=\"UnstructuredGrid\" compressor=\"vtkZLibDataCompressor\"><UnstructuredGrid>\
               <Piece NumberOfPoints=\"1\" NumberOfCells=\"1\"><Points><DataArray type=\"Float32\" \
               NumberOfComponents=\"3\" format=\"binary\">/////wAAAEAAAABA/////w==</DataArray></Points></Piece>\
               </UnstructuredGrid></VTKFile>";
    let mut stl = vec![0; 100];
    stl[80..84].copy_from_slice(&u32::MAX.to_le_bytes());
    let cases = [
        (gmsh.as_bytes(), Format::Gmsh),
        (vtk.as_bytes(), Format::Vtk),
        (off.as_bytes(), Format::Off),
        (ply.as_bytes(), Format::Ply),
        (vtu.as_bytes(), Format::Vtu),
        (&stl, Format::Stl),
    ];
    for (bytes, format) in cases {
        match read_bytes(bytes, format) {
            Err(MeshFileError::Content { problem: MeshFileProblem::Truncated { .. }, .. }) => {}
            other => panic!("{format:?}: {other:?}"),
        }
    }
}

#[test]
pub(super) fn deep_xml_is_an_error_or_a_mesh_but_no_crash() {
    let content = format!("<VTKFile type=\"PolyData\">{}", "<a>".repeat(200_000));
    assert!(read_bytes(content.as_bytes(), Format::Vtu).is_err());
}

/// Truncates every file at many positions and changes bytes: the result is a mesh or an error, and
/// quickly.
#[test]
pub(super) fn broken_files_never_panic() {
    let mut numbers = Random::new(0x2545_f491_4f6c_dd1d);
    let mut random = move || numbers.below(usize::MAX);
    let mut files: Vec<(Vec<u8>, Format, String)> = fs::read_dir(data())
        .unwrap()
        .filter_map(|entry| {
            let path = entry.unwrap().path();
            let format = Format::of_path(&path)?;
            Some((fs::read(&path).unwrap(), format, path.display().to_string()))
        })
        .collect();
    files.sort_by(|a, b| a.2.cmp(&b.2));
    assert!(files.len() > 30);
    let folder = scratch("broken");
    for (name, mesh) in [("own.msh", with_sets()), ("own.ply", with_sets()), ("own.obj", with_sets())] {
        write(&folder.join(name), &mesh).unwrap();
        let bytes = fs::read(folder.join(name)).unwrap();
        files.push((bytes, Format::of_path(Path::new(name)).unwrap(), name.to_owned()));
    }
    let mut ok = 0;
    let mut errors = 0;
    for (bytes, format, name) in &files {
        let mut try_bytes = |bytes: &[u8]| {
            let start = Instant::now();
            match read_bytes(bytes, *format) {
                Ok(file) => {
                    // The result is usable: all nodes exist.
                    let points = file.mesh.points.len();
                    assert!(file.mesh.blocks.iter().flat_map(|b| &b.nodes).all(|&n| (n as usize) < points));
                    ok += 1;
                }
                Err(error) => {
                    assert!(!error.to_string().is_empty());
                    errors += 1;
                }
            }
            assert!(start.elapsed() < Duration::from_secs(2), "{name}");
        };
        let step = (bytes.len() / 150).max(1);
        for length in (0..bytes.len()).step_by(step) {
            try_bytes(&bytes[..length]);
        }
        for _ in 0..400 {
            let mut turned = bytes.clone();
            for _ in 0..=random() % 4 {
                let at = random() % turned.len();
                turned[at] = match random() % 4 {
                    0 => b'9',
                    1 => b'-',
                    2 => 0xff,
                    _ => random() as u8,
                };
            }
            try_bytes(&turned);
        }
    }
    assert!(ok > 1000 && errors > 1000, "{ok} {errors}");
}
