//! Forces at points, drawn over a picture: a dot at each point, and an arrow along the force. They are seen
//! through bodies, since points of contact lie between these.

use pliant_geometry::{Mesh, Vector3};

use crate::camera::Camera;
use crate::legend::readable;
use crate::picture::Picture;

/// Length of the longest arrow, over the diagonal of the box around the drawn points.
const LENGTH: f64 = 0.14;
/// Radius of a dot, half the width of a shaft, length and half the width of a head, width of a rim. All are
/// parts of the picture's height.
pub(crate) const DOT: f32 = 0.0042;
const SHAFT: f32 = 0.0021;
const HEAD: [f32; 2] = [0.019, 0.0078];
pub(crate) const RIM: f32 = 0.0019;
/// Colour (sRGB) of forces, and of the rim around them.
const FORCE: [u8; 3] = [190, 40, 40];
pub(crate) const PALE: [u8; 3] = [255, 255, 255];

/// A point [m] and the force there [N].
pub type PointForce = [Vector3; 2];

/// Returns the contact forces at the points of a mesh: its field `contact-force`, at the given positions [m].
/// `None` without the field.
pub fn contact_forces(mesh: &Mesh, points: &[Vector3]) -> Option<Vec<PointForce>> {
    let forces = mesh.point_data.get("contact-force").filter(|array| array.components == 3)?;
    let arrows = points.iter().zip(forces.values.chunks_exact(3));
    let arrows = arrows.map(|(point, force)| [*point, Vector3::new(force[0], force[1], force[2])]);
    Some(arrows.filter(|[_, force]| force.iter().all(|x| x.is_finite()) && force.norm() > 0.0).collect())
}

/// The largest of some forces [N]; 0 without any.
pub fn largest_force(forces: &[PointForce]) -> f64 {
    forces.iter().map(|[_, force]| force.norm()).fold(0.0, f64::max)
}

/// Returns the length of arrows over their force [m/N]. The longest arrow shows the `largest` force [N] among
/// points [m].
pub fn arrow_unit<'p>(points: impl IntoIterator<Item = &'p Vector3>, largest: f64) -> f64 {
    let finite = points.into_iter().filter(|point| point.iter().all(|x| x.is_finite()));
    let bounds = finite.map(|point| (*point, *point)).reduce(|(a, b), (c, d)| (a.inf(&c), b.sup(&d)));
    match bounds {
        Some((low, high)) if largest > 0.0 => LENGTH * (high - low).norm() / largest,
        _ => 0.0,
    }
}

/// The force of the longest arrow, in words.
pub fn arrow_note(largest: f64) -> String {
    let (unit, factor) = readable("N", largest);
    let value = largest * factor;
    let decimals = (2.0 - value.abs().max(1e-300).log10().floor()).clamp(0.0, 2.0) as usize;
    format!("longest arrow {value:.decimals$} {unit}")
}

/// Returns a function from a point [m] to its place in a picture, in pixels; `None` behind the camera.
pub(crate) fn pixels(picture: &Picture, camera: &Camera) -> impl Fn(&Vector3) -> Option<[f32; 2]> + use<> {
    let [width, height] = [picture.width, picture.height].map(|pixels| pixels as f32);
    let camera = *camera;
    move |point| {
        let [x, y] = camera.place(point, f64::from(width) / f64::from(height))?;
        Some([0.5 * width * (1.0 + x as f32), 0.5 * height * (1.0 - y as f32)])
    }
}

/// Draws forces whose arrows have a length over their force [m/N], the largest last.
pub(crate) fn draw(picture: &mut Picture, camera: &Camera, forces: &[PointForce], unit: f64) {
    let height = picture.height as f32;
    let pixel = pixels(picture, camera);
    let mut ordered: Vec<&PointForce> = forces.iter().collect();
    ordered.sort_by(|a, b| a[1].norm_squared().total_cmp(&b[1].norm_squared()));
    for [point, force] in ordered {
        let (Some(from), Some(to)) = (pixel(point), pixel(&(point + force * unit))) else { continue };
        Arrow::new(from, to, height).draw(picture, FORCE);
    }
}

/// A dot with an arrow, in pixels.
pub(crate) struct Arrow {
    from: [f32; 2],
    /// Length, and the unit vector along.
    length: f32,
    along: [f32; 2],
    dot: f32,
    shaft: f32,
    /// Length and half the width.
    head: [f32; 2],
}

impl Arrow {
    /// From a pixel to another one in a picture of a height.
    pub fn new(from: [f32; 2], to: [f32; 2], height: f32) -> Self {
        let way = [to[0] - from[0], to[1] - from[1]];
        let length = way[0].hypot(way[1]);
        let along = if length > 0.0 { way.map(|x| x / length) } else { [1.0, 0.0] };
        // The head of a short arrow is small.
        let part = (length / (HEAD[0] * height)).min(1.0);
        let head = HEAD.map(|size| size * height * part);
        Self { from, length, along, dot: DOT * height, shaft: SHAFT * height * part, head }
    }

    /// Draws it in a colour, with a pale rim.
    pub fn draw(&self, picture: &mut Picture, colour: [u8; 3]) {
        self.fill(picture, RIM * picture.height as f32, PALE);
        self.fill(picture, 0.0, colour);
    }

    /// Fills it in a colour, wider by some pixels, with smooth edges.
    fn fill(&self, picture: &mut Picture, wider: f32, colour: [u8; 3]) {
        let reach = self.dot.max(self.head[1]) + wider + 1.0;
        let tip = [0, 1].map(|c| self.from[c] + self.along[c] * self.length);
        let low = [0, 1].map(|c| (self.from[c].min(tip[c]) - reach).max(0.0) as i64);
        let sizes = [picture.width, picture.height];
        let high = [0, 1].map(|c| (self.from[c].max(tip[c]) + reach).min(sizes[c] as f32) as i64);
        for y in low[1]..=high[1] {
            for x in low[0]..=high[0] {
                let cover = (0.5 + wider - self.outside([x as f32 + 0.5, y as f32 + 0.5])).clamp(0.0, 1.0);
                if cover > 0.0 {
                    picture.mix(x, y, colour, cover);
                }
            }
        }
    }

    /// Returns the distance of a pixel from the arrow; negative inside.
    fn outside(&self, place: [f32; 2]) -> f32 {
        let off = [0, 1].map(|c| place[c] - self.from[c]);
        let along = off[0] * self.along[0] + off[1] * self.along[1];
        let across = (off[1] * self.along[0] - off[0] * self.along[1]).abs();
        let of_dot = off[0].hypot(off[1]) - self.dot;
        let [long, wide] = self.head;
        let neck = self.length - long;
        let of_shaft = across.hypot(along - along.clamp(0.0, neck.max(0.0))) - self.shaft;
        // A triangle: its slanted side and its base.
        let slant = (across * long + (along - self.length) * wide) / long.hypot(wide).max(1e-6);
        let of_head = slant.max(neck - along);
        let of_arrow = if self.length > 1.0 { of_shaft.min(of_head) } else { f32::INFINITY };
        of_dot.min(of_arrow)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use pliant_geometry::DataArray;

    /// The picture has a dot at the point and an arrow above it as long as its force asks; other pixels stay
    /// empty.
    #[test]
    fn an_arrow_begins_at_its_point_and_is_as_long_as_its_force() {
        let mut picture = Picture { width: 200, height: 200, rgba: vec![0; 160_000] };
        let camera = Camera { elevation: 0.0, height: 1.0, ..Camera::default() };
        draw(&mut picture, &camera, &[[Vector3::zeros(), Vector3::z() * 2.0]], 0.1);
        let is_red = |x: usize, y: usize| picture.rgba[4 * (200 * y + x)] > 150;
        let rows: Vec<usize> = (0..200).filter(|&y| (0..200).any(|x| is_red(x, y))).collect();
        // 0.2 m of 1 m are 40 of 200 pixels, in perspective at the target.
        assert!(rows.first().is_some_and(|top| (59..=62).contains(top)), "{rows:?}");
        assert!(rows.last().is_some_and(|low| (100..=102).contains(low)), "{rows:?}");
        assert!(rows.windows(2).all(|pair| pair[1] == pair[0] + 1));
        let columns: Vec<usize> = (0..200).filter(|&x| (0..200).any(|y| is_red(x, y))).collect();
        assert!(columns.iter().all(|x| (97..=102).contains(x)), "{columns:?}");
    }

    #[test]
    fn points_without_a_force_have_no_arrow_and_the_longest_one_is_a_part_of_the_body() {
        let mut mesh = Mesh { points: vec![Vector3::zeros(), Vector3::x(), Vector3::y()], ..Mesh::default() };
        assert!(contact_forces(&mesh, &mesh.points).is_none());
        let values = vec![0.0, 0.0, 0.0, 0.0, 3.0, 4.0, f64::NAN, 0.0, 0.0];
        mesh.point_data.insert("contact-force".into(), DataArray { components: 3, values });
        let forces = contact_forces(&mesh, &mesh.points).unwrap();
        assert_eq!(forces, [[Vector3::x(), Vector3::new(0.0, 3.0, 4.0)]]);
        assert_eq!(largest_force(&forces), 5.0);
        assert!((arrow_unit(&mesh.points, 5.0) - LENGTH * 2.0_f64.sqrt() / 5.0).abs() < 1e-15);
        assert_eq!(arrow_unit(&mesh.points, 0.0), 0.0);
        for (force, words) in [(0.5312, "531 mN"), (12.34, "12.3 N"), (1.5, "1.50 N"), (0.0, "0.00 N")] {
            assert_eq!(arrow_note(force), format!("longest arrow {words}"));
        }
    }
}
