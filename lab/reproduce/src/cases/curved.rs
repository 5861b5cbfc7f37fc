//! Figures 8.2 to 8.4: the curved surface of shells, its carried surfaces, and its rendering. The surface
//! here is a cubic Bézier triangle from positions and nodal normals (PN triangles of Vlachos et al. 2001 with
//! arcs for edges). The thesis's deflection (8.3) along the normal of each facet leaves gaps between facets
//! that are not coplanar.

use nalgebra::{SMatrix, SVector, UnitQuaternion};
use pliant_geometry::{CellBlock, CellKind, Mesh, Vector3};
use pliant_implicit::{Assembly, AssemblyState, CurvedSurface, Picture};
use pliant_meshing::{DEFAULT_CELL_LIMIT, Pattern, Sheet, sphere};
use pliant_shells::element::Formulation;
use pliant_shells::{EdgeRule, Patch, Place};

use crate::case::{Case, CaseError, Correction, Findings, Row};
use crate::largest;
use crate::picture::{Body, View, figure};
use crate::shells::{Specimen, sheet};

/// Figure 8.2.
pub(crate) const PATCH: Case = Case {
    id: "fig-8.2",
    title: "Fig. 8.2: the curved surface of one shell, and a force on it",
    shows: "A triangle with rotated nodes: (a, b) subdivided three times, flat and curved; (c) a force on the curved \
            surface, transferred to forces and moments on the three nodes.",
    corrections: &[
        Correction {
            printed: "(8.5): C(6,7) = −3 x₂, C(7,7) = x₃²",
            correct: "−3 x₂² and x₃³.",
            why: "As printed C is singular at x₂ = 1.5 units of length.",
        },
        Correction {
            printed: "(8.21), (8.22): moments from entries 2, 3, 5, 6, 8, 9 of C⁻ᵀ P, forces by barycentric weights",
            correct: "Forces and moments by the transpose of the surface's own derivative J.",
            why: "Entries 1, 4 and 7 are the nodal forces of the same virtual work. Without them the moment of the nodal forces and moments differs \
                  from that of the force, by the number below.",
        },
    ],
    seconds: 1.0,
    compute: patch,
};

/// Figure 8.3.
pub const LAYERS: Case = Case {
    id: "fig-8.3",
    title: "Fig. 8.3: from shells to a contact point and back",
    shows: "Layers of one object: shells, their curved surface, a fine surface that it carries. Positions and \
            velocities pass down the layers. The force of a contact passes up to the shells, as forces and moments on \
            three nodes.",
    corrections: &[Correction {
        printed: "section 8.3.6: applyJT is the transpose of applyJ",
        correct: "True only if both use the same J.",
        why: "In the author's published code, points on edges take the mean deflection of two triangles in the frame of the last; \
              forces return differently. Here ⟨J v, f⟩ = ⟨v, Jᵀ f⟩ on every point.",
    }],
    seconds: 1.0,
    compute: layers,
};

/// Figure 8.4.
pub(crate) const RENDERING: Case = Case {
    id: "fig-8.4",
    title: "Fig. 8.4: shells that are subdivided, and an irregular mesh carried by them",
    shows: "A shell of few elements, rendered by subdividing its triangles, shows the edges between them; a carried \
            irregular mesh hides them. A watertight, nearly smooth surface looks good either way. The example is a \
            sphere of 20 shells, flattened and widened.",
    corrections: &[Correction {
        printed: "section 8.3.5: deflection (8.3) along the normal of each triangle",
        correct: "A Bézier triangle whose edges depend on the data of their own two nodes.",
        why: "Two facets that are not coplanar deflect a common edge along different normals. This opens a gap, on a sphere of 20 shells \
              of 3 % of the diagonal of its box.",
    }],
    seconds: 2.0,
    compute: rendering,
};

fn triangle_mesh(points: Vec<Vector3>, triangles: impl IntoIterator<Item = [u32; 3]>) -> Mesh {
    let nodes = triangles.into_iter().flatten().collect();
    Mesh { points, blocks: vec![CellBlock::new(CellKind::Triangle, nodes)], ..Mesh::default() }
}

/// Points of a picture on flat facets.
fn flat(model: &Assembly, state: &AssemblyState, place: &Place) -> Vector3 {
    let nodes = model.facets[place.facet as usize].nodes;
    nodes.iter().zip(place.weights).map(|(&node, w)| state.position[node as usize] * w).sum()
}

/// Nine functions (1, x, y, x², xy, y², x³, xy², y³) of (8.3) with their derivatives by y and, negative, by
/// x.
fn polynomial([x, y]: [f64; 2]) -> [[f64; 9]; 3] {
    [
        [1.0, x, y, x * x, x * y, y * y, x * x * x, x * y * y, y * y * y],
        [0.0, 0.0, 1.0, 0.0, x, 2.0 * y, 0.0, 2.0 * x * y, 3.0 * y * y],
        [0.0, -1.0, 0.0, -2.0 * x, -y, 0.0, -3.0 * x * x, -y * y, 0.0],
    ]
}

/// The thesis's surface over one facet.
struct Deflected {
    corners: [Vector3; 3],
    axes: [Vector3; 3],
    /// Corners in the facet's axes, from the first corner.
    local: [[f64; 2]; 3],
    /// (8.4) with the corrected (8.5).
    inverse: SMatrix<f64, 9, 9>,
    coefficients: SVector<f64, 9>,
}

impl Deflected {
    /// Makes the deflected facet of corners and their normals.
    fn new(corners: [Vector3; 3], normals: [Vector3; 3]) -> Self {
        let [a, b, c] = corners;
        let first = (b - a).normalize();
        let normal = (b - a).cross(&(c - a)).normalize();
        let axes = [first, normal.cross(&first), normal];
        let local = corners.map(|x| [axes[0].dot(&(x - a)), axes[1].dot(&(x - a))]);
        let rows = local.into_iter().flat_map(polynomial).flatten();
        let matrix = SMatrix::<f64, 9, 9>::from_row_iterator(rows);
        let inverse = matrix.try_inverse().unwrap_or_else(|| SMatrix::repeat(f64::NAN));
        let turned = normals.into_iter().flat_map(|n| {
            let turn =
                UnitQuaternion::rotation_between(&normal, &n).map_or(Vector3::zeros(), |q| q.scaled_axis());
            [0.0, axes[0].dot(&turn), axes[1].dot(&turn)]
        });
        let coefficients = inverse * SVector::<f64, 9>::from_iterator(turned);
        Self { corners, axes, local, inverse, coefficients }
    }

    fn place(&self, weights: [f64; 3]) -> [f64; 2] {
        [0, 1].map(|c| self.local.iter().zip(weights).map(|(x, w)| x[c] * w).sum())
    }

    fn point(&self, weights: [f64; 3]) -> Vector3 {
        let flat: Vector3 = self.corners.iter().zip(weights).map(|(x, w)| x * w).sum();
        let p = SVector::<f64, 9>::from(polynomial(self.place(weights))[0]);
        flat + self.axes[2] * p.dot(&self.coefficients)
    }

    /// Forces and moments on the corners by (8.21) and (8.22).
    fn nodal_forces(&self, weights: [f64; 3], force: &Vector3) -> [[Vector3; 2]; 3] {
        let p = SVector::<f64, 9>::from(polynomial(self.place(weights))[0]) * self.axes[2].dot(force);
        let omega = self.inverse.tr_mul(&p);
        std::array::from_fn(|i| {
            let moment = self.axes[0] * omega[3 * i + 1] + self.axes[1] * omega[3 * i + 2];
            [force * weights[i], moment]
        })
    }
}

/// Errors of force and moment of the nodal loads compared with a force at a point, over the force and over
/// force × mean edge.
fn resultants_off(
    corners: [Vector3; 3],
    nodal: [[Vector3; 2]; 3],
    place: Vector3,
    force: Vector3,
) -> [f64; 2] {
    let edge = (0..3).map(|i| (corners[i] - corners[(i + 1) % 3]).norm()).sum::<f64>() / 3.0;
    let sum: Vector3 = nodal.iter().map(|[f, _]| f).sum();
    let moment: Vector3 = nodal.iter().zip(corners).map(|([f, m], x)| x.cross(f) + m).sum();
    [(sum - force).norm() / force.norm(), (moment - place.cross(&force)).norm() / (force.norm() * edge)]
}

fn split(values: &SVector<f64, 18>) -> [[Vector3; 2]; 3] {
    std::array::from_fn(|i| [0, 3].map(|c| Vector3::from_fn(|r, _| values[6 * i + c + r])))
}

/// An arrow as triangles: a shaft and a head.
fn arrow(mesh: &mut Mesh, from: Vector3, to: Vector3, width: f64) {
    const SIDES: u32 = 16;
    let along = (to - from).normalize();
    let side = along.cross(&if along.x.abs() < 0.5 { Vector3::x() } else { Vector3::y() }).normalize();
    let other = along.cross(&side);
    let neck = to - along * (4.0 * width);
    let rings = [(from, 0.0), (from, 0.6), (neck, 0.6), (neck, 1.6), (to, 0.0)];
    let first = mesh.points.len() as u32;
    for (centre, radius) in rings {
        for i in 0..SIDES {
            let (sine, cosine) = (std::f64::consts::TAU * f64::from(i) / f64::from(SIDES)).sin_cos();
            mesh.points.push(centre + (side * cosine + other * sine) * (radius * width));
        }
    }
    let nodes = &mut mesh.blocks[0].nodes;
    for ring in 0..rings.len() as u32 - 1 {
        for i in 0..SIDES {
            let at = |ring: u32, i: u32| first + SIDES * ring + i % SIDES;
            let [a, b, c, d] = [at(ring, i), at(ring, i + 1), at(ring + 1, i + 1), at(ring + 1, i)];
            nodes.extend([a, b, c, a, c, d]);
        }
    }
}

fn patch() -> Result<Findings, CaseError> {
    let corners = [[0.0, 0.0, 0.0], [1.0, 0.05, 0.0], [0.35, 0.9, 0.0]].map(Vector3::from);
    let mut model_mesh = triangle_mesh(corners.to_vec(), [[0, 1, 2]]);
    model_mesh.point_sets.clear();
    let specimen = Specimen::new(model_mesh, [1e6, 0.3], 0.01, Formulation::default())?;
    let model = &specimen.model;
    let mut state = AssemblyState::at_rest(model);
    let turns = [[0.15, -0.30, 0.0], [0.10, 0.35, 0.0], [-0.40, 0.05, 0.0]];
    for (rotation, turn) in state.rotation.iter_mut().zip(turns) {
        *rotation = UnitQuaternion::from_scaled_axis(Vector3::from(turn));
    }
    let surface = CurvedSurface::new(model, EdgeRule::Arc);
    let patch = surface.patch(model, &state, 0);
    let Picture { places, triangles, .. } = surface.picture(model, 8);
    let flat_mesh = triangle_mesh(places.iter().map(|p| flat(model, &state, p)).collect(), triangles.clone());
    let curved_mesh = triangle_mesh(places.iter().map(|p| patch.point(p.weights)).collect(), triangles);
    let (at, force) = ([0.3, 0.4, 0.3], Vector3::new(0.1, -0.2, -1.0));
    let place = patch.point(at);
    let nodal = split(&patch.nodal_forces(at, &force));
    let mut loaded = curved_mesh.clone();
    arrow(&mut loaded, place - 0.45 * force, place, 0.02);
    for ([f, m], corner) in nodal.into_iter().zip(corners) {
        arrow(&mut loaded, corner, corner + 0.9 * f, 0.012);
        if m.norm() > 0.0 {
            arrow(&mut loaded, corner, corner + 3.0 * m, 0.012);
        }
    }
    let height = |mesh: &Mesh| Some(mesh.points.iter().map(|p| p.z).collect::<Vec<f64>>());
    let mut heights = height(&curved_mesh).unwrap_or_default();
    heights.resize(loaded.points.len(), 0.0);
    let bodies = [
        Body { value: height(&flat_mesh), ..Body::still("(a) flat, subdivided", &flat_mesh) },
        Body { value: height(&curved_mesh), ..Body::still("(b) curved", &curved_mesh) },
        Body { value: Some(heights), ..Body::still("(c) a force, and the nodal loads", &loaded) },
    ];
    let view = View {
        from: [0.25, -1.0, 0.75],
        up: [0.0, 0.0, 1.0],
        quantity: "height [m]",
        factor: 1.0,
        columns: 2,
    };
    let mut findings = Findings::default();
    let caption = "One shell, its nodes turned by 0.34 to 0.40 rad. In (c) the long arrow is the force, short ones are nodal forces and \
                   moments.";
    findings.figures.push(figure(&bodies, &view, caption)?);

    let [off, twisted] = resultants_off(corners, nodal, place, force);
    findings.rows.push(Row::deviation("resultant of the nodal forces", 1e-12, off, "statics"));
    findings.rows.push(Row::deviation("their moment, over force × edge", 1e-12, twisted, "statics"));
    findings.rows.push(Row::deviation(
        "⟨Jv, f⟩ = ⟨v, Jᵀf⟩",
        1e-12,
        power_off(&patch, at, &force),
        "virtual work",
    ));
    let normals = [0, 1, 2].map(|i| state.normal(model, model.corner_normals[0][i] as usize));
    let theirs = Deflected::new(corners, normals);
    let [_, twisted] = resultants_off(corners, theirs.nodal_forces(at, &force), theirs.point(at), force);
    let quantity = "the same moment by the thesis's (8.21) and (8.22)";
    findings.rows.push(Row { reference: Some(0.0), ..Row::shown(quantity, "", twisted, "statics") });
    Ok(findings)
}

/// |⟨Jv, f⟩ − ⟨v, Jᵀf⟩| over |v| |f| for some velocities.
fn power_off(patch: &Patch, weights: [f64; 3], force: &Vector3) -> f64 {
    let velocity = SVector::<f64, 18>::from_fn(|i, _| (1.7 * i as f64 + 0.3).sin());
    let above = (patch.jacobian(weights) * velocity).dot(force);
    let below = velocity.dot(&patch.nodal_forces(weights, force));
    (above - below).abs() / (velocity.norm() * force.norm())
}

fn layers() -> Result<Findings, CaseError> {
    let bowl = sheet(
        Sheet::Hemisphere { radius: 1.0, hole: 0.35, span: std::f64::consts::PI },
        [6, 4],
        Pattern::Crossed,
    )?;
    let specimen = Specimen::new(bowl, [1e6, 0.3], 0.01, Formulation::default())?;
    let model = &specimen.model;
    let state = AssemblyState::at_rest(model);
    let surface = CurvedSurface::new(model, EdgeRule::Arc);
    let Picture { places, triangles, .. } = surface.picture(model, 6);
    let point = |place: &Place| surface.patch(model, &state, place.facet).point(place.weights);
    let curved = triangle_mesh(places.iter().map(point).collect(), triangles);
    // A surface with a relief, which the shells carry.
    let fine = sheet(
        Sheet::Hemisphere { radius: 1.0, hole: 0.35, span: std::f64::consts::PI },
        [53, 37],
        Pattern::UnionJack,
    )?;
    let relief = fine.points.iter().map(|p| p * (1.02 + 0.02 * (9.0 * p.z).sin() * (11.0 * p.x).cos()));
    let fine = Mesh { points: relief.collect(), ..fine };
    let nearest = |point: &Vector3| {
        let centre = |facet: usize| -> Vector3 {
            model.facets[facet].nodes.iter().map(|&n| model.place(n as usize)).sum::<Vector3>() / 3.0
        };
        let facets = 0..model.facets.len();
        let closest =
            facets.min_by(|&a, &b| (centre(a) - point).norm().total_cmp(&(centre(b) - point).norm()));
        closest.unwrap_or(0) as u32
    };
    let carried: Vec<_> = fine.points.iter().map(|p| surface.carry(model, &state, *p, nearest(p))).collect();
    let bound = carried.iter().zip(&fine.points).map(|(c, p)| (surface.carried(model, &state, c) - p).norm());
    let bound = largest(bound);

    let seen = Vector3::new(-0.6, 0.5, 0.6);
    let nodes = 0..fine.points.len();
    let top =
        nodes.max_by(|&a, &b| fine.points[a].dot(&seen).total_cmp(&fine.points[b].dot(&seen))).unwrap_or(0);
    let contact = carried[top].place;
    let patch = surface.patch(model, &state, contact.facet);
    let touched = patch.point(contact.weights);
    let force = -0.5 * patch.normal(contact.weights);
    let nodes = model.facets[contact.facet as usize].nodes;
    let corners = nodes.map(|node| state.position[node as usize]);
    let nodal = split(&patch.nodal_forces(contact.weights, &force));
    let mut shells = specimen.mesh.clone();
    for ([f, _], corner) in nodal.iter().zip(corners) {
        arrow(&mut shells, corner - 1.6 * f, corner, 0.016);
    }
    let mut touching = fine.clone();
    let skin = surface.carried(model, &state, &carried[top]);
    arrow(&mut touching, skin - force, skin, 0.022);
    let bodies = [
        Body::still("shells, with their loads", &shells),
        Body::still("their curved surface", &curved),
        Body::still("a fine surface carried, touched", &touching),
    ];
    let view = View { from: [0.2, 1.0, 0.55], up: [0.0, 0.0, 1.0], quantity: "", factor: 1.0, columns: 3 };
    let mut findings = Findings::default();
    let caption = "Half a bowl of 96 shells. Positions go from left to right, the force of the contact from right to left.";
    findings.figures.push(figure(&bodies, &view, caption)?);
    let powers = (0..model.facets.len() as u32)
        .map(|facet| power_off(&surface.patch(model, &state, facet), contact.weights, &force));
    let quantity = "⟨Jv, f⟩ = ⟨v, Jᵀf⟩ on every shell, largest";
    findings.rows.push(Row::deviation(quantity, 1e-12, largest(powers), "virtual work"));
    let [off, twisted] = resultants_off(corners, nodal, touched, force);
    findings.rows.push(Row::deviation("resultant of the nodal forces", 1e-12, off, "statics"));
    findings.rows.push(Row::deviation("their moment, over force × edge", 1e-12, twisted, "statics"));
    let quantity = "points carried, where they were bound: largest distance";
    findings.rows.push(Row::judged(quantity, "m", [0.0, 1e-12], bound, "definition"));
    Ok(findings)
}

/// A sphere of shells under an affine motion of its nodes; the normals rotate with the ellipsoid's normals.
struct Ellipsoid {
    model: Assembly,
    state: AssemblyState,
    axes: Vector3,
}

impl Ellipsoid {
    fn new(levels: u32, axes: [f64; 3]) -> Result<Self, CaseError> {
        let mesh = sphere(1.0, levels, DEFAULT_CELL_LIMIT)?;
        // Curved by the sphere's own normals, not by means of facets.
        let model = Specimen::new(mesh, [1e6, 0.3], 0.01, Formulation::default())?.model;
        let axes = Vector3::from(axes);
        let mut state = AssemblyState::at_rest(&model);
        for ((x, rotation), rest) in state.position.iter_mut().zip(&mut state.rotation).zip(model.places()) {
            *x = rest.component_mul(&axes);
            let normal = rest.component_div(&axes);
            *rotation = UnitQuaternion::rotation_between(&rest, &normal).unwrap_or_default();
        }
        Ok(Self { model, state, axes })
    }

    /// Distance of a point from the ellipsoid, to first order.
    fn distance(&self, point: &Vector3) -> f64 {
        let scaled = point.component_div(&self.axes);
        (0.5 * (scaled.norm_squared() - 1.0) / scaled.component_div(&self.axes).norm()).abs()
    }

    /// Diagonal of the box around the ellipsoid.
    fn diagonal(&self) -> f64 {
        2.0 * self.axes.norm()
    }

    fn deflected(&self, facet: usize) -> Deflected {
        let corners = self.model.facets[facet].nodes.map(|node| self.state.position[node as usize]);
        Deflected::new(
            corners,
            self.model.corner_normals[facet].map(|n| self.state.normal(&self.model, n as usize)),
        )
    }

    /// The largest gap at an edge between the thesis's surfaces of its two facets, over the diagonal.
    fn gap(&self) -> f64 {
        let mut largest = 0.0_f64;
        for (a, one) in self.model.facets.iter().enumerate() {
            for (b, other) in self.model.facets.iter().enumerate().take(a) {
                let shared: Vec<u32> = one.nodes.into_iter().filter(|n| other.nodes.contains(n)).collect();
                let [p, q] = shared[..] else { continue };
                for part in 1..20 {
                    let part = f64::from(part) / 20.0;
                    let at = |nodes: [u32; 3], facet: usize| {
                        let weight = |n: u32| {
                            if n == p {
                                part
                            } else if n == q {
                                1.0 - part
                            } else {
                                0.0
                            }
                        };
                        self.deflected(facet).point(nodes.map(weight))
                    };
                    largest = largest.max((at(one.nodes, a) - at(other.nodes, b)).norm());
                }
            }
        }
        largest / self.diagonal()
    }
}

/// Distances of the surfaces of a sphere of `count` shells from the true sphere. References are the largest
/// and the rms distance of this surface, and the gap of the thesis's surface, all from a prototype.
fn distances(levels: u32, count: u32, ours: [f64; 2], theirs: f64) -> Result<[Row; 3], CaseError> {
    let source = "prototype of the formulas; tolerance 10 %";
    let ball = Ellipsoid::new(levels, [1.0; 3])?;
    let surface = CurvedSurface::new(&ball.model, EdgeRule::Arc);
    let mut off = Vec::new();
    for facet in 0..count {
        let patch = surface.patch(&ball.model, &ball.state, facet);
        let lattice = (0..=12_u32).flat_map(|i| (0..=12 - i).map(move |j| [i, j, 12 - i - j]));
        let points = lattice.map(|w| patch.point(w.map(|w| f64::from(w) / 12.0)));
        off.extend(points.map(|p| 100.0 * (p.norm() - 1.0).abs() / ball.diagonal()));
    }
    let rms = (off.iter().map(|d| d * d).sum::<f64>() / off.len() as f64).sqrt();
    let [most, mean] =
        [("largest", ours[0], largest(off)), ("rms", ours[1], rms)].map(|(what, expected, found)| {
            let quantity =
                format!("sphere of {count} shells: {what} distance of the surface, part of the diagonal");
            Row::judged(quantity, "%", [expected, 0.1 * expected], found, source)
        });
    let quantity =
        format!("sphere of {count} shells: gap at edges of the thesis's surface, part of the diagonal");
    let gap = Row::shown(quantity, "%", 100.0 * ball.gap(), "prototype of the formulas");
    Ok([most, mean, Row { reference: Some(theirs), ..gap }])
}

/// The thesis's surface: each facet by itself, since gaps separate the facets.
fn with_gaps(ball: &Ellipsoid, Picture { places, triangles, .. }: &Picture) -> Mesh {
    let (mut points, mut cut) = (Vec::new(), Vec::new());
    for facet in 0..ball.model.facets.len() {
        let deflected = ball.deflected(facet);
        let mut known = std::collections::BTreeMap::new();
        for triangle in triangles {
            let weights = triangle.map(|at| weights_in(&ball.model, &places[at as usize], facet));
            let [Some(a), Some(b), Some(c)] = weights else { continue };
            cut.push([a, b, c].map(|w| {
                *known.entry(w.map(f64::to_bits)).or_insert_with(|| {
                    points.push(deflected.point(w));
                    points.len() as u32 - 1
                })
            }));
        }
    }
    triangle_mesh(points, cut)
}

/// Returns a sphere of 1,280 triangles that the shells carry from rest to their current state. It is rotated
/// so that no part lies on the edges of the shells.
fn irregular(rest: &Ellipsoid, ball: &Ellipsoid, surface: &CurvedSurface) -> Result<Mesh, CaseError> {
    let mut irregular = sphere(1.0, 3, DEFAULT_CELL_LIMIT)?;
    let turn = UnitQuaternion::from_scaled_axis(Vector3::new(0.3, 0.5, -0.2));
    irregular.points.iter_mut().for_each(|p| *p = turn * *p);
    let centre = |facet: usize| -> Vector3 {
        rest.model.facets[facet].nodes.iter().map(|&n| rest.model.place(n as usize)).sum::<Vector3>()
    };
    for point in &mut irregular.points {
        let facets = 0..rest.model.facets.len();
        let near = facets.max_by(|&a, &b| centre(a).dot(point).total_cmp(&centre(b).dot(point))).unwrap_or(0);
        let bound = surface.carry(&rest.model, &rest.state, *point, near as u32);
        *point = surface.carried(&ball.model, &ball.state, &bound);
    }
    Ok(irregular)
}

fn rendering() -> Result<Findings, CaseError> {
    let mut findings = Findings::default();
    findings.rows.extend(distances(0, 20, [0.558, 0.264], 3.06)?);
    findings.rows.extend(distances(1, 80, [0.0499, 0.0187], 0.441)?);

    let rest = Ellipsoid::new(0, [1.0; 3])?;
    let ball = Ellipsoid::new(0, [1.3, 1.0, 0.7])?;
    let surface = CurvedSurface::new(&ball.model, EdgeRule::Arc);
    let picture = surface.picture(&ball.model, 12);
    let made = |of: &dyn Fn(&Place) -> Vector3| {
        triangle_mesh(picture.places.iter().map(of).collect(), picture.triangles.clone())
    };
    let flat_mesh = made(&|p| flat(&ball.model, &ball.state, p));
    let curved = made(&|p| surface.patch(&ball.model, &ball.state, p.facet).point(p.weights));
    let gaping = with_gaps(&ball, &picture);
    let irregular = irregular(&rest, &ball, &surface)?;
    let off = |mesh: &Mesh| 100.0 * largest(mesh.points.iter().map(|p| ball.distance(p))) / ball.diagonal();
    for (name, mesh) in [("flat", &flat_mesh), ("curved", &curved), ("carried, bound at rest", &irregular)] {
        let quantity =
            format!("sphere of 20 shells made an ellipsoid: {name}, largest distance, part of the diagonal");
        findings.rows.push(Row::shown(quantity, "%", off(mesh), ""));
    }
    let smooth = |label: &str, mesh| Body { edges: false, ..Body::still(label, mesh) };
    let bodies = [
        smooth("20 flat shells", &flat_mesh),
        smooth("the thesis's surface, with gaps", &gaping),
        smooth("the surface here, subdivided", &curved),
        smooth("an irregular mesh, carried", &irregular),
    ];
    let view = View { from: [0.4, -1.0, 0.5], up: [0.0, 0.0, 1.0], quantity: "", factor: 1.0, columns: 2 };
    let caption = "A sphere of 20 shells moved to an ellipsoid with axes 1.3, 1 and 0.7.";
    findings.figures.push(figure(&bodies, &view, caption)?);
    Ok(findings)
}

/// The area coordinates of a place in a facet, if it belongs to the facet; places on edges belong to both
/// facets.
fn weights_in(model: &Assembly, place: &Place, facet: usize) -> Option<[f64; 3]> {
    let (place_nodes, nodes) = (model.facets[place.facet as usize].nodes, model.facets[facet].nodes);
    let weighed = place_nodes.iter().zip(place.weights).filter(|(_, w)| *w > 0.0);
    let mut weights = [0.0; 3];
    for (node, w) in weighed {
        weights[nodes.iter().position(|n| n == node)?] = w;
    }
    Some(weights)
}
