//! Values of the fields a user can ask for, at nodes and cells.

use pliant_mechanics::Real;
use pliant_mechanics::recover::CellFields;
use pliant_mechanics::tensor::Symmetric;

use super::Frame;
use crate::format::FieldName;

/// A value of up to nine numbers.
pub(super) type Value = [f64; 9];

/// The value of a nodal field on a node of the model; the first `components` numbers count.
pub(super) fn nodal<R: Real>(frame: &Frame<'_, R>, field: FieldName, node: usize) -> Value {
    let vector = match field {
        FieldName::Velocity => frame.stepper.velocity(frame.state, node),
        _ => frame.state.displacement[node].map(R::to_f64),
    };
    padded(&vector)
}

/// The value of a cell field; the first `components` numbers count.
pub(super) fn of_cell(fields: &CellFields, field: FieldName) -> Value {
    match field {
        FieldName::CauchyStress => tensor(&fields.cauchy_stress),
        FieldName::Pk2Stress => tensor(&fields.pk2_stress),
        FieldName::GreenStrain => tensor(&fields.green_strain),
        FieldName::VonMises => padded(&[fields.von_mises()]),
        FieldName::Fibre => padded(&fields.fibre.unwrap_or_default()),
        FieldName::FibreStretch => padded(&[fields.fibre_stretch.unwrap_or(f64::NAN)]),
        FieldName::Pressure => padded(&[fields.pressure()]),
        FieldName::VolumeRatio => padded(&[fields.volume_ratio]),
        FieldName::EnergyDensity => padded(&[fields.energy_density]),
        FieldName::Displacement | FieldName::Velocity => [f64::NAN; 9],
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
