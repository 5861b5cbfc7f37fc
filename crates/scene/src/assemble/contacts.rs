//! Obstacles and tools, and the nodes that touch them.

use std::io;
use std::path::Path;
use std::sync::Arc;

use pliant_geometry::{Selection, Vector3};
use pliant_mechanics::load::NO_NODE;
use pliant_sim::contact::pose::{Course, Pose};
use pliant_sim::contact::shape::Shape;
use pliant_sim::contact::touch::{Contact, Contacts, Rigid, Touch};
use pliant_sim::{counted, number};

use super::{Builder, Target, suggestion};
use crate::format::{ContactTable, ShapeName, SolverName, ToolTable};
use crate::reads::{rows_of, table as table_file};

/// What a row of a table of poses holds.
const ROW: &str =
    "each row is `t,x,y,z,qw,qx,qy,qz`: a time in seconds, a position in metres, a unit quaternion";
/// How far the length of a quaternion may be off 1.
const UNIT: f64 = 1e-3;

impl Builder<'_> {
    /// The contacts of the scene; `None` without any.
    pub(super) fn contacts(&mut self) -> Option<Arc<Contacts>> {
        let scene = self.scene;
        let mut all = Contacts::default();
        // Things that nothing touches are checked, too.
        for (kind, tables) in [("obstacle", &scene.obstacles), ("tool", &scene.tools)] {
            for (name, table) in tables {
                if kind == "tool" && scene.obstacles.iter().any(|(known, _)| known == name) {
                    let message = format!("`{name}` is an obstacle already");
                    self.error(&[kind, name], message, "again", "give one of them another name");
                }
                all.rigids.extend(self.rigid(kind, name, table));
            }
        }
        for (name, table) in &scene.contacts {
            let contact = self.contact(name, table, &all.rigids);
            all.contacts.extend(contact);
        }
        (!all.contacts.is_empty()).then(|| Arc::new(all))
    }

    fn rigid(&mut self, kind: &str, name: &str, table: &ToolTable) -> Option<Rigid> {
        let path = [kind, name];
        let at = |key| [kind, name, key];
        let shape = match &table.shape {
            ShapeName::Sphere(of) => Shape::Sphere { radius: of.radius },
            ShapeName::Capsule(of) => Shape::Capsule { radius: of.radius, length: of.length },
            ShapeName::Box(of) if of.size.iter().any(|&edge| edge <= 0.0) => {
                self.error(&at("shape"), "a box without a volume", "its edges", "give three lengths above 0");
                return None;
            }
            ShapeName::Box(of) => Shape::Cuboid { size: of.size },
            ShapeName::Cone(of) => Shape::Cone { radius: of.radius, height: of.height },
            ShapeName::HalfSpace => Shape::HalfSpace,
        };
        let start = Pose::new(table.at.into(), table.turn.into());
        let ways = [table.by.is_some(), table.rotate.is_some(), table.poses.is_some()];
        if ways.iter().filter(|&&given| given).count() > 1 {
            let help = "leave all but one out";
            self.error(&path, "it moves by one of `by`, `rotate` and `poses`", "several", help);
            return None;
        }
        let course = if let Some(shift) = table.by {
            Course::by(start, shift, self.curve(&table.timing, &path)?)
        } else if let Some(rotate) = table.rotate {
            let axis = Vector3::from(rotate.axis);
            let Some(axis) = axis.try_normalize(0.0) else {
                self.error(
                    &at("rotate"),
                    "the axis of the rotation is zero",
                    "this axis",
                    "give a direction",
                );
                return None;
            };
            Course::turn(start, axis.into(), rotate.centre, rotate.angle, self.curve(&table.timing, &path)?)
        } else if let Some(file) = &table.poses {
            let text = self.scene.file(file).and_then(|found| table_file(&found));
            match poses(file, text).map(|poses| Course::table(start, poses)) {
                Ok(Some(course)) => course,
                Ok(None) => {
                    let message = format!("`{}` has no poses, or its times do not increase", file.display());
                    self.error(&at("poses"), message, "this table", ROW);
                    return None;
                }
                Err(message) => {
                    self.error(&at("poses"), message, "this table", ROW);
                    return None;
                }
            }
        } else {
            Course::fixed(start)
        };
        Some(Rigid { name: name.into(), shape, course, inside: table.inside })
    }

    fn contact(&mut self, name: &str, table: &ContactTable, rigids: &[Rigid]) -> Option<Contact> {
        let path = ["contact", name, "between"];
        let body = self.find_body(&table.between[0], &["contact", name, "between", "0"])?;
        let with = &table.between[1];
        let Some(rigid) = rigids.iter().position(|rigid| rigid.name == *with) else {
            let named = |(known, _): &(String, ToolTable)| known == with;
            if self.scene.obstacles.iter().chain(&self.scene.tools).any(named) {
                // Its own mistake is reported.
                return None;
            }
            let known: Vec<&str> = rigids.iter().map(|rigid| rigid.name.as_str()).collect();
            let help = match self.bodies.iter().any(|body| body.name == *with) {
                true => "contact of two bodies is not there yet: name an obstacle or a tool".into(),
                false => suggestion(with, &known, "the scene", "obstacles and tools"),
            };
            let message = format!("there is no obstacle or tool `{with}`");
            self.error(&["contact", name, "between", "1"], message, "no such thing", help);
            return None;
        };
        let run = &self.scene.run;
        let own = &table.between[0];
        let help = "take `solver = \"explicit\"` on the CPU, for solids, membranes and bars";
        if run.solver != SolverName::Explicit || self.shell_cells(body).is_some() {
            let by = if run.solver == SolverName::Explicit { "steps of shells" } else { run.solver.word() };
            let message = format!("contact is for the solver `explicit`, and `{own}` goes with `{by}`");
            self.error(&path, message, "not for this solver", help);
            return None;
        }
        let faces = match &table.faces {
            Some(selection) => self.faces(Target::Body(body), selection, &["contact", name, "faces"])?,
            None => self.faces(Target::Body(body), &Selection::All, &path)?,
        };
        let halves = faces.iter().flat_map(|&[a, b, c, d]| {
            let second = (d != NO_NODE).then_some([a, c, d]);
            std::iter::once([a, b, c]).chain(second)
        });
        let halves: Vec<[u32; 3]> = halves.collect();
        let mut nodes: Vec<u32> = faces.into_iter().flatten().filter(|&node| node != NO_NODE).collect();
        if nodes.is_empty() {
            nodes = self.assembly.bodies[body].all_nodes().collect();
        }
        nodes.sort_unstable();
        nodes.dedup();
        let follows = self.assembly.followers();
        let bound = self.assembly.constraints.iter().filter(|constraint| constraint.motion.is_collective());
        let mut bound: Vec<u32> = bound.flat_map(|constraint| constraint.nodes.iter().copied()).collect();
        bound.sort_unstable();
        let moved = |node: &&u32| follows[**node as usize] || bound.binary_search(node).is_ok();
        if let Some(&node) = nodes.iter().find(moved) {
            let message = format!(
                "node {} of `{own}` follows others by a tie, a rigid part or a mean",
                self.assembly.locate_node(node).1
            );
            let help = "choose `faces` without such nodes";
            self.error(&path, message, "bound to others", help);
            return None;
        }
        self.check_apart(name, table, &rigids[rigid], &nodes);
        let touch = Touch { friction: table.friction, offset: table.thickness };
        Some(Contact { name: name.into(), nodes, faces: halves, rigid, touch })
    }

    /// Refuses bodies that are in an obstacle or a tool at the start: a step would throw them out.
    fn check_apart(&mut self, name: &str, table: &ContactTable, rigid: &Rigid, nodes: &[u32]) {
        let pose = rigid.course.at(0.0);
        let places = nodes.iter().map(|&node| Vector3::from(self.assembly.rest[node as usize]));
        let gaps = places.map(|place| (rigid.near(&pose, &place).distance - table.thickness, place));
        let size = self.assembly.rest.iter().flatten().fold(0.0_f64, |most, x| most.max(x.abs()));
        let inside: Vec<(f64, Vector3)> = gaps.filter(|(gap, _)| *gap < -1e-9 * size).collect();
        let Some((gap, place)) = inside.iter().min_by(|a, b| a.0.total_cmp(&b.0)) else { return };
        let [x, y, z] = [place.x, place.y, place.z].map(number);
        let message = format!(
            "{} of `{}` {} in `{}` at the start, up to {} m deep at ({x}, {y}, {z}) m",
            counted(inside.len(), "node"),
            table.between[0],
            if inside.len() == 1 { "lies" } else { "lie" },
            rigid.name,
            number(-gap)
        );
        let help = "move one of them (`at`), or make `thickness` smaller; `inside = true` is for bodies within an obstacle";
        self.error(&["contact", name, "between"], message, "overlapping", help);
    }
}

/// The poses of a table. Empty lines, a header and what follows a # are passed over.
fn poses(file: &Path, text: io::Result<String>) -> Result<Vec<(f64, Pose)>, String> {
    let text = text.map_err(|error| format!("`{}` cannot be read: {error}", file.display()))?;
    let shown = file.file_name().unwrap_or(file.as_os_str()).to_string_lossy();
    let mut all = Vec::new();
    for (row, line) in rows_of(&text) {
        let columns: Vec<&str> = row.split(',').map(str::trim).collect();
        if all.is_empty() && columns[0].eq_ignore_ascii_case("t") {
            continue;
        }
        let numbers: Option<Vec<f64>> =
            columns.iter().map(|text| text.parse().ok().filter(|x: &f64| x.is_finite())).collect();
        let Some(Ok([t, x, y, z, w, i, j, k])) = numbers.map(<[f64; 8]>::try_from) else {
            return Err(format!("{shown}:{line}: a row has 8 finite numbers, found `{row}`"));
        };
        let turn = nalgebra::Quaternion::new(w, i, j, k);
        if (turn.norm() - 1.0).abs() > UNIT {
            return Err(format!("{shown}:{line}: the quaternion has length {}, not 1", number(turn.norm())));
        }
        let turn = nalgebra::UnitQuaternion::from_quaternion(turn);
        all.push((t, Pose::from_parts(Vector3::new(x, y, z).into(), turn)));
    }
    Ok(all)
}
