//! A device over [datagrams](crate::protocol). The first sender of a pose is the device; others are foreign
//! until it was silent for a second. Every valid pose is answered at once; of several that wait only the
//! newest.
//!
//! ```
//! use pliant_haptics::link::Link;
//!
//! let link = Link::open("127.0.0.1:0".parse().unwrap(), false)?;
//! assert!(link.address().ip().is_loopback());
//! assert!(Link::open("0.0.0.0:0".parse().unwrap(), false).is_err());
//! # Ok::<(), pliant_haptics::error::HapticsError>(())
//! ```

use std::io::{self, ErrorKind};
use std::net::{SocketAddr, UdpSocket};
use std::time::{Duration, Instant};

use nalgebra::{Isometry3, Vector3};

use crate::device::{Counts, Device, Event, Sample};
use crate::error::HapticsError;
use crate::protocol::{Force, POSE_LENGTH, Pose};
use crate::renderer::Answer;

/// Silence after which another sender may take the place of the device.
const RELEASE: Duration = Duration::from_secs(1);
/// Largest number of datagrams that are read for one answer.
const MOST_WAITING: usize = 64;
/// The shortest wait for a pose.
const LEAST_PATIENCE: Duration = Duration::from_millis(1);

/// A device at a socket.
#[derive(Debug)]
pub struct Link {
    socket: UdpSocket,
    address: SocketAddr,
    device: Option<Sender>,
    counts: Counts,
}

/// Sender of the poses, with its last pose.
#[derive(Clone, Copy, Debug)]
struct Sender {
    address: SocketAddr,
    pose: Pose,
    heard: Instant,
}

impl Link {
    /// Listens at an address; port 0 stands for a free one. `remote` allows addresses that other machines
    /// reach: anyone there can then send poses.
    ///
    /// # Errors
    /// If the address is not of the loopback interface and `remote` is not given, or the socket can't be
    /// opened.
    pub fn open(address: SocketAddr, remote: bool) -> Result<Self, HapticsError> {
        if !remote && !address.ip().is_loopback() {
            return Err(HapticsError::NotLoopback { address });
        }
        let failed = |source| HapticsError::Socket { address, source };
        let socket = UdpSocket::bind(address).map_err(failed)?;
        let address = socket.local_addr().map_err(failed)?;
        Ok(Self { socket, address, device: None, counts: Counts::default() })
    }

    /// Returns the address on which the link listens.
    pub fn address(&self) -> SocketAddr {
        self.address
    }

    /// Reads a datagram; whether it is a pose to use.
    fn take(&mut self) -> io::Result<bool> {
        // A byte more than a pose, so that longer ones are seen to be.
        let mut bytes = [0; POSE_LENGTH + 1];
        let (length, address) = self.socket.recv_from(&mut bytes)?;
        let now = Instant::now();
        let Some(pose) = bytes.get(..length).and_then(Pose::decode) else {
            self.counts.malformed += 1;
            return Ok(false);
        };
        if let Some(device) = self.device.filter(|device| now - device.heard < RELEASE) {
            if device.address != address {
                self.counts.foreign += 1;
                return Ok(false);
            }
            // Sequence numbers wrap around: a number less than half of them ahead is newer.
            let ahead = pose.sequence.wrapping_sub(device.pose.sequence);
            if ahead == 0 || ahead > u32::MAX / 2 {
                self.counts.late += 1;
                return Ok(false);
            }
        }
        self.device = Some(Sender { address, pose, heard: now });
        Ok(true)
    }

    /// Waits for a pose, then reads the other datagrams that have arrived.
    fn newest(&mut self, patience: Duration) -> io::Result<bool> {
        let until = Instant::now() + patience;
        // At least one read: datagrams wait in the socket, however late the thread is.
        let mut left = patience.max(LEAST_PATIENCE);
        loop {
            if left.is_zero() {
                return Ok(false);
            }
            self.socket.set_read_timeout(Some(left))?;
            if self.take()? {
                break;
            }
            left = until.saturating_duration_since(Instant::now());
        }
        self.socket.set_nonblocking(true)?;
        let mut result = Ok(true);
        for _ in 0..MOST_WAITING {
            match self.take() {
                Ok(newer) => self.counts.overtaken += u64::from(newer),
                Err(error) if is_silence(&error) => break,
                Err(error) => {
                    result = Err(error);
                    break;
                }
            }
        }
        self.socket.set_nonblocking(false)?;
        result
    }
}

fn is_silence(error: &io::Error) -> bool {
    matches!(error.kind(), ErrorKind::WouldBlock | ErrorKind::TimedOut | ErrorKind::Interrupted)
}

impl Device for Link {
    fn next(&mut self, patience: Duration) -> Event {
        let found = self.newest(patience).unwrap_or_else(|error| {
            // On Windows a device that has closed its socket makes this one fail once.
            if !is_silence(&error) {
                self.counts.failed += 1;
            }
            false
        });
        match self.device {
            Some(Sender { pose, heard, .. }) if found => {
                let invalid = || Isometry3::from(Vector3::repeat(f64::NAN));
                Event::Pose(Sample {
                    pose: pose.isometry().unwrap_or_else(invalid),
                    buttons: pose.buttons,
                    opening: if pose.opening.is_finite() { pose.opening.clamp(0.0, 1.0) } else { 0.0 },
                    arrived: heard,
                })
            }
            _ => Event::Silence,
        }
    }

    fn feel(&mut self, answer: &Answer) {
        let Some(Sender { address, pose, .. }) = self.device else { return };
        let flags = [answer.guarded, answer.limited, answer.held];
        let state = flags.iter().enumerate().map(|(bit, &on)| u32::from(on) << bit).sum();
        let force =
            Force { sequence: pose.sequence, state, time: pose.time, force: answer.force.into() }.encode();
        match self.socket.send_to(&force, address) {
            Ok(_) => self.counts.used += 1,
            Err(_) => self.counts.failed += 1,
        }
    }

    fn counts(&self) -> Counts {
        self.counts
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const SOON: Duration = Duration::from_secs(10);
    const AT_ONCE: Duration = Duration::from_millis(1);

    fn client(link: &Link) -> UdpSocket {
        let socket = UdpSocket::bind("127.0.0.1:0").unwrap();
        socket.connect(link.address()).unwrap();
        socket.set_read_timeout(Some(SOON)).unwrap();
        socket
    }

    fn pose(sequence: u32, z: f64) -> [u8; POSE_LENGTH] {
        let quaternion = [1.0, 0.0, 0.0, 0.0];
        Pose { sequence, place: [0.0, 0.0, z], quaternion, ..Pose::default() }.encode()
    }

    /// Waits until a datagram has come that is no pose to use.
    fn pass(link: &mut Link, counted: impl Fn(&Counts) -> u64, count: u64) {
        let until = Instant::now() + SOON;
        while counted(&link.counts) < count && Instant::now() < until {
            assert!(matches!(link.next(AT_ONCE), Event::Silence));
        }
        assert_eq!(counted(&link.counts), count);
    }

    #[test]
    fn malformed_late_and_foreign_packets_are_counted_and_not_answered() {
        let mut link = Link::open("127.0.0.1:0".parse().unwrap(), false).unwrap();
        let (device, other) = (client(&link), client(&link));
        device.send(&pose(u32::MAX, 0.5)).unwrap();
        let Event::Pose(sample) = link.next(SOON) else { panic!("no pose") };
        assert_eq!(sample.pose.translation.z, 0.5);
        link.feel(&Answer { force: Vector3::x(), limited: true, ..Answer::default() });
        let mut bytes = [0; 100];
        let length = device.recv(&mut bytes).unwrap();
        let force = Force::decode(&bytes[..length]).unwrap();
        assert_eq!((force.sequence, force.state, force.force), (u32::MAX, 2, [1.0, 0.0, 0.0]));

        for bytes in [&b""[..], b"PLHP", &[0; POSE_LENGTH], &[7; 2000]] {
            device.send(bytes).unwrap();
        }
        pass(&mut link, |counts| counts.malformed, 4);
        other.send(&pose(9, 0.1)).unwrap();
        pass(&mut link, |counts| counts.foreign, 1);
        device.send(&pose(u32::MAX, 0.1)).unwrap();
        device.send(&pose(u32::MAX - 5, 0.1)).unwrap();
        pass(&mut link, |counts| counts.late, 2);
        // The number after the largest is 0.
        device.send(&pose(0, f64::NAN)).unwrap();
        let Event::Pose(sample) = link.next(SOON) else { panic!("no pose") };
        assert!(sample.pose.translation.z.is_nan());
        assert_eq!(link.counts(), Counts { used: 1, malformed: 4, late: 2, foreign: 1, ..Counts::default() });
        other.set_read_timeout(Some(AT_ONCE)).unwrap();
        assert!(other.recv(&mut bytes).is_err(), "a foreign packet is not answered");
    }

    #[test]
    fn the_newest_of_several_poses_is_answered() {
        let mut link = Link::open("127.0.0.1:0".parse().unwrap(), false).unwrap();
        let device = client(&link);
        for sequence in 1..=5 {
            device.send(&pose(sequence, f64::from(sequence))).unwrap();
        }
        let Event::Pose(mut sample) = link.next(SOON) else { panic!("no pose") };
        // The loopback interface may still be at work on the last ones.
        while sample.pose.translation.z < 5.0 {
            let Event::Pose(next) = link.next(SOON) else { panic!("no pose") };
            sample = next;
        }
        assert_eq!((link.counts.late, link.counts.foreign), (0, 0));
    }
}
