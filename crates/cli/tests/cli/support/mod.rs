//! A folder with a scene, the real binary run in it, and its output.

use std::fs;
use std::io::Write;
use std::path::{Path, PathBuf};
use std::process::{Command, Output};

use pliant_geometry::io::{self, MeshFile};
use serde_json::Value;
use tempfile::TempDir;

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

/// Corners of a cube of 0.1 m; x runs fastest.
pub const CUBE: [[f64; 3]; 8] = [
    [0.0, 0.0, 0.0],
    [0.1, 0.0, 0.0],
    [0.0, 0.1, 0.0],
    [0.1, 0.1, 0.0],
    [0.0, 0.0, 0.1],
    [0.1, 0.0, 0.1],
    [0.0, 0.1, 0.1],
    [0.1, 0.1, 0.1],
];

/// Six tets that fill it.
pub const TETS: [&[u32]; 6] =
    [&[0, 1, 3, 7], &[0, 3, 2, 7], &[0, 2, 6, 7], &[0, 6, 4, 7], &[0, 4, 5, 7], &[0, 5, 1, 7]];

/// A legacy VTK file of triangles, tets and hexes; `more` is what follows the cells.
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

/// A separate folder with a scene in `case/scene.toml`.
pub struct Workshop {
    folder: TempDir,
}

impl Workshop {
    pub fn new(scene: &str) -> Self {
        let workshop = Self { folder: tempfile::tempdir().expect("a temporary folder") };
        workshop.write("case/scene.toml", scene);
        workshop
    }

    /// [`BLOCK`] with one place changed.
    pub fn block(good: &str, other: &str) -> Self {
        Self::new(&changed(BLOCK, good, other))
    }

    pub fn path(&self, name: &str) -> PathBuf {
        self.folder.path().join(name)
    }

    pub fn write(&self, name: &str, content: impl AsRef<[u8]>) {
        let path = self.path(name);
        fs::create_dir_all(path.parent().expect("a folder")).expect("a folder is made");
        fs::write(path, content).expect("a file is written");
    }

    pub fn read(&self, name: &str) -> String {
        fs::read_to_string(self.path(name)).unwrap_or_else(|error| panic!("{name}: {error}"))
    }

    /// The binary, to be run in the folder.
    pub fn command(&self, arguments: &[&str]) -> Command {
        let mut command = Command::new(env!("CARGO_BIN_EXE_pliant"));
        command.args(arguments).current_dir(self.folder.path());
        command.env("PLIANT_CACHE", self.path("cache"));
        command
    }

    pub fn pliant(&self, arguments: &[&str]) -> Told {
        self.command(arguments).output().expect("the binary starts").into()
    }

    /// `pliant run case --json …`
    pub fn run(&self, more: &[&str]) -> Told {
        self.pliant(&[&["run", "case", "--json"], more].concat())
    }

    /// The times of a series, after all its frames were read.
    pub fn series(&self, name: &str) -> Vec<(f64, MeshFile)> {
        series(&self.path(name))
    }

    /// The header of a CSV file and its rows; all have the same number of columns, all values are numbers.
    pub fn table(&self, name: &str) -> (Vec<String>, Vec<Vec<f64>>) {
        let text = self.read(name);
        assert!(text.ends_with('\n'), "the last row of {name} is not whole");
        let mut lines = text.lines();
        let header: Vec<String> = lines.next().expect("a header").split(',').map(str::to_owned).collect();
        let number = |text: &str| text.parse::<f64>().unwrap_or_else(|_| panic!("{name}: {text}"));
        let rows: Vec<Vec<f64>> = lines.map(|line| line.split(',').map(number).collect()).collect();
        assert!(rows.iter().all(|row| row.len() == header.len()), "{name}");
        (header, rows)
    }
}

/// A text with the first place that reads `good` changed.
pub fn changed(text: &str, good: &str, other: &str) -> String {
    assert!(text.contains(good), "`{good}` is not in the scene");
    text.replacen(good, other, 1)
}

/// Whether a GPU exists. Without one, prints a notice, or fails the test with `PLIANT_REQUIRE_GPU=1`.
pub fn has_graphics_processor() -> bool {
    let found = !pliant_gpu::adapters().is_empty();
    let required = std::env::var("PLIANT_REQUIRE_GPU").as_deref() == Ok("1");
    assert!(found || !required, "no GPU was found, but PLIANT_REQUIRE_GPU=1 requires one");
    if !found {
        // Bypasses the capture of passing tests. A notice that can't be written is dropped.
        let _ = writeln!(std::io::stderr(), "skipped: no GPU was found");
    }
    found
}

/// Reads a ParaView series: the times, and each frame it lists.
pub fn series(index: &Path) -> Vec<(f64, MeshFile)> {
    let text = fs::read_to_string(index).unwrap_or_else(|error| panic!("{}: {error}", index.display()));
    assert!(text.trim_end().ends_with("</VTKFile>"), "{} is not whole", index.display());
    let quoted = |line: &str, key: &str| {
        let value = line.split_once(&format!("{key}=\"")).expect(key).1;
        value.split_once('"').expect("a quote").0.to_owned()
    };
    let frames = text.lines().filter(|line| line.contains("<DataSet"));
    frames
        .map(|line| {
            let time: f64 = quoted(line, "timestep").parse().expect("a time");
            let path = index.with_file_name(quoted(line, "file"));
            let frame = io::read(&path).unwrap_or_else(|error| panic!("{error}"));
            assert_eq!(frame.time, Some(time), "TimeValue of {}", path.display());
            (time, frame)
        })
        .collect()
}

/// The output of the binary.
#[derive(Debug)]
pub struct Told {
    /// The exit code; -1 if a signal ended it.
    pub code: i32,
    pub out: String,
    pub err: String,
}

impl From<Output> for Told {
    fn from(output: Output) -> Self {
        Self {
            code: output.status.code().unwrap_or(-1),
            out: String::from_utf8(output.stdout).expect("standard output is UTF-8"),
            err: String::from_utf8(output.stderr).expect("standard error is UTF-8"),
        }
    }
}

impl Told {
    /// The one object on standard output.
    pub fn json(&self) -> Value {
        let value: Value =
            serde_json::from_str(&self.out).unwrap_or_else(|error| panic!("{error}: {self:?}"));
        assert!(value.is_object(), "{value}");
        value
    }

    /// The object of a run that went well.
    #[track_caller]
    pub fn done(&self) -> Value {
        assert_eq!(self.code, 0, "{}", self.err);
        let json = self.json();
        assert_eq!(json["status"], "done", "{json}");
        json
    }

    /// Standard error as running text, without the frames that break its lines.
    pub fn words(&self) -> String {
        self.err.replace('│', " ").split_whitespace().collect::<Vec<_>>().join(" ")
    }

    /// Whether standard error shows a line of the scene with something underlined in it.
    pub fn underlines(&self, line: &str) -> bool {
        let lines: Vec<&str> = self.err.lines().collect();
        lines.windows(2).any(|pair| {
            pair[0].trim_end().ends_with(&format!("│ {line}")) && pair[1].contains(['─', '┬', '▲'])
        })
    }
}
