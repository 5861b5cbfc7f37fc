//! Mesh files in and out.
//!
//! Reads Gmsh 1, 2 and 4.1 (`.msh`), legacy VTK (`.vtk`), VTK XML (`.vtu`, `.vtp`), Wavefront OBJ, OFF and
//! STL. Also reads PLY, GIfTI (`.gii`) and FreeSurfer surfaces (`lh.pial`), text and binary. Writes `.vtu`,
//! Gmsh 4.1, OBJ, STL and PLY. The first bytes select the reader if they identify a format, otherwise the
//! extension. Cells are linear: vertex, line, triangle, quad, tet, hex. Wedges and pyramids become tets
//! (`split.rs`). Cells of other kinds are an error if the body would lack them, otherwise they are skipped
//! with a note.

mod base64;
mod cells;
mod cursor;
mod error;
mod freesurfer;
mod gifti;
mod gmsh;
mod obj;
mod off;
mod ply;
mod pvd;
mod regular;
mod stl;
mod surface_out;
mod vtk;
mod vtk_cells;
mod vtu;
mod vtu_write;
mod xml;

use std::ffi::OsStr;
use std::fs;
use std::io::{self, BufWriter, Read, Write};
use std::path::Path;

use nalgebra::Matrix3;

use crate::{Mesh, Vector3};
pub use base64::encode as encode_base64;
pub use error::{MeshFileError, MeshFileProblem, Place};
pub use pvd::{read_pvd, read_torn_pvd};
pub use regular::{open_regular, read_limited};
use surface_out::SurfaceOut;
pub use vtu_write::{PVD_TAIL, VtuOptions, VtuSeries, pvd_entry, pvd_text, save_vtu, write_vtu};
pub use xml::{XmlError, parse_xml};

/// A format of mesh files.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Format {
    /// Gmsh, `.msh`.
    Gmsh,
    /// Legacy VTK, `.vtk`.
    Vtk,
    /// VTK XML unstructured grid, `.vtu`.
    Vtu,
    /// VTK XML poly-data, `.vtp`.
    Vtp,
    /// Wavefront OBJ, `.obj`.
    Obj,
    /// Object file format, `.off`.
    Off,
    /// Stereolithography, `.stl`.
    Stl,
    /// Polygon file format, `.ply`.
    Ply,
    /// GIfTI, `.gii`.
    Gifti,
    /// FreeSurfer, `.pial`, `.white` and others.
    FreeSurfer,
}

impl Format {
    /// The formats that can be read.
    pub const ALL: &[Self] = &[
        Self::Gmsh,
        Self::Vtk,
        Self::Vtu,
        Self::Vtp,
        Self::Obj,
        Self::Off,
        Self::Stl,
        Self::Ply,
        Self::Gifti,
        Self::FreeSurfer,
    ];

    /// The formats that can be written.
    pub const WRITTEN: &[Self] = &[Self::Vtu, Self::Gmsh, Self::Obj, Self::Stl, Self::Ply];

    /// Its name, as people say it.
    pub const fn name(self) -> &'static str {
        match self {
            Self::Gmsh => "Gmsh",
            Self::Vtk => "legacy VTK",
            Self::Vtu => "VTU",
            Self::Vtp => "VTP",
            Self::Obj => "OBJ",
            Self::Off => "OFF",
            Self::Stl => "STL",
            Self::Ply => "PLY",
            Self::Gifti => "GIfTI",
            Self::FreeSurfer => "FreeSurfer",
        }
    }

    /// The ending of its files, without the point.
    pub const fn extension(self) -> &'static str {
        match self {
            Self::Gmsh => "msh",
            Self::Vtk => "vtk",
            Self::Vtu => "vtu",
            Self::Vtp => "vtp",
            Self::Obj => "obj",
            Self::Off => "off",
            Self::Stl => "stl",
            Self::Ply => "ply",
            Self::Gifti => "gii",
            Self::FreeSurfer => "pial",
        }
    }

    /// The format that the ending of a path names, in capitals or not.
    pub fn of_path(path: &Path) -> Option<Self> {
        let extension = path.extension().and_then(OsStr::to_str)?;
        let by_extension = |format: &Self| extension.eq_ignore_ascii_case(format.extension());
        let surface = || freesurfer::NAMES.contains(&extension).then_some(Self::FreeSurfer);
        Self::ALL.iter().copied().find(by_extension).or_else(surface)
    }

    /// Returns the format that the ending of a path names, or else the format of the first bytes of the file.
    pub fn of_file(path: &Path) -> Option<Self> {
        Self::of_path(path).or_else(|| {
            let mut head = Vec::new();
            open_regular(path).ok()?.take(512).read_to_end(&mut head).ok()?;
            Self::of_bytes(&head)
        })
    }

    /// The format identified by the first bytes of a file, for formats that start with a keyword.
    fn of_bytes(bytes: &[u8]) -> Option<Self> {
        let bytes = bytes.strip_prefix(b"\xef\xbb\xbf").unwrap_or(bytes).trim_ascii_start();
        if bytes.starts_with(b"<?xml")
            && bytes[..bytes.len().min(4096)].windows(6).any(|word| word == b"<GIFTI")
        {
            return Some(Self::Gifti);
        }
        let begins: [(&[u8], Self); 11] = [
            (b"$MeshFormat", Self::Gmsh),
            (b"$NOD", Self::Gmsh),
            (b"$Comments", Self::Gmsh),
            (b"# vtk DataFile", Self::Vtk),
            (b"<?xml", Self::Vtu),
            (b"<VTKFile", Self::Vtu),
            (b"ply\n", Self::Ply),
            (b"ply\r", Self::Ply),
            (b"<GIFTI", Self::Gifti),
            (&freesurfer::MAGIC, Self::FreeSurfer),
            (freesurfer::TEXT, Self::FreeSurfer),
        ];
        begins.into_iter().find(|(begin, _)| bytes.starts_with(begin)).map(|(_, format)| format)
    }

    fn list(formats: &[Self]) -> String {
        let named: Vec<String> =
            formats.iter().map(|format| format!("{} (.{})", format.name(), format.extension())).collect();
        named.join(", ")
    }
}

/// Largest mesh file read [bytes].
const LIMIT: u64 = 1 << 32;

/// The content of a mesh file.
#[derive(Clone, Debug, PartialEq)]
pub struct MeshFile {
    /// The mesh, its points and cells in the order of the file.
    pub mesh: Mesh,
    /// The format found, e.g. `Gmsh 2.2 ASCII`.
    pub format: String,
    /// Skipped or changed items, one sentence each.
    pub notes: Vec<String>,
    /// The time that the file gives for its data [s].
    pub time: Option<f64>,
}

/// Reads a mesh file.
pub fn read(path: &Path) -> Result<MeshFile, MeshFileError> {
    let by_ending = Format::of_path(path);
    // A file that cannot be opened is reported first: a missing one is not of an unsupported format.
    let bytes =
        read_limited(path, LIMIT).map_err(|source| MeshFileError::Open { path: path.to_owned(), source })?;
    let by_content = Format::of_bytes(&bytes);
    let Some(format) = by_content.or(by_ending) else {
        return Err(MeshFileError::UnsupportedFormat { path: path.to_owned() });
    };
    let mut file = read_of(path, &bytes, format)?;
    if let Some(ending) = by_ending
        && !file.format.starts_with(ending.name())
    {
        file.notes.push(format!("the extension says {}, but the file is {}", ending.name(), file.format));
    }
    Ok(file)
}

/// Reads a mesh from the bytes of a file. Errors name the file `bytes.EXTENSION`.
pub fn read_bytes(bytes: &[u8], format: Format) -> Result<MeshFile, MeshFileError> {
    read_of(Path::new(&format!("bytes.{}", format.extension())), bytes, format)
}

fn read_of(path: &Path, bytes: &[u8], format: Format) -> Result<MeshFile, MeshFileError> {
    let bytes = bytes.strip_prefix(b"\xef\xbb\xbf").unwrap_or(bytes); // a byte order mark of UTF-8
    let result = match format {
        Format::Gmsh => gmsh::read(bytes),
        Format::Vtk => vtk::read(bytes),
        Format::Vtu | Format::Vtp => vtu::read(bytes),
        Format::Obj => obj::read(bytes),
        Format::Off => off::read(bytes),
        Format::Stl => stl::read(bytes),
        Format::Ply => ply::read(bytes),
        Format::Gifti => gifti::read(bytes),
        Format::FreeSurfer => freesurfer::read(bytes),
    };
    let mut file = result.map_err(|fault| MeshFileError::Content {
        path: path.to_owned(),
        place: fault.place,
        problem: fault.problem,
    })?;
    if bytes[..bytes.len().min(HEAD)].windows(LPS.len()).any(|word| word == LPS) {
        file.turn_from_lps();
    }
    Ok(file)
}

/// Mark of 3D Slicer in the title or the comments of a mesh file whose x runs to the left and y to the back.
const LPS: &[u8] = b"SPACE=LPS";

/// Bytes that are searched for it.
const HEAD: usize = 4096;

impl MeshFile {
    /// Turns the mesh from the axes left, back, head (LPS) to right, front, head (RAS), the axes of images.
    fn turn_from_lps(&mut self) {
        self.mesh.transform(&Matrix3::from_diagonal(&Vector3::new(-1.0, -1.0, 1.0)));
        self.notes.push(
            "the axes of the file, left, back, head (LPS), were turned to the axes of images: right, front, \
             head (RAS)"
                .to_owned(),
        );
    }
}

/// Writes a mesh file in the format of the ending, in place of an older one only once it is complete.
///
/// `.vtu` and `.msh` (Gmsh 4.1) keep everything. `.ply`, `.obj` and `.stl` hold only the triangles and quads:
/// PLY with all their data and sets, OBJ with the cell sets as groups, STL as bare triangles.
pub fn write(path: &Path, mesh: &Mesh) -> Result<(), MeshFileError> {
    let format = Format::of_path(path).filter(|format| Format::WRITTEN.contains(format));
    let Some(format) = format else {
        return Err(MeshFileError::UnwritableFormat { path: path.to_owned() });
    };
    check(path, mesh)?;
    match format {
        Format::Gmsh => {
            check_gmsh(path, mesh)?;
            save(path, |out| gmsh::write(out, mesh))
        }
        Format::Obj => {
            let surface = SurfaceOut::new(path, mesh)?;
            save(path, |out| obj::write(out, &surface))
        }
        Format::Stl => {
            let surface = SurfaceOut::new(path, mesh)?;
            save(path, |out| stl::write(out, &surface))
        }
        Format::Ply => {
            let surface = SurfaceOut::new(path, mesh)?;
            save(path, |out| ply::write(out, &surface, &mesh.point_data, &mesh.point_sets))
        }
        _ => save(path, |out| vtu_write::write(out, mesh, &VtuOptions::default())),
    }
}

/// Writes a file under a temporary name in the same folder, then renames it. Readers find the old file or the
/// new one, never a part.
fn save(path: &Path, write: impl FnOnce(&mut dyn Write) -> io::Result<()>) -> Result<(), MeshFileError> {
    let failed = |source| MeshFileError::Write { path: path.to_owned(), source };
    let Some(name) = path.file_name() else {
        return Err(failed(io::Error::new(io::ErrorKind::InvalidInput, "the path has no file name")));
    };
    remove_left_over(path, name);
    let mut beside = OsStr::new(".").to_owned();
    beside.push(name);
    beside.push(format!(".{}{UNFINISHED}", std::process::id()));
    let beside = path.with_file_name(beside);
    let written = unfinished(&beside).and_then(|file| {
        let mut out = BufWriter::with_capacity(1 << 16, file);
        write(&mut out)?;
        out.flush()?;
        fs::rename(&beside, path)
    });
    written.map_err(|error| {
        // The unfinished file is of no use; the error that led here is the one to report.
        let _ = fs::remove_file(&beside);
        failed(error)
    })
}

/// The ending of a file that is not whole yet.
const UNFINISHED: &str = ".tmp";

/// Makes a file that is locked while it is written, so no other process removes it as stale. The file is new:
/// a link of its name is not followed.
fn unfinished(path: &Path) -> io::Result<fs::File> {
    loop {
        let file = match fs::File::create_new(path) {
            // Left by a killed process that had the same number.
            Err(error) if error.kind() == io::ErrorKind::AlreadyExists => {
                fs::remove_file(path)?;
                continue;
            }
            made => made?,
        };
        // Without locks, no unfinished file is removed either.
        let _ = file.lock();
        if path.exists() {
            return Ok(file);
        }
    }
}

/// Removes unfinished files of this name that no process holds: killed processes left them.
fn remove_left_over(path: &Path, name: &OsStr) {
    let folder = path.parent().filter(|folder| !folder.as_os_str().is_empty()).unwrap_or(Path::new("."));
    let start = format!(".{}.", name.to_string_lossy());
    // Files that can't be listed or removed stay; the file itself is written all the same.
    for entry in fs::read_dir(folder).into_iter().flatten().flatten() {
        let found = entry.file_name().to_string_lossy().into_owned();
        let number = found.strip_prefix(&start).and_then(|rest| rest.strip_suffix(UNFINISHED));
        let ours = number.is_some_and(|number| number.parse::<u32>().is_ok());
        if ours
            && entry.file_type().is_ok_and(|kind| kind.is_file())
            && let Ok(file) = fs::File::open(entry.path())
            && file.try_lock().is_ok()
        {
            let _ = fs::remove_file(entry.path());
        }
    }
}

/// Checks that a mesh is whole: finite points, nodes and sets in range, data of the right length.
fn check(path: &Path, mesh: &Mesh) -> Result<(), MeshFileError> {
    match problem(mesh) {
        Some(problem) => Err(MeshFileError::Mesh { path: path.to_owned(), problem }),
        None => Ok(()),
    }
}

/// The problem of a mesh, if any.
fn problem(mesh: &Mesh) -> Option<String> {
    let points = mesh.points.len();
    if points == 0 || mesh.blocks.iter().all(|block| block.is_empty()) {
        return Some("the mesh has no points or no cells; there is nothing to write".to_owned());
    }
    if let Some(at) = mesh.points.iter().position(|x| !x.iter().all(|x| x.is_finite())) {
        let x = mesh.points[at];
        return Some(format!("point {at} is not finite ({}, {}, {})", x.x, x.y, x.z));
    }
    let wrong = |name: &str, array: &crate::DataArray, items: usize, whose: &str| {
        let fits = array.components > 0 && Some(array.values.len()) == items.checked_mul(array.components);
        let (found, components) = (array.values.len(), array.components);
        (!fits).then(|| {
            format!("data `{name}` have {found} numbers, not {components} for each of {items} {whose}")
        })
    };
    for (name, array) in &mesh.point_data {
        if let Some(problem) = wrong(name, array, points, "points") {
            return Some(problem);
        }
    }
    for (name, set) in &mesh.point_sets {
        if let Some(point) = set.iter().find(|&&point| point as usize >= points) {
            return Some(format!(
                "the set `{name}` contains point {point}, but the mesh has {points} points, counted from 0"
            ));
        }
    }
    let mut components = std::collections::BTreeMap::new();
    for block in &mesh.blocks {
        let kind = block.kind.name();
        if block.nodes.len() % block.kind.node_count() != 0 {
            return Some(format!(
                "the list of nodes of the {kind} cells has {} entries, not a multiple of {}",
                block.nodes.len(),
                block.kind.node_count()
            ));
        }
        if let Some(at) = block.nodes.iter().position(|&node| node as usize >= points) {
            let cell = at / block.kind.node_count();
            return Some(format!(
                "{kind} {cell} uses node {}, but the mesh has {points} points, counted from 0",
                block.nodes[at]
            ));
        }
        for (name, array) in &block.data {
            if let Some(problem) = wrong(name, array, block.len(), &format!("{kind} cells")) {
                return Some(problem);
            }
            if *components.entry(name).or_insert(array.components) != array.components {
                return Some(format!(
                    "data `{name}` have different numbers of components in different kinds of cells"
                ));
            }
        }
        for (name, set) in &block.sets {
            if let Some(cell) = set.iter().find(|&&cell| cell as usize >= block.len()) {
                return Some(format!(
                    "the set `{name}` contains {kind} {cell}, but the mesh has {} {kind} cells, counted from \
                     0",
                    block.len()
                ));
            }
        }
    }
    None
}

/// Gmsh's data have at most 9 components.
fn check_gmsh(path: &Path, mesh: &Mesh) -> Result<(), MeshFileError> {
    let mut arrays = mesh.point_data.iter().chain(mesh.blocks.iter().flat_map(|block| &block.data));
    match arrays.find(|(_, array)| array.components > 9) {
        Some((name, array)) => Err(MeshFileError::Mesh {
            path: path.to_owned(),
            problem: format!(
                "data `{name}` have {} components, but a Gmsh file takes at most 9; write .vtu",
                array.components
            ),
        }),
        None => Ok(()),
    }
}
