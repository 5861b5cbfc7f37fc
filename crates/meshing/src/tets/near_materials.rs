//! The materials near a point of a body made of voxels. The field of each material is a signed distance that
//! is positive only within a box. Where this box is far, the point is in another material. Without this
//! search, cutting out n materials takes n² fields at each point.

use pliant_geometry::Vector3;

use crate::input::anatomy::Anatomy;

/// Cubes along the longest side of the body.
const ALONG: f64 = 32.0;

/// The materials whose boxes are near, cube by cube.
pub(crate) struct NearMaterials {
    low: Vector3,
    /// Edge of the cubes [m].
    edge: f64,
    dims: [usize; 3],
    /// The materials of each cube, increasing.
    cubes: Vec<Vec<usize>>,
    /// The box round each material, larger by the room; none if all materials count everywhere.
    boxes: Vec<[Vector3; 2]>,
    materials: usize,
}

impl NearMaterials {
    /// Sorts the materials of a body by place, for cells of `edge` [m]. A material counts in its box and an
    /// edge round it. In bodies of functions each counts everywhere.
    pub(crate) fn new(anatomy: &Anatomy<'_>, edge: f64) -> Self {
        let materials = anatomy.labels().len();
        let everywhere = Self {
            low: Vector3::zeros(),
            edge: 1.0,
            dims: [1; 3],
            cubes: vec![(1..=materials).collect()],
            boxes: Vec::new(),
            materials,
        };
        if !anatomy.has_own_fields() {
            return everywhere;
        }
        let room = Vector3::repeat(edge);
        let boxes: Vec<[Vector3; 2]> = (1..=materials)
            .map(|material| {
                let (low, high) = anatomy.inner(material).bounds();
                [low - room, high + room]
            })
            .collect();
        let (low, high) = boxes
            .iter()
            .fold((boxes[0][0], boxes[0][1]), |(low, high), [from, to]| (low.inf(from), high.sup(to)));
        let edge = (high - low).amax() / ALONG;
        let dims = [0, 1, 2].map(|axis| ((high[axis] - low[axis]) / edge).ceil().max(1.0) as usize);
        let mut near = Self { low, edge, dims, boxes, materials, ..everywhere };
        near.cubes = vec![Vec::new(); dims.iter().product()];
        for material in 1..=materials {
            let [first, last] = near.boxes[material - 1].map(|corner| near.cube(&corner));
            for k in first[2]..=last[2] {
                for j in first[1]..=last[1] {
                    for i in first[0]..=last[0] {
                        near.cubes[i + dims[0] * (j + dims[1] * k)].push(material);
                    }
                }
            }
        }
        near
    }

    /// The materials that a point can be in; all where no box is near.
    pub(crate) fn of(&self, point: &Vector3) -> impl Iterator<Item = usize> {
        let [i, j, k] = self.cube(point);
        let listed = &self.cubes[i + self.dims[0] * (j + self.dims[1] * k)];
        let fallback = 1..=if listed.is_empty() { self.materials } else { 0 };
        listed.iter().copied().chain(fallback)
    }

    /// True if a point is outside of the box of a material and an edge round it.
    pub(crate) fn is_far(&self, material: usize, point: &Vector3) -> bool {
        self.boxes
            .get(material - 1)
            .is_some_and(|[low, high]| (0..3).any(|axis| point[axis] < low[axis] || point[axis] > high[axis]))
    }

    fn cube(&self, point: &Vector3) -> [usize; 3] {
        let place = (point - self.low) / self.edge;
        [0, 1, 2].map(|axis| (place[axis].max(0.0) as usize).min(self.dims[axis] - 1))
    }
}
