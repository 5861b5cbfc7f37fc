//! The body-centred cubic lattice: integer triples, all even (corners of cubes) or all odd (their centres).
//! Long edges join equal parities (length a), short edges different ones (√3/2 a).

use pliant_geometry::Vector3;

/// Integer coordinates in units of a/2, from 0 to twice the number of cubes.
pub(crate) type Triple = [i32; 3];

/// The directions of the edges from their lower end: three long, four short. A direction and its opposite are
/// one edge.
pub(crate) const DIRECTIONS: [Triple; 7] =
    [[2, 0, 0], [0, 2, 0], [0, 0, 2], [1, -1, -1], [1, -1, 1], [1, 1, -1], [1, 1, 1]];

/// Corners and centres of a box of cubes.
pub(crate) struct Lattice {
    /// Position of the triple (0, 0, 0) [m].
    origin: Vector3,
    /// Half the lattice constant, a/2 [m].
    half: f64,
    /// Cubes along x, y and z.
    cubes: [usize; 3],
}

impl Lattice {
    /// Cubes of edge `edge` over a box and one cube more on every side. A corner lies at `through`, were the
    /// lattice infinite.
    pub(crate) fn over(low: &Vector3, high: &Vector3, edge: f64, through: &Vector3) -> Self {
        let centre = (low + high) / 2.0;
        let near = centre + (through - centre).map(|shift| shift % edge);
        let first = ((low - near) / edge).map(f64::floor).add_scalar(-1.0);
        let last = ((high - near) / edge).map(f64::ceil).add_scalar(1.0);
        let cubes = [0, 1, 2].map(|axis| (last[axis] - first[axis]) as usize);
        Self { origin: near + first * edge, half: edge / 2.0, cubes }
    }

    /// Number of lattice points.
    pub(crate) fn len(&self) -> usize {
        let [x, y, z] = self.cubes;
        (x + 1) * (y + 1) * (z + 1) + x * y * z
    }

    /// Layers of centres along z.
    pub(crate) fn layers(&self) -> usize {
        self.cubes[2]
    }

    /// The centres of a layer along z.
    pub(crate) fn centres(&self, layer: usize) -> impl Iterator<Item = Triple> {
        let odd = |i: usize| 2 * i as i32 + 1;
        let [nx, ny, _] = self.cubes;
        (0..ny).flat_map(move |y| (0..nx).map(move |x| [odd(x), odd(y), odd(layer)]))
    }

    /// Number of a triple: along x, then y, then z, corners and centres of z-layers in turn.
    pub(crate) fn id(&self, [i, j, k]: Triple) -> u32 {
        let [i, j, k] = [i, j, k].map(|x| x as usize);
        let odd = k % 2;
        let (corners, centres) = self.layer_sizes();
        let row = self.cubes[0] + 1 - odd;
        (k / 2 * (corners + centres) + odd * corners + j / 2 * row + i / 2) as u32
    }

    /// The triple of a number.
    pub(crate) fn triple(&self, id: u32) -> Triple {
        let (corners, centres) = self.layer_sizes();
        let (pair, rest) = (id as usize / (corners + centres), id as usize % (corners + centres));
        let odd = usize::from(rest >= corners);
        let rest = rest - odd * corners;
        let row = self.cubes[0] + 1 - odd;
        [rest % row, rest / row, pair].map(|half| (2 * half + odd) as i32)
    }

    /// Points in a z-layer of corners and of centres.
    fn layer_sizes(&self) -> (usize, usize) {
        let [x, y, _] = self.cubes;
        ((x + 1) * (y + 1), x * y)
    }

    /// Position of a triple [m].
    pub(crate) fn position(&self, triple: Triple) -> Vector3 {
        self.origin + Vector3::from(triple.map(f64::from)) * self.half
    }

    /// Target of a direction from a triple, if the lattice has it.
    pub(crate) fn neighbour(&self, triple: Triple, direction: Triple) -> Option<Triple> {
        let to = [0, 1, 2].map(|axis| triple[axis] + direction[axis]);
        self.contains(to).then_some(to)
    }

    /// True if a triple lies in the box of cubes.
    pub(crate) fn contains(&self, triple: Triple) -> bool {
        (0..3).all(|axis| triple[axis] >= 0 && triple[axis] <= 2 * self.cubes[axis] as i32)
    }

    /// True for the outermost corners and centres.
    pub(crate) fn is_outermost(&self, triple: Triple) -> bool {
        (0..3).any(|axis| triple[axis] <= 1 || triple[axis] >= 2 * self.cubes[axis] as i32 - 1)
    }

    /// Number of the edge between two neighbours, the same from both ends, and true if `p` is its lower end.
    pub(crate) fn edge(&self, p: Triple, q: Triple) -> Option<(u64, bool)> {
        let forth = [0, 1, 2].map(|axis| q[axis] - p[axis]);
        let find = |direction: Triple| DIRECTIONS.iter().position(|d| *d == direction);
        if let Some(direction) = find(forth) {
            return Some((u64::from(self.id(p)) * 7 + direction as u64, true));
        }
        find(forth.map(|x| -x)).map(|direction| (u64::from(self.id(q)) * 7 + direction as u64, false))
    }
}

/// The tetrahedra around the long edges that start at a centre and lead along +x, +y and +z. There are four
/// round each edge. Each has this edge and two neighbouring corners of the cube face that the edge passes
/// through.
pub(crate) fn tets_from(centre: Triple) -> impl Iterator<Item = [Triple; 4]> {
    const RING: [[i32; 2]; 4] = [[1, 1], [-1, 1], [-1, -1], [1, -1]];
    (0..12).map(move |at| {
        let (axis, turn) = (at / 4, at % 4);
        let shifted = |along: i32, [u, v]: [i32; 2]| {
            let mut to = centre;
            to[axis] += along;
            to[(axis + 1) % 3] += u;
            to[(axis + 2) % 3] += v;
            to
        };
        [centre, shifted(2, [0, 0]), shifted(1, RING[turn]), shifted(1, RING[(turn + 1) % 4])]
    })
}

/// True if two neighbours are joined by a long edge, that is if they have equal parity.
pub(crate) fn is_long(p: Triple, q: Triple) -> bool {
    (p[0] - q[0]) % 2 == 0
}

#[cfg(test)]
mod tests {
    use super::*;

    fn small() -> Lattice {
        Lattice::over(
            &Vector3::new(-0.1, 0.0, 3.0),
            &Vector3::new(2.0, 0.9, 5.5),
            1.0,
            &Vector3::new(0.3, 100.7, -9.5),
        )
    }

    #[test]
    fn numbers_and_triples_correspond() {
        let lattice = small();
        for id in 0..lattice.len() as u32 {
            assert_eq!(lattice.id(lattice.triple(id)), id);
        }
    }

    #[test]
    fn the_lattice_covers_the_box_and_passes_through_the_point() {
        let lattice = small();
        let (first, last) = (lattice.position([0; 3]), lattice.position(lattice.cubes.map(|n| 2 * n as i32)));
        for axis in 0..3 {
            assert!(first[axis] <= [-1.1, -1.0, 2.0][axis] && last[axis] >= [3.0, 1.9, 6.5][axis]);
            let offset = first[axis] - [0.3, 0.7, 0.5][axis];
            assert!((offset - offset.round()).abs() < 1e-12);
        }
    }

    #[test]
    fn the_tetrahedra_are_right_handed_congruent_and_joined_by_lattice_edges() {
        let lattice = small();
        for tet in tets_from([3, 3, 3]) {
            let [a, b, c, d] = tet.map(|triple| Vector3::from(triple.map(f64::from)));
            assert_eq!((b - a).cross(&(c - a)).dot(&(d - a)), 4.0);
            for (i, p) in tet.into_iter().enumerate() {
                for q in &tet[i + 1..] {
                    assert!(lattice.edge(p, *q).is_some());
                    assert_eq!(
                        lattice.edge(p, *q).map(|(edge, _)| edge),
                        lattice.edge(*q, p).map(|(edge, _)| edge)
                    );
                }
            }
        }
    }
}
