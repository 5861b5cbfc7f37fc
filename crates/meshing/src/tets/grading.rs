//! Tets of several sizes in the body of a field: the required sizes of the lattice cubes (`octree.rs`), and
//! the lattice cut along the surface. Sizes are the requested edge times powers of two. This edge is used
//! along the surface, longer ones inside and shorter ones in labels and places on request.

use std::collections::BTreeSet;

use pliant_geometry::{CellKind, Vector3};
use rayon::prelude::*;

use crate::error::{MeshingError, require_at_most, require_finite, require_positive};
use crate::input::anatomy::Anatomy;
use crate::input::extent::{allowed, checked_box};
use crate::input::field::ImplicitField;
use crate::input::surfaces::Surfaces;
use crate::tets::complex::Complex;
use crate::tets::cut::cut_outside;
use crate::tets::octree::{Cube, GradedLattice, Octree, around};
use crate::tets::request::{OrganTets, SMALLEST_PART};
use crate::tets::tears::{Tear, tears};
use crate::tets::topology::in_large_components;

/// Cubes outside the body may be this many doublings larger than the edge.
const LARGEST_OUTSIDE: usize = 3;

/// Number of smaller cubes across a thin part that larger ones would tear. With 1.71 a lattice point is
/// always left inside. Points nearer to a side than 0.357 of a cube may move onto it, and no edge of a tet is
/// longer than a cube.
const CELLS_ACROSS: f64 = 1.75;

/// Limit of cubes examined for a size.
const MOST_CUBES: f64 = (1 << 27) as f64;

/// The levels of a lattice of several sizes. Level 0 has the smallest cubes.
pub(crate) struct Levels {
    /// Level of cubes with the requested edge.
    pub(crate) base: usize,
    /// Level of the largest cubes inside.
    inner: usize,
    /// Level of each protected label.
    protected: Vec<(i32, usize)>,
}

impl Levels {
    /// Levels of a request; `finest` is the smallest edge that may be needed anywhere [m].
    pub(crate) fn new(request: &OrganTets, finest: f64) -> Result<Self, MeshingError> {
        let edge = request.edge;
        require_positive("edge", edge)?;
        let halvings = |smaller: f64| ((edge / smaller).log2() - 1e-9).ceil().max(0.0) as usize;
        for &(_, smaller) in &request.protect {
            require_positive("edge of a protected label", smaller)?;
        }
        let least = request.protect.iter().map(|(_, smaller)| *smaller).fold(finest.min(edge), f64::min);
        if least < SMALLEST_PART * edge {
            return Err(MeshingError::TooFine { edge, smallest: SMALLEST_PART * edge, asked: least });
        }
        let base = halvings(least);
        let doublings = request.inner_edge.map_or(0.0, |inner| (inner / edge).log2() + 1e-9).floor().max(0.0);
        let protected = request.protect.iter().map(|&(label, smaller)| (label, base - halvings(smaller)));
        Ok(Self { base, inner: base + doublings as usize, protected: protected.collect() })
    }

    /// Requests smaller cubes round tears: at least halved, and enough across the thin part. Returns whether
    /// any were requested.
    pub(crate) fn close(
        &self,
        request: &OrganTets,
        tree: &Octree,
        tears: &[Tear],
        wanted: &mut Wanted,
    ) -> bool {
        let before = wanted.len();
        let finest = self.finest(request);
        // Thinner parts would be torn by the smallest cubes, too.
        for tear in tears.iter().filter(|tear| tear.thickness >= finest) {
            let thin = (tear.thickness / CELLS_ACROSS / finest).log2().floor().max(0.0) as usize;
            for place in &tear.places {
                if let Some(finer) = tree.level_at(place).checked_sub(1) {
                    let level = finer.min(thin);
                    wanted.extend(around(tree.cube_at(level, place)).map(|cube| (level, cube)));
                }
            }
        }
        wanted.len() > before
    }

    /// Edge of the smallest cubes [m].
    fn finest(&self, request: &OrganTets) -> f64 {
        request.edge / f64::from(1 << self.base)
    }
}

/// Cubes that must not be larger than their level, found by measuring an earlier mesh.
pub(crate) type Wanted = BTreeSet<(usize, Cube)>;

/// A lattice over an anatomy, with cubes of the requested sizes.
pub(crate) fn tree(
    request: &OrganTets,
    anatomy: &Anatomy<'_>,
    levels: &Levels,
    wanted: &Wanted,
) -> Result<Octree, MeshingError> {
    let field = anatomy.field();
    let (low, high) = checked_box(field)?;
    let through = request.origin.unwrap_or((low + high) / 2.0);
    require_finite("origin", through)?;
    let top = levels.inner.max(levels.base + LARGEST_OUTSIDE);
    let mut tree = Octree::over(&low, &high, levels.finest(request), top, &through);
    let is_near = |level: usize, cube: Cube| {
        let depths = corners_and_centre().map(|part| field.value(&tree.place(level, cube, part)));
        let crossed = depths.iter().any(|depth| *depth > 0.0) && depths.iter().any(|depth| *depth <= 0.0);
        if let Some(&value) = depths.iter().find(|depth| !depth.is_finite()) {
            let point = tree.place(level, cube, [0.5; 3]);
            return Err(MeshingError::FieldNotFinite { value, point });
        }
        let near = crossed || depths[8].abs() < tree.size(level) / 2.0;
        Ok(if near { Where::Surface } else { Where::side(depths[8]) })
    };
    let cubes = cubes_over(&tree, levels.base, &low, &high)?;
    let found: Vec<Where> =
        cubes.par_iter().map(|&cube| is_near(levels.base, cube)).collect::<Result<_, _>>()?;
    for (&cube, place) in cubes.iter().zip(&found) {
        match place {
            Where::Surface => tree.demand_round(levels.base, cube),
            Where::Inside => {
                let larger = levels.inner - levels.base;
                tree.demand(levels.inner, cube.map(|i| i >> larger));
            }
            Where::Outside => {}
        }
    }
    for &(label, level) in &levels.protected {
        protect(&mut tree, anatomy, label, level)?;
    }
    wanted.iter().for_each(|&(level, cube)| tree.demand(level, cube));
    tree.balance();
    Ok(tree)
}

/// Position of a cube relative to the body.
enum Where {
    Surface,
    Inside,
    Outside,
}

impl Where {
    fn side(depth: f64) -> Self {
        if depth > 0.0 { Self::Inside } else { Self::Outside }
    }
}

fn corners_and_centre() -> [[f64; 3]; 9] {
    std::array::from_fn(
        |at| if at == 8 { [0.5; 3] } else { [at & 1, at >> 1 & 1, at >> 2].map(|i| i as f64) },
    )
}

/// Cubes of a level over a box.
fn cubes_over(tree: &Octree, level: usize, low: &Vector3, high: &Vector3) -> Result<Vec<Cube>, MeshingError> {
    let counts = tree.counts(level);
    let [first, last] = [low, high].map(|point| tree.cube_at(level, point));
    let [first, last] = [first, last].map(|cube| [0, 1, 2].map(|axis| cube[axis].clamp(0, counts[axis] - 1)));
    let along = [0, 1, 2].map(|axis| last[axis] - first[axis] + 1);
    let number = along.iter().map(|&n| f64::from(n)).product::<f64>();
    if number > MOST_CUBES {
        return Err(MeshingError::LatticeTooLarge { cubes: number as u64, limit: MOST_CUBES as usize });
    }
    let of_layer = |k: i32| {
        (0..along[1])
            .flat_map(move |j| (0..along[0]).map(move |i| [first[0] + i, first[1] + j, first[2] + k]))
    };
    Ok((0..along[2]).flat_map(of_layer).collect())
}

/// Requires cubes of a level in and around a label.
fn protect(tree: &mut Octree, anatomy: &Anatomy<'_>, label: i32, level: usize) -> Result<(), MeshingError> {
    let labels = anatomy.labels();
    let Some(number) = labels.iter().position(|known| *known == label) else {
        return Err(MeshingError::NoSuchLabel { label, labels });
    };
    let size = tree.size(level);
    let surfaces = Surfaces::new(anatomy, size);
    let (low, high) = match number {
        0 => checked_box(anatomy.field())?,
        _ => checked_box(anatomy.inner(number + 1))?,
    };
    let holds = |cube: &Cube| {
        corners_and_centre().iter().any(|part| {
            let point = tree.place(level, *cube, *part);
            anatomy.field().value(&point) > -size / 2.0
                && (labels.len() == 1 || surfaces.inside(number + 1, &point) > -size / 2.0)
        })
    };
    let cubes = cubes_over(tree, level, &low, &high)?;
    let chosen: Vec<Cube> = cubes.into_par_iter().filter(holds).collect();
    chosen.into_iter().for_each(|cube| tree.demand_round(level, cube));
    Ok(())
}

/// The tets of a lattice inside the body, and the numbers of cells and pieces left out as too small.
pub(crate) struct Filled {
    pub(crate) complex: Complex,
    pub(crate) dropped_pieces: usize,
    pub(crate) dropped_cells: usize,
    /// Remaining tears of thin parts, and the number of tears that smaller cells closed.
    pub(crate) tears: Vec<Tear>,
    pub(crate) closed_tears: usize,
}

/// Fills a body with the tets of a lattice, cut along its surface.
pub(crate) fn fill(
    request: &OrganTets,
    anatomy: &Anatomy<'_>,
    tree: &Octree,
) -> Result<Filled, MeshingError> {
    let field = anatomy.field();
    let (points, sizes, tets) = near_body(tree.lattice(), &|point| field.value(point));
    let (low, high) = field.bounds();
    if tets.is_empty() {
        return Err(MeshingError::NoCells { edge: request.edge, size: high - low });
    }
    // About half of a coarse lattice is cut away again.
    require_at_most(tets.len() as f64 / 4.0, allowed(request.cell_limit))?;
    let mut complex = Complex::graded(points, tets, sizes);
    cut_outside(&mut complex, field);
    let alive: Vec<u32> = complex.alive().collect();
    if alive.is_empty() {
        return Err(MeshingError::NoCells { edge: request.edge, size: high - low });
    }
    require_at_most(alive.len() as f64, allowed(request.cell_limit))?;
    Ok(Filled::of(complex, request.smallest_piece, field))
}

impl Filled {
    /// Leaves out pieces of less than the part `smallest` of the largest one.
    pub(crate) fn of(mut complex: Complex, smallest: f64, field: &dyn ImplicitField) -> Self {
        let tears = tears(&complex, field);
        let alive: Vec<u32> = complex.alive().collect();
        let nodes: Vec<u32> = alive.iter().flat_map(|&tet| complex.tets[tet as usize]).collect();
        let (kept, dropped_pieces) = in_large_components(CellKind::Tet, &nodes, smallest);
        let dropped: Vec<u32> =
            alive.into_iter().zip(kept).filter(|(_, kept)| !kept).map(|(tet, _)| tet).collect();
        dropped.iter().for_each(|&tet| complex.remove(tet));
        complex.find_sides();
        Self { complex, dropped_pieces, dropped_cells: dropped.len(), tears, closed_tears: 0 }
    }
}

/// Points, sizes and tets of a lattice that touch a tet with a point in the body.
fn near_body(
    lattice: GradedLattice,
    depth: &(dyn Fn(&Vector3) -> f64 + Sync),
) -> (Vec<Vector3>, Vec<f64>, Vec<[u32; 4]>) {
    let GradedLattice { points, sizes, tets } = lattice;
    let mut near: Vec<bool> = points.par_iter().map(|point| depth(point) > 0.0).collect();
    let touching = |near: &[bool]| -> Vec<[u32; 4]> {
        tets.iter().filter(|tet| tet.iter().any(|&node| near[node as usize])).copied().collect()
    };
    for &node in touching(&near).iter().flatten() {
        near[node as usize] = true;
    }
    let mut kept = touching(&near);
    let mut number = vec![u32::MAX; points.len()];
    let mut used = Vec::new();
    for node in kept.iter_mut().flatten() {
        let numbered = &mut number[*node as usize];
        if *numbered == u32::MAX {
            *numbered = used.len() as u32;
            used.push(*node as usize);
        }
        *node = *numbered;
    }
    let sizes = used.iter().map(|&node| sizes[node]).collect();
    (used.iter().map(|&node| points[node]).collect(), sizes, kept)
}
