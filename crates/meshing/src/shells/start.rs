//! Flat triangles that a fit starts from. Few are best, as long as they have all parts of the surface. If a
//! part such as a vessel is lost, the fit has to pull it out again, and shells may cross on the way. A fit
//! that fails starts again from finer triangles. Leaves out: whether a part is lost where it is not farther
//! off than half an edge.

use rayon::prelude::*;

use super::ShellGoal;
use super::target::Target;
use crate::report::hausdorff::{distance, locator};
use crate::surface::triangles::TriangleMesh;

/// Shells to start from if an error is requested.
const START: usize = 100;

/// Most doublings of their number.
const DOUBLINGS: u32 = 7;

/// Parts are lost where a point of the target is farther from the flat triangles than this part of their mean
/// edge.
const LOST: f64 = 0.5;

/// Largest distances of finer triangles from the target, over the requested error. They apply after a failed
/// fit, and in place of triangles that have lost parts. The second is smaller, as the fit hardly improves
/// parts that are narrow for their shells.
const FINER: f64 = 1.5;
const WHOLE: f64 = 1.2;

/// Number of triangles from which on down collapses that make triangles cross are refused at first. Among
/// more triangles the check takes longer than all else. It is then left to surfaces whose shells cross
/// otherwise.
pub(super) const UNCROSSED: usize = 20_000;

/// Triangles that a fit starts from.
pub(super) struct Starts {
    pub(super) first: TriangleMesh,
    /// Triangles for a second fit if the first fails.
    pub(super) finer: Option<TriangleMesh>,
    /// True if even the first triangles have lost parts. A fit does not bring them back.
    pub(super) is_lost: bool,
}

impl Starts {
    /// Makes the triangles from the surface of a target. From `uncrossed` triangles down, collapses do not
    /// make them cross.
    pub(super) fn new(mesh: &TriangleMesh, goal: ShellGoal, target: &Target, uncrossed: usize) -> Self {
        let (numbers, aim) = match goal {
            ShellGoal::Error(error) => {
                let doubled = (1..=DOUBLINGS).map(|k| START << k).filter(|&number| number < mesh.len());
                (std::iter::once(START).chain(doubled).collect(), error * target.diagonal)
            }
            ShellGoal::Shells(number) => (vec![number.div_ceil(2), number], 0.0),
        };
        let decreasing: Vec<usize> = numbers.into_iter().rev().collect();
        let mut stages = mesh.clone().decimated_to_each(&decreasing, uncrossed);
        let first = stages.pop().unwrap_or_else(|| mesh.clone());
        let far = farthest(&first, target);
        let is_lost = |mesh: &TriangleMesh, far: f64| far > LOST * mean_edge(mesh);
        let lost = is_lost(&first, far);
        let near = if lost { WHOLE } else { FINER } * aim;
        let mut finer = None;
        let mut off = far;
        while off > near
            && let Some(next) = stages.pop()
        {
            off = farthest(&next, target);
            finer = Some(next);
        }
        match finer {
            Some(finer) if lost => Self { is_lost: is_lost(&finer, off), first: finer, finer: None },
            finer => Self { first, finer, is_lost: false },
        }
    }
}

/// The largest distance of a point of the target from flat triangles [m].
fn farthest(mesh: &TriangleMesh, target: &Target) -> f64 {
    let locator = locator(mesh);
    let far = target.coarse.samples.par_iter().map(|sample| distance(&locator, &sample.point));
    far.reduce(|| 0.0, f64::max)
}

/// The edge of equilateral triangles of the same number and area [m].
fn mean_edge(mesh: &TriangleMesh) -> f64 {
    let area: f64 = mesh.alive().map(|t| mesh.area(t)).sum();
    (4.0 * area / (3.0_f64.sqrt() * mesh.len().max(1) as f64)).sqrt()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::{DEFAULT_CELL_LIMIT, Ellipsoid, ImplicitField};
    use pliant_geometry::Vector3;

    /// A ball of 10 mm with rods 3 mm thick along the directions of a dodecahedron's corners, to 30 mm.
    struct Urchin;

    impl ImplicitField for Urchin {
        fn value(&self, x: &Vector3) -> f64 {
            let golden = 0.5 * (1.0 + 5.0_f64.sqrt());
            let signs = [-1.0, 1.0];
            let corners = signs.into_iter().flat_map(|a| signs.map(|b| (a, b))).flat_map(|(a, b)| {
                let (p, q) = (a / golden, b * golden);
                [[a, b, 1.0], [a, b, -1.0], [0.0, p, q], [p, q, 0.0], [q, 0.0, p]]
            });
            let rod = |way: [f64; 3]| {
                let way = Vector3::from(way).normalize();
                0.0015 - (x - way * x.dot(&way).clamp(0.0, 0.03)).norm()
            };
            corners.map(rod).fold(0.01 - x.norm(), f64::max)
        }

        fn bounds(&self) -> (Vector3, Vector3) {
            (Vector3::repeat(-0.033), Vector3::repeat(0.033))
        }
    }

    /// A hundred triangles hold a ball but not twenty rods. So the fit starts from triangles that have them
    /// all.
    #[test]
    fn few_triangles_start_where_no_part_is_lost() {
        let starts = |field: &dyn ImplicitField, error: f64| {
            let mesh = TriangleMesh::of_field(field, 0.0012, DEFAULT_CELL_LIMIT).unwrap();
            let target = Target::new(&mesh);
            let starts = Starts::new(&mesh, ShellGoal::Error(error), &target, UNCROSSED);
            let far = farthest(starts.finer.as_ref().unwrap_or(&starts.first), &target);
            assert!(far <= FINER * error * target.diagonal, "{far}");
            starts
        };
        let ball = starts(&Ellipsoid::sphere(Vector3::zeros(), 0.02), 0.002);
        assert_eq!(ball.first.len(), START);
        assert!(ball.finer.unwrap().len() > START);
        let urchin = starts(&Urchin, 0.01);
        assert!(urchin.first.len() > 2 * START && urchin.finer.is_none(), "{}", urchin.first.len());
    }
}
