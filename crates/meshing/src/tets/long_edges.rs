//! Edges longer than [`LONGEST`] times the local lattice constant are halved before the optimiser starts,
//! which makes none itself. Where cubes of two sizes meet, two corners of a large cube may each have small
//! cubes elsewhere. The edge between is then twice as long as either allows. Cuts along surfaces also shorten
//! the allowed length at their points.

use crate::input::surfaces::Surfaces;
use crate::tets::complex::{Complex, LONGEST};
use crate::tets::guard::Guard;

/// Most halvings of one edge; a halving makes shorter edges, so few are needed.
const PASSES: usize = 8;

/// Moving a new point onto its surface must leave its tets this part of the ideal acoustic length.
const LEAST_AFTER_MOVE: f64 = 0.2;

/// Largest distance of new points from their surface, in lattice constants.
const REACH: f64 = 0.5;

/// Halves edges that are too long, the longest relative to its limit first. New points between sides move
/// onto them. Returns the number of halved edges.
pub(crate) fn halve_long_edges(
    complex: &mut Complex,
    surfaces: &Surfaces<'_>,
    guard: &mut Option<Guard>,
) -> usize {
    let mut halved = 0;
    for _ in 0..PASSES {
        let part = |[p, q]: [u32; 2]| {
            let length = (complex.points[p as usize] - complex.points[q as usize]).norm();
            LONGEST * length / complex.longest(p, q)
        };
        let edges = complex.edges().into_iter().filter(|&[p, q]| complex.is_too_long(p, q));
        let mut long: Vec<(f64, [u32; 2])> = edges.map(|edge| (part(edge), edge)).collect();
        if long.is_empty() {
            break;
        }
        long.sort_by(|a, b| b.0.total_cmp(&a.0).then(a.1.cmp(&b.1)));
        halved += long.len();
        for (_, edge) in long {
            halve(complex, edge, surfaces, guard);
        }
    }
    halved
}

fn halve(complex: &mut Complex, [p, q]: [u32; 2], surfaces: &Surfaces<'_>, guard: &mut Option<Guard>) {
    let middle = 0.5 * (complex.points[p as usize] + complex.points[q as usize]);
    let number = complex.bisect([p, q], middle);
    let new = number as usize;
    if let Some(guard) = guard {
        guard.note(complex, &[number, p, q]);
    }
    let sides = complex.sides[new];
    if sides.count_ones() < 2 {
        return;
    }
    if let Some((place, _)) = surfaces.project(sides, &middle, REACH * complex.size[new])
        && guard.as_ref().is_none_or(|guard| guard.lets_move(complex, number, &place))
    {
        complex.points[new] = place;
        let bears = complex.star[new].iter().all(|&tet| complex.part(tet) > LEAST_AFTER_MOVE);
        if !bears {
            complex.points[new] = middle;
        }
        if let Some(guard) = guard {
            guard.note(complex, &[number]);
        }
    }
}
