//! 7: a haptic device over datagrams. It moves the tool of `pliant haptics SCENE --listen 127.0.0.1:4270` at
//! its address. Without an address it presses a wall of its own, of 500 N/m, and checks the force.
//!
//! Run: `cargo run --release --bin 7-haptic-client -- 127.0.0.1:4270`
//!
//! Read before: 1 and `docs/guide/tools-and-haptics.md`.

use std::error::Error;
use std::net::{SocketAddr, UdpSocket};
use std::time::{Duration, Instant};

use nalgebra::{Matrix3, Vector3};
use pliant_haptics::link::Link;
use pliant_haptics::model::{LocalModel, Plane};
use pliant_haptics::protocol::{Force, Pose};
use pliant_haptics::renderer::Settings;
use pliant_haptics::thread::Haptics;

const PERIOD: Duration = Duration::from_millis(1);
/// Depth of the wall's spring and the coupling's, pressed together [m].
const DEPTH: f64 = 0.003;

/// Presses slowly down to the depth, within `ticks` ticks. Returns the strongest force [N].
fn press(address: SocketAddr, ticks: u32) -> Result<[f64; 3], Box<dyn Error>> {
    let device = UdpSocket::bind(if address.is_ipv4() { "0.0.0.0:0" } else { "[::]:0" })?;
    device.connect(address)?;
    device.set_read_timeout(Some(Duration::from_millis(100)))?;
    let started = Instant::now();
    let mut force = [0.0; 3];
    for tick in 1..=ticks {
        std::thread::sleep((PERIOD * tick).saturating_sub(started.elapsed()));
        let down = DEPTH * (2.0 * f64::from(tick) / f64::from(ticks)).min(1.0);
        let pose = Pose {
            sequence: tick,
            place: [0.0, 0.0, -down],
            quaternion: [1.0, 0.0, 0.0, 0.0],
            time: started.elapsed().as_micros() as u64,
            ..Pose::default()
        };
        device.send(&pose.encode())?;
        let mut bytes = [0; 256];
        // A lost pose needs no repetition: the next one follows.
        let Ok(length) = device.recv(&mut bytes) else { continue };
        let Some(answer) = bytes.get(..length).and_then(Force::decode) else { continue };
        if Vector3::from(answer.force).norm() > Vector3::from(force).norm() {
            force = answer.force;
        }
        if tick % 100 == 0 {
            println!("{:.3} mm: {:.3} N", 1e3 * down, answer.force[2]);
        }
    }
    Ok(force)
}

fn main() -> Result<(), Box<dyn Error>> {
    if let Some(address) = std::env::args().nth(1) {
        press(address.parse()?, 5000)?;
        return Ok(());
    }
    let link = Link::open("127.0.0.1:0".parse()?, false)?;
    let address = link.address();
    let settings = Settings::default();
    let mut haptics = Haptics::start(settings, link)?;
    let wall = Plane { normal: Vector3::z(), gap: 0.0, friction: 0.3 };
    let zero = Vector3::zeros();
    haptics.publish(LocalModel::new(zero, zero, Matrix3::identity() / 500.0, &[wall], 0.002)?);
    let force = press(address, 1000)?;
    println!("{}", haptics.finish()?);
    let expected = DEPTH / (1.0 / 500.0 + 1.0 / settings.coupling.stiffness);
    if (force[2] / expected - 1.0).abs() < 0.01 {
        Ok(())
    } else {
        Err(format!("{} N, not {expected} N", force[2]).into())
    }
}
