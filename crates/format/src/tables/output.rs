//! Outputs.

use std::collections::BTreeMap;

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use super::BodyModel;

/// A field of a body.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Deserialize, Serialize, JsonSchema)]
#[serde(rename_all = "kebab-case")]
pub enum FieldName {
    /// Displacement [m].
    Displacement,
    /// Velocity [m/s].
    Velocity,
    /// Rotation vector [rad] of the nodes of shells, of length at most π.
    Rotation,
    /// Force [N] by which constraints hold or move a node; zero for free nodes.
    Reaction,
    /// Moment [N m] by which constraints hold or turn a node of a shell about itself; zero for free nodes.
    ReactionMoment,
    /// Deformation gradient F of a solid, a membrane or a bar, as the mean over the element. The thickness of
    /// membranes and bars stays constant in F. Nine numbers xx, xy, xz, yx, …, zz: xy is the change of x
    /// along y at rest.
    DeformationGradient,
    /// Cauchy stress [Pa].
    CauchyStress,
    /// Second Piola–Kirchhoff stress [Pa].
    Pk2Stress,
    /// Von Mises stress [Pa]; of a shell the largest of top, middle and bottom.
    VonMises,
    /// Green–Lagrange strain.
    GreenStrain,
    /// Unit fibre direction at rest; zero where the law has none.
    Fibre,
    /// Stretch along the fibre; not a number where the law has none.
    FibreStretch,
    /// Pressure [Pa], minus a third of the trace of the Cauchy stress.
    Pressure,
    /// Volume ratio J in the law's volumetric part, to which `pressure` belongs: det F of the element. For
    /// `tet4-anp` and the other averaged tets it is the mean over the nodes, for `hex8-full` the mean over
    /// the element.
    #[serde(rename = "J")]
    VolumeRatio,
    /// The element's own det F, whatever its `J` is.
    #[serde(rename = "cell-J")]
    CellVolumeRatio,
    /// Strain energy of the instantaneous elastic law per volume at rest [J/m³], with the element's averages
    /// of volume. Summed over the elements, times their volumes, it is the stored energy.
    EnergyDensity,
    /// Critical time step [s] of the element alone, from its current stiffness; for shells from the stiffness
    /// at rest, which turns with them. The smallest value bounds the step of the whole model.
    ElementStep,
    /// Force per length in the wall of a shell or a membrane [N/m], as a tensor in space.
    MembraneForce,
    /// Moment per length in the wall of a shell [N], as a tensor in space; positive where the top is in
    /// tension.
    BendingMoment,
    /// Stress at the top of a shell [Pa], half the thickness along its normal.
    StressTop,
    /// Stress in the middle of a shell [Pa].
    StressMiddle,
    /// Stress at the bottom of a shell [Pa].
    StressBottom,
    /// Energy of stretching a shell, per area at rest [J/m²].
    MembraneEnergy,
    /// Energy of bending and twisting a shell, per area at rest [J/m²].
    BendingEnergy,
    /// Energy of nodes of a shell that turn about the normal differently from their triangle, per area at
    /// rest [J/m²]. It is artificial; a large value means that the mesh is too coarse.
    DrillingEnergy,
    /// Thickness of a shell or a membrane at rest [m].
    Thickness,
    /// Thickness [m] with the transverse strain of plane stress. For a membrane its law gives it. For a shell
    /// it is t (A/A₀)^(−ν/(1−ν)), and does not change its forces.
    CurrentThickness,
    /// Length of a bar over its length without force.
    AxialStretch,
    /// Force along a bar [N], positive where it pulls.
    AxialForce,
    /// Largest size of the principal strains of a shell at its top and bottom. Small-strain elasticity is
    /// valid to about 0.1.
    SurfaceStrain,
    /// Sum of the forces [N] of contacts on a node.
    ContactForce,
    /// Pressure of contacts [Pa]: the force on a node along their normals, over its share of the deformed
    /// faces that it presses on. Its share is a third of each triangle. Zero for nodes without contact; not a
    /// number for nodes that cannot touch anything.
    ContactPressure,
    /// Least signed distance [m] of a node from the obstacles, tools and bodies that it may touch, less the
    /// `thickness` of the contact. Bodies count up to a quarter of a mean edge. Not a number if nothing is in
    /// reach.
    Gap,
    /// Distance [m] that a node has slid since its contact began; not a number without contact.
    Slip,
    /// Constraint of a node: 0 for free, 1 for held at its place at rest, 2 for moved, 3 for under a plate.
    Constraint,
    /// Force [N] of loads on a node, without weights. Pressures on shells give a third of their force to each
    /// corner.
    Load,
    /// Weight [N] of a node: its mass times the acceleration of gravity.
    Weight,
}

impl FieldName {
    /// List of all fields.
    pub const ALL: [Self; 37] = [
        Self::Displacement,
        Self::Velocity,
        Self::Rotation,
        Self::Reaction,
        Self::ReactionMoment,
        Self::CauchyStress,
        Self::Pk2Stress,
        Self::VonMises,
        Self::GreenStrain,
        Self::DeformationGradient,
        Self::Fibre,
        Self::FibreStretch,
        Self::Pressure,
        Self::VolumeRatio,
        Self::CellVolumeRatio,
        Self::EnergyDensity,
        Self::ElementStep,
        Self::MembraneForce,
        Self::BendingMoment,
        Self::StressTop,
        Self::StressMiddle,
        Self::StressBottom,
        Self::MembraneEnergy,
        Self::BendingEnergy,
        Self::DrillingEnergy,
        Self::Thickness,
        Self::CurrentThickness,
        Self::AxialStretch,
        Self::AxialForce,
        Self::SurfaceStrain,
        Self::ContactForce,
        Self::ContactPressure,
        Self::Gap,
        Self::Slip,
        Self::Constraint,
        Self::Load,
        Self::Weight,
    ];

    /// The name in files.
    pub fn name(self) -> &'static str {
        match self {
            Self::Displacement => "displacement",
            Self::Velocity => "velocity",
            Self::CauchyStress => "cauchy-stress",
            Self::Pk2Stress => "pk2-stress",
            Self::VonMises => "von-mises",
            Self::GreenStrain => "green-strain",
            Self::Fibre => "fibre",
            Self::FibreStretch => "fibre-stretch",
            Self::Pressure => "pressure",
            Self::VolumeRatio => "J",
            Self::CellVolumeRatio => "cell-J",
            Self::EnergyDensity => "energy-density",
            Self::ElementStep => "element-step",
            Self::Rotation => "rotation",
            Self::Reaction => "reaction",
            Self::ReactionMoment => "reaction-moment",
            Self::DeformationGradient => "deformation-gradient",
            Self::MembraneForce => "membrane-force",
            Self::BendingMoment => "bending-moment",
            Self::StressTop => "stress-top",
            Self::StressMiddle => "stress-middle",
            Self::StressBottom => "stress-bottom",
            Self::MembraneEnergy => "membrane-energy",
            Self::BendingEnergy => "bending-energy",
            Self::DrillingEnergy => "drilling-energy",
            Self::Thickness => "thickness",
            Self::CurrentThickness => "current-thickness",
            Self::AxialStretch => "axial-stretch",
            Self::AxialForce => "axial-force",
            Self::SurfaceStrain => "surface-strain",
            Self::ContactForce => "contact-force",
            Self::ContactPressure => "contact-pressure",
            Self::Gap => "gap",
            Self::Slip => "slip",
            Self::Constraint => "constraint",
            Self::Load => "load",
            Self::Weight => "weight",
        }
    }

    /// Returns the field of a name in scenes and files.
    pub fn of_name(name: &str) -> Option<Self> {
        serde_json::from_value(name.into()).ok()
    }

    /// Its unit; empty without one.
    pub fn unit(self) -> &'static str {
        match self {
            Self::Displacement | Self::Thickness | Self::CurrentThickness | Self::Gap | Self::Slip => "m",
            Self::Velocity => "m/s",
            Self::Rotation => "rad",
            Self::Reaction | Self::AxialForce | Self::ContactForce | Self::Load | Self::Weight => "N",
            Self::ReactionMoment => "N m",
            Self::CauchyStress
            | Self::Pk2Stress
            | Self::VonMises
            | Self::Pressure
            | Self::ContactPressure
            | Self::StressTop
            | Self::StressMiddle
            | Self::StressBottom => "Pa",
            Self::GreenStrain
            | Self::DeformationGradient
            | Self::Fibre
            | Self::FibreStretch
            | Self::VolumeRatio
            | Self::CellVolumeRatio
            | Self::AxialStretch
            | Self::SurfaceStrain
            | Self::Constraint => "",
            Self::EnergyDensity => "J/m³",
            Self::ElementStep => "s",
            Self::MembraneForce => "N/m",
            Self::BendingMoment => "N",
            Self::MembraneEnergy | Self::BendingEnergy | Self::DrillingEnergy => "J/m²",
        }
    }

    /// Its name in a picture.
    pub fn title(self) -> &'static str {
        match self {
            Self::Displacement => "displacement",
            Self::Velocity => "velocity",
            Self::Rotation => "rotation",
            Self::Reaction => "reaction",
            Self::ReactionMoment => "reaction moment",
            Self::DeformationGradient => "deformation gradient",
            Self::CauchyStress => "Cauchy stress",
            Self::Pk2Stress => "2nd Piola–Kirchhoff stress",
            Self::VonMises => "von Mises stress",
            Self::GreenStrain => "Green strain",
            Self::Fibre => "fibre",
            Self::FibreStretch => "fibre stretch",
            Self::Pressure => "pressure",
            Self::VolumeRatio => "volume ratio",
            Self::CellVolumeRatio => "volume ratio of the cell",
            Self::EnergyDensity => "energy density",
            Self::ElementStep => "element step",
            Self::MembraneForce => "membrane force",
            Self::BendingMoment => "bending moment",
            Self::StressTop => "stress at the top",
            Self::StressMiddle => "stress in the middle",
            Self::StressBottom => "stress at the bottom",
            Self::MembraneEnergy => "membrane energy",
            Self::BendingEnergy => "bending energy",
            Self::DrillingEnergy => "drilling energy",
            Self::Thickness => "thickness",
            Self::CurrentThickness => "current thickness",
            Self::AxialStretch => "axial stretch",
            Self::AxialForce => "axial force",
            Self::SurfaceStrain => "strain at the surface",
            Self::ContactForce => "contact force",
            Self::ContactPressure => "contact pressure",
            Self::Gap => "gap",
            Self::Slip => "slip",
            Self::Constraint => "constraint",
            Self::Load => "load",
            Self::Weight => "weight",
        }
    }

    /// Numbers per point or cell.
    pub fn components(self) -> usize {
        match self {
            Self::Displacement
            | Self::Velocity
            | Self::Rotation
            | Self::Reaction
            | Self::ReactionMoment
            | Self::Fibre
            | Self::ContactForce
            | Self::Load
            | Self::Weight => 3,
            Self::CauchyStress
            | Self::Pk2Stress
            | Self::GreenStrain
            | Self::DeformationGradient
            | Self::MembraneForce
            | Self::BendingMoment
            | Self::StressTop
            | Self::StressMiddle
            | Self::StressBottom => 9,
            Self::VonMises
            | Self::FibreStretch
            | Self::Pressure
            | Self::VolumeRatio
            | Self::CellVolumeRatio
            | Self::EnergyDensity
            | Self::ElementStep
            | Self::MembraneEnergy
            | Self::BendingEnergy
            | Self::DrillingEnergy
            | Self::Thickness
            | Self::CurrentThickness
            | Self::AxialStretch
            | Self::AxialForce
            | Self::SurfaceStrain
            | Self::ContactPressure
            | Self::Gap
            | Self::Slip
            | Self::Constraint => 1,
        }
    }

    /// True for fields that live on nodes.
    pub fn is_nodal(self) -> bool {
        let moved = matches!(
            self,
            Self::Displacement | Self::Velocity | Self::Rotation | Self::Reaction | Self::ReactionMoment
        );
        moved || self.is_of_contact() || self.is_of_marks()
    }

    /// True for fields of constraints and loads.
    pub(crate) fn is_of_marks(self) -> bool {
        matches!(self, Self::Constraint | Self::Load | Self::Weight)
    }

    /// True for fields of bodies that touch something.
    pub fn is_of_contact(self) -> bool {
        matches!(self, Self::ContactForce | Self::ContactPressure | Self::Gap | Self::Slip)
    }

    /// True for fields that surfaces on solids carry: they have values between the nodes.
    pub fn is_of_surface(self) -> bool {
        let of_nodes = matches!(self, Self::Rotation | Self::Reaction | Self::ReactionMoment);
        !of_nodes && !self.is_of_contact() && !self.is_of_marks()
    }

    /// True for fields that bodies of a model have.
    pub fn is_of(self, model: BodyModel) -> bool {
        match self {
            Self::Displacement
            | Self::Velocity
            | Self::Reaction
            | Self::VonMises
            | Self::ElementStep
            | Self::ContactForce
            | Self::ContactPressure
            | Self::Gap
            | Self::Slip
            | Self::Constraint
            | Self::Load
            | Self::Weight => true,
            Self::CauchyStress
            | Self::EnergyDensity
            | Self::Pk2Stress
            | Self::GreenStrain
            | Self::DeformationGradient => model != BodyModel::Shell,
            Self::Pressure | Self::VolumeRatio | Self::CellVolumeRatio | Self::Fibre | Self::FibreStretch => {
                matches!(model, BodyModel::Solid | BodyModel::Membrane)
            }
            Self::MembraneForce | Self::Thickness | Self::CurrentThickness => {
                matches!(model, BodyModel::Shell | BodyModel::Membrane)
            }
            Self::AxialStretch | Self::AxialForce => model == BodyModel::Bar,
            _ => model == BodyModel::Shell,
        }
    }
}

/// Place at which fields of cells are written.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Deserialize, Serialize, JsonSchema)]
#[serde(rename_all = "kebab-case")]
pub enum At {
    /// On the cells, as computed.
    #[default]
    Cells,
    /// On the points: mean of the cells around, weighted by volume.
    Points,
}

/// A series of VTU files for ParaView, with its `.pvd`.
#[derive(Clone, Debug, Deserialize, JsonSchema)]
#[serde(rename_all = "kebab-case", deny_unknown_fields)]
pub struct VtuTable {
    /// The body or the carried surface, which has fields of cells as means at its points; if not given, all
    /// bodies together.
    #[serde(default)]
    pub on: Option<String>,
    /// Time between frames [s]; the first and the last instant are always written.
    #[schemars(extend("exclusiveMinimum" = 0.0))]
    pub every: f64,
    /// The fields. Tensors have nine components xx, xy, xz, yx, yy, yz, zx, zy, zz in this order; `[view]`
    /// colours by one of them with `component`, and probes of a `csv` output write each into a column.
    #[serde(default = "default_fields")]
    pub data: Vec<FieldName>,
    /// Place at which fields of cells are written.
    #[serde(default)]
    pub at: At,
    /// Parts that each edge of a shell is cut into, to show its curved surface instead of flat triangles.
    #[serde(default)]
    #[schemars(range(min = 1, max = 100))]
    pub curved: Option<u32>,
}

fn default_fields() -> Vec<FieldName> {
    vec![FieldName::Displacement, FieldName::VonMises]
}

/// A table over time: reactions, energies, probes.
#[derive(Clone, Debug, Deserialize, JsonSchema)]
#[serde(rename_all = "kebab-case", deny_unknown_fields)]
pub struct CsvTable {
    /// Time between rows [s]; the first and the last instant are always written.
    #[schemars(extend("exclusiveMinimum" = 0.0))]
    pub every: f64,
    /// Constraints whose reaction [N] is written; if not given, all. Columns `reaction.NAME.x`, `.y`, `.z`:
    /// the sum of the forces by which the constraint holds or moves its nodes.
    #[serde(default)]
    pub reactions: Option<Vec<String>>,
    /// A point [m], fixed in space, about which the moments of these reactions are written [N m], in columns
    /// `moment.NAME.x`, `.y`, `.z`. A moment is the sum of (place − point) × force over the nodes at their
    /// current places. For shells the moments on the nodes are added.
    #[serde(default)]
    pub moments_about: Option<[f64; 3]>,
    /// True to write energies [J].
    #[serde(default = "yes")]
    pub energy: bool,
    /// Points of bodies or surfaces whose fields are written.
    #[serde(default)]
    pub probes: BTreeMap<String, ProbeTable>,
}

fn yes() -> bool {
    true
}

/// A point that is followed.
#[derive(Clone, Debug, Deserialize, JsonSchema)]
#[serde(rename_all = "kebab-case", deny_unknown_fields)]
pub struct ProbeTable {
    /// The body.
    pub on: String,
    /// Its place at rest [m]; outside the body, the nearest cell carries it.
    pub at: [f64; 3],
    /// The fields, in columns `probe.NAME.FIELD`; vectors with `.x`, `.y`, `.z`, tensors with `.xx`, `.xy`,
    /// `.xz`, `.yx`, `.yy`, `.yz`, `.zx`, `.zy`, `.zz`, such as `probe.tip.cauchy-stress.xy`.
    #[serde(default = "default_probe_fields")]
    pub data: Vec<FieldName>,
}

fn default_probe_fields() -> Vec<FieldName> {
    vec![FieldName::Displacement]
}
