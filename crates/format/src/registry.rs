//! The one place where a `type` of a scene file meets a parameter struct. Laws have their own registry in
//! `pliant_mechanics::law`.

use std::collections::BTreeMap;

use pliant_mechanics::law::AnyLaw;
use schemars::{JsonSchema, Schema, schema_for};
use serde::de::DeserializeOwned;
use serde_json::{Map, Value as Json, json};

use crate::checker::{check_skipping, read_table};
use crate::diagnostic::Diagnostic;
use crate::nearest::nearest;
use crate::source::{Source, Value};
use crate::tables::{
    BodyTable, ContactTable, CsvTable, EdgeLoadTable, FixTable, ForceTable, GravityTable, LawExtras,
    MeanTable, MomentTable, MoveTable, ParticipantTable, PressureTable, RigidTable, RunTable, SceneTable,
    SpringTable, SurfaceTable, TieTable, Timing, ToolTable, TractionTable, ViewTable, VolumeTable, VtuTable,
};

/// A kind of table whose parameters depend on its `type`.
pub(crate) trait Typed: Sized {
    /// The words for `type`.
    const NAMES: &'static [&'static str];
    /// Word for the table in messages: `constraint`, `load`, `output`.
    const WHAT: &'static str;

    /// The schema of a type's parameters.
    fn schema(name: &str) -> Option<Schema>;

    /// Reads the table at a path as the type of that name.
    fn read_as(name: &str, source: &Source, path: &[&str], out: &mut Vec<Diagnostic>) -> Option<Self>;
}

macro_rules! typed {
    ($(#[$doc:meta])* $enum:ident, $what:literal: $($name:literal => $variant:ident($table:ty),)*) => {
        $(#[$doc])*
        #[derive(Clone, Debug)]
        pub enum $enum {
            $(#[doc = concat!("`", $name, "`")] $variant($table),)*
        }

        impl Typed for $enum {
            const NAMES: &'static [&'static str] = &[$($name),*];
            const WHAT: &'static str = $what;

            fn schema(name: &str) -> Option<Schema> {
                match name {
                    $($name => Some(schema_for!($table)),)*
                    _ => None,
                }
            }

            fn read_as(name: &str, source: &Source, path: &[&str], out: &mut Vec<Diagnostic>) -> Option<Self> {
                match name {
                    $($name => read_table::<$table>(source, path, &["type"], out).map(Self::$variant),)*
                    _ => None,
                }
            }
        }
    };
}

typed! {
    /// A table `[constraint.NAME]`.
    ConstraintTable, "constraint":
    "fix" => Fix(FixTable),
    "move" => Move(MoveTable),
    "spring" => Spring(SpringTable),
    "mean" => Mean(MeanTable),
    "rigid" => Rigid(RigidTable),
    "volume" => Volume(VolumeTable),
}

typed! {
    /// A table `[load.NAME]`.
    LoadTable, "load":
    "force" => Force(ForceTable),
    "moment" => Moment(MomentTable),
    "edge" => Edge(EdgeLoadTable),
    "traction" => Traction(TractionTable),
    "pressure" => Pressure(PressureTable),
    "gravity" => Gravity(GravityTable),
}

typed! {
    /// A table `[output.NAME]`.
    OutputTable, "output":
    "vtu" => Vtu(VtuTable),
    "csv" => Csv(CsvTable),
}

/// The word of a table's `type`, if it is known; else a diagnostic.
fn type_of<'s>(
    source: &'s Source,
    path: &[&str],
    what: &str,
    known: &[&str],
    out: &mut Vec<Diagnostic>,
) -> Option<&'s str> {
    let at = [path, &["type"]].concat();
    let list = known.iter().map(|name| format!("`{name}`")).collect::<Vec<_>>().join(", ");
    let Some(node) = source.node(&at) else {
        let message = format!("`{}` has no `type`", path.join("."));
        let help = format!("add `type = \"…\"` with one of {list}");
        out.push(Diagnostic::error(message).at(source.key_span(path), "`type` is missing").help(help));
        return None;
    };
    let Value::String(word) = &node.value else {
        let message = format!("the `type` of `{}` must be a text", path.join("."));
        out.push(
            Diagnostic::error(message).at(node.place.clone(), "not a text").help(format!("one of {list}")),
        );
        return None;
    };
    if known.contains(&word.as_str()) {
        return Some(word);
    }
    let help = match nearest(word, known.iter().copied()) {
        Some(name) => format!("did you mean `{name}`? Known types: {list}"),
        None => format!("known types: {list}"),
    };
    let message = format!("there is no {what} of type `{word}`");
    out.push(Diagnostic::error(message).at(node.place.clone(), "unknown type").help(help));
    None
}

/// Reads a table whose parameters depend on its `type`.
pub(crate) fn read_typed<T: Typed>(source: &Source, path: &[&str], out: &mut Vec<Diagnostic>) -> Option<T> {
    let name = type_of(source, path, T::WHAT, T::NAMES, out)?;
    T::read_as(name, source, path, out)
}

/// A law as the scene gives it.
#[derive(Clone, Debug)]
pub struct LawTable {
    /// The elastic law.
    pub law: AnyLaw,
    /// Fibres and relaxation.
    pub extras: LawExtras,
}

/// Reads a table `[law.NAME]`.
pub(crate) fn read_law(source: &Source, path: &[&str], out: &mut Vec<Diagnostic>) -> Option<LawTable> {
    let name = type_of(source, path, "law", AnyLaw::NAMES, out)?;
    let schema = AnyLaw::schema(name)?;
    let before = out.len();
    let written = check_skipping(source.node(path)?, &path.join("."), &law_schema(&schema), &["type"], out);
    if out[before..].iter().any(Diagnostic::is_error) {
        return None;
    }
    let (parameters, extras) = divide(written, &schema);
    let law = AnyLaw::from_json(name, parameters).map_err(|error| {
        let place = source.span(&[path, &[error.key]].concat());
        out.push(Diagnostic::error(error.message).at(place, "here").help(error.help));
    });
    let extras = serde_json::from_value(extras).map_err(|error| {
        out.push(Diagnostic::error(error.to_string()).at(source.span(path), "in this table"));
    });
    Some(LawTable { law: law.ok()?, extras: extras.ok()? })
}

/// The keys of a law's own parameters, and the rest.
fn divide(table: Json, schema: &Schema) -> (Json, Json) {
    let Json::Object(entries) = table else { return (table, json!({})) };
    let known = |key: &str| schema.get("properties").and_then(|p| p.get(key)).is_some();
    let (parameters, rest): (Map<_, _>, Map<_, _>) = entries.into_iter().partition(|(key, _)| known(key));
    (Json::Object(parameters), Json::Object(rest))
}

/// The parameters of a law together with what every law can have.
fn law_schema(schema: &Schema) -> Schema {
    let mut merged = schema.clone();
    let extras = schema_for!(LawExtras);
    for part in ["properties", "$defs"] {
        let Some(Json::Object(added)) = extras.get(part) else { continue };
        let target = merged.ensure_object().entry(part).or_insert_with(|| json!({}));
        if let Json::Object(target) = target {
            target.extend(added.clone());
        }
    }
    merged
}

/// One kind of table, for the schema and the reference page.
#[derive(Clone, Debug)]
pub struct Section {
    /// The header in a scene file: `[scene]`, `[law.NAME]`.
    pub header: &'static str,
    /// The `type` it is for, if it has one.
    pub name: Option<&'static str>,
    /// Its parameters.
    pub schema: Schema,
}

fn plain<T: JsonSchema + DeserializeOwned>(header: &'static str) -> Section {
    Section { header, name: None, schema: schema_for!(T) }
}

fn typed<T: Typed>(header: &'static str) -> impl Iterator<Item = Section> {
    T::NAMES
        .iter()
        .filter_map(move |name| Some(Section { header, name: Some(name), schema: T::schema(name)? }))
}

/// Every kind of table a scene can have, in the order of the reference page.
pub fn sections() -> Vec<Section> {
    let law = |name: &&'static str| {
        Some(Section { header: "[law.NAME]", name: Some(name), schema: law_schema(&AnyLaw::schema(name)?) })
    };
    let mut sections = vec![
        plain::<SceneTable>("[scene]"),
        plain::<RunTable>("[run]"),
        plain::<ParticipantTable>("[participant.NAME]"),
    ];
    sections.extend(AnyLaw::NAMES.iter().filter_map(law));
    sections.push(plain::<BodyTable>("[body.NAME]"));
    sections.extend([plain::<TieTable>("[tie.NAME]"), plain::<SurfaceTable>("[surface.NAME]")]);
    sections.extend(typed::<ConstraintTable>("[constraint.NAME]"));
    sections.extend(typed::<LoadTable>("[load.NAME]"));
    sections.extend([plain::<ToolTable>("[obstacle.NAME]"), plain::<ToolTable>("[tool.NAME]")]);
    sections.push(plain::<ContactTable>("[contact.NAME]"));
    sections.extend(typed::<OutputTable>("[output.NAME]"));
    sections.push(plain::<ViewTable>("[view]"));
    sections
}

/// The JSON schema of a whole scene file.
pub fn scene_schema() -> Json {
    let mut definitions = Map::new();
    let mut kinds: BTreeMap<&str, Vec<Json>> = BTreeMap::new();
    for Section { header, name, schema } in sections() {
        let mut schema = schema.to_value();
        if let Some(object) = schema.as_object_mut() {
            object.remove("$schema");
            if let Some(Json::Object(local)) = object.remove("$defs") {
                definitions.extend(local);
            }
            if let (Some(name), Some(Json::Object(properties))) = (name, object.get_mut("properties")) {
                properties.insert("type".into(), json!({ "const": name }));
            }
            if let Some(name) = name {
                let required = object.entry("required").or_insert_with(|| json!([]));
                if let Json::Array(required) = required {
                    required.push(json!("type"));
                }
                object.insert("title".into(), json!(format!("{header} of type {name}")));
            }
            // A struct with flattened parts cannot deny unknown keys; the checker does, and so does this
            // schema.
            object.insert("additionalProperties".into(), json!(false));
        }
        kinds.entry(header.trim_matches(['[', ']'])).or_default().push(schema);
    }
    let mut properties = Map::new();
    for (header, mut schemas) in kinds {
        let one = if schemas.len() == 1 { schemas.remove(0) } else { json!({ "oneOf": schemas }) };
        let (key, schema) = match header.strip_suffix(".NAME") {
            Some(key) => (key, json!({ "type": "object", "additionalProperties": one })),
            None => (header, one),
        };
        properties.insert(key.into(), schema);
    }
    json!({
        "$schema": "https://json-schema.org/draft/2020-12/schema",
        "title": "Pliant scene",
        "type": "object",
        "properties": properties,
        "required": ["scene", "body"],
        "additionalProperties": false,
        "$defs": definitions,
    })
}

impl LoadTable {
    /// Its curve over time.
    pub fn timing(&self) -> &Timing {
        match self {
            Self::Force(load) => &load.timing,
            Self::Moment(load) => &load.timing,
            Self::Edge(load) => &load.timing,
            Self::Traction(load) => &load.timing,
            Self::Pressure(load) => &load.timing,
            Self::Gravity(load) => &load.timing,
        }
    }

    /// Body or surface on which it acts; `None`: everything.
    pub fn on(&self) -> Option<&str> {
        Some(match self {
            Self::Force(load) => &load.on,
            Self::Moment(load) => &load.on,
            Self::Edge(load) => &load.on,
            Self::Traction(load) => &load.on,
            Self::Pressure(load) => &load.on,
            Self::Gravity(load) => return load.on.as_deref(),
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::checker::check;
    use crate::reference::describe;
    use crate::source::Node;

    #[test]
    fn every_parameter_of_every_table_has_a_meaning() {
        let sections = sections();
        let typed = AnyLaw::NAMES.len()
            + ConstraintTable::NAMES.len()
            + LoadTable::NAMES.len()
            + OutputTable::NAMES.len();
        let untyped = sections.iter().filter(|section| section.name.is_none()).count();
        assert_eq!(sections.len(), typed + untyped);
        for Section { header, name, schema } in sections {
            for parameter in describe(&schema) {
                assert!(!parameter.description.is_empty(), "{header} {name:?}: {}", parameter.key);
            }
        }
    }

    #[test]
    fn every_name_leads_to_a_schema() {
        fn assert_schemas<T: Typed>() {
            assert!(T::NAMES.iter().all(|name| T::schema(name).is_some()), "{}", T::WHAT);
            assert!(T::schema("nonsense").is_none());
        }
        assert_schemas::<ConstraintTable>();
        assert_schemas::<LoadTable>();
        assert_schemas::<OutputTable>();
    }

    /// Lines of TOML between backticks in the descriptions of a schema: their number, and the lines that the
    /// checker refuses.
    fn lines_refused(scene: &Json) -> (usize, Vec<String>) {
        /// Visits each schema, with the chain of the schemas around it, the innermost first.
        fn visit<'s>(schema: &'s Json, around: &[&'s Json], seen: &mut dyn FnMut(&[&'s Json])) {
            let chain: Vec<&Json> = std::iter::once(schema).chain(around.iter().copied()).collect();
            match schema {
                Json::Object(parts) => {
                    seen(&chain);
                    parts.values().for_each(|part| visit(part, &chain, seen));
                }
                Json::Array(parts) => parts.iter().for_each(|part| visit(part, &chain, seen)),
                _ => {}
            }
        }
        const TELLING: [&str; 6] = ["type", "$ref", "oneOf", "anyOf", "enum", "const"];
        let takes = |schema: &Json, node: &Node| {
            let Json::Object(object) = schema else { return false };
            // A table of schemas is not a schema itself.
            if !TELLING.iter().any(|key| object.get(*key).is_some_and(|value| !value.is_object())) {
                return false;
            }
            let mut object = object.clone();
            object.insert("$defs".into(), scene["$defs"].clone());
            let mut errors = Vec::new();
            check(node, "", &Schema::from(object), &mut errors);
            !errors.iter().any(Diagnostic::is_error)
        };
        let mut keys: BTreeMap<&str, Vec<&Json>> = BTreeMap::new();
        visit(scene, &[], &mut |chain| {
            let properties = chain[0].get("properties").and_then(Json::as_object);
            properties
                .into_iter()
                .flatten()
                .for_each(|(key, schema)| keys.entry(key).or_default().push(schema));
        });
        let (mut tried, mut refused) = (0, Vec::new());
        visit(scene, &[], &mut |chain| {
            let Some(doc) = chain[0].get("description").and_then(Json::as_str) else { return };
            for line in doc.split('`').skip(1).step_by(2).filter(|line| !line.contains('…')) {
                let is_value = line.starts_with(['{', '[']);
                let is_table = line.starts_with('[') && line.ends_with(']') && !line.contains([' ', ',']);
                if is_table || !is_value && !line.contains(" = ") {
                    continue;
                }
                tried += 1;
                let text = if is_value { format!("value = {line}") } else { line.to_owned() };
                let is_taken = Source::parse("reference", text).is_ok_and(|source| {
                    source.root().entries().iter().all(|(key, node)| match is_value {
                        true => chain.iter().any(|schema| takes(schema, node)),
                        false => keys
                            .get(key.as_str())
                            .is_some_and(|schemas| schemas.iter().any(|schema| takes(schema, node))),
                    })
                });
                if !is_taken {
                    refused.push(line.to_owned());
                }
            }
        });
        (tried, refused)
    }

    #[test]
    fn every_line_of_the_reference_is_taken() {
        let (tried, refused) = lines_refused(&scene_schema());
        assert!(refused.is_empty(), "{refused:#?}");
        assert!(tried > 40, "{tried}");
        let wrong = json!({ "properties": { "angle": {
            "type": "number",
            "description": "As in `angle = 2`, `angle = \"2\"`, `turn = 2`, `{ angle = }`, `[2, 3]`."
        } } });
        let (tried, refused) = lines_refused(&wrong);
        assert_eq!((tried, refused.len()), (5, 4), "{refused:#?}");
    }

    #[test]
    fn the_schema_of_a_scene_takes_no_unknown_keys() {
        let schema = scene_schema();
        let properties = schema["properties"].as_object().unwrap();
        let tables: Vec<&str> = properties.keys().map(String::as_str).collect();
        let expected = [
            "body",
            "constraint",
            "contact",
            "law",
            "load",
            "obstacle",
            "output",
            "participant",
            "run",
            "scene",
            "surface",
            "tie",
            "tool",
            "view",
        ];
        assert_eq!(tables, expected);
        for (table, schema) in properties {
            let named = schema.get("additionalProperties").filter(|inner| inner.is_object());
            let one = named.unwrap_or(schema);
            let kinds =
                one.get("oneOf").and_then(Json::as_array).cloned().unwrap_or_else(|| vec![one.clone()]);
            assert!(kinds.iter().all(|kind| kind["additionalProperties"] == false), "{table}");
        }
    }

    #[test]
    fn a_law_is_read_with_its_own_parameters_and_what_every_law_can_have() {
        let text = "[law.a]\ntype = 'neo-hookean'\nshear-modulus = 1\nbulk-modulus = 2\nfibre = [0, 0, 1]\n\
                    prony = [{ part = 'volumetric', weight = 0.2, time = 3 }]\n";
        let source = Source::parse("law.toml", text).unwrap();
        let mut out = Vec::new();
        let law = read_law(&source, &["law", "a"], &mut out).unwrap();
        assert!(out.is_empty());
        assert_eq!((law.law.name(), law.law.small_strain().bulk), ("neo-hookean", 2.0));
        assert_eq!((law.extras.prony.len(), law.extras.fibre.is_some()), (1, true));
    }
}
