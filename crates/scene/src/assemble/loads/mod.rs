//! The phase [`Loaded`]: constraints, and loads, which are forces on nodes, tractions and pressures on faces,
//! and gravity.

mod constraints;
mod implicit_constraints;
mod implicit_loads;

use pliant_format::registry::LoadTable;
use pliant_format::tables::{ForceTable, Vectors};
use pliant_geometry::Vector3;
use pliant_mechanics::curve::{Curve, Shape};
use pliant_mechanics::load::{Face, Load, LoadKind, face_areas};
use pliant_sim::RunControl;

use super::context::follows;
use super::ties::{Subject, Tied};

/// The third phase: bodies that are held, moved and loaded.
pub(super) struct Loaded<'s> {
    pub tied: Tied<'s>,
    /// The control of a load, if it has one.
    pub control: Option<RunControl>,
}

follows!(Loaded, tied: Tied);

impl<'s> Tied<'s> {
    /// Adds constraints and loads.
    pub fn loaded(mut self) -> Loaded<'s> {
        self.add_constraints();
        let control = match self.scene.is_implicit() {
            true => self.add_implicit_loads(),
            false => {
                self.add_loads();
                None
            }
        };
        Loaded { tied: self, control }
    }
}

impl Tied<'_> {
    fn add_loads(&mut self) {
        let scene = self.scene;
        if let Some(acceleration) = scene.scene.gravity {
            for body in self.bodies_with_nodes() {
                let curve = Curve { shape: Shape::Hold, from: 0.0, to: 0.0 };
                let kind = LoadKind::Gravity { body, acceleration };
                self.assembly.model_mut().loads.push(Load::new("gravity", kind, curve));
            }
        }
        for (name, table) in &scene.loads {
            let path = ["load", name.as_str()];
            if let Some(loads) = self.loads(table, &path) {
                let named = |(kind, curve, surface)| Load { surface, ..Load::new(name, kind, curve) };
                self.assembly.model_mut().loads.extend(loads.into_iter().map(named));
            }
        }
    }

    /// Returns the bodies that have nodes of their own and so a mass; the nodes of a wall on another body
    /// hold the wall's mass.
    pub(super) fn bodies_with_nodes(&self) -> Vec<usize> {
        (0..self.assembly.bodies.len()).filter(|&body| !self.assembly.bodies[body].nodes.is_empty()).collect()
    }

    /// Refuses the weight of a wall apart from the body that it is on.
    pub(super) fn check_weight(&mut self, bodies: &[usize], of_nodes: bool, path: &[&str]) -> bool {
        let wall = bodies.iter().copied().find(|&body| self.assembly.bodies[body].nodes.is_empty());
        let Some(wall) = wall.filter(|_| !of_nodes) else { return true };
        let name = self.bodies[wall].name.clone();
        let message =
            format!("`{name}` has no nodes of its own: its weight is that of the body that it is on");
        self.error(path, message, "a wall", "name that body, or leave `on` out");
        false
    }

    fn loads(&mut self, table: &LoadTable, path: &[&str]) -> Option<Vec<(LoadKind, Curve, Option<usize>)>> {
        let at = |key| [path, &[key]].concat();
        if let LoadTable::Moment(_) | LoadTable::Edge(_) = table {
            let message = "moments and loads on edges are for shells";
            self.error(
                path,
                message,
                "not for a `solid`",
                "take forces or tractions, or set `model = \"shell\"`",
            );
            return None;
        }
        let curve = self.curve(table.timing(), path);
        if let LoadTable::Gravity(gravity) = table {
            let bodies = match &gravity.on {
                Some(name) => vec![self.find_body(name, &at("on"))?],
                None => self.bodies_with_nodes(),
            };
            if !self.check_weight(&bodies, gravity.nodes.is_some(), &at("on")) {
                return None;
            }
            let curve = curve?;
            let acceleration = gravity.acceleration;
            if let Some(selection) = &gravity.nodes {
                let [body] = bodies[..] else {
                    let message = "`nodes` are nodes of one body, which `on` must name";
                    self.error(&at("nodes"), message, "of which body?", "add `on = \"BODY\"`");
                    return None;
                };
                let nodes = self.body_nodes(body, selection, &at("nodes"))?;
                let weight = |node: u32| (node, acceleration.map(|a| a * self.assembly.mass[node as usize]));
                return Some(vec![(LoadKind::Forces(nodes.into_iter().map(weight).collect()), curve, None)]);
            }
            let load = |body| LoadKind::Gravity { body, acceleration };
            return Some(bodies.into_iter().map(|body| (load(body), curve.clone(), None)).collect());
        }
        let target = self.find_target(table.on()?, &at("on"))?;
        let kind = match table {
            LoadTable::Force(l) => self.nodal_forces(l, target, path),
            LoadTable::Traction(l) => self
                .faces(target, &l.faces, &at("faces"))
                .map(|faces| LoadKind::Forces(self.traction_forces(target, &faces, l.traction))),
            LoadTable::Pressure(l) => self
                .faces(target, &l.faces, &at("faces"))
                .map(|faces| LoadKind::Pressure { faces, pressure: l.pressure }),
            LoadTable::Gravity(_) | LoadTable::Moment(_) | LoadTable::Edge(_) => None,
        };
        let surface = match target {
            Subject::Body(_) => None,
            Subject::Surface(index) => Some(index),
        };
        Some(vec![(kind?, curve?, surface)])
    }

    pub(super) fn nodal_forces(
        &mut self,
        table: &ForceTable,
        target: Subject,
        path: &[&str],
    ) -> Option<LoadKind> {
        let at = [path, &["nodes"]].concat();
        let nodes = match target {
            Subject::Body(body) => self.body_nodes(body, &table.nodes, &at)?,
            Subject::Surface(index) => {
                let (mesh, boundary) = self.surface_mesh(index);
                match table.nodes.nodes(&mesh, &boundary) {
                    Ok(nodes) => nodes,
                    Err(error) => {
                        self.error(&at, error.to_string(), "this selection", "");
                        return None;
                    }
                }
            }
        };
        let count = nodes.len();
        let forces = match (&table.each, table.total) {
            (Some(Vectors::Uniform(each)), None) => vec![*each; count],
            (Some(Vectors::PerNode(each)), None) => {
                let at = [path, &["each"]].concat();
                let Subject::Body(body) = target else {
                    let help = "load the body itself, or give one vector for all nodes";
                    self.error(&at, "the nodes of a carried surface have no data", "not on a surface", help);
                    return None;
                };
                self.node_vectors(each, body, &nodes, &at)?
            }
            (None, Some(total)) => vec![total.map(|f| f / count as f64); count],
            (each, _) => {
                let found = if each.is_some() { "both" } else { "neither" };
                let message = format!("a force has exactly one of `each` and `total`, found {found}");
                let help = "`each` acts on every node, `total` is shared among them";
                self.error(path, message, "this force", help);
                return None;
            }
        };
        Some(LoadKind::Forces(nodes.into_iter().zip(forces).collect()))
    }

    pub(super) fn traction_forces(
        &self,
        target: Subject,
        faces: &[Face],
        traction: [f64; 3],
    ) -> Vec<(u32, [f64; 3])> {
        let rest = match target {
            Subject::Body(_) => &self.assembly.rest,
            Subject::Surface(index) => &self.assembly.surfaces[index].rest,
        };
        let share = |(node, area): (u32, [f64; 3])| {
            let size = Vector3::from(area).norm();
            (node, traction.map(|t| t * size))
        };
        faces.iter().flat_map(|face| face_areas(face, |node| rest[node as usize])).map(share).collect()
    }
}

#[cfg(test)]
mod tests {
    use pliant_mechanics::load::LoadKind;

    use crate::assemble::Built;
    use crate::testing::{built, mistakes};

    /// The sum of the forces of the only load [N], and how many nodes it acts on.
    fn sum(built: &Built) -> ([f64; 3], usize) {
        let [load] = &built.model.loads[..] else { panic!("one load") };
        let LoadKind::Forces(forces) = &load.kind else { panic!("forces") };
        let sum = forces.iter().fold([0.0; 3], |sum, (_, f)| [0, 1, 2].map(|c| sum[c] + f[c]));
        (sum, forces.len())
    }

    #[test]
    fn total_is_shared_and_each_is_repeated() {
        let load = |force: &str| {
            built(&format!("[load.a]\ntype = 'force'\non = 'cube'\nnodes = {{ set = 'z-max' }}\n{force}\n"))
        };
        let ([x, y, z], nodes) = sum(&load("total = [9, 0, -18]"));
        assert!((x - 9.0).abs() < 1e-12 && y == 0.0 && (z + 18.0).abs() < 1e-12 && nodes == 9);
        assert_eq!(sum(&load("each = [1, 0, 0]")), ([9.0, 0.0, 0.0], 9));
    }

    #[test]
    fn gravity_on_some_nodes_is_their_weight() {
        let load = "[load.a]\ntype = 'gravity'\nacceleration = [0, 0, -10]\nnodes = { set = 'z-max' }\n";
        let built = built(&format!("{load}on = 'cube'\n"));
        let ([x, y, z], nodes) = sum(&built);
        let mass: f64 = built.model.constraints[0].nodes.iter().map(|&n| built.model.mass[n as usize]).sum();
        // The mesh is the same from above and from below.
        assert!(x == 0.0 && y == 0.0 && (z + 10.0 * mass).abs() < 1e-12 * mass && nodes == 9, "{z} {mass}");
        let other =
            "[body.other]\nmesh = { block = { size = [1, 1, 1] }, edge = 1 }\nlaw = 'tissue'\ndensity = 1\n";
        let message = mistakes(&format!("{other}{load}")).plain().to_string();
        assert!(message.contains("`nodes` are nodes of one body"), "{message}");
    }

    #[test]
    fn a_traction_adds_up_to_itself_times_the_area() {
        let load = built(
            "[load.a]\ntype = 'traction'\non = 'cube'\nfaces = { set = 'z-max' }\ntraction = [0, 3, 0]\n",
        );
        let ([x, y, z], _) = sum(&load);
        assert!(x == 0.0 && (y - 3.0 * 0.02).abs() < 1e-12 && z == 0.0, "{y}");
    }

    #[test]
    fn pressure_takes_the_faces_and_gravity_every_body() {
        let load =
            built("[load.a]\ntype = 'pressure'\non = 'cube'\nfaces = { set = 'x-max' }\npressure = 5\n");
        let LoadKind::Pressure { faces, pressure } = &load.model.loads[0].kind else { panic!("pressure") };
        assert_eq!((faces.len(), *pressure), (4, 5.0));
        let other =
            "[body.other]\nmesh = { block = { size = [1, 1, 1] }, edge = 1 }\nlaw = 'tissue'\ndensity = 1\n";
        let load = built(&format!("{other}[load.a]\ntype = 'gravity'\nacceleration = [0, 0, -1]\n"));
        assert_eq!(load.model.loads.len(), 2);
    }
}
