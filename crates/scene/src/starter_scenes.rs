//! Scenes of meshes, as `pliant new --mesh` writes them, are built.

use pliant_format::Scene;
use pliant_format::source::Source;
use pliant_format::{SceneOfMesh, is_mesh, scene_of_given, scene_of_mesh};
use pliant_geometry::{Mesh, io};
use pliant_geometry::{Vector3, boundary};
use pliant_meshing::{Block, DEFAULT_CELL_LIMIT, Resolution, VolumeCell};

/// A bar along y, in a unit of `unit` metres.
fn bar(unit: f64) -> Mesh {
    let block = Block::new([0.05, 0.12, 0.04]);
    let mut mesh = block.mesh(Resolution::Edge(0.02), VolumeCell::Tet, DEFAULT_CELL_LIMIT).unwrap();
    mesh.points.iter_mut().for_each(|point| *point = (*point + Vector3::new(0.01, 0.02, 0.03)) / unit);
    mesh
}

fn opened(name: &str, mesh: &Mesh) -> (SceneOfMesh, crate::Built) {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join(name);
    io::write(&path, mesh).unwrap();
    assert!(is_mesh(&path));
    let made = scene_of_mesh(&path).unwrap();
    let source = Source::parse(name, made.text.clone()).unwrap_or_else(|error| panic!("{}", error.plain()));
    let scene =
        Scene::from_source(source, made.folder.clone()).unwrap_or_else(|error| panic!("{}", error.plain()));
    let built = crate::build(&scene).unwrap_or_else(|error| panic!("{}", error.plain()));
    (made, built)
}

fn length(built: &crate::Built) -> f64 {
    let (low, high) = built.bodies[0].mesh.bounds().unwrap();
    (high - low).max()
}

#[test]
fn a_closed_surface_in_millimetres_is_filled_and_held_at_its_end() {
    let whole = bar(1e-3);
    let (skin, _) = boundary(&whole).to_mesh(&whole.points);
    let (made, built) = opened("bar.stl", &skin);
    for piece in
        ["`bar.stl`", "millimetres", "0.1200 m along y", "E = 5 kPa", "filled with tets of 0.01000 m"]
    {
        assert!(made.assumed.contains(piece), "no `{piece}` in {}", made.assumed);
    }
    assert!((length(&built) - 0.12).abs() < 2e-3);
    assert!(built.bodies[0].mesh.volume_blocks().any(|block| block.len() > 300));
    let held = &built.model.constraints[0].nodes;
    let height = |node: u32| built.model.rest[node as usize][1];
    assert!(!held.is_empty() && held.iter().all(|&node| height(node) < 0.0321));
}

#[test]
fn a_volume_mesh_in_metres_is_taken_as_it_is() {
    let (made, built) = opened("bar.vtu", &bar(1.0));
    assert!(made.assumed.contains("taken as metres") && !made.assumed.contains("filled"), "{}", made.assumed);
    assert!((length(&built) - 0.12).abs() < 1e-12);
    assert_eq!(built.model.node_count(), bar(1.0).points.len());
    assert!(!made.text.contains("[view]"));
    let mut labelled = bar(1.0);
    let labels = (0..labelled.blocks[0].len()).map(|cell| f64::from(u8::from(cell > 9))).collect();
    labelled.blocks[0].data.insert("label".into(), pliant_geometry::DataArray::scalar(labels));
    let (made, built) = opened("organs.vtu", &labelled);
    assert!(made.text.contains("colour = \"label\"") && built.labels(None).len() == 2);
    let given = scene_of_given(&labelled, "organs");
    assert_eq!(
        given.text,
        made.text.replace("file = \"organs.vtu\"", "given = \"organs\"").replace("organs.vtu", "organs")
    );
}
