//! The surfaces of an anatomy: the sides of points, and projection onto surfaces. Each surface may be shifted
//! slightly outwards, so that facets between points of a curved surface enclose the right volume.

use pliant_geometry::Vector3;

use crate::input::anatomy::Anatomy;
use crate::tets::complex::{OUTSIDE, Sides, materials_of};
use crate::tets::near_materials::NearMaterials;

/// The surfaces of the whole body and of its inner materials.
pub(crate) struct Surfaces<'a> {
    anatomy: &'a Anatomy<'a>,
    /// Field values at the surfaces of the whole (0) and of the inner materials [m].
    levels: Vec<f64>,
    /// Lattice constant of the mesh [m].
    edge: f64,
    /// Materials that a point can be deep in.
    near: NearMaterials,
}

impl<'a> Surfaces<'a> {
    /// Makes the surfaces for a mesh with a lattice constant [m].
    pub(crate) fn new(anatomy: &'a Anatomy<'a>, edge: f64) -> Self {
        Self {
            anatomy,
            levels: vec![0.0; anatomy.labels().len()],
            edge,
            near: NearMaterials::new(anatomy, edge),
        }
    }

    /// Lattice constant of the mesh [m].
    pub(crate) fn edge(&self) -> f64 {
        self.edge
    }

    /// Number of materials.
    pub(crate) fn materials(&self) -> usize {
        self.levels.len()
    }

    /// Moves the surface of the whole (0) or of an inner material (its number less one) outwards [m], by at
    /// most `most` in all. Returns true if it moves.
    pub(crate) fn shift(&mut self, surface: usize, outwards: f64, most: f64) -> bool {
        let level = (self.levels[surface] - outwards).clamp(-most, most);
        std::mem::replace(&mut self.levels[surface], level) != level
    }

    /// Depth of a point inside a material (numbered from 1) relative to all others [m]. Far from the material
    /// only the sign counts.
    pub(crate) fn inside(&self, material: usize, point: &Vector3) -> f64 {
        if self.near.is_far(material, point) {
            return -self.edge;
        }
        let depth = self.depth(material, point);
        let others = self.near.of(point).filter(|&other| other != material);
        depth - others.map(|other| self.depth(other, point)).fold(-f64::MAX, f64::max)
    }

    /// The material that a point is deepest in.
    pub(crate) fn deepest(&self, point: &Vector3) -> usize {
        let depths = self.near.of(point).map(|material| (self.depth(material, point), material));
        depths.max_by(|a, b| a.0.total_cmp(&b.0)).map_or(1, |(_, material)| material)
    }

    /// Field of a material [m]. If the first material has no field, its value is minus the deepest of the
    /// others: it is their remainder.
    fn depth(&self, material: usize, point: &Vector3) -> f64 {
        match (material, self.anatomy.first()) {
            (1, Some(first)) => first.value(point),
            (1, None) => -self.inner().map(|m| self.depth(m, point)).fold(f64::NEG_INFINITY, f64::max),
            (m, _) => self.anatomy.inner(m).value(point) - self.levels[m - 1],
        }
    }

    /// The materials with their own field.
    fn inner(&self) -> impl Iterator<Item = usize> {
        2..=self.levels.len()
    }

    /// Field of a material [m] and its gradient.
    fn depth_and_slope(&self, material: usize, point: &Vector3) -> (f64, Vector3) {
        match (material, self.anatomy.first()) {
            (1, Some(first)) => first.value_and_gradient(point),
            (1, None) => {
                let fields = self.inner().map(|inner| self.depth_and_slope(inner, point));
                let (depth, slope) = fields
                    .max_by(|a, b| a.0.total_cmp(&b.0))
                    .unwrap_or((f64::NEG_INFINITY, Vector3::zeros()));
                (-depth, -slope)
            }
            (m, _) => {
                let (value, gradient) = self.anatomy.inner(m).value_and_gradient(point);
                (value - self.levels[m - 1], gradient)
            }
        }
    }

    /// Constraints, with gradients, that are zero at a point between sides. They are the field of the body on
    /// its boundary and the difference of two materials between them. At most three.
    pub(crate) fn constraints(&self, sides: Sides, point: &Vector3) -> Constraints {
        let mut found = Constraints::default();
        if sides & OUTSIDE != 0 {
            let (value, gradient) = self.anatomy.field().value_and_gradient(point);
            found.push(value - self.levels[0], gradient);
        }
        let mut materials = materials_of(sides);
        if let (Some(first), Some(second)) = (materials.next(), materials.next()) {
            let (depth, slope) = self.depth_and_slope(first, point);
            for other in std::iter::once(second).chain(materials).take(3 - found.count) {
                let (of_other, its_slope) = self.depth_and_slope(other, point);
                // Half the difference has the slope of a distance.
                found.push(0.5 * (depth - of_other), 0.5 * (slope - its_slope));
            }
        }
        found
    }

    /// Distance of a point from the place where its sides meet [m].
    pub(crate) fn off(&self, sides: Sides, point: &Vector3) -> f64 {
        self.constraints(sides, point).largest()
    }

    /// True if a point is inside the body, or outside with more than `room` [m] to the opposite bank.
    pub(crate) fn has_room(&self, point: &Vector3, room: f64) -> bool {
        let field = self.anatomy.field();
        let depth = |point: &Vector3| field.value(point) - self.levels[0];
        let here = depth(point);
        let onward = point - room * field.gradient(point).try_normalize(0.0).unwrap_or_default();
        here >= 0.0 || depth(&onward) < here - room / 2.0
    }

    /// Finds the closest point between the same sides by Newton's method, with least-move steps of at most
    /// `longest` [m]. Returns this point and the gradient of the first constraint there; `None` if it is not
    /// found.
    pub(crate) fn project(&self, sides: Sides, from: &Vector3, longest: f64) -> Option<(Vector3, Vector3)> {
        let mut point = *from;
        for _ in 0..12 {
            let constraints = self.constraints(sides, &point);
            if constraints.count == 0 || constraints.largest() < 1e-4 * longest {
                return Some((point, constraints.first_gradient()));
            }
            let step = constraints.newton_step()?;
            let length = step.norm();
            point -= if length > longest { step * (longest / length) } else { step };
        }
        None
    }
}

/// Values that must be zero, and their gradients.
#[derive(Default)]
pub(crate) struct Constraints {
    values: [f64; 3],
    gradients: [Vector3; 3],
    count: usize,
}

impl Constraints {
    fn push(&mut self, value: f64, gradient: Vector3) {
        if self.count < 3 {
            (self.values[self.count], self.gradients[self.count]) = (value, gradient);
            self.count += 1;
        }
    }

    pub(crate) fn largest(&self) -> f64 {
        self.values[..self.count].iter().fold(0.0, |largest, value| largest.max(value.abs()))
    }

    /// Gradient of the first constraint: on the boundary, the gradient of the body's field.
    pub(crate) fn first_gradient(&self) -> Vector3 {
        self.gradients[0]
    }

    /// The shortest step that makes the linear parts zero: Jᵀ (J Jᵀ)⁻¹ c.
    fn newton_step(&self) -> Option<Vector3> {
        let [a, b, c] = &self.gradients;
        let [p, q, r] = self.values;
        match self.count {
            1 => Some(a * (p / a.norm_squared())).filter(|step| step.iter().all(|x| x.is_finite())),
            2 => {
                let (aa, ab, bb) = (a.norm_squared(), a.dot(b), b.norm_squared());
                let determinant = aa * bb - ab * ab;
                // Surfaces that meet at less than 0.6° have no usable line.
                (determinant > 1e-4 * aa * bb)
                    .then(|| a * ((bb * p - ab * q) / determinant) + b * ((aa * q - ab * p) / determinant))
            }
            _ => {
                let matrix = nalgebra::Matrix3::from_rows(&[a.transpose(), b.transpose(), c.transpose()]);
                matrix.try_inverse().map(|inverse| inverse * Vector3::new(p, q, r))
            }
        }
    }
}
