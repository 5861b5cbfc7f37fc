//! Bodies from the regions of a label image (feature `imaging`).

use pliant_imaging::{Cleaned, Cleaning, LabelError, LabelImage, Smoothing};

use crate::error::MeshingError;
use crate::input::anatomy::Anatomy;
use crate::input::field::ImplicitField;
use crate::surface::triangles::TriangleMesh;
use crate::tets::complex::MOST_MATERIALS;

/// Best smoothing of the field of an image if [`SURFACE_PAIRS`] smooth its surface afterwards. Of the
/// settings tested on labels of the analytic liver and brain, this one stays closest to them. With sigma 1
/// and no pairs, which suits tetrahedra, the largest distance is 1.5 times as large on the liver and twice on
/// the brain. Without sigma the steps of the voxels remain.
pub const SURFACE_SMOOTHING: Smoothing = Smoothing { sigma: 0.55, clip: 6.0 };

/// Pairs of moves for [`TriangleMesh::smooth`](crate::TriangleMesh::smooth) after that.
pub const SURFACE_PAIRS: usize = 50;

impl TriangleMesh {
    /// The smooth surface of a body in an image, on a grid of `step` [m], with [`SURFACE_SMOOTHING`] of its
    /// field.
    ///
    /// # Errors
    /// If the box of the body is empty or not finite, or the grid is too large.
    pub fn of_image(anatomy: &Anatomy<'_>, step: f64, cell_limit: usize) -> Result<Self, MeshingError> {
        let mut surface = Self::of_field(anatomy.field(), step, cell_limit)?;
        surface.smooth(SURFACE_PAIRS);
        Ok(surface)
    }
}

impl Anatomy<'static> {
    /// Makes one body from the regions of some labels of an image, each a material. The regions are cleaned
    /// together (gaps and holes are filled with the first label) and smoothed one by one. `progress` hears
    /// fractions from 0 to 1.
    pub fn from_image(
        image: &LabelImage,
        labels: &[i32],
        cleaning: &Cleaning,
        smoothing: &Smoothing,
        progress: &dyn Fn(f64),
    ) -> Result<(Self, Cleaned), LabelError> {
        require_choice(image, labels)?;
        let share = 1.0 / (labels.len() + 1) as f64;
        let part = |number: usize| move |done: f64| progress(share * (number as f64 + done));
        let (whole, done) = image.region(labels, smoothing.margin())?.clean(cleaning)?;
        let field = whole.distance_field(smoothing, &part(0))?;
        let (mut materials, mut volumes, mut others) = (vec![(labels[0], None)], vec![None], 0.0);
        let parts = whole.parts(image, labels)?;
        for (number, &label) in labels.iter().enumerate().skip(1) {
            others += parts.volume(number + 1);
            volumes.push(Some(parts.volume(number + 1)));
            let inner = parts.distance_field(number + 1, smoothing, &part(number))?;
            materials.push((label, Some(Box::new(inner) as Box<dyn ImplicitField>)));
        }
        volumes[0] = Some(whole.volume() - others);
        if labels.len() > 2 {
            // The remainder of several others measures the first one poorly: where two others meet, it is as
            // near as they are.
            let first = parts.distance_field(1, smoothing, &part(labels.len()))?;
            materials[0].1 = Some(Box::new(first));
        }
        let mut body = Self::new(labels[0], field);
        (body.materials, body.volumes) = (materials, volumes);
        Ok((body.measured_to_voxels(whole.grid, parts.into_numbers()), done))
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
