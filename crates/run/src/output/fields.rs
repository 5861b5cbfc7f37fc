//! Values of the fields a user can ask for, at nodes and cells.

use nalgebra::Matrix3;
use pliant_explicit::NodeContact;
use pliant_explicit::recover::CellFields;
use pliant_format::tables::FieldName;
use pliant_implicit::{Assembly, AssemblyState, ShellFields};
use pliant_mechanics::model::{Model, Motion};
use pliant_mechanics::tensor::Symmetric;
use rayon::prelude::*;

use super::Frame;

/// A value of up to nine numbers.
pub(super) type Value = [f64; 9];

/// Nodal fields at an instant.
pub(super) struct OfNodes<'f, 'p> {
    frame: &'f Frame<'p>,
    /// Nodes that may touch something, increasing; empty where no field of contacts is wanted.
    touching: Vec<NodeContact>,
    /// Forces of loads [N]; empty where they are not wanted.
    loads: Vec<[f64; 3]>,
    /// Weights [N]; empty where they are not wanted.
    weights: Vec<[f64; 3]>,
    /// State of each node: free, held, moved or under a plate; empty where the field is not wanted.
    held: Vec<f64>,
}

/// Values of the field `constraint` at a node that is held, that is moved, and that is under a plate.
const HELD: f64 = 1.0;
const MOVED: f64 = 2.0;
const PLATE: f64 = 3.0;

/// The field `constraint` of all nodes.
fn held(model: &Model) -> Vec<f64> {
    let mut held = vec![0.0; model.node_count()];
    for constraint in &model.constraints {
        let mark = match constraint.motion {
            Motion::Fixed => HELD,
            Motion::Mean { .. } => PLATE,
            _ => MOVED,
        };
        for &node in &constraint.nodes {
            held[node as usize] = mark.max(held[node as usize]);
        }
    }
    held
}

impl<'f, 'p> OfNodes<'f, 'p> {
    /// Finds those that are wanted.
    pub fn new(frame: &'f Frame<'p>, wanted: impl Iterator<Item = FieldName>) -> Self {
        let (model, now, wanted) = (&frame.built().model, frame.now, wanted.collect::<Vec<_>>());
        let mut found =
            Self { frame, touching: Vec::new(), loads: Vec::new(), weights: Vec::new(), held: Vec::new() };
        if wanted.iter().any(|field| field.is_of_contact()) {
            found.touching = now.contact_nodes();
        }
        if wanted.contains(&FieldName::Constraint) {
            found.held = held(model);
        }
        if wanted.contains(&FieldName::Load) {
            let moved: Vec<_> = (0..model.node_count()).map(|node| now.displacement(node)).collect();
            found.loads = frame.built().load_forces(now.time(), &moved);
        }
        if wanted.contains(&FieldName::Weight) {
            found.weights = model.weights(now.time());
        }
        found
    }

    /// The value of a field on a node of the model; the first `components` numbers count.
    pub fn value(&self, field: FieldName, node: usize) -> Value {
        let now = self.frame.now;
        match field {
            FieldName::Velocity => padded(&now.velocity(node)),
            FieldName::Reaction => padded(&now.nodal_reaction(node)),
            FieldName::ReactionMoment => padded(&now.nodal_reaction_moment(node)),
            FieldName::Rotation => padded(&now.rotation(node)),
            FieldName::Constraint => padded(&[self.held[node]]),
            FieldName::Load => padded(&self.loads[node]),
            FieldName::Weight => padded(&self.weights[node]),
            _ if field.is_of_contact() => self.of_contact(field, node),
            _ => padded(&now.displacement(node)),
        }
    }

    fn of_contact(&self, field: FieldName, node: usize) -> Value {
        let found = self.touching.binary_search_by_key(&node, |touched| touched.node as usize);
        let touched = found.ok().map(|at| &self.touching[at]);
        let number = match field {
            FieldName::ContactForce => return padded(&touched.map_or([0.0; 3], |touched| touched.force)),
            FieldName::ContactPressure => touched.and_then(|touched| touched.pressure),
            FieldName::Gap => touched.and_then(|touched| touched.gap),
            _ => touched.and_then(|touched| touched.slip),
        };
        padded(&[number.unwrap_or(f64::NAN)])
    }
}

/// The value of a cell field; the first `components` numbers count.
pub(super) fn of_cell(fields: &CellFields, field: FieldName) -> Value {
    match field {
        FieldName::ElementStep => padded(&[fields.stable_step.unwrap_or(f64::NAN)]),
        FieldName::CauchyStress => tensor(&fields.cauchy_stress),
        FieldName::Pk2Stress => tensor(&fields.pk2_stress),
        FieldName::GreenStrain => tensor(&fields.green_strain),
        FieldName::DeformationGradient => padded(fields.gradient.0.as_flattened()),
        FieldName::VonMises => padded(&[fields.von_mises()]),
        FieldName::Fibre => padded(&fields.fibre.unwrap_or_default()),
        FieldName::FibreStretch => padded(&[fields.fibre_stretch.unwrap_or(f64::NAN)]),
        FieldName::Pressure => padded(&[fields.pressure()]),
        FieldName::VolumeRatio => padded(&[fields.volume_ratio]),
        FieldName::CellVolumeRatio => padded(&[fields.cell_volume_ratio]),
        FieldName::EnergyDensity => padded(&[fields.energy_density]),
        FieldName::MembraneForce => fields.membrane_force().map_or([f64::NAN; 9], |force| tensor(&force)),
        FieldName::Thickness => padded(&[fields.thickness.map_or(f64::NAN, |[rest, _]| rest)]),
        FieldName::CurrentThickness => padded(&[fields.thickness.map_or(f64::NAN, |[_, now]| now)]),
        FieldName::AxialStretch => padded(&[fields.axial.map_or(f64::NAN, |[stretch, _]| stretch)]),
        FieldName::AxialForce => padded(&[fields.axial.map_or(f64::NAN, |[_, force]| force)]),
        _ => [f64::NAN; 9],
    }
}

fn padded(values: &[f64]) -> Value {
    let mut value = [0.0; 9];
    value[..values.len()].copy_from_slice(values);
    value
}

fn tensor(symmetric: &Symmetric<f64>) -> Value {
    let [xx, yy, zz, xy, yz, xz] = symmetric.0;
    [xx, xy, xz, xy, yy, yz, xz, yz, zz]
}

/// Fields of the triangles of shells at an instant.
#[derive(Default)]
pub(super) struct OfShells {
    shells: ShellFields,
    /// Stable steps of the triangles [s], once they are wanted: they don't change.
    steps: Vec<f64>,
}

impl OfShells {
    /// Finds them for the instant of a frame.
    pub fn fill(&mut self, model: &Assembly, state: &AssemblyState, wanted: &[FieldName]) {
        if wanted.contains(&FieldName::ElementStep) && self.steps.is_empty() {
            self.steps = model.facets.par_iter().map(|facet| facet.stable_step()).collect();
        }
        // A folded element has ended the run before an observer sees it.
        let _ = self.shells.fill(model, state);
    }

    /// The value of a field in a triangle, numbered in the model; the first `components` numbers count.
    pub fn of(&self, model: &Assembly, facet: u32, field: FieldName) -> Value {
        let matrix = |matrix: &Matrix3<f64>| {
            let mut value = [0.0; 9];
            value.copy_from_slice(matrix.as_slice());
            value
        };
        let (at, fields) = (facet as usize, &self.shells);
        match field {
            FieldName::VonMises => padded(&[fields.largest[at]]),
            FieldName::MembraneForce => matrix(&fields.membrane[at]),
            FieldName::BendingMoment => matrix(&fields.moment[at]),
            FieldName::StressTop => matrix(&fields.stress[0][at]),
            FieldName::StressMiddle => matrix(&fields.stress[1][at]),
            FieldName::StressBottom => matrix(&fields.stress[2][at]),
            FieldName::MembraneEnergy => padded(&[fields.energy[at].membrane]),
            FieldName::BendingEnergy => padded(&[fields.energy[at].bending]),
            FieldName::DrillingEnergy => padded(&[fields.energy[at].drilling]),
            FieldName::Thickness => padded(&[model.facets[at].thickness]),
            FieldName::CurrentThickness => padded(&[fields.thickness[at]]),
            FieldName::SurfaceStrain => padded(&[fields.strain[at].surface]),
            FieldName::ElementStep => padded(&[self.steps.get(at).copied().unwrap_or(f64::NAN)]),
            _ => [f64::NAN; 9],
        }
    }
}
