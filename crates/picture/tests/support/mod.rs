//! Helpers that several tests of pictures share.

use pliant_picture::Graphics;

/// `None` without an adapter, which is a failure if the gate requires one.
pub fn graphics() -> Option<Graphics> {
    pliant_testing::found_or_skipped(Graphics::open().map_err(|error| format!("{error}; {}", error.remedy())))
}
