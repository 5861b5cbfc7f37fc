//! Sharp edges of a surface, which its shells keep: nodes stay on them, and have no normals there.
//! Leaves out: sharp edges that bend, between nodes: shells leave them straight.

use pliant_geometry::DisjointSets;

use super::ShellGoal;
use crate::surface::triangles::TriangleMesh;

/// Faces that meet at more than this angle [rad] make a sharp edge: the angle at which shells without given
/// normals have creases.
const SHARP: f64 = std::f64::consts::FRAC_PI_4;

/// Least length of connected sharp edges, over the diagonal. Shorter ones are noise.
const LEAST_LENGTH: f64 = 0.05;

/// The faces along sharp edges also meet other neighbours. The mean of the angles there is at most this part
/// of the mean at the sharp edges. At thin edges of organs triangles turn step by step; such edges are round.
const BESIDE: f64 = 0.25;

/// Largest part of the surface that is nearer to sharp edges than the requested error. Steps of voxels take a
/// larger part, and are not sharp edges.
const MOST_NEAR: f64 = 0.1;

/// The error that stands for a number of shells, over their edges.
const ERROR: f64 = 0.05;

/// A surface with its sharp edges marked as creases; `None` without any.
pub(super) fn with_sharp_edges(surface: &TriangleMesh, goal: ShellGoal) -> Option<TriangleMesh> {
    let mut marked = surface.clone();
    marked.mark_creases(SHARP);
    let edges: Vec<[u32; 2]> = marked.creases().collect();
    let length = |&[a, b]: &[u32; 2]| (marked.points[a as usize] - marked.points[b as usize]).norm();
    let mut chains = DisjointSets::new(marked.points.len());
    edges.iter().for_each(|&[a, b]| chains.join(a as usize, b as usize));
    let mut lengths = vec![0.0; marked.points.len()];
    for edge in &edges {
        lengths[chains.root(edge[0] as usize)] += length(edge);
    }
    let diagonal = surface.diagonal();
    let turns = turns_of_chains(&marked, &edges, &mut chains);
    let counts = |edge: &[u32; 2]| {
        let chain = chains.root(edge[0] as usize);
        lengths[chain] >= LEAST_LENGTH * diagonal && turns[chain][1] <= BESIDE * turns[chain][0]
    };
    let long: Vec<[u32; 2]> = edges.into_iter().filter(counts).collect();
    let area: f64 = surface.alive().map(|t| surface.area(t)).sum();
    let error = match goal {
        ShellGoal::Error(error) => error * diagonal,
        ShellGoal::Shells(number) => ERROR * (area / number as f64).sqrt(),
    };
    let near = 2.0 * error * long.iter().map(length).sum::<f64>();
    if long.is_empty() || near > MOST_NEAR * area {
        return None;
    }
    marked.set_creases(long);
    Some(marked)
}

/// The mean angles [rad] at the sharp edges of each chain and at the other edges of their faces. The first
/// point of the chain is the index.
fn turns_of_chains(marked: &TriangleMesh, edges: &[[u32; 2]], chains: &mut DisjointSets) -> Vec<[f64; 2]> {
    let turn = |[a, b]: [u32; 2]| match marked.sides(a, b) {
        [Some(s), Some(t)] => marked.normal(s).angle(&marked.normal(t)),
        _ => 0.0,
    };
    let mut sums = vec![[[0.0_f64; 2]; 2]; marked.points.len()];
    let mut add = |at: usize, kind: usize, angle: f64| {
        let [sum, count] = &mut sums[at][kind];
        (*sum, *count) = (*sum + angle, *count + 1.0);
    };
    for &[a, b] in edges {
        let at = chains.root(a as usize);
        add(at, 0, turn([a, b]));
        for side in marked.sides(a, b).into_iter().flatten() {
            let c = marked.opposite(side, a, b);
            let others = [[a, c], [b, c]].into_iter().filter(|&[p, q]| !marked.is_marked(p, q));
            others.for_each(|other| add(at, 1, turn(other)));
        }
    }
    sums.into_iter().map(|kinds| kinds.map(|[sum, count]| sum / count.max(1.0))).collect()
}

#[cfg(test)]
mod tests {
    use pliant_geometry::{CellKind, Mesh, Vector3};

    use super::super::FittedShells;
    use super::*;
    use crate::sphere;

    fn surface(points: Vec<Vector3>, triangles: Vec<[u32; 3]>) -> TriangleMesh {
        let mut mesh = Mesh { points, ..Mesh::default() };
        mesh.block_mut(CellKind::Triangle).nodes = triangles.into_flattened();
        TriangleMesh::from_mesh(&mesh).unwrap().0
    }

    /// Builds a closed prism, 60 mm high and with corners at a radius of 30 mm. Its sides are divided into
    /// layers.
    fn prism(sides: u32, layers: u32) -> TriangleMesh {
        let corner = |k: u32, layer: u32| {
            let angle = f64::from(k) / f64::from(sides) * std::f64::consts::TAU;
            Vector3::new(0.03 * angle.cos(), 0.03 * angle.sin(), 0.06 * f64::from(layer) / f64::from(layers))
        };
        let mut points: Vec<Vector3> =
            (0..=layers).flat_map(|layer| (0..sides).map(move |k| corner(k, layer))).collect();
        points.extend([Vector3::zeros(), Vector3::new(0.0, 0.0, 0.06)]);
        let (bottom, top) = ((layers + 1) * sides, (layers + 1) * sides + 1);
        let mut triangles = Vec::new();
        for k in 0..sides {
            let next = (k + 1) % sides;
            for layer in 0..layers {
                let [a, b, c, d] = [k, next, next + sides, k + sides].map(|node| node + layer * sides);
                triangles.extend([[a, b, c], [a, c, d]]);
            }
            triangles.extend([[next, k, bottom], [k + layers * sides, next + layers * sides, top]]);
        }
        surface(points, triangles)
    }

    fn fitted(mesh: &TriangleMesh, goal: ShellGoal) -> FittedShells {
        let fitted = FittedShells::new(mesh, goal, &|_| {}).unwrap();
        println!("{}", fitted.report);
        fitted
    }

    /// A prism of four sides is a box: its shells are flat without further measures, and its corners stay.
    #[test]
    fn a_box_stays_a_box() {
        let report = fitted(&prism(4, 1), ShellGoal::Error(0.002)).report;
        assert!(report.reached && report.distances.largest() < 1e-12, "{report}");
        assert!(report.sharp >= 8 && report.creases.count + report.flattened.count == 0, "{report}");
    }

    /// The rims of a cylinder keep nodes on them, and its side is as near as chords of the rims.
    #[test]
    fn a_cylinder_keeps_its_rims() {
        let fitted = fitted(&prism(180, 40), ShellGoal::Error(0.004));
        let report = &fitted.report;
        assert!(report.reached && report.sharp >= 40 && report.crossings.count == 0, "{report}");
        let normals = &fitted.mesh.point_data["normal"];
        for (node, x) in fitted.mesh.points.iter().enumerate() {
            let has_normal = normals.item(node).iter().any(|&x| x != 0.0);
            let on_rim = (x.xy().norm() - 0.03).abs() < 1e-4 && (x.z < 1e-4 || x.z > 0.06 - 1e-4);
            assert_eq!(has_normal, !on_rim, "{x}");
        }
    }

    /// Steps of voxels and smooth surfaces have no sharp edges.
    #[test]
    fn smooth_surfaces_have_none() {
        let (ball, _) =
            TriangleMesh::from_mesh(&sphere(0.05, 3, crate::DEFAULT_CELL_LIMIT).unwrap()).unwrap();
        assert!(with_sharp_edges(&ball, ShellGoal::Error(0.002)).is_none());
        assert!(with_sharp_edges(&prism(4, 1), ShellGoal::Error(0.05)).is_none());
    }
}
