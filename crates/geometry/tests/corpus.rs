//! A corpus of malformed mesh files, and the files of `data/` truncated and changed at random with a fixed
//! seed. Each gives an error or a mesh, never a panic, and uses no more memory than the file justifies. The
//! test runs in its own process, whose peak memory is measured.

use std::fs;
use std::path::{Path, PathBuf};

use pliant_geometry::io::{Format, MeshFileError, read_bytes};

use pliant_testing::{PeakMemory, Random};

/// Memory that reading may add [KiB]; the files are below 64 KiB.
const MOST: u64 = 64 << 10;

fn folder(name: &str) -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("tests").join(name)
}

/// Mesh files of a folder with their formats, by name.
fn files(name: &str) -> Vec<(String, Format, Vec<u8>)> {
    let mut found: Vec<_> = fs::read_dir(folder(name))
        .unwrap()
        .filter_map(|entry| {
            let path = entry.unwrap().path();
            let format = Format::of_path(&path)?;
            Some((path.file_name()?.to_string_lossy().into_owned(), format, fs::read(&path).unwrap()))
        })
        .collect();
    found.sort_by(|a, b| a.0.cmp(&b.0));
    found
}

#[test]
fn broken_meshes_give_errors_in_little_memory() {
    let Some(before) = PeakMemory::alone("broken_meshes_give_errors_in_little_memory") else { return };
    let corpus = files("corpus");
    let seeds = files("data");
    for (name, format, bytes) in &corpus {
        let error = read_bytes(bytes, *format);
        println!("{name}: {}", error.as_ref().err().map_or("read".to_owned(), ToString::to_string));
        assert!(matches!(error, Err(MeshFileError::Content { .. })), "{name}: {error:?}");
    }
    for format in Format::ALL {
        let count = corpus.iter().filter(|(_, of_file, _)| of_file == format).count();
        assert!(count >= 3, "{}: {count}", format.name());
    }
    let mut noise = Random::new(20_260_101);
    let mut outcomes = [0; 2];
    for (name, format, seed) in &seeds {
        for _ in 0..150 {
            match read_bytes(&noise.damaged(seed), *format) {
                Ok(file) => {
                    outcomes[0] += 1;
                    let points = file.mesh.points.len();
                    assert!(
                        points <= seed.len() && file.mesh.points.iter().flatten().all(|x| x.is_finite()),
                        "{name}"
                    );
                }
                Err(error) => {
                    outcomes[1] += 1;
                    assert!(!error.to_string().contains('\n'), "{name}: {error}");
                }
            }
        }
    }
    println!("{} meshes, {} errors", outcomes[0], outcomes[1]);
    assert!(outcomes[0] > 500 && outcomes[1] > 500);
    before.assert_rise_below(MOST);
}

/// Regenerates the corpus: `cargo test -p pliant-geometry --test corpus write_the_corpus -- --ignored`.
#[test]
#[ignore = "writes files"]
fn write_the_corpus() {
    let save = |name: &str, bytes: &[u8]| {
        let ending = name.split('-').next().unwrap();
        fs::write(folder("corpus").join(format!("{name}.{ending}")), bytes).unwrap();
    };
    for format in Format::ALL {
        let ending = format.extension();
        save(&format!("{ending}-empty"), b"");
        let data = files("data");
        if let Some((_, _, bytes)) = data.iter().find(|(_, of_file, _)| of_file == format) {
            save(&format!("{ending}-cut"), &bytes[..bytes.len() / 3]);
        }
    }
    save(
        "msh-huge",
        b"$MeshFormat\n4.1 0 8\n$EndMeshFormat\n$Nodes\n1 18446744073709551615 1 9\n3 1 0 4000000000\n1\n",
    );
    save("msh-tag-beyond", b"$MeshFormat\n2.2 0 8\n$EndMeshFormat\n$Nodes\n1\n18446744073709551615 0 0 0\n$EndNodes\n$Elements\n1\n1 4 0 1 2 3 4\n$EndElements\n");
    save(
        "msh-binary-huge",
        b"$MeshFormat\n2.2 1 8\n\x01\0\0\0\n$EndMeshFormat\n$Nodes\n2000000000\n\0\0\0\0",
    );
    save(
        "vtk-huge",
        b"# vtk DataFile Version 3.0\nx\nBINARY\nDATASET POLYDATA\nPOINTS 4000000000 double\n1234",
    );
    save("vtk-no-such-point", b"# vtk DataFile Version 3.0\nx\nASCII\nDATASET POLYDATA\nPOINTS 3 float\n0 0 0 1 0 0 0 1 0\nPOLYGONS 1 4\n3 0 1 -7\n");
    save("vtu-deep", format!("<VTKFile type=\"UnstructuredGrid\">{}", "<a>".repeat(5000)).as_bytes());
    save("vtu-entities", b"<!DOCTYPE x [<!ENTITY a \"aaaaaaaaaaaaaaaa\"><!ENTITY b \"&a;&a;&a;&a;&a;&a;&a;&a;\"><!ENTITY c \"&b;&b;&b;&b;&b;&b;&b;&b;\"><!ENTITY d \"&c;&c;&c;&c;&c;&c;&c;&c;\">]><VTKFile type=\"UnstructuredGrid\">&d;&d;&d;&d;</VTKFile>");
    save("vtu-huge-block", b"<VTKFile type=\"UnstructuredGrid\" compressor=\"vtkZLibDataCompressor\"><UnstructuredGrid><Piece NumberOfPoints=\"1\" NumberOfCells=\"1\"><Points><DataArray type=\"Float32\" NumberOfComponents=\"3\" format=\"binary\">/////wAAAEAAAABA/////w==</DataArray></Points></Piece></UnstructuredGrid></VTKFile>");
    let poly = |connectivity: &str, offsets: &str| {
        format!(
            "<VTKFile type=\"PolyData\"><PolyData><Piece NumberOfPoints=\"3\" NumberOfPolys=\"1\"><Points><DataArray type=\"Float64\" \
             NumberOfComponents=\"3\" format=\"ascii\">0 0 0 1 0 0 0 1 0</DataArray></Points><Polys><DataArray type=\"Int64\" \
             Name=\"connectivity\" format=\"ascii\">{connectivity}</DataArray><DataArray type=\"Int64\" Name=\"offsets\" \
             format=\"ascii\">{offsets}</DataArray></Polys></Piece></PolyData></VTKFile>"
        )
    };
    save("vtp-offset-beyond", poly("0 1 2", "9223372036854775807").as_bytes());
    save("vtp-negative-point", poly("0 1 -2", "3").as_bytes());
    let gii = |encoding: &str, dim: &str, data: &str| {
        format!(
            "<GIFTI Version=\"1.0\"><DataArray Intent=\"NIFTI_INTENT_POINTSET\" DataType=\"NIFTI_TYPE_FLOAT32\" Encoding=\"{encoding}\" \
             ArrayIndexingOrder=\"ColumnMajorOrder\" Endian=\"LittleEndian\" Dim0=\"{dim}\" Dim1=\"3\"><Data>{data}</Data></DataArray></GIFTI>"
        )
    };
    save("gii-huge", gii("Base64Binary", "6148914691236517205", "AAAA").as_bytes());
    save("gii-short", gii("GZipBase64Binary", "9", "eJxjYGBgAAAABAAB").as_bytes());
    save("gii-nan", gii("ASCII", "1", "1 nan 2").as_bytes());
    save("pial-huge", b"\xFF\xFF\xFEmade\n\n\x7F\xFF\xFF\xFF\x7F\xFF\xFF\xFF\0\0\0\0");
    save("pial-negative", b"\xFF\xFF\xFEmade\n\n\xFF\xFF\xFF\xFF\0\0\0\x01");
    save("pial-quads", b"\xFF\xFF\xFF\0\0\x04\0\0\x01");
    save("pial-text-huge", b"#!ascii\n4000000000 4000000000\n0 0 0 0\n");
    save("obj-no-points", b"f 1 2 3\n");
    save("obj-index-zero", b"v 0 0 0\nv 1 0 0\nv 0 1 0\nf 0 1 2\n");
    save("obj-nan", b"v nan 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n");
    save("off-huge", b"OFF\n4000000000 4000000000 0\n0 0 0\n");
    save("off-long-face", b"OFF\n3 1 0\n0 0 0\n1 0 0\n0 1 0\n4294967295 0 1 2\n");
    save("stl-infinite", b"solid\nfacet normal 0 0 1\nouter loop\nvertex 0 0 1e999\n");
    let mut stl = vec![0; 134];
    stl[80..84].copy_from_slice(&u32::MAX.to_le_bytes());
    save("stl-huge", &stl);
    save("ply-huge", b"ply\nformat binary_little_endian 1.0\nelement vertex 4000000000\nproperty float x\nproperty float y\nproperty float z\nelement nothing 18446744073709551615\nend_header\n0123");
    save("ply-long-list", b"ply\nformat binary_little_endian 1.0\nelement vertex 0\nproperty float x\nproperty float y\nproperty float z\nelement face 1\nproperty list uint int vertex_indices\nend_header\n\xFF\xFF\xFF\xFF\0\0\0\0");
}
