//! A tick: the pose of the device in, the force out. The renderer knows no clock, so that tests run it as
//! fast as they like. The force changes linearly from one local model to the next, over the period of the
//! simulation: f = (1−s) f_old(x) + s f_new(x). So the force does not jump when a model comes in. A device
//! that leaves the tissue is free at once. The next model is taken when the last one is reached.
//!
//! The coupling κ (p − x) − (B/T) (p′ − x′) = f with κ = K + B/T holds the proxy p; ′ is the tick before. The
//! proxy has no mass, so the device feels f, less what the [guard](crate::guard) adds, up to the force limit.
//!
//! The force is computed for a place a little ahead, x + v t with t = T/2 by default. Held over the tick, it
//! is then about the mean of a spring's force on the way. Without this, a spring K that is held gives out K
//! v² T/2 (Gillespie and Cutkosky 1996, "Stable user-specific haptic rendering of the virtual wall").
//!
//! The energy of the record includes the whole force. Leaves out: moments.

use nalgebra::{Isometry3, Vector3};

use crate::coupling::Coupling;
use crate::error::HapticsError;
use crate::guard::{Guard, Observer};
use crate::model::LocalModel;
use crate::proxy::Proxy;

/// Settings of the forces.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Settings {
    /// Time [s] between two ticks.
    pub period: f64,
    /// Spring and damper between the proxy and the device.
    pub coupling: Coupling,
    /// Time [s] ahead of the pose for which the force is made. Half a period makes up for the hold; add a
    /// delay of the device. It damps like K times this time, which counts in the [limit](Coupling::limit)
    /// like a delay.
    pub ahead: f64,
    /// Largest force [N].
    pub force_limit: f64,
    /// Largest change [N] of the force from a tick to the next, if it is bound. A bound delays the force
    /// where a hand goes fast.
    pub most_change: Option<f64>,
    /// The guard, if any.
    pub guard: Option<Guard>,
    /// Time [s] over which the force comes up after the start or a silence.
    pub soft_start: f64,
}

impl Default for Settings {
    /// 1 kHz, up to 3.3 N, guarded, with a start over 0.1 s.
    fn default() -> Self {
        Self {
            period: 1e-3,
            coupling: Coupling::default(),
            ahead: 0.5e-3,
            force_limit: 3.3,
            most_change: None,
            guard: Some(Guard::default()),
            soft_start: 0.1,
        }
    }
}

/// Answer to a device.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Answer {
    /// The force [N] on the device.
    pub force: Vector3<f64>,
    /// True if the guard damps.
    pub guarded: bool,
    /// True if the force is cut to its limit.
    pub limited: bool,
    /// True if the pose was invalid, so that the last one holds.
    pub held: bool,
}

/// Counts and extremes since the start.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Record {
    /// Ticks.
    pub ticks: u64,
    /// Local models taken.
    pub models: u64,
    /// Poses with numbers that are not finite or with quaternions that are no rotations.
    pub invalid: u64,
    /// Ticks at which the guard damped.
    pub guarded: u64,
    /// Ticks at which the force was cut to its limit.
    pub limited: u64,
    /// Largest force [N].
    pub peak: f64,
    /// Largest change [N] of the force from a tick to the next.
    pub jump: f64,
    /// Energy [J] that the device has put in.
    pub energy: f64,
    /// The least of it [J]; below zero where the device once had got more than it gave.
    pub least_energy: f64,
}

/// A model with the proxy on it.
#[derive(Clone, Debug)]
struct Layer {
    model: LocalModel,
    proxy: Proxy,
}

/// The last tick.
#[derive(Clone, Copy, Debug)]
struct Last {
    pose: Isometry3<f64>,
    /// Proxy less device [m].
    stretch: Vector3<f64>,
    /// Force of the model [N].
    touch: Vector3<f64>,
}

/// Makes forces of poses.
#[derive(Clone, Debug)]
pub struct Renderer {
    settings: Settings,
    old: Option<Layer>,
    new: Option<Layer>,
    /// Progress from the old to the new model, from 0 to 1.
    part: f64,
    last: Option<Last>,
    /// The last force on the device [N], also over a silence.
    felt: Vector3<f64>,
    /// Factor of the soft start on the force, from 0 to 1.
    gain: f64,
    observer: Observer,
    record: Record,
}

impl Renderer {
    /// In free space.
    ///
    /// # Errors
    /// If a setting is out of range or not finite.
    pub fn new(settings: Settings) -> Result<Self, HapticsError> {
        let Settings { period, coupling, ahead, force_limit, most_change, guard, soft_start } = settings;
        let fits = (1e-5..=0.1).contains(&period);
        HapticsError::check("the period of the haptic loop [s]", period, fits, "give 1e-5 to 0.1 s")?;
        coupling.check()?;
        let remedy = "give 0 to 0.01 s, half a period by default";
        HapticsError::check("the time ahead [s]", ahead, (0.0..=0.01).contains(&ahead), remedy)?;
        let remedy = "give a positive number, 3.3 N by default";
        HapticsError::check("the force limit [N]", force_limit, force_limit > 0.0, remedy)?;
        if let Some(most) = most_change {
            let remedy = "give a positive number; 0.3 N per tick is hardly felt";
            HapticsError::check("the largest change of the force [N]", most, most > 0.0, remedy)?;
        }
        HapticsError::check("the soft start [s]", soft_start, soft_start >= 0.0, "give at least 0")?;
        if let Some(guard) = guard {
            guard.check()?;
        }
        Ok(Self {
            settings,
            old: None,
            new: None,
            part: 1.0,
            last: None,
            felt: Vector3::zeros(),
            gain: 0.0,
            observer: Observer::default(),
            record: Record::default(),
        })
    }

    /// True if the last model is reached, so that the next one can be taken.
    pub fn wants_model(&self) -> bool {
        self.part >= 1.0
    }

    /// Starts the change to another model, over its period. A model that comes before
    /// [it is wanted](Self::wants_model) makes the force jump.
    pub fn take(&mut self, model: LocalModel) {
        let stuck = match (self.last, model.force() == Vector3::zeros()) {
            // The slip starts at the unloaded place of the present force.
            (Some(last), true) => {
                last.pose.translation.vector + last.stretch + model.compliance() * last.touch
            }
            _ => model.unloaded(),
        };
        self.old = self.new.take();
        self.new = Some(Layer { proxy: Proxy::new(stuck), model });
        self.part = 0.0;
        self.record.models += 1;
    }

    /// The next tick. A pose (of the tool in the scene, m) with numbers that are not finite counts as
    /// invalid, and the last one holds.
    pub fn tick(&mut self, pose: &Isometry3<f64>) -> Answer {
        self.record.ticks += 1;
        let valid = pose.translation.vector.iter().chain(pose.rotation.coords.iter()).all(|x| x.is_finite())
            && (pose.rotation.norm() - 1.0).abs() < 1e-3;
        self.record.invalid += u64::from(!valid);
        let resting = Vector3::zeros();
        let pose = match (valid, self.last) {
            (true, _) => *pose,
            (false, Some(last)) => last.pose,
            (false, None) => return Answer { held: true, ..Answer::default() },
        };
        let first = Last { pose, stretch: resting, touch: resting };
        let last = self.last.unwrap_or(first);
        let Settings { period, coupling, ahead, force_limit, most_change, guard, soft_start } = self.settings;

        let place = pose.translation.vector;
        let way = place - last.pose.translation.vector;
        let reserve = guard.map_or(f64::INFINITY, |guard| guard.reserve);
        self.observer.add(&self.felt, &way, reserve);

        let drag = coupling.damping / period;
        let stiffness = coupling.stiffness + drag;
        let place_ahead = place + way * (ahead / period);
        let touch = self.touch(place_ahead + last.stretch * (drag / stiffness), stiffness);
        let stretch = (touch + last.stretch * drag) / stiffness;

        self.gain = if soft_start > 0.0 { (self.gain + period / soft_start).min(1.0) } else { 1.0 };
        let damping = guard.map_or(resting, |guard| self.observer.damp(&guard, &way, period));
        let wanted = touch * self.gain + damping;
        let size = wanted.norm();
        let limited = size > force_limit;
        let force = if limited { wanted * (force_limit / size) } else { wanted };
        let change = force - self.felt;
        let force = match most_change {
            Some(most) if change.norm() > most => self.felt + change * (most / change.norm()),
            _ => force,
        };

        let guarded = damping != resting;
        let record = &mut self.record;
        record.guarded += u64::from(guarded);
        record.limited += u64::from(limited);
        record.peak = record.peak.max(force.norm());
        record.jump = record.jump.max((force - self.felt).norm());
        (record.energy, record.least_energy) = (self.observer.energy, self.observer.least);
        (self.last, self.felt) = (Some(Last { pose, stretch, touch }), force);
        Answer { force, guarded, limited, held: !valid }
    }

    /// The force [N] of the models on a tool that is pulled to a place [m] with a stiffness [N/m].
    fn touch(&mut self, pulled_to: Vector3<f64>, stiffness: f64) -> Vector3<f64> {
        let force_of = |layer: &mut Option<Layer>| {
            let force = |Layer { model, proxy }: &mut Layer| proxy.force(model, pulled_to, stiffness);
            layer.as_mut().map_or_else(Vector3::zeros, force)
        };
        let force = force_of(&mut self.new);
        if self.part >= 1.0 {
            return force;
        }
        let before = force_of(&mut self.old);
        let period = self.new.as_ref().map_or(0.0, |layer| layer.model.period());
        self.part = (self.part + self.settings.period / period.max(self.settings.period)).min(1.0);
        if self.part > 1.0 - 1e-9 {
            self.part = 1.0;
            self.old = None;
        }
        before.lerp(&force, self.part)
    }

    /// Restarts after a silence of the device. The next pose counts as a first one, and the force of the
    /// tissue comes up softly. The last force on the device fades as slowly as forces change.
    pub fn restart(&mut self) {
        (self.last, self.gain) = (None, 0.0);
    }

    /// Returns the target of the simulated tool: the proxy, turned like the device; `None` before the first
    /// pose.
    pub fn proxy(&self) -> Option<Isometry3<f64>> {
        let Last { pose, stretch, .. } = self.last?;
        Some(Isometry3::from_parts((pose.translation.vector + stretch).into(), pose.rotation))
    }

    /// Returns the counts and extremes since the start.
    pub fn record(&self) -> &Record {
        &self.record
    }

    /// The settings.
    pub fn settings(&self) -> &Settings {
        &self.settings
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::model::Plane;
    use nalgebra::Matrix3;

    fn at(x: f64, z: f64) -> Isometry3<f64> {
        Isometry3::translation(x, 0.0, z)
    }

    fn wall(height: f64) -> LocalModel {
        let plane = Plane { normal: Vector3::z(), gap: -height, friction: 0.0 };
        LocalModel::new(Vector3::zeros(), Vector3::zeros(), Matrix3::identity() / 500.0, &[plane], 0.01)
            .unwrap()
    }

    #[test]
    fn a_new_model_comes_in_over_its_period() {
        let mut renderer = Renderer::new(Settings { soft_start: 0.0, ..Settings::default() }).unwrap();
        renderer.take(wall(0.0));
        let mut forces: Vec<f64> = Vec::new();
        for tick in 0..400 {
            assert_eq!(renderer.wants_model(), tick == 200 || !(0..10).contains(&(tick % 200)), "{tick}");
            if tick == 200 {
                renderer.take(wall(0.003));
            }
            forces.push(renderer.tick(&at(0.0, -0.001)).force.z);
        }
        // The damping of the coupling has died away.
        let [one, four] = [0.001, 0.004].map(|depth| depth / (1.0 / 1000.0 + 1.0 / 500.0));
        assert!((forces[199] - one).abs() < 1e-9 && (forces[399] - four).abs() < 1e-9, "{forces:?}");
        let jumps = forces[199..].windows(2).map(|pair| (pair[1] - pair[0]).abs()).fold(0.0, f64::max);
        assert!(jumps < 0.2 * (four - one), "{jumps}");
    }

    #[test]
    fn invalid_poses_hold_the_last_one() {
        let mut renderer = Renderer::new(Settings { soft_start: 0.0, ..Settings::default() }).unwrap();
        renderer.take(wall(0.0));
        assert_eq!(renderer.tick(&at(f64::NAN, 0.0)), Answer { held: true, ..Answer::default() });
        for _ in 0..300 {
            renderer.tick(&at(0.0, -0.002));
        }
        let before = renderer.tick(&at(0.0, -0.002));
        for broken in [at(f64::INFINITY, 0.0), at(0.0, f64::NAN)] {
            let answer = renderer.tick(&broken);
            assert!(answer.held && (answer.force - before.force).norm() < 1e-9, "{answer:?}");
        }
        assert_eq!(renderer.record().invalid, 3);
        assert!(renderer.proxy().unwrap().translation.vector.iter().all(|x| x.is_finite()));
    }

    #[test]
    fn a_force_does_not_jump_over_a_silence() {
        let mut renderer = Renderer::new(Settings { most_change: Some(0.3), ..Settings::default() }).unwrap();
        renderer.take(wall(0.0));
        let mut last = (0..300).map(|_| renderer.tick(&at(0.0, -0.02)).force).last().unwrap();
        assert!(last.norm() > 3.0, "{last}");
        renderer.restart();
        for _ in 0..30 {
            let force = renderer.tick(&at(0.0, 0.02)).force;
            assert!((force - last).norm() < 0.3 + 1e-9, "{force} after {last}");
            last = force;
        }
        assert!(last.norm() < 1e-9, "{last}");
    }

    #[test]
    fn forces_stop_at_their_limit_and_start_softly() {
        let mut renderer = Renderer::new(Settings::default()).unwrap();
        renderer.take(wall(0.0));
        let first = renderer.tick(&at(0.0, -0.02)).force.norm();
        assert!(first < 0.04, "{first} N");
        for _ in 0..300 {
            renderer.tick(&at(0.0, -0.02));
        }
        let answer = renderer.tick(&at(0.0, -0.02));
        assert!(answer.limited && (answer.force.norm() - 3.3).abs() < 1e-12);
    }

    /// A thrust of 2 m/s into a wall: the force comes as fast as it may, and to where it would without a
    /// bound.
    #[test]
    fn forces_change_by_no_more_than_they_may() {
        let free = Settings { soft_start: 0.0, guard: None, force_limit: 100.0, ..Settings::default() };
        let thrust = |settings| {
            let mut renderer = Renderer::new(settings).unwrap();
            renderer.take(wall(0.0));
            for tick in 0..400 {
                renderer.tick(&at(0.0, 0.01 - (0.002 * f64::from(tick)).min(0.02)));
            }
            (renderer.record().jump, renderer.tick(&at(0.0, -0.01)).force.z)
        };
        let [(free, without), (bound, with)] =
            [free, Settings { most_change: Some(0.3), ..free }].map(thrust);
        assert!(free > 0.5 && bound <= 0.3 + 1e-12, "{free} N, {bound} N");
        assert!((with - without).abs() < 1e-9, "{with} N for {without} N");
    }

    #[test]
    fn settings_that_make_no_sense_are_refused() {
        let good = Settings::default();
        for settings in [
            Settings { period: 0.0, ..good },
            Settings { force_limit: f64::NAN, ..good },
            Settings { most_change: Some(0.0), ..good },
            Settings { ahead: -1.0, ..good },
            Settings { soft_start: -1.0, ..good },
            Settings { coupling: Coupling { stiffness: 0.0, damping: 0.0 }, ..good },
            Settings { coupling: Coupling { stiffness: 1.0, damping: -1.0 }, ..good },
            Settings { guard: Some(Guard { most_damping: -1.0, ..Guard::default() }), ..good },
        ] {
            assert!(Renderer::new(settings).is_err(), "{settings:?}");
        }
    }
}
