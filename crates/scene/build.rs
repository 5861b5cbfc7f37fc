//! Sets `PLIANT_MESHER` to a hash of the source text of all crates that make meshes of images. Another text
//! gives another key in the cache of meshes. If the sources of these crates are not in the neighbouring
//! folders, the version of this crate stands for them.

use std::collections::hash_map::DefaultHasher;
use std::fs;
use std::hash::Hasher;
use std::path::{Path, PathBuf};

fn main() {
    let mut hash = DefaultHasher::new();
    for name in ["geometry", "imaging", "meshing"] {
        let folder = Path::new("..").join(name).join("src");
        println!("cargo:rerun-if-changed={}", folder.display());
        for file in files(&folder) {
            hash.write(&fs::read(&file).unwrap_or_default());
        }
    }
    let version = std::env::var("CARGO_PKG_VERSION").unwrap_or_default();
    println!("cargo:rustc-env=PLIANT_MESHER={version}-{:016x}", hash.finish());
}

/// Returns the files in a folder and below, in the order of their names.
fn files(folder: &Path) -> Vec<PathBuf> {
    let mut entries: Vec<PathBuf> =
        fs::read_dir(folder).into_iter().flatten().flatten().map(|entry| entry.path()).collect();
    entries.sort();
    entries.into_iter().flat_map(|entry| if entry.is_dir() { files(&entry) } else { vec![entry] }).collect()
}
