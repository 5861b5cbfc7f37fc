//! Loads of the implicit solvers, and the control of one load.

use std::collections::BTreeMap;

use pliant_format::diagnostic::Diagnostic;
use pliant_format::registry::LoadTable;
use pliant_format::tables::{
    Axis, ControlTable, ControlledNode, GravityTable, MomentTable, PressureTable, SpreadName, StopTable,
};
use pliant_format::{SCENE, suggestion};
use pliant_geometry::Vector3;
use pliant_geometry::words::{counted, number};
use pliant_implicit::Resolution;
use pliant_mechanics::curve::{Curve, Shape};
use pliant_mechanics::load::{Load, LoadKind, Spread};
use pliant_shells::element::Membrane;
use pliant_sim::{RunControl, Stop};

use crate::assemble::ties::{Subject, Tied};

/// A load, and the carried surface whose points it numbers.
type Acting = (LoadKind, Option<usize>);

impl Tied<'_> {
    pub(in crate::assemble) fn add_implicit_loads(&mut self) -> Option<RunControl> {
        let scene = self.scene;
        if let Some(acceleration) = scene.scene.gravity {
            let kinds = self.weight_of_all(acceleration);
            self.push_loads("gravity", kinds, constant(), false);
        }
        for (name, table) in &scene.loads {
            let path = ["load", name.as_str()];
            let controlled = scene.run.control.as_ref().is_some_and(|control| control.load == *name);
            let curve = match controlled {
                true => self.no_timing(table, &path),
                false => self.curve(table.timing(), &path),
            };
            let kinds = self.implicit_load(table, &path);
            if let (Some(curve), Some(kinds)) = (curve, kinds) {
                self.push_loads(name, kinds, curve, controlled);
            }
        }
        self.control(scene.run.control.as_ref()?)
    }

    /// Adds loads.
    fn push_loads(&mut self, name: &str, kinds: Vec<Acting>, curve: Curve, controlled: bool) {
        let curve = if controlled { curve } else { self.eased(curve) };
        let load = |(kind, surface)| Load { surface, controlled, ..Load::new(name, kind, curve.clone()) };
        self.assembly.model_mut().loads.extend(kinds.into_iter().map(load));
    }

    /// A controlled load has no curve of its own.
    fn no_timing(&mut self, table: &LoadTable, path: &[&str]) -> Option<Curve> {
        let timing = table.timing();
        if timing.curve.is_some() || timing.from != 0.0 || timing.to.is_some() {
            let message = "the factor of a controlled load is computed: it has no curve of its own";
            self.error(path, message, "this load", "leave out `curve`, `from` and `to`");
            return None;
        }
        Some(constant())
    }

    fn implicit_load(&mut self, table: &LoadTable, path: &[&str]) -> Option<Vec<Acting>> {
        let at = |key| [path, &[key]].concat();
        if let LoadTable::Gravity(gravity) = table {
            return self.implicit_gravity(gravity, path);
        }
        let body = match self.find_target(table.on()?, &at("on"))? {
            Subject::Body(body) => body,
            Subject::Surface(surface) => return self.load_on_surface(table, surface, path),
        };
        let shell = self.has_rotations(body);
        let kind = match table {
            LoadTable::Force(force) => self.nodal_forces(force, Subject::Body(body), path)?,
            LoadTable::Moment(moment) => self.moment(moment, body, shell, path)?,
            LoadTable::Traction(traction) if shell => {
                let facets = self.facets(body, &traction.faces, &at("faces"))?;
                self.assembly.area_load(&facets, Vector3::from(traction.traction))
            }
            LoadTable::Traction(traction) => {
                let faces = self.faces(Subject::Body(body), &traction.faces, &at("faces"))?;
                LoadKind::Forces(self.traction_forces(Subject::Body(body), &faces, traction.traction))
            }
            LoadTable::Pressure(pressure) if shell => self.shell_pressure(pressure, body, path)?,
            LoadTable::Pressure(pressure) => {
                let faces = self.faces(Subject::Body(body), &pressure.faces, &at("faces"))?;
                LoadKind::Pressure { faces, pressure: pressure.pressure }
            }
            LoadTable::Edge(edge) => {
                if !shell {
                    let message = "a load on edges is for shells";
                    self.error(&at("on"), message, "not a shell", "take a `traction`");
                    return None;
                }
                let nodes = self.body_nodes(body, &edge.nodes, &at("nodes"))?;
                let edges = self.border_edges(body, &nodes);
                if edges.is_empty() {
                    let message = "no edge of the border has both its ends selected";
                    let help = "select all nodes along a border of the shell";
                    self.error(&at("nodes"), message, "this selection", help);
                    return None;
                }
                self.assembly.edge_load(&edges, Vector3::from(edge.traction))
            }
            LoadTable::Gravity(_) => return None,
        };
        Some(vec![(kind, None)])
    }

    /// A load on a surface that a body carries.
    fn load_on_surface(&mut self, table: &LoadTable, surface: usize, path: &[&str]) -> Option<Vec<Acting>> {
        let at = |key| [path, &[key]].concat();
        let target = Subject::Surface(surface);
        let kind = match table {
            LoadTable::Force(force) => self.nodal_forces(force, target, path)?,
            LoadTable::Traction(traction) => {
                let faces = self.faces(target, &traction.faces, &at("faces"))?;
                LoadKind::Forces(self.traction_forces(target, &faces, traction.traction))
            }
            _ => {
                let message = "a carried surface takes forces and tractions";
                self.error(&at("on"), message, "a carried surface", "load the body itself");
                return None;
            }
        };
        Some(vec![(kind, Some(surface))])
    }

    /// The weight of all bodies.
    fn weight_of_all(&self, acceleration: [f64; 3]) -> Vec<Acting> {
        let of_body = |body| (LoadKind::Gravity { body, acceleration }, None);
        self.bodies_with_nodes().into_iter().map(of_body).collect()
    }

    fn implicit_gravity(&mut self, table: &GravityTable, path: &[&str]) -> Option<Vec<Acting>> {
        let at = |key| [path, &[key]].concat();
        let acceleration = table.acceleration;
        let body = match (&table.on, &table.nodes) {
            (Some(name), _) => self.find_body(name, &at("on"))?,
            (None, None) => return Some(self.weight_of_all(acceleration)),
            (None, Some(_)) => {
                let message = "`nodes` are nodes of one body, which `on` must name";
                self.error(&at("nodes"), message, "of which body?", "add `on = \"BODY\"`");
                return None;
            }
        };
        let Some(selection) = &table.nodes else {
            return Some(vec![(LoadKind::Gravity { body, acceleration }, None)]);
        };
        let nodes = self.body_nodes(body, selection, &at("nodes"))?;
        let weight = |node: u32| (node, acceleration.map(|a| a * self.assembly.mass[node as usize]));
        Some(vec![(LoadKind::Forces(nodes.into_iter().map(weight).collect()), None)])
    }

    fn moment(&mut self, table: &MomentTable, body: usize, shell: bool, path: &[&str]) -> Option<LoadKind> {
        let at = |key| [path, &[key]].concat();
        if !shell {
            let message = "only the nodes of shells take moments";
            self.error(&at("on"), message, "not a shell", "take forces");
            return None;
        }
        let nodes = self.body_nodes(body, &table.nodes, &at("nodes"))?;
        let moment = match (table.each, table.total) {
            (Some(each), None) => Vector3::from(each),
            (None, Some(total)) => Vector3::from(total) / nodes.len() as f64,
            (each, _) => {
                let found = if each.is_some() { "both" } else { "neither" };
                let message = format!("a moment has exactly one of `each` and `total`, found {found}");
                let help = "`each` acts on every node, `total` is shared among them";
                self.error(path, message, "this moment", help);
                return None;
            }
        };
        Some(LoadKind::moment(nodes, moment))
    }

    fn shell_pressure(&mut self, table: &PressureTable, body: usize, path: &[&str]) -> Option<LoadKind> {
        let cells = self.facets(body, &table.faces, &[path, &["faces"]].concat())?;
        let model = &self.assembly;
        let membrane = cells.first().map(|&cell| model.facets[cell as usize].membrane());
        let curved = matches!(membrane, Some(Membrane::Curved { .. }));
        let spread = match table.spread {
            Some(SpreadName::Lumped) => Spread::Lumped,
            Some(SpreadName::Curved) => Spread::Curved,
            None if curved => Spread::Curved,
            None => Spread::Lumped,
        };
        let resolution = model.resolution(&cells);
        match (membrane, spread) {
            (Some(Membrane::Curved { .. }), Spread::Lumped) => self.warn_of_spread(true, body, path),
            (Some(Membrane::Opt { .. } | Membrane::Cst { .. }), Spread::Curved) => {
                self.warn_of_spread(false, body, path);
            }
            _ => {}
        }
        if curved {
            self.tell_resolution(resolution, cells.len(), body, path);
        }
        Some(LoadKind::ShellPressure { facets: cells, pressure: table.pressure, spread })
    }

    /// Warns of a pressure and a membrane, curved or not, that are not of the same surface.
    fn warn_of_spread(&mut self, curved: bool, body: usize, path: &[&str]) {
        let name = &self.bodies[body].name;
        let (message, help) = if curved {
            (
                format!("a lumped pressure does not go with `dkt-curved`, the element of `{name}`"),
                "leave `spread` out, or take `element = \"dkt-opt\"`",
            )
        } else {
            (
                format!("a pressure from the curved surface does not go with the flat membrane of `{name}`"),
                "take `element = \"dkt-curved\"`, or leave `spread` out",
            )
        };
        let message = format!("{message}: on a thin curved wall displacements scatter from node to node");
        let place = self.source().span(&[path, &["spread"]].concat());
        self.out.push(Diagnostic::warning(message).at(place, "not of one surface").help(help));
    }

    /// Says where a mesh is too coarse for pressure on a thin curved wall, or its normals are estimated.
    fn tell_resolution(&mut self, found: Resolution, count: usize, body: usize, path: &[&str]) {
        let name = self.bodies[body].name.clone();
        if found.estimated > 0 {
            self.notes.push(format!(
                "`{name}`: the normals of {} of {count} curved triangles under pressure are estimated from the triangles, which costs \
                 accuracy on irregular meshes; meshes of `pliant mesh --as shells` and built-in shapes bring the normals of their \
                 surface",
                found.estimated
            ));
        }
        if found.coarse > 0 {
            let message = format!(
                "{} of {count} of `{name}` under pressure have edges above 2 √(R t), with R the radius of curvature: the \
                 worst is triangle {} (counted from 0) with {} m, where {} m is the limit",
                counted(found.coarse, "triangle"),
                self.own_cell(body, found.worst),
                number(found.edge),
                number(found.limit)
            );
            let help = "on an irregular mesh displacements scatter there from node to node: take shorter edges or a regular mesh";
            let place = self.source().span(path);
            self.out.push(Diagnostic::warning(message).at(place, "on a coarse curved wall").help(help));
        }
    }

    /// The number of a facet in its body.
    fn own_cell(&self, body: usize, cell: u32) -> u32 {
        self.shell_cells(body).and_then(|cells| cells.first().copied()).map_or(cell, |first| cell - first)
    }

    /// The edges of one triangle only both of whose ends are among some nodes of the model (increasing).
    fn border_edges(&self, body: usize, nodes: &[u32]) -> Vec<[u32; 2]> {
        let Some(cells) = self.shell_cells(body) else { return Vec::new() };
        let mut count: BTreeMap<[u32; 2], u32> = BTreeMap::new();
        for facet in cells.iter().map(|&cell| &self.assembly.facets[cell as usize]) {
            for corner in 0..3 {
                let [a, b] = [facet.nodes[corner], facet.nodes[(corner + 1) % 3]];
                *count.entry([a.min(b), a.max(b)]).or_default() += 1;
            }
        }
        let chosen = |edge: &[u32; 2]| edge.iter().all(|node| nodes.binary_search(node).is_ok());
        count.into_iter().filter(|(edge, n)| *n == 1 && chosen(edge)).map(|(edge, _)| edge).collect()
    }

    fn control(&mut self, table: &ControlTable) -> Option<RunControl> {
        let scene = self.scene;
        let path = scene.run_at("control");
        let scene = self.scene;
        if !scene.loads.iter().any(|(name, _)| *name == table.load) {
            let known: Vec<&str> = scene.loads.iter().map(|(name, _)| name.as_str()).collect();
            let help = suggestion(&table.load, &known, SCENE, "loads");
            let message = format!("there is no load `{}`", table.load);
            self.error(&[&path[..], &["load"]].concat(), message, "no such load", help);
            return None;
        }
        let given = [table.displacement.is_some(), table.arc_length.is_some(), table.volume.is_some()];
        if given.iter().filter(|&&given| given).count() != 1 {
            let message = "a control has exactly one of `displacement`, `arc-length` and `volume`";
            self.error(&path, message, "this control", "leave the others out");
            return None;
        }
        let control = match (&table.displacement, table.arc_length, table.volume) {
            (Some(wanted), _, _) => (self.controlled_node(wanted, &[&path[..], &["displacement"]].concat()))
                .map(|(node, component, by)| RunControl::Displacement { node, component, by }),
            (_, Some(length), _) => {
                self.stop(table.stop.as_ref()).map(|stop| RunControl::ArcLength { length, stop })
            }
            (_, _, Some(volume)) => self.controlled_volume(&table.load, volume),
            _ => None,
        };
        if table.stop.is_some() && table.arc_length.is_none() {
            let message = "`stop` is for `arc-length`: other controls end where they are set to end";
            self.error(&[&path[..], &["stop"]].concat(), message, "has no effect here", "remove it");
        }
        control
    }

    /// Returns the end of a path by arc length: a load factor of 1, unless `stop` gives another.
    fn stop(&mut self, table: Option<&StopTable>) -> Option<Stop> {
        let Some(table) = table else { return Some(Stop { load_factor: Some(1.0), ..Stop::default() }) };
        let scene = self.scene;
        let path = [&scene.run_at("control")[..], &["stop", "displacement"]].concat();
        let displacement = match &table.displacement {
            Some(wanted) => Some(self.controlled_node(wanted, &path)?),
            None => None,
        };
        let (load_factor, limit_points) = (table.load_factor, table.limit_points);
        if load_factor.is_none() && displacement.is_none() && limit_points.is_none() {
            let message = "`stop` needs one of `load-factor`, `displacement` and `limit-points`";
            self.error(&path[..3], message, "says nothing", "remove it to end at a load factor of 1");
            return None;
        }
        Some(Stop { load_factor, displacement, limit_points })
    }

    /// The node nearest to a place, the component and how far it moves [m].
    fn controlled_node(&mut self, wanted: &ControlledNode, path: &[&str]) -> Option<(u32, usize, f64)> {
        let at = |key| [path, &[key]].concat();
        let body = self.find_body(&wanted.body, &at("body"))?;
        let nodes = self.assembly.bodies[body].all_nodes();
        let place = Vector3::from(wanted.at);
        let away = |node: &u32| (Vector3::from(self.assembly.rest[*node as usize]) - place).norm_squared();
        let node = nodes.min_by(|a, b| away(a).total_cmp(&away(b)))?;
        let component = match wanted.component {
            Axis::X => 0,
            Axis::Y => 1,
            Axis::Z => 2,
            _ => {
                let message = "a control moves a node along x, y or z, and does not turn it";
                self.error(&at("component"), message, "a rotation", "take `x`, `y` or `z`");
                return None;
            }
        };
        Some((node, component, wanted.by))
    }

    fn controlled_volume(&mut self, load: &str, to: f64) -> Option<RunControl> {
        let pressed =
            self.assembly.loads.iter().filter(|known| known.name == load).find_map(|load| match &load.kind {
                LoadKind::ShellPressure { facets, .. } => Some(facets),
                _ => None,
            });
        let scene = self.scene;
        let path = [&scene.run_at("control")[..], &["volume"]].concat();
        let Some(cells) = pressed else {
            let message = format!("`{load}` is no pressure on a shell, which a volume is controlled by");
            self.error(&path, message, "of what?", "let `load` name a pressure on a closed shell");
            return None;
        };
        match self.assembly.check_closed(cells) {
            Ok(()) => {
                let from = self.assembly.rest_volume(cells);
                Some(RunControl::Volume { from, to })
            }
            Err(error) => {
                let help = "close the surface, or press on all of it";
                self.error(&path, error.to_string(), "of an open surface", help);
                None
            }
        }
    }
}

fn constant() -> Curve {
    Curve { shape: Shape::Hold, from: 0.0, to: 0.0 }
}
