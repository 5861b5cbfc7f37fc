//! Rigid things and pairs of surfaces for GPUs: distances and ways are snippets of WGSL beside their Rust
//! twins. This file joins them, and writes shapes and passages as they read them.

use nalgebra::{Matrix3, Vector3};

use crate::face_points::ALONG;
use crate::grid::FLATTEST;
use crate::pairs::{BESIDE, FACING, FLAT, ON, PARALLEL, SLIGHT};
use crate::shape::Shape;
use crate::touch::{ALIKE, LEFT, MEETS, MOST_PARTS, Passage, Rigid};

/// Number of values of a rigid thing, without the values of its grid.
pub const THING: usize = 16;

/// Numbers of a passage.
pub const PASSAGE: usize = 40;

/// Half of the thinnest part [m] of a thing without one.
const ENDLESS: f64 = 1e30;

/// Kinds of shapes, by their index; any other index is a half-space.
const KINDS: [&str; 6] = ["SPHERE", "CAPSULE", "CYLINDER", "CUBOID", "CONE", "GRID"];

fn kind(shape: &Shape) -> usize {
    match shape {
        Shape::Sphere { .. } => 0,
        Shape::Capsule { .. } => 1,
        Shape::Cylinder { .. } => 2,
        Shape::Cuboid { .. } => 3,
        Shape::Cone { .. } => 4,
        Shape::Grid(_) => 5,
        // Contacts with bodies of revolution run on the CPU only.
        Shape::HalfSpace | Shape::Revolved(_) => KINDS.len(),
    }
}

/// Returns the contact functions of bodies with these rigid things, in WGSL.
///
/// The module around it defines `fn thing_number(at: u32) -> f32` and `fn passage_number(at: u32) -> f32`.
/// These read the numbers of [`things`] and of [`Passage::numbers`]. The shader gives
/// `passage_of(thing, at)`, whose arguments are the begins of both. For a passage it gives `near_after`,
/// `distance_before`, `meet` and `carried`.
pub fn shader(rigids: &[Rigid]) -> String {
    let numbers = [
        ("FLATTEST", FLATTEST),
        ("MOST_PARTS", MOST_PARTS),
        ("MEETS", MEETS),
        ("ALIKE", ALIKE),
        ("LEFT", LEFT),
    ];
    let numbers = constants(&numbers);
    let kinds: String = (KINDS.iter().enumerate())
        .map(|(number, name)| {
            let is_there = rigids.iter().any(|rigid| kind(&rigid.shape) == number);
            format!("const {name} = {number}u;\nconst HAS_{name} = {is_there};\n")
        })
        .collect();
    [&numbers, &kinds, include_str!("exact.wgsl"), include_str!("shape.wgsl"), include_str!("touch.wgsl")]
        .join("\n")
}

fn constants(numbers: &[(&str, f64)]) -> String {
    numbers.iter().map(|(name, value)| format!("const {name} = {:e}f;\n", *value as f32)).collect()
}

/// Returns the contact functions of surfaces with each other, in WGSL: `find_above` of a node with triangles,
/// and `find_crossing` of two edges.
///
/// The surrounding module includes the [`shader`] of rigid things, and defines where nodes are and how a pair
/// is stored; see narrow.wgsl.
pub fn pairs_shader() -> String {
    let numbers = [
        ("BESIDE", BESIDE),
        ("FACING", FACING),
        ("SLIGHT", SLIGHT),
        ("PARALLEL", PARALLEL),
        ("FLAT", FLAT),
        ("ON", ON),
    ];
    [&constants(&numbers), include_str!("pairs/narrow.wgsl")].join("\n")
}

/// Returns the functions for points of faces at balls and capsules, in WGSL, to go with [`shader`]:
/// `takes_nearest` of a thing, and `nearest_point` of a face.
pub fn face_points_shader() -> String {
    [&constants(&[("ALONG", ALONG)]), include_str!("face_points.wgsl")].join("\n")
}

/// Rigid things as `thing_number` gives them: [`THING`] numbers each, in their order, then the values of
/// grids.
pub fn things(rigids: &[Rigid]) -> Vec<f32> {
    let mut numbers = Vec::with_capacity(rigids.len() * THING);
    let mut values = Vec::new();
    for rigid in rigids {
        let end = numbers.len() + THING;
        let sign = if rigid.inside { -1.0 } else { 1.0 };
        let half_thinnest = (0.5 * rigid.shape.thinnest()).min(ENDLESS);
        let sizes = match &rigid.shape {
            Shape::Sphere { radius } => vec![*radius],
            Shape::Capsule { radius, length } | Shape::Cylinder { radius, length } => vec![*radius, *length],
            Shape::Cuboid { size } => size.to_vec(),
            Shape::Cone { radius, height } => vec![*radius, *height],
            Shape::HalfSpace | Shape::Revolved(_) => vec![],
            Shape::Grid(grid) => {
                let origin = grid.origin().iter().copied();
                let counts = grid.counts().map(|count| count as f64);
                origin.chain([grid.spacing(), grid.spacing().recip()]).chain(counts).collect()
            }
        };
        numbers.extend([kind(&rigid.shape) as f32, sign, half_thinnest as f32, 0.0]);
        numbers.extend(sizes.iter().map(|&size| size as f32));
        if let Shape::Grid(grid) = &rigid.shape {
            numbers.push(f32::from_bits((rigids.len() * THING + values.len()) as u32));
            values.extend_from_slice(grid.values());
        }
        numbers.resize(end, 0.0);
    }
    numbers.append(&mut values);
    numbers
}

impl Passage {
    /// Returns the numbers that `passage_number` reads. Differences are taken in double precision, so that no
    /// digits are lost.
    pub fn numbers(&self) -> [f32; PASSAGE] {
        let [before, after] = &self.poses;
        let place = before.translation.vector;
        let rest_of_place = place - place.map(|x| f64::from(x as f32));
        let shift = after.translation.vector - place;
        let turned_before = before.rotation.to_rotation_matrix().into_inner();
        let turn = self.motion.rotation.to_rotation_matrix().into_inner() - Matrix3::identity();
        let angle = self.motion.rotation.scaled_axis();
        let parts = [
            place.as_slice(),
            rest_of_place.as_slice(),
            turned_before.as_slice(),
            self.turn.as_slice(),
            shift.as_slice(),
            turn.as_slice(),
            angle.as_slice(),
            &[self.travel],
        ];
        let mut numbers = [0.0; PASSAGE];
        for (to, &from) in numbers.iter_mut().zip(parts.iter().copied().flatten()) {
            *to = from as f32;
        }
        numbers
    }
}

/// A place [m] as what a number of single precision holds, and the rest.
pub fn split(place: Vector3<f64>) -> [[f32; 3]; 2] {
    let main = place.map(|x| x as f32);
    let rest = (place - main.map(f64::from)).map(|x| x as f32);
    [main.into(), rest.into()]
}
