//! Input of an organ mesher: the field of the whole body, and fields of its materials if there are several. A
//! point belongs to the material with the largest field. Fields come from the regions of an image, or from
//! functions.

use pliant_geometry::{DataArray, DistanceField, Grid, Mesh, Vector3};

use crate::input::field::ImplicitField;
use crate::input::given::{Given, Patches};
use crate::surface::triangles::TriangleMesh;

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

    fn value_and_gradient(&self, point: &Vector3) -> (f64, Vector3) {
        DistanceField::value_and_gradient(self, point)
    }
}

/// A body of one material or several, each with its label.
pub struct Anatomy<'a> {
    whole: Box<dyn ImplicitField + 'a>,
    /// Labels and fields of the materials; one material has the field of the whole body.
    pub(crate) materials: Vec<(i32, Option<Box<dyn ImplicitField + 'a>>)>,
    /// Volume of each material in the image [m³], if it comes from an image.
    pub(crate) volumes: Vec<Option<f64>>,
    /// The triangles or voxels that the fields were made from, if any.
    given: Option<Given>,
}

impl<'a> Anatomy<'a> {
    /// A body of one material.
    pub fn new(label: i32, field: impl ImplicitField + 'a) -> Self {
        Self { whole: Box::new(field), materials: vec![(label, None)], volumes: vec![None], given: None }
    }

    /// Records the closed surface that the one material was made from, and its volume [m³], which meshes are
    /// to keep.
    pub(crate) fn of_surface(mut self, surface: TriangleMesh, volume: f64) -> Self {
        self.volumes[0] = Some(volume);
        self.given = Some(Given::Triangles(surface, self.materials[0].0));
        self
    }

    /// Measures distances of its meshes to the faces of these voxels. `materials` gives the material of each
    /// point of `grid`, numbered from 1 in the order of addition, 0 outside.
    ///
    /// # Panics
    /// If the numbers of materials and of points of the grid differ, or a material has no field.
    pub fn measured_to_voxels(mut self, grid: Grid, materials: Vec<u8>) -> Self {
        assert_eq!(materials.len(), grid.len(), "a material for each point of the grid");
        let largest = materials.iter().copied().max().unwrap_or(0);
        assert!(usize::from(largest) <= self.materials.len(), "material {largest} has no field");
        self.given = Some(Given::Voxels { grid, materials });
        self
    }

    /// Adds a material: the part of the body inside `field` and not deeper inside another material. The rest
    /// belongs to the first material. Meshes bear [`MOST_MATERIALS`](crate::MOST_MATERIALS).
    pub fn with_inner(mut self, label: i32, field: impl ImplicitField + 'a) -> Self {
        self.materials.push((label, Some(Box::new(field))));
        self.volumes.push(None);
        self
    }

    /// Field of a material from 2 on.
    pub(crate) fn inner(&self, material: usize) -> &dyn ImplicitField {
        self.materials[material - 1].1.as_deref().unwrap_or(&*self.whole)
    }

    /// Field of the first material, if it is larger than the remainder of the others.
    pub(crate) fn first(&self) -> Option<&dyn ImplicitField> {
        self.materials[0].1.as_deref().map(|field| field as &dyn ImplicitField)
    }

    /// True if each material has its own signed distance. Bodies of voxels have one from three materials on.
    pub(crate) fn has_own_fields(&self) -> bool {
        matches!(self.given, Some(Given::Voxels { .. }))
            && self.materials.iter().all(|(_, field)| field.is_some())
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

impl std::fmt::Debug for Anatomy<'_> {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.debug_struct("Anatomy").field("labels", &self.labels()).finish_non_exhaustive()
    }
}
