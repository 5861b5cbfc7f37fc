//! `include/pliant.h` matches the crate: this test makes it from the declarations, which have a plain form
//! for that. `PLIANT_BLESS=1 cargo test --release -p pliant-c --test header` writes it.

use std::fmt::Write;
use std::fs;
use std::path::Path;

/// The files with declarations, in the order of the header.
const FILES: [&str; 10] =
    ["status", "version", "scene", "simulation", "buffer", "surface", "values", "tools", "grips", "snapshot"];

const HEAD: &str = "/* Pliant: real-time simulation of soft organs, for C and C++. The guide is docs/guide/c.md.\n \
                    * Made from crates/c/src by crates/c/tests/header.rs. */\n\
                    #ifndef PLIANT_H\n#define PLIANT_H\n\n#include <stddef.h>\n#include <stdint.h>\n\n\
                    #ifdef __cplusplus\nextern \"C\" {\n#endif\n\n\
                    /* All that a program has open. */\ntypedef struct PliantContext PliantContext;\n";
const END: &str = "\n#ifdef __cplusplus\n}\n#endif\n\n#endif\n";

/// Declaration of a name with a type of Rust in C.
fn declared(of: &str, name: &str) -> String {
    for (pointer, constant) in [("*const ", "const "), ("*mut ", "")] {
        if let Some(target) = of.strip_prefix(pointer) {
            // `*mut [f64; 3]` and `*mut *const f64`.
            return match target.starts_with('[') {
                true => declared(target, &format!("(*{name})")),
                false => format!("{constant}{}", declared(target, &format!("*{name}"))),
            };
        }
    }
    if let Some((item, count)) =
        of.strip_prefix('[').and_then(|array| array.strip_suffix(']')?.split_once("; "))
    {
        return declared(item, &format!("{name}[{count}]"));
    }
    let c_type = match of {
        "u8" | "u32" | "u64" | "i32" | "i64" => {
            return format!(
                "{}_t {name}",
                of.replace('u', "uint").replace('i', "int").replace("uintnt", "uint")
            );
        }
        "usize" => "size_t",
        "f64" => "double",
        "c_char" => "char",
        "c_void" => "void",
        "()" => "void",
        record => record,
    };
    format!("{c_type} {name}").trim_end().to_owned()
}

/// `ShortBuffer` as `SHORT_BUFFER`.
fn shouted(name: &str) -> String {
    let parts = name.char_indices().map(|(at, letter)| match letter.is_uppercase() && at > 0 {
        true => format!("_{letter}"),
        false => letter.to_string(),
    });
    parts.collect::<String>().to_uppercase()
}

/// A comment, indented.
fn comment(lines: &[String], indent: &str) -> String {
    let text = lines.join(&format!("\n{indent} * "));
    if lines.is_empty() { String::new() } else { format!("{indent}/* {} */\n", text.trim()) }
}

/// The declarations of a file in C.
fn translated(source: &str) -> String {
    let (mut out, mut docs) = (String::new(), Vec::new());
    let mut lines = source.lines().map(str::trim);
    let mut is_c = false;
    while let Some(line) = lines.next() {
        if let Some(doc) = line.strip_prefix("///") {
            // A link is its text.
            docs.push(doc.trim().replace("[`", "`").replace("`]", "`"));
            continue;
        }
        let words = |start: &str| line.strip_prefix(start).map(|rest| rest.trim_end_matches(';'));
        if let Some((name, value)) = words("pub const ").and_then(|rest| rest.split_once(": u32 = ")) {
            let _ = write!(out, "\n{}#define {name} {value}\n", comment(&docs, ""));
        } else if let Some((name, of)) = words("pub type ").and_then(|rest| rest.split_once(" = ")) {
            let _ = write!(out, "\n{}typedef {};\n", comment(&docs, ""), declared(of, name));
        } else if let Some(name) =
            words("pub struct ").and_then(|rest| rest.strip_suffix(" {")).filter(|_| is_c)
        {
            let _ = write!(out, "\n{}typedef struct {name} {{\n", comment(&docs, ""));
            fields(&mut lines, &mut |docs, field| {
                let (name, of) =
                    field.strip_prefix("pub ").unwrap().trim_end_matches(',').split_once(": ").unwrap();
                let _ = writeln!(out, "{}    {};", comment(docs, "    "), declared(of, name));
            });
            let _ = writeln!(out, "}} {name};");
        } else if let Some(name) =
            words("pub enum ").and_then(|rest| rest.strip_suffix(" {")).filter(|_| is_c)
        {
            let _ = write!(out, "\n{}typedef enum {name} {{\n", comment(&docs, ""));
            fields(&mut lines, &mut |docs, field| {
                let (variant, value) = field.trim_end_matches(',').split_once(" = ").unwrap();
                let constant = format!("{}_{}", shouted(name), shouted(variant));
                let _ = writeln!(out, "{}    {constant} = {value},", comment(docs, "    "));
            });
            let _ = writeln!(out, "}} {name};");
        } else if let Some(rest) = line.split_once("extern \"C\" fn ").map(|(_, rest)| rest).filter(|_| is_c)
        {
            let mut declaration = rest.to_owned();
            while !declaration.ends_with('{') {
                declaration.push(' ');
                declaration.push_str(lines.next().expect("a declaration ends"));
            }
            let (name, rest) = declaration.split_once('(').unwrap();
            let (parameters, result) = rest.split_once(')').unwrap();
            let result = result.trim().trim_end_matches('{').trim().strip_prefix("-> ").unwrap_or("()");
            let arguments = parameters.split(", ").map(|one| one.trim().trim_end_matches(','));
            let arguments = arguments.filter(|one| !one.is_empty()).map(|one| {
                let (name, of) = one.split_once(": ").unwrap();
                declared(of, name)
            });
            let arguments: Vec<String> = arguments.collect();
            let arguments = if arguments.is_empty() { "void".into() } else { arguments.join(", ") };
            let _ = write!(
                out,
                "\n{}{};\n",
                comment(&docs, ""),
                declared(result, &format!("{name}({arguments})"))
            );
        }
        is_c = line == "#[repr(C)]" || line == "#[unsafe(no_mangle)]" || is_c && line.starts_with("#[");
        if !line.starts_with("#[") {
            docs.clear();
        }
    }
    out
}

/// Hands on each field of a struct or an enum with its comment.
fn fields<'s>(lines: &mut impl Iterator<Item = &'s str>, take: &mut dyn FnMut(&[String], &str)) {
    let mut docs = Vec::new();
    for line in lines.take_while(|line| *line != "}") {
        match line.strip_prefix("///") {
            Some(doc) => docs.push(doc.trim().to_owned()),
            None => {
                take(&docs, line);
                docs.clear();
            }
        }
    }
}

#[test]
fn the_header_is_that_of_the_crate() {
    let folder = Path::new(env!("CARGO_MANIFEST_DIR"));
    let mut made = HEAD.to_owned();
    for name in FILES {
        made += &translated(&fs::read_to_string(folder.join(format!("src/{name}.rs"))).unwrap());
    }
    made += END;
    let path = folder.join("include/pliant.h");
    if std::env::var_os("PLIANT_BLESS").is_some() {
        fs::write(&path, &made).unwrap();
    }
    let kept = fs::read_to_string(&path).unwrap_or_default();
    assert!(kept == made, "include/pliant.h is out of date: see the top of this file");
    // Every call is declared: those that the library shows by name.
    let calls = FILES.map(|name| fs::read_to_string(folder.join(format!("src/{name}.rs"))).unwrap());
    let shown = calls.iter().map(|text| text.matches("#[unsafe(no_mangle)]").count()).sum::<usize>();
    assert_eq!(made.matches("(const PliantContext *context,").count() + 4, shown);
}
