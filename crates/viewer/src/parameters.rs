//! The numbers of a scene that can be others while it is played, and the scene with them.

use pliant_format::Scene;
use pliant_format::diagnostic::SceneErrors;
use pliant_format::reference::{Parameter as Described, describe};
use pliant_format::registry::{Section, sections};
use pliant_format::source::{Node, Value};
use pliant_scene::{MeshCache, World};
use serde::{Deserialize, Serialize};

/// A number of a scene.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Number {
    /// Its keys, such as `law`, `liver`, `shear-modulus`; an item of an array has its index.
    pub path: Vec<String>,
    /// Its value.
    pub value: f64,
}

/// A number that can be changed.
#[derive(Clone, Debug, PartialEq)]
pub struct Parameter {
    /// It, as the scene says.
    pub number: Number,
    /// Its unit; empty for none.
    pub unit: String,
    /// Description for the user.
    pub meaning: String,
}

/// Keys whose numbers are of the geometry, or have no meaning once a run has begun.
const FIXED: [&str; 6] = ["nodes", "faces", "fibre", "curve", "from", "to"];
/// Numbers of bodies that can be changed.
const OF_BODIES: [&str; 3] = ["density", "damping", "stiffness-damping"];

/// The numbers of laws, loads and bodies of a scene that can be changed while it is played, in the order of
/// its file.
pub fn parameters(scene: &Scene) -> Vec<Parameter> {
    let sections = sections();
    let mut found = Vec::new();
    for kind in ["law", "load", "body"] {
        let tables = scene.source.node(&[kind]).map_or(&[][..], Node::entries);
        for (name, table) in tables {
            let described = described(&sections, kind, table.get("type").and_then(Node::as_str));
            for (key, value) in table.entries() {
                if FIXED.contains(&key.as_str()) || kind == "body" && !OF_BODIES.contains(&key.as_str()) {
                    continue;
                }
                let path = [kind, name, key].map(str::to_owned).to_vec();
                collect(path, value, described.iter().find(|parameter| parameter.key == *key), &mut found);
            }
        }
    }
    found
}

/// The parameters of a kind of tables.
fn described(sections: &[Section], kind: &str, name: Option<&str>) -> Vec<Described> {
    let header = format!("[{kind}.NAME]");
    let section = sections.iter().find(|section| section.header == header && section.name == name);
    section.map(|section| describe(&section.schema)).unwrap_or_default()
}

/// Collects the numbers in a value, and in arrays and tables within it.
fn collect(path: Vec<String>, node: &Node, described: Option<&Described>, found: &mut Vec<Parameter>) {
    let within = |key: &str| [&path[..], &[key.to_owned()]].concat();
    let value = match &node.value {
        Value::Float(value) => *value,
        Value::Integer(value) => *value as f64,
        Value::Array(items) => {
            for (index, item) in items.iter().enumerate() {
                collect(within(&index.to_string()), item, described, found);
            }
            return;
        }
        Value::Table(entries) => {
            for (key, part) in entries {
                let described =
                    described.and_then(|whole| whole.parts.iter().find(|entry| entry.key == *key));
                collect(within(key), part, described, found);
            }
            return;
        }
        _ => return,
    };
    let (unit, meaning) =
        described.map(|entry| (entry.unit.clone(), entry.description.clone())).unwrap_or_default();
    found.push(Parameter { number: Number { path, value }, unit, meaning });
}

/// Builds the world of a scene with other numbers. The world is also planned anew, which takes a while.
///
/// # Errors
/// If the scene rejects the numbers.
pub fn with_numbers(scene: &Scene, numbers: &[Number]) -> Result<World, String> {
    let mut source = scene.source.clone();
    for Number { path, value } in numbers {
        let path: Vec<&str> = path.iter().map(String::as_str).collect();
        source.set(&path, *value).map_err(|mistake| mistake.message.clone())?;
    }
    let message = |errors: SceneErrors| errors.plain().to_string();
    let scene = Scene::from_source(source, scene.folder.clone()).map_err(message)?;
    World::assemble(&scene, &MeshCache::of_user(), &|_| {}).map_err(message)
}
