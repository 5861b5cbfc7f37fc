//! Scene files, NiftySim models and checkpoints of `corpus/`, the project's own scenes and a checkpoint made
//! here, cut off and changed at random. The changes are the same every time. Reading them gives a result or
//! an error, never a panic, and takes no memory beyond what the file justifies. The test has a process of its
//! own, whose largest memory is measured. The fuzz targets `scene`, `niftysim` and `checkpoint` start from
//! the same files.

use std::fs;
use std::path::{Path, PathBuf};

use pliant_format::Scene;
use pliant_format::source::Source;
use pliant_niftysim::import_bytes;
use pliant_run::{Checkpoint, OutputFolder};
use pliant_scene::World;

use pliant_testing::{PeakMemory, Random};

/// Memory that reading may add [KiB]; the files are below 64 KiB.
const MOST: u64 = 64 << 10;

/// Bytes that may be shown of any number of mistakes.
const MOST_SHOWN: usize = 64 << 10;

fn folder() -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/corpus")
}

/// The files of the corpus with an ending, by name.
fn corpus(ending: &str) -> Vec<(String, Vec<u8>)> {
    let paths = fs::read_dir(folder()).unwrap().map(|entry| entry.unwrap().path());
    let mut found: Vec<_> = paths
        .filter(|path| path.extension().is_some_and(|extension| extension == ending))
        .map(|path| (path.file_name().unwrap().to_string_lossy().into_owned(), fs::read(&path).unwrap()))
        .collect();
    found.sort();
    assert!(!found.is_empty(), "no corpus of .{ending}");
    found
}

/// Shows a scene's mistakes; `None` without mistakes.
fn mistakes(bytes: &[u8]) -> Option<String> {
    let text = String::from_utf8_lossy(bytes).into_owned();
    let read = Source::parse("scene.toml", text).and_then(|source| Scene::from_source(source, ".".into()));
    let shown = read.err()?.plain().to_string();
    assert!(shown.len() < MOST_SHOWN && !shown.contains('\u{1b}'), "{} bytes", shown.len());
    Some(shown)
}

/// The project's scenes.
fn scenes() -> Vec<(String, Vec<u8>)> {
    let root = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../scenes");
    let paths = fs::read_dir(root).unwrap().map(|entry| entry.unwrap().path().join("scene.toml"));
    let mut found: Vec<_> = paths.filter(|path| path.is_file()).collect();
    found.sort();
    found.into_iter().map(|path| (path.display().to_string(), fs::read(path).unwrap())).collect()
}

#[test]
fn broken_scenes_give_mistakes() {
    let Some(before) = PeakMemory::alone("corpus::broken_scenes_give_mistakes") else { return };
    for (name, bytes) in corpus("toml") {
        println!("{name}: {}", mistakes(&bytes).unwrap_or_else(|| panic!("{name} is read")));
    }
    let (mut noise, mut outcomes) = (Random::new(20_261_122), [0; 2]);
    for (_, seed) in scenes() {
        assert!(mistakes(&seed).is_none());
        for _ in 0..300 {
            outcomes[usize::from(mistakes(&noise.damaged(&seed)).is_some())] += 1;
        }
    }
    println!("{} scenes, {} with mistakes", outcomes[0], outcomes[1]);
    assert!(outcomes.iter().all(|&count| count > 50));
    before.assert_rise_below(MOST);
}

#[test]
fn broken_models_give_errors() {
    let Some(before) = PeakMemory::alone("corpus::broken_models_give_errors") else { return };
    let nowhere = Path::new("nowhere/model.xml");
    for (name, bytes) in corpus("xml") {
        let error = import_bytes(nowhere, &bytes).map(|_| ()).unwrap_err();
        println!("{name}: {error}");
    }
    let seed = fs::read(folder().join("../../../../lab/validation/data/niftysim/H8_NH.xml")).unwrap();
    assert!(import_bytes(nowhere, &seed).is_ok());
    let (mut noise, mut outcomes) = (Random::new(20_261_122), [0; 2]);
    for _ in 0..1500 {
        let imported = import_bytes(nowhere, &noise.damaged(&seed));
        outcomes[usize::from(imported.is_err())] += 1;
        if let Ok(imported) = imported {
            Source::parse("scene.toml", imported.scene).unwrap_or_else(|errors| panic!("{}", errors.plain()));
        }
    }
    println!("{} models, {} errors", outcomes[0], outcomes[1]);
    assert!(outcomes.iter().all(|&count| count > 50));
    before.assert_rise_below(MOST);
}

/// Bodies are changed inside a fitting checksum, or no change would come past that.
#[test]
fn broken_checkpoints_give_errors() {
    let Some(before) = PeakMemory::alone("corpus::broken_checkpoints_give_errors") else { return };
    const SCENE: &str = "[scene]\nuntil = 0.02\n[run]\ncheckpoint = { every = 0.01 }\n\
        [law.l]\ntype = 'neo-hookean'\nyoung-modulus = 1e4\npoisson-ratio = 0.3\n\
        [body.b]\nmesh = { block = { size = [0.2, 0.1, 0.1], cells = [2, 1, 1] }, as = 'hexes' }\nlaw = 'l'\ndensity = 1000\n\
        [constraint.c]\ntype = 'move'\nbody = 'b'\nnodes = { set = 'x-max' }\nby = [0.01, 0, 0]\n\
        [output.t]\ntype = 'csv'\nevery = 0.005\nenergy = true\n";
    let scene = Scene::from_source(Source::parse("scene.toml", SCENE).unwrap(), ".".into()).unwrap();
    let out = tempfile::tempdir().unwrap();
    let world = World::new(&scene).unwrap();
    let folder = OutputFolder::prepare(out.path().join("out"), &scene, false).unwrap();
    pliant_run::run(&world, &folder, &mut |_| {}).unwrap();
    let path = Checkpoint::read(folder.path()).unwrap().path().to_owned();
    let whole = fs::read(&path).unwrap();
    let body = &whole[20..whole.len() - 4];
    assert_eq!(Checkpoint::framed(body), whole);
    let (mut noise, mut outcomes) = (Random::new(20_261_122), [0; 2]);
    for _ in 0..3000 {
        let read = Checkpoint::from_bytes(&path, &Checkpoint::framed(&noise.damaged(body)));
        outcomes[usize::from(read.is_err())] += 1;
        // A checkpoint is checked against the model before the run uses it.
        let _ = read.map(|checkpoint| checkpoint.continues(&world));
        // Without a fitting checksum no change is taken for a checkpoint.
        let changed = noise.damaged(&whole);
        assert!(changed == whole || Checkpoint::from_bytes(&path, &changed).is_err());
    }
    println!("{} checkpoints, {} errors", outcomes[0], outcomes[1]);
    assert!(outcomes.iter().all(|&count| count > 50));
    before.assert_rise_below(MOST);
}
