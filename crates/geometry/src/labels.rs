//! Labels of cells and their names, by which users select regions of a mesh.

use std::collections::BTreeMap;
use std::convert::Infallible;
use std::fmt;
use std::str::FromStr;

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use crate::Mesh;
use crate::surface::labels;

/// Longest name [characters]; the rest is cut.
const LONGEST_NAME: usize = 120;
/// Similarity (Jaro and Winkler) above which a name counts as a misspelling of another.
const ALIKE: f64 = 0.7;

/// A label of cells: its number or its name.
#[derive(Clone, Debug, PartialEq, Eq, PartialOrd, Ord, Deserialize, Serialize, JsonSchema)]
#[serde(untagged)]
pub enum CellLabel {
    /// Its number.
    Number(i32),
    /// Its name in the image or the mesh file, in capitals or not.
    Name(String),
}

impl FromStr for CellLabel {
    type Err = Infallible;

    fn from_str(typed: &str) -> Result<Self, Infallible> {
        let typed = typed.trim();
        Ok(typed.parse().map_or_else(|_| Self::Name(typed.to_owned()), Self::Number))
    }
}

impl From<i32> for CellLabel {
    fn from(label: i32) -> Self {
        Self::Number(label)
    }
}

impl fmt::Display for CellLabel {
    /// Shows the label as a user types it.
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Number(label) => write!(f, "{label}"),
            Self::Name(name) => f.write_str(name),
        }
    }
}

/// A label that cells do not have.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
pub enum UnknownLabel {
    /// No cell has the number, or a number of the range.
    #[error("no cell has label {label}{}", instead(&None, .known))]
    Number {
        /// The requested label.
        label: String,
        /// The labels of the mesh with their names, increasing.
        known: Vec<String>,
    },
    /// No label has the name.
    #[error("no label is named `{name}`{}", instead(.nearest, .known))]
    Name {
        /// The requested name.
        name: String,
        /// The most similar name, if one is similar.
        nearest: Option<String>,
        /// The labels of the mesh with their names, increasing.
        known: Vec<String>,
    },
    /// Neither a label nor a body has the name.
    #[error("nothing that is shown is named `{name}`{}", instead(.nearest, .known))]
    Region {
        /// The requested name.
        name: String,
        /// The most similar name of a body, an obstacle or a tool, if one is similar.
        nearest: Option<String>,
        /// The labels of the mesh with their names, then the names of bodies.
        known: Vec<String>,
    },
    /// Several labels have the name.
    #[error("`{name}` names the labels {}; choose by number", list(.labels))]
    Ambiguous {
        /// The requested name.
        name: String,
        /// Its labels, increasing.
        labels: Vec<i32>,
    },
}

fn list<T: ToString>(items: &[T]) -> String {
    items.iter().map(T::to_string).collect::<Vec<_>>().join(", ")
}

fn instead(nearest: &Option<String>, known: &[String]) -> String {
    match nearest {
        _ if known.is_empty() => ": the mesh has no cell data named `label`".into(),
        Some(name) => format!("; did you mean `{name}`? (the mesh has {})", list(known)),
        None => format!(": the mesh has {}", list(known)),
    }
}

/// The labels of some cells, with their names, if any.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct Labels(BTreeMap<i32, Option<String>>);

impl FromIterator<(i32, Option<String>)> for Labels {
    fn from_iter<T: IntoIterator<Item = (i32, Option<String>)>>(labels: T) -> Self {
        Self(labels.into_iter().collect())
    }
}

impl Labels {
    /// Labels of the body's cells of a mesh.
    pub fn of(mesh: &Mesh) -> Self {
        labels(mesh).into_iter().map(|label| (label, mesh.label_names.get(&label).cloned())).collect()
    }

    /// Adds the labels of another mesh. A label with different names keeps both.
    pub fn join(&mut self, other: Self) {
        for (label, name) in other.0 {
            let names = self.0.entry(label).or_default();
            match (names.as_mut(), name) {
                (Some(names), Some(name)) if !names.split(", ").any(|known| known == name) => {
                    names.push_str(&format!(", {name}"));
                }
                (None, name) => *names = name,
                _ => {}
            }
        }
    }

    /// Removes labels for which `keep` is false.
    pub fn retain(&mut self, keep: impl Fn(i32) -> bool) {
        self.0.retain(|&label, _| keep(label));
    }

    /// Each label with its name, increasing.
    pub fn iter(&self) -> impl ExactSizeIterator<Item = (i32, Option<&str>)> {
        self.0.iter().map(|(&label, name)| (label, name.as_deref()))
    }

    /// Number of labels.
    pub fn len(&self) -> usize {
        self.0.len()
    }

    /// True without any.
    pub fn is_empty(&self) -> bool {
        self.0.is_empty()
    }

    /// A label with its name, such as `5 (liver)`.
    pub fn shown(&self, label: i32) -> String {
        match self.0.get(&label) {
            Some(Some(name)) => format!("{label} ({name})"),
            _ => label.to_string(),
        }
    }

    /// Each label with its name as text, increasing.
    pub fn all_shown(&self) -> Vec<String> {
        self.0.keys().map(|&label| self.shown(label)).collect()
    }

    /// The number of a label.
    ///
    /// # Errors
    /// If no cell has it, or several labels have the name.
    pub fn find(&self, label: &CellLabel) -> Result<i32, UnknownLabel> {
        match label {
            CellLabel::Number(number) if self.0.contains_key(number) => Ok(*number),
            CellLabel::Number(number) => {
                Err(UnknownLabel::Number { label: number.to_string(), known: self.all_shown() })
            }
            CellLabel::Name(name) => self.named(name),
        }
    }

    /// The number of a label, like [`Self::find`]. A text may also be a range of numbers such as `5-8`, which
    /// gives all existing labels in the range.
    ///
    /// # Errors
    /// If no cell has such a label, or several labels have the name.
    pub(crate) fn find_all(&self, label: &CellLabel) -> Result<Vec<i32>, UnknownLabel> {
        let range = match label {
            CellLabel::Name(text) if self.named(text).is_err() => range(text),
            _ => None,
        };
        let Some([from, to]) = range else { return self.find(label).map(|label| vec![label]) };
        let found: Vec<i32> = self.0.keys().copied().filter(|label| (from..=to).contains(label)).collect();
        if found.is_empty() {
            return Err(UnknownLabel::Number { label: format!("{from}-{to}"), known: self.all_shown() });
        }
        Ok(found)
    }

    fn named(&self, name: &str) -> Result<i32, UnknownLabel> {
        let of = |same: &dyn Fn(&str) -> bool| -> Vec<i32> {
            self.iter().filter(|(_, known)| known.is_some_and(same)).map(|(label, _)| label).collect()
        };
        let mut found = of(&|known| known == name);
        if found.is_empty() {
            found = of(&|known| known.eq_ignore_ascii_case(name));
        }
        match (found.len(), name.parse()) {
            (1, _) => Ok(found[0]),
            (0, Ok(number)) => self.find(&CellLabel::Number(number)),
            (0, Err(_)) => {
                let nearest = most_similar(name, self.0.values().flatten());
                Err(UnknownLabel::Name { name: name.to_owned(), nearest, known: self.all_shown() })
            }
            _ => Err(UnknownLabel::Ambiguous { name: name.to_owned(), labels: found }),
        }
    }
}

/// The name that is most similar to another, if one is similar.
pub(crate) fn most_similar<'n>(name: &str, known: impl Iterator<Item = &'n String>) -> Option<String> {
    let similar = known.map(|known| (strsim::jaro_winkler(name, known), known));
    let nearest = similar.filter(|(likeness, _)| *likeness > ALIKE);
    nearest.max_by(|a, b| a.0.total_cmp(&b.0)).map(|(_, known)| known.clone())
}

/// Two numbers with a dash between them; a first sign may belong to a negative number.
fn range(text: &str) -> Option<[i32; 2]> {
    let dash = text.char_indices().skip(1).find(|(_, c)| *c == '-').map(|(at, _)| at)?;
    Some([text[..dash].trim().parse().ok()?, text[dash + 1..].trim().parse().ok()?])
}

/// A name without control characters, and not too long; `None` where nothing is left.
pub(crate) fn clean_name(name: &str) -> Option<String> {
    let clean: String = name.trim().chars().filter(|c| !c.is_control()).take(LONGEST_NAME).collect();
    (!clean.is_empty()).then_some(clean)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::testing::block_of_hexes;
    use crate::{DataArray, Region};

    fn named(names: &[(i32, &str)]) -> Labels {
        let mut mesh = block_of_hexes([4, 1, 1]);
        mesh.blocks[0].data.insert("label".into(), DataArray::scalar(vec![5.0, -2.0, 7.0, 8.0]));
        mesh.label_names = names.iter().map(|&(label, name)| (label, name.to_owned())).collect();
        Labels::of(&mesh)
    }

    fn find(labels: &Labels, text: &str) -> Result<Vec<i32>, String> {
        let label: CellLabel = text.parse().unwrap();
        labels.find_all(&label).map_err(|error| error.to_string())
    }

    #[test]
    fn labels_are_found_by_number_name_and_range() {
        let labels = named(&[(5, "Liver"), (7, "tumour"), (9, "not there"), (-2, "6-7")]);
        for (text, found) in
            [("5", vec![5]), ("-2", vec![-2]), ("liver", vec![5]), ("tumour", vec![7]), ("7-9", vec![7, 8])]
        {
            assert_eq!(find(&labels, text), Ok(found), "{text}");
        }
        assert_eq!(find(&labels, "6-7"), Ok(vec![-2]), "a name comes before a range");
        assert_eq!(find(&labels, "-3--1"), Ok(vec![-2]));
    }

    #[test]
    fn an_unknown_label_comes_with_those_there_are() {
        let labels = named(&[(5, "liver"), (7, "vein"), (8, "vein")]);
        let message = find(&labels, "livr").unwrap_err();
        let listing = "the mesh has -2, 5 (liver), 7 (vein), 8 (vein)";
        assert_eq!(message, format!("no label is named `livr`; did you mean `liver`? ({listing})"));
        assert_eq!(find(&labels, "6").unwrap_err(), format!("no cell has label 6: {listing}"));
        assert_eq!(find(&labels, "20-30").unwrap_err(), format!("no cell has label 20-30: {listing}"));
        assert!(find(&labels, "vein").unwrap_err().contains("the labels 7, 8; choose by number"));
        let none = find(&Labels::default(), "liver").unwrap_err();
        assert!(none.ends_with("the mesh has no cell data named `label`"), "{none}");
    }

    #[test]
    fn dropped_labels_leave_their_neighbours_and_all_points() {
        let mut mesh = block_of_hexes([4, 1, 1]);
        mesh.blocks[0].data.insert("label".into(), DataArray::scalar(vec![5.0, 7.0, 7.0, 8.0]));
        mesh.blocks[0].sets.insert("ends".into(), vec![0, 3]);
        let points = mesh.points.clone();
        let last = mesh.blocks[0].cell(3).to_vec();
        mesh.drop_regions(&[7, 9].map(Region::Label));
        assert_eq!((mesh.blocks[0].len(), &mesh.points), (2, &points));
        assert_eq!((mesh.blocks[0].cell(1), &mesh.blocks[0].sets["ends"]), (&last[..], &vec![0, 1]));
        assert_eq!(Labels::of(&mesh).all_shown(), ["5", "8"]);
    }

    #[test]
    fn a_label_with_two_names_keeps_both() {
        let mut labels = named(&[(5, "liver")]);
        labels.join(named(&[(5, "spleen"), (7, "vein")]));
        labels.join(named(&[(5, "liver")]));
        assert_eq!(labels.all_shown(), ["-2", "5 (liver, spleen)", "7 (vein)", "8"]);
    }
}
