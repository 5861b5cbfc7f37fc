//! Blocks and tubes.

use std::f64::consts::PI;

use pliant_geometry::{CellKind, Mesh, Vector3};
use pliant_meshing::{Block, DEFAULT_CELL_LIMIT, Resolution, Tube, VolumeCell};

use pliant_testing::mesh_checks::*;

const SIZE: [f64; 3] = [0.1, 0.05, 0.03];
const TUBE: Tube = Tube { inner_radius: 0.01, outer_radius: 0.015, length: 0.04 };

fn block(resolution: Resolution, cells: VolumeCell) -> Mesh {
    Block { origin: Vector3::new(0.5, -0.2, 0.1), size: SIZE }
        .mesh(resolution, cells, DEFAULT_CELL_LIMIT)
        .expect("a block is meshed")
}

fn tube(edge: f64, cells: VolumeCell) -> Mesh {
    TUBE.mesh(edge, cells, DEFAULT_CELL_LIMIT).expect("a tube is meshed")
}

#[test]
fn a_block_has_the_counts_asked_for() {
    let by_counts = block(Resolution::Counts([10, 5, 3]), VolumeCell::Hex);
    assert_eq!((by_counts.points.len(), by_counts.blocks[0].len()), (11 * 6 * 4, 150));
    assert_eq!(by_counts, block(Resolution::Edge(0.0101), VolumeCell::Hex));
    assert_eq!(block(Resolution::Edge(1.0), VolumeCell::Hex).blocks[0].len(), 1);
    assert_eq!(block(Resolution::Counts([10, 5, 3]), VolumeCell::Tet).blocks[0].len(), 900);
}

#[test]
fn a_block_has_its_exact_volume_in_right_handed_cells() {
    let exact: f64 = SIZE.iter().product();
    for counts in [[1, 1, 1], [2, 3, 4], [5, 2, 1]] {
        let hexes = block(Resolution::Counts(counts), VolumeCell::Hex);
        let (volume, least) = hex_volume(&hexes);
        assert!((volume / exact - 1.0).abs() < 1e-12 && least > 0.0);
        assert_eq!(euler_characteristic(&conforming_boundary(&hexes)), 2);
        let tets = block(Resolution::Counts(counts), VolumeCell::Tet);
        let volumes = tet_volumes(&tets);
        let each = exact / volumes.len() as f64;
        assert!(volumes.iter().all(|volume| (volume / each - 1.0).abs() < 1e-9));
        assert_eq!(euler_characteristic(&conforming_boundary(&tets)), 2);
    }
}

#[test]
fn a_block_starts_at_its_origin() {
    let (low, high) = block(Resolution::Edge(0.01), VolumeCell::Hex).bounds().expect("points");
    assert_eq!(low, Vector3::new(0.5, -0.2, 0.1));
    assert_eq!(high, low + Vector3::from(SIZE));
    let plain = Block::new(SIZE).mesh(Resolution::Edge(0.01), VolumeCell::Hex, DEFAULT_CELL_LIMIT);
    assert_eq!(plain.expect("a block is meshed").bounds(), Some((Vector3::zeros(), SIZE.into())));
}

#[test]
fn the_faces_of_a_block_are_named() {
    for cells in [VolumeCell::Hex, VolumeCell::Tet] {
        let mesh = block(Resolution::Counts([4, 3, 2]), cells);
        let (low, high) = mesh.bounds().expect("points");
        let names: Vec<&str> = mesh.point_sets.keys().map(String::as_str).collect();
        assert_eq!(names, ["x-max", "x-min", "y-max", "y-min", "z-max", "z-min"]);
        for (axis, name) in ["x", "y", "z"].into_iter().enumerate() {
            for (end, side) in [("min", low), ("max", high)] {
                let expected = points_where(&mesh, |point| (point[axis] - side[axis]).abs() < 1e-12);
                assert_eq!(mesh.point_sets[&format!("{name}-{end}")], expected);
            }
        }
    }
}

fn points_where(mesh: &Mesh, is: impl Fn(&Vector3) -> bool) -> Vec<u32> {
    (0..mesh.points.len() as u32).filter(|&point| is(&mesh.points[point as usize])).collect()
}

/// Todd's J1: with even counts, the mesh is its own mirror image along every axis.
#[test]
fn the_split_of_a_block_is_unbiased() {
    let mesh = Block::new([4.0, 2.0, 6.0])
        .mesh(Resolution::Counts([4, 2, 6]), VolumeCell::Tet, DEFAULT_CELL_LIMIT)
        .expect("a block is meshed");
    let cells = |mirror: Option<usize>| {
        let mut cells: Vec<[[i64; 3]; 4]> = tets(&mesh)
            .map(|tet| {
                let mut corners = tet.map(|corner| [0, 1, 2].map(|axis| corner[axis].round() as i64));
                if let Some(axis) = mirror {
                    corners.iter_mut().for_each(|corner| corner[axis] = [4, 2, 6][axis] - corner[axis]);
                }
                corners.sort_unstable();
                corners
            })
            .collect();
        cells.sort_unstable();
        cells
    };
    for axis in 0..3 {
        assert_eq!(cells(None), cells(Some(axis)));
    }
}

#[test]
fn a_tube_is_closed_right_handed_and_has_one_hole() {
    for (edge, cells) in [
        (0.004, VolumeCell::Hex),
        (0.004, VolumeCell::Tet),
        (0.0013, VolumeCell::Tet),
        (1.0, VolumeCell::Tet),
    ] {
        let mesh = tube(edge, cells);
        let boundary = conforming_boundary(&mesh);
        assert_eq!(euler_characteristic(&boundary), 0);
        assert!(edge_counts(&boundary).values().all(|&count| count == 2));
        match cells {
            VolumeCell::Hex => assert!(hex_volume(&mesh).1 > 0.0),
            VolumeCell::Tet => assert!(tet_volumes(&mesh).iter().all(|&volume| volume > 0.0)),
        }
    }
}

/// The cross section is a ring of regular polygons: area n/2 sin(2π/n) (R² − r²), error (2π/n)²/6.
#[test]
fn halving_the_edge_quarters_the_error_of_the_volume_of_a_tube() {
    let exact = PI * (0.015_f64.powi(2) - 0.01_f64.powi(2)) * 0.04;
    // 2π 12.5 mm divided into 20, 40 and 80.
    let edges = [20.0, 40.0, 80.0].map(|around| 2.0 * PI * 0.0125 / around);
    for cells in [VolumeCell::Hex, VolumeCell::Tet] {
        let error = edges.map(|edge| {
            let mesh = tube(edge, cells);
            let volume = if cells == VolumeCell::Hex { hex_volume(&mesh).0 } else { tet_volume(&mesh) };
            1.0 - volume / exact
        });
        assert!((error[0] - (2.0 * PI / 20.0_f64).powi(2) / 6.0).abs() < 1e-3);
        for pair in error.windows(2) {
            assert!((pair[0] / pair[1] - 4.0).abs() < 0.05, "{error:?}");
        }
    }
}

#[test]
fn the_faces_of_a_tube_are_named() {
    let mesh = tube(0.002, VolumeCell::Hex);
    assert_eq!(mesh.block(CellKind::Hex).map(|block| block.len() % 2), Some(0));
    let radius = |point: &Vector3| point.xy().norm();
    let expected = [
        ("inner", points_where(&mesh, |point| (radius(point) - 0.01).abs() < 1e-12)),
        ("outer", points_where(&mesh, |point| (radius(point) - 0.015).abs() < 1e-12)),
        ("z-max", points_where(&mesh, |point| point.z == 0.04)),
        ("z-min", points_where(&mesh, |point| point.z == 0.0)),
    ];
    assert_eq!(mesh.point_sets.len(), 4);
    for (name, points) in expected {
        assert!(!points.is_empty());
        assert_eq!(mesh.point_sets[name], points);
    }
}
