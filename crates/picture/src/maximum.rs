//! The largest value that colours show. A ring marks its place, dashed if something hides the place. The
//! number stands next to the ring.

use pliant_geometry::Vector3;

use crate::arrows::{PALE, pixels};
use crate::camera::Camera;
use crate::colour::EQUAL;
use crate::legend::{clear_ground, letters, three_digits};
use crate::picture::Picture;
use crate::plane::Plane;
use crate::regions::Regions;
use crate::section::Section;
use crate::style::Style;
use crate::subject::Subject;
use crate::text::{Align, Pen};

/// The radius of the ring over the height of the picture, half the width of its line, and the width of the
/// rim around it.
const RADIUS: f32 = 0.014;
const LINE: f32 = 0.0022;
const RIM: f32 = 0.0018;
/// Dashes of the ring of a hidden place.
const DASHES: f32 = 6.0;

/// The largest value that is seen in colours, and its place [m]: of points of the surface that a plane
/// leaves, and of the section. `None` where all values are equal.
pub fn largest_seen(
    subject: &Subject,
    regions: &Regions,
    points: &[Vector3],
    values: &[f64],
    clip: Option<Plane>,
    section: &Section,
) -> Option<(Vector3, f64)> {
    let showing = subject.showing_points(regions).into_iter().map(|point| point as usize);
    let surface = showing.filter_map(|point| Some((*points.get(point)?, *values.get(point)?)));
    let left = surface.filter(|(place, _)| clip.is_none_or(|plane| plane.distance(place) <= 0.0));
    let cut = section.places(subject, regions).filter(|_| !values.is_empty());
    let finite = left.chain(cut).filter(|(_, value)| value.is_finite());
    let ends = finite.fold(None, |ends: Option<(f64, (Vector3, f64))>, (place, value)| {
        let (least, most) = ends.unwrap_or((value, (place, value)));
        Some((least.min(value), if value > most.1 { (place, value) } else { most }))
    });
    ends.filter(|(least, most)| most.1 - least > EQUAL * most.1.abs().max(least.abs())).map(|(_, most)| most)
}

/// A largest value with the data to draw it.
pub(crate) struct Maximum<'a> {
    /// Its place [m].
    pub place: Vector3,
    /// The value, and its unit, in which a factor brings it.
    pub value: f64,
    pub unit: &'a str,
    pub factor: f64,
    /// True if nothing hides the place.
    pub is_seen: bool,
}

impl Maximum<'_> {
    /// The text beside the ring.
    pub fn text(&self) -> String {
        maximum_text(self.value * self.factor, self.unit, self.is_seen)
    }

    /// Draws it left of where a legend begins [pixels].
    pub fn draw(&self, picture: &mut Picture, camera: &Camera, style: &Style, legend: f32) {
        let Some(at) = pixels(picture, camera)(&self.place) else { return };
        let (width, height) = (picture.width as f32, picture.height as f32);
        if !(0.0..width).contains(&at[0]) || !(0.0..height).contains(&at[1]) {
            return;
        }
        self.ring(picture, at, style.background.ink());
        let size = letters(picture.height);
        let Some(pen) = Pen::new(size) else { return };
        let text = self.text();
        let wide = pen.width(&text);
        let off = (RADIUS + 2.0 * RIM) * height + 0.4 * size;
        let right = at[0] + off + wide + 0.4 * size < legend;
        let left = if right { at[0] + off } else { (at[0] - off - wide).max(0.4 * size) };
        // Title and note stand at the top and at the bottom.
        let y = at[1].clamp(3.6 * size, (height - 3.6 * size).max(3.6 * size));
        let ground = [left - 0.4 * size, y - 0.75 * size, left + wide + 0.4 * size, y + 0.75 * size];
        clear_ground(picture, style, ground);
        pen.write(picture, &text, [left, y], Align::Left, style.background.ink());
    }

    fn ring(&self, picture: &mut Picture, [x, y]: [f32; 2], ink: [u8; 3]) {
        let height = picture.height as f32;
        let radius = (RADIUS * height).max(4.0);
        let rim = (RIM * height).max(1.0);
        let line = (LINE * height).max(0.8);
        let pale = if ink[0] > 127 { [0; 3] } else { PALE };
        let reach = (radius + line + rim + 1.0) as i64;
        for (wider, colour) in [(rim, pale), (0.0, ink)] {
            for row in y as i64 - reach..=y as i64 + reach {
                for column in x as i64 - reach..=x as i64 + reach {
                    let [dx, dy] = [column as f32 + 0.5 - x, row as f32 + 0.5 - y];
                    let turn = dy.atan2(dx) / std::f32::consts::TAU;
                    if !self.is_seen && (turn * DASHES).rem_euclid(1.0) > 0.6 {
                        continue;
                    }
                    let outside = (dx.hypot(dy) - radius).abs() - line - wider;
                    picture.mix(column, row, colour, (0.5 - outside).clamp(0.0, 1.0));
                }
            }
        }
    }
}

/// A largest value in its unit, in words.
pub fn maximum_text(value: f64, unit: &str, is_seen: bool) -> String {
    let text = format!("max {} {unit}", three_digits(value)).trim_end().to_owned();
    if is_seen { text } else { format!("{text}, hidden") }
}
