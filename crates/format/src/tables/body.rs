//! Bodies, their meshes, and the surfaces they carry.

use std::collections::BTreeMap;
use std::path::PathBuf;

use pliant_geometry::{CellLabel, Selection};
use pliant_imaging::LabelChoice;
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use super::{NodeVectors, Rotations};

/// A body.
#[derive(Clone, Debug, Deserialize, JsonSchema)]
#[serde(rename_all = "kebab-case", deny_unknown_fields)]
pub struct BodyTable {
    /// How it is modelled; if not given, `solid`, or `membrane` with `on`. With the solvers `explicit` and `quasi-static` shells are a
    /// participant of their own (`[participant.NAME]`).
    #[serde(default)]
    pub model: BodyModel,
    /// Its mesh, from a file, a built-in shape, or a segmented image. The mesh of a shell or a membrane is of triangles (quads are cut
    /// into two); a volume mesh gives it its boundary. That of bars is of lines.
    #[serde(default)]
    pub mesh: MeshTable,
    /// Instead of a mesh: the body on whose boundary this one is a wall, with the same nodes, as the capsule of an organ.
    #[serde(default)]
    pub on: Option<String>,
    /// The faces of that boundary that are the wall; if not given, all of it.
    #[serde(default)]
    pub faces: Option<Selection>,
    /// What the rotations of a shell do that is a wall with `on`.
    #[serde(default)]
    pub rotations: Rotations,
    /// The element; if not given, `tet4` for tets, `hex8` for hexes and `dkt-curved` for shells; `model = "membrane"` has one only. For
    /// soft tissue prefer `tet4-anp` to `tet4`.
    #[serde(default)]
    pub element: Option<Element>,
    /// The name of its law, or a law for each cell label, by number or by the name of the label: `{ 1 = "soft", tumour = "stiff" }`. Shells
    /// and bars take the moduli of an isotropic law at small strain; a shell whose `layers` all have their own elasticity
    /// needs none.
    #[serde(default = "no_law")]
    pub law: ByLabel<String>,
    /// Mass per volume [kg/m³], or one for each cell label, as of `law`. Elements with averaged pressure average it apart on parts of
    /// different density.
    pub density: ByLabel<Density>,
    /// Thickness of a shell or a membrane [m]: one, or one for each triangle.
    #[serde(default)]
    pub thickness: Option<Thickness>,
    /// Layers of a shell from the side that its triangles face away from to the side that they face, instead of a `thickness`. Their
    /// angles count from `fibre`, projected on each triangle.
    #[serde(default)]
    pub layers: Vec<LayerTable>,
    /// Tension [N/m] of a shell in the shape of its mesh, equal in all directions: what holds a flat `membrane` across. Not for the
    /// element `plate`.
    #[serde(default)]
    #[schemars(range(min = 0.0))]
    pub pre_tension: f64,
    /// Where the normals at rest of a shell come from, which make its surface curved; if not given, from the mesh where it has
    /// some, as built-in shapes have, and there is no `crease`, else from the triangles.
    #[serde(default)]
    pub normals: Option<Normals>,
    /// Angle [degrees] between triangles of a shell above which their edge is a crease, where the curved surface has a kink; 45
    /// if not given. Not with the normals of a mesh.
    #[serde(default)]
    #[schemars(range(min = 0.0, max = 180.0))]
    pub crease: Option<f64>,
    /// Whether more than two triangles of a shell may meet in an edge.
    #[serde(default)]
    pub branches: bool,
    /// The name of a cell-data array of the mesh with the part of each cell that the body fills, above 0 and at most 1: its
    /// stiffness and mass are so much smaller, but never less than a tenth. If not given, `fraction` of `immersed-hexes`.
    #[serde(default)]
    pub fraction: Option<String>,
    /// Cross section of bars [m²].
    #[serde(default)]
    #[schemars(extend("exclusiveMinimum" = 0.0))]
    pub area: Option<f64>,
    /// Length of bars without force over that in the mesh: above 1 they hang through at the start, below 1 they pull.
    #[serde(default = "one")]
    #[schemars(range(min = 0.1, max = 10.0))]
    pub slack: f64,
    /// Whether bars take no compression, as threads.
    #[serde(default)]
    pub tension_only: bool,
    /// Mass-proportional damping [1/s].
    #[serde(default)]
    #[schemars(range(min = 0.0))]
    pub damping: f64,
    /// Stiffness-proportional damping β [s] with the solver `implicit`, and with `explicit` of all bodies but shells; the same for all bodies of
    /// a participant. It damps a vibration of angular frequency ω with the ratio βω/2. An explicit step shrinks with it, from the critical time step
    /// Δt to √(β² + Δt²) − β.
    #[serde(default)]
    #[schemars(range(min = 0.0))]
    pub stiffness_damping: f64,
    /// Stiffness against hourglass patterns of `hex8`, as a multiple of the shear modulus at rest; above about 0.5 it stiffens
    /// bending. One for the whole body or for each cell label. If not given, 0.2 of the current shear modulus of each element, which is at
    /// least the one at rest.
    #[serde(default)]
    pub hourglass: Option<ByLabel<Hourglass>>,
    /// Velocity [m/s] at the start, of all nodes that no constraint holds or moves; not for quasi-static runs.
    #[serde(default)]
    pub velocity: Option<[f64; 3]>,
    /// Displacement [m] of each node from rest at the start, of shells, and of solids with the solvers `implicit` and `static`; the
    /// nodes of shells turn with the triangles round them. The mesh is the shape at rest.
    #[serde(default)]
    pub initial_displacement: Option<NodeVectors>,
    /// Fibre direction at rest; overrides that of the law. Of a shell, the direction that the angles of its `layers` count from.
    #[serde(default)]
    pub fibre: Option<Fibre>,
    /// Direction of the second family of fibres at rest; overrides that of the law.
    #[serde(default)]
    pub second_fibre: Option<Fibre>,
}

impl BodyTable {
    /// Whether it names the parts of its cells that it fills, or its mesh has them.
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

/// A layer of a shell: linearly elastic in plane stress, by a `law` (that of the body if not given) or by moduli of its own along and
/// across its direction.
#[derive(Clone, Debug, Deserialize, JsonSchema)]
#[serde(rename_all = "kebab-case", deny_unknown_fields)]
pub struct LayerTable {
    /// Thickness [m].
    #[schemars(extend("exclusiveMinimum" = 0.0))]
    pub thickness: f64,
    /// Angle [degrees] of its direction from the `fibre` of the body, counter-clockwise seen from the side that the triangles face.
    #[serde(default)]
    #[schemars(range(min = -180.0, max = 180.0))]
    pub angle: f64,
    /// The name of an isotropic law, whose Young's modulus and Poisson's ratio at small strain are taken.
    #[serde(default)]
    pub law: Option<String>,
    /// Young's moduli along and across its direction [Pa]; with `poisson-ratio` and `shear-modulus`, instead of a law.
    #[serde(default)]
    pub young_modulus: Option<[f64; 2]>,
    /// Poisson's ratio: how much it narrows across its direction when it is pulled along it.
    #[serde(default)]
    pub poisson_ratio: Option<f64>,
    /// Shear modulus in its plane [Pa].
    #[serde(default)]
    #[schemars(extend("exclusiveMinimum" = 0.0))]
    pub shear_modulus: Option<f64>,
    /// Mass per volume [kg/m³]; that of the body if not given.
    #[serde(default)]
    #[schemars(extend("exclusiveMinimum" = 0.0))]
    pub density: Option<f64>,
}

/// How a body is modelled.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Deserialize, Serialize, JsonSchema)]
#[serde(rename_all = "kebab-case")]
pub enum BodyModel {
    /// A solid in large strain, by any law: total Lagrangian.
    #[default]
    Solid,
    /// A thin wall of triangles with membrane, bending and twist in large rotation and small strain.
    Shell,
    /// A thin wall of triangles without bending, in large strain, by any law, in plane stress: a capsule or a balloon.
    Membrane,
    /// Lines that carry force along their length only, linear in their stretch: ligaments, chords of a valve, sutures.
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

/// Where the normals at rest of a shell come from.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Deserialize, Serialize, JsonSchema)]
#[serde(rename_all = "kebab-case")]
pub enum Normals {
    /// The point data `normal` of its mesh, as `pliant mesh --as shells` writes them.
    Mesh,
    /// The mean of the triangles round each node.
    Triangles,
}

/// Thickness of a shell [m].
#[derive(Clone, Debug, Deserialize, JsonSchema)]
#[serde(untagged)]
pub enum Thickness {
    /// The same everywhere [m].
    Uniform(#[schemars(extend("exclusiveMinimum" = 0.0))] f64),
    /// One for each triangle.
    PerCell(ThicknessRule),
}

/// Where the thickness of each triangle comes from.
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

    /// All values.
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
    /// Of a body that gives none: a bent cube then has the right energy.
    pub const DEFAULT: Self = Self(0.2);
}

/// Fibre direction at rest: `fibre = [0, 0, 1]` for one direction everywhere, whose length does not matter, or a table with exactly
/// one of the keys below for a direction in each element, such as `fibre = { cell-data = "fibre" }`.
#[derive(Clone, Debug, Deserialize, JsonSchema)]
#[serde(untagged)]
pub enum Fibre {
    /// The same direction everywhere; its length does not matter.
    Uniform([f64; 3]),
    /// A direction for each cell, from the mesh or by a rule.
    PerCell(FibreRule),
}

/// Where the fibre direction of each cell comes from. A rule asks at the centre of a cell.
#[derive(Clone, Debug, Deserialize, JsonSchema)]
#[serde(rename_all = "kebab-case", deny_unknown_fields)]
pub enum FibreRule {
    /// The name of a cell-data array of the mesh with three components: `{ cell-data = "fibre" }`.
    CellData(String),
    /// Along an axis, the same everywhere: `{ along = [0, 0, 1] }`.
    Along([f64; 3]),
    /// Towards a point [m]: `{ toward = [0, 0, 0] }`.
    Toward([f64; 3]),
    /// Around an axis, as the fibres of a vessel: `{ around = { point = [0, 0, 0], axis = [0, 0, 1], angle = 30 } }`.
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
    /// In the surface, as close as possible to a direction: `{ tangential = { closest-to = [0, 0, 1] } }`. The surface is
    /// taken at its point nearest to the cell.
    Tangential {
        /// The faces of the body's boundary that are the surface.
        #[serde(default = "boundary")]
        surface: Selection,
        /// The direction that is projected on the surface.
        #[serde(rename = "closest-to")]
        closest_to: [f64; 3],
    },
    /// From one part of the surface to another, along the gradient of the harmonic function (Laplace's equation) that is 0
    /// on the one and 1 on the other: `{ laplace = { from = { set = "inner" }, to = { set = "outer" } } }`.
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

/// How cells resist deformation.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Deserialize, Serialize, JsonSchema)]
#[serde(rename_all = "kebab-case")]
pub enum Element {
    /// Linear tetrahedron; locks for nearly incompressible tissue (Poisson's ratio above 0.4).
    Tet4,
    /// Linear tetrahedron with average nodal pressure (Bonet and Burton 1998): the recommended tetrahedron.
    Tet4Anp,
    /// Linear tetrahedron with improved average nodal pressure, variational: softer still; watch for pressure modes.
    Tet4Ianp,
    /// Linear tetrahedron with improved average nodal pressure as in NiftySim; not the gradient of an energy.
    Tet4IanpNiftysim,
    /// Uniform-strain hexahedron with hourglass control: the default of hexahedra.
    Hex8,
    /// Hexahedron with eight points and one mean dilatation: no hourglass patterns, eight stresses a cell. The default of elements that the
    /// body fills in part, unless `hourglass` is given or the law has no energy of the volume alone.
    Hex8Full,
    /// Shell: discrete Kirchhoff triangle and the mean membrane strain of the curved triangle: the recommended one.
    DktCurved,
    /// Shell: discrete Kirchhoff triangle and optimal flat ANDES membrane, whose drilling adapts to the thickness. `dkt-curved` is this
    /// on flat walls; on curved walls under pressure this one scatters displacements from node to node.
    DktOpt,
    /// Shell: discrete Kirchhoff triangle and constant-strain membrane, too stiff for bending in its plane, and calm under pressures
    /// that stretch thin curved walls much.
    DktCst,
    /// Shell without bending, in small strain: a constant-strain membrane whose nodes do not turn. In large strain take
    /// `model = "membrane"`.
    Membrane,
    /// Shell without membrane: bending and twist of plates, for studies; something else must hold it in its plane.
    Plate,
    /// Shell: the element of Comas (2010), corrected for its typing errors. Only for comparison: it depends on the numbering of
    /// the corners and converges to plates 6 to 26 % too soft.
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

/// A mesh: exactly one of `file`, `image`, `block`, `ellipsoid`, `tube`, `organ`, for shells `plate`, `cylinder`, `sphere`,
/// `hemisphere`, `annulus`, `twisted-strip`, `lens`, or for bars `lines`.
#[derive(Clone, Debug, Default, Deserialize, JsonSchema)]
#[serde(rename_all = "kebab-case", deny_unknown_fields)]
pub struct MeshTable {
    /// A mesh file, relative to the scene: Gmsh (.msh), VTK (.vtk, .vtu), OBJ, OFF, STL, PLY, GIfTI, FreeSurfer. Its own cells are taken, unless `as`
    /// asks for others made of its surface.
    #[serde(default)]
    pub file: Option<PathBuf>,
    /// The name of a mesh that the program which reads the scene gives from its memory, instead of a `file`; scenes that the command line
    /// reads have none.
    #[serde(default)]
    pub given: Option<String>,
    /// A segmented image, relative to the scene: NIfTI (.nii, .nii.gz), NRRD, MetaImage (.mha, .mhd), GIPL, a DICOM segmentation, or the
    /// folder of a DICOM series. Coordinates are those of the patient: x to the right, y to the front, z to the head [m].
    #[serde(default)]
    pub image: Option<PathBuf>,
    /// Another image of the same voxels whose values are added before the `threshold`, as grey matter to white matter.
    #[serde(default)]
    pub add: Option<PathBuf>,
    /// Several masks of the same voxels, each an image with 0 outside, as one image: the first has label 1, the second 2, and so on, each
    /// with the name of its file. Where they overlap, the last one counts.
    #[serde(default)]
    pub masks: Option<Vec<PathBuf>>,
    /// Names for the labels: a table of ITK-SNAP, FreeSurfer or 3D Slicer, lines like `5 liver`, JSON, or the word `totalsegmentator`.
    #[serde(default)]
    pub names: Option<PathBuf>,
    /// Label of the image to mesh, by number or name; or groups of labels, each one material of that name:
    /// `{ tissue = [1, 5, "liver"], bone = "26-50" }`. Cells of a group carry the number of its first label. The first group by name takes
    /// what cleaning adds.
    #[serde(default)]
    pub label: Option<LabelOrGroups>,
    /// Several labels of the image as one body, by number, name or range as `"5-8"`; of `masks` all if not given. Each cell has its own as cell data `label`, for `law`, `density` and
    /// `hourglass` by label. The first label takes what cleaning adds.
    #[serde(default)]
    pub labels: Option<Vec<Label>>,
    /// Labels of vessels in the organ of `label` or `labels`, by number, name or range. Where they run inside of the organ, their voxels belong
    /// to it, with the label of the tissue round them; outside of it they do not. A voxel is inside if more than half of the 26 ways from it
    /// lead through vessels into the organ.
    #[serde(default)]
    pub vessels: Option<Vec<Label>>,
    /// Instead of labels: all voxels of at least this value, as of a map of probabilities. Their label is 1.
    #[serde(default)]
    pub threshold: Option<f64>,
    /// Cleaning of the labels of an image, or of what the surface of a file encloses, before new cells are made.
    #[serde(default)]
    pub clean: Option<CleanTable>,
    /// A box from the origin.
    #[serde(default)]
    pub block: Option<BlockShape>,
    /// An ellipsoid about the origin.
    #[serde(default)]
    pub ellipsoid: Option<EllipsoidShape>,
    /// A tube along z from the origin.
    #[serde(default)]
    pub tube: Option<TubeShape>,
    /// A built-in organ, centred on the origin.
    #[serde(default)]
    pub organ: Option<Organ>,
    /// A rectangle of triangles in the plane z = 0 from the origin, facing +z. Point sets: `x-min`, `x-max`, `y-min`, `y-max`.
    #[serde(default)]
    pub plate: Option<PlateShape>,
    /// A cylinder of triangles about the z axis from z = 0, open at its ends, facing outwards. Point sets: `z-min`, `z-max`, and of
    /// a part `start`, `end`.
    #[serde(default)]
    pub cylinder: Option<CylinderShape>,
    /// A sphere of triangles about the origin, facing outwards.
    #[serde(default)]
    pub sphere: Option<SphereShape>,
    /// A hemisphere of triangles z ≥ 0 about the z axis with a hole at the pole, facing outwards. Point sets: `equator`, `hole`,
    /// and of a part `start`, `end`.
    #[serde(default)]
    pub hemisphere: Option<HemisphereShape>,
    /// A ring of triangles in the plane z = 0 about the origin, facing +z, slit along +x. Point sets: `inner`, `outer`, `start`, `end`.
    #[serde(default)]
    pub annulus: Option<AnnulusShape>,
    /// A strip of triangles along x that turns about the x axis. Point sets: `x-min`, `x-max`, `low`, `high`.
    #[serde(default)]
    pub twisted_strip: Option<TwistedStripShape>,
    /// A flat intra-ocular lens of triangles in the plane z = 0 about the origin, facing +z, with edges of about `edge`. Point sets: `optic`,
    /// `haptics`.
    #[serde(default)]
    pub lens: Option<LensShape>,
    /// Paths of bars from point to point [m]: `lines = [[[0, 0, 0], [0, 0, 0.02]]]`. They meet where they have a point in common; with
    /// `edge` each piece is cut into bars of about that length.
    #[serde(default)]
    pub lines: Option<Vec<Vec<[f64; 3]>>>,
    /// Target edge length of the cells of a built-in shape, an image or what the surface of a file encloses [m].
    #[serde(default)]
    #[schemars(extend("exclusiveMinimum" = 0.0))]
    pub edge: Option<f64>,
    /// Tets of an image or of what the surface of a file encloses: longer edge inside, away from the surface [m], rounded down to 2, 4, 8,
    /// ... times `edge`.
    #[serde(default)]
    #[schemars(extend("exclusiveMinimum" = 0.0))]
    pub inner_edge: Option<f64>,
    /// Labels with smaller tets: numbers or names, for half of `edge`, or tables with their edge, as `["tumour", { label = 5, edge = 0.002 }]`. Edges are
    /// rounded down to a half, a quarter, ... of `edge`.
    #[serde(default)]
    pub protect: Option<Vec<Protected>>,
    /// Largest distance between the boundary of tets and the body [m], both ways: they are made smaller where it is not held. It is
    /// measured to the triangles of a file, or to the smooth surface of an image. Without `edge` the first edge is chosen.
    #[serde(default)]
    #[schemars(extend("exclusiveMinimum" = 0.0))]
    pub distance: Option<f64>,
    /// Number of triangles of a `surface` of an image or a file, instead of `edge`: as few, placed where the shape needs them.
    #[serde(default)]
    #[schemars(range(min = 4))]
    pub triangles: Option<u32>,
    /// Number of `shells` fitted to an image or to the surface of a file.
    #[serde(default)]
    #[schemars(range(min = 4))]
    pub shells: Option<u32>,
    /// Largest distance of `shells` from the surface of an image, both ways, as a part of the diagonal of its box.
    #[serde(default)]
    #[schemars(extend("exclusiveMinimum" = 0.0, "exclusiveMaximum" = 1.0))]
    pub error: Option<f64>,
    /// Cells of a built-in shape or an image (tets if not given), or of the closed surface of a `file`.
    #[serde(default, rename = "as")]
    pub cells: Option<Cells>,
    /// Factor on all lengths: the size of one unit of the mesh in metres (0.001 for millimetres); 1 if not given. A file that would be
    /// larger than 10 m needs it.
    #[serde(default)]
    #[schemars(extend("exclusiveMinimum" = 0.0))]
    pub scale: Option<f64>,
    /// Turn about the origin, after scaling: about the axis of this vector by its length [rad]. `[0, 0, 3.14159265]` takes the axes left,
    /// back, head (LPS) to right, front, head (RAS). Data of three components turn as vectors.
    #[serde(default)]
    pub turn: [f64; 3],
    /// Shift after scaling and turning [m].
    #[serde(default)]
    pub at: [f64; 3],
    /// Repairs of a mesh file, in this order.
    #[serde(default)]
    pub fix: Option<Fixes>,
}

impl MeshTable {
    /// The factor on all lengths.
    pub fn factor(&self) -> f64 {
        self.scale.unwrap_or(1.0)
    }

    /// The key of a mesh that has cells of its own, if there is one.
    pub fn own_cells(&self) -> Option<&'static str> {
        match (&self.file, &self.given) {
            (Some(_), _) => Some("file"),
            (None, Some(_)) => Some("given"),
            (None, None) => None,
        }
    }

    /// The cells of a built-in shape or an image.
    pub fn made_of(&self) -> Cells {
        self.cells.unwrap_or_default()
    }
}

/// A label of an image: its number, or in quotes its name or a range of numbers.
#[derive(Clone, Debug, PartialEq, Eq, Deserialize, JsonSchema)]
#[serde(untagged)]
pub enum Label {
    /// Its number.
    Number(i32),
    /// Its name, or a range as `"5-8"`.
    Text(String),
}

impl Label {
    /// What of an image it stands for.
    pub fn choice(&self) -> LabelChoice {
        match self {
            Self::Number(label) => LabelChoice::One(*label),
            Self::Text(text) => match text.parse() {
                Ok(choice) => choice,
                Err(never) => match never {},
            },
        }
    }
}

/// A label of an image, or groups of labels.
#[derive(Clone, Debug, PartialEq, Eq, Deserialize, JsonSchema)]
#[serde(untagged)]
pub enum LabelOrGroups {
    /// A label.
    One(Label),
    /// Groups by their names.
    Groups(BTreeMap<String, LabelGroup>),
}

/// Labels that become one: a label or a range, or several of them.
#[derive(Clone, Debug, PartialEq, Eq, Deserialize, JsonSchema)]
#[serde(untagged)]
pub enum LabelGroup {
    /// A label, or a range as `"26-50"`.
    One(Label),
    /// Several labels and ranges.
    Several(Vec<Label>),
}

impl LabelOrGroups {
    /// What of an image it stands for.
    pub fn choices(&self) -> Vec<LabelChoice> {
        let group = |(name, group): (&String, &LabelGroup)| {
            let labels = match group {
                LabelGroup::One(label) => std::slice::from_ref(label),
                LabelGroup::Several(labels) => labels,
            };
            LabelChoice::Group(name.clone(), labels.iter().map(Label::choice).collect())
        };
        match self {
            Self::One(label) => vec![label.choice()],
            Self::Groups(groups) => groups.iter().map(group).collect(),
        }
    }
}

/// A label with smaller tets.
#[derive(Clone, Debug, PartialEq, Deserialize, JsonSchema)]
#[serde(untagged)]
pub enum Protected {
    /// A label with tets of half of `edge`.
    Half(CellLabel),
    /// A label with tets of an edge of its own.
    Own(ProtectedTable),
}

/// A label and the edge of its tets.
#[derive(Clone, Debug, PartialEq, Deserialize, JsonSchema)]
#[serde(rename_all = "kebab-case", deny_unknown_fields)]
pub struct ProtectedTable {
    /// The label, by number or name.
    pub label: CellLabel,
    /// Edge of its tets [m].
    #[schemars(extend("exclusiveMinimum" = 0.0))]
    pub edge: f64,
}

impl Protected {
    /// The label, and the edge of its tets if it is given [m].
    pub fn label_and_edge(&self) -> (&CellLabel, Option<f64>) {
        match self {
            Self::Half(label) => (label, None),
            Self::Own(ProtectedTable { label, edge }) => (label, Some(*edge)),
        }
    }
}

/// Cleaning of the labels of an image, taken together, in this order.
#[derive(Clone, Copy, Debug, Default, Deserialize, JsonSchema)]
#[serde(rename_all = "kebab-case", deny_unknown_fields)]
pub struct CleanTable {
    /// Width of gaps and channels to close [m].
    #[serde(default)]
    #[schemars(range(min = 0.0))]
    pub close_gaps: f64,
    /// Whether to fill cavities without a way out.
    #[serde(default)]
    pub fill_holes: bool,
    /// Whether to keep only the largest piece.
    #[serde(default)]
    pub keep_largest: bool,
}

/// One repair or several.
#[derive(Clone, Debug, PartialEq, Eq, Deserialize, JsonSchema)]
#[serde(untagged)]
pub enum Fixes {
    /// One.
    One(Fix),
    /// Several, in order.
    Several(Vec<Fix>),
}

impl Fixes {
    /// The repairs in order.
    pub fn as_slice(&self) -> &[Fix] {
        match self {
            Self::One(fix) => std::slice::from_ref(fix),
            Self::Several(fixes) => fixes,
        }
    }
}

/// A repair of a mesh.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Deserialize, Serialize, JsonSchema)]
#[serde(rename_all = "kebab-case")]
pub enum Fix {
    /// Swap nodes of inverted cells.
    Reorder,
    /// Remove nodes that no cell uses.
    DropUnused,
    /// Join nodes at the same place.
    Merge,
}

/// Cells of a built-in shape or an image.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Deserialize, Serialize, JsonSchema)]
#[serde(rename_all = "kebab-case")]
pub enum Cells {
    /// Tetrahedra.
    #[default]
    Tets,
    /// Hexahedra: structured for blocks and tubes, cubes with a stepped surface for ellipsoids, organs and images.
    Hexes,
    /// All cubes that an ellipsoid, an organ or an image fills by more than 2 %, with their stiffness and mass by the part that it
    /// fills. A carried surface shows it smooth.
    ImmersedHexes,
    /// The smooth surface of an image in triangles: even ones of `edge`, as few as `triangles`, or for a carried surface as fine as
    /// the voxels.
    Surface,
    /// Curved shells fitted to the smooth surface of an image: as many as `shells`, or as close as `error`.
    Shells,
}

/// A box with one corner at the origin.
#[derive(Clone, Debug, Deserialize, JsonSchema)]
#[serde(rename_all = "kebab-case", deny_unknown_fields)]
pub struct BlockShape {
    /// Lengths along x, y, z [m].
    pub size: [f64; 3],
    /// Cells along x, y, z; if not given, from `edge`.
    #[serde(default)]
    pub cells: Option<[u32; 3]>,
}

/// An ellipsoid about the origin.
#[derive(Clone, Debug, Deserialize, JsonSchema)]
#[serde(rename_all = "kebab-case", deny_unknown_fields)]
pub struct EllipsoidShape {
    /// Half axes along x, y, z [m].
    pub radii: [f64; 3],
}

/// A tube about the z axis from z = 0.
#[derive(Clone, Debug, Deserialize, JsonSchema)]
#[serde(rename_all = "kebab-case", deny_unknown_fields)]
pub struct TubeShape {
    /// Inner radius [m].
    #[schemars(extend("exclusiveMinimum" = 0.0))]
    pub inner_radius: f64,
    /// Outer radius [m].
    #[schemars(extend("exclusiveMinimum" = 0.0))]
    pub outer_radius: f64,
    /// Length [m].
    #[schemars(extend("exclusiveMinimum" = 0.0))]
    pub length: f64,
}

/// Triangles on a grid.
#[derive(Clone, Debug, Default, Deserialize, JsonSchema)]
#[serde(rename_all = "kebab-case")]
pub struct SheetGrid {
    /// Cells of the grid along its two axes; if not given, from `edge`.
    #[serde(default)]
    pub cells: Option<[u32; 2]>,
    /// How cells become triangles.
    #[serde(default)]
    pub pattern: PatternName,
    /// Largest shift of inner points along each axis, at random, as a part of a cell, below 0.5.
    #[serde(default)]
    #[schemars(extend("minimum" = 0.0, "exclusiveMaximum" = 0.5))]
    pub distortion: f64,
    /// Another seed, other shifts.
    #[serde(default)]
    pub seed: u64,
}

/// How the cells of a grid become triangles.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Deserialize, Serialize, JsonSchema)]
#[serde(rename_all = "kebab-case")]
pub enum PatternName {
    /// Two triangles, all diagonals from the start of both axes to their ends.
    #[default]
    Diagonal,
    /// Two triangles, all diagonals the other way.
    Antidiagonal,
    /// Two triangles, diagonals mirrored from cell to cell.
    UnionJack,
    /// Four triangles round the middle.
    Crossed,
}

/// A rectangle; grid axes are x and y.
#[derive(Clone, Debug, Deserialize, JsonSchema)]
#[serde(rename_all = "kebab-case")]
pub struct PlateShape {
    /// Lengths along x and y [m].
    pub size: [f64; 2],
    /// Its triangles.
    #[serde(flatten)]
    pub grid: SheetGrid,
}

/// A cylinder or a part of one; grid axes are round and along.
#[derive(Clone, Debug, Deserialize, JsonSchema)]
#[serde(rename_all = "kebab-case")]
pub struct CylinderShape {
    /// Radius [m].
    #[schemars(extend("exclusiveMinimum" = 0.0))]
    pub radius: f64,
    /// Length [m].
    #[schemars(extend("exclusiveMinimum" = 0.0))]
    pub length: f64,
    /// Angle from the x axis [degrees] at which a part starts.
    #[serde(default)]
    pub from: f64,
    /// Angle that it spans [degrees].
    #[serde(default = "whole_turn")]
    #[schemars(extend("exclusiveMinimum" = 0.0, "maximum" = 360.0))]
    pub span: f64,
    /// Its triangles.
    #[serde(flatten)]
    pub grid: SheetGrid,
}

/// A sphere: an icosahedron whose triangles are cut into four again and again.
#[derive(Clone, Debug, Deserialize, JsonSchema)]
#[serde(rename_all = "kebab-case", deny_unknown_fields)]
pub struct SphereShape {
    /// Radius [m].
    #[schemars(extend("exclusiveMinimum" = 0.0))]
    pub radius: f64,
    /// How often triangles are cut: 0 makes 20, 1 makes 80, 2 makes 320; if not given, from `edge`.
    #[serde(default)]
    pub levels: Option<u32>,
}

/// A hemisphere or a part of one; grid axes are round and towards the pole.
#[derive(Clone, Debug, Deserialize, JsonSchema)]
#[serde(rename_all = "kebab-case")]
pub struct HemisphereShape {
    /// Radius [m].
    #[schemars(extend("exclusiveMinimum" = 0.0))]
    pub radius: f64,
    /// Angle between the axis and the edge of the hole [degrees].
    #[schemars(extend("exclusiveMinimum" = 0.0, "exclusiveMaximum" = 90.0))]
    pub hole: f64,
    /// Angle from the x axis that it spans [degrees].
    #[serde(default = "whole_turn")]
    #[schemars(extend("exclusiveMinimum" = 0.0, "maximum" = 360.0))]
    pub span: f64,
    /// Its triangles.
    #[serde(flatten)]
    pub grid: SheetGrid,
}

/// A ring; grid axes are outwards and round. A whole turn has a slit: its sides lie on each other, but are not joined.
#[derive(Clone, Debug, Deserialize, JsonSchema)]
#[serde(rename_all = "kebab-case")]
pub struct AnnulusShape {
    /// Inner radius [m].
    #[schemars(extend("exclusiveMinimum" = 0.0))]
    pub inner: f64,
    /// Outer radius [m].
    #[schemars(extend("exclusiveMinimum" = 0.0))]
    pub outer: f64,
    /// Angle from the x axis that it spans [degrees].
    #[serde(default = "whole_turn")]
    #[schemars(extend("exclusiveMinimum" = 0.0, "maximum" = 360.0))]
    pub span: f64,
    /// Its triangles.
    #[serde(flatten)]
    pub grid: SheetGrid,
}

/// A strip that turns; grid axes are along and across.
#[derive(Clone, Debug, Deserialize, JsonSchema)]
#[serde(rename_all = "kebab-case")]
pub struct TwistedStripShape {
    /// Length along x [m].
    #[schemars(extend("exclusiveMinimum" = 0.0))]
    pub length: f64,
    /// Width [m].
    #[schemars(extend("exclusiveMinimum" = 0.0))]
    pub width: f64,
    /// Angle between its ends [degrees].
    pub twist: f64,
    /// Its triangles.
    #[serde(flatten)]
    pub grid: SheetGrid,
}

/// An intra-ocular lens: a disc, the optic, and two loops half a turn apart, the haptics. From the x axis on a haptic leaves the optic, and goes on at
/// the overall diameter.
#[derive(Clone, Copy, Debug, Deserialize, JsonSchema)]
#[serde(rename_all = "kebab-case", deny_unknown_fields)]
pub struct LensShape {
    /// Diameter of the optic [m].
    #[schemars(extend("exclusiveMinimum" = 0.0))]
    pub optic: f64,
    /// Diameter of the circle around all of it [m].
    #[schemars(extend("exclusiveMinimum" = 0.0))]
    pub overall: f64,
    /// Width of a haptic [m].
    #[schemars(extend("exclusiveMinimum" = 0.0))]
    pub width: f64,
    /// Angle over which a haptic leaves the optic [degrees].
    #[schemars(extend("exclusiveMinimum" = 0.0, "maximum" = 180.0))]
    pub transition: f64,
    /// Angle over which a haptic goes in all [degrees].
    #[schemars(extend("exclusiveMinimum" = 0.0, "maximum" = 180.0))]
    pub sweep: f64,
}

fn whole_turn() -> f64 {
    360.0
}

/// A built-in organ of analytic shape.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Deserialize, Serialize, JsonSchema)]
#[serde(rename_all = "kebab-case")]
pub enum Organ {
    /// A liver of 0.77 l; about 1.5 l at scale 1.25.
    Liver,
    /// A brain of 1.3 l with sulci and fissure; labels 1 (tissue), 2 (ventricles) and 3 (tumour).
    Brain,
}

/// A finer surface carried by a body.
#[derive(Clone, Debug, Deserialize, JsonSchema)]
#[serde(rename_all = "kebab-case", deny_unknown_fields)]
pub struct SurfaceTable {
    /// The body that carries it.
    pub on: String,
    /// The surface: triangles or quads of a file, the boundary of a built-in shape, or of an image its boundary or, with
    /// `as = "surface"`, its smooth surface.
    pub mesh: MeshTable,
}
