//! What is written into a picture: the scale of its colours with ticks and unit, a title and the time.

use crate::picture::Picture;
use crate::style::Style;
use crate::text::{Align, Pen};

/// What is written into a picture.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Legend {
    /// What the colours tell.
    pub quantity: String,
    /// Its unit; empty for none.
    pub unit: String,
    /// At the top left.
    pub title: String,
    /// At the bottom left.
    pub note: String,
}

/// Prefixes of units: powers of ten.
const PREFIXES: [(&str, i32); 7] = [("G", 9), ("M", 6), ("k", 3), ("", 0), ("m", -3), ("µ", -6), ("n", -9)];
/// Units that take a prefix.
const SCALED: [&str; 6] = ["Pa", "m", "N", "J", "m/s", "s"];

/// About as many round values in a range as asked for, and the step between them.
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
    /// Part of the picture's width that the scale of colours takes at the right.
    pub fn width(&self, style: &Style, [width, height]: [u32; 2]) -> f64 {
        let size = f64::from(letters(height));
        if style.range.is_some() { (6.2 * size / f64::from(width)).min(0.4) } else { 0.0 }
    }

    /// Writes it.
    pub fn write(&self, picture: &mut Picture, style: &Style) {
        let size = letters(picture.height);
        let ink = style.background.ink();
        let (Some(pen), Some(large)) = (Pen::new(size), Pen::new(1.2 * size)) else { return };
        let (width, height) = (picture.width as f32, picture.height as f32);
        let margin = 1.1 * size;
        large.write(picture, &self.title, [margin, 1.4 * size], Align::Left, ink);
        pen.write(picture, &self.note, [margin, height - 1.3 * size], Align::Left, ink);
        if let Some(range) = style.range {
            self.write_scale(picture, style, range, &pen, [width, height, size]);
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
        let (values, step) = ticks([low * factor, high * factor], 6);
        let decimals = (-(step.log10() + 1e-9).floor()).clamp(0.0, 9.0) as usize;
        let decimals =
            if (step * 10_f64.powi(decimals as i32) - (step * 10_f64.powi(decimals as i32)).round()).abs()
                > 1e-6
            {
                decimals + 1
            } else {
                decimals
            };
        for value in values {
            let part = (value / factor - low) / (high - low);
            let y = (bottom - part as f32 * (bottom - top)).clamp(top, bottom - 1.0);
            for x in bar[1] as i64..(bar[1] + 0.35 * size) as i64 {
                picture.mix(x, y.round() as i64, ink, 0.9);
            }
            let text = format!("{value:.decimals$}").replace('-', "−");
            let text = if text.trim_start_matches('−').parse() == Ok(0.0) { "0".into() } else { text };
            pen.write(picture, &text, [bar[1] + 0.6 * size, y], Align::Left, ink);
        }
    }
}

/// Height of letters in a picture of a height [pixels].
fn letters(height: u32) -> f32 {
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
    fn units_take_the_prefix_that_reads_best() {
        assert_eq!(readable("Pa", 4300.0), ("kPa".into(), 1e-3));
        assert_eq!(readable("m", 0.03), ("mm".into(), 1e3));
        assert_eq!(readable("m", 1.0).0, "m");
        assert_eq!(readable("", 1e-5).0, "");
        assert_eq!(readable("J/m³", 2e4).0, "J/m³");
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
        let difference = coloured.difference(&blank).unwrap();
        assert!(difference.everywhere > 1.0, "{difference:?}");
        assert!(legend.width(&style, [320, 240]) > 0.1 && legend.width(&Style::default(), [320, 240]) == 0.0);
    }
}
