//! Records of the user's actions in a run, so that a replay repeats them before the same steps.

use std::path::{Path, PathBuf};

use pliant_format::tables::{MOST_CURVED, ViewTable};
use pliant_geometry::CellLabel;
use pliant_scene::World;
use serde::{Deserialize, Serialize};

use crate::hand::{Hand, Which};
use crate::parameters::Number;

/// Something done to a run.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub enum Done {
    /// By the first hand, or to a pin.
    Hand(Hand),
    /// Numbers of the scene that are others from then on; all others are as in the file.
    Numbers(Vec<Number>),
    /// Another surface is shown, whose triangles are held from then on.
    Surface(Surface),
    /// By the second hand.
    Second(Hand),
    /// Steps are half as long from then on.
    Halve,
}

impl Done {
    /// Returns the record of an action by one of the hands.
    pub(crate) fn by(which: Which, hand: Hand) -> Self {
        match which {
            Which::First => Self::Hand(hand),
            Which::Second => Self::Second(hand),
        }
    }
}

/// Part of a view that decides which triangles are drawn.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub struct Surface {
    /// The body or the carried surface; `None` for all bodies.
    pub on: Option<String>,
    /// Parts of each edge of a shell.
    pub curved: u32,
    /// True if fibres are drawn.
    pub fibres: bool,
    /// True if the critical cell is marked; shells are then flat.
    pub critical: bool,
    /// Labels whose cells are left out, as they are typed.
    pub hide: Vec<String>,
}

impl Surface {
    /// Returns the surface of a view.
    pub fn of(view: &ViewTable) -> Self {
        Self {
            on: view.on.clone(),
            curved: view.curved,
            fibres: view.fibres,
            critical: view.critical,
            hide: view.hide.iter().map(CellLabel::to_string).collect(),
        }
    }

    /// A view with this surface.
    pub(crate) fn put_into(&self, view: &ViewTable) -> ViewTable {
        let Self { on, curved, fibres, critical, hide } = self.clone();
        let hide = hide.iter().map(|label| match label.parse() {
            Ok(label) => label,
            Err(never) => match never {},
        });
        ViewTable { on, curved, fibres, critical, hide: hide.collect(), ..view.clone() }
    }
}

/// A user action and its time.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Move {
    /// Steps done before.
    pub steps: u64,
    /// True if the forces of that instant were computed before the action, so that the next step does not
    /// feel it yet.
    pub evaluated: bool,
    /// Wall time since the first one [s].
    pub seconds: f64,
    /// Wall time from the request to the end of the first step in which the action acted [s]; `None` while
    /// the run stood still.
    pub lag: Option<f64>,
    /// The action.
    pub done: Done,
}

/// Actions of the user in a run, from its start.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct Recording {
    /// In the order of time.
    pub moves: Vec<Move>,
    /// Steps in all.
    pub steps: u64,
    /// Pulls that broke the run: it went back to a state before them, so that they are not among the moves.
    pub breaks: Vec<Break>,
    /// [Bodies](pliant_sim::Setup::fingerprint_of_bodies) of the scene that it is of.
    pub of: u64,
}

/// First bytes of a recording's file, with the version of the format. The last four bytes are the CRC-32 of
/// all bytes before them.
const MAGIC: [u8; 8] = *b"\x89PLREC2\n";
/// Bytes of the checksum.
const CRC: usize = 4;

/// The file beside a recording that takes its place.
fn part_of(path: &Path) -> PathBuf {
    let mut name = path.as_os_str().to_owned();
    name.push(".part");
    name.into()
}

/// A pull that broke a run.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Break {
    /// Times [s] at which the run broke and to which it went back.
    pub times: [f64; 2],
    /// Reason of the break.
    pub message: String,
}

impl Recording {
    /// Encodes the recording as bytes that keep every bit.
    ///
    /// # Errors
    /// Never in practice: memory that ran out.
    pub fn to_bytes(&self) -> Result<Vec<u8>, String> {
        Ok(Self::framed(&postcard::to_stdvec(self).map_err(|error| error.to_string())?))
    }

    /// The bytes of a file with this body: the first bytes before it, the CRC-32 after it.
    pub fn framed(body: &[u8]) -> Vec<u8> {
        let mut bytes = [&MAGIC[..], body].concat();
        bytes.extend(crc32fast::hash(&bytes).to_le_bytes());
        bytes
    }

    /// Writes the recording to a second file, then renames it to `path`. So the file of a recording is
    /// complete at any time.
    ///
    /// # Errors
    /// If the file can't be written.
    pub fn write(&self, path: &Path) -> Result<(), String> {
        let part = part_of(path);
        let written = std::fs::write(&part, self.to_bytes()?).and_then(|()| std::fs::rename(&part, path));
        written.map_err(|error| error.to_string())
    }

    /// Checks that a recording can be written to a file, whose contents stay unchanged.
    ///
    /// # Errors
    /// If the file can't be written.
    pub fn try_path(path: &Path) -> std::io::Result<()> {
        if path.is_dir() {
            return Err(std::io::Error::other("it is a folder"));
        }
        let part = part_of(path);
        std::fs::write(&part, [])?;
        std::fs::remove_file(part)
    }

    /// From these bytes.
    ///
    /// # Errors
    /// If they are no recording of this version, or damaged.
    pub fn from_bytes(bytes: &[u8]) -> Result<Self, String> {
        let Some((content, crc)) = bytes.split_last_chunk::<CRC>().filter(|_| bytes.starts_with(&MAGIC))
        else {
            return Err("its first bytes are not the header of this version of pliant".into());
        };
        let body = content.get(MAGIC.len()..).filter(|_| crc32fast::hash(content).to_le_bytes() == *crc);
        body.and_then(|body| postcard::from_bytes(body).ok()).ok_or_else(|| "it is damaged or cut off".into())
    }

    /// Checks that the recording belongs to a scene.
    ///
    /// # Errors
    /// If it belongs to another scene.
    pub fn check(&self, world: &World) -> Result<(), String> {
        if self.of != world.simulated().fingerprint_of_bodies() {
            return Err(
                "the recording is of another scene: bodies, meshes, tools or their names differ".into()
            );
        }
        let scene = &world.scene;
        let is_known = |surface: &Surface| {
            let names = || {
                scene.bodies.iter().map(|(name, _)| name).chain(scene.surfaces.iter().map(|(name, _)| name))
            };
            surface.on.as_ref().is_none_or(|on| names().any(|name| name == on))
                && surface.curved <= MOST_CURVED
        };
        let known =
            self.moves.iter().all(|then| !matches!(&then.done, Done::Surface(surface) if !is_known(surface)));
        if known { Ok(()) } else { Err("the recording shows a surface that the scene does not have".into()) }
    }
}
