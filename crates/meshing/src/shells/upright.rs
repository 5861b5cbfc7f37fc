//! Normals that stand on their triangles. A shell takes the normal of a vertex as the normal of its surface.
//! So this normal may lean by no more than 60° from the normal of any triangle round the vertex. Where the
//! surface folds too sharply for any such normal, the vertex is a crease. As in a shell without given
//! normals, each fan of triangles that meet at less than 45° then has its own normal. Edges between fans
//! leave the vertex straight.

use pliant_geometry::Vector3;

use super::Shells;

/// Least cosine between the normal of a vertex and the normals of its triangles: 60°, less the rounding of a
/// file in single precision.
const UPRIGHT: f64 = 0.501;

/// Least cosine between triangles of one fan: 45°, as shells without given normals have it.
const SMOOTH: f64 = std::f64::consts::FRAC_1_SQRT_2;

/// The unit vector nearest to `wish` among all that stand on all faces; `None` without any.
fn upright(faces: &[Vector3], wish: &Vector3) -> Option<Vector3> {
    let stands = |n: &Vector3| least_cosine(faces, n) >= UPRIGHT;
    if stands(wish) {
        return Some(*wish);
    }
    let middle = middle(faces);
    if !stands(&middle) {
        return None;
    }
    let (mut near, mut far, mut found) = (0.0, 1.0, middle);
    for _ in 0..20 {
        let part = 0.5 * (near + far);
        match ((1.0 - part) * wish + part * middle).try_normalize(1e-9).filter(stands) {
            Some(better) => (far, found) = (part, better),
            None => near = part,
        }
    }
    Some(found)
}

fn least_cosine(faces: &[Vector3], normal: &Vector3) -> f64 {
    faces.iter().map(|face| face.dot(normal)).fold(1.0, f64::min)
}

/// The unit vector whose largest angle to any face is least. It is the axis of the narrowest cone round all
/// faces, which touches two or three faces.
fn middle(faces: &[Vector3]) -> Vector3 {
    let mut best = (f64::NEG_INFINITY, faces.first().copied().unwrap_or_default());
    let mut consider = |axis: Vector3| {
        if let Some(axis) = axis.try_normalize(1e-12) {
            let least = least_cosine(faces, &axis);
            if least > best.0 {
                best = (least, axis);
            }
        }
    };
    for (i, a) in faces.iter().enumerate() {
        for (j, b) in faces.iter().enumerate().take(i) {
            consider(a + b);
            for c in &faces[..j] {
                let axis = (b - a).cross(&(c - a));
                consider(axis * axis.dot(a).signum());
            }
        }
    }
    best.1
}

impl Shells {
    /// Requires from this call on that normals stand on their triangles.
    pub(super) fn require_upright(&mut self) {
        self.strict = true;
        (0..self.mesh.points.len() as u32).for_each(|point| self.stand(point));
    }

    /// True if a change of the least cosine round a vertex must not happen. Once normals must stand, this is
    /// a change from upright to not upright. On the way to the goal, it is a change from along the surface to
    /// against it.
    pub(super) fn tilts(&self, before: f64, after: f64) -> bool {
        let least = if self.strict { UPRIGHT } else { 0.0 };
        before >= least && after < least
    }

    /// Turns the normal of a vertex just far enough to stand on all triangles round it. If no normal does,
    /// the vertex becomes a crease.
    pub(super) fn stand(&mut self, point: u32) {
        if !self.strict || self.sharp[point as usize] {
            return;
        }
        let star = self.mesh.star[point as usize].iter();
        let faces: Vec<Vector3> =
            star.map(|&t| self.mesh.normal(t)).filter(|n| *n != Vector3::zeros()).collect();
        let found = upright(&faces, &self.normals[point as usize]);
        self.creased[point as usize] = found.is_none();
        if let Some(normal) = found {
            self.normals[point as usize] = normal;
        }
    }

    /// Turns the normals of all vertices that may move, like [`Self::stand`].
    pub(super) fn stand_all(&mut self) {
        for point in 0..self.mesh.points.len() as u32 {
            if self.active[point as usize] {
                self.stand(point);
            }
        }
    }

    /// The least cosine between a triangle and the normals of its corners, creases left out.
    pub(super) fn along(&self, nodes: [u32; 3], normal: &Vector3) -> f64 {
        let smooth = nodes.iter().filter(|&&n| !self.creased[n as usize]);
        smooth.map(|&n| self.normals[n as usize].dot(normal)).fold(1.0, f64::min)
    }

    /// The normal of a corner of a shell, and whether the edges to the next corner and to the last leave it
    /// straight.
    pub(super) fn corner(&self, triangle: u32, corner: usize) -> (Vector3, [bool; 2]) {
        let nodes = self.mesh.triangles[triangle as usize];
        let point = nodes[corner];
        if self.is_flat(triangle) {
            return (self.mesh.normal(triangle), [true; 2]);
        }
        let arms = [nodes[(corner + 1) % 3], nodes[(corner + 2) % 3]];
        if !self.creased[point as usize] {
            let flat =
                |other: u32| self.mesh.sides(point, other).into_iter().flatten().any(|t| self.is_flat(t));
            return (self.normals[point as usize], arms.map(|other| !self.flat.is_empty() && flat(other)));
        }
        let star = self.mesh.star[point as usize].iter().copied().filter(|&t| !self.is_flat(t));
        let others = |t: u32| self.mesh.triangles[t as usize].into_iter().filter(move |&n| n != point);
        let mut fan = vec![triangle];
        let mut at = 0;
        while at < fan.len() {
            let triangle = fan[at];
            let joined = |t: &u32| {
                others(triangle).any(|n| self.mesh.triangles[*t as usize].contains(&n))
                    && self.mesh.normal(triangle).dot(&self.mesh.normal(*t)) > SMOOTH
            };
            let more: Vec<u32> = star.clone().filter(|t| !fan.contains(t) && joined(t)).collect();
            fan.extend(more);
            at += 1;
        }
        fan.sort_unstable();
        let weighted = |&t: &u32| {
            let here = self.mesh.points[point as usize];
            let mut arms = others(t).map(|n| self.mesh.points[n as usize] - here);
            let angle = arms.next().zip(arms.next()).map_or(0.0, |(u, v)| u.angle(&v));
            angle * self.mesh.normal(t)
        };
        let normal = fan.iter().map(weighted).sum::<Vector3>().try_normalize(0.0).unwrap_or_default();
        let leaves =
            |other: u32| self.mesh.sides(point, other).into_iter().flatten().any(|t| !fan.contains(&t));
        (normal, arms.map(leaves))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Two faces at an angle: the wish where it stands, else the wish leaned to 60° from the farther face.
    /// Beyond 120° no vector stands.
    #[test]
    fn a_normal_leans_no_more_than_it_must() {
        let tilted = |degrees: f64| Vector3::new(degrees.to_radians().sin(), 0.0, degrees.to_radians().cos());
        let faces = [tilted(-50.0), tilted(50.0)];
        assert_eq!(upright(&faces, &tilted(5.0)), Some(tilted(5.0)));
        let leaned = upright(&faces, &tilted(40.0)).unwrap();
        assert!((leaned.angle(&faces[0]).to_degrees() - 60.0).abs() < 0.1, "{leaned}");
        assert_eq!(upright(&[tilted(-61.0), tilted(61.0)], &tilted(0.0)), None);
        // Round a spike whose faces lean by 59° from its axis there is one, whatever the wish; by 61° there
        // is no such vector.
        let spike = |degrees: f64| {
            (0..7).map(|k| f64::from(k) * 0.9).map(move |turn| {
                let (s, c) = degrees.to_radians().sin_cos();
                Vector3::new(s * turn.cos(), s * turn.sin(), c)
            })
        };
        assert!(upright(&spike(59.0).collect::<Vec<_>>(), &-Vector3::z()).is_some());
        assert!(upright(&spike(61.0).collect::<Vec<_>>(), &Vector3::z()).is_none());
    }
}
