//! The doors of Pliant: readers of untrusted bytes. Each takes any bytes and ends in a result or an error,
//! never in a panic. It allocates no more memory than the bytes fill. A door with a checksum gets bytes with
//! a valid one, because no change would pass the check otherwise.
//!
//! [`seeds`] returns small inputs of each door. Every test run tries them with random changes; `.ci/nightly`
//! has AFL++ look for others.
//!
//! ```
//! let read = |name| pliant_fuzz::DOORS.iter().find(|(known, _)| *known == name).unwrap().1;
//! read("scene")(b"[scene]\nuntil = nonsense");
//! read("datagram")(b"nothing");
//! ```

use std::error::Error;
use std::fs;
use std::io;
use std::path::Path;
use std::sync::{Arc, OnceLock};

use pliant_format::Scene;
use pliant_format::source::Source;
use pliant_geometry::io::{Format, read_bytes};
use pliant_haptics::protocol::{Force, Pose};
use pliant_haptics::trace::Trace;
use pliant_imaging::{ImageFormat, ReadOptions};
use pliant_meshing::{Closing, Enclosed};
use pliant_niftysim::import_bytes;
use pliant_run::{Checkpoint, OutputFolder, run, snapshot_framed, snapshot_from_bytes, snapshot_to_bytes};
use pliant_scene::World;
use pliant_sim::Simulation;
use pliant_viewer::{Break, Done, Hand, Move, Number, Point, Recording, Surface, replay};

/// Reader of bytes.
pub type Door = fn(&[u8]);

/// Every door, by name.
pub const DOORS: [(&str, Door); 10] = [
    ("checkpoint", checkpoint),
    ("datagram", datagram),
    ("image", image),
    ("mesh", mesh),
    ("niftysim", niftysim),
    ("recording", recording),
    ("scene", scene),
    ("snapshot", snapshot),
    ("surface", surface),
    ("trace", trace),
];

/// The scene that checkpoints, snapshots and recordings are of.
const BLOCK: &str = include_str!("block.toml");

/// Bytes before the body of a checkpoint, a recording and a snapshot, and after it.
const CHECKPOINT_HEAD: usize = 20;
const RECORDING_HEAD: usize = 8;
const SNAPSHOT_HEAD: usize = 28;
const CRC: usize = 4;
/// Limit of the steps of a replay, whose file may ask for any number.
const MOST_STEPS: u64 = 50;

/// The world of checkpoints, snapshots and recordings.
///
/// # Panics
/// If its scene is wrong.
pub fn block() -> &'static World {
    static WORLD: OnceLock<World> = OnceLock::new();
    WORLD.get_or_init(|| {
        let scene =
            Source::parse("block.toml", BLOCK).and_then(|source| Scene::from_source(source, ".".into()));
        let world = scene.and_then(|scene| World::new(&scene));
        world.unwrap_or_else(|errors| panic!("{}", errors.plain()))
    })
}

/// Returns small inputs of a door. For most doors they are the files of the readers' tests. For checkpoints,
/// datagrams, recordings, snapshots and traces this version writes them, without head and checksum.
///
/// # Errors
/// If they can't be read or made.
pub fn seeds(door: &str) -> Result<Vec<Vec<u8>>, Box<dyn Error>> {
    let body = |bytes: &[u8], head: usize| bytes[head..bytes.len() - CRC].to_vec();
    Ok(match door {
        "checkpoint" => {
            let folder = tempfile::tempdir()?;
            let mut half = block().clone();
            half.scene.scene.until *= 0.5;
            let out = OutputFolder::prepare(folder.path().join("block"), &half.scene, true)?;
            run(&half, &out, &mut |_| ())?;
            let read = Checkpoint::read(out.path())?;
            vec![body(&fs::read(read.path())?, CHECKPOINT_HEAD)]
        }
        "datagram" => {
            let (place, quaternion) = ([0.01, 0.02, 0.03], [1.0, 0.0, 0.0, 0.0]);
            let pose = Pose { sequence: 7, buttons: 1, time: 1_000_000, place, quaternion, opening: 0.5 };
            vec![pose.encode().to_vec(), Force { sequence: 7, ..Force::default() }.encode().to_vec()]
        }
        "recording" => {
            let point = Point { triangle: 3, weights: [0.5, 0.25, 0.25] };
            let view = &block().scene.view;
            let path = ["law", "tissue", "young-modulus"].map(str::to_owned).to_vec();
            let done = [
                Done::Hand(Hand::Take(point, 20.0)),
                Done::Hand(Hand::Pull([0.05, 0.0, 0.1])),
                Done::Second(Hand::Pin(point)),
                Done::Numbers(vec![Number { path, value: 4000.0 }]),
                Done::Surface(Surface::of(view)),
                Done::Halve,
                Done::Hand(Hand::Turn([0.1, 0.0, 0.0])),
                Done::Hand(Hand::Release),
            ];
            let moves = (0..).zip(done).map(|(steps, done)| Move {
                steps,
                evaluated: steps % 2 == 0,
                seconds: 0.1,
                lag: None,
                done,
            });
            let breaks = vec![Break { times: [0.2, 0.1], message: "inverted".into() }];
            let recording = Recording { moves: moves.collect(), steps: 12, breaks, of: 0 };
            vec![body(&recording.to_bytes()?, RECORDING_HEAD)]
        }
        "snapshot" => {
            let mut simulation = block().simulation()?;
            simulation.run(0.1, |_| ())?;
            let state = simulation.state()?;
            vec![body(&snapshot_to_bytes(simulation.setup(), &state)?, SNAPSHOT_HEAD)]
        }
        "image" => files("imaging/tests/corpus", "bin")?,
        "mesh" | "surface" => files("geometry/tests/data", "")?,
        "niftysim" => files("run/tests/corpus", "xml")?,
        "scene" => {
            let mut scenes = files("run/tests/corpus", "toml")?;
            scenes.push(BLOCK.into());
            scenes
        }
        "trace" => vec![
            b"t,x,y,z,qw,qx,qy,qz\n0,0,0,0,1,0,0,0\n0.5,0.01,0,0.02,0.7071,0.7071,0,0\n1,0,0,0,1,0,0,0\n"
                .to_vec(),
        ],
        _ => return Err(format!("`{door}` is no door").into()),
    })
}

/// The small files in a folder of tests that end in a word.
fn files(folder: &str, ending: &str) -> io::Result<Vec<Vec<u8>>> {
    const LONGEST: usize = 4096;
    let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("../crates").join(folder);
    let mut paths: Vec<_> =
        fs::read_dir(folder)?.map(|entry| entry.map(|entry| entry.path())).collect::<Result<_, _>>()?;
    paths.retain(|path| path.is_file() && path.to_string_lossy().ends_with(ending));
    paths.sort();
    let mut contents = paths.iter().map(fs::read).collect::<io::Result<Vec<_>>>()?;
    contents.retain(|bytes| bytes.len() <= LONGEST);
    Ok(contents)
}

fn checkpoint(bytes: &[u8]) {
    let path = Path::new("any");
    for bytes in [bytes, &Checkpoint::framed(bytes)] {
        if let Ok(read) = Checkpoint::from_bytes(path, bytes) {
            let _ = read.continues(block());
        }
    }
}

fn snapshot(bytes: &[u8]) {
    static WORLD: OnceLock<Arc<pliant_sim::Setup>> = OnceLock::new();
    let world = WORLD.get_or_init(|| Arc::new(block().simulated()));
    for bytes in [bytes, &snapshot_framed(world, bytes)] {
        let Ok(state) = snapshot_from_bytes(world, bytes) else { continue };
        if let Ok(mut simulation) = Simulation::resumed(Arc::clone(world), state) {
            let _ = simulation.step(1);
        }
    }
}

fn recording(bytes: &[u8]) {
    let read = [Recording::from_bytes(bytes), Recording::from_bytes(&Recording::framed(bytes))];
    for mut recording in read.into_iter().flatten() {
        recording.of = block().simulated().fingerprint_of_bodies();
        recording.steps = recording.steps.min(MOST_STEPS);
        let _ = replay(block(), &recording);
    }
}

fn datagram(bytes: &[u8]) {
    let _ = Force::decode(bytes);
    if let Some(pose) = Pose::decode(bytes) {
        let _ = pose.isometry();
    }
}

fn trace(bytes: &[u8]) {
    if let Ok(trace) = Trace::read(&String::from_utf8_lossy(bytes)) {
        let [from, to] = trace.times();
        let _ = (trace.at(from), trace.at(0.5 * (from + to)), trace.table());
    }
}

fn scene(bytes: &[u8]) {
    let text = String::from_utf8_lossy(bytes).into_owned();
    let read = Source::parse("scene.toml", text).and_then(|source| Scene::from_source(source, ".".into()));
    if let Err(errors) = read {
        assert!(errors.plain().to_string().len() < 1 << 20);
    }
}

fn niftysim(bytes: &[u8]) {
    if let Ok(imported) = import_bytes(Path::new("nowhere/model.xml"), bytes) {
        let read = Source::parse("scene.toml", imported.scene);
        assert!(read.is_ok(), "what was imported is no scene");
    }
}

fn image(bytes: &[u8]) {
    for &format in ImageFormat::FILES.iter().chain([&ImageFormat::Dicom]) {
        if let Ok(image) = pliant_imaging::read_bytes(bytes, format, &ReadOptions::default()) {
            let _ = image.labels().map(|labels| labels.regions());
        }
    }
}

fn mesh(bytes: &[u8]) {
    for &format in Format::ALL {
        let _ = read_bytes(bytes, format);
    }
}

/// A surface that is to be filled.
fn surface(bytes: &[u8]) {
    for &format in Format::ALL {
        let Ok(file) = read_bytes(bytes, format) else { continue };
        let size = file.mesh.bounds().map_or(0.0, |(low, high)| (high - low).norm());
        let closing = Closing { holes: size, ..Closing::default() };
        if let Ok(body) = Enclosed::new(&file.mesh, size / 8.0, &closing) {
            let _ = body.field(size / 8.0, &|_| {});
        }
    }
}
