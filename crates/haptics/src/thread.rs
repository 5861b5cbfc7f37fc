//! The haptic thread. It waits for a pose of the [device](crate::device), makes the [force](crate::renderer)
//! and sends it. The simulation publishes local models to it and reads the proxy from it through two triple
//! buffers, which never make one wait for the other.
//!
//! ```
//! use std::time::Duration;
//!
//! use nalgebra::{Isometry3, Vector3};
//! use pliant_haptics::model::LocalModel;
//! use pliant_haptics::renderer::Settings;
//! use pliant_haptics::replay::Replay;
//! use pliant_haptics::thread::Haptics;
//! use pliant_haptics::trace::Trace;
//!
//! let trace = Trace::sine(Isometry3::identity(), Vector3::z() * 0.01, 2.0, 0.05)?;
//! let replay = Replay::new(trace, Duration::from_millis(1), None);
//! let mut haptics = Haptics::start(Settings::default(), replay)?;
//! while !haptics.is_over() {
//!     // A step of a simulation whose tool goes to the proxy.
//!     let place = haptics.state().proxy.translation.vector;
//!     haptics.publish(LocalModel::free(place, 0.002)?);
//!     std::thread::sleep(Duration::from_millis(2));
//! }
//! assert!(haptics.finish()?.record.ticks > 0);
//! # Ok::<(), pliant_haptics::error::HapticsError>(())
//! ```

use std::fmt;
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::thread::JoinHandle;
use std::time::{Duration, Instant};

use nalgebra::{Isometry3, Vector3};
use triple_buffer::{Input, Output, triple_buffer};

use crate::device::{Counts, Device, Event, Sample};
use crate::error::HapticsError;
use crate::model::LocalModel;
use crate::renderer::{Record, Renderer, Settings};
use crate::statistics::Spread;

/// Longest wait for a pose before the thread looks whether it shall stop.
const PATIENCE: Duration = Duration::from_millis(20);
/// Time without a pose after which the force begins softly again.
const SILENCE: Duration = Duration::from_millis(100);

/// State of the device for the simulation.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct State {
    /// Ticks so far; 0 before the first pose.
    pub ticks: u64,
    /// Pose of the device [m].
    pub device: Isometry3<f64>,
    /// Target pose of the simulated tool [m].
    pub proxy: Isometry3<f64>,
    /// The force on the device [N].
    pub force: Vector3<f64>,
    /// A bit for each button that is pressed.
    pub buttons: u32,
    /// Opening of the jaws, from 0 (closed) to 1.
    pub opening: f64,
}

/// Results of a thread.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Report {
    /// Forces and energies.
    pub record: Record,
    /// Packets.
    pub counts: Counts,
    /// Time from a force to the next; silences are left out.
    pub period: Spread,
    /// Time from the arrival of a pose to its force. In a replay, the time counts from the instant when the
    /// pose is due.
    pub latency: Spread,
    /// Time that the force itself takes.
    pub computing: Spread,
}

impl fmt::Display for Report {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let Self { record, counts, period, latency, computing } = self;
        writeln!(f, "force period     {period}")?;
        writeln!(f, "device to force  {latency}")?;
        writeln!(f, "computing        {computing}")?;
        let Record { ticks, models, invalid, guarded, limited, peak, jump, energy, least_energy } = record;
        writeln!(f, "force            peak {peak:.3} N, largest jump {jump:.4} N a tick")?;
        writeln!(f, "energy observed  {:.3} mJ, least {:.4} mJ", 1e3 * energy, 1e3 * least_energy)?;
        writeln!(
            f,
            "ticks            {ticks}; {guarded} guarded, {limited} at the force limit, {invalid} invalid poses"
        )?;
        let Counts { used, malformed, late, overtaken, foreign, failed } = counts;
        writeln!(
            f,
            "poses            {used} answered, {malformed} malformed, {late} late, {overtaken} overtaken, {foreign} foreign, {failed} failed"
        )?;
        write!(f, "local models     {models}")
    }
}

/// A haptic thread that runs.
pub struct Haptics {
    models: Input<Option<LocalModel>>,
    states: Output<State>,
    stop: Arc<AtomicBool>,
    thread: JoinHandle<Report>,
}

impl Haptics {
    /// Starts the thread.
    ///
    /// # Errors
    /// If a setting is out of range, or the system gives no thread.
    pub fn start(settings: Settings, device: impl Device + Send + 'static) -> Result<Self, HapticsError> {
        let renderer = Renderer::new(settings)?;
        let (models, taken) = triple_buffer(&None);
        let place = Isometry3::identity();
        let state = State {
            ticks: 0,
            device: place,
            proxy: place,
            force: Vector3::zeros(),
            buttons: 0,
            opening: 0.0,
        };
        let (input, states) = triple_buffer(&state);
        let stop = Arc::new(AtomicBool::new(false));
        let stopped = Arc::clone(&stop);
        let run = move || run(renderer, device, taken, input, &stopped);
        let thread = std::thread::Builder::new().name("haptics".into()).spawn(run);
        let thread =
            thread.map_err(|error| HapticsError::Thread { problem: format!("cannot start: {error}") })?;
        Ok(Self { models, states, stop, thread })
    }

    /// Publishes the next local model. It never waits.
    pub fn publish(&mut self, model: LocalModel) {
        self.models.write(Some(model));
    }

    /// The state of the device now. It never waits.
    pub fn state(&mut self) -> State {
        *self.states.read()
    }

    /// True if the device has gone.
    pub fn is_over(&self) -> bool {
        self.thread.is_finished()
    }

    /// Stops the thread.
    ///
    /// # Errors
    /// If it has ended early.
    pub fn finish(self) -> Result<Report, HapticsError> {
        self.stop.store(true, Ordering::Relaxed);
        self.thread.join().map_err(|_| HapticsError::Thread { problem: "has ended early".into() })
    }
}

fn run(
    mut renderer: Renderer,
    mut device: impl Device,
    mut models: Output<Option<LocalModel>>,
    mut states: Input<State>,
    stop: &AtomicBool,
) -> Report {
    let mut report = Report::default();
    let mut last: Option<Instant> = None;
    while !stop.load(Ordering::Relaxed) {
        let Sample { pose, buttons, opening, arrived } = match device.next(PATIENCE) {
            Event::Pose(sample) => sample,
            Event::Silence => {
                // A device that comes back may be elsewhere.
                if last.is_some_and(|last| last.elapsed() > SILENCE) {
                    last = None;
                    renderer.restart();
                }
                continue;
            }
            Event::Over => break,
        };
        let begun = Instant::now();
        if renderer.wants_model()
            && models.update()
            && let Some(model) = models.output_buffer()
        {
            renderer.take(model.clone());
        }
        let answer = renderer.tick(&pose);
        report.computing.add(begun.elapsed().as_secs_f64());
        device.feel(&answer);
        let now = Instant::now();
        report.latency.add((now - arrived).as_secs_f64());
        if let Some(before) = last.replace(now) {
            report.period.add((now - before).as_secs_f64());
        }
        if let Some(proxy) = renderer.proxy() {
            let ticks = renderer.record().ticks;
            states.write(State { ticks, device: pose, proxy, force: answer.force, buttons, opening });
        }
    }
    (report.record, report.counts) = (*renderer.record(), device.counts());
    report
}

#[cfg(test)]
mod tests {
    use std::net::UdpSocket;

    use nalgebra::Matrix3;

    use super::*;
    use crate::coupling::Coupling;
    use crate::link::Link;
    use crate::model::Plane;
    use crate::protocol::{Force, Pose};

    /// A device over the loopback interface feels a wall.
    #[test]
    fn a_connected_device_feels_the_published_model() {
        let link = Link::open("127.0.0.1:0".parse().unwrap(), false).unwrap();
        let socket = UdpSocket::bind("127.0.0.1:0").unwrap();
        socket.connect(link.address()).unwrap();
        socket.set_read_timeout(Some(Duration::from_secs(10))).unwrap();
        // Without damping, the force belongs to the last pose, however late this comes.
        let coupling = Coupling { stiffness: 1000.0, damping: 0.0 };
        let settings = Settings { soft_start: 0.0, coupling, ..Settings::default() };
        let mut haptics = Haptics::start(settings, link).unwrap();
        let wall = Plane { normal: Vector3::z(), gap: 0.0, friction: 0.0 };
        let zero = Vector3::zeros();
        haptics.publish(LocalModel::new(zero, zero, Matrix3::identity() / 1000.0, &[wall], 0.005).unwrap());
        let mut bytes = [0; 100];
        let mut force = Force::default();
        for sequence in 1..=200 {
            let quaternion = [1.0, 0.0, 0.0, 0.0];
            let pose = Pose { sequence, place: [0.0, 0.0, -0.002], quaternion, ..Pose::default() };
            socket.send(&pose.encode()).unwrap();
            let length = socket.recv(&mut bytes).unwrap();
            force = Force::decode(&bytes[..length]).unwrap();
            assert_eq!(force.sequence, sequence);
        }
        assert!((force.force[2] - 1.0).abs() < 1e-9, "{force:?}");
        let state = haptics.state();
        assert!((state.proxy.translation.z + 0.001).abs() < 1e-9, "{state:?}");
        let report = haptics.finish().unwrap();
        println!("{report}");
        assert_eq!((report.record.models, report.counts.used), (1, 200));
    }
}
