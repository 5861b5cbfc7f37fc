//! Input of an organ mesher: the field of the whole body, and fields of its materials if there are several. A point
//! belongs to the material with the largest field. Fields come from the regions of an image, or from functions.

use pliant_geometry::{DataArray, Mesh, Vector3};
use pliant_imaging::{Cleaned, Cleaning, DistanceField, LabelError, LabelImage, Smoothing};

use crate::complex::MOST_MATERIALS;
use crate::field::ImplicitField;
use crate::given::{Given, Patches};
use crate::triangles::TriangleMesh;

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
    /// Volume of each material in the image [m³], if it comes from an image.
    volumes: Vec<Option<f64>>,
    /// What its fields were made of, if they were.
    given: Option<Given>,
}

impl<'a> Anatomy<'a> {
    /// A body of one material.
    pub fn new(label: i32, field: impl ImplicitField + 'a) -> Self {
        Self { whole: Box::new(field), materials: vec![(label, None)], volumes: vec![None], given: None }
    }

    /// The same of one material made of a closed surface, with its volume [m³], which meshes are to keep.
    pub(crate) fn of_surface(mut self, surface: TriangleMesh, volume: f64) -> Self {
        self.volumes[0] = Some(volume);
        self.given = Some(Given::Triangles(surface, self.materials[0].0));
        self
    }

    /// Adds a material: the part of the body inside `field` and not deeper inside another material. The rest belongs to
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
        require_choice(image, labels)?;
        let share = 1.0 / (labels.len() + 1) as f64;
        let part = |number: usize| move |done: f64| progress(share * (number as f64 + done));
        let (whole, done) = image.region(labels, smoothing.margin())?.clean(cleaning)?;
        let field = DistanceField::new(&whole, smoothing, &part(0))?;
        let (mut materials, mut volumes, mut others) = (vec![(labels[0], None)], vec![None], 0.0);
        let mut of_voxels: Vec<u8> = whole.inside.iter().map(|&inside| u8::from(inside)).collect();
        for (number, &label) in labels.iter().enumerate().skip(1) {
            let region = whole.part(image, label)?;
            let own = of_voxels.iter_mut().zip(&region.inside).filter(|(_, inside)| **inside);
            own.for_each(|(material, _)| *material = number as u8 + 1);
            others += region.volume();
            volumes.push(Some(region.volume()));
            let inner = DistanceField::within(&region, &whole, smoothing, &part(number))?;
            materials.push((label, Some(Box::new(inner) as Box<dyn ImplicitField>)));
        }
        volumes[0] = Some(whole.volume() - others);
        if labels.len() > 2 {
            // The remainder of several others is a poor measure of the first one: where two of them meet, it is as near as they
            // are.
            let first = DistanceField::within(
                &whole.part(image, labels[0])?,
                &whole,
                smoothing,
                &part(labels.len()),
            )?;
            materials[0].1 = Some(Box::new(first));
        }
        let given = Some(Given::Voxels { grid: whole.grid, materials: of_voxels });
        Ok((Anatomy { whole: Box::new(field), materials, volumes, given }, done))
    }

    /// Field of a material from 2 on.
    pub(crate) fn inner(&self, material: usize) -> &dyn ImplicitField {
        self.materials[material - 1].1.as_deref().unwrap_or(&*self.whole)
    }

    /// Field of the first material, if it is larger than the remainder of the others.
    pub(crate) fn first(&self) -> Option<&dyn ImplicitField> {
        self.materials[0].1.as_deref().map(|field| field as &dyn ImplicitField)
    }

    /// The field of the whole body.
    pub fn field(&self) -> &dyn ImplicitField {
        &*self.whole
    }

    /// Gives each cell the label of the material that its centre lies in, as cell data `label`.
    pub fn label(&self, mesh: &mut Mesh) {
        let Mesh { points, blocks, .. } = mesh;
        for block in blocks {
            let label = |cell: &[u32]| {
                let sum: Vector3 = cell.iter().map(|&node| points[node as usize]).sum();
                f64::from(self.label_at(&(sum / cell.len() as f64)))
            };
            let labels = block.cells().map(label).collect();
            block.data.insert("label".to_owned(), DataArray::scalar(labels));
        }
    }

    /// The label of a point of the body.
    fn label_at(&self, point: &Vector3) -> i32 {
        let depth = |(label, field): &(i32, Option<Box<dyn ImplicitField + 'a>>)| {
            Some((*label, field.as_ref()?.value(point))).filter(|(_, depth)| *depth > 0.0)
        };
        let deepest = self.materials.iter().filter_map(depth).max_by(|a, b| a.1.total_cmp(&b.1));
        deepest.map_or(self.materials[0].0, |(label, _)| label)
    }

    /// Labels of the materials.
    pub fn labels(&self) -> Vec<i32> {
        self.materials.iter().map(|(label, _)| *label).collect()
    }

    /// The source of the body.
    pub(crate) fn given(&self) -> Option<&Given> {
        self.given.as_ref()
    }

    /// The faces of its source.
    pub(crate) fn patches(&self) -> Patches {
        self.given.as_ref().map_or_else(Patches::default, |given| given.patches(&self.labels()))
    }

    /// Tolerated distance of a mesh from its input [m]: the diagonal of a voxel for an image, otherwise 0.
    pub fn resolution(&self) -> f64 {
        self.given.as_ref().map_or(0.0, Given::resolution)
    }

    /// Volumes of the materials in the image [m³], where known.
    pub fn volumes(&self) -> &[Option<f64>] {
        &self.volumes
    }
}

/// Checks that labels can be meshed together: at least one, each once, without the background, not
/// too many.
fn require_choice(image: &LabelImage, labels: &[i32]) -> Result<(), LabelError> {
    let repeated = (1..labels.len()).find(|&at| labels[..at].contains(&labels[at]));
    match repeated {
        _ if labels.is_empty() => Err(LabelError::NoneChosen { present: image.present() }),
        _ if labels.contains(&0) => Err(LabelError::Background { present: image.present() }),
        Some(at) => Err(LabelError::Repeated { label: labels[at] }),
        None if labels.len() > MOST_MATERIALS => {
            Err(LabelError::TooManyLabels { labels: labels.len(), limit: MOST_MATERIALS })
        }
        None => Ok(()),
    }
}

impl std::fmt::Debug for Anatomy<'_> {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.debug_struct("Anatomy").field("labels", &self.labels()).finish_non_exhaustive()
    }
}
