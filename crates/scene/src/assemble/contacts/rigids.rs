//! Obstacles and tools of a contact, and how they move and grow.

use std::io;
use std::path::Path;
use std::sync::Arc;

use pliant_format::tables::{GrowthTable, JawsTool, RotateTable, ShapeName, ToolTable};
use pliant_format::{rows_of, table as table_file};
use pliant_geometry::Vector3;
use pliant_geometry::words::number;
use pliant_mechanics::curve::{Curve, Shape as CurveShape};
use pliant_sim::contact::pose::{Pose, Trajectory};
use pliant_sim::contact::profile::{Corner, Profile};
use pliant_sim::contact::shape::Shape;
use pliant_sim::contact::touch::{Jaw, Rigid};

use super::Loaded;

/// An obstacle or a tool of a scene.
#[derive(Clone, Copy)]
struct Thing<'t> {
    /// The table that it is in: `obstacle` or `tool`.
    kind: &'t str,
    name: &'t str,
    table: &'t ToolTable,
}

impl<'t> Thing<'t> {
    /// The path of its table.
    fn path(self) -> [&'t str; 2] {
        [self.kind, self.name]
    }

    /// The path of a key of its table.
    fn at(self, key: &'t str) -> [&'t str; 3] {
        [self.kind, self.name, key]
    }

    fn has_jaws(self) -> bool {
        matches!(self.table.shape, ShapeName::Jaws(_))
    }
}

impl Loaded<'_> {
    /// The rigid thing of a table, or its two jaws.
    pub(super) fn rigids(&mut self, kind: &str, name: &str, table: &ToolTable) -> Option<Vec<Rigid>> {
        let thing = Thing { kind, name, table };
        let only_of_jaws = [("opening", table.opening.is_some()), ("ideal-grip", table.ideal_grip.is_some())];
        if let Some((key, _)) = only_of_jaws.into_iter().find(|(_, given)| *given && !thing.has_jaws()) {
            let help = "`shape = { jaws = { length = 0.03, width = 0.008, thickness = 0.004 } }` has jaws";
            self.error(&thing.at(key), format!("`{key}` is for a tool with jaws"), "no jaws", help);
            return None;
        }
        let shape = self.shape_of(thing)?;
        let mut trajectory = self.trajectory(thing, &shape)?;
        if let Some(limit) = table.force_limit {
            trajectory = trajectory.limited(limit);
        }
        if let Some(growth) = &table.grows {
            trajectory = self.growing(thing, growth, &shape, trajectory)?;
        }
        match &table.shape {
            ShapeName::Jaws(of) => self.jaws(thing, of, shape, trajectory),
            _ => {
                let inside = table.inside;
                Some(vec![Rigid { name: name.into(), shape, trajectory, inside, jaw: None }])
            }
        }
    }

    /// The shape of a thing, or of each of its jaws.
    fn shape_of(&mut self, thing: Thing<'_>) -> Option<Shape> {
        let at = thing.at("shape");
        let within = |key| [thing.kind, thing.name, "shape", key];
        Some(match &thing.table.shape {
            ShapeName::Sphere(of) => Shape::Sphere { radius: of.radius },
            ShapeName::Capsule(of) => Shape::Capsule { radius: of.radius, length: of.length },
            ShapeName::Cylinder(of) => Shape::Cylinder { radius: of.radius, length: of.length },
            ShapeName::Box(of) if of.size.iter().any(|&edge| edge <= 0.0) => {
                self.error(&at, "the box has no volume", "its edges", "give three lengths above 0");
                return None;
            }
            ShapeName::Box(of) => Shape::Cuboid { size: of.size },
            ShapeName::Cone(of) => Shape::Cone { radius: of.radius, height: of.height },
            ShapeName::HalfSpace => Shape::HalfSpace,
            ShapeName::Revolved(of) => {
                let corners = of.outline.iter().map(|&[z, r, rounding]| Corner { at: [z, r], rounding });
                match Profile::new(corners.collect()) {
                    Ok(profile) => Shape::Revolved(Arc::new(profile)),
                    Err(error) => {
                        let help = "points are `[height, distance from the axis, radius of the arc]`, counted from 0";
                        self.error(&at, error.to_string(), "this outline", help);
                        return None;
                    }
                }
            }
            ShapeName::Jaws(of) => Shape::Cuboid { size: [of.width, of.thickness, of.length] },
            ShapeName::Mesh(of) => self.shape_of_mesh(of, &within("mesh"))?,
            ShapeName::Image(of) => self.shape_of_image(of, &within("image"))?,
        })
    }

    /// Returns the motion of a thing of a shape, without limits.
    fn trajectory(&mut self, thing: Thing<'_>, shape: &Shape) -> Option<Trajectory> {
        let Thing { kind, name, table } = thing;
        self.note_turns(&format!("{kind} `{name}`: `turn`"), Vector3::from(table.turn).norm());
        let start = Pose::new(table.at.into(), table.turn.into());
        let ways = [table.by.is_some(), table.rotate.is_some(), table.poses.is_some()];
        if ways.iter().filter(|&&given| given).count() > 1 {
            let help = "leave all but one out";
            let message = format!("{kind} `{name}` has more than one of `by`, `rotate` and `poses`");
            self.error(&thing.path(), message, "several motions", help);
            return None;
        }
        if let Some(shift) = table.by {
            return Some(Trajectory::by(start, shift, self.curve(&table.timing, &thing.path())?));
        }
        if let Some(rotate) = table.rotate {
            return self.rotating(thing, rotate, start);
        }
        if let Some(file) = &table.poses {
            return self.by_poses(thing, file, start, shape.reach());
        }
        Some(Trajectory::fixed(start))
    }

    fn rotating(&mut self, thing: Thing<'_>, rotate: RotateTable, start: Pose) -> Option<Trajectory> {
        let at = thing.at("rotate");
        let Some(axis) = Vector3::from(rotate.axis).try_normalize(0.0) else {
            self.error(&at, "the axis of the rotation is zero", "this axis", "give a direction");
            return None;
        };
        let angle = self.angle(&at, rotate.angle, rotate.degrees)?;
        let curve = self.curve(&thing.table.timing, &thing.path())?;
        Some(Trajectory::turn(start, axis.into(), rotate.centre, angle, curve))
    }

    /// Along a table of poses, for a thing of a radius [m].
    fn by_poses(&mut self, thing: Thing<'_>, file: &Path, start: Pose, reach: f64) -> Option<Trajectory> {
        let text = self.scene.file(file).and_then(|found| table_file(&found));
        let found = poses(file, text).and_then(|poses| {
            let (poses, jump) = slowed(poses, reach);
            let none = || format!("`{}` has no poses, or its times do not increase", file.display());
            Ok((Trajectory::table(start, poses).ok_or_else(none)?, jump))
        });
        let (trajectory, jump) = match found {
            Ok(found) => found,
            Err(message) => {
                self.error(&thing.at("poses"), message, "this table", ROW);
                return None;
            }
        };
        self.notes.extend(jump.map(|Jump { time, speed, late }| {
            format!(
                "{} `{}`: its table of poses needs {} m/s from t = {} s on; Pliant moves it at {FASTEST} m/s, up to {} s late",
                thing.kind,
                thing.name,
                number(speed),
                number(time),
                number(late)
            )
        }));
        Some(trajectory)
    }

    /// The jaws of a tool: boxes of a shape that move together.
    fn jaws(
        &mut self,
        thing: Thing<'_>,
        of: &JawsTool,
        shape: Shape,
        trajectory: Trajectory,
    ) -> Option<Vec<Rigid>> {
        let Thing { kind, name, table } = thing;
        if table.inside {
            let help = "leave it out: bodies lie between the jaws, outside of each";
            self.error(&thing.at("inside"), "`inside` is not for jaws", "a tool with jaws", help);
            return None;
        }
        let opening = match &table.opening {
            Some(opening) => {
                let at = thing.at("opening");
                let angle = self.angle(&at, opening.angle, opening.degrees)?;
                (angle, self.curve(&opening.timing, &at)?)
            }
            None => (0.0, Curve { shape: CurveShape::Hold, from: 0.0, to: 1.0 }),
        };
        self.note_turns(&format!("{kind} `{name}`: `ideal-grip`"), table.ideal_grip.unwrap_or_default());
        // The upper one turns from z towards y, against the axis x.
        let sides = [("upper", 1.0), ("lower", -1.0)];
        let rigids = sides.map(|(side, sign)| Rigid {
            name: format!("{name}.{side}"),
            shape: shape.clone(),
            trajectory: trajectory.clone(),
            inside: false,
            jaw: Some(Jaw {
                tool: name.into(),
                part: -0.5 * sign,
                opening: opening.clone(),
                place: Pose::translation(0.0, 0.5 * sign * of.thickness, 0.5 * of.length),
                grip: table.ideal_grip,
            }),
        });
        Some(rigids.into())
    }

    /// The trajectory of a thing of a shape with its growth.
    fn growing(
        &mut self,
        thing: Thing<'_>,
        growth: &GrowthTable,
        shape: &Shape,
        trajectory: Trajectory,
    ) -> Option<Trajectory> {
        let path = thing.at("grows");
        if thing.has_jaws() {
            let help = "leave it out, or take another shape";
            self.error(&path, "jaws do not grow", "a tool with jaws", help);
            return None;
        }
        let curve = self.curve(&growth.timing, &path)?;
        let [low, high] = curve.range().map(|part| part * growth.by);
        let (least, thinnest) = (low.min(high), shape.thinnest());
        let round = matches!(shape, Shape::Sphere { .. } | Shape::Capsule { .. });
        if least < 0.0 && (thing.table.inside || !round) {
            let message = format!(
                "`grows` reaches {} m, but only spheres and capsules without `inside` can shrink below their shape",
                number(least)
            );
            let help = "give the shape its smallest size, and let it grow from there";
            self.error(&path, message, "below 0", help);
            return None;
        }
        if least <= -thinnest {
            let message = format!(
                "the shape shrinks by {} m, but its radius is {} m",
                number(-least),
                number(thinnest)
            );
            self.error(&path, message, "nothing is left", "let it shrink by less");
            return None;
        }
        Some(trajectory.growing(growth.by, curve))
    }
}

/// Format of a row in a table of poses, for messages.
pub(super) const ROW: &str =
    "each row is `t,x,y,z,qw,qx,qy,qz`: a time in seconds, a position in metres, a unit quaternion";

/// The fastest that a tool goes by a table of poses [m/s]: faster than hands, and slow enough for nodes to be
/// pushed along.
pub(super) const FASTEST: f64 = 10.0;

/// Allowed difference of the length of a quaternion from 1.
pub(super) const UNIT: f64 = 1e-3;

/// A part of a table of poses that is too fast.
pub(super) struct Jump {
    /// Time at which the fastest part begins [s].
    pub(super) time: f64,
    /// Speed of the fastest part [m/s].
    pub(super) speed: f64,
    /// Longest delay of the tool at a row [s].
    pub(super) late: f64,
}

/// Slows a table of poses to at most [`FASTEST`]. Rows come later where the tool cannot be there before, and
/// it catches up after them. The tool has a radius [m].
pub(super) fn slowed(poses: Vec<(f64, Pose)>, reach: f64) -> (Vec<(f64, Pose)>, Option<Jump>) {
    if poses.windows(2).any(|rows| rows[0].0 >= rows[1].0) {
        return (poses, None);
    }
    let mut jump: Option<Jump> = None;
    let mut slowed: Vec<(f64, Pose)> = Vec::with_capacity(poses.len());
    let mut before: Option<(f64, Pose)> = None;
    for &(time, pose) in &poses {
        let (Some((asked, from)), Some(&(then, _))) = (before.replace((time, pose)), slowed.last()) else {
            slowed.push((time, pose));
            continue;
        };
        let way = (pose.translation.vector - from.translation.vector).norm()
            + from.rotation.angle_to(&pose.rotation) * reach;
        let (speed, arrives) = (way / (time - asked), time.max(then + way / FASTEST));
        if speed > FASTEST {
            let known = jump.get_or_insert(Jump { time: asked, speed, late: 0.0 });
            if speed > known.speed {
                (known.time, known.speed) = (asked, speed);
            }
        }
        if let Some(jump) = &mut jump {
            jump.late = jump.late.max(arrives - time);
        }
        // A tool that rests while it is late has no row there.
        if arrives > then {
            slowed.push((arrives, pose));
        }
    }
    (slowed, jump)
}

/// The poses of a table. Empty lines, a header and what follows a # are passed over.
pub(super) fn poses(file: &Path, text: io::Result<String>) -> Result<Vec<(f64, Pose)>, String> {
    let text = text.map_err(|error| format!("`{}` cannot be read: {error}", file.display()))?;
    let shown = file.file_name().unwrap_or(file.as_os_str()).to_string_lossy();
    let mut poses = Vec::new();
    for (row, line) in rows_of(&text) {
        let columns: Vec<&str> = row.split(',').map(str::trim).collect();
        if poses.is_empty() && columns[0].eq_ignore_ascii_case("t") {
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
        poses.push((t, Pose::from_parts(Vector3::new(x, y, z).into(), turn)));
    }
    Ok(poses)
}
