//! Texts of scenes and of mesh files to start from.

/// A scene with one table of every kind.
pub const BLOCK: &str = r#"[scene]
until = 0.02
gravity = [0, 0, -9.81]

[run]
precision = "double"
step = "auto"
threads = 1

[law.tissue]
type = "transversely-isotropic"
young-modulus = 10e3
poisson-ratio = 0.45
fibre-modulus = 5e3
fibre = [0, 1, 0]
prony = [{ part = "isochoric", weight = 0.3, time = 0.5 }]

[body.block]
mesh = { block = { size = [0.1, 0.1, 0.1] }, edge = 0.05 }
law = "tissue"
density = 1000
damping = 5

[surface.skin]
on = "block"
mesh = { block = { size = [0.1, 0.1, 0.1] }, edge = 0.04 }

[constraint.base]
type = "fix"
body = "block"
nodes = { set = "z-min" }

[constraint.hand]
type = "move"
body = "block"
nodes = { set = "z-max" }
by = [0, 0, 0.001]
curve = "smooth-step"

[load.push]
type = "force"
on = "block"
nodes = { nearest = { point = [0.1, 0.05, 0.05] } }
total = [0.1, 0, 0]

[load.wind]
type = "traction"
on = "skin"
faces = { normal = { direction = [1, 0, 0], within = 10 } }
traction = [0, 10, 0]

[load.squeeze]
type = "pressure"
on = "block"
faces = { set = "x-min" }
pressure = 20

[load.tilt]
type = "gravity"
acceleration = [1, 0, 0]

[output.fields]
type = "vtu"
every = 0.004
data = ["displacement", "von-mises"]

[output.history]
type = "csv"
every = 0.004
probes.middle = { on = "block", at = [0.05, 0.05, 0.05] }
"#;

/// A strip of 100 by 20 by 2 mm that is held at one end and bends under its weight. `body` has its keys of
/// mesh and model (see [`SHELL`], [`HEXES`]), `run` the keys of the table `[run]`.
pub fn strip(body: &str, run: &str) -> String {
    format!(
        r#"[scene]
until = 100
gravity = [0, 0, -9.81]
[law.wall]
type = "neo-hookean"
young-modulus = 1e6
poisson-ratio = 0.4
[body.strip]
{body}
law = "wall"
density = 1000
damping = 20
[constraint.end]
type = "fix"
body = "strip"
nodes = {{ set = "x-min" }}
[run]
{run}
"#
    )
}

/// Keys of a [`strip`] of shells.
pub const SHELL: &str =
    "model = 'shell'\nmesh = { plate = { size = [0.1, 0.02] }, edge = 0.01 }\nthickness = 0.002";

/// Keys of a [`strip`] of hexes that are integrated in full.
pub const HEXES: &str = "mesh = { block = { size = [0.1, 0.02, 0.002], cells = [10, 2, 1] }, as = 'hexes' }\nelement = 'hex8-full'";

/// A scene with a body from a mesh file.
pub const FROM_FILE: &str = r#"[scene]
until = 0.01
gravity = [0, 0, -9.81]

[run]
threads = 1

[law.tissue]
type = "neo-hookean"
young-modulus = 10e3
poisson-ratio = 0.45

[body.organ]
mesh = { file = "organ.vtk" }
law = "tissue"
density = 1000

[constraint.base]
type = "fix"
body = "organ"
nodes = { nearest = { point = [0, 0, 0], count = 4 } }

[output.fields]
type = "vtu"
every = 0.005
"#;

/// A scene with a body of a label of an image.
pub const FROM_IMAGE: &str = r#"[scene]
until = 0.01
gravity = [0, 0, -9.81]

[law.tissue]
type = "neo-hookean"
young-modulus = 3e3
poisson-ratio = 0.45

[law.core]
type = "neo-hookean"
young-modulus = 9e3
poisson-ratio = 0.45

[body.organ]
mesh = { image = "seg.nii.gz", label = 5, edge = 0.006 }
law = "tissue"
density = 1000

[constraint.base]
type = "fix"
body = "organ"
nodes = { box = [[-1, -1, -1], [1, 1, -0.008]] }
"#;

/// The scene of [`from_names`].
pub(super) const FROM_NAMES: &str = r#"[scene]
until = 0.004

[law.soft]
type = "neo-hookean"
young-modulus = 3e3
poisson-ratio = 0.45

[law.stiff]
type = "neo-hookean"
young-modulus = 9e3
poisson-ratio = 0.45

[body.organs]
mesh = { image = "organs.seg.nrrd", labels = ["liver", "spleen", "tumour"], edge = 0.006, protect = ["tumour"] }
law = { liver = "soft", spleen = "soft", Tumour = "stiff" }
density = { liver = 1060, 2 = 1050, tumour = 1100 }

[constraint.held]
type = "fix"
body = "organs"
nodes = { intersection = [{ label = "liver" }, { half-space = { point = [-0.006, 0, 0], normal = [1, 0, 0] } }] }

[load.pull]
type = "force"
on = "organs"
nodes = { label-boundary = ["spleen", "tumour"] }
total = [0, 0, 1e-3]

[output.fields]
type = "vtu"
every = 0.002
data = ["displacement"]
"#;

/// A bent block with an output of every kind and a checkpoint every 0.02 s, of an element, with or without
/// history.
pub fn resumable(element: &str, run: &str, relaxing: bool) -> String {
    let cells = if element.starts_with("tet") { "tets" } else { "hexes" };
    let prony = "prony = [{ part = \"isochoric\", weight = 0.3, time = 0.05 }, \
                 { part = \"volumetric\", weight = 0.2, time = 0.02 }]";
    format!(
        r#"[scene]
until = 0.1
gravity = [0, 0, -9.81]
[run]
checkpoint = {{ every = 0.02 }}
{run}
[law.tissue]
type = "neo-hookean"
young-modulus = 10e3
poisson-ratio = 0.45
{}
[body.block]
mesh = {{ block = {{ size = [0.1, 0.05, 0.05] }}, edge = 0.025, as = "{cells}" }}
element = "{element}"
law = "tissue"
density = 1000
damping = 10
[constraint.wall]
type = "fix"
body = "block"
nodes = {{ set = "x-min" }}
[constraint.hand]
type = "move"
body = "block"
nodes = {{ set = "x-max" }}
by = [0, 0, 0.005]
to = 0.08
[output.fields]
type = "vtu"
every = 0.013
data = ["displacement", "von-mises", "pressure"]
[output.history]
type = "csv"
every = 0.003
probes.middle = {{ on = "block", at = [0.05, 0.025, 0.025], data = ["displacement", "velocity", "pressure"] }}
"#,
        if relaxing { prony } else { "" }
    )
}

/// Corners of a cube of 0.1 m; x runs fastest.
pub const CORNERS: [[f64; 3]; 8] = [
    [0.0, 0.0, 0.0],
    [0.1, 0.0, 0.0],
    [0.0, 0.1, 0.0],
    [0.1, 0.1, 0.0],
    [0.0, 0.0, 0.1],
    [0.1, 0.0, 0.1],
    [0.0, 0.1, 0.1],
    [0.1, 0.1, 0.1],
];

/// Six tets that fill the cube.
pub const TETS: [&[u32]; 6] =
    [&[0, 1, 3, 7], &[0, 3, 2, 7], &[0, 2, 6, 7], &[0, 6, 4, 7], &[0, 4, 5, 7], &[0, 5, 1, 7]];

/// A legacy VTK file of triangles, tets and hexes; `more` follows the cells.
pub fn vtk(points: &[[f64; 3]], cells: &[&[u32]], more: &str) -> String {
    let lines = |items: &mut dyn Iterator<Item = String>| items.map(|item| item + "\n").collect::<String>();
    let joined = |cell: &[u32]| cell.iter().map(u32::to_string).collect::<Vec<_>>().join(" ");
    let kind = |cell: &&[u32]| match cell.len() {
        3 => "5",
        4 => "10",
        _ => "12",
    };
    let numbers: usize = cells.iter().map(|cell| cell.len() + 1).sum();
    let points_text = lines(&mut points.iter().map(|[x, y, z]| format!("{x} {y} {z}")));
    let cells_text = lines(&mut cells.iter().map(|cell| format!("{} {}", cell.len(), joined(cell))));
    let kinds = lines(&mut cells.iter().map(kind).map(str::to_owned));
    format!(
        "# vtk DataFile Version 3.0\norgan\nASCII\nDATASET UNSTRUCTURED_GRID\nPOINTS {} double\n{points_text}\
         CELLS {} {numbers}\n{cells_text}CELL_TYPES {}\n{kinds}{more}",
        points.len(),
        cells.len(),
        cells.len()
    )
}

/// Cell data of a legacy VTK file: one direction for each cell.
pub fn fibres(directions: &[&str]) -> String {
    format!("CELL_DATA {}\nVECTORS fibre double\n{}\n", directions.len(), directions.join("\n"))
}

/// Cell data of a legacy VTK file: one label for each cell.
pub fn labels(labels: &[i32]) -> String {
    let lines = labels.iter().map(i32::to_string).collect::<Vec<_>>().join("\n");
    format!("CELL_DATA {}\nSCALARS label int 1\nLOOKUP_TABLE default\n{lines}\n", labels.len())
}
