//! The device tests run on.

use std::io::Write;

use pliant_gpu::{Device, GpuError};

/// The best device. Without any a test is skipped with a notice, or fails where `PLIANT_REQUIRE_GPU=1`.
pub fn device() -> Option<Device> {
    match Device::open(None) {
        Ok(device) => Some(device),
        Err(GpuError::NoAdapter) if std::env::var("PLIANT_REQUIRE_GPU").as_deref() != Ok("1") => {
            // Past the capture of what passing tests print. A notice that can't be written is none.
            let notice = format!("skipped: no GPU was found ({})", GpuError::NoAdapter.remedy());
            let _ = writeln!(std::io::stderr(), "{notice}");
            None
        }
        Err(error) => panic!("{error}: {}", error.remedy()),
    }
}
