//! The outermost of many points: the points that a camera has to see.

use pliant_geometry::Vector3;

/// Points for the placement of a camera. Inner points, which do not change it, may be dropped.
#[derive(Clone, Debug, Default)]
pub struct Outermost {
    points: Vec<Vector3>,
}

/// Points that are kept.
const MOST: usize = 100_000;

impl Outermost {
    /// Takes more points [m].
    pub fn add(&mut self, points: impl IntoIterator<Item = Vector3>) {
        self.points.extend(points);
        if self.points.len() > MOST {
            let outermost = directions().into_iter().filter_map(|direction| {
                self.points.iter().copied().max_by(|a, b| direction.dot(a).total_cmp(&direction.dot(b)))
            });
            self.points = outermost.collect();
        }
    }

    /// Returns the kept points.
    pub fn points(&self) -> &[Vector3] {
        &self.points
    }
}

/// Directions all around, about 8° apart (a spiral with the golden angle).
fn directions() -> Vec<Vector3> {
    let count = 1000;
    let direction = |index: i32| {
        let z = 1.0 - (2.0 * f64::from(index) + 1.0) / f64::from(count);
        let (angle, r) = (f64::from(index) * 2.399_963_229_728_653, (1.0 - z * z).sqrt());
        Vector3::new(r * angle.cos(), r * angle.sin(), z)
    };
    (0..count).map(direction).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_outermost_points_stay_among_many() {
        let mut outermost = Outermost::default();
        let far = Vector3::new(0.0, 3.0, 0.0);
        outermost.add([far]);
        let directions = directions();
        outermost.add((0..2 * MOST).map(|index| directions[index % 1000] * 0.5));
        assert!(outermost.points().len() <= 1000 && outermost.points().contains(&far));
    }
}
