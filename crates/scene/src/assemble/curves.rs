//! The curves of motions and loads over time, and the angles of turns.

use std::f64::consts::TAU;

use pliant_format::diagnostic::Diagnostic;
use pliant_format::tables::{CurveShape, SolverName, StepChoice, Timing};
use pliant_geometry::words::number;
use pliant_mechanics::curve::{Curve, Shape};

use super::Context;

impl Context<'_> {
    /// Returns the curve of a motion or a load. In a static run its value at t = 0 grows within the first
    /// load step, so that the step can be halved.
    pub(super) fn course(&mut self, timing: &Timing, path: &[&str]) -> Option<Curve> {
        let curve = self.curve(timing, path)?;
        Some(self.eased(curve))
    }

    /// In a static run the [same curve from rest](Curve::from_rest).
    pub(super) fn eased(&self, curve: Curve) -> Curve {
        let (run, until) = (&self.scene.run, self.scene.scene.until);
        match (run.solver, run.step) {
            (SolverName::Static, StepChoice::Seconds(step)) => curve.from_rest(step.min(until)),
            (SolverName::Static, StepChoice::Auto(_)) => curve.from_rest(run.load_steps.first(until)),
            _ => curve,
        }
    }

    /// The curve of a timing; diagnostics in the table at `path`. Without a shape: a smooth step.
    pub(super) fn curve(&mut self, timing: &Timing, path: &[&str]) -> Option<Curve> {
        let at = |key| [path, &[key]].concat();
        let until = self.scene.scene.until;
        let mut to = timing.to.unwrap_or(until);
        let shape = match timing.curve.as_ref().unwrap_or(&CurveShape::SmoothStep) {
            CurveShape::Ramp => Shape::Ramp,
            CurveShape::SmoothStep => Shape::SmoothStep,
            CurveShape::Polynomial => Shape::Polynomial,
            CurveShape::Hold => Shape::Hold,
            CurveShape::Wave(_) if timing.to.is_some() => {
                let help = "leave out `to`: a wave goes on to the end of the scene";
                self.error(&at("to"), "a wave does not end", "here", help);
                return None;
            }
            CurveShape::Wave(period) if *period <= 0.0 => {
                let message = format!("the period of the wave must be greater than 0, found {period}");
                self.error(&at("curve"), message, "this wave", "give seconds");
                return None;
            }
            &CurveShape::Wave(period) => {
                to = timing.from + period;
                Shape::Wave
            }
            CurveShape::Table(points) => {
                if points.is_empty() || points.windows(2).any(|w| w[1][0] <= w[0][0]) {
                    let help = "give pairs [time, factor] with increasing times";
                    self.error(&at("curve"), "the times of the table do not increase", "this table", help);
                    return None;
                }
                if timing.to.is_some() || timing.from != 0.0 {
                    let help = "leave out `from` and `to`: the table has its own times";
                    self.error(&at("curve"), "a table goes with neither `from` nor `to`", "this table", help);
                    return None;
                }
                Shape::Table(points.iter().map(|&[time, factor]| (time, factor)).collect())
            }
        };
        if to <= timing.from && shape != Shape::Hold {
            let message = format!("`to` ({to} s) must be later than `from` ({} s)", timing.from);
            let key = if timing.to.is_some() { "to" } else { "from" };
            self.error(&at(key), message, "here", "`to` is the end of the scene unless it is given");
            return None;
        }
        self.note_timing(&shape, [timing.from, to], path);
        // These two have no end, and are the same whenever the scene ends.
        let to = if matches!(shape, Shape::Hold | Shape::Table(_)) { timing.from } else { to };
        Some(Curve { shape, from: timing.from, to })
    }

    /// Notes the part of a curve that the end of the scene cuts off.
    fn note_timing(&mut self, shape: &Shape, [from, to]: [f64; 2], path: &[&str]) {
        let (name, until) = (path.join("."), self.scene.scene.until);
        let (begins, ends) = match shape {
            Shape::Table(points) => (points.first().map_or(0.0, |first| first.0), until),
            Shape::Hold | Shape::Wave => (from, from),
            _ => (from, to),
        };
        if begins >= until && begins > 0.0 {
            let message = format!("`{name}` begins at {begins} s, but the scene ends at {until} s");
            let place = self.source().key_span(path);
            let help = "let it begin earlier, or the scene last longer (`until`)";
            self.out.push(Diagnostic::warning(message).at(place, "never begins").help(help));
        } else if ends > until {
            self.notes.push(format!("`{name}` is complete at {ends} s, but the scene ends at {until} s"));
        }
    }

    /// An angle [rad] that a table gives as `angle` or in `degrees`.
    pub(super) fn angle(&mut self, path: &[&str], angle: Option<f64>, degrees: Option<f64>) -> Option<f64> {
        match (angle, degrees) {
            (Some(angle), None) => {
                self.note_turns(&format!("`{}.angle`", path.join(".")), angle);
                Some(angle)
            }
            (None, Some(degrees)) => Some(degrees.to_radians()),
            (angle, _) => {
                let found = if angle.is_some() { "both" } else { "neither" };
                let message = format!("an angle is given by `angle` or by `degrees`, found {found}");
                let help = "`angle` in radians, `degrees` in degrees";
                self.error(path, message, "this angle", help);
                None
            }
        }
    }

    /// Notes an angle [rad] of more than a whole turn: it may have been meant in degrees.
    pub(super) fn note_turns(&mut self, what: &str, angle: f64) {
        let turns = angle.abs() / TAU;
        if turns > 1.0 + 1e-9 {
            self.notes.push(format!("{what}: {} rad are {turns:.1} turns: degrees?", number(angle)));
        }
    }
}

#[cfg(test)]
mod tests {
    use crate::testing::built;

    #[test]
    fn a_motion_that_the_end_cuts_off_is_noted() {
        let moved = |timing: &str| {
            built(&format!(
                "[constraint.top]\ntype = 'move'\nbody = 'cube'\nnodes = {{ set = 'z-max' }}\nby = [0, 0, 1e-3]\n{timing}\n"
            ))
        };
        assert!(moved("").notes.is_empty() && moved("to = 0.1").notes.is_empty());
        assert_eq!(
            moved("to = 0.5").notes,
            ["`constraint.top` is complete at 0.5 s, but the scene ends at 0.1 s"]
        );
        let late = moved("from = 0.2\nto = 0.5");
        assert!(late.warnings[0].message.contains("begins at 0.2 s"), "{:?}", late.warnings);
    }
}
