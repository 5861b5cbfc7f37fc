//! `mesh` of a body.

use std::collections::BTreeMap;
use std::path::PathBuf;

use pliant_geometry::CellLabel;
use pliant_imaging::LabelChoice;
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use super::{
    AnnulusShape, BlockShape, CylinderShape, EllipsoidShape, HemisphereShape, LensShape, Organ, PlateShape,
    SphereShape, TubeShape, TwistedStripShape,
};

/// A mesh: exactly one of `file`, `image`, `block`, `ellipsoid`, `tube`, `organ`, for shells `plate`,
/// `cylinder`, `sphere`, `hemisphere`, `annulus`, `twisted-strip`, `lens`, or for bars `lines`.
#[derive(Clone, Debug, Default, Deserialize, JsonSchema)]
#[serde(rename_all = "kebab-case", deny_unknown_fields)]
pub struct MeshTable {
    /// A mesh file, relative to the scene: Gmsh (.msh), VTK (.vtk, .vtu), OBJ, OFF, STL, PLY, GIfTI,
    /// FreeSurfer. Its own cells are used, unless `as` asks for new cells from its surface.
    #[serde(default)]
    pub file: Option<PathBuf>,
    /// Name of a mesh in the memory of the program that reads the scene, instead of a `file`. Not available
    /// on the command line.
    #[serde(default)]
    pub given: Option<String>,
    /// A segmented image, relative to the scene: NIfTI (.nii, .nii.gz), NRRD, MetaImage (.mha, .mhd), GIPL, a
    /// DICOM segmentation, or the folder of a DICOM series. Coordinates are the patient's: x to the right, y
    /// to the front, z to the head [m].
    #[serde(default)]
    pub image: Option<PathBuf>,
    /// Another image of the same voxels; its values are added before the `threshold`, as grey matter to white
    /// matter.
    #[serde(default)]
    pub add: Option<PathBuf>,
    /// Several masks of the same voxels as one image; each mask is an image with 0 outside. The first mask
    /// has label 1, the second 2, and so on; each label has the name of its file. Where masks overlap, the
    /// last one counts.
    #[serde(default)]
    pub masks: Option<Vec<PathBuf>>,
    /// Names for the labels: a table of ITK-SNAP, FreeSurfer or 3D Slicer, lines like `5 liver`, JSON, or the
    /// word `totalsegmentator`.
    #[serde(default)]
    pub names: Option<PathBuf>,
    /// Label of the image to mesh, by number or name; or groups of labels, each one material of that name:
    /// `{ tissue = [1, 5, "liver"], bone = "26-50" }`. Cells of a group carry the number of its first label.
    /// The first group by name takes what cleaning adds.
    #[serde(default)]
    pub label: Option<LabelOrGroups>,
    /// Several labels of the image as one body, by number, name or range as `"5-8"`; of `masks` all if not
    /// given. Each cell has its own as cell data `label`, for `law`, `density` and `hourglass` by label. The
    /// first label takes what cleaning adds.
    #[serde(default)]
    pub labels: Option<Vec<Label>>,
    /// Labels of vessels in the organ of `label` or `labels`, by number, name or range. Vessel voxels inside
    /// the organ belong to the organ, with the label of the tissue around them. Vessel voxels outside do not.
    /// A voxel is inside if more than half of the 26 directions from it lead through vessels into the organ.
    #[serde(default)]
    pub vessels: Option<Vec<Label>>,
    /// Instead of labels: all voxels of at least this value, as of a map of probabilities. Their label is 1.
    #[serde(default)]
    pub threshold: Option<f64>,
    /// Cleaning of the labels of an image, or of the volume inside the surface of a file, before new cells
    /// are made.
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
    /// A rectangle of triangles in the plane z = 0 from the origin, facing +z. Point sets: `x-min`, `x-max`,
    /// `y-min`, `y-max`.
    #[serde(default)]
    pub plate: Option<PlateShape>,
    /// A cylinder of triangles about the z axis from z = 0, open at its ends, facing outwards. Point sets:
    /// `z-min`, `z-max`, and of a part `start`, `end`.
    #[serde(default)]
    pub cylinder: Option<CylinderShape>,
    /// A sphere of triangles about the origin, facing outwards.
    #[serde(default)]
    pub sphere: Option<SphereShape>,
    /// A hemisphere of triangles z ≥ 0 about the z axis with a hole at the pole, facing outwards. Point sets:
    /// `equator`, `hole`, and of a part `start`, `end`.
    #[serde(default)]
    pub hemisphere: Option<HemisphereShape>,
    /// A ring of triangles in the plane z = 0 about the origin, facing +z, slit along +x. Point sets:
    /// `inner`, `outer`, `start`, `end`.
    #[serde(default)]
    pub annulus: Option<AnnulusShape>,
    /// A strip of triangles along x that turns about the x axis. Point sets: `x-min`, `x-max`, `low`, `high`.
    #[serde(default)]
    pub twisted_strip: Option<TwistedStripShape>,
    /// A flat intra-ocular lens of triangles in the plane z = 0 about the origin, facing +z, with edges of
    /// about `edge`. Point sets: `optic`, `haptics`.
    #[serde(default)]
    pub lens: Option<LensShape>,
    /// Paths of bars from point to point [m]: `lines = [[[0, 0, 0], [0, 0, 0.02]]]`. They meet where they
    /// have a point in common; with `edge` each piece is cut into bars of about that length.
    #[serde(default)]
    pub lines: Option<Vec<Vec<[f64; 3]>>>,
    /// Target edge length [m] of the cells of a built-in shape, an image or the volume inside the surface of
    /// a file.
    #[serde(default)]
    #[schemars(extend("exclusiveMinimum" = 0.0))]
    pub edge: Option<f64>,
    /// Longer edge of tets inside, away from the surface [m], rounded down to 2, 4, 8, ... times `edge`. For
    /// tets of an image, or of the volume inside the surface of a file.
    #[serde(default)]
    #[schemars(extend("exclusiveMinimum" = 0.0))]
    pub inner_edge: Option<f64>,
    /// Labels with smaller tets: numbers or names, for half of `edge`, or tables with their edge, as
    /// `["tumour", { label = 5, edge = 0.002 }]`. Edges are rounded down to a half, a quarter, ... of `edge`.
    #[serde(default)]
    pub protect: Option<Vec<Protected>>,
    /// Largest distance between the boundary of tets and the body [m], both ways. Tets are made smaller where
    /// they exceed it. The distance is measured to the triangles of a file, or to the smooth surface of an
    /// image. Without `edge` the first edge is chosen automatically.
    #[serde(default)]
    #[schemars(extend("exclusiveMinimum" = 0.0))]
    pub distance: Option<f64>,
    /// Number of triangles of a `surface` of an image or a file, instead of `edge`. They are placed where the
    /// shape needs them.
    #[serde(default)]
    #[schemars(range(min = 4))]
    pub triangles: Option<u32>,
    /// Number of `shells` fitted to an image or to the surface of a file.
    #[serde(default)]
    #[schemars(range(min = 4))]
    pub shells: Option<u32>,
    /// Largest distance of `shells` from the surface of an image, both ways, as a part of the diagonal of its
    /// box.
    #[serde(default)]
    #[schemars(extend("exclusiveMinimum" = 0.0, "exclusiveMaximum" = 1.0))]
    pub error: Option<f64>,
    /// Cells of a built-in shape or an image (tets if not given), or of the closed surface of a `file`.
    #[serde(default, rename = "as")]
    pub cells: Option<Cells>,
    /// Factor on all lengths: the size of one unit of the mesh in metres (0.001 for millimetres); 1 if not
    /// given. A file that would be larger than 10 m needs it.
    #[serde(default)]
    #[schemars(extend("exclusiveMinimum" = 0.0))]
    pub scale: Option<f64>,
    /// Turn about the origin, after scaling: about the axis of this vector by its length [rad].
    /// `[0, 0, 3.14159265]` takes the axes left, back, head (LPS) to right, front, head (RAS). Data of three
    /// components turn as vectors.
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
    /// Labels of an image that it stands for.
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

/// Labels that become one: a label, a range, or a list of labels and ranges.
#[derive(Clone, Debug, PartialEq, Eq, Deserialize, JsonSchema)]
#[serde(untagged)]
pub enum LabelGroup {
    /// A label, or a range as `"26-50"`.
    One(Label),
    /// Several labels and ranges.
    Several(Vec<Label>),
}

impl LabelOrGroups {
    /// Labels or groups of labels of an image that it stands for.
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
    /// True to fill cavities without a way out.
    #[serde(default)]
    pub fill_holes: bool,
    /// True to keep only the largest piece.
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
    /// Hexahedra: structured for blocks and tubes, cubes with a stepped surface for ellipsoids, organs and
    /// images.
    Hexes,
    /// Cubes that an ellipsoid, an organ or an image fills by more than 2 %. The filled part of a cube scales
    /// its stiffness and mass. A carried surface shows the body smooth.
    ImmersedHexes,
    /// The smooth surface of an image in triangles: even triangles of `edge`, or as few as `triangles`. For a
    /// carried surface they may be as fine as the voxels.
    Surface,
    /// Curved shells fitted to the smooth surface of an image: as many as `shells`, or as close as `error`.
    Shells,
}
