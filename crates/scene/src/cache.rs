//! Cache of meshes made from images and surfaces, and of distances to surfaces. The name of a file is a hash
//! of the content of the image, all parameters and the source text of the mesher. So no mesh is stale. A file
//! appears under its name only once it is complete. A file that is damaged, or holds a mesh that no mesher
//! makes, counts as missing, so any number of processes can share a folder. Files unused for longest are
//! deleted.
//!
//! A file holds [`MESH`] or [`GRID`], the CRC-32 of the body (u32, little-endian), and the body in postcard's
//! encoding.

use std::collections::BTreeMap;
use std::fs::{self, File};
use std::io::{self, Write};
use std::path::{Path, PathBuf};
use std::time::SystemTime;

use pliant_geometry::{CellBlock, DataArray, Mesh, Vector3, relative_acoustic_length};
use serde::de::DeserializeOwned;
use serde::{Deserialize, Serialize};
use sha2::{Digest, Sha256};

/// A kind of file: its first bytes, and its ending.
type FileKind = ([u8; 8], &'static str);
const MESH: FileKind = (*b"\x89PLMESH\n", "pliant-mesh");
const GRID: FileKind = (*b"\x89PLGRID\n", "pliant-grid");
/// Ending of files under way.
const PART: &str = "pliant-mesh-part";
/// Bytes that all files may take together unless the caller says otherwise.
const DEFAULT_LIMIT: u64 = 1 << 30;
/// Names the folder, or says `off`.
const VARIABLE: &str = "PLIANT_CACHE";

/// Cache for meshes of images.
#[derive(Clone, Debug, Default)]
pub struct MeshCache {
    folder: Option<PathBuf>,
    /// Bytes that all files may take together; the ones used longest ago go first.
    limit: u64,
}

/// A mesh as it was made, with its report.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct Kept {
    pub mesh: Mesh,
    pub notes: Vec<String>,
    pub doubts: Vec<String>,
}

/// The body of a file.
#[derive(Serialize, Deserialize)]
struct Body {
    points: Vec<[f64; 3]>,
    blocks: Vec<CellBlock>,
    point_data: BTreeMap<String, DataArray>,
    notes: Vec<String>,
    doubts: Vec<String>,
}

/// Distances to a surface on a grid as they were made, with their remarks.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub(crate) struct KeptGrid {
    pub origin: [f64; 3],
    pub spacing: f64,
    pub counts: [u32; 3],
    pub values: Vec<f32>,
    pub thickness: f64,
    pub points: Vec<[f64; 3]>,
    pub triangles: Vec<[u32; 3]>,
    pub notes: Vec<String>,
}

impl KeptGrid {
    /// True if the grid is complete, and its numbers are valid.
    fn is_sound(&self) -> bool {
        let points = self.counts.iter().try_fold(1_usize, |points, &n| points.checked_mul(n as usize));
        let finite = |place: &[f64; 3]| place.iter().all(|x| x.is_finite());
        points == Some(self.values.len())
            && self.counts.iter().all(|&count| count > 1)
            && self.values.iter().all(|value| value.is_finite())
            && self.points.iter().chain([&self.origin]).all(finite)
            && [self.spacing, self.thickness].iter().all(|length| length.is_finite() && *length > 0.0)
            && self.triangles.iter().flatten().all(|&node| (node as usize) < self.points.len())
    }
}

/// The least [`relative_acoustic_length`] of a volume cell. Those that are made have three quarters as a
/// rule.
const FLATTEST: f64 = 0.05;

/// True if a mesh is complete, and no volume cell is inverted or nearly flat. A checksum only proves that the
/// bytes are as someone wrote them.
fn is_sound(mesh: &Mesh) -> bool {
    let fits = |data: &BTreeMap<String, DataArray>, items: usize| {
        data.values().all(|data| data.values.len().checked_div(data.components) == Some(items))
    };
    let sound = |block: &CellBlock| {
        let whole = block.nodes.len().is_multiple_of(block.kind.node_count())
            && block.nodes.iter().all(|&node| (node as usize) < mesh.points.len())
            && fits(&block.data, block.len());
        let full = |nodes: &[u32]| {
            let points: Vec<Vector3> = nodes.iter().map(|&node| mesh.points[node as usize]).collect();
            relative_acoustic_length(block.kind, &points) > FLATTEST
        };
        whole && (block.kind.dimension() < 3 || block.nodes.chunks_exact(block.kind.node_count()).all(full))
    };
    mesh.points.iter().all(|point| point.iter().all(|x| x.is_finite()))
        && fits(&mesh.point_data, mesh.points.len())
        && mesh.blocks.iter().all(sound)
}

/// Hash of the inputs of a mesh.
#[derive(Clone, Debug, PartialEq, Eq)]
pub(crate) struct Key(String);

impl Key {
    /// Makes the key from the content of an image or a surface, given in pieces, and a recipe with all
    /// parameters of the mesh.
    pub fn new(content: impl FnOnce(&mut dyn FnMut(&[u8])), recipe: &impl std::fmt::Debug) -> Self {
        let mut hash = Sha256::new();
        hash.update(env!("PLIANT_MESHER"));
        hash.update(format!("{recipe:?}"));
        content(&mut |piece| {
            hash.update((piece.len() as u64).to_le_bytes());
            hash.update(piece);
        });
        Self(hash.finalize().iter().map(|byte| format!("{byte:02x}")).collect())
    }
}

/// Folder for files that stay from run to run, and true if the user named it; `None` if nothing is to be
/// kept.
fn folder_of_user() -> Option<(PathBuf, bool)> {
    match std::env::var_os(VARIABLE).filter(|value| !value.is_empty()) {
        Some(value) if value == "off" => None,
        Some(folder) => Some((folder.into(), true)),
        None => {
            let user = etcetera::choose_base_strategy().ok()?;
            Some((etcetera::BaseStrategy::cache_dir(&user).join("pliant"), false))
        }
    }
}

/// Folder for other files that stay from run to run, next to the meshes; `None` if nothing is to be kept.
pub fn cache_folder() -> Option<PathBuf> {
    Some(folder_of_user()?.0)
}

impl MeshCache {
    /// Keeps nothing.
    pub fn off() -> Self {
        Self::default()
    }

    /// Makes a cache in a folder, of a gigabyte at most; the folder is made when it is needed.
    pub fn in_folder(folder: PathBuf) -> Self {
        Self { folder: Some(folder), limit: DEFAULT_LIMIT }
    }

    /// The folder that the variable `PLIANT_CACHE` names, where it does not say `off`; else `pliant/meshes`
    /// in the user's folder for caches.
    pub fn of_user() -> Self {
        match folder_of_user() {
            Some((folder, true)) => Self::in_folder(folder),
            Some((folder, false)) => Self::in_folder(folder.join("meshes")),
            None => Self::off(),
        }
    }

    /// Sets the largest number of bytes.
    pub fn limited(self, limit: u64) -> Self {
        Self { limit, ..self }
    }

    /// True if the cache keeps files.
    pub(crate) fn is_on(&self) -> bool {
        self.folder.is_some()
    }

    /// Returns the mesh under a key, if it is valid.
    pub(crate) fn get(&self, key: &Key) -> Option<Kept> {
        let Body { points, blocks, point_data, notes, doubts } = self.read(key, MESH)?;
        let points = points.into_iter().map(Vector3::from).collect();
        let mesh = Mesh { points, blocks, point_data, ..Mesh::default() };
        is_sound(&mesh).then_some(Kept { mesh, notes, doubts })
    }

    /// Stores a mesh under its key, and deletes the files unused for longest above the limit.
    pub(crate) fn put(&self, key: &Key, kept: &Kept) -> io::Result<()> {
        let Kept { mesh, notes, doubts } = kept.clone();
        let points = mesh.points.into_iter().map(Into::into).collect();
        let body = Body { points, blocks: mesh.blocks, point_data: mesh.point_data, notes, doubts };
        self.write(key, MESH, &body)
    }

    /// The distances that were kept under a key, where they are whole.
    pub(crate) fn get_grid(&self, key: &Key) -> Option<KeptGrid> {
        self.read(key, GRID).filter(KeptGrid::is_sound)
    }

    /// Keeps distances under their key, as [`put`](Self::put) does.
    pub(crate) fn put_grid(&self, key: &Key, kept: &KeptGrid) -> io::Result<()> {
        self.write(key, GRID, kept)
    }

    fn read<T: DeserializeOwned>(&self, key: &Key, kind: FileKind) -> Option<T> {
        let path = self.path(key, kind)?;
        let bytes = fs::read(&path).ok()?;
        let (crc, body) = bytes.strip_prefix(&kind.0)?.split_first_chunk()?;
        if u32::from_le_bytes(*crc) != crc32fast::hash(body) {
            return None;
        }
        let body = postcard::from_bytes(body).ok()?;
        // Used now: it stays longer than others. Where that can't be noted, no harm is done.
        let _ =
            File::options().append(true).open(&path).and_then(|file| file.set_modified(SystemTime::now()));
        Some(body)
    }

    fn write(&self, key: &Key, kind: FileKind, body: &impl Serialize) -> io::Result<()> {
        let (Some(path), Some(folder)) = (self.path(key, kind), &self.folder) else { return Ok(()) };
        let body = postcard::to_stdvec(body).map_err(io::Error::other)?;
        fs::create_dir_all(folder)?;
        let mut file = tempfile::Builder::new().suffix(&format!(".{PART}")).tempfile_in(folder)?;
        file.write_all(&kind.0)?;
        file.write_all(&crc32fast::hash(&body).to_le_bytes())?;
        file.write_all(&body)?;
        file.persist(&path).map_err(|error| error.error)?;
        self.drop_oldest(folder, &path)
    }

    fn path(&self, key: &Key, kind: FileKind) -> Option<PathBuf> {
        Some(self.folder.as_ref()?.join(&key.0).with_extension(kind.1))
    }

    /// Deletes the files unused for longest except the newest, until all files fit the limit.
    fn drop_oldest(&self, folder: &Path, newest: &Path) -> io::Result<()> {
        let endings = [MESH.1, GRID.1, PART];
        let is_ours = |path: &PathBuf| {
            path.extension().is_some_and(|ending| endings.iter().any(|known| ending == *known))
        };
        let mut files: Vec<(SystemTime, PathBuf, u64)> = fs::read_dir(folder)?
            .filter_map(|entry| Some(entry.ok()?.path()).filter(is_ours))
            .filter_map(|path| {
                // Another process may drop it at the same time.
                let about = fs::metadata(&path).ok()?;
                Some((about.modified().ok()?, path, about.len()))
            })
            .collect();
        files.sort();
        let mut total: u64 = files.iter().map(|(.., size)| size).sum();
        for (_, path, size) in files.iter().filter(|(_, path, _)| path != newest) {
            if total <= self.limit {
                break;
            }
            let _ = fs::remove_file(path);
            total -= size;
        }
        Ok(())
    }
}

#[cfg(test)]
mod tests {
    use std::time::Duration;

    use pliant_geometry::CellKind;

    use super::*;

    fn kept(size: usize) -> Kept {
        let mut block = CellBlock::new(CellKind::Tet, vec![0, 1, 2, 3]);
        block.data.insert("label".into(), DataArray::scalar(vec![0.1 + 0.2]));
        let mut mesh = Mesh { points: vec![Vector3::new(0.1, -0.0, 1e-300); size], ..Mesh::default() };
        (0..3).for_each(|axis| mesh.points[axis + 1][axis] += 0.1);
        mesh.blocks.push(block);
        mesh.point_data.insert("normal".into(), DataArray { components: 3, values: vec![1.0; 3 * size] });
        Kept { mesh, notes: vec!["a note".into()], doubts: vec!["a doubt".into()] }
    }

    fn key(name: &str) -> Key {
        Key(name.into())
    }

    #[test]
    fn what_is_kept_comes_back_bit_for_bit_and_nothing_where_it_is_off() {
        let folder = tempfile::tempdir().unwrap();
        let cache = MeshCache::in_folder(folder.path().join("deep"));
        assert_eq!(cache.get(&key("a")), None);
        cache.put(&key("a"), &kept(4)).unwrap();
        assert_eq!(cache.get(&key("a")), Some(kept(4)));
        assert_eq!(cache.get(&key("b")), None);
        MeshCache::off().put(&key("a"), &kept(4)).unwrap();
        assert_eq!(MeshCache::off().get(&key("a")), None);
    }

    #[test]
    fn a_damaged_file_counts_as_missing_and_is_replaced() {
        let folder = tempfile::tempdir().unwrap();
        let cache = MeshCache::in_folder(folder.path().into());
        cache.put(&key("a"), &kept(4)).unwrap();
        let path = cache.path(&key("a"), MESH).unwrap();
        let whole = fs::read(&path).unwrap();
        for length in [0, 4, 9, 12, whole.len() / 2, whole.len() - 1] {
            fs::write(&path, &whole[..length]).unwrap();
            assert_eq!(cache.get(&key("a")), None, "{length} bytes");
        }
        let mut changed = whole.clone();
        changed[whole.len() / 2] ^= 1;
        fs::write(&path, changed).unwrap();
        assert_eq!(cache.get(&key("a")), None);
        cache.put(&key("a"), &kept(4)).unwrap();
        assert_eq!(fs::read(&path).unwrap(), whole);
    }

    #[test]
    fn a_kept_mesh_is_judged_whatever_its_checksum_says() {
        let folder = tempfile::tempdir().unwrap();
        let cache = MeshCache::in_folder(folder.path().into());
        let spoilt: [fn(&mut Mesh); 7] = [
            |mesh| mesh.points[3].z = 1e-9,
            |mesh| mesh.points.swap(0, 1),
            |mesh| mesh.points[1].x = f64::NAN,
            |mesh| mesh.blocks[0].nodes[2] = 99,
            |mesh| mesh.blocks[0].nodes.push(0),
            |mesh| mesh.blocks[0].data.values_mut().for_each(|data| data.values.push(1.0)),
            |mesh| mesh.point_data.values_mut().for_each(|data| data.components = 0),
        ];
        for (number, spoil) in spoilt.into_iter().enumerate() {
            let mut bad = kept(4);
            spoil(&mut bad.mesh);
            cache.put(&key("a"), &bad).unwrap();
            assert_eq!(cache.get(&key("a")), None, "{number}");
        }
    }

    #[test]
    fn distances_are_kept_beside_meshes_and_judged_too() {
        let folder = tempfile::tempdir().unwrap();
        let cache = MeshCache::in_folder(folder.path().into());
        let whole = KeptGrid {
            origin: [0.1, -0.0, 1e-300],
            spacing: 0.1 + 0.2,
            counts: [2, 3, 2],
            values: (0..12).map(|k| 0.1 * k as f32).collect(),
            thickness: 0.02,
            points: vec![[0.0; 3], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0]],
            triangles: vec![[0, 1, 2]],
            notes: vec!["a note".into()],
        };
        cache.put(&key("a"), &kept(4)).unwrap();
        cache.put_grid(&key("a"), &whole).unwrap();
        assert_eq!((cache.get(&key("a")), cache.get_grid(&key("a"))), (Some(kept(4)), Some(whole.clone())));
        let spoilt: [fn(&mut KeptGrid); 6] = [
            |grid| grid.counts[0] = 3,
            |grid| grid.counts = [u32::MAX; 3],
            |grid| grid.values[3] = f32::NAN,
            |grid| grid.spacing = 0.0,
            |grid| grid.points[2][1] = f64::INFINITY,
            |grid| grid.triangles[0][2] = 3,
        ];
        for (number, spoil) in spoilt.into_iter().enumerate() {
            let mut bad = whole.clone();
            spoil(&mut bad);
            cache.put_grid(&key("a"), &bad).unwrap();
            assert_eq!(cache.get_grid(&key("a")), None, "{number}");
        }
        // A mesh under the name of distances.
        std::fs::copy(cache.path(&key("a"), MESH).unwrap(), cache.path(&key("a"), GRID).unwrap()).unwrap();
        assert_eq!(cache.get_grid(&key("a")), None);
    }

    #[test]
    fn the_files_used_last_stay_and_those_of_others_are_let_alone() {
        let folder = tempfile::tempdir().unwrap();
        let cache = MeshCache::in_folder(folder.path().into());
        fs::write(folder.path().join("thesis.tex"), vec![0; 10_000]).unwrap();
        let size = |cache: &MeshCache| fs::metadata(cache.path(&key("a"), MESH).unwrap()).unwrap().len();
        for (age, name) in [(30, "a"), (20, "b"), (10, "c")] {
            cache.put(&key(name), &kept(40)).unwrap();
            let file = File::options().append(true).open(cache.path(&key(name), MESH).unwrap()).unwrap();
            file.set_modified(SystemTime::now() - Duration::from_secs(age)).unwrap();
        }
        // The first is used again, so that the second is the oldest.
        assert!(cache.get(&key("a")).is_some());
        let limit = 3 * size(&cache);
        cache.clone().limited(limit).put(&key("d"), &kept(40)).unwrap();
        let left = ["a", "b", "c", "d"].map(|name| cache.get(&key(name)).is_some());
        assert_eq!(left, [true, false, true, true]);
        cache.clone().limited(0).put(&key("e"), &kept(40)).unwrap();
        assert_eq!(fs::read_dir(folder.path()).unwrap().count(), 2);
        assert!(cache.get(&key("e")).is_some());
    }
}
