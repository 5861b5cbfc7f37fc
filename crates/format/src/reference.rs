//! The reference of a table's parameters, written from the same schema that checks them.

use schemars::Schema;
use serde_json::Value as Json;

use crate::checker::{Form, Forms, Kind, one_line, unit};
use crate::registry::Section;

/// Tables within tables are described down to this depth.
const DEEPEST: usize = 4;

/// Entry of the reference for one parameter.
#[derive(Clone, Debug, PartialEq)]
pub struct Parameter {
    /// Its key in the table.
    pub key: String,
    /// Kind of its value in words: `a number`, `3 numbers`, `one of "cpu", "gpu"`.
    pub kind: String,
    /// Its unit, such as `Pa`; empty without one.
    pub unit: String,
    /// True if the table must have it. If a table must have exactly one of several keys, none counts as
    /// required.
    pub required: bool,
    /// Default value, if there is one.
    pub default: Option<Json>,
    /// The range of a number in words, `greater than 0`; empty without one.
    pub range: String,
    /// Its doc comment, all paragraphs.
    pub description: String,
    /// Name of the definition of its value, or of the items of its value; empty without one.
    pub table: String,
    /// The parameters of the table, or of each of the tables, that its value is.
    pub parts: Vec<Parameter>,
}

/// The page of all tables of a scene, as Markdown. Kinds of values that several tables take, or that contain
/// themselves, have a section of their own at the end.
pub fn page(sections: &[Section]) -> String {
    let mut page = String::from(
        "# Scene reference\n\nWritten by `pliant schema --markdown` from the parameter structs; do not edit.\n\n\
         SI units throughout: m, kg, s, Pa, N. A scene is a TOML file of these tables; NAME is yours to choose.\n",
    );
    let described: Vec<Vec<Parameter>> = sections.iter().map(|section| describe(&section.schema)).collect();
    let shared = shared_tables(&described);
    let names: Vec<&str> = shared.iter().map(|table| table.table.as_str()).collect();
    let mut header = "";
    for (section, parameters) in sections.iter().zip(&described) {
        if section.header != header {
            header = section.header;
            page.push_str(&format!("\n## `{header}`\n"));
        }
        if let Some(name) = section.name {
            page.push_str(&format!("\n### `type = \"{name}\"`\n"));
        }
        if let Some(doc) = section.schema.get("description").and_then(Json::as_str) {
            page.push_str(&format!("\n{doc}\n"));
        }
        page.push_str(&format!("\n{}", table(parameters, &names)));
    }
    for parameter in &shared {
        let doc = definition(sections, &parameter.table);
        page.push_str(&format!("\n## {}\n\n{doc}\n\n{}", parameter.table, table(&parameter.parts, &names)));
    }
    page
}

/// One parameter for each table that several places take, in order of appearance.
fn shared_tables(described: &[Vec<Parameter>]) -> Vec<&Parameter> {
    fn collect<'p>(parameters: &'p [Parameter], found: &mut Vec<(&'p Parameter, usize)>) {
        for parameter in parameters {
            if !parameter.parts.is_empty() && !parameter.table.is_empty() {
                match found.iter_mut().find(|(known, _)| known.table == parameter.table) {
                    Some((_, count)) => *count += 1,
                    None => found.push((parameter, 1)),
                }
            }
            collect(&parameter.parts, found);
        }
    }
    let mut found = Vec::new();
    described.iter().for_each(|parameters| collect(parameters, &mut found));
    found.into_iter().filter(|(_, count)| *count > 1).map(|(parameter, _)| parameter).collect()
}

/// The classes of all tables but `[scene]` for the Python package, one a table.
pub fn python(sections: &[Section]) -> String {
    let mut page = String::from(
        "\"\"\"The tables of scenes as classes, with units, ranges and defaults. SI units throughout.\n\nWritten by `pliant schema --python` from the parameter structs; do not edit.\n\"\"\"\n\n\
         from __future__ import annotations\n\nfrom collections.abc import Mapping, Sequence\nfrom dataclasses import dataclass\n\
         from typing import TYPE_CHECKING, Any, ClassVar\n\nfrom pliant._table import Table\n\nif TYPE_CHECKING:\n    from pliant.mesh import Mesh\n",
    );
    let mut names: Vec<String> = Vec::new();
    for section in sections.iter().filter(|section| section.header != "[scene]") {
        let kind = section.header.trim_matches(['[', ']']).trim_end_matches(".NAME");
        let mut name = camel(section.name.unwrap_or(kind));
        if names.contains(&name) {
            name.push_str(&camel(kind));
        }
        let doc = section.schema.get("description").and_then(Json::as_str).unwrap_or_default();
        page.push_str(&python_class(&name, section, doc, &describe(&section.schema)));
        names.push(name);
    }
    names.push("Table".into());
    names.sort_unstable();
    let lines: Vec<String> = names.iter().map(|name| format!("    \"{name}\",\n")).collect();
    page + &format!("\n\n__all__ = [\n{}]\n", lines.concat())
}

/// `NeoHookean` of `neo-hookean`.
fn camel(name: &str) -> String {
    let parts = name.split(['-', '_']).filter(|part| !part.is_empty());
    parts.map(|part| part[..1].to_uppercase() + &part[1..]).collect()
}

fn python_class(name: &str, section: &Section, doc: &str, parameters: &[Parameter]) -> String {
    let of = |parameter: &Parameter| {
        let key = parameter.key.replace('-', "_");
        if ["as", "from", "is", "in"].contains(&key.as_str()) { key + "_" } else { key }
    };
    let mut page = format!("\n\n@dataclass(frozen=True, kw_only=True)\nclass {name}(Table):\n    \"\"\"");
    let header = match section.name {
        Some(name) => format!("`{}` with ``type = \"{name}\"``.", section.header),
        None => format!("`{}`.", section.header),
    };
    page.push_str(&header);
    if !doc.is_empty() {
        page.push_str(&format!(" {}", one_line(doc)));
    }
    if !parameters.is_empty() {
        page.push_str("\n\n    Parameters\n    ----------\n");
    }
    for parameter in parameters {
        let takes = match (&parameter.kind, &parameter.range) {
            (kind, range) if range.is_empty() => one_line(kind),
            (kind, range) => format!("{}, {range}", one_line(kind)),
        };
        let default = match &parameter.default {
            Some(value) => format!("; {value} if not given"),
            None => String::new(),
        };
        let meaning = one_line(&parameter.description).replace('\\', "\\\\");
        page.push_str(&format!("    {}\n        {meaning} Takes {takes}{default}.\n", of(parameter)));
    }
    page.push_str(if parameters.is_empty() { "\"\"\"\n" } else { "    \"\"\"\n" });
    page.push_str(&format!(
        "\n    _type: ClassVar[str | None] = {}\n",
        section.name.map_or("None".into(), |name| format!("\"{name}\""))
    ));
    let keys: Vec<String> =
        parameters.iter().map(|parameter| format!("\"{}\": \"{}\"", of(parameter), parameter.key)).collect();
    page.push_str(&format!("    _keys: ClassVar[dict[str, str]] = {{{}}}\n", keys.join(", ")));
    if !parameters.is_empty() {
        page.push('\n');
    }
    // Parameters without a default come first, as in any signature.
    for parameter in parameters
        .iter()
        .filter(|parameter| parameter.required)
        .chain(parameters.iter().filter(|parameter| !parameter.required))
    {
        let kind = python_type(parameter);
        page.push_str(&match parameter.required {
            true => format!("    {}: {kind}\n", of(parameter)),
            false => format!("    {}: {kind} | None = None\n", of(parameter)),
        });
    }
    page
}

fn python_type(parameter: &Parameter) -> &'static str {
    match parameter.kind.as_str() {
        _ if parameter.key == "mesh" => "Mesh | Mapping[str, Any]",
        "a number" => "float",
        "a whole number" => "int",
        "a text" => "str",
        "true or false" => "bool",
        "2 numbers" | "3 numbers" => "Sequence[float]",
        "an array of texts" => "Sequence[str]",
        kind if kind.starts_with("one of ") => "str",
        _ => "Any",
    }
}

/// The doc comment of a definition.
fn definition<'s>(sections: &'s [Section], name: &str) -> &'s str {
    let find = |section: &'s Section| section.schema.get("$defs")?.get(name)?.get("description")?.as_str();
    sections.iter().find_map(find).unwrap_or_default()
}

/// Returns the name of the definition of a value, or of the items of an array; empty without one.
fn definition_name(schema: &Json) -> &str {
    if let Some(name) = schema.get("$ref").and_then(Json::as_str) {
        return name.rsplit('/').next().unwrap_or_default();
    }
    let within = ["items", "anyOf", "oneOf"].into_iter().filter_map(|key| schema.get(key));
    let alternatives =
        within.flat_map(|value| value.as_array().map_or(std::slice::from_ref(value), Vec::as_slice));
    alternatives.map(definition_name).find(|name| !name.is_empty()).unwrap_or_default()
}

/// The parameters of a table, in the order of their declaration.
pub fn describe(schema: &Schema) -> Vec<Parameter> {
    let root = schema.as_value();
    let forms = Forms { root };
    describe_forms(forms, &forms.of(root), 0)
}

fn describe_forms(schemas: Forms<'_>, forms: &[Form<'_>], depth: usize) -> Vec<Parameter> {
    let mut parameters: Vec<Parameter> = Vec::new();
    let common = |key: &str| forms.len() > 1 && forms.iter().all(|form| form.property(key).is_some());
    for form in forms {
        // The description of one of several tables goes to the key that only this table has.
        let distinct = form.properties.iter().filter(|(key, _)| !common(key)).count();
        for (key, schema) in &form.properties {
            let of_all = forms.iter().all(|form| form.required.contains(key));
            if parameters.iter().all(|known| known.key != *key) {
                let mut found = parameter(schemas, key, schema, of_all, depth);
                // The form describes the value better than its type does.
                let said = schema.get("description").is_some();
                if let Some(doc) = form.doc.filter(|_| !said && distinct == 1 && !common(key)) {
                    found.description = doc.to_owned();
                    found.unit = unit(Some(doc)).to_owned();
                }
                parameters.push(found);
            }
        }
    }
    parameters
}

fn parameter(schemas: Forms<'_>, key: &str, schema: &Json, required: bool, depth: usize) -> Parameter {
    let doc = schemas.doc(schema);
    let forms = schemas.of(schema);
    let full = schema.get("description").and_then(Json::as_str).or(doc).unwrap_or_default();
    let mut inner = forms.clone();
    // Of an array, or an array of arrays, the tables in it are described.
    for _ in 0..2 {
        let items = inner.iter().filter(|form| form.kind == Some(Kind::Array)).filter_map(|form| form.items);
        let items: Vec<Form<'_>> = items.flat_map(|items| schemas.of(items)).collect();
        inner.retain(|form| form.kind == Some(Kind::Table));
        inner.extend(items);
    }
    let mut parts: Vec<Parameter> = forms.iter().filter_map(word).collect();
    inner.retain(|form| form.kind == Some(Kind::Table));
    if depth < DEEPEST {
        parts.extend(describe_forms(schemas, &inner, depth + 1));
    }
    let ranges = forms.iter().map(Form::range).filter(|range| !range.is_empty());
    Parameter {
        key: key.to_owned(),
        kind: schemas.phrase(&forms, ""),
        unit: unit(doc).to_owned(),
        required,
        default: schema.get("default").filter(|value| !value.is_null()).cloned(),
        range: ranges.collect::<Vec<_>>().join(" or "),
        description: full.to_owned(),
        table: definition_name(schema).to_owned(),
        parts,
    }
}

/// One word of several that a value may be, if it has a description.
fn word(form: &Form<'_>) -> Option<Parameter> {
    let [word] = form.words.as_deref()? else { return None };
    Some(Parameter {
        key: format!("= \"{word}\""),
        kind: String::new(),
        unit: String::new(),
        required: false,
        default: None,
        range: String::new(),
        description: form.doc?.to_owned(),
        table: String::new(),
        parts: Vec::new(),
    })
}

/// A Markdown table of parameters; parameters within a table follow the table's, as `fibre.cell-data`.
pub fn markdown(parameters: &[Parameter]) -> String {
    table(parameters, &[])
}

/// The table with links to the sections of shared tables in the place of their parameters.
fn table(parameters: &[Parameter], shared: &[&str]) -> String {
    let mut page = "| key | takes | unit | default | meaning |\n|---|---|---|---|---|\n".to_owned();
    rows(parameters, "", shared, &mut page);
    page
}

fn rows(parameters: &[Parameter], within: &str, shared: &[&str], page: &mut String) {
    for parameter in parameters {
        let cell = |text: &str| one_line(text).replace('|', "\\|");
        let path = match parameter.key.strip_prefix("= ") {
            Some(word) if within.is_empty() => word.to_owned(),
            Some(_) => format!("{} {}", within.trim_end_matches('.'), parameter.key),
            None => format!("{within}{}", parameter.key),
        };
        let range = if parameter.range.is_empty() { String::new() } else { format!(", {}", parameter.range) };
        let default = match &parameter.default {
            Some(value) => format!("`{}`", cell(&value.to_string())),
            None if parameter.required => "required".to_owned(),
            None => String::new(),
        };
        let elsewhere = shared.contains(&parameter.table.as_str());
        let takes = match parameter.table.as_str() {
            name if elsewhere => format!("[{name}](#{})", name.to_lowercase()),
            _ => cell(&parameter.kind) + &range,
        };
        let meaning = cell(&parameter.description);
        page.push_str(&format!(
            "| `{path}` | {takes} | {} | {default} | {meaning} |\n",
            cell(&parameter.unit)
        ));
        if !elsewhere {
            rows(&parameter.parts, &format!("{path}."), shared, page);
        }
    }
}

#[cfg(test)]
mod tests {
    use schemars::{JsonSchema, schema_for};
    use serde::{Deserialize, Serialize};

    use super::*;

    /// A law.
    #[derive(Deserialize, JsonSchema)]
    #[serde(rename_all = "kebab-case")]
    #[allow(dead_code)]
    struct Law {
        /// Shear modulus [Pa].
        ///
        /// Of the matrix.
        #[schemars(extend("exclusiveMinimum" = 0.0))]
        shear_modulus: f64,
        /// Poisson's ratio.
        #[serde(default = "poisson")]
        #[schemars(range(min = 0.0, max = 0.5))]
        poisson_ratio: f64,
        /// Gravity [m/s²].
        gravity: Option<[f64; 3]>,
        /// Relaxation.
        prony: Vec<Term>,
        /// Device of the run.
        #[serde(default)]
        device: Device,
    }

    fn poisson() -> f64 {
        0.45
    }

    #[derive(Deserialize, JsonSchema)]
    #[allow(dead_code)]
    struct Term {
        /// Time constant [s].
        time: f64,
        /// Terms within.
        within: Vec<Term>,
    }

    #[derive(Default, Deserialize, Serialize, JsonSchema)]
    #[serde(rename_all = "kebab-case")]
    #[allow(dead_code)]
    enum Device {
        #[default]
        Cpu,
        Gpu,
        Auto,
    }

    #[test]
    fn parameters_are_described_in_the_order_of_their_declaration() {
        let law = describe(&schema_for!(Law));
        let keys: Vec<&str> = law.iter().map(|parameter| parameter.key.as_str()).collect();
        assert_eq!(keys, ["shear-modulus", "poisson-ratio", "gravity", "prony", "device"]);
        assert_eq!(
            law[0],
            Parameter {
                key: "shear-modulus".into(),
                kind: "a number".into(),
                unit: "Pa".into(),
                required: true,
                default: None,
                range: "greater than 0".into(),
                description: "Shear modulus [Pa].\n\nOf the matrix.".into(),
                table: String::new(),
                parts: vec![],
            }
        );
        assert_eq!((law[1].required, &law[1].default), (false, &Some(Json::from(0.45))));
        assert_eq!(law[1].range, "at least 0 and at most 0.5");
        assert_eq!((law[2].kind.as_str(), law[2].unit.as_str()), ("3 numbers", "m/s²"));
        assert_eq!(law[3].kind, "an array of tables");
        assert_eq!(law[3].parts[0].unit, "s");
        assert_eq!(law[4].kind, "one of \"cpu\", \"gpu\", \"auto\"");
        assert_eq!(law[4].default, Some(Json::from("cpu")));
    }

    #[test]
    fn the_markdown_has_one_row_a_parameter() {
        let page = markdown(&describe(&schema_for!(Law)));
        let rows: Vec<&str> = page.lines().collect();
        assert_eq!(
            rows[2],
            "| `shear-modulus` | a number, greater than 0 | Pa | required | Shear modulus [Pa]. Of the matrix. |"
        );
        assert_eq!(
            rows[3],
            "| `poisson-ratio` | a number, at least 0 and at most 0.5 |  | `0.45` | Poisson's ratio. |"
        );
        assert_eq!(rows[6], "| `prony.time` | a number | s | required | Time constant [s]. |");
    }
}
