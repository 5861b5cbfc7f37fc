//! Makes text from files and names safe for a terminal or a page: codes that a terminal obeys are replaced,
//! long texts are cut.

use std::borrow::Cow;

/// Bytes of a value that a message shows.
const LONGEST: usize = 2000;

/// True for control codes that a terminal obeys, except line ends and tabs, and for marks that change the
/// direction of writing.
fn commands(c: char) -> bool {
    (c.is_control() && !matches!(c, '\n' | '\r' | '\t'))
        || matches!(c, '\u{200e}' | '\u{200f}' | '\u{2028}'..='\u{202e}' | '\u{2066}'..='\u{2069}')
}

/// Replaces every code that a terminal obeys by a visible character of the same length in UTF-8, so that
/// places in the text stay valid.
///
/// ```
/// use pliant_format::printable;
/// assert_eq!(printable("\u{1b}[31mliver\n"), "?[31mliver\n");
/// ```
pub fn printable(text: &str) -> Cow<'_, str> {
    if !text.contains(commands) {
        return Cow::Borrowed(text);
    }
    let visible = |c: char| match c.len_utf8() {
        _ if !commands(c) => c,
        1 => '?',
        2 => '¿',
        _ => '\u{fffd}',
    };
    Cow::Owned(text.chars().map(visible).collect())
}

/// The last border between characters at or before a byte.
pub(crate) fn boundary_before(text: &str, at: usize) -> usize {
    (0..=at.min(text.len())).rev().find(|&at| text.is_char_boundary(at)).unwrap_or(0)
}

/// The first border between characters at or after a byte.
pub(crate) fn boundary_after(text: &str, at: usize) -> usize {
    (at..=text.len()).find(|&at| text.is_char_boundary(at)).unwrap_or(text.len())
}

/// Returns the text without codes that a terminal obeys. A text that is too long for a message is cut, with
/// the number of bytes that follow.
pub(crate) fn shortened(mut text: String) -> String {
    if let Cow::Owned(visible) = printable(&text) {
        text = visible;
    }
    if text.len() > LONGEST {
        let end = boundary_before(&text, LONGEST);
        let left = text[end..].chars().count();
        text.truncate(end);
        text.push_str(&format!(" … ({left} more characters)"));
    }
    text
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn no_code_for_a_terminal_is_left_and_every_byte_keeps_its_place() {
        let text = "a\u{1b}]0;title\u{7}\tb\r\nµ\u{9b}31m\u{202e}gnp.exe\u{7f}\u{0}";
        let shown = printable(text);
        assert_eq!(shown, "a?]0;title?\tb\r\nµ¿31m\u{fffd}gnp.exe??");
        assert_eq!(shown.len(), text.len());
        assert!(matches!(printable("liver µ 1 · ↵\n"), Cow::Borrowed(_)));
    }

    #[test]
    fn long_texts_are_cut_and_say_so() {
        assert_eq!(shortened("µ".repeat(1000)), "µ".repeat(1000));
        let cut = shortened("µ".repeat(5000));
        assert_eq!(cut, format!("{} … (4000 more characters)", "µ".repeat(1000)));
    }
}
