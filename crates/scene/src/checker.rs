//! Checks the tables of a user against the JSON schema of the parameters. Each mistake is reported with its place.
//!
//! The schema is the one that schemars derives from the parameter struct: meaning, unit, range and default are declared
//! there once. Whatever keys a table's schema does not name are mistakes, whether or not the struct denies unknown
//! fields, because serde cannot deny them in structs with flattened parts. Names that only serde knows (`alias`) and the
//! schema's `pattern`, `multipleOf` and `uniqueItems` are ignored.

use std::borrow::Cow;
use std::fmt;

use schemars::{JsonSchema, Schema, schema_for};
use serde::de::DeserializeOwned;
use serde_json::{Map, Value as Json};

use crate::diagnostic::{Diagnostic, Place};
use crate::plausible::remark;
use crate::source::{Node, Source, Value};

/// Schemas refer to one another; deeper than this they refer to themselves.
const DEEPEST_REFERENCE: usize = 32;

/// Checks a value of the user against a schema. `path` is the value's name in messages, such as `law.parenchyma`;
/// `schema` is a root schema, with its definitions in `$defs`.
///
/// Every mistake goes to `out`. The answer is what the user wrote as JSON, to be deserialised where there was no
/// mistake; parts with mistakes are missing from it.
pub fn check(node: &Node, path: &str, schema: &Schema, out: &mut Vec<Diagnostic>) -> Json {
    check_skipping(node, path, schema, &[], out)
}

/// Reads the table at `path` into its parameter struct; `None` where there was a mistake, which is then in `out`.
///
/// Keys in `skip` are left to the caller, such as the `type` that chose the struct. A table that the file lacks is
/// read as an empty one: the defaults, or what is required and missing.
pub fn read_table<T: DeserializeOwned + JsonSchema>(
    source: &Source,
    path: &[&str],
    skip: &[&str],
    out: &mut Vec<Diagnostic>,
) -> Option<T> {
    let node = match source.node(path) {
        Some(node) => Cow::Borrowed(node),
        None => {
            Cow::Owned(Node { place: source.span(path), key_span: None, value: Value::Table(Vec::new()) })
        }
    };
    let (name, before) = (path.join("."), out.len());
    let json = check_skipping(&node, &name, &schema_for!(T), skip, out);
    if out[before..].iter().any(Diagnostic::is_error) {
        return None;
    }
    serde_json::from_value(json)
        .map_err(|error| {
            let named = if name.is_empty() { String::new() } else { format!("`{name}`: ") };
            out.push(Diagnostic::error(format!("{named}{error}")).at(node.place.clone(), "in this table"));
        })
        .ok()
}

/// The known name that `word` was most likely meant to be, if any is near.
///
/// Near is a third of the letters added, left out, changed or swapped, or one name at the beginning of the other; case,
/// `-`, `_` and spaces don't count.
pub fn nearest<'a>(word: &str, known: impl IntoIterator<Item = &'a str>) -> Option<&'a str> {
    let plain = |name: &str| name.to_lowercase().replace(['_', ' '], "-");
    let word = plain(word);
    // What the distance costs grows with the square of the length; no name is as long as this.
    if word.len() > 100 {
        return None;
    }
    let mut best: Option<(usize, &str)> = None;
    let mut beginning = None;
    for name in known {
        let other = plain(name);
        let distance = strsim::damerau_levenshtein(&word, &other);
        let longest = word.chars().count().max(other.chars().count());
        if distance <= (longest / 3).max(1)
            && distance < longest
            && best.is_none_or(|(least, _)| distance < least)
        {
            best = Some((distance, name));
        }
        let shortest = word.chars().count().min(other.chars().count());
        if shortest >= 3 && (other.starts_with(&word) || word.starts_with(&other)) && beginning.is_none() {
            beginning = Some(name);
        }
    }
    best.map(|(_, name)| name).or(beginning)
}

pub(crate) fn check_skipping(
    node: &Node,
    path: &str,
    schema: &Schema,
    skip: &[&str],
    out: &mut Vec<Diagnostic>,
) -> Json {
    let root = schema.as_value();
    let mut checker = Checker { forms: Forms { root }, skip, out };
    let forms = checker.forms.of(root);
    checker.value(node, &forms, &Trail::Start(path), checker.forms.doc(root)).unwrap_or(Json::Null)
}

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

/// One form that a value may take: a schema with its references and alternatives resolved, so that it is of one kind.
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
    /// What a table takes beside its properties.
    pub(crate) additional: Option<&'s Json>,
    pub(crate) items: Option<&'s Json>,
    pub(crate) prefix: Vec<&'s Json>,
    /// Least and most items of an array.
    pub(crate) items_range: (Option<u64>, Option<u64>),
    /// Least and most characters of a text.
    letters_range: (Option<u64>, Option<u64>),
    pub(crate) lower: Option<Bound>,
    pub(crate) upper: Option<Bound>,
    /// The description of this form, such as one word of several or one key of which a table has exactly one.
    pub(crate) doc: Option<&'s str>,
}

impl<'s> Form<'s> {
    /// Takes in what a schema says itself, beside its references and alternatives.
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

    /// Whether the value is of this form's kind.
    fn fits(&self, value: &Value) -> bool {
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
    fn tag(&self, key: &str) -> Option<&'s str> {
        self.property(key)?.get("const")?.as_str()
    }

    /// The range of a number in words, "greater than 0 and at most 0.5"; empty where there is none.
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
    fn lower(&self) -> String {
        format!("{} {}", if self.exclusive { "greater than" } else { "at least" }, number(self.value))
    }

    fn upper(&self) -> String {
        format!("{} {}", if self.exclusive { "less than" } else { "at most" }, number(self.value))
    }
}

/// Resolves the schemas of one root schema.
#[derive(Clone, Copy)]
pub(crate) struct Forms<'s> {
    pub(crate) root: &'s Json,
}

impl<'s> Forms<'s> {
    /// The forms that a value of this schema may take; "no value", which TOML cannot say, is none of them.
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
        let all = map.get("allOf").and_then(Json::as_array).into_iter().flatten();
        for part in self.target(map).into_iter().chain(all) {
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

    /// The first paragraph of a schema's description, or of what it refers to.
    pub(crate) fn doc(self, schema: &'s Json) -> Option<&'s str> {
        let own = |schema: &'s Json| schema.get("description")?.as_str()?.split("\n\n").next();
        own(schema).or_else(|| {
            let map = schema.as_object()?;
            let branch = map.get("anyOf").and_then(Json::as_array).and_then(|branches| branches.first());
            let optional = branch.and_then(Json::as_object).filter(|branch| branch.contains_key("$ref"));
            self.target(map).or_else(|| self.target(optional?)).and_then(own)
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

/// The unit in a doc comment: the last brackets of its first paragraph that hold one, "Shear modulus [Pa]."
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

/// The way from the first value to the one that is being checked.
enum Trail<'t> {
    Start(&'t str),
    Key(&'t Trail<'t>, &'t str),
    Item(&'t Trail<'t>, usize),
}

impl fmt::Display for Trail<'_> {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Trail::Start(path) => f.write_str(path),
            Trail::Key(Trail::Start(""), key) => f.write_str(key),
            Trail::Key(table, key) => write!(f, "{table}.{key}"),
            Trail::Item(array, index) => write!(f, "{array}[{index}]"),
        }
    }
}

impl Trail<'_> {
    /// What messages begin with: "`law.parenchyma`: ".
    fn subject(&self) -> String {
        match self {
            Trail::Start("") => String::new(),
            trail => format!("`{trail}`: "),
        }
    }

    /// " in `law.parenchyma`".
    fn within(&self) -> String {
        match self {
            Trail::Start("") => String::new(),
            trail => format!(" in `{trail}`"),
        }
    }

    /// The parameter whose doc comment explains a value: the last key of the way.
    fn parameter(&self) -> &str {
        match self {
            Trail::Start(path) => path.rsplit('.').next().unwrap_or(path),
            Trail::Key(_, key) => key,
            Trail::Item(array, _) => array.parameter(),
        }
    }

    /// The parameter with its doc comment, for the help.
    fn explained(&self, doc: Option<&str>) -> String {
        match doc {
            Some(doc) if !self.parameter().is_empty() => format!("`{}`: {}", self.parameter(), one_line(doc)),
            _ => String::new(),
        }
    }
}

struct Checker<'s, 'o> {
    forms: Forms<'s>,
    /// Keys of the first table that are the caller's.
    skip: &'o [&'o str],
    out: &'o mut Vec<Diagnostic>,
}

impl<'s> Checker<'s, '_> {
    fn report(&mut self, diagnostic: Diagnostic) -> Option<Json> {
        self.out.push(diagnostic);
        None
    }

    fn value(
        &mut self,
        node: &Node,
        forms: &[Form<'s>],
        trail: &Trail<'_>,
        doc: Option<&'s str>,
    ) -> Option<Json> {
        if let Value::Float(x) = &node.value
            && !x.is_finite()
        {
            let message = format!("{}{} is not a finite number", trail.subject(), number(*x));
            let expected = format!("expected {}", self.forms.phrase(forms, unit(doc)));
            return self.report(
                Diagnostic::error(message).at(node.place.clone(), expected).help(trail.explained(doc)),
            );
        }
        let fitting: Vec<Form<'s>> = forms.iter().filter(|form| form.fits(&node.value)).cloned().collect();
        match (fitting.as_slice(), &node.value) {
            ([], _) => self.wrong_kind(node, forms, trail, doc),
            (_, Value::String(text)) => self.text(text, node, forms, &fitting, trail, doc),
            ([form], _) => self.form(node, form, trail, doc),
            (_, Value::Table(_)) => {
                let words: Vec<&str> =
                    forms.iter().filter_map(|form| form.words.as_ref()).flatten().copied().collect();
                self.choice(node, &fitting, &words, trail, doc)
            }
            _ => self.best(node, &fitting, trail, doc),
        }
    }

    fn form(
        &mut self,
        node: &Node,
        form: &Form<'s>,
        trail: &Trail<'_>,
        doc: Option<&'s str>,
    ) -> Option<Json> {
        match (&node.value, form.kind) {
            (_, None) => self.anything(node, trail),
            (Value::Integer(n), _) => {
                self.in_range(node, *n as f64, form, trail, doc).then(|| Json::from(*n))
            }
            (Value::Float(x), _) => self.in_range(node, *x, form, trail, doc).then(|| Json::from(*x)),
            (Value::Boolean(truth), _) => Some(Json::from(*truth)),
            (Value::Array(items), _) => self.array(node, items, form, trail, doc),
            (Value::Table(entries), _) => self.table(node, entries, form, &[], trail),
            (Value::String(text) | Value::Datetime(text), _) => Some(Json::from(text.as_str())),
        }
    }

    /// Checks a value against the alternatives of its kind and keeps the mistakes of the alternative with the fewest.
    fn best(
        &mut self,
        node: &Node,
        forms: &[Form<'s>],
        trail: &Trail<'_>,
        doc: Option<&'s str>,
    ) -> Option<Json> {
        let mut best: Option<(Vec<Diagnostic>, Option<Json>)> = None;
        for form in forms {
            let mut found = Vec::new();
            let mut checker = Checker { forms: self.forms, skip: self.skip, out: &mut found };
            let json = checker.form(node, form, trail, doc);
            if !found.iter().any(Diagnostic::is_error) {
                self.out.extend(found);
                return json;
            }
            if best.as_ref().is_none_or(|(least, _)| found.len() < least.len()) {
                best = Some((found, json));
            }
        }
        let (found, json) = best?;
        let lengths_differ = forms.iter().any(|form| form.items_range != forms[0].items_range);
        if lengths_differ && found.iter().all(|diagnostic| diagnostic.message.contains(": expected ")) {
            return self.wrong_kind(node, forms, trail, doc);
        }
        self.out.extend(found);
        json
    }

    fn wrong_kind(
        &mut self,
        node: &Node,
        forms: &[Form<'s>],
        trail: &Trail<'_>,
        doc: Option<&'s str>,
    ) -> Option<Json> {
        let expected = self.forms.phrase(forms, unit(doc));
        let is = |kind| forms.iter().any(|form| form.kind == Some(kind));
        let free_text = |form: &Form| form.kind == Some(Kind::Text) && form.words.is_none();
        let hint = match &node.value {
            Value::String(text) if is(Kind::Number) || is(Kind::Integer) => {
                match text.trim().parse::<f64>() {
                    Ok(x) if x.is_finite() => format!("remove the quotes: {}", text.trim()),
                    _ => String::new(),
                }
            }
            Value::String(text) if is(Kind::Boolean) && ["true", "false"].contains(&text.as_str()) => {
                format!("remove the quotes: {text}")
            }
            Value::Float(x) if is(Kind::Integer) && x.fract() == 0.0 => {
                format!("write {} without a point", number(*x))
            }
            Value::Integer(_) | Value::Float(_) | Value::Boolean(_) if forms.iter().any(free_text) => {
                "put a text in quotes".to_owned()
            }
            _ => String::new(),
        };
        let message = format!("{}expected {expected}, found {}", trail.subject(), found(node));
        let diagnostic = Diagnostic::error(message).at(node.place.clone(), format!("expected {expected}"));
        self.report(diagnostic.help(hint).help(trail.explained(doc)))
    }

    /// Whether a value in its range has a plausible size; reports one that is impossible or unlikely.
    fn is_possible(
        &mut self,
        node: &Node,
        x: f64,
        positive: bool,
        trail: &Trail<'_>,
        doc: Option<&'s str>,
    ) -> bool {
        // Positions are as large as they like.
        let unit = unit(doc);
        if unit == "m" && !positive {
            return true;
        }
        let Some(remark) = remark(x, unit, positive, &number(x)) else { return true };
        let message = format!("`{trail}` {}", remark.message);
        let diagnostic =
            if remark.is_mistake { Diagnostic::error(message) } else { Diagnostic::warning(message) };
        self.report(diagnostic.at(node.place.clone(), remark.label).help(remark.help));
        !remark.is_mistake
    }

    fn in_range(
        &mut self,
        node: &Node,
        x: f64,
        form: &Form<'s>,
        trail: &Trail<'_>,
        doc: Option<&'s str>,
    ) -> bool {
        let low = form.lower.filter(|bound| x < bound.value || (bound.exclusive && x == bound.value));
        let high = form.upper.filter(|bound| x > bound.value || (bound.exclusive && x == bound.value));
        let (Some(broken), range) = (low.map(|b| b.lower()).or(high.map(|b| b.upper())), form.range()) else {
            let positive = form.lower.is_some_and(|bound| bound.exclusive && bound.value == 0.0);
            return self.is_possible(node, x, positive, trail, doc);
        };
        // Limits of 32-bit types are shown only to those who break them.
        let range = if range.contains(&broken) { range } else { broken };
        let message = match trail {
            Trail::Start("") => format!("the value must be {range}, found {}", number(x)),
            _ => format!("`{trail}` must be {range}, found {}", number(x)),
        };
        let label = format!("must be {range}");
        self.report(Diagnostic::error(message).at(node.place.clone(), label).help(trail.explained(doc)));
        false
    }

    fn text(
        &mut self,
        text: &str,
        node: &Node,
        forms: &[Form<'s>],
        fitting: &[Form<'s>],
        trail: &Trail<'_>,
        doc: Option<&'s str>,
    ) -> Option<Json> {
        if let Some(free) = fitting.iter().find(|form| form.words.is_none()) {
            let (least, most) = free.letters_range;
            let letters = text.chars().count() as u64;
            if least.is_some_and(|least| letters < least) || most.is_some_and(|most| letters > most) {
                let expected = match (least, most) {
                    (Some(1), None) => "a text that is not empty".to_owned(),
                    (Some(a), Some(b)) if a == b => {
                        format!("a text of {a} character{}", if a == 1 { "" } else { "s" })
                    }
                    (Some(a), None) => format!("a text of {a} or more characters"),
                    (a, b) => format!("a text of {} to {} characters", a.unwrap_or(0), b.unwrap_or(u64::MAX)),
                };
                let message = format!("{}expected {expected}, found {}", trail.subject(), found(node));
                let diagnostic =
                    Diagnostic::error(message).at(node.place.clone(), format!("expected {expected}"));
                return self.report(diagnostic.help(trail.explained(doc)));
            }
            return Some(Json::from(text));
        }
        let words: Vec<&str> =
            fitting.iter().filter_map(|form| form.words.as_ref()).flatten().copied().collect();
        if words.contains(&text) {
            return Some(Json::from(text));
        }
        let tables: Vec<&str> = forms
            .iter()
            .filter(|form| form.kind == Some(Kind::Table))
            .filter_map(|form| if let [key] = form.required.as_slice() { Some(*key) } else { None })
            .collect();
        let expected = self.forms.phrase(forms, unit(doc));
        let hint = if tables.contains(&text) {
            format!("`{text}` needs a value: write {{ {text} = … }}")
        } else if text.trim().parse::<f64>().is_ok_and(f64::is_finite)
            && forms.iter().any(|form| matches!(form.kind, Some(Kind::Number | Kind::Integer)))
        {
            format!("remove the quotes: {}", text.trim())
        } else if let Some(word) = nearest(text, words.iter().copied()) {
            format!("did you mean \"{word}\"?")
        } else if let Some(key) = nearest(text, tables.iter().copied()) {
            format!("did you mean {{ {key} = … }}?")
        } else {
            String::new()
        };
        let message = format!("{}expected {expected}, found {}", trail.subject(), found(node));
        let diagnostic = Diagnostic::error(message).at(node.place.clone(), "not known here");
        self.report(diagnostic.help(hint).help(trail.explained(doc)))
    }

    fn array(
        &mut self,
        node: &Node,
        items: &[Node],
        form: &Form<'s>,
        trail: &Trail<'_>,
        doc: Option<&'s str>,
    ) -> Option<Json> {
        let count = items.len() as u64;
        let (least, most) = form.items_range;
        let wrong_length = least.is_some_and(|least| count < least) || most.is_some_and(|most| count > most);
        let rest = form.items.map(|schema| self.forms.of(schema));
        let before = self.out.len();
        let mut values = Some(Vec::with_capacity(items.len()));
        for (i, item) in items.iter().enumerate() {
            let trail = Trail::Item(trail, i);
            let value = match (form.prefix.get(i), &rest) {
                (Some(schema), _) => {
                    let forms = self.forms.of(schema);
                    self.value(item, &forms, &trail, doc)
                }
                (None, Some(forms)) => self.value(item, forms, &trail, doc),
                (None, None) if wrong_length => None,
                (None, None) => self.anything(item, &trail),
            };
            values = values.zip(value).map(|(mut values, value)| {
                values.push(value);
                values
            });
        }
        // Of items that are all wrong and too few as well, the length is not the news.
        if wrong_length && self.out.len() == before {
            let expected = self.forms.phrase(std::slice::from_ref(form), unit(doc));
            let message = format!("{}expected {expected}, found {count}", trail.subject());
            let diagnostic =
                Diagnostic::error(message).at(node.place.clone(), format!("expected {expected}"));
            return self.report(diagnostic.help(trail.explained(doc)));
        }
        values.map(Json::Array)
    }

    /// A table that may be one of several: distinguished by a tag, by its keys, or by the best fit. `words` could
    /// have stood in its place.
    fn choice(
        &mut self,
        node: &Node,
        forms: &[Form<'s>],
        words: &[&str],
        trail: &Trail<'_>,
        doc: Option<&'s str>,
    ) -> Option<Json> {
        let common = |key: &str| forms.iter().all(|form| form.property(key).is_some());
        let tag = forms[0]
            .properties
            .iter()
            .map(|(key, _)| *key)
            .find(|key| forms.iter().all(|form| form.tag(key).is_some()));
        if let Some(tag) = tag {
            return self.tagged(node, forms, tag, trail);
        }
        let own: Vec<Vec<&str>> = forms
            .iter()
            .map(|form| form.properties.iter().map(|(key, _)| *key).filter(|key| !common(key)).collect())
            .collect();
        let told_by_key = forms.iter().zip(&own).all(|(form, own)| match own.as_slice() {
            [] => true,
            [key] => form.required.contains(key),
            _ => false,
        });
        if told_by_key {
            self.keyed(node, forms, &own, words, trail)
        } else {
            self.best(node, forms, trail, doc)
        }
    }

    fn tagged(&mut self, node: &Node, forms: &[Form<'s>], tag: &str, trail: &Trail<'_>) -> Option<Json> {
        let words: Vec<&str> = forms.iter().filter_map(|form| form.tag(tag)).collect();
        let quoted: Vec<String> = words.iter().map(|word| format!("\"{word}\"")).collect();
        let Some(given) = node.get(tag) else {
            let known = words.join(", ");
            let message = format!("missing key `{tag}`{}", trail.within());
            let diagnostic =
                Diagnostic::error(message).at(node.place.clone(), format!("`{tag}` is missing here"));
            return self.report(diagnostic.help(format!("`{tag}` is one of {known}")));
        };
        if let Some(form) =
            forms.iter().find(|form| form.tag(tag) == given.as_str() && given.as_str().is_some())
        {
            return self.table(node, node.entries(), form, &[], trail);
        }
        let hint = given.as_str().and_then(|word| nearest(word, words.iter().copied()));
        let hint = hint.map(|word| format!("did you mean \"{word}\"?")).unwrap_or_default();
        let subject = Trail::Key(trail, tag).subject();
        let message = format!("{subject}expected one of {}, found {}", quoted.join(", "), found(given));
        self.report(Diagnostic::error(message).at(given.place.clone(), "not known here").help(hint))
    }

    /// `own` are the keys of each form that not all forms have, here at most one each.
    fn keyed(
        &mut self,
        node: &Node,
        forms: &[Form<'s>],
        own: &[Vec<&'s str>],
        words: &[&str],
        trail: &Trail<'_>,
    ) -> Option<Json> {
        let entries = node.entries();
        let choices: Vec<&'s str> = own.iter().flatten().copied().collect();
        let given: Vec<&(String, Node)> =
            entries.iter().filter(|(key, _)| choices.contains(&key.as_str())).collect();
        let exactly = format!("give exactly one of {}", names(&choices));
        match given.as_slice() {
            [(key, _)] => {
                let form = own.iter().position(|own| own.contains(&key.as_str()))?;
                self.table(node, entries, &forms[form], &[], trail)
            }
            [] => {
                if let Some(form) = own.iter().position(Vec::is_empty) {
                    return self.table(node, entries, &forms[form], &choices, trail);
                }
                let unknown = |key: &str| forms[0].property(key).is_none() && !self.skipped(key, trail);
                let unknown: Vec<&(String, Node)> = entries.iter().filter(|(key, _)| unknown(key)).collect();
                for (key, child) in &unknown {
                    let hint = match nearest(key, choices.iter().copied()) {
                        _ if words.contains(&key.as_str()) => format!("write \"{key}\" instead of a table"),
                        Some(name) => format!("did you mean `{name}`?"),
                        None => String::new(),
                    };
                    let diagnostic = Diagnostic::error(format!("unknown key `{key}`{}", trail.within()));
                    self.report(
                        diagnostic.at(child.key_place(), "not known here").help(hint).help(exactly.clone()),
                    );
                }
                if unknown.is_empty() {
                    let message = format!("{}one of {} is missing", trail.subject(), names(&choices));
                    self.report(
                        Diagnostic::error(message).at(node.place.clone(), "missing here").help(exactly),
                    );
                }
                None
            }
            [(first, first_node), others @ ..] => {
                let keys: Vec<&str> = given.iter().map(|(key, _)| key.as_str()).collect();
                let message = format!("{}{} cannot be given together", trail.subject(), names(&keys));
                let mut diagnostic = Diagnostic::error(message);
                if let Some((key, child)) = others.first() {
                    diagnostic = diagnostic.at(child.key_place(), format!("`{key}` as well"));
                }
                self.report(
                    diagnostic.also(first_node.key_place(), format!("`{first}` is given here")).help(exactly),
                )
            }
        }
    }

    fn skipped(&self, key: &str, trail: &Trail<'_>) -> bool {
        matches!(trail, Trail::Start(_)) && self.skip.contains(&key)
    }

    /// `others` are keys that this form lacks but the user may have meant.
    fn table(
        &mut self,
        node: &Node,
        entries: &[(String, Node)],
        form: &Form<'s>,
        others: &[&'s str],
        trail: &Trail<'_>,
    ) -> Option<Json> {
        let mut table = Map::new();
        let mut guesses: Vec<&str> = Vec::new();
        for (key, child) in entries {
            if self.skipped(key, trail) {
                continue;
            }
            let here = Trail::Key(trail, key);
            let value = match (form.property(key), form.additional) {
                (Some(schema), _) | (None, Some(schema @ Json::Object(_))) => {
                    let forms = self.forms.of(schema);
                    self.value(child, &forms, &here, self.forms.doc(schema))
                }
                (None, Some(Json::Bool(true))) => self.anything(child, &here),
                (None, _) => {
                    guesses.extend(self.unknown_key(key, child, entries, form, others, trail));
                    None
                }
            };
            if let Some(value) = value {
                table.insert(key.clone(), value);
            }
        }
        let missing: Vec<&str> = form
            .required
            .iter()
            .copied()
            .filter(|key| !entries.iter().any(|(given, _)| given == key) && !self.skipped(key, trail))
            .collect();
        // A misspelt key is reported once, not also as a missing one.
        let missing: Vec<&str> = missing.into_iter().filter(|key| !guesses.contains(key)).collect();
        if !missing.is_empty() {
            self.missing_keys(node, &missing, form, trail);
        }
        Some(Json::Object(table))
    }

    /// Reports it and returns the key that was probably meant.
    fn unknown_key(
        &mut self,
        key: &str,
        child: &Node,
        entries: &[(String, Node)],
        form: &Form<'s>,
        others: &[&'s str],
        trail: &Trail<'_>,
    ) -> Option<&'s str> {
        // What the file gives already can still be meant by an option that replaces it.
        let replaces = matches!(child.place, Place::Option(..));
        let free = |name: &&str| replaces || !entries.iter().any(|(given, _)| given == name);
        let known: Vec<&'s str> =
            form.properties.iter().map(|(key, _)| *key).chain(others.iter().copied()).collect();
        let guess = nearest(key, known.iter().copied().filter(free));
        let skip = self.skip.iter().copied().filter(|_| matches!(trail, Trail::Start(_)));
        let hint = match guess.or_else(|| nearest(key, skip.filter(free))) {
            Some(name) => format!("did you mean `{name}`?"),
            None if known.is_empty() => "it takes no keys".to_owned(),
            None => format!("known keys: {}", names(&known)),
        };
        let message = format!("unknown key `{key}`{}", trail.within());
        self.report(Diagnostic::error(message).at(child.key_place(), "not known here").help(hint));
        guess
    }

    fn missing_keys(&mut self, node: &Node, missing: &[&str], form: &Form<'s>, trail: &Trail<'_>) {
        let plural = if missing.len() == 1 { "" } else { "s" };
        let list = names(missing);
        let message = format!("missing key{plural} {list}{}", trail.within());
        let are = if missing.len() == 1 { "is" } else { "are" };
        let mut diagnostic =
            Diagnostic::error(message).at(node.place.clone(), format!("{list} {are} missing here"));
        for key in missing {
            let Some(schema) = form.property(key) else { continue };
            let doc = self.forms.doc(schema);
            let kind = self.forms.phrase(&self.forms.of(schema), "");
            let what = doc.map_or(kind.clone(), |doc| format!("{} ({kind})", one_line(doc)));
            diagnostic = diagnostic.help(format!("`{key}`: {what}"));
        }
        self.report(diagnostic);
    }

    /// A value that the schema says nothing about.
    fn anything(&mut self, node: &Node, trail: &Trail<'_>) -> Option<Json> {
        match &node.value {
            Value::Table(entries) => {
                let mut table = Map::new();
                for (key, child) in entries {
                    if !self.skipped(key, trail) {
                        table.insert(key.clone(), self.anything(child, &Trail::Key(trail, key))?);
                    }
                }
                Some(Json::Object(table))
            }
            Value::Array(items) => {
                let each =
                    items.iter().enumerate().map(|(i, item)| self.anything(item, &Trail::Item(trail, i)));
                each.collect::<Option<Vec<_>>>().map(Json::Array)
            }
            Value::Float(x) if !x.is_finite() => {
                let message = format!("{}{} is not a finite number", trail.subject(), number(*x));
                self.report(Diagnostic::error(message).at(node.place.clone(), "expected a finite number"))
            }
            Value::Float(x) => Some(Json::from(*x)),
            Value::Integer(n) => Some(Json::from(*n)),
            Value::Boolean(truth) => Some(Json::from(*truth)),
            Value::String(text) | Value::Datetime(text) => Some(Json::from(text.as_str())),
        }
    }
}

/// What the user wrote, in words.
fn found(node: &Node) -> String {
    let short = |text: &str| match text.char_indices().nth(40) {
        Some((end, _)) => format!("{}…", &text[..end]),
        None => text.to_owned(),
    };
    match &node.value {
        Value::Table(_) => "a table".to_owned(),
        Value::Array(items) => match items.len() {
            0 => "an empty array".to_owned(),
            1 => "an array of 1 value".to_owned(),
            n => format!("an array of {n} values"),
        },
        Value::String(text) => format!("the text {:?}", short(text)),
        Value::Integer(n) => n.to_string(),
        Value::Float(x) => number(*x),
        Value::Boolean(truth) => truth.to_string(),
        Value::Datetime(time) => format!("the date or time {}", short(time)),
    }
}

/// A number as one would write it.
fn number(x: f64) -> String {
    let size = x.abs();
    if x.is_nan() {
        "nan".to_owned()
    } else if x.is_infinite() || size == 0.0 || (1e-4..1e10).contains(&size) {
        x.to_string()
    } else {
        format!("{x:e}")
    }
}

pub(crate) fn one_line(text: &str) -> String {
    text.split_whitespace().collect::<Vec<_>>().join(" ")
}

/// "`a`, `b`".
fn names(keys: &[&str]) -> String {
    keys.iter().map(|key| format!("`{key}`")).collect::<Vec<_>>().join(", ")
}

/// "a, b or c".
fn alternatives(parts: &[String]) -> String {
    match parts {
        [] => "nothing".to_owned(),
        [one] => one.clone(),
        [first @ .., last] => format!("{} or {last}", first.join(", ")),
    }
}

#[cfg(test)]
mod tests {
    use std::collections::BTreeMap;

    use serde::Deserialize;

    use pliant_testing::Random;

    use super::*;

    /// A law of the tests.
    #[derive(Debug, PartialEq, Deserialize, JsonSchema)]
    #[serde(rename_all = "kebab-case")]
    struct Law {
        /// Shear modulus at rest [Pa].
        ///
        /// Of the matrix alone.
        #[schemars(extend("exclusiveMinimum" = 0.0))]
        shear_modulus: f64,
        /// Poisson's ratio [1].
        #[serde(default = "poisson")]
        #[schemars(range(min = 0.0, max = 0.5))]
        poisson_ratio: f64,
        /// Direction of the fibres.
        #[serde(default)]
        fibre: Option<Fibre>,
        /// Relaxation of the stress.
        #[serde(default)]
        prony: Vec<Term>,
    }

    fn poisson() -> f64 {
        0.45
    }

    /// The same everywhere or a field of the mesh.
    #[derive(Debug, PartialEq, Deserialize, JsonSchema)]
    #[serde(untagged)]
    enum Fibre {
        Same([f64; 3]),
        #[serde(rename_all = "kebab-case")]
        Field {
            cell_data: String,
        },
    }

    /// One term of a Prony series.
    #[derive(Debug, PartialEq, Deserialize, JsonSchema)]
    struct Term {
        /// What relaxes.
        part: Part,
        /// Share of the stress that relaxes [1].
        #[schemars(extend("exclusiveMinimum" = 0.0, "exclusiveMaximum" = 1.0))]
        weight: f64,
    }

    #[derive(Debug, PartialEq, Deserialize, JsonSchema)]
    #[serde(rename_all = "kebab-case")]
    enum Part {
        Isochoric,
        /// Rarely used.
        Volumetric,
        Whole,
    }

    #[derive(Debug, PartialEq, Deserialize, JsonSchema)]
    #[serde(rename_all = "kebab-case")]
    enum Auto {
        Auto,
    }

    #[derive(Debug, PartialEq, Deserialize, JsonSchema)]
    #[serde(untagged)]
    enum Step {
        Auto(Auto),
        Seconds(#[schemars(extend("exclusiveMinimum" = 0.0))] f64),
    }

    /// Which nodes of a body.
    #[derive(Debug, PartialEq, Deserialize, JsonSchema)]
    #[serde(rename_all = "kebab-case")]
    enum Nodes {
        All,
        /// Two corners [m].
        Box([[f64; 3]; 2]),
        Sphere {
            /// Centre [m].
            centre: [f64; 3],
            /// Radius [m].
            radius: f64,
        },
        Set(String),
        Indices(Vec<u32>),
    }

    #[derive(Debug, PartialEq, Deserialize, JsonSchema)]
    #[serde(rename_all = "kebab-case")]
    enum Motion {
        By([f64; 3]),
        To([f64; 3]),
    }

    #[derive(Debug, PartialEq, Deserialize, JsonSchema)]
    #[serde(tag = "type", rename_all = "kebab-case")]
    enum Curve {
        Ramp { over: f64 },
        Sine { period: f64 },
    }

    /// When.
    #[derive(Debug, PartialEq, Deserialize, JsonSchema)]
    #[serde(rename_all = "kebab-case")]
    struct Timing {
        /// From this time on [s].
        #[serde(default)]
        from: f64,
        /// Time step [s].
        #[serde(default)]
        step: Option<Step>,
    }

    #[derive(Debug, PartialEq, Deserialize, JsonSchema)]
    #[serde(rename_all = "kebab-case")]
    struct Move {
        body: String,
        nodes: Nodes,
        #[serde(flatten)]
        motion: Motion,
        #[serde(flatten)]
        timing: Timing,
        #[serde(default)]
        curve: Option<Curve>,
        #[serde(default)]
        enabled: Option<bool>,
        #[serde(default)]
        threads: Option<u32>,
        #[serde(default)]
        small: Option<f32>,
        #[serde(default)]
        probes: BTreeMap<String, f64>,
        #[serde(default)]
        table: Vec<(f64, f64)>,
        #[serde(default)]
        #[schemars(length(min = 1, max = 2))]
        data: Vec<Part>,
        #[serde(default)]
        anything: Option<Json>,
    }

    /// What was read of table `t`, and each mistake as its message, what it underlines, and its help.
    fn read<T: DeserializeOwned + JsonSchema>(text: &str) -> (Option<T>, Vec<[String; 3]>) {
        let source = Source::parse("scene.toml", text).unwrap_or_else(|errors| panic!("{}", errors.plain()));
        let mut out = Vec::new();
        let read = read_table(&source, &["t"], &["type"], &mut out);
        let found = |d: Diagnostic| [d.message, text[d.span.unwrap()].to_owned(), d.help.unwrap_or_default()];
        (read, out.into_iter().map(found).collect())
    }

    #[track_caller]
    fn expect<T: DeserializeOwned + JsonSchema>(text: &str, mistakes: &[[&str; 3]]) {
        let (read, found) = read::<T>(text);
        assert_eq!(found, mistakes);
        assert_eq!(read.is_none(), !mistakes.is_empty());
    }

    const LAW: &str = "[t]\ntype = 'neo-hookean'\nshear-modulus = 3e3\n";
    const SHEAR: &str = "`shear-modulus`: Shear modulus at rest [Pa].";
    const MOVE: &str = "[t]\nbody = 'liver'\nby = [0, 0, 1]\n";

    fn law(lines: &str) -> String {
        format!("{LAW}{lines}\n")
    }

    fn moving(lines: &str) -> String {
        format!("{MOVE}nodes = 'all'\n{lines}\n")
    }

    #[test]
    fn what_is_right_is_read_with_its_defaults() {
        let (law, found) = read::<Law>(
            "[t]\ntype = 'x'\nshear-modulus = 3000\nfibre = [0, 1, 0]\n\
             prony = [{ part = 'isochoric', weight = 0.5 }]\n",
        );
        assert_eq!(found, [[""; 3]; 0]);
        let term = Term { part: Part::Isochoric, weight: 0.5 };
        let fibre = Some(Fibre::Same([0.0, 1.0, 0.0]));
        assert_eq!(law, Some(Law { shear_modulus: 3000.0, poisson_ratio: 0.45, fibre, prony: vec![term] }));
        let (step, found) = read::<Move>(
            "[t]\nbody = 'liver'\nnodes = { sphere = { centre = [0, 0, 0], radius = 0.1 } }\nto = [0, 0, 1]\n\
             step = 'auto'\nfrom = 1\ncurve = { type = 'ramp', over = 2 }\nenabled = true\nthreads = 4\n\
             probes = { a = 1 }\ntable = [[0, 0], [1, 1.5]]\nanything = { x = [1, 'a'] }\n",
        );
        assert_eq!(found, [[""; 3]; 0]);
        let step = step.unwrap();
        assert_eq!(step.motion, Motion::To([0.0, 0.0, 1.0]));
        assert_eq!(step.timing, Timing { from: 1.0, step: Some(Step::Auto(Auto::Auto)) });
        assert_eq!(step.curve, Some(Curve::Ramp { over: 2.0 }));
        assert_eq!(step.table, [(0.0, 0.0), (1.0, 1.5)]);
    }

    #[test]
    fn an_unknown_key_is_underlined_with_the_nearest_known_one() {
        expect::<Law>(
            "[t]\nshear-modulos = 3e3\n",
            &[["unknown key `shear-modulos` in `t`", "shear-modulos", "did you mean `shear-modulus`?"]],
        );
        expect::<Law>(
            &law("colour = 'red'"),
            &[[
                "unknown key `colour` in `t`",
                "colour",
                "known keys: `shear-modulus`, `poisson-ratio`, `fibre`, `prony`",
            ]],
        );
        // The nearest one is there already.
        expect::<Law>(
            &law("shear-moduls = 3"),
            &[[
                "unknown key `shear-moduls` in `t`",
                "shear-moduls",
                "known keys: `shear-modulus`, `poisson-ratio`, `fibre`, `prony`",
            ]],
        );
        expect::<Law>(
            "[t]\ntyp = 'x'\nshear-modulus = 1\n",
            &[["unknown key `typ` in `t`", "typ", "did you mean `type`?"]],
        );
        expect::<Law>(
            &law("prony = [{ part = 'whole', weight = 0.5, tau = 1 }]"),
            &[["unknown key `tau` in `t.prony[0]`", "tau", "known keys: `part`, `weight`"]],
        );
    }

    #[test]
    fn a_missing_key_is_shown_at_the_header_or_the_table() {
        expect::<Law>(
            "[t]\ntype = 'x'\n",
            &[["missing key `shear-modulus` in `t`", "[t]", &format!("{SHEAR} (a number)")]],
        );
        expect::<Law>(
            &law("prony = [{}]"),
            &[[
                "missing keys `part`, `weight` in `t.prony[0]`",
                "{}",
                "`part`: What relaxes. (one of \"isochoric\", \"whole\", \"volumetric\")\n\
                 `weight`: Share of the stress that relaxes [1]. (a number)",
            ]],
        );
        // The whole table is missing: the empty place at the beginning of the file.
        expect::<Law>("", &[["missing key `shear-modulus` in `t`", "", &format!("{SHEAR} (a number)")]]);
    }

    #[test]
    fn a_wrong_kind_says_what_was_expected_and_found() {
        let shear = |value: &str| format!("[t]\nshear-modulus = {value}\n");
        expect::<Law>(
            &shear("\"3\""),
            &[[
                "`t.shear-modulus`: expected a number [Pa], found the text \"3\"",
                "\"3\"",
                &format!("remove the quotes: 3\n{SHEAR}"),
            ]],
        );
        expect::<Law>(
            &shear("\"soft\""),
            &[["`t.shear-modulus`: expected a number [Pa], found the text \"soft\"", "\"soft\"", SHEAR]],
        );
        for (value, found) in [
            ("true", "true"),
            ("[1]", "an array of 1 value"),
            ("{ a = 1 }", "a table"),
            ("1979-05-27", "the date or time 1979-05-27"),
        ] {
            let message = format!("`t.shear-modulus`: expected a number [Pa], found {found}");
            expect::<Law>(&shear(value), &[[&message, value, SHEAR]]);
        }
        expect::<Move>(
            &moving("enabled = 'true'"),
            &[[
                "`t.enabled`: expected true or false, found the text \"true\"",
                "'true'",
                "remove the quotes: true",
            ]],
        );
        expect::<Move>(
            "[t]\nbody = 3\nnodes = 'all'\nby = [0, 0, 0]\n",
            &[["`t.body`: expected a text, found 3", "3", "put a text in quotes"]],
        );
        expect::<Law>(
            "t = 3\n",
            &[["`t`: expected { shear-modulus = … }, found 3", "3", "`t`: A law of the tests."]],
        );
    }

    #[test]
    fn a_number_out_of_its_range_says_the_range() {
        expect::<Law>(
            "[t]\nshear-modulus = -3\n",
            &[["`t.shear-modulus` must be greater than 0, found -3", "-3", SHEAR]],
        );
        expect::<Law>(
            "[t]\nshear-modulus = 0.0\n",
            &[["`t.shear-modulus` must be greater than 0, found 0", "0.0", SHEAR]],
        );
        expect::<Law>(
            &law("poisson-ratio = 0.7"),
            &[[
                "`t.poisson-ratio` must be at least 0 and at most 0.5, found 0.7",
                "0.7",
                "`poisson-ratio`: Poisson's ratio [1].",
            ]],
        );
        expect::<Law>(
            &law("prony = [{ part = 'whole', weight = 1 }]"),
            &[[
                "`t.prony[0].weight` must be greater than 0 and less than 1, found 1",
                "1",
                "`weight`: Share of the stress that relaxes [1].",
            ]],
        );
        expect::<Move>(&moving("threads = -1"), &[["`t.threads` must be at least 0, found -1", "-1", ""]]);
        expect::<Move>(
            &moving("threads = 5000000000"),
            &[["`t.threads` must be at most 4294967295, found 5000000000", "5000000000", ""]],
        );
        expect::<Move>(
            &moving("small = 1e300"),
            &[["`t.small` must be at most 3.4028234663852886e38, found 1e300", "1e300", ""]],
        );
        expect::<Move>(
            &moving("step = 0"),
            &[["`t.step` must be greater than 0, found 0", "0", "`step`: Time step [s]."]],
        );
    }

    #[test]
    fn whole_numbers_are_numbers_but_not_the_other_way_round() {
        expect::<Law>(&law("poisson-ratio = 0"), &[]);
        expect::<Move>(
            &moving("threads = 4.0"),
            &[["`t.threads`: expected a whole number, found 4", "4.0", "write 4 without a point"]],
        );
        expect::<Move>(
            &moving("threads = 4.5"),
            &[["`t.threads`: expected a whole number, found 4.5", "4.5", ""]],
        );
    }

    #[test]
    fn numbers_that_are_not_finite_are_always_mistakes() {
        expect::<Law>(
            "[t]\nshear-modulus = nan\n",
            &[["`t.shear-modulus`: nan is not a finite number", "nan", SHEAR]],
        );
        expect::<Law>(
            "[t]\nshear-modulus = +inf\n",
            &[["`t.shear-modulus`: inf is not a finite number", "+inf", SHEAR]],
        );
        expect::<Move>(
            &moving("anything = { x = [-inf] }"),
            &[["`t.anything.x[0]`: -inf is not a finite number", "-inf", ""]],
        );
    }

    #[test]
    fn arrays_of_a_wrong_length_or_with_wrong_items() {
        let direction = "`fibre`: Direction of the fibres.";
        expect::<Move>(
            "[t]\nbody = 'x'\nnodes = 'all'\nby = [0, 1]\n",
            &[["`t.by`: expected 3 numbers, found 2", "[0, 1]", ""]],
        );
        expect::<Law>(
            &law("fibre = [0, 1]"),
            &[["`t.fibre`: expected 3 numbers, found 2", "[0, 1]", direction]],
        );
        expect::<Law>(
            &law("fibre = [0, 'x', 0]"),
            &[["`t.fibre[1]`: expected a number, found the text \"x\"", "'x'", direction]],
        );
        expect::<Move>(
            &format!("{MOVE}nodes = {{ box = [[0, 0, 0]] }}\n"),
            &[["`t.nodes.box`: expected 2 arrays of 3 numbers, found 1", "[[0, 0, 0]]", ""]],
        );
        expect::<Move>(
            &moving("table = [[0, 0], [1]]"),
            &[["`t.table[1]`: expected 2 numbers, found 1", "[1]", ""]],
        );
        expect::<Move>(
            &moving("data = []"),
            &[[
                "`t.data`: expected an array of 1 to 2 texts (\"isochoric\", \"whole\" or \"volumetric\"), found 0",
                "[]",
                "",
            ]],
        );
        expect::<Move>(
            &format!("{MOVE}nodes = {{ indices = [1, -2] }}\n"),
            &[["`t.nodes.indices[1]` must be at least 0, found -2", "-2", ""]],
        );
    }

    #[test]
    fn unknown_words_come_with_the_nearest_and_the_list() {
        let expected = "expected one of \"isochoric\", \"whole\", \"volumetric\"";
        expect::<Move>(
            &moving("data = ['isocoric']"),
            &[[
                &format!("`t.data[0]`: {expected}, found the text \"isocoric\""),
                "'isocoric'",
                "did you mean \"isochoric\"?",
            ]],
        );
        expect::<Move>(
            &moving("data = ['x']"),
            &[[&format!("`t.data[0]`: {expected}, found the text \"x\""), "'x'", ""]],
        );
    }

    #[test]
    fn a_choice_takes_exactly_one_of_its_keys() {
        let nodes = |value: &str| format!("{MOVE}nodes = {value}\n");
        let exactly = "give exactly one of `box`, `sphere`, `set`, `indices`";
        let expected = "expected \"all\", { box = … }, { sphere = … }, { set = … } or { indices = … }";
        let doc = "`nodes`: Which nodes of a body.";
        expect::<Move>(
            &nodes("{}"),
            &[["`t.nodes`: one of `box`, `sphere`, `set`, `indices` is missing", "{}", exactly]],
        );
        expect::<Move>(
            &nodes("{ spere = 1 }"),
            &[["unknown key `spere` in `t.nodes`", "spere", &format!("did you mean `sphere`?\n{exactly}")]],
        );
        expect::<Move>(
            &nodes("{ set = 'a', box = 1 }"),
            &[["`t.nodes`: `set`, `box` cannot be given together", "box", exactly]],
        );
        expect::<Move>(
            &nodes("{ set = 'a', colour = 1 }"),
            &[["unknown key `colour` in `t.nodes`", "colour", "known keys: `set`"]],
        );
        expect::<Move>(
            &nodes("'set'"),
            &[[
                &format!("`t.nodes`: {expected}, found the text \"set\""),
                "'set'",
                &format!("`set` needs a value: write {{ set = … }}\n{doc}"),
            ]],
        );
        expect::<Move>(
            &nodes("'al'"),
            &[[
                &format!("`t.nodes`: {expected}, found the text \"al\""),
                "'al'",
                &format!("did you mean \"all\"?\n{doc}"),
            ]],
        );
        expect::<Move>(&nodes("3"), &[[&format!("`t.nodes`: {expected}, found 3"), "3", doc]]);
        expect::<Move>(
            &nodes("{ all = true }"),
            &[[
                "unknown key `all` in `t.nodes`",
                "all",
                &format!("write \"all\" instead of a table\n{exactly}"),
            ]],
        );
        expect::<Move>(
            &nodes("{ sphere = { centre = [0, 0, 0] } }"),
            &[[
                "missing key `radius` in `t.nodes.sphere`",
                "{ centre = [0, 0, 0] }",
                "`radius`: Radius [m]. (a number)",
            ]],
        );
    }

    #[test]
    fn a_flattened_choice_is_checked_among_the_other_keys() {
        let by_or_to = "give exactly one of `by`, `to`";
        expect::<Move>(
            "[t]\nbody = 'x'\nnodes = 'all'\n",
            &[["`t`: one of `by`, `to` is missing", "[t]", by_or_to]],
        );
        expect::<Move>(
            &moving("to = [0, 0, 0]"),
            &[["`t`: `by`, `to` cannot be given together", "to", by_or_to]],
        );
        expect::<Move>(
            &moving("stepp = 1"),
            &[["unknown key `stepp` in `t`", "stepp", "did you mean `step`?"]],
        );
    }

    #[test]
    fn a_choice_with_a_tag_is_checked_by_it() {
        expect::<Move>(
            &moving("curve = { type = 'rmp', over = 1 }"),
            &[[
                "`t.curve.type`: expected one of \"ramp\", \"sine\", found the text \"rmp\"",
                "'rmp'",
                "did you mean \"ramp\"?",
            ]],
        );
        expect::<Move>(
            &moving("curve = { over = 1 }"),
            &[["missing key `type` in `t.curve`", "{ over = 1 }", "`type` is one of ramp, sine"]],
        );
        expect::<Move>(
            &moving("curve = { type = 'sine', over = 1 }"),
            &[
                ["unknown key `over` in `t.curve`", "over", "known keys: `type`, `period`"],
                ["missing key `period` in `t.curve`", "{ type = 'sine', over = 1 }", "`period`: a number"],
            ],
        );
    }

    #[test]
    fn alternatives_without_a_tag_give_one_message() {
        let step = "`step`: Time step [s].";
        expect::<Move>(
            &moving("step = true"),
            &[["`t.step`: expected \"auto\" or a number [s], found true", "true", step]],
        );
        expect::<Move>(
            &moving("step = 'atuo'"),
            &[[
                "`t.step`: expected \"auto\" or a number [s], found the text \"atuo\"",
                "'atuo'",
                &format!("did you mean \"auto\"?\n{step}"),
            ]],
        );
        expect::<Law>(
            &law("fibre = 'x'"),
            &[[
                "`t.fibre`: expected 3 numbers or { cell-data = … }, found the text \"x\"",
                "'x'",
                "`fibre`: Direction of the fibres.",
            ]],
        );
        expect::<Law>(
            &law("fibre = { cel-data = 'x' }"),
            &[["unknown key `cel-data` in `t.fibre`", "cel-data", "did you mean `cell-data`?"]],
        );
    }

    #[test]
    fn all_mistakes_of_a_table_are_reported() {
        let text =
            "[t]\nshear-modulus = -1\npoisson-ration = 0.3\nfibre = [1, 2]\nprony = [{ weight = nan }]\n";
        let (_, found) = read::<Law>(text);
        let places: Vec<&str> = found.iter().map(|mistake| mistake[1].as_str()).collect();
        assert_eq!(places, ["-1", "poisson-ration", "[1, 2]", "nan", "{ weight = nan }"]);
    }

    #[test]
    fn what_the_command_line_gave_is_not_looked_for_in_the_file() {
        let mut source = Source::parse("scene.toml", LAW).unwrap();
        source.set(&["t", "shear-modulus"], -1.0).unwrap();
        source.set(&["t", "shaer"], 2).unwrap();
        let mut out = Vec::new();
        assert_eq!(read_table::<Law>(&source, &["t"], &["type"], &mut out), None);
        let found: Vec<_> = out.iter().map(|d| (d.message.as_str(), d.span.clone())).collect();
        assert_eq!(
            found,
            [
                ("`t.shear-modulus` must be greater than 0, found -1 (given on the command line)", None),
                ("unknown key `shaer` in `t` (given on the command line)", None)
            ]
        );
    }

    #[test]
    fn the_whole_file_can_be_one_table() {
        let source = Source::parse("scene.toml", "shear-modulus = 'x'\ncolour = 1\n").unwrap();
        let mut out = Vec::new();
        assert_eq!(read_table::<Law>(&source, &[], &[], &mut out), None);
        assert!(out[0].message.starts_with("`shear-modulus`: expected a number [Pa]"), "{out:?}");
        assert_eq!(out[1].message, "unknown key `colour`");
    }

    #[test]
    fn what_only_serde_knows_is_reported_at_the_table() {
        #[derive(Debug, Deserialize, JsonSchema)]
        #[serde(try_from = "String")]
        #[allow(dead_code)]
        struct Even(String);
        impl TryFrom<String> for Even {
            type Error = String;
            fn try_from(text: String) -> Result<Self, String> {
                if text.len().is_multiple_of(2) { Ok(Self(text)) } else { Err("odd".to_owned()) }
            }
        }
        #[derive(Debug, Deserialize, JsonSchema)]
        #[allow(dead_code)]
        struct Holder {
            even: Even,
        }
        expect::<Holder>("[t]\neven = 'abc'\n", &[["`t`: odd", "[t]", ""]]);
    }

    #[test]
    fn the_nearest_name_is_near() {
        let known = ["shear-modulus", "bulk-modulus", "fibre", "to"];
        assert_eq!(nearest("Shear_Modulus", known), Some("shear-modulus"));
        assert_eq!(nearest("bulk", known), Some("bulk-modulus"));
        assert_eq!(nearest("fiber", known), Some("fibre"));
        assert_eq!(nearest("ot", known), Some("to"));
        assert_eq!(nearest("x", known), None);
        assert_eq!(nearest("density", known), None);
        assert_eq!(nearest("", known), None);
        assert_eq!(nearest(&"x".repeat(100_000), known), None);
    }

    #[test]
    fn the_unit_is_what_stands_in_the_last_brackets() {
        assert_eq!(unit(Some("Shear modulus [Pa].")), "Pa");
        assert_eq!(unit(Some("In [0, 1], a rate [1/s]")), "1/s");
        assert_eq!(unit(Some("See [`Law`] and [this](x.md); in [0, 1]")), "");
        assert_eq!(unit(Some("A ratio [1]")), "");
        assert_eq!(unit(Some("open [kg")), "");
        assert_eq!(unit(None), "");
    }

    #[test]
    fn a_damaged_scene_is_never_a_panic() {
        let text = "[t]\nbody = 'liver'\nnodes = { sphere = { centre = [0, 0, 0], radius = 0.1 } }\nto = [0, 0, 1]\n\
                    step = 'auto'\nfrom = 1\ncurve = { type = 'ramp', over = 2 }\nenabled = true\nthreads = 4\n\
                    probes.a = 1\ntable = [[0, 0], [1, 1.5e3]] # µm\nanything = { x = [1, \"ä\"] }\n\
                    [[t.more]]\nx = 1979-05-27\n";
        let handler = miette::GraphicalReportHandler::new_themed(miette::GraphicalTheme::unicode_nocolor());
        let mut random = Random::new(1);
        let mut next = |limit: usize| random.below(limit);
        let alphabet = b"[]{}=.'\"\n,#-09einfau\xc3\xa4\\ ";
        for round in 0..4000 {
            let mut bytes = text.as_bytes().to_vec();
            for _ in 0..1 + next(4) {
                let at = next(bytes.len());
                match next(4) {
                    0 => bytes[at] ^= 1 << next(8),
                    1 => bytes[at] = alphabet[next(alphabet.len())],
                    2 => drop(bytes.remove(at)),
                    _ => bytes.insert(at, alphabet[next(alphabet.len())]),
                }
            }
            let damaged = String::from_utf8_lossy(&bytes).into_owned();
            let errors = Source::parse("scene.toml", damaged).map(|source| {
                let mut out = Vec::new();
                let read: Option<Move> = read_table(&source, &["t"], &["type", "more"], &mut out);
                assert_eq!(read.is_none(), !out.is_empty());
                source.errors(out)
            });
            let (Ok(errors) | Err(errors)) = errors;
            let _ = errors.plain().to_string();
            if round % 8 == 0 {
                let mut page = String::new();
                handler.render_report(&mut page, &errors).unwrap();
                assert!(!page.contains("Failed to read"), "{page}");
            }
        }
    }
}
