//! XML documents from untrusted files. The reader (roxmltree) takes time that grows with the square of the
//! attributes of an element and of the namespaces. So files with thousands of either are rejected first.

use roxmltree::Document;

/// Limit of attributes per element; real files have ten.
const MOST_ATTRIBUTES: usize = 1000;

/// Limit of namespaces per document; real files declare one.
const MOST_NAMESPACES: usize = 1000;

/// XML that cannot be read.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
#[error("{reason}")]
pub struct XmlError {
    /// The line, from 1.
    pub line: usize,
    /// The problem.
    pub reason: String,
}

/// Reads a document in a time linear in its length.
///
/// # Errors
/// If it is not XML, or has more than 1000 attributes in one element or 1000 namespaces.
pub fn parse_xml(text: &str) -> Result<Document<'_>, XmlError> {
    within_bounds(text)?;
    Document::parse(text)
        .map_err(|error| XmlError { line: error.pos().row as usize, reason: error.to_string() })
}

/// Looks for elements with too many attributes and for too many namespaces.
fn within_bounds(text: &str) -> Result<(), XmlError> {
    let too_many = |at: usize, what: &str, most: usize| XmlError {
        line: text[..at].matches('\n').count() + 1,
        reason: format!("more than {most} {what}; no mesh or model needs that many"),
    };
    let mut namespaces = 0;
    let mut at = 0;
    while let Some(next) = text[at..].find('<') {
        let start = at + next;
        let rest = &text[start..];
        let past = |end: &str| rest.find(end).map_or(text.len(), |length| start + length + end.len());
        at = if rest.starts_with("<!--") {
            past("-->")
        } else if rest.starts_with("<![CDATA[") {
            past("]]>")
        } else {
            let tag = Tag::of(rest);
            namespaces += tag.namespaces;
            if tag.attributes > MOST_ATTRIBUTES {
                return Err(too_many(start, "attributes in one element", MOST_ATTRIBUTES));
            }
            if namespaces > MOST_NAMESPACES {
                return Err(too_many(start, "namespaces", MOST_NAMESPACES));
            }
            start + tag.length
        };
    }
    Ok(())
}

/// The text between a `<` and its `>`.
struct Tag {
    /// Bytes, with both.
    length: usize,
    attributes: usize,
    namespaces: usize,
}

impl Tag {
    /// The tag at the start of a text; an unclosed tag ends with the text.
    fn of(text: &str) -> Self {
        let (mut attributes, mut quote) = (0, None);
        let mut end = text.len();
        for (at, byte) in text.bytes().enumerate() {
            match (byte, quote) {
                (b'>', None) => {
                    end = at + 1;
                    break;
                }
                (b'=', None) => attributes += 1,
                (b'"' | b'\'', None) => quote = Some(byte),
                _ if quote == Some(byte) => quote = None,
                _ => {}
            }
        }
        Self { length: end, attributes, namespaces: text[..end].matches("xmlns").count() }
    }
}

#[cfg(test)]
mod tests {
    use std::time::{Duration, Instant};

    use super::*;

    fn repeated(count: usize, of: impl Fn(usize) -> String) -> String {
        (0..count).map(of).collect()
    }

    /// 200,000 attributes took the reader minutes.
    #[test]
    fn thousands_of_attributes_or_namespaces_are_refused_at_once() {
        let attributes = format!("<a>\n<b {}/></a>", repeated(200_000, |i| format!(" x{i}='1'")));
        let namespaces = format!("<a {}/>", repeated(60_000, |i| format!(" xmlns:n{i}='u{i}'")));
        let nested = repeated(60_000, |i| format!("<a xmlns:n{i}='u{i}'>\n"));
        let began = Instant::now();
        for (text, line, what) in [
            (attributes, 2, "attributes in one element"),
            (namespaces, 1, "attributes"),
            (nested, 1001, "namespaces"),
        ] {
            let error = parse_xml(&text).unwrap_err();
            assert_eq!(error.line, line);
            assert!(error.reason.contains(what), "{error}");
        }
        assert!(began.elapsed() < Duration::from_secs(5), "{:?}", began.elapsed());
    }

    #[test]
    fn signs_in_comments_literals_and_quotes_are_no_attributes() {
        let signs = "=".repeat(5000);
        let text = format!(
            "<?xml version='1.0'?><!-- {signs} > < --><a b='{signs}>' xmlns='u'><![CDATA[<{signs}]]></a>"
        );
        assert_eq!(parse_xml(&text).unwrap().root_element().attribute("b").unwrap().len(), 5001);
    }

    #[test]
    fn what_is_cut_off_is_an_error_with_its_line() {
        for text in ["", "<", "<a", "<a b='", "<!--", "<![CDATA[", "<a>\n<b"] {
            let error = parse_xml(text).unwrap_err();
            assert!(error.line >= 1 && !error.reason.is_empty(), "{text}");
        }
    }
}
