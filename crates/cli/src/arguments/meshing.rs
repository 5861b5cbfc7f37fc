//! Options of meshes.

use std::path::PathBuf;

use clap::ValueEnum;
use pliant_geometry::CellLabel;
use pliant_imaging::LabelChoice;

pub(super) const MESH_HELP: &str = "\
Images: NIfTI (.nii, .nii.gz), NRRD, MetaImage (.mha, .mhd), GIPL, a DICOM segmentation, or the folder of a DICOM series. The mesh is
in metres, in patient coordinates: x to the right, y to the front, z to the head.
Closed surfaces: the triangles and quads of OBJ, OFF, STL, PLY, VTP, VTK, VTU, Gmsh, GIfTI or FreeSurfer files, in metres or with
`--scale`.

Examples:
  pliant labels seg.nii.gz
  pliant mesh seg.nii.gz --label 5 --edge 8mm -o liver.vtu                             # or --edge 0.008
  pliant mesh liver.stl --scale 0.001 --edge 8mm --young 5000 -o liver.vtu             # a surface in millimetres
  pliant mesh brain.nii.gz --label 1 --label 2 --edge 6mm --keep-largest -o brain.vtu   # two materials
  pliant mesh seg.nrrd --label liver --label tumour --edge 8mm -o liver.vtu            # labels by name
  pliant mesh seg.nii.gz --names totalsegmentator --label heart --edge 8mm -o heart.vtu # names from a table
  pliant mesh liver.nii.gz tumour.nii.gz --edge 8mm -o liver.vtu                       # masks: labels 1 and 2
  pliant mesh seg.nii.gz --label 5 --edge 0.01 --as hexes --close-gaps 3mm --fill-holes -o liver.msh
  pliant mesh seg.nii.gz --label 5 --edge 1cm --as immersed-hexes -o liver.vtu         # cubes weighted by fraction
  pliant mesh grey.nii --threshold 0.5 --edge 8mm -o grey.vtu
  pliant mesh grey.nii --add white.nii --threshold 0.5 --edge 8mm -o brain.vtu         # two maps of probabilities

  pliant mesh seg.nii.gz --label 5 --vessels 6=1mm --capsule 0.1mm --edge 8mm -o liver/scene.toml  # to `pliant run liver`

  pliant mesh seg.nii.gz --label 5 --as surface --edge 5mm -o liver.ply              # even triangles
  pliant mesh liver.stl --as surface --cells 8000 -o coarse.stl                        # that many triangles
  pliant mesh liver.stl --as shells --error 0.5% -o liver.vtu --error-map off.vtu      # or --shells 800

A mesh of volume cells contributes its boundary. Shells are curved triangles: point data `normal` holds the fitted normals of their
nodes.

Cell data `label` holds the label of each volume cell. A scene can name the image directly:
  mesh = { image = \"seg.nii.gz\", label = 5, edge = 0.008 }

Exit codes: 0 done, 1 the mesh could not be written, 2 invalid input.";

#[derive(Debug, clap::Args)]
pub struct Labels {
    /// An image file, or the folder of a DICOM series.
    pub image: PathBuf,
    /// More masks on the same voxels: the first image is label 1, these are 2, 3, …, named after their files.
    #[arg(value_name = "MASK")]
    pub masks: Vec<PathBuf>,
    /// Names of the labels: a table of ITK-SNAP, FreeSurfer or 3D Slicer, lines like `5 liver`, JSON, or the
    /// word `totalsegmentator`.
    #[arg(long, value_name = "TABLE")]
    pub names: Option<PathBuf>,
    /// Read an image of more than 2 GiB.
    #[arg(long)]
    pub force: bool,
    /// UID of the DICOM series, if the folder holds several.
    #[arg(long, value_name = "UID")]
    pub series: Option<String>,
    /// Print one JSON object on standard output.
    #[arg(long)]
    pub json: bool,
}

#[derive(Clone, Debug, clap::Args)]
pub struct MeshImage {
    /// An image file, the folder of a DICOM series, or a mesh file (for tets and hexes a closed surface).
    #[arg(value_name = "INPUT")]
    pub image: PathBuf,
    /// More masks on the same voxels: the first image is label 1, these are 2, 3, …, named after their files.
    /// All are meshed unless `--label` selects some. Where masks overlap, the last one wins.
    #[arg(value_name = "MASK")]
    pub masks: Vec<PathBuf>,
    /// Another image on the same voxels, added before `--threshold`, such as grey matter to white matter.
    #[arg(long, value_name = "IMAGE")]
    pub add: Option<PathBuf>,
    /// Label to mesh: 5, a range 5-8, or a name. Several labels make one mesh of several materials; the first
    /// one gets the voxels that cleaning adds. For a surface, the label of its cells.
    #[arg(long, value_name = "LABEL", allow_hyphen_values = true)]
    pub label: Vec<LabelChoice>,
    /// Names of the labels: a table of ITK-SNAP, FreeSurfer or 3D Slicer, lines like `5 liver`, JSON, or the
    /// word `totalsegmentator`.
    #[arg(long, value_name = "TABLE")]
    pub names: Option<PathBuf>,
    /// Instead of labels: all voxels with at least this value, for example in a probability map; with several
    /// masks, the voxels of each mask.
    #[arg(long, value_name = "VALUE", allow_negative_numbers = true)]
    pub threshold: Option<f64>,
    /// Edge of the cells: 0.008 in metres, or 8mm. Tets and hexes need it; a surface gets even triangles of
    /// this edge.
    #[arg(long, value_name = "LENGTH", value_parser = length, allow_hyphen_values = true)]
    pub edge: Option<f64>,
    /// Tets: largest distance between mesh boundary and body in both directions, such as 1mm; cells become
    /// smaller where it is exceeded. The reference is the triangles of a surface, or the smooth surface of an
    /// image. Without `--edge` the first edge is automatic.
    #[arg(long, value_name = "LENGTH", value_parser = length, allow_hyphen_values = true)]
    pub distance: Option<f64>,
    /// Tets: longer edge inside, away from the surface, rounded down to 2, 4, 8, ... times `--edge`.
    #[arg(long, value_name = "LENGTH", value_parser = length, allow_hyphen_values = true)]
    pub inner_edge: Option<f64>,
    /// Tets: a label with smaller cells, by number or name: 4 for half of `--edge`, or tumour=2mm, rounded
    /// down to a half, quarter, ... of `--edge`.
    #[arg(long, value_name = "LABEL[=LENGTH]", value_parser = protected, allow_hyphen_values = true)]
    pub protect: Vec<(CellLabel, Option<f64>)>,
    /// Number of triangles of a surface instead of their edge, placed where the shape needs them.
    #[arg(long = "cells", value_name = "N", conflicts_with = "edge")]
    pub triangles: Option<usize>,
    /// Number of shells.
    #[arg(long, value_name = "N", conflicts_with_all = ["edge", "triangles"])]
    pub shells: Option<usize>,
    /// Largest distance between shells and surface in both directions, as a fraction of the diagonal of its
    /// box: 0.005 or 0.5%.
    #[arg(long, value_name = "PART", value_parser = part, conflicts_with_all = ["edge", "triangles", "shells"])]
    pub error: Option<f64>,
    /// Factor that converts lengths of a mesh file to metres: 0.001 for millimetres. Images store theirs. A
    /// file larger than 10 m needs it.
    #[arg(long, value_name = "FACTOR")]
    pub scale: Option<f64>,
    /// Also write the curved surface of the shells as small triangles, with the distance from the target as
    /// point data.
    #[arg(long, value_name = "FILE", conflicts_with_all = ["edge", "triangles"])]
    pub error_map: Option<PathBuf>,
    /// Type of mesh: tetrahedra optimised for long stable steps, cubes with a stepped surface, immersed
    /// cubes, a surface, or curved shells. Immersed cubes are all cubes that the body touches, with the
    /// fraction that it fills (cell data `fraction`).
    #[arg(long = "as", value_name = "CELLS", default_value = "tets")]
    pub cells: MeshCells,
    /// In a scene: a label whose surface is a wall of that thickness, tied to the tissue, such as "portal
    /// vein=1mm"; may be repeated. Voxels of the label inside the organ become tissue.
    #[arg(long, value_name = "LABEL=LENGTH", value_parser = vessel, allow_hyphen_values = true)]
    pub vessels: Vec<(LabelChoice, f64)>,
    /// In a scene: a capsule of this thickness on the boundary of the tissue, such as 0.1mm.
    #[arg(long, value_name = "LENGTH", value_parser = wall, allow_hyphen_values = true)]
    pub capsule: Option<f64>,
    /// Name of the mesh: .vtu or .msh, for a surface also .ply, .obj or .stl. A name with .toml makes a scene
    /// of the image, with walls and ties.
    #[arg(short, long, value_name = "FILE")]
    pub out: PathBuf,
    /// Close gaps and channels up to this width, or holes of a surface: 0.003 in metres, or 3mm. Holes of a
    /// surface narrower than the cells are always closed.
    #[arg(long, value_name = "LENGTH", value_parser = length, default_value = "0", allow_hyphen_values = true)]
    pub close_gaps: f64,
    /// Fill closed cavities.
    #[arg(long)]
    pub fill_holes: bool,
    /// Keep only the largest piece.
    #[arg(long)]
    pub keep_largest: bool,
    /// Allow more than five million cells and images of more than 2 GiB.
    #[arg(long)]
    pub force: bool,
    /// UID of the DICOM series, if the folder holds several.
    #[arg(long, value_name = "UID")]
    pub series: Option<String>,
    /// Tissue of the reported stable step: brain-like (E = 3000 Pa) or liver-like (E = 19 kPa), both with ν =
    /// 0.45; by default both.
    #[arg(long, value_name = "NAME", conflicts_with = "young")]
    pub law: Option<Tissue>,
    /// Young's modulus of the tissue of the reported stable step [Pa].
    #[arg(long, value_name = "PA", value_parser = positive)]
    pub young: Option<f64>,
    /// Poisson's ratio of that tissue.
    #[arg(long, value_name = "RATIO", default_value_t = 0.45, value_parser = poisson, requires = "young")]
    pub poisson: f64,
    /// Density of the tissue [kg/m³].
    #[arg(long, value_name = "KG/M3", default_value_t = 1000.0, value_parser = positive)]
    pub density: f64,
    /// Print one JSON object on standard output.
    #[arg(long)]
    pub json: bool,
}

#[derive(Clone, Copy, Debug, PartialEq, ValueEnum)]
pub enum Tissue {
    BrainLike,
    LiverLike,
}

#[derive(Clone, Copy, Debug, ValueEnum)]
pub enum MeshCells {
    Tets,
    Hexes,
    ImmersedHexes,
    Surface,
    Shells,
}

/// A length [m]: a number in metres, or a number with a unit.
pub(super) fn length(typed: &str) -> Result<f64, String> {
    const UNITS: [(&str, f64); 5] = [("µm", 1e-6), ("um", 1e-6), ("mm", 1e-3), ("cm", 1e-2), ("m", 1.0)];
    let unit = UNITS.iter().find_map(|(unit, metres)| Some((typed.strip_suffix(unit)?, metres)));
    let (number, metres) = unit.unwrap_or((typed, &1.0));
    match number.trim_end().parse::<f64>() {
        Ok(number) => Ok(number * metres),
        Err(_) => {
            Err("a length is a number in metres, such as 0.008, or a number with a unit, such as 8mm".into())
        }
    }
}

/// A label with an optional length.
pub(super) fn protected(typed: &str) -> Result<(CellLabel, Option<f64>), String> {
    let (label, edge) = typed.rsplit_once('=').map_or((typed, None), |(label, edge)| (label, Some(edge)));
    let label = match label.trim() {
        "" => {
            return Err(
                "give a label by number or name, such as 4, or with an edge, such as tumour=2mm".into()
            );
        }
        text => text.parse().unwrap_or_else(|never: std::convert::Infallible| match never {}),
    };
    Ok((label, edge.map(str::trim).map(length).transpose()?))
}

/// A label and the thickness of its wall.
pub(super) fn vessel(typed: &str) -> Result<(LabelChoice, f64), String> {
    let help = "give a label with the thickness of its wall, such as 3=1mm or \"portal vein=1mm\"";
    let (label, thickness) = typed.rsplit_once('=').ok_or(help)?;
    let label = label.trim().parse().map_err(|_| help)?;
    Ok((label, wall(thickness.trim())?))
}

/// The thickness of a wall [m].
pub(super) fn wall(typed: &str) -> Result<f64, String> {
    match length(typed)? {
        thickness if thickness > 0.0 => Ok(thickness),
        _ => Err("the thickness of a wall must be above 0".into()),
    }
}

pub(super) fn positive(typed: &str) -> Result<f64, String> {
    match typed.parse() {
        Ok(number) if number > 0.0 && f64::is_finite(number) => Ok(number),
        _ => Err("it must be positive and finite".into()),
    }
}

pub(super) fn poisson(typed: &str) -> Result<f64, String> {
    match typed.parse() {
        Ok(number) if number > -1.0 && number < 0.5 => Ok(number),
        _ => Err("a Poisson's ratio lies between -1 and 0.5".into()),
    }
}

/// A fraction or a percentage.
pub(super) fn part(typed: &str) -> Result<f64, String> {
    let number = match typed.strip_suffix('%') {
        Some(percent) => percent.trim().parse::<f64>().map(|percent| percent / 100.0),
        None => typed.parse(),
    };
    match number {
        Ok(part) if part > 0.0 && part < 1.0 => Ok(part),
        _ => Err("give a fraction of the diagonal above 0 and below 1, such as 0.005 or 0.5%".into()),
    }
}
