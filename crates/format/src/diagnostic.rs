//! Errors and warnings about a scene: each has a message, its place in the user's own file, and a remedy.
//!
//! All mistakes of a file are collected; the first [`MOST_SHOWN`] are shown together. A command line prints
//! [`SceneErrors`] through miette's graphical handler, which underlines the lines. [`SceneErrors::plain`]
//! prints one mistake a line. Control codes of terminals are removed, and long lines and values are
//! shortened.

use std::borrow::Cow;
use std::fmt;
use std::ops::Range;
use std::sync::Arc;

use miette::{
    LabeledSpan, MietteError, MietteSpanContents, NamedSource, SourceCode, SourceSpan, SpanContents,
};
use pliant_geometry::words::counted;

use crate::printable::{boundary_after, boundary_before, printable, shortened};

/// Mistakes that are shown of one scene; the others are counted.
pub const MOST_SHOWN: usize = 20;

/// Bytes of one place that are underlined.
const LONGEST_PLACE: usize = 200;

/// Bytes of the user's text that are shown before and after a place.
const REACH: usize = 200;

/// The severity of a [`Diagnostic`].
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Severity {
    /// The scene cannot run.
    Error,
    /// The scene runs, but perhaps not as meant.
    Warning,
}

/// Place where a value of a scene was given.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum Place {
    /// In the scene file, these bytes of its text.
    File(Range<usize>),
    /// In an option of the command with a meaning of its own, such as `--until`; there is no line to show.
    CommandLine,
    /// In an option of the command that is shown as it was typed: these bytes of its text.
    Option(Arc<str>, Range<usize>),
}

impl From<Range<usize>> for Place {
    fn from(span: Range<usize>) -> Self {
        Place::File(span)
    }
}

/// One error or warning about a scene.
///
/// ```
/// use pliant_format::diagnostic::Diagnostic;
/// let diagnostic = Diagnostic::error("unknown law `parenchima`")
///     .at(41..53, "no [law.parenchima] in this file")
///     .help("did you mean `parenchyma`?");
/// assert_eq!(diagnostic.span, Some(41..53));
/// ```
#[derive(Clone, Debug, PartialEq, Eq)]
#[non_exhaustive]
pub struct Diagnostic {
    /// Error or warning.
    pub severity: Severity,
    /// Description of the mistake, with its number; makes sense without the label.
    pub message: String,
    /// The bytes to underline in the scene's text, or in `option`; none where there is no such place.
    pub span: Option<Range<usize>>,
    /// The option of the command that it is about, as typed; none for the scene's own text.
    pub option: Option<Arc<str>>,
    /// Note under the underlined text.
    pub label: String,
    /// Advice to the user.
    pub help: Option<String>,
    /// Other places of the mistake, each with its label.
    pub also: Vec<(Range<usize>, String)>,
}

impl Diagnostic {
    fn new(severity: Severity, message: String) -> Self {
        Self {
            severity,
            message,
            span: None,
            option: None,
            label: String::new(),
            help: None,
            also: Vec::new(),
        }
    }

    /// A mistake that keeps the scene from running.
    pub fn error(message: impl Into<String>) -> Self {
        Self::new(Severity::Error, message.into())
    }

    /// A warning: the scene can run.
    pub fn warning(message: impl Into<String>) -> Self {
        Self::new(Severity::Warning, message.into())
    }

    /// Underlines a place and writes `label` under it. For a value given on the command line the message says
    /// so instead.
    pub fn at(mut self, place: impl Into<Place>, label: impl Into<String>) -> Self {
        match place.into() {
            Place::File(span) => {
                self.span = Some(span);
                self.label = label.into();
            }
            Place::Option(text, span) => {
                self.option = Some(text);
                self.span = Some(span);
                self.label = label.into();
            }
            Place::CommandLine => self.message.push_str(" (given on the command line)"),
        }
        self
    }

    /// Underlines a further place.
    pub fn also(self, place: impl Into<Place>, label: impl Into<String>) -> Self {
        match place.into() {
            // Lines of the file can't be shown in an option.
            Place::File(_) if self.option.is_some() => self,
            Place::File(span) => {
                let mut diagnostic = self;
                diagnostic.also.push((span, label.into()));
                diagnostic
            }
            Place::CommandLine => self.help(format!("{} (on the command line)", label.into())),
            Place::Option(text, _) => self.help(format!("{} (`{text}`)", label.into())),
        }
    }

    /// Adds a line of advice.
    pub fn help(mut self, advice: impl Into<String>) -> Self {
        let advice = advice.into();
        match &mut self.help {
            _ if advice.is_empty() => {}
            Some(help) => {
                help.push('\n');
                help.push_str(&advice);
            }
            None => self.help = Some(advice),
        }
        self
    }

    /// True if this keeps the scene from running.
    pub fn is_error(&self) -> bool {
        self.severity == Severity::Error
    }
}

impl fmt::Display for Diagnostic {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(&self.message)
    }
}

impl std::error::Error for Diagnostic {}

/// The source text comes from the [`SceneErrors`] that the diagnostic is shown with, unless it is about an
/// option.
impl miette::Diagnostic for Diagnostic {
    fn source_code(&self) -> Option<&dyn SourceCode> {
        self.option.as_ref().map(|text| text as &dyn SourceCode)
    }

    fn severity(&self) -> Option<miette::Severity> {
        Some(match self.severity {
            Severity::Error => miette::Severity::Error,
            Severity::Warning => miette::Severity::Warning,
        })
    }

    fn help<'a>(&'a self) -> Option<Box<dyn fmt::Display + 'a>> {
        self.help.as_ref().map(|help| Box::new(help) as Box<dyn fmt::Display>)
    }

    fn labels(&self) -> Option<Box<dyn Iterator<Item = LabeledSpan> + '_>> {
        let span = self.span.clone()?;
        let label = |span: &Range<usize>, text: &str| {
            let text = (!text.is_empty()).then(|| text.to_owned());
            (text, span.clone())
        };
        let (text, span) = label(&span, &self.label);
        let first = LabeledSpan::new_primary_with_span(text, span);
        let others = self.also.iter().map(move |(span, text)| {
            let (text, span) = label(span, text);
            LabeledSpan::new_with_span(text, span)
        });
        Some(Box::new(std::iter::once(first).chain(others)))
    }
}

/// Errors and warnings about one scene, with the scene's text to show them in.
///
/// Its `Display` is the headline that miette's handlers print above the underlined lines. The headline is the
/// message of a single finding, or the number of several findings. Logs use [`plain`](Self::plain).
#[derive(Debug, Clone)]
pub struct SceneErrors {
    source: NamedSource<Excerpts>,
    diagnostics: Vec<Diagnostic>,
}

/// The scene's text, of which handlers see at most [`REACH`] bytes of the lines around a place.
#[derive(Debug, Clone)]
struct Excerpts(Arc<str>);

impl SourceCode for Excerpts {
    fn read_span<'a>(
        &'a self,
        span: &SourceSpan,
        before: usize,
        after: usize,
    ) -> Result<Box<dyn SpanContents<'a> + 'a>, MietteError> {
        let text: &str = &self.0;
        let lines = text.read_span(span, before, after)?;
        let (first, place_end) = (lines.span().offset(), span.offset() + span.len());
        let last = first + lines.span().len();
        // Handlers ask for two places at once; those with much text between them are shown apart.
        if place_end - span.offset() > 2 * LONGEST_PLACE {
            return Err(MietteError::OutOfBounds);
        }
        let line_start = text[..span.offset()].rfind('\n').map_or(0, |at| at + 1).max(first);
        let line_end = text[place_end..last].find('\n').map_or(last, |at| place_end + at);
        let from = match () {
            () if span.offset() - line_start > REACH => boundary_after(text, span.offset() - REACH),
            () if line_start - first > REACH => line_start,
            () => first,
        };
        let to = match () {
            () if line_end - place_end > REACH => boundary_before(text, place_end + REACH),
            () if last - line_end > REACH => line_end,
            () => last,
        };
        if (from, to) == (first, last) {
            return Ok(lines);
        }
        let line = lines.line() + text[first..from].matches('\n').count();
        let column = if from == first { lines.column() } else { from - line_start };
        let data = &text.as_bytes()[from..to];
        let count = lines.line_count();
        Ok(Box::new(MietteSpanContents::new(data, (from, to - from).into(), line, column, count)))
    }
}

impl SceneErrors {
    /// Puts diagnostics together with the text they are about, in the order of the text.
    pub fn new(name: impl Into<String>, text: Arc<str>, mut diagnostics: Vec<Diagnostic>) -> Self {
        let visible = |text: Arc<str>| match printable(&text) {
            Cow::Borrowed(_) => text,
            Cow::Owned(visible) => visible.into(),
        };
        let text = visible(text);
        for diagnostic in &mut diagnostics {
            diagnostic.option = diagnostic.option.take().map(visible);
            // For a place outside the text miette would show nothing.
            let shown = diagnostic.option.clone().unwrap_or_else(|| text.clone());
            diagnostic.span = diagnostic.span.take().map(|span| clamp(&shown, span));
            diagnostic.message = shortened(std::mem::take(&mut diagnostic.message));
            diagnostic.label = shortened(std::mem::take(&mut diagnostic.label));
            diagnostic.help = diagnostic.help.take().map(shortened);
            for (span, label) in &mut diagnostic.also {
                *span = clamp(&text, span.clone());
                *label = shortened(std::mem::take(label));
            }
        }
        diagnostics.sort_by_key(|diagnostic| match (&diagnostic.option, &diagnostic.span) {
            (None, Some(span)) => span.start,
            _ => usize::MAX,
        });
        Self { source: NamedSource::new(shortened(name.into()), Excerpts(text)), diagnostics }
    }

    /// The name of the scene, mostly the path of its file.
    pub fn name(&self) -> &str {
        self.source.name()
    }

    /// The text of the scene.
    pub fn text(&self) -> &str {
        &self.source.inner().0
    }

    /// Errors and warnings in the order of the text; findings without a place come last.
    pub fn diagnostics(&self) -> &[Diagnostic] {
        &self.diagnostics
    }

    /// Line and column, both counted from 1, the column in characters, of a diagnostic's place.
    pub fn line_and_column(&self, diagnostic: &Diagnostic) -> Option<(usize, usize)> {
        if diagnostic.option.is_some() {
            return None;
        }
        let before = self.text().get(..diagnostic.span.as_ref()?.start)?;
        let line_start = before.rfind('\n').map_or(0, |at| at + 1);
        Some((before.matches('\n').count() + 1, before[line_start..].chars().count() + 1))
    }

    /// Returns text for logs, one finding a line: `liver.toml:12:17: error: … (help: …)`.
    pub fn plain(&self) -> impl fmt::Display + '_ {
        Plain(self)
    }

    /// Findings that are shown.
    fn shown(&self) -> &[Diagnostic] {
        &self.diagnostics[..self.diagnostics.len().min(MOST_SHOWN)]
    }

    /// Number of findings that are not shown.
    fn hidden(&self) -> usize {
        self.diagnostics.len() - self.shown().len()
    }

    /// Returns the diagnostic if there is only one.
    fn single(&self) -> Option<&Diagnostic> {
        match self.diagnostics.as_slice() {
            [diagnostic] => Some(diagnostic),
            _ => None,
        }
    }
}

/// The nearest span that lies in the text, on the borders of characters and is at most [`LONGEST_PLACE`]
/// long.
fn clamp(text: &str, span: Range<usize>) -> Range<usize> {
    let start = boundary_before(text, span.start);
    let end = boundary_after(text, span.end).max(start);
    if end - start <= LONGEST_PLACE {
        start..end
    } else {
        start..boundary_before(text, start + LONGEST_PLACE)
    }
}

impl fmt::Display for SceneErrors {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        if let Some(diagnostic) = self.single() {
            return diagnostic.fmt(f);
        }
        let errors = self.diagnostics.iter().filter(|diagnostic| diagnostic.is_error()).count();
        let warnings = self.diagnostics.len() - errors;
        let (mistakes, doubts) = (counted(errors, "mistake"), counted(warnings, "warning"));
        match (errors, warnings) {
            (_, 0) => write!(f, "{mistakes} in {}", self.name()),
            (0, _) => write!(f, "{doubts} about {}", self.name()),
            _ => write!(f, "{mistakes} and {doubts} in {}", self.name()),
        }?;
        if self.hidden() > 0 { write!(f, "; the first {MOST_SHOWN}:") } else { Ok(()) }
    }
}

impl std::error::Error for SceneErrors {}

impl miette::Diagnostic for SceneErrors {
    fn severity(&self) -> Option<miette::Severity> {
        let error = self.diagnostics.iter().any(Diagnostic::is_error);
        Some(if error { miette::Severity::Error } else { miette::Severity::Warning })
    }

    fn help<'a>(&'a self) -> Option<Box<dyn fmt::Display + 'a>> {
        self.single().and_then(miette::Diagnostic::help)
    }

    fn source_code(&self) -> Option<&dyn SourceCode> {
        // A single finding stands for the whole.
        self.single().and_then(miette::Diagnostic::source_code).or(Some(&self.source))
    }

    fn labels(&self) -> Option<Box<dyn Iterator<Item = LabeledSpan> + '_>> {
        self.single().and_then(miette::Diagnostic::labels)
    }

    fn related<'a>(&'a self) -> Option<Box<dyn Iterator<Item = &'a dyn miette::Diagnostic> + 'a>> {
        let related = self.shown().iter().map(|diagnostic| diagnostic as &dyn miette::Diagnostic);
        self.single().is_none().then(|| Box::new(related) as _)
    }
}

/// The lines of [`SceneErrors::plain`].
struct Plain<'a>(&'a SceneErrors);

impl fmt::Display for Plain<'_> {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        for (i, diagnostic) in self.0.shown().iter().enumerate() {
            if i > 0 {
                f.write_str("\n")?;
            }
            f.write_str(diagnostic.option.as_deref().unwrap_or(self.0.name()))?;
            if let Some((line, column)) = self.0.line_and_column(diagnostic) {
                write!(f, ":{line}:{column}")?;
            }
            let severity = if diagnostic.is_error() { "error" } else { "warning" };
            write!(f, ": {severity}: {}", diagnostic.message.replace('\n', " "))?;
            if let Some(help) = &diagnostic.help {
                write!(f, " (help: {})", help.replace('\n', "; "))?;
            }
        }
        match self.0.hidden() {
            0 => Ok(()),
            more => write!(f, "\n{}: {more} more are not shown", self.0.name()),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const TEXT: &str = "[law.liver]\n# weich\nshear-modulus = -3.0  # Pa\nµ = 1\n";

    fn rendered(errors: &SceneErrors) -> String {
        let handler = miette::GraphicalReportHandler::new_themed(miette::GraphicalTheme::unicode_nocolor());
        let mut page = String::new();
        handler.with_width(100).render_report(&mut page, errors).unwrap();
        page
    }

    fn negative() -> Diagnostic {
        Diagnostic::error("`shear-modulus` must be greater than 0, found -3")
            .at(36..40, "must be greater than 0")
            .help("give it in Pa")
    }

    #[test]
    fn a_single_mistake_shows_the_users_own_line_underlined() {
        let errors = SceneErrors::new("liver.toml", TEXT.into(), vec![negative()]);
        let page = rendered(&errors);
        let lines: Vec<&str> = page.lines().map(str::trim_end).collect();
        assert_eq!(lines[0], "  × `shear-modulus` must be greater than 0, found -3");
        assert_eq!(lines[1].trim(), "╭─[liver.toml:3:17]");
        let at = lines.iter().position(|line| line.ends_with("3 │ shear-modulus = -3.0  # Pa")).expect(&page);
        assert!(lines[at + 1].ends_with("·                 ──┬─"), "{page}");
        assert!(lines[at + 2].ends_with("╰── must be greater than 0"), "{page}");
        assert!(page.contains("help: give it in Pa"), "{page}");
    }

    #[test]
    fn several_mistakes_are_shown_together_in_the_order_of_the_file() {
        let unknown = Diagnostic::error("unknown key `µ`").at(47..49, "not known").also(0..11, "in this law");
        let nowhere = Diagnostic::warning("`until` is long").at(Place::CommandLine, "");
        let errors = SceneErrors::new("liver.toml", TEXT.into(), vec![nowhere, unknown, negative()]);
        let page = rendered(&errors);
        assert!(page.contains("2 mistakes and 1 warning in liver.toml"), "{page}");
        let place = |what: &str| page.find(what).unwrap_or_else(|| panic!("no {what} in {page}"));
        assert!(place("greater than 0, found -3") < place("unknown key `µ`"), "{page}");
        assert!(place("4 │ µ = 1") < place("`until` is long (given on the command line)"), "{page}");
        assert!(page.contains("in this law"), "{page}");
        assert_eq!(
            errors.plain().to_string(),
            "liver.toml:3:17: error: `shear-modulus` must be greater than 0, found -3 (help: give it in Pa)\n\
             liver.toml:4:1: error: unknown key `µ`\n\
             liver.toml: warning: `until` is long (given on the command line)"
        );
    }

    /// 5,000 mistakes in one line of 30 kB.
    fn flood() -> SceneErrors {
        let text: Arc<str> = format!("a = 1\nprony = [{}]\nb = 2\n", "1000, ".repeat(5000)).into();
        let mistake = |i: usize| {
            let at = 15 + 6 * i;
            Diagnostic::error(format!("found {}", &text[15..]))
                .at(at..at + 4, "here")
                .also(7..13, "in this one")
        };
        SceneErrors::new("liver.toml", text.clone(), (0..5000).map(mistake).collect())
    }

    #[test]
    fn a_flood_of_mistakes_is_cut() {
        let errors = flood();
        let page = rendered(&errors);
        assert!(page.contains("5000 mistakes in liver.toml; the first 20:"), "{}", &page[..500]);
        assert_eq!(page.matches("here").count(), MOST_SHOWN);
        // 20 messages of 2 kB, broken into lines with their margins, and 20 excerpts.
        assert!(page.len() < 100_000, "{} bytes", page.len());
        let plain = errors.plain().to_string();
        assert_eq!(plain.lines().count(), MOST_SHOWN + 1);
        assert!(plain.ends_with("liver.toml: 4980 more are not shown"), "{plain}");
        assert!(plain.len() < 50_000, "{} bytes", plain.len());
    }

    #[test]
    fn of_a_long_line_the_text_around_the_place_is_shown() {
        let text = format!("a = 1\nb = [{} oops, {}]\n", "1, ".repeat(1000), "2, ".repeat(1000));
        let at = text.find("oops").unwrap();
        let errors = SceneErrors::new("x", text.into(), vec![Diagnostic::error("m").at(at..at + 4, "this")]);
        let page = rendered(&errors);
        assert!(page.contains(&format!("[x:2:{}]", at - 6 + 1)), "{page}");
        assert!(page.contains("1, 1,  oops, 2, 2,") && page.contains("this"), "{page}");
        assert!(page.len() < 2500, "{page}");
        let line = page.lines().position(|line| line.contains("oops")).unwrap();
        let [above, below] = [line, line + 1].map(|i| page.lines().nth(i).unwrap().chars());
        let column = above.collect::<Vec<_>>().windows(4).position(|four| four == ['o', 'o', 'p', 's']);
        assert_eq!(column, below.collect::<Vec<_>>().iter().position(|&c| c == '─'), "{page}");
    }

    #[test]
    fn nothing_in_a_scene_makes_a_terminal_do_anything() {
        let text = "a = '\u{1b}]0;x\u{7}'\n";
        let mistake = Diagnostic::error("found \u{1b}[2J").at(4..10, "\u{9b}2J").help("\u{202e}");
        let errors = SceneErrors::new("\u{1b}.toml", text.into(), vec![mistake]);
        for shown in [rendered(&errors), errors.plain().to_string()] {
            assert!(!shown.contains(['\u{1b}', '\u{7}', '\u{9b}', '\u{202e}']), "{shown:?}");
        }
    }

    #[test]
    fn places_outside_the_text_or_inside_a_character_are_moved_into_it() {
        for span in [500..600, 48..48, TEXT.len()..TEXT.len() + 9, 48..50] {
            let errors =
                SceneErrors::new("x", TEXT.into(), vec![Diagnostic::error("m").at(span.clone(), "l")]);
            let moved = errors.diagnostics()[0].span.clone().unwrap();
            assert!(TEXT.get(moved).is_some(), "{span:?}");
            assert!(!rendered(&errors).contains("Failed"), "{span:?}");
        }
    }
}
