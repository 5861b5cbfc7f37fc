//! The GPU against the CPU: laws, shapes, steppers, devices. One program, since each would link all of wgpu.

mod compute;
mod devices;
mod gradients;
mod laws;
mod shapes;
mod shells;
mod stepper;
mod support;
