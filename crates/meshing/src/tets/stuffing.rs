//! Tetrahedra in the body of a field by isosurface stuffing, after Labelle and Shewchuk (2007). A
//! body-centred cubic lattice is warped so that no cut is too near a lattice point, then cut along the
//! surface. Five steps: lattice, cut points, warp, stencils (`stencil.rs`), largest component
//! (`topology.rs`). Two things differ from the paper. All points are warped at once, so their order does not
//! matter. The diagonals of `stencil.rs` favour the time step, so the paper's bound of 10.8° on dihedral
//! angles does not hold. The smallest observed is 8.2° (brain at 5 mm; example `measure`). Leaves out:
//! grading; the later steps of `organ.rs` (optimisation, materials, repair of non-manifold edges).

use pliant_geometry::{CellKind, Vector3};
use rayon::prelude::*;

use crate::error::{MeshingError, require_at_most, require_finite, require_positive};
use crate::input::extent::{TETS_PER_CUBE, allowed, checked_box, require_room};
use crate::input::field::ImplicitField;
use crate::tets::lattice::{DIRECTIONS, Lattice, Triple, is_long, tets_from};
use crate::tets::stencil::{Corner, stencil};
use crate::tets::topology::{large_components, largest_component};
use crate::{DEFAULT_CELL_LIMIT, FieldMesh};

/// A cut nearer to the end of a long edge than this fraction of the edge warps that end onto the surface.
const ALPHA_LONG: f64 = 0.24999;

/// The corresponding fraction for short edges.
const ALPHA_SHORT: f64 = 0.41189;

/// Bisections of an edge to find its cut: to 6e-8 of its length.
const BISECTIONS: u32 = 24;

/// Marks a lattice point that was not warped.
const UNMOVED: u32 = u32::MAX;

/// A request for tetrahedra by isosurface stuffing.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Stuffing {
    /// Lattice constant [m]: the long edges of the inner tetrahedra; the short edges are √3/2 times as long.
    pub edge: f64,
    /// A lattice point [m]; the centre of the box of the body if `None`.
    pub origin: Option<Vector3>,
    /// Most cells allowed.
    pub cell_limit: usize,
}

impl Stuffing {
    /// Lattice constant `edge` [m], centred on the box of the body, with the default limit on cells.
    pub fn new(edge: f64) -> Self {
        Self { edge, origin: None, cell_limit: DEFAULT_CELL_LIMIT }
    }

    /// Fills the body of the field with tetrahedra. The result does not depend on the number of threads.
    pub fn mesh(&self, field: &(impl ImplicitField + ?Sized)) -> Result<FieldMesh, MeshingError> {
        let (warped, tets) = self.fill(field)?;
        Ok(largest_component(CellKind::Tet, &tets, |node| warped.position(node)))
    }

    /// Fills the body and keeps all components with at least the part `smallest` of the cells of the largest
    /// one. The result also counts the cells and components left out.
    pub(crate) fn parts(
        &self,
        field: &(impl ImplicitField + ?Sized),
        smallest: f64,
    ) -> Result<FieldMesh, MeshingError> {
        let (warped, tets) = self.fill(field)?;
        Ok(large_components(CellKind::Tet, &tets, smallest, |node| warped.position(node)))
    }

    /// The tetrahedra, before any is left out.
    fn fill(&self, field: &(impl ImplicitField + ?Sized)) -> Result<(Warped, Vec<u32>), MeshingError> {
        let lattice = self.lattice(field)?;
        let sign = signs(&lattice, field)?;
        let warped = Warped::new(lattice, sign, field);
        let tets = warped.fill();
        if tets.is_empty() {
            let (low, high) = field.bounds();
            return Err(MeshingError::NoCells { edge: self.edge, size: high - low });
        }
        require_at_most((tets.len() / 4) as f64, allowed(self.cell_limit))?;
        Ok((warped, tets))
    }

    fn lattice(&self, field: &(impl ImplicitField + ?Sized)) -> Result<Lattice, MeshingError> {
        require_positive("edge", self.edge)?;
        let (low, high) = checked_box(field)?;
        let origin = self.origin.unwrap_or((low + high) / 2.0);
        require_finite("origin", origin)?;
        require_room(field, self.edge, TETS_PER_CUBE, self.cell_limit)?;
        Ok(Lattice::over(&low, &high, self.edge, &origin))
    }
}

/// Sign class of the field at each lattice point: 1 inside, 0 on the surface, −1 outside.
fn signs(lattice: &Lattice, field: &(impl ImplicitField + ?Sized)) -> Result<Vec<i8>, MeshingError> {
    /// No number.
    const BAD: i8 = i8::MIN;
    let at = |id: u32| lattice.position(lattice.triple(id));
    let sign = |id: u32| Some(field.value(&at(id))).filter(|value| value.is_finite()).map_or(BAD, sign_of);
    let signs: Vec<i8> = (0..lattice.len() as u32).into_par_iter().map(sign).collect();
    for (id, &sign) in (0_u32..).zip(&signs) {
        if sign == BAD {
            return Err(MeshingError::FieldNotFinite { value: field.value(&at(id)), point: at(id) });
        }
        if sign > 0 && lattice.is_outermost(lattice.triple(id)) {
            return Err(MeshingError::BodyLeavesBox { point: at(id) });
        }
    }
    Ok(signs)
}

fn sign_of(value: f64) -> i8 {
    i8::from(value > 0.0) - i8::from(value < 0.0)
}

/// Crossing of the surface and an edge of the lattice.
#[derive(Clone, Copy)]
struct Cut {
    /// The edge, numbered by the lattice.
    edge: u64,
    /// Ends of the edge, the lower first.
    ends: [Triple; 2],
    /// Fraction of the way from the lower end.
    at: f64,
}

impl Cut {
    /// Bisects the field itself, not an interpolant.
    fn find(lattice: &Lattice, field: &(impl ImplicitField + ?Sized), edge: u64, ends: [Triple; 2]) -> Self {
        let [start, end] = ends.map(|triple| lattice.position(triple));
        let begins_inside = field.value(&start) > 0.0;
        let (mut low, mut high) = (0.0, 1.0);
        for _ in 0..BISECTIONS {
            let middle = 0.5 * (low + high);
            if (field.value(&start.lerp(&end, middle)) > 0.0) == begins_inside {
                low = middle;
            } else {
                high = middle;
            }
        }
        Self { edge, ends, at: 0.5 * (low + high) }
    }

    fn position(&self, lattice: &Lattice) -> Vector3 {
        let [start, end] = self.ends.map(|triple| lattice.position(triple));
        start.lerp(&end, self.at)
    }

    /// The end that the cut is too near to, and its distance in units of the lattice constant.
    fn violated(&self) -> Option<(Triple, f64)> {
        let long = is_long(self.ends[0], self.ends[1]);
        let (alpha, length) = if long { (ALPHA_LONG, 1.0) } else { (ALPHA_SHORT, 0.75_f64.sqrt()) };
        if self.at < alpha {
            Some((self.ends[0], self.at * length))
        } else if 1.0 - self.at < alpha {
            Some((self.ends[1], (1.0 - self.at) * length))
        } else {
            None
        }
    }
}

/// The cuts of all edges between an inner and an outer point, by increasing edge.
fn find_cuts(lattice: &Lattice, sign: &[i8], field: &(impl ImplicitField + ?Sized)) -> Vec<Cut> {
    (0..lattice.len() as u32)
        .into_par_iter()
        .filter(|&id| sign[id as usize] != 0)
        .flat_map_iter(|id| {
            let start = lattice.triple(id);
            let crossed = move |end: Triple| sign[id as usize] * sign[lattice.id(end) as usize] < 0;
            DIRECTIONS.iter().zip(0_u64..).filter_map(move |(&direction, number)| {
                let end = lattice.neighbour(start, direction).filter(|&end| crossed(end))?;
                Some(Cut::find(lattice, field, u64::from(id) * 7 + number, [start, end]))
            })
        })
        .collect()
}

/// The lattice after moving points too near a cut onto the nearest cut.
struct Warped {
    lattice: Lattice,
    /// Sign class of each lattice point; 0 for moved ones.
    sign: Vec<i8>,
    /// Cuts, by increasing edge. Cuts of edges with a moved end are not nodes.
    cuts: Vec<Cut>,
    /// The cut that each lattice point was moved to, or `UNMOVED`.
    moved_to: Vec<u32>,
}

impl Warped {
    /// Moves points to cuts. Each cut is too near to at most one end (α < ½), and a point moves to its
    /// nearest cut, the first among equals. So the order of the points does not matter.
    fn new(lattice: Lattice, mut sign: Vec<i8>, field: &(impl ImplicitField + ?Sized)) -> Self {
        let cuts = find_cuts(&lattice, &sign, field);
        let mut moved_to = vec![UNMOVED; sign.len()];
        for (cut, number) in cuts.iter().zip(0_u32..) {
            if let Some((end, distance)) = cut.violated() {
                let best = &mut moved_to[lattice.id(end) as usize];
                let nearest = cuts.get(*best as usize).and_then(Cut::violated);
                if nearest.is_none_or(|(_, least)| distance < least) {
                    *best = number;
                }
            }
        }
        for (sign, _) in sign.iter_mut().zip(&moved_to).filter(|(_, to)| **to != UNMOVED) {
            *sign = 0;
        }
        Self { lattice, sign, cuts, moved_to }
    }

    /// Position of a node: lattice points come first, then cuts.
    fn position(&self, node: u32) -> Vector3 {
        let cut = match self.moved_to.get(node as usize) {
            Some(&UNMOVED) => return self.lattice.position(self.lattice.triple(node)),
            Some(&cut) => cut as usize,
            None => node as usize - self.moved_to.len(),
        };
        self.cuts[cut].position(&self.lattice)
    }

    /// Nodes of the tetrahedra inside the body, right-handed.
    fn fill(&self) -> Vec<u32> {
        let layers: Vec<Vec<u32>> =
            (0..self.lattice.layers()).into_par_iter().map(|layer| self.fill_layer(layer)).collect();
        layers.concat()
    }

    fn fill_layer(&self, layer: usize) -> Vec<u32> {
        let mut tets = Vec::new();
        for triples in self.lattice.centres(layer).flat_map(tets_from) {
            if !self.lattice.contains(triples[1]) {
                continue;
            }
            let corners = triples.map(|triple| {
                let node = self.lattice.id(triple);
                Corner { triple, node, sign: self.sign[node as usize] }
            });
            if corners.iter().any(|corner| corner.sign > 0) {
                let pieces = stencil(corners, |p, n| self.cut_node(p, n));
                tets.extend(pieces.as_slice().iter().flat_map(|&tet| self.right_handed(tet)));
            }
        }
        tets
    }

    /// The node of the cut between an inner and an outer corner, neither of them moved.
    fn cut_node(&self, inner: Corner, outer: Corner) -> u32 {
        let edge = self.lattice.edge(inner.triple, outer.triple).map_or(u64::MAX, |(edge, _)| edge);
        let found = self.cuts.binary_search_by_key(&edge, |cut| cut.edge);
        let number = found.expect("the corners of a lattice tetrahedron are neighbours of opposite sign");
        (self.moved_to.len() + number) as u32
    }

    fn right_handed(&self, tet: [u32; 4]) -> [u32; 4] {
        let [a, b, c, d] = tet.map(|node| self.position(node));
        if (b - a).cross(&(c - a)).dot(&(d - a)) > 0.0 { tet } else { [tet[0], tet[2], tet[1], tet[3]] }
    }
}
