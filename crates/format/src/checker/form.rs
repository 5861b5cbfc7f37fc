//! The forms of a value in a JSON schema, with references and alternatives resolved, and their names in
//! words.

use serde_json::{Map, Value as Json};

use super::words::{alternatives, number};
use crate::source::Value;

/// Largest depth of references between schemas; deeper schemas refer to themselves.
const DEEPEST_REFERENCE: usize = 32;

/// The kinds of JSON values.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Kind {
    Null,
    Boolean,
    Integer,
    Number,
    Text,
    Array,
    Table,
}

impl Kind {
    fn named(name: &str) -> Option<Self> {
        Some(match name {
            "null" => Kind::Null,
            "boolean" => Kind::Boolean,
            "integer" => Kind::Integer,
            "number" => Kind::Number,
            "string" => Kind::Text,
            "array" => Kind::Array,
            "object" => Kind::Table,
            _ => return None,
        })
    }
}

/// A bound of a number.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Bound {
    pub(crate) value: f64,
    pub(crate) exclusive: bool,
}

/// One form that a value may take: a schema with its references and alternatives resolved, so that it is of
/// one kind.
#[derive(Clone, Debug, Default)]
pub(crate) struct Form<'s> {
    /// None for a form that takes any value.
    pub(crate) kind: Option<Kind>,
    /// The kinds while the schema is being resolved.
    kinds: Option<Vec<Kind>>,
    /// The words a text is restricted to.
    pub(crate) words: Option<Vec<&'s str>>,
    pub(crate) properties: Vec<(&'s str, &'s Json)>,
    pub(crate) required: Vec<&'s str>,
    /// Schema of the further keys of a table.
    pub(crate) additional: Option<&'s Json>,
    pub(crate) items: Option<&'s Json>,
    pub(crate) prefix: Vec<&'s Json>,
    /// Least and most items of an array.
    pub(crate) items_range: (Option<u64>, Option<u64>),
    /// Least and most characters of a text.
    pub(super) letters_range: (Option<u64>, Option<u64>),
    pub(crate) lower: Option<Bound>,
    pub(crate) upper: Option<Bound>,
    /// The description of this form, such as one word of several or one key of which a table has exactly one.
    pub(crate) doc: Option<&'s str>,
}

impl<'s> Form<'s> {
    /// Adds a schema's own properties, without its references and alternatives.
    fn absorb(&mut self, schema: &'s Map<String, Json>) {
        self.doc = schema.get("description").and_then(Json::as_str).or(self.doc);
        let types = match schema.get("type") {
            Some(Json::String(one)) => Some(Kind::named(one).into_iter().collect::<Vec<_>>()),
            Some(Json::Array(many)) => {
                Some(many.iter().filter_map(Json::as_str).filter_map(Kind::named).collect())
            }
            _ if schema.contains_key("properties") => Some(vec![Kind::Table]),
            _ if schema.contains_key("const") || schema.contains_key("enum") => Some(vec![Kind::Text]),
            _ => None,
        };
        if let Some(mut types) = types {
            if let Some(known) = &self.kinds {
                types.retain(|kind| known.contains(kind));
            }
            self.kinds = Some(types);
        }
        let word = schema.get("const").and_then(Json::as_str).map(|word| vec![word]);
        let words = schema.get("enum").and_then(Json::as_array);
        if let Some(words) = word.or_else(|| words.map(|w| w.iter().filter_map(Json::as_str).collect())) {
            self.words = Some(words);
        }
        for (key, property) in schema.get("properties").and_then(Json::as_object).into_iter().flatten() {
            if self.property(key).is_none() {
                self.properties.push((key, property));
            }
        }
        for key in
            schema.get("required").and_then(Json::as_array).into_iter().flatten().filter_map(Json::as_str)
        {
            if !self.required.contains(&key) {
                self.required.push(key);
            }
        }
        let array = |key: &str| schema.get(key).and_then(Json::as_array).into_iter().flatten();
        let length = |key: &str| schema.get(key).and_then(Json::as_u64);
        self.additional = schema.get("additionalProperties").or(self.additional);
        self.items = schema.get("items").or(self.items);
        self.prefix.extend(array("prefixItems"));
        self.items_range =
            (length("minItems").or(self.items_range.0), length("maxItems").or(self.items_range.1));
        self.letters_range =
            (length("minLength").or(self.letters_range.0), length("maxLength").or(self.letters_range.1));
        self.absorb_range(schema);
    }

    fn absorb_range(&mut self, schema: &Map<String, Json>) {
        let bound = |key: &str, exclusive| {
            schema.get(key).and_then(Json::as_f64).map(|value| Bound { value, exclusive })
        };
        let (least, most) = match schema.get("format").and_then(Json::as_str) {
            Some("int8") => (Some(i8::MIN as f64), Some(i8::MAX as f64)),
            Some("int16") => (Some(i16::MIN as f64), Some(i16::MAX as f64)),
            Some("int32") => (Some(i32::MIN as f64), Some(i32::MAX as f64)),
            Some("uint8") => (Some(0.0), Some(u8::MAX as f64)),
            Some("uint16") => (Some(0.0), Some(u16::MAX as f64)),
            Some("uint32") => (Some(0.0), Some(u32::MAX as f64)),
            Some("uint64" | "uint" | "uint128") => (Some(0.0), None),
            Some("float") => (Some(f32::MIN as f64), Some(f32::MAX as f64)),
            _ => (None, None),
        };
        let closed = |value| Bound { value, exclusive: false };
        for lower in [least.map(closed), bound("minimum", false), bound("exclusiveMinimum", true)]
            .into_iter()
            .flatten()
        {
            if self.lower.is_none_or(|known| {
                lower.value > known.value || (lower.value == known.value && lower.exclusive)
            }) {
                self.lower = Some(lower);
            }
        }
        for upper in
            [most.map(closed), bound("maximum", false), bound("exclusiveMaximum", true)].into_iter().flatten()
        {
            if self.upper.is_none_or(|known| {
                upper.value < known.value || (upper.value == known.value && upper.exclusive)
            }) {
                self.upper = Some(upper);
            }
        }
    }

    pub(crate) fn property(&self, key: &str) -> Option<&'s Json> {
        self.properties.iter().find(|(name, _)| *name == key).map(|(_, schema)| *schema)
    }

    /// True if the value is of this form's kind.
    pub(super) fn fits(&self, value: &Value) -> bool {
        match self.kind {
            None => true,
            Some(Kind::Null) => false,
            Some(Kind::Boolean) => matches!(value, Value::Boolean(_)),
            Some(Kind::Integer) => matches!(value, Value::Integer(_)),
            Some(Kind::Number) => matches!(value, Value::Integer(_) | Value::Float(_)),
            Some(Kind::Text) => matches!(value, Value::String(_)),
            Some(Kind::Array) => matches!(value, Value::Array(_)),
            Some(Kind::Table) => matches!(value, Value::Table(_)),
        }
    }

    /// The word that a property must be, if it distinguishes alternatives.
    pub(super) fn tag(&self, key: &str) -> Option<&'s str> {
        self.property(key)?.get("const")?.as_str()
    }

    /// The range of a number in words, "greater than 0 and at most 0.5"; empty without a range.
    pub(crate) fn range(&self) -> String {
        let of_type = |bound: &Bound| {
            [f32::MAX as f64, u32::MAX as f64, i32::MAX as f64, -(i32::MIN as f64)]
                .contains(&bound.value.abs())
        };
        let lower = self.lower.as_ref().filter(|bound| !of_type(bound)).map(Bound::lower);
        let upper = self.upper.as_ref().filter(|bound| !of_type(bound)).map(Bound::upper);
        lower.into_iter().chain(upper).collect::<Vec<_>>().join(" and ")
    }
}

impl Bound {
    pub(super) fn lower(&self) -> String {
        format!("{} {}", if self.exclusive { "greater than" } else { "at least" }, number(self.value))
    }

    pub(super) fn upper(&self) -> String {
        format!("{} {}", if self.exclusive { "less than" } else { "at most" }, number(self.value))
    }
}

/// Resolves the schemas of one root schema.
#[derive(Clone, Copy)]
pub(crate) struct Forms<'s> {
    pub(crate) root: &'s Json,
}

impl<'s> Forms<'s> {
    /// The forms that a value of this schema may take; "no value", which TOML cannot say, is left out.
    pub(crate) fn of(self, schema: &'s Json) -> Vec<Form<'s>> {
        let mut forms = Vec::new();
        for form in self.resolve(schema, Form::default(), 0) {
            match &form.kinds {
                None => forms.push(form),
                Some(kinds) => {
                    let kinds = kinds.iter().filter(|kind| **kind != Kind::Null);
                    forms.extend(kinds.map(|kind| Form { kind: Some(*kind), ..form.clone() }));
                }
            }
        }
        forms
    }

    fn resolve(self, schema: &'s Json, mut form: Form<'s>, depth: usize) -> Vec<Form<'s>> {
        let map = match schema {
            Json::Object(map) => map,
            Json::Bool(false) => return Vec::new(),
            _ => return vec![form],
        };
        if depth > DEEPEST_REFERENCE {
            return Vec::new();
        }
        form.absorb(map);
        let mut forms = vec![form];
        let parts = map.get("allOf").and_then(Json::as_array).into_iter().flatten();
        for part in self.target(map).into_iter().chain(parts) {
            forms = forms.into_iter().flat_map(|form| self.resolve(part, form, depth + 1)).collect();
        }
        for key in ["anyOf", "oneOf"] {
            if let Some(branches) = map.get(key).and_then(Json::as_array) {
                let each = |form: Form<'s>| {
                    branches.iter().flat_map(move |branch| self.resolve(branch, form.clone(), depth + 1))
                };
                forms = forms.into_iter().flat_map(each).collect();
            }
        }
        forms
    }

    fn target(self, schema: &Map<String, Json>) -> Option<&'s Json> {
        self.root.pointer(schema.get("$ref")?.as_str()?.strip_prefix('#')?)
    }

    /// The first paragraph of a schema's description, or of the schema to which it refers.
    pub(crate) fn doc(self, schema: &'s Json) -> Option<&'s str> {
        let first_paragraph = |schema: &'s Json| schema.get("description")?.as_str()?.split("\n\n").next();
        first_paragraph(schema).or_else(|| {
            let map = schema.as_object()?;
            let branch = map.get("anyOf").and_then(Json::as_array).and_then(|branches| branches.first());
            let optional = branch.and_then(Json::as_object).filter(|branch| branch.contains_key("$ref"));
            self.target(map).or_else(|| self.target(optional?)).and_then(first_paragraph)
        })
    }

    /// The forms in words, such as `"auto" or a number [s]`.
    pub(crate) fn phrase(self, forms: &[Form<'s>], unit: &str) -> String {
        self.phrase_at(forms, unit, false, 0)
    }

    fn phrase_at(self, forms: &[Form<'s>], unit: &str, plural: bool, depth: usize) -> String {
        let mut parts: Vec<String> = Vec::new();
        let words: Vec<String> = forms
            .iter()
            .filter_map(|form| form.words.as_ref())
            .flatten()
            .map(|word| format!("\"{word}\""))
            .collect();
        let quoted = if plural {
            format!("texts ({})", alternatives(&words))
        } else if words.len() > 2 && forms.iter().all(|form| form.words.is_some()) {
            format!("one of {}", words.join(", "))
        } else {
            alternatives(&words)
        };
        for form in forms {
            let part = match form.kind {
                Some(Kind::Text) if form.words.is_some() => quoted.clone(),
                _ => self.phrase_of(form, unit, plural, depth),
            };
            if !parts.contains(&part) {
                parts.push(part);
            }
        }
        alternatives(&parts)
    }

    fn phrase_of(self, form: &Form<'s>, unit: &str, plural: bool, depth: usize) -> String {
        let choose = |one: &str, many: &str| (if plural { many } else { one }).to_owned();
        let in_unit = if unit.is_empty() { String::new() } else { format!(" [{unit}]") };
        match form.kind {
            None => choose("any value", "values"),
            Some(Kind::Null) => "nothing".to_owned(),
            Some(Kind::Boolean) => choose("true or false", "true or false values"),
            Some(Kind::Integer) => choose("a whole number", "whole numbers") + &in_unit,
            Some(Kind::Number) => choose("a number", "numbers") + &in_unit,
            Some(Kind::Text) => choose("a text", "texts"),
            Some(Kind::Array) => self.phrase_of_array(form, unit, plural, depth),
            Some(Kind::Table) if plural || depth > 2 => choose("a table", "tables"),
            Some(Kind::Table) => self.phrase_of_table(form, depth),
        }
    }

    fn phrase_of_array(self, form: &Form<'s>, unit: &str, plural: bool, depth: usize) -> String {
        let many = |schema| {
            if depth > 3 {
                "values".to_owned()
            } else {
                self.phrase_at(&self.of(schema), unit, true, depth + 1)
            }
        };
        let mut kinds: Vec<String> = form.prefix.iter().map(|schema| many(schema)).collect();
        let count = match (form.prefix.len() as u64, form.items_range) {
            (0, (Some(least), Some(most))) if least == most => Some(least),
            (0, _) => None,
            (n, _) => Some(n),
        };
        kinds.extend(form.items.filter(|_| kinds.is_empty()).map(many));
        kinds.dedup();
        let items = match kinds.as_slice() {
            [one] => one.clone(),
            _ => "values".to_owned(),
        };
        match (count, plural, form.items_range) {
            (Some(1), false, _) if items == "values" => "an array of 1 value".to_owned(),
            (Some(n), false, _) => format!("{n} {items}"),
            (Some(n), true, _) => format!("arrays of {n} {items}"),
            (None, true, _) => format!("arrays of {items}"),
            (None, false, (Some(least), Some(most))) => format!("an array of {least} to {most} {items}"),
            (None, false, (Some(least), None)) if least > 0 => format!("an array of {least} or more {items}"),
            (None, false, (None, Some(most))) => format!("an array of at most {most} {items}"),
            (None, false, _) => format!("an array of {items}"),
        }
    }

    fn phrase_of_table(self, form: &Form<'s>, depth: usize) -> String {
        match form.additional {
            Some(schema @ Json::Object(_)) if form.properties.is_empty() => {
                format!("a table of {}", self.phrase_at(&self.of(schema), "", true, depth + 1))
            }
            _ if (1..=3).contains(&form.required.len()) => {
                let keys: Vec<String> = form.required.iter().map(|key| format!("{key} = …")).collect();
                format!("{{ {} }}", keys.join(", "))
            }
            _ => "a table".to_owned(),
        }
    }
}

/// The unit in a doc comment: in the last brackets of its first paragraph that hold a unit, "Shear modulus
/// [Pa]."
pub(crate) fn unit(doc: Option<&str>) -> &str {
    let doc = doc.unwrap_or_default();
    let in_brackets = |open: usize| {
        let inner = &doc[open + 1..];
        inner.split_once(']').filter(|(_, rest)| !rest.starts_with(['(', '['])).map(|(unit, _)| unit)
    };
    let is_unit = |text: &&str| {
        !text.is_empty()
            && !["1", "-"].contains(text)
            && text.chars().count() <= 16
            && !text.contains(|c: char| "`,:;=_…[".contains(c))
    };
    doc.rmatch_indices('[').filter_map(|(open, _)| in_brackets(open)).find(is_unit).unwrap_or_default()
}
