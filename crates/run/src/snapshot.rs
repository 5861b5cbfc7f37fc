//! Snapshots as bytes, for files and other processes.
//!
//! They hold [`MAGIC`], the [`FORMAT`] of states (u32), a fingerprint of the model (u64) and the length of
//! the body (u64). Then come the body and the CRC-32 of all bytes before it (u32). Numbers are little-endian.

use pliant_mechanics::fingerprint;
use pliant_sim::{Failure, FailureKind, Setup, SimulationState};

use crate::checkpoint::FORMAT;

/// The first bytes.
const MAGIC: [u8; 8] = *b"\x89PLSNAP\n";
/// Bytes before the body, and after it.
const HEAD: usize = 28;
const CRC: usize = 4;

/// A state of a world as bytes.
///
/// # Errors
/// If it can't be encoded.
pub fn snapshot_to_bytes(world: &Setup, state: &SimulationState) -> Result<Vec<u8>, Failure> {
    let failed = |error: postcard::Error| Failure::new(FailureKind::Output, error.to_string(), None);
    let body = state.encode().and_then(|parts| postcard::to_stdvec(&parts)).map_err(failed)?;
    Ok(snapshot_framed(world, &body))
}

/// The bytes of a snapshot of a world with this body: magic, format, fingerprint and length before it, the
/// CRC-32 after it.
pub fn snapshot_framed(world: &Setup, body: &[u8]) -> Vec<u8> {
    let mut bytes = Vec::with_capacity(HEAD + body.len() + CRC);
    bytes.extend(MAGIC);
    bytes.extend(FORMAT.to_le_bytes());
    bytes.extend(model(world).to_le_bytes());
    bytes.extend((body.len() as u64).to_le_bytes());
    bytes.extend(body);
    bytes.extend(crc32fast::hash(&bytes).to_le_bytes());
    bytes
}

/// The state of a world from bytes.
///
/// # Errors
/// If they are no snapshot, damaged, of another format or of another model.
pub fn snapshot_from_bytes(world: &Setup, bytes: &[u8]) -> Result<SimulationState, Failure> {
    let refused = |reason: &str| Err(Failure::input(&format_args!("the snapshot {reason}")));
    if !bytes.starts_with(&MAGIC) {
        return refused("has no snapshot header: the bytes are something else");
    }
    let number = |at: usize| bytes.get(at..at + 8)?.try_into().ok().map(u64::from_le_bytes);
    let format = bytes.get(8..12).and_then(|field| field.try_into().ok()).map_or(0, u32::from_le_bytes);
    if format != FORMAT {
        return refused(&format!("has format {format}; this version reads format {FORMAT}"));
    }
    let (Some(of), Some(length)) = (number(12), number(20)) else { return refused("is cut off") };
    let whole = length.saturating_add((HEAD + CRC) as u64);
    if bytes.len() as u64 != whole {
        return refused(&format!("has {} bytes instead of {whole}", bytes.len()));
    }
    let (content, crc) = bytes.split_at(bytes.len() - CRC);
    if crc32fast::hash(content).to_le_bytes() != crc {
        return refused("is damaged");
    }
    if of != model(world) {
        return refused("is of another model: meshes, laws, constraints or loads differ");
    }
    let parts: Option<Vec<Vec<u8>>> = postcard::from_bytes(&content[HEAD..]).ok();
    match parts.and_then(|parts| SimulationState::decode(world, &parts)) {
        Some(state) => Ok(state),
        None => refused("is of another model or solver"),
    }
}

/// A fingerprint of all models of a world.
fn model(world: &Setup) -> u64 {
    let of = |part: &pliant_sim::ParticipantSetup| {
        let shells = part.method.bodies().map(|bodies| bodies.fingerprints());
        (part.model.fingerprints(), shells, part.steps.number, part.steps.step.to_bits())
    };
    fingerprint(&world.parts.iter().map(of).collect::<Vec<_>>())
}
