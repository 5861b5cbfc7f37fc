//! A scene as read: its tables as plain data, each checked on its own, with their places in the file.
//! References between tables and everything that needs a mesh are checked when the model is built.

use std::path::{Path, PathBuf};

use crate::checker::read_table;
use crate::diagnostic::{Diagnostic, SceneErrors};
use crate::nearest::nearest;
use crate::reads::{LONGEST_SCENE, Reads};
use crate::registry::{ConstraintTable, LawTable, LoadTable, OutputTable, read_law, read_typed};
use crate::source::{Node, Source, Value};
use crate::tables::{
    BodyModel, BodyTable, ContactTable, ParticipantTable, RunTable, SceneTable, SurfaceTable, TieTable,
    ToolTable, ViewTable,
};

/// A scene file and its tables.
#[derive(Clone, Debug)]
pub struct Scene {
    /// The text and the places in it.
    pub source: Source,
    /// The folder that file names in it are relative to.
    pub folder: PathBuf,
    /// `[scene]`
    pub scene: SceneTable,
    /// `[run]`
    pub run: RunTable,
    /// `[participant.NAME]`, in the order of the file, as most tables below. Bodies, obstacles, tools and
    /// contacts are in the order of their names, with walls after the other bodies.
    pub participants: Vec<(String, ParticipantTable)>,
    /// `[law.NAME]`
    pub laws: Vec<(String, LawTable)>,
    /// `[body.NAME]`
    pub bodies: Vec<(String, BodyTable)>,
    /// `[tie.NAME]`
    pub ties: Vec<(String, TieTable)>,
    /// Bodies that are tied to other participants.
    pub tied_outside: Vec<String>,
    /// `[surface.NAME]`
    pub surfaces: Vec<(String, SurfaceTable)>,
    /// `[constraint.NAME]`
    pub constraints: Vec<(String, ConstraintTable)>,
    /// `[load.NAME]`
    pub loads: Vec<(String, LoadTable)>,
    /// `[obstacle.NAME]`
    pub obstacles: Vec<(String, ToolTable)>,
    /// `[tool.NAME]`
    pub tools: Vec<(String, ToolTable)>,
    /// `[contact.NAME]`
    pub contacts: Vec<(String, ContactTable)>,
    /// Contacts between a body of this scene and a body of another participant.
    pub meets: Vec<(String, ContactTable)>,
    /// `[output.NAME]`
    pub outputs: Vec<(String, OutputTable)>,
    /// `[view]`
    pub view: ViewTable,
    /// Warnings about single values.
    pub doubts: Vec<Diagnostic>,
    /// Name of the participant's table that the run comes from, in the scene of one participant.
    pub participant: Option<String>,
    /// True if it is the scene of one participant of several.
    pub is_part: bool,
}

/// The tables a scene file can have.
const TABLES: [&str; 14] = [
    "scene",
    "run",
    "participant",
    "law",
    "body",
    "tie",
    "surface",
    "constraint",
    "load",
    "obstacle",
    "tool",
    "contact",
    "output",
    "view",
];

/// Reason why a scene could not be read.
#[derive(Debug, thiserror::Error)]
pub enum ReadError {
    /// The file can't be opened.
    #[error("the scene `{path}` cannot be read: {reason}")]
    File {
        /// Its path.
        path: PathBuf,
        /// Message of the system.
        reason: String,
    },
    /// The file has mistakes.
    #[error("{0}")]
    Scene(SceneErrors),
}

/// The scene file meant by a path: a folder means its `scene.toml`.
pub fn scene_file(path: &Path) -> PathBuf {
    if path.is_dir() { path.join("scene.toml") } else { path.to_owned() }
}

/// Reads the text of a scene file (or of the `scene.toml` of a folder).
///
/// # Errors
/// If the file can't be read or is not TOML.
pub fn open(path: &Path) -> Result<(Source, PathBuf), ReadError> {
    open_within(path, Reads::anywhere())
}

/// Reads a scene file like [`open`], with the files that may be read: the scene file itself and all files
/// that it names.
///
/// # Errors
/// If the file can't or may not be read, or is not TOML.
pub fn open_within(path: &Path, reads: Reads) -> Result<(Source, PathBuf), ReadError> {
    let file = scene_file(path);
    let failed = |reason: String| ReadError::File { path: file.clone(), reason };
    let bytes = reads.read(&file, LONGEST_SCENE).map_err(|error| failed(error.to_string()))?;
    let text = String::from_utf8(bytes).map_err(|_| failed("it is not a text file (UTF-8)".into()))?;
    let source = Source::parse(file.display().to_string(), text).map_err(ReadError::Scene)?;
    Ok((source.reading(reads), file.parent().unwrap_or(Path::new("")).to_owned()))
}

impl Scene {
    /// The path of a file that the scene names.
    ///
    /// # Errors
    /// If it may not be read.
    pub fn file(&self, name: &Path) -> std::io::Result<PathBuf> {
        self.source.reads().allow(&self.folder.join(name))
    }

    /// Reads a scene from its text; file names in it are relative to `folder`.
    ///
    /// # Errors
    /// Reports all mistakes of all tables together.
    pub fn from_source(source: Source, folder: PathBuf) -> Result<Self, SceneErrors> {
        let mut out = Vec::new();
        check_top(&source, &mut out);
        let scene = read_scene_table(&source, &mut out);
        let run = read_table::<RunTable>(&source, &["run"], &[], &mut out);
        let participants = read_all(
            &source,
            "participant",
            |s, path, out| read_table::<ParticipantTable>(s, path, &[], out),
            &mut out,
        );
        let laws = read_all(&source, "law", read_law, &mut out);
        let mut bodies =
            read_all(&source, "body", |s, path, out| read_table::<BodyTable>(s, path, &[], out), &mut out);
        for (name, table) in bodies.iter_mut().filter(|(_, table)| table.on.is_some()) {
            if source.node(&["body", name, "model"]).is_none() {
                table.model = BodyModel::Membrane;
            }
        }
        // Walls after the bodies that they are on.
        bodies.sort_by(|(a, of_a), (b, of_b)| (of_a.on.is_some(), a).cmp(&(of_b.on.is_some(), b)));
        let ties =
            read_all(&source, "tie", |s, path, out| read_table::<TieTable>(s, path, &[], out), &mut out);
        let surfaces = read_all(
            &source,
            "surface",
            |s, path, out| read_table::<SurfaceTable>(s, path, &[], out),
            &mut out,
        );
        let constraints = read_all(&source, "constraint", read_typed::<ConstraintTable>, &mut out);
        let loads = read_all(&source, "load", read_typed::<LoadTable>, &mut out);
        let rigid =
            |s: &Source, path: &[&str], out: &mut Vec<Diagnostic>| read_table::<ToolTable>(s, path, &[], out);
        let obstacles = by_name(read_all(&source, "obstacle", rigid, &mut out));
        let tools = by_name(read_all(&source, "tool", rigid, &mut out));
        let contacts = by_name(read_all(
            &source,
            "contact",
            |s, path, out| read_table::<ContactTable>(s, path, &[], out),
            &mut out,
        ));
        let outputs = read_all(&source, "output", read_typed::<OutputTable>, &mut out);
        let view = read_table::<ViewTable>(&source, &["view"], &[], &mut out);
        check_probe_names(&source, &mut out);
        if source.node(&["body"]).is_none_or(|node| node.entries().is_empty()) {
            let help =
                "add a table `[body.NAME]` with `mesh`, `law` and `density`; `pliant new` writes an example";
            out.push(Diagnostic::error("the scene has no body").help(help));
        }
        match (scene, run, view) {
            (Some(scene), Some(run), Some(view)) if !out.iter().any(Diagnostic::is_error) => Ok(Self {
                source,
                folder,
                scene,
                run,
                participants,
                laws,
                bodies,
                ties,
                tied_outside: Vec::new(),
                surfaces,
                constraints,
                loads,
                obstacles,
                tools,
                contacts,
                meets: Vec::new(),
                outputs,
                view,
                doubts: out,
                participant: None,
                is_part: false,
            }),
            _ => Err(source.errors(out)),
        }
    }
}

fn check_top(source: &Source, out: &mut Vec<Diagnostic>) {
    for (key, node) in source.root().entries() {
        if !TABLES.contains(&key.as_str()) {
            let list = TABLES.map(|name| format!("`{name}`")).join(", ");
            let help = match nearest(key, TABLES) {
                Some(name) => format!("did you mean `{name}`? A scene has {list}"),
                None => format!("a scene has {list}"),
            };
            let message = format!("unknown table `{key}`");
            out.push(Diagnostic::error(message).at(node.key_place(), "unknown").help(help));
        }
    }
}

/// Reads `[scene]`, which every scene must have.
fn read_scene_table(source: &Source, out: &mut Vec<Diagnostic>) -> Option<SceneTable> {
    if source.node(&["scene"]).is_none() {
        let help = "add `[scene]` with `until = 1.0`, the simulated time in seconds";
        out.push(Diagnostic::error("the scene has no table `[scene]`").help(help));
        return None;
    }
    read_table::<SceneTable>(source, &["scene"], &[], out)
}

/// Reads all named tables of one kind.
fn read_all<T>(
    source: &Source,
    kind: &str,
    read: impl Fn(&Source, &[&str], &mut Vec<Diagnostic>) -> Option<T>,
    out: &mut Vec<Diagnostic>,
) -> Vec<(String, T)> {
    let Some(tables) = source.node(&[kind]) else { return Vec::new() };
    if !matches!(tables.value, Value::Table(_)) {
        let help = format!("write it as a table: `[{kind}.NAME]`");
        out.push(
            Diagnostic::error(format!("`{kind}` must be a table of tables"))
                .at(tables.place.clone(), "here")
                .help(help),
        );
        return Vec::new();
    }
    let mut found = Vec::new();
    for (name, node) in tables.entries() {
        if !check_name(&format!("`[{kind}.NAME]`"), name, node, out) {
            continue;
        }
        if !matches!(node.value, Value::Table(_)) {
            let help = format!("write it as `[{kind}.{name}]`, or `{kind}.{name} = {{ … }}`");
            let message = format!("`{kind}.{name}` must be a table");
            out.push(Diagnostic::error(message).at(node.place.clone(), "not a table").help(help));
            continue;
        }
        if let Some(table) = read(source, &[kind, name], out) {
            found.push((name.clone(), table));
        }
    }
    found
}

/// Sorts tables by their names, so that the order of bodies and contacts in the file changes no digit.
fn by_name<T>(mut tables: Vec<(String, T)>) -> Vec<(String, T)> {
    tables.sort_by(|(a, _), (b, _)| a.cmp(b));
    tables
}

/// Checks that a name is a plain word, since files and columns are called after names; adds a diagnostic if
/// not.
fn check_name(of: &str, name: &str, node: &Node, out: &mut Vec<Diagnostic>) -> bool {
    let plain = !name.is_empty() && name.chars().all(|c| c.is_alphanumeric() || c == '-' || c == '_');
    if !plain {
        let help = "use letters, digits, `-` and `_`: files and columns carry this name";
        let message = format!("`{name}` cannot be the name of {of}");
        out.push(Diagnostic::error(message).at(node.key_place(), "this name").help(help));
    }
    plain
}

/// Names of probes become names of columns.
fn check_probe_names(source: &Source, out: &mut Vec<Diagnostic>) {
    let outputs = source.node(&["output"]).map_or(&[][..], Node::entries);
    for (_, output) in outputs {
        for (name, probe) in output.get("probes").map_or(&[][..], Node::entries) {
            check_name("a probe", name, probe, out);
        }
    }
}
