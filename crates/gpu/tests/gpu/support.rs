//! The device tests run on.

use pliant_gpu::{Device, GpuError};
use pliant_testing::found_or_skipped;

/// The best device. Without any a test is skipped with a notice, or fails where `PLIANT_REQUIRE_GPU=1`.
pub fn device() -> Option<Device> {
    match Device::open(None) {
        Err(error) if !matches!(error, GpuError::NoAdapter) => panic!("{error}: {}", error.remedy()),
        found => found_or_skipped(found.map_err(|error| format!("{error} ({})", error.remedy()))),
    }
}
