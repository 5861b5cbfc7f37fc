//! The device tests run on.

use pliant_gpu::{Device, GpuError};

/// The best device. Without any a test is skipped with a notice, or fails where `PLIANT_REQUIRE_GPU=1`.
pub fn device() -> Option<Device> {
    match Device::open(None) {
        Ok(device) => Some(device),
        Err(GpuError::NoAdapter) if std::env::var("PLIANT_REQUIRE_GPU").as_deref() != Ok("1") => {
            eprintln!("skipped: no graphics processor was found ({})", GpuError::NoAdapter.remedy());
            None
        }
        Err(error) => panic!("{error}: {}", error.remedy()),
    }
}
