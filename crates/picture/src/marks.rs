//! Marks of constraints and loads, drawn over a picture like contact forces. A held node has a square, a
//! moved node a dot, and a node under a plate a bar. A load has an arrow along its force. The weight has an
//! arrow from the centre of mass.

use pliant_geometry::{DataArray, Mesh, Vector3};

use crate::arrows::{Arrow, DOT, PALE, RIM, pixels};
use crate::camera::Camera;
use crate::picture::Picture;

/// Meaning of a mark.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Marked {
    /// A node that stays where it is at rest.
    Held,
    /// A node that is moved.
    Moved,
    /// A node under a plate, which moves only the mean of its nodes.
    Plate,
    /// The weight of all [N], at its centre.
    Weight(Vector3),
    /// A load's force on a node [N].
    Loaded(Vector3),
}

/// A mark at a place [m].
pub type Mark = (Vector3, Marked);

/// Largest number of marks of each kind. If there are more, they are thinned evenly.
const MOST: usize = 300;

impl Marked {
    /// Its colour (sRGB).
    pub const fn colour(self) -> [u8; 3] {
        match self {
            Self::Held => [40, 44, 52],
            Self::Moved | Self::Plate => [206, 112, 20],
            Self::Loaded(_) | Self::Weight(_) => [24, 128, 80],
        }
    }
}

/// Returns at most 300 marks of each kind, spread evenly over all.
pub fn some_of(marks: Vec<Mark>) -> Vec<Mark> {
    let kind = |mark: &Mark| match mark.1 {
        Marked::Held => 0,
        Marked::Moved => 1,
        Marked::Loaded(_) => 2,
        Marked::Plate => 3,
        Marked::Weight(_) => 4,
    };
    let mut counts = [0; 5];
    marks.iter().for_each(|mark| counts[kind(mark)] += 1);
    let every = counts.map(|count: usize| count.div_ceil(MOST).max(1));
    let mut seen = [0; 5];
    let is_kept = |mark: &Mark| {
        let kind = kind(mark);
        seen[kind] += 1;
        (seen[kind] - 1) % every[kind] == 0
    };
    let mut kept = marks;
    kept.retain(is_kept);
    kept
}

/// The largest force of loads [N]; 0 without any.
pub fn largest_load(marks: &[Mark]) -> f64 {
    let force = |(_, marked): &Mark| if let Marked::Loaded(force) = marked { force.norm() } else { 0.0 };
    marks.iter().map(force).fold(0.0, f64::max)
}

/// The mark of weights [N] at places [m]; `None` where nothing weighs.
pub fn weight_of(weights: impl Iterator<Item = (Vector3, Vector3)>) -> Option<Mark> {
    let (mut sum, mut moment, mut total) = (Vector3::zeros(), Vector3::zeros(), 0.0);
    for (place, weight) in weights.filter(|(_, weight)| weight.iter().all(|x| x.is_finite())) {
        sum += weight;
        moment += place * weight.norm();
        total += weight.norm();
    }
    (total > 0.0).then(|| (moment / total, Marked::Weight(sum)))
}

/// Length of the arrow of a weight over the height of the view.
pub const WEIGHT: f64 = 0.12;

/// Returns the marks of a mesh from its fields `constraint`, `load` and `weight`, with its points at some
/// places [m]. `None` without the first two fields.
pub(crate) fn marks_of(mesh: &Mesh, points: &[Vector3]) -> Option<Vec<Mark>> {
    let held = mesh.point_data.get("constraint").filter(|array| array.components == 1);
    let loads = mesh.point_data.get("load").filter(|array| array.components == 3);
    if held.is_none() && loads.is_none() {
        return None;
    }
    let held = held.into_iter().flat_map(|array| points.iter().zip(&array.values));
    let mut marks: Vec<Mark> = held
        .filter_map(|(point, &held)| match held {
            1.0 => Some((*point, Marked::Held)),
            2.0 => Some((*point, Marked::Moved)),
            3.0 => Some((*point, Marked::Plate)),
            _ => None,
        })
        .collect();
    let forces = |array: Option<&DataArray>| -> Vec<(Vector3, Vector3)> {
        let each = array.into_iter().flat_map(|array| points.iter().zip(array.values.chunks_exact(3)));
        each.map(|(point, force)| (*point, Vector3::new(force[0], force[1], force[2]))).collect()
    };
    let weights = mesh.point_data.get("weight").filter(|array| array.components == 3);
    marks.extend(weight_of(forces(weights).into_iter()));
    let loads = forces(loads)
        .into_iter()
        .filter(|(_, force)| force.iter().all(|x| x.is_finite()) && force.norm() > 0.0);
    marks.extend(loads.map(|(point, force)| (point, Marked::Loaded(force))));
    Some(some_of(marks))
}

/// Draws marks; arrows of loads have a length over their force [m/N].
pub(crate) fn draw(picture: &mut Picture, camera: &Camera, marks: &[Mark], unit: f64) {
    let height = picture.height as f32;
    let pixel = pixels(picture, camera);
    for (place, marked) in marks {
        let Some(at) = pixel(place) else { continue };
        match marked {
            Marked::Held => {
                bar(picture, at, [(DOT + RIM) * height; 2], PALE);
                bar(picture, at, [DOT * height; 2], marked.colour());
            }
            Marked::Plate => {
                bar(picture, at, [2.0 * DOT + RIM, 0.5 * DOT + RIM].map(|half| half * height), PALE);
                bar(picture, at, [2.0 * DOT, 0.5 * DOT].map(|half| half * height), marked.colour());
            }
            Marked::Weight(force) => {
                let reach = force.normalize() * (WEIGHT * camera.height);
                let Some(to) = pixel(&(place + reach)) else { continue };
                Arrow::new(at, to, height).draw(picture, marked.colour());
            }
            Marked::Moved => Arrow::new(at, at, height).draw(picture, marked.colour()),
            Marked::Loaded(force) => {
                let Some(to) = pixel(&(place + force * unit)) else { continue };
                Arrow::new(at, to, height).draw(picture, marked.colour());
            }
        }
    }
}

/// Fills a bar of half a width and half a height around a pixel, with smooth edges.
fn bar(picture: &mut Picture, [x, y]: [f32; 2], [wide, high]: [f32; 2], colour: [u8; 3]) {
    let range = |at: f32, half: f32| (at - half - 1.0) as i64..=(at + half + 1.0) as i64;
    let cover =
        |pixel: i64, at: f32, half: f32| (0.5 + half - (pixel as f32 + 0.5 - at).abs()).clamp(0.0, 1.0);
    // Pixels outside of the picture are left out by it.
    for row in range(y, high) {
        for column in range(x, wide) {
            picture.mix(column, row, colour, cover(column, x, wide) * cover(row, y, high));
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn fields_of_constraints_and_loads_become_marks() {
        let mut mesh = Mesh { points: vec![Vector3::zeros(), Vector3::x(), Vector3::y()], ..Mesh::default() };
        assert!(marks_of(&mesh, &mesh.points).is_none());
        mesh.point_data.insert("constraint".into(), DataArray::scalar(vec![1.0, 0.0, 2.0]));
        let values = vec![0.0, 0.0, 0.0, 0.0, 0.0, -2.0, f64::NAN, 0.0, 0.0];
        mesh.point_data.insert("load".into(), DataArray { components: 3, values });
        let marks = marks_of(&mesh, &mesh.points).unwrap();
        let load = Marked::Loaded(Vector3::new(0.0, 0.0, -2.0));
        assert_eq!(
            marks,
            [(Vector3::zeros(), Marked::Held), (Vector3::y(), Marked::Moved), (Vector3::x(), load)]
        );
        assert_eq!(largest_load(&marks), 2.0);
        // The weight of all acts at its centre, whatever weighs nothing.
        let values = vec![0.0, 0.0, -1.0, 0.0, 0.0, -3.0, 0.0, 0.0, 0.0];
        mesh.point_data.insert("weight".into(), DataArray { components: 3, values });
        mesh.point_data.insert("constraint".into(), DataArray::scalar(vec![3.0, 0.0, 0.0]));
        let marks = marks_of(&mesh, &mesh.points).unwrap();
        let weight = (Vector3::x() * 0.75, Marked::Weight(-Vector3::z() * 4.0));
        assert_eq!(marks[..2], [(Vector3::zeros(), Marked::Plate), weight]);
        let many = some_of(vec![(Vector3::zeros(), Marked::Held); 1000]);
        assert_eq!(many.len(), 250);
    }

    #[test]
    fn squares_dots_and_arrows_have_their_colours_where_they_belong() {
        let mut picture = Picture { width: 800, height: 800, rgba: vec![255; 2_560_000] };
        let camera = Camera { elevation: 0.0, height: 1.0, ..Camera::default() };
        let [right, up, _] = camera.axes();
        let marks = [
            (right * -0.25, Marked::Held),
            (right * 0.25, Marked::Moved),
            (Vector3::zeros(), Marked::Loaded(up)),
        ];
        draw(&mut picture, &camera, &marks, 0.2);
        let at = |x: usize, y: usize| -> [u8; 3] {
            let at = 4 * (800 * y + x);
            [picture.rgba[at], picture.rgba[at + 1], picture.rgba[at + 2]]
        };
        assert_eq!(at(200, 400), Marked::Held.colour());
        assert_eq!(at(600, 400), Marked::Moved.colour());
        let green = (240..=400).filter(|&y| at(400, y)[1] > at(400, y)[0] + 40).count();
        assert!(green > 120, "{green} pixels of the arrow");
        assert_eq!(at(400, 200), [255; 3]);
    }
}
