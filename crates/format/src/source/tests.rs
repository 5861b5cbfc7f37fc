use super::*;

const LIVER: &str = r#"
[scene]
until = 5.0
gravity = [0, 0, -9.81]

[law.parenchyma]
type = "neo-hookean"   # Gewebe
shear-modulus = 3.0e3
mesh.file = "liver.msh"
mesh.scale = 0.01

[[probe]]
at = { node = 3 }
[[probe]]
at = { node = 4 }
"#;

fn liver() -> Source {
    Source::parse("liver.toml", LIVER).unwrap()
}

#[test]
fn a_place_in_the_text_tells_its_key() {
    let source = liver();
    let key = |word: &str| source.key_at(LIVER.find(word).unwrap());
    for (word, expected) in [
        ("5.0", "scene.until"),
        ("-9.81", "scene.gravity.2"),
        ("shear-modulus", "law.parenchyma.shear-modulus"),
        ("[law", "law.parenchyma"),
        ("\"liver.msh", "law.parenchyma.mesh.file"),
        ("4 }", "probe.1.at.node"),
    ] {
        assert_eq!(key(word).as_deref(), Some(expected), "{word}");
    }
    assert_eq!(key("# Gewebe"), None);
}

fn text(place: Place) -> &'static str {
    match place {
        Place::File(span) => &LIVER[span],
        Place::CommandLine => "on the command line",
        Place::Option(..) => "in an option",
    }
}

#[test]
fn every_value_and_key_has_its_place() {
    let source = liver();
    assert_eq!(text(source.span(&["scene", "until"])), "5.0");
    assert_eq!(text(source.key_span(&["scene", "until"])), "until");
    assert_eq!(text(source.span(&["scene", "gravity", "2"])), "-9.81");
    assert_eq!(text(source.span(&["law", "parenchyma"])), "[law.parenchyma]");
    assert_eq!(text(source.key_span(&["law", "parenchyma"])), "parenchyma");
    assert_eq!(text(source.span(&["law", "parenchyma", "mesh", "file"])), "\"liver.msh\"");
    assert_eq!(text(source.span(&["probe", "1", "at", "node"])), "4");
    assert!(matches!(source.node(&["probe", "1", "at", "node"]).unwrap().value, Value::Integer(4)));
}

#[test]
fn the_place_of_what_is_missing_is_the_nearest_around_it() {
    let source = liver();
    assert_eq!(text(source.span(&["law", "parenchyma", "bulk-modulus"])), "[law.parenchyma]");
    assert_eq!(text(source.key_span(&["law", "parenchyma", "bulk-modulus", "x"])), "[law.parenchyma]");
    assert_eq!(text(source.span(&["law", "parenchyma", "mesh", "unit"])), "mesh");
    assert_eq!(text(source.span(&["law", "capsule"])), "law");
    assert_eq!(text(source.span(&["probe", "0", "body"])), "[[probe]]");
    assert_eq!(text(source.span(&["probe", "7", "body"])), "probe");
    assert_eq!(text(source.span(&["scene", "gravity", "3"])), "gravity");
    assert_eq!(text(source.span(&["body"])), "");
}

#[test]
fn tables_keep_the_order_of_the_file() {
    let source = liver();
    let keys = |path: &[&str]| {
        source.node(path).unwrap().entries().iter().map(|(key, _)| key.as_str()).collect::<Vec<_>>()
    };
    assert_eq!(keys(&[]), ["scene", "law", "probe"]);
    assert_eq!(keys(&["law", "parenchyma"]), ["type", "shear-modulus", "mesh"]);
}

#[test]
fn the_command_line_replaces_and_adds() {
    let mut source = liver();
    source.set(&["scene", "until"], 2.0).unwrap();
    source.set(&["run", "device"], "gpu").unwrap();
    source.set(&["scene", "gravity", "3"], 0).unwrap_err();
    assert_eq!(source.span(&["scene", "until"]), Place::CommandLine);
    assert_eq!(text(source.span(&["scene", "gravity"])), "[0, 0, -9.81]");
    assert_eq!(source.node(&["run", "device"]).unwrap().as_str(), Some("gpu"));
    let error = source.set(&["scene", "until", "x"], 1.0).unwrap_err();
    assert_eq!(
        error.message,
        "`scene.until.x` cannot be set: `scene.until` is not a table (given on the command line)"
    );
}

#[test]
fn assignments_are_toml_or_a_single_word() {
    let mut source = liver();
    source.assign("law.parenchyma.shear-modulus = 2e3").unwrap();
    source.assign("run.device=gpu").unwrap();
    source.assign("body.liver={ law = \"parenchyma\" }").unwrap();
    source.assign("scene.gravity.2 = 0").unwrap();
    let value = |path: &[&str]| &source.node(path).unwrap().value;
    assert!(matches!(value(&["law", "parenchyma", "shear-modulus"]), Value::Float(x) if *x == 2e3));
    assert!(matches!(value(&["law", "parenchyma", "type"]), Value::String(_)));
    assert!(matches!(value(&["run", "device"]), Value::String(word) if word == "gpu"));
    assert!(matches!(value(&["body", "liver", "law"]), Value::String(word) if word == "parenchyma"));
    assert!(matches!(value(&["scene", "gravity", "2"]), Value::Integer(0)));
    let place = |path: &[&str]| match source.span(path) {
        Place::Option(text, span) => text[span].to_owned(),
        other => panic!("{other:?}"),
    };
    assert_eq!(place(&["run", "device"]), "gpu");
    assert_eq!(place(&["law", "parenchyma", "shear-modulus"]), "2e3");
    assert_eq!(place(&["body", "liver", "law"]), "\"parenchyma\"");
    for bad in [
        "",
        "run.device",
        "a = 1\nb = 2",
        "scene.gravity.2=1",
        "law.parenchym.x=1",
        "a = 3 4",
        "a = 99999999999999999999",
        "x = \"a",
        "= 3",
    ] {
        assert!(source.assign(bad).is_err(), "{bad}");
    }
}

fn mistake(text: &str) -> (String, String, String) {
    let errors = Source::parse("x.toml", text).unwrap_err();
    let first = &errors.diagnostics()[0];
    let found = text[first.span.clone().unwrap()].to_owned();
    (first.message.clone(), found, first.help.clone().unwrap_or_default())
}

#[test]
fn syntax_errors_have_a_place_and_advice() {
    let expect = |text: &str, message: &str, found: &str, help: &str| {
        let (m, f, h) = mistake(text);
        assert!(m.contains(message) && f == found && h.contains(help), "{text:?}: {m:?} {f:?} {h:?}");
    };
    expect("a = 1\na = 2\n", "`a` is given twice", "a", "remove one");
    expect("[a]\nx = 1\n[a]\nx = 1\ny = 1\n", "`a` is given twice", "a", "remove one");
    expect("element = tet4\n", "`tet4` is not a value", "tet4", "write \"tet4\"");
    expect("solver = implicit\n", "`implicit` is not a value", "implicit", "write \"implicit\"");
    expect("curve = nan-hold # c\n", "`nan-hold` is not a value", "nan-hold", "write \"nan-hold\"");
    expect("element = hex8\n", "`hex8` is not a value", "hex8", "write \"hex8\"");
    expect("a = \nb = 2\n", "a value is missing", "", "");
    expect("a = 3,5\n", "not valid TOML", "", "with a point");
    expect("a = .5\n", "not valid TOML", "", "0.5");
    expect("a = 5.\n", "not valid TOML", "", "5.0");
    expect("[law\na = 1\n", "unclosed table", "", "");
    expect("file = \"C:\\Users\\me.msh\"\n", "not valid TOML", "", "single quotes");
    expect("file = \"C:\\mine.msh\"\n", "not valid TOML", "", "single quotes");
    expect("a = \"b\"c\\d\n", "", "", "");
    expect("a = 99999999999999999999\n", "64 bits", "99999999999999999999", "exponent");
    expect("a = 1e999\n", "64-bit floating point", "1e999", "");
}

#[test]
fn several_syntax_errors_are_all_reported() {
    let errors = Source::parse("x.toml", "a = tet4\nb = 3\nc = 1 2\nd = \n").unwrap_err();
    let lines: Vec<_> = errors.diagnostics().iter().map(|d| errors.line_and_column(d).unwrap().0).collect();
    assert_eq!(lines, [1, 3, 4]);
}

#[test]
fn deep_nesting_is_an_error_or_a_tree_but_no_overflow() {
    for text in [
        format!("a = {}", "[".repeat(50_000)),
        format!("a = {}{}", "[".repeat(50_000), "]".repeat(50_000)),
        format!("a = {}", "{a=".repeat(50_000)),
        format!("{}a = 1", "a.".repeat(50_000)),
        format!("[{}a]", "a.".repeat(50_000)),
    ] {
        let _ = Source::parse("deep.toml", text);
    }
}

#[test]
fn a_byte_order_mark_is_no_mistake() {
    let source = Source::parse("x.toml", "\u{feff}a = 1\r\nb = 2\r\n").unwrap();
    assert_eq!(source.span(&["b"]), Place::File(14..15));
}
