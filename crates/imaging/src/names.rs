//! Names of labels, and the words by which labels are chosen. Names come from the image itself, from tables,
//! or as TotalSegmentator publishes them. Tables are ITK-SNAP's label descriptions, colour tables of
//! FreeSurfer and 3D Slicer, and JSON.

use std::collections::BTreeMap;
use std::convert::Infallible;
use std::fmt;
use std::path::Path;
use std::str::FromStr;

use pliant_geometry::io::read_limited;
use pliant_geometry::{CellLabel, Labels, UnknownLabel};
use serde_json::Value;

use crate::error::{Fault, ImageError, ImageProblem, LabelError};

/// Largest table of names [bytes].
const TABLE_LIMIT: u64 = 1 << 22;

/// Longest name [characters]; the rest is cut.
const LONGEST: usize = 120;

/// The classes of TotalSegmentator v2, task `total`, in their order from 1 (Wasserthal et al. 2023;
/// `class_map` of the program).
const TOTAL_SEGMENTATOR: &str = include_str!("totalsegmentator.txt");

/// Names of labels.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct LabelNames(BTreeMap<i32, String>);

impl LabelNames {
    /// The classes of TotalSegmentator v2, task `total`.
    pub(crate) fn total_segmentator() -> Self {
        let mut names = Self::default();
        (1..).zip(TOTAL_SEGMENTATOR.split_whitespace()).for_each(|(label, name)| names.insert(label, name));
        names
    }

    /// Reads a table of names, or loads the one named `totalsegmentator`. A table holds label descriptions of
    /// ITK-SNAP, or a colour table of FreeSurfer or 3D Slicer. Lines like `5 liver`, or JSON like
    /// `{"5": "liver"}` or `{"labels": {"liver": 5}}` are read, too.
    pub fn read(table: &Path) -> Result<Self, ImageError> {
        if table == Path::new("totalsegmentator") {
            return Ok(Self::total_segmentator());
        }
        let bytes = read_limited(table, TABLE_LIMIT)
            .map_err(|source| ImageError::Open { path: table.to_owned(), source })?;
        Self::of_table(&String::from_utf8_lossy(&bytes)).map_err(|fault| fault.in_file(table))
    }

    /// Reads names from the text of a table.
    pub(crate) fn of_table(text: &str) -> Result<Self, Fault> {
        let text = text.trim_start_matches('\u{feff}');
        let names = if text.trim_start().starts_with('{') { of_json(text)? } else { of_lines(text)? };
        if names.0.is_empty() { Err(no_table("it contains no label name").into()) } else { Ok(names) }
    }

    /// Names a label. Control characters are removed; an empty name is ignored.
    pub fn insert(&mut self, label: i32, name: &str) {
        let clean: String = name.trim().chars().filter(|c| !c.is_control()).take(LONGEST).collect();
        if !clean.is_empty() {
            self.0.insert(label, clean);
        }
    }

    /// The name of a label.
    pub fn get(&self, label: i32) -> Option<&str> {
        self.0.get(&label).map(String::as_str)
    }

    /// The names of some labels, if they have one.
    pub fn of(&self, labels: &[i32]) -> BTreeMap<i32, String> {
        labels.iter().filter_map(|&label| Some((label, self.get(label)?.to_owned()))).collect()
    }

    /// Adds names; they override existing ones.
    pub fn extend(&mut self, others: &Self) {
        self.0.extend(others.0.iter().map(|(label, name)| (*label, name.clone())));
    }

    /// A label with its name, such as `5 (liver)`.
    pub fn shown(&self, label: i32) -> String {
        self.get(label).map_or_else(|| label.to_string(), |name| format!("{label} ({name})"))
    }

    /// The label name of the image most similar to a misspelt one.
    fn nearest(&self, name: &str, present: &[i32]) -> Option<String> {
        let entry = |&label: &i32| (label, self.get(label).map(str::to_owned));
        let known: Labels = present.iter().map(entry).collect();
        match known.find(&CellLabel::Name(name.to_owned())) {
            Err(UnknownLabel::Name { nearest, .. }) => nearest,
            _ => None,
        }
    }

    /// The label of a name, in capitals or not.
    fn named(&self, name: &str, present: &[i32]) -> Result<i32, LabelError> {
        let of = |same: &dyn Fn(&str) -> bool| -> Vec<i32> {
            let matching = self.0.iter().filter(|(_, known)| same(known));
            matching.map(|(&label, _)| label).collect()
        };
        let mut labels = of(&|known| known == name);
        if labels.is_empty() {
            labels = of(&|known| known.eq_ignore_ascii_case(name));
        }
        // A table may give one name to several labels, one of them in the image.
        if labels.len() > 1 {
            let there: Vec<i32> = labels.iter().copied().filter(|label| present.contains(label)).collect();
            labels = if there.is_empty() { labels } else { there };
        }
        match labels[..] {
            [label] => Ok(label),
            [] => Err(LabelError::NoSuchName {
                name: name.to_owned(),
                nearest: self.nearest(name, present),
                names: present
                    .iter()
                    .filter_map(|&label| Some(format!("{} ({label})", self.get(label)?)))
                    .collect(),
            }),
            _ => Err(LabelError::AmbiguousName { name: name.to_owned(), labels }),
        }
    }
}

/// A label, a range of labels, a name or a group, as people type it: `5`, `5-8`, `liver`, `tissue=1,5,7-9`.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum LabelChoice {
    /// A label by its number.
    One(i32),
    /// Labels of the image from one number to another.
    Range(i32, i32),
    /// The label of this name.
    Named(String),
    /// Several labels as one of this name; its number is the number of the first.
    Group(String, Vec<LabelChoice>),
}

impl FromStr for LabelChoice {
    type Err = Infallible;

    fn from_str(typed: &str) -> Result<Self, Infallible> {
        let typed = typed.trim();
        if let Ok(label) = typed.parse() {
            return Ok(Self::One(label));
        }
        if let Some((name, labels)) = typed.split_once('=') {
            let labels = labels.split(',').map(str::parse).collect::<Result<_, _>>()?;
            return Ok(Self::Group(name.trim().to_owned(), labels));
        }
        // The first sign may belong to a negative number.
        let dash = typed.char_indices().skip(1).find(|(_, c)| *c == '-').map(|(at, _)| at);
        let range = dash
            .and_then(|at| Some((typed[..at].trim().parse().ok()?, typed[at + 1..].trim().parse().ok()?)));
        Ok(range.map_or_else(|| Self::Named(typed.to_owned()), |(from, to)| Self::Range(from, to)))
    }
}

impl fmt::Display for LabelChoice {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::One(label) => write!(f, "{label}"),
            Self::Range(from, to) => write!(f, "{from}-{to}"),
            Self::Named(name) => f.write_str(name),
            Self::Group(name, labels) => {
                let labels: Vec<String> = labels.iter().map(Self::to_string).collect();
                write!(f, "{name}={}", labels.join(","))
            }
        }
    }
}

impl LabelChoice {
    /// The labels selected by choices, among the labels `present` in an image; of groups all their labels.
    pub fn resolve(choices: &[Self], names: &LabelNames, present: &[i32]) -> Result<Vec<i32>, LabelError> {
        let mut chosen = Vec::new();
        for choice in choices {
            match choice {
                Self::One(label) => chosen.push(*label),
                Self::Named(name) => chosen.push(names.named(name, present)?),
                Self::Group(_, labels) => chosen.extend(Self::resolve(labels, names, present)?),
                Self::Range(from, to) => {
                    let before = chosen.len();
                    chosen.extend(present.iter().filter(|label| (from..=to).contains(label)));
                    if chosen.len() == before {
                        let (range, present) = (choice.to_string(), present.to_vec());
                        return Err(LabelError::EmptyRange { range, present });
                    }
                }
            }
        }
        Ok(chosen)
    }
}

fn no_table(found: impl Into<String>) -> ImageProblem {
    ImageProblem::NotThisFormat { format: "a table of names of labels", found: found.into() }
}

fn of_json(text: &str) -> Result<LabelNames, Fault> {
    let value: Value = serde_json::from_str(text)
        .map_err(|error| no_table(format!("its JSON is broken ({error})")).at_line(error.line()))?;
    let mut names = LabelNames::default();
    let table = value.get("labels").filter(|labels| labels.is_object()).unwrap_or(&value);
    for (key, value) in table.as_object().into_iter().flatten() {
        match (key.parse(), value) {
            (Ok(label), Value::String(name)) => names.insert(label, name),
            (_, Value::Number(label)) => {
                if let Some(label) = label.as_i64().and_then(|label| label.try_into().ok()) {
                    names.insert(label, key);
                }
            }
            _ => {}
        }
    }
    Ok(names)
}

/// Lines that begin with the label: with the name in quotes at their end (ITK-SNAP), or after the label and
/// before a colour.
fn of_lines(text: &str) -> Result<LabelNames, Fault> {
    let mut names = LabelNames::default();
    for (line, number) in text.lines().zip(1..) {
        let line = line.trim();
        if line.is_empty() || line.starts_with('#') {
            continue;
        }
        let end = line.find(|c: char| c.is_whitespace() || ",:;=".contains(c)).unwrap_or(line.len());
        let rest = line[end..].trim_start_matches(|c: char| c.is_whitespace() || ",:;=".contains(c));
        let Ok(label) = line[..end].parse() else {
            return Err(no_table(format!("line {number} does not start with a label")).at_line(number));
        };
        match rest.split_once('"').and_then(|(_, quoted)| quoted.rsplit_once('"')) {
            Some((name, _)) => names.insert(label, name),
            None => {
                let mut words: Vec<&str> = rest.split_whitespace().collect();
                let colour = words.iter().rev().take_while(|word| word.parse::<f64>().is_ok()).count();
                words.truncate(words.len() - if colour >= 3 { colour.min(4) } else { 0 });
                names.insert(label, &words.join(" "));
            }
        }
    }
    Ok(names)
}

/// The names in a `LabelTable` in XML, as Caret and Connectome Workbench write it into extensions of NIfTI,
/// and TotalSegmentator does.
pub(crate) fn of_xml(text: &str, names: &mut LabelNames) {
    let Some((_, mut rest)) = text.split_once("<LabelTable") else { return };
    while let Some((_, tag)) = rest.split_once("<Label ") {
        let Some((attributes, content)) = tag.split_once('>') else { return };
        let Some((name, after)) = content.split_once("</Label>") else { return };
        let key =
            attributes.split_once("Key=\"").and_then(|(_, key)| key.split_once('"')?.0.trim().parse().ok());
        let plain = name.trim();
        let name =
            plain.strip_prefix("<![CDATA[").and_then(|name| name.strip_suffix("]]>")).map(str::to_owned);
        let unescaped = || {
            let entities = [("&lt;", "<"), ("&gt;", ">"), ("&quot;", "\""), ("&apos;", "'"), ("&amp;", "&")];
            entities.iter().fold(plain.to_owned(), |name, (entity, c)| name.replace(entity, c))
        };
        if let Some(key) = key {
            names.insert(key, &name.unwrap_or_else(unescaped));
        }
        rest = after;
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn table(text: &str) -> LabelNames {
        LabelNames::of_table(text).unwrap_or_else(|fault| panic!("{:?}", fault.problem))
    }

    #[test]
    fn tables_of_all_programs_are_read() {
        let itk_snap = "################\n# ITK-SnAP Label Description File\n# IDX   -R-  -G-  -B-  -A--  VIS MSH  LABEL\n\
                        ################\n    0     0    0    0        0  0  0    \"Clear Label\"\n    5   255    0    0        1  1  1    \"liver, right lobe\"\n";
        let freesurfer = "#No. Label Name:                            R   G   B   A\n\n0   Unknown 0 0 0 0\n5 Left-Inf-Lat-Vent  196 58 250 0\n";
        let slicer =
            "# Color table file seg.ctbl\n# 3 values\n0 Background 0 0 0 0\n5 liver 221 130 101 255\n";
        for (text, name) in [
            (itk_snap, "liver, right lobe"),
            (freesurfer, "Left-Inf-Lat-Vent"),
            (slicer, "liver"),
            ("5 liver\n", "liver"),
            ("5: left kidney 2\r\n", "left kidney 2"),
            ("5,liver\n", "liver"),
            ("{\"5\": \"liver\", \"6\": 7}", "liver"),
            ("{\"name\": \"x\", \"labels\": {\"background\": 0, \"liver\": 5, \"both\": [1, 2]}}", "liver"),
        ] {
            assert_eq!(table(text).get(5), Some(name), "{text}");
        }
        for text in ["", "liver 5\n", "{\"5\": ", "{}", "# nothing\n"] {
            assert!(LabelNames::of_table(text).is_err(), "{text}");
        }
    }

    #[test]
    fn the_classes_of_totalsegmentator_have_their_numbers() {
        let names = LabelNames::total_segmentator();
        assert_eq!(names.of(&[5, 118]), [(5, "liver".to_owned())].into());
        let expected = [
            (1, "spleen"),
            (5, "liver"),
            (20, "colon"),
            (52, "aorta"),
            (90, "brain"),
            (117, "costal_cartilages"),
        ];
        for (label, name) in expected {
            assert_eq!(names.get(label), Some(name));
        }
        assert_eq!(names.get(118), None);
    }

    #[test]
    fn labels_are_chosen_by_number_range_and_name() {
        let names = table("5 Liver\n7 tumour\n8 tumour\n9 left-kidney\n");
        let choose = |typed: &[&str], present: &[i32]| {
            let choices: Vec<LabelChoice> = typed.iter().map(|typed| typed.parse().unwrap()).collect();
            LabelChoice::resolve(&choices, &names, present)
        };
        let present = [-3, 5, 7, 8, 9];
        assert_eq!(choose(&["5-8", "left-kidney", "-3"], &present), Ok(vec![5, 7, 8, 9, -3]));
        assert_eq!(choose(&["liver", "-5--1"], &present), Ok(vec![5, -3]));
        assert_eq!(choose(&["tumour"], &[5, 8]), Ok(vec![8]));
        assert!(matches!(choose(&["tumour"], &present), Err(LabelError::AmbiguousName { .. })));
        assert!(matches!(choose(&["20-30"], &present), Err(LabelError::EmptyRange { .. })));
        let message = choose(&["livr"], &present).unwrap_err().to_string();
        assert!(
            message.starts_with("no label is named `livr`; did you mean `Liver`? (the image has Liver (5)"),
            "{message}"
        );
        let message = choose(&["spleen"], &present).unwrap_err().to_string();
        assert!(message.contains("no label is named `spleen`") && message.contains("Liver (5)"), "{message}");
    }

    #[test]
    fn label_tables_in_xml_are_found_wherever_they_end() {
        let text = "<x><LabelTable><Label Key=\"5\" Red=\"1\"><![CDATA[a & b]]></Label>\n<Label Key=\"6\">c &amp; d</Label></LabelTable>";
        let mut names = LabelNames::default();
        of_xml(text, &mut names);
        assert_eq!((names.get(5), names.get(6)), (Some("a & b"), Some("c & d")));
        for end in 0..text.len() {
            of_xml(&text[..end], &mut LabelNames::default());
        }
    }
}
