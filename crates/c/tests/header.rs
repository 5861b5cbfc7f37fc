//! `include/pliant.h` is what cbindgen makes of the crate. `PLIANT_BLESS=1 cargo test -p pliant-c --test header` writes it anew.

use std::fs;
use std::path::Path;

#[test]
fn the_header_is_that_of_the_crate() {
    let own = Path::new(env!("CARGO_MANIFEST_DIR"));
    let sources = [
        "buffer",
        "context",
        "grips",
        "scene",
        "simulation",
        "snapshot",
        "status",
        "surface",
        "tools",
        "values",
        "version",
    ];
    let settings = cbindgen::Config::from_file(own.join("cbindgen.toml")).unwrap();
    let builder = sources.iter().fold(cbindgen::Builder::new().with_config(settings), |builder, name| {
        builder.with_src(own.join(format!("src/{name}.rs")))
    });
    let mut made = Vec::new();
    builder.generate().unwrap().write(&mut made);
    let made = String::from_utf8(made).unwrap();
    let path = own.join("include/pliant.h");
    if std::env::var_os("PLIANT_BLESS").is_some() {
        fs::write(&path, &made).unwrap();
    }
    let kept = fs::read_to_string(&path).unwrap_or_default();
    assert!(
        kept == made,
        "include/pliant.h is out of date: PLIANT_BLESS=1 cargo test -p pliant-c --test header"
    );
}
