//! Brain shift on an ellipsoid: half axes 80, 65 and 60 mm about the origin, held by the skull below z = −12 mm, pressed
//! inwards where it is opened around the axis n, free elsewhere. E = 3000 Pa, ν = 0.49.

use pliant_geometry::{CellKind, DataArray, Mesh, Vector3, boundary, relative_acoustic_length};
use pliant_mechanics::curve::{Curve, Shape};
use pliant_mechanics::model::{Constraint, Motion};
use pliant_meshing::{Ellipsoid, Stuffing};
use serde_json::json;

use crate::{Hexes, Specimen, Tets, elastic, law};

/// Half axes [m].
const RADII: [f64; 3] = [0.08, 0.065, 0.06];
/// The axis of the opening: the unit vector along (0.3, 0.4, √3/2).
const AXIS: [f64; 3] = [0.3, 0.4, 0.866_025_403_784_438_6];
/// Height of the ellipsoid along the axis [m], √(Σ a²n²).
const HEIGHT: f64 = 0.062_864_934_582_006_83;
/// Depth [m] to which the middle of the opening is pressed.
const DEPTH: f64 = 0.01;
/// Height of the border of the opening over that of the ellipsoid.
const OPENING: f64 = 0.88;
/// The skull holds what is below this z [m].
const SKULL: f64 = -0.012;
/// Slack of the borders of both regions, as a part of the height: the mesh of the reference has its nodes on them.
const SLACK: f64 = 1e-9;

/// Edge [m] of the tets of [`mesh`].
const EDGE: f64 = 0.0122;

/// Least [`quality`] of a tet to which a border may press it.
const WORST: f64 = 0.4;

/// The mesh of `scenes/brain-shift`: about 2,000 nodes, with its regions (see [`with_regions`]) and nodes along their
/// borders.
pub fn mesh() -> Mesh {
    stuffed(EDGE)
}

/// The same with tets of another edge [m].
///
/// # Panics
/// If the edge is too large or too small to mesh the ellipsoid.
pub fn stuffed(edge: f64) -> Mesh {
    let ellipsoid = Ellipsoid { centre: Vector3::zeros(), radii: Vector3::from(RADII) };
    let made = Stuffing::new(edge).mesh(&ellipsoid);
    let mut mesh = made.unwrap_or_else(|error| panic!("{error}")).mesh;
    draw_border(&mut mesh, &Vector3::z(), SKULL);
    draw_border(&mut mesh, &Vector3::from(AXIS), OPENING * HEIGHT);
    with_regions(mesh)
}

/// Moves surface nodes along the surface onto the border n·X = height [m]: of each edge of the surface that it cuts, the
/// nearer end that spoils no tet around it (see [`WORST`]). On the unit sphere x/a, y/b, z/c the border is a circle.
fn draw_border(mesh: &mut Mesh, normal: &Vector3, height: f64) {
    let radii = Vector3::from(RADII);
    let axis = normal.component_mul(&radii);
    let (axis, height) = (axis.normalize(), height / axis.norm());
    let above = |point: &Vector3| axis.dot(&point.component_div(&radii)) - height;
    let drawn = |point: &Vector3| {
        let unit = point.component_div(&radii);
        let around = (unit - axis * axis.dot(&unit)).normalize();
        (axis * height + around * (1.0 - height * height).sqrt()).component_mul(&radii)
    };
    let mut around = vec![Vec::new(); mesh.points.len()];
    for tet in mesh.volume_blocks().flat_map(|block| block.cells()) {
        tet.iter().for_each(|&node| around[node as usize].push([tet[0], tet[1], tet[2], tet[3]]));
    }
    for face in boundary(mesh).faces {
        let nodes = face.nodes();
        for (k, &start) in nodes.iter().enumerate() {
            let mut ends =
                [start, nodes[(k + 1) % nodes.len()]].map(|node| (node, above(&mesh.points[node as usize])));
            if ends[0].1 * ends[1].1 >= -SLACK * SLACK {
                continue;
            }
            ends.sort_by(|a, b| a.1.abs().total_cmp(&b.1.abs()));
            for (node, _) in ends {
                let before = mesh.points[node as usize];
                mesh.points[node as usize] = drawn(&before);
                if around[node as usize].iter().all(|tet| quality(mesh, tet) >= WORST) {
                    break;
                }
                mesh.points[node as usize] = before;
            }
        }
    }
}

/// 1 of a regular tet, 0 of a flat one, negative of an inverted one.
fn quality(mesh: &Mesh, tet: &[u32; 4]) -> f64 {
    relative_acoustic_length(CellKind::Tet, &tet.map(|node| mesh.points[node as usize]))
}

/// Adds the sets `skull` and `opening` of surface nodes and the point data `shift`, the displacement of the opening [m]:
/// −10 mm s² (3 − 2s) n with s = (n·X/H − 0.88)/(1 − 0.88), where s ≥ 0.
pub fn with_regions(mut mesh: Mesh) -> Mesh {
    let surface = boundary(&mesh).nodes();
    let s = |point: &Vector3| (point.dot(&Vector3::from(AXIS)) / HEIGHT - OPENING) / (1.0 - OPENING);
    let among = |wanted: &dyn Fn(&Vector3) -> bool| -> Vec<u32> {
        surface.iter().copied().filter(|&node| wanted(&mesh.points[node as usize])).collect()
    };
    let skull = among(&|point| point.z <= SKULL + SLACK);
    let opening = among(&|point| s(point) >= -SLACK);
    let mut shift = vec![0.0; 3 * mesh.points.len()];
    for &node in &opening {
        let s = s(&mesh.points[node as usize]).max(0.0);
        for (c, n) in AXIS.iter().enumerate() {
            shift[3 * node as usize + c] = -DEPTH * s * s * (3.0 - 2.0 * s) * n;
        }
    }
    mesh.point_sets.insert("skull".into(), skull);
    mesh.point_sets.insert("opening".into(), opening);
    mesh.point_data.insert("shift".into(), DataArray { components: 3, values: shift });
    mesh
}

/// The brain of a mesh with its regions, shifted at 1 s.
pub fn brain(mesh: Mesh, tets: Tets) -> Specimen {
    let tissue = law("neo-hookean", json!({ "young-modulus": 3000.0, "poisson-ratio": 0.49 }));
    let mut brain = Specimen::of_elements(mesh, tets, Hexes::Full, &elastic(tissue), [0.0; 3]);
    let shift = &brain.mesh.point_data["shift"];
    let opening = &brain.mesh.point_sets["opening"];
    let by = opening.iter().map(|&node| [0, 1, 2].map(|c| shift.item(node as usize)[c])).collect();
    let motion = Motion::Displacements(by, Curve { shape: Shape::SmoothStep, from: 0.0, to: 1.0 });
    for (name, motion) in [("skull", Motion::Fixed), ("opening", motion)] {
        let nodes = brain.mesh.point_sets[name].clone();
        brain.model.constraints.push(Constraint { name: name.into(), nodes, components: [true; 3], motion });
    }
    brain
}
