//! The example of a picture without a window leaves a picture.

use std::process::Command;

#[test]
fn a_picture_is_drawn_without_a_window() {
    let test = std::env::current_exe().unwrap();
    let example = test.parent().unwrap().parent().unwrap().join("examples/picture");
    let place = tempfile::tempdir().unwrap();
    let file = place.path().join("block.png");
    let output = Command::new(example).arg(&file).output().unwrap();
    let message = String::from_utf8_lossy(&output.stderr).into_owned();
    if !output.status.success() && std::env::var_os("PLIANT_REQUIRE_GPU").is_none() {
        println!("skipped: {message}");
        return;
    }
    assert!(output.status.success(), "{message}");
    let picture = std::fs::read(file).unwrap();
    assert!(picture.starts_with(b"\x89PNG") && picture.len() > 5000, "{} bytes", picture.len());
}
