//! A model with shells on its nodes: facets, normals, masses. Everything constant.

use std::collections::BTreeMap;
use std::ops::Deref;
use std::sync::Arc;

use nalgebra::Vector3;
use pliant_mechanics::Model;
use pliant_mechanics::load::LoadKind;
use pliant_mechanics::model::{Constraint, Motion, Solid};
use pliant_shells::Carried;
use pliant_shells::Facet;
use pliant_shells::element::{Formulation, Layer, Wall};
use pliant_shells::{Normal, straight_edges};

use crate::model::contact::ContactModel;
use crate::model::error::ModelError;
use crate::model::turns::CarriedTurn;
use crate::solid::refusal;

/// The least part of a direction that lies in a triangle.
const ALONG: f64 = 1e-3;

/// A model with shells: what the solvers of this crate work on. It reads as its [`Model`], which holds nodes,
/// masses, solids, loads and constraints. Nodes have three translations, and three rotations if a facet that
/// bends uses them.
#[derive(Clone, Debug, Default)]
pub struct Assembly {
    /// Nodes, solids, loads, constraints.
    pub model: Arc<Model>,
    /// Shell elements of all shells.
    pub facets: Vec<Facet>,
    /// Nodal normals at rest, which turn with their nodes; several a node at creases.
    pub normals: Vec<Normal>,
    /// The normals at the corners of each facet.
    pub corner_normals: Vec<[u32; 3]>,
    /// Rotary inertia [kg m²], the same about every axis, one per node.
    pub rotary_inertia: Vec<f64>,
    /// Springs from nodes to points.
    pub springs: Vec<Spring>,
    /// The points of each surface of the model that shells carry.
    pub carried: BTreeMap<usize, Vec<Carried>>,
    /// The force [N] with which constraints that move nodes push at most, and the pressure [Pa] of
    /// constraints of volume, by their numbers. Their nodes lag behind their motion together, and their
    /// volumes behind their growth, as the static and the implicit solver find.
    pub force_limits: BTreeMap<usize, f64>,
    /// Contacts, which the static and the implicit solver keep.
    pub contact: Option<ContactModel>,
    /// Nodes of shells that turn with the solid that they are in or on. Nodes of rigid parts turn with their
    /// part instead.
    pub turns: Vec<CarriedTurn>,
}

/// Triangles that become a shell.
#[derive(Clone, Debug)]
pub struct Shell {
    /// Its name in messages.
    pub name: String,
    /// Nodes of its triangles.
    pub cells: Vec<[u32; 3]>,
    /// Thickness [m]: one, or one a triangle.
    pub thickness: Vec<f64>,
    /// Material of the shell: one, or one a triangle.
    pub material: Vec<Wall>,
    /// Its elements.
    pub formulation: Formulation,
    /// Layers from the bottom (against the normals) to the top; with some, `thickness` and `material` say
    /// nothing.
    pub layers: Vec<Layer>,
    /// The direction that the angles of layers count from, projected on each triangle: one, or one a
    /// triangle.
    pub direction: Vec<Vector3<f64>>,
    /// Tension [N/m] at rest, equal in all directions.
    pub tension: f64,
    /// Triangles that meet at a larger angle [rad] have normals of their own: a crease.
    pub crease: f64,
    /// Normals of nodes at rest, of any length and to either side, for a surface that is known better than by
    /// its triangles. Nodes without one take the mean of their triangles.
    pub normals: BTreeMap<u32, Vector3<f64>>,
    /// Flags of triangles that are flat, with straight edges, whatever the normals of their nodes. Empty: no
    /// triangle is flat.
    pub flat: Vec<bool>,
    /// True if more than two triangles may meet in an edge.
    pub branches: bool,
}

impl Shell {
    /// A shell of one thickness with the default elements, creases above 45° and no branches.
    pub fn new(name: &str, cells: Vec<[u32; 3]>, thickness: f64, material: Wall) -> Self {
        Self {
            name: name.into(),
            cells,
            thickness: vec![thickness],
            material: vec![material],
            formulation: Formulation::default(),
            layers: Vec::new(),
            direction: Vec::new(),
            tension: 0.0,
            crease: std::f64::consts::FRAC_PI_4,
            normals: BTreeMap::new(),
            flat: Vec::new(),
            branches: false,
        }
    }
}

/// Observations made when a shell was added.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Notes {
    /// Triangles turned over so that all face the same side.
    pub turned: usize,
    /// Elements thicker than their smallest altitude. They respond as plates although they are too thick for
    /// plate theory.
    pub thick: usize,
    /// Triangles folded back onto all their neighbours, as inverted ones are: how many, and the number of the
    /// first.
    pub inverted: Option<(usize, usize)>,
    /// Mean thickness over width, where there is a border. A strip of length L and width b has two areas over
    /// its border, b L/(b + L). Shear across the thickness, which is left out, makes a strip softer in twist
    /// by 0.63 times this ratio.
    pub stoutness: Option<f64>,
    /// Elements of Comas (2010), which depend on the numbering and converge to a wrong plate.
    pub comas: usize,
}

/// A linear spring without rest length.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Spring {
    /// The node it pulls.
    pub node: u32,
    /// The point it pulls towards [m].
    pub anchor: Vector3<f64>,
    /// Stiffness [N/m].
    pub stiffness: f64,
}

impl Deref for Assembly {
    type Target = Model;

    fn deref(&self) -> &Model {
        &self.model
    }
}

impl Assembly {
    /// The nodes that turn with a solid, without the nodes of rigid parts, which turn with their part.
    pub(crate) fn carried_turns(&self) -> impl Iterator<Item = &CarriedTurn> {
        let rigid = |constraint: &Constraint| matches!(constraint.motion, Motion::Rigid);
        let bound = move |node: u32| {
            self.constraints.iter().any(|constraint| rigid(constraint) && constraint.nodes.contains(&node))
        };
        self.turns.iter().filter(move |turn| !bound(turn.node))
    }

    /// One body of nodes at rest [m] and nothing else.
    pub fn new(name: &str, rest: impl IntoIterator<Item = Vector3<f64>>) -> Self {
        let mut assembly = Self::default();
        assembly.add_body(name, rest);
        assembly
    }

    /// Adds a body of nodes at rest [m]; its number.
    pub fn add_body(&mut self, name: &str, rest: impl IntoIterator<Item = Vector3<f64>>) -> usize {
        let rest: Vec<[f64; 3]> = rest.into_iter().map(Into::into).collect();
        self.rotary_inertia.resize(self.rest.len() + rest.len(), 0.0);
        self.model_mut().add_body(name, &rest)
    }

    /// The model, to add loads and constraints to.
    pub fn model_mut(&mut self) -> &mut Model {
        Arc::make_mut(&mut self.model)
    }

    /// Position of a node at rest [m].
    pub fn place(&self, node: usize) -> Vector3<f64> {
        Vector3::from(self.rest[node])
    }

    /// Positions of all nodes at rest [m].
    pub fn places(&self) -> impl Iterator<Item = Vector3<f64>> + '_ {
        self.rest.iter().map(|&place| Vector3::from(place))
    }

    /// The mass-proportional damping [1/s] of each node, taken from its body.
    pub fn damping(&self) -> Vec<f64> {
        let mut damping = vec![0.0; self.rest.len()];
        for body in &self.bodies {
            damping[body.nodes.start as usize..body.nodes.end as usize].fill(body.damping);
        }
        damping
    }

    /// Adds a shell. Its triangles are turned to face one side: each connected part keeps the side of most of
    /// its triangles. They become facets, and give mass and normals to their nodes.
    ///
    /// # Errors
    /// If a quantity is out of range, a triangle is degenerate, or an edge has too many triangles. The model
    /// then is as it was.
    pub fn add_shell(&mut self, shell: &Shell) -> Result<Notes, ModelError> {
        self.check_quantities(shell)?;
        let (cells, turned) = oriented(shell)?;
        let mut notes = Notes { turned, ..Notes::default() };
        let mut facets = Vec::with_capacity(cells.len());
        for (number, &nodes) in cells.iter().enumerate() {
            let corners = nodes.map(|node| self.place(node as usize));
            let facet = if shell.layers.is_empty() {
                let thickness = shell.thickness[if shell.thickness.len() == 1 { 0 } else { number }];
                let material = shell.material[if shell.material.len() == 1 { 0 } else { number }];
                Facet::new(nodes, corners, thickness, material, shell.formulation)
            } else {
                let direction = direction_of(shell, number, &corners)?;
                Facet::layered(nodes, corners, &shell.layers, &direction, shell.formulation)
            };
            let facet = facet.map(|facet| facet.under_tension(shell.tension));
            let facet = facet.ok_or_else(|| ModelError::Degenerate {
                shell: shell.name.clone(),
                cell: number,
                what: "area",
                value: 0.5 * (corners[1] - corners[0]).cross(&(corners[2] - corners[0])).norm(),
            })?;
            notes.thick += usize::from(facet.thickness > facet.altitude());
            notes.comas +=
                usize::from(shell.formulation.bending == pliant_shells::element::Bending::Comas2010);
            facets.push(facet);
        }
        notes.inverted = self.inverted(&cells);
        notes.stoutness = self.stoutness(&facets);
        let (normals, corner_normals) = self.normals_of(shell, &facets)?;
        self.normals.extend(normals);
        self.corner_normals.extend(corner_normals);
        for facet in &facets {
            for node in facet.nodes {
                Arc::make_mut(&mut self.model).mass[node as usize] += facet.mass;
                self.rotary_inertia[node as usize] += facet.inertia;
            }
        }
        self.facets.extend(facets);
        self.curve_facets();
        Ok(notes)
    }

    /// A force per rest area [Pa] on facets that keeps its direction, a third to each corner.
    pub fn area_load(&self, facets: &[u32], traction: Vector3<f64>) -> LoadKind {
        let of_facet = |&facet: &u32| {
            let facet = &self.facets[facet as usize];
            facet.nodes.map(|node| (node, (traction * (facet.area / 3.0)).into()))
        };
        LoadKind::Forces(facets.iter().flat_map(of_facet).collect())
    }

    /// A force per rest length [N/m] along edges that keeps its direction, half to each end. Left out are the
    /// in-plane drilling moments that the ANDES membrane would take from it at the ends of an edge. They
    /// cancel between edges, except at the ends of the line.
    pub fn edge_load(&self, edges: &[[u32; 2]], traction: Vector3<f64>) -> LoadKind {
        let of_edge = |&ends: &[u32; 2]| {
            let [a, b] = ends.map(|node| self.place(node as usize));
            ends.map(|node| (node, (traction * (0.5 * (b - a).norm())).into()))
        };
        LoadKind::Forces(edges.iter().flat_map(of_edge).collect())
    }

    /// Flags of nodes with rotations, which are the nodes of facets that bend. Without bending, rotations
    /// would have next to no stiffness.
    pub fn turning(&self) -> Vec<bool> {
        let mut turning = vec![false; self.rest.len()];
        for facet in self.facets.iter().filter(|facet| facet.turns()) {
            facet.nodes.iter().for_each(|&node| turning[node as usize] = true);
        }
        turning
    }

    /// Gives the facets the normals of their corners. Edges shared with another shell become creases.
    fn curve_facets(&mut self) {
        let straight = straight_edges(&self.facets, &self.corner_normals, &self.normals, &self.rest);
        for ((facet, corners), straight) in self.facets.iter_mut().zip(&self.corner_normals).zip(straight) {
            facet.curve(corners.map(|normal| self.normals[normal as usize].direction), straight);
        }
    }

    /// Mean thickness over twice the area by the length of the border; `None` of a closed shell.
    fn stoutness(&self, facets: &[Facet]) -> Option<f64> {
        let cells: Vec<[u32; 3]> = facets.iter().map(|facet| facet.nodes).collect();
        let border = edges(&cells).into_iter().filter(|(_, sides)| sides.len() == 1);
        let length = |([a, b], _): ([u32; 2], _)| (self.place(a as usize) - self.place(b as usize)).norm();
        let border: f64 = border.map(length).sum();
        let area: f64 = facets.iter().map(|facet| facet.area).sum();
        let volume: f64 = facets.iter().map(|facet| facet.area * facet.thickness).sum();
        (border > 0.0).then(|| volume / area * border / (2.0 * area))
    }

    /// The triangles with two neighbours or more whose normals are all turned by more than 150°: how many,
    /// and the first.
    fn inverted(&self, cells: &[[u32; 3]]) -> Option<(usize, usize)> {
        const TURNED: f64 = -0.866;
        let normal = |cell: usize| {
            let [a, b, c] = cells[cell].map(|node| self.place(node as usize));
            (b - a).cross(&(c - a)).normalize()
        };
        let mut neighbours = vec![(0_usize, true); cells.len()];
        for sides in edges(cells).into_values() {
            let [(one, _), (other, _)] = sides[..] else { continue };
            let back = normal(one).dot(&normal(other)) < TURNED;
            for cell in [one, other] {
                neighbours[cell] = (neighbours[cell].0 + 1, neighbours[cell].1 && back);
            }
        }
        let mut inverted = (0..cells.len()).filter(|&cell| neighbours[cell].0 > 1 && neighbours[cell].1);
        let first = inverted.next()?;
        Some((1 + inverted.count(), first))
    }

    /// Adds a solid, which gives mass to its nodes. It may share nodes with shells and other solids.
    ///
    /// # Errors
    /// As [`Assembly::check_solid`]; the model then is as it was.
    pub fn add_solid(&mut self, name: &str, solid: Solid) -> Result<(), ModelError> {
        self.check_solid(name, &solid)?;
        self.model_mut().add_solid(solid);
        Ok(())
    }

    /// Checks that the solvers of this crate can have a solid on nodes of the model.
    ///
    /// # Errors
    /// If the density is out of range, or a cell is degenerate or inverted. Also if the element or the law
    /// has no stiffness here: averages over two rings of neighbours, averaged pressures and bars that relax.
    pub fn check_solid(&self, name: &str, solid: &Solid) -> Result<(), ModelError> {
        if let Some(why) = refusal(solid) {
            return Err(ModelError::NoStiffness { solid: name.into(), why });
        }
        let density = solid.material.density;
        if !(density > 0.0 && density.is_finite()) {
            let range = "positive and finite";
            return Err(ModelError::OutOfRange {
                shell: name.into(),
                what: "density".into(),
                value: density,
                range,
            });
        }
        for cell in 0..solid.cells.len() {
            check_nodes(name, cell, solid.cells.nodes(cell), self.rest.len())?;
            let value = solid.cells.volume(cell);
            if !(value > 0.0 && value.is_finite()) {
                return Err(ModelError::Degenerate { shell: name.into(), cell, what: "volume", value });
            }
        }
        Ok(())
    }

    /// The nodes of each cell of the solids.
    pub(crate) fn solid_cells(&self) -> impl Iterator<Item = &[u32]> {
        self.solids.iter().flat_map(|solid| (0..solid.cells.len()).map(|cell| solid.cells.nodes(cell)))
    }

    /// Displacement [m] of a node at a position.
    pub(crate) fn displacement(&self, position: &[Vector3<f64>], node: u32) -> [f64; 3] {
        (position[node as usize] - self.place(node as usize)).into()
    }

    fn check_quantities(&self, shell: &Shell) -> Result<(), ModelError> {
        let out_of_range = |what: String, value: f64, range| {
            Err(ModelError::OutOfRange { shell: shell.name.clone(), what, value, range })
        };
        let positive = |value: f64| value > 0.0 && value.is_finite();
        for (cell, nodes) in shell.cells.iter().enumerate() {
            check_nodes(&shell.name, cell, nodes, self.rest.len())?;
        }
        if !(shell.tension >= 0.0 && shell.tension.is_finite()) {
            return out_of_range("tension".into(), shell.tension, "finite and not negative");
        }
        let (cells, flat) = (shell.cells.len(), shell.flat.len());
        if flat != 0 && flat != cells {
            let what = "marks of flat triangles";
            return Err(ModelError::Count { shell: shell.name.clone(), what, cells, given: flat });
        }
        if !shell.layers.is_empty() {
            return check_layers(shell);
        }
        for &material in &shell.material {
            check_material(&shell.name, material)?;
        }
        for (what, given) in [("thicknesses", shell.thickness.len()), ("materials", shell.material.len())] {
            if given != 1 && given != cells {
                return Err(ModelError::Count { shell: shell.name.clone(), what, cells, given });
            }
        }
        let given = shell.thickness.len();
        if let Some((cell, &value)) = shell.thickness.iter().enumerate().find(|(_, t)| !positive(**t)) {
            let what = if given == 1 { "thickness".into() } else { format!("thickness of element {cell}") };
            return out_of_range(what, value, "positive and finite");
        }
        Ok(())
    }

    /// The normals of the nodes of a shell, and their numbers at the corners of its facets. They are the
    /// given normals, else angle-weighted means. Each fan of facets round a node that meet at less than the
    /// crease angle has one mean.
    fn normals_of(
        &self,
        shell: &Shell,
        facets: &[Facet],
    ) -> Result<(Vec<Normal>, Vec<[u32; 3]>), ModelError> {
        let normal_of = |facet: &Facet| {
            let [a, b, c] = facet.nodes.map(|node| self.place(node as usize));
            (b - a).cross(&(c - a)).normalize()
        };
        let face_normals: Vec<Vector3<f64>> = facets.iter().map(normal_of).collect();
        let mut around: BTreeMap<u32, Vec<(usize, usize)>> = BTreeMap::new();
        let is_flat = |number: usize| shell.flat.get(number).is_some_and(|flat| *flat);
        let mut normals = Vec::new();
        let mut corner_normals = vec![[0; 3]; facets.len()];
        for (number, facet) in facets.iter().enumerate() {
            for (corner, &node) in facet.nodes.iter().enumerate() {
                if is_flat(number) {
                    // A normal different from the neighbours' makes the edges straight.
                    corner_normals[number][corner] = (self.normals.len() + normals.len()) as u32;
                    normals.push(Normal { node, direction: face_normals[number], estimated: false });
                    continue;
                }
                around.entry(node).or_default().push((number, corner));
            }
        }
        for (&node, corners) in &around {
            let given = shell.normals.get(&node);
            let fans = match given {
                Some(_) => vec![corners.clone()],
                None => fans(facets, corners, &face_normals, shell.crease.cos()),
            };
            for fan in fans {
                let mut sum = Vector3::zeros();
                for &(facet, corner) in &fan {
                    let [at, next, last] =
                        [0, 1, 2].map(|i| self.place(facets[facet].nodes[(corner + i) % 3] as usize));
                    sum += face_normals[facet] * (next - at).angle(&(last - at));
                    corner_normals[facet][corner] = (self.normals.len() + normals.len()) as u32;
                }
                let direction = match given {
                    Some(given) => (given * given.dot(&sum).signum()).normalize(),
                    None => sum.normalize(),
                };
                let stands = |facet: usize| face_normals[facet].dot(&direction) > 0.0;
                if let Some(&(cell, _)) = fan.iter().find(|corner| given.is_some() && !stands(corner.0)) {
                    return Err(ModelError::Normal { shell: shell.name.clone(), node, cell });
                }
                normals.push(Normal { node, direction, estimated: given.is_none() });
            }
        }
        Ok((normals, corner_normals))
    }

    /// The volume [m³] that closed facets enclose at some positions, positive with normals outwards.
    pub fn enclosed_volume(&self, facets: &[u32], position: &[Vector3<f64>]) -> f64 {
        self.volume_within(facets, |node| position[node])
    }

    /// The volume [m³] that closed facets enclose at rest.
    pub fn rest_volume(&self, facets: &[u32]) -> f64 {
        self.volume_within(facets, |node| self.place(node))
    }

    fn volume_within(&self, facets: &[u32], position: impl Fn(usize) -> Vector3<f64>) -> f64 {
        let tet = |&facet: &u32| {
            let [a, b, c] = self.facets[facet as usize].nodes.map(|node| position(node as usize));
            a.dot(&b.cross(&c)) / 6.0
        };
        facets.iter().map(tet).sum()
    }

    /// Checks that facets form a closed surface.
    ///
    /// # Errors
    /// If the surface has open borders; the error names them.
    pub fn check_closed(&self, cells: &[u32]) -> Result<(), ModelError> {
        let nodes: Vec<[u32; 3]> = cells.iter().map(|&cell| self.facets[cell as usize].nodes).collect();
        let open = edges(&nodes).into_iter().filter(|(_, sides)| sides.len() == 1);
        // From the start of each open edge to its end, as its triangle runs.
        let mut next: BTreeMap<u32, Vec<u32>> = BTreeMap::new();
        for ([low, high], sides) in open {
            let [from, to] = if sides[0].1 { [low, high] } else { [high, low] };
            next.entry(from).or_default().push(to);
        }
        let mut loops = Vec::new();
        while let Some((&start, _)) = next.iter().next() {
            let mut border = Vec::new();
            let mut at = start;
            while let Some(ends) = next.get_mut(&at) {
                border.push(at);
                let to = ends.pop();
                if ends.is_empty() {
                    next.remove(&at);
                }
                at = to.unwrap_or(start);
            }
            loops.push(border);
        }
        if loops.is_empty() { Ok(()) } else { Err(ModelError::Open { loops }) }
    }

    /// Round-off in the norm of a residual [N], 8 ε |x| √Σk². Displacements are differences of positions,
    /// known to ε |x|, and a cell turns them into forces with its largest stiffness k.
    pub(crate) fn round_off(&self) -> f64 {
        let extent = self.places().map(|x| x.amax()).fold(0.0, f64::max);
        let stiffness = self.stiffnesses().map(|k| k * k).sum::<f64>().sqrt();
        8.0 * f64::EPSILON * stiffness * extent
    }

    /// The largest stiffness [N/m] of each cell.
    fn stiffnesses(&self) -> impl Iterator<Item = f64> {
        let shells = self.facets.iter().map(|facet| facet.stiffest());
        let of_solid = |solid: &Solid| {
            let modulus = solid.longitudinal_modulus();
            let volumes = (0..solid.cells.len()).map(|cell| solid.cells.volume(cell));
            volumes.map(|volume| modulus * volume.cbrt()).collect::<Vec<_>>()
        };
        let solids = self.solids.iter().flat_map(of_solid);
        shells.chain(solids)
    }

    /// The largest force [N/m] of a displacement of one node of a cell.
    pub fn stiffest(&self) -> f64 {
        self.stiffnesses().fold(0.0, f64::max)
    }

    /// The mean length of the facets' and other cells' edges at rest [m]; 1 without any.
    pub(crate) fn mean_edge(&self) -> f64 {
        let (mut sum, mut count) = (0.0, 0);
        let mut add = |a: u32, b: u32| {
            sum += (self.place(a as usize) - self.place(b as usize)).norm();
            count += 1;
        };
        for facet in &self.facets {
            (0..3).for_each(|i| add(facet.nodes[i], facet.nodes[(i + 1) % 3]));
        }
        for nodes in self.solid_cells() {
            (0..nodes.len()).for_each(|i| add(nodes[i], nodes[(i + 1) % nodes.len()]));
        }
        if count > 0 { sum / f64::from(count) } else { 1.0 }
    }
}

fn check_layers(shell: &Shell) -> Result<(), ModelError> {
    let out_of_range =
        |what, value, range| Err(ModelError::OutOfRange { shell: shell.name.clone(), what, value, range });
    for (number, layer) in shell.layers.iter().enumerate() {
        let what = |what: &str| format!("{what} of layer {number}");
        if !layer.elastic.is_stable() {
            let range = "below √(E₁/E₂) in size, with moduli above 0, so that every deformation costs energy";
            return out_of_range(what("Poisson's ratio"), layer.elastic.poisson, range);
        }
        for (name, value) in [("thickness", layer.thickness), ("density", layer.density)] {
            if !(value > 0.0 && value.is_finite()) {
                return out_of_range(what(name), value, "positive and finite");
            }
        }
    }
    let (cells, given) = (shell.cells.len(), shell.direction.len());
    if given != 1 && given != cells {
        return Err(ModelError::Count { shell: shell.name.clone(), what: "directions", cells, given });
    }
    Ok(())
}

/// The direction of the layers of a triangle.
fn direction_of(shell: &Shell, cell: usize, corners: &[Vector3<f64>; 3]) -> Result<Vector3<f64>, ModelError> {
    let direction = shell.direction[if shell.direction.len() == 1 { 0 } else { cell }];
    let [a, b, c] = corners;
    let normal = (b - a).cross(&(c - a));
    let along = direction - normal * (normal.dot(&direction) / normal.norm_squared());
    // Written so that NaN and a triangle without area are found too; the latter has its own error.
    if along.norm() > ALONG * direction.norm() || normal == Vector3::zeros() {
        return Ok(along);
    }
    Err(ModelError::Direction { shell: shell.name.clone(), cell })
}

fn check_material(name: &str, Wall { elastic, density }: Wall) -> Result<(), ModelError> {
    let out_of_range = |what: &str, value, range| {
        Err(ModelError::OutOfRange { shell: name.into(), what: what.into(), value, range })
    };
    let positive = |value: f64| value > 0.0 && value.is_finite();
    if !positive(elastic.young) {
        return out_of_range("Young's modulus", elastic.young, "positive and finite");
    }
    if !(elastic.poisson > -1.0 && elastic.poisson < 1.0) {
        return out_of_range("Poisson's ratio", elastic.poisson, "between -1 and 1");
    }
    if !positive(density) {
        return out_of_range("density", density, "positive and finite");
    }
    Ok(())
}

fn check_nodes(name: &str, cell: usize, nodes: &[u32], count: usize) -> Result<(), ModelError> {
    match nodes.iter().find(|&&node| node as usize >= count) {
        Some(&node) => Err(ModelError::NoSuchNode { shell: name.into(), cell, node, nodes: count }),
        None => Ok(()),
    }
}

/// Each edge (lower node first) with the triangles at it, and whether they run along it from the lower node.
fn edges(cells: &[[u32; 3]]) -> BTreeMap<[u32; 2], Vec<(usize, bool)>> {
    let mut edges: BTreeMap<[u32; 2], Vec<(usize, bool)>> = BTreeMap::new();
    for (number, nodes) in cells.iter().enumerate() {
        for i in 0..3 {
            let (a, b) = (nodes[i], nodes[(i + 1) % 3]);
            edges.entry([a.min(b), a.max(b)]).or_default().push((number, a < b));
        }
    }
    edges
}

/// The triangles of a shell facing one side, and how many were turned over.
fn oriented(shell: &Shell) -> Result<(Vec<[u32; 3]>, usize), ModelError> {
    let edges = edges(&shell.cells);
    let mut neighbours: Vec<Vec<(usize, bool, [u32; 2])>> = vec![Vec::new(); shell.cells.len()];
    for (&edge, sides) in &edges {
        match sides[..] {
            [(a, along), (b, same)] => {
                neighbours[a].push((b, along == same, edge));
                neighbours[b].push((a, along == same, edge));
            }
            [_] => {}
            _ if shell.branches => {}
            _ => return Err(ModelError::Branch { shell: shell.name.clone(), edge, count: sides.len() }),
        }
    }
    let mut turn: Vec<Option<bool>> = vec![None; shell.cells.len()];
    let mut total = 0;
    for start in 0..shell.cells.len() {
        if turn[start].is_some() {
            continue;
        }
        turn[start] = Some(false);
        let mut part = vec![start];
        let mut next = 0;
        while let Some(&cell) = part.get(next) {
            next += 1;
            for &(other, opposed, edge) in &neighbours[cell] {
                let wanted = turn[cell].map(|turned| turned != opposed);
                match turn[other] {
                    None => {
                        turn[other] = wanted;
                        part.push(other);
                    }
                    found if found == wanted => {}
                    _ => return Err(ModelError::OneSided { shell: shell.name.clone(), edge }),
                }
            }
        }
        let turned = part.iter().filter(|&&cell| turn[cell] == Some(true)).count();
        if 2 * turned > part.len() {
            part.iter().for_each(|&cell| turn[cell] = turn[cell].map(|turned| !turned));
        }
        total += turned.min(part.len() - turned);
    }
    let cells = shell.cells.iter().zip(&turn);
    Ok((
        cells.map(|(&[a, b, c], turn)| if *turn == Some(true) { [a, c, b] } else { [a, b, c] }).collect(),
        total,
    ))
}

/// The corners of facets at one node, parted where facets that share an edge meet at a crease.
fn fans(
    facets: &[Facet],
    corners: &[(usize, usize)],
    normals: &[Vector3<f64>],
    crease: f64,
) -> Vec<Vec<(usize, usize)>> {
    let mut left = corners.to_vec();
    let mut fans = Vec::new();
    while let Some(first) = left.pop() {
        let mut fan = vec![first];
        let mut next = 0;
        while let Some(&(facet, corner)) = fan.get(next) {
            next += 1;
            let ends = [1, 2].map(|i| facets[facet].nodes[(corner + i) % 3]);
            left.retain(|&(other, at)| {
                let shares = [1, 2].iter().any(|i| ends.contains(&facets[other].nodes[(at + i) % 3]));
                let smooth = shares && normals[facet].dot(&normals[other]) > crease;
                if smooth {
                    fan.push((other, at));
                }
                !smooth
            });
        }
        fans.push(fan);
    }
    fans
}
