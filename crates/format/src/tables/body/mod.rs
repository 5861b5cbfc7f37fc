//! Bodies, their meshes, and the surfaces they carry.

mod mesh;
mod shapes;

use std::collections::BTreeMap;

use pliant_geometry::Selection;
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

pub use self::mesh::{Cells, CleanTable, Fix, Fixes, Label, LabelGroup, LabelOrGroups, MeshTable, Protected};
pub use self::shapes::{
    AnnulusShape, BlockShape, CylinderShape, EllipsoidShape, HemisphereShape, LensShape, Organ, PatternName,
    PlateShape, SheetGrid, SphereShape, TubeShape, TwistedStripShape,
};
use super::{NodeVectors, Rotations};

/// A body.
#[derive(Clone, Debug, Deserialize, JsonSchema)]
#[serde(rename_all = "kebab-case", deny_unknown_fields)]
pub struct BodyTable {
    /// Model of the body; if not given, `solid`, or `membrane` with `on`. With the solvers `explicit` and
    /// `quasi-static` shells are a participant of their own (`[participant.NAME]`).
    #[serde(default)]
    pub model: BodyModel,
    /// Its mesh, from a file, a built-in shape, or a segmented image. The mesh of a shell or a membrane is of
    /// triangles (quads are cut into two); of a volume mesh it takes the boundary. The mesh of bars is of
    /// lines.
    #[serde(default)]
    pub mesh: MeshTable,
    /// Instead of a mesh: the body on whose boundary this one is a wall, with the same nodes, as the capsule
    /// of an organ.
    #[serde(default)]
    pub on: Option<String>,
    /// The faces of that boundary that are the wall; if not given, all faces.
    #[serde(default)]
    pub faces: Option<Selection>,
    /// Behaviour of the rotations of a shell that is a wall with `on`.
    #[serde(default)]
    pub rotations: Rotations,
    /// The element; if not given, `tet4` for tets, `hex8` for hexes and `dkt-curved` for shells;
    /// `model = "membrane"` has one only. For soft tissue prefer `tet4-anp` to `tet4`.
    #[serde(default)]
    pub element: Option<Element>,
    /// The name of its law, or a law for each cell label, by number or by the name of the label:
    /// `{ 1 = "soft", tumour = "stiff" }`. Shells and bars take the moduli of an isotropic law at small
    /// strain; a shell whose `layers` all have their own elasticity needs none.
    #[serde(default = "no_law")]
    pub law: ByLabel<String>,
    /// Mass per volume [kg/m³], or one for each cell label, as for `law`. Elements with averaged pressure
    /// average it separately on parts of different density.
    pub density: ByLabel<Density>,
    /// Thickness of a shell or a membrane [m]: one, or one for each triangle.
    #[serde(default)]
    pub thickness: Option<Thickness>,
    /// Layers of a shell from the side that its triangles face away from to the side that they face, instead
    /// of a `thickness`. Their angles count from `fibre`, projected on each triangle.
    #[serde(default)]
    pub layers: Vec<LayerTable>,
    /// Tension [N/m] of a shell in the shape of its mesh, equal in all directions: it holds a flat `membrane`
    /// across its plane. Not for the element `plate`.
    #[serde(default)]
    #[schemars(range(min = 0.0))]
    pub pre_tension: f64,
    /// Source of the normals at rest of a shell, which make its surface curved. If not given, the mesh, if it
    /// has normals (built-in shapes have) and there is no `crease`; else the triangles.
    #[serde(default)]
    pub normals: Option<Normals>,
    /// Angle [degrees] between triangles of a shell above which their edge is a crease, where the curved
    /// surface has a kink; 45 if not given. Not with the normals of a mesh.
    #[serde(default)]
    #[schemars(range(min = 0.0, max = 180.0))]
    pub crease: Option<f64>,
    /// True if more than two triangles of a shell may meet in an edge.
    #[serde(default)]
    pub branches: bool,
    /// Name of a cell-data array of the mesh with the part of each cell that the body fills, above 0 and at
    /// most 1. The part scales the stiffness and mass of the cell, but never below a tenth. If not given,
    /// `fraction` of `immersed-hexes`.
    #[serde(default)]
    pub fraction: Option<String>,
    /// Cross section of bars [m²].
    #[serde(default)]
    #[schemars(extend("exclusiveMinimum" = 0.0))]
    pub area: Option<f64>,
    /// Length of bars without force over their length in the mesh: above 1 they are slack at the start, below
    /// 1 they pull.
    #[serde(default = "one")]
    #[schemars(range(min = 0.1, max = 10.0))]
    pub slack: f64,
    /// True if bars take no compression, as threads.
    #[serde(default)]
    pub tension_only: bool,
    /// Mass-proportional damping [1/s].
    #[serde(default)]
    #[schemars(range(min = 0.0))]
    pub damping: f64,
    /// Stiffness-proportional damping β [s] with the solver `implicit`, and with `explicit` of all bodies but
    /// shells; the same for all bodies of a participant. It damps a vibration of angular frequency ω with the
    /// ratio βω/2. An explicit step shrinks with it, from the critical time step Δt to √(β² + Δt²) − β.
    #[serde(default)]
    #[schemars(range(min = 0.0))]
    pub stiffness_damping: f64,
    /// Stiffness against hourglass patterns of `hex8`, as a multiple of the shear modulus at rest; above
    /// about 0.5 it stiffens bending. One for the whole body or for each cell label. If not given, 0.2 of the
    /// current shear modulus of each element, which is at least the one at rest.
    #[serde(default)]
    pub hourglass: Option<ByLabel<Hourglass>>,
    /// Velocity [m/s] at the start, of all nodes that no constraint holds or moves; not for quasi-static
    /// runs.
    #[serde(default)]
    pub velocity: Option<[f64; 3]>,
    /// Displacement [m] of each node from rest at the start. The mesh is the shape at rest. For shells, whose
    /// nodes turn with the triangles around them, and for solids with the solvers `implicit` and `static`.
    #[serde(default)]
    pub initial_displacement: Option<NodeVectors>,
    /// Fibre direction at rest; overrides the direction of the law. For a shell, the direction from which the
    /// angles of its `layers` count.
    #[serde(default)]
    pub fibre: Option<Fibre>,
    /// Direction of the second family of fibres at rest; overrides the direction of the law.
    #[serde(default)]
    pub second_fibre: Option<Fibre>,
}

impl BodyTable {
    /// True if the body fills its cells in part: it names the array of the parts, or its mesh has them.
    pub fn is_filled_in_part(&self) -> bool {
        self.fraction.is_some() || self.mesh.made_of() == Cells::ImmersedHexes
    }
}

fn one() -> f64 {
    1.0
}

fn no_law() -> ByLabel<String> {
    ByLabel::Each(BTreeMap::new())
}

/// A layer of a shell: linearly elastic in plane stress. It has a `law` (the body's if not given), or moduli
/// of its own along and across its direction.
#[derive(Clone, Debug, Deserialize, JsonSchema)]
#[serde(rename_all = "kebab-case", deny_unknown_fields)]
pub struct LayerTable {
    /// Thickness [m].
    #[schemars(extend("exclusiveMinimum" = 0.0))]
    pub thickness: f64,
    /// Angle [degrees] of its direction from the `fibre` of the body, counter-clockwise seen from the side
    /// that the triangles face.
    #[serde(default)]
    #[schemars(range(min = -180.0, max = 180.0))]
    pub angle: f64,
    /// The name of an isotropic law, whose Young's modulus and Poisson's ratio at small strain are taken.
    #[serde(default)]
    pub law: Option<String>,
    /// Young's moduli along and across its direction [Pa]; with `poisson-ratio` and `shear-modulus`, instead
    /// of a law.
    #[serde(default)]
    pub young_modulus: Option<[f64; 2]>,
    /// Poisson's ratio: how much it narrows across its direction when it is pulled along it.
    #[serde(default)]
    pub poisson_ratio: Option<f64>,
    /// Shear modulus in its plane [Pa].
    #[serde(default)]
    #[schemars(extend("exclusiveMinimum" = 0.0))]
    pub shear_modulus: Option<f64>,
    /// Mass per volume [kg/m³]; the body's if not given.
    #[serde(default)]
    #[schemars(extend("exclusiveMinimum" = 0.0))]
    pub density: Option<f64>,
}

/// Model of a body.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Deserialize, Serialize, JsonSchema)]
#[serde(rename_all = "kebab-case")]
pub enum BodyModel {
    /// A solid in large strain, by any law: total Lagrangian.
    #[default]
    Solid,
    /// A thin wall of triangles with membrane, bending and twist in large rotation and small strain.
    Shell,
    /// A thin wall of triangles without bending, in large strain, by any law, in plane stress: a capsule or a
    /// balloon.
    Membrane,
    /// Lines that carry force along their length only, linear in their stretch: ligaments, chords of a valve,
    /// sutures.
    Bar,
}

impl BodyModel {
    /// Its word in a scene file.
    pub fn word(self) -> &'static str {
        match self {
            Self::Solid => "solid",
            Self::Shell => "shell",
            Self::Membrane => "membrane",
            Self::Bar => "bar",
        }
    }
}

/// Source of the normals at rest of a shell.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Deserialize, Serialize, JsonSchema)]
#[serde(rename_all = "kebab-case")]
pub enum Normals {
    /// The point data `normal` of its mesh, as `pliant mesh --as shells` writes them.
    Mesh,
    /// The mean of the triangles around each node.
    Triangles,
}

/// Thickness of a shell [m].
#[derive(Clone, Debug, Deserialize, JsonSchema)]
#[serde(untagged)]
pub enum Thickness {
    /// One thickness everywhere [m].
    Uniform(#[schemars(extend("exclusiveMinimum" = 0.0))] f64),
    /// One for each triangle.
    PerCell(ThicknessRule),
}

/// Source of the thickness of each triangle.
#[derive(Clone, Debug, Deserialize, JsonSchema)]
#[serde(rename_all = "kebab-case", deny_unknown_fields)]
pub enum ThicknessRule {
    /// The name of a cell-data array of the mesh [m]: `{ cell-data = "thickness" }`.
    CellData(String),
    /// One for each cell label [m], by number or name: `{ by-label = { 1 = 0.002, wall = 0.001 } }`.
    ByLabel(BTreeMap<String, f64>),
}

/// One value for a whole body, or one for each cell label.
#[derive(Clone, Debug, Deserialize, Serialize, JsonSchema)]
#[serde(untagged)]
pub enum ByLabel<T> {
    /// One for the whole body.
    One(T),
    /// One for each cell label, by number or name.
    Each(BTreeMap<String, T>),
}

impl<T> ByLabel<T> {
    /// The value for cells of a label (`None`: without one).
    pub fn of(&self, label: Option<&str>) -> Option<&T> {
        match self {
            Self::One(value) => Some(value),
            Self::Each(map) => map.get(label?),
        }
    }

    /// Returns all values.
    pub fn values(&self) -> Vec<&T> {
        match self {
            Self::One(value) => vec![value],
            Self::Each(map) => map.values().collect(),
        }
    }
}

/// Mass per volume [kg/m³].
#[derive(Clone, Copy, Debug, PartialEq, Deserialize, Serialize, JsonSchema)]
#[serde(transparent)]
#[schemars(extend("exclusiveMinimum" = 0.0))]
pub struct Density(pub f64);

/// A multiple of the shear modulus.
#[derive(Clone, Copy, Debug, PartialEq, Deserialize, Serialize, JsonSchema)]
#[serde(transparent)]
#[schemars(extend("minimum" = 0.0, "maximum" = 10.0))]
pub struct Hourglass(pub f64);

impl Hourglass {
    /// Default, with which a bent cube has the right energy.
    pub const DEFAULT: Self = Self(0.2);
}

/// Fibre direction at rest. `fibre = [0, 0, 1]` is one direction everywhere; its length does not matter. A
/// table with exactly one of the keys below gives a direction in each element, such as
/// `fibre = { cell-data = "fibre" }`.
#[derive(Clone, Debug, Deserialize, JsonSchema)]
#[serde(untagged)]
pub enum Fibre {
    /// One direction everywhere; its length does not matter.
    Uniform([f64; 3]),
    /// A direction for each cell, from the mesh or by a rule.
    PerCell(FibreRule),
}

/// Source of the fibre direction of each cell. A rule is evaluated at the centre of a cell.
#[derive(Clone, Debug, Deserialize, JsonSchema)]
#[serde(rename_all = "kebab-case", deny_unknown_fields)]
pub enum FibreRule {
    /// The name of a cell-data array of the mesh with three components: `{ cell-data = "fibre" }`.
    CellData(String),
    /// Along an axis, the same everywhere: `{ along = [0, 0, 1] }`.
    Along([f64; 3]),
    /// Towards a point [m]: `{ toward = [0, 0, 0] }`.
    Toward([f64; 3]),
    /// Around an axis, as the fibres of a vessel:
    /// `{ around = { point = [0, 0, 0], axis = [0, 0, 1], angle = 30 } }`.
    Around {
        /// A point of the axis [m].
        point: [f64; 3],
        /// The direction of the axis; the fibres turn to the right around it.
        axis: [f64; 3],
        /// Angle [degrees] by which they climb along the axis: 0 makes rings, 90 lines along the axis.
        #[serde(default)]
        #[schemars(range(min = -90.0, max = 90.0))]
        angle: f64,
    },
    /// In the surface, as close as possible to a direction: `{ tangential = { closest-to = [0, 0, 1] } }`.
    /// The surface is taken at its point nearest to the cell.
    Tangential {
        /// The faces of the body's boundary that are the surface.
        #[serde(default = "boundary")]
        surface: Selection,
        /// The direction that is projected on the surface.
        #[serde(rename = "closest-to")]
        closest_to: [f64; 3],
    },
    /// From one part of the surface to another, along the gradient of a harmonic function (Laplace's
    /// equation). The function is 0 on the first part and 1 on the second:
    /// `{ laplace = { from = { set = "inner" }, to = { set = "outer" } } }`.
    Laplace {
        /// The nodes where it is 0.
        from: Selection,
        /// The nodes where it is 1.
        to: Selection,
    },
}

fn boundary() -> Selection {
    Selection::Boundary
}

/// Resistance of cells to deformation.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Deserialize, Serialize, JsonSchema)]
#[serde(rename_all = "kebab-case")]
pub enum Element {
    /// Linear tetrahedron; locks for nearly incompressible tissue (Poisson's ratio above 0.4).
    Tet4,
    /// Linear tetrahedron with average nodal pressure (Bonet and Burton 1998): the recommended tetrahedron.
    Tet4Anp,
    /// Linear tetrahedron with improved average nodal pressure, in variational form. Even softer; watch for
    /// pressure modes.
    Tet4Ianp,
    /// Linear tetrahedron with improved average nodal pressure as in NiftySim; not the gradient of an energy.
    Tet4IanpNiftysim,
    /// Uniform-strain hexahedron with hourglass control: the default of hexahedra.
    Hex8,
    /// Hexahedron with eight points and one mean dilatation: no hourglass patterns, eight stresses a cell.
    /// The default of elements that the body fills in part, unless `hourglass` is given or the law has no
    /// energy of the volume alone.
    Hex8Full,
    /// Shell: discrete Kirchhoff triangle and the mean membrane strain of the curved triangle: the
    /// recommended shell.
    DktCurved,
    /// Shell: discrete Kirchhoff triangle and optimal flat ANDES membrane, whose drilling adapts to the
    /// thickness. On flat walls it is the same as `dkt-curved`. On curved walls under pressure its
    /// displacements scatter from node to node.
    DktOpt,
    /// Shell: discrete Kirchhoff triangle and constant-strain membrane, too stiff for bending in its plane.
    /// Stable under pressures that stretch thin curved walls much.
    DktCst,
    /// Shell without bending, in small strain: a constant-strain membrane whose nodes do not turn. In large
    /// strain take `model = "membrane"`.
    Membrane,
    /// Shell without membrane: bending and twist of plates, for studies. Other constraints must hold it in
    /// its plane.
    Plate,
    /// Shell: the element of Comas (2010), corrected for its typing errors. Only for comparison: it depends
    /// on the numbering of the corners and converges to plates 6 to 26 % too soft.
    #[serde(rename = "comas-2010")]
    Comas2010,
}

impl Element {
    /// True for elements of shells.
    pub fn is_shell(self) -> bool {
        matches!(
            self,
            Self::DktCurved | Self::DktOpt | Self::DktCst | Self::Membrane | Self::Plate | Self::Comas2010
        )
    }

    /// True for tetrahedra.
    pub fn is_tet(self) -> bool {
        matches!(self, Self::Tet4 | Self::Tet4Anp | Self::Tet4Ianp | Self::Tet4IanpNiftysim)
    }

    /// True if the pressure is an average, so that the law must have a volumetric energy.
    pub fn averages_pressure(self) -> bool {
        matches!(self, Self::Tet4Anp | Self::Tet4Ianp | Self::Hex8Full)
    }
}

/// A finer surface carried by a body.
#[derive(Clone, Debug, Deserialize, JsonSchema)]
#[serde(rename_all = "kebab-case", deny_unknown_fields)]
pub struct SurfaceTable {
    /// The body that carries it.
    pub on: String,
    /// The surface: triangles or quads of a file, or the boundary of a built-in shape or an image. With
    /// `as = "surface"`, the smooth surface of an image.
    pub mesh: MeshTable,
}
