//! Text in a picture: the colour scale with ticks and unit or the colours of labels with their names, a title
//! and the time.

use std::collections::BTreeSet;

use crate::colour::label_colour;
use crate::picture::Picture;
use crate::style::{MISSING, Style};
use crate::text::{Align, Pen};

/// Text in a picture.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Legend {
    /// The quantity shown by colours.
    pub quantity: String,
    /// Its unit; empty for none.
    pub unit: String,
    /// At the top left.
    pub title: String,
    /// At the bottom left.
    pub note: String,
    /// Labels with their names, or empty: each has a swatch if colours show labels.
    pub labels: Vec<(i32, String)>,
    /// Labels that are not visible from here: their names say so.
    pub hidden: BTreeSet<i32>,
    /// Steps of the run that did not converge and were accepted all the same. The note counts them.
    pub unconverged: u64,
    /// True if a drawn part has no value: its grey then has a swatch.
    pub missing: bool,
    /// The least and the greatest value that is seen: they are written where the scale leaves them out.
    pub ends: Option<[f64; 2]>,
}

/// Largest part of the picture's width for the names of labels.
const WIDEST: f32 = 0.3;
/// Beginning and end of the swatches, as parts of the picture's height.
const SWATCHES: [f32; 2] = [0.12, 0.92];
/// Distance from swatch to swatch over the height of letters.
const ROW: f32 = 1.45;

/// The text beside the grey of parts without a value.
pub const NO_VALUE: &str = "no value";

/// Part of the scale by which a value lies beyond an end before it is written.
const BEYOND: f64 = 1e-3;

/// Values that lie beyond a range, in words, scaled by a factor and with a unit.
pub fn beyond([low, high]: [f64; 2], ends: Option<[f64; 2]>, unit: &str, factor: f64) -> Vec<String> {
    let Some([least, most]) = ends else { return Vec::new() };
    let room = BEYOND * (high - low);
    let words = |word: &str, value: f64| {
        format!("{word} {} {unit}", three_digits(value * factor)).trim_end().to_owned()
    };
    let ends = [(most > high + room, "max", most), (least < low - room, "min", least)];
    ends.into_iter()
        .filter(|(is_beyond, ..)| high > low && *is_beyond)
        .map(|(_, word, value)| words(word, value))
        .collect()
}

/// A number with three digits.
pub(crate) fn three_digits(value: f64) -> String {
    let decimals = (2.0 - value.abs().max(1e-300).log10().floor()).clamp(0.0, 9.0) as usize;
    written(value, decimals)
}

/// The text below the swatches if not all fit.
fn told_of(more: usize) -> String {
    format!("+ {more} more")
}

/// The lines of swatches that fit: the label and its text; and the number of labels that do not fit.
pub fn swatches(labels: &[(i32, String)], most: usize) -> (Vec<(i32, String)>, usize) {
    let shown = if labels.len() > most { most.saturating_sub(1) } else { labels.len() };
    let line = |(label, name): &(i32, String)| (*label, format!("{label} {name}").trim_end().to_owned());
    (labels[..shown].iter().map(line).collect(), labels.len() - shown)
}

/// Prefixes of units: powers of ten.
const PREFIXES: [(&str, i32); 7] = [("G", 9), ("M", 6), ("k", 3), ("", 0), ("m", -3), ("µ", -6), ("n", -9)];
/// Units that take a prefix.
const SCALED: [&str; 6] = ["Pa", "m", "N", "J", "m/s", "s"];

/// About the requested number of round values in a range, and the step between them.
pub fn ticks([low, high]: [f64; 2], about: usize) -> (Vec<f64>, f64) {
    let rough = (high - low) / about.max(1) as f64;
    if !(rough > 0.0 && rough.is_finite()) {
        return (vec![low], 1.0);
    }
    let power = 10_f64.powf(rough.log10().floor());
    let step = [1.0, 2.0, 2.5, 5.0, 10.0].into_iter().map(|m| m * power).find(|step| *step >= rough * 0.999);
    let step = step.unwrap_or(10.0 * power);
    let (first, last) = ((low / step - 1e-6).ceil() as i64, (high / step + 1e-6).floor() as i64);
    ((first..=last).map(|n| n as f64 * step).collect(), step)
}

/// Returns the marks of a scale of colours, as parts of its length from the low end, and their numbers. Equal
/// ends have one mark, in the middle.
pub fn scale_marks([low, high]: [f64; 2], about: usize) -> Vec<(f64, String)> {
    if low == high {
        return vec![(0.5, three_digits(low))];
    }
    let (values, step) = ticks([low, high], about);
    let decimals = (-(step.log10() + 1e-9).floor()).clamp(0.0, 9.0) as usize;
    let shifted = step * 10_f64.powi(decimals as i32);
    let decimals = if (shifted - shifted.round()).abs() > 1e-6 { decimals + 1 } else { decimals };
    values.into_iter().map(|value| ((value - low) / (high - low), written(value, decimals))).collect()
}

fn written(value: f64, decimals: usize) -> String {
    let text = format!("{value:.decimals$}").replace('-', "−");
    if text.trim_start_matches('−').parse() == Ok(0.0) { "0".into() } else { text }
}

/// The unit with the prefix that makes a size readable, and the factor to it.
pub fn readable(unit: &str, size: f64) -> (String, f64) {
    if !SCALED.contains(&unit) || size <= 0.0 || !size.is_finite() {
        return (unit.to_owned(), 1.0);
    }
    let fits = |&&(_, power): &&(&str, i32)| size >= 0.999 * 10_f64.powi(power);
    let (prefix, power) = PREFIXES.iter().find(fits).unwrap_or(&PREFIXES[6]);
    (format!("{prefix}{unit}"), 10_f64.powi(-power))
}

impl Legend {
    /// The labels with their names. Labels that are seen come first; the names of the others end in
    /// "(hidden)".
    fn told_labels(&self) -> Vec<(i32, String)> {
        let named = |(label, name): &(i32, String)| match self.hidden.contains(label) {
            true => (*label, format!("{name} (hidden)").trim_start().to_owned()),
            false => (*label, name.clone()),
        };
        let (hidden, seen): (Vec<_>, Vec<_>) =
            self.labels.iter().partition(|(label, _)| self.hidden.contains(label));
        seen.into_iter().chain(hidden).map(named).collect()
    }

    /// Part of the picture's width that the scale of colours or the names of labels take at the right.
    pub fn width(&self, style: &Style, [width, height]: [u32; 2]) -> f64 {
        let size = letters(height);
        if !style.labels {
            let scale = (6.2 * f64::from(size) / f64::from(width)).min(0.4);
            return if style.range.is_some() { scale } else { 0.0 };
        }
        let Some(pen) = Pen::new(size) else { return 0.0 };
        let (lines, more) = swatches(&self.told_labels(), rows(height));
        let rest = (more > 0).then(|| told_of(more));
        let widest =
            lines.iter().map(|(_, text)| text).chain(&rest).map(|text| pen.width(text)).fold(0.0, f32::max);
        let most = WIDEST * width as f32;
        if lines.is_empty() {
            0.0
        } else {
            f64::from((widest.min(most) + 4.0 * size) / width as f32).min(0.45)
        }
    }

    /// Writes it.
    pub fn write(&self, picture: &mut Picture, style: &Style) {
        let size = letters(picture.height);
        let ink = style.background.ink();
        let (Some(pen), Some(large)) = (Pen::new(size), Pen::new(1.2 * size)) else { return };
        let (width, height) = (picture.width as f32, picture.height as f32);
        let margin = 1.1 * size;
        let line = |y: f32, width: f32| [0.0, y - 1.2 * size, margin + width + size, y + 1.2 * size];
        for (pen, text, y) in [(&large, &self.title, 1.4 * size), (&pen, &self.note, height - 1.3 * size)] {
            if !text.is_empty() {
                clear_ground(picture, style, line(y, pen.width(text)));
            }
            pen.write(picture, text, [margin, y], Align::Left, ink);
        }
        if style.labels || style.range.is_some() {
            let left = width * (1.0 - self.width(style, [picture.width, picture.height]) as f32);
            clear_ground(picture, style, [left, 0.0, width, height]);
        }
        if style.labels {
            self.write_labels(picture, style, &pen, size);
        } else if let Some(range) = style.range {
            self.write_scale(picture, style, range, &pen, [width, height, size]);
        }
    }

    /// A swatch, the number and the name of each label, as many as fit.
    fn write_labels(&self, picture: &mut Picture, style: &Style, pen: &Pen, size: f32) {
        let ink = style.background.ink();
        let part = self.width(style, [picture.width, picture.height]) as f32;
        let left = (picture.width as f32 * (1.0 - part) + size).round();
        let room = picture.width as f32 - left - 2.4 * size;
        // In a tiny picture nobody could read it.
        if room < size {
            return;
        }
        let (lines, more) = swatches(&self.told_labels(), rows(picture.height));
        let middle = |row: usize| SWATCHES[0] * picture.height as f32 + (row as f32 + 0.5) * ROW * size;
        let places: Vec<f32> = (0..=lines.len()).map(middle).collect();
        for ((label, text), &y) in lines.iter().zip(&places) {
            write_swatch(picture, [left, y], size, label_colour(*label), ink);
            pen.write(picture, &cut_to(pen, text, room), [left + 1.6 * size, y], Align::Left, ink);
        }
        if more > 0 {
            pen.write(picture, &told_of(more), [left + 1.6 * size, places[lines.len()]], Align::Left, ink);
        }
    }

    fn write_scale(
        &self,
        picture: &mut Picture,
        style: &Style,
        [low, high]: [f64; 2],
        pen: &Pen,
        [width, height, size]: [f32; 3],
    ) {
        let ink = style.background.ink();
        let (unit, factor) = readable(&self.unit, low.abs().max(high.abs()));
        let head =
            if unit.is_empty() { self.quantity.clone() } else { format!("{} [{unit}]", self.quantity) };
        let (right, top, bottom) = (width - 1.1 * size, 0.20 * height, 0.86 * height);
        // In a tiny picture nobody could read it.
        if bottom - top < 3.0 * size || width < 12.0 * size {
            return;
        }
        let thick = 1.1 * size;
        let bar = [(width - 5.2 * size).round(), (width - 5.2 * size + thick).round()];
        // Long names take two lines.
        let lines = if pen.width(&head) > 7.5 * size {
            let (first, second) = head.split_at(head.rfind(' ').unwrap_or(0));
            vec![first.trim().to_owned(), second.trim().to_owned()]
        } else {
            vec![head]
        };
        for (line, index) in lines.iter().rev().zip(0..) {
            pen.write(picture, line, [right, top - (1.3 + 1.3 * index as f32) * size], Align::Right, ink);
        }
        for y in top.round() as i64..bottom.round() as i64 {
            let part = f64::from((bottom - y as f32 - 0.5) / (bottom - top));
            let part = if high > low { part } else { style.map.part_of_one_value() };
            for x in bar[0] as i64..bar[1] as i64 {
                picture.mix(x, y, style.map.at(part), 1.0);
            }
        }
        for x in bar[0] as i64 - 1..=bar[1] as i64 {
            picture.mix(x, top.round() as i64 - 1, ink, 0.6);
            picture.mix(x, bottom.round() as i64, ink, 0.6);
        }
        for y in top.round() as i64..bottom.round() as i64 {
            picture.mix(bar[0] as i64 - 1, y, ink, 0.6);
            picture.mix(bar[1] as i64, y, ink, 0.6);
        }
        for (part, text) in scale_marks([low * factor, high * factor], 6) {
            let y = (bottom - part as f32 * (bottom - top)).clamp(top, bottom - 1.0);
            for x in bar[1] as i64..(bar[1] + 0.35 * size) as i64 {
                picture.mix(x, y.round() as i64, ink, 0.9);
            }
            pen.write(picture, &text, [bar[1] + 0.6 * size, y], Align::Left, ink);
        }
        let beyond = beyond([low, high], self.ends, &unit, factor);
        for (text, row) in beyond.iter().zip(0..) {
            let y = bottom + (1.5 + 1.4 * row as f32) * size;
            pen.write(picture, text, [right, y], Align::Right, ink);
        }
        if self.missing {
            let y = bottom + (1.7 + 1.4 * beyond.len() as f32) * size;
            pen.write(picture, NO_VALUE, [right, y], Align::Right, ink);
            write_swatch(picture, [right - pen.width(NO_VALUE) - 1.6 * size, y], size, MISSING, ink);
        }
    }
}

/// Opacity of the background that hides a body behind text.
const GROUND: f32 = 0.82;

/// Lays the background over bodies in a rectangle [pixels] (left, top, right, bottom), so that text on it can
/// be read.
pub(crate) fn clear_ground(picture: &mut Picture, style: &Style, [left, top, right, bottom]: [f32; 4]) {
    let [above, below] = style.background.colours();
    for y in top.max(0.0) as u32..(bottom.max(0.0) as u32).min(picture.height) {
        let part = f64::from(y) / f64::from(picture.height);
        let mix = |a: u8, b: u8| (f64::from(a) * (1.0 - part) + f64::from(b) * part).round() as u8;
        let colour = [0, 1, 2].map(|c| mix(above[c], below[c]));
        for x in left.max(0.0) as u32..(right.max(0.0) as u32).min(picture.width) {
            let covered = f32::from(picture.rgba[4 * (y * picture.width + x) as usize + 3]) / 255.0;
            picture.mix(x.into(), y.into(), colour, GROUND * covered);
        }
    }
}

/// A square with a thin border, its left side and its middle line at a place.
fn write_swatch(picture: &mut Picture, [left, y]: [f32; 2], size: f32, colour: [u8; 3], ink: [u8; 3]) {
    let (x, top, side) = (left as i64, (y - 0.5 * size).round() as i64, size.round() as i64);
    for row in 0..side {
        for column in 0..side {
            let border = [row, column].iter().any(|&at| at == 0 || at == side - 1);
            let (bytes, cover) = if border { (ink, 0.6) } else { (colour, 1.0) };
            picture.mix(x + column, top + row, bytes, cover);
        }
    }
}

/// A text as far as there is room for it [pixels].
fn cut_to(pen: &Pen, text: &str, room: f32) -> String {
    if pen.width(text) <= room {
        return text.to_owned();
    }
    let mut cut = text.to_owned();
    while cut.pop().is_some() && pen.width(&format!("{cut}…")) > room {}
    format!("{cut}…")
}

/// Swatches that fit into a picture of a height [pixels].
fn rows(height: u32) -> usize {
    ((SWATCHES[1] - SWATCHES[0]) * height as f32 / (ROW * letters(height))) as usize
}

/// Height of letters in a picture of a height [pixels].
pub(crate) fn letters(height: u32) -> f32 {
    (height as f32 / 36.0).clamp(11.0, 60.0).round()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn ticks_are_round_and_lie_in_the_range() {
        assert_eq!(ticks([0.0, 1.0], 5).0.len(), 6);
        let (values, step) = ticks([-0.37, 12.9], 6);
        assert_eq!((values.first(), values.last(), step), (Some(&0.0), Some(&12.5), 2.5));
        assert_eq!(ticks([3.0, 3.0], 5).0, [3.0]);
    }

    #[test]
    fn marks_lie_on_the_scale_and_equal_ends_have_one() {
        assert_eq!(scale_marks([0.0, 1.0], 2), [(0.0, "0".into()), (0.5, "0.5".into()), (1.0, "1.0".into())]);
        assert_eq!(scale_marks([0.0, 0.0], 6), [(0.5, "0".into())]);
        assert_eq!(scale_marks([1.25, 1.25], 6), [(0.5, "1.25".into())]);
        assert_eq!(scale_marks([-4321.0, -4321.0], 6), [(0.5, "−4321".into())]);
    }

    #[test]
    fn units_take_the_prefix_that_reads_best() {
        assert_eq!(readable("Pa", 4300.0), ("kPa".into(), 1e-3));
        assert_eq!(readable("m", 0.03), ("mm".into(), 1e3));
        assert_eq!(readable("m", 1.0).0, "m");
        assert_eq!(readable("", 1e-5).0, "");
        assert_eq!(readable("J/m³", 2e4).0, "J/m³");
    }

    fn organs(count: i32) -> Vec<(i32, String)> {
        (1..=count).map(|label| (label, if label == 2 { "liver".into() } else { String::new() })).collect()
    }

    #[test]
    fn labels_that_do_not_fit_are_counted() {
        let (lines, more) = swatches(&organs(3), 3);
        assert_eq!((lines[0].1.as_str(), lines[1].1.as_str(), lines.len(), more), ("1", "2 liver", 3, 0));
        let (lines, more) = swatches(&organs(9), 3);
        assert_eq!((lines.len(), more), (2, 7));
        assert_eq!(swatches(&organs(2), 0), (Vec::new(), 2));
    }

    #[test]
    fn labels_that_are_hidden_stand_last_and_are_told_to_be() {
        let legend = Legend { labels: organs(3), hidden: [1, 2].into(), ..Legend::default() };
        let (lines, _) = swatches(&legend.told_labels(), 5);
        let texts: Vec<&str> = lines.iter().map(|(_, text)| text.as_str()).collect();
        assert_eq!(texts, ["3", "1 (hidden)", "2 liver (hidden)"]);
    }

    #[test]
    fn each_label_has_a_swatch_of_its_colour_and_a_name() {
        let blank = Picture { width: 640, height: 400, rgba: vec![255; 4 * 640 * 400] };
        let style = Style { labels: true, ..Style::default() };
        let written = |labels: Vec<(i32, String)>| {
            let mut picture = blank.clone();
            Legend { labels, ..Legend::default() }.write(&mut picture, &style);
            picture
        };
        let count = |picture: &Picture, colour: [u8; 3]| {
            picture.rgba.chunks(4).filter(|pixel| pixel[..3] == colour).count()
        };
        let picture = written(organs(3));
        for label in 1..=3 {
            assert!(count(&picture, label_colour(label)) > 60, "label {label}");
        }
        assert_eq!(count(&picture, label_colour(4)), 0);
        let unnamed = written(vec![(2, String::new())]);
        let named =
            written(vec![(2, "a name that is much longer than there is room in the picture for".into())]);
        let inked = |picture: &Picture| 640 * 400 - count(picture, [255; 3]);
        assert!(inked(&named) > inked(&unnamed) + 100);
        // All of many are not there, but some are, and nothing fails in a tiny picture.
        let many = written(organs(200));
        assert!(count(&many, label_colour(10)) > 60 && count(&many, label_colour(200)) == 0);
        let mut tiny = Picture { width: 20, height: 9, rgba: vec![255; 4 * 20 * 9] };
        Legend { labels: organs(5), ..Legend::default() }.write(&mut tiny, &style);
    }

    /// Dark text on a dark body stands on the background of the picture. Elsewhere the body stays.
    #[test]
    fn text_over_a_body_stands_on_a_plain_ground() {
        let black = Picture { width: 320, height: 240, rgba: [0, 0, 0, 255].repeat(320 * 240) };
        let legend = Legend { title: "A liver".into(), note: "t = 1 s".into(), ..Legend::default() };
        let mut picture = black.clone();
        legend.write(&mut picture, &Style { range: Some([0.0, 1.0]), ..Style::default() });
        let at = |x: u32, y: u32| picture.rgba[4 * (y * 320 + x) as usize];
        assert!(at(2, 15) > 150 && at(2, 228) > 150 && at(316, 120) > 150);
        assert_eq!([at(160, 120), at(200, 15), at(200, 228)], [0; 3]);
        // Where no body is, nothing is laid over the background.
        let mut bare = Picture { rgba: [9, 9, 9, 0].repeat(320 * 240), ..black };
        legend.write(&mut bare, &Style::default());
        assert_eq!(bare.rgba[..4], [9, 9, 9, 0]);
    }

    #[test]
    fn values_beyond_the_scale_are_written() {
        let written = |ends| beyond([0.0, 2000.0], Some(ends), "kPa", 1e-3);
        assert_eq!(written([0.0, 2000.5]), Vec::<String>::new());
        assert_eq!(written([-10.0, 3456.0]), ["max 3.46 kPa", "min −0.0100 kPa"]);
        assert!(beyond([0.0, 0.0], Some([0.0, 1e-9]), "m", 1.0).is_empty(), "noise");
    }

    #[test]
    fn a_legend_is_written_where_there_are_colours() {
        let blank = Picture { width: 320, height: 240, rgba: vec![255; 4 * 320 * 240] };
        let legend = Legend { quantity: "von Mises stress".into(), unit: "Pa".into(), ..Legend::default() };
        let (mut plain, mut coloured) = (blank.clone(), blank.clone());
        legend.write(&mut plain, &Style::default());
        assert_eq!(plain, blank);
        let style = Style { range: Some([0.0, 5e3]), ..Style::default() };
        legend.write(&mut coloured, &style);
        let mut lacking = blank.clone();
        Legend { missing: true, ..legend.clone() }.write(&mut lacking, &style);
        let grey = |picture: &Picture| picture.rgba.chunks(4).filter(|pixel| pixel[..3] == MISSING).count();
        assert!(grey(&lacking) > 60 && grey(&coloured) == 0);
        let difference = coloured.difference(&blank).unwrap();
        assert!(difference.everywhere > 1.0, "{difference:?}");
        assert!(legend.width(&style, [320, 240]) > 0.1 && legend.width(&Style::default(), [320, 240]) == 0.0);
    }
}
