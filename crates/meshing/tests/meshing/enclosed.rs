//! Bodies of closed surfaces: distances, volumes, repairs, rejections.

use pliant_geometry::{CellKind, Mesh, Vector3};
use pliant_meshing::{
    Closing, DEFAULT_CELL_LIMIT, Enclosed, EnclosedReport, MeshingError, OrganTets, sphere,
};

/// A ball of triangles of about a tenth of its radius, moved along x.
fn ball(radius: f64, x: f64) -> Mesh {
    let mut mesh = sphere(radius, 4, DEFAULT_CELL_LIMIT).expect("a sphere");
    mesh.points.iter_mut().for_each(|point| point.x += x);
    mesh
}

fn triangles(mesh: &mut Mesh) -> &mut Vec<u32> {
    &mut mesh.block_mut(CellKind::Triangle).nodes
}

/// Two surfaces in one mesh; optionally the second is inverted.
fn both(mut first: Mesh, mut second: Mesh, turned: bool) -> Mesh {
    let offset = first.points.len() as u32;
    let nodes = std::mem::take(triangles(&mut second));
    let nodes = nodes.chunks(3).flat_map(|n| if turned { [n[0], n[2], n[1]] } else { [n[0], n[1], n[2]] });
    triangles(&mut first).extend(nodes.map(|n| n + offset));
    first.points.extend(second.points);
    first
}

fn enclosed(mesh: &Mesh) -> Enclosed {
    Enclosed::new(mesh, 0.004, &Closing::default()).expect("a closed surface")
}

fn ball_volume(radius: f64) -> f64 {
    4.0 / 3.0 * std::f64::consts::PI * radius.powi(3)
}

/// Distances of a ball are R − r, up to two errors: the sagitta of its triangles, and the curvature between
/// grid points. The second is h²/4R = 0.01 mm for h = 1 mm.
#[test]
fn the_field_of_a_ball_is_the_distance_to_it() {
    let body = enclosed(&ball(0.03, 0.01));
    let field = body.field(0.004, &|_| {}).expect("a field");
    for depth in [-3.5_f64, -2.5, -0.5, 0.0, 0.7, 3.0, 6.0] {
        for way in [[1.0, 0.0, 0.0], [0.6, -0.48, 0.64], [-0.28, 0.0, 0.96]] {
            let point = Vector3::new(0.01, 0.0, 0.0) + (0.03 - depth * 1e-3) * Vector3::from(way);
            assert!((field.value(&point) - depth * 1e-3).abs() < 6e-5, "{depth} mm: {}", field.value(&point));
        }
    }
    assert_eq!(body.report, EnclosedReport { triangles: 5120, shells: 1, ..EnclosedReport::default() });
    // A facetted ball lacks about 5 of 1000 parts of the volume.
    assert!((body.volume() / ball_volume(0.03) - 1.0).abs() < 0.006);
}

#[test]
fn an_inverted_ball_is_turned_and_a_cavity_is_kept() {
    let mut inverted = ball(0.03, 0.0);
    triangles(&mut inverted).chunks_exact_mut(3).for_each(|nodes| nodes.swap(0, 1));
    let body = enclosed(&inverted);
    assert_eq!(body.report.repairs.turned_faces, 5120);
    assert!(body.volume() > 0.0);

    let hollow = enclosed(&both(ball(0.03, 0.0), ball(0.015, 0.0), true));
    assert_eq!((hollow.report.shells, hollow.report.cavities, hollow.report.repairs.turned_faces), (2, 1, 0));
    let field = hollow.field(0.004, &|_| {}).expect("a field");
    for (x, depth) in [(0.02, 5e-3), (0.013, -2e-3), (0.0, -8e-3)] {
        let value = field.value(&Vector3::new(x, 0.0, 0.0));
        // Beyond twice the edge distances are cut.
        assert!((value - depth).abs() < 2e-4, "{x}: {value}");
    }
    // Inside out as a whole: both turned.
    let mut whole = both(ball(0.03, 0.0), ball(0.015, 0.0), true);
    triangles(&mut whole).chunks_exact_mut(3).for_each(|nodes| nodes.swap(0, 1));
    let report = enclosed(&whole).report;
    assert_eq!((report.cavities, report.repairs.turned_faces), (1, 10240));

    let filled = Closing { fill_cavities: true, ..Closing::default() };
    let filled = Enclosed::new(&whole, 0.004, &filled).expect("a closed surface");
    assert_eq!((filled.report.filled_cavities, filled.report.shells), (1, 1));
}

/// Balls that overlap: the body is their union, without the walls within. Lens of two balls of radius R at
/// distance d: π (2R − d)² (d² + 4dR) / 12d.
#[test]
fn overlapping_balls_are_joined() {
    let (radius, apart) = (0.03_f64, 0.03_f64);
    let body = enclosed(&both(ball(radius, 0.0), ball(radius, apart), false));
    assert!(body.report.crossings > 50, "{:?}", body.report);
    let [x, y, z] = body.report.first_crossing.expect("a place");
    // They meet in the plane half way.
    assert!((x - apart / 2.0).abs() < 1e-3 && (y.hypot(z) - 0.026).abs() < 1e-3, "{x} {y} {z}");
    let field = body.field(0.004, &|_| {}).expect("a field");
    assert!((field.value(&Vector3::new(apart / 2.0, 0.0, 0.0)) - 8e-3).abs() < 1e-4);
    let lens = std::f64::consts::PI * (2.0 * radius - apart).powi(2) * (apart * apart + 4.0 * apart * radius)
        / (12.0 * apart);
    let expected = 2.0 * ball_volume(radius) - lens;
    assert!((field.volume() / expected - 1.0).abs() < 0.01, "{} {expected}", field.volume());

    // A ball inside a ball with the same orientation adds nothing.
    let swallowed = enclosed(&both(ball(0.03, 0.0), ball(0.015, 0.0), false));
    assert_eq!((swallowed.report.swallowed_shells, swallowed.report.cavities), (1, 0));
    let field = swallowed.field(0.004, &|_| {}).expect("a field");
    assert!((field.volume() / ball_volume(0.03) - 1.0).abs() < 0.01);
}

#[test]
fn narrow_holes_are_closed_and_wide_ones_refused() {
    let mut open = ball(0.03, 0.0);
    // The six triangles round a point: edges of 2.4 mm.
    let at = 100;
    let nodes = std::mem::take(triangles(&mut open));
    let without = |gone: u32| nodes.chunks(3).filter(move |n| !n.contains(&gone)).flatten().copied();
    *triangles(&mut open) = without(at).collect();
    let body = Enclosed::new(&open, 0.008, &Closing::default()).expect("a hole narrower than the cells");
    assert_eq!((body.report.closed_holes, body.report.closed_edges), (1, 6));
    assert!((body.volume() / ball_volume(0.03) - 1.0).abs() < 0.01);
    match Enclosed::new(&open, 0.004, &Closing::default()) {
        Err(MeshingError::OpenSurface { holes: 1, edges: 6, place, .. }) => {
            assert!((place - open.points[at as usize]).norm() < 1e-3)
        }
        other => panic!("{other:?}"),
    }
    let wider = Closing { holes: 0.02, ..Closing::default() };
    assert!(Enclosed::new(&open, 0.004, &wider).is_ok());
}

/// Two cubes that share an edge: four faces at it, and yet closed.
#[test]
fn bodies_that_touch_along_an_edge_are_closed() {
    let cube = |at: f64| {
        let corner =
            |n: usize| Vector3::new((n & 1) as f64 + at, (n >> 1 & 1) as f64 + at, (n >> 2) as f64) * 0.02;
        let mut mesh = Mesh { points: (0..8).map(corner).collect(), ..Mesh::default() };
        mesh.block_mut(CellKind::Quad).nodes =
            [[0, 2, 3, 1], [4, 5, 7, 6], [0, 1, 5, 4], [2, 6, 7, 3], [0, 4, 6, 2], [1, 3, 7, 5]].concat();
        mesh
    };
    let mut mesh = cube(0.0);
    let other = cube(1.0);
    mesh.block_mut(CellKind::Quad).nodes.extend(other.blocks[0].nodes.iter().map(|n| n + 8));
    mesh.points.extend(other.points);
    let body = enclosed(&mesh);
    assert_eq!((body.report.repairs.joined_points, body.report.repairs.cut_edges), (2, 1));
    assert!((body.volume() - 2.0 * 8e-6).abs() < 1e-12 && body.is_simple());

    let largest = Closing { keep_largest: true, ..Closing::default() };
    let two = both(ball(0.03, 0.0), ball(0.01, 0.1), false);
    let kept = Enclosed::new(&two, 0.004, &largest).expect("a closed surface");
    assert_eq!((kept.report.dropped_pieces, kept.report.shells), (1, 1));
}

#[test]
fn a_flat_surface_encloses_nothing() {
    let mut flat = Mesh {
        points: [[0., 0., 0.], [1., 0., 0.], [0., 1., 0.]].map(Vector3::from).into(),
        ..Mesh::default()
    };
    triangles(&mut flat).extend([0, 1, 2]);
    assert!(matches!(Enclosed::new(&flat, 9.0, &Closing::default()), Err(MeshingError::NothingEnclosed)));
    assert!(matches!(
        Enclosed::new(&flat, 0.1, &Closing::default()),
        Err(MeshingError::OpenSurface { holes: 1, edges: 3, .. })
    ));
}

/// Tets have the volume of the surface within a part in a thousand, and large steps.
#[test]
fn a_closed_surface_becomes_tets_of_its_volume() {
    let body = enclosed(&ball(0.03, 0.0));
    let anatomy = body.anatomy(7, 0.008, &|_| {}).expect("a field");
    let made = OrganTets::new(0.008).mesh(&anatomy, &|_| {}).expect("a mesh");
    let material = made.report.materials[0];
    assert_eq!(material.label, 7);
    assert!((material.volume / body.volume() - 1.0).abs() < 2e-3, "{material:?}");
    assert!(made.report.acoustic_part > 0.7, "{}", made.report.acoustic_part);
}
