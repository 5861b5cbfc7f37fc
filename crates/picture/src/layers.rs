//! The triangles of regions that one sees through: after all others, from the farthest to the nearest.
//! Borders between labels, which lie inside of bodies, are drawn where one sees them.

use crate::subject::{KIND, Subject};

/// Triangles in the order in which they are drawn.
#[derive(Clone, Debug, Default)]
pub(crate) struct Layers {
    /// Opaque ones, then the others.
    pub list: Vec<[u32; 4]>,
    pub opaque: usize,
    /// The points of the corners of each one that is not opaque.
    corners: Vec<[u32; 3]>,
    /// Distance and number of each one that is not opaque.
    order: Vec<(f32, u32)>,
}

impl Layers {
    /// Makes the layers of a subject from the opacity of each kind of cells. Returns `None` if all are
    /// opaque.
    pub fn new(subject: &Subject, opacities: &[f32]) -> Option<Self> {
        if opacities.iter().all(|opacity| *opacity >= 1.0) {
            return None;
        }
        let opacity = |triangle: &[u32; 4]| opacities[(triangle[3] >> KIND) as usize];
        // A border belongs to the more opaque side.
        let border = |(triangle, &beyond): (&[u32; 4], &u32)| {
            let (here, other) = (opacity(triangle), opacities[beyond as usize]);
            let [a, b, c, word] = *triangle;
            let kind = if here >= other { word >> KIND } else { beyond };
            (here.min(other) < 1.0).then_some([a, b, c, (word & ((1 << KIND) - 1)) | (kind << KIND)])
        };
        let (outer, inner) = subject.triangles.split_at(subject.outer);
        let borders = inner.iter().zip(&subject.beyond).filter_map(border);
        let seen = outer.iter().copied().chain(borders).filter(|triangle| opacity(triangle) > 0.0);
        let (mut list, glass): (Vec<_>, Vec<_>) = seen.partition(|triangle| opacity(triangle) >= 1.0);
        let opaque = list.len();
        list.extend_from_slice(&glass);
        let corner = |vertex: u32| subject.vertices[vertex as usize];
        let corners = glass.iter().map(|&[a, b, c, _]| [a, b, c].map(corner)).collect();
        Some(Self { list, opaque, corners, order: Vec::new() })
    }

    /// Sorts the transparent triangles by their distance from the eye, with current points [m]. In parallel
    /// projection the distance is along the view.
    pub fn sort(&mut self, points: &[[f32; 4]], eye: [f32; 3], towards: Option<[f32; 3]>) -> &[[u32; 4]] {
        let far = |corners: &[u32; 3]| {
            let middle = [0, 1, 2]
                .map(|axis| corners.iter().map(|&point| points[point as usize][axis]).sum::<f32>() / 3.0);
            let off = [0, 1, 2].map(|axis| middle[axis] - eye[axis]);
            match towards {
                Some(towards) => -(0..3).map(|axis| off[axis] * towards[axis]).sum::<f32>(),
                None => off.iter().map(|x| x * x).sum(),
            }
        };
        self.order.clear();
        self.order.extend(self.corners.iter().map(far).zip(0..));
        self.order.sort_unstable_by(|a, b| b.0.total_cmp(&a.0).then(a.1.cmp(&b.1)));
        let glass = &mut self.list[self.opaque..];
        let before = glass.to_vec();
        let corners = self.corners.clone();
        for (place, &(_, from)) in self.order.iter().enumerate() {
            glass[place] = before[from as usize];
            self.corners[place] = corners[from as usize];
        }
        glass
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::subject::tests::tets;
    use pliant_geometry::DataArray;

    /// A cube of six tets around a diagonal, in two labels.
    fn subject() -> Subject {
        let mut mesh = tets(1);
        mesh.blocks[0].data.insert("label".into(), DataArray::scalar(vec![1.0, 1.0, 1.0, 2.0, 2.0, 2.0]));
        Subject::new(&mesh)
    }

    #[test]
    fn borders_are_drawn_where_one_sees_them_and_belong_to_what_hides_more() {
        let subject = subject();
        assert_eq!((subject.triangle_count(), subject.beyond.len()), (12, 2));
        assert!(Layers::new(&subject, &[1.0, 1.0]).is_none());
        let half = Layers::new(&subject, &[0.5, 1.0]).unwrap();
        assert_eq!((half.opaque, half.list.len()), (6 + 2, 14));
        let hidden = Layers::new(&subject, &[0.0, 1.0]).unwrap();
        assert_eq!((hidden.opaque, hidden.list.len()), (8, 8), "the same as without its cells");
    }

    #[test]
    fn what_one_sees_through_goes_from_the_farthest_to_the_nearest() {
        let subject = subject();
        let mut layers = Layers::new(&subject, &[0.5, 0.2]).unwrap();
        let points: Vec<[f32; 4]> =
            subject.points.iter().map(|p| [p.x as f32, p.y as f32, p.z as f32, 0.0]).collect();
        let height = |triangle: &[u32; 4]| -> f32 {
            triangle[..3].iter().map(|&vertex| points[subject.vertices[vertex as usize] as usize][2]).sum()
        };
        for _ in 0..2 {
            let sorted = layers.sort(&points, [0.5, 0.5, 1e3], None);
            let heights: Vec<f32> = sorted.iter().map(height).collect();
            assert!(heights.is_sorted() && heights.len() == 14, "{heights:?}");
            let sorted = layers.sort(&points, [0.5, 0.5, 9.0], Some([0.0, 0.0, -1.0]));
            assert!(sorted.iter().map(height).rev().is_sorted(), "from below");
        }
    }
}
