//! Changes of the shells' triangles: evening out, halving, collapsing.

use pliant_geometry::Vector3;

use super::effort::Effort;
use super::fit::frame;
use super::target::Target;
use super::{LEAST_SHAPE, Shells};
use crate::surface::triangles::{cross, shape};

/// Shape above which moves may make a triangle worse.
const GOOD_SHAPE: f64 = 0.75;

/// Triangles are worth less where the cosine to the normal of a corner is below this.
const ALONG: f64 = 0.3;

/// Points nearer to each other than this part of the diagonal coincide.
const COINCIDING: f64 = 1e-9;

/// Least shape of triangles after a collapse, before they are evened out.
const LEAST_COLLAPSED: f64 = 0.3;

/// Searches to move a point along the target.
const SEARCHES: usize = 5;

/// Points of a border stay where they are if their edges there meet at less than this angle [rad].
const BEND: f64 = 2.0;

impl Shells {
    /// Puts a point on the target, or on its border or sharp edge, with the normal there.
    pub(super) fn place(&mut self, point: u32, target: &Target) {
        let facing = self.mesh.point_normal(point);
        let place = self.projected(point, &self.mesh.points[point as usize], &facing, target);
        self.mesh.points[point as usize] = place;
        let normal = target.foot(&place, &facing, self.reach(point)).1;
        self.normals[point as usize] = if normal == Vector3::zeros() { facing } else { normal };
        self.stand(point);
    }

    /// The nearest place of the target for a moving point, on the side that its triangles look to.
    fn projected(&self, point: u32, to: &Vector3, facing: &Vector3, target: &Target) -> Vector3 {
        if self.mesh.marked(point).len() > 2 {
            *to
        } else if self.on_border[point as usize] {
            target.reference.closest_on_lines(to)
        } else {
            target.foot(to, facing, self.reach(point)).0
        }
    }

    /// The shortest edge at a point [m].
    fn reach(&self, point: u32) -> f64 {
        let here = self.mesh.points[point as usize];
        let around = self.mesh.neighbours(point);
        around.iter().map(|&n| (self.mesh.points[n as usize] - here).norm()).fold(f64::INFINITY, f64::min)
    }

    /// Puts the points of borders on the borders of the target. Decimation leaves them near, and neither
    /// evening out nor the fit need move them.
    pub(super) fn place_border(&mut self, target: &Target) {
        for point in 0..self.mesh.points.len() as u32 {
            if self.on_border[point as usize] {
                self.place(point, target);
            }
        }
    }

    /// Flips edges and moves points along the target to better triangles.
    pub(super) fn even_out(&mut self, target: &Target, times: usize, effort: &mut Effort) {
        for _ in 0..times {
            effort.search(self.active.iter().filter(|active| **active).count(), SEARCHES);
            for [a, b] in self.mesh.edges() {
                let Some(new) = self.mesh.flipped(a, b) else { continue };
                let [Some(s), Some(t)] = self.mesh.sides(a, b) else { continue };
                let worst = |of: [[u32; 3]; 2]| {
                    of.iter().map(|&nodes| self.worth(nodes, self.at(nodes))).fold(1.0, f64::min)
                };
                let stands = |of: [[u32; 3]; 2]| {
                    of.iter().map(|&nodes| self.stands(nodes, self.at(nodes))).fold(1.0, f64::min)
                };
                let active = new.as_flattened().iter().all(|&n| self.active[n as usize]);
                let old = [s, t].map(|t| self.mesh.triangles[t as usize]);
                if active
                    && worst(new) > 1.1 * worst(old)
                    && !self.tilts(stands(old), stands(new))
                    && (!self.mesh.would_cross(&new, &[s, t]) || self.mesh.would_cross(&old, &[s, t]))
                {
                    self.mesh.flip(a, b, new);
                }
            }
            for point in 0..self.mesh.points.len() as u32 {
                if self.active[point as usize] {
                    self.move_along(point, target);
                }
            }
        }
        self.stand_all();
    }

    fn at(&self, nodes: [u32; 3]) -> [Vector3; 3] {
        nodes.map(|n| self.mesh.points[n as usize])
    }

    /// The least cosine between the normal of a triangle and the normals of its corners.
    fn stands(&self, nodes: [u32; 3], x: [Vector3; 3]) -> f64 {
        self.along(nodes, &cross(x).try_normalize(0.0).unwrap_or_default())
    }

    /// The shape of a triangle, reduced where its normal leans from the normals of its corners, down to 0 at
    /// a right angle.
    fn worth(&self, nodes: [u32; 3], x: [Vector3; 3]) -> f64 {
        shape(x) * (self.stands(nodes, x) / ALONG).clamp(0.0, 1.0)
    }

    /// Least worth of the triangles round a point, were it at a position.
    pub(super) fn worth_round(&self, point: u32, position: &Vector3) -> f64 {
        self.least_round(point, position, |nodes, x| self.worth(nodes, x))
    }

    /// Least cosine between the triangles round a point, were it at a position, and the normals of their
    /// corners.
    pub(super) fn upright_round(&self, point: u32, position: &Vector3) -> f64 {
        self.least_round(point, position, |nodes, x| self.stands(nodes, x))
    }

    fn least_round(
        &self,
        point: u32,
        position: &Vector3,
        value: impl Fn([u32; 3], [Vector3; 3]) -> f64,
    ) -> f64 {
        let of = |&t: &u32| {
            let nodes = self.mesh.triangles[t as usize];
            value(nodes, nodes.map(|n| if n == point { *position } else { self.mesh.points[n as usize] }))
        };
        self.mesh.star[point as usize].iter().map(of).fold(f64::INFINITY, f64::min)
    }

    /// Moves a point towards evener triangles, as long as no triangle there gets worse than the worst. Where
    /// triangles are poor, it moves to the best of some places around.
    fn move_along(&mut self, point: u32, target: &Target) {
        let here = self.mesh.points[point as usize];
        if let [a, b] = self.mesh.marked(point)[..]
            && (self.mesh.points[a as usize] - here).angle(&(self.mesh.points[b as usize] - here)) < BEND
        {
            return;
        }
        let Some(aim) = self.mesh.even_place(point) else { return };
        let facing = self.mesh.point_normal(point);
        let project = |x: Vector3| self.projected(point, &x, &facing, target);
        let aim = project(aim);
        let worth_here = self.worth_round(point, &here);
        let upright = self.upright_round(point, &here);
        let mut aims = vec![project(here + 0.4 * (aim - here)), aim];
        if worth_here < GOOD_SHAPE {
            let size = 0.15 * self.reach(point);
            let [first, second, _] = frame(&self.normals[point as usize]);
            let way = |k: usize| (k as f64 * std::f64::consts::FRAC_PI_4).sin_cos();
            aims.extend((0..8).map(|k| project(here + size * (way(k).1 * first + way(k).0 * second))));
        }
        let best = aims
            .into_iter()
            .filter(|aim| !self.tilts(upright, self.upright_round(point, aim)))
            .map(|aim| (self.worth_round(point, &aim).min(GOOD_SHAPE), aim))
            .max_by(|a, b| a.0.total_cmp(&b.0).then(std::cmp::Ordering::Greater));
        if let Some((worth, aim)) = best
            && worth >= worth_here.min(GOOD_SHAPE)
        {
            let normal = self.normals[point as usize];
            self.mesh.points[point as usize] = aim;
            self.place(point, target);
            if self.is_crossed_round(point) {
                let moved = std::mem::replace(&mut self.mesh.points[point as usize], here);
                if self.is_crossed_round(point) {
                    self.mesh.points[point as usize] = moved;
                } else {
                    self.normals[point as usize] = normal;
                    self.stand(point);
                }
            }
        }
    }

    /// True if flat triangles round a point cross any.
    fn is_crossed_round(&self, point: u32) -> bool {
        let star = &self.mesh.star[point as usize];
        let nodes: Vec<[u32; 3]> = star.iter().map(|&t| self.mesh.triangles[t as usize]).collect();
        self.mesh.would_cross(&nodes, star)
    }

    /// Halves the shells that are farther off than a bound at their longest edges, the worst first, up to a
    /// number. These shells, their neighbours and poor triangles may move from then on. Returns how many
    /// edges were halved.
    pub(super) fn refine(&mut self, far: &[f64], bound: f64, room: usize, target: &Target) -> usize {
        let mut order: Vec<u32> = self.mesh.alive().filter(|&t| far[t as usize] > bound).collect();
        order.sort_by(|&a, &b| far[b as usize].total_cmp(&far[a as usize]));
        let mut touched = vec![false; far.len()];
        let mut halved = 0;
        let mut changed = self.corners_of(far, bound);
        for t in order {
            if halved == room {
                break;
            }
            let edge = self.longest_edge(t);
            let sides = self.mesh.sides(edge[0], edge[1]);
            if sides.iter().flatten().any(|&s| touched[s as usize]) {
                continue;
            }
            sides.iter().flatten().for_each(|&s| touched[s as usize] = true);
            let fresh = self.halve(t, edge, target);
            touched.resize(self.mesh.triangles.len(), true);
            changed.push(fresh);
            halved += 1;
        }
        let poor = |t: &u32| {
            let nodes = self.mesh.triangles[*t as usize];
            self.worth(nodes, self.at(nodes)) < LEAST_SHAPE
        };
        changed.extend(self.mesh.alive().filter(poor).flat_map(|t| self.mesh.triangles[t as usize]));
        self.activate(changed);
        self.stand_all();
        halved
    }

    /// The longest edge of a shell.
    pub(super) fn longest_edge(&self, shell: u32) -> [u32; 2] {
        let nodes = self.mesh.triangles[shell as usize];
        let length =
            |k: &usize| (self.mesh.corners(shell)[*k] - self.mesh.corners(shell)[(k + 1) % 3]).norm();
        let longest = [0, 1, 2].into_iter().max_by(|a, b| length(a).total_cmp(&length(b))).unwrap_or(0);
        [nodes[longest], nodes[(longest + 1) % 3]]
    }

    /// Halves a shell, and its neighbour there, at one of its edges. Returns the new point, which may move.
    pub(super) fn halve(&mut self, shell: u32, [a, b]: [u32; 2], target: &Target) -> u32 {
        let patch = self.patch(shell);
        let nodes = self.mesh.triangles[shell as usize];
        let place = nodes.map(|n| if n == a || n == b { 0.5 } else { 0.0 });
        let is_marked = self.mesh.is_marked(a, b);
        let is_sharp = is_marked && self.mesh.sides(a, b)[1].is_some();
        let fresh = self.mesh.split(a, b, patch.point(place));
        self.normals.push(patch.normal(place));
        self.on_border.push(is_marked);
        self.creased.push(is_sharp);
        self.sharp.push(is_sharp);
        self.active.push(true);
        let middle = 0.5 * (self.mesh.points[a as usize] + self.mesh.points[b as usize]);
        self.place(fresh, target);
        if self.is_crossed_round(fresh) || self.reach(fresh) <= COINCIDING * target.diagonal {
            // The unprojected place, which crosses nothing new. Points that fall on each other would have no
            // curve between them.
            self.mesh.points[fresh as usize] = middle;
            self.stand(fresh);
        }
        fresh
    }

    /// True if an edge may collapse into its first end: the second is on no border, sharp edge or crease.
    pub(super) fn may_collapse(&self, [keep, gone]: [u32; 2]) -> bool {
        !self.on_border[gone as usize] && !self.creased[gone as usize] && self.mesh.may_collapse(keep, gone)
    }

    /// Joins the ends of an edge, in the middle if the first may move. Returns whether that was possible:
    /// triangles keep their sides and some shape, and flat ones do not cross. After a failure the shells must
    /// not be used.
    pub(super) fn collapse(&mut self, [keep, gone]: [u32; 2], target: &Target) -> bool {
        let stays = self.on_border[keep as usize] || self.creased[keep as usize];
        let [here, there] = [keep, gone].map(|n| self.mesh.points[n as usize]);
        let position = if stays { here } else { 0.5 * (here + there) };
        if !self.mesh.keeps_sides(keep, gone, &position, LEAST_COLLAPSED) {
            return false;
        }
        self.mesh.collapse(keep, gone, position);
        self.active[gone as usize] = false;
        if !stays {
            self.place(keep, target);
        }
        self.stand_all();
        !self.is_crossed_round(keep)
    }
}
