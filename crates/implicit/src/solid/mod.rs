//! Cells of solids of any hyperelastic law: energy, nodal forces and stiffness at a state. The form is total
//! Lagrangian (Belytschko, Liu, Moran, *Nonlinear Finite Elements*, 4.9 and 6.4): f_a = Σ w F S B_a, K_ab = Σ
//! w (𝔹_aᵀ D 𝔹_b + (B_a·S B_b) I). D comes from [`AnyLaw::tangent`], for the co-rotated linear law in closed
//! form (`closed.rs`).
//!
//! `hex8` adds its hourglass control, k γ_a·γ_b I, with the derivatives of its factor g where g follows the
//! law. `hex8-full` takes one mean dilatation J̄ = v/V a cell. Its energy V U(J̄) adds p cof F B_a to the
//! force, and U″(J̄)/V c_a ⊗ c_b with c_a = Σ w cof F B_a to the stiffness. `tet4-anp` does so for each node
//! with the tets around it (`star.rs`). Membranes are in plane stress (`membrane.rs`), bars in uniaxial
//! stress (`bar.rs`).

mod bar;
mod closed;
mod membrane;
pub(crate) mod relaxation;
mod star;
#[cfg(test)]
mod tests;

use pliant_mechanics::element::FLAT_HEX;
use pliant_mechanics::law::plane_stress::InPlane;
use pliant_mechanics::law::{AnyLaw, Deformation, ShearGrowth, Split};
use pliant_mechanics::model::{Averaging, CellBlock, Cells, Hourglass, Solid};
use pliant_mechanics::tensor::{Symmetric, Tensor, Vector, add, cross, dot, scale, sub};

use pliant_shells::Broken;

use self::relaxation::Lag;
pub(crate) use star::Stars;

/// The most components of a cell: three a node of a hexahedron.
pub(crate) const MOST: usize = 24;

/// The most evaluation points of a cell, which a hexahedron has.
pub(crate) const MOST_POINTS: usize = 8;

/// Response of a cell at a state: energy, forces and stiffness.
#[derive(Clone)]
pub(crate) struct Response {
    /// Strain energy [J].
    pub(crate) energy: f64,
    /// Part of the energy in hourglass control [J].
    pub(crate) hourglass: f64,
    /// Internal forces [N], three a node.
    pub(crate) force: [f64; MOST],
    /// Stiffness [N/m] over the same, column by column; filled if it is asked for.
    pub(crate) tangent: Vec<f64>,
    pub(crate) broken: Option<Broken>,
}

impl Response {
    pub(crate) fn none() -> Self {
        Self { energy: 0.0, hourglass: 0.0, force: [0.0; MOST], tangent: Vec::new(), broken: None }
    }

    /// Finds what a cell makes. `pressure` is the averaged one of a tetrahedron, whose energy is counted at
    /// its nodes; `lag` says how its stresses relax.
    pub(crate) fn fill(
        &mut self,
        solid: &Solid,
        cell: usize,
        pressure: Option<f64>,
        lag: Lag<'_>,
        displacement: impl Fn(u32) -> Vector<f64>,
        stiffness: bool,
    ) {
        let size = 3 * solid.cells.nodes_per_cell();
        (self.energy, self.hourglass) = (0.0, 0.0);
        self.force.fill(0.0);
        self.tangent.clear();
        self.tangent.resize(if stiffness { size * size } else { 0 }, 0.0);
        self.broken = inverted_corner(solid, cell, &displacement).map(Broken::Inverted);
        if self.broken.is_some() {
            return;
        }
        let fibres = solid.law_fibres(cell);
        let material = CellMaterial { law: &solid.material.law, fibres: &fibres, lag, stiffness };
        let found = match &solid.cells {
            Cells::Tet4(block) => self.fill_plain(material, (solid, block), cell, displacement),
            Cells::Hex8(block) => self.fill_plain(material, (solid, block), cell, displacement),
            Cells::AveragedTet4(block, _) => {
                let u = moved(block, cell, displacement);
                let rest = &block.rest[cell];
                let part = Part::Shape(pressure.unwrap_or(0.0));
                self.add_point(material, &u, &rest.gradient, rest.volume, part)
            }
            Cells::FullHex8(block, points) => {
                let u = moved(block, cell, displacement);
                let (points, volume) = (&points[cell], block.rest[cell].volume);
                let weighted = || points.gradient.iter().zip(points.weight);
                let share = |(b, w): (&[Vector<f64>; 8], f64)| w * volume_change(&gradient(&u, b));
                let change = weighted().map(share).sum::<f64>() / volume;
                let [pressure, second] = material.law.volume_pressures(change);
                self.energy += volume * material.law.volume_energy(change);
                let each = weighted().enumerate().try_for_each(|(point, (b, w))| {
                    self.add_point(material.at(point), &u, b, w, Part::Shape(pressure))
                });
                if stiffness {
                    let mut changes = [[0.0; 3]; 8];
                    for (b, w) in weighted() {
                        add_volume_change(&mut changes, &gradient(&u, b), b, w);
                    }
                    add_dyad(&mut self.tangent, changes.as_flattened(), second / volume);
                }
                each
            }
            Cells::Membrane(block, sheets) => {
                let u = moved(block, cell, displacement);
                self.add_triangle(material, &u, &block.rest[cell], &sheets[cell].axes)
            }
            Cells::Bar(block, cord) => {
                let u = moved(block, cell, displacement);
                self.add_bar(material, &u, &block.rest[cell], cord);
                Ok(())
            }
        };
        self.broken = found.err();
    }

    /// One evaluation point, with hourglass control where there is some.
    fn fill_plain<const N: usize>(
        &mut self,
        material: CellMaterial<'_>,
        (solid, block): (&Solid, &CellBlock<N>),
        cell: usize,
        displacement: impl Fn(u32) -> Vector<f64>,
    ) -> Result<(), Broken> {
        let u = moved(block, cell, displacement);
        let rest = &block.rest[cell];
        self.add_point(material, &u, &rest.gradient, rest.volume, Part::Whole)?;
        if let Some(control) = &block.hourglass {
            let growth = solid.hourglass_growth().map(|shear| (shear, &rest.gradient));
            self.add_hourglass(material, control, cell, &u, growth);
        }
        Ok(())
    }

    /// Adds the energy ½ k g Σ |q_c|² of hourglass control. `growth` gives the shear modulus at rest [Pa] and
    /// the gradients of the shape functions [1/m]; without `growth`, g is 1.
    fn add_hourglass<const N: usize>(
        &mut self,
        material: CellMaterial<'_>,
        control: &Hourglass<f64, N>,
        cell: usize,
        u: &[Vector<f64>; N],
        growth: Option<(f64, &[Vector<f64>; N])>,
    ) {
        let amplitudes = control.patterns[cell]
            .map(|pattern| u.iter().zip(pattern).fold([0.0; 3], |q, (&u, gamma)| add(q, scale(u, gamma))));
        let constant = 0.5 * control.stiffness[cell] * amplitudes.iter().map(|&q| dot(q, q)).sum::<f64>();
        let grown = growth.map(|(shear, shape)| material.growth(&gradient(u, shape), shear));
        let factor = grown.map_or(1.0, |(factor, _)| factor);
        let k = factor * control.stiffness[cell];
        self.hourglass = factor * constant;
        self.energy += self.hourglass;
        // Σ_c k₀ γ_ca q_c, the gradient of the constant energy.
        let mut resistance = [[0.0; 3]; N];
        for (pattern, &q) in control.patterns[cell].iter().zip(&amplitudes) {
            for (a, &gamma) in pattern.iter().enumerate() {
                resistance[a] = add(resistance[a], scale(q, gamma * control.stiffness[cell]));
            }
        }
        for (a, &f) in resistance.iter().enumerate() {
            add_to(&mut self.force, a, scale(f, factor));
        }
        if material.stiffness {
            for pattern in &control.patterns[cell] {
                for (b, &gb) in pattern.iter().enumerate() {
                    for (a, &ga) in pattern.iter().enumerate() {
                        for c in 0..3 {
                            self.tangent[(3 * b + c) * 3 * N + 3 * a + c] += k * ga * gb;
                        }
                    }
                }
            }
        }
        let (Some((shear, shape)), Some((_, slope))) = (growth, grown) else { return };
        if factor == 1.0 || constant == 0.0 {
            return;
        }
        let slopes = shape.map(|b| slope.apply(b));
        for (a, &f) in slopes.iter().enumerate() {
            add_to(&mut self.force, a, scale(f, constant));
        }
        if material.stiffness {
            add_symmetric_dyads(&mut self.tangent, resistance.as_flattened(), slopes.as_flattened());
            let second = material.growth_curvature(&gradient(u, shape), shear);
            add_second(&mut self.tangent, &second, shape, constant);
        }
    }

    /// Adds a point of weight `w` [m³] with the gradients `shape` [1/m].
    fn add_point<const N: usize>(
        &mut self,
        material: CellMaterial<'_>,
        u: &[Vector<f64>; N],
        shape: &[Vector<f64>; N],
        w: f64,
        part: Part,
    ) -> Result<(), Broken> {
        let h = gradient(u, shape);
        let ratio = 1.0 + volume_change(&h);
        if is_inverted(ratio) {
            return Err(Broken::Inverted(ratio));
        }
        if let (AnyLaw::Corotational(law), Part::Whole, []) = (material.law, part, material.lag.kept) {
            let tangent = material.stiffness.then_some(&mut self.tangent[..]);
            self.energy += w * closed::add_point(law, &h, shape, w, &mut self.force, tangent)?;
            return Ok(());
        }
        let deformation = Deformation::from_displacement_gradient(&h);
        let energy = material.law.energy(&deformation, material.fibres);
        let kept = material.lag.kept.first().copied();
        let stress = material.taken(material.law.stress(&deformation, material.fibres), part)
            + kept.unwrap_or(Symmetric::ZERO);
        let ([shares, volume], [remembered, shape_counts, volume_counts]) =
            (material.lag.factors, material.lag.counts);
        if shape_counts {
            self.energy += w * (shares * energy.isochoric);
        }
        if let (Some(kept), true) = (kept, remembered) {
            self.energy += 0.5 * w * kept.double_dot(&Symmetric::green_lagrange_twice(&h));
        }
        let mut piola = deformation.gradient.times_symmetric(&stress);
        match part {
            Part::Whole if volume_counts => self.energy += w * (volume * energy.volumetric),
            Part::Whole => {}
            Part::Shape(pressure) => piola = piola.plus_scaled(&deformation.gradient.cofactor(), pressure),
        }
        for (a, &b) in shape.iter().enumerate() {
            add_to(&mut self.force, a, scale(piola.apply(b), w));
        }
        if material.stiffness {
            let tangent = material.law.tangent(&h, material.fibres, |stress| material.taken(stress, part));
            add_material(&mut self.tangent, &deformation.gradient, &tangent, &stress, shape, w);
            if let Part::Shape(pressure) = part {
                add_pressure(&mut self.tangent, &deformation.gradient, shape, w * pressure);
            }
        }
        Ok(())
    }
}

/// Material of a cell.
#[derive(Clone, Copy)]
struct CellMaterial<'a> {
    law: &'a AnyLaw,
    fibres: &'a [Vector<f64>],
    /// Relaxation of its stresses, from the current point on.
    lag: Lag<'a>,
    /// True if the stiffness is wanted.
    stiffness: bool,
}

impl CellMaterial<'_> {
    /// Returns the material with the relaxation from a later point on.
    fn at(self, point: usize) -> Self {
        let kept = self.lag.kept.get(point..).unwrap_or_default();
        Self { lag: Lag { kept, ..self.lag }, ..self }
    }

    /// The stress that a point takes from an elastic stress.
    fn taken(&self, elastic: Split<Symmetric<f64>>, part: Part) -> Symmetric<f64> {
        let [shape, volume] = self.lag.factors;
        part.of(Split { isochoric: elastic.isochoric * shape, volumetric: elastic.volumetric * volume })
    }
}

/// Size of the differences of F from which the growth of hourglass control is found. Differences of
/// differences lose half of the digits at a smaller one, so they are of fourth order.
const DIFFERENCE: f64 = 1e-4;

/// (8 (f(h) − f(−h)) − f(2h) + f(−2h))/(12h) has these weights at the h of [`DIFFERENCE`].
const WEIGHTS: [(f64, f64); 4] = [(1.0, 8.0), (-1.0, -8.0), (2.0, -1.0), (-2.0, 1.0)];

impl CellMaterial<'_> {
    /// The factor g on the stiffness of hourglass control at a displacement gradient, and ∂g/∂F.
    fn growth(&self, h: &Tensor<f64>, shear: f64) -> (f64, Tensor<f64>) {
        let stress = |deformation: &Deformation<f64>| {
            let Split { isochoric, volumetric } = self.law.stress(deformation, self.fibres);
            isochoric + volumetric
        };
        let deformation = Deformation::from_displacement_gradient(h);
        let here = stress(&deformation);
        let growth = ShearGrowth::new(&deformation, &here, shear);
        if growth.factor == 1.0 {
            return (1.0, Tensor::ZERO);
        }
        let direction = growth.direction(&deformation);
        let derivative = WEIGHTS.into_iter().fold(Symmetric::ZERO, |sum, (at, weight)| {
            let moved = h.plus_scaled(&direction, at * DIFFERENCE);
            let there = stress(&Deformation::from_displacement_gradient(&moved));
            sum.plus_scaled(&there, weight / (12.0 * DIFFERENCE))
        });
        let gradient = growth.gradient(&deformation, &here, &derivative);
        (growth.factor, deformation.gradient.times_symmetric(&gradient))
    }

    /// ∂²g/∂F², by the entries of F, row by row: symmetric.
    fn growth_curvature(&self, h: &Tensor<f64>, shear: f64) -> [[f64; 9]; 9] {
        let columns: [[f64; 9]; 9] = std::array::from_fn(|entry| {
            let change = WEIGHTS.into_iter().fold(Tensor::ZERO, |sum, (at, weight)| {
                let mut moved = *h;
                moved.0[entry / 3][entry % 3] += at * DIFFERENCE;
                sum.plus_scaled(&self.growth(&moved, shear).1, weight / (12.0 * DIFFERENCE))
            });
            std::array::from_fn(|k| change.0[k / 3][k % 3])
        });
        std::array::from_fn(|p| std::array::from_fn(|q| 0.5 * (columns[p][q] + columns[q][p])))
    }
}

/// Part of a law that a point takes.
#[derive(Clone, Copy)]
enum Part {
    /// The whole stress.
    Whole,
    /// The change of shape, and the pressure U′ [Pa] of an average.
    Shape(f64),
}

impl Part {
    fn of(self, stress: Split<Symmetric<f64>>) -> Symmetric<f64> {
        match self {
            Self::Whole => stress.isochoric + stress.volumetric,
            Self::Shape(_) => stress.isochoric,
        }
    }
}

/// det F at the worst corner of a flat hexahedron, if that is inverted.
fn inverted_corner(solid: &Solid, cell: usize, displacement: impl Fn(u32) -> Vector<f64>) -> Option<f64> {
    let flatness = match &solid.cells {
        Cells::Hex8(block) => {
            let u = moved(block, cell, &displacement);
            let h = gradient(&u, &block.rest[cell].gradient);
            let strain = Symmetric::green_lagrange_twice(&h);
            let square = strain.commuting_product(&strain).trace();
            (1.0 + volume_change(&h)) / (1.0 + 0.5 * square).sqrt()
        }
        Cells::FullHex8(block, points) => {
            let u = moved(block, cell, &displacement);
            let weighted = points[cell].gradient.iter().zip(points[cell].weight);
            let volume = |(b, w): (&[Vector<f64>; 8], f64)| w * (1.0 + volume_change(&gradient(&u, b)));
            weighted.map(volume).sum::<f64>() / block.rest[cell].volume
        }
        Cells::Tet4(_) | Cells::AveragedTet4(..) | Cells::Membrane(..) | Cells::Bar(..) => return None,
    };
    let (_, determinant) = solid.cells.worst_corner(cell, displacement).filter(|_| flatness < FLAT_HEX)?;
    is_inverted(determinant).then_some(determinant)
}

/// True if a determinant is zero, negative or not a number.
fn is_inverted(determinant: f64) -> bool {
    determinant.is_nan() || determinant <= 0.0
}

/// Displacements [m] of the nodes of a cell relative to its first one, which keeps the digits of small
/// strains.
fn moved<const N: usize>(
    block: &CellBlock<N>,
    cell: usize,
    displacement: impl Fn(u32) -> Vector<f64>,
) -> [Vector<f64>; N] {
    let u = block.nodes[cell].map(displacement);
    u.map(|nodal| sub(nodal, u[0]))
}

/// Strain of a point.
pub(crate) enum Strained {
    /// A point of a solid, with ∂u/∂X.
    Solid(Tensor<f64>),
    /// A point of a wall, with C₁₁ − 1, C₂₂ − 1 and C₁₂ in its frame.
    Wall([f64; 3]),
}

impl Strained {
    /// 2 E.
    pub(crate) fn twice(&self) -> Symmetric<f64> {
        match self {
            Self::Solid(h) => Symmetric::green_lagrange_twice(h),
            &Self::Wall([xx, yy, xy]) => Symmetric([xx, yy, 0.0, xy, 0.0, 0.0]),
        }
    }

    /// The elastic stress of a law [Pa]. For a wall it is returned as the isochoric part.
    pub(crate) fn stress(&self, law: &AnyLaw, fibres: &[Vector<f64>]) -> Split<Symmetric<f64>> {
        match self {
            Self::Solid(h) => law.stress(&Deformation::from_displacement_gradient(h), fibres),
            &Self::Wall(strain_twice) => {
                let [xx, yy, xy] = law.plane_stress(strain_twice, fibres).stress;
                Split { isochoric: Symmetric([xx, yy, 0.0, xy, 0.0, 0.0]), volumetric: Symmetric::ZERO }
            }
        }
    }
}

/// Visits the points of a cell with their weights [m³]. Bars have none.
pub(crate) fn visit_points(
    solid: &Solid,
    cell: usize,
    displacement: impl Fn(u32) -> Vector<f64>,
    mut visit: impl FnMut(usize, f64, Strained),
) {
    match &solid.cells {
        Cells::Tet4(block) | Cells::AveragedTet4(block, _) => {
            let (u, rest) = (moved(block, cell, displacement), &block.rest[cell]);
            visit(0, rest.volume, Strained::Solid(gradient(&u, &rest.gradient)));
        }
        Cells::Hex8(block) => {
            let (u, rest) = (moved(block, cell, displacement), &block.rest[cell]);
            visit(0, rest.volume, Strained::Solid(gradient(&u, &rest.gradient)));
        }
        Cells::FullHex8(block, points) => {
            let u = moved(block, cell, displacement);
            for (point, (b, w)) in points[cell].gradient.iter().zip(points[cell].weight).enumerate() {
                visit(point, w, Strained::Solid(gradient(&u, b)));
            }
        }
        Cells::Membrane(block, sheets) => {
            let (u, rest) = (moved(block, cell, displacement), &block.rest[cell]);
            let changes = membrane::changes(&u, &membrane::in_frame(rest, &sheets[cell].axes));
            let plane = InPlane::from_changes(&sheets[cell].axes, &changes);
            visit(0, rest.volume, Strained::Wall(plane.strain_twice));
        }
        Cells::Bar(..) => {}
    }
}

/// ∂u/∂X.
fn gradient(u: &[Vector<f64>], shape: &[Vector<f64>]) -> Tensor<f64> {
    let mut h = Tensor::ZERO;
    for (&u, &b) in u.iter().zip(shape) {
        h.add_outer(u, b);
    }
    h
}

/// J − 1 without cancellation.
fn volume_change(h: &Tensor<f64>) -> f64 {
    h.trace() + h.second_invariant() + h.determinant()
}

fn add_to(force: &mut [f64], node: usize, by: Vector<f64>) {
    for (sum, by) in force[3 * node..3 * node + 3].iter_mut().zip(by) {
        *sum += by;
    }
}

/// Adds w cof F B_a, the derivative of w J by each node's place.
fn add_volume_change(changes: &mut [Vector<f64>], h: &Tensor<f64>, shape: &[Vector<f64>], w: f64) {
    let cofactor = with_identity(h).cofactor();
    for (change, &b) in changes.iter_mut().zip(shape) {
        *change = add(*change, scale(cofactor.apply(b), w));
    }
}

fn with_identity(h: &Tensor<f64>) -> Tensor<f64> {
    Tensor::IDENTITY.plus_scaled(h, 1.0)
}

/// Adds s v ⊗ v.
fn add_dyad(tangent: &mut [f64], v: &[f64], s: f64) {
    for (column, &x) in tangent.chunks_exact_mut(v.len()).zip(v) {
        for (entry, &y) in column.iter_mut().zip(v) {
            *entry += s * x * y;
        }
    }
}

/// Adds v ⊗ w + w ⊗ v.
fn add_symmetric_dyads(tangent: &mut [f64], v: &[f64], w: &[f64]) {
    for (column, (&x, &y)) in tangent.chunks_exact_mut(v.len()).zip(v.iter().zip(w)) {
        for (entry, (&a, &b)) in column.iter_mut().zip(v.iter().zip(w)) {
            *entry += x * b + y * a;
        }
    }
}

/// Adds w B_a·A B_b of second derivatives A by the entries of F, row by row.
fn add_second<const N: usize>(tangent: &mut [f64], second: &[[f64; 9]; 9], shape: &[Vector<f64>; N], w: f64) {
    for (b, k) in (0..N).flat_map(|b| (0..3).map(move |k| (b, k))) {
        // A B_b of component k.
        let along = second.map(|row| w * dot([row[3 * k], row[3 * k + 1], row[3 * k + 2]], shape[b]));
        for (a, i) in (0..N).flat_map(|a| (0..3).map(move |i| (a, i))) {
            let part = [along[3 * i], along[3 * i + 1], along[3 * i + 2]];
            tangent[(3 * b + k) * 3 * N + 3 * a + i] += dot(part, shape[a]);
        }
    }
}

/// Adds w (𝔹_aᵀ D 𝔹_b + (B_a·S B_b) I). 𝔹_a is the derivative of the engineering strains by the position of a
/// node.
fn add_material<const N: usize>(
    tangent: &mut [f64],
    f: &Tensor<f64>,
    d: &[[f64; 6]; 6],
    stress: &Symmetric<f64>,
    shape: &[Vector<f64>; N],
    w: f64,
) {
    // Of each node its three columns of 𝔹: row i of F with B.
    let strains = |b: &Vector<f64>| {
        f.0.map(|row| {
            [
                row[0] * b[0],
                row[1] * b[1],
                row[2] * b[2],
                row[0] * b[1] + row[1] * b[0],
                row[1] * b[2] + row[2] * b[1],
                row[0] * b[2] + row[2] * b[0],
            ]
        })
    };
    let by_node: [[[f64; 6]; 3]; N] = std::array::from_fn(|a| strains(&shape[a]));
    for (b, columns) in by_node.iter().enumerate() {
        let pulled = scale(stress.apply(shape[b]), w);
        for (k, column) in columns.iter().enumerate() {
            let stressed: [f64; 6] = d.map(|row| w * row.iter().zip(column).map(|(d, e)| d * e).sum::<f64>());
            let start = (3 * b + k) * 3 * N;
            for (a, other) in by_node.iter().enumerate() {
                for (i, row) in other.iter().enumerate() {
                    tangent[start + 3 * a + i] += row.iter().zip(&stressed).map(|(e, s)| e * s).sum::<f64>();
                }
                tangent[start + 3 * a + k] += dot(shape[a], pulled);
            }
        }
    }
}

/// Adds the derivative of p cof F B_a by positions. It is p ε_ikm (F (B_a × B_b))_m between component i of
/// node a and k of b.
fn add_pressure<const N: usize>(tangent: &mut [f64], f: &Tensor<f64>, shape: &[Vector<f64>; N], p: f64) {
    for b in 0..N {
        for a in 0..N {
            let [x, y, z] = scale(f.apply(cross(shape[a], shape[b])), p);
            let block = [[0.0, -z, y], [z, 0.0, -x], [-y, x, 0.0]];
            for (k, column) in block.iter().enumerate() {
                for (i, entry) in column.iter().enumerate() {
                    tangent[(3 * b + k) * 3 * N + 3 * a + i] += entry;
                }
            }
        }
    }
}

/// Reason why a solid cannot be in a model with stiffness; `None` if it can.
pub(crate) fn refusal(solid: &Solid) -> Option<&'static str> {
    let averaging = match &solid.cells {
        Cells::AveragedTet4(_, averaging) => Some(averaging),
        _ => None,
    };
    match averaging {
        Some(Averaging::Variational) => Some(
            "`tet4-ianp` couples each tetrahedron with two rings of neighbours, and its stiffness is not \
             available; take `tet4-anp`",
        ),
        Some(Averaging::NiftySim) => Some("this average is not the gradient of an energy; take `tet4-anp`"),
        _ if solid.cells.averages_pressure() && !solid.material.prony.volumetric.is_empty() => Some(
            "its element averages the pressure, but the volumetric part of its law relaxes; take `tet4` or \
             `hex8`, or the solver `quasi-static` or `explicit`",
        ),
        _ if matches!(solid.cells, Cells::Bar(..)) && !solid.material.prony.is_elastic() => Some(
            "the stiffness of a viscoelastic bar is not available; take the solver `quasi-static` or \
             `explicit`",
        ),
        _ if solid.cells.averages_pressure() && !solid.material.law.has_volumetric_energy() => Some(
            "its element averages the pressure, and its law has no energy of the volume alone; take `tet4` or `hex8`",
        ),
        _ => None,
    }
}

/// An upper bound of a cell's ω² [1/s²] at rest by itself, with its lumped mass: (M Σ w |B|² + k Σγ²)/m, M
/// the longitudinal modulus.
pub(crate) fn highest_frequency_squared(solid: &Solid, cell: usize) -> f64 {
    let cells = &solid.cells;
    let share = solid.material.density * cells.volume(cell) / cells.nodes_per_cell() as f64;
    let squares = match cells {
        Cells::FullHex8(_, points) => {
            let square = |b: &[Vector<f64>; 8]| b.iter().map(|&b| dot(b, b)).sum::<f64>();
            points[cell].gradient.iter().zip(points[cell].weight).map(|(b, w)| w * square(b)).sum()
        }
        _ => cells.volume(cell) * cells.gradient_square_sum(cell),
    };
    let control = match cells {
        Cells::Hex8(CellBlock { hourglass: Some(control), .. }) => {
            control.stiffness[cell] * control.patterns[cell].iter().flatten().map(|g| g * g).sum::<f64>()
        }
        _ => 0.0,
    };
    (solid.longitudinal_modulus() * squares + control) / share
}
