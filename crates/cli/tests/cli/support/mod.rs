//! A folder with a scene, the real binary run in it, and its output.

use std::ops::Deref;
use std::process::{Command, Output};

use pliant_testing::scenes;
use serde_json::Value;

pub use pliant_testing::scenes::{
    BLOCK, CORNERS, FROM_FILE, FROM_IMAGE, TETS, changed, from_names, labels, resumable, series, vtk,
};

/// A temporary folder with a scene in `case/scene.toml`, in which the binary runs.
pub struct Workshop(scenes::Workshop);

impl Deref for Workshop {
    type Target = scenes::Workshop;

    fn deref(&self) -> &Self::Target {
        &self.0
    }
}

impl Workshop {
    pub fn new(scene: &str) -> Self {
        Self(scenes::Workshop::new(scene))
    }

    /// [`BLOCK`] with one place changed.
    pub fn block(good: &str, other: &str) -> Self {
        Self(scenes::Workshop::block(good, other))
    }

    /// The binary, to be run in the folder.
    pub fn command(&self, arguments: &[&str]) -> Command {
        let mut command = Command::new(env!("CARGO_BIN_EXE_pliant"));
        command.args(arguments).current_dir(self.path(""));
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
}

pub fn has_gpu() -> bool {
    pliant_testing::has_gpu(pliant_gpu::adapters().len())
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
