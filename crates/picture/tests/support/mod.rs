//! What several tests of pictures use.

use pliant_picture::Graphics;

/// `None` without an adapter, which is a failure if the gate requires one.
pub fn graphics() -> Option<Graphics> {
    match Graphics::open() {
        Ok(graphics) => Some(graphics),
        Err(error) => {
            assert!(std::env::var_os("PLIANT_REQUIRE_GPU").is_none(), "{error}; {}", error.remedy());
            eprintln!("skipped: {error}");
            None
        }
    }
}
