//! What a mesher of organs is given: the field of the whole body, and of each of its materials where there are several.
//! A point is of the material whose field is largest. Fields come from the regions of an image, or from functions.

use pliant_geometry::Vector3;
use pliant_imaging::{Cleaned, Cleaning, DistanceField, LabelError, LabelImage, Smoothing};

use crate::complex::{MOST_MATERIALS, OUTSIDE, Sides};
use crate::field::ImplicitField;

impl ImplicitField for DistanceField {
    fn value(&self, point: &Vector3) -> f64 {
        DistanceField::value(self, point)
    }

    fn bounds(&self) -> (Vector3, Vector3) {
        let [low, high] = DistanceField::bounds(self);
        (low, high)
    }

    fn gradient(&self, point: &Vector3) -> Vector3 {
        DistanceField::gradient(self, point)
    }
}

/// A body of one material or several, each with its label.
pub struct Anatomy<'a> {
    whole: Box<dyn ImplicitField + 'a>,
    /// Labels and fields of the materials; one material has the field of the whole body.
    materials: Vec<(i32, Option<Box<dyn ImplicitField + 'a>>)>,
    /// Volume of each material in the image [m³], where it comes from one.
    volumes: Vec<Option<f64>>,
}

impl<'a> Anatomy<'a> {
    /// A body of one material.
    pub fn new(label: i32, field: impl ImplicitField + 'a) -> Self {
        Self { whole: Box::new(field), materials: vec![(label, None)], volumes: vec![None] }
    }

    /// Adds a material: what of the body is inside `field` and not deeper inside that of another material. The rest is of
    /// the first material.
    pub fn with_inner(mut self, label: i32, field: impl ImplicitField + 'a) -> Self {
        self.materials.push((label, Some(Box::new(field))));
        self.volumes.push(None);
        self
    }

    /// The regions of some labels of an image as one body, each a material: cleaned together (gaps and holes are filled
    /// with the first label), smoothed one by one. `progress` hears fractions from 0 to 1.
    pub fn from_image(
        image: &LabelImage,
        labels: &[i32],
        cleaning: &Cleaning,
        smoothing: &Smoothing,
        progress: &dyn Fn(f64),
    ) -> Result<(Anatomy<'static>, Cleaned), LabelError> {
        if labels.len() > MOST_MATERIALS {
            return Err(LabelError::TooManyLabels { labels: labels.len(), limit: MOST_MATERIALS });
        }
        let share = 1.0 / (labels.len() + 1) as f64;
        let part = |number: usize| move |done: f64| progress(share * (number as f64 + done));
        let (whole, done) = image.region(labels, smoothing.margin())?.clean(cleaning)?;
        let field = DistanceField::new(&whole, smoothing, &part(0))?;
        let (mut materials, mut volumes): (Vec<(i32, Option<Box<dyn ImplicitField>>)>, Vec<_>) =
            Default::default();
        let mut others = 0.0;
        for (number, &label) in labels.iter().enumerate().skip(1) {
            let region = whole.part(image, label)?;
            others += region.volume();
            volumes.push(Some(region.volume()));
            let inner = DistanceField::within(&region, &whole, smoothing, &part(number))?;
            materials.push((label, Some(Box::new(inner))));
        }
        materials.insert(0, (labels[0], None));
        volumes.insert(0, Some(whole.volume() - others));
        Ok((Anatomy { whole: Box::new(field), materials, volumes }, done))
    }

    /// The field of the whole body.
    pub fn field(&self) -> &dyn ImplicitField {
        &*self.whole
    }

    /// Labels of the materials.
    pub fn labels(&self) -> Vec<i32> {
        self.materials.iter().map(|(label, _)| *label).collect()
    }

    /// Volumes of the materials in the image [m³], where known.
    pub(crate) fn volumes(&self) -> &[Option<f64>] {
        &self.volumes
    }

    /// How far a point is inside a material (numbered from 1) rather than in any other [m].
    pub(crate) fn inside(&self, material: usize, point: &Vector3) -> f64 {
        let own = self.depth(material, point);
        let others = (1..=self.materials.len()).filter(|&other| other != material);
        own - others.map(|other| self.depth(other, point)).fold(f64::NEG_INFINITY, f64::max)
    }

    /// Field of a material [m]. The first one has none of its own and is what the others leave: minus the deepest of
    /// them.
    fn depth(&self, material: usize, point: &Vector3) -> f64 {
        match &self.materials[material - 1].1 {
            Some(field) => field.value(point),
            None => -self.inner().map(|field| field.value(point)).fold(f64::NEG_INFINITY, f64::max),
        }
    }

    fn inner(&self) -> impl Iterator<Item = &(dyn ImplicitField + 'a)> {
        self.materials.iter().filter_map(|(_, field)| field.as_deref())
    }

    /// Gradient of the field of a material.
    fn slope(&self, material: usize, point: &Vector3) -> Vector3 {
        match &self.materials[material - 1].1 {
            Some(field) => field.gradient(point),
            None => {
                let deepest = self.inner().max_by(|a, b| a.value(point).total_cmp(&b.value(point)));
                deepest.map_or(Vector3::zeros(), |field| -field.gradient(point))
            }
        }
    }

    /// What must be zero at a point between sides, with its gradient: the field of the body on its boundary, the
    /// difference of two materials between them. At most three.
    pub(crate) fn constraints(&self, sides: Sides, point: &Vector3) -> Constraints {
        let mut found = Constraints::default();
        if sides & OUTSIDE != 0 {
            found.push(self.whole.value(point), self.whole.gradient(point));
        }
        let mut materials = (1..=self.materials.len()).filter(|&m| sides >> m & 1 == 1);
        if let Some(first) = materials.next() {
            for other in materials {
                // Half the difference has the slope of a distance.
                let value = 0.5 * (self.depth(first, point) - self.depth(other, point));
                found.push(value, 0.5 * (self.slope(first, point) - self.slope(other, point)));
            }
        }
        found
    }

    /// The closest point between the same sides, by Newton's method with steps of at most `longest` [m] on the least
    /// move; `None` if it is not found.
    pub(crate) fn project(&self, sides: Sides, from: &Vector3, longest: f64) -> Option<Vector3> {
        let mut point = *from;
        for _ in 0..12 {
            let constraints = self.constraints(sides, &point);
            if constraints.count == 0 || constraints.largest() < 1e-4 * longest {
                return Some(point);
            }
            let step = constraints.newton_step()?;
            let length = step.norm();
            point -= if length > longest { step * (longest / length) } else { step };
        }
        None
    }
}

impl std::fmt::Debug for Anatomy<'_> {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.debug_struct("Anatomy").field("labels", &self.labels()).finish_non_exhaustive()
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

    /// The shortest step that makes the linear parts zero: Jᵀ (J Jᵀ)⁻¹ c.
    fn newton_step(&self) -> Option<Vector3> {
        let [a, b, c] = &self.gradients;
        let [p, q, r] = self.values;
        match self.count {
            1 => Some(a * (p / a.norm_squared())).filter(|step| step.iter().all(|x| x.is_finite())),
            2 => {
                let (aa, ab, bb) = (a.norm_squared(), a.dot(b), b.norm_squared());
                let determinant = aa * bb - ab * ab;
                // Surfaces that meet at less than 0.6° have no line to speak of.
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
