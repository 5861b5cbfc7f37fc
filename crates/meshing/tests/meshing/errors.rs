//! Every request that cannot be met gives a reason.

use pliant_geometry::Vector3;
use pliant_meshing::*;

fn unit_ball() -> Ellipsoid {
    Ellipsoid::sphere(Vector3::zeros(), 1.0)
}

fn stuffing(edge: f64) -> Result<FieldMesh, MeshingError> {
    Stuffing::new(edge).mesh(&unit_ball())
}

fn voxels(edge: f64) -> Result<FieldMesh, MeshingError> {
    Voxels::new(edge).mesh(&unit_ball())
}

fn block(size: [f64; 3], resolution: Resolution) -> Result<(), MeshingError> {
    Block::new(size).mesh(resolution, VolumeCell::Tet, DEFAULT_CELL_LIMIT).map(drop)
}

fn tube(inner_radius: f64, outer_radius: f64, length: f64, edge: f64) -> Result<(), MeshingError> {
    Tube { inner_radius, outer_radius, length }.mesh(edge, VolumeCell::Hex, DEFAULT_CELL_LIMIT).map(drop)
}

#[test]
fn lengths_must_be_positive_and_finite() {
    for bad in [0.0, -1.0, f64::NAN, f64::INFINITY] {
        let results = [
            stuffing(bad).map(drop),
            voxels(bad).map(drop),
            block([1.0, bad, 1.0], Resolution::Edge(0.5)),
            block([1.0; 3], Resolution::Edge(bad)),
            tube(bad, 1.0, 1.0, 0.5),
            tube(0.5, bad, 1.0, 0.5),
            tube(0.5, 1.0, bad, 0.5),
            tube(0.5, 1.0, 1.0, bad),
            Phantom::new(Organ::Liver, bad).map(drop),
        ];
        for result in results {
            assert!(matches!(result, Err(MeshingError::NotPositive { .. })), "{bad}: {result:?}");
        }
    }
    let message = block([1.0, -2.0, 1.0], Resolution::Edge(0.5)).unwrap_err().to_string();
    assert_eq!(message, "size along y is -2; it must be positive and finite");
}

#[test]
fn positions_must_be_finite() {
    let bad = Vector3::new(0.0, f64::NAN, 0.0);
    let stuffing = Stuffing { origin: Some(bad), ..Stuffing::new(0.1) }.mesh(&unit_ball()).map(drop);
    let block = Block { origin: bad, size: [1.0; 3] };
    let block = block.mesh(Resolution::Edge(0.5), VolumeCell::Hex, DEFAULT_CELL_LIMIT).map(drop);
    for result in [stuffing, block] {
        assert!(matches!(result, Err(MeshingError::NotFinite { what: "origin", .. })), "{result:?}");
    }
}

#[test]
fn a_block_needs_a_cell_along_every_axis() {
    let result = block([1.0; 3], Resolution::Counts([2, 0, 2]));
    assert_eq!(result, Err(MeshingError::NoCellsAlong { axis: 'y' }));
}

#[test]
fn a_tube_needs_a_wall() {
    assert_eq!(tube(0.2, 0.2, 1.0, 0.1), Err(MeshingError::NoWall { inner: 0.2, outer: 0.2 }));
    let message = tube(0.3, 0.2, 1.0, 0.1).unwrap_err().to_string();
    assert_eq!(message, "the inner radius 0.3 m must be below the outer radius 0.2 m");
}

#[test]
fn an_edge_longer_than_the_body_leaves_no_cells() {
    let size = Vector3::repeat(2.0);
    assert_eq!(stuffing(50.0), Err(MeshingError::NoCells { edge: 50.0, size }));
    let corner = Ellipsoid::sphere(Vector3::zeros(), 1.0);
    assert!(Voxels::new(50.0).mesh(&corner).is_ok(), "the one cube is centred on the ball");
    assert_eq!(Voxels::new(2.0).mesh(&Shell), Err(MeshingError::NoCells { edge: 2.0, size }));
    let message = stuffing(50.0).unwrap_err().to_string();
    assert_eq!(message, "no cell of edge 50 m fits the body, whose box is 2 × 2 × 2 m; use a shorter edge");
}

/// A hollow ball: its centre is outside.
struct Shell;

impl ImplicitField for Shell {
    fn value(&self, point: &Vector3) -> f64 {
        0.1 - (point.norm() - 0.9).abs()
    }

    fn bounds(&self) -> (Vector3, Vector3) {
        unit_ball().bounds()
    }
}

#[test]
fn too_many_cells_are_refused_with_their_number() {
    // 4/3 π × 10⁹ cubes; 12 tetrahedra in each.
    for (result, expected) in [(stuffing(1e-3), 12.0 * 4.18879e9), (voxels(1e-3), 4.18879e9)] {
        let Err(MeshingError::TooManyCells { estimate, limit }) = result else { panic!("{result:?}") };
        assert!((estimate as f64 / expected - 1.0).abs() < 0.01);
        assert_eq!(limit, DEFAULT_CELL_LIMIT);
    }
    let too_fine = MeshingError::TooManyCells { estimate: 48_000_000, limit: 6_000_000 };
    assert_eq!(
        block([1.0; 3], Resolution::Counts([200; 3])),
        Err(MeshingError::TooManyCells { limit: 5_000_000, estimate: 48_000_000 })
    );
    assert_eq!(
        too_fine.to_string(),
        "about 48000000 cells exceed the limit of 6000000; an edge 2 times as long would fit"
    );
    assert!(matches!(tube(0.1, 0.2, 1.0, 1e-4), Err(MeshingError::TooManyCells { .. })));
    for tiny in [1e-12, 1e-200, f64::MIN_POSITIVE] {
        for result in
            [stuffing(tiny).map(drop), voxels(tiny).map(drop), block([1.0; 3], Resolution::Edge(tiny))]
        {
            assert!(matches!(result, Err(MeshingError::TooManyCells { .. })), "{result:?}");
        }
    }
}

#[test]
fn the_limit_is_the_callers() {
    let few = Stuffing { cell_limit: 100, ..Stuffing::new(0.2) }.mesh(&unit_ball());
    assert!(matches!(few, Err(MeshingError::TooManyCells { limit: 100, .. })));
    let few = Voxels { cell_limit: 100, ..Voxels::new(0.2) }.mesh(&unit_ball());
    assert!(matches!(few, Err(MeshingError::TooManyCells { limit: 100, .. })));
    let few = Block::new([1.0; 3]).mesh(Resolution::Counts([5; 3]), VolumeCell::Hex, 124);
    assert_eq!(few, Err(MeshingError::TooManyCells { estimate: 125, limit: 124 }));
    assert!(Block::new([1.0; 3]).mesh(Resolution::Counts([5; 3]), VolumeCell::Hex, 125).is_ok());
}

/// A field with a box and a value of choice, away from a ball of radius ½.
struct Odd {
    half: f64,
    outside: f64,
}

impl ImplicitField for Odd {
    fn value(&self, point: &Vector3) -> f64 {
        let distance = 0.5 - point.norm();
        if distance > 0.0 { distance } else { self.outside }
    }

    fn bounds(&self) -> (Vector3, Vector3) {
        (Vector3::repeat(-self.half), Vector3::repeat(self.half))
    }
}

#[test]
fn a_field_that_breaks_its_promises_is_reported() {
    let meshes = |field: &Odd| [Stuffing::new(0.1).mesh(field), Voxels::new(0.1).mesh(field)];
    for half in [0.0, -1.0, f64::NAN, f64::INFINITY] {
        for result in meshes(&Odd { half, outside: -1.0 }) {
            assert!(matches!(result, Err(MeshingError::BadBox { .. })), "{half}: {result:?}");
        }
    }
    for outside in [f64::NAN, f64::INFINITY] {
        for result in meshes(&Odd { half: 1.0, outside }) {
            assert!(matches!(result, Err(MeshingError::FieldNotFinite { .. })), "{result:?}");
        }
    }
    let small_box = Stuffing::new(0.1).mesh(&Odd { half: 0.2, outside: -1.0 });
    assert!(matches!(small_box, Err(MeshingError::BodyLeavesBox { .. })));
}

/// A ball of 1 mm that claims a box of 1 km.
struct Lost;

impl ImplicitField for Lost {
    fn value(&self, point: &Vector3) -> f64 {
        1e-3 - (point - Vector3::repeat(1e-3)).norm()
    }

    fn bounds(&self) -> (Vector3, Vector3) {
        (Vector3::repeat(-500.0), Vector3::repeat(500.0))
    }
}

#[test]
fn a_box_far_too_large_is_refused_before_its_lattice_is_allocated() {
    for result in [Stuffing::new(1e-4).mesh(&Lost), Voxels::new(1e-4).mesh(&Lost)] {
        assert!(matches!(result, Err(MeshingError::LatticeTooLarge { .. })), "{result:?}");
    }
}
