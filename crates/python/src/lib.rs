//! The native half of the Python package `pliant`: the public classes are Python (`python/pliant`), and call
//! these functions.
//!
//! A simulation is owned and `Send`, so a call that computes moves it to a pool of its own threads and back.
//! The caller waits without the interpreter and looks at signals every 50 ms.

mod arrays;
mod errors;
mod image;
mod jobs;
mod mesh;
mod model;
mod picture;
mod running;
mod scene;
mod simulation;
mod state;

use std::ffi::OsString;

use pyo3::prelude::*;

/// Executes a command line; returns the exit code.
#[pyfunction]
fn main(py: Python<'_>, words: Vec<OsString>) -> u8 {
    py.detach(|| pliant_command::main(words))
}

#[pymodule]
fn _native(module: &Bound<'_, PyModule>) -> PyResult<()> {
    module.add("__version__", env!("CARGO_PKG_VERSION"))?;
    module.add_function(wrap_pyfunction!(main, module)?)?;
    module.add_function(wrap_pyfunction!(scene::parse, module)?)?;
    module.add_function(wrap_pyfunction!(scene::read, module)?)?;
    module.add_function(wrap_pyfunction!(scene::check, module)?)?;
    module.add_function(wrap_pyfunction!(scene::mesh, module)?)?;
    module.add_function(wrap_pyfunction!(scene::build, module)?)?;
    module.add_function(wrap_pyfunction!(model::devices, module)?)?;
    module.add_function(wrap_pyfunction!(scene::scene_of_mesh, module)?)?;
    module.add_function(wrap_pyfunction!(image::read_image, module)?)?;
    module.add_function(wrap_pyfunction!(picture::pixels, module)?)?;
    module.add_class::<mesh::Mesh>()?;
    module.add_class::<image::Image>()?;
    module.add_class::<model::Model>()?;
    module.add_class::<simulation::Simulation>()?;
    module.add_class::<state::State>()
}
