//! Surfaces for renderers: positions, normals and triangles, copied into buffers of the caller or lent.

use std::ffi::c_char;

use pliant_run::Skin;

use crate::buffer::PliantBuffer;
use crate::context::PliantContext;
use crate::open::{OpenSurface, Running, Vertices};
use crate::pointers::{give, needed, some_text};
use crate::simulation::{PLIANT_BODIES, PLIANT_SURFACES, PliantSimulation, names, running};
use crate::status::{Fault, PliantError, PliantStatus};

impl Running {
    pub(crate) fn surface(&mut self, number: u32) -> Result<&mut OpenSurface, Fault> {
        let open = self.surfaces.len();
        self.surfaces.get_mut(number as usize).ok_or_else(|| {
            let message = format!("there is no surface {number}: {open} are open in this simulation");
            Fault::new(PliantStatus::BadHandle, message)
        })
    }

    /// Brings places of a surface to the instant, and its normals if they are wanted: those that are chosen.
    fn bring(
        &mut self,
        number: u32,
        normals: bool,
        choose: impl FnOnce(&mut OpenSurface) -> (&Skin, &mut Vertices),
    ) -> Result<&Vertices, Fault> {
        self.see_places()?;
        self.surface(number)?;
        let Self { world, simulation, surfaces, .. } = self;
        let (skin, chosen) = choose(&mut surfaces[number as usize]);
        skin.positions(world, simulation, |vertex, place| chosen.places[vertex] = place);
        if normals {
            skin.normals(&chosen.places, &mut chosen.normals);
        }
        Ok(chosen)
    }
}

/// Sizes of a surface.
#[repr(C)]
#[derive(Clone, Copy, Debug)]
pub struct PliantSurface {
    /// Its number in the simulation, for the calls below.
    pub number: u32,
    /// Its vertices.
    pub vertices: u32,
    /// Its triangles.
    pub triangles: u32,
}

/// Opens the boundary of a body, or a surface that one carries, by name; null is the only body. Of a solid
/// only nodes on the boundary are vertices. It stays open as long as the simulation.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn pliant_surface_open(
    context: *const PliantContext,
    simulation: PliantSimulation,
    name: *const c_char,
    surface: *mut PliantSurface,
    error: *mut PliantError,
) -> PliantStatus {
    // SAFETY: the caller promises valid pointers.
    unsafe {
        running(context, simulation, error, |running| {
            needed(surface, "surface")?;
            let name = some_text(name, "name")?;
            let Some(skin) = Skin::new(&running.world, name) else {
                let known =
                    [names(running, PLIANT_BODIES)?, names(running, PLIANT_SURFACES)?].concat().join(", ");
                return Err(Fault::new(
                    PliantStatus::Unknown,
                    match name {
                        Some(name) => format!("there is no body or surface `{name}`; there are {known}"),
                        None => format!("there are several bodies: name one of {known}"),
                    },
                ));
            };
            let (vertices, triangles) = (skin.rest().len(), skin.triangles().len());
            let found = PliantSurface {
                number: running.surfaces.len() as u32,
                vertices: vertices as u32,
                triangles: triangles as u32,
            };
            let zeros = || vec![[0.0; 3]; vertices];
            let vertices = Vertices { places: zeros(), normals: zeros() };
            running.surfaces.push(OpenSurface { skin, lent: vertices.clone(), copied: vertices });
            give(surface, "surface", found)
        })
    }
}

/// Copies the three vertices of each triangle, counter-clockwise seen from outside. `capacity` is the number
/// of triangles that there is room for.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn pliant_surface_triangles(
    context: *const PliantContext,
    simulation: PliantSimulation,
    surface: u32,
    triangles: *mut u32,
    capacity: usize,
    error: *mut PliantError,
) -> PliantStatus {
    // SAFETY: the caller promises valid pointers.
    unsafe {
        running(context, simulation, error, |running| {
            let faces = running.surface(surface)?.skin.triangles();
            if capacity < faces.len() {
                let message =
                    format!("there is room for {capacity} triangles, but {} are needed", faces.len());
                return Err(Fault::new(PliantStatus::ShortBuffer, message));
            }
            needed(triangles, "triangles")?;
            let flat = faces.as_flattened();
            triangles.cast::<u8>().copy_from_nonoverlapping(flat.as_ptr().cast(), size_of_val(flat));
            Ok(())
        })
    }
}

/// Copies where the vertices are [m].
#[unsafe(no_mangle)]
pub unsafe extern "C" fn pliant_surface_positions(
    context: *const PliantContext,
    simulation: PliantSimulation,
    surface: u32,
    buffer: PliantBuffer,
    error: *mut PliantError,
) -> PliantStatus {
    // SAFETY: the caller promises valid pointers.
    unsafe {
        running(context, simulation, error, |running| {
            running.see_places()?;
            let vertices = running.surface(surface)?.skin.rest().len();
            let Running { world, simulation, surfaces, .. } = running;
            let writer = buffer.writer(vertices)?;
            surfaces[surface as usize]
                .skin
                .positions(world, simulation, |vertex, place| writer.put(vertex, place));
            Ok(())
        })
    }
}

/// Copies the unit normals of the vertices: the mean of the normals of the triangles around each, by area.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn pliant_surface_normals(
    context: *const PliantContext,
    simulation: PliantSimulation,
    surface: u32,
    buffer: PliantBuffer,
    error: *mut PliantError,
) -> PliantStatus {
    // SAFETY: the caller promises valid pointers.
    unsafe {
        running(context, simulation, error, |running| {
            let found = running.bring(surface, true, |open| (&open.skin, &mut open.copied))?;
            let writer = buffer.writer(found.normals.len())?;
            found.normals.iter().enumerate().for_each(|(vertex, &normal)| writer.put(vertex, normal));
            Ok(())
        })
    }
}

/// Lends positions [m] and unit normals, three `double` a vertex. The values stay the same until the next
/// call of this function for this surface. The memory stays until the simulation is closed, and the pointers
/// stay the same. `normals` may be null, which saves their cost.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn pliant_surface_lend(
    context: *const PliantContext,
    simulation: PliantSimulation,
    surface: u32,
    positions: *mut *const f64,
    normals: *mut *const f64,
    error: *mut PliantError,
) -> PliantStatus {
    // SAFETY: the caller promises valid pointers.
    unsafe {
        running(context, simulation, error, |running| {
            needed(positions, "positions")?;
            let lent = running.bring(surface, !normals.is_null(), |open| (&open.skin, &mut open.lent))?;
            give(positions, "positions", lent.places.as_ptr().cast())?;
            if normals.is_null() { Ok(()) } else { give(normals, "normals", lent.normals.as_ptr().cast()) }
        })
    }
}
