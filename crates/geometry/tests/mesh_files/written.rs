//! Files that are written, and read again.

use std::fs;
use std::time::Instant;

use pliant_geometry::io::{
    Format, VtuOptions, VtuSeries, pvd_text, read, read_bytes, save_vtu, write, write_vtu,
};
use pliant_geometry::{CellBlock, CellKind, DataArray, Mesh, Vector3};

use super::{mixed, read_data, scratch, with_sets};

#[test]
pub(super) fn vtu_round_trip_is_exact() {
    let folder = scratch("vtu");
    for compress in [false, true] {
        let path = folder.join(format!("mixed-{compress}.vtu"));
        let options = VtuOptions { compress, single: false, time: Some(0.1) };
        save_vtu(&path, &with_sets(), &options).unwrap();
        let file = read(&path).unwrap();
        assert_eq!(file.mesh, with_sets());
        assert_eq!(file.time, Some(0.1));
        assert!(file.notes.is_empty());
    }
    write(&folder.join("plain.vtu"), &with_sets()).unwrap();
    assert_eq!(read(&folder.join("plain.vtu")).unwrap().mesh, with_sets());
    // All numbers of the mixed mesh are exact in 32 bits.
    let mut bytes = Vec::new();
    write_vtu(&mut bytes, &with_sets(), &VtuOptions { compress: true, single: true, time: None }).unwrap();
    let file = read_bytes(&bytes, Format::Vtu).unwrap();
    assert_eq!(file.mesh, with_sets());
    assert_eq!(file.time, None);
}

#[test]
pub(super) fn frames_of_a_series_are_files_of_their_own() {
    let mut mesh = with_sets();
    for compress in [false, true] {
        let mut series = VtuSeries::default();
        for frame in 0..3 {
            let options = VtuOptions { compress, single: true, time: Some(f64::from(frame)) };
            mesh.point_data.values_mut().flat_map(|data| &mut data.values).for_each(|value| *value += 0.5);
            let (mut alone, mut of_series) = (Vec::new(), Vec::new());
            write_vtu(&mut alone, &mesh, &options).unwrap();
            series.write(&mut of_series, &mesh, &options).unwrap();
            assert_eq!(alone, of_series, "frame {frame}");
        }
    }
}

#[test]
pub(super) fn vtu_of_a_single_cell() {
    let mut mesh = mixed();
    mesh.blocks.truncate(1);
    for compress in [false, true] {
        let mut bytes = Vec::new();
        write_vtu(&mut bytes, &mesh, &VtuOptions { compress, ..VtuOptions::default() }).unwrap();
        assert_eq!(read_bytes(&bytes, Format::Vtu).unwrap().mesh, mesh);
    }
}

/// Prints the times and sizes that `io/vtu_write.rs` speaks of:
/// `cargo test --release -p pliant-geometry --test mesh_files vtu_speed -- --ignored --nocapture`
#[test]
#[ignore = "measures time"]
pub(super) fn vtu_speed_with_ten_thousand_nodes() {
    // A wavy grid of 22³ nodes, five tets to a cube.
    let n = 22_u32;
    let at = |i: u32, j: u32, k: u32| (i * n + j) * n + k;
    let mut mesh = Mesh::default();
    let mut tets = Vec::new();
    for (i, j, k) in (0..n).flat_map(|i| (0..n).flat_map(move |j| (0..n).map(move |k| (i, j, k)))) {
        let [x, y, z] = [i, j, k].map(f64::from);
        let wave = [(1.37 * x).sin(), (3.1 * z).cos(), 0.0].map(|w| 0.001 * w);
        mesh.points.push(Vector3::new(0.01 * x + wave[0], 0.01 * y + wave[1], 0.01 * z));
        if i.max(j).max(k) + 1 < n {
            let corners = [
                at(i, j, k),
                at(i + 1, j, k),
                at(i + 1, j + 1, k),
                at(i, j + 1, k),
                at(i, j, k + 1),
                at(i + 1, j, k + 1),
                at(i + 1, j + 1, k + 1),
                at(i, j + 1, k + 1),
            ];
            for tet in [[0, 1, 2, 5], [0, 2, 3, 7], [0, 5, 7, 4], [2, 7, 5, 6], [0, 2, 7, 5]] {
                tets.extend(tet.map(|corner: usize| corners[corner]));
            }
        }
    }
    let wave = |count: usize| (0..count).map(|i| 1e-3 * (0.7 * i as f64).sin()).collect();
    let points = mesh.points.len();
    for name in ["displacement", "velocity"] {
        mesh.point_data.insert(name.to_owned(), DataArray { components: 3, values: wave(3 * points) });
    }
    let mut block = CellBlock::new(CellKind::Tet, tets);
    let cells = block.len();
    block.data.insert("von Mises".to_owned(), DataArray::scalar(wave(cells)));
    mesh.blocks.push(block);
    for tensor in [false, true] {
        if tensor {
            let stress = DataArray { components: 9, values: wave(9 * cells) };
            mesh.block_mut(CellKind::Tet).data.insert("stress".to_owned(), stress);
        }
        for (compress, single) in [(false, false), (false, true), (true, false), (true, true)] {
            let options = VtuOptions { compress, single, time: Some(0.0) };
            let mut bytes = Vec::new();
            let seconds = (0..10).map(|_| {
                bytes.clear();
                let start = Instant::now();
                write_vtu(&mut bytes, &mesh, &options).unwrap();
                start.elapsed().as_secs_f64()
            });
            let best = 1e3 * seconds.fold(f64::INFINITY, f64::min);
            println!(
                "{points} nodes, {cells} tets, tensor {tensor}, compress {compress}, single {single}: \
                 {best:.1} ms, {} bytes",
                bytes.len()
            );
        }
    }
}

#[test]
pub(super) fn vtu_data_of_one_kind_only_stay_with_it() {
    let mut mesh = mixed();
    mesh.block_mut(CellKind::Quad).data.clear();
    mesh.block_mut(CellKind::Tet).data.remove("stress");
    let mut bytes = Vec::new();
    write_vtu(&mut bytes, &mesh, &VtuOptions::default()).unwrap();
    assert_eq!(read_bytes(&bytes, Format::Vtu).unwrap().mesh, mesh);
}

#[test]
pub(super) fn vtu_compresses_arrays_of_several_blocks() {
    // 40,000 points are 960 kB of coordinates, eight blocks.
    let n = 40_000;
    let mut mesh = Mesh {
        points: (0..n).map(|i| Vector3::new(f64::from(i).sin(), f64::from(i), 0.25)).collect(),
        blocks: vec![CellBlock::new(CellKind::Line, (0..n as u32 - 1).flat_map(|i| [i, i + 1]).collect())],
        ..Mesh::default()
    };
    let zeros = DataArray { components: 9, values: vec![0.0; 9 * n as usize] };
    mesh.point_data.insert("zero".to_owned(), zeros);
    let mut bytes = Vec::new();
    write_vtu(&mut bytes, &mesh, &VtuOptions { compress: true, ..VtuOptions::default() }).unwrap();
    // The zeros alone, which are most of the mesh, would be 2.88 MB.
    assert!(bytes.len() < 2_000_000, "{}", bytes.len());
    assert_eq!(read_bytes(&bytes, Format::Vtu).unwrap().mesh, mesh);
}

#[test]
pub(super) fn gmsh_round_trip_keeps_everything_but_quotes() {
    let folder = scratch("gmsh");
    let path = folder.join("mixed.msh");
    write(&path, &with_sets()).unwrap();
    let mut mesh = read(&path).unwrap().mesh;
    // Point sets are vertex cells in Gmsh: the vertices that were added, and their sets, are the only excess.
    let vertices = mesh.blocks.iter().position(|block| block.kind == CellKind::Vertex).unwrap();
    let vertices = mesh.blocks.remove(vertices);
    let mut nodes = vertices.nodes.clone();
    nodes.sort_unstable();
    assert_eq!(nodes, [0, 1, 4, 5, 8]);
    let mut expected = with_sets();
    expected.blocks.pop();
    // Names are quoted and cannot contain quotes.
    let tets = expected.block_mut(CellKind::Tet);
    let set = tets.sets.remove("tumour \"2\"").unwrap();
    tets.sets.insert("tumour '2'".to_owned(), set);
    assert_eq!(mesh, expected);

    // Written again it does not change any more.
    let once = read(&path).unwrap().mesh;
    write(&path, &once).unwrap();
    // As texts, because the added vertices have no stress: NaN.
    assert_eq!(format!("{:?}", read(&path).unwrap().mesh), format!("{once:?}"));
}

#[test]
pub(super) fn gmsh_keeps_cell_order_labels_and_overlapping_sets() {
    let mut mesh = Mesh { points: mixed().points, ..Mesh::default() };
    let tets = mesh.block_mut(CellKind::Tet);
    tets.nodes = vec![4, 5, 6, 8, 4, 6, 7, 8, 0, 1, 2, 5, 0, 2, 3, 7];
    tets.data.insert("label".to_owned(), DataArray::scalar(vec![2.0, 1.0, 2.0, 1.0]));
    tets.sets.insert("one".to_owned(), vec![1, 3]);
    tets.sets.insert("end".to_owned(), vec![0, 3]);
    let path = scratch("gmsh-order").join("order.msh");
    write(&path, &mesh).unwrap();
    assert_eq!(read(&path).unwrap().mesh, mesh);
    // The set of exactly the cells with label 1 is the physical group 1.
    let content = fs::read_to_string(&path).unwrap();
    assert!(content.contains("3 1 \"one\"") && content.contains("3 3 \"end\""), "{content}");

    // Labels that cannot be group numbers become data.
    for labels in [vec![0.0, -1.0, 2.5, 1.0], vec![0.0; 4]] {
        mesh.block_mut(CellKind::Tet).data.insert("label".to_owned(), DataArray::scalar(labels));
        write(&path, &mesh).unwrap();
        assert_eq!(read(&path).unwrap().mesh, mesh);
    }
}

#[test]
pub(super) fn files_of_gmsh_survive_our_writers() {
    let folder = scratch("survive");
    let mesh = read_data("gmsh41.msh").mesh;
    for name in ["again.msh", "again.vtu"] {
        write(&folder.join(name), &mesh).unwrap();
        assert_eq!(read(&folder.join(name)).unwrap().mesh, mesh, "{name}");
    }
}

#[test]
pub(super) fn surfaces_round_trip() {
    let folder = scratch("surfaces");
    let mut mesh = mixed();
    mesh.blocks.retain(|block| matches!(block.kind, CellKind::Triangle | CellKind::Quad));
    mesh.block_mut(CellKind::Triangle).sets.insert("wall".to_owned(), vec![0]);
    mesh.block_mut(CellKind::Quad).sets.insert("wall".to_owned(), vec![0]);
    mesh.block_mut(CellKind::Quad).sets.insert("ground".to_owned(), vec![0]);
    mesh.point_sets.insert("fixed".to_owned(), vec![3, 8]);

    write(&folder.join("s.ply"), &mesh).unwrap();
    assert_eq!(read(&folder.join("s.ply")).unwrap().mesh, mesh);

    write(&folder.join("s.OBJ"), &mesh).unwrap();
    let mut bare = mesh.clone();
    bare.point_data.clear();
    bare.point_sets.clear();
    bare.blocks.iter_mut().for_each(|block| block.data.clear());
    assert_eq!(read(&folder.join("s.OBJ")).unwrap().mesh, bare);

    write(&folder.join("s.stl"), &mesh).unwrap();
    let back = read(&folder.join("s.stl")).unwrap().mesh;
    assert_eq!(back.blocks[0].len(), 4);
    let corner = |mesh: &Mesh, cell: usize, i: usize| mesh.points[mesh.blocks[0].cell(cell)[i] as usize];
    for cell in 0..2 {
        for i in 0..3 {
            assert_eq!(corner(&back, cell, i), corner(&mesh, cell, i));
        }
    }
}

#[test]
pub(super) fn surfaces_of_a_volume_mesh_leave_its_inner_points_out() {
    let folder = scratch("skin");
    write(&folder.join("skin.obj"), &with_sets()).unwrap();
    // The triangles and the quad use all points but 7.
    let mesh = read(&folder.join("skin.obj")).unwrap().mesh;
    assert_eq!(mesh.points.len(), 8);
    assert_eq!(mesh.points[7], mixed().points[8]);
    let mut bare = mixed();
    bare.blocks.retain(|block| block.kind == CellKind::Tet);
    for name in ["x.obj", "x.stl", "x.ply"] {
        let message = write(&folder.join(name), &bare).unwrap_err().to_string();
        assert!(message.contains("extract its surface first"), "{message}");
        assert!(!folder.join(name).exists());
    }
}

#[test]
pub(super) fn meshes_that_are_not_whole_are_not_written() {
    let folder = scratch("whole");
    let path = folder.join("bad.vtu");
    type Spoil = fn(&mut Mesh);
    let cases: [(&str, Spoil); 6] = [
        ("point 3 is not finite", |mesh| mesh.points[3].y = f64::NAN),
        ("tet 1 uses node 99, but the mesh has 9 points", |mesh| mesh.blocks[1].nodes[7] = 99),
        ("data `velocity` have 26 numbers, not 3 for each of 9 points", |mesh| {
            mesh.point_data.get_mut("velocity").unwrap().values.pop();
        }),
        ("the set `far` contains point 9", |mesh| {
            mesh.point_sets.insert("far".to_owned(), vec![9]);
        }),
        ("different numbers of components", |mesh| {
            let values = vec![0.0; 2];
            mesh.blocks[0].data.insert("label".to_owned(), DataArray { components: 2, values });
        }),
        ("no points or no cells", |mesh| mesh.blocks.clear()),
    ];
    for (expected, spoil) in cases {
        let mut mesh = mixed();
        spoil(&mut mesh);
        let message = write(&path, &mesh).unwrap_err().to_string();
        assert!(message.contains(expected), "{message}");
        assert_eq!(fs::read_dir(&folder).unwrap().count(), 0);
    }
}

#[test]
pub(super) fn pvd_lists_the_files_of_a_series() {
    let folder = scratch("pvd");
    let files = [(0.0, "step_000000.vtu".to_owned()), (0.01, "a&b.vtu".to_owned())];
    fs::write(folder.join("series.pvd"), pvd_text(files.iter().cloned()).unwrap()).unwrap();
    let content = fs::read_to_string(folder.join("series.pvd")).unwrap();
    assert!(content.contains("timestep=\"0.01\" group=\"\" part=\"0\" file=\"a&amp;b.vtu\""), "{content}");
    assert!(pvd_text([(f64::NAN, "x".to_owned())].into_iter()).is_err());
    // The good list is still there, and nothing else.
    assert_eq!(fs::read_to_string(folder.join("series.pvd")).unwrap(), content);
    assert_eq!(fs::read_dir(&folder).unwrap().count(), 1);
}
