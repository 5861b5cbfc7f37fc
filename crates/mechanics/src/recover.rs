//! Fields recovered from a state: strains, stresses and energies of the cells, in double precision.

use crate::Real;
use crate::law::{Deformation, Split};
use crate::model::{Model, Solid, with_cells};
use crate::state::State;
use crate::tensor::{Symmetric, Tensor, Vector, add, cast, dot, scale, sub};

/// The state of one cell.
#[derive(Clone, Copy, Debug)]
pub struct CellFields {
    /// Deformation gradient F (mean over the cell).
    pub gradient: Tensor<f64>,
    /// J = det F.
    pub volume_ratio: f64,
    /// Green–Lagrange strain.
    pub green_strain: Symmetric<f64>,
    /// Second Piola–Kirchhoff stress [Pa], relaxation included.
    pub pk2_stress: Symmetric<f64>,
    /// Cauchy stress [Pa].
    pub cauchy_stress: Symmetric<f64>,
    /// Strain energy per reference volume [J/m³] of the instantaneous elastic law.
    pub energy_density: f64,
    /// Length of the deformed unit fibre; `None` if the law has none.
    pub fibre_stretch: Option<f64>,
}

impl CellFields {
    /// Von Mises stress [Pa]: √(3/2 s:s) of the Cauchy stress.
    pub fn von_mises(&self) -> f64 {
        let [xx, yy, zz, xy, yz, xz] = self.cauchy_stress.0;
        let normal = (xx - yy).powi(2) + (yy - zz).powi(2) + (zz - xx).powi(2);
        (0.5 * normal + 3.0 * (xy * xy + yz * yz + xz * xz)).sqrt()
    }

    /// Pressure [Pa]: minus a third of the trace of the Cauchy stress.
    pub fn pressure(&self) -> f64 {
        -self.cauchy_stress.trace() / 3.0
    }
}

/// The fields of one cell of a solid. The history of a relaxing law belongs to the last evaluated instant: ask between
/// [`evaluate`](crate::CentralDifference::evaluate) and [`advance`](crate::CentralDifference::advance).
pub fn cell_fields<R: Real>(model: &Model, state: &State<R>, solid: usize, cell: usize) -> CellFields {
    let part = &model.solids[solid];
    let h = displacement_gradient(part, cell, &state.displacement);
    let deformation = Deformation::from_displacement_gradient(&h);
    let fibre = part.fibre.get(cell).copied();
    let a = fibre.unwrap_or([0.0; 3]);
    let Split { isochoric, volumetric } = part.material.law.energy(&deformation, a);
    let elastic = part.material.law.stress(&deformation, a);
    let slots = part.material.prony.slots();
    let own = &state.history[solid][cell * slots..(cell + 1) * slots];
    let history: Vec<Symmetric<f64>> = own.iter().map(|h| Symmetric(h.0.map(R::to_f64))).collect();
    let pk2_stress = part.material.prony.stress(elastic, &history);
    let cauchy = pk2_stress.push_forward(&deformation.gradient) * (1.0 / deformation.volume_ratio);
    let stretch = |a: Vector<f64>| {
        let deformed = deformation.gradient.apply(a);
        dot(deformed, deformed).sqrt()
    };
    CellFields {
        gradient: deformation.gradient,
        volume_ratio: deformation.volume_ratio,
        green_strain: deformation.strain_twice * 0.5,
        pk2_stress,
        cauchy_stress: cauchy,
        energy_density: isochoric + volumetric,
        fibre_stretch: fibre.map(stretch),
    }
}

fn displacement_gradient<R: Real>(solid: &Solid, cell: usize, displacement: &[Vector<R>]) -> Tensor<f64> {
    let mut h = Tensor::ZERO;
    with_cells!(&solid.cells, block => {
        let nodes = &block.nodes[cell];
        let origin: Vector<f64> = cast(displacement[nodes[0] as usize]);
        for (&node, &b) in nodes.iter().zip(&block.rest[cell].gradient) {
            h.add_outer(sub(cast(displacement[node as usize]), origin), b);
        }
    });
    h
}

/// The centre of a cell in its current place [m].
pub fn cell_centre<R: Real>(model: &Model, state: &State<R>, solid: usize, cell: usize) -> Vector<f64> {
    let nodes = model.solids[solid].cells.nodes(cell);
    let place = |&node: &u32| add(model.rest[node as usize], cast(state.displacement[node as usize]));
    scale(nodes.iter().map(place).fold([0.0; 3], add), 1.0 / nodes.len() as f64)
}
