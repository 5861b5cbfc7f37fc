//! The scene of a mesh alone: soft tissue that is held at one end, to be viewed and pulled.

use std::path::{Path, PathBuf};

use pliant_geometry::io::{self, Format, MeshFileError};
use pliant_geometry::words::number;
use pliant_geometry::{Labels, Mesh};

/// A body whose longest side is longer than this [m] is taken to be in millimetres.
const LARGEST: f64 = 2.0;
/// Cells along the longest side of the volume inside a surface.
const CELLS: f64 = 12.0;
/// Young's modulus [Pa], Poisson's ratio and density [kg/m³].
const TISSUE: [f64; 3] = [5e3, 0.45, 1000.0];

/// A scene made of a mesh.
#[derive(Clone, Debug, PartialEq)]
pub struct SceneOfMesh {
    /// Its text, in which the mesh is named without its folder.
    pub text: String,
    /// The folder of the mesh.
    pub folder: PathBuf,
    /// Assumptions in a sentence.
    pub assumed: String,
}

/// True if a path has the ending of a mesh file.
pub fn is_mesh(path: &Path) -> bool {
    Format::of_path(path).is_some()
}

/// Makes a scene of a mesh file: soft tissue, held where its lowest tenth along its longest side is. The
/// volume inside a surface is filled with tets; labelled elements of a volume mesh are coloured by their
/// labels. Damping is half of the critical damping of the slowest vibration along that side.
///
/// # Errors
/// If the file can't be read.
pub fn scene_of_mesh(path: &Path) -> Result<SceneOfMesh, MeshFileError> {
    let name = path.file_name().map_or_else(String::new, |name| name.to_string_lossy().into_owned());
    let folder = path.parent().unwrap_or(Path::new("")).to_owned();
    Ok(SceneOfMesh { folder, ..scene_of(&io::read(path)?.mesh, "file", &name) })
}

/// Writes the scene of a mesh in metres that a program [gives](crate::source::Source::giving) by a name.
pub fn scene_of_given(mesh: &Mesh, name: &str) -> SceneOfMesh {
    scene_of(mesh, "given", name)
}

/// The scene of a mesh that stands under a key of `mesh`.
fn scene_of(mesh: &Mesh, key: &str, name: &str) -> SceneOfMesh {
    let (low, high) = mesh.bounds().unwrap_or_default();
    let size = high - low;
    let axis = size.imax();
    let in_millimetres = key == "file" && size[axis] > LARGEST;
    let (scale, unit) = if in_millimetres { (1e-3, "millimetres") } else { (1.0, "metres") };
    let length = scale * size[axis];
    let filled = mesh.volume_blocks().all(|block| block.is_empty());
    let quoted = serde_json::Value::from(name);
    let edge = rounded(length / CELLS);
    let how = if filled {
        format!("as = \"tets\", edge = {edge}")
    } else {
        "fix = [\"reorder\", \"drop-unused\"]".into()
    };
    let [young, poisson, density] = TISSUE;
    let damping = rounded(calming(young, density, length));
    let labelled = !filled && !Labels::of(mesh).is_empty();
    let view = if labelled { "\n[view]\ncolour = \"label\"\n" } else { "" };
    let mut point = scale * low;
    point[axis] += 0.1 * length;
    let mut normal = [0, 0, 0];
    normal[axis] = -1;
    let text = format!(
        r#"[scene]
title = {quoted}
until = 10.0

[law.tissue]
type = "neo-hookean"
young-modulus = {young:?}
poisson-ratio = {poisson:?}

[body.body]
mesh = {{ {key} = {quoted}, scale = {scale:?}, {how} }}
law = "tissue"
density = {density:?}
damping = {damping}

[constraint.held]
type = "fix"
body = "body"
nodes = {{ half-space = {{ point = {point:?}, normal = {normal:?} }} }}
{view}"#,
        point = <[f64; 3]>::from(point),
    );
    let side = ["x", "y", "z"][axis];
    let mut assumed = format!(
        "`{name}` is a mesh: lengths are taken as {unit} ({} m along {side}), the tissue as neo-Hookean with E = 5 kPa, ν = 0.45 and \
         1000 kg/m³, held at its lowest tenth along {side}",
        number(length)
    );
    if filled {
        assumed.push_str(&format!("; its surface is filled with tets of {} m", number(edge)));
    }
    SceneOfMesh { text, folder: PathBuf::new(), assumed }
}

/// Damping [1/s] of a body of a length [m], α = 2 · ½ · (π/2) √(E/ρ)/L. It is half of the critical damping of
/// the slowest vibration along this length.
pub(super) fn calming(young: f64, density: f64, length: f64) -> f64 {
    0.5 * std::f64::consts::PI * (young / density).sqrt() / length.max(1e-6)
}

/// Rounds to two digits.
fn rounded(value: f64) -> f64 {
    format!("{value:.1e}").parse().unwrap_or(value)
}
