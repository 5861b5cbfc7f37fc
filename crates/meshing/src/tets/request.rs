//! A request for tetrahedra of organs.

use pliant_geometry::Vector3;

use crate::DEFAULT_CELL_LIMIT;

/// The smallest edge anywhere, as a fraction of the requested edge.
pub(crate) const SMALLEST_PART: f64 = 1.0 / 64.0;

/// A request for tetrahedra of an anatomy.
#[derive(Clone, Debug, PartialEq)]
pub struct OrganTets {
    /// Lattice constant [m]: the long edges of the inner tetrahedra; the short edges are √3/2 times as long.
    pub edge: f64,
    /// Lattice constant inside, away from the surface [m], if larger: the largest `edge` × 2ⁿ up to this
    /// value.
    pub inner_edge: Option<f64>,
    /// Labels with smaller cells, and their lattice constant [m]: the largest `edge` / 2ⁿ that is not above
    /// it.
    pub protect: Vec<(i32, f64)>,
    /// Largest distance between mesh boundary and body surface [m] in both directions: cells are halved where
    /// it is exceeded. The reference is the smooth surface of an image, or the triangles of a file.
    pub distance: Option<f64>,
    /// A lattice point [m]; the centre of the box of the body if `None`.
    pub origin: Option<Vector3>,
    /// Target for the smallest acoustic length, as a fraction of the ideal tet: 0.75 is usual, 0.9 the best,
    /// 0 skips optimisation.
    pub target: f64,
    /// Most rounds of the optimiser.
    pub rounds: usize,
    /// Pieces of the mesh with fewer cells than this part of the largest one are left out.
    pub smallest_piece: f64,
    /// Most cells allowed.
    pub cell_limit: usize,
}

impl OrganTets {
    /// Lattice constant `edge` [m] everywhere, target 0.75 in at most 10 rounds, pieces of a twentieth of the
    /// largest one and more.
    pub fn new(edge: f64) -> Self {
        Self {
            edge,
            inner_edge: None,
            protect: Vec::new(),
            distance: None,
            origin: None,
            target: 0.75,
            rounds: 10,
            smallest_piece: 0.05,
            cell_limit: DEFAULT_CELL_LIMIT,
        }
    }

    /// The initial edge [m] if only a distance [m] is given, from the box of the body [m]. It is the chord
    /// √(8 R d) that is a distance d off an arc. The radius R of the arc is a quarter of the shortest side of
    /// the box.
    pub fn edge_for(distance: f64, [low, high]: [Vector3; 2]) -> f64 {
        (2.0 * (high - low).min() * distance).sqrt().min((high - low).norm() / 15.0)
    }

    /// Gives labels smaller cells: of the edge given [m], or else of half the edge of the others.
    pub fn protecting(self, labels: &[(i32, Option<f64>)]) -> Self {
        let with_edge = |&(label, edge): &(i32, Option<f64>)| (label, edge.unwrap_or(self.edge / 2.0));
        Self { protect: labels.iter().map(with_edge).collect(), ..self }
    }

    /// The edge [m] that the field of a body must resolve: the shortest edge, or the requested distance.
    pub fn finest(&self) -> f64 {
        let protected = self.protect.iter().map(|(_, edge)| *edge).fold(self.edge, f64::min);
        self.distance.map_or(protected, |distance| protected.min(distance.max(SMALLEST_PART * self.edge)))
    }
}
