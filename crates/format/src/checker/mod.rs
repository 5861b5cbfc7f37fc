//! Checks the tables of a user against the JSON schema of the parameters. Each mistake is reported with its
//! place.
//!
//! The schema is the one that schemars derives from the parameter struct: meaning, unit, range and default
//! are declared there once. A key that a table's schema does not name is a mistake, even if the struct allows
//! unknown fields. Serde cannot deny them in structs with flattened parts. Names that only serde knows
//! (`alias`) and the schema's `pattern`, `multipleOf` and `uniqueItems` are ignored.

mod form;
#[cfg(test)]
mod tests;
mod words;

use std::borrow::Cow;
use std::fmt;

use schemars::{JsonSchema, Schema, schema_for};
use serde::de::DeserializeOwned;
use serde_json::{Map, Value as Json};

pub(crate) use form::{Form, Forms, Kind, unit};
pub(crate) use words::one_line;

use words::{found, names, number};

use crate::diagnostic::{Diagnostic, Place};
use crate::nearest::nearest;
use crate::plausible::remark;
use crate::source::{Node, Source, Value};

/// Checks a value of the user against a schema. `path` is the value's name in messages, such as
/// `law.parenchyma`; `schema` is a root schema, with its definitions in `$defs`.
///
/// Every mistake goes to `out`. Returns the user's value as JSON, without the parts that have mistakes.
/// Deserialise the value only if there was no mistake.
pub fn check(node: &Node, path: &str, schema: &Schema, out: &mut Vec<Diagnostic>) -> Json {
    check_skipping(node, path, schema, &[], out)
}

/// Reads the table at `path` into its parameter struct; returns `None` after a mistake, which it adds to
/// `out`.
///
/// Keys in `skip` are left to the caller, such as the `type` that chose the struct. A table that the file
/// lacks is read as an empty one: optional keys get their defaults, required keys are reported as missing.
pub(crate) fn read_table<T: DeserializeOwned + JsonSchema>(
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

/// Path from the first value to the value that is being checked.
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
    /// Beginning of messages: "`law.parenchyma`: ".
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

    /// The parameter whose doc comment explains a value: the last key of the path.
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

    /// Checks a value against the alternatives of its kind and keeps the mistakes of the alternative with the
    /// fewest.
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

    /// True if the size of a value is possible; reports impossible and unlikely sizes.
    fn is_possible(
        &mut self,
        node: &Node,
        x: f64,
        positive: bool,
        trail: &Trail<'_>,
        doc: Option<&'s str>,
    ) -> bool {
        // Positions may have any size.
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
        // Limits of 32-bit types are shown only if a value breaks them.
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
        // A wrong length is reported only if no item is wrong.
        if wrong_length && self.out.len() == before {
            let expected = self.forms.phrase(std::slice::from_ref(form), unit(doc));
            let message = format!("{}expected {expected}, found {count}", trail.subject());
            let diagnostic =
                Diagnostic::error(message).at(node.place.clone(), format!("expected {expected}"));
            return self.report(diagnostic.help(trail.explained(doc)));
        }
        values.map(Json::Array)
    }

    /// A table that may be one of several: distinguished by a tag, by its keys, or by the best fit. `words`
    /// could have stood in its place.
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
        let distinct: Vec<Vec<&str>> = forms
            .iter()
            .map(|form| form.properties.iter().map(|(key, _)| *key).filter(|key| !common(key)).collect())
            .collect();
        let told_by_key = forms.iter().zip(&distinct).all(|(form, keys)| match keys.as_slice() {
            [] => true,
            [key] => form.required.contains(key),
            _ => false,
        });
        if told_by_key {
            self.keyed(node, forms, &distinct, words, trail)
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

    /// `distinct` has the keys of each form that not all forms have, at most one for each form.
    fn keyed(
        &mut self,
        node: &Node,
        forms: &[Form<'s>],
        distinct: &[Vec<&'s str>],
        words: &[&str],
        trail: &Trail<'_>,
    ) -> Option<Json> {
        let entries = node.entries();
        let choices: Vec<&'s str> = distinct.iter().flatten().copied().collect();
        let given: Vec<&(String, Node)> =
            entries.iter().filter(|(key, _)| choices.contains(&key.as_str())).collect();
        let exactly = format!("give exactly one of {}", names(&choices));
        match given.as_slice() {
            [(key, _)] => {
                let form = distinct.iter().position(|keys| keys.contains(&key.as_str()))?;
                self.table(node, entries, &forms[form], &[], trail)
            }
            [] => {
                if let Some(form) = distinct.iter().position(Vec::is_empty) {
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

    /// Reports an unknown key and returns the key that was probably meant.
    fn unknown_key(
        &mut self,
        key: &str,
        child: &Node,
        entries: &[(String, Node)],
        form: &Form<'s>,
        others: &[&'s str],
        trail: &Trail<'_>,
    ) -> Option<&'s str> {
        // An option may mean a key that the file already gives, since it replaces the key.
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
