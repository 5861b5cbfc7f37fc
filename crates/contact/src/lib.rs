//! Contact of soft bodies with rigid things, with each other and with themselves. For rigid things there are
//! [shapes](shape) with their signed distance and [motions](pose) of obstacles and tools. A node that would
//! go into a thing gets the [least correction](touch), with friction. For soft surfaces, [pairs] of their
//! points are found by [trees](tree). For solvers of equations there is a [barrier] that no surface passes.
//! This crate has no solver: the stepper applies the contacts. SI units throughout.
//!
//! A node falls onto a plane:
//!
//! ```
//! use pliant_contact::pose::{Trajectory, Pose};
//! use pliant_contact::shape::Shape;
//! use pliant_contact::touch::{Rigid, Touch};
//!
//! let floor = Rigid { name: "floor".into(), shape: Shape::HalfSpace, trajectory: Trajectory::fixed(Pose::identity()), inside: false, jaw: None };
//! let touch = Touch { friction: 0.3, offset: 0.0 };
//! let (now, predicted) = ([0.0, 0.0, 0.001], [0.002, 0.0, -0.001]);
//! let place = touch.correct(&floor, [0.0, 0.001], now, predicted, [1.0; 3]).unwrap();
//! // Lifted to the plane, and held back by 0.3 of that.
//! assert!(place[2].abs() < 1e-15 && (place[0] - (0.002 - 0.3 * 0.001)).abs() < 1e-15);
//! ```

pub mod barrier;
pub mod face_points;
pub mod grid;
pub mod lag;
mod near;
pub mod pairs;
pub mod pose;
pub mod pressure;
pub mod profile;
pub mod shader;
pub mod shape;
pub mod touch;
pub mod tree;
