//! The GPU against the CPU: laws, steppers, devices. One program, since each would link all of wgpu.

mod compute;
mod devices;
mod laws;
mod stepper;
mod support;
