//! Pictures off screen.

use std::sync::Mutex;

use numpy::PyArray2;
use pliant_format::tables::ColourBy;
use pliant_picture::{Graphics, Picture};
use pliant_run::field_named;
use pyo3::prelude::*;

use crate::arrays::array;
use crate::errors::Trouble;
use crate::running::Running;

/// The graphics device, opened once for all pictures.
static GRAPHICS: Mutex<Option<Graphics>> = Mutex::new(None);

/// A PNG of the instant as `[view]` shows it, or coloured by another field, seen from another side (azimuth
/// and elevation [degrees]).
pub fn draw(
    running: &mut Running,
    field: Option<&str>,
    size: [u32; 2],
    camera: Option<[f64; 2]>,
) -> Result<Vec<u8>, Trouble> {
    let mut world = (*running.world).clone();
    if let Some(name) = field {
        world.scene.view.colour = Some(ColourBy::Field(field_named(name)?));
        world.scene.view.component = None;
        world.scene.view.range = None;
    }
    world.scene.view.size = size;
    if let Some([azimuth, elevation]) = camera {
        (world.scene.view.camera.azimuth, world.scene.view.camera.elevation) = (azimuth, elevation);
    }
    let look = pliant_command::look_of_world(&world);
    let marks = match world.scene.shown_marks(1.0) {
        Some(marked) => {
            running.show(marked);
            Some(running.live.mesh()?.clone())
        }
        None => None,
    };
    running.show(world.scene.shown(1.0));
    let time = running.simulation().time();
    let mesh = running.live.mesh()?;
    let mut graphics = GRAPHICS.lock().unwrap_or_else(std::sync::PoisonError::into_inner);
    if graphics.is_none() {
        let opened =
            Graphics::open().map_err(|error| Trouble::Device(format!("{error}; {}", error.remedy())))?;
        *graphics = Some(opened);
    }
    let Some(graphics) = &*graphics else { return Err(Trouble::Device("no graphics".into())) };
    let picture = look.picture(graphics, mesh, marks.as_ref(), time);
    let picture = picture.map_err(|error| Trouble::Device(format!("{error}; {}", error.remedy())))?;
    picture.png().map_err(|error| Trouble::Device(format!("{error}; {}", error.remedy())))
}

/// The pixels of a PNG, (n, 4), and how many rows they are.
#[pyfunction]
pub fn pixels<'py>(py: Python<'py>, png: Vec<u8>) -> PyResult<(Bound<'py, PyArray2<u8>>, u32)> {
    let picture = Picture::from_png(&png).map_err(|error| Trouble::Value(error.to_string()))?;
    Ok((array(py, picture.rgba, 4), picture.height))
}
