//! Elements of the XML, their attributes and numbers, with the place of every mistake.

use super::error::{Fault, ImportProblem};

/// An element of the XML.
pub(super) type XmlElement<'a> = roxmltree::Node<'a, 'a>;

/// A mistake in an element.
pub(super) fn fault(element: XmlElement<'_>, problem: ImportProblem) -> Fault {
    Fault { line: line(element), element: element.tag_name().name().to_owned(), problem }
}

/// The line at which an element begins, from 1.
pub(super) fn line(of: XmlElement<'_>) -> u32 {
    of.document().text_pos_at(of.range().start).row
}

/// The children of a name, in order.
pub(super) fn children<'a>(of: XmlElement<'a>, name: &'static str) -> impl Iterator<Item = XmlElement<'a>> {
    of.children().filter(move |child| child.has_tag_name(name))
}

/// The first child of a name.
pub(super) fn child<'a>(of: XmlElement<'a>, name: &'static str) -> Option<XmlElement<'a>> {
    children(of, name).next()
}

/// The first child of a name, which must be there.
pub(super) fn needed<'a>(
    of: XmlElement<'a>,
    name: &'static str,
    example: &'static str,
) -> Result<XmlElement<'a>, Fault> {
    child(of, name).ok_or_else(|| fault(of, ImportProblem::MissingElement { wanted: name, example }))
}

/// An attribute, which must be there.
pub(super) fn attribute<'a>(
    of: XmlElement<'a>,
    name: &'static str,
    example: &'static str,
) -> Result<&'a str, Fault> {
    let found = of.attribute(name).map(str::trim);
    found.ok_or_else(|| fault(of, ImportProblem::MissingAttribute { wanted: name, example }))
}

/// The words of an element's own text, without the text of its children.
fn words(of: XmlElement<'_>) -> impl Iterator<Item = &str> {
    let texts = of.children().filter(|child| child.is_text());
    texts.filter_map(|text| text.text()).flat_map(str::split_ascii_whitespace)
}

/// An element's own text in one line.
pub(super) fn text(of: XmlElement<'_>) -> String {
    words(of).collect::<Vec<_>>().join(" ")
}

/// A finite number.
fn real(of: XmlElement<'_>, word: &str) -> Result<f64, Fault> {
    let number = word.parse::<f64>().ok().filter(|number| number.is_finite());
    let problem = || ImportProblem::NotANumber { text: word.to_owned(), wanted: "a number" };
    number.ok_or_else(|| fault(of, problem()))
}

/// The numbers in an element's own text.
pub(super) fn numbers(of: XmlElement<'_>) -> Result<Vec<f64>, Fault> {
    words(of).map(|word| real(of, word)).collect()
}

/// The only number in an element's own text.
pub(super) fn number(of: XmlElement<'_>) -> Result<f64, Fault> {
    numbers_of::<1>(of, "numbers").map(|[number]| number)
}

/// The numbers in an element's own text, which must be `N`.
pub(super) fn numbers_of<const N: usize>(of: XmlElement<'_>, what: &'static str) -> Result<[f64; N], Fault> {
    let found = numbers(of)?;
    let count = found.len();
    let problem = ImportProblem::Count { what, found: count, wanted: N.to_string() };
    found.try_into().map_err(|_| fault(of, problem))
}

/// A number of an attribute.
pub(super) fn attribute_number(of: XmlElement<'_>, word: &str) -> Result<f64, Fault> {
    real(of, word)
}

/// A count in an attribute.
pub(super) fn count(of: XmlElement<'_>, word: &str) -> Result<usize, Fault> {
    let problem = || ImportProblem::NotANumber { text: word.to_owned(), wanted: "a count" };
    word.parse().map_err(|_| fault(of, problem()))
}

/// The indices in an element's own text, each below `limit`.
pub(super) fn indices(of: XmlElement<'_>, kind: &'static str, limit: usize) -> Result<Vec<u32>, Fault> {
    let index = |word: &str| {
        let problem = || ImportProblem::NotANumber { text: word.to_owned(), wanted: "an index" };
        let index: i64 = word.parse().map_err(|_| fault(of, problem()))?;
        let known = u32::try_from(index).ok().filter(|&index| (index as usize) < limit);
        known.ok_or_else(|| fault(of, ImportProblem::NoSuchIndex { of: kind, index, count: limit }))
    };
    words(of).map(index).collect()
}

/// `size` indices listed one by one, or as the first of consecutive ones.
pub(super) fn run_of_indices(
    of: XmlElement<'_>,
    listed: Vec<u32>,
    size: usize,
    kind: &'static str,
    what: &'static str,
    limit: usize,
) -> Result<Vec<u32>, Fault> {
    match listed[..] {
        _ if listed.len() == size => Ok(listed),
        [first] => {
            let end = (first as usize).saturating_add(size);
            if end > limit {
                let index = i64::try_from(end).unwrap_or(i64::MAX) - 1;
                return Err(fault(of, ImportProblem::NoSuchIndex { of: kind, index, count: limit }));
            }
            Ok((first..end as u32).collect())
        }
        _ => Err(fault(of, ImportProblem::Count { what, found: listed.len(), wanted: size.to_string() })),
    }
}

/// True if a child is a switch that is on.
pub(super) fn is_on(of: XmlElement<'_>, name: &'static str) -> bool {
    child(of, name).is_some_and(|switch| !matches!(text(switch).as_str(), "" | "0"))
}
