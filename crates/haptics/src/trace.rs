//! Poses of a device over time, read from a table `t,x,y,z,qw,qx,qy,qz` like the poses of a scene, or
//! generated. Generated traces are sines, steps, and a tremor of 8 Hz with noise. The tremor is like a
//! surgeon's hand (Elble and Koller 1990: physiological tremor of 8 to 12 Hz).
//!
//! ```
//! use nalgebra::{Isometry3, Vector3};
//! use pliant_haptics::trace::Trace;
//!
//! let trace = Trace::read("t,x,y,z,qw,qx,qy,qz\n0,0,0,0,1,0,0,0\n2,0,0,0.01,1,0,0,0\n")?;
//! assert!((trace.at(0.5).translation.z - 0.0025).abs() < 1e-15);
//! let sine = Trace::sine(Isometry3::identity(), Vector3::z() * 0.002, 2.0, 1.0)?;
//! assert!((sine.at(0.125).translation.z - 0.002).abs() < 1e-12);
//! # Ok::<(), pliant_haptics::error::HapticsError>(())
//! ```

use std::f64::consts::TAU;
use std::path::Path;

use nalgebra::{Isometry3, Quaternion, Translation3, UnitQuaternion, Vector3};

use crate::error::HapticsError;

/// The names of the columns.
pub(crate) const COLUMNS: &str = "t,x,y,z,qw,qx,qy,qz";
/// Time [s] between two poses of generated traces.
const PERIOD: f64 = 1e-3;
/// Longest generated trace [s].
const LONGEST: f64 = 3600.0;

/// Poses at increasing times.
#[derive(Clone, Debug, PartialEq)]
pub struct Trace(Vec<(f64, Isometry3<f64>)>);

impl Trace {
    /// Reads a table with a first row of names and a row for each pose: time [s], place [m] and quaternion.
    /// Empty lines and lines that begin with `#` are skipped.
    ///
    /// # Errors
    /// If there is no row, or a row has other columns or a number that is invalid or not finite. Also if a
    /// time does not increase, or a quaternion is no rotation.
    pub fn read(text: &str) -> Result<Self, HapticsError> {
        let wrong = |line: usize, problem: String| HapticsError::Trace { line, problem };
        let mut poses: Vec<(f64, Isometry3<f64>)> = Vec::new();
        let lines = (1..).zip(text.lines().map(str::trim));
        let mut rows = lines.filter(|(_, row)| !row.is_empty() && !row.starts_with('#'));
        let (line, names) = rows.next().ok_or_else(|| wrong(1, "the table is empty".into()))?;
        let same = names.trim_start_matches('\u{feff}').split(',').map(str::trim).eq(COLUMNS.split(','));
        if !same {
            return Err(wrong(line, format!("the columns are not `{COLUMNS}`")));
        }
        for (line, row) in rows {
            let mut numbers = [0.0; 8];
            let mut count = 0;
            for word in row.split(',').map(str::trim) {
                let number: f64 =
                    word.parse().map_err(|_| wrong(line, format!("`{word}` is not a number")))?;
                if !number.is_finite() {
                    return Err(wrong(line, format!("`{word}` is not finite")));
                }
                if let Some(place) = numbers.get_mut(count) {
                    *place = number;
                }
                count += 1;
            }
            if count != 8 {
                return Err(wrong(line, format!("it has {count} columns, not 8")));
            }
            let [time, x, y, z, w, i, j, k] = numbers;
            if let Some(&(before, _)) = poses.last()
                && time <= before
            {
                return Err(wrong(line, format!("its time {time} s is not after {before} s")));
            }
            let turn = Quaternion::new(w, i, j, k);
            if (turn.norm() - 1.0).abs() > 1e-3 {
                return Err(wrong(line, format!("its quaternion has the length {:.4}, not 1", turn.norm())));
            }
            poses.push((
                time,
                Isometry3::from_parts(Translation3::new(x, y, z), UnitQuaternion::from_quaternion(turn)),
            ));
        }
        if poses.is_empty() {
            return Err(wrong(line, "no poses follow".into()));
        }
        Ok(Self(poses))
    }

    /// Reads a file.
    ///
    /// # Errors
    /// If the file can't be read, and as for [`read`](Self::read).
    pub fn of_file(path: &Path) -> Result<Self, HapticsError> {
        let failed = |source| HapticsError::File { path: path.display().to_string(), source };
        Self::read(&std::fs::read_to_string(path).map_err(failed)?)
    }

    /// The table that [`read`](Self::read) takes.
    pub fn table(&self) -> String {
        let mut text = format!("{COLUMNS}\n");
        for (time, pose) in &self.0 {
            let (place, turn) = (pose.translation.vector, pose.rotation);
            text += &format!(
                "{time},{},{},{},{},{},{},{}\n",
                place.x, place.y, place.z, turn.w, turn.i, turn.j, turn.k
            );
        }
        text
    }

    /// Its first and its last time [s].
    pub fn times(&self) -> [f64; 2] {
        let [first, last] = [self.0.first(), self.0.last()];
        [first, last].map(|pose| pose.map_or(0.0, |pose| pose.0))
    }

    /// Returns the pose at a time [s]. Between two rows it follows a straight line and the shortest arc.
    /// Before the first and after the last row it rests.
    pub fn at(&self, time: f64) -> Isometry3<f64> {
        let after = self.0.partition_point(|&(instant, _)| instant <= time);
        match (after.checked_sub(1).map(|before| self.0[before]), self.0.get(after)) {
            (Some((from, a)), Some((to, b))) => {
                let part = (time - from) / (to - from);
                a.try_lerp_slerp(b, part, 1e-12).unwrap_or(*b)
            }
            (Some((_, only)), None) | (None, Some(&(_, only))) => only,
            (None, None) => Isometry3::identity(),
        }
    }

    /// From a pose to and fro along a vector [m], as sin 2πft with a frequency [Hz], over a duration [s].
    ///
    /// # Errors
    /// If a number is not finite, or the duration is not in (0, 3600] s.
    pub fn sine(
        from: Isometry3<f64>,
        way: Vector3<f64>,
        frequency: f64,
        duration: f64,
    ) -> Result<Self, HapticsError> {
        HapticsError::check("a frequency [Hz]", frequency, true, "give a finite number")?;
        Self::of(from, duration, |time| way * (TAU * frequency * time).sin())
    }

    /// From a pose to another place, a vector [m] away, and back in turn, a time `hold` [s] each. Each step
    /// takes a time `rise` [s], with the least jerk (Flash and Hogan 1985): 10 s³ − 15 s⁴ + 6 s⁵.
    ///
    /// # Errors
    /// If a number is not finite or not positive, or the duration is not in (0, 3600] s.
    pub fn steps(
        from: Isometry3<f64>,
        way: Vector3<f64>,
        [rise, hold]: [f64; 2],
        duration: f64,
    ) -> Result<Self, HapticsError> {
        for time in [rise, hold] {
            HapticsError::check("a time of a step [s]", time, time > 0.0, "give a positive number")?;
        }
        Self::of(from, duration, |time| {
            let (turn, within) = ((time / hold).floor(), time % hold);
            let s = (within / rise).min(1.0);
            let gone = s * s * s * (10.0 - 15.0 * s + 6.0 * s * s);
            way * if turn % 2.0 == 0.0 { gone } else { 1.0 - gone }
        })
    }

    /// Returns the trace with the tremor of a hand: sines [m] of 8 Hz along three axes, each with its phase.
    /// White noise of a standard deviation [m] is added. Phases and noise come from a seed.
    ///
    /// # Errors
    /// If a number is not finite, or the trace is longer than 3600 s.
    pub fn with_tremor(&self, amplitude: f64, noise: f64, seed: u64) -> Result<Self, HapticsError> {
        let [first, last] = self.times();
        let mut random = Random(seed);
        let phases = Vector3::from_fn(|_, _| TAU * random.part());
        let mut made = Self::of(Isometry3::identity(), last - first, |time| {
            let tremor = phases.map(|phase| amplitude * (TAU * 8.0 * time + phase).sin());
            tremor + Vector3::from_fn(|_, _| noise * random.normal())
        })?;
        for (time, pose) in &mut made.0 {
            *time += first;
            let original = self.at(*time);
            *pose = Isometry3::from_parts(pose.translation * original.translation, original.rotation);
        }
        Ok(made)
    }

    /// A pose shifted as a function of the time [s] says.
    fn of(
        from: Isometry3<f64>,
        duration: f64,
        mut shift: impl FnMut(f64) -> Vector3<f64>,
    ) -> Result<Self, HapticsError> {
        let fits = duration > 0.0 && duration <= LONGEST;
        HapticsError::check(
            "the duration of a trace [s]",
            duration,
            fits,
            "give more than 0 s and at most 3600 s",
        )?;
        let number = (duration / PERIOD).round() as u32;
        let poses = (0..=number).map(|tick| {
            let time = f64::from(tick) * PERIOD;
            (time, Translation3::from(shift(time)) * from)
        });
        let made = Self(poses.collect());
        for number in
            made.0.iter().flat_map(|(_, pose)| pose.translation.vector.iter().copied().collect::<Vec<_>>())
        {
            HapticsError::check("a coordinate of a trace [m]", number, true, "give finite numbers")?;
        }
        Ok(made)
    }
}

/// SplitMix64 (Steele, Lea and Flood 2014): the same numbers on every machine.
struct Random(u64);

impl Random {
    /// A number in [0, 1).
    fn part(&mut self) -> f64 {
        self.0 = self.0.wrapping_add(0x9E37_79B9_7F4A_7C15);
        let mut z = self.0;
        z = (z ^ (z >> 30)).wrapping_mul(0xBF58_476D_1CE4_E5B9);
        z = (z ^ (z >> 27)).wrapping_mul(0x94D0_49BB_1331_11EB);
        ((z ^ (z >> 31)) >> 11) as f64 / (1_u64 << 53) as f64
    }

    /// A normal deviate of Box and Muller.
    fn normal(&mut self) -> f64 {
        let radius = (-2.0 * (1.0 - self.part()).ln()).sqrt();
        radius * (TAU * self.part()).cos()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn broken_tables_name_their_line() {
        let head = COLUMNS;
        for (text, line) in [
            (String::new(), "line 1"),
            ("t,x\n".into(), "line 1"),
            (format!("{head}\n"), "line 1"),
            (format!("{head}\n0,0,0,0,1,0,0\n"), "line 2"),
            (format!("{head}\n0,0,0,0,1,0,0,0,9\n"), "line 2"),
            (format!("{head}\n0,0,0,nan,1,0,0,0\n"), "line 2"),
            (format!("{head}\n0,0,0,x,1,0,0,0\n"), "line 2"),
            (format!("{head}\n# rest\n\n0,0,0,0,1,0,0,0\n0,0,0,0,1,0,0,0\n"), "line 5"),
            (format!("{head}\n0,0,0,0,2,0,0,0\n"), "line 2"),
        ] {
            let message = Trace::read(&text).unwrap_err().to_string();
            assert!(message.starts_with(line), "{message}");
        }
    }

    #[test]
    fn tables_keep_every_bit() {
        let sine = Trace::sine(Isometry3::translation(0.1, 0.2, 0.3), Vector3::x() * 0.01, 0.7, 0.5).unwrap();
        let trace = sine.with_tremor(2e-4, 1e-5, 3).unwrap();
        assert_eq!(Trace::read(&trace.table()).unwrap(), trace);
        assert_eq!(sine.with_tremor(2e-4, 1e-5, 3).unwrap(), trace);
        assert_ne!(sine.with_tremor(2e-4, 1e-5, 4).unwrap(), trace);
    }

    #[test]
    fn steps_go_there_and_back() {
        let trace = Trace::steps(Isometry3::identity(), Vector3::z(), [0.1, 0.5], 2.0).unwrap();
        for (time, z) in [(0.0, 0.0), (0.05, 0.5), (0.3, 1.0), (0.55, 0.5), (0.9, 0.0), (1.4, 1.0)] {
            assert!((trace.at(time).translation.z - z).abs() < 1e-12, "{time}");
        }
        assert_eq!(trace.times(), [0.0, 2.0]);
        assert!(Trace::steps(Isometry3::identity(), Vector3::z(), [0.0, 0.5], 2.0).is_err());
        assert!(Trace::sine(Isometry3::identity(), Vector3::z(), f64::NAN, 2.0).is_err());
        assert!(Trace::sine(Isometry3::identity(), Vector3::z(), 1.0, 1e9).is_err());
    }

    /// Noise of 10 µm over a tremor of 200 µm on each axis: variances add up.
    #[test]
    fn tremor_has_the_power_it_should_have() {
        let rest = Trace::sine(Isometry3::identity(), Vector3::zeros(), 1.0, 10.0).unwrap();
        let tremor = rest.with_tremor(2e-4, 1e-5, 11).unwrap();
        let square: f64 = tremor.0.iter().map(|(_, pose)| pose.translation.vector.norm_squared()).sum();
        let expected = 3.0 * (0.5 * 2e-4 * 2e-4 + 1e-10);
        assert!((square / tremor.0.len() as f64 / expected - 1.0).abs() < 0.01);
    }
}
