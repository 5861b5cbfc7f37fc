//! Pictures of bodies. Surfaces are smoothly lit, and coloured by a field or by the labels of their cells.
//! Edges of cells, the shape at rest as a ghost, and sections that show the inside are optional. Any GPU
//! draws them, or Mesa's software Vulkan, into a window or off screen. A series of pictures makes a film.
//! Leaves out: the source of bodies and fields.
//!
//! ```no_run
//! use pliant_geometry::{CellKind, Mesh, Vector3};
//! use pliant_picture::{Camera, Frame, Graphics, Offscreen, Regions, Style, Subject};
//!
//! let points = [[0., 0., 0.], [0.1, 0., 0.], [0., 0.1, 0.], [0., 0., 0.1]];
//! let mut mesh = Mesh { points: points.map(Vector3::from).to_vec(), ..Mesh::default() };
//! mesh.block_mut(CellKind::Tet).nodes.extend([0, 1, 2, 3]);
//!
//! let graphics = Graphics::open()?;
//! let subject = Subject::new(&mesh);
//! let mut offscreen = Offscreen::new(&graphics, &subject, [640, 480])?;
//! let frame = Frame { points: mesh.points.clone(), values: vec![0.0, 1.0, 2.0, 3.0], critical: None };
//! let style = Style { range: Some([0.0, 3.0]), ..Style::default() };
//! let mut camera = Camera::default();
//! camera.fit(&frame.points, 640.0 / 480.0);
//! let picture = offscreen.draw(&frame, &camera, &style, &Regions::default())?;
//! std::fs::write("tet.png", picture.png()?)?;
//! # Ok::<(), Box<dyn std::error::Error>>(())
//! ```

mod arrows;
mod camera;
mod colour;
mod error;
mod film;
mod graphics;
mod layers;
mod legend;
mod lines;
mod marks;
mod maximum;
mod occlusion;
mod offscreen;
mod outermost;
mod picture;
mod plane;
mod regions;
mod renderer;
mod section;
mod series;
mod sight;
mod style;
mod subject;
mod text;
mod vertex;

pub use arrows::{PointForce, arrow_note, arrow_unit, contact_forces, largest_force};
pub use camera::{Axis, Camera, Projection};
pub use colour::{ColourMap, Extremes, label_colour, noise};
pub use error::PictureError;
pub use film::{AnimatedPng, Film, ffmpeg};
pub use graphics::Graphics;
pub use legend::{Legend, NO_VALUE, beyond, readable, scale_marks, swatches, ticks};
pub use marks::{Mark, Marked, WEIGHT, largest_load, some_of, weight_of};
pub use maximum::{largest_seen, maximum_text};
pub use offscreen::{Frame, Offscreen};
pub use outermost::Outermost;
pub use picture::{Difference, Picture};
pub use plane::Plane;
pub use regions::{Coat, Paint, Regions};
pub use renderer::{Drawn, Renderer, Target};
pub use section::Section;
pub use series::{Look, Series, SeriesError};
pub use sight::Sight;
pub use style::{Background, MISSING, Material, Style, Texture};
pub use subject::{Subject, critical_cell, deformed_points, field_choices, nodal_values, visible};
pub use vertex::drawn_value;
