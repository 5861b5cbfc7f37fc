//! The page of a reproduction: one self-contained HTML file.

use crate::case::{Case, Correction, Figure, Findings, Row};
use crate::digits::{reference, tolerance};
use crate::picture::NO_PICTURE;
use crate::report::{Report, commit};

/// The files of a report.
const FILES: [&str; 2] = ["index.html", "results.json"];

const STYLE: &str = include_str!("page.css");

impl Report {
    /// The files, each with its name.
    pub fn files(&self) -> [(&'static str, String); 2] {
        let [index, results] = FILES;
        [(index, page(self)), (results, format!("{:#}\n", self.results()))]
    }
}

/// True if a report writes a file of this name.
pub fn is_own_file(name: &str) -> bool {
    FILES.contains(&name)
}

/// The whole page.
fn page(report: &Report) -> String {
    let [passed, failed] = report.counts();
    let judged = passed + failed;
    let shown_only = report.rows().count() - judged;
    let verdict = if failed == 0 {
        format!("<p class=\"verdict pass\">All {judged} judged numbers are within their tolerance.</p>")
    } else {
        format!(
            "<p class=\"verdict fail\">{failed} of {judged} judged numbers are outside their tolerance.</p>"
        )
    };
    let machine = &report.machine;
    let built = commit().map_or_else(String::new, |commit| format!(" ({commit})"));
    let mut body = format!(
        "<header><h1>The results of the thesis, reproduced</h1>\n\
         <p class=\"lead\">O. Comas, <cite>Real-time soft tissue modelling on GPU for medical simulation</cite> (2010), \
         chapters 6, 8 and 9.2, computed by Pliant.</p>\n{verdict}\n\
         <p class=\"meta\">{passed} of {judged} pass; {shown_only} more are not judged. \
         Pliant {}{built}, {}, {}, {} cores, {}; {:.0} s in all.</p></header>\n",
        env!("CARGO_PKG_VERSION"),
        report.date,
        escape(&machine.processor),
        machine.cores,
        escape(&machine.system),
        report.wall().as_secs_f64(),
    );
    body.push_str("<nav><ul>");
    for (case, findings, _) in &report.cases {
        body.push_str(&format!(
            "<li><a href=\"#{}\">{}</a> {}</li>",
            case.id,
            escape(case.title),
            tally(findings)
        ));
    }
    body.push_str("</ul></nav>\n");
    for (case, findings, wall) in &report.cases {
        body.push_str(&section(case, findings, wall.as_secs_f64()));
    }
    format!(
        "<!doctype html>\n<html lang=\"en\">\n<head>\n<meta charset=\"utf-8\">\n\
         <meta name=\"viewport\" content=\"width=device-width, initial-scale=1\">\n\
         <meta name=\"color-scheme\" content=\"light dark\">\n\
         <title>Pliant: the results of the thesis</title>\n<style>\n{STYLE}</style>\n</head>\n<body>\n{body}</body>\n</html>\n"
    )
}

/// Number of a case's judged rows that passed, in words.
fn tally(findings: &Findings) -> String {
    let count = |pass| findings.rows.iter().filter(|row| row.pass == Some(pass)).count();
    match [count(true), count(false)] {
        [0, 0] => "<span class=\"none\">not judged</span>".into(),
        [passed, 0] => format!("<span class=\"pass\">✓ {passed} pass</span>"),
        [passed, failed] => format!("<span class=\"fail\">✗ {failed} of {} fail</span>", passed + failed),
    }
}

fn section(case: &Case, findings: &Findings, wall: f64) -> String {
    let figures: String = findings.figures.iter().map(figure).collect();
    let corrections: String = case.corrections.iter().map(correction).collect();
    let corrected = if corrections.is_empty() {
        String::new()
    } else {
        format!("<h3>What was corrected, and why</h3>\n<dl>{corrections}</dl>\n")
    };
    let rows: String = findings.rows.iter().map(row).collect();
    format!(
        "<section id=\"{}\">\n<h2>{}</h2>\n<p>{}</p>\n{corrected}\
         <div class=\"pair\"><div class=\"figures\">{figures}</div>\n\
         <div><table>\n<thead><tr><th>quantity</th><th>reference</th><th>tolerance</th><th>computed</th><th></th></tr></thead>\n\
         <tbody>\n{rows}</tbody></table>\n\
         <p class=\"meta\"><code>pliant-lab reproduce --only {}</code>, {wall:.1} s</p></div></div>\n</section>\n",
        case.id,
        escape(case.title),
        prose(case.shows),
        case.id,
    )
}

fn figure(figure: &Figure) -> String {
    let Some(svg) = &figure.svg else {
        return format!("<p class=\"meta\">{}</p>\n", prose(NO_PICTURE));
    };
    let svg = svg.replacen("<svg ", "<svg role=\"img\" ", 1);
    format!("<figure>{svg}<figcaption>{}</figcaption></figure>\n", escape(&figure.caption))
}

fn correction(correction: &Correction) -> String {
    let Correction { printed, correct, why } = correction;
    format!("<dt>{}</dt><dd><b>{}</b> {}</dd>\n", prose(printed), prose(correct), prose(why))
}

fn row(row: &Row) -> String {
    let unit = if row.unit.is_empty() { String::new() } else { format!(" {}", row.unit) };
    let with_unit = |text: String| if text == "–" { text } else { typeset(&text) + &unit };
    let source =
        if row.source.is_empty() { String::new() } else { format!("<small>{}</small>", escape(row.source)) };
    let (class, verdict) = match row.pass {
        Some(true) => ("pass", "✓ pass"),
        Some(false) => ("fail", "✗ fail"),
        None => ("none", ""),
    };
    let tolerance = match row.tolerance {
        Some(_) => format!("± {}", with_unit(tolerance(row))),
        None => "–".into(),
    };
    format!(
        "<tr class=\"{class}\"><td>{}{source}</td><td class=\"number\" data-is=\"reference\">{}</td>\
         <td class=\"number\" data-is=\"tolerance\">{tolerance}</td><td class=\"number\" data-is=\"computed\">{}</td><td class=\"verdict\">{verdict}</td></tr>\n",
        escape(&row.quantity),
        with_unit(reference(row)),
        with_unit(row.computed_digits()),
    )
}

/// A number as a book prints it.
fn typeset(number: &str) -> String {
    let (mantissa, exponent) = number.split_once('e').unwrap_or((number, ""));
    let mantissa = mantissa.replace('-', "−");
    match exponent {
        "" => mantissa,
        power if mantissa == "1" => format!("10<sup>{}</sup>", power.replace('-', "−")),
        power => format!("{mantissa} · 10<sup>{}</sup>", power.replace('-', "−")),
    }
}

/// A text with the parts between backticks as code.
fn prose(text: &str) -> String {
    let parts = text.split('`').enumerate();
    let set = |(at, part): (usize, &str)| {
        if at % 2 == 1 { format!("<code>{}</code>", escape(part)) } else { escape(part) }
    };
    parts.map(set).collect()
}

fn escape(text: &str) -> String {
    text.replace('&', "&amp;").replace('<', "&lt;").replace('>', "&gt;").replace('"', "&quot;")
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn numbers_and_texts_are_set_as_html() {
        assert_eq!(typeset("-2.4e-5"), "−2.4 · 10<sup>−5</sup>");
        assert_eq!(typeset("1e-9"), "10<sup>−9</sup>");
        assert_eq!(prose("`a < b` & c"), "<code>a &lt; b</code> &amp; c");
    }
}
