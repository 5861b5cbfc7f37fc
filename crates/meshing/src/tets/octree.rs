//! A body-centred cubic lattice of cubes of several sizes, after Labelle and Shewchuk (2007). Cubes are
//! halved where cells must be smaller; neighbours, also across edges and corners, differ by at most one
//! halving. Equal cubes have the tets of the uniform lattice between them; a tet is halved where one of its
//! edges is. Where a cube meets four smaller ones, pyramids lead from the centres over the four squares
//! between. Each pyramid is halved along the diagonal that starts in the middle of the larger square. Cubes
//! of level 0 are the smallest; cubes of level n are 2ⁿ as long.

use std::collections::{BTreeSet, HashMap};

use pliant_geometry::Vector3;

/// A cube: its place in the grid of its level.
pub(crate) type Cube = [i32; 3];

/// Cubes of several sizes over a box.
pub(crate) struct Octree {
    /// Smallest corner [m].
    origin: Vector3,
    /// Edge of the smallest cubes [m].
    finest: f64,
    /// Level of the largest cubes, and how many of them there are along each axis.
    top: usize,
    roots: [i32; 3],
    /// Cubes that are halved, by level.
    split: Vec<BTreeSet<Cube>>,
}

/// Points and tets of the lattice, with the edge of the smallest cube round each point [m].
pub(crate) struct GradedLattice {
    pub(crate) points: Vec<Vector3>,
    pub(crate) sizes: Vec<f64>,
    pub(crate) tets: Vec<[u32; 4]>,
}

impl Octree {
    /// Cubes of level `top` over a box and at least one more on every side; level 0 has the edge `finest`
    /// [m]. Some corner of the regular lattice lies at `through`.
    pub(crate) fn over(low: &Vector3, high: &Vector3, finest: f64, top: usize, through: &Vector3) -> Self {
        let largest = finest * f64::from(1 << top);
        let centre = (low + high) / 2.0;
        let near = centre + (through - centre).map(|shift| shift % largest);
        let first = ((low - near) / largest).map(f64::floor).add_scalar(-1.0);
        let last = ((high - near) / largest).map(f64::ceil).add_scalar(1.0);
        let roots = [0, 1, 2].map(|axis| (last[axis] - first[axis]) as i32);
        Self { origin: near + first * largest, finest, top, roots, split: vec![BTreeSet::new(); top + 1] }
    }

    /// Edge of the cubes of a level [m].
    pub(crate) fn size(&self, level: usize) -> f64 {
        self.finest * f64::from(1 << level)
    }

    /// Cubes of a level along each axis.
    pub(crate) fn counts(&self, level: usize) -> [i32; 3] {
        self.roots.map(|n| n << (self.top - level))
    }

    /// A place in a cube [m], by parts of its edge.
    pub(crate) fn place(&self, level: usize, cube: Cube, part: [f64; 3]) -> Vector3 {
        let at = Vector3::from_fn(|axis, _| f64::from(cube[axis]) + part[axis]);
        self.origin + at * self.size(level)
    }

    /// The cube of a level that holds a point.
    pub(crate) fn cube_at(&self, level: usize, point: &Vector3) -> Cube {
        let at = (point - self.origin) / self.size(level);
        [0, 1, 2].map(|axis| at[axis].floor() as i32)
    }

    /// The level of the cube that holds a point and is not halved.
    pub(crate) fn level_at(&self, point: &Vector3) -> usize {
        (1..=self.top)
            .find(|&level| self.split[level].contains(&self.cube_at(level, point)))
            .map_or_else(|| self.top, |level| level - 1)
    }

    fn contains(&self, level: usize, cube: Cube) -> bool {
        let counts = self.counts(level);
        (0..3).all(|axis| (0..counts[axis]).contains(&cube[axis]))
    }

    /// Halves larger cubes until one of this level is there.
    pub(crate) fn demand(&mut self, level: usize, cube: Cube) {
        if self.contains(level, cube) {
            let mut parent = cube;
            for above in level + 1..=self.top {
                parent = parent.map(|i| i >> 1);
                if !self.split[above].insert(parent) {
                    break;
                }
            }
        }
    }

    /// Demands a level in all cubes round a cube, like [`Self::demand`].
    pub(crate) fn demand_round(&mut self, level: usize, cube: Cube) {
        around(cube).for_each(|cube| self.demand(level, cube));
    }

    /// Halves cubes until neighbours differ by one level at most.
    pub(crate) fn balance(&mut self) {
        for level in 1..=self.top {
            for cube in self.split[level].clone() {
                self.demand_round(level, cube);
            }
        }
    }

    /// True if a cube is there, halved or not.
    fn is_there(&self, level: usize, cube: Cube) -> bool {
        self.contains(level, cube)
            && (level == self.top || self.split[level + 1].contains(&cube.map(|i| i >> 1)))
    }

    fn is_split(&self, level: usize, cube: Cube) -> bool {
        self.split[level].contains(&cube)
    }

    /// The cubes that are not halved, in the order of the largest cubes and of the halves within each.
    pub(crate) fn leaves(&self) -> Vec<(usize, Cube)> {
        let [nx, ny, nz] = self.roots;
        let mut ahead: Vec<(usize, Cube)> = Vec::new();
        for k in (0..nz).rev() {
            for j in (0..ny).rev() {
                ahead.extend((0..nx).rev().map(|i| (self.top, [i, j, k])));
            }
        }
        let mut leaves = Vec::new();
        while let Some((level, cube)) = ahead.pop() {
            if self.is_split(level, cube) {
                ahead.extend(halves(cube).into_iter().rev().map(|half| (level - 1, half)));
            } else {
                leaves.push((level, cube));
            }
        }
        leaves
    }

    /// The tets of the lattice. The tree must be balanced.
    pub(crate) fn lattice(&self) -> GradedLattice {
        let mut nodes = Nodes { numbers: HashMap::new(), places: Vec::new(), sizes: Vec::new() };
        let leaves = self.leaves();
        for &(level, cube) in &leaves {
            let size = self.size(level);
            nodes.at(centre(level, cube), size);
            halves([0; 3]).into_iter().for_each(|side| {
                nodes.at(corner(level, [0, 1, 2].map(|axis| cube[axis] + side[axis])), size);
            });
        }
        let mut tets = Vec::new();
        for &(level, cube) in &leaves {
            for axis in 0..3 {
                for side in [1, -1] {
                    let mut other = cube;
                    other[axis] += side;
                    if !self.is_there(level, other) {
                        continue;
                    }
                    if self.is_split(level, other) {
                        self.towards_halves(level, cube, axis, side, &nodes, &mut tets);
                    } else if side == 1 {
                        self.towards_equal(level, cube, axis, &nodes, &mut tets);
                    }
                }
            }
        }
        let points: Vec<Vector3> = nodes
            .places
            .iter()
            .map(|place| self.origin + Vector3::from(place.map(f64::from)) * (self.finest / 2.0))
            .collect();
        for tet in &mut tets {
            let [a, b, c, d] = tet.map(|node| points[node as usize]);
            if (b - a).cross(&(c - a)).dot(&(d - a)) < 0.0 {
                tet.swap(2, 3);
            }
        }
        GradedLattice { points, sizes: nodes.sizes, tets }
    }

    /// Four tets round the way between the centres of two equal cubes, or up to eight where edges of the
    /// square between are halved.
    fn towards_equal(&self, level: usize, cube: Cube, axis: usize, nodes: &Nodes, tets: &mut Vec<[u32; 4]>) {
        let mut other = cube;
        other[axis] += 1;
        let [near, beyond] = [cube, other].map(|cube| nodes.number(centre(level, cube)));
        let (u, v) = ((axis + 1) % 3, (axis + 2) % 3);
        let ring = [[0, 0], [1, 0], [1, 1], [0, 1]];
        // Across which side of the square the cubes lie that share its edge.
        let across = [(v, -1), (u, 1), (v, 1), (u, -1)];
        for at in 0..4 {
            let end = |[du, dv]: [i32; 2]| {
                let mut place = other;
                place[u] += du;
                place[v] += dv;
                corner(level, place)
            };
            let [from, to] = [end(ring[at]), end(ring[(at + 1) % 4])];
            let (way, side) = across[at];
            let is_halved = [cube, other].into_iter().any(|mut cube| {
                cube[way] += side;
                self.is_split(level, cube)
            });
            let [p, q] = [from, to].map(|place| nodes.number(place));
            if is_halved {
                let middle = nodes.number([0, 1, 2].map(|axis| (from[axis] + to[axis]) / 2));
                tets.extend([[near, beyond, p, middle], [near, beyond, middle, q]]);
            } else {
                tets.push([near, beyond, p, q]);
            }
        }
    }

    /// Sixteen tets over the four squares between a cube and the halves of its neighbour.
    fn towards_halves(
        &self,
        level: usize,
        cube: Cube,
        axis: usize,
        side: i32,
        nodes: &Nodes,
        tets: &mut Vec<[u32; 4]>,
    ) {
        let near = nodes.number(centre(level, cube));
        let (u, v) = ((axis + 1) % 3, (axis + 2) % 3);
        // In the grid of the halves: the layer of corners between, and the layer of halves beyond.
        let between = 2 * (cube[axis] + i32::from(side > 0));
        let layer = if side > 0 { between } else { between - 1 };
        for (du, dv) in [(0, 0), (1, 0), (0, 1), (1, 1)] {
            let of_square = |a: i32, b: i32| {
                let mut place = [0; 3];
                (place[axis], place[u], place[v]) = (between, 2 * cube[u] + a, 2 * cube[v] + b);
                nodes.number(corner(level - 1, place))
            };
            let mut half = [0; 3];
            (half[axis], half[u], half[v]) = (layer, 2 * cube[u] + du, 2 * cube[v] + dv);
            let beyond = nodes.number(centre(level - 1, half));
            let (middle, far) = (of_square(1, 1), of_square(2 * du, 2 * dv));
            for third in [of_square(2 * du, 1), of_square(1, 2 * dv)] {
                tets.extend([[near, middle, far, third], [beyond, middle, far, third]]);
            }
        }
    }
}

/// Corners and centres of cubes, by their places in halves of the smallest edge.
struct Nodes {
    numbers: HashMap<[i32; 3], u32>,
    places: Vec<[i32; 3]>,
    sizes: Vec<f64>,
}

impl Nodes {
    /// Notes a point of a cube of a size [m].
    fn at(&mut self, place: [i32; 3], size: f64) {
        let next = self.places.len() as u32;
        let number = *self.numbers.entry(place).or_insert(next) as usize;
        if number == self.places.len() {
            self.places.push(place);
            self.sizes.push(size);
        }
        self.sizes[number] = self.sizes[number].min(size);
    }

    /// The number of a point: every corner and centre of a cube is noted before tets are made.
    fn number(&self, place: [i32; 3]) -> u32 {
        self.numbers[&place]
    }
}

fn corner(level: usize, cube: Cube) -> [i32; 3] {
    cube.map(|i| i << (level + 1))
}

fn centre(level: usize, cube: Cube) -> [i32; 3] {
    cube.map(|i| (2 * i + 1) << level)
}

fn halves(cube: Cube) -> [Cube; 8] {
    std::array::from_fn(|at| [0, 1, 2].map(|axis| 2 * cube[axis] + (at >> axis & 1) as i32))
}

/// A cube and the 26 round it.
pub(crate) fn around(cube: Cube) -> impl Iterator<Item = Cube> {
    (0..27).map(move |at| [cube[0] + at % 3 - 1, cube[1] + at / 3 % 3 - 1, cube[2] + at / 9 - 1])
}

#[cfg(test)]
mod tests {
    use std::collections::BTreeMap;

    use super::*;
    use crate::tets::complex::acoustic_length;

    /// Cubes of three sizes. Every face that is not on the rim of the box has two tets, and volumes add up.
    /// No tet is below 0.89 of the ideal one of the smallest cube at its corners.
    #[test]
    fn cubes_of_several_sizes_make_a_lattice_that_fits() {
        let mut tree = Octree::over(&Vector3::zeros(), &Vector3::repeat(3.0), 0.25, 2, &Vector3::zeros());
        for cube in [[7, 9, 8], [8, 8, 8], [12, 7, 9]] {
            tree.demand(0, cube);
        }
        tree.balance();
        let GradedLattice { points, sizes, tets } = tree.lattice();
        let mut faces: BTreeMap<[u32; 3], usize> = BTreeMap::new();
        let (mut volume, mut least) = (0.0, f64::INFINITY);
        for tet in &tets {
            let x = tet.map(|node| points[node as usize]);
            let size = tet.iter().map(|&node| sizes[node as usize]).fold(f64::INFINITY, f64::min);
            least = f64::min(least, acoustic_length(x) * 8_f64.sqrt() / size);
            volume += (x[1] - x[0]).cross(&(x[2] - x[0])).dot(&(x[3] - x[0])) / 6.0;
            for out in 0..4 {
                let mut face: Vec<u32> = (0..4).filter(|&at| at != out).map(|at| tet[at]).collect();
                face.sort_unstable();
                *faces.entry([face[0], face[1], face[2]]).or_default() += 1;
            }
        }
        assert!(least > 0.89, "{least}");
        // Faces on the rim: two corners of the box's square and a centre. They bound the missing parts of the
        // outermost cubes.
        let [low, high] = [0, 1].map(|end| {
            let counts = tree.counts(2).map(|n| end * n);
            tree.place(2, counts, [0.0; 3])
        });
        let on_rim = |node: u32| {
            let x = points[node as usize];
            (0..3).any(|axis| (x[axis] - low[axis]).abs() < 0.51 || (high[axis] - x[axis]).abs() < 0.51)
        };
        for (face, count) in &faces {
            assert!(*count == 2 || *count == 1 && face.iter().all(|&node| on_rim(node)), "{face:?}: {count}");
        }
        // The missing parts are the pyramids over the squares of the box: a sixth of each outermost cube.
        let counts = tree.counts(2);
        let squares = 2 * (counts[0] * counts[1] + counts[1] * counts[2] + counts[2] * counts[0]);
        let whole = f64::from(counts[0] * counts[1] * counts[2]);
        assert!((volume - (whole - f64::from(squares) / 6.0)).abs() < 1e-9, "{volume}");
        assert_eq!(tree.level_at(&tree.place(0, [8, 8, 8], [0.5; 3])), 0);
    }
}
