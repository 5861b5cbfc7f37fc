//! C and C++ programs against the header and the library as cargo builds them: the examples, every bad input,
//! and times. They are built by `cc` and `c++`, with sanitizers where these have some; without a compiler
//! they are skipped with a notice.

use std::path::{Path, PathBuf};
use std::process::{Command, Output};

const OWN: &str = env!("CARGO_MANIFEST_DIR");

/// The folder of the libraries that this test was built with.
fn libraries() -> PathBuf {
    let deps = std::env::current_exe().unwrap().parent().unwrap().to_owned();
    assert!(deps.join("libpliant_c.so").exists(), "no libpliant_c.so in {}", deps.display());
    deps
}

fn there_is(compiler: &str) -> bool {
    let found = Command::new(compiler).arg("--version").output().is_ok_and(|output| output.status.success());
    if !found {
        println!("skipped: there is no `{compiler}`");
    }
    found
}

/// Address and undefined-behaviour sanitizers, where a program with them runs.
fn sanitizers(compiler: &str, folder: &Path) -> &'static [&'static str] {
    const BOTH: &[&str] = &["-fsanitize=address,undefined", "-fno-sanitize-recover=all"];
    let (source, program) = (folder.join("try.c"), folder.join("try"));
    std::fs::write(&source, "int main(void) { return 0; }\n").unwrap();
    let built = Command::new(compiler).args(BOTH).arg(&source).arg("-o").arg(&program).output();
    let runs = built.is_ok_and(|output| output.status.success())
        && Command::new(&program).output().is_ok_and(|output| output.status.success());
    if !runs {
        println!("without sanitizers: `{compiler}` has none");
    }
    if runs { BOTH } else { &[] }
}

/// Builds a program of one file, with all warnings as errors.
fn build(compiler: &str, standard: &str, file: &Path, folder: &Path, more: &[&str]) -> PathBuf {
    let (program, libraries) = (folder.join("program"), libraries());
    let output = Command::new(compiler)
        .args([standard, "-O2", "-g", "-Wall", "-Wextra", "-Werror"])
        .args(more)
        .arg(file)
        .arg(format!("-I{OWN}/include"))
        .arg(format!("-L{}", libraries.display()))
        .arg(format!("-Wl,-rpath,{}", libraries.display()))
        .args(["-lpliant_c", "-lpthread", "-lm", "-o"])
        .arg(&program)
        .output()
        .unwrap();
    assert!(output.status.success(), "{}", String::from_utf8_lossy(&output.stderr));
    program
}

fn run(program: &Path, arguments: &[&str]) -> String {
    // Before what cargo says, which may name an older build.
    let library_path = libraries();
    let Output { status, stdout, stderr } = Command::new(program)
        .env("LD_LIBRARY_PATH", library_path)
        .args(arguments)
        .current_dir(Path::new(OWN).join("../.."))
        .output()
        .unwrap();
    let (said, errors) = (String::from_utf8_lossy(&stdout), String::from_utf8_lossy(&stderr));
    assert!(status.success(), "{status}: {said}{errors}");
    said.into_owned()
}

/// The force [N] that the finger feels in the end.
fn last_force(said: &str) -> f64 {
    let words = said.lines().last().unwrap().rsplit(' ').nth(1);
    words.unwrap().parse().unwrap()
}

#[test]
fn a_finger_presses_the_liver_in_c_and_cpp() {
    let folder = tempfile::tempdir().unwrap();
    let examples = Path::new(OWN).join("../../examples/6_embed");
    let mut forces = Vec::new();
    for (compiler, standard, file) in [("cc", "-std=c11", "press.c"), ("c++", "-std=c++17", "press.cpp")] {
        if !there_is(compiler) {
            continue;
        }
        let more = sanitizers(compiler, folder.path());
        let program = build(compiler, standard, &examples.join(file), folder.path(), more);
        let said = run(&program, &["scenes/palpation", "36"]);
        println!("{said}");
        forces.push(last_force(&said));
    }
    // The finger is some millimetres deep in the liver by then; both languages do the same.
    assert!(forces.iter().all(|&force| (0.05..5.0).contains(&force) && force == forces[0]), "{forces:?} N");
}

#[test]
fn every_bad_input_is_answered_by_its_code() {
    if !there_is("cc") {
        return;
    }
    let folder = tempfile::tempdir().unwrap();
    let more = [sanitizers("cc", folder.path()), &["-D_POSIX_C_SOURCE=200809L"]].concat();
    let program = build("cc", "-std=c11", &Path::new(OWN).join("tests/c/bad_input.c"), folder.path(), &more);
    assert_eq!(run(&program, &[]), "all as expected\n");
}
