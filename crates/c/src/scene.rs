//! Scenes: from a file or a text, with other values and meshes of the program. Simulations are made from
//! scenes.

use std::ffi::c_char;
use std::path::Path;
use std::sync::{Arc, Mutex};

use pliant_format::source::Source;
use pliant_geometry::{CellBlock, CellKind, DataArray, Mesh, Vector3};

use crate::context::{Item, PliantContext, call};
use crate::lock::lock;
use crate::open::OpenScene;
use crate::pointers::{array, finite, give, needed, some_text, text};
use crate::status::{Fault, PliantError, PliantStatus};

/// A scene that is open: a number that `pliant_scene_load` or `pliant_scene_parse` gives, never 0.
pub type PliantScene = u64;

/// Cells of a mesh of the program are lines of two nodes.
pub const PLIANT_LINES: u32 = 3;
/// Cells are triangles.
pub const PLIANT_TRIANGLES: u32 = 5;
/// Cells are quadrilaterals.
pub const PLIANT_QUADS: u32 = 9;
/// Cells are tetrahedra.
pub const PLIANT_TETS: u32 = 10;
/// Cells are hexahedra.
pub const PLIANT_HEXES: u32 = 12;

/// Cells of one kind, numbered as in VTK. The library copies them.
#[repr(C)]
#[derive(Clone, Copy, Debug)]
pub struct PliantCells {
    /// `PLIANT_TETS` or another kind, with the numbers of VTK.
    pub kind: u32,
    /// Number of cells.
    pub count: usize,
    /// Nodes of all cells, cell after cell, counted from 0.
    pub nodes: *const u32,
    /// A label for each cell, or null.
    pub labels: *const i32,
}

/// Opens a scene: the path of a scene file, or of a folder with a `scene.toml`. A simulation that is made of
/// it reports mistakes in its values.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn pliant_scene_load(
    context: *const PliantContext,
    path: *const c_char,
    scene: *mut PliantScene,
    error: *mut PliantError,
) -> PliantStatus {
    // SAFETY: the caller promises valid pointers.
    unsafe {
        call(context, 0, error, |context| {
            needed(scene, "scene")?;
            let path = Path::new(text(path, "path")?);
            let (source, folder) = pliant_format::open(path).map_err(|error| Fault::read(&error))?;
            let open = OpenScene::new(source, folder);
            give(scene, "scene", context.open(Item::Scene(Arc::new(Mutex::new(open)))))
        })
    }
}

/// Opens a scene from its text of `length` bytes. Files that it names are relative to `folder`; null is the
/// folder of the process. `name` is the name of the text in errors; null is `scene.toml`.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn pliant_scene_parse(
    context: *const PliantContext,
    scene_text: *const c_char,
    length: usize,
    folder: *const c_char,
    name: *const c_char,
    scene: *mut PliantScene,
    error: *mut PliantError,
) -> PliantStatus {
    // SAFETY: the caller promises valid pointers.
    unsafe {
        call(context, 0, error, |context| {
            needed(scene, "scene")?;
            if length > LONGEST_TEXT {
                let message = format!("the text has {length} bytes; a scene has at most {LONGEST_TEXT}");
                return Err(Fault::new(PliantStatus::Scene, message));
            }
            let bytes = array(scene_text.cast::<u8>(), length, "text")?;
            let words = std::str::from_utf8(bytes).map_err(|error| {
                Fault::new(PliantStatus::NotText, format!("the text is not UTF-8: {error}"))
            })?;
            let folder = some_text(folder, "folder")?.unwrap_or(".");
            let name = some_text(name, "name")?.unwrap_or("scene.toml");
            let source = Source::parse(name, words).map_err(|errors| Fault::scene(&errors, None))?;
            let open = OpenScene::new(source, folder.into());
            give(scene, "scene", context.open(Item::Scene(Arc::new(Mutex::new(open)))))
        })
    }
}

/// Bytes of a scene's text at most, as of files.
const LONGEST_TEXT: usize = 1 << 26;

/// Changes a value of a scene, as `--set` does: `law.tissue.young-modulus=4e3`, `scene.until=2`,
/// `run.precision="single"`.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn pliant_scene_set(
    context: *const PliantContext,
    scene: PliantScene,
    assignment: *const c_char,
    error: *mut PliantError,
) -> PliantStatus {
    // SAFETY: the caller promises valid pointers.
    unsafe {
        call(context, scene, error, |context| {
            let scene = context.scene(scene)?;
            let mut scene = lock(&scene)?;
            let assignment = text(assignment, "assignment")?;
            let assigned = scene.source.assign(assignment);
            assigned
                .map_err(|mistake| Fault::scene(&scene.source.errors(vec![*mistake]), Some(&scene.source)))
        })
    }
}

/// Gives a scene a mesh from memory: bodies take it with `mesh = { given = "NAME" }`. `points` has three
/// numbers [m] a point. Nodes without a cell are a mistake that the simulation reports when it is made. A
/// mesh of the same name takes its place.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn pliant_scene_give_mesh(
    context: *const PliantContext,
    scene: PliantScene,
    name: *const c_char,
    points: *const f64,
    point_count: usize,
    cells: *const PliantCells,
    kinds: usize,
    error: *mut PliantError,
) -> PliantStatus {
    // SAFETY: the caller promises valid pointers.
    unsafe {
        call(context, scene, error, |context| {
            let scene = context.scene(scene)?;
            let mut scene = lock(&scene)?;
            let name = text(name, "name")?;
            let numbers = array(points, point_count.saturating_mul(3), "points")?;
            finite(numbers, "points")?;
            let points = numbers.as_chunks().0.iter().map(|&[x, y, z]| Vector3::new(x, y, z)).collect();
            let mut mesh = Mesh { points, ..Mesh::default() };
            for cells in array(cells, kinds, "cells")? {
                let block = block(cells, point_count)?;
                if mesh.block(block.kind).is_some() {
                    let message = "cells of one kind are given twice: give all of a kind together";
                    return Err(Fault::new(PliantStatus::BadCells, message));
                }
                mesh.blocks.push(block);
            }
            scene.given.meshes.insert(name.to_owned(), Arc::new(mesh));
            Ok(())
        })
    }
}

/// Makes cells of a mesh from cells of the program.
///
/// # Safety
/// Pointers of `cells` are valid, as the caller promises.
unsafe fn block(cells: &PliantCells, points: usize) -> Result<CellBlock, Fault> {
    let kind = match cells.kind {
        PLIANT_LINES => CellKind::Line,
        PLIANT_TRIANGLES => CellKind::Triangle,
        PLIANT_QUADS => CellKind::Quad,
        PLIANT_TETS => CellKind::Tet,
        PLIANT_HEXES => CellKind::Hex,
        other => {
            let message =
                format!("there are no cells of the kind {other}: take PLIANT_TETS or another of its kind");
            return Err(Fault::new(PliantStatus::BadCells, message));
        }
    };
    // SAFETY: as the caller promises.
    let nodes = unsafe { array(cells.nodes, cells.count.saturating_mul(kind.node_count()), "nodes")? };
    if let Some(at) = nodes.iter().position(|&node| node as usize >= points) {
        let (cell, node) = (at / kind.node_count(), nodes[at]);
        let message = format!("cell {cell} has the node {node}, and there are {points} points");
        return Err(Fault::new(PliantStatus::BadCells, message));
    }
    let mut block = CellBlock::new(kind, nodes.to_vec());
    if !cells.labels.is_null() {
        // SAFETY: as the caller promises.
        let labels = unsafe { array(cells.labels, cells.count, "labels")? };
        block.data.insert(
            "label".into(),
            DataArray::scalar(labels.iter().map(|&label| f64::from(label)).collect()),
        );
    }
    Ok(block)
}

/// Closes a scene. Simulations that were made of it stay.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn pliant_scene_close(
    context: *const PliantContext,
    scene: PliantScene,
    error: *mut PliantError,
) -> PliantStatus {
    // SAFETY: the caller promises valid pointers.
    unsafe {
        call(context, scene, error, |context| {
            context.scene(scene)?;
            context.close(scene)
        })
    }
}
