//! The datagrams of devices, of fixed length, little-endian. A device sends a pose; each pose that is used
//! gets a force back.
//!
//! | byte | pose (88 bytes) | force (48 bytes) |
//! |---|---|---|
//! | 0 | `PLHP` | `PLHP` |
//! | 4 | version, u16: 1 | version, u16: 1 |
//! | 6 | kind, u16: 1 | kind, u16: 2 |
//! | 8 | sequence number, u32, increasing | that of the pose, u32 |
//! | 12 | buttons, u32, a bit each | state, u32: bit 0 guarded, 1 limited, 2 last pose held |
//! | 16 | time of the device, u64 [µs] | that of the pose, u64 [µs] |
//! | 24 | place, 3 × f64 [m] | force, 3 × f64 [N] |
//! | 48 | quaternion w, x, y, z, 4 × f64 | |
//! | 80 | opening, f64, from 0 (closed) to 1 | |
//!
//! ```
//! use pliant_haptics::protocol::{Force, Pose};
//!
//! let quaternion = [1.0, 0.0, 0.0, 0.0];
//! let pose = Pose { sequence: 7, place: [0.0, 0.0, 0.01], quaternion, ..Pose::default() };
//! assert_eq!(Pose::decode(&pose.encode()), Some(pose));
//! assert_eq!(Pose::decode(&Force::default().encode()), None);
//! ```

use nalgebra::{Isometry3, Quaternion, Translation3, UnitQuaternion};

/// First bytes of every datagram.
const MAGIC: [u8; 4] = *b"PLHP";
/// Version of the protocol.
pub const VERSION: u16 = 1;
/// Bytes of a pose.
pub(crate) const POSE_LENGTH: usize = 88;
/// Bytes of a force.
pub(crate) const FORCE_LENGTH: usize = 48;

/// Datagram from a device.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Pose {
    /// Increases from pose to pose; after 2³² − 1 follows 0.
    pub sequence: u32,
    /// A bit for each button that is pressed.
    pub buttons: u32,
    /// Time [µs] of the device's own clock; comes back with the force.
    pub time: u64,
    /// Place [m] of the tool in the scene.
    pub place: [f64; 3],
    /// Its orientation, w first.
    pub quaternion: [f64; 4],
    /// Opening of its jaws, from 0 (closed) to 1.
    pub opening: f64,
}

/// Datagram to a device.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Force {
    /// Sequence number of the pose.
    pub sequence: u32,
    /// Bit 0: the guard damps; 1: the force is cut to its limit; 2: the pose was invalid and the last one
    /// holds.
    pub state: u32,
    /// Time of the pose [µs].
    pub time: u64,
    /// Force on the device [N].
    pub force: [f64; 3],
}

impl Pose {
    /// Its datagram.
    pub fn encode(&self) -> [u8; POSE_LENGTH] {
        let mut bytes = [0; POSE_LENGTH];
        head(&mut bytes, 1, self.sequence, self.buttons, self.time);
        let numbers = self.place.iter().chain(&self.quaternion).chain([&self.opening]);
        put(&mut bytes[24..], numbers);
        bytes
    }

    /// Reads the pose from a datagram; `None` if it is malformed: of another length, magic, version or kind.
    pub fn decode(bytes: &[u8]) -> Option<Self> {
        let bytes: &[u8; POSE_LENGTH] = bytes.try_into().ok()?;
        let [sequence, buttons] = checked(bytes, 1)?;
        Some(Self {
            sequence,
            buttons,
            time: u64::from_le_bytes(taken(bytes, 16)?),
            place: numbers(bytes, 24)?,
            quaternion: numbers(bytes, 48)?,
            opening: f64::from_le_bytes(taken(bytes, 80)?),
        })
    }

    /// The pose; `None` with numbers that are not finite, places beyond 100 m, or a quaternion that is no
    /// rotation.
    pub fn isometry(&self) -> Option<Isometry3<f64>> {
        let [x, y, z] = self.place;
        let [w, i, j, k] = self.quaternion;
        let turn = Quaternion::new(w, i, j, k);
        let near = self.place.iter().all(|x| x.abs() <= 100.0);
        let unit = (turn.norm() - 1.0).abs() < 1e-3;
        (near && unit && self.opening.is_finite())
            .then(|| Isometry3::from_parts(Translation3::new(x, y, z), UnitQuaternion::from_quaternion(turn)))
    }
}

impl Force {
    /// Its datagram.
    pub fn encode(&self) -> [u8; FORCE_LENGTH] {
        let mut bytes = [0; FORCE_LENGTH];
        head(&mut bytes, 2, self.sequence, self.state, self.time);
        put(&mut bytes[24..], self.force.iter());
        bytes
    }

    /// Reads the force from a datagram; `None` if it is malformed.
    pub fn decode(bytes: &[u8]) -> Option<Self> {
        let bytes: &[u8; FORCE_LENGTH] = bytes.try_into().ok()?;
        let [sequence, state] = checked(bytes, 2)?;
        Some(Self {
            sequence,
            state,
            time: u64::from_le_bytes(taken(bytes, 16)?),
            force: numbers(bytes, 24)?,
        })
    }
}

fn head(bytes: &mut [u8], kind: u16, sequence: u32, word: u32, time: u64) {
    bytes[..4].copy_from_slice(&MAGIC);
    bytes[4..6].copy_from_slice(&VERSION.to_le_bytes());
    bytes[6..8].copy_from_slice(&kind.to_le_bytes());
    bytes[8..12].copy_from_slice(&sequence.to_le_bytes());
    bytes[12..16].copy_from_slice(&word.to_le_bytes());
    bytes[16..24].copy_from_slice(&time.to_le_bytes());
}

fn put<'a>(bytes: &mut [u8], numbers: impl Iterator<Item = &'a f64>) {
    for (place, number) in bytes.chunks_exact_mut(8).zip(numbers) {
        place.copy_from_slice(&number.to_le_bytes());
    }
}

/// The two words after magic, version and kind, if these fit.
fn checked(bytes: &[u8], kind: u16) -> Option<[u32; 2]> {
    let fits = bytes.starts_with(&MAGIC)
        && u16::from_le_bytes(taken(bytes, 4)?) == VERSION
        && u16::from_le_bytes(taken(bytes, 6)?) == kind;
    if !fits {
        return None;
    }
    Some([u32::from_le_bytes(taken(bytes, 8)?), u32::from_le_bytes(taken(bytes, 12)?)])
}

fn taken<const N: usize>(bytes: &[u8], at: usize) -> Option<[u8; N]> {
    bytes.get(at..at + N)?.try_into().ok()
}

fn numbers<const N: usize>(bytes: &[u8], at: usize) -> Option<[f64; N]> {
    let mut found = [0.0; N];
    for (k, number) in found.iter_mut().enumerate() {
        *number = f64::from_le_bytes(taken(bytes, at + 8 * k)?);
    }
    Some(found)
}

#[cfg(test)]
mod tests {
    use super::*;
    use pliant_testing::Random;

    #[test]
    fn fields_lie_where_the_table_says() {
        let pose = Pose {
            sequence: 0x0403_0201,
            buttons: 5,
            time: 9,
            place: [1.0, 2.0, 3.0],
            quaternion: [0.5; 4],
            opening: 0.25,
        };
        let bytes = pose.encode();
        assert_eq!(&bytes[..12], b"PLHP\x01\0\x01\0\x01\x02\x03\x04");
        assert_eq!((bytes[12], bytes[16]), (5, 9));
        assert_eq!(bytes[24..32], 1.0_f64.to_le_bytes());
        assert_eq!(bytes[80..88], 0.25_f64.to_le_bytes());
        let force = Force { sequence: 3, state: 2, time: 4, force: [1.0, -2.0, 3.0] };
        assert_eq!(Force::decode(&force.encode()), Some(force));
        assert_eq!(force.encode()[40..48], 3.0_f64.to_le_bytes());
    }

    #[test]
    fn damaged_datagrams_never_panic() {
        let mut random = Random::new(5);
        let good = Pose { quaternion: [1.0, 0.0, 0.0, 0.0], ..Pose::default() }.encode();
        let mut refused = 0;
        for _ in 0..20_000 {
            let bytes = random.damaged(&good);
            let pose = Pose::decode(&bytes);
            refused += u32::from(pose.is_none());
            if let Some(at) = pose.and_then(|pose| pose.isometry()) {
                assert!(at.translation.vector.iter().chain(at.rotation.coords.iter()).all(|x| x.is_finite()));
            }
        }
        assert!(refused > 1000);
    }
}
