//! The text of a scene with the place of every key and value, so that each mistake is shown at its place.
//!
//! TOML is read with the `toml` crate's spanned tree. The tree here owns its text and keeps the order of the
//! file. It also takes values from the command line, which have no place in the file.

use std::collections::BTreeMap;
use std::ops::Range;
use std::sync::Arc;

use pliant_geometry::Mesh;
use pliant_imaging::Image;
use toml::Spanned;
use toml::de::{DeTable, DeValue};

use crate::diagnostic::{Diagnostic, Place, SceneErrors};
use crate::foreign::foreign_text;
use crate::nearest::nearest;
use crate::reads::Reads;

/// Most syntax errors shown of one file: later errors are often consequences of the first.
const MOST_SYNTAX_ERRORS: usize = 5;
/// The end of the message about a key that stands twice in the file.
const GIVEN_TWICE: &str = "is given twice";

/// A scene's text and the tree of its values.
#[derive(Clone, Debug)]
pub struct Source {
    name: String,
    text: Arc<str>,
    root: Node,
    assignments: Vec<String>,
    reads: Reads,
    given: Given,
}

/// Meshes and images of the program that reads a scene, by the names that its tables call them.
#[derive(Clone, Debug, Default)]
pub struct Given {
    /// Meshes of bodies: `mesh = { given = "NAME" }`.
    pub meshes: BTreeMap<String, Arc<Mesh>>,
    /// In place of the file of this name wherever a scene names an image: `image = "NAME"`.
    pub images: BTreeMap<String, Arc<Image>>,
}

/// Option that the user types before an assignment.
pub const SET: &str = "--set ";

/// Kinds of tables that hold tables with names of the user's choice.
const NAMED: [&str; 8] = ["participant", "law", "body", "tie", "surface", "constraint", "load", "output"];

/// A value and where it was given.
#[derive(Clone, Debug)]
pub struct Node {
    /// Place of the value: its own text, or the header `[law.liver]` of a table that has one.
    pub place: Place,
    /// Place of its key, in the same text as the value. `None` for items of arrays, the root, and values from
    /// an option with a meaning of its own.
    pub key_span: Option<Range<usize>>,
    /// The value.
    pub value: Value,
}

/// A value of a scene.
#[derive(Clone, Debug)]
pub enum Value {
    /// Keys with their values, in the order of the file.
    Table(Vec<(String, Node)>),
    /// Items in order.
    Array(Vec<Node>),
    /// A text.
    String(String),
    /// A whole number.
    Integer(i64),
    /// A number with a point or an exponent; may be `nan` or `inf`, which TOML has words for.
    Float(f64),
    /// `true` or `false`.
    Boolean(bool),
    /// A date or time, as written.
    Datetime(String),
}

impl From<f64> for Value {
    fn from(number: f64) -> Self {
        Value::Float(number)
    }
}

impl From<i64> for Value {
    fn from(number: i64) -> Self {
        Value::Integer(number)
    }
}

impl From<bool> for Value {
    fn from(truth: bool) -> Self {
        Value::Boolean(truth)
    }
}

impl From<&str> for Value {
    fn from(text: &str) -> Self {
        Value::String(text.to_owned())
    }
}

impl From<String> for Value {
    fn from(text: String) -> Self {
        Value::String(text)
    }
}

impl Node {
    /// Makes a value of the command line.
    fn of_command_line(value: Value) -> Self {
        let value = match value {
            Value::Table(entries) => Value::Table(
                entries.into_iter().map(|(key, node)| (key, Node::of_command_line(node.value))).collect(),
            ),
            Value::Array(items) => {
                Value::Array(items.into_iter().map(|node| Node::of_command_line(node.value)).collect())
            }
            plain => plain,
        };
        Self { place: Place::CommandLine, key_span: None, value }
    }

    /// A value of an option that is shown as typed, from its place in the part after [`SET`].
    fn of_option(self, text: &Arc<str>) -> Self {
        let shift = |span: Range<usize>| span.start + SET.len()..span.end + SET.len();
        let place = match self.place {
            Place::File(span) => Place::Option(text.clone(), shift(span)),
            other => other,
        };
        let value = match self.value {
            Value::Table(entries) => {
                Value::Table(entries.into_iter().map(|(key, node)| (key, node.of_option(text))).collect())
            }
            Value::Array(items) => Value::Array(items.into_iter().map(|n| n.of_option(text)).collect()),
            plain => plain,
        };
        Self { place, key_span: self.key_span.map(shift), value }
    }

    /// The entry of a table, or the item of an array whose index is `key` in decimal.
    pub fn get(&self, key: &str) -> Option<&Node> {
        match &self.value {
            Value::Table(entries) => entries.iter().find(|(name, _)| name == key).map(|(_, node)| node),
            Value::Array(items) => items.get(key.parse::<usize>().ok()?),
            _ => None,
        }
    }

    /// The place of the first part that an option set.
    fn set_part(&self) -> Option<&Place> {
        match (&self.place, &self.value) {
            (Place::Option(..), _) => Some(&self.place),
            (_, Value::Table(entries)) => entries.iter().find_map(|(_, node)| node.set_part()),
            (_, Value::Array(items)) => items.iter().find_map(Node::set_part),
            _ => None,
        }
    }

    fn get_mut(&mut self, key: &str) -> Option<&mut Node> {
        match &mut self.value {
            Value::Table(entries) => entries.iter_mut().find(|(name, _)| name == key).map(|(_, node)| node),
            Value::Array(items) => items.get_mut(key.parse::<usize>().ok()?),
            _ => None,
        }
    }

    /// The keys of a table with their values, in the order of the file; nothing for other values.
    pub fn entries(&self) -> &[(String, Node)] {
        match &self.value {
            Value::Table(entries) => entries,
            _ => &[],
        }
    }

    /// The text, if the value is one.
    pub fn as_str(&self) -> Option<&str> {
        match &self.value {
            Value::String(text) => Some(text),
            _ => None,
        }
    }

    /// Place of the key, or of the value if it has no key.
    pub(crate) fn key_place(&self) -> Place {
        match &self.key_span {
            Some(span) => match &self.place {
                Place::Option(text, _) => Place::Option(text.clone(), span.clone()),
                _ => Place::File(span.clone()),
            },
            None => self.place.clone(),
        }
    }
}

impl Source {
    /// Reads TOML; `name` is shown to the user, mostly the path of the file.
    pub fn parse(name: impl Into<String>, text: impl Into<Arc<str>>) -> Result<Self, SceneErrors> {
        let (name, text) = (name.into(), text.into());
        if let Some([what, help]) = foreign_text(&text) {
            let start = text.len() - text.trim_start_matches('\u{feff}').trim_start().len();
            let message = format!("this is {what}, not a scene in TOML");
            let diagnostic = Diagnostic::error(message).at(start..start + 1, "XML begins here").help(help);
            return Err(SceneErrors::new(name, text, vec![diagnostic]));
        }
        let (table, errors) = DeTable::parse_recoverable(&text);
        let mut diagnostics = Vec::new();
        for error in &errors {
            let diagnostic = syntax_error(error, &text);
            let line = |span: &Option<Range<usize>>| {
                span.as_ref().map(|span| text.bytes().take(span.start).filter(|&byte| byte == b'\n').count())
            };
            let known = |other: &Diagnostic| {
                line(&other.span) == line(&diagnostic.span) || repeats_table(other, &diagnostic, &text)
            };
            if diagnostics.len() < MOST_SYNTAX_ERRORS && !diagnostics.iter().any(known) {
                diagnostics.push(diagnostic);
            }
        }
        // The tree of a text with syntax errors is a guess, and so are mistakes in its numbers.
        let value = diagnostics.is_empty().then(|| table_value(table.get_ref(), &mut diagnostics));
        drop(table);
        match value {
            Some(value) if diagnostics.is_empty() => Ok(Self {
                name,
                text,
                root: Node { place: Place::File(0..0), key_span: None, value },
                assignments: Vec::new(),
                reads: Reads::anywhere(),
                given: Given::default(),
            }),
            _ => Err(SceneErrors::new(name, text, diagnostics)),
        }
    }

    /// Restricts the files that the scene may read.
    pub fn reading(self, reads: Reads) -> Self {
        Self { reads, ..self }
    }

    /// Sets the meshes and images that the calling program gives.
    pub fn giving(self, given: Given) -> Self {
        Self { given, ..self }
    }

    /// The meshes and images that the program gives.
    pub fn given(&self) -> &Given {
        &self.given
    }

    /// The files that the scene may read.
    pub fn reads(&self) -> &Reads {
        &self.reads
    }

    /// The name that is shown to the user.
    pub fn name(&self) -> &str {
        &self.name
    }

    /// The text of the file.
    pub fn text(&self) -> &str {
        &self.text
    }

    /// The table of the whole file.
    pub fn root(&self) -> &Node {
        &self.root
    }

    /// The value at a path of keys; an item of an array has its index in decimal as its key.
    pub fn node(&self, path: &[&str]) -> Option<&Node> {
        path.iter().try_fold(&self.root, |node, key| node.get(key))
    }

    /// Returns the path, joined by points, of the smallest value or table header whose text or key contains a
    /// byte; `None` if there is no such value.
    pub fn key_at(&self, byte: usize) -> Option<String> {
        fn smallest(node: &Node, path: &str, byte: usize, found: &mut Option<(usize, String)>) {
            let value_span = if let Place::File(span) = &node.place { Some(span) } else { None };
            for span in value_span.into_iter().chain(&node.key_span) {
                let is_smaller = found.as_ref().is_none_or(|(length, _)| span.len() <= *length);
                if span.contains(&byte) && is_smaller && !path.is_empty() {
                    *found = Some((span.len(), path.to_owned()));
                }
            }
            let join = |key: &str| if path.is_empty() { key.to_owned() } else { format!("{path}.{key}") };
            node.entries().iter().for_each(|(key, node)| smallest(node, &join(key), byte, found));
            if let Value::Array(items) = &node.value {
                items
                    .iter()
                    .enumerate()
                    .for_each(|(index, node)| smallest(node, &join(&index.to_string()), byte, found));
            }
        }
        let mut found = None;
        smallest(&self.root, "", byte, &mut found);
        found.map(|(_, key)| key)
    }

    /// Place of the value at a path; for a missing value, the header or key of the nearest table around it.
    /// If an option set a part of a value within a line, the place of that part.
    pub fn span(&self, path: &[&str]) -> Place {
        match self.node(path) {
            Some(node) if self.is_header(node) => node.place.clone(),
            Some(node) => node.set_part().unwrap_or(&node.place).clone(),
            None => self.around(path),
        }
    }

    fn is_header(&self, node: &Node) -> bool {
        let Place::File(span) = &node.place else { return false };
        matches!(node.value, Value::Table(_))
            && self.text.get(span.clone()).is_some_and(|text| text.starts_with('['))
    }

    /// Place of the key at a path; for a missing key, the header or key of the nearest table around it.
    pub fn key_span(&self, path: &[&str]) -> Place {
        match self.node(path) {
            Some(node) => node.key_place(),
            None => self.around(path),
        }
    }

    fn around(&self, path: &[&str]) -> Place {
        let mut node = &self.root;
        for key in path {
            match node.get(key) {
                Some(child) => node = child,
                None => break,
            }
        }
        match &node.place {
            Place::File(span) if self.text.get(span.clone()).is_some_and(|text| text.starts_with('[')) => {
                if matches!(node.value, Value::Table(_)) { node.place.clone() } else { node.key_place() }
            }
            _ => node.key_place(),
        }
    }

    /// Replaces a value of the file by one of the command line; missing tables on the path are made.
    /// Diagnostics about the value say that it was given on the command line. The error says why the path is
    /// impossible.
    pub fn set(&mut self, path: &[&str], value: impl Into<Value>) -> Result<(), Box<Diagnostic>> {
        let steps: Vec<_> = path.iter().map(|key| ((*key).to_owned(), Place::CommandLine)).collect();
        self.put(&steps, Node::of_command_line(value.into()))
    }

    /// Takes an assignment in TOML, as `--set "law.liver.shear-modulus = 2e3"` gives it; a single word on the
    /// right needs no quotes. An item of an array has its index, counted from 0, as its key.
    ///
    /// Diagnostics about the value, here and later, underline the assignment.
    ///
    /// # Errors
    /// If it is no assignment, was made before, or has an impossible path.
    pub fn assign(&mut self, assignment: &str) -> Result<(), Box<Diagnostic>> {
        let text: Arc<str> = format!("{SET}{assignment}").into();
        let (path, node) = parse_assignment(assignment, &text)?;
        let place = |depth: usize| path[depth].1.clone();
        let key = path.iter().map(|step| step.0.as_str()).collect::<Vec<_>>();
        let kind = NAMED.iter().find(|kind| key.first() == Some(*kind));
        if let (Some(kind), [_, name, _, ..]) = (kind, key.as_slice())
            && self.node(&key[..2]).is_none()
        {
            let known: Vec<&str> =
                self.node(&key[..1]).map_or(&[][..], Node::entries).iter().map(|(n, _)| n.as_str()).collect();
            let list = known.iter().map(|name| format!("`{name}`")).collect::<Vec<_>>().join(", ");
            let help = match nearest(name, known.iter().copied()) {
                Some(near) => format!("did you mean `{near}`?"),
                None if known.is_empty() => format!("the scene has no table `[{kind}.NAME]`"),
                None => format!("the scene has {list}"),
            };
            let message = format!("the scene has no {kind} `{name}`");
            return Err(Box::new(Diagnostic::error(message).at(place(1), "no such table").help(help)));
        }
        let last = path.len() - 1;
        if let Some(Place::Option(before, _)) = self.node(&key).map(|node| &node.place) {
            let message = format!("`{}` is set twice", key.join("."));
            let help = format!("it is set by `{before}`, too; remove one of the two");
            return Err(Box::new(Diagnostic::error(message).at(place(last), "set again").help(help)));
        }
        self.put(&path, node)?;
        self.assignments.push(assignment.to_owned());
        Ok(())
    }

    /// The assignments taken, as typed.
    pub fn assignments(&self) -> &[String] {
        &self.assignments
    }

    /// Puts a value at a path of keys, each with its place; missing tables on the path are made.
    fn put(&mut self, path: &[(String, Place)], value: Node) -> Result<(), Box<Diagnostic>> {
        let mut node = &mut self.root;
        for (depth, (key, place)) in path.iter().enumerate() {
            if node.get(key).is_none() {
                match &mut node.value {
                    Value::Table(entries) => {
                        let key_span = match place {
                            Place::Option(_, span) => Some(span.clone()),
                            _ => None,
                        };
                        let made = Node { place: place.clone(), key_span, value: Value::Table(Vec::new()) };
                        entries.push((key.clone(), made));
                    }
                    Value::Array(items) => return Err(no_such_item(path, depth, items.len())),
                    _ => return Err(no_table(path, depth)),
                }
            }
            node = match node.get_mut(key) {
                Some(child) => child,
                None => return Err(no_table(path, depth)),
            };
        }
        *node = value;
        Ok(())
    }

    /// Diagnostics about this scene together with its text, ready to print.
    pub fn errors(&self, diagnostics: Vec<Diagnostic>) -> SceneErrors {
        SceneErrors::new(self.name.clone(), self.text.clone(), diagnostics)
    }
}

/// The keys of an assignment with their places, and its value.
type Assigned = (Vec<(String, Place)>, Node);

/// Reads the part of `text` after [`SET`].
fn parse_assignment(assignment: &str, text: &Arc<str>) -> Result<Assigned, Box<Diagnostic>> {
    let whole = || Place::Option(text.clone(), SET.len()..text.len());
    let refused = |why: &str, place: Place| {
        let help = "write key=value, such as run.threads=2 or law.tissue.young-modulus=4e3; a text with spaces or signs \
                    needs quotes within quotes: 'scene.title=\"a liver\"'";
        let message = format!("`{assignment}` is not an assignment: {why}");
        Box::new(Diagnostic::error(message).at(place, "").help(help))
    };
    if assignment.contains('\n') {
        return Err(refused("it must be one line", whole()));
    }
    let (quoted, mut word) = (&mut String::new(), None);
    let table = match (DeTable::parse(assignment), assignment.split_once('=')) {
        (Ok(table), _) => table,
        (Err(error), Some((path, right))) if is_word(right.trim()) => {
            let start = assignment.len() - right.trim_start().len();
            word = Some(start..start + right.trim().len());
            *quoted = format!("{path}= {}", serde_json::Value::from(right.trim()));
            DeTable::parse(quoted).map_err(|_| refused(error.message(), whole()))?
        }
        (Err(error), _) => {
            let place = match error.span() {
                Some(span) => Place::Option(text.clone(), span.start + SET.len()..span.end + SET.len()),
                None => whole(),
            };
            return Err(refused(error.message(), place));
        }
    };
    let mut diagnostics = Vec::new();
    let Value::Table(entries) = table_value(table.get_ref(), &mut diagnostics) else {
        return Err(refused("it must set one value", whole()));
    };
    if let Some(mut diagnostic) = diagnostics.pop() {
        let span = diagnostic.span.take().map(|span| span.start + SET.len()..span.end + SET.len());
        let place = span.map_or_else(whole, |span| Place::Option(text.clone(), span));
        let label = std::mem::take(&mut diagnostic.label);
        return Err(Box::new(diagnostic.at(place, label)));
    }
    let (mut path, mut node) =
        (Vec::new(), Node { place: whole(), key_span: None, value: Value::Table(entries) });
    // A dotted key is a chain of tables whose place is their own key; `{ a = 1 }` is a value.
    while path.is_empty() || Some(&node.place) == node.key_span.clone().map(Place::File).as_ref() {
        let Value::Table(entries) = &mut node.value else { break };
        let (Some((key, child)), true) = (entries.pop(), entries.is_empty()) else {
            return Err(refused("it must set one value", whole()));
        };
        path.push((key, child.clone().of_option(text).key_place()));
        node = child;
    }
    if let Some(word) = word {
        node.place = Place::File(word);
    }
    Ok((path, node.of_option(text)))
}

fn joined(path: &[(String, Place)]) -> String {
    path.iter().map(|step| step.0.as_str()).collect::<Vec<_>>().join(".")
}

fn no_table(path: &[(String, Place)], depth: usize) -> Box<Diagnostic> {
    let (whole, leaf) = (joined(path), joined(&path[..depth]));
    let message = format!("`{whole}` cannot be set: `{leaf}` is not a table");
    Box::new(Diagnostic::error(message).at(path[depth].1.clone(), "not inside a table"))
}

fn no_such_item(path: &[(String, Place)], depth: usize, len: usize) -> Box<Diagnostic> {
    let (whole, array) = (joined(path), joined(&path[..depth]));
    let message = format!("`{whole}` cannot be set: the array `{array}` has {len} items");
    let diagnostic = Diagnostic::error(message).at(path[depth].1.clone(), "no such item");
    Box::new(diagnostic.help("items are counted from 0"))
}

/// True if a text can stand without quotes in an assignment of the command line.
fn is_word(text: &str) -> bool {
    text.starts_with(|c: char| c.is_alphabetic() || "/.~_".contains(c)) && !text.contains(['"', '\'', '\n'])
}

fn table_value(table: &DeTable<'_>, diagnostics: &mut Vec<Diagnostic>) -> Value {
    let mut entries: Vec<(String, Node)> = table
        .iter()
        .map(|(key, value)| (key.get_ref().to_string(), node_of(value, Some(key.span()), diagnostics)))
        .collect();
    entries.sort_by_key(|(_, node)| node.key_span.as_ref().map(|span| span.start));
    Value::Table(entries)
}

fn node_of(
    value: &Spanned<DeValue<'_>>,
    key_span: Option<Range<usize>>,
    diagnostics: &mut Vec<Diagnostic>,
) -> Node {
    let span = value.span();
    let mut too_large = |what: &str, help: &str| {
        diagnostics.push(Diagnostic::error(what).at(span.clone(), "this number").help(help));
    };
    let owned = match value.get_ref() {
        DeValue::String(text) => Value::String(text.to_string()),
        DeValue::Integer(integer) => match i64::from_str_radix(integer.as_str(), integer.radix()) {
            Ok(number) => Value::Integer(number),
            Err(_) => {
                too_large(
                    "this whole number has more digits than 64 bits hold",
                    "write it with an exponent: 1e20",
                );
                Value::Integer(0)
            }
        },
        DeValue::Float(float) => match float.as_str().parse::<f64>() {
            Ok(number) if number.is_infinite() && !float.as_str().contains("inf") => {
                too_large(
                    "this number is larger than 64-bit floating point holds",
                    "the largest is 1.797e308",
                );
                Value::Float(0.0)
            }
            Ok(number) => Value::Float(number),
            Err(_) => {
                too_large("this number cannot be read", "");
                Value::Float(0.0)
            }
        },
        DeValue::Boolean(truth) => Value::Boolean(*truth),
        DeValue::Datetime(time) => Value::Datetime(time.to_string()),
        DeValue::Array(items) => {
            Value::Array(items.iter().map(|item| node_of(item, None, diagnostics)).collect())
        }
        DeValue::Table(table) => table_value(table, diagnostics),
    };
    Node { place: Place::File(span), key_span, value: owned }
}

/// True if a key is given twice only because its table is given twice.
fn repeats_table(table: &Diagnostic, key: &Diagnostic, text: &str) -> bool {
    let twice = |diagnostic: &Diagnostic| diagnostic.message.ends_with(GIVEN_TWICE);
    let (Some(header), Some(repeated)) = (&table.span, &key.span) else { return false };
    let line_start = text[..header.start].rfind('\n').map_or(0, |at| at + 1);
    let within = text.get(line_start..repeated.start).unwrap_or_default();
    let headers = within.lines().filter(|line| line.trim_start().starts_with('[')).count();
    twice(table) && twice(key) && within.trim_start().starts_with('[') && headers == 1
}

fn syntax_error(error: &toml::de::Error, text: &str) -> Diagnostic {
    let span = error.span().unwrap_or(text.len()..text.len());
    let found = text.get(span.clone()).unwrap_or_default();
    let before = text.get(..span.start).unwrap_or_default();
    let after = text.get(span.end..).unwrap_or_default();
    let message = error.message();
    if message.starts_with("duplicate key") {
        return Diagnostic::error(format!("`{found}` {GIVEN_TWICE}"))
            .at(span, "given a second time")
            .help("a key or table can be given once; rename or remove one of the two");
    }
    let value_expected =
        ["string values must be quoted", "invalid boolean"].iter().any(|m| message.starts_with(m));
    if value_expected && found.is_empty() {
        return Diagnostic::error("a value is missing").at(span, "expected a value here");
    }
    let word = match value_expected && found.chars().all(is_of_word) {
        true => Some((found, span.clone())),
        false => unquoted(text, span.start),
    };
    if let Some((word, at)) = word {
        return Diagnostic::error(format!("`{word}` is not a value"))
            .at(at, "a text needs quotes")
            .help(format!("write \"{word}\""));
    }
    let diagnostic = Diagnostic::error(format!("not valid TOML: {message}")).at(span, "here");
    let (digit_before, digit_after) = (
        before.ends_with(|c: char| c.is_ascii_digit()),
        after.trim_start_matches('.').starts_with(|c: char| c.is_ascii_digit()),
    );
    if message.starts_with("unexpected key or value")
        && digit_before
        && format!("{found}{after}").starts_with(',')
    {
        diagnostic.help("decimals are written with a point: 3.5")
    } else if message.starts_with("invalid mantissa") && digit_after {
        diagnostic.help("write a digit before the point: 0.5")
    } else if message.starts_with("invalid fraction") {
        diagnostic.help("write a digit after the point: 5.0")
    } else if breaks_in_escape(before, found) {
        diagnostic.help(
            "in \"…\" a backslash begins an escape: write a path in single quotes, 'C:\\mesh.msh', or with /",
        )
    } else if value_expected {
        diagnostic.help("a value is a number, true, false, a text in quotes, an [array] or a { table }")
    } else {
        diagnostic
    }
}

/// True for the characters of words, file names and numbers.
fn is_of_word(c: char) -> bool {
    c.is_alphanumeric() || "-_./".contains(c)
}

/// A word without quotes that is the whole value of the line with a mistake, and its place.
fn unquoted(text: &str, at: usize) -> Option<(&str, Range<usize>)> {
    let start = text.get(..at)?.rfind('\n').map_or(0, |end| end + 1);
    let line = text[start..].lines().next()?;
    let (key, value) = line.split_once('=')?;
    let word = value.split('#').next()?.trim();
    let is_word = word.starts_with(char::is_alphabetic) && word.chars().all(is_of_word);
    let begin = start + key.len() + 1 + value.find(word)?;
    (is_word && at >= begin && !["true", "false", "inf", "nan"].contains(&word))
        .then(|| (word, begin..begin + word.len()))
}

/// True if the text breaks off in an escape of a text in double quotes.
fn breaks_in_escape(before: &str, found: &str) -> bool {
    let line = before.rsplit('\n').next().unwrap_or_default();
    let quoted = line.rsplit('"').next().unwrap_or_default();
    line.matches('"').count() % 2 == 1 && (quoted.contains('\\') || found.contains('\\'))
}

#[cfg(test)]
mod tests;
